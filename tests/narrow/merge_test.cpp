// SPDX-License-Identifier: MIT
// Contacts with surfaces that are one for each direction, against all of them and the definition of the
// choice.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>

#include "tests/narrow/random_pairs.hpp"
#include "tests/narrow/samples.hpp"

using namespace jostle;
using narrow_samples::Terrain;

namespace {

constexpr double equal = 1e-8; ///< but for rounding

template <int Dim>
using Vector = Vec<Dim, double>;
template <int Dim>
double dot(const Vector<Dim>& a, const Vector<Dim>& b)
{
    double sum = 0;
    for (std::size_t d = 0; d < Dim; ++d)
        sum += a[d] * b[d];
    return sum;
}
template <int Dim>
Vector<Dim> from(const Vector<Dim>& a, const Vector<Dim>& b)
{
    Vector<Dim> way;
    for (std::size_t d = 0; d < Dim; ++d)
        way[d] = b[d] - a[d];
    return way;
}
template <int Dim>
double apart(const Vector<Dim>& a, const Vector<Dim>& b)
{
    return std::sqrt(dot<Dim>(from<Dim>(a, b), from<Dim>(a, b)));
}
/// What a point lacks to lie on the line through a and b, along normal n.
double beside(const Vector<3>& n, const Vector<3>& a, const Vector<3>& b, const Vector<3>& p)
{
    const Vector<3> e = from<3>(a, b), way = from<3>(a, p);
    const Vector<3> across = {n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2],
                              n[0] * e[1] - n[1] * e[0]};
    return dot<3>(across, way) / std::sqrt(dot<3>(across, across));
}
/// How far p lies outside of a triangle seen along n.
double outside(const Vector<3>& n, const Vector<3>* t, const Vector<3>& p)
{
    const double turn = beside(n, t[0], t[1], t[2]) > 0 ? 1 : -1;
    double most = 0;
    for (int side = 0; side < 3; ++side)
        most = std::max(most, -turn * beside(n, t[side], t[(side + 1) % 3], p));
    return most;
}

/// Whether points are those that the definition chooses from `all`, in this order and but for rounding.
template <int Dim>
bool well_chosen(const Vector<Dim>& n, const std::vector<Vector<Dim>>& chosen,
                 const std::vector<ContactPoint<Dim, double>>& all, double deepest)
{
    const auto none_has_more = [&](double most, const auto& measure) {
        return std::none_of(all.begin(), all.end(),
                            [&](const auto& p) { return measure(p.from_a) > most + equal; });
    };
    if (std::none_of(all.begin(), all.end(),
                     [&](const auto& p) { return p.from_a == chosen[0] && p.depth >= deepest; }))
        return false;
    const double far = chosen.size() > 1 ? apart<Dim>(chosen[0], chosen[1]) : 0, little = 1e-4 * far;
    if (!none_has_more(far, [&](const auto& p) { return apart<Dim>(chosen[0], p); })) return false;
    if (Dim == 2 || chosen.size() < 2) return true;
    if constexpr (Dim == 3) {
        const Vector<3> way = from<3>(chosen[0], chosen[1]);
        const double up = dot<3>(way, n);
        if (std::sqrt(std::max(0.0, far * far - up * up)) <= little) return chosen.size() == 2;
        const auto aside = [&](const auto& p) { return std::abs(beside(n, chosen[0], chosen[1], p)); };
        const double third = chosen.size() > 2 ? aside(chosen[2]) : little;
        if (third < little || !none_has_more(third, aside)) return false;
        if (chosen.size() == 2) return true;
        const auto out = [&](const auto& p) { return outside(n, chosen.data(), p); };
        const double fourth = chosen.size() > 3 ? out(chosen[3]) : little;
        return fourth >= little && none_has_more(fourth, out);
    }
    return true;
}

