// SPDX-License-Identifier: MIT
// Ellipses and custom shapes in 2D, which become polygons where they meet another shape.
#include "narrow/convex/convex2.hpp"

#include <algorithm>
#include <span>

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// A search for the direction from a to b along which two cores are separated most, or overlap least. The
/// points of their difference furthest along some directions form a polygon inside it, and the origin's
/// distance from that, or its depth in it, bounds the separation by any direction. So the polygon grows where
/// the origin is nearest to it, until a direction is as good as that within a millionth, or after many steps
/// nearly so. The best direction is next to it. Sources: those of gjk() and expand().
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
        // The best direction, better by up to a millionth, is some thousandths of a radian away. Descend by
        // bisection:
        for (double turn = 0.02; turn > 1e-12; turn *= 0.5) {
            const Vec2 aside = right(n);
            n = n + aside * (dot(aside, look(n)) > 0 ? -turn : turn);
            n = n * (1 / length(n));
        }
        const Vec2 p = look(n);
        // Around the best, all directions are equally good up to rounding; the point determines the direction
        // better.
        if (-dot(n, p) > parted_ - 1e-15 * size_) best_ = n;
        return step < most_steps;
    }
    [[nodiscard]] const Vec2& best() const { return best_; }

  private:
    static constexpr std::size_t first_directions = 4, most_steps = 64;

    /// From one point of the polygon to the next.
    struct Side
    {
        Vec2 normal;      ///< out of the polygon; 0 if the two points coincide
        double offset;    ///< of its line from the origin; below 0 if that is outside
        Vec2 nearest;     ///< its point nearest to the origin
        double distance2; ///< of that
        bool is_between;  ///< it is between the two points
    };

    [[nodiscard]] static Vec2 exact(const Core2& core, const Vec2& n)
    {
        return core.is_smooth() ? support(core, n) : furthest(core, n);
    }
    /// The point of the difference furthest along n. Keeps n if it is the best so far.
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
    /// Adds another point. Returns false if that can't improve the result.
    bool grow()
    {
        std::size_t lowest = 0, nearest = 0;
        for (std::size_t i = 1; i < side_.size(); ++i) {
            if (side_[i].offset < side_[lowest].offset) lowest = i;
            if (side_[i].distance2 < side_[nearest].distance2) nearest = i;
        }
        Vec2 n = side_[lowest].normal;
        double bound = -side_[lowest].offset; // no direction separates them more
        if (!(side_[lowest].offset > 0 && side_[lowest].offset < HUGE_VAL)) {
            bound = std::sqrt(side_[nearest].distance2);
            const Side& side = side_[nearest];
            // If a point is practically on a side, only the side has a direction. Two sides of a flat polygon
            // are equally near, and one of the two faces the wrong way.
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

/// A smooth shape's corners are its support points along those directions of a regular polygon that matter,
/// and along normals.
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
            other.corner.size() == 2) { // it may belong to a surface, whose normal counts too
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

} // namespace narrow
JOSTLE_NAMESPACE_END
