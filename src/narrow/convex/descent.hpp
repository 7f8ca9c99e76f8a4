// SPDX-License-Identifier: MIT
// The overlap or distance of two cores, at least one of them smooth, from the shapes' formulas: the overlap
// along a direction is a function on the sphere, whose minimum Newton's method finds.
#pragma once

#include "narrow/convex/gjk.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Whether one of the two is smooth, and neither is known only by its support points.
bool descends(const Core3& a, const Core3& b);

/// The least overlap of two such cores that touch according to gjk() or descend(), from gjk()'s last simplex
/// and the direction left in the gap. Every small turn of its direction makes it worse; no other direction is
/// better by more than a thousandth, unless very many come close.
void least_overlap(const Core3& a, const Core3& b, const Simplex& simplex, Gap<3>& gap);

/// The signed distance of two such cores that gap.normal shows to be apart, or that nearly touch; infinite
/// once it is known to be more than `enough`. Returns whether it is certain: the distance of the points
/// equals the separation by the plane between them.
bool descend(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
