// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "jostle/box.hpp"

// Tests of boxes that several rooms need, each written once. `overlaps` in jostle/box.hpp is one of them.

JOSTLE_NAMESPACE_BEGIN

/// Whether a box is valid: lo <= hi on every axis. A box with a NaN isn't.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool valid(const Aabb<Dim, T>& box) noexcept
{
    bool all = true;
    for (int d = 0; d < Dim; ++d)
        all &= box.lo[d] <= box.hi[d];
    return all;
}

/// Whether two boxes have the same bounds; 0 and -0 are the same.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool same(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    bool all = true;
    for (int d = 0; d < Dim; ++d) {
        all &= a.lo[d] == b.lo[d];
        all &= a.hi[d] == b.hi[d];
    }
    return all;
}

/// Whether no point of `inner` lies outside of `outer`.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool inside(const Aabb<Dim, T>& inner, const Aabb<Dim, T>& outer) noexcept
{
    bool all = true;
    for (int d = 0; d < Dim; ++d) {
        all &= outer.lo[d] <= inner.lo[d];
        all &= inner.hi[d] <= outer.hi[d];
    }
    return all;
}

/// `overlaps` without a branch between the axes, for boxes of which the processor can't predict whether they
/// touch.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool overlaps_branchless(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    bool all = true;
    for (int d = 0; d < Dim; ++d) {
        all &= a.lo[d] <= b.hi[d];
        all &= b.lo[d] <= a.hi[d];
    }
    return all;
}

JOSTLE_NAMESPACE_END
