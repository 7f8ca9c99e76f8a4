// SPDX-License-Identifier: MIT
// Resting objects that change once move without waking up: what updates and questions say is what they say of
// any others, and only who changes again and again becomes active.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <vector>

#include "churn.hpp"
#include "questions.hpp"
#include "snapshots.hpp"

namespace world_tests {
namespace {

/// Boxes in a row, a gap of 1 between them, that have come to rest.
struct Row
{
    jostle::World3f world;
    std::vector<ObjectId> ids;

    explicit Row(int count)
    {
        for (int i = 0; i < count; ++i)
            ids.push_back(world.add(at(static_cast<float>(2 * i))));
        while (world.update(), world.stats().active != 0) {
        }
    }
    static jostle::Aabb3f at(float x) { return {{x, 0, 0}, {x + 1, 1, 1}}; }
    void update(std::initializer_list<std::pair<int, float>> moves = {})
    {
        for (const auto& [which, x] : moves)
            world.move(ids[static_cast<std::size_t>(which)], at(x));
        world.update();
    }
};

TEST(Shifted, WhoMovesOnceGoesOnResting)
{
    Row row(100);
    const jostle::WorldStats& stats = row.world.stats();
    for (int round = 0; round < 5; ++round) {
        row.update({{0, 7.0f}}); // onto 3 and 4
        EXPECT_EQ(stats.woken, 0u);
        EXPECT_EQ(stats.active, 0u);
        EXPECT_EQ(stats.began, 2u);
        std::vector<ObjectId> touched;
        row.world.touching(row.ids[0], touched);
        EXPECT_EQ(touched, (std::vector<ObjectId>{row.ids[3], row.ids[4]}));
        row.update();
        row.update();
        row.update({{3, -4.0f}}); // from under it
        EXPECT_EQ(stats.woken, 0u);
        EXPECT_EQ(stats.ended, 1u);
        row.update();
        row.update({{4, -8.0f}, {5, -8.5f}}); // onto each other
        EXPECT_EQ(stats.woken, 0u);
        EXPECT_EQ(stats.began, 1u);
        EXPECT_EQ(stats.ended, 1u);
        row.update();
        row.update();
        row.update({{0, 0.0f}, {3, 6.0f}, {4, 8.0f}, {5, 10.0f}});
        EXPECT_EQ(stats.woken, 0u);
        EXPECT_EQ(stats.ended, 1u);
        EXPECT_TRUE(row.world.pairs().empty());
        row.update();
        row.update();
    }
}

TEST(Shifted, WhoMovesAgainBecomesActive)
{
    Row row(100);
    const jostle::WorldStats& stats = row.world.stats();
    for (int update = 0; update < 12; ++update) { // in every other one
        row.update({{0, update % 2 == 0 ? 101.0f : 0.0f}});
        EXPECT_EQ(stats.woken, update == 1 ? 1u : 0u);
        EXPECT_EQ(stats.active, update == 0 ? 0u : 1u);
        EXPECT_EQ(stats.began + stats.ended, 2u);
        row.update();
        EXPECT_EQ(stats.active, update == 0 ? 0u : 1u);
    }
    Row next(100);
    next.update({{0, 101.0f}});
    next.update({{0, 0.0f}});
    EXPECT_EQ(next.world.stats().woken, 1u);
    EXPECT_EQ(next.world.stats().ended, 2u);
}

TEST(Shifted, ManyAtOnceWakeUp)
{
    Row row(160);
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 11; ++i)
        boxes.push_back(Row::at(static_cast<float>(2 * i) + 0.5f));
    row.world.update(std::span(row.ids).first(10), std::span<const jostle::Aabb3f>(boxes).first(10));
    EXPECT_EQ(row.world.stats().woken, 0u);
    Row other(160);
    other.world.update(std::span(other.ids).first(11), std::span<const jostle::Aabb3f>(boxes));
    EXPECT_EQ(other.world.stats().woken, 11u);
}

/// Few commands of all kinds among many that rest.
template <int Dim, class T>
void change_few(std::uint64_t seed, double extent, bool callback, jostle::WorldOptions options = {})
{
    Churn<Dim, T> churn(seed, extent, callback, options);
    constexpr std::size_t objects = 1'000;
    while (churn.twin.things.size() < objects)
        churn.operate(objects);
    std::uint64_t stayed = 0, woken = 0, results = 0;
    for (int update = 0; update < 150; ++update) {
        for (std::uint32_t k = churn.random.below(12); k > 0 && update > 10; --k)
            churn.operate(objects);
        const std::uint64_t active = churn.world->stats().active;
        ASSERT_TRUE(churn.update(update % 16 == 15)) << "update " << update;
        const jostle::WorldStats& stats = churn.world->stats();
        woken += stats.woken;
        if (stats.changed > stats.woken + active) stayed += stats.changed - stats.woken - active;
        if (update % 8 != 5) continue;
        Questions<Dim, T> questions(churn, static_cast<std::uint64_t>(update));
        ASSERT_TRUE(questions.agree()) << "update " << update;
        results += questions.results;
    }
    EXPECT_GT(stayed, 50u);
    EXPECT_GT(woken, 10u);
    EXPECT_GT(results, 1000u);
    EXPECT_GT(churn.persisted, 100u);
}

TEST(Shifted, MeetsTheSame)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    change_few<3, float>(1, 12, false);
    change_few<2, double>(2, 40, true, {.margin = 0.125});
    change_few<3, double>(3, 12, true, {.executor = threads.get()});
    change_few<2, float>(4, 40, false, {});
}

