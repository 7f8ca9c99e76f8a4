// SPDX-License-Identifier: MIT
// What holds for every combination of shapes: answers mirror each other, don't depend on threads or on where
// the pair is, have no NaN, and agree with each other.
#include <gtest/gtest.h>

#include <cstdlib>

#include "narrow/shapes/shape_data.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

template <int Dim, class T>
void expect_mirrored(const Contact<Dim, T>& x, const Contact<Dim, T>& y)
{
    ASSERT_EQ(x.part_a, y.part_b);
    ASSERT_EQ(x.part_b, y.part_a);
    ASSERT_EQ(x.count, y.count);
    for (std::size_t d = 0; d < Dim; ++d)
        ASSERT_EQ(x.normal[d], -y.normal[d]);
    for (std::uint32_t i = 0; i < x.count; ++i) {
        ASSERT_EQ(x.point[i].from_a, y.point[i].from_b);
        ASSERT_EQ(x.point[i].from_b, y.point[i].from_a);
        ASSERT_EQ(x.point[i].depth, y.point[i].depth);
        ASSERT_EQ(x.point[i].feature, y.point[i].feature >> 16 | y.point[i].feature << 16);
    }
}

template <int Dim, class T>
void expect_numbers(const Contact<Dim, T>& c, T margin)
{
    T size = 0;
    for (const T x : c.normal)
        size += x * x;
    ASSERT_NEAR(size, 1, 1e-5);
    ASSERT_GE(c.count, 1u);
    ASSERT_LE(c.count, (Contact<Dim, T>::max_points));
    for (std::uint32_t i = 0; i < c.count; ++i) {
        for (std::size_t d = 0; d < Dim; ++d) {
            ASSERT_TRUE(std::isfinite(c.point[i].from_a[d]));
            ASSERT_TRUE(std::isfinite(c.point[i].from_b[d]));
        }
        ASSERT_TRUE(c.point[i].depth >= -margin);
    }
}

template <class Case>
class EveryCombination : public testing::Test
{
};
template <int D, class Number>
struct Case
{
    static constexpr int dim = D;
    using T = Number;
};
using Cases = testing::Types<Case<2, float>, Case<2, double>, Case<3, float>, Case<3, double>>;
TYPED_TEST_SUITE(EveryCombination, Cases);

TYPED_TEST(EveryCombination, MirrorsBitForBitWhenAAndBAreSwapped)
{
    constexpr int Dim = TypeParam::dim;
    using T = typename TypeParam::T;
    Random random(1);
    int found = 0;
    for (int round = 0; round < 6; ++round) {
        const Zoo<Dim> zoo(random, 1);
        for (const Shape<Dim>& a : zoo.shapes)
            for (const Shape<Dim>& b : zoo.shapes)
                for (int k = 0; k < 4; ++k) {
                    const Pose<Dim, T> pose_a = random_pose<Dim, T>(random, 1),
                                       pose_b = random_pose<Dim, T>(random, 1);
                    if (&a == &b && pose_a.position == pose_b.position)
                        continue; // each is the other's mirror
                    const T margin = k % 2 == 0 ? T(0) : T(0.25);
                    auto forth = contacts(a, pose_a, b, pose_b, margin);
                    auto back = contacts(b, pose_b, a, pose_a, margin);
                    SCOPED_TRACE(testing::Message() << "types " << a.type() << " and " << b.type());
                    ASSERT_EQ(forth.size(), back.size());
                    std::sort(back.begin(), back.end(), [](const auto& x, const auto& y) {
                        return x.part_b != y.part_b ? x.part_b < y.part_b : x.part_a < y.part_a;
                    });
                    for (std::size_t i = 0; i < forth.size(); ++i) {
                        expect_mirrored(forth[i], back[i]);
                        expect_numbers(forth[i], margin);
                        if (testing::Test::HasFatalFailure()) return;
                    }
                    found += static_cast<int>(forth.size());

                    const auto d1 = distance(a, pose_a, b, pose_b, T(10)),
                               d2 = distance(b, pose_b, a, pose_a, T(10));
                    ASSERT_EQ(d1.has_value(), d2.has_value());
                    if (!d1) continue;
                    ASSERT_EQ(d1->distance, d2->distance);
                    ASSERT_EQ(d1->from_a, d2->from_b);
                    ASSERT_EQ(d1->from_b, d2->from_a);
                    ASSERT_EQ(touching(a, pose_a, b, pose_b), touching(b, pose_b, a, pose_a));
                }
    }
    EXPECT_GT(found, 200);
}

