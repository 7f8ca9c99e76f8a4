// SPDX-License-Identifier: MIT
// Meshes, height fields, compounds, moving shapes, users' own shapes and tests, boxes of shapes, errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory_resource>

#include "narrow/math.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;
using narrow::Vec3;

namespace {

struct Terrain
{
    std::vector<Vec<3, double>> vertices;
    std::vector<Mesh<3>::Element> triangles;
    std::vector<double> heights;
    std::uint32_t columns, rows;

    Terrain(std::uint32_t x, std::uint32_t z, double bumps) : columns(x), rows(z)
    {
        Random random(7);
        for (std::uint32_t k = 0; k < z; ++k)
            for (std::uint32_t i = 0; i < x; ++i) {
                heights.push_back(random.uniform(-bumps, bumps));
                vertices.push_back({i * 1.0, heights.back(), k * 1.0});
            }
        for (std::uint32_t k = 0; k + 1 < z; ++k)
            for (std::uint32_t i = 0; i + 1 < x; ++i) { // as a height field's cells
                const std::uint32_t at = k * x + i;
                triangles.push_back({at, at + x + 1, at + 1});
                triangles.push_back({at, at + x, at + x + 1});
            }
    }
};

std::vector<Shape3> movers()
{
    static const ConvexHull<3> hull(std::vector<Vec<3, double>>{
        {0.4, 0, 0}, {-0.4, 0, 0}, {0, 0.4, 0}, {0, -0.4, 0}, {0, 0, 0.4}, {0, 0, -0.4}, {0.3, 0.3, 0.3}});
    return {Shape3::sphere(0.3), Shape3::capsule(0.3, 0.2), Shape3::box({0.3, 0.2, 0.4}), hull};
}

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

/// A ball, as a user would write one.
class Ball final : public CustomShape<3>
{
  public:
    explicit Ball(double radius) : radius_(radius) {}
    double radius() const noexcept override { return radius_; }
    Vec<3, double> support(const Vec<3, double>& d) const noexcept override
    {
        const double size = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        return {d[0] * radius_ / size, d[1] * radius_ / size, d[2] * radius_ / size};
    }

  private:
    double radius_;
};
class Disc final : public CustomShape<2>
{
  public:
    double radius() const noexcept override { return 0.5; }
    Vec<2, double> support(const Vec<2, double>& d) const noexcept override
    {
        const double size = std::sqrt(d[0] * d[0] + d[1] * d[1]);
        return {d[0] * 0.5 / size, d[1] * 0.5 / size};
    }
};

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
        const Shape3& other = zoo.shapes[8 * random.below(10) + 2 + random.below(2)]; // a box or a hull
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
    const auto found = finder.find(shapes, poses, std::span<const Pair>(pairs)).to_vector();
    EXPECT_EQ(asked, 3);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].pair, (Pair{0, 1}));
    EXPECT_EQ(found[0].normal[1], -1);
    EXPECT_EQ(found[1].normal[1], 1);
    EXPECT_EQ(found[1].point[0].from_a[1], 1);
    EXPECT_NEAR(found[1].point[0].from_b[1], -0.4, 1e-6);
    EXPECT_EQ(found[0].point[0].from_b, found[1].point[0].from_a);
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
                        finder.find(shapes, poses, pairs);
                    else
                        finder.touching(shapes, poses, pairs, touch);
                } catch (const Error& error) {
                    refused +=
                        std::string(error.what()).find("this ContactFinder is in the middle of another") == 0;
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
    EXPECT_EQ(again.finder.find(again.shapes, again.poses, again.pairs).size(), 1u);
    EXPECT_EQ(again.refused, 4);
    EXPECT_EQ(again.finder.find(again.shapes, again.poses, again.pairs).size(), 1u); // no longer in use
    EXPECT_EQ(again.refused, 8);
}

TEST(Bounds, OfContainers)
{
    const std::vector<Shape3> shapes = {Shape3::sphere(1), Shape3::box({1, 2, 3})};
    const std::array<Pose3f, 2> poses = {Pose3f{{5, 0, 0}}, Pose3f{}};
    std::vector<Aabb3f> boxes(2);
    bounds(shapes, poses, boxes, 0.5);
    for (std::size_t i = 0; i < 2; ++i) {
        const Aabb3f one = bounds(shapes[i], poses[i], 0.5f);
        for (std::size_t d = 0; d < 3; ++d) {
            EXPECT_EQ(boxes[i].lo[d], one.lo[d]);
            EXPECT_EQ(boxes[i].hi[d], one.hi[d]);
        }
    }
    EXPECT_THROW(bounds(shapes, poses, boxes, -0.5), Error);
    boxes.resize(3);
    EXPECT_THROW(bounds(shapes, poses, boxes), Error);
}

