// SPDX-License-Identifier: MIT
// The points that the rows of one cell may have as neighbours, collected once for all of these rows, in the
// order in which rows list them.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <new>
#include <vector>

#include "base/buffer.hpp"
#include "base/radix.hpp"
#include "neighbors/grid.hpp"
#include "neighbors/kernels/neighbors.hpp"
#include "neighbors/request.hpp"
#include "neighbors/shifts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

constexpr std::size_t rows_per_block = 128; ///< that share candidates, at most

/// Points of the grid that follow each other in memory, all shifted in the same way, and the square of the
/// distance within which they may be neighbours.
template <int Dim, Coordinate T>
struct ImageRun
{
    std::size_t begin, end;
    Vec<Dim, T> by;
    T near;
    std::uint32_t code; ///< of the image
};

/// On each level, a box of cells: those with images of b's points that points of this cell with radii of at
/// most `radius` can reach.
template <int Dim, Coordinate T>
void list_runs(const Request<Dim, T>& request, PointsInGrid<Dim, T>& sets, std::uint32_t number, T radius,
               std::pmr::vector<ImageRun<Dim, T>>& runs)
{
    const NeighborGrid<Dim, T>& grid = sets.grid;
    GridPoints<Dim, T>& b = sets.b();
    const GridLevel<Dim, T>& own = grid.level_of_cell(number);
    double low[detail::axes<Dim>], high[detail::axes<Dim>]; // of the cell
    std::size_t rest = number - own.begin;
    for (int k = Dim - 1; k >= 0; --k) {
        const auto cells = static_cast<std::size_t>(own.cells[k]);
        const double at = static_cast<double>(rest % cells);
        rest /= cells;
        low[k] = at / own.scale[k];
        high[k] = (at + 1) / own.scale[k];
        if (!grid.repeats[k] && at + 1 == static_cast<double>(cells)) // and all behind it
            high[k] = std::numeric_limits<double>::infinity();
    }
    runs.clear();
    for (int level = 0; level < grid.level_count; ++level) {
        const GridLevel<Dim, T>& other = grid.levels[level];
        const double cutoff = static_cast<double>(request.reach_of(radius, other.radius));
        const T near = grid.near_of(cutoff);
        std::int64_t first[detail::axes<Dim>], last[detail::axes<Dim>], within[detail::axes<Dim>];
        for (int k = 0; k < Dim; ++k) {
            const double reach = grid.reach(cutoff, k);
            double from = std::floor((low[k] - reach) * other.scale[k]),
                   to = std::floor((high[k] + reach) * other.scale[k]);
            if (!grid.repeats[k]) {
                const double end = static_cast<double>(other.cells[k] - 1);
                from = std::clamp(from, 0.0, end), to = std::clamp(to, 0.0, end);
            }
            first[k] = static_cast<std::int64_t>(from), last[k] = static_cast<std::int64_t>(to);
        }
        Periods<Dim> image{};
        const auto along = [&](const auto& self, int k) -> void {
            const std::int64_t cells = other.cells[k];
            for (std::int64_t c = first[k]; c <= last[k]; ++c) {
                within[k] = ((c % cells) + cells) % cells;
                const std::int64_t periods = (c - within[k]) / cells;
                image[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(periods);
                if (k < Dim - 1) {
                    self(self, k + 1);
                    continue;
                }
                const std::int64_t end = std::min(last[k], (periods + 1) * cells - 1);
                std::int64_t cell = 0;
                for (int d = 0; d < Dim; ++d)
                    cell = cell * other.cells[d] + within[d];
                const std::size_t at = other.begin + static_cast<std::size_t>(cell), begin = b.starts[at],
                                  stop = b.starts[at + static_cast<std::size_t>(end - c) + 1];
                c = end;
                if (begin == stop) continue;
                Vec<Dim, double> by{};
                for (int d = 0; d < Dim; ++d)
                    by += grid.vectors[d] * static_cast<double>(image[static_cast<std::size_t>(d)]);
                runs.push_back({begin, stop, Vec<Dim, T>(by), near, code_of<Dim>(image, sets.image_bits)});
            }
        };
        along(along, 0);
    }
}

/// How many runs there are for any cell, at most.
template <int Dim, Coordinate T>
double most_runs(const Request<Dim, T>& request, const NeighborGrid<Dim, T>& grid)
{
    double most = 0;
    for (int level = 0; level < grid.level_count; ++level) {
        double all = 0;
        for (int other = 0; other < grid.level_count; ++other) {
            double runs = 1;
            for (int k = 0; k < Dim; ++k) {
                const double reach = grid.reach(static_cast<double>(request.reach_of(
                                                    grid.levels[level].radius, grid.levels[other].radius)),
                                                k);
                const double across = 2 * reach + 1 / grid.levels[level].scale[k];
                runs *= (k < Dim - 1       ? across * grid.levels[other].scale[k]
                         : grid.repeats[k] ? across
                                           : 0) +
                        2;
            }
            all += runs;
        }
        most = std::max(most, all);
    }
    return most;
}

/// A task's working memory.
template <int Dim, Coordinate T>
class Candidates
{
  public:
    explicit Candidates(std::pmr::memory_resource* memory)
        : runs_(memory),
          selected_(memory),
          run_(memory),
          sorted_(memory),
          spare_(memory),
          place_(memory),
          index_(memory),
          image_(memory),
          x_(memory),
          y_(memory),
          z_(memory),
          radius_(memory),
          unsure_(memory)
    {
    }

    void reserve_runs(std::size_t runs) { runs_.reserve(runs); }
    /// For how many candidates there is room.
    std::size_t room() const { return room_; }
    void reserve(std::size_t count)
    {
        room_ = std::max(room_, count);
        count = room_ + neighbor_padding;
        selected_.reserve(count), run_.reserve(count), sorted_.reserve(count), spare_.reserve(count);
        place_.reserve(count), index_.reserve(count), image_.reserve(count);
        x_.reserve(count), y_.reserve(count), z_.reserve(count), radius_.reserve(count);
        unsure_.reserve(count);
    }

    /// Collects them for the points of a from `begin` to `end` - 1, at most rows_per_block in one cell.
    NearbyColumns<T> collect(const Request<Dim, T>& request, PointsInGrid<Dim, T>& sets,
                             const NeighborKernels<Dim, T>& kernels, std::size_t begin, std::size_t end,
                             bool with_images)
    {
        GridPoints<Dim, T>&a = sets.a, &b = sets.b();
        Extent<Dim, T> box;
        T radius = 0; // the greatest
        for (std::size_t place = begin; place < end; ++place)
            radius = std::max(radius, a.points[place].radius);
        for (int d = 0; d < Dim; ++d) {
            const auto [lo, hi] = std::minmax_element(a.axis(d) + begin, a.axis(d) + end);
            box.lo[d] = *lo, box.hi[d] = *hi;
        }
        list_runs(request, sets, a.cell[a.index[begin]], radius, runs_);
        std::size_t most = 0;
        for (const ImageRun<Dim, T>& run : runs_)
            most += run.end - run.begin;
        if (most > std::numeric_limits<std::uint32_t>::max() / 2) throw std::bad_alloc();
        reserve(most);
        std::size_t count = 0;
        const T* const axes[3] = {b.x.data(), b.y.data(), b.z.data()};
        std::uint64_t* sorted = sorted_.data();
        for (const ImageRun<Dim, T>& run : runs_) {
            const std::size_t before = count;
            std::uint32_t* const selected = selected_.data();
            count += kernels.select(axes, run.begin, run.end, run.by, box, run.near, selected + count);
            std::fill(run_.data() + before, run_.data() + count,
                      static_cast<std::uint32_t>(&run - runs_.data()));
            for (std::size_t k = before; k < count; ++k)
                sorted[k] = std::uint64_t{b.index[selected[k]]} << 32 | k;
        }
        // Images of one point keep their order, which is that of their shifts.
        const auto bits = static_cast<int>(std::bit_width(b.count - 1)), passes = (bits + 7) / 8;
        sorted = radix_sort<8, 2>(
            sorted, spare_.data(), static_cast<std::uint32_t>(count), [](std::uint64_t v) { return v; },
            ((std::uint64_t{1} << bits) - 1) << 32, std::max(1, (bits + passes - 1) / std::max(passes, 1)));
        const std::uint32_t here = code_of<Dim>({}, sets.image_bits);
        for (std::size_t k = 0; k < count; ++k) {
            const auto chosen = static_cast<std::uint32_t>(sorted[k]);
            const std::uint32_t place = selected_[chosen];
            const ImageRun<Dim, T>& run = runs_[run_[chosen]];
            index_[k] = static_cast<std::uint32_t>(sorted[k] >> 32);
            place_[k] = place;
            for (int d = 0; d < Dim; ++d)
                axis(d)[k] = axes[d][place] + run.by[d];
            image_[k] = run.code;
            if (request.rule.of_radii) radius_[k] = b.radius[place];
            if (!request.two_sets && place - begin < end - begin && run.code == here)
                itself_[place - begin] = static_cast<std::uint32_t>(k);
        }
        for (int d = 0; d < Dim; ++d)
            std::fill_n(axis(d) + count, neighbor_padding, std::numeric_limits<T>::quiet_NaN());
        if (request.rule.of_radii) std::fill_n(radius_.data() + count, neighbor_padding, T(0));
        return {{x_.data(), y_.data(), z_.data()},
                index_.data(),
                with_images ? image_.data() : nullptr,
                request.rule.of_radii ? radius_.data() : nullptr,
                count};
    }

    /// Which candidate the k-th of these points is itself.
    std::uint32_t itself(std::size_t k) const { return itself_[k]; }
    /// Where b has the k-th candidate.
    std::uint32_t place(std::uint32_t k) { return place_[k]; }
    std::uint32_t image(std::uint32_t k) { return image_[k]; }
    /// For as many as there are.
    UnsureNeighbor* unsure() { return unsure_.data(); }

  private:
    T* axis(int d) { return (d == 0 ? x_ : d == 1 ? y_ : z_).data(); }

    std::pmr::vector<ImageRun<Dim, T>> runs_;
    Buffer<std::uint32_t> selected_, run_; ///< places in the grid, in the order of runs, and which run
    Buffer<std::uint64_t> sorted_, spare_; ///< index, and which of the selected
    // Sorted by index, then by image:
    Buffer<std::uint32_t> place_, index_, image_;
    Buffer<T> x_, y_, z_, radius_;
    Buffer<UnsureNeighbor> unsure_;
    std::array<std::uint32_t, rows_per_block> itself_{};
    std::size_t room_ = 0;
};

} // namespace neighbors
JOSTLE_NAMESPACE_END