/// Half-spaces and other shapes whose coordinates are often 0, or -0, as is their distance.
TYPED_TEST(EveryCombination, MirrorsTheSignOfADistanceOfZero)
{
    constexpr int Dim = TypeParam::dim;
    using T = typename TypeParam::T;
    Random random(2);
    const auto coarse = [&] {
        return random.chance(0.4) ? 0.0 : random.chance(0.2) ? -0.0 : std::round(random.uniform(-4, 4)) / 2;
    };
    const auto point = [&] {
        Vec<Dim, double> p;
        for (double& x : p)
            x = coarse();
        return p;
    };
    int zeros = 0;
    for (int round = 0; round < 4000; ++round) {
        Vec<Dim, double> half = point(), normal = point();
        for (double& h : half)
            h = std::abs(h);
        if (normal == Vec<Dim, double>{}) normal[1] = 1;
        const double radius = random.chance(0.5) ? 0 : std::abs(coarse());
        const ConvexHull<Dim> hull(std::vector<Vec<Dim, double>>{point(), point(), point()});
        std::vector<Shape<Dim>> shapes{Shape<Dim>::sphere(radius),
                                       Shape<Dim>::capsule(half[0], radius),
                                       Shape<Dim>::box(half),
                                       Shape<Dim>(hull),
                                       Shape<Dim>::rounded_box(half, radius),
                                       Shape<Dim>::rounded_hull(hull, radius),
                                       Shape<Dim>::ellipsoid(half)};
        if constexpr (Dim == 3) {
            shapes.push_back(Shape<3>::cylinder(half[0], half[1]));
            shapes.push_back(Shape<3>::cone(half[0], half[1]));
        }
        const Shape<Dim> ground = Shape<Dim>::half_space(normal, coarse());
        Pose<Dim, T> pose_a, pose_b;
        for (Pose<Dim, T>* pose : {&pose_a, &pose_b}) {
            for (T& x : pose->position)
                x = static_cast<T>(coarse());
            if (random.chance(0.5)) continue;
            pose->rotation = {}; // by quarters and thirds, exactly
            while (pose->rotation == decltype(pose->rotation){})
                for (T& q : pose->rotation)
                    q = static_cast<T>(std::round(random.uniform(-1, 1)));
        }
        for (const Shape<Dim>& shape : shapes) {
            const auto forth = distance(ground, pose_a, shape, pose_b, T(10)),
                       back = distance(shape, pose_b, ground, pose_a, T(10));
            ASSERT_TRUE(forth && back);
            ASSERT_EQ(forth->distance, back->distance);
            ASSERT_EQ(std::signbit(forth->distance), std::signbit(back->distance))
                << round << " type " << shape.type();
            zeros += forth->distance == 0 ? 1 : 0;
        }
    }
    EXPECT_GT(zeros, 1000);
}

/// Points as far from the origin as each other but for the first, which is the furthest.
template <int Dim>
std::vector<Vec<Dim, double>> points_within_reach(Random& random)
{
    std::vector<Vec<Dim, double>> points(8);
    for (Vec<Dim, double>& point : points) {
        double size = 0;
        for (double& x : point) {
            x = random.uniform(-1, 1);
            size += x * x;
        }
        for (double& x : point)
            x *= 0.75 / std::sqrt(size);
    }
    points[0] = {};
    points[0][0] = 1;
    return points;
}

