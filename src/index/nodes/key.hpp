// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>

#include "jostle/box.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// How boxes are turned into keys. It is chosen for the first boxes. For other boxes it may be less useful,
/// but never wrong: coordinates beyond 2^62 quanta count as 2^62, and finer digits then tell them apart.
template <int Dim>
struct Frame
{
    double origin[Dim] = {};
    double scale = 1;       // quanta per unit: most of the first boxes are within world_quanta of each other
    double common_size = 0; // boxes bigger than this on some axis are in the classes 1, 2, ...
    static constexpr double class_ratio = 8;
    /// How many quanta most of the first boxes span, on the axis on which they span most: 2^42. That is far
    /// more than needed to tell any two boxes apart, and leaves a factor of 2^20 up to the greatest
    /// coordinate, 2^62, for later boxes outside.
    static constexpr double world_quanta = 4398046511104.0;
    static constexpr std::uint32_t last_class = 7;
};

/// The place of a box in the order: its size class, its centre in quanta, for boxes within the same quanta
/// their centres as floating-point numbers, and for boxes in the same place their ids. A key is a string of
/// binary digits, the highest of every axis first, and is unique for each object.
///
/// Quanta halve space evenly, which suits most worlds. If distances grow from box to box, most boxes are
/// within one quantum or beyond the last; the digits of a floating-point number halve its exponents.
template <int Dim>
struct Key
{
    std::uint64_t center[Dim];
    std::uint64_t fine[Dim];
    std::uint32_t size_class;
    std::uint32_t id;
};

inline constexpr int class_digits = 3, center_digits = 64; // the latter of an axis
/// A sign, 11 digits of the exponent and 28 of the fraction, which are all the digits of a centre of floats.
inline constexpr int fine_digits = 40;
template <int Dim>
inline constexpr int key_digits = class_digits + (center_digits + fine_digits) * Dim + 32;

/// The place of a centre, in quanta.
template <int Dim>
[[nodiscard]] inline double place_of(const Frame<Dim>& frame, int axis, double lo, double hi) noexcept
{
    return (0.5 * lo + 0.5 * hi - frame.origin[axis]) * frame.scale;
}

/// The first digits of a number; they have the same order as the numbers.
[[nodiscard]] inline std::uint64_t fine_digits_of(double number) noexcept
{
    const double unsigned_zero = number + 0.0;
    std::uint64_t bits;
    std::memcpy(&bits, &unsigned_zero, sizeof bits);
    const std::uint64_t sign = std::uint64_t{1} << 63;
    return ((bits & sign) != 0 ? ~bits : bits | sign) >> (64 - fine_digits);
}

/// The size class of a box that is `size` long on its longest axis.
template <int Dim>
[[nodiscard]] inline std::uint32_t class_of(const Frame<Dim>& frame, double size) noexcept
{
    std::uint32_t size_class = 0;
    for (double bound = frame.common_size; size_class < Frame<Dim>::last_class && size > bound;
         bound = bound * Frame<Dim>::class_ratio)
        ++size_class;
    return size_class;
}

template <int Dim, class T>
[[nodiscard]] inline Key<Dim> key_of(const Frame<Dim>& frame, const Aabb<Dim, T>& box,
                                     std::uint32_t id) noexcept
{
    // Infinite bounds count as the furthest ones that still have a finite centre.
    constexpr double furthest = 1e300, last = 4611686018427387904.0; // 2^62
    Key<Dim> key;
    double size = 0;
    for (int d = 0; d < Dim; ++d) {
        const double lo = std::max(-furthest, std::min(static_cast<double>(box.lo[d]), furthest));
        const double hi = std::max(-furthest, std::min(static_cast<double>(box.hi[d]), furthest));
        size = std::max(size, hi - lo);
        const double cut = std::max(-last, std::min(place_of(frame, d, lo, hi), last));
        key.center[d] = static_cast<std::uint64_t>(static_cast<std::int64_t>(cut)) ^ (std::uint64_t{1} << 63);
        key.fine[d] = fine_digits_of(0.5 * lo + 0.5 * hi);
    }
    key.size_class = class_of(frame, size);
    key.id = id;
    return key;
}

/// The first that differs of the last `digits` digits of each axis, the highest of every axis first; one past
/// the last if none does.
template <int Dim>
[[nodiscard]] inline int first_difference(const std::uint64_t (&a)[Dim], const std::uint64_t (&b)[Dim],
                                          int digits) noexcept
{
    int digit = digits * Dim;
    for (int d = 0; d < Dim; ++d)
        if (a[d] != b[d]) digit = std::min(digit, (std::countl_zero(a[d] ^ b[d]) + digits - 64) * Dim + d);
    return digit;
}

