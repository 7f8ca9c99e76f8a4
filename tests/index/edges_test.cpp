// SPDX-License-Identifier: MIT
// What random questions hardly ever ask: filters at their edges, sizes that do not fit, lists used before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/contact.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/spatial_order.hpp"
#include "tests/bad_box.hpp"
#include "tests/contract/error_of.hpp"

namespace {

using namespace jostle;
using contract::message_of;

constexpr Aabb3f three_wide{{1, 1, 1}, {3, 3, 3}};

TEST(QueryFilters, WhoAsksWithoutAnOwnerGetsThoseWithoutOneToo)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(3, three_wide));
    const std::vector<std::uint32_t> owner{Filter::no_owner, 5, Filter::no_owner};
    QueryFilter filter;
    filter.owner = std::span<const std::uint32_t>(owner);
    EXPECT_EQ(index.count(three_wide, filter), 3u);
    filter.asker_owner = 5;
    EXPECT_EQ(index.count(three_wide, filter), 2u);
}

TEST(QueryFilters, OneObjectCanBeExcludedAndNothingElse)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(3, three_wide));
    QueryFilter filter;
    filter.exclude = 1;
    std::vector<std::uint32_t> found;
    index.all(three_wide, found, filter);
    EXPECT_EQ(found, (std::vector<std::uint32_t>{0, 2}));
}

TEST(QueryFilters, AcceptIsToldWhichQuestionOfABatchItIs)
{
    const auto executor = make_thread_executor(3);
    IndexOptions options;
    options.executor = executor.get();
    BoxIndex3f index(options);
    index.build(std::vector<Aabb3f>(3, three_wide));
    const auto up_to_its_number = [](std::uint32_t question, std::uint32_t id) { return id <= question % 3; };
    QueryFilter filter;
    filter.accept = up_to_its_number;
    const std::vector<Aabb3f> regions(200, three_wide);
    const std::span<const Aabb3f> batch(regions);
    ResultLists<std::uint32_t> lists;
    index.all(batch, lists, filter);
    std::vector<std::uint64_t> counts(regions.size());
    index.count(batch, std::span<std::uint64_t>(counts), filter);
    for (std::uint32_t q = 0; q < regions.size(); ++q) {
        EXPECT_EQ(counts[q], q % 3 + 1);
        ASSERT_EQ(lists[q].size(), q % 3 + 1);
        EXPECT_EQ(lists[q].back(), q % 3);
    }
}

// A search comes by all objects if a filter refuses nearly all: then it asks about them in the order of ids.
TEST(QueryFilters, ThatRefuseNearlyAllAreAskedInTheOrderOfIds)
{
    constexpr std::uint32_t count = 20'000;
    std::vector<Aabb2f> boxes;
    for (std::uint32_t id = 0; id < count; ++id) {
        const auto x = static_cast<float>(id * 7919 % 141), y = static_cast<float>(id * 104'729 % 149);
        boxes.push_back({{x, y}, {x + 0.5f, y + 0.5f}});
    }
    BoxIndex2f index;
    index.build(boxes);
    for (const std::uint32_t wanted : {0u, 1u, 63u, 64u, 65u, 400u}) {
        std::uint32_t asked = 0, back = 0, last = 0;
        const auto accept = [&](std::uint32_t, std::uint32_t id) {
            ++asked;
            back += id < last;
            last = id;
            return id % 50 == 7 && id / 50 < wanted;
        };
        for (const std::uint32_t most : {1u, 3u, 64u, 500u}) {
            std::vector<Hit<float>> expected, found;
            for (std::uint32_t id = 7; id / 50 < wanted; id += 50)
                expected.push_back({id, squared_distance(Vec2f{70, 75}, boxes[id])});
            std::sort(expected.begin(), expected.end());
            if (expected.size() > most) expected.resize(most);
            asked = back = 0;
            index.nearest(Nearest<2, float>{{70, 75}, most}, found, {.accept = accept});
            EXPECT_EQ(found, expected) << wanted << ' ' << most;
            EXPECT_LE(asked, 2 * count);
            EXPECT_TRUE(wanted > 1 || back <= count / 50) << wanted << " " << most;
        }
    }
}

TEST(Questions, ReplaceWhatWasInTheListBefore)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(2, three_wide));
    std::vector<std::uint32_t> found{7, 8, 9};
    index.all(three_wide, found);
    EXPECT_EQ(found, (std::vector<std::uint32_t>{0, 1}));
    std::vector<Hit<float>> hits{{7, 1.0f}};
    index.all(Ray3f{{2, 2, 0}, {0, 0, 1}}, hits);
    EXPECT_EQ(hits.size(), 2u);
    index.nearest(Nearest3f{{0, 0, 0}, 1}, hits);
    EXPECT_EQ(hits.size(), 1u);
}

