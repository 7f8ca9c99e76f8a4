// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "jostle/box.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/version.hpp"

// The queries about boxes, and what their answers mean. Each is defined here by one function of the user's
// coordinates. Answers are exactly those of this function as written (without fused operations), however the
// index finds them.

JOSTLE_NAMESPACE_BEGIN

/// The points origin + f * direction for 0 <= f <= max_fraction.
///
/// Units     fractions are multiples of `direction`. A fraction too great for T is infinite.
/// Valid     origin and direction are finite. 1 / component is finite for at least one component of the
///           direction (3e-39 is large enough in float, 6e-309 in double). max_fraction is at least 0 and may
///           be infinite.
template <int Dim, Coordinate T>
struct Ray
{
    Vec<Dim, T> origin;
    Vec<Dim, T> direction;
    T max_fraction = std::numeric_limits<T>::infinity();
};

/// A box that moves by f * motion for 0 <= f <= max_fraction, without turning.
///
/// Valid     the box is valid and finite, `motion` is valid as the direction of a ray, max_fraction is at
///           least 0. For a box that doesn't move, use the box itself as the query.
template <int Dim, Coordinate T>
struct Sweep
{
    Aabb<Dim, T> box;
    Vec<Dim, T> motion;
    T max_fraction = 1;
};

/// The points no further than `radius` from `center`. Distances are compared by their squares in T: see
/// squared_distance.
///
/// Valid     the centre is finite. The radius is 0 or infinite, or its square is a normal number: 1.1e-19 to
///           1.8e19 in float, 1.5e-154 to 1.3e154 in double.
template <int Dim, Coordinate T>
struct Sphere
{
    Vec<Dim, T> center;
    T radius;
};

/// The points p with dot(normal, p) + offset >= 0.
///
/// Valid     all numbers are finite. The normal may have any length except zero.
template <int Dim, Coordinate T>
struct Plane
{
    Vec<Dim, T> normal;
    T offset;
};

/// The space inside any number of planes: a camera's view, a shadow volume, a slab. Without planes, all
/// space.
///
/// Meaning   a box counts as inside unless it lies wholly outside one of the planes. So near the edges of the
///           volume a box may count although it doesn't touch the volume, as is usual in view culling.
/// Lifetime  a view: the planes must outlive it.
template <int Dim, Coordinate T>
struct Frustum
{
    std::span<const Plane<Dim, T>> planes;
};

/// Finds the `count` boxes nearest to a point, and no further than `max_distance`. A box that contains the
/// point is at distance 0.
///
/// Valid     the point is finite, max_distance is valid as the radius of a sphere.
template <int Dim, Coordinate T>
struct Nearest
{
    Vec<Dim, T> point;
    std::uint32_t count = 1;
    T max_distance = std::numeric_limits<T>::infinity();
};

/// Finds the `count` boxes nearest to a box, and no further than `max_distance`. A box that touches it is at
/// distance 0.
///
/// Valid     the box is valid and finite, max_distance is valid as the radius of a sphere.
template <int Dim, Coordinate T>
struct NearestToBox
{
    Aabb<Dim, T> box;
    std::uint32_t count = 1;
    T max_distance = std::numeric_limits<T>::infinity();
};

using Ray2f = Ray<2, float>;
using Ray3f = Ray<3, float>;
using Ray3d = Ray<3, double>;
using Sweep3f = Sweep<3, float>;
using Sphere3f = Sphere<3, float>;
using Plane3f = Plane<3, float>;
using Frustum3f = Frustum<3, float>;
using Nearest3f = Nearest<3, float>;
using NearestToBox3f = NearestToBox<3, float>;

/// An object found along a ray or sweep or near a point. `Id` is std::uint32_t in a BoxIndex, ObjectId in a
/// World.
template <Coordinate T, class Id = std::uint32_t>
struct Hit
{
    /// The id that means no object.
    static constexpr Id none = [] {
        if constexpr (std::unsigned_integral<Id>)
            return std::numeric_limits<Id>::max();
        else
            return Id{};
    }();

