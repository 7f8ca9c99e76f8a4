// SPDX-License-Identifier: MIT
// Poses turn and move points as rotation matrices do, which are the slow twin here.
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <type_traits>

#include <gtest/gtest.h>

#include "jostle/pose.hpp"

namespace {

using namespace jostle;

template <std::size_t n>
using Matrix = std::array<std::array<double, n>, n>;

/// Rodrigues' formula.
Matrix<3> matrix(const Vec3d& axis, double angle)
{
    const double n = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    const double x = axis[0] / n, y = axis[1] / n, z = axis[2] / n, c = std::cos(angle), s = std::sin(angle);
    const double k = 1 - c;
    return {{{c + x * x * k, x * y * k - z * s, x * z * k + y * s},
             {y * x * k + z * s, c + y * y * k, y * z * k - x * s},
             {z * x * k - y * s, z * y * k + x * s, c + z * z * k}}};
}
Matrix<2> matrix(double angle)
{
    return {{{std::cos(angle), -std::sin(angle)}, {std::sin(angle), std::cos(angle)}}};
}
template <std::size_t n>
Vec<int{n}, double> operator*(const Matrix<n>& m, const Vec<int{n}, double>& v)
{
    Vec<int{n}, double> out{};
    for (std::size_t row = 0; row < n; ++row)
        for (std::size_t column = 0; column < n; ++column)
            out[row] += m[row][column] * v[column];
    return out;
}

class Numbers
{
  public:
    double number(double most) { return most * (static_cast<double>(engine_()) / 2147483648.0 - 1); }
    template <int Dim>
    Vec<Dim, double> vector()
    {
        Vec<Dim, double> v;
        for (double& value : v)
            value = number(3);
        return v;
    }

  private:
    std::mt19937 engine_{5};
};

/// Tests with two poses that turn as two matrices do, in 3D and in 2D.
template <class Check>
void with_poses(const Check& check)
{
    Numbers random;
    for (int i = 0; i < 200; ++i) {
        const Vec3d axis_a = random.vector<3>(), axis_b = random.vector<3>();
        const double a = random.number(9), b = random.number(9);
        check(Pose3d::turned(axis_a, a, random.vector<3>()), matrix(axis_a, a),
              Pose3d::turned(axis_b, b, random.vector<3>()), matrix(axis_b, b), random.vector<3>());
        check(Pose2d::turned(a, random.vector<2>()), matrix(a), Pose2d::turned(b, random.vector<2>()),
              matrix(b), random.vector<2>());
    }
}

TEST(Pose, IsAPlainAggregate)
{
    static_assert(std::is_aggregate_v<Pose3f> && std::is_trivially_copyable_v<Pose3f> &&
                  sizeof(Pose3f) == 28);
    static_assert(std::is_aggregate_v<Pose2d> && std::is_trivially_copyable_v<Pose2d> &&
                  sizeof(Pose2d) == 32);
    const Pose3f moved{.position = {1, 2, 3}};
    EXPECT_EQ(moved.transform({1, 1, 1}), Vec3f(2, 3, 4));
    static_assert(Pose3d{{1, 0, 0}, {0, 1, 0, 0}}.transform({1, 2, 3}) == Vec3d(0, 2, -3));
}

TEST(Pose, MovesPointsAsMatricesDo)
{
    with_poses([](const auto& pose, const auto& turn, const auto&, const auto&, const auto& p) {
        ASSERT_LT(length(pose.rotate(p) - turn * p), 1e-14);
        ASSERT_EQ(pose.transform(p), pose.rotate(p) + pose.position);
    });
}

TEST(Pose, IsUndoneByItsInverse)
{
    with_poses([](const auto& pose, const auto&, const auto&, const auto&, const auto& p) {
        ASSERT_LT(length(pose.inverse().transform(pose.transform(p)) - p), 1e-14);
        ASSERT_LT(length(pose.transform(pose.inverse().transform(p)) - p), 1e-14);
    });
}

TEST(Pose, TakesTheSecondFactorFirst)
{
    with_poses([](const auto& a, const auto& turn_a, const auto& b, const auto& turn_b, const auto& p) {
        ASSERT_LT(length((a * b).transform(p) - (turn_a * (turn_b * p + b.position) + a.position)), 2e-14);
    });
}

TEST(Pose, OfRotationsOfAnyLengthIsThatOfLengthOne)
{
    with_poses([](auto a, const auto&, auto b, const auto&, const auto& p) {
        const auto right = (a * b).transform(p), back = a.inverse().transform(p);
        for (double& x : a.rotation)
            x *= 1e-50;
        for (double& x : b.rotation)
            x *= 3e20;
        ASSERT_LT(length((a * b).transform(p) - right), 2e-14);
        ASSERT_LT(length(a.inverse().transform(p) - back), 2e-14);
        double squares = 0;
        for (const double x : (a * b * b).inverse().rotation)
            squares += x * x;
        ASSERT_NEAR(squares, 1, 1e-15);
    });
}

TEST(Pose, IntegratesMotionsOfAnyLength)
{
    Numbers random;
    for (int i = 0; i < 200; ++i) {
        const Vec3d linear = random.vector<3>(), angular = random.vector<3>(), p = random.vector<3>();
        const Pose3d start = Pose3d::turned(random.vector<3>(), random.number(9), random.vector<3>());
        const double time = random.number(5);
        const Vec3d expected =
            start.position + linear * time + matrix(angular, length(angular) * time) * start.rotate(p);
        ASSERT_LT(length(start.integrate(linear, angular, time).transform(p) - expected), 1e-13);

        const Vec2d linear2 = random.vector<2>(), p2 = random.vector<2>();
        const double angular2 = random.number(3);
        const Pose2d start2 = Pose2d::turned(random.number(9), random.vector<2>());
        const Vec2d expected2 =
            start2.position + linear2 * time + matrix(angular2 * time) * start2.rotate(p2);
        ASSERT_LT(length(start2.integrate(linear2, angular2, time).transform(p2) - expected2), 1e-13);
    }
    const Pose3f still{{1, 2, 3}, {0, 0, 0, 1}};
    EXPECT_EQ(still.integrate({1, 0, 0}, {}, 2).position, Vec3f(3, 2, 3));
    EXPECT_EQ(still.integrate({1, 0, 0}, {}, 2).rotation, still.rotation);
}

TEST(Pose, TurnsNothingAboutAnAxisOfZero)
{
    EXPECT_EQ(Pose3d::turned({}, 2).rotate({1, 2, 3}), Vec3d(1, 2, 3));
}

TEST(Pose, WithARotationOfZeroGivesNaN)
{
    const Pose3d zero{{}, {0, 0, 0, 0}};
    const Pose2f zero2{{}, {0, 0}};
    EXPECT_TRUE(std::isnan(zero.rotate({1, 2, 3})[0]) && std::isnan(zero2.rotate({1, 2})[1]));
    EXPECT_TRUE(std::isnan((zero * Pose3d{}).rotation[3]) && std::isnan(zero2.inverse().rotation[0]));
}

} // namespace
