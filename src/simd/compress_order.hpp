// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// For each mask of 8 lanes the numbers of its set lanes in ascending order. Our own table: the one inside
/// Highway 1.0.3 is copied to the stack at every use by g++ 12.
struct CompressOrder
{
    alignas(64) std::uint8_t of8[256][8];
    alignas(64) std::uint8_t of4[16][16]; // of lanes of four bytes, in bytes
    constexpr CompressOrder() : of8(), of4()
    {
        for (unsigned mask = 0; mask < 16; ++mask) {
            unsigned next = 0;
            for (unsigned lane = 0; lane < 4; ++lane)
                if ((mask >> lane) & 1)
                    for (unsigned byte = 0; byte < 4; ++byte)
                        of4[mask][next++] = static_cast<std::uint8_t>(4 * lane + byte);
        }
        for (unsigned mask = 0; mask < 256; ++mask) {
            unsigned next = 0;
            for (unsigned lane = 0; lane < 8; ++lane)
                if ((mask >> lane) & 1) of8[mask][next++] = static_cast<std::uint8_t>(lane);
        }
    }
};
inline constexpr CompressOrder compress_order;

JOSTLE_NAMESPACE_END
