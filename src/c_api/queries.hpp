// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <deque>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "c_api/results.hpp"
#include "jostle/queries.hpp"

// Queries to an index and to a world: one way for both.

namespace jostle::c_api {

template <class Query>
inline constexpr bool is_line = false;
template <int Dim, Coordinate T>
inline constexpr bool is_line<Ray<Dim, T>> = true;
template <int Dim, Coordinate T>
inline constexpr bool is_line<Sweep<Dim, T>> = true;

template <class Query>
inline constexpr bool is_nearest = false;
template <int Dim, Coordinate T>
inline constexpr bool is_nearest<Nearest<Dim, T>> = true;
template <int Dim, Coordinate T>
inline constexpr bool is_nearest<NearestToBox<Dim, T>> = true;

// Which kinds a call takes, as bits.
inline constexpr unsigned lines = 1U << JOSTLE_RAY | 1U << JOSTLE_SWEEP;
inline constexpr unsigned regions = 1U << JOSTLE_BOX | 1U << JOSTLE_SPHERE | 1U << JOSTLE_FRUSTUM;
inline constexpr unsigned any_kind = lines | regions | 1U << JOSTLE_NEAREST | 1U << JOSTLE_NEAREST_TO_BOX;

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
template <class InCpp, class InC>
constexpr bool laid_out_as_in_c()
{
    return sizeof(InCpp) == sizeof(InC) && offsetof(InCpp, count) == offsetof(InC, count) &&
           offsetof(InCpp, max_distance) == offsetof(InC, max_distance);
}
static_assert(laid_out_as_in_c<Nearest<2, float>, jostle_nearest_2f>() &&
              laid_out_as_in_c<Nearest<3, float>, jostle_nearest_3f>() &&
              laid_out_as_in_c<Nearest<2, double>, jostle_nearest_2d>() &&
              laid_out_as_in_c<Nearest<3, double>, jostle_nearest_3d>() &&
              laid_out_as_in_c<NearestToBox<2, float>, jostle_nearest_to_box_2f>() &&
              laid_out_as_in_c<NearestToBox<3, float>, jostle_nearest_to_box_3f>() &&
              laid_out_as_in_c<NearestToBox<2, double>, jostle_nearest_to_box_2d>() &&
              laid_out_as_in_c<NearestToBox<3, double>, jostle_nearest_to_box_3d>());

/// "JOSTLE_RAY, JOSTLE_SWEEP", for messages.
inline std::string names_of(unsigned kinds)
{
    constexpr const char* names[] = {"JOSTLE_RAY",           "JOSTLE_SWEEP",   "JOSTLE_BOX",
                                     "JOSTLE_SPHERE",        "JOSTLE_FRUSTUM", "JOSTLE_NEAREST",
                                     "JOSTLE_NEAREST_TO_BOX"};
    std::string text;
    for (jostle_question kind = JOSTLE_RAY; kind <= JOSTLE_NEAREST_TO_BOX; ++kind)
        if ((kinds >> kind & 1U) != 0)
            text += (text.empty() ? "" : ", ") + std::string(names[kind - JOSTLE_RAY]);
    return text;
}

/// The caller's queries as a span of what they are. `kinds` are those that the call takes. Instantiates
/// `inside` for all of them: where it can't take one, it must say so with `if constexpr`.
template <int Dim, Coordinate T, class F>
void with_questions(jostle_question kind, const void* queries, std::uint64_t count, unsigned kinds,
                    F&& inside)
{
    if (kind < JOSTLE_RAY || kind > JOSTLE_NEAREST_TO_BOX || (kinds >> kind & 1U) == 0)
        refuse("kind is " + std::to_string(kind) + "; this call takes " + names_of(kinds));
    if (count > UINT32_MAX) refuse("more than 2^32 - 1 queries", JOSTLE_TOO_MANY_OBJECTS);
    const auto size = static_cast<std::size_t>(count);
    const auto ask = [&](auto* typed) { inside(std::span(wanted_array(typed, count, "queries"), size)); };
    switch (kind) {
    case JOSTLE_RAY:
        return ask(static_cast<const Ray<Dim, T>*>(queries));
    case JOSTLE_SWEEP:
        return ask(static_cast<const Sweep<Dim, T>*>(queries));
    case JOSTLE_BOX:
        return ask(static_cast<const Aabb<Dim, T>*>(queries));
    case JOSTLE_SPHERE:
        return ask(static_cast<const Sphere<Dim, T>*>(queries));
    case JOSTLE_NEAREST:
        return ask(static_cast<const Nearest<Dim, T>*>(queries));
    case JOSTLE_NEAREST_TO_BOX:
        return ask(static_cast<const NearestToBox<Dim, T>*>(queries));
    default:
        break;
    }
    // Frusta are spans in C++. A few need no memory.
    const auto* const given = wanted_array_of<jostle_frustum>(queries, count, "queries");
    const auto frustum_of = [](const jostle_frustum& frustum) {
        return Frustum<Dim, T>{
            std::span(wanted_array_of<Plane<Dim, T>>(frustum.planes, frustum.count, "planes"),
                      static_cast<std::size_t>(frustum.count))};
    };
    if (count == 1) {
        const Frustum<Dim, T> one = frustum_of(given[0]);
        return inside(std::span(&one, 1));
    }
    std::vector<Frustum<Dim, T>> many;
    many.reserve(size);
    for (std::size_t i = 0; i < size; ++i)
        many.push_back(frustum_of(given[i]));
    inside(std::span<const Frustum<Dim, T>>(many));
}

/// The caller's filters as C++'s. `Wish` is IndexFilter or WorldFilter, which `Filter` refers to.
template <class Wish, class Filter>
class Filters
{
  public:
    Filters(const jostle_query_filter* filters, std::uint64_t count, std::uint64_t queries)
    {
        if (count > 1 && count != queries)
            refuse("there are " + std::to_string(queries) + " queries and " + std::to_string(count) +
                       " filters: give none, one, or one for each",
                   JOSTLE_SIZE_MISMATCH);
        if (count == 0) return;
        const auto* const bytes = reinterpret_cast<const unsigned char*>(wanted_array(filters, 1, "filters"));
        const std::uint64_t size = filters->struct_size;
        if (size % alignof(jostle_query_filter) != 0)
            refuse("jostle_query_filter::struct_size is " + std::to_string(size) +
                   ": set it to sizeof(jostle_query_filter)");
        for (std::uint64_t i = 0; i < count; ++i) {
            wishes_.emplace_back(reinterpret_cast<const jostle_query_filter*>(bytes + i * size));
            filters_.push_back(wishes_.back().filter);
        }
    }
    [[nodiscard]] std::span<const Filter> all() const { return filters_; }

