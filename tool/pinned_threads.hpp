// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "jostle/executor.hpp"

namespace jostle_tool {

/// An executor for measuring what cores do to each other: every task on a thread of its own, all of them let
/// go at the same moment, each on another core as far as there are cores (on Linux; elsewhere the system
/// places them). Threads are made for each run, outside of what ms() counts.
///
/// Threads  one run at a time.
class PinnedThreads final : public jostle::Executor
{
  public:
    /// At least 1.
    explicit PinnedThreads(std::uint32_t threads);

    [[nodiscard]] std::uint32_t concurrency() const noexcept override { return threads_; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override;

    /// Milliseconds in runs since reset(), each from its first task's start to its last one's end.
    [[nodiscard]] double ms() const noexcept { return ms_; }
    /// How often the system took a core away from a task since reset(): then ms() counts others' work too.
    /// 0 where the system doesn't say.
    [[nodiscard]] std::uint64_t preemptions() const noexcept { return preemptions_; }
    void reset() noexcept
    {
        ms_ = 0;
        preemptions_ = 0;
    }

    /// The cores that this process may use; two threads of one core count as one.
    [[nodiscard]] static std::uint32_t core_count();

  private:
    std::uint32_t threads_;
    std::vector<int> processors_; // in the order in which they are used; empty: not pinned
    double ms_ = 0;
    std::uint64_t preemptions_ = 0;
};

} // namespace jostle_tool
