// SPDX-License-Identifier: MIT
#include "narrow/convex/convex2.hpp"

#include <algorithm>
#include <span>

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
Core2::Core2(const Shape<2>& shape, const Frame<2>& where)
    : Core2(ShapeAccess::radius(shape), ShapeAccess::reach(shape) - ShapeAccess::radius(shape), where)
{
    half = load(ShapeAccess::size(shape));
    const double x = half.x, y = half.y;
    switch (kind_of(shape)) {
    case Kind::sphere:
        add(frame.p, 0);
        break;
    case Kind::capsule:
        add(frame * Vec2{0, -y}, 0);
        if (y > 0) add(frame * Vec2{0, y}, 1);
        add_normals({1, 0});
        break;
    case Kind::rounded_box:
    case Kind::box:
        is_box = x > 0 && y > 0;
        if (is_box) {
            const Vec2 local[4] = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
            corner.resize(4);
            own_number.resize(4);
            for (std::uint32_t i = 0; i < 4; ++i) {
                corner[i] = where * local[i];
                own_number[i] = i;
            }
        } else {
            add(frame * Vec2{-x, -y}, 0);
            if (x > 0 || y > 0) add(frame * Vec2{x, y}, x > 0 ? 1 : 2);
        }
        add_normals(x > 0 ? Vec2{0, -1} : Vec2{1, 0});
        break;
    case Kind::rounded_hull:
    case Kind::convex: {
        hull = &ShapeAccess::data<HullData<2>>(shape);
        corner.resize(hull->loop.size());
        Vec2* const placed = corner.data();
        for (std::size_t i = 0; i < hull->loop.size(); ++i)
            placed[i] = where * hull->loop[i];
        break;
    }
    case Kind::half_space: // a plane and no polygon
    case Kind::mesh:       // not convex, but their parts are
    case Kind::height_field:
    case Kind::compound:
    case Kind::cylinder: // only in 3D
    case Kind::cone:
        break;
    case Kind::ellipsoid:
    case Kind::custom:
        smooth = true;
        custom = shape.custom();
        break;
    }
}

void Core2::add_normals()
{
    for (std::size_t i = 0; i < sides(); ++i)
        own_normal.push_back(unit(right(next(i) - corner[i])));
}
/// For a segment or box, from the local normal of the first side.
void Core2::add_normals(const Vec2& first)
{
    const Vec2 n = frame.r * first;
    own_normal.resize(sides());
    if (corner.size() == 4) {
        own_normal[0] = n;
        own_normal[1] = left(n);
        own_normal[2] = -n;
        own_normal[3] = right(n);
    } else if (corner.size() == 2) {
        own_normal[0] = n;
        own_normal[1] = -n;
    }
}

namespace {

std::size_t furthest_of(std::span<const Vec2> points, const Vec2& direction)
{
    std::size_t best = 0;
    double most = -HUGE_VAL;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (const double h = dot(direction, points[i]); h > most) {
            most = h;
            best = i;
        }
    return best;
}

/// For a box, the side whose normal is an axis or its opposite.
std::size_t side_of_box(int axis, bool against)
{
    return axis == 0 ? (against ? 3 : 1) : (against ? 0 : 2);
}
std::size_t corner_of_box(const Vec2& d)
{
    return d.x < 0 ? (d.y < 0 ? 0 : 3) : (d.y < 0 ? 1 : 2);
}

} // namespace

std::size_t furthest_corner(const Core2& core, const Vec2& direction)
{
    return furthest_of({core.corner.data(), core.corner.size()}, direction);
}

double parted_by(const Core2& a, const Core2& b, const Vec2& n)
{
    return dot(n, furthest(b, -n) - furthest(a, n));
}

