// SPDX-License-Identifier: MIT
// Written once, compiled once per instruction set: kernels.cpp includes this file inside a namespace that has
// `Real` (one number per pair) and what can be done with it. No include guard, on purpose. No templates: what
// is instantiated later would be compiled for another instruction set.

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
/// a where it is the greater, also where they are equal; so that zeros keep their signs everywhere.
HWY_ATTR inline Real greater_of(const Real& a, const Real& b)
{
    return choose(is_less(a, b), b, a);
}
HWY_ATTR inline Real clamped(const Real& x, const Real& half)
{
    const Real up = choose(is_less(half, x), half, x);
    const Real low = real(0) - half;
    return choose(is_less(up, low), low, up);
}

/// As `rotation` in math.hpp, step by step.
HWY_ATTR inline RealMat matrix(const double (&q)[4][batch], std::uint32_t k)
{
    const Real qx = from(q[0] + k), qy = from(q[1] + k), qz = from(q[2] + k), qw = from(q[3] + k);
    const Real one = real(1);
    const Real s = real(2) / (qx * qx + qy * qy + qz * qz + qw * qw);
    const Real xs = qx * s, ys = qy * s, zs = qz * s;
    const Real wx = qw * xs, wy = qw * ys, wz = qw * zs;
    const Real xx = qx * xs, xy = qx * ys, xz = qx * zs;
    const Real yy = qy * ys, yz = qy * zs, zz = qz * zs;
    return {{one - (yy + zz), xy + wz, xz - wy},
            {xy - wz, one - (xx + zz), yz + wx},
            {xz + wy, yz - wx, one - (xx + yy)}};
}

struct RealAxis
{
    Real separation, axis, sign;
    Real3 normal; ///< not yet turned from a to b
};

/// Takes an axis if it separates by more than the best one so far and `by`.
HWY_ATTR inline void take_axis(RealAxis& best, const Real& by, const Real& separation, double axis,
                               const Real& sign, const Real3& normal)
{
    const RealMask better = is_less(best.separation + by, separation);
    best.separation = choose(better, separation, best.separation);
    best.axis = choose(better, real(axis), best.axis);
    best.sign = choose(better, sign, best.sign);
    best.normal.x = choose(better, normal.x, best.normal.x);
    best.normal.y = choose(better, normal.y, best.normal.y);
    best.normal.z = choose(better, normal.z, best.normal.z);
}

