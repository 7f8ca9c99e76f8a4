// SPDX-License-Identifier: MIT
// Sets of points in the cells of a grid along the reciprocal axes of periodic space.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <span>

#include "base/buffer.hpp"
#include "neighbors/kernels/neighbors.hpp"
#include "neighbors/request.hpp"
#include "neighbors/shifts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

/// Points of similar cutoffs, and their cells, which are about as large as these.
template <int Dim, class T>
struct GridLevel
{
    T radius = 0;           ///< the greatest; 0 where cutoffs aren't of radii
    std::size_t points = 0; ///< of both sets
    double cutoff = 0;      ///< the greatest of two of its points
    double edge = 0;        ///< of a cell, at least, in cutoffs
    std::size_t begin = 0;  ///< the number of its first cell
    std::int64_t cells[detail::axes<Dim>];
    double scale[detail::axes<Dim>]; ///< cells per fraction
};

/// How space is divided into cells of a grid: along each axis k a point has the fraction dot(reciprocal_k, x
/// - origin), in periods if the axis repeats, else in units of length along directions at right angles to
/// those that do. All of it is in double, with bounds for what rounding can do. Radii that differ by a factor
/// of 2 or more have levels, each with cells of its own, as in a hierarchical grid.
template <int Dim, class T>
struct NeighborGrid
{
    using Wide = Vec<Dim, double>;
    static constexpr double far = sizeof(T) == 4 ? 32768 : 1073741824; // periods
    // The points of a cell share their candidates, which are collected once. So a cell should have several
    // points; but a larger cell has more candidates that are too far away.
    static constexpr double wanted_in_cell = 24;
    // So few points, of which there are no images, are tested sooner than divided.
    static constexpr std::size_t few_points = 128;
    static constexpr double least_edge = 1 + 1e-9; // of cutoffs: then the next cells are enough
    static constexpr int most_levels = 24;         // the last has all smaller ones

    bool repeats[detail::axes<Dim>];
    Wide vectors[detail::axes<Dim>], reciprocal[detail::axes<Dim>], origin;
    double lengths[detail::axes<Dim>], low[detail::axes<Dim>], high[detail::axes<Dim>];
    double thickness = 1; ///< the volume that unit vectors along the axes span
    double reciprocal_length[detail::axes<Dim>];
    double margin[detail::axes<Dim>]; ///< by how much fractions may err
    GridLevel<Dim, T> levels[most_levels];
    int level_count = 0; ///< from the greatest radii to the smallest
    std::size_t all_cells = 0;
    double rounding = 0;  ///< by how much a distance of the definition may differ from the true one
    double slack = 0;     ///< by how much the test of wrapped points may err
    T sure = -1;          ///< the square within which it decides; nothing is below 0
    T slack_of_radii = 0; ///< the same where each pair has a cutoff of its own, computed in T

    static Wide wide(const Vec<Dim, T>& v)
    {
        Wide out;
        for (int d = 0; d < Dim; ++d)
            out[d] = static_cast<double>(v[d]);
        return out;
    }

