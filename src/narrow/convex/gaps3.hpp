// SPDX-License-Identifier: MIT
// Distances of the simplest shapes in closed form. Each has its slow twin in convex3.hpp, which decides if
// they return unclear: for cores that touch or nearly do, these formulas give no direction.
//
// All are inlined into their callers: results that are written number by number and read back as vectors
// stall on store forwarding, which takes longer than the formulas themselves.
#pragma once

#include "narrow/convex/manifold.hpp"
#include "narrow/kernels/kernels.hpp"
#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

inline double clamped(double x, double half)
{
    const double up = half < x ? half : x, low = 0 - half; // like the kernels, including the sign of zero
    return up < low ? low : up;
}

/// Two cores with a radius around each: the distance of the cores and the nearest points, `on_b` relative to
/// a's position.
struct Cores
{
    double distance;
    Vec3 normal, on_a, on_b;
    double size; ///< of both and the gap between them
    double radius_a, radius_b;
};
[[gnu::always_inline]] inline Verdict gap_of(const Cores& cores, double enough, Gap<3>& gap)
{
    if (!(cores.distance > core_touch * cores.size)) return Verdict::unclear;
    gap.distance = cores.distance - cores.radius_a - cores.radius_b;
    if (!(gap.distance <= enough)) return Verdict::apart;
    gap.normal = cores.normal;
    gap.on_a = cores.on_a + cores.normal * cores.radius_a;
    gap.on_b = cores.on_b - cores.normal * cores.radius_b;
    return Verdict::touch;
}
inline double extent(const Vec3& d)
{
    return std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
}

/// A capsule, or a sphere, which has half length 0.
struct Round
{
    Vec3 axis; ///< unit; any for a sphere
    double half_length, radius;
};
/// Source: Ericson sec. 5.1.9; numerator and denominator of the lines' nearest points as cross products,
/// which lose nothing if the lines are nearly parallel.
[[gnu::always_inline]] inline Verdict round_gap(const Round& a, const Round& b, const Vec3& d, double enough,
                                                Gap<3>& gap)
{
    const Vec3 across = cross(a.axis, b.axis);
    const double square = length2(across), turn = dot(a.axis, b.axis);
    const double along_a = dot(a.axis, d), along_b = dot(b.axis, d);
    double s = square > 1e-28 ? clamped(dot(cross(d, b.axis), across) / square, a.half_length) : 0;
    const double t = clamped(turn * s - along_b, b.half_length);
    s = clamped(along_a + turn * t, a.half_length);
    const Vec3 on_a = a.axis * s, on_b = d + b.axis * t, way = on_b - on_a;
    const double distance = length(way), size = extent(d) + a.half_length + b.half_length;
    return gap_of({distance, way * (1 / distance), on_a, on_b, size, a.radius, b.radius}, enough, gap);
}

[[gnu::always_inline]] inline Verdict sphere_box_gap(double radius, const Mat3& b, const Vec3& half,
                                                     const Vec3& d, double enough, Gap<3>& gap)
{
    const Vec3 centre = b.back(Vec3{} - d);
    const Vec3 nearest{clamped(centre.x, half.x), clamped(centre.y, half.y), clamped(centre.z, half.z)};
    const Vec3 way = nearest - centre;
    const double distance = length(way);
    return gap_of(
        {distance, b * (way * (1 / distance)), {}, d + b * nearest, extent(d) + extent(half), radius, 0},
        enough, gap);
}

/// The gap of an arranged pair of spheres, capsules and boxes, but not of two spheres; of two boxes it is
/// unclear. `turn_a` and `turn_b` give the rotations, if they are needed.
template <class TurnA, class TurnB>
[[gnu::always_inline]] inline Verdict simple_gap(const Shape<3>& a, const Shape<3>& b, const Vec3& d,
                                                 const TurnA& turn_a, const TurnB& turn_b, double enough,
                                                 Gap<3>& gap)
{
    const Vec3 half_a = load(ShapeAccess::size(a)), half_b = load(ShapeAccess::size(b));
    const double radius_a = ShapeAccess::radius(a), radius_b = ShapeAccess::radius(b);
    if (b.type() == ShapeTypes::capsule) {
        const Vec3 axis_a = a.type() == ShapeTypes::capsule ? turn_a().y : Vec3{0, 1, 0};
        return round_gap({axis_a, half_a.y, radius_a}, {turn_b().y, half_b.y, radius_b}, d, enough, gap);
    }
    if (a.type() == ShapeTypes::sphere) return sphere_box_gap(radius_a, turn_b(), half_b, d, enough, gap);
    if (a.type() != ShapeTypes::capsule) return Verdict::unclear;
    const CapsuleBoxGap cores = capsule_box_gap(turn_a().y, half_a.y, turn_b(), half_b, d);
    return gap_of({cores.distance, cores.normal, cores.on_a, cores.on_b, 0, radius_a, 0}, enough, gap);
}

} // namespace narrow
JOSTLE_NAMESPACE_END
