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

/// A direction from one core to the other, and how far it parts them; below 0: how much they overlap.
struct Axis2
{
    Vec2 normal;
    double separation = -HUGE_VAL;
    bool of_b = false;      ///< the direction is at right angles to a side of the other, and else of the one
    bool is_best = false;   ///< no other direction parts them more, wherever that may be
    std::size_t side = 0;   ///< that begins at this corner (a segment has one, which its ends belong to)
    std::size_t corner = 0; ///< of the core without the side: the furthest against the direction
};

/// A counterclockwise loop of corners seen from a's position, or one or two points.
struct Core2
{
    SmallVector<Vec2, 128> corner;     // contacts of polygons with so many corners allocate nothing
    const HullData<2>* hull = nullptr; ///< what it is made of, which then has the normals and numbers
    SmallVector<Vec2, 16> own_normal;
    SmallVector<std::uint32_t, 16> own_number;
    double radius, reach;
    bool smooth = false, is_box = false;
    Vec2 half; ///< half its widths, if it is a box or an ellipse
    const CustomShape<2>* custom = nullptr;
    Frame<2> frame;
    Axis2 axis; ///< to the other core, if refine() has found what parts them; without a side

    Core2(double core_radius, double core_reach, const Frame<2>& where)
        : radius(core_radius), reach(core_reach), frame(where)
    {
    }
    Core2(const Shape<2>& shape, const Frame<2>& where);
    /// Known by its support points: it has no corners until refine() gives it some.
    [[nodiscard]] bool is_smooth() const { return smooth; }
    void add(const Vec2& p, std::uint32_t n)
    {
        corner.push_back(p);
        own_number.push_back(n);
    }
    /// Once all corners are added.
    void add_normals();
    void add_normals(const Vec2& first);
    /// Of the side from corner i to the next, unit, outwards.
    [[nodiscard]] Vec2 normal(std::size_t i) const
    {
        return hull == nullptr ? own_normal[i] : frame.r * hull->normal[i];
    }
    /// Of a corner, for features.
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

/// How far unit direction n, from a to b, parts two polygons; below 0: how much they overlap along it.
double parted_by(const Core2& a, const Core2& b, const Vec2& n);

/// The side that looks most into `direction`, or none for a point.
struct Side2
{
    bool is_side = false;
    Vec2 from, to;
    std::uint32_t number_from = 0, number_to = 0;
    double alignment = -1;
};
Side2 best_side(const Core2& core, const Vec2& direction);

/// The point of a smooth shape furthest along a direction, which is none of the corners; both in local axes.
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

/// Turns whichever of the two is smooth into a polygon that is exact where it meets the other, and settles
/// along which direction they are parted most, or overlap least. No other is better by more than a millionth
/// of that, unless very many are nearly as good.
void refine(Core2& a, Core2& b);

/// The distance between cores (not their radii), or how much they overlap, and the points that have it. May
/// be just infinite if it is more than `enough`.
void core_gap(const Core2& a, const Core2& b, double enough, Gap<2>& gap);
/// The same with radii.
void convex_gap(const Core2& a, const Core2& b, double enough, Gap<2>& gap);
/// Returns whether there is a contact, a gap of up to `margin` included.
bool convex_contact(const Core2& a, const Core2& b, double margin, Manifold<2>& manifold);

/// From a gap between cores no wider than the radii and `margin` to the points of the contact.
void make_manifold(const Core2& a, const Core2& b, const Gap<2>& cores, double margin, Manifold<2>& manifold);
/// The contact of a core with a segment along unit vector n, which leads from a to the segment at right
/// angles to it. Returns whether there is one: only what lies over the segment counts.
bool face_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold);
/// Where a core reaches furthest through the line of a segment along n, wherever the segment ends.
bool line_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold);

/// Of a core and the half-space normal . p <= offset (from a's position, in world axes).
bool half_space_contact(const Core2& a, const Vec2& normal, double offset, double margin,
                        Manifold<2>& manifold);
void half_space_gap(const Core2& a, const Vec2& normal, double offset, Gap<2>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
