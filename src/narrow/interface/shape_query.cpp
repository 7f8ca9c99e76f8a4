// SPDX-License-Identifier: MIT
// The verbs of Queries about shapes, once for a BoxIndex and a World.
#include "jostle/shape_query.hpp"

#include <string>

#include "base/instantiate.hpp"
#include "base/result_lists.hpp"
#include "jostle/box_index.hpp"
#include "jostle/error.hpp"
#include "jostle/process.hpp"
#include "narrow/interface/shape_search.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

// --- Batches ---

/// Queries differ much in cost.
constexpr std::uint64_t query_block = 16;

/// Calls ask(search) for query i of a batch, whose filter's `accept` gets the query's number.
template <class Structure, class Query, class Filter, class Ask>
auto ask_one(const Structure& structure, std::span<const Query> queries, std::size_t i,
             const PosedShapes<Structure::dim, typename Structure::Number>& objects,
             const detail::QueryFilters<Filter>& filters, const Ask& ask)
{
    Filter filter = filters[i];
    const auto accept = filter.accept;
    const auto numbered = [&accept, i](std::uint32_t, auto id) {
        return accept(static_cast<std::uint32_t>(i), id);
    };
    if (accept) filter.accept = numbered;
    return ask(ShapeSearch<Structure, Query, Filter>(structure, queries[i], objects, filter, i));
}
/// out[i] = answer(search) for each query.
template <class Structure, class Query, class Filter, class Out, class Answer>
void ask_each(const Structure& structure, Executor& executor, std::span<const Query> queries,
              const PosedShapes<Structure::dim, typename Structure::Number>& objects, Out out,
              const detail::QueryFilters<Filter>& filters, const Answer& answer)
{
    if (queries.size() != out.size())
        detail::throw_not_one_each(queries.size(), out.size(), "places for answers");
    filters.check(queries.size());
    const auto answer_block = [&](std::uint64_t begin, std::uint64_t end, Work) {
        for (std::size_t i = begin; i < end; ++i)
            out[i] = ask_one(structure, queries, i, objects, filters, answer);
    };
    process_items(queries.size(), answer_block, {&executor, query_block});
}
/// Refills lists; append(search, items) returns whether there are more.
template <class Structure, class Query, class Filter, class Item, class Append>
void fill_lists(const Structure& structure, Executor& executor, std::span<const Query> queries,
                const PosedShapes<Structure::dim, typename Structure::Number>& objects,
                ResultLists<Item>& out, const detail::QueryFilters<Filter>& filters, const Append& append)
{
    filters.check(queries.size());
    ResultListsAccess::fill(out, queries.size(), {&executor, query_block}, [&](std::size_t i, auto& items) {
        return ask_one(structure, queries, i, objects, filters,
                       [&](const auto& search) { return append(search, items); });
    });
}

} // namespace
} // namespace narrow

