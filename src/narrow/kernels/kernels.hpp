// SPDX-License-Identifier: MIT
// The distances and overlaps of simple shapes, several pairs at a time. All instruction sets produce the same
// bits: sums and products in one order, no fused multiply-add, IEEE square roots and divisions.
#pragma once

#include <cstdint>

#include "jostle/find_pairs.hpp"
#include "narrow/math.hpp"
#include "narrow/shapes/mesh_tree.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The number of pairs that a kernel processes in one call. If there are fewer, the last one fills the
/// remaining places.
inline constexpr std::uint32_t batch = 8;

// A batch has pairs transposed, so that a vector has one number of several pairs:
//
//     d[0]   x of pair 0   x of pair 1   ...   x of pair 7
//     d[1]   y of pair 0   y of pair 1   ...
//
// turn_a and turn_b are the rotations as quaternions, whose length need not be exactly 1; d is b's position
// relative to a's. Kernels fill in the members after "Out".

/// Two boxes.
struct BoxBatch
{
    double turn_a[4][batch], turn_b[4][batch], d[3][batch], half_a[3][batch], half_b[3][batch];

    // Out: along the axis of least overlap, or greatest separation.
    double separation[batch];
    double normal[3][batch]; ///< unit, from a to b, in world axes
    double axis[batch];      ///< 0-2 a's faces, 3-5 b's, 6 + 3 i + j a's edge i with b's edge j
    double matrix_a[9][batch], matrix_b[9][batch]; ///< x, y and z axis
};

/// A capsule's segment, which runs along y, and a box.
struct CapsuleBoxBatch
{
    double turn_a[4][batch], turn_b[4][batch], d[3][batch], half_length[batch], half[3][batch];

    // Out: the segment's distance from the box and the nearest points; the negated depth if they overlap.
    double distance[batch];
    double normal[3][batch];
    double on_a[3][batch], on_b[3][batch]; ///< relative to a's position; only for separated pairs
    double axis_a[3][batch], matrix_b[9][batch];
};

/// Two segments along y, or points: segments of length 0.
struct RoundBatch
{
    double turn_a[4][batch], turn_b[4][batch], d[3][batch], half_a[batch], half_b[batch];

    // Out: the distance of the segments, its direction (if it is above 0), and the nearest points.
    double distance[batch];
    double normal[3][batch], on_a[3][batch], on_b[3][batch];
    double axis_a[3][batch], axis_b[3][batch]; ///< their directions
};

/// Two spheres, capsules or boxes: a sphere before a capsule, and that before a box. Places are in the order
/// given by users, which is the opposite one if `order` is -1.
struct DistanceBatch
{
    double place_a[3][batch], place_b[3][batch], turn_a[4][batch], turn_b[4][batch];
    double half_a[3][batch], half_b[3][batch]; ///< half edges; a capsule's half length in y
    double radius_a[batch], radius_b[batch];
    double order[batch]; ///< 1 as given, -1 the other way round, 0 as the places decide
    double enough;       ///< the greatest distance to be reported

    // Out: users' results, in their order. If the distance is more than enough, it is infinite, and all else
    // 0.
    double distance[batch];
    double normal[3][batch];                   ///< unit, from a to b
    double from_a[3][batch], from_b[3][batch]; ///< each relative to its own position
    std::uint32_t clear; ///< bit k is set if pair k is answered; others are tested in general
};

/// Edges of a polyhedron with the normals of their two faces. The rows are padded to a multiple of 8 with
/// zeros, which are no edges: nothing crosses them.
struct EdgeRows
{
    static constexpr std::uint32_t most = 192;
    std::uint32_t count = 0;
    double begin[3][most], along[3][most], normal_0[3][most], normal_1[3][most];
};
struct EdgePair
{
    double separation; ///< minus infinity: there is none
    std::uint32_t a, b;
};
/// A few points of one polyhedron, and their depths below the planes of another.
struct PlaneRows
{
    static constexpr std::uint32_t most = 2 * EdgeRows::most / 3 + 8; // faces and corners have three edges
    static constexpr std::uint32_t most_points = 48;
    std::uint32_t count = 0;
    double point[3][most_points];

    // Out, by plane.
    double depth[most];  ///< of the deepest of the points
    double deeper[most]; ///< bit i of its mantissa is set if point i is deeper than `enough`
};

/// The functions compiled for each instruction set. Points (or normals) are three rows of numbers: first
/// their x, then from x + stride on their y, then their z. The stride is a multiple of 8, and the kernels
/// read and write whole rows, so the padding of a row must be harmless: copies of one of its points.
struct Kernels
{
    void (*boxes)(BoxBatch&);
    void (*capsule_box)(CapsuleBoxBatch&);
    void (*rounds)(RoundBatch&);
    /// These do the same as simple_distance in answers.hpp for one pair, operation by operation.
    void (*round_distances)(DistanceBatch&);
    void (*sphere_box_distances)(DistanceBatch&);
    void (*capsule_box_distances)(DistanceBatch&);
    /// The lowest i with the greatest dx * x[i] + dy * y[i] + dz * z[i].
    std::uint32_t (*furthest)(const double* x, std::uint32_t stride, double dx, double dy, double dz);
    /// height[i] = dx * x[i] + dy * y[i] + dz * z[i]; returns the least.
    double (*heights)(const double* x, std::uint32_t stride, double dx, double dy, double dz, double* height);
    /// to = turn * from + shift.
    void (*move)(const double* from, std::uint32_t stride, const Mat3& turn, const Vec3& shift, double* to);
    /// For each plane, the depth of the deepest point below it. Returns the plane with the least.
    std::uint32_t (*planes)(const double* normals, const double* offsets, std::uint32_t stride, double enough,
                            PlaneRows& rows);
    /// The edges of a and b whose common normal separates the two polyhedra most. Only pairs count that form
    /// a face of the Minkowski difference: on the sphere of all directions, an edge is the arc from the
    /// normal of one of its faces to that of the other, and the arc of a's edge has to cross the negated arc
    /// of b's. Source: Gregorius, The Separating Axis Test between Convex Polyhedra, GDC 2013.
    EdgePair (*edges)(const EdgeRows& a, const EdgeRows& b);
    /// Keys of lower bounds of a box's distance from each of 8 others, by its own axes and by theirs. Returns
    /// the bits of those that aren't above the limit.
    std::uint32_t (*bounds)(const BoxRows& rows, const OrientedBox& box, double limit,
                            double (&key)[BoxRows::size]);
    /// The bounds themselves, and their directions.
    void (*approaches)(const BoxRows& rows, const OrientedBox& box, BoxApproaches& out);
};
[[nodiscard]] const Kernels& kernels_for(InstructionSet set) noexcept;
/// The kernels of supported_instruction_sets().front().
[[nodiscard]] const Kernels& best_kernels() noexcept;

/// The result of the kernel `boxes`, for one pair.
struct BoxAxis
{
    double separation;
    Vec3 normal;
    int axis;
};
[[nodiscard]] BoxAxis box_axis(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b,
                               const Vec3& d);
/// The result of the kernel `capsule_box`, for one pair.
struct CapsuleBoxGap
{
    double distance;
    Vec3 normal, on_a, on_b;
};
[[nodiscard]] CapsuleBoxGap capsule_box_gap(const Vec3& axis, double half_length, const Mat3& b,
                                            const Vec3& half, const Vec3& d);

} // namespace narrow
JOSTLE_NAMESPACE_END
