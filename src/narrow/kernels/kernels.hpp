// SPDX-License-Identifier: MIT
// The distances and overlaps of simple shapes, several pairs at a time. All instruction sets leave the same
// bits: sums and products in one order, no fused multiply-add, square roots and divisions as IEEE has them.
#pragma once

#include <cstdint>

#include "jostle/find_pairs.hpp"
#include "narrow/math.hpp"
#include "narrow/shapes/mesh_tree.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// How many pairs a kernel looks at in one call. Where there are fewer, the last one stands in all places
/// that are left.
inline constexpr std::uint32_t batch = 8;

// A batch is pairs transposed, so that a vector is one number of several pairs:
//
//     d[0]   x of pair 0   x of pair 1   ...   x of pair 7
//     d[1]   y of pair 0   y of pair 1   ...
//
// turn_a and turn_b are the rotations as quaternions, whose length need not be exactly 1; d is b's position
// seen from a's. Kernels fill in what comes behind "Out".

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

    // Out: the segment's distance from the box and the nearest points; where they overlap, the depth,
    // negated.
    double distance[batch];
    double normal[3][batch];
    double on_a[3][batch], on_b[3][batch]; ///< from a's position; of separated pairs only
    double axis_a[3][batch], matrix_b[9][batch];
};

/// Two segments along y, or points: segments of length 0.
struct RoundBatch
{
    double turn_a[4][batch], turn_b[4][batch], d[3][batch], half_a[batch], half_b[batch];

    // Out: how far the segments are from each other, in which direction (where that is above 0), and where.
    double distance[batch];
    double normal[3][batch], on_a[3][batch], on_b[3][batch];
    double axis_a[3][batch], axis_b[3][batch]; ///< their directions
};

/// Two spheres, capsules or boxes: a sphere before a capsule, and that before a box. Places are in the order
/// that users gave, which is the other one where `order` is -1.
struct DistanceBatch
{
    double place_a[3][batch], place_b[3][batch], turn_a[4][batch], turn_b[4][batch];
    double half_a[3][batch], half_b[3][batch]; ///< half edges; of a capsule its half length in y
    double radius_a[batch], radius_b[batch];
    double order[batch]; ///< 1 as given, -1 the other way round, 0 as the places decide
    double enough;       ///< the greatest distance that is answered

    // Out: what users get, in the order that they gave. The distance is infinite, and all else 0, where it is
    // more than enough.
    double distance[batch];
    double normal[3][batch];                   ///< unit, from a to b
    double from_a[3][batch], from_b[3][batch]; ///< each seen from its own position
    std::uint32_t clear; ///< bit k is set where pair k is answered; what isn't, is looked at in general
};

/// Edges of a polyhedron with the normals of their two faces. Up to a multiple of 8 the rows are filled with
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
/// A few points of one polyhedron, and how deep they are below the planes of another.
struct PlaneRows
{
    static constexpr std::uint32_t most = 2 * EdgeRows::most / 3 + 8; // faces and corners have three edges
    static constexpr std::uint32_t most_points = 48;
    std::uint32_t count = 0;
    double point[3][most_points];

    // Out, by plane.
    double depth[most];  ///< of the deepest of the points
    double deeper[most]; ///< bit i of its mantissa is set where point i is deeper than `enough`
};

/// What is compiled for each instruction set. Points (or normals) are three rows of numbers: first their x,
/// then from x + stride on their y, then their z. The stride is a multiple of 8, and the kernels read and
/// write whole rows, so what a row has beyond its points must be harmless: a copy of one of them.
struct Kernels
{
    void (*boxes)(BoxBatch&);
    void (*capsule_box)(CapsuleBoxBatch&);
    void (*rounds)(RoundBatch&);
    /// These do what simple_distance in answers.hpp does with one pair, operation by operation.
    void (*round_distances)(DistanceBatch&);
    void (*sphere_box_distances)(DistanceBatch&);
    void (*capsule_box_distances)(DistanceBatch&);
    /// The lowest i with the greatest dx * x[i] + dy * y[i] + dz * z[i].
    std::uint32_t (*furthest)(const double* x, std::uint32_t stride, double dx, double dy, double dz);
    /// height[i] = dx * x[i] + dy * y[i] + dz * z[i]; returns the least.
    double (*heights)(const double* x, std::uint32_t stride, double dx, double dy, double dz, double* height);
    /// to = turn * from + shift.
    void (*move)(const double* from, std::uint32_t stride, const Mat3& turn, const Vec3& shift, double* to);
    /// For each plane: how deep the deepest of the points lies below it. Returns the plane for which that is
    /// least.
    std::uint32_t (*planes)(const double* normals, const double* offsets, std::uint32_t stride, double enough,
                            PlaneRows& rows);
    /// An edge of a and one of b whose common normal separates the two polyhedra most. Only pairs count that
    /// make a face of the Minkowski difference: on the sphere of all directions, an edge is the arc from the
    /// normal of one of its faces to that of the other, and the arc of a's edge has to cross the negated arc
    /// of b's. Source: Gregorius, The Separating Axis Test between Convex Polyhedra, GDC 2013.
    EdgePair (*edges)(const EdgeRows& a, const EdgeRows& b);
    /// Keys of lower bounds of a box's distance from each of 8 others, by its own axes and by theirs. Returns
    /// the bits of those that aren't above the limit.
    std::uint32_t (*bounds)(const BoxRows& rows, const OrientedBox& box, double limit,
                            double (&key)[BoxRows::size]);
    /// The bounds themselves, and in which direction.
    void (*approaches)(const BoxRows& rows, const OrientedBox& box, BoxApproaches& out);
};
[[nodiscard]] const Kernels& kernels_for(InstructionSet set) noexcept;
/// Of supported_instruction_sets().front().
[[nodiscard]] const Kernels& best_kernels() noexcept;

/// What the kernel `boxes` finds, for one pair.
struct BoxAxis
{
    double separation;
    Vec3 normal;
    int axis;
};
[[nodiscard]] BoxAxis box_axis(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b,
                               const Vec3& d);
/// What the kernel `capsule_box` finds, for one pair.
struct CapsuleBoxGap
{
    double distance;
    Vec3 normal, on_a, on_b;
};
[[nodiscard]] CapsuleBoxGap capsule_box_gap(const Vec3& axis, double half_length, const Mat3& b,
                                            const Vec3& half, const Vec3& d);

} // namespace narrow
JOSTLE_NAMESPACE_END
