// SPDX-License-Identifier: MIT
// Shapes with a support function: cylinders, cones, ellipsoids; and what is rounded.
#include <gtest/gtest.h>

#include "narrow/convex/core3.hpp"
#include "narrow/parts/pair.hpp"
#include "tests/contract/error_of.hpp"
#include "tests/narrow/smooth_samples.hpp"

using namespace jostle;
using namespace narrow_samples;
using contract::message_of;
using narrow::Vec2;
using narrow::Vec3;

namespace {

/// The signed distance of two convex shapes is the most by which any direction parts them: all of a grid are
/// tried, and the best of them refined by ever smaller steps, each turned against the last, as the most is
/// often on a sharp ridge. `hint` is one more to try: it parts them by no more than they are apart.
double signed_distance(const Shape3& a, const Pose3d& pose_a, const Shape3& b, const Pose3d& pose_b,
                       const Vec3& hint)
{
    const auto parted = [&](const Vec3& n) { return parted_by(n, a, pose_a, b, pose_b); };
    struct Try
    {
        double value;
        Vec3 n;
    };
    std::vector<Try> tries;
    constexpr int count = 4000;
    for (int i = 0; i < count; ++i) { // on a spiral
        const double y = 1 - 2 * (i + 0.5) / count, r = std::sqrt(1 - y * y), angle = 2.399963229728653 * i;
        const Vec3 n{r * std::cos(angle), y, r * std::sin(angle)};
        tries.push_back({parted(n), n});
    }
    std::partial_sort(tries.begin(), tries.begin() + 12, tries.end(),
                      [](const Try& x, const Try& y) { return x.value > y.value; });
    double best = parted(hint);
    for (int i = 0; i < 12; ++i) {
        Try now = tries[static_cast<std::size_t>(i)];
        double turned = 0;
        int failed = 0;
        for (double step = 0.05; step > 1e-9;) {
            Vec3 u, v;
            narrow::basis(now.n, u, v);
            bool better = false;
            turned += 2.399963229728653;
            for (int k = 0; k < 8; ++k) {
                const double angle = 0.7853981633974483 * k + turned;
                Vec3 n = now.n + u * (step * std::cos(angle)) + v * (step * std::sin(angle));
                n = n * (1 / length(n));
                if (const double value = parted(n); value > now.value) {
                    now = {value, n};
                    better = true;
                }
            }
            failed = better ? 0 : failed + 1;
            if (failed < 8) continue;
            step *= 0.5;
            failed = 0;
        }
        best = std::max(best, now.value);
    }
    return best;
}

/// Cones and ellipsoids without extent along an axis have rims as sharp as edges.
bool is_flat(const Shape3& shape)
{
    const auto size = shape.size();
    return (shape.type() == ShapeTypes::cone || shape.type() == ShapeTypes::ellipsoid) &&
           std::min({size[0], size[1], size[2]}) == 0;
}

Shape3 random_shape(Random& random)
{
    const auto size = [&] { return random.chance(0.05) ? 0 : random.uniform(0.1, 1.5); };
    switch (random.below(7)) {
    case 0:
        return Shape3::sphere(size());
    case 1:
        return Shape3::capsule(size(), size());
    case 2:
        return Shape3::box({size(), size(), size()});
    case 3:
        return Shape3::rounded_box({size(), size(), size()}, size());
    case 4:
        return Shape3::cylinder(size(), size());
    case 5:
        return Shape3::cone(size(), size());
    default:
        return Shape3::ellipsoid({size(), size(), size()});
    }
}

TEST(SmoothShapes, AreAsFarOrDeepAsTheBestDirectionSays)
{
    Random random(61);
    int deep = 0, apart = 0, inexact = 0;
    double worst = 0;
    for (int round = 0; round < 1200; ++round) {
        const Shape3 a = random_shape(random), b = random_shape(random);
        const Pose3d pose_a = random.pose<double>(1), pose_b = random.pose<double>(1.5);
        SCOPED_TRACE(testing::Message() << round << " types " << a.type() << " " << b.type());
        const auto found = distance(a, pose_a, b, pose_b, INFINITY);
        ASSERT_TRUE(found);
        ASSERT_NEAR(narrow::length(narrow::load(found->normal)), 1, 1e-9);
        const double expected = signed_distance(a, pose_a, b, pose_b, narrow::load(found->normal));
        if (expected > 1e-7) {
            ++apart;
            ASSERT_NEAR(found->distance, expected, 1e-6);
            // Two points are that near, as is said below, and a plane parts the shapes by as much.
            const double by = parted_by(narrow::load(found->normal), a, pose_a, b, pose_b);
            ASSERT_NEAR(found->distance, by, is_flat(a) || is_flat(b) ? 1e-8 : 1e-12);
            ASSERT_FALSE(touching(a, pose_a, b, pose_b));
        } else if (expected < -1e-7) {
            ++deep;
            const double size = 3;
            ASSERT_LE(found->distance, expected + 1e-6) << "not less deep than it is";
            worst = std::max(worst, expected - found->distance);
            inexact += found->distance < expected - 1e-6 * size ? 1 : 0;
            ASSERT_GE(found->distance, expected - 5e-3 * size);
            ASSERT_TRUE(touching(a, pose_a, b, pose_b));
        }
        const auto gap = (narrow::load(pose_b.position) + narrow::load(found->from_b)) -
                         (narrow::load(pose_a.position) + narrow::load(found->from_a)) -
                         narrow::load(found->normal) * found->distance;
        ASSERT_NEAR(length(gap), 0, 1e-6);
        // Contacts say the same, and no point is deeper.
        const auto found_contacts = contacts(a, pose_a, b, pose_b);
        if (std::abs(expected) < 1e-7) continue;
        ASSERT_EQ(found_contacts.size(), expected < 0 ? 1u : 0u);
        if (found_contacts.empty()) continue;
        const auto& contact = found_contacts[0];
        ASSERT_NEAR(contact.point[0].depth, -found->distance, 1e-6);
        for (std::uint32_t i = 1; i < contact.count; ++i)
            ASSERT_LE(contact.point[i].depth, contact.point[0].depth);
    }
    EXPECT_GT(deep, 300);
    EXPECT_GT(apart, 200);
    EXPECT_LT(inexact, deep / 100) << "worst " << worst;
}

// Where many directions are nearly as good, as of circles in one another, no polygon is exact along all.
TEST(SmoothShapes, InThePlaneAreAsDeepAsTheBestDirectionSays)
{
    Random random(78);
    int deep = 0;
    for (int round = 0; round < 6000; ++round) {
        const auto size = [&] { return 0.1 * (1 + random.below(10)); };
        const auto whole = [&] { return 0.1 * (static_cast<int>(random.below(13)) - 6); };
        const double width = size(), height = size(), p = size(), q = size();
        const std::uint32_t kind = random.below(4);
        const Shape2 a = Shape2::ellipsoid({width, height}), b = kind == 0   ? Shape2::sphere(p)
                                                                 : kind == 1 ? Shape2::ellipsoid({p, q})
                                                                 : kind == 2 ? Shape2::box({p, q})
                                                                             : Shape2::capsule(p, q);
        const double turn = random.uniform(0, 6.28), c = std::cos(turn), s = std::sin(turn);
        const Pose2d pose_a{}, pose_b{{whole(), whole()}, {c, s}};
        const auto found = distance(a, pose_a, b, pose_b, 10.0);
        ASSERT_TRUE(found);
        if (found->distance > -1e-3) continue;
        ++deep;
        const auto overlap = [&](double angle) {
            const double x = std::cos(angle), y = std::sin(angle), u = c * x + s * y, v = c * y - s * x;
            const double of_b = kind == 0   ? p
                                : kind == 1 ? std::hypot(p * u, q * v)
                                : kind == 2 ? p * std::abs(u) + q * std::abs(v)
                                            : p * std::abs(v) + q;
            return std::hypot(width * x, height * y) + of_b - pose_b.position[0] * x - pose_b.position[1] * y;
        };
        constexpr double degree = 0.017453292519943295;
        double best = HUGE_VAL;
        for (int i = 0; i < 360; ++i) { // from each that is better than its neighbours
            double at = i * degree, here = overlap(at);
            if (here > overlap(at - degree) || here > overlap(at + degree)) continue;
            for (double step = degree; step > 1e-11;) {
                const double before = overlap(at - step), after = overlap(at + step);
                if (!(std::min(before, after) < here)) {
                    step *= 0.7;
                    continue;
                }
                at += before < after ? -step : step;
                here = std::min(before, after);
            }
            best = std::min(best, here);
        }
        ASSERT_NEAR(found->distance, -best, 1e-10) << round << " kind " << kind;
        const auto found_contacts = contacts(a, pose_a, b, pose_b);
        ASSERT_EQ(found_contacts.size(), 1u);
        ASSERT_NEAR(found_contacts[0].point[0].depth, best, 1e-7) << round << " kind " << kind;
    }
    EXPECT_GT(deep, 4000);
}

// Also ellipses without width: apart, touching as well as doubles can tell, and overlapping.
TEST(SmoothShapes, InThePlaneAreAsFarApartAsTheBestDirectionSays)
{
    struct Body
    {
        int kind; // an ellipse, a box or a segment
        double x, y;
        Pose2d pose;
        [[nodiscard]] Shape2 shape() const
        {
            return kind == 0   ? Shape2::ellipsoid({x, y})
                   : kind == 1 ? Shape2::box({x, y})
                               : Shape2::capsule(x, 0);
        }
        [[nodiscard]] double reach(double u, double v) const // along (u, v)
        {
            const double c = pose.rotation[0], s = pose.rotation[1], p = c * u + s * v, q = c * v - s * u;
            const double own = kind == 0 ? std::hypot(x * p, y * q) : x * std::abs(kind == 1 ? p : q);
            return pose.position[0] * u + pose.position[1] * v + own + (kind == 1 ? y * std::abs(q) : 0);
        }
    };
    Random random(91);
    for (int round = 0; round < 3000; ++round) {
        const auto body = [&](int kind) {
            const auto size = [&] { return random.chance(0.2) ? 0 : random.uniform(0.05, 1); };
            const double x = size(), y = size(), turn = random.uniform(0, 6.28);
            return Body{kind,
                        x,
                        y,
                        {{random.uniform(-1, 1), random.uniform(-1, 1)}, {std::cos(turn), std::sin(turn)}}};
        };
        const Body a = body(0);
        Body b = body(static_cast<int>(random.below(3)));
        const auto parted = [&](double angle) {
            const double u = std::cos(angle), v = std::sin(angle);
            return -a.reach(u, v) - b.reach(-u, -v);
        };
        const auto most = [&] {
            constexpr double degree = 0.017453292519943295;
            double best = -HUGE_VAL;
            for (int i = 0; i < 360; ++i) { // from each that is better than its neighbours
                double at = i * degree, here = parted(at);
                if (here < parted(at - degree) || here < parted(at + degree)) continue;
                for (double step = degree; step > 1e-12; step *= 0.6)
                    for (const double way : {-step, step, -step, step})
                        if (const double there = parted(at + way); there > here) {
                            here = there;
                            at += way;
                        }
                best = std::max(best, here);
            }
            return best;
        };
        for (const double left : {HUGE_VAL, 1e-3, 0.0, -1e-3}) {
            if (left != HUGE_VAL) { // moved to that distance, along the normal
                const auto gap = distance(a.shape(), a.pose, b.shape(), b.pose, 1e300);
                for (int d = 0; d < 2; ++d)
                    b.pose.position[d] -= (gap->distance - left) * gap->normal[d];
            }
            const auto gap = distance(a.shape(), a.pose, b.shape(), b.pose, 1e300);
            ASSERT_TRUE(gap);
            ASSERT_NEAR(gap->distance, most(), 1e-8) << round << " kind " << b.kind << " " << left;
            for (int d = 0; d < 2; ++d) {
                const double on_a = a.pose.position[d] + gap->from_a[d],
                             on_b = b.pose.position[d] + gap->from_b[d];
                ASSERT_NEAR(on_a + gap->distance * gap->normal[d], on_b, 1e-8) << round;
            }
            const double slack = 1e-7;
            const auto inside = [&](const Body& body, const Vec2d& point, const Pose2d& pose) {
                const auto off = distance(
                    body.shape(), body.pose, Shape2::sphere(0),
                    Pose2d{{pose.position[0] + point[0], pose.position[1] + point[1]}, {1, 0}}, 1e300);
                return off->distance < slack;
            };
            ASSERT_TRUE(inside(a, gap->from_a, a.pose) && inside(b, gap->from_b, b.pose))
                << round << " " << left;
        }
    }
}

// Of two round shapes that nearly touch, a point of each says nothing about the normal.
TEST(SmoothShapes, InThePlaneKeepTheirNormalHoweverNear)
{
    Random random(92);
    for (int round = 0; round < 2000; ++round) {
        std::vector<Vec2d> points(3 + random.below(10));
        for (Vec2d& p : points)
            p = {random.uniform(-1, 1), random.uniform(-1, 1)};
        const ConvexHull2 hull(points);
        const auto ellipse = [&] { return Shape2::ellipsoid({1, random.uniform(0.1, 1)}); };
        const Shape2 a = ellipse(), b = round % 2 == 0 ? Shape2(hull) : ellipse();
        const Pose2d pose_a = random.pose2<double>(0);
        Pose2d pose_b = random.pose2<double>(3);
        auto gap = distance(a, pose_a, b, pose_b, INFINITY);
        if (gap->distance < 0.1) continue;
        const Vec2d normal = gap->normal;
        for (const double left : {1e-3, 1e-5, 1e-7, 3e-9, -1e-9}) {
            for (std::size_t d = 0; d < 2; ++d)
                pose_b.position[d] -= (gap->distance - left) * normal[d];
            gap = distance(a, pose_a, b, pose_b, INFINITY);
            ASSERT_NEAR(gap->distance, left, 1e-12) << round;
            const auto found = contacts(a, pose_a, b, pose_b, 0.01);
            ASSERT_EQ(found.size(), 1u) << round;
            for (std::size_t d = 0; d < 2; ++d) {
                ASSERT_NEAR(gap->normal[d], normal[d], 1e-8) << round << " " << left;
                ASSERT_NEAR(found[0].normal[d], normal[d], 1e-8) << round << " " << left;
            }
        }
    }
}

// The depth of what is close to each other is found by a few searches, from either side.
TEST(SmoothShapes, ThatOverlapALittleAreAsDeepAsTheBestDirectionSays)
{
    Random random(66);
    int inexact = 0, unlike = 0;
    for (int round = 0; round < 700; ++round) {
        const auto size = [&] { return random.uniform(0.25, 0.6); };
        const auto smooth = [&](std::uint32_t kind) {
            const double x = size(), y = size(), z = size();
            return kind == 0   ? Shape3::cylinder(x, y)
                   : kind == 1 ? Shape3::cone(x, y)
                   : kind == 2 ? Shape3::ellipsoid({x, y, z})
                   : kind == 3 ? Shape3::box({x, y, z})
                               : Shape3::capsule(x, y);
        };
        std::vector<Vec3d> corners(16);
        for (Vec3d& corner : corners)
            corner = {random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6)};
        const ConvexHull<3> hull(corners);
        const std::uint32_t kind_a = random.below(3), kind_b = random.below(6);
        const Shape3 a = smooth(kind_a), b = kind_b == 5 ? Shape3(hull) : smooth(kind_b);
        const Pose3d pose_a{{0, 0, 0}, random.rotation<double>()};
        Pose3d pose_b;
        for (double& x : pose_b.position)
            x = random.uniform(-1, 1);
        pose_b.rotation = random.rotation<double>();
        const double wanted = random.uniform(0.001, 0.2);
        for (int step = 0; step < 3; ++step) {
            const auto gap = distance(a, pose_a, b, pose_b, INFINITY);
            ASSERT_TRUE(gap);
            for (std::size_t d = 0; d < 3; ++d)
                pose_b.position[d] -= gap->normal[d] * (gap->distance + wanted);
        }
        const auto found = distance(a, pose_a, b, pose_b, INFINITY);
        ASSERT_TRUE(found);
        const double expected = signed_distance(a, pose_a, b, pose_b, narrow::load(found->normal));
        ASSERT_LE(found->distance, expected + 1e-7) << round;
        ASSERT_GE(found->distance, 1.001 * expected - 1e-7) << round << " no more than a thousandth deeper";
        inexact += found->distance < expected - 1e-7 ? 1 : 0;
        const auto mirrored = distance(b, pose_b, a, pose_a, INFINITY);
        ASSERT_TRUE(mirrored);
        unlike += std::abs(mirrored->distance - found->distance) > 1e-9 ? 1 : 0;
        const auto deepest = contacts(a, pose_a, b, pose_b);
        ASSERT_EQ(deepest.size(), 1u) << round;
        ASSERT_NEAR(deepest[0].point[0].depth, -found->distance, 1e-6) << round;
    }
    EXPECT_LE(inexact, 2);
    EXPECT_LE(unlike, 2);
}

