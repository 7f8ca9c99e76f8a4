// SPDX-License-Identifier: MIT
// Moving shapes, and their slow twin: looking at very many moments of the motion.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "jostle/contact.hpp"
#include "moments.hpp"
#include "random_pairs.hpp"

using namespace jostle;
using namespace moments;

namespace {

/// A height field as what it says it is: prisms from its triangles down to its floor.
struct Ground
{
    std::vector<double> heights;
    std::uint32_t columns, rows;
    double spacing_x, spacing_z, thickness;
    HeightField field;
    std::vector<std::unique_ptr<ConvexHull<3>>> prisms;
    std::unique_ptr<Compound<3>> solid;

    Ground(std::vector<double> given, std::uint32_t nx, std::uint32_t nz, double sx, double sz, double thick)
        : heights(std::move(given)),
          columns(nx),
          rows(nz),
          spacing_x(sx),
          spacing_z(sz),
          thickness(thick),
          field(HeightGrid<double>{heights, nx, nz, sx, sz, thick})
    {
        double floor = heights[0];
        for (const double h : heights)
            floor = std::min(floor, h);
        floor -= std::max(thick, std::max(sx, sz));
        std::vector<Compound<3>::Child> children;
        const auto corner = [&](std::uint32_t x, std::uint32_t z) {
            return Vec<3, double>{x * sx, heights[z * nx + x], z * sz};
        };
        for (std::uint32_t z = 0; z + 1 < nz; ++z)
            for (std::uint32_t x = 0; x + 1 < nx; ++x)
                for (const bool upper : {false, true}) {
                    std::vector<Vec<3, double>> points = {corner(x, z), corner(x + 1, z + 1),
                                                          upper ? corner(x, z + 1) : corner(x + 1, z)};
                    for (std::size_t i = 0; i < 3; ++i)
                        points.push_back({points[i][0], floor, points[i][2]});
                    prisms.push_back(std::make_unique<ConvexHull<3>>(points));
                    children.push_back({Shape3(*prisms.back()), {}});
                }
        solid = std::make_unique<Compound<3>>(children);
    }
};

/// A closed bumpy surface of 4 n n triangles, often long and beside its origin.
Mesh<3> long_ball(Random& random, std::uint32_t n)
{
    std::vector<Vec<3, double>> vertices;
    std::vector<Mesh<3>::Element> elements;
    const double shift = random.uniform(0, 6), bump = random.uniform(0, 0.4);
    const double length = random.chance(0.7) ? 2 : 0.7, width = random.uniform(0.1, 0.8),
                 beside = random.uniform(-2, 2);
    for (std::uint32_t i = 0; i <= n; ++i)
        for (std::uint32_t j = 0; j < 2 * n; ++j) {
            const double t = 3.141592653589793 * i / n, p = 3.141592653589793 * j / n;
            const double r = 1 + bump * std::sin(3 * t + shift) * std::cos(4 * p);
            vertices.push_back({beside + length * r * std::sin(t) * std::cos(p), width * r * std::cos(t),
                                width * r * std::sin(t) * std::sin(p)});
        }
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < 2 * n; ++j) {
            const std::uint32_t k = (j + 1) % (2 * n);
            elements.push_back({i * 2 * n + j, (i + 1) * 2 * n + j, (i + 1) * 2 * n + k});
            elements.push_back({i * 2 * n + j, (i + 1) * 2 * n + k, i * 2 * n + k});
        }
    return Mesh<3>(vertices, elements);
}

