// SPDX-License-Identifier: MIT
#include "c_api/queries.hpp"
#include "c_api/world.hpp"

namespace jostle::c_api {
namespace {

class WorldFilter
{
  public:
    using Filter = ObjectQueryFilter;
    explicit WorldFilter(const jostle_query_filter* given)
        : given_(read_options(given, "jostle_query_filter"))
    {
        if (given_.category.count != 0 || given_.mask.count != 0 || given_.owner.count != 0)
            refuse("a world knows its objects' filters: give no category, mask or owner but the asker's");
        if (given_.asker != nullptr) {
            filter.category = given_.asker->category;
            filter.mask = given_.asker->mask;
            filter.owner = given_.asker->owner;
        }
        if (given_.exclude != nullptr) filter.exclude = from_c(*given_.exclude);
        if (given_.accept != nullptr) filter.accept = accept_;
    }
    WorldFilter(const WorldFilter&) = delete;
    WorldFilter& operator=(const WorldFilter&) = delete;

    ObjectQueryFilter filter;

  private:
    struct Accept
    {
        const jostle_query_filter* given;
        bool operator()(std::uint32_t query, ObjectId id) const
        {
            return agreed(given->accept(given->context, query, to_c(id)));
        }
    };
    jostle_query_filter given_;
    Accept accept_{&given_};
};

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_world_any(const jostle_world* world, const jostle_queries* queries,
                               const jostle_objects* objects, const jostle_query_filter* filter, uint8_t* any,
                               jostle_error* error)
{
    return guarded(error, [&] { ask_any<WorldFilter>(open(world), queries, objects, filter, any); });
}
jostle_status jostle_world_count(const jostle_world* world, const jostle_queries* queries,
                                 const jostle_objects* objects, const jostle_query_filter* filter,
                                 uint64_t* counts, jostle_error* error)
{
    return guarded(error, [&] { ask_count<WorldFilter>(open(world), queries, objects, filter, counts); });
}
jostle_status jostle_world_first(const jostle_world* world, const jostle_queries* queries,
                                 const jostle_objects* objects, const jostle_query_filter* filter,
                                 jostle_hit* hits, void* details, jostle_error* error)
{
    return guarded(error,
                   [&] { ask_first<WorldFilter>(open(world), queries, objects, filter, hits, details); });
}
jostle_status jostle_world_all(const jostle_world* world, const jostle_queries* queries,
                               const jostle_objects* objects, const jostle_query_filter* filter,
                               uint64_t max_results, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        ask_all<WorldFilter>(open(world), queries, objects, filter, max_results, open(results));
    });
}
jostle_status jostle_world_visit(const jostle_world* world, const jostle_queries* query,
                                 const jostle_objects* objects, const jostle_query_filter* filter,
                                 jostle_visit_answer_function visit, void* context, int32_t* finished,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        wanted_function(visit, "visit");
        wanted(finished, "finished");
        *finished = ask_visit<WorldFilter>(open(world), query, objects, filter, visit, context) ? 1 : 0;
    });
}
jostle_status jostle_world_closest_pairs(const jostle_world* world, const jostle_world* other,
                                         double max_distance, jostle_visit_close_pair_function visit,
                                         void* context, int32_t* finished, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_function(visit, "visit");
        wanted(finished, "finished");
        const WorldContent& content = open(world);
        const WorldContent& second = other != nullptr ? open(other) : content;
        if (content.space != second.space) refuse("the two worlds are of different spaces");
        content.on([&]<int Dim, Coordinate T>(const World<Dim, T>& typed) {
            *finished =
                ask_closest(typed, std::get<World<Dim, T>>(second.world), max_distance, visit, context) ? 1
                                                                                                        : 0;
        });
    });
}
jostle_status jostle_world_join(jostle_world* world, const jostle_boxes* boxes,
                                const jostle_query_filter* filter, jostle_results* results,
                                jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        ResultsContent& into = open(results);
        if (read_options(filter, "jostle_query_filter").count > 1)
            refuse("a join takes one filter for all boxes");
        const WorldFilter wish(filter);
        content.on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            into.begin();
            typed.join(all, into.joined, wish.filter);
            into.show(std::span<const Pair>(into.joined));
        });
    });
}

} // extern "C"