Side2 best_side(const Core2& core, const Vec2& direction)
{
    if (core.sides() == 0) return {};
    std::size_t best;
    if (core.is_box) {
        const Vec2 d = core.frame.r.back(direction);
        const int axis = std::abs(d.x) > std::abs(d.y) ? 0 : 1;
        best = side_of_box(axis, d[axis] < 0);
    } else if (core.hull != nullptr) { // which has normals in its own axes
        best = furthest_of({core.hull->normal.data(), core.sides()}, core.frame.r.back(direction));
    } else {
        best = furthest_of({core.own_normal.data(), core.sides()}, direction);
    }
    const double most = dot(core.normal(best), direction);
    return {true, core.corner[best], core.next(best), core.number(best), core.number(core.after(best)), most};
}

namespace {

/// The direction at right angles to a side that separates two boxes most, from the distances of their centres
/// along the four axes.
Axis2 part_boxes(const Core2& a, const Core2& b)
{
    Axis2 best;
    const Vec2 d = b.frame.p - a.frame.p;
    const Mat2 &turn_a = a.frame.r, &turn_b = b.frame.r;
    const double c = std::abs(turn_a.c * turn_b.c + turn_a.s * turn_b.s),
                 s = std::abs(turn_a.c * turn_b.s - turn_a.s * turn_b.c);
    for (const bool of_b : {false, true}) {
        const Core2 &owner = of_b ? b : a, &other = of_b ? a : b;
        const Vec2 away = owner.frame.r.back(of_b ? -d : d);
        const Vec2 reach{c * other.half.x + s * other.half.y, s * other.half.x + c * other.half.y};
        for (const int axis : {0, 1}) {
            const double separation = std::abs(away[axis]) - owner.half[axis] - reach[axis];
            if (!(separation > best.separation)) continue;
            const bool against = away[axis] < 0;
            best.separation = separation;
            best.of_b = of_b;
            best.side = side_of_box(axis, against);
        }
    }
    const Core2 &owner = best.of_b ? b : a, &other = best.of_b ? a : b;
    const Vec2 n = owner.normal(best.side);
    best.normal = best.of_b ? -n : n;
    best.corner = corner_of_box(other.frame.r.back(-n));
    return best;
}

/// A corner of each of two polygons.
struct CornerPair
{
    std::size_t a, b;
    Vec2 way; ///< from a's corner to b's
};
CornerPair furthest_towards(const Core2& a, const Core2& b, const Vec2& way)
{
    const std::size_t of_a = furthest_corner(a, way), of_b = furthest_corner(b, -way);
    return {of_a, of_b, b.corner[of_b] - a.corner[of_a]};
}

/// The direction at right angles to a side that separates two polygons most, from a to b. Each side is tested
/// with the corner of the other polygon that is furthest against it, and from one side to the next that
/// corner moves along: by steps to a neighbour that is further (rotating calipers: Shamos 1978; Toussaint
/// 1983). The separation by a corner is never too small, so the side that is best by such corners is the best
/// of all if its own corner is the furthest of all, which is checked at the end. Only rounding on nearly
/// collinear sides stops a corner elsewhere; then each side is tested with each corner.
class SideSearch
{
  public:
    /// Begins at two corners, near which the answer should be.
    SideSearch(const Core2& a, const Core2& b, const CornerPair& begin) : a_(a), b_(b), begin_(begin) {}

    /// Ends early, with a separation above `enough`, once one is found.
    Axis2 find(double enough)
    {
        walk(a_, b_, begin_.a, begin_.b, false, enough);
        walk(b_, a_, begin_.b, begin_.a, true, enough);
        if (best_.separation == -HUGE_VAL) return best_; // two points
        const double walked = best_.separation;
        confirm();
        if (walked - best_.separation > 1e-14 * (a_.reach + b_.reach)) {
            best_ = {};
            test_all(a_, b_, false);
            test_all(b_, a_, true);
        }
        if (best_.separation > enough) return best_;
        look_past_ends(a_, b_, false);
        look_past_ends(b_, a_, true);
        return best_;
    }

