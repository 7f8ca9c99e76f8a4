// SPDX-License-Identifier: MIT
// Contacts from one moment to the next: features that stay, small motions, first touches, memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "tests/contract/counting_memory.hpp"
#include "tests/narrow/random_pairs.hpp"
#include "tests/narrow/samples.hpp"

using namespace jostle;
using namespace narrow_samples;
using contract::CountingMemory;

namespace {

TEST(ACapsule, OnABoxHasItsDeepestPointFirst)
{
    Random random(21);
    int two[2] = {};
    for (int round = 0; round < 2000; ++round) {
        SCOPED_TRACE(round);
        const double tilt = random.uniform(-0.05, 0.05);
        for (std::size_t axis = 0; axis < 3; ++axis) { // of the box's face that it lies on
            Pose3d lying, box;
            // The capsule's axis, y, is laid along the next axis and tilted by a little.
            const Vec<3, double> along = axis == 0   ? Vec<3, double>{std::sin(tilt), std::cos(tilt), 0}
                                         : axis == 1 ? Vec<3, double>{0, std::sin(tilt), std::cos(tilt)}
                                                     : Vec<3, double>{std::cos(tilt), 0, std::sin(tilt)};
            // The quaternion that turns y to `along`: y x along, 1 + y . along.
            lying.rotation = {along[2], 0, -along[0], 1 + along[1]};
            lying.position[axis] = 1.45;
            for (std::size_t d = 0; d < 3; ++d)
                if (d != axis) lying.position[d] = random.uniform(-0.5, 0.5);
            Vec<3, double> half{3, 3, 3};
            half[axis] = 1;
            const auto found = contacts(Shape3::capsule(1, 0.5), lying, Shape3::box(half), box);
            ASSERT_EQ(found.size(), 1u);
            const double first = found[0].point[0].depth;
            ASSERT_NEAR(first, 0.05 + std::abs(std::sin(tilt)), 1e-9);
            ASSERT_LT(found[0].normal[axis], -0.99);
            if (found[0].count < 2) continue;
            ASSERT_EQ(found[0].count, 2u);
            ASSERT_NEAR(found[0].point[1].depth, 0.05 - std::abs(std::sin(tilt)), 1e-9);
            two[tilt > 0 ? 1 : 0] += 1;
        }
    }
    EXPECT_GT(two[0], 1000);
    EXPECT_GT(two[1], 1000);
}

TEST(AManifold, HasEachFeatureOnceAndKeepsThemWhileABoxSlides)
{
    Random random(9);
    int same = 0, manifolds = 0;
    std::size_t points = 0;
    for (int round = 0; round < 4000; ++round) {
        SCOPED_TRACE(round);
        const Shape3 below = Shape3::box({3, 1, 3}), above = Shape3::box({2, 1, 2});
        const double yaw = random.uniform(0, 3);
        Pose3d pose{{random.uniform(-3, 3), 1.95, random.uniform(-3, 3)},
                    {0, std::sin(yaw), 0, std::cos(yaw)}};
        const auto features = [&] {
            const auto found = contacts(below, Pose3d{}, above, pose);
            EXPECT_EQ(found.size(), 1u);
            std::vector<std::uint32_t> of;
            for (std::uint32_t i = 0; i < found[0].count; ++i)
                of.push_back(found[0].point[i].feature);
            std::sort(of.begin(), of.end());
            EXPECT_EQ(std::adjacent_find(of.begin(), of.end()), of.end());
            return of;
        };
        const auto before = features();
        pose.position[0] += 1e-7;
        pose.position[2] -= 1e-7;
        same += features() == before ? 1 : 0;
        points += before.size();
        ++manifolds;
    }
    EXPECT_GE(points, std::size_t{12000});
    EXPECT_GE(same, manifolds - 4); // a corner may just pass a side
}

TEST(MovingShapes, FirstTouchWhenSmallStepsDo)
{
    Random random(5);
    const Terrain terrain(6, 6, 0.2);
    const Mesh<3> mesh(terrain.vertices, terrain.triangles);
    std::vector<Shape3> shapes = movers();
    shapes.push_back(mesh);
    int hits = 0, misses = 0;
    for (int round = 0; round < 150; ++round) {
        const Shape3 &a = shapes[random.below(5)], &b = shapes[random.below(4)];
        Motion<3, double> moving_a{random.pose<double>(0.5), {}, {}},
            moving_b{random.pose<double>(3), {}, {}};
        for (std::size_t d = 0; d < 3; ++d) {
            moving_b.linear[d] = -1.5 * moving_b.pose.position[d] + random.uniform(-1, 1);
            moving_a.angular[d] = random.uniform(-2, 2);
            moving_b.angular[d] = random.uniform(-2, 2);
        }
        const double tolerance = 1e-3;
        const auto impact = time_of_impact(a, moving_a, b, moving_b, tolerance);
        const auto swapped = time_of_impact(b, moving_b, a, moving_a, tolerance);
        ASSERT_EQ(impact.has_value(), swapped.has_value());
        // The pose at a time, by another way: many small turns.
        const auto at = [](const Motion<3, double>& motion, double t) {
            Pose3d pose = motion.pose;
            const auto& w = motion.angular;
            const double angle = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) * t;
            for (std::size_t d = 0; d < 3; ++d)
                pose.position[d] += t * motion.linear[d];
            if (angle == 0) return pose;
            const double s = std::sin(angle / 2) * t / angle, c = std::cos(angle / 2);
            const double x = w[0] * s, y = w[1] * s, z = w[2] * s;
            const auto q = motion.pose.rotation;
            pose.rotation = {
                c * q[0] + x * q[3] + y * q[2] - z * q[1], c * q[1] - x * q[2] + y * q[3] + z * q[0],
                c * q[2] + x * q[1] - y * q[0] + z * q[3], c * q[3] - x * q[0] - y * q[1] - z * q[2]};
            return pose;
        };
        const double end = impact ? impact->time : 1;
        for (int step = 0; step <= 100; ++step) { // nothing before
            const double t = end * step / 100;
            if (impact && step == 100) break;
            const auto d = distance(a, at(moving_a, t), b, at(moving_b, t), 1e300);
            ASSERT_GT(d->distance, impact && impact->time == 0 ? -1e300 : 0) << round << " at " << t;
        }
        (impact ? hits : misses) += 1;
        if (!impact) continue;
        ASSERT_EQ(impact->time, swapped->time);
        ASSERT_EQ(impact->from_a, swapped->from_b);
        const auto d = distance(a, at(moving_a, end), b, at(moving_b, end), 1e300);
        ASSERT_LE(d->distance, tolerance * 1.01);
        if (end > 0) {
            ASSERT_GT(d->distance, 0);
        }
    }
    EXPECT_GT(hits, 30);
    EXPECT_GT(misses, 10);
}

