// SPDX-License-Identifier: MIT
// What a ray, a sweep, a distance and a region mean, by hand; and which questions are refused.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/world.hpp"
#include "tests/contract/error_of.hpp"

namespace {

using namespace jostle;
using contract::refusal;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
constexpr Aabb3f cube{{1, 1, 1}, {3, 3, 3}};

TEST(Definition, RayEntersAtTheNearestFace)
{
    EXPECT_EQ(hit_fraction(Ray<3, float>{{-1, 2, 2}, {1, 0, 0}}, cube), 2.0f);
    EXPECT_EQ(hit_fraction(Ray<3, float>{{-1, 2, 2}, {4, 0, 0}}, cube), 0.5f);
    EXPECT_EQ(hit_fraction(Ray<3, float>{{5, 2, 2}, {-1, 0, 0}}, cube), 2.0f);
    EXPECT_EQ(hit_fraction(Ray<3, float>{{0, 0, 0}, {1, 1, 1}}, cube), 1.0f);
    EXPECT_FALSE(hit_fraction(Ray<3, float>{{-1, 2, 2}, {-1, 0, 0}}, cube)); // behind it
    EXPECT_FALSE(hit_fraction(Ray<3, float>{{-1, 2, 2}, {1, 0, 0}, 1.5f}, cube));
    EXPECT_EQ(hit_fraction(Ray<3, float>{{-1, 2, 2}, {1, 0, 0}, 2.0f}, cube), 2.0f); // just reaches it
}

TEST(Definition, RayFromInsideOrAlongAFaceTouches)
{
    EXPECT_EQ(hit_fraction(Ray<3, float>{{2, 2, 2}, {0, 1, 0}}, cube), 0.0f);
    EXPECT_EQ(hit_fraction(Ray<3, float>{{2, 2, 2}, {0, 1, 0}, 0.0f}, cube), 0.0f);
    EXPECT_EQ(hit_fraction(Ray<3, float>{{-1, 3, 2}, {1, 0, 0}}, cube), 2.0f); // in the face y = 3
    EXPECT_EQ(hit_fraction(Ray<3, float>{{-1, 3, 3}, {1, 0, 0}}, cube), 2.0f); // along an edge
    EXPECT_FALSE(hit_fraction(Ray<3, float>{{-1, std::nextafter(3.0f, 4.0f), 2}, {1, 0, 0}}, cube));
    EXPECT_EQ(hit_fraction(Ray<3, float>{{3, 2, 2}, {1, 0, 0}}, cube), 0.0f); // leaves at once
}

TEST(Definition, InfiniteAndFlatBoxesAreHit)
{
    const Aabb3f wall{{4, -infinity, -infinity}, {4, infinity, infinity}};
    EXPECT_EQ(hit_fraction(Ray<3, float>{{0, 7, 7}, {2, 1, 0}}, wall), 2.0f);
    const Aabb3f all{{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
    EXPECT_EQ(hit_fraction(Ray<3, float>{{0, 7, 7}, {2, 1, 0}}, all), 0.0f);
    // A component whose reciprocal is no number counts as none.
    const float tiny = std::numeric_limits<float>::denorm_min();
    EXPECT_EQ(hit_fraction(Ray<3, float>{{-1, 1, 1}, {1, tiny, -tiny}}, cube), 2.0f);
}

TEST(Definition, SweepTouchesWhereTheBoxesFirstMeet)
{
    const Aabb3f box{{-2, 0, 0}, {-1, 1, 1}};
    EXPECT_EQ(hit_fraction(Sweep<3, float>{box, {4, 0, 0}}, cube), 0.5f);
    EXPECT_FALSE(hit_fraction(Sweep<3, float>{box, {1, 0, 0}}, cube));
    EXPECT_FALSE(hit_fraction(Sweep<3, float>{box, {4, -1, 0}}, cube)); // slides off the touching edge
    EXPECT_EQ(hit_fraction(Sweep<3, float>{{{0, 0, 0}, {1, 1, 1}}, {-1, -1, -1}}, cube), 0.0f);
}

TEST(Definition, Regions)
{
    const Aabb3f at_origin{{-1, -1, -1}, {0, 0, 0}};
    EXPECT_EQ(squared_distance({3.0f, 4.0f, -0.5f}, at_origin), 25.0f);
    EXPECT_EQ(squared_distance({-0.5f, 0.0f, -1.0f}, at_origin), 0.0f);
    EXPECT_TRUE(overlaps(Sphere<3, float>{{3, 4, 0}, 5}, at_origin));
    EXPECT_FALSE(overlaps(Sphere<3, float>{{3, 4, 0}, 4.99f}, at_origin));
    const std::array<Plane<3, float>, 2> slab{{{{1, 0, 0}, -3}, {{-1, 0, 0}, 5}}}; // 3 <= x <= 5
    const Frustum<3, float> frustum{slab};
    EXPECT_TRUE(overlaps(frustum, cube)); // touches x = 3
    EXPECT_FALSE(overlaps(frustum, at_origin));
    EXPECT_TRUE(overlaps(Frustum<3, float>{}, at_origin));
    const Aabb3f endless{{0, -infinity, -infinity}, {4, infinity, infinity}};
    EXPECT_TRUE(overlaps(frustum, endless));
}

TEST(Refusals, NameTheValueAndTheQuestion)
{
    BoxIndex<3, float> index;
    const std::vector<Aabb3f> boxes{cube};
    index.build(boxes);
    std::vector<Hit<float>> hits;
    std::vector<std::uint32_t> ids;
    const auto bad = ErrorCode::invalid_argument;
    EXPECT_EQ(refusal(ErrorCode::nan_coordinate,
                      [&] { index.all(Ray<3, float>{{0, nan_value, 0}, {1, 0, 0}}, hits); }),
              "ray: origin.y is nan; it must be a finite number");
    EXPECT_EQ(refusal(bad, [&] { (void)index.first(Ray<3, float>{{0, 0, 0}, {0, 0, 0}}); }),
              "ray: direction is zero on every axis; for a point ask for the overlaps of a box");
    EXPECT_EQ(
        refusal(bad, [&] { (void)index.first(Ray<3, float>{{0, 0, 0}, {1e-40f, -1e-39f, 0}}); }),
        "ray: direction is too short: its longest component is 1.00000022e-39, and 1 divided by that is "
        "not finite; scale it up");
    EXPECT_EQ(refusal(bad, [&] { (void)index.count(Sweep<3, float>{cube, {0, 0, 1e-39f}, infinity}); }),
              "sweep: motion is too short: its longest component is 1.00000022e-39, and 1 divided by that "
              "is not finite; scale it up");
    EXPECT_EQ(index.count(Ray<3, float>{{2, 2, 0}, {0, 0, 3e-39f}}), 1u);
    EXPECT_EQ(refusal(bad, [&] { (void)index.any(Ray<3, float>{{0, 0, 0}, {0, 1, 0}, -2}); }),
              "ray: max_fraction is -2; it must be 0 or more");
    const std::vector<Ray<3, float>> rays{{{0, 0, 0}, {1, 0, 0}}, {{0, 0, infinity}, {1, 0, 0}}};
    std::vector<Hit<float>> firsts(2);
    EXPECT_EQ(
        refusal(bad,
                [&] { index.first(std::span<const Ray<3, float>>(rays), std::span<Hit<float>>(firsts)); }),
        "ray 1: origin.z is inf; it must be a finite number");
    EXPECT_EQ(refusal(ErrorCode::inverted_box, [&] { index.all(Aabb3f{{0, 2, 0}, {1, 1.5f, 1}}, ids); }),
              "region: lo.y = 2 is greater than hi.y = 1.5; swap them or drop the query");
    EXPECT_EQ(
        refusal(ErrorCode::nan_coordinate, [&] { index.all(Aabb3f{{0, 2, 0}, {1, 3, nan_value}}, ids); }),
        "region: hi.z is NaN; it must be a number");
    EXPECT_EQ(refusal(bad, [&] { index.all(Sphere<3, float>{{0, 0, 0}, -1}, ids); }),
              "sphere: radius is -1; it must be 0 or more");
    EXPECT_EQ(refusal(bad, [&] { index.all(Sphere<3, float>{{0, 0, 0}, 2e19f}, ids); }),
              "sphere: radius is 2e+19, which can't be squared in this type; give infinity or less than "
              "1.8e19");
    EXPECT_EQ(
        refusal(bad, [&] { index.all(Sphere<3, float>{{0, 0, 0}, 1e-25f}, ids); }),
        "sphere: radius is 1.00000002e-25, which can't be squared in this type; give 0 or more than 1.1e-19");
    EXPECT_EQ(
        refusal(bad, [&] { (void)BoxIndex2d().count(Sphere<2, double>{{0, 0}, 1e200}); }),
        "sphere: radius is 9.9999999999999997e+199, which can't be squared in this type; give infinity or "
        "less than 1.3e154");
    EXPECT_EQ(refusal(bad, [&] { (void)index.first(Sweep<3, float>{cube, {0, 0, 0}}); }),
              "sweep: motion is zero on every axis; ask for the overlaps of the box");
    const Plane<3, float> no_plane{{0, 0, 0}, 1};
    EXPECT_EQ(refusal(bad, [&] { index.all(Frustum<3, float>{{&no_plane, 1}}, ids); }),
              "frustum: normal of a plane is zero on every axis; drop the plane");
    EXPECT_EQ(refusal(ErrorCode::nan_coordinate,
                      [&] { index.nearest(Nearest<3, float>{{0, 0, 0}, 1, nan_value}, hits); }),
              "nearest: max_distance is nan; it must be 0 or more");
    EXPECT_EQ(refusal(bad, [&] { index.nearest(Nearest<3, float>{{0, 0, 0}, 1, 2e19f}, hits); }),
              "nearest: max_distance is 2e+19, which can't be squared in this type; give infinity or less "
              "than 1.8e19");
    const std::vector<std::uint32_t> none;
    QueryFilter filter;
    const std::uint32_t masks[1] = {1};
    filter.mask = std::span<const std::uint32_t>(masks);
    EXPECT_EQ(refusal(ErrorCode::size_mismatch, [&] { (void)index.first(rays[0], filter); }),
              "query filter: mask is given without category; give both or neither");
    index.insert(std::vector<std::uint32_t>{5}, boxes);
    filter.category = filter.mask;
    EXPECT_EQ(refusal(ErrorCode::size_mismatch, [&] { (void)index.first(rays[0], filter); }),
              "query filter: category has 1 entries, but the index has held ids up to 5; give one for every "
              "id, or none");
}

TEST(Definition, SpheresOfTheLeastAndTheGreatestRadius)
{
    const std::vector<Aabb2f> boxes{
        {{1e-24f, 0}, {1e-24f, 0}}, {{2e-19f, 0}, {2e-19f, 0}}, {{1e30f, 0}, {1e30f, 0}}};
    BoxIndex2f index;
    index.build(boxes);
    EXPECT_EQ(index.count(Sphere<2, float>{{0, 0}, 1.1e-19f}), 1u);
    EXPECT_EQ(index.count(Sphere<2, float>{{0, 0}, 1.8e19f}), 2u);
    EXPECT_EQ(index.count(Sphere<2, float>{{0, 0}, infinity}), 3u);
}

TEST(Refusals, OfObjectsLeaveTheIndexAsItWas)
{
    BoxIndex<3, float> index;
    const std::vector<Aabb3f> two{cube, cube};
    index.build(two);
    using Ids = std::vector<std::uint32_t>;
    const auto bad = ErrorCode::invalid_argument;
    EXPECT_EQ(refusal(bad, [&] { index.insert(Ids{7, 1}, two); }),
              "entry 1: id 1 is in the index already; move it or erase it");
    EXPECT_EQ(refusal(bad, [&] { index.insert(Ids{7, 7}, two); }), "entry 1: id 7 comes twice in one call");
    EXPECT_EQ(refusal(bad, [&] { index.insert(Ids{7, ~0u}, two); }),
              "entry 1: 4294967295 is no id; choose a smaller one");
    EXPECT_EQ(refusal(ErrorCode::size_mismatch, [&] { index.insert(Ids{7}, two); }),
              "1 ids for 2 boxes; give one for each");
    EXPECT_EQ(refusal(bad, [&] { index.erase(Ids{0, 9}); }), "entry 1: id 9 is not in the index");
    EXPECT_EQ(refusal(bad, [&] { index.erase(Ids{0, 0}); }), "entry 1: id 0 comes twice in one call");
    EXPECT_EQ(refusal(bad, [&] { (void)index.box(3); }), "id 3 is not in the index");
    const std::vector<Aabb3f> broken{cube, {{0, 0, 0}, {1, -1, 1}}};
    EXPECT_EQ(refusal(ErrorCode::inverted_box, [&] { index.move(Ids{1, 0}, broken); }),
              "box 1 (id 0): lo.y = 0 is greater than hi.y = -1; swap them or drop the box");
    EXPECT_EQ(refusal(ErrorCode::inverted_box, [&] { index.build(broken); }),
              "box 1: lo.y = 0 is greater than hi.y = -1; swap them or drop the box");
    EXPECT_EQ(index.size(), 2u);
    EXPECT_FALSE(index.contains(7));
    EXPECT_EQ(index.box(1).hi[1], 3.0f);
    EXPECT_EQ(index.count(cube), 2u);
}

TEST(Objects, MayComeGoAndMoveOneByOne)
{
    BoxIndex3f index;
    index.insert(0, cube);
    index.insert(7, cube);
    EXPECT_EQ(index.size(), 2u);
    const Aabb3f there{{9, 9, 9}, {10, 10, 10}};
    index.move(7, there);
    EXPECT_EQ(index.box(7).lo, there.lo);
    EXPECT_EQ(index.box(0).lo, cube.lo);
    EXPECT_EQ(index.count(there), 1u);
    index.erase(0);
    EXPECT_TRUE(index.contains(7) && !index.contains(0));
    EXPECT_EQ(refusal(ErrorCode::invalid_argument, [&] { index.erase(0); }),
              "entry 0: id 0 is not in the index");
    EXPECT_EQ(refusal(ErrorCode::inverted_box, [&] { index.move(7, Aabb3f{{0, 0, 0}, {1, -1, 1}}); }),
              "box 0 (id 7): lo.y = 0 is greater than hi.y = -1; swap them or drop the box");
}

/// Questions in a vector, an array and a span that may change have the answers of a span of constant ones.
template <class Asked, class HitType, class Id>
void ask_in_any_range(const Asked& asked)
{
    std::array<Ray3f, 2> rays{Ray3f{{-1, 2, 2}, {1, 0, 0}}, Ray3f{{9, 9, 9}, {0, 1, 0}}};
    const std::span<const Ray3f> constant(rays);
    std::vector<HitType> expected(2), firsts(2);
    ResultLists<HitType> lists;
    ResultLists<Id> ids;
    bool any[2] = {};
    std::vector<std::uint64_t> counts(2);
    asked.first(constant, std::span<HitType>(expected));
    EXPECT_EQ(expected[0].at, 2.0f);
    const auto ask = [&](const auto& given) {
        firsts.assign(2, {});
        asked.first(given, firsts);
        EXPECT_TRUE(firsts[0].id == expected[0].id && firsts[0].at == expected[0].at);
        EXPECT_TRUE(firsts[1].id == expected[1].id);
        asked.all(given, lists);
        EXPECT_TRUE(lists[0].size() == 1 && lists[1].empty());
        asked.any(given, any);
        EXPECT_TRUE(any[0] && !any[1]);
        asked.count(given, counts, {});
        EXPECT_EQ(counts, (std::vector<std::uint64_t>{1, 0}));
    };
    ask(constant);
    ask(rays);
    ask(std::vector<Ray3f>(rays.begin(), rays.end()));
    ask(std::span(rays));
    ask(std::span<Ray3f>(rays));
    const Nearest3f near[] = {{{9, 9, 9}, 1}, {{9, 9, 9}, 1, 0.5f}};
    asked.nearest(near, lists, {});
    EXPECT_TRUE(lists.size() == 2 && lists[0].size() == 1 && lists[1].empty());
    asked.nearest(std::span<const Nearest3f>(near).first(1), lists, {.accept = {}});
    EXPECT_TRUE(lists.size() == 1 && lists[0].size() == 1);
    const std::vector<Aabb3f> regions{{{0, 0, 0}, {1, 1, 1}}, {{5, 5, 5}, {6, 6, 6}}, cube};
    asked.all(regions, ids, {}, 5);
    EXPECT_TRUE(ids.size() == 3 && ids[0].size() == 1 && ids[1].empty() && ids[2].size() == 1);
    std::array<bool, 3> touched{};
    asked.any(regions, touched);
    EXPECT_EQ(touched, (std::array<bool, 3>{true, false, true}));
    std::vector<std::uint8_t> bytes(3, 7);
    asked.any(regions, bytes);
    EXPECT_EQ(bytes, (std::vector<std::uint8_t>{1, 0, 1}));
    bytes.assign(4, 7);
    asked.any(std::span<const Aabb3f>(regions), std::span(bytes).first(3));
    EXPECT_EQ(bytes, (std::vector<std::uint8_t>{1, 0, 1, 7}));
}

TEST(Definition, QuestionsMayLieInAnyContiguousRange)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>{cube});
    ask_in_any_range<BoxIndex3f, Hit<float>, std::uint32_t>(index);
    std::vector<Hit<float>> firsts(1);
    index.first(std::vector<Ray3f>{{{-1, 2, 2}, {1, 0, 0}}}, firsts,
                std::vector<QueryFilter>{{.exclude = 0}});
    EXPECT_EQ(firsts[0].id, Hit<float>::none);
    index.first(std::vector<Ray3f>{{{-1, 2, 2}, {1, 0, 0}}}, firsts, {.exclude = 1});
    EXPECT_EQ(firsts[0].id, 0u);
    World3f world;
    const ObjectId id = world.add(cube);
    world.update();
    ask_in_any_range<World3f, Hit<float, ObjectId>, ObjectId>(world);
    std::vector<Hit<float, ObjectId>> hits(1);
    world.first(std::vector<Ray3f>{{{-1, 2, 2}, {1, 0, 0}}}, hits, {.exclude = id});
    EXPECT_EQ(hits[0].id, ObjectId{});
}

} // namespace
