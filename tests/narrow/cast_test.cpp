// SPDX-License-Identifier: MIT
// Rays and moving shapes against every shape, and against the definition.
#include <gtest/gtest.h>

#include <limits>

#include "narrow/math.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

template <int Dim>
double size_of(const Vec<Dim, double>& v)
{
    return std::sqrt(dot(v, v));
}
template <int Dim>
Vec<Dim, double> random_vector(Random& random, double spread)
{
    Vec<Dim, double> v;
    for (double& x : v)
        x = random.chance(0.2) ? std::round(random.uniform(-spread, spread))
                               : random.uniform(-spread, spread);
    return v;
}
template <int Dim>
Ray<Dim, double> random_ray(Random& random)
{
    Ray<Dim, double> ray{
        random_vector<Dim>(random, 4), {}, random.chance(0.5) ? infinity : random.uniform(0, 3)};
    while (ray.direction == Vec<Dim, double>{}) {
        if (random.chance(0.7)) // to where shapes are
            ray.direction = random_vector<Dim>(random, 1) - ray.origin;
        else
            ray.direction = random_vector<Dim>(random, 2);
        if (random.chance(0.3)) ray.direction[static_cast<int>(random.below(Dim))] = 0;
    }
    return ray;
}
template <int Dim>
bool is_solid(const Shape<Dim>& shape)
{
    return shape.type() != ShapeTypes::mesh;
}

/// Whether a ray a billionth beside this one hits what this one misses: at that fraction, but for `reach`.
template <int Dim>
bool hits_beside(const Shape<Dim>& shape, const Pose<Dim, double>& pose, const Ray<Dim, double>& ray,
                 double fraction, double reach)
{
    const double length = size_of(ray.direction);
    for (int d = 0; d < Dim; ++d)
        for (const double shift : {-1e-9, 1e-9}) {
            Ray<Dim, double> beside = ray;
            beside.origin[d] += shift;
            const auto hit = ray_cast(shape, pose, beside);
            if (hit && std::abs(hit->fraction - fraction) * length <= reach) return true;
        }
    return false;
}

/// A ray is what a point passes that moves: shape_cast finds its way by distances alone.
template <int Dim>
void rays_are_points_that_move(std::uint64_t seed)
{
    Random random(seed);
    std::size_t hits = 0, misses = 0, inside = 0, grazing = 0;
    for (int round = 0; round < 250; ++round) {
        const Zoo<Dim> zoo(random, 1, round % 2 == 0);
        for (const Shape<Dim>& shape : zoo.shapes)
            for (int k = 0; k < 12; ++k) {
                const Pose<Dim, double> pose = random_pose<Dim, double>(random, 1);
                const Ray<Dim, double> ray = random_ray<Dim>(random);
                SCOPED_TRACE(testing::Message()
                             << "round " << round << " type " << shape.type() << " ray " << k);
                const auto hit = ray_cast(shape, pose, ray);
                const double most = std::min(ray.max_fraction, 40 / size_of(ray.direction));
                Pose<Dim, double> at;
                at.position = ray.origin;
                const auto moved = shape_cast(Shape<Dim>(), at, ray.direction * most, shape, pose);
                if (hit.has_value() != moved.has_value()) {
                    // A distance below a billionth of the size counts as a touch, a ray that passes by
                    // doesn't; one that runs along a triangle is none, a point that does touches it.
                    ++grazing;
                    continue;
                }
                (hit ? hits : misses) += 1;
                if (!hit) continue;
                ASSERT_GE(hit->fraction, 0);
                ASSERT_LE(hit->fraction, ray.max_fraction);
                ASSERT_NEAR(size_of(hit->normal), 1, 1e-12);
                ASSERT_LE(dot(hit->normal, ray.direction), 1e-12 * size_of(ray.direction));
                const Vec<Dim, double> there = ray.origin + ray.direction * hit->fraction - pose.position;
                ASSERT_NEAR(size_of(there - hit->point), 0, 1e-12);
                // Along a surface a small error of the distance is a large one of the way.
                const double steep = -dot(hit->normal, ray.direction) / size_of(ray.direction);
                const double reach = 1e-7 / std::max(steep * steep, 1e-7);
                if ((hit->fraction - moved->fraction * most) * size_of(ray.direction) > reach &&
                    hits_beside(shape, pose, ray, moved->fraction * most, reach)) {
                    ++grazing; // it passes by the end of a segment that the point touches
                    continue;
                }
                ASSERT_NEAR(hit->fraction * size_of(ray.direction),
                            moved->fraction * most * size_of(ray.direction), reach);
                if (hit->fraction == 0 && is_solid(shape)) {
                    ++inside;
                    ASSERT_NEAR(dot(hit->normal, ray.direction), -size_of(ray.direction), 1e-9);
                } else if (moved->part == hit->part && shape.type() != ShapeTypes::mesh && steep > 1e-2 &&
                           moved->fraction > 0) {
                    // At an edge both may have another side's; then both sides are there.
                    Pose<Dim, double> before;
                    before.position = pose.position + hit->point + hit->normal * 1e-5;
                    const auto gap = distance(Shape<Dim>(), before, shape, pose, 1.0);
                    if (shape.type() != ShapeTypes::height_field) {
                        ASSERT_TRUE(gap);
                        ASSERT_NEAR(gap->distance, 1e-5, 1e-7);
                    }
                }
            }
    }
    EXPECT_GT(hits, 2000u);
    EXPECT_GT(misses, 2000u);
    EXPECT_GT(inside, 200u);
    EXPECT_LT(grazing * 50, hits);
}

