// SPDX-License-Identifier: MIT
// What each call of a World promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <vector>

#include "jostle/world.hpp"
#include "tests/contract/error_of.hpp"
#include "tests/world/events.hpp"
#include "tool/scenes/scenes.hpp"

namespace world_tests {
namespace {

using contract::error_of;
using jostle::EndedPair;
using jostle::EndReason;
using jostle::Error;
using jostle::ErrorCode;
using jostle::ObjectFilter;
using jostle::ObjectId;
using jostle::ObjectPair;
using jostle::Pair;
using jostle::World3d;
using jostle::World3f;

TEST(World, APairBeginsPersistsAndEnds)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(3));
    EXPECT_FALSE(world.contains(a)) << "not before the update";
    world.update();
    EXPECT_TRUE(world.contains(a) && world.contains(b));
    EXPECT_EQ(began(world), Began{});
    world.move(b, cube(1)); // touching counts
    world.update();
    EXPECT_EQ(began(world), (Began{{a, b}}));
    EXPECT_EQ(world.pairs().to_vector(), (std::vector<Pair>{{a.index, b.index}}));
    world.move(a, cube(0.5f));
    world.update();
    EXPECT_EQ(began(world), Began{});
    EXPECT_EQ(world.persisted().to_vector(), (std::vector<Pair>{{a.index, b.index}}));
    world.update();
    EXPECT_TRUE(world.persisted().empty()) << "neither changed";
    EXPECT_EQ(world.pairs().size(), 1u);
    world.move(b, cube(2));
    world.update();
    EXPECT_EQ(ended(world), (Ended{{a, b, EndReason::moved_apart}}));
    EXPECT_TRUE(world.pairs().empty());
}

TEST(World, EveryReasonForAnEnd)
{
    World3f world;
    std::vector<ObjectId> ids(5);
    world.add(std::vector<jostle::Aabb3f>(5, cube(0)), ids);
    world.update();
    EXPECT_EQ(world.began().size(), 10u);
    ObjectFilter nothing;
    nothing.mask = 0;
    world.move(ids[0], cube(9));
    world.remove(ids[1]);
    world.set_enabled(ids[2], false);
    world.set_filter(ids[3], nothing);
    world.update();
    EXPECT_EQ(ended(world), (Ended{{ids[0], ids[1], EndReason::removed},
                                   {ids[0], ids[2], EndReason::disabled},
                                   {ids[0], ids[3], EndReason::moved_apart},
                                   {ids[0], ids[4], EndReason::moved_apart},
                                   {ids[1], ids[2], EndReason::removed},
                                   {ids[1], ids[3], EndReason::removed},
                                   {ids[1], ids[4], EndReason::removed},
                                   {ids[2], ids[3], EndReason::disabled},
                                   {ids[2], ids[4], EndReason::disabled},
                                   {ids[3], ids[4], EndReason::filtered}}));
    world.set_enabled(ids[2], true);
    world.set_filter(ids[3], {});
    world.update();
    EXPECT_EQ(began(world), (Began{{ids[2], ids[3]}, {ids[2], ids[4]}, {ids[3], ids[4]}}));
}

TEST(World, AnIndexIsUsedAgainAnIdIsnt)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    world.remove(a);
    world.move(a, cube(5)); // legal until the removal is applied, and without effect
    world.remove(a);
    world.update();
    EXPECT_EQ(ended(world), (Ended{{a, b, EndReason::removed}}));
    EXPECT_FALSE(world.contains(a));
    const ObjectId c = world.add(cube(0));
    EXPECT_EQ(c.index, a.index);
    EXPECT_NE(c.generation, a.generation);
    world.update();
    EXPECT_EQ(world.began().size(), 1u);
    EXPECT_EQ(world.id(c.index), c);

    const Error stale = error_of([&] { world.move(a, cube(1)); });
    EXPECT_EQ(stale.code(), ErrorCode::stale_id);
    EXPECT_EQ(stale.index(), a.index);
    EXPECT_STREQ(stale.what(),
                 "object 0 (generation 1) is not in this world, where this index has generation 2: it was "
                 "removed, comes from another world, or was added after the snapshot that this one is of");
    world.remove(c);
    world.update();
    const ObjectId d = world.add(cube(0)); // pending, so that a fork hasn't got it
    World3f fork = world.fork();
    EXPECT_STREQ(error_of([&] { fork.move(d, cube(1)); }).what(),
                 "object 0 (generation 3) is not in this world: it was removed, comes from another world, or "
                 "was added after the snapshot that this one is of");
    EXPECT_EQ(error_of([&] { (void)world.box(ObjectId{}); }).code(), ErrorCode::stale_id);
    EXPECT_EQ(error_of([&] { world.remove(ObjectId{77, 1}); }).code(), ErrorCode::stale_id);
}

