// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/executor.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/query.hpp"
#include "jostle/version.hpp"

// The verbs of all queries: any, count, first, nearest, all, visit. A BoxIndex and a World have them alike.

JOSTLE_NAMESPACE_BEGIN

// In shape_query.hpp.
template <int Dim, Coordinate T>
struct ShapeSweep;
template <int Dim, Coordinate T>
struct NearestToShape;
template <int Dim, Coordinate T>
struct PosedShape;
template <int Dim, Coordinate T>
class PosedShapes;
template <int Dim, Coordinate T, class Id>
struct ShapeHit;
template <int Dim, Coordinate T, class Id>
struct ShapeDistance;

/// Where answers of yes or no go: bools, or bytes that become 0 or 1, in an array, vector or span. (The bits
/// of a std::vector<bool> are neither; a std::vector<std::uint8_t> takes its place.)
///
/// Lifetime  a view: what it is made of must outlive the call.
class BoolSpan
{
  public:
    template <class Bools>
        requires std::convertible_to<Bools&, std::span<bool>>
    BoolSpan(Bools&& bools) noexcept : bools_(bools)
    {
    }
    template <class Bytes>
        requires std::convertible_to<Bytes&, std::span<std::uint8_t>>
    BoolSpan(Bytes&& bytes) noexcept
    {
        static_assert(sizeof(bool) == 1);
        const std::span<std::uint8_t> all(bytes);
        bools_ = {reinterpret_cast<bool*>(all.data()), all.size()};
    }
    [[nodiscard]] std::size_t size() const noexcept { return bools_.size(); }
    [[nodiscard]] bool& operator[](std::size_t i) const noexcept { return bools_[i]; }

  private:
    std::span<bool> bools_;
};

/// The answers of a batch. List i belongs to query i. The next call refills the lists and uses their memory
/// again.
template <class Item>
class ResultLists
{
  public:
    explicit ResultLists(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
        : offsets_(memory), items_(memory), more_(memory), found_(memory)
    {
    }

    [[nodiscard]] std::size_t size() const noexcept { return more_.size(); }
    [[nodiscard]] std::span<const Item> operator[](std::size_t i) const noexcept
    {
        return std::span<const Item>(items_).subspan(offsets_[i], offsets_[i + 1] - offsets_[i]);
    }
    /// Whether query i has more results than `max_results`, which list i was cut to.
    [[nodiscard]] bool more(std::size_t i) const noexcept { return more_[i] != 0; }
    /// All lists, one behind the other.
    [[nodiscard]] std::span<const Item> items() const noexcept { return items_; }
    /// List i is items()[offsets()[i]] to items()[offsets()[i + 1] - 1]. Empty before the first call.
    [[nodiscard]] std::span<const std::size_t> offsets() const noexcept
    {
        return std::span<const std::size_t>(offsets_).first(offsets_.empty() ? 0 : size() + 1);
    }

  private:
    friend class ResultListsAccess; // who fills them
    std::pmr::vector<std::size_t> offsets_;
    std::pmr::vector<Item> items_;
    std::pmr::vector<std::uint8_t> more_;
    std::pmr::vector<std::pmr::vector<Item>> found_; // working memory, by slot
};

namespace detail {
/// The `Error` where there are more or fewer `things` than queries.
[[noreturn]] JOSTLE_API void throw_not_one_each(std::size_t queries, std::size_t count, const char* things);

/// The filters of a batch: none, one for all queries, or one for each. A view.
template <class Filter>
class QueryFilters
{
  public:
    QueryFilters() noexcept : QueryFilters(none) {}
    QueryFilters(const Filter& for_all) noexcept : filters_(&for_all, 1) {}
    template <class Many>
        requires std::convertible_to<const Many&, std::span<const Filter>>
    QueryFilters(const Many& for_each) noexcept : filters_(for_each), one_each_(true)
    {
    }
    [[nodiscard]] bool one_each() const noexcept { return one_each_; }
    void check(std::size_t queries) const
    {
        if (one_each_ && filters_.size() != queries) throw_not_one_each(queries, filters_.size(), "filters");
    }
    [[nodiscard]] const Filter& operator[](std::size_t query) const noexcept
    {
        return filters_[one_each_ ? query : 0];
    }

