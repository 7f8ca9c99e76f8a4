// SPDX-License-Identifier: MIT
// Hulls as thin as some roundings of their points, whose faces are merged from triangles that all but lie in
// one plane: rays beside them, and what stands on their faces. Other sets with each --gtest_random_seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "jostle/cast.hpp"
#include "narrow/shapes/shape_data.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;
using narrow::Mat3;
using narrow::Vec2;
using narrow::Vec3;

namespace {

/// The corners of the convex hull in the plane, counterclockwise.
std::vector<Vec2> outline_of(std::vector<Vec2> points)
{
    std::sort(points.begin(), points.end(),
              [](const Vec2& p, const Vec2& q) { return p.x != q.x ? p.x < q.x : p.y < q.y; });
    std::vector<Vec2> hull;
    for (int chain = 0; chain < 2; ++chain) {
        const std::size_t first = hull.size();
        for (const Vec2& p : points) {
            while (hull.size() >= first + 2 &&
                   cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
                hull.pop_back();
            hull.push_back(p);
        }
        hull.pop_back();
        std::reverse(points.begin(), points.end());
    }
    return hull;
}
/// How far a point is inside of a polygon; below 0 outside.
double depth_in(const std::vector<Vec2>& polygon, const Vec2& p)
{
    double least = HUGE_VAL;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Vec2 from = polygon[k], side = polygon[(k + 1) % polygon.size()] - from;
        least = std::min(least, cross(side, p - from) / length(side));
    }
    return least;
}
Vec2 any_inside(Random& random, const std::vector<Vec2>& polygon)
{
    Vec2 sum;
    double weights = 0;
    for (const Vec2& corner : polygon) {
        const double weight = random.uniform(0.01, 1);
        sum = sum + corner * weight;
        weights += weight;
    }
    return sum * (1 / weights);
}

/// Points across the axis `up.y` that rounding, or some hundred times as much, moves out of their plane.
template <class T>
struct Plate
{
    Mat3 up;
    Vec3 origin;
    double slack = 0; ///< what the hull may be off by
    double thickness = 0, size = 0;
    std::vector<Vec3> points;
    std::unique_ptr<ConvexHull<3>> hull;

    explicit Plate(Random& random)
    {
        if (random.chance(0.6)) {
            const auto q = random.rotation<double>();
            up = narrow::rotation(q[0], q[1], q[2], q[3]);
        }
        const double epsilon = double{std::numeric_limits<T>::epsilon()};
        const double far = random.chance(0.3) ? std::pow(10, random.uniform(-1, 2)) : 0;
        const double roundings = std::pow(10, random.uniform(0, 3)),
                     wide = std::pow(10, random.uniform(-1, 1));
        const bool lattice = random.chance(0.3);
        origin = Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)} * far;
        thickness = roundings * epsilon * (wide + far);
        std::vector<Vec<3, T>> given;
        double largest = 0;
        for (std::uint32_t i = 0, count = 4 + random.below(random.chance(0.7) ? 8 : 40); i < count; ++i) {
            const auto along = [&] {
                const double x = random.uniform(-1, 1);
                return lattice ? std::round(4 * x) / 4 : x;
            };
            const double a = along() * wide, b = along() * wide, c = along() * thickness;
            const Vec3 p = origin + up.x * a + up.z * b + up.y * c;
            given.push_back({static_cast<T>(p.x), static_cast<T>(p.y), static_cast<T>(p.z)});
            points.push_back({double{given.back()[0]}, double{given.back()[1]}, double{given.back()[2]}});
            for (const T x : given.back())
                largest = std::max(largest, double{std::abs(x)});
        }
        thickness += 2 * epsilon * largest;
        size = 2 * wide;
        slack = 40 * epsilon * largest;
        hull = std::make_unique<ConvexHull<3>>(given);
    }
    [[nodiscard]] Vec2 seen(const Vec3& p) const { return {dot(p - origin, up.z), dot(p - origin, up.x)}; }
};

Vec<3, double> store(const Vec3& p)
{
    return {p.x, p.y, p.z};
}

struct Counts
{
    int hits = 0, misses = 0, placed = 0, faces = 0;
};