/// The edge comes slowly nearer, and the corners behind it turn fast: to be careful of all that these might
/// do would take more than the thousand steps that there are.
TEST(Impact, IsInTimeWhereABodyTurnsAboutItsNearestEdge)
{
    const std::vector<Vec<3, double>> corners = {{0, -1, 0}, {0, 1, 0}, {-100, 0, 10}, {-100, 0, -10}};
    const ConvexHull<3> hull(corners);
    Motion<3, double> turning{{}, {}, {0, 1.4, 0}}, coming{{}, {}, {}};
    coming.pose.position = {0.02, 0, 0};
    coming.linear = {-0.025, 0, 0};
    const auto impact = time_of_impact(Shape3::sphere(0), coming, Shape3(hull), turning, 1e-4);
    ASSERT_TRUE(impact);
    EXPECT_LE(impact->time, 0.8);
    EXPECT_GE(impact->time, 0.8 - 1e-4 / 0.025 - 1e-9);
    // In the plane alike.
    const std::vector<Vec<2, double>> wedge = {{0, 0}, {-100, 10}, {-100, -10}};
    const ConvexHull<2> polygon(wedge);
    Motion<2, double> turning_2{{}, {}, {1.4}}, coming_2{{}, {}, {}};
    coming_2.pose.position = {0.02, 0};
    coming_2.linear = {-0.025, 0};
    const auto impact_2 = time_of_impact(Shape2::sphere(0), coming_2, Shape2(polygon), turning_2, 1e-4);
    ASSERT_TRUE(impact_2);
    EXPECT_LE(impact_2->time, 0.8);
    EXPECT_GE(impact_2->time, 0.8 - 1e-4 / 0.025 - 1e-9);
}

TEST(Impact, OfMeshesIsNeverLateAndNoEarlierThanTheTolerance)
{
    Random random(41);
    int hits = 0, misses = 0;
    for (int round = 0; round < 300; ++round) {
        const Mesh<3> mesh = long_ball(random, 3 + random.below(6)), other = long_ball(random, 5);
        const Zoo<3> zoo(random, 1);
        std::vector<Shape3> shapes{other,
                                   other,
                                   Shape3::sphere(0.3),
                                   Shape3::capsule(1.5, 0.05),
                                   Shape3::box({0.05, 0.1, 1.8}),
                                   Shape3::box({1.8, 0.1, 0.1})};
        for (const Shape3& shape : zoo.shapes)
            if (shape.type() != ShapeTypes::height_field) shapes.push_back(shape);
        const Shape3 a(mesh), b = shapes[random.below(static_cast<std::uint32_t>(shapes.size()))];
        Motion<3, double> moving_a{random.pose<double>(0.5), {}, {}},
            moving_b{random.pose<double>(4), {}, {}};
        const bool turns_b = b.type() != ShapeTypes::half_space && b.type() != ShapeTypes::compound;
        const double turn = round % 3 == 0 ? 0 : round % 3 == 1 ? 1.5 : 12;
        for (std::size_t d = 0; d < 3; ++d) {
            moving_b.linear[d] =
                random.uniform(0, 1.6) * (moving_a.pose.position[d] - moving_b.pose.position[d]);
            moving_a.angular[d] = random.uniform(-turn, turn);
            if (turns_b) moving_b.angular[d] = random.uniform(-turn, turn);
        }
        if (random.chance(0.4)) moving_a.angular = {};
        const double tolerance = random.chance(0.5) ? 1e-2 : 1e-5;
        SCOPED_TRACE(testing::Message() << "round " << round << " type " << b.type());
        const auto impact = time_of_impact(a, moving_a, b, moving_b, tolerance);
        const auto overlap = first_overlap(a, moving_a, b, moving_b, 300);
        if (!impact) {
            ASSERT_FALSE(overlap) << *overlap;
            ++misses;
            continue;
        }
        ++hits;
        if (overlap) {
            ASSERT_LE(impact->time, *overlap);
        }
        const double gap = gap_at(a, moving_a, b, moving_b, impact->time);
        ASSERT_LE(gap, tolerance * 1.001 + 1e-9);
        if (impact->time == 0) continue;
        ASSERT_GE(gap, 0.4 * tolerance);
        // The points are those of the least gap at that time.
        const auto there = distance(a, at(moving_a, impact->time), b, at(moving_b, impact->time), INFINITY);
        for (std::size_t d = 0; d < 3; ++d)
            ASSERT_NEAR(impact->normal[d], there->normal[d], 1e-3) << "gap " << gap;
    }
    EXPECT_GT(hits, 40);
    EXPECT_GT(misses, 20);
}

