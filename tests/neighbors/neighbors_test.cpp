// SPDX-License-Identifier: MIT
#include "jostle/neighbors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/error.hpp"
#include "tests/contract/counting_memory.hpp"
#include "tests/contract/error_of.hpp"
#include "tests/contract/harness.hpp"
#include "tests/neighbors/definition.hpp"

namespace {

using contract::for_each_kind;
using contract::message_of;
using contract::Random;
using namespace neighbor_tests;

// --- Systems ---

template <int Dim, class T>
PeriodicCell<Dim, T> random_cell(Random& random, T size, bool lattice)
{
    constexpr T nothing = std::numeric_limits<T>::quiet_NaN(); // isn't read
    PeriodicCell<Dim, T> cell;
    const bool skewed = random.one_in(2), narrow = random.one_in(4);
    for (int k = 0; k < Dim; ++k) {
        cell.repeats[k] = !random.one_in(4);
        for (int d = 0; d < Dim; ++d) {
            T& x = cell.vectors[k][d];
            if (!cell.repeats[k])
                x = nothing;
            else if (d == k)
                x = lattice ? T(1 + random.below(4)) : size * random.template between<T>(T(0.3), 2);
            else
                x = !skewed   ? T(0)
                    : lattice ? T(random.below(3)) - 1
                              : size * random.template between<T>(-1, 1);
        }
    }
    if (narrow && !lattice && cell.repeats[0] && cell.repeats[1]) { // 10 degrees
        cell.vectors[1] = cell.vectors[0] * T(0.9848);
        for (int d = 0; d < Dim; ++d)
            cell.vectors[1][d] += (d == 0 ? -1 : T(1)) * T(0.1736) * cell.vectors[0][(d + 1) % Dim];
    }
    if (random.one_in(2)) { // left-handed
        std::swap(cell.vectors[0], cell.vectors[1]);
        std::swap(cell.repeats[0], cell.repeats[1]);
    }
    return cell;
}

template <int Dim, class T>
std::vector<Vec<Dim, T>> random_points(Random& random, const PeriodicCell<Dim, T>& cell, T size, bool lattice)
{
    std::vector<Vec<Dim, T>> points(random.below(14));
    const bool far = random.one_in(4);
    for (Vec<Dim, T>& point : points) {
        point = {};
        for (int k = 0; k < Dim; ++k) {
            T f = random.template unit<T>();
            if (random.one_in(6)) f = T(random.below(2)); // on a face
            if (far) f += T(random.below(9)) - 4;
            for (int d = 0; d < Dim; ++d)
                if (cell.repeats[k])
                    point[d] += f * cell.vectors[k][d];
                else if (d == k)
                    point[d] += f * size;
        }
        for (int d = 0; lattice && d < Dim; ++d)
            point[d] = std::floor(point[d]);
        if (random.one_in(8)) point = points.front();
    }
    return points;
}

/// `steps` limits how many shifts the definition looks at.
template <int Dim, class T>
System<Dim, T> random_system(Random& random, double steps)
{
    constexpr T sizes[] = {1, 10, T(1e-9), T(1e9)};
    while (true) {
        System<Dim, T> system;
        const bool lattice = random.one_in(4);
        const T size = lattice ? T(1) : sizes[random.below(4)];
        system.cell = random_cell<Dim, T>(random, size, lattice);
        system.a = random_points(random, system.cell, size, lattice);
        system.two_sets = random.one_in(4);
        if (system.two_sets) system.b = random_points(random, system.cell, size, lattice);
        constexpr T factors[] = {T(0.1), T(0.3), T(0.5), 1, 2};
        const T cutoff = lattice ? T(1 + random.below(3)) : size * factors[random.below(5)];
        const auto fill = [&](auto& a, auto& b, auto draw) {
            for (std::size_t i = 0; i < system.a.size(); ++i)
                a.push_back(draw());
            for (std::size_t i = 0; i < system.b.size(); ++i)
                b.push_back(draw());
        };
        const std::uint32_t kind = random.below(3);
        if (kind == 0) {
            system.cutoff = cutoff;
        } else if (kind == 1) {
            fill(system.radii_a, system.radii_b, [&] {
                return random.one_in(4) ? T(0) : std::ldexp(cutoff, -1 - static_cast<int>(random.below(9)));
            });
            for (auto* radii : {&system.radii_a, &system.radii_b})
                if (!radii->empty()) radii->front() = cutoff;
            system.greater = random.one_in(2);
        } else {
            fill(system.types_a, system.types_b, [&] { return random.below(3); });
            system.table = {cutoff, cutoff / 2, 0, cutoff / 2, cutoff / 4, cutoff, 0, cutoff, cutoff / 2};
        }
        if (system.two_sets && (system.a.empty() || system.b.empty())) continue;
        double count = 1;
        bool solid = true;
        const Shift<Dim> most = most_periods(system);
        for (std::size_t k = 0; k < most.size(); ++k) {
            count *= 2.0 * most[k] + 1;
            solid &= most[k] >= 0;
        }
        if (!solid || count > steps) continue;
        NeighborFinder<Dim, T> finder({.executor = &jostle::serial_executor()});
        try {
            system.find(finder);
        } catch (const jostle::Error& error) { // a lattice may be flat
            EXPECT_NE(std::string(error.what()).find("flat"), std::string::npos) << error.what();
            continue;
        }
        return system;
    }
}

template <int Dim, class T>
std::vector<NeighborFinder<Dim, T>> one_of_each_set()
{
    std::vector<NeighborFinder<Dim, T>> finders;
    for (const jostle::InstructionSet set : jostle::supported_instruction_sets())
        finders.emplace_back(jostle::FinderOptions{.instruction_set = set});
    return finders;
}

template <int Dim, class T>
std::vector<std::uint32_t> neighbors_of(const NeighborList<Dim, T>& list)
{
    return {list.neighbors.begin(), list.neighbors.end()};
}

template <int Dim, class T>
void expect_vectors(const System<Dim, T>& system, const NeighborList<Dim, T>& list)
{
    ASSERT_EQ(list.vectors.size(), list.neighbors.size());
    ASSERT_EQ(list.distances.size(), list.neighbors.size());
    for (std::size_t i = 0; i < system.a.size(); ++i)
        for (std::uint64_t k = list.offsets[i]; k < list.offsets[i + 1]; ++k) {
            const auto& other = (system.two_sets ? system.b : system.a)[list.neighbors[k]];
            const auto vector = vector_by_definition(system, system.a[i], other, list.shifts[k]);
            ASSERT_EQ(list.vectors[k], vector);
            ASSERT_EQ(list.distances[k], std::sqrt(square_by_definition(vector)));
        }
}

TEST(Neighbors, AreWhatTheDefinitionSays)
{
    const auto rounds = contract::environment_number("JOSTLE_NEIGHBOR_ROUNDS", 300);
    for_each_kind([&](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(contract::environment_number("JOSTLE_NEIGHBOR_SEED", 1));
        auto finders = one_of_each_set<Dim, T>();
        std::size_t found = 0, shifted = 0, itself = 0;
        for (std::uint64_t round = 0; round < rounds; ++round) {
            NeighborFinder<Dim, T>& finder = finders[round % finders.size()];
            const auto system = random_system<Dim, T>(random, 3000);
            const bool half = !system.two_sets && random.one_in(2);
            const auto expected = by_definition(system, half);
            const auto rows = rows_of(system.find(finder, {.half = half}));
            ASSERT_EQ(rows, expected) << contract::kind_name<Dim, T>() << " round " << round;
            const std::vector<std::uint32_t> neighbors = neighbors_of(system.find(finder, {.half = half}));
            const auto& bare = system.find(finder, {.half = half, .shifts = false});
            ASSERT_EQ(neighbors_of(bare), neighbors) << "without shifts";
            ASSERT_TRUE(bare.shifts.empty());
            expect_vectors(system, system.find(finder, {.half = half, .vectors = true, .distances = true}));
            ASSERT_FALSE(testing::Test::HasFailure()) << contract::kind_name<Dim, T>() << " round " << round;
            for (std::size_t i = 0; i < rows.size(); ++i)
                for (const auto& [j, shift] : rows[i]) {
                    ++found;
                    shifted += shift != Shift<Dim>{};
                    itself += i == j;
                }
        }
        EXPECT_GT(found, 20 * rounds);
        EXPECT_GT(shifted, 10 * rounds);
        EXPECT_GT(itself, rounds);
    });
}

/// By hand: one point whose images lie on a line, and two that just touch across a border.
TEST(Neighbors, OfAFewPointsCanBeCounted)
{
    NeighborFinder<3, float> finder;
    const std::vector<Vec<3, float>> one{{7, 8, 9}};
    const PeriodicCell<3, float> line{{{}, {0, 2, 0}, {}}, {false, true, false}};
    const auto& list = finder.find(one, 4.5f, line, {.vectors = true, .distances = true});
    ASSERT_EQ(rows_of(list),
              (std::vector<Row<3>>{{{0u, {0, -2, 0}}, {0u, {0, -1, 0}}, {0u, {0, 1, 0}}, {0u, {0, 2, 0}}}}));
    EXPECT_EQ(list.vectors[0], (Vec<3, float>{0, -4, 0}));
    EXPECT_EQ(list.distances[0], 4);
    EXPECT_TRUE(list.searched);
    EXPECT_EQ(rows_of(finder.find(one, 4.5f, line, {.half = true})),
              (std::vector<Row<3>>{{{0u, {0, 1, 0}}, {0u, {0, 2, 0}}}}));

    const std::vector<Vec<3, float>> two{{0, 9, 0}, {0, 1, 0}};
    const PeriodicCell<3, float> cell{{{}, {0, 10, 0}, {}}, {false, true, false}};
    EXPECT_EQ(rows_of(finder.find(two, 2, cell)),
              (std::vector<Row<3>>{{{1u, {0, 1, 0}}}, {{0u, {0, -1, 0}}}}));
    EXPECT_EQ(rows_of(finder.find(two, 1.99f, cell)), (std::vector<Row<3>>{{}, {}}));
    EXPECT_EQ(rows_of(finder.find(two, 8)), (std::vector<Row<3>>{{{1u, {}}}, {{0u, {}}}}));
    EXPECT_EQ(rows_of(finder.find({}, 8)), (std::vector<Row<3>>{}));
    const std::vector<Vec<3, float>> zeros{{0, 0, 0}, {-0.0f, 1, 0}};
    for (const bool repeats : {false, true}) { // in open space nothing is added, not even 0
        const PeriodicCell<3, float> around{{{10, 0, 0}, {}, {}}, {repeats, false, false}};
        const Vec<3, float> vector = finder.find(zeros, 2, around, {.vectors = true}).vectors[0];
        EXPECT_EQ(vector, (Vec<3, float>{0, 1, 0}));
        EXPECT_EQ(std::signbit(vector[0]), !repeats);
    }
    EXPECT_EQ(rows_of(finder.find(two, {}, 8)), (std::vector<Row<3>>{{}, {}}));
}

/// Cutoffs that touch exactly, in numbers that are no whole ones: the distance of two points as the
/// definition rounds it, and the number below.
TEST(Neighbors, TouchExactly)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(4);
        NeighborFinder<Dim, T> finder;
        std::size_t found = 0;
        for (int round = 0; round < 200; ++round) {
            const System<Dim, T> system = random_system<Dim, T>(random, 500);
            if (system.cutoff == 0) continue;
            const auto wide = by_definition(system, false);
            for (std::size_t i = 0; i < wide.size(); ++i)
                for (const auto& [j, shift] : wide[i]) {
                    if (!random.one_in(16)) continue;
                    const auto& other = (system.two_sets ? system.b : system.a)[j];
                    const T distance = std::sqrt(
                        square_by_definition(vector_by_definition(system, system.a[i], other, shift)));
                    for (const T cutoff : {distance, std::nextafter(distance, T(0))}) {
                        if (!(cutoff > system.cutoff / 100)) continue;
                        System<Dim, T> exact = system;
                        exact.cutoff = cutoff;
                        ASSERT_EQ(rows_of(exact.find(finder)), by_definition(exact, false));
                        ++found;
                    }
                }
        }
        EXPECT_GT(found, 100u);
    });
}

