// SPDX-License-Identifier: MIT
#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "tool/threads.hpp"

namespace {

// Seven threads at the same time on a machine of any size: each task waits until all have begun.
TEST(Threads, RunsAsManyAsAskedForWhateverTheMachineHas)
{
    for (const std::uint32_t count : {1u, 2u, 7u}) {
        const jostle_tool::Threads threads(count);
        EXPECT_EQ(threads.count(), count);
        ASSERT_EQ(threads.executor().concurrency(), count);
        std::atomic<std::uint32_t> begun{0};
        threads.executor().run(count, [&](std::uint32_t) {
            ++begun;
            const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
            while (begun < count && std::chrono::steady_clock::now() < patience)
                std::this_thread::yield();
            EXPECT_EQ(begun, count);
        });
    }
}

TEST(Threads, TakesOnePerCoreIfNotTold)
{
    EXPECT_EQ(jostle_tool::Threads().count(), jostle::default_executor().concurrency());
}

} // namespace
