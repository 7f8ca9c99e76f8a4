// SPDX-License-Identifier: MIT
// What each call of a World promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>

#include "jostle/world.hpp"
#include "scenes/scenes.hpp"
#include "tests/contract/counting_memory.hpp"

namespace world_tests {
namespace {

using jostle::EndedPair;
using jostle::EndReason;
using jostle::Error;
using jostle::ErrorCode;
using jostle::ObjectFilter;
using jostle::ObjectId;
using jostle::ObjectPair;
using jostle::Pair;
using jostle::World2f;
using jostle::World3d;
using jostle::World3f;

jostle::Aabb3f cube(float at, float edge = 1)
{
    return {{at, 0, 0}, {at + edge, edge, edge}};
}
using Began = std::vector<ObjectPair>;
using Ended = std::vector<EndedPair>;
Began began(const World3f& world)
{
    return {world.began().begin(), world.began().end()};
}
Ended ended(const World3f& world)
{
    return {world.ended().begin(), world.ended().end()};
}

/// The error that `call` throws.
template <class Call>
Error error_of(const Call& call)
{
    try {
        call();
    } catch (const Error& error) {
        return error;
    }
    return {ErrorCode{}, "no error"};
}

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

TEST(World, BadBoxesAreRefusedByName)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    jostle::Aabb3f nan = cube(0), inverted = cube(0);
    nan.hi[1] = std::nanf("");
    inverted.lo[2] = 2;
    EXPECT_STREQ(error_of([&] { world.move(b, nan); }).what(),
                 "box of object 1: hi.y is NaN; every bound must be a number (infinite is allowed)");
    EXPECT_STREQ(error_of([&] { world.teleport(b, inverted); }).what(),
                 "box of object 1: lo.z = 2 is greater than hi.z = 1; swap them or drop the box");
    EXPECT_EQ(error_of([&] { (void)world.add(nan); }).code(), ErrorCode::nan_coordinate);
    const std::vector<ObjectId> ids = {a, b};
    const std::vector<jostle::Aabb3f> boxes = {cube(5), nan};
    EXPECT_EQ(error_of([&] { world.move(ids, boxes); }).index(), b.index);
    EXPECT_EQ(error_of([&] { world.update(ids, boxes); }).index(), b.index);
    EXPECT_EQ(error_of([&] { world.update(ids, std::vector<jostle::Aabb3f>(1)); }).code(),
              ErrorCode::size_mismatch);
    world.update();
    EXPECT_EQ(world.box(a).lo[0], 0) << "a batch with a bad box does nothing";
    EXPECT_EQ(world.stats().commands, 0u);
    const float nowhere[3] = {0, std::nanf(""), 0}, negative[3] = {1, -1, 1};
    const Error displaced = error_of([&] { world.move(b, cube(0), nowhere); });
    EXPECT_EQ(displaced.code(), ErrorCode::nan_coordinate);
    EXPECT_STREQ(displaced.what(),
                 "displacement of object 1: displacement[1] = nan doesn't take 0 to a number");
    EXPECT_STREQ(error_of([&] { world.resize(a, negative); }).what(),
                 "size of object 0: size[1] = -1 is not a number >= 0");
    EXPECT_EQ(error_of([&] { world.set_margin(a, -1); }).code(), ErrorCode::invalid_argument);
    EXPECT_EQ(error_of([&] { world.set_margin(a, HUGE_VALF); }).code(), ErrorCode::invalid_argument);
    jostle::WorldOptions huge;
    huge.margin = 1e300;
    EXPECT_STREQ(error_of([&] { (void)World3f(huge); }).what(),
                 "margin 1e+300 of the world; give a number from 0 to 3.40282e+38");
    EXPECT_EQ(error_of([&] { (void)World3d(huge); }).code(), ErrorCode{}) << "doubles hold it";
}

TEST(World, AFailedUpdateInPlaceChangesNothingAndKeepsWhatWasQueued)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(9));
    world.update();
    world.move(a, cube(8.5f));
    jostle::Aabb3f nan = cube(0);
    nan.lo[0] = std::nanf("");
    const std::vector<ObjectId> ids = {b};
    EXPECT_THROW(world.update(ids, std::vector<jostle::Aabb3f>{nan}), Error);
    EXPECT_EQ(world.box(a).lo[0], 0);
    world.update();
    EXPECT_EQ(world.box(a).lo[0], 8.5f);
    EXPECT_EQ(began(world), (Began{{a, b}}));
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

