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

/// Objects with a shape and a pose each, read from the user's arrays, vectors, spans or struct members: write
/// {shapes, poses} as the argument.
///
/// Shapes    may be shared: StridedView<Shape3>(shapes).repeated(poses.size()) repeats a set, and
///           StridedView<Shape3>(&shape, poses.size(), 0) has one shape for all.
/// Lifetime  views: the memory must outlive them.
template <int Dim, Coordinate T>
struct Objects
{
    StridedView<Shape<Dim>> shapes;
    StridedView<Pose<Dim, T>> poses;
};

/// A moving pose: at time t in [0, 1] the object is at pose.position + t * linear, turned from pose.rotation
/// by the angle |angular| * t about the world axis `angular` through its position.
template <int Dim, Coordinate T>
struct Motion
{
    Pose<Dim, T> pose;
    Vec<Dim, T> linear = {};                      ///< length per whole motion
    std::array<T, Dim == 3 ? 3 : 1> angular = {}; ///< radians per whole motion
};

/// Moving objects: {shapes, motions}.
template <int Dim, Coordinate T>
struct MovingObjects
{
    StridedView<Shape<Dim>> shapes;
    StridedView<Motion<Dim, T>> motions;
};

using Objects3f = Objects<3, float>;
using Motion3f = Motion<3, float>;

namespace detail {
template <int Dim, Coordinate T>
JOSTLE_API void write_bounds(const Objects<Dim, T>& objects, std::span<Aabb<Dim, T>> out, T margin,
                             Executor& executor);
}

/// Sets out[i] to bounds(shapes[i], poses[i], margin); `out` is any contiguous container of boxes. Runs on
/// the calling thread unless an executor is given.
/// Errors   `Error` if the numbers of shapes, poses and boxes differ, for a negative margin, and for the
///          lowest invalid pose, which it names. The contents of `out` are then unspecified.
template <class Boxes, class Box = std::remove_pointer_t<decltype(std::data(std::declval<Boxes&>()))>,
          Coordinate T = typename decltype(Box::lo)::value_type>
void bounds(const Objects<static_cast<int>(decltype(Box::lo)::size()), T>& objects, Boxes&& out,
            std::type_identity_t<T> margin = 0, Executor& executor = serial_executor())
{
    constexpr int dim = static_cast<int>(decltype(Box::lo)::size());
    detail::write_bounds<dim, T>(objects, std::span<Aabb<dim, T>>(out), margin, executor);
}

JOSTLE_NAMESPACE_END
