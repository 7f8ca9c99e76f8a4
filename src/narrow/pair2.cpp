// SPDX-License-Identifier: MIT
// Everything in the plane: rounded polygons. A circle is a point with a radius, a capsule a segment with one.
// Source: separating axes and clipping as in Ericson sec. 5.2.1; polygons here have few sides, so that each
// step simply looks at all of them.
#include <utility>

#include "narrow/convex3.hpp"
#include "narrow/motion.hpp"
#include "narrow/pair.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// A counterclockwise loop of corners seen from a's position, or one or two points.
struct Core2
{
    SmallVector<Vec2, 16> corner;
    SmallVector<std::uint32_t, 16> number; ///< of each corner, for features
    double radius, reach;
    const CustomShape<2>* custom = nullptr;
    Frame<2> frame;

    Core2(double core_radius, double core_reach, const Frame<2>& where)
        : radius(core_radius), reach(core_reach), frame(where)
    {
    }
    Core2(const Shape<2>& shape, const Frame<2>& where);
    void add(const Vec2& p, std::uint32_t n)
    {
        corner.push_back(p);
        number.push_back(n);
    }
    [[nodiscard]] std::size_t sides() const { return corner.size() < 2 ? 0 : corner.size(); }
    [[nodiscard]] const Vec2& next(std::size_t i) const { return corner[i + 1 == corner.size() ? 0 : i + 1]; }
};

/// How many corners stand for a user's smooth shape: a regular fan of its support points.
constexpr std::uint32_t custom_corners = 64;

Core2::Core2(const Shape<2>& shape, const Frame<2>& where)
    : Core2(ShapeAccess::radius(shape), ShapeAccess::reach(shape) - ShapeAccess::radius(shape), where)
{
    const Vec<2, double>& size = ShapeAccess::size(shape);
    switch (shape.type()) {
    case ShapeTypes::sphere:
        add(frame.p, 0);
        break;
    case ShapeTypes::capsule:
        add(frame * Vec2{0, -size[1]}, 0);
        if (size[1] > 0) add(frame * Vec2{0, size[1]}, 1);
        break;
    case ShapeTypes::box: {
        const double x = size[0], y = size[1];
        add(frame * Vec2{-x, -y}, 0);
        if (x > 0) add(frame * Vec2{x, -y}, 1);
        if (y > 0) add(frame * Vec2{x, y}, 2);
        if (x > 0 && y > 0) add(frame * Vec2{-x, y}, 3);
        break;
    }
    case ShapeTypes::convex: {
        const auto& hull = ShapeAccess::data<HullData<2>>(shape);
        for (std::size_t i = 0; i < hull.loop.size(); ++i)
            add(frame * hull.loop[i], hull.corner[i]);
        break;
    }
    case ShapeTypes::half_space:
        break;
    default: {
        custom = shape.custom();
        // The directions of a regular polygon, by turning one step after another.
        const Vec2 step{0.99518472667219689, 0.098017140329560602};
        Vec2 d{1, 0};
        for (std::uint32_t i = 0; i < custom_corners; ++i) {
            const Vec2 p = frame * load(custom->support({d.x, d.y}));
            if (corner.empty() || (length2(p - corner[corner.size() - 1]) > 0 && length2(p - corner[0]) > 0))
                add(p, i);
            d = {d.x * step.x - d.y * step.y, d.x * step.y + d.y * step.x};
        }
    }
    }
}

std::size_t furthest(const Core2& core, const Vec2& direction)
{
    std::size_t best = 0;
    double most = -HUGE_VAL;
    for (std::size_t i = 0; i < core.corner.size(); ++i)
        if (const double h = dot(direction, core.corner[i]); h > most) most = h, best = i;
    return best;
}

struct Axis
{
    Vec2 normal;
    double separation = -HUGE_VAL;
    bool of_b = false;
};

void consider(Axis& best, const Core2& other, const Vec2& outwards, const Vec2& on, bool of_b, double from)
{
    const double size = length(outwards);
    if (!(size > 0)) return;
    const Vec2 n = outwards * (1 / size);
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < other.corner.size(); ++i)
        least = std::min(least, dot(n, other.corner[i] - on));
    if (least > best.separation && least > from) best = {of_b ? -n : n, least, of_b};
}

