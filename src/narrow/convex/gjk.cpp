// SPDX-License-Identifier: MIT
#include "narrow/convex/gjk.hpp"

#include <bit>

#include "narrow/convex/gaps3.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// The point nearest to the origin in the hull of up to three points.
struct Nearest
{
    int count = 0;
    int of[3] = {}; ///< the points between which it is; then the first one again, with weight 0
    double weight[3] = {};
};

Nearest nearest_on_segment(const Vec3& a, const Vec3& b)
{
    const Vec3 ab = b - a;
    const double t = -dot(a, ab), size = length2(ab);
    if (t <= 0 || size == 0) return {1, {0, 0, 0}, {1}};
    if (t >= size) return {1, {1, 1, 1}, {1}};
    return {2, {0, 1, 0}, {1 - t / size, t / size}};
}

/// Ericson sec. 5.1.5, for the origin.
Nearest nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c)
{
    const Vec3 ab = b - a, ac = c - a;
    const double d1 = -dot(ab, a), d2 = -dot(ac, a);
    if (d1 <= 0 && d2 <= 0) return {1, {0, 0, 0}, {1}};
    const double d3 = -dot(ab, b), d4 = -dot(ac, b);
    if (d3 >= 0 && d4 <= d3) return {1, {1, 1, 1}, {1}};
    const double d5 = -dot(ab, c), d6 = -dot(ac, c);
    if (d6 >= 0 && d5 <= d6) return {1, {2, 2, 2}, {1}};
    const Vec3 n = cross(ab, ac);
    // The signed areas seen from the origin, as triple products, which lose less than d1 * d4 - d3 * d2.
    const double vc = dot(n, cross(a, b)), va = dot(n, cross(b, c)), vb = dot(n, cross(c, a));
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        const double t = d1 / (d1 - d3);
        return {2, {0, 1, 0}, {1 - t, t}};
    }
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        const double t = d2 / (d2 - d6);
        return {2, {0, 2, 0}, {1 - t, t}};
    }
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {2, {1, 2, 1}, {1 - t, t}};
    }
    const double sum = va + vb + vc;
    if (!(sum > 0)) return nearest_on_segment(a, b); // no area
    return {3, {0, 1, 2}, {va / sum, vb / sum, vc / sum}};
}

/// The same for points with other numbers than 0, 1 and 2.
Nearest renamed(Nearest nearest, const int* numbers)
{
    for (int& of : nearest.of)
        of = numbers[of];
    return nearest;
}
Vec3 position(const Nearest& nearest, const SimplexPoint* points, Vec3 SimplexPoint::* which)
{
    Vec3 p;
    for (int i = 0; i < 3; ++i) // always three, since their number can't be predicted
        p += points[nearest.of[i]].*which * nearest.weight[i];
    return p;
}

/// The same for four points, points[at[0]] to points[at[3]]. Returns false if the origin is inside, unless
/// the caller knows that it isn't.
bool nearest_on_tetrahedron(const SimplexPoint* points, const int (&at)[4], bool surely_outside,
                            Nearest& best)
{
    static constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
    double least = HUGE_VAL;
    bool outside = false;
    best = {};
    for (const auto& face : faces) {
        const int corner[] = {at[face[0]], at[face[1]], at[face[2]]};
        const Vec3 &a = points[corner[0]].w, &b = points[corner[1]].w, &c = points[corner[2]].w;
        const Vec3 n = cross(b - a, c - a), up = points[at[face[3]]].w - a;
        const double origin = -dot(a, n), other = dot(up, n);
        // On the inner side; but a flat tetrahedron has no inside, whatever the rounding.
        if (!surely_outside && origin * other > 0 && other * other > 1e-24 * length2(n) * length2(up))
            continue;
        outside = true;
        const Nearest nearest = renamed(nearest_on_triangle(a, b, c), corner);
        const double distance = length2(position(nearest, points, &SimplexPoint::w));
        if (distance < least) {
            least = distance;
            best = nearest;
        }
    }
    return outside;
}

