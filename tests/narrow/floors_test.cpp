// SPDX-License-Identifier: MIT
// A level floor made of pieces, from what it is: a body that reaches a little through a plane is pushed back
// along its normal, by as far as its lowest point is below it, however the plane is cut into triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "narrow/math.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;
using narrow::Vec3;

namespace {

using Rotation = std::array<double, 4>;
using Triangles = std::vector<Mesh<3>::Element>;

/// One rotation after another, as quaternions.
Rotation after(const Rotation& p, const Rotation& q)
{
    return {p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1],
            p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0],
            p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3],
            p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2]};
}
Vec3d turned(const Rotation& rotation, const Vec3d& p)
{
    const Vec3 q = narrow::rotation(Pose3d{{}, rotation}) * narrow::load(p);
    return {q.x, q.y, q.z};
}

struct Floor
{
    std::vector<Vec3d> vertices;
    Triangles triangles;

    Floor(Random& random, double cell, double heights, bool uneven)
    {
        const std::uint32_t n = cell < 0.4 ? 16 : 8;
        for (std::uint32_t z = 0; z <= n; ++z)
            for (std::uint32_t x = 0; x <= n; ++x) {
                const double shift = uneven ? 0.35 : 0;
                vertices.push_back({cell * (x - 0.5 * n + random.uniform(-shift, shift)),
                                    random.uniform(-heights, heights),
                                    cell * (z - 0.5 * n + random.uniform(-shift, shift))});
            }
        for (std::uint32_t a = 0; a < n * (n + 1); ++a) {
            if (a % (n + 1) == n) continue;
            const std::uint32_t b = a + 1, c = a + n + 1, d = c + 1;
            const bool rises = random.chance(0.5);
            add(random, a, c, rises ? d : b, uneven);
            add(random, rises ? a : c, d, b, uneven);
        }
    }

  private:
    /// Which way it runs doesn't matter. Perhaps in three pieces, thin ones among them.
    void add(Random& random, std::uint32_t p, std::uint32_t q, std::uint32_t r, bool uneven)
    {
        if (random.chance(0.5)) std::swap(p, q);
        if (!uneven || random.chance(0.5)) return triangles.push_back({p, q, r});
        const double u = random.uniform(0.01, 0.9), v = random.uniform(0.01, 0.99 - u);
        Vec3d inner;
        for (std::size_t i = 0; i < 3; ++i)
            inner[i] = (1 - u - v) * vertices[p][i] + u * vertices[q][i] + v * vertices[r][i];
        const auto m = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(inner);
        triangles.insert(triangles.end(), {{p, q, m}, {q, r, m}, {r, p, m}});
    }
};

/// Bodies that stand upright: on a disc, on a face, on an edge of a capsule.
struct Body
{
    Shape3 shape;
    Rotation rotation{0, 0, 0, 1};
    std::shared_ptr<ConvexHull<3>> hull;

    Body(Random& random, int kind)
    {
        const double h = random.uniform(0.1, 1.5), w = random.uniform(0.05, 1.2);
        const auto at = [&](double y) { return Vec3d{random.uniform(-1, 1), y, random.uniform(-1, 1)}; };
        switch (kind) {
        case 0:
            shape = Shape3::cone(h / 2, w);
            break;
        case 1:
            of({{-w, 0, -w}, {w, 0, -w}, {w, 0, w}, {-w, 0, w}, {random.uniform(-w, w), h, 0}});
            break;
        case 2:
            of({at(0), at(0), at(0), at(h)});
            break;
        case 3:
            shape = Shape3::box({w / 2, h / 2, random.uniform(0.05, 0.6)});
            break;
        case 4:
            shape = Shape3::cylinder(h / 2, w);
            break;
        case 5:
            shape = Shape3::capsule(h / 2, w / 4);
            if (random.chance(0.5)) rotation = {1, 0, 0, 1};
            break;
        default:
            of(on_a_face(random, h));
        }
        const double yaw = random.uniform(0, 3.2);
        rotation = after({0, std::sin(yaw), 0, std::cos(yaw)}, rotation);
    }

  private:
    void of(const std::vector<Vec3d>& points)
    {
        hull = std::make_shared<ConvexHull<3>>(points);
        shape = Shape3(*hull);
    }
    static std::vector<Vec3d> on_a_face(Random& random, double h)
    {
        std::vector<Vec3d> points(5 + random.below(20));
        for (Vec3d& p : points)
            p = {random.uniform(-0.7, 0.7), random.uniform(-h, h) / 2, random.uniform(-0.7, 0.7)};
        const ConvexHull<3> cloud(points);
        const auto face = cloud.face(random.below(static_cast<std::uint32_t>(cloud.face_count())));
        const auto corner = [&](std::size_t i) { return narrow::load(cloud.vertices()[face[i]]); };
        const Vec3 out = cross(corner(1) - corner(0), corner(2) - corner(0));
        const Vec3 down = out * (1 / length(out));
        Vec3 u, v;
        narrow::basis(down, u, v);
        for (Vec3d& p : points) {
            const Vec3 q = narrow::load(p);
            p = {dot(u, q), -dot(down, q), dot(v, q)};
        }
        return points;
    }
};

