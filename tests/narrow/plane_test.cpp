// SPDX-License-Identifier: MIT
// Every two convex shapes in the plane against the definition.
#include <gtest/gtest.h>

#include "narrow/convex/convex2.hpp"
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

/// Up to 80 corners on an ellipse of half-axes 1 and `width`. If `crowded`, some lie as close as doubles can
/// tell.
ConvexHull2 many_corners(Random& random, double width, bool crowded)
{
    const std::size_t count = 3 + random.below(78);
    const bool regular = random.chance(0.3);
    std::vector<Vec2d> points;
    double angle = random.uniform(0, 6.28);
    for (std::size_t i = 0; i < count; ++i) {
        const bool close = crowded && random.chance(0.7);
        angle += regular ? 6.283185307179586 / static_cast<double>(count)
                 : close ? std::pow(10, random.uniform(-17, -3))
                         : random.uniform(0, 1);
        points.push_back({std::cos(angle), width * std::sin(angle)});
    }
    return ConvexHull2(points);
}

/// How far polygons are parted along unit vector n.
double parted_along(const narrow::Core2& a, const narrow::Core2& b, const Vec2& n)
{
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (std::size_t i = 0; i < b.corner.size(); ++i)
        least = std::min(least, dot(n, b.corner[i]));
    for (std::size_t i = 0; i < a.corner.size(); ++i)
        most = std::max(most, dot(n, a.corner[i]));
    return least - most;
}
/// The signed distance of polygons, by each side beside each corner. What is parted, or overlaps, by less
/// than 1e-9 of the size has a distance of 0 if nothing parts it by more.
double distance_by_each_side(const narrow::Core2& a, const narrow::Core2& b)
{
    double separation = -HUGE_VAL, least = HUGE_VAL;
    Vec2 way;
    for (const bool of_b : {false, true}) {
        const narrow::Core2 &owner = of_b ? b : a, &other = of_b ? a : b;
        for (std::size_t i = 0; i < owner.corner.size(); ++i) {
            const Vec2 from = owner.corner[i], along = owner.next(i) - from;
            if (length(along) == 0) continue;
            const Vec2 n = right(along) * (1 / length(along));
            separation = std::max(separation, of_b ? parted_along(b, a, n) : parted_along(a, b, n));
            for (std::size_t k = 0; k < other.corner.size(); ++k) {
                const Vec2 p = other.corner[k];
                const double part = std::clamp(dot(p - from, along) / length2(along), 0.0, 1.0);
                const Vec2 apart = p - (from + along * part);
                if (length(apart) < least) {
                    least = length(apart);
                    way = of_b ? -apart : apart;
                }
            }
        }
    }
    const double clear = 1e-9 * (a.reach + b.reach);
    if (separation > -clear && least > 0 && parted_along(a, b, way * (1 / least)) > clear) return least;
    return std::min(0.0, separation);
}

/// Whether a feature that says it is a corner is over point p of a contact.
bool is_corner(const narrow::Core2& core, std::uint16_t feature, const Vec2& p, const Vec2& normal)
{
    if (feature >= narrow::edge_feature) return true;
    for (std::size_t i = 0; i < core.corner.size(); ++i)
        if (core.number(i) == feature) return std::abs(cross(normal, core.corner[i] - p)) < 1e-9;
    return false;
}