namespace detail {
void throw_no_shape(std::uint32_t id, std::size_t shapes, std::size_t poses)
{
    throw Error(ErrorCode::size_mismatch,
                "there is an object with the id " + std::to_string(id) + ", but there are " +
                    std::to_string(shapes) + " shapes and " + std::to_string(poses) +
                    " poses; give one of each for every id",
                id);
}

} // namespace detail

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <ShapeQueryOf<Dim, T> Query>
bool Queries<Structure, Dim, T, Id, Filter>::any(const Query& query, const Shapes& objects,
                                                 const Filter& filter) const
{
    const narrow::ShapeSearch<Structure, Query, Filter> search(structure(), query, objects, filter,
                                                               Error::no_index);
    return search.count(true) != 0;
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <ShapeQueryOf<Dim, T> Query>
std::uint64_t Queries<Structure, Dim, T, Id, Filter>::count(const Query& query, const Shapes& objects,
                                                            const Filter& filter) const
{
    const narrow::ShapeSearch<Structure, Query, Filter> search(structure(), query, objects, filter,
                                                               Error::no_index);
    return search.count(false);
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <ShapeCastOf<Dim, T> Query>
auto Queries<Structure, Dim, T, Id, Filter>::first(const Query& query, const Shapes& objects,
                                                   const Filter& filter) const -> std::optional<FoundShape>
{
    const narrow::ShapeSearch<Structure, Query, Filter> search(structure(), query, objects, filter,
                                                               Error::no_index);
    const FoundShape found = search.first();
    return found.id == Found::none ? std::nullopt : std::optional(found);
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <std::same_as<NearestToShape<Dim, T>> Query>
auto Queries<Structure, Dim, T, Id, Filter>::nearest(const Query& query, const Shapes& objects,
                                                     const Filter& filter) const
    -> std::optional<FoundDistance>
{
    const narrow::ShapeSearch<Structure, Query, Filter> search(structure(), query, objects, filter,
                                                               Error::no_index);
    const FoundDistance found = search.first();
    return found.id == Found::none ? std::nullopt : std::optional(found);
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <std::same_as<NearestToShape<Dim, T>> Query>
void Queries<Structure, Dim, T, Id, Filter>::nearest(const Query& query, const Shapes& objects,
                                                     std::vector<FoundDistance>& out,
                                                     const Filter& filter) const
{
    out.clear();
    const narrow::ShapeSearch<Structure, Query, Filter> search(structure(), query, objects, filter,
                                                               Error::no_index);
    search.append_nearest(out);
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <ShapeQueryOf<Dim, T> Query>
bool Queries<Structure, Dim, T, Id, Filter>::all(const Query& query, const Shapes& objects,
                                                 std::vector<ShapeAnswer<Query>>& out, const Filter& filter,
                                                 std::uint64_t max_results) const
{
    out.clear();
    const narrow::ShapeSearch<Structure, Query, Filter> search(structure(), query, objects, filter,
                                                               Error::no_index);
    return search.append_all(out, max_results);
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <class Query>
    requires ShapeQueryOf<Query, Dim, T> || std::same_as<Query, NearestToShape<Dim, T>>
bool Queries<Structure, Dim, T, Id, Filter>::visit(const Query& query, const ShapesFor<Query>& objects,
                                                   Visitor<ShapeAnswer<Query>> visitor,
                                                   const Filter& filter) const
{
    const narrow::ShapeSearch<Structure, Query, Filter> search(structure(), query, objects, filter,
                                                               Error::no_index);
    return search.visit(visitor);
}

// --- Batches ---

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <ShapeQueryOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::any_of_each(std::span<const Query> queries,
                                                         const Shapes& objects, BoolSpan out,
                                                         const Filters& filters) const
{
    narrow::ask_each(structure(), executor(), queries, objects, out, filters,
                     [](const auto& search) { return search.count(true) != 0; });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <ShapeQueryOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::count_of_each(std::span<const Query> queries,
                                                           const Shapes& objects,
                                                           std::span<std::uint64_t> out,
                                                           const Filters& filters) const
{
    narrow::ask_each(structure(), executor(), queries, objects, out, filters,
                     [](const auto& search) { return search.count(false); });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <ShapeCastOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::first_of_each(std::span<const Query> queries,
                                                           const Shapes& objects, std::span<FoundShape> out,
                                                           const Filters& filters) const
{
    narrow::ask_each(structure(), executor(), queries, objects, out, filters,
                     [](const auto& search) { return search.first(); });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <std::same_as<NearestToShape<Dim, T>> Query>
void Queries<Structure, Dim, T, Id, Filter>::nearest_of_each(std::span<const Query> queries,
                                                             const Shapes& objects,
                                                             std::span<FoundDistance> out,
                                                             const Filters& filters) const
{
    narrow::ask_each(structure(), executor(), queries, objects, out, filters,
                     [](const auto& search) { return search.first(); });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <std::same_as<NearestToShape<Dim, T>> Query>
void Queries<Structure, Dim, T, Id, Filter>::nearest_of_each(std::span<const Query> queries,
                                                             const Shapes& objects,
                                                             ResultLists<FoundDistance>& out,
                                                             const Filters& filters) const
{
    narrow::fill_lists(structure(), executor(), queries, objects, out, filters,
                       [&](const auto& search, auto& items) {
                           search.append_nearest(items);
                           return false;
                       });
}

template <class Structure, int Dim, Coordinate T, class Id, class Filter>
template <ShapeQueryOf<Dim, T> Query>
void Queries<Structure, Dim, T, Id, Filter>::all_of_each(std::span<const Query> queries,
                                                         const Shapes& objects,
                                                         ResultLists<ShapeAnswer<Query>>& out,
                                                         const Filters& filters,
                                                         std::uint64_t max_results) const
{
    narrow::fill_lists(
        structure(), executor(), queries, objects, out, filters,
        [&](const auto& search, auto& items) { return search.append_all(items, max_results); });
}

template <int Dim, Coordinate T>
using IndexShapeQueries = Queries<BoxIndex<Dim, T>, Dim, T, std::uint32_t, QueryFilter>;
template <int Dim, Coordinate T>
using WorldShapeQueries = Queries<World<Dim, T>, Dim, T, ObjectId, ObjectQueryFilter>;

#define JOSTLE_COMPILE_SHAPE_VISIT(Base, Filter, Dim, T, Query)                                              \
    template JOSTLE_API bool Base<Dim, T>::visit(                                                            \
        const Query<Dim, T>&, const PosedShapes<Dim, T>&,                                                    \
        Base<Dim, T>::Visitor<Base<Dim, T>::ShapeAnswer<Query<Dim, T>>>, const Filter&) const;
#define JOSTLE_COMPILE_SHAPE_QUERY(Base, Filter, Dim, T, Query)                                              \
    JOSTLE_COMPILE_SHAPE_VISIT(Base, Filter, Dim, T, Query)                                                  \
    template JOSTLE_API bool Base<Dim, T>::any(const Query<Dim, T>&, const PosedShapes<Dim, T>&,             \
                                               const Filter&) const;                                         \
    template JOSTLE_API std::uint64_t Base<Dim, T>::count(const Query<Dim, T>&, const PosedShapes<Dim, T>&,  \
                                                          const Filter&) const;                              \
    template JOSTLE_API bool Base<Dim, T>::all(const Query<Dim, T>&, const PosedShapes<Dim, T>&,             \
                                               std::vector<Base<Dim, T>::ShapeAnswer<Query<Dim, T>>>&,       \
                                               const Filter&, std::uint64_t) const;                          \
    template JOSTLE_API void Base<Dim, T>::any_of_each(std::span<const Query<Dim, T>>,                       \
                                                       const PosedShapes<Dim, T>&, BoolSpan,                 \
                                                       const detail::QueryFilters<Filter>&) const;           \
    template JOSTLE_API void Base<Dim, T>::count_of_each(                                                    \
        std::span<const Query<Dim, T>>, const PosedShapes<Dim, T>&, std::span<std::uint64_t>,                \
        const detail::QueryFilters<Filter>&) const;                                                          \
    template JOSTLE_API void Base<Dim, T>::all_of_each(                                                      \
        std::span<const Query<Dim, T>>, const PosedShapes<Dim, T>&,                                          \
        ResultLists<Base<Dim, T>::ShapeAnswer<Query<Dim, T>>>&, const detail::QueryFilters<Filter>&,         \
        std::uint64_t) const;
#define JOSTLE_COMPILE_SHAPE_CAST(Base, Filter, Dim, T, Query)                                               \
    JOSTLE_COMPILE_SHAPE_QUERY(Base, Filter, Dim, T, Query)                                                  \
    template JOSTLE_API std::optional<Base<Dim, T>::FoundShape> Base<Dim, T>::first(                         \
        const Query<Dim, T>&, const PosedShapes<Dim, T>&, const Filter&) const;                              \
    template JOSTLE_API void Base<Dim, T>::first_of_each(                                                    \
        std::span<const Query<Dim, T>>, const PosedShapes<Dim, T>&, std::span<Base<Dim, T>::FoundShape>,     \
        const detail::QueryFilters<Filter>&) const;
#define JOSTLE_COMPILE_SHAPE_QUERIES(Base, Filter, Dim, T)                                                   \
    JOSTLE_COMPILE_SHAPE_CAST(Base, Filter, Dim, T, Ray)                                                     \
    JOSTLE_COMPILE_SHAPE_CAST(Base, Filter, Dim, T, ShapeSweep)                                              \
    JOSTLE_COMPILE_SHAPE_QUERY(Base, Filter, Dim, T, PosedShape)                                             \
    JOSTLE_COMPILE_SHAPE_VISIT(Base, Filter, Dim, T, NearestToShape)                                         \
    template JOSTLE_API std::optional<Base<Dim, T>::FoundDistance> Base<Dim, T>::nearest(                    \
        const NearestToShape<Dim, T>&, const PosedShapes<Dim, T>&, const Filter&) const;                     \
    template JOSTLE_API void Base<Dim, T>::nearest(                                                          \
        const NearestToShape<Dim, T>&, const PosedShapes<Dim, T>&,                                           \
        std::vector<Base<Dim, T>::FoundDistance>&, const Filter&) const;                                     \
    template JOSTLE_API void Base<Dim, T>::nearest_of_each(                                                  \
        std::span<const NearestToShape<Dim, T>>, const PosedShapes<Dim, T>&,                                 \
        std::span<Base<Dim, T>::FoundDistance>, const detail::QueryFilters<Filter>&) const;                  \
    template JOSTLE_API void Base<Dim, T>::nearest_of_each(                                                  \
        std::span<const NearestToShape<Dim, T>>, const PosedShapes<Dim, T>&,                                 \
        ResultLists<Base<Dim, T>::FoundDistance>&, const detail::QueryFilters<Filter>&) const;
#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    JOSTLE_COMPILE_SHAPE_QUERIES(IndexShapeQueries, QueryFilter, Dim, T)                                     \
    JOSTLE_COMPILE_SHAPE_QUERIES(WorldShapeQueries, ObjectQueryFilter, Dim, T)
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
