// SPDX-License-Identifier: MIT
// Many pairs at once. Most whose boxes touch are far from near, which floats can tell; the others are decided
// in doubles.
#pragma once

#include <cstddef>
#include <cstdint>

#include "jostle/find_pairs.hpp"
#include "surfaces/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace surfaces {

/// x, y, z, and a number without meaning.
using Row = float[4];

/// Pairs for floats.
struct PartBatch
{
    static constexpr std::uint32_t size = 64;

    /// From the first of a pair's four vertices to each of the others.
    alignas(64) Row from[3][size];
    /// The same at the end of a step. Read by kernels that move.
    alignas(64) Row to[3][size];
    /// Within which a pair is near.
    alignas(64) float reach[size];
};

/// Edges and triangles for floats.
struct CrossingBatch
{
    static constexpr std::uint32_t size = 64;

    /// From the edge's first end to its second, and to the triangle's corners.
    alignas(64) Row legs[4][size];
};

/// Pairs as columns, for doubles.
struct PlaceBatch
{
    static constexpr std::uint32_t size = 64;

    /// x, y and z of each of a pair's four vertices.
    alignas(64) double from[12][size];
    /// The same at the end of a step. Only `impacts` reads this and what follows.
    alignas(64) double to[12][size];
    alignas(64) double reach[size];
};
/// PartDistance as columns.
struct PartDistances
{
    alignas(64) double distance[PlaceBatch::size];
    alignas(64) double weight[4][PlaceBatch::size];
    alignas(64) double normal[3][PlaceBatch::size];

    [[nodiscard]] PartDistance of(std::uint32_t k) const
    {
        return {distance[k],
                {weight[0][k], weight[1][k], weight[2][k], weight[3][k]},
                {normal[0][k], normal[1][k], normal[2][k]}};
    }
};

/// Puts down a pair as number k: vertex(i) is where its vertex i is.
template <std::size_t legs, class Vertex>
void put_legs(Row (&rows)[legs][PartBatch::size], std::size_t k, const Vertex& vertex)
{
    const auto& first = vertex(0);
    for (std::size_t i = 0; i < legs; ++i) {
        const auto& other = vertex(i + 1);
        for (int d = 0; d < 3; ++d)
            rows[i][k][d] = static_cast<float>(double{other[d]} - double{first[d]});
    }
}
template <class Vertex>
void put_places(double (&columns)[12][PlaceBatch::size], std::size_t column, const Vertex& vertex)
{
    for (std::size_t i = 0; i < 12; ++i)
        columns[i][column] = double{vertex(i / 3)[static_cast<int>(i % 3)]};
}

/// Of the first `count` pairs of a batch; what stands behind them in the columns is read, too. The same bits
/// with all instruction sets.
struct PartKernels
{
    struct OfKind
    {
        /// A bit for each pair: whether it is certainly further apart than `reach` and, where it moves,
        /// stays so.
        std::uint64_t (*apart)(const PartBatch& pairs, std::uint32_t count);
        std::uint64_t (*moving_apart)(const PartBatch& pairs, std::uint32_t count);
        /// distance_of().
        void (*distances)(const PlaceBatch& pairs, std::uint32_t count, PartDistances& found);
        /// impact_of(), above 1 for nothing. It writes over `from` and `to`.
        void (*impacts)(PlaceBatch& pairs, std::uint32_t count, double tolerance,
                        double (&times)[PlaceBatch::size]);
    };
    OfKind vertex_triangle, edge_edge;
    /// A bit for each pair of an edge and a triangle: whether it certainly has no point in common.
    std::uint64_t (*uncrossed)(const CrossingBatch& pairs, std::uint32_t count);

    [[nodiscard]] const OfKind& of(Kind kind) const
    {
        return kind == Kind::vertex_triangle ? vertex_triangle : edge_edge;
    }
};

/// For one of supported_instruction_sets().
const PartKernels& kernels_for(InstructionSet set) noexcept;

} // namespace surfaces
JOSTLE_NAMESPACE_END
