// SPDX-License-Identifier: MIT
// A mesh's tree of oriented boxes, which is searched for distances, touching and impacts. Boxes aligned with
// their triangles are as flat as the surface, so the distance of two boxes is nearly that of the triangles.
// Source: Gottschalk, Lin, Manocha, OBBTree, SIGGRAPH 1996; Larsen et al., ICRA 2000.
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

/// Boxes that are tested at once, one number of each in a row. Unused ones repeat the first.
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

/// How far a box surely is from each of BoxRows, and in which direction.
struct BoxApproaches
{
    /// Below 0: they may overlap, and what is in them by no more than this. Rounded to some 1e-14 of all
    /// lengths.
    double distance[BoxRows::size];
    double normal[3][BoxRows::size]; ///< unit, from the box to that of the rows; of those that are apart
};
/// Keys are in the order of distances, and need no root: the square; of what overlaps, by how much, negated.
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
    /// The first one has one box, which is around all.
    std::vector<Node> nodes;
};

/// `order` has neighbours next to each other, halves of halves.
[[nodiscard]] MeshTree mesh_tree(std::span<const Vec3> vertices,
                                 std::span<const std::array<std::uint32_t, 3>> elements,
                                 std::span<const std::uint32_t> order);

} // namespace narrow
JOSTLE_NAMESPACE_END
