// SPDX-License-Identifier: MIT
// Which of a surface's elements have a contact, from the definition: those that are nearest among their
// neighbours at the side or corner that the body meets, each of them whatever else the body touches, and no
// others but along their own normal.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

template <int Dim>
double dot(const Vec<Dim, double>& a, const Vec<Dim, double>& b)
{
    double sum = 0;
    for (std::size_t d = 0; d < a.size(); ++d)
        sum += a[d] * b[d];
    return sum;
}

template <int Dim>
struct Surface
{
    std::vector<Vec<Dim, double>> vertices;
    std::vector<typename Mesh<Dim>::Element> elements;

    /// Whether f has all the vertices of e that lie highest along n.
    [[nodiscard]] bool meet(std::size_t e, std::size_t f, const Vec<Dim, double>& n) const
    {
        double top = -1e300;
        for (const std::uint32_t v : elements[e])
            top = std::max(top, dot<Dim>(n, vertices[v]));
        for (const std::uint32_t v : elements[e])
            if (dot<Dim>(n, vertices[v]) > top - 1e-6 &&
                std::find(elements[f].begin(), elements[f].end(), v) == elements[f].end())
                return false;
        return true;
    }
    [[nodiscard]] Vec<Dim, double> normal(std::size_t e) const
    {
        Vec<Dim, double> n{};
        const auto p = vertices[elements[e][0]], q = vertices[elements[e][1]];
        if constexpr (Dim == 2) {
            n = {q[1] - p[1], p[0] - q[0]};
        } else {
            const auto r = vertices[elements[e][2]];
            for (std::size_t d = 0; d < 3; ++d) {
                const std::size_t i = (d + 1) % 3, j = (d + 2) % 3;
                n[d] = (q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i]);
            }
        }
        const double size = std::sqrt(dot<Dim>(n, n));
        for (double& x : n)
            x /= size;
        return n;
    }
};

/// A grid of 7 x 7 cells of that height, with a wall on the side of lowest x that shares its vertices.
template <class Height>
Surface<3> ground(Height height, bool wall)
{
    Surface<3> s;
    for (std::uint32_t z = 0; z < 8; ++z)
        for (std::uint32_t x = 0; x < 8; ++x)
            s.vertices.push_back({x * 0.5, height(x * 0.5, z * 0.5), z * 0.5});
    for (std::uint32_t v = 0; v < 55; ++v) {
        if (v % 8 == 7) continue;
        s.elements.push_back({v, v + 9, v + 1});
        s.elements.push_back({v, v + 8, v + 9});
    }
    if (!wall) return s;
    for (std::uint32_t z = 0; z < 8; ++z)
        s.vertices.push_back({0, 1, z * 0.5});
    for (std::uint32_t z = 0; z < 7; ++z) {
        s.elements.push_back({64 + z, 65 + z, 8 * z});
        s.elements.push_back({8 * z, 65 + z, 8 * z + 8});
    }
    return s;
}

