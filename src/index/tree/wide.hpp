// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "index/tree/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

// The nodes that searches go through. The trie is cut into pieces with up to 16 ends; a wide node stands for
// each, and looks like a leaf with children in place of objects.

/// Makes a piece begin at a fork, or not; does nothing for a page.
template <int Dim, class T>
void set_piece(Parts<Dim, T>& parts, Ref ref, bool begins) noexcept;

/// Decides which children of a fork begin a piece of their own. Pieces have at most 16 ends. If both sides
/// together have more, both are cut off, because cutting off one would make the tree deeper.
template <int Dim, class T>
void cut(Parts<Dim, T>& parts, std::uint32_t number) noexcept;

/// Updates the wide nodes from `fork` up to the root.
template <int Dim, class T>
void repack(Parts<Dim, T>& parts, std::uint32_t fork) noexcept;

/// Passes the bounds of a page or wide node on to the node that holds it, up to the root.
template <int Dim, class T>
void refit(Parts<Dim, T>& parts, std::uint32_t wide_number, std::uint32_t lane, Child<Dim, T> child,
           const Aabb<Dim, T>& hull) noexcept;

/// Shows the searches where to begin.
template <int Dim, class T>
void show_root(Parts<Dim, T>& parts) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