TEST(Impact, BesideAHeightFieldsRimIsNeverLate)
{
    Random random(11);
    const Ground flat({0, 0, 0, 0}, 2, 2, 1.5, 1.5, 0);
    const auto ball = time_of_impact(Shape3(flat.field), Motion<3, double>{}, Shape3::sphere(0.2),
                                     Motion<3, double>{{{-0.6, -0.047, 0.73}}, {1.8, 0.008, 0}, {}}, 1e-4);
    ASSERT_TRUE(ball);
    EXPECT_LE(ball->time, 0.335);

    std::vector<double> heights(16);
    for (double& h : heights)
        h = random.uniform(-0.3, 0.3);
    const Ground rough(heights, 4, 4, 0.5, 0.5, 0.4);
    const std::vector<Vec<3, double>> points = {
        {-0.2, 0, -0.1}, {0.2, 0.1, 0}, {0, 0.3, 0.2}, {0, -0.1, 0.3}};
    const ConvexHull<3> hull(points);
    const Shape3 bodies[] = {Shape3::sphere(0.2), Shape3::capsule(0.3, 0.1), Shape3::box({0.1, 0.2, 0.15}),
                             hull};
    int hits = 0, from_outside = 0;
    for (int round = 0; round < 900; ++round) {
        const Ground& ground = round % 3 == 0 ? flat : rough;
        const Shape3 field(ground.field), solid(*ground.solid), body = bodies[random.below(4)];
        Motion<3, double> still{random.pose<double>(3), {}, {}}, moving{random.pose<double>(2), {}, {}};
        if (round % 2 == 0) still = {};
        // From around the field to somewhere in it, often level.
        const double angle = random.uniform(0, 6.3);
        moving.pose.position = {0.75 + 1.6 * std::cos(angle), random.uniform(-1.6, 1),
                                0.75 + 1.6 * std::sin(angle)};
        for (std::size_t d = 0; d < 3; ++d)
            moving.linear[d] = random.uniform(0, 1.5) - moving.pose.position[d];
        if (random.chance(0.5)) moving.linear[1] = random.uniform(-0.05, 0.05);
        if (random.chance(0.5))
            for (double& w : moving.angular)
                w = random.uniform(-4, 4);
        if (round % 2 == 1)
            for (std::size_t d = 0; d < 3; ++d)
                moving.pose.position[d] += still.pose.position[d];
        constexpr double tolerance = 1e-4;
        const auto impact = time_of_impact(field, still, body, moving, tolerance);
        const auto touch = first_overlap(field, still, body, moving, 200);
        if (touch) {
            ASSERT_TRUE(impact) << round << ": touches at " << *touch;
            ASSERT_LE(impact->time, *touch) << round;
        }
        if (!impact) continue;
        ++hits;
        // Where it stops it is at the ground, and wasn't before.
        if (impact->time == 0) continue;
        ++from_outside;
        ASSERT_LE(gap_at(solid, still, body, moving, impact->time), 1.01 * tolerance) << round;
        for (int i = 0; i < 20; ++i)
            ASSERT_GT(gap_at(solid, still, body, moving, impact->time * i / 20), 0) << round;
    }
    EXPECT_GT(from_outside, 300);
    EXPECT_GT(hits, from_outside);
}

/// Every two shapes there are, moved gently and wildly.
template <int Dim>
void compare_with_twin(int rounds, std::uint64_t seed)
{
    Random random(seed);
    const Zoo<Dim> zoo(random, 3);
    int hits = 0, misses = 0, late = 0;
    for (int round = 0; round < rounds; ++round) {
        const auto& a = zoo.any(random);
        const auto& b = zoo.any(random);
        const auto turns = [](const Shape<Dim>& shape) { return shape.type() != ShapeTypes::half_space; };
        Motion<Dim, double> motion[2];
        const double wild = round % 4 == 0 ? 200 : 3;
        for (auto& one : motion) {
            one.pose = random_pose<Dim, double>(random, 4);
            for (double& x : one.linear)
                x = random.uniform(-4, 4);
            if (turns(&one == motion ? a : b) && random.chance(0.7))
                for (double& w : one.angular)
                    w = random.uniform(-wild, wild);
        }
        const double tolerance = 1e-3;
        const auto impact = time_of_impact(a, motion[0], b, motion[1], tolerance);
        const auto touch = first_overlap(a, motion[0], b, motion[1], 200);
        if (touch) {
            ASSERT_TRUE(impact) << round << ": types " << a.type() << ", " << b.type() << " touch at "
                                << *touch;
            late += impact->time > *touch ? 1 : 0;
            ASSERT_LE(impact->time, *touch) << round << ": types " << a.type() << ", " << b.type();
        }
        (impact ? hits : misses) += 1;
        if (!impact || a.type() == ShapeTypes::height_field || b.type() == ShapeTypes::height_field) continue;
        ASSERT_LE(gap_at(a, motion[0], b, motion[1], impact->time), 1.01 * tolerance)
            << round << ": types " << a.type() << ", " << b.type() << " at " << impact->time;
    }
    EXPECT_GT(hits, rounds / 10);
    EXPECT_GT(misses, rounds / 10);
}
TEST(Impact, IsNeverLaterThanItsTwinInSpace)
{
    compare_with_twin<3>(1000, 21);
}
TEST(Impact, IsNeverLaterThanItsTwinInThePlane)
{
    compare_with_twin<2>(3000, 22);
}

