// SPDX-License-Identifier: MIT
// A body that lies on a surface touches many of its triangles: their contacts become one for each direction.
#pragma once

#include "narrow/parts/pair.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Of an arranged pair of a surface and what isn't one: makes one contact of those of one body whose normals
/// are alike, and numbers the surface's features throughout the surface. A body is a convex shape, or one
/// child of a compound. Other pairs are left as they are.
///
/// The deepest contact that is left gives its normal and parts to all contacts whose normals are within 5
/// degrees of its own, until none is left. Of their points it keeps the deepest, the one furthest from that,
/// the one furthest from the line of both, and the one furthest outside of their triangle; in the plane the
/// first two. A point keeps the depth that its own triangle has given it. What is equal but for rounding is
/// decided by the order of the parts; and where the deepest point is in the midst of others that are as deep
/// but for rounding, the first of the points is the one furthest from it.
template <int Dim>
void merge_contacts(const Placed<Dim>& pair, FoundList<Dim>& found);

} // namespace narrow
JOSTLE_NAMESPACE_END
