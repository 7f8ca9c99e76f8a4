// SPDX-License-Identifier: MIT
#include "narrow/parts/ground.hpp"

#include "narrow/convex/convex3.hpp"
#include "narrow/convex/manifold3.hpp"
#include "narrow/parts/surface.hpp"
#include "narrow/parts/triangle_gap.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

Vec3 foot(const Part<3>& ground, std::uint32_t corner)
{
    const Vec3 top = ground.core.polytope.vertex(corner);
    return ground.core.frame * Vec3{top.x, ground.field->floor, top.z};
}

namespace {

/// Over or under the triangle along the height field's y. Its border, with a tolerance for rounding, belongs
/// to it, so nothing slips between two triangles, and at the rim nothing depends on the rotation of field and
/// body. The corners of all triangles of all fields run the same way around, since all of them face up.
bool in_column(const Part<3>& triangle, const Vec3& p)
{
    const Core3& core = triangle.core;
    const Vec3 local = core.frame.r.back(p - core.frame.p);
    const Polytope& t = core.polytope;
    const double rounding = 1e-14 * (length(p) + length(core.frame.p) + length(t.vertex(0)));
    for (std::uint32_t i = 0; i < 3; ++i) {
        const Vec3 a = t.vertex(i), b = t.vertex((i + 1) % 3);
        const double side = (b.x - a.x) * (local.z - a.z) - (b.z - a.z) * (local.x - a.x);
        const double border = rounding * (std::abs(b.x - a.x) + std::abs(b.z - a.z));
        if (side > border) return false;
    }
    return true;
}

Vec3 centre_of(const Core3& core)
{
    if (core.smooth == Smooth::custom) { // which needn't contain its own origin
        Vec3 sum;
        for (const Vec3& axis : {core.frame.r.x, core.frame.r.y, core.frame.r.z})
            sum += furthest(core, axis) + furthest(core, -axis);
        return sum * (1.0 / 6);
    }
    return core.frame * core.polytope.middle;
}

/// A triangle of a height field with the ground below it, relative to a's position.
class Solid final : public CustomShape<3>
{
  public:
    explicit Solid(const Part<3>& ground)
    {
        for (std::uint32_t i = 0; i < 3; ++i) {
            corner_[i] = ground.core.frame * ground.core.polytope.vertex(i);
            corner_[3 + i] = foot(ground, i);
        }
        for (const Vec3& p : corner_)
            radius_ = std::max(radius_, length(p));
    }
    [[nodiscard]] double radius() const noexcept override { return radius_; }
    [[nodiscard]] Vec<3, double> support(const Vec<3, double>& direction) const noexcept override
    {
        const Vec3 d = load(direction), *best = corner_;
        for (const Vec3& p : corner_)
            if (dot(d, p) > dot(d, *best)) best = &p;
        return {best->x, best->y, best->z};
    }

  private:
    Vec3 corner_[6];
    double radius_ = 0;
};

/// Whether a body is under a height field's triangle: its centre is below the triangle. The ground ends at
/// its floor.
bool is_below(const Part<3>& ground, const Core3& core)
{
    const Frame<3>& frame = ground.core.frame;
    const Vec3 centre = centre_of(core);
    if (!(dot(ground.normal, centre - ground.first_corner()) < 0 && in_column(ground, centre))) return false;
    if (dot(frame.r.y, furthest(core, frame.r.y) - frame.p) + core.radius < ground.field->floor) return false;
    if (dot(frame.r.y, centre - frame.p) >= ground.field->floor) return true;
    // A body that rises from further down may extend up beside the column.
    const Solid solid(ground);
    return convex_touch(Core3(Shape<3>(solid, ShapeTypes::first_custom), {}, *ground.core.kernels), core);
}
/// How high a core's lowest point is over a triangle's plane.
double height_over(const Part<3>& ground, const Core3& core, Vec3& lowest)
{
    lowest = furthest(core, -ground.normal) - ground.normal * core.radius;
    return dot(ground.normal, lowest - ground.first_corner());
}

/// Whether a body above the ground can have this direction away from it. Sides of steep triangles face
/// downwards, too. A level direction, up to rounding, counts as from the side, for any rotation of field and
/// body.
bool comes_from_above(const Part<3>& ground, const Vec3& n)
{
    constexpr double level = 1e-10;
    return dot(n, ground.normal) > level && dot(n, ground.core.frame.r.y) > level;
}

} // namespace

Answer ground_contact(const Part<3>& ground, const Core3& body, double margin, Manifold<3>& manifold,
                      double& gap)
{
    const double enough = body.radius + margin + uncertain(body, ground.core);
    const Lowest lowest = lowest_over(body, ground);
    if (lowest.height > enough) return Answer::none;
    if (lowest.height > 0 || !is_below(ground, body)) {
        Gap<3> cores;
        triangle_gap(body, ground, lowest, enough, cores); // as for other surfaces
        gap = cores.distance - body.radius;
        if (!(cores.distance <= body.radius + margin)) return Answer::none;
        if (cores.distance > 0) {
            if (!comes_from_above(ground, -cores.normal))
                return Answer::none; // the column it is in pushes it up
            return piece_contact(body, ground, cores, 1, margin, manifold);
        }
    }
    const bool contact = face_contact(body, ground.core, 1, margin, manifold) ||
                         plane_contact(body, ground, 1, margin, manifold);
    return contact ? Answer::contact : Answer::none;
}

void gap_over_ground(const Part<3>& ground, const Core3& body, Gap<3>& gap)
{
    if (is_below(ground, body)) {
        Vec3 lowest;
        gap.distance = height_over(ground, body, lowest);
        gap.normal = ground.normal;
        gap.on_b = lowest;
        gap.on_a = lowest - ground.normal * gap.distance;
    } else if (gap.distance > -body.radius && !comes_from_above(ground, gap.normal)) {
        gap.distance = HUGE_VAL; // the column it is in pushes it up
    }
}

void gap_around_ground(const Part<3>& ground, const Core3& body, double enough, Gap<3>& gap)
{
    if (is_below(ground, body)) {
        gap_over_ground(ground, body, gap);
        return flip(gap);
    }
    convex_gap(body, ground.core, HUGE_VAL, gap);
    // From above the triangle is nearest, otherwise one of the sides below it may be.
    if (gap.distance > 0 && dot(gap.normal, ground.core.frame.r.y) > 0) {
        const Solid solid(ground);
        const Core3 core(Shape<3>(solid, ShapeTypes::first_custom), {}, *ground.core.kernels);
        convex_gap(body, core, enough, gap);
    }
}

} // namespace narrow
JOSTLE_NAMESPACE_END
