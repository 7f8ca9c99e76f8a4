// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <concepts>
#include <iterator>
#include <span>
#include <type_traits>
#include <utility>

#include "jostle/box.hpp"
#include "jostle/executor.hpp"
#include "jostle/shapes.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Objects with a shape and a pose each, in the user's own arrays, vectors, spans or members of structs:
/// write {shapes, poses} where they are wanted.
///
/// Shapes    may be used again: StridedView<Shape3>(shapes).repeated(poses.size()) goes through a set over
///           and over, StridedView<Shape3>(&shape, poses.size(), 0) has one for all.
/// Lifetime  views: what they refer to must outlive them.
template <int Dim, Coordinate T>
struct Objects
{
    StridedView<Shape<Dim>> shapes;
    StridedView<Pose<Dim, T>> poses;
};

/// A pose that moves: at time t in [0, 1] the object is at pose.position + t * linear, turned from
/// pose.rotation by the angle |angular| * t about the world axis `angular` through its position.
template <int Dim, Coordinate T>
struct Motion
{
    Pose<Dim, T> pose;
    Vec<Dim, T> linear = {};                      ///< length per whole motion
    std::array<T, Dim == 3 ? 3 : 1> angular = {}; ///< radians per whole motion
};

/// Objects that move: {shapes, motions}.
template <int Dim, Coordinate T>
struct MovingObjects
{
    StridedView<Shape<Dim>> shapes;
    StridedView<Motion<Dim, T>> motions;
};

using Objects3f = Objects<3, float>;
using Motion3f = Motion<3, float>;

/// The boxes of all objects: out[i] is bounds(shapes[i], poses[i], margin). The calling thread does it all
/// unless an executor is given.
/// Errors   `Error` where there aren't as many shapes, poses and boxes, for a negative margin, and for the
///          lowest invalid pose, which it names; what `out` then holds is unspecified.
template <int Dim, Coordinate T>
JOSTLE_API void bounds(const Objects<Dim, T>& objects, std::span<Aabb<Dim, T>> out,
                       std::type_identity_t<T> margin = 0, Executor& executor = serial_executor());
/// With {shapes, poses} and any contiguous boxes.
template <class Boxes, class Box = std::remove_pointer_t<decltype(std::data(std::declval<Boxes&>()))>,
          Coordinate T = typename decltype(Box::lo)::value_type>
void bounds(const Objects<static_cast<int>(decltype(Box::lo)::size()), T>& objects, Boxes&& out,
            std::type_identity_t<T> margin = 0, Executor& executor = serial_executor())
{
    constexpr int dim = static_cast<int>(decltype(Box::lo)::size());
    bounds<dim, T>(objects, std::span<Aabb<dim, T>>(out), margin, executor);
}

JOSTLE_NAMESPACE_END