/// Objects that move again and again among others that keep lists of what rests near them.
TEST(Shifted, WhoPassesByMeetsThemWhereTheyAre)
{
    Random random(5);
    jostle::World3f world;
    std::vector<ObjectId> ids;
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 1'500; ++i) {
        boxes.push_back(random_box<3, float>(random, 14, false));
        ids.push_back(world.add(boxes.back()));
    }
    constexpr std::size_t passing = 40;
    std::uint64_t listed = 0, stayed = 0;
    std::set<Pair> told; // by what begins and ends
    for (int update = 0; update < 120; ++update) {
        const auto move = [&](std::size_t i, double by) {
            for (std::size_t d = 0; d < 3; ++d) {
                const auto step = static_cast<float>(by * random.uniform(0.5, 1));
                boxes[i].lo[d] += step, boxes[i].hi[d] += step;
            }
            world.move(ids[i], boxes[i]);
        };
        for (std::size_t i = 0; i < passing; ++i)
            move(i, update % 40 < 20 ? 0.02 : -0.02);
        for (int k = 0; k < 40 && update > 10 && update % 4 == 0; ++k)
            move(passing + random.below(1'500 - passing), random.uniform(-1, 1));
        world.update();
        listed += world.stats().listed;
        if (update > 40) stayed += world.stats().changed - passing - world.stats().woken;
        std::vector<Pair> pairs;
        for (std::uint32_t a = 0; a < boxes.size(); ++a)
            for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
                if (jostle::overlaps(boxes[a], boxes[b])) pairs.push_back({a, b});
        for (const jostle::EndedPair& each : world.ended())
            ASSERT_EQ(told.erase({each.a.index, each.b.index}), 1u) << update;
        for (const ObjectPair& each : world.began())
            ASSERT_TRUE(told.insert({each.a.index, each.b.index}).second) << update;
        ASSERT_TRUE(std::equal(told.begin(), told.end(), pairs.begin(), pairs.end())) << update;
        ASSERT_EQ(world.pairs().to_vector(), pairs) << update;
        std::vector<Pair> began;
        for (const ObjectPair& each : world.began())
            began.push_back({each.a.index, each.b.index});
        ASSERT_EQ(world.began_pairs().to_vector(), began) << update;
        const std::vector<Pair> changed = world.changed_pairs().to_vector();
        ASSERT_TRUE(std::includes(pairs.begin(), pairs.end(), changed.begin(), changed.end())) << update;
    }
    EXPECT_GT(listed, 100u);
    EXPECT_GT(stayed, 500u);
}

// Snapshots have which of them moved recently; otherwise restored worlds would continue differently.
TEST(Shifted, SnapshotsKnowThem)
{
    Churn<3, float> churn(6, 12, false);
    constexpr std::size_t objects = 800;
    while (churn.twin.things.size() < objects)
        churn.operate(objects);
    for (int update = 0; update < 8; ++update)
        ASSERT_TRUE(churn.update(false));
    (void)churn.world->save_base();
    std::vector<std::byte> changes, gone_back;
    std::uint64_t woken = 0;
    for (int update = 0; update < 80; ++update) {
        for (std::uint32_t k = churn.random.below(8); k > 0; --k)
            churn.operate(objects);
        ASSERT_TRUE(churn.update(false)) << update;
        const std::vector<std::byte> saved = churn.world->save();
        for (const auto& other : churn.beside) {
            other->update();
            ASSERT_TRUE(agree(*other, churn.twin, false)) << update;
            ASSERT_EQ(other->stats().woken, churn.world->stats().woken) << update;
            ASSERT_EQ(other->save(), saved) << update;
        }
        woken += churn.beside.empty() ? 0 : churn.world->stats().woken;
        if (update % 5 == 3) {
            churn.beside.clear();
            churn.beside.push_back(std::make_unique<jostle::World3f>(churn.world->fork()));
        }
        churn.world->save_changes(changes);
        if (update % 4 == 0) gone_back = changes;
        churn.world->restore_changes(gone_back);
        churn.world->restore_changes(changes);
        ASSERT_EQ(churn.world->save(), saved) << update;
    }
    EXPECT_GT(woken, 5u);
}

// Who is said to have moved where it rests must rest, and not for longer than that counts.
TEST(Shifted, ImpossibleOnesAreRefused)
{
    Row row(100);
    row.update({{7, 3.25f}});
    std::vector<std::byte> saved = row.world.save();
    // The list is in front of the refused pairs, of which there is none (8 bytes): index and number.
    const std::size_t at = saved.size() - 8 - 8;
    ASSERT_EQ(std::to_integer<int>(saved[at]), 7);
    ASSERT_EQ(std::to_integer<int>(saved[at + 4]), 0);
    jostle::World3f other;
    const auto refuses = [&](std::size_t byte, int value) {
        std::vector<std::byte> bad = saved;
        bad[byte] = static_cast<std::byte>(value);
        seal(bad);
        try {
            other.restore(bad);
            return false;
        } catch (const jostle::Error& error) {
            return std::string(error.what()).find("doesn't fit") != std::string::npos;
        }
    };
    EXPECT_TRUE(refuses(at + 4, 2)); // too long ago
    EXPECT_TRUE(refuses(at, 100));   // nobody
    EXPECT_FALSE(refuses(at + 4, 1));
    EXPECT_FALSE(refuses(at, 8));
}

} // namespace
} // namespace world_tests
