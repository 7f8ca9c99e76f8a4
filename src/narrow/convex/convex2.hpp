// SPDX-License-Identifier: MIT
// Convex shapes in the plane: rounded polygons. A circle is a point with a radius, a capsule a segment with
// one. Source: separating axes and clipping as in Ericson sec. 5.2.1. Gaps are in convex2.cpp, refine() in
// smooth2.cpp, and how sides are clipped against each other in manifold2.cpp.
#pragma once

#include "narrow/convex/manifold.hpp"
#include "narrow/shapes/shape_data.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A direction from one core to the other, and their separation along it, negative for an overlap.
struct Axis2
{
    Vec2 normal;
    double separation = -HUGE_VAL;
    bool of_b = false;      ///< the direction is at right angles to a side of b, otherwise of a
    bool is_best = false;   ///< no other direction separates them more
    std::size_t side = 0;   ///< the side that begins at this corner (a segment has one side, with both ends)
    std::size_t corner = 0; ///< of the other core: the furthest against the direction
};

/// A counterclockwise loop of corners seen from a's position, or one or two points.
struct Core2
{
    SmallVector<Vec2, 128> corner;     // contacts of polygons with up to this many corners allocate nothing
    const HullData<2>* hull = nullptr; ///< its hull, if any, which has the normals and numbers
    SmallVector<Vec2, 16> own_normal;
    SmallVector<std::uint32_t, 16> own_number;
    double radius, reach;
    bool smooth = false, is_box = false;
    Vec2 half; ///< half its widths, if it is a box or an ellipse
    const CustomShape<2>* custom = nullptr;
    Frame<2> frame;
    Axis2 axis; ///< to the other core, if refine() has found the separation; without a side

    Core2(double core_radius, double core_reach, const Frame<2>& where)
        : radius(core_radius), reach(core_reach), frame(where)
    {
    }
    Core2(const Shape<2>& shape, const Frame<2>& where);
    /// Known only by its support points: it has no corners until refine() adds some.
    [[nodiscard]] bool is_smooth() const { return smooth; }
    void add(const Vec2& p, std::uint32_t n)
    {
        corner.push_back(p);
        own_number.push_back(n);
    }
    /// Called once all corners are added.
    void add_normals();
    void add_normals(const Vec2& first);
    /// The unit outward normal of the side from corner i to the next.
    [[nodiscard]] Vec2 normal(std::size_t i) const
    {
        return hull == nullptr ? own_normal[i] : frame.r * hull->normal[i];
    }
    /// The number of a corner, for features.
    [[nodiscard]] std::uint32_t number(std::size_t i) const
    {
        return hull == nullptr ? own_number[i] : hull->corner[i];
    }
    [[nodiscard]] std::size_t sides() const { return corner.size() < 2 ? 0 : corner.size(); }
    [[nodiscard]] std::size_t after(std::size_t i) const { return i + 1 == corner.size() ? 0 : i + 1; }
    [[nodiscard]] std::size_t before(std::size_t i) const { return (i == 0 ? corner.size() : i) - 1; }
    [[nodiscard]] const Vec2& next(std::size_t i) const { return corner[after(i)]; }
};

/// The corner of a core furthest along a direction, and its number in `corner`.
std::size_t furthest_corner(const Core2& core, const Vec2& direction);
inline Vec2 furthest(const Core2& core, const Vec2& direction)
{
    return core.corner[furthest_corner(core, direction)];
}

/// The separation of two polygons along unit direction n, from a to b; negative for an overlap.
double parted_by(const Core2& a, const Core2& b, const Vec2& n);

/// The side that faces `direction` most, or none for a point.
struct Side2
{
    bool is_side = false;
    Vec2 from, to;
    std::uint32_t number_from = 0, number_to = 0;
    double alignment = -1;
};
Side2 best_side(const Core2& core, const Vec2& direction);

/// The point of a smooth shape furthest along a direction, not one of the corners; both in local axes.
inline Vec2 smooth_support(const Core2& core, const Vec2& d)
{
    if (core.custom != nullptr) return load(core.custom->support({d.x, d.y}));
    Vec2 scaled{d.x * core.half.x, d.y * core.half.y};
    const double big = std::max(std::abs(scaled.x), std::abs(scaled.y));
    if (big == 0) return {};
    const double up = lift(big);
    scaled = scaled * up * (1 / (big * up));
    scaled = scaled * (1 / length(scaled));
    return {scaled.x * core.half.x, scaled.y * core.half.y};
}
inline Vec2 support(const Core2& core, const Vec2& direction)
{
    return core.frame * smooth_support(core, core.frame.r.back(direction));
}

/// Turns whichever of the two is smooth into a polygon that is exact where it meets the other, and determines
/// the direction along which they are separated most, or overlap least. No other is better by more than a
/// millionth of that, unless very many are nearly as good.
void refine(Core2& a, Core2& b);

/// The distance between cores (without their radii), negative for an overlap, and the nearest points. May be
/// infinite if it is more than `enough`.
void core_gap(const Core2& a, const Core2& b, double enough, Gap<2>& gap);
/// The same with radii.
void convex_gap(const Core2& a, const Core2& b, double enough, Gap<2>& gap);
/// Returns whether there is a contact, a gap of up to `margin` included.
bool convex_contact(const Core2& a, const Core2& b, double margin, Manifold<2>& manifold);

/// Computes the points of the contact from a gap between cores no wider than the radii and `margin`.
void make_manifold(const Core2& a, const Core2& b, const Gap<2>& cores, double margin, Manifold<2>& manifold);
/// The contact of a core with a segment along unit vector n, which leads from a to the segment at right
/// angles to it. Returns whether there is one: only points over the segment count.
bool face_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold);
/// The core's furthest point through the line of a segment along n, wherever the segment ends.
bool line_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold);

/// The same for a core and the half-space normal . p <= offset (from a's position, in world axes).
bool half_space_contact(const Core2& a, const Vec2& normal, double offset, double margin,
                        Manifold<2>& manifold);
void half_space_gap(const Core2& a, const Vec2& normal, double offset, Gap<2>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
