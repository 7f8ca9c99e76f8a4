// SPDX-License-Identifier: MIT
#include "jostle/pair_buffer.hpp"

JOSTLE_NAMESPACE_BEGIN

std::uint64_t pair_checksum(PairView pairs) noexcept
{
    std::uint64_t sum = 0;
    for (const std::span<const Pair> block : pairs.blocks())
        for (const Pair& pair : block) {
            // splitmix64: Steele, Lea, Flood, Fast splittable pseudorandom number generators (2014), fig. 16.
            std::uint64_t z = ((std::uint64_t{pair.a} << 32) | pair.b) + 0x9e3779b97f4a7c15u;
            z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
            z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
            sum += z ^ (z >> 31);
        }
    return sum;
}

JOSTLE_NAMESPACE_END