TEST(RayCast, MeetsWhatAPointMeetsThatMoves)
{
    rays_are_points_that_move<3>(1);
}
TEST(RayCast, MeetsWhatAPointMeetsThatMovesInThePlane)
{
    rays_are_points_that_move<2>(2);
}

/// Moeller and Trumbore's test of each triangle.
struct Nearest
{
    double fraction = infinity;
    std::uint32_t part = 0;
};
Nearest through_all(const std::vector<Vec3d>& vertices, const std::vector<Mesh<3>::Element>& triangles,
                    const Ray3d& ray)
{
    Nearest best;
    for (std::uint32_t e = 0; e < triangles.size(); ++e) {
        const Vec3d a = vertices[triangles[e][0]], ab = vertices[triangles[e][1]] - a,
                    ac = vertices[triangles[e][2]] - a, p = cross(ray.direction, ac), from = ray.origin - a,
                    q = cross(from, ab);
        const double det = dot(ab, p), u = dot(from, p) / det, v = dot(ray.direction, q) / det,
                     t = dot(ac, q) / det;
        if (!(u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= ray.max_fraction)) continue;
        if (t < best.fraction) best = {t, e};
    }
    return best;
}

/// A cone without height is a disc, which a ray may be through before it notices.
TEST(RayCast, OfAFlatConeMeetsItsDisc)
{
    Random random(97);
    std::size_t hits = 0;
    for (int round = 0; round < 5000; ++round) {
        const double size = std::exp(random.uniform(-2, 2));
        const double thin = random.chance(0.5) ? 0 : size * std::pow(10, random.uniform(-20, -16));
        const Shape<3> cone = Shape<3>::cone(thin, size);
        const Pose<3, double> pose{{}, random.rotation<double>()};
        const Ray<3, double> ray = random_ray<3>(random);
        const auto hit = ray_cast(cone, pose, ray);
        if (!hit || hit->fraction == 0) continue;
        ++hits;
        Pose<3, double> before;
        before.position = hit->point + hit->normal * 1e-5;
        const auto gap = distance(Shape<3>(), before, cone, pose, 1.0);
        ASSERT_TRUE(gap);
        ASSERT_NEAR(gap->distance, 1e-5, 1e-9) << "round " << round;
    }
    EXPECT_GT(hits, 500u);
}

