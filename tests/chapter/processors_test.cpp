// SPDX-License-Identifier: MIT
// Work over the processors: Alg. 9, Alg. 11 to 16.
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

#include "scene.hpp"

using namespace jostle;
using namespace chapter_test;

namespace {

const std::vector<std::uint32_t> processor_counts = {1, 2, 3, 7, 16};

TEST(ChapterBatches, EveryPairIsTestedOnce)
{
    for (const std::size_t size : {0u, 1u, 5u, 1000u}) {
        std::vector<Pair> pairs(size);
        for (std::uint32_t i = 0; i < size; ++i)
            pairs[i] = {i, i + 1};
        for (const std::uint32_t processors : processor_counts)
            for (const auto batching :
                 {chapter::Batching::critical_section, chapter::Batching::atomic_cursor})
                for (const std::uint32_t batch : {1u, 7u, 64u, 4'000'000'000u}) {
                    std::vector<std::atomic<int>> tested(size);
                    std::atomic<bool> known_processor = true;
                    const auto executor = make_thread_executor(processors);
                    chapter::test_collisions(
                        pairs, *executor,
                        [&](std::uint32_t processor, const Pair& pair) {
                            ++tested[pair.a];
                            if (processor >= processors || pair.b != pair.a + 1) known_processor = false;
                        },
                        batching, batch);
                    ASSERT_TRUE(known_processor);
                    for (const std::atomic<int>& times : tested)
                        ASSERT_EQ(times, 1);
                }
    }
}

TEST(ChapterBatches, GridHandsItsPairsToTheTest)
{
    const Boxes<3, float> boxes = mixed_sizes<3, float>(500, 8, 12, 1);
    auto grid = grid_of(boxes, {{1, 2, 4, 8}});
    const std::vector<Pair> truth = brute(boxes);
    ASSERT_GT(truth.size(), 200u);
    for (const auto batching : {chapter::Batching::critical_section, chapter::Batching::atomic_cursor}) {
        const auto executor = make_thread_executor(3);
        std::vector<std::vector<Pair>> tested(3);
        grid.process_collision_detection(
            *executor, [&](std::uint32_t processor, const Pair& pair) { tested[processor].push_back(pair); },
            batching, 10);
        std::vector<Pair> all;
        for (const std::vector<Pair>& part : tested)
            all.insert(all.end(), part.begin(), part.end());
        EXPECT_EQ(sorted(all), truth);
        EXPECT_EQ(sorted(grid.close_pairs()), truth);
    }
}

TEST(ChapterBatches, ErrorsLeaveTheCall)
{
    const std::vector<Pair> pairs(100, Pair{0, 1});
    const auto nothing = [](std::uint32_t, const Pair&) {};
    EXPECT_THROW(
        chapter::test_collisions(pairs, serial_executor(), nothing, chapter::Batching::atomic_cursor, 0),
        Error);
    const auto executor = make_thread_executor(4);
    for (const auto batching : {chapter::Batching::critical_section, chapter::Batching::atomic_cursor})
        EXPECT_THROW(chapter::test_collisions(
                         pairs, *executor,
                         [](std::uint32_t, const Pair&) { throw std::runtime_error("the user's"); }, batching,
                         3),
                     std::runtime_error);
}

TEST(ChapterProcessors, TheLowestProcessorsExceptionLeavesTheCall)
{
    for (const std::uint32_t processors : processor_counts) {
        std::atomic<std::uint32_t> done = 0;
        try {
            chapter::on_all_processors(*make_thread_executor(processors),
                                       [&](std::uint32_t processor, std::uint32_t all) {
                                           ++done;
                                           if (all == processors) throw processor;
                                       });
            FAIL();
        } catch (const std::uint32_t processor) {
            EXPECT_EQ(processor, 0u);
            EXPECT_EQ(done, processors);
        }
    }
}

/// Every pair i < j once, over all processors together, and both objects' events for those that collide.
template <class Share>
void check_all_pairs(std::uint32_t objects, std::uint32_t processors, Share share)
{
    std::vector<Pair> tests, events;
    for (std::uint32_t p = 0; p < processors; ++p)
        share(
            p, processors, objects,
            [&](std::uint32_t i, std::uint32_t j) {
                tests.push_back({i, j});
                return (i + j) % 3 == 0;
            },
            [&](std::uint32_t object, std::uint32_t other) { events.push_back({object, other}); });
    std::vector<Pair> all, collisions;
    for (std::uint32_t i = 0; i < objects; ++i)
        for (std::uint32_t j = 0; j < objects; ++j) {
            if (i < j) all.push_back({i, j});
            if (i != j && (i + j) % 3 == 0) collisions.push_back({i, j});
        }
    ASSERT_EQ(sorted(tests), all) << objects << " objects, " << processors << " processors";
    ASSERT_EQ(sorted(events), collisions);
}

TEST(ChapterAllPairs, EverySplitTestsEveryPairOnce)
{
    for (const std::uint32_t objects : {0u, 1u, 2u, 3u, 9u, 10u, 64u}) {
        check_all_pairs(objects, 1, [](auto, auto, auto n, auto test, auto on_collision) {
            chapter::process_collision_serial(n, test, on_collision);
        });
        for (const std::uint32_t processors : {1u, 2u, 3u, 4u, 7u, 100u}) {
            check_all_pairs(objects, processors, [](auto p, auto all, auto n, auto test, auto on_collision) {
                chapter::process_collision_blocks(p, all, n, test, on_collision);
            });
            check_all_pairs(objects, processors, [](auto p, auto all, auto n, auto test, auto on_collision) {
                chapter::process_collision_zigzag(p, all, n, test, on_collision);
            });
        }
    }
}

TEST(ChapterAllPairs, ZigZagSharesAreNearlyEqual)
{
    constexpr std::uint32_t objects = 999;
    for (const std::uint32_t processors : {2u, 4u, 7u}) {
        std::uint64_t least = ~std::uint64_t{0}, most = 0;
        for (std::uint32_t p = 0; p < processors; ++p) {
            std::uint64_t tests = 0;
            chapter::process_collision_zigzag(
                p, processors, objects, [&](std::uint32_t, std::uint32_t) { return ++tests, false; },
                [](std::uint32_t, std::uint32_t) {});
            least = std::min(least, tests);
            most = std::max(most, tests);
        }
        EXPECT_LT(most - least, objects);
    }
}

struct Push
{
    double x = 0, y = 0, z = 0;
    Push& operator+=(const Push& other)
    {
        x += other.x;
        y += other.y;
        z += other.z;
        return *this;
    }
    bool operator==(const Push&) const = default;
};

TEST(ChapterResponses, DenseAndSparseEqualTheSerialLoop)
{
    const Boxes<3, float> boxes = mixed_sizes<3, float>(300, 4, 6, 3);
    const auto n = static_cast<std::uint32_t>(boxes.size());
    const auto test = [&](std::uint32_t i, std::uint32_t j) { return overlaps(boxes[i], boxes[j]); };
    const auto respond = [](std::uint32_t object, std::uint32_t other) {
        return std::int64_t{object} * 1000 + other;
    };
    std::vector<std::int64_t> truth(n);
    chapter::process_collision_serial(
        n, test, [&](std::uint32_t object, std::uint32_t other) { truth[object] += respond(object, other); });
    ASSERT_GT(std::count_if(truth.begin(), truth.end(), [](auto sum) { return sum != 0; }), 100);
    for (const std::uint32_t processors : processor_counts) {
        const auto executor = make_thread_executor(processors);
        chapter::DenseResponses<std::int64_t> dense(n, processors);
        chapter::SparseResponses<std::int64_t> sparse(n, processors);
        for (int frame = 0; frame < 2; ++frame) { // the second starts from nothing again
            const auto from_dense = chapter::process_collision_responses(*executor, n, test, respond, dense);
            EXPECT_TRUE(std::equal(from_dense.begin(), from_dense.end(), truth.begin(), truth.end()));
            const auto from_sparse =
                chapter::process_collision_responses(*executor, n, test, respond, sparse);
            EXPECT_TRUE(std::equal(from_sparse.begin(), from_sparse.end(), truth.begin(), truth.end()));
        }
    }
}

TEST(ChapterResponses, SparseSumsDoNotDependOnTheProcessors)
{
    constexpr std::uint32_t n = 200;
    const auto test = [](std::uint32_t i, std::uint32_t j) { return (i * 7 + j) % 3 != 0; };
    const auto respond = [](std::uint32_t object, std::uint32_t other) { // sums that rounding reorders
        return Push{std::pow(1.37, other % 50) * (other % 2 ? 1 : -1), 0.1 * object, 1.0 / (other + 1)};
    };
    std::vector<Push> first;
    for (const std::uint32_t processors : processor_counts) {
        chapter::SparseResponses<Push> responses(n, processors);
        const auto executor = make_thread_executor(processors);
        const auto merged = chapter::process_collision_responses(*executor, n, test, respond, responses);
        if (first.empty()) first.assign(merged.begin(), merged.end());
        EXPECT_TRUE(std::equal(merged.begin(), merged.end(), first.begin(), first.end()));
    }
}

TEST(ChapterResponses, SparseSumsAddUpByTheOtherObjectsNumber)
{
    // Two large ones cancel each other out, and what comes then is kept: in another order it would be lost.
    chapter::SparseResponses<double> responses(1, 2);
    responses.add(1, 0, 9, 1.0);
    responses.add(0, 0, 5, -1e20);
    responses.add(1, 0, 3, 1e20);
    EXPECT_EQ(responses.merge(serial_executor())[0], 1.0);
}

// Where the last response was added: what cores share is a question of addresses.
struct Located
{
    static inline const Located* last = nullptr;
    char values[3] = {};
    Located& operator+=(const Located&)
    {
        last = this;
        return *this;
    }
};

TEST(ChapterResponses, TwoProcessorsNeverShareACacheLine)
{
    const auto line_of = [](const Located* response) {
        return reinterpret_cast<std::uintptr_t>(response) / chapter::cache_line;
    };
    constexpr std::uint32_t objects = 50, processors = 8;
    chapter::DenseResponses<Located> responses(objects, processors);
    std::vector<std::pair<std::uintptr_t, std::uintptr_t>> lines; // first and last of each processor
    for (std::uint32_t p = 0; p < processors; ++p) {
        responses.add(p, 0, 1, {});
        const std::uintptr_t first = line_of(Located::last);
        responses.add(p, objects - 1, 1, {});
        lines.push_back({first, line_of(Located::last)});
    }
    std::sort(lines.begin(), lines.end());
    for (std::size_t p = 1; p < lines.size(); ++p)
        EXPECT_GT(lines[p].first, lines[p - 1].second);
}

} // namespace
