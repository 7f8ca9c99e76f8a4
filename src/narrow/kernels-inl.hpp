// SPDX-License-Identifier: MIT
// Written once, compiled once per instruction set: kernels.cpp includes this file inside a namespace that has
// the vocabulary of simd/vec-inl.hpp. A vector has one number of each of several pairs. No include guard, on
// purpose.

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
/// a where it is the greater, also where they are equal; so that zeros keep their signs everywhere.
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

/// As `rotation` in math.hpp, step by step.
HWY_ATTR inline RealMat matrix(const double (&q)[4][batch], std::uint32_t k)
{
    const Real qx = Real::loadu(q[0] + k), qy = Real::loadu(q[1] + k), qz = Real::loadu(q[2] + k),
               qw = Real::loadu(q[3] + k);
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

struct RealAxis
{
    Real separation, axis, sign;
    Real3 normal; ///< not yet turned from a to b
};

/// Takes an axis if it separates by more than the best one so far and `by`.
HWY_ATTR inline void take_axis(RealAxis& best, const Real& by, const Real& separation, double axis,
                               const Real& sign, const Real3& normal)
{
    const RealMask better = best.separation + by < separation;
    best.separation = choose(better, separation, best.separation);
    best.axis = choose(better, Real(axis), best.axis);
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
            ac[i][j] = abs(c[i][j]);
        }
    }
    const Real zero = Real(0);
    RealAxis best{Real(-HUGE_VAL), zero, zero, {zero, zero, zero}};
    for (int i = 0; i < 3; ++i) {
        const Real reach = ha[i] + hb[0] * ac[i][0] + hb[1] * ac[i][1] + hb[2] * ac[i][2];
        take_axis(best, zero, abs(ta[i]) - reach, i, ta[i], axis_a[i]);
    }
    for (int j = 0; j < 3; ++j) {
        const Real reach = hb[j] + ha[0] * ac[0][j] + ha[1] * ac[1][j] + ha[2] * ac[2][j];
        take_axis(best, zero, abs(tb[j]) - reach, 3 + j, tb[j], axis_b[j]);
    }
    // Edges have to be better by more than rounding, or parallel faces would meet along noise.
    const Real by = Real(1e-10) * (ha[0] + ha[1] + ha[2] + hb[0] + hb[1] + hb[2]);
    for (int i = 0; i < 3; ++i) {
        const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int j = 0; j < 3; ++j) {
            const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            // The axis is a_i x b_j; in a's frame it has the components 0, -c[i2][j], c[i1][j] from i on.
            const Real p = zero - c[i2][j], q = c[i1][j];
            const Real square = p * p + q * q;
            const Real inverse = Real(1) / sqrt(square);
            const Real t = ta[i1] * p + ta[i2] * q;
            const Real reach =
                ha[i1] * ac[i2][j] + ha[i2] * ac[i1][j] + hb[j1] * ac[i][j2] + hb[j2] * ac[i][j1];
            // Parallel within 1e-7: a face's normal or another edge says it better.
            const Real separation = choose(Real(1e-14) < square, (abs(t) - reach) * inverse, Real(-HUGE_VAL));
            const Real3 normal = scale3(add3(scale3(axis_a[i1], p), scale3(axis_a[i2], q)), inverse);
            take_axis(best, by, separation, 6 + 3 * i + j, t, normal);
        }
    }
    const RealMask back = best.sign < zero;
    best.normal.x = choose(back, zero - best.normal.x, best.normal.x);
    best.normal.y = choose(back, zero - best.normal.y, best.normal.y);
    best.normal.z = choose(back, zero - best.normal.z, best.normal.z);
    return best;
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

