// SPDX-License-Identifier: MIT
// Distances in closed form, and their slow twin: the search that knows any two convex shapes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "narrow/interface/answers.hpp"
#include "narrow/math.hpp"
#include "narrow/parts/pair.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

struct Case
{
    Shape3 a, b;
    Pose3d pose_a, pose_b;
    double scale = 1;
};

/// Spheres, capsules and boxes, often flat, in one place, parallel or nearly.
Case random_case(Random& random)
{
    Case c;
    c.scale = random.chance(0.2) ? std::pow(10.0, random.uniform(-40, 40)) : 1;
    const auto size = [&] { return random.chance(0.15) ? 0.0 : c.scale * random.uniform(0.1, 1); };
    const auto shape = [&] {
        switch (random.below(3)) {
        case 0:
            return Shape3::sphere(size());
        case 1:
            return Shape3::capsule(size(), size());
        default:
            return Shape3::box({size(), size(), size()});
        }
    };
    c.a = shape();
    c.b = shape();
    const double spread = random.chance(0.5) ? 3 : random.chance(0.5) ? 1 : random.uniform(0, 1000);
    c.pose_a = random.pose<double>(spread);
    c.pose_b = random.pose<double>(spread);
    if (random.chance(0.2)) c.pose_b.rotation = c.pose_a.rotation;
    if (random.chance(0.1)) { // nearly parallel
        c.pose_b.rotation = c.pose_a.rotation;
        c.pose_b.rotation[random.below(4)] += std::pow(10.0, random.uniform(-17, -5));
    }
    if (random.chance(0.05)) c.pose_b.position = c.pose_a.position;
    if (random.chance(0.1))
        for (double& q : c.pose_a.rotation)
            q *= 1e-3; // normalised as it is read
    for (Pose3d* pose : {&c.pose_a, &c.pose_b})
        for (double& x : pose->position)
            x *= c.scale;
    return c;
}