/// Rays that come down steeply hit what they pass through, and nothing beside it.
template <class T>
void cast_at_plate(Random& random, Counts& counts)
{
    const Plate<T> plate(random);
    const Shape3 shape(*plate.hull);
    std::vector<Vec2> flat;
    for (const Vec3& p : plate.points)
        flat.push_back(plate.seen(p));
    const std::vector<Vec2> outline = outline_of(flat);
    if (outline.size() < 3) return;
    for (int k = 0; k < 10; ++k) {
        const bool through = random.chance(0.4);
        Vec2 at = any_inside(random, outline);
        if (!through) at = {random.uniform(-0.7, 0.7) * plate.size, random.uniform(-0.7, 0.7) * plate.size};
        const Vec3 target = plate.origin + plate.up.z * at.x + plate.up.x * at.y;
        const Vec3 down = (plate.up.x * random.uniform(-1, 1) + plate.up.y * (random.chance(0.5) ? 1 : -1) +
                           plate.up.z * random.uniform(-1, 1)) *
                          plate.size;
        Ray3d ray;
        ray.origin = store(target - down * random.uniform(0.1, 5));
        ray.direction = store(down);
        ray.max_fraction = 10;
        const double near = 1e-8 * plate.size + 2 * plate.thickness + plate.slack;
        const double depth = depth_in(outline, at);
        if (std::abs(depth) < near) continue;
        const auto hit = ray_cast(shape, Pose3d{}, ray);
        ASSERT_EQ(hit.has_value(), depth > 0) << depth;
        (hit ? counts.hits : counts.misses) += 1;
        if (!hit) continue;
        const Vec3 point = narrow::load(hit->point);
        ASSERT_GT(depth_in(outline, plate.seen(point)), -near);
        ASSERT_LE(std::abs(dot(point - plate.origin, plate.up.y)), near);
        ASSERT_LE(dot(narrow::load(hit->normal), down), 0);
    }
}

