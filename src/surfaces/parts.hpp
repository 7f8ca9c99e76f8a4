// SPDX-License-Identifier: MIT
// A vertex and a triangle, or two edges: their distance, when they meet, and whether an edge crosses a
// triangle.
//
// Seen from the vertex, a triangle is a flat polygon of three corners. Of two edges the differences of a
// point of the second and one of the first make a parallelogram. Either way the distance is the polygon's
// from the origin, and the polygon's corners move straight. So both kinds of pair are computed by the same
// code.
#pragma once

#include <array>
#include <optional>

#include "jostle/surface.hpp"
#include "narrow/math.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace surfaces {

using narrow::Vec3;
using Four = std::array<Vec3, 4>;

enum class Kind
{
    vertex_triangle,
    edge_edge
};

/// Numbers up to 1e60. For many at once, and impacts as well: kernels/kernels.hpp.
PartDistance distance_of(Kind kind, const Four& positions) noexcept;

/// The first time in [0, 1] within `distance`, or nothing: see vertex_triangle_impact().
std::optional<double> impact_of(Kind kind, const Four& from, const Four& to, double distance,
                                double tolerance) noexcept;

/// Whether the edge from p to q has a point in common with the triangle, its border included, decided
/// exactly. Either may be flat or a point. Coordinates as in narrow/shapes/orientation.hpp.
bool crosses(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& triangle) noexcept;

} // namespace surfaces
JOSTLE_NAMESPACE_END