template <int Dim, class T>
System<Dim, T> large_system(Random& random, std::size_t n)
{
    System<Dim, T> system;
    for (int k = 0; k < Dim; ++k) {
        system.cell.repeats[k] = k != 1;
        system.cell.vectors[k] = {};
        system.cell.vectors[k][k] = 10;
    }
    system.cell.vectors[0][1] = 4;
    for (std::size_t i = 0; i < n; ++i) {
        Vec<Dim, T> point;
        for (int d = 0; d < Dim; ++d)
            point[d] = random.template between<T>(-6, 11);
        system.a.push_back(point);
    }
    system.cutoff = Dim == 3 ? T(1.5) : T(0.7);
    return system;
}

TEST(Neighbors, AreTheSameOnAnyThreads)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(2);
        const auto system = large_system<Dim, T>(random, 520);
        const auto expected = by_definition(system, false);
        const auto sets = jostle::supported_instruction_sets();
        std::size_t turn = 0;
        for (const contract::NamedExecutor& each : contract::all_executors()) {
            const jostle::InstructionSet set = sets[turn++ % sets.size()];
            NeighborFinder<Dim, T> finder({.executor = each.executor.get(), .instruction_set = set});
            const auto& list = system.find(finder, {.vectors = true, .distances = true});
            ASSERT_EQ(rows_of(list), expected) << each.name;
            expect_vectors(system, list);
        }
    });
}