TEST(QueryFilters, EveryColumnHasAnEntryForTheLastId)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(3, three_wide));
    const std::vector<std::uint32_t> two(2, 1u);
    QueryFilter filter;
    filter.owner = std::span<const std::uint32_t>(two);
    EXPECT_EQ(message_of([&] { (void)index.count(three_wide, filter); }),
              "query filter: owner has 2 entries, but the index has held ids up to 2; give one for every id, "
              "or none");
}

TEST(Refusals, OfMoreThanNumbersReachAndOfNoMemory)
{
    BoxIndex3f index;
    const Aabb3f box{{0, 0, 0}, {1, 1, 1}};
    index.build(std::span(&box, 1));
    const auto many = BoxView<3, float>::strided(box.lo.data(), box.hi.data(), ~std::size_t{0}, 0);
    std::pmr::vector<Pair> pairs;
    const auto none = [](std::uint32_t, std::uint32_t) { return true; };
    EXPECT_THROW(index.join(many, pairs), Error);
    EXPECT_THROW(index.join(many, none), Error);
    const auto one_too_many = BoxView<3, float>::strided(box.lo.data(), box.hi.data(), ~std::uint32_t{0}, 0);
    EXPECT_EQ(message_of([&] { index.build(one_too_many); }),
              "4294967295 boxes; ids have 32 bits, give at most 4294967294");
    EXPECT_EQ(message_of([&] { index.join(one_too_many, pairs); }),
              "4294967295 boxes in one call; give at most 4294967294");
    EXPECT_THROW(BoxIndex3f({.memory = nullptr}), Error);
    EXPECT_THROW(ContactFinder3f({.memory = nullptr}), Error);
}

TEST(Refusals, OfNullPointers)
{
    const auto nothing = BoxView<3, float>::strided(nullptr, nullptr, 2, sizeof(Aabb3f));
    const std::vector<std::uint32_t> ids{4, 5}, here{0, 1};
    const std::string expected = "a view of 2 boxes with a null pointer";
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(2, three_wide));
    std::pmr::vector<Pair> pairs;
    std::vector<std::uint32_t> order(2);
    EXPECT_EQ(message_of([&] { index.build(nothing); }), expected);
    EXPECT_EQ(message_of([&] { index.build(ids, nothing); }), expected);
    EXPECT_EQ(message_of([&] { index.insert(ids, nothing); }), expected);
    EXPECT_EQ(message_of([&] { index.move(here, nothing); }), expected);
    EXPECT_EQ(message_of([&] { index.join(nothing, pairs); }),
              "a view of 2 boxes to be joined with a null pointer");
    EXPECT_EQ(message_of([&] { spatial_order(nothing, order); }), expected);
    EXPECT_EQ(index.count(three_wide), 2u);
}

