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

// The verbs of all queries: any, count, first, nearest, all, visit. A BoxIndex and a World both have them.

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

/// Output for yes/no answers: an array, vector or span of bools, or of bytes that become 0 or 1. (Not a
/// std::vector<bool>, which stores bits; use a std::vector<std::uint8_t>.)
///
/// Lifetime  a view: the memory must outlive the call.
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

/// The answers of a batch. List i belongs to query i. The next call refills the lists and reuses their
/// memory.
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
    /// Whether query i has more results than the `max_results` in list i.
    [[nodiscard]] bool more(std::size_t i) const noexcept { return more_[i] != 0; }
    /// All lists, one after another.
    [[nodiscard]] std::span<const Item> items() const noexcept { return items_; }
    /// List i is items()[offsets()[i]] to items()[offsets()[i + 1] - 1]. Empty before the first call.
    [[nodiscard]] std::span<const std::size_t> offsets() const noexcept
    {
        return std::span<const std::size_t>(offsets_).first(offsets_.empty() ? 0 : size() + 1);
    }

  private:
    friend class ResultListsAccess; // fills them
    std::pmr::vector<std::size_t> offsets_;
    std::pmr::vector<Item> items_;
    std::pmr::vector<std::uint8_t> more_;
    std::pmr::vector<std::pmr::vector<Item>> found_; // working memory, by slot
};

namespace detail {
/// The `Error` if there are more or fewer `things` than queries.
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

/// The filters that a batch accepts: one for all queries, or a vector, array or span with one for each.
template <class Given, class Filter>
concept FiltersOf = std::convertible_to<const Given&, detail::QueryFilters<Filter>>;
/// A contiguous range of queries: a vector, array or span.
template <class Many>
concept QueryRange = requires(const Many& many) {
    std::data(many);
    std::size(many);
};
/// A ray or a moving shape.
template <class Query, int Dim, class T>
concept ShapeCastOf = std::same_as<Query, Ray<Dim, T>> || std::same_as<Query, ShapeSweep<Dim, T>>;
/// One of these, or a shape that doesn't move.
template <class Query, int Dim, class T>
concept ShapeQueryOf = ShapeCastOf<Query, Dim, T> || std::same_as<Query, PosedShape<Dim, T>>;

/// Not a query about boxes or shapes with this dimension and number type.
template <class Query, int Dim, class T>
concept NoQueryOf = !QueryOf<Query, Dim, T> && !ShapeQueryOf<Query, Dim, T> &&
                    !std::same_as<Query, NearestToShape<Dim, T>> && !QueryRange<Query>;

/// The queries of a BoxIndex or a World (`Structure`): about boxes, and about the shapes in them.
///
///     if (const auto hit = world.first(ray)) ...                    // the first box
///     if (const auto hit = world.first(ray, {shapes, poses})) ...   // the first shape
///     world.first(rays, hits);                                      // the first box on each ray
///
/// | verb    | of boxes                          | of shapes               | order of the answers       |
/// | any     | Ray, Sweep, Aabb, Sphere, Frustum | Ray, ShapeSweep,        |                            |
/// | count   |                                   | PosedShape              |                            |
/// | all     |                                   |                         | (fraction, id), or id      |
/// | visit   | these, Nearest, NearestToBox      | these, NearestToShape   | the same; of regions any   |
/// | first   | Ray, Sweep                        | Ray, ShapeSweep         | (fraction, id)             |
/// | nearest | Nearest, NearestToBox             | NearestToShape          | (distance, id)             |
///
/// To find the shapes that touch a sphere, use PosedShape{Shape3::sphere(radius), {center}}; likewise for a
/// box or point. Frustums work for boxes only.
///
/// Many      given a vector, array or span of queries, a call answers all of them on the structure's
///           executor, and fills an element of a span, or a list, for each. Give one filter for all, or a
///           vector, array or span with one for each; `accept` receives the number of the query.
/// Filter    which objects count: a QueryFilter, or an ObjectQueryFilter for a World.
/// Shapes    `objects` has the shape and pose of each object, by id (in a World, by the index of the id): see
///           PosedShapes. The answers are those of ray_cast, shape_cast, touching() or distance() in a loop
///           over all shapes whose boxes the query meets. Each shape must lie in its object's box; bounds()
///           gives such a box. A ray may miss, by rounding, a box that it only grazes: give boxes a margin if
///           that matters. Include jostle/shape_query.hpp, and link jostle::contacts.
/// Threads   any number of threads may query at a time, while nothing changes the structure.
/// Errors    `Error` for an invalid query, which it names; if the numbers of filters or results differ from
///           that of queries (size_mismatch); for an object that a query meets whose shape or pose is missing
///           or invalid. The results are then empty or incomplete.
/// Cost      about the logarithm of the number of objects plus the results; for shapes also a ray_cast,
///           shape_cast, touching() or distance() for each box that is met before the answer. Only results
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
    /// What a query finds: hits with a fraction (along lines) or a distance (nearest), or ids (regions).
    template <class Query>
    using Answer = std::conditional_t<RegionOf<Query, Dim, T>, Id, Found>;
    template <class Query>
    using ShapeAnswer = std::conditional_t<
        std::same_as<Query, PosedShape<Dim, T>>, Id,
        std::conditional_t<std::same_as<Query, NearestToShape<Dim, T>>, FoundDistance, FoundShape>>;
    /// Called for each answer; returns whether to go on. If answers have an order, it also gets a bound, of
    /// fractions, squared distances of boxes or distances of shapes. It may lower the bound, and answers
    /// beyond it are then skipped. Raising it has no effect; NaN is an `Error`. A visitor may query the same
    /// structure, even with the same query. A call that would change the structure is an `Error`.
    template <class Given>
    using Visitor = std::conditional_t<std::same_as<Given, Id>, FunctionRef<bool(Id id)>,
                                       FunctionRef<bool(const Given& found, T& bound)>>;
    // Regions work for boxes only. This type says so to compilers that try to convert a visitor to shapes
    // before they check the constraints of `visit`.
    template <class Query>
    using ShapesFor = std::conditional_t<RegionOf<Query, Dim, T>, std::nullptr_t, Shapes>;
    using JoinVisitor = FunctionRef<bool(std::uint32_t position, Id id)>;
    using ClosestVisitor = FunctionRef<bool(const PairHit<T, Id>& pair, T& bound)>;
    /// As `max_results`: return all results.
    static constexpr std::uint64_t no_limit = ~std::uint64_t{0};

