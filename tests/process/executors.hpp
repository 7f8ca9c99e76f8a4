// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "jostle/executor.hpp"

namespace process_test {

/// Tasks on the calling thread, in an order that changes with every run.
class ShuffledExecutor final : public jostle::Executor
{
  public:
    explicit ShuffledExecutor(std::uint32_t concurrency) : concurrency_(concurrency) {}
    std::uint32_t concurrency() const noexcept override { return concurrency_; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        std::vector<std::uint32_t> order(count);
        std::iota(order.begin(), order.end(), 0u);
        std::shuffle(order.begin(), order.end(), random_);
        for (const std::uint32_t i : order)
            task(i);
    }

  private:
    std::uint32_t concurrency_;
    std::mt19937 random_{1};
};

/// Every task on a thread of its own, the last one first.
class BackwardThreads final : public jostle::Executor
{
  public:
    explicit BackwardThreads(std::uint32_t concurrency) : concurrency_(concurrency) {}
    std::uint32_t concurrency() const noexcept override { return concurrency_; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        std::vector<std::thread> threads;
        for (std::uint32_t i = count; i-- > 0;)
            threads.emplace_back([=] { task(i); });
        for (std::thread& thread : threads)
            thread.join();
    }

  private:
    std::uint32_t concurrency_;
};

/// A host that runs tasks on the calling thread, and fails when it is told to.
class FailingExecutor final : public jostle::Executor
{
  public:
    enum class Fault
    {
        none,
        leaves_one_out,
        runs_none,
        throws_an_int ///< after the tasks
    };
    Fault fault = Fault::none;

    std::uint32_t concurrency() const noexcept override { return 3; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        for (std::uint32_t i = fault == Fault::leaves_one_out ? 1 : 0; i < count; ++i)
            if (fault != Fault::runs_none) task(i);
        if (fault == Fault::throws_an_int) throw 1;
    }
};

struct NamedExecutor
{
    std::string name;
    std::shared_ptr<jostle::Executor> executor;
};

inline const std::vector<NamedExecutor>& all_executors()
{
    static const std::vector<NamedExecutor> executors = [] {
        std::vector<NamedExecutor> all;
        all.push_back({"serial", {&jostle::serial_executor(), [](jostle::Executor*) {}}});
        for (const std::uint32_t threads : {1u, 2u, 7u})
            all.push_back({"thread " + std::to_string(threads), jostle::make_thread_executor(threads)});
        all.push_back({"default 2", {&jostle::default_executor(2), [](jostle::Executor*) {}}});
        all.push_back({"shuffled 5", std::make_shared<ShuffledExecutor>(5u)});
        all.push_back({"backward threads 3", std::make_shared<BackwardThreads>(3u)});
        return all;
    }();
    return executors;
}

} // namespace process_test