/// Puts a simplex's points first, in this order.
void arrange(Simplex& s, const int* at, int count)
{
    const Simplex given = s;
    for (int i = 0; i < count; ++i)
        s.point[i] = given.point[at[i]];
    s.count = count;
}

/// The point of a triangle nearest to p.
Vec3 nearest_of_triangle(const Vec3 (&corner)[3], const Vec3& p)
{
    const Nearest nearest = nearest_on_triangle(p - corner[0], p - corner[1], p - corner[2]);
    Vec3 on;
    for (int i = 0; i < nearest.count; ++i)
        on += corner[nearest.of[i]] * nearest.weight[i];
    return on;
}
/// The point of a cylinder or cone nearest to p, in its axes. It is in the half-plane of the axis and p.
Vec3 nearest_of_round(const Core3& core, const Vec3& p)
{
    const double radius = core.lengths.x, half = core.lengths.y;
    const double aside = std::sqrt(p.x * p.x + p.z * p.z);
    const Vec3 rim = aside > 0 ? Vec3{p.x / aside * radius, 0, p.z / aside * radius} : Vec3{radius, 0, 0};
    if (core.smooth == Smooth::cone)
        return nearest_of_triangle({{rim.x, -half, rim.z}, {0, half, 0}, {0, -half, 0}}, p);
    const double y = clamped(p.y, half);
    return aside > radius ? Vec3{rim.x, y, rim.z} : Vec3{p.x, y, p.z};
}

bool is_segment(const Core3& core)
{
    return !core.is_smooth() && core.polytope.vertices == 2;
}
bool is_triangle(const Core3& core)
{
    return !core.is_smooth() && core.polytope.vertices == 3;
}
Vec3 nearest_of_triangle(const Core3& core, const Vec3& p)
{
    return nearest_of_triangle({core.polytope.vertex(0), core.polytope.vertex(1), core.polytope.vertex(2)},
                               p);
}

/// Two points, and the square of their distance.
struct Closest
{
    Vec3 on_a, on_b;
    double square = HUGE_VAL;
};
/// Takes the nearest points of two segments, from p along `way` and from c along `side`, if they are nearer
/// than `best`. Source: as round_gap().
void take_nearer(const Vec3& p, const Vec3& way, const Vec3& c, const Vec3& side, Closest& best)
{
    const auto part = [](double x) { return std::max(0.0, std::min(1.0, x)); };
    const Vec3 across = cross(way, side), from_p = c - p;
    const double square = length2(across), size_a = length2(way), size_b = length2(side);
    double s = square > 1e-28 * size_a * size_b ? part(dot(cross(from_p, side), across) / square) : 0;
    const double t = part(dot(side, way * s - from_p) / size_b);
    s = part(dot(way, side * t + from_p) / size_a);
    const Closest here{p + way * s, c + side * t};
    const double distance = length2(here.on_b - here.on_a);
    if (distance < best.square) best = {here.on_a, here.on_b, distance};
}
/// The gap between a segment and a triangle with a plane: as point_gap().
Verdict segment_gap(const Core3& a, const Core3& b, const Vec3& shift, double enough, Gap<3>& gap)
{
    Vec3 end[2];
    for (std::uint32_t i = 0; i < 2; ++i)
        end[i] = b.frame.r.back(a.frame * a.polytope.vertex(i) - shift - b.frame.p);
    Vec3 corner[3]; // counterclockwise, seen from the tip of the normal
    for (std::uint32_t i = 0; i < 3; ++i)
        corner[i] = b.polytope.vertex(b.polytope.outline[i]);
    const Vec3 n = b.polytope.normal(0), way = end[1] - end[0];
    const double height[2] = {dot(n, end[0] - corner[0]), dot(n, end[1] - corner[0])};
    const bool crosses = height[0] * height[1] <= 0;
    const double least = crosses ? 0 : std::min(std::abs(height[0]), std::abs(height[1]));
    const Vec3 crossing = end[0] - way * (crosses ? height[0] / (height[1] - height[0]) : 0);
    // Only sides of the triangle beyond which an end is can be nearest.
    bool over[2] = {true, true}, passes = crosses;
    Vec3 from[3], along[3];
    int sides = 0;
    for (std::uint32_t i = 0; i < 3; ++i) {
        const Vec3 c = corner[i], side = corner[i == 2 ? 0 : i + 1] - c, out = cross(side, n);
        const double beyond[2] = {dot(out, end[0] - c), dot(out, end[1] - c)};
        const double both = std::min(beyond[0], beyond[1]), size = length2(side);
        if (both > 0 && both * both > (enough * enough * (1 + 1e-12) - least * least) * size) {
            gap.distance = HUGE_VAL;
            return Verdict::apart;
        }
        passes &= dot(out, crossing - c) <= 0;
        over[0] &= beyond[0] <= 0;
        over[1] &= beyond[1] <= 0;
        from[sides] = c;
        along[sides] = side;
        sides += std::max(beyond[0], beyond[1]) > 0 ? 1 : 0;
    }
    if (passes) return Verdict::unclear;
    Closest best;
    for (const int i : {0, 1})
        if (over[i] && height[i] * height[i] < best.square)
            best = {end[i], end[i] - n * height[i], height[i] * height[i]};
    for (int i = 0; i < sides && best.square > least * least; ++i)
        take_nearer(end[0], way, from[i], along[i], best);
    const double distance = std::sqrt(best.square), extent = length(end[0]) + a.reach + b.reach;
    if (!(distance > core_touch * extent)) return Verdict::unclear;
    const Vec3 on_b = b.frame * best.on_b;
    gap = {distance > enough ? HUGE_VAL : distance, b.frame.r * ((best.on_b - best.on_a) * (1 / distance)),
           b.frame * best.on_a + shift, on_b};
    return Verdict::apart;
}

