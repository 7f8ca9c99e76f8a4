// SPDX-License-Identifier: MIT
// Pairs in groups against loops over all pairs.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "jostle/jostle.hpp"
#include "random_pairs.hpp"
#include "tests/contract/counting_memory.hpp"
#include "tests/contract/error_of.hpp"

using namespace jostle;
using contract::error_of;

namespace {

/// What first_touching and least_distances are to find, from touching() and distances().
template <int Dim, class T>
struct Expected
{
    std::vector<std::uint64_t> first, nearest;
    std::vector<Distance<Dim, T>> least;

    Expected(const std::vector<Shape<Dim>>& shapes, const std::vector<Pose<Dim, T>>& poses,
             const std::vector<Pair>& pairs, const std::vector<std::uint64_t>& offsets, T max_distance)
    {
        ContactFinder<Dim, T> finder;
        std::vector<std::uint8_t> touch(pairs.size());
        std::vector<Distance<Dim, T>> distance(pairs.size());
        finder.touching({shapes, poses}, pairs, touch);
        finder.distances({shapes, poses}, pairs, max_distance, distance);
        for (std::size_t group = 0; group + 1 < offsets.size(); ++group) {
            std::uint64_t touching = no_pair, closest = no_pair;
            for (std::uint64_t i = offsets[group]; i < offsets[group + 1]; ++i) {
                if (touching == no_pair && touch[i] != 0) touching = i;
                if (std::isinf(distance[i].distance)) continue;
                if (closest == no_pair || distance[i].distance < distance[closest].distance) closest = i;
            }
            first.push_back(touching);
            nearest.push_back(closest);
            Distance<Dim, T> none{};
            none.distance = std::numeric_limits<T>::infinity();
            least.push_back(closest == no_pair ? none : distance[closest]);
        }
    }
};

template <int Dim, class T>
void agree(std::uint64_t seed, double spread, bool same_places)
{
    Random random(seed);
    const Zoo<Dim> zoo(random, 3);
    std::vector<Pose<Dim, T>> poses;
    for (std::size_t i = 0; i < zoo.shapes.size(); ++i)
        poses.push_back(random_pose<Dim, T>(random, spread));
    // Equal distances, so that the lower number has to win: each shape a second time in the same place.
    std::vector<Shape<Dim>> shapes = zoo.shapes;
    if (same_places) {
        shapes.insert(shapes.end(), zoo.shapes.begin(), zoo.shapes.end());
        poses.insert(poses.end(), poses.begin(), poses.end());
    }
    const auto objects = static_cast<std::uint32_t>(shapes.size());
    std::vector<Pair> pairs;
    std::vector<std::uint64_t> offsets{0};
    for (int group = 0; group < 110; ++group) {
        const std::uint32_t length = group % 50 == 7 ? 700 : random.below(30);
        for (std::uint32_t k = 0; k < length; ++k) {
            const std::uint32_t a = random.below(objects), b = random.below(objects);
            if (a != b && !(same_places && a % zoo.shapes.size() == b % zoo.shapes.size()))
                pairs.push_back({a, b});
        }
        offsets.push_back(pairs.size());
    }
    // The finder gets each shape once.
    const auto repeated = StridedView<Shape<Dim>>(zoo.shapes).repeated(poses.size());
    for (const T max_distance : {std::numeric_limits<T>::infinity(), T(0.75), T(0)}) {
        const Expected<Dim, T> expected(shapes, poses, pairs, offsets, max_distance);
        const std::size_t groups = expected.first.size();
        std::size_t found = 0;
        for (const std::uint64_t pair : expected.nearest)
            found += pair != no_pair ? 1 : 0;
        ASSERT_GT(found, 20u);
        for (const InstructionSet set : supported_instruction_sets())
            for (const int threads : {1, 3}) {
                const auto executor = make_thread_executor(static_cast<std::uint32_t>(threads));
                ContactFinder<Dim, T> finder({.executor = executor.get(), .instruction_set = set});
                std::vector<std::uint64_t> first(groups, 5), nearest(groups, 5);
                std::vector<Distance<Dim, T>> least(groups);
                finder.first_touching({repeated, poses}, pairs, offsets, first);
                EXPECT_EQ(first, expected.first);
                finder.least_distances({repeated, poses}, pairs, offsets, max_distance, least, nearest);
                EXPECT_EQ(nearest, expected.nearest);
                for (std::size_t group = 0; group < groups; ++group) {
                    ASSERT_EQ(least[group].distance, expected.least[group].distance) << group;
                    ASSERT_EQ(least[group].normal, expected.least[group].normal) << group;
                    ASSERT_EQ(least[group].from_a, expected.least[group].from_a) << group;
                    ASSERT_EQ(least[group].from_b, expected.least[group].from_b) << group;
                }
            }
    }
}

TEST(PairGroups, HaveTheAnswersOfLoops)
{
    agree<3, float>(1, 4, false);
    agree<3, double>(2, 6, false);
    agree<2, float>(3, 5, false);
    agree<2, double>(4, 3, false);
}

TEST(PairGroups, OfEqualPairsTheFirstCounts)
{
    agree<3, float>(5, 4, true);
    agree<2, double>(6, 4, true);
}

TEST(PairGroups, WhatComesLaterIsNotTested)
{
    // Object 2 has a pose that no test can take; a group that ends before its pair doesn't notice.
    const Shape3 ball = Shape3::sphere(1);
    std::vector<Pose3f> poses(3);
    poses[1].position = {1, 0, 0};
    poses[2].position = {NAN, 0, 0};
    std::vector<Pair> pairs(1000, Pair{0, 1});
    pairs.back() = {0, 2};
    const std::vector<std::uint64_t> offsets{0, 0, 1000};
    std::uint64_t first[2], nearest[2];
    Distance3f least[2];
    ContactFinder3f finder;
    // One shape for all, by a stride of zero.
    const StridedView<Shape3> shapes(&ball, poses.size(), 0);
    finder.first_touching({shapes, poses}, pairs, offsets, first);
    EXPECT_EQ(first[0], no_pair);
    EXPECT_EQ(first[1], 0u);
    const Error error =
        error_of([&] { finder.least_distances({shapes, poses}, pairs, offsets, 1, least, nearest); });
    EXPECT_EQ(error.index(), 2u);
    pairs.front() = {0, 3};
    const Error beyond = error_of([&] { finder.first_touching({shapes, poses}, pairs, offsets, first); });
    EXPECT_NE(std::string(beyond.what()).find("pair 0 names objects 0 and 3"), std::string::npos);
}

TEST(PairGroups, WrongGroupsAreRefused)
{
    const std::vector<Shape3> shapes(4, Shape3::sphere(1));
    const std::vector<Pose3f> poses(4);
    const std::vector<Pair> pairs{{0, 1}, {1, 2}, {2, 3}};
    std::vector<std::uint64_t> first(2), nearest(2);
    std::vector<Distance3f> least(2);
    ContactFinder3f finder;
    const auto refused = [&](const std::vector<std::uint64_t>& offsets, ErrorCode code, const char* text) {
        const Error errors[] = {
            error_of([&] { finder.first_touching({shapes, poses}, pairs, offsets, first); }),
            error_of([&] { finder.least_distances({shapes, poses}, pairs, offsets, 1, least, nearest); })};
        for (const Error& error : errors) {
            EXPECT_EQ(error.code(), code);
            EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
        }
    };
    refused({}, ErrorCode::size_mismatch, "one for each group's first pair");
    refused({1, 2, 3}, ErrorCode::invalid_argument, "offset 0 is 1");
    refused({0, 4, 3}, ErrorCode::invalid_argument, "offset 2 is 3, less than the 4");
    refused({0, 1, 2}, ErrorCode::size_mismatch, "there are 3 pairs");
    refused({0, 3}, ErrorCode::size_mismatch, "1 groups and room for 2");
    EXPECT_EQ(error_of([&] {
                  finder.least_distances({shapes, poses}, pairs, std::vector<std::uint64_t>{0, 1, 3}, 1,
                                         least, std::span(nearest).first(1));
              }).code(),
              ErrorCode::size_mismatch);
    EXPECT_EQ(error_of([&] {
                  finder.least_distances({shapes, poses}, pairs, std::vector<std::uint64_t>{0, 1, 3}, NAN,
                                         least, nearest);
              }).code(),
              ErrorCode::invalid_argument);
}

TEST(PairGroups, SteadyCallsAllocateNothing)
{
    Random random(9);
    const Zoo<3> zoo(random, 3);
    std::vector<Pose3f> poses;
    for (std::size_t i = 0; i < zoo.shapes.size(); ++i)
        poses.push_back(random.pose<float>(4));
    std::vector<Pair> pairs;
    for (std::uint32_t a = 0; a < poses.size(); ++a)
        for (std::uint32_t b = a + 1; b < poses.size(); ++b)
            pairs.push_back({a, b});
    const std::vector<std::uint64_t> offsets{0, pairs.size() / 3, pairs.size()};
    contract::CountingMemory memory;
    ContactFinder3f finder({.executor = &serial_executor(), .memory = &memory});
    std::uint64_t first[2], nearest[2];
    Distance3f least[2];
    for (int round = 0; round < 4; ++round) {
        const std::uint64_t before = memory.allocations;
        finder.first_touching({zoo.shapes, poses}, pairs, offsets, first);
        finder.least_distances({zoo.shapes, poses}, pairs, offsets, HUGE_VALF, least, nearest);
        if (round > 0) {
            EXPECT_EQ(memory.allocations, before);
        }
    }
}

} // namespace
