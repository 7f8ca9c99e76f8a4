// SPDX-License-Identifier: MIT
// Meshes, height fields, and compounds that lie on them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "narrow/math.hpp"
#include "tests/narrow/random_pairs.hpp"
#include "tests/narrow/samples.hpp"

using namespace jostle;
using namespace narrow_samples;
using narrow::Vec3;

namespace {

TEST(AMesh, IsAsFarAsItsNearestTriangle)
{
    const Terrain terrain(8, 8, 0.4);
    const Mesh<3> mesh(terrain.vertices, terrain.triangles);
    Random random(1);
    for (int round = 0; round < 200; ++round)
        for (const Shape3& shape : movers()) {
            Pose3d pose = random.pose<double>(1);
            for (std::size_t d = 0; d < 3; ++d)
                pose.position[d] += d == 1 ? 1 : 3.5;
            double nearest = 1e300;
            for (const auto& triangle : terrain.triangles) {
                const Mesh<3> one(std::vector<Vec<3, double>>{terrain.vertices[triangle[0]],
                                                              terrain.vertices[triangle[1]],
                                                              terrain.vertices[triangle[2]]},
                                  std::vector<Mesh<3>::Element>{{0, 1, 2}});
                nearest = std::min(nearest, distance(Shape3(one), Pose3d{}, shape, pose, 1e300)->distance);
            }
            ASSERT_NEAR(distance(Shape3(mesh), Pose3d{}, shape, pose, 1e300)->distance, nearest, 1e-9);
        }
}

TEST(AFloor, CatchesNothingOnItsInnerSidesWhereItIsLevel)
{
    const Terrain terrain(12, 12, 0);
    const Mesh<3> mesh(terrain.vertices, terrain.triangles);
    const HeightField field(HeightGrid<double>{terrain.heights, terrain.columns, terrain.rows, 1, 1});
    Random random(2);
    for (const Shape3& floor : {Shape3(mesh), Shape3(field)})
        for (const Shape3& shape : movers())
            for (int round = 0; round < 300; ++round) {
                Pose3d pose;
                pose.rotation = random.rotation<double>();
                pose.position = {random.uniform(3, 8), 5, random.uniform(3, 8)};
                pose.position[1] -= distance(floor, Pose3d{}, shape, pose, 1e300)->distance + 0.01;
                for (const double margin : {0.0, 0.2}) {
                    const auto found = contacts(floor, Pose3d{}, shape, pose, margin);
                    ASSERT_FALSE(found.empty());
                    for (const auto& contact : found) {
                        ASSERT_NEAR(contact.normal[1], 1, 1e-9);
                        ASSERT_LE(contact.point[0].depth, 0.01 + 1e-9);
                    }
                }
            }
}

/// What is exactly as far as asked for counts, wherever a tree of parts looks.
TEST(AMesh, MeetsAPointExactlyAtTheMargin)
{
    const Terrain terrain(5, 5, 0);
    const Mesh<3> mesh(terrain.vertices, terrain.triangles);
    using Point = Vec<2, double>;
    const Mesh<2> chain(std::vector<Point>{{0, 0}, {1, 0}, {2, 0}, {3, 0}},
                        std::vector<Mesh<2>::Element>{{1, 0}, {2, 1}, {3, 2}});
    for (const double margin : {0.0, 0.25, 1.0})
        for (const double side : {1.0, -1.0})
            for (const double beyond : {0.0, 0x1p-20}) {
                const double height = side * (margin + beyond);
                const Pose3d over{{1.5, height, 2.25}};
                const Pose2d over2{{1.5, height}};
                EXPECT_EQ(contacts(Shape3(mesh), Pose3d{}, Shape3(), over, margin).empty(), beyond > 0)
                    << height;
                EXPECT_EQ(contacts(Shape2(chain), Pose2d{}, Shape2(), over2, margin).empty(), beyond > 0)
                    << height;
                if (margin > 0) continue;
                EXPECT_EQ(touching(Shape3(mesh), Pose3d{}, Shape3(), over), beyond == 0) << height;
                EXPECT_EQ(touching(Shape2(chain), Pose2d{}, Shape2(), over2), beyond == 0) << height;
            }
    const Mesh<3> triangle(std::vector<Vec3d>{{-1, 0, -1}, {1, 0, -1}, {0, 0, 2}},
                           std::vector<Mesh<3>::Element>{{0, 1, 2}});
    const Mesh<2> segment(std::vector<Point>{{-1, 0}, {1, 0}}, std::vector<Mesh<2>::Element>{{0, 1}});
    EXPECT_TRUE(touching(Shape3(triangle), Pose3d{}, Shape3(), Pose3d{}));
    EXPECT_TRUE(touching(Shape2(segment), Pose2d{}, Shape2(), Pose2d{}));
}

/// Half a contact's depth from its point, along the normal, is the mesh's surface: a point of the triangle
/// that the contact names, but for what the sides of a capsule may be tilted.
TEST(AMesh, IsTouchedByBallsAndCapsulesWhereItsTrianglesAre)
{
    Random random(78);
    int points = 0;
    for (int round = 0; round < 60; ++round) {
        std::vector<Vec3d> vertices;
        for (int i = 0; i < 16; ++i)
            vertices.push_back({0.7 * (i / 4) - 1, random.uniform(-0.2, 0.2), 0.7 * (i % 4) - 1});
        std::vector<Mesh<3>::Element> triangles;
        for (const std::uint32_t i : {0u, 1u, 2u, 4u, 5u, 6u, 8u, 9u, 10u}) {
            triangles.push_back({i, i + 1, i + 4});
            triangles.push_back({i + 1, i + 5, i + 4});
        }
        const Mesh<3> mesh(vertices, triangles);
        for (int k = 0; k < 100; ++k) {
            const double radius = random.uniform(0.1, 1);
            const Shape3 body =
                k % 3 == 0 ? Shape3::sphere(radius) : Shape3::capsule(random.uniform(0.1, 1), radius);
            const Pose3d pose = random.pose<double>(1);
            for (const auto& contact : all_contacts(body, pose, Shape3(mesh), Pose3d{})) {
                const auto& corners = triangles[contact.part_b];
                const Mesh<3> triangle(
                    std::vector<Vec3d>{vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]},
                    std::vector<Mesh<3>::Element>{{0, 1, 2}});
                for (std::uint32_t i = 0; i < contact.count; ++i, ++points) {
                    Pose3d at;
                    for (std::size_t d = 0; d < 3; ++d)
                        at.position[d] = pose.position[d] + contact.point[i].from_a[d] -
                                         contact.normal[d] * contact.point[i].depth / 2;
                    ASSERT_LE(distance(Shape3(triangle), Pose3d{}, Shape3(), at, INFINITY)->distance,
                              k % 3 == 0 ? 1e-6 : 0.02)
                        << k;
                }
            }
        }
    }
    EXPECT_GT(points, 5000);
}