TEST(RayCast, OfAMeshIsTheNearestOfAllTriangles)
{
    Random random(3);
    std::size_t hits = 0;
    for (int round = 0; round < 40; ++round) {
        std::vector<Vec3d> vertices(60);
        for (Vec3d& p : vertices)
            p = random_vector<3>(random, 2);
        std::vector<Mesh<3>::Element> triangles(1 + random.below(300));
        for (auto& triangle : triangles)
            for (std::uint32_t& v : triangle)
                v = random.below(60);
        const Mesh<3> mesh(vertices, triangles);
        for (int k = 0; k < 300; ++k) {
            Ray3d ray;
            ray.origin = random_vector<3>(random, 5) + Vec3d(1e-3, 2e-3, 3e-3);
            ray.direction = random_vector<3>(random, 1.5) - ray.origin + Vec3d(0.0123, 0.0456, 0.0789);
            ray.max_fraction = random.chance(0.5) ? infinity : random.uniform(0, 2);
            const auto hit = ray_cast(Shape3(mesh), Pose3d{}, ray);
            const Nearest twin = through_all(vertices, triangles, ray);
            ASSERT_EQ(hit.has_value(), twin.fraction < infinity) << round << " " << k;
            if (!hit) continue;
            ++hits;
            ASSERT_NEAR(hit->fraction, twin.fraction, 1e-9);
            if (hit->part != twin.part) { // two that are hit at once
                Ray3d back = ray;
                back.max_fraction = hit->fraction * (1 - 1e-9);
                ASSERT_FALSE(ray_cast(Shape3(mesh), Pose3d{}, back));
            }
        }
    }
    EXPECT_GT(hits, 3000u);
}

/// Through the middle of sides and through corners, from far away, in any turn.
TEST(RayCast, NeverSlipsThroughWhatTrianglesShare)
{
    Random random(4);
    constexpr std::uint32_t n = 12;
    for (int round = 0; round < 30; ++round) {
        std::vector<Vec3d> vertices;
        std::vector<double> heights;
        for (std::uint32_t z = 0; z < n; ++z)
            for (std::uint32_t x = 0; x < n; ++x) {
                heights.push_back(random.uniform(-0.5, 0.5));
                vertices.push_back({double(x), heights.back(), double(z)});
            }
        std::vector<Mesh<3>::Element> triangles;
        for (std::uint32_t z = 0; z + 1 < n; ++z)
            for (std::uint32_t x = 0; x + 1 < n; ++x) {
                const std::uint32_t v = z * n + x;
                triangles.push_back({v, v + n + 1, v + 1});
                triangles.push_back({v, v + n, v + n + 1});
            }
        const Mesh<3> mesh(vertices, triangles);
        const HeightField field(HeightGrid<double>{heights, n, n, 1, 1});
        const Pose3d pose = round == 0 ? Pose3d{} : random.pose<double>(round % 3 == 0 ? 1e6 : 3);
        const narrow::Mat3 turn = narrow::rotation(pose);
        for (int k = 0; k < 300; ++k) {
            // A point of a side, or a corner, that isn't on the rim.
            const auto& triangle = triangles[random.below(static_cast<std::uint32_t>(triangles.size()))];
            const Vec3d p = vertices[triangle[0]], q = vertices[triangle[1 + random.below(2)]];
            const double share = random.chance(0.3) ? 0 : random.chance(0.5) ? 0.5 : random.uniform(0, 1);
            const Vec3d goal = p + (q - p) * share;
            if (goal[0] < 0.5 || goal[2] < 0.5 || goal[0] > n - 1.5 || goal[2] > n - 1.5) continue;
            const Vec3d way{random.chance(0.3) ? 0 : random.uniform(-0.3, 0.3), -1,
                            random.chance(0.3) ? 0 : random.uniform(-0.3, 0.3)};
            const auto placed = [&](const Vec3d& v) {
                const narrow::Vec3 w = turn * narrow::Vec3{v[0], v[1], v[2]};
                return Vec3d{w.x, w.y, w.z};
            };
            const double far = random.chance(0.2) ? 1000 : 3;
            Ray3d ray{placed(goal - way * far) + pose.position, placed(way)};
            for (const Shape3& shape : {Shape3(mesh), Shape3(field)}) {
                const auto hit = ray_cast(shape, pose, ray);
                ASSERT_TRUE(hit) << round << " " << k << " type " << shape.type();
                ASSERT_LE(hit->fraction, far * (1 + 1e-6));
                ASSERT_GT(dot(hit->normal, placed({0, 1, 0})), 0) << "a side that two prisms share";
            }
        }
    }
}

