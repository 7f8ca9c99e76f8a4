// SPDX-License-Identifier: MIT
// Objects that stop together wait beside each other until they come to rest: what updates say meanwhile, and
// after some of them have gone on, is what they say of any others.
#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "churn.hpp"
#include "questions.hpp"

namespace world_tests {
namespace {

/// How many commands come in an update while most objects wait.
constexpr int few[] = {0, 1, 1, 2, 5, 8, 9, 40, 90};

template <int Dim, class T>
void stop_and_go(std::uint64_t seed, double extent, bool callback, bool giants)
{
    Churn<Dim, T> churn(seed, extent, callback);
    churn.giants = giants;
    constexpr std::size_t objects = 2'600;
    std::uint64_t waited = 0, results = 0, refused = 0;
    while (churn.twin.things.size() < objects)
        churn.operate(objects);
    for (int round = 0; round < 6; ++round) {
        const int updates = round % 3 == 2 ? 24 : 7; // some have come to rest, or none
        for (int update = 0; update < updates; ++update) {
            // Most move, then few change.
            const int commands = update == 0 ? 1000 : few[churn.random.below(std::size(few))];
            for (int k = 0; k < commands; ++k)
                churn.operate(objects);
            for (int k = 0; update == 0 && k < 8000; ++k)
                churn.move();
            if (callback && churn.random.below(3) == 0) {
                const std::vector<std::byte> before = churn.world->save();
                churn.questions_until_refusal = churn.random.below(3);
                churn.asked = 0;
                try {
                    churn.world->update();
                    churn.questions_until_refusal = Churn<Dim, T>::never;
                    ASSERT_TRUE(churn.follow(false)) << "round " << round << ", update " << update;
                    continue;
                } catch (const Refusal&) {
                    ++refused;
                    churn.questions_until_refusal = Churn<Dim, T>::never;
                    ASSERT_EQ(churn.world->save(), before) << "round " << round << ", update " << update;
                }
            }
            ASSERT_TRUE(churn.update(update % 4 == 1)) << "round " << round << ", update " << update;
            const jostle::WorldStats& stats = churn.world->stats();
            waited += stats.active > 1024 && stats.changed < 64 && stats.active + stats.settled > 1500;
            if (update % 4 != 2) continue;
            Questions<Dim, T> questions(churn, static_cast<std::uint64_t>(round));
            ASSERT_TRUE(questions.agree()) << "round " << round << ", update " << update;
            results += questions.results;
        }
    }
    EXPECT_GT(waited, 5u);
    EXPECT_GT(results, 1000u);
    EXPECT_GT(churn.persisted, 1000u);
    if (callback) {
        EXPECT_GT(refused, 2u);
    }
}

TEST(Parked, WhoStopsAndGoesOnMeetsTheSame)
{
    stop_and_go<3, float>(1, 12, false, false);
    stop_and_go<2, double>(2, 60, false, true);
}

TEST(Parked, AlsoWhereSomebodyIsAskedAndFails)
{
    stop_and_go<3, double>(3, 16, true, false);
    stop_and_go<2, float>(4, 60, true, false);
}

TEST(Parked, ASnapshotKnowsWhoseTurnComesWhen)
{
    Churn<3, float> churn(5, 14, false);
    churn.giants = false;
    constexpr std::size_t objects = 3'000;
    while (churn.twin.things.size() < objects)
        churn.operate(objects);
    for (int update = 0; update < 40; ++update) {
        const int commands = update % 20 == 0 ? 6000 : few[churn.random.below(std::size(few))];
        for (int k = 0; k < commands; ++k)
            churn.operate(objects);
        ASSERT_TRUE(churn.update(false)) << update;
        const std::vector<std::byte> saved = churn.world->save();
        for (const auto& other : churn.beside) {
            other->update();
            ASSERT_TRUE(agree(*other, churn.twin, false)) << update;
            ASSERT_EQ(other->stats().settled, churn.world->stats().settled) << update;
            ASSERT_EQ(other->save(), saved) << update;
        }
        if (update % 5 == 3) {
            churn.beside.clear();
            churn.beside.push_back(std::make_unique<jostle::World3f>(churn.world->fork()));
            ASSERT_EQ(churn.beside.back()->save(), saved) << update;
        }
    }
}

/// Boxes in rows of `width`, none of which touch.
std::vector<jostle::Aabb3f> side_by_side(std::size_t count, std::size_t width)
{
    std::vector<jostle::Aabb3f> boxes;
    for (std::size_t i = 0; i < count; ++i) {
        const auto x = static_cast<float>(i % width), y = static_cast<float>(i / width);
        boxes.push_back({{x, y, 0}, {x + 0.5f, y + 0.5f, 1}});
    }
    return boxes;
}

/// Who hasn't changed for three updates comes to rest; of many no more at once than have changed, or 32, and
/// none while more than 32 and one in 16 of those that rest or might change. New objects come to rest with
/// their second update, all of them. Of those that rest and move, some may go on resting.
TEST(Parked, WhoStaysForLongEnoughComesToRest)
{
    Random random(17);
    for (const std::size_t objects : {std::size_t{1}, std::size_t{2}, std::size_t{40}, std::size_t{900}}) {
        jostle::World3f world;
        std::vector<ObjectId> ids(objects);
        std::vector<jostle::Aabb3f> boxes = side_by_side(objects, 30);
        world.add(boxes, ids);
        world.update();
        std::vector<int> idle(objects, 2);      // 3: it rests, or would as soon as there is room
        std::vector<char> may_rest(objects, 0); // though it has moved
        std::uint64_t added = objects;          // in the update before
        std::uint64_t resting = 0, settled = 0;
        for (int update = 0; update < 600; ++update) {
            SCOPED_TRACE(testing::Message() << objects << " objects, update " << update);
            const std::uint32_t kind = random.below(8); // all move, some do, none does
            std::uint64_t changed = 0, due = 0, moved = 0, waiting = 0, stirring = 0;
            for (std::size_t i = 0; i < objects; ++i) {
                const bool moves = kind < 2 || (kind < 5 && random.below(3) == 0);
                waiting += idle[i] >= 2 ? 1 : 0;
                stirring += idle[i] >= 2 && moves ? 1 : 0;
                if (moves) {
                    boxes[i].lo[2] += 0.125f, boxes[i].hi[2] += 0.125f;
                    world.move(ids[i], boxes[i]);
                    ++changed;
                }
                if (moves) may_rest[i] = idle[i] == 3;
                idle[i] = moves ? 0 : std::min(idle[i] + 1, 3);
                due += idle[i] == 3 ? 1 : 0;
                moved += idle[i] != 3 && may_rest[i] ? 1 : 0;
            }
            world.update();
            const jostle::WorldStats& stats = world.stats();
            const std::uint64_t most = std::max<std::uint64_t>(32, changed) + std::exchange(added, 0);
            ASSERT_EQ(stats.changed, changed);
            ASSERT_LE(stats.settled, most);
            ASSERT_LE(stats.resting, due + moved);
            const bool restless = stirring > 32 && 16 * stirring > waiting;
            if (!restless && (objects <= 32 || stats.settled < most)) { // there was room for all
                ASSERT_GE(stats.resting, due);
            }
            ASSERT_EQ(stats.resting + stats.active, objects);
            settled += stats.settled;
            resting += stats.resting;
        }
        EXPECT_GT(settled, 30u);
        EXPECT_GT(resting, 60u);
    }
}

/// Others of many change in each update: soon all are active, and none wakes up. Once only a few do, or the
/// same ones, the others come to rest.
TEST(Parked, WhereManyStirNobodyComesToRest)
{
    constexpr std::size_t objects = 1000;
    jostle::World3f world;
    std::vector<ObjectId> ids(objects);
    std::vector<jostle::Aabb3f> boxes = side_by_side(objects, 50);
    world.add(boxes, ids);
    world.update();
    world.update();
    ASSERT_EQ(world.stats().resting, objects);
    Random random(18);
    const auto move = [&](std::size_t i) {
        boxes[i].lo[2] += 0.125f, boxes[i].hi[2] += 0.125f;
        world.move(ids[i], boxes[i]);
    };
    const auto stir = [&] {
        std::uint64_t woken = 0, settled = 0;
        for (int update = 0; update < 60; ++update) {
            for (std::size_t i = 0; i < objects; ++i)
                if (random.below(8) == 0) move(i);
            world.update();
            if (update < 40) continue;
            woken += world.stats().woken;
            settled += world.stats().settled;
        }
        EXPECT_LE(woken, 20u); // those that hadn't changed in 40 updates
        EXPECT_EQ(settled, 0u);
        EXPECT_GT(world.stats().active, objects - 20);
    };
    stir();
    for (int update = 0; update < 30; ++update) {
        for (std::size_t i = 0; i < objects / 4; ++i)
            move(i);
        world.update();
    }
    EXPECT_EQ(world.stats().active, objects / 4);
    stir();
    for (int update = 0; update < 60; ++update) {
        for (int k = 0; k < 48; ++k)
            move(random.below(objects));
        world.update();
    }
    EXPECT_GT(world.stats().resting, 3 * objects / 4);
    stir();
    for (std::size_t next = 0; next < 60 * 45;) { // in turns: who has waited longest is next
        for (int k = 0; k < 45; ++k)
            move(next++ % objects);
        world.update();
    }
    EXPECT_GT(world.stats().resting, 9 * objects / 10);
}

/// All move in every third update, and nobody or one of them in between: they stay active. Once they have
/// waited for three updates they come to rest.
TEST(Parked, WhoMovesInEveryThirdUpdateStaysActive)
{
    constexpr std::size_t objects = 2'000;
    for (const bool one_moves : {false, true}) {
        jostle::World3f world;
        std::vector<ObjectId> ids(objects);
        std::vector<jostle::Aabb3f> boxes = side_by_side(objects, 50);
        world.add(boxes, ids);
        const auto update = [&](bool all_move) {
            for (std::size_t i = 0; i < objects; ++i) {
                if (!all_move && !(one_moves && i == 0)) continue;
                boxes[i].lo[2] += 0.125f, boxes[i].hi[2] += 0.125f;
                world.move(ids[i], boxes[i]);
            }
            world.update();
        };
        for (int k = 0; k < 60; ++k) {
            update(k % 3 == 0);
            if (k < 8) continue; // those that were added came to rest
            ASSERT_EQ(world.stats().woken, 0u) << "update " << k;
            ASSERT_EQ(world.stats().settled, 0u) << "update " << k;
        }
        EXPECT_EQ(world.stats().active, objects);
        std::uint64_t settled = 0;
        for (int k = 0; k < 3; ++k) {
            update(false);
            settled += world.stats().settled;
        }
        EXPECT_GE(settled, 64u);
        EXPECT_LT(settled, 200u); // little by little
    }
}

TEST(Parked, NoSmallUpdatePaysForABigOne)
{
    constexpr std::size_t objects = 12'000;
    jostle::World3f world;
    std::vector<ObjectId> ids(objects);
    std::vector<jostle::Aabb3f> boxes = side_by_side(objects, 100);
    world.add(boxes, ids);
    world.update();
    for (jostle::Aabb3f& box : boxes)
        box.lo[2] += 1, box.hi[2] += 1;
    world.update(ids, boxes); // they are no longer new
    std::uint64_t updates = 0;
    for (; world.stats().active > 1; ++updates) {
        ASSERT_LT(updates, 500u);
        world.remove(world.add({{0.25f, 0.25f, 0}, {0.75f, 0.75f, 1}}));
        const ObjectId other = world.add({{200, 0, 0}, {201, 1, 1}});
        world.update();
        world.remove(other);
        EXPECT_LE(world.stats().settled, 36u);
        EXPECT_LE(world.stats().changed, 3u);
    }
    EXPECT_GT(updates, 40u);
    // New ones don't wait, so that the index isn't filled little by little.
    std::vector<ObjectId> more(objects);
    world.add(side_by_side(objects, 60), more);
    world.update();
    world.update();
    EXPECT_EQ(world.stats().settled, objects);
    for (const ObjectId id : more)
        world.remove(id);
    // Those that have gone on meanwhile rest last.
    for (jostle::Aabb3f& box : boxes)
        box.lo[2] += 1, box.hi[2] += 1;
    world.update(ids, boxes);
    world.update();
    ASSERT_GT(world.stats().active, 10'000u);
    boxes[0].lo[0] -= 1;
    world.move(ids[0], boxes[0]);
    while (world.stats().active > 1) {
        world.update();
        boxes[0].lo[0] -= 1;
        world.move(ids[0], boxes[0]);
    }
    EXPECT_EQ(world.stats().resting, objects - 1);
}

TEST(Parked, WhoStopsAndGoesOnForEverTakesNoMoreMemory)
{
    constexpr std::size_t objects = 2'000;
    jostle::World3f world;
    std::vector<ObjectId> ids(objects);
    std::vector<jostle::Aabb3f> boxes = side_by_side(objects, 50);
    world.add(boxes, ids);
    world.update(); // then they are no longer new
    std::uint64_t early = 0;
    for (int round = 0; round < 80; ++round) {
        for (jostle::Aabb3f& box : boxes)
            box.lo[2] += 0.125f, box.hi[2] += 0.125f;
        world.update(ids, boxes);
        for (int update = 0; update < 3; ++update)
            world.update();
        EXPECT_GT(world.stats().active, 1'000u);
        if (round == 20) early = world.stats().bytes_reserved;
    }
    EXPECT_LE(world.stats().bytes_reserved, early + early / 8);
}

} // namespace
} // namespace world_tests
