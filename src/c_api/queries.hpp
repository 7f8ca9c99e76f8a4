// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "c_api/ask.hpp"
#include "c_api/results.hpp"
#include "c_api/shapes.hpp"
#include "c_api/working_memory.hpp"
#include "c_api/world.hpp"
#include "jostle/queries.hpp"
#include "jostle/shape_query.hpp"

// Queries to an index and to a world: one way for both.

namespace jostle::c_api {

// --- Queries ---

template <class Query>
inline constexpr jostle_query_kind kind_of = 0;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<Ray<Dim, T>> = JOSTLE_RAY;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<Sweep<Dim, T>> = JOSTLE_SWEEP;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<Aabb<Dim, T>> = JOSTLE_BOX;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<Sphere<Dim, T>> = JOSTLE_SPHERE;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<Frustum<Dim, T>> = JOSTLE_FRUSTUM;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<Nearest<Dim, T>> = JOSTLE_NEAREST;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<NearestToBox<Dim, T>> = JOSTLE_NEAREST_TO_BOX;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<ShapeSweep<Dim, T>> = JOSTLE_SHAPE_SWEEP;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<PosedShape<Dim, T>> = JOSTLE_POSED_SHAPE;
template <int Dim, Coordinate T>
inline constexpr jostle_query_kind kind_of<NearestToShape<Dim, T>> = JOSTLE_NEAREST_TO_SHAPE;

constexpr bool is_line(jostle_query_kind kind)
{
    return kind == JOSTLE_RAY || kind == JOSTLE_SWEEP || kind == JOSTLE_SHAPE_SWEEP;
}
constexpr bool is_nearest(jostle_query_kind kind)
{
    return kind == JOSTLE_NEAREST || kind == JOSTLE_NEAREST_TO_BOX || kind == JOSTLE_NEAREST_TO_SHAPE;
}
constexpr bool has_shape(jostle_query_kind kind)
{
    return kind >= JOSTLE_SHAPE_SWEEP && kind <= JOSTLE_NEAREST_TO_SHAPE;
}
/// Whether there is such a query of boxes, or of the shapes in them.
constexpr bool can_ask(jostle_query_kind kind, bool of_shapes)
{
    return of_shapes ? has_shape(kind) || kind == JOSTLE_RAY : !has_shape(kind);
}

enum class Verb
{
    any,
    count,
    first,
    all,
    visit
};
constexpr bool takes(Verb verb, jostle_query_kind kind, bool of_shapes)
{
    if (!can_ask(kind, of_shapes)) return false;
    if (verb == Verb::first) return is_line(kind) || is_nearest(kind);
    return verb == Verb::all || verb == Verb::visit || !is_nearest(kind);
}

[[noreturn]] inline void refuse_kind(Verb verb, jostle_query_kind kind, bool of_shapes)
{
    constexpr const char* names[] = {"JOSTLE_RAY",
                                     "JOSTLE_SWEEP",
                                     "JOSTLE_BOX",
                                     "JOSTLE_SPHERE",
                                     "JOSTLE_FRUSTUM",
                                     "JOSTLE_NEAREST",
                                     "JOSTLE_NEAREST_TO_BOX",
                                     "JOSTLE_SHAPE_SWEEP",
                                     "JOSTLE_POSED_SHAPE",
                                     "JOSTLE_NEAREST_TO_SHAPE"};
    std::string text;
    for (jostle_query_kind one = JOSTLE_RAY; one <= JOSTLE_NEAREST_TO_SHAPE; ++one)
        if (takes(verb, one, of_shapes))
            text += (text.empty() ? "" : ", ") + std::string(names[one - JOSTLE_RAY]);
    refuse("kind is " + std::to_string(kind) + "; this call takes " + text +
           (of_shapes ? " where objects are given" : " where objects is NULL"));
}

template <int Dim, Coordinate T>
constexpr bool laid_out_as_documented()
{
    constexpr std::size_t dim = Dim;
    return sizeof(Ray<Dim, T>) == (2 * dim + 1) * sizeof(T) &&
           sizeof(Sweep<Dim, T>) == (3 * dim + 1) * sizeof(T) &&
           sizeof(Aabb<Dim, T>) == 2 * dim * sizeof(T) && sizeof(Sphere<Dim, T>) == (dim + 1) * sizeof(T) &&
           sizeof(Plane<Dim, T>) == (dim + 1) * sizeof(T);
}
static_assert(laid_out_as_documented<2, float>() && laid_out_as_documented<3, float>() &&
              laid_out_as_documented<2, double>() && laid_out_as_documented<3, double>());

template <class Row>
StridedView<Row> view_of_rows(const jostle_values& values)
{
    check_rows(values, sizeof(Row), "queries", false);
    return view<Row>(values, "queries");
}

/// The queries that C gave, as C++'s. Those that lie in memory as they do in C++ are read in place; of the
/// others one needs no memory, more are copied into that of the call: a WorkingMemory, or one that is Lent.
template <class Query, class Memory>
class Asked
{
  public:
    /// `limit` is the most answers that are of use of each.
    Asked(const jostle_queries& given, std::uint64_t count, std::uint64_t limit, Memory& memory);
    Asked(const Asked&) = delete;
    Asked& operator=(const Asked&) = delete;

