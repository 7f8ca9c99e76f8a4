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
#include "jostle/query.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Executor, memory, instruction set, and whether odd boxes are accepted: the same as a finder's.
using IndexOptions = FinderOptions;

/// Tells what an index is made of at the moment, and how much was done to keep it in order.
struct IndexStats
{
    std::uint64_t objects = 0;
    std::uint64_t odd = 0;    ///< of these: found by nothing; see FinderOptions::ignore_odd_boxes
    std::uint64_t pages = 0;  ///< groups of at most 256 objects
    std::uint64_t leaves = 0; ///< groups of at most 16 objects, what is tested at once
    std::uint64_t nodes = 0;  ///< groups of at most 16 pages or nodes
    std::uint64_t depth = 0;  ///< nodes on the longest way to a page
    std::uint64_t bytes = 0;  ///< memory held
    std::uint64_t sorts = 0;  ///< pages put in order since the last build()
    std::uint64_t splits = 0; ///< pages split since then
};

/// Boxes that stay, and questions about them: which are touched by a ray, a moving box, a box, a sphere, a
/// view volume; which are nearest; which touch any of a batch of others.
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
/// Cost      insert, erase and move cost about a microsecond an object or less, amortised in small steps; a
///           question about the logarithm of the number of objects plus its results.
/// Threads   questions (the const members) may be asked from any number of threads at a time while no other
///           member runs. A visitor or an `accept` may ask the same index; to change it there is an `Error`,
///           and to move, assign or destroy it isn't allowed.
/// Numbers   unlike a PairFinder, leaves the threads' floating-point mode alone: where the host flushes
///           denormal numbers to zero, bounds a denormal apart may touch.
/// Errors    `Error` naming the bad box, id or question and what is wrong with it, std::bad_alloc, or what a
///           callback threw: the index is as before the call, a result buffer is empty or cut short.
/// Source    docs/guide/queries.md
template <int Dim, Coordinate T>
class JOSTLE_API BoxIndex
{
  public:
    using Box = Aabb<Dim, T>;
    /// Where a call takes `max_results`: all of them.
    static constexpr std::uint64_t no_limit = ~std::uint64_t{0};

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
    /// Returns the least box around all boxes that aren't odd; none if there is none. Costs nothing.
    [[nodiscard]] std::optional<Box> bounds() const noexcept;
    [[nodiscard]] IndexStats stats() const noexcept;

    // --- Many boxes at once ---

    /// Finds all pairs of one of `boxes` and an object whose closed box it touches, ascending by (a, b): a is
    /// the position in `boxes`, b the object's id. Refills `out`. Runs on the executor and in working memory
    /// that the index keeps, so one call at a time; a steady batch allocates nothing.
    /// Costs less than any other way while a box has few results. With about 140 each, a PairFinder that is
    /// given both sets takes half the time, as results needn't be sorted by box there.
    void join(const BoxView<Dim, T>& boxes, std::pmr::vector<Pair>& out, const QueryFilter& filter = {});
    /// Hands the same pairs to `visitor`, a by a, until it returns false. Returns false then, else true. The
    /// objects that one box touches come in the order of visit(). Costs about a question for each box, and no
    /// memory; it may be called by several threads at a time.
    bool join(const BoxView<Dim, T>& boxes, PairVisitor visitor, const QueryFilter& filter = {}) const;
    // With one filter for each box, which is the question that `accept` is told.
    void join(const BoxView<Dim, T>& boxes, std::pmr::vector<Pair>& out, FilterOfEach<QueryFilter> filters);
    bool join(const BoxView<Dim, T>& boxes, PairVisitor visitor, FilterOfEach<QueryFilter> filters) const;

    // --- Along a line ---
    // `Line` is Ray<Dim, T> or Sweep<Dim, T>. `first` is the hit with the least fraction, of several the one
    // with the lowest id. `all` refills `out`, ascending by (fraction, id), with the first `max_results` of
    // the hits, and returns whether there are more.

