// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "jostle/box.hpp"

/// Makes a valid box a bad one, NaN or inverted, in one of the ways that hosts do.
template <int Dim, jostle::Coordinate T>
void make_bad(jostle::Aabb<Dim, T>& box, std::uint64_t random)
{
    const int d = static_cast<int>(random % Dim);
    constexpr T nan = std::numeric_limits<T>::quiet_NaN(), most = std::numeric_limits<T>::max();
    switch (random / Dim % 5) {
    case 0:
        box.lo[d] = nan;
        break;
    case 1:
        box.hi[d] = nan;
        break;
    case 2:
        box.lo[d] = box.hi[d] + 1;
        if (!(box.lo[d] > box.hi[d])) box.lo[d] = 1, box.hi[d] = 0; // so far out that 1 more is nothing
        break;
    case 3:
        box.lo[d] = most, box.hi[d] = -most;
        break;
    default: // the empty box of many engines
        std::fill(box.lo.begin(), box.lo.end(), most);
        std::fill(box.hi.begin(), box.hi.end(), -most);
    }
}
