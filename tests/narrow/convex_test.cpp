// SPDX-License-Identifier: MIT
// Every two convex shapes in 3D against the definition.
#include <gtest/gtest.h>

#include "narrow/convex/axes.hpp"
#include "narrow/convex/convex3.hpp"
#include "narrow/parts/pair.hpp"
#include "tests/narrow/rounded_hulls.hpp"

using namespace jostle;
using narrow::Vec3;
using rounded_hulls::make_sample;
using rounded_hulls::placed;
using rounded_hulls::Sample;

namespace {

class EveryTwoConvexShapes : public testing::TestWithParam<std::tuple<std::uint32_t, std::uint32_t>>
{
};

TEST_P(EveryTwoConvexShapes, AnswerAsDefined)
{
    const auto [kind_a, kind_b] = GetParam();
    Random random(kind_a * 10 + kind_b);
    const int rounds = kind_a >= 4 || kind_b >= 4 ? 30 : kind_a + kind_b >= 4 ? 60 : 250;
    int touching = 0, apart = 0;
    for (int round = 0; round < rounds; ++round) {
        SCOPED_TRACE(round);
        const Sample a = make_sample(kind_a, random), b = make_sample(kind_b, random);
        const double spread = random.chance(0.5) ? 1 : 0.5;
        const Pose3d pose_a = random.pose<double>(spread), pose_b = random.pose<double>(spread);
        const double expected =
            oracle::signed_distance(placed(a, pose_a), placed(b, pose_b)) - a.radius - b.radius;
        narrow::Placed<3> pair = narrow::place(a.shape, pose_a, b.shape, pose_b);
        const bool swapped = narrow::arrange(pair);

        narrow::Gap<3> gap;
        narrow::find_gap(pair, HUGE_VAL, gap);
        ASSERT_NEAR(gap.distance, expected, 1e-7) << "swapped " << swapped;
        ASSERT_NEAR(length(gap.normal), 1, 1e-9);
        ASSERT_NEAR(length(gap.on_b - gap.on_a - gap.normal * gap.distance), 0, 1e-7);

        const double margin = random.chance(0.5) ? 0 : 0.2;
        std::pmr::vector<narrow::Found<3>> found;
        narrow::find_contacts(pair, margin, found);
        if (std::abs(expected - margin) < 1e-9) continue;
        ASSERT_EQ(found.size(), expected <= margin ? 1u : 0u) << expected;
        (found.empty() ? apart : touching) += 1;
        if (found.empty()) continue;
        const narrow::Manifold<3>& m = found[0].manifold;
        ASSERT_GE(m.count, 1u);
        ASSERT_LE(m.count, 4u);
        ASSERT_NEAR(length(m.normal), 1, 1e-9);
        ASSERT_NEAR(m.point[0].depth, -expected, 1e-7);
        const narrow::Core3 core_a(*pair.a, {pair.ra, {}}), core_b(*pair.b, {pair.rb, pair.d});
        for (std::uint32_t i = 0; i < m.count; ++i) {
            ASSERT_LE(m.point[i].depth, m.point[0].depth);
            ASSERT_GE(m.point[i].depth, -margin);
            for (std::uint32_t j = 0; j < i; ++j)
                ASSERT_FALSE(m.point[i].feature_a == m.point[j].feature_a &&
                             m.point[i].feature_b == m.point[j].feature_b);
        }
        // The deepest point's ends lie on the two surfaces: moved apart by the depth the shapes just touch.
        narrow::Placed<3> moved = pair;
        moved.d += m.normal * m.point[0].depth;
        narrow::Gap<3> after;
        narrow::find_gap(moved, HUGE_VAL, after);
        ASSERT_NEAR(after.distance, 0, 1e-7);
        const Shape3 point;
        for (const double side : {0.5, -0.5}) {
            const Vec3 p = m.point[0].p + m.normal * (side * m.point[0].depth);
            const narrow::Core3 at(point, {{}, p});
            narrow::Gap<3> to;
            narrow::convex_gap(side > 0 ? core_a : core_b, at, HUGE_VAL, to);
            ASSERT_LE(to.distance, 1e-6);
        }
    }
    EXPECT_GT(touching, 0);
    EXPECT_GT(apart, 0);
}

TEST(Polyhedra, OverlapAsDeepAsAllPairsOfEdgesSay)
{
    Random random(17);
    int deep = 0, apart = 0, refused = 0;
    for (int round = 0; round < 1500; ++round) {
        SCOPED_TRACE(round);
        std::vector<std::unique_ptr<ConvexHull<3>>> hulls;
        const auto shape = [&]() -> Shape3 {
            if (random.chance(0.2))
                return Shape3::box({random.uniform(0.1, 1), random.uniform(0.1, 1), random.uniform(0.1, 1)});
            std::vector<Vec<3, double>> points(random.chance(0.05) ? 200 : 4 + random.below(61));
            const bool round_one = random.chance(0.5), lattice = random.chance(0.2);
            for (auto& p : points) {
                double size = 0;
                for (double& x : p) {
                    x = random.uniform(-1, 1);
                    if (lattice) x = std::round(2 * x) / 2;
                    size += x * x;
                }
                if (round_one && !lattice)
                    for (double& x : p)
                        x /= std::sqrt(size);
            }
            return *hulls.emplace_back(std::make_unique<ConvexHull<3>>(points));
        };
        const Shape3 a = shape(), b = shape();
        const Pose3d pose_a = random.pose<double>(0.1), pose_b = random.pose<double>(1.5);
        const narrow::Core3 core_a(a, {narrow::rotation(pose_a), {}});
        const narrow::Core3 core_b(b, {narrow::rotation(pose_b), narrow::load(pose_b.position)});
        const std::uint32_t directions = core_a.polytope.directions * core_b.polytope.directions;
        if (!narrow::are_small_polyhedra(core_a, core_b)) {
            EXPECT_TRUE(core_a.polytope.edges > 192 || core_b.polytope.edges > 192 || a.type() == b.type());
            ++refused;
            continue;
        }
        if (directions > 5000 && round % 8 != 0) continue; // the slow twin is slow
        narrow::Gap<3> slow;
        narrow::gap_by_axes(core_a, core_b, slow);
        for (const bool wild : {false, true}) { // whatever the first guess is
            narrow::Gap<3> gap;
            gap.normal = {0.6, 0, -0.8};
            if (const double size = length(core_b.frame.p); !wild && size > 0)
                gap.normal = core_b.frame.p * (1 / size);
            if (!narrow::polyhedra_gap(core_a, core_b, HUGE_VAL, gap)) {
                ++refused;
                continue;
            }
            ASSERT_NEAR(std::min(0.0, gap.distance), slow.distance, 1e-9);
            ASSERT_NEAR(length(gap.normal), 1, 1e-12);
            // A plane that parts them, or the way out: neither reaches further.
            const double reach = dot(gap.normal, narrow::furthest(core_a, gap.normal)) -
                                 dot(gap.normal, narrow::furthest(core_b, -gap.normal));
            ASSERT_NEAR(reach, -gap.distance, 1e-9);
            (slow.distance < 0 ? deep : apart) += 1;
        }
    }
    EXPECT_GT(deep, 500);
    EXPECT_GT(apart, 200);
    EXPECT_LT(refused, 300);
}

INSTANTIATE_TEST_SUITE_P(, EveryTwoConvexShapes,
                         testing::Combine(testing::Values(0u, 1u, 2u, 3u, 4u, 5u),
                                          testing::Values(0u, 1u, 2u, 3u, 4u, 5u)));

} // namespace
