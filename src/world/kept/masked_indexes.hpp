// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "jostle/box_index.hpp"
#include "world/objects/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Whether questions of this category and mask are about objects with such a filter.
[[nodiscard]] inline bool counts(const ObjectFilter& object, std::uint32_t category,
                                 std::uint32_t mask) noexcept
{
    return ((object.category & mask) != 0) & ((category & object.mask) != 0);
}

/// The objects that a category and mask of queries select, in indexes of their own. If they lie among many
/// others, each leaf of the main indexes has some of both, so only an index without the others avoids
/// visiting them. That of the resting ones is made when so many queries have been made that it pays, and kept
/// up to date from then on; if it isn't used for long, it is dropped. That of the active ones, who have moved
/// by the next update, is made anew when so many queries have been made since the last one. Only a cache: no
/// answer depends on it.
template <int Dim, class T>
class MaskedIndexes
{
  public:
    /// What lies behind questions of one category and mask.
    class Masked
    {
      public:
        /// Null: the index of all resting objects is used.
        [[nodiscard]] const BoxIndex<Dim, T>* index() const noexcept
        {
            return is_worth_it_ ? &*index_ : nullptr;
        }
        /// How many of the active objects count.
        [[nodiscard]] bool all_active() const noexcept { return active_ == of_active_; }
        [[nodiscard]] bool no_active() const noexcept { return active_ == 0; }
        /// Those that count, and nothing else. Null: the index of all active objects is used. May be there
        /// from one call to the next.
        [[nodiscard]] const BoxIndex<Dim, T>* index_of_active() const noexcept
        {
            return has_active_.load(std::memory_order_acquire) ? &*index_of_active_ : nullptr;
        }

      private:
        friend class MaskedIndexes;
        explicit Masked(std::pmr::memory_resource* memory) : moved_(memory), ids_active_(memory) {}
        std::atomic<bool> is_named{false}; // category_ and mask_ are set, and stay as long as it is
        std::atomic<bool> is_fresh{false}; // all else is as the last update has left the world
        std::uint32_t category_ = 0, mask_ = 0;
        std::atomic<std::uint64_t> asked_{0};   // questions since it was named
        std::atomic<std::uint32_t> unasked_{0}; // updates in which nobody asked
        bool is_made_ = false, is_worth_it_ = false;
        std::size_t resting_ = 0; // how many there were when that was found out
        std::size_t active_ = 0, of_active_ = 0;
        std::optional<BoxIndex<Dim, T>> index_, index_of_active_;
        std::atomic<bool> has_active_{false};        // the latter is as the last update has left the world
        std::atomic<std::uint64_t> asked_active_{0}; // questions since that update
        std::pmr::vector<std::uint32_t> moved_; // who came to rest, shifted or woke up since it was fresh
        std::pmr::vector<std::uint32_t> ids_active_; // of the active ones that count, where they are few
    };

    explicit MaskedIndexes(const IndexOptions& options)
        : options_(options),
          all_{Masked(options.memory), Masked(options.memory), Masked(options.memory),
               Masked(options.memory)},
          ids_(options.memory),
          boxes_(options.memory)
    {
    }

    /// Null where so many questions more don't make it pay. For 0 questions none is made: null unless it is
    /// there and up to date. Valid until the next update.
    const Masked* of(const State<Dim, T>& state, std::uint32_t category, std::uint32_t mask,
                     std::uint64_t questions);

    // After an update that has changed something:
    void note(std::span<const std::uint32_t> rested, std::span<const std::uint32_t> settling) noexcept;

  private:
    Masked* find(std::uint32_t category, std::uint32_t mask) noexcept;
    void make(Masked& masked, const State<Dim, T>& state);
    void follow(Masked& masked, const State<Dim, T>& state);
    void refresh(Masked& masked, const State<Dim, T>& state);
    void index_active(Masked& masked, const State<Dim, T>& state, std::uint64_t questions);

    const IndexOptions options_;
    std::mutex mutex_; // held while one is named or brought up to date
    std::array<Masked, 4> all_;
    std::pmr::vector<std::uint32_t> ids_; // who goes into an index, and where they are
    std::pmr::vector<Aabb<Dim, T>> boxes_;
};

} // namespace world
JOSTLE_NAMESPACE_END