/// A small body at the end of a long arm, of each kind that parts are found of in another way.
template <int Dim>
struct Swinging
{
    Vec<Dim, double> arm = {};
    std::unique_ptr<ConvexHull<Dim>> hull;
    std::unique_ptr<Mesh<Dim>> mesh;
    std::unique_ptr<Compound<Dim>> compound;

    explicit Swinging(Random& random)
    {
        arm[0] = random.uniform(5, 10);
        std::vector<Vec<Dim, double>> around;
        std::vector<typename Mesh<Dim>::Element> elements;
        for (std::uint32_t i = 0; i < 8; ++i) {
            around.push_back(arm);
            for (double& x : around.back())
                x += random.uniform(-0.2, 0.2);
            for (std::uint32_t& corner : elements.emplace_back())
                corner = random.below(8);
        }
        const typename Compound<Dim>::Child child{Shape<Dim>::sphere(0.2), Pose<Dim, double>{arm}};
        hull = std::make_unique<ConvexHull<Dim>>(around);
        mesh = std::make_unique<Mesh<Dim>>(around, elements);
        compound = std::make_unique<Compound<Dim>>(std::span(&child, 1));
    }
    [[nodiscard]] std::vector<Shape<Dim>> shapes() const { return {*hull, *mesh, *compound}; }
};

/// Half a turn takes what is at the end of an arm to twice the arm's length from where it was. What waits
/// there is met, whichever of the two turns.
template <int Dim>
void swing_onto_what_waits(std::uint64_t seed)
{
    Random random(seed);
    const double tolerance = 1e-3;
    Vec<Dim, double> half;
    for (double& x : half)
        x = 0.3;
    const Motion<Dim, double> none{};
    for (int round = 0; round < 60; ++round) {
        const Swinging<Dim> swinging(random);
        const double angle = random.uniform(1.5, 3.1), tilt = random.uniform(-3.2, 3.2);
        Motion<Dim, double> turning = none, waiting = none;
        if constexpr (Dim == 3)
            turning.angular = {0, angle * std::cos(tilt), angle * std::sin(tilt)};
        else
            turning.angular = {tilt < 0 ? -angle : angle};
        const double meets = random.uniform(0.8, 1);
        waiting.pose.position = at(turning, meets).transform(swinging.arm);
        for (const Shape<Dim>& body : swinging.shapes())
            for (const Shape<Dim>& other : {Shape<Dim>::sphere(0.5), Shape<Dim>::rounded_box(half, 0.2)}) {
                const auto hit = time_of_impact(body, turning, other, waiting, tolerance);
                ASSERT_TRUE(hit) << round << ": shape of type " << body.type() << ", by " << angle;
                EXPECT_LE(hit->time, meets);
                EXPECT_LE(gap_at(body, turning, other, waiting, hit->time), 1.001 * tolerance);
            }
    }
}
TEST(Impact, IsFoundAtTheOtherEndOfATurnInSpace)
{
    swing_onto_what_waits<3>(51);
}
TEST(Impact, IsFoundAtTheOtherEndOfATurnInThePlane)
{
    swing_onto_what_waits<2>(52);
}

double seconds(const std::chrono::steady_clock::time_point& since)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