void consider_sides(Axis& best, const Core2& owner, const Core2& other, bool of_b)
{
    for (std::size_t i = 0; i < owner.sides(); ++i)
        consider(best, other, right(owner.next(i) - owner.corner[i]), owner.corner[i], of_b, -HUGE_VAL);
    if (owner.sides() == 2) { // a segment's ends: they can separate, but never are the shortest way out
        const Vec2 along = owner.corner[1] - owner.corner[0];
        consider(best, other, along, owner.corner[1], of_b, 0);
        consider(best, other, -along, owner.corner[0], of_b, 0);
    }
}

void nearest_on_side(const Vec2& p, const Vec2& from, const Vec2& to, double& least, Vec2& on)
{
    const Vec2 d = to - from;
    const double size = length2(d);
    const double t = size > 0 ? std::clamp(dot(p - from, d) / size, 0.0, 1.0) : 0;
    const Vec2 q = from + d * t;
    if (const double distance = length2(p - q); distance < least) least = distance, on = q;
}

/// Of cores, without radii.
void core_gap(const Core2& a, const Core2& b, Gap<2>& gap)
{
    Axis axis;
    consider_sides(axis, a, b, false);
    consider_sides(axis, b, a, true);
    if (axis.separation == -HUGE_VAL) { // two points
        const Vec2 d = b.corner[0] - a.corner[0];
        const double distance = length(d);
        gap = {distance, distance > 0 ? d * (1 / distance) : Vec2{0, 1}, a.corner[0], b.corner[0]};
        return;
    }
    if (axis.separation > 1e-9 * (a.reach + b.reach)) {
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
            return;
        }
    }
    gap.normal = axis.normal;
    gap.distance = std::min(0.0, axis.separation);
    if (axis.of_b) {
        gap.on_a = a.corner[furthest(a, axis.normal)];
        gap.on_b = gap.on_a + axis.normal * gap.distance;
    } else {
        gap.on_b = b.corner[furthest(b, -axis.normal)];
        gap.on_a = gap.on_b - axis.normal * gap.distance;
    }
}

/// A user's smooth shape as a polygon that is exact where it meets `other`: its support point along the
/// normal becomes a corner, until that changes nothing. Each step quarters the error.
void refine(Core2& core, const Core2& other)
{
    for (int step = 0; step < 24; ++step) {
        Gap<2> gap;
        core_gap(core, other, gap);
        const Vec2 local = core.frame.r.back(gap.normal);
        const Vec2 p = core.frame * load(core.custom->support({local.x, local.y}));
        const double height = dot(gap.normal, core.corner[furthest(core, gap.normal)]);
        if (!(dot(gap.normal, p) > height + 1e-12 * core.reach)) return;
        // Between the corners of the side it lies outside of most.
        std::size_t after = 0;
        double most = -HUGE_VAL;
        for (std::size_t i = 0; i < core.corner.size(); ++i) {
            const Vec2 side = core.next(i) - core.corner[i];
            const double size = length(side);
            const double outside = size > 0 ? dot(right(side), p - core.corner[i]) / size : 0;
            if (outside > most) most = outside, after = i;
        }
        core.add(p, custom_corners);
        for (std::size_t i = core.corner.size() - 1; i > after + 1; --i) {
            std::swap(core.corner[i], core.corner[i - 1]);
            std::swap(core.number[i], core.number[i - 1]);
        }
    }
}