TYPED_TEST(EveryCombination, MirrorsShapesOfOneSizeInOnePose)
{
    constexpr int Dim = TypeParam::dim;
    using T = typename TypeParam::T;
    Random random(4);
    int found = 0;
    for (int round = 0; round < 60; ++round) {
        // Two of each kind, which nothing tells apart but what they consist of.
        const ConvexHull<Dim> hulls[] = {ConvexHull<Dim>(points_within_reach<Dim>(random)),
                                         ConvexHull<Dim>(points_within_reach<Dim>(random))};
        std::vector<typename Mesh<Dim>::Element> elements(2);
        for (std::uint32_t i = 0; i < Dim; ++i)
            elements[0][i] = i, elements[1][i] = i + 1;
        const auto vertices = points_within_reach<Dim>(random), others = points_within_reach<Dim>(random);
        const Mesh<Dim> mesh(vertices, elements);
        if (round % 2 == 0) std::swap(elements[0][0], elements[1][Dim - 1]);
        const Mesh<Dim> other_mesh(round % 2 == 0 ? vertices : others, elements);
        std::vector<Compound<Dim>> compounds;
        for (int k = 0; k < 2; ++k) {
            typename Compound<Dim>::Child children[] = {
                {Shape<Dim>::capsule(0.25, 0.125), random_pose<Dim, double>(random, 0.25)},
                {Shape<Dim>::sphere(0.125), {}}};
            children[1].pose.position[0] = 2;
            compounds.emplace_back(children);
        }
        std::vector<std::pair<Shape<Dim>, Shape<Dim>>> pairs = {
            {hulls[0], hulls[1]},
            {Shape<Dim>::rounded_hull(hulls[0], 0.125), Shape<Dim>::rounded_hull(hulls[1], 0.125)},
            {mesh, other_mesh},
            {compounds[0], compounds[1]}};
        std::vector<HeightField> fields;
        if constexpr (Dim == 3)
            for (int k = 0; k < 2; ++k) {
                std::vector<double> heights(16);
                for (std::size_t i = 5; i < 11; ++i)
                    heights[i] = i == 6 ? 0.5 : random.uniform(0, 0.25);
                fields.emplace_back(HeightGrid<double>{heights, 4, 4, 1, 1});
            }
        if constexpr (Dim == 3) pairs.push_back({fields[0], fields[1]});
        Pose<Dim, T> pose = random_pose<Dim, T>(random, 1);
        for (const auto& [a, b] : pairs)
            for (int turn = 0; turn < 4; ++turn, pose = random_pose<Dim, T>(random, 1)) {
                SCOPED_TRACE(testing::Message() << "type " << a.type() << ", round " << round);
                const auto forth = contacts(a, pose, b, pose, T(0)), back = contacts(b, pose, a, pose, T(0));
                ASSERT_EQ(forth.size(), back.size());
                for (std::size_t i = 0; i < forth.size(); ++i)
                    for (const auto& other : back) {
                        if (other.part_a != forth[i].part_b || other.part_b != forth[i].part_a) continue;
                        expect_mirrored(forth[i], other);
                        if (testing::Test::HasFatalFailure()) return;
                        ++found;
                    }
                const auto d1 = distance(a, pose, b, pose, T(10)), d2 = distance(b, pose, a, pose, T(10));
                ASSERT_TRUE(d1 && d2);
                ASSERT_EQ(d1->distance, d2->distance);
                ASSERT_EQ(d1->from_a, d2->from_b);
                ASSERT_EQ(d1->from_b, d2->from_a);
            }
    }
    EXPECT_GT(found, 500);
}