/// Motions that took seconds, for what never comes nearer.
TEST(Impact, WhatMovesAlongASurfaceIsDoneAtOnce)
{
    const auto begin = std::chrono::steady_clock::now();
    // Spinning about its own axis, at any speed.
    for (const double spin : {1e4, 1e6, 1e9})
        EXPECT_FALSE(time_of_impact(Shape3::box({5, 1, 5}), Motion<3, double>{}, Shape3::capsule(1, 0.5),
                                    Motion<3, double>{{{0, 2.5 + 1e-3, 0}}, {}, {0, spin, 0}}, 1e-4));
    // A propeller beside a wall that it doesn't reach, and beside one that it does.
    for (const double spin : {1e4, 1e6, 1e9}) {
        const Shape3 wall = Shape3::box({0.1, 5, 5}), propeller = Shape3::box({1, 0.05, 0.1});
        const Motion<3, double> there{{{1.2, 0, 0}}, {}, {}};
        EXPECT_FALSE(time_of_impact(wall, there, propeller, Motion<3, double>{{}, {}, {0, 0, spin}}, 1e-4));
        const auto hit = time_of_impact(wall, {{{1.05, 0, 0}}, {}, {}}, propeller,
                                        Motion<3, double>{{{}, {0, 0, 1, 1}}, {}, {0, 0, spin}}, 1e-4);
        ASSERT_TRUE(hit);
        EXPECT_LE(hit->time, 1.5707963 / spin);
    }
    // Sliding over a mesh and a height field.
    const double far = 100;
    const Mesh<3> triangle(std::vector<Vec<3, double>>{{-far, 0, -far}, {far, 0, -far}, {0, 0, far}},
                           std::vector<Mesh<3>::Element>{{0, 2, 1}});
    std::vector<Vec<3, double>> vertices;
    std::vector<Mesh<3>::Element> elements;
    constexpr std::uint32_t n = 60;
    for (std::uint32_t z = 0; z < n; ++z)
        for (std::uint32_t x = 0; x < n; ++x) {
            vertices.push_back({x * 1.0, 0, z * 1.0});
            if (x + 1 == n || z + 1 == n) continue;
            const std::uint32_t p = z * n + x;
            elements.push_back({p, p + n, p + 1});
            elements.push_back({p + 1, p + n, p + n + 1});
        }
    const Mesh<3> floor(vertices, elements);
    const std::vector<double> level(std::size_t{n} * n, 0.0);
    const HeightField field(HeightGrid<double>{level, n, n, 1, 1});
    for (const double gap : {1e-3, 1e-4, 2e-6})
        for (const Shape3& ground : {Shape3(triangle), Shape3(floor), Shape3(field)})
            for (const Shape3& body : {Shape3::sphere(0.5), Shape3::box({0.5, 0.5, 0.5})}) {
                const Motion<3, double> sliding{{{5, 0.5 + gap, 6}}, {40, 0, 31}, {}};
                EXPECT_FALSE(time_of_impact(ground, Motion<3, double>{}, body, sliding, 1e-6));
                const Motion<3, double> sinking{{{5, 0.5 + gap, 6}}, {40, -2 * gap, 31}, {}};
                const auto hit = time_of_impact(ground, Motion<3, double>{}, body, sinking, 1e-6);
                ASSERT_TRUE(hit);
                EXPECT_LE(hit->time, 0.5);
                EXPECT_GE(hit->time, 0.5 - 1e-6 / (2 * gap) - 1e-6);
            }
    EXPECT_LT(seconds(begin), 40.0) << "was minutes; takes a tenth of a second";
}

/// Nothing takes more than so many steps, and what is cut short comes early.
TEST(Impact, HasAnEndAndThenIsEarly)
{
    Random random(31);
    const Zoo<3> zoo(random, 2, false);
    double most = 0;
    int hits = 0;
    for (int round = 0; round < 300; ++round) {
        const Shape3 &a = zoo.any(random), &b = zoo.any(random);
        const auto turns = [](const Shape3& shape) { return shape.type() != ShapeTypes::half_space; };
        Motion<3, double> one{random.pose<double>(3), {}, {}}, other{random.pose<double>(3), {}, {}};
        const double spin = std::pow(10, random.uniform(2, 9));
        for (std::size_t d = 0; d < 3; ++d) {
            one.linear[d] = random.uniform(-1, 1);
            if (turns(a)) one.angular[d] = random.uniform(-spin, spin);
            if (turns(b)) other.angular[d] = random.uniform(-spin, spin);
        }
        const auto begin = std::chrono::steady_clock::now();
        const auto impact = time_of_impact(a, one, b, other, 1e-6);
        most = std::max(most, seconds(begin));
        hits += impact ? 1 : 0;
        const auto touch = first_overlap(a, one, b, other, 60);
        if (touch) {
            ASSERT_TRUE(impact) << round;
            // Where 1e9 radians have been turned, a time says where to within 1e-7.
            ASSERT_LE(impact->time, *touch * (1 + 1e-12)) << round;
        }
    }
    EXPECT_GT(hits, 50);
    EXPECT_LT(most, 5.0) << "was hours; takes milliseconds";
}

