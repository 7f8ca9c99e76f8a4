// SPDX-License-Identifier: MIT
#include "narrow/parts/part.hpp"

#include "narrow/convex/convex3.hpp"
#include "narrow/convex/manifold3.hpp"
#include "narrow/parts/ground.hpp"
#include "narrow/parts/surface.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

bool is_smooth(const Part<2>& part)
{
    return !part.half_space && part.core.is_smooth();
}
/// In 2D a smooth shape is refined to a polygon for each other shape that it meets.
bool wants_refining(const Part<2>& a, const Part<2>& b)
{
    return !a.half_space && !b.half_space && (is_smooth(a) || is_smooth(b));
}
struct Refined
{
    Part<2> a, b;
    Refined(const Part<2>& given_a, const Part<2>& given_b) : a(given_a), b(given_b)
    {
        refine(a.core, b.core);
        a.core.smooth = b.core.smooth = false;
    }
};

Answer answer_if(bool contact)
{
    return contact ? Answer::contact : Answer::none;
}

template <int Dim>
Answer contact_of_parts(const Part<Dim>& a, const Part<Dim>& b, double margin, Manifold<Dim>& manifold,
                        double& gap)
{
    if (a.half_space && b.half_space) return Answer::none;
    if constexpr (Dim == 2)
        if (wants_refining(a, b)) {
            const Refined refined(a, b);
            return contact_of_parts(refined.a, refined.b, margin, manifold, gap);
        }
    if (b.half_space) return answer_if(half_space_contact(a.core, b.normal, b.offset, margin, manifold));
    if (!a.half_space && a.surface == b.surface)
        return answer_if(convex_contact(a.core, b.core, margin, manifold));
    if (!a.half_space && b.surface > a.surface) return surface_contact(a.core, b, margin, manifold, gap);
    const Answer answer = a.half_space
                              ? answer_if(half_space_contact(b.core, a.normal, a.offset, margin, manifold))
                              : surface_contact(b.core, a, margin, manifold, gap);
    if (answer != Answer::none) flip(manifold);
    return answer;
}

} // namespace

template <int Dim>
Answer part_contact(const Part<Dim>& a, const Part<Dim>& b, double margin, Manifold<Dim>& manifold,
                    double& gap)
{
    const Answer answer = contact_of_parts(a, b, margin, manifold, gap);
    return answer == Answer::none || is_covered(a) || is_covered(b) ? Answer::none : answer;
}
template Answer part_contact(const Part<2>&, const Part<2>&, double, Manifold<2>&, double&);
template Answer part_contact(const Part<3>&, const Part<3>&, double, Manifold<3>&, double&);

template <int Dim>
Answer part_contact_behind(const Part<Dim>& a, const Part<Dim>& b, bool known, double margin,
                           Manifold<Dim>& manifold, Answer answer)
{
    if constexpr (Dim == 2)
        if (wants_refining(a, b)) {
            const Refined refined(a, b);
            return part_contact_behind(refined.a, refined.b, known, margin, manifold, answer);
        }
    if (b.surface > a.surface) return contact_behind(a.core, b, known, margin, manifold, answer);
    flip(manifold);
    answer = contact_behind(b.core, a, known, margin, manifold, answer);
    if (answer != Answer::none) flip(manifold);
    return answer;
}
template Answer part_contact_behind(const Part<2>&, const Part<2>&, bool, double, Manifold<2>&, Answer);
template Answer part_contact_behind(const Part<3>&, const Part<3>&, bool, double, Manifold<3>&, Answer);

template <>
void part_gap(const Part<2>& a, const Part<2>& b, double enough, Gap<2>& gap)
{
    gap.distance = HUGE_VAL;
    if (a.half_space && b.half_space) return;
    if (wants_refining(a, b)) {
        const Refined refined(a, b);
        return convex_gap(refined.a.core, refined.b.core, enough, gap);
    }
    if (b.half_space) return half_space_gap(a.core, b.normal, b.offset, gap);
    if (!a.half_space) return convex_gap(a.core, b.core, enough, gap);
    half_space_gap(b.core, a.normal, a.offset, gap);
    flip(gap);
}
template <>
void part_gap(const Part<3>& a, const Part<3>& b, double enough, Gap<3>& gap)
{
    gap.distance = HUGE_VAL;
    if (a.half_space && b.half_space) return;
    if (b.half_space) return half_space_gap(a.core, b.normal, b.offset, gap);
    if (a.half_space) {
        half_space_gap(b.core, a.normal, a.offset, gap);
        return flip(gap);
    }
    const bool ground_a = is_ground(a, b), ground_b = is_ground(b, a);
    convex_gap(a.core, b.core, ground_a || ground_b ? HUGE_VAL : enough, gap);
    if (ground_a) gap_over_ground(a, b.core, gap);
    if (ground_b) {
        flip(gap);
        gap_over_ground(b, a.core, gap);
        flip(gap);
    }
}

