// SPDX-License-Identifier: MIT
// Smooth shapes whose gap or overlap is a millionth or a billionth of their size.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/narrow/smooth_samples.hpp"

using namespace jostle;
using namespace narrow_samples;

namespace {

/// The signed distance of two shapes that nearly touch: the most by which a direction near `n` parts them.
double signed_distance_near(Random& random, Vec3 n, const Shape3& a, const Pose3d& pose_a, const Shape3& b,
                            const Pose3d& pose_b)
{
    double best = parted_by(n, a, pose_a, b, pose_b);
    int steps = 0;
    for (double step = 1e-2; step > 1e-13 && steps < 600; ++steps) {
        const Vec3 aside{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
        Vec3 to = n + aside * step;
        to = to * (1 / length(to));
        const double value = parted_by(to, a, pose_a, b, pose_b);
        step *= value > best ? 1.5 : 0.8;
        if (!(value > best)) continue;
        best = value;
        n = to;
    }
    return best;
}

// At a gap of a millionth or a billionth, GJK's simplices are too flat to say whether two shapes touch.
TEST(NearlyTouchingShapes, AreApartOrNot)
{
    Random random(77);
    int apart = 0, deep = 0, cast = 0;
    for (int round = 0; round < 1500; ++round) {
        std::vector<Vec3d> corners(16);
        for (Vec3d& corner : corners)
            corner = {random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6)};
        const ConvexHull<3> hull(corners);
        const auto size = [&] { return random.uniform(0.2, 0.8); };
        const auto smooth = [&] {
            const std::uint32_t kind = random.below(3);
            return kind == 0   ? Shape3::cylinder(size(), size())
                   : kind == 1 ? Shape3::cone(size(), size())
                               : Shape3::ellipsoid({size(), size(), size()});
        };
        const Shape3 a = smooth();
        const std::uint32_t kind = random.below(4);
        const Shape3 b = kind == 0   ? Shape3(hull)
                         : kind == 1 ? Shape3::box({size(), size(), size()})
                         : kind == 2 ? Shape3::capsule(size(), size())
                                     : smooth();
        // Of a user's shape the same is known but the formula.
        const bool disguises = random.chance(0.3);
        const Disguised disguised(a);
        const Shape3 known = disguises ? Shape3(disguised, ShapeTypes::first_custom) : a;
        SCOPED_TRACE(testing::Message() << round << " types " << known.type() << " " << b.type());
        const Pose3d pose_a = random.pose<double>(1);
        Pose3d pose_b = random.pose<double>(1.5);
        for (int step = 0; step < 2; ++step) {
            const auto gap = distance(a, pose_a, b, pose_b, INFINITY);
            ASSERT_TRUE(gap);
            for (std::size_t d = 0; d < 3; ++d)
                pose_b.position[d] -= gap->normal[d] * gap->distance;
        }
        const auto at_rest = distance(a, pose_a, b, pose_b, INFINITY);
        const Vec3d touching_at = pose_b.position;
        for (const double gap : {1e-9, 1e-8, 1e-7, 1e-6, 1e-4, 0.0, -1e-9, -1e-8, -1e-7, -1e-6, -1e-5}) {
            for (std::size_t d = 0; d < 3; ++d)
                pose_b.position[d] = touching_at[d] + at_rest->normal[d] * gap;
            const auto found = distance(known, pose_a, b, pose_b, INFINITY);
            ASSERT_TRUE(found);
            const double expected =
                std::max(signed_distance_near(random, narrow::load(at_rest->normal), a, pose_a, b, pose_b),
                         signed_distance_near(random, narrow::load(found->normal), a, pose_a, b, pose_b));
            const double may_miss = disguises ? 4e-8 : 5e-9;
            ASSERT_NEAR(found->distance, expected, may_miss) << "for a gap of " << gap;
            if (std::abs(expected) < 2e-9) continue;
            ASSERT_EQ(touching(known, pose_a, b, pose_b), expected < 0) << expected;
            expected < 0 ? ++deep : ++apart;
        }
        // Nor does what comes from afar stop too late.
        Pose3d from = pose_b;
        Vec3d way;
        for (std::size_t d = 0; d < 3; ++d) {
            from.position[d] = touching_at[d] + at_rest->normal[d] + random.uniform(-0.5, 0.5);
            way[d] = 1.5 * (touching_at[d] - from.position[d]);
        }
        const auto hit = shape_cast(b, from, way, known, pose_a);
        if (!hit || hit->fraction == 0) continue;
        ++cast;
        for (std::size_t d = 0; d < 3; ++d)
            from.position[d] += way[d] * hit->fraction;
        const auto there = distance(a, pose_a, b, from, INFINITY);
        ASSERT_TRUE(there);
        ASSERT_GT(there->distance, -2e-9);
        ASSERT_LT(there->distance, 4e-8);
    }
    EXPECT_GT(apart, 4000);
    EXPECT_GT(deep, 4000);
    EXPECT_GT(cast, 500);
}

// A search of its own says whether two touch, without how far they are apart.
TEST(NearlyTouchingShapes, TouchWhereTheirDistanceSays)
{
    Random random(79);
    for (int round = 0; round < 20000; ++round) {
        const auto size = [&] { return random.uniform(0.2, 0.8); };
        std::vector<Vec3d> corners(4 + random.below(12));
        for (Vec3d& corner : corners)
            corner = {random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6)};
        const ConvexHull<3> hull(corners);
        const Shape3 a = round % 2 == 0 ? Shape3::cylinder(size(), size()) : Shape3::cone(size(), size());
        const Shape3 b = round % 3 == 0 ? Shape3::box({size(), size(), size()}) : Shape3(hull);
        const Pose3d pose_a = random.pose<double>(1);
        Pose3d pose_b = random.pose<double>(1.5);
        for (const double gap : {0.0, 1e-9, 1e-8, 1e-7}) {
            const auto before = distance(a, pose_a, b, pose_b, INFINITY);
            ASSERT_TRUE(before);
            for (std::size_t d = 0; d < 3; ++d)
                pose_b.position[d] += before->normal[d] * (gap - before->distance);
            const auto found = distance(a, pose_a, b, pose_b, INFINITY);
            ASSERT_TRUE(found);
            if (std::abs(found->distance) > 4e-9) {
                ASSERT_EQ(touching(a, pose_a, b, pose_b), found->distance < 0) << round << " gap " << gap;
            }
        }
    }
}