HWY_ATTR inline void boxes(BoxBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const RealMat a = matrix(pairs.turn_a, k), b = matrix(pairs.turn_b, k);
        const Real3 half_a{Real::loadu(pairs.half_a[0] + k), Real::loadu(pairs.half_a[1] + k),
                           Real::loadu(pairs.half_a[2] + k)};
        const Real3 half_b{Real::loadu(pairs.half_b[0] + k), Real::loadu(pairs.half_b[1] + k),
                           Real::loadu(pairs.half_b[2] + k)};
        const Real3 d{Real::loadu(pairs.d[0] + k), Real::loadu(pairs.d[1] + k), Real::loadu(pairs.d[2] + k)};
        const RealAxis best = best_box_axis(a, half_a, b, half_b, d);
        best.separation.storeu(pairs.separation + k);
        best.axis.storeu(pairs.axis + k);
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
    const Real zero = Real(0), one = Real(1);
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
    Real low = Real(-1), high = one;
    Real slope_low = slope(low), slope_high = slope(high);
    // Where it already rises at the start, or still falls at the end, that is the nearest.
    const RealMask at_start = zero < slope_low, at_end = slope_high < zero;
    for (int i = 0; i < 3; ++i)
        for (int side = 0; side < 2; ++side) {
            const Real t = ((side == 0 ? zero - h[i] : h[i]) - c[i]) / e[i];
            // What lies outside, or is infinite or 0/0 for a segment along the face, is left out.
            const RealMask inside = (Real(-1) < t) & (t < one);
            const Real here = slope(choose(inside, t, zero));
            const RealMask up_low = inside & ((zero >= here) & (low < t));
            const RealMask down_high = inside & ((here >= zero) & (t < high));
            low = choose(up_low, t, low);
            slope_low = choose(up_low, here, slope_low);
            high = choose(down_high, t, high);
            slope_high = choose(down_high, here, slope_high);
        }
    const Real rise = slope_high - slope_low;
    const Real between = low - slope_low * ((high - low) / choose(zero < rise, rise, one));
    // Level all the way: the middle, so that a capsule side by side with a face is met in its middle.
    Real t = choose(zero < rise, between, (low + high) * Real(0.5));
    t = choose(at_start, Real(-1), choose(at_end, one, t));
    t = clamped(t, one);

    Real p[3], q[3], gap[3];
    for (int i = 0; i < 3; ++i) {
        p[i] = c[i] + t * e[i];
        q[i] = clamped(p[i], h[i]);
        gap[i] = q[i] - p[i];
    }
    const Real distance = sqrt(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2]);
    const Real reach = half_length + h[0] + h[1] + h[2];
    const RealMask apart = Real(1e-9) * reach < distance;
    const Real inverse = one / choose(apart, distance, one);

    // Overlap: the axis of least.
    RealAxis best{Real(-HUGE_VAL), zero, zero, {zero, zero, zero}};
    const Real3 axis_b[3] = {b.x, b.y, b.z};
    for (int i = 0; i < 3; ++i)
        take_axis(best, zero, abs(c[i]) - (h[i] + abs(e[i])), i, zero - c[i], axis_b[i]);
    const Real by = Real(1e-10) * reach;
    for (int j = 0; j < 3; ++j) {
        const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        // along x axis j has the components 0, along[j2], -along[j1] from j on.
        const Real u = along[j2], v = zero - along[j1];
        const Real square = u * u + v * v;
        const Real turn_inverse = one / sqrt(square);
        const Real across = c[j1] * u + c[j2] * v;
        const Real separation =
            choose(Real(1e-14) < square, (abs(across) - (h[j1] * abs(u) + h[j2] * abs(v))) * turn_inverse,
                   Real(-HUGE_VAL));
        const Real3 normal = scale3(add3(scale3(axis_b[j1], u), scale3(axis_b[j2], v)), turn_inverse);
        take_axis(best, by, separation, 3 + j, zero - across, normal);
    }
    const RealMask back = best.sign < zero;

    RealGap result;
    const Real3 straight = add3(add3(scale3(b.x, gap[0] * inverse), scale3(b.y, gap[1] * inverse)),
                                scale3(b.z, gap[2] * inverse));
    result.normal.x = choose(apart, straight.x, choose(back, zero - best.normal.x, best.normal.x));
    result.normal.y = choose(apart, straight.y, choose(back, zero - best.normal.y, best.normal.y));
    result.normal.z = choose(apart, straight.z, choose(back, zero - best.normal.z, best.normal.z));
    const Real overlap = choose(best.separation < zero, best.separation, zero);
    result.distance = choose(apart, distance, overlap);
    result.on_a = scale3(axis, t * half_length);
    result.on_b = add3(d, add3(add3(scale3(b.x, q[0]), scale3(b.y, q[1])), scale3(b.z, q[2])));
    return result;
}

