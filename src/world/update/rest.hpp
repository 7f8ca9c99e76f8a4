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
    bool same_active; // the same as before, and each has changed; then `active` is empty
    std::pmr::vector<typename State<Dim, T>::Active>& active; // ascending
    std::span<const Index> parking;                           // objects to be parked
    /// What is put into the index of resting objects: objects that come to rest, in the order in which they
    /// waited, and those that move at rest.
    std::pmr::vector<std::uint32_t>& indices;
    std::pmr::vector<Aabb<Dim, T>>& boxes;
    std::span<const std::uint32_t> settling, shifting; // of `indices`
};

/// The stage `plan_rest` of an update.
template <int Dim, class T>
[[nodiscard]] Rest<Dim, T> plan_rest(State<Dim, T>& state, const Changes<Dim, T>& changes,
                                     const Entries<Dim, T>& entries, NeighbourLists<Dim, T>& neighbour_lists,
                                     PairFinder& finder, Arena& arena);

} // namespace world
JOSTLE_NAMESPACE_END
