// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Which objects of a search are images, and which objects these don't pair with.
struct ImageRule
{
    std::uint32_t originals = 0; ///< the first objects; the rest are images, no two of which make a pair
    /// Empty, or for each object a bit set of axes: for an original those along which it is infinite both
    /// ways, for an image those along which it is shifted. Two objects with an axis in common don't make a
    /// pair: an object that is infinite along an axis already meets the image's original, or another image of
    /// it.
    std::span<const std::uint8_t> axes;

    /// a < b.
    [[nodiscard]] bool allows(std::uint32_t a, std::uint32_t b) const noexcept
    {
        return b < originals || (a < originals && (axes.empty() || (axes[a] & axes[b]) == 0));
    }
};

/// Throws unless every given array has one element per object.
void check_filter(const Filter& filter, std::size_t size);
void check_filter(const SceneFilter& filter, std::size_t size);
void check_filter(const CrossFilter& filter, std::size_t size_a, std::size_t size_b);

/// The definition of the filters, without `accept`. Between two sets `b` belongs to the second.
bool passes(const Filter& filter, std::size_t a, std::size_t b) noexcept;
bool passes(const SceneFilter& filter, std::size_t a, std::size_t b) noexcept; // positions among all boxes
bool passes(const CrossFilter& filter, std::size_t a, std::size_t b) noexcept;

/// The same for many pairs: the arrays of a filter, packed. Without `accept` and images.
struct PackedFilter
{
    explicit PackedFilter(std::pmr::memory_resource* memory) : masks(memory), owners(memory), vertices(memory)
    {
    }

    std::pmr::vector<std::uint64_t> masks;  ///< of each object: the mask, and below it the category; or none
    std::pmr::vector<std::uint32_t> owners; ///< or none
    std::pmr::vector<std::array<std::uint32_t, 3>> vertices; ///< or none; within one set
    std::size_t second = 0;                                  ///< where objects of a second set begin

    void pack(const Filter& filter, std::size_t size);
    void pack(const CrossFilter& filter, std::size_t size_a);
    void clear() noexcept;
    /// Moves the pairs that pass to the front, in their order, and returns their end.
    Pair* keep_passing(Pair* first, Pair* last) const noexcept;
};

JOSTLE_NAMESPACE_END
