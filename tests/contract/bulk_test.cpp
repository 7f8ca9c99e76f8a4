// SPDX-License-Identifier: MIT
// 10,000 random and hostile scenes against the oracle.
//
//   JOSTLE_TEST_SEED=123     asks scene 123 alone, as a failure prints it
//   JOSTLE_TEST_SCENES=n     n scenes instead of 10,000
#include <gtest/gtest.h>

#include <sstream>

#include "harness.hpp"

namespace contract {
namespace {

// Builds that are slow for their checks' sake ask fewer of the same scenes.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
constexpr std::uint64_t default_scenes = 1'000;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr std::uint64_t default_scenes = 1'000;
#else
constexpr std::uint64_t default_scenes = 10'000;
#endif
#else
constexpr std::uint64_t default_scenes = 10'000;
#endif

/// Small scenes mostly, where ties and borders are; up to 5,000 boxes, where bricks, blocks and threads are.
std::size_t random_size(Random& random, Scene scene)
{
    const std::uint32_t largest_power = random.one_in(100) ? 12 : random.one_in(10) ? 9 : 6;
    const std::size_t n = random.below((1u << random.below(largest_power + 1)) + 1);
    const std::size_t extra = largest_power == 12 ? random.below(1000) : 0;
    return everything_touches(scene) ? std::min<std::size_t>(n, 600) : n + extra;
}

template <int Dim, class T>
Boxes<Dim, T> random_boxes(Random& random, std::string& description)
{
    const auto scene = static_cast<Scene>(random.below(static_cast<std::uint32_t>(Scene::count)));
    const std::size_t n = random_size(random, scene);
    description += std::string(" ") + name(scene) + " " + std::to_string(n);
    Boxes<Dim, T> boxes = make_scene<Dim, T>(scene, n, random.next());
    if (random.one_in(8)) { // two sorts of trouble at a time
        const auto other = static_cast<Scene>(random.below(static_cast<std::uint32_t>(Scene::count)));
        const std::size_t more = std::min<std::size_t>(random_size(random, other), 300);
        const Boxes<Dim, T> added = make_scene<Dim, T>(other, more, random.next());
        boxes.insert(boxes.end(), added.begin(), added.end());
        description += std::string(" + ") + name(other) + " " + std::to_string(more);
    }
    return boxes;
}

template <class V>
std::vector<V> without(const std::vector<V>& values, std::size_t first, std::size_t count)
{
    std::vector<V> rest = values;
    if (!rest.empty())
        rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(first),
                   rest.begin() + static_cast<std::ptrdiff_t>(first + count));
    return rest;
}

/// Takes boxes away as long as the answer stays wrong: what is left is a small example to look at.
template <int Dim, class T>
Question<Dim, T> smaller_example(Question<Dim, T> question, const Manner& manner)
{
    for (const bool in_b : {false, true})
        for (std::size_t count = (in_b ? question.b : question.a).size() / 2; count > 0; count /= 2)
            for (std::size_t first = 0; first + count <= (in_b ? question.b : question.a).size();) {
                Question<Dim, T> smaller = question;
                Boxes<Dim, T>& boxes = in_b ? smaller.b : smaller.a;
                Columns& columns = in_b ? smaller.columns_b : smaller.columns_a;
                boxes = without(boxes, first, count);
                columns.category = without(columns.category, first, count);
                columns.mask = without(columns.mask, first, count);
                columns.owner = without(columns.owner, first, count);
                if (sorted(ask(smaller, manner)) != oracle(smaller))
                    question = smaller;
                else
                    first += count;
            }
    return question;
}

/// Empty, or what is wrong with the library's answer to a scene drawn from `random`.
template <int Dim, class T>
std::string check_scene(Random& random, jostle::PairFinder& shared, std::uint64_t& found)
{
    std::string description = kind_name<Dim, T>();
    Question<Dim, T> question;
    question.a = random_boxes<Dim, T>(random, description);
    question.cross = random.one_in(3);
    if (question.cross) {
        description += " x";
        question.b = random_boxes<Dim, T>(random, description);
    }
    const bool masks = random.one_in(4), owners = random.one_in(4);
    question.columns_a = random_columns(random, question.a.size(), masks, owners);
    question.columns_b = random_columns(random, question.b.size(), masks, owners);
    question.accept_salt = random.one_in(4) ? random.next() | 1 : 0;
    if (!question.cross && random.one_in(4))
        question.ghosts = random.below(static_cast<std::uint32_t>(question.a.size() + 1));
    if (!question.cross && random.one_in(4)) question.vertices = random_vertices(random, question.a.size());

    Manner manner;
    manner.form = static_cast<Manner::Form>(random.below(Manner::forms));
    manner.layout = static_cast<Layout>(random.below(static_cast<std::uint32_t>(Layout::count)));
    manner.free_function = random.one_in(8);
    const auto& executors = all_executors();
    const auto& executor = executors[random.below(static_cast<std::uint32_t>(executors.size()))];
    manner.options.executor = executor.executor.get();
    const auto sets = jostle::supported_instruction_sets();
    manner.options.instruction_set = sets[random.below(static_cast<std::uint32_t>(sets.size()))];
    description += ", " + executor.name + ", " + jostle::name(manner.options.instruction_set);

    const std::vector<Pair> expected =
        question.a.size() + question.b.size() > 1000 ? large_oracle(question) : oracle(question);
    found += expected.size();
    if (random.one_in(2)) {
        Manner with_shared = manner;
        with_shared.finder = &shared;
        if (ask(question, with_shared) != ask(question, manner))
            return description + ": a used finder answers otherwise than a new one";
    }
    if (sorted(ask(question, manner)) == expected) return {};
    const Question<Dim, T> example = smaller_example(question, manner);
    std::ostringstream message;
    message << description << "\nsmaller example:\n";
    print(message, example.a);
    if (example.cross) print(message << " second set:\n", example.b);
    message << " expected " << ::testing::PrintToString(oracle(example)) << "\n got      "
            << ::testing::PrintToString(sorted(ask(example, manner)));
    return message.str();
}

TEST(Bulk, TenThousandScenesEqualTheOracle)
{
    const bool one = std::getenv("JOSTLE_TEST_SEED") != nullptr;
    const std::uint64_t first = environment_number("JOSTLE_TEST_SEED", 0);
    const std::uint64_t scenes = one ? 1 : environment_number("JOSTLE_TEST_SCENES", default_scenes);
    std::vector<jostle::PairFinder> shared(4); // asked again and again, for boxes of several kinds
    std::uint64_t found = 0;
    int failures = 0;
    for (std::uint64_t seed = first; seed < first + scenes && failures < 5; ++seed) {
        Random random(seed * 0x9e3779b97f4a7c15u + 1);
        const std::uint32_t kind = random.below(4);
        jostle::PairFinder& finder = shared[(kind + random.below(2)) % 4];
        const std::string wrong = kind == 0   ? check_scene<2, float>(random, finder, found)
                                  : kind == 1 ? check_scene<3, float>(random, finder, found)
                                  : kind == 2 ? check_scene<2, double>(random, finder, found)
                                              : check_scene<3, double>(random, finder, found);
        if (wrong.empty()) continue;
        ++failures;
        ADD_FAILURE() << "again with JOSTLE_TEST_SEED=" << seed << ": " << wrong;
    }
    EXPECT_TRUE(one || found > scenes * 50) << found;
    RecordProperty("pairs", std::to_string(found));
}

} // namespace
} // namespace contract
