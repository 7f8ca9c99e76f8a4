// SPDX-License-Identifier: MIT
// A body on a surface touches many of its triangles, whose contacts are merged into one for each direction.
#pragma once

#include "narrow/parts/pair.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// For an arranged pair of a surface and another shape, merges the contacts of one body with similar normals,
/// and numbers the surface's features throughout the surface. A body is a convex shape, or one child of a
/// compound. Other pairs are unchanged.
///
/// The deepest remaining contact gives its normal and parts to all contacts whose normals are within 5
/// degrees of its own, until none is left. Of their points it keeps the deepest, the one furthest from that,
/// the one furthest from the line through both, and the one furthest outside their triangle; in 2D the first
/// two. A point keeps the depth by its own triangle. Ties up to rounding are decided by the order of the
/// parts; and if the deepest point is among others that are as deep up to rounding, the first of the points
/// is the one furthest from it.
template <int Dim>
void merge_contacts(const Placed<Dim>& pair, FoundList<Dim>& found);

} // namespace narrow
JOSTLE_NAMESPACE_END