/// The first digit that differs; key_digits if none does.
template <int Dim>
[[nodiscard]] inline int first_difference(const Key<Dim>& a, const Key<Dim>& b) noexcept
{
    if (a.size_class != b.size_class)
        return class_digits - static_cast<int>(std::bit_width(a.size_class ^ b.size_class));
    int digit = first_difference<Dim>(a.center, b.center, center_digits);
    if (digit != center_digits * Dim) return class_digits + digit;
    digit += first_difference<Dim>(a.fine, b.fine, fine_digits);
    if (digit != (center_digits + fine_digits) * Dim) return class_digits + digit;
    return class_digits + digit + std::countl_zero(a.id ^ b.id);
}

template <int Dim>
[[nodiscard]] inline unsigned digit_of(const Key<Dim>& key, int digit) noexcept
{
    if (digit < class_digits) return (key.size_class >> (class_digits - 1 - digit)) & 1;
    digit -= class_digits;
    if (digit < center_digits * Dim)
        return static_cast<unsigned>(key.center[digit % Dim] >> (center_digits - 1 - digit / Dim)) & 1;
    digit -= center_digits * Dim;
    if (digit < fine_digits * Dim)
        return static_cast<unsigned>(key.fine[digit % Dim] >> (fine_digits - 1 - digit / Dim)) & 1;
    return (key.id >> (31 - (digit - fine_digits * Dim))) & 1;
}

/// The part of space, and the range of sizes, of a piece of the trie. Most boxes whose keys begin with the
/// digits of that piece can be recognised by it, more cheaply than by computing their keys.
template <int Dim>
class Cell
{
  public:
    /// The piece whose keys have their first `digits` digits in common with `key`.
    Cell(const Frame<Dim>& frame, const Key<Dim>& key, int digits) noexcept : frame_(frame)
    {
        constexpr int most_exact = 50; // digits of an axis that a double can tell apart, with one to spare
        const int of_center = digits - class_digits;
        useful_ = of_center >= 0 && of_center <= most_exact * Dim;
        std::fill_n(lo_, Dim, -infinity);
        std::fill_n(hi_, Dim, infinity);
        if (!useful_) return;
        for (std::uint32_t k = 0; k < key.size_class; ++k) {
            least_size_ = k == 0 ? frame.common_size : least_size_ * Frame<Dim>::class_ratio;
        }
        if (key.size_class < Frame<Dim>::last_class)
            greatest_size_ = key.size_class == 0 ? frame.common_size : least_size_ * Frame<Dim>::class_ratio;
        for (int d = 0; d < Dim; ++d) {
            const int fixed = (of_center - d + Dim - 1) / Dim;
            if (fixed <= 0) continue;
            const int open = 64 - fixed;
            const std::uint64_t begin = key.center[d] >> open << open;
            lo_[d] = static_cast<double>(static_cast<std::int64_t>(begin ^ (std::uint64_t{1} << 63)));
            // Centres are truncated towards zero: just below a negative end, they belong to the next cell.
            hi_[d] = lo_[d] + 2 * static_cast<double>(std::uint64_t{1} << (open - 1)) - 1;
        }
    }
    /// Whether the box's key certainly begins with these digits. If this returns false, the key may still
    /// begin with them: for boxes on the border of the piece, for those with a NaN, and for all boxes if the
    /// piece is too small for the border to be represented in double.
    template <class T>
    [[nodiscard]] bool holds(const Aabb<Dim, T>& box) const noexcept
    {
        double size = 0;
        bool inside = useful_;
        for (int d = 0; d < Dim; ++d) {
            const auto lo = static_cast<double>(box.lo[d]), hi = static_cast<double>(box.hi[d]);
            size = std::max(size, hi - lo);
            const double place = place_of(frame_, d, lo, hi);
            inside &= (lo_[d] <= place) & (place < hi_[d]);
        }
        return inside & (least_size_ < size) & (size <= greatest_size_);
    }

  private:
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    const Frame<Dim>& frame_;
    bool useful_ = false;
    double lo_[Dim], hi_[Dim], least_size_ = -1, greatest_size_ = infinity;
};

/// Puts Dim - 1 zeros between the digits of a number of at most 16 (2D) or 10 (3D).
template <int Dim>
[[nodiscard]] inline std::uint32_t spread(std::uint32_t x) noexcept
{
    if constexpr (Dim == 2) {
        x = (x | (x << 8)) & 0x00ff00ff;
        x = (x | (x << 4)) & 0x0f0f0f0f;
        x = (x | (x << 2)) & 0x33333333;
        return (x | (x << 1)) & 0x55555555;
    } else {
        x = (x | (x << 16)) & 0x030000ff;
        x = (x | (x << 8)) & 0x0300f00f;
        x = (x | (x << 4)) & 0x030c30c3;
        return (x | (x << 2)) & 0x09249249;
    }
}

/// A box to be sorted: its position, and some digits of its key, beginning with the first in which those
/// around it differ. There are equally many for each axis, below those of its class.
struct KeyEntry
{
    std::uint32_t digits;
    std::uint32_t box;
};
inline constexpr int entry_class_shift = 32 - class_digits;
template <int Dim>
inline constexpr int entry_digits = entry_class_shift / Dim; // of an axis

} // namespace index
JOSTLE_NAMESPACE_END
