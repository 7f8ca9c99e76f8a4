// SPDX-License-Identifier: MIT
// The extents of shapes along the axes.
#pragma once

#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

template <int Dim>
struct Extent
{
    double lo[Dim], hi[Dim];
    void add(const V<Dim>& p)
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d] = std::min(lo[d], p[d]);
            hi[d] = std::max(hi[d], p[d]);
        }
    }
};
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

inline Vec3 column(const Mat3& r, int axis)
{
    return axis == 0 ? r.x : axis == 1 ? r.y : r.z;
}
inline Vec2 column(const Mat2& r, int axis)
{
    return axis == 0 ? Vec2{r.c, r.s} : Vec2{-r.s, r.c};
}

/// Also for short vectors, whose squares underflow.
template <class Vector>
double any_length(const Vector& v)
{
    const double square = length2(v);
    return squares_well(square) ? std::sqrt(square) : length(v * 0x1p600) * 0x1p-600;
}

/// The extent of a disc about the y axis along axis d.
template <int Dim>
double disc_half(const M<Dim>& r, int d, double radius)
{
    V<Dim> across;
    for (int axis = 0; axis < Dim; ++axis)
        if (axis != 1) across[axis] = column(r, axis)[d] * radius;
    return any_length(across);
}

inline void add_hull(const HullData<3>& hull, const Mat3& r, const Vec3& p, Extent<3>& e)
{
    for (const auto& corner : hull.corners)
        e.add(r * load(corner) + p);
}
inline void add_hull(const HullData<2>& hull, const Mat2& r, const Vec2& p, Extent<2>& e)
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
inline void add_heights(const HeightData& field, const Mat3& r, const Vec3& p, Extent<3>& e)
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
inline void add_heights(const HeightData&, const Mat2&, const Vec2&, Extent<2>&) {}

/// Adds a shape turned by r, at p.
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

} // namespace narrow
JOSTLE_NAMESPACE_END
