// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "narrow/shapes/hull_points.hpp"
#include "narrow/shapes/quickhull.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

/// An edge of a face's border, and the face beyond it. All faces form a closed surface: each edge of a face
/// is one of its neighbour's.
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

/// The faces that result when the triangles of a hull are merged.
struct Merged
{
    /// None if all points are in a line, within the slack. A flat hull has a front and a back.
    std::vector<Face> faces;
    std::vector<Index> corners; ///< the points that stay, ascending
};
/// Merges triangles whose planes are the same except for the points' slack, and straightens their
/// borders.
Merged merge_triangles(const PointSet& points, std::vector<Triangle>&& triangles);

} // namespace narrow::hull
JOSTLE_NAMESPACE_END
