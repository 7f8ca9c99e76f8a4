// SPDX-License-Identifier: MIT
#include <cstring>
#include <variant>

#include "c_api/index.hpp"
#include "c_api/queries.hpp"
#include "jostle/spatial_order.hpp"

namespace jostle::c_api {
namespace {

/// A filter of the caller's as QueryFilter, which refers to it.
class IndexFilter
{
  public:
    using Filter = QueryFilter;
    explicit IndexFilter(const jostle_query_filter* given)
        : given_(read_options(given, "jostle_query_filter"))
    {
        filter.category = view<std::uint32_t>(given_.category, "category");
        filter.mask = view<std::uint32_t>(given_.mask, "mask");
        filter.owner = view<std::uint32_t>(given_.owner, "owner");
        if (given_.asker != nullptr) {
            filter.asker_category = given_.asker->category;
            filter.asker_mask = given_.asker->mask;
            filter.asker_owner = given_.asker->owner;
        }
        if (given_.exclude != nullptr && *given_.exclude != UINT64_MAX) { // what a hit has that is none
            if (*given_.exclude > UINT32_MAX)
                refuse("exclude is " + std::to_string(*given_.exclude) + ", which is no id of an index");
            filter.exclude = static_cast<std::uint32_t>(*given_.exclude);
        }
        if (given_.accept != nullptr) filter.accept = accept_;
    }
    IndexFilter(const IndexFilter&) = delete;
    IndexFilter& operator=(const IndexFilter&) = delete;

    QueryFilter filter;

  private:
    struct Accept
    {
        const jostle_query_filter* given;
        bool operator()(std::uint32_t query, std::uint32_t id) const
        {
            return agreed(given->accept(given->context, query, id));
        }
    };
    jostle_query_filter given_;
    Accept accept_{&given_};
};

/// inside(index, other) of the same type; NULL as the other is the index itself.
template <class F>
void with_other(const jostle_index* index, const jostle_index* other, F&& inside)
{
    const IndexContent& content = open(index);
    const IndexContent& second = other != nullptr ? open(other) : content;
    if (content.space != second.space) refuse("the two indexes are of different spaces");
    content.on([&]<class Typed>(const Typed& typed) { inside(typed, std::get<Typed>(second.held)); });
}

/// Whether the box answers the query, and where: 0 for regions.
template <class Query, int Dim, Coordinate T>
std::optional<T> answer_of(const Query& query, const Aabb<Dim, T>& box)
{
    if constexpr (is_line(kind_of<Query>)) {
        return hit_fraction(query, box);
    } else if constexpr (is_nearest(kind_of<Query>)) {
        T distance;
        if constexpr (std::same_as<Query, Nearest<Dim, T>>)
            distance = squared_distance(query.point, box);
        else
            distance = squared_distance(query.box, box);
        return distance <= query.max_distance * query.max_distance ? std::optional(distance) : std::nullopt;
    } else {
        return overlaps(query, box) ? std::optional(T(0)) : std::nullopt;
    }
}

std::span<const std::uint32_t> ids_of(const std::uint32_t* ids, std::uint64_t count)
{
    return {wanted_array(ids, count, "ids"), static_cast<std::size_t>(count)};
}

} // namespace

template <>
struct WishTo<IndexContent>
{
    using type = IndexFilter;
};
template struct Ask<IndexContent>;
template bool visit_closest(const IndexContent&, const IndexContent&, double,
                            jostle_visit_close_pair_function, void*);
template void join_boxes(IndexContent&, const jostle_boxes*, const jostle_query_filter*, ResultsContent&);
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_index_new(jostle_space space, const jostle_options* options, jostle_index** out,
                               jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<IndexContent>(space, keep(options)));
    });
}