  private:
    static inline const Filter none = {};
    std::span<const Filter> filters_;
    bool one_each_ = false;
};
} // namespace detail

/// What a batch takes for filters: one, or a vector, array or span with one for each query.
template <class Given, class Filter>
concept FiltersOf = std::convertible_to<const Given&, detail::QueryFilters<Filter>>;
/// Whether queries lie in one piece in it: a vector, array or span of them.
template <class Many>
concept QueryRange = requires(const Many& many) {
    std::data(many);
    std::size(many);
};
/// A ray, or a shape that moves.
template <class Query, int Dim, class T>
concept ShapeCastOf = std::same_as<Query, Ray<Dim, T>> || std::same_as<Query, ShapeSweep<Dim, T>>;
/// One of these, or a shape that stays.
template <class Query, int Dim, class T>
concept ShapeQueryOf = ShapeCastOf<Query, Dim, T> || std::same_as<Query, PosedShape<Dim, T>>;

/// Neither a query about boxes nor one about shapes, in these dimensions and numbers.
template <class Query, int Dim, class T>
concept NoQueryOf = !QueryOf<Query, Dim, T> && !ShapeQueryOf<Query, Dim, T> &&
                    !std::same_as<Query, NearestToShape<Dim, T>> && !QueryRange<Query>;

/// The queries of a BoxIndex or a World, which is `Structure`: of boxes, and of the shapes in them.
///
///     if (const auto hit = world.first(ray)) ...                    // the first box
///     if (const auto hit = world.first(ray, {shapes, poses})) ...   // the first shape
///     world.first(rays, hits);                                      // of each ray; any range of them
///
/// | verb    | of boxes                          | of shapes               | order of the answers       |
/// | any     | Ray, Sweep, Aabb, Sphere, Frustum | Ray, ShapeSweep,        |                            |
/// | count   |                                   | PosedShape              |                            |
/// | all     |                                   |                         | (fraction, id), or id      |
/// | visit   | these, Nearest, NearestToBox      | these, NearestToShape   | the same; of regions any   |
/// | first   | Ray, Sweep                        | Ray, ShapeSweep         | (fraction, id)             |
/// | nearest | Nearest, NearestToBox             | NearestToShape          | (distance, id)             |
///
/// For the shapes that touch a sphere ask with PosedShape{Shape3::sphere(radius), {center}}, and so with a
/// box or point. Frustums can't be asked about shapes.
///
/// Many      a vector, array or span in place of one query asks all of them, on the structure's executor, and
///           fills an element of a span, or a list, for each. One filter serves all, or a vector, array or
///           span has one for each; `accept` is told the number of the query.
/// Filter    says which objects count: QueryFilter, or ObjectQueryFilter for a World.
/// Shapes    `objects` has shape and pose of each object, by id (in a World, by the index of the id): see
///           PosedShapes. Answers are those of a loop over all shapes whose boxes the query meets, by
///           ray_cast, shape_cast, touching() or distance(). Each shape must lie in its object's box, as it
///           does in the box that bounds() gives. Rounding may let a ray miss a box that it only grazes: give
///           boxes a margin where that matters. Include jostle/shape_query.hpp, and link jostle::contacts.
/// Threads   any number of threads may ask at a time, while nothing changes the structure.
/// Errors    `Error` for an invalid query, which it names; for filters or places for answers that aren't one
///           for each query (size_mismatch); for an object that a query meets and that has no shape or pose,
///           or an invalid one. Then results are empty or cut short.
/// Cost      about the logarithm of the number of objects plus the results; for shapes a ray_cast,
///           shape_cast, touching() or distance() for each box that begins before the answer. Only results
///           are allocated; a steady call allocates nothing, unless hundreds of boxes are about equally near.
template <class Structure, int Dim, Coordinate T, class Id, class Filter>
class Queries
{
  public:
    static constexpr int dim = Dim;
    using Number = T;
    using Found = Hit<T, Id>;
    using Shapes = PosedShapes<Dim, T>;
    using FoundShape = ShapeHit<Dim, T, Id>;
    using FoundDistance = ShapeDistance<Dim, T, Id>;
    /// What a query finds: hits along lines, by fraction, and near something, by distance; else ids.
    template <class Query>
    using Answer = std::conditional_t<RegionOf<Query, Dim, T>, Id, Found>;
    template <class Query>
    using ShapeAnswer = std::conditional_t<
        std::same_as<Query, PosedShape<Dim, T>>, Id,
        std::conditional_t<std::same_as<Query, NearestToShape<Dim, T>>, FoundDistance, FoundShape>>;
    /// Is handed each answer, and returns whether to go on. Where answers have an order, it is handed a bound
    /// as well, of fractions, squared distances of boxes or distances of shapes: nothing beyond it is handed
    /// over from then on, so a visitor that needs no more lowers it. Raising it has no effect; NaN is an
    /// `Error`. A visitor may ask the same structure again, even the same query, but change nothing in it:
    /// that is an `Error` of the call that would.
    template <class Given>
    using Visitor = std::conditional_t<std::same_as<Given, Id>, FunctionRef<bool(Id id)>,
                                       FunctionRef<bool(const Given& found, T& bound)>>;
    // Regions are of boxes alone. The type says so for compilers that try to make shapes of a visitor before
    // they look at what `visit` requires.
    template <class Query>
    using ShapesFor = std::conditional_t<RegionOf<Query, Dim, T>, std::nullptr_t, Shapes>;
    using JoinVisitor = FunctionRef<bool(std::uint32_t position, Id id)>;
    using ClosestVisitor = FunctionRef<bool(const PairHit<T, Id>& pair, T& bound)>;
    /// Where a call takes `max_results`: all of them.
    static constexpr std::uint64_t no_limit = ~std::uint64_t{0};