TEST(RayCast, OfAHeightFieldKnowsItsSidesAndUnderside)
{
    const std::vector<double> heights{0, 0.5, 0, 0, 0, 0.25, 0, 0, 0};
    const HeightField field(HeightGrid<double>{heights, 3, 3, 1, 1, 2});
    const Shape3 shape(field);
    const auto cast = [&](const Vec3d& from, const Vec3d& way) {
        return ray_cast(shape, Pose3d{}, Ray3d{from, way});
    };
    const auto up = cast({0.7, -5, 0.4}, {0, 1, 0});
    ASSERT_TRUE(up);
    EXPECT_NEAR(up->fraction, 3, 1e-12);
    EXPECT_EQ(up->normal, (Vec3d{0, -1, 0}));
    const auto side = cast({-3, -1, 0.4}, {2, 0, 0});
    ASSERT_TRUE(side);
    EXPECT_NEAR(side->fraction, 1.5, 1e-12);
    EXPECT_EQ(side->normal, (Vec3d{-1, 0, 0}));
    const auto within = cast({0.7, -1, 0.4}, {0, 0, 2});
    ASSERT_TRUE(within);
    EXPECT_EQ(within->fraction, 0);
    EXPECT_EQ(within->normal, (Vec3d{0, 0, -1}));
    EXPECT_FALSE(cast({-3, -2.5, 0.4}, {2, 0, 0})) << "under it";
    EXPECT_FALSE(cast({2.5, 5, 0.4}, {0, -1, 0})) << "beside it";
}

TEST(RayCast, SaysWhichPartAndWhichSide)
{
    const Mesh<3> mesh(std::vector<Vec3d>{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {5, 0, 0}},
                       std::vector<Mesh<3>::Element>{{0, 1, 3}, {0, 1, 2}, {0, 2, 1}});
    const auto above = ray_cast(Shape3(mesh), Pose3d{}, Ray3d{{0.2, 1, 0.2}, {0, -1, 0}});
    const auto below = ray_cast(Shape3(mesh), Pose3d{}, Ray3d{{0.2, -1, 0.2}, {0, 1, 0}});
    ASSERT_TRUE(above && below);
    EXPECT_EQ(above->part, 0u) << "of equals the lowest number";
    EXPECT_EQ(above->normal, (Vec3d{0, 1, 0}));
    EXPECT_EQ(below->normal, (Vec3d{0, -1, 0}));
    const Compound<3> compound(std::vector<Compound<3>::Child>{{Shape3::sphere(1), Pose3d{{0, 0, 0}}},
                                                               {Shape3::sphere(1), Pose3d{{5, 0, 0}}}});
    const auto second = ray_cast(Shape3(compound), Pose3d{{0, 0, 1}}, Ray3d{{9, 0, 1}, {-2, 0, 0}});
    ASSERT_TRUE(second);
    EXPECT_EQ(second->part, 1u);
    EXPECT_NEAR(second->fraction, 1.5, 1e-12);
    EXPECT_NEAR(second->point[0], 6, 1e-12);
    EXPECT_NEAR(second->point[2], 0, 1e-12) << "from the position of the pose";
}

TEST(RayCast, CountsItsEndIn)
{
    for (const float length : {1.0f, 0.125f, 3e-30f, 1e30f}) {
        const auto hit =
            ray_cast(Shape3::box({1, 1, 1}), Pose3f{{5, 0, 0}}, Ray3f{{0, 0, 0}, {length, 0, 0}, 4 / length});
        ASSERT_TRUE(hit) << length;
        EXPECT_EQ(hit->fraction, 4 / length);
    }
    EXPECT_FALSE(ray_cast(Shape3::box({1, 1, 1}), Pose3f{{5, 0, 0}}, Ray3f{{0, 0, 0}, {1, 0, 0}, 3.9999f}));
    const auto none = ray_cast(Shape3::sphere(1), Pose3f{{0.5f, 0, 0}}, Ray3f{{0, 0, 0}, {1, 0, 0}, 0});
    ASSERT_TRUE(none) << "a ray of no length that begins inside";
    EXPECT_EQ(none->fraction, 0);
}

