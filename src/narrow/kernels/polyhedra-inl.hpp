// SPDX-License-Identifier: MIT
// Points, planes and edges of polyhedra, several at a time. Compiled once per instruction set, see
// kernels.cpp.

/// The first of the highest points. The heights of 64 are kept until the greatest is known; then one word of
/// bits tells which have it.
HWY_ATTR inline std::uint32_t furthest(const double* x, std::uint32_t stride, double dx, double dy, double dz)
{
    constexpr std::uint32_t at_once = 64;
    const double* y = x + stride;
    const double* z = y + stride;
    const Real rx = Real(dx), ry = Real(dy), rz = Real(dz);
    std::uint32_t first = 0;
    double highest = -HUGE_VAL;
    for (std::uint32_t begin = 0; begin < stride; begin += at_once) {
        const std::uint32_t count = std::min(at_once, stride - begin);
        alignas(64) double height[at_once];
        Real most = Real(-HUGE_VAL);
        for (std::uint32_t i = 0; i < count; i += Real::size) {
            const std::uint32_t k = begin + i;
            const Real h = rx * Real::loadu(x + k) + ry * Real::loadu(y + k) + rz * Real::loadu(z + k);
            h.store(height + i);
            most = max(most, h);
        }
        const double here = max_lane(most);
        if (begin > 0 && !(here > highest)) continue;
        highest = here;
        const Real least = Real(here);
        std::uint64_t bits = 0;
        for (std::uint32_t i = 0; i < count; i += Real::size)
            bits |= std::uint64_t{mask_bits(Real::load(height + i) >= least)} << i;
        first = begin + static_cast<std::uint32_t>(std::countr_zero(bits));
    }
    return first;
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

/// A vector holds as many planes as it has lanes; the points are processed one by one.
///
/// `deeper` counts in a double, since the lanes are doubles: it begins as 2^52, at which the last bit of the
/// mantissa is worth 1, and 2^i is added for point i. So bit i of the number's mantissa tells whether that
/// point is deep:
///
///     bit  63  62 ... 52   51 ... 3  2  1  0
///           0  exponent    ...       |  |  point 0
///                                    |  point 1               at most 48 points (PlaneRows::most_points)
///                                    point 2
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

/// The vectors of the edges i, i + 1, ...
HWY_ATTR inline Real3 rows3(const double (&rows)[3][EdgeRows::most], std::uint32_t i)
{
    return {Real::loadu(rows[0] + i), Real::loadu(rows[1] + i), Real::loadu(rows[2] + i)};
}
/// The vector of the edge i in all lanes.
HWY_ATTR inline Real3 one3(const double (&rows)[3][EdgeRows::most], std::uint32_t i)
{
    return {Real(rows[0][i]), Real(rows[1][i]), Real(rows[2][i])};
}

/// a's edges are processed one by one, with a vector of b's against each. The number of a pair fits a double:
/// it is at most EdgeRows::most squared.
HWY_ATTR inline EdgePair edges(const EdgeRows& a, const EdgeRows& b)
{
    const Real zero = Real(0);
    Real most = Real(-HUGE_VAL), pair = zero;
    for (std::uint32_t i = 0; i < a.count; ++i) {
        const Real3 along_a = one3(a.along, i), begin_a = one3(a.begin, i);
        const Real3 a0 = one3(a.normal_0, i), a1 = one3(a.normal_1, i);
        const Real narrow = Real(1e-14) * dot3(along_a, along_a);
        for (std::uint32_t j = 0; j < b.count; j += Real::size) {
            // Two arcs cross if the ends of each lie on either side of the other's great circle, and the two
            // crossings of the circles are not on opposite sides of the sphere. The circle of an edge's arc
            // is perpendicular to the edge, so an end's side is the sign of a product with the edge.
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
            // The cross product of two edges may point either way; a's arc tells which way is outwards from
            // a.
            const Real separation = choose(zero < side_0, along_n, zero - along_n) / sqrt(square);
            // Edges that are parallel within 1e-7 have no direction across them; a face's normal is used
            // instead.
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
