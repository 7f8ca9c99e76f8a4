// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <optional>

#include "jostle/contact.hpp"

/// Moving shapes at moments of their motion.
namespace moments {

using namespace jostle;

/// The pose at a time, by the definition.
template <class T>
Pose3d at(const Motion<3, T>& motion, double t)
{
    Pose3d pose;
    double angle = 0;
    for (std::size_t d = 0; d < 3; ++d) {
        pose.position[d] = double{motion.pose.position[d]} + t * double{motion.linear[d]};
        angle += double{motion.angular[d]} * double{motion.angular[d]};
    }
    angle = std::sqrt(angle) * t;
    double q[4];
    for (std::size_t d = 0; d < 4; ++d)
        q[d] = double{motion.pose.rotation[d]};
    if (angle == 0) {
        pose.rotation = {q[0], q[1], q[2], q[3]};
        return pose;
    }
    const double s = std::sin(angle / 2) * t / angle, c = std::cos(angle / 2);
    const double x = double{motion.angular[0]} * s, y = double{motion.angular[1]} * s,
                 z = double{motion.angular[2]} * s;
    pose.rotation = {c * q[0] + x * q[3] + y * q[2] - z * q[1], c * q[1] - x * q[2] + y * q[3] + z * q[0],
                     c * q[2] + x * q[1] - y * q[0] + z * q[3], c * q[3] - x * q[0] - y * q[1] - z * q[2]};
    return pose;
}
template <class T>
Pose2d at(const Motion<2, T>& motion, double t)
{
    const double angle = double{motion.angular[0]} * t, c = std::cos(angle), s = std::sin(angle);
    const double x = double{motion.pose.rotation[0]}, y = double{motion.pose.rotation[1]};
    Pose2d pose{{}, {c * x - s * y, s * x + c * y}};
    for (std::size_t d = 0; d < 2; ++d)
        pose.position[d] = double{motion.pose.position[d]} + t * double{motion.linear[d]};
    return pose;
}

template <int Dim, class T>
double gap_at(const Shape<Dim>& a, const Motion<Dim, T>& moving_a, const Shape<Dim>& b,
              const Motion<Dim, T>& moving_b, double t)
{
    const auto found = distance(a, at(moving_a, t), b, at(moving_b, t), INFINITY);
    return found ? found->distance : HUGE_VAL;
}

/// The first of `looks` moments at which they overlap, for certain.
template <int Dim, class T>
std::optional<double> first_overlap(const Shape<Dim>& a, const Motion<Dim, T>& moving_a, const Shape<Dim>& b,
                                    const Motion<Dim, T>& moving_b, int looks, double slack = 1e-9)
{
    for (int i = 0; i <= looks; ++i) {
        const double t = static_cast<double>(i) / looks;
        if (gap_at(a, moving_a, b, moving_b, t) < -slack) return t;
    }
    return {};
}

} // namespace moments