    // --- Boxes ---
    // Braces are a box; a Ray for `first`, a Nearest for `nearest`: index.nearest({point, 8}, out).

    template <LineOrRegionOf<Dim, T> Query = Aabb<Dim, T>>
    [[nodiscard]] bool any(const Query& query, const Filter& filter = {}) const;
    template <LineOrRegionOf<Dim, T> Query = Aabb<Dim, T>>
    [[nodiscard]] std::uint64_t count(const Query& query, const Filter& filter = {}) const;
    /// The hit with the least fraction, of several the one with the lowest id.
    template <LineOf<Dim, T> Query = Ray<Dim, T>>
    [[nodiscard]] std::optional<Found> first(const Query& query, const Filter& filter = {}) const;
    template <NearestOf<Dim, T> Query = Nearest<Dim, T>>
    [[nodiscard]] std::optional<Found> nearest(const Query& query, const Filter& filter = {}) const;
    /// Refills `out` with the query's `count` nearest.
    template <NearestOf<Dim, T> Query = Nearest<Dim, T>>
    void nearest(const Query& query, std::vector<Found>& out, const Filter& filter = {}) const;
    /// Refills `out` with the first `max_results`, in order. Returns whether there are more.
    template <LineOrRegionOf<Dim, T> Query = Aabb<Dim, T>>
    bool all(const Query& query, std::vector<Answer<Query>>& out, const Filter& filter = {},
             std::uint64_t max_results = no_limit) const;
    /// Hands over each answer until the visitor returns false. Returns false then, else true. Of the nearest
    /// it hands over `count`. The search goes no further than the last answer, so a visitor that stops early,
    /// or lowers the bound, saves the rest. Regions have an order of the structure's own, which costs no
    /// sorting: it depends on nothing but the calls that were made, and changes when objects do.
    template <QueryOf<Dim, T> Query>
    bool visit(const Query& query, Visitor<Answer<Query>> visitor, const Filter& filter = {}) const;

