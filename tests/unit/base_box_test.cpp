// SPDX-License-Identifier: MIT
#include "base/box.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <string>

#include "base/checks.hpp"
#include "jostle/error.hpp"

using namespace jostle;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

TEST(BoxPredicates, OnlyNumbersInOrderAreValid)
{
    EXPECT_TRUE(valid(Aabb3f{{0, 0, 0}, {0, 1, 2}}));
    EXPECT_TRUE(valid(Aabb2d{{-infinity, 0}, {infinity, 0}}));
    for (int d = 0; d < 3; ++d) {
        Aabb3f inverted{{0, 0, 0}, {1, 1, 1}}, no_lo = inverted, no_hi = inverted;
        inverted.lo[d] = 1.5f;
        no_lo.lo[d] = nan;
        no_hi.hi[d] = nan;
        EXPECT_FALSE(valid(inverted)) << d;
        EXPECT_FALSE(valid(no_lo)) << d;
        EXPECT_FALSE(valid(no_hi)) << d;
    }
}

TEST(BoxPredicates, SameComparesEveryBound)
{
    const Aabb3f box{{1, 2, 3}, {4, 5, 6}};
    EXPECT_TRUE(same(box, box));
    EXPECT_TRUE(same(Aabb2f{{0, 0}, {0, 0}}, Aabb2f{{-0.0f, 0}, {0, -0.0f}}));
    for (int d = 0; d < 3; ++d) {
        Aabb3f low = box, high = box;
        low.lo[d] -= 0.5f;
        high.hi[d] += 0.5f;
        EXPECT_FALSE(same(box, low)) << d;
        EXPECT_FALSE(same(box, high)) << d;
    }
}

TEST(BoxPredicates, InsideIsClosedAndTakesTheInnerFirst)
{
    const Aabb3f outer{{0, 0, 0}, {4, 4, 4}};
    EXPECT_TRUE(inside(outer, outer));
    EXPECT_TRUE(inside(Aabb3f{{1, 0, 4}, {2, 4, 4}}, outer));
    EXPECT_FALSE(inside(outer, Aabb3f{{1, 0, 4}, {2, 4, 4}}));
    for (int d = 0; d < 3; ++d) {
        Aabb3f low = outer, high = outer;
        low.lo[d] = -0.5f;
        high.hi[d] = 4.5f;
        EXPECT_FALSE(inside(low, outer)) << d;
        EXPECT_FALSE(inside(high, outer)) << d;
    }
}

TEST(BoxPredicates, WithoutABranchOverlapsIsTheSame)
{
    std::mt19937 random(7);
    std::uniform_int_distribution<int> at(0, 3), size(0, 2);
    int touching = 0;
    for (int i = 0; i < 2000; ++i) {
        Aabb2d a, b;
        for (int d = 0; d < 2; ++d) {
            a.lo[d] = at(random);
            a.hi[d] = a.lo[d] + size(random);
            b.lo[d] = at(random);
            b.hi[d] = b.lo[d] + size(random);
        }
        touching += overlaps(a, b);
        EXPECT_EQ(overlaps_branchless(a, b), overlaps(a, b));
    }
    EXPECT_GT(touching, 500);
    EXPECT_LT(touching, 1900);
}

TEST(CheckBox, NamesTheBoxAndTheSet)
{
    EXPECT_NO_THROW(check_box(Aabb2f{{0, 0}, {1, 1}}, 5, "a "));
    try {
        check_box(Aabb2f{{0, 2}, {1, 1}}, 5, "a ");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::inverted_box);
        EXPECT_EQ(error.index(), 5u);
        EXPECT_EQ(std::string(error.what()).find("box a 5: lo.y = 2"), 0u) << error.what();
    }
}

} // namespace
