// SPDX-License-Identifier: MIT
// Contacts of the most common solid shapes, each by a special case; also of circles in 2D. Every one has a
// slow twin in convex3.hpp, which decides if they return unclear: near a corner, or for a shape of zero size.
#pragma once

#include "narrow/convex/gaps3.hpp"
#include "narrow/convex/manifold.hpp"
#include "narrow/kernels/kernels.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Without a square root; the rounding lets pass at least those within `enough`.
template <class Vector>
bool spheres_near(double enough, const Vector& d)
{
    return length2(d) <= enough * enough * (1 + 1e-15);
}
template <class Vector>
[[nodiscard]] bool spheres_touch(double radius_a, double radius_b, const Vector& d)
{
    const double radii = radius_a + radius_b;
    return spheres_near(radii, d) && length(d) <= radii;
}
/// b's centre at d from a's. Source: none needed.
template <int Dim>
[[nodiscard]] Verdict spheres(double radius_a, double radius_b, const V<Dim>& d, double margin,
                              Manifold<Dim>& manifold)
{
    const double radii = radius_a + radius_b, enough = radii + margin;
    if (!spheres_near(enough, d)) return Verdict::apart;
    const double distance = length(d);
    if (!(distance <= enough)) return Verdict::apart;
    V<Dim> n{};
    n[1] = 1;
    if (distance > 0) n = d * (1 / distance);
    manifold.normal = n;
    manifold.count = 1;
    manifold.point[0] = {n * (0.5 * (radius_a + (distance - radius_b))), radii - distance,
                         feature_id(vertex_feature, 0), feature_id(vertex_feature, 0)};
    return Verdict::touch;
}

/// The contact of a capsule and another one or a sphere, which is `a`, from their gap.
void rounds(const Round& a, const Round& b, const Vec3& d, const Gap<3>& gap, double margin,
            Manifold<3>& manifold);

/// The contact of two boxes from their best separating axis: the face that meets the other's face, cut to it,
/// or the point where two edges cross. Source: Gregorius, Robust Contact Creation for Physics Simulations,
/// GDC 2015; Ericson sec. 4.4.1, 5.1.9.
[[nodiscard]] Verdict boxes(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b,
                            const Vec3& d, const BoxAxis& axis, double margin, Manifold<3>& manifold);

// Whether there would be a contact without a margin, to the last digit. Unclear if the two touch or are
// separated by no more than rounding.
[[nodiscard]] Verdict boxes_touch(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b,
                                  const Vec3& d);
[[nodiscard]] Verdict sphere_box_touch(double radius, const Mat3& b, const Vec3& half, const Vec3& d);
[[nodiscard]] Verdict capsule_box_touch(const Vec3& axis, double half_length, double radius, const Mat3& b,
                                        const Vec3& half, const Vec3& d);

/// The contact of a capsule or sphere and a box, from the gap between its segment (or centre) and the box.
[[nodiscard]] Verdict capsule_box(const Vec3& axis, double half_length, double radius, const Mat3& b,
                                  const Vec3& half, const Vec3& d, const CapsuleBoxGap& gap, double margin,
                                  Manifold<3>& manifold);

/// The axis that separates a box around the origin best from a triangle, both in the box's frame. `normal` is
/// unit, from the box to the triangle. Ends early, with a separation above `enough`, once one is found.
/// Source: Akenine-Moeller, Fast 3D Triangle-Box Overlap Testing, J. Graphics Tools 6(1), 2001.
[[nodiscard]] double box_triangle(const Vec3& half, const Vec3 (&corner)[3], double enough, Vec3& normal);

} // namespace narrow
JOSTLE_NAMESPACE_END
