// SPDX-License-Identifier: MIT
// Every point of a contact, not only the deepest: where it lies, and what its features say.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "narrow/convex/clip.hpp"
#include "narrow/convex/convex3.hpp"
#include "narrow/parts/pair.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;
using narrow::Vec3;

namespace {

/// How many features were looked at.
struct Seen
{
    int vertices = 0, faces = 0, edges = 0;
};

bool is_edge(std::uint16_t feature)
{
    return (feature & 0xc000) == narrow::edge_feature;
}
bool is_face(std::uint16_t feature)
{
    return (feature & 0xc000) == narrow::face_feature;
}

/// A vertex or a face that meets another shape at `end`, which lies on its surface: the end lies there. Edges
/// are numbered in several ways and only counted.
void see_feature(const narrow::Core3& core, std::uint16_t feature, const Vec3& end, const Vec3& outwards,
                 double near, Seen& seen)
{
    const std::uint32_t number = feature & 0x3fffu;
    const Vec3 on_core = end - outwards * core.radius;
    if ((feature & 0xc000) == narrow::vertex_feature) {
        ASSERT_LT(number, core.polytope.vertices);
        ASSERT_LE(length(core.frame * core.polytope.vertex(number) - on_core), near) << "vertex " << number;
        ++seen.vertices;
    } else if ((feature & 0xc000) == narrow::face_feature) {
        ASSERT_LT(number, core.polytope.faces);
        const Vec3 local = core.frame.r.back(on_core - core.frame.p), normal = core.polytope.normal(number);
        double top = -HUGE_VAL;
        for (std::uint32_t i = 0; i < core.polytope.vertices; ++i)
            top = std::max(top, dot(normal, core.polytope.vertex(i)));
        ASSERT_NEAR(dot(normal, local), top, near) << "face " << number;
        ++seen.faces;
    } else {
        ++seen.edges;
    }
}

/// Spheres, capsules, boxes and hulls, sharp and rounded: nearly flat on each other as often as not.
TEST(Manifold, HasItsPointsWhereItsFeaturesAre)
{
    Random random(21);
    Seen seen;
    int several = 0;
    for (int round = 0; round < 20'000; ++round) {
        SCOPED_TRACE(round);
        std::vector<std::unique_ptr<ConvexHull<3>>> hulls;
        const auto shape = [&]() -> Shape3 {
            const Vec<3, double> half{random.uniform(0.2, 1), random.uniform(0.2, 1), random.uniform(0.2, 1)};
            const std::uint32_t kind = random.below(6);
            if (kind == 0) return Shape3::capsule(half[0], half[1]);
            if (kind <= 2) return Shape3::box(half);
            if (kind == 3) return Shape3::rounded_box(half, 0.1);
            std::vector<Vec<3, double>> points(4 + random.below(20));
            for (auto& p : points)
                for (double& x : p)
                    x = random.uniform(-1, 1);
            hulls.push_back(std::make_unique<ConvexHull<3>>(points));
            return kind == 4 ? Shape3(*hulls.back()) : Shape3::rounded_hull(*hulls.back(), 0.1);
        };
        const Shape3 a = shape(), b = shape();
        const Pose3d pose_a;
        Pose3d pose_b = random.pose<double>(1.5);
        if (random.chance(0.5)) { // turned by little
            const double tilt = std::pow(10, random.uniform(-6, -1));
            pose_b.rotation = {random.uniform(-tilt, tilt), random.uniform(-tilt, tilt),
                               random.uniform(-tilt, tilt), 1};
        }
        const double margin = random.chance(0.3) ? 0.2 : 0;
        narrow::Placed<3> pair = narrow::place(a, pose_a, b, pose_b);
        narrow::arrange(pair);
        narrow::Gap<3> gap;
        narrow::find_gap(pair, HUGE_VAL, gap);
        if (gap.distance < -0.3) { // near enough to the surface that a contact is what a solver sees
            pair.d += gap.normal * (-gap.distance - random.uniform(0, 0.2));
            narrow::find_gap(pair, HUGE_VAL, gap);
        }
        narrow::FoundList<3> found;
        narrow::find_contacts(pair, margin, found);
        if (std::abs(gap.distance - margin) < 1e-9) continue;
        ASSERT_EQ(found.size(), gap.distance <= margin ? 1u : 0u);
        if (found.empty()) continue;
        const narrow::Manifold<3>& m = found[0].manifold;
        const narrow::Core3 core_a(*pair.a, {pair.ra, {}}), core_b(*pair.b, {pair.rb, pair.d});
        several += m.count > 1 ? 1 : 0;
        for (std::uint32_t i = 0; i < m.count; ++i) {
            SCOPED_TRACE(testing::Message()
                         << "point " << i << " of " << m.count << ", types " << pair.a->type() << " and "
                         << pair.b->type() << ", features " << std::hex << m.point[i].feature_a << " and "
                         << m.point[i].feature_b);
            const Vec3 end_a = m.point[i].p + m.normal * (0.5 * m.point[i].depth),
                       end_b = m.point[i].p - m.normal * (0.5 * m.point[i].depth);
            // Edges side by side that are apart sideways, too, have their points in the middle.
            if (is_edge(m.point[i].feature_a) || is_edge(m.point[i].feature_b)) {
                ++seen.edges;
                if (i != 0 || !is_edge(m.point[i].feature_a) || !is_edge(m.point[i].feature_b)) continue;
            }
            // Neither end is outside of its shape.
            const Shape3 point;
            for (const bool of_a : {true, false}) {
                narrow::Gap<3> to;
                narrow::convex_gap(of_a ? core_a : core_b, narrow::Core3(point, {{}, of_a ? end_a : end_b}),
                                   HUGE_VAL, to);
                ASSERT_LE(to.distance, 1e-6) << (of_a ? "a's end" : "b's end");
            }
            // Where the features share no point it is the nearest one, anywhere on them.
            if (m.count == 1 || (is_face(m.point[i].feature_a) && is_face(m.point[i].feature_b))) continue;
            see_feature(core_a, m.point[i].feature_a, end_a, m.normal, 1e-6, seen);
            see_feature(core_b, m.point[i].feature_b, end_b, -m.normal, 1e-6, seen);
            if (testing::Test::HasFatalFailure()) return;
        }
    }
    EXPECT_GT(several, 3000);
    EXPECT_GT(seen.vertices, 3000);
    EXPECT_GT(seen.faces, 3000);
    EXPECT_GT(seen.edges, 1000);
}

/// Points of a line that were floats once: among doubles they have edges all along it, and a contact with one
/// of those elsewhere is none.
TEST(Manifold, OfANeedleIsWhereItIsCrossed)
{
    Random random(22);
    int touched = 0;
    for (int round = 0; round < 4000; ++round) {
        SCOPED_TRACE(round);
        std::vector<Vec<3, double>> needle_points(3 + random.below(12)), points(4 + random.below(8));
        const Vec<3, double> along{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
        for (auto& p : needle_points) {
            const double at = random.uniform(-1, 1);
            for (std::size_t d = 0; d < 3; ++d)
                p[d] = static_cast<double>(static_cast<float>(at * along[d]));
        }
        for (auto& p : points)
            for (double& x : p)
                x = random.uniform(-1, 1);
        const ConvexHull3 needle_hull(needle_points), hull(points);
        const Shape3 needle = needle_hull, body = hull;
        const Pose3d pose{{}, random.rotation<double>()};
        Pose3d pose_body{{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)},
                         random.rotation<double>()};
        const auto before = distance(needle, pose, body, pose_body, INFINITY);
        ASSERT_TRUE(before);
        const double gap = random.uniform(-1, 1) * std::pow(10, random.uniform(-10, -3));
        for (std::size_t d = 0; d < 3; ++d)
            pose_body.position[d] += before->normal[d] * (gap - before->distance);
        for (const auto& contact : contacts(needle, pose, body, pose_body, 2e-3)) {
            ++touched;
            for (const double way : {0.5, -0.5}) { // to its end on the needle, and on the body
                Pose3d end{way > 0 ? contact.point[0].from_a : contact.point[0].from_b};
                for (std::size_t d = 0; d < 3; ++d) {
                    end.position[d] += contact.normal[d] * way * contact.point[0].depth;
                    end.position[d] += way > 0 ? 0 : pose_body.position[d];
                }
                const auto to = way > 0 ? distance(Shape3::sphere(0), end, needle, pose, INFINITY)
                                        : distance(Shape3::sphere(0), end, body, pose_body, INFINITY);
                ASSERT_TRUE(to);
                ASSERT_LE(to->distance, 1e-5);
            }
        }
    }
    EXPECT_GT(touched, 3600);
}

/// Above the half-space or in it: there is a contact within the margin, as deep as they are apart.
TEST(Manifold, OfAHalfSpaceReachesAsFarAsTheMargin)
{
    Random random(22);
    const Zoo<3> zoo(random, 8);
    int within = 0, beyond = 0;
    for (int round = 0; round < 4000; ++round) {
        const Shape3& shape = zoo.any(random);
        if (shape.type() == ShapeTypes::half_space || bounds(shape, Pose3d{}).hi[1] > 1e9) continue;
        const bool parts = shape.type() == ShapeTypes::compound || shape.type() == ShapeTypes::mesh ||
                           shape.type() == ShapeTypes::height_field;
        Pose3d pose;
        pose.rotation = random.rotation<double>();
        const Shape3 ground = Shape3::half_space({0, 1, 0}, 0);
        pose.position[1] -= distance(ground, Pose3d{}, shape, pose, INFINITY)->distance;
        const double gap = random.uniform(-0.2, 0.3), margin = random.uniform(0.01, 0.2);
        if (std::abs(gap - margin) < 1e-6) continue;
        pose.position[1] += gap;
        const auto found = contacts(ground, Pose3d{}, shape, pose, margin);
        ASSERT_EQ(found.empty(), gap > margin) << round << " type " << shape.type() << ", gap " << gap;
        (found.empty() ? beyond : within) += 1;
        double deepest = -HUGE_VAL;
        for (const auto& contact : found)
            deepest = std::max(deepest, contact.point[0].depth);
        if (!found.empty() && !parts) {
            ASSERT_EQ(found.size(), 1u);
            ASSERT_NEAR(deepest, -gap, 1e-7) << round << " type " << shape.type();
        }
    }
    EXPECT_GT(within, 1000);
    EXPECT_GT(beyond, 500);
}

/// A ball's contact names what it touches without that feature's points: as it is named where they are taken.
TEST(Manifold, OfABallNamesTheFeatureThatItTouches)
{
    Random random(5);
    int kinds[3] = {};
    const narrow::Core3 point(Shape3::sphere(1), {});
    for (int round = 0; round < 300; ++round) {
        std::vector<Vec<3, double>> points(1 + random.below(30));
        for (auto& p : points)
            for (double& x : p)
                x = random.uniform(-1, 1);
        const ConvexHull<3> hull(points);
        const Shape3 shapes[] = {hull,
                                 Shape3::box({0.5, 1, 0.2}),
                                 Shape3::capsule(1, 0.3),
                                 Shape3::cylinder(random.uniform(0.1, 2), 1),
                                 Shape3::cone(random.uniform(0.1, 2), 1),
                                 Shape3::ellipsoid({0.3, 1, 0.7})};
        const narrow::Mat3 turned = narrow::rotation(random.pose<double>(1));
        for (const Shape3& shape : shapes) {
            const narrow::Core3 core(shape, {turned, {1, 2, 3}});
            for (int way = 0; way < 20; ++way) {
                Vec3 n{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
                if (random.chance(0.5)) n = turned * Vec3{n.x * 0.01, n.y > 0 ? 1.0 : -1.0, n.z * 0.01};
                n = n * (1 / narrow::length(n));
                narrow::Feature of_point, met;
                narrow::take_features(point, core, n, of_point, met);
                ASSERT_EQ(narrow::feature_id(of_point.kind, of_point.id),
                          narrow::feature_id(narrow::vertex_feature, 0));
                ASSERT_EQ(narrow::feature_against_vertex(core, -n), narrow::feature_id(met.kind, met.id))
                    << round << " type " << shape.type();
                ++kinds[met.kind == narrow::face_feature ? 0 : met.kind == narrow::edge_feature ? 1 : 2];
            }
        }
    }
    for (const int seen : kinds)
        EXPECT_GT(seen, 1000);
}

} // namespace
