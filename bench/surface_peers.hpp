// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "jostle/surface.hpp"

/// Other systems' self-intersections of a mesh, so that they can be timed beside Jostle's crossings.
namespace jostle_bench {

/// On one thread.
class CrossingPeer
{
  public:
    virtual ~CrossingPeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// A manifold. Not timed.
    virtual void start(std::span<const jostle::Surface::Triangle> triangles,
                       std::span<const jostle::Vec3d> positions) = 0;
    /// Lists all pairs of triangles that have more in common than their vertices and edges. Returns how many.
    virtual std::uint64_t find() = 0;
};

[[nodiscard]] std::unique_ptr<CrossingPeer> make_cgal_crossings();

} // namespace jostle_bench
