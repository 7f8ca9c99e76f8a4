// SPDX-License-Identifier: MIT
#include "narrow/convex/convex2.hpp"

#include <algorithm>
#include <span>

#include "narrow/shapes/shape_data.hpp"

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
            number.resize(4);
            for (std::uint32_t i = 0; i < 4; ++i) {
                corner[i] = frame * local[i];
                number[i] = i;
            }
        } else {
            add(frame * Vec2{-x, -y}, 0);
            if (x > 0 || y > 0) add(frame * Vec2{x, y}, x > 0 ? 1 : 2);
        }
        add_normals(x > 0 ? Vec2{0, -1} : Vec2{1, 0});
        break;
    case Kind::rounded_hull:
    case Kind::convex: {
        const auto& hull = ShapeAccess::data<HullData<2>>(shape);
        corner.resize(hull.loop.size());
        number.resize(hull.loop.size());
        normal.resize(hull.normal.size());
        for (std::size_t i = 0; i < hull.loop.size(); ++i) {
            corner[i] = frame * hull.loop[i];
            number[i] = hull.corner[i];
        }
        for (std::size_t i = 0; i < hull.normal.size(); ++i)
            normal[i] = frame.r * hull.normal[i];
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
    case Kind::custom:
        smooth = true;
        custom = shape.custom();
        break;
    }
}

