// SPDX-License-Identifier: MIT
// From what the user gives to arranged pairs and back.
#pragma once

#include <limits>
#include <string>

#include "narrow/pair.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

template <int Dim, class T>
bool valid_by_number(const Pose<Dim, T>& pose)
{
    bool good = true, turned = false;
    for (const T x : pose.position)
        good = good && std::abs(double{x}) <= longest;
    for (const T q : pose.rotation) {
        good = good && std::abs(q) <= std::numeric_limits<T>::max();
        turned = turned || q != 0;
    }
    return good && turned;
}
template <int Dim, class T>
inline bool valid(const Pose<Dim, T>& pose)
{
    // Almost all are, by two sums without branches.
    T sum = 0, turn = 0;
    for (const T x : pose.position)
        sum += std::abs(x);
    for (const T q : pose.rotation)
        turn += std::abs(q);
    const bool surely = (double{sum} <= longest) & (turn > 0) & (turn <= std::numeric_limits<T>::max());
    return surely || valid_by_number(pose);
}

template <int Dim, class T>
[[noreturn]] void refuse_pose(const Pose<Dim, T>& pose, std::uint64_t object)
{
    std::string numbers = "position";
    for (const T x : pose.position)
        numbers += " " + text(double{x});
    numbers += ", rotation";
    for (const T q : pose.rotation)
        numbers += " " + text(double{q});
    const std::string name =
        object == Error::no_index ? "a pose" : "the pose of object " + std::to_string(object);
    throw Error(ErrorCode::invalid_argument,
                name + " has " + numbers +
                    "; give positions within 1e60 and finite rotations that aren't zero",
                object);
}

template <class T>
void check_length(const char* what, T value, bool zero_allowed)
{
    if (!(value >= 0) || (value == 0 && !zero_allowed) || !(double{value} <= longest))
        throw Error(ErrorCode::invalid_argument,
                    std::string("the ") + what + " is " + text(double{value}) + "; give " +
                        (zero_allowed ? "a length from 0 to 1e60" : "a length above 0"));
}

template <class T>
void check_max_distance(T max_distance)
{
    if (!(max_distance >= 0))
        throw Error(ErrorCode::invalid_argument, "the greatest distance is " + text(double{max_distance}) +
                                                     "; give a length of 0 or more, or infinity");
}

template <int Dim, class T>
bool valid(const Motion<Dim, T>& motion)
{
    bool good = valid(motion.pose);
    for (const T x : motion.linear)
        good = good && std::abs(double{x}) <= longest;
    for (const T x : motion.angular)
        good = good && std::abs(double{x}) <= 1e9;
    return good;
}
/// A half-space that turns would sweep everything at once.
template <int Dim, class T>
bool turns_without_end(const Shape<Dim>& shape, const Motion<Dim, T>& motion)
{
    bool turns = false;
    for (const T x : motion.angular)
        turns = turns || x != 0;
    return turns && ShapeAccess::reach(shape) == HUGE_VAL;
}
template <int Dim, class T>
[[noreturn]] void refuse_motion(std::uint64_t object)
{
    const std::string name =
        object == Error::no_index ? "a motion" : "the motion of object " + std::to_string(object);
    throw Error(
        ErrorCode::invalid_argument,
        name + " is not one: give a pose with positions within 1e60, a motion within 1e60, a turn within "
               "1e9 radians, and for half-spaces, or compounds with one, no turn",
        object);
}

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
    return load(v);
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