TEST(Refusals, OfBadBoxesLeaveWhatIsThere)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(1, three_wide));
    EXPECT_TRUE(index.bounds());
    for (std::uint64_t k = 0; k < 15; ++k) {
        std::vector<Aabb3f> bad{three_wide};
        make_bad(bad[0], k);
        const std::vector<std::uint32_t> id{7}, there{0};
        std::pmr::vector<Pair> pairs;
        EXPECT_THROW(index.build(bad), Error);
        EXPECT_THROW(index.insert(id, bad), Error);
        EXPECT_THROW(index.move(there, bad), Error);
        EXPECT_THROW(index.join(bad, pairs), Error);
        EXPECT_THROW(index.join(bad, [](std::uint32_t, std::uint32_t) { return true; }), Error);
        EXPECT_THROW((void)index.any(bad[0]), Error);
        EXPECT_THROW((void)index.any(Sweep3f{bad[0], {1, 0, 0}}), Error);
        std::vector<Hit<float>> hits;
        EXPECT_THROW(index.nearest(NearestToBox3f{bad[0]}, hits), Error);
    }
    EXPECT_EQ(index.size(), 1u);
    index.clear();
    EXPECT_FALSE(index.bounds());
}

TEST(Refusals, OfAJoinNameItsBoxes)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(9, three_wide));
    std::vector<Aabb3f> boxes(3, three_wide);
    boxes[2].hi[1] = -1;
    const std::string expected =
        "box to be joined 2: lo.y = 1 is greater than hi.y = -1; swap them or drop the box";
    std::pmr::vector<Pair> pairs;
    const auto none = [](std::uint32_t, std::uint32_t) { return true; };
    EXPECT_EQ(message_of([&] { index.join(boxes, pairs); }), expected);
    EXPECT_EQ(message_of([&] { index.join(boxes, none); }), expected);
    boxes[2] = three_wide;
    std::vector<QueryFilter> filters(3);
    const std::vector<std::uint32_t> two(2, 1u);
    filters[1].owner = std::span<const std::uint32_t>(two);
    EXPECT_EQ(message_of([&] { index.join(boxes, none, filters); }),
              "query filter 1: owner has 2 entries, but the index has held ids up to 8; give one for every "
              "id, or none");
}

TEST(Refusals, OfWhatDoesntFitTogether)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(9, three_wide));
    const std::vector<Aabb3f> regions(2, three_wide);
    for (const std::size_t room : {1u, 3u}) {
        std::vector<std::uint64_t> counts(room);
        EXPECT_EQ(message_of([&] {
                      index.count(std::span<const Aabb3f>(regions), std::span<std::uint64_t>(counts));
                  }),
                  "there are 2 queries and " + std::to_string(room) +
                      " places for answers; give one for each");
    }
    EXPECT_EQ(message_of([&] { (void)index.count(Sweep<3, float>{{{2, 0, 0}, {1, 1, 1}}, {1, 0, 0}}); }),
              "sweep: lo.x = 2 is greater than hi.x = 1; swap them or drop the query");
    // Neither side by side nor in order.
    EXPECT_EQ(message_of([&] { index.erase(std::vector<std::uint32_t>{7, 3, 8, 7}); }),
              "entry 3: id 7 comes twice in one call");
    EXPECT_EQ(index.size(), 9u);
}

TEST(Hits, AreNeverAtANegativeZero)
{
    for (const InstructionSet set : supported_instruction_sets()) {
        IndexOptions options;
        options.instruction_set = set;
        BoxIndex3f index(options);
        index.build(std::vector<Aabb3f>{three_wide});
        for (const float way : {-1.0f, 1.0f}) {
            const Ray<3, float> along_the_face{{way < 0 ? 3.0f : 1.0f, 2, 2}, {way, 0, 0}};
            const auto first = index.first(along_the_face);
            ASSERT_TRUE(first.has_value());
            EXPECT_EQ(first->at, 0);
            EXPECT_FALSE(std::signbit(first->at)) << name(set);
            std::vector<Hit<float>> all;
            index.all(along_the_face, all);
            ASSERT_EQ(all.size(), 1u);
            EXPECT_FALSE(std::signbit(all[0].at)) << name(set);
        }
    }
}

