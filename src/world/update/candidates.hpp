// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/find_pairs.hpp"
#include "world/objects/pair_lists.hpp"
#include "world/objects/state.hpp"
#include "world/update/arena.hpp"
#include "world/update/changes.hpp"
#include "world/update/entries.hpp"
#include "world/update/neighbour_lists.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// What a search has found.
struct Candidates
{
    // Pairs of objects, by index, that touch and whose filters agree. Strictly ascending: `judge` merges them
    // with those of the last update. Each once: a changed object is an entry, one that hasn't changed is
    // idle, parked or resting, and what still holds an object that changed passes it over. A pair of two
    // objects that are idle is missing; the last update has it.
    std::span<Pair> touching;
    std::uint64_t looked_at = 0; // pairs of boxes that touch
    std::uint64_t rejected = 0;  // of these: kept apart by filters
    std::uint64_t listed = 0;    // objects that have got a list of neighbours
    double us_active = 0, us_resting = 0;
};

/// The stage `find` of an update: finds the pairs of changed objects with all that is there, in the memory of
/// `to`.
template <int Dim, class T>
[[nodiscard]] Candidates find(State<Dim, T>& state, const Entries<Dim, T>& entries, PairFinder& finder,
                              NeighbourLists<Dim, T>& neighbour_lists, PairBuffer& to, Arena& arena);

/// The pairs that stirring objects had with what rested or was parked. Ascending.
template <int Dim, class T>
[[nodiscard]] std::span<const Pair> find_old_pairs(State<Dim, T>& state, const Changes<Dim, T>& changes,
                                                   const Entries<Dim, T>& entries, PairFinder& finder,
                                                   Arena& arena);

using Clock = std::chrono::steady_clock;
[[nodiscard]] inline double microseconds(Clock::time_point from, Clock::time_point to)
{
    return std::chrono::duration<double, std::micro>(to - from).count();
}

} // namespace world
JOSTLE_NAMESPACE_END
