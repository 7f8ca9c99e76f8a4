// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>

#include "jostle/function_ref.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

// Every class and function that uses threads takes an Executor:
//
//     jostle::PairFinder finder({.executor = &jostle::default_executor(2)}); // two threads
//     jostle::PairFinder quiet({.executor = &jostle::serial_executor()}); // no thread but the caller's

/// Where Jostle's work runs: the one thing asked of a host's job system. Implement these two functions to
/// keep every thread under the host's control.
///
/// `run(count, task)` calls task(i) exactly once for each i in [0, count), in any order, on any threads, even
/// one after another on the calling thread, and returns after the last has returned. Jostle's tasks share
/// work through atomic counters, never wait for one another, never throw, and never call `run` from within a
/// task. Results don't depend on which thread runs what: scratch memory belongs to the task's index. A run
/// that leaves tasks out is an `Error` of the call that asked for it; one that returns before they have can't
/// be noticed, and is undefined behaviour.
///
/// Threads  one executor may serve several callers at a time if its implementation allows it; those below do.
class JOSTLE_API Executor
{
  public:
    virtual ~Executor();

    /// How many tasks can make progress at the same time; at least 1. Jostle asks for at most that many.
    [[nodiscard]] virtual std::uint32_t concurrency() const noexcept = 0;

    virtual void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) = 0;
};

/// Everything on the calling thread.
[[nodiscard]] JOSTLE_API Executor& serial_executor() noexcept;

/// Without a number what calls use that are given no executor: oneTBB with as many threads as the machine has
/// cores (a pool of std::threads in builds without oneTBB). With one at most that many threads, the caller's
/// included. oneTBB runs no more than the process allows it (tbb::global_control). There is one executor for
/// each number that is asked for, made at first use. It stays until the program ends, so nothing that is
/// given it can outlive it.
[[nodiscard]] JOSTLE_API Executor& default_executor(std::uint32_t threads = 0);

/// A pool of its own: `threads` - 1 std::threads that sleep between calls, plus the caller; 0 means as many
/// as the machine has cores. Fully visible to thread sanitizers, which oneTBB's packaged library isn't.
[[nodiscard]] JOSTLE_API std::unique_ptr<Executor> make_thread_executor(std::uint32_t threads = 0);

/// The host's own job system as two C function pointers, for those who would rather not derive a class.
class JOSTLE_API CallbackExecutor final : public Executor
{
  public:
    /// Must call task(context, i) once for each i in [0, count) and return after the last; see Executor::run.
    using Run = void (*)(void* host, std::uint32_t count, void (*task)(void* context, std::uint32_t i),
                         void* context);

    /// Errors   `Error` for a null callback.
    CallbackExecutor(std::uint32_t concurrency, void* host, Run callback);
    [[nodiscard]] std::uint32_t concurrency() const noexcept override;
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override;

  private:
    std::uint32_t concurrency_;
    void* host_;
    Run run_;
};

JOSTLE_NAMESPACE_END