    Id id = none;
    /// Rays and sweeps: the least fraction at which they touch the box, 0 if they touch it at the start.
    /// Nearest: the squared distance.
    T at = 0;

    friend constexpr bool operator==(const Hit&, const Hit&) = default;
    /// The order of all results: by `at`, then id.
    friend constexpr bool operator<(const Hit& a, const Hit& b) noexcept
    {
        return a.at < b.at || (a.at == b.at && a.id < b.id);
    }
};

/// Two objects and the squared distance between their boxes: squared_distance(box of a, box of b).
template <Coordinate T, class Id = std::uint32_t>
struct PairHit
{
    Id a = Hit<T, Id>::none, b = Hit<T, Id>::none;
    T at = 0;

    friend constexpr bool operator==(const PairHit&, const PairHit&) = default;
    /// By `at`, then a, then b.
    friend constexpr bool operator<(const PairHit& x, const PairHit& y) noexcept
    {
        if (x.at != y.at) return x.at < y.at;
        return x.a != y.a ? x.a < y.a : x.b < y.b;
    }
};

/// Says which objects a query is about. An object counts if every given part accepts it. An empty part
/// filters nothing.
struct QueryFilter
{
    /// Bit sets of the objects, by id up to the greatest that the index has held, and those of the asker, on
    /// whose behalf the query is made. An object counts only if category[id] & asker_mask and asker_category
    /// & mask[id] are both non-zero. Give both views or neither.
    StridedView<std::uint32_t> category = {};
    StridedView<std::uint32_t> mask = {};
    std::uint32_t asker_category = ~std::uint32_t{0};
    std::uint32_t asker_mask = ~std::uint32_t{0};
    /// One owner for each id. Objects with the asker's owner don't count: they are its own parts. By default
    /// the asker has no owner (Filter::no_owner), and objects of all owners count.
    StridedView<std::uint32_t> owner = {};
    std::uint32_t asker_owner = ~std::uint32_t{0};
    /// This object doesn't count: the asker itself.
    std::uint32_t exclude = ~std::uint32_t{0};
    /// Called last, with the number of the query (0 if there is only one) and an object that is or may become
    /// a result. How often and in which order it is called is unspecified. A batch calls it from several
    /// threads at a time. An exception that it throws ends the call.
    StoredFunctionRef<bool(std::uint32_t query, std::uint32_t id)> accept = {};
};

/// Queries along a line, about a region, about what is nearest, and all of them, with this dimension and
/// number type.
template <class Query, int Dim, class T>
concept LineOf = std::same_as<Query, Ray<Dim, T>> || std::same_as<Query, Sweep<Dim, T>>;
template <class Query, int Dim, class T>
concept RegionOf = std::same_as<Query, Aabb<Dim, T>> || std::same_as<Query, Sphere<Dim, T>> ||
                   std::same_as<Query, Frustum<Dim, T>>;
template <class Query, int Dim, class T>
concept LineOrRegionOf = LineOf<Query, Dim, T> || RegionOf<Query, Dim, T>;
template <class Query, int Dim, class T>
concept NearestOf = std::same_as<Query, Nearest<Dim, T>> || std::same_as<Query, NearestToBox<Dim, T>>;
template <class Query, int Dim, class T>
concept QueryOf = LineOrRegionOf<Query, Dim, T> || NearestOf<Query, Dim, T>;

// --- What the answers are ---

