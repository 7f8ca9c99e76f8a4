// SPDX-License-Identifier: MIT
// Distances and overlaps of boxes, capsules and spheres, several pairs at a time. Compiled once per
// instruction set, see kernels.cpp.

/// The best separating axis so far, of each pair.
struct RealAxis
{
    Real separation; ///< the separation of the boxes along it; negative for an overlap
    Real axis;       ///< its number, as in BoxBatch
    Real sign;       ///< negative if the normal points from b to a
    Real3 normal;    ///< unit
};

/// Takes an axis for the pairs that it separates by more than the best one so far plus `by`.
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

/// The best of the 15 axes along which two boxes can be apart: three normals of a's faces, three of b's, and
/// the cross products of each edge of a with each of b. Source: Gottschalk, Lin, Manocha, OBBTree, SIGGRAPH
/// 1996; Ericson sec. 4.4.1.
HWY_ATTR inline RealAxis best_box_axis(const RealMat& a, const Real3& half_a, const RealMat& b,
                                       const Real3& half_b, const Real3& d)
{
    const Real3 axis_a[3] = {a.x, a.y, a.z}, axis_b[3] = {b.x, b.y, b.z};
    const Real ha[3] = {half_a.x, half_a.y, half_a.z}, hb[3] = {half_b.x, half_b.y, half_b.z};
    Real c[3][3], ac[3][3]; // cosines between a's axes and b's, and their sizes
    Real ta[3], tb[3];      // the distance of the centres along each axis
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
    // If faces are parallel, cross products of edges give the same separation as a face, and rounding would
    // choose among them at random. So edges must be better by more than rounding.
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
            // Edges that are parallel within 1e-7 have no direction across them. A face's normal or another
            // pair of edges is used instead.
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

HWY_ATTR inline void boxes(BoxBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const RealMat a = matrix(pairs.turn_a, k), b = matrix(pairs.turn_b, k);
        const RealAxis best =
            best_box_axis(a, load3(pairs.half_a, k), b, load3(pairs.half_b, k), load3(pairs.d, k));
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

/// The distance of a segment from a box, or its depth in the box.
///
/// Along the segment, the squared distance from the box is convex. Its derivative is piecewise linear, with
/// breaks where the segment crosses the plane of a face:
///
///     slope |              ___/
///         0 |---------+---x-------
///           |      __/
///           | ____/  low   high
///
/// Of the six crossings, the last before the slope's zero (low) and the first after it (high) are found. The
/// slope is linear between them, so its zero x, the nearest point, is exact.
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
    // If the distance already rises at the start, the start is nearest; if it still falls at the end, the end
    // is.
    const RealMask at_start = zero < slope_low, at_end = slope_high < zero;
    Real t = choose(at_start, Real(-1), one);
    if (!all(at_start | at_end)) {
        for (int i = 0; i < 3; ++i)
            for (int side = 0; side < 2; ++side) {
                const Real crossing = ((side == 0 ? zero - h[i] : h[i]) - c[i]) / e[i];
                // Crossings outside the segment are ignored. So are those of a segment along the face, which
                // are infinite or 0/0: comparisons with NaN are false.
                const RealMask inside = (Real(-1) < crossing) & (crossing < one);
                const Real here = slope(choose(inside, crossing, zero));
                const RealMask up_low = inside & ((zero >= here) & (low < crossing));
                const RealMask down_high = inside & ((here >= zero) & (crossing < high));
                low = choose(up_low, crossing, low);
                slope_low = choose(up_low, here, slope_low);
                high = choose(down_high, crossing, high);
                slope_high = choose(down_high, here, slope_high);
            }
        const Real rise = slope_high - slope_low;
        const Real between = low - slope_low * ((high - low) / choose(zero < rise, rise, one));
        // If the slope is 0 all the way from low to high, the middle is taken: a capsule along a face is met
        // in its middle.
        const Real within = choose(zero < rise, between, (low + high) * Real(0.5));
        t = choose(at_start | at_end, t, clamped(within, one));
    }

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

    RealGap result;
    result.distance = distance;
    result.normal = add3(add3(scale3(b.x, gap[0] * inverse), scale3(b.y, gap[1] * inverse)),
                         scale3(b.z, gap[2] * inverse));
    result.on_a = scale3(axis, t * half_length);
    result.on_b = add3(d, add3(add3(scale3(b.x, q[0]), scale3(b.y, q[1])), scale3(b.z, q[2])));
    if (all(apart)) return result;

    // Overlap: finds the axis with the least.
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
    const Real3 out{choose(back, zero - best.normal.x, best.normal.x),
                    choose(back, zero - best.normal.y, best.normal.y),
                    choose(back, zero - best.normal.z, best.normal.z)};
    result.normal = choose3(apart, result.normal, out);
    result.distance = choose(apart, distance, choose(best.separation < zero, best.separation, zero));
    return result;
}

HWY_ATTR inline void capsule_box(CapsuleBoxBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const RealMat a = matrix(pairs.turn_a, k), b = matrix(pairs.turn_b, k);
        const RealGap gap =
            segment_box(a.y, Real::loadu(pairs.half_length + k), b, load3(pairs.half, k), load3(pairs.d, k));
        gap.distance.storeu(pairs.distance + k);
        put(gap.normal, pairs.normal, k);
        put(gap.on_a, pairs.on_a, k);
        put(gap.on_b, pairs.on_b, k);
        put(a.y, pairs.axis_a, k);
        put(b, pairs.matrix_b, k);
    }
}

/// The nearest points of two segments. Source: Ericson sec. 5.1.9, in the form of round_gap in gaps3.hpp,
/// with the same operations in the same order. There is no normal if they meet.
HWY_ATTR HWY_INLINE RealGap segments(const Real3& a, const Real& half_a, const Real3& b, const Real& half_b,
                                     const Real3& d)
{
    const Real zero = Real(0), one = Real(1);
    const Real3 across = cross3(a, b);
    const Real square = dot3(across, across), turn = dot3(a, b);
    const RealMask across_is = Real(1e-28) < square;
    const Real along_a = dot3(a, d), along_b = dot3(b, d);
    const Real cut = clamped(dot3(cross3(d, b), across) / choose(across_is, square, one), half_a);
    const Real t = clamped(turn * choose(across_is, cut, zero) - along_b, half_b);
    const Real s = clamped(along_a + turn * t, half_a);
    const Real3 on_a = scale3(a, s), on_b = add3(d, scale3(b, t));
    const Real3 way = subtract3(on_b, on_a);
    const Real distance = sqrt(dot3(way, way));
    return {distance, scale3(way, one / choose(zero < distance, distance, one)), on_a, on_b};
}

HWY_ATTR inline void rounds(RoundBatch& pairs)
{
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const Real3 a = matrix(pairs.turn_a, k).y, b = matrix(pairs.turn_b, k).y;
        const RealGap gap =
            segments(a, Real::loadu(pairs.half_a + k), b, Real::loadu(pairs.half_b + k), load3(pairs.d, k));
        gap.distance.storeu(pairs.distance + k);
        put(gap.normal, pairs.normal, k);
        put(gap.on_a, pairs.on_a, k);
        put(gap.on_b, pairs.on_b, k);
        put(a, pairs.axis_a, k);
        put(b, pairs.axis_b, k);
    }
}