  private:
    void note(const Vec2& n, double separation, bool of_b, std::size_t side, std::size_t corner)
    {
        if (separation > best_.separation) best_ = {of_b ? -n : n, separation, of_b, false, side, corner};
    }
    /// Tests all sides, from the one before a corner on, starting with a corner of the other.
    void walk(const Core2& owner, const Core2& other, std::size_t corner, std::size_t at, bool of_b,
              double enough)
    {
        std::size_t i = corner;
        for (std::size_t side = 0; side < owner.sides() && !(best_.separation > enough); ++side) {
            i = side == 0 ? owner.before(i) : owner.after(i);
            const Vec2 on = owner.corner[i], n = owner.normal(i);
            double far = dot(n, other.corner[at] - on);
            while (far > best_.separation) { // which decreases in each step, so that no corner comes twice
                const std::size_t before = other.before(at), after = other.after(at);
                const double far_before = dot(n, other.corner[before] - on),
                             far_after = dot(n, other.corner[after] - on);
                if (!(std::min(far_before, far_after) < far)) {
                    note(n, far, of_b, i, at);
                    break;
                }
                at = far_before < far_after ? before : after;
                far = std::min(far_before, far_after);
            }
        }
    }
    /// Tests all corners against the best side.
    void confirm()
    {
        const Core2 &owner = best_.of_b ? b_ : a_, &other = best_.of_b ? a_ : b_;
        if (other.corner.size() <= 3) return; // all have been tested, as neighbours
        const Vec2 n = best_.of_b ? -best_.normal : best_.normal;
        const std::size_t corner = furthest_corner(other, -n);
        const double separation = dot(n, other.corner[corner] - owner.corner[best_.side]);
        if (!(separation < best_.separation)) return;
        best_.separation = separation;
        best_.corner = corner;
    }
    void test_all(const Core2& owner, const Core2& other, bool of_b)
    {
        for (std::size_t i = 0; i < owner.sides(); ++i) {
            const Vec2 n = owner.normal(i);
            const std::size_t corner = furthest_corner(other, -n);
            note(n, dot(n, other.corner[corner] - owner.corner[i]), of_b, i, corner);
        }
    }
    /// A segment's ends can separate, but are never the shortest way out.
    void look_past_ends(const Core2& owner, const Core2& other, bool of_b)
    {
        if (owner.sides() != 2) return;
        for (const std::size_t end : {0u, 1u}) {
            const Vec2 along = right(owner.normal(end));
            const std::size_t corner = furthest_corner(other, -along);
            const double separation = dot(along, other.corner[corner] - owner.corner[end]);
            if (separation > 0) note(along, separation, of_b, 0, corner);
        }
    }

