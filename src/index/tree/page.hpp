// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "index/tree/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

// The contents of a page: up to 256 objects in up to 16 leaves. Pages are named by their numbers.

/// An object's place in its page.
struct Place
{
    std::uint32_t leaf, lane;
};

/// Makes room for one more page, in the pool and in the list.
template <int Dim, class T>
void reserve_page(Parts<Dim, T>& parts)
{
    parts.pages.reserve(1);
    if (parts.listed.capacity() < parts.pages.in_use() + 1)
        parts.listed.reserve(2 * parts.pages.in_use() + 64);
}

/// Takes an empty page from the pool, which has one.
template <int Dim, class T>
std::uint32_t new_page(Parts<Dim, T>& parts, const Key<Dim>& key) noexcept;

/// Returns a page and its leaves to the pools.
template <int Dim, class T>
void give_page(Parts<Dim, T>& parts, std::uint32_t number) noexcept;

/// The place of an object of the page.
template <int Dim, class T>
Place find(const Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id) noexcept;

/// Lists the page to be finished at the end of the change. There is room in the list.
template <int Dim, class T>
void list(Parts<Dim, T>& parts, std::uint32_t number) noexcept;

/// Adds an object to a page that has room for it, and for a leaf if it needs one. The caller updates
/// `page_of`.
template <int Dim, class T>
void put(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id, const Aabb<Dim, T>& box) noexcept;

/// Removes an object from its page; its lane stays empty until another takes it.
template <int Dim, class T>
void remove_one(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id) noexcept;

/// Appends the objects of a page to `objects`.
template <int Dim, class T>
void gather(const Parts<Dim, T>& parts, std::uint32_t number, Gathered<Dim, T>& objects) noexcept;

/// The size of the leaves of a page: the sum of their edges.
template <int Dim, class T>
T spread_of(const Page<Dim, T>& page) noexcept;

/// Replaces the objects of a page by these, sorted into leaves, which come from the pool and go back to it.
template <int Dim, class T>
void arrange(Parts<Dim, T>& parts, std::uint32_t number, const Gathered<Dim, T>& objects) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