/// Returns the least fraction at which the moving box touches `target`, or nothing if it doesn't.
///
/// On an axis with motion m and a finite 1 / m, the boxes overlap from `enter` to `leave`, both (difference
/// of bounds) * (1 / m); on any other axis they overlap all the time or never, by their bounds. The result is
/// the greatest of 0 and all `enter`, if that is at most max_fraction and every `leave`.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr std::optional<T> hit_fraction(const Sweep<Dim, T>& sweep,
                                                      const Aabb<Dim, T>& target) noexcept
{
    T first = 0, last = sweep.max_fraction;
    for (int d = 0; d < Dim; ++d) {
        const T inverse = T(1) / sweep.motion[d];
        if (!(inverse >= -std::numeric_limits<T>::max() && inverse <= std::numeric_limits<T>::max())) {
            if (!(target.lo[d] <= sweep.box.hi[d] && sweep.box.lo[d] <= target.hi[d])) return std::nullopt;
            continue;
        }
        const T to_lo = (target.lo[d] - sweep.box.hi[d]) * inverse;
        const T to_hi = (target.hi[d] - sweep.box.lo[d]) * inverse;
        const T enter = inverse > 0 ? to_lo : to_hi;
        const T leave = inverse > 0 ? to_hi : to_lo;
        if (enter > first) first = enter;
        if (leave < last) last = leave;
    }
    if (first <= last) return first;
    return std::nullopt;
}

/// A ray is the sweep of a point: it touches faces that it runs along, and it touches boxes that it begins in
/// at 0.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr std::optional<T> hit_fraction(const Ray<Dim, T>& ray,
                                                      const Aabb<Dim, T>& target) noexcept
{
    Sweep<Dim, T> sweep{};
    for (int d = 0; d < Dim; ++d) {
        sweep.box.lo[d] = sweep.box.hi[d] = ray.origin[d];
        sweep.motion[d] = ray.direction[d];
    }
    sweep.max_fraction = ray.max_fraction;
    return hit_fraction(sweep, target);
}

/// The squared distance from a point to a box, summed from the first axis to the last in T. If the square
/// overflows it is infinite, and if it underflows it is 0: such distances can't be told apart.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr T squared_distance(const std::type_identity_t<Vec<Dim, T>>& point,
                                           const Aabb<Dim, T>& box) noexcept
{
    T sum = 0;
    for (int d = 0; d < Dim; ++d) {
        const T below = box.lo[d] - point[d], above = point[d] - box.hi[d];
        const T gap = below > 0 ? below : (above > 0 ? above : T(0));
        sum += gap * gap;
    }
    return sum;
}

/// The squared distance between two boxes: the same sum over the gaps between them.
template <int Dim, Coordinate T, std::same_as<Aabb<Dim, T>> From>
[[nodiscard]] constexpr T squared_distance(const From& from, const Aabb<Dim, T>& box) noexcept
{
    T sum = 0;
    for (int d = 0; d < Dim; ++d) {
        const T below = box.lo[d] - from.hi[d], above = from.lo[d] - box.hi[d];
        const T gap = below > 0 ? below : (above > 0 ? above : T(0));
        sum += gap * gap;
    }
    return sum;
}

template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool overlaps(const Sphere<Dim, T>& sphere, const Aabb<Dim, T>& box) noexcept
{
    return squared_distance(sphere.center, box) <= sphere.radius * sphere.radius;
}

/// Whether dot(normal, corner) + offset >= 0 for every plane, where corner is the box's corner furthest along
/// the normal, and the product is summed from the first axis to the last, without axes on which the normal is
/// 0.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool overlaps(const Frustum<Dim, T>& frustum, const Aabb<Dim, T>& box) noexcept
{
    for (const Plane<Dim, T>& plane : frustum.planes) {
        T sum = 0;
        for (int d = 0; d < Dim; ++d) {
            if (plane.normal[d] > 0) sum += plane.normal[d] * box.hi[d];
            if (plane.normal[d] < 0) sum += plane.normal[d] * box.lo[d];
        }
        if (!(sum + plane.offset >= 0)) return false;
    }
    return true;
}

namespace detail {
/// The `Error` for a visitor that has set the bound to NaN.
[[noreturn]] JOSTLE_API void throw_bad_bound(std::uint32_t object);
} // namespace detail

JOSTLE_NAMESPACE_END