/// Places a body over or, upside down, under y = 0, so that it reaches through by `sunk` of its height.
/// Returns how far.
double place(Random& random, const Body& body, double sunk, bool under, Pose3d& pose)
{
    pose.rotation = body.rotation;
    pose.position = {};
    const auto box = bounds(body.shape, pose);
    const double depth = sunk * (box.hi[1] - box.lo[1]);
    pose.position = {random.uniform(-1, 1), -box.lo[1] - depth, random.uniform(-1, 1)};
    if (!under) return depth;
    pose.position[1] = -pose.position[1];
    pose.rotation = after({1, 0, 0, 0}, pose.rotation);
    return depth;
}

TEST(ALevelFloor, PushesBackWhatReachesThroughByAsMuch)
{
    Random random(61);
    for (int round = 0; round < 40; ++round) {
        const Floor floor(random, round % 4 == 3 ? 0.3 : 1, 0, round % 2 == 1);
        const Rotation turn = random.chance(0.5) ? Rotation{0, 0, 0, 1} : random.rotation<double>();
        std::vector<Vec3d> vertices;
        for (const Vec3d& v : floor.vertices)
            vertices.push_back(turned(turn, v));
        const Mesh<3> mesh(vertices, floor.triangles);
        for (int kind = 0; kind < 7; ++kind)
            for (const double sunk : {0.001, 0.01, 0.03})
                for (const double margin : {0.0, 0.05}) {
                    SCOPED_TRACE(testing::Message() << round << ": kind " << kind << " sunk " << sunk);
                    const Body body(random, kind);
                    const bool under = random.chance(0.3);
                    Pose3d pose;
                    const double depth = place(random, body, sunk, under, pose);
                    pose = {turned(turn, pose.position), after(turn, pose.rotation)};
                    const Vec3 out = narrow::load(turned(turn, {0, under ? -1.0 : 1.0, 0}));
                    double most = -1;
                    for (const auto& contact : contacts(Shape3(mesh), Pose3d{}, body.shape, pose, margin)) {
                        ASSERT_GT(dot(narrow::load(contact.normal), out), 1 - 1e-9) << contact.part_a;
                        most = std::max(most, contact.point[0].depth);
                    }
                    ASSERT_NEAR(most, depth, 1e-7);
                }
    }
}

TEST(ALevelFloor, PushesUpWhatStandsOnlyPartlyOnATriangle)
{
    const Mesh<3> floor(std::vector<Vec3d>{{-1, 0, 0}, {0, 0, 1}, {0, 0, 0}, {-1, 0, 1}},
                        Triangles{{0, 1, 2}, {0, 3, 1}});
    const ConvexHull<3> pyramid(
        std::vector<Vec3d>{{-0.5, 0, -0.5}, {0.5, 0, -0.5}, {0.5, 0, 0.5}, {-0.5, 0, 0.5}, {0, 1, 0}});
    const auto found = contacts(Shape3(floor), Pose3d{}, Shape3(pyramid), Pose3d{{0, -0.02, 0.05}});
    ASSERT_FALSE(found.empty());
    for (const auto& contact : found) {
        EXPECT_NEAR(contact.normal[1], 1, 1e-12) << contact.part_a;
        EXPECT_NEAR(contact.point[0].depth, 0.02, 1e-12) << contact.part_a;
    }
}

