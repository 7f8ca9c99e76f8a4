// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "jostle/box_index.hpp"
#include "jostle/cast.hpp"
#include "jostle/contact.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/objects.hpp"
#include "jostle/queries.hpp"
#include "jostle/shapes.hpp"
#include "jostle/version.hpp"
#include "jostle/world.hpp"

// Queries about the shapes of a World's or BoxIndex's objects, with the verbs of Queries, and their answers:
//
//     if (const auto hit = world.first(Ray3f{eye, direction}, {shapes, poses}))
//         use(hit->id, poses[hit->id.index].position + hit->point, hit->normal);

JOSTLE_NAMESPACE_BEGIN

/// A shape that moves by `displacement`, without turning.
template <int Dim, Coordinate T>
struct ShapeSweep
{
    Shape<Dim> shape;
    Pose<Dim, T> pose;
    Vec<Dim, T> displacement;
};

/// Finds the `count` shapes nearest to this one, and no further than `max_distance`.
template <int Dim, Coordinate T>
struct NearestToShape
{
    Shape<Dim> shape; ///< Shape() is a point
    Pose<Dim, T> pose;
    std::uint32_t count = 1;
    T max_distance = std::numeric_limits<T>::infinity();
};

/// A shape that doesn't move. As a query it finds the shapes that touch it. A function used as PosedShapes
/// returns one.
template <int Dim, Coordinate T>
struct PosedShape
{
    Shape<Dim> shape;
    Pose<Dim, T> pose;
};

namespace detail {

/// The `Error` if an id has no shape or no pose.
[[noreturn]] JOSTLE_API void throw_no_shape(std::uint32_t id, std::size_t shapes, std::size_t poses);

} // namespace detail

/// The shape and pose of each object, by its id in a BoxIndex or the index of its id in a World: Objects, or
/// a function of the id.
///
/// Lifetime  a view: write it in the call, as {shapes, poses} or a lambda. A PosedShapes variable made from a
///           temporary lambda dangles.
template <int Dim, Coordinate T>
class PosedShapes
{
  public:
    /// Arrays, vectors, spans or struct members, with an element for each id up to the greatest that a query
    /// meets.
    PosedShapes(StridedView<Shape<Dim>> shapes, StridedView<Pose<Dim, T>> poses) : objects_{shapes, poses} {}
    /// The same, as a ContactFinder takes them.
    PosedShapes(const Objects<Dim, T>& objects) : objects_(objects) {}
    /// PosedShape<Dim, T> of(std::uint32_t id). A batch calls it from several threads at a time.
    template <class F>
        requires(!std::same_as<std::remove_cvref_t<F>, PosedShapes> &&
                 std::is_invocable_r_v<PosedShape<Dim, T>, F&, std::uint32_t>)
    PosedShapes(F&& of) : of_(std::forward<F>(of))
    {
    }
    /// Calls use(shape, pose) for an object.
    template <class F>
    void with(std::uint32_t id, F&& use) const
    {
        if (of_) {
            const PosedShape<Dim, T> object = of_(id);
            use(object.shape, object.pose);
        } else {
            if (id >= objects_.shapes.size() || id >= objects_.poses.size())
                detail::throw_no_shape(id, objects_.shapes.size(), objects_.poses.size());
            use(objects_.shapes[id], objects_.poses[id]);
        }
    }

  private:
    Objects<Dim, T> objects_;
    FunctionRef<PosedShape<Dim, T>(std::uint32_t id)> of_;
};

/// Where a ray or a moving shape meets an object's shape. `point` is relative to the position of that
/// object's pose; `point` and `normal` are in world axes. `Id` is ObjectId in a World, std::uint32_t in a
/// BoxIndex.
template <int Dim, Coordinate T, class Id = ObjectId>
struct ShapeHit : CastHit<Dim, T>
{
    Id id = Hit<T, Id>::none;
};

/// How far an object's shape is from the query's, and where. The query's shape is a, the object b: see
/// Distance.
template <int Dim, Coordinate T, class Id = ObjectId>
struct ShapeDistance : Distance<Dim, T>
{
    Id id = Hit<T, Id>::none;
};

JOSTLE_NAMESPACE_END