// Sides and corners are found by going round both polygons.
TEST(InThePlane, PolygonsWithManyCornersAnswerAsEachSideBesideEachCorner)
{
    Random random(2);
    int apart = 0, touching = 0;
    for (int round = 0; round < 4000; ++round) {
        SCOPED_TRACE(round);
        const bool needles = random.chance(0.3), crowded = random.chance(0.3);
        const auto hull = [&] {
            const double width = needles              ? std::pow(10, random.uniform(-15, -1))
                                 : random.chance(0.2) ? 1
                                                      : random.uniform(0.1, 1);
            return many_corners(random, width, crowded);
        };
        const ConvexHull2 hull_a = hull(), hull_b = hull();
        const Shape2 a(hull_a), b(random.chance(0.1) ? hull_a : hull_b);
        const Pose2d pose = random.pose2<double>(random.chance(0.5) ? 3 : 1);
        narrow::Frame<2> frame{narrow::rotation(random.chance(0.1) ? Pose2d{} : pose),
                               narrow::load(pose.position)};
        for (const double left : {HUGE_VAL, 0.1, 1e-3, 1e-11, 0.0, -1e-11, -1e-3, -0.1}) {
            SCOPED_TRACE(left);
            const narrow::Core2 core_a(a, {narrow::rotation(Pose2d{}), {}});
            narrow::Gap<2> found;
            if (left != HUGE_VAL) { // moved to that distance, along the normal
                convex_gap(core_a, narrow::Core2(b, frame), HUGE_VAL, found);
                frame.p = frame.p - found.normal * (found.distance - left);
            }
            const narrow::Core2 core_b(b, frame);
            const double expected = distance_by_each_side(core_a, core_b);
            convex_gap(core_a, core_b, HUGE_VAL, found);
            // A gap of about 1e-9 of the size may count as none by rounding.
            ASSERT_NEAR(found.distance, expected, needles && std::abs(expected) < 1e-8 ? 1e-8 : 1e-13);
            // So small a gap has a direction that rounding turns by 1e-7.
            const bool is_tiny = found.distance > 0 && found.distance < 1e-7;
            ASSERT_NEAR(parted_along(core_a, core_b, found.normal), expected,
                        is_tiny   ? 1e-6
                        : needles ? 1e-7
                                  : 4e-9);
            ASSERT_NEAR(length(found.on_b - found.on_a - found.normal * found.distance), 0, 1e-12);
            const auto is_on = [&](const narrow::Core2& core, const Vec2& p, double inside) {
                narrow::Core2 point(0, 0, {});
                point.add(p, 0);
                return distance_by_each_side(core, point) <= inside + 4e-9;
            };
            ASSERT_TRUE(is_on(core_a, found.on_a, std::max(0.0, -expected)));
            ASSERT_TRUE(is_on(core_b, found.on_b, std::max(0.0, -expected)));
            for (const double enough : {expected - 1e-6, expected + 1e-6}) {
                narrow::Gap<2> near;
                convex_gap(core_a, core_b, enough, near);
                ASSERT_EQ(near.distance <= enough, expected <= enough);
                ASSERT_EQ(expected <= enough ? near.distance : found.distance, found.distance);
            }
            narrow::Manifold<2> manifold;
            const bool touch = convex_contact(core_a, core_b, 0, manifold);
            ASSERT_EQ(touch, found.distance <= 0);
            (touch ? touching : apart) += 1;
            if (!touch) continue;
            ASSERT_NEAR(manifold.point[0].depth, -expected, needles ? 4e-7 : 1e-12);
            for (std::uint32_t k = 0; k < manifold.count; ++k) {
                const Vec2 half = manifold.normal * (0.5 * manifold.point[k].depth);
                ASSERT_TRUE(
                    is_corner(core_a, manifold.point[k].feature_a, manifold.point[k].p, manifold.normal));
                ASSERT_TRUE(
                    is_corner(core_b, manifold.point[k].feature_b, manifold.point[k].p, manifold.normal));
                ASSERT_TRUE(is_on(core_a, manifold.point[k].p + half, needles ? 1e-6 : 0));
                ASSERT_TRUE(is_on(core_b, manifold.point[k].p - half, needles ? 1e-6 : 0));
            }
        }
    }
    EXPECT_GT(apart, 5000);
    EXPECT_GT(touching, 5000);
}

// Seen from a's position, 300 away, some of b's sides are as short as rounding.
TEST(InThePlane, PolygonsOverlapByHowFarTheirCornersReach)
{
    Random random(5);
    int deep = 0;
    for (int round = 0; round < 20000; ++round) {
        std::vector<Vec2d> points(3 + random.below(8));
        for (Vec2d& p : points)
            p = {300 + random.uniform(-1, 1), random.uniform(-1, 1)};
        const ConvexHull2 hull_a(points), hull_b = many_corners(random, 1, true);
        const Pose2d pose_a{{-300, 0}, {1, 0}}, pose_b = random.pose2<double>(1);
        const auto gap = distance(Shape2(hull_a), pose_a, Shape2(hull_b), pose_b, INFINITY);
        if (gap->distance > -1e-3) continue;
        ++deep;
        const Vec2 n = narrow::load(gap->normal);
        double top = -HUGE_VAL, bottom = HUGE_VAL;
        for (const Vec2d& p : hull_a.vertices())
            top = std::max(top, dot(n, narrow::load(p) + narrow::load(pose_a.position)));
        for (const Vec2d& p : hull_b.vertices())
            bottom = std::min(
                bottom, dot(n, narrow::rotation(pose_b) * narrow::load(p) + narrow::load(pose_b.position)));
        ASSERT_NEAR(gap->distance, bottom - top, 1e-10) << round;
    }
    EXPECT_GT(deep, 5000);
}

