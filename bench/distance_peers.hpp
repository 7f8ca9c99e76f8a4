// SPDX-License-Identifier: MIT
#pragma once

#include "bench/contact_peers.hpp"

/// Other systems' distances between shapes, so that they can be timed beside Jostle's on the same pairs.
namespace jostle_bench {

/// One system, one pair at a time. Everything but `distance` and `touching` is not timed.
class DistancePeer
{
  public:
    virtual ~DistancePeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// One line: which functions, driven how.
    [[nodiscard]] virtual const char* how() const noexcept = 0;
    virtual void start(std::span<const BodyShape> shapes, std::span<const jostle::Pair> pairs,
                       std::span<const jostle::Pose3d> poses) = 0;
    virtual double distance(std::size_t pair) = 0;
    virtual bool touching(std::size_t pair) = 0;
};

[[nodiscard]] std::unique_ptr<DistancePeer> make_fcl_distances();

} // namespace jostle_bench