jostle_status jostle_index_build(jostle_index* index, const uint32_t* ids, const jostle_boxes* boxes,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        open(index).on([&]<int Dim, Coordinate T>(BoxIndex<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            if (ids == nullptr)
                typed.build(all);
            else
                typed.build(ids_of(ids, all.size()), all);
        });
    });
}
jostle_status jostle_index_insert(jostle_index* index, const uint32_t* ids, const jostle_boxes* boxes,
                                  jostle_error* error)
{
    return guarded(error, [&] {
        open(index).on([&]<int Dim, Coordinate T>(BoxIndex<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            typed.insert(ids_of(ids, all.size()), all);
        });
    });
}
jostle_status jostle_index_erase(jostle_index* index, const uint32_t* ids, uint64_t count,
                                 jostle_error* error)
{
    return guarded(error, [&] { open(index).on([&](auto& typed) { typed.erase(ids_of(ids, count)); }); });
}
jostle_status jostle_index_move(jostle_index* index, const uint32_t* ids, const jostle_boxes* boxes,
                                jostle_error* error)
{
    return guarded(error, [&] {
        open(index).on([&]<int Dim, Coordinate T>(BoxIndex<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            typed.move(ids_of(ids, all.size()), all);
        });
    });
}
jostle_status jostle_index_contains(const jostle_index* index, const uint32_t* ids, uint64_t count,
                                    uint8_t* contains, jostle_error* error)
{
    return guarded(error, [&] {
        const IndexContent& content = open(index);
        const auto asked = ids_of(ids, count);
        wanted_array(contains, count, "contains");
        content.on([&](const auto& typed) {
            for (std::size_t i = 0; i < asked.size(); ++i)
                contains[i] = typed.contains(asked[i]) ? 1 : 0;
        });
    });
}
jostle_status jostle_index_boxes(const jostle_index* index, const uint32_t* ids, uint64_t count, void* boxes,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        const IndexContent& content = open(index);
        const auto asked = ids_of(ids, count);
        content.on([&]<int Dim, Coordinate T>(const BoxIndex<Dim, T>& typed) {
            auto* const out = wanted_array_of<Aabb<Dim, T>>(boxes, count, "boxes");
            for (std::size_t i = 0; i < asked.size(); ++i) {
                if (!typed.contains(asked[i]))
                    refuse("ids[" + std::to_string(i) + "] is " + std::to_string(asked[i]) +
                               ", which isn't in the index",
                           JOSTLE_INVALID_ARGUMENT, i);
                out[i] = typed.box(asked[i]);
            }
        });
    });
}
jostle_status jostle_index_stats_read(const jostle_index* index, jostle_index_stats* stats,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        open(index).on([&](auto& typed) {
            const IndexStats s = typed.stats();
            write_stats(stats,
                        jostle_index_stats{0, s.objects, s.pages, s.leaves, s.nodes, s.depth, s.bytes,
                                           s.sorts, s.splits},
                        "jostle_index_stats");
        });
    });
}

jostle_status jostle_box_answers(jostle_space space, const jostle_queries* queries, const void* box,
                                 uint8_t* answers, double* at, jostle_error* error)
{
    return guarded(error, [&] {
        in_space(space, [&](auto in) {
            constexpr int dim = decltype(in)::dim;
            using T = typename decltype(in)::T;
            Aabb<dim, T> target;
            std::memcpy(&target, wanted_array_of<T>(box, 2 * dim, "box"), sizeof target);
            WorkingMemory memory;
            with_queries<Verb::visit, false, dim, T>(queries, 1, memory, [&](auto asked) {
                wanted_array(answers, asked.size(), "answers");
                wanted_array(at, asked.size(), "at");
                for (std::size_t i = 0; i < asked.size(); ++i) {
                    const auto found = answer_of(asked[i], target);
                    answers[i] = found ? 1 : 0;
                    at[i] = found.value_or(T(0));
                }
            });
        });
    });
}
jostle_status jostle_spatial_order(jostle_space space, const jostle_boxes* boxes,
                                   const jostle_options* options, uint32_t* order, jostle_error* error)
{
    return guarded(error, [&] {
        const Kept kept = keep(options);
        in_space(space, [&](auto in) {
            const auto given = view<decltype(in)::dim, typename decltype(in)::T>(boxes, "boxes");
            spatial_order(given, {wanted_array_of<std::uint32_t>(order, given.size(), "order"), given.size()},
                          kept.options<FinderOptions>());
        });
    });
}
jostle_status jostle_index_pairs(const jostle_index* index, const jostle_index* other,
                                 jostle_visit_close_pair_function visit, void* context, int32_t* finished,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        wanted_function(visit, "visit");
        wanted(finished, "finished");
        with_other(index, other, [&](const auto& typed, const auto& typed_other) {
            const auto hand_over = [&](std::uint32_t a, std::uint32_t b) {
                return agreed(visit(context, a, b, 0, nullptr));
            };
            *finished = typed.pairs(typed_other, hand_over) ? 1 : 0;
        });
    });
}

} // extern "C"
