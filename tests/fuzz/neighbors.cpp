// SPDX-License-Identifier: MIT
// Neighbour lists of few points, in cells of any shape, with cutoffs of all kinds, by every instruction set,
// in blocks and with a skin, against the tests' own definition.
#include <algorithm>
#include <iterator>

#include "choices.hpp"
#include "jostle/error.hpp"
#include "tests/neighbors/definition.hpp"

namespace {

/// Often of the size of a cell.
template <class T>
T some_length(fuzz::Input& in)
{
    return in.below(4) == 3 ? in.finite<T>() : static_cast<T>(in.number<std::int8_t>()) / 8;
}
template <int Dim, class T>
jostle::Vec<Dim, T> some_vector(fuzz::Input& in)
{
    jostle::Vec<Dim, T> vector;
    for (int d = 0; d < Dim; ++d)
        vector[d] = some_length<T>(in);
    return vector;
}

template <int Dim, class T>
void tell_system(const neighbor_tests::System<Dim, T>& system, const jostle::NeighborOptions& what)
{
    for (const auto* points : {&system.a, &system.b}) {
        fuzz::tell("// a set:");
        for (const auto& point : *points)
            fuzz::tell("    " + fuzz::text(point) + ",");
    }
    for (int k = 0; k < Dim; ++k)
        fuzz::tell("// vector " + fuzz::text(system.cell.vectors[k]) +
                   (system.cell.repeats[k] ? ", repeats" : ""));
    fuzz::tell("// cutoff " + fuzz::text(system.cutoff) + ", radii " + std::to_string(system.radii_a.size()) +
               ", greater " + std::to_string(system.greater) + ", types " +
               std::to_string(system.types_a.size()) + ", half " + std::to_string(what.half) + ", skin " +
               fuzz::text(what.skin));
}

} // namespace

JOSTLE_FUZZ_TARGET(neighbors)
{
    fuzz::with_kind(in, [&]<int Dim, class T>() {
        neighbor_tests::System<Dim, T> system;
        const std::uint32_t axes = in.below(1u << Dim);
        for (int k = 0; k < Dim; ++k) {
            system.cell.repeats[k] = (axes >> k & 1u) != 0;
            system.cell.vectors[k] = some_vector<Dim, T>(in);
        }
        system.two_sets = in.one_in(4);
        for (std::uint32_t count = in.below(12); count > 0; --count)
            system.a.push_back(some_vector<Dim, T>(in));
        for (std::uint32_t count = system.two_sets ? in.below(12) : 0; count > 0; --count)
            system.b.push_back(some_vector<Dim, T>(in));
        const auto each_point = [&](auto& of_a, auto& of_b, auto draw) {
            std::generate_n(std::back_inserter(of_a), system.a.size(), draw);
            std::generate_n(std::back_inserter(of_b), system.b.size(), draw);
        };
        const std::uint32_t rule = in.below(4);
        if (rule < 2) system.cutoff = std::abs(some_length<T>(in));
        if (rule == 2) {
            each_point(system.radii_a, system.radii_b, [&] { return std::abs(some_length<T>(in)); });
            system.greater = in.number<bool>();
        }
        if (rule == 3) {
            each_point(system.types_a, system.types_b, [&] { return in.below(2); });
            const T other = std::abs(some_length<T>(in));
            system.table = {std::abs(some_length<T>(in)), other, other, std::abs(some_length<T>(in))};
        }
        jostle::NeighborOptions what;
        what.half = !system.two_sets && in.number<bool>();
        what.skin = in.number<bool>() ? std::abs(double(some_length<T>(in))) : 0;
        if (fuzz::telling()) tell_system<Dim, T>(system, what);

        auto moved = system; // so little, often, that a list with a skin is kept
        for (auto* points : {&moved.a, &moved.b})
            for (auto& point : *points)
                for (int d = 0; d < Dim; ++d)
                    point[d] += static_cast<T>(what.skin * in.number<std::int8_t>() / 512);
        double steps = 1;
        try { // what is refused has no definition
            jostle::NeighborFinder<Dim, T> finder({.executor = &jostle::serial_executor()});
            system.find(finder, what);
            moved.find(finder, what);
            for (const std::int32_t most : neighbor_tests::most_periods(system))
                steps *= 2.0 * most + 1;
        } catch (const jostle::Error& error) {
            fuzz::demand(*error.what() != 0, "an error says nothing");
            return;
        }
        if (!(steps < 2000)) return;
        const auto expected = neighbor_tests::by_definition(system, what.half);
        const auto expected_later = neighbor_tests::by_definition(moved, what.half);
        for (const jostle::InstructionSet set : jostle::supported_instruction_sets()) {
            jostle::NeighborFinder<Dim, T> finder(
                {.executor = &jostle::serial_executor(), .instruction_set = set});
            fuzz::demand(neighbor_tests::rows_of(system.find(finder, what)) == expected,
                         "other neighbours than the definition's");
            if (what.skin > 0)
                fuzz::demand(neighbor_tests::rows_of(moved.find(finder, what)) == expected_later,
                             "other neighbours than the definition's after points have moved");
            jostle::NeighborOptions in_blocks = what;
            in_blocks.skin = 0;
            std::size_t next = 0;
            const auto take = [&](std::size_t first, const jostle::NeighborList<Dim, T>& block) {
                fuzz::demand(first == next, "a block of other rows");
                for (const auto& row : neighbor_tests::rows_of(block))
                    fuzz::demand(row == expected[next++], "other neighbours in blocks");
                return true;
            };
            const std::size_t rows = 1 + system.a.size() / 3;
            if (system.two_sets)
                finder.stream(system.a, system.b, system.cutoffs(), rows, take, system.cell, in_blocks);
            else
                finder.stream(system.a, system.cutoffs(), rows, take, system.cell, in_blocks);
            fuzz::demand(next == expected.size(), "rows are missing in blocks");
            fuzz::count_boxes(2 * (system.a.size() + system.b.size()));
        }
    });
}
