// SPDX-License-Identifier: MIT
// Converts from the user's input to arranged pairs and back.
#pragma once

#include <limits>

#include "narrow/convex/gaps3.hpp"
#include "narrow/convex/simple3.hpp"
#include "narrow/parts/cast.hpp"
#include "narrow/parts/motion.hpp"
#include "narrow/parts/ray.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Converts the gap of an arranged pair to the user's; b is at d from a as arranged. Written in place:
/// numbers that are copied right after they were written stall on store forwarding.
template <int Dim, class T>
void finish(const Gap<Dim>& gap, const V<Dim>& d, bool swapped, Distance<Dim, T>& answer)
{
    answer.distance = static_cast<T>(gap.distance);
    if (gap.distance == HUGE_VAL) return;
    store(gap.normal * (swapped ? -1.0 : 1.0), answer.normal); // hard to predict, so no branch
    store(gap.on_a, swapped ? answer.from_b : answer.from_a);
    store(gap.on_b - d, swapped ? answer.from_a : answer.from_b);
}

/// Both orders of the pair give the same bits, so it needn't be arranged.
template <int Dim, class T>
Verdict sphere_distance(double radius_a, double radius_b, const V<Dim>& d, double enough,
                        Distance<Dim, T>& answer)
{
    const double between = length(d), distance = between - (radius_a + radius_b);
    if (!(between > 0)) return Verdict::unclear;
    answer.distance = static_cast<T>(distance <= enough ? distance : HUGE_VAL);
    if (!(distance <= enough)) return Verdict::apart;
    const V<Dim> n = d * (1 / between);
    store(n, answer.normal);
    store(n * radius_a, answer.from_a);
    store(n * -radius_b, answer.from_b);
    return Verdict::touch;
}

/// Spheres, capsules and boxes, if a closed form decides. Arranges the pair as `arrange` would.
template <class T>
Verdict simple_distance(const Shape<3>& given_a, const Pose<3, T>& given_pose_a, const Shape<3>& given_b,
                        const Pose<3, T>& given_pose_b, double enough, Distance<3, T>& answer)
{
    const Vec3 way = load(given_pose_b.position) - load(given_pose_a.position);
    const int type_a = given_a.type(), type_b = given_b.type();
    const double decides = way.x != 0 ? way.x : way.y != 0 ? way.y : way.z;
    if (type_a == type_b && decides == 0) return Verdict::unclear;
    const bool swapped = ((type_a == type_b) & (decides < 0)) | (type_a > type_b);
    const Vec3 d = way * (swapped ? -1.0 : 1.0) + Vec3{}; // never -0, as in from_to()
    const Shape<3>&a = swapped ? given_b : given_a, &b = swapped ? given_a : given_b;
    const Pose<3, T>&pose_a = swapped ? given_pose_b : given_pose_a,
                  &pose_b = swapped ? given_pose_a : given_pose_b;
    Gap<3> gap;
    const Verdict verdict =
        simple_gap(a, b, d, [&] { return rotation(pose_a); }, [&] { return rotation(pose_b); }, enough, gap);
    if (verdict == Verdict::apart) answer.distance = std::numeric_limits<T>::infinity();
    if (verdict == Verdict::touch) finish(gap, d, swapped, answer);
    return verdict;
}

/// Sets an answer that is all zeros.
template <int Dim, class T>
void find_distance(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                   const Pose<Dim, T>& pose_b, T max_distance, const Kernels& kernels,
                   Distance<Dim, T>& answer)
{
    if ((a.type() | b.type()) == int{ShapeTypes::sphere}) {
        const V<Dim> d = load(pose_b.position) - load(pose_a.position);
        if (sphere_distance(a.radius(), b.radius(), d, double{max_distance}, answer) != Verdict::unclear)
            return;
    }
    if constexpr (Dim == 3)
        if (is_simple(a.type()) && is_simple(b.type()) &&
            simple_distance(a, pose_a, b, pose_b, double{max_distance}, answer) != Verdict::unclear)
            return;
    Placed<Dim> pair = place(a, pose_a, b, pose_b, kernels);
    const bool swapped = arrange(pair);
    Gap<Dim> gap;
    find_gap(pair, double{max_distance}, gap);
    finish(gap, pair.d, swapped, answer);
}
template <int Dim, class T>
Distance<Dim, T> distance_of(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                             const Pose<Dim, T>& pose_b, T max_distance, const Kernels& kernels)
{
    Distance<Dim, T> answer{};
    find_distance(a, pose_a, b, pose_b, max_distance, kernels, answer);
    return answer;
}

