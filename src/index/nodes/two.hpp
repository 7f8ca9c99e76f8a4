// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>

#include "base/buffer.hpp"
#include "index/nodes/groups.hpp"
#include "jostle/query.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// A node or a leaf with the bounds of everything in it: a lane of its parent. A root has no parent.
template <int Dim, class T>
struct Side
{
    Child<Dim, T> group;
    const Node<Dim, T>* above;
    std::uint32_t lane;
};

/// Two groups that may have pairs between them, or a group with itself.
template <int Dim, class T>
struct Two
{
    T at; // their squared distance
    Side<Dim, T> a, b;
};

/// Whether two objects count as a pair; null if all do.
using PairWanted = FunctionRef<bool(std::uint32_t a, std::uint32_t b)>;

/// Two roots, or one root twice: then each pair counts once, with the lesser id first.
template <int Dim, class T>
struct Roots
{
    Child<Dim, T> a, b;
    bool same_set;     // the lesser id comes first also if the roots differ
    PairWanted wanted; // called for an object below a and one below b
};

/// Working memory and results of a search for the closest pairs.
template <int Dim, class T>
struct ClosestWork
{
    Buffer<Two<Dim, T>> twos; // yet to visit, the nearest of a group last
    Buffer<PairHit<T>> best;  // a heap with the worst on top, then sorted
    std::size_t found = 0;

    explicit ClosestWork(std::pmr::memory_resource* memory) : twos(memory), best(memory) {}
    [[nodiscard]] std::uint64_t bytes() const noexcept { return twos.bytes() + best.bytes(); }
};

/// Which pairs a search for the closest finds: the first `wanted` that are apart, come after `after` in
/// order, and are no further than the limit.
template <class T>
struct ClosestAsked
{
    std::size_t wanted;
    T limit;
    PairHit<T> after;
};

} // namespace index
JOSTLE_NAMESPACE_END
