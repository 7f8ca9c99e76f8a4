// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace jostle_tool {

/// What `jostle chapter --ladder` and `--cells` measure.
struct LadderOptions
{
    std::string scene = "uniform";
    std::vector<std::uint32_t> objects;
    std::vector<std::uint32_t> threads; ///< 1, and as many as were asked for
    std::vector<float> cells;           ///< ascending; for --cells
    std::vector<std::uint32_t> buckets; ///< for --cells
};

struct Report
{
    std::string rows; ///< JSON
    std::string text;
};

/// From the printed algorithms to the engine: the rungs, the ways to share work out, the ways to add up
/// responses.
[[nodiscard]] Report measure_ladder(const LadderOptions& options);

/// The corrected grid with each cell size and each number of buckets.
[[nodiscard]] Report measure_cells(const LadderOptions& options);

} // namespace jostle_tool
