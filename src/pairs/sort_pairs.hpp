// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>

#include "base/buffer.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/pair_buffer.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Puts pairs in ascending order of (a, b). Keeps its memory from call to call.
class PairSorter
{
  public:
    explicit PairSorter(std::pmr::memory_resource* memory)
        : counts_(memory), places_(memory), partners_(memory)
    {
    }

    /// Sets `to` to the sorted pairs of `from`; every a is less than `objects`.
    /// `set` must be one of supported_instruction_sets(); the result is the same for all.
    /// Cost: a few passes over the pairs, distributed over the executor's threads.
    void sort(const PairBuffer& from, std::size_t objects, Executor& executor, InstructionSet set,
              PairBuffer& to);

    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return counts_.bytes() + places_.bytes() + partners_.bytes();
    }
    void release() noexcept
    {
        counts_.release();
        places_.release();
        partners_.release();
    }

  private:
    Buffer<std::uint64_t> counts_;   // per task and group; then where the task writes next
    Buffer<std::uint32_t> places_;   // per task and object of a group
    Buffer<std::uint32_t> partners_; // per task and pair of a group, twice
};

JOSTLE_NAMESPACE_END
