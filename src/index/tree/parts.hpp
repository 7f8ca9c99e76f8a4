// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <utility>
#include <vector>

#include "index/kernels/kernels.hpp"
#include "index/nodes/groups.hpp"
#include "index/nodes/key.hpp"
#include "index/tree/pool.hpp"
#include "jostle/box_index.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

inline constexpr std::uint32_t none = ~std::uint32_t{0};

/// A page or a fork of the trie, by number: pages have the top bit set.
using Ref = std::uint32_t;
inline constexpr Ref page_bit = 1u << 31;

/// Up to 256 objects whose keys begin with the same digits: a leaf of the trie. They are in up to 16 leaves
/// of the index, which are the children of the page's node.
template <int Dim, class T>
struct Page
{
    Node<Dim, T> node;
    std::uint32_t leaf[lanes]; // numbers of the leaves, in the order of the node's lanes
    std::uint16_t live[lanes]; // which lanes of each leaf hold an object
    std::uint32_t leaves, count;
    std::uint32_t disorder;       // objects added or removed since it was sorted
    std::uint16_t changed;        // leaves whose bounds must be recomputed
    bool listed, used;            // in the list of pages to be finished; not given back
    bool was_split;               // by the current change
    bool drifted;                 // its leaves have become much bigger since it was sorted
    T spread;                     // the size of its leaves then: the sum of their edges
    std::uint32_t parent;         // in the trie
    std::uint32_t wide;           // the wide node that it is a child of ...
    std::uint32_t lane;           // ... and its place there
    Key<Dim> key;                 // of some present or former object: determines its place in the trie
    std::uint16_t leaving[lanes]; // while the tree follows: objects that belong elsewhere, or nowhere
    Aabb<Dim, T> hull;
};

/// A fork of the trie: keys below agree in all digits before `level` and differ in that one.
template <int Dim>
struct Fork
{
    Key<Dim> key; // of some object below
    int level;    // the digit of the key that tells the sides apart
    std::uint32_t parent;
    Ref child[2];
    std::uint32_t width; // ends of the piece of the trie that begins here, if it is cut off above
    std::uint32_t wide;  // the wide node of that piece if one begins here, or none
};

/// A node for searches, which replaces a piece of the trie with up to 16 ends: pages, or the wide nodes of
/// further pieces.
template <int Dim, class T>
struct Wide
{
    Node<Dim, T> node;
    std::uint32_t fork;
    std::uint32_t wide, lane; // its parent
    std::uint32_t count;
    Aabb<Dim, T> hull;
};

/// The parts of a tree. Each file beside this one works on one aspect: page.hpp on the contents of a page,
/// trie.hpp on which pages there are, wide.hpp on the nodes for searches, build.hpp on all of it at once.
template <int Dim, class T>
struct Parts
{
    explicit Parts(const IndexOptions& options)
        : memory(options.memory),
          executor(options.executor),
          kernels(kernels_for<Dim, T>(options.instruction_set)),
          leaves(memory),
          pages(memory),
          forks(memory),
          wides(memory),
          page_of(memory),
          listed(memory)
    {
    }
    /// Swaps the contents, if they have the same memory resource.
    void swap(Parts& other) noexcept
    {
        std::swap(frame, other.frame);
        leaves.swap(other.leaves);
        pages.swap(other.pages);
        forks.swap(other.forks);
        wides.swap(other.wides);
        page_of.swap(other.page_of);
        listed.swap(other.listed);
        std::swap(root, other.root);
        std::swap(root_child, other.root_child);
        std::swap(hull, other.hull);
        std::swap(size, other.size);
        std::swap(sorts, other.sorts);
        std::swap(splits, other.splits);
    }

    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return leaves.bytes() + pages.bytes() + forks.bytes() + wides.bytes() +
               (page_of.capacity() + listed.capacity()) * sizeof(std::uint32_t);
    }

    std::pmr::memory_resource* memory;
    Executor* executor;
    const Kernels<Dim, T>& kernels;
    Frame<Dim> frame;
    Pool<Leaf<Dim, T>> leaves;
    Pool<Page<Dim, T>> pages;
    Pool<Fork<Dim>> forks;
    Pool<Wide<Dim, T>> wides;
    std::pmr::vector<std::uint32_t> page_of; // by id
    std::pmr::vector<std::uint32_t> listed;  // pages to be finished
    Ref root = none;
    Child<Dim, T> root_child; // where searches begin
    Aabb<Dim, T> hull;        // the bounds of everything
    std::size_t size = 0;
    bool most_come_back = false; // of leaving objects, to about where they were: pages are sorted later
    std::uint64_t sorts = 0, splits = 0;
};

} // namespace index
JOSTLE_NAMESPACE_END
