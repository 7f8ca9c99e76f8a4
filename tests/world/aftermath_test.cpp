// SPDX-License-Identifier: MIT
// What is left after commands that contest, after updates that fail, after objects that are gone.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "churn.hpp"
#include "events.hpp"
#include "world/objects/key_set.hpp"
#include "world/update/sort_keys.hpp"

namespace world_tests {
namespace {

using jostle::Error;
using jostle::ErrorCode;
using jostle::ObjectPair;
using jostle::ObjectQueryFilter;
using jostle::World3f;

std::vector<ObjectPair> began(const World3f& world)
{
    return {world.began().begin(), world.began().end()};
}

/// Two threads set a property of one object; it doesn't matter which of them says which.
template <class Set, class Get>
void expect_the_same_whoever_says_which(const Set& set, const Get& get)
{
    std::vector<decltype(get(World3f(), ObjectId()))> got;
    for (const bool exchanged : {false, true}) {
        World3f world;
        const ObjectId id = world.add(cube(0));
        world.update();
        set(world, id, exchanged ? 1 : 0);
        std::thread([&] { set(world, id, exchanged ? 0 : 1); }).join();
        world.update();
        got.push_back(get(world, id));
    }
    EXPECT_EQ(got[0], got[1]);
}

TEST(Contests, OfEqualSequencesAreSettledByWhatIsSaid)
{
    expect_the_same_whoever_says_which(
        [](World3f& world, ObjectId id, int which) { world.set_enabled(id, which == 1); },
        [](const World3f& world, ObjectId id) { return world.enabled(id); });
    expect_the_same_whoever_says_which(
        [](World3f& world, ObjectId id, int which) { world.set_margin(id, static_cast<float>(which)); },
        [](const World3f& world, ObjectId id) { return world.margin(id); });
    const auto filter_of = [](const World3f& world, ObjectId id) { return world.filter(id); };
    const auto set_filter_with = [](auto&& change) {
        return [change](World3f& world, ObjectId id, int which) {
            ObjectFilter filter;
            change(filter, static_cast<std::uint32_t>(which));
            world.set_filter(id, filter);
        };
    };
    expect_the_same_whoever_says_which(
        set_filter_with([](ObjectFilter& f, std::uint32_t which) { f.category = 1 + which; }), filter_of);
    expect_the_same_whoever_says_which(
        set_filter_with([](ObjectFilter& f, std::uint32_t which) { f.mask = 1 + which; }), filter_of);
    expect_the_same_whoever_says_which(
        set_filter_with([](ObjectFilter& f, std::uint32_t which) { f.owner = 1 + which; }), filter_of);
    expect_the_same_whoever_says_which(
        set_filter_with([](ObjectFilter& f, std::uint32_t which) { f.is_static = which == 1; }), filter_of);
}

TEST(Contests, WhatOneThreadDoesntSayIsLeftToTheOther)
{
    for (const bool here_first : {false, true}) {
        World3f world;
        const ObjectId id = world.add(cube(0));
        world.update();
        const auto here = [&] { world.move(id, cube(3), 1); };
        const auto there = [&] { std::thread([&] { world.set_margin(id, 2, 1); }).join(); };
        if (here_first) here();
        there();
        if (!here_first) here();
        world.update();
        EXPECT_EQ(world.box(id).lo[0], 3);
        EXPECT_EQ(world.margin(id), 2);
        EXPECT_TRUE(world.enabled(id));
        EXPECT_EQ(world.filter(id), ObjectFilter());
    }
}

TEST(Contests, WhoSaysNothingOfAFilterDoesntWinWithTheUsualOne)
{
    for (const bool here : {false, true}) {
        World3f world;
        const ObjectId id = world.add(cube(0));
        world.update();
        ObjectFilter filter;
        filter.category = filter.mask = 1; // less than the usual one, as numbers
        const auto filters = [&] { world.set_filter(id, filter); };
        const auto moves = [&] { world.move(id, cube(3)); };
        here ? filters() : moves();
        std::thread([&] { here ? moves() : filters(); }).join();
        world.update();
        EXPECT_EQ(world.filter(id), filter) << here;
        EXPECT_EQ(world.box(id).lo[0], 3) << here;
    }
}

TEST(Contests, OfNewObjectsDontForgetThatTheyAreNew)
{
    World3f world;
    std::vector<ObjectId> ids(40);
    world.add(std::vector<jostle::Aabb3f>(ids.size(), cube(0)), ids);
    std::thread([&] {
        for (const ObjectId id : ids)
            world.move(id, cube(5));
    }).join();
    for (const ObjectId id : ids)
        world.set_margin(id, 1);
    world.update();
    for (const ObjectId id : ids) {
        ASSERT_TRUE(world.contains(id));
        EXPECT_EQ(world.box(id).lo[0], 5);
        EXPECT_EQ(world.bounds(id).lo[0], 4);
    }
}

TEST(Contests, ARemovalBeatsEverything)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    world.move(a, cube(3), 9);
    world.remove(a);
    world.remove(b);
    std::thread([&] { world.move(b, cube(3), 9); }).join();
    world.update();
    EXPECT_FALSE(world.contains(a));
    EXPECT_FALSE(world.contains(b));
    EXPECT_EQ(world.size(), 0u);
}

TEST(Contests, HaveTheWorldsMarginAndEveryAxis)
{
    World3f world({.margin = 1});
    const ObjectId id = world.add(cube(0));
    world.update();
    for (int axis = 0; axis < 3; ++axis) {
        jostle::Vec3f by{};
        by[axis] = 4;
        world.set_margin(id, 2, 5);
        world.move(id, cube(0), by, 5);
        world.update();
        EXPECT_EQ(world.bounds(id).lo[0], -3);
        for (int d = 0; d < 3; ++d)
            EXPECT_EQ(world.bounds(id).hi[d], d == axis ? 8 : 4);
    }
}

TEST(Contests, EveryCallHasItsSequence)
{
    World3f world;
    const std::vector<ObjectId> ids{world.add(cube(0)), world.add(cube(0)), world.add(cube(0))};
    world.update();
    world.move(ids, std::vector<jostle::Aabb3f>(3, cube(5)), 7);
    world.move(ids[1], cube(6), 8);
    world.move(ids[0], cube(6), 6);
    for (const ObjectId id : ids)
        world.move(id, cube(1), 3);
    world.update();
    EXPECT_EQ(world.box(ids[0]).lo[0], 5);
    EXPECT_EQ(world.box(ids[1]).lo[0], 6);
    EXPECT_EQ(world.box(ids[2]).lo[0], 5);
}

TEST(MovesInPlace, KeepTheMarginAndDropTheDisplacement)
{
    World3f world;
    const ObjectId id = world.add(cube(0), {.margin = 1});
    world.update();
    world.move(id, cube(0), {5, 0, 0});
    world.update();
    EXPECT_EQ(world.bounds(id).hi[0], 7);
    const std::vector<ObjectId> ids{id};
    world.update(ids, std::vector<jostle::Aabb3f>{cube(4)});
    EXPECT_EQ(world.box(id).lo[0], 4);
    EXPECT_EQ(world.bounds(id).lo[0], 3);
    EXPECT_EQ(world.bounds(id).hi[0], 6);
}

TEST(MovesInPlace, OfOneObjectTwiceAreOneChange)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(9)), c = world.add(cube(0));
    world.update();
    const std::vector<ObjectId> twice{a, b, b};
    world.update(twice, std::vector<jostle::Aabb3f>{cube(5), cube(5), cube(0)});
    EXPECT_EQ(world.stats().changed, 2u);
    EXPECT_EQ(world.box(b).lo[0], 0);
    EXPECT_EQ(began(world), (std::vector<ObjectPair>{{b, c}}));
    EXPECT_EQ(world.ended().size(), 1u);
}

