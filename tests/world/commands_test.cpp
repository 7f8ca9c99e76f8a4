// SPDX-License-Identifier: MIT
// Which of several commands about one object wins: after sequences, after failed updates, with many filters.
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <stdexcept>
#include <thread>

#include "churn.hpp"
#include "events.hpp"
#include "tests/contract/counting_memory.hpp"

namespace world_tests {
namespace {

using jostle::World3f;

TEST(Commands, OfEqualSequencesOfOneThreadTheLaterWins)
{
    World3f world;
    const ObjectId id = world.add(cube(0));
    world.update();
    const float small[3] = {1, 1, 1}, large[3] = {3, 3, 3};
    ObjectFilter first, second;
    first.category = 2;
    second.category = 4;
    for (const std::uint32_t sequence : {7u, 0u}) {
        // Where none has a sequence, another command that has one sees to it that all are put in order.
        if (sequence == 0) world.set_filter(id, {}, 5);
        world.move(id, cube(10), sequence);
        world.move(id, cube(20), sequence);
        world.set_margin(id, 1, sequence);
        world.set_margin(id, 0.5f, sequence);
        world.set_enabled(id, true, sequence);
        world.set_enabled(id, false, sequence);
        if (sequence != 0) {
            world.set_filter(id, first, sequence);
            world.set_filter(id, second, sequence);
        }
        world.update();
        EXPECT_EQ(world.box(id).lo[0], 20) << sequence;
        EXPECT_EQ(world.margin(id), 0.5f) << sequence;
        EXPECT_FALSE(world.enabled(id)) << sequence;
        EXPECT_EQ(world.filter(id).category, sequence == 0 ? 1u : 4u);
        world.move(id, cube(0), sequence);
        world.resize(id, large, sequence);
        world.resize(id, small, sequence);
        world.set_enabled(id, true);
        if (sequence == 0) world.set_filter(id, {}, 5);
        world.update();
        EXPECT_EQ(world.box(id).lo[0], 0) << "a cube again, where the last move put it";
        EXPECT_EQ(world.box(id).hi[0], 1);
    }
}

TEST(Commands, ManyAreAddedWithOptionsOfTheirOwn)
{
    World3f one_by_one, at_once;
    std::vector<World3f::Box> boxes;
    std::vector<World3f::Options> options;
    for (std::uint32_t i = 0; i < 40; ++i) {
        boxes.push_back(cube(static_cast<float>(i)));
        options.push_back({.filter = {.category = 1u << i % 3, .mask = 3, .owner = i / 2},
                           .enabled = i % 5 != 0,
                           .margin = static_cast<float>(i) / 64,
                           .user_data = i % 7});
    }
    std::vector<ObjectId> ids(40), expected;
    for (std::size_t i = 0; i < 40; ++i)
        expected.push_back(one_by_one.add(boxes[i], options[i]));
    at_once.add(boxes, ids, options);
    EXPECT_EQ(ids, expected);
    one_by_one.update();
    at_once.update();
    for (std::size_t i = 0; i < 40; ++i) {
        EXPECT_EQ(at_once.filter(ids[i]), options[i].filter);
        EXPECT_EQ(at_once.enabled(ids[i]), options[i].enabled);
        EXPECT_EQ(at_once.margin(ids[i]), options[i].margin);
        EXPECT_EQ(at_once.user_data(ids[i]), options[i].user_data);
    }
    EXPECT_GT(at_once.began().size(), 5u);
    EXPECT_TRUE(std::equal(at_once.began().begin(), at_once.began().end(), one_by_one.began().begin(),
                           one_by_one.began().end()));
    std::vector<jostle::Pair> joined;
    std::pmr::vector<jostle::Pair> joined_elsewhere;
    at_once.join(boxes, joined);
    at_once.join(boxes, joined_elsewhere);
    EXPECT_GT(joined.size(), 40u);
    EXPECT_TRUE(std::equal(joined.begin(), joined.end(), joined_elsewhere.begin(), joined_elsewhere.end()));

    // All or none.
    const auto refused = [&](const char* words, std::uint64_t index) {
        try {
            at_once.add(boxes, ids, options);
            ADD_FAILURE() << "no error";
        } catch (const jostle::Error& error) {
            EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
            EXPECT_EQ(error.index(), index);
        }
    };
    options[17].margin = options[23].margin = -1;
    refused("margin -1 of new object 17", 17);
    options.pop_back();
    refused("39 options for 40 boxes", jostle::Error::no_index);
    at_once.update();
    EXPECT_EQ(at_once.size(), 40u);
    std::vector<ObjectId> more(40);
    at_once.add(boxes, more, {.margin = 0.25f}); // one for all
    at_once.update();
    EXPECT_EQ(at_once.margin(more[39]), 0.25f);
    EXPECT_EQ(at_once.user_data(more[39]), 0u);
}

TEST(Commands, AMoveInPlaceIsOneOfTheCommandsWithSequenceZero)
{
    World3f world;
    const ObjectId id = world.add(cube(0));
    world.update();
    const std::vector<ObjectId> ids{id};
    const std::vector<jostle::Aabb3f> boxes{cube(7)};
    world.set_margin(id, 2, 5); // another property
    world.update(ids, boxes);
    EXPECT_EQ(world.box(id).lo[0], 7);
    EXPECT_EQ(world.bounds(id).lo[0], 5);
    world.move(id, cube(3), 1);
    world.update(ids, boxes);
    EXPECT_EQ(world.box(id).lo[0], 3);
    world.move(id, cube(4));
    world.set_margin(id, 0, 1);
    world.update(ids, boxes);
    EXPECT_EQ(world.box(id).lo[0], 7) << "the last of this thread's";
}

TEST(Commands, AMoveWithASequenceKeepsItsDisplacement)
{
    World3f world;
    const ObjectId id = world.add(cube(0));
    world.update();
    const float by[3] = {5, 0, 0};
    world.move(id, cube(0), by, 9);
    world.move(id, cube(10), 3);
    world.update();
    EXPECT_EQ(world.box(id).lo[0], 0);
    EXPECT_EQ(world.bounds(id).hi[0], 6);
    world.move(id, cube(1), 3);
    world.move(id, cube(0), by, 9);
    world.update();
    EXPECT_EQ(world.bounds(id).hi[0], 6) << "in the other order";
    for (const bool later : {false, true}) { // this thread's, before or after another one's
        if (later) world.move(id, cube(0), by, 9);
        std::thread([&] { world.move(id, cube(20), 1); }).join();
        if (!later) world.move(id, cube(0), by, 9);
        world.update();
        EXPECT_EQ(world.box(id).lo[0], 0);
        EXPECT_EQ(world.bounds(id).hi[0], 6);
    }
    world.move(id, cube(0), by, 3);
    world.move(id, cube(10), 9);
    world.update();
    EXPECT_EQ(world.bounds(id).lo[0], 10);
    EXPECT_EQ(world.bounds(id).hi[0], 11) << "the displacement belongs to the move that lost";
}

TEST(Commands, OfTwoThreadsItDoesntMatterWhoWasFirst)
{
    jostle::Aabb3f boxes[2];
    for (const bool this_one_first : {false, true}) {
        World3f world;
        std::vector<ObjectId> ids(2);
        std::thread([&] { world.add(std::vector<jostle::Aabb3f>(2, cube(0)), ids); }).join();
        world.update();
        world.update(); // from here on the queue is nobody's
        const auto here = [&] { world.move(ids[0], cube(10)), world.move(ids[1], cube(40)); };
        const auto there = [&] {
            std::thread([&] { world.move(ids[0], cube(20)), world.move(ids[1], cube(30)); }).join();
        };
        if (this_one_first) here();
        there();
        if (!this_one_first) here();
        world.update();
        for (std::size_t i = 0; i < 2; ++i) {
            if (this_one_first) {
                EXPECT_EQ(world.box(ids[i]).lo[0], boxes[i].lo[0]);
            } else {
                boxes[i] = world.box(ids[i]);
            }
        }
    }
}

// Nor who gives it to update().
TEST(Commands, OfAMoveInPlaceAndAnotherThreadsItDoesntMatterWhoSaidWhich)
{
    for (const bool adds : {false, true}) { // this thread has something else to say, or nothing
        float at[2];
        for (const bool exchanged : {false, true}) {
            World3f world;
            std::vector<ObjectId> ids(1);
            std::thread([&] { world.add(std::vector<jostle::Aabb3f>{cube(0)}, ids); }).join();
            world.update();
            world.update(); // from here on the queue is nobody's
            std::thread([&] { world.move(ids[0], cube(exchanged ? 10 : 20)); }).join();
            if (adds) (void)world.add(cube(100));
            world.update(ids, std::vector<jostle::Aabb3f>{cube(exchanged ? 20 : 10)});
            at[exchanged] = world.box(ids[0]).lo[0];
        }
        EXPECT_EQ(at[0], at[1]) << adds;
    }
}

TEST(Commands, AMoveInPlaceComesAfterWhatItsThreadQueued)
{
    for (const bool forth : {false, true}) {
        const float first = forth ? 10.0f : 20.0f, last = forth ? 20.0f : 10.0f;
        World3f world;
        std::vector<ObjectId> ids(1);
        std::thread([&] { // the first to queue
            world.add(std::vector<jostle::Aabb3f>{cube(0)}, ids);
            world.set_margin(ids[0], 1);
        })
            .join();
        world.update();
        std::thread([&] { world.set_margin(ids[0], 2); }).join();
        world.move(ids[0], cube(first));
        world.update(ids, std::vector<jostle::Aabb3f>{cube(last)});
        EXPECT_EQ(world.stats().contested, 1u);
        EXPECT_EQ(world.box(ids[0]).lo[0], last);
    }
}

TEST(Commands, ThreadsThatHaveNothingToSayCostNoMemory)
{
    World3f world;
    const ObjectId id = world.add(cube(0));
    world.update();
    constexpr int count = 64;
    std::atomic<int> turn{-1}, spoken{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < count; ++t)
        threads.emplace_back([&, t] { // each speaks once, and lives on to the end
            const auto wait_for = [&](int wanted) {
                for (int now = turn; now < wanted; now = turn)
                    turn.wait(now);
            };
            wait_for(t);
            world.move(id, cube(static_cast<float>(t)));
            ++spoken;
            spoken.notify_all();
            wait_for(count);
        });
    std::uint64_t early = 0;
    for (int t = 0; t < count; ++t) {
        turn = t;
        turn.notify_all();
        spoken.wait(t);
        for (int update = 0; update < 3; ++update)
            world.update();
        EXPECT_EQ(world.box(id).lo[0], static_cast<float>(t));
        if (t == 8) early = world.stats().bytes_reserved;
    }
    turn = count;
    turn.notify_all();
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_LE(world.stats().bytes_reserved, early + 4096);
}

TEST(Commands, WhatWasQueuedBeforeAFailedUpdateComesBeforeWhatIsQueuedAfterIt)
{
    bool angry = false;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        if (angry) throw std::runtime_error("no");
        return true;
    };
    World3f world(options);
    (void)world.add(cube(0));
    const ObjectId id = world.add(cube(5));
    world.update();
    for (int failures = 1; failures <= 3; ++failures) {
        world.move(id, cube(0)); // meets the other, so that accept is asked
        world.set_margin(id, 2);
        world.set_enabled(id, true);
        angry = true;
        for (int k = 0; k < failures; ++k)
            EXPECT_THROW(world.update(), std::runtime_error);
        EXPECT_EQ(world.box(id).lo[0], 5);
        angry = false;
        world.set_margin(id, 1);
        world.move(id, cube(3));
        EXPECT_NO_THROW(world.update());
        EXPECT_EQ(world.box(id).lo[0], 3);
        EXPECT_EQ(world.margin(id), 1);
        EXPECT_EQ(world.stats().commands, 5u);
        world.move(id, cube(5));
        world.set_margin(id, 0);
        world.update();
    }
    // A removal of before beats a move of after; an object added before is there to be moved after.
    world.move(id, cube(0));
    const ObjectId fresh = world.add(cube(0));
    angry = true;
    EXPECT_THROW(world.update(), std::runtime_error);
    angry = false;
    world.move(fresh, cube(8));
    world.remove(id);
    world.update();
    EXPECT_EQ(world.box(fresh).lo[0], 8);
    EXPECT_FALSE(world.contains(id));
}

TEST(Commands, WithoutMemoryForWhatIsQueuedAfterAFailedUpdateNothingIsLost)
{
    contract::CountingMemory memory;
    bool angry = false;
    jostle::WorldOptions options;
    options.executor = &jostle::serial_executor();
    options.memory = &memory;
    options.accept = [&](ObjectId, ObjectId) {
        if (angry) throw std::runtime_error("no");
        return true;
    };
    World3f world(options);
    (void)world.add(cube(0));
    const ObjectId id = world.add(cube(5));
    world.update();
    world.move(id, cube(0));
    angry = true;
    EXPECT_THROW(world.update(), std::runtime_error);
    angry = false;
    for (int k = 0; k < 1000; ++k)
        world.move(id, cube(static_cast<float>(k)));
    memory.failing_allocation = memory.allocations;
    EXPECT_THROW(world.update(), std::bad_alloc);
    EXPECT_EQ(world.box(id).lo[0], 5);
    memory.failing_allocation = contract::CountingMemory::never;
    world.update();
    EXPECT_EQ(world.box(id).lo[0], 999);
    EXPECT_EQ(world.stats().commands, 1001u);
}

TEST(Commands, MoreFiltersThanAWorldTellsApartAtAGlance)
{
    // Six hundred objects of three hundred owners in one place; then each owner gets another one's number.
    constexpr std::uint32_t objects = 600;
    for (const bool after_rest : {false, true}) {
        World3f world;
        std::vector<ObjectId> ids;
        const auto owned_by = [](std::uint32_t owner) {
            ObjectFilter filter;
            filter.owner = owner;
            return filter;
        };
        for (std::uint32_t i = 0; i < objects; ++i)
            ids.push_back(world.add(cube(0), {.filter = owned_by(i / 2)}));
        world.update();
        EXPECT_EQ(world.began().size(), objects * (objects - 1) / 2 - objects / 2);
        for (int update = 0; after_rest && update < 12; ++update)
            world.update();
        if (after_rest) {
            EXPECT_EQ(world.stats().resting, objects);
        }
        // The last object joins the owner of one of the first, and leaves its own.
        const std::uint32_t last = objects - 1;
        world.set_filter(ids[last], owned_by(3));
        world.update();
        ASSERT_EQ(world.began().size(), 1u);
        EXPECT_EQ(world.began()[0], (ObjectPair{ids[last - 1], ids[last]}));
        ASSERT_EQ(world.ended().size(), 2u);
        EXPECT_EQ(world.ended()[0], (EndedPair{ids[6], ids[last], jostle::EndReason::filtered}));
        EXPECT_EQ(world.ended()[1], (EndedPair{ids[7], ids[last], jostle::EndReason::filtered}));
        // And moves among those at rest, once it is known to be its owner's.
        world.move(ids[last], {{0.5f, 0, 0}, {1, 1, 1}});
        world.update();
        EXPECT_EQ(world.persisted().size(), objects - 3);
        EXPECT_TRUE(world.began().empty() && world.ended().empty());
        EXPECT_EQ(world.pairs().size(), objects * (objects - 1) / 2 - objects / 2 - 1);
    }
}

/// What is said about one object by one thread, and what the rules make of it: of each property the command
/// with the greatest sequence, of one thread's equal ones the last. Threads never have equal sequences here.
struct Model
{
    static constexpr std::uint32_t threads = 3;

