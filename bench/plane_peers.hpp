// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "jostle/shapes.hpp"

/// Other systems' tests of two shapes in the plane, so that they can be timed beside Jostle's on the same
/// pairs.
namespace jostle_bench {

struct PlaneShape
{
    enum class Kind : std::uint8_t
    {
        circle,
        capsule, ///< along the y axis
        polygon,
        ellipse
    };
    Kind kind;
    double radius = 0, half_length = 0;
    std::span<const jostle::Vec<2, double>> corners = {}; ///< counterclockwise
};

/// One system, one pair at a time: pair i is of a at poses_a[i] and b at poses_b[i]. `start` is not timed.
class PlanePeer
{
  public:
    virtual ~PlanePeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// One line: which functions, driven how.
    [[nodiscard]] virtual const char* how() const noexcept = 0;
    [[nodiscard]] virtual bool has_distance(const PlaneShape& a, const PlaneShape& b) const noexcept = 0;
    [[nodiscard]] virtual bool has_contacts(const PlaneShape& a, const PlaneShape& b) const noexcept = 0;
    virtual void start(const PlaneShape& a, const PlaneShape& b, std::span<const jostle::Pose2d> poses_a,
                       std::span<const jostle::Pose2d> poses_b) = 0;
    /// 0 where they overlap.
    virtual double distance(std::size_t pair) = 0;
    virtual bool touching(std::size_t pair) = 0;
    /// How many points their contact has.
    virtual std::uint32_t contact_points(std::size_t pair) = 0;
};

[[nodiscard]] std::unique_ptr<PlanePeer> make_box2d_shapes();

} // namespace jostle_bench
