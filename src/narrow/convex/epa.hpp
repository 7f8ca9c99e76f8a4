// SPDX-License-Identifier: MIT
// How deep two cores of any kind overlap: the expanding polytope algorithm.
// Source: van den Bergen, Proximity Queries and Penetration Depth Computation on 3D Game Objects, GDC 2001.
#pragma once

#include "narrow/convex/gjk.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The least overlap of two cores of which gjk() said that they overlap, from its last simplex: gap.distance
/// is minus the depth, and 0 where the difference of the two has no volume. The gap's points are not set.
void expand(const Core3& a, const Core3& b, const Simplex& simplex, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
