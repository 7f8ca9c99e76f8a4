// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <vector>

#include "bytes.hpp"
#include "jostle/mpi.hpp"

// How each query goes to other ranks, and how far it reaches.

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

enum class Purpose : std::uint8_t
{
    first = 1,
    all,
    nearest,
    count,
};

template <int Dim, class T>
using Planes = std::pmr::vector<Plane<Dim, T>>; ///< of a frustum that came here, which refers to them
template <int Dim>
using Reach = Aabb<Dim, double>;

template <class Bytes, int Dim, class T>
void put(Bytes& bytes, const Vec<Dim, T>& vector)
{
    for (int d = 0; d < Dim; ++d)
        put(bytes, vector[d]);
}
template <int Dim, class T>
[[nodiscard]] Vec<Dim, T> take_vector(Reader& from) noexcept
{
    Vec<Dim, T> vector;
    for (int d = 0; d < Dim; ++d)
        vector[d] = from.take<T>();
    return vector;
}

template <int Dim, class T>
[[nodiscard]] Reach<Dim> reach_of(const Aabb<Dim, T>& box) noexcept
{
    Reach<Dim> reach;
    for (int d = 0; d < Dim; ++d) {
        reach.lo[d] = box.lo[d];
        reach.hi[d] = box.hi[d];
    }
    return reach;
}
/// Of all boxes at a squared distance to this one of at most limit, as squared_distance computes it: sums and
/// products are rounded, and squares below the least normal number vanish.
template <int Dim, class T>
[[nodiscard]] Reach<Dim> reach_around(const Aabb<Dim, T>& box, double distance) noexcept
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double rounded = distance * (1 + 16 * double{std::numeric_limits<T>::epsilon()}) +
                           2 * std::sqrt(double{std::numeric_limits<T>::min()});
    Reach<Dim> reach;
    for (int d = 0; d < Dim; ++d) {
        reach.lo[d] = std::nextafter(box.lo[d] - rounded, -infinity);
        reach.hi[d] = std::nextafter(box.hi[d] + rounded, infinity);
    }
    return reach;
}

/// Form<Query>::write and read turn a query into bytes and back; reach() has a point in common with the
/// bounds of every object that the query finds. For nearest() there is asker(): the box from which is
/// measured.
template <class Query>
struct Form;

template <int Dim, class T>
struct Form<Sweep<Dim, T>>
{
    template <class Bytes>
    static void write(Bytes& bytes, const Sweep<Dim, T>& sweep)
    {
        put(bytes, sweep.box);
        put(bytes, sweep.motion);
        put(bytes, sweep.max_fraction);
    }
    static void read(Reader& from, Sweep<Dim, T>& sweep, Planes<Dim, T>&)
    {
        sweep.box = from.box<Dim, T>();
        sweep.motion = take_vector<Dim, T>(from);
        sweep.max_fraction = from.take<T>();
    }
    /// As hit_fraction computes it: differences, quotients and products are rounded, and products below the
    /// least normal number may vanish.
    static Reach<Dim> reach(const Sweep<Dim, T>& sweep) noexcept
    {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        constexpr double greatest = std::numeric_limits<T>::max();
        Reach<Dim> reach = reach_of(sweep.box);
        for (int d = 0; d < Dim; ++d) {
            const double inverse = T(1) / sweep.motion[d], motion = std::abs(double{sweep.motion[d]});
            if (!(inverse >= -greatest && inverse <= greatest)) continue; // it doesn't move on this axis
            const double fraction = sweep.max_fraction * (1 + 16 * double{std::numeric_limits<T>::epsilon()});
            const double vanishing = 4 * double{std::numeric_limits<T>::min()} * motion;
            const double way = inverse == 0 ? infinity : motion * fraction + vanishing;
            const double back = inverse == 0 ? infinity : vanishing;
            reach.lo[d] = std::nextafter(reach.lo[d] - (inverse > 0 ? back : way), -infinity);
            reach.hi[d] = std::nextafter(reach.hi[d] + (inverse > 0 ? way : back), infinity);
        }
        return reach;
    }
};

template <int Dim, class T>
struct Form<Ray<Dim, T>>
{
    template <class Bytes>
    static void write(Bytes& bytes, const Ray<Dim, T>& ray)
    {
        put(bytes, ray.origin);
        put(bytes, ray.direction);
        put(bytes, ray.max_fraction);
    }
    static void read(Reader& from, Ray<Dim, T>& ray, Planes<Dim, T>&)
    {
        ray.origin = take_vector<Dim, T>(from);
        ray.direction = take_vector<Dim, T>(from);
        ray.max_fraction = from.take<T>();
    }
    static Reach<Dim> reach(const Ray<Dim, T>& ray) noexcept
    {
        return Form<Sweep<Dim, T>>::reach({{ray.origin, ray.origin}, ray.direction, ray.max_fraction});
    }
};

template <int Dim, class T>
struct Form<Aabb<Dim, T>>
{
    template <class Bytes>
    static void write(Bytes& bytes, const Aabb<Dim, T>& box)
    {
        put(bytes, box);
    }
    static void read(Reader& from, Aabb<Dim, T>& box, Planes<Dim, T>&) { box = from.box<Dim, T>(); }
    static Reach<Dim> reach(const Aabb<Dim, T>& box) noexcept { return reach_of(box); }
};

