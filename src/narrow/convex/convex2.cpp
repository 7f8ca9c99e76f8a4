// SPDX-License-Identifier: MIT
#include "narrow/convex/convex2.hpp"

#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// How many corners stand for a smooth shape: a regular fan of its support points.
constexpr std::uint32_t fan_corners = 64;

} // namespace

Core2::Core2(const Shape<2>& shape, const Frame<2>& where)
    : Core2(ShapeAccess::radius(shape), ShapeAccess::reach(shape) - ShapeAccess::radius(shape), where)
{
    const Vec<2, double>& size = ShapeAccess::size(shape);
    switch (kind_of(shape)) {
    case Kind::sphere:
        add(frame.p, 0);
        break;
    case Kind::capsule:
        add(frame * Vec2{0, -size[1]}, 0);
        if (size[1] > 0) add(frame * Vec2{0, size[1]}, 1);
        break;
    case Kind::rounded_box:
    case Kind::box: {
        const double x = size[0], y = size[1];
        add(frame * Vec2{-x, -y}, 0);
        if (x > 0) add(frame * Vec2{x, -y}, 1);
        if (y > 0) add(frame * Vec2{x, y}, 2);
        if (x > 0 && y > 0) add(frame * Vec2{-x, y}, 3);
        break;
    }
    case Kind::rounded_hull:
    case Kind::convex: {
        const auto& hull = ShapeAccess::data<HullData<2>>(shape);
        for (std::size_t i = 0; i < hull.loop.size(); ++i)
            add(frame * hull.loop[i], hull.corner[i]);
        break;
    }
    case Kind::half_space: // a plane and no polygon
    case Kind::mesh:       // not convex: their parts are
    case Kind::height_field:
    case Kind::compound:
    case Kind::cylinder: // of space alone
    case Kind::cone:
        break;
    case Kind::ellipsoid:
    case Kind::custom: {
        smooth = true;
        custom = shape.custom();
        ellipse = load(size);
        // The directions of a regular polygon, by turning one step after another.
        const Vec2 step{0.99518472667219689, 0.098017140329560602};
        Vec2 d{1, 0};
        for (std::uint32_t i = 0; i < fan_corners; ++i) {
            const Vec2 p = frame * smooth_support(*this, d);
            if (corner.empty() || (length2(p - corner[corner.size() - 1]) > 0 && length2(p - corner[0]) > 0))
                add(p, i);
            d = {d.x * step.x - d.y * step.y, d.x * step.y + d.y * step.x};
        }
    }
    }
}

std::size_t furthest_corner(const Core2& core, const Vec2& direction)
{
    std::size_t best = 0;
    double most = -HUGE_VAL;
    for (std::size_t i = 0; i < core.corner.size(); ++i)
        if (const double h = dot(direction, core.corner[i]); h > most) {
            most = h;
            best = i;
        }
    return best;
}

namespace {

struct Axis2
{
    Vec2 normal;
    double separation = -HUGE_VAL;
    bool of_b = false;
};

void consider(Axis2& best, const Core2& other, const Vec2& outwards, const Vec2& on, bool of_b, double from)
{
    const double size = length(outwards);
    if (!(size > 0)) return;
    const Vec2 n = outwards * (1 / size);
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < other.corner.size(); ++i)
        least = std::min(least, dot(n, other.corner[i] - on));
    if (least > best.separation && least > from) best = {of_b ? -n : n, least, of_b};
}

void consider_sides(Axis2& best, const Core2& owner, const Core2& other, bool of_b)
{
    for (std::size_t i = 0; i < owner.sides(); ++i)
        consider(best, other, right(owner.next(i) - owner.corner[i]), owner.corner[i], of_b, -HUGE_VAL);
    if (owner.sides() == 2) { // a segment's ends: they can separate, but never are the shortest way out
        const Vec2 along = owner.corner[1] - owner.corner[0];
        consider(best, other, along, owner.corner[1], of_b, 0);
        consider(best, other, -along, owner.corner[0], of_b, 0);
    }
}

