// SPDX-License-Identifier: MIT
// The input of a NeighborFinder: sets of points and their cutoffs, checked, in the cells of a grid along the
// reciprocal axes of periodic space.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <span>
#include <string>

#include "base/buffer.hpp"
#include "base/number_text.hpp"
#include "jostle/error.hpp"
#include "jostle/neighbors.hpp"
#include "neighbors/kernels/neighbors.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

/// The most periods that a cutoff may span: their numbers fit into the key of a neighbour.
constexpr std::int64_t most_images = 500;

template <int Dim>
using Periods = std::array<std::int32_t, detail::axes<Dim>>;

template <int Dim, class T>
std::string point_text(const char* set, std::size_t i, const Vec<Dim, T>& point)
{
    std::string text = std::string("point ") + set + std::to_string(i) + ", (";
    for (int d = 0; d < Dim; ++d)
        text += (d == 0 ? "" : ", ") + number_text(point[d]);
    return text + ")";
}

/// How errors name a set as a whole: nothing where there is one.
inline std::string set_text(const char* set)
{
    return *set == 0 ? std::string() : std::string(" of ") + *set;
}

[[noreturn]] inline void refuse_search(const std::string& message, std::uint64_t index = Error::no_index)
{
    throw Error(ErrorCode::invalid_argument, message, index);
}

/// An image's number in one word, with `bits` for each axis.
template <int Dim>
std::uint32_t code_of(const Periods<Dim>& image, int bits)
{
    std::uint32_t code = 0;
    for (const std::int32_t periods : image)
        code = code << bits | static_cast<std::uint32_t>(periods + (1 << (bits - 1)));
    return code;
}
template <int Dim>
Periods<Dim> image_of(std::uint32_t code, int bits)
{
    Periods<Dim> image;
    for (std::size_t k = detail::axes<Dim>; k-- > 0; code >>= bits)
        image[k] = static_cast<std::int32_t>(code % (1u << bits)) - (1 << (bits - 1));
    return image;
}
constexpr int any_bits = 10, near_bits = 2; // the second for images next to the cell, as most are
static_assert(most_images + 2 < 1 << (any_bits - 1));

/// The vectors of the definition. A table has the sums of the cell's vectors for images next to it.
template <int Dim, class T>
class ShiftedVectors
{
  public:
    explicit ShiftedVectors(const PeriodicCell<Dim, T>& cell) : cell_(cell)
    {
        for (std::uint32_t code = 0; code < near_codes; ++code) {
            near_[code].shift = image_of<Dim>(code, near_bits);
            near_[code].sum = sum_of(near_[code].shift);
        }
    }

    /// A shift of at most 1 along each axis, by its code of near_bits.
    struct Shifted
    {
        Periods<Dim> shift;
        Vec<Dim, T> sum;
    };
    const Shifted& near(std::uint32_t code) const { return near_[code]; }

    /// `sum` is that of the cell's vectors for the shift.
    static Vec<Dim, T> between(const Vec<Dim, T>& from, const Vec<Dim, T>& to, const Vec<Dim, T>& sum)
    {
        return (to - from) + sum;
    }
    Vec<Dim, T> between(const Vec<Dim, T>& from, const Vec<Dim, T>& to, const Periods<Dim>& shift) const
    {
        bool is_near = true;
        for (const std::int32_t periods : shift)
            is_near &= static_cast<std::uint32_t>(periods) + 1 < 3;
        return between(from, to, is_near ? near_[code_of<Dim>(shift, near_bits)].sum : sum_of(shift));
    }

  private:
    static constexpr std::uint32_t near_codes = 1u << (near_bits * Dim);

    Vec<Dim, T> sum_of(const Periods<Dim>& shift) const
    {
        Vec<Dim, T> sum;
        for (int d = 0; d < Dim; ++d)
            sum[d] = T(-0.0); // changes nothing that it is added to, zeros included
        for (int k = 0; k < Dim; ++k)
            if (cell_.repeats[k])
                sum += cell_.vectors[k] * static_cast<T>(shift[static_cast<std::size_t>(k)]);
        return sum;
    }

    PeriodicCell<Dim, T> cell_;
    Shifted near_[near_codes];
};

/// One set as a call sees it.
template <int Dim, class T>
struct PointSet
{
    std::span<const Vec<Dim, T>> points;
    std::span<const T> radii;
    std::span<const std::uint32_t> types;
    const char* name; ///< in errors
};

/// Where a call's cutoffs come from.
template <class T>
struct CutoffRule
{
    T value;
    std::span<const T> table;
    std::size_t types = 0;
    bool of_radii = false, greater = false; ///< of two radii, instead of their sum
    T greatest = 0;

    T operator()(T radius_a, std::uint32_t type_a, T radius_b, std::uint32_t type_b) const
    {
        if (of_radii) return greater ? std::max(radius_a, radius_b) : radius_a + radius_b;
        return types != 0 ? table[type_a * types + type_b] : value;
    }
    /// The greatest cutoff of points whose radii are at most these.
    T greatest_of(T radius_a, T radius_b) const
    {
        return of_radii ? (*this)(radius_a, 0, radius_b, 0) : greatest;
    }
};