// Further points on faces and edges, and whether all are floats, decide which triangles a face is made of.
TEST(HullsOfTheSameCorners, MirrorIfTheirFacesDiffer)
{
    Random random(6);
    int other_loops = 0, other_normals = 0;
    for (int round = 0; round < 4000; ++round) {
        std::vector<Vec3d> points(4 + random.below(16));
        for (Vec3d& point : points)
            for (double& x : point)
                x = random.chance(0.5) ? random.below(5) / 2.0
                                       : double{static_cast<float>(random.uniform(0, 2))};
        const ConvexHull3 hull(points);
        const auto corners = hull.vertices();
        std::vector<Vec3d> more(corners.begin(), corners.end());
        for (std::uint32_t k = random.below(6); k > 0; --k) {
            const auto any = [&] {
                return narrow::load(corners[random.below(static_cast<std::uint32_t>(corners.size()))]);
            };
            const narrow::Vec3 p = any() * 0.5 + any() * 0.25 + any() * 0.25;
            more.insert(more.begin() + random.below(static_cast<std::uint32_t>(more.size())),
                        {p.x, p.y, p.z});
        }
        std::vector<Vec3f> floats;
        for (const Vec3d& p : more)
            floats.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
        const ConvexHull3 other = random.chance(0.5) ? ConvexHull3(floats) : ConvexHull3(more);
        if (!std::equal(corners.begin(), corners.end(), other.vertices().begin(), other.vertices().end()))
            continue;
        const Shape3 a = hull, b = other;
        const auto &data_a = narrow::ShapeAccess::data<narrow::HullData<3>>(a),
                   &data_b = narrow::ShapeAccess::data<narrow::HullData<3>>(b);
        if (data_a.loop == data_b.loop && data_a.normals == data_b.normals)
            continue; // each is the other's mirror
        other_loops += data_a.normals == data_b.normals ? 1 : 0;
        other_normals += data_a.loop == data_b.loop ? 1 : 0;
        const Pose3d pose = random.pose<double>(1);
        const auto forth = contacts(a, pose, b, pose), back = contacts(b, pose, a, pose);
        ASSERT_EQ(forth.size(), 1u);
        ASSERT_EQ(back.size(), 1u);
        expect_mirrored(forth[0], back[0]);
        if (testing::Test::HasFatalFailure()) return;
    }
    EXPECT_GT(other_loops, 10);
    EXPECT_GT(other_normals, 10);
}

TYPED_TEST(EveryCombination, TouchingDistanceAndContactsAgree)
{
    constexpr int Dim = TypeParam::dim;
    using T = typename TypeParam::T;
    Random random(2);
    for (int round = 0; round < 6; ++round) {
        const Zoo<Dim> zoo(random, 1);
        for (const Shape<Dim>& a : zoo.shapes)
            for (const Shape<Dim>& b : zoo.shapes)
                for (int k = 0; k < 4; ++k) {
                    const Pose<Dim, T> pose_a = random_pose<Dim, T>(random, 1.5),
                                       pose_b = random_pose<Dim, T>(random, 1.5);
                    const auto d = distance(a, pose_a, b, pose_b, std::numeric_limits<T>::infinity());
                    const auto all = contacts(a, pose_a, b, pose_b, T(0));
                    if (!d) {
                        ASSERT_TRUE(all.empty());
                        continue;
                    }
                    SCOPED_TRACE(testing::Message() << "types " << a.type() << " and " << b.type());
                    if (std::abs(d->distance) < T(1e-5)) continue;
                    ASSERT_EQ(touching(a, pose_a, b, pose_b), d->distance <= 0);
                    // A surface that goes on has fewer contacts than triangles touched, but has some. Beside
                    // a height field's rim there may be none.
                    const bool surface =
                        (a.type() >= ShapeTypes::mesh && a.type() <= ShapeTypes::height_field) ||
                        (b.type() >= ShapeTypes::mesh && b.type() <= ShapeTypes::height_field);
                    if (a.type() != ShapeTypes::height_field && b.type() != ShapeTypes::height_field) {
                        ASSERT_EQ(!all.empty(), d->distance <= 0);
                    }
                    if (d->distance > 0) {
                        ASSERT_TRUE(all.empty());
                    }
                    if (all.empty() || surface) continue;
                    T deepest = -1;
                    for (const auto& contact : all)
                        deepest = std::max(deepest, contact.point[0].depth);
                    ASSERT_NEAR(deepest, -d->distance, 1e-5);
                    // Shapes that touch have boxes that overlap.
                    ASSERT_TRUE(overlaps(bounds(a, pose_a), bounds(b, pose_b)));
                }
    }
}

