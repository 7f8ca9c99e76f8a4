// SPDX-License-Identifier: MIT
// The list of a search with a skin: while no point has moved too far, later calls choose from it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <type_traits>
#include <vector>

#include "neighbors/grid.hpp"
#include "neighbors/kernels/neighbors.hpp"
#include "neighbors/request.hpp"
#include "neighbors/rows.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

template <int Dim, Coordinate T>
class KeptList
{
    using Set = PointSet<Dim, T>;

  public:
    explicit KeptList(std::pmr::memory_resource* memory)
        : list(memory), points_(memory), radii_(memory), types_(memory), table_(memory)
    {
    }

    /// All pairs within the cutoff and the skin, with shifts and distances: a search writes it, then `keep`
    /// is called.
    StoredNeighbors<Dim, T> list;

    /// Until `keep` the list holds for nothing.
    void forget() { holds_ = false; }

    /// Keeps what the list depends on.
    void keep(const Request<Dim, T>& request, const NeighborGrid<Dim, T>& grid, RowTasks<Dim, T>& tasks)
    {
        each_input(request, [](auto& before, const auto& now) {
            before = now;
            return true;
        });
        keep_columns(request, points_, [](const Set& set) { return set.points; });
        keep_columns(request, radii_, radii_of);
        keep_columns(request, types_, types_of);
        table_.assign(request.rule.table.begin(), request.rule.table.end());
        rounding_ = grid.rounding;
        moved_ = 0;
        tasks.longest_kept = 0;
        for (std::size_t i = 0; i < request.a.points.size(); ++i)
            tasks.longest_kept =
                std::max<std::size_t>(tasks.longest_kept, list.offsets[i + 1] - list.offsets[i]);
        holds_ = true;
    }

    /// Whether the list has all that may be neighbours now.
    bool holds(const Request<Dim, T>& request)
    {
        if (!holds_ ||
            !each_input(request, [](const auto& before, const auto& now) { return before == now; }) ||
            points_.size() != request.a.points.size() + request.b.points.size() ||
            !same_columns(request, radii_, radii_of) || !same_columns(request, types_, types_of) ||
            !std::equal(table_.begin(), table_.end(), request.rule.table.begin(), request.rule.table.end()))
            return false;
        const double most = skin_ / 2 * (1 - 1e-12) - 4 * rounding_;
        if (!(most > 0)) return false;
        double furthest = 0;
        std::size_t at = 0;
        for (const Set* set : {&request.a, &request.b})
            for (const Vec<Dim, T>& point : set->points) {
                const auto moved = Grid::wide(point) - Grid::wide(points_[at++]);
                furthest = std::max(furthest, dot(moved, moved));
                if (!(furthest <= most * most)) return false;
            }
        moved_ = std::sqrt(furthest);
        return true;
    }