    // --- The shapes in them ---

    template <ShapeQueryOf<Dim, T> Query>
    [[nodiscard]] bool any(const Query& query, const Shapes& objects, const Filter& filter = {}) const;
    template <ShapeQueryOf<Dim, T> Query>
    [[nodiscard]] std::uint64_t count(const Query& query, const Shapes& objects,
                                      const Filter& filter = {}) const;
    template <ShapeCastOf<Dim, T> Query = Ray<Dim, T>>
    [[nodiscard]] std::optional<FoundShape> first(const Query& query, const Shapes& objects,
                                                  const Filter& filter = {}) const;
    /// The shape that is nearest by distance(), or deepest where several overlap the one asked about; nothing
    /// where all are further than max_distance.
    template <std::same_as<NearestToShape<Dim, T>> Query>
    [[nodiscard]] std::optional<FoundDistance> nearest(const Query& query, const Shapes& objects,
                                                       const Filter& filter = {}) const;
    template <std::same_as<NearestToShape<Dim, T>> Query>
    void nearest(const Query& query, const Shapes& objects, std::vector<FoundDistance>& out,
                 const Filter& filter = {}) const;
    template <ShapeQueryOf<Dim, T> Query>
    bool all(const Query& query, const Shapes& objects, std::vector<ShapeAnswer<Query>>& out,
             const Filter& filter = {}, std::uint64_t max_results = no_limit) const;
    /// As of boxes; of the nearest it hands over `count`. Answers that have an order are kept in a vector
    /// until no box is left that may hold a nearer one.
    template <class Query>
        requires ShapeQueryOf<Query, Dim, T> || std::same_as<Query, NearestToShape<Dim, T>>
    bool visit(const Query& query, const ShapesFor<Query>& objects, Visitor<ShapeAnswer<Query>> visitor,
               const Filter& filter = {}) const;

    // --- Pairs ---

    /// Finds all pairs of one of `boxes` and an object whose closed box it touches, ascending by (a, b): a is
    /// the position in `boxes`, b the id in a BoxIndex, the index of the id in a World. Refills `out`, a
    /// std::vector or std::pmr::vector. Runs
    /// on the executor and in memory that the structure keeps, so one call at a time; a steady batch
    /// allocates nothing. `filters`: one for all boxes, or one for each.
    /// Costs less than any other way while a box has few results. With about 140 each, a PairFinder that is
    /// given both sets takes half the time, as results needn't be sorted by box there.
    template <FiltersOf<Filter> Filters = Filter, class Allocator>
        requires std::same_as<Allocator, std::allocator<Pair>> ||
                 std::same_as<Allocator, std::pmr::polymorphic_allocator<Pair>>
    void join(const BoxView<Dim, T>& boxes, std::vector<Pair, Allocator>& out, const Filters& filters = {})
    {
        join_into(boxes, out, filters);
    }
    /// Hands the same pairs over, box by box, until the visitor returns false. Returns false then, else true.
    /// The objects that one box touches come in the order of visit(). Costs about a query for each box, and
    /// no memory; it may be called by several threads at a time.
    template <FiltersOf<Filter> Filters = Filter>
    bool join(const BoxView<Dim, T>& boxes, JoinVisitor visitor, const Filters& filters = {}) const
    {
        return visit_joined(boxes, visitor, filters);
    }
    /// Hands over pairs no further apart than `max_distance`, the closest first, until the visitor returns
    /// false. Returns false then, else true. Pairs are of two of this structure's objects, each once, with
    /// a < b; or of one of this structure's, a, and one of another's, b, neither of which may change
    /// meanwhile. If `other` is this one, its own pairs are meant.
    /// The bound begins with the square of `max_distance`; the visitor makes it less as soon as it knows how
    /// far apart two shapes are. Pairs at squared distance 0 come in an order of the structure's own, the
    /// others ascending by (at, a, b). Costs one search for those at 0, and one more each time that the
    /// number handed over has grown fourfold.
    bool closest_pairs(ClosestVisitor visitor, T max_distance = std::numeric_limits<T>::infinity()) const
    {
        return closest_pairs(structure(), visitor, max_distance);
    }
    bool closest_pairs(const Structure& other, ClosestVisitor visitor,
                       T max_distance = std::numeric_limits<T>::infinity()) const;
    /// Returns the pair that closest_pairs hands over first.
    [[nodiscard]] std::optional<PairHit<T, Id>>
    closest_pair(T max_distance = std::numeric_limits<T>::infinity()) const
    {
        return closest_pair(structure(), max_distance);
    }
    [[nodiscard]] std::optional<PairHit<T, Id>>
    closest_pair(const Structure& other, T max_distance = std::numeric_limits<T>::infinity()) const
    {
        std::optional<PairHit<T, Id>> closest;
        const auto keep_first = [&](const PairHit<T, Id>& hit, T&) { return closest = hit, false; };
        closest_pairs(other, keep_first, max_distance);
        return closest;
    }

