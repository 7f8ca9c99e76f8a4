// SPDX-License-Identifier: MIT
// Height fields: their triangles are the top of solid ground that extends down to a floor.
#pragma once

#include "narrow/parts/part.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Whether a part is tested as solid ground instead of as a bare triangle.
inline bool is_ground(const Part<3>& part, const Part<3>& other)
{
    return part.surface == Surface::ground && other.surface != Surface::ground && !other.half_space;
}
/// The end of the ground below a corner of its triangle.
Vec3 foot(const Part<3>& ground, std::uint32_t corner);

Answer ground_contact(const Part<3>& ground, const Core3& body, double margin, Manifold<3>& manifold,
                      double& gap);
/// Corrects `gap`, from the bare triangle to a body: a body below is pushed up, and a body that comes from
/// the side belongs to another triangle.
void gap_over_ground(const Part<3>& ground, const Core3& body, Gap<3>& gap);
/// The gap from a body on any side of the ground to its surface, sides or underside.
void gap_around_ground(const Part<3>& ground, const Core3& body, double enough, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