/// A list, or all blocks of a stream one behind the other.
template <int Dim, class T>
struct Listed
{
    std::vector<std::uint64_t> offsets{0};
    std::vector<std::uint32_t> neighbors;
    std::vector<Shift<Dim>> shifts;
    std::vector<Vec<Dim, T>> vectors;
    std::vector<T> distances;

    explicit Listed(const NeighborList<Dim, T>& list) { add(list); }
    Listed(NeighborFinder<Dim, T>& finder, const System<Dim, T>& system, std::size_t rows,
           const NeighborOptions& what)
    {
        const auto take = [&](std::size_t first, const NeighborList<Dim, T>& block) {
            EXPECT_EQ(first + 1, offsets.size());
            EXPECT_EQ(block.offsets.size() - 1, std::min(rows, system.a.size() - first));
            add(block);
            return true;
        };
        EXPECT_TRUE(system.two_sets
                        ? finder.stream(system.a, system.b, system.cutoffs(), rows, take, system.cell, what)
                        : finder.stream(system.a, system.cutoffs(), rows, take, system.cell, what));
    }
    void add(const NeighborList<Dim, T>& block)
    {
        for (std::size_t k = 1; k < block.offsets.size(); ++k)
            offsets.push_back(neighbors.size() + block.offsets[k]);
        neighbors.insert(neighbors.end(), block.neighbors.begin(), block.neighbors.end());
        shifts.insert(shifts.end(), block.shifts.begin(), block.shifts.end());
        vectors.insert(vectors.end(), block.vectors.begin(), block.vectors.end());
        distances.insert(distances.end(), block.distances.begin(), block.distances.end());
    }
    void expect_same(const NeighborList<Dim, T>& list) const
    {
        const auto same = [](const auto& x, const auto& y) {
            return std::equal(x.begin(), x.end(), y.begin(), y.end());
        };
        EXPECT_TRUE(same(offsets, list.offsets));
        EXPECT_TRUE(same(neighbors, list.neighbors));
        EXPECT_TRUE(same(shifts, list.shifts));
        EXPECT_TRUE(same(vectors, list.vectors));
        EXPECT_TRUE(same(distances, list.distances));
    }
};

