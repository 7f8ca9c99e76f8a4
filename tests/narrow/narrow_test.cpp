// SPDX-License-Identifier: MIT
#include "jostle/contact.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>
#include <vector>

using namespace jostle;

namespace {

// A shape of a temporary would point to what is gone.
template <class ShapeOf, class Pointed, class... More>
constexpr bool only_of_named = std::is_constructible_v<ShapeOf, const Pointed&, More...> &&
                               !std::is_constructible_v<ShapeOf, Pointed, More...> &&
                               !std::is_constructible_v<ShapeOf, const Pointed, More...>;
static_assert(only_of_named<Shape3, ConvexHull<3>> && only_of_named<Shape2, ConvexHull<2>>);
static_assert(only_of_named<Shape3, Mesh<3>> && only_of_named<Shape2, Mesh<2>>);
static_assert(only_of_named<Shape3, Compound<3>> && only_of_named<Shape2, Compound<2>>);
static_assert(only_of_named<Shape3, HeightField>);
template <int Dim>
struct Point final : CustomShape<Dim>
{
    [[nodiscard]] double radius() const noexcept override { return 0; }
};
static_assert(only_of_named<Shape3, Point<3>, ShapeType> && only_of_named<Shape2, Point<2>, ShapeType>);

Contact<3, double> only(const Shape3& a, const Pose3d& pose_a, const Shape3& b, const Pose3d& pose_b,
                        double margin = 0)
{
    const Shape3 shapes[] = {a, b};
    const Pose3d poses[] = {pose_a, pose_b};
    const Pair pairs[] = {{0, 1}};
    ContactFinder3d finder;
    const auto& found =
        finder.find({StridedView<Shape3>(shapes, 2), StridedView<Pose3d>(poses, 2)}, pairs, margin);
    EXPECT_EQ(found.size(), 1u);
    return found.empty() ? Contact<3, double>{} : *found.begin();
}

TEST(Hull, OfAnArray)
{
    const std::array<Vec<3, double>, 4> points{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    EXPECT_EQ(ConvexHull<3>(points).face_count(), 4u);
    const std::array<Vec<2, float>, 3> corners{{{0, 0}, {1, 0}, {0, 1}}};
    EXPECT_EQ(ConvexHull<2>(corners).face_count(), 3u);
}

TEST(Manifold, TwoSpheres)
{
    const auto c = only(Shape3::sphere(1), {{0, 0, 0}}, Shape3::sphere(2), {{0, 2.5, 0}});
    EXPECT_EQ(c.count, 1u);
    EXPECT_DOUBLE_EQ(c.normal[1], 1);
    EXPECT_DOUBLE_EQ(c.point[0].depth, 0.5);
    EXPECT_DOUBLE_EQ(c.point[0].from_a[1], 0.75);
    EXPECT_DOUBLE_EQ(c.point[0].from_b[1], -1.75);
}

TEST(Manifold, BoxLiesOnBox)
{
    const auto c = only(Shape3::box({2, 1, 2}), {{0, 0, 0}}, Shape3::box({1, 1, 1}), {{0.5, 1.9, 0}});
    EXPECT_EQ(c.count, 4u);
    EXPECT_DOUBLE_EQ(c.normal[1], 1);
    for (std::uint32_t i = 0; i < c.count; ++i) {
        EXPECT_NEAR(c.point[i].depth, 0.1, 1e-12);
        EXPECT_NEAR(c.point[i].from_a[1], 0.95, 1e-12);
        EXPECT_NEAR(std::abs(c.point[i].from_b[0]), 1, 1e-12);
        EXPECT_NEAR(std::abs(c.point[i].from_b[2]), 1, 1e-12);
    }
}

TEST(Manifold, BoxOnHalfSpace)
{
    const auto c =
        only(Shape3::half_space({0, 2, 0}, -1), {{5, 0, 0}}, Shape3::box({1, 1, 1}), {{0, -0.25, 0}});
    EXPECT_EQ(c.count, 4u);
    EXPECT_DOUBLE_EQ(c.normal[1], 1);
    EXPECT_NEAR(c.point[0].depth, 0.25, 1e-12);
    EXPECT_NEAR(c.point[0].from_b[1], -0.875, 1e-12);
}

/// At depth 0, where rounding decides which corners overlap.
TEST(Manifold, WhatLiesFlatHasAllItsCorners)
{
    const Shape3 ground[] = {Shape3::half_space({0, 1, 0}, 0), Shape3::box({10, 1, 10})};
    for (int sides = 5; sides < 40; ++sides) {
        std::vector<Vec<3, double>> corners;
        for (int k = 0; k < sides; ++k)
            for (const double z : {-0.5, 0.5}) {
                const double angle = 2 * 3.14159265358979 * (k + 0.5) / sides - 3.14159265358979 / 2;
                corners.push_back({std::cos(angle), std::sin(angle), z});
            }
        const ConvexHull<3> prism(corners);
        for (const double turn : {0.0, 0.1, 0.3, 1.0})
            for (const Shape3& below : ground) {
                Pose3d lying, level;
                lying.position = {0.3, std::cos(3.14159265358979 / sides), 0.1};
                lying.rotation = {0, std::sin(turn), 0, std::cos(turn)};
                if (below.type() == ShapeTypes::box) level.position = {0, -1, 0};
                // Just in, so that they touch for certain, whatever is rounded.
                lying.position[1] -= 1e-15;
                EXPECT_EQ(only(below, level, prism, lying).count, 4u)
                    << sides << " sides, turned by " << turn << ", type " << below.type();
                const double thick = 1.0 / sides;
                lying.position[1] = thick - 1e-15;
                EXPECT_EQ(only(below, level, Shape3::box({0.7, thick, 0.3}), lying).count, 4u)
                    << "a box, " << thick << " thick, turned by " << turn << ", type " << below.type();
            }
    }
}

/// Shapes without breadth, whose corners lie in one place.
TEST(Manifold, HasNoPointTwice)
{
    const std::vector<Vec<3, double>> corners = {{-1, 0, -1}, {1, 0, -1}, {0, 0, 1}, {0, 1, 0}};
    const ConvexHull<3> hull(corners);
    const Shape3 shapes[] = {Shape3::box({0, 0, 0}),           Shape3::box({1, 0, 0}),
                             Shape3::box({0, 1, 0}),           Shape3::box({1, 0, 1}),
                             Shape3::box({1, 1, 1}),           Shape3::capsule(0, 0.5),
                             Shape3::half_space({0, 1, 0}, 0), Shape3(hull)};
    for (const Shape3& a : shapes)
        for (const Shape3& b : shapes)
            for (const double along : {0.0, 0.5, 1.0})
                for (const double up : {0.0, 0.5, 1.0})
                    for (const double turned : {0.0, 1.0}) {
                        const Pose3d pose{{along, up, 0}, {0, turned, 0, 1}};
                        for (const auto& c : contacts(a, Pose3d{}, b, pose, 0.01))
                            for (std::uint32_t i = 0; i < c.count; ++i)
                                for (std::uint32_t k = 0; k < i; ++k)
                                    ASSERT_NE(c.point[i].from_a, c.point[k].from_a)
                                        << a.type() << " and " << b.type();
                    }
    EXPECT_EQ(only(Shape3::box({1, 0, 0}), {}, Shape3::box({1, 0, 0}), {{0.5, 0, 0}}).count, 2u);
    EXPECT_EQ(only(Shape3::box({0, 0, 0}), {}, Shape3::box({0, 0, 0}), {}).count, 1u);
}

TEST(Manifold, BoxesMeetOverAnAreaHoweverTheyAreTurned)
{
    // Faces look at each other but for 3 degrees: the axis of least depth is often that of two edges.
    std::uint64_t state = 1;
    const auto uniform = [&](double lo, double hi) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return lo + (hi - lo) * static_cast<double>(state >> 11) * 0x1p-53;
    };
    for (int trial = 0; trial < 500; ++trial) {
        const double yaw = uniform(-3, 3), tilt = uniform(0, 0.05), way = uniform(-3, 3);
        Pose3d upper{{uniform(-0.1, 0.1), uniform(0.6, 0.9), uniform(-0.1, 0.1)}};
        // First about y by yaw, then by tilt about an axis in the plane.
        const double s = std::sin(tilt / 2), c = std::cos(tilt / 2), sy = std::sin(yaw / 2),
                     cy = std::cos(yaw / 2), x = s * std::cos(way), z = s * std::sin(way);
        upper.rotation = {x * cy - z * sy, c * sy, x * sy + z * cy, c * cy};
        const auto found =
            only(Shape3::box({0.5, 0.5, 0.5}), {{0, 0, 0}}, Shape3::box({0.6, 0.5, 0.55}), upper);
        EXPECT_EQ(found.count, 4u) << trial;
        EXPECT_GT(found.normal[1], 0.99) << trial;
    }
}

TEST(Manifold, SphereInBox)
{
    const auto c = only(Shape3::box({1, 1, 1}), {}, Shape3::sphere(0.25), {{0.9, 0, 0}});
    EXPECT_EQ(c.count, 1u);
    EXPECT_NEAR(c.normal[0], 1, 1e-12);
    EXPECT_NEAR(c.point[0].depth, 0.35, 1e-12);
}

} // namespace