// What touching() says by a search of its own has a contact, also where rounding could say so or not.
TEST(NearlyTouchingShapes, HaveAContactWhereTheyTouch)
{
    Random random(80);
    int touch = 0, apart = 0;
    for (int round = 0; round < 20000; ++round) {
        const auto size = [&] { return random.uniform(0.2, 0.8); };
        std::vector<Vec3d> corners(4 + random.below(12)), others(4 + random.below(30));
        for (auto* const points : {&corners, &others})
            for (Vec3d& corner : *points)
                corner = {random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6)};
        const ConvexHull<3> hull(corners), other(others);
        const Shape3 bodies[] = {other,
                                 Shape3::box({size(), size(), size()}),
                                 Shape3::rounded_hull(other, size()),
                                 Shape3::sphere(0),
                                 Shape3::cylinder(size(), size()),
                                 Shape3::cone(size(), size()),
                                 Shape3::ellipsoid({size(), size(), size()})};
        const Shape3 b = bodies[random.below(7)];
        const Shape3 a = random.chance(0.6) ? Shape3(hull) : bodies[3 + random.below(4)];
        const Pose3d pose_a = random.pose<double>(1);
        Pose3d pose_b = random.pose<double>(1.5);
        for (const double gap : {0.0, 0.0, 1e-14, 1e-12, 1e-10}) {
            const auto before = distance(a, pose_a, b, pose_b, INFINITY);
            ASSERT_TRUE(before);
            for (std::size_t d = 0; d < 3; ++d)
                pose_b.position[d] += before->normal[d] * (gap - before->distance);
            if (!touching(a, pose_a, b, pose_b)) {
                ++apart;
                continue;
            }
            ++touch;
            ASSERT_FALSE(contacts(a, pose_a, b, pose_b).empty())
                << "round " << round << " types " << a.type() << " and " << b.type() << " gap " << gap;
        }
    }
    EXPECT_GT(touch, 10000);
    EXPECT_GT(apart, 10000);
}

// Where GJK calls a touch what Newton's method knows to be a gap: one in ten thousand of these.
TEST(NearlyTouchingShapes, HaveAContactAlsoWhereTwoSearchesDiffer)
{
    for (const std::uint32_t seed : {102u, 141u}) {
        Random random(seed);
        for (int round = 0; round < 1500; ++round) {
            std::vector<Vec3d> corners(4 + random.below(12));
            const bool flat = random.chance(0.25);
            for (Vec3d& corner : corners)
                for (double& x : corner)
                    x = random.uniform(-0.6, 0.6);
            if (flat)
                for (Vec3d& corner : corners)
                    corner[1] = 0.25;
            const ConvexHull<3> hull(corners);
            const double half = random.uniform(0.2, 0.8), radius = random.uniform(0.2, 0.8);
            const Shape3 a(hull);
            const Shape3 b = random.chance(0.5) ? Shape3::cylinder(half, radius) : Shape3::cone(half, radius);
            const Pose3d pose_a = random.pose<double>(1);
            Pose3d pose_b = random.pose<double>(1.5);
            for (const double gap : {0.0, 0.0, 1e-14, 1e-12, 1e-10}) {
                const auto before = distance(a, pose_a, b, pose_b, INFINITY);
                ASSERT_TRUE(before);
                for (std::size_t d = 0; d < 3; ++d)
                    pose_b.position[d] += before->normal[d] * (gap - before->distance);
                if (touching(a, pose_a, b, pose_b)) {
                    ASSERT_FALSE(contacts(a, pose_a, b, pose_b).empty())
                        << "round " << round << " type " << b.type() << " gap " << gap;
                }
            }
        }
    }
}

