// SPDX-License-Identifier: MIT
// Scenes of 20,000 to 200,000 boxes against the oracle: bricks are cut on every axis, boxes cross borders on
// all of them at once, crowds get grids of their own and are shared out over the threads.
//
//   JOSTLE_TEST_SEED=123     asks the questions of seed 123 alone, as a failure prints it
//   JOSTLE_TEST_ROUNDS=n     n seeds for each scene
#include <gtest/gtest.h>

#include "harness.hpp"
#include "tool/scenes/scenes.hpp"

namespace contract {
namespace {

// Builds that are slow for their checks' sake ask of smaller scenes.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
constexpr bool slow_build = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool slow_build = true;
#else
constexpr bool slow_build = false;
#endif
#else
constexpr bool slow_build = false;
#endif
constexpr std::uint64_t default_rounds = slow_build ? 1 : 2; // of each scene, in 2D and 3D, float and double

/// From 20,000 to 200,000, mostly in the lower part.
std::size_t random_size(Random& random)
{
    if (slow_build) return 10'000 + random.below(10'000);
    const std::size_t n = 20'000 + random.below(20'000);
    return random.one_in(4) ? 5 * n : n;
}

/// Puts boxes of the same sizes `along` times as far apart on one axis and closer together on the others, so
/// that their density stays: only then is the sweep axis cut in a scene of this size.
template <int Dim, class T>
void stretch(Boxes<Dim, T>& boxes, int axis, T along)
{
    const T across = Dim == 2 ? 1 / along : 1 / std::sqrt(along);
    for (Aabb<Dim, T>& box : boxes)
        for (int d = 0; d < Dim; ++d) {
            const T lo = box.lo[d] * (d == axis ? along : across), hi = lo + (box.hi[d] - box.lo[d]);
            if (lo <= hi) box.lo[d] = lo, box.hi[d] = hi; // infinite ones stay where they are
        }
}

/// Makes every `n`th box larger by up to `most` on every axis.
template <int Dim, class T>
void grow_every(Random& random, Boxes<Dim, T>& boxes, std::size_t n, T most)
{
    for (std::size_t i = 0; i < boxes.size(); i += n)
        for (int d = 0; d < Dim; ++d)
            boxes[i].hi[d] += random.unit<T>() * most;
}

/// Clumps of clumps of clumps, each `shrink` times as small as the one that holds it. Of all boxes an eighth
/// lies in the clumps of each level, and the rest in those of the last one.
template <int Dim, class T>
Boxes<Dim, T> clumps_in_clumps(Random& random, std::size_t n, int levels, int per_level, T shrink)
{
    Boxes<Dim, T> boxes, clumps(1);
    T size = std::is_same_v<T, float> ? T(1024) : T(0x1p20);
    for (int level = 0; level <= levels; ++level, size /= shrink) {
        const std::size_t count = level == levels ? n - boxes.size() : n / 8;
        const T edge = size / world_edge<Dim, T>(count / clumps.size() + 1, 1);
        for (std::size_t i = 0; i < count; ++i) {
            Aabb<Dim, T>& box = boxes.emplace_back(clumps[i % clumps.size()]);
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] += random.unit<T>() * size;
                box.hi[d] = box.lo[d] + random.unit<T>() * edge;
            }
        }
        Boxes<Dim, T> inner; // only their lower corners count
        for (const Aabb<Dim, T>& clump : clumps)
            for (int k = 0; k < per_level; ++k) {
                inner.push_back(clump);
                for (int d = 0; d < Dim; ++d)
                    inner.back().lo[d] += random.unit<T>() * size;
            }
        clumps = std::move(inner);
    }
    return boxes;
}

/// A scene of the tests or of the benchmarks, or, with neither, clumps in clumps.
struct LargeScene
{
    std::string name;
    Scene of_tests = Scene::count;
    std::string of_benchmarks = {};
};