/// What the definition asks of the contacts of children with a surface, where no child's core goes through
/// it. Returns how many elements had to have a contact.
template <int Dim>
int expect_as_defined(const Surface<Dim>& surface, const Mesh<Dim>& mesh, const Compound<Dim>& compound,
                      const std::vector<typename Compound<Dim>::Child>& children,
                      const Pose<Dim, double>& pose, double margin)
{
    const auto found =
        all_contacts(Shape<Dim>(mesh), Pose<Dim, double>{}, Shape<Dim>(compound), pose, margin);
    int wanted = 0;
    for (std::uint32_t child = 0; child < children.size(); ++child) {
        const Compound<Dim> alone(std::vector<typename Compound<Dim>::Child>{children[child]});
        std::vector<double> gap(surface.elements.size(), 1e300);
        std::vector<Vec<Dim, double>> normal(surface.elements.size());
        bool through = false;
        for (std::size_t e = 0; e < gap.size(); ++e) {
            std::vector<Vec<Dim, double>> corners;
            typename Mesh<Dim>::Element numbers;
            for (std::size_t i = 0; i < numbers.size(); ++i) {
                corners.push_back(surface.vertices[surface.elements[e][i]]);
                numbers[i] = static_cast<std::uint32_t>(i);
            }
            const Mesh<Dim> one(corners, std::vector<typename Mesh<Dim>::Element>{numbers});
            const auto d =
                distance(Shape<Dim>(one), Pose<Dim, double>{}, Shape<Dim>(alone), pose, margin + 1e-3);
            if (!d) continue;
            gap[e] = d->distance;
            normal[e] = d->normal;
            through = through || d->distance <= -0.9 * children[child].shape.radius();
        }
        if (through) continue;
        const auto is_nearest = [&](std::size_t e) {
            for (std::size_t f = 0; f < gap.size(); ++f)
                if (gap[f] < gap[e] - 1e-9 && surface.meet(e, f, normal[e])) return false;
            return true;
        };
        for (std::size_t e = 0; e < gap.size(); ++e) {
            if (gap[e] > margin - 1e-9 || !is_nearest(e)) continue;
            ++wanted;
            bool has = false;
            for (const auto& c : found)
                has = has || (c.part_b == child && dot<Dim>(c.normal, normal[e]) > 1 - 1e-6 &&
                              std::abs(c.point[0].depth + gap[e]) < 1e-6);
            EXPECT_TRUE(has) << "child " << child << " and element " << e << " at " << gap[e];
        }
        for (const auto& c : found) {
            if (c.part_b != child || std::abs(dot<Dim>(c.normal, surface.normal(c.part_a))) > 1 - 1e-9)
                continue;
            EXPECT_TRUE(is_nearest(c.part_a)) << "child " << child << " and element " << c.part_a;
        }
    }
    return wanted;
}

TEST(ACrease, CountsForItselfWhateverElseTheBodyTouches)
{
    Random random(31);
    std::vector<Surface<3>> surfaces;
    for (const double bump : {0.0, 1e-7, 1e-4, 1e-3, 0.01, 0.1})
        surfaces.push_back(ground([&](double, double) { return random.uniform(-bump, bump); }, true));
    for (const double k : {-0.03, -0.001, 0.0005, 0.003, 0.03, 0.3})
        surfaces.push_back(ground(
            [k](double x, double z) { return -k * ((x - 1.7) * (x - 1.7) + (z - 1.8) * (z - 1.8)); }, k > 0));
    for (const double k : {0.0005, 0.004, 0.05}) // ridges and valleys
        surfaces.push_back(
            ground([k](double x, double) { return std::lround(2 * x) % 2 == 0 ? 0 : k; }, true));
    int wanted = 0;
    for (const Surface<3>& surface : surfaces) {
        const Mesh<3> mesh(surface.vertices, surface.elements);
        for (int round = 0; round < 60; ++round) {
            std::vector<Compound<3>::Child> wheels;
            for (int i = 0; i < 3; ++i) {
                const double r = random.chance(0.2) ? 1.5 : random.uniform(0.15, 0.4);
                wheels.push_back({random.chance(0.5) ? Shape3::sphere(r) : Shape3::capsule(0.2, r), {}});
                const double x = random.chance(0.3) ? r - 0.01 : random.uniform(0.5, 3.2);
                const double z = random.chance(0.3) ? 1.5 : random.uniform(0.5, 3.2);
                if (wheels.back().shape.type() == ShapeTypes::capsule) {
                    const double yaw = random.chance(0.3) ? 0 : random.uniform(0, 3);
                    const double tilt = random.chance(0.5) ? 0 : random.uniform(-0.05, 0.05);
                    const double c = std::sqrt(0.5);
                    Pose3d& pose = wheels.back().pose; // lying along x, then turned about y
                    const double s = std::sin(yaw / 2), k = std::cos(yaw / 2);
                    pose.rotation = {s * c, s * tilt, c * k + tilt * s, c * k};
                }
                wheels.back().pose.position = {x, r + random.uniform(-0.05, 0.02), z};
            }
            const Compound<3> compound(wheels);
            wanted += expect_as_defined<3>(surface, mesh, compound, wheels, {}, random.chance(0.5) ? 0 : 0.1);
            ASSERT_FALSE(HasFailure()) << "surface " << &surface - surfaces.data() << ", round " << round;
        }
    }
    EXPECT_GT(wanted, 3000);
}