TEST(World, AddedAndRemovedBetweenUpdatesIsNothing)
{
    World3f world;
    const ObjectId a = world.add(cube(0));
    world.update();
    const ObjectId b = world.add(cube(0));
    world.remove(b);
    world.update();
    EXPECT_TRUE(began(world).empty() && ended(world).empty());
    EXPECT_EQ(world.size(), 1u);
    EXPECT_FALSE(world.contains(b));
    EXPECT_TRUE(world.contains(a));
}

TEST(World, UpdateWithMovesIsMoveAndUpdate)
{
    World3f world;
    std::vector<ObjectId> ids(3);
    world.add(std::vector<jostle::Aabb3f>{cube(0), cube(5), cube(10)}, ids);
    world.update();
    world.move(ids[0], cube(20)); // by the same thread before: overruled
    world.update(ids, std::vector<jostle::Aabb3f>{cube(1), cube(2), cube(3)});
    EXPECT_EQ(began(world), (Began{{ids[0], ids[1]}, {ids[1], ids[2]}}));
}

TEST(World, MovesInPlaceGiveTheSameInAnyOrderAndAllOrNothing)
{
    jostle_scenes::Scene<3, float> scene("uniform", 20'000, 1);
    World3f in_order;
    std::vector<ObjectId> ids(scene.boxes().size());
    in_order.add(scene.boxes(), ids);
    in_order.update();
    World3f backwards = in_order.fork();
    const std::vector<ObjectId> ids_back(ids.rbegin(), ids.rend());
    for (int step = 0; step < 3; ++step) {
        scene.step();
        const std::vector<jostle::Aabb3f> boxes(scene.boxes().begin(), scene.boxes().end()),
            boxes_back(boxes.rbegin(), boxes.rend());
        in_order.update(ids, boxes);
        backwards.update(ids_back, boxes_back);
        EXPECT_GT(in_order.persisted().size(), 10'000u);
        EXPECT_EQ(in_order.persisted().to_vector(), backwards.persisted().to_vector());
        EXPECT_EQ(began(in_order), began(backwards));
        EXPECT_EQ(ended(in_order), ended(backwards));
        ASSERT_EQ(in_order.save(), backwards.save());

        std::vector<jostle::Aabb3f> bad = boxes;
        for (auto& box : bad)
            box.hi[0] += 1;
        bad[17'000].lo[1] = std::numeric_limits<float>::quiet_NaN();
        EXPECT_EQ(error_of([&] { in_order.update(ids, bad); }).index(), 17'000u);
        EXPECT_EQ(in_order.save(), backwards.save());
        EXPECT_EQ(in_order.persisted().to_vector(), backwards.persisted().to_vector());
    }
    // Twice the same one: the last box counts.
    const std::vector<ObjectId> twice{ids[5], ids[6], ids[6]};
    const std::vector<jostle::Aabb3f> boxes{cube(1), cube(2), cube(3)};
    in_order.update(twice, boxes);
    EXPECT_EQ(in_order.box(ids[6]).lo[0], 3);
}

TEST(World, InFullMotionTheListsAreWhatTheSetsOfPairsDifferBy)
{
    jostle_scenes::Scene<3, float> scene("uniform", 20'000, 1);
    World3f world;
    std::vector<ObjectId> ids(scene.boxes().size());
    world.add(scene.boxes(), ids);
    world.update();
    jostle::PairFinder finder;
    const auto touching = [&] {
        return finder.find(scene.boxes(), jostle::Filter{}, jostle::Order::sorted).to_vector();
    };
    const auto pairs_of = [](const auto& events) {
        std::vector<Pair> pairs;
        for (const auto& event : events)
            pairs.push_back({event.a.index, event.b.index});
        return pairs;
    };
    std::vector<Pair> before = touching();
    for (int step = 0; step < 6; ++step) {
        for (int k = 0; k < (step == 3 ? 40 : 1); ++k) // once nearly all pairs are others
            scene.step();
        world.update(ids, scene.boxes());
        const std::vector<Pair> now = touching();
        std::vector<Pair> began, persisted, ended;
        std::set_difference(now.begin(), now.end(), before.begin(), before.end(), std::back_inserter(began));
        std::set_intersection(now.begin(), now.end(), before.begin(), before.end(),
                              std::back_inserter(persisted));
        std::set_difference(before.begin(), before.end(), now.begin(), now.end(), std::back_inserter(ended));
        ASSERT_FALSE(began.empty() || ended.empty() || persisted.empty());
        EXPECT_EQ(pairs_of(world.began()), began);
        EXPECT_EQ(world.persisted().to_vector(), persisted);
        EXPECT_EQ(pairs_of(world.ended()), ended);
        for (const EndedPair& pair : world.ended())
            ASSERT_EQ(pair, (EndedPair{ids[pair.a.index], ids[pair.b.index], EndReason::moved_apart}));
        before = now;
    }
}

TEST(World, StaticObjectsDontPairWithStaticOnes)
{
    World3f world;
    jostle::ObjectOptions<float> fixed;
    fixed.filter.is_static = true;
    const ObjectId a = world.add(cube(0), fixed), b = world.add(cube(0), fixed), c = world.add(cube(0));
    world.update();
    EXPECT_EQ(began(world), (Began{{a, c}, {b, c}}));
    EXPECT_EQ(world.stats().resting, 2u) << "at once";
    world.set_filter(b, {});
    world.update();
    EXPECT_EQ(began(world), (Began{{a, b}}));
}

TEST(World, OwnersAndMasks)
{
    World3f world;
    jostle::ObjectOptions<float> part, robot, wall;
    part.filter.owner = 7;
    robot.filter.category = 1;
    wall.filter.category = 2;
    wall.filter.mask = 1;
    const ObjectId a = world.add(cube(0), part), b = world.add(cube(0), part), c = world.add(cube(0), wall),
                   d = world.add(cube(0), wall);
    world.update();
    EXPECT_EQ(began(world), (Began{{a, c}, {a, d}, {b, c}, {b, d}}));
}

TEST(World, MarginsAndSweeps)
{
    jostle::WorldOptions options;
    options.margin = 0.5;
    World3f world(options);
    jostle::ObjectOptions<float> wide;
    wide.margin = 1;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(3), wide);
    world.update();
    EXPECT_EQ(began(world), (Began{{a, b}})) << "1 + 0.5 up to 3 - 1.5";
    EXPECT_EQ(world.box(b).lo[0], 3);
    EXPECT_EQ(world.bounds(b).lo[0], 1.5f);
    EXPECT_EQ(world.margin(b), 1.5f);
    world.set_margin(b, 0);
    world.update();
    EXPECT_EQ(world.ended().size(), 1u);
    const float by[3] = {-1, 0, 0};
    world.move(b, cube(3), by);
    world.update();
    EXPECT_EQ(began(world), (Began{{a, b}}));
    EXPECT_EQ(world.box(b).lo[0], 3);
    world.move(b, cube(3));
    world.update();
    EXPECT_EQ(world.ended().size(), 1u);
}

TEST(World, ResizeKeepsTheCentre)
{
    World3f world;
    const float infinite = std::numeric_limits<float>::infinity();
    const ObjectId a = world.add({{0, -infinite, 2}, {2, infinite, 4}});
    world.update();
    const float size[3] = {4, 1, 0};
    world.resize(a, size);
    world.update();
    const jostle::Aabb3f box = world.box(a);
    EXPECT_EQ(box.lo[0], -1);
    EXPECT_EQ(box.hi[0], 3);
    EXPECT_EQ(box.hi[1], infinite) << "has no centre";
    EXPECT_EQ(box.lo[2], 3);
    EXPECT_EQ(box.hi[2], 3);
}

TEST(World, ResizeLeavesInfiniteSidesAndKeepsTheCentreOfHugeOnes)
{
    constexpr float inf = std::numeric_limits<float>::infinity(), huge = 3e38f, size[3] = {2, 2, 2};
    World3f world;
    const ObjectId right = world.add({{5, 0, 0}, {inf, 1, 1}}), left = world.add({{-inf, 0, 0}, {5, 1, 1}}),
                   all = world.add({{-inf, 0, 0}, {inf, 1, 1}}),
                   wide = world.add({{-huge, 0, 0}, {huge, 1, 1}}),
                   far = world.add({{inf, 0, 0}, {inf, 1, 1}}), right_probe = world.add(cube(100)),
                   left_probe = world.add(cube(-100)), middle = world.add(cube(1.5f, 2));
    world.update();
    for (const ObjectId id : {right, left, all, wide, far})
        world.resize(id, size);
    world.update();
    const auto side = [&](ObjectId id, int axis) {
        return std::pair(world.box(id).lo[axis], world.box(id).hi[axis]);
    };
    EXPECT_EQ(side(right, 0), std::pair(5.0f, inf));
    EXPECT_EQ(side(left, 0), std::pair(-inf, 5.0f));
    EXPECT_EQ(side(all, 0), std::pair(-inf, inf));
    EXPECT_EQ(side(far, 0), std::pair(inf, inf));
    EXPECT_EQ(side(wide, 0), std::pair(-1.0f, 1.0f)) << "its length is no number, its centre is";
    for (const ObjectId id : {right, left, all, wide, far})
        EXPECT_EQ(side(id, 1), std::pair(-0.5f, 1.5f));
    for (const EndedPair& pair : ended(world)) // infinite sides still meet what they met
        EXPECT_TRUE(pair.a == wide || pair.b == wide);
    const auto paired = [&](ObjectId a, ObjectId b) {
        const std::vector<Pair> pairs = world.pairs().to_vector();
        return std::find(pairs.begin(), pairs.end(), Pair{a.index, b.index}) != pairs.end();
    };
    EXPECT_TRUE(paired(right, right_probe) && paired(left, left_probe) && paired(all, middle));
    EXPECT_FALSE(paired(wide, right_probe) || paired(wide, middle));
}

TEST(World, SequencesAndRemovalsOverruleTheOrder)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    world.move(a, cube(1), 2);
    world.move(a, cube(2), 1);
    world.move(b, cube(3));
    world.move(b, cube(4));
    world.update();
    EXPECT_EQ(world.box(a).lo[0], 1);
    EXPECT_EQ(world.box(b).lo[0], 4);
    world.remove(a);
    world.move(a, cube(3), 9);
    world.update();
    EXPECT_FALSE(world.contains(a));
}

TEST(World, ManyThatStopAtOnceComeToRestBitByBit)
{
    World3f world;
    std::vector<ObjectId> ids(20'000);
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 20'000; ++i)
        boxes.push_back(cube(static_cast<float>(2 * i)));
    world.add(boxes, ids);
    world.update();
    for (int step = 0; step < 5; ++step) {
        for (auto& box : boxes)
            box.lo[1] += 0.125f, box.hi[1] += 0.125f;
        world.update(ids, boxes);
        EXPECT_EQ(world.stats().active, 20'000u);
    }
    int updates = 0;
    for (; world.stats().active > 0 && updates < 1000; ++updates) {
        world.update();
        EXPECT_LE(world.stats().settled, 32u) << "no update pays for all";
    }
    EXPECT_EQ(world.stats().resting, 20'000u);
    EXPECT_LT(updates, 650);
}

TEST(World, Moves)
{
    World3d first;
    const ObjectId a = first.add({{0, 0, 0}, {1, 1, 1}});
    World3d second = std::move(first);
    second.update();
    EXPECT_TRUE(second.contains(a));
    first = World3d();
    first.update();
    EXPECT_EQ(first.size(), 0u);
}

TEST(World, TellsPairsAgainAsIfTheyWereNew)
{
    for (const bool asks : {false, true}) {
        bool takes = true;
        std::uint64_t asked = 0;
        jostle::WorldOptions options;
        if (asks)
            options.accept = [&](ObjectId, ObjectId) {
                ++asked;
                return takes;
            };
        jostle::World3f world(options);
        const ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}}), b = world.add({{1, 0, 0}, {2, 1, 1}}),
                       c = world.add({{2, 0, 0}, {3, 1, 1}});
        world.update();
        EXPECT_EQ(world.began().size(), 2u);
        for (int k = 0; k < 8; ++k)
            world.update();
        EXPECT_EQ(world.stats().resting, 3u);
        asked = 0;
        world.report_again(b);
        world.update();
        EXPECT_EQ(std::vector<ObjectPair>(world.began().begin(), world.began().end()),
                  (std::vector<ObjectPair>{{a, b}, {b, c}}));
        EXPECT_TRUE(world.ended().empty());
        EXPECT_TRUE(world.persisted().empty());
        EXPECT_EQ(asked, asks ? 2u : 0u);
        world.report_again(c, b);
        world.update();
        ASSERT_EQ(world.began().size(), 1u);
        EXPECT_EQ(world.began()[0], (ObjectPair{b, c}));
        world.report_again(a, c); // no pair of these
        world.update();
        EXPECT_TRUE(world.began().empty());
        world.report_again(a);
        world.move(a, {{-1, 0, 0}, {0, 1, 1}}); // apart from b
        world.update();
        EXPECT_TRUE(world.began().empty());
        ASSERT_EQ(world.ended().size(), 1u);
        if (!asks) continue;
        takes = false;
        world.report_again(b, c);
        world.update();
        ASSERT_EQ(world.ended().size(), 1u) << "accept is against it now";
        EXPECT_EQ(world.ended()[0].reason, EndReason::filtered);
        EXPECT_EQ(world.stats().refused, 1u);
        takes = true;
        world.report_again(b, c);
        world.update();
        EXPECT_EQ(world.began().size(), 1u);
        EXPECT_EQ(world.stats().refused, 0u);
        world.remove(c);
        EXPECT_THROW(world.report_again(ObjectId{}), jostle::Error);
        EXPECT_THROW(world.report_again(a, ObjectId{}), jostle::Error);
    }
}

TEST(World, IsAsNewOnceCleared)
{
    jostle::World2d world({.margin = 0.25}), fresh({.margin = 0.25});
    EXPECT_FALSE(world.bounds().has_value());
    const ObjectId first = world.add({{0, 0}, {1, 1}});
    (void)world.add({{1, 1}, {2, 2}});
    world.update();
    ASSERT_TRUE(world.bounds().has_value());
    EXPECT_EQ(world.bounds()->hi[1], 2.25);
    (void)world.add({{5, 5}, {6, 6}}); // still queued
    world.clear();
    EXPECT_EQ(world.size(), 0u);
    EXPECT_TRUE(world.began().empty());
    EXPECT_FALSE(world.bounds().has_value());
    EXPECT_EQ(world.stats().commands, 0u);
    EXPECT_EQ(world.save(), fresh.save());
    EXPECT_EQ(world.add({{0, 0}, {1, 1}}), first) << "ids from the first one on";
    world.update();
    EXPECT_EQ(world.size(), 1u);
    world.pairs([&](ObjectId, ObjectId) { return true; });
    EXPECT_FALSE(world.any(jostle::Aabb2d{{5, 5}, {6, 6}}));
    (void)world.add({{0, 0}, {1, 1}});
    world.update();
    EXPECT_THROW(world.pairs([&](ObjectId, ObjectId) {
        world.clear();
        return true;
    }),
                 jostle::Error);
    EXPECT_EQ(world.size(), 2u);
}

} // namespace
} // namespace world_tests
