// SPDX-License-Identifier: MIT
// Numbers that are accepted though their inverses are infinite or their squares are lost: the answers are
// those of the same numbers in another scale, or of a point; and every call returns.
#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>

#include "jostle/cast.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

template <class Case>
class TinyNumbers : public testing::Test
{
};
using Dims = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(TinyNumbers, Dims);

/// Small integers, not all 0, which are exact in each scale.
template <std::size_t N>
std::array<double, N> integers(Random& random)
{
    std::array<double, N> numbers{};
    while (numbers == std::array<double, N>{})
        for (double& x : numbers)
            x = std::floor(random.uniform(-7, 8));
    return numbers;
}
template <class Numbers>
Numbers scaled(Numbers numbers, int exponent)
{
    for (double& x : numbers)
        x = std::ldexp(x, exponent);
    return numbers;
}
constexpr int exponents[] = {-1074, -1073, -1030, -1022, -1001, -1000, -300, 0, 900};

template <int Dim>
struct Answers
{
    std::vector<double> numbers;
    void add(double x) { numbers.push_back(std::isnan(x) ? -12345 : x); }
    template <class Numbers>
    void add_all(const Numbers& list)
    {
        for (const double x : list)
            add(x);
    }
    Answers(const Shape<Dim>& a, const Pose<Dim, double>& pose_a, const Shape<Dim>& b,
            const Pose<Dim, double>& pose_b)
    {
        const auto between = distance(a, pose_a, b, pose_b, 5.0);
        add(between ? between->distance : -1e300);
        if (between) add_all(between->from_a), add_all(between->from_b), add_all(between->normal);
        add(touching(a, pose_a, b, pose_b) ? 1 : 0);
        for (const auto& contact : contacts(a, pose_a, b, pose_b, 0.1)) {
            add_all(contact.normal);
            for (std::uint32_t i = 0; i < contact.count; ++i)
                add_all(contact.point[i].from_a), add(contact.point[i].depth);
        }
        const Aabb<Dim, double> box = bounds(a, pose_a);
        add_all(box.lo), add_all(box.hi);
        Vec<Dim, double> way{};
        way[0] = 3, way[1] = -1;
        if (const auto hit = shape_cast(a, pose_a, way, b, pose_b)) add(hit->fraction), add_all(hit->point);
        if (const auto hit = ray_cast(b, pose_b, Ray<Dim, double>{pose_a.position, way, 2}))
            add(hit->fraction), add_all(hit->normal);
        Motion<Dim, double> moving{pose_a};
        moving.linear = way;
        if (const auto hit = time_of_impact(a, moving, b, Motion<Dim, double>{pose_b}, 1e-6)) add(hit->time);
    }
};

TYPED_TEST(TinyNumbers, RotationsAreThoseOfTheSameNumbersInAnotherScale)
{
    constexpr int Dim = TypeParam::value;
    Random random(11);
    for (int round = 0; round < 12; ++round) {
        const Zoo<Dim> zoo(random, 1);
        for (const Shape<Dim>& a : zoo.shapes)
            for (const Shape<Dim>& b : zoo.shapes) {
                Pose<Dim, double> pose_a = random_pose<Dim, double>(random, 1.5),
                                  pose_b = random_pose<Dim, double>(random, 1.5);
                const auto turn_a = integers < Dim == 3 ? 4 : 2 > (random),
                           turn_b = integers < Dim == 3 ? 4 : 2 > (random);
                pose_a.rotation = scaled(turn_a, 10), pose_b.rotation = scaled(turn_b, 10);
                const Answers<Dim> usual(a, pose_a, b, pose_b);
                pose_a.rotation = scaled(turn_a, exponents[random.below(6)]);
                pose_b.rotation = scaled(turn_b, exponents[random.below(6)]);
                ASSERT_EQ(Answers<Dim>(a, pose_a, b, pose_b).numbers, usual.numbers)
                    << round << " types " << a.type() << " and " << b.type();
            }
    }
}

TYPED_TEST(TinyNumbers, NormalsOfHalfSpacesAreThoseOfTheSameNumbersInAnotherScale)
{
    constexpr int Dim = TypeParam::value;
    Random random(12);
    for (int round = 0; round < 300; ++round) {
        const auto normal = integers<Dim>(random);
        const double offset = random.uniform(-1, 1);
        const Vec<Dim, double> usual = Shape<Dim>::half_space(normal, offset).size();
        for (const int exponent : exponents)
            ASSERT_EQ(Shape<Dim>::half_space(scaled(normal, exponent), offset).size(), usual) << exponent;
    }
    Vec<Dim, double> up{};
    up[1] = 1e-310;
    EXPECT_EQ(Shape<Dim>::half_space(up, 0).size()[1], 1);
}

