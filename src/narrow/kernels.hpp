// SPDX-License-Identifier: MIT
// The distances and overlaps of simple shapes, several pairs at a time. All instruction sets leave the same
// bits: sums and products in one order, no fused multiply-add, square roots and divisions as IEEE has them.
#pragma once

#include <cstdint>

#include "jostle/find_pairs.hpp"
#include "narrow/math.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Pairs that a kernel looks at in one call; unused ones hold the last pair again.
inline constexpr std::uint32_t batch = 8;

/// Arranged pairs, one array per number: unit quaternions or any multiples near 1, b's position from a's.
struct BoxBatch
{
    double turn_a[4][batch], turn_b[4][batch], d[3][batch], half_a[3][batch], half_b[3][batch];

    // Out: along the axis of least overlap, or greatest separation.
    double separation[batch];
    double normal[3][batch]; ///< unit, from a to b, in world axes
    double axis[batch];      ///< 0-2 a's faces, 3-5 b's, 6 + 3 i + j a's edge i with b's edge j
    double matrix_a[9][batch], matrix_b[9][batch]; ///< x, y and z axis
};

struct CapsuleBoxBatch
{
    double turn_a[4][batch], turn_b[4][batch], d[3][batch], half_length[batch], half[3][batch];

    // Out: the segment's distance from the box and the nearest points; where they overlap minus the depth.
    double distance[batch];
    double normal[3][batch];
    double on_a[3][batch], on_b[3][batch]; ///< from a's position; of separated pairs only
    double axis_a[3][batch], matrix_b[9][batch];
};

struct Kernels
{
    InstructionSet set;
    void (*boxes)(BoxBatch&);
    void (*capsule_box)(CapsuleBoxBatch&);
    /// The lowest i with the greatest dx * x[i] + dy * y[i] + dz * z[i], where y = x + stride and z = y +
    /// stride; stride is a multiple of 8 and all of it is read.
    std::uint32_t (*furthest)(const double* x, std::uint32_t stride, double dx, double dy, double dz);
};
[[nodiscard]] const Kernels& kernels_for(InstructionSet set) noexcept;
/// Of supported_instruction_sets().front().
[[nodiscard]] const Kernels& best_kernels() noexcept;

/// What a kernel finds for one pair, from its matrices.
struct BoxAxis
{
    double separation;
    Vec3 normal;
    int axis;
};
[[nodiscard]] BoxAxis box_axis(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b,
                               const Vec3& d);
struct CapsuleBoxGap
{
    double distance;
    Vec3 normal, on_a, on_b;
};
[[nodiscard]] CapsuleBoxGap capsule_box_gap(const Vec3& axis, double half_length, const Mat3& b,
                                            const Vec3& half, const Vec3& d);

} // namespace narrow
JOSTLE_NAMESPACE_END
