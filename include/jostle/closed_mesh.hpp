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

// Which points lie inside of a mesh, and how far from its surface:
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
    Vec<3, T> normal; ///< unit, the direction in which the distance grows; at the surface some direction
    Vec<3, T> point;  ///< the nearest on the surface, from the position of the mesh's pose, in world axes
};

using SignedDistance3f = SignedDistance<float>;

/// A mesh of triangles that has an inside.
///
/// Valid    every side of a triangle is run through as often one way as the other, vertices at the same
///          place being one: no holes, and all triangles the same way round. It may consist of several
///          surfaces, and touch or cross itself.
/// Inside   where the surface winds around a point: cavities are outside if their triangles look into them,
///          and where surfaces cross both insides are inside. Points on the surface are inside. Which way
///          round the triangles are as a whole doesn't matter.
/// Exact    which triangles lie beyond a point is decided exactly, whatever they look like: no point is
///          inside or outside by rounding. The distance is that of distance() to the mesh, which is 0 for
///          points as near as a billionth of the triangle there: they count as on the surface.
/// Value    copies share the same read-only memory. The mesh itself may go.
/// Threads  const members from any number of threads; nothing is allocated.
/// Cost     O(n log n) to make, 24 bytes a vertex. contains() looks at what a ray meets, signed_distance()
///          searches for the nearest triangle, too.
/// Errors   `Error` that names the first side without another one; for points and poses that are not finite
///          or beyond 1e60.
/// Source   the winding number as signed crossings of a ray; ties by a shift of the point that is as small as
///          may be: Edelsbrunner, Muecke, Simulation of Simplicity, ACM TOG 9(1), 1990. The sign by the
///          winding number: Jacobson et al., Robust Inside-Outside Segmentation, SIGGRAPH 2013.
class JOSTLE_API ClosedMesh
{
  public:
    explicit ClosedMesh(const Mesh<3>& mesh);

    /// How often the surface winds around a point in the mesh's own axes, counterclockwise triangles seen
    /// from outside counting 1. On the surface the number on one of its sides.
    [[nodiscard]] int winding_number(const Vec<3, double>& point) const;

    template <Coordinate T>
    [[nodiscard]] bool contains(const Pose<3, T>& pose, const std::type_identity_t<Vec<3, T>>& point) const;
    template <Coordinate T>
    [[nodiscard]] SignedDistance<T> signed_distance(const Pose<3, T>& pose,
                                                    const std::type_identity_t<Vec<3, T>>& point) const;

    // Many points at once: out[i], 1 or 0 and a distance, belongs to points[i]. Errors name the lowest one.

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
