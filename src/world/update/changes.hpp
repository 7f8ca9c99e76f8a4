// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "world/objects/pair_lists.hpp"
#include "world/objects/state.hpp"
#include "world/update/arena.hpp"
#include "world/update/commands.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// What commands have changed: which objects differ from the last update, and their old state. Unless it is
/// kept, its destructor restores the old state.
template <int Dim, class T>
class Changes
{
  public:
    struct OldFilter
    {
        Index index;
        ObjectFilter filter;
    };
    struct OldReach
    {
        Index index;
        bool had_reach;
        Reach<Dim, T> reach;
    };

    Changes(State<Dim, T>& state, Arena& arena);
    Changes(const Changes&) = delete;
    Changes& operator=(const Changes&) = delete;
    ~Changes()
    {
        if (state_ != nullptr) undo();
    }
    void keep() noexcept { state_ = nullptr; }

    /// Ascending once all commands are applied.
    [[nodiscard]] const std::pmr::vector<Index>& objects() const noexcept { return objects_; }
    /// Of any object: what it was after the last update.
    [[nodiscard]] ObjectFilter old_filter(Index index) const noexcept;
    /// Of one with `reach_kept`; null if it had none.
    [[nodiscard]] const Reach<Dim, T>* old_reach(Index index) const noexcept;
    /// What was kept of filters and reaches, in any order, each object once.
    [[nodiscard]] std::span<const OldFilter> old_filters() const noexcept { return old_filters_; }
    [[nodiscard]] std::span<const OldReach> old_reaches() const noexcept { return old_reaches_; }
    /// Whether there are pairs to be reported as if they were new, and whether this one is.
    [[nodiscard]] bool any_again() const noexcept { return !again_.empty(); }
    [[nodiscard]] bool is_again(const Pair& pair) const noexcept;
    /// Of a pair that touched after the last update: whether `accept` is asked about it if it still does.
    [[nodiscard]] bool is_asked_again(const Pair& pair) const noexcept;

    std::uint64_t commands = 0;
    std::uint64_t dropped = 0;   // of these, because their objects are gone
    std::uint64_t contested = 0; // objects that commands of several threads are about

    // For those who apply commands:
    [[nodiscard]] std::pmr::vector<Index>& list() noexcept { return objects_; }
    void keep_filter(Index index, const ObjectFilter& filter) { old_filters_.push_back({index, filter}); }
    void keep_reach(const OldReach& reach) { old_reaches_.push_back(reach); }
    /// The pair of an object with another one, or with everyone.
    static constexpr Index everyone{~std::uint32_t{0}};
    void report_again(Index index, Index other)
    {
        again_.push_back(key_of(pair_of(index, other)));
        state_->objects[index].set(flag::again);
    }
    /// Makes an object what it was after the last update, or nothing if it is new.
    void reset(Index index) noexcept;
    /// So that finding what an object was is quick for all that was kept until now.
    void sort_filters();
    void sort_reaches() noexcept;
    /// So that is_again() knows what was said until now.
    void sort_again() noexcept;
    /// Brings the list into order, without the objects that commands left as they were.
    void close(Arena& arena);

  private:
    void undo() noexcept;
    [[nodiscard]] bool is_unchanged(Index index) const noexcept;

    State<Dim, T>* state_;
    std::pmr::vector<Index>& objects_;
    std::pmr::vector<OldFilter>& old_filters_;
    std::pmr::vector<OldReach>& old_reaches_;
    std::pmr::vector<Key>& again_; // ascending after sort_again()
    std::pmr::vector<OldFilter>& scratch_;
    std::size_t sorted_filters_ = 0, sorted_reaches_ = 0; // how many of them are in order, from the first on
};

/// Whether two objects whose boxes touch don't count as a pair for queries, because `accept` is against it.
/// Pairs about which the next update will ask again count.
template <int Dim, class T>
[[nodiscard]] bool is_shown_refused(const State<Dim, T>& state, const Pair& pair) noexcept
{
    if (!state.refused.contains(key_of(pair))) return false;
    return state.shown == nullptr || !state.shown->is_asked_again(pair);
}

/// Moves that the caller of update() gives, as if its thread had queued them last.
template <int Dim, class T>
struct Moves
{
    std::span<const ObjectId> ids;
    BoxView<Dim, T> boxes;
};

} // namespace world
JOSTLE_NAMESPACE_END
