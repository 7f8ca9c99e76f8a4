// SPDX-License-Identifier: MIT
#include <cstring>
#include <limits>
#include <string>

#include "jostle/process.hpp"
#include "narrow/interface/input_checks.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace narrow {
namespace {

template <int Dim>
struct Extent
{
    double lo[Dim], hi[Dim]; // from the position
    void add(const V<Dim>& p)
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d] = std::min(lo[d], p[d]);
            hi[d] = std::max(hi[d], p[d]);
        }
    }
};

Vec3 column(const Mat3& r, int axis)
{
    return axis == 0 ? r.x : axis == 1 ? r.y : r.z;
}
Vec2 column(const Mat2& r, int axis)
{
    return axis == 0 ? Vec2{r.c, r.s} : Vec2{-r.s, r.c};
}

/// Of short vectors as well, whose squares are lost.
template <class Vector>
double any_length(const Vector& v)
{
    const double square = length2(v);
    return squares_well(square) ? std::sqrt(square) : length(v * 0x1p600) * 0x1p-600;
}

/// How far a disc about the y axis reaches along axis d.
template <int Dim>
double disc_half(const M<Dim>& r, int d, double radius)
{
    V<Dim> across;
    for (int axis = 0; axis < Dim; ++axis)
        if (axis != 1) across[axis] = column(r, axis)[d] * radius;
    return any_length(across);
}

template <int Dim>
Extent<Dim> nothing()
{
    Extent<Dim> e;
    for (int d = 0; d < Dim; ++d) {
        e.lo[d] = HUGE_VAL;
        e.hi[d] = -HUGE_VAL;
    }
    return e;
}

void add_hull(const HullData<3>& hull, const Mat3& r, const Vec3& p, Extent<3>& e)
{
    for (const auto& corner : hull.corners)
        e.add(r * load(corner) + p);
}
void add_hull(const HullData<2>& hull, const Mat2& r, const Vec2& p, Extent<2>& e)
{
    for (const auto& corner : hull.corners)
        e.add(r * load(corner) + p);
}
/// Vertices that no element has aren't part of the shape.
template <int Dim>
void add_mesh(const MeshData<Dim>& mesh, const M<Dim>& r, const V<Dim>& p, Extent<Dim>& e)
{
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        if (mesh.first_at[v] != mesh.first_at[v + 1]) e.add(r * mesh.vertices[v] + p);
}
void add_heights(const HeightData& field, const Mat3& r, const Vec3& p, Extent<3>& e)
{
    for (std::uint32_t row = 0; row < field.rows; ++row)
        for (std::uint32_t column = 0; column < field.columns; ++column)
            e.add(r * Vec3{column * field.spacing_x, field.heights[std::size_t{row} * field.columns + column],
                           row * field.spacing_z} +
                  p);
    for (const std::uint32_t row : {0u, field.rows - 1})
        for (const std::uint32_t column : {0u, field.columns - 1})
            e.add(r * Vec3{column * field.spacing_x, field.floor, row * field.spacing_z} + p);
}
void add_heights(const HeightData&, const Mat2&, const Vec2&, Extent<2>&) {}

