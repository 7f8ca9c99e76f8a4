// SPDX-License-Identifier: MIT
// A convex shape in 3D for all tests: a core and everything within a radius around it. The core of a sphere
// is a point, that of a capsule a segment, that of a box or hull the polytope itself; boxes and hulls have a
// radius only if they are rounded. Cylinders, cones, ellipsoids and custom shapes have a core without
// corners, known by its support function; see Smooth.
#pragma once

#include "narrow/kernels/kernels.hpp"
#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Which support function a core has instead of corners, edges and faces.
enum class Smooth : std::uint8_t
{
    none,     ///< it is a polytope
    custom,   ///< a user's
    cylinder, ///< lengths: radius, half length
    cone,     ///< the same; its tip is at +y
    ellipsoid ///< lengths: half its widths
};

/// A core with its position, made for one shape and never changed to another.
/// For small shapes `polytope` points into the object itself, so the object mustn't move.
struct Core3
{
    Core3(const Shape<3>& convex, const Frame<3>& where, const Kernels& kernels = best_kernels());
    Core3(const Vec3& a, const Vec3& b, const Vec3& c, const Frame<3>& where, const Kernels& kernels);
    Core3(const Core3&) = delete;
    Core3& operator=(const Core3&) = delete;

    /// Known only by its support points: it has neither corners nor faces.
    [[nodiscard]] bool is_smooth() const { return smooth != Smooth::none; }

    Polytope polytope;
    Frame<3> frame;
    double radius = 0;
    bool is_box = false; ///< with extent along all axes
    double reach = 0;    ///< radius of a ball around frame.p that holds the core
    Smooth smooth = Smooth::none;
    Vec3 lengths; ///< of a smooth one that isn't custom
    const CustomShape<3>* custom = nullptr;
    const Kernels* kernels;

  private:
    void set_box(const Vec<3, double>& half);
    void set_flat_box(const Vec3& half);
    void set_smooth(Smooth what, const Vec<3, double>& size);
    double coordinates_[3 * lanes];
    double normals_[6];
    double offsets_[lanes];
    Vec3 directions_[3];
};

/// A point of a core furthest along some direction.
struct Support
{
    std::uint32_t vertex; ///< of a smooth core, the piece
    Vec3 p;               ///< as seen from a's position
};

/// The unit vector across the y axis towards which d leans; any if it doesn't lean.
inline Vec3 across_axis(const Vec3& d)
{
    Vec3 across{d.x, 0, d.z};
    if (!squares_well(length2(across))) {
        const double big = std::max(std::abs(d.x), std::abs(d.z));
        if (big == 0) return {1, 0, 0};
        across = {d.x / big, 0, d.z / big};
    }
    return across * (1 / length(across));
}
/// A smooth core's support function is made of smooth pieces: the upper and lower rim of a cylinder, the tip
/// and the rim of a cone, all of an ellipsoid. Returns the number of the piece with the point furthest along
/// d, in local axes.
inline std::uint32_t smooth_piece(const Core3& core, const Vec3& d)
{
    const Vec3& size = core.lengths;
    if (core.smooth == Smooth::cylinder) return d.y < 0 ? 1 : 0;
    if (core.smooth != Smooth::cone) return 0;
    const Vec3 rim = across_axis(d) * size.x;
    return d.y * size.y * 2 > d.x * rim.x + d.z * rim.z ? 0 : 1;
}
/// The point of a piece that is furthest along d, in local axes.
inline Vec3 smooth_point(const Core3& core, std::uint32_t piece, const Vec3& d)
{
    const Vec3& size = core.lengths;
    switch (core.smooth) {
    case Smooth::cylinder: {
        const Vec3 rim = across_axis(d) * size.x;
        return {rim.x, piece == 0 ? size.y : -size.y, rim.z};
    }
    case Smooth::cone: {
        if (piece == 0) return {0, size.y, 0};
        const Vec3 rim = across_axis(d) * size.x;
        return {rim.x, -size.y, rim.z};
    }
    case Smooth::ellipsoid: {
        Vec3 scaled{d.x * size.x, d.y * size.y, d.z * size.z};
        if (!squares_well(length2(scaled))) {
            const double big = std::max({std::abs(scaled.x), std::abs(scaled.y), std::abs(scaled.z)});
            if (big == 0) return {};
            const double up = lift(big);
            scaled = scaled * up * (1 / (big * up));
        }
        scaled = scaled * (1 / length(scaled));
        return {scaled.x * size.x, scaled.y * size.y, scaled.z * size.z};
    }
    case Smooth::custom:
        return load(core.custom->support({d.x, d.y, d.z}));
    case Smooth::none:
        break;
    }
    return {};
}
/// The point of a smooth core that is furthest along d, in local axes.
inline Vec3 smooth_support(const Core3& core, const Vec3& d)
{
    return smooth_point(core, smooth_piece(core, d), d);
}

inline Support support(const Core3& core, const Vec3& direction)
{
    const Vec3 d = core.frame.r.back(direction);
    if (core.is_smooth()) {
        const std::uint32_t piece = smooth_piece(core, d);
        return {piece, core.frame * smooth_point(core, piece, d)};
    }
    const Polytope& hull = core.polytope;
    std::uint32_t best = 0;
    if (core.is_box) { // bit i of a corner's number is set where coordinate i is positive
        best = (d.x > 0 ? 1u : 0u) | (d.y > 0 ? 2u : 0u) | (d.z > 0 ? 4u : 0u);
    } else if (hull.vertices > 3) {
        best = core.kernels->furthest(hull.x, hull.stride, d.x, d.y, d.z);
        if (best >= hull.vertices) best = 0; // no corner is furthest along NaN
    } else {
        double most = -HUGE_VAL;
        for (std::uint32_t i = 0; i < hull.vertices; ++i) {
            const double h = dot(d, hull.vertex(i));
            if (h > most) {
                most = h;
                best = i;
            }
        }
    }
    return {best, core.frame * hull.vertex(best)};
}

/// The point of a core furthest along `direction`, without its radius.
inline Vec3 furthest(const Core3& core, const Vec3& direction)
{
    return support(core, direction).p;
}

struct Ball
{
    Vec3 middle; ///< as seen from a's position
    double radius;
};
/// The biggest ball inside a core that touches its surface at point p, where `normal` is the unit outward
/// normal; on an ellipsoid it is as big as at the sharpest place. On an edge or a corner, and in cores whose
/// inside isn't known, its radius is 0.
Ball ball_inside(const Core3& core, const Vec3& p, const Vec3& normal);

/// gjk() counts less than this as touching. If two cores are this close to a requested distance, all queries
/// must decide by the same search.
inline double uncertain(const Core3& a, const Core3& b)
{
    return 2 * core_touch * (a.reach + b.reach);
}

} // namespace narrow
JOSTLE_NAMESPACE_END