/// A mesh has two sides and no inside: a body is pushed out as it would be if the triangles ran the other
/// way.
TEST(AMesh, PushesTheSameWhicheverWayItsTrianglesRun)
{
    Random random(12);
    int from_behind = 0, pieces = 0;
    for (const double bumps : {0.0, 0.05, 0.4, 2.0}) {
        const Terrain terrain(9, 9, bumps);
        auto reversed = terrain.triangles;
        for (auto& triangle : reversed)
            std::swap(triangle[1], triangle[2]);
        const Mesh<3> one(terrain.vertices, terrain.triangles), other(terrain.vertices, reversed);
        for (const Shape3& shape : movers())
            for (int round = 0; round < 150; ++round) {
                Pose3d pose; // nowhere as deep from one side as from the other, where either way out would do
                pose.rotation = random.rotation<double>();
                pose.position = {random.uniform(3, 5), random.uniform(-0.7, 0.7), random.uniform(3, 5)};
                for (const double margin : {0.0, 0.2}) {
                    const auto found = contacts(Shape3(one), Pose3d{}, shape, pose, margin);
                    const auto again = contacts(Shape3(other), Pose3d{}, shape, pose, margin);
                    ASSERT_EQ(found.size(), again.size()) << bumps << ", round " << round;
                    for (std::size_t i = 0; i < found.size(); ++i) {
                        ASSERT_EQ(found[i].part_a, again[i].part_a);
                        for (std::size_t d = 0; d < 3; ++d)
                            ASSERT_NEAR(found[i].normal[d], again[i].normal[d], 1e-7);
                        ASSERT_NEAR(found[i].point[0].depth, again[i].point[0].depth, 1e-7);
                        from_behind += found[i].normal[1] < -0.5 ? 1 : 0;
                        pieces += found[i].count > 1 ? 1 : 0;
                    }
                }
            }
    }
    EXPECT_GT(from_behind, 300);
    EXPECT_GT(pieces, 300);
}