/// The 15 axes of two boxes. Source: Gottschalk, Lin, Manocha, OBBTree, SIGGRAPH 1996; Ericson sec. 4.4.1.
HWY_ATTR inline RealAxis best_box_axis(const RealMat& a, const Real3& half_a, const RealMat& b,
                                       const Real3& half_b, const Real3& d)
{
    const Real3 axis_a[3] = {a.x, a.y, a.z}, axis_b[3] = {b.x, b.y, b.z};
    const Real ha[3] = {half_a.x, half_a.y, half_a.z}, hb[3] = {half_b.x, half_b.y, half_b.z};
    Real c[3][3], ac[3][3], ta[3], tb[3];
    for (int i = 0; i < 3; ++i) {
        ta[i] = dot3(axis_a[i], d);
        tb[i] = dot3(axis_b[i], d);
        for (int j = 0; j < 3; ++j) {
            c[i][j] = dot3(axis_a[i], axis_b[j]);
            ac[i][j] = size_of(c[i][j]);
        }
    }
    const Real zero = real(0);
    RealAxis best{real(-HUGE_VAL), zero, zero, {zero, zero, zero}};
    for (int i = 0; i < 3; ++i) {
        const Real reach = ha[i] + hb[0] * ac[i][0] + hb[1] * ac[i][1] + hb[2] * ac[i][2];
        take_axis(best, zero, size_of(ta[i]) - reach, i, ta[i], axis_a[i]);
    }
    for (int j = 0; j < 3; ++j) {
        const Real reach = hb[j] + ha[0] * ac[0][j] + ha[1] * ac[1][j] + ha[2] * ac[2][j];
        take_axis(best, zero, size_of(tb[j]) - reach, 3 + j, tb[j], axis_b[j]);
    }
    // Edges have to be better by more than rounding, or parallel faces would meet along noise.
    const Real by = real(1e-10) * (ha[0] + ha[1] + ha[2] + hb[0] + hb[1] + hb[2]);
    for (int i = 0; i < 3; ++i) {
        const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int j = 0; j < 3; ++j) {
            const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            // The axis is a_i x b_j; in a's frame it has the components 0, -c[i2][j], c[i1][j] from i on.
            const Real p = zero - c[i2][j], q = c[i1][j];
            const Real square = p * p + q * q;
            const Real inverse = real(1) / root(square);
            const Real t = ta[i1] * p + ta[i2] * q;
            const Real reach =
                ha[i1] * ac[i2][j] + ha[i2] * ac[i1][j] + hb[j1] * ac[i][j2] + hb[j2] * ac[i][j1];
            // Parallel within 1e-7: a face's normal or another edge says it better.
            const Real separation =
                choose(is_less(real(1e-14), square), (size_of(t) - reach) * inverse, real(-HUGE_VAL));
            const Real3 normal = scale3(add3(scale3(axis_a[i1], p), scale3(axis_a[i2], q)), inverse);
            take_axis(best, by, separation, 6 + 3 * i + j, t, normal);
        }
    }
    const RealMask back = is_less(best.sign, zero);
    best.normal.x = choose(back, zero - best.normal.x, best.normal.x);
    best.normal.y = choose(back, zero - best.normal.y, best.normal.y);
    best.normal.z = choose(back, zero - best.normal.z, best.normal.z);
    return best;
}

HWY_ATTR inline void put(const Real3& v, double (*columns)[batch], std::uint32_t k)
{
    to(v.x, columns[0] + k);
    to(v.y, columns[1] + k);
    to(v.z, columns[2] + k);
}
HWY_ATTR inline void put(const RealMat& m, double (*columns)[batch], std::uint32_t k)
{
    put(m.x, columns, k);
    put(m.y, columns + 3, k);
    put(m.z, columns + 6, k);
}

HWY_ATTR inline void boxes(BoxBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += reals) {
        const RealMat a = matrix(pairs.turn_a, k), b = matrix(pairs.turn_b, k);
        const Real3 half_a{from(pairs.half_a[0] + k), from(pairs.half_a[1] + k), from(pairs.half_a[2] + k)};
        const Real3 half_b{from(pairs.half_b[0] + k), from(pairs.half_b[1] + k), from(pairs.half_b[2] + k)};
        const Real3 d{from(pairs.d[0] + k), from(pairs.d[1] + k), from(pairs.d[2] + k)};
        const RealAxis best = best_box_axis(a, half_a, b, half_b, d);
        to(best.separation, pairs.separation + k);
        to(best.axis, pairs.axis + k);
        put(best.normal, pairs.normal, k);
        put(a, pairs.matrix_a, k);
        put(b, pairs.matrix_b, k);
    }
}

struct RealGap
{
    Real distance;
    Real3 normal, on_a, on_b;
};

