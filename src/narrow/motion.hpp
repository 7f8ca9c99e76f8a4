// SPDX-License-Identifier: MIT
#pragma once

#include "narrow/math.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Sine and cosine from sums and products alone: the C library's differ from system to system.
inline void sine_cosine(double angle, double& s, double& c)
{
    constexpr double turn = 6.283185307179586;
    double x = angle - std::floor(angle * (1 / turn) + 0.5) * turn;
    x *= 0.125; // at most 0.4: the series below are exact to the last bits
    const double x2 = x * x;
    s = x * (1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72 * (1 - x2 / 110 * (1 - x2 / 156))))));
    c = 1 - x2 / 2 * (1 - x2 / 12 * (1 - x2 / 30 * (1 - x2 / 56 * (1 - x2 / 90 * (1 - x2 / 132)))));
    for (int i = 0; i < 3; ++i) {
        const double s2 = 2 * s * c;
        c = c * c - s * s;
        s = s2;
    }
}

/// A turn that goes on: rotation from the start by `angular` (radians times axis).
inline Mat3 turned(const Mat3& start, const Vec3& angular)
{
    const double angle = length(angular);
    if (!(angle > 0)) return start;
    double s, c;
    sine_cosine(0.5 * angle, s, c);
    const Vec3 axis = angular * (s / angle);
    return rotation(axis.x, axis.y, axis.z, c) * start;
}
inline Mat2 turned(const Mat2& start, double angle)
{
    double s, c;
    sine_cosine(angle, s, c);
    return rotation(c, s) * start;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