    [[nodiscard]] std::span<const Query> all() const { return all_; }

  private:
    template <class At>
    void copy(std::size_t count, At&& at)
    {
        if (count == 1) {
            one_ = at(std::size_t{0});
            all_ = {&one_, 1};
            return;
        }
        auto& many = memory_.template of<std::vector<Query>>();
        many.clear();
        many.reserve(count);
        for (std::size_t i = 0; i < count; ++i)
            many.push_back(at(i));
        all_ = many;
    }
    template <int Dim, Coordinate T>
    void read(const jostle_queries& given, std::size_t count, std::uint32_t nearest, const Nearest<Dim, T>*)
    {
        const auto rows = view_of_rows<std::array<T, Dim + 1>>(given.values);
        copy(count, [&](std::size_t i) {
            Query query{{}, nearest, rows[i].back()};
            std::copy_n(rows[i].begin(), Dim, query.point.begin());
            return query;
        });
    }
    template <int Dim, Coordinate T>
    void read(const jostle_queries& given, std::size_t count, std::uint32_t nearest,
              const NearestToBox<Dim, T>*)
    {
        const auto rows = view_of_rows<std::array<T, 2 * Dim + 1>>(given.values);
        copy(count, [&](std::size_t i) {
            Query query{{}, nearest, rows[i].back()};
            std::copy_n(rows[i].begin(), Dim, query.box.lo.begin());
            std::copy_n(rows[i].begin() + Dim, Dim, query.box.hi.begin());
            return query;
        });
    }
    template <int Dim, Coordinate T>
    void read(const jostle_queries& given, std::size_t count, std::uint32_t, const Frustum<Dim, T>*)
    {
        const auto rows = view_of_rows<jostle_frustum>(given.values);
        copy(count, [&](std::size_t i) {
            const jostle_frustum& one = rows[i];
            return Query{std::span(wanted_array_of<Plane<Dim, T>>(one.planes, one.count, "planes"),
                                   static_cast<std::size_t>(one.count))};
        });
    }
    template <int Dim, Coordinate T>
    void read(const jostle_queries& given, std::size_t count, std::uint32_t, const ShapeSweep<Dim, T>*)
    {
        const auto moving = shapes_of<Dim, T>(given, count, true);
        const auto ways = view_of_rows<Vec<Dim, T>>(given.values);
        copy(count, [&](std::size_t i) { return Query{moving.shapes[i], moving.poses[i], ways[i]}; });
    }
    template <int Dim, Coordinate T>
    void read(const jostle_queries& given, std::size_t count, std::uint32_t, const PosedShape<Dim, T>*)
    {
        const auto posed = shapes_of<Dim, T>(given, count, false);
        if (given.values.count != 0)
            refuse("queries of JOSTLE_POSED_SHAPE have a shape and no numbers: values.count is " +
                   std::to_string(given.values.count) + " and must be 0");
        copy(count, [&](std::size_t i) { return Query{posed.shapes[i], posed.poses[i]}; });
    }
    template <int Dim, Coordinate T>
    void read(const jostle_queries& given, std::size_t count, std::uint32_t nearest,
              const NearestToShape<Dim, T>*)
    {
        const auto posed = shapes_of<Dim, T>(given, count, given.values.count != 0);
        const auto most = view_of_rows<T>(given.values);
        copy(count, [&](std::size_t i) {
            return Query{posed.shapes[i], posed.poses[i], nearest,
                         most.empty() ? std::numeric_limits<T>::infinity() : most[i]};
        });
    }
    /// Rays, sweeps, boxes and spheres.
    template <class Plain>
    void read(const jostle_queries& given, std::size_t count, std::uint32_t, const Plain*)
    {
        const auto rows = view_of_rows<Query>(given.values);
        if (given.values.stride == sizeof(Query) || count <= 1)
            all_ = {static_cast<const Query*>(given.values.data), count};
        else
            copy(count, [&](std::size_t i) { return rows[i]; });
    }
    template <int Dim, Coordinate T>
    static Objects<Dim, T> shapes_of(const jostle_queries& given, std::size_t count, bool with_values)
    {
        const auto objects = objects_of<Objects, Dim, T>(given.shapes, "the queries' shapes");
        if (objects.shapes.size() != count || (with_values && given.values.count != count))
            refuse("the queries have " + std::to_string(objects.shapes.size()) + " shapes, " +
                       std::to_string(count) + " poses and " + std::to_string(given.values.count) +
                       " values: give one of each per query",
                   JOSTLE_SIZE_MISMATCH);
        return objects;
    }

