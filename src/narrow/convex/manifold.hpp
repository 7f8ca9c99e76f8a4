// SPDX-License-Identifier: MIT
// What the tests of two convex pieces find, in the plane and in space: a gap, or a contact of a few points.
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
    bool located = false; ///< of an overlap: the points are known, too
};

/// What a test says of two shapes.
enum class Verdict
{
    apart,  ///< by more than was asked for
    touch,  ///< they touch, overlap, or are as near as was asked for
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

// Cosines of the angle between a contact's normal and a face (in the plane: a side). No contact appears or
// vanishes by these: they choose which features give its points, and the depth of each point is exact along
// the normal. What the choice must bear is a solver's restlessness: a body that settles tilts by a few tenths
// of a degree from step to step.

/// The normal is a face's own: about 1 degree, which is also how far off the normal is that GJK finds for a
/// gap of a thousandth of the face's size.
inline constexpr double squarely_face = 0.9998;
/// Two faces, or a face and an edge, that will lie flat in a step or two share points already: about 5
/// degrees, at which a face of length 1 stands off by 0.09.
inline constexpr double nearly_face = 0.996;
/// The sine of that angle: an edge is level up to it.
inline constexpr double nearly_level = 0.087;
/// What meets a face squarely may itself be a face at up to 60 degrees: beyond it an edge or vertex meets it.
inline constexpr double other_face = 0.5;
/// Two edges cross in a point, but in one that runs off along them as they get parallel: at 1 degree it moves
/// by 50 times what they do. Below this sine of the angle they are side by side and have two points.
inline constexpr double side_by_side = 0.02;

} // namespace narrow
JOSTLE_NAMESPACE_END
