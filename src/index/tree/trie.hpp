// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "index/tree/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

// Which pages there are: space is halved at fixed places until no part has more than 256 objects, and the
// halvings form a binary trie.

/// Pages with no more objects together become one.
inline constexpr std::uint32_t merge_below = 144;

/// Whether a key lies in the space that a page stands for.
template <int Dim, class T>
bool is_in(const Parts<Dim, T>& parts, const Page<Dim, T>& page, const Key<Dim>& key) noexcept
{
    return page.parent == none || first_difference(key, page.key) > parts.forks[page.parent].level;
}

/// The page that a key leads to.
template <int Dim, class T>
std::uint32_t descend(const Parts<Dim, T>& parts, const Key<Dim>& key) noexcept;

/// Returns the page that an object with this key belongs to, with room for it.
template <int Dim, class T>
std::uint32_t make_room(Parts<Dim, T>& parts, const Key<Dim>& key);

/// Takes an empty page out.
template <int Dim, class T>
void remove_page(Parts<Dim, T>& parts, std::uint32_t number) noexcept;

/// Joins a page with the one beside it if both together have no more objects than `most`.
template <int Dim, class T>
bool merge(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t most) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