    void set_axes(const PeriodicCell<Dim, T>& cell)
    {
        int count = 0;
        Wide along[detail::axes<Dim>], known[detail::axes<Dim>];
        for (int k = 0; k < Dim; ++k) {
            repeats[k] = cell.repeats[k];
            vectors[k] = {};
            lengths[k] = 1;
            if (!repeats[k]) continue;
            vectors[k] = wide(cell.vectors[k]);
            along[k] = normalized(vectors[k]);
            lengths[k] = 0;
            for (int d = 0; d < Dim; ++d)
                lengths[k] = std::hypot(lengths[k], vectors[k][d]);
            if (!(lengths[k] > 0 && lengths[k] <= static_cast<double>(std::numeric_limits<T>::max()) / 8))
                refuse_search("vector " + std::to_string(k) + " of the cell has length " +
                              number_text(lengths[k]) + "; an axis that repeats needs one with a length");
            known[count++] = along[k];
        }
        for (int k = 0; k < Dim; ++k) // what doesn't repeat lies at right angles to all before
            if (!repeats[k]) {
                along[k] = perpendicular(known, count, k);
                known[count++] = along[k];
            }
        double volume;
        if constexpr (Dim == 3) {
            volume = dot(along[0], cross(along[1], along[2]));
        } else {
            volume = cross(along[0], along[1]);
        }
        thickness = std::abs(volume);
        if (!(thickness > 1e-6))
            refuse_search("the cell is flat: vectors of length 1 along its axes span " +
                          number_text(thickness) + "; axes that repeat must point in different directions");
        if constexpr (Dim == 3) {
            for (int k = 0; k < 3; ++k)
                reciprocal[k] = cross(along[(k + 1) % 3], along[(k + 2) % 3]) / volume / lengths[k];
        } else {
            reciprocal[0] = Wide{along[1][1], -along[1][0]} / volume / lengths[0];
            reciprocal[1] = Wide{-along[0][1], along[0][0]} / volume / lengths[1];
        }
    }
    /// A unit vector at right angles to the first `count`; if there are none, along axis k.
    static Wide perpendicular(const Wide* known, int count, int k)
    {
        Wide unit{};
        if (count == 0) {
            unit[k] = 1;
            return unit;
        }
        if constexpr (Dim == 3) {
            if (count == 2) return normalized(cross(known[0], known[1]));
            int least = 0;
            for (int d = 1; d < 3; ++d)
                if (std::abs(known[0][d]) < std::abs(known[0][least])) least = d;
            unit[least] = 1;
            return normalized(cross(known[0], unit));
        } else {
            return {-known[0][1], known[0][0]};
        }
    }

    double fraction(const Vec<Dim, T>& point, int k) const
    {
        return dot(reciprocal[k], wide(point) - origin);
    }

    /// The square of the distance up to which the test of wrapped points must accept, so that none within the
    /// cutoff is lost. It grows with the cutoff.
    T near_of(double cutoff) const
    {
        constexpr double more = 1 + 16 * static_cast<double>(std::numeric_limits<T>::epsilon());
        const double passing = (cutoff + slack) * more, square = passing * passing * more;
        return square < static_cast<double>(std::numeric_limits<T>::max())
                   ? static_cast<T>(square)
                   : std::numeric_limits<T>::infinity();
    }

    /// The most by which points within a cutoff of each other differ along axis k.
    double reach(double cutoff, int k) const
    {
        return ((cutoff + rounding) * reciprocal_length[k] + margin[k]) * (1 + 1e-12);
    }

    int level_of(T radius) const
    {
        int level = level_count - 1;
        while (level > 0 && radius > levels[level].radius)
            --level;
        return level;
    }
    const GridLevel<Dim, T>& level_of_cell(std::size_t cell) const
    {
        int level = level_count - 1;
        while (cell < levels[level].begin)
            --level;
        return levels[level];
    }

    /// Fits the grid to points, of which each set has some. Each looks `more` further than its cutoff.
    void fit(std::span<const PointSet<Dim, T>* const> sets, const CutoffRule<T>& rule, T more)
    {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        double spread = 0;
        for (int d = 0; d < Dim; ++d) {
            double least = infinity, most = -infinity;
            for (const auto* set : sets)
                for (const Vec<Dim, T>& point : set->points) {
                    least = std::min(least, static_cast<double>(point[d]));
                    most = std::max(most, static_cast<double>(point[d]));
                }
            origin[d] = least;
            spread += most - least;
        }
        for (int k = 0; k < Dim; ++k) {
            low[k] = infinity, high[k] = -infinity;
            for (const auto* set : sets)
                for (std::size_t i = 0; i < set->points.size(); ++i) {
                    const double f = fraction(set->points[i], k);
                    if (repeats[k] && !(std::abs(f) <= far))
                        refuse_search(point_text(set->name, i, set->points[i]) + " lies " + number_text(f) +
                                          " periods along axis " + std::to_string(k) +
                                          " from the lowest coordinates; at most " + number_text(far) +
                                          " are allowed, wrap the points",
                                      i);
                    low[k] = std::min(low[k], f);
                    high[k] = std::max(high[k], f);
                }
        }
        const double greatest = static_cast<double>(rule.greatest + more);
        bound(greatest, spread);
        tell_levels(sets, rule, more);
        for (int level = 0; level < level_count; ++level) {
            GridLevel<Dim, T>& each = levels[level];
            const T cutoff = rule.greatest_of(each.radius, each.radius) + more;
            each.cutoff = std::max(static_cast<double>(cutoff), std::ldexp(greatest, 1 - most_levels));
            double per_cutoff = static_cast<double>(each.points);
            for (int k = 0; k < Dim; ++k)
                per_cutoff *= std::min(1.0, reach(each.cutoff, k) / (repeats[k] ? 1 : high[k] - low[k]));
            each.edge = std::clamp(std::pow(wanted_in_cell / per_cutoff, 1.0 / Dim), least_edge, 8.0);
            const bool open = std::none_of(repeats, repeats + Dim, [](bool is) { return is; });
            if (open && level_count == 1 && each.points <= few_points) each.edge = 8;
        }
        divide();
    }