    const Core2 &a_, &b_;
    CornerPair begin_;
    Axis2 best_;
};

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

/// The place of a point along a side: 0 at its beginning, 1 at its end. NaN if the side has no length.
double part_of_side(const Vec2& p, const Core2& core, std::size_t side)
{
    const Vec2 from = core.corner[side], along = core.next(side) - from;
    return dot(p - from, along) / length2(along);
}

/// Where a side separates two polygons most, the nearest points are the other's corner and a point of the
/// side, or two corners each furthest towards the other. Returns false if rounding hides which.
bool nearest_by_axis(const Core2& a, const Core2& b, const Axis2& axis, Gap<2>& gap)
{
    const Core2 &owner = axis.of_b ? b : a, &other = axis.of_b ? a : b;
    const Vec2 from = owner.corner[axis.side], corner = other.corner[axis.corner];
    const double part = part_of_side(corner, owner, axis.side);
    Vec2 on = from + (owner.next(axis.side) - from) * part;
    const bool is_over = part >= 0 && part <= 1;
    if (!is_over) {
        const std::size_t end = part < 0 ? axis.side : owner.after(axis.side);
        on = owner.corner[end];
        const Vec2 way = corner - on;
        if (!(dot(way, owner.corner[owner.before(end)] - on) <= 0 &&
              dot(way, owner.corner[owner.after(end)] - on) <= 0 &&
              dot(way, other.corner[other.before(axis.corner)] - corner) >= 0 &&
              dot(way, other.corner[other.after(axis.corner)] - corner) >= 0))
            return false;
    }
    gap.on_a = axis.of_b ? corner : on;
    gap.on_b = axis.of_b ? on : corner;
    gap.distance = length(gap.on_b - gap.on_a);
    if (!(gap.distance > 0)) return false;
    // For a side as short as rounding errors, nothing is known about what is over it.
    if (is_over && gap.distance > axis.separation + 1e-14 * (a.reach + b.reach)) return false;
    gap.normal = (gap.on_b - gap.on_a) * (1 / gap.distance);
    return true;
}
/// The same by each corner and side.
void nearest_of_all(const Core2& a, const Core2& b, Gap<2>& gap)
{
    double least = HUGE_VAL;
    const auto sides = [](const Core2& core) { // a segment's two are one
        return core.corner.size() == 2 ? 1 : core.corner.size();
    };
    for (std::size_t i = 0; i < b.corner.size(); ++i)
        for (std::size_t k = 0; k < sides(a); ++k) {
            const double before = least;
            nearest_on_side(b.corner[i], a.corner[k], a.next(k), least, gap.on_a);
            if (least < before) gap.on_b = b.corner[i];
        }
    for (std::size_t i = 0; i < a.corner.size(); ++i)
        for (std::size_t k = 0; k < sides(b); ++k) {
            const double before = least;
            nearest_on_side(a.corner[i], b.corner[k], b.next(k), least, gap.on_b);
            if (least < before) gap.on_a = a.corner[i];
        }
    gap.distance = std::sqrt(least);
    if (gap.distance > 0) gap.normal = (gap.on_b - gap.on_a) * (1 / gap.distance);
}

/// The nearest points of two polygons that are apart, by corners that reach furthest towards each other
/// (Gilbert, Johnson and Keerthi 1988): of the difference of the two, the segment nearest to zero is replaced
/// by a nearer one, until no corner is before it.
class NearestSearch
{
  public:
    NearestSearch(const Core2& a, const Core2& b) : a_(a), b_(b), rounding_(1e-14 * (a.reach + b.reach)) {}

    /// Begins at two corners. Returns false if rounding hides which points are the nearest, or if they are no
    /// more than `clear` apart. The distance may be infinite if it is more than `enough`.
    bool find(double clear, double enough, const CornerPair& begin, Gap<2>& gap)
    {
        CornerPair next = first_ = second_ = begin;
        part_ = 0;
        Vec2 way = next.way;
        for (int step = 0; step < most_steps; ++step) {
            const double square = length2(way), distance = std::sqrt(square);
            const auto is_nearest = [&] { // no corner is before it by more than rounding
                return !(square - dot(way, next.way) > rounding_ * distance);
            };
            const auto is_beyond = [&] { return dot(way, next.way) > (enough + clear) * distance; };
            next = pair_near(way, next);
            if (is_nearest() || is_beyond()) { // but there may be more corners than these
                next = furthest_towards(a_, b_, way);
                if (is_nearest()) {
                    set(gap);
                    return gap.distance > clear;
                }
                if (is_beyond()) {
                    gap.distance = HUGE_VAL;
                    return true;
                }
            }
            if (!(replace_by(next, way) < square)) return false;
        }
        return false;
    }

  private:
    static constexpr int most_steps = 64;

