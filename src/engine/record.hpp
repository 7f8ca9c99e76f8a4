// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "base/prefetch.hpp"
#include "jostle/box.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

// A box as stored in a brick, bit by bit. Bounds are quantised: whole numbers of quanta from the brick's
// start.
//
//                31             16 15              0
//     axis[0]   |    -(lo + 1)    |     hi + 1      |   the sweep axis
//     axis[1]   |        "        |        "        |   the grid's second axis
//     axis[2]   |        "        |        "        |   its third; 0 in two dimensions
//                31  30  29 28 27  26              0
//     object    | b | a |2  1  0 |      index       |   flags: b and a, the set that it belongs to;
//                                                       2, 1 and 0: a copy on that axis of the user's
//                                                       (grids order axes as it suits them, and nested ones
//                                                       keep the flags)
//
// - lo is 0 to 2^14 - 1. In a copy, a record of a box that began in a lower brick, the high half is 0: the
//   copy begins before everything in this brick.
// - hi is 0 to 2^14; 2^14 means that the box continues after the brick.
// - hi_a + 1 - (lo_b + 1) is negative if a ends before b begins, zero if both are in one quantum, so that
//   only the user's coordinates can decide (a *tie*), and positive if a certainly reaches b. One addition of
//   two words computes two such differences, one in each half.
// - Two records make a pair in a brick only if they share no flag. Among all bricks that two boxes share,
//   exactly one has no axis on which both are copies: the one where, on each axis, the later of the two
//   begins. It owns the pair. In a search between two sets, flags a and b exclude the pairs within a set; in
//   a search within one set a excludes the pairs of those that don't meet each other, and b isn't used.

/// A brick's edge has 2^14 quanta, so that sums and differences of two bounds fit 16 signed bits.
inline constexpr int quanta_bits = 14;
inline constexpr std::int32_t quanta = 1 << quanta_bits;

inline constexpr int index_bits = 27;
inline constexpr std::uint32_t index_mask = (1u << index_bits) - 1;
inline constexpr std::uint32_t copy_flag(int axis) // of the user's
{
    return 1u << (index_bits + axis);
}
inline constexpr std::uint32_t side_a = 1u << 30;
inline constexpr std::uint32_t side_b = 1u << 31;
/// Orders objects: every object of the first set is less than every object of the
/// second.
inline constexpr std::uint32_t object_mask = index_mask | side_a | side_b;

struct alignas(16) Record
{
    std::uint32_t axis[3];
    std::uint32_t object;
};

constexpr std::uint32_t pack_axis(std::int32_t lo_negated, std::int32_t hi) noexcept
{
    return (static_cast<std::uint32_t>(lo_negated) << 16) | static_cast<std::uint32_t>(hi);
}

/// Never overlaps a record, nor another padding record: hi below every lo, lo above every hi, all flags.
inline constexpr Record padding_record = {{0x8000ffffu, 0x8000ffffu, 0x8000ffffu}, ~std::uint32_t{0}};

/// The bricks of a grid: `cells[p]` bricks along the user's axis `axis[p]`; p = 0 is the sweep axis.
/// Everything before the first brick belongs to the first, and everything after the last to the last, so that
/// the map from coordinates to quanta is monotonic over all numbers and the world has no bounds.
template <class T>
struct Grid
{
    int axis[3] = {0, 1, 2};
    T origin[3] = {0, 0, 0};
    T scale[3] = {1, 1, 1}; // quanta per unit
    T last[3] = {0, 0, 0};  // the greatest value below cells * 2^14
    std::int32_t cells[3] = {1, 1, 1};
    /// Every box seen begins and ends at `origin` on this axis, as on an unused third axis. Quanta then
    /// only tell before, at and after; otherwise all pairs would be ties.
    bool flat[3] = {false, false, false};
    /// A brick's number is x + cells_x (y + cells_y z).
    [[nodiscard]] std::uint32_t bricks() const noexcept
    {
        return static_cast<std::uint32_t>(cells[0]) * static_cast<std::uint32_t>(cells[1]) *
               static_cast<std::uint32_t>(cells[2]);
    }
};

/// The boxes of a call. Without a second set, `b` is empty and objects carry no side.
template <int Dim, class T>
struct Boxes
{
    BoxView<Dim, T> a;
    BoxView<Dim, T> b;
    bool cross = false;
    /// Objects of one set from this number on meet only those before it: all of them have side a.
    std::size_t loners = ~std::size_t{0};

    [[nodiscard]] std::size_t size() const noexcept { return a.size() + b.size(); }
    [[nodiscard]] Aabb<Dim, T> operator[](std::uint32_t object) const noexcept
    {
        return object & side_b ? b[object & index_mask] : a[object & index_mask];
    }
    void prefetch(std::uint32_t object) const noexcept
    {
        const BoxView<Dim, T>& set = object & side_b ? b : a;
        jostle::prefetch(set.lo_pointer(0, object & index_mask));
        jostle::prefetch(set.hi_pointer(Dim - 1, object & index_mask));
    }
};

} // namespace engine
JOSTLE_NAMESPACE_END
