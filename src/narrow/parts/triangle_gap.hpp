// SPDX-License-Identifier: MIT
// The gap between a body and a triangle of a surface, by the triangle's plane where that tells it.
#pragma once

#include "narrow/parts/part.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// As core_gap() with a triangle: the distance is more than `enough` where the two are apart by more than
/// that. Boxes that overlap it are told by their axes.
void triangle_gap(const Core3& a, const Core3& triangle, double enough, Gap<3>& cores);

/// Where a core is lowest over the front of a triangle's plane.
struct Lowest
{
    Vec3 up;
    Vec3 p;        ///< of the core
    double height; ///< below 0 where the core comes through the plane
};
Lowest lowest_over(const Core3& a, const Part<3>& triangle);
/// The same by the plane where it tells: a core that is over it is at least that far away, and just as far if
/// its lowest point is over the triangle. How deep cores overlap isn't said: the distance is 0 or less.
void triangle_gap(const Core3& a, const Part<3>& triangle, const Lowest& lowest, double enough,
                  Gap<3>& cores);

} // namespace narrow
JOSTLE_NAMESPACE_END