/// A shape too small for its squares, so small that nobody can tell it from a point.
template <int Dim>
Shape<Dim> tiny(Random& random)
{
    const auto size = [&] {
        return random.chance(0.2) ? 0.0
                                  : std::ldexp(std::floor(random.uniform(1, 8)),
                                               -1074 + static_cast<int>(random.below(140)));
    };
    Vec<Dim, double> half;
    for (double& h : half)
        h = size();
    if constexpr (Dim == 3) {
        if (random.chance(0.15)) return Shape<3>::cylinder(size(), size());
        if (random.chance(0.15)) return Shape<3>::cone(size(), size());
    }
    switch (random.below(5)) {
    case 0:
        return Shape<Dim>::capsule(size(), size());
    case 1:
        return Shape<Dim>::box(half);
    case 2:
        return Shape<Dim>::rounded_box(half, size());
    default:
        return Shape<Dim>::ellipsoid(half);
    }
}

TYPED_TEST(TinyNumbers, ShapesAreMetAsPointsAre)
{
    constexpr int Dim = TypeParam::value;
    Random random(13);
    const Shape<Dim> point = Shape<Dim>::sphere(0);
    for (int round = 0; round < 40; ++round) {
        const Zoo<Dim> zoo(random, 1, false);
        for (const Shape<Dim>& b : zoo.shapes) {
            const Shape<Dim> a = tiny<Dim>(random);
            Pose<Dim, double> pose_a = random_pose<Dim, double>(random, 2);
            const Pose<Dim, double> pose_b = random_pose<Dim, double>(random, 2);
            if (random.chance(0.5)) pose_a.rotation = scaled(integers < Dim == 3 ? 4 : 2 > (random), -1074);
            const auto right = distance(point, pose_a, b, pose_b, 1e3),
                       got = distance(a, pose_a, b, pose_b, 1e3);
            ASSERT_EQ(right.has_value(), got.has_value());
            if (!right) continue; // beside a height field
            // How deep it is inside is found by another search, which needn't be exact.
            const double off = right->distance > 1e-6 ? 1e-8 : 2e-2;
            ASSERT_NEAR(got->distance, right->distance, off)
                << round << " types " << a.type() << ' ' << b.type();
            ASSERT_FALSE(right->distance > 1e-6 && touching(a, pose_a, b, pose_b));
            for (const double x : Answers<Dim>(a, pose_a, b, pose_b).numbers)
                ASSERT_TRUE(std::abs(x) < HUGE_VAL && x != -12345)
                    << round << " types " << a.type() << ' ' << b.type();
            // Two of them, also in one place.
            Pose<Dim, double> near = pose_a;
            near.position[0] += random.chance(0.5) ? 0 : 1e-310;
            for (const double x : Answers<Dim>(a, pose_a, tiny<Dim>(random), near).numbers)
                ASSERT_NE(x, -12345) << round << " type " << a.type();
        }
    }
}

TYPED_TEST(TinyNumbers, BoundsOfEllipsoidsHoldThem)
{
    constexpr int Dim = TypeParam::value;
    Random random(14);
    for (int round = 0; round < 3000; ++round) {
        const auto half = integers<Dim>(random);
        Vec<Dim, double> size;
        for (int d = 0; d < Dim; ++d)
            size[d] = std::abs(half[static_cast<std::size_t>(d)]);
        Pose<Dim, double> pose;
        pose.rotation = scaled(integers < Dim == 3 ? 4 : 2 > (random), -1070);
        const auto right = bounds(Shape<Dim>::ellipsoid(size), pose);
        const int exponent = -1074 + static_cast<int>(random.below(600));
        const auto box = bounds(Shape<Dim>::ellipsoid(scaled(size, exponent)), pose);
        const double off = std::ldexp(1e-14, exponent) + 5e-324;
        for (int d = 0; d < Dim; ++d) {
            ASSERT_NEAR(box.lo[d], std::ldexp(right.lo[d], exponent), off) << exponent;
            ASSERT_NEAR(box.hi[d], std::ldexp(right.hi[d], exponent), off) << exponent;
        }
    }
}

/// Its support points are no numbers, now and then.
template <int Dim>
class Broken : public CustomShape<Dim>
{
  public:
    [[nodiscard]] double radius() const noexcept override { return 1; }
    [[nodiscard]] bool has_support() const noexcept override { return true; }
    [[nodiscard]] Vec<Dim, double> support(const Vec<Dim, double>& d) const noexcept override
    {
        Vec<Dim, double> p = d;
        if (++calls_ % period == 0) p[0] = NAN;
        return p;
    }
    unsigned period = 1;

  private:
    mutable unsigned calls_ = 0;
};

TYPED_TEST(TinyNumbers, NoSearchGoesOnForEverWhereAUsersShapeGivesNoNumbers)
{
    constexpr int Dim = TypeParam::value;
    Random random(15);
    Broken<Dim> broken;
    const Shape<Dim> own(broken, ShapeTypes::first_custom);
    for (int round = 0; round < 60; ++round) {
        broken.period = 1 + random.below(20);
        const Zoo<Dim> zoo(random, 1);
        for (const Shape<Dim>& b : zoo.shapes)
            EXPECT_FALSE(
                Answers<Dim>(own, random_pose<Dim, double>(random, 1), b, random_pose<Dim, double>(random, 1))
                    .numbers.empty());
    }
}

} // namespace
