// SPDX-License-Identifier: MIT
// Distances and touching of meshes, which are searched through trees, and their slow twin: all pairs of
// parts.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "narrow/interface/answers.hpp"
#include "narrow/parts/each_part.hpp"
#include "narrow/parts/pair.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;
using narrow::Gap;
using narrow::Part;
using narrow::Placed;

namespace {

/// By the definition: of all parts with all parts; of equals the first numbers count.
Gap<3> least_gap(const Placed<3>& pair)
{
    Gap<3> best;
    best.distance = HUGE_VAL;
    std::uint32_t best_a = 0, best_b = 0;
    narrow::for_each_part_pair(
        pair, narrow::Range<3>{HUGE_VAL},
        [&](std::uint32_t number_a, const Part<3>& a, std::uint32_t number_b, const Part<3>& b) {
            Gap<3> gap;
            narrow::part_gap(a, b, HUGE_VAL, gap);
            const bool lower = number_a != best_a ? number_a < best_a : number_b < best_b;
            if (gap.distance > best.distance || gap.distance == HUGE_VAL) return;
            if (gap.distance == best.distance && !lower) return;
            best = gap;
            best_a = number_a;
            best_b = number_b;
        });
    return best;
}
bool same(const narrow::Vec3& a, const narrow::Vec3& b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

/// Compares the search with the definition, for some bounds of the distance.
void expect_least(const Shape3& a, const Pose3d& pose_a, const Shape3& b, const Pose3d& pose_b)
{
    SCOPED_TRACE(testing::Message() << "types " << a.type() << " and " << b.type());
    Placed<3> pair = narrow::place(a, pose_a, b, pose_b);
    narrow::arrange(pair);
    const Gap<3> least = least_gap(pair);
    for (const double enough : {HUGE_VAL, 2.0, std::abs(least.distance), std::abs(least.distance) / 2, 0.0}) {
        Gap<3> gap;
        narrow::find_gap(pair, enough, gap);
        if (least.distance > enough || least.distance == HUGE_VAL) {
            ASSERT_EQ(gap.distance, HUGE_VAL) << "of " << least.distance << " within " << enough;
            continue;
        }
        ASSERT_EQ(gap.distance, least.distance) << "within " << enough;
        ASSERT_TRUE(same(gap.normal, least.normal) && same(gap.on_a, least.on_a) &&
                    same(gap.on_b, least.on_b));
    }
    ASSERT_EQ(narrow::find_touch(pair), least.distance <= 0);
    for (const InstructionSet set : supported_instruction_sets()) {
        pair.kernels = &narrow::kernels_for(set);
        Gap<3> gap;
        narrow::find_gap(pair, HUGE_VAL, gap);
        ASSERT_EQ(gap.distance, least.distance) << name(set);
        ASSERT_EQ(narrow::find_touch(pair), least.distance <= 0) << name(set);
    }
}

using Vertices = std::vector<Vec<3, double>>;
using Elements = std::vector<Mesh<3>::Element>;

/// A closed bumpy surface of 4 n n triangles, of about unit size.
Mesh<3> bumpy_ball(Random& random, std::uint32_t n, double scale = 1)
{
    Vertices vertices;
    Elements elements;
    const double shift = random.uniform(0, 6), bump = random.uniform(0, 0.3);
    for (std::uint32_t i = 0; i <= n; ++i)
        for (std::uint32_t j = 0; j < 2 * n; ++j) {
            const double t = 3.141592653589793 * i / n, p = 3.141592653589793 * j / n;
            const double r = scale * (1 + bump * std::sin(3 * t + shift) * std::cos(4 * p));
            vertices.push_back(
                {r * std::sin(t) * std::cos(p), r * std::cos(t), r * std::sin(t) * std::sin(p)});
        }
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < 2 * n; ++j) {
            const std::uint32_t k = (j + 1) % (2 * n);
            elements.push_back({i * 2 * n + j, (i + 1) * 2 * n + j, (i + 1) * 2 * n + k});
            elements.push_back({i * 2 * n + j, (i + 1) * 2 * n + k, i * 2 * n + k});
        }
    return Mesh<3>(vertices, elements);
}
Mesh<3> soup(Random& random, std::uint32_t triangles, double scale)
{
    Vertices vertices;
    Elements elements;
    const double size = random.chance(0.5) ? 0.2 : 1;
    for (std::uint32_t i = 0; i < triangles; ++i) {
        Vec<3, double> at;
        for (double& x : at)
            x = random.uniform(-1, 1);
        for (int k = 0; k < 3; ++k) {
            Vec<3, double> p;
            for (std::size_t d = 0; d < 3; ++d)
                p[d] =
                    scale * (random.chance(0.2) ? std::round(at[d]) : at[d] + size * random.uniform(-1, 1));
            vertices.push_back(p);
        }
        elements.push_back({3 * i, random.chance(0.1) ? 3 * i : 3 * i + 1, 3 * i + 2});
    }
    return Mesh<3>(vertices, elements);
}
/// A plate of squares: all at the same height, so that many parts are equally near.
Mesh<3> plate(std::uint32_t n, double scale)
{
    Vertices vertices;
    Elements elements;
    for (std::uint32_t i = 0; i <= n; ++i)
        for (std::uint32_t j = 0; j <= n; ++j)
            vertices.push_back({scale * i, 0, scale * j});
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
            const std::uint32_t v = i * (n + 1) + j;
            elements.push_back({v, v + n + 2, v + 1});
            elements.push_back({v, v + n + 1, v + n + 2});
        }
    return Mesh<3>(vertices, elements);
}

