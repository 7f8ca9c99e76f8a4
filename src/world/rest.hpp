// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "jostle/find_pairs.hpp"
#include "world/arena.hpp"
#include "world/changes.hpp"
#include "world/entries.hpp"
#include "world/neighbour_lists.hpp"
#include "world/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Who is active after an update, and who comes to rest.
template <int Dim, class T>
struct Rest
{
    bool same_active; // those that were, and each has changed: then `active` is empty
    std::pmr::vector<typename State<Dim, T>::Active>& active; // ascending
    std::pmr::vector<std::uint32_t>& settling;                // indices; those that are parked first
    std::size_t parking = 0; // so many of those that are staged in Parked are parked
};

/// The stage `plan_rest` of an update, the last that can fail; then the index is as it was. Objects that come
/// to rest are in the index when it returns; those that wake up still are.
template <int Dim, class T>
[[nodiscard]] Rest<Dim, T> plan_rest(State<Dim, T>& state, const Changes<Dim, T>& changes,
                                     const Entries<Dim, T>& entries, NeighbourLists<Dim, T>& neighbour_lists,
                                     PairFinder& finder, Arena& arena);

} // namespace world
JOSTLE_NAMESPACE_END