/// The side that looks most into `direction`, or none for a point.
struct Side
{
    bool is_side = false;
    Vec2 from, to;
    std::uint32_t number_from = 0, number_to = 0;
    double alignment = -1;
};
Side best_side(const Core2& core, const Vec2& direction)
{
    Side best;
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

struct Clip
{
    Vec2 n, t;
    double radius_a, radius_b, margin;
    ManifoldPoint<2> found[3];
    std::uint32_t count = 0;

    void add(double along, double height_a, double height_b, std::uint16_t feature_a, std::uint16_t feature_b)
    {
        const double top = height_a + radius_a, bottom = height_b - radius_b;
        if (!(top - bottom >= -margin)) return;
        found[count++] = {t * along + n * (0.5 * (top + bottom)), top - bottom, feature_a, feature_b};
    }
};

void clip_sides(Clip& clip, const Side& a, const Side& b)
{
    // a's side runs against t as seen along n, b's with it: in order of t they are to-from and from-to.
    const double a0 = dot(clip.t, a.from), a1 = dot(clip.t, a.to);
    const double b0 = dot(clip.t, b.from), b1 = dot(clip.t, b.to);
    const bool back_a = a0 > a1, back_b = b0 > b1;
    const double low_a = std::min(a0, a1), high_a = std::max(a0, a1);
    const double low_b = std::min(b0, b1), high_b = std::max(b0, b1);
    const double begin = std::max(low_a, low_b), end = std::min(high_a, high_b);
    if (begin > end) return;
    const auto height = [&](const Side& s, double at) {
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

void keep_two(Clip& clip, Manifold<2>& manifold)
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

void make_manifold(const Core2& a, const Core2& b, const Gap<2>& cores, double margin, Manifold<2>& manifold)
{
    Clip clip;
    clip.n = cores.normal;
    clip.t = right(cores.normal);
    clip.radius_a = a.radius, clip.radius_b = b.radius, clip.margin = margin;
    const double depth = a.radius + b.radius - cores.distance;
    const Side side_a = best_side(a, clip.n), side_b = best_side(b, -clip.n);
    // As in 3D: against a side hit squarely the other shape shows a side at up to 60 degrees.
    constexpr double squarely = 0.9998, nearly = 0.996, other = 0.5;
    const bool exact = side_a.alignment > squarely || side_b.alignment > squarely;
    const double threshold = exact ? other : nearly;
    std::uint16_t feature_a, feature_b;
    if (side_a.alignment > threshold && side_b.alignment > threshold) clip_sides(clip, side_a, side_b);
    double deepest = -HUGE_VAL;
    for (std::uint32_t i = 0; i < clip.count; ++i)
        deepest = std::max(deepest, clip.found[i].depth);
    const double slack = 1e-7 * (a.reach + b.reach + std::abs(depth));
    if (deepest > depth + slack) clip.count = 0;
    if (clip.count == 0 || !(deepest >= depth - slack)) {
        feature_a = side_a.alignment > nearly ? feature_id(edge_feature, side_a.number_from)
                                              : feature_id(vertex_feature, a.number[furthest(a, clip.n)]);
        feature_b = side_b.alignment > nearly ? feature_id(edge_feature, side_b.number_from)
                                              : feature_id(vertex_feature, b.number[furthest(b, -clip.n)]);
        clip.found[clip.count++] = {(cores.on_a + clip.n * a.radius + cores.on_b - clip.n * b.radius) * 0.5,
                                    depth, feature_a, feature_b};
    }
    keep_two(clip, manifold);
}

enum class Surface : std::uint8_t
{
    none,
    sheet
};

struct Part
{
    Part(const Shape<2>& shape, const Frame<2>& where)
        : core(shape, where), half_space(shape.type() == ShapeTypes::half_space)
    {
        if (!half_space) return;
        normal = where.r * load(ShapeAccess::size(shape));
        offset = shape.offset() + dot(normal, where.p);
    }
    /// A segment of a chain, or where it has no length a point.
    Part(const MeshData<2>& data, const Mesh<2>::Element& ends, const Frame<2>& where)
        : core(0, 0, where), mesh(&data), number(ends)
    {
        const Vec2 p = data.vertices[ends[0]], q = data.vertices[ends[1]];
        core.reach = std::sqrt(std::max(length2(p), length2(q)));
        core.add(where * p, 0);
        const double size = length(q - p);
        if (!(size > 0)) return;
        core.add(where * q, 1);
        surface = Surface::sheet;
        normal = where.r * (right(q - p) * (1 / size));
    }

    Core2 core;
    bool half_space = false;
    Vec2 normal; ///< of a half-space; of a segment's front: its right side
    double offset = 0;
    Surface surface = Surface::none;
    const MeshData<2>* mesh = nullptr;
    Mesh<2>::Element number{}; ///< of a segment's ends
};

Region<2> region_of(const Part& part, const Frame<2>& frame)
{
    if (part.half_space) return everywhere<2>();
    Region<2> region{{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
    const Core2& core = part.core;
    const double grow = core.radius + 1e-14 * (core.reach + core.radius + length(frame.p));
    for (std::size_t i = 0; i < core.corner.size(); ++i) {
        const Vec2 p = frame.r.back(core.corner[i] - frame.p);
        for (int d = 0; d < 2; ++d) {
            region.lo[d] = std::min(region.lo[d], p[d] - grow);
            region.hi[d] = std::max(region.hi[d], p[d] + grow);
        }
    }
    return region;
}
Region<2> region_of(const Shape<2>& shape, const Vec2& at, const Frame<2>& frame)
{
    const double reach = ShapeAccess::reach(shape) * (1 + 1e-14);
    const Vec2 p = frame.r.back(at - frame.p);
    return {{p.x - reach, p.y - reach}, {p.x + reach, p.y + reach}};
}

template <class Visit>
void for_each_part(const Shape<2>& shape, const Frame<2>& frame, const Region<2>& region,
                   const Range<2>& range, Visit&& visit)
{
    if (shape.type() == ShapeTypes::mesh) {
        const auto& mesh = ShapeAccess::data<MeshData<2>>(shape);
        for (std::uint32_t k = 0; k < mesh.nodes.size();) {
            const TreeNode& node = mesh.nodes[k];
            if (!region.meets(node.lo, node.hi, range)) {
                k = node.skip;
                continue;
            }
            for (std::uint32_t i = 0; i < node.count; ++i) {
                const std::uint32_t e = mesh.order[node.first + i];
                const Vec2 p = mesh.vertices[mesh.elements[e][0]], q = mesh.vertices[mesh.elements[e][1]];
                const Vec2 lo{std::min(p.x, q.x), std::min(p.y, q.y)},
                    hi{std::max(p.x, q.x), std::max(p.y, q.y)};
                if (region.meets(lo, hi, range)) visit(e, Part(mesh, mesh.elements[e], frame));
            }
            ++k;
        }
    } else if (shape.type() == ShapeTypes::compound) {
        std::uint32_t number = 0;
        for (const auto& child : ShapeAccess::data<CompoundData<2>>(shape).children) {
            const double ball = ShapeAccess::reach(child.shape) * (1 + 1e-14);
            const Vec2 grow{ball, ball};
            const bool has_part = child.shape.custom() == nullptr || child.shape.custom()->has_support();
            if (has_part && region.meets(child.frame.p - grow, child.frame.p + grow, range))
                visit(number, Part(child.shape, {frame.r * child.frame.r, frame * child.frame.p}));
            ++number;
        }
    } else if (shape.custom() == nullptr || shape.custom()->has_support()) {
        visit(0u, Part(shape, frame));
    }
}

bool has_parts(const Shape<2>& shape)
{
    return shape.type() >= ShapeTypes::mesh && shape.type() <= ShapeTypes::compound;
}

void half_space_gap(const Core2& a, const Vec2& normal, double offset, Gap<2>& gap)
{
    const Vec2 lowest = a.corner[furthest(a, -normal)];
    gap.distance = dot(normal, lowest) - offset - a.radius;
    gap.normal = -normal;
    gap.on_a = lowest - normal * a.radius;
    gap.on_b = gap.on_a - normal * gap.distance;
}

/// The deepest corner and, of all others, the one furthest along the plane from it.
bool half_space_contact(const Core2& a, const Vec2& normal, double offset, double margin,
                        Manifold<2>& manifold)
{
    const auto depth_of = [&](std::size_t i) { return offset + a.radius - dot(normal, a.corner[i]); };
    const auto point = [&](std::size_t i) {
        const double depth = depth_of(i);
        return ManifoldPoint<2>{a.corner[i] + normal * (0.5 * depth - a.radius), depth,
                                feature_id(vertex_feature, a.number[i]), feature_id(edge_feature, 0)};
    };
    const std::size_t first = furthest(a, -normal);
    if (!(depth_of(first) >= -margin)) return false;
    std::size_t second = first;
    double most = 0;
    for (std::size_t i = 0; i < a.corner.size(); ++i) {
        const double away = std::abs(cross(normal, a.corner[i] - a.corner[first]));
        if (depth_of(i) >= -margin && away > most) most = away, second = i;
    }
    manifold.normal = -normal;
    manifold.count = 1;
    manifold.point[0] = point(first);
    if (second != first) manifold.point[manifold.count++] = point(second);
    return true;
}

void flip(Manifold<2>& manifold)
{
    manifold.normal = -manifold.normal;
    for (std::uint32_t i = 0; i < manifold.count; ++i)
        std::swap(manifold.point[i].feature_a, manifold.point[i].feature_b);
}

void convex_gap(const Core2& a, const Core2& b, Gap<2>& gap)
{
    core_gap(a, b, gap);
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

/// As in 3D, for an end of a segment.
Beyond beyond(const Part& segment, const Vec2& n, double side)
{
    const Core2& core = segment.core;
    const Vec2 along = core.corner[1] - core.corner[0];
    if (std::abs(dot(n, along)) <= 1e-6 * length(along)) return Beyond::nothing; // all of it: the side
    const std::size_t at = dot(n, along) > 0 ? 1 : 0;
    const Vec2 front = segment.normal * side;
    bool higher = false, rising = false, steep = false;
    segment.mesh->find_at(segment.number[at], [&](const Mesh<2>::Element& other) {
        const std::uint32_t v = other[other[0] == segment.number[at] ? 1 : 0];
        if (v == segment.number[1 - at]) return false;
        const Vec2 away = core.frame * segment.mesh->vertices[v] - core.corner[at];
        rising = rising || leads_along(away, front);
        if (!leads_along(away, n)) return false;
        higher = true;
        const double down = -dot(away, front);
        steep = down > 0 && down * down > 0.25 * length2(away);
        return steep;
    });
    if (steep) return Beyond::steeply;
    return higher || rising ? Beyond::onwards : Beyond::nothing;
}

/// b is a segment of a chain. Where the chain goes on towards a, its end can't be hit from the side: then only
/// what lies over the segment counts, along its normal.
Answer sheet_contact(const Core2& a, const Part& b, double margin, Manifold<2>& manifold, double& gap)
{
    Gap<2> cores;
    core_gap(a, b.core, cores);
    if (!(cores.distance <= a.radius + margin)) return Answer::none;
    gap = cores.distance - a.radius;
    const double along = -dot(cores.normal, b.normal);
    const Beyond goes = beyond(b, -cores.normal, along >= 0 ? 1 : -1);
    if (goes != Beyond::onwards) {
        make_manifold(a, b.core, cores, margin, manifold);
        return goes == Beyond::nothing ? Answer::contact : Answer::last;
    }
    // To which side of its line it pushes a body: where it met it nearly edgewise, the shorter way out.
    const double line = dot(b.normal, b.core.corner[0]);
    const double above = dot(b.normal, a.corner[furthest(a, b.normal)]) - line;
    const double below = line - dot(b.normal, a.corner[furthest(a, -b.normal)]);
    const bool front = std::abs(along) >= 0.5 ? along > 0 : above >= below;
    Clip clip;
    clip.n = front ? -b.normal : b.normal;
    clip.t = right(clip.n);
    clip.radius_a = a.radius, clip.radius_b = 0, clip.margin = margin;
    const Side side_a = best_side(a, clip.n), side_b = best_side(b.core, -clip.n);
    const std::size_t corner = furthest(a, clip.n);
    const Vec2 p = a.corner[corner];
    const double at = dot(clip.t, p), s0 = dot(clip.t, side_b.from), s1 = dot(clip.t, side_b.to);
    const auto add_corner = [&] {
        clip.add(at, dot(clip.n, p), dot(clip.n, side_b.from), feature_id(vertex_feature, a.number[corner]),
                 feature_id(edge_feature, side_b.number_from));
    };
    if (side_a.alignment > 0.5)
        clip_sides(clip, side_a, side_b);
    else if (at >= std::min(s0, s1) && at <= std::max(s0, s1))
        add_corner();
    const Answer answer = clip.count != 0      ? Answer::contact
                          : cores.distance > 0 ? Answer::last
                                               : Answer::spare;
    if (answer != Answer::contact) add_corner(); // where it reaches furthest through the line of the segment
    if (clip.count == 0) return Answer::none;
    keep_two(clip, manifold);
    return answer;
}

/// Both with their user's shapes refined for each other.
struct Refined
{
    Part a, b;
    Refined(const Part& given_a, const Part& given_b) : a(given_a), b(given_b)
    {
        if (a.core.custom != nullptr) refine(a.core, b.core);
        if (b.core.custom != nullptr) refine(b.core, a.core);
        a.core.custom = b.core.custom = nullptr;
    }
};
bool is_custom(const Part& part)
{
    return !part.half_space && part.core.custom != nullptr;
}
/// A user's shape against a half-space: its one support point says it all.
Core2 lowest_point(const Part& part, const Vec2& normal)
{
    if (part.core.custom == nullptr) return part.core;
    Core2 core(part.core.radius, part.core.reach, part.core.frame);
    const Vec2 local = core.frame.r.back(-normal);
    core.add(core.frame * load(part.core.custom->support({local.x, local.y})), 0);
    return core;
}

/// `gap` is set where the answer isn't sure: how far apart the parts are.
Answer part_contact(const Part& a, const Part& b, double margin, Manifold<2>& manifold, double& gap)
{
    if (a.half_space && b.half_space) return Answer::none;
    if (!a.half_space && !b.half_space && (is_custom(a) || is_custom(b))) {
        const Refined refined(a, b);
        return part_contact(refined.a, refined.b, margin, manifold, gap);
    }
    if (b.half_space)
        return answer_if(half_space_contact(lowest_point(a, b.normal), b.normal, b.offset, margin, manifold));
    Answer answer;
    if (a.half_space)
        answer =
            answer_if(half_space_contact(lowest_point(b, a.normal), a.normal, a.offset, margin, manifold));
    else if (a.surface == b.surface)
        return answer_if(convex_contact(a.core, b.core, margin, manifold));
    else if (b.surface != Surface::none)
        return sheet_contact(a.core, b, margin, manifold, gap);
    else
        answer = sheet_contact(b.core, a, margin, manifold, gap);
    if (answer != Answer::none) flip(manifold);
    return answer;
}

void part_gap(const Part& a, const Part& b, Gap<2>& gap)
{
    gap.distance = HUGE_VAL;
    if (a.half_space && b.half_space) return;
    if (!a.half_space && !b.half_space && (is_custom(a) || is_custom(b))) {
        const Refined refined(a, b);
        return convex_gap(refined.a.core, refined.b.core, gap);
    }
    if (b.half_space) return half_space_gap(lowest_point(a, b.normal), b.normal, b.offset, gap);
    if (a.half_space) {
        half_space_gap(lowest_point(b, a.normal), a.normal, a.offset, gap);
        gap.normal = -gap.normal;
        std::swap(gap.on_a, gap.on_b);
        return;
    }
    convex_gap(a.core, b.core, gap);
}

template <class Visit>
void for_each_part_pair(const Placed<2>& pair, const Range<2>& range, Visit&& visit)
{
    const Frame<2> frame_a{pair.ra, {}}, frame_b{pair.rb, pair.d};
    const bool many_a = has_parts(*pair.a), many_b = has_parts(*pair.b);
    Region<2> around = many_a ? region_of(*pair.b, pair.d, frame_a) : everywhere<2>();
    if (many_a) around.way = frame_a.r.back(range.linear);
    for_each_part(*pair.a, frame_a, around, range, [&](std::uint32_t number_a, const Part& a) {
        Region<2> region = many_b ? region_of(a, frame_b) : everywhere<2>();
        if (many_b) region.way = frame_b.r.back(-range.linear);
        for_each_part(*pair.b, frame_b, region, range,
                      [&](std::uint32_t number_b, const Part& b) { visit(number_a, a, number_b, b); });
    });
}

Spread<2> spread_of(const Part& part, const Turning<2>& turning, const Vec2& n)
{
    Spread<2> spread(turning, n);
    const Core2& core = part.core;
    if (part.half_space) // n is its normal
        spread.add_height(part.offset);
    else if (is_custom(part))
        spread.add_somewhere(dot(n, lowest_point(part, -n).corner[0]), core.frame.p, core.reach);
    else
        for (std::size_t i = 0; i < core.corner.size(); ++i)
            spread.add(core.corner[i], core.radius);
    return spread;
}

double safe_time(const Flight<2>& flight, const Part& a, const Part& b, const Gap<2>& gap)
{
    const auto along = [&](const Vec2& n) {
        return flight.safe_time(spread_of(a, flight.a, n), spread_of(b, flight.b, -n), n);
    };
    double time = along(gap.normal);
    // What slides along a segment may come nearer to its end, but not to its line.
    for (const Part* part : {&a, &b})
        if (part->surface != Surface::none && !a.half_space && !b.half_space && time < 1)
            time = std::max(time, along(part->normal * (dot(part->normal, gap.normal) > 0 ? 1.0 : -1.0)));
    return time;
}

} // namespace

template <>
void find_contacts(const Placed<2>& pair, double margin, FoundList<2>& found)
{
    if (!within_reach(pair, margin)) return;
    Collector<2> collector(pair, found);
    for_each_part_pair(pair, Range<2>{margin},
                       [&](std::uint32_t number_a, const Part& a, std::uint32_t number_b, const Part& b) {
                           Found<2> one;
                           double gap = 0;
                           const Answer answer = part_contact(a, b, margin, one.manifold, gap);
                           one.part_a = number_a;
                           one.part_b = number_b;
                           collector.add(answer, one, gap);
                       });
    collector.finish();
}

template <>
void find_gap(const Placed<2>& pair, double enough, Gap<2>& best)
{
    best.distance = HUGE_VAL;
    for (int d = 0; d < 2; ++d)
        if (!(std::abs(pair.d[d]) <= 1e61)) return; // nothing is that big
    Range<2> range{enough};
    for_each_part_pair(pair, range, [&](std::uint32_t, const Part& a, std::uint32_t, const Part& b) {
        Gap<2> gap;
        part_gap(a, b, gap);
        if (!(gap.distance <= range.reach) || !(gap.distance < best.distance)) return;
        best = gap;
        range.reach = std::max(0.0, std::min(range.reach, gap.distance));
    });
}

template <>
bool find_touch(const Placed<2>& pair)
{
    if (!within_reach(pair, 0)) return false;
    bool touch = false;
    // Below this nothing is within reach: the search ends.
    Range<2> range{0};
    for_each_part_pair(pair, range, [&](std::uint32_t, const Part& a, std::uint32_t, const Part& b) {
        Gap<2> gap;
        part_gap(a, b, gap);
        if (gap.distance <= 0) touch = true, range.reach = -HUGE_VAL;
    });
    return touch;
}

template <>
Outlook<2> look_ahead(const Moving<2>& pair, const Placed<2>& now, double tolerance, double time)
{
    const Flight<2> flight(pair, now, tolerance);
    return look_at_parts(
        flight, now, time,
        [](const Placed<2>& placed, const Range<2>& range, const auto& visit) {
            for_each_part_pair(placed, range, visit);
        },
        [](const Part& a, const Part& b, double, Gap<2>& gap) { part_gap(a, b, gap); },
        [&](const Part& a, const Part& b, const Gap<2>& gap) { return safe_time(flight, a, b, gap); });
}

} // namespace narrow
JOSTLE_NAMESPACE_END
