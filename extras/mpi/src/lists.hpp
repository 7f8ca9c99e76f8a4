// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <memory_resource>
#include <vector>

#include "jostle/mpi.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// Of pairs of two lists at most one has any (a, b), and no list has it twice.
template <class Pair>
[[nodiscard]] bool ascends(const Pair& x, const Pair& y) noexcept
{
    return x.a != y.a ? x.a < y.a : x.b < y.b;
}

/// What a PairList shows: where the objects of pairs lie, in order, and those pairs that other ranks have
/// told, as they came.
template <int Dim, Coordinate T>
struct ListedPairs
{
    explicit ListedPairs(std::pmr::memory_resource* memory) : places(memory), told(memory) {}
    std::pmr::vector<jostle::Pair> places;
    std::pmr::vector<Pair<Dim, T>> told;

    void clear() noexcept
    {
        places.clear();
        told.clear();
    }
};

/// What an update tells the user of one rank.
template <int Dim, Coordinate T>
struct Lists
{
    explicit Lists(std::pmr::memory_resource* memory)
        : began(memory),
          persisted(memory),
          changed(memory),
          ended(memory),
          ended_out_of_order(memory),
          arrived(memory),
          departed(memory),
          payloads(memory)
    {
    }
    ListedPairs<Dim, T> began, persisted;
    mutable ListedPairs<Dim, T> changed; ///< both, once somebody has asked
    std::pmr::vector<EndedPair> ended;
    std::pmr::vector<EndedPair> ended_out_of_order; ///< until they are put there
    std::pmr::vector<Arrival> arrived;
    std::pmr::vector<std::uint64_t> departed;
    std::pmr::vector<std::pmr::vector<std::byte>> payloads; ///< what `arrived` shows

    /// All but pairs, which this rank's region puts in order.
    void sort()
    {
        std::sort(arrived.begin(), arrived.end(),
                  [](const Arrival& a, const Arrival& b) { return a.id < b.id; });
        std::sort(departed.begin(), departed.end());
    }
    void clear() noexcept
    {
        began.clear();
        persisted.clear();
        changed.clear();
        ended.clear();
        ended_out_of_order.clear();
        arrived.clear();
        departed.clear();
        payloads.clear();
    }
};

} // namespace mpi
JOSTLE_NAMESPACE_END
