// SPDX-License-Identifier: MIT
#include "base/radix.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

using namespace jostle;

namespace {

struct Entry
{
    std::uint64_t key;
    std::uint32_t position;
    friend bool operator==(const Entry&, const Entry&) = default;
};

std::vector<Entry> random_entries(std::size_t count, std::uint64_t differing, std::uint64_t common)
{
    std::mt19937_64 random(count + differing);
    std::vector<Entry> entries(count);
    for (std::size_t i = 0; i < count; ++i)
        entries[i] = {(random() & differing) | common, static_cast<std::uint32_t>(i)};
    return entries;
}

std::vector<Entry> expected_of(std::vector<Entry> entries)
{
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Entry& x, const Entry& y) { return x.key < y.key; });
    return entries;
}

template <int digit_bits, int together>
void expect_sorted(std::vector<Entry> entries, std::uint64_t differing, int digit = digit_bits)
{
    const std::vector<Entry> expected = expected_of(entries);
    std::vector<Entry> spare(entries.size());
    const auto key = [](const Entry& entry) { return entry.key; };
    const Entry* const sorted =
        radix_sort<digit_bits, together>(entries.data(), spare.data(), entries.size(), key, differing, digit);
    ASSERT_TRUE(sorted == entries.data() || sorted == spare.data());
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), sorted));
}

TEST(ExclusiveSum, TurnsCountsIntoBeginnings)
{
    std::uint32_t counts[] = {3, 0, 5, 1};
    EXPECT_EQ(exclusive_sum(counts, 4), 9u);
    EXPECT_EQ(std::vector<std::uint32_t>(counts, counts + 4), (std::vector<std::uint32_t>{0, 3, 3, 8}));
    std::uint64_t later[] = {2, 2};
    EXPECT_EQ(exclusive_sum(later, 2, std::uint64_t{100}), 104u);
    EXPECT_EQ(later[0], 100u);
    EXPECT_EQ(later[1], 102u);
    EXPECT_EQ(exclusive_sum(later, 0, std::uint64_t{7}), 7u);
}

TEST(ExclusiveSum, OfPartsPutsEachKindInTheOrderOfTheParts)
{
    // Two parts with three kinds: 1 2 0 and 4 1 3.
    std::uint32_t counts[] = {1, 2, 0, 4, 1, 3};
    EXPECT_EQ(exclusive_sum_of_parts(counts, 2, 3, 10u), 21u);
    EXPECT_EQ(std::vector<std::uint32_t>(counts, counts + 6),
              (std::vector<std::uint32_t>{10, 15, 18, 11, 17, 18}));
}

TEST(RadixSort, KeepsTheOrderOfEqualKeys)
{
    for (const std::size_t count : {0, 1, 2, 3, 100, 5000}) {
        SCOPED_TRACE(count);
        const auto few_keys = random_entries(count, 0x7, 0);
        expect_sorted<8, 1>(few_keys, 0x7);
        expect_sorted<2, 1>(few_keys, 0x7);
        expect_sorted<2, 4>(few_keys, 0x7);
    }
}

TEST(RadixSort, LooksAtAllBitsThatMayDiffer)
{
    for (const std::uint64_t differing :
         {std::uint64_t{0x1}, std::uint64_t{0xffff}, std::uint64_t{0x3fffffff} << 32, ~std::uint64_t{0},
          std::uint64_t{1} << 63, (std::uint64_t{0x1ffff} << 32) | 0x1ffff,
          (std::uint64_t{1} << 63) | (std::uint64_t{1} << 40) | 1}) {
        SCOPED_TRACE(differing);
        const auto entries = random_entries(1000, differing, ~differing & 0x123456789abcdef);
        expect_sorted<8, 1>(entries, differing);
        expect_sorted<11, 1>(entries, differing);
        expect_sorted<8, 3>(entries, differing);
        expect_sorted<11, 4>(entries, differing, 7); // digits shorter than there are counters
    }
}

TEST(RadixSort, NeedsNoPassWhereNothingDiffers)
{
    std::vector<Entry> entries = random_entries(10, 0, 42), spare(10);
    const auto before = entries;
    const auto key = [](const Entry& entry) { return entry.key; };
    EXPECT_EQ((radix_sort<8>(entries.data(), spare.data(), entries.size(), key, std::uint64_t{0})),
              entries.data());
    EXPECT_EQ(entries, before);
}

} // namespace