/// A segment and a box. The square of the distance from a point of the segment to the box is convex along it,
/// its derivative piecewise linear with corners where the segment crosses the planes of the box's faces: the
/// corners around the zero are looked up, the zero between them is exact.
HWY_ATTR inline RealGap segment_box(const Real3& axis, const Real& half_length, const RealMat& b,
                                    const Real3& half, const Real3& d)
{
    const Real zero = real(0), one = real(1);
    const Real box_axis_d[3] = {dot3(b.x, d), dot3(b.y, d), dot3(b.z, d)};
    const Real along[3] = {dot3(b.x, axis), dot3(b.y, axis), dot3(b.z, axis)};
    const Real h[3] = {half.x, half.y, half.z};
    Real c[3], e[3]; // the segment in the box's frame: c + t e, t from -1 to 1
    for (int i = 0; i < 3; ++i) {
        c[i] = zero - box_axis_d[i];
        e[i] = along[i] * half_length;
    }
    const auto slope = [&](const Real& t) HWY_ATTR {
        Real sum = zero;
        for (int i = 0; i < 3; ++i) {
            const Real x = c[i] + t * e[i];
            sum = sum + e[i] * (x - clamped(x, h[i]));
        }
        return sum;
    };
    Real low = real(-1), high = one;
    Real slope_low = slope(low), slope_high = slope(high);
    // Where it already rises at the start, or still falls at the end, that is the nearest.
    const RealMask at_start = is_less(zero, slope_low), at_end = is_less(slope_high, zero);
    for (int i = 0; i < 3; ++i)
        for (int side = 0; side < 2; ++side) {
            const Real t = ((side == 0 ? zero - h[i] : h[i]) - c[i]) / e[i];
            // What lies outside, or is infinite or 0/0 for a segment along the face, is left out.
            const RealMask inside = both(is_less(real(-1), t), is_less(t, one));
            const Real here = slope(choose(inside, t, zero));
            const RealMask up_low = both(inside, both(not_less(zero, here), is_less(low, t)));
            const RealMask down_high = both(inside, both(not_less(here, zero), is_less(t, high)));
            low = choose(up_low, t, low);
            slope_low = choose(up_low, here, slope_low);
            high = choose(down_high, t, high);
            slope_high = choose(down_high, here, slope_high);
        }
    const Real rise = slope_high - slope_low;
    const Real between = low - slope_low * ((high - low) / choose(is_less(zero, rise), rise, one));
    // Level all the way: the middle, so that a capsule side by side with a face is met in its middle.
    Real t = choose(is_less(zero, rise), between, (low + high) * real(0.5));
    t = choose(at_start, real(-1), choose(at_end, one, t));
    t = clamped(t, one);

    Real p[3], q[3], gap[3];
    for (int i = 0; i < 3; ++i) {
        p[i] = c[i] + t * e[i];
        q[i] = clamped(p[i], h[i]);
        gap[i] = q[i] - p[i];
    }
    const Real distance = root(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2]);
    const Real reach = half_length + h[0] + h[1] + h[2];
    const RealMask apart = is_less(real(1e-9) * reach, distance);
    const Real inverse = one / choose(apart, distance, one);

    // Overlap: the axis of least.
    RealAxis best{real(-HUGE_VAL), zero, zero, {zero, zero, zero}};
    const Real3 axis_b[3] = {b.x, b.y, b.z};
    for (int i = 0; i < 3; ++i)
        take_axis(best, zero, size_of(c[i]) - (h[i] + size_of(e[i])), i, zero - c[i], axis_b[i]);
    const Real by = real(1e-10) * reach;
    for (int j = 0; j < 3; ++j) {
        const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        // along x axis j has the components 0, along[j2], -along[j1] from j on.
        const Real u = along[j2], v = zero - along[j1];
        const Real square = u * u + v * v;
        const Real turn_inverse = one / root(square);
        const Real across = c[j1] * u + c[j2] * v;
        const Real separation = choose(
            is_less(real(1e-14), square),
            (size_of(across) - (h[j1] * size_of(u) + h[j2] * size_of(v))) * turn_inverse, real(-HUGE_VAL));
        const Real3 normal = scale3(add3(scale3(axis_b[j1], u), scale3(axis_b[j2], v)), turn_inverse);
        take_axis(best, by, separation, 3 + j, zero - across, normal);
    }
    const RealMask back = is_less(best.sign, zero);

    RealGap result;
    const Real3 straight = add3(add3(scale3(b.x, gap[0] * inverse), scale3(b.y, gap[1] * inverse)),
                                scale3(b.z, gap[2] * inverse));
    result.normal.x = choose(apart, straight.x, choose(back, zero - best.normal.x, best.normal.x));
    result.normal.y = choose(apart, straight.y, choose(back, zero - best.normal.y, best.normal.y));
    result.normal.z = choose(apart, straight.z, choose(back, zero - best.normal.z, best.normal.z));
    const Real overlap = choose(is_less(best.separation, zero), best.separation, zero);
    result.distance = choose(apart, distance, overlap);
    result.on_a = scale3(axis, t * half_length);
    result.on_b = add3(d, add3(add3(scale3(b.x, q[0]), scale3(b.y, q[1])), scale3(b.z, q[2])));
    return result;
}

