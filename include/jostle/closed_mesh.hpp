// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/executor.hpp"
#include "jostle/shapes.hpp"
#include "jostle/vec.hpp"
#include "jostle/version.hpp"

// Which points are inside a mesh, and how far from its surface:
//
//     const ClosedMesh solid(mesh); // an Error if it has a hole
//     if (solid.contains(pose, point)) ...
//     const SignedDistance3f at = solid.signed_distance(pose, point);

JOSTLE_NAMESPACE_BEGIN

/// How far a point is from a surface, and where.
template <Coordinate T>
struct SignedDistance
{
    T distance;       ///< below 0 inside
    Vec<3, T> normal; ///< unit, the direction in which the distance grows; arbitrary at the surface
    Vec<3, T> point;  ///< nearest on the surface, relative to the position of the mesh's pose, in world axes
};

using SignedDistance3f = SignedDistance<float>;

/// A mesh of triangles that has an inside.
///
/// Valid    no holes, and all triangles the same way round: every edge is traversed as often in one direction
///          as in the other, where vertices at the same place count as one. The mesh may consist of several
///          surfaces, and touch or cross itself.
/// Inside   where the winding number isn't 0. Cavities are outside if their triangles face into them; where
///          surfaces cross, both insides are inside. Points on the surface are inside. The orientation of the
///          mesh as a whole doesn't matter.
/// Exact    which side of the surface a point is on is decided exactly, whatever the triangles' shapes, and
///          never by rounding. The distance is that of distance() to the mesh, which is 0 for points within a
///          billionth of the triangle's size: they count as on the surface.
/// Value    copies share the same read-only memory. The Mesh it was made from need not outlive it.
/// Threads  const members from any number of threads; nothing is allocated.
/// Cost     O(n log n) to build, 24 bytes a vertex. contains() tests what a ray meets; signed_distance() also
///          searches for the nearest triangle.
/// Errors   `Error` that names the first edge without a counterpart; also for points and poses that are not
///          finite or beyond 1e60.
/// Source   the winding number as signed crossings of a ray, with ties broken by an infinitesimal shift of
///          the point: Edelsbrunner, Muecke, Simulation of Simplicity, ACM TOG 9(1), 1990. The sign from the
///          winding number: Jacobson et al., Robust Inside-Outside Segmentation, SIGGRAPH 2013.
class JOSTLE_API ClosedMesh
{
  public:
    explicit ClosedMesh(const Mesh<3>& mesh);

    /// Returns how often the surface winds around a point in the mesh's own axes: 1 inside a surface whose
    /// triangles are counterclockwise seen from outside. On the surface it is the number on one of the two
    /// sides.
    [[nodiscard]] int winding_number(const Vec<3, double>& point) const;

    template <Coordinate T>
    [[nodiscard]] bool contains(const Pose<3, T>& pose, const std::type_identity_t<Vec<3, T>>& point) const;
    template <Coordinate T>
    [[nodiscard]] SignedDistance<T> signed_distance(const Pose<3, T>& pose,
                                                    const std::type_identity_t<Vec<3, T>>& point) const;

    // Many points at once: out[i], which is 1 or 0, or a distance, belongs to points[i]. Errors name the
    // lowest bad point.

    template <Coordinate T>
    void contains(const Pose<3, T>& pose, std::type_identity_t<StridedView<Vec<3, T>>> points,
                  std::span<std::uint8_t> out, Executor& executor = default_executor()) const;
    template <Coordinate T>
    void signed_distances(const Pose<3, T>& pose, std::type_identity_t<StridedView<Vec<3, T>>> points,
                          std::type_identity_t<std::span<SignedDistance<T>>> out,
                          Executor& executor = default_executor()) const;

  private:
    struct Data;
    std::shared_ptr<const Data> data_;
};

JOSTLE_NAMESPACE_END