TEST(World, TheCallbackDecidesOnce)
{
    int asked = 0;
    bool answer = false;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        ++asked;
        return answer;
    };
    World3f world(options);
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    EXPECT_EQ(asked, 1);
    EXPECT_TRUE(began(world).empty());
    EXPECT_EQ(world.stats().refused, 1u);
    world.move(a, cube(0.25f));
    world.update();
    EXPECT_EQ(asked, 1);
    EXPECT_TRUE(world.persisted().empty());
    answer = true;
    world.set_filter(a, world.filter(a));
    world.update();
    EXPECT_EQ(asked, 2);
    EXPECT_EQ(began(world), (Began{{a, b}}));
    answer = false;
    world.set_filter(b, world.filter(b));
    world.update();
    EXPECT_EQ(ended(world), (Ended{{a, b, EndReason::filtered}}));
    world.move(b, cube(5));
    world.update();
    EXPECT_TRUE(ended(world).empty());
    EXPECT_EQ(world.stats().refused, 0u);
}

TEST(World, ACallbackThatThrowsLeavesTheWorldAsItWas)
{
    bool angry = true;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        if (angry) throw std::runtime_error("no");
        return true;
    };
    World3f world(options);
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    EXPECT_THROW(world.update(), std::runtime_error);
    EXPECT_EQ(world.size(), 0u);
    angry = false;
    world.update();
    EXPECT_EQ(began(world), (Began{{a, b}})) << "what was queued is not lost";
}

TEST(World, NoUpdateOrRestoreInsideTheCallback)
{
    World3f* inside = nullptr;
    std::vector<Error> errors;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        const std::vector<std::byte> snapshot = inside->save();
        errors.push_back(error_of([&] { inside->update(); }));
        errors.push_back(error_of([&] { inside->restore(snapshot); }));
        return true;
    };
    World3f world(options);
    inside = &world;
    world.add(cube(0));
    world.add(cube(0.5f));
    world.update();
    ASSERT_EQ(errors.size(), 2u);
    for (const Error& error : errors) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
        EXPECT_NE(std::string(error.what()).find("this World is in the middle of another call"),
                  std::string::npos);
    }
    EXPECT_EQ(world.began().size(), 1u);
    world.restore(world.save());
    world.update();
    EXPECT_EQ(world.pairs().size(), 1u) << "after the call it can be used as before";
}