TEST(ACrease, OfAChainCountsForItself)
{
    Random random(32);
    int wanted = 0;
    for (const double bump : {0.0, 1e-7, 1e-3, 0.01, 0.1})
        for (int round = 0; round < 400; ++round) {
            Surface<2> chain;
            for (std::uint32_t i = 0; i < 10; ++i) {
                chain.vertices.push_back({i * 0.5, random.uniform(-bump, bump)});
                if (i > 0) chain.elements.push_back({i, i - 1});
            }
            chain.vertices.push_back({0, 2}); // a wall
            chain.elements.push_back({0, 10});
            const Mesh<2> mesh(chain.vertices, chain.elements);
            std::vector<Compound<2>::Child> wheels;
            for (int i = 0; i < 2; ++i) {
                const double r = random.uniform(0.2, 1);
                const double x = random.chance(0.5)   ? r - 0.01
                                 : random.chance(0.5) ? 0.5 * (2 + random.below(5))
                                                      : random.uniform(0.5, 4);
                wheels.push_back({Shape2::sphere(r), {{x, r + random.uniform(-0.05, 0.02)}}});
            }
            const Compound<2> compound(wheels);
            wanted += expect_as_defined<2>(chain, mesh, compound, wheels, {}, random.chance(0.5) ? 0 : 0.1);
            ASSERT_FALSE(HasFailure()) << "bump " << bump << ", round " << round;
        }
    EXPECT_GT(wanted, 3000);
}

TEST(ACrease, HoldsACapsuleAlongItAtBothEnds)
{
    for (const double k : {1e-7, 1e-5, 0.001, 0.004, 0.05, 0.5}) {
        const Surface<3> roof = ground([k](double x, double) { return -k * std::abs(x - 1.5); }, false);
        const Mesh<3> mesh(roof.vertices, roof.elements);
        const double c = std::sqrt(0.5);
        for (const double z : {0.75, 1.0, 1.1, 1.25, 1.6}) {
            const Pose3d pose{{1.5, 0.19, z}, {c, 0, 0, c}}; // along z, from z - 0.4 to z + 0.4
            double least = 1e300, most = -1e300;
            for (const auto& contact : contacts(Shape3(mesh), Pose3d{}, Shape3::capsule(0.4, 0.2), pose)) {
                EXPECT_GT(contact.normal[1], 1 - 1e-6 - k * k) << k << " " << z;
                for (std::uint32_t i = 0; i < contact.count; ++i) {
                    EXPECT_LT(contact.point[i].depth, 0.01 + 1e-9);
                    if (contact.point[i].depth < 0.01 - 1e-9) continue;
                    least = std::min(least, contact.point[i].from_a[2]);
                    most = std::max(most, contact.point[i].from_a[2]);
                }
            }
            EXPECT_NEAR(least, z - 0.4, 1e-6) << k;
            EXPECT_NEAR(most, z + 0.4, 1e-6) << k;
        }
        // In one cell: one contact with two points.
        const Pose3d pose{{1.5, 0.19, 1.25}, {c, 0, 0, c}};
        for (const auto& contact : all_contacts(Shape3(mesh), Pose3d{}, Shape3::capsule(0.2, 0.2), pose))
            if (contact.point[0].depth > 0.01 - 1e-9) {
                EXPECT_EQ(contact.count, 2u) << k;
            }
    }
}

} // namespace
