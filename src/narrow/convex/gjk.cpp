// SPDX-License-Identifier: MIT
#include "narrow/convex/gjk.hpp"

#include "narrow/convex/gaps3.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// The point of up to three others' hull that is nearest to the origin.
struct Nearest
{
    int count;
    int of[3]; ///< which of them it lies between
    double weight[3];
};

void keep(Simplex& s, const Nearest& nearest)
{
    for (int i = 0; i < nearest.count; ++i) { // in ascending order
        if (nearest.of[i] != i) s.point[i] = s.point[nearest.of[i]];
        s.weight[i] = nearest.weight[i];
    }
    s.count = nearest.count;
}

Nearest nearest_on_segment(const Vec3& a, const Vec3& b)
{
    const Vec3 ab = b - a;
    const double t = -dot(a, ab), size = length2(ab);
    if (t <= 0 || size == 0) return {1, {0}, {1}};
    if (t >= size) return {1, {1}, {1}};
    return {2, {0, 1}, {1 - t / size, t / size}};
}

/// Ericson sec. 5.1.5, for the origin.
Nearest nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c)
{
    const Vec3 ab = b - a, ac = c - a;
    const double d1 = -dot(ab, a), d2 = -dot(ac, a);
    if (d1 <= 0 && d2 <= 0) return {1, {0}, {1}};
    const double d3 = -dot(ab, b), d4 = -dot(ac, b);
    if (d3 >= 0 && d4 <= d3) return {1, {1}, {1}};
    const double d5 = -dot(ab, c), d6 = -dot(ac, c);
    if (d6 >= 0 && d5 <= d6) return {1, {2}, {1}};
    const Vec3 n = cross(ab, ac);
    // The signed areas as the origin sees them; as triple products, which lose less than d1 * d4 - d3 * d2.
    const double vc = dot(n, cross(a, b)), va = dot(n, cross(b, c)), vb = dot(n, cross(c, a));
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        const double t = d1 / (d1 - d3);
        return {2, {0, 1}, {1 - t, t}};
    }
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        const double t = d2 / (d2 - d6);
        return {2, {0, 2}, {1 - t, t}};
    }
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {2, {1, 2}, {1 - t, t}};
    }
    const double sum = va + vb + vc;
    if (!(sum > 0)) return nearest_on_segment(a, b); // no area
    return {3, {0, 1, 2}, {va / sum, vb / sum, vc / sum}};
}

Vec3 position(const Simplex& s)
{
    Vec3 v;
    for (int i = 0; i < s.count; ++i)
        v += s.point[i].w * s.weight[i];
    return v;
}

/// Returns true if the origin is inside, unless the caller knows that it isn't.
bool closest_on_tetrahedron(Simplex& s, bool surely_outside = false)
{
    static constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
    Nearest best{};
    double least = HUGE_VAL;
    bool outside = false;
    for (const auto& face : faces) {
        const Vec3 &a = s.point[face[0]].w, &b = s.point[face[1]].w, &c = s.point[face[2]].w;
        const Vec3 n = cross(b - a, c - a), up = s.point[face[3]].w - a;
        const double origin = -dot(a, n), other = dot(up, n);
        // On the inner side; but a flat tetrahedron has no inside, whatever rounding says.
        if (!surely_outside && origin * other > 0 && other * other > 1e-24 * length2(n) * length2(up))
            continue;
        outside = true;
        Nearest nearest = nearest_on_triangle(a, b, c);
        Vec3 p;
        for (int i = 0; i < nearest.count; ++i) {
            nearest.of[i] = face[nearest.of[i]];
            p += s.point[nearest.of[i]].w * nearest.weight[i];
        }
        if (const double distance = length2(p); distance < least) {
            least = distance;
            best = nearest;
        }
    }
    if (outside) keep(s, best);
    return !outside;
}

