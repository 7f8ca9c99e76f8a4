// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "index/tree/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

// The nodes that searches visit. The trie is cut into pieces with up to 16 ends; a wide node replaces each,
// and looks like a leaf with children instead of objects.

/// Makes a piece begin at a fork, or not begin there; does nothing for a page.
template <int Dim, class T>
void set_piece(Parts<Dim, T>& parts, Ref ref, bool begins) noexcept;

/// Decides which children of a fork begin a new piece. Pieces have at most 16 ends. If both sides have more
/// in total, both are cut off, because cutting off one would make the tree deeper.
template <int Dim, class T>
void cut(Parts<Dim, T>& parts, std::uint32_t number) noexcept;

/// Updates the wide nodes from `fork` up to the root.
template <int Dim, class T>
void repack(Parts<Dim, T>& parts, std::uint32_t fork) noexcept;

/// Propagates the bounds of a page or wide node to its parent, up to the root.
template <int Dim, class T>
void refit(Parts<Dim, T>& parts, std::uint32_t wide_number, std::uint32_t lane, Child<Dim, T> child,
           const Aabb<Dim, T>& hull) noexcept;

/// Sets where searches begin.
template <int Dim, class T>
void show_root(Parts<Dim, T>& parts) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