// Far from a's position, corners that lie close to each other become one: what goes round stops there.
TEST(InThePlane, CornersThatRoundingPutsInOnePlaceStopNoSearch)
{
    Random random(8);
    for (int round = 0; round < 3000; ++round) {
        SCOPED_TRACE(round);
        const auto hull = [&] {
            std::vector<Vec2d> points;
            const double turn = random.uniform(0, 6.28);
            for (int i = 0; i < 8; ++i)
                for (int k = -2; k <= 2; ++k) {
                    const double angle = turn + 0.7853981633974483 * i + 1e-12 * k;
                    points.push_back({std::cos(angle), std::sin(angle)});
                }
            return ConvexHull2(points);
        };
        const ConvexHull2 hull_a = hull(), hull_b = hull();
        const Pose2d pose = random.pose2<double>(1.5);
        const narrow::Vec2 far{1e6, 0};
        const narrow::Core2 a(Shape2(hull_a), {narrow::rotation(Pose2d{}), far});
        const narrow::Core2 b(Shape2(hull_b), {narrow::rotation(pose), far + narrow::load(pose.position)});
        narrow::Gap<2> found;
        convex_gap(a, b, HUGE_VAL, found);
        ASSERT_NEAR(found.distance, distance_by_each_side(a, b), 1e-9);
        narrow::Gap<2> bounded;
        convex_gap(a, b, found.distance + 1e-7, bounded);
        ASSERT_NEAR(bounded.distance, found.distance, 1e-9);
    }
}

// Both sides of a needle through the middle of a polygon overlap it equally, but for rounding.
TEST(InThePlane, ANeedleLeavesAPolygonOnEitherSide)
{
    Random random(3);
    for (int round = 0; round < 3000; ++round) {
        std::vector<Vec2d> points;
        const double count = 10.0 + 2.0 * random.below(30), height = random.uniform(0.1, 0.8);
        for (double i = 0; i < count; ++i) {
            const double angle = i * 6.283185307179586 / count;
            points.push_back({std::cos(angle), height * std::sin(angle)});
        }
        const Vec2d across{0, std::pow(10, random.uniform(-17, -13))};
        const double end = random.uniform(0.5, 2), part = random.uniform(-1, 1) * end;
        const std::vector<Vec2d> needle{{-end, 0}, {part, across[1]}, {-part, -across[1]}, {end, 0}};
        const ConvexHull2 hull_a(needle), hull_b(points);
        const Shape2 a(hull_a), b(hull_b);
        const Pose2d pose = random.pose2<double>(0);
        const auto gap = distance(a, pose, b, pose, INFINITY);
        ASSERT_TRUE(gap);
        const Pose2d at_a{{gap->from_a[0], gap->from_a[1]}, pose.rotation},
            at_b{{gap->from_b[0], gap->from_b[1]}, pose.rotation};
        ASSERT_LE(distance(a, pose, Shape2(), at_a, INFINITY)->distance, 1e-9) << round;
        ASSERT_LE(distance(b, pose, Shape2(), at_b, INFINITY)->distance, 1e-9) << round;
    }
}