TEST(Bounds, OfAnInvalidPoseAreNaN)
{
    Random random(12);
    const Zoo<3> zoo(random, 1);
    const Zoo<2> zoo2(random, 1);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinite = HUGE_VAL;
    const auto is_nan = [](const auto& box) {
        for (const double x : box.lo)
            if (!std::isnan(x)) return false;
        for (const double x : box.hi)
            if (!std::isnan(x)) return false;
        return true;
    };
    for (const double bad : {nan, infinite, 0.0}) {
        for (const Shape3& shape : zoo.shapes) {
            EXPECT_TRUE(is_nan(bounds(shape, Pose3d{{1, 2, 3}, {bad, 0, 0, bad}}))) << shape.type();
            if (bad != 0) {
                EXPECT_TRUE(is_nan(bounds(shape, Pose3d{{1, bad, 3}}))) << shape.type();
            }
        }
        for (const Shape2& shape : zoo2.shapes)
            EXPECT_TRUE(is_nan(bounds(shape, Pose2d{{1, 2}, {bad, bad}}))) << shape.type();
    }
    EXPECT_FALSE(is_nan(bounds(zoo.shapes[0], Pose3d{{1, 2, 3}, {0, 0, 0, 9}})));
}

TEST(Bounds, OfAHalfSpaceEndAtAPlaneAcrossAnAxis)
{
    const Aabb3d level = bounds(Shape3::half_space({0, 2, 0}, 3), Pose3d{{0, 1, 0}});
    EXPECT_NEAR(level.hi[1], 4, 1e-12);
    EXPECT_GE(level.hi[1], 4);
    EXPECT_EQ(level.lo[1], -HUGE_VAL);
    EXPECT_EQ(level.hi[0], HUGE_VAL);
    EXPECT_EQ(bounds(Shape3::half_space({0, 1, 0.1}, 3), Pose3d{}).hi[1], HUGE_VAL);
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const double sign : {1.0, -1.0})
            for (const double offset : {3.0, -3.0}) {
                Vec<3, double> normal{};
                normal[axis] = 2 * sign;
                const Aabb3d box = bounds(Shape3::half_space(normal, offset), Pose3d{{5, 6, 7}});
                for (std::size_t d = 0; d < 3; ++d) {
                    const double plane = 5.0 + static_cast<double>(d) + sign * offset;
                    if (d == axis && sign > 0) {
                        EXPECT_NEAR(box.hi[d], plane, 1e-12);
                        EXPECT_GE(box.hi[d], plane);
                    } else {
                        EXPECT_EQ(box.hi[d], HUGE_VAL);
                    }
                    if (d == axis && sign < 0) {
                        EXPECT_NEAR(box.lo[d], plane, 1e-12);
                        EXPECT_LE(box.lo[d], plane);
                    } else {
                        EXPECT_EQ(box.lo[d], -HUGE_VAL);
                    }
                }
                if (axis > 1) continue;
                const Aabb2d flat =
                    bounds(Shape2::half_space({normal[0], normal[1]}, offset), Pose2d{{5, 6}});
                for (std::size_t d = 0; d < 2; ++d) {
                    const double plane = 5.0 + static_cast<double>(d) + sign * offset;
                    EXPECT_NEAR(d == axis && sign > 0 ? flat.hi[d] : plane, plane, 1e-12);
                    EXPECT_NEAR(d == axis && sign < 0 ? flat.lo[d] : plane, plane, 1e-12);
                    EXPECT_EQ(flat.hi[d] == HUGE_VAL, d != axis || sign < 0);
                    EXPECT_EQ(flat.lo[d] == -HUGE_VAL, d != axis || sign > 0);
                }
            }
}