    // --- Boxes ---
    // A query in braces is a box, for `first` a Ray, and for `nearest` a Nearest: index.nearest({point, 8},
    // out).

    template <LineOrRegionOf<Dim, T> Query = Aabb<Dim, T>>
    [[nodiscard]] bool any(const Query& query, const Filter& filter = {}) const;
    template <LineOrRegionOf<Dim, T> Query = Aabb<Dim, T>>
    [[nodiscard]] std::uint64_t count(const Query& query, const Filter& filter = {}) const;
    /// Returns the hit with the least fraction; of several, the one with the lowest id.
    template <LineOf<Dim, T> Query = Ray<Dim, T>>
    [[nodiscard]] std::optional<Found> first(const Query& query, const Filter& filter = {}) const;
    template <NearestOf<Dim, T> Query = Nearest<Dim, T>>
    [[nodiscard]] std::optional<Found> nearest(const Query& query, const Filter& filter = {}) const;
    /// Refills `out` with the `count` nearest boxes.
    template <NearestOf<Dim, T> Query = Nearest<Dim, T>>
    void nearest(const Query& query, std::vector<Found>& out, const Filter& filter = {}) const;
    /// Refills `out` with the first `max_results` answers, in order. Returns whether there are more.
    template <LineOrRegionOf<Dim, T> Query = Aabb<Dim, T>>
    bool all(const Query& query, std::vector<Answer<Query>>& out, const Filter& filter = {},
             std::uint64_t max_results = no_limit) const;
    /// Calls the visitor for each answer (for Nearest, for `count` of them) until it returns false. Returns
    /// false if it stopped early. The search goes no further than the last answer, so stopping early or
    /// lowering the bound saves time. Answers of regions aren't sorted: they come in the structure's own
    /// order, which depends only on the calls made so far, and changes when objects do.
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
    /// Returns the nearest shape by distance(), or the deepest if several overlap the query's shape; nothing
    /// if all are further than max_distance.
    template <std::same_as<NearestToShape<Dim, T>> Query>
    [[nodiscard]] std::optional<FoundDistance> nearest(const Query& query, const Shapes& objects,
                                                       const Filter& filter = {}) const;
    template <std::same_as<NearestToShape<Dim, T>> Query>
    void nearest(const Query& query, const Shapes& objects, std::vector<FoundDistance>& out,
                 const Filter& filter = {}) const;
    template <ShapeQueryOf<Dim, T> Query>
    bool all(const Query& query, const Shapes& objects, std::vector<ShapeAnswer<Query>>& out,
             const Filter& filter = {}, std::uint64_t max_results = no_limit) const;
    /// As for boxes. Ordered answers are kept in a vector until no remaining box can contain a nearer one.
    template <class Query>
        requires ShapeQueryOf<Query, Dim, T> || std::same_as<Query, NearestToShape<Dim, T>>
    bool visit(const Query& query, const ShapesFor<Query>& objects, Visitor<ShapeAnswer<Query>> visitor,
               const Filter& filter = {}) const;