TEST(Neighbors, StreamedInBlocksAreThoseOfFind)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(9);
        NeighborFinder<Dim, T> whole;
        std::size_t found = 0;
        const auto some_options = [&](bool two_sets) {
            return NeighborOptions{.half = !two_sets && random.one_in(2),
                                   .shifts = random.one_in(2),
                                   .vectors = random.one_in(2),
                                   .distances = random.one_in(2)};
        };
        auto finders = one_of_each_set<Dim, T>();
        for (int round = 0; round < 200; ++round) {
            const auto system = random_system<Dim, T>(random, 3000);
            const NeighborOptions what = some_options(system.two_sets);
            const auto& list = system.find(whole, what);
            const std::size_t rows = 1 + random.below(16);
            Listed(finders[static_cast<std::size_t>(round) % finders.size()], system, rows, what)
                .expect_same(list);
            found += list.neighbors.size();
            ASSERT_FALSE(testing::Test::HasFailure()) << contract::kind_name<Dim, T>() << " round " << round;
        }
        EXPECT_GT(found, 1000u);
        auto system = large_system<Dim, T>(random, 1500);
        for (std::size_t i = 0; i < 400; ++i) // more in a cell of the grid than rows are worked on together
            for (int d = 0; d < Dim; ++d)
                system.a[3 * i][d] = random.template between<T>(0, T(0.3));
        for (const contract::NamedExecutor& each : contract::all_executors()) {
            NeighborFinder<Dim, T> finder({.executor = each.executor.get()});
            const NeighborOptions what = some_options(false);
            const std::size_t rows = random.one_in(2) ? 1 + random.below(60) : 500 + random.below(1100);
            Listed(finder, system, rows, what).expect_same(system.find(whole, what));
            ASSERT_FALSE(testing::Test::HasFailure()) << each.name << ", " << rows << " rows";
        }
    });
}

TEST(Neighbors, AStreamCanBeStoppedAndRefusesWhatNeverEnds)
{
    NeighborFinder<2, double> finder;
    const std::vector<Vec<2, double>> points{{0, 0}, {1, 0}, {2, 0}};
    int calls = 0;
    const auto stop = [&](std::size_t, const NeighborList<2, double>&) { return ++calls < 2; };
    EXPECT_FALSE(finder.stream(points, 1.5, 1, stop));
    EXPECT_EQ(calls, 2);
    EXPECT_TRUE(finder.stream({}, 1.5, 1, stop));
    EXPECT_EQ(calls, 2);
    const auto fail = [](std::size_t, const NeighborList<2, double>&) -> bool { throw 7; };
    EXPECT_THROW(finder.stream(points, 1.5, 2, fail), int);

    const auto& list = finder.find(points, 1.5);
    const auto before = rows_of(list);
    const auto error = [&](std::size_t rows, const NeighborOptions& options = {}) {
        return message_of([&] { finder.stream(points, 1.5, rows, stop, {}, options); });
    };
    EXPECT_EQ(error(0), "a stream in blocks of 0 rows never ends; give 1 or more");
    EXPECT_EQ(error(1, {.skin = 1}), "a skin is for lists that are kept, and a stream keeps none");
    EXPECT_EQ(message_of([&] { finder.stream(points, 1.5, 1, {}); }),
              "no sink to stream to; find() lists all");
    EXPECT_EQ(message_of([&] { finder.stream(points, -1, 1, stop); }), "the cutoff is -1; give a length");
    EXPECT_EQ(rows_of(list), before) << "the last list isn't touched";
    const auto ask = [&](std::size_t, const NeighborList<2, double>&) {
        finder.find(points, 1);
        return true;
    };
    EXPECT_NE(message_of([&] { finder.stream(points, 1.5, 1, ask); }).find("in use"), std::string::npos);
}

