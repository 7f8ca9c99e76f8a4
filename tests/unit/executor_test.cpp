// SPDX-License-Identifier: MIT
#include "jostle/executor.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#ifdef JOSTLE_TEST_WITH_TBB
#include <tbb/global_control.h>
#endif

#include "jostle/find_pairs.hpp"
#include "jostle/process.hpp"

using namespace jostle;

namespace {

void run_forwards(void* calls, std::uint32_t count, void (*task)(void*, std::uint32_t), void* context)
{
    ++*static_cast<int*>(calls);
    for (std::uint32_t i = 0; i < count; ++i)
        task(context, i);
}

int callback_calls = 0;

std::shared_ptr<Executor> make(const std::string& sort, std::uint32_t threads)
{
    if (sort == "default") return {&default_executor(threads), [](Executor*) {}};
    if (sort == "thread") return make_thread_executor(threads);
    return std::make_unique<CallbackExecutor>(threads, &callback_calls, run_forwards);
}

class ExecutorOf : public ::testing::TestWithParam<std::tuple<std::string, std::uint32_t>>
{
#ifdef JOSTLE_TEST_WITH_TBB
    /// As many threads as are asked for, on a machine of few cores as well.
    const tbb::global_control threads_{tbb::global_control::max_allowed_parallelism, 16};
#endif

  protected:
    std::shared_ptr<Executor> executor_ = make(std::get<0>(GetParam()), std::get<1>(GetParam()));
};
INSTANTIATE_TEST_SUITE_P(Sorts, ExecutorOf,
                         ::testing::Combine(::testing::Values("default", "thread", "callback"),
                                            ::testing::Values(1u, 2u, 5u, 16u)),
                         [](const auto& instance) {
                             return std::get<0>(instance.param) + std::to_string(std::get<1>(instance.param));
                         });

void expect_each_task_once(Executor& executor, std::uint32_t count)
{
    std::vector<std::atomic<int>> calls(count);
    executor.run(count, [&](std::uint32_t i) { ++calls[i]; });
    for (std::uint32_t i = 0; i < count; ++i)
        ASSERT_EQ(calls[i], 1) << "task " << i << " of " << count;
}

TEST_P(ExecutorOf, RunsEachTaskOnceHoweverMany)
{
    for (const std::uint32_t count : {0u, 1u, 2u, 3u, 17u, 1'000u, 100'000u})
        expect_each_task_once(*executor_, count);
}

TEST_P(ExecutorOf, ReturnsAfterTheLastTask)
{
    for (int round = 0; round < 500; ++round) {
        std::vector<int> written(8, 0); // plain memory: a task still running would be a race and show
        executor_->run(8, [&](std::uint32_t i) { written[i] = static_cast<int>(i) + round; });
        for (int i = 0; i < 8; ++i)
            ASSERT_EQ(written[static_cast<std::size_t>(i)], i + round);
    }
}

TEST_P(ExecutorOf, ServesManyCallersAtATime)
{
    if (std::get<0>(GetParam()) == "callback") callback_calls = 0; // counts calls below
    std::atomic<int> sum{0};
    if (std::get<0>(GetParam()) == "callback") {
        executor_->run(3, [&](std::uint32_t i) { sum += static_cast<int>(i); });
        EXPECT_EQ(callback_calls, 1); // the host's function is what ran the tasks
        EXPECT_EQ(sum, 3);
        return;
    }
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 6; ++caller)
        callers.emplace_back([&] {
            for (int round = 0; round < 100; ++round)
                executor_->run(10, [&](std::uint32_t i) { sum += static_cast<int>(i); });
        });
    for (std::thread& caller : callers)
        caller.join();
    EXPECT_EQ(sum, 6 * 100 * 45);
}

TEST_P(ExecutorOf, RunsInsideAnothersTask)
{
    const std::unique_ptr<Executor> inner = make_thread_executor(2);
    std::atomic<int> count{0};
    executor_->run(4, [&](std::uint32_t) {
        inner->run(4, [&](std::uint32_t) { ++count; });
        serial_executor().run(4, [&](std::uint32_t) { ++count; });
        default_executor().run(4, [&](std::uint32_t) { ++count; });
    });
    EXPECT_EQ(count, 48);
}

/// A thread that waits inside a run that a task has asked for may hold a lock that another task wants.
TEST_P(ExecutorOf, TakesUpNoOtherTaskWhileItWaitsInsideOne)
{
    static thread_local bool is_waiting;
    is_waiting = false;
    std::atomic<int> taken_up{0};
    for (int round = 0; round < 100; ++round)
        executor_->run(executor_->concurrency(), [&](std::uint32_t) {
            if (is_waiting) {
                ++taken_up;
                return;
            }
            is_waiting = true;
            executor_->run(
                4, [&](std::uint32_t) { std::this_thread::sleep_for(std::chrono::microseconds(100)); });
            is_waiting = false;
        });
    EXPECT_EQ(taken_up, 0);
}

TEST_P(ExecutorOf, ConcurrencyIsAtLeastOneAndAtMostWhatWasAskedFor)
{
    EXPECT_GE(executor_->concurrency(), 1u);
    EXPECT_LE(executor_->concurrency(), std::get<1>(GetParam()));
}