// The search for the depth of users' shapes begins with a tetrahedron; here its corners come in either order.
TEST(SmoothShapes, AreExactlyAsDeepFromWhicheverTetrahedron)
{
    const auto about = [](std::size_t axis, double angle, const Vec3d& at) {
        Pose3d pose{at, {}};
        pose.rotation[axis] = std::sin(angle / 2);
        pose.rotation[3] = std::cos(angle / 2);
        return pose;
    };
    struct
    {
        Shape3 a, b;
        Pose3d pose_b;
    } const pairs[] = {
        {Shape3::ellipsoid({0.83, 0.51, 0.38}), Shape3::cylinder(0.29, 0.72),
         about(2, 1.14, {-0.18, -0.22, 0})},
        {Shape3::cylinder(0.75, 1), Shape3::ellipsoid({0.5, 0.4, 0.76}), about(0, -1.53, {0.2, -0.22, 0.02})},
        {Shape3::cone(0.92, 0.98), Shape3::ellipsoid({0.67, 0.52, 0.67}), about(1, -2.36, {0.01, -0.15, 0})},
        {Shape3::cone(0.94, 0.52), Shape3::cone(0.88, 0.9), about(1, 2.69, {-0.01, 0.13, -0.01})},
        {Shape3::cylinder(0.38, 0.49), Shape3::cylinder(0.68, 0.46), about(0, 0.59, {-0.04, -0.29, 0})}};
    for (const auto& [a, b, pose_b] : pairs) {
        const auto found = distance(a, Pose3d{}, b, pose_b, INFINITY);
        ASSERT_TRUE(found);
        const double expected = signed_distance(a, Pose3d{}, b, pose_b, narrow::load(found->normal));
        EXPECT_NEAR(found->distance, expected, 1e-9);
        const Disguised user_a(a), user_b(b);
        const auto known_less = distance(Shape3(user_a, ShapeTypes::first_custom), Pose3d{},
                                         Shape3(user_b, ShapeTypes::first_custom), pose_b, INFINITY);
        ASSERT_TRUE(known_less);
        EXPECT_NEAR(known_less->distance, expected, 1e-4);
    }
}