/// Many in one call are what each is alone, on any threads.
TEST(Neighbors, OfManySystemsAreThoseOfEach)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(8);
        NeighborFinder<Dim, T> alone;
        std::size_t found = 0;
        for (const contract::NamedExecutor& each : contract::all_executors()) {
            NeighborFinder<Dim, T> together({.executor = each.executor.get()});
            const NeighborOptions what{.half = random.one_in(2),
                                       .shifts = random.one_in(2),
                                       .vectors = random.one_in(2),
                                       .distances = random.one_in(2)};
            std::vector<Vec<Dim, T>> points;
            std::vector<std::uint64_t> offsets{0};
            std::vector<PeriodicCell<Dim, T>> cells;
            for (std::uint32_t count = 20 + random.below(60); count > 0; --count) {
                cells.push_back({});
                cells.back().repeats[0] = random.one_in(2);
                cells.back().repeats[1] = random.one_in(2);
                for (int k = 0; k < Dim; ++k)
                    for (int d = 0; d < Dim; ++d)
                        cells.back().vectors[k][d] =
                            random.template between<T>(0, 1) + (k == d ? T(3) : T(0));
                const std::uint32_t most = random.one_in(12) ? 200 : 40;
                for (std::uint32_t size = random.below(most); size > 0; --size) {
                    points.push_back({});
                    for (int d = 0; d < Dim; ++d)
                        points.back()[d] = random.template between<T>(-1, 3);
                }
                offsets.push_back(points.size());
            }
            std::vector<T> radii;
            std::vector<std::uint32_t> types;
            const std::vector<T> table{1, T(0.5), T(0.5), T(0.25)};
            const bool silent = random.one_in(2); // most systems have radii of 0
            for (std::size_t i = 0; i < points.size(); ++i) {
                radii.push_back(silent && i != 0 ? T(0) : random.template unit<T>());
                types.push_back(random.below(2));
            }
            const std::uint32_t rule = random.below(3);
            NeighborCutoff<T> cutoff = rule == 0 ? T(1) : T(0);
            if (rule == 1) cutoff.radii = radii, cutoff.greater = random.one_in(2);
            if (rule == 2) cutoff.types = types, cutoff.table = table;
            const auto& list = together.find_systems(points, offsets, cutoff, cells, what);
            ASSERT_EQ(list.offsets.size(), points.size() + 1);
            std::size_t next = 0;
            for (std::size_t k = 0; k < cells.size(); ++k) {
                const std::size_t first = offsets[k], size = offsets[k + 1] - first;
                NeighborCutoff<T> own = cutoff;
                if (rule == 1) own.radii = own.radii.subspan(first, size);
                if (rule == 2) own.types = own.types.subspan(first, size);
                if (rule == 1 && silent && first != 0) {
                    ASSERT_EQ(list.offsets[first + size], next);
                    continue;
                }
                const auto& expected =
                    alone.find(std::span(points).subspan(first, size), own, cells[k], what);
                for (std::size_t i = 0; i < size; ++i)
                    ASSERT_EQ(list.offsets[first + i + 1], next + expected.offsets[i + 1]) << each.name;
                for (std::size_t n = 0; n < expected.neighbors.size(); ++n, ++next) {
                    ASSERT_EQ(list.neighbors[next], first + expected.neighbors[n]);
                    if (what.shifts) {
                        ASSERT_EQ(list.shifts[next], expected.shifts[n]);
                    }
                    if (what.vectors) {
                        ASSERT_EQ(list.vectors[next], expected.vectors[n]);
                    }
                    if (what.distances) {
                        ASSERT_EQ(list.distances[next], expected.distances[n]);
                    }
                }
            }
            ASSERT_EQ(list.neighbors.size(), next);
            ASSERT_EQ(list.shifts.size(), what.shifts ? next : 0);
            found += next;
        }
        EXPECT_GT(found, 1000u);
    });
}

TEST(Neighbors, AnErrorOfASystemNamesIt)
{
    NeighborFinder<3, double> finder;
    const std::vector<Vec<3, double>> points{{0, 0, 0}, {1, 0, 0}, {5, 0, 0}, {5, 0, HUGE_VAL}};
    const std::vector<std::uint64_t> some{0, 2, 3}, all{0, 2, 4};
    const auto& list = finder.find_systems(std::span(points).first(3), some, 2);
    const auto before = rows_of(list);
    ASSERT_EQ(before, (std::vector<Row<3>>{{{1u, {}}}, {{0u, {}}}, {}}));
    const auto error = [&](auto&& call) { return message_of(call); };
    EXPECT_EQ(
        error([&] { finder.find_systems(points, all, 2); }),
        "system 1: point 1, (5, 0, inf) is too far away; coordinates reach to an eighth of their type's "
        "range");
    try {
        finder.find_systems(points, all, 2);
    } catch (const jostle::Error& thrown) {
        EXPECT_EQ(thrown.index(), 3u);
    }
    EXPECT_NE(error([&] { finder.find_systems(points, some, 2); }).find("offset"), std::string::npos);
    EXPECT_EQ(error([&] { finder.find_systems(points, all, -1); }), "the cutoff is -1; give a length");
    EXPECT_EQ(error([&] { finder.find_systems(points, all, 2, {}, {.skin = 1}); }),
              "a skin is for one system, and there are many");
    const std::vector<PeriodicCell<3, double>> three(3);
    EXPECT_EQ(error([&] { finder.find_systems(points, all, 2, three); }),
              "there are 3 cells for 2 systems; give one for each, or one for all");
    EXPECT_EQ(rows_of(list), before) << "the last list isn't touched";
}