TEST(RayCast, FromFarAwayIsAsExactAsItsNumbers)
{
    const Mesh<3> mesh(std::vector<Vec3d>{{0, -1, -1}, {0, 1, -1}, {0, 0, 1}},
                       std::vector<Mesh<3>::Element>{{0, 1, 2}});
    const std::vector<Vec3d> corners{{0, -1, -1}, {0, 1, -1}, {0, 0, 1}, {1, 0, 0}};
    const ConvexHull<3> hull(corners);
    for (const double far : {1e3, 1e9, 1e15, 1e50})
        for (const Shape3& shape : {Shape3::sphere(1), Shape3::capsule(1, 1), Shape3::box({1, 1, 1}),
                                    Shape3(hull), Shape3(mesh), Shape3::half_space({-1, 0, 0}, 0)}) {
            const auto hit = ray_cast(shape, Pose3d{}, Ray3d{{-far, 0, 0}, {far, 0, 0}});
            ASSERT_TRUE(hit) << far << " type " << shape.type();
            EXPECT_NEAR(hit->fraction * far, far, 1.0 + 1e-9);
            EXPECT_NEAR(hit->normal[0], -1, 1e-6);
        }
}

/// Every shape that moves against every other: no sooner and no later than distances say.
template <int Dim>
void casts_touch_first(std::uint64_t seed, int rounds)
{
    Random random(seed);
    std::size_t hits = 0, misses = 0;
    for (int round = 0; round < rounds; ++round) {
        const Zoo<Dim> zoo(random, 1, round % 2 == 0);
        for (int k = 0; k < 12; ++k) {
            const Shape<Dim>&a = zoo.any(random), &b = zoo.any(random);
            SCOPED_TRACE(testing::Message() << round << " " << k << " types " << a.type() << " " << b.type());
            Pose<Dim, double> pose = random_pose<Dim, double>(random, 4);
            const Pose<Dim, double> other = random_pose<Dim, double>(random, 1);
            const Vec<Dim, double> way = random.chance(0.7)
                                             ? other.position - pose.position + random_vector<Dim>(random, 1)
                                             : random_vector<Dim>(random, 5);
            const auto hit = shape_cast(a, pose, way, b, other);
            Motion<Dim, double> motion, still;
            motion.pose = pose;
            motion.linear = way;
            still.pose = other;
            const double tolerance = 1e-6;
            const auto twin = time_of_impact(a, motion, b, still, tolerance);
            const auto at = [&](double t) {
                Pose<Dim, double> then = pose;
                then.position += way * t;
                return then;
            };
            const bool ground = a.type() == ShapeTypes::height_field || b.type() == ShapeTypes::height_field;
            const double until = hit ? hit->fraction : 1;
            for (int i = 0; i < 40 && until > 0; ++i) {
                const double t = until * (hit ? 1 - 1e-6 : 1) * i / 40;
                const auto gap = distance(a, at(t), b, other, infinity);
                if (gap && !ground) {
                    ASSERT_GT(gap->distance, -1e-6) << "touched before, at " << t;
                }
            }
            if (twin && !hit) { // they pass within the tolerance
                const auto gap = distance(a, at(twin->time), b, other, infinity);
                if (gap && !ground) {
                    ASSERT_GT(gap->distance, 0);
                }
                ++misses;
                continue;
            }
            if (!hit) {
                ++misses;
                continue;
            }
            ++hits;
            ASSERT_TRUE(twin) << "at " << hit->fraction;
            ASSERT_LE(twin->time, hit->fraction + 1e-9);
            ASSERT_NEAR(size_of(hit->normal), 1, 1e-9);
            if (hit->fraction > 0) {
                ASSERT_LT(dot(hit->normal, way), 1e-9 * size_of(way));
                if (!ground) {
                    const auto gap = distance(a, at(hit->fraction), b, other, infinity);
                    ASSERT_TRUE(gap);
                    ASSERT_NEAR(gap->distance, 0, 1e-6);
                }
            }
            // The point lies on both.
            Pose<Dim, double> there;
            there.position = other.position + hit->point;
            if (hit->fraction > 0 && !ground)
                for (const auto& [shape, where] : {std::pair(a, at(hit->fraction)), std::pair(b, other)}) {
                    const auto off = distance(Shape<Dim>(), there, shape, where, infinity);
                    ASSERT_TRUE(off);
                    ASSERT_LE(off->distance, 1e-5);
                }
        }
    }
    EXPECT_GT(hits, misses / 4);
    EXPECT_GT(misses, 100u);
}

