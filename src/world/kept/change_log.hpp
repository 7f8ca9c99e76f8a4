// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

#include "world/objects/numbers.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Records which objects have changed in each update, for views: a view that follows again visits only these.
/// Nothing is recorded unless a view has followed recently.
class ChangeLog
{
  public:
    explicit ChangeLog(std::pmr::memory_resource* memory) : indices_(memory) {}
    ChangeLog(const ChangeLog&) = delete;
    ChangeLog& operator=(const ChangeLog&) = delete;

    /// The position of a view that has followed until now.
    struct Position
    {
        std::uint64_t log = 0; // its number; 0: none
        std::uint64_t end = 0;
    };

    /// Called by a view that follows. Returns what has changed since `position`, in any order, possibly with
    /// repetitions; nothing if that isn't known. The view is then at `here`.
    [[nodiscard]] std::optional<std::span<const std::uint32_t>> since(const Position& position,
                                                                      Position& here) const noexcept
    {
        here = {number_, first_ + indices_.size()};
        const bool is_kept = unread_.exchange(0, std::memory_order_relaxed) < patience;
        if (!is_kept || position.log != number_ || position.end < first_) return std::nullopt;
        return std::span(indices_).subspan(static_cast<std::size_t>(position.end - first_));
    }

    // Called by the world:

    /// Views that have followed until now will visit all objects the next time.
    void drop() noexcept
    {
        first_ += indices_.size() + 1;
        indices_.clear();
    }
    void count_update() noexcept
    {
        if (is_read() && unread_.fetch_add(1, std::memory_order_relaxed) + 1 == patience) drop();
    }
    /// `objects` is their number in the world. If more than a quarter of them have changed, recording them
    /// doesn't pay.
    template <class Indices>
    void note(const Indices& indices, std::size_t objects) noexcept
    {
        if (!is_read()) return;
        const std::size_t most = objects / 4 + 256;
        if (indices.size() > most) return drop();
        try {
            // Only the oldest are dropped: views that follow every update never have to visit all objects.
            if (indices_.size() + indices.size() > 2 * most) {
                const std::size_t oldest = indices_.size() / 2;
                indices_.erase(indices_.begin(), indices_.begin() + static_cast<std::ptrdiff_t>(oldest));
                first_ += oldest;
            }
            for (const auto index : indices)
                indices_.push_back(static_cast<std::uint32_t>(index));
        } catch (...) {
            drop();
        }
    }

  private:
    static constexpr std::uint32_t patience = 64; // updates
    static std::uint64_t next_number() noexcept
    {
        static std::atomic<std::uint64_t> last{0};
        return last.fetch_add(1, std::memory_order_relaxed) + 1;
    }
    [[nodiscard]] bool is_read() const noexcept { return unread_.load(std::memory_order_relaxed) < patience; }

    // Unique in the program, so that a view never mistakes another world's log for the one it has followed.
    const std::uint64_t number_ = next_number();
    mutable std::atomic<std::uint32_t> unread_{patience}; // updates since a view followed
    std::uint64_t first_ = 0;                             // the position at which indices_ begins
    std::pmr::vector<std::uint32_t> indices_;
};

} // namespace world
JOSTLE_NAMESPACE_END
