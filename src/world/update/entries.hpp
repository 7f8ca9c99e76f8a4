// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "world/objects/state.hpp"
#include "world/update/arena.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// Moving objects within the index pays if at most one in this many changes.
constexpr std::size_t resting_per_changed = 16;

/// What an update searches: changed objects, then idle ones, which are active but haven't changed this time.
/// Boxes are contiguous, so searching doesn't visit objects.
template <int Dim, class T>
struct Entries
{
    explicit Entries(Arena& arena)
        : box(arena.take<Table<Entry, Aabb<Dim, T>>>("boxes of entries")),
          index(arena.take<Table<Entry, Index>>("indices of entries")),
          filter(arena.take<Table<Entry, FilterClass>>("filters of entries")),
          rested(arena.list<std::uint32_t>("changed objects that rested")),
          waking(arena.list<std::uint32_t>("waking objects")),
          shifting(arena.list<std::uint32_t>("shifting objects")),
          stirring(arena.list<Index>("stirring objects")),
          boxes_before(arena.list<Aabb<Dim, T>>("boxes that stirring objects had"))
    {
    }
    [[nodiscard]] std::size_t size() const noexcept { return index.size(); }

    Table<Entry, Aabb<Dim, T>>& box;
    Table<Entry, Index>& index;
    Table<Entry, FilterClass>& filter;
    std::size_t changed = 0; // how many of them are changed objects

    // Changed objects that rested, as ids of the index of resting objects: those that leave it (also removed
    // ones), and those that move within it.
    std::pmr::vector<std::uint32_t>& rested;
    std::pmr::vector<std::uint32_t>&waking, &shifting;
    // Changed objects whose old pairs are in no list: those in `rested`, and those that were parked.
    std::pmr::vector<Index>& stirring;
    std::pmr::vector<Aabb<Dim, T>>& boxes_before; // of these
    // All changed objects were active before, are active now, and have the same filter as before.
    bool only_moves = true;
    bool all_of_active = false; // the changed objects are all objects that were active, and no others
    // Some active objects haven't changed. They are entered only if some object has.
    bool any_idle = false;
    bool any_shifts = false; // so few resting objects have changed that these may keep resting
};

/// Whether a resting object that has changed keeps resting, and moves within the index.
template <int Dim, class T>
[[nodiscard]] bool shifts(const State<Dim, T>& state, const Entries<Dim, T>& entries, Index index) noexcept
{
    const auto object = state.objects[index];
    return entries.any_shifts && object.place() == Place::resting && object.is_there() &&
           !object.has(flag::shifted | flag::refiltered);
}

/// While it lives, a byte for each object tells whether it is a changed one that rested. Such an object is
/// still in the index with its old box and is found there, but is already found as a changed one.
class Marked
{
  public:
    Marked(std::size_t objects, std::span<const std::uint32_t> rested, Arena& arena)
        : rested_(rested),
          is_marked_(arena.take<Table<Index, std::uint8_t>>("marks of changed objects that rested"))
    {
        if (rested.empty()) return;
        is_marked_.grow(objects);
        for (const std::uint32_t index : rested)
            is_marked_[Index{index}] = 1;
    }
    Marked(const Marked&) = delete;
    Marked& operator=(const Marked&) = delete;
    ~Marked()
    {
        for (const std::uint32_t index : rested_)
            is_marked_[Index{index}] = 0;
    }
    [[nodiscard]] bool operator()(Index index) const noexcept
    {
        return !rested_.empty() && is_marked_[index] != 0;
    }

  private:
    const std::span<const std::uint32_t> rested_;
    Table<Index, std::uint8_t>& is_marked_;
};

/// The stage `enter` of an update: collects the boxes to be searched.
template <int Dim, class T>
[[nodiscard]] Entries<Dim, T> enter(State<Dim, T>& state, std::span<const Index> changed, Arena& arena);

} // namespace world
JOSTLE_NAMESPACE_END
