// SPDX-License-Identifier: MIT
// Every rung of bench/ladder against brute force, and every way to add up responses against a plain loop.
#include "bench/ladder/ladder.hpp"

#include <gtest/gtest.h>

#include "bench/ladder/responses.hpp"
#include "scene.hpp"
#include "tool/scenes/scenes.hpp"

using namespace jostle;
using namespace chapter_test;

namespace {

constexpr std::uint32_t all = ~0u;

void check_all(std::span<const Aabb3f> boxes, Executor& executor)
{
    const std::vector<Pair> truth = find_pairs_brute_force(boxes);
    for (const jostle_ladder::RungInfo& info : jostle_ladder::ladder()) {
        const auto rung = info.make(all);
        for (int frame = 0; frame < 2; ++frame) { // what a frame leaves behind doesn't show in the next
            rung->find(boxes, executor);
            const std::vector<Pair> found = sorted(rung->pairs());
            if (info.exact) {
                ASSERT_EQ(found, truth) << info.name;
            } else {
                for (const Pair& pair : found)
                    ASSERT_TRUE(pair.a == pair.b || std::binary_search(truth.begin(), truth.end(), pair))
                        << info.name;
                ASSERT_EQ(std::adjacent_find(found.begin(), found.end()), found.end()) << info.name;
            }
            ASSERT_EQ(rung->counts().searched, boxes.size()) << info.name;
        }
    }
}

TEST(Ladder, EveryRungFindsThePairsOfBruteForce)
{
    const auto two = make_thread_executor(2);
    for (const char* name : {"uniform", "powerlaw", "mixed", "clustered"}) {
        SCOPED_TRACE(name);
        const jostle_scenes::Scene<3, float> scene(name, 1500);
        check_all(scene.boxes(), serial_executor());
        check_all(scene.boxes(), *two);
    }
}

TEST(Ladder, AlsoAroundTheOriginAndOfFewBoxes)
{
    for (const std::uint32_t n : {0u, 1u, 2u, 3u, 400u})
        check_all(mixed_sizes<3, float>(n, 16, 10, n + 1), serial_executor());
    const Boxes<3, float> same(50, {{-1, -1, -1}, {1, 1, 1}});
    check_all(same, serial_executor());
}

TEST(Ladder, SomeSearchWhereAllWouldTakeTooLong)
{
    const Boxes<3, float> boxes = mixed_sizes<3, float>(1000, 4, 12, 1);
    for (const jostle_ladder::RungInfo& info : jostle_ladder::ladder()) {
        const auto rung = info.make(100);
        rung->find(boxes, serial_executor());
        EXPECT_EQ(rung->counts().searched, info.name == "printed" ? 100u : 1000u) << info.name;
    }
}

TEST(Ladder, WaysToAddUpResponsesAgree)
{
    const Boxes<3, float> boxes = mixed_sizes<3, float>(800, 8, 15, 3);
    const std::vector<Pair> pairs = brute(boxes);
    std::vector<jostle_ladder::Push> sums(boxes.size(), 0);
    for (const Pair& pair : pairs) {
        sums[pair.a] += jostle_ladder::push_of(pair.a, pair.b);
        sums[pair.b] += jostle_ladder::push_of(pair.b, pair.a);
    }
    const auto three = make_thread_executor(3);
    for (const jostle_ladder::ResponseInfo& info : jostle_ladder::response_ways()) {
        for (Executor* const executor : {&serial_executor(), three.get()}) {
            const auto way = info.make(static_cast<std::uint32_t>(boxes.size()));
            for (int frame = 0; frame < 2; ++frame)
                EXPECT_EQ(way->sum(pairs, *executor), sums) << info.name;
        }
    }
}

} // namespace