/// A ball that is known by its support points, and lies beside its own origin.
template <int Dim>
class OwnBall final : public CustomShape<Dim>
{
  public:
    [[nodiscard]] double radius() const noexcept override { return 0.9; }
    [[nodiscard]] Vec<Dim, double> support(const Vec<Dim, double>& direction) const noexcept override
    {
        double size = 0;
        for (const double x : direction)
            size += x * x;
        Vec<Dim, double> point{};
        point[0] = 0.4;
        for (std::size_t d = 0; d < point.size(); ++d)
            point[d] += 0.5 * direction[d] / std::sqrt(size);
        return point;
    }
};

template <int Dim>
void compare_own_shape(std::uint64_t seed)
{
    Random random(seed);
    const Zoo<Dim> zoo(random, 2, false);
    const OwnBall<Dim> ball;
    const Shape<Dim> own(ball, ShapeTypes::first_custom);
    Pose<Dim, double> aside;
    aside.position[0] = 0.4;
    const std::vector<typename Compound<Dim>::Child> children = {{Shape<Dim>::sphere(0.5), aside}};
    const Compound<Dim> same(children);
    int hits = 0;
    for (int round = 0; round < 400; ++round) {
        const auto& other = zoo.any(random);
        Motion<Dim, double> still{}, moving{};
        moving.pose = random_pose<Dim, double>(random, 4);
        for (std::size_t d = 0; d < moving.linear.size(); ++d)
            moving.linear[d] = -2 * moving.pose.position[d] + random.uniform(-1, 1);
        for (double& w : moving.angular)
            w = random.uniform(-5, 5);
        const auto mine = time_of_impact(own, moving, other, still, 1e-3);
        const auto theirs = time_of_impact(Shape<Dim>(same), moving, other, still, 1e-3);
        const auto touch = first_overlap(own, moving, other, still, 100, 0.01);
        if (touch) {
            ASSERT_TRUE(mine && theirs) << round << " type " << other.type();
            ASSERT_LE(mine->time, *touch) << round << " type " << other.type();
        }
        hits += mine ? 1 : 0;
        if (!mine) continue;
        ASSERT_LE(gap_at(Shape<Dim>(same), moving, other, still, mine->time),
                  other.type() == ShapeTypes::height_field ? HUGE_VAL : 1.1e-3)
            << round << " type " << other.type();
    }
    EXPECT_GT(hits, 100);
}
TEST(Impact, OfAUsersShapeGoesByItsSupportPoints)
{
    compare_own_shape<3>(51);
    compare_own_shape<2>(52);
}

TEST(Impact, AFloatsTimeIsRoundedDown)
{
    Random random(41);
    const Shape3 ball = Shape3::sphere(0.5);
    for (int round = 0; round < 3000; ++round) {
        Motion<3, float> still{}, fast{};
        fast.pose = random.pose<float>(2000);
        for (std::size_t d = 0; d < 3; ++d)
            fast.linear[d] = -2 * fast.pose.position[d];
        const auto impact = time_of_impact(ball, still, ball, fast, 1e-4f);
        if (!impact) continue;
        const auto widen = [](const Motion<3, float>& m) {
            Motion<3, double> wide;
            for (std::size_t d = 0; d < 3; ++d) {
                wide.pose.position[d] = double{m.pose.position[d]};
                wide.linear[d] = double{m.linear[d]};
            }
            return wide;
        };
        const auto exact = time_of_impact(ball, widen(still), ball, widen(fast), double{1e-4f});
        ASSERT_TRUE(exact);
        ASSERT_LE(double{impact->time}, exact->time);
        ASSERT_GE(double{std::nextafter(impact->time, 2.0f)}, exact->time);
    }
}

} // namespace