HWY_ATTR inline void capsule_box(CapsuleBoxBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += reals) {
        const RealMat a = matrix(pairs.turn_a, k), b = matrix(pairs.turn_b, k);
        const Real3 half{from(pairs.half[0] + k), from(pairs.half[1] + k), from(pairs.half[2] + k)};
        const Real3 d{from(pairs.d[0] + k), from(pairs.d[1] + k), from(pairs.d[2] + k)};
        const RealGap gap = segment_box(a.y, from(pairs.half_length + k), b, half, d);
        to(gap.distance, pairs.distance + k);
        put(gap.normal, pairs.normal, k);
        put(gap.on_a, pairs.on_a, k);
        put(gap.on_b, pairs.on_b, k);
        put(a.y, pairs.axis_a, k);
        put(b, pairs.matrix_b, k);
    }
}

HWY_ATTR inline std::uint32_t furthest(const double* x, std::uint32_t stride, double dx, double dy, double dz)
{
    const double* y = x + stride;
    const double* z = y + stride;
    const Real rx = real(dx), ry = real(dy), rz = real(dz);
    Real most = real(-HUGE_VAL), group = real(0);
    for (std::uint32_t i = 0; i < stride; i += reals) {
        const Real h = rx * from(x + i) + ry * from(y + i) + rz * from(z + i);
        const RealMask higher = is_less(most, h);
        most = choose(higher, h, most);
        group = choose(higher, real(i), group);
    }
    const double highest = greatest(most);
    const Real place = choose(is_less(most, real(highest)), real(1e300), group + lane_numbers());
    return static_cast<std::uint32_t>(least(place));
}

HWY_ATTR inline double heights(const double* x, std::uint32_t stride, double dx, double dy, double dz,
                               double* height)
{
    const double* y = x + stride;
    const double* z = y + stride;
    const Real rx = real(dx), ry = real(dy), rz = real(dz);
    Real low = real(HUGE_VAL);
    for (std::uint32_t i = 0; i < stride; i += reals) {
        const Real h = rx * from(x + i) + ry * from(y + i) + rz * from(z + i);
        to(h, height + i);
        low = choose(is_less(h, low), h, low);
    }
    return least(low);
}

HWY_ATTR inline void move(const double* from_points, std::uint32_t stride, const Mat3& turn,
                          const Vec3& shift, double* to_points)
{
    const RealMat m{{real(turn.x.x), real(turn.x.y), real(turn.x.z)},
                    {real(turn.y.x), real(turn.y.y), real(turn.y.z)},
                    {real(turn.z.x), real(turn.z.y), real(turn.z.z)}};
    const Real3 at{real(shift.x), real(shift.y), real(shift.z)};
    for (std::uint32_t i = 0; i < stride; i += reals) {
        const Real x = from(from_points + i), y = from(from_points + stride + i),
                   z = from(from_points + 2 * stride + i);
        to(m.x.x * x + m.y.x * y + m.z.x * z + at.x, to_points + i);
        to(m.x.y * x + m.y.y * y + m.z.y * z + at.y, to_points + stride + i);
        to(m.x.z * x + m.y.z * y + m.z.z * z + at.z, to_points + 2 * stride + i);
    }
}

