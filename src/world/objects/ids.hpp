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
#include "world/objects/segments.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// So an id as a number, generation above index, has at most 53 bits: a double holds it exactly, and doubles
/// are all the numbers of JavaScript and others.
inline constexpr std::uint32_t last_generation = (1U << 21) - 1;
/// Whether an object can have it.
constexpr bool is_generation(std::uint32_t generation) noexcept
{
    return generation != 0 && generation <= last_generation;
}

/// Hands out ids and knows which are valid. Any thread may call any function at any time; looking up an id
/// takes no lock, because the table grows by segments that never move.
class IdTable
{
  public:
    struct Free
    {
        std::uint32_t index, generation; // to be handed out next
        friend bool operator==(const Free&, const Free&) = default;
    };

    explicit IdTable(std::pmr::memory_resource* memory) : free_(memory), generations_(memory) {}

    /// Calls `keep` with the ids before any other thread can know them. If it throws, none is handed out.
    template <class Keep>
    void take(std::span<ObjectId> ids, const Keep& keep)
    {
        const std::lock_guard lock(mutex_);
        const std::size_t reused = std::min(free_.size(), ids.size());
        grow(ids.size() - reused);
        std::uint32_t next = end_.load(std::memory_order_relaxed);
        for (std::size_t i = 0; i < reused; ++i) {
            const Free& free = free_[free_.size() - 1 - i];
            ids[i] = {free.index, free.generation};
        }
        for (ObjectId& id : ids.subspan(reused))
            id = {next++, 1};
        keep(std::span<const ObjectId>(ids));
        free_.resize(free_.size() - reused);
        end_.store(next, std::memory_order_release);
        for (const ObjectId id : ids)
            at(id.index).store(id.generation, std::memory_order_release);
    }

    /// Invalidates the id; its index may be handed out again. There is room for it: see grow.
    void release(ObjectId id) noexcept
    {
        const std::lock_guard lock(mutex_);
        at(id.index).store(0, std::memory_order_release);
        // An index with no generations left is retired.
        if (id.generation != last_generation) free_.push_back({id.index, id.generation + 1});
    }

    /// The generation of the object with this index, also of one still to be added; 0 if there is none.
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
    /// A picture as if all ids whose objects aren't alive hadn't been handed out.
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

    // Against what a picture had, its `free` and as many generations as `end`:

    /// The free ids now, as in a picture: the first `kept` of the picture's, then `fresh`. Returns the end.
    /// `changed` are indices, whose objects may have been alive then and aren't now.
    template <class IsAlive>
    std::uint32_t compare(std::span<const Free> free, std::uint32_t end_then,
                          std::span<const std::uint32_t> changed, const IsAlive& is_alive, std::size_t& kept,
                          std::pmr::vector<Free>& fresh) const
    {
        const std::lock_guard lock(mutex_);
        kept = first_difference(free);
        fresh.assign(free_.begin() + static_cast<std::ptrdiff_t>(kept), free_.end());
        const std::size_t returned = fresh.size();
        // Handed out, but without an object yet: no others can be.
        const auto look = [&](std::uint32_t index) {
            const std::uint32_t here = at(index).load(std::memory_order_relaxed);
            if (here != 0 && !is_alive(index)) fresh.push_back({index, here});
        };
        for (std::size_t k = kept; k < free.size(); ++k)
            look(free[k].index);
        for (const std::uint32_t index : changed)
            if (index < end()) look(index);
        for (std::uint32_t index = end_then; index < end(); ++index)
            look(index);
        const auto first = fresh.begin() + static_cast<std::ptrdiff_t>(returned);
        std::sort(first, fresh.end(), [](const Free& a, const Free& b) { return a.index < b.index; });
        fresh.erase(std::unique(first, fresh.end()), fresh.end());
        std::size_t same = 0;
        while (same < fresh.size() && kept + same < free.size() && fresh[same] == free[kept + same])
            ++same;
        fresh.erase(fresh.begin(), fresh.begin() + static_cast<std::ptrdiff_t>(same));
        kept += same;
        return end();
    }
    /// Makes room for this many in total.
    void make_room(std::uint32_t count)
    {
        const std::lock_guard lock(mutex_);
        const std::uint32_t known = end_.load(std::memory_order_relaxed);
        if (count > known) grow(count - known);
    }
    /// From now on `index` isn't free, or has no object. A call of go_back must follow.
    void set(std::uint32_t index, std::uint32_t generation) noexcept
    {
        at(index).store(generation, std::memory_order_release);
    }
    /// From now on every index is less than this. There is room for them.
    void set_end(std::uint32_t end) noexcept
    {
        const std::lock_guard lock(mutex_);
        end_.store(end, std::memory_order_release);
    }
    /// The free ids become the first `kept` of the picture's, then `fresh`. Ids without an object become
    /// invalid.
    template <class IsAlive>
    void go_back(std::span<const Free> free, std::uint32_t end_then, std::size_t kept,
                 std::span<const Free> fresh, std::uint32_t end_now, const IsAlive& is_alive) noexcept
    {
        const std::lock_guard lock(mutex_);
        const auto take_back = [&](std::uint32_t index) {
            if (!is_alive(index)) at(index).store(0, std::memory_order_release);
        };
        for (std::size_t k = first_difference(free); k < free.size(); ++k)
            take_back(free[k].index);
        for (std::uint32_t index = end_then; index < end(); ++index)
            take_back(index);
        free_.assign(free.begin(), free.begin() + static_cast<std::ptrdiff_t>(kept));
        free_.insert(free_.end(), fresh.begin(), fresh.end());
        end_.store(end_now, std::memory_order_release);
    }

  private:
    [[nodiscard]] std::atomic<std::uint32_t>& at(std::uint32_t index) const noexcept
    {
        return generations_[index];
    }
    [[nodiscard]] std::size_t first_difference(std::span<const Free> free) const noexcept
    {
        const auto [here, there] = std::mismatch(free_.begin(), free_.end(), free.begin(), free.end());
        return static_cast<std::size_t>(here - free_.begin());
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

    mutable std::mutex mutex_; // guards everything except lookups
    std::pmr::vector<Free> free_;
    Segments<std::uint32_t> generations_; // by index
    std::atomic<std::uint32_t> end_{0};
};

} // namespace world
JOSTLE_NAMESPACE_END