/// The start of the search: a triangle is a piece of a surface, whose origin may be far away.
Vec3 piece_middle(const Core3& core)
{
    return is_triangle(core) ? core.frame * core.polytope.middle : core.frame.p;
}

} // namespace

Verdict point_gap(const Vec3& p, const Core3& b, double enough, Gap<3>& gap)
{
    const Vec3 local = b.frame.r.back(p - b.frame.p);
    Vec3 nearest;
    if (is_triangle(b))
        nearest = nearest_of_triangle(b, local);
    else if (b.smooth == Smooth::cylinder || b.smooth == Smooth::cone)
        nearest = nearest_of_round(b, local);
    else
        return Verdict::unclear;
    const Vec3 way = nearest - local;
    const double size = length2(way), distance = std::sqrt(size), extent = length(local) + b.reach;
    if (!(distance > core_touch * extent)) return Verdict::unclear;
    gap = {distance > enough ? HUGE_VAL : distance, b.frame.r * (way * (1 / distance)), p, b.frame * nearest};
    return Verdict::apart;
}

void point_depth(const Vec3& p, const Core3& b, Gap<3>& gap)
{
    const Vec3 local = b.frame.r.back(p - b.frame.p);
    const double radius = b.lengths.x, half = b.lengths.y;
    const double aside = std::sqrt(local.x * local.x + local.z * local.z);
    const Vec3 across = aside > 0 ? Vec3{local.x / aside, 0, local.z / aside} : Vec3{1, 0, 0};
    // The nearest of the side and the discs: its outward normal, and the distance outside its plane.
    Vec3 out = across;
    double outside = aside - radius, beyond_disc = std::abs(local.y) - half;
    const double side = std::sqrt(radius * radius + 4 * half * half);
    if (b.smooth == Smooth::cone && side > 0) { // a point has no side
        out = across * (2 * half / side) + Vec3{0, radius / side, 0};
        outside = (2 * half * aside + radius * (local.y - half)) / side;
        beyond_disc = -half - local.y;
    }
    if (beyond_disc > outside) {
        out = {0, b.smooth == Smooth::cone || local.y < 0 ? -1.0 : 1.0, 0};
        outside = beyond_disc;
    }
    gap = {outside, b.frame.r * -out, p, b.frame * (local - out * outside), true};
}