TEST(MovesInPlace, OfFewObjectsToABadBoxAreAnErrorWhicheverItIs)
{
    World3f world;
    std::vector<ObjectId> ids(3);
    world.add(std::vector<jostle::Aabb3f>(3, cube(0)), ids);
    world.update();
    for (std::size_t bad = 0; bad < 3; ++bad) {
        std::vector<jostle::Aabb3f> boxes(3, cube(5));
        std::swap(boxes[bad].lo[1], boxes[bad].hi[1]);
        EXPECT_THROW(world.update(ids, boxes), Error) << bad;
        for (const ObjectId id : ids)
            EXPECT_EQ(world.box(id).lo[0], 0) << bad;
    }
}

TEST(MovesInPlace, OfManyObjectsSomeOfWhichStay)
{
    World3f in_place;
    std::vector<ObjectId> ids(10'000);
    std::vector<jostle::Aabb3f> boxes;
    for (std::size_t i = 0; i < ids.size(); ++i)
        boxes.push_back(cube(3 * static_cast<float>(i)));
    in_place.add(boxes, ids);
    in_place.update();
    World3f by_commands = in_place.fork();
    std::size_t moved = 0;
    for (std::size_t i = 1; i < ids.size(); i += i < 5000 ? 3 : 1, ++moved)
        boxes[i] = cube(boxes[i].lo[0] - (i % 2 == 0 ? 2.5f : 0.5f));
    in_place.update(ids, boxes);
    for (std::size_t i = ids.size(); i-- > 0;)
        by_commands.move(ids[i], boxes[i]);
    by_commands.update();
    EXPECT_EQ(in_place.stats().changed, moved);
    EXPECT_GT(in_place.began().size(), 1000u);
    EXPECT_EQ(began(in_place), began(by_commands));
    EXPECT_EQ(in_place.save(), by_commands.save());
}

// Objects whose ids ascend are moved by several threads; so it is seen at every id whether they do.
TEST(MovesInPlace, OfIdsThatDescendOrComeTwiceAnywhereAreThoseOfCommands)
{
    for (const std::size_t count : {2u, 3u, 4095u, 4096u, 4097u, 8191u, 8192u, 8193u, 20'000u}) {
        World3f rested;
        std::vector<ObjectId> all(count);
        std::vector<jostle::Aabb3f> from, boxes;
        for (std::size_t i = 0; i < count; ++i) {
            from.push_back(cube(-2 * static_cast<float>(i + 1)));
            boxes.push_back(cube(2 * static_cast<float>(i + 1)));
        }
        rested.add(from, all);
        rested.update();
        std::vector<std::size_t> places{1, count - 1, count / 2};
        for (std::size_t border = 4096; border < count; border += 4096)
            places.insert(places.end(), {border - 1, border, border + 1});
        for (const std::size_t place : places) {
            if (place >= count) continue;
            for (const bool twice : {false, true}) {
                std::vector<ObjectId> ids = all;
                if (twice)
                    ids[place] = ids[place - 1];
                else
                    std::swap(ids[place], ids[place - 1]);
                World3f world = rested.fork();
                world.update(ids, boxes);
                ASSERT_EQ(world.box(all[place - 1]).lo[0], boxes[place].lo[0]) << count << ' ' << place;
                ASSERT_EQ(world.box(all[place]).lo[0], (twice ? from[place] : boxes[place - 1]).lo[0]);
                ASSERT_EQ(world.stats().changed, count - (twice ? 1 : 0));
            }
        }
    }
}

TEST(Gone, ARestoredWorldsObjectsComeToRestAsFastAsTheOthers)
{
    World3f world;
    std::vector<ObjectId> ids(5000);
    std::vector<jostle::Aabb3f> boxes;
    for (std::size_t i = 0; i < ids.size(); ++i)
        boxes.push_back(cube(3 * static_cast<float>(i)));
    world.add(boxes, ids);
    for (int update = 0; update < 3; ++update) {
        for (jostle::Aabb3f& box : boxes)
            box.lo[1] += 1, box.hi[1] += 1;
        world.update(ids, boxes);
    }
    World3f restored = world.fork();
    for (int update = 0; update < 12; ++update) {
        world.update();
        restored.update();
        EXPECT_EQ(world.stats().resting, restored.stats().resting) << update;
    }
}

// --- Pairs and what is asked about them --------------------------------------------------------------------

TEST(Accept, IsAskedInOrderAndWhatItEndsEndsInOrder)
{
    std::vector<ObjectPair> asked;
    bool takes = true;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId a, ObjectId b) {
        asked.push_back({a, b});
        return takes;
    };
    World3f world(options);
    std::vector<ObjectId> ids(8);
    world.add(std::vector<jostle::Aabb3f>{cube(0), cube(0.5f), cube(10), cube(10.5f), cube(20), cube(20.5f),
                                          cube(30), cube(40)},
              ids);
    world.update();
    ASSERT_EQ(world.began().size(), 3u);
    asked.clear();
    // One is asked about again, one begins before it and one behind, one comes apart.
    world.set_filter(ids[2], world.filter(ids[2]));
    world.move(ids[6], cube(0.75f));
    world.move(ids[7], cube(19.5f));
    world.move(ids[5], cube(50));
    takes = false;
    world.update();
    const auto in_order = [](const ObjectPair& x, const ObjectPair& y) {
        return std::pair(x.a.index, x.b.index) < std::pair(y.a.index, y.b.index);
    };
    EXPECT_EQ(asked.size(), 4u);
    EXPECT_TRUE(std::is_sorted(asked.begin(), asked.end(), in_order));
    ASSERT_EQ(world.ended().size(), 2u);
    EXPECT_EQ(world.ended()[0].a, ids[2]);
    EXPECT_EQ(world.ended()[0].reason, jostle::EndReason::filtered);
    EXPECT_EQ(world.ended()[1].a, ids[4]);
    EXPECT_EQ(world.ended()[1].reason, jostle::EndReason::moved_apart);
}

TEST(Accept, WhatAFailedUpdateDecidedIsForgotten)
{
    int calls = 0, throws_at = 2;
    bool takes = false;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        if (++calls == throws_at) throw std::runtime_error("no");
        return takes;
    };
    World3f world(options);
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0)), c = world.add(cube(0));
    EXPECT_THROW(world.update(), std::runtime_error); // one was refused before
    takes = true;
    throws_at = 0;
    world.update();
    EXPECT_EQ(began(world).size(), 3u);
    EXPECT_EQ(world.pairs().size(), 3u);
    EXPECT_EQ(world.stats().refused, 0u);

    takes = false;
    world.set_filter(a, {});
    world.update();
    EXPECT_EQ(world.stats().refused, 2u);
    EXPECT_EQ(world.pairs().size(), 1u);
    takes = true;
    calls = 0;
    throws_at = 2;
    world.set_filter(a, {});
    EXPECT_THROW(world.update(), std::runtime_error); // one was taken before
    EXPECT_EQ(world.stats().refused, 2u);
    EXPECT_EQ(world.pairs().size(), 1u);
    EXPECT_EQ(world.pairs().to_vector()[0], (jostle::Pair{b.index, c.index}));
}

