// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "jostle/box.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

// Quantised bounds. A brick's edge has 2^14 quanta, so that sums and differences of two bounds fit 16 signed
// bits.
inline constexpr int quanta_bits = 14;
inline constexpr std::int32_t quanta = 1 << quanta_bits;

// The object word of a record: index | flags. Two records pair in a brick only if they share no flag.
// - copy flags: on that axis of the user's the box began in a lower brick. Of all bricks two boxes share,
//   exactly one, the one that holds the greater lower bound on every axis, sees no axis on which both are
//   copies: it owns the pair.
// - side flags: the set the object belongs to where pairs between two sets are sought; none within one set.
inline constexpr int index_bits = 27;
inline constexpr std::uint32_t index_mask = (1u << index_bits) - 1;
inline constexpr std::uint32_t copy_flag(int axis)
{
    return 1u << (index_bits + axis);
}
inline constexpr std::uint32_t copy_flags = copy_flag(0) | copy_flag(1) | copy_flag(2);
inline constexpr std::uint32_t side_a = 1u << 30;
inline constexpr std::uint32_t side_b = 1u << 31;
/// What tells objects apart: in this order every object of the first set is less than every one of the
/// second.
inline constexpr std::uint32_t object_mask = index_mask | side_a | side_b;

/// A box as a brick stores it. Each word holds one axis, the sweep axis first: in the low half hi + 1, cut at
/// the brick's end (2^14 + 1), in the high half -(lo + 1), or 0 for a box that began in a lower brick; both
/// in quanta from the brick's start. Then hi_a + (-lo_b) is negative when a ends before b begins, zero when
/// both lie in one quantum and only the user's numbers can tell (a tie), positive when a certainly reaches b.
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

/// Where bricks lie: `cells[p]` bricks along axis `axis[p]` of the user's; p = 0 is the sweep axis.
/// Everything before the first brick counts to the first, everything behind the last to the last, so that the
/// map from coordinates to quanta is monotone over all numbers and the world has no bounds.
template <class T>
struct Grid
{
    int axis[3] = {0, 1, 2};
    T origin[3] = {0, 0, 0};
    T scale[3] = {1, 1, 1}; // quanta per unit
    T last[3] = {0, 0, 0};  // the greatest value that lies below cells * 2^14
    std::int32_t cells[3] = {1, 1, 1};
    /// Every box seen begins and ends at `origin` on this axis, as where a third axis isn't used. Quanta then
    /// only tell before, at and behind: else all pairs would be ties.
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

    [[nodiscard]] std::size_t size() const noexcept { return a.size() + b.size(); }
    [[nodiscard]] Aabb<Dim, T> operator[](std::uint32_t object) const noexcept
    {
        return object & side_b ? b[object & index_mask] : a[object & index_mask];
    }
    void prefetch(std::uint32_t object) const noexcept
    {
        const BoxView<Dim, T>& set = object & side_b ? b : a;
        __builtin_prefetch(set.lo_pointer(0, object & index_mask));
        __builtin_prefetch(set.hi_pointer(Dim - 1, object & index_mask));
    }
};

} // namespace engine
JOSTLE_NAMESPACE_END
