// SPDX-License-Identifier: MIT
#include "c_api/queries.hpp"
#include "c_api/shape_questions.hpp"
#include "c_api/world.hpp"

namespace jostle::c_api {
namespace {

class WorldFilter
{
  public:
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

template <class F>
void ask(const jostle_world* world, jostle_question kind, const void* queries, std::uint64_t count,
         const jostle_query_filter* filter, unsigned kinds, F&& inside)
{
    const WorldContent& content = open(world);
    with_filter<WorldFilter, ObjectQueryFilter>(filter, count, [&](const auto& wish) {
        content.on([&]<int Dim, Coordinate T>(const World<Dim, T>& typed) {
            with_questions<Dim, T>(kind, queries, count, kinds,
                                   [&](auto asked) { inside(typed, asked, wish); });
        });
    });
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_world_first(const jostle_world* world, jostle_question kind, const void* queries,
                                 uint64_t count, const jostle_query_filter* filter, jostle_hit* hits,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        ask(world, kind, queries, count, filter, lines,
            [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, auto asked, const auto& wish) {
                if constexpr (is_line<typename decltype(asked)::value_type>)
                    ask_first<Hit<T, ObjectId>>(typed, asked, wish, hits, to_c);
            });
    });
}
jostle_status jostle_world_all(const jostle_world* world, jostle_question kind, const void* queries,
                               uint64_t count, const jostle_query_filter* filter, uint64_t max_results,
                               jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        ResultsContent& into = open(results);
        ask(world, kind, queries, count, filter, any_kind,
            [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, auto asked, const auto& wish) {
                ask_all<Hit<T, ObjectId>, ObjectId>(typed, asked, wish, max_results, into, to_c);
            });
    });
}
jostle_status jostle_world_visit(const jostle_world* world, jostle_question kind, const void* query,
                                 const jostle_query_filter* filter, jostle_visit_answer_function visit,
                                 void* context, int32_t* finished, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_function(visit, "visit");
        wanted(finished, "finished");
        ask(world, kind, query, 1, filter, any_kind,
            [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, auto asked, const auto& wish) {
                *finished = ask_visit<T>(typed, asked.front(), wish, visit, context, to_c) ? 1 : 0;
            });
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
            *finished = ask_closest<T>(typed, std::get<World<Dim, T>>(second.world), max_distance, visit,
                                       context, [](ObjectId id) { return to_c(id); });
        });
    });
}
jostle_status jostle_world_any(const jostle_world* world, jostle_question kind, const void* queries,
                               uint64_t count, const jostle_query_filter* filter, uint8_t* any,
                               jostle_error* error)
{
    return guarded(error, [&] {
        ask(world, kind, queries, count, filter, lines | regions,
            [&](const auto& typed, auto asked, const auto& wish) { ask_any(typed, asked, wish, any); });
    });
}
jostle_status jostle_world_count(const jostle_world* world, jostle_question kind, const void* queries,
                                 uint64_t count, const jostle_query_filter* filter, uint64_t* counts,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        ask(world, kind, queries, count, filter, lines | regions,
            [&](const auto& typed, auto asked, const auto& wish) { ask_count(typed, asked, wish, counts); });
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

jostle_status jostle_world_first_hits(const jostle_world* world, const jostle_objects* objects,
                                      const jostle_casts* casts, const jostle_query_filter* filters,
                                      uint64_t filter_count, jostle_id* ids, void* hits, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        content.on([&](const auto& typed) {
            ask_first_hits<WorldFilter, ObjectQueryFilter>(typed, objects, casts, filters, filter_count, ids,
                                                           hits, to_c);
        });
    });
}
jostle_status jostle_world_all_hits(const jostle_world* world, const jostle_objects* objects,
                                    const jostle_casts* casts, const jostle_query_filter* filters,
                                    uint64_t filter_count, uint64_t max_results, jostle_results* results,
                                    jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        ResultsContent& into = open(results);
        content.on([&](const auto& typed) {
            ask_all_hits<WorldFilter, ObjectQueryFilter>(typed, objects, casts, filters, filter_count,
                                                         max_results, into, to_c);
        });
    });
}
jostle_status jostle_world_nearest_shapes(const jostle_world* world, const jostle_objects* objects,
                                          const jostle_objects* near, const jostle_values* max_distances,
                                          const jostle_query_filter* filters, uint64_t filter_count,
                                          jostle_id* ids, void* distances, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        content.on([&](const auto& typed) {
            ask_nearest_shapes<WorldFilter, ObjectQueryFilter>(typed, objects, near, max_distances, filters,
                                                               filter_count, ids, distances, to_c);
        });
    });
}

} // extern "C"
