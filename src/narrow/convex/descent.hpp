// SPDX-License-Identifier: MIT
// How deep two cores overlap of which one is smooth, from the shapes' own formulas: the overlap along a
// direction is a function on the sphere, whose least value Newton's method finds from a few of the best
// directions tried.
#pragma once

#include "narrow/convex/core3.hpp"
#include "narrow/convex/manifold.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Whether the two are known by more than their support points, and have few enough corners.
bool descends(const Core3& a, const Core3& b);

/// The least overlap of two such cores that touch. `hint` is one more direction to try.
void least_overlap(const Core3& a, const Core3& b, const Vec3& hint, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
