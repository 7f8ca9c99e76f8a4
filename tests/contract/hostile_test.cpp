// SPDX-License-Identifier: MIT
// Hostile scenes stay near-linear in boxes + pairs. Bounds are on what was compared, not on time.
#include <gtest/gtest.h>

#include "counting_memory.hpp"
#include "harness.hpp"

namespace contract {
namespace {

/// Asks by streaming, and so without memory for the pairs.
template <int Dim, class T>
jostle::Stats stats_of(const Boxes<Dim, T>& boxes)
{
    jostle::PairFinder finder;
    EXPECT_TRUE(finder.stream(BoxView<Dim, T>(boxes), [](const jostle::PairChunk&) { return true; }));
    return finder.stats();
}

struct Bound
{
    Scene scene;
    std::size_t n;
    double candidates; ///< most per box and pair
    double records;    ///< most per box
};

void PrintTo(const Bound& bound, std::ostream* out)
{
    *out << name(bound.scene) << " " << bound.n;
}

class Hostile : public ::testing::TestWithParam<Bound>
{
};
INSTANTIATE_TEST_SUITE_P(
    Scenes, Hostile,
    ::testing::Values(Bound{Scene::uniform, 200'000, 20, 4}, Bound{Scene::identical, 10'000, 20, 4},
                      Bound{Scene::giant_among_dust, 200'000, 20, 4}, Bound{Scene::line, 200'000, 20, 4},
                      Bound{Scene::sizes_to_million, 200'000, 20, 4},
                      Bound{Scene::far_from_origin, 200'000, 20, 4},
                      Bound{Scene::half_identical, 10'000, 20, 4}, Bound{Scene::cell_borders, 200'000, 20, 4},
                      Bound{Scene::zero_size, 200'000, 40, 4}, Bound{Scene::touching_voxels, 200'000, 20, 4},
                      Bound{Scene::almost_touching, 200'000, 20, 4}, Bound{Scene::outliers, 200'000, 20, 4},
                      Bound{Scene::piles_among_large, 20'000, 20, 4}),
    [](const auto& instance) { return std::string(name(instance.param.scene)); });

TEST_P(Hostile, StaysNearLinear)
{
    const Bound& bound = GetParam();
    for_each_kind([&]<class K>(K) {
        using T = typename K::Number;
        const jostle::Stats stats = stats_of(make_scene<K::dim, T>(bound.scene, bound.n, 1));
        const std::string what = std::string(name(bound.scene)) + " " + kind_name<K::dim, T>();
        const double work = static_cast<double>(bound.n) + static_cast<double>(stats.pairs);
        EXPECT_EQ(stats.objects, bound.n) << what;
        EXPECT_GE(stats.candidates, stats.pairs) << what;
        EXPECT_LE(static_cast<double>(stats.candidates) / work, bound.candidates)
            << what << ", " << stats.pairs << " pairs";
        EXPECT_LE(static_cast<double>(stats.records) / static_cast<double>(bound.n), bound.records) << what;
    });
}

// Crowds within one set are nothing to a search between two.
TEST(HostileSets, FewInACrowdTakeNoQuadraticTime)
{
    for_each_kind([]<class K>(K) {
        using T = typename K::Number;
        for (const std::size_t few : {1u, 50u})
            for (const T world : {T(0), T(1), T(4), T(20)}) {
                Random random(few);
                Boxes<K::dim, T> crowd(80'000), others(few);
                for (Boxes<K::dim, T>* set : {&crowd, &others})
                    for (Aabb<K::dim, T>& box : *set)
                        for (int d = 0; d < K::dim; ++d) {
                            box.lo[d] = random.unit<T>() * world;
                            box.hi[d] = box.lo[d] + random.unit<T>();
                        }
                jostle::PairFinder finder;
                const auto count = [](const jostle::PairChunk&) { return true; };
                for (const bool swapped : {false, true}) {
                    const BoxView<K::dim, T> a(swapped ? others : crowd), b(swapped ? crowd : others);
                    EXPECT_TRUE(finder.stream(a, b, count));
                    const jostle::Stats& stats = finder.stats();
                    const double work = static_cast<double>(stats.objects) + static_cast<double>(stats.pairs);
                    const std::string what =
                        kind_name<K::dim, T>() + ", " + std::to_string(few) + " in " + std::to_string(world);
                    EXPECT_LE(static_cast<double>(stats.candidates) / work, 60) << what;
                    EXPECT_LE(static_cast<double>(stats.records) / 80'000, 8) << what;
                }
            }
    });
}

TEST(HostileMemory, AllInOnePlaceStreamsInBoundedMemory)
{
    // 200 million pairs would take 1.6 GB.
    const std::size_t n = 20'000;
    const Boxes<3, float> boxes = make_scene<3, float>(Scene::identical, n, 1);
    CountingMemory memory;
    jostle::FinderOptions options;
    options.memory = &memory;
    std::atomic<std::uint64_t> pairs{0};
    const auto count = [&](const jostle::PairChunk& chunk) {
        pairs += chunk.pairs.size();
        return true;
    };
    EXPECT_TRUE(jostle::PairFinder(options).stream(BoxView<3, float>(boxes), count));
    EXPECT_EQ(pairs, n * (n - 1) / 2);
    EXPECT_LE(memory.peak, 64u << 20);
}

TEST(HostileStats, CountsDoNotDependOnThreadsOrInstructionSet)
{
    const Boxes<3, float> boxes = make_scene<3, float>(Scene::piles_among_large, 20'000, 1);
    jostle::FinderOptions options;
    options.executor = &jostle::serial_executor();
    const auto counts = [&] {
        jostle::PairFinder finder(options);
        (void)finder.find(BoxView<3, float>(boxes));
        const jostle::Stats& stats = finder.stats();
        EXPECT_GT(stats.ms_total, 0);
        EXPECT_GT(stats.bytes_reserved, 0u);
        return std::vector<std::uint64_t>{stats.objects, stats.pairs,  stats.records,     stats.candidates,
                                          stats.ties,    stats.bricks, stats.nested_grids};
    };
    const std::vector<std::uint64_t> expected = counts();
    EXPECT_EQ(expected[0], boxes.size());
    EXPECT_GT(expected[1], 1'000u);
    for (const NamedExecutor& executor : all_executors())
        for (const auto set : jostle::supported_instruction_sets()) {
            options.executor = executor.executor.get();
            options.instruction_set = set;
            EXPECT_EQ(counts(), expected) << executor.name << " " << jostle::name(set);
        }
}

} // namespace
} // namespace contract