    /// Steps to neighbours that are further.
    [[nodiscard]] CornerPair pair_near(const Vec2& way, const CornerPair& from) const
    {
        const std::size_t a = climb(a_, way, from.a), b = climb(b_, -way, from.b);
        return {a, b, b_.corner[b] - a_.corner[a]};
    }
    static std::size_t climb(const Core2& core, const Vec2& direction, std::size_t at)
    {
        double most = dot(direction, core.corner[at]);
        for (const bool onwards : {true, false}) {
            const std::size_t from = at;
            for (;;) { // terminates, since no corner comes twice: `most` grows
                const std::size_t next = onwards ? core.after(at) : core.before(at);
                const double h = dot(direction, core.corner[next]);
                if (!(h > most)) break;
                most = h;
                at = next;
            }
            if (at != from) break;
        }
        return at;
    }
    /// The nearer of the segments to the two previous corners. Returns its squared distance.
    double replace_by(const CornerPair& next, Vec2& way)
    {
        const CornerPair old[2] = {first_, second_};
        double least = HUGE_VAL;
        for (const CornerPair& other : old) {
            const Vec2 along = other.way - next.way;
            const double size = length2(along);
            const double part = size > 0 ? std::clamp(-dot(next.way, along) / size, 0.0, 1.0) : 0;
            const Vec2 nearest = next.way + along * part;
            if (const double square = length2(nearest); square < least) {
                least = square;
                way = nearest;
                first_ = next;
                second_ = other;
                part_ = part;
            }
        }
        return least;
    }
    void set(Gap<2>& gap) const
    {
        const auto between = [&](const Core2& core, std::size_t from, std::size_t to) {
            return from == to ? core.corner[from]
                              : core.corner[from] + (core.corner[to] - core.corner[from]) * part_;
        };
        gap.on_a = between(a_, first_.a, second_.a);
        gap.on_b = between(b_, first_.b, second_.b);
        gap.distance = length(gap.on_b - gap.on_a);
        gap.normal = (gap.on_b - gap.on_a) * (1 / gap.distance);
    }

    const Core2 &a_, &b_;
    double rounding_;
    CornerPair first_, second_; ///< the segment from the first to the second is nearest at `part_` of it
    double part_;
};

/// Of two parallel sides that overlap, a corner of one may be beside the other: moves it to the end of that.
/// A side continues in the next one if that is as high except for `rounding`.
void move_over(const Core2& owner, std::size_t side, const Vec2& out, double rounding, Vec2& corner)
{
    const double part = part_of_side(corner, owner, side);
    if (!(part < 0 || part > 1)) return;
    const bool onwards = part > 1;
    const Vec2 way = onwards ? left(out) : right(out);
    std::size_t end = onwards ? owner.after(side) : side;
    // At most once around: rounding may make all sides of a needle count as collinear.
    for (std::size_t step = 0; step < owner.sides() && dot(way, corner - owner.corner[end]) > 0; ++step) {
        const std::size_t next = onwards ? owner.after(end) : owner.before(end);
        const Vec2 along = owner.corner[next] - owner.corner[end];
        if (!(dot(out, along) >= -rounding && dot(way, along) > 0)) {
            corner = corner - way * dot(way, corner - owner.corner[end]);
            return;
        }
        end = next;
    }
}

/// The range along `way` of the points of a core that are furthest along `out`, except for `rounding`.
struct Stretch
{
    double from = HUGE_VAL, to = -HUGE_VAL;
};
Stretch furthest_stretch(const Core2& core, const Vec2& out, const Vec2& way, double rounding)
{
    Stretch stretch;
    const double least = dot(out, furthest(core, out)) - rounding;
    for (std::size_t i = 0; i < core.corner.size(); ++i)
        if (dot(out, core.corner[i]) >= least) {
            const double at = dot(way, core.corner[i]);
            stretch.from = std::min(stretch.from, at);
            stretch.to = std::max(stretch.to, at);
        }
    return stretch;
}
/// The same if only the direction is known: custom shapes and flat ellipses may have sides, too.
void move_over(const Core2& owner, const Core2& other, const Vec2& out, double rounding, Vec2& corner)
{
    const Vec2 way = left(out);
    const Stretch one = furthest_stretch(owner, out, way, rounding),
                  two = furthest_stretch(other, -out, way, rounding);
    const double from = std::max(one.from, two.from), to = std::min(one.to, two.to);
    if (!(from <= to)) return; // a corner of each, whose order is up to rounding
    const double at = dot(way, corner);
    corner = corner + way * (std::clamp(at, from, to) - at);
}

/// A point inside.
Vec2 middle(const Core2& core)
{
    return (core.corner[0] + core.corner[core.corner.size() / 2]) * 0.5;
}

/// Whether the lines of two segments, or a segment and a point, cross between their ends.
bool cross_each_other(const Core2& a, const Core2& b)
{
    const auto parts = [](const Core2& line, const Core2& ends) { // whether the line separates them
        const Vec2 from = line.corner[0], along = line.next(0) - from;
        return cross(along, ends.corner[0] - from) * cross(along, ends.next(0) - from) < 0;
    };
    return parts(a, b) && parts(b, a);
}

} // namespace

