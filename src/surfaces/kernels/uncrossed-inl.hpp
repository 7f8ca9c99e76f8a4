// SPDX-License-Identifier: MIT
// Which edges certainly don't cross a triangle: both ends are on one side of its plane, or the edge's line
// leaves two of its sides on different hands. Both are signs of volumes, of which floats tell nearly all. No
// include guard: kernels.cpp includes it once per set.

/// What rounding can change a volume by, as a part of the third power of the greatest number: 46 roundings of
/// 2^-24 for each of four, of the differences, the products and the sums, and 54 of the fifth volume, which
/// is the sum of these.
constexpr float volume_rounding = 0x1p-16f;
/// Third powers of numbers between these stay in a float's range.
constexpr float largest_cubed = 1e11f, smallest_cubed = 1e-9f;

// Unused in its one-lane form where every instruction set has SIMD, as in WebAssembly.
[[maybe_unused]] HWY_ATTR std::uint64_t uncrossed(const CrossingBatch& pairs, std::uint32_t count)
{
    std::uint64_t bits = 0;
    for (std::uint32_t k = 0; k < count; k += Float::size) {
        Point<float> leg[4];
        Float greatest = Float(0);
        for (int i = 0; i < 4; ++i) {
            load_rows(pairs.legs[i] + k, leg[i].x, leg[i].y, leg[i].z);
            greatest = max(greatest, greatest_of(leg[i]));
        }
        const Point<float>&end = leg[0], &a = leg[1], &b = leg[2], &c = leg[3];
        const Point<float> by_bc = cross(b, c);
        const Float ab = dot(end, cross(a, b)), bc = dot(end, by_bc), ca = dot(end, cross(c, a));
        const Float of_begin = Float(0) - dot(a, by_bc), of_end = of_begin + (ab + bc + ca);
        const Float above = greatest * greatest * greatest * Float(volume_rounding), below = Float(0) - above;
        const Mask<float> one_side = (min(of_begin, of_end) > above) | (max(of_begin, of_end) < below),
                          beside = (min(ab, min(bc, ca)) < below) & (max(ab, max(bc, ca)) > above),
                          good = (greatest > Float(smallest_cubed)) & (greatest < Float(largest_cubed));
        bits |= std::uint64_t{mask_bits(good & (one_side | beside))} << k;
    }
    return bits;
}
