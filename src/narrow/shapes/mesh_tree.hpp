// SPDX-License-Identifier: MIT
// A mesh's tree of oriented boxes, for searches for distances, touching and impacts. Boxes aligned with their
// triangles are as flat as the surface, so the distance of two boxes is nearly that of the triangles. Source:
// Gottschalk, Lin, Manocha, OBBTree, SIGGRAPH 1996; Larsen et al., ICRA 2000.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "narrow/math.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A box with its own axes.
struct OrientedBox
{
    Vec3 centre, half;
    Mat3 axes;
};

/// Boxes that are tested at once, with one number of each in a row. Unused ones repeat the first.
struct BoxRows
{
    static constexpr std::uint32_t size = 8;
    double centre[3][size], half[3][size], axes[9][size];

    [[nodiscard]] OrientedBox box(std::uint32_t i) const
    {
        return {{centre[0][i], centre[1][i], centre[2][i]},
                {half[0][i], half[1][i], half[2][i]},
                {{axes[0][i], axes[1][i], axes[2][i]},
                 {axes[3][i], axes[4][i], axes[5][i]},
                 {axes[6][i], axes[7][i], axes[8][i]}}};
    }
    void set(std::uint32_t i, const OrientedBox& box);
};

/// Lower bounds of the distance of a box from each of BoxRows, and their directions.
struct BoxApproaches
{
    /// Negative: they may overlap, and their contents by no more than this. Rounded to some 1e-14 of all
    /// lengths.
    double distance[BoxRows::size];
    double normal[3][BoxRows::size]; ///< unit, from the box to that of the rows; only for those apart
};
/// Keys have the order of distances, and need no square root: the squared distance, or the negated overlap.
inline double key_of(double distance)
{
    return distance > 0 ? distance * distance : distance;
}

struct MeshTree
{
    struct Node
    {
        BoxRows boxes;
        std::uint32_t child[BoxRows::size]; ///< a node, or an element with `leaf` added
        std::uint32_t count;
    };
    static constexpr std::uint32_t leaf = 0x8000'0000;
    /// The first one has one box, around everything.
    std::vector<Node> nodes;
};

/// In `order` neighbours are adjacent, in halves of halves.
[[nodiscard]] MeshTree mesh_tree(std::span<const Vec3> vertices,
                                 std::span<const std::array<std::uint32_t, 3>> elements,
                                 std::span<const std::uint32_t> order);

} // namespace narrow
JOSTLE_NAMESPACE_END
