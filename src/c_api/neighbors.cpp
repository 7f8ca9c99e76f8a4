// SPDX-License-Identifier: MIT
// Neighbour lists in C.
#include "jostle/neighbors.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "c_api/handles.hpp"

namespace jostle::c_api {
namespace {

class NeighborFinderContent final : public Content
{
  public:
    NeighborFinderContent(jostle_space given, const Kept& with) : kept(with)
    {
        in_space(given, [&](auto in) {
            using Finder = NeighborFinder<decltype(in)::dim, typename decltype(in)::T>;
            finder.emplace<Finder>(kept.options<FinderOptions>());
        });
    }
    bool release_memory() override
    {
        on_held(finder, [](auto& in_its_space) { in_its_space.release_memory(); });
        return true;
    }

    Kept kept;
    InSomeSpace<NeighborFinder<2, float>, NeighborFinder<3, float>, NeighborFinder<2, double>,
                NeighborFinder<3, double>>
        finder;
};

template <class Value>
std::span<const Value> span_of(const void* data, std::uint64_t count, const char* name)
{
    return {wanted_array_of<Value>(data, count, name), static_cast<std::size_t>(count)};
}
/// The same where NULL means that there are none.
template <class Value>
std::span<const Value> span_if_given(const void* data, std::uint64_t count, const char* name)
{
    return span_of<Value>(data, data == nullptr ? 0 : count, name);
}

std::uint64_t checked_cells(std::uint64_t count)
{
    if (count > std::numeric_limits<std::uint32_t>::max())
        refuse("cell_count is " + std::to_string(count) + ": there aren't so many systems");
    return count;
}

/// A query as C++ has it.
template <int Dim, class T>
struct NeighborSearch
{
    explicit NeighborSearch(const jostle_neighbor_query& query);

    std::span<const Vec<Dim, T>> points, others;
    NeighborCutoff<T> cutoff;
    std::vector<PeriodicCell<Dim, T>> cells;
    NeighborOptions options;

