// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/queries.hpp"
#include "jostle/query.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Executor, memory and instruction set: the same as a finder's.
using IndexOptions = FinderOptions;

/// The present structure of an index, and how much work was done to maintain it.
struct IndexStats
{
    std::uint64_t objects = 0;
    std::uint64_t pages = 0;  ///< groups of at most 256 objects
    std::uint64_t leaves = 0; ///< groups of at most 16 objects, which are tested together
    std::uint64_t nodes = 0;  ///< groups of at most 16 pages or nodes
    std::uint64_t depth = 0;  ///< nodes on the longest path to a page
    std::uint64_t bytes = 0;  ///< memory held
    std::uint64_t sorts = 0;  ///< pages sorted since the last build()
    std::uint64_t splits = 0; ///< pages split since then
};

/// Answers queries about boxes that seldom change: which boxes touch a ray, a moving box, a box, a sphere or
/// a frustum, which are nearest, and which touch any of a batch of boxes. The query functions are in
/// queries.hpp.
///
/// The caller chooses the ids of objects: any 32-bit numbers except the greatest. Keep them dense, since the
/// index takes four bytes (six while ids are added one by one) for each id up to the greatest inserted; see
/// release_memory. The index stores the exact boxes, and `box(id)` returns them, so you needn't keep them
/// elsewhere.
///
/// Exact     answers are those that hit_fraction, squared_distance and overlaps give for each box. No result
///           is dropped or capped unless `max_results` asks for it.
/// Same      the same boxes give the same answers in the same order, whatever calls put them there, for any
///           executor, number of threads and instruction set.
/// Setup     none: no bounds, no cell size, no optimise() to call now and then. Boxes may have any size and
///           place, infinite ones included.
/// Cost      insert, erase and move cost about a microsecond an object or less, amortised in small steps. For
///           queries see Queries.
/// Threads   queries (the const members) may run on any number of threads at a time while no other member
///           runs. A visitor or an `accept` may query the same index. Changing it there is an `Error`;
///           moving, assigning or destroying it is not allowed.
/// Numbers   does not change the threads' floating-point mode (a PairFinder does). If the host flushes
///           denormals to zero, bounds a denormal apart may touch.
/// Errors    an `Error` that names the bad box, id or query and what is wrong with it, std::bad_alloc, or
///           what a callback threw. The index is then unchanged, and a result buffer is empty or incomplete.
/// Source    docs/guide/queries.md
template <int Dim, Coordinate T>
class JOSTLE_API BoxIndex : public Queries<BoxIndex<Dim, T>, Dim, T, std::uint32_t, QueryFilter>
{
  public:
    using Box = Aabb<Dim, T>;

    explicit BoxIndex(const IndexOptions& options = {});
    BoxIndex(BoxIndex&&) noexcept;
    BoxIndex& operator=(BoxIndex&&) noexcept;
    ~BoxIndex();

    // --- Objects ---

    /// Replaces the contents by these boxes: box i gets the id i, or ids[i].
    void build(const BoxView<Dim, T>& boxes);
    void build(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes);
    /// Adds objects. No id may be in the index already, or occur twice in the call.
    void insert(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes);
    /// Removes objects. Every id must be in the index, and occur once in the call.
    void erase(std::span<const std::uint32_t> ids);
    /// Gives objects new boxes. Those that stay nearby cost the least. If a tenth of all objects or more
    /// move, the index is rebuilt, so moves never cost much more than a rebuild. Every id must be in the
    /// index, and occur once in the call.
    void move(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes);
    // The same for one object.
    void insert(std::uint32_t id, const Box& box) { insert(std::span(&id, 1), std::span(&box, 1)); }
    void erase(std::uint32_t id) { erase(std::span(&id, 1)); }
    void move(std::uint32_t id, const Box& box) { move(std::span(&id, 1), std::span(&box, 1)); }
    /// Removes all objects and keeps the memory.
    void clear();
    /// Frees the working memory of join and of rebuilding (as much as the index itself plus 16 bytes a box),
    /// and the memory for ids above the greatest in use. An empty index keeps a few hundred bytes until it is
    /// destroyed.
    void release_memory();

    [[nodiscard]] std::size_t size() const noexcept;
    [[nodiscard]] bool contains(std::uint32_t id) const noexcept;
    /// Returns the box of an object that is in the index.
    [[nodiscard]] Box box(std::uint32_t id) const;
    /// Returns the smallest box around all boxes, or nothing if the index is empty. Takes constant time.
    [[nodiscard]] std::optional<Box> bounds() const noexcept;
    [[nodiscard]] IndexStats stats() const noexcept;

    /// Calls the visitor for each touching pair of this index's objects, once, with a < b. With another
    /// index, a is one of this index's objects and b one of the other's; if `other` is this index, it finds
    /// its own pairs. Returns false if the visitor stopped it by returning false. The order is the index's
    /// own, as for visit() of a region. Allocates nothing. For all pairs of many moving objects a PairFinder
    /// is faster.
    bool pairs(FunctionRef<bool(std::uint32_t a, std::uint32_t b)> visitor) const;
    bool pairs(const BoxIndex& other, FunctionRef<bool(std::uint32_t a, std::uint32_t b)> visitor) const;

  private:
    friend class BoxIndexAccess; // for World; see src/index/box_index_access.hpp
    friend class Queries<BoxIndex, Dim, T, std::uint32_t, QueryFilter>;
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

using BoxIndex2f = BoxIndex<2, float>;
using BoxIndex3f = BoxIndex<3, float>;
using BoxIndex2d = BoxIndex<2, double>;
using BoxIndex3d = BoxIndex<3, double>;

JOSTLE_NAMESPACE_END
