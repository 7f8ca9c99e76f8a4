// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "jostle/query.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

// Each throws the `Error` for a question that can't be answered; `number` is its place in the batch, or
// Error::no_index for a single one.
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

/// Throws unless the arrays cover all ids below `ids` and belong together.
void check(const QueryFilter& filter, std::uint64_t ids);

} // namespace index
JOSTLE_NAMESPACE_END
