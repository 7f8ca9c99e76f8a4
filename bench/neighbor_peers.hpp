// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "jostle/vec.hpp"

/// Other systems' searches for neighbours, so that they can be timed beside Jostle's on the same points.
namespace jostle_bench {

/// On one thread. Rows come in any order, and are kept as its users would.
class NeighborPeer
{
  public:
    virtual ~NeighborPeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// Whether it lists each pair once, in a cube that repeats, or else twice, in open space.
    [[nodiscard]] virtual bool is_periodic() const noexcept = 0;
    /// Takes the points, which outlive the search. Not timed. `edge` is the cube's.
    virtual void start(std::span<const jostle::Vec3f> points, float cutoff, double edge) = 0;
    /// Lists, for each point, the others within the cutoff, as Jostle defines it.
    virtual void find() = 0;
    /// How many the last search listed.
    [[nodiscard]] virtual std::uint64_t found() const = 0;
};

[[nodiscard]] std::unique_ptr<NeighborPeer> make_nanoflann();
[[nodiscard]] std::unique_ptr<NeighborPeer> make_lammps();

} // namespace jostle_bench
