// SPDX-License-Identifier: MIT
// The vocabulary in which kernels are written: vectors of numbers, masks, and what can be done with them.
// Included once per instruction set, inside its namespace; see simd/targets.hpp. Over Highway where there is
// SIMD, else over plain numbers: simd/plain-inl.hpp has the same names, and the same bits come out. No
// include guard, on purpose.
//
//     Vec<float> x = Vec<float>::load(p);    // Vec<float>::size numbers
//     Mask<float> below = x < Vec<float>(1); // also <=, >, >=
//     x = choose(below, x * x, sqrt(x));     // where the mask is set, and elsewhere
//     if (any(below & (x < y))) ...          // also all, |, and mask_bits: lane 0 is the lowest bit
//     compress(n, mask_bits(below)).storeu(to); // of 32-bit integers: those of the lanes that are set
//     load_rows(rows, x, y, z);              // the columns of records of four floats, but the last
//     Four rows[4] = ...; transpose(rows);   // of four floats on every instruction set: records into columns
//
// Also min, max, abs, min_lane, max_lane, and Vec::lane_numbers(): 0, 1, 2, ... A min or max of a NaN, or of
// zeros of both signs, differs from one instruction set to another: use choose where that can happen.
//
// Every function has HWY_ATTR, and so must have what calls them, lambdas included: templates are instantiated
// at the end of the file, where the pragmas of another instruction set are in force.
#if JOSTLE_SIMD_PLAIN
#include "simd/plain-inl.hpp"
#else

namespace hn = hwy::HWY_NAMESPACE;

/// No more than 16 lanes: what the index tests at once.
template <class T>
using Tag = hn::CappedTag<T, 16>;

template <class T>
struct Mask
{
    hn::Mask<Tag<T>> raw;

    /// Always from one of Highway's, whose own constructor has the attributes of the instruction set.
    HWY_ATTR HWY_INLINE Mask(hn::Mask<Tag<T>> given) : raw(given) {}
};

template <class T>
struct Vec
{
    static constexpr std::uint32_t size = static_cast<std::uint32_t>(hn::MaxLanes(Tag<T>()));
    hn::Vec<Tag<T>> raw;

    Vec() = default;
    HWY_ATTR HWY_INLINE Vec(hn::Vec<Tag<T>> given) : raw(given) {}
    /// The same number in every lane.
    HWY_ATTR HWY_INLINE explicit Vec(T value) : raw(hn::Set(Tag<T>(), value)) {}
    /// From an address that is a multiple of the vector's size in bytes; loadu from any.
    static HWY_ATTR HWY_INLINE Vec load(const T* from) { return hn::Load(Tag<T>(), from); }
    static HWY_ATTR HWY_INLINE Vec loadu(const T* from) { return hn::LoadU(Tag<T>(), from); }
    static HWY_ATTR HWY_INLINE Vec lane_numbers() { return hn::Iota(Tag<T>(), T(0)); }
    HWY_ATTR HWY_INLINE void store(T* to) const { hn::Store(raw, Tag<T>(), to); }
    HWY_ATTR HWY_INLINE void storeu(T* to) const { hn::StoreU(raw, Tag<T>(), to); }
};