    // --- Many queries at once ---
    // Where `first` and `nearest` find nothing for a query, its element of `out` has the id Found::none, and
    // of shapes an infinite fraction or distance.

    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void any(const Many& queries, BoolSpan out, const Filters& filters = {}) const
    {
        any_of_each(view(queries), out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void any(const Many& queries, const Shapes& objects, BoolSpan out, const Filters& filters = {}) const
    {
        any_of_each(view(queries), objects, out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void count(const Many& queries, std::span<std::uint64_t> out, const Filters& filters = {}) const
    {
        count_of_each(view(queries), out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void count(const Many& queries, const Shapes& objects, std::span<std::uint64_t> out,
               const Filters& filters = {}) const
    {
        count_of_each(view(queries), objects, out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void first(const Many& queries, std::span<Found> out, const Filters& filters = {}) const
    {
        first_of_each(view(queries), out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void first(const Many& queries, const Shapes& objects, std::type_identity_t<std::span<FoundShape>> out,
               const Filters& filters = {}) const
    {
        first_of_each(view(queries), objects, out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void nearest(const Many& queries, std::span<Found> out, const Filters& filters = {}) const
    {
        nearest_of_each(view(queries), out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void nearest(const Many& queries, ResultLists<Found>& out, const Filters& filters = {}) const
    {
        nearest_of_each(view(queries), out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void nearest(const Many& queries, const Shapes& objects,
                 std::type_identity_t<std::span<FoundDistance>> out, const Filters& filters = {}) const
    {
        nearest_of_each(view(queries), objects, out, filters);
    }
    template <QueryRange Many, FiltersOf<Filter> Filters = Filter>
    void nearest(const Many& queries, const Shapes& objects, ResultLists<FoundDistance>& out,
                 const Filters& filters = {}) const
    {
        nearest_of_each(view(queries), objects, out, filters);
    }
    template <QueryRange Many, class Item, FiltersOf<Filter> Filters = Filter>
    void all(const Many& queries, ResultLists<Item>& out, const Filters& filters = {},
             std::uint64_t max_results = no_limit) const
    {
        all_of_each(view(queries), out, filters, max_results);
    }
    template <QueryRange Many, class Item, FiltersOf<Filter> Filters = Filter>
    void all(const Many& queries, const Shapes& objects, ResultLists<Item>& out, const Filters& filters = {},
             std::uint64_t max_results = no_limit) const
    {
        all_of_each(view(queries), objects, out, filters, max_results);
    }

    // Not for queries in other dimensions or numbers than the structure's.
    template <NoQueryOf<Dim, T> Wrong, class... More>
    void any(const Wrong& no_query_of_this_structure, More&&...) const = delete;
    template <NoQueryOf<Dim, T> Wrong, class... More>
    void count(const Wrong& no_query_of_this_structure, More&&...) const = delete;
    template <NoQueryOf<Dim, T> Wrong, class... More>
    void first(const Wrong& no_query_of_this_structure, More&&...) const = delete;
    template <NoQueryOf<Dim, T> Wrong, class... More>
    void nearest(const Wrong& no_query_of_this_structure, More&&...) const = delete;
    template <NoQueryOf<Dim, T> Wrong, class... More>
    void all(const Wrong& no_query_of_this_structure, More&&...) const = delete;
    template <NoQueryOf<Dim, T> Wrong, class... More>
    void visit(const Wrong& no_query_of_this_structure, More&&...) const = delete;

  protected:
    Queries() = default;
    Queries(const Queries&) = default;
    Queries& operator=(const Queries&) = default;
    ~Queries() = default;

  private:
    using StructureType = Structure;
    using Filters = detail::QueryFilters<Filter>;
    template <class Many>
    static auto view(const Many& queries) noexcept
    {
        return std::span<const std::remove_cvref_t<decltype(*std::data(queries))>>(std::data(queries),
                                                                                   std::size(queries));
    }
    [[nodiscard]] const Structure& structure() const noexcept { return static_cast<const Structure&>(*this); }

    template <LineOrRegionOf<Dim, T> Query>
    void any_of_each(std::span<const Query> queries, BoolSpan out, const Filters& filters) const;
    template <LineOrRegionOf<Dim, T> Query>
    void count_of_each(std::span<const Query> queries, std::span<std::uint64_t> out,
                       const Filters& filters) const;
    template <LineOf<Dim, T> Query>
    void first_of_each(std::span<const Query> queries, std::span<Found> out, const Filters& filters) const;
    template <NearestOf<Dim, T> Query>
    void nearest_of_each(std::span<const Query> queries, std::span<Found> out, const Filters& filters) const;
    template <NearestOf<Dim, T> Query>
    void nearest_of_each(std::span<const Query> queries, ResultLists<Found>& out,
                         const Filters& filters) const;
    template <LineOrRegionOf<Dim, T> Query>
    void all_of_each(std::span<const Query> queries, ResultLists<Answer<Query>>& out, const Filters& filters,
                     std::uint64_t max_results) const;

    template <ShapeQueryOf<Dim, T> Query>
    void any_of_each(std::span<const Query> queries, const Shapes& objects, BoolSpan out,
                     const Filters& filters) const;
    template <ShapeQueryOf<Dim, T> Query>
    void count_of_each(std::span<const Query> queries, const Shapes& objects, std::span<std::uint64_t> out,
                       const Filters& filters) const;
    template <ShapeCastOf<Dim, T> Query>
    void first_of_each(std::span<const Query> queries, const Shapes& objects, std::span<FoundShape> out,
                       const Filters& filters) const;
    template <std::same_as<NearestToShape<Dim, T>> Query>
    void nearest_of_each(std::span<const Query> queries, const Shapes& objects,
                         ResultLists<FoundDistance>& out, const Filters& filters) const;
    template <std::same_as<NearestToShape<Dim, T>> Query>
    void nearest_of_each(std::span<const Query> queries, const Shapes& objects, std::span<FoundDistance> out,
                         const Filters& filters) const;
    template <ShapeQueryOf<Dim, T> Query>
    void all_of_each(std::span<const Query> queries, const Shapes& objects,
                     ResultLists<ShapeAnswer<Query>>& out, const Filters& filters,
                     std::uint64_t max_results) const;
    [[nodiscard]] Executor& executor() const noexcept;
    template <class Allocator>
    void join_into(const BoxView<Dim, T>& boxes, std::vector<Pair, Allocator>& out, const Filters& filters);
    bool visit_joined(const BoxView<Dim, T>& boxes, JoinVisitor visitor, const Filters& filters) const;
};

JOSTLE_NAMESPACE_END
