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

/// The results of a search.
struct Candidates
{
    // Pairs of objects, by index, that touch and whose filters agree. Strictly ascending: `judge` merges them
    // with those of the last update. Each is found once: a changed object is an entry, an unchanged one is
    // idle, parked or resting, and a structure that still has a changed object skips it. Pairs of two idle
    // objects are missing; the last update has them.
    std::span<Pair> touching;
    std::uint64_t looked_at = 0; // pairs of touching boxes
    std::uint64_t rejected = 0;  // of these: rejected by filters
    std::uint64_t listed = 0;    // objects that got a list of neighbours
    double us_active = 0, us_resting = 0;
};

/// The stage `find` of an update: finds the pairs of changed objects with all objects, in the memory of `to`.
template <int Dim, class T>
[[nodiscard]] Candidates find(State<Dim, T>& state, const Entries<Dim, T>& entries, PairFinder& finder,
                              NeighbourLists<Dim, T>& neighbour_lists, PairBuffer& to, Arena& arena);

/// The old pairs of Entries::stirring with resting or parked objects. Ascending.
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
