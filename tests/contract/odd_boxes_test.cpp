// SPDX-License-Identifier: MIT
// Finders that ignore odd boxes find what there is among the others, under the same numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <random>

#include "harness.hpp"
#include "jostle/spatial_order.hpp"
#include "pairs/pair_finder_access.hpp"
#include "tests/odd_box.hpp"

namespace contract {
namespace {

using jostle::FinderOptions;
using jostle::PairFinder;

template <int Dim, class T>
struct Scattered
{
    Boxes<Dim, T> all, good;
    std::vector<std::uint32_t> number; // of each good one

    /// Every `odd`-th box, on average, is NaN or inverted.
    Scattered(std::size_t count, std::uint32_t odd, std::uint64_t seed)
    {
        std::mt19937_64 random(seed);
        const double extent = std::pow(static_cast<double>(count), 1.0 / Dim); // crowded
        const auto below = [&](double end) {
            return end * static_cast<double>(random() >> 11) * (1.0 / 9007199254740992.0);
        };
        for (std::size_t i = 0; i < count; ++i) {
            Aabb<Dim, T> box;
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = static_cast<T>(below(extent));
                box.hi[d] = box.lo[d] + static_cast<T>(below(3));
            }
            if (random() % odd == 0) {
                make_odd(box, random());
            } else {
                number.push_back(static_cast<std::uint32_t>(i));
                good.push_back(box);
            }
            all.push_back(box);
        }
    }
    [[nodiscard]] std::uint64_t odd() const { return all.size() - good.size(); }
};

template <class Pairs>
std::vector<Pair> listed(const Pairs& pairs)
{
    return {pairs.begin(), pairs.end()};
}
std::vector<Pair> ascending(std::vector<Pair> pairs)
{
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

TEST(OddBoxes, AreAsIfTheyWereNotThere)
{
    for_each_kind([]<class K>(K) {
        constexpr int Dim = K::dim;
        using T = typename K::Number;
        std::uint64_t seed = 0, pairs = 0;
        for (const std::size_t count : {1u, 2u, 17u, 60u, 128u, 129u, 700u, 4000u})
            for (const std::uint32_t odd : {1u, 2u, 40u}) {
                const Scattered<Dim, T> a(count, odd, ++seed), b(count / 2 + 1, odd, ++seed);
                const std::string what = kind_name<Dim, T>() + " " + std::to_string(count) + " boxes";
                std::vector<Pair> among = jostle::find_pairs_brute_force(BoxView<Dim, T>(a.good));
                for (Pair& pair : among)
                    pair = {a.number[pair.a], a.number[pair.b]};
                std::vector<Pair> between =
                    jostle::find_pairs_brute_force(BoxView<Dim, T>(a.good), BoxView<Dim, T>(b.good));
                for (Pair& pair : between)
                    pair = {a.number[pair.a], b.number[pair.b]};
                pairs += among.size() + between.size();

                std::vector<Pair> first_among, first_between;
                for (const auto set : jostle::supported_instruction_sets())
                    for (const NamedExecutor& named : all_executors()) {
                        PairFinder finder({.executor = named.executor.get(),
                                           .instruction_set = set,
                                           .ignore_odd_boxes = true});
                        const std::vector<Pair> found = listed(finder.find(a.all));
                        ASSERT_EQ(ascending(found), among) << what << " on " << named.name;
                        ASSERT_EQ(finder.stats().odd, a.odd());
                        ASSERT_EQ(finder.stats().objects, count);
                        const std::vector<Pair> cross = listed(finder.find(a.all, b.all));
                        ASSERT_EQ(ascending(cross), between) << what << " on " << named.name;
                        ASSERT_EQ(finder.stats().odd, a.odd() + b.odd());
                        if (first_among.empty()) first_among = found;
                        if (first_between.empty()) first_between = cross;
                        ASSERT_EQ(found, first_among) << "another order, " << what << " on " << named.name;
                        ASSERT_EQ(cross, first_between) << "another order, " << what << " on " << named.name;
                    }
                PairFinder finder(FinderOptions{.ignore_odd_boxes = true});
                ASSERT_EQ(listed(finder.find(a.all, {}, jostle::Order::sorted)), among) << what;
                std::vector<Pair> streamed;
                std::mutex mutex;
                ASSERT_TRUE(finder.stream(a.all, [&](const jostle::PairChunk& chunk) {
                    const std::lock_guard lock(mutex);
                    streamed.insert(streamed.end(), chunk.pairs.begin(), chunk.pairs.end());
                    return true;
                }));
                ASSERT_EQ(ascending(streamed), among) << what;
                if (a.odd() != 0) {
                    ASSERT_THROW(PairFinder().find(a.all), jostle::Error);
                }
            }
        EXPECT_GT(pairs, 10000u);
    });
}

TEST(OddBoxes, HaveNoPartInScenes)
{
    for_each_kind([]<class K>(K) {
        constexpr int Dim = K::dim;
        using T = typename K::Number;
        Boxes<Dim, T> all;
        std::vector<std::uint64_t> offsets{0};
        std::uint64_t odd = 0;
        for (const std::size_t count : {3u, 0u, 100u, 128u, 129u, 6000u, 40u}) {
            const Scattered<Dim, T> scene(count, 3, offsets.size());
            all.insert(all.end(), scene.all.begin(), scene.all.end());
            offsets.push_back(all.size());
            odd += scene.odd();
        }
        PairFinder one(FinderOptions{.ignore_odd_boxes = true});
        for (const NamedExecutor& named : all_executors()) {
            PairFinder finder({.executor = named.executor.get(), .ignore_odd_boxes = true});
            const jostle::ScenePairs& found = finder.find_scenes(all, offsets);
            EXPECT_EQ(finder.stats().odd, odd) << named.name;
            for (std::size_t k = 0; k + 1 < offsets.size(); ++k) {
                const auto scene = BoxView<Dim, T>(all).subview(offsets[k], offsets[k + 1] - offsets[k]);
                EXPECT_EQ(listed(found[k]), listed(one.find(scene))) << named.name << ", scene " << k;
            }
        }
        EXPECT_THROW(PairFinder().find_scenes(all, offsets), jostle::Error);
    });
}

TEST(OddBoxes, AreCountedWhereNothingIsSearched)
{
    const Scattered<3, float> some(10, 1, 1);
    PairFinder finder(FinderOptions{.ignore_odd_boxes = true});
    EXPECT_TRUE(finder.find(some.all, Boxes<3, float>{}).empty());
    EXPECT_EQ(finder.stats().odd, 10u);
    EXPECT_TRUE(finder.find(Boxes<3, float>{}, some.all).empty());
    EXPECT_EQ(finder.stats().odd, 10u);
    // Searched in several slices, each of them is counted once.
    const Scattered<3, float> many(2000, 7, 2);
    jostle::PairFinderAccess::search_in_slices_of(finder, 300);
    EXPECT_EQ(ascending(listed(finder.find(many.all))),
              ascending(listed(PairFinder(FinderOptions{.ignore_odd_boxes = true}).find(many.all))));
    EXPECT_EQ(finder.stats().odd, many.odd());
}

TEST(OddBoxes, ComeLastInSpace)
{
    const Scattered<2, double> some(500, 5, 3);
    std::vector<std::uint32_t> order(some.all.size()), of_good(some.good.size());
    jostle::spatial_order(BoxView<2, double>(some.all), order, {.ignore_odd_boxes = true});
    jostle::spatial_order(BoxView<2, double>(some.good), of_good);
    for (std::size_t k = 0; k < of_good.size(); ++k)
        ASSERT_EQ(order[k], some.number[of_good[k]]);
    for (std::size_t k = of_good.size(); k < order.size(); ++k) {
        EXPECT_FALSE(std::binary_search(some.number.begin(), some.number.end(), order[k]));
        EXPECT_TRUE(k == of_good.size() || order[k - 1] < order[k]);
    }
    EXPECT_THROW(jostle::spatial_order(BoxView<2, double>(some.all), order), jostle::Error);
}

} // namespace
} // namespace contract
