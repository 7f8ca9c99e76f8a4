// SPDX-License-Identifier: MIT
// Compounds of few and of many children: the answers are those of the children one by one, and a question
// about one place doesn't ask all of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "jostle/cast.hpp"
#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

template <class Case>
class CompoundOfMany : public testing::Test
{
};
using Dims = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(CompoundOfMany, Dims);

template <int Dim>
struct Children
{
    using Child = typename Compound<Dim>::Child;
    std::vector<std::unique_ptr<ConvexHull<Dim>>> hulls;
    std::vector<Child> list;

    /// On a grid they are cubes and balls, and many are as far from something as others.
    Children(Random& random, std::uint32_t count, double spread, bool on_a_grid, bool endless)
    {
        for (std::uint32_t i = 0; i < count; ++i)
            list.push_back(on_a_grid ? on_grid(random, spread) : anywhere(random, spread));
        Vec<Dim, double> up{};
        up[1] = 1;
        if (endless) list[random.below(count)] = {Shape<Dim>::half_space(up, -spread), {}};
    }

  private:
    static Child on_grid(Random& random, double spread)
    {
        Child child;
        for (double& x : child.pose.position)
            x = std::round(random.uniform(-spread, spread));
        Vec<Dim, double> half;
        for (double& h : half)
            h = 0.5;
        child.shape = random.chance(0.5) ? Shape<Dim>::box(half) : Shape<Dim>::sphere(0.5);
        return child;
    }
    Child anywhere(Random& random, double spread)
    {
        Child child;
        child.pose = random_pose<Dim, double>(random, spread);
        Vec<Dim, double> half;
        for (double& h : half)
            h = random.uniform(0.02, 0.3);
        switch (random.below(6)) {
        case 0:
            child.shape = Shape<Dim>::sphere(half[0]);
            break;
        case 1:
            child.shape = Shape<Dim>::capsule(half[0], half[1]);
            break;
        case 2:
            child.shape = Shape<Dim>::ellipsoid(half);
            break;
        case 3: { // as convex decompositions are: corners in the axes of the whole
            std::vector<Vec<Dim, double>> corners(8);
            for (auto& corner : corners)
                for (std::size_t d = 0; d < Dim; ++d)
                    corner[d] = child.pose.position[d] + random.uniform(-0.3, 0.3);
            hulls.push_back(std::make_unique<ConvexHull<Dim>>(corners));
            child = {Shape<Dim>(*hulls.back()), {}};
            break;
        }
        default:
            child.shape = Shape<Dim>::box(half);
        }
        return child;
    }
};