template <int Dim>
void add_shape(const Shape<Dim>& shape, const M<Dim>& r, const V<Dim>& p, Extent<Dim>& e)
{
    const V<Dim> size = load(ShapeAccess::size(shape));
    const double radius = ShapeAccess::radius(shape);
    const auto add_symmetric = [&](const auto& half_of) {
        for (int d = 0; d < Dim; ++d) {
            const double half = half_of(d);
            e.lo[d] = std::min(e.lo[d], p[d] - half);
            e.hi[d] = std::max(e.hi[d], p[d] + half);
        }
    };
    switch (kind_of(shape)) {
    case Kind::sphere:
        add_symmetric([&](int) { return radius; });
        return;
    case Kind::capsule:
        add_symmetric([&](int d) { return std::abs(column(r, 1)[d]) * size[1] + radius; });
        return;
    case Kind::box:
    case Kind::rounded_box:
        add_symmetric([&](int d) {
            double half = radius;
            for (int axis = 0; axis < Dim; ++axis)
                half += std::abs(column(r, axis)[d]) * size[axis];
            return half;
        });
        return;
    case Kind::convex:
        add_hull(ShapeAccess::data<HullData<Dim>>(shape), r, p, e);
        return;
    case Kind::rounded_hull: {
        Extent<Dim> hull = nothing<Dim>();
        add_hull(ShapeAccess::data<HullData<Dim>>(shape), r, p, hull);
        for (int d = 0; d < Dim; ++d) {
            e.lo[d] = std::min(e.lo[d], hull.lo[d] - radius);
            e.hi[d] = std::max(e.hi[d], hull.hi[d] + radius);
        }
        return;
    }
    case Kind::cylinder:
        add_symmetric(
            [&](int d) { return std::abs(column(r, 1)[d]) * size[1] + disc_half<Dim>(r, d, size[0]); });
        return;
    case Kind::cone: {
        const V<Dim> tip = column(r, 1) * size[1];
        e.add(p + tip);
        for (int d = 0; d < Dim; ++d) {
            const double half = disc_half<Dim>(r, d, size[0]);
            e.lo[d] = std::min(e.lo[d], p[d] - tip[d] - half);
            e.hi[d] = std::max(e.hi[d], p[d] - tip[d] + half);
        }
        return;
    }
    case Kind::ellipsoid:
        add_symmetric([&](int d) {
            V<Dim> half;
            for (int axis = 0; axis < Dim; ++axis)
                half[axis] = column(r, axis)[d] * size[axis];
            return any_length(half);
        });
        return;
    case Kind::half_space: {
        const V<Dim> normal = r * size;
        for (int d = 0; d < Dim; ++d) {
            double lo = -HUGE_VAL, hi = HUGE_VAL;
            // Along an axis it ends at the plane.
            bool along = true;
            for (int other = 0; other < Dim; ++other)
                along = along && (other == d || normal[other] == 0);
            if (along && normal[d] > 0) hi = p[d] + shape.offset();
            if (along && normal[d] < 0) lo = p[d] - shape.offset();
            e.lo[d] = std::min(e.lo[d], lo);
            e.hi[d] = std::max(e.hi[d], hi);
        }
        return;
    }
    case Kind::mesh:
        add_mesh(ShapeAccess::data<MeshData<Dim>>(shape), r, p, e);
        return;
    case Kind::height_field:
        add_heights(ShapeAccess::data<HeightData>(shape), r, p, e);
        return;
    case Kind::compound:
        for (const auto& child : ShapeAccess::data<CompoundData<Dim>>(shape).children)
            add_shape(child.shape, r * child.frame.r, r * child.frame.p + p, e);
        return;
    case Kind::custom:
        break;
    }
    const CustomShape<Dim>& custom = *shape.custom();
    if (!custom.has_support()) {
        add_symmetric([&](int) { return ShapeAccess::reach(shape); });
        return;
    }
    for (int d = 0; d < Dim; ++d)
        for (const double sign : {-1.0, 1.0}) {
            V<Dim> axis;
            axis[d] = sign;
            Vec<Dim, double> local;
            store(r.back(axis), local);
            e.add(r * load(custom.support(local)) + p);
        }
}

double rounded_down(double value, double)
{
    return value;
}
/// std::nextafter by hand: as a call it took longer than the rest of a sphere's box.
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
Aabb<Dim, T> box_of(const Shape<Dim>& shape, const Pose<Dim, T>& pose, double margin)
{
    Aabb<Dim, T> box;
    if (!valid(pose)) {
        for (int d = 0; d < Dim; ++d)
            box.lo[d] = box.hi[d] = std::numeric_limits<T>::quiet_NaN();
        return box;
    }
    Extent<Dim> e = nothing<Dim>();
    const M<Dim> turned = shape.type() == ShapeTypes::sphere ? M<Dim>{} : rotation(pose);
    add_shape(shape, turned, V<Dim>{}, e);
    const V<Dim> p = load(pose.position);
    // What rotations, sums and the tests themselves round: some 8 units in the last place of a double.
    double reach = ShapeAccess::reach(shape);
    if (!(reach < HUGE_VAL)) { // a half-space, with others in a compound perhaps
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
    return narrow::box_of(shape, pose, double{margin});
}

template <int Dim, Coordinate T>
void bounds(StridedView<Shape<Dim>> shapes, StridedView<Pose<Dim, T>> poses, std::span<Aabb<Dim, T>> out,
            std::type_identity_t<T> margin, Executor& executor)
{
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
                          out[i] = narrow::box_of(shapes[i], poses[i], double{margin});
                  },
                  {&executor, block});
}

#define JOSTLE_BOUNDS(Dim, T)                                                                                \
    template JOSTLE_API Aabb<Dim, T> bounds(const Shape<Dim>&, const Pose<Dim, T>&, T);                      \
    template JOSTLE_API void bounds(StridedView<Shape<Dim>>, StridedView<Pose<Dim, T>>,                      \
                                    std::span<Aabb<Dim, T>>, T, Executor&)
JOSTLE_BOUNDS(2, float);
JOSTLE_BOUNDS(2, double);
JOSTLE_BOUNDS(3, float);
JOSTLE_BOUNDS(3, double);

JOSTLE_NAMESPACE_END
