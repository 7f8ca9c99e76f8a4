// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "narrow/shapes/hull_points.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

/// A triangle of a hull that grows. Every point outside of the hull waits at one of the triangles that it is
/// above.
struct Triangle
{
    Index v[3];         ///< counterclockwise seen from outside
    Index neighbour[3]; ///< across the side from v[i] to v[i + 1]
    Vec3 normal;        ///< the cross product of two sides, rounded: as long as twice the area
    double doubt;       ///< heights, times that length, of no more than this may have the wrong sign
    Index outside;      ///< the first of the points that wait here, or none
    Index mark;         ///< the round in which it was last seen by the point that was added
    bool alive;         ///< false once a point was added above it
};

/// The exact hull of the points, in triangles, in any order, some of which are no longer alive. `start` are
/// four that span a volume.
std::vector<Triangle> quickhull(const PointSet& points, const Index (&start)[4]);

} // namespace narrow::hull
JOSTLE_NAMESPACE_END