template <int Dim, class T>
bool touching_of(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                 const Pose<Dim, T>& pose_b, const Kernels& kernels)
{
    // Two spheres need no rotations, which would take most of the time.
    if ((a.type() | b.type()) == int{ShapeTypes::sphere})
        return spheres_touch(a.radius(), b.radius(), load(pose_b.position) - load(pose_a.position));
    Placed<Dim> pair = place(a, pose_a, b, pose_b, kernels);
    arrange(pair);
    return find_touch(pair);
}

template <int Dim, class T>
CastHit<Dim, T> no_hit()
{
    CastHit<Dim, T> answer{};
    answer.fraction = std::numeric_limits<T>::infinity();
    return answer;
}

/// A checked ray.
template <int Dim, class T>
CastHit<Dim, T> ray_hit_of(const Shape<Dim>& shape, const Pose<Dim, T>& pose, const Ray<Dim, T>& ray,
                           const Kernels& kernels)
{
    // The length of the direction, in two factors: their product, or the square of one, may be infinite.
    const V<Dim> given = load(ray.direction);
    double scale = 0;
    for (int d = 0; d < Dim; ++d)
        scale = std::max(scale, std::abs(given[d]));
    V<Dim> way = given;
    for (int d = 0; d < Dim; ++d)
        way[d] = given[d] / scale;
    const double stretch = length(way);
    way = way * (1 / stretch);
    const V<Dim> origin = load(ray.origin) - load(pose.position);
    const double most = double{ray.max_fraction} * scale * stretch;
    const Strike<Dim> strike = find_strike(shape, rotation(pose), Line<Dim>{origin, way, most}, kernels);
    if (strike.at == HUGE_VAL) return no_hit<Dim, T>();
    CastHit<Dim, T> answer{};
    answer.fraction = std::min(static_cast<T>(strike.at / scale / stretch), ray.max_fraction);
    store(strike.normal, answer.normal);
    store(origin + way * strike.at, answer.point);
    answer.part = strike.part;
    return answer;
}

template <int Dim, class T>
CastHit<Dim, T> shape_hit_of(const Shape<Dim>& moving, const Pose<Dim, T>& pose,
                             const Vec<Dim, T>& displacement, const Shape<Dim>& shape,
                             const Pose<Dim, T>& shape_pose, const Kernels& kernels)
{
    const Touch<Dim> touch =
        find_first_touch(place(shape, shape_pose, moving, pose, kernels), load(displacement));
    if (touch.time == HUGE_VAL) return no_hit<Dim, T>();
    CastHit<Dim, T> answer{};
    answer.fraction = static_cast<T>(touch.time);
    if (double{answer.fraction} > touch.time) answer.fraction = std::nextafter(answer.fraction, T{0});
    store(touch.normal, answer.normal);
    store(touch.on_a, answer.point);
    answer.part = touch.part_a;
    answer.moving_part = touch.part_b;
    return answer;
}

template <class T>
Vec3 load_angular(const std::array<T, 3>& v)
{
    return {double{v[0]}, double{v[1]}, double{v[2]}};
}
template <class T>
double load_angular(const std::array<T, 1>& v)
{
    return double{v[0]};
}

template <int Dim, class T>
Impact<Dim, T> impact_of(const Shape<Dim>& a, const Motion<Dim, T>& motion_a, const Shape<Dim>& b,
                         const Motion<Dim, T>& motion_b, T tolerance)
{
    Moving<Dim> moving;
    moving.start = place(a, motion_a.pose, b, motion_b.pose);
    moving.linear = load(motion_b.linear) - load(motion_a.linear);
    moving.angular_a = load_angular(motion_a.angular);
    moving.angular_b = load_angular(motion_b.angular);
    const bool swapped = arrange(moving.start);
    if (swapped) {
        moving.linear = -moving.linear;
        std::swap(moving.angular_a, moving.angular_b);
    }
    const Hit<Dim> hit = find_impact(moving, double{tolerance});
    Impact<Dim, T> answer{};
    answer.time = static_cast<T>(hit.time);
    if (hit.time == HUGE_VAL) return answer;
    if (double{answer.time} > hit.time) answer.time = std::nextafter(answer.time, T{0}); // never later
    store(swapped ? -hit.gap.normal : hit.gap.normal, answer.normal);
    const V<Dim> middle = (hit.gap.on_a + hit.gap.on_b) * 0.5;
    store(middle, swapped ? answer.from_b : answer.from_a);
    store(middle - hit.d, swapped ? answer.from_a : answer.from_b);
    return answer;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
