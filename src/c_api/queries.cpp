// SPDX-License-Identifier: MIT
#include "c_api/ask.hpp"
#include "c_api/index.hpp"
#include "c_api/world.hpp"

namespace jostle::c_api {
namespace {

/// inside(content) of an index or a world.
template <class F>
void with_structure(const void* handle, F&& inside)
{
    constexpr std::uint64_t index = Behind<jostle_index>::mark, world = Behind<jostle_world>::mark;
    if (mark_of(handle, {index, world}, "jostle_index or jostle_world") == world)
        inside(open(static_cast<const jostle_world*>(handle)));
    else
        inside(open(static_cast<const jostle_index*>(handle)));
}
/// verb(asked) with what is asked of an index or a world.
template <class F>
jostle_status ask_structure(const void* handle, const jostle_queries* queries, const jostle_objects* objects,
                            const jostle_query_filter* filter, jostle_error* error, F&& verb)
{
    return guarded(error, [&] {
        with_structure(handle, [&]<class Content>(const Content& content) {
            verb(Ask<Content>{content, queries, objects, filter});
        });
    });
}

const auto& same_kind(const IndexContent&, const void* other)
{
    return open(static_cast<const jostle_index*>(other));
}
const auto& same_kind(const WorldContent&, const void* other)
{
    return open(static_cast<const jostle_world*>(other));
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_query_any(const void* handle, const jostle_queries* queries,
                               const jostle_objects* objects, const jostle_query_filter* filter, uint8_t* any,
                               jostle_error* error)
{
    return ask_structure(handle, queries, objects, filter, error, [&](const auto& asked) { asked.any(any); });
}
jostle_status jostle_query_count(const void* handle, const jostle_queries* queries,
                                 const jostle_objects* objects, const jostle_query_filter* filter,
                                 uint64_t* counts, jostle_error* error)
{
    return ask_structure(handle, queries, objects, filter, error,
                         [&](const auto& asked) { asked.count(counts); });
}
jostle_status jostle_query_first(const void* handle, const jostle_queries* queries,
                                 const jostle_objects* objects, const jostle_query_filter* filter,
                                 jostle_hit* hits, void* details, jostle_error* error)
{
    return ask_structure(handle, queries, objects, filter, error,
                         [&](const auto& asked) { asked.first(hits, details); });
}
jostle_status jostle_query_all(const void* handle, const jostle_queries* queries,
                               const jostle_objects* objects, const jostle_query_filter* filter,
                               uint64_t max_results, jostle_results* results, jostle_error* error)
{
    return ask_structure(handle, queries, objects, filter, error,
                         [&](const auto& asked) { asked.all(max_results, open(results)); });
}
jostle_status jostle_query_visit(const void* handle, const jostle_queries* query,
                                 const jostle_objects* objects, const jostle_query_filter* filter,
                                 jostle_visit_answer_function visit, void* context, int32_t* finished,
                                 jostle_error* error)
{
    return ask_structure(handle, query, objects, filter, error, [&](const auto& asked) {
        wanted_function(visit, "visit");
        wanted(finished, "finished");
        *finished = asked.visit(visit, context) ? 1 : 0;
    });
}
jostle_status jostle_query_closest_pairs(const void* handle, const void* other, double max_distance,
                                         jostle_visit_close_pair_function visit, void* context,
                                         int32_t* finished, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_function(visit, "visit");
        wanted(finished, "finished");
        with_structure(handle, [&]<class Content>(const Content& content) {
            const Content& second = other == nullptr ? content : same_kind(content, other);
            *finished = visit_closest(content, second, max_distance, visit, context) ? 1 : 0;
        });
    });
}
jostle_status jostle_query_join(const void* handle, const jostle_boxes* boxes,
                                const jostle_query_filter* filter, jostle_results* results,
                                jostle_error* error)
{
    return guarded(error, [&] {
        with_structure(handle, [&]<class Content>(Content& content) { // visitors may join, too
            join_boxes(content, boxes, filter, open(results));
        });
    });
}
jostle_status jostle_query_bounds(const void* handle, int32_t* any, void* box, jostle_error* error)
{
    return guarded(error, [&] {
        with_structure(handle, [&](const auto& content) {
            wanted(any, "any");
            content.on([&]<class Structure>(const Structure& structure) {
                const auto found = structure.bounds();
                using Box = typename std::remove_cvref_t<decltype(found)>::value_type;
                auto* const out = wanted_array_of<Box>(box, 1, "box");
                if (found) *out = *found;
                *any = found ? 1 : 0;
            });
        });
    });
}

} // extern "C"
