// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

/// Numbers of things at which loops, blocks and sorts by digits go wrong.
namespace contract {

/// None, one, two, or a power of two or what is beside it, but not more than `most`. Nearly all blocks are
/// powers of two. `random.below(end)` gives a number.
template <class Random>
std::uint32_t edge_number(Random& random, std::uint32_t most)
{
    std::uint32_t number = random.below(3);
    if (random.below(4) != 0) number += (1u << random.below(13)) - 1;
    if (number > most) number = most - std::min(most, random.below(3));
    return number;
}

/// The least power of two from `least` on, or what is beside it, but not less.
template <class Random>
std::uint32_t edge_number_from(Random& random, std::uint32_t least)
{
    return std::max(least, std::bit_ceil(std::max(least, 1u)) + random.below(3) - 1);
}

} // namespace contract
