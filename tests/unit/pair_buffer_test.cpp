// SPDX-License-Identifier: MIT
#include "jostle/pair_buffer.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "jostle/find_pairs.hpp"
#include "pair_arena.hpp"

using namespace jostle;

namespace {

/// Blocks {0,1}.., one per size.
void fill(PairBuffer& buffer, const std::vector<std::uint32_t>& sizes)
{
    buffer.clear();
    PairBufferAccess access(buffer);
    std::uint32_t next = 0;
    for (std::size_t block = 0; block < sizes.size(); ++block) {
        const std::span<Pair> room = access.chunk(block, std::max(1u, sizes[block]));
        ASSERT_GE(room.size(), sizes[block]);
        for (std::uint32_t i = 0; i < sizes[block]; ++i, ++next)
            room[i] = {next, next + 1};
        access.append(room.first(sizes[block]));
    }
}

std::vector<Pair> counted(std::uint32_t n)
{
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < n; ++i)
        pairs.push_back({i, i + 1});
    return pairs;
}

TEST(PairBuffer, IsEmptyAtFirst)
{
    const PairBuffer buffer;
    EXPECT_TRUE(buffer.empty());
    EXPECT_EQ(buffer.size(), 0u);
    EXPECT_TRUE(buffer.blocks().empty());
    EXPECT_EQ(buffer.begin(), buffer.end());
    EXPECT_TRUE(buffer.to_vector().empty());
    EXPECT_EQ(buffer.bytes_reserved(), 0u);
}

TEST(PairBuffer, GoesThroughItsBlocksInOrder)
{
    PairBuffer buffer;
    fill(buffer, {3, 0, 1, 5});
    EXPECT_EQ(buffer.size(), 9u);
    EXPECT_EQ(buffer.blocks().size(), 3u); // none is empty
    EXPECT_EQ(buffer.to_vector(), counted(9));
    EXPECT_TRUE(std::equal(buffer.begin(), buffer.end(), counted(9).begin()));
    EXPECT_EQ(std::distance(buffer.begin(), buffer.end()), 9);
    auto third = buffer.begin();
    third++;
    EXPECT_EQ((++third)->b, 3u);
    std::vector<Pair> copy(9);
    buffer.copy_to(copy);
    EXPECT_EQ(copy, counted(9));
}

TEST(PairBuffer, RefillsInTheSameMemory)
{
    PairBuffer buffer;
    fill(buffer, {100, 50});
    const Pair* const memory = buffer.blocks()[0].data();
    const std::uint64_t reserved = buffer.bytes_reserved();
    EXPECT_GE(reserved, 150 * sizeof(Pair));
    fill(buffer, {80, 20});
    EXPECT_EQ(buffer.blocks()[0].data(), memory);
    EXPECT_EQ(buffer.bytes_reserved(), reserved);
    buffer.clear();
    EXPECT_TRUE(buffer.empty());
    EXPECT_EQ(buffer.bytes_reserved(), reserved);
    buffer.release();
    EXPECT_EQ(buffer.bytes_reserved(), 0u);
    fill(buffer, {4});
    EXPECT_EQ(buffer.to_vector(), counted(4));
}

TEST(PairBuffer, MovesWithItsMemory)
{
    PairBuffer first;
    fill(first, {3, 2});
    const Pair* const memory = first.blocks()[0].data();
    PairBuffer second(std::move(first));
    EXPECT_EQ(second.to_vector(), counted(5));
    EXPECT_EQ(second.blocks()[0].data(), memory);
    EXPECT_TRUE(first.empty()); // moved from: empty, and may be filled again
    EXPECT_TRUE(first.blocks().empty());
    fill(first, {1});
    EXPECT_EQ(first.size(), 1u);
    first = std::move(second);
    EXPECT_EQ(first.to_vector(), counted(5));
    PairBuffer& itself = first;
    first = std::move(itself);
    EXPECT_EQ(first.size(), 5u);
}

TEST(PairBuffer, MovesBetweenMemoryResources)
{
    std::pmr::monotonic_buffer_resource other_memory;
    PairBuffer plain, other(&other_memory);
    fill(plain, {3});
    fill(other, {7});
    plain = std::move(other);
    EXPECT_EQ(plain.to_vector(), counted(7));
    plain.release();
}

TEST(PairChecksum, IsTheDocumentedSum)
{
    // Worked out from the definition by another program: mix(x): z = x + 0x9e3779b97f4a7c15; z = (z ^ z>>30)
    // * 0xbf58476d1ce4e5b9; z = (z ^ z>>27) * 0x94d049bb133111eb; z ^ z>>31. mix(0) is splitmix64's
    // well-known first output for seed 0.
    EXPECT_EQ(pair_checksum(std::vector<Pair>{}), 0u);
    EXPECT_EQ(pair_checksum(std::vector<Pair>{{0, 0}}), 0xe220a8397b1dcdafu);
    EXPECT_EQ(pair_checksum(std::vector<Pair>{{0, 1}}), 0x910a2dec89025cc1u);
    EXPECT_EQ(pair_checksum(std::vector<Pair>{{0, 1}, {7, 4000000000}}), 0xe3aacfd64542f061u);
}

TEST(PairChecksum, IgnoresOrderAndBlocksButNotSides)
{
    PairBuffer buffer;
    fill(buffer, {3, 4, 1});
    std::vector<Pair> reversed = counted(8);
    std::reverse(reversed.begin(), reversed.end());
    EXPECT_EQ(pair_checksum(buffer), pair_checksum(reversed));
    EXPECT_NE(pair_checksum(std::vector<Pair>{{1, 2}}), pair_checksum(std::vector<Pair>{{2, 1}}));
    EXPECT_NE(pair_checksum(counted(7)), pair_checksum(counted(8)));
}

TEST(InstructionSets, HaveNamesAndScalarIsThere)
{
    const auto sets = supported_instruction_sets();
    EXPECT_NE(std::find(sets.begin(), sets.end(), InstructionSet::scalar), sets.end());
    for (const InstructionSet set : sets)
        EXPECT_STRNE(name(set), "unknown");
    EXPECT_STREQ(name(InstructionSet::avx512), "avx512");
    EXPECT_STREQ(name(InstructionSet::wasm_simd), "wasm_simd");
}

} // namespace