TEST(ClosedForms, AreTheSearchsDistances)
{
    Random random(51);
    int compared = 0;
    for (int round = 0; round < 60'000; ++round) {
        const Case c = random_case(random);
        SCOPED_TRACE(testing::Message()
                     << "round " << round << " types " << c.a.type() << " and " << c.b.type());
        narrow::Placed<3> pair = narrow::place(c.a, c.pose_a, c.b, c.pose_b);
        const bool swapped = narrow::arrange(pair);
        narrow::Gap<3> gap;
        narrow::find_gap(pair, HUGE_VAL, gap);
        const auto d = distance(c.a, c.pose_a, c.b, c.pose_b, HUGE_VAL);
        ASSERT_TRUE(d);
        const double size =
            narrow::length(pair.d) + narrow::ShapeAccess::reach(c.a) + narrow::ShapeAccess::reach(c.b);
        ASSERT_NEAR(d->distance, gap.distance, 3e-9 * size); // what lies nearer than that has no direction
        if (gap.distance > 1e-6 * size) {
            ASSERT_NEAR(d->distance, gap.distance, 1e-13 * size);
            for (int k = 0; k < 3; ++k)
                ASSERT_NEAR(d->normal[static_cast<std::size_t>(k)], (swapped ? -1 : 1) * gap.normal[k], 1e-6);
            ++compared;
        }
        // The points are that far from each other, along the normal.
        for (std::size_t k = 0; k < 3; ++k) {
            const double way = c.pose_b.position[k] - c.pose_a.position[k] + d->from_b[k] - d->from_a[k];
            ASSERT_NEAR(way, d->normal[k] * d->distance, 1e-8 * size);
        }
        // Bounds cut off at the distance, not elsewhere.
        if (!(d->distance > 0)) continue;
        ASSERT_TRUE(distance(c.a, c.pose_a, c.b, c.pose_b, d->distance * (1 + 1e-9)));
        ASSERT_FALSE(distance(c.a, c.pose_a, c.b, c.pose_b, d->distance * (1 - 1e-9) - 1e-12 * size));
        const auto mirrored = distance(c.b, c.pose_b, c.a, c.pose_a, HUGE_VAL);
        ASSERT_EQ(mirrored->distance, d->distance);
        ASSERT_EQ(mirrored->from_a, d->from_b);
        ASSERT_EQ(mirrored->from_b, d->from_a);
    }
    EXPECT_GT(compared, 20'000);
}

/// Capsules, and spheres with capsules, as near as they get to touching.
Case random_round_case(Random& random)
{
    for (;;) {
        Case c = random_case(random);
        if (c.a.type() == ShapeTypes::box || c.b.type() == ShapeTypes::box) continue;
        if (c.a.type() == ShapeTypes::sphere && c.b.type() == ShapeTypes::sphere) continue;
        const double reach = narrow::ShapeAccess::reach(c.a) + narrow::ShapeAccess::reach(c.b);
        for (std::size_t d = 0; d < 3; ++d)
            c.pose_b.position[d] = c.pose_a.position[d] + reach * random.uniform(-0.7, 0.7);
        return c;
    }
}

TEST(ClosedForms, ContactsOfRoundShapesAreTheSearchs)
{
    Random random(52);
    int single = 0, twofold = 0;
    for (int round = 0; round < 60'000; ++round) {
        const Case c = random_round_case(random);
        narrow::Placed<3> pair = narrow::place(c.a, c.pose_a, c.b, c.pose_b);
        narrow::arrange(pair);
        const double size = narrow::length(pair.d) + narrow::ShapeAccess::reach(c.a) +
                            narrow::ShapeAccess::reach(c.b) + 1e-300;
        const double margin = random.chance(0.5) ? 0 : size * random.uniform(0, 0.2);
        SCOPED_TRACE(testing::Message() << "round " << round << " types " << c.a.type() << " and "
                                        << c.b.type() << " within " << margin);
        narrow::FoundList<3> quick, slow;
        narrow::find_contacts(pair, margin, quick);
        narrow::find_contacts_generally(pair, margin, slow);
        narrow::Gap<3> gap;
        narrow::find_gap(pair, HUGE_VAL, gap);
        if (std::abs(gap.distance - margin) < 1e-12 * size) continue; // rounding decides
        ASSERT_EQ(quick.size(), slow.size());
        if (quick.empty()) continue;
        const narrow::Manifold<3>&one = quick[0].manifold, &other = slow[0].manifold;
        ASSERT_EQ(one.count, other.count);
        (one.count == 1 ? single : twofold) += 1;
        const double cores = gap.distance + c.a.radius() + c.b.radius();
        const double angle = cores < 1e-6 * size ? 1e-4 : 1e-7; // of cores that nearly touch
        for (int d = 0; d < 3; ++d)
            ASSERT_NEAR(one.normal[d], other.normal[d], angle);
        for (std::uint32_t k = 0; k < one.count; ++k) {
            const narrow::ManifoldPoint<3>& point = one.point[k];
            // Two points that are as deep but for rounding may come in either order.
            const bool turned = one.count == 2 &&
                                length2(other.point[1 - k].p - point.p) < length2(other.point[k].p - point.p);
            const narrow::ManifoldPoint<3>& twin = other.point[turned ? 1 - k : k];
            ASSERT_NEAR(point.depth, twin.depth, angle * size);
            for (int d = 0; d < 3; ++d)
                ASSERT_NEAR(point.p[d], twin.p[d], 30 * angle * size);
            if (pair.b->size()[1] == 0 || pair.a->size()[1] == 0)
                continue; // an end, or an edge without length
            ASSERT_EQ(point.feature_a, twin.feature_a);
            ASSERT_EQ(point.feature_b, twin.feature_b);
        }
    }
    EXPECT_GT(single, 10'000);
    EXPECT_GT(twofold, 1'000);
}

// They go the same way, only without what other shapes need.
TEST(ClosedForms, ContactsOfBallsWithCylindersAndConesAreTheSearchsToTheBit)
{
    Random random(53);
    int touching = 0, inside = 0;
    for (int round = 0; round < 40'000; ++round) {
        const double radius = std::exp(random.uniform(-3, 1)), half = std::exp(random.uniform(-2, 2));
        const double other = std::exp(random.uniform(-2, 2));
        const Shape3 ball = Shape3::sphere(radius);
        const Shape3 shape = random.chance(0.5) ? Shape3::cylinder(half, other) : Shape3::cone(half, other);
        Pose3d at{{}, random.rotation<double>()}, ball_at{{}, random.rotation<double>()};
        const double far = random.chance(0.1) ? 1e-12 : half + other + radius;
        for (double& x : ball_at.position)
            x = random.chance(0.1) ? 0 : random.uniform(-far, far);
        if (random.chance(0.2)) at.rotation = {0, 0, 0, 1}; // exactly over the axis, or a disc, now and then
        const double margin = random.chance(0.5) ? 0 : radius * random.uniform(0, 0.5);
        narrow::Placed<3> pair = narrow::place(ball, ball_at, shape, at);
        narrow::arrange(pair);
        ASSERT_EQ(pair.a->type(), ShapeTypes::sphere);
        narrow::FoundList<3> quick, slow;
        narrow::find_contacts(pair, margin, quick);
        narrow::find_contacts_generally(pair, margin, slow);
        ASSERT_EQ(quick.size(), slow.size()) << "round " << round;
        if (quick.empty()) continue;
        const narrow::Manifold<3>&one = quick[0].manifold, &twin = slow[0].manifold;
        ASSERT_EQ(one.count, 1u);
        ASSERT_EQ(twin.count, 1u);
        ++touching;
        inside += one.point[0].depth > radius ? 1 : 0;
        for (int d = 0; d < 3; ++d) {
            ASSERT_EQ(one.normal[d], twin.normal[d]) << "round " << round;
            ASSERT_EQ(one.point[0].p[d], twin.point[0].p[d]) << "round " << round;
        }
        ASSERT_EQ(one.point[0].depth, twin.point[0].depth);
        ASSERT_EQ(one.point[0].feature_a, twin.point[0].feature_a);
        ASSERT_EQ(one.point[0].feature_b, twin.point[0].feature_b);
    }
    EXPECT_GT(touching, 10'000);
    EXPECT_GT(inside, 1'000);
}

template <class T>
class Batches : public testing::Test
{
};
using Numbers = testing::Types<float, double>;
TYPED_TEST_SUITE(Batches, Numbers);

TYPED_TEST(Batches, OfDistancesHaveTheBitsOfSinglePairs)
{
    using T = TypeParam;
    Random random(52);
    std::vector<Shape3> shapes;
    std::vector<Pose<3, T>> poses;
    const Zoo<3> zoo(random, 1);
    for (int i = 0; i < 4000; ++i) {
        const Case c = random_case(random);
        for (const auto& [shape, pose] : {std::pair(c.a, c.pose_a), std::pair(c.b, c.pose_b)}) {
            const std::uint32_t odd = random.below(static_cast<std::uint32_t>(20 * zoo.shapes.size()));
            shapes.push_back(odd < zoo.shapes.size() ? zoo.shapes[odd] : shape);
            Pose<3, T> converted;
            for (std::size_t k = 0; k < 3; ++k)
                converted.position[k] = static_cast<T>(std::clamp(pose.position[k], -1e37, 1e37));
            for (std::size_t k = 0; k < 4; ++k)
                converted.rotation[k] = static_cast<T>(pose.rotation[k]);
            if (converted.rotation == std::array<T, 4>{}) converted.rotation[3] = 1;
            poses.push_back(converted);
        }
    }
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < 4000; ++i)
        pairs.push_back(random.chance(0.5) ? Pair{2 * i, 2 * i + 1} : Pair{2 * i + 1, 2 * i});
    for (const T bound : {std::numeric_limits<T>::infinity(), T(1), T(0)})
        for (const InstructionSet set : supported_instruction_sets()) {
            SCOPED_TRACE(testing::Message() << name(set) << " within " << bound);
            ContactOptions options;
            options.executor = &serial_executor();
            options.instruction_set = set;
            ContactFinder<3, T> finder(options);
            std::vector<Distance<3, T>> out(pairs.size());
            finder.distances({shapes, poses}, pairs, bound, std::span(out));
            for (std::size_t i = 0; i < pairs.size(); ++i) {
                const auto [a, b] = pairs[i];
                SCOPED_TRACE(testing::Message()
                             << "pair " << i << " types " << shapes[a].type() << " and " << shapes[b].type());
                const auto d = distance(shapes[a], poses[a], shapes[b], poses[b], bound);
                if (!d) {
                    ASSERT_EQ(out[i].distance, std::numeric_limits<T>::infinity());
                    continue;
                }
                ASSERT_EQ(out[i].distance, d->distance);
                ASSERT_EQ(out[i].normal, d->normal);
                ASSERT_EQ(out[i].from_a, d->from_a);
                ASSERT_EQ(out[i].from_b, d->from_b);
                ASSERT_EQ(std::memcmp(&out[i], &*d, sizeof(*d)), 0) << "signs of zero differ";
            }
        }
}

// Whether shapes touch has a short way of its own. It agrees with what is found to the last digit: b is moved
// towards a until they touch, by halves of what is left.
TEST(ClosedForms, TouchWhereThereIsAContact)
{
    Random random(78);
    ContactFinder<3, double> finder;
    int edges = 0;
    for (int round = 0; round < 4000; ++round) {
        Case c = random_case(random);
        const Vec3d from = c.pose_a.position;
        Vec3d way;
        for (double& x : way)
            x = c.scale * (random.chance(0.3) ? 0 : random.uniform(-8, 8));
        const auto check = [&](double t) {
            for (std::size_t d = 0; d < 3; ++d)
                c.pose_b.position[d] = from[d] + t * way[d];
            const bool has_contact = !contacts(c.a, c.pose_a, c.b, c.pose_b).empty();
            const Shape3 shapes[] = {c.a, c.b};
            const Pose3d poses[] = {c.pose_a, c.pose_b};
            const Pair pair[] = {{0, 1}};
            std::uint8_t out = 2;
            finder.touching({shapes, poses}, pair, std::span(&out, 1));
            EXPECT_EQ(out != 0, has_contact) << round << " at " << t;
            EXPECT_EQ(touching(c.a, c.pose_a, c.b, c.pose_b), has_contact) << round << " at " << t;
            EXPECT_EQ(touching(c.b, c.pose_b, c.a, c.pose_a), has_contact) << round << " at " << t;
            return has_contact;
        };
        double near = 0, far = 1;
        if (!check(near) || check(far)) continue;
        ++edges;
        for (int step = 0; step < 60; ++step) {
            const double middle = (near + far) / 2;
            (check(middle) ? near : far) = middle;
        }
    }
    EXPECT_GT(edges, 1000);
}

/// The least value of a function of [-1, 1] that has one valley.
template <class Function>
double least_of(const Function& function)
{
    double lo = -1, hi = 1;
    for (int step = 0; step < 80; ++step) {
        const double third = (hi - lo) / 3;
        if (function(lo + third) <= function(hi - third))
            hi -= third;
        else
            lo += third;
    }
    return function((lo + hi) / 2);
}

// A capsule is as near to a triangle as the nearest of the balls in it.
TEST(ClosedForms, CapsulesAreAsNearToTrianglesAsTheirBalls)
{
    Random random(79);
    int apart = 0, level = 0;
    for (int round = 0; round < 4000; ++round) {
        // In common axes: the capsule along y, the triangle often in a plane along y or nearly, or thin.
        const bool along = random.chance(0.4);
        const double slope = along && random.chance(0.5) ? std::pow(10, random.uniform(-14, -2)) : 0;
        std::vector<Vec3d> corners(3);
        for (Vec3d& corner : corners) {
            for (double& x : corner)
                x = random.chance(0.2) ? std::round(random.uniform(-1, 1)) : random.uniform(-1, 1);
            if (along) corner[2] = slope * corner[1];
        }
        if (random.chance(0.1)) {
            corners[2] = corners[0];
            corners[2][random.below(3)] += std::pow(10, random.uniform(-6, -1));
        }
        const Mesh3 triangle(corners, {{0, 1, 2}});
        const Shape3 mesh(triangle);
        const double half = random.chance(0.1) ? 0 : random.uniform(0.1, 1), radius = 0.05;
        const Pose3d pose = random.pose<double>(5);
        const narrow::Mat3 turn = narrow::rotation(pose);
        const narrow::Vec3 middle{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-0.5, 0.5)};
        const auto placed = [&](double y) {
            const narrow::Vec3 p = turn * (middle + narrow::Vec3{0, y, 0});
            Pose3d there = pose;
            there.position = {pose.position[0] + p.x, pose.position[1] + p.y, pose.position[2] + p.z};
            return there;
        };
        const auto to_ball = [&](double t) {
            return distance(Shape3::sphere(radius), placed(t * half), mesh, pose, INFINITY)->distance;
        };
        const auto found = distance(Shape3::capsule(half, radius), placed(0), mesh, pose, INFINITY);
        ASSERT_TRUE(found);
        if (found->distance + radius < 1e-6) continue; // the axis passes through
        ASSERT_NEAR(found->distance, least_of(to_ball), 2e-9) << "round " << round;
        const auto is_within = [&](double most) {
            return distance(Shape3::capsule(half, radius), placed(0), mesh, pose, most).has_value();
        };
        ASSERT_TRUE(is_within(std::max(0.0, found->distance + 1e-9))) << round;
        if (found->distance > 1e-9) {
            ASSERT_FALSE(is_within(found->distance - 1e-9)) << round;
        }
        ++apart;
        level += along ? 1 : 0;
    }
    EXPECT_GT(apart, 2500);
    EXPECT_GT(level, 1000);
}

} // namespace
