// SPDX-License-Identifier: MIT
#pragma once

#include "index/groups.hpp"
#include "jostle/box_index.hpp"

JOSTLE_NAMESPACE_BEGIN

/// What World asks of its index beyond what everybody may.
class BoxIndexAccess
{
  public:
    /// BoxIndex::join of valid boxes. Box a is searched for in the blocks of starts[a], if there are any,
    /// instead of in the index.
    template <int Dim, Coordinate T>
    static void join(BoxIndex<Dim, T>& index, const BoxView<Dim, T>& boxes,
                     std::span<const index::Start<Dim, T>> starts, std::pmr::vector<Pair>& out);
    /// BoxIndex::insert and erase of ids and boxes that are known to be good.
    template <int Dim, Coordinate T>
    static void insert(BoxIndex<Dim, T>& index, std::span<const std::uint32_t> ids,
                       const BoxView<Dim, T>& boxes);
    template <int Dim, Coordinate T>
    static void erase(BoxIndex<Dim, T>& index, std::span<const std::uint32_t> ids) noexcept;
};

JOSTLE_NAMESPACE_END
