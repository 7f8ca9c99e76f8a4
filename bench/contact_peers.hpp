// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "jostle/executor.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/shapes.hpp"

/// Other systems' narrow phases, so that they can be timed beside Jostle's on the same pairs.
namespace jostle_bench {

enum class BodyKind
{
    sphere,
    capsule, ///< along y
    box,
    hull,
    mesh,
    cylinder, ///< along y
    cone,     ///< along y, its tip up
    ellipsoid
};

/// What a body is, in terms that every system understands. Points and triangles belong to the scene.
struct BodyShape
{
    BodyKind kind;
    double radius = 0, half_length = 0;
    std::array<double, 3> half = {};                     ///< of a box or an ellipsoid
    std::span<const jostle::Vec<3, double>> points = {}; ///< hull: its corners; mesh: its vertices
    /// hull: outward faces as triangles; mesh: its triangles
    std::span<const std::array<std::uint32_t, 3>> triangles = {};
};

struct ContactCounts
{
    std::uint64_t touching = 0; ///< pairs with at least one contact
    std::uint64_t points = 0;
};

/// One system. Everything but `frame` is not timed.
///
/// Threads  `frame` spreads the pairs over the executor in equal runs, one per thread, each with what the
///          system needs of its own: none of them has a parallel loop that is in Debian's package.
class ContactPeer
{
  public:
    virtual ~ContactPeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// One line: which class, driven how.
    [[nodiscard]] virtual const char* how() const noexcept = 0;
    /// Whether it has such a shape; `start` wants no other.
    [[nodiscard]] virtual bool has(BodyKind kind) const noexcept = 0;
    virtual void start(std::span<const BodyShape> shapes, std::span<const jostle::Pair> pairs,
                       jostle::Executor& executor) = 0;
    virtual void move(std::span<const jostle::Pose3f> poses) = 0;
    virtual void frame() = 0;
    [[nodiscard]] virtual ContactCounts counts() const = 0;
};

[[nodiscard]] std::unique_ptr<ContactPeer> make_bullet_contacts();
[[nodiscard]] std::unique_ptr<ContactPeer> make_fcl_contacts();

} // namespace jostle_bench