/// A compound in its own axes against another shape, and each child against it.
template <int Dim>
void expect_answers_of_children(const std::vector<typename Compound<Dim>::Child>& children,
                                const Shape<Dim>& other, const Pose<Dim, double>& pose,
                                const Vec<Dim, double>& way, bool exact)
{
    const Compound<Dim> compound(children);
    const Shape<Dim> whole(compound);
    const Pose<Dim, double> here;
    const double margin = 0.1;
    double nearest = HUGE_VAL, soonest = HUGE_VAL, first = HUGE_VAL;
    std::uint32_t first_child = 0, soonest_child = 0;
    std::vector<std::uint32_t> surely, perhaps;
    for (std::uint32_t i = 0; i < children.size(); ++i) {
        const auto& [shape, at] = children[i];
        if (const auto gap = distance(shape, at, other, pose, HUGE_VAL)) {
            nearest = std::min(nearest, gap->distance);
            if (gap->distance < margin + 1e-7) perhaps.push_back(i);
            if (gap->distance < margin - 1e-7) surely.push_back(i);
        }
        const auto hit = ray_cast(shape, at, Ray<Dim, double>{pose.position, way, 1});
        if (hit && hit->fraction < first) first = hit->fraction, first_child = i;
        if (other.type() == ShapeTypes::half_space) continue;
        const auto touch = shape_cast(other, pose, way, shape, at);
        if (touch && touch->fraction < soonest) soonest = touch->fraction, soonest_child = i;
    }
    const auto gap = distance(whole, here, other, pose, HUGE_VAL);
    ASSERT_EQ(gap.has_value(), nearest < HUGE_VAL);
    if (gap) {
        ASSERT_NEAR(gap->distance, nearest, 1e-7);
        if (std::abs(nearest) > 1e-7) {
            ASSERT_EQ(touching(whole, here, other, pose), nearest < 0);
            const auto within = distance(whole, here, other, pose, std::max(0.0, nearest * 1.001));
            ASSERT_TRUE(within);
            ASSERT_EQ(within->distance, gap->distance);
            ASSERT_EQ(within->normal, gap->normal);
            if (nearest > 0) {
                ASSERT_FALSE(distance(whole, here, other, pose, nearest * 0.999));
            }
        }
    }
    std::vector<std::uint32_t> met;
    for (const auto& contact : contacts(whole, here, other, pose, margin))
        met.push_back(contact.part_a);
    ASSERT_TRUE(std::is_sorted(met.begin(), met.end()));
    ASSERT_TRUE(std::includes(met.begin(), met.end(), surely.begin(), surely.end()));
    ASSERT_TRUE(std::includes(perhaps.begin(), perhaps.end(), met.begin(), met.end()));
    const auto hit = ray_cast(whole, here, Ray<Dim, double>{pose.position, way, 1});
    ASSERT_EQ(hit.has_value(), first < HUGE_VAL);
    if (hit) {
        ASSERT_NEAR(hit->fraction, first, 1e-8);
    }
    if (hit && exact) {
        ASSERT_EQ(hit->part, first_child);
    }
    if (other.type() == ShapeTypes::half_space) return;
    const auto touch = shape_cast(other, pose, way, whole, here);
    if (touch) {
        ASSERT_NEAR(touch->fraction, soonest, 1e-6);
    }
    if (touch && exact) {
        ASSERT_EQ(touch->part, soonest_child);
    }
}

TYPED_TEST(CompoundOfMany, AnswersAsItsChildren)
{
    constexpr int Dim = TypeParam::value;
    Random random(31);
    const std::uint32_t counts[] = {1, 2, 3, 4, 5, 8, 9, 31, 64, 65, 200};
    for (int round = 0; round < 220; ++round) {
        const bool on_a_grid = random.chance(0.4);
        const std::uint32_t count = counts[random.below(11)];
        const double spread = 0.5 * std::pow(count, 1.0 / Dim) + 0.5;
        const Children<Dim> children(random, count, spread, on_a_grid, random.chance(0.2));
        const Zoo<Dim> zoo(random, 1, false);
        const Shape<Dim>& other =
            zoo.any(random, {ShapeTypes::sphere, ShapeTypes::capsule, ShapeTypes::box, ShapeTypes::convex,
                             ShapeTypes::ellipsoid, ShapeTypes::rounded_box, ShapeTypes::half_space});
        Vec<Dim, double> way, half;
        for (double& x : way)
            x = random.uniform(-2 * spread, 2 * spread);
        Pose<Dim, double> pose = random_pose<Dim, double>(random, 1.5 * spread);
        if (on_a_grid) {
            pose = {};
            way = {};
            way[random.below(Dim)] = random.chance(0.5) ? 8 : -8;
            for (double& x : pose.position)
                x = std::round(random.uniform(-3 * spread, 3 * spread)) / 2;
            for (double& h : half)
                h = 0.25;
        }
        SCOPED_TRACE(testing::Message() << round << ": " << count << " children, type " << other.type());
        expect_answers_of_children<Dim>(children.list, on_a_grid ? Shape<Dim>::box(half) : other, pose, way,
                                        on_a_grid);
        if (testing::Test::HasFatalFailure()) return;
    }
}

