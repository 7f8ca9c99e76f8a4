// SPDX-License-Identifier: MIT
// Source: Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates,
// Discrete & Computational Geometry 18(3), 1997. Here with two stages only: doubles, then exact.
#include "narrow/shapes/orientation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// A number as a sum of doubles with non-overlapping bits: small ones first, none of them 0.
template <int Room>
struct Sum
{
    double part[Room];
    int count = 0;

    void add(double x)
    {
        if (x != 0) part[count++] = x;
    }
    [[nodiscard]] int sign() const { return count == 0 ? 0 : part[count - 1] > 0 ? 1 : -1; }
    [[nodiscard]] double rounded() const
    {
        double sum = 0;
        for (int i = 0; i < count; ++i)
            sum += part[i];
        return sum;
    }
};

/// a + b is exactly the result plus `rest`. Source: Knuth, The Art of Computer Programming 2, 4.2.2.
double sum_of(double a, double b, double& rest)
{
    const double sum = a + b, of_b = sum - a;
    rest = (a - (sum - of_b)) + (b - of_b);
    return sum;
}

/// The same for a * b. Source: Dekker, Numerische Mathematik 18, 1971.
double product_of(double a, double b, double& rest)
{
    const auto split = [](double x, double& low) {
        const double big = 0x8000001p0 * x, high = big - (big - x);
        low = x - high;
        return high;
    };
    double low_a, low_b;
    const double high_a = split(a, low_a), high_b = split(b, low_b), product = a * b;
    rest = low_a * low_b - (((product - high_a * high_b) - low_a * high_b) - high_a * low_b);
    return product;
}

Sum<2> difference(double a, double b)
{
    Sum<2> result;
    double rest;
    const double high = sum_of(a, -b, rest);
    result.add(rest);
    result.add(high);
    return result;
}

template <int N, int M>
Sum<N + M> add(const Sum<N>& a, const Sum<M>& b, double sign)
{
    Sum<N + M> result;
    double sum = 0;
    int i = 0, k = 0;
    while (i < a.count || k < b.count) {
        const bool of_a = k == b.count || (i < a.count && std::abs(a.part[i]) < std::abs(b.part[k]));
        double rest;
        sum = sum_of(sum, of_a ? a.part[i++] : sign * b.part[k++], rest);
        result.add(rest);
    }
    result.add(sum);
    return result;
}
template <int N, int M>
Sum<N + M> operator+(const Sum<N>& a, const Sum<M>& b)
{
    return add(a, b, 1);
}
template <int N, int M>
Sum<N + M> operator-(const Sum<N>& a, const Sum<M>& b)
{
    return add(a, b, -1);
}

template <int N>
Sum<2 * N> operator*(const Sum<N>& a, double b)
{
    Sum<2 * N> result;
    double sum = 0;
    for (int i = 0; i < a.count; ++i) {
        double low, rest;
        const double high = product_of(a.part[i], b, low);
        const double carried = sum_of(sum, low, rest);
        result.add(rest);
        sum = sum_of(high, carried, rest);
        result.add(rest);
    }
    result.add(sum);
    return result;
}
template <int N>
Sum<4 * N> operator*(const Sum<N>& a, const Sum<2>& b)
{
    return a * (b.count > 0 ? b.part[0] : 0) + a * (b.count > 1 ? b.part[1] : 0);
}

struct Differences
{
    Sum<2> x, y, z;
    Differences(const Vec3& to, const Vec3& from)
        : x(difference(to.x, from.x)), y(difference(to.y, from.y)), z(difference(to.z, from.z))
    {
    }
};

int sign_of(double x)
{
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

} // namespace

int side_of_plane(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d)
{
    {
        const Vec3 u = b - a, v = c - a, w = d - a;
        const double yz = u.y * v.z, zy = u.z * v.y, zx = u.z * v.x, xz = u.x * v.z, xy = u.x * v.y,
                     yx = u.y * v.x;
        const double determinant = (yz - zy) * w.x + (zx - xz) * w.y + (xy - yx) * w.z;
        const double sizes = (std::abs(yz) + std::abs(zy)) * std::abs(w.x) +
                             (std::abs(zx) + std::abs(xz)) * std::abs(w.y) +
                             (std::abs(xy) + std::abs(yx)) * std::abs(w.z);
        if (std::abs(determinant) > determinant_rounding * sizes) return sign_of(determinant);
    }
    const Differences u(b, a), v(c, a), w(d, a);
    return ((u.y * v.z - u.z * v.y) * w.x + (u.z * v.x - u.x * v.z) * w.y + (u.x * v.y - u.y * v.x) * w.z)
        .sign();
}

int side_of_line(const Vec2& a, const Vec2& b, const Vec2& c)
{
    {
        const Vec2 u = b - a, v = c - a;
        const double left = u.x * v.y, right = u.y * v.x, determinant = left - right;
        if (std::abs(determinant) > determinant_rounding * (std::abs(left) + std::abs(right)))
            return sign_of(determinant);
    }
    const Sum<2> ux = difference(b.x, a.x), uy = difference(b.y, a.y), vx = difference(c.x, a.x),
                 vy = difference(c.y, a.y);
    return (ux * vy - uy * vx).sign();
}

Vec3 exact_cross(const Vec3& a, const Vec3& b, const Vec3& c)
{
    const Differences u(b, a), v(c, a);
    return {(u.y * v.z - u.z * v.y).rounded(), (u.z * v.x - u.x * v.z).rounded(),
            (u.x * v.y - u.y * v.x).rounded()};
}

} // namespace narrow
JOSTLE_NAMESPACE_END