TEST(MovingShapes, AFastBallDoesntPassAThinWall)
{
    const Motion<3, float> wall{{}, {}, {}};
    const Motion<3, float> ball{{{-1000, 0.1f, 0.2f}}, {2000, 0, 0}, {}};
    const auto impact = time_of_impact(Shape3::box({0.001, 5, 5}), wall, Shape3::sphere(0.1), ball, 1e-4f);
    ASSERT_TRUE(impact);
    EXPECT_NEAR(impact->time, (1000 - 0.101) / 2000, 1e-6);
    EXPECT_NEAR(impact->normal[0], -1, 1e-6);
}

TEST(Memory, ASteadyFrameAllocatesNothing)
{
    Random random(9);
    std::vector<Shape3> shapes;
    std::vector<Pose3f> poses;
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < 2000; ++i) {
        shapes.push_back(movers()[i % 4]);
        poses.push_back(random.pose<float>(3));
        for (int k = 0; k < 5; ++k)
            if (i > 0) pairs.push_back({random.below(i), i});
    }
    CountingMemory memory;
    ContactOptions options;
    options.memory = &memory;
    const auto executor = make_thread_executor(1);
    options.executor = executor.get();
    ContactFinder3f finder(options);
    finder.find({shapes, poses}, std::span<const Pair>(pairs));
    finder.find({shapes, poses}, std::span<const Pair>(pairs));
    const std::uint64_t before = memory.allocations;
    EXPECT_GT(before, 0u);
    finder.find({shapes, poses}, std::span<const Pair>(pairs));
    EXPECT_EQ(memory.allocations, before);
}

TEST(Continuity, SmallMotionSmallChange)
{
    // A box tumbles slowly over another: depth and the deepest point's place never jump while the normal
    // stays.
    const Shape3 a = Shape3::box({2, 0.5, 2}), b = Shape3::box({0.5, 0.4, 0.6});
    std::optional<Contact<3, double>> last;
    for (int step = 0; step < 20000; ++step) {
        const double angle = step * 1e-4;
        const Pose3d pose{{0.3 * std::sin(angle), 1.0, 0},
                          {0.6 * std::sin(angle), 0, 0.8 * std::sin(angle), std::cos(angle)}};
        const auto found = contacts(a, Pose3d{}, b, pose);
        if (found.empty()) {
            last.reset();
            continue;
        }
        const auto& now = found[0];
        if (last) {
            double turned = 0;
            for (std::size_t d = 0; d < 3; ++d)
                turned = std::max(turned, std::abs(now.normal[d] - last->normal[d]));
            ASSERT_NEAR(now.point[0].depth, last->point[0].depth, 3e-4) << step;
            if (now.point[0].feature == last->point[0].feature && turned < 1e-2) {
                for (std::size_t d = 0; d < 3; ++d)
                    ASSERT_NEAR(now.point[0].from_a[d], last->point[0].from_a[d], 1e-2) << step;
            }
        }
        last = now;
    }
}

} // namespace
