// SPDX-License-Identifier: MIT
// One vector type fits every question, and other people's vector types convert to it.
#include <array>
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
    std::vector<jostle::Hit<float, ObjectId>> near;
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
