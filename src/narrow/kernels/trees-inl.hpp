// SPDX-License-Identifier: MIT
// Boxes of a mesh's tree against one box, several at a time. Compiled once per instruction set, see
// kernels.cpp.

/// The gaps between one box and several others of a tree, along the axes of each.
struct RealBoxGap
{
    Real3 axis[3];               ///< the others'
    Real along_box[3], along[3]; ///< from centre to centre
    Real gap_box[3],
        gap[3]; ///< between the boxes along an axis of the one, of the others; negative for an overlap
    Real square_box,
        square; ///< lower bounds of the squared distance by the axes of the one, of the others
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
/// If no axis separates the boxes: the least overlap along any axis, negated.
HWY_ATTR inline Real overlap_of(const RealBoxGap& gap)
{
    Real overlap = gap.gap[0];
    for (int i = 0; i < 3; ++i)
        overlap = greater_of(overlap, greater_of(gap.gap_box[i], gap.gap[i]));
    return overlap;
}

HWY_ATTR inline std::uint32_t bounds(const BoxRows& rows, const OrientedBox& box, double limit,
                                     double (&key)[BoxRows::size])
{
    std::uint32_t beyond = 0;
    for (std::uint32_t k = 0; k < BoxRows::size; k += Real::size) {
        const RealBoxGap gap = box_gap(rows, box, k);
        const Real square = greater_of(gap.square_box, gap.square);
        const Real here = choose(Real(0) < square, square, overlap_of(gap));
        here.storeu(key + k);
        beyond |= mask_bits(Real(limit) < here) << k;
    }
    return ~beyond;
}

HWY_ATTR inline void approaches(const BoxRows& rows, const OrientedBox& box, BoxApproaches& out)
{
    const Real zero = Real(0);
    for (std::uint32_t k = 0; k < BoxRows::size; k += Real::size) {
        const RealBoxGap gap = box_gap(rows, box, k);
        const Real square = greater_of(gap.square_box, gap.square);
        const Real distance = choose(zero < square, sqrt(square), overlap_of(gap));
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
