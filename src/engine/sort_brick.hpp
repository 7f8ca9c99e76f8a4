// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "engine/brick_store.hpp"
#include "engine/record.hpp"
#include "engine/slot.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// The bricks of a grid. A brick's records lie in several stores, those of the first store first.
struct Bricks
{
    std::span<const BrickStore* const> stores;
    std::uint32_t count;

    [[nodiscard]] std::uint32_t records(std::uint32_t brick) const noexcept
    {
        std::uint32_t sum = 0;
        for (const BrickStore* store : stores)
            sum += store->size(brick);
        return sum;
    }
};

/// Whether a brick has records of two sets. In a grid over a call's boxes (`as_given`) those of the first
/// come first in each store, so that few need to be looked at.
bool holds_both_sets(const Bricks& bricks, std::uint32_t brick, bool as_given) noexcept;

/// Sorts the records of a brick by the bucket of their lower bound on the sweep axis, into `slot.sorted`,
/// padded, and finds their windows, `slot.window_end`. Within a bucket records keep their order. Returns the
/// sum of the windows' lengths. Fetches the next brick meanwhile.
std::uint64_t sort_brick(const Bricks& bricks, std::uint32_t brick, std::uint32_t count, Slot& slot);

} // namespace engine
JOSTLE_NAMESPACE_END