template <>
bool part_touch(const Part<2>& a, const Part<2>& b)
{
    Gap<2> gap;
    part_gap(a, b, 0, gap);
    return gap.distance <= 0 && !is_covered(a) && !is_covered(b); // as part_contact()
}
template <>
bool part_touch(const Part<3>& a, const Part<3>& b)
{
    if (a.surface == Surface::none && b.surface == Surface::none && !a.half_space && !b.half_space)
        return convex_touch(a.core, b.core);
    Gap<3> gap;
    part_gap(a, b, 0, gap);
    return gap.distance <= 0 && !is_covered(a) && !is_covered(b); // as part_contact()
}

template <>
void moving_gap(const Part<2>& a, const Part<2>& b, double enough, Gap<2>& gap)
{
    part_gap(a, b, enough, gap);
}
template <>
void moving_gap(const Part<3>& a, const Part<3>& b, double enough, Gap<3>& gap)
{
    if (is_ground(b, a)) return gap_around_ground(b, a.core, enough, gap);
    if (!is_ground(a, b)) return part_gap(a, b, enough, gap);
    gap_around_ground(a, b.core, enough, gap);
    flip(gap);
}

Region<2> region_of(const Part<2>& part, const Frame<2>& frame)
{
    if (part.half_space) return everywhere<2>();
    Region<2> region{{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
    const Core2& core = part.core;
    const double grow = core.radius + 1e-14 * (core.reach + core.radius + length(frame.p));
    if (core.is_smooth()) { // it extends beyond its corners
        const Vec2 axes[2] = {frame.r * Vec2{1, 0}, frame.r * Vec2{0, 1}};
        for (int d = 0; d < 2; ++d) {
            const double shift = dot(axes[d], frame.p);
            region.lo[d] = dot(axes[d], support(core, -axes[d])) - shift - grow;
            region.hi[d] = dot(axes[d], support(core, axes[d])) - shift + grow;
        }
        return region;
    }
    for (std::size_t i = 0; i < core.corner.size(); ++i) {
        const Vec2 p = frame.r.back(core.corner[i] - frame.p);
        for (int d = 0; d < 2; ++d) {
            region.lo[d] = std::min(region.lo[d], p[d] - grow);
            region.hi[d] = std::max(region.hi[d], p[d] + grow);
        }
    }
    return region;
}
Region<3> region_of(const Part<3>& part, const Frame<3>& frame)
{
    if (part.half_space) return everywhere<3>();
    Region<3> region;
    const Core3& core = part.core;
    if (part.surface != Surface::ground) {
        region.middle = frame.r.back(core.frame.p - frame.p);
        region.ball = with_rounding(core.reach + core.radius, region.middle);
    }
    const Vec3 axes[3] = {frame.r.x, frame.r.y, frame.r.z};
    for (int d = 0; d < 3; ++d) {
        const double shift = dot(axes[d], frame.p),
                     rounding = 1e-14 * (core.reach + core.radius + length(frame.p));
        region.lo[d] = dot(axes[d], furthest(core, -axes[d])) - shift - core.radius - rounding;
        region.hi[d] = dot(axes[d], furthest(core, axes[d])) - shift + core.radius + rounding;
        if (part.surface != Surface::ground) continue;
        for (std::uint32_t i = 0; i < 3; ++i) {
            const Vec3 top = core.polytope.vertex(i);
            const double at = dot(axes[d], core.frame * Vec3{top.x, part.field->floor, top.z}) - shift;
            region.lo[d] = std::min(region.lo[d], at - rounding);
            region.hi[d] = std::max(region.hi[d], at + rounding);
        }
    }
    return region;
}

template <>
Spread<2> spread_of(const Part<2>& part, const Part<2>&, const Turning<2>& turning, const Vec2& n,
                    double horizon)
{
    Spread<2> spread(turning, n, horizon);
    const Core2& core = part.core;
    if (part.half_space) // n is its normal
        spread.add_height(part.offset);
    else if (is_smooth(part))
        spread.add_somewhere(dot(n, support(core, n)), core.frame.p, core.reach);
    else
        for (std::size_t i = 0; i < core.corner.size(); ++i)
            spread.add(core.corner[i], core.radius);
    return spread;
}

template <>
Spread<3> spread_of(const Part<3>& part, const Part<3>& other, const Turning<3>& turning, const Vec3& n,
                    double horizon)
{
    Spread<3> spread(turning, n, horizon);
    const Core3& core = part.core;
    const auto top = [&] { return dot(n, furthest(core, n)) + core.radius; };
    if (part.half_space) { // n is its normal
        spread.add_height(part.offset);
    } else if (core.is_smooth()) {
        spread.add_somewhere(top(), core.frame.p, core.reach);
    } else if (turning.speed == 0) {
        spread.add_height(top());
    } else {
        for (std::uint32_t i = 0; i < core.polytope.vertices; ++i)
            spread.add(core.frame * core.polytope.vertex(i), core.radius);
    }
    if (is_ground(part, other))
        for (std::uint32_t i = 0; i < 3; ++i)
            spread.add(foot(part, i));
    return spread;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
