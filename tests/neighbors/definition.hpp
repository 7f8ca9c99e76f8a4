// SPDX-License-Identifier: MIT
// Neighbour lists by their definition: every point against every other, by every shift.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/neighbors.hpp"

namespace neighbor_tests {

using jostle::NeighborCutoff;
using jostle::NeighborFinder;
using jostle::NeighborList;
using jostle::NeighborOptions;
using jostle::PeriodicCell;
using jostle::Vec;

template <int Dim>
using Shift = std::array<std::int32_t, static_cast<std::size_t>(Dim)>;

/// A call's arguments.
template <int Dim, class T>
struct System
{
    std::vector<Vec<Dim, T>> a, b;
    bool two_sets = false;
    T cutoff = 0;
    std::vector<T> radii_a, radii_b, table;
    bool greater = false;
    std::vector<std::uint32_t> types_a, types_b;
    PeriodicCell<Dim, T> cell;

    NeighborCutoff<T> cutoffs() const
    {
        NeighborCutoff<T> all = cutoff;
        all.radii = radii_a, all.radii_b = radii_b, all.types = types_a, all.types_b = types_b;
        all.table = table, all.greater = greater;
        return all;
    }
    const NeighborList<Dim, T>& find(NeighborFinder<Dim, T>& finder,
                                     const NeighborOptions& options = {}) const
    {
        return two_sets ? finder.find(a, b, cutoffs(), cell, options)
                        : finder.find(a, cutoffs(), cell, options);
    }
};

template <int Dim, class T>
Vec<Dim, T> vector_by_definition(const System<Dim, T>& system, const Vec<Dim, T>& from, const Vec<Dim, T>& to,
                                 const Shift<Dim>& shift)
{
    Vec<Dim, T> out;
    for (int d = 0; d < Dim; ++d) {
        volatile T apart = to[d] - from[d], sum = 0;
        bool any = false;
        for (int k = 0; k < Dim; ++k)
            if (system.cell.repeats[k]) {
                volatile T term =
                    static_cast<T>(shift[static_cast<std::size_t>(k)]) * system.cell.vectors[k][d];
                if (any)
                    sum = sum + term;
                else
                    sum = term;
                any = true;
            }
        if (any) apart = apart + sum;
        out[d] = apart;
    }
    return out;
}

template <int Dim, class T>
T square_by_definition(const Vec<Dim, T>& v)
{
    volatile T sum = v[0] * v[0];
    for (int d = 1; d < Dim; ++d) {
        volatile T term = v[d] * v[d];
        sum = sum + term;
    }
    return sum;
}

template <int Dim, class T>
T cutoff_by_definition(const System<Dim, T>& system, std::size_t i, std::size_t j)
{
    const bool two = system.two_sets;
    if (!system.radii_a.empty()) {
        const T a = system.radii_a[i], b = (two ? system.radii_b : system.radii_a)[j];
        return !system.greater ? a + b : a < b ? b : a;
    }
    if (system.table.empty()) return system.cutoff;
    const auto types = static_cast<std::size_t>(std::lround(std::sqrt(double(system.table.size()))));
    return system.table[system.types_a[i] * types + (two ? system.types_b : system.types_a)[j]];
}

/// How many periods along axis k any two points can be apart and still be neighbours, with room: by Cramer's
/// rule, for the axes that repeat and, where others don't, vectors at right angles to them.
template <int Dim, class T>
Shift<Dim> most_periods(const System<Dim, T>& system)
{
    using Real = long double;
    Real cutoff = 0, spread = 0;
    for (std::size_t i = 0; i < system.a.size(); ++i)
        for (std::size_t j = 0; j < (system.two_sets ? system.b : system.a).size(); ++j) {
            cutoff = std::max<Real>(cutoff, cutoff_by_definition(system, i, j));
            const auto& other = (system.two_sets ? system.b : system.a)[j];
            Real square = 0;
            for (int d = 0; d < Dim; ++d)
                square += (Real(other[d]) - system.a[i][d]) * (Real(other[d]) - system.a[i][d]);
            spread = std::max(spread, std::sqrt(square));
        }
    Shift<Dim> most{};
    for (int k = 0; k < Dim; ++k) {
        if (!system.cell.repeats[k]) continue;
        // The part of vector k at right angles to the other vectors that repeat.
        std::vector<std::array<Real, 3>> base;
        std::array<Real, 3> own{};
        for (int pass = 0; pass < 2; ++pass)
            for (int other = 0; other < Dim; ++other) {
                if (!system.cell.repeats[other] || (other == k) != (pass == 1)) continue;
                std::array<Real, 3> v{};
                for (int d = 0; d < Dim; ++d)
                    v[static_cast<std::size_t>(d)] = system.cell.vectors[other][d];
                for (int again = 0; again < 2; ++again)
                    for (const auto& unit : base) {
                        const Real along = v[0] * unit[0] + v[1] * unit[1] + v[2] * unit[2];
                        for (std::size_t d = 0; d < 3; ++d)
                            v[d] -= along * unit[d];
                    }
                own = v;
                const Real length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
                for (Real& each : v)
                    each /= length;
                base.push_back(v);
            }
        const Real height = std::sqrt(own[0] * own[0] + own[1] * own[1] + own[2] * own[2]);
        most[static_cast<std::size_t>(k)] =
            static_cast<std::int32_t>(std::min(std::ceil((cutoff + spread) / height * 1.001L), Real(1e6))) +
            1;
    }
    return most;
}

template <int Dim>
using Row = std::vector<std::tuple<std::uint32_t, Shift<Dim>>>;

template <int Dim, class T>
std::vector<Row<Dim>> by_definition(const System<Dim, T>& system, bool half)
{
    const Shift<Dim> most = most_periods(system);
    std::vector<Row<Dim>> rows(system.a.size());
    const auto& others = system.two_sets ? system.b : system.a;
    for (std::uint32_t i = 0; i < rows.size(); ++i)
        for (std::uint32_t j = 0; j < others.size(); ++j) {
            const T cutoff = cutoff_by_definition(system, i, j);
            Shift<Dim> shift;
            for (std::size_t k = 0; k < shift.size(); ++k)
                shift[k] = -most[k];
            while (true) {
                const auto first = std::find_if(shift.begin(), shift.end(), [](int s) { return s != 0; });
                const bool unshifted = first == shift.end();
                const bool counts = system.two_sets || (half ? i < j || (i == j && !unshifted && *first > 0)
                                                             : i != j || !unshifted);
                volatile T square = cutoff * cutoff;
                if (counts && cutoff > 0 &&
                    square_by_definition(vector_by_definition(system, system.a[i], others[j], shift)) <=
                        square)
                    rows[i].push_back({j, shift});
                std::size_t k = shift.size();
                while (k-- > 0 && shift[k] == most[k])
                    shift[k] = -most[k];
                if (k > shift.size()) break;
                ++shift[k];
            }
        }
    return rows;
}

template <int Dim, class T>
std::vector<Row<Dim>> rows_of(const NeighborList<Dim, T>& list)
{
    std::vector<Row<Dim>> rows(list.offsets.size() - 1);
    EXPECT_EQ(list.neighbors.size(), list.offsets.back());
    EXPECT_EQ(list.shifts.size(), list.offsets.back());
    for (std::size_t i = 0; i < rows.size(); ++i)
        for (std::uint64_t k = list.offsets[i]; k < list.offsets[i + 1]; ++k)
            rows[i].push_back({list.neighbors[k], list.shifts[k]});
    return rows;
}

} // namespace neighbor_tests
