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

/// The changes made by commands: which objects differ from the last update, and their old state. Unless the
/// changes are kept, the destructor restores the old state.
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
    /// The state of any object after the last update.
    [[nodiscard]] ObjectFilter old_filter(Index index) const noexcept;
    /// The old reach of an object with `reach_kept`; null if it had none.
    [[nodiscard]] const Reach<Dim, T>* old_reach(Index index) const noexcept;
    /// The old filters and reaches, in any order, each object once.
    [[nodiscard]] std::span<const OldFilter> old_filters() const noexcept { return old_filters_; }
    [[nodiscard]] std::span<const OldReach> old_reaches() const noexcept { return old_reaches_; }
    /// Whether any pairs are to be reported as new, and whether this one is.
    [[nodiscard]] bool any_again() const noexcept { return !again_.empty(); }
    [[nodiscard]] bool is_again(const Pair& pair) const noexcept;
    /// Whether `accept` is called for a pair that touched after the last update, if it still does.
    [[nodiscard]] bool is_asked_again(const Pair& pair) const noexcept;

    std::uint64_t commands = 0;
    std::uint64_t dropped = 0;   // of these, because their objects are gone
    std::uint64_t contested = 0; // objects with commands from several threads

    // For the code that applies commands:
    [[nodiscard]] std::pmr::vector<Index>& list() noexcept { return objects_; }
    void keep_filter(Index index, const ObjectFilter& filter) { old_filters_.push_back({index, filter}); }
    void keep_reach(const OldReach& reach) { old_reaches_.push_back(reach); }
    /// The pair of an object with another one, or with all objects.
    static constexpr Index everyone{~std::uint32_t{0}};
    void report_again(Index index, Index other)
    {
        again_.push_back(key_of(pair_of(index, other)));
        state_->objects[index].set(flag::again);
    }
    /// Restores an object's state after the last update; a new object is removed.
    void reset(Index index) noexcept;
    /// Sorts, so that lookups of what was kept until now are fast.
    void sort_filters();
    void sort_reaches() noexcept;
    /// Sorts, so that is_again() finds what was added until now.
    void sort_again() noexcept;
    /// Sorts the list, and drops objects that commands left unchanged.
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
    std::size_t sorted_filters_ = 0, sorted_reaches_ = 0; // how many of them are sorted, from the first on
};

/// Whether two objects whose boxes touch don't count as a pair for queries, because `accept` refused it.
/// Pairs for which the next update will call it again count.
template <int Dim, class T>
[[nodiscard]] bool is_shown_refused(const State<Dim, T>& state, const Pair& pair) noexcept
{
    if (!state.refused.contains(key_of(pair))) return false;
    return state.shown == nullptr || !state.shown->is_asked_again(pair);
}

/// Moves given to update(), as if the calling thread had queued them last.
template <int Dim, class T>
struct Moves
{
    std::span<const ObjectId> ids;
    BoxView<Dim, T> boxes;
};

} // namespace world
JOSTLE_NAMESPACE_END
