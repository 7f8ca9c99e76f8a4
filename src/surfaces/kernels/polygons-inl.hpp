// SPDX-License-Identifier: MIT
// A pair as a polygon (see surfaces/parts.hpp), of several pairs at once: a number here is one of each. In
// floats and in doubles. No include guard: kernels.cpp includes it once per set.

template <class T>
struct Point
{
    Vec<T> x, y, z;
};
template <class T>
HWY_ATTR HWY_INLINE Point<T> operator+(const Point<T>& a, const Point<T>& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
HWY_ATTR HWY_INLINE Point<T> operator-(const Point<T>& a, const Point<T>& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
HWY_ATTR HWY_INLINE Point<T> operator*(const Point<T>& a, Vec<T> b)
{
    return {a.x * b, a.y * b, a.z * b};
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> dot(const Point<T>& a, const Point<T>& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
HWY_ATTR HWY_INLINE Point<T> cross(const Point<T>& a, const Point<T>& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
HWY_ATTR HWY_INLINE Point<T> choose(Mask<T> mask, const Point<T>& yes, const Point<T>& no)
{
    return {choose(mask, yes.x, no.x), choose(mask, yes.y, no.y), choose(mask, yes.z, no.z)};
}
/// The greatest of its coordinates, without their signs.
template <class T>
HWY_ATTR HWY_INLINE Vec<T> greatest_of(const Point<T>& a)
{
    return max(abs(a.x), max(abs(a.y), abs(a.z)));
}

/// A triangle, or a parallelogram, whose corners go around it.
template <class T, int corners>
struct Polygon
{
    Point<T> corner[corners];

    [[nodiscard]] HWY_ATTR HWY_INLINE Point<T> side(int k) const
    {
        return corner[k + 1 == corners ? 0 : k + 1] - corner[k];
    }
    /// The sides that begin at the first corner, which span it.
    [[nodiscard]] HWY_ATTR HWY_INLINE Point<T> across() const { return corner[1] - corner[0]; }
    [[nodiscard]] HWY_ATTR HWY_INLINE Point<T> along() const { return corner[corners - 1] - corner[0]; }
};

/// Vectors whose squares are smaller have lost digits: such sides have no length, such directions tell
/// nothing.
template <class T>
constexpr T smallest_square = sizeof(T) == 4 ? static_cast<T>(1e-30) : static_cast<T>(1e-280);

/// The point of a polygon that is nearest to the origin.
template <class T>
struct Nearest
{
    Point<T> point;
    Vec<T> distance2;
    Vec<T> side;          ///< the number of that on which it lies, or -1 inside
    Vec<T> part;          ///< of that side: 0 or 1 at a corner
    Point<T> way;         ///< the side itself
    Vec<T> across, along; ///< inside: how much of the sides that span the polygon
};

/// Of polygons without area some number here is none, and compares false. `choose`, not min and max: zeros
/// have one sign on all instruction sets.
template <class T, int corners>
HWY_ATTR HWY_INLINE Nearest<T> nearest_of(const Polygon<T, corners>& polygon)
{
    using Number = Vec<T>;
    const Number zero = Number(0), one = Number(1);
    const Point<T> u = polygon.across(), v = polygon.along(), normal = cross(u, v), c = polygon.corner[0];
    const Number by_size = one / dot(normal, normal);
    const Number across = dot(cross(v, c), normal) * by_size, along = dot(cross(c, u), normal) * by_size;
    Mask<T> inside = (across > zero) & (along > zero);
    if constexpr (corners == 3)
        inside = inside & (across + along < one);
    else
        inside = inside & (across < one) & (along < one);
    const Point<T> in_face = c + u * across + v * along;
    Nearest<T> best{
        in_face,    choose(inside, dot(in_face, in_face), Number(std::numeric_limits<T>::infinity())),
        Number(-1), zero,
        u,          across,
        along};
    for (int k = 0; k < corners; ++k) {
        const Point<T> side = polygon.side(k);
        const Number size = dot(side, side), along_side = (zero - dot(polygon.corner[k], side)) / size;
        const Number part = choose((size > Number(smallest_square<T>)) & (along_side > zero),
                                   choose(along_side < one, along_side, one), zero);
        const Point<T> point = polygon.corner[k] + side * part;
        const Number distance2 = dot(point, point);
        const Mask<T> nearer = distance2 < best.distance2;
        best.point = choose(nearer, point, best.point);
        best.distance2 = choose(nearer, distance2, best.distance2);
        best.side = choose(nearer, Number(static_cast<T>(k)), best.side);
        best.part = choose(nearer, part, best.part);
        best.way = choose(nearer, side, best.way);
    }
    return best;
}

/// Along the polygon's normal, towards the polygon. Not of unit length.
template <class T, int corners>
HWY_ATTR HWY_INLINE Point<T> toward_face(const Polygon<T, corners>& polygon)
{
    const Point<T> normal = cross(polygon.across(), polygon.along());
    return choose(dot(normal, polygon.corner[0]) < Vec<T>(0), normal * Vec<T>(-1), normal);
}

/// A polygon whose corners move straight from one place to another.
template <class T, int corners>
struct Motion
{
    Polygon<T, corners> from, to;

    [[nodiscard]] HWY_ATTR HWY_INLINE Polygon<T, corners> at(Vec<T> time) const
    {
        Polygon<T, corners> polygon = from;
        for (int k = 0; k < corners; ++k)
            polygon.corner[k] = from.corner[k] * (Vec<T>(1) - time) + to.corner[k] * time;
        return polygon;
    }
    /// Until when, from `time` on, all corners are beyond `apart` along a direction of any length: at least.
    /// 2 if they are to the end; -1 if some corner may not be even now. Along a direction the corners move
    /// evenly, so that this is exact but for the rounding that `apart` allows for.
    [[nodiscard]] HWY_ATTR HWY_INLINE Vec<T> clear_until(const Point<T>& direction, Vec<T> time,
                                                         Vec<T> apart) const
    {
        const Vec<T> square = dot(direction, direction), bound = sqrt(square) * apart;
        const Vec<T> never = Vec<T>(-1), always = Vec<T>(2);
        Vec<T> until = always;
        for (int k = 0; k < corners; ++k) {
            const Vec<T> first = dot(direction, from.corner[k]), last = dot(direction, to.corner[k]);
            // A number where just one of them is beyond.
            const Vec<T> when = (first - bound) / (first - last);
            const Vec<T> leaves = choose(last > bound, always, when),
                         enters = choose(last > bound, choose(when <= time, always, never), never);
            until = min(until, choose(first > bound, leaves, enters));
        }
        return choose(square > Vec<T>(smallest_square<T>), until, never);
    }
};
