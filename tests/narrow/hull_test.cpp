// SPDX-License-Identifier: MIT
// Hulls of points that are flat, straight, nearly so, tiny or huge; and what is asked about them.
// Other sets with each --gtest_random_seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "narrow/parts/pair.hpp"
#include "narrow/shapes/orientation.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;
using narrow::Vec2;
using narrow::Vec3;

namespace {

std::uint64_t seed(std::uint64_t of)
{
    return of + 1000 * static_cast<std::uint64_t>(GTEST_FLAG_GET(random_seed));
}

/// An integer far above what a double holds, and one that it holds.
double big(Random& random)
{
    return random.uniform(-1, 1) * 0x1p53;
}
double small(Random& random)
{
    return std::round(random.uniform(-16384, 16384));
}
__int128 exactly(double x)
{
    return static_cast<__int128>(x);
}
int sign_of(__int128 x)
{
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

TEST(Orientation, OfPointsOnALineIsExact)
{
    Random random(seed(1));
    int of[3] = {};
    for (int round = 0; round < 200'000; ++round) {
        SCOPED_TRACE(round);
        Vec2 p[3];
        for (Vec2& q : p)
            q = {std::round(big(random)), std::round(big(random))};
        if (random.chance(0.7)) { // nearly on the line of the others, or on it
            const double t = random.chance(0.5) ? random.uniform(-1, 1) : random.below(3) * 0.5;
            for (int d = 0; d < 2; ++d)
                p[2][d] = std::round(p[0][d] + t * (p[1][d] - p[0][d])) + std::round(random.uniform(-1, 1));
        }
        const __int128 ux = exactly(p[1].x) - exactly(p[0].x), uy = exactly(p[1].y) - exactly(p[0].y),
                       vx = exactly(p[2].x) - exactly(p[0].x), vy = exactly(p[2].y) - exactly(p[0].y);
        const __int128 area = ux * vy - uy * vx;
        const double scale = std::ldexp(1, static_cast<int>(random.below(100)) - 150);
        const auto at = [&](int i) { return p[i] * scale; };
        ASSERT_EQ(narrow::side_of_line(at(0), at(1), at(2)), sign_of(area));
        ++of[sign_of(area) + 1];
        const Vec3 n = narrow::exact_cross({p[0].x, p[0].y, 0}, {p[1].x, p[1].y, 0}, {p[2].x, p[2].y, 0});
        ASSERT_EQ(n.x, 0);
        ASSERT_EQ(n.y, 0);
        ASSERT_NEAR(n.z, static_cast<double>(area), 1e-15 * std::abs(static_cast<double>(area)));
    }
    for (const int times : of)
        EXPECT_GT(times, 1000);
}

TEST(Orientation, OfPointsInAPlaneIsExact)
{
    Random random(seed(2));
    int of[3] = {};
    for (int round = 0; round < 200'000; ++round) {
        SCOPED_TRACE(round);
        // Two coordinates that differences lose bits of, one that leaves the determinant in 128 bits.
        const int turn = static_cast<int>(random.below(3));
        Vec3 p[4];
        for (Vec3& q : p)
            for (int d = 0; d < 3; ++d)
                q[d] = (d + turn) % 3 == 2 ? small(random) : std::round(big(random));
        if (random.chance(0.7)) {
            const double s = random.below(3) * 0.5, t = random.chance(0.3) ? 0.25 : random.below(2);
            for (int d = 0; d < 3; ++d) {
                const double x = p[0][d] + s * (p[1][d] - p[0][d]) + t * (p[2][d] - p[0][d]);
                if (std::abs(x) <= 0x1p53) p[3][d] = std::round(x) + (random.chance(0.3) ? 1 : 0);
            }
        }
        __int128 u[3][3];
        for (int i = 0; i < 3; ++i)
            for (int d = 0; d < 3; ++d)
                u[i][d] = exactly(p[i + 1][d]) - exactly(p[0][d]);
        __int128 determinant = 0;
        for (int d = 0; d < 3; ++d) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            determinant += (u[0][e] * u[1][f] - u[0][f] * u[1][e]) * u[2][d];
        }
        const double scale = std::ldexp(1, static_cast<int>(random.below(100)) - 150);
        ASSERT_EQ(narrow::side_of_plane(p[0] * scale, p[1] * scale, p[2] * scale, p[3] * scale),
                  sign_of(determinant));
        ++of[sign_of(determinant) + 1];
    }
    for (const int times : of)
        EXPECT_GT(times, 1000);
}

/// Points that are flat, straight or in one place, exactly or but for noise; and lattices, boxes, balls.
template <int Dim, class T>
std::vector<Vec<Dim, T>> random_points(Random& random)
{
    const std::uint32_t kind = random.below(10);
    const std::uint32_t most = random.chance(0.02) ? 200 : random.chance(0.2) ? 40 : 9;
    const std::uint32_t count = 1 + random.below(most);
    const bool single = sizeof(T) == 4;
    constexpr double small_scales[] = {1e-100, 1e-300, 1e-320}, big_scales[] = {1e10, 1e30, 1e59};
    constexpr double small_floats[] = {1e-20, 1e-37, 1e-43}, big_floats[] = {1e10, 1e20, 1e38};
    double scale = random.uniform(0.1, 4);
    if (random.chance(0.25))
        scale *= (single ? small_floats : small_scales)[random.below(3)];
    else if (random.chance(0.25))
        scale *= (single ? big_floats : big_scales)[random.below(3)];
    scale = std::min(scale, single ? 5e37 : 2e59);
    double across = random.chance(0.3) ? 0 : std::pow(10, random.uniform(-20, -3)); // of its size
    if (kind == 4) across = 1;
    const double far = random.chance(0.2) ? std::pow(10, random.uniform(0, single ? 5 : 14)) : 0;
    Vec3 origin, u, v, w;
    for (Vec3* p : {&origin, &u, &v, &w})
        for (int d = 0; d < 3; ++d)
            (*p)[d] = random.uniform(-1, 1);
    origin = origin * (scale < 1e20 ? far : 0.5);
    if (kind == 8) u = {0, 1, 0}, v = {0, 0, 1}, w = {1, 0, 0}; // across an axis
    std::vector<Vec<Dim, T>> points;
    for (std::uint32_t i = 0; i < count; ++i) {
        double a = random.uniform(-1, 1), b = random.uniform(-1, 1), c = random.uniform(-1, 1) * across;
        if (kind == 0) b *= across;                                               // straight
        if (kind == 1) a *= across, b *= across;                                  // nearly in one place
        if (kind == 2 || kind == 3) a = std::round(2 * a), b = std::round(2 * b); // a lattice
        if (kind == 3) c = std::round(2 * random.uniform(-1, 1)) / 2 + c;
        if (kind == 5) { // the border of a box
            const double side[] = {a, b, random.uniform(-1, 1)};
            a = side[0], b = side[1], c = side[2];
            double& fixed = i % 3 == 0 ? a : i % 3 == 1 ? b : c;
            fixed = fixed < 0 ? -1 : 1;
        }
        if (kind == 6) { // a ball
            const double size = std::sqrt(a * a + b * b + c * c);
            if (size > 0) a /= size, b /= size, c /= size;
        }
        if (kind == 7 && !points.empty() && random.chance(0.5)) { // twice
            points.push_back(points[random.below(static_cast<std::uint32_t>(points.size()))]);
            continue;
        }
        Vec<Dim, T> p;
        for (int d = 0; d < Dim; ++d)
            p[static_cast<std::size_t>(d)] =
                static_cast<T>((origin[d] + a * u[d] + b * v[d] + c * w[d]) * scale);
        points.push_back(p);
    }
    return points;
}

/// Scaled to a size of about 1, so that nothing over- or underflows; and the bound that shapes.hpp states.
struct Scaled
{
    std::vector<Vec3> points, corners;
    double slack = 0, size = 0;