TEST(ShapeCast, TouchesFirstWhereDistancesSay)
{
    casts_touch_first<3>(11, 150);
}
TEST(ShapeCast, TouchesFirstWhereDistancesSayInThePlane)
{
    casts_touch_first<2>(12, 150);
}

TEST(ShapeCast, IsExactWhereItCanBeTold)
{
    const auto ball =
        shape_cast(Shape3::sphere(0.5), Pose3d{{-10, 0.6, 0}}, {20, 0, 0}, Shape3::sphere(0.5), Pose3d{});
    ASSERT_TRUE(ball);
    EXPECT_NEAR(ball->fraction, (10 - 0.8) / 20, 1e-12);
    EXPECT_NEAR(ball->normal[0], -0.8, 1e-9);
    EXPECT_NEAR(ball->normal[1], 0.6, 1e-9);
    EXPECT_NEAR(ball->point[0], -0.4, 1e-9);
    const auto boxes =
        shape_cast(Shape3::box({1, 1, 1}), Pose3d{{0, 5, 0}}, {0, -8, 0}, Shape3::box({3, 1, 3}), Pose3d{});
    ASSERT_TRUE(boxes);
    EXPECT_NEAR(boxes->fraction, 3.0 / 8, 1e-12);
    EXPECT_NEAR(boxes->normal[1], 1, 1e-12);
    EXPECT_NEAR(boxes->point[1], 1, 1e-9);
    // At the start, and not at all.
    const auto start =
        shape_cast(Shape3::box({1, 1, 1}), Pose3d{{0, 1.5, 0}}, {0, 8, 0}, Shape3::box({3, 1, 3}), Pose3d{});
    ASSERT_TRUE(start);
    EXPECT_EQ(start->fraction, 0);
    EXPECT_NEAR(start->normal[1], 1, 1e-12);
    EXPECT_FALSE(
        shape_cast(Shape3::box({1, 1, 1}), Pose3d{{0, 2.5, 0}}, {0, 8, 0}, Shape3::box({3, 1, 3}), Pose3d{}));
    EXPECT_FALSE(shape_cast(Shape3::sphere(1), Pose3d{{0, 3, 0}}, {0, 0, 0}, Shape3::sphere(1), Pose3d{}));
    EXPECT_TRUE(shape_cast(Shape3::sphere(1), Pose3d{{0, 1, 0}}, {0, 0, 0}, Shape3::sphere(1), Pose3d{}));
    EXPECT_FALSE(shape_cast(Shape3::half_space({0, 1, 0}, 0), Pose3d{}, {0, 1, 0},
                            Shape3::half_space({0, 1, 0}, 0), Pose3d{}));
}

/// Meshes meet through their trees as triangle by triangle.
TEST(ShapeCast, OfMeshesIsTheFirstOfAllPairsOfTriangles)
{
    Random random(13);
    std::size_t hits = 0;
    for (int round = 0; round < 60; ++round) {
        std::vector<Vec3d> vertices[2];
        std::vector<Mesh<3>::Element> triangles[2];
        std::vector<Mesh<3>> meshes;
        for (int m = 0; m < 2; ++m) {
            for (int i = 0; i < 14; ++i)
                vertices[m].push_back(random_vector<3>(random, 1));
            for (int i = 0; i < 12; ++i)
                triangles[m].push_back({random.below(14), random.below(14), random.below(14)});
            meshes.emplace_back(vertices[m], triangles[m]);
        }
        const Pose3d pose = random.pose<double>(4), other = random.pose<double>(1);
        const Vec3d way = other.position - pose.position + random_vector<3>(random, 1);
        const auto hit = shape_cast(Shape3(meshes[0]), pose, way, Shape3(meshes[1]), other);
        double first = infinity;
        for (const auto& one : triangles[0])
            for (const auto& two : triangles[1]) {
                const Mesh<3> a(vertices[0], {one}), b(vertices[1], {two});
                if (const auto each = shape_cast(Shape3(a), pose, way, Shape3(b), other))
                    first = std::min(first, each->fraction);
            }
        ASSERT_EQ(hit.has_value(), first < infinity) << round;
        if (!hit) continue;
        ++hits;
        ASSERT_NEAR(hit->fraction, first, 1e-9) << round;
        const Mesh<3> a(vertices[0], {triangles[0][hit->moving_part]}),
            b(vertices[1], {triangles[1][hit->part]});
        const auto parts = shape_cast(Shape3(a), pose, way, Shape3(b), other);
        ASSERT_TRUE(parts);
        ASSERT_NEAR(parts->fraction, hit->fraction, 1e-9);
    }
    EXPECT_GT(hits, 20u);
}

