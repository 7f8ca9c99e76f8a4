// SPDX-License-Identifier: MIT
#include "narrow/convex/axes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

struct Interval
{
    double lo, hi;
};
Interval interval(const Core3& core, const Vec3& axis)
{
    const Vec3 d = core.frame.r.back(axis);
    const Polytope& hull = core.polytope;
    Interval r{HUGE_VAL, -HUGE_VAL};
    for (std::uint32_t i = 0; i < hull.vertices; ++i) {
        const double h = d.x * hull.x[i] + d.y * hull.x[hull.stride + i] + d.z * hull.x[2 * hull.stride + i];
        r.lo = std::min(r.lo, h);
        r.hi = std::max(r.hi, h);
    }
    const double shift = dot(axis, core.frame.p);
    return {r.lo + shift, r.hi + shift};
}

struct Axis
{
    Vec3 normal;
    double separation = -HUGE_VAL;
};
void consider(Axis& best, const Core3& a, const Core3& b, const Vec3& n, bool both, double advantage)
{
    const Interval ra = interval(a, n), rb = interval(b, n);
    const double forth = rb.lo - ra.hi, back = ra.lo - rb.hi;
    if (forth > best.separation + advantage) best = {n, forth};
    if (both && back > best.separation + advantage) best = {-n, back};
}

Axis best_axis(const Core3& a, const Core3& b)
{
    Axis best;
    for (std::uint32_t f = 0; f < a.polytope.faces; ++f)
        consider(best, a, b, a.frame.r * a.polytope.normal(f), false, 0);
    for (std::uint32_t f = 0; f < b.polytope.faces; ++f)
        consider(best, a, b, -(b.frame.r * b.polytope.normal(f)), false, 0);
    // Edges have to be better by more than rounding, or parallel faces would meet along noise.
    const double advantage = 1e-10 * (a.reach + b.reach);
    for (std::uint32_t i = 0; i < a.polytope.directions; ++i) {
        const Vec3 da = a.frame.r * a.polytope.direction[i];
        for (std::uint32_t j = 0; j < b.polytope.directions; ++j) {
            const Vec3 db = b.frame.r * b.polytope.direction[j], n = cross(da, db);
            const double size = length(n);
            // Parallel: a face's normal or another pair of edges is better.
            if (!(size * size > 1e-14 * length2(da) * length2(db))) continue;
            consider(best, a, b, n * (1 / size), true, advantage);
        }
    }
    if (best.separation == -HUGE_VAL) {
        // Points and parallel segments at the same place: any direction across.
        Vec3 n{0, 1, 0}, other, along;
        for (const Core3* core : {&a, &b})
            for (std::uint32_t i = 0; i < core->polytope.directions; ++i)
                if (const Vec3 d = core->frame.r * core->polytope.direction[i]; length2(d) > length2(along))
                    along = d;
        if (length2(along) > 0) basis(along * (1 / length(along)), n, other);
        consider(best, a, b, n, true, 0);
    }
    return best;
}

} // namespace

void gap_by_axes(const Core3& a, const Core3& b, Gap<3>& gap)
{
    const Axis axis = best_axis(a, b);
    gap.normal = axis.normal;
    gap.distance = std::min(0.0, axis.separation);
    gap.on_a = gap.on_b = {};
}

} // namespace narrow
JOSTLE_NAMESPACE_END