    struct Property
    {
        bool given = false;
        std::uint32_t sequence = 0;
        [[nodiscard]] bool takes(std::uint32_t other) const { return !given || other >= sequence; }
        void set(std::uint32_t other)
        {
            given = true;
            sequence = other;
        }
    };
    struct Queue
    {
        Property place, filter, margin, enabled;
        jostle::Aabb3f box;
        float by = 0;
    } queues[threads];
    Property filter, margin, enabled;
};

TEST(Commands, TheGreatestSequenceWinsPropertyByProperty)
{
    for (const std::uint32_t threads : {1u, Model::threads}) {
        World3f world;
        std::vector<ObjectId> ids(40);
        world.add(std::vector<jostle::Aabb3f>(ids.size(), cube(0)), ids);
        world.update();
        Random random(threads);
        for (int round = 0; round < 150; ++round) {
            std::vector<std::vector<std::function<void()>>> said(threads);
            std::vector<Model> models(ids.size());
            struct Expected
            {
                jostle::Aabb3f box;
                float by = 0, margin = 0;
                ObjectFilter filter;
                bool enabled = true;
            };
            std::vector<Expected> expected(ids.size());
            for (std::size_t i = 0; i < ids.size(); ++i) {
                expected[i] = {world.box(ids[i]), 0, world.margin(ids[i]), world.filter(ids[i]),
                               world.enabled(ids[i])};
                expected[i].by = world.bounds(ids[i]).hi[0] - expected[i].margin - expected[i].box.hi[0];
                for (auto& queue : models[i].queues) {
                    queue.box = expected[i].box;
                    queue.by = expected[i].by;
                }
            }
            for (int k = 0; k < 200; ++k) {
                const std::uint32_t t = random.below(threads), i = random.below(std::uint32_t(ids.size()));
                const std::uint32_t sequence = threads == 1 ? random.below(3) : t + threads * random.below(3);
                const ObjectId id = ids[i];
                Model& model = models[i];
                Model::Queue& queue = model.queues[t];
                const auto say = [&](auto call) { said[t].emplace_back(call); };
                const float at = static_cast<float>(random.below(64));
                switch (random.below(6)) {
                case 0:
                    say([&world, id, at, sequence] { world.move(id, cube(at), sequence); });
                    if (!queue.place.takes(sequence)) break;
                    queue.place.set(sequence);
                    queue.box = cube(at);
                    queue.by = 0;
                    break;
                case 1:
                    say([&world, id, at, sequence] {
                        const float by[3] = {2, 0, 0};
                        world.move(id, cube(at), by, sequence);
                    });
                    if (!queue.place.takes(sequence)) break;
                    queue.place.set(sequence);
                    queue.box = cube(at);
                    queue.by = 2;
                    break;
                case 2: {
                    const float edge = static_cast<float>(1 + random.below(3));
                    say([&world, id, edge, sequence] {
                        const float size[3] = {edge, 1, 1};
                        world.resize(id, size, sequence);
                    });
                    if (!queue.place.takes(sequence)) break;
                    queue.place.set(sequence);
                    const float centre = (queue.box.lo[0] + queue.box.hi[0]) / 2;
                    queue.box.lo[0] = centre - edge / 2;
                    queue.box.hi[0] = centre + edge / 2;
                    break;
                }
                case 3: {
                    ObjectFilter filter;
                    filter.owner = random.below(5);
                    say([&world, id, filter, sequence] { world.set_filter(id, filter, sequence); });
                    if (!model.filter.takes(sequence)) break;
                    model.filter.set(sequence);
                    expected[i].filter = filter;
                    break;
                }
                case 4: {
                    const float margin = static_cast<float>(random.below(4));
                    say([&world, id, margin, sequence] { world.set_margin(id, margin, sequence); });
                    if (!model.margin.takes(sequence)) break;
                    model.margin.set(sequence);
                    expected[i].margin = margin;
                    break;
                }
                default: {
                    const bool on = random.below(2) != 0;
                    say([&world, id, on, sequence] { world.set_enabled(id, on, sequence); });
                    if (!model.enabled.takes(sequence)) break;
                    model.enabled.set(sequence);
                    expected[i].enabled = on;
                }
                }
            }
            std::vector<std::thread> others;
            for (std::uint32_t t = 1; t < threads; ++t)
                others.emplace_back([&, t] {
                    for (const auto& call : said[t])
                        call();
                });
            for (const auto& call : said[0])
                call();
            for (std::thread& other : others)
                other.join();
            world.update();
            for (std::size_t i = 0; i < ids.size(); ++i) {
                const Model::Queue* best = nullptr;
                for (const Model::Queue& queue : models[i].queues)
                    if (queue.place.given && (best == nullptr || queue.place.sequence > best->place.sequence))
                        best = &queue;
                if (best != nullptr) {
                    expected[i].box = best->box;
                    expected[i].by = best->by;
                }
                const auto& e = expected[i];
                const jostle::Aabb3f box = world.box(ids[i]), bounds = world.bounds(ids[i]);
                const std::string where = std::to_string(threads) + " threads, round " +
                                          std::to_string(round) + ", object " + std::to_string(i);
                ASSERT_EQ(box.lo[0], e.box.lo[0]) << where;
                ASSERT_EQ(box.hi[0], e.box.hi[0]) << where;
                ASSERT_EQ(bounds.lo[0], e.box.lo[0] - e.margin) << where;
                ASSERT_EQ(bounds.hi[0], e.box.hi[0] + e.by + e.margin) << where;
                ASSERT_EQ(world.filter(ids[i]), e.filter) << where;
                ASSERT_EQ(world.margin(ids[i]), e.margin) << where;
                ASSERT_EQ(world.enabled(ids[i]), e.enabled) << where;
            }
        }
    }
}

/// From an end without end an endless way the other way leads to no number: that end stays.
TEST(Commands, AnEndlessWayOfAnEndlessBoxReachesAll)
{
    constexpr float endless = std::numeric_limits<float>::infinity();
    World3f world;
    const ObjectId a = world.add(cube(0));
    world.add({{-9, 0, 0}, {-8, 1, 1}});
    world.add({{8, 0, 0}, {9, 1, 1}});
    world.move(a, cube(0), {endless, 0, 0});
    world.resize(a, {endless, 1, 1});
    world.update();
    EXPECT_EQ(world.bounds(a).lo[0], -endless);
    EXPECT_EQ(world.bounds(a).hi[0], endless);
    EXPECT_EQ(world.began().size(), 2u);
    World3f other;
    other.restore(world.save());
    EXPECT_EQ(other.save(), world.save());
}

} // namespace
} // namespace world_tests