TYPED_TEST(EveryCombination, IsTheSameForAnyNumberOfThreads)
{
    constexpr int Dim = TypeParam::dim;
    using T = typename TypeParam::T;
    Random random(3);
    const Zoo<Dim> zoo(random, 4);
    std::vector<Shape<Dim>> shapes;
    std::vector<Pose<Dim, T>> poses;
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < 300; ++i) {
        shapes.push_back(zoo.any(random));
        poses.push_back(random_pose<Dim, T>(random, 3));
    }
    for (int i = 0; i < 3000; ++i) {
        const Pair pair{random.below(300), random.below(300)};
        if (pair.a != pair.b) pairs.push_back(pair);
    }
    std::vector<Contact<Dim, T>> expected;
    for (const Pair& pair : pairs)
        for (auto contact : contacts(shapes[pair.a], poses[pair.a], shapes[pair.b], poses[pair.b], T(0.1))) {
            contact.pair = pair;
            expected.push_back(contact);
        }
    ASSERT_GT(expected.size(), 300u);
    for (const InstructionSet set : supported_instruction_sets())
        for (const std::uint32_t threads : {1u, 2u, 7u}) {
            SCOPED_TRACE(testing::Message() << name(set) << ", threads " << threads);
            const auto executor = make_thread_executor(threads);
            ContactOptions options;
            options.executor = executor.get();
            options.instruction_set = set;
            ContactFinder<Dim, T> finder(options);
            for (int frame = 0; frame < 2; ++frame) {
                const auto& found = finder.find({shapes, poses}, std::span<const Pair>(pairs), T(0.1));
                ASSERT_EQ(found.size(), expected.size());
                std::size_t i = 0;
                for (const Contact<Dim, T>& contact : found) {
                    const Contact<Dim, T>& other = expected[i++];
                    ASSERT_EQ(contact.pair, other.pair);
                    ASSERT_EQ(contact.part_a, other.part_a);
                    ASSERT_EQ(contact.part_b, other.part_b);
                    ASSERT_EQ(contact.normal, other.normal);
                    ASSERT_EQ(contact.count, other.count);
                    for (std::uint32_t p = 0; p < contact.count; ++p) {
                        ASSERT_EQ(contact.point[p].from_a, other.point[p].from_a);
                        ASSERT_EQ(contact.point[p].from_b, other.point[p].from_b);
                        ASSERT_EQ(contact.point[p].depth, other.point[p].depth);
                        ASSERT_EQ(contact.point[p].feature, other.point[p].feature);
                    }
                }
            }
            std::vector<std::uint8_t> touch(pairs.size());
            finder.touching({StridedView<Shape<Dim>>(std::span<const Shape<Dim>>(shapes)),
                             StridedView<Pose<Dim, T>>(std::span<const Pose<Dim, T>>(poses))},
                            pairs, touch);
            for (std::size_t i = 0; i < pairs.size(); ++i)
                ASSERT_EQ(touch[i] == 1, touching(shapes[pairs[i].a], poses[pairs[i].a], shapes[pairs[i].b],
                                                  poses[pairs[i].b]));
        }
}