TEST(Neighbors, WithASkinAreTheSameAndSeldomSearched)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(3);
        NeighborFinder<Dim, T> finder, plain;
        auto system = large_system<Dim, T>(random, 400);
        int searched = 0;
        for (int step = 0; step < 60; ++step) {
            const auto& list = system.find(finder, {.vectors = true, .skin = 0.3});
            searched += list.searched;
            const auto& fresh = system.find(plain, {.vectors = true});
            ASSERT_EQ(rows_of(list), rows_of(fresh)) << step;
            ASSERT_TRUE(std::equal(list.vectors.begin(), list.vectors.end(), fresh.vectors.begin()));
            for (Vec<Dim, T>& point : system.a)
                for (int d = 0; d < Dim; ++d)
                    point[d] += random.template between<T>(T(-0.02), T(0.02));
        }
        EXPECT_GT(searched, 3);
        EXPECT_LT(searched, 20);
        const auto searches = [&](const NeighborOptions& options = {.skin = 0.3}) {
            return system.find(finder, options).searched;
        };
        searches();
        EXPECT_FALSE(searches());
        const auto take = [](std::size_t, const NeighborList<Dim, T>&) { return true; };
        EXPECT_TRUE(finder.stream(std::span(system.a).first(9), system.cutoff, 2, take));
        EXPECT_FALSE(searches()) << "a stream leaves what is kept";
        EXPECT_EQ(rows_of(system.find(finder, {.skin = 0.3})), rows_of(system.find(plain)));
        EXPECT_TRUE(searches({.half = true, .skin = 0.3}));
        EXPECT_TRUE(searches());
        system.cell.vectors[0][0] += T(0.001);
        EXPECT_TRUE(searches());
        system.cutoff += T(0.001);
        EXPECT_TRUE(searches());
        system.a[7][0] += T(0.149);
        EXPECT_FALSE(searches());
        system.a[7][0] += T(0.002);
        EXPECT_TRUE(searches());
        system.a.pop_back();
        EXPECT_TRUE(searches());
        EXPECT_FALSE(searches());
        EXPECT_TRUE(searches({})) << "without a skin";
        std::swap(system.radii_a, system.radii_b);
        system.cutoff = 0;
        system.radii_a.assign(system.a.size(), T(0.5));
        EXPECT_TRUE(searches());
        system.radii_a[3] = T(0.4);
        EXPECT_TRUE(searches());
        EXPECT_FALSE(searches());
        system.greater = true;
        EXPECT_TRUE(searches());
    });
}

/// Any system, while its points move: what is kept holds for a while, and isn't what the list says.
TEST(Neighbors, WithASkinAreTheSameInAnySystem)
{
    const auto rounds = contract::environment_number("JOSTLE_NEIGHBOR_ROUNDS", 300);
    for_each_kind([&](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(contract::environment_number("JOSTLE_NEIGHBOR_SEED", 1));
        auto finders = one_of_each_set<Dim, T>();
        NeighborFinder<Dim, T> plain;
        std::size_t found = 0, kept = 0, steps = 0;
        for (std::uint64_t round = 0; round < rounds; ++round) {
            NeighborFinder<Dim, T>& finder = finders[round % finders.size()];
            auto system = random_system<Dim, T>(random, 3000);
            T cutoff = 0;
            for (std::size_t i = 0; i < system.a.size() && !system.a.empty(); ++i)
                cutoff = std::max(cutoff, cutoff_by_definition(system, i, 0));
            if (!(cutoff > 0)) continue;
            NeighborOptions what{.half = !system.two_sets && random.one_in(2),
                                 .shifts = random.one_in(2),
                                 .vectors = random.one_in(2),
                                 .distances = random.one_in(2)};
            const T skin = cutoff * random.template between<T>(T(0.1), 1);
            const T most = skin * (random.one_in(2) ? T(0.05) : T(0.2));
            for (int step = 0; step < 5; ++step, ++steps) {
                what.skin = 0;
                const auto& expected = system.find(plain, what);
                what.skin = static_cast<double>(skin);
                const auto& list = system.find(finder, what);
                Listed<Dim, T>(list).expect_same(expected);
                ASSERT_FALSE(testing::Test::HasFailure())
                    << contract::kind_name<Dim, T>() << " round " << round;
                found += list.neighbors.size();
                kept += !list.searched;
                for (auto* points : {&system.a, &system.b})
                    for (Vec<Dim, T>& point : *points)
                        if (!random.one_in(3))
                            for (int d = 0; d < Dim; ++d)
                                point[d] += random.template between<T>(-most, most);
            }
        }
        EXPECT_GT(found, 20 * rounds);
        EXPECT_GT(kept, steps / 8);
        EXPECT_LT(kept, steps * 3 / 4);
    });
}

