// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>

#include "jostle/vec.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Where an object is: world = rotate(local) + position.
///
/// Valid    positions within 1e60, finite rotations other than zero. Rotations are normalised when they are
///          read, so a rotation that has drifted from length 1 is valid and doesn't scale the shape.
/// Members  functions of a pose normalise its rotation too, and return poses with rotations of length 1. A
///          rotation that is zero, or whose squares are beyond T's range, gives NaN.
template <int Dim, Coordinate T>
struct Pose;

template <Coordinate T>
struct Pose<3, T>
{
    Vec<3, T> position = {};
    std::array<T, 4> rotation = {0, 0, 0, 1}; ///< a quaternion: x, y, z, w

    /// A pose turned by `angle` radians about an axis of any length, counterclockwise seen from its tip. A
    /// zero axis gives no rotation.
    [[nodiscard]] static Pose turned(const Vec<3, T>& axis, T angle, const Vec<3, T>& position = {})
    {
        const Vec<3, T> half = normalized(axis) * std::sin(angle / 2);
        return {position, {half[0], half[1], half[2], std::cos(angle / 2)}};
    }

    /// Rotates a local vector into world axes.
    [[nodiscard]] constexpr Vec<3, T> rotate(const Vec<3, T>& local) const noexcept
    {
        const auto& [x, y, z, w] = rotation;
        const Vec<3, T> axis{x, y, z}, across = cross(axis, local);
        return local + (across * w + cross(axis, across)) * (2 / (dot(axis, axis) + w * w));
    }
    /// Transforms a local point to world coordinates.
    [[nodiscard]] constexpr Vec<3, T> transform(const Vec<3, T>& local) const noexcept
    {
        return rotate(local) + position;
    }
    /// The inverse pose: its transform() gives the local point for one in world coordinates.
    [[nodiscard]] Pose inverse() const noexcept
    {
        const auto [x, y, z, w] = unit(rotation);
        const Pose back{{}, {-x, -y, -z, w}};
        return {-back.rotate(position), back.rotation};
    }
    /// First b, then a: (a * b).transform(p) is a.transform(b.transform(p)), except for rounding.
    [[nodiscard]] friend Pose operator*(const Pose& a, const Pose& b) noexcept
    {
        const auto [x, y, z, w] = unit(a.rotation);
        const auto [u, v, s, t] = unit(b.rotation);
        const Vec<3, T> axis_a{x, y, z}, axis_b{u, v, s};
        const Vec<3, T> axis = axis_b * w + axis_a * t + cross(axis_a, axis_b);
        return {a.transform(b.position), unit({axis[0], axis[1], axis[2], w * t - dot(axis_a, axis_b)})};
    }
    /// The pose after `time`: moved by linear * time, and turned by the angle |angular| * time about the
    /// world axis `angular` through the position, exactly, however large the angle. A Motion follows the same
    /// path.
    [[nodiscard]] Pose integrate(const Vec<3, T>& linear, const Vec<3, T>& angular, T time) const noexcept
    {
        const Pose turn = turned(angular, length(angular) * time);
        return {position + linear * time, (turn * Pose{{}, rotation}).rotation};
    }

  private:
    static std::array<T, 4> unit(const std::array<T, 4>& q) noexcept
    {
        const T size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        return {q[0] / size, q[1] / size, q[2] / size, q[3] / size};
    }
};
template <Coordinate T>
struct Pose<2, T>
{
    Vec<2, T> position = {};
    std::array<T, 2> rotation = {1, 0}; ///< cosine and sine of the angle, counterclockwise

    /// A pose turned by `angle` radians, counterclockwise.
    [[nodiscard]] static Pose turned(T angle, const Vec<2, T>& position = {})
    {
        return {position, {std::cos(angle), std::sin(angle)}};
    }

    [[nodiscard]] Vec<2, T> rotate(const Vec<2, T>& local) const noexcept
    {
        const auto [c, s] = unit(rotation);
        return {c * local[0] - s * local[1], s * local[0] + c * local[1]};
    }
    [[nodiscard]] Vec<2, T> transform(const Vec<2, T>& local) const noexcept
    {
        return rotate(local) + position;
    }
    [[nodiscard]] Pose inverse() const noexcept
    {
        const auto [c, s] = unit(rotation);
        const Pose back{{}, {c, -s}};
        return {-back.rotate(position), back.rotation};
    }
    [[nodiscard]] friend Pose operator*(const Pose& a, const Pose& b) noexcept
    {
        const Vec<2, T> both = a.rotate({b.rotation[0], b.rotation[1]});
        return {a.transform(b.position), unit({both[0], both[1]})};
    }
    /// `angular` is in radians for a time of 1.
    [[nodiscard]] Pose integrate(const Vec<2, T>& linear, T angular, T time) const noexcept
    {
        return {position + linear * time, (turned(angular * time) * Pose{{}, rotation}).rotation};
    }

  private:
    static std::array<T, 2> unit(const std::array<T, 2>& r) noexcept
    {
        const T size = std::sqrt(r[0] * r[0] + r[1] * r[1]);
        return {r[0] / size, r[1] / size};
    }
};

using Pose2f = Pose<2, float>;
using Pose3f = Pose<3, float>;
using Pose2d = Pose<2, double>;
using Pose3d = Pose<3, double>;

JOSTLE_NAMESPACE_END