TEST(Ends, AreToldOnce)
{
    World3f world;
    const ObjectId a = world.add(cube(0));
    (void)world.add(cube(0));
    world.update();
    world.move(a, cube(9));
    world.update();
    EXPECT_EQ(world.ended().size(), 1u);
    for (int update = 0; update < 4; ++update) {
        world.update();
        EXPECT_EQ(world.ended().size(), 0u) << update;
        EXPECT_EQ(world.began().size(), 0u) << update;
    }
}

// --- Failed updates ----------------------------------------------------------------------------------------

TEST(AFailedUpdate, LeavesEveryPropertyAsItWas)
{
    bool angry = false;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        if (angry) throw std::runtime_error("no");
        return true;
    };
    World3f world(options);
    const ObjectId a = world.add(cube(0)), off = world.add(cube(3), {.enabled = false});
    world.update();
    angry = true;
    world.set_enabled(a, false);
    world.set_enabled(off, true);
    world.set_margin(a, 1);
    world.set_margin(a, 2);
    ObjectFilter filter;
    filter.owner = 5;
    world.set_filter(a, filter);
    const ObjectId c = world.add(cube(3)), d = world.add(cube(3));
    const auto before = world.save();
    EXPECT_THROW(world.update(), std::runtime_error);
    EXPECT_TRUE(world.enabled(a));
    EXPECT_FALSE(world.enabled(off));
    EXPECT_EQ(world.margin(a), 0);
    EXPECT_EQ(world.filter(a), ObjectFilter());
    EXPECT_FALSE(world.contains(c));
    EXPECT_EQ(world.save(), before);

    // What was queued before it and after it is applied, and once.
    angry = false;
    world.move(c, cube(7));
    world.update();
    EXPECT_EQ(world.stats().commands, 8u);
    EXPECT_EQ(world.box(c).lo[0], 7);
    EXPECT_EQ(world.margin(a), 2);
    world.move(d, cube(9));
    world.update();
    EXPECT_EQ(world.stats().commands, 1u);
    EXPECT_EQ(world.box(c).lo[0], 7);
    world.update();
    EXPECT_EQ(world.stats().commands, 0u);
    EXPECT_EQ(world.box(d).lo[0], 9);
}