// Where a surface bends by less than a degree, a triangle leaves what touches its sides to its neighbour;
// where it bends upwards, neither has it over itself.
TEST(ASurface, HoldsWhatTouchesItHoweverGentlyItBends)
{
    for (const double k : {0.0003, 0.001, 0.004, 0.01, 0.1}) {
        Terrain dome(7, 7, 0);
        for (std::uint32_t z = 0; z < 7; ++z)
            for (std::uint32_t x = 0; x < 7; ++x)
                dome.vertices[z * 7 + x][1] = dome.heights[z * 7 + x] =
                    -k * ((x - 3.0) * (x - 3.0) + (z - 3.0) * (z - 3.0));
        const Mesh<3> mesh(dome.vertices, dome.triangles);
        const HeightField field(HeightGrid<double>{dome.heights, 7, 7, 1, 1});
        for (const Shape3& ground : {Shape3(mesh), Shape3(field)})
            for (const Shape3& shape : movers())
                for (int x = 8; x <= 40; ++x)
                    for (int z = 8; z <= 40; z += 2)
                        for (const double height : {0.05, 0.1, 0.2}) {
                            const Pose3d pose{{x / 8.0, height, z / 8.0}, {0, 0, 0, 1}};
                            const auto gap = distance(ground, Pose3d{}, shape, pose, 1.0);
                            if (!gap || gap->distance > -1e-9) continue;
                            ASSERT_FALSE(contacts(ground, Pose3d{}, shape, pose).empty())
                                << k << " at " << x << " " << z << " " << height << ": " << gap->distance;
                        }
        using Point = Vec<2, double>;
        const Mesh<2> chain(std::vector<Point>{{-1, 0}, {0, k}, {1, 0}},
                            std::vector<Mesh<2>::Element>{{1, 0}, {2, 1}});
        for (int x = -50; x <= 50; ++x)
            for (const double height : {0.05, 0.1, 0.2}) {
                const Pose2d pose{{x * 0.001, k + height}};
                const Shape2 circle = Shape2::sphere(0.3);
                ASSERT_TRUE(touching(Shape2(chain), Pose2d{}, circle, pose));
                ASSERT_FALSE(contacts(Shape2(chain), Pose2d{}, circle, pose).empty()) << k << " " << x;
            }
    }
}

TEST(ASurface, HoldsThinBodiesThatAreSunkInTilted)
{
    const Terrain terrain(7, 7, 0);
    const Mesh<3> mesh(terrain.vertices, terrain.triangles);
    Random random(11);
    for (const Vec<3, double>& half : {Vec<3, double>{0.5, 0.02, 0.5}, {0.1, 0.1, 0.5}, {0.5, 0.1, 0.5}}) {
        const Shape3 box = Shape3::box(half);
        for (int round = 0; round < 1500; ++round) {
            Pose3d pose;
            pose.rotation = random.rotation<double>();
            pose.position = {random.uniform(2, 4), 0, random.uniform(2, 4)};
            const double sunk = random.uniform(0.01, 0.2);
            pose.position[1] = -bounds(box, pose).lo[1] - sunk;
            if (!touching(Shape3(mesh), Pose3d{}, box, pose)) continue;
            const auto found = contacts(Shape3(mesh), Pose3d{}, box, pose);
            ASSERT_FALSE(found.empty()) << round;
            for (const auto& contact : found)
                for (std::uint32_t i = 0; i < contact.count; ++i)
                    ASSERT_LE(contact.point[i].depth, 1.5);
        }
    }
}

