// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "c_api/results.hpp"
#include "jostle/jostle.h"

namespace jostle::c_api {

class IndexContent;
class WorldContent;

/// Queries to an index or a world, as the caller gave them. Each is compiled beside what it asks: in
/// index.cpp and world_queries.cpp, by queries.hpp.
template <class Content>
struct Ask
{
    const Content& content;
    const jostle_queries* queries;
    const jostle_objects* objects;
    const jostle_query_filter* filter;

    void any(std::uint8_t* out) const;
    void count(std::uint64_t* out) const;
    void first(jostle_hit* out, void* details) const;
    void all(std::uint64_t max_results, ResultsContent& results) const;
    /// Hands the answers to one query to the caller's function. Whether it never said stop.
    bool visit(jostle_visit_answer_function take, void* context) const;
};
/// Hands the closest pairs to the caller's function. Whether it never said stop.
template <class Content>
bool visit_closest(const Content& content, const Content& other, double max_distance,
                   jostle_visit_close_pair_function visit, void* context);
template <class Content>
void join_boxes(Content& content, const jostle_boxes* boxes, const jostle_query_filter* filter,
                ResultsContent& results);

// Not elsewhere: only there it is known what becomes of a filter.
extern template struct Ask<IndexContent>;
extern template struct Ask<WorldContent>;
extern template bool visit_closest(const IndexContent&, const IndexContent&, double,
                                   jostle_visit_close_pair_function, void*);
extern template bool visit_closest(const WorldContent&, const WorldContent&, double,
                                   jostle_visit_close_pair_function, void*);
extern template void join_boxes(IndexContent&, const jostle_boxes*, const jostle_query_filter*,
                                ResultsContent&);
extern template void join_boxes(WorldContent&, const jostle_boxes*, const jostle_query_filter*,
                                ResultsContent&);

} // namespace jostle::c_api
