// SPDX-License-Identifier: MIT
// Few boxes, which are tested each against each, and many scenes in one call.
#include <gtest/gtest.h>

#include <atomic>
#include <initializer_list>
#include <limits>

#include "counting_memory.hpp"
#include "harness.hpp"
#include "tests/global_new.hpp"

namespace contract {
namespace {

/// The first `n` boxes of a scene, which everything else here is made of.
template <int Dim, class T>
Boxes<Dim, T> few(Scene scene, std::size_t n, std::uint64_t seed)
{
    Boxes<Dim, T> boxes = make_scene<Dim, T>(scene, std::max<std::size_t>(n, 200), seed);
    boxes.resize(n);
    return boxes;
}

TEST(Few, EverySizeOnEveryInstructionSetEqualsTheOracle)
{
    std::size_t pairs = 0;
    for_each_kind([&]<class K>(K) {
        using T = typename K::Number;
        for (const Scene scene : all_scenes())
            for (std::size_t n = 0; n <= 140; n += n < 20 || (n > 120 && n < 134) ? 1 : 13)
                for (const bool cross : {false, true}) {
                    Question<K::dim, T> question;
                    question.a = few<K::dim, T>(scene, n, n + 1);
                    question.cross = cross;
                    if (cross) {
                        question.b.assign(question.a.begin() + static_cast<std::ptrdiff_t>(n / 3),
                                          question.a.end());
                        question.a.resize(n / 2);
                    }
                    const std::vector<Pair> expected = oracle(question);
                    pairs += expected.size();
                    for (const jostle::InstructionSet set : jostle::supported_instruction_sets()) {
                        Manner manner;
                        manner.options.instruction_set = set;
                        manner.layout = static_cast<Layout>(n % static_cast<std::size_t>(Layout::count));
                        ASSERT_EQ(sorted(ask(question, manner)), expected)
                            << name(scene) << " " << n << (cross ? " cross " : " ") << jostle::name(set);
                        manner.form = Manner::sorted;
                        ASSERT_EQ(ask(question, manner), expected) << name(scene) << " " << n;
                    }
                }
    });
    EXPECT_GT(pairs, 100'000u);
}

TEST(Few, ABadBoxIsNamedWhereverItIs)
{
    for (const std::size_t n : {1u, 2u, 16u, 17u, 63u, 64u, 65u, 128u})
        for (std::size_t bad = 0; bad < n; ++bad)
            for (const bool cross : {false, true}) {
                Boxes<3, double> boxes = few<3, double>(Scene::uniform, n, 1);
                boxes[bad].hi[1] =
                    bad % 2 == 0 ? std::numeric_limits<double>::quiet_NaN() : boxes[bad].lo[1] - 1;
                jostle::PairFinder finder;
                try {
                    const Boxes<3, double> first(boxes.begin(),
                                                 boxes.begin() + static_cast<std::ptrdiff_t>(n / 2));
                    const Boxes<3, double> second(boxes.begin() + static_cast<std::ptrdiff_t>(n / 2),
                                                  boxes.end());
                    if (cross)
                        (void)finder.find(first, second);
                    else
                        (void)finder.find(boxes);
                    FAIL() << n << " " << bad;
                } catch (const jostle::Error& error) {
                    EXPECT_EQ(error.index(), cross && bad >= n / 2 ? bad - n / 2 : bad) << error.what();
                }
            }
}

/// Scenes of all sizes: none, few, many, and one that is more than half of all.
template <int Dim, class T>
struct Scenes
{
    Boxes<Dim, T> boxes;
    std::vector<std::uint64_t> offsets{0};

    void add(const Boxes<Dim, T>& scene)
    {
        boxes.insert(boxes.end(), scene.begin(), scene.end());
        offsets.push_back(boxes.size());
    }
    Boxes<Dim, T> scene(std::size_t k) const
    {
        return Boxes<Dim, T>(boxes.begin() + static_cast<std::ptrdiff_t>(offsets[k]),
                             boxes.begin() + static_cast<std::ptrdiff_t>(offsets[k + 1]));
    }
    std::size_t size() const { return offsets.size() - 1; }
};

template <int Dim, class T>
Scenes<Dim, T> all_sorts(std::uint64_t seed)
{
    Scenes<Dim, T> scenes;
    Random random(seed);
    const std::vector<Scene>& kinds = all_scenes();
    const auto any_kind = [&] { return kinds[random.below(static_cast<std::uint32_t>(kinds.size()))]; };
    for (int k = 0; k < 150; ++k)
        scenes.add(few<Dim, T>(any_kind(), random.below(130), seed + static_cast<std::uint64_t>(k)));
    scenes.add({});
    scenes.add({});
    for (int k = 0; k < 8; ++k)
        scenes.add(few<Dim, T>(any_kind(), 129 + random.below(500), seed));
    scenes.add(make_scene<Dim, T>(Scene::identical, 400, seed)); // more pairs than a chunk of the result
    scenes.add(make_scene<Dim, T>(Scene::dense, 40'000, seed));
    for (int k = 0; k < 30; ++k)
        scenes.add(few<Dim, T>(any_kind(), random.below(70), seed));
    scenes.add({});
    return scenes;
}

template <class T>
std::vector<T> slice(const std::vector<T>& values, std::uint64_t first, std::uint64_t last)
{
    if (values.empty()) return {};
    return std::vector<T>(values.begin() + static_cast<std::ptrdiff_t>(first),
                          values.begin() + static_cast<std::ptrdiff_t>(last));
}

TEST(Scenes, EachEqualsFindOfItsBoxesOnAnyExecutor)
{
    for_each_kind([&]<class K>(K) {
        using T = typename K::Number;
        const Scenes<K::dim, T> scenes = all_sorts<K::dim, T>(5);
        Random random(7);
        for (const bool filtered : {false, true}) {
            const Columns columns =
                filtered ? random_columns(random, scenes.boxes.size(), true, true) : Columns{};
            const std::uint64_t salt = filtered ? 99 : 0;
            std::vector<std::vector<Pair>> expected;
            for (std::size_t k = 0; k < scenes.size(); ++k) {
                Question<K::dim, T> question;
                question.a = scenes.scene(k);
                const std::uint64_t first = scenes.offsets[k], last = scenes.offsets[k + 1];
                if (last != first)
                    question.columns_a = {slice(columns.category, first, last),
                                          slice(columns.mask, first, last),
                                          slice(columns.owner, first, last)};
                question.accept_salt = salt == 0 ? 0 : salt + k;
                expected.push_back(ask(question));
                if (k % 16 == 0 && question.a.size() < 1'000) {
                    ASSERT_EQ(sorted(expected.back()), oracle(question));
                }
            }
            const auto accept = [&](std::size_t scene, std::uint32_t a, std::uint32_t b) {
                return accepts(salt + scene, a, b);
            };
            jostle::SceneFilter filter{std::span<const std::uint32_t>(columns.category),
                                       std::span<const std::uint32_t>(columns.mask),
                                       std::span<const std::uint32_t>(columns.owner),
                                       {}};
            if (filtered) filter.accept = accept;
            for (const NamedExecutor& executor : all_executors()) {
                jostle::FinderOptions options;
                options.executor = executor.executor.get();
                jostle::PairFinder finder(options);
                for (int again = 0; again < 2; ++again) {
                    const jostle::ScenePairs& found =
                        finder.find_scenes(scenes.boxes, scenes.offsets, filter);
                    ASSERT_EQ(found.scenes(), scenes.size());
                    std::uint64_t sum = 0;
                    for (std::size_t k = 0; k < scenes.size(); ++k) {
                        const std::vector<Pair> pairs(found[k].begin(), found[k].end());
                        ASSERT_TRUE(pairs == expected[k]) << executor.name << ", scene " << k << " of "
                                                          << scenes.scene(k).size() << " boxes";
                        sum += pairs.size();
                    }
                    EXPECT_EQ(found.size(), sum);
                    EXPECT_EQ(finder.stats().pairs, sum);
                    EXPECT_EQ(finder.stats().objects, scenes.boxes.size());
                }
            }
        }
    });
}

/// Tasks claim scenes by where they begin among the boxes: at any place, none is left out and none is taken
/// twice.
TEST(Scenes, WhereverOneBeginsItIsSearched)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    jostle::FinderOptions options;
    options.executor = threads.get();
    jostle::PairFinder finder(options);
    const Boxes<2, float> chain = [] {
        Boxes<2, float> boxes;
        for (int i = 0; i < 20'000; ++i) // each touches the next one
            boxes.push_back({{static_cast<float>(i), 0}, {static_cast<float>(i + 1), 1}});
        return boxes;
    }();
    for (std::uint64_t shift = 0; shift < 6; ++shift)
        for (const std::uint64_t length : {1022u, 1024u, 2044u, 2048u, 4096u}) {
            std::vector<std::uint64_t> offsets{0};
            for (std::uint64_t at = length + 2 - shift; at < chain.size(); at += length)
                offsets.push_back(at);
            offsets.push_back(chain.size());
            const jostle::ScenePairs& found = finder.find_scenes(chain, offsets);
            ASSERT_EQ(found.scenes(), offsets.size() - 1);
            for (std::size_t k = 0; k + 1 < offsets.size(); ++k)
                ASSERT_EQ(found[k].size(), offsets[k + 1] - offsets[k] - 1)
                    << "scene " << k << ", from box " << offsets[k];
        }
}

TEST(Scenes, WrongOffsetsAndBoxesAreNamed)
{
    Scenes<3, float> scenes;
    for (int k = 0; k < 300; ++k)
        scenes.add(few<3, float>(Scene::uniform, 40, 1));
    jostle::PairFinder finder;
    const auto refuses = [&](std::vector<std::uint64_t> offsets, std::uint64_t index,
                             const std::string& part) {
        try {
            (void)finder.find_scenes(scenes.boxes, offsets);
            ADD_FAILURE() << part;
        } catch (const jostle::Error& error) {
            EXPECT_EQ(error.index(), index) << error.what();
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    };
    std::vector<std::uint64_t> offsets = scenes.offsets;
    refuses({}, jostle::Error::no_index, "there are no offsets");
    offsets[0] = 3;
    refuses(offsets, 0, "offset 0 is 3");
    offsets = scenes.offsets;
    offsets[7] = 5;
    refuses(offsets, 7, "offset 7 is 5, less than the 240");
    offsets = scenes.offsets;
    offsets[9] = ~std::uint64_t{0};
    refuses(offsets, 10, "less than the 18446744073709551615");
    offsets = scenes.offsets;
    offsets.back() -= 1;
    refuses(offsets, 300, "is 11999, and there are 12000 boxes");
    offsets.back() += 2;
    refuses(offsets, 300, "is 12001");
    refuses({0}, 0, "is 0, and there are 12000");

    EXPECT_EQ(finder.find_scenes(scenes.boxes, scenes.offsets).scenes(), 300u);
    const std::uint64_t pairs = finder.stats().pairs;
    EXPECT_GT(pairs, 0u);
    const std::vector<std::uint32_t> owner(11);
    jostle::SceneFilter short_filter;
    short_filter.owner = std::span<const std::uint32_t>(owner);
    EXPECT_THROW((void)finder.find_scenes(scenes.boxes, scenes.offsets, short_filter), jostle::Error);

    const Boxes<3, float> good = scenes.boxes;
    scenes.boxes[11'000].lo[2] = std::numeric_limits<float>::quiet_NaN();
    scenes.boxes[7'001].hi[0] = -1e30f;
    refuses(scenes.offsets, 7'001, "box 7001: lo.x");
    EXPECT_EQ(finder.find_scenes(good, scenes.offsets).size(), pairs); // as good as before

    const BoxView<3, float> none;
    EXPECT_EQ(finder.find_scenes(none, std::vector<std::uint64_t>{0}).scenes(), 0u);
    EXPECT_EQ(finder.find_scenes(none, std::vector<std::uint64_t>{0, 0, 0}).scenes(), 2u);
}

TEST(Scenes, OfWhatAcceptThrowsTheLowestScenesLeavesTheCall)
{
    const Scenes<2, float> scenes = all_sorts<2, float>(3);
    std::vector<std::size_t> with_pairs;
    jostle::PairFinder plain;
    const jostle::ScenePairs& all = plain.find_scenes(scenes.boxes, scenes.offsets);
    for (std::size_t k = 0; k < all.scenes(); ++k)
        if (!all[k].empty()) with_pairs.push_back(k);
    for (const NamedExecutor& executor : all_executors())
        for (const std::size_t failing : {with_pairs[0], with_pairs[40], with_pairs.back()}) {
            jostle::FinderOptions options;
            options.executor = executor.executor.get();
            jostle::PairFinder finder(options);
            const auto accept = [&](std::size_t scene, std::uint32_t, std::uint32_t) -> bool {
                if (scene >= failing) throw scene;
                return true;
            };
            jostle::SceneFilter filter;
            filter.accept = accept;
            try {
                (void)finder.find_scenes(scenes.boxes, scenes.offsets, filter);
                FAIL() << executor.name;
            } catch (const std::size_t scene) {
                EXPECT_EQ(scene, failing) << executor.name;
            }
            EXPECT_EQ(finder.find_scenes(scenes.boxes, scenes.offsets).size(), all.size());
        }
}

/// The worst luck in how work is shared out: one task takes it all.
class OneTakesAll final : public jostle::Executor
{
  public:
    [[nodiscard]] std::uint32_t concurrency() const noexcept override { return 3; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        for (std::uint32_t k = 0; k < count; ++k)
            task((k + greedy) % count);
    }
    std::uint32_t greedy = 0; ///< the one
};

TEST(Scenes, ASteadyCallAllocatesNothing)
{
    const Scenes<3, float> scenes = all_sorts<3, float>(1);
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    OneTakesAll one;
    for (jostle::Executor* executor :
         std::initializer_list<jostle::Executor*>{&jostle::serial_executor(), threads.get(), &one}) {
        CountingMemory memory;
        {
            jostle::FinderOptions options;
            options.executor = executor;
            options.memory = &memory;
            jostle::PairFinder finder(options);
            std::uint64_t allocated = 0, news = 0;
            for (int frame = 0; frame < 40; ++frame) {
                const std::uint64_t allocations_before = memory.allocations, news_before = global_new::calls;
                one.greedy = static_cast<std::uint32_t>(frame);
                (void)finder.find_scenes(scenes.boxes, scenes.offsets);
                if (frame < (executor == &one ? 1 : 30)) continue;
                allocated += memory.allocations - allocations_before;
                news += global_new::calls - news_before;
            }
            EXPECT_EQ(allocated, 0u);
            EXPECT_EQ(news, 0u);
            const std::uint64_t kept = memory.bytes;
            finder.release_memory();
            EXPECT_LT(memory.bytes, kept / 16);
        }
        EXPECT_EQ(memory.bytes, 0u);
    }
}

} // namespace
} // namespace contract
