// SPDX-License-Identifier: MIT
// Traversals of a box tree: that of a mesh's elements, or of a compound's children.
#pragma once

#include "narrow/parts/region.hpp"
#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Calls visit(leaf) for the leaves within range of a region. The range may shrink meanwhile.
template <int Dim, class Visit>
void for_each_leaf(const std::vector<TreeNode>& nodes, const Region<Dim>& region, const Range<Dim>& range,
                   const Visit& visit)
{
    for (std::uint32_t k = 0; k < nodes.size();) {
        const TreeNode& node = nodes[k];
        if (!region.meets(node.lo, node.hi, range)) {
            k = node.skip;
            continue;
        }
        if (node.count != 0) visit(node);
        ++k;
    }
}

/// Calls visit(leaf) for the leaves whose key(node) is at most limit(); of two subtrees, the one with the
/// lesser key comes first. A node's key is at most those of the nodes in it; the limit may decrease
/// meanwhile.
template <class Key, class Limit, class Visit>
void for_each_leaf_by(const Key& key, const Limit& limit, const std::vector<TreeNode>& nodes,
                      const Visit& visit)
{
    struct Item
    {
        double key;
        std::uint32_t node;
    };
    Item waiting[64]; // one for each level, of which there are at most 32
    std::size_t count = 0;
    waiting[count++] = {key(nodes[0]), 0};
    while (count > 0) {
        const Item item = waiting[--count];
        if (!(item.key <= limit())) continue;
        const TreeNode& node = nodes[item.node];
        if (node.count != 0) {
            visit(node);
            continue;
        }
        const std::uint32_t one = item.node + 1, other = nodes[one].skip;
        const Item of_one{key(nodes[one]), one}, of_other{key(nodes[other]), other};
        const bool one_first = of_one.key <= of_other.key;
        waiting[count++] = one_first ? of_other : of_one;
        waiting[count++] = one_first ? of_one : of_other;
    }
}

} // namespace narrow
JOSTLE_NAMESPACE_END