// Surfaces have ways of their own to find where a body lies on them.
TEST(NearlyTouchingShapes, HaveAContactWithTheSurfaceThatTheyTouch)
{
    Random random(12);
    int touching_ones = 0;
    for (int round = 0; round < 8000; ++round) {
        const auto height = [&] {
            return random.chance(0.5) ? 0.25 * random.below(5) : random.uniform(0, 1);
        };
        double heights[9];
        for (double& y : heights)
            y = 0.5 * height();
        const HeightField field(HeightGrid<double>{heights, 3, 3, 1.0, 1.0, 3.0});
        const Mesh3 mesh(std::vector<Vec3d>{{0, height(), 1}, {1, 0, 0}, {1, 0, 2}, {2, height(), 1}},
                         std::vector<Mesh3::Element>{{0, 2, 1}, {1, 2, 3}});
        std::vector<Vec3d> points(4 + random.below(3));
        for (Vec3d& p : points)
            p = {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
        const ConvexHull3 hull(points);
        const Shape3 a = round % 2 == 0 ? Shape3(mesh) : Shape3(field),
                     b = random.chance(0.5) ? Shape3(hull) : Shape3::box({0.3, 0.4, 0.5});
        Pose3d pose_b = random.pose<double>(0);
        if (random.chance(0.3)) pose_b.rotation = {0, 0, 0, 1};
        pose_b.position = {random.uniform(0.6, 1.4), 3, random.uniform(0.6, 1.4)};
        const auto gap = distance(a, Pose3d{}, b, pose_b, INFINITY);
        ASSERT_TRUE(gap);
        const double left = std::pow(10, random.uniform(-12, -9));
        for (std::size_t d = 0; d < 3; ++d)
            pose_b.position[d] -= (gap->distance - left) * gap->normal[d];
        if (!touching(a, Pose3d{}, b, pose_b)) continue;
        ++touching_ones;
        ASSERT_FALSE(contacts(a, Pose3d{}, b, pose_b).empty()) << round << " " << left;
    }
    EXPECT_GT(touching_ones, 400); // triangles of which a plane parts the body don't count
}

// A box that lies on a part of another one, or above it by as little as counts as nothing.
TEST(NearlyTouchingShapes, InThePlaneMeetWhereTheirSidesDo)
{
    Random random(81);
    for (int round = 0; round < 5000; ++round) {
        const auto size = [&] { return random.uniform(0.2, 1); };
        const Vec2d half{size(), size()}, half_b{size(), size()};
        const Pose2d pose = random.pose2<double>(2);
        const auto turn = narrow::rotation(pose);
        const double shift = random.uniform(-0.9, 0.9) * (half[0] + half_b[0]);
        const double gap = random.chance(0.5) ? 0 : random.uniform(-2e-10, 2e-10);
        const narrow::Vec2 at = turn * narrow::Vec2{shift, half[1] + half_b[1] + gap};
        const Pose2d pose_b{{pose.position[0] + at.x, pose.position[1] + at.y}, pose.rotation};
        const auto found = contacts(Shape2::box(half), pose, Shape2::box(half_b), pose_b);
        if (found.empty()) {
            ASSERT_GE(gap, 0) << round;
            continue;
        }
        ASSERT_EQ(found[0].count, 2u) << round << " gap " << gap;
        for (std::uint32_t k = 0; k < 2; ++k) {
            const auto& point = found[0].point[k];
            const double on_a = turn.back(narrow::load(point.from_a)).x,
                         on_b = turn.back(narrow::load(point.from_b)).x;
            ASSERT_LE(std::abs(on_a), half[0] + 1e-6) << round << " gap " << gap;
            ASSERT_LE(std::abs(on_b), half_b[0] + 1e-6) << round << " gap " << gap;
        }
    }
}

// Polygons that are nearly segments: their sides part nothing from what lies beyond their tips.
TEST(NearlyTouchingShapes, InThePlaneNeedlesEndAtTheirTips)
{
    Random random(82);
    for (int round = 0; round < 5000; ++round) {
        const double turn = random.uniform(0, 7), width = std::pow(10, random.uniform(-16, -5));
        const narrow::Vec2 along{std::cos(turn), std::sin(turn)}, across = right(along);
        std::vector<Vec2d> points;
        for (const double at : {-1.0, random.uniform(-1, 1), random.uniform(-1, 1), 1.0}) {
            const narrow::Vec2 p =
                along * at + across * (std::abs(at) < 1 ? width * random.uniform(-1, 1) : 0);
            points.push_back({p.x, p.y});
        }
        const ConvexHull2 needle(points);
        const double radius = random.chance(0.5) ? 0 : random.uniform(0.1, 1), gap = random.uniform(1e-3, 1);
        const narrow::Vec2 at = along * (1 + radius + gap);
        const auto found =
            distance(Shape2(needle), Pose2d{}, Shape2::sphere(radius), Pose2d{{at.x, at.y}}, INFINITY);
        ASSERT_TRUE(found);
        ASSERT_NEAR(found->distance, gap, 1e-6) << round << " width " << width;
    }
}

} // namespace