TYPED_TEST(EveryCombination, IsTheSameFarFromTheOrigin)
{
    constexpr int Dim = TypeParam::dim;
    using T = typename TypeParam::T;
    Random random(4);
    const Zoo<Dim> zoo(random, 2);
    const T far = sizeof(T) == 4 ? T(0x1p20) : T(0x1p40); // positions on a grid of 1/8 or 2^-12 stay exact
    const double grid = sizeof(T) == 4 ? 8 : 4096;
    for (int round = 0; round < 2000; ++round) {
        const Shape<Dim>& a = zoo.any(random);
        const Shape<Dim>& b = zoo.any(random);
        Pose<Dim, T> pose_a = random_pose<Dim, T>(random, 1), pose_b = random_pose<Dim, T>(random, 1);
        for (Pose<Dim, T>* pose : {&pose_a, &pose_b})
            for (T& x : pose->position)
                x = static_cast<T>(std::round(static_cast<double>(x) * grid) / grid);
        const auto here = contacts(a, pose_a, b, pose_b, T(0.1));
        for (Pose<Dim, T>* pose : {&pose_a, &pose_b})
            for (T& x : pose->position)
                x += far;
        const auto there = contacts(a, pose_a, b, pose_b, T(0.1));
        ASSERT_EQ(here.size(), there.size());
        for (std::size_t i = 0; i < here.size(); ++i) {
            ASSERT_EQ(here[i].normal, there[i].normal);
            ASSERT_EQ(here[i].count, there[i].count);
            for (std::uint32_t p = 0; p < here[i].count; ++p) {
                ASSERT_EQ(here[i].point[p].from_a, there[i].point[p].from_a);
                ASSERT_EQ(here[i].point[p].depth, there[i].point[p].depth);
            }
        }
    }
}

/// Sizes and places of all orders of magnitude. JOSTLE_LONG_TESTS=1 makes it 10 million pairs in all.
TYPED_TEST(EveryCombination, NeverGivesANaN)
{
    constexpr int Dim = TypeParam::dim;
    using T = typename TypeParam::T;
    const bool is_long = std::getenv("JOSTLE_LONG_TESTS") != nullptr;
    Random random(5);
    const int rounds = is_long ? 2'500'000 : 20'000;
    std::unique_ptr<Zoo<Dim>> zoo;
    for (int round = 0; round < rounds; ++round) {
        if (round % 1000 == 0) zoo = std::make_unique<Zoo<Dim>>(random, 1);
        const auto any = [&]() -> Shape<Dim> {
            const auto size = [&] { return std::pow(10.0, random.uniform(-30, 30)); };
            switch (random.below(6)) {
            case 0:
                return Shape<Dim>::sphere(size());
            case 1:
                return Shape<Dim>::capsule(size(), size());
            case 2: {
                Vec<Dim, double> half;
                for (double& h : half)
                    h = size();
                return Shape<Dim>::box(half);
            }
            default:
                return zoo->any(random);
            }
        };
        const Shape<Dim> a = any(), b = any();
        const double spread = random.chance(0.7) ? 1 : std::pow(10.0, random.uniform(-35, 35));
        const Pose<Dim, T> pose_a = random_pose<Dim, T>(random, spread),
                           pose_b = random_pose<Dim, T>(random, spread);
        SCOPED_TRACE(testing::Message() << "round " << round << " types " << a.type() << " and " << b.type());
        for (const auto& contact : contacts(a, pose_a, b, pose_b, T(0))) {
            expect_numbers(contact, T(0));
            if (testing::Test::HasFatalFailure()) return;
        }
        if (const auto d = distance(a, pose_a, b, pose_b, std::numeric_limits<T>::infinity())) {
            ASSERT_FALSE(std::isnan(d->distance));
            T size = 0;
            for (std::size_t k = 0; k < Dim; ++k) {
                ASSERT_TRUE(std::isfinite(d->from_a[k]) && std::isfinite(d->from_b[k]));
                size += d->normal[k] * d->normal[k];
            }
            ASSERT_NEAR(size, 1, 1e-5);
        }
    }
}

} // namespace