HWY_ATTR inline void capsule_box(CapsuleBoxBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const RealMat a = matrix(pairs.turn_a, k), b = matrix(pairs.turn_b, k);
        const Real3 half{Real::loadu(pairs.half[0] + k), Real::loadu(pairs.half[1] + k),
                         Real::loadu(pairs.half[2] + k)};
        const Real3 d{Real::loadu(pairs.d[0] + k), Real::loadu(pairs.d[1] + k), Real::loadu(pairs.d[2] + k)};
        const RealGap gap = segment_box(a.y, Real::loadu(pairs.half_length + k), b, half, d);
        gap.distance.storeu(pairs.distance + k);
        put(gap.normal, pairs.normal, k);
        put(gap.on_a, pairs.on_a, k);
        put(gap.on_b, pairs.on_b, k);
        put(a.y, pairs.axis_a, k);
        put(b, pairs.matrix_b, k);
    }
}

HWY_ATTR inline Real3 subtract3(const Real3& a, const Real3& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
HWY_ATTR inline Real3 cross3(const Real3& a, const Real3& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

HWY_ATTR inline void rounds(RoundBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const Real3 a = matrix(pairs.turn_a, k).y, b = matrix(pairs.turn_b, k).y;
        const Real half_a = Real::loadu(pairs.half_a + k), half_b = Real::loadu(pairs.half_b + k);
        const Real3 d{Real::loadu(pairs.d[0] + k), Real::loadu(pairs.d[1] + k), Real::loadu(pairs.d[2] + k)};
        const Real3 across = cross3(a, b);
        const Real square = dot3(across, across), turn = dot3(a, b);
        const Real along_a = dot3(a, d), along_b = dot3(b, d);
        const Real cut = clamped(dot3(cross3(d, b), across) / square, half_a);
        const Real t = clamped(turn * choose(Real(1e-28) < square, cut, Real(0)) - along_b, half_b);
        const Real s = clamped(along_a + turn * t, half_a);
        const Real3 on_a = scale3(a, s), on_b = add3(d, scale3(b, t));
        const Real3 way = subtract3(on_b, on_a);
        const Real distance = sqrt(dot3(way, way));
        distance.storeu(pairs.distance + k);
        put(scale3(way, Real(1) / distance), pairs.normal, k);
        put(on_a, pairs.on_a, k);
        put(on_b, pairs.on_b, k);
    }
}

HWY_ATTR inline Real3 turn3(const RealMat& m, const Real3& v)
{
    return add3(add3(scale3(m.x, v.x), scale3(m.y, v.y)), scale3(m.z, v.z));
}

HWY_ATTR inline void point_box(PointBoxBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const Real zero = Real(0);
        const RealMat b = matrix(pairs.turn_b, k);
        const Real3 d{Real::loadu(pairs.d[0] + k), Real::loadu(pairs.d[1] + k), Real::loadu(pairs.d[2] + k)};
        const Real3 back{zero - d.x, zero - d.y, zero - d.z};
        const Real3 centre{dot3(b.x, back), dot3(b.y, back), dot3(b.z, back)};
        const Real3 nearest{clamped(centre.x, Real::loadu(pairs.half[0] + k)),
                            clamped(centre.y, Real::loadu(pairs.half[1] + k)),
                            clamped(centre.z, Real::loadu(pairs.half[2] + k))};
        const Real3 way = subtract3(nearest, centre);
        const Real distance = sqrt(dot3(way, way));
        distance.storeu(pairs.distance + k);
        put(turn3(b, scale3(way, Real(1) / distance)), pairs.normal, k);
        put(add3(d, turn3(b, nearest)), pairs.on_b, k);
    }
}

