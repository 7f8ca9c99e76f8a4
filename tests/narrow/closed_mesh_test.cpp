// SPDX-License-Identifier: MIT
// Inside and outside of closed meshes, beside solid angles and a loop over all triangles.
#include "jostle/closed_mesh.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/narrow/oracle.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

using Element = Mesh<3>::Element;

struct Surface
{
    std::vector<Vec3d> vertices;
    std::vector<Element> triangles;

    void add_tetrahedron(const std::array<Vec3d, 4>& p, bool outward)
    {
        const auto first = static_cast<std::uint32_t>(vertices.size());
        vertices.insert(vertices.end(), p.begin(), p.end());
        const bool positive = dot(cross(p[1] - p[0], p[2] - p[0]), p[3] - p[0]) > 0;
        for (const Element& e : {Element{0, 2, 1}, Element{0, 1, 3}, Element{1, 2, 3}, Element{2, 0, 3}}) {
            const bool as_is = positive == outward;
            triangles.push_back({first + e[0], first + e[as_is ? 1 : 2], first + e[as_is ? 2 : 1]});
        }
    }
    void add_box(const Vec3d& lo, const Vec3d& hi, bool outward)
    {
        const auto first = static_cast<std::uint32_t>(vertices.size());
        for (int i = 0; i < 8; ++i)
            vertices.push_back(
                {(i & 1) != 0 ? hi[0] : lo[0], (i & 2) != 0 ? hi[1] : lo[1], (i & 4) != 0 ? hi[2] : lo[2]});
        for (const auto& [a, b, c, d] :
             {std::array{0u, 2u, 3u, 1u}, std::array{4u, 5u, 7u, 6u}, std::array{0u, 1u, 5u, 4u},
              std::array{2u, 6u, 7u, 3u}, std::array{0u, 4u, 6u, 2u}, std::array{1u, 3u, 7u, 5u}})
            for (const Element& e : {Element{a, b, c}, Element{a, c, d}})
                triangles.push_back({first + e[0], first + e[outward ? 1 : 2], first + e[outward ? 2 : 1]});
    }
    /// A torus with waves: no vertex or side is like another.
    void add_torus(std::uint32_t around, std::uint32_t across, double waves)
    {
        const auto first = static_cast<std::uint32_t>(vertices.size());
        for (std::uint32_t i = 0; i < around; ++i)
            for (std::uint32_t j = 0; j < across; ++j) {
                const double t = 6.283185307179586 * i / around, s = 6.283185307179586 * j / across;
                const double r = 0.5 + waves * std::sin(3 * t + s), away = 1.5 + r * std::cos(s);
                vertices.push_back({away * std::cos(t), r * std::sin(s), -away * std::sin(t)});
            }
        for (std::uint32_t i = 0; i < around; ++i)
            for (std::uint32_t j = 0; j < across; ++j) {
                const std::uint32_t i2 = (i + 1) % around, j2 = (j + 1) % across;
                const std::uint32_t a = i * across + j, b = i2 * across + j, c = i2 * across + j2,
                                    d = i * across + j2;
                triangles.push_back({first + a, first + b, first + c});
                triangles.push_back({first + a, first + c, first + d});
            }
    }
    /// Each triangle gets vertices of its own, as in an STL file.
    void make_soup()
    {
        std::vector<Vec3d> own;
        for (Element& e : triangles)
            for (std::uint32_t& v : e) {
                own.push_back(vertices[v]);
                v = static_cast<std::uint32_t>(own.size() - 1);
            }
        vertices = own;
    }
    [[nodiscard]] Mesh<3> mesh() const { return {vertices, triangles}; }
};

