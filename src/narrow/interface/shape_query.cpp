// SPDX-License-Identifier: MIT
// What the function templates of shape_query.hpp leave to the library.
#include "jostle/shape_query.hpp"

#include <cmath>
#include <string>

#include "jostle/error.hpp"
#include "narrow/interface/answers.hpp"
#include "narrow/interface/input_checks.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace detail {
namespace {

/// Errors of check() name the question, where it has a number.
template <class F>
void checked_as(std::uint64_t number, const F& check)
{
    if (number == Error::no_index) return check();
    try {
        check();
    } catch (const Error& error) {
        throw Error(error.code(), "question " + std::to_string(number) + ": " + error.what(), number);
    }
}
template <int Dim, Coordinate T>
void check_pose(const Pose<Dim, T>& pose, std::uint64_t object)
{
    if (!narrow::valid(pose)) narrow::refuse_pose(pose, object);
}
template <int Dim, Coordinate T>
bool finite(const Aabb<Dim, T>& box)
{
    bool good = true;
    for (int d = 0; d < Dim; ++d)
        good = good && std::abs(box.lo[d]) <= std::numeric_limits<T>::max() &&
               std::abs(box.hi[d]) <= std::numeric_limits<T>::max();
    return good;
}

} // namespace

template <int Dim, Coordinate T>
void check_question(const Ray<Dim, T>& ray, std::uint64_t number)
{
    checked_as(number, [&] { narrow::check_ray(ray, Error::no_index); });
}
template <int Dim, Coordinate T>
void check_question(const ShapeSweep<Dim, T>& sweep, std::uint64_t number)
{
    checked_as(number, [&] {
        check_pose(sweep.pose, Error::no_index);
        narrow::check_displacement(sweep.displacement, Error::no_index);
    });
}
template <int Dim, Coordinate T>
void check_question(const NearestShape<Dim, T>& nearest, std::uint64_t number)
{
    checked_as(number, [&] {
        check_pose(nearest.pose, Error::no_index);
        narrow::check_max_distance(nearest.max_distance);
    });
}

template <int Dim, Coordinate T>
CastHit<Dim, T> cast_at(const Ray<Dim, T>& ray, const Shape<Dim>& shape, const Pose<Dim, T>& pose,
                        std::uint32_t object)
{
    check_pose(pose, object);
    return narrow::ray_hit_of(shape, pose, ray, narrow::best_kernels());
}
template <int Dim, Coordinate T>
CastHit<Dim, T> cast_at(const ShapeSweep<Dim, T>& sweep, const Shape<Dim>& shape, const Pose<Dim, T>& pose,
                        std::uint32_t object)
{
    check_pose(pose, object);
    return narrow::shape_hit_of(sweep.shape, sweep.pose, sweep.displacement, shape, pose,
                                narrow::best_kernels());
}
template <int Dim, Coordinate T>
Distance<Dim, T> distance_at(const NearestShape<Dim, T>& nearest, const Shape<Dim>& shape,
                             const Pose<Dim, T>& pose, T max_distance, std::uint32_t object)
{
    check_pose(pose, object);
    return narrow::distance_of(nearest.shape, nearest.pose, shape, pose, max_distance,
                               narrow::best_kernels());
}

template <int Dim, Coordinate T>
BoxQuestion<Dim, T> boxes_for(const ShapeSweep<Dim, T>& sweep)
{
    constexpr T most = std::numeric_limits<T>::max();
    BoxQuestion<Dim, T> boxes{};
    const Aabb<Dim, T> box = bounds(sweep.shape, sweep.pose);
    boxes.sweep = {box, sweep.displacement, no_less(T(1))};
    bool moves = false;
    for (const T x : sweep.displacement)
        moves = moves || std::abs(T(1) / x) <= most;
    boxes.lies_in = !moves || !finite(box);
    boxes.region = box;
    for (int d = 0; d < Dim; ++d) {
        const T lo = box.lo[d] + sweep.displacement[d], hi = box.hi[d] + sweep.displacement[d];
        boxes.region.lo[d] = std::min(box.lo[d], std::nextafter(lo, -std::numeric_limits<T>::infinity()));
        boxes.region.hi[d] = std::max(box.hi[d], std::nextafter(hi, std::numeric_limits<T>::infinity()));
    }
    return boxes;
}
template <int Dim, Coordinate T>
BoxQuestion<Dim, T> boxes_for(const NearestShape<Dim, T>& nearest)
{
    constexpr T infinity = std::numeric_limits<T>::infinity();
    // Of distances between boxes the squares are compared: they must be normal numbers.
    constexpr T shortest = sizeof(T) == 4 ? T(2e-19) : T(2e-154);
    BoxQuestion<Dim, T> boxes{};
    const Aabb<Dim, T> box = bounds(nearest.shape, nearest.pose);
    T furthest = std::max(no_less(nearest.max_distance), shortest);
    if (furthest * furthest == infinity) furthest = infinity;
    boxes.nearest = {box, ~std::uint32_t{0}, furthest};
    boxes.lies_in = !finite(box);
    for (int d = 0; d < Dim; ++d) {
        boxes.region.lo[d] = -infinity;
        boxes.region.hi[d] = infinity;
    }
    return boxes;
}

void throw_no_shape(std::uint32_t id, std::size_t shapes, std::size_t poses)
{
    throw Error(ErrorCode::size_mismatch,
                "there is an object with the id " + std::to_string(id) + ", but there are " +
                    std::to_string(shapes) + " shapes and " + std::to_string(poses) +
                    " poses; give one of each for every id",
                id);
}

#define JOSTLE_SHAPE_QUERY(Dim, T)                                                                           \
    template JOSTLE_API void check_question(const Ray<Dim, T>&, std::uint64_t);                              \
    template JOSTLE_API void check_question(const ShapeSweep<Dim, T>&, std::uint64_t);                       \
    template JOSTLE_API void check_question(const NearestShape<Dim, T>&, std::uint64_t);                     \
    template JOSTLE_API CastHit<Dim, T> cast_at(const Ray<Dim, T>&, const Shape<Dim>&, const Pose<Dim, T>&,  \
                                                std::uint32_t);                                              \
    template JOSTLE_API CastHit<Dim, T> cast_at(const ShapeSweep<Dim, T>&, const Shape<Dim>&,                \
                                                const Pose<Dim, T>&, std::uint32_t);                         \
    template JOSTLE_API Distance<Dim, T> distance_at(const NearestShape<Dim, T>&, const Shape<Dim>&,         \
                                                     const Pose<Dim, T>&, T, std::uint32_t);                 \
    template JOSTLE_API BoxQuestion<Dim, T> boxes_for(const ShapeSweep<Dim, T>&);                            \
    template JOSTLE_API BoxQuestion<Dim, T> boxes_for(const NearestShape<Dim, T>&)
JOSTLE_SHAPE_QUERY(2, float);
JOSTLE_SHAPE_QUERY(2, double);
JOSTLE_SHAPE_QUERY(3, float);
JOSTLE_SHAPE_QUERY(3, double);

} // namespace detail
JOSTLE_NAMESPACE_END