// --- Objects that are gone, and others that aren't there yet
// ------------------------------------------------

TEST(Gone, NobodysIdIsNobodys)
{
    World3f world;
    const ObjectId a = world.add(cube(0));
    world.update();
    world.remove(a);
    world.update(); // index 0 has no object now
    EXPECT_FALSE(world.contains(ObjectId{}));
    EXPECT_THROW(world.move(ObjectId{}, cube(0)), Error);
    EXPECT_THROW(world.remove(ObjectId{}), Error);
    EXPECT_THROW((void)world.box(ObjectId{}), Error);
}

TEST(Gone, WhatIsQueuedIsntThereYet)
{
    World3f world;
    (void)world.add(cube(0));
    world.update();
    const ObjectId queued = world.add(cube(3));
    EXPECT_FALSE(world.contains(queued));
    EXPECT_EQ(world.id(queued.index), ObjectId{});
    world.update();
    EXPECT_TRUE(world.contains(queued));
}

TEST(Gone, OfManyToBeRemovedAllAreOrNone)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    world.remove(a);
    world.update();
    EXPECT_THROW(world.remove(std::vector<ObjectId>{b, a}), Error);
    world.update();
    EXPECT_TRUE(world.contains(b));
}

TEST(Gone, AnAskerThatIsGoneLeavesNobodyOut)
{
    World3f world;
    const ObjectId a = world.add(cube(0));
    world.update();
    world.remove(a);
    world.update();
    const ObjectId heir = world.add(cube(0));
    world.update();
    ASSERT_EQ(heir.index, a.index);
    ObjectQueryFilter filter;
    filter.exclude = a;
    EXPECT_EQ(world.count(cube(0), filter), 1u);
    filter.exclude = heir;
    EXPECT_EQ(world.count(cube(0), filter), 0u);
}

