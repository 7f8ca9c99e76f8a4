// SPDX-License-Identifier: MIT
// The gap between a body and a triangle of a surface, by the triangle's plane if that is enough.
#pragma once

#include "narrow/parts/part.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Like core_gap() with a triangle: the distance is more than `enough` if the two are further apart than
/// that. Boxes that overlap the triangle are handled by their axes.
void triangle_gap(const Core3& a, const Core3& triangle, double enough, Gap<3>& cores);

/// The lowest place of a core over the front of a triangle's plane.
struct Lowest
{
    Vec3 up;
    Vec3 p;        ///< of the core
    double height; ///< negative if the core passes through the plane
};
Lowest lowest_over(const Core3& a, const Part<3>& triangle);
/// The same by the plane if that is enough: a core over it is at least that far away, and exactly that far if
/// its lowest point is over the triangle. The depth of an overlap isn't computed: the distance is then 0 or
/// less.
void triangle_gap(const Core3& a, const Part<3>& triangle, const Lowest& lowest, double enough,
                  Gap<3>& cores);

} // namespace narrow
JOSTLE_NAMESPACE_END
