// SPDX-License-Identifier: MIT
// Boxes of shapes.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

TEST(Bounds, OfContainers)
{
    const std::vector<Shape3> shapes = {Shape3::sphere(1), Shape3::box({1, 2, 3})};
    const std::array<Pose3f, 2> poses = {Pose3f{{5, 0, 0}}, Pose3f{}};
    std::vector<Aabb3f> boxes(2);
    bounds({shapes, poses}, boxes, 0.5);
    for (std::size_t i = 0; i < 2; ++i) {
        const Aabb3f one = bounds(shapes[i], poses[i], 0.5f);
        for (std::size_t d = 0; d < 3; ++d) {
            EXPECT_EQ(boxes[i].lo[d], one.lo[d]);
            EXPECT_EQ(boxes[i].hi[d], one.hi[d]);
        }
    }
    EXPECT_THROW(bounds({shapes, poses}, boxes, -0.5), Error);
    boxes.resize(3);
    EXPECT_THROW(bounds({shapes, poses}, boxes), Error);
}

TEST(Bounds, AnInvalidPoseIsNamed)
{
    Random random(12);
    const Zoo<3> zoo(random, 1);
    const Zoo<2> zoo2(random, 1);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinite = HUGE_VAL;
    for (const double bad : {nan, infinite, 0.0}) {
        for (const Shape3& shape : zoo.shapes) {
            EXPECT_THROW((void)bounds(shape, Pose3d{{1, 2, 3}, {bad, 0, 0, bad}}), Error) << shape.type();
            if (bad != 0) {
                EXPECT_THROW((void)bounds(shape, Pose3d{{1, bad, 3}}), Error) << shape.type();
            }
        }
        for (const Shape2& shape : zoo2.shapes)
            EXPECT_THROW((void)bounds(shape, Pose2d{{1, 2}, {bad, bad}}), Error) << shape.type();
    }
    EXPECT_NO_THROW((void)bounds(zoo.shapes[0], Pose3d{{1, 2, 3}, {0, 0, 0, 9}}));

    // Of many, the lowest, whatever thread comes by it first.
    const std::vector<Shape3> shapes(5'000, Shape3::sphere(1));
    std::vector<Pose3d> poses(5'000);
    poses[4'000].rotation = poses[1'500].rotation = {0, 0, 0, 0};
    std::vector<Aabb3d> boxes(5'000);
    for (Executor* const executor : {&serial_executor(), &default_executor(2)})
        try {
            bounds({shapes, poses}, boxes, 0, *executor);
            FAIL() << "no error";
        } catch (const Error& error) {
            EXPECT_EQ(error.index(), 1'500u);
            EXPECT_NE(std::string(error.what())
                          .find("the pose of object 1500 has position 0 0 0, rotation 0 0 0 0"),
                      std::string::npos)
                << error.what();
        }
}

TEST(Bounds, OfAHalfSpaceEndAtAPlaneAcrossAnAxis)
{
    const Aabb3d level = bounds(Shape3::half_space({0, 2, 0}, 3), Pose3d{{0, 1, 0}});
    EXPECT_NEAR(level.hi[1], 4, 1e-12);
    EXPECT_GE(level.hi[1], 4);
    EXPECT_EQ(level.lo[1], -HUGE_VAL);
    EXPECT_EQ(level.hi[0], HUGE_VAL);
    EXPECT_EQ(bounds(Shape3::half_space({0, 1, 0.1}, 3), Pose3d{}).hi[1], HUGE_VAL);
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const double sign : {1.0, -1.0})
            for (const double offset : {3.0, -3.0}) {
                Vec<3, double> normal{};
                normal[axis] = 2 * sign;
                const Aabb3d box = bounds(Shape3::half_space(normal, offset), Pose3d{{5, 6, 7}});
                for (std::size_t d = 0; d < 3; ++d) {
                    const double plane = 5.0 + static_cast<double>(d) + sign * offset;
                    if (d == axis && sign > 0) {
                        EXPECT_NEAR(box.hi[d], plane, 1e-12);
                        EXPECT_GE(box.hi[d], plane);
                    } else {
                        EXPECT_EQ(box.hi[d], HUGE_VAL);
                    }
                    if (d == axis && sign < 0) {
                        EXPECT_NEAR(box.lo[d], plane, 1e-12);
                        EXPECT_LE(box.lo[d], plane);
                    } else {
                        EXPECT_EQ(box.lo[d], -HUGE_VAL);
                    }
                }
                if (axis > 1) continue;
                const Aabb2d flat =
                    bounds(Shape2::half_space({normal[0], normal[1]}, offset), Pose2d{{5, 6}});
                for (std::size_t d = 0; d < 2; ++d) {
                    const double plane = 5.0 + static_cast<double>(d) + sign * offset;
                    EXPECT_NEAR(d == axis && sign > 0 ? flat.hi[d] : plane, plane, 1e-12);
                    EXPECT_NEAR(d == axis && sign < 0 ? flat.lo[d] : plane, plane, 1e-12);
                    EXPECT_EQ(flat.hi[d] == HUGE_VAL, d != axis || sign < 0);
                    EXPECT_EQ(flat.lo[d] == -HUGE_VAL, d != axis || sign > 0);
                }
            }
}

TEST(Bounds, OfACompoundWithAHalfSpaceHoldTheOthers)
{
    using Child = Compound<3>::Child;
    const Child ball{Shape3::sphere(1), Pose3d{{0, 10, 0}}}, ground{Shape3::half_space({0, 1, 0}, 0), {}};
    const Child deep{Shape3::box({1, 1, 1}), Pose3d{{0, -10, 0}}};
    for (const std::vector<Child>& children :
         {std::vector{ball, ground, deep}, std::vector{ground, deep, ball},
          std::vector{ball, deep, ground}}) {
        const Compound<3> compound{std::span<const Child>(children)};
        const Aabb3d box = bounds(Shape3(compound), Pose3d{{0, 5, 0}});
        EXPECT_GE(box.hi[1], 16);
        EXPECT_LE(box.hi[1], 16 + 1e-12);
        EXPECT_EQ(box.lo[1], -HUGE_VAL);
        EXPECT_EQ(box.hi[0], HUGE_VAL);
    }
}

TEST(Bounds, AreTightAndHoldEveryPoint)
{
    Random random(8);
    const Zoo<3> zoo(random, 3);
    for (const Shape3& shape : zoo.shapes) {
        if (shape.type() == ShapeTypes::half_space) continue;
        for (int round = 0; round < 20; ++round) {
            const Pose3f pose = random.pose<float>(3);
            const Aabb3f box = bounds(shape, pose);
            for (std::size_t d = 0; d < 3; ++d)
                for (const bool upper : {false, true}) {
                    // The half-space that begins at the box's side touches the shape, one a bit further
                    // doesn't.
                    Vec<3, double> normal{};
                    normal[d] = upper ? -1 : 1;
                    const double side = double{upper ? box.hi[d] : box.lo[d]};
                    Pose3d exact;
                    for (std::size_t k = 0; k < 3; ++k)
                        exact.position[k] = double{pose.position[k]};
                    for (std::size_t k = 0; k < 4; ++k)
                        exact.rotation[k] = double{pose.rotation[k]};
                    const auto gap =
                        distance(Shape3::half_space(normal, normal[d] * side), Pose3d{}, shape, exact, 1e300);
                    ASSERT_TRUE(gap);
                    ASSERT_GE(gap->distance, 0);
                    if (shape.type() == ShapeTypes::height_field) continue; // its box holds the ground, too
                    ASSERT_LE(gap->distance, 2e-6);
                }
        }
    }
}

TEST(Bounds, OfAMeshLeaveOutVerticesThatNoElementHas)
{
    const std::vector<Vec3f> corners{{-9, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 50, 0}, {0, 1, 2}, {0, 0, -9}};
    const Mesh3 triangle(corners, {{1, 2, 4}});
    const Aabb3f box = bounds(Shape3(triangle), Pose3f{});
    const std::vector<Vec2f> ends{{-9, 9}, {0, 0}, {1, 2}, {50, -50}};
    const Mesh2 segment(ends, {{1, 2}});
    const Aabb2f flat = bounds(Shape2(segment), Pose2f{});
    const float hi[3] = {1, 1, 2};
    for (std::size_t d = 0; d < 3; ++d) {
        EXPECT_NEAR(box.lo[d], 0, 1e-5) << d;
        EXPECT_NEAR(box.hi[d], hi[d], 1e-5) << d;
    }
    for (std::size_t d = 0; d < 2; ++d) {
        EXPECT_NEAR(flat.lo[d], 0, 1e-5) << d;
        EXPECT_NEAR(flat.hi[d], hi[d + 1], 1e-5) << d;
    }
}

TEST(Bounds, OfAHeightFieldReachDownToItsFloor)
{
    const std::vector<double> heights{1, 2, 3, 4};
    const HeightField field(HeightGrid<double>{heights, 2, 2, 5, 7, 9});
    const Aabb<3, double> box = bounds(Shape3(field), Pose3d{});
    const double lo[3] = {0, -8, 0}, hi[3] = {5, 4, 7};
    for (int d = 0; d < 3; ++d) {
        EXPECT_NEAR(box.lo[d], lo[d], 1e-12) << d;
        EXPECT_NEAR(box.hi[d], hi[d], 1e-12) << d;
    }
}

} // namespace
