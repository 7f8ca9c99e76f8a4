// SPDX-License-Identifier: MIT
// How deep two polytopes overlap, by separating axes: the normals of faces and the directions across two
// edges. Source: Gottschalk, Lin, Manocha, OBBTree, SIGGRAPH 1996; Ericson sec. 5.2.1.
#pragma once

#include "narrow/convex/core3.hpp"
#include "narrow/convex/manifold.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The least overlap, by every face and every pair of edge directions: quadratic in the edges. It is used for
/// few edges, and is the slow twin of the others. The gap's points are not set.
void gap_by_axes(const Core3& a, const Core3& b, Gap<3>& gap);

/// Whether two solid polyhedra have so few edges that polyhedra_gap is the fastest way.
bool are_small_polyhedra(const Core3& a, const Core3& b);
/// The greatest separation of two small polyhedra by a plane, negative for an overlap; it is the distance if
/// it is 0 or less. Ends early with any plane that separates them by more than `enough`. `gap.normal` may be
/// any direction at first; one along which the two overlap little saves most of the work. Returns false if
/// another algorithm would be faster or safer. Source: Gregorius, The Separating Axis Test between Convex
/// Polyhedra, GDC 2013.
bool polyhedra_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
