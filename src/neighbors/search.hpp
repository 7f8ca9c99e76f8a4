// SPDX-License-Identifier: MIT
// The search: rows of points that share a cell also share their candidates. A test of wrapped points, with
// bounds for rounding, finds those that are near; where it can't decide, the definition's test does.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "jostle/find_pairs.hpp"
#include "neighbors/candidates.hpp"
#include "neighbors/grid.hpp"
#include "neighbors/kernels/neighbors.hpp"
#include "neighbors/request.hpp"
#include "neighbors/rows.hpp"
#include "neighbors/shifts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

/// Rows that are worked on together: those of the points from `first` on, in the order of the grid.
struct RowRange
{
    std::size_t first, count;
    const std::uint32_t* places; ///< in the grid; null where all rows are, in whose order they then are

    std::size_t place(std::size_t s) const { return places == nullptr ? s : places[s]; }
};

/// Finds rows of the points in the grid, which is filled before, and stores them.
template <int Dim, Coordinate T>
class Search
{
  public:
    Search(const Request<Dim, T>& request, PointsInGrid<Dim, T>& sets, const NeighborKernels<Dim, T>& kernels,
           RowTasks<Dim, T>& tasks)
        : request_(request),
          sets_(sets),
          grid_(sets.grid),
          a_(sets.a),
          b_(sets.b()),
          kernels_(kernels),
          tasks_(tasks)
    {
    }

    void find(const RowRange& rows, const NeighborOptions& what, StoredNeighbors<Dim, T>& into)
    {
        std::uint64_t* const counts = tasks_.counts.reserve(rows.count);
        if (!request_.any_points()) {
            std::fill_n(counts, rows.count, std::uint64_t{0});
            return into.allot(counts, rows.count, what);
        }
        const bool with_images =
            needs_shifts(what) && std::any_of(grid_.repeats, grid_.repeats + Dim, [](bool is) { return is; });
        // Unless they are very many: which task has the most is chance.
        tasks_.most_runs = static_cast<std::size_t>(std::min(most_runs(request_, grid_), 4096.0));
        tasks_.each_block(rows.count, [&](auto& own, std::size_t block, std::size_t begin, std::size_t end) {
            BlockFound& found = tasks_.blocks[block];
            found.count = 0;
            end = group_from(rows, end);
            for (std::size_t s = group_from(rows, begin); s < end;) {
                const std::size_t last = group_from(rows, s + 1), first = rows.place(s);
                const auto columns = own.candidates.collect(request_, sets_, kernels_, first,
                                                            rows.place(last - 1) + 1, with_images);
                for (; s < last; ++s) {
                    const std::size_t before = found.count, place = rows.place(s);
                    find_row(place, own.candidates.itself(place - first), columns, own.candidates, found);
                    counts[a_.index[place] - rows.first] = found.count - before;
                }
            }
        });
        into.allot(counts, rows.count, what);
        tasks_.each_block(rows.count, [&](auto&, std::size_t block, std::size_t begin, std::size_t end) {
            std::size_t at = 0;
            end = group_from(rows, end);
            for (std::size_t s = group_from(rows, begin); s < end; ++s) {
                const std::size_t point = a_.index[rows.place(s)], first = into.offsets[point - rows.first],
                                  count = into.offsets[point - rows.first + 1] - first;
                store_row(tasks_.blocks[block], at, point, first, count, what, with_images, into);
                at += count;
            }
        });
    }

  private:
    /// Rows are worked on in groups: those of a cell, or of rows_per_block places in it. This is where the
    /// group of a place begins.
    std::size_t group_of(std::size_t place) const
    {
        const std::size_t begin = a_.starts[a_.cell[a_.index[place]]], before = place - begin;
        return place - before % rows_per_block;
    }
    /// A block has the groups that begin in it. This is the first row, of these at or behind the s-th, with
    /// which a group begins.
    std::size_t group_from(const RowRange& rows, std::size_t s) const
    {
        if (s == 0 || s >= rows.count) return s;
        const std::size_t group = group_of(rows.place(s - 1));
        while (s < rows.count && group_of(rows.place(s)) == group)
            ++s;
        return s;
    }

