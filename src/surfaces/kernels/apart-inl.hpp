// SPDX-License-Identifier: MIT
// Which pairs are certainly apart: if all corners of a pair's polygon are beyond `reach` along some
// direction, so is the polygon, and if that is so at both ends of a step, it is so all the time, since
// corners move straight. The direction tried is that of the point that is nearest to the origin, as far as
// floats can tell; a worse one only tells fewer pairs apart. No include guard: kernels.cpp includes it once
// per set.

using Float = Vec<float>;

template <int corners>
struct Given
{
    Polygon<float, corners> polygon;
    Float greatest; ///< no number given has a greater one
};

template <int corners>
HWY_ATTR HWY_INLINE Given<corners> load_legs(const Row (&rows)[3][PartBatch::size], std::uint32_t k)
{
    Point<float> leg[3];
    Float greatest = Float(0);
    for (int i = 0; i < 3; ++i) {
        load_rows(rows[i] + k, leg[i].x, leg[i].y, leg[i].z);
        greatest = max(greatest, greatest_of(leg[i]));
    }
    if constexpr (corners == 3)
        return {{{leg[0], leg[1], leg[2]}}, greatest};
    else // for edges p q and r s the corners are r - p, r - q, s - q, s - p
        return {{{leg[1], leg[1] - leg[0], leg[2] - leg[0], leg[2]}}, greatest};
}

/// What rounding can change a length by, as a part of the greatest number: 40 roundings of 2^-24, of the
/// differences, the corners, their products and the times, and a half more to spare. Where numbers are so
/// large or so small that products leave a float's range, nothing is said.
constexpr float float_rounding = 0x1p-18f, largest = 1e15f, smallest = 1e-14f;

HWY_ATTR HWY_INLINE Mask<float> in_range(Float greatest)
{
    return (greatest < Float(largest)) & (greatest > Float(smallest));
}

/// Where all corners are beyond `apart` along a direction of any length.
template <int corners>
HWY_ATTR HWY_INLINE Mask<float> beyond(const Polygon<float, corners>& polygon, const Point<float>& direction,
                                       Float apart)
{
    const Float square = dot(direction, direction), bound = sqrt(square) * apart;
    Mask<float> all = square > Float(smallest_square<float>);
    for (const Point<float>& corner : polygon.corner)
        all = all & (dot(direction, corner) > bound);
    return all;
}

/// The nearest number from 0 to 1; 0 for a NaN.
HWY_ATTR HWY_INLINE Float clamped(Float x)
{
    return choose(x > Float(0), choose(x < Float(1), x, Float(1)), Float(0));
}
/// The polygon's point that is nearest to the origin, but for rounding. Of a parallelogram one side's part
/// after the other (Ericson, Real-Time Collision Detection, 2005, sec. 5.1.9): fewer instructions than
/// nearest_of(), which also tells where the point lies.
HWY_ATTR HWY_INLINE Point<float> nearest_point(const Polygon<float, 3>& polygon)
{
    return nearest_of(polygon).point;
}
HWY_ATTR HWY_INLINE Point<float> nearest_point(const Polygon<float, 4>& polygon)
{
    const Float zero = Float(0);
    const Point<float> u = polygon.across(), v = polygon.along(), c = polygon.corner[0];
    const Float uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uc = dot(u, c), vc = dot(v, c);
    Float across = clamped((uv * vc - vv * uc) / (uu * vv - uv * uv));
    const Float along = clamped((zero - vc - uv * across) / vv);
    across = clamped((zero - uc - uv * along) / uu);
    return c + u * across + v * along;
}

/// Of a shaken cloth's pairs (decision 71) one step tells 86 in 100, two tell 93, eight 94.
constexpr int steps = 3;

template <int corners>
HWY_ATTR HWY_INLINE Mask<float> stay_apart(const Motion<float, corners>& motion, Float apart)
{
    const Float one = Float(1);
    Float time = Float(0);
    for (int step = 0; step < steps; ++step) {
        // From the middle of what is left, parts turn half as far as from its beginning.
        const Polygon<float, corners> middle = motion.at(min((time + one) * Float(0.5f), one));
        const Float before = time;
        for (const Point<float>& direction : {nearest_point(middle), toward_face(middle)})
            time = max(time, motion.clear_until(direction, before, apart));
        if (!any((time > before) & (time <= one))) break;
    }
    return time > one;
}

template <int corners, bool moves>
HWY_ATTR std::uint64_t apart(const PartBatch& pairs, std::uint32_t count)
{
    std::uint64_t bits = 0;
    for (std::uint32_t k = 0; k < count; k += Float::size) {
        const Given<corners> from = load_legs<corners>(pairs.from, k);
        const Float reach = Float::load(pairs.reach + k);
        if constexpr (moves) {
            const Given<corners> to = load_legs<corners>(pairs.to, k);
            const Float greatest = max(from.greatest, to.greatest);
            const Float spare = (greatest + reach) * Float(float_rounding);
            const Mask<float> apart =
                in_range(greatest) &
                stay_apart(Motion<float, corners>{from.polygon, to.polygon}, reach + spare);
            bits |= std::uint64_t{mask_bits(apart)} << k;
        } else {
            const Float spare = (from.greatest + reach) * Float(float_rounding);
            const Mask<float> apart =
                in_range(from.greatest) & beyond(from.polygon, nearest_point(from.polygon), reach + spare);
            bits |= std::uint64_t{mask_bits(apart)} << k;
        }
    }
    return bits;
}
