// SPDX-License-Identifier: MIT
// Computes the points of a contact from the gap between two cores.
#pragma once

#include "narrow/convex/core3.hpp"
#include "narrow/convex/manifold.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The points of a gap with known distance and normal: the nearest points of the two cores if b is moved
/// along the normal until they are clearly apart.
void nearest_when_parted(const Core3& a, const Core3& b, const Gap<3>& cores, Vec3& on_a, Vec3& on_b);

/// Computes the points of the contact from a gap between cores no wider than the radii and `margin`.
void make_manifold(const Core3& a, const Core3& b, const Gap<3>& cores, double margin, Manifold<3>& manifold);

/// The same for a ball and a core, from the gap between its centre and the core.
void make_ball_manifold(double radius, const Core3& b, const Gap<3>& cores, Manifold<3>& manifold);

/// The contact of a convex core with the front (side 1) or back (-1) of a triangle, always along the
/// triangle's normal: for surfaces that continue beyond its sides. Returns whether there is one: only points
/// over or under the triangle count.
bool face_contact(const Core3& a, const Core3& triangle, double side, double margin, Manifold<3>& manifold);

/// The same for a convex core and the half-space normal . p <= offset (from a's position, in world axes).
bool half_space_contact(const Core3& a, const Vec3& normal, double offset, double margin,
                        Manifold<3>& manifold);

/// Keeps the deepest of `candidates`, the one furthest from it, and the two that add most area.
void reduce(const Vec3& normal, ManifoldPoint<3>* candidates, std::uint32_t count, Manifold<3>& manifold);

} // namespace narrow
JOSTLE_NAMESPACE_END
