// SPDX-License-Identifier: MIT
// The order in which two objects of one type are computed if their positions don't determine it: by every
// difference, so that an answer is the same whichever of them is given first.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

// Less than 0 if a comes first, 0 if they can't be told apart.

template <class Number>
    requires std::is_arithmetic_v<Number>
int compare(Number a, Number b)
{
    return a < b ? -1 : a > b ? 1 : 0;
}
inline int compare(const Vec3& a, const Vec3& b)
{
    const int x = compare(a.x, b.x), y = compare(a.y, b.y);
    return x != 0 ? x : y != 0 ? y : compare(a.z, b.z);
}
inline int compare(const Vec2& a, const Vec2& b)
{
    const int x = compare(a.x, b.x);
    return x != 0 ? x : compare(a.y, b.y);
}
inline int compare(const Mat3& a, const Mat3& b)
{
    const int x = compare(a.x, b.x), y = compare(a.y, b.y);
    return x != 0 ? x : y != 0 ? y : compare(a.z, b.z);
}
inline int compare(const Mat2& a, const Mat2& b)
{
    return compare(Vec2{a.c, a.s}, Vec2{b.c, b.s});
}
template <int Dim>
int compare(const Vec<Dim, double>& a, const Vec<Dim, double>& b)
{
    return compare(load(a), load(b));
}
template <std::size_t N>
int compare(const std::array<std::uint32_t, N>& a, const std::array<std::uint32_t, N>& b)
{
    return a < b ? -1 : a > b ? 1 : 0;
}

template <int Dim>
int compare(const Shape<Dim>& a, const Shape<Dim>& b);

template <int Dim>
int compare_children(const typename CompoundData<Dim>::Child& a, const typename CompoundData<Dim>::Child& b)
{
    if (const int c = compare(a.frame.p, b.frame.p); c != 0) return c;
    if (const int c = compare(a.frame.r, b.frame.r); c != 0) return c;
    if (const int c = compare(a.shape.type(), b.shape.type()); c != 0) return c;
    return compare(a.shape, b.shape);
}
template <class Item, class Compare>
int compare_lists(const std::vector<Item>& a, const std::vector<Item>& b, const Compare& compare_items)
{
    if (const int c = compare(a.size(), b.size()); c != 0) return c;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (const int c = compare_items(a[i], b[i]); c != 0) return c;
    return 0;
}
constexpr auto compare_items = [](const auto& a, const auto& b) { return compare(a, b); };

inline int compare(const HullData<2>& a, const HullData<2>& b)
{
    return compare_lists(a.corners, b.corners, compare_items);
}
/// Equal corners may have different faces, which depend on all given points and their type.
inline int compare(const HullData<3>& a, const HullData<3>& b)
{
    if (const int c = compare_lists(a.corners, b.corners, compare_items); c != 0) return c;
    if (const int c = compare_lists(a.loop, b.loop, compare_items); c != 0) return c;
    return compare_lists(a.normals, b.normals, compare_items);
}
template <int Dim>
int compare(const MeshData<Dim>& a, const MeshData<Dim>& b)
{
    if (const int c = compare_lists(a.vertices, b.vertices, compare_items); c != 0) return c;
    return compare_lists(a.elements, b.elements, compare_items);
}
inline int compare(const HeightData& a, const HeightData& b)
{
    if (const int c = compare(a.columns, b.columns); c != 0) return c;
    const Vec3 a_numbers{a.spacing_x, a.spacing_z, a.floor}, b_numbers{b.spacing_x, b.spacing_z, b.floor};
    if (const int c = compare(a_numbers, b_numbers); c != 0) return c;
    return compare_lists(a.heights, b.heights, compare_items);
}
template <int Dim>
int compare(const CompoundData<Dim>& a, const CompoundData<Dim>& b)
{
    return compare_lists(a.children, b.children, compare_children<Dim>);
}

/// Compares what shapes point to. Most point to the same object; otherwise the cost grows with their size.
template <class Data, int Dim>
int compare_data(const Shape<Dim>& a, const Shape<Dim>& b)
{
    const Data &data_a = ShapeAccess::data<Data>(a), &data_b = ShapeAccess::data<Data>(b);
    return &data_a == &data_b ? 0 : compare(data_a, data_b);
}
/// Two shapes of one type. Of custom shapes only the size is known.
template <int Dim>
int compare(const Shape<Dim>& a, const Shape<Dim>& b)
{
    if (const int c = compare(ShapeAccess::reach(a), ShapeAccess::reach(b)); c != 0) return c;
    if (const int c = compare(ShapeAccess::radius(a), ShapeAccess::radius(b)); c != 0) return c;
    if (const int c = compare(ShapeAccess::size(a), ShapeAccess::size(b)); c != 0) return c;
    if (const int c = compare(a.offset(), b.offset()); c != 0) return c;
    switch (kind_of(a)) {
    case Kind::convex:
    case Kind::rounded_hull:
        return compare_data<HullData<Dim>>(a, b);
    case Kind::mesh:
        return compare_data<MeshData<Dim>>(a, b);
    case Kind::height_field:
        return compare_data<HeightData>(a, b);
    case Kind::compound:
        return compare_data<CompoundData<Dim>>(a, b);
    case Kind::sphere:
    case Kind::capsule:
    case Kind::box:
    case Kind::half_space:
    case Kind::rounded_box:
    case Kind::cylinder:
    case Kind::cone:
    case Kind::ellipsoid:
    case Kind::custom:
        break;
    }
    return 0;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