/// The definition: `all` are the contacts of one body with a surface. What is chosen differs from it by
/// rounding alone, so the test asks whether each choice is as good as any other.
template <int Dim>
void expect_chosen(std::vector<Contact<Dim, double>> all, const std::vector<Contact<Dim, double>>& found)
{
    std::set<std::pair<std::uint32_t, std::uint32_t>> leaders;
    while (!all.empty()) {
        double deepest = -HUGE_VAL;
        for (const auto& c : all)
            deepest = std::max(deepest, c.point[0].depth);
        // Of those that are deepest but for rounding, the one of which there is a contact.
        const Contact<Dim, double>* made = nullptr;
        for (const auto& c : all)
            for (const auto& f : found)
                if (made == nullptr && c.point[0].depth > deepest - equal && f.part_a == c.part_a &&
                    f.part_b == c.part_b)
                    made = &f;
        ASSERT_NE(made, nullptr);
        ASSERT_TRUE(leaders.insert({made->part_a, made->part_b}).second);
        std::vector<ContactPoint<Dim, double>> points;
        std::vector<Contact<Dim, double>> others;
        for (const auto& c : all) {
            const double along = dot<Dim>(c.normal, made->normal);
            if (std::abs(along - 0.996) < 1e-12) return; // either way
            if (along < 0.996)
                others.push_back(c);
            else
                points.insert(points.end(), c.point.begin(), c.point.begin() + c.count);
        }
        // A subset, with the deepest first, and no features twice.
        std::set<std::uint32_t> features;
        std::vector<Vector<Dim>> chosen;
        for (std::uint32_t i = 0; i < made->count; ++i) {
            const auto& p = made->point[i];
            ASSERT_TRUE(std::any_of(points.begin(), points.end(), [&](const auto& q) {
                return q.from_a == p.from_a && q.from_b == p.from_b && q.depth == p.depth;
            }));
            ASSERT_LE(p.depth, made->point[0].depth);
            ASSERT_TRUE(features.insert(p.feature).second);
            chosen.push_back(p.from_a);
        }
        ASSERT_NEAR(made->point[0].depth, deepest, equal);
        ASSERT_LE(made->count, (Contact<Dim, double>::max_points));
        // As good as any in the order in which they were chosen, whichever that was.
        std::sort(chosen.begin(), chosen.end());
        bool is_best = false;
        do
            is_best = is_best || well_chosen<Dim>(made->normal, chosen, points, deepest - equal);
        while (!is_best && std::next_permutation(chosen.begin(), chosen.end()));
        ASSERT_TRUE(is_best);
        all = std::move(others);
    }
    EXPECT_EQ(leaders.size(), found.size());
}

template <int Dim>
bool is_surface(const Shape<Dim>& shape)
{
    return shape.type() == ShapeTypes::mesh || shape.type() == ShapeTypes::height_field;
}

template <int Dim>
int expect_chosen_of_pair(const Shape<Dim>& a, const Pose<Dim, double>& pose_a, const Shape<Dim>& b,
                          const Pose<Dim, double>& pose_b, double margin)
{
    const auto all = all_contacts(a, pose_a, b, pose_b, margin),
               found = contacts(a, pose_a, b, pose_b, margin);
    if (is_surface(a) == is_surface(b)) { // one for each two triangles, as they were
        EXPECT_EQ(all.size(), found.size());
        return 0;
    }
    const auto body = [&](const Contact<Dim, double>& c) { return is_surface(a) ? c.part_b : c.part_a; };
    std::set<std::uint32_t> bodies;
    for (const auto& c : all)
        bodies.insert(body(c));
    for (const std::uint32_t one : bodies) {
        std::vector<Contact<Dim, double>> of_all, of_found;
        for (const auto& c : all)
            if (body(c) == one) of_all.push_back(c);
        for (const auto& c : found)
            if (body(c) == one) of_found.push_back(c);
        expect_chosen<Dim>(of_all, of_found);
        if (testing::Test::HasFailure()) break;
    }
    for (std::size_t i = 1; i < found.size(); ++i)
        EXPECT_LT(std::tie(found[i - 1].part_a, found[i - 1].part_b),
                  std::tie(found[i].part_a, found[i].part_b));
    return static_cast<int>(all.size()) - static_cast<int>(found.size());
}