    /// Of one system.
    PeriodicCell<Dim, T> cell() const
    {
        if (cells.size() > 1)
            refuse("there are " + std::to_string(cells.size()) + " cells for one system; give one");
        return cells.empty() ? PeriodicCell<Dim, T>{} : cells.front();
    }
};

template <int Dim, class T>
NeighborSearch<Dim, T>::NeighborSearch(const jostle_neighbor_query& query)
    : points(span_of<Vec<Dim, T>>(query.points, query.count, "points")),
      others(span_of<Vec<Dim, T>>(query.others, query.other_count, "others")),
      cutoff(static_cast<T>(query.cutoff))
{
    cutoff.radii = span_if_given<T>(query.radii, query.count, "radii");
    cutoff.radii_b = span_if_given<T>(query.radii_b, query.other_count, "radii_b");
    cutoff.greater = query.greater != 0;
    cutoff.types = span_if_given<std::uint32_t>(query.types, query.count, "types");
    cutoff.types_b = span_if_given<std::uint32_t>(query.types_b, query.other_count, "types_b");
    if (query.type_count > std::numeric_limits<std::uint32_t>::max() / 2)
        refuse("type_count is " + std::to_string(query.type_count) + ": no table is so large");
    cutoff.table = span_of<T>(query.table, query.type_count * query.type_count, "table");
    const std::uint64_t numbers = checked_cells(query.cell_count) * Dim;
    const T* const vectors = wanted_array_of<T>(query.cells, numbers * Dim, "cells");
    const std::int32_t* const repeats = wanted_array(query.repeats, numbers, "repeats");
    cells.resize(static_cast<std::size_t>(query.cell_count));
    for (std::size_t k = 0; k < numbers; ++k) {
        cells[k / Dim].repeats[k % Dim] = repeats[k] != 0;
        for (int d = 0; d < Dim; ++d)
            cells[k / Dim].vectors[k % Dim][d] = vectors[k * Dim + static_cast<std::size_t>(d)];
    }
    options.half = query.half != 0;
    options.shifts = query.shifts != 0;
    options.vectors = query.vectors != 0;
    options.distances = query.distances != 0;
    options.skin = query.skin;
}

template <int Dim, class T>
jostle_neighbor_list list_in_c(const NeighborList<Dim, T>& list, bool with_shifts)
{
    return {list.offsets.data(),
            list.neighbors.data(),
            list.neighbors.size(),
            with_shifts ? reinterpret_cast<const std::int32_t*>(list.shifts.data()) : nullptr,
            list.vectors.data(),
            list.distances.data(),
            list.searched ? 1 : 0};
}

template <int Dim, class T>
jostle_neighbor_list find_neighbors(NeighborFinder<Dim, T>& finder, const jostle_neighbor_query& query)
{
    const NeighborSearch<Dim, T> search(query);
    const auto& [points, others, cutoff, cells, options] = search;
    const NeighborList<Dim, T>* found = nullptr;
    if (query.offsets != nullptr) {
        if (query.others != nullptr) refuse("many systems have one set each, but others isn't NULL");
        found = &finder.find_systems(points, offsets_of(query.offsets, query.system_count, "system_count"),
                                     cutoff, cells, options);
    } else {
        found = query.others == nullptr ? &finder.find(points, cutoff, search.cell(), options)
                                        : &finder.find(points, others, cutoff, search.cell(), options);
    }
    return list_in_c(*found, options.shifts);
}

template <int Dim, class T>
bool stream_neighbors(NeighborFinder<Dim, T>& finder, const jostle_neighbor_query& query, std::uint64_t rows,
                      jostle_neighbor_sink_function sink, void* context)
{
    if (query.offsets != nullptr) refuse("a stream has one system, but offsets isn't NULL");
    const NeighborSearch<Dim, T> search(query);
    const auto& [points, others, cutoff, cells, options] = search;
    const auto hand_over = [&](std::size_t first, const NeighborList<Dim, T>& block) {
        const jostle_neighbor_list list = list_in_c(block, search.options.shifts);
        return agreed(sink(context, first, block.offsets.size() - 1, &list));
    };
    const auto most =
        static_cast<std::size_t>(std::min<std::uint64_t>(rows, UINT32_MAX)); // of points as well
    return query.others == nullptr
               ? finder.stream(points, cutoff, most, hand_over, search.cell(), options)
               : finder.stream(points, others, cutoff, most, hand_over, search.cell(), options);
}

} // namespace

template <>
struct Behind<jostle_neighbor_finder> : Kind<NeighborFinderContent, 0x13>
{
    static constexpr const char* name = "jostle_neighbor_finder";
};

} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_neighbor_finder_new(jostle_space space, const jostle_options* options,
                                         jostle_neighbor_finder** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<NeighborFinderContent>(space, keep(options)));
    });
}
jostle_status jostle_neighbor_finder_find(jostle_neighbor_finder* finder, const jostle_neighbor_query* query,
                                          jostle_neighbor_list* list, jostle_error* error)
{
    return guarded(error, [&] {
        NeighborFinderContent& content = open(finder);
        const jostle_neighbor_query given = read_options(&wanted(query, "query"), "jostle_neighbor_query");
        wanted(list, "list");
        on_held(content.finder, [&](auto& in_its_space) { *list = find_neighbors(in_its_space, given); });
    });
}
jostle_status jostle_neighbor_finder_stream(jostle_neighbor_finder* finder,
                                            const jostle_neighbor_query* query, uint64_t rows,
                                            jostle_neighbor_sink_function sink, void* context,
                                            int32_t* finished, jostle_error* error)
{
    return guarded(error, [&] {
        NeighborFinderContent& content = open(finder);
        const jostle_neighbor_query given = read_options(&wanted(query, "query"), "jostle_neighbor_query");
        wanted_function(sink, "sink");
        wanted(finished, "finished");
        on_held(content.finder, [&](auto& in_its_space) {
            *finished = stream_neighbors(in_its_space, given, rows, sink, context) ? 1 : 0;
        });
    });
}

} // extern "C"
