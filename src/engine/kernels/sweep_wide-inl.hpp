// SPDX-License-Identifier: MIT
// The sweep with AVX-512. It uses intrinsics, since Highway's types would need a cast at every step, and the
// form for shorter vectors, compiled for AVX-512, takes 1.35 to 1.55 times as long (docs/decisions/005).
// kernels.hpp describes what all forms of the sweep do. No include guard: kernels.cpp includes it once.
//
// A candidate is one 32-bit lane. Its word for an axis is rotated by 16 bits, so that its low half meets the
// row's low half and one addition gives both differences:
//
//     row i                  -(lo_i + 1) | hi_i + 1
//     candidate j, rotated     hi_j + 1  | -(lo_j + 1)
//     sum                    hi_j - lo_i | hi_i - lo_j      below 0: apart; 0: a tie; above 0: they overlap
//
// The least over the axes decides, in both halves; test instructions turn signs into masks, and compress
// instructions turn masks into pairs.

/// One column for each word of a record.
struct Columns
{
    std::uint32_t *x, *y, *z, *object;
    explicit Columns(const SortedBrick& brick)
    {
        const std::uint32_t stride = padded(brick.count);
        x = brick.columns;
        y = x + stride;
        z = y + stride;
        object = z + stride;
    }
};

inline void arrange(const Record* records, SortedBrick& brick)
{
    const Columns to(brick);
    const std::uint32_t size = padded(brick.count);
    // 4 x 4 words a register: gather each column's words, then pick the quarters.
    const __m512i transpose = _mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
    for (std::uint32_t i = 0; i < size; i += 16) {
        const __m512i r0 = _mm512_permutexvar_epi32(transpose, _mm512_loadu_si512(records + i));
        const __m512i r1 = _mm512_permutexvar_epi32(transpose, _mm512_loadu_si512(records + i + 4));
        const __m512i r2 = _mm512_permutexvar_epi32(transpose, _mm512_loadu_si512(records + i + 8));
        const __m512i r3 = _mm512_permutexvar_epi32(transpose, _mm512_loadu_si512(records + i + 12));
        const __m512i xy01 = _mm512_shuffle_i32x4(r0, r1, 0x44), zo01 = _mm512_shuffle_i32x4(r0, r1, 0xee);
        const __m512i xy23 = _mm512_shuffle_i32x4(r2, r3, 0x44), zo23 = _mm512_shuffle_i32x4(r2, r3, 0xee);
        _mm512_store_si512(to.x + i, _mm512_shuffle_i32x4(xy01, xy23, 0x88));
        _mm512_store_si512(to.y + i, _mm512_shuffle_i32x4(xy01, xy23, 0xdd));
        _mm512_store_si512(to.z + i, _mm512_shuffle_i32x4(zo01, zo23, 0x88));
        _mm512_store_si512(to.object + i, _mm512_shuffle_i32x4(zo01, zo23, 0xdd));
    }
}

/// Writes the pairs of two rows with the candidates of one step, the first row's first.
inline Pair* emit(Pair* out, __m512i candidates, __mmask16 hits0, __m512i row0, __mmask16 hits1, __m512i row1)
{
    const __m512i first_half = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const __m512i other_half =
        _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    const __m512i index = _mm512_set1_epi32(static_cast<int>(index_mask));
    const unsigned count0 = static_cast<unsigned>(std::popcount(static_cast<unsigned>(hits0)));
    const unsigned count = count0 + static_cast<unsigned>(std::popcount(static_cast<unsigned>(hits1)));
    const auto store = [&](Pair* to, __m512i others, __m512i rows, unsigned pairs) HWY_ATTR {
        others = _mm512_and_si512(others, _mm512_set1_epi32(static_cast<int>(object_mask)));
        const __m512i a = _mm512_min_epu32(others, rows), b = _mm512_max_epu32(others, rows);
        _mm512_storeu_si512(to, _mm512_and_si512(_mm512_permutex2var_epi32(a, first_half, b), index));
        if (pairs > 8)
            _mm512_storeu_si512(to + 8, _mm512_and_si512(_mm512_permutex2var_epi32(a, other_half, b), index));
    };
    const __m512i others0 = _mm512_maskz_compress_epi32(hits0, candidates);
    const __m512i others1 = _mm512_maskz_compress_epi32(hits1, candidates);
    if (__builtin_expect(count > 16, 0)) {
        store(out, others0, row0, count0);
        store(out + count0, others1, row1, count - count0);
    } else { // both rows' in one register: what is stored after `count` will be overwritten
        const __mmask16 second = static_cast<__mmask16>(0xffffu << count0);
        store(out, _mm512_mask_expand_epi32(others0, second, others1),
              _mm512_mask_mov_epi32(row0, second, row1), count);
    }
    return out + count;
}