TEST(World, NoUpdateOrRestoreInsideAQuestionOrADrawing)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0.5f));
    world.update();
    const std::vector<std::byte> snapshot = world.save();
    std::vector<Error> errors;
    ObjectId fresh;
    const auto misuse = [&] {
        errors.push_back(error_of([&] { world.update(); }));
        errors.push_back(
            error_of([&] { world.update(std::span(&a, 1), std::span<const jostle::Aabb3f>()); }));
        errors.push_back(error_of([&] { world.restore(snapshot); }));
        if (fresh == ObjectId{}) fresh = world.add(cube(9)); // commands are welcome
        EXPECT_EQ(world.count(cube(0)), 2u) << "and so are questions";
        return false;
    };
    auto accept = [&](std::uint32_t, ObjectId) { return misuse(); };
    jostle::ObjectQueryFilter filter;
    filter.accept = accept;
    const jostle::Ray3f ray{{-1, 0.5f, 0.5f}, {1, 0, 0}};
    std::vector<ObjectId> ids;
    std::vector<jostle::ObjectHit<float>> hits;
    jostle::ResultLists<ObjectId> lists;
    const std::vector<jostle::Aabb3f> boxes(3, cube(0));
    (void)world.first(ray, filter);
    (void)world.any(cube(0), filter);
    (void)world.count(cube(0), filter);
    world.all(cube(0), ids, filter);
    world.nearest({{0, 0, 0}, 1}, hits, filter);
    world.all(std::span(boxes), lists, filter);
    EXPECT_EQ(errors.size(), 8u * 2 * 3) << "8 questions, 2 objects, 3 errors each time";
    const std::size_t drawn_from = errors.size();
    world.draw([&](const jostle::Aabb3f&, jostle::DrawKind) { misuse(); },
               [&](const jostle::Vec3f&, const jostle::Vec3f&, jostle::DrawKind) { misuse(); });
    EXPECT_EQ(errors.size(), drawn_from + 3 * 3) << "two boxes and a line";
    for (const Error& error : errors) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
        EXPECT_NE(std::string(error.what()).find("in the middle of a question or of draw()"),
                  std::string::npos);
    }
    auto throwing = [](std::uint32_t, ObjectId) -> bool { throw std::runtime_error("no"); };
    filter.accept = throwing;
    EXPECT_THROW((void)world.any(cube(0), filter), std::runtime_error);
    world.move(b, cube(0.25f));
    world.update(); // after the question it can be used as before
    EXPECT_EQ(world.size(), 3u);
    EXPECT_EQ(world.persisted().to_vector(), (std::vector<Pair>{{a.index, b.index}}));
}

TEST(World, QuestionsInsideTheCallbackAreAboutTheLastUpdate)
{
    World3f* me = nullptr;
    bool angry = true;
    std::vector<std::uint64_t> counts;
    const auto count = [&](float at) { counts.push_back(me->count(cube(at))); };
    jostle::WorldOptions options;
    options.accept = [&](ObjectId a, ObjectId b) {
        count(0);
        count(5);
        EXPECT_EQ(me->bounds(a).lo[0], 5) << "what can be read of objects is new";
        EXPECT_EQ(me->bounds(b).lo[0], 5);
        if (angry) throw std::runtime_error("no");
        return true;
    };
    World3f world(options);
    me = &world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(5)), c = world.add(cube(10));
    for (const bool rests : {true, false}) {
        for (int k = 0; k < 8; ++k)
            world.update();
        for (const float at : {0.25f, 0.0f}) {
            if (!rests) world.move(a, cube(at));
            world.move(c, cube(10 + at)); // somebody is always active
            world.update();
        }
        EXPECT_EQ(world.stats().resting, rests ? 2u : 1u);
        for (const bool asked_before : {false, true}) {
            angry = true;
            counts.clear();
            world.move(a, cube(5));
            if (asked_before) count(0);
            EXPECT_THROW(world.update(), std::runtime_error);
            count(0); // and after it has failed
            count(5);
            world.move(a, cube(0));
            world.update();
            for (const std::uint64_t each : counts)
                EXPECT_EQ(each, 1u) << "rests " << rests << ", asked before " << asked_before;
        }
    }
    angry = false;
    counts.clear();
    world.move(a, cube(5));
    world.update();
    count(0);
    count(5);
    EXPECT_EQ(counts, (std::vector<std::uint64_t>{1, 1, 0, 2}));
    EXPECT_EQ(began(world), (Began{{a, b}}));
}

