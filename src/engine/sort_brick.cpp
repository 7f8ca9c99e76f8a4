// SPDX-License-Identifier: MIT
#include "engine/sort_brick.hpp"

#include <algorithm>
#include <bit>

#include "base/box.hpp"
#include "base/instantiate.hpp"

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

// A few rows of a brick show whether its quanta are too coarse. Only rows of boxes that are thin, in quanta,
// are tested, which takes no time if there are none.
constexpr std::uint32_t coarse_rows = 8;
constexpr std::int32_t coarse_extent = 8;
constexpr std::uint32_t coarse_candidates = 32; // of a row
constexpr double coarse_ties = 1; // a row: from here on they take longer than storing all boxes again

// The parts of a brick must be worth the cost of a brick, and few of their records may be copies.
constexpr std::uint32_t least_part = 24;
constexpr std::uint32_t most_reaching = 4;

std::int32_t low_half(std::uint32_t word) noexcept
{
    return static_cast<std::int16_t>(word & 0xffffu);
}

} // namespace

bool may_pair(const Bricks& bricks, std::uint32_t brick, bool as_given) noexcept
{
    std::uint32_t sides = side_a | side_b; // of all records
    if (!as_given) {
        each_record(bricks, brick, [&](const Record& record) { sides &= record.object; });
    } else {
        for (const BrickStore* store : bricks.stores) {
            const std::uint32_t size = store->size(brick);
            if (size == 0) continue;
            constexpr std::uint32_t chunk = BrickStore::Chunk::capacity;
            sides &= store->chunk(brick, 0)->record[0].object;
            sides &= store->chunk(brick, (size - 1) / chunk)->record[(size - 1) % chunk].object;
        }
    }
    return sides == 0;
}

// A counting sort with about one bucket per record. The order within a bucket doesn't matter, since the sweep
// compares both ends on every axis; it is nevertheless the order of the boxes, whichever worker stored them.
//
//     buckets       0      1    2        3  ...    of equal width, and one behind the brick
//     sorted     | r r r | r |     | r r r r |     bucket[b]: where b begins, at last where it ends
//     row i        ^i                              its window ends where the bucket of its upper bound does
//     window       |<------------------->|
std::uint64_t sort_brick(const Bricks& bricks, std::uint32_t brick, std::uint32_t count, Slot& slot)
{
    const int bucket_bits = std::clamp(static_cast<int>(std::bit_width(count - 1)), 4, quanta_bits);
    const int shift = quanta_bits - bucket_bits;
    // Keys are lo + 1 (0 for a copy), up to 2^14, and hi + 1, up to 2^14 + 1: both have a bucket.
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
    window_end[count] = 0; // of the padding: the partner of the last row, if rows are odd
    slot.buckets = buckets;
    return windows;
}

template <int Dim, class T>
bool is_coarse(const Boxes<Dim, T>& boxes, const Slot& slot, std::uint32_t count) noexcept
{
    const Record* const sorted = slot.sorted.data();
    double ties = 0;
    for (std::uint32_t k = 0; k < coarse_rows; ++k) {
        const std::uint32_t i = static_cast<std::uint32_t>(std::uint64_t{count} * k / coarse_rows);
        const Record& row = sorted[i];
        std::int32_t extent = quanta;
        for (int p = 0; p < Dim; ++p)
            extent = std::min(extent, low_half(row.axis[p]) + low_half(row.axis[p] >> 16));
        if (extent > coarse_extent) continue;
        const std::uint32_t window = slot.window_end.data()[i] - (i + 1),
                            tested = std::min(window, coarse_candidates);
        std::uint32_t lost = 0;
        for (std::uint32_t j = i + 1; j <= i + tested; ++j) {
            std::int32_t gap = quanta;
            for (int p = 0; p < Dim; ++p)
                gap = std::min({gap, low_half(row.axis[p] + (sorted[j].axis[p] >> 16)),
                                low_half(sorted[j].axis[p] + (row.axis[p] >> 16))});
            lost += gap == 0 && (row.object & sorted[j].object & ~index_mask) == 0 &&
                    !overlaps(boxes[row.object & object_mask], boxes[sorted[j].object & object_mask]);
        }
        if (lost != 0) ties += static_cast<double>(lost) * window / tested;
    }
    return ties > coarse_ties * coarse_rows;
}
#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template bool is_coarse(const Boxes<Dim, T>&, const Slot&, std::uint32_t) noexcept;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

std::span<const std::uint32_t> cut_brick(Slot& slot, std::uint32_t count)
{
    // How many rows' windows extend across each place, as differences from the place before.
    std::uint32_t* const change = slot.apart_place.reserve(std::size_t{count} + 1);
    std::fill_n(change, count + 1, 0u);
    for (std::uint32_t i = 0; i < count; ++i) {
        ++change[i + 1];
        --change[slot.window_end.data()[i]];
    }
    std::uint32_t* const ends = slot.before.reserve(std::size_t{count} / least_part + 1);
    std::uint32_t parts = 0, begin = 0, place = 0, reaching = 0;
    for (std::uint32_t b = 0; b < slot.buckets; ++b) {
        const std::uint32_t end = slot.bucket.data()[b];
        while (place < end)
            reaching += change[++place];
        if (end - begin < least_part || end == count || reaching * most_reaching > end - begin) continue;
        ends[parts++] = begin = end;
    }
    ends[parts++] = count;
    return {ends, parts};
}

} // namespace engine
JOSTLE_NAMESPACE_END
