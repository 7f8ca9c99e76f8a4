// SPDX-License-Identifier: MIT
// Contacts with one element of a surface whose neighbours share its edges: a body that slides over a floor
// must not catch on the edges between its triangles. See docs/inside/contacts.md, "Internal edges".
#pragma once

#include "narrow/parts/part.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The contact of a convex core with b, an element of a mesh or height field. If the answer isn't certain,
/// `gap` is set to their distance.
Answer surface_contact(const Core2& a, const Part<2>& b, double margin, Manifold<2>& manifold, double& gap);
Answer surface_contact(const Core3& a, const Part<3>& b, double margin, Manifold<3>& manifold, double& gap);

/// Whether a part is an element of a mesh without width on another element, which has the contacts.
template <int Dim>
bool is_covered(const Part<Dim>& part);

/// See part_contact_behind().
Answer contact_behind(const Core2& a, const Part<2>& b, bool known, double margin, Manifold<2>& manifold,
                      Answer answer);
Answer contact_behind(const Core3& a, const Part<3>& b, bool known, double margin, Manifold<3>& manifold,
                      Answer answer);

/// For cores within reach of each other: the contact of b as a piece of its surface. `side` is 1 if a is on
/// its front, -1 on its back.
Answer piece_contact(const Core3& a, const Part<3>& b, const Gap<3>& cores, double side, double margin,
                     Manifold<3>& manifold);
/// The core's furthest point through the triangle's plane, wherever the triangle ends.
bool plane_contact(const Core3& a, const Part<3>& b, double side, double margin, Manifold<3>& manifold);

} // namespace narrow
JOSTLE_NAMESPACE_END