TEST(NearestParts, OfTwoMeshesAreThoseOfAllPairs)
{
    Random random(31);
    for (int round = 0; round < 40; ++round) {
        const double scale = round % 8 == 0 ? std::pow(10.0, random.uniform(-30, 30)) : 1;
        const Mesh<3> meshes[] = {bumpy_ball(random, 2 + random.below(5), scale),
                                  soup(random, 1 + random.below(90), scale), plate(5, 0.4 * scale)};
        for (const Mesh<3>& a : meshes)
            for (const Mesh<3>& b : meshes) {
                Pose3d pose_a = random.pose<double>(1),
                       pose_b = random.pose<double>(random.chance(0.5) ? 4 : 1);
                for (Pose3d* pose : {&pose_a, &pose_b})
                    for (double& x : pose->position)
                        x *= scale;
                expect_least(a, pose_a, b, pose_b);
                if (testing::Test::HasFatalFailure()) FAIL() << "round " << round;
            }
    }
}

TEST(NearestParts, OfMeshesAndOtherShapesAreThoseOfAllPairs)
{
    Random random(32);
    for (int round = 0; round < 30; ++round) {
        const Zoo<3> zoo(random, 1);
        const Mesh<3> ball = bumpy_ball(random, 2 + random.below(6)), some = soup(random, 60, 1),
                      flat = plate(6, 0.3);
        for (const Shape3& shape : zoo.shapes)
            for (const Mesh<3>* mesh : {&ball, &some, &flat}) {
                if (shape.type() == ShapeTypes::height_field) continue; // has no tree
                expect_least(*mesh, random.pose<double>(1), shape,
                             random.pose<double>(random.chance(0.5) ? 4 : 1));
                expect_least(shape, random.pose<double>(1), *mesh, random.pose<double>(1));
                if (testing::Test::HasFatalFailure()) FAIL() << "round " << round;
            }
    }
}

/// A user's ball, known by its support points.
class UsersBall final : public CustomShape<3>
{
  public:
    double radius() const noexcept override { return 0.7; }
    Vec<3, double> support(const Vec<3, double>& d) const noexcept override
    {
        const double size = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        return {0.7 * d[0] / size, 0.7 * d[1] / size, 0.7 * d[2] / size};
    }
};

TEST(NearestParts, OfAMeshAndAUsersShapeAreThoseOfAllPairs)
{
    Random random(33);
    const UsersBall ball;
    const Shape3 custom(ball, ShapeTypes::first_custom);
    for (int round = 0; round < 60; ++round) {
        const Mesh<3> mesh = bumpy_ball(random, 5);
        expect_least(mesh, random.pose<double>(1), custom, random.pose<double>(random.chance(0.5) ? 4 : 1));
        if (testing::Test::HasFatalFailure()) FAIL() << "round " << round;
    }
}

TEST(NearestParts, AllInOnePlaceOrOnALineOrInAPlane)
{
    Random random(34);
    const Vertices points = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    const Mesh<3> point(points, Elements(20, {0, 1, 2}));
    Vertices in_line;
    Elements along;
    for (std::uint32_t i = 0; i < 30; ++i) {
        in_line.push_back({0.1 * i, 0.2 * i, 0});
        if (i >= 2) along.push_back({i - 2, i - 1, i});
    }
    const Mesh<3> line(in_line, along);
    const Mesh<3> flat = plate(4, 0.5), ball = bumpy_ball(random, 4);
    const Vertices huge = {{-1e60, 0, 0}, {1e60, 0, 1e60}, {1e60, 1e60, -1e60}, {0, -1e60, 5}};
    const Mesh<3> giant(huge, Elements{{0, 1, 2}, {1, 2, 3}, {0, 2, 3}});
    const Vertices tiny = {{0, 0, 0}, {5e-324, 0, 0}, {0, 1e-310, 0}, {0, 0, 1e-320}};
    const Mesh<3> dwarf(tiny, Elements{{0, 1, 2}, {1, 2, 3}, {0, 2, 3}});
    const Mesh<3>* const all[] = {&point, &line, &flat, &ball, &giant, &dwarf};
    for (const Mesh<3>* a : all)
        for (const Mesh<3>* b : all)
            for (int k = 0; k < 5; ++k) {
                expect_least(*a, random.pose<double>(k), *b, random.pose<double>(k));
                if (testing::Test::HasFatalFailure()) return;
            }
}

TEST(NearestParts, OfEqualOnesTheLowestNumbersCount)
{
    // Two plates above each other, nodes turned: every triangle is 1 from some others.
    const Mesh<3> below = plate(9, 1), above = plate(7, 1);
    Pose3d up;
    up.position = {0, 1, 0};
    expect_least(below, {}, above, up);
    const auto d = distance(Shape3(below), Pose3d{}, Shape3(above), up, 10);
    ASSERT_TRUE(d);
    EXPECT_EQ(d->distance, 1);
    // Triangle 0 of each is below or above the other: their common corner is the first of both.
    EXPECT_LE(d->from_a[0], 1);
    EXPECT_LE(d->from_a[2], 1);
}

} // namespace