void core_gap(const Core2& a, const Core2& b, double enough, Gap<2>& gap)
{
    // Beyond the tip of a polygon that is nearly a segment, its sides separate nothing by more than rounding.
    const double clear = core_touch * (a.reach + b.reach);
    Axis2 axis = a.axis;
    const bool is_settled = axis.separation > -HUGE_VAL;
    if (!is_settled && a.corner.size() <= 2 && b.corner.size() <= 2 && !cross_each_other(a, b)) {
        nearest_of_all(a, b, gap);
        if (gap.distance > clear) return;
    }
    if (!is_settled && a.is_box && b.is_box) {
        axis = part_boxes(a, b);
    } else if (!is_settled) {
        const Vec2 way = middle(b) - middle(a);
        const CornerPair begin = furthest_towards(a, b, way);
        if (dot(way, begin.way) > clear * length(way) && NearestSearch(a, b).find(clear, enough, begin, gap))
            return;
        axis = SideSearch(a, b, begin).find(enough + clear);
    }
    if (axis.separation == -HUGE_VAL) { // two points
        const Vec2 d = b.corner[0] - a.corner[0];
        const double distance = length(d);
        gap = {distance, distance > 0 ? d * (1 / distance) : Vec2{0, 1}, a.corner[0], b.corner[0]};
        return;
    }
    if (axis.separation > enough + clear) {
        gap.distance = HUGE_VAL;
        return;
    }
    if (axis.separation > clear && !is_settled && nearest_by_axis(a, b, axis, gap)) return;
    // The nearer round shapes are, the less accurate is a normal from their points, so the direction is used.
    const bool are_apart = axis.is_best && axis.separation > clear;
    if (axis.separation > -clear && !are_apart) {
        nearest_of_all(a, b, gap);
        // Otherwise a gap closed by rounding.
        if (gap.distance > 0 && (axis.separation > clear || parted_by(a, b, gap.normal) > clear)) return;
    }
    gap.normal = axis.normal;
    gap.distance = are_apart ? axis.separation : std::min(0.0, axis.separation);
    const Core2 &owner = axis.of_b ? b : a, &other = axis.of_b ? a : b;
    const Vec2 out = axis.of_b ? -axis.normal : axis.normal; // of the side
    Vec2 corner = other.corner[axis.corner];
    const double rounding = 1e-12 * (a.reach + b.reach);
    if (is_settled)
        move_over(owner, other, out, rounding, corner);
    else
        move_over(owner, axis.side, out, rounding, corner);
    const Vec2 on = corner - out * gap.distance;
    gap.on_a = axis.of_b ? corner : on;
    gap.on_b = axis.of_b ? on : corner;
}

namespace {

/// A custom shape against a half-space: its one support point is enough.
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
                                feature_id(vertex_feature, a.number(i)), feature_id(edge_feature, 0)};
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

void convex_gap(const Core2& a, const Core2& b, double enough, Gap<2>& gap)
{
    core_gap(a, b, enough + a.radius + b.radius, gap);
    if (gap.distance <= 0) { // in the middle of the common part, as in 3D
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
    const double enough = a.radius + b.radius + margin;
    core_gap(a, b, enough, cores);
    if (!(cores.distance <= enough)) return false;
    make_manifold(a, b, cores, margin, manifold);
    return true;
}
} // namespace narrow
JOSTLE_NAMESPACE_END