    template <int Dim, class T>
    Scaled(const std::vector<Vec<Dim, T>>& given, const ConvexHull<Dim>& hull)
    {
        double largest = 0, extent = 0;
        for (std::size_t d = 0; d < Dim; ++d) {
            double lo = double{given[0][d]}, hi = lo;
            for (const auto& p : given) {
                lo = std::min(lo, double{p[d]}), hi = std::max(hi, double{p[d]});
                largest = std::max(largest, std::abs(double{p[d]}));
            }
            extent = std::max(extent, hi - lo);
        }
        const int scale = largest > 0 ? -std::ilogb(largest) : 0;
        const auto scaled = [&](const auto& p) {
            Vec3 q;
            for (int d = 0; d < Dim; ++d)
                q[d] = std::ldexp(double{p[static_cast<std::size_t>(d)]}, scale);
            return q;
        };
        for (const auto& p : given)
            points.push_back(scaled(p));
        for (const auto& p : hull.vertices())
            corners.push_back(scaled(p));
        size = std::ldexp(extent, scale);
        slack = std::min(40 * double{std::numeric_limits<T>::epsilon()} * std::ldexp(largest, scale),
                         size / 1600) +
                1e-15; // what dot products round
    }
    /// How far a given point is outside along a unit vector.
    [[nodiscard]] double outside(const Vec3& n) const
    {
        double given = -HUGE_VAL, kept = -HUGE_VAL;
        for (const Vec3& p : points)
            given = std::max(given, dot(n, p));
        for (const Vec3& p : corners)
            kept = std::max(kept, dot(n, p));
        return given - kept;
    }
};

/// Vertices are given points, in that order, each once.
template <int Dim, class T>
void expect_given(const std::vector<Vec<Dim, T>>& given, const ConvexHull<Dim>& hull)
{
    std::size_t next = 0;
    for (const auto& vertex : hull.vertices()) {
        const auto same = [&](const Vec<Dim, T>& p) {
            return std::equal(p.begin(), p.end(), vertex.begin());
        };
        while (next < given.size() && !same(given[next]))
            ++next;
        ASSERT_LT(next, given.size());
        ++next;
    }
    std::vector<Vec<Dim, double>> sorted(hull.vertices().begin(), hull.vertices().end());
    std::sort(sorted.begin(), sorted.end());
    ASSERT_EQ(std::adjacent_find(sorted.begin(), sorted.end()), sorted.end());
}

Vec3 any_direction(Random& random, const Scaled& scaled, int dim)
{
    Vec3 n;
    if (random.chance(0.5) || scaled.points.size() < 2) {
        n = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    } else { // across or along a side, where points are left out if anywhere
        const auto any = [&] {
            return scaled.points[random.below(static_cast<std::uint32_t>(scaled.points.size()))];
        };
        const Vec3 p = any(), along = any() - p;
        n = random.chance(0.3) ? along : dim == 2 ? Vec3{along.y, -along.x, 0} : cross(along, any() - p);
        const double most = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
        n = most > 0 ? n * (1 / most) : Vec3{1, 0, 0};
    }
    if (dim == 2) n.z = 0;
    const double size = length(n);
    return size > 0.01 ? n * (1 / size) : Vec3{0, 1, 0};
}

struct Kinds
{
    int places = 0, lines = 0, plates = 0, solids = 0;
};

template <class T>
void check_solid(Random& random, Kinds& kinds)
{
    const std::vector<Vec<3, T>> given = random_points<3, T>(random);
    const ConvexHull<3> hull(given);
    ASSERT_GE(hull.vertices().size(), 1u);
    expect_given(given, hull);
    const Scaled scaled(given, hull);
    for (int k = 0; k < 8; ++k)
        ASSERT_LE(scaled.outside(any_direction(random, scaled, 3)), scaled.slack);

    const std::size_t faces = hull.face_count();
    if (faces == 0) {
        ASSERT_LE(hull.vertices().size(), 2u);
        (hull.vertices().size() == 1 ? kinds.places : kinds.lines) += 1;
        return;
    }
    (faces == 2 ? kinds.plates : kinds.solids) += 1;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides; // once one way, once the other
    std::vector<char> used(hull.vertices().size(), 0);
    std::size_t corners = 0;
    for (std::size_t f = 0; f < faces; ++f) {
        const auto loop = hull.face(f);
        ASSERT_GE(loop.size(), 3u);
        corners += loop.size();
        Vec3 normal;
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const std::uint32_t v = loop[k], w = loop[(k + 1) % loop.size()];
            used[v] = 1;
            ++sides[{v, w}];
            --sides[{w, v}];
            normal += cross(scaled.corners[v] - scaled.corners[loop[0]],
                            scaled.corners[w] - scaled.corners[loop[0]]);
        }
        // Where a face has enough area to have a normal of its own nothing is above it.
        const double area = length(normal);
        if (area < 0.05 * scaled.size * scaled.size || scaled.size < 0.01) continue;
        // Its corners go round counterclockwise, seen from where its normal points.
        const Vec3 stated = narrow::ShapeAccess::data_of(hull).polytope.normal(static_cast<std::uint32_t>(f));
        ASSERT_GT(dot(normal, stated), 0.9 * area);
        for (const std::uint32_t v : loop)
            ASSERT_LE(scaled.outside(normal * (1 / area)), scaled.slack) << v;
        double top = -HUGE_VAL;
        for (const Vec3& p : scaled.points)
            top = std::max(top, dot(normal, p - scaled.corners[loop[0]]) / area);
        ASSERT_LE(top, 40 * scaled.slack);
    }
    for (const auto& [side, times] : sides)
        ASSERT_EQ(times, 0);
    ASSERT_EQ(std::count(used.begin(), used.end(), 0), 0);
    ASSERT_EQ(hull.vertices().size() + faces, corners / 2 + 2); // Euler's formula
}

