// SPDX-License-Identifier: MIT
// The results of tests of two convex pieces, in 2D and 3D: a gap, or a contact of a few points.
#pragma once

#include <cstdint>

#include "jostle/contact.hpp"
#include "narrow/math.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A feature's number: 14 bits of index below 2 bits of kind.
inline constexpr std::uint16_t vertex_feature = 0, edge_feature = 0x4000, face_feature = 0x8000;
inline std::uint16_t feature_id(std::uint16_t kind, std::uint32_t index)
{
    return static_cast<std::uint16_t>(kind | (index & 0x3fff));
}

template <int Dim>
struct ManifoldPoint
{
    V<Dim> p; ///< from a's position
    double depth;
    std::uint16_t feature_a, feature_b;
};
/// A contact seen from a's position, in world axes.
template <int Dim>
struct Manifold
{
    V<Dim> normal;
    std::uint32_t count = 0;
    ManifoldPoint<Dim> point[Contact<Dim, double>::max_points];
};

/// Signed distance and the points on the surfaces, both seen from a's position.
template <int Dim>
struct Gap
{
    double distance;
    V<Dim> normal, on_a, on_b;
    bool located = false; ///< for an overlap: the points are known, too
};

/// The answer of a test of two shapes.
enum class Verdict
{
    apart,  ///< by more than requested
    touch,  ///< they touch, overlap, or are as near as requested
    unclear ///< this test can't tell: another one must decide
};

/// The same contact or gap with a and b exchanged.
template <int Dim>
void flip(Manifold<Dim>& manifold)
{
    manifold.normal = -manifold.normal;
    for (std::uint32_t i = 0; i < manifold.count; ++i)
        std::swap(manifold.point[i].feature_a, manifold.point[i].feature_b);
}
template <int Dim>
void flip(Gap<Dim>& gap)
{
    gap.normal = -gap.normal;
    std::swap(gap.on_a, gap.on_b);
}

// Cosines of the angle between a contact's normal and a face (in 2D, a side). These don't decide whether
// there is a contact, only which features give its points, and the depth of each point is exact along the
// normal. The choice must be robust against a solver's jitter: a body that settles tilts by a few tenths of a
// degree from step to step.

/// The normal is that of a face: within about 1 degree, which is also the error of GJK's normal for a gap of
/// a thousandth of the face's size.
inline constexpr double squarely_face = 0.9998;
/// Two faces, or a face and an edge, that will be flat on each other in a step or two already share points:
/// within about 5 degrees, at which a face of length 1 stands off by 0.09.
inline constexpr double nearly_face = 0.996;
/// The sine of that angle: an edge is level up to it.
inline constexpr double nearly_level = 0.087;
/// A face at up to 60 degrees may meet a face squarely; beyond that an edge or vertex meets it.
inline constexpr double other_face = 0.5;
/// Two edges cross in a point, which moves along them as they get parallel: at 1 degree it moves 50 times as
/// far as they do. Below this sine of the angle they count as side by side and have two points.
inline constexpr double side_by_side = 0.02;

} // namespace narrow
JOSTLE_NAMESPACE_END
