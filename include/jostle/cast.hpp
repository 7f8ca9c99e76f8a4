// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "jostle/query.hpp"
#include "jostle/shapes.hpp"
#include "jostle/version.hpp"

// What a ray, or a shape on its way, meets first. A BoxIndex or a World says which boxes a ray passes
// through, ray_cast whether it hits what is in them, and where; with the shapes, they do both:
//
//     const auto hit = world.first(Ray3f{eye, forward, 100}, {shapes, poses}); // see Queries

JOSTLE_NAMESPACE_BEGIN

/// Where a ray, or a shape on its way, first meets another shape.
template <int Dim, Coordinate T>
struct CastHit
{
    T fraction;                    ///< of the ray's direction or of the displacement
    Vec<Dim, T> normal;            ///< unit, out of the surface that is hit
    Vec<Dim, T> point;             ///< on that surface, from the position of its pose, in world axes
    std::uint32_t part = 0;        ///< that is hit: triangle, segment or child; 0 for shapes without parts
    std::uint32_t moving_part = 0; ///< of the shape that moves; 0 for a ray
};

using CastHit3f = CastHit<3, float>;

/// Where a ray first meets a shape, or nothing if it doesn't.
///
/// Inside    a ray that begins in a solid hits it at fraction 0, with the normal against its own direction.
///           Balls, capsules, boxes, hulls, half-spaces and height fields, which reach down to their floor,
///           are solids; a mesh isn't.
/// Sides     triangles and segments of a mesh are hit from both sides. The normal is that of the side that is
///           hit: it never points along the ray. The order of the element's vertices says which side it is.
/// Meshes    a ray never slips through a side or corner that elements share. One that only runs along a
///           triangle, seen exactly edge-on, doesn't hit it.
/// Ties      of parts hit at the same fraction the one of the lowest number counts.
/// Exact     up to rounding of the way from the ray's origin. A shape without extent (a sphere of radius 0, a
///           hull that is a segment) is hit by no more than chance. A user's shape, known by its support
///           points, is hit to within 1e-9 of its size.
/// Threads   any number of threads may call it. Nothing is kept or allocated.
/// Errors    `Error` for an invalid ray (see Ray; also for an origin beyond 1e60) or an invalid pose.
/// Cost      one formula for simple shapes; one pass over the faces of a hull; of a mesh what its tree
///           leaves; of a height field the rows that it passes.
/// Source    Cyrus, Beck, Generalized Two- and Three-Dimensional Clipping (1978), for hulls; Woop, Benthin,
///           Wald, Watertight Ray/Triangle Intersection, JCGT 2(1), 2013.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::optional<CastHit<Dim, T>>
ray_cast(const Shape<Dim>& shape, const Pose<Dim, T>& pose, const Ray<Dim, T>& ray);

/// Where a shape that moves by `displacement`, without turning, first touches another one, or nothing if it
/// doesn't. For shapes that turn see time_of_impact.
///
/// Start     shapes that touch at the start hit at fraction 0, whichever way the one moves; normal, point and
///           parts are those of a pair of parts that touches. How deep they are then,
///           distance(moving, pose, shape, shape_pose, 0) tells, and contacts() the ways out.
/// Meshes    have no inside. A height field is the solid that it is, with sides and an underside.
/// Exact     up to a billionth of the parts' size, and never later than the true touch but for rounding of
///           the way. Shapes that only graze each other may count as a hit or not. Half-spaces never meet.
/// Ties      of parts hit at the same fraction one counts, always the same.
/// Threads   any number of threads may call it. Nothing is kept or allocated.
/// Errors    `Error` for an invalid pose, or a displacement with numbers that are not finite or beyond 1e60.
///           One of zero is valid.
/// Cost      a distance for each of Newton's steps and pair of parts on the way: few parts of 3D meshes.
/// Source    Newton's method on the distance, which is a convex function of the way: van den Bergen, Ray
///           Casting against General Convex Objects (2004).
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::optional<CastHit<Dim, T>>
shape_cast(const Shape<Dim>& moving, const Pose<Dim, T>& pose, const Vec<Dim, T>& displacement,
           const Shape<Dim>& shape, const Pose<Dim, T>& shape_pose);

JOSTLE_NAMESPACE_END