/// How far unit direction n, from a to b, parts two polygons; below 0: how much they overlap along it.
double parted_by(const Core2& a, const Core2& b, const Vec2& n)
{
    return dot(n, furthest(b, -n) - furthest(a, n));
}

void nearest_on_side(const Vec2& p, const Vec2& from, const Vec2& to, double& least, Vec2& on)
{
    const Vec2 d = to - from;
    const double size = length2(d);
    const double t = size > 0 ? std::clamp(dot(p - from, d) / size, 0.0, 1.0) : 0;
    const Vec2 q = from + d * t;
    if (const double distance = length2(p - q); distance < least) {
        least = distance;
        on = q;
    }
}

} // namespace

void core_gap(const Core2& a, const Core2& b, Gap<2>& gap)
{
    Axis2 axis;
    if (a.is_settled) {
        axis = {a.along, parted_by(a, b, a.along), false};
    } else {
        consider_sides(axis, a, b, false);
        consider_sides(axis, b, a, true);
    }
    if (axis.separation == -HUGE_VAL) { // two points
        const Vec2 d = b.corner[0] - a.corner[0];
        const double distance = length(d);
        gap = {distance, distance > 0 ? d * (1 / distance) : Vec2{0, 1}, a.corner[0], b.corner[0]};
        return;
    }
    // Beyond the tip of a polygon that is nearly a segment its sides part nothing by more than rounding.
    const double clear = core_touch * (a.reach + b.reach);
    if (axis.separation > -clear) {
        double least = HUGE_VAL;
        for (std::size_t i = 0; i < b.corner.size(); ++i)
            for (std::size_t k = 0; k < a.corner.size(); ++k) {
                const double before = least;
                nearest_on_side(b.corner[i], a.corner[k], a.next(k), least, gap.on_a);
                if (least < before) gap.on_b = b.corner[i];
            }
        for (std::size_t i = 0; i < a.corner.size(); ++i)
            for (std::size_t k = 0; k < b.corner.size(); ++k) {
                const double before = least;
                nearest_on_side(a.corner[i], b.corner[k], b.next(k), least, gap.on_b);
                if (least < before) gap.on_a = a.corner[i];
            }
        gap.distance = std::sqrt(least);
        if (gap.distance > 0) { // else a gap that rounding has closed
            gap.normal = (gap.on_b - gap.on_a) * (1 / gap.distance);
            if (axis.separation > clear || parted_by(a, b, gap.normal) > clear) return;
        }
    }
    gap.normal = axis.normal;
    gap.distance = std::min(0.0, axis.separation);
    if (axis.of_b) {
        gap.on_a = furthest(a, axis.normal);
        gap.on_b = gap.on_a + axis.normal * gap.distance;
    } else {
        gap.on_b = furthest(b, -axis.normal);
        gap.on_a = gap.on_b - axis.normal * gap.distance;
    }
}

namespace {

/// Makes the support point along a normal a corner. Returns whether it wasn't one.
bool grow(Core2& core, const Vec2& normal)
{
    const Vec2 p = support(core, normal);
    const double height = dot(normal, furthest(core, normal));
    if (!(dot(normal, p) > height + 1e-12 * core.reach)) return false;
    // Between the corners of the side it lies outside of most.
    std::size_t after = 0;
    double most = -HUGE_VAL;
    for (std::size_t i = 0; i < core.corner.size(); ++i) {
        const Vec2 side = core.next(i) - core.corner[i];
        const double size = length(side);
        const double outside = size > 0 ? dot(right(side), p - core.corner[i]) / size : 0;
        if (outside > most) {
            most = outside;
            after = i;
        }
    }
    core.add(p, fan_corners);
    for (std::size_t i = core.corner.size() - 1; i > after + 1; --i) {
        std::swap(core.corner[i], core.corner[i - 1]);
        std::swap(core.number[i], core.number[i - 1]);
    }
    return true;
}

} // namespace