/// The definition: how much of all directions the triangles fill, signed.
/// Source: van Oosterom, Strackee, The Solid Angle of a Plane Triangle, IEEE Trans. Biomed. Eng. 30, 1983.
double winding_by_angles(const Surface& surface, const Vec3d& p)
{
    double sum = 0;
    for (const Element& e : surface.triangles) {
        const Vec3d a = surface.vertices[e[0]] - p, b = surface.vertices[e[1]] - p,
                    c = surface.vertices[e[2]] - p;
        const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
        sum += 2 * std::atan2(dot(a, cross(b, c)),
                              la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (4 * 3.141592653589793);
}
double distance_by_loop(const Surface& surface, const Vec3d& p)
{
    double least = std::numeric_limits<double>::infinity();
    const auto at = [&](std::uint32_t v) {
        const Vec3d q = surface.vertices[v] - p;
        return narrow::Vec3{q[0], q[1], q[2]};
    };
    for (const Element& e : surface.triangles)
        least = std::min(least, oracle::to_triangle(at(e[0]), at(e[1]), at(e[2])));
    return least;
}

Surface random_surface(Random& random, int kind)
{
    Surface surface;
    const auto point = [&](double spread, bool lattice) {
        Vec3d p;
        for (double& x : p)
            x = lattice ? std::round(random.uniform(-spread, spread)) : random.uniform(-spread, spread);
        return p;
    };
    switch (kind) {
    case 0: // tetrahedra that cross and touch each other, also flat ones, on a lattice
    case 1:
        for (std::uint32_t k = 1 + random.below(12); k > 0; --k)
            surface.add_tetrahedron(
                {point(2, kind == 0), point(2, kind == 0), point(2, kind == 0), point(2, kind == 0)},
                random.chance(0.7));
        break;
    case 2: // boxes with cavities
        surface.add_box({-2, -2, -2}, {2, 2, 2}, true);
        surface.add_box({-1, -1, -1}, {1, 1, 1}, false);
        surface.add_box({2, -1, -1}, {3, 1, 1}, true); // shares a face's place
        break;
    default:
        surface.add_torus(5 + random.below(20), 4 + random.below(10), random.uniform(0, 0.1));
    }
    if (random.chance(0.5)) surface.make_soup();
    return surface;
}
Vec3d random_point(Random& random, const Surface& surface)
{
    Vec3d p;
    for (double& x : p)
        x = random.chance(0.4) ? std::round(random.uniform(-3, 3)) : random.uniform(-2.5, 2.5);
    const auto any = [&] {
        return surface.vertices[random.below(static_cast<std::uint32_t>(surface.vertices.size()))];
    };
    // Level with a vertex, where the ray meets sides and corners exactly.
    if (random.chance(0.4)) p[1] = any()[1];
    if (random.chance(0.4)) p[2] = any()[2];
    return p;
}

TEST(ClosedMesh, WindsAsSolidAnglesSay)
{
    Random random(1);
    std::size_t inside = 0, outside = 0, often = 0, reversed = 0;
    for (int round = 0; round < 400; ++round) {
        const Surface surface = random_surface(random, round % 4);
        const ClosedMesh solid(surface.mesh());
        for (int k = 0; k < 60; ++k) {
            const Vec3d p = random_point(random, surface);
            const double distance = distance_by_loop(surface, p);
            const SignedDistance<double> at = solid.signed_distance(Pose3d{}, p);
            ASSERT_NEAR(std::abs(at.distance), distance, 1e-11);
            ASSERT_EQ(solid.contains(Pose3d{}, p), at.distance <= 0);
            if (distance < 1e-6) continue; // there solid angles are rounding
            const double exact = winding_by_angles(surface, p);
            ASSERT_NEAR(exact, std::round(exact), 1e-6);
            const int number = solid.winding_number(p);
            ASSERT_EQ(number, static_cast<int>(std::round(exact))) << "round " << round << " point " << k;
            ASSERT_EQ(at.distance < 0, number != 0);
            (number != 0 ? inside : outside) += 1;
            often += number > 1 ? 1 : 0;
            reversed += number < 0 ? 1 : 0;
            // The way to the surface, and outwards.
            const Vec3d to = p - at.normal * at.distance - at.point;
            ASSERT_NEAR(dot(to, to), 0, 1e-20);
            ASSERT_NEAR(dot(at.normal, at.normal), 1, 1e-12);
        }
    }
    EXPECT_GT(inside, 1000u);
    EXPECT_GT(outside, 1000u);
    EXPECT_GT(often, 20u);
    EXPECT_GT(reversed, 100u);
}

/// Nothing depends on the size, down to where doubles end.
TEST(ClosedMesh, OfAnySize)
{
    Random random(2);
    for (int round = 0; round < 40; ++round) {
        const Surface surface = random_surface(random, round % 4);
        const ClosedMesh solid(surface.mesh());
        for (const int power : {-900, -149, -40, 40, 190}) {
            Surface scaled = surface;
            for (Vec3d& v : scaled.vertices)
                for (double& x : v)
                    x = std::ldexp(x, power);
            const ClosedMesh other(scaled.mesh());
            for (int k = 0; k < 20; ++k) {
                const Vec3d p = random_point(random, surface);
                Vec3d q;
                for (int d = 0; d < 3; ++d)
                    q[d] = std::ldexp(p[d], power);
                ASSERT_EQ(other.winding_number(q), solid.winding_number(p));
            }
        }
    }
}

/// Posed, in float, turned inside out, and many at once on several threads.
TEST(ClosedMesh, ManyPointsAtOnce)
{
    Random random(3);
    const auto threads = make_thread_executor(3);
    for (int round = 0; round < 10; ++round) {
        Surface surface = random_surface(random, round % 4);
        const ClosedMesh solid(surface.mesh());
        for (Element& e : surface.triangles)
            std::swap(e[0], e[1]);
        const ClosedMesh turned(surface.mesh());
        const Pose3f pose = random.pose<float>(5);
        std::vector<Vec3f> points(300);
        for (Vec3f& p : points)
            for (int d = 0; d < 3; ++d)
                p[d] = pose.position[d] + static_cast<float>(random.uniform(-2, 2));
        std::vector<std::uint8_t> inside(points.size()), inside_turned(points.size());
        std::vector<SignedDistance3f> distances(points.size());
        solid.contains(pose, points, inside, *threads);
        turned.contains(pose, points, inside_turned, *threads);
        solid.signed_distances(pose, points, distances, *threads);
        EXPECT_EQ(inside, inside_turned);
        for (std::size_t i = 0; i < points.size(); ++i) {
            ASSERT_EQ(inside[i] != 0, solid.contains(pose, points[i]));
            const SignedDistance3f one = solid.signed_distance(pose, points[i]);
            ASSERT_EQ(distances[i].distance, one.distance);
            ASSERT_EQ(distances[i].normal, one.normal);
            ASSERT_EQ(distances[i].point, one.point);
            ASSERT_EQ(inside[i] != 0, one.distance <= 0);
        }
    }
}

TEST(ClosedMesh, RefusesHoles)
{
    const auto message = [](const auto& make) -> std::string {
        try {
            make();
        } catch (const Error& error) {
            return error.what() + (" " + std::to_string(error.index()));
        }
        return "nothing";
    };
    const auto has = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    };
    Random random(4);
    for (int round = 0; round < 40; ++round) {
        Surface surface;
        surface.add_torus(6, 5, 0.05);
        if (round % 2 == 0) surface.make_soup();
        EXPECT_EQ(message([&] { (void)ClosedMesh(surface.mesh()); }), "nothing");
        // A triangle without area closes nothing and opens nothing.
        surface.triangles.push_back({0, 0, 1});
        EXPECT_EQ(message([&] { (void)ClosedMesh(surface.mesh()); }), "nothing");
        surface.triangles.pop_back();
        const std::uint32_t gone = random.below(static_cast<std::uint32_t>(surface.triangles.size()));
        Surface open = surface;
        open.triangles.erase(open.triangles.begin() + gone);
        EXPECT_TRUE(
            has(message([&] { (void)ClosedMesh(open.mesh()); }), "isn't closed: the side of triangle"));
        std::swap(surface.triangles[gone][0], surface.triangles[gone][1]);
        EXPECT_TRUE(has(message([&] { (void)ClosedMesh(surface.mesh()); }), "isn't closed"));
    }
    Surface box;
    box.add_box({0, 0, 0}, {1, 1, 1}, true);
    box.triangles.erase(box.triangles.begin() + 1); // 0, 3, 1: its sides are those of 0 2 3, 1 3 7 and 0 1 5
    EXPECT_TRUE(has(message([&] { (void)ClosedMesh(box.mesh()); }),
                    "the side of triangle 0 between the vertices 0 and 3 has no triangle beyond it"));
    box.add_box({0, 0, 0}, {1, 1, 1}, true);
    const ClosedMesh solid([] {
        Surface whole;
        whole.add_box({0, 0, 0}, {1, 1, 1}, true);
        return whole.mesh(); // which needn't stay
    }());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(solid.contains(Pose3d{}, Vec3d{0.5, 0.5, 1}));
    EXPECT_FALSE(solid.contains(Pose3d{}, Vec3d{0.5, 0.5, 1 + 1e-6}));
    EXPECT_EQ(solid.signed_distance(Pose3d{}, Vec3d{0.5, 0.5, 0.75}).distance, -0.25);
    EXPECT_TRUE(
        has(message([&] { (void)solid.contains(Pose3d{}, Vec3d{0, nan, 0}); }), "a point is 0 nan 0"));
    EXPECT_TRUE(has(message([&] { (void)solid.winding_number({1e61, 0, 0}); }), "a point is"));
    EXPECT_TRUE(
        has(message([&] { (void)solid.signed_distance(Pose3d{{nan, 0, 0}}, Vec3d{}); }), "a pose has"));
    std::vector<Vec3d> points(200);
    std::vector<std::uint8_t> inside(200);
    points[150][0] = points[170][0] = nan;
    EXPECT_TRUE(has(message([&] { solid.contains(Pose3d{}, points, inside); }), "the point 150 is nan"));
    inside.resize(3);
    EXPECT_TRUE(has(message([&] { solid.contains(Pose3d{}, points, inside); }), "200 points and room for 3"));
}

} // namespace
