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

/// Tells what an index is made of at the moment, and how much was done to keep it in order.
struct IndexStats
{
    std::uint64_t objects = 0;
    std::uint64_t pages = 0;  ///< groups of at most 256 objects
    std::uint64_t leaves = 0; ///< groups of at most 16 objects, what is tested at once
    std::uint64_t nodes = 0;  ///< groups of at most 16 pages or nodes
    std::uint64_t depth = 0;  ///< nodes on the longest way to a page
    std::uint64_t bytes = 0;  ///< memory held
    std::uint64_t sorts = 0;  ///< pages put in order since the last build()
    std::uint64_t splits = 0; ///< pages split since then
};

/// Boxes that stay, and queries: which are touched by a ray, a moving box, a box, a sphere, a view volume;
/// which are nearest; which touch any of a batch of others. The queries' verbs are in queries.hpp.
///
/// Objects are known by ids that the caller chooses, any 32-bit numbers but the greatest; memory is four
/// bytes (six while ids are added one by one) per id up to the greatest that was inserted, so keep them
/// dense: see release_memory. The index keeps the exact boxes itself,
/// `box(id)` returns them: there is no need to keep them elsewhere.
///
/// Exact     answers are what hit_fraction, squared_distance and overlaps say about each box. No result is
///           dropped or capped unless `max_results` asks for it.
/// Same      the same boxes give the same answers in the same order, however they came into the index, for
///           any executor, number of threads and instruction set.
/// Nothing to configure or to call from time to time: no bounds, no cell size, no optimise(). Boxes may be of
///           any sizes, anywhere, infinite too, all in one place or all moving away.
/// Cost      insert, erase and move cost about a microsecond an object or less, amortised in small steps.
///           Of queries: see Queries.
/// Threads   queries (the const members) may be asked from any number of threads at a time while no other
///           member runs. A visitor or an `accept` may ask the same index; to change it there is an `Error`,
///           and to move, assign or destroy it isn't allowed.
/// Numbers   unlike a PairFinder, leaves the threads' floating-point mode alone: where the host flushes
///           denormal numbers to zero, bounds a denormal apart may touch.
/// Errors    `Error` naming the bad box, id or query and what is wrong with it, std::bad_alloc, or what a
///           callback threw: the index is as before the call, a result buffer is empty or cut short.
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

    /// Forgets everything and takes these boxes: box i gets the id i, or ids[i].
    void build(const BoxView<Dim, T>& boxes);
    void build(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes);
    /// Adds objects. No id may be in the index already, or twice in the call.
    void insert(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes);
    /// Removes objects. Every id must be in the index, and once in the call.
    void erase(std::span<const std::uint32_t> ids);
    /// Gives objects new boxes. Those that stay nearby cost the least. From a tenth of all objects on the
    /// index is built anew, so no number of moves costs much more than that. Every id must be in the index,
    /// and once in the call.
    void move(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes);
    // The same for one object.
    void insert(std::uint32_t id, const Box& box) { insert(std::span(&id, 1), std::span(&box, 1)); }
    void erase(std::uint32_t id) { erase(std::span(&id, 1)); }
    void move(std::uint32_t id, const Box& box) { move(std::span(&id, 1), std::span(&box, 1)); }
    /// Removes all objects, and keeps the memory.
    void clear();
    /// Gives back the working memory of join and of building again (as much as the index itself and 16 bytes
    /// a box), and the memory of ids above the greatest in use. An empty index keeps no more than some
    /// hundred bytes, which the destructor frees.
    void release_memory();

    [[nodiscard]] std::size_t size() const noexcept;
    [[nodiscard]] bool contains(std::uint32_t id) const noexcept;
    /// Returns the box of an object that is in the index.
    [[nodiscard]] Box box(std::uint32_t id) const;
    /// Returns the least box around all boxes; none if there is none. Costs nothing.
    [[nodiscard]] std::optional<Box> bounds() const noexcept;
    [[nodiscard]] IndexStats stats() const noexcept;

    /// Hands over the pairs whose boxes touch, of two of this index's objects, each once, with a < b; or of
    /// one of this index's, a, and one of another's, b; if that is this one, its own. Until the visitor
    /// returns false: returns false then, else true. The order is the indexes' own, as with visit() of a
    /// region. Allocates nothing. For all pairs of many objects that move, a PairFinder costs less.
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