TEST(Neighbors, BadInputIsAnErrorThatNamesIt)
{
    NeighborFinder<3, double> finder;
    const std::vector<Vec<3, double>> points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    const PeriodicCell<3, double> cell{{{9, 0, 0}, {0, 9, 0}, {0, 0, 9}}, {true, true, true}};
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = HUGE_VAL;
    const auto before = rows_of(finder.find(points, 1.5, cell));
    const auto error = [&](auto&& call) { return message_of(call); };
    const auto with = [&](Vec<3, double> last) {
        return error([&] { finder.find(std::vector{points[0], points[1], last}, 1.5, cell); });
    };
    EXPECT_EQ(with({1, nan, 0}), "point 2, (1, nan, 0) is NaN; every coordinate must be a number");
    EXPECT_EQ(with({1, -infinite, 0}),
              "point 2, (1, -inf, 0) is too far away; coordinates reach to an eighth of their type's range");
    EXPECT_NE(with({1, 1e12, 0}).find("point 2, (1, 1000000000000, 0) lies "), std::string::npos);
    const auto cut = [&](double cutoff) { return error([&] { finder.find(points, cutoff, cell); }); };
    EXPECT_EQ(cut(-1), "the cutoff is -1; give a length");
    EXPECT_EQ(cut(nan), "the cutoff is nan; give a length");
    EXPECT_EQ(cut(infinite), "the cutoff is inf; give a length");
    for (const double wrong : {0.0, 1e-170, 1e170})
        EXPECT_NE(cut(wrong).find("the greatest cutoff is "), std::string::npos);
    EXPECT_NE(cut(1e4).find("periods along axis 0"), std::string::npos);
    const auto in = [&](Vec<3, double> third) {
        PeriodicCell<3, double> other = cell;
        other.vectors[2] = third;
        return error([&] { finder.find(points, 1.5, other); });
    };
    EXPECT_NE(in({3, 2, 0}).find("the cell is flat"), std::string::npos);
    EXPECT_NE(in({0, 0, 0}).find("vector 2 of the cell has length 0"), std::string::npos);
    EXPECT_NE(in({0, nan, 0}).find("vector 2 of the cell has length nan"), std::string::npos);
    for (const double skin : {-1.0, nan, infinite, 1e200})
        EXPECT_NE(error([&] { finder.find(points, 1.5, cell, {.skin = skin}); }).find("the skin is "),
                  std::string::npos);
    EXPECT_NE(error([&] { finder.find(points, points, 1.5, cell, {.half = true}); }).find("half"),
              std::string::npos);

    const auto of = [&](const std::vector<double>& radii, const std::vector<std::uint32_t>& types,
                        const std::vector<double>& table, double value = 0) {
        NeighborCutoff<double> cutoff = value;
        cutoff.radii = radii, cutoff.types = types, cutoff.table = table;
        return error([&] { finder.find(points, cutoff, cell); });
    };
    EXPECT_EQ(of({1, 1}, {}, {}), "there are 2 radii for 3 points; give one for each");
    EXPECT_EQ(of({1, -2, 1}, {}, {}), "the radius of point 1 is -2; give a length");
    EXPECT_EQ(of({1, 1, 1}, {}, {}, 1), "of cutoff, radii and table only one may be given");
    EXPECT_EQ(of({}, {0, 0, 0}, {}), "there are types, but no table");
    EXPECT_EQ(of({}, {0, 2, 0}, {1, 1, 1, 1}), "point 1 is of type 2, and the table has 2 types");
    EXPECT_EQ(of({}, {0, 0}, {1}), "there are 2 types for 3 points; give one for each");
    EXPECT_NE(of({}, {0, 0, 0}, {1, 1}).find("isn't square"), std::string::npos);
    EXPECT_NE(of({}, {0, 0, 0}, {1, 2, 3, 1}).find("cutoff 1 of the table is 2"), std::string::npos);
    EXPECT_NE(of({}, {0, 0, 0}, {nan}).find("cutoff 0 of the table is nan"), std::string::npos);
    NeighborCutoff<double> second = 1;
    const std::vector<double> radii(3);
    second.radii_b = radii;
    EXPECT_NE(error([&] { finder.find(points, second, cell); }).find("second set"), std::string::npos);

    NeighborCutoff<double> greater = 1;
    greater.greater = true;
    EXPECT_EQ(error([&] { finder.find(points, greater, cell); }),
              "of radii the greater one may count, and there are none");

    const auto& list = finder.find(points, 1.5, cell);
    (void)error([&] { finder.find(points, -1, cell); });
    EXPECT_EQ(rows_of(list), before) << "the last list isn't touched";
}