TEST(AHull, OfAnyPointsHoldsThemAll)
{
    Random random(seed(3));
    Kinds kinds;
    for (int round = 0; round < 60'000; ++round) {
        SCOPED_TRACE(round);
        check_solid<double>(random, kinds);
        check_solid<float>(random, kinds);
        if (HasFatalFailure()) return;
    }
    for (const int times : {kinds.places, kinds.lines, kinds.plates, kinds.solids})
        EXPECT_GT(times, 2000);
}

template <class T>
void check_polygon(Random& random, Kinds& kinds)
{
    const std::vector<Vec<2, T>> given = random_points<2, T>(random);
    const ConvexHull<2> hull(given);
    ASSERT_GE(hull.vertices().size(), 1u);
    expect_given(given, hull);
    const Scaled scaled(given, hull);
    for (int k = 0; k < 8; ++k)
        ASSERT_LE(scaled.outside(any_direction(random, scaled, 2)), scaled.slack);
    const std::size_t size = hull.vertices().size();
    ASSERT_EQ(hull.face_count(), size > 1 ? size : 0);
    (size == 1 ? kinds.places : size == 2 ? kinds.lines : kinds.solids) += 1;
}

TEST(APolygon, OfAnyPointsHoldsThemAll)
{
    Random random(seed(4));
    Kinds kinds;
    for (int round = 0; round < 50'000; ++round) {
        SCOPED_TRACE(round);
        check_polygon<double>(random, kinds);
        check_polygon<float>(random, kinds);
        if (HasFatalFailure()) return;
    }
    for (const int times : {kinds.places, kinds.lines, kinds.solids})
        EXPECT_GT(times, 2000);
}