TEST(Gone, ADrawingHasNoLinesToThem)
{
    World3f world;
    const ObjectId a = world.add(cube(0));
    (void)world.add(cube(0)), (void)world.add(cube(0));
    world.update();
    world.remove(a);
    world.update();
    int lines = 0;
    world.draw({}, [&](const jostle::Vec3f&, const jostle::Vec3f&, jostle::DrawKind) { ++lines; });
    EXPECT_EQ(world.ended().size(), 2u);
    EXPECT_EQ(lines, 0) << "the pair that is left is of two that didn't change";
}

TEST(Gone, WhoComesToRestIsFoundOnceByWhoeverAsks)
{
    World3f world;
    for (int i = 0; i < 20; ++i)
        (void)world.add(cube(static_cast<float>(2 * i)));
    const jostle::Aabb3f all{{-1, -1, -1}, {99, 9, 9}};
    for (int update = 0; update < 8; ++update) {
        world.update();
        EXPECT_EQ(world.count(all), 20u) << update;
    }
    EXPECT_EQ(world.stats().resting, 20u);
}

TEST(Filters, OfAnAskerCountOneByOne)
{
    World3f world;
    ObjectFilter ours;
    ours.category = 2;
    ours.mask = 4;
    ours.owner = 7;
    (void)world.add(cube(0), {.filter = ours});
    world.update();
    const auto count = [&](const auto& change) {
        ObjectQueryFilter filter;
        change(filter);
        return world.count(cube(0), filter);
    };
    EXPECT_EQ(count([](ObjectQueryFilter&) {}), 1u);
    EXPECT_EQ(count([](ObjectQueryFilter& f) { f.mask = 2; }), 1u);
    EXPECT_EQ(count([](ObjectQueryFilter& f) { f.mask = ~2u; }), 0u);
    EXPECT_EQ(count([](ObjectQueryFilter& f) { f.category = 4; }), 1u);
    EXPECT_EQ(count([](ObjectQueryFilter& f) { f.category = ~4u; }), 0u);
    EXPECT_EQ(count([](ObjectQueryFilter& f) { f.owner = 6; }), 1u);
    EXPECT_EQ(count([](ObjectQueryFilter& f) { f.owner = 7; }), 0u);
}

