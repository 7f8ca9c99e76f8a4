// SPDX-License-Identifier: MIT
// Clusters in a world so wide that one grid can't have cells both for the world and for what is in a cluster:
// towns, stars, dust in corners.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "harness.hpp"

namespace contract {
namespace {

template <class T>
T power_of_ten(Random& random, T least, T most)
{
    return std::pow(T(10), least + random.unit<T>() * (most - least));
}

/// Towns of sizes, shapes and places of all kinds, among boxes across much of the world.
template <int Dim, class T>
Boxes<Dim, T> some_towns(Random& random, std::size_t n)
{
    const std::uint32_t towns = 1 + random.below(40), most = 1 + 2 * static_cast<std::uint32_t>(n) / towns;
    const T world = power_of_ten(random, T(0), sizeof(T) == 4 ? T(9) : T(14));
    const T size = random.one_in(5) ? T(0) : power_of_ten(random, T(-3), T(1));
    const T giants = random.one_in(3) ? T(0.1) * random.unit<T>() : T(0);
    const bool lattice = random.one_in(4), nested = random.one_in(4), flat = random.one_in(4),
               line = random.one_in(3);
    Boxes<Dim, T> boxes;
    while (boxes.size() < n) {
        jostle::Vec<Dim, T> center{};
        for (int d = 0; d < (line ? 1 : Dim); ++d)
            center[d] =
                nested ? std::ldexp(world, -static_cast<int>(random.below(60))) : world * random.unit<T>();
        const T spread = power_of_ten(random, T(-0.5), T(2.5));
        for (std::uint32_t left = 1 + random.below(most); left > 0 && boxes.size() < n; --left) {
            Aabb<Dim, T> box;
            for (int d = 0; d < Dim; ++d) {
                T at = flat && d == 1 ? T(0) : spread * (random.unit<T>() - T(0.5));
                T extent = size * (random.one_in(3) ? random.unit<T>() : T(1));
                if (lattice) at = std::floor(at), extent = std::floor(extent);
                box.lo[d] = center[d] + at;
                box.hi[d] = std::max(box.lo[d], center[d] + at + extent);
                if (random.unit<T>() >= giants) continue;
                box.lo[d] -= world * random.unit<T>();
                if (random.one_in(2)) box.hi[d] += world * random.unit<T>();
                if (random.one_in(9)) box.hi[d] = std::numeric_limits<T>::infinity();
            }
            boxes.push_back(box);
        }
    }
    for (std::size_t i = boxes.size(); i > 1; --i)
        std::swap(boxes[i - 1], boxes[random.below(static_cast<std::uint32_t>(i))]);
    return boxes;
}

TEST(Towns, HaveThePairsOfTheDefinition)
{
    std::uint64_t seed = environment_number("JOSTLE_SEED", 1), in_grids = 0;
    for (int round = 0; round < 60; ++round)
        for_each_kind([&]<class K>(K) {
            using T = typename K::Number;
            Random random(++seed);
            const Boxes<K::dim, T> boxes = some_towns<K::dim, T>(random, 150 + random.below(600));
            const auto sets = jostle::supported_instruction_sets();
            jostle::FinderOptions options;
            options.instruction_set = sets[random.below(static_cast<std::uint32_t>(sets.size()))];
            jostle::PairFinder finder(options);
            const BoxView<K::dim, T> all(boxes);
            const std::string what = kind_name<K::dim, T>() + ", seed " + std::to_string(seed);
            ASSERT_EQ(finder.find(all, {}, jostle::Order::sorted).to_vector(),
                      jostle::find_pairs_brute_force(all))
                << what;
            in_grids += finder.stats().nested_grids != 0;
            const std::size_t cut = random.below(static_cast<std::uint32_t>(boxes.size()));
            const auto a = all.subview(0, cut), b = all.subview(cut, boxes.size() - cut);
            ASSERT_EQ(finder.find(a, b, {}, jostle::Order::sorted).to_vector(),
                      jostle::find_pairs_brute_force(a, b))
                << what;
        });
    EXPECT_GT(in_grids, 40u);
}

/// `towns` of so many boxes of 0.6 m within 20 m or so, on the ground, and large ones among them.
template <int Dim, class T>
Boxes<Dim, T> plain_towns(Random& random, std::size_t towns, std::size_t each, T world, std::size_t giants)
{
    Boxes<Dim, T> boxes;
    const T spread = 20 * std::sqrt(static_cast<T>(each) / 300);
    jostle::Vec<Dim, T> center{};
    for (std::size_t k = 0; k < towns * each + giants; ++k) {
        const bool giant = k >= towns * each;
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            const bool up = Dim == 3 && d == 1;
            if (k % each == 0 || giant) center[d] = up ? T(0) : world * random.unit<T>();
            box.lo[d] = center[d] + (up ? T(3) : spread) * random.unit<T>();
            box.hi[d] = box.lo[d] + (giant && !up ? world * T(0.1) * random.unit<T>() : T(0.6));
        }
        boxes.push_back(box);
    }
    return boxes;
}

TEST(Towns, CostLittleHoweverFarApart)
{
    for_each_kind([]<class K>(K) {
        using T = typename K::Number;
        Random random(7);
        for (const T world :
             {T(1e3), T(1e5), T(1e6), sizeof(T) == 4 ? T(2e6) : T(1e7), sizeof(T) == 4 ? T(2e6) : T(1e12)})
            for (const std::size_t each : {33u, 50u, 128u, 300u, 350u, 1'000u}) {
                const auto boxes = plain_towns<K::dim, T>(random, 20'000 / each, each, world, each % 2 * 20);
                jostle::PairFinder finder;
                const BoxView<K::dim, T> all(boxes);
                EXPECT_TRUE(finder.stream(all, [](const jostle::PairChunk&) { return true; }));
                const jostle::Stats& stats = finder.stats();
                const std::string what =
                    kind_name<K::dim, T>() + ", " + std::to_string(each) + " in " + std::to_string(world);
                const double n = static_cast<double>(boxes.size()),
                             work = n + static_cast<double>(stats.pairs);
                EXPECT_LE(static_cast<double>(stats.ties) / n, 6) << what;
                EXPECT_LE(static_cast<double>(stats.candidates) / work, 100) << what;
                EXPECT_LE(static_cast<double>(stats.records) / n, 4) << what;
            }
    });
}

} // namespace
} // namespace contract