    /// Makes cells smaller where points crowd together. Returns whether it did. in_cell(c) is the number of
    /// points in cell c.
    template <class InCell>
    bool refine(const InCell& in_cell)
    {
        bool any = false;
        for (int level = 0; level < level_count; ++level) {
            GridLevel<Dim, T>& each = levels[level];
            if (each.edge <= least_edge) continue;
            const std::size_t end = level + 1 < level_count ? levels[level + 1].begin : all_cells;
            double seen = 0; // by all points in their own cells
            for (std::size_t c = each.begin; c < end; ++c)
                seen += in_cell(c) * in_cell(c);
            if (seen <= 8 * wanted_in_cell * static_cast<double>(each.points)) continue;
            each.edge = std::max(each.edge / 2, least_edge);
            any = true;
        }
        if (any) divide();
        return any;
    }

  private:
    /// Bounds of rounding errors.
    void bound(double cutoff, double spread)
    {
        const double eps = static_cast<double>(std::numeric_limits<T>::epsilon());
        double shifted = 0, wrapped = spread;
        for (int k = 0; k < Dim; ++k) {
            reciprocal_length[k] = length(reciprocal[k]);
            if (repeats[k]) shifted += (high[k] - low[k] + cutoff * reciprocal_length[k] + 2) * lengths[k];
        }
        const double least = static_cast<double>(std::numeric_limits<T>::denorm_min()); // of a square
        rounding = 16 * eps * (cutoff + shifted) + 8 * std::sqrt(least);
        for (int k = 0; k < Dim; ++k) {
            const double error = std::ldexp(1, -46) / (thickness * thickness);
            margin[k] = 2 * error * (spread / lengths[k] + (repeats[k] ? 1 : 0));
            if (!repeats[k]) continue;
            const double periods = reach(cutoff, k);
            if (!(periods < static_cast<double>(most_images)))
                refuse_search("the cutoff reaches over " + number_text(periods) + " periods along axis " +
                              std::to_string(k) + ", and it may over " + std::to_string(most_images) +
                              "; put several periods into one cell");
            wrapped += (high[k] - low[k] + periods + 2) * lengths[k];
        }
        const double rest = 16 * eps * (wrapped + cutoff);
        slack = rounding + rest;
        const double deciding = (cutoff - slack) * (1 - 16 * eps);
        sure = deciding > 0 ? static_cast<T>(deciding * deciding * (1 - 16 * eps)) : T(-1);
        slack_of_radii = static_cast<T>(slack + 16 * eps * cutoff); // their sums are rounded
    }

    /// A level has the radii whose cutoffs are between half of its greatest cutoff and that.
    void tell_levels(std::span<const PointSet<Dim, T>* const> sets, const CutoffRule<T>& rule, T more)
    {
        GridLevel<Dim, T> by_halves[most_levels] = {};
        const auto cutoff = [&](T radius) { return static_cast<double>(rule(radius, 0, radius, 0) + more); };
        T greatest = 0;
        for (const auto* set : sets)
            for (const T radius : set->radii)
                greatest = std::max(greatest, radius);
        const double most = cutoff(greatest);
        for (const auto* set : sets) {
            if (!rule.of_radii) by_halves[0].points += set->points.size();
            for (std::size_t i = 0; rule.of_radii && i < set->points.size(); ++i) {
                const T radius = set->radii[i];
                const double part = most / cutoff(radius); // infinite for 0
                const int halvings = part < std::ldexp(1, most_levels) ? std::ilogb(part) : most_levels;
                GridLevel<Dim, T>& level = by_halves[std::min(halvings, most_levels - 1)];
                level.radius = std::max(level.radius, radius);
                ++level.points;
            }
        }
        level_count = 0;
        for (const GridLevel<Dim, T>& level : by_halves)
            if (level.points != 0) levels[level_count++] = level;
    }