/// Exactly on a line, but so far apart that their differences are rounded: what doubles take for a triangle.
TEST(AHull, OfPointsExactlyOnALineHasTwoCorners)
{
    Random random(14);
    int deceiving = 0;
    for (int round = 0; round < 2000; ++round) {
        double along[3];
        for (double& x : along)
            x = 1 + random.below(15);
        std::vector<Vec<3, double>> points;
        for (int i = 0; i < 6; ++i) {
            // Few bits, so that each coordinate is exact.
            const double t = std::ldexp(1 + random.below(15), static_cast<int>(random.below(56)));
            points.push_back({along[0] * t, along[1] * t, along[2] * t});
        }
        const auto order = std::minmax_element(points.begin(), points.end());
        const Vec<3, double> lowest = *order.first, highest = *order.second;
        for (const auto& p : points) {
            double u[3], v[3];
            for (std::size_t d = 0; d < 3; ++d)
                u[d] = p[d] - lowest[d], v[d] = highest[d] - lowest[d];
            deceiving += u[0] * v[1] != u[1] * v[0] || u[1] * v[2] != u[2] * v[1] ? 1 : 0;
        }
        const ConvexHull<3> hull(points);
        ASSERT_EQ(hull.face_count(), 0u) << round;
        ASSERT_EQ(hull.vertices().size(), lowest == highest ? 1u : 2u) << round;
        for (const auto& v : hull.vertices())
            ASSERT_TRUE(v == lowest || v == highest) << round;
    }
    EXPECT_GT(deceiving, 500);
}