TEST(Executor, ThreadsAsAsked)
{
    for (const std::uint32_t threads : {1u, 2u, 7u}) {
        EXPECT_EQ(make_thread_executor(threads)->concurrency(), threads);
        EXPECT_EQ(CallbackExecutor(threads, nullptr, run_forwards).concurrency(), threads);
    }
    EXPECT_EQ(CallbackExecutor(0, nullptr, run_forwards).concurrency(), 1u);
    EXPECT_GE(make_thread_executor(0)->concurrency(), 1u);
    EXPECT_GE(default_executor().concurrency(), 1u);
    EXPECT_EQ(&default_executor(), &default_executor());
    EXPECT_EQ(&default_executor(0), &default_executor());
    for (const std::uint32_t threads : {1u, 2u}) {
        EXPECT_EQ(&default_executor(threads), &default_executor(threads));
        EXPECT_LE(default_executor(threads).concurrency(), threads);
    }
    EXPECT_NE(&default_executor(1), &default_executor(2));
    EXPECT_EQ(serial_executor().concurrency(), 1u);
}

/// As many tasks as threads wait for each other, and all but the caller's take a while: no thread is missing,
/// and run() returns after all of them.
TEST(Executor, HasAllItsThreadsAndWaitsForThem)
{
    for (const std::uint32_t threads : {2u, 3u, 8u}) {
        const std::unique_ptr<Executor> executor = make_thread_executor(threads);
        for (int round = 0; round < 3; ++round) {
            struct State
            {
                std::atomic<std::uint32_t> there{0}, missed{0}, done{0};
            };
            const auto state = std::make_shared<State>(); // tasks may outlive a run() that doesn't wait
            const std::thread::id caller = std::this_thread::get_id();
            executor->run(threads, [state, caller, threads](std::uint32_t) {
                ++state->there;
                const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
                while (state->there < threads && std::chrono::steady_clock::now() < end)
                    std::this_thread::yield();
                if (state->there < threads) ++state->missed;
                if (std::this_thread::get_id() != caller)
                    std::this_thread::sleep_for(std::chrono::milliseconds(50));
                ++state->done;
            });
            ASSERT_EQ(state->done, threads);
            ASSERT_EQ(state->missed, 0u);
        }
    }
}

/// A host's mistakes: it counts from 1, or forgets the last task, or all.
void run_from_one(void*, std::uint32_t count, void (*task)(void*, std::uint32_t), void* context)
{
    for (std::uint32_t i = 1; i <= count; ++i)
        task(context, i);
}
void run_all_but_last(void*, std::uint32_t count, void (*task)(void*, std::uint32_t), void* context)
{
    for (std::uint32_t i = 0; i + 1 < count; ++i)
        task(context, i);
}
void run_none(void*, std::uint32_t, void (*)(void*, std::uint32_t), void*) {}

template <class Call>
void expect_error(const Call& call, const std::string& part_of_message)
{
    try {
        call();
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
        EXPECT_NE(std::string(error.what()).find(part_of_message), std::string::npos) << error.what();
    }
}

TEST(Executor, TasksLeftOutAreAnError)
{
    std::vector<Aabb2f> boxes(20'000);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const float x = static_cast<float>(i % 200), y = static_cast<float>(i / 200);
        boxes[i] = {{x, y}, {x + 1.5f, y + 1.5f}};
    }
    for (const auto run : {run_from_one, run_all_but_last, run_none}) {
        CallbackExecutor executor(2, nullptr, run);
        const std::string ran = run == run_none ? "ran 0 of them" : "ran 1 of them";
        FinderOptions options;
        options.executor = &executor;
        PairFinder finder(options);
        expect_error([&] { (void)finder.find(boxes); }, ran);
        expect_error([&] { (void)finder.find(boxes, {}, Order::sorted); }, ran);
        ProcessOptions process;
        process.executor = &executor;
        expect_error([&] { process_items(100, [](std::uint64_t, std::uint64_t, Work) {}, process); }, ran);
    }
}

TEST(Executor, CallablesThatAreNullAreAnError)
{
    expect_error([] { CallbackExecutor(2, nullptr, nullptr); }, "without a callback");
    expect_error([] { process_items(10, FunctionRef<void(std::uint64_t, std::uint64_t, Work)>()); },
                 "FunctionRef to nothing");
}

TEST(Executor, ThreadsReallyTakePart)
{
    // Every task waits until all have begun, which only ends if each has a thread of its own.
    const std::unique_ptr<Executor> executor = make_thread_executor(4);
    std::atomic<int> begun{0};
    std::mutex mutex;
    std::set<std::thread::id> threads;
    executor->run(4, [&](std::uint32_t) {
        ++begun;
        while (begun < 4)
            std::this_thread::yield();
        const std::lock_guard lock(mutex);
        threads.insert(std::this_thread::get_id());
    });
    EXPECT_EQ(threads.size(), 4u);
    EXPECT_EQ(threads.count(std::this_thread::get_id()), 1u); // the caller's included
}

TEST(Executor, SerialRunsInOrderOnTheCaller)
{
    std::vector<std::uint32_t> order;
    serial_executor().run(5, [&](std::uint32_t i) { order.push_back(i); });
    EXPECT_EQ(order, (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
}

TEST(Executor, ComesAndGoesQuickly)
{
    for (int round = 0; round < 200; ++round)
        expect_each_task_once(*make_thread_executor(3), round % 5 == 0 ? 0 : 4);
}

} // namespace
