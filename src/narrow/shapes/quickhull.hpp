// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "narrow/shapes/hull_points.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

/// A triangle of a growing hull. Every point outside the hull is assigned to one of the triangles that it is
/// above.
struct Triangle
{
    Index v[3];         ///< counterclockwise seen from outside
    Index neighbour[3]; ///< across the side from v[i] to v[i + 1]
    Vec3 normal;        ///< the cross product of two sides, rounded; its length is twice the area
    double doubt;       ///< a height times that length may have the wrong sign if it is no more than this
    Index outside;      ///< the first of the assigned points, or none
    Index mark;         ///< the round in which it was last seen by the added point
    bool alive;         ///< false once a point was added above it
};

/// The exact hull of the points, in triangles, in any order, some of which are no longer alive. `start` are
/// four that span a volume.
std::vector<Triangle> quickhull(const PointSet& points, const Index (&start)[4]);

} // namespace narrow::hull
JOSTLE_NAMESPACE_END
