// SPDX-License-Identifier: MIT
// Elements of a surface that meet without sharing vertex numbers: they are joined where they coincide, so a
// mesh is the same as one with shared vertices, and a level floor pushes straight up, however it is cut.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "jostle/closed_mesh.hpp"
#include "tests/narrow/random_pairs.hpp"
#include "tests/narrow/samples.hpp"

using namespace jostle;
using namespace narrow_samples;

namespace {

using Triangles = std::vector<Mesh<3>::Element>;
using Point = Vec<2, double>;

struct Soup
{
    std::vector<Vec3d> vertices;
    Triangles triangles;
    void add(const Vec3d& p, const Vec3d& q, const Vec3d& r)
    {
        const auto n = static_cast<std::uint32_t>(vertices.size());
        vertices.insert(vertices.end(), {p, q, r});
        triangles.push_back({n, n + 1, n + 2});
    }
};

Soup apart(const std::vector<Vec3d>& vertices, const Triangles& triangles)
{
    Soup soup;
    for (const auto& t : triangles)
        soup.add(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    return soup;
}

void expect_equal(const std::vector<Contact<3, double>>& a, const std::vector<Contact<3, double>>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_EQ(a[i].part_a, b[i].part_a);
        ASSERT_EQ(a[i].normal, b[i].normal);
        ASSERT_EQ(a[i].count, b[i].count);
        for (std::uint32_t k = 0; k < a[i].count; ++k) {
            ASSERT_EQ(a[i].point[k].from_a, b[i].point[k].from_a);
            ASSERT_EQ(a[i].point[k].depth, b[i].point[k].depth);
            ASSERT_EQ(a[i].point[k].feature, b[i].point[k].feature);
        }
    }
}

TEST(AMesh, OfSeparateTrianglesIsThatOfSharedVertices)
{
    Random random(71);
    for (const double bumps : {0.0, 0.05, 0.5}) {
        const Terrain terrain(7, 7, bumps);
        const Soup soup = apart(terrain.vertices, terrain.triangles);
        const Mesh<3> one(terrain.vertices, terrain.triangles), other(soup.vertices, soup.triangles);
        for (const Shape3& shape : movers())
            for (int round = 0; round < 150; ++round) {
                Pose3d pose = random.pose<double>(0.2);
                pose.position = {random.uniform(1, 5), random.uniform(-0.2, 0.8), random.uniform(1, 5)};
                for (const double margin : {0.0, 0.2})
                    ASSERT_NO_FATAL_FAILURE(
                        expect_equal(contacts(Shape3(one), Pose3d{}, shape, pose, margin),
                                     contacts(Shape3(other), Pose3d{}, shape, pose, margin)))
                        << bumps << ", round " << round;
            }
    }
}

TEST(AMesh, OfTwoSeparateTrianglesHasTheContactOfOneFloor)
{
    const Mesh<3> mesh(
        std::vector<Vec3d>{{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {-0.0, 0, 0}, {1, -0.0, 1}, {1, 0, 0}},
        Triangles{{0, 1, 2}, {3, 4, 5}});
    const auto found = contacts(Shape3(mesh), Pose3d{}, Shape3::sphere(0.5), Pose3d{{0.3, 0.45, 0.5}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].normal[1], 1, 1e-12);
    EXPECT_EQ(found[0].part_a, 0u);
}

/// Rows of triangles, each cut where it pleases, so that corners lie on the sides of the next row; and
/// triangles without width between them.
Soup rows(Random& random, bool needles, double noise)
{
    Soup soup;
    const auto at = [&](double x, double z) {
        return Vec3d{x + random.uniform(-noise, noise), 0, z + random.uniform(-noise, noise)};
    };
    const auto cuts = [&] {
        std::vector<double> x{-3};
        while (x.back() < 3)
            x.push_back(std::min(3.0, x.back() + 0.25 * (1 + random.below(4))));
        return x;
    };
    for (int z = -3; z < 3; ++z) {
        const std::vector<double> below = cuts(), above = cuts();
        std::size_t i = 0, k = 0;
        while (i + 1 < below.size() || k + 1 < above.size()) {
            const bool first =
                k + 1 == above.size() || (i + 1 < below.size() && below[i + 1] <= above[k + 1]);
            const Vec3d p = at(below[i], z), q = at(above[k], z + 1);
            const Vec3d r = first ? at(below[++i], z) : at(above[++k], z + 1);
            random.chance(0.5) ? soup.add(p, q, r) : soup.add(q, p, r);
            const Vec3d& s = first ? p : q;
            if (needles && random.chance(0.7)) soup.add(s, {(s[0] + r[0]) / 2, 0, s[2]}, r);
            if (needles && random.chance(0.1)) soup.add(s, s, s);
        }
    }
    return soup;
}

void expect_only_up(const Mesh<3>& floor, Random& random, int count)
{
    for (int round = 0; round < count; ++round)
        for (const Shape3& shape : movers()) {
            Pose3d pose;
            pose.rotation = random.rotation<double>();
            pose.position = {random.uniform(-1.5, 1.5), 0, random.uniform(-1.5, 1.5)};
            pose.position[1] = -bounds(shape, pose).lo[1] - 0.01;
            for (const double margin : {0.0, 0.1}) {
                const auto found = contacts(Shape3(floor), Pose3d{}, shape, pose, margin);
                double most = -1;
                for (const auto& contact : found) {
                    ASSERT_NEAR(contact.normal[1], 1, 1e-9) << round << ": part " << contact.part_a;
                    most = std::max(most, contact.point[0].depth);
                }
                ASSERT_NEAR(most, 0.01, 1e-7) << round;
            }
        }
}

TEST(ALevelFloor, CatchesNothingWhereCornersLieOnSides)
{
    Random random(72);
    for (int round = 0; round < 30; ++round) {
        const Soup soup = rows(random, round % 2 == 1, 0);
        ASSERT_NO_FATAL_FAILURE(expect_only_up(Mesh<3>(soup.vertices, soup.triangles), random, 20)) << round;
    }
}

TEST(ALevelFloor, CatchesNothingOnANeedleBetweenItsTriangles)
{
    const std::vector<Vec3d> corners{{-2, 0, 0}, {2, 0, 0}, {0, 0, 3}, {0, 0, -3}, {0.4, 0, 0}};
    const Mesh<3> mesh(corners, Triangles{{0, 1, 2}, {0, 4, 1}, {0, 3, 4}, {4, 3, 1}});
    for (double x = -1.5; x < 1.5; x += 0.03)
        for (double z = -0.5; z < 0.5; z += 0.03) {
            const auto found = contacts(Shape3(mesh), Pose3d{}, Shape3::sphere(0.5), Pose3d{{x, 0.45, z}});
            ASSERT_FALSE(found.empty());
            for (const auto& contact : found)
                ASSERT_NEAR(contact.normal[1], 1, 1e-9) << x << " " << z << ": part " << contact.part_a;
        }
}

TEST(AMesh, WithoutAnyWidthHasContacts)
{
    const Mesh<3> line(std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, Triangles{{0, 1, 2}, {0, 0, 0}});
    EXPECT_FALSE(contacts(Shape3(line), Pose3d{}, Shape3::sphere(0.5), Pose3d{{1.2, 0.4, 0}}).empty());
    const Mesh<2> point(std::vector<Point>{{0, 0}}, std::vector<Mesh<2>::Element>{{0, 0}});
    EXPECT_FALSE(contacts(Shape2(point), Pose2d{}, Shape2::sphere(0.5), Pose2d{{0.1, 0.4}}).empty());
}

/// A triangle without width has contacts of its own where it leaves the one that its middle lies on.
TEST(AMesh, HasContactsWhereItTouches)
{
    Random random(73);
    int touch = 0;
    for (int round = 0; round < 30000; ++round) {
        std::vector<Vec3d> corners(5), others(3);
        for (auto* const points : {&corners, &others})
            for (Vec3d& p : *points)
                for (int d = 0; d < 3; ++d)
                    p[d] = 0.5 * random.below(5) - 1;
        const auto a = static_cast<std::uint32_t>(random.below(5)),
                   b = static_cast<std::uint32_t>(random.below(5));
        const Mesh<3> mesh(corners, Triangles{{0, 1, 2}, {a, b, random.chance(0.5) ? a : b}});
        const Mesh<3> other(others, Triangles{{0, 1, 2}});
        if (!touching(Shape3(mesh), Pose3d{}, Shape3(other), Pose3d{})) continue;
        ++touch;
        ASSERT_FALSE(contacts(Shape3(mesh), Pose3d{}, Shape3(other), Pose3d{}).empty()) << round;
    }
    EXPECT_GT(touch, 5000);
}

/// A side that nothing goes on beyond is one, also where others of the plane end.
TEST(ALevelFloor, StillHasABorder)
{
    Soup soup;
    soup.add({0, 0, 0}, {0, 0, 2}, {2, 0, 0});
    soup.add({0, 0, 0.5}, {-1, 0, 1}, {0, 0, 1}); // along a part of the side x = 0
    const Mesh<3> mesh(soup.vertices, soup.triangles);
    for (const double z : {0.2, 1.5}) {
        const auto found = contacts(Shape3(mesh), Pose3d{}, Shape3::sphere(0.1), Pose3d{{-0.07, 0.05, z}});
        ASSERT_EQ(found.size(), 1u) << z;
        EXPECT_NEAR(found[0].normal[0], -0.07 / std::hypot(0.07, 0.05), 1e-9) << z;
    }
    for (const auto& contact :
         contacts(Shape3(mesh), Pose3d{}, Shape3::sphere(0.1), Pose3d{{-0.07, 0.05, 0.8}}))
        EXPECT_NEAR(contact.normal[1], 1, 1e-9);
}

TEST(AMesh, IsWeldedWithinADistance)
{
    Random random(73);
    const Terrain terrain(8, 8, 0);
    for (int round = 0; round < 10; ++round) {
        Soup soup;
        const double noise = 1e-4;
        for (const auto& t : terrain.triangles) {
            Vec3d p[3];
            for (std::size_t i = 0; i < 3; ++i)
                p[i] = {terrain.vertices[t[i]][0] - 3.5 + random.uniform(-noise, noise), 0,
                        terrain.vertices[t[i]][2] - 3.5 + random.uniform(-noise, noise)};
            soup.add(p[0], p[1], p[2]);
        }
        ASSERT_NO_FATAL_FAILURE(expect_only_up(Mesh<3>(soup.vertices, soup.triangles, 3e-4), random, 20));
    }
}

/// From the definition: as vertices come, each stays unless one before it that stayed is near enough.
TEST(AMesh, WeldsToTheFirstThatStays)
{
    Random random(74);
    for (int round = 0; round < 100; ++round) {
        const double weld = random.uniform(0.01, 0.4);
        std::vector<Vec3d> points(60), moved;
        Triangles triangles;
        std::vector<std::uint32_t> stay;
        for (std::uint32_t v = 0; v < points.size(); ++v) {
            points[v] = {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
            if (random.chance(0.2)) points[v][random.below(3)] = weld * random.below(3);
            moved.push_back(points[v]);
            bool near = false;
            for (const std::uint32_t w : stay) {
                const Vec3d &p = points[v], &q = points[w];
                near = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) <= weld;
                if (near) moved[v] = q;
                if (near) break;
            }
            if (!near) stay.push_back(v);
            triangles.push_back({v, v, v}); // a point
        }
        const Mesh<3> welded(points, triangles, weld), wanted(moved, triangles);
        for (int k = 0; k < 30; ++k) {
            const Pose3d pose = random.pose<double>(1);
            const auto a = distance(Shape3(welded), Pose3d{}, Shape3(), pose, 10.0);
            const auto b = distance(Shape3(wanted), Pose3d{}, Shape3(), pose, 10.0);
            ASSERT_EQ(a->distance, b->distance) << round;
        }
    }
}

TEST(AMesh, RefusesToBeWeldedByNoLength)
{
    const std::vector<Vec3d> corners{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
    for (const double weld :
         {-1.0, -1e-300, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        EXPECT_THROW(Mesh<3>(corners, Triangles{{0, 1, 2}}, weld), Error) << weld;
    EXPECT_EQ(Mesh<3>(corners, Triangles{{0, 1, 2}}, 1e60).size(), 1u);
    EXPECT_EQ(Mesh<3>(corners, Triangles{{0, 1, 2}}, 5e-324).size(), 1u);
}

TEST(AChain, OfSeparateSegmentsCatchesNothingOnItsJoints)
{
    Random random(75);
    for (int round = 0; round < 3000; ++round) {
        SCOPED_TRACE(round);
        std::vector<Point> vertices;
        std::vector<Mesh<2>::Element> segments;
        for (double x = -4; x < 4;) {
            const double next = x + random.uniform(0.2, 1);
            const auto n = static_cast<std::uint32_t>(vertices.size());
            vertices.push_back({x, 0});
            vertices.push_back(
                {next + (round % 3 == 1 ? random.uniform(0, 0.4) : 0), 0}); // perhaps overlapping
            random.chance(0.5) ? segments.push_back({n, n + 1}) : segments.push_back({n + 1, n});
            if (round % 3 == 2) segments.push_back({n + 1, n + 1});
            x = next;
        }
        const Mesh<2> chain(vertices, segments);
        const ConvexHull<2> triangle(std::vector<Point>{{-0.3, -0.3}, {0.4, -0.2}, {0, 0.4}});
        for (const Shape2& shape :
             {Shape2::sphere(0.3), Shape2::capsule(0.3, 0.2), Shape2::box({0.3, 0.2}), Shape2(triangle)}) {
            Pose2d pose = random.pose2<double>(1);
            pose.position = {random.uniform(-2, 2), 0};
            pose.position[1] = -bounds(shape, pose).lo[1] - 0.01;
            double most = -1;
            for (const auto& contact : contacts(Shape2(chain), Pose2d{}, shape, pose)) {
                ASSERT_NEAR(contact.normal[1], 1, 1e-9) << contact.part_a;
                most = std::max(most, contact.point[0].depth);
            }
            ASSERT_LE(most, 0.01 + 1e-9);
            ASSERT_GE(most, 0.009); // the lowest corner may be beside what it leans over
        }
    }
}

} // namespace
