// SPDX-License-Identifier: MIT
// How many periods of the cell lie between two points, and the vector that this makes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "jostle/neighbors.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

/// The most periods that a cutoff may span: their numbers fit into the key of a neighbour.
constexpr std::int64_t most_images = 500;

template <int Dim>
using Periods = std::array<std::int32_t, detail::axes<Dim>>;

/// An image's number in one word, with `bits` for each axis.
template <int Dim>
std::uint32_t code_of(const Periods<Dim>& image, int bits)
{
    std::uint32_t code = 0;
    for (const std::int32_t periods : image)
        code = code << bits | static_cast<std::uint32_t>(periods + (1 << (bits - 1)));
    return code;
}
template <int Dim>
Periods<Dim> image_of(std::uint32_t code, int bits)
{
    Periods<Dim> image;
    for (std::size_t k = detail::axes<Dim>; k-- > 0; code >>= bits)
        image[k] = static_cast<std::int32_t>(code % (1u << bits)) - (1 << (bits - 1));
    return image;
}
/// From one point to another, by the definition: `image` is that of the wrapped points, and each lies outside
/// of the cell by so many periods.
template <int Dim>
Periods<Dim> shift_of(Periods<Dim> image, const Periods<Dim>& from, const Periods<Dim>& to)
{
    for (std::size_t k = 0; k < detail::axes<Dim>; ++k)
        image[k] += from[k] - to[k];
    return image;
}
constexpr int any_bits = 10, near_bits = 2; // the second for images next to the cell, as most are
static_assert(most_images + 2 < 1 << (any_bits - 1));

/// The vectors of the definition. A table has the sums of the cell's vectors for images next to it.
template <int Dim, class T>
class ShiftedVectors
{
  public:
    explicit ShiftedVectors(const PeriodicCell<Dim, T>& cell) : cell_(cell)
    {
        for (std::uint32_t code = 0; code < near_codes; ++code) {
            near_[code].shift = image_of<Dim>(code, near_bits);
            near_[code].sum = sum_of(near_[code].shift);
        }
    }

    /// A shift of at most 1 along each axis, by its code of near_bits.
    struct Shifted
    {
        Periods<Dim> shift;
        Vec<Dim, T> sum;
    };
    const Shifted& near(std::uint32_t code) const { return near_[code]; }

    /// `sum` is that of the cell's vectors for the shift.
    static Vec<Dim, T> between(const Vec<Dim, T>& from, const Vec<Dim, T>& to, const Vec<Dim, T>& sum)
    {
        return (to - from) + sum;
    }
    Vec<Dim, T> between(const Vec<Dim, T>& from, const Vec<Dim, T>& to, const Periods<Dim>& shift) const
    {
        bool is_near = true;
        for (const std::int32_t periods : shift)
            is_near &= static_cast<std::uint32_t>(periods) + 1 < 3;
        return between(from, to, is_near ? near_[code_of<Dim>(shift, near_bits)].sum : sum_of(shift));
    }

  private:
    static constexpr std::uint32_t near_codes = 1u << (near_bits * Dim);

    Vec<Dim, T> sum_of(const Periods<Dim>& shift) const
    {
        Vec<Dim, T> sum;
        for (int d = 0; d < Dim; ++d)
            sum[d] = T(-0.0); // changes nothing that it is added to, zeros included
        for (int k = 0; k < Dim; ++k)
            if (cell_.repeats[k])
                sum += cell_.vectors[k] * static_cast<T>(shift[static_cast<std::size_t>(k)]);
        return sum;
    }

    PeriodicCell<Dim, T> cell_;
    Shifted near_[near_codes];
};

} // namespace neighbors
JOSTLE_NAMESPACE_END
