// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <compare>
#include <concepts>
#include <cstddef>
#include <tuple>
#include <type_traits>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// A coordinate type Jostle is built for.
template <class T>
concept Coordinate = std::same_as<T, float> || std::same_as<T, double>;

/// How Jostle reads the coordinates of another library's vector type. Specialise it for types not listed
/// below:
///
///     template <>
///     struct jostle::VectorTraits<game::Position>
///     {
///         static constexpr int size = 3;
///         static float get(const game::Position& p, int axis) { return p.coordinate(axis); }
///     };
///
/// No specialisation is needed for C arrays and std::array; for types with members x, y and, in 3D, z; and
/// for types with an operator[] and a size known at compile time, as a constant SizeAtCompileTime (Eigen), a
/// static length() (glm) or a std::tuple_size.
template <class V>
struct VectorTraits;

namespace detail {
/// Dim as the bound of an array: compilers can warn of its sign otherwise.
template <int Dim>
inline constexpr auto axes = static_cast<std::size_t>(Dim);

template <class V>
concept HasXy = requires(const V& v) {
    v.x + v.x;
    v.y + v.y;
};
template <class V>
concept HasZ = requires(const V& v) { v.z + v.z; };

template <class V>
constexpr int compile_time_size()
{
    if constexpr (std::rank_v<V> == 1)
        return static_cast<int>(std::extent_v<V>);
    else if constexpr (requires { std::tuple_size<V>::value; })
        return static_cast<int>(std::tuple_size<V>::value);
    else if constexpr (requires { static_cast<int>(V::SizeAtCompileTime); })
        return static_cast<int>(V::SizeAtCompileTime);
    else if constexpr (requires { std::integral_constant<int, static_cast<int>(V::length())>{}; })
        return static_cast<int>(V::length());
    else
        return 0;
}
template <class V>
concept Indexed = compile_time_size<V>() > 0 && requires(const V& v) { v[0] + v[0]; };
} // namespace detail

template <class V>
    requires detail::HasXy<V>
struct VectorTraits<V>
{
    static constexpr int size = detail::HasZ<V> ? 3 : 2;
    static constexpr auto get(const V& v, int axis) noexcept
    {
        if constexpr (size == 3)
            return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
        else
            return axis == 0 ? v.x : v.y;
    }
};
template <class V>
    requires(detail::Indexed<V> && !detail::HasXy<V>)
struct VectorTraits<V>
{
    static constexpr int size = detail::compile_time_size<V>();
    static constexpr auto get(const V& v, int axis)
    {
        using Index = std::conditional_t<requires { V::SizeAtCompileTime; }, int, std::size_t>;
        return static_cast<std::remove_cvref_t<decltype(v[0])>>(v[static_cast<Index>(axis)]);
    }
};

template <int Dim, Coordinate T>
struct Vec;
template <int Dim, Coordinate T>
struct VectorTraits<Vec<Dim, T>>
{
    static constexpr int size = Dim;
    static constexpr T get(const Vec<Dim, T>& v, int axis) noexcept { return v[axis]; }
};

/// A vector type of any library with Dim coordinates.
template <class V, int Dim>
concept VectorLike = requires(const V& v) {
    requires VectorTraits<V>::size == Dim;
    { VectorTraits<V>::get(v, 0) } -> std::convertible_to<double>;
};

/// A point or direction: one number per axis, and nothing else in memory. All of Jostle's boxes, rays, poses
/// and contacts consist of it.
///
/// Other vector types convert to it implicitly, such as in `Ray3f{eye, direction}`: see VectorTraits. Only
/// the conversion from double to float is explicit, as Vec3f(v).
template <int Dim, Coordinate T>
struct Vec
{
    static_assert(Dim == 2 || Dim == 3);

    using value_type = T;
    T values[detail::axes<Dim>];

    /// Vec{} is zero. Without an initialiser a Vec is indeterminate, like any number.
    Vec() = default;
    constexpr Vec(T x, T y) noexcept
        requires(Dim == 2)
        : values{x, y}
    {
    }
    constexpr Vec(T x, T y, T z) noexcept
        requires(Dim == 3)
        : values{x, y, z}
    {
    }
    template <class V>
        requires(VectorLike<V, Dim> && !std::same_as<V, Vec>)
    constexpr explicit(std::same_as<T, float> &&
                       !std::integral<decltype(VectorTraits<V>::get(std::declval<const V&>(), 0))> &&
                       !std::same_as<decltype(VectorTraits<V>::get(std::declval<const V&>(), 0)), float>)
        Vec(const V& v)
    {
        for (int axis = 0; axis < Dim; ++axis)
            values[axis] = static_cast<T>(VectorTraits<V>::get(v, axis));
    }

