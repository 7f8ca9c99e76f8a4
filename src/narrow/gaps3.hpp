// SPDX-License-Identifier: MIT
// Distances of the simplest shapes in closed form. Each has its slow twin in convex3.hpp, which decides where
// they say unclear: cores that touch or nearly do have no direction in these.
#pragma once

#include "narrow/kernels.hpp"
#include "narrow/manifold.hpp"
#include "narrow/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Cores nearer than this part of their size touch, as everywhere.
inline constexpr double core_touch = 1e-9;

inline double clamped(double x, double half)
{
    return x < -half ? -half : x > half ? half : x;
}

/// From the nearest points of two cores, `on_b` seen from a's position, to the gap of what has those radii.
inline Verdict gap_of_cores(const Vec3& on_a, const Vec3& on_b, double size, double radius_a, double radius_b,
                            double enough, Gap<3>& gap)
{
    const Vec3 way = on_b - on_a;
    const double distance = length(way);
    if (!(distance > core_touch * size)) return Verdict::unclear;
    gap.distance = distance - radius_a - radius_b;
    if (!(gap.distance <= enough)) return Verdict::apart;
    gap.normal = way * (1 / distance);
    gap.on_a = on_a + gap.normal * radius_a;
    gap.on_b = on_b - gap.normal * radius_b;
    return Verdict::touch;
}

/// A capsule, or a sphere, whose half length is 0.
struct Round
{
    Vec3 axis; ///< unit, or zero for a sphere
    double half_length, radius;
};
/// Source: Ericson sec. 5.1.9; the numerator and denominator of the lines' nearest points as cross products,
/// which lose nothing where the lines are nearly parallel.
inline Verdict round_gap(const Round& a, const Round& b, const Vec3& d, double enough, Gap<3>& gap)
{
    const Vec3 across = cross(a.axis, b.axis);
    const double square = length2(across), turn = dot(a.axis, b.axis);
    const double along_a = dot(a.axis, d), along_b = dot(b.axis, d);
    double s = square > 1e-28 ? clamped(dot(cross(d, b.axis), across) / square, a.half_length) : 0;
    const double t = clamped(turn * s - along_b, b.half_length);
    s = clamped(along_a + turn * t, a.half_length);
    const double size = std::abs(d.x) + std::abs(d.y) + std::abs(d.z) + a.half_length + b.half_length;
    return gap_of_cores(a.axis * s, d + b.axis * t, size, a.radius, b.radius, enough, gap);
}

inline Verdict sphere_box_gap(double radius, const Mat3& b, const Vec3& half, const Vec3& d, double enough,
                              Gap<3>& gap)
{
    const Vec3 centre = b.back(-d);
    const Vec3 nearest{clamped(centre.x, half.x), clamped(centre.y, half.y), clamped(centre.z, half.z)};
    const Vec3 way = nearest - centre;
    const double distance = length(way);
    const double size = std::abs(d.x) + std::abs(d.y) + std::abs(d.z) + half.x + half.y + half.z;
    if (!(distance > core_touch * size)) return Verdict::unclear;
    gap.distance = distance - radius;
    if (!(gap.distance <= enough)) return Verdict::apart;
    gap.normal = b * (way * (1 / distance));
    gap.on_a = gap.normal * radius;
    gap.on_b = d + b * nearest;
    return Verdict::touch;
}

/// The gap of an arranged pair of spheres, capsules and boxes; of two boxes it is always unclear. `turn_a`
/// and `turn_b` give the rotations, if they are needed.
template <class TurnA, class TurnB>
Verdict simple_gap(const Shape<3>& a, const Shape<3>& b, const Vec3& d, const TurnA& turn_a,
                   const TurnB& turn_b, double enough, Gap<3>& gap)
{
    const Vec3 half_a = load(ShapeAccess::size(a)), half_b = load(ShapeAccess::size(b));
    const double radius_a = ShapeAccess::radius(a), radius_b = ShapeAccess::radius(b);
    if (b.type() == ShapeTypes::sphere) return gap_of_cores({}, d, 0, radius_a, radius_b, enough, gap);
    if (b.type() == ShapeTypes::capsule) {
        const Vec3 axis_a = a.type() == ShapeTypes::capsule ? turn_a().y : Vec3{};
        return round_gap({axis_a, half_a.y, radius_a}, {turn_b().y, half_b.y, radius_b}, d, enough, gap);
    }
    if (a.type() == ShapeTypes::sphere) return sphere_box_gap(radius_a, turn_b(), half_b, d, enough, gap);
    if (a.type() != ShapeTypes::capsule) return Verdict::unclear;
    const CapsuleBoxGap cores = capsule_box_gap(turn_a().y, half_a.y, turn_b(), half_b, d);
    if (!(cores.distance > 0)) return Verdict::unclear;
    gap.distance = cores.distance - radius_a;
    if (!(gap.distance <= enough)) return Verdict::apart;
    gap.normal = cores.normal;
    gap.on_a = cores.on_a + cores.normal * radius_a;
    gap.on_b = cores.on_b;
    return Verdict::touch;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
