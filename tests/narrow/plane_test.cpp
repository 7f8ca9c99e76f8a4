// SPDX-License-Identifier: MIT
// Every two convex shapes in the plane against the definition.
#include <gtest/gtest.h>

#include "narrow/parts/pair.hpp"
#include "tests/narrow/oracle.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;
using narrow::Vec2;

namespace {

struct Sample
{
    Shape2 shape;
    std::vector<Vec2> points;
    double radius = 0;
    std::unique_ptr<ConvexHull<2>> hull;
};

Sample make_flat_sample(std::uint32_t kind, Random& random)
{
    Sample s;
    const auto size = [&] {
        return random.chance(0.15) ? 0 : random.chance(0.3) ? 1 : random.uniform(0.1, 1.5);
    };
    switch (kind) {
    case 0:
        s.radius = size();
        s.shape = Shape2::sphere(s.radius);
        s.points = {{}};
        break;
    case 1: {
        s.radius = size();
        const double half = size();
        s.shape = Shape2::capsule(half, s.radius);
        s.points = {{0, -half}, {0, half}};
        break;
    }
    case 2: {
        const double x = size(), y = size();
        s.shape = Shape2::box({x, y});
        s.points = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
        break;
    }
    default: {
        std::vector<Vec<2, double>> points(1 + random.below(9));
        for (auto& p : points) {
            for (double& x : p)
                x = random.chance(0.3) ? std::round(random.uniform(-1, 1)) : random.uniform(-1, 1);
            s.points.push_back({p[0], p[1]});
        }
        s.hull = std::make_unique<ConvexHull<2>>(points);
        s.shape = *s.hull;
    }
    }
    return s;
}

std::vector<Vec2> placed(const Sample& s, const Pose2d& pose)
{
    const narrow::Mat2 r = narrow::rotation(pose);
    std::vector<Vec2> points;
    for (const Vec2& p : s.points)
        points.push_back(r * p + narrow::load(pose.position));
    return points;
}

TEST(InThePlane, EveryTwoConvexShapesAnswerAsDefined)
{
    Random random(1);
    int touching = 0, apart = 0;
    for (int round = 0; round < 8000; ++round) {
        SCOPED_TRACE(round);
        const Sample a = make_flat_sample(random.below(4), random),
                     b = make_flat_sample(random.below(4), random);
        const Pose2d pose_a = random.pose2<double>(1), pose_b = random.pose2<double>(1);
        const double expected =
            oracle::signed_distance(placed(a, pose_a), placed(b, pose_b)) - a.radius - b.radius;
        narrow::Placed<2> pair = narrow::place(a.shape, pose_a, b.shape, pose_b);
        narrow::arrange(pair);
        narrow::Gap<2> gap;
        narrow::find_gap(pair, HUGE_VAL, gap);
        ASSERT_NEAR(gap.distance, expected, 1e-7);
        ASSERT_NEAR(length(gap.normal), 1, 1e-9);
        ASSERT_NEAR(length(gap.on_b - gap.on_a - gap.normal * gap.distance), 0, 1e-7);

        const double margin = random.chance(0.5) ? 0 : 0.2;
        narrow::FoundList<2> found;
        narrow::find_contacts(pair, margin, found);
        if (std::abs(expected - margin) < 1e-9) continue;
        ASSERT_EQ(found.size(), expected <= margin ? 1u : 0u);
        (found.empty() ? apart : touching) += 1;
        if (found.empty()) continue;
        const narrow::Manifold<2>& m = found[0].manifold;
        ASSERT_GE(m.count, 1u);
        ASSERT_LE(m.count, 2u);
        ASSERT_NEAR(m.point[0].depth, -expected, 1e-7);
        if (m.count == 2) {
            ASSERT_LE(m.point[1].depth, m.point[0].depth);
            ASSERT_GE(m.point[1].depth, -margin);
            ASSERT_FALSE(m.point[0].feature_a == m.point[1].feature_a &&
                         m.point[0].feature_b == m.point[1].feature_b);
        }
        for (const bool of_a : {true, false}) {
            // Each end of the deepest point is a point of its shape.
            const Vec2 p = m.point[0].p + m.normal * ((of_a ? 0.5 : -0.5) * m.point[0].depth);
            narrow::Placed<2> with_point = pair;
            const Shape2 point;
            with_point.b = &point;
            with_point.rb = {};
            with_point.d = p;
            if (!of_a) with_point.a = pair.b, with_point.ra = pair.rb, with_point.d = p - pair.d;
            narrow::find_gap(with_point, HUGE_VAL, gap);
            ASSERT_LE(gap.distance, 1e-6);
        }
    }
    EXPECT_GT(touching, 1000);
    EXPECT_GT(apart, 1000);
}

TEST(InThePlane, ABoxLiesOnAChainWithTwoPoints)
{
    const Mesh<2> chain(std::vector<Vec<2, double>>{{-10, 0}, {0, 0}, {10, 0}},
                        std::vector<Mesh<2>::Element>{{1, 0}, {2, 1}});
    const auto found = contacts(Shape2(chain), Pose2d{}, Shape2::box({1, 1}), Pose2d{{5, 0.9}, {1, 0}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].part_a, 1u);
    ASSERT_EQ(found[0].count, 2u);
    EXPECT_NEAR(found[0].normal[1], 1, 1e-12);
    for (std::uint32_t i = 0; i < 2; ++i)
        EXPECT_NEAR(found[0].point[i].depth, 0.1, 1e-12);
}

TEST(InThePlane, NothingCatchesOnTheJointsOfALevelChain)
{
    std::vector<Vec<2, double>> vertices;
    std::vector<Mesh<2>::Element> elements;
    for (std::uint32_t i = 0; i <= 20; ++i) {
        vertices.push_back({i * 0.5, 0});
        if (i > 0) elements.push_back({i, i - 1});
    }
    const Mesh<2> chain(vertices, elements);
    for (const Shape2& shape : {Shape2::box({0.4, 0.4}), Shape2::sphere(0.4), Shape2::capsule(0.2, 0.2)})
        for (double x = 2; x < 8; x += 0.013) {
            const auto found = contacts(Shape2(chain), Pose2d{}, shape, Pose2d{{x, 0.38}, {1, 0}});
            ASSERT_FALSE(found.empty());
            for (const auto& contact : found)
                ASSERT_NEAR(contact.normal[1], 1, 1e-9) << x;
        }
}

} // namespace
