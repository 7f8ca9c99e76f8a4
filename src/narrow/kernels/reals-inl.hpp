// SPDX-License-Identifier: MIT
// 3D vectors of several pairs or points at once: a Real has a number of each. Compiled once per instruction
// set: kernels.cpp includes this file inside a namespace that has the functions of simd/vec-inl.hpp.
// Intentionally without an include guard.

using Real = Vec<double>;
using RealMask = Mask<double>;

struct Real3
{
    Real x, y, z;
};
struct RealMat
{
    Real3 x, y, z;
};

HWY_ATTR inline Real dot3(const Real3& a, const Real3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
HWY_ATTR inline Real3 add3(const Real3& a, const Real3& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
HWY_ATTR inline Real3 scale3(const Real3& a, const Real& s)
{
    return {a.x * s, a.y * s, a.z * s};
}
HWY_ATTR inline Real3 subtract3(const Real3& a, const Real3& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
HWY_ATTR inline Real3 choose3(const RealMask& mask, const Real3& yes, const Real3& no)
{
    return {choose(mask, yes.x, no.x), choose(mask, yes.y, no.y), choose(mask, yes.z, no.z)};
}
HWY_ATTR inline Real3 cross3(const Real3& a, const Real3& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// The greater of two numbers; a if they are equal. A maximum instruction may choose either of 0 and -0, and
/// results must have the same bits with every instruction set.
HWY_ATTR inline Real greater_of(const Real& a, const Real& b)
{
    return choose(a < b, b, a);
}
HWY_ATTR inline Real clamped(const Real& x, const Real& half)
{
    const Real up = choose(half < x, half, x);
    const Real low = Real(0) - half;
    return choose(up < low, low, up);
}

/// The rotation matrices of quaternions. The operations are those of `rotation` in math.hpp in their order,
/// so that the bits are the same.
HWY_ATTR HWY_INLINE RealMat matrix(const Real& qx, const Real& qy, const Real& qz, const Real& qw)
{
    const Real one = Real(1);
    const Real s = Real(2) / (qx * qx + qy * qy + qz * qz + qw * qw);
    const Real xs = qx * s, ys = qy * s, zs = qz * s;
    const Real wx = qw * xs, wy = qw * ys, wz = qw * zs;
    const Real xx = qx * xs, xy = qx * ys, xz = qx * zs;
    const Real yy = qy * ys, yz = qy * zs, zz = qz * zs;
    return {{one - (yy + zz), xy + wz, xz - wy},
            {xy - wz, one - (xx + zz), yz + wx},
            {xz + wy, yz - wx, one - (xx + yy)}};
}

/// Of the quaternions in columns k, k + 1, ...
HWY_ATTR inline RealMat matrix(const double (&q)[4][batch], std::uint32_t k)
{
    return matrix(Real::loadu(q[0] + k), Real::loadu(q[1] + k), Real::loadu(q[2] + k), Real::loadu(q[3] + k));
}

HWY_ATTR inline Real3 turn3(const RealMat& m, const Real3& v)
{
    return add3(add3(scale3(m.x, v.x), scale3(m.y, v.y)), scale3(m.z, v.z));
}

HWY_ATTR inline Real3 load3(const double (&columns)[3][batch], std::uint32_t k)
{
    return {Real::loadu(columns[0] + k), Real::loadu(columns[1] + k), Real::loadu(columns[2] + k)};
}
HWY_ATTR inline void put(const Real3& v, double (*columns)[batch], std::uint32_t k)
{
    v.x.storeu(columns[0] + k);
    v.y.storeu(columns[1] + k);
    v.z.storeu(columns[2] + k);
}
HWY_ATTR inline void put(const RealMat& m, double (*columns)[batch], std::uint32_t k)
{
    put(m.x, columns, k);
    put(m.y, columns + 3, k);
    put(m.z, columns + 6, k);
}