void PrintTo(const LargeScene& scene, std::ostream* out)
{
    *out << scene.name;
}

std::vector<LargeScene> large_scenes()
{
    std::vector<LargeScene> all = {{"clumps_in_clumps"}};
    for (const Scene scene : all_scenes())
        all.push_back({name(scene), scene});
    for (const jostle_scenes::SceneInfo& info : jostle_scenes::scene_list()) {
        LargeScene scene{"moving_" + std::string(info.name), Scene::count, std::string(info.name)};
        std::replace(scene.name.begin(), scene.name.end(), '-', '_');
        all.push_back(scene);
    }
    return all;
}

template <int Dim, class T>
Boxes<Dim, T> large_boxes(const LargeScene& scene, Random& random, std::size_t n)
{
    Boxes<Dim, T> boxes;
    bool crowd = false;
    if (!scene.of_benchmarks.empty()) {
        crowd = scene.of_benchmarks == "identical" || scene.of_benchmarks == "half-identical";
        const jostle_scenes::Scene<Dim, T> made(scene.of_benchmarks, crowd ? 1'500 : n, random.next());
        boxes.assign(made.boxes().begin(), made.boxes().end());
    } else if (scene.of_tests != Scene::count) {
        // In two dimensions a flat scene lies on a line.
        crowd = everything_touches(scene.of_tests) || (Dim == 2 && scene.of_tests == Scene::flat);
        boxes = make_scene<Dim, T>(scene.of_tests, crowd ? 1'500 : n, random.next());
    } else {
        const int levels = 2 + static_cast<int>(random.below(2));
        const int per_level = 2 + static_cast<int>(random.below(4));
        boxes = clumps_in_clumps<Dim, T>(random, n, levels, per_level, T(16));
    }
    if (crowd) { // as many would make too many pairs: they meet the boxes of another scene instead
        const Boxes<Dim, T> others = make_scene<Dim, T>(Scene::uniform, n, random.next());
        boxes.insert(boxes.end(), others.begin(), others.end());
    }
    return boxes;
}

/// Asks one question of every instruction set, each time on another executor.
template <int Dim, class T>
void check_large(const LargeScene& scene, std::uint64_t seed, std::uint64_t& found)
{
    Random random(seed * 0x9e3779b97f4a7c15u + static_cast<std::uint64_t>(Dim) * 16 + sizeof(T));
    for (const char letter : scene.name)
        random = Random(random.next() + static_cast<std::uint64_t>(letter));
    Question<Dim, T> question;
    const std::size_t n = random_size(random);
    Boxes<Dim, T> boxes = large_boxes<Dim, T>(scene, random, n);
    const int axis = static_cast<int>(random.below(Dim));
    const auto along = static_cast<T>(std::array{1, 1, 4, 16}[random.below(4)]);
    const std::size_t grown = random.one_in(2) ? 0 : 2 + random.below(100);
    if (along > 1) stretch(boxes, axis, along);
    if (grown != 0) grow_every(random, boxes, grown, T(3));
    question.cross = random.one_in(2);
    const std::uint32_t share_of_b = random.one_in(4) ? 32 : 2;
    for (const Aabb<Dim, T>& box : boxes)
        (question.cross && random.one_in(share_of_b) ? question.b : question.a).push_back(box);
    if (random.one_in(4)) {
        question.columns_a = random_columns(random, question.a.size(), true, true);
        question.columns_b = random_columns(random, question.b.size(), true, true);
    }
    if (!question.cross && random.one_in(4))
        question.ghosts = random.below(static_cast<std::uint32_t>(question.a.size() + 1));
    const std::vector<Pair> expected = large_oracle(question);
    found += expected.size();

    const auto& executors = all_executors();
    std::vector<Pair> order;
    for (const auto set : jostle::supported_instruction_sets()) {
        Manner manner;
        const NamedExecutor& executor = executors[random.below(static_cast<std::uint32_t>(executors.size()))];
        manner.options.executor = executor.executor.get();
        manner.options.instruction_set = set;
        manner.form = static_cast<Manner::Form>(random.below(Manner::forms));
        manner.layout = random.one_in(2) ? Layout::boxes : Layout::columns;
        const std::vector<Pair> answer = ask(question, manner);
        const std::string what = kind_name<Dim, T>() + (question.cross ? " two sets, " : " one set, ") +
                                 std::to_string(n) + " boxes, " + executor.name + ", " + jostle::name(set) +
                                 "; again with JOSTLE_TEST_SEED=" + std::to_string(seed);
        if (order.empty() || manner.form == Manner::sorted) {
            ASSERT_TRUE((manner.form == Manner::sorted ? answer : sorted(answer)) == expected)
                << what << ": " << answer.size() << " pairs in place of " << expected.size();
        }
        if (manner.form == Manner::sorted) continue;
        if (order.empty()) order = answer;
        ASSERT_TRUE(answer == order) << what << ": another order, or other pairs than the first set's";
    }
}

class Large : public ::testing::TestWithParam<LargeScene>
{
};
INSTANTIATE_TEST_SUITE_P(Scenes, Large, ::testing::ValuesIn(large_scenes()),
                         [](const auto& instance) { return instance.param.name; });

TEST_P(Large, EqualsTheOracleOnEveryInstructionSet)
{
    const bool one = std::getenv("JOSTLE_TEST_SEED") != nullptr;
    const std::uint64_t first = environment_number("JOSTLE_TEST_SEED", 0);
    const std::uint64_t rounds = one ? 1 : environment_number("JOSTLE_TEST_ROUNDS", default_rounds);
    std::uint64_t found = 0;
    for (std::uint64_t seed = first; seed < first + rounds && !HasFatalFailure(); ++seed)
        for_each_kind([&]<class K>(K) {
            if (!HasFatalFailure()) check_large<K::dim, typename K::Number>(GetParam(), seed, found);
        });
    EXPECT_GT(found, 1'000u * rounds);
}

/// Boxes in a corner of the boxes in a corner of ..., each corner a thousandth as wide as the one around it.
template <int Dim, class T>
Boxes<Dim, T> corners_in_corners(std::size_t n, int levels)
{
    Random random(1);
    Boxes<Dim, T> boxes(n);
    for (std::size_t i = 0; i < n; ++i) {
        const T size = std::ldexp(T(1), -10 * std::min(static_cast<int>(i % 8), levels));
        const T edge = size / world_edge<Dim, T>(n / 8, 1);
        for (int d = 0; d < Dim; ++d) {
            boxes[i].lo[d] = random.unit<T>() * size;
            boxes[i].hi[d] = boxes[i].lo[d] + random.unit<T>() * edge;
        }
    }
    return boxes;
}

// Scenes as those above are of no use unless grids are really nested in nested grids. The crowd in the corner
// lies in one brick of each grid, since the first one brings one nested grid. So those behind it are in one
// another.
TEST(Nesting, EachCornerGetsAGridInsideTheLastOnes)
{
    for_each_kind([]<class K>(K) {
        using T = typename K::Number;
        for (const std::size_t n : {std::size_t{20'000}, std::size_t{slow_build ? 20'000 : 100'000}})
            for (std::uint64_t levels = 1; levels <= 4; ++levels) {
                Question<K::dim, T> question;
                question.a = corners_in_corners<K::dim, T>(n, static_cast<int>(levels));
                jostle::PairFinder finder;
                Manner manner;
                manner.finder = &finder;
                ASSERT_TRUE(sorted(ask(question, manner)) == large_oracle(question));
                // A brick that is cut, as its boxes are small for it, counts once and may spare a level.
                EXPECT_GE(finder.stats().nested_grids, (levels + 1) / 2)
                    << kind_name<K::dim, T>() << ", " << n << " boxes, " << levels << " levels";
            }
    });
}

} // namespace
} // namespace contract