    void divide()
    {
        all_cells = 0;
        for (int level = 0; level < level_count; ++level) {
            levels[level].begin = all_cells;
            all_cells += divide(levels[level]);
        }
    }
    /// Returns how many cells there are.
    std::size_t divide(GridLevel<Dim, T>& level)
    {
        double size[detail::axes<Dim>], all = 1;
        double(&scale)[detail::axes<Dim>] = level.scale;
        for (int k = 0; k < Dim; ++k) {
            scale[k] = 1 / (level.edge * reach(level.cutoff, k));
            size[k] = repeats[k] ? std::max(1.0, std::floor(scale[k]))
                                 : std::min(std::floor((high[k] - low[k]) * scale[k]) + 1, 1e18);
            all *= size[k];
        }
        const double most =
            std::min(std::max(64.0, 4 * static_cast<double>(level.points)), std::ldexp(1, 31));
        while (all > most) { // sparse: no more cells than that
            int longest = 0;
            for (int k = 1; k < Dim; ++k)
                if (size[k] > size[longest]) longest = k;
            scale[longest] /= 2;
            size[longest] = std::max(1.0, std::floor(size[longest] / 2));
            all = 1;
            for (int k = 0; k < Dim; ++k)
                all *= size[k];
        }
        for (int k = 0; k < Dim; ++k) {
            level.cells[k] = static_cast<std::int64_t>(size[k]);
            if (repeats[k]) scale[k] = size[k];
        }
        return static_cast<std::size_t>(all);
    }
};

/// A point where the grid has it.
template <int Dim, class T>
struct GridPoint
{
    Vec<Dim, T> at;
    T radius;
    std::uint32_t type, index;
    Periods<Dim> wrapped; ///< by how many periods it lies outside of the cell
};

/// Points in the order of the grid's cells, and where each cell's begin.
template <int Dim, class T>
struct GridPoints
{
    explicit GridPoints(std::pmr::memory_resource* memory)
        : points(memory),
          cell(memory),
          starts(memory),
          index(memory),
          periods(memory),
          x(memory),
          y(memory),
          z(memory),
          radius(memory)
    {
    }

    Buffer<GridPoint<Dim, T>> points;
    Buffer<std::uint32_t> cell, starts;
    Buffer<std::uint32_t> index;  ///< GridPoint::index, side by side
    Buffer<Periods<Dim>> periods; ///< GridPoint::wrapped, by index
    Buffer<T> x, y, z;            ///< the points, wrapped, and 0 as padding
    Buffer<T> radius;             ///< GridPoint::radius; nothing where cutoffs aren't of radii
    std::size_t count = 0;
    bool any_wrapped = false;

    T* axis(int d) { return (d == 0 ? x : d == 1 ? y : z).data(); }

    double in_cell(std::size_t c) const { return static_cast<double>(starts.data()[c + 2]); }

