// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/prefetch.hpp"
#include "engine/brick_store.hpp"
#include "engine/record.hpp"
#include "engine/slot.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// The bricks of a grid. A brick's records are in several stores, those of the first store first.
struct Bricks
{
    std::span<const BrickStore* const> stores;
    std::uint32_t count;
    int sweep_axis = 0;  // the user's
    bool fitted = false; // each has its own grid around its boxes: see fit()

    [[nodiscard]] std::uint32_t records(std::uint32_t brick) const noexcept
    {
        std::uint32_t sum = 0;
        for (const BrickStore* store : stores)
            sum += store->size(brick);
        return sum;
    }
};

/// Prefetches a brick's records into the second-level cache, a few lines at a time, while another brick is
/// swept: if all were fetched at once, they would delay each other.
class FetchBrick
{
  public:
    FetchBrick(const Bricks& bricks, std::uint32_t brick) noexcept
        : bricks_(bricks), brick_(brick), store_(brick < bricks.count ? 0 : bricks.stores.size())
    {
    }
    /// Prefetches the next `count` chunks, if there are as many.
    void chunks(std::uint32_t count) noexcept
    {
        while (count > 0 && store_ < bricks_.stores.size()) {
            const BrickStore& store = *bricks_.stores[store_];
            if (chunk_ == store.chunks(brick_)) {
                ++store_;
                chunk_ = 0;
                continue;
            }
            fetch(*store.chunk(brick_, chunk_++));
            --count;
        }
    }

  private:
    static void fetch([[maybe_unused]] const BrickStore::Chunk& chunk) noexcept
    {
#if defined(__GNUC__)
        const auto* const first = reinterpret_cast<const std::byte*>(&chunk);
        for (std::size_t at = 0; at < sizeof chunk; at += cache_line)
            __builtin_prefetch(first + at, 0, 2); // not to the first-level cache, which is full of this brick
#endif
    }

    const Bricks& bricks_;
    std::uint32_t brick_;
    std::size_t store_;
    std::uint32_t chunk_ = 0;
};

/// Whether a brick can have pairs: not if all records share a flag of their set. In a grid over a call's
/// boxes (`as_given`) records without a flag, or of the first set, come first in each store, so that few need
/// to be examined.
bool may_pair(const Bricks& bricks, std::uint32_t brick, bool as_given) noexcept;

/// Sorts the records of a brick by the bucket of their lower bound on the sweep axis, into `slot.sorted`,
/// padded, and finds their windows, `slot.window_end`. Within a bucket records keep their order. Returns the
/// sum of the windows' lengths.
std::uint64_t sort_brick(const Bricks& bricks, std::uint32_t brick, std::uint32_t count, Slot& slot);

/// Whether a sorted brick's quanta are too coarse for its boxes: judging by some rows, most of its time would
/// go to ties of boxes that don't touch.
template <int Dim, class T>
bool is_coarse(const Boxes<Dim, T>& boxes, const Slot& slot, std::uint32_t count) noexcept;

/// Cuts a sorted brick between buckets, where few boxes extend from one part into the next. Returns the ends
/// of the parts, in `slot.before`.
std::span<const std::uint32_t> cut_brick(Slot& slot, std::uint32_t count);

} // namespace engine
JOSTLE_NAMESPACE_END