HWY_ATTR inline std::uint32_t furthest(const double* x, std::uint32_t stride, double dx, double dy, double dz)
{
    const double* y = x + stride;
    const double* z = y + stride;
    const Real rx = Real(dx), ry = Real(dy), rz = Real(dz);
    Real most = Real(-HUGE_VAL), group = Real(0);
    for (std::uint32_t i = 0; i < stride; i += Real::size) {
        const Real h = rx * Real::loadu(x + i) + ry * Real::loadu(y + i) + rz * Real::loadu(z + i);
        const RealMask higher = most < h;
        most = choose(higher, h, most);
        group = choose(higher, Real(i), group);
    }
    const double highest = max_lane(most);
    const Real place = choose(most < Real(highest), Real(1e300), group + Real::lane_numbers());
    return static_cast<std::uint32_t>(min_lane(place));
}

HWY_ATTR inline double heights(const double* x, std::uint32_t stride, double dx, double dy, double dz,
                               double* height)
{
    const double* y = x + stride;
    const double* z = y + stride;
    const Real rx = Real(dx), ry = Real(dy), rz = Real(dz);
    Real low = Real(HUGE_VAL);
    for (std::uint32_t i = 0; i < stride; i += Real::size) {
        const Real h = rx * Real::loadu(x + i) + ry * Real::loadu(y + i) + rz * Real::loadu(z + i);
        h.storeu(height + i);
        low = choose(h < low, h, low);
    }
    return min_lane(low);
}

HWY_ATTR inline void move(const double* from_points, std::uint32_t stride, const Mat3& turn,
                          const Vec3& shift, double* to_points)
{
    const RealMat m{{Real(turn.x.x), Real(turn.x.y), Real(turn.x.z)},
                    {Real(turn.y.x), Real(turn.y.y), Real(turn.y.z)},
                    {Real(turn.z.x), Real(turn.z.y), Real(turn.z.z)}};
    const Real3 at{Real(shift.x), Real(shift.y), Real(shift.z)};
    for (std::uint32_t i = 0; i < stride; i += Real::size) {
        const Real x = Real::loadu(from_points + i), y = Real::loadu(from_points + stride + i),
                   z = Real::loadu(from_points + 2 * stride + i);
        (m.x.x * x + m.y.x * y + m.z.x * z + at.x).storeu(to_points + i);
        (m.x.y * x + m.y.y * y + m.z.y * z + at.y).storeu(to_points + stride + i);
        (m.x.z * x + m.y.z * y + m.z.z * z + at.z).storeu(to_points + 2 * stride + i);
    }
}

HWY_ATTR inline std::uint32_t planes(const double* normals, const double* offsets, std::uint32_t stride,
                                     double enough, PlaneRows& rows)
{
    const Real limit = Real(enough);
    Real least_deep = Real(HUGE_VAL), group = Real(0);
    for (std::uint32_t f = 0; f < stride; f += Real::size) {
        const Real nx = Real::loadu(normals + f), ny = Real::loadu(normals + stride + f),
                   nz = Real::loadu(normals + 2 * stride + f);
        const Real offset = Real::loadu(offsets + f);
        Real deepest = Real(-HUGE_VAL), deeper = Real(0x1p52);
        double bit = 1;
        for (std::uint32_t i = 0; i < rows.count; ++i, bit += bit) {
            const Real depth = offset - (nx * Real(rows.point[0][i]) + ny * Real(rows.point[1][i]) +
                                         nz * Real(rows.point[2][i]));
            deepest = greater_of(deepest, depth);
            deeper = deeper + choose(limit < depth, Real(bit), Real(0));
        }
        deepest.storeu(rows.depth + f);
        deeper.storeu(rows.deeper + f);
        const RealMask better = deepest < least_deep;
        least_deep = choose(better, deepest, least_deep);
        group = choose(better, Real(f), group);
    }
    const Real place =
        choose(Real(min_lane(least_deep)) < least_deep, Real(1e300), group + Real::lane_numbers());
    return static_cast<std::uint32_t>(min_lane(place));
}