    [[nodiscard]] std::optional<Hit<T>> first(const Ray<Dim, T>& ray, const QueryFilter& filter = {}) const;
    [[nodiscard]] std::optional<Hit<T>> first(const Sweep<Dim, T>& sweep,
                                              const QueryFilter& filter = {}) const;
    bool all(const Ray<Dim, T>& ray, std::vector<Hit<T>>& out, const QueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;
    bool all(const Sweep<Dim, T>& sweep, std::vector<Hit<T>>& out, const QueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;

    // --- In a region ---
    // A box, a sphere or a frustum. `all` refills `out`, ascending by id, with the first `max_results` of the
    // objects that touch the region, and returns whether there are more.

    bool all(const Box& region, std::vector<std::uint32_t>& out, const QueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;
    bool all(const Sphere<Dim, T>& region, std::vector<std::uint32_t>& out, const QueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;
    bool all(const Frustum<Dim, T>& region, std::vector<std::uint32_t>& out, const QueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;

    // --- Near a point or a box ---

    /// Refills `out`, ascending by (squared distance, id).
    void nearest(const Nearest<Dim, T>& question, std::vector<Hit<T>>& out,
                 const QueryFilter& filter = {}) const;
    void nearest(const NearestToBox<Dim, T>& question, std::vector<Hit<T>>& out,
                 const QueryFilter& filter = {}) const;

    // --- Handed over as they are found ---
    // `visitor` gets each object that is an answer, once, until it returns false; the call returns false
    // then, else true. The visitors in query.hpp say what one may do. What it throws ends the call. Nothing
    // is allocated, except the first time that hundreds of objects are about equally near.
    // Lines and the nearest hand objects over ascending by (at, id); the nearest, at most `count` of them.
    // The search goes no further than the last object handed over, so a visitor that stops early, or lowers
    // the bound, saves the rest. Regions hand objects over in an order of the index's own, which costs no
    // sorting: it depends on nothing but the calls that were made, and changes when objects do.

    bool visit(const Ray<Dim, T>& ray, HitVisitor<T> visitor, const QueryFilter& filter = {}) const;
    bool visit(const Sweep<Dim, T>& sweep, HitVisitor<T> visitor, const QueryFilter& filter = {}) const;
    bool visit(const Nearest<Dim, T>& question, HitVisitor<T> visitor, const QueryFilter& filter = {}) const;
    bool visit(const NearestToBox<Dim, T>& question, HitVisitor<T> visitor,
               const QueryFilter& filter = {}) const;
    bool visit(const Box& region, IdVisitor visitor, const QueryFilter& filter = {}) const;
    bool visit(const Sphere<Dim, T>& region, IdVisitor visitor, const QueryFilter& filter = {}) const;
    bool visit(const Frustum<Dim, T>& region, IdVisitor visitor, const QueryFilter& filter = {}) const;

    // --- Pairs of objects ---
    // Pairs are of two of this index's objects, each once, with a < b; or of one of this index's, a, and one
    // of another index's, b. Both indexes are asked: neither may change meanwhile. If `other` is this index,
    // its own pairs are meant.

    /// Hands over the pairs whose boxes touch until `visitor` returns false. Returns false then, else true.
    /// The order is the indexes' own, as with visit() of a region. Allocates nothing. For all pairs of many
    /// objects that move, a PairFinder costs less.
    bool pairs(PairVisitor visitor) const;
    bool pairs(const BoxIndex& other, PairVisitor visitor) const;
    /// Hands over pairs no further apart than `max_distance`, the closest first, until `visitor` returns
    /// false. Returns false then, else true. The bound begins with the square of `max_distance`; the visitor
    /// makes it less as soon as it knows how far apart two shapes are. Pairs at squared distance 0 come in an
    /// order of the indexes' own, the others ascending by (at, a, b). Costs a search for those at 0, and
    /// about as much again each time that four times as many were handed over as the time before.
    bool closest_pairs(PairHitVisitor<T> visitor, T max_distance = std::numeric_limits<T>::infinity()) const;
    bool closest_pairs(const BoxIndex& other, PairHitVisitor<T> visitor,
                       T max_distance = std::numeric_limits<T>::infinity()) const;
    /// Returns the pair that closest_pairs hands over first.
    [[nodiscard]] std::optional<PairHit<T>>
    closest_pair(T max_distance = std::numeric_limits<T>::infinity()) const;
    [[nodiscard]] std::optional<PairHit<T>>
    closest_pair(const BoxIndex& other, T max_distance = std::numeric_limits<T>::infinity()) const;

    // --- Only whether, or how many ---
    // `Question` is Ray, Sweep, Aabb, Sphere or Frustum.

    template <LineOrRegionOf<Dim, T> Question>
    [[nodiscard]] bool any(const Question& question, const QueryFilter& filter = {}) const;
    template <LineOrRegionOf<Dim, T> Question>
    [[nodiscard]] std::uint64_t count(const Question& question, const QueryFilter& filter = {}) const;

    // --- Many questions at once ---
    // The same answers, found on the executor's threads. Questions of one kind lie in a vector, array or
    // span. One QueryFilter serves all, or a vector, array or span has one for each, or it is an `Error`
    // (size_mismatch). `accept` is told the question. An array of results wants one element per question;
    // `first` says "none" by Hit<T>::none.

    template <QuestionRange Many, class Filters = QueryFilter>
    void first(const Many& lines, std::span<Hit<T>> out, const Filters& filters = {}) const
    {
        first_of_each(std::span<const std::ranges::range_value_t<Many>>(lines), out, filters);
    }
    template <QuestionRange Many, class Item, class Filters = QueryFilter>
    void all(const Many& questions, ResultLists<Item>& out, const Filters& filters = {},
             std::uint64_t max_results = no_limit) const
    {
        all_of_each(std::span<const std::ranges::range_value_t<Many>>(questions), out, filters, max_results);
    }
    template <QuestionRange Many, class Filters = QueryFilter>
    void nearest(const Many& questions, ResultLists<Hit<T>>& out, const Filters& filters = {}) const
    {
        nearest_of_each(std::span<const std::ranges::range_value_t<Many>>(questions), out, filters);
    }
    template <QuestionRange Many, class Filters = QueryFilter>
    void any(const Many& questions, BoolSpan out, const Filters& filters = {}) const
    {
        any_of_each(std::span<const std::ranges::range_value_t<Many>>(questions), out, filters);
    }
    template <QuestionRange Many, class Filters = QueryFilter>
    void count(const Many& questions, std::span<std::uint64_t> out, const Filters& filters = {}) const
    {
        count_of_each(std::span<const std::ranges::range_value_t<Many>>(questions), out, filters);
    }

  private:
    friend class BoxIndexAccess; // for World; see src/index/box_index_access.hpp
    using QuestionFilters = detail::QuestionFilters<QueryFilter>;
    template <LineOf<Dim, T> Line>
    void first_of_each(std::span<const Line> lines, std::span<Hit<T>> out,
                       const QuestionFilters& filters) const;
    template <class Question>
    using AnswerTo = std::conditional_t<LineOf<Question, Dim, T>, Hit<T>, std::uint32_t>;
    template <LineOrRegionOf<Dim, T> Question>
    void all_of_each(std::span<const Question> questions, ResultLists<AnswerTo<Question>>& out,
                     const QuestionFilters& filters, std::uint64_t max_results) const;
    template <NearestOf<Dim, T> Question>
    void nearest_of_each(std::span<const Question> questions, ResultLists<Hit<T>>& out,
                         const QuestionFilters& filters) const;
    template <LineOrRegionOf<Dim, T> Question>
    void any_of_each(std::span<const Question> questions, BoolSpan out, const QuestionFilters& filters) const;
    template <LineOrRegionOf<Dim, T> Question>
    void count_of_each(std::span<const Question> questions, std::span<std::uint64_t> out,
                       const QuestionFilters& filters) const;
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

using BoxIndex2f = BoxIndex<2, float>;
using BoxIndex3f = BoxIndex<3, float>;
using BoxIndex2d = BoxIndex<2, double>;
using BoxIndex3d = BoxIndex<3, double>;

JOSTLE_NAMESPACE_END
