// SPDX-License-Identifier: MIT
// The same pairs in the same order from any threads, instruction set, executor, compiler, and history.
//
// golden.txt holds one line per scene: its name, count and checksum of the pairs, and a hash of their order.
// The set is checked against the oracle too, so the file can be made again without fear when an engine
// changes the order on purpose:
//   JOSTLE_REGENERATE_GOLDEN=1 ctest -R Golden
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "harness.hpp"
#include "jostle/jostle.hpp"

namespace contract {
namespace {

/// Depends on the order: FNV-1a over a and b of each pair in turn.
std::uint64_t order_hash(const std::vector<Pair>& pairs)
{
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const Pair& pair : pairs)
        for (const std::uint32_t value : {pair.a, pair.b})
            for (int byte = 0; byte < 4; ++byte)
                hash = (hash ^ (value >> 8 * byte & 0xff)) * 0x100000001b3u;
    return hash;
}

std::string hex(std::uint64_t value)
{
    std::ostringstream text;
    text << std::hex << std::setw(16) << std::setfill('0') << value;
    return text.str();
}

/// Both sets of a cross form are drawn from one seed: then lines lie on one axis and identical boxes meet.
template <int Dim, class T>
Question<Dim, T> question_of(Scene scene, std::size_t n, bool cross)
{
    Question<Dim, T> question;
    question.cross = cross;
    question.a = make_scene<Dim, T>(scene, n, 1);
    if (cross) question.b = make_scene<Dim, T>(scene, n / 2, 1);
    return question;
}

/// Calls f(question, its name) for every scene, kind, and form.
template <class F>
void for_each_question(F&& f)
{
    for_each_kind([&]<class K>(K) {
        using T = typename K::Number;
        for (const Scene scene : all_scenes())
            for (const bool cross : {false, true})
                f(question_of<K::dim, T>(scene, everything_touches(scene) ? 300 : 1'200, cross),
                  kind_name<K::dim, T>() + (cross ? "x_" : "_") + name(scene));
    });
}

/// Two piles of equal boxes so close to each other that one block of work finds both. Each is too much for
/// one worker and can't be divided, so the block leaves two jobs behind, whose order shows in the pairs with
/// a few boxes of a second set.
Question<3, float> two_piles()
{
    Question<3, float> question;
    question.cross = true;
    question.a = make_scene<3, float>(Scene::uniform, 4'000, 1);
    for (const float at : {5.0f, 5.01f}) {
        question.a.insert(question.a.end(), 6'000, {{at, at, at}, {at + 0.001f, at + 0.001f, at + 0.001f}});
        question.b.insert(question.b.end(), 3, {{at, at, at}, {at, at, at}});
    }
    return question;
}

/// The same with crowds that can be divided, and so become grids that all threads share. One lies beside the
/// first on each axis: whichever bricks are numbered along, two crowds lie in one block.
Question<3, float> crowds_side_by_side()
{
    Question<3, float> question{make_scene<3, float>(Scene::uniform, 30'000, 1)};
    Random random(1);
    for (int i = 0; i < 140'000; ++i) {
        jostle::Aabb3f& box = question.a.emplace_back();
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = 20 + random.unit<float>() / 64 + (d == i % 4 ? 2.5f : 0);
            box.hi[d] = box.lo[d] + random.unit<float>() / 2048;
        }
    }
    return question;
}

/// Few boxes among so many more that are `world` wide together that the grid is cut for the few.
template <int Dim, class T>
Question<Dim, T> few_in_a_crowd(std::size_t few, T world)
{
    Question<Dim, T> question;
    question.cross = true;
    Random random(few);
    for (std::size_t i = 0; i < 40'000 + few; ++i) {
        jostle::Aabb<Dim, T>& box = (i < few ? question.b : question.a).emplace_back();
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = random.unit<T>() * world;
            box.hi[d] = box.lo[d] + (i % 3 == 0 ? 1 : random.unit<T>());
        }
    }
    return question;
}

/// The same for a few scenes that are large enough for every thread to have its share.
template <class F>
void for_each_large_question(F&& f)
{
    constexpr std::size_t n = 40'000;
    f(question_of<3, float>(Scene::dense, n, false), "3f_dense_large");
    f(question_of<3, double>(Scene::nested_clusters, n, false), "3d_nested_clusters_large");
    f(question_of<2, float>(Scene::piles_among_large, n, false), "2f_piles_among_large_large");
    f(question_of<3, float>(Scene::touching_voxels, n, true), "3fx_touching_voxels_large");
    f(two_piles(), "3fx_two_piles_large");
    f(crowds_side_by_side(), "3f_crowds_side_by_side_large");
    f(few_in_a_crowd<3, float>(9, 3), "3fx_few_in_a_crowd_large");
    f(few_in_a_crowd<2, double>(1'000, 30), "2dx_few_in_a_crowd_large");
    f(few_in_a_crowd<3, double>(200, 2), "3dx_few_in_one_place_large");
}

class OrderOn : public ::testing::TestWithParam<std::size_t>
{
};
INSTANTIATE_TEST_SUITE_P(Executors, OrderOn, ::testing::Range(std::size_t{0}, all_executors().size()),
                         [](const auto& instance) {
                             std::string text = all_executors()[instance.param].name;
                             std::replace(text.begin(), text.end(), ' ', '_');
                             return text;
                         });

TEST_P(OrderOn, EqualsTheSerialOne)
{
    // One finder for everything, so that what it was asked before would show too.
    jostle::FinderOptions options;
    options.executor = all_executors()[GetParam()].executor.get();
    jostle::PairFinder finder(options);
    Manner serial, here;
    serial.options.executor = &jostle::serial_executor();
    here.finder = &finder;
    const auto compare = [&](const auto& question, const std::string& what) {
        const std::vector<Pair> expected = ask(question, serial);
        for (const auto form : {Manner::canonical, Manner::streamed}) {
            here.form = form;
            ASSERT_TRUE(ask(question, here) == expected) << what; // too long to print
        }
    };
    for_each_question(compare);
    for_each_large_question(compare);
}

TEST(Order, SameOnEveryInstructionSetAndLayout)
{
    const auto sets = jostle::supported_instruction_sets();
    ASSERT_FALSE(sets.empty());
    // Where every machine has more, there is no scalar code.
#if !defined(__ARM_NEON) && !defined(__SSE4_2__) && !defined(__wasm_simd128__)
    ASSERT_EQ(std::count(sets.begin(), sets.end(), jostle::InstructionSet::scalar), 1);
#endif
    std::uint64_t found = 0;
    const auto compare = [&](const auto& question, const std::string& what) {
        const std::vector<Pair> expected = ask(question);
        found += expected.size();
        for (const auto set : sets)
            for (const Layout layout :
                 {Layout::boxes, Layout::inside_structs, Layout::columns, Layout::backwards}) {
                Manner manner;
                manner.options.instruction_set = set;
                manner.layout = layout;
                ASSERT_TRUE(ask(question, manner) == expected) << what << " on " << jostle::name(set);
            }
    };
    for_each_question(compare);
    for_each_large_question(compare);
    EXPECT_GT(found, 300'000u);
}

TEST(InstructionSets, OneThatCantBeRunHereIsRefused)
{
    const auto sets = jostle::supported_instruction_sets();
    for (const auto set : {jostle::InstructionSet::avx512, jostle::InstructionSet::neon}) {
        const bool known = std::find(sets.begin(), sets.end(), set) != sets.end();
        const auto refuses = [&](const auto& make) {
            try {
                make();
            } catch (const jostle::Error& error) {
                EXPECT_EQ(error.code(), jostle::ErrorCode::invalid_argument);
                EXPECT_NE(std::string(error.what()).find(jostle::name(set)), std::string::npos);
                return true;
            }
            return false;
        };
        jostle::FinderOptions finder;
        jostle::ContactOptions contacts;
        jostle::IndexOptions index;
        jostle::WorldOptions world;
        finder.instruction_set = contacts.instruction_set = index.instruction_set = world.instruction_set =
            set;
        EXPECT_EQ(refuses([&] { jostle::PairFinder{finder}; }), !known);
        EXPECT_EQ(refuses([&] { jostle::ContactFinder3f{contacts}; }), !known);
        EXPECT_EQ(refuses([&] { jostle::BoxIndex<3, float>{index}; }), !known);
        EXPECT_EQ(refuses([&] { jostle::World3f{world}; }), !known);
    }
}

#if defined(__SSE2__)
/// Sets a thread's mode, as a program does that was linked with -ffast-math.
class Flushing
{
  public:
    Flushing() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040); }
    ~Flushing() { _mm_setcsr(before_); }

  private:
    unsigned before_;
};

TEST(Order, SameWhereTheHostFlushesDenormals)
{
    // Neighbours a denormal apart, and boxes of denormal size.
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 20'000; ++i) {
        const float y = static_cast<float>(i % 200), z = static_cast<float>(i / 200);
        boxes.push_back({{-1, y, z}, {0, y, z}});
        boxes.push_back({{i % 2 == 0 ? 1e-40f : -1e-40f, y, z}, {1, y, z}});
        boxes.push_back({{2, y, z}, {2, y + 1e-41f, z + 1e-42f}});
    }
    const std::vector<Pair> expected = jostle::find_pairs(boxes).to_vector();
    EXPECT_EQ(expected.size(), 10'000u);
    std::vector<jostle::Aabb3f> tiny;
    for (int i = 0; i < 20'000; ++i) {
        const auto x = static_cast<float>(i * 7919 % 20'000) * 1e-42f;
        tiny.push_back({{x, 0, 0}, {x, 0, 0}});
    }
    std::vector<std::uint32_t> expected_order(tiny.size()), order(tiny.size());
    jostle::spatial_order(jostle::box_view(tiny), expected_order);
    const auto run = [](void*, std::uint32_t count, void (*task)(void*, std::uint32_t), void* context) {
        std::vector<std::thread> threads;
        for (std::uint32_t i = 0; i < count; ++i)
            threads.emplace_back([=] {
                const Flushing flushing;
                task(context, i);
            });
        for (std::thread& thread : threads)
            thread.join();
    };
    jostle::CallbackExecutor flushing_threads(3, nullptr, run);
    for (jostle::Executor* executor : {&jostle::serial_executor(), &jostle::default_executor(),
                                       static_cast<jostle::Executor*>(&flushing_threads)})
        for (const auto set : jostle::supported_instruction_sets()) {
            jostle::FinderOptions options;
            options.executor = executor;
            options.instruction_set = set;
            jostle::PairFinder finder(options);
            const Flushing flushing;
            const unsigned mode = _mm_getcsr();
            EXPECT_EQ(finder.find(boxes).to_vector(), expected) << jostle::name(set);
            jostle::spatial_order(jostle::box_view(tiny), order, options);
            EXPECT_EQ(order, expected_order);
            EXPECT_EQ(_mm_getcsr() & 0x8040u, mode & 0x8040u) << "it must be left as it was";
        }
}
#endif

TEST(Order, SameInManyRuns)
{
    const Question<3, float> question{make_scene<3, float>(Scene::dense, 10'000, 1)};
    const std::unique_ptr<jostle::Executor> executor = jostle::make_thread_executor(4);
    Manner manner;
    manner.options.executor = executor.get();
    const std::vector<Pair> expected = ask(question, manner);
    jostle::PairFinder finder(manner.options);
    for (int run = 0; run < 10; ++run) {
        manner.finder = run % 2 == 0 ? &finder : nullptr;
        ASSERT_TRUE(ask(question, manner) == expected) << run;
    }
}

using Golden = std::map<std::string, std::string>;

Golden compute_golden(jostle::InstructionSet set)
{
    Golden lines;
    const auto add = [&](const auto& question, const std::string& what) {
        Manner manner;
        manner.options.instruction_set = set;
        const std::vector<Pair> pairs = ask(question, manner);
        EXPECT_TRUE(sorted(pairs) == large_oracle(question)) << what;
        lines[what] = std::to_string(pairs.size()) + " " + hex(jostle::pair_checksum(pairs)) + " " +
                      hex(order_hash(pairs));
    };
    for_each_question(add);
    for_each_large_question(add);
    return lines;
}

TEST(Order, EqualsTheGoldenFile)
{
    if (environment_number("JOSTLE_REGENERATE_GOLDEN", 0) != 0) {
        const Golden lines = compute_golden(jostle::InstructionSet::scalar);
        ASSERT_FALSE(HasFailure()) << "the file is as it was: the pairs themselves are wrong";
        std::ofstream file(JOSTLE_GOLDEN_FILE);
        for (const auto& [what, values] : lines)
            file << what << " " << values << "\n";
        ASSERT_TRUE(file.flush()) << "cannot write " << JOSTLE_GOLDEN_FILE;
    }
    Golden expected;
    std::ifstream file(JOSTLE_GOLDEN_FILE);
    for (std::string what, values; file >> what && std::getline(file >> std::ws, values);)
        expected[what] = values;
    ASSERT_FALSE(expected.empty())
        << JOSTLE_GOLDEN_FILE << " is missing or empty; make it: JOSTLE_REGENERATE_GOLDEN=1 ctest -R Golden";
    for (const auto set : jostle::supported_instruction_sets())
        EXPECT_EQ(compute_golden(set), expected) << jostle::name(set);
}

} // namespace
} // namespace contract