    /// Adds the neighbours of the point of a at `row` to what its block has found.
    void find_row(std::size_t row, std::uint32_t itself, const NearbyColumns<T>& columns,
                  Candidates<Dim, T>& candidates, BlockFound& block)
    {
        const std::size_t room = block.count + columns.count + neighbor_padding;
        RowFound found{block.index.grow(room, block.count) + block.count, nullptr, candidates.unsure(), 0, 0};
        if (columns.image != nullptr) found.image = block.image.grow(room, block.count) + block.count;
        Vec<Dim, T> here;
        for (int d = 0; d < Dim; ++d)
            here[d] = a_.axis(d)[row];
        const T radius = a_.points[row].radius;
        const RowCutoff<T> cutoff{request_.rule.types == 0 ? grid_.sure : T(-1),
                                  grid_.near_of(static_cast<double>(request_.reach())),
                                  radius,
                                  static_cast<T>(request_.options.skin),
                                  grid_.slack_of_radii,
                                  request_.rule.greater,
                                  radius > 0}; // two radii of 0: none is near
        if (request_.two_sets) {
            kernels_.find_row(columns, 0, here, cutoff, found);
        } else if (request_.options.half) {
            kernels_.find_row(columns, itself + 1, here, cutoff, found);
        } else { // meanwhile the point itself is near none
            T& x = columns.at[0][itself];
            const T before = std::exchange(x, std::numeric_limits<T>::quiet_NaN());
            kernels_.find_row(columns, 0, here, cutoff, found);
            x = before;
        }
        // Closes the gaps of those that the definition rejects.
        const GridPoint<Dim, T>& from = a_.points[row];
        const T skin = static_cast<T>(request_.options.skin);
        std::size_t to = 0, next = 0;
        const auto keep_until = [&](std::size_t end) {
            if (to != next) {
                std::copy(found.index + next, found.index + end, found.index + to);
                if (found.image != nullptr)
                    std::copy(found.image + next, found.image + end, found.image + to);
            }
            to += end - next;
        };
        for (std::size_t k = 0; k < found.unsure_count; ++k) {
            const UnsureNeighbor& each = found.unsure[k];
            const GridPoint<Dim, T>& other = b_.points[candidates.place(each.nearby)];
            const T own_cutoff = request_.rule(from.radius, from.type, other.radius, other.type);
            const T most = own_cutoff + skin;
            const auto image = image_of<Dim>(candidates.image(each.nearby), sets_.image_bits);
            const Vec<Dim, T> apart = request_.vectors.between(
                from.at, other.at, shift_of<Dim>(image, from.wrapped, other.wrapped));
            if (own_cutoff > 0 && dot(apart, apart) <= most * most) continue;
            keep_until(each.found);
            next = each.found + 1;
        }
        keep_until(found.count);
        block.count += to;
    }

    /// Writes a point's neighbours, which are at `at` of what its block has found.
    void store_row(BlockFound& found, std::size_t at, std::size_t point, std::size_t first, std::size_t count,
                   const NeighborOptions& what, bool with_images, StoredNeighbors<Dim, T>& into)
    {
        std::copy_n(found.index.data() + at, count, into.neighbors.data() + first);
        if (!needs_shifts(what)) return;
        const std::uint32_t* const neighbor = into.neighbors.data() + first;
        Periods<Dim>* const to = into.shifts.data() + first;
        Vec<Dim, T>* const vectors = what.vectors ? into.vectors.data() + first : nullptr;
        const Vec<Dim, T> from = request_.a.points[point];
        const Vec<Dim, T>* const points = request_.b.points.data();
        const int bits = sets_.image_bits;
        const std::uint32_t here = code_of<Dim>({}, bits);
        const auto code = [&](std::size_t k) { return with_images ? found.image[at + k] : here; };
        if (!a_.any_wrapped && !b_.any_wrapped && bits == near_bits) {
            for (std::size_t k = 0; k < count; ++k) {
                const auto& near = request_.vectors.near(code(k));
                to[k] = near.shift;
                if (vectors != nullptr)
                    vectors[k] = request_.vectors.between(from, points[neighbor[k]], near.sum);
            }
        } else {
            for (std::size_t k = 0; k < count; ++k) {
                to[k] =
                    shift_of<Dim>(image_of<Dim>(code(k), bits), a_.periods[point], b_.periods[neighbor[k]]);
                if (vectors != nullptr) vectors[k] = into.vector(request_, point, first + k);
            }
        }
        into.measure(request_, what, point, first, count);
    }

    const Request<Dim, T>& request_;
    PointsInGrid<Dim, T>& sets_;
    const NeighborGrid<Dim, T>& grid_;
    GridPoints<Dim, T>&a_, &b_;
    const NeighborKernels<Dim, T>& kernels_;
    RowTasks<Dim, T>& tasks_;
};

} // namespace neighbors
JOSTLE_NAMESPACE_END