void Core2::add_normals()
{
    for (std::size_t i = 0; i < sides(); ++i)
        normal.push_back(unit(right(next(i) - corner[i])));
}
/// Of a segment or box, from the local normal of the first side.
void Core2::add_normals(const Vec2& first)
{
    const Vec2 n = frame.r * first;
    normal.resize(sides());
    if (corner.size() == 4) {
        normal[0] = n;
        normal[1] = left(n);
        normal[2] = -n;
        normal[3] = right(n);
    } else if (corner.size() == 2) {
        normal[0] = n;
        normal[1] = -n;
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

/// Of a box, the side whose normal is an axis, or against it.
std::size_t side_of_box(int axis, bool against)
{
    return axis == 0 ? (against ? 3 : 1) : (against ? 0 : 2);
}
std::size_t corner_of_box(const Vec2& d)
{
    return d.x < 0 ? (d.y < 0 ? 0 : 3) : (d.y < 0 ? 1 : 2);
}

/// The direction at right angles to a side that parts two polygons most, from a to b. Each side is looked at
/// together with the corner of the other that reaches furthest against it, and from one side to the next that
/// corner goes round as well: by steps to a neighbour that reaches further (rotating calipers: Shamos 1978;
/// Toussaint 1983). What a corner says of a side is never too little, so that the side that is best by such
/// corners is the best of all if its own corner is the furthest of all, which is looked up at the end. Only
/// rounding on sides that are nearly in line stops a corner elsewhere; then each side is tested with each
/// corner.
class SideSearch
{
  public:
    SideSearch(const Core2& a, const Core2& b) : a_(a), b_(b) {}

    /// Ends early, with a separation above `enough`, once one is found.
    Axis2 find(double enough)
    {
        if (a_.is_box && b_.is_box) return of_boxes();
        walk(a_, b_, false, enough);
        walk(b_, a_, true, enough);
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
    /// From how far their centres are apart along the four axes.
    Axis2 of_boxes()
    {
        const Vec2 d = b_.frame.p - a_.frame.p;
        const Mat2 &turn_a = a_.frame.r, &turn_b = b_.frame.r;
        const double c = std::abs(turn_a.c * turn_b.c + turn_a.s * turn_b.s),
                     s = std::abs(turn_a.c * turn_b.s - turn_a.s * turn_b.c);
        for (const bool of_b : {false, true}) {
            const Core2 &owner = of_b ? b_ : a_, &other = of_b ? a_ : b_;
            const Vec2 away = owner.frame.r.back(of_b ? -d : d);
            const Vec2 reach{c * other.half.x + s * other.half.y, s * other.half.x + c * other.half.y};
            for (const int axis : {0, 1}) {
                const double separation = std::abs(away[axis]) - owner.half[axis] - reach[axis];
                if (!(separation > best_.separation)) continue;
                const bool against = away[axis] < 0;
                best_.separation = separation;
                best_.of_b = of_b;
                best_.side = side_of_box(axis, against);
            }
        }
        const Core2 &owner = best_.of_b ? b_ : a_, &other = best_.of_b ? a_ : b_;
        const Vec2 n = owner.normal[best_.side];
        best_.normal = best_.of_b ? -n : n;
        best_.corner = corner_of_box(other.frame.r.back(-n));
        return best_;
    }
    void note(const Vec2& n, double separation, bool of_b, std::size_t side, std::size_t corner)
    {
        if (separation > best_.separation) best_ = {of_b ? -n : n, separation, of_b, false, side, corner};
    }
    void walk(const Core2& owner, const Core2& other, bool of_b, double enough)
    {
        std::size_t at = 0;
        for (std::size_t i = 0; i < owner.sides() && !(best_.separation > enough); ++i) {
            const Vec2 on = owner.corner[i], n = owner.normal[i];
            double far = dot(n, other.corner[at] - on);
            while (far > best_.separation) {
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
    /// Asks all corners about the best side.
    void confirm()
    {
        const Core2 &owner = best_.of_b ? b_ : a_, &other = best_.of_b ? a_ : b_;
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
            const Vec2 n = owner.normal[i];
            const std::size_t corner = furthest_corner(other, -n);
            note(n, dot(n, other.corner[corner] - owner.corner[i]), of_b, i, corner);
        }
    }
    /// A segment's ends can separate, but never are the shortest way out.
    void look_past_ends(const Core2& owner, const Core2& other, bool of_b)
    {
        if (owner.sides() != 2) return;
        for (const std::size_t end : {0u, 1u}) {
            const Vec2 along = right(owner.normal[end]);
            const std::size_t corner = furthest_corner(other, -along);
            const double separation = dot(along, other.corner[corner] - owner.corner[end]);
            if (separation > 0) note(along, separation, of_b, 0, corner);
        }
    }

    const Core2 &a_, &b_;
    Axis2 best_;
};

/// How far unit direction n, from a to b, parts two polygons; below 0: how much they overlap along it.
double parted_by(const Core2& a, const Core2& b, const Vec2& n)
{
    return dot(n, furthest(b, -n) - furthest(a, n));
}

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
    if (core.sides() == 0) return {};
    std::size_t best = 0;
    double most = -HUGE_VAL;
    for (std::size_t i = 0; i < core.sides(); ++i)
        if (const double alignment = dot(core.normal[i], direction); alignment > most) {
            most = alignment;
            best = i;
        }
    return {true, core.corner[best], core.next(best), core.number[best], core.number[core.after(best)], most};
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

/// Where along a side a point lies: 0 at its beginning, 1 at its end. No number if the side has no length.
double part_of_side(const Vec2& p, const Core2& core, std::size_t side)
{
    const Vec2 from = core.corner[side], along = core.next(side) - from;
    return dot(p - from, along) / length2(along);
}

/// Where a side parts two polygons most, what is nearest is the other's corner and a point of the side, or of
/// two corners each is the furthest towards the other. Returns false where rounding hides which.
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
    // Of a side as short as rounding nobody knows what lies over it.
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

/// Of two sides that overlap and are parallel, a corner of the one may lie beside the other: moves it to the
/// end of that. A side goes on in the next one if this is as high but for `rounding`.
void move_over(const Core2& owner, std::size_t side, const Vec2& out, double rounding, Vec2& corner)
{
    const double part = part_of_side(corner, owner, side);
    if (!(part < 0 || part > 1)) return;
    const bool onwards = part > 1;
    const Vec2 way = onwards ? left(out) : right(out);
    std::size_t end = onwards ? owner.after(side) : side;
    while (dot(way, corner - owner.corner[end]) > 0) {
        const std::size_t next = onwards ? owner.after(end) : owner.before(end);
        const Vec2 along = owner.corner[next] - owner.corner[end];
        if (!(dot(out, along) >= -rounding && dot(way, along) > 0)) {
            corner = corner - way * dot(way, corner - owner.corner[end]);
            return;
        }
        end = next;
    }
}

/// Whether the lines of two segments, or a segment and a point, cross between their ends.
bool cross_each_other(const Core2& a, const Core2& b)
{
    const auto parts = [](const Core2& line, const Core2& ends) { // whether the line has them on two sides
        const Vec2 from = line.corner[0], along = line.next(0) - from;
        return cross(along, ends.corner[0] - from) * cross(along, ends.next(0) - from) < 0;
    };
    return parts(a, b) && parts(b, a);
}

} // namespace

void core_gap(const Core2& a, const Core2& b, double enough, Gap<2>& gap)
{
    // Beyond the tip of a polygon that is nearly a segment its sides part nothing by more than rounding.
    const double clear = core_touch * (a.reach + b.reach);
    Axis2 axis = a.axis;
    const bool is_settled = axis.separation > -HUGE_VAL;
    if (!is_settled && a.corner.size() <= 2 && b.corner.size() <= 2 && !cross_each_other(a, b)) {
        nearest_of_all(a, b, gap);
        if (gap.distance > clear) return;
    }
    if (!is_settled) axis = SideSearch(a, b).find(enough + clear);
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
    // The nearer round shapes are, the less their points say about the normal: the direction says it.
    const bool are_apart = axis.is_best && axis.separation > clear;
    if (axis.separation > -clear && !are_apart) {
        nearest_of_all(a, b, gap);
        // Else a gap that rounding has closed.
        if (gap.distance > 0 && (axis.separation > clear || parted_by(a, b, gap.normal) > clear)) return;
    }
    gap.normal = axis.normal;
    gap.distance = are_apart ? axis.separation : std::min(0.0, axis.separation);
    const Core2 &owner = axis.of_b ? b : a, &other = axis.of_b ? a : b;
    const Vec2 out = axis.of_b ? -axis.normal : axis.normal; // of the side
    Vec2 corner = other.corner[axis.corner];
    if (!is_settled) move_over(owner, axis.side, out, 1e-12 * (a.reach + b.reach), corner);
    const Vec2 on = corner - out * gap.distance;
    gap.on_a = axis.of_b ? corner : on;
    gap.on_b = axis.of_b ? on : corner;
}

namespace {

/// A search for the direction from a to b along which two cores are parted most, or overlap least. The points
/// of their difference furthest along some directions make a polygon inside it, and the origin's gap from
/// that, or its depth in it, is the most that any direction can part them by. So the polygon grows where the
/// origin is nearest to it, until a direction is as good as that but for a millionth, or after many steps
/// nearly so. The best direction lies next to it. Sources: those of gjk() and expand().
class Parting
{
  public:
    Parting(const Core2& a, const Core2& b) : a_(a), b_(b), size_(a.reach + b.reach)
    {
        const Vec2 way = b.frame.p - a.frame.p;
        const double far = length(way);
        best_ = far > 0 ? way * (1 / far) : Vec2{0, 1};
        const Vec2 aside = right(best_);
        for (const Vec2& n : {best_, -aside, -best_, aside}) // counterclockwise
            direction_.push_back(n);
        for (std::size_t i = 0; i < first_directions; ++i)
            point_.push_back(look(direction_[i]));
        for (std::size_t i = 0; i < first_directions; ++i)
            side_.push_back(side_at(i));
    }

    /// Returns whether no direction is better by more than a millionth.
    bool find()
    {
        std::size_t step = 0;
        while (step < most_steps && grow())
            ++step;
        Vec2 n = best_;
        // The best, if by a millionth, is some thousandths of a radian away. Downhill, by halving:
        for (double turn = 0.02; turn > 1e-12; turn *= 0.5) {
            const Vec2 aside = right(n);
            n = n + aside * (dot(aside, look(n)) > 0 ? -turn : turn);
            n = n * (1 / length(n));
        }
        const Vec2 p = look(n);
        // Around the best, all part them equally but for rounding; the point says more about the direction.
        if (-dot(n, p) > parted_ - 1e-15 * size_) best_ = n;
        return step < most_steps;
    }
    [[nodiscard]] const Vec2& best() const { return best_; }

  private:
    static constexpr std::size_t first_directions = 4, most_steps = 64;

    /// From one point of the polygon to the next.
    struct Side
    {
        Vec2 normal;      ///< out of the polygon; 0 where the two points are one
        double offset;    ///< of its line from the origin; below 0 if that is outside
        Vec2 nearest;     ///< its point nearest to the origin
        double distance2; ///< of that
        bool is_between;  ///< that is between the two points
    };

    [[nodiscard]] static Vec2 exact(const Core2& core, const Vec2& n)
    {
        return core.is_smooth() ? support(core, n) : furthest(core, n);
    }
    /// The point of the difference furthest along n. Notes n if it is the best so far.
    Vec2 look(const Vec2& n)
    {
        const Vec2 p = exact(a_, n) - exact(b_, -n);
        if (const double parted = -dot(n, p); parted > parted_) {
            parted_ = parted;
            best_ = n;
        }
        return p;
    }
    [[nodiscard]] Side side_at(std::size_t i) const
    {
        const Vec2 from = point_[i], along = point_[i + 1 == point_.size() ? 0 : i + 1] - from;
        const double far = length(along);
        if (!(far > 0)) return {{}, HUGE_VAL, from, length2(from), false};
        const Vec2 normal = right(along) * (1 / far);
        const double part = std::clamp(-dot(from, along) / (far * far), 0.0, 1.0);
        const Vec2 nearest = from + along * part;
        return {normal, dot(normal, from), nearest, length2(nearest), part > 0 && part < 1};
    }
    /// Takes in another point. Returns false where that can't make what is known better.
    bool grow()
    {
        std::size_t lowest = 0, nearest = 0;
        for (std::size_t i = 1; i < side_.size(); ++i) {
            if (side_[i].offset < side_[lowest].offset) lowest = i;
            if (side_[i].distance2 < side_[nearest].distance2) nearest = i;
        }
        Vec2 n = side_[lowest].normal;
        double bound = -side_[lowest].offset; // no direction parts them by more
        if (!(side_[lowest].offset > 0 && side_[lowest].offset < HUGE_VAL)) {
            bound = std::sqrt(side_[nearest].distance2);
            const Side& side = side_[nearest];
            // Of a point that lies as good as on a side, only the side has a direction. Two sides of a flat
            // polygon are equally near, and one of the two looks the wrong way.
            if (side.is_between || bound == 0)
                n = side.offset > 0 ? -side.normal : side.normal;
            else
                n = side.nearest * (-1 / bound);
            if (!(length2(n) > 0)) return false; // a point at the origin
        }
        if (!(bound - parted_ > 1e-12 * size_ + 1e-6 * std::abs(bound))) return false;
        const Vec2 p = look(n);
        if (!(dot(n, p) + bound > 1e-14 * size_)) return false;
        // The directions ascend by angle, and none is half a turn from the next.
        std::size_t after = 0;
        while (after + 1 < direction_.size() &&
               !(cross(direction_[after], n) >= 0 && cross(n, direction_[after + 1]) > 0))
            ++after;
        insert(direction_, after + 1, n);
        insert(point_, after + 1, p);
        insert(side_, after + 1, Side());
        side_[after] = side_at(after);
        side_[after + 1] = side_at(after + 1);
        return true;
    }
    template <class List, class Item>
    static void insert(List& list, std::size_t at, const Item& item)
    {
        list.push_back(item);
        std::rotate(list.data() + at, list.data() + list.size() - 1, list.data() + list.size());
    }

    const Core2 &a_, &b_;
    const double size_;
    SmallVector<Vec2, first_directions + most_steps> direction_,
        point_;                                             ///< of the polygon's corners, counterclockwise
    SmallVector<Side, first_directions + most_steps> side_; ///< from each to the next
    Vec2 best_;
    double parted_ = -HUGE_VAL; ///< by the best direction
};

/// A smooth shape's corners are its support points along the directions of a regular polygon, as many as
/// matter, and along normals.
constexpr std::uint32_t fan_size = 64;
struct Fan
{
    Vec2 direction[fan_size];
    constexpr Fan() : direction{}
    {
        Vec2 d{1, 0};
        const Vec2 step{0.99518472667219689, 0.098017140329560602};
        for (Vec2& each : direction) {
            each = d;
            d = {d.x * step.x - d.y * step.y, d.x * step.y + d.y * step.x};
        }
    }
};
constexpr Fan fan;

bool is_lower_half(const Vec2& d)
{
    return d.y < 0 || (d.y == 0 && d.x < 0);
}
/// By the angle from the x axis.
bool turns_less(const Vec2& d, const Vec2& e)
{
    return is_lower_half(d) != is_lower_half(e) ? is_lower_half(e) : cross(d, e) > 0;
}

/// Gives a smooth core the corners around its support points along some directions: it is a polygon there.
void add_corners(Core2& core, std::span<const Vec2> normals)
{
    struct Corner
    {
        Vec2 direction;
        std::uint32_t number;
    };
    SmallVector<Corner, 16> corners;
    for (const Vec2& normal : normals) {
        const Vec2 d = core.frame.r.back(normal);
        const auto* const behind =
            std::upper_bound(fan.direction + 1, fan.direction + fan_size, d, turns_less);
        const auto next = static_cast<std::uint32_t>(behind - fan.direction);
        corners.push_back({d, fan_size});
        for (const std::uint32_t away : {fan_size - 2, fan_size - 1, 0u, 1u}) { // two on each side
            const std::uint32_t number = (next + away) % fan_size;
            corners.push_back({fan.direction[number], number});
        }
    }
    std::sort(corners.data(), corners.data() + corners.size(), [](const Corner& c, const Corner& e) {
        if (turns_less(c.direction, e.direction)) return true;
        return !turns_less(e.direction, c.direction) && c.number < e.number;
    });
    for (const Corner& each : std::span(corners.data(), corners.size())) {
        const Vec2 p = core.frame * smooth_support(core, each.direction);
        const std::size_t count = core.corner.size();
        if (count != 0 && (length2(p - core.corner[count - 1]) == 0 || length2(p - core.corner[0]) == 0))
            continue;
        core.add(p, each.number);
    }
    core.add_normals();
}

} // namespace

void refine(Core2& a, Core2& b)
{
    Parting parting(a, b);
    const bool is_certain = parting.find();
    const Vec2 n = parting.best();
    for (Core2* core : {&a, &b}) {
        if (!core->is_smooth()) continue;
        const Core2& other = core == &a ? b : a;
        SmallVector<Vec2, 4> normals;
        normals.push_back(core == &a ? n : -n);
        if (!other.is_smooth() &&
            other.corner.size() == 2) { // it may be a surface's, whose normal counts too
            const Vec2 across = right(other.corner[1] - other.corner[0]);
            normals.push_back(across);
            normals.push_back(-across);
        }
        add_corners(*core, {normals.data(), normals.size()});
    }
    // Of a side and a corner, the corner is where they meet.
    const bool of_b = best_side(b, -n).alignment > best_side(a, n).alignment;
    const std::size_t corner = of_b ? furthest_corner(a, n) : furthest_corner(b, -n);
    a.axis = {n, parted_by(a, b, n), of_b, is_certain, 0, corner};
    b.axis = {-n, a.axis.separation, !of_b, is_certain, 0, corner};
}

namespace {

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

/// A side seen along the normal: from where to where it lies across it, and how high.
struct Span2
{
    double low, high, height_low, height_high;
    std::uint32_t number_low, number_high;
    std::uint16_t feature;
    Span2(const Clip2& clip, const Side2& side)
        : low(dot(clip.t, side.from)),
          high(dot(clip.t, side.to)),
          height_low(dot(clip.n, side.from)),
          height_high(dot(clip.n, side.to)),
          number_low(side.number_from),
          number_high(side.number_to),
          feature(feature_id(edge_feature, side.number_from))
    {
        if (!(low > high)) return;
        std::swap(low, high);
        std::swap(height_low, height_high);
        std::swap(number_low, number_high);
    }
    [[nodiscard]] double height(double at) const
    {
        if (at == low) return height_low;
        if (at == high) return height_high;
        return height_low + (height_high - height_low) * ((at - low) / (high - low));
    }
};

void clip_sides(Clip2& clip, const Side2& side_a, const Side2& side_b)
{
    const Span2 a(clip, side_a), b(clip, side_b);
    const double begin = std::max(a.low, b.low), end = std::min(a.high, b.high);
    if (begin > end) return;
    const auto add = [&](double at, bool corner_of_a, std::uint32_t number_a, std::uint32_t number_b) {
        clip.add(at, a.height(at), b.height(at),
                 corner_of_a ? feature_id(vertex_feature, number_a) : a.feature,
                 corner_of_a ? b.feature : feature_id(vertex_feature, number_b));
    };
    add(begin, a.low >= b.low, a.number_low, b.number_low);
    if (end > begin) add(end, a.high <= b.high, a.number_high, b.number_high);
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

namespace {

Clip2 clip_over(const Core2& a, const Core2& segment, const Vec2& n, double margin)
{
    Clip2 clip(a, segment, n, margin);
    clip.rounding = core_touch * (a.reach + segment.reach); // which may have been a gap
    return clip;
}

} // namespace

bool face_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold)
{
    Clip2 clip = clip_over(a, segment, n, margin);
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
    Clip2 clip = clip_over(a, segment, n, margin);
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

void convex_gap(const Core2& a, const Core2& b, double enough, Gap<2>& gap)
{
    core_gap(a, b, enough + a.radius + b.radius, gap);
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
    const double enough = a.radius + b.radius + margin;
    core_gap(a, b, enough, cores);
    if (!(cores.distance <= enough)) return false;
    make_manifold(a, b, cores, margin, manifold);
    return true;
}
} // namespace narrow
JOSTLE_NAMESPACE_END
