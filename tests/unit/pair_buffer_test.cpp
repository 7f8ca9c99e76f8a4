// SPDX-License-Identifier: MIT
#include "jostle/pair_buffer.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/block_buffer_access.hpp"
#include "jostle/error.hpp"
#include "jostle/find_pairs.hpp"
#include "tests/contract/counting_memory.hpp"

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
    for (std::uint32_t i = 0; i < 9; ++i)
        EXPECT_EQ(buffer.at(i), copy[i]);
    try {
        (void)buffer.at(9);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_STREQ(error.what(), "there is no item 9: there are 9");
    }
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
    fill(buffer, {100, 50}); // to the last item
    EXPECT_EQ(buffer.blocks()[0].data(), memory);
    fill(buffer, {70}); // what isn't needed now may be the next time
    EXPECT_EQ(buffer.bytes_reserved(), reserved);
    buffer.clear();
    EXPECT_TRUE(buffer.empty());
    EXPECT_EQ(buffer.bytes_reserved(), reserved);
    buffer.release();
    EXPECT_EQ(buffer.bytes_reserved(), 0u);
    EXPECT_TRUE(buffer.empty());
    EXPECT_TRUE(buffer.blocks().empty());
    fill(buffer, {4});
    EXPECT_EQ(buffer.to_vector(), counted(4));
}

TEST(PairBuffer, CountsTheMemoryThatItHasAndNotWhatItHad)
{
    PairBuffer grown, fresh;
    fill(grown, {100});
    fill(grown, {30'000});
    fill(fresh, {30'000});
    EXPECT_EQ(grown.bytes_reserved(), fresh.bytes_reserved());

    // Chunks that grow give back what they had, and release() all there is.
    contract::CountingMemory memory;
    PairBuffer buffer(&memory);
    jostle::PairBufferAccess access(buffer);
    for (std::size_t capacity = 1; capacity < 10'000; capacity *= 3)
        for (std::size_t chunk = 0; chunk < 3; ++chunk) {
            const auto items = access.chunk(chunk, capacity);
            ASSERT_GE(items.size(), capacity);
            ASSERT_LE(memory.bytes, 3 * capacity * sizeof(Pair) + 1000);
        }
    access.append(access.chunk(1, 0).first(2));
    EXPECT_EQ(buffer.size(), 2u);
    buffer.release();
    EXPECT_EQ(buffer.size(), 0u);
    EXPECT_TRUE(buffer.empty());
    EXPECT_TRUE(buffer.begin() == buffer.end());
    EXPECT_LT(memory.bytes, 1000u); // the lists of chunks and blocks
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

/// Counts what it has given out.
class Ledger final : public std::pmr::memory_resource
{
  public:
    std::size_t bytes = 0, allocations = 0;

  private:
    void* do_allocate(std::size_t size, std::size_t alignment) override
    {
        bytes += size;
        ++allocations;
        return std::pmr::new_delete_resource()->allocate(size, alignment);
    }
    void do_deallocate(void* memory, std::size_t size, std::size_t alignment) override
    {
        bytes -= size;
        std::pmr::new_delete_resource()->deallocate(memory, size, alignment);
    }
    bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override
    {
        return this == &other;
    }
};

TEST(PairBuffer, AssignmentTakesTheMemoryAndGivesItsOwnBack)
{
    Ledger first_memory, second_memory;
    {
        PairBuffer first(&first_memory), second(&second_memory), third(&second_memory);
        fill(first, {10});
        fill(second, {20});
        fill(third, {30});
        const std::size_t third_bytes = third.bytes_reserved();
        EXPECT_GE(third_bytes, 30 * sizeof(Pair));
        const Pair* const memory = third.blocks()[0].data();
        const std::size_t allocations = second_memory.allocations;
        second = std::move(third); // equal resources
        EXPECT_EQ(second.blocks()[0].data(), memory);
        EXPECT_EQ(second.bytes_reserved(), third_bytes);
        EXPECT_EQ(third.bytes_reserved(), 0u);
        EXPECT_LT(second_memory.bytes, third_bytes + 20 * sizeof(Pair)); // what it had is given back
        first = std::move(second);                                       // others
        EXPECT_EQ(first.blocks()[0].data(), memory);
        EXPECT_EQ(first_memory.bytes, 0u);
        EXPECT_EQ(second_memory.allocations, allocations);
        EXPECT_EQ(first.to_vector(), counted(30));
        fill(second, {5}); // keeps the resource it had
        EXPECT_EQ(first_memory.bytes, 0u);
        fill(second, {50}); // in a chunk that has to grow
        EXPECT_EQ(second.bytes_reserved(), 50 * sizeof(Pair));
        fill(second, {5});
        EXPECT_EQ(second.to_vector(), counted(5));
        std::swap(first, second);
        EXPECT_EQ(second.to_vector(), counted(30));
        EXPECT_EQ(first.to_vector(), counted(5));
    }
    EXPECT_EQ(first_memory.bytes, 0u);
    EXPECT_EQ(second_memory.bytes, 0u);
}

TEST(PairBuffer, CopiesOnlyWhereThereIsRoom)
{
    PairBuffer buffer;
    fill(buffer, {3, 2});
    std::vector<Pair> small(4), big(6, Pair{9, 9});
    try {
        buffer.copy_to(small);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::size_mismatch);
        EXPECT_STREQ(error.what(), "room for 4 items, but there are 5");
    }
    buffer.copy_to(big);
    EXPECT_EQ(big[4], counted(5)[4]);
    EXPECT_EQ(big[5], (Pair{9, 9}));
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
