// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <mutex>
#include <vector>

#include "jostle/world.hpp"
#include "world/segments.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// What the user keeps with each object: 64 bits, by index. Everything but what an update does from any
/// thread at any time. There is nothing of it before somebody keeps something.
class UserData
{
  public:
    explicit UserData(std::pmr::memory_resource* memory)
        : of_(memory), removed_(memory), removed_next_(memory)
    {
    }

    void set(std::uint32_t index, std::uint64_t data)
    {
        std::atomic<std::uint64_t>* place = of_.find(index);
        if (place == nullptr) {
            if (data == 0) return;
            const std::lock_guard lock(mutex_);
            of_.make(index);
            any_.store(true, std::memory_order_release);
            place = of_.find(index);
        }
        place->store(data, std::memory_order_relaxed);
    }
    [[nodiscard]] std::uint64_t of(std::uint32_t index) const noexcept
    {
        const std::atomic<std::uint64_t>* const place = of_.find(index);
        return place == nullptr ? 0 : place->load(std::memory_order_relaxed);
    }
    /// Whether anything was ever set.
    [[nodiscard]] bool any() const noexcept { return any_.load(std::memory_order_acquire); }

    // In an update: first who will be removed by it, ascending by index, then that it has happened.
    void begin_removal() noexcept { removed_next_.clear(); }
    void note_removal(ObjectId id) { removed_next_.push_back({id, of(id.index)}); }
    void end_removal() noexcept { removed_.swap(removed_next_); }
    /// Of an object that the last update removed; null if it didn't.
    [[nodiscard]] const std::uint64_t* of_removed(ObjectId id) const noexcept
    {
        const auto at = std::partition_point(removed_.begin(), removed_.end(),
                                             [id](const Removed& each) { return each.id.index < id.index; });
        return at != removed_.end() && at->id == id ? &at->data : nullptr;
    }

  private:
    struct Removed
    {
        ObjectId id;
        std::uint64_t data;
    };
    Segments<std::uint64_t> of_;
    std::mutex mutex_; // held while it grows
    std::atomic<bool> any_{false};
    std::pmr::vector<Removed> removed_, removed_next_;
};

} // namespace world
JOSTLE_NAMESPACE_END