TEST(AHeightField, IsSolidDownToItsThickness)
{
    const Terrain terrain(12, 12, 0);
    const HeightGrid<double> thin{terrain.heights, terrain.columns, terrain.rows, 1, 1}; // a cell: 1
    HeightGrid<double> thick = thin;
    thick.thickness = 5;
    const HeightField fields[] = {HeightField(thin), HeightField(thick)};
    for (const Shape3& shape : movers())
        for (const double depth : {0.8, 2.5, 4.0, 7.0}) {
            const Pose3d pose{{5.3, -depth, 5.4}, {0, 0, 0, 1}};
            for (const HeightField& field : fields) {
                const double reaches = &field == fields ? 1 : 5; // below height 0
                const auto found = contacts(Shape3(field), Pose3d{}, shape, pose);
                const auto box = bounds(Shape3(field), Pose3d{});
                EXPECT_NEAR(box.lo[1], -reaches, 1e-12);
                if (depth > reaches + 1) { // none of the shapes is that tall
                    EXPECT_TRUE(found.empty()) << depth;
                    continue;
                }
                if (depth > reaches) continue;
                ASSERT_FALSE(found.empty()) << depth;
                for (const auto& contact : found) {
                    EXPECT_NEAR(contact.normal[1], 1, 1e-9);
                    EXPECT_GE(contact.point[0].depth, depth);
                }
            }
        }
}

TEST(AHeightField, IsItsTrianglesFromAboveAndPushesUpFromBelow)
{
    const Terrain terrain(10, 9, 0.3);
    const Mesh<3> mesh(terrain.vertices, terrain.triangles);
    const HeightField field(HeightGrid<double>{terrain.heights, terrain.columns, terrain.rows, 1, 1});
    Random random(3);
    for (const Shape3& shape : movers())
        for (int round = 0; round < 200; ++round) {
            Pose3d pose;
            pose.rotation = random.rotation<double>();
            pose.position = {random.uniform(2, 7), 5, random.uniform(2, 6)};
            const auto above = distance(Shape3(field), Pose3d{}, shape, pose, 1e300);
            ASSERT_TRUE(above);
            ASSERT_NEAR(above->distance, distance(Shape3(mesh), Pose3d{}, shape, pose, 1e300)->distance,
                        1e-9);
            for (int step = 0; step < 50; ++step) // down to a depth of about 0.01, whatever the slope
                pose.position[1] -=
                    std::max(0.0, distance(Shape3(field), Pose3d{}, shape, pose, 1e300)->distance + 0.01);
            ASSERT_FALSE(contacts(Shape3(field), Pose3d{}, shape, pose).empty());
            // Sunk in to its middle and beyond.
            pose.position[1] = random.uniform(-0.4, -0.25);
            const auto sunk = contacts(Shape3(field), Pose3d{}, shape, pose);
            ASSERT_FALSE(sunk.empty()) << round;
            for (const auto& contact : sunk)
                ASSERT_GT(contact.normal[1], 0) << round;
        }
}

/// However steep it is: over it, beside its rim, among its peaks and below.
TEST(AHeightField, PushesNothingDown)
{
    Random random(13);
    int found_any = 0, steep = 0;
    for (const double bumps : {0.3, 3.0, 10.0}) {
        const Terrain terrain(6, 5, bumps);
        const HeightField field(HeightGrid<double>{terrain.heights, 6, 5, 1, 1});
        for (const Shape3& shape : movers())
            for (int round = 0; round < 1500; ++round) {
                Pose3d pose;
                pose.rotation = random.rotation<double>();
                pose.position = {random.uniform(-0.6, 5.6), random.uniform(-bumps, bumps),
                                 random.uniform(-0.6, 4.6)};
                if (random.chance(0.5)) { // beside a rim, near its own height
                    const std::uint32_t z = random.below(5);
                    pose.position = {random.uniform(-0.4, 0), 0, z + random.uniform(-0.1, 0.1)};
                    pose.position[1] = terrain.heights[std::size_t{6} * z] + random.uniform(-0.5, 0.3);
                }
                for (const double margin : {0.0, 0.3})
                    for (const auto& contact : contacts(Shape3(field), Pose3d{}, shape, pose, margin)) {
                        ASSERT_GT(contact.normal[1], 0) << "bumps of " << bumps << ", round " << round;
                        ++found_any;
                        steep += contact.normal[1] < 0.3 ? 1 : 0;
                    }
            }
    }
    EXPECT_GT(found_any, 1000);
    EXPECT_GT(steep, 300);
}