    template <std::integral Index>
    [[nodiscard]] constexpr T& operator[](Index axis) noexcept
    {
        return values[axis];
    }
    template <std::integral Index>
    [[nodiscard]] constexpr const T& operator[](Index axis) const noexcept
    {
        return values[axis];
    }
    [[nodiscard]] constexpr T* data() noexcept { return values; }
    [[nodiscard]] constexpr const T* data() const noexcept { return values; }
    [[nodiscard]] constexpr T* begin() noexcept { return values; }
    [[nodiscard]] constexpr T* end() noexcept { return values + Dim; }
    [[nodiscard]] constexpr const T* begin() const noexcept { return values; }
    [[nodiscard]] constexpr const T* end() const noexcept { return values + Dim; }
    [[nodiscard]] static constexpr std::size_t size() noexcept { return detail::axes<Dim>; }

    friend constexpr bool operator==(const Vec&, const Vec&) = default;
    friend constexpr auto operator<=>(const Vec&, const Vec&) = default; ///< the first axis decides first

    constexpr Vec& operator+=(const Vec& other) noexcept
    {
        for (int axis = 0; axis < Dim; ++axis)
            values[axis] += other.values[axis];
        return *this;
    }
    constexpr Vec& operator-=(const Vec& other) noexcept
    {
        for (int axis = 0; axis < Dim; ++axis)
            values[axis] -= other.values[axis];
        return *this;
    }
    constexpr Vec& operator*=(T factor) noexcept
    {
        for (T& value : values)
            value *= factor;
        return *this;
    }
    constexpr Vec& operator/=(T divisor) noexcept
    {
        for (T& value : values)
            value /= divisor;
        return *this;
    }
    friend constexpr Vec operator+(Vec a, const Vec& b) noexcept { return a += b; }
    friend constexpr Vec operator-(Vec a, const Vec& b) noexcept { return a -= b; }
    friend constexpr Vec operator-(const Vec& a) noexcept { return Vec{} - a; }
    friend constexpr Vec operator*(Vec a, T factor) noexcept { return a *= factor; }
    friend constexpr Vec operator*(T factor, Vec a) noexcept { return a *= factor; }
    friend constexpr Vec operator/(Vec a, T divisor) noexcept { return a /= divisor; }
};

using Vec2f = Vec<2, float>;
using Vec3f = Vec<3, float>;
using Vec2d = Vec<2, double>;
using Vec3d = Vec<3, double>;

template <int Dim, Coordinate T>
[[nodiscard]] constexpr T dot(const Vec<Dim, T>& a, const Vec<Dim, T>& b) noexcept
{
    T sum = 0;
    for (int axis = 0; axis < Dim; ++axis)
        sum += a[axis] * b[axis];
    return sum;
}

template <Coordinate T>
[[nodiscard]] constexpr Vec<3, T> cross(const Vec<3, T>& a, const Vec<3, T>& b) noexcept
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// In 2D, the z component of the product in 3D: positive if b is counterclockwise of a.
template <Coordinate T>
[[nodiscard]] constexpr T cross(const Vec<2, T>& a, const Vec<2, T>& b) noexcept
{
    return a[0] * b[1] - a[1] * b[0];
}

template <int Dim, Coordinate T>
[[nodiscard]] constexpr T length_squared(const Vec<Dim, T>& a) noexcept
{
    return dot(a, a);
}

/// The Euclidean length; infinite or zero if its square is beyond T's range.
template <int Dim, Coordinate T>
[[nodiscard]] T length(const Vec<Dim, T>& a) noexcept
{
    return std::sqrt(dot(a, a));
}

/// The vector of length 1 in the same direction; zero for zero. It works for all finite numbers, also those
/// whose squares are beyond T's range. NaN or infinity in `a` gives NaN.
template <int Dim, Coordinate T>
[[nodiscard]] Vec<Dim, T> normalized(const Vec<Dim, T>& a) noexcept
{
    T longest = 0;
    for (const T value : a.values)
        longest = std::abs(value) > longest ? std::abs(value) : longest;
    if (a == Vec<Dim, T>{}) return {};
    const Vec<Dim, T> scaled = a / longest;
    return scaled / length(scaled);
}

/// Axis by axis, the lower of the two numbers; a's if either is NaN.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr Vec<Dim, T> min(Vec<Dim, T> a, const Vec<Dim, T>& b) noexcept
{
    for (int axis = 0; axis < Dim; ++axis)
        a[axis] = b[axis] < a[axis] ? b[axis] : a[axis];
    return a;
}
/// Axis by axis, the higher of the two numbers; a's if either is NaN.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr Vec<Dim, T> max(Vec<Dim, T> a, const Vec<Dim, T>& b) noexcept
{
    for (int axis = 0; axis < Dim; ++axis)
        a[axis] = a[axis] < b[axis] ? b[axis] : a[axis];
    return a;
}

/// Interpolates from a to b: exactly a at t = 0 and b at t = 1; extrapolates beyond.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr Vec<Dim, T> lerp(const Vec<Dim, T>& a, const Vec<Dim, T>& b,
                                         std::type_identity_t<T> t) noexcept
{
    return a * (1 - t) + b * t;
}

JOSTLE_NAMESPACE_END
