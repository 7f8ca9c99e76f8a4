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
        corner.resize(hull.loop.size());
        number.resize(hull.loop.size());
        for (std::size_t i = 0; i < hull.loop.size(); ++i) {
            corner[i] = frame * hull.loop[i];
            number[i] = hull.corner[i];
        }
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
        ellipse = load(size);
        break;
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

void consider(Axis2& best, const Core2& owner, const Core2& other, const Vec2& outwards, const Vec2& on,
              bool of_b, double from)
{
    const double size = length(outwards);
    if (!(size > 0)) return;
    const Vec2 n = outwards * (1 / size);
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < other.corner.size(); ++i)
        least = std::min(least, dot(n, other.corner[i] - on));
    if (!(least > best.separation && least > from)) return;
    // Of a side as short as rounding the direction may be any, and other corners reach further along it.
    least -= dot(n, furthest(owner, n) - on);
    if (least > best.separation && least > from) best = {of_b ? -n : n, least, of_b};
}

/// `some` are the corners of `owner` whose sides count.
void consider_sides(Axis2& best, const Core2& some, const Core2& owner, const Core2& other, bool of_b)
{
    for (std::size_t i = 0; i < some.sides(); ++i)
        consider(best, owner, other, right(some.next(i) - some.corner[i]), some.corner[i], of_b, -HUGE_VAL);
    if (owner.corner.size() == 2) { // a segment's ends: they can separate, but never are the shortest way out
        const Vec2 along = owner.corner[1] - owner.corner[0];
        consider(best, owner, other, along, owner.corner[1], of_b, 0);
        consider(best, owner, other, -along, owner.corner[0], of_b, 0);
    }
}

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
    Axis2 axis = a.axis;
    if (axis.separation == -HUGE_VAL) {
        consider_sides(axis, a, a, b, false);
        consider_sides(axis, b, b, a, true);
    }
    if (axis.separation == -HUGE_VAL) { // two points
        const Vec2 d = b.corner[0] - a.corner[0];
        const double distance = length(d);
        gap = {distance, distance > 0 ? d * (1 / distance) : Vec2{0, 1}, a.corner[0], b.corner[0]};
        return;
    }
    // Beyond the tip of a polygon that is nearly a segment its sides part nothing by more than rounding.
    const double clear = core_touch * (a.reach + b.reach);
    bool meet = false;
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
            // The nearer round shapes are, the less their points say about the normal.
            if (axis.is_best && axis.separation > clear) {
                gap.distance = axis.separation;
                gap.normal = axis.normal;
                gap.on_b = gap.on_a + gap.normal * gap.distance;
                return;
            }
            if (axis.separation > clear || parted_by(a, b, gap.normal) > clear) return;
        }
        meet = gap.distance <= clear;
    }
    gap.normal = axis.normal;
    gap.distance = std::min(0.0, axis.separation);
    if (meet) { // of two parallel sides the corner furthest along the normal may lie beside the other
        gap.on_b = gap.on_a + axis.normal * gap.distance;
    } else if (axis.of_b) {
        gap.on_a = furthest(a, axis.normal);
        gap.on_b = gap.on_a + axis.normal * gap.distance;
    } else {
        gap.on_b = furthest(b, -axis.normal);
        gap.on_a = gap.on_b - axis.normal * gap.distance;
    }
}

namespace {

/// A search for the direction from a to b along which two cores are parted most, or overlap least. The points
/// of their difference furthest along some directions make a polygon inside it, and the origin's gap from
/// that, or its depth in it, is the most that any direction can part them by. So the polygon grows where the
/// origin is nearest to it, until a direction is as good as that but for a millionth, or after many steps
/// nearly so. The best direction lies next to it. Of two polygons, it grows until it holds the side or corner
/// of the difference that decides. Sides as short as rounding may have any direction: the points along it are
/// the furthest all the same. Sources: those of gjk() and expand().
class Parting
{
  public:
    Parting(const Core2& a, const Core2& b)
        : a_(a), b_(b), size_(a.reach + b.reach), are_polygons_(!a.is_smooth() && !b.is_smooth())
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

    /// Returns whether the direction is certain: up to rounding if the two are polygons, else to a millionth.
    bool find()
    {
        std::size_t step = 0;
        while (step < most_steps && grow())
            ++step;
        if (!are_polygons_) refine_best();
        return step < most_steps;
    }
    [[nodiscard]] const Vec2& best() const { return best_; }

  private:
    static constexpr std::size_t first_directions = 4, most_steps = 64;

    void refine_best()
    {
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
    }

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
        const double enough = are_polygons_ ? 0 : 1e-12 * size_ + 1e-6 * std::abs(bound);
        if (!(bound - parted_ > enough)) return false;
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
    const bool are_polygons_;
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
}

/// A polygon's corners that reach as far along a direction as any, but for rounding, and two more on each
/// side.
Core2 corners_around(const Core2& core, const Vec2& direction, double rounding)
{
    constexpr std::size_t more = 2;
    const std::size_t count = core.corner.size(), top = furthest_corner(core, direction);
    const auto reaches = [&](std::size_t i) {
        return dot(direction, core.corner[top] - core.corner[i % count]) <= rounding;
    };
    std::size_t begin = top + count, end = begin + 1; // modulo the number of corners
    while (end - begin < count && reaches(begin - 1))
        --begin;
    while (end - begin < count && reaches(end))
        ++end;
    if (end - begin + 2 * more >= count) return core;
    Core2 chain(core.radius, core.reach, core.frame);
    chain.is_chain = true;
    for (std::size_t i = begin - more; i < end + more; ++i)
        chain.add(core.corner[i % count], core.number[i % count]);
    return chain;
}

} // namespace

void refine(Core2& a, Core2& b)
{
    Parting parting(a, b);
    const bool is_certain = parting.find();
    const Vec2 n = parting.best();
    const double rounding = 1e-12 * (a.reach + b.reach);
    if (!a.is_smooth() && !b.is_smooth()) {
        if (!is_certain) return;
        Core2 near_a = corners_around(a, n, rounding), near_b = corners_around(b, -n, rounding);
        Axis2 axis;
        consider_sides(axis, near_a, a, b, false);
        consider_sides(axis, near_b, b, a, true);
        if (axis.separation < -core_touch * (a.reach + b.reach)) { // another side may overlap as little
            near_a = corners_around(a, axis.normal, rounding);
            near_b = corners_around(b, -axis.normal, rounding);
        } else if (dot(axis.normal, n) < 0) { // of a flat polygon, elsewhere
            return;
        }
        near_a.axis = axis;
        a = near_a;
        b = near_b;
        return;
    }
    for (Core2* core : {&a, &b}) {
        const Vec2 towards = core == &a ? n : -n;
        if (!core->is_smooth()) {
            *core = corners_around(*core, towards, rounding);
            continue;
        }
        const Core2& other = core == &a ? b : a;
        SmallVector<Vec2, 4> normals;
        normals.push_back(towards);
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
    a.axis = {n, parted_by(a, b, n), of_b, is_certain};
    b.axis = {-n, a.axis.separation, !of_b, is_certain};
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
