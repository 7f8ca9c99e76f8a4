// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <string>

#include "jostle/error.hpp"
#include "jostle/executor.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Calls executor.run, and throws an `Error` if it left tasks out, since their slots would have no results.
/// An executor that returns while tasks still run can't be detected; they use memory of this call.
template <class Task>
void run_tasks(Executor& executor, std::uint32_t count, const Task& task)
{
    std::atomic<std::uint32_t> done{0};
    executor.run(count, [&](std::uint32_t i) {
        if (i >= count) return; // a host that counts from 1
        task(i);
        done.fetch_add(1, std::memory_order_relaxed);
    });
    if (done != count)
        throw Error(ErrorCode::invalid_argument,
                    "the executor was to run tasks 0 to " + std::to_string(count - 1) + " and ran " +
                        std::to_string(done) +
                        " of them; Executor::run must call each once before it returns");
}

JOSTLE_NAMESPACE_END