HWY_ATTR inline Real3 rows3(const double (&rows)[3][EdgeRows::most], std::uint32_t i)
{
    return {Real::loadu(rows[0] + i), Real::loadu(rows[1] + i), Real::loadu(rows[2] + i)};
}
HWY_ATTR inline Real3 one3(const double (&rows)[3][EdgeRows::most], std::uint32_t i)
{
    return {Real(rows[0][i]), Real(rows[1][i]), Real(rows[2][i])};
}

HWY_ATTR inline EdgePair edges(const EdgeRows& a, const EdgeRows& b)
{
    const Real zero = Real(0);
    Real most = Real(-HUGE_VAL), pair = zero;
    for (std::uint32_t i = 0; i < a.count; ++i) {
        const Real3 along_a = one3(a.along, i), begin_a = one3(a.begin, i);
        const Real3 a0 = one3(a.normal_0, i), a1 = one3(a.normal_1, i);
        const Real narrow = Real(1e-14) * dot3(along_a, along_a);
        for (std::uint32_t j = 0; j < b.count; j += Real::size) {
            // b's arc crosses the circle of a's, a's that of b's, and both in the same half.
            const Real3 along_b = rows3(b.along, j);
            const Real b0 = dot3(rows3(b.normal_0, j), along_a), b1 = dot3(rows3(b.normal_1, j), along_a);
            const Real side_0 = dot3(a0, along_b), side_1 = dot3(a1, along_b);
            const RealMask crossing = ((b0 * b1 < zero) & (side_0 * side_1 < zero)) & (b0 * side_1 < zero);
            if (!any(crossing)) continue;
            const Real3 n{along_a.y * along_b.z - along_a.z * along_b.y,
                          along_a.z * along_b.x - along_a.x * along_b.z,
                          along_a.x * along_b.y - along_a.y * along_b.x};
            const Real3 begin_b = rows3(b.begin, j);
            const Real3 apart{begin_b.x - begin_a.x, begin_b.y - begin_a.y, begin_b.z - begin_a.z};
            const Real square = dot3(n, n), along_n = dot3(n, apart);
            // Outwards from a, whose arc runs about its edge.
            const Real separation = choose(zero < side_0, along_n, zero - along_n) / sqrt(square);
            // Parallel within 1e-7: a face's normal says it better.
            const RealMask wide = narrow * dot3(along_b, along_b) < square;
            const RealMask better = (crossing & wide) & (most < separation);
            most = choose(better, separation, most);
            pair = choose(better, Real(i * EdgeRows::most + j) + Real::lane_numbers(), pair);
        }
    }
    const double separation = max_lane(most);
    const Real place = choose(most < Real(separation), Real(1e300), pair);
    const auto number = static_cast<std::uint32_t>(min_lane(place));
    return {separation, number / EdgeRows::most, number % EdgeRows::most};
}

