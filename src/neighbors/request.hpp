// SPDX-License-Identifier: MIT
// What a call of a NeighborFinder wants: sets of points, their cutoffs and the cell, checked.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "base/number_text.hpp"
#include "jostle/error.hpp"
#include "jostle/neighbors.hpp"
#include "neighbors/shifts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

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

/// A call, checked.
template <int Dim, Coordinate T>
struct Request
{
    PointSet<Dim, T> a, b;
    bool two_sets;
    CutoffRule<T> rule;
    PeriodicCell<Dim, T> cell;
    NeighborOptions options;
    ShiftedVectors<Dim, T> vectors;

    /// How far to look.
    T reach() const { return rule.greatest + static_cast<T>(options.skin); }
    T reach_of(T radius, T other) const
    {
        return rule.greatest_of(radius, other) + static_cast<T>(options.skin);
    }
    /// Whether there may be any neighbours.
    bool any_points() const { return !a.points.empty() && !b.points.empty(); }
};

template <int Dim, Coordinate T>
Request<Dim, T> checked_request(const PointSet<Dim, T>& a, const PointSet<Dim, T>& b, bool two_sets,
                                const NeighborCutoff<T>& cutoff, const PeriodicCell<Dim, T>& cell,
                                const NeighborOptions& what)
{
    if (!(what.skin >= 0 && what.skin <= static_cast<double>(std::numeric_limits<T>::max())))
        refuse_search("the skin is " + number_text(what.skin) + "; give a length, or 0");
    if (two_sets && what.half)
        refuse_search("half lists are for one set: of two sets each pair comes once already");
    check_points(a);
    if (two_sets) check_points(b);
    const Request<Dim, T> request{
        a, b, two_sets, check_cutoffs(a, b, cutoff), cell, what, ShiftedVectors<Dim, T>(cell)};
    const T most = request.reach();
    if (!(most * most <= std::numeric_limits<T>::max()))
        refuse_search("the skin is " + number_text(what.skin) + ": its sum with the cutoff is too great");
    return request;
}

} // namespace neighbors
JOSTLE_NAMESPACE_END
