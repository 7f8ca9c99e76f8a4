// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "index/tree/key_order.hpp"
#include "index/tree/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Working memory for building, empty before and afterwards.
struct BuildMemory
{
    struct Plan
    {
        std::uint32_t page;
        std::size_t begin; // of its entries
    };
    KeyMemory keys;
    std::pmr::vector<Plan> pages;

    explicit BuildMemory(std::pmr::memory_resource* memory) : keys(memory), pages(memory) {}
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return keys.bytes() + pages.capacity() * sizeof(Plan);
    }
    void release() noexcept
    {
        keys.release();
        pages.clear();
        pages.shrink_to_fit();
    }
};

/// Fills an empty tree whose `page_of` has room for the ids (without ids, for the boxes' positions): all
/// objects are sorted by the leading digits of their keys, on all threads, and the sequence is cut into
/// pages. If it throws, the parts must be cleared.
template <int Dim, class T>
void build(Parts<Dim, T>& parts, std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes,
           BuildMemory& memory);

} // namespace index
JOSTLE_NAMESPACE_END