TEST(Neighbors, ASteadyCallAllocatesNothingAndAFailedOneLeavesAnEmptyList)
{
    contract::CountingMemory memory;
    {
        Random random(5);
        const auto system = large_system<3, float>(random, 520);
        const auto expected = by_definition(system, false);
        NeighborFinder<3, float> finder({.memory = &memory});
        const NeighborOptions options{.vectors = true, .distances = true, .skin = 0.2};
        for (std::uint64_t allowed = 0;; ++allowed) {
            memory.failing_allocation = memory.allocations + allowed;
            try {
                const auto& list = system.find(finder, options);
                EXPECT_EQ(rows_of(list), expected);
                break;
            } catch (const std::bad_alloc&) {
                ASSERT_LT(allowed, 10'000u);
                finder.release_memory();
            }
        }
        memory.failing_allocation = contract::CountingMemory::never;
        system.find(finder, options);
        finder.find(system.a, system.cutoff, system.cell);
        const auto take = [](std::size_t, const NeighborList<3, float>&) { return true; };
        finder.stream(system.a, system.cutoff, 100, take, system.cell);
        system.find(finder, options);
        const auto before = memory.allocations;
        finder.stream(system.a, system.cutoff, 100, take, system.cell);
        EXPECT_EQ(rows_of(system.find(finder, options)), expected);
        finder.find(system.a, system.cutoff, system.cell); // without a skin
        EXPECT_EQ(memory.allocations, before);
    }
    EXPECT_EQ(memory.bytes, 0u);
}

/// Radii of which the greatest are a million times the smallest, also where squares are below the range of T,
/// and cutoffs that touch exactly.
TEST(Neighbors, MayHaveRadiiOfAnySizes)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(10);
        auto finders = one_of_each_set<Dim, T>();
        std::size_t found = 0;
        for (std::size_t round = 0; round < 18; ++round) {
            const int halvings = round % 3 == 0 ? 3 : round % 3 == 1 ? 9 : 28;
            const T size = round % 2 == 0 ? T(1) : std::sqrt(std::numeric_limits<T>::min());
            System<Dim, T> system = large_system<Dim, T>(random, 120);
            system.two_sets = random.one_in(3);
            system.greater = random.one_in(2);
            system.cutoff = 0;
            if (system.two_sets) system.b = large_system<Dim, T>(random, 70).a;
            if (random.one_in(4)) system.cell = {};
            for (Vec<Dim, T>& vector : system.cell.vectors)
                vector *= size;
            const auto fill = [&](auto& points, auto& radii) {
                for (std::size_t i = 0; i < points.size(); ++i) { // who is small is where others are
                    const T small = std::ldexp(T(1), -static_cast<int>(random.below(1 + halvings)));
                    radii.push_back(random.one_in(20) ? T(0) : 2 * size * small);
                    points[i] *= size;
                    if (i == 0 || small > T(0.25)) continue;
                    points[i] = points[random.below(static_cast<std::uint32_t>(i))];
                    for (int d = 0; d < Dim; ++d)
                        points[i][d] += 8 * size * small * random.template between<T>(-1, 1);
                }
                radii[0] = 2 * size;
            };
            fill(system.a, system.radii_a);
            if (system.two_sets) fill(system.b, system.radii_b);
            for (std::size_t i = 1; i < system.a.size(); i += 2) { // touch who comes before
                const T apart = std::sqrt(square_by_definition(vector_by_definition(
                    system, system.a[i], (system.two_sets ? system.b : system.a)[i / 2], Shift<Dim>{})));
                if (apart <= 2 * size) system.radii_a[i] = apart;
            }
            NeighborFinder<Dim, T>& finder = finders[round % finders.size()];
            const bool half = !system.two_sets && random.one_in(2);
            const auto expected = by_definition(system, half);
            ASSERT_EQ(rows_of(system.find(finder, {.half = half})), expected) << "round " << round;
            const double skin = static_cast<double>(size) * (random.one_in(2) ? 0.01 : 0.3);
            ASSERT_EQ(rows_of(system.find(finder, {.half = half, .skin = skin})), expected) << round;
            for (const auto& row : expected)
                found += row.size();
        }
        EXPECT_GT(found, 10'000u);
    });
}

/// Then points are neighbours that lie further apart than their cutoff.
TEST(Neighbors, MayHaveRadiiWhoseSquaresAreBelowTheRange)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(12);
        const T unit = std::sqrt(std::numeric_limits<T>::denorm_min());
        System<Dim, T> system;
        system.a.assign(400, {});
        system.radii_a.assign(400, T(0.4) * unit);
        system.radii_a[0] = std::sqrt(std::numeric_limits<T>::min());
        for (Vec<Dim, T>& point : system.a)
            for (int d = 0; d < 2; ++d)
                point[d] = T(2.2) * unit * random.template unit<T>();
        NeighborFinder<Dim, T> finder;
        ASSERT_EQ(rows_of(system.find(finder)), by_definition(system, false));
    });
}

/// Many in few places: those have cells as large as their cutoff, and not as their average density asks for.
TEST(Neighbors, MayCrowdTogether)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(11);
        System<Dim, T> system = large_system<Dim, T>(random, 1000);
        system.cell = {};
        system.cutoff = 0;
        for (std::size_t i = 0; i < system.a.size(); ++i) {
            for (int d = 0; d < Dim && i % 8 != 0; ++d)
                system.a[i][d] = T(i % 2) + T(0.5) * random.template unit<T>();
            system.radii_a.push_back(i % 5 == 0 ? T(0.05) : T(0.02));
        }
        NeighborFinder<Dim, T> finder;
        ASSERT_EQ(rows_of(system.find(finder)), by_definition(system, false));
        system.radii_a.clear();
        system.cutoff = T(0.05);
        ASSERT_EQ(rows_of(system.find(finder)), by_definition(system, false));
    });
}

/// Most of space is empty: the grid has as many cells as it may and no more.
TEST(Neighbors, PointsMayBeSparse)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(6);
        NeighborFinder<Dim, T> finder;
        System<Dim, T> system;
        system.cutoff = T(0.5);
        for (int i = 0; i < 300; ++i) {
            Vec<Dim, T> point;
            for (int d = 0; d < Dim; ++d)
                point[d] = random.template unit<T>() + (i % 3 == 0 ? T(1e6) : i % 3 == 1 ? T(1e30) : T(0));
            system.a.push_back(point);
        }
        ASSERT_EQ(rows_of(system.find(finder)), by_definition(system, false));
    });
}

} // namespace
