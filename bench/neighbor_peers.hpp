// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "jostle/vec.hpp"

/// Other systems' searches for neighbours, so that they can be timed beside Jostle's on the same points.
namespace jostle_bench {

/// In open space, on one thread. Rows come in any order, and are kept as its users would.
class NeighborPeer
{
  public:
    virtual ~NeighborPeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// Lists, for each point, all others within the cutoff, as Jostle defines it. Returns how many there are
    /// in all rows.
    virtual std::uint64_t find(std::span<const jostle::Vec3f> points, float cutoff) = 0;
};

[[nodiscard]] std::unique_ptr<NeighborPeer> make_nanoflann();

} // namespace jostle_bench