// All four sides of a square in the middle of a polygon overlap it equally, but for rounding.
TEST(InThePlane, ASquareLeavesAPolygonWhereItsPointsSay)
{
    Random random(4);
    for (int round = 0; round < 3000; ++round) {
        const std::uint32_t count = 4 * (7 + random.below(40));
        std::vector<Vec2d> points;
        for (std::uint32_t i = 0; i < count; ++i) {
            const double angle = i * 6.283185307179586 / count;
            points.push_back({std::cos(angle), std::sin(angle)});
        }
        const ConvexHull2 hull(points);
        const double half = random.uniform(0.05, 0.3);
        const Shape2 a(hull), b = Shape2::box({half, half});
        const Pose2d pose_a = random.pose2<double>(0), pose_b = random.pose2<double>(0);
        const auto found = contacts(a, pose_a, b, pose_b);
        ASSERT_EQ(found.size(), 1u);
        const auto& point = found[0].point[0];
        const Pose2d there{point.from_a, {1, 0}};
        ASSERT_LE(distance(a, pose_a, Shape2(), there, INFINITY)->distance, point.depth / 2 + 1e-9) << round;
        ASSERT_LE(distance(b, pose_b, Shape2(), there, INFINITY)->distance, point.depth / 2 + 1e-9) << round;
    }
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

// Bodies of many corners, and round ones, whose type comes before or after that of a chain.
TEST(InThePlane, WhatTouchesAChainHasAContact)
{
    Random random(6);
    int touching_ones = 0;
    for (int round = 0; round < 6000; ++round) {
        const std::uint32_t count = 2 + random.below(30);
        std::vector<Vec2d> vertices{{-2, 0}};
        std::vector<Mesh2::Element> elements;
        for (std::uint32_t i = 0; i < count; ++i) {
            const Vec2d last = vertices.back();
            vertices.push_back({last[0] + random.uniform(0.05, 4.0 / count),
                                last[1] + (random.chance(0.3) ? 0 : random.uniform(-0.3, 0.3))});
            elements.push_back(random.chance(0.5) ? Mesh2::Element{i, i + 1} : Mesh2::Element{i + 1, i});
        }
        const Mesh2 chain(vertices, elements);
        const ConvexHull2 hull = many_corners(random, random.uniform(0.1, 1), false);
        const Shape2 a(chain), b = round % 3 == 0   ? Shape2(hull)
                                   : round % 3 == 1 ? Shape2::rounded_hull(hull, random.uniform(0.1, 0.5))
                                                    : Shape2::ellipsoid({1, random.uniform(0.1, 1)});
        const Pose2d pose_a{};
        Pose2d pose_b = random.pose2<double>(2);
        for (const double left : {HUGE_VAL, 1e-10, 0.0, -1e-9, -1e-3, -0.1}) {
            const auto gap = distance(a, pose_a, b, pose_b, INFINITY);
            for (std::size_t d = 0; d < 2 && left != HUGE_VAL; ++d)
                pose_b.position[d] -= (gap->distance - left) * gap->normal[d];
            if (!touching(a, pose_a, b, pose_b)) continue;
            ++touching_ones;
            ASSERT_FALSE(contacts(a, pose_a, b, pose_b).empty()) << round << " " << left;
        }
    }
    EXPECT_GT(touching_ones, 10000);
}

// Less than a billionth apart they count as touching.
TEST(InThePlane, ACornerThatNearlyTouchesAJointHasAContact)
{
    const Mesh2 chain(std::vector<Vec2d>{{-1, -0.25}, {0, 0}, {1, 0}},
                      std::vector<Mesh2::Element>{{1, 0}, {2, 1}});
    const ConvexHull2 hull(std::vector<Vec2d>{{0, 0}, {-0.75, -0.4}, {-0.6, -0.7}, {0, -0.4}}); // below it
    const Shape2 a(chain), b(hull);
    for (const double gap : {2e-10, 1e-12, 0.0})
        for (const double along : {-1e-10, 0.0, 1e-10, 1e-12}) {
            const Pose2d pose{{along, -gap}, {1, 0}};
            ASSERT_TRUE(touching(a, Pose2d{}, b, pose));
            EXPECT_FALSE(contacts(a, Pose2d{}, b, pose).empty()) << gap << " " << along;
        }
}

TEST(InThePlane, AnEllipseHasTheContactWithASegmentThatItsDistanceSays)
{
    Random random(7);
    const Mesh2 segment(std::vector<Vec2d>{{-1, 0}, {1, 0}}, std::vector<Mesh2::Element>{{0, 1}});
    const Shape2 a(segment);
    for (int round = 0; round < 4000; ++round) {
        const Shape2 b = Shape2::ellipsoid({1, std::pow(10, random.uniform(-3, 0))});
        const Pose2d pose_a{};
        Pose2d pose_b = random.pose2<double>(2);
        auto gap = distance(a, pose_a, b, pose_b, INFINITY);
        const double left = random.chance(0.5) ? -1e-6 : -0.05;
        for (std::size_t d = 0; d < 2; ++d)
            pose_b.position[d] -= (gap->distance - left) * gap->normal[d];
        gap = distance(a, pose_a, b, pose_b, INFINITY);
        if (gap->distance > -1e-7) continue; // a flat one is through
        const auto found = contacts(a, pose_a, b, pose_b);
        ASSERT_EQ(found.size(), 1u) << round;
        ASSERT_NEAR(found[0].point[0].depth, -gap->distance, 1e-8) << round;
        ASSERT_NEAR(found[0].normal[0], gap->normal[0], 1e-8) << round;
        ASSERT_NEAR(found[0].normal[1], gap->normal[1], 1e-8) << round;
    }
}

TEST(InThePlane, TheNearestPointsOfAFlatEllipseLieOnBoth)
{
    const Shape2 flat = Shape2::ellipsoid({2, 0}), box = Shape2::box({0.5, 0.25});
    for (const double x : {-2.3, -1.2, 0.0, 1.2, 2.3})
        for (const double y : {-1.0, 1.0}) {
            const Pose2d at{{x, y}, {1, 0}};
            for (const bool swapped : {false, true}) {
                const auto found =
                    swapped ? distance(box, at, flat, Pose2d{}, 9) : distance(flat, Pose2d{}, box, at, 9);
                ASSERT_TRUE(found);
                EXPECT_NEAR(found->distance, 0.75, 1e-12);
                const auto of_flat = swapped ? found->from_b : found->from_a;
                const auto of_box = swapped ? found->from_a : found->from_b;
                EXPECT_LE(std::abs(of_flat[0]), 2 + 1e-12) << x << ' ' << y;
                EXPECT_LE(std::abs(of_box[0]), 0.5 + 1e-12) << x << ' ' << y;
                EXPECT_NEAR(of_box[0] + x, of_flat[0], 1e-12) << x << ' ' << y;
            }
        }
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