// More than a search notes: then all children are looked at.
TYPED_TEST(CompoundOfMany, AnswersWhereThousandsAreInReach)
{
    constexpr int Dim = TypeParam::value;
    Random random(32);
    for (const std::uint32_t count : {1023u, 1024u, 1025u, 1500u}) {
        const Children<Dim> children(random, count, 1, false, false);
        const Compound<Dim> compound(children.list);
        const auto found = contacts(Shape<Dim>(compound), Pose<Dim, double>{}, Shape<Dim>::sphere(9),
                                    Pose<Dim, double>{}, 0.0);
        ASSERT_EQ(found.size(), count);
        for (std::uint32_t i = 0; i < count; ++i)
            ASSERT_EQ(found[i].part_a, i);
    }
}

/// Of children that are equally near the first counts: its normal, whichever the search meets first.
TYPED_TEST(CompoundOfMany, IsNearestInItsFirstChildOfEqualOnes)
{
    constexpr int Dim = TypeParam::value;
    Random random(33);
    for (int round = 0; round < 100; ++round) {
        std::vector<typename Compound<Dim>::Child> children(2 + random.below(60));
        for (auto& [shape, pose] : children) {
            shape = Shape<Dim>::sphere(0.5);
            pose.position[random.below(Dim)] = random.chance(0.5) ? 4 : -4;
        }
        const Compound<Dim> compound(children);
        for (const bool first : {true, false}) {
            const Shape<Dim> one(compound), other = Shape<Dim>::sphere(0.25);
            const Pose<Dim, double> here;
            const auto gap = distance(first ? one : other, here, first ? other : one, here, HUGE_VAL);
            for (std::size_t d = 0; d < Dim; ++d)
                ASSERT_EQ(4 * gap->normal[d] * (first ? -1 : 1), children[0].pose.position[d]) << round;
        }
    }
}

template <int Dim>
class CountingBall : public CustomShape<Dim>
{
  public:
    explicit CountingBall(int& asked) : asked_(asked) {}
    [[nodiscard]] double radius() const noexcept override { return 0.3; }
    [[nodiscard]] Vec<Dim, double> support(const Vec<Dim, double>& direction) const noexcept override
    {
        ++asked_;
        double square = 0;
        for (const double x : direction)
            square += x * x;
        Vec<Dim, double> p = direction;
        for (double& x : p)
            x *= 0.3 / std::sqrt(square);
        return p;
    }

  private:
    int& asked_;
};

TYPED_TEST(CompoundOfMany, AsksFewOfThem)
{
    constexpr int Dim = TypeParam::value;
    Random random(34);
    int asked = 0;
    const CountingBall<Dim> ball(asked);
    std::vector<typename Compound<Dim>::Child> children(20'000);
    const double spread = 0.5 * std::pow(20'000, 1.0 / Dim);
    for (auto& [shape, pose] : children) {
        shape = Shape<Dim>(ball, ShapeTypes::first_custom);
        for (double& x : pose.position)
            x = random.uniform(-spread, spread);
    }
    const Compound<Dim> compound(children);
    const Shape<Dim> whole(compound), probe = Shape<Dim>::sphere(0.2);
    EXPECT_EQ(asked, 0);
    for (int round = 0; round < 10; ++round) {
        Pose<Dim, double> pose;
        for (double& x : pose.position)
            x = random.uniform(-spread, spread);
        (void)touching(whole, Pose<Dim, double>{}, probe, pose);
        (void)contacts(whole, Pose<Dim, double>{}, probe, pose, 0.1);
        (void)distance(whole, Pose<Dim, double>{}, probe, pose, HUGE_VAL);
        Vec<Dim, double> way{};
        way[0] = 1;
        (void)ray_cast(whole, Pose<Dim, double>{}, Ray<Dim, double>{pose.position, way, 1000});
        (void)shape_cast(probe, pose, way, whole, Pose<Dim, double>{});
    }
    EXPECT_LT(asked, 10 * 5000);
}

} // namespace