TEST(ALevelFloor, OfAChainPushesBackWhatReachesThroughByAsMuch)
{
    using Point = Vec<2, double>;
    Random random(62);
    for (int round = 0; round < 6000; ++round) {
        SCOPED_TRACE(round);
        const double angle = round % 2 == 0 ? 0 : random.uniform(0, 6);
        const Pose2d turn = {{}, {std::cos(angle), std::sin(angle)}};
        const auto in_world = [&](double x, double y) {
            const narrow::Vec2 p = narrow::rotation(std::cos(angle), std::sin(angle)) * narrow::Vec2{x, y};
            return Point{p.x, p.y};
        };
        std::vector<Point> vertices;
        std::vector<Mesh<2>::Element> segments;
        double x = -4;
        for (std::uint32_t i = 0; x < 4; ++i, x += random.chance(0.3) ? 0.05 : random.uniform(0.2, 1)) {
            vertices.push_back(in_world(x, 0));
            if (i > 0) segments.push_back({random.chance(0.5) ? i : i - 1, 0});
            if (i > 0) segments.back()[1] = 2 * i - 1 - segments.back()[0];
        }
        const Mesh<2> chain(vertices, segments);
        const double w = random.uniform(0.05, 1.2), h = random.uniform(0.1, 1.5);
        std::vector<Point> corners{{-w, 0}, {w, 0}, {random.uniform(-w, w), h}};
        if (random.chance(0.3)) corners.push_back({random.uniform(-2, 2), random.uniform(0, h)});
        const bool under = random.chance(0.3);
        for (Point& p : corners)
            p[1] = under ? -p[1] : p[1];
        const ConvexHull<2> polygon(corners);
        const double depth = h * (round % 3 == 0 ? 0.001 : round % 3 == 1 ? 0.01 : 0.03);
        const Pose2d pose{in_world(random.uniform(-1, 1), under ? depth : -depth), turn.rotation};
        const Point out = in_world(0, under ? -1 : 1);
        double most = -1;
        for (const auto& contact : contacts(Shape2(chain), Pose2d{}, Shape2(polygon), pose)) {
            ASSERT_GT(contact.normal[0] * out[0] + contact.normal[1] * out[1], 1 - 1e-9) << contact.part_a;
            most = std::max(most, contact.point[0].depth);
        }
        ASSERT_NEAR(most, depth, 1e-7);
    }
    const ConvexHull<2> triangle(std::vector<Point>{{-0.4, 0}, {0.4, 0}, {0, 0.25}});
    const Mesh<2> two(std::vector<Point>{{-2, 0}, {-1, 0}, {0, 0}},
                      std::vector<Mesh<2>::Element>{{0, 1}, {1, 2}});
    for (const auto& contact : contacts(Shape2(two), Pose2d{}, Shape2(triangle), Pose2d{{-0.68, -0.025}})) {
        EXPECT_NEAR(contact.normal[1], 1, 1e-12) << contact.part_a;
        EXPECT_NEAR(contact.point[0].depth, 0.025, 1e-12) << contact.part_a;
    }
}

/// A body that is tall enough isn't below a floor that bends by a few degrees, whatever it stands on there.
TEST(AGentlyRollingFloor, PushesNothingDown)
{
    Random random(63);
    int found = 0;
    for (int round = 0; round < 40; ++round) {
        const Floor floor(random, 1, 0.03, round % 2 == 1);
        const Mesh<3> mesh(floor.vertices, floor.triangles);
        for (int kind = 0; kind < 7; ++kind)
            for (int place_of = 0; place_of < 8; ++place_of) {
                const Body body(random, kind);
                Pose3d pose;
                place(random, body, random.uniform(0, 0.03), false, pose);
                const auto box = bounds(body.shape, pose);
                if (box.hi[1] < 0.2) continue;
                for (const auto& contact : contacts(Shape3(mesh), Pose3d{}, body.shape, pose)) {
                    ASSERT_GT(contact.normal[1], 0) << round << ": kind " << kind;
                    ASSERT_LT(contact.point[0].depth, 0.15) << round << ": kind " << kind;
                    ++found;
                }
            }
    }
    EXPECT_GT(found, 2000);
}

/// A board that leads down over the border of a table is mostly lower than what it lies on.
TEST(ALevelFloor, HoldsBoardsThatTipOverItsBorder)
{
    Random random(64);
    int tipped = 0;
    for (int round = 0; round < 3000; ++round) {
        const Floor floor(random, 0.5, 0, false); // ends at 2
        const Mesh<3> table(floor.vertices, floor.triangles);
        const double length = random.uniform(0.3, 1), half = random.uniform(0.01, 0.05);
        const double tilt = random.uniform(0.05, 0.9), c = std::cos(tilt), s = std::sin(tilt);
        const double beyond = random.uniform(-0.2, 0.9) * length; // of its middle, along it
        // Its lower side goes through the border 0.002 below it.
        const Pose3d pose{
            {2 + beyond * c + half * s, -0.002 / c - beyond * s + half * c, random.uniform(-1, 1)},
            {0, 0, -std::sin(tilt / 2), std::cos(tilt / 2)}};
        const Shape3 board = Shape3::box({length, half, 0.2});
        for (const auto& contact : contacts(Shape3(table), Pose3d{}, board, pose)) {
            ASSERT_GT(contact.normal[1], 0) << round << " by part " << contact.part_a;
            tipped += beyond > 0.2 ? 1 : 0;
        }
    }
    EXPECT_GT(tipped, 1000);
}

} // namespace
