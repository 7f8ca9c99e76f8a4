// SPDX-License-Identifier: MIT
// Every pair and item once, on any threads; and exceptions of callbacks.
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <mutex>
#include <span>
#include <stdexcept>
#include <thread>

#include "executors.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/process.hpp"

namespace {

using jostle::Pair;
using jostle::PairBatch;
using jostle::ProcessOptions;
using jostle::Work;
using process_test::all_executors;

ProcessOptions with(jostle::Executor& executor, std::uint64_t block_items = 0)
{
    ProcessOptions options;
    options.executor = &executor;
    options.block_items = block_items;
    return options;
}

/// Boxes that give `wanted` pairs or so, in a buffer of many runs.
jostle::PairBuffer some_pairs(int boxes)
{
    std::vector<jostle::Aabb3f> all;
    for (int i = 0; i < boxes; ++i) {
        const float x = float(i % 19), y = float(i / 19 % 19), z = float(i / 361);
        all.push_back({{x, y, z}, {x + 1, y + 1, z + 1}});
    }
    return jostle::find_pairs(all);
}

TEST(ProcessItems, EveryItemOnceInBlocksThatDependOnTheItemsAlone)
{
    for (const std::uint64_t items : {0u, 1u, 7u, 8u, 9u, 1000u, 5000u, 300'000u})
        for (const std::uint64_t block : {0u, 1u, 3u, 1'000'000u}) {
            std::vector<std::pair<std::uint64_t, std::uint64_t>> expected; // by block, from the serial run
            for (const auto& [name, executor] : all_executors()) {
                const jostle::WorkPlan plan = jostle::plan_work(items, with(*executor, block));
                ASSERT_EQ(plan.items, items);
                std::vector<std::pair<std::uint64_t, std::uint64_t>> found(plan.blocks);
                std::atomic<int> calls = 0, bad = 0;
                jostle::process_items(
                    items,
                    [&](std::uint64_t begin, std::uint64_t end, Work work) {
                        ++calls;
                        if (work.slot >= plan.slots || work.block >= plan.blocks || begin >= end)
                            ++bad;
                        else
                            found[work.block] = {begin, end};
                    },
                    with(*executor, block));
                ASSERT_EQ(bad, 0) << name;
                ASSERT_EQ(calls, static_cast<int>(plan.blocks)) << name;
                std::uint64_t next = 0;
                for (const auto& [begin, end] : found) {
                    ASSERT_EQ(begin, next) << name;
                    next = end;
                }
                ASSERT_EQ(next, items) << name;
                if (executor.get() == &jostle::serial_executor()) expected = found;
                ASSERT_EQ(found, expected) << name;
            }
        }
}

TEST(ProcessItems, PlansOfHugeWork)
{
    constexpr std::uint64_t most = ~std::uint64_t{0};
    const ProcessOptions options = with(jostle::serial_executor(), 1);
    for (const std::uint64_t items : {most, most - 1, std::uint64_t{1} << 32, (std::uint64_t{1} << 32) - 1}) {
        const jostle::WorkPlan plan = jostle::plan_work(items, options);
        EXPECT_GE(plan.block_items * (plan.blocks - 1), items - plan.block_items);
        EXPECT_LT(plan.block_items * (plan.blocks - 1), items);
    }
    EXPECT_EQ(jostle::plan_work(10, with(jostle::serial_executor(), most)).blocks, 1u);
}

TEST(ProcessItems, BlocksAreNumberedFromWhereTheyAreToldTo)
{
    ProcessOptions options = with(jostle::serial_executor(), 10);
    options.first_block = 7;
    std::vector<std::uint32_t> blocks;
    jostle::process_items(
        25, [&](std::uint64_t, std::uint64_t, Work work) { blocks.push_back(work.block); }, options);
    EXPECT_EQ(blocks, (std::vector<std::uint32_t>{7, 8, 9}));

    const jostle::WorkPlan plan = jostle::plan_work(25, options);
    const jostle::WorkPlan both = jostle::plan_both(plan, jostle::plan_work(11, options));
    EXPECT_EQ(both.items, 36u);
    EXPECT_EQ(both.blocks, 5u);
    EXPECT_EQ(both.slots, 1u);
    jostle::WorkPlan wide = plan;
    wide.slots = 3;
    EXPECT_EQ(jostle::plan_both(plan, wide).slots, 3u);
    EXPECT_EQ(jostle::plan_both(wide, plan).slots, 3u);
    jostle::WorkPlan most = plan;
    most.blocks = ~0u - 2;
    EXPECT_THROW((void)jostle::plan_both(most, plan), jostle::Error);
    options.first_block = ~0u - 2;
    EXPECT_THROW((void)jostle::plan_work(25, options), jostle::Error);
    EXPECT_EQ(jostle::plan_work(20, options).blocks, 2u);
}

TEST(ProcessItems, TwoTasksNeverShareASlot)
{
    const auto executor = jostle::make_thread_executor(7);
    std::vector<std::atomic<int>> inside(7);
    std::atomic<int> shared = 0;
    jostle::process_items(
        2'000,
        [&](std::uint64_t, std::uint64_t, Work work) {
            if (++inside[work.slot] != 1) ++shared;
            std::this_thread::yield();
            --inside[work.slot];
        },
        with(*executor, 1));
    EXPECT_EQ(shared, 0);
}

TEST(ProcessPairs, EveryPairOnceInItsPlace)
{
    for (const int boxes : {0, 1, 2, 9, 400, 4'000}) {
        const jostle::PairBuffer buffer = some_pairs(boxes);
        const std::vector<Pair> pairs = buffer.to_vector();
        for (const auto& [name, executor] : all_executors())
            for (const std::uint64_t block : {0u, 1u, 100u}) {
                const ProcessOptions options = with(*executor, block);
                const jostle::WorkPlan plan = jostle::plan_work(pairs.size(), options);
                for (const bool from_span : {false, true}) {
                    std::vector<Pair> placed(pairs.size());
                    std::vector<std::uint64_t> next_in(plan.blocks);
                    std::atomic<std::uint64_t> taken = 0, misplaced = 0;
                    const auto take = [&](const PairBatch& batch) {
                        taken += batch.items.size();
                        const std::uint64_t begin = batch.work.block * plan.block_items;
                        // Batches of a block follow one another.
                        if (batch.first != begin + next_in[batch.work.block] ||
                            batch.first + batch.items.size() > begin + plan.block_items)
                            ++misplaced;
                        next_in[batch.work.block] += batch.items.size();
                        std::copy(batch.items.begin(), batch.items.end(), placed.begin() + long(batch.first));
                    };
                    if (from_span)
                        jostle::process_pairs(pairs, take, options);
                    else
                        jostle::process_pairs(buffer, take, options);
                    ASSERT_EQ(taken, pairs.size()) << name;
                    ASSERT_EQ(misplaced, 0u) << name;
                    ASSERT_EQ(placed, pairs) << name;
                }
                std::atomic<std::uint64_t> sum = 0;
                jostle::process_pairs(
                    buffer,
                    [&](const Pair& pair, Work work) {
                        sum += work.block < plan.blocks ? jostle::pair_checksum(std::span(&pair, 1)) : 1;
                    },
                    options);
                ASSERT_EQ(sum, jostle::pair_checksum(pairs)) << name;
            }
    }
}

TEST(ProcessPairs, TakesWhatNeedsThePairAlone)
{
    const jostle::PairBuffer pairs = some_pairs(500);
    std::atomic<std::uint64_t> sum = 0, expected = 0;
    jostle::process_pairs(pairs, [&](const Pair& pair) { sum += pair.a + 3ull * pair.b; });
    for (const Pair& pair : pairs)
        expected += pair.a + 3ull * pair.b;
    EXPECT_EQ(sum, expected);
    EXPECT_GT(sum, 0u);
}

TEST(Process, TheLowestBlocksExceptionLeavesTheCall)
{
    for (const auto& [name, executor] : all_executors()) {
        for (int repeat = 0; repeat < 20; ++repeat) {
            std::atomic<std::uint64_t> below = 0;
            try {
                jostle::process_items(
                    1'000,
                    [&](std::uint64_t begin, std::uint64_t, Work work) {
                        if (begin < 137) ++below;
                        if (begin >= 137) throw std::runtime_error(std::to_string(work.block));
                    },
                    with(*executor, 1));
                FAIL() << name;
            } catch (const std::runtime_error& error) {
                ASSERT_STREQ(error.what(), "137") << name;
                ASSERT_EQ(below, 137u) << name;
            }
        }
    }
}

/// Two threads, which knows how many tasks have come to their end.
class TwoThreads final : public jostle::Executor
{
  public:
    std::atomic<std::uint32_t> ended{0};

    std::uint32_t concurrency() const noexcept override { return 2; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        std::vector<std::thread> threads;
        for (std::uint32_t i = 0; i < count; ++i)
            threads.emplace_back([=, this] {
                task(i);
                ++ended;
            });
        for (std::thread& thread : threads)
            thread.join();
    }
};

TEST(Process, OfTwoExceptionsTheLowerBlocksLeavesWhicheverWasFirst)
{
    for (const std::uint32_t first_to_throw : {0u, 1u}) {
        TwoThreads executor;
        std::atomic<int> inside = 0;
        // Both blocks are at work before one throws; the other waits for the end of that one's task.
        const auto fail = [&](std::uint32_t block) {
            ++inside;
            while (inside != 2)
                std::this_thread::yield();
            while (block != first_to_throw && executor.ended == 0)
                std::this_thread::yield();
            throw block;
        };
        std::uint32_t thrown = ~0u;
        try {
            jostle::process_items(
                2, [&](std::uint64_t, std::uint64_t, Work work) { fail(work.block); }, with(executor, 1));
        } catch (std::uint32_t block) {
            thrown = block;
        }
        EXPECT_EQ(thrown, 0u) << "block " << first_to_throw << " threw first";
    }
}

TEST(Process, WorkGoesOnAfterAnException)
{
    const jostle::PairBuffer pairs = some_pairs(500);
    const auto executor = jostle::make_thread_executor(3);
    for (int repeat = 0; repeat < 50; ++repeat) {
        EXPECT_THROW(
            jostle::process_pairs(pairs, [](const PairBatch&) { throw 1; }, with(*executor, 5)), int);
        std::atomic<std::uint64_t> count = 0;
        jostle::process_pairs(
            pairs, [&](const PairBatch& batch) { count += batch.items.size(); }, with(*executor, 5));
        ASSERT_EQ(count, pairs.size());
    }
}

} // namespace
