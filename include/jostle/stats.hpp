// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// What a finder's last call did. It is always collected:
///
///     finder.find(boxes);
///     std::printf("%.2f ms, %llu pairs\n", finder.stats().ms_total,
///                 static_cast<unsigned long long>(finder.stats().pairs));
///
/// Counts don't depend on threads or instruction set; times do.
struct Stats
{
    std::uint64_t objects = 0;    ///< boxes read
    std::uint64_t pairs = 0;      ///< pairs reported
    std::uint64_t records = 0;    ///< box copies stored in bricks; few boxes need none
    std::uint64_t candidates = 0; ///< pairs of records whose bounds were compared
    std::uint64_t ties = 0;       ///< candidates that quantised bounds couldn't decide
    std::uint64_t bricks = 0;     ///< bricks with records
    std::uint64_t nested_grids = 0;
    std::uint64_t bytes_reserved = 0; ///< working memory kept for the next call, pairs not included

    /// Wall-clock milliseconds of the call and of its stages: choosing the grid, sorting boxes into bricks,
    /// finding pairs in the bricks, ordering and handing over the result.
    double ms_total = 0, ms_tune = 0, ms_scatter = 0, ms_sweep = 0, ms_finish = 0;
};

JOSTLE_NAMESPACE_END