/// Of a triangle's points the one nearest to p.
Vec3 nearest_of_triangle(const Vec3 (&corner)[3], const Vec3& p)
{
    const Nearest nearest = nearest_on_triangle(p - corner[0], p - corner[1], p - corner[2]);
    Vec3 on;
    for (int i = 0; i < nearest.count; ++i)
        on += corner[nearest.of[i]] * nearest.weight[i];
    return on;
}
/// Of a cylinder's or cone's points the one nearest to p, in its axes: it lies in the half-plane of the axis
/// and p.
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

} // namespace

Verdict point_gap(const Vec3& p, const Core3& b, double enough, Gap<3>& gap)
{
    const Vec3 local = b.frame.r.back(p - b.frame.p);
    Vec3 nearest;
    if (!b.is_smooth() && b.polytope.vertices == 3)
        nearest =
            nearest_of_triangle({b.polytope.vertex(0), b.polytope.vertex(1), b.polytope.vertex(2)}, local);
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
    // Of the side and the discs the one that is nearest: outwards of it, and how far outside of its plane.
    Vec3 out = across;
    double outside = aside - radius, beyond_disc = std::abs(local.y) - half;
    const double side = std::sqrt(radius * radius + 4 * half * half);
    if (b.smooth == Smooth::cone && side > 0) { // one that is a point has no side
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

/// b is looked at moved by `shift`; the gap's points are where they are without. Where they aren't apart
/// gap.normal is the direction in which they overlap least of those tried.
Verdict gjk(const Core3& a, const Core3& b, const Vec3& shift, double enough, MostSteps most, Simplex& s,
            Gap<3>& gap)
{
    if (!a.is_smooth() && a.polytope.vertices == 1) {
        const Vec3 p = a.frame * a.polytope.vertex(0);
        if (point_gap(p - shift, b, enough, gap) == Verdict::apart) {
            gap.on_a = p;
            s.parted = gap.distance;
            return Verdict::apart;
        }
    }
    Vec3 v = a.frame.p - b.frame.p - shift;
    if (length2(v) == 0) v = {1, 0, 0};
    double least = HUGE_VAL, extent = 0;
    Vec3 on_a, on_b;
    s.count = 0;
    double& widest = s.parted = -HUGE_VAL;
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
            bool done = size - along <= 1e-14 * size;
            for (int i = 0; i < s.count; ++i)
                done = done ||
                       (!a.is_smooth() && !b.is_smooth() && s.point[i].ia == w.ia && s.point[i].ib == w.ib);
            if (done) break;
        }
        s.point[s.count] = w;
        s.weight[s.count] = 1;
        ++s.count;
        if (s.count == 2)
            keep(s, nearest_on_segment(s.point[0].w, s.point[1].w));
        else if (s.count == 3)
            keep(s, nearest_on_triangle(s.point[0].w, s.point[1].w, s.point[2].w));
        else if (s.count == 4 && closest_on_tetrahedron(s)) {
            // A smooth shape's points lie so close that rounding can say so of shapes that a plane parts.
            if (!(widest > 0 && widest * widest > 1e-24 * extent)) return Verdict::touch;
            closest_on_tetrahedron(s, true);
        }
        const Vec3 next = position(s);
        const double next_size = length2(next);
        if (next_size <= 1e-26 * extent) return Verdict::touch;
        if (!(next_size < least)) break; // rounding: the last one was the best
        least = next_size;
        v = next;
        on_a = on_b = {};
        for (int i = 0; i < s.count; ++i) {
            on_a += s.point[i].a * s.weight[i];
            on_b += s.point[i].b * s.weight[i];
        }
    }
    const double distance = length(v);
    // A gap this small has a direction of few digits: the overlap's is better.
    if (distance <= core_touch * std::sqrt(extent)) return Verdict::touch;
    gap.distance = distance;
    gap.normal = v * (-1 / distance);
    gap.on_a = on_a;
    gap.on_b = on_b;
    return Verdict::apart;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
