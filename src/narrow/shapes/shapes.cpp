// SPDX-License-Identifier: MIT
#include "jostle/shapes.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>

#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN

std::string narrow::text(double number)
{
    char digits[32];
    std::snprintf(digits, sizeof digits, "%g", number);
    return digits;
}

namespace {

[[noreturn]] void refuse(const std::string& what, double value, const std::string& wanted)
{
    throw Error(ErrorCode::invalid_argument, what + " is " + narrow::text(value) + "; give " + wanted);
}
void check_length(const char* what, double value)
{
    if (!(value >= 0 && value <= narrow::longest)) refuse(what, value, "a length from 0 to 1e60");
}

} // namespace

template <int Dim>
CustomShape<Dim>::~CustomShape() = default;

template <int Dim>
Vec<Dim, double> CustomShape<Dim>::support(const Vec<Dim, double>&) const noexcept
{
    return {};
}

template <int Dim>
Shape<Dim> Shape<Dim>::sphere(double radius)
{
    check_length("a sphere's radius", radius);
    Shape shape;
    shape.radius_ = shape.reach_ = radius;
    return shape;
}

template <int Dim>
Shape<Dim> Shape<Dim>::capsule(double half_length, double radius)
{
    check_length("a capsule's half length", half_length);
    check_length("a capsule's radius", radius);
    Shape shape;
    shape.type_ = ShapeTypes::capsule;
    shape.radius_ = radius;
    shape.size_[1] = half_length;
    shape.reach_ = half_length + radius;
    return shape;
}

template <int Dim>
Shape<Dim> Shape<Dim>::box(const Vec<Dim, double>& half)
{
    Shape shape;
    shape.type_ = ShapeTypes::box;
    for (const double h : half)
        check_length("a box's half edge", h);
    shape.size_ = half;
    shape.reach_ = narrow::length(narrow::load(half));
    return shape;
}

template <int Dim>
Shape<Dim> Shape<Dim>::rounded_box(const Vec<Dim, double>& half, double radius)
{
    check_length("a rounded box's radius", radius);
    Shape shape = box(half);
    shape.type_ = ShapeTypes::rounded_box;
    shape.radius_ = radius;
    shape.reach_ += radius;
    return shape;
}

template <int Dim>
Shape<Dim> Shape<Dim>::rounded_hull(const ConvexHull<Dim>& hull, double radius)
{
    check_length("a rounded hull's radius", radius);
    Shape shape(hull);
    shape.type_ = ShapeTypes::rounded_hull;
    shape.radius_ = radius;
    shape.reach_ += radius;
    return shape;
}

template <int Dim>
Shape<Dim> Shape<Dim>::cylinder(double half_length, double radius)
    requires(Dim == 3)
{
    check_length("a cylinder's half length", half_length);
    check_length("a cylinder's radius", radius);
    // clang 14 compiles it for 2, too
    if constexpr (Dim == 3)
        return narrow::ShapeAccess::with_rims(ShapeTypes::cylinder, half_length, radius);
    else
        return {};
}

template <int Dim>
Shape<Dim> Shape<Dim>::cone(double half_length, double radius)
    requires(Dim == 3)
{
    check_length("a cone's half length", half_length);
    check_length("a cone's radius", radius);
    // clang 14 compiles it for 2, too
    if constexpr (Dim == 3)
        return narrow::ShapeAccess::with_rims(ShapeTypes::cone, half_length, radius);
    else
        return {};
}

template <int Dim>
Shape<Dim> Shape<Dim>::ellipsoid(const Vec<Dim, double>& half)
{
    Shape shape;
    shape.type_ = ShapeTypes::ellipsoid;
    for (const double h : half) {
        check_length("half an ellipsoid's width", h);
        shape.reach_ = std::max(shape.reach_, h);
    }
    shape.size_ = half;
    return shape;
}

template <int Dim>
Shape<Dim> Shape<Dim>::half_space(const Vec<Dim, double>& normal, double offset)
{
    double big = 0;
    for (const double n : normal) {
        if (!(std::abs(n) <= std::numeric_limits<double>::max()))
            refuse("a half-space's normal", n, "finite numbers");
        big = std::max(big, std::abs(n));
    }
    if (big == 0) refuse("a half-space's normal", 0, "one that isn't zero");
    if (!(std::abs(offset) <= narrow::longest)) refuse("a half-space's offset", offset, "one within 1e60");
    Shape shape;
    shape.type_ = ShapeTypes::half_space;
    const double up = narrow::lift(big);
    narrow::V<Dim> n = narrow::load(normal) * up * (1 / (big * up));
    narrow::store(n * (1 / narrow::length(n)), shape.size_);
    shape.reach_ = offset;
    return shape;
}

template <int Dim>
Shape<Dim>::Shape(const CustomShape<Dim>& custom, ShapeType type)
{
    if (type < ShapeTypes::first_custom) refuse("a custom shape's type", type, "one from first_custom on");
    const double radius = custom.radius();
    check_length("a custom shape's radius()", radius);
    narrow::ShapeAccess::fill(*this, type, radius, &custom);
}

template class CustomShape<2>;
template class CustomShape<3>;
template class Shape<2>;
template class Shape<3>;

JOSTLE_NAMESPACE_END