    /// Tells in which cell each point is, and counts.
    void number(const PointSet<Dim, T>& set, const NeighborGrid<Dim, T>& grid)
    {
        const std::size_t n = set.points.size();
        const std::size_t cells = grid.all_cells;
        points.reserve(n), cell.reserve(n), index.reserve(n), periods.reserve(n);
        for (int d = 0; d < Dim; ++d) {
            (d == 0 ? x : d == 1 ? y : z).reserve(n + neighbor_padding);
            std::fill_n(axis(d) + n, neighbor_padding, T(0));
        }
        if (!set.radii.empty()) radius.reserve(n);
        count = n;
        any_wrapped = false;
        starts.reserve(cells + 2);
        std::fill_n(starts.data(), cells + 2, 0u);
        for (std::size_t i = 0; i < n; ++i) {
            const GridLevel<Dim, T>& level = grid.levels[set.radii.empty() ? 0 : grid.level_of(set.radii[i])];
            std::int64_t number = 0;
            for (int k = 0; k < Dim; ++k) {
                double f = grid.fraction(set.points[i], k);
                std::int32_t& whole = periods[i][static_cast<std::size_t>(k)];
                whole = 0;
                if (grid.repeats[k]) {
                    const double floor = std::floor(f);
                    whole = static_cast<std::int32_t>(floor);
                    any_wrapped |= whole != 0;
                    f -= floor;
                } else {
                    f -= grid.low[k];
                }
                const double last = static_cast<double>(level.cells[k] - 1);
                number = number * level.cells[k] +
                         static_cast<std::int64_t>(std::clamp(f * level.scale[k], 0.0, last));
            }
            cell[i] = static_cast<std::uint32_t>(level.begin + static_cast<std::size_t>(number));
            ++starts[std::size_t{cell[i]} + 2];
        }
    }
    /// Puts the points into their cells.
    void fill(const PointSet<Dim, T>& set, const NeighborGrid<Dim, T>& grid)
    {
        const std::size_t n = count;
        for (std::size_t c = 2; c < grid.all_cells + 2; ++c)
            starts[c] += starts[c - 1];
        for (std::size_t i = 0; i < n; ++i) { // starts[c + 1] goes from where c begins to where it ends
            const std::size_t to = starts[std::size_t{cell[i]} + 1]++;
            index[to] = static_cast<std::uint32_t>(i);
            points[to] = {set.points[i], set.radii.empty() ? T(0) : set.radii[i],
                          set.types.empty() ? 0 : set.types[i], static_cast<std::uint32_t>(i), periods[i]};
            if (!set.radii.empty()) radius[to] = set.radii[i];
            Vec<Dim, double> at = grid.wide(set.points[i]) - grid.origin;
            for (int k = 0; k < Dim; ++k)
                at -= grid.vectors[k] * static_cast<double>(periods[i][static_cast<std::size_t>(k)]);
            for (int d = 0; d < Dim; ++d)
                axis(d)[to] = static_cast<T>(at[d]);
        }
    }
    void release()
    {
        points.release(), cell.release(), starts.release(), index.release(), periods.release();
        x.release(), y.release(), z.release(), radius.release();
    }
};

/// A call's points in the cells of one grid.
template <int Dim, Coordinate T>
struct PointsInGrid
{
    explicit PointsInGrid(std::pmr::memory_resource* memory) : a(memory), second(memory) {}

    NeighborGrid<Dim, T> grid;
    GridPoints<Dim, T> a, second; ///< one set has the first alone
    bool two_sets = false;
    int image_bits = any_bits; ///< of codes

    GridPoints<Dim, T>& b() { return two_sets ? second : a; }

    /// A grid for the call, or an Error.
    static NeighborGrid<Dim, T> fitted_grid(const Request<Dim, T>& request)
    {
        NeighborGrid<Dim, T> fitted;
        fitted.set_axes(request.cell);
        const PointSet<Dim, T>* const sets[] = {&request.a, &request.b};
        if (request.any_points())
            fitted.fit(std::span(sets).first(request.two_sets ? 2 : 1), request.rule,
                       static_cast<T>(request.options.skin));
        return fitted;
    }

    /// Puts the points into a grid that fits them, if each set has some.
    void fill(const Request<Dim, T>& request, const NeighborGrid<Dim, T>& fitted)
    {
        grid = fitted;
        two_sets = request.two_sets;
        if (!request.any_points()) return;
        image_bits = near_bits;
        for (int k = 0; k < Dim; ++k)
            if (grid.repeats[k] && !(grid.reach(static_cast<double>(request.reach()), k) < 1))
                image_bits = any_bits;
        const auto in_cell = [&](std::size_t c) { return a.in_cell(c) + (two_sets ? second.in_cell(c) : 0); };
        do {
            a.number(request.a, grid);
            if (two_sets) second.number(request.b, grid);
        } while (grid.refine(in_cell));
        a.fill(request.a, grid);
        if (two_sets) second.fill(request.b, grid);
    }

    void release() { a.release(), second.release(); }
};

} // namespace neighbors
JOSTLE_NAMESPACE_END
