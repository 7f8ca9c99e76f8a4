// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "jostle/query.hpp"
#include "jostle/shapes.hpp"
#include "jostle/version.hpp"

// What a ray or a moving shape hits first. A BoxIndex or a World finds the boxes that a ray passes through;
// ray_cast tells whether and where it hits the shape inside. Given the shapes, a BoxIndex or a World does
// both:
//
//     const auto hit = world.first(Ray3f{eye, forward, 100}, {shapes, poses}); // see Queries

JOSTLE_NAMESPACE_BEGIN

/// Where a ray or a moving shape first meets another shape.
template <int Dim, Coordinate T>
struct CastHit
{
    T fraction;                    ///< of the ray's direction or of the displacement
    Vec<Dim, T> normal;            ///< unit, out of the surface that is hit
    Vec<Dim, T> point;             ///< on that surface, relative to the position of its pose, in world axes
    std::uint32_t part = 0;        ///< triangle, segment or child that is hit; 0 for shapes without parts
    std::uint32_t moving_part = 0; ///< part of the moving shape; 0 for a ray
};

using CastHit3f = CastHit<3, float>;

/// Returns where a ray first meets a shape, or nothing if it misses.
///
/// Inside    a ray that begins in a solid hits it at fraction 0, with the normal opposite to its direction.
///           All shapes are solids except meshes; a height field is solid down to its floor.
/// Sides     rays hit triangles and segments of a mesh from both sides. The normal is that of the side that
///           is hit: it never points along the ray. Compare it with the order of the element's vertices to
///           tell which side that is.
/// Meshes    a ray never slips through an edge or corner that elements share. A ray in the plane of a
///           triangle doesn't hit it.
/// Ties      of parts hit at the same fraction the lowest number is reported.
/// Exact     up to rounding along the ray. Rays generally miss shapes of zero thickness (a sphere of radius
///           0, a hull that is a segment). A custom shape, known by its support points, is hit to within 1e-9
///           of its size.
/// Threads   any number of threads may call it. Nothing is kept or allocated.
/// Errors    `Error` for an invalid ray (see Ray; also for an origin beyond 1e60) or an invalid pose.
/// Cost      a formula for simple shapes; one pass over the faces of a hull; a tree search for a mesh; the
///           rows that it crosses for a height field.
/// Source    Cyrus, Beck, Generalized Two- and Three-Dimensional Clipping (1978), for hulls; Woop, Benthin,
///           Wald, Watertight Ray/Triangle Intersection, JCGT 2(1), 2013.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::optional<CastHit<Dim, T>>
ray_cast(const Shape<Dim>& shape, const Pose<Dim, T>& pose, const Ray<Dim, T>& ray);

/// Returns where a shape that moves by `displacement`, without turning, first touches another one, or nothing
/// if it doesn't. For shapes that turn see time_of_impact.
///
/// Start     shapes that touch at the start hit at fraction 0, in whichever direction the shape moves;
///           normal, point and parts are those of a pair of touching parts. distance(moving, pose, shape,
///           shape_pose, 0) then tells their depth, and contacts() the ways out.
/// Meshes    have no inside. A height field is a solid, with sides and an underside.
/// Exact     up to a billionth of the parts' size, and never later than the true touch except for rounding of
///           the path. Shapes that only graze each other may count as a hit or not. Half-spaces never meet.
/// Ties      of parts hit at the same fraction, the same one is always reported.
/// Threads   any number of threads may call it. Nothing is kept or allocated.
/// Errors    `Error` for an invalid pose, or a displacement with numbers that are not finite or beyond 1e60.
///           A zero displacement is valid.
/// Cost      one distance() for each Newton step and each pair of parts on the way; of 3D meshes only few
///           parts are tested.
/// Source    Newton's method on the distance, which is convex along the path: van den Bergen, Ray Casting
///           against General Convex Objects (2004).
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::optional<CastHit<Dim, T>>
shape_cast(const Shape<Dim>& moving, const Pose<Dim, T>& pose, const Vec<Dim, T>& displacement,
           const Shape<Dim>& shape, const Pose<Dim, T>& shape_pose);

JOSTLE_NAMESPACE_END
