// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <mutex>
#include <new>

namespace contract {

/// Counts what goes through it and can be told to fail.
class CountingMemory final : public std::pmr::memory_resource
{
  public:
    static constexpr std::uint64_t never = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t bytes = 0, peak = 0, allocations = 0, blocks = 0;
    std::uint64_t failing_allocation = never; ///< from this one on, counted from 0, all fail

  private:
    void* do_allocate(std::size_t size, std::size_t alignment) override
    {
        const std::lock_guard lock(mutex_);
        if (allocations++ >= failing_allocation) throw std::bad_alloc();
        void* const memory = std::pmr::new_delete_resource()->allocate(size, alignment);
        bytes += size;
        ++blocks;
        peak = std::max(peak, bytes);
        return memory;
    }
    void do_deallocate(void* memory, std::size_t size, std::size_t alignment) override
    {
        const std::lock_guard lock(mutex_);
        bytes -= size;
        --blocks;
        std::pmr::new_delete_resource()->deallocate(memory, size, alignment);
    }
    bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override
    {
        return this == &other;
    }
    std::mutex mutex_;
};

} // namespace contract
