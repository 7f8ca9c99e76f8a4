// SPDX-License-Identifier: MIT
// Joins into a vector and pair by pair, with filters.
#include <gtest/gtest.h>

#include "jostle/box_index.hpp"
#include "tests/index/twin.hpp"

namespace {

using namespace jostle;

/// In every form, with a filter for all boxes and one for each.
TEST(Join, WithFilters)
{
    twin::Random random(6);
    std::vector<Aabb3f> boxes, batch;
    for (int i = 0; i < 2000; ++i)
        boxes.push_back(twin::random_box<3, float>(random, twin::Kind::lattice));
    for (int i = 0; i < 300; ++i)
        batch.push_back(twin::random_box<3, float>(random, twin::Kind::lattice));
    std::vector<std::uint32_t> owner(boxes.size());
    for (std::uint32_t& each : owner)
        each = random.below(3);
    BoxIndex3f index;
    index.build(boxes);
    std::vector<QueryFilter> filters(batch.size());
    for (std::uint32_t a = 0; a < batch.size(); ++a) {
        filters[a].owner = owner;
        filters[a].asker_owner = a % 3;
        filters[a].exclude = 11 * a % 2000;
    }
    const auto accept = [](std::uint32_t question, std::uint32_t id) { return (question + id) % 5 != 0; };
    filters[1].accept = accept;
    const auto expect = [&](const auto& given, const auto& wanted) {
        std::pmr::vector<Pair> expected, found(3), told;
        for (std::uint32_t a = 0; a < batch.size(); ++a)
            for (std::uint32_t b = 0; b < boxes.size(); ++b)
                if (overlaps(batch[a], boxes[b]) && wanted(a, b)) expected.push_back({a, b});
        EXPECT_GT(expected.size(), 500u);
        index.join(batch, found, given);
        EXPECT_EQ(found, expected);
        std::vector<Pair> plain(7, Pair{1, 1});
        index.join(batch, plain, given);
        EXPECT_TRUE(std::equal(plain.begin(), plain.end(), expected.begin(), expected.end()));
        EXPECT_TRUE(index.join(
            batch,
            [&](std::uint32_t a, std::uint32_t b) {
                told.push_back({a, b});
                return true;
            },
            given));
        std::sort(told.begin(), told.end());
        EXPECT_EQ(told, expected);
        std::size_t calls = 0;
        EXPECT_FALSE(index.join(batch, [&](std::uint32_t, std::uint32_t) { return ++calls < 100; }, given));
        EXPECT_EQ(calls, 100u);
    };
    QueryFilter for_all;
    for_all.accept = accept;
    expect(for_all, accept);
    expect(filters, [&](std::uint32_t a, std::uint32_t b) {
        return owner[b] != a % 3 && b != 11 * a % 2000 && (a != 1 || accept(a, b));
    });
    std::pmr::vector<Pair> pairs(3);
    EXPECT_THROW(index.join(batch, pairs, std::span<const QueryFilter>(filters).first(7)), Error);
    EXPECT_TRUE(pairs.empty());
    std::vector<Pair> plain(3);
    EXPECT_THROW(index.join(batch, plain, std::span<const QueryFilter>(filters).first(7)), Error);
    EXPECT_TRUE(plain.empty());
}

} // namespace
