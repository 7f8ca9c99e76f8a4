// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "index/tree/build.hpp"
#include "index/tree/parts.hpp"
#include "jostle/box_index.hpp"
#include "jostle/function_ref.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// The structure of an index: which objects are grouped together, and the nodes that searches visit.
///
/// Space is halved again and again, at fixed places and in turn along each axis, until no more than 256
/// objects are left: a page. Which pages there are depends on the objects, not on the order in which they
/// were added. Inside a page, objects are in leaves of 16. The halvings form a binary trie over the pages;
/// searches use wide nodes, each of which replaces a piece of the trie with up to 16 ends.
template <int Dim, class T>
class Tree
{
  public:
    using Box = Aabb<Dim, T>;
    using View = BoxView<Dim, T>;

    explicit Tree(const IndexOptions& options);

    // The arguments have been checked. If one of these throws, the tree is unchanged.
    /// Replaces the contents. Without ids, objects are named by the boxes' positions.
    void build(std::span<const std::uint32_t> ids, const View& boxes);
    /// Gives each of these objects its box, whether it was in the tree or not.
    void put(std::span<const std::uint32_t> ids, const View& boxes);
    void erase(std::span<const std::uint32_t> ids) noexcept;
    /// Fills in the present boxes of objects, at most 256 at a time; called by several threads. A NaN as
    /// lo[0] means that an object is gone.
    using Where = FunctionRef<void(std::span<const std::uint32_t> ids, Box* boxes)>;
    /// Moves all objects at once. If it throws, the tree is empty. If it returns false, the tree is empty
    /// too: so many objects belong elsewhere that rebuilding costs less.
    bool follow(const Where& where);
    void clear() noexcept;
    /// Declares that from now on most erased objects will be inserted again near where they were, which then
    /// takes half as long. If they aren't, searches visit up to an eighth more.
    void expect_to_come_back() noexcept { parts_.most_come_back = true; }
    /// Frees the memory of ids above the greatest in use; if there are no objects, all.
    void release_memory() noexcept;

    [[nodiscard]] std::size_t size() const noexcept { return parts_.size; }
    /// One more than the greatest id in the tree since clear or release_memory.
    [[nodiscard]] std::uint64_t id_end() const noexcept { return parts_.page_of.size(); }
    [[nodiscard]] bool contains(std::uint32_t id) const noexcept
    {
        return id < parts_.page_of.size() && parts_.page_of[id] != none;
    }
    [[nodiscard]] Box box(std::uint32_t id) const noexcept;
    [[nodiscard]] Child<Dim, T> root() const noexcept { return parts_.root_child; }
    /// Working memory for searches that need some.
    [[nodiscard]] QueueShelf<Dim, T>& queues() const noexcept { return queues_; }
    [[nodiscard]] Shelf<ClosestWork<Dim, T>>& closest_work() const noexcept { return closest_work_; }
    /// The bounds of everything.
    [[nodiscard]] Box hull() const noexcept { return parts_.hull; }
    /// The bounds of the objects that count; from infinity to -infinity if none do. Costs about as much as a
    /// query for the nearest.
    [[nodiscard]] Box hull_of(FunctionRef<bool(std::uint32_t id)> counts) const;
    [[nodiscard]] const Frame<Dim>& frame() const noexcept { return parts_.frame; }
    [[nodiscard]] IndexStats stats() const noexcept;
    /// Returns null if the structure is valid, otherwise what isn't. For tests.
    [[nodiscard]] const char* validate() const;

  private:
    /// The part of `put` that can fail. Afterwards the objects that arrive are in their pages. If they were
    /// in the tree before, they are in their old pages as well, which `page_of` names until then.
    void plan(std::span<const std::uint32_t> ids, const View& boxes);
    void build_first(std::span<const std::uint32_t> ids, const View& boxes);
    void make_room_for(std::uint32_t id);
    /// Moves objects by rebuilding everything.
    void build_moved(std::span<const std::uint32_t> ids, const View& boxes);

    Parts<Dim, T> parts_;
    Parts<Dim, T> replaced_; // by the last rebuild; memory for the next one
    BuildMemory build_memory_;
    std::pmr::vector<Record<Dim, T>> leaving_; // working memory of follow
    // Working memory of put, as positions in the call's lists: objects that are new or change their page, and
    // those that stay in it.
    std::pmr::vector<std::uint32_t> arriving_, staying_;
    mutable QueueShelf<Dim, T> queues_;
    mutable Shelf<ClosestWork<Dim, T>> closest_work_;
};

} // namespace index
JOSTLE_NAMESPACE_END
