// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "narrow/shapes/hull_points.hpp"
#include "narrow/shapes/quickhull.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

/// Of a border, and of what is beyond it. Face by face they make a closed surface: each side of a face is one
/// of its neighbour's.
struct Side
{
    Index v;      ///< the point where it begins
    Index beyond; ///< the face across it
};
struct Face
{
    Vec3 normal;
    std::vector<Side> loop;
};

/// What is left when the triangles of a hull are put together.
struct Merged
{
    /// None where all points are in a line, within the slack. What is flat has a front and a back.
    std::vector<Face> faces;
    std::vector<Index> corners; ///< the points that stay, ascending
};
/// Puts together triangles whose planes are the same but for the points' slack, and straightens their
/// borders.
Merged merge_triangles(const PointSet& points, std::vector<Triangle>&& triangles);

} // namespace narrow::hull
JOSTLE_NAMESPACE_END
