// SPDX-License-Identifier: MIT
// From what the user gives to arranged pairs and back.
#pragma once

#include <limits>

#include "narrow/motion.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

template <int Dim, class T>
Distance<Dim, T> distance_of(Placed<Dim> pair, T max_distance)
{
    const bool swapped = arrange(pair);
    Gap<Dim> gap;
    find_gap(pair, double{max_distance}, gap);
    Distance<Dim, T> answer{};
    answer.distance = static_cast<T>(gap.distance);
    if (gap.distance == HUGE_VAL) return answer;
    store(swapped ? -gap.normal : gap.normal, answer.normal);
    store(swapped ? gap.on_b - pair.d : gap.on_a, answer.point_a);
    store(swapped ? gap.on_a : gap.on_b - pair.d, answer.point_b);
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