    // --- Pairs ---

    /// Finds all pairs of one of `boxes` and an object whose closed box it touches. Pairs ascend by (a, b): a
    /// is the position in `boxes`, b the id in a BoxIndex, or the index of the id in a World. Refills `out`,
    /// a std::vector or std::pmr::vector. Runs on the executor and in memory that the structure keeps, so one
    /// call at a time; a steady batch allocates nothing. `filters`: one for all boxes, or one for each. This
    /// is the fastest way while boxes have few results. With about 140 each, a PairFinder on both sets takes
    /// half the time, since it doesn't sort results by box.
    template <FiltersOf<Filter> Filters = Filter, class Allocator>
        requires std::same_as<Allocator, std::allocator<Pair>> ||
                 std::same_as<Allocator, std::pmr::polymorphic_allocator<Pair>>
    void join(const BoxView<Dim, T>& boxes, std::vector<Pair, Allocator>& out, const Filters& filters = {})
    {
        join_into(boxes, out, filters);
    }
    /// Calls the visitor for the same pairs, box by box, until it returns false. Returns false if it stopped
    /// early. The objects that one box touches come in the order of visit(). Costs about one query for each
    /// box, and no memory. Several threads may call it at a time.
    template <FiltersOf<Filter> Filters = Filter>
    bool join(const BoxView<Dim, T>& boxes, JoinVisitor visitor, const Filters& filters = {}) const
    {
        return visit_joined(boxes, visitor, filters);
    }
    /// Calls the visitor for pairs no further apart than `max_distance`, the closest first, until it returns
    /// false. Returns false if it stopped early. Without `other`, pairs are of two of this structure's
    /// objects, each once, with a < b. With `other`, a is one of this structure's objects and b one of the
    /// other's, and neither structure may change meanwhile. If `other` is this structure, it finds its own
    /// pairs.
    /// The bound starts at the square of `max_distance`; the visitor lowers it as soon as it knows the
    /// distance of two shapes. Pairs at squared distance 0 come in the structure's own order, the others
    /// ascend by (at, a, b). Costs one search for those at 0, and one more each time the number of pairs
    /// visited has grown fourfold.
    bool closest_pairs(ClosestVisitor visitor, T max_distance = std::numeric_limits<T>::infinity()) const
    {
        return closest_pairs(structure(), visitor, max_distance);
    }
    bool closest_pairs(const Structure& other, ClosestVisitor visitor,
                       T max_distance = std::numeric_limits<T>::infinity()) const;
    /// Returns the first pair of closest_pairs.
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
    // If `first` or `nearest` finds nothing for a query, its element of `out` has the id Found::none; for
    // shapes it also has an infinite fraction or distance.

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

    // Deleted for queries with another dimension or number type than the structure's.
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