/// A box and others of a tree: what is between them along the axes of each.
struct RealBoxGap
{
    Real3 axis[3];               ///< theirs
    Real along_box[3], along[3]; ///< from centre to centre
    Real gap_box[3], gap[3];     ///< below 0 they overlap along that axis
    Real square_box, square;     ///< of the distance, as far as its axes tell
};
HWY_ATTR inline Real squared_gap(const Real (&gap)[3])
{
    const Real zero = Real(0);
    const Real x = greater_of(gap[0], zero), y = greater_of(gap[1], zero), z = greater_of(gap[2], zero);
    return x * x + y * y + z * z;
}
HWY_ATTR inline RealBoxGap box_gap(const BoxRows& rows, const OrientedBox& box, std::uint32_t k)
{
    RealBoxGap result;
    const Vec3* const own[3] = {&box.axes.x, &box.axes.y, &box.axes.z};
    const Real3 t{Real::loadu(rows.centre[0] + k) - Real(box.centre.x),
                  Real::loadu(rows.centre[1] + k) - Real(box.centre.y),
                  Real::loadu(rows.centre[2] + k) - Real(box.centre.z)};
    const Real half_box[3] = {Real(box.half.x), Real(box.half.y), Real(box.half.z)};
    const Real half[3] = {Real::loadu(rows.half[0] + k), Real::loadu(rows.half[1] + k),
                          Real::loadu(rows.half[2] + k)};
    for (int j = 0; j < 3; ++j) {
        result.axis[j] = {Real::loadu(rows.axes[3 * j] + k), Real::loadu(rows.axes[3 * j + 1] + k),
                          Real::loadu(rows.axes[3 * j + 2] + k)};
        result.along[j] = dot3(result.axis[j], t);
        result.gap[j] = abs(result.along[j]) - half[j];
    }
    for (int i = 0; i < 3; ++i) {
        const Real3 axis{Real(own[i]->x), Real(own[i]->y), Real(own[i]->z)};
        result.along_box[i] = dot3(axis, t);
        result.gap_box[i] = abs(result.along_box[i]) - half_box[i];
        for (int j = 0; j < 3; ++j) {
            const Real turn = abs(dot3(axis, result.axis[j]));
            result.gap_box[i] = result.gap_box[i] - half[j] * turn;
            result.gap[j] = result.gap[j] - half_box[i] * turn;
        }
    }
    result.square_box = squared_gap(result.gap_box);
    result.square = squared_gap(result.gap);
    return result;
}
/// Where no axis parts them: how much they overlap along that where it is least.
HWY_ATTR inline Real distance_of(const RealBoxGap& gap)
{
    const Real best = greater_of(gap.square_box, gap.square);
    Real overlap = gap.gap[0];
    for (int i = 0; i < 3; ++i)
        overlap = greater_of(overlap, greater_of(gap.gap_box[i], gap.gap[i]));
    return choose(Real(0) < best, sqrt(best), overlap);
}

HWY_ATTR inline void bounds(const BoxRows& rows, const OrientedBox& box, BoxBounds& out)
{
    for (std::uint32_t k = 0; k < BoxRows::size; k += Real::size)
        distance_of(box_gap(rows, box, k)).storeu(out.distance + k);
}

HWY_ATTR inline void approaches(const BoxRows& rows, const OrientedBox& box, BoxApproaches& out)
{
    const Real zero = Real(0);
    for (std::uint32_t k = 0; k < BoxRows::size; k += Real::size) {
        const RealBoxGap gap = box_gap(rows, box, k);
        const Real distance = distance_of(gap);
        distance.storeu(out.distance + k);
        const Vec3* const own[3] = {&box.axes.x, &box.axes.y, &box.axes.z};
        Real3 by_box{zero, zero, zero}, by_rows{zero, zero, zero};
        for (int i = 0; i < 3; ++i) {
            const Real one = greater_of(gap.gap_box[i], zero), other = greater_of(gap.gap[i], zero);
            const Real3 axis{Real(own[i]->x), Real(own[i]->y), Real(own[i]->z)};
            by_box = add3(by_box, scale3(axis, choose(gap.along_box[i] < zero, zero - one, one)));
            by_rows = add3(by_rows, scale3(gap.axis[i], choose(gap.along[i] < zero, zero - other, other)));
        }
        const RealMask box_says = gap.square < gap.square_box;
        const Real inverse = Real(1) / choose(zero < distance, distance, Real(1));
        (choose(box_says, by_box.x, by_rows.x) * inverse).storeu(out.normal[0] + k);
        (choose(box_says, by_box.y, by_rows.y) * inverse).storeu(out.normal[1] + k);
        (choose(box_says, by_box.z, by_rows.z) * inverse).storeu(out.normal[2] + k);
    }
}
