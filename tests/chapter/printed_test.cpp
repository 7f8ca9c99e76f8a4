// SPDX-License-Identifier: MIT
// What algorithms 6 to 10 do as they are printed: bench/ladder/printed.hpp runs them to the letter. The
// shares are those of docs/inside/chapter.md.
#include "bench/ladder/printed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <thread>

#include "scene.hpp"
#include "tool/scenes/scenes.hpp"

using namespace jostle;
using namespace chapter_test;
using jostle_ladder::Printed;

namespace {

template <int Dim, class T>
std::unique_ptr<Printed<Dim, T>> run(std::span<const Aabb<Dim, T>> boxes, std::vector<T> sizes,
                                     chapter::Hash hash = chapter::Hash::as_printed,
                                     Executor& executor = serial_executor())
{
    auto printed = std::make_unique<Printed<Dim, T>>(std::move(sizes), 1u << 16, hash);
    for (const auto& box : boxes)
        printed->add_object(box);
    printed->detect_proximity(executor);
    return printed;
}

const std::vector<float> one_level = {1};

struct Outcome
{
    double share_found; ///< of the true pairs
    std::vector<Pair> missed;
};
/// Nothing is found that isn't true, but for objects with themselves, and nothing twice.
template <int Dim, class T>
Outcome compare(std::span<const Aabb<Dim, T>> boxes, const Printed<Dim, T>& printed)
{
    std::vector<Pair> found;
    for (const Pair& pair : printed.close_pairs)
        if (pair.a != pair.b) found.push_back(pair);
    std::sort(found.begin(), found.end());
    const std::vector<Pair> truth = find_pairs_brute_force(BoxView<Dim, T>(boxes));
    EXPECT_TRUE(std::includes(truth.begin(), truth.end(), found.begin(), found.end()));
    Outcome outcome{static_cast<double>(found.size()) / static_cast<double>(truth.size()), {}};
    std::set_difference(truth.begin(), truth.end(), found.begin(), found.end(),
                        std::back_inserter(outcome.missed));
    EXPECT_EQ(found.size() + outcome.missed.size(), truth.size());
    return outcome;
}

template <int Dim>
std::vector<float> octaves(std::span<const Aabb<Dim, float>> boxes)
{
    float edge = 0;
    for (const auto& box : boxes)
        for (int d = 0; d < Dim; ++d)
            edge = std::max(edge, box.hi[d] - box.lo[d]);
    std::vector<float> sizes = {0.25f};
    while (sizes.back() < edge)
        sizes.push_back(2 * sizes.back());
    return sizes;
}

/// The shares of the true pairs that are found, and of the objects that are found to touch themselves.
struct Expected
{
    double printed, mixing, selves;
};
template <int Dim>
void check_shares(std::span<const Aabb<Dim, float>> boxes, const Expected& expected)
{
    for (const chapter::Hash hash : {chapter::Hash::as_printed, chapter::Hash::mixing}) {
        const bool as_printed = hash == chapter::Hash::as_printed;
        SCOPED_TRACE(as_printed ? "as printed" : "mixing hash");
        const auto printed = run<Dim, float>(boxes, octaves<Dim>(boxes), hash);
        const Outcome outcome = compare<Dim, float>(boxes, *printed);
        EXPECT_NEAR(outcome.share_found, as_printed ? expected.printed : expected.mixing, 0.0006);
        for (const Pair& pair : outcome.missed)
            ASSERT_NE(printed->level(pair.a), printed->level(pair.b)) << pair.a << " " << pair.b;
        const double selves = static_cast<double>(printed->selves) / static_cast<double>(boxes.size());
        EXPECT_NEAR(selves, as_printed ? expected.selves : 0, 0.0006);
    }
}

TEST(Printed, LosesPairsBetweenLevelsAndOnlyThose)
{
    struct Row
    {
        const char* scene;
        Expected flat, solid;
    };
    for (const Row& row : {Row{"uniform", {.929, .925, .802}, {.915, .884, .900}},
                           Row{"powerlaw", {.802, .733, .676}, {.873, .843, .860}},
                           Row{"mixed", {.681, .664, .663}, {.561, .504, .863}},
                           Row{"clustered", {.931, .928, .796}, {.921, .884, .906}}}) {
        SCOPED_TRACE(row.scene);
        check_shares<2>(jostle_scenes::Scene<2, float>(row.scene, 3000).boxes(), row.flat);
        check_shares<3>(jostle_scenes::Scene<3, float>(row.scene, 3000).boxes(), row.solid);
    }
    check_shares<2>(mixed_sizes<2, float>(3000, 16, 75, 1), {.810, .718, .633});
    check_shares<3>(mixed_sizes<3, float>(3000, 16, 30, 1), {.894, .739, .794});
}

TEST(Printed, IsRightWithinOneLevel)
{
    Random random(2);
    Boxes<2, float> boxes;
    for (int i = 0; i < 2000; ++i)
        boxes.push_back(random_box<2, float>(random, -20, 20, 1));
    for (const chapter::Hash hash : {chapter::Hash::as_printed, chapter::Hash::mixing})
        EXPECT_EQ((compare<2, float>(boxes, *run<2, float>(boxes, one_level, hash)).share_found), 1);
}

// The southwest cell of (x1, y1) is (x1 - 1, y1 + 1): the same sum, so the object's own bucket, where nobody
// passes over the object itself.
TEST(Printed, FindsAnObjectThatSpansTwoRowsOfCellsToTouchItself)
{
    const Boxes<2, float> boxes = {{{0.5f, 0.5f}, {0.9f, 1.2f}}, {{5.2f, 5.2f}, {5.8f, 5.8f}}};
    const auto printed = run<2, float>(boxes, one_level);
    EXPECT_EQ(printed->close_pairs, (std::vector<Pair>{{0, 0}}));
    EXPECT_EQ(printed->selves, 1u);
    EXPECT_EQ((run<2, float>(boxes, one_level, chapter::Hash::mixing)->selves),
              0u); // which tells the two cells apart

    Random random(3); // and every one of many that do
    Boxes<2, float> many;
    std::uint64_t spanning = 0;
    for (int i = 0; i < 1000; ++i) {
        many.push_back(random_box<2, float>(random, 0, 100, 1));
        spanning += std::floor(many.back().lo[1]) != std::floor(many.back().hi[1]) ? 1 : 0;
    }
    EXPECT_GT(spanning, 300u);
    EXPECT_EQ((run<2, float>(many, one_level)->selves), spanning);
}

// Two objects of one cell are met from both sides, and any pair again in each further cell of its bucket.
TEST(Printed, MeetsPairsAgain)
{
    const Boxes<2, float> boxes = {{{0.1f, 0.1f}, {0.6f, 0.6f}}, {{0.3f, 0.3f}, {0.8f, 0.8f}}};
    const auto printed = run<2, float>(boxes, one_level);
    EXPECT_EQ(printed->close_pairs, (std::vector<Pair>{{0, 1}}));
    EXPECT_EQ(printed->again, 1u); // the second object finds the first, too
}

TEST(Printed, ThreadsDontChangeWhatIsFound)
{
    const Boxes<3, double> boxes = mixed_sizes<3, double>(1000, 8, 15, 4);
    const std::vector<double> sizes = {1, 2, 4, 8};
    const auto one = run<3, double>(boxes, sizes);
    for (const std::uint32_t threads : {2u, 3u, 7u}) {
        const auto executor = make_thread_executor(threads);
        const auto many = run<3, double>(boxes, sizes, chapter::Hash::as_printed, *executor);
        EXPECT_EQ(sorted(many->close_pairs), sorted(one->close_pairs));
        EXPECT_EQ(many->candidates, one->candidates);
        EXPECT_EQ(many->again, one->again);
    }
}

TEST(Printed, BeginsAgainInEachFrame)
{
    const Boxes<2, float> boxes = mixed_sizes<2, float>(300, 8, 15, 6);
    const auto printed = run<2, float>(boxes, {1, 2, 4, 8});
    const std::vector<Pair> first = printed->close_pairs;
    const std::uint64_t candidates = printed->candidates;
    printed->detect_proximity(serial_executor());
    EXPECT_EQ(printed->close_pairs, first);
    EXPECT_EQ(printed->candidates, candidates);
}

TEST(Printed, RefusesObjectsLargerThanTheLargestCell)
{
    Printed<2, float> printed({1, 2}, 16);
    printed.add_object({{0, 0}, {2, 1}});
    EXPECT_THROW(printed.add_object({{0, 0}, {2.5f, 1}}), std::invalid_argument);
}

// Alg. 10 adds to closePairs from all threads without a lock. An append reads the length, writes the pair
// there, and writes the length back; two threads that both read before either writes keep one pair of two.
TEST(Printed, AppendingWithoutALockLosesPairs)
{
    std::atomic<std::size_t> length{0};
    std::vector<std::atomic<std::uint64_t>> close_pairs(2);
    std::barrier both_have_read(2);
    const auto append = [&](std::uint64_t pair) {
        const std::size_t at = length.load();
        both_have_read.arrive_and_wait();
        close_pairs[at].store(pair);
        length.store(at + 1);
    };
    std::thread other(append, 1);
    append(2);
    other.join();
    EXPECT_EQ(length, 1u);
}

} // namespace
