// SPDX-License-Identifier: MIT
// Arguments that are wrong in one place only, and what the error says of them.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "jostle/find_pairs.hpp"
#include "tests/contract/error_of.hpp"

namespace {

using namespace jostle;
using contract::message_of;

TEST(Argument, EveryPointerOfAViewIsLookedAt)
{
    const std::vector<float> zeros(2, 0.0f);
    const float* const good = zeros.data();
    for (int bad = 0; bad < 6; ++bad) {
        std::array<const float*, 3> lo{good, good, good}, hi{good, good, good};
        (bad < 3 ? lo : hi)[static_cast<std::size_t>(bad % 3)] = nullptr;
        EXPECT_EQ(message_of([&] { (void)find_pairs(BoxView<3, float>::arrays(lo, hi, 2)); }),
                  "a view of 2 boxes with a null pointer");
    }
}

TEST(Argument, OfTwoSetsTheOneWithANullPointerIsNamed)
{
    const std::vector<Aabb2f> boxes(3, Aabb2f{{0, 0}, {1, 1}});
    const BoxView<2, float> good(boxes), bad = BoxView<2, float>::strided(nullptr, nullptr, 3, 4);
    PairFinder finder;
    EXPECT_EQ(message_of([&] { (void)finder.find(bad, good); }), "a view of 3 boxes a with a null pointer");
    EXPECT_EQ(message_of([&] { (void)finder.find(good, bad); }), "a view of 3 boxes b with a null pointer");
}

TEST(Argument, AFilterColumnMayBeNeitherTooShortNorTooLong)
{
    const std::vector<Aabb2f> boxes(3, Aabb2f{{0, 0}, {1, 1}});
    for (const std::size_t entries : {2u, 4u}) {
        const std::vector<std::uint32_t> column(entries, 1u);
        Filter filter;
        filter.owner = std::span<const std::uint32_t>(column);
        EXPECT_EQ(message_of([&] { (void)find_pairs(boxes, filter); }),
                  "filter owner has " + std::to_string(entries) +
                      " entries for 3 objects; give one per object, or none");
    }
}

TEST(Argument, OfCategoryAndMaskTheMissingOneIsNamed)
{
    const std::vector<Aabb2f> boxes(3, Aabb2f{{0, 0}, {1, 1}});
    const std::vector<std::uint32_t> column(3, 1u);
    Filter filter;
    filter.category = std::span<const std::uint32_t>(column);
    EXPECT_EQ(message_of([&] { (void)find_pairs(boxes, filter); }),
              "filter category is given without mask; give both or neither");
    CrossFilter cross;
    cross.mask_b = filter.category;
    EXPECT_EQ(message_of([&] { (void)find_pairs(box_view(boxes), box_view(boxes), cross); }),
              "filter mask_b is given without category_b; give both or neither");
}

TEST(Argument, BruteForceOfTwoSetsHeedsTheFilterToo)
{
    const std::vector<Aabb2f> boxes(3, Aabb2f{{0, 0}, {1, 1}});
    const std::vector<std::uint32_t> owner{1, 2, 3}, same(3, 2u);
    CrossFilter filter;
    filter.owner_a = std::span<const std::uint32_t>(owner);
    filter.owner_b = std::span<const std::uint32_t>(same);
    const auto not_the_last = [](std::uint32_t, std::uint32_t b) { return b != 2; };
    filter.accept = not_the_last;
    const std::vector<Pair> expected{{0, 0}, {0, 1}, {2, 0}, {2, 1}};
    EXPECT_EQ(find_pairs_brute_force(box_view(boxes), box_view(boxes), filter), expected);
    EXPECT_EQ(find_pairs(box_view(boxes), box_view(boxes), filter).to_vector(), expected);
}

TEST(Stats, CountTheObjectsOfBothSets)
{
    const std::vector<Aabb2f> boxes(5, Aabb2f{{0, 0}, {1, 1}});
    PairFinder finder;
    finder.find(boxes);
    EXPECT_EQ(finder.stats().objects, 5u);
    finder.find(box_view(boxes).subview(0, 3), box_view(boxes));
    EXPECT_EQ(finder.stats().objects, 8u);
    EXPECT_EQ(finder.stats().pairs, 15u);
    finder.stream(boxes, [](const PairChunk&) { return true; });
    EXPECT_EQ(finder.stats().pairs, 10u);
}

} // namespace