/// On a line or in a plane but for the last bits, most of them close to one end.
TEST(AHull, OfPointsThatRoundingMovesHasTwoCornersOrTwoFaces)
{
    Random random(16);
    for (int round = 0; round < 4000; ++round) {
        const bool flat = round % 2 != 0;
        const std::size_t axis = random.below(3), other = (axis + 1) % 3;
        std::vector<Vec<3, double>> points;
        const auto along = [&] {
            const std::uint32_t kind = random.below(3);
            return kind == 0 ? random.uniform(-1, 1) : kind == 1 ? random.uniform(0.99, 1) : 1.0;
        };
        for (std::uint32_t i = 0, count = 4 + random.below(6); i < count; ++i) {
            Vec<3, double> p = {1, 1, 1};
            p[axis] = i == 0 ? -0.5 : along();
            if (flat) p[other] = i == 1 ? -0.25 : along();
            for (double& x : p)
                for (std::uint32_t bits = random.below(3); bits != 0; --bits)
                    x = std::nextafter(x, random.below(2) == 0 ? 2 : -2);
            points.push_back(p);
        }
        const ConvexHull<3> hull(points);
        if (flat) {
            ASSERT_EQ(hull.face_count(), 2u) << round;
            ASSERT_LE(hull.vertices().size(), points.size()) << round;
        } else {
            ASSERT_EQ(hull.face_count(), 0u) << round;
            ASSERT_EQ(hull.vertices().size(), 2u) << round;
        }
    }
}

TEST(AHull, OfABoxesBordersIsTheBox)
{
    Random random(seed(5));
    for (int round = 0; round < 300; ++round) {
        SCOPED_TRACE(round);
        const Pose3d pose = random.pose<double>(round % 3 == 0 ? 100 : 1);
        const narrow::Mat3 r = narrow::rotation(pose);
        std::vector<Vec<3, float>> points;
        for (int i = 0; i < 300; ++i) {
            Vec3 p;
            for (int d = 0; d < 3; ++d)
                p[d] = i < 8 ? ((i >> d & 1) != 0 ? 1 : -1) : random.uniform(-1, 1);
            const int d = static_cast<int>(random.below(3));
            if (i >= 8) p[d] = p[d] < 0 ? -1 : 1;
            if (i >= 200) p[(d + 1) % 3] = std::round(p[(d + 1) % 3]); // on edges, and on middle lines
            p = r * p + narrow::load(pose.position);
            points.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
        }
        std::vector<Vec<3, float>> corners(points.begin(), points.begin() + 8);
        std::shuffle(points.begin(), points.end(), std::mt19937(static_cast<unsigned>(round)));
        const ConvexHull<3> hull(points);
        ASSERT_EQ(hull.face_count(), 6u);
        ASSERT_EQ(hull.vertices().size(), 8u);
        for (std::size_t f = 0; f < 6; ++f)
            ASSERT_EQ(hull.face(f).size(), 4u);
        std::vector<Vec<3, double>> given, kept(hull.vertices().begin(), hull.vertices().end());
        for (const auto& p : corners)
            given.push_back({double{p[0]}, double{p[1]}, double{p[2]}});
        std::sort(given.begin(), given.end());
        std::sort(kept.begin(), kept.end());
        ASSERT_EQ(given, kept);
    }
}