TEST(World, CommandsInsideTheCallbackAreForTheNextUpdate)
{
    World3f* me = nullptr;
    jostle::WorldOptions options;
    ObjectId fresh;
    options.accept = [&](ObjectId a, ObjectId b) {
        EXPECT_TRUE(me->contains(a));
        if (fresh == ObjectId{}) {
            me->remove(b);
            fresh = me->add(cube(0));
        }
        return true;
    };
    World3f world(options);
    me = &world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    EXPECT_EQ(began(world), (Began{{a, b}}));
    world.update();
    EXPECT_EQ(ended(world), (Ended{{a, b, EndReason::removed}}));
    EXPECT_EQ(began(world), (Began{{a, fresh}}));
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

TEST(World, MarginsTogetherAreFinite)
{
    constexpr float inf = std::numeric_limits<float>::infinity(), huge = 3e38f;
    jostle::WorldOptions options;
    options.margin = huge;
    World3f world(options);
    const jostle::Aabb3f box{{inf, 0, 0}, {inf, 1, 1}};
    const Error refused = error_of([&] { world.add(box, {.margin = huge}); });
    EXPECT_EQ(refused.code(), ErrorCode::invalid_argument);
    EXPECT_STREQ(refused.what(), "margin 3e+38 of new objects and the world's margin 3e+38 are together more "
                                 "than 3.40282e+38; give less");
    const ObjectId id = world.add(box, {.margin = 4e37f});
    const Error later = error_of([&] { world.set_margin(id, huge); });
    EXPECT_EQ(later.index(), id.index);
    EXPECT_NE(std::string(later.what()).find("margin 3e+38 of object 0 and the world's"), std::string::npos);
    world.update();
    EXPECT_EQ(world.bounds(id).lo[0], inf);
    EXPECT_EQ(world.margin(id), huge + 4e37f);
    EXPECT_EQ(world.fork().bounds(id).lo[0], inf);
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

TEST(World, CountsThePairsThatItLookedAt)
{
    World3f world;
    std::vector<ObjectId> ids(100);
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 100; ++i)
        boxes.push_back(cube(static_cast<float>(i))); // each touches the next one
    world.add(boxes, ids);
    for (int update = 0; update < 2; ++update) { // new ones, then moved ones
        world.update();
        EXPECT_EQ(world.stats().candidates, 99u) << update;
        EXPECT_EQ(world.stats().false_positives, 0u) << update;
        for (std::size_t i = 0; i < ids.size(); ++i)
            world.move(ids[i], {{boxes[i].lo[0], 0.5f, 0}, {boxes[i].hi[0], 1.5f, 1}});
    }
    ObjectFilter apart;
    apart.mask = 0;
    world.set_filter(ids[50], apart);
    world.update();
    EXPECT_EQ(world.stats().candidates, 2u);
    EXPECT_EQ(world.stats().false_positives, 2u);
}

TEST(World, AMoveInPlaceOfAnObjectThatIsGoneIsAnError)
{
    World3f world;
    const ObjectId gone = world.add(cube(0)), other = world.add(cube(9));
    world.update();
    world.remove(gone);
    world.update();
    const ObjectId heir = world.add(cube(3));
    world.update();
    ASSERT_EQ(heir.index, gone.index);
    const std::vector<ObjectId> ids{gone};
    const std::vector<jostle::Aabb3f> boxes{cube(20)};
    for (const bool among_commands : {false, true}) {
        if (among_commands) world.move(other, cube(10));
        const Error error = error_of([&] { world.update(ids, boxes); });
        EXPECT_EQ(error.code(), ErrorCode::stale_id);
        EXPECT_EQ(error.index(), gone.index);
        EXPECT_EQ(world.box(heir).lo[0], 3);
    }
    world.update();
    EXPECT_EQ(world.box(other).lo[0], 10);
}

TEST(World, CountsWhatItWasTold)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(5));
    world.set_margin(a, 1);
    world.update();
    EXPECT_EQ(world.stats().commands, 3u);
    EXPECT_EQ(world.stats().dropped, 0u);
    world.remove(a);
    world.move(a, cube(3)); // too late
    const std::vector<ObjectId> ids{b};
    const std::vector<jostle::Aabb3f> boxes{cube(6)};
    world.update(ids, boxes);
    EXPECT_EQ(world.stats().commands, 3u);
    EXPECT_EQ(world.stats().dropped, 1u);
    world.update(ids, boxes);
    EXPECT_EQ(world.stats().commands, 1u);
    EXPECT_EQ(world.stats().changed, 0u) << "it was there";
    world.update();
    EXPECT_EQ(world.stats().commands, 0u);
}