HWY_ATTR inline std::uint32_t planes(const double* normals, const double* offsets, std::uint32_t stride,
                                     double enough, PlaneRows& rows)
{
    const Real limit = real(enough);
    Real least_deep = real(HUGE_VAL), group = real(0);
    for (std::uint32_t f = 0; f < stride; f += reals) {
        const Real nx = from(normals + f), ny = from(normals + stride + f),
                   nz = from(normals + 2 * stride + f);
        const Real offset = from(offsets + f);
        Real deepest = real(-HUGE_VAL), deeper = real(0x1p52);
        double bit = 1;
        for (std::uint32_t i = 0; i < rows.count; ++i, bit += bit) {
            const Real depth = offset - (nx * real(rows.point[0][i]) + ny * real(rows.point[1][i]) +
                                         nz * real(rows.point[2][i]));
            deepest = greater_of(deepest, depth);
            deeper = deeper + choose(is_less(limit, depth), real(bit), real(0));
        }
        to(deepest, rows.depth + f);
        to(deeper, rows.deeper + f);
        const RealMask better = is_less(deepest, least_deep);
        least_deep = choose(better, deepest, least_deep);
        group = choose(better, real(f), group);
    }
    const Real place =
        choose(is_less(real(least(least_deep)), least_deep), real(1e300), group + lane_numbers());
    return static_cast<std::uint32_t>(least(place));
}

HWY_ATTR inline Real3 rows3(const double (&rows)[3][EdgeRows::most], std::uint32_t i)
{
    return {from(rows[0] + i), from(rows[1] + i), from(rows[2] + i)};
}
HWY_ATTR inline Real3 one3(const double (&rows)[3][EdgeRows::most], std::uint32_t i)
{
    return {real(rows[0][i]), real(rows[1][i]), real(rows[2][i])};
}

HWY_ATTR inline EdgePair edges(const EdgeRows& a, const EdgeRows& b)
{
    const Real zero = real(0);
    Real most = real(-HUGE_VAL), pair = zero;
    for (std::uint32_t i = 0; i < a.count; ++i) {
        const Real3 along_a = one3(a.along, i), begin_a = one3(a.begin, i);
        const Real3 a0 = one3(a.normal_0, i), a1 = one3(a.normal_1, i);
        const Real narrow = real(1e-14) * dot3(along_a, along_a);
        for (std::uint32_t j = 0; j < b.count; j += reals) {
            // b's arc crosses the circle of a's, a's that of b's, and both in the same half.
            const Real3 along_b = rows3(b.along, j);
            const Real b0 = dot3(rows3(b.normal_0, j), along_a), b1 = dot3(rows3(b.normal_1, j), along_a);
            const Real side_0 = dot3(a0, along_b), side_1 = dot3(a1, along_b);
            const RealMask crossing = both(both(is_less(b0 * b1, zero), is_less(side_0 * side_1, zero)),
                                           is_less(b0 * side_1, zero));
            if (!any(crossing)) continue;
            const Real3 n{along_a.y * along_b.z - along_a.z * along_b.y,
                          along_a.z * along_b.x - along_a.x * along_b.z,
                          along_a.x * along_b.y - along_a.y * along_b.x};
            const Real3 begin_b = rows3(b.begin, j);
            const Real3 apart{begin_b.x - begin_a.x, begin_b.y - begin_a.y, begin_b.z - begin_a.z};
            const Real square = dot3(n, n), along_n = dot3(n, apart);
            // Outwards from a, whose arc runs about its edge.
            const Real separation = choose(is_less(zero, side_0), along_n, zero - along_n) / root(square);
            // Parallel within 1e-7: a face's normal says it better.
            const RealMask wide = is_less(narrow * dot3(along_b, along_b), square);
            const RealMask better = both(both(crossing, wide), is_less(most, separation));
            most = choose(better, separation, most);
            pair = choose(better, real(i * EdgeRows::most + j) + lane_numbers(), pair);
        }
    }
    const double separation = greatest(most);
    const Real place = choose(is_less(most, real(separation)), real(1e300), pair);
    const auto number = static_cast<std::uint32_t>(least(place));
    return {separation, number / EdgeRows::most, number % EdgeRows::most};
}