/// One rotation after another, as quaternions.
std::array<double, 4> after(const std::array<double, 4>& p, const std::array<double, 4>& q)
{
    return {p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1],
            p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0],
            p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3],
            p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2]};
}

// Bodies whose centres are just over the rim, and upright ones, which stand beside what is next to them at
// right angles to it: rounding must not decide.
TEST(AHeightField, IsTheSameAtItsRimHoweverItIsTurned)
{
    Random random(47);
    int over = 0, beside = 0;
    for (int round = 0; round < 6000; ++round) {
        const bool upright = round % 3 == 0;
        std::vector<double> heights(4);
        for (double& height : heights)
            height = upright ? random.uniform(0, 1) : 0.1 * random.below(11);
        const HeightField field(HeightGrid<double>{heights, 2, 2, 1, 1, 1});
        const Shape3 box =
            round % 2 == 0 ? Shape3::box({0.6, 0.8, 0.7}) : Shape3::rounded_box({0.3, 0.5, 0.4}, 0.3);
        const auto small = [&] { return static_cast<int>(random.below(5)) - 2; };
        const std::array<double, 4> own =
            upright ? std::array<double, 4>{0, 0, 0, 1}
                    : std::array<double, 4>{1.0 * small(), 1.0 * small(), 1.0 * small(), 1};
        // 0.13 keeps what overlaps from just touching.
        const Vec3d centre =
            upright ? Vec3d{random.uniform(-1, 2), random.uniform(-2, 2), random.uniform(-1, 2)}
                    : Vec3d{1.0 * random.below(2), 0.1 * static_cast<int>(random.below(41)) - 2.13,
                            0.01 * random.below(101)};
        bool touched = false;
        for (int turn = 0; turn < 20; ++turn) {
            const auto rotation = turn == 0 ? std::array<double, 4>{0, 0, 0, 1} : random.rotation<double>();
            const Vec3 there = narrow::rotation(Pose3d{{}, rotation}) * narrow::load(centre);
            const Pose3d pose{{there.x, there.y, there.z}, after(rotation, own)};
            const bool touches = touching(Shape3(field), Pose3d{{}, rotation}, box, pose);
            if (turn == 0) touched = touches;
            ASSERT_EQ(touches, touched) << round << " turned " << turn;
            EXPECT_EQ(contacts(Shape3(field), Pose3d{{}, rotation}, box, pose).empty(), !touched) << round;
        }
        touched ? ++over : ++beside;
    }
    EXPECT_GT(over, 1000);
    EXPECT_GT(beside, 200);
}

// What is below is pushed up by the triangle over its centre, which stays when it turns about its own axis.
TEST(AHeightField, PushesUpRoundBodiesTheSameHoweverTheySpin)
{
    Random random(53);
    const Terrain terrain(10, 9, 0.8);
    const HeightField field(HeightGrid<double>{terrain.heights, terrain.columns, terrain.rows, 1, 1, 5});
    for (const Shape3& shape :
         {Shape3::cylinder(0.4, 0.9), Shape3::cone(0.4, 0.9), Shape3::ellipsoid({0.5, 0.8, 0.5})})
        for (int round = 0; round < 200; ++round) {
            const Vec3d position{random.uniform(2, 7), random.uniform(-4, -3), random.uniform(2, 6)};
            const auto rotation = random.rotation<double>();
            const auto still = distance(Shape3(field), Pose3d{}, shape, Pose3d{position, rotation}, 1e300);
            ASSERT_TRUE(still && still->distance < 0);
            for (int spin = 0; spin < 10; ++spin) {
                const double half = random.uniform(0, 3);
                const Pose3d turned{position, after(rotation, {0, std::sin(half), 0, std::cos(half)})};
                const auto gap = distance(Shape3(field), Pose3d{}, shape, turned, 1e300);
                ASSERT_TRUE(gap);
                ASSERT_NEAR(gap->distance, still->distance, 1e-9) << round << " turned by " << 2 * half;
            }
        }
}