TEST(World, RestingObjectsCostNothingAndStillMeet)
{
    World3f world;
    std::vector<ObjectId> ids(1000);
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 1000; ++i)
        boxes.push_back(cube(static_cast<float>(2 * i)));
    world.add(boxes, ids);
    for (int i = 0; i < 5; ++i)
        world.update();
    EXPECT_EQ(world.stats().resting, 1000u);
    EXPECT_EQ(world.stats().candidates, 0u);
    world.move(ids[0], cube(2 * 500 + 1.0f));
    world.update();
    EXPECT_EQ(world.stats().changed, 1u);
    EXPECT_EQ(world.stats().woken, 1u);
    EXPECT_EQ(began(world), (Began{{ids[0], ids[500]}, {ids[0], ids[501]}}));
    EXPECT_LE(world.stats().candidates, 4u);
    EXPECT_EQ(world.stats().active, 1u);
}

/// Runs tasks one after another, and breaks down when it has run so often.
class BreakingExecutor final : public jostle::Executor
{
  public:
    std::uint32_t concurrency() const noexcept override { return 4; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        if (left == 0) {
            ++broken;
            throw std::runtime_error("the host's job system is down");
        }
        --left;
        for (std::uint32_t i = 0; i < count; ++i)
            task(i);
    }
    static constexpr std::uint64_t plenty = 1'000'000;
    std::uint64_t left = plenty, broken = 0;
};

TEST(World, AnExecutorThatFailsFailsTheUpdateWhereverItIs)
{
    BreakingExecutor executor;
    World3f world(jostle::WorldOptions{.executor = &executor});
    std::vector<ObjectId> ids(9000);
    std::vector<jostle::Aabb3f> boxes;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        const auto x = static_cast<float>(i % 100), y = static_cast<float>(i / 100);
        boxes.push_back({{x, y, 0}, {x + 1, y + 1, 1}});
    }
    world.add(boxes, ids);
    for (int update = 0; update < 9; ++update) { // added, at rest, moving on, at rest again
        if (update == 4)
            for (std::size_t i = 0; i < ids.size(); i += 3)
                world.move(ids[i], boxes[i + 1]);
        const std::vector<std::byte> before = world.save();
        for (std::uint64_t runs = 0;; ++runs) {
            executor.left = runs;
            executor.broken = 0;
            bool failed = false;
            try {
                world.update();
            } catch (const std::runtime_error&) {
                failed = true;
            }
            executor.left = BreakingExecutor::plenty;
            ASSERT_EQ(failed, executor.broken != 0) << "update " << update << ", after " << runs << " runs";
            if (!failed) break;
            ASSERT_EQ(world.save(), before) << "update " << update << ", after " << runs << " runs";
        }
    }
    for (int k = 0; k < 20; ++k) // bit by bit
        world.update();
    EXPECT_EQ(world.stats().resting, ids.size());
    EXPECT_EQ(world.count(jostle::Aabb3f{{-1, -1, -1}, {101, 101, 2}}), ids.size());
}

