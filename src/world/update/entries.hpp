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

// Moving objects within the index is worth it where so few of them change: one in this many.
constexpr std::size_t resting_per_changed = 16;

/// What an update searches for: changed objects that are there, then idle ones, which are active but haven't
/// changed this time. Boxes lie side by side, so that searching doesn't visit objects.
template <int Dim, class T>
struct Entries
{
    explicit Entries(Arena& arena)
        : box(arena.take<Table<Entry, Aabb<Dim, T>>>("boxes of entries")),
          index(arena.take<Table<Entry, Index>>("indices of entries")),
          filter(arena.take<Table<Entry, FilterClass>>("filters of entries")),
          moves_on(arena.take<Table<Entry, std::uint8_t>>("entries that were active")),
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
    Table<Entry, std::uint8_t>& moves_on; // it was active after the last update
    std::size_t changed = 0;              // how many of them are changed objects

    // Changed objects that rested, as ids of the index of resting objects: those that leave it, also removed
    // ones, and those that move within it.
    std::pmr::vector<std::uint32_t>& rested;
    std::pmr::vector<std::uint32_t>&waking, &shifting;
    // Changed objects whose old pairs are in no list: those in `rested`, those that were parked, and all
    // changed objects in an update that parks others.
    std::pmr::vector<Index>& stirring;
    std::pmr::vector<Aabb<Dim, T>>& boxes_before; // of these
    bool parks = false;                           // what is active and hasn't changed is being parked
    std::size_t parking = 0;                      // so many of those that are staged in Parked
    // All changed objects were active before, are active now, and have the same filter as before.
    bool only_moves = true;
    bool all_of_active = false; // the changed objects are all objects that were active, and no others
    // Some active objects haven't changed. They are entered only where some object has.
    bool any_idle = false;
};

/// The stage `enter` of an update: puts what is searched for side by side, and stages in `state.parked` whom
/// the update will park.
template <int Dim, class T>
[[nodiscard]] Entries<Dim, T> enter(State<Dim, T>& state, std::span<const Index> changed, Arena& arena);

} // namespace world
JOSTLE_NAMESPACE_END
