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

/// The structure behind an index: which objects lie together, and the nodes that the searches go through.
///
/// Space is halved again and again, at fixed places and in turn along each axis, until no more than 256
/// objects are left: a page. Which pages there are follows from the objects, not from the order they came
/// in. Inside a page, objects lie in leaves of 16. The halvings form a binary trie over the pages; searches
/// use wide nodes that each stand for a piece of the trie with up to 16 ends.
template <int Dim, class T>
class Tree
{
  public:
    using Box = Aabb<Dim, T>;
    using View = BoxView<Dim, T>;

    explicit Tree(const IndexOptions& options);

    // The arguments have been checked. Each leaves the tree as before if it throws.
    /// Replaces all that is in it. Without ids, objects are known by the boxes' positions.
    void build(std::span<const std::uint32_t> ids, const View& boxes);
    /// Each of these has its box afterwards, whether it was in the tree or not.
    void put(std::span<const std::uint32_t> ids, const View& boxes);
    void erase(std::span<const std::uint32_t> ids) noexcept;
    /// Fills in where objects are now, 256 at most at a time; called by several threads. A NaN as lo[0] says
    /// that an object is gone.
    using Where = FunctionRef<void(std::span<const std::uint32_t> ids, Box* boxes)>;
    /// Moves all objects at once. The tree is empty if it throws, and also if it returns false: then so many
    /// objects belong elsewhere that rebuilding costs less.
    bool follow(const Where& where);
    void clear() noexcept;
    /// Says that from now on most erased objects will be inserted again near where they were, which then
    /// takes half as long. If they aren't, searches visit up to an eighth more.
    void expect_to_come_back() noexcept { parts_.most_come_back = true; }
    /// Of ids above the greatest in use; if there are no objects, all.
    void release_memory() noexcept;

    [[nodiscard]] std::size_t size() const noexcept { return parts_.size; }
    /// One more than the greatest id that was in since clear or release_memory.
    [[nodiscard]] std::uint64_t id_end() const noexcept { return parts_.page_of.size(); }
    [[nodiscard]] bool contains(std::uint32_t id) const noexcept
    {
        return id < parts_.page_of.size() && parts_.page_of[id] != none;
    }
    [[nodiscard]] Box box(std::uint32_t id) const noexcept;
    [[nodiscard]] Child<Dim, T> root() const noexcept { return parts_.root_child; }
    /// Working memory of the searches that need some.
    [[nodiscard]] QueueShelf<Dim, T>& queues() const noexcept { return queues_; }
    [[nodiscard]] Shelf<ClosestWork<Dim, T>>& closest_work() const noexcept { return closest_work_; }
    /// The bounds of everything.
    [[nodiscard]] Box hull() const noexcept { return parts_.hull; }
    /// The bounds of the objects that count; of none, from infinity to -infinity. Costs about what a query
    /// for the nearest does.
    [[nodiscard]] Box hull_of(FunctionRef<bool(std::uint32_t id)> counts) const;
    [[nodiscard]] const Frame<Dim>& frame() const noexcept { return parts_.frame; }
    [[nodiscard]] IndexStats stats() const noexcept;
    /// Null if all is in order, else what isn't. For tests.
    [[nodiscard]] const char* validate() const;

  private:
    /// All that can fail when objects are put somewhere. Those that arrive are in their pages afterwards. If
    /// they were in the tree before, they are in their old pages as well, which `page_of` names until then.
    void plan(std::span<const std::uint32_t> ids, const View& boxes);
    void build_first(std::span<const std::uint32_t> ids, const View& boxes);
    void make_room_for(std::uint32_t id);
    /// Moves objects by building everything anew.
    void build_moved(std::span<const std::uint32_t> ids, const View& boxes);

    Parts<Dim, T> parts_;
    Parts<Dim, T> replaced_; // by the last rebuild; memory for the next one
    BuildMemory build_memory_;
    std::pmr::vector<Record<Dim, T>> leaving_; // working memory of follow
    // Working memory of put, as places in the call's lists: objects that come or change their page, and
    // those that stay in it.
    std::pmr::vector<std::uint32_t> arriving_, staying_;
    mutable QueueShelf<Dim, T> queues_;
    mutable Shelf<ClosestWork<Dim, T>> closest_work_;
};

} // namespace index
JOSTLE_NAMESPACE_END
