// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "index/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

// The nodes that searches go through. The trie is cut into pieces with up to 16 ends; a wide node stands for
// each, and looks like a leaf with children in place of objects.

/// Has a piece begin at a fork, or not; of a page nothing.
template <int Dim, class T>
void set_piece(Parts<Dim, T>& parts, Ref ref, bool begins) noexcept;

/// Decides which children of a fork begin a piece of their own: pieces have at most 16 ends, and where both
/// sides together have more, they are cut off; both, or the tree would be deeper than need be.
template <int Dim, class T>
void cut(Parts<Dim, T>& parts, std::uint32_t number) noexcept;

/// Brings the wide nodes in order from `fork` up to the root.
template <int Dim, class T>
void repack(Parts<Dim, T>& parts, std::uint32_t fork) noexcept;

/// Tells what holds a page or wide node about its bounds, up to the root.
template <int Dim, class T>
void refit(Parts<Dim, T>& parts, std::uint32_t wide_number, std::uint32_t lane, Child<Dim, T> child,
           const Aabb<Dim, T>& hull) noexcept;

/// Shows the searches where to begin.
template <int Dim, class T>
void show_root(Parts<Dim, T>& parts) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