void refine(Core2& a, Core2& b)
{
    Vec2 best;
    double most = -HUGE_VAL;
    // Both polygons are exact along n afterwards. Returns whether they were before.
    const auto look_along = [&](const Vec2& n) {
        const bool grown_a = a.is_smooth() && grow(a, n), grown_b = b.is_smooth() && grow(b, -n);
        if (const double parted = parted_by(a, b, n); parted > most) {
            most = parted;
            best = n;
        }
        return !grown_a && !grown_b;
    };
    for (int step = 0; step < 24; ++step) {
        Gap<2> gap;
        core_gap(a, b, gap);
        if (look_along(gap.normal)) return;
    }
    if (!(most < 0)) return;
    // The best of those directions lies next to one that is better still.
    const auto exact = [](const Core2& core, const Vec2& n) {
        return core.is_smooth() ? dot(n, support(core, n)) : dot(n, furthest(core, n));
    };
    for (double turn = 0.1; turn > 1e-8; turn *= 0.5)
        for (const double way : {-turn, turn}) {
            const Vec2 aside = best + right(best) * way, n = aside * (1 / length(aside));
            const double parted = -exact(a, n) - exact(b, -n);
            if (!(parted > most)) continue;
            most = parted;
            best = n;
        }
    look_along(best);
    a.is_settled = true;
    a.along = best;
}

namespace {

/// The side that looks most into `direction`, or none for a point.
struct Side2
{
    bool is_side = false;
    Vec2 from, to;
    std::uint32_t number_from = 0, number_to = 0;
    double alignment = -1;
};
Side2 best_side(const Core2& core, const Vec2& direction)
{
    Side2 best;
    for (std::size_t i = 0; i < core.sides(); ++i) {
        const Vec2 side = core.next(i) - core.corner[i];
        const double size = length(side);
        if (!(size > 0)) continue;
        const double along = dot(right(side), direction) / size;
        if (along > best.alignment) {
            best.alignment = along;
            best.is_side = true;
            best.from = core.corner[i];
            best.to = core.next(i);
            best.number_from = core.number[i];
            best.number_to = core.number[i + 1 == core.corner.size() ? 0 : i + 1];
        }
    }
    return best;
}

struct Clip2
{
    /// Along `normal`, unit, from a to b.
    Clip2(const Core2& a, const Core2& b, const Vec2& normal, double contact_margin)
        : n(normal),
          t(right(normal)),
          radius_a(a.radius),
          radius_b(b.radius),
          margin(contact_margin),
          rounding(1e-14 * (a.reach + b.reach + a.radius + b.radius))
    {
    }
    Vec2 n, t;
    double radius_a, radius_b, margin;
    double rounding; ///< what is apart by less than that beyond the margin counts, as in keeps()
    ManifoldPoint<2> found[3];
    std::uint32_t count = 0;

