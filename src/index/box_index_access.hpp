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

/// What World can do with its index beyond the public interface.
class BoxIndexAccess
{
  public:
    /// Anything that can be viewed as boxes; the index determines their kind.
    template <int Dim, class T>
    using Boxes = std::type_identity_t<BoxView<Dim, T>>;

    /// Ids and boxes given to a tree are known to be valid, and it is known that the tree may be changed.
    template <int Dim, Coordinate T>
    [[nodiscard]] static index::Tree<Dim, T>& tree(BoxIndex<Dim, T>& index) noexcept;
    template <int Dim, Coordinate T>
    [[nodiscard]] static const index::Tree<Dim, T>& tree(const BoxIndex<Dim, T>& index) noexcept;
    /// BoxIndex::join with the objects of any tree, in the working memory of an index.
    template <int Dim, Coordinate T, class Allocator>
    static void join(BoxIndex<Dim, T>& index, const index::Tree<Dim, T>& tree, const Boxes<Dim, T>& boxes,
                     std::vector<Pair, Allocator>& out);
    /// Finds what valid boxes touch. `around` then returns it for box k, in any order, until the next call.
    template <int Dim, Coordinate T>
    static void look_around(BoxIndex<Dim, T>& index, const Boxes<Dim, T>& boxes);
    template <int Dim, Coordinate T>
    [[nodiscard]] static std::span<const index::Seen<Dim, T>> around(const BoxIndex<Dim, T>& index,
                                                                     std::size_t k) noexcept;
    /// BoxIndex::build in the existing memory. If it throws, the index is empty.
    template <int Dim, Coordinate T>
    static void rebuild(BoxIndex<Dim, T>& index, std::span<const std::uint32_t> ids,
                        const Boxes<Dim, T>& boxes)
    {
        index.clear();
        tree(index).put(ids, boxes);
    }
};

JOSTLE_NAMESPACE_END