TEST(World, NoUpdateWorksMuchMoreThanUsual)
{
    jostle_scenes::Scene<3, float> scene("uniform", 20'000, 1);
    World3f world;
    std::vector<ObjectId> ids(scene.boxes().size());
    world.add(scene.boxes(), ids);
    for (int i = 0; i < 5; ++i)
        world.update();
    ASSERT_EQ(world.stats().active, 0u);
    std::vector<ObjectId> movers;
    std::vector<jostle::Aabb3f> boxes;
    for (std::size_t i = 0; i < ids.size(); i += 50) {
        movers.push_back(ids[i]);
        boxes.push_back(scene.boxes()[i]);
    }
    std::vector<std::uint64_t> work;
    std::uint64_t listed = 0;
    for (int update = 0; update < 100; ++update) {
        for (std::size_t k = 0; k < boxes.size(); ++k) {
            const float by = 0.03f * static_cast<float>(k % 5) - 0.05f;
            boxes[k].lo[k % 3] += by;
            boxes[k].hi[k % 3] += by;
        }
        world.update(movers, boxes);
        if (update == 0) continue; // all wake up
        const jostle::WorldStats& s = world.stats();
        listed += s.listed;
        work.push_back(s.changed + s.candidates + s.settled +
                       32 * s.listed); // a list has about so many boxes
    }
    EXPECT_GT(listed, movers.size());
    std::sort(work.begin(), work.end());
    EXPECT_LE(work.back(), 3 * work[work.size() / 2]);
}

TEST(World, CountsTheIndexThatQuestionsMake)
{
    jostle_scenes::Scene<3, float> scene("uniform", 5'000, 1);
    World3f world;
    std::vector<ObjectId> ids(scene.boxes().size());
    world.add(scene.boxes(), ids);
    for (int step = 0; step < 4; ++step) {
        scene.step();
        world.update(ids, scene.boxes());
    }
    const std::uint64_t before = world.stats().bytes_reserved;
    EXPECT_GT(world.count(cube(0, 100)), 0u);
    world.update();
    EXPECT_GE(world.stats().bytes_reserved, before + 5'000 * sizeof(jostle::Aabb3f));
}

TEST(World, CountsAllThatItTookFromItsMemory)
{
    contract::CountingMemory memory;
    {
        jostle::WorldOptions options;
        options.executor = &jostle::serial_executor();
        options.memory = &memory;
        World3f world(options);
        world.update();
        const std::uint64_t own = world.stats().bytes_reserved - memory.bytes; // of the world object
        EXPECT_LT(own, 64u * 1024);
        std::vector<ObjectId> ids;
        for (int k = 0; k < 2000; ++k)
            ids.push_back(world.add(cube(static_cast<float>(k % 500) / 2)));
        for (int update = 0; update < 8; ++update) {
            world.move(ids[static_cast<std::size_t>(update)], cube(3));
            world.update();
            EXPECT_EQ(world.stats().bytes_reserved - memory.bytes, own);
            EXPECT_GT(world.count(cube(3)), 0u);
        }
        EXPECT_GT(memory.bytes, 2000 * sizeof(jostle::Aabb3f));
    }
    EXPECT_EQ(memory.bytes, 0u) << "all is given back";
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
    for (; world.stats().active > 0 && updates < 100; ++updates) {
        world.update();
        EXPECT_LE(world.stats().settled, 10'000u);
    }
    EXPECT_EQ(world.stats().resting, 20'000u);
    EXPECT_LT(updates, 30);
}

TEST(World, ExplainsAndDrawsItself)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0.5f)), c = world.add(cube(7));
    world.update();
    world.set_enabled(c, false);
    world.move(a, cube(0.25f));
    world.update();
    EXPECT_NE(world.explain().find("3 objects: "), std::string::npos) << world.explain();
    EXPECT_NE(world.explain().find("2 objects changed"), std::string::npos) << world.explain();
    int boxes = 0, off = 0, lines = 0;
    world.draw(
        [&](const jostle::Aabb3f&, jostle::DrawKind kind) {
            ++boxes;
            off += kind == jostle::DrawKind::disabled;
        },
        [&](const jostle::Vec3f& from, const jostle::Vec3f& to, jostle::DrawKind kind) {
            EXPECT_EQ(kind, jostle::DrawKind::persisted);
            EXPECT_EQ(from[0], 0.75f);
            EXPECT_EQ(to[0], 1.0f);
            ++lines;
        });
    EXPECT_EQ(boxes, 3);
    EXPECT_EQ(off, 1);
    EXPECT_EQ(lines, 1);
    EXPECT_TRUE(world.contains(b));
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
