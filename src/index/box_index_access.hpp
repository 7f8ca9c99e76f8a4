// SPDX-License-Identifier: MIT
#pragma once

#include <type_traits>

#include "index/kernels/kernels.hpp"
#include "index/tree.hpp"
#include "jostle/box_index.hpp"
#include "jostle/function_ref.hpp"

JOSTLE_NAMESPACE_BEGIN

/// What World may do with its index beyond the public interface.
class BoxIndexAccess
{
  public:
    /// Whatever can be viewed as boxes: the index says of which kind they are.
    template <int Dim, class T>
    using Boxes = std::type_identity_t<BoxView<Dim, T>>;

    template <int Dim, Coordinate T>
    [[nodiscard]] static const index::Tree<Dim, T>& tree(const BoxIndex<Dim, T>& index) noexcept;
    /// Finds what valid boxes touch, for `around`, which returns it for box k, in any order and until the
    /// next call.
    template <int Dim, Coordinate T>
    static void look_around(BoxIndex<Dim, T>& index, const Boxes<Dim, T>& boxes);
    template <int Dim, Coordinate T>
    [[nodiscard]] static std::span<const index::Seen<Dim, T>> around(const BoxIndex<Dim, T>& index,
                                                                     std::size_t k) noexcept;
    /// BoxIndex::insert, move and erase of ids and boxes that are known to be good.
    template <int Dim, Coordinate T>
    static void insert(BoxIndex<Dim, T>& index, std::span<const std::uint32_t> ids,
                       const Boxes<Dim, T>& boxes);
    template <int Dim, Coordinate T>
    static void move(BoxIndex<Dim, T>& index, std::span<const std::uint32_t> ids, const Boxes<Dim, T>& boxes);
    template <int Dim, Coordinate T>
    static void erase(BoxIndex<Dim, T>& index, std::span<const std::uint32_t> ids) noexcept;
    /// See Tree::expect_to_come_back.
    template <int Dim, Coordinate T>
    static void expect_to_come_back(BoxIndex<Dim, T>& index) noexcept;
    /// BoxIndex::build in the memory that there is. If it throws, the index is empty.
    template <int Dim, Coordinate T>
    static void rebuild(BoxIndex<Dim, T>& index, std::span<const std::uint32_t> ids,
                        const Boxes<Dim, T>& boxes);
    /// See Tree::follow.
    template <int Dim, Coordinate T>
    static bool follow(BoxIndex<Dim, T>& index, typename index::Tree<Dim, T>::Where where);
};

JOSTLE_NAMESPACE_END
