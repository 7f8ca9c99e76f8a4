// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "index/tree/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

// Which pages there are: space is halved at fixed places until no part has more than 256 objects, and the
// halvings form a binary trie.

/// Neighbouring pages with no more objects in total are joined.
inline constexpr std::uint32_t merge_below = 144;

/// Whether a key is in a page's space.
template <int Dim, class T>
bool is_in(const Parts<Dim, T>& parts, const Page<Dim, T>& page, const Key<Dim>& key) noexcept
{
    return page.parent == none || first_difference(key, page.key) > parts.forks[page.parent].level;
}

/// The page that a key leads to.
template <int Dim, class T>
std::uint32_t descend(const Parts<Dim, T>& parts, const Key<Dim>& key) noexcept;

/// Returns the page to which an object with this key belongs, with room for it.
template <int Dim, class T>
std::uint32_t make_room(Parts<Dim, T>& parts, const Key<Dim>& key);

/// Removes an empty page.
template <int Dim, class T>
void remove_page(Parts<Dim, T>& parts, std::uint32_t number) noexcept;

/// Joins a page with its neighbour if both have at most `most` objects in total.
template <int Dim, class T>
bool merge(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t most) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
