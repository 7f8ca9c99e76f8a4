// SPDX-License-Identifier: MIT
// Where memory comes from, that it is enough once, and what happens when there is none.
#include <gtest/gtest.h>

#include "counting_memory.hpp"
#include "harness.hpp"
#include "tests/global_new.hpp"

namespace contract {
namespace {

/// Moves every box to and fro, each at its own pace, and back to where it was every `period` frames: after
/// one period a finder has seen all there is to see.
template <int Dim, class T>
Boxes<Dim, T> moved(const Boxes<Dim, T>& boxes, int frame)
{
    constexpr int period = 16;
    Boxes<Dim, T> now = boxes;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const int phase = (frame + static_cast<int>(i % period)) % period;
        const T shift = static_cast<T>(std::min(phase, period - phase)) / 16;
        for (int d = 0; d < Dim; ++d)
            now[i].lo[d] += shift, now[i].hi[d] += shift;
    }
    return now;
}

TEST(Memory, ASteadyFrameAllocatesNothing)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (jostle::Executor* executor : {&jostle::serial_executor(), threads.get()})
        for (const Scene scene :
             {Scene::uniform, Scene::dense, Scene::piles_among_large, Scene::nested_clusters})
            for (const bool streaming : {false, true}) {
                const Boxes<3, float> start = make_scene<3, float>(scene, 20'000, 1);
                CountingMemory memory;
                jostle::FinderOptions options;
                options.executor = executor;
                options.memory = &memory;
                jostle::PairFinder finder(options);
                const auto take = [](const jostle::PairChunk&) { return true; };
                std::uint64_t allocated = 0, news_in_frame = 0;
                for (int frame = 0; frame < 84; ++frame) {
                    const Boxes<3, float> boxes = moved(start, frame);
                    const BoxView<3, float> view(boxes);
                    const std::uint64_t allocations_before = memory.allocations,
                                        news_before = global_new::calls;
                    if (streaming)
                        (void)finder.stream(view, take);
                    else
                        (void)finder.find(view);
                    if (frame < 64) continue;
                    allocated += memory.allocations - allocations_before;
                    news_in_frame += global_new::calls - news_before;
                }
                EXPECT_EQ(allocated, 0u) << name(scene) << (streaming ? " streamed" : " stored");
                EXPECT_EQ(news_in_frame, 0u) << name(scene) << (streaming ? " streamed" : " stored");
                EXPECT_GT(finder.stats().pairs, 1'000u);
            }
}

TEST(Memory, AllComesFromTheResourceAndGoesBack)
{
    CountingMemory memory;
    const Question<3, float> question{make_scene<3, float>(Scene::dense, 3'000, 1)};
    Manner manner;
    manner.options.memory = &memory;
    const std::vector<Pair> expected = ask(question);
    {
        jostle::PairFinder finder(manner.options);
        manner.finder = &finder;
        EXPECT_EQ(ask(question, manner), expected);
        EXPECT_GE(memory.peak, question.a.size() * 16);
        // What sorting takes is kept apart.
        EXPECT_EQ(finder.find(question.a, {}, jostle::Order::sorted).size(), expected.size());
        const std::uint64_t kept = memory.bytes;
        finder.release_memory();
        EXPECT_LT(memory.bytes, kept / 16);
        EXPECT_EQ(ask(question, manner), expected);
    }
    EXPECT_EQ(memory.bytes, 0u);
    EXPECT_EQ(memory.blocks, 0u);
}

TEST(Memory, AFailedAllocationLeavesTheCallAndAUsableFinder)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (jostle::Executor* executor : {&jostle::serial_executor(), threads.get()})
        for (const Scene scene : {Scene::dense, Scene::piles_among_large})
            for (const auto form : {Manner::canonical, Manner::sorted, Manner::streamed}) {
                const Question<3, float> question{make_scene<3, float>(scene, 6'000, 1)};
                CountingMemory memory;
                Manner manner;
                manner.form = form;
                manner.options.executor = executor;
                const std::vector<Pair> expected = ask(question, manner);
                manner.options.memory = &memory;
                std::uint64_t failures = 0;
                for (std::uint64_t k = 0;; ++k) {
                    ASSERT_LT(k, 5'000u);
                    bool failed = false;
                    {
                        memory.allocations = 0;
                        memory.failing_allocation = k;
                        std::unique_ptr<jostle::PairFinder> finder;
                        try {
                            finder = std::make_unique<jostle::PairFinder>(manner.options);
                            manner.finder = finder.get();
                            ASSERT_TRUE(ask(question, manner) == expected);
                        } catch (const std::bad_alloc&) {
                            failed = true;
                            ++failures;
                        }
                        memory.failing_allocation = CountingMemory::never;
                        if (finder != nullptr) {
                            ASSERT_TRUE(ask(question, manner) == expected) << k;
                        }
                    }
                    ASSERT_EQ(memory.bytes, 0u) << "leaked after the failure of allocation " << k;
                    if (!failed) break;
                }
                EXPECT_GT(failures, 3u) << name(scene);
            }
}

TEST(Memory, AMillionBoxesTakeAtMost120BytesEach)
{
    constexpr std::uint64_t n = 1'000'000;
    for (const Scene scene : {Scene::uniform, Scene::dense}) {
        const Boxes<3, float> boxes = make_scene<3, float>(scene, n, 1);
        CountingMemory memory;
        jostle::FinderOptions options;
        options.memory = &memory;
        jostle::PairFinder finder(options);
        const std::uint64_t pairs = finder.find(BoxView<3, float>(boxes)).size();
        EXPECT_GT(pairs, n / 2);
        EXPECT_LE(memory.peak, 120 * n + pairs * sizeof(Pair)) << name(scene) << ", " << pairs << " pairs";
        // Streaming doesn't hold the pairs.
        finder.release_memory();
        memory.peak = memory.bytes;
        EXPECT_TRUE(finder.stream(BoxView<3, float>(boxes), [](const jostle::PairChunk&) { return true; }));
        EXPECT_LE(memory.peak, 120 * n) << name(scene);
    }
}

} // namespace
} // namespace contract
