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
//     jostle::PairFinder quiet({.executor = &jostle::serial_executor()}); // only the caller's thread

/// Where Jostle's work runs. Implement these two functions to run it on a host's job system.
///
/// `run(count, task)` calls task(i) exactly once for each i in [0, count), in any order, on any threads, even
/// one after another on the calling thread, and returns after the last call has returned. Jostle's tasks
/// share work through atomic counters, never wait for one another, never throw, and never call `run`. Results
/// don't depend on which thread runs which task: scratch memory belongs to the task's index. If `run` leaves
/// tasks out, the call that used it throws an `Error`. If it returns before all tasks have, the behaviour is
/// undefined.
///
/// Threads  an executor may serve several callers at a time if its implementation allows it; those below do.
class JOSTLE_API Executor
{
  public:
    virtual ~Executor();

    /// How many tasks can make progress at the same time; at least 1. Jostle asks for at most that many.
    [[nodiscard]] virtual std::uint32_t concurrency() const noexcept = 0;

    virtual void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) = 0;
};

/// Runs everything on the calling thread.
[[nodiscard]] JOSTLE_API Executor& serial_executor() noexcept;

/// The executor that calls use by default: oneTBB with as many threads as the machine has cores (a pool of
/// std::threads in builds without oneTBB). `threads`, if given, limits the number, the calling thread
/// included. So does tbb::global_control. There is one executor for each number, made at first use, and it
/// lives until the program ends.
[[nodiscard]] JOSTLE_API Executor& default_executor(std::uint32_t threads = 0);

/// Makes a pool of `threads` - 1 std::threads, which sleep between calls; the caller is one more. 0 means as
/// many as the machine has cores. Thread sanitizers see all of it, unlike oneTBB's packaged library.
[[nodiscard]] JOSTLE_API std::unique_ptr<Executor> make_thread_executor(std::uint32_t threads = 0);

/// Runs tasks on a host's job system through a C function pointer, instead of a derived class.
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
