// SPDX-License-Identifier: MIT
// How deep two cores overlap of which one is smooth, or how far they are apart, from the shapes' own
// formulas: the overlap along a direction is a function on the sphere, whose least value Newton's method
// finds.
#pragma once

#include "narrow/convex/gjk.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Whether one of the two is smooth, and both are known by more than their support points.
bool descends(const Core3& a, const Core3& b);

/// The least overlap of two such cores of which gjk() or descend() said that they touch, from gjk()'s last
/// simplex and the direction that was left in the gap. It is that of a direction from which every small turn
/// is for the worse; no other direction has less by more than a thousandth, unless very many come near to
/// that.
void least_overlap(const Core3& a, const Core3& b, const Simplex& simplex, Gap<3>& gap);

/// The signed distance of two such cores that gap.normal shows to be apart, or that nearly touch; infinite
/// once it is known to be more than `enough`. Returns whether that is certain: the points are as far apart as
/// the plane between them says.
bool descend(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