    void add(double along, double height_a, double height_b, std::uint16_t feature_a, std::uint16_t feature_b)
    {
        const double top = height_a + radius_a, bottom = height_b - radius_b;
        if (!(top - bottom >= -margin - rounding)) return;
        const double depth = std::max(top - bottom, -margin);
        found[count++] = {t * along + n * (0.5 * (top + bottom)), depth, feature_a, feature_b};
    }
};

void clip_sides(Clip2& clip, const Side2& a, const Side2& b)
{
    // a's side runs against t as seen along n, b's with it: in order of t they are to-from and from-to.
    const double a0 = dot(clip.t, a.from), a1 = dot(clip.t, a.to);
    const double b0 = dot(clip.t, b.from), b1 = dot(clip.t, b.to);
    const bool back_a = a0 > a1, back_b = b0 > b1;
    const double low_a = std::min(a0, a1), high_a = std::max(a0, a1);
    const double low_b = std::min(b0, b1), high_b = std::max(b0, b1);
    const double begin = std::max(low_a, low_b), end = std::min(high_a, high_b);
    if (begin > end) return;
    const auto height = [&](const Side2& s, double at) {
        const double from = dot(clip.t, s.from), to = dot(clip.t, s.to);
        const double part = from == to ? 0 : std::clamp((at - from) / (to - from), 0.0, 1.0);
        return dot(clip.n, s.from + (s.to - s.from) * part);
    };
    const std::uint16_t side_a = feature_id(edge_feature, a.number_from),
                        side_b = feature_id(edge_feature, b.number_from);
    const auto add = [&](double at, bool corner_of_a, std::uint32_t number_a, std::uint32_t number_b) {
        clip.add(at, height(a, at), height(b, at),
                 corner_of_a ? feature_id(vertex_feature, number_a) : side_a,
                 corner_of_a ? side_b : feature_id(vertex_feature, number_b));
    };
    add(begin, low_a >= low_b, back_a ? a.number_to : a.number_from, back_b ? b.number_to : b.number_from);
    if (end > begin)
        add(end, high_a <= high_b, back_a ? a.number_from : a.number_to,
            back_b ? b.number_from : b.number_to);
}

/// The corner of a that reaches furthest along the normal, against the height at which b's side begins.
void clip_corner(Clip2& clip, const Core2& a, const Side2& b)
{
    const std::size_t corner = furthest_corner(a, clip.n);
    const Vec2 p = a.corner[corner];
    clip.add(dot(clip.t, p), dot(clip.n, p), dot(clip.n, b.from),
             feature_id(vertex_feature, a.number[corner]), feature_id(edge_feature, b.number_from));
}

void keep_two(Clip2& clip, Manifold<2>& manifold)
{
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < clip.count; ++i)
        if (clip.found[i].depth > clip.found[best].depth) best = i;
    std::swap(clip.found[0], clip.found[best]);
    if (clip.count == 3 &&
        length2(clip.found[2].p - clip.found[0].p) > length2(clip.found[1].p - clip.found[0].p))
        std::swap(clip.found[1], clip.found[2]);
    manifold.normal = clip.n;
    manifold.count = std::min(clip.count, 2u);
    for (std::uint32_t i = 0; i < manifold.count; ++i)
        manifold.point[i] = clip.found[i];
}

} // namespace

void make_manifold(const Core2& a, const Core2& b, const Gap<2>& cores, double margin, Manifold<2>& manifold)
{
    Clip2 clip(a, b, cores.normal, margin);
    if (cores.distance == 0) clip.rounding = core_touch * (a.reach + b.reach); // which may have been a gap
    const double depth = a.radius + b.radius - cores.distance;
    const Side2 side_a = best_side(a, clip.n), side_b = best_side(b, -clip.n);
    // As in 3D: against a side hit squarely the other shape shows a side at up to 60 degrees.
    const bool exact = side_a.alignment > squarely_face || side_b.alignment > squarely_face;
    const double threshold = exact ? other_face : nearly_face;
    std::uint16_t feature_a, feature_b;
    if (side_a.alignment > threshold && side_b.alignment > threshold) clip_sides(clip, side_a, side_b);
    double deepest = -HUGE_VAL;
    for (std::uint32_t i = 0; i < clip.count; ++i)
        deepest = std::max(deepest, clip.found[i].depth);
    const double slack = 1e-7 * (a.reach + b.reach + std::abs(depth));
    if (deepest > depth + slack) clip.count = 0;
    if (clip.count == 0 || !(deepest >= depth - slack)) {
        feature_a = side_a.alignment > nearly_face
                        ? feature_id(edge_feature, side_a.number_from)
                        : feature_id(vertex_feature, a.number[furthest_corner(a, clip.n)]);
        feature_b = side_b.alignment > nearly_face
                        ? feature_id(edge_feature, side_b.number_from)
                        : feature_id(vertex_feature, b.number[furthest_corner(b, -clip.n)]);
        clip.found[clip.count++] = {(cores.on_a + clip.n * a.radius + cores.on_b - clip.n * b.radius) * 0.5,
                                    depth, feature_a, feature_b};
    }
    keep_two(clip, manifold);
}

