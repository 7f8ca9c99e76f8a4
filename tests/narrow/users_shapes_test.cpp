// SPDX-License-Identifier: MIT
// Users' own shapes and tests.
#include <gtest/gtest.h>

#include <atomic>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "tests/narrow/random_pairs.hpp"
#include "tests/narrow/samples.hpp"

using namespace jostle;
using namespace narrow_samples;

namespace {

TEST(AUsersShape, IsMetByItsSupportPoints)
{
    const Ball ball(0.5);
    const Disc disc;
    const Shape3 own(ball, ShapeTypes::first_custom), built_in = Shape3::sphere(0.5);
    const Shape2 own2(disc, ShapeTypes::first_custom), built_in2 = Shape2::sphere(0.5);
    Random random(6);
    for (int round = 0; round < 300; ++round) {
        const Shape3 other = movers()[random.below(4)];
        const Pose3d pose = random.pose<double>(1);
        const auto mine = distance(own, Pose3d{}, other, pose, 1e300);
        const auto theirs = distance(built_in, Pose3d{}, other, pose, 1e300);
        // A ball that is known by its support points alone is a polytope once it overlaps: within 1 %.
        ASSERT_NEAR(mine->distance, theirs->distance, theirs->distance > 0 ? 1e-5 : 0.005) << round;
        const Shape2 box = Shape2::box({0.7, 0.3});
        const Pose2d flat = random.pose2<double>(1);
        ASSERT_NEAR(distance(own2, Pose2d{}, box, flat, 1e300)->distance,
                    distance(built_in2, Pose2d{}, box, flat, 1e300)->distance, 1e-6);
    }
}

/// Points of a smooth shape lie so close to each other that rounding once took some that were apart for
/// overlapping.
TEST(AUsersShape, TouchesNothingThatIsApart)
{
    Random random(7);
    const Ball ball(0.5);
    const Shape3 own(ball, ShapeTypes::first_custom), built_in = Shape3::sphere(0.5);
    const Zoo<3> zoo(random, 10, false);
    for (int round = 0; round < 60'000; ++round) {
        const Shape3& other = zoo.any(random, {ShapeTypes::box, ShapeTypes::convex});
        const Pose3d pose = random.pose<double>(4);
        const double gap = distance(built_in, Pose3d{}, other, pose, INFINITY)->distance;
        if (gap < 1e-3) continue;
        ASSERT_FALSE(touching(own, Pose3d{}, other, pose))
            << round << " type " << other.type() << ": " << gap;
        ASSERT_NEAR(distance(own, Pose3d{}, other, pose, INFINITY)->distance, gap, 1e-5) << round;
    }
}

TEST(AUsersTest, ReplacesTheLibrarys)
{
    const Ball ball(0.5);
    const std::vector<Shape3> shapes = {Shape3(ball, 20), Shape3::box({1, 1, 1}), Shape3(ball, 20)};
    const std::vector<Pose3f> poses = {{{0, 1.4f, 0}}, {{0, 0, 0}}, {{0, 9, 0}}};
    const std::vector<Pair> pairs = {{0, 1}, {1, 2}, {1, 0}};
    std::atomic<int> asked{0};
    ContactFinder3f finder;
    finder.add_test({ShapeTypes::box, 20,
                     [](void* context, const PairTestInput<3>& input, PairTest<3>::Emit emit) {
                         ++*static_cast<std::atomic<int>*>(context);
                         if (input.shape_a.type() != ShapeTypes::box || input.pose_b.position[1] > 5) return;
                         Contact<3, double> contact{};
                         contact.normal = {0, 1, 0};
                         contact.count = 1;
                         contact.point[0] = {{0, 1, 0}, {}, 0.125, 77};
                         emit(contact);
                     },
                     &asked});
    const auto found = finder.find({shapes, poses}, std::span<const Pair>(pairs)).to_vector();
    EXPECT_EQ(asked, 3);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].pair, (Pair{0, 1}));
    EXPECT_EQ(found[0].normal[1], -1);
    EXPECT_EQ(found[1].normal[1], 1);
    EXPECT_EQ(found[1].point[0].from_a[1], 1);
    EXPECT_NEAR(found[1].point[0].from_b[1], -0.4, 1e-6);
    EXPECT_EQ(found[0].point[0].from_b, found[1].point[0].from_a);
}

/// Of several tests for two types, in whatever order they name them, the last one that was added; and what
/// touches is told by its depths alone.
TEST(AUsersTest, TheLastOneThatWasAddedCounts)
{
    const Ball ball(0.5);
    const std::vector<Shape3> shapes = {Shape3(ball, 20), Shape3::box({1, 1, 1})};
    const std::vector<Pose3f> poses(2);
    const std::vector<Pair> pairs = {{0, 1}};
    double depths[] = {-0.25, 0.5, -0.125, 0};
    ContactFinder3f finder;
    for (std::size_t i = 0; i < 4; ++i) {
        const bool exchanged = i % 2 != 0;
        finder.add_test({exchanged ? ShapeType{20} : ShapeTypes::box,
                         exchanged ? ShapeTypes::box : ShapeType{20},
                         [](void* depth, const PairTestInput<3>&, PairTest<3>::Emit emit) {
                             Contact<3, double> contact{};
                             contact.normal = {0, 1, 0};
                             contact.count = 1;
                             contact.point[0].depth = *static_cast<const double*>(depth);
                             emit(contact);
                         },
                         &depths[i]});
        const auto found = finder.find({shapes, poses}, pairs).to_vector();
        ASSERT_EQ(found.size(), 1u);
        EXPECT_EQ(found[0].point[0].depth, static_cast<float>(depths[i]));
        std::uint8_t touch[] = {7};
        finder.touching({shapes, poses}, pairs, touch);
        EXPECT_EQ(touch[0], depths[i] >= 0 ? 1 : 0) << depths[i];
    }
}

