// SPDX-License-Identifier: MIT
#include "engine/sort_brick.hpp"

#include <algorithm>
#include <bit>

JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {

/// Calls visit(record) for each record of a brick.
template <class Visit>
void each_record(const Bricks& bricks, std::uint32_t brick, const Visit& visit)
{
    for (const BrickStore* store : bricks.stores) {
        std::uint32_t left = store->size(brick);
        for (std::uint32_t c = 0; left != 0; ++c) {
            const BrickStore::Chunk& chunk = *store->chunk(brick, c);
            const std::uint32_t here = std::min(left, BrickStore::Chunk::capacity);
            for (std::uint32_t r = 0; r < here; ++r)
                visit(chunk.record[r]);
            left -= here;
        }
    }
}

} // namespace

bool holds_both_sets(const Bricks& bricks, std::uint32_t brick, bool as_given) noexcept
{
    std::uint32_t sides = 0;
    if (!as_given) {
        each_record(bricks, brick, [&](const Record& record) { sides |= record.object; });
    } else {
        for (const BrickStore* store : bricks.stores) {
            const std::uint32_t size = store->size(brick);
            if (size == 0) continue;
            constexpr std::uint32_t chunk = BrickStore::Chunk::capacity;
            sides |= store->chunk(brick, 0)->record[0].object;
            sides |= store->chunk(brick, (size - 1) / chunk)->record[(size - 1) % chunk].object;
        }
    }
    return (~sides & (side_a | side_b)) == 0;
}

// A counting sort with about one bucket per record. Order within a bucket is free, since the sweep compares
// both ends on every axis; it is the order of the boxes all the same, whoever stored them.
//
//     buckets       0      1    2        3  ...    of equal width, and one behind the brick
//     sorted     | r r r | r |     | r r r r |     bucket[b]: where b begins, at last where it ends
//     row i        ^i                              its window ends where the bucket of its upper bound does
//     window       |<------------------->|
std::uint64_t sort_brick(const Bricks& bricks, std::uint32_t brick, std::uint32_t count, Slot& slot)
{
    const int bucket_bits = std::clamp(static_cast<int>(std::bit_width(count - 1)), 4, quanta_bits);
    const int shift = quanta_bits - bucket_bits;
    // Keys are lo + 1, or 0 of a copy, up to 2^14, and hi + 1, up to 2^14 + 1: both have a bucket.
    const std::uint32_t buckets = (1u << bucket_bits) + 2;
    const auto bucket_of = [&](const Record& record) {
        return ((0u - (record.axis[0] >> 16)) & 0xffffu) >> shift;
    };
    std::uint32_t* bucket = slot.bucket.reserve(buckets);
    std::fill_n(bucket, buckets, 0u);
    each_record(bricks, brick, [&](const Record& record) { ++bucket[bucket_of(record)]; });
    std::uint32_t sum = 0;
    for (std::uint32_t b = 0; b < buckets; ++b) {
        const std::uint32_t size = bucket[b];
        bucket[b] = sum;
        sum += size;
    }

    const std::uint32_t size = padded(count);
    Record* sorted = slot.sorted.reserve(size);
    each_record(bricks, brick, [&](const Record& record) { sorted[bucket[bucket_of(record)]++] = record; });
    std::fill(sorted + count, sorted + size, padding_record);

    std::uint32_t* window_end = slot.window_end.reserve(size);
    std::uint64_t windows = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        window_end[i] = bucket[(sorted[i].axis[0] & 0xffffu) >> shift];
        windows += window_end[i] - i;
    }
    window_end[count] = 0; // of the padding: the partner of the last row, where rows are odd
    return windows;
}

} // namespace engine
JOSTLE_NAMESPACE_END
