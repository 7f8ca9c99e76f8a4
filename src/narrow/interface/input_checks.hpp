// SPDX-License-Identifier: MIT
// Checks of users' input, and the errors for what is invalid.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "jostle/contact.hpp"
#include "narrow/shapes/shape_data.hpp"

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
    // Almost all are valid, which two sums tell without branches.
    T sum = 0, turn = 0;
    for (const T x : pose.position)
        sum += std::abs(x);
    for (const T q : pose.rotation)
        turn += std::abs(q);
    const bool surely = (double{sum} <= longest) & (turn > 0) & (turn <= std::numeric_limits<T>::max());
    return surely || valid_by_number(pose);
}

template <class Numbers>
std::string listed(const Numbers& numbers)
{
    std::string text_of;
    for (const auto x : numbers)
        text_of += " " + text(double{x});
    return text_of;
}
template <int Dim, class T>
std::string listed(const Pose<Dim, T>& pose)
{
    return "position" + listed(pose.position) + ", rotation" + listed(pose.rotation);
}

/// "a ray" or "the ray 3"; with `of`, "a pose" or "the pose of object 3".
inline std::string named(const char* what, std::uint64_t number, const char* of = "")
{
    return number == Error::no_index ? std::string("a ") + what
                                     : std::string("the ") + what + of + " " + std::to_string(number);
}

template <int Dim, class T>
[[noreturn]] void refuse_pose(const Pose<Dim, T>& pose, std::uint64_t object)
{
    throw Error(ErrorCode::invalid_argument,
                named("pose", object, " of object") + " has " + listed(pose) +
                    "; give positions within 1e60 and finite rotations that aren't zero",
                object);
}

template <class T>
void check_length(const char* what, T value, bool zero_allowed)
{
    if (!(value >= 0) || (value == 0 && !zero_allowed) || !(double{value} <= longest))
        throw Error(ErrorCode::invalid_argument,
                    std::string("the ") + what + " is " + text(double{value}) + "; give " +
                        (zero_allowed ? "a length from 0 to 1e60" : "a length above 0, up to 1e60"));
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
/// A turning half-space would sweep everything at once.
template <int Dim, class T>
bool turns_without_end(const Shape<Dim>& shape, const Motion<Dim, T>& motion)
{
    bool turns = false;
    for (const T x : motion.angular)
        turns = turns || x != 0;
    return turns && ShapeAccess::reach(shape) == HUGE_VAL;
}
template <int Dim, class T>
[[noreturn]] void refuse_motion(const Motion<Dim, T>& motion, std::uint64_t object)
{
    throw Error(ErrorCode::invalid_argument,
                named("motion", object, " of object") + " has " + listed(motion.pose) + ", linear" +
                    listed(motion.linear) + ", angular" + listed(motion.angular) +
                    "; give positions and motions within 1e60, finite rotations that aren't zero, turns "
                    "within 1e9 radians, and for half-spaces, or compounds with one, no turn",
                object);
}

template <int Dim, class T>
void check_ray(const Ray<Dim, T>& ray, std::uint64_t number)
{
    bool good = true;
    T longest_component = 0;
    for (int d = 0; d < Dim; ++d) {
        good = good && std::abs(double{ray.origin[d]}) <= longest &&
               std::abs(ray.direction[d]) <= std::numeric_limits<T>::max();
        longest_component = std::max(longest_component, std::abs(ray.direction[d]));
    }
    good = good && T(1) / longest_component <= std::numeric_limits<T>::max() && ray.max_fraction >= 0;
    if (good) return;
    throw Error(ErrorCode::invalid_argument,
                named("ray", number) + " has origin" + listed(ray.origin) + ", direction" +
                    listed(ray.direction) + ", max_fraction " + text(double{ray.max_fraction}) +
                    "; give an origin within 1e60, a finite direction that isn't zero or too short to divide "
                    "by, and a fraction of 0 or more",
                number);
}
template <int Dim, class T>
void check_displacement(const Vec<Dim, T>& displacement, std::uint64_t number)
{
    for (const T x : displacement)
        if (!(std::abs(double{x}) <= longest))
            throw Error(ErrorCode::invalid_argument,
                        named("displacement", number, " of object") + " is" + listed(displacement) +
                            "; give numbers within 1e60",
                        number);
}

/// The poses or motions of a set.
template <int Dim, class T>
const StridedView<Pose<Dim, T>>& placed(const Objects<Dim, T>& set)
{
    return set.poses;
}
template <int Dim, class T>
const StridedView<Motion<Dim, T>>& placed(const MovingObjects<Dim, T>& set)
{
    return set.motions;
}

template <class Set>
void check_sizes(const Set& a, const Set& b)
{
    constexpr bool moves = requires { &Set::motions; };
    for (const Set* side : {&a, &b})
        if (side->shapes.size() != placed(*side).size())
            throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(side->shapes.size()) +
                                                      " shapes and " + std::to_string(placed(*side).size()) +
                                                      (moves ? " motions" : " poses") +
                                                      "; give one of each per object");
}
inline void check_out(std::size_t pairs, std::size_t out)
{
    if (pairs != out)
        throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(pairs) + " pairs and room for " +
                                                  std::to_string(out) + " answers; give one per pair");
}
[[noreturn]] inline void refuse_pair(const Pair& pair, std::uint64_t number, std::size_t objects_a,
                                     std::size_t objects_b)
{
    const std::string of_b = objects_b != objects_a ? " and " + std::to_string(objects_b) : "";
    throw Error(ErrorCode::invalid_argument,
                "pair " + std::to_string(number) + " names objects " + std::to_string(pair.a) + " and " +
                    std::to_string(pair.b) + ", but there are " + std::to_string(objects_a) + of_b +
                    ", numbered from 0",
                pair.a < objects_a ? pair.b : pair.a);
}
[[noreturn]] inline void refuse_itself(const Pair& pair, std::uint64_t number)
{
    throw Error(ErrorCode::invalid_argument,
                "pair " + std::to_string(number) + " is of object " + std::to_string(pair.a) +
                    " and itself; give pairs of two objects",
                pair.a);
}
template <int Dim, class T>
void check_object(const Shape<Dim>&, const Pose<Dim, T>& pose, std::uint64_t object)
{
    if (!valid(pose)) refuse_pose(pose, object);
}
template <int Dim, class T>
void check_object(const Shape<Dim>& shape, const Motion<Dim, T>& motion, std::uint64_t object)
{
    if (!valid(motion) || turns_without_end(shape, motion)) refuse_motion(motion, object);
}
/// One pair and the objects that it names. Objects in no pair aren't checked.
template <class Set>
void check_pair(const Set& a, const Set& b, const Pair& pair, std::uint64_t number)
{
    if (pair.a >= a.shapes.size() || pair.b >= b.shapes.size())
        refuse_pair(pair, number, a.shapes.size(), b.shapes.size());
    const auto &placed_a = placed(a)[pair.a], &placed_b = placed(b)[pair.b];
    if (pair.a == pair.b && &placed_a == &placed_b && &a.shapes[pair.a] == &b.shapes[pair.b])
        refuse_itself(pair, number);
    check_object(a.shapes[pair.a], placed_a, pair.a);
    check_object(b.shapes[pair.b], placed_b, pair.b);
}

} // namespace narrow
JOSTLE_NAMESPACE_END