/// How far a point is from a cylinder's or cone's surface, outside of it, or minus how deep it is inside; in
/// their axes.
double distance_to_round(const Shape3& shape, const Vec3& p)
{
    const double radius = shape.size()[0], half = shape.size()[1], aside = std::sqrt(p.x * p.x + p.z * p.z);
    const Vec2 at{aside, p.y}, tip{0, half}, rim{radius, -half};
    const auto to_segment = [&](const Vec2& a, const Vec2& b) {
        const Vec2 along = b - a;
        const double t = std::clamp(dot(at - a, along) / dot(along, along), 0.0, 1.0);
        return length(at - a - along * t);
    };
    const bool is_cone = shape.type() == ShapeTypes::cone;
    const double to_surface = is_cone
                                  ? std::min(to_segment(tip, rim), to_segment({0, -half}, rim))
                                  : std::min({to_segment({0, half}, {radius, half}),
                                              to_segment({radius, half}, rim), to_segment({0, -half}, rim)});
    const double widest = is_cone ? radius * (half - p.y) / (2 * half) : radius;
    const bool is_inside = std::abs(p.y) <= half && aside <= widest;
    return is_inside ? -to_surface : to_surface;
}

// Also where their centre lies on the surface but for a few digits, on the axis, and in the middle.
TEST(SmoothShapes, HoldBallsThatAreAsDeepAsTheirNearestSideSays)
{
    Random random(4713);
    int inside = 0, on_surface = 0;
    for (int round = 0; round < 20'000; ++round) {
        const double half = std::exp(random.uniform(-2, 2)), radius = std::exp(random.uniform(-2, 2));
        const Shape3 ball = Shape3::sphere(std::exp(random.uniform(-3, 1)));
        const Shape3 shape = random.chance(0.5) ? Shape3::cylinder(half, radius) : Shape3::cone(half, radius);
        const double size = half + radius, angle = random.uniform(0, 7);
        double aside = random.chance(0.2) ? 0 : random.uniform(0, radius), y = random.uniform(-half, half);
        if (random.chance(0.5)) { // on the side, or on a disc
            if (random.chance(0.5))
                y = -half;
            else
                aside = shape.type() == ShapeTypes::cone ? radius * (half - y) / (2 * half) : radius;
            const double off = size * std::exp(random.uniform(-36, -12)) * (random.chance(0.5) ? 1 : -1);
            (y == -half ? y : aside) += off;
            ++on_surface;
        }
        const Vec3 local{aside * std::cos(angle), y, aside * std::sin(angle)};
        const Pose3d at{{},
                        random.chance(0.3) ? std::array<double, 4>{0, 0, 0, 1} : random.rotation<double>()};
        const Vec3 p = narrow::rotation(at) * local;
        const Pose3d ball_at{{p.x, p.y, p.z}, {0, 0, 0, 1}};
        const double expected = distance_to_round(shape, local) - ball.radius();
        inside += expected < -ball.radius() ? 1 : 0;
        const auto found = distance(ball, ball_at, shape, at, INFINITY);
        ASSERT_TRUE(found);
        EXPECT_NEAR(found->distance, expected, 1e-13 * size) << "round " << round;
        if (!(expected < -1e-9 * size)) continue;
        const auto met = contacts(ball, ball_at, shape, at, 0);
        ASSERT_EQ(met.size(), 1u) << "round " << round;
        EXPECT_NEAR(met[0].point[0].depth, -expected, 1e-13 * size) << "round " << round;
        const Vec3 n = narrow::load(met[0].normal);
        EXPECT_NEAR(length(n), 1, 1e-14);
        EXPECT_NEAR(parted_by(n, ball, ball_at, shape, at), expected, 1e-6 * size) << "round " << round;
    }
    EXPECT_GT(inside, 5'000);
    EXPECT_GT(on_surface, 5'000);
}

// Two tips overlap most along the direction in which they were found: no step leads away from there.
TEST(SmoothShapes, ThatMeetTipToTipLeaveSideways)
{
    Random random(4714);
    int too_deep = 0;
    for (int round = 0; round < 300; ++round) {
        const double half_a = random.uniform(0.3, 1), half_b = random.uniform(0.3, 1);
        const double radius_a = half_a * random.uniform(0.3, 2), radius_b = half_b * random.uniform(0.3, 2);
        const double deep = std::exp(random.uniform(-9, -3)) * std::min(half_a, half_b);
        const double aside = random.chance(0.5) ? 0 : deep * random.uniform(0, 1e-3);
        const Shape3 a = Shape3::cone(half_a, radius_a), b = Shape3::cone(half_b, radius_b);
        const Pose3d at_b{{aside, half_a + half_b - deep, 0}, {1, 0, 0, 0}}; // upside down
        const double wider = std::max(radius_a / half_a, radius_b / half_b) / 2;
        const double least = deep * wider / std::sqrt(1 + wider * wider);
        const auto found = distance(a, Pose3d{}, b, at_b, INFINITY);
        ASSERT_TRUE(found);
        too_deep += -found->distance > 1.001 * least ? 1 : 0;
        EXPECT_GE(-found->distance, least - aside - 1e-12) << "round " << round;
    }
    EXPECT_LE(too_deep, 3); // where no number of faces around the tip is enough
}

// Balls inside two shapes say how deep these overlap at least: so they must be inside. One that touches at p
// where n points out is if (1 - d n) of its radius is no more than the shape reaches beyond p, along any
// direction d.
TEST(SmoothShapes, HoldBallsThatTouchTheirSurface)
{
    Random random(4711);
    const auto size = [&] { return std::exp(random.uniform(-2, 2)); };
    const auto unit = [&] {
        const Vec3 d{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
        return d * (1 / length(d));
    };
    const Vec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    int balls = 0, snug = 0;
    for (int round = 0; round < 5000; ++round) {
        std::vector<Vec3d> corners(12);
        for (Vec3d& corner : corners)
            for (double& x : corner)
                x = random.uniform(-1, 1);
        const Vec3d across{size(), size(), size()};
        const ConvexHull3 hull(corners);
        const Shape3 shapes[] = {Shape3::cylinder(across[1], across[0]), Shape3::cone(across[1], across[0]),
                                 Shape3::ellipsoid(across), Shape3::box(across), hull};
        const Shape3& shape = shapes[round % 5];
        const narrow::Core3 core(shape, {});
        // Out of the middle of a face or a side, as far as the shape has any.
        Vec3 n = axes[random.below(3)] * (random.below(2) == 0 ? 1 : -1);
        if (shape.type() == ShapeTypes::convex) {
            n = core.polytope.normal(random.below(core.polytope.faces));
        } else if (shape.type() != ShapeTypes::box && n.y == 0) {
            const double rise = shape.type() == ShapeTypes::cone ? across[0] / (2 * across[1]) : 0;
            n = narrow::across_axis(unit());
            n = Vec3{n.x, rise, n.z} * (1 / std::sqrt(1 + rise * rise));
        }
        if (shape.type() == ShapeTypes::ellipsoid || random.below(8) == 0) n = unit();
        Vec3 p = furthest(core, n);
        for (int k = 0; k < 6; ++k)
            p = p + (furthest(core, n + unit() * 1e-9) - p) * random.uniform(0, 1);

        const narrow::Ball ball = ball_inside(core, p, n);
        EXPECT_GE(ball.radius, 0);
        EXPECT_LE(length(p - n * ball.radius - ball.middle), 1e-7 * core.reach) << "round " << round;
        double most = HUGE_VAL;
        const std::uint32_t faces = core.polytope.faces;
        for (std::uint32_t k = 0; k < 1000; ++k) {
            const Vec3 d = k < 6           ? axes[k / 2] * (k % 2 == 0 ? 1 : -1)
                           : k < 6 + faces ? core.polytope.normal(k - 6)
                                           : unit();
            EXPECT_LE(dot(d, ball.middle) + ball.radius, reach_of(shape, d) + 1e-12 * core.reach)
                << "round " << round << ", along " << d.x << ' ' << d.y << ' ' << d.z;
            if (dot(d, n) < 0.999) most = std::min(most, (reach_of(shape, d) - dot(d, p)) / (1 - dot(d, n)));
        }
        if (shape.type() == ShapeTypes::ellipsoid || !(ball.radius > 1e-6 * core.reach)) continue;
        ++balls;
        snug += most < 1.1 * ball.radius ? 1 : 0;
    }
    EXPECT_GT(balls, 2500);
    EXPECT_GT(snug, 0.9 * balls);
}

// Lines that lie across a triangle: the corners of what is clipped may lie deeper than the two overlap.
TEST(SmoothShapes, WithoutBreadthHaveNoPointDeeperThanTheyAre)
{
    Random random(62);
    int deep = 0;
    for (int round = 0; round < 5000; ++round) {
        std::vector<Vec3d> corners(3);
        for (Vec3d& corner : corners)
            for (double& x : corner)
                x = random.uniform(-1, 1);
        const Mesh3 mesh(corners, std::vector<Mesh3::Element>{{0, 1, 2}});
        const double half = random.uniform(0.1, 1);
        const Shape3 line = round % 2 == 0 ? Shape3::cylinder(half, 0) : Shape3::cone(half, 0);
        const Pose3d pose{{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)},
                          random.rotation<double>()};
        const auto found = distance(Shape3(mesh), Pose3d{}, line, pose, INFINITY);
        ASSERT_TRUE(found);
        for (const auto& contact : contacts(Shape3(mesh), Pose3d{}, line, pose))
            for (std::uint32_t i = 0; i < contact.count; ++i, ++deep)
                ASSERT_LE(contact.point[i].depth, -found->distance + 1e-6) << round;
    }
    EXPECT_GT(deep, 300);
}

// Cylinders and cones that are lines or discs: what is left of their faces.
TEST(SmoothShapes, WithoutBreadthOrHeightAreTouchedWhereTheyAre)
{
    Random random(63);
    int touched = 0;
    for (int round = 0; round < 6000; ++round) {
        const auto size = [&] { return random.uniform(0.2, 1); };
        const std::uint32_t kind = random.below(4);
        const Shape3 thin = kind == 0   ? Shape3::cylinder(size(), 0)
                            : kind == 1 ? Shape3::cone(size(), 0)
                            : kind == 2 ? Shape3::cylinder(0, size())
                                        : Shape3::cone(0, size());
        const std::uint32_t other = random.below(3);
        const Shape3 body = other == 0   ? Shape3::cylinder(size(), size())
                            : other == 1 ? Shape3::cone(size(), size())
                                         : Shape3::box({size(), size(), size()});
        Pose3d pose = random.pose<double>(0.8), pose_body = random.pose<double>(0.8);
        if (random.chance(0.4)) // upright, or upside down
            for (Pose3d* const each : {&pose, &pose_body})
                each->rotation =
                    random.chance(0.5) ? std::array{1.0, 0.0, 0.0, 0.0} : std::array{0.0, 0.0, 0.0, 1.0};
        SCOPED_TRACE(testing::Message()
                     << "round " << round << " types " << thin.type() << " and " << body.type());
        for (const auto& contact : contacts(thin, pose, body, pose_body)) {
            const Vec3 n = narrow::load(contact.normal), half = n * (0.5 * contact.point[0].depth);
            // Its ends lie on the two.
            const Vec3 end = narrow::load(contact.point[0].from_a) + half,
                       end_body = narrow::load(contact.point[0].from_b) - half;
            for (int k = 0; k < 60; ++k) {
                const Vec3 aside{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
                const Vec3 d = aside * (1 / length(aside));
                ASSERT_LE(dot(d, end), reach_of(thin, narrow::rotation(pose).back(d)) + 1e-5);
                ASSERT_LE(dot(d, end_body), reach_of(body, narrow::rotation(pose_body).back(d)) + 1e-5);
            }
            ++touched;
        }
    }
    EXPECT_GT(touched, 1000);
}

TEST(SmoothShapes, HaveBoxesAsTightAsTheirReach)
{
    Random random(62);
    for (int round = 0; round < 2000; ++round) {
        const Shape3 shape = random_shape(random);
        const Pose3d pose = random.pose<double>(3);
        const auto turn = narrow::rotation(pose);
        const Aabb3d box = bounds(shape, pose);
        for (int d = 0; d < 3; ++d) {
            Vec3 axis;
            axis[d] = 1;
            ASSERT_NEAR(box.hi[d], pose.position[d] + reach_of(shape, turn.back(axis)), 1e-12);
            ASSERT_NEAR(box.lo[d], pose.position[d] - reach_of(shape, turn.back(-axis)), 1e-12);
            ASSERT_GE(box.hi[d], pose.position[d] + reach_of(shape, turn.back(axis)));
        }
    }
}

TEST(SmoothShapes, StandAndLieOnSeveralPoints)
{
    const Shape3 floor = Shape3::half_space({0, 1, 0}, 0), slab = Shape3::box({5, 1, 5});
    const Pose3d under{{0, -1, 0}}, lying{{0, 0.49, 0}, {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}};
    const auto points = [&](const Shape3& shape, const Pose3d& pose) {
        const auto on_floor = contacts(floor, Pose3d{}, shape, pose);
        const auto on_slab = contacts(slab, under, shape, pose);
        EXPECT_EQ(on_floor.size(), 1u);
        EXPECT_EQ(on_slab.size(), 1u);
        EXPECT_NEAR(on_floor[0].normal[1], 1, 1e-9);
        EXPECT_NEAR(on_slab[0].normal[1], 1, 1e-9);
        EXPECT_EQ(on_floor[0].count, on_slab[0].count);
        for (const auto& contact : {on_floor[0], on_slab[0]})
            for (std::uint32_t i = 0; i < contact.count; ++i)
                EXPECT_NEAR(contact.point[i].depth, 0.01, 1e-9);
        return on_floor[0].count;
    };
    EXPECT_EQ(points(Shape3::cylinder(1, 0.5), {{0, 0.99, 0}}), 4u);
    EXPECT_EQ(points(Shape3::cylinder(1, 0.5), lying), 2u);
    EXPECT_EQ(points(Shape3::cone(1, 0.5), {{0, 0.99, 0}}), 4u);
    EXPECT_EQ(points(Shape3::cone(1, 0.5), {{0, 0.99, 0}, {1, 0, 0, 0}}), 1u) << "on its tip";
    EXPECT_EQ(points(Shape3::ellipsoid({1, 0.5, 2}), {{0, 0.49, 0}}), 1u);
    EXPECT_EQ(points(Shape3::rounded_box({1, 0.3, 2}, 0.2), {{0, 0.49, 0}}), 4u);
    // One on the other, and a cylinder across another.
    const auto tower =
        contacts(Shape3::cylinder(1, 0.5), Pose3d{}, Shape3::cylinder(1, 0.7), Pose3d{{0.1, 1.99, 0}});
    ASSERT_EQ(tower.size(), 1u);
    EXPECT_EQ(tower[0].count, 4u);
    EXPECT_NEAR(tower[0].point[0].depth, 0.01, 1e-9);
    const auto cross = contacts(Shape3::cylinder(1, 0.5), Pose3d{}, Shape3::cylinder(1, 0.5),
                                Pose3d{{0.99, 0, 0}, {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}});
    ASSERT_EQ(cross.size(), 1u);
    EXPECT_EQ(cross[0].count, 1u);
    EXPECT_NEAR(cross[0].normal[0], 1, 1e-6);
    EXPECT_NEAR(cross[0].point[0].depth, 0.01, 1e-8);
    EXPECT_NEAR(cross[0].point[0].from_a[0], 0.495, 1e-6);
    const auto beside =
        contacts(Shape3::cylinder(1, 0.5), Pose3d{}, Shape3::cylinder(1, 0.5), Pose3d{{0.99, 0.5, 0}});
    ASSERT_EQ(beside.size(), 1u);
    EXPECT_EQ(beside[0].count, 2u) << "along the line that they share";
}

/// In one place, turned alike: the way out is across what is narrowest, and as long as both are wide there.
TEST(SmoothShapes, InOnePlaceAreAsDeepAsTheyAreNarrow)
{
    Random random(65);
    for (int round = 0; round < 300; ++round) {
        Pose3d pose;
        pose.rotation = random.rotation<double>();
        Vec<3, double> one, other;
        for (std::size_t d = 0; d < 3; ++d)
            one[d] = random.uniform(0.2, 2), other[d] = random.uniform(0.2, 2);
        double least = HUGE_VAL;
        for (std::size_t d = 0; d < 3; ++d)
            least = std::min(least, one[d] + other[d]);
        const auto depth_of = [&](const Shape3& a, const Shape3& b) {
            return -distance(a, pose, b, pose, INFINITY)->distance;
        };
        ASSERT_NEAR(depth_of(Shape3::ellipsoid(one), Shape3::ellipsoid(other)), least, 0.01 * least) << round;
        ASSERT_NEAR(depth_of(Shape3::ellipsoid(one), Shape3::box(other)), least, 0.01 * least) << round;
        // A cylinder is as wide across its axis as along it, or less.
        const double r = one[0], h = one[1], s = other[0], k = other[1];
        ASSERT_NEAR(depth_of(Shape3::cylinder(h, r), Shape3::cylinder(k, s)), std::min(h + k, r + s),
                    0.01 * (h + k + r + s))
            << round;
    }
}

/// An ellipsoid whose half widths are equal is a ball, a cylinder without length a disc, and so on.
TEST(SmoothShapes, AreTheSimplerOnesThatTheyCanBe)
{
    Random random(63);
    for (int round = 0; round < 500; ++round) {
        const Shape3 other = random_shape(random);
        const Pose3d pose = random.pose<double>(1), there = random.pose<double>(2.5);
        const double r = random.uniform(0.1, 1), h = random.uniform(0.1, 1);
        const std::pair<Shape3, Shape3> same[] = {{Shape3::ellipsoid({r, r, r}), Shape3::sphere(r)},
                                                  {Shape3::rounded_box({0, h, 0}, r), Shape3::capsule(h, r)},
                                                  {Shape3::rounded_box({r, h, 1}, 0), Shape3::box({r, h, 1})},
                                                  {Shape3::cylinder(h, 0), Shape3::capsule(h, 0)},
                                                  {Shape3::cone(h, 0), Shape3::capsule(h, 0)}};
        for (const auto& [one, two] : same) {
            const double a = distance(one, pose, other, there, INFINITY)->distance,
                         b = distance(two, pose, other, there, INFINITY)->distance;
            if (a > 0 || b > 0) {
                ASSERT_NEAR(a, b, 1e-6) << round << " types " << one.type() << " " << other.type();
            }
        }
    }
}

TEST(SmoothShapes, OfNoLengthOrTooMuchAreErrors)
{
    EXPECT_NE(
        message_of([] { return Shape3::rounded_box({1, 1, 1}, -1); }).find("rounded box's radius is -1"),
        std::string::npos);
    EXPECT_NE(message_of([] { return Shape3::rounded_box({1, NAN, 1}, 1); }).find("half edge"),
              std::string::npos);
    EXPECT_NE(message_of([] { return Shape3::cylinder(-2, 1); }).find("cylinder's half length is -2"),
              std::string::npos);
    EXPECT_NE(message_of([] { return Shape3::cylinder(1, INFINITY); }).find("cylinder's radius is inf"),
              std::string::npos);
    EXPECT_NE(message_of([] { return Shape3::cone(NAN, 1); }).find("cone's half length"), std::string::npos);
    EXPECT_NE(message_of([] { return Shape3::ellipsoid({1, 2, -3}); }).find("-3"), std::string::npos);
    EXPECT_NE(message_of([] { return Shape2::ellipsoid({1e61, 1}); }).find("1e+61"), std::string::npos);
    const ConvexHull2 hull(std::vector<Vec2d>{{0, 0}, {1, 0}, {0, 1}});
    EXPECT_NE(message_of([&] { return Shape2::rounded_hull(hull, -1); }).find("rounded hull's radius"),
              std::string::npos);
}

TEST(TheZoo, HasEveryTypeThereIs)
{
    Random random(64);
    const Zoo<3> zoo(random, 1);
    const Zoo<2> zoo2(random, 1);
    for (ShapeType type = 0; type < ShapeTypes::end; ++type) {
        const auto has = [&](const auto& shapes) {
            return std::any_of(shapes.begin(), shapes.end(),
                               [&](const auto& shape) { return shape.type() == type; });
        };
        EXPECT_TRUE(has(zoo.shapes)) << type;
        const bool of_space =
            type == ShapeTypes::height_field || type == ShapeTypes::cylinder || type == ShapeTypes::cone;
        EXPECT_EQ(has(zoo2.shapes), !of_space) << type;
    }
}

} // namespace