    Memory& memory_;
    Query one_{};
    std::span<const Query> all_;
};
template <class Query, class Memory>
Asked<Query, Memory>::Asked(const jostle_queries& given, std::uint64_t count, std::uint64_t limit,
                            Memory& memory)
    : memory_(memory)
{
    if (!has_shape(kind_of<Query>) && given.shapes != nullptr) refuse("queries of this kind have no shapes");
    const std::uint64_t nearest = std::min<std::uint64_t>(given.nearest == 0 ? 1 : given.nearest, limit);
    read(given, static_cast<std::size_t>(count), static_cast<std::uint32_t>(nearest),
         static_cast<const Query*>(nullptr));
}

inline std::uint64_t count_of(const jostle_queries* queries)
{
    const jostle_queries& given = wanted(queries, "queries");
    if (!has_shape(given.kind)) return given.values.count;
    return wanted(given.shapes, "the queries' shapes").poses.count;
}

/// inside(queries) with the caller's as a span of what they are, if they are such that `verb` takes.
template <Verb verb, bool of_shapes, int Dim, Coordinate T, class Memory, class F>
void with_queries(const jostle_queries* queries, std::uint64_t limit, Memory& memory, F&& inside)
{
    const jostle_queries& given = wanted(queries, "queries");
    const auto as = [&]<class Query>(const Query*) {
        if constexpr (takes(verb, kind_of<Query>, of_shapes)) {
            const std::uint64_t count = count_of(queries);
            if (count > UINT32_MAX) refuse("more than 2^32 - 1 queries", JOSTLE_TOO_MANY_OBJECTS);
            const Asked<Query, Memory> asked(given, count, limit, memory);
            inside(asked.all());
        } else {
            refuse_kind(verb, given.kind, of_shapes);
        }
    };
    switch (given.kind) {
    case JOSTLE_RAY:
        return as(static_cast<const Ray<Dim, T>*>(nullptr));
    case JOSTLE_SWEEP:
        return as(static_cast<const Sweep<Dim, T>*>(nullptr));
    case JOSTLE_BOX:
        return as(static_cast<const Aabb<Dim, T>*>(nullptr));
    case JOSTLE_SPHERE:
        return as(static_cast<const Sphere<Dim, T>*>(nullptr));
    case JOSTLE_FRUSTUM:
        return as(static_cast<const Frustum<Dim, T>*>(nullptr));
    case JOSTLE_NEAREST:
        return as(static_cast<const Nearest<Dim, T>*>(nullptr));
    case JOSTLE_NEAREST_TO_BOX:
        return as(static_cast<const NearestToBox<Dim, T>*>(nullptr));
    case JOSTLE_SHAPE_SWEEP:
        return as(static_cast<const ShapeSweep<Dim, T>*>(nullptr));
    case JOSTLE_POSED_SHAPE:
        return as(static_cast<const PosedShape<Dim, T>*>(nullptr));
    case JOSTLE_NEAREST_TO_SHAPE:
        return as(static_cast<const NearestToShape<Dim, T>*>(nullptr));
    default:
        refuse_kind(verb, given.kind, of_shapes);
    }
}

// --- Which objects ---

/// inside(filters) with one for all queries, or one for each. `Wish` makes a Filter of the caller's, which
/// refers to it.
template <class Wish, class Memory, class F>
void with_filter(const jostle_query_filter* filter, std::uint64_t queries, Memory& memory, F&& inside)
{
    using Filter = typename Wish::Filter;
    const std::uint64_t count = read_options(filter, "jostle_query_filter").count;
    if (count <= 1) {
        const Wish wish(filter);
        return inside(detail::QueryFilters<Filter>(wish.filter));
    }
    if (count != queries)
        refuse("there are " + std::to_string(queries) + " queries and " + std::to_string(count) +
                   " filters: give none, one, or one for each",
               JOSTLE_SIZE_MISMATCH);
    using Wishes = std::vector<std::optional<Wish>>; // which stay where they are
    auto& wishes = memory.template of<Wishes>();
    if (wishes.size() < count) wishes = Wishes(static_cast<std::size_t>(count));
    auto& filters = memory.template of<std::vector<Filter>>();
    filters.clear();
    for (std::size_t i = 0; i < count; ++i)
        filters.push_back(wishes[i].emplace(options_number(filter, i, "jostle_query_filter")).filter);
    inside(detail::QueryFilters<Filter>(filters));
}

// --- Answers ---

/// An id of an index; a world's is in world.hpp.
inline std::uint64_t to_c(std::uint32_t id) noexcept
{
    return id == Hit<float>::none ? UINT64_MAX : id;
}

/// How an answer lies in C: its id, where it is, and what else is known of it.
template <class T, class Id>
double at_of(const Hit<T, Id>& hit) noexcept
{
    return hit.at;
}
template <int Dim, class T, class Id>
double at_of(const ShapeHit<Dim, T, Id>& hit) noexcept
{
    return hit.fraction;
}
template <int Dim, class T, class Id>
double at_of(const ShapeDistance<Dim, T, Id>& found) noexcept
{
    return found.distance;
}
template <int Dim, class T, class Id>
const CastHit<Dim, T>& details_of(const ShapeHit<Dim, T, Id>& hit) noexcept
{
    return hit;
}
template <int Dim, class T, class Id>
const Distance<Dim, T>& details_of(const ShapeDistance<Dim, T, Id>& found) noexcept
{
    return found;
}
template <class Item>
concept Detailed = requires(const Item& item) { details_of(item); };
template <class Item>
concept Placed = requires(const Item& item) { at_of(item); };

/// What a query finds.
template <class Structure, class Query, bool of_shapes>
struct AnswerTo
{
    using type = typename Structure::template Answer<Query>;
};
template <class Structure, class Query>
struct AnswerTo<Structure, Query, true>
{
    using type = typename Structure::template ShapeAnswer<Query>;
};

/// What stands where a query finds nothing: as in a batch.
template <class T, class Id>
void become_nothing(Hit<T, Id>&) noexcept
{
}
template <int Dim, class T, class Id>
void become_nothing(ShapeHit<Dim, T, Id>& hit) noexcept
{
    hit.fraction = std::numeric_limits<T>::infinity();
}
template <int Dim, class T, class Id>
void become_nothing(ShapeDistance<Dim, T, Id>& found) noexcept
{
    found.distance = std::numeric_limits<T>::infinity();
}

/// A hit as C sees it, and its details at their place.
template <class Item>
jostle_hit hit_to_c(const Item& item, void* details, std::size_t i)
{
    if constexpr (Detailed<Item>) {
        if (details != nullptr) {
            const auto& one = details_of(item);
            std::memcpy(static_cast<unsigned char*>(details) + i * sizeof one, &one, sizeof one);
        }
    }
    return {to_c(item.id), at_of(item)};
}
/// Widens hits that lie at the beginning of `hits` to what the caller is given, in place: the last first,
/// since none is bigger than a jostle_hit.
template <class Found>
void widen(jostle_hit* hits, std::size_t count)
{
    static_assert(sizeof(Found) <= sizeof(jostle_hit) && alignof(Found) <= alignof(jostle_hit));
    const auto* const bytes = reinterpret_cast<const unsigned char*>(hits);
    for (std::size_t i = count; i-- > 0;) {
        Found found;
        std::memcpy(static_cast<void*>(&found), bytes + i * sizeof found, sizeof found);
        hits[i] = hit_to_c(found, nullptr, i);
    }
}
/// One list of answers.
template <class Item>
void append(ResultsContent& results, std::span<const Item> items, bool more)
{
    Lists& lists = results.lists;
    for (const Item& item : items) {
        if constexpr (Placed<Item>) {
            lists.ids.push_back(to_c(item.id));
            lists.at.push_back(at_of(item));
        } else {
            lists.ids.push_back(to_c(item));
        }
        if constexpr (Detailed<Item>) {
            const auto* const bytes = reinterpret_cast<const std::byte*>(&details_of(item));
            results.bytes.insert(results.bytes.end(), bytes, bytes + sizeof details_of(item));
        }
    }
    lists.more.push_back(more ? 1 : 0);
    lists.first.push_back(lists.ids.size());
}
/// Makes the lists the result. Their details, if there are, are its blocks.
template <class Item>
void show_lists(ResultsContent& results)
{
    results.lists.has_at = Placed<Item>;
    if constexpr (Detailed<Item>) {
        using Details = std::remove_cvref_t<decltype(details_of(std::declval<const Item&>()))>;
        results.show(
            std::span(reinterpret_cast<const Details*>(results.bytes.data()), results.lists.ids.size()));
        results.holds = ResultsContent::Holds::lists_and_blocks;
    } else {
        results.holds = ResultsContent::Holds::lists;
    }
}

/// A bound that C has set, rounded up where it is no number of the type.
template <class T>
T bound_from(double given) noexcept
{
    const T bound = static_cast<T>(given);
    return static_cast<double>(bound) < given ? std::nextafter(bound, std::numeric_limits<T>::infinity())
                                              : bound;
}
/// call(shown) calls the caller's function, which may make the bound that it is shown less.
template <class T, class Call>
bool with_bound(T& bound, const Call& call)
{
    double shown = bound;
    const bool goes_on = agreed(call(&shown));
    if (!(shown >= bound)) bound = bound_from<T>(shown);
    return goes_on;
}

// --- The verbs ---

/// What with_filter is to make of the caller's filter.
template <class Content>
struct WishTo;

// A library without contacts, such as the Rust crate's without that feature, has boxes alone to ask about.
#ifdef JOSTLE_WITHOUT_CONTACTS
inline constexpr bool has_contacts = false;
#else
inline constexpr bool has_contacts = true;
#endif

/// inside(structure, queries, filter, shapes...) with everything in its type, and no shapes where boxes are
/// asked about.
template <class Wish, Verb verb, class Content, class Memory, class F>
void ask(const Content& content, const jostle_queries* queries, const jostle_objects* objects,
         const jostle_query_filter* filter, std::uint64_t limit, Memory& memory, F&& inside)
{
    with_filter<Wish>(filter, count_of(queries), memory, [&](const auto& wish) {
        content.on([&]<class Structure>(const Structure& structure) {
            constexpr int dim = Structure::dim;
            using T = typename Structure::Number;
            if (objects == nullptr)
                return with_queries<verb, false, dim, T>(queries, limit, memory,
                                                         [&](auto asked) { inside(structure, asked, wish); });
            if constexpr (has_contacts) {
                const typename Structure::Shapes shapes(objects_of<Objects, dim, T>(objects, "objects"));
                with_queries<verb, true, dim, T>(queries, limit, memory,
                                                 [&](auto asked) { inside(structure, asked, wish, shapes); });
            } else {
                refuse("this library was built without contacts: objects must be NULL");
            }
        });
    });
}

template <class Content>
void Ask<Content>::any(std::uint8_t* out) const
{
    WorkingMemories::Lent memory(content.memories);
    ask<typename WishTo<Content>::type, Verb::any>(
        content, queries, objects, filter, 0, memory,
        [&](const auto& structure, auto asked, const auto& wish, const auto&... shapes) {
            std::uint8_t* const any = wanted_array(out, asked.size(), "any");
            if (asked.size() == 1)
                any[0] = structure.any(asked.front(), shapes..., wish[0]) ? 1 : 0;
            else if (!asked.empty())
                structure.any(asked, shapes..., std::span(any, asked.size()), wish);
        });
}
template <class Content>
void Ask<Content>::count(std::uint64_t* out) const
{
    WorkingMemories::Lent memory(content.memories);
    ask<typename WishTo<Content>::type, Verb::count>(
        content, queries, objects, filter, 0, memory,
        [&](const auto& structure, auto asked, const auto& wish, const auto&... shapes) {
            std::uint64_t* const counts = wanted_array(out, asked.size(), "counts");
            if (asked.size() == 1)
                counts[0] = structure.count(asked.front(), shapes..., wish[0]);
            else if (!asked.empty())
                structure.count(asked, shapes..., std::span(counts, asked.size()), wish);
        });
}
template <class Content>
void Ask<Content>::first(jostle_hit* out, void* details) const
{
    WorkingMemories::Lent memory(content.memories);
    ask<typename WishTo<Content>::type, Verb::first>(
        content, queries, objects, filter, 1, memory,
        [&]<class Structure, class Query>(const Structure& structure, std::span<const Query> asked,
                                          const auto& wish, const auto&... shapes) {
            constexpr bool nearest = is_nearest(kind_of<Query>);
            using T = typename Structure::Number;
            using Found = std::conditional_t<sizeof...(shapes) == 0, typename Structure::Found,
                                             std::conditional_t<nearest, typename Structure::FoundDistance,
                                                                typename Structure::FoundShape>>;
            if constexpr (Detailed<Found>)
                if (details != nullptr) wanted_array_of<T>(details, asked.size(), "details");
            jostle_hit* const hits = wanted_array(out, asked.size(), "hits");
            if (asked.size() == 1) {
                std::optional<Found> found;
                if constexpr (nearest)
                    found = structure.nearest(asked.front(), shapes..., wish[0]);
                else
                    found = structure.first(asked.front(), shapes..., wish[0]);
                if (!found) become_nothing(found.emplace());
                hits[0] = hit_to_c(*found, details, 0);
                return;
            }
            const auto ask_batch = [&](std::span<Found> found) {
                if constexpr (nearest)
                    structure.nearest(asked, shapes..., found, wish);
                else
                    structure.first(asked, shapes..., found, wish);
            };
            if constexpr (Detailed<Found>) {
                auto& found = memory.of<std::vector<Found>>();
                found.resize(asked.size());
                ask_batch(found);
                for (std::size_t i = 0; i < found.size(); ++i)
                    hits[i] = hit_to_c(found[i], details, i);
            } else { // without memory of its own: in the caller's, which has room for more
                auto* const narrow = reinterpret_cast<Found*>(hits);
                std::uninitialized_default_construct_n(narrow, asked.size());
                ask_batch({narrow, asked.size()});
                widen<Found>(hits, asked.size());
            }
        });
}
template <class Content>
void Ask<Content>::all(std::uint64_t max_results, ResultsContent& results) const
{
    results.begin();
    ask<typename WishTo<Content>::type, Verb::all>(
        content, queries, objects, filter, max_results, results.memory,
        [&]<class Structure, class Query>(const Structure& structure, std::span<const Query> asked,
                                          const auto& wish, const auto&... shapes) {
            using Item = typename AnswerTo<Structure, Query, sizeof...(shapes) != 0>::type;
            results.lists.start();
            results.bytes.clear();
            if (asked.size() == 1) {
                auto& found = results.memory.template of<std::vector<Item>>();
                bool more = false;
                if constexpr (is_nearest(kind_of<Query>))
                    structure.nearest(asked.front(), shapes..., found, wish[0]);
                else
                    more = structure.all(asked.front(), shapes..., found, wish[0], max_results);
                append(results, std::span<const Item>(found), more);
            } else {
                auto& found = results.memory.template of<ResultLists<Item>>(results.kept.resource());
                if constexpr (is_nearest(kind_of<Query>))
                    structure.nearest(asked, shapes..., found, wish);
                else
                    structure.all(asked, shapes..., found, wish, max_results);
                results.lists.ids.reserve(found.items().size());
                for (std::size_t i = 0; i < found.size(); ++i)
                    append(results, found[i], found.more(i));
            }
            show_lists<Item>(results);
        });
}
template <class Content>
bool Ask<Content>::visit(jostle_visit_answer_function take, void* context) const
{
    if (count_of(queries) != 1)
        refuse("there are " + std::to_string(count_of(queries)) + " queries: a visit takes one",
               JOSTLE_SIZE_MISMATCH);
    bool finished = true;
    WorkingMemories::Lent memory(content.memories); // one query wants none
    ask<typename WishTo<Content>::type, Verb::visit>(
        content, queries, objects, filter, UINT32_MAX, memory,
        [&]<class Structure, class Query>(const Structure& structure, std::span<const Query> asked,
                                          const auto& wish, const auto&... shapes) {
            using Item = typename AnswerTo<Structure, Query, sizeof...(shapes) != 0>::type;
            if constexpr (Placed<Item>) {
                const auto hand_over = [&](const Item& item, typename Structure::Number& bound) {
                    const void* details = nullptr;
                    if constexpr (Detailed<Item>) details = &details_of(item);
                    return with_bound(bound, [&](double* shown) {
                        return take(context, to_c(item.id), at_of(item), details, shown);
                    });
                };
                finished = structure.visit(asked.front(), shapes..., hand_over, wish[0]);
            } else {
                const auto hand_over = [&](const Item& id) {
                    return agreed(take(context, to_c(id), 0, nullptr, nullptr));
                };
                finished = structure.visit(asked.front(), shapes..., hand_over, wish[0]);
            }
        });
    return finished;
}

template <class Content>
bool visit_closest(const Content& content, const Content& other, double max_distance,
                   jostle_visit_close_pair_function visit, void* context)
{
    if (content.space != other.space) refuse("the two are of different spaces");
    bool finished = true;
    content.on([&]<class Structure>(const Structure& structure) {
        other.on([&]<class Other>(const Other& others) {
            if constexpr (std::same_as<Structure, Other>) {
                using T = typename Structure::Number;
                finished = structure.closest_pairs(
                    others,
                    [&](const auto& hit, T& bound) {
                        return with_bound(bound, [&](double* shown) {
                            return visit(context, to_c(hit.a), to_c(hit.b), hit.at, shown);
                        });
                    },
                    static_cast<T>(max_distance));
            }
        });
    });
    return finished;
}
template <class Content>
void join_boxes(Content& content, const jostle_boxes* boxes, const jostle_query_filter* filter,
                ResultsContent& results)
{
    if (read_options(filter, "jostle_query_filter").count > 1)
        refuse("a join takes one filter for all boxes");
    const typename WishTo<Content>::type wish(filter);
    content.on([&]<class Structure>(Structure& structure) {
        const auto all = view<Structure::dim, typename Structure::Number>(boxes, "boxes");
        results.begin();
        structure.join(all, results.joined, wish.filter);
        results.show(std::span<const Pair>(results.joined));
    });
}

} // namespace jostle::c_api