/// The poses that a test is given are those of the objects, in 3D by quaternions of any rotation and in 2D.
TEST(AUsersTest, GetsTheRotationsThatThePosesHave)
{
    std::vector<std::array<double, 4>> seen;
    ContactFinder3d finder({.executor = &serial_executor()});
    finder.add_test({ShapeTypes::box, ShapeTypes::cone,
                     [](void* context, const PairTestInput<3>& input, PairTest<3>::Emit) {
                         static_cast<decltype(seen)*>(context)->push_back(input.pose_b.rotation);
                     },
                     &seen});
    const std::vector<Shape3> shapes{Shape3::box({1, 2, 3}), Shape3::cone(1, 0.5)};
    const std::vector<Pair> pairs = {{0, 1}};
    for (int largest = 0; largest < 4; ++largest)
        for (int signs = 0; signs < 16; ++signs) {
            std::vector<Pose3d> poses(2);
            double size = 0;
            for (int i = 0; i < 4; ++i) {
                double& q = poses[1].rotation[static_cast<std::size_t>(i)];
                q = (i == largest ? 0.9 : 0.1 * (i + 1)) * ((signs >> i & 1) != 0 ? -1 : 1);
                size += q * q;
            }
            finder.find({shapes, poses}, pairs);
            double same = 0;
            for (std::size_t i = 0; i < 4; ++i)
                same += seen.back()[i] * poses[1].rotation[i] / std::sqrt(size);
            EXPECT_NEAR(std::abs(same), 1, 1e-14) << largest << ", " << signs; // q and -q are one rotation
        }
    EXPECT_EQ(seen.size(), 64u);

    std::vector<std::array<double, 2>> seen2;
    ContactFinder<2, double> flat({.executor = &serial_executor()});
    flat.add_test({ShapeTypes::box, ShapeTypes::capsule,
                   [](void* context, const PairTestInput<2>& input, PairTest<2>::Emit) {
                       static_cast<decltype(seen2)*>(context)->push_back(input.pose_b.rotation);
                   },
                   &seen2});
    std::vector<Pose2d> poses2(2);
    poses2[1].rotation = {-0.6, 0.8};
    flat.find({std::vector<Shape2>{Shape2::box({1, 2}), Shape2::capsule(1, 0.5)}, poses2}, pairs);
    ASSERT_EQ(seen2.size(), 1u);
    EXPECT_NEAR(seen2[0][0], -0.6, 1e-15);
    EXPECT_NEAR(seen2[0][1], 0.8, 1e-15);

    try {
        finder.add_test({ShapeTypes::sphere, ShapeTypes::box, nullptr});
        ADD_FAILURE() << "a test without a function was taken";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
    }
    // It goes with its finder.
    ContactFinder3d moved(std::move(finder)), assigned;
    assigned = std::move(moved);
    assigned.find({shapes, std::vector<Pose3d>(2)}, pairs);
    EXPECT_EQ(seen.size(), 65u);
}

/// A finder called while it works: from its own callback, and from another thread meanwhile.
TEST(Custom, AFinderInUseRefusesAnotherCall)
{
    struct Again
    {
        ContactFinder3f finder;
        const std::vector<Shape3> shapes = std::vector<Shape3>(2);
        const std::vector<Pose3f> poses = std::vector<Pose3f>(2);
        const std::vector<Pair> pairs = {{0, 1}};
        int refused = 0;
        void call()
        {
            std::uint8_t touch[1];
            for (const bool find : {false, true})
                try {
                    if (find)
                        finder.find({shapes, poses}, pairs);
                    else
                        finder.touching({shapes, poses}, pairs, touch);
                } catch (const Error& error) {
                    refused +=
                        std::string(error.what()).find("this ContactFinder is in use by another call") == 0;
                }
        }
    } again;
    again.finder.add_test({ShapeTypes::sphere, ShapeTypes::sphere,
                           [](void* context, const PairTestInput<3>&, PairTest<3>::Emit emit) {
                               Again& it = *static_cast<Again*>(context);
                               it.call();
                               std::thread([&] { it.call(); }).join();
                               emit(Contact<3, double>{});
                           },
                           &again});
    EXPECT_EQ(again.finder.find({again.shapes, again.poses}, again.pairs).size(), 1u);
    EXPECT_EQ(again.refused, 4);
    EXPECT_EQ(again.finder.find({again.shapes, again.poses}, again.pairs).size(), 1u); // no longer in use
    EXPECT_EQ(again.refused, 8);
}

} // namespace
