// SPDX-License-Identifier: MIT
#pragma once

#include <limits>

#include "bench/contact_peers.hpp"

/// Other systems' distances between shapes, so that they can be timed beside Jostle's on the same pairs.
namespace jostle_bench {

/// One system, one pair at a time. `start` is not timed.
class DistancePeer
{
  public:
    static constexpr double open = std::numeric_limits<double>::infinity();

    virtual ~DistancePeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// One line: which functions, driven how.
    [[nodiscard]] virtual const char* how() const noexcept = 0;
    /// Whether it can tell if such shapes touch, and how far apart they are, up to `farthest`.
    [[nodiscard]] virtual bool has_touching(BodyKind a, BodyKind b) const noexcept = 0;
    [[nodiscard]] virtual bool has_distance(BodyKind a, BodyKind b, double farthest) const noexcept = 0;
    /// Whether it can tell how deep such shapes overlap.
    [[nodiscard]] virtual bool has_depth(BodyKind a, BodyKind b) const noexcept = 0;
    virtual void start(std::span<const BodyShape> shapes, std::span<const jostle::Pair> pairs,
                       std::span<const jostle::Pose3d> poses) = 0;
    /// Where it is more than `farthest`, that or the distance. A system may have no use for the limit.
    virtual double distance(std::size_t pair, double farthest) = 0;
    virtual bool touching(std::size_t pair) = 0;
    /// The deepest of the contacts that the system finds, of meshes the deepest of two triangles; 0 if none.
    virtual double depth(std::size_t pair) = 0;
    /// Whether it has another way, which looks for the least depth, as Jostle does; 0 if it gives up.
    [[nodiscard]] virtual bool has_least_depth(BodyKind, BodyKind) const noexcept { return false; }
    virtual double least_depth(std::size_t) { return 0; }
};

[[nodiscard]] std::unique_ptr<DistancePeer> make_bullet_distances();
[[nodiscard]] std::unique_ptr<DistancePeer> make_fcl_distances();

} // namespace jostle_bench