TEST(Bounds, AreTightAndHoldEveryPoint)
{
    Random random(8);
    const Zoo<3> zoo(random, 3);
    for (const Shape3& shape : zoo.shapes) {
        if (shape.type() == ShapeTypes::half_space) continue;
        for (int round = 0; round < 20; ++round) {
            const Pose3f pose = random.pose<float>(3);
            const Aabb3f box = bounds(shape, pose);
            for (std::size_t d = 0; d < 3; ++d)
                for (const bool upper : {false, true}) {
                    // The half-space that begins at the box's side touches the shape, one a bit further
                    // doesn't.
                    Vec<3, double> normal{};
                    normal[d] = upper ? -1 : 1;
                    const double side = double{upper ? box.hi[d] : box.lo[d]};
                    Pose3d exact;
                    for (std::size_t k = 0; k < 3; ++k)
                        exact.position[k] = double{pose.position[k]};
                    for (std::size_t k = 0; k < 4; ++k)
                        exact.rotation[k] = double{pose.rotation[k]};
                    const auto gap =
                        distance(Shape3::half_space(normal, normal[d] * side), Pose3d{}, shape, exact, 1e300);
                    ASSERT_TRUE(gap);
                    ASSERT_GE(gap->distance, 0);
                    if (shape.type() == ShapeTypes::height_field) continue; // its box holds the ground, too
                    ASSERT_LE(gap->distance, 2e-6);
                }
        }
    }
}

