// SPDX-License-Identifier: MIT
// Most pairs whose boxes touch are far from near. This tells them apart, many at once, in floats.
#pragma once

#include <cstdint>

#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace surfaces {

/// Pairs as columns.
struct PartBatch
{
    static constexpr std::uint32_t size = 64;

    /// From the first of a pair's four vertices to each of the others, x, y and z of each.
    alignas(64) float from[9][size];
    /// The same at the end of a step. Read by kernels that move.
    alignas(64) float to[9][size];
    /// Within which a pair is near.
    alignas(64) float reach[size];
};

/// A bit for each of the first `count` pairs of a batch: whether it is certainly further apart than `reach`
/// all the time. What stands behind them in the columns is read, too. All instruction sets say the same.
struct PartKernels
{
    std::uint64_t (*vertex_triangle)(const PartBatch& pairs, std::uint32_t count);
    std::uint64_t (*edge_edge)(const PartBatch& pairs, std::uint32_t count);
    std::uint64_t (*moving_vertex_triangle)(const PartBatch& pairs, std::uint32_t count);
    std::uint64_t (*moving_edge_edge)(const PartBatch& pairs, std::uint32_t count);
};

/// For one of supported_instruction_sets().
const PartKernels& kernels_for(InstructionSet set) noexcept;

} // namespace surfaces
JOSTLE_NAMESPACE_END
