// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "jostle/executor.hpp"

#ifdef JOSTLE_TOOL_WITH_TBB
#include <tbb/global_control.h>
#endif

namespace jostle_tool {

/// The threads of one command: as many as asked for, more than the machine has cores if need be.
///
/// Keep one alive for as long as its executor works. With several at a time the largest counts for the
/// process, and each executor still keeps to its own number.
class Threads
{
  public:
    static constexpr std::uint32_t most = 1024;

    /// 0 means one per core.
    explicit Threads(std::uint32_t threads = 0)
        : count_(threads == 0 ? jostle::default_executor().concurrency() : threads),
#ifdef JOSTLE_TOOL_WITH_TBB
          // oneTBB runs no more threads than there are cores unless it is told so.
          allow_(tbb::global_control::max_allowed_parallelism, count_),
#endif
          executor_(&jostle::default_executor(count_))
    {
    }

    [[nodiscard]] jostle::Executor& executor() const noexcept { return *executor_; }
    [[nodiscard]] std::uint32_t count() const noexcept { return count_; }

  private:
    std::uint32_t count_;
#ifdef JOSTLE_TOOL_WITH_TBB
    tbb::global_control allow_;
#endif
    jostle::Executor* executor_;
};

} // namespace jostle_tool
