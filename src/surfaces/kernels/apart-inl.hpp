// SPDX-License-Identifier: MIT
// Which pairs are certainly apart. A pair is a flat polygon, as in surfaces/parts.cpp: if all its corners are
// beyond `reach` along some direction, so is the polygon, and if that is so at both ends of a step, it is so
// all the time, since corners move straight. The direction tried is that of the point that is nearest to the
// origin, as far as floats can tell; a worse one only tells fewer pairs apart. No include guard: kernels.cpp
// includes it once per set.

using Real = Vec<float>;
struct Real3
{
    Real x, y, z;
};
HWY_ATTR HWY_INLINE Real3 operator+(const Real3& a, const Real3& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
HWY_ATTR HWY_INLINE Real3 operator-(const Real3& a, const Real3& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
HWY_ATTR HWY_INLINE Real3 operator*(const Real3& a, Real b)
{
    return {a.x * b, a.y * b, a.z * b};
}
HWY_ATTR HWY_INLINE Real dot(const Real3& a, const Real3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
HWY_ATTR HWY_INLINE Real3 cross(const Real3& a, const Real3& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
HWY_ATTR HWY_INLINE Real3 choose(Mask<float> mask, const Real3& yes, const Real3& no)
{
    return {choose(mask, yes.x, no.x), choose(mask, yes.y, no.y), choose(mask, yes.z, no.z)};
}

template <int corners>
struct Corners
{
    Real3 at[corners];
    Real greatest; ///< no number given has a greater one
};

/// As polygon_of() in surfaces/parts.cpp has them.
template <int corners>
HWY_ATTR HWY_INLINE Corners<corners> load_corners(const float (&columns)[9][PartBatch::size], std::uint32_t k)
{
    Real3 leg[3];
    Real greatest = Real(0);
    for (int i = 0; i < 3; ++i) {
        leg[i] = {Real::load(columns[3 * i] + k), Real::load(columns[3 * i + 1] + k),
                  Real::load(columns[3 * i + 2] + k)};
        greatest = max(greatest, max(abs(leg[i].x), max(abs(leg[i].y), abs(leg[i].z))));
    }
    if constexpr (corners == 3)
        return {{leg[0], leg[1], leg[2]}, greatest};
    else
        return {{leg[1], leg[1] - leg[0], leg[2] - leg[0], leg[2]}, greatest};
}

/// A point of the polygon, about the one that is nearest to the origin.
template <int corners>
HWY_ATTR HWY_INLINE Real3 nearest_of(const Real3 (&corner)[corners])
{
    const Real zero = Real(0), one = Real(1);
    const Real3 u = corner[1] - corner[0], v = corner[corners - 1] - corner[0], normal = cross(u, v);
    // Of polygons without area no number here is one, and compares false.
    const Real by_size = one / dot(normal, normal);
    const Real across = dot(cross(v, corner[0]), normal) * by_size,
               along = dot(cross(corner[0], u), normal) * by_size;
    Mask<float> inside = (across > zero) & (along > zero);
    if constexpr (corners == 3)
        inside = inside & (across + along < one);
    else
        inside = inside & (across < one) & (along < one);
    Real3 best = choose(inside, corner[0] + u * across + v * along, corner[0]);
    Real best2 = dot(best, best);
    for (int k = 0; k < corners; ++k) {
        const Real3 side = corner[k + 1 == corners ? 0 : k + 1] - corner[k];
        const Real size = dot(side, side);
        const Real part = min(max((zero - dot(corner[k], side)) / size, zero), one);
        const Real3 point = corner[k] + side * choose(size > zero, part, zero);
        const Real point2 = dot(point, point);
        const Mask<float> nearer = point2 < best2;
        best = choose(nearer, point, best);
        best2 = choose(nearer, point2, best2);
    }
    return best;
}

/// Along the normal, towards the polygon.
template <int corners>
HWY_ATTR HWY_INLINE Real3 toward_face(const Real3 (&corner)[corners])
{
    const Real3 normal = cross(corner[1] - corner[0], corner[corners - 1] - corner[0]);
    return choose(dot(normal, corner[0]) < Real(0), normal * Real(-1), normal);
}

/// What rounding can change a length by, as a part of the greatest number: 40 roundings of 2^-24, of the
/// differences, the corners, their products and the times, and a half more to spare. Where numbers are so
/// large or so small that products leave a float's range, nothing is said.
constexpr float float_rounding = 0x1p-18f, largest = 1e15f, smallest = 1e-14f, smallest_square = 1e-30f;

HWY_ATTR HWY_INLINE Mask<float> in_range(Real greatest)
{
    return (greatest < Real(largest)) & (greatest > Real(smallest));
}

/// Where all corners are beyond `apart` along a direction of any length.
template <int corners>
HWY_ATTR HWY_INLINE Mask<float> beyond(const Real3 (&corner)[corners], const Real3& direction, Real apart)
{
    const Real square = dot(direction, direction), bound = sqrt(square) * apart;
    Mask<float> all = square > Real(smallest_square);
    for (const Real3& each : corner)
        all = all & (dot(direction, each) > bound);
    return all;
}

/// Until when, from `time` on, they stay so while they move: at least, see MovingPolygon::clear_until(). 2 if
/// they do to the end, -1 if some may not be even now.
template <int corners>
HWY_ATTR HWY_INLINE Real clear_until(const Real3 (&from)[corners], const Real3 (&to)[corners],
                                     const Real3& direction, Real time, Real apart)
{
    const Real square = dot(direction, direction), bound = sqrt(square) * apart;
    const Real never = Real(-1), always = Real(2);
    Real until = always;
    for (int k = 0; k < corners; ++k) {
        const Real first = dot(direction, from[k]), last = dot(direction, to[k]);
        const Real when = (first - bound) / (first - last); // a number where just one of them is beyond
        const Real leaves = choose(last > bound, always, when),
                   enters = choose(last > bound, choose(when <= time, always, never), never);
        until = min(until, choose(first > bound, leaves, enters));
    }
    return choose(square > Real(smallest_square), until, never);
}

/// Of a shaken cloth's pairs (decision 71) one step tells 70 in 100, two tell 92, four 96, eight 96.
constexpr int steps = 4;

template <int corners>
HWY_ATTR HWY_INLINE Mask<float> stay_apart(const Real3 (&from)[corners], const Real3 (&to)[corners],
                                           Real apart)
{
    const Real one = Real(1);
    Real time = Real(0);
    for (int step = 0; step < steps; ++step) {
        Real3 now[corners];
        for (int k = 0; k < corners; ++k)
            now[k] = from[k] * (one - min(time, one)) + to[k] * min(time, one);
        const Real before = time;
        for (const Real3& direction : {nearest_of(now), toward_face(now)})
            time = max(time, clear_until(from, to, direction, before, apart));
        if (!any((time > before) & (time <= one))) break;
    }
    return time > one;
}

template <int corners, bool moves>
HWY_ATTR std::uint64_t apart(const PartBatch& pairs, std::uint32_t count)
{
    std::uint64_t bits = 0;
    for (std::uint32_t k = 0; k < count; k += Real::size) {
        const Corners<corners> from = load_corners<corners>(pairs.from, k);
        const Real reach = Real::load(pairs.reach + k);
        if constexpr (moves) {
            const Corners<corners> to = load_corners<corners>(pairs.to, k);
            const Real greatest = max(from.greatest, to.greatest);
            const Real spare = (greatest + reach) * Real(float_rounding);
            const Mask<float> apart = in_range(greatest) & stay_apart(from.at, to.at, reach + spare);
            bits |= std::uint64_t{mask_bits(apart)} << k;
        } else {
            const Real spare = (from.greatest + reach) * Real(float_rounding);
            const Mask<float> apart =
                in_range(from.greatest) & beyond(from.at, nearest_of(from.at), reach + spare);
            bits |= std::uint64_t{mask_bits(apart)} << k;
        }
    }
    return bits;
}