template <int Dim>
std::uint64_t sweep(const SortedBrick& brick, std::uint32_t first, std::uint32_t last, PairOutput& out)
{
    const Columns column(brick);
    const __m512i signs = _mm512_set1_epi32(static_cast<int>(0x80008000u));
    const __m512i ones = _mm512_set1_epi16(1);
    const __m512i all_flags = _mm512_set1_epi32(static_cast<int>(~index_mask));
    const auto broadcast = [](std::uint32_t word)
                               HWY_ATTR { return _mm512_set1_epi32(static_cast<int>(word)); };
    std::uint64_t steps = 0;

    for (std::uint32_t i = first; i < last; i += 2) {
        std::uint32_t j = (i + 1) & ~3u;
        __mmask16 behind0 = static_cast<__mmask16>(0xffffu << (i + 1 - j));
        __mmask16 behind1 = static_cast<__mmask16>(0xffffu << (i + 2 - j));
        const std::uint32_t end = std::max(brick.window_end[i], brick.window_end[i + 1]);
        while (j < end) {
            if (out.end - out.next < sweep_room || out.tie_count > tie_capacity - sweep_room) {
                if (!out.make_room(out)) return steps;
            }
            const std::uint32_t stop = std::min(end, j + sweep_segment * step_size);
            steps += (stop - j + step_size - 1) / step_size;
            const __m512i x0 = broadcast(column.x[i]), x1 = broadcast(column.x[i + 1]);
            const __m512i y0 = broadcast(column.y[i]), y1 = broadcast(column.y[i + 1]);
            const __m512i z0 = broadcast(column.z[i]), z1 = broadcast(column.z[i + 1]);
            const std::uint32_t object0 = column.object[i], object1 = column.object[i + 1];
            const __m512i row0 = broadcast(object0 & object_mask), row1 = broadcast(object1 & object_mask);
            const __m512i flags0 = _mm512_and_si512(broadcast(object0), all_flags);
            const __m512i flags1 = _mm512_and_si512(broadcast(object1), all_flags);
            Pair* next = out.next;
            prefetch_to_write(next + 64);
            for (; j < stop; j += step_size) {
                const __m512i x = _mm512_rol_epi32(_mm512_loadu_si512(column.x + j), 16);
                const __m512i y = _mm512_rol_epi32(_mm512_loadu_si512(column.y + j), 16);
                const __m512i objects = _mm512_loadu_si512(column.object + j);
                __m512i gap0 = _mm512_min_epi16(_mm512_add_epi16(x, x0), _mm512_add_epi16(y, y0));
                __m512i gap1 = _mm512_min_epi16(_mm512_add_epi16(x, x1), _mm512_add_epi16(y, y1));
                if constexpr (Dim == 3) {
                    const __m512i z = _mm512_rol_epi32(_mm512_loadu_si512(column.z + j), 16);
                    gap0 = _mm512_min_epi16(gap0, _mm512_add_epi16(z, z0));
                    gap1 = _mm512_min_epi16(gap1, _mm512_add_epi16(z, z1));
                }
                // Neither half below zero, so they touch; no flag shared, so this brick owns the
                // pair (record.hpp).
                __mmask16 hits0 = _mm512_mask_testn_epi32_mask(behind0, gap0, signs);
                __mmask16 hits1 = _mm512_mask_testn_epi32_mask(behind1, gap1, signs);
                hits0 = _mm512_mask_testn_epi32_mask(hits0, objects, flags0);
                hits1 = _mm512_mask_testn_epi32_mask(hits1, objects, flags1);
                // Neither half zero either.
                const __mmask16 sure0 =
                    _mm512_mask_testn_epi32_mask(hits0, _mm512_sub_epi16(gap0, ones), signs);
                const __mmask16 sure1 =
                    _mm512_mask_testn_epi32_mask(hits1, _mm512_sub_epi16(gap1, ones), signs);
                behind0 = behind1 = 0xffff;
                next = emit(next, objects, sure0, row0, sure1, row1);
                if (__builtin_expect((hits0 ^ sure0) | (hits1 ^ sure1), 0)) {
                    defer_ties(out, static_cast<unsigned>(hits0 ^ sure0), column.object + j,
                               object0 & object_mask);
                    defer_ties(out, static_cast<unsigned>(hits1 ^ sure1), column.object + j,
                               object1 & object_mask);
                }
            }
            out.next = next;
        }
    }
    return steps;
}

template <int Dim>
void test(const SortedBrick& brick, std::uint32_t row, std::uint32_t first, std::uint32_t last,
          Outcome* outcomes)
{
    const Columns column(brick);
    const __m512i signs = _mm512_set1_epi32(static_cast<int>(0x80008000u));
    const __m512i ones = _mm512_set1_epi16(1);
    const auto broadcast = [](std::uint32_t word)
                               HWY_ATTR { return _mm512_set1_epi32(static_cast<int>(word)); };
    const __m512i x0 = broadcast(column.x[row]), y0 = broadcast(column.y[row]), z0 = broadcast(column.z[row]);
    const __m512i flags0 = broadcast(column.object[row] & ~index_mask);
    for (std::uint32_t j = first; j < last; j += step_size, ++outcomes) {
        const __m512i x = _mm512_rol_epi32(_mm512_loadu_si512(column.x + j), 16);
        const __m512i y = _mm512_rol_epi32(_mm512_loadu_si512(column.y + j), 16);
        __m512i gap = _mm512_min_epi16(_mm512_add_epi16(x, x0), _mm512_add_epi16(y, y0));
        if constexpr (Dim == 3) {
            const __m512i z = _mm512_rol_epi32(_mm512_loadu_si512(column.z + j), 16);
            gap = _mm512_min_epi16(gap, _mm512_add_epi16(z, z0));
        }
        __mmask16 hits = _mm512_testn_epi32_mask(gap, signs);
        hits = _mm512_mask_testn_epi32_mask(hits, _mm512_loadu_si512(column.object + j), flags0);
        const __mmask16 sure = _mm512_mask_testn_epi32_mask(hits, _mm512_sub_epi16(gap, ones), signs);
        *outcomes = {sure, static_cast<std::uint16_t>(hits ^ sure)};
    }
}