TEST(Filters, AcceptIsToldWhichQuestionOfABatchItIs)
{
    World3f world;
    (void)world.add(cube(0));
    world.update();
    const auto second = [](std::uint32_t question, ObjectId) { return question == 1; };
    const ObjectQueryFilter filter{.accept = second};
    const std::vector<jostle::Aabb3f> regions(3, cube(0));
    std::vector<std::uint64_t> counts(3);
    world.count(std::span<const jostle::Aabb3f>(regions), std::span<std::uint64_t>(counts), filter);
    EXPECT_EQ(counts, (std::vector<std::uint64_t>{0, 1, 0}));
}

TEST(Filters, SetToAndFroAreNoChange)
{
    World3f world;
    const ObjectId a = world.add(cube(0));
    (void)world.add(cube(0));
    world.update();
    ObjectFilter other;
    other.mask = 0;
    world.set_filter(a, other);
    world.set_filter(a, {});
    world.update();
    EXPECT_EQ(world.stats().changed, 0u);
    EXPECT_TRUE(world.began().empty() && world.ended().empty());
}

TEST(SortKeys, SortHoweverFewOrManyAndWhereverTheDisorderIs)
{
    std::pmr::vector<std::uint32_t> values, scratch;
    Random random(1);
    for (const std::size_t size : {0u, 1u, 2u, 3u, 15u, 16u, 17u, 63u, 64u, 65u, 300u, 8191u, 8192u, 20'000u})
        for (int kind = 0; kind < 4; ++kind) {
            values.clear();
            for (std::size_t i = 0; i < size; ++i)
                values.push_back(kind == 0 ? random.below(~0u) : static_cast<std::uint32_t>(i) + 1);
            if (kind == 1 && size > 1) std::swap(values[0], values[1]);
            if (kind == 2 && size > 1) std::swap(values[size - 2], values[size - 1]);
            auto expected = values;
            std::sort(expected.begin(), expected.end());
            jostle::world::sort_by_key(values, scratch, [](std::uint32_t value) { return value; });
            ASSERT_EQ(values, expected) << size << ", " << kind;

            std::pmr::vector<jostle::Pair> pairs, spare;
            for (std::size_t i = 0; i < size; ++i)
                pairs.push_back({random.below(1 + static_cast<std::uint32_t>(size / 20)), random.below(500)});
            auto sorted = pairs;
            std::sort(sorted.begin(), sorted.end());
            jostle::world::sort_pairs(pairs, spare);
            ASSERT_EQ(pairs, sorted) << size;
        }
}

TEST(KeySet, HasWhatWasPutInAndNotTakenOut)
{
    using jostle::world::Key;
    jostle::world::KeySet set(std::pmr::get_default_resource());
    EXPECT_FALSE(set.contains(7));
    set.erase(7);
    std::set<Key> twin;
    Random random(2);
    for (int step = 0; step < 60'000; ++step) {
        const std::uint32_t most = step < 20'000 ? 3000 : 60; // so that it empties after it was full
        const Key key = Key{random.below(most)} << 32 | random.below(2);
        if (random.below(3) != 0) {
            ASSERT_EQ(set.insert(key), twin.insert(key).second) << step;
        } else {
            set.erase(key);
            twin.erase(key);
        }
        if (step % 5000 == 4999) {
            const auto is_odd = [](Key each) { return (each >> 32) % 3 == 1; };
            set.erase_if(is_odd);
            std::erase_if(twin, is_odd);
        }
        const Key other = Key{random.below(most)} << 32 | random.below(2);
        ASSERT_EQ(set.contains(other), twin.count(other) == 1) << step;
        ASSERT_EQ(set.size(), twin.size()) << step;
        if (step % 500 != 0) continue;
        jostle::world::KeySet copy(std::pmr::get_default_resource());
        copy = set;
        std::set<Key> all;
        copy.each([&](Key each) { ASSERT_TRUE(all.insert(each).second) << step; });
        ASSERT_EQ(all, twin) << step;
    }
    set.clear();
    EXPECT_TRUE(set.empty());
    EXPECT_FALSE(set.contains(*twin.begin()));
}

} // namespace
} // namespace world_tests