TEST(ContactsOfASurface, AreChosenAsDefined)
{
    Random random(1);
    int merged = 0;
    for (int round = 0; round < 100; ++round) {
        const double bumps[] = {0, 0.02, 0.1, 0.4};
        const Terrain terrain(8, 8, bumps[random.below(4)]);
        const Mesh<3> mesh(terrain.vertices, terrain.triangles);
        const HeightField field(HeightGrid<double>{terrain.heights, terrain.columns, terrain.rows, 1, 1});
        const Zoo<3> zoo(random, 1, false);
        for (const Shape3& body : zoo.shapes)
            for (const Shape3& ground : {Shape3(mesh), Shape3(field)}) {
                Pose3d pose = random.pose<double>(1);
                pose.position = {random.uniform(2, 5), random.uniform(-0.2, 1), random.uniform(2, 5)};
                SCOPED_TRACE(testing::Message() << "round " << round << ", type " << body.type());
                const double margin = random.chance(0.5) ? 0 : 0.1;
                if (random.chance(0.5))
                    merged += expect_chosen_of_pair(ground, Pose3d{}, body, pose, margin);
                else
                    merged += expect_chosen_of_pair(body, pose, ground, Pose3d{}, margin);
                if (HasFailure()) return;
            }
    }
    EXPECT_GT(merged, 3'000);
}

TEST(ContactsOfASurface, AreChosenAsDefinedInThePlane)
{
    Random random(2);
    int merged = 0;
    for (int round = 0; round < 1000; ++round) {
        std::vector<Vector<2>> points;
        std::vector<Mesh<2>::Element> segments;
        const double bumps[] = {0, 0.02, 0.3};
        for (std::uint32_t i = 0; i < 24; ++i) {
            points.push_back({0.25 * i, random.uniform(-0.25, 0.25) * bumps[round % 3]});
            if (i > 0) segments.push_back({i, i - 1});
        }
        const Mesh<2> chain(points, segments);
        const Zoo<2> zoo(random, 1, false);
        for (const Shape2& body : zoo.shapes) {
            Pose2d pose = random.pose2<double>(1);
            pose.position = {random.uniform(2, 4), random.uniform(-0.2, 0.8)};
            SCOPED_TRACE(testing::Message() << "round " << round << ", type " << body.type());
            merged +=
                expect_chosen_of_pair(Shape2(chain), Pose2d{}, body, pose, random.chance(0.5) ? 0 : 0.1);
            if (HasFailure()) return;
        }
    }
    EXPECT_GT(merged, 2'000);
}

/// The smallest: a box flat on two triangles, and one over many.
TEST(ContactsOfASurface, AreOneOfFourCornersUnderABox)
{
    const Terrain terrain(12, 12, 0);
    const Mesh<3> mesh(terrain.vertices, terrain.triangles);
    const HeightField field(HeightGrid<double>{terrain.heights, terrain.columns, terrain.rows, 1, 1});
    for (const Shape3& ground : {Shape3(mesh), Shape3(field)})
        for (const double half : {0.2, 1.0, 4.0}) {
            const Pose3d pose{{5.5, 0.99, 5.5}};
            const auto found = contacts(Shape3::box({half, 1, half}), pose, ground, Pose3d{});
            ASSERT_EQ(found.size(), 1u);
            ASSERT_EQ(found[0].count, 4u);
            EXPECT_NEAR(found[0].normal[1], -1, 1e-12);
            for (const auto& point : found[0].point) {
                EXPECT_NEAR(std::abs(point.from_a[0]), half, 1e-9);
                EXPECT_NEAR(std::abs(point.from_a[2]), half, 1e-9);
                EXPECT_NEAR(point.depth, 0.01, 1e-9);
            }
            EXPECT_GE(all_contacts(Shape3::box({half, 1, half}), pose, ground, Pose3d{}).size(), 2u);
        }
    // A capsule that lies across many triangles rests on its two ends.
    const double c = std::sqrt(0.5);
    const auto lying =
        contacts(Shape3::capsule(3, 0.5), Pose3d{{5.3, 0.49, 5.4}, {c, 0, 0, c}}, Shape3(mesh), Pose3d{});
    ASSERT_EQ(lying.size(), 1u);
    ASSERT_EQ(lying[0].count, 2u);
    EXPECT_NEAR(std::abs(lying[0].point[0].from_a[2] - lying[0].point[1].from_a[2]), 6, 1e-9);
}

/// A solver finds each corner again by its features, whichever corner and triangle is deepest in a frame.
TEST(ContactsOfASurface, KeepTheirFeaturesWhileABodyRocks)
{
    const Terrain terrain(12, 12, 0);
    const HeightField field(HeightGrid<double>{terrain.heights, terrain.columns, terrain.rows, 1, 1});
    Random random(3);
    std::set<std::uint32_t> features, deepest;
    for (int frame = 0; frame < 200; ++frame) {
        const double x = random.uniform(-1e-4, 1e-4), z = random.uniform(-1e-4, 1e-4);
        const Pose3d pose{{5.3 + 1e-3 * x, 0.99, 5.4}, {x, 0, z, 1}};
        const auto found = contacts(Shape3::box({1.4, 1, 1.2}), pose, Shape3(field), Pose3d{});
        ASSERT_EQ(found.size(), 1u);
        ASSERT_EQ(found[0].count, 4u);
        deepest.insert(found[0].part_b);
        for (const auto& point : found[0].point)
            features.insert(point.feature);
    }
    EXPECT_EQ(features.size(), 4u);
    EXPECT_GT(deepest.size(), 1u);
}

/// Walls, steps and ditches that are steeper than the angle keep contacts of their own.
TEST(ContactsOfASurface, AreOneForEachDirection)
{
    // A ditch along z, its sides at `slope` from level.
    const auto count = [](double slope) {
        const Mesh<3> ditch(std::vector<Vector<3>>{{-4, 4 * slope, -9},
                                                   {0, 0, -9},
                                                   {4, 4 * slope, -9},
                                                   {-4, 4 * slope, 9},
                                                   {0, 0, 9},
                                                   {4, 4 * slope, 9}},
                            std::vector<Mesh<3>::Element>{{0, 3, 1}, {1, 3, 4}, {1, 4, 2}, {2, 4, 5}});
        const double c = std::sqrt(0.5), up = std::sqrt(1 + slope * slope);
        return contacts(Shape3::capsule(2, 1), Pose3d{{0, up - 0.01, 0.5}, {c, 0, 0, c}}, Shape3(ditch),
                        Pose3d{})
            .size();
    };
    EXPECT_EQ(count(0.02), 1u);
    EXPECT_EQ(count(0.06), 2u);
    EXPECT_EQ(count(1), 2u);
}

} // namespace