template <class Space>
class Casts : public testing::Test
{
};
struct In2f
{
    static constexpr int dim = 2;
    using T = float;
};
struct In3f
{
    static constexpr int dim = 3;
    using T = float;
};
struct In2d
{
    static constexpr int dim = 2;
    using T = double;
};
struct In3d
{
    static constexpr int dim = 3;
    using T = double;
};
using Spaces = testing::Types<In2f, In3f, In2d, In3d>;
TYPED_TEST_SUITE(Casts, Spaces);

TYPED_TEST(Casts, InBatchesHaveTheSameBitsOnAnySetAndThreads)
{
    constexpr int Dim = TypeParam::dim;
    using T = typename TypeParam::T;
    Random random(21);
    const Zoo<Dim> zoo(random, 2);
    std::vector<Pose<Dim, T>> poses, starts;
    std::vector<Shape<Dim>> movers;
    std::vector<Vec<Dim, T>> ways;
    std::vector<Ray<Dim, T>> rays;
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < zoo.shapes.size(); ++i)
        poses.push_back(random_pose<Dim, T>(random, 1));
    for (std::uint32_t k = 0; k < 60; ++k) {
        const Ray<Dim, double> ray = random_ray<Dim>(random);
        Ray<Dim, T> rounded;
        for (int d = 0; d < Dim; ++d) {
            rounded.origin[d] = static_cast<T>(ray.origin[d]);
            rounded.direction[d] = static_cast<T>(ray.direction[d]);
        }
        rays.push_back(rounded);
        movers.push_back(zoo.any(random));
        starts.push_back(random_pose<Dim, T>(random, 3));
        ways.push_back(rounded.direction);
        for (std::uint32_t i = 0; i < zoo.shapes.size(); ++i)
            pairs.push_back({k, i});
    }
    std::vector<CastHit<Dim, T>> expected_rays, expected_shapes;
    std::size_t hits = 0;
    for (const Pair& pair : pairs) {
        const auto none = [] {
            CastHit<Dim, T> hit{};
            hit.fraction = std::numeric_limits<T>::infinity();
            return hit;
        };
        const auto ray = ray_cast(zoo.shapes[pair.b], poses[pair.b], rays[pair.a]);
        const auto shape =
            shape_cast(movers[pair.a], starts[pair.a], ways[pair.a], zoo.shapes[pair.b], poses[pair.b]);
        hits += ray && shape ? 1 : 0;
        expected_rays.push_back(ray ? *ray : none());
        expected_shapes.push_back(shape ? *shape : none());
    }
    EXPECT_GT(hits, 20u);
    const auto same = [](const CastHit<Dim, T>& a, const CastHit<Dim, T>& b) {
        return a.fraction == b.fraction && a.normal == b.normal && a.point == b.point && a.part == b.part &&
               a.moving_part == b.moving_part;
    };
    for (const InstructionSet set : supported_instruction_sets())
        for (const unsigned threads : {1u, 3u}) {
            const auto executor = make_thread_executor(threads);
            ContactOptions options;
            options.executor = executor.get();
            options.instruction_set = set;
            ContactFinder<Dim, T> finder(options);
            std::vector<CastHit<Dim, T>> out(pairs.size());
            finder.ray_casts(rays, {zoo.shapes, poses}, pairs, out);
            for (std::size_t i = 0; i < out.size(); ++i)
                ASSERT_TRUE(same(out[i], expected_rays[i])) << i;
            finder.shape_casts({movers, starts}, ways, {zoo.shapes, poses}, pairs, out);
            for (std::size_t i = 0; i < out.size(); ++i)
                ASSERT_TRUE(same(out[i], expected_shapes[i])) << i;
        }
}

