// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "jostle/find_pairs.hpp"
#include "world/objects/state.hpp"
#include "world/update/arena.hpp"
#include "world/update/changes.hpp"
#include "world/update/entries.hpp"
#include "world/update/neighbour_lists.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Which objects are active after an update, which come to rest, and which move where they rest.
template <int Dim, class T>
struct Rest
{
    bool same_active; // those that were, and each has changed: then `active` is empty
    std::pmr::vector<typename State<Dim, T>::Active>& active; // ascending
    std::pmr::vector<std::uint32_t>& settling;                // indices, in the order in which they waited
    std::span<const Index> parking;                           // who waits from now on to come to rest
    std::span<const std::uint32_t> shifting;                  // indices
    std::pmr::vector<Aabb<Dim, T>>& boxes;                    // of those that settle, then of these
};

/// Puts objects that come to rest into the index, and moves those that shift; those that wake up are still in
/// it. It comes after all else that can fail; if it fails itself, the index is as it was.
template <int Dim, class T>
void settle(State<Dim, T>& state, const Rest<Dim, T>& rest);

/// The stage `plan_rest` of an update.
template <int Dim, class T>
[[nodiscard]] Rest<Dim, T> plan_rest(State<Dim, T>& state, const Changes<Dim, T>& changes,
                                     const Entries<Dim, T>& entries, NeighbourLists<Dim, T>& neighbour_lists,
                                     PairFinder& finder, Arena& arena);

} // namespace world
JOSTLE_NAMESPACE_END