template <class T>
HWY_ATTR HWY_INLINE Vec<T> operator+(Vec<T> a, Vec<T> b)
{
    return hn::Add(a.raw, b.raw);
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> operator-(Vec<T> a, Vec<T> b)
{
    return hn::Sub(a.raw, b.raw);
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> operator*(Vec<T> a, Vec<T> b)
{
    return hn::Mul(a.raw, b.raw);
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> operator/(Vec<T> a, Vec<T> b)
{
    return hn::Div(a.raw, b.raw);
}
template <class T>
HWY_ATTR HWY_INLINE Mask<T> operator<(Vec<T> a, Vec<T> b)
{
    return {hn::Lt(a.raw, b.raw)};
}
template <class T>
HWY_ATTR HWY_INLINE Mask<T> operator<=(Vec<T> a, Vec<T> b)
{
    return {hn::Le(a.raw, b.raw)};
}
template <class T>
HWY_ATTR HWY_INLINE Mask<T> operator>(Vec<T> a, Vec<T> b)
{
    return b < a;
}
template <class T>
HWY_ATTR HWY_INLINE Mask<T> operator>=(Vec<T> a, Vec<T> b)
{
    return b <= a;
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> min(Vec<T> a, Vec<T> b)
{
    return hn::Min(a.raw, b.raw);
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> max(Vec<T> a, Vec<T> b)
{
    return hn::Max(a.raw, b.raw);
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> abs(Vec<T> a)
{
    return hn::Abs(a.raw);
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> sqrt(Vec<T> a)
{
    return hn::Sqrt(a.raw);
}
template <class T>
HWY_ATTR HWY_INLINE T min_lane(Vec<T> a)
{
    return hn::GetLane(hn::MinOfLanes(Tag<T>(), a.raw));
}
template <class T>
HWY_ATTR HWY_INLINE T max_lane(Vec<T> a)
{
    return hn::GetLane(hn::MaxOfLanes(Tag<T>(), a.raw));
}
template <class T>
HWY_ATTR HWY_INLINE Vec<T> choose(Mask<T> mask, Vec<T> yes, Vec<T> no)
{
    return hn::IfThenElse(mask.raw, yes.raw, no.raw);
}

template <class T>
HWY_ATTR HWY_INLINE Mask<T> operator&(Mask<T> a, Mask<T> b)
{
    return {hn::And(a.raw, b.raw)};
}
template <class T>
HWY_ATTR HWY_INLINE Mask<T> operator|(Mask<T> a, Mask<T> b)
{
    return {hn::Or(a.raw, b.raw)};
}
template <class T>
HWY_ATTR HWY_INLINE bool any(Mask<T> mask)
{
    return !hn::AllFalse(Tag<T>(), mask.raw);
}
template <class T>
HWY_ATTR HWY_INLINE bool all(Mask<T> mask)
{
    return hn::AllTrue(Tag<T>(), mask.raw);
}
/// The bits of the lanes that are set, lane 0 lowest.
template <class T>
HWY_ATTR HWY_INLINE unsigned mask_bits(Mask<T> mask)
{
#if HWY_TARGET == HWY_AVX3
    return static_cast<unsigned>(mask.raw.raw);
#elif HWY_TARGET == HWY_WASM // Highway goes through memory
    static_assert(sizeof(T) == 2 || sizeof(T) == 4); // doubles are in wasm_doubles-inl.hpp
    if constexpr (sizeof(T) == 2)
        return wasm_i16x8_bitmask(mask.raw.raw);
    else
        return wasm_i32x4_bitmask(mask.raw.raw);
#else
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(Tag<T>(), mask.raw, bytes);
    return bytes[0] | static_cast<unsigned>(bytes[1]) << 8;
#endif
}

/// The numbers of 32 bits in the lanes that are set, side by side at the front, in their order. What lies
/// behind them is of no use.
template <class T>
HWY_ATTR HWY_INLINE Vec<T> compress(Vec<T> all, unsigned bits)
{
    static_assert(sizeof(T) == 4);
#if HWY_TARGET == HWY_AVX3
    return hn::Vec<Tag<T>>{_mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), all.raw.raw)};
#elif HWY_TARGET == HWY_AVX2
    const hn::RebindToUnsigned<Tag<T>> d;
    const auto order = hn::PromoteTo(
        d, hn::LoadU(hn::Rebind<std::uint8_t, decltype(d)>(), jostle::compress_order.of8[bits]));
    return hn::TableLookupLanes(all.raw, hn::IndicesFromVec(Tag<T>(), order));
#elif HWY_TARGET == HWY_WASM
    // Highway looks bytes up one by one here, which made the sweep slower than one without vectors.
    return hn::Vec<Tag<T>>{wasm_i8x16_swizzle(all.raw.raw, wasm_v128_load(jostle::compress_order.of4[bits]))};
#else
    static_assert(Vec<T>::size == 4);
    const hn::Repartition<std::uint8_t, Tag<T>> bytes;
    return hn::BitCast(Tag<T>(), hn::TableLookupBytes(hn::BitCast(bytes, all.raw),
                                                      hn::Load(bytes, jostle::compress_order.of4[bits])));
#endif
}

/// The first three columns of as many rows of four floats as a vector has lanes, from any address.
HWY_ATTR HWY_INLINE void load_rows(const float (*rows)[4], Vec<float>& x, Vec<float>& y, Vec<float>& z)
{
    hn::Vec<Tag<float>> unread;
    hn::LoadInterleaved4(Tag<float>(), *rows, x.raw, y.raw, z.raw, unread);
}

/// Four floats on every instruction set, for records of four.
struct Four
{
    hn::Vec<hn::Full128<float>> raw;

    HWY_ATTR HWY_INLINE Four() {}
    HWY_ATTR HWY_INLINE Four(hn::Vec<hn::Full128<float>> given) : raw(given) {}
    static HWY_ATTR HWY_INLINE Four loadu(const float* from) { return hn::LoadU(hn::Full128<float>(), from); }
    HWY_ATTR HWY_INLINE void storeu(float* to) const { hn::StoreU(raw, hn::Full128<float>(), to); }
};
HWY_ATTR HWY_INLINE Four operator+(Four a, Four b)
{
    return hn::Add(a.raw, b.raw);
}
HWY_ATTR HWY_INLINE Four operator-(Four a, Four b)
{
    return hn::Sub(a.raw, b.raw);
}
/// Number j of row i becomes number i of row j.
HWY_ATTR HWY_INLINE void transpose(Four (&rows)[4])
{
    const hn::Full128<float> d;
    const auto low01 = hn::InterleaveLower(d, rows[0].raw, rows[1].raw),
               high01 = hn::InterleaveUpper(d, rows[0].raw, rows[1].raw),
               low23 = hn::InterleaveLower(d, rows[2].raw, rows[3].raw),
               high23 = hn::InterleaveUpper(d, rows[2].raw, rows[3].raw);
    // 64 bits at a time: two numbers of rows 0 and 1, then those of rows 2 and 3.
    rows[0].raw = hn::ConcatLowerLower(d, low23, low01);
    rows[1].raw = hn::ConcatUpperUpper(d, low23, low01);
    rows[2].raw = hn::ConcatLowerLower(d, high23, high01);
    rows[3].raw = hn::ConcatUpperUpper(d, high23, high01);
}
#if HWY_TARGET == HWY_WASM
#include "simd/wasm_doubles-inl.hpp"
#endif
#endif