  private:
    std::deque<Wish> wishes_; // which stay where they are
    std::vector<Filter> filters_;
};

/// inside(filter) with a Filter for all queries, or a span with one for each. Wish, Filter: as in Filters.
template <class Wish, class Filter, class F>
void with_filter(const jostle_query_filter* filter, std::uint64_t queries, F&& inside)
{
    const std::uint64_t count = read_options(filter, "jostle_query_filter").count;
    if (count > 1) {
        const Filters<Wish, Filter> wishes(filter, count, queries);
        inside(wishes.all());
    } else {
        const Wish wish(filter);
        inside(std::as_const(wish.filter));
    }
}
/// That of a single query.
template <class Filter>
const Filter& only(const Filter& filter)
{
    return filter;
}
template <class Filter>
const Filter& only(std::span<const Filter> filters)
{
    return filters[0];
}

inline std::uint64_t plain_id(std::uint32_t id) noexcept
{
    return id;
}

/// Widens `count` answers that lie at the beginning of `hits` to what the caller is given, in place: the last
/// first, since none of them is bigger than a jostle_hit.
template <class Hit, class IdOf>
void widen(jostle_hit* hits, std::uint64_t count, IdOf id_of)
{
    static_assert(sizeof(Hit) <= sizeof(jostle_hit) && alignof(Hit) <= alignof(jostle_hit));
    const auto* const bytes = reinterpret_cast<const unsigned char*>(hits);
    for (std::uint64_t i = count; i-- > 0;) {
        Hit hit;
        std::memcpy(static_cast<void*>(&hit), bytes + i * sizeof(Hit), sizeof hit);
        hits[i] = {id_of(hit.id), hit.at};
    }
}

/// One answer of a list, as C sees it.
template <class Item, class IdOf>
void append(Lists& lists, std::span<const Item> items, bool more, IdOf id_of)
{
    for (const Item& item : items)
        if constexpr (requires { item.at; }) {
            lists.ids.push_back(id_of(item.id));
            lists.at.push_back(item.at);
        } else {
            lists.ids.push_back(id_of(item));
        }
    lists.more.push_back(more ? 1 : 0);
    lists.first.push_back(lists.ids.size());
}
inline void start(Lists& lists, bool has_at)
{
    lists.first.assign(1, 0);
    lists.ids.clear();
    lists.at.clear();
    lists.more.clear();
    lists.has_at = has_at;
}

/// Asks `asked` (a BoxIndex or a World) for the first hits.
template <class Hit, class Asked, class Line, class Filter, class IdOf>
void ask_first(const Asked& asked, std::span<const Line> queries, const Filter& filter, jostle_hit* out,
               IdOf id_of)
{
    jostle_hit* const hits = wanted_array(out, queries.size(), "hits");
    if (queries.empty()) return;
    if (queries.size() == 1) {
        const auto hit = asked.first(queries.front(), only(filter));
        const Hit found = hit ? *hit : Hit{};
        hits[0] = {id_of(found.id), found.at};
        return;
    }
    auto* const narrow = reinterpret_cast<Hit*>(hits);
    std::uninitialized_default_construct_n(narrow, queries.size());
    asked.first(queries, std::span(narrow, queries.size()), filter);
    widen<Hit>(hits, queries.size(), id_of);
}

template <class Hit, class Id, class Asked, class Query, class Filter, class IdOf>
void ask_all(const Asked& asked, std::span<const Query> queries, const Filter& filter,
             std::uint64_t max_results, ResultsContent& results, IdOf id_of)
{
    using Item = std::conditional_t<is_line<Query> || is_nearest<Query>, Hit, Id>;
    if (is_nearest<Query> && max_results != UINT64_MAX)
        refuse("max_results must be UINT64_MAX: each query says itself how many it wants");
    results.begin();
    start(results.lists, !std::same_as<Item, Id>);
    if (queries.size() == 1) {
        std::vector<Item> found;
        bool more = false;
        if constexpr (is_nearest<Query>)
            asked.nearest(queries.front(), found, only(filter));
        else
            more = asked.all(queries.front(), found, only(filter), max_results);
        append(results.lists, std::span<const Item>(found), more, id_of);
    } else {
        ResultLists<Item> found(results.kept.resource());
        if constexpr (is_nearest<Query>)
            asked.nearest(queries, found, filter);
        else
            asked.all(queries, found, filter, max_results);
        results.lists.ids.reserve(found.items().size());
        if (!std::same_as<Item, Id>) results.lists.at.reserve(found.items().size());
        results.lists.first.reserve(found.size() + 1);
        results.lists.more.reserve(found.size());
        for (std::size_t i = 0; i < found.size(); ++i)
            append(results.lists, found[i], found.more(i), id_of);
    }
    results.holds = ResultsContent::Holds::lists;
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

/// Hands the answers to one query to the caller's function. Whether it never said stop.
template <Coordinate T, class Asked, class Query, class Filter, class IdOf>
bool ask_visit(const Asked& asked, const Query& query, const Filter& filter,
               jostle_visit_answer_function visit, void* context, IdOf id_of)
{
    if constexpr (is_line<Query> || is_nearest<Query>) {
        return asked.visit(
            query,
            [&](const auto& hit, T& bound) {
                return with_bound(
                    bound, [&](double* shown) { return visit(context, id_of(hit.id), hit.at, shown); });
            },
            only(filter));
    } else {
        return asked.visit(
            query, [&](const auto& id) { return agreed(visit(context, id_of(id), 0, nullptr)); },
            only(filter));
    }
}

/// Hands the closest pairs to the caller's function. Whether it never said stop.
template <Coordinate T, class Asked, class IdOf>
bool ask_closest(const Asked& asked, const Asked& other, double max_distance,
                 jostle_visit_close_pair_function visit, void* context, IdOf id_of)
{
    return asked.closest_pairs(
        other,
        [&](const auto& hit, T& bound) {
            return with_bound(bound, [&](double* shown) {
                return visit(context, id_of(hit.a), id_of(hit.b), hit.at, shown);
            });
        },
        static_cast<T>(max_distance));
}

template <class Asked, class Query, class Filter>
void ask_any(const Asked& asked, std::span<const Query> queries, const Filter& filter, std::uint8_t* out)
{
    std::uint8_t* const any = wanted_array(out, queries.size(), "any");
    if constexpr (!is_nearest<Query>) {
        if (queries.size() == 1)
            any[0] = asked.any(queries.front(), only(filter)) ? 1 : 0;
        else if (!queries.empty())
            asked.any(queries, std::span(any, queries.size()), filter);
    }
}
template <class Asked, class Query, class Filter>
void ask_count(const Asked& asked, std::span<const Query> queries, const Filter& filter, std::uint64_t* out)
{
    std::uint64_t* const counts = wanted_array(out, queries.size(), "counts");
    if constexpr (!is_nearest<Query>) {
        if (queries.size() == 1)
            counts[0] = asked.count(queries.front(), only(filter));
        else if (!queries.empty())
            asked.count(queries, std::span(counts, queries.size()), filter);
    }
}

} // namespace jostle::c_api
