// SPDX-License-Identifier: MIT
// Vectors of the narrow phase. Everything inside the interface is double: a float pair is computed as exactly
// as a double one, and sizes from 1e-45 to 1e+38 neither overflow nor underflow.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "jostle/shapes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The limit of lengths and coordinates: their sixth powers occur, and must be finite.
inline constexpr double longest = 1e60;
/// Cores nearer than this fraction of their size touch.
inline constexpr double core_touch = 1e-9;

struct Vec3
{
    double x = 0, y = 0, z = 0;
    friend Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
    friend Vec3 operator*(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
    friend Vec3 operator*(double s, const Vec3& a) { return a * s; }
    Vec3& operator+=(const Vec3& b) { return *this = *this + b; }
    double& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
    double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};
inline double dot(const Vec3& a, const Vec3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(const Vec3& a, const Vec3& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length2(const Vec3& a)
{
    return dot(a, a);
}
inline double length(const Vec3& a)
{
    return std::sqrt(dot(a, a));
}
/// A unit vector at right angles to unit vector n. Source: Duff et al., Building an Orthonormal Basis,
/// Revisited, JCGT 6(1), 2017.
inline void basis(const Vec3& n, Vec3& u, Vec3& v)
{
    const double sign = std::copysign(1.0, n.z);
    const double a = -1.0 / (sign + n.z), b = n.x * n.y * a;
    u = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    v = {b, sign + n.y * n.y * a, -n.y};
}

/// A rotation: columns are the images of the axes.
struct Mat3
{
    Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    friend Vec3 operator*(const Mat3& m, const Vec3& v) { return m.x * v.x + m.y * v.y + m.z * v.z; }
    /// The inverse rotation.
    [[nodiscard]] Vec3 back(const Vec3& v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
    friend Mat3 operator*(const Mat3& m, const Mat3& n) { return {m * n.x, m * n.y, m * n.z}; }
};
/// Whether a sum of squares has all its digits.
inline bool squares_well(double sum)
{
    return sum > 1e-280 && sum < 1e280;
}
/// Before numbers are divided by the largest of them, `big`, they are multiplied by this, which loses no
/// digits: the inverse of a denormal may be infinite.
inline double lift(double big)
{
    return big < 0x1p-1000 ? 0x1p100 : 1;
}
/// From a quaternion of any length except 0, divided by its largest number first, so that the squares stay in
/// range.
inline Mat3 rotation(double qx, double qy, double qz, double qw)
{
    const double big = std::max(std::max(std::abs(qx), std::abs(qy)), std::max(std::abs(qz), std::abs(qw)));
    if (!(big > 0.25 && big < 4)) {
        const double up = lift(big), scale = 1 / (big * up);
        qx *= up, qy *= up, qz *= up, qw *= up;
        qx *= scale, qy *= scale, qz *= scale, qw *= scale;
    }
    const double s = 2 / (qx * qx + qy * qy + qz * qz + qw * qw);
    const double xs = qx * s, ys = qy * s, zs = qz * s;
    const double wx = qw * xs, wy = qw * ys, wz = qw * zs;
    const double xx = qx * xs, xy = qx * ys, xz = qx * zs;
    const double yy = qy * ys, yz = qy * zs, zz = qz * zs;
    return {{1 - (yy + zz), xy + wz, xz - wy},
            {xy - wz, 1 - (xx + zz), yz + wx},
            {xz + wy, yz - wx, 1 - (xx + yy)}};
}

struct Vec2
{
    double x = 0, y = 0;
    friend Vec2 operator+(const Vec2& a, const Vec2& b) { return {a.x + b.x, a.y + b.y}; }
    friend Vec2 operator-(const Vec2& a, const Vec2& b) { return {a.x - b.x, a.y - b.y}; }
    friend Vec2 operator-(const Vec2& a) { return {-a.x, -a.y}; }
    friend Vec2 operator*(const Vec2& a, double s) { return {a.x * s, a.y * s}; }
    friend Vec2 operator*(double s, const Vec2& a) { return a * s; }
    Vec2& operator+=(const Vec2& b) { return *this = *this + b; }
    double& operator[](int i) { return i == 0 ? x : y; }
    double operator[](int i) const { return i == 0 ? x : y; }
};
inline double dot(const Vec2& a, const Vec2& b)
{
    return a.x * b.x + a.y * b.y;
}
inline double cross(const Vec2& a, const Vec2& b)
{
    return a.x * b.y - a.y * b.x;
}
inline double length2(const Vec2& a)
{
    return dot(a, a);
}
inline double length(const Vec2& a)
{
    return std::sqrt(dot(a, a));
}
/// Turned by 90 degrees clockwise: outwards from an edge of a counterclockwise polygon.
inline Vec2 right(const Vec2& a)
{
    return {a.y, -a.x};
}
/// Counterclockwise.
inline Vec2 left(const Vec2& a)
{
    return {-a.y, a.x};
}
/// Any length except 0: squares of the shortest are 0.
inline Vec2 unit(const Vec2& a)
{
    const double scale = std::max(std::abs(a.x), std::abs(a.y));
    const Vec2 scaled{a.x / scale, a.y / scale};
    return scaled * (1 / length(scaled));
}

struct Mat2
{
    double c = 1, s = 0;
    friend Vec2 operator*(const Mat2& m, const Vec2& v)
    {
        return {m.c * v.x - m.s * v.y, m.s * v.x + m.c * v.y};
    }
    [[nodiscard]] Vec2 back(const Vec2& v) const { return {c * v.x + s * v.y, c * v.y - s * v.x}; }
    friend Mat2 operator*(const Mat2& m, const Mat2& n)
    {
        return {m.c * n.c - m.s * n.s, m.s * n.c + m.c * n.s};
    }
};
inline Mat2 rotation(double c, double s)
{
    const double big = std::max(std::abs(c), std::abs(s)), up = lift(big), scale = 1 / (big * up);
    c *= up, s *= up;
    c *= scale, s *= scale;
    const double inverse = 1 / std::sqrt(c * c + s * s);
    return {c * inverse, s * inverse};
}

template <int Dim>
struct SpaceOf;
template <>
struct SpaceOf<3>
{
    using V = Vec3;
    using M = Mat3;
};
template <>
struct SpaceOf<2>
{
    using V = Vec2;
    using M = Mat2;
};
template <int Dim>
using V = typename SpaceOf<Dim>::V;
template <int Dim>
using M = typename SpaceOf<Dim>::M;

template <class T>
Vec3 load(const Vec<3, T>& v)
{
    return {double{v[0]}, double{v[1]}, double{v[2]}};
}
template <class T>
Vec2 load(const Vec<2, T>& v)
{
    return {double{v[0]}, double{v[1]}};
}
template <class T>
void store(const Vec3& v, Vec<3, T>& to)
{
    to = {static_cast<T>(v.x), static_cast<T>(v.y), static_cast<T>(v.z)};
}
template <class T>
void store(const Vec2& v, Vec<2, T>& to)
{
    to = {static_cast<T>(v.x), static_cast<T>(v.y)};
}
template <class T>
Mat3 rotation(const Pose<3, T>& pose)
{
    return rotation(double{pose.rotation[0]}, double{pose.rotation[1]}, double{pose.rotation[2]},
                    double{pose.rotation[3]});
}
template <class T>
Mat2 rotation(const Pose<2, T>& pose)
{
    return rotation(double{pose.rotation[0]}, double{pose.rotation[1]});
}

/// Whether a point of a contact counts, and its depth. Shapes that touch are at least as deep as -margin;
/// points that round to just below belong to them, otherwise a flat body would lose some of its corners.
/// `size` is that of both.
inline bool keeps(double& depth, double margin, double size)
{
    if (!(depth >= -margin - 1e-14 * size)) return false;
    depth = std::max(depth, -margin);
    return true;
}

/// Back to the numbers of a pose. Source: Shepperd, J. Guidance and Control 1(3), 1978.
inline void unload(const Mat3& m, std::array<double, 4>& q)
{
    const double xx = m.x.x, yy = m.y.y, zz = m.z.z, trace = xx + yy + zz;
    if (trace >= std::max(xx, std::max(yy, zz)))
        q = {m.y.z - m.z.y, m.z.x - m.x.z, m.x.y - m.y.x, 1 + trace};
    else if (xx >= yy && xx >= zz)
        q = {1 + xx - yy - zz, m.x.y + m.y.x, m.z.x + m.x.z, m.y.z - m.z.y};
    else if (yy >= zz)
        q = {m.x.y + m.y.x, 1 + yy - xx - zz, m.y.z + m.z.y, m.z.x - m.x.z};
    else
        q = {m.z.x + m.x.z, m.y.z + m.z.y, 1 + zz - xx - yy, m.x.y - m.y.x};
    const double scale = 1 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& x : q)
        x *= scale;
}
inline void unload(const Mat2& m, std::array<double, 2>& r)
{
    r = {m.c, m.s};
}

/// The place of an object's local frame, relative to the first object of a pair.
template <int Dim>
struct Frame
{
    M<Dim> r;
    V<Dim> p;
};
template <int Dim>
V<Dim> operator*(const Frame<Dim>& frame, const V<Dim>& v)
{
    return frame.r * v + frame.p;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