    /// Selects from the list, for which it holds. How far points have moved since decides most of it; the
    /// definition decides the rest.
    void choose(const Request<Dim, T>& request, const NeighborKernels<Dim, T>& kernels,
                RowTasks<Dim, T>& tasks, StoredNeighbors<Dim, T>& result)
    {
        const std::size_t n = request.a.points.size();
        std::uint64_t* const counts = tasks.counts.reserve(n);
        const auto of = [](const auto& values, std::size_t i) {
            using Value = std::remove_cvref_t<decltype(values[i])>;
            return values.empty() ? Value{} : values[i];
        };
        const bool one_cutoff = request.rule.types == 0 && !request.rule.of_radii;
        const bool shifts = needs_shifts(request.options);
        tasks.each_block(n, [&](auto& own, std::size_t block, std::size_t begin, std::size_t end) {
            BlockFound& into = tasks.blocks[block];
            into.count = 0;
            const std::size_t room = list.offsets[end] - list.offsets[begin] + neighbor_padding;
            into.index.reserve(room);
            if (shifts) into.image.reserve(room);
            for (std::size_t i = begin; i < end; ++i) {
                const std::uint64_t first = list.offsets[i];
                const std::size_t count = list.offsets[i + 1] - first;
                const Vec<Dim, T> from = request.a.points[i];
                const double moved = length(Grid::wide(from) - Grid::wide(points_[i])) + moved_,
                             by = moved * (1 + 1e-12) + 4 * rounding_;
                const T sure = one_cutoff ? static_cast<T>(request.rule.value - by) : T(-1),
                        near = one_cutoff ? static_cast<T>(request.rule.value + by)
                                          : std::numeric_limits<T>::infinity();
                std::uint32_t* const chosen = own.chosen.data();
                const std::size_t unsure = kernels.tell_apart(list.distances.data() + first, count, sure,
                                                              near, chosen, own.unsure.data());
                for (std::size_t u = 0; u < unsure; ++u) { // without a branch that depends on what is near
                    const std::uint32_t k = own.unsure[u], j = list.neighbors[first + k];
                    const Vec<Dim, T> apart =
                        request.vectors.between(from, request.b.points[j], list.shifts[first + k]);
                    const T cutoff = request.rule(of(request.a.radii, i), of(request.a.types, i),
                                                  of(request.b.radii, j), of(request.b.types, j));
                    const bool is_far = !(dot(apart, apart) <= cutoff * cutoff);
                    chosen[k / 32] ^= std::uint32_t{is_far} << k % 32;
                }
                counts[i] = kernels.take_chosen(list.neighbors.data() + first, count, chosen,
                                                into.index.data() + into.count,
                                                shifts ? into.image.data() + into.count : nullptr);
                into.count += counts[i];
            }
        });
        result.allot(counts, n, request.options);
        tasks.each_block(n, [&](auto&, std::size_t block, std::size_t begin, std::size_t end) {
            BlockFound& found = tasks.blocks[block];
            std::size_t at = 0;
            for (std::size_t i = begin; i < end; ++i) {
                const std::size_t first = result.offsets[i], count = result.offsets[i + 1] - first;
                std::copy_n(found.index.data() + at, count, result.neighbors.data() + first);
                for (std::size_t k = 0; shifts && k < count; ++k) {
                    result.shifts[first + k] = list.shifts[list.offsets[i] + found.image[at + k]];
                    if (request.options.vectors)
                        result.vectors[first + k] = result.vector(request, i, first + k);
                }
                result.measure(request, request.options, i, first, count);
                at += count;
            }
        });
    }

    void release()
    {
        forget();
        list.release();
        const auto empty = [](auto& vector) {
            vector.clear();
            vector.shrink_to_fit();
        };
        empty(points_), empty(radii_), empty(types_), empty(table_);
    }

  private:
    using Grid = NeighborGrid<Dim, T>;

    /// Calls look(kept, given) with all that the list depends on, but for columns, until it says false.
    template <class Look>
    bool each_input(const Request<Dim, T>& request, const Look& look)
    {
        return look(two_sets_, request.two_sets) && look(half_, request.options.half) &&
               look(skin_, request.options.skin) && look(value_, request.rule.value) &&
               look(greater_, request.rule.greater) && look(cell_, request.cell) &&
               look(of_a_, request.a.points.size());
    }
    template <class Kept, class Get>
    static bool same_columns(const Request<Dim, T>& request, const Kept& kept, const Get& get)
    {
        const auto a = get(request.a), b = get(request.b);
        return kept.size() == a.size() + b.size() && std::equal(a.begin(), a.end(), kept.begin()) &&
               std::equal(b.begin(), b.end(), kept.begin() + static_cast<std::ptrdiff_t>(a.size()));
    }
    template <class Kept, class Get>
    static void keep_columns(const Request<Dim, T>& request, Kept& kept, const Get& get)
    {
        const auto a = get(request.a), b = get(request.b);
        kept.assign(a.begin(), a.end());
        kept.insert(kept.end(), b.begin(), b.end());
    }
    static constexpr auto radii_of = [](const Set& set) { return set.radii; };
    static constexpr auto types_of = [](const Set& set) { return set.types; };

    bool holds_ = false, two_sets_ = false, half_ = false, greater_ = false;
    double skin_ = 0, rounding_ = 0;
    double moved_ = 0; ///< how far any point has since the search, at most
    T value_ = 0;
    PeriodicCell<Dim, T> cell_;
    std::size_t of_a_ = 0;
    std::pmr::vector<Vec<Dim, T>> points_; ///< of both sets, as are the next two
    std::pmr::vector<T> radii_;
    std::pmr::vector<std::uint32_t> types_;
    std::pmr::vector<T> table_;
};

} // namespace neighbors
JOSTLE_NAMESPACE_END
