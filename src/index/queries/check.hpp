// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "jostle/error.hpp"
#include "jostle/queries.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

// Each throws the `Error` for an invalid query; `number` is its position in the batch, or Error::no_index for
// a single one.
template <int Dim, class T>
void check(const Ray<Dim, T>& ray, std::uint64_t number);
template <int Dim, class T>
void check(const Sweep<Dim, T>& sweep, std::uint64_t number);
template <int Dim, class T>
void check(const Aabb<Dim, T>& region, std::uint64_t number);
template <int Dim, class T>
void check(const Sphere<Dim, T>& sphere, std::uint64_t number);
template <int Dim, class T>
void check(const Frustum<Dim, T>& frustum, std::uint64_t number);
template <int Dim, class T>
void check(const Nearest<Dim, T>& nearest, std::uint64_t number);
template <int Dim, class T>
void check(const NearestToBox<Dim, T>& nearest, std::uint64_t number);

/// Checks how far apart pairs may be.
template <class T>
void check_max_distance(T max_distance);

/// For a batch.
template <class Query>
void check_all(std::span<const Query> queries)
{
    for (std::size_t i = 0; i < queries.size(); ++i)
        check(queries[i], i);
}

/// Throws for boxes that can't be joined: too many to be numbered, or NaN or inverted.
template <int Dim, class T>
void check_joined(const BoxView<Dim, T>& boxes);

/// Throws unless there is room for one result per query.
void check_room(std::size_t queries, std::size_t results);

/// Throws unless the arrays cover all ids below `ids` and are complete. `number` is the query's in a batch
/// with a filter for each.
void check(const QueryFilter& filter, std::uint64_t ids, std::uint64_t number = Error::no_index);

} // namespace index
JOSTLE_NAMESPACE_END
