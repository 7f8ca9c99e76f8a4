// SPDX-License-Identifier: MIT
// One vector type fits every question, and other people's vector types convert to it.
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/jostle.hpp"

namespace game {
struct Float3 // members
{
    float x, y, z;
};
struct Double2
{
    double x, y;
};
struct Indexed // an operator[] and a size that is known when compiling, as Eigen has it
{
    enum
    {
        SizeAtCompileTime = 3
    };
    float values[3];
    float operator[](int i) const { return values[i]; }
};
struct WithLength // as glm has it
{
    double values[2];
    static constexpr int length() { return 2; }
    const double& operator[](int i) const { return values[i]; }
};
class Position // nothing that is known by itself
{
  public:
    explicit Position(float at) : at_(at) {}
    [[nodiscard]] float coordinate(int axis) const { return at_ + static_cast<float>(axis); }

  private:
    float at_;
};
} // namespace game

template <>
struct jostle::VectorTraits<game::Position>
{
    static constexpr int size = 3;
    static float get(const game::Position& p, int axis) { return p.coordinate(axis); }
};

namespace {

using jostle::Vec2d;
using jostle::Vec2f;
using jostle::Vec3d;
using jostle::Vec3f;

static_assert(std::is_trivially_copyable_v<jostle::Aabb3f> && sizeof(jostle::Aabb3f) == 24);
static_assert(std::is_trivially_default_constructible_v<Vec3f> && sizeof(Vec3d) == 24);

// What converts by itself, what wants to be written out, and what isn't a vector of that many axes.
static_assert(std::is_convertible_v<game::Float3, Vec3f> && std::is_convertible_v<game::Float3, Vec3d>);
static_assert(std::is_convertible_v<Vec3f, Vec3d> && !std::is_convertible_v<Vec3d, Vec3f>);
static_assert(std::is_constructible_v<Vec3f, Vec3d>);
static_assert(std::is_convertible_v<float[3], Vec3f> && std::is_convertible_v<std::array<float, 3>, Vec3f>);
static_assert(std::is_convertible_v<int[2], Vec2f> && std::is_convertible_v<std::array<double, 2>, Vec2d>);
static_assert(!std::is_constructible_v<Vec2f, game::Float3> &&
              !std::is_constructible_v<Vec3d, game::Double2>);
static_assert(!std::is_constructible_v<Vec3f, float*> && !std::is_constructible_v<Vec3f, std::vector<float>>);
static_assert(!std::is_constructible_v<Vec3f, float[4]> && !std::is_constructible_v<Vec3f, std::span<float>>);
static_assert(!std::is_constructible_v<Vec3f, float> && !std::is_constructible_v<Vec3f, std::string>);

TEST(Vec, TakesWhatHasCoordinates)
{
    const Vec3f expected{1, 2, 3};
    EXPECT_EQ(Vec3f(game::Float3{1, 2, 3}), expected);
    EXPECT_EQ(Vec3f(game::Indexed{{1, 2, 3}}), expected);
    EXPECT_EQ(Vec3f(game::Position(1)), expected);
    const double array[3] = {1, 2, 3};
    EXPECT_EQ(Vec3f(array), expected);
    EXPECT_EQ(Vec3d(expected), Vec3d(array));
    EXPECT_EQ(Vec2d(game::WithLength{{4, 5}}), (Vec2d{4, 5}));
    EXPECT_EQ(Vec2f(game::Double2{4, 5}), (Vec2f{4, 5}));
    EXPECT_EQ(Vec3f{}, (Vec3f{0, 0, 0}));
}

TEST(Vec, Arithmetic)
{
    const Vec3d a{1, 2, 3}, b{-4, 5, 6};
    EXPECT_EQ(a + b, (Vec3d{-3, 7, 9}));
    EXPECT_EQ(a - b, (Vec3d{5, -3, -3}));
    EXPECT_EQ(-a, (Vec3d{-1, -2, -3}));
    EXPECT_EQ(2.0 * a, (Vec3d{2, 4, 6}));
    EXPECT_EQ(a * 0.5, (Vec3d{0.5, 1, 1.5}));
    EXPECT_EQ(jostle::dot(a, b), 24);
    EXPECT_EQ(jostle::cross(a, b), (Vec3d{-3, -18, 13}));
    EXPECT_EQ(jostle::length(Vec2d{3, 4}), 5);
    EXPECT_LT((Vec2f{1, 9}), (Vec2f{2, 0}));
    double sum = 0;
    for (const double x : a)
        sum += x;
    EXPECT_EQ(sum, 6);
}

TEST(Vec, DividesAndMeasures)
{
    static_assert(Vec3d{2, 4, 6} / 2.0 == Vec3d{1, 2, 3});
    Vec2f halved{1, 3};
    halved /= 2;
    EXPECT_EQ(halved, (Vec2f{0.5f, 1.5f}));
    static_assert(jostle::length_squared(Vec3f{1, 2, 2}) == 9);
    static_assert(jostle::cross(Vec2d{1, 0}, Vec2d{0, 1}) == 1 &&
                  jostle::cross(Vec2d{2, 3}, Vec2d{5, 7}) == -1);
}

TEST(Vec, NormalizedHasLengthOneHoweverLongItWas)
{
    EXPECT_EQ(jostle::normalized(Vec2d{3, -4}), (Vec2d{0.6, -0.8}));
    for (const double size : {1e-320, 1e-200, 1e-30, 1.0, 1e200, 1e307}) {
        const Vec3d unit = jostle::normalized(Vec3d{2 * size, -3 * size, 6 * size});
        EXPECT_NEAR(unit[0], 2.0 / 7, size < 1e-310 ? 1e-3 : 1e-15) << size;
        EXPECT_NEAR(unit[1], -3.0 / 7, size < 1e-310 ? 1e-3 : 1e-15) << size;
        EXPECT_NEAR(jostle::length(unit), 1, 1e-15) << size;
    }
    EXPECT_EQ(jostle::normalized(Vec3f{}), Vec3f{});
    EXPECT_EQ(jostle::normalized(Vec2d{0, -0.0}), Vec2d{});
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                    infinity = std::numeric_limits<float>::infinity();
    for (const Vec2f& bad : {Vec2f{nan, 0}, Vec2f{0, nan}, Vec2f{1, nan}, Vec2f{infinity, 1}}) {
        const Vec2f unit = jostle::normalized(bad);
        EXPECT_TRUE(std::isnan(unit[0]) || std::isnan(unit[1])) << bad[0] << " " << bad[1];
    }
}

TEST(Vec, MinAndMaxGoAxisByAxis)
{
    constexpr Vec3d a{1, 5, -2}, b{3, 4, -2.5};
    static_assert(jostle::min(a, b) == Vec3d{1, 4, -2.5});
    static_assert(jostle::max(a, b) == Vec3d{3, 5, -2});
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const Vec2f some{nan, 1}, others{2, nan};
    EXPECT_TRUE(std::isnan(jostle::min(some, others)[0]) && std::isnan(jostle::max(some, others)[0]));
    EXPECT_EQ(jostle::min(some, others)[1], 1);
    EXPECT_EQ(jostle::max(some, others)[1], 1);
}

TEST(Vec, LerpEndsExactly)
{
    constexpr Vec2f a{0.1f, -7}, b{1e20f, 3};
    static_assert(jostle::lerp(a, b, 0) == a && jostle::lerp(a, b, 1) == b);
    static_assert(jostle::lerp(Vec2f{0, 2}, Vec2f{4, 4}, 0.25f) == Vec2f{1, 2.5f});
    static_assert(jostle::lerp(Vec2f{0, 2}, Vec2f{4, 4}, 2) == Vec2f{8, 6});
}

// A vector of the user's goes straight into every box, question and command.
TEST(Vec, FitsEverywhere)
{
    const game::Float3 low{0, 0, 0}, high{1, 1, 1}, eye{-5, 0.5f, 0.5f}, direction{1, 0, 0};
    const Vec3f corner{0, 0, 0}, other{1, 1, 1};
    const jostle::Aabb3f box{low, high};
    EXPECT_EQ(box.hi, other);

    jostle::World3f world;
    const jostle::ObjectId id = world.add({corner, other});
    world.update();
    const auto hit = world.first(jostle::Ray3f{eye, direction});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->at, 5);
    EXPECT_EQ(world.count(jostle::Sphere3f{eye, 5}), 1u);
    EXPECT_TRUE(world.any(jostle::Sweep3f{{eye, eye}, direction, 5}));
    std::vector<jostle::Hit<float, jostle::ObjectId>> near;
    world.nearest(jostle::Nearest3f{eye, 8}, near);
    ASSERT_EQ(near.size(), 1u);
    EXPECT_EQ(near[0].at, 25);
    const jostle::Plane3f planes[] = {{direction, 0}};
    EXPECT_EQ(world.count(jostle::Frustum3f{planes}), 1u);

    world.move(id, box, direction);
    world.resize(id, other * 2);
    world.update();
    EXPECT_EQ(world.count(jostle::Aabb3f{{2.25f, 0, 0}, {3, 1, 1}}), 1u) << "edges of 2, moved by 1";

    const jostle::Pose3f pose{eye, {}};
    EXPECT_EQ(pose.position, Vec3f(eye));
}

} // namespace
