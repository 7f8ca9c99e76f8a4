// SPDX-License-Identifier: MIT
#pragma once

#include <cstring>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "c_api/queries.hpp"
#include "c_api/results.hpp"
#include "c_api/shapes.hpp"
#include "jostle/shape_query.hpp"

// Rays, moving shapes and distances against the shapes of an index or a world: one way for both.

namespace jostle::c_api {

template <class Filter>
detail::QueryFilters<Filter> as_query_filters(std::span<const Filter> filters)
{
    if (filters.empty()) return {};
    return filters.size() == 1 ? detail::QueryFilters<Filter>(filters.front())
                               : detail::QueryFilters<Filter>(filters);
}

inline std::uint64_t count_of(const jostle_casts* casts)
{
    const jostle_casts& given = wanted(casts, "casts");
    return given.moving == nullptr ? given.rays.count : given.moving->poses.count;
}

/// inside(queries) with a contiguous range of rays or shapes that move.
template <int Dim, Coordinate T, class F>
void with_casts(const jostle_casts& given, F&& inside)
{
    if (given.moving == nullptr) {
        if (given.displacements.count != 0) refuse("displacements without shapes that move");
        const StridedView<Ray<Dim, T>> rays = view<Ray<Dim, T>>(given.rays, "rays");
        std::vector<Ray<Dim, T>> packed(rays.size());
        for (std::size_t i = 0; i < rays.size(); ++i)
            packed[i] = rays[i];
        return inside(packed);
    }
    if (given.rays.count != 0) refuse("casts has both rays and shapes that move: give one or the other");
    const auto moving = objects_of<Objects, Dim, T>(given.moving, "moving");
    const auto ways = view<Vec<Dim, T>>(given.displacements, "displacements");
    if (moving.shapes.size() != moving.poses.size() || ways.size() != moving.poses.size())
        refuse("there are " + std::to_string(moving.shapes.size()) + " shapes that move, " +
                   std::to_string(moving.poses.size()) + " poses and " + std::to_string(ways.size()) +
                   " displacements: give one of each per shape",
               JOSTLE_SIZE_MISMATCH);
    std::vector<ShapeSweep<Dim, T>> packed(ways.size());
    for (std::size_t i = 0; i < ways.size(); ++i)
        packed[i] = {moving.shapes[i], moving.poses[i], ways[i]};
    inside(packed);
}

/// Ids and the rest of what was found, apart.
template <class Plain, class Found, class Id, class IdOf>
void take_apart(std::span<const Found> found, Id* ids, void* plain, IdOf id_of)
{
    auto* const bytes = static_cast<unsigned char*>(plain);
    for (std::size_t i = 0; i < found.size(); ++i) {
        ids[i] = id_of(found[i].id);
        const Plain& one = found[i];
        std::memcpy(bytes + i * sizeof(Plain), &one, sizeof one);
    }
}

template <class Wish, class Filter, class Asked, class IdOf>
void ask_first_hits(const Asked& asked, const jostle_objects* objects, const jostle_casts* casts,
                    const jostle_query_filter* filters, std::uint64_t filter_count, std::uint64_t* ids,
                    void* hits, IdOf id_of)
{
    constexpr int dim = Asked::dim;
    using T = typename Asked::Number;
    const auto of = objects_of<Objects, dim, T>(objects, "objects");
    const std::uint64_t count = count_of(casts);
    wanted_array(ids, count, "ids");
    auto* const out = wanted_array_of<CastHit<dim, T>>(hits, count, "hits");
    const Filters<Wish, Filter> wishes(filters, filter_count, count);
    with_casts<dim, T>(*casts, [&](const auto& queries) {
        std::vector<typename Asked::FoundShape> found(queries.size());
        asked.first(queries, {of.shapes, of.poses}, found, as_query_filters(wishes.all()));
        take_apart<CastHit<dim, T>>(std::span<const typename Asked::FoundShape>(found), ids, out, id_of);
    });
}

template <class Wish, class Filter, class Asked, class IdOf>
void ask_all_hits(const Asked& asked, const jostle_objects* objects, const jostle_casts* casts,
                  const jostle_query_filter* filters, std::uint64_t filter_count, std::uint64_t max_results,
                  ResultsContent& into, IdOf id_of)
{
    constexpr int dim = Asked::dim;
    using T = typename Asked::Number;
    using Plain = CastHit<dim, T>;
    const auto of = objects_of<Objects, dim, T>(objects, "objects");
    const Filters<Wish, Filter> wishes(filters, filter_count, count_of(casts));
    into.begin();
    with_casts<dim, T>(*casts, [&](const auto& queries) {
        ResultLists<typename Asked::FoundShape> found(into.kept.resource());
        asked.all(queries, {of.shapes, of.poses}, found, as_query_filters(wishes.all()), max_results);
        const auto hits = found.items();
        start(into.lists, true);
        for (std::size_t i = 0; i < found.size(); ++i) {
            into.lists.first.push_back(into.lists.first.back() + found[i].size());
            into.lists.more.push_back(found.more(i) ? 1 : 0);
        }
        for (const auto& hit : hits)
            into.lists.at.push_back(hit.fraction);
        into.lists.ids.resize(hits.size());
        into.bytes.resize(hits.size() * sizeof(Plain));
        take_apart<Plain>(hits, into.lists.ids.data(), into.bytes.data(), id_of);
        into.show(std::span(reinterpret_cast<const Plain*>(into.bytes.data()), hits.size()));
    });
    into.holds = ResultsContent::Holds::lists_and_blocks;
}

template <class Wish, class Filter, class Asked, class IdOf>
void ask_nearest_shapes(const Asked& asked, const jostle_objects* objects, const jostle_objects* near,
                        const jostle_values* max_distances, const jostle_query_filter* filters,
                        std::uint64_t filter_count, std::uint64_t* ids, void* distances, IdOf id_of)
{
    constexpr int dim = Asked::dim;
    using T = typename Asked::Number;
    const auto of = objects_of<Objects, dim, T>(objects, "objects");
    const auto askers = objects_of<Objects, dim, T>(near, "near");
    const StridedView<double> most =
        max_distances == nullptr ? StridedView<double>() : view<double>(*max_distances, "max_distances");
    const std::size_t count = askers.poses.size();
    if (askers.shapes.size() != count || (most.size() != 0 && most.size() != count))
        refuse("near has " + std::to_string(askers.shapes.size()) + " shapes and " + std::to_string(count) +
                   " poses, and there are " + std::to_string(most.size()) +
                   " max_distances: give one of each per shape",
               JOSTLE_SIZE_MISMATCH);
    wanted_array(ids, count, "ids");
    auto* const out = wanted_array_of<Distance<dim, T>>(distances, count, "distances");
    const Filters<Wish, Filter> wishes(filters, filter_count, count);
    std::vector<NearestToShape<dim, T>> queries(count);
    for (std::size_t i = 0; i < count; ++i) {
        queries[i] = {askers.shapes[i], askers.poses[i]};
        if (most.size() != 0) queries[i].max_distance = static_cast<T>(most[i]);
    }
    std::vector<typename Asked::FoundDistance> found(count);
    asked.nearest(queries, {of.shapes, of.poses}, found, as_query_filters(wishes.all()));
    take_apart<Distance<dim, T>>(std::span<const typename Asked::FoundDistance>(found), ids, out, id_of);
}

} // namespace jostle::c_api
