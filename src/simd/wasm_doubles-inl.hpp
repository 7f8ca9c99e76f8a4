// SPDX-License-Identifier: MIT
// The vocabulary of simd/vec-inl.hpp for two doubles on WebAssembly, for which Highway has none before 1.1.
// No include guard, on purpose.

template <>
struct Mask<double>
{
    v128_t raw;
};

template <>
struct Vec<double>
{
    static constexpr std::uint32_t size = 2;
    v128_t raw;

    Vec() = default;
    HWY_INLINE explicit Vec(v128_t given) : raw(given) {}
    HWY_INLINE explicit Vec(double value) : raw(wasm_f64x2_splat(value)) {}
    static HWY_INLINE Vec load(const double* from) { return Vec(wasm_v128_load(from)); }
    static HWY_INLINE Vec loadu(const double* from) { return Vec(wasm_v128_load(from)); }
    static HWY_INLINE Vec lane_numbers() { return Vec(wasm_f64x2_make(0, 1)); }
    HWY_INLINE void store(double* to) const { wasm_v128_store(to, raw); }
    HWY_INLINE void storeu(double* to) const { wasm_v128_store(to, raw); }
};

HWY_INLINE Vec<double> operator+(Vec<double> a, Vec<double> b)
{
    return Vec<double>(wasm_f64x2_add(a.raw, b.raw));
}
HWY_INLINE Vec<double> operator-(Vec<double> a, Vec<double> b)
{
    return Vec<double>(wasm_f64x2_sub(a.raw, b.raw));
}
HWY_INLINE Vec<double> operator*(Vec<double> a, Vec<double> b)
{
    return Vec<double>(wasm_f64x2_mul(a.raw, b.raw));
}
HWY_INLINE Vec<double> operator/(Vec<double> a, Vec<double> b)
{
    return Vec<double>(wasm_f64x2_div(a.raw, b.raw));
}
HWY_INLINE Mask<double> operator<(Vec<double> a, Vec<double> b)
{
    return {wasm_f64x2_lt(a.raw, b.raw)};
}
HWY_INLINE Mask<double> operator<=(Vec<double> a, Vec<double> b)
{
    return {wasm_f64x2_le(a.raw, b.raw)};
}
HWY_INLINE Vec<double> min(Vec<double> a, Vec<double> b)
{
    return Vec<double>(wasm_f64x2_min(a.raw, b.raw));
}
HWY_INLINE Vec<double> max(Vec<double> a, Vec<double> b)
{
    return Vec<double>(wasm_f64x2_max(a.raw, b.raw));
}
HWY_INLINE Vec<double> abs(Vec<double> a)
{
    return Vec<double>(wasm_f64x2_abs(a.raw));
}
HWY_INLINE Vec<double> sqrt(Vec<double> a)
{
    return Vec<double>(wasm_f64x2_sqrt(a.raw));
}
HWY_INLINE double min_lane(Vec<double> a)
{
    const double low = wasm_f64x2_extract_lane(a.raw, 0), high = wasm_f64x2_extract_lane(a.raw, 1);
    return high < low ? high : low;
}
HWY_INLINE double max_lane(Vec<double> a)
{
    const double low = wasm_f64x2_extract_lane(a.raw, 0), high = wasm_f64x2_extract_lane(a.raw, 1);
    return high > low ? high : low;
}
HWY_INLINE Vec<double> choose(Mask<double> mask, Vec<double> yes, Vec<double> no)
{
    return Vec<double>(wasm_v128_bitselect(yes.raw, no.raw, mask.raw));
}

HWY_INLINE Mask<double> operator&(Mask<double> a, Mask<double> b)
{
    return {wasm_v128_and(a.raw, b.raw)};
}
HWY_INLINE Mask<double> operator|(Mask<double> a, Mask<double> b)
{
    return {wasm_v128_or(a.raw, b.raw)};
}
HWY_INLINE unsigned mask_bits(Mask<double> mask)
{
    return static_cast<unsigned>(wasm_i64x2_bitmask(mask.raw));
}
HWY_INLINE bool any(Mask<double> mask)
{
    return mask_bits(mask) != 0;
}
HWY_INLINE bool all(Mask<double> mask)
{
    return mask_bits(mask) == 3;
}