template <int Dim, class T>
struct Form<Sphere<Dim, T>>
{
    template <class Bytes>
    static void write(Bytes& bytes, const Sphere<Dim, T>& sphere)
    {
        put(bytes, sphere.center);
        put(bytes, sphere.radius);
    }
    static void read(Reader& from, Sphere<Dim, T>& sphere, Planes<Dim, T>&)
    {
        sphere.center = take_vector<Dim, T>(from);
        sphere.radius = from.take<T>();
    }
    static Reach<Dim> reach(const Sphere<Dim, T>& sphere) noexcept
    {
        return reach_around(Aabb<Dim, T>{sphere.center, sphere.center}, sphere.radius);
    }
};

template <int Dim, class T>
struct Form<Frustum<Dim, T>>
{
    template <class Bytes>
    static void write(Bytes& bytes, const Frustum<Dim, T>& frustum)
    {
        put(bytes, std::uint64_t{frustum.planes.size()});
        for (const Plane<Dim, T>& plane : frustum.planes) {
            put(bytes, plane.normal);
            put(bytes, plane.offset);
        }
    }
    static void read(Reader& from, Frustum<Dim, T>&, Planes<Dim, T>& planes)
    {
        planes.resize(static_cast<std::size_t>(from.take<std::uint64_t>()));
        for (Plane<Dim, T>& plane : planes) {
            plane.normal = take_vector<Dim, T>(from);
            plane.offset = from.take<T>();
        }
    }
    static Reach<Dim> reach(const Frustum<Dim, T>&) noexcept
    {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        Reach<Dim> all;
        for (int d = 0; d < Dim; ++d) {
            all.lo[d] = -infinity;
            all.hi[d] = infinity;
        }
        return all;
    }
};

template <int Dim, class T>
struct Form<NearestToBox<Dim, T>>
{
    template <class Bytes>
    static void write(Bytes& bytes, const NearestToBox<Dim, T>& query)
    {
        put(bytes, query.box);
        put(bytes, query.count);
        put(bytes, query.max_distance);
    }
    static void read(Reader& from, NearestToBox<Dim, T>& query, Planes<Dim, T>&)
    {
        query.box = from.box<Dim, T>();
        query.count = from.take<std::uint32_t>();
        query.max_distance = from.take<T>();
    }
    static Aabb<Dim, T> asker(const NearestToBox<Dim, T>& query) noexcept { return query.box; }
};

template <int Dim, class T>
struct Form<Nearest<Dim, T>>
{
    template <class Bytes>
    static void write(Bytes& bytes, const Nearest<Dim, T>& query)
    {
        put(bytes, query.point);
        put(bytes, query.count);
        put(bytes, query.max_distance);
    }
    static void read(Reader& from, Nearest<Dim, T>& query, Planes<Dim, T>&)
    {
        query.point = take_vector<Dim, T>(from);
        query.count = from.take<std::uint32_t>();
        query.max_distance = from.take<T>();
    }
    static Aabb<Dim, T> asker(const Nearest<Dim, T>& query) noexcept { return {query.point, query.point}; }
};

template <class Bytes>
void put(Bytes& bytes, const QueryFilter& filter)
{
    put(bytes, filter.category);
    put(bytes, filter.mask);
    put(bytes, filter.owner);
    put(bytes, std::uint8_t{filter.exclude.has_value()});
    if (filter.exclude) put(bytes, *filter.exclude);
}
inline void take(Reader& from, QueryFilter& filter) noexcept
{
    filter.category = from.take<std::uint32_t>();
    filter.mask = from.take<std::uint32_t>();
    filter.owner = from.take<std::uint32_t>();
    if (from.take<std::uint8_t>() != 0) filter.exclude = from.take<std::uint64_t>();
}
template <class Bytes>
void put(Bytes& bytes, const Found& found)
{
    put(bytes, found.id);
    put(bytes, std::int32_t{found.rank});
}
template <class Bytes, class T>
void put(Bytes& bytes, const ObjectHit<T>& hit)
{
    put(bytes, hit.id);
    put(bytes, std::int32_t{hit.rank});
    put(bytes, hit.at);
}
inline void take(Reader& from, std::uint64_t& number) noexcept
{
    number = from.take<std::uint64_t>();
}
inline void take(Reader& from, Found& found) noexcept
{
    found.id = from.take<std::uint64_t>();
    found.rank = from.take<std::int32_t>();
}
template <class T>
void take(Reader& from, ObjectHit<T>& hit) noexcept
{
    hit.id = from.take<std::uint64_t>();
    hit.rank = from.take<std::int32_t>();
    hit.at = from.take<T>();
}

/// The order of answers.
[[nodiscard]] inline bool earlier(const Found& a, const Found& b) noexcept
{
    return a.id < b.id;
}
template <class T>
[[nodiscard]] bool earlier(const ObjectHit<T>& a, const ObjectHit<T>& b) noexcept
{
    return a.at != b.at ? a.at < b.at : a.id < b.id;
}

} // namespace mpi
JOSTLE_NAMESPACE_END
