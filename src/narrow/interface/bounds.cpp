// SPDX-License-Identifier: MIT
#include <cstring>
#include <limits>
#include <string>

#include "jostle/objects.hpp"
#include "jostle/process.hpp"
#include "narrow/interface/input_checks.hpp"
#include "narrow/shapes/extent.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace narrow {
namespace {

double rounded_down(double value, double)
{
    return value;
}
/// std::nextafter written out: as a call it took longer than the rest of a sphere's box.
float rounded_down(double value, float)
{
    const float near = static_cast<float>(value);
    if (!(double{near} > value)) return near;
    if (near == 0) return -std::numeric_limits<float>::denorm_min();
    std::uint32_t bits;
    std::memcpy(&bits, &near, sizeof bits);
    bits += near > 0 ? ~0u : 1u;
    float below;
    std::memcpy(&below, &bits, sizeof below);
    return below;
}
template <class T>
T rounded_down(double value)
{
    return rounded_down(value, T{});
}
template <class T>
T rounded_up(double value)
{
    return -rounded_down<T>(-value);
}

void check_margin(double margin)
{
    if (!(margin >= 0))
        throw Error(ErrorCode::invalid_argument,
                    "the margin of bounds is " + text(margin) + "; give a length of 0 or more");
}

template <int Dim, class T>
Aabb<Dim, T> box_of(const Shape<Dim>& shape, const Pose<Dim, T>& pose, double margin, std::uint64_t object)
{
    if (!valid(pose)) refuse_pose(pose, object);
    Aabb<Dim, T> box;
    Extent<Dim> e = nothing<Dim>();
    const M<Dim> turned = shape.type() == ShapeTypes::sphere ? M<Dim>{} : rotation(pose);
    add_shape(shape, turned, V<Dim>{}, e);
    const V<Dim> p = load(pose.position);
    // The rounding of rotations, sums and the tests themselves: some 8 units in the last place of a double.
    double reach = ShapeAccess::reach(shape);
    if (!(reach < HUGE_VAL)) { // a half-space, perhaps in a compound
        reach = 0;
        for (int d = 0; d < Dim; ++d)
            for (const double end : {std::abs(e.lo[d]), std::abs(e.hi[d])})
                if (end < HUGE_VAL) reach = std::max(reach, end);
    }
    for (int d = 0; d < Dim; ++d) {
        const double rounding = 2e-15 * (std::abs(p[d]) + reach + margin);
        box.lo[d] = rounded_down<T>(p[d] + e.lo[d] - margin - rounding);
        box.hi[d] = rounded_up<T>(p[d] + e.hi[d] + margin + rounding);
    }
    return box;
}

} // namespace
} // namespace narrow

template <int Dim, Coordinate T>
Aabb<Dim, T> bounds(const Shape<Dim>& shape, const Pose<Dim, T>& pose, std::type_identity_t<T> margin)
{
    narrow::check_margin(double{margin});
    return narrow::box_of(shape, pose, double{margin}, Error::no_index);
}

template <int Dim, Coordinate T>
void detail::write_bounds(const Objects<Dim, T>& objects, std::span<Aabb<Dim, T>> out, T margin,
                          Executor& executor)
{
    const StridedView<Shape<Dim>>& shapes = objects.shapes;
    const StridedView<Pose<Dim, T>>& poses = objects.poses;
    if (shapes.size() != poses.size() || shapes.size() != out.size())
        throw Error(ErrorCode::size_mismatch, "bounds was given " + std::to_string(shapes.size()) +
                                                  " shapes, " + std::to_string(poses.size()) + " poses and " +
                                                  std::to_string(out.size()) +
                                                  " boxes to write; give as many of each");
    narrow::check_margin(double{margin});
    constexpr std::size_t block = 1024;
    process_items(out.size(),
                  [&](std::uint64_t first, std::uint64_t last, Work) {
                      for (std::uint64_t i = first; i < last; ++i)
                          out[i] = narrow::box_of(shapes[i], poses[i], double{margin}, i);
                  },
                  {&executor, block});
}

#define JOSTLE_BOUNDS(Dim, T)                                                                                \
    template JOSTLE_API Aabb<Dim, T> bounds(const Shape<Dim>&, const Pose<Dim, T>&, T);                      \
    template JOSTLE_API void detail::write_bounds(const Objects<Dim, T>&, std::span<Aabb<Dim, T>>, T,        \
                                                  Executor&)
JOSTLE_BOUNDS(2, float);
JOSTLE_BOUNDS(2, double);
JOSTLE_BOUNDS(3, float);
JOSTLE_BOUNDS(3, double);

JOSTLE_NAMESPACE_END