TEST(Join, OfManyBoxesIsInOrder)
{
    const auto executor = make_thread_executor(3);
    IndexOptions options;
    options.executor = executor.get();
    BoxIndex2f index(options);
    std::vector<Aabb2f> few, many;
    for (int i = 0; i < 100; ++i)
        few.push_back({{float(i), 0}, {float(i) + 1.5f, 1}});
    for (int i = 0; i < 10'000; ++i)
        many.push_back({{float(i % 97), float(i % 3)}, {float(i % 97) + 0.7f, float(i % 3) + 0.5f}});
    index.build(few);
    std::pmr::vector<Pair> pairs;
    index.join(many, pairs);
    const std::vector<Pair> expected = find_pairs_brute_force(box_view(many), box_view(few));
    EXPECT_GT(expected.size(), 10'000u);
    EXPECT_TRUE(std::equal(pairs.begin(), pairs.end(), expected.begin(), expected.end()));
}

// Boxes that touch few are asked together, those that touch many one by one, in turns.
TEST(Join, OfBoxesThatTouchManyIsAsOfThoseThatTouchFew)
{
    std::uint32_t state = 1;
    const auto random = [&](float below) {
        state = state * 1664525 + 1013904223;
        return static_cast<float>(state >> 8) / 16777216.0f * below;
    };
    // Crowds of ever more boxes side by side, so that askers in the order of places meet few, many and few.
    std::vector<Aabb3f> boxes, askers;
    std::vector<std::uint32_t> ids;
    for (int crowd = 0; crowd < 8; ++crowd)
        for (int k = 0; k < (crowd % 2 == 0 ? 20 : 100 * crowd); ++k) {
            const float x = 1000.0f * static_cast<float>(crowd) + random(2);
            boxes.push_back({{x, random(2), random(2)}, {x + 1, 3, 3}});
            ids.push_back(static_cast<std::uint32_t>(boxes.size() * 7919 % 100'003));
        }
    const float inf = std::numeric_limits<float>::infinity();
    for (int k = 0; k < 3000; ++k) {
        const float x = 1000.0f * static_cast<float>(k * 8 / 3000) + random(3);
        if (k % 1000 == 500)
            askers.push_back({{-inf, -inf, -inf}, {inf, inf, inf}});
        else if (k % 1000 == 501)
            askers.push_back({{x, -inf, 0}, {inf, inf, 0}});
        else
            askers.push_back({{x, random(3), random(3)}, {x + random(1), 3, 3}});
    }
    std::vector<Pair> expected;
    for (std::uint32_t a = 0; a < askers.size(); ++a) {
        std::vector<std::uint32_t> touched;
        for (std::size_t k = 0; k < boxes.size(); ++k)
            if (overlaps(askers[a], boxes[k])) touched.push_back(ids[k]);
        std::sort(touched.begin(), touched.end());
        for (const std::uint32_t id : touched)
            expected.push_back({a, id});
    }
    EXPECT_GT(expected.size(), 200'000u);
    const auto three = make_thread_executor(3);
    for (const InstructionSet set : supported_instruction_sets())
        for (Executor* executor : {&serial_executor(), static_cast<Executor*>(three.get())}) {
            IndexOptions options;
            options.executor = executor;
            options.instruction_set = set;
            BoxIndex3f index(options);
            index.build(ids, boxes);
            std::pmr::vector<Pair> pairs(7, Pair{1, 1});
            for (int round = 0; round < 2; ++round) {
                index.join(askers, pairs);
                EXPECT_TRUE(std::equal(pairs.begin(), pairs.end(), expected.begin(), expected.end()))
                    << name(set) << ' ' << pairs.size() << " of " << expected.size();
            }
            const std::vector<Aabb3f> bad{askers[0], {{1, 1, 1}, {0, 1, 1}}};
            EXPECT_THROW(index.join(bad, pairs), Error);
            EXPECT_TRUE(pairs.empty());
        }
}

TEST(Join, ForgetsWhatItsListHeld)
{
    BoxIndex3f index;
    index.build(std::vector<Aabb3f>(2, three_wide));
    std::pmr::vector<Pair> pairs{{8, 9}};
    index.join(std::vector<Aabb3f>{three_wide}, pairs);
    EXPECT_EQ(pairs, (std::pmr::vector<Pair>{{0, 0}, {0, 1}}));
    index.clear();
    index.join(std::vector<Aabb3f>{three_wide}, pairs);
    EXPECT_TRUE(pairs.empty());
}

} // namespace
