// SPDX-License-Identifier: MIT
// Any two convex shapes in 3D: chooses the algorithm (gjk.hpp, axes.hpp, epa.hpp) that finds their gap.
#pragma once

#include "narrow/convex/core3.hpp"
#include "narrow/convex/manifold.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The distance between cores (without their radii), negative for an overlap; infinite once they are known to
/// be further apart than `enough`. The points are set if the distance is above 0.
void core_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

/// The same for cores that are apart; otherwise returns touch, and the gap is undefined.
Verdict gap_if_apart(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

/// The same as core_gap() with radii, and with points also if the two overlap.
void convex_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

/// Returns whether there is a contact, a gap of up to `margin` included.
bool convex_contact(const Core3& a, const Core3& b, double margin, Manifold<3>& manifold);

/// The contact of a cylinder or cone with a ball around the origin. Unclear if the ball's centre is inside.
[[nodiscard]] Verdict ball_contact(double radius, const Core3& b, double margin, Manifold<3>& manifold);

/// Whether the distance is 0 or less.
bool convex_touch(const Core3& a, const Core3& b);

/// The same for a convex core and the half-space normal . p <= offset (from a's position, in world axes).
void half_space_gap(const Core3& a, const Vec3& normal, double offset, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