TEST(AHeightField, TouchesAHalfSpaceThatOneOfItsHeightsIsIn)
{
    const Terrain terrain(9, 7, 0.5);
    const HeightField field(HeightGrid<double>{terrain.heights, 9, 7, 1, 1, 0});
    const Shape3 ground(field);
    Random random(11);
    int touch = 0, apart = 0;
    for (int round = 0; round < 2000; ++round) {
        SCOPED_TRACE(round);
        Vec<3, double> normal{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
        if (random.chance(0.3)) normal[random.below(3)] = 0;
        const Vec3 n = narrow::load(normal) * (1 / length(narrow::load(normal)));
        double least = HUGE_VAL;
        for (const auto& v : terrain.vertices)
            least = std::min(least, dot(n, narrow::load(v)));
        const double expected = random.uniform(-1, 1);
        const Shape3 below = Shape3::half_space(normal, least - expected);
        ASSERT_EQ(touching(ground, Pose3d{}, below, Pose3d{}), expected <= 0);
        ASSERT_EQ(touching(below, Pose3d{}, ground, Pose3d{}), expected <= 0);
        (expected <= 0 ? touch : apart) += 1;
        const auto gap = distance(ground, Pose3d{}, below, Pose3d{}, 1e300);
        ASSERT_TRUE(gap.has_value());
        ASSERT_NEAR(gap->distance, expected, 1e-12);
    }
    EXPECT_GT(touch, 500);
    EXPECT_GT(apart, 500);
}

TEST(ATriangle, PushesABoxOutAcrossAnyAxisFromEitherSide)
{
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const double side : {1.0, -1.0}) {
            SCOPED_TRACE(testing::Message() << "axis " << axis << ", side " << side);
            const std::size_t u = (axis + 1) % 3, w = (axis + 2) % 3;
            std::vector<Vec<3, double>> corners(3);
            corners[0][u] = corners[0][w] = corners[1][w] = corners[2][u] = -9;
            corners[1][u] = corners[2][w] = 9;
            const Mesh<3> triangle(corners, std::vector<Mesh<3>::Element>{{0, 1, 2}});
            Pose3d pose;
            pose.position[axis] = side * 0.9;
            pose.position[u] = pose.position[w] = -3;
            const auto found = contacts(Shape3(triangle), Pose3d{}, Shape3::box({1, 1, 1}), pose);
            ASSERT_EQ(found.size(), 1u);
            ASSERT_EQ(found[0].count, 4u);
            for (std::size_t d = 0; d < 3; ++d)
                EXPECT_NEAR(found[0].normal[d], d == axis ? side : 0, 1e-12);
            for (std::uint32_t i = 0; i < 4; ++i) {
                EXPECT_NEAR(found[0].point[i].depth, 0.1, 1e-12);
                EXPECT_NEAR(found[0].point[i].from_a[axis], -side * 0.05, 1e-12);
                EXPECT_NEAR(std::abs(found[0].point[i].from_a[u] + 3), 1, 1e-12);
                EXPECT_NEAR(std::abs(found[0].point[i].from_a[w] + 3), 1, 1e-12);
            }
        }
}

TEST(ATriangle, ThatPokesABoxWithACornerIsPushedBackAcrossTheFaceThatItComesThrough)
{
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const double side : {1.0, -1.0}) {
            SCOPED_TRACE(testing::Message() << "axis " << axis << ", side " << side);
            const std::size_t u = (axis + 1) % 3, w = (axis + 2) % 3;
            std::vector<Vec<3, double>> corners(3);
            corners[0][axis] = 0.9 * side;
            corners[1][axis] = corners[2][axis] = 3 * side;
            corners[1][u] = 0.5, corners[1][w] = 0.3;
            corners[2][u] = -0.4, corners[2][w] = 0.2;
            const Mesh<3> triangle(corners, std::vector<Mesh<3>::Element>{{0, 1, 2}});
            const auto found = contacts(Shape3(triangle), Pose3d{}, Shape3::box({1, 1, 1}), Pose3d{});
            ASSERT_EQ(found.size(), 1u);
            for (std::size_t d = 0; d < 3; ++d)
                EXPECT_NEAR(found[0].normal[d], d == axis ? -side : 0, 1e-12);
            EXPECT_NEAR(found[0].point[0].depth, 0.1, 1e-12);
        }
}

