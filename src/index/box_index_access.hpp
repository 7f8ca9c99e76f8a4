// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "index/kernels/kernels.hpp"
#include "index/tree/tree.hpp"
#include "jostle/box_index.hpp"

JOSTLE_NAMESPACE_BEGIN

/// What World may do with its index beyond the public interface.
class BoxIndexAccess
{
  public:
    /// Whatever can be viewed as boxes: the index says of which kind they are.
    template <int Dim, class T>
    using Boxes = std::type_identity_t<BoxView<Dim, T>>;

    /// Ids and boxes that a tree is given are known to be good, and so is the moment to change it.
    template <int Dim, Coordinate T>
    [[nodiscard]] static index::Tree<Dim, T>& tree(BoxIndex<Dim, T>& index) noexcept;
    template <int Dim, Coordinate T>
    [[nodiscard]] static const index::Tree<Dim, T>& tree(const BoxIndex<Dim, T>& index) noexcept;
    /// BoxIndex::join with the objects of any tree, in the working memory of an index.
    template <int Dim, Coordinate T, class Allocator>
    static void join(BoxIndex<Dim, T>& index, const index::Tree<Dim, T>& tree, const Boxes<Dim, T>& boxes,
                     std::vector<Pair, Allocator>& out);
    /// Finds what valid boxes touch, for `around`, which returns it for box k, in any order and until the
    /// next call.
    template <int Dim, Coordinate T>
    static void look_around(BoxIndex<Dim, T>& index, const Boxes<Dim, T>& boxes);
    template <int Dim, Coordinate T>
    [[nodiscard]] static std::span<const index::Seen<Dim, T>> around(const BoxIndex<Dim, T>& index,
                                                                     std::size_t k) noexcept;
    /// BoxIndex::build in the memory that there is. If it throws, the index is empty.
    template <int Dim, Coordinate T>
    static void rebuild(BoxIndex<Dim, T>& index, std::span<const std::uint32_t> ids,
                        const Boxes<Dim, T>& boxes)
    {
        index.clear();
        tree(index).put(ids, boxes);
    }
};

JOSTLE_NAMESPACE_END
