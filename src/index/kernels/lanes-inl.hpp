// SPDX-License-Identifier: MIT
// Handles the lanes that passed a test: the nearest is chosen, or all are written contiguously. Compiled once
// per instruction set, see kernels.cpp.

/// Prefetches all cache lines of an item that will be read soon. It doesn't call `prefetch` for several bytes
/// in base/prefetch.hpp: g++ takes that for a function without effect, and in a function for another
/// instruction set it drops the call before inlining it. Calls that it inlines at once stay.
template <class Item>
HWY_ATTR HWY_INLINE void prefetch_item(const Item* item)
{
    for (std::size_t at = 0; at < sizeof(Item); at += cache_line)
        prefetch(reinterpret_cast<const std::byte*>(item) + at);
}

/// Calls write(k, lane) for the k-th of the set lanes. The first four calls are made without a branch,
/// however few lanes are set: excess calls write garbage after the last, so there must be room for 4 more.
template <class Write>
HWY_INLINE void each_lane(unsigned hits, const Write& write)
{
    unsigned rest = hits;
    for (unsigned k = 0; k < 4; ++k) {
        write(k, static_cast<unsigned>(std::countr_zero(rest | (1u << (lanes - 1)))));
        rest &= rest - 1;
    }
    for (unsigned k = 4; rest != 0; rest &= rest - 1)
        write(k++, static_cast<unsigned>(std::countr_zero(rest)));
}

#if !JOSTLE_SIMD_PLAIN && HWY_TARGET == HWY_AVX3
/// Writes (asker, id) for the ids in the set lanes, contiguously. It always writes 8 pairs, and 16 if more
/// than 8 lanes are set, so there must be room for those. A pair is two 32-bit numbers, the asker in the
/// lower half of a 64-bit one: the ids that compress packs are spread to 64 bits and moved up by 32.
HWY_ATTR HWY_INLINE void store_pairs(void* to, std::uint32_t asker, const std::uint32_t* ids, unsigned hits)
{
    const __m512i packed = _mm512_maskz_compress_epi32(static_cast<__mmask16>(hits), _mm512_load_si512(ids));
    const __m512i askers = _mm512_set1_epi64(asker);
    const auto pairs_of = [askers](__m256i half) HWY_ATTR {
        return _mm512_or_si512(_mm512_slli_epi64(_mm512_cvtepu32_epi64(half), 32), askers);
    };
    _mm512_storeu_si512(to, pairs_of(_mm512_castsi512_si256(packed)));
    if (std::popcount(hits) > 8)
        _mm512_storeu_si512(static_cast<std::uint64_t*>(to) + 8,
                            pairs_of(_mm512_extracti64x4_epi64(packed, 1)));
}
#endif

/// The least of `at`, which is infinite in the lanes not in `left`.
template <class T>
HWY_ATTR HWY_INLINE T nearest_of(const T* at)
{
    Vec<T> each = Vec<T>::load(at);
    for (std::uint32_t k = Vec<T>::size; k < lanes; k += Vec<T>::size)
        each = min(each, Vec<T>::load(at + k));
    return min_lane(each);
}

/// The lanes of `left` no further than that.
template <class T>
HWY_ATTR HWY_INLINE unsigned lanes_at(const T* at, T nearest, unsigned left)
{
    unsigned bits = 0;
    for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size)
        bits |= mask_bits(Vec<T>::load(at + k) <= Vec<T>(nearest)) << k;
    return bits & left;
}