TEST(ACompound, IsItsChildren)
{
    Random random(4);
    for (int round = 0; round < 300; ++round) {
        std::vector<Compound<3>::Child> children;
        for (const Shape3& shape : movers())
            children.push_back({shape, random.pose<double>(1)});
        const Compound<3> compound(children);
        const Shape3 other = movers()[random.below(4)];
        const Pose3d pose = random.pose<double>(1.5);
        const auto found = contacts(Shape3(compound), Pose3d{}, other, pose);
        std::size_t next = 0;
        for (std::uint32_t child = 0; child < children.size(); ++child) {
            const auto alone = distance(children[child].shape, children[child].pose, other, pose, 10.0);
            if (!alone || alone->distance > 0) continue;
            ASSERT_LT(next, found.size());
            ASSERT_EQ(found[next].part_a, child);
            ASSERT_NEAR(found[next].point[0].depth, -alone->distance, 1e-9);
            ++next;
        }
        ASSERT_EQ(next, found.size());
    }
}

/// Each child of a compound touches a surface as it does alone, whatever its brothers are.
template <int Dim>
void expect_each_child_as_alone(const Shape<Dim>& surface,
                                const std::vector<typename Compound<Dim>::Child>& children, double margin)
{
    const Compound<Dim> compound(children);
    std::vector<std::vector<Contact<Dim, double>>> found(children.size());
    for (const auto& contact :
         contacts(surface, Pose<Dim, double>{}, Shape<Dim>(compound), Pose<Dim, double>{}, margin))
        found[contact.part_b].push_back(contact);
    for (std::size_t child = 0; child < children.size(); ++child) {
        const auto alone =
            contacts(surface, Pose<Dim, double>{}, children[child].shape, children[child].pose, margin);
        ASSERT_EQ(found[child].size(), alone.size()) << "child " << child;
        for (std::size_t i = 0; i < alone.size(); ++i) {
            ASSERT_EQ(found[child][i].part_a, alone[i].part_a) << "child " << child;
            ASSERT_EQ(found[child][i].count, alone[i].count) << "child " << child;
            ASSERT_NEAR(found[child][i].point[0].depth, alone[i].point[0].depth, 1e-9) << "child " << child;
        }
    }
}

TEST(ACompound, LiesOnASurfaceAsItsChildrenInAnyOrderDo)
{
    const Terrain flat(7, 7, 0);
    const Mesh<3> mesh(flat.vertices, flat.triangles);
    const HeightField field(HeightGrid<double>{flat.heights, flat.columns, flat.rows, 1, 1});
    const std::vector<Mesh<2>::Element> segments{{1, 0}, {2, 1}};
    const Mesh<2> chain(std::vector<Vec<2, double>>{{0, 0}, {3, 0}, {6, 0}}, segments);
    const ConvexHull<2> triangle(std::vector<Vec<2, double>>{{-0.3, -0.3}, {0.4, -0.2}, {0, 0.4}});
    std::vector<Shape2> movers2{Shape2::sphere(0.3), Shape2::capsule(0.3, 0.2), Shape2::box({0.3, 0.2}),
                                triangle, Shape2::box({0.5, 0})};
    std::vector<Shape3> movers3 = movers();
    movers3.push_back(Shape3::box({0.5, 0, 0.5}));
    Random random(21);
    std::vector<std::size_t> order{0, 1, 2, 3, 4};
    do {
        std::vector<Compound<3>::Child> children;
        std::vector<Compound<2>::Child> children2;
        for (const std::size_t i : order) {
            children.push_back({movers3[i], random.pose<double>(1)});
            children2.push_back({movers2[i], random.pose2<double>(1)});
            children.back().pose.position = {random.uniform(1.5, 4.5), random.uniform(-0.1, 0.4),
                                             random.uniform(1.5, 4.5)};
            children2.back().pose.position = {random.uniform(1.5, 4.5), random.uniform(-0.1, 0.4)};
        }
        for (const double margin : {0.0, 0.2}) {
            ASSERT_NO_FATAL_FAILURE(expect_each_child_as_alone<3>(mesh, children, margin));
            ASSERT_NO_FATAL_FAILURE(expect_each_child_as_alone<3>(field, children, margin));
            ASSERT_NO_FATAL_FAILURE(expect_each_child_as_alone<2>(chain, children2, margin));
        }
    } while (std::next_permutation(order.begin(), order.end()));
}

} // namespace