// Inlined: each step waits for the one before, so an additional call costs time.
[[gnu::flatten]] Verdict gjk(const Core3& a, const Core3& b, const Vec3& shift, double enough, MostSteps most,
                             Simplex& s, Gap<3>& gap)
{
    if (!a.is_smooth() && a.polytope.vertices == 1) {
        const Vec3 p = a.frame * a.polytope.vertex(0);
        if (point_gap(p - shift, b, enough, gap) == Verdict::apart) {
            gap.on_a = p;
            s.parted = gap.distance;
            return Verdict::apart;
        }
    }
    if (is_segment(a) && is_triangle(b) && b.polytope.faces > 0 &&
        segment_gap(a, b, shift, enough, gap) == Verdict::apart) {
        s.parted = gap.distance;
        return Verdict::apart;
    }
    Vec3 v = piece_middle(a) - piece_middle(b) - shift;
    if (length2(v) == 0) v = {1, 0, 0};
    const bool have_corners = !a.is_smooth() && !b.is_smooth();
    double least = HUGE_VAL, extent = 0;
    double& widest = s.parted = -HUGE_VAL;
    s.count = 0;
    SimplexPoint* const points = s.point; // each stays in its place as long as it is used
    Nearest best, last; // of all steps, and of the last one, which rounding may have made worse
    for (int step = 0; step < all_steps; ++step) {
        if (step == most.steps || step >= (widest > 0 ? most.parted : most.unparted)) return Verdict::unclear;
        const Support pa = support(a, -v), pb = support(b, v);
        const SimplexPoint w{pa.p - (pb.p + shift), pa.p, pb.p, pa.vertex, pb.vertex};
        extent = std::max(extent, length2(w.w));
        const double along = dot(v, w.w), size = length2(v);
        if (along > 0 && along * along > enough * enough * size) {
            gap.distance = HUGE_VAL;
            return Verdict::apart;
        }
        const double inverse = 1 / std::sqrt(size);
        if (along * inverse > widest) {
            widest = along * inverse;
            gap.normal = v * -inverse;
        }
        if (step > 0) {
            // v . w / |v| is a lower bound of the distance, |v| an upper one.
            bool again = false;
            for (const int of : best.of)
                again |= (points[of].ia == w.ia) & (points[of].ib == w.ib);
            if (size - along <= 1e-14 * size || (again && have_corners)) break;
        }
        const int count = best.count;
        const unsigned taken = (count > 0 ? 1u << best.of[0] : 0) | (count > 1 ? 1u << best.of[1] : 0) |
                               (count > 2 ? 1u << best.of[2] : 0);
        int at[4] = {best.of[0], best.of[1], best.of[2], 0};
        at[count] = std::countr_one(taken);
        points[at[count]] = w;
        if (count == 0)
            last = {1, {0, 0, 0}, {1}};
        else if (count == 1)
            last = renamed(nearest_on_segment(points[at[0]].w, w.w), at);
        else if (count == 2)
            last = renamed(nearest_on_triangle(points[at[0]].w, points[at[1]].w, w.w), at);
        else if (!nearest_on_tetrahedron(points, at, false, last)) {
            // The points of a smooth shape are so close that rounding can cause this for shapes that a plane
            // separates.
            if (!(widest > 0 && widest * widest > 1e-24 * extent)) {
                arrange(s, at, 4);
                return Verdict::touch;
            }
            nearest_on_tetrahedron(points, at, true, last);
        }
        const Vec3 next = position(last, points, &SimplexPoint::w);
        const double next_size = length2(next);
        if (next_size <= 1e-26 * extent) {
            arrange(s, last.of, last.count);
            return Verdict::touch;
        }
        if (!(next_size < least)) break; // rounding: the previous one was the best
        least = next_size;
        v = next;
        best = last;
    }
    const double distance = length(v);
    // The direction of a gap this small has few digits: that of the overlap is better.
    if (distance <= core_touch * std::sqrt(extent)) {
        arrange(s, last.of, last.count);
        return Verdict::touch;
    }
    gap.distance = distance;
    gap.normal = v * (-1 / distance);
    gap.on_a = position(best, points, &SimplexPoint::a);
    gap.on_b = position(best, points, &SimplexPoint::b);
    return Verdict::apart;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