/// what() is what errors call it.
template <class T, class What>
void check_cutoff(T value, const What& what, std::uint64_t index)
{
    if (!(value >= 0 && value <= std::numeric_limits<T>::max()))
        refuse_search(what() + " is " + number_text(value) + "; give a length", index);
}

/// Adds what a set has to the rule, or throws.
template <int Dim, class T>
T checked_radii(const PointSet<Dim, T>& set, const CutoffRule<T>& rule)
{
    const auto lengths = [&](std::size_t size, const char* what) {
        if (size != set.points.size())
            throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(size) + " " + what + " for " +
                                                      std::to_string(set.points.size()) + " points" +
                                                      set_text(set.name) + "; give one for each");
    };
    T greatest = 0;
    if (rule.of_radii) lengths(set.radii.size(), "radii");
    for (std::size_t i = 0; rule.of_radii && i < set.radii.size(); ++i) {
        check_cutoff(
            set.radii[i], [&] { return std::string("the radius of point ") + set.name + std::to_string(i); },
            i);
        greatest = std::max(greatest, set.radii[i]);
    }
    if (rule.types != 0) lengths(set.types.size(), "types");
    for (std::size_t i = 0; rule.types != 0 && i < set.types.size(); ++i)
        if (set.types[i] >= rule.types)
            refuse_search(std::string("point ") + set.name + std::to_string(i) + " is of type " +
                              std::to_string(set.types[i]) + ", and the table has " +
                              std::to_string(rule.types) + " types",
                          i);
    return greatest;
}

template <int Dim, class T>
CutoffRule<T> check_cutoffs(const PointSet<Dim, T>& a, const PointSet<Dim, T>& b,
                            const NeighborCutoff<T>& cutoff)
{
    CutoffRule<T> rule{cutoff.value, cutoff.table};
    rule.greater = cutoff.greater;
    rule.of_radii = !a.radii.empty() || !b.radii.empty();
    while (rule.types * rule.types < cutoff.table.size())
        ++rule.types;
    if (rule.of_radii + (rule.types != 0) + (cutoff.value != 0) > 1)
        refuse_search("of cutoff, radii and table only one may be given");
    if (rule.greater && (rule.types != 0 || cutoff.value != 0))
        refuse_search("of radii the greater one may count, and there are none");
    if (rule.types == 0 && (!a.types.empty() || !b.types.empty()))
        refuse_search("there are types, but no table");
    if (rule.types * rule.types != cutoff.table.size())
        throw Error(ErrorCode::size_mismatch, "a table of " + std::to_string(cutoff.table.size()) +
                                                  " cutoffs isn't square; give k * k for k types");
    check_cutoff(cutoff.value, [] { return std::string("the cutoff"); }, Error::no_index);
    for (std::size_t k = 0; k < cutoff.table.size(); ++k) {
        check_cutoff(cutoff.table[k], [&] { return "cutoff " + std::to_string(k) + " of the table"; }, k);
        const std::size_t mirrored = k % rule.types * rule.types + k / rule.types;
        if (cutoff.table[k] != cutoff.table[mirrored])
            refuse_search("cutoff " + std::to_string(k) + " of the table is " + number_text(cutoff.table[k]) +
                              ", and that of the same types in turn " + number_text(cutoff.table[mirrored]),
                          k);
        rule.greatest = std::max(rule.greatest, cutoff.table[k]);
    }
    const T radius_a = checked_radii(a, rule), radius_b = checked_radii(b, rule);
    rule.greatest = std::max(rule.greatest, rule(radius_a, 0, radius_b, 0));
    const T square = rule.greatest * rule.greatest;
    const bool nobody = a.points.empty() || b.points.empty();
    if (!nobody && !(square >= std::numeric_limits<T>::min() && square <= std::numeric_limits<T>::max()))
        refuse_search("the greatest cutoff is " + number_text(rule.greatest) +
                      "; it must be above 0, and its square within the range of its type");
    return rule;
}

template <class T>
void refuse_second_set(const NeighborCutoff<T>& cutoff)
{
    if (!cutoff.radii_b.empty() || !cutoff.types_b.empty())
        refuse_search("there are radii or types of a second set, and there is one set");
}

template <int Dim, class T>
void check_number(const PointSet<Dim, T>& set)
{
    if (set.points.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(ErrorCode::too_many_objects, std::to_string(set.points.size()) + " points" +
                                                     set_text(set.name) + " are more than 2^32 - 1");
}
template <int Dim, class T>
void check_points(const PointSet<Dim, T>& set)
{
    check_number(set);
    for (std::size_t i = 0; i < set.points.size(); ++i)
        for (int d = 0; d < Dim; ++d) {
            const T x = set.points[i][d];
            if (std::abs(x) <= std::numeric_limits<T>::max() / 8) continue;
            throw Error(x != x ? ErrorCode::nan_coordinate : ErrorCode::invalid_argument,
                        point_text(set.name, i, set.points[i]) +
                            (x != x
                                 ? " is NaN; every coordinate must be a number"
                                 : " is too far away; coordinates reach to an eighth of their type's range"),
                        i);
        }
}

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

} // namespace neighbors
JOSTLE_NAMESPACE_END
