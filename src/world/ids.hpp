// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "base/prefetch.hpp"
#include "jostle/error.hpp"
#include "jostle/world.hpp"
#include "world/segments.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Hands out ids and knows which are good. Everything from any thread at any time; looking one up takes no
/// lock, because the table grows by segments that never move.
class IdTable
{
  public:
    struct Free
    {
        std::uint32_t index, generation; // to be handed out next
    };

    explicit IdTable(std::pmr::memory_resource* memory) : free_(memory), generations_(memory) {}

    void take(std::span<ObjectId> ids)
    {
        const std::lock_guard lock(mutex_);
        const std::size_t reused = std::min(free_.size(), ids.size());
        grow(ids.size() - reused);
        for (std::size_t i = 0; i < ids.size(); ++i) {
            if (i < reused) {
                ids[i] = {free_.back().index, free_.back().generation};
                free_.pop_back();
            } else {
                ids[i] = {end_.load(std::memory_order_relaxed), 1};
                end_.store(ids[i].index + 1, std::memory_order_release);
            }
            at(ids[i].index).store(ids[i].generation, std::memory_order_release);
        }
    }

    /// The id is good no longer; its index may be handed out again. There is room for it: see grow.
    void release(ObjectId id) noexcept
    {
        const std::lock_guard lock(mutex_);
        at(id.index).store(0, std::memory_order_release);
        // An index whose generations are used up is retired.
        if (id.generation != std::numeric_limits<std::uint32_t>::max())
            free_.push_back({id.index, id.generation + 1});
    }

    /// Of the object with this index, also of one still to be added; 0 if there is none.
    [[nodiscard]] std::uint32_t generation(std::uint32_t index) const noexcept
    {
        return index < end() ? at(index).load(std::memory_order_acquire) : 0;
    }
    void prefetch(std::uint32_t index) const noexcept
    {
        if (index < end()) jostle::prefetch(&at(index));
    }
    [[nodiscard]] bool is_good(ObjectId id) const noexcept
    {
        return id.generation != 0 && generation(id.index) == id.generation;
    }
    void check(ObjectId id) const
    {
        if (!is_good(id)) throw_stale(id);
    }
    [[noreturn]] void throw_stale(ObjectId id) const;

    /// One more than the greatest index handed out.
    [[nodiscard]] std::uint32_t end() const noexcept { return end_.load(std::memory_order_acquire); }

    struct Picture
    {
        std::vector<std::uint32_t> generations; // 0 for indices that is_alive denies
        std::vector<Free> free;
    };
    /// As if the ids that were handed out, but whose objects aren't alive, hadn't been.
    template <class IsAlive>
    [[nodiscard]] Picture picture(const IsAlive& is_alive) const
    {
        const std::lock_guard lock(mutex_);
        Picture result{std::vector<std::uint32_t>(end()), {free_.begin(), free_.end()}};
        for (std::uint32_t i = 0; i < end(); ++i) {
            const std::uint32_t here = at(i).load(std::memory_order_relaxed);
            if (here != 0 && is_alive(i))
                result.generations[i] = here;
            else if (here != 0)
                result.free.push_back({i, here});
        }
        return result;
    }
    /// For a table that has handed out nothing yet.
    void restore(std::span<const std::uint32_t> generations, std::span<const Free> free)
    {
        const std::lock_guard lock(mutex_);
        grow(generations.size());
        for (std::uint32_t i = 0; i < generations.size(); ++i)
            at(i).store(generations[i], std::memory_order_relaxed);
        free_.assign(free.begin(), free.end());
        end_.store(static_cast<std::uint32_t>(generations.size()), std::memory_order_release);
    }
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        const std::lock_guard lock(mutex_);
        return free_.capacity() * sizeof(Free) + generations_.bytes();
    }

  private:
    [[nodiscard]] std::atomic<std::uint32_t>& at(std::uint32_t index) const noexcept
    {
        return generations_[index];
    }
    void grow(std::size_t fresh)
    {
        const std::uint64_t wanted = std::uint64_t{end_.load(std::memory_order_relaxed)} + fresh;
        if (wanted > std::numeric_limits<std::uint32_t>::max())
            throw Error(ErrorCode::too_many_objects,
                        "the world would have " + std::to_string(wanted) +
                            " objects: ids number them with 32 bits; use several worlds");
        if (wanted > free_.capacity()) free_.reserve(wanted + wanted / 2);
        generations_.grow(wanted);
    }

    mutable std::mutex mutex_; // guards all but looking up
    std::pmr::vector<Free> free_;
    Segments<std::uint32_t> generations_; // by index
    std::atomic<std::uint32_t> end_{0};
};

} // namespace world
JOSTLE_NAMESPACE_END