bool face_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold)
{
    Clip2 clip(a, segment, n, margin);
    const Side2 side_a = best_side(a, n), side_b = best_side(segment, -n);
    if (side_a.alignment > other_face) {
        clip_sides(clip, side_a, side_b);
    } else {
        const double at = dot(clip.t, furthest(a, n));
        const double s0 = dot(clip.t, side_b.from), s1 = dot(clip.t, side_b.to);
        if (at >= std::min(s0, s1) && at <= std::max(s0, s1)) clip_corner(clip, a, side_b);
    }
    if (clip.count == 0) return false;
    keep_two(clip, manifold);
    return true;
}

bool line_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold)
{
    Clip2 clip(a, segment, n, margin);
    clip_corner(clip, a, best_side(segment, -n));
    if (clip.count == 0) return false;
    keep_two(clip, manifold);
    return true;
}

namespace {

/// A user's shape against a half-space: its one support point says it all.
Core2 lowest_point(const Core2& core, const Vec2& normal)
{
    Core2 point(core.radius, core.reach, core.frame);
    point.add(support(core, -normal), 0);
    return point;
}

} // namespace

void half_space_gap(const Core2& a, const Vec2& normal, double offset, Gap<2>& gap)
{
    if (a.is_smooth()) return half_space_gap(lowest_point(a, normal), normal, offset, gap);
    const Vec2 lowest = furthest(a, -normal);
    gap.distance = dot(normal, lowest) - offset - a.radius;
    gap.normal = -normal;
    gap.on_a = lowest - normal * a.radius;
    gap.on_b = gap.on_a - normal * gap.distance;
}

/// The deepest corner and, of all others, the one furthest along the plane from it.
bool half_space_contact(const Core2& a, const Vec2& normal, double offset, double margin,
                        Manifold<2>& manifold)
{
    if (a.is_smooth()) return half_space_contact(lowest_point(a, normal), normal, offset, margin, manifold);
    const auto depth_of = [&](std::size_t i) { return offset + a.radius - dot(normal, a.corner[i]); };
    const auto point = [&](std::size_t i) {
        const double depth = depth_of(i);
        return ManifoldPoint<2>{a.corner[i] + normal * (0.5 * depth - a.radius), depth,
                                feature_id(vertex_feature, a.number[i]), feature_id(edge_feature, 0)};
    };
    const std::size_t first = furthest_corner(a, -normal);
    if (!(depth_of(first) >= -margin)) return false;
    std::size_t second = first;
    double most = 0;
    for (std::size_t i = 0; i < a.corner.size(); ++i) {
        const double away = std::abs(cross(normal, a.corner[i] - a.corner[first]));
        if (depth_of(i) >= -margin && away > most) {
            most = away;
            second = i;
        }
    }
    manifold.normal = -normal;
    manifold.count = 1;
    manifold.point[0] = point(first);
    if (second != first) manifold.point[manifold.count++] = point(second);
    return true;
}

void convex_gap(const Core2& a, const Core2& b, Gap<2>& gap)
{
    core_gap(a, b, gap);
    if (gap.distance <= 0) { // in the middle of what they share, as in 3D
        Manifold<2> manifold;
        make_manifold(a, b, gap, 0, manifold);
        gap.distance -= a.radius + b.radius;
        const Vec2 half = gap.normal * (0.5 * gap.distance);
        gap.on_a = manifold.point[0].p - half;
        gap.on_b = manifold.point[0].p + half;
        return;
    }
    gap.distance -= a.radius + b.radius;
    gap.on_a += gap.normal * a.radius;
    gap.on_b += gap.normal * -b.radius;
}

bool convex_contact(const Core2& a, const Core2& b, double margin, Manifold<2>& manifold)
{
    Gap<2> cores;
    core_gap(a, b, cores);
    if (!(cores.distance <= a.radius + b.radius + margin)) return false;
    make_manifold(a, b, cores, margin, manifold);
    return true;
}
} // namespace narrow
JOSTLE_NAMESPACE_END
