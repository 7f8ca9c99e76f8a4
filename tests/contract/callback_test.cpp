// SPDX-License-Identifier: MIT
// Callbacks that stop or throw, and what they are given.
#include <gtest/gtest.h>

#include <atomic>
#include <set>

#include "harness.hpp"

namespace contract {
namespace {

struct Thrown
{
    int value;
};

class Callback : public ::testing::TestWithParam<std::size_t>
{
  public:
    static constexpr std::size_t n = 3'000;
    Callback() { options_.executor = all_executors()[GetParam()].executor.get(); }

  protected:
    jostle::FinderOptions options_;
    const Question<3, float> question_{make_scene<3, float>(Scene::dense, n, 4)};
    const BoxView<3, float> view_{question_.a};
    const std::vector<Pair> expected_ = large_oracle(question_);
    Manner using_finder(jostle::PairFinder& finder) const
    {
        Manner manner;
        manner.finder = &finder;
        return manner;
    }
};

INSTANTIATE_TEST_SUITE_P(Executors, Callback, ::testing::Range(std::size_t{0}, all_executors().size()),
                         [](const auto& instance) {
                             std::string text = all_executors()[instance.param].name;
                             std::replace(text.begin(), text.end(), ' ', '_');
                             return text;
                         });

TEST_P(Callback, AcceptIsAskedOncePerTouchingPairThatPassesTheOtherFilters)
{
    Random random(1);
    Question<3, float> question = question_;
    question.columns_a = random_columns(random, n, true, true);
    const std::vector<Pair> expected = large_oracle(question);
    ASSERT_GT(expected.size(), 100u);
    std::mutex mutex;
    std::vector<Pair> asked;
    const auto accept = [&](std::uint32_t a, std::uint32_t b) {
        const std::lock_guard lock(mutex);
        asked.push_back({a, b});
        return true;
    };
    const Columns& columns = question.columns_a;
    const std::span<const std::uint32_t> category(columns.category), mask(columns.mask), owner(columns.owner);
    jostle::PairFinder finder(options_);
    EXPECT_EQ(finder.find(view_, jostle::Filter{category, mask, owner, accept}).size(), expected.size());
    EXPECT_EQ(sorted(asked), expected);
}

TEST_P(Callback, WhatAcceptThrowsLeavesTheCall)
{
    jostle::PairFinder finder(options_);
    ASSERT_EQ(sorted(ask(question_, using_finder(finder))), expected_);
    const std::vector<Pair> order = ask(question_, using_finder(finder));
    for (const std::uint64_t throwing_call :
         {std::uint64_t{1}, std::uint64_t{100}, std::uint64_t{expected_.size()}})
        for (const bool streaming : {false, true}) {
            std::atomic<std::uint64_t> calls{0};
            const auto accept = [&](std::uint32_t, std::uint32_t) -> bool {
                if (++calls == throwing_call) throw Thrown{42};
                return true;
            };
            const auto take = [](const jostle::PairChunk&) { return true; };
            jostle::Filter filter;
            filter.accept = accept;
            try {
                if (streaming)
                    (void)finder.stream(view_, take, filter);
                else
                    (void)finder.find(view_, filter);
                ADD_FAILURE() << "nothing was thrown";
            } catch (const Thrown& thrown) {
                EXPECT_EQ(thrown.value, 42);
            }
            EXPECT_EQ(ask(question_, using_finder(finder)), order);
        }
}

TEST_P(Callback, WhatTheSinkThrowsLeavesTheCall)
{
    jostle::PairFinder finder(options_);
    const std::vector<Pair> order = ask(question_, using_finder(finder));
    const auto sink = [](const jostle::PairChunk&) -> bool { throw Thrown{7}; };
    for (int round = 0; round < 3; ++round) {
        EXPECT_THROW((void)finder.stream(view_, sink), Thrown);
        EXPECT_EQ(ask(question_, using_finder(finder)), order);
    }
    EXPECT_THROW((void)finder.stream(view_, view_, sink), Thrown);
    EXPECT_EQ(ask(question_, using_finder(finder)), order);
}

TEST_P(Callback, ASinkThatSaysFalseStopsTheSearch)
{
    jostle::PairFinder finder(options_);
    const std::vector<Pair> order = ask(question_, using_finder(finder));
    std::mutex mutex;
    std::vector<Pair> taken;
    const auto sink = [&](const jostle::PairChunk& chunk) {
        const std::lock_guard lock(mutex);
        taken.insert(taken.end(), chunk.pairs.begin(), chunk.pairs.end());
        return false;
    };
    EXPECT_FALSE(finder.stream(view_, sink));
    // Threads may have had a chunk ready each, but what they hand over is true and comes once.
    ASSERT_FALSE(taken.empty());
    std::sort(taken.begin(), taken.end());
    EXPECT_EQ(std::adjacent_find(taken.begin(), taken.end()), taken.end());
    EXPECT_TRUE(std::includes(expected_.begin(), expected_.end(), taken.begin(), taken.end()));
    EXPECT_EQ(ask(question_, using_finder(finder)), order);
    taken.clear();
    EXPECT_FALSE(finder.stream(view_, view_, sink));
    EXPECT_FALSE(taken.empty());
    EXPECT_EQ(ask(question_, using_finder(finder)), order);
}

TEST_P(Callback, AnEmptyAnswerNeverCallsTheSink)
{
    const Boxes<2, float> apart_boxes = {{{0, 0}, {1, 1}}, {{2, 2}, {3, 3}}};
    const auto sink = [](const jostle::PairChunk&) -> bool { throw Thrown{1}; };
    EXPECT_TRUE(jostle::PairFinder(options_).stream(BoxView<2, float>(apart_boxes), sink));
}

TEST(CallbackCaller, AFinderPerThreadOnOneExecutor)
{
    const std::unique_ptr<jostle::Executor> executor = jostle::make_thread_executor(3);
    const Question<3, float> question{make_scene<3, float>(Scene::dense, 1'000, 4)};
    const std::vector<Pair> expected = ask(question);
    std::atomic<int> right{0};
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 4; ++caller)
        callers.emplace_back([&] {
            jostle::FinderOptions options;
            options.executor = executor.get();
            jostle::PairFinder finder(options);
            Manner manner;
            manner.finder = &finder;
            for (int frame = 0; frame < 5; ++frame)
                right += ask(question, manner) == expected;
        });
    for (std::thread& caller : callers)
        caller.join();
    EXPECT_EQ(right, 20);
}

} // namespace
} // namespace contract
