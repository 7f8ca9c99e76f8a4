// SPDX-License-Identifier: MIT
// The verbs of Queries about boxes, once for a BoxIndex and a World. The Implementation of each provides:
//
//   Asking(implementation, filter, visits)    one query
//     .answers()                              who searches
//     .with(number, body)                     calls body(wanted), which says what counts by the filter
//     .given(found)                           what users get for what is found
//     .list<Item>(out, find)                  refills a vector by find(wanted, items)
//   AskingMany(implementation, filters, n)    a batch of n queries
//     .each(body)                             calls body(asking, i, wanted) for each, on the executor
//     .lists<Item>(out, find)                 refills lists by find(asking, i, wanted, items)
//   join(boxes, out, filters), visit_joined(boxes, visitor, filters), closest_pairs(other, visitor, distance)
#pragma once

#include "index/queries/answers.hpp"
#include "index/queries/check.hpp"
#include "jostle/queries.hpp"

JOSTLE_NAMESPACE_BEGIN

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <LineOrRegionOf<Dim, T> Query>
bool Queries<Structure, Dim, T, Id, Filter>::any(const Query& query, const Filter& filter) const
{
    const auto& me = *structure().implementation_;
    index::check(query, Error::no_index);
    const typename Structure::Implementation::Asking asking(me, filter);
    return asking.with(0, [&](index::Wanted wanted) { return asking.answers().any(query, wanted); });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <LineOrRegionOf<Dim, T> Query>
std::uint64_t Queries<Structure, Dim, T, Id, Filter>::count(const Query& query, const Filter& filter) const
{
    const auto& me = *structure().implementation_;
    index::check(query, Error::no_index);
    const typename Structure::Implementation::Asking asking(me, filter);
    return asking.with(0, [&](index::Wanted wanted) { return asking.answers().count(query, wanted); });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <LineOf<Dim, T> Query>
auto Queries<Structure, Dim, T, Id, Filter>::first(const Query& query, const Filter& filter) const
    -> std::optional<Found>
{
    const auto& me = *structure().implementation_;
    index::check(query, Error::no_index);
    const typename Structure::Implementation::Asking asking(me, filter);
    const Hit<T> hit =
        asking.with(0, [&](index::Wanted wanted) { return asking.answers().first(query, wanted); });
    return hit.id == Hit<T>::none ? std::nullopt : std::optional<Found>(asking.given(hit));
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <NearestOf<Dim, T> Query>
auto Queries<Structure, Dim, T, Id, Filter>::nearest(const Query& query, const Filter& filter) const
    -> std::optional<Found>
{
    const auto& me = *structure().implementation_;
    index::check(query, Error::no_index);
    const typename Structure::Implementation::Asking asking(me, filter);
    const Hit<T> hit =
        asking.with(0, [&](index::Wanted wanted) { return asking.answers().nearest(query, wanted); });
    return hit.id == Hit<T>::none ? std::nullopt : std::optional<Found>(asking.given(hit));
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <NearestOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::nearest(const Query& query, std::vector<Found>& out,
                                                     const Filter& filter) const
{
    out.clear();
    const auto& me = *structure().implementation_;
    index::check(query, Error::no_index);
    const typename Structure::Implementation::Asking asking(me, filter);
    asking.template list<Hit<T>>(out, [&](index::Wanted wanted, auto& items) {
        asking.answers().nearest(query, wanted, items);
        return false;
    });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <LineOrRegionOf<Dim, T> Query>
bool Queries<Structure, Dim, T, Id, Filter>::all(const Query& query, std::vector<Answer<Query>>& out,
                                                 const Filter& filter, std::uint64_t max_results) const
{
    out.clear();
    const auto& me = *structure().implementation_;
    index::check(query, Error::no_index);
    const typename Structure::Implementation::Asking asking(me, filter);
    return asking.template list<typename index::ItemOf<Query>::Item>(
        out, [&](index::Wanted wanted, auto& items) {
            return asking.answers().all(query, wanted, max_results, items);
        });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <QueryOf<Dim, T> Query>
bool Queries<Structure, Dim, T, Id, Filter>::visit(const Query& query, Visitor<Answer<Query>> visitor,
                                                   const Filter& filter) const
{
    constexpr bool has_order = !RegionOf<Query, Dim, T>;
    const auto& me = *structure().implementation_;
    index::check(query, Error::no_index);
    const typename Structure::Implementation::Asking asking(
        me, filter, has_order ? index::Visits::in_order : index::Visits::in_own_order);
    return asking.with(0, [&](index::Wanted wanted) {
        if constexpr (has_order)
            return asking.answers().visit_in_order(query, wanted, [&](const Hit<T>& hit, T& bound) {
                return visitor(asking.given(hit), bound);
            });
        else
            return asking.answers().visit(query, wanted,
                                          [&](std::uint32_t id) { return visitor(asking.given(id)); });
    });
}

// --- Batches ---

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <LineOrRegionOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::any_of_each(std::span<const Query> queries, BoolSpan out,
                                                         const Filters& filters) const
{
    const auto& me = *structure().implementation_;
    index::check_room(queries.size(), out.size());
    index::check_all(queries);
    const typename Structure::Implementation::AskingMany asking(me, filters, queries.size());
    asking.each([&](const auto& one, std::size_t i, index::Wanted wanted) {
        out[i] = one.answers().any(queries[i], wanted);
    });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <LineOrRegionOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::count_of_each(std::span<const Query> queries,
                                                           std::span<std::uint64_t> out,
                                                           const Filters& filters) const
{
    const auto& me = *structure().implementation_;
    index::check_room(queries.size(), out.size());
    index::check_all(queries);
    const typename Structure::Implementation::AskingMany asking(me, filters, queries.size());
    asking.each([&](const auto& one, std::size_t i, index::Wanted wanted) {
        out[i] = one.answers().count(queries[i], wanted);
    });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <LineOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::first_of_each(std::span<const Query> queries,
                                                           std::span<Found> out, const Filters& filters) const
{
    const auto& me = *structure().implementation_;
    index::check_room(queries.size(), out.size());
    index::check_all(queries);
    const typename Structure::Implementation::AskingMany asking(me, filters, queries.size());
    asking.each([&](const auto& one, std::size_t i, index::Wanted wanted) {
        out[i] = one.given(one.answers().first(queries[i], wanted));
    });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <NearestOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::nearest_of_each(std::span<const Query> queries,
                                                             std::span<Found> out,
                                                             const Filters& filters) const
{
    const auto& me = *structure().implementation_;
    index::check_room(queries.size(), out.size());
    index::check_all(queries);
    const typename Structure::Implementation::AskingMany asking(me, filters, queries.size());
    asking.each([&](const auto& one, std::size_t i, index::Wanted wanted) {
        out[i] = one.given(one.answers().nearest(queries[i], wanted));
    });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <NearestOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::nearest_of_each(std::span<const Query> queries,
                                                             ResultLists<Found>& out,
                                                             const Filters& filters) const
{
    const auto& me = *structure().implementation_;
    index::check_all(queries);
    const typename Structure::Implementation::AskingMany asking(me, filters, queries.size());
    asking.template lists<Hit<T>>(out,
                                  [&](const auto& one, std::size_t i, index::Wanted wanted, auto& items) {
                                      one.answers().nearest(queries[i], wanted, items);
                                      return false;
                                  });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <LineOrRegionOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::all_of_each(std::span<const Query> queries,
                                                         ResultLists<Answer<Query>>& out,
                                                         const Filters& filters,
                                                         std::uint64_t max_results) const
{
    const auto& me = *structure().implementation_;
    index::check_all(queries);
    const typename Structure::Implementation::AskingMany asking(me, filters, queries.size());
    asking.template lists<typename index::ItemOf<Query>::Item>(
        out, [&](const auto& one, std::size_t i, index::Wanted wanted, auto& items) {
            return one.answers().all(queries[i], wanted, max_results, items);
        });
}

// --- Pairs ---

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <class Allocator>
void Queries<Structure, Dim, T, Id, Filter>::join_into(const BoxView<Dim, T>& boxes,
                                                       std::vector<Pair, Allocator>& out,
                                                       const Filters& filters)
{
    static_cast<Structure&>(*this).implementation_->join(boxes, out, filters);
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
bool Queries<Structure, Dim, T, Id, Filter>::visit_joined(const BoxView<Dim, T>& boxes, JoinVisitor visitor,
                                                          const Filters& filters) const
{
    return structure().implementation_->visit_joined(boxes, visitor, filters);
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
bool Queries<Structure, Dim, T, Id, Filter>::closest_pairs(const Structure& other, ClosestVisitor visitor,
                                                           T max_distance) const
{
    return structure().implementation_->closest_pairs(*other.implementation_, visitor, max_distance);
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
Executor& Queries<Structure, Dim, T, Id, Filter>::executor() const noexcept
{
    return structure().implementation_->executor();
}

// A source file ends by instantiating them, for `Base`, an alias of Queries by dimension and coordinate type,
// and the structure's filter.
#define JOSTLE_COMPILE_VISIT(Base, Filter, Dim, T, Query)                                                    \
    template JOSTLE_API bool Base<Dim, T>::visit(const Query<Dim, T>&,                                       \
                                                 Base<Dim, T>::Visitor<Base<Dim, T>::Answer<Query<Dim, T>>>, \
                                                 const Filter&) const;
#define JOSTLE_COMPILE_REGION(Base, Filter, Dim, T, Query)                                                   \
    JOSTLE_COMPILE_VISIT(Base, Filter, Dim, T, Query)                                                        \
    template JOSTLE_API bool Base<Dim, T>::any(const Query<Dim, T>&, const Filter&) const;                   \
    template JOSTLE_API std::uint64_t Base<Dim, T>::count(const Query<Dim, T>&, const Filter&) const;        \
    template JOSTLE_API bool Base<Dim, T>::all(const Query<Dim, T>&,                                         \
                                               std::vector<Base<Dim, T>::Answer<Query<Dim, T>>>&,            \
                                               const Filter&, std::uint64_t) const;                          \
    template JOSTLE_API void Base<Dim, T>::any_of_each(std::span<const Query<Dim, T>>, BoolSpan,             \
                                                       const detail::QueryFilters<Filter>&) const;           \
    template JOSTLE_API void Base<Dim, T>::count_of_each(std::span<const Query<Dim, T>>,                     \
                                                         std::span<std::uint64_t>,                           \
                                                         const detail::QueryFilters<Filter>&) const;         \
    template JOSTLE_API void Base<Dim, T>::all_of_each(                                                      \
        std::span<const Query<Dim, T>>, ResultLists<Base<Dim, T>::Answer<Query<Dim, T>>>&,                   \
        const detail::QueryFilters<Filter>&, std::uint64_t) const;
#define JOSTLE_COMPILE_LINE(Base, Filter, Dim, T, Query)                                                     \
    JOSTLE_COMPILE_REGION(Base, Filter, Dim, T, Query)                                                       \
    template JOSTLE_API std::optional<Base<Dim, T>::Found> Base<Dim, T>::first(const Query<Dim, T>&,         \
                                                                               const Filter&) const;         \
    template JOSTLE_API void Base<Dim, T>::first_of_each(std::span<const Query<Dim, T>>,                     \
                                                         std::span<Base<Dim, T>::Found>,                     \
                                                         const detail::QueryFilters<Filter>&) const;
#define JOSTLE_COMPILE_NEAREST(Base, Filter, Dim, T, Query)                                                  \
    JOSTLE_COMPILE_VISIT(Base, Filter, Dim, T, Query)                                                        \
    template JOSTLE_API std::optional<Base<Dim, T>::Found> Base<Dim, T>::nearest(const Query<Dim, T>&,       \
                                                                                 const Filter&) const;       \
    template JOSTLE_API void Base<Dim, T>::nearest_of_each(std::span<const Query<Dim, T>>,                   \
                                                           std::span<Base<Dim, T>::Found>,                   \
                                                           const detail::QueryFilters<Filter>&) const;       \
    template JOSTLE_API void Base<Dim, T>::nearest(const Query<Dim, T>&, std::vector<Base<Dim, T>::Found>&,  \
                                                   const Filter&) const;                                     \
    template JOSTLE_API void Base<Dim, T>::nearest_of_each(std::span<const Query<Dim, T>>,                   \
                                                           ResultLists<Base<Dim, T>::Found>&,                \
                                                           const detail::QueryFilters<Filter>&) const;
#define JOSTLE_COMPILE_QUERIES(Base, Filter, Dim, T)                                                         \
    template JOSTLE_API void Base<Dim, T>::join_into(const BoxView<Dim, T>&, std::vector<Pair>&,             \
                                                     const detail::QueryFilters<Filter>&);                   \
    template JOSTLE_API void Base<Dim, T>::join_into(const BoxView<Dim, T>&, std::pmr::vector<Pair>&,        \
                                                     const detail::QueryFilters<Filter>&);                   \
    template JOSTLE_API bool Base<Dim, T>::visit_joined(const BoxView<Dim, T>&, Base<Dim, T>::JoinVisitor,   \
                                                        const detail::QueryFilters<Filter>&) const;          \
    template JOSTLE_API bool Base<Dim, T>::closest_pairs(const Base<Dim, T>::StructureType&,                 \
                                                         Base<Dim, T>::ClosestVisitor, T) const;             \
    template JOSTLE_API Executor& Base<Dim, T>::executor() const noexcept;                                   \
    JOSTLE_COMPILE_LINE(Base, Filter, Dim, T, Ray)                                                           \
    JOSTLE_COMPILE_LINE(Base, Filter, Dim, T, Sweep)                                                         \
    JOSTLE_COMPILE_REGION(Base, Filter, Dim, T, Aabb)                                                        \
    JOSTLE_COMPILE_REGION(Base, Filter, Dim, T, Sphere)                                                      \
    JOSTLE_COMPILE_REGION(Base, Filter, Dim, T, Frustum)                                                     \
    JOSTLE_COMPILE_NEAREST(Base, Filter, Dim, T, Nearest)                                                    \
    JOSTLE_COMPILE_NEAREST(Base, Filter, Dim, T, NearestToBox)

JOSTLE_NAMESPACE_END