/// A few points, flat or straight but for some noise, with the shape of their hull.
struct Thin
{
    std::vector<Vec3> points;
    std::unique_ptr<ConvexHull<3>> hull;

    explicit Thin(Random& random)
    {
        constexpr double noises[] = {0, 0, 1e-16, 1e-15, 1e-14, 1e-12, 1e-10, 1e-8};
        const double noise = noises[random.below(8)], aside = random.chance(0.25) ? noise : 1;
        const bool single = random.chance(0.3);
        Vec3 origin, u, v;
        for (Vec3* p : {&origin, &u, &v})
            *p = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
        std::vector<Vec<3, double>> given;
        for (std::uint32_t i = 0, count = 1 + random.below(6); i < count; ++i) {
            const double a = random.uniform(-1, 1), b = random.uniform(-1, 1) * aside;
            Vec<3, double> p;
            for (int d = 0; d < 3; ++d) {
                double x = origin[d] + a * u[d] + b * v[d] + noise * random.uniform(-1, 1);
                if (single) x = double{static_cast<float>(x)};
                p[static_cast<std::size_t>(d)] = x;
            }
            given.push_back(p);
            points.push_back(narrow::load(p));
        }
        if (single) {
            std::vector<Vec<3, float>> floats;
            for (const auto& p : given)
                floats.push_back(
                    {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
            hull = std::make_unique<ConvexHull<3>>(floats);
        } else {
            hull = std::make_unique<ConvexHull<3>>(given);
        }
    }
    [[nodiscard]] std::vector<Vec3> at(const Pose3d& pose) const
    {
        const narrow::Mat3 r = narrow::rotation(pose);
        std::vector<Vec3> result;
        for (const Vec3& p : points)
            result.push_back(r * p + narrow::load(pose.position));
        return result;
    }
};

/// As oracle::signed_distance, for what is thin: there rounding tilts planes through points as it likes.
/// Along no direction do shapes overlap less, or are further apart, than they are; and what parts them best
/// is across a corner, a side or a face of their difference.
double signed_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b)
{
    std::vector<Vec3> difference;
    for (const Vec3& p : a)
        for (const Vec3& q : b)
            difference.push_back(p - q);
    double best = -HUGE_VAL;
    const auto look_along = [&](const Vec3& normal) {
        const double size = length(normal);
        if (!(size > 0)) return;
        double least = HUGE_VAL;
        for (std::size_t i = 0; i < difference.size() && least > best; ++i)
            least = std::min(least, dot(normal, difference[i]) / size);
        best = std::max(best, least);
    };
    for (std::size_t i = 0; i < difference.size(); ++i) {
        const Vec3& p = difference[i];
        look_along(p);
        for (std::size_t j = i + 1; j < difference.size(); ++j) {
            const Vec3 side = difference[j] - p;
            if (length2(side) > 0) look_along(p - side * (dot(p, side) / length2(side)));
            for (std::size_t k = j + 1; k < difference.size(); ++k) {
                const Vec3 normal = cross(side, difference[k] - p);
                look_along(normal);
                look_along(-normal);
            }
        }
    }
    return best;
}

TEST(ThinHulls, AnswerAsDefined)
{
    Random random(seed(6));
    int touching_pairs = 0, apart = 0, impacts = 0;
    constexpr double near = 4e-6; // float points are given to that
    for (int round = 0; round < 1500; ++round) {
        SCOPED_TRACE(round);
        const Thin thin(random), other(random);
        const bool with_box = random.chance(0.4);
        const Vec<3, double> half{random.uniform(0.1, 1), random.uniform(0.1, 1), random.uniform(0.1, 1)};
        const Shape3 a(*thin.hull), b = with_box ? Shape3::box(half) : Shape3(*other.hull);
        const Pose3d pose_a = random.pose<double>(0.5), pose_b = random.pose<double>(with_box ? 1 : 0.3);
        std::vector<Vec3> points_b;
        if (with_box) {
            for (int i = 0; i < 8; ++i)
                points_b.push_back(narrow::rotation(pose_b) * Vec3{i & 1 ? half[0] : -half[0],
                                                                   i & 2 ? half[1] : -half[1],
                                                                   i & 4 ? half[2] : -half[2]} +
                                   narrow::load(pose_b.position));
        } else {
            points_b = other.at(pose_b);
        }
        const std::vector<Vec3> points_a = thin.at(pose_a);
        const double expected = signed_distance(points_a, points_b);
        const auto gap = distance(a, pose_a, b, pose_b, 1e300);
        ASSERT_TRUE(gap.has_value());
        ASSERT_NEAR(gap->distance, expected, near);
        if (std::abs(expected) > near) {
            ASSERT_EQ(touching(a, pose_a, b, pose_b), expected < 0);
        }
        for (const double margin : {0.0, 0.1}) {
            if (std::abs(expected - margin) <= near) continue;
            const auto found = contacts(a, pose_a, b, pose_b, margin);
            ASSERT_EQ(found.size(), expected < margin ? 1u : 0u);
            (found.empty() ? apart : touching_pairs) += 1;
            for (const auto& contact : found) {
                ASSERT_GE(contact.count, 1u);
                ASSERT_NEAR(contact.point[0].depth, -expected, near);
                ASSERT_NEAR(length(narrow::load(contact.normal)), 1, 1e-9);
            }
        }
        const Aabb3d box = bounds(a, pose_a);
        for (std::size_t d = 0; d < 3; ++d) {
            double lo = HUGE_VAL, hi = -HUGE_VAL;
            for (const Vec3& p : points_a)
                lo = std::min(lo, p[static_cast<int>(d)]), hi = std::max(hi, p[static_cast<int>(d)]);
            ASSERT_NEAR(box.lo[d], lo, near);
            ASSERT_NEAR(box.hi[d], hi, near);
        }
        Motion<3, double> still, moving;
        still.pose = pose_a;
        moving.pose = pose_b;
        for (std::size_t d = 0; d < 3; ++d)
            if (d == static_cast<std::size_t>(round % 3)) moving.pose.position[d] += 6, moving.linear[d] = -6;
        const auto impact = time_of_impact(a, still, b, moving, 1e-4);
        if (expected < -near) {
            ASSERT_TRUE(impact.has_value());
        }
        if (!impact.has_value()) continue;
        ++impacts;
        Pose3d hit = moving.pose;
        for (std::size_t d = 0; d < 3; ++d)
            hit.position[d] += moving.linear[d] * impact->time;
        const auto left = distance(a, pose_a, b, hit, 1e300);
        ASSERT_TRUE(left.has_value());
        ASSERT_NEAR(left->distance, 0, 2e-4);
    }
    EXPECT_GT(touching_pairs, 150);
    EXPECT_GT(apart, 300);
    EXPECT_GT(impacts, 200);
}

TEST(TinyAndHugeHulls, AnswerWithoutHarm)
{
    const Shape3 ball = Shape3::sphere(1);
    for (const double s : {5e-324, 1e-320, 1e-300, 1e-200, 1e-100, 1e-78, 1e-30, 1.0, 1e20, 1e40, 1e60}) {
        SCOPED_TRACE(s);
        const ConvexHull<3> hull(std::vector<Vec<3, double>>{{0, 0, 0}, {s, 0, 0}, {0, s, 0}, {0, 0, s}});
        ASSERT_EQ(hull.vertices().size(), 4u);
        ASSERT_EQ(hull.face_count(), 4u);
        const Shape3 shape(hull);
        EXPECT_TRUE(touching(shape, Pose3d{}, ball, Pose3d{}));
        EXPECT_TRUE(touching(shape, Pose3d{}, shape, Pose3d{}));
        EXPECT_FALSE(touching(shape, Pose3d{}, ball, Pose3d{{-3, 0, 0}}));
        EXPECT_EQ(contacts(shape, Pose3d{}, ball, Pose3d{{-0.5, 0, 0}}).size(), 1u);
        const auto gap = distance(shape, Pose3d{}, ball, Pose3d{{-3, 0, 0}}, 1e300);
        ASSERT_TRUE(gap.has_value());
        EXPECT_NEAR(gap->distance, 2, 1e-9 * std::max(1.0, s));
        const Aabb3d box = bounds(shape, Pose3d{});
        EXPECT_LE(box.lo[0], 0);
        EXPECT_GE(box.hi[2], s);
    }
}

/// The hull's own lists against the definition: each direction of an edge once, in the order of the edges,
/// and for each face the corner that is furthest along its normal.
void check_lists(const std::vector<Vec<3, double>>& points, std::size_t directions)
{
    const ConvexHull<3> hull(points);
    const auto& data = narrow::ShapeAccess::data_of(hull);
    std::vector<Vec3> known;
    for (const auto& edge : data.edge) {
        const Vec3 along = narrow::load(data.corners[edge.v[1]]) - narrow::load(data.corners[edge.v[0]]);
        const Vec3 unit = along * (1 / narrow::length(along));
        if (std::none_of(known.begin(), known.end(), [&](const Vec3& each) {
                return narrow::length2(narrow::cross(each, unit)) < 1e-20;
            }))
            known.push_back(unit);
    }
    EXPECT_TRUE(directions == 0 || directions == known.size()) << known.size();
    ASSERT_EQ(data.direction.size(), known.size());
    for (std::size_t k = 0; k < known.size(); ++k)
        ASSERT_LT(narrow::length(narrow::cross(known[k], data.direction[k])), 1e-9) << k;
    const narrow::Polytope& p = data.polytope;
    for (std::uint32_t face = 0; face < p.faces; ++face) {
        const Vec3 normal{p.nx[face], p.nx[p.face_stride + face], p.nx[2 * p.face_stride + face]};
        double furthest = -HUGE_VAL;
        for (const auto& corner : data.corners)
            furthest = std::max(furthest, narrow::dot(normal, narrow::load(corner)));
        ASSERT_EQ(p.offset[face], furthest) << face;
    }
}

TEST(HullLists, HaveEachDirectionOnceAndHowFarFacesReach)
{
    const auto prism = [](int sides) {
        std::vector<Vec<3, double>> points;
        for (int i = 0; i < sides; ++i)
            for (const double z : {-1.0, 2.0}) {
                const double angle = 2 * 3.14159265358979323846 * i / sides;
                points.push_back({std::cos(angle), std::sin(angle), z});
            }
        return points;
    };
    check_lists(prism(6), 4); // opposite sides are parallel
    check_lists(prism(600), 301);
    check_lists(prism(601), 602);
    Random random(seed(9));
    for (const std::size_t count : {std::size_t{4}, std::size_t{40}, std::size_t{1500}}) {
        std::vector<Vec<3, double>> points;
        while (points.size() < count) {
            const Vec3 p{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
            const double size = narrow::length(p);
            if (size > 0.1) points.push_back({p.x / size, p.y / size, p.z / size});
        }
        check_lists(points, 0);
    }
}

TEST(HullLists, TheFurthestPointIsTheFirstOfTheHighestOnEveryInstructionSet)
{
    Random random(seed(10));
    for (std::uint32_t stride = narrow::lanes; stride <= 200; stride += narrow::lanes)
        for (int round = 0; round < 20; ++round) {
            std::vector<double> points(std::size_t{3} * stride); // of few values, for many that are as high
            for (double& coordinate : points)
                coordinate = random.below(7) - 3.0;
            const Vec3 d{random.below(5) - 2.0, random.below(5) - 2.0, random.below(5) - 2.0};
            std::uint32_t first = 0;
            double highest = -HUGE_VAL;
            for (std::uint32_t i = 0; i < stride; ++i) {
                const Vec3 p{points[i], points[stride + i], points[std::size_t{2} * stride + i]};
                if (narrow::dot(d, p) > highest) highest = narrow::dot(d, p), first = i;
            }
            for (const InstructionSet set : supported_instruction_sets())
                ASSERT_EQ(narrow::kernels_for(set).furthest(points.data(), stride, d.x, d.y, d.z), first)
                    << name(set) << ", " << stride << " points";
        }
}

} // namespace
