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

/// Sorts a list. Most of what a region finds it finds in order, so it is often sorted already.
template <class Pair>
void sort_pairs(std::pmr::vector<Pair>& list)
{
    if (std::is_sorted(list.begin(), list.end(), ascends<Pair>)) return;
    // Pairs are long: what is sorted is where they lie.
    struct Key
    {
        std::uint64_t a, b;
        std::size_t at;
    };
    std::pmr::vector<Key> keys(list.get_allocator());
    keys.reserve(list.size());
    for (const Pair& pair : list)
        keys.push_back({pair.a, pair.b, keys.size()});
    std::sort(keys.begin(), keys.end(), ascends<Key>);
    std::pmr::vector<Pair> sorted(list.get_allocator());
    sorted.reserve(list.size());
    for (const Key& key : keys)
        sorted.push_back(list[key.at]);
    list.swap(sorted);
}

/// What an update tells the user of one rank.
template <int Dim, Coordinate T>
struct Lists
{
    explicit Lists(std::pmr::memory_resource* memory)
        : began(memory),
          persisted(memory),
          changed(memory),
          ended(memory),
          arrived(memory),
          departed(memory),
          payloads(memory)
    {
    }
    std::pmr::vector<Pair<Dim, T>> began, persisted;
    mutable std::pmr::vector<Pair<Dim, T>> changed; ///< both, once somebody has asked
    std::pmr::vector<EndedPair> ended;
    std::pmr::vector<Arrival> arrived;
    std::pmr::vector<std::uint64_t> departed;
    std::pmr::vector<std::pmr::vector<std::byte>> payloads; ///< what `arrived` shows

    /// All but pairs that touch: this rank's region has those in order.
    void sort()
    {
        sort_pairs(ended);
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
        arrived.clear();
        departed.clear();
        payloads.clear();
    }
};

} // namespace mpi
JOSTLE_NAMESPACE_END
