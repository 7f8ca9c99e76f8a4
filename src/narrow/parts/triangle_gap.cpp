// SPDX-License-Identifier: MIT
#include "narrow/parts/triangle_gap.hpp"

#include "narrow/convex/convex3.hpp"
#include "narrow/convex/simple3.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

bool is_over(const Part<3>& triangle, const Vec3& p)
{
    const Core3& core = triangle.core;
    const Vec3 local = core.frame.r.back(p - core.frame.p), n = core.polytope.normal(0);
    Vec3 from = core.polytope.vertex(2);
    bool over = true; // hard to predict, so no branches
    for (std::uint32_t i = 0; i < 3; ++i) {
        const Vec3 to = core.polytope.vertex(i);
        over &= dot(cross(to - from, local - from), n) >= 0;
        from = to;
    }
    return over;
}

/// Whether the axes of a box determine its overlap with a triangle, or that it is further away than `enough`.
bool told_by_axes(const Core3& box, const Core3& triangle, double enough, Gap<3>& cores)
{
    const Vec3 half = box.polytope.vertex(7); // the last corner
    Vec3 corner[3];
    for (std::uint32_t i = 0; i < 3; ++i)
        corner[i] = box.frame.r.back(triangle.frame * triangle.polytope.vertex(i) - box.frame.p);
    cores.distance = box_triangle(half, corner, enough, cores.normal);
    cores.normal = box.frame.r * cores.normal;
    return cores.distance <= 0 || cores.distance > enough;
}

} // namespace

Lowest lowest_over(const Core3& a, const Part<3>& triangle)
{
    const Vec3 up = triangle.normal, p = furthest(a, -up);
    return {up, p, dot(up, p - triangle.first_corner())};
}

void triangle_gap(const Core3& a, const Core3& triangle, double enough, Gap<3>& cores)
{
    if (!(a.is_box && told_by_axes(a, triangle, enough, cores))) core_gap(a, triangle, enough, cores);
}

void triangle_gap(const Core3& a, const Part<3>& triangle, const Lowest& lowest, double enough, Gap<3>& cores)
{
    cores.distance = lowest.height;
    if (lowest.height > enough) return;
    // Nearer than that the search decides, which touching() uses.
    if (lowest.height > uncertain(a, triangle.core) && is_over(triangle, lowest.p)) {
        cores.normal = -lowest.up;
        cores.on_a = lowest.p;
        cores.on_b = lowest.p - lowest.up * lowest.height;
    } else if (!(a.is_box && told_by_axes(a, triangle.core, enough, cores))) {
        if (gap_if_apart(a, triangle.core, enough, cores) != Verdict::apart) cores.distance = 0;
    }
}

} // namespace narrow
JOSTLE_NAMESPACE_END