template <class Call>
std::string message_of(Call call)
{
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

TEST(Bounds, OfAHeightFieldReachDownToItsFloor)
{
    const std::vector<double> heights{1, 2, 3, 4};
    const HeightField field(HeightGrid<double>{heights, 2, 2, 5, 7, 9});
    const Aabb<3, double> box = bounds(Shape3(field), Pose3d{});
    const double lo[3] = {0, -8, 0}, hi[3] = {5, 4, 7};
    for (int d = 0; d < 3; ++d) {
        EXPECT_NEAR(box.lo[d], lo[d], 1e-12) << d;
        EXPECT_NEAR(box.hi[d], hi[d], 1e-12) << d;
    }
}

TEST(Errors, OfWhatIsZeroTooMuchOrInTheWrongPlace)
{
    const std::string none = "no error";
    const Pose3d here;
    Pose3d unturned;
    unturned.rotation = {0, 0, 0, 0};
    const Shape3 ball = Shape3::sphere(1);
    EXPECT_NE(message_of([&] { (void)touching(ball, unturned, ball, here); }), none);
    EXPECT_NE(message_of([&] { (void)touching(ball, here, ball, unturned); }), none);
    EXPECT_EQ(message_of([&] { (void)touching(ball, here, ball, here); }), none);
    EXPECT_NE(message_of([&] {
                  (void)time_of_impact(ball, Motion<3, double>{}, ball, Motion<3, double>{}, 0.0);
              }).find("a length above 0"),
              std::string::npos);

    const std::vector<double> heights(10, 1.0); // for 3 x 3
    EXPECT_NE(message_of([&] { HeightField(HeightGrid<double>{heights, 3, 3, 1, 1}); }), none);
    EXPECT_NE(message_of([&] { HeightField(HeightGrid<double>{std::span(heights).first(8), 3, 3, 1, 1}); }),
              none);
    EXPECT_EQ(message_of([&] { HeightField(HeightGrid<double>{std::span(heights).first(9), 3, 3, 1, 1}); }),
              none);

    const std::vector<Compound<3>::Child> one{{ball, here}};
    const Compound<3> inner(one);
    const std::vector<Compound<3>::Child> nested{{ball, here}, {Shape3(inner), here}};
    EXPECT_NE(message_of([&] { Compound<3>{nested}; }), none);

    const Ball own(1);
    EXPECT_NE(message_of([&] { (void)Shape3(own, ShapeTypes::half_space); }), none);
    EXPECT_NE(message_of([&] { (void)Shape3(own, ShapeTypes::first_custom - 1); }), none);
    EXPECT_EQ(message_of([&] { (void)Shape3(own, ShapeTypes::first_custom); }), none);

    const std::vector<Shape3> shapes(2);
    const std::vector<Pose3d> poses(2);
    for (const std::size_t size : {1, 3}) {
        std::vector<Aabb<3, double>> out(size);
        EXPECT_NE(message_of([&] { bounds(shapes, poses, out); }), none) << size;
    }
}

TEST(Errors, NameTheObjectAndTheValue)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(message_of([] { (void)Shape3::sphere(-1); }).find("-1"), std::string::npos);
    EXPECT_NE(
        message_of([] { (void)Mesh<3>(std::vector<Vec<3, double>>{{}}, {}); }).find("mesh of no elements"),
        std::string::npos);
    for (const bool two_sets : {false, true}) {
        const std::string itself = message_of([two_sets] {
            const std::vector<Shape3> shapes(2);
            const std::vector<Pose3d> poses(2), other(2);
            const std::vector<Pair> pairs{{0, 1}, {1, 1}};
            ContactFinder3d finder;
            if (two_sets) {
                EXPECT_EQ(finder.find(shapes, poses, shapes, other, pairs).size(), 2u);
            }
            finder.find(shapes, poses, pairs);
        });
        EXPECT_NE(itself.find("pair 1 is of object 1 and itself"), std::string::npos) << itself;
    }
    EXPECT_NE(message_of([] { (void)Shape3::sphere(-1e-9); }).find("is -1e-09;"), std::string::npos);
    EXPECT_NE(message_of([] { (void)Shape3::box({1, 1e61, 1}); }).find("is 1e+61;"), std::string::npos);
    EXPECT_NE(message_of([] { (void)bounds(Shape3(), Pose3f{}, -5.0f); }).find("margin of bounds is -5;"),
              std::string::npos);
    EXPECT_NE(message_of([&] { (void)bounds(Shape2(), Pose2f{}, nan); }).find("nan"), std::string::npos);
    EXPECT_NE(message_of([] { (void)Shape3::half_space({0, 0, 0}, 1); }).find("normal"), std::string::npos);
    EXPECT_NE(message_of([] { ConvexHull<3>(std::vector<Vec<3, float>>{}); }).find("no points"),
              std::string::npos);
    EXPECT_NE(message_of([&] {
                  ConvexHull<3>(std::vector<Vec<3, float>>{{0, 0, 0}, {0, nan, 0}});
              }).find("point 1"),
              std::string::npos);
    EXPECT_NE(message_of([] {
                  Mesh<3>(std::vector<Vec<3, float>>{{0, 0, 0}}, std::vector<Mesh<3>::Element>{{0, 0, 1}});
              }).find("element 0"),
              std::string::npos);
    EXPECT_NE(message_of([] { HeightField(HeightGrid<float>{{}, 1, 5, 1, 1}); }).find("2 x 2"),
              std::string::npos);

    const std::vector<Shape3> shapes(3);
    std::vector<Pose3f> poses(3);
    const std::vector<Pair> pairs = {{0, 1}};
    ContactFinder3f finder;
    const std::vector<Pair> bad = {{0, 3}};
    EXPECT_NE(message_of([&] { finder.find(shapes, poses, std::span<const Pair>(bad)); }).find("3"),
              std::string::npos);
    // Of several blocks of work the first bad pair, by its place among all.
    std::vector<Pair> many(5000, Pair{1, 0});
    many[3001] = {0, 7}, many[4000] = {8, 0};
    const std::vector<Shape3> two(2);
    poses.resize(2);
    std::vector<std::uint8_t> touch(many.size());
    const std::string first_bad = "pair 3001 names objects 0 and 7, but there are 2, numbered from 0";
    EXPECT_EQ(message_of([&] { finder.find(two, poses, std::span<const Pair>(many)); }), first_bad);
    EXPECT_EQ(message_of([&] { finder.touching(two, poses, many, touch); }), first_bad);
    poses.resize(3);
    EXPECT_NE(
        message_of([&] { finder.find(shapes, poses, std::span<const Pair>(pairs), -1.0f); }).find("margin"),
        std::string::npos);
    poses.pop_back();
    EXPECT_NE(message_of([&] { finder.find(shapes, poses, std::span<const Pair>(pairs)); }).find("2 poses"),
              std::string::npos);
    const Motion<3, float> turning{{}, {}, {1, 0, 0}};
    EXPECT_NE(message_of([&] {
                  (void)time_of_impact(Shape3::half_space({0, 1, 0}, 0), turning, Shape3(), turning, 0.1f);
              }).find("half-space"),
              std::string::npos);
}

class CountingMemory final : public std::pmr::memory_resource
{
  public:
    std::atomic<std::uint64_t> allocations{0};

  private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override
    {
        ++allocations;
        return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* p, std::size_t bytes, std::size_t alignment) override
    {
        std::pmr::new_delete_resource()->deallocate(p, bytes, alignment);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

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
    finder.find(shapes, poses, std::span<const Pair>(pairs));
    finder.find(shapes, poses, std::span<const Pair>(pairs));
    const std::uint64_t before = memory.allocations;
    EXPECT_GT(before, 0u);
    finder.find(shapes, poses, std::span<const Pair>(pairs));
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