TEST(FlatHulls, AreHitByRaysThroughThemAndByNoneBeside)
{
    Random random(3 + 1000 * static_cast<std::uint64_t>(GTEST_FLAG_GET(random_seed)));
    Counts counts;
    for (int round = 0; round < 8000; ++round) {
        SCOPED_TRACE(round);
        cast_at_plate<float>(random, counts);
        cast_at_plate<double>(random, counts);
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(counts.hits, 20'000);
    EXPECT_GT(counts.misses, 20'000);
}

TEST(FlatHulls, AreNotHitBesideTheirRims)
{
    const ConvexHull<3> hull(std::vector<Vec<3, float>>{
        {2, 1, 0}, {-3, 1.00000286F, 2}, {-3, 1.00000072F, 4}, {4, 1.00000167F, 2}});
    const Shape3 shape(hull);
    for (const double x : {-1.0, -2.5})
        EXPECT_FALSE(ray_cast(shape, Pose3d{}, Ray3d{{x, 2, 0.5}, {0, -1, 0}, 10}).has_value()) << x;
    EXPECT_TRUE(ray_cast(shape, Pose3d{}, Ray3d{{1, 2, 1.5}, {0, -1, 0}, 10}).has_value());
}

TEST(FlatHulls, OfTwoDimensionsAreNotHitBeyondTheirTips)
{
    Random random(4 + 1000 * static_cast<std::uint64_t>(GTEST_FLAG_GET(random_seed)));
    for (int round = 0; round < 20'000; ++round) {
        const double noise = std::pow(10, random.uniform(-14.5, -3)), turn = random.uniform(0, 6.3);
        const Vec2 along{std::cos(turn), std::sin(turn)}, across = narrow::left(along);
        std::vector<Vec<2, double>> points;
        double first = HUGE_VAL, last = -HUGE_VAL;
        for (int i = 0; i < 5; ++i) {
            const double t = random.uniform(-1, 1);
            const Vec2 p = along * t + across * (noise * random.uniform(-1, 1));
            points.push_back({p.x, p.y});
            first = std::min(first, t), last = std::max(last, t);
        }
        const ConvexHull<2> hull(points);
        const double t = random.uniform(-1.5, 1.5), depth = std::min(t - first, last - t);
        if (std::abs(depth) < 1e-8 + 4 * noise) continue;
        const Vec2 way = across + along * random.uniform(-1, 1), from = along * t - way * 2.0;
        const auto hit =
            ray_cast(Shape2(hull), Pose2d{}, Ray<2, double>{{from.x, from.y}, {way.x, way.y}, 10});
        ASSERT_EQ(hit.has_value(), depth > 0) << round << ", depth " << depth << ", noise " << noise;
    }
}

/// The pose in which y is `up`, turned about it.
Pose3d standing(const Vec3& at, const Vec3& up, double angle)
{
    Vec3 u, v;
    narrow::basis(up, u, v);
    // From the y axis to `up`, after a turn about y.
    const double size = std::sqrt(2 * (1 + up.y));
    std::array<double, 4> tilt{up.z / size, 0, -up.x / size, size / 2};
    if (size < 0.1) tilt = {1, 0, 0, 0}, angle = 0;
    const double s = std::sin(angle / 2), c = std::cos(angle / 2);
    return {store(at),
            {tilt[0] * c - tilt[2] * s, tilt[3] * s + tilt[1] * c, tilt[2] * c + tilt[0] * s,
             tilt[3] * c - tilt[1] * s}};
}

/// Each wide face is a convex polygon, and a box that stands on it has four points.
template <class T>
void stand_on_plate(Random& random, Counts& counts)
{
    const Plate<T> plate(random);
    const Shape3 shape(*plate.hull);
    for (std::uint32_t f = 0; f < plate.hull->face_count(); ++f) {
        const auto loop = plate.hull->face(f);
        const Vec3 n = narrow::ShapeAccess::data_of(*plate.hull).polytope.normal(f);
        if (!(n.y > -0.9)) continue;
        Vec3 u, v;
        narrow::basis(n, u, v);
        double top = -HUGE_VAL;
        std::vector<Vec2> flat;
        for (const auto& p : plate.hull->vertices())
            top = std::max(top, dot(n, narrow::load(p) - plate.origin));
        for (const std::uint32_t k : loop) {
            const Vec3 p = narrow::load(plate.hull->vertices()[k]) - plate.origin;
            flat.push_back({dot(p, u), dot(p, v)});
        }
        const std::vector<Vec2> outline = outline_of(flat);
        if (outline.size() < 3) continue;
        const Vec2 at = any_inside(random, outline);
        const double room = depth_in(outline, at);
        if (room < 0.02 * plate.size) continue;
        ++counts.faces;
        for (std::size_t k = 0; k < flat.size(); ++k) {
            const Vec2 side = flat[(k + 1) % flat.size()] - flat[k],
                       next = flat[(k + 2) % flat.size()] - flat[(k + 1) % flat.size()];
            ASSERT_GE(cross(side, next), -1e-12 * (plate.size + length(plate.origin)) * plate.size);
        }
        const double half = 0.5 * room, overlap = 0.02 * room;
        if (overlap < 2 * plate.slack) continue;
        const Vec3 middle = plate.origin + u * at.x + v * at.y + n * (top + half - overlap);
        const Pose3d pose = standing(middle, n, random.uniform(0, 6));
        const auto found = contacts(shape, Pose3d{}, Shape3::box({half, half, half}), pose);
        ASSERT_EQ(found.size(), 1u);
        ASSERT_EQ(found[0].count, 4u) << "face " << f;
        for (const auto& point : found[0].point)
            ASSERT_NEAR(point.depth, overlap, 2 * plate.slack + 1e-7 * plate.size);
        ++counts.placed;
    }
}

TEST(FlatHulls, HaveConvexFacesOnWhichABoxHasFourPoints)
{
    Random random(5 + 1000 * static_cast<std::uint64_t>(GTEST_FLAG_GET(random_seed)));
    Counts counts;
    for (int round = 0; round < 4000; ++round) {
        SCOPED_TRACE(round);
        stand_on_plate<float>(random, counts);
        stand_on_plate<double>(random, counts);
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(counts.faces, 10'000);
    EXPECT_GT(counts.placed, 5000);
}

TEST(FlatHulls, CarryABoxWhereTheirFaceWouldBeReflex)
{
    const ConvexHull<3> hull(std::vector<Vec<3, float>>{
        {1, 1, 0}, {3, 0.999998212F, -1}, {2, 0.999999404F, 1}, {-1, 0.999998093F, 3}, {0, 0.999998808F, 2}});
    const auto found = contacts(Shape3(hull), Pose3d{}, Shape3::box({0.05, 0.05, 0.05}),
                                Pose3d{{0.60944256955688125, 1.048, 1.2110877944297167}});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].count, 4u);
}

} // namespace