TEST(Casts, OfWhatIsNoRayAreErrors)
{
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const auto message = [](auto&& call) -> std::string {
        try {
            call();
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    };
    const Shape3 ball = Shape3::sphere(1);
    for (const Ray3d& ray :
         {Ray3d{{nan, 0, 0}, {1, 0, 0}}, Ray3d{{infinity, 0, 0}, {1, 0, 0}}, Ray3d{{1e61, 0, 0}, {1, 0, 0}},
          Ray3d{{0, 0, 0}, {0, 0, 0}}, Ray3d{{0, 0, 0}, {nan, 0, 0}}, Ray3d{{0, 0, 0}, {1, infinity, 0}},
          Ray3d{{0, 0, 0}, {1e-310, 0, 0}}, Ray3d{{0, 0, 0}, {1, 0, 0}, -1},
          Ray3d{{0, 0, 0}, {1, 0, 0}, nan}})
        EXPECT_NE(message([&] { (void)ray_cast(ball, Pose3d{}, ray); }).find("a ray has origin"),
                  std::string::npos);
    EXPECT_NE(
        message([&] { (void)ray_cast(ball, Pose3d{{nan, 0, 0}}, Ray3d{{0, 0, 0}, {1, 0, 0}}); }).find("nan"),
        std::string::npos);
    for (const double bad : {nan, infinity, 1e61})
        EXPECT_NE(message([&] {
                      (void)shape_cast(ball, Pose3d{}, {0, bad, 0}, ball, Pose3d{});
                  }).find("displacement"),
                  std::string::npos);
    // The one at fault, by its number.
    const std::vector<Shape3> shapes{ball, ball};
    const std::vector<Pose3d> poses{{}, {{5, 0, 0}}};
    std::vector<Ray3d> rays{{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {0, 0, 0}}};
    std::vector<CastHit<3, double>> out(1);
    ContactFinder3d finder;
    const auto cast = [&](Pair pair) {
        return message([&] { finder.ray_casts(rays, {shapes, poses}, std::vector<Pair>{pair}, out); });
    };
    EXPECT_EQ(cast({0, 1}), "");
    EXPECT_NE(cast({1, 0}).find("the ray 1 has"), std::string::npos) << cast({1, 0});
    EXPECT_NE(cast({2, 0}).find("pair 0 names"), std::string::npos);
    EXPECT_NE(cast({0, 2}).find("pair 0 names"), std::string::npos);
    const std::vector<Vec3d> ways{{0, 0, 0}};
    EXPECT_NE(message([&] {
                  finder.shape_casts({shapes, poses}, ways, {shapes, poses}, std::vector<Pair>{{0, 1}}, out);
              }).find("1 displacements"),
              std::string::npos);
}

TEST(RayCast, OfHugeAndTinyNumbersGivesNumbers)
{
    Random random(31);
    const double sizes[] = {0, 1e-300, 1e-45, 1e-20, 1, 1e9, 1e30, 1e60};
    const auto any = [&] { return sizes[random.below(8)] * (random.chance(0.5) ? 1 : -1); };
    for (int round = 0; round < 20'000; ++round) {
        const double radius = std::abs(any()), half = std::abs(any());
        const Shape3 shapes[] = {Shape3::sphere(radius), Shape3::capsule(half, radius),
                                 Shape3::box({half, radius, std::abs(any())}),
                                 Shape3::half_space({1, 2, 3}, any())};
        Pose3d pose{{any(), any(), any()}};
        pose.rotation = random.rotation<double>();
        const Ray3d ray{
            {any(), any(), any()}, {any(), 1e-5 * any(), 1e10}, random.chance(0.5) ? infinity : 1e20};
        for (const Shape3& shape : shapes)
            if (const auto hit = ray_cast(shape, pose, ray)) {
                ASSERT_TRUE(hit->fraction >= 0 && hit->fraction <= ray.max_fraction) << round;
                ASSERT_NEAR(size_of(hit->normal), 1, 1e-6) << round << " type " << shape.type();
            }
    }
}

} // namespace
