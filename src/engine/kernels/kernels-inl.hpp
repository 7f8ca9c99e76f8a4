// SPDX-License-Identifier: MIT
// The hot loops, written once and compiled once per instruction set: kernels.cpp includes this file inside a
// namespace and target region of each. The plain loops are for the compiler to vectorise; the sweep comes in
// three forms, by what the instruction set is good at. No include guard, on purpose.

/// ---- From boxes to records
/// ------------------------------------------------------------------------------------------

template <int Dim, class T>
void quantise(const Grid<T>& grid, Unit<T>& unit)
{
    std::int32_t cell[3][unit_size], span[3][unit_size];
    std::uint32_t word[3][unit_size], kind[unit_size], flags[unit_size];
    const std::uint32_t count = unit.count;
    std::uint32_t bad = 0;

    for (int p = 0; p < Dim; ++p) {
        const int axis = grid.axis[p];
        const T origin = grid.origin[p], scale = grid.scale[p], last = grid.last[p];
        const T* __restrict lo = unit.lo[axis];
        const T* __restrict hi = unit.hi[axis];
        const std::uint32_t* __restrict object = unit.object;
        const std::uint32_t copy = copy_flag(axis);
        std::int32_t* __restrict quantum_lo = unit.quantum_lo[p];
        std::int32_t* __restrict quantum_hi = unit.quantum_hi[p];
        std::int32_t* __restrict cell_p = cell[p];
        std::int32_t* __restrict span_p = span[p];
        std::uint32_t* __restrict word_p = word[p];
        for (std::uint32_t i = 0; i < count; ++i) {
            bad |= static_cast<std::uint32_t>(!(lo[i] <= hi[i]));
            T a = (lo[i] - origin) * scale;
            T b = (hi[i] - origin) * scale;
            a = a > 0 ? a : T(0); // also where it is NaN
            b = b > 0 ? b : T(0);
            a = a < last ? a : last;
            b = b < last ? b : last;
            const bool copied = (object[i] & copy) != 0;
            const std::int32_t q = copied ? 0 : static_cast<std::int32_t>(a);
            const std::int32_t h = static_cast<std::int32_t>(b);
            const std::int32_t c = q >> quanta_bits;
            const std::int32_t local_hi = h - (c << quanta_bits);
            quantum_lo[i] = q;
            quantum_hi[i] = h;
            cell_p[i] = c;
            span_p[i] = (h >> quanta_bits) - c;
            word_p[i] = pack_axis(copied ? 0 : -((q & (quanta - 1)) + 1),
                                  (local_hi < quanta ? local_hi : quanta) + 1);
        }
    }
    unit.bad = bad != 0;

    // kind: bits 0 and 1 say that a copy belongs into the next brick on the second and third axis; 4: more
    // than that.
    const std::int32_t cells_x = grid.cells[0], cells_y = grid.cells[1];
    for (std::uint32_t i = 0; i < count; ++i) {
        std::int32_t brick = cell[0][i] + cells_x * cell[1][i];
        std::uint32_t wide =
            static_cast<std::uint32_t>(span[0][i] != 0) | static_cast<std::uint32_t>(span[1][i] > 1);
        std::uint32_t next = static_cast<std::uint32_t>(span[1][i] == 1);
        if constexpr (Dim == 3) {
            brick += cells_x * cells_y * cell[2][i];
            wide |= static_cast<std::uint32_t>(span[2][i] > 1);
            next |= static_cast<std::uint32_t>(span[2][i] == 1) << 1;
        } else {
            word[2][i] = 0;
        }
        unit.brick[i] = static_cast<std::uint32_t>(brick);
        kind[i] = wide ? 4 : next;
        flags[i] = unit.object[i];
    }
    for (std::uint32_t i = 0; i < count; ++i)
        unit.record[i] = {{word[0][i], word[1][i], word[2][i]}, flags[i]};

    std::uint16_t y_box[unit_size], z_box[unit_size], yz_box[unit_size];
    std::uint32_t ys = 0, zs = 0, yzs = 0, wides = 0;
    for (std::uint32_t i = 0; i < count; ++i) { // about one in three is listed, at random: no branches
        const std::uint16_t box = static_cast<std::uint16_t>(i);
        y_box[ys] = box;
        ys += kind[i] & 1;
        if constexpr (Dim == 3) {
            z_box[zs] = box;
            zs += (kind[i] >> 1) & 1;
            yz_box[yzs] = box;
            yzs += (kind[i] & (kind[i] >> 1)) & 1;
        }
        unit.wide_box[wides] = box;
        wides += kind[i] >> 2;
    }
    unit.wide = wides;

    std::uint32_t records = count;
    const auto next_word = [&](int p, std::uint32_t i) {
        const std::int32_t local_hi = unit.quantum_hi[p][i] - ((cell[p][i] + 1) << quanta_bits);
        return pack_axis(0, local_hi + 1); // ends in the next brick: local_hi < quanta
    };
    const std::uint32_t step_y = static_cast<std::uint32_t>(cells_x);
    const std::uint32_t step_z = static_cast<std::uint32_t>(cells_x * cells_y);
    for (std::uint32_t k = 0; k < ys; ++k, ++records) {
        const std::uint32_t i = y_box[k];
        unit.record[records] = {{word[0][i], next_word(1, i), word[2][i]},
                                flags[i] | copy_flag(grid.axis[1])};
        unit.brick[records] = unit.brick[i] + step_y;
    }
    for (std::uint32_t k = 0; k < zs; ++k, ++records) {
        const std::uint32_t i = z_box[k];
        unit.record[records] = {{word[0][i], word[1][i], next_word(2, i)},
                                flags[i] | copy_flag(grid.axis[2])};
        unit.brick[records] = unit.brick[i] + step_z;
    }
    for (std::uint32_t k = 0; k < yzs; ++k, ++records) {
        const std::uint32_t i = yz_box[k];
        unit.record[records] = {{word[0][i], next_word(1, i), next_word(2, i)},
                                flags[i] | copy_flag(grid.axis[1]) | copy_flag(grid.axis[2])};
        unit.brick[records] = unit.brick[i] + step_y + step_z;
    }
    unit.records = records;
}

/// ---- The sweep
/// ------------------------------------------------------------------------------------------------------
// A record's window holds every record behind it that may begin before it ends. Two rows share each block of
// candidates. Before the first row's successor a block is masked; behind a window's end no mask is needed,
// since those records begin later and fail the test on the sweep axis by themselves.

inline void defer_ties(PairOutput& out, unsigned ties, const std::uint32_t* candidates, std::uint32_t row)
{
    for (; ties != 0; ties &= ties - 1)
        out.ties[out.tie_count++] = {row, candidates[std::countr_zero(ties)] & object_mask};
}

#if JOSTLE_KERNEL_WIDE

// AVX-512: one 32-bit word per axis, both differences of a candidate in one lane; compress in registers.

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

inline Pair* emit(Pair* out, __mmask16 hits, __m512i candidates, __m512i row)
{
    const __m512i first_half = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const __m512i other_half =
        _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    const __m512i index = _mm512_set1_epi32(static_cast<int>(index_mask));
    const __m512i others = _mm512_and_si512(_mm512_maskz_compress_epi32(hits, candidates),
                                            _mm512_set1_epi32(static_cast<int>(object_mask)));
    const __m512i a = _mm512_min_epu32(others, row), b = _mm512_max_epu32(others, row);
    const unsigned count = static_cast<unsigned>(std::popcount(static_cast<unsigned>(hits)));
    _mm512_storeu_si512(out, _mm512_and_si512(_mm512_permutex2var_epi32(a, first_half, b), index));
    if (count > 8)
        _mm512_storeu_si512(out + 8, _mm512_and_si512(_mm512_permutex2var_epi32(a, other_half, b), index));
    return out + count;
}

template <int Dim>
std::uint64_t sweep(const SortedBrick& brick, std::uint32_t first, std::uint32_t last, PairOutput& out)
{
    const Columns column(brick);
    const __m512i signs = _mm512_set1_epi32(static_cast<int>(0x80008000u));
    const __m512i ones = _mm512_set1_epi16(1);
    const __m512i all_flags = _mm512_set1_epi32(static_cast<int>(~index_mask));
    std::uint64_t blocks = 0;

    for (std::uint32_t i = first; i < last; i += 2) {
        const __m512i x0 = _mm512_rol_epi32(_mm512_set1_epi32(static_cast<int>(column.x[i])), 16);
        const __m512i y0 = _mm512_rol_epi32(_mm512_set1_epi32(static_cast<int>(column.y[i])), 16);
        const __m512i z0 = _mm512_rol_epi32(_mm512_set1_epi32(static_cast<int>(column.z[i])), 16);
        const __m512i x1 = _mm512_rol_epi32(_mm512_set1_epi32(static_cast<int>(column.x[i + 1])), 16);
        const __m512i y1 = _mm512_rol_epi32(_mm512_set1_epi32(static_cast<int>(column.y[i + 1])), 16);
        const __m512i z1 = _mm512_rol_epi32(_mm512_set1_epi32(static_cast<int>(column.z[i + 1])), 16);
        const std::uint32_t object0 = column.object[i], object1 = column.object[i + 1];
        const __m512i row0 = _mm512_set1_epi32(static_cast<int>(object0 & object_mask));
        const __m512i row1 = _mm512_set1_epi32(static_cast<int>(object1 & object_mask));
        const __m512i flags0 = _mm512_and_si512(_mm512_set1_epi32(static_cast<int>(object0)), all_flags);
        const __m512i flags1 = _mm512_and_si512(_mm512_set1_epi32(static_cast<int>(object1)), all_flags);

        std::uint32_t j = (i + 1) & ~3u;
        __mmask16 behind0 = static_cast<__mmask16>(0xffffu << (i + 1 - j));
        __mmask16 behind1 = static_cast<__mmask16>(0xffffu << (i + 2 - j));
        const std::uint32_t end = std::max(brick.window_end[i], brick.window_end[i + 1]);

        while (j < end) {
            if (out.end - out.next < sweep_room || out.tie_count > tie_capacity - sweep_room) {
                if (!out.make_room(out)) return blocks;
            }
            const std::uint32_t stop = std::min(end, j + sweep_segment * block_size);
            blocks += (stop - j + block_size - 1) / block_size;
            Pair* next = out.next;
            for (; j < stop; j += block_size) {
                const __m512i x = _mm512_loadu_si512(column.x + j);
                const __m512i y = _mm512_loadu_si512(column.y + j);
                const __m512i objects = _mm512_loadu_si512(column.object + j);
                __m512i gap0 = _mm512_min_epi16(_mm512_add_epi16(x, x0), _mm512_add_epi16(y, y0));
                __m512i gap1 = _mm512_min_epi16(_mm512_add_epi16(x, x1), _mm512_add_epi16(y, y1));
                if constexpr (Dim == 3) {
                    const __m512i z = _mm512_loadu_si512(column.z + j);
                    gap0 = _mm512_min_epi16(gap0, _mm512_add_epi16(z, z0));
                    gap1 = _mm512_min_epi16(gap1, _mm512_add_epi16(z, z1));
                }
                __mmask16 hits0 = _mm512_mask_testn_epi32_mask(behind0, gap0, signs);
                __mmask16 hits1 = _mm512_mask_testn_epi32_mask(behind1, gap1, signs);
                hits0 = _mm512_mask_testn_epi32_mask(hits0, objects, flags0);
                hits1 = _mm512_mask_testn_epi32_mask(hits1, objects, flags1);
                const __mmask16 sure0 =
                    _mm512_mask_testn_epi32_mask(hits0, _mm512_sub_epi16(gap0, ones), signs);
                const __mmask16 sure1 =
                    _mm512_mask_testn_epi32_mask(hits1, _mm512_sub_epi16(gap1, ones), signs);
                behind0 = behind1 = 0xffff;
                next = emit(next, sure0, objects, row0);
                next = emit(next, sure1, objects, row1);
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
    return blocks;
}

#else
#if JOSTLE_KERNEL_SCALAR

// Plain C++: four 16-bit lanes in a 64-bit word. With bit 15 of each lane of the minuend set, no borrow
// leaves a lane, and the bit survives where the minuend's lane is not the smaller one.

struct Columns
{
    static constexpr std::uint64_t guard = 0x8000800080008000u, one = 0x0001000100010001u;
    std::uint32_t* object;
    std::uint64_t* hi[3];
    std::uint64_t* lo[3]; // not negated
    std::uint64_t* flags;
    explicit Columns(const SortedBrick& brick)
    {
        const std::uint32_t stride = padded(brick.count);
        object = brick.columns;
        auto* words = reinterpret_cast<std::uint64_t*>(object + stride);
        for (int p = 0; p < 3; ++p, words += 2 * (stride / 4)) {
            hi[p] = words;
            lo[p] = words + stride / 4;
        }
        flags = words;
    }
};
static_assert(columns_per_record * 4 >= 4 + 7 * 2);

inline std::uint64_t all_lanes(std::uint32_t value)
{
    return value * Columns::one;
}
inline std::uint32_t lane(const std::uint64_t* column, std::uint32_t i)
{
    return static_cast<std::uint32_t>(column[i / 4] >> (16 * (i % 4))) & 0xffff;
}

inline void arrange(const Record* records, SortedBrick& brick)
{
    const Columns to(brick);
    const std::uint32_t size = padded(brick.count);
    for (std::uint32_t word = 0; word < size / 4; ++word) {
        std::uint64_t hi[3] = {}, lo[3] = {}, flags = 0;
        for (std::uint32_t k = 4; k-- > 0;) {
            const std::uint32_t i = word * 4 + k;
            const Record& record = records[i];
            for (int p = 0; p < 3; ++p) {
                // A padding's lo becomes 0x7fff, above every hi: that alone keeps it from overlapping.
                hi[p] = (hi[p] << 16) | (i < brick.count ? record.axis[p] & 0xffff : 0);
                lo[p] = (lo[p] << 16) | (i < brick.count ? (0u - (record.axis[p] >> 16)) & 0xffff : 0x7fff);
            }
            flags = (flags << 16) | (record.object >> index_bits);
            to.object[i] = record.object;
        }
        for (int p = 0; p < 3; ++p) {
            to.hi[p][word] = hi[p];
            to.lo[p][word] = lo[p];
        }
        to.flags[word] = flags;
    }
}

/// Bit 15 of each lane as bits 0 to 3: the multiplication moves lane k's bit to bit 48 + k.
inline unsigned lane_bits(std::uint64_t lanes)
{
    return static_cast<unsigned>((((lanes & Columns::guard) >> 15) * 0x0001000200040008u) >> 48) & 0xf;
}

/// The tests of one row against a block of 16, as bit masks of candidates: `sure`, and `ties` the numbers
/// must decide.
template <int Dim>
struct Row
{
    std::uint64_t hi_guarded[3], lo[3], flags;
    Row(const Columns& column, std::uint32_t i) : flags(all_lanes(lane(column.flags, i)))
    {
        for (int p = 0; p < Dim; ++p) {
            hi_guarded[p] = all_lanes(lane(column.hi[p], i)) | Columns::guard;
            lo[p] = all_lanes(lane(column.lo[p], i));
        }
    }
    void test(const Columns& column, std::uint32_t j, unsigned behind, unsigned& sure, unsigned& ties) const
    {
        std::uint64_t reach[4];
        for (std::uint32_t k = 0; k < 4; ++k) {
            const std::uint32_t word = j / 4 + k;
            reach[k] = Columns::guard - (column.flags[word] & flags); // the bit stays where no flag is shared
            for (int p = 0; p < Dim; ++p)
                reach[k] &=
                    ((column.hi[p][word] | Columns::guard) - lo[p]) & (hi_guarded[p] - column.lo[p][word]);
        }
        sure = ties = 0;
        if (((reach[0] | reach[1] | reach[2] | reach[3]) & Columns::guard) == 0) return;
        unsigned hits = 0;
        for (std::uint32_t k = 0; k < 4; ++k) {
            const std::uint32_t word = j / 4 + k;
            hits |= lane_bits(reach[k]) << (4 * k);
            // Surely: even a quantum less would reach. (hi >= 1, so the guard bit is not borrowed from.)
            for (int p = 0; p < Dim; ++p)
                reach[k] &= ((column.hi[p][word] | Columns::guard) - lo[p] - Columns::one) &
                            (hi_guarded[p] - column.lo[p][word] - Columns::one);
            sure |= lane_bits(reach[k]) << (4 * k);
        }
        sure &= behind;
        ties = hits & behind & ~sure;
    }
};

inline Pair* emit(Pair* out, unsigned hits, const std::uint32_t* candidates, std::uint32_t row)
{
    for (; hits != 0; hits &= hits - 1) {
        const std::uint32_t other = candidates[std::countr_zero(hits)] & object_mask;
        *out++ = {std::min(row, other) & index_mask, std::max(row, other) & index_mask};
    }
    return out;
}

#else

// 16-bit columns: hi and negated lo of each axis, and the flags. Twice the candidates per register; masks
// cost more.

struct Columns
{
    std::int16_t* hi[3];
    std::int16_t* lo[3];
    std::uint16_t* flags;
    std::uint32_t* object;
    explicit Columns(const SortedBrick& brick)
    {
        const std::uint32_t stride = padded(brick.count);
        object = brick.columns;
        auto* narrow = reinterpret_cast<std::int16_t*>(object + stride);
        for (int p = 0; p < 3; ++p, narrow += 2 * stride) {
            hi[p] = narrow;
            lo[p] = narrow + stride;
        }
        flags = reinterpret_cast<std::uint16_t*>(narrow);
    }
};
static_assert(columns_per_record * 4 >= 4 + 7 * 2);

inline void arrange(const Record* __restrict records, SortedBrick& brick)
{
    const Columns to(brick);
    const std::uint32_t size = padded(brick.count);
    for (int p = 0; p < 3; ++p) {
        std::int16_t* __restrict hi = to.hi[p];
        std::int16_t* __restrict lo = to.lo[p];
        for (std::uint32_t i = 0; i < size; ++i) {
            hi[i] = static_cast<std::int16_t>(records[i].axis[p] & 0xffff);
            lo[i] = static_cast<std::int16_t>(records[i].axis[p] >> 16);
        }
    }
    for (std::uint32_t i = 0; i < size; ++i) {
        to.object[i] = records[i].object;
        to.flags[i] = static_cast<std::uint16_t>((records[i].object & ~index_mask) >> 16);
    }
}

template <int Dim>
struct Row
{
    using D = hn::CappedTag<std::int16_t, block_size>;
    using V = hn::Vec<D>;
    V hi[3], lo[3], flags;

    HWY_ATTR Row(const Columns& column, std::uint32_t i)
    {
        const D d;
        for (int p = 0; p < Dim; ++p) {
            hi[p] = hn::Set(d, column.hi[p][i]);
            lo[p] = hn::Set(d, column.lo[p][i]);
        }
        flags = hn::Set(d, static_cast<std::int16_t>(column.flags[i]));
    }
    HWY_ATTR HWY_INLINE void test(const Columns& column, std::uint32_t j, unsigned behind, unsigned& sure,
                                  unsigned& ties) const
    {
        const D d;
        const auto zero = hn::Zero(d), minus_one = hn::Set(d, std::int16_t{-1});
        constexpr std::uint32_t lanes = JOSTLE_KERNEL_LANES16;
        std::uint8_t hit_bits[8] = {}, sure_bits[8] = {};
        for (std::uint32_t k = 0; k < block_size; k += lanes) {
            V gap = hn::Min(hn::Add(hn::LoadU(d, column.hi[0] + j + k), lo[0]),
                            hn::Add(hn::LoadU(d, column.lo[0] + j + k), hi[0]));
            for (int p = 1; p < Dim; ++p) {
                gap = hn::Min(gap, hn::Add(hn::LoadU(d, column.hi[p] + j + k), lo[p]));
                gap = hn::Min(gap, hn::Add(hn::LoadU(d, column.lo[p] + j + k), hi[p]));
            }
            const auto shared =
                hn::And(hn::LoadU(d, reinterpret_cast<const std::int16_t*>(column.flags) + j + k), flags);
            const auto own = hn::Eq(shared, zero);
            hn::StoreMaskBits(d, hn::And(own, hn::Gt(gap, zero)), sure_bits + k / 8);
            hn::StoreMaskBits(d, hn::And(own, hn::Gt(gap, minus_one)), hit_bits + k / 8);
        }
        sure = (sure_bits[0] | (static_cast<unsigned>(sure_bits[1]) << 8)) & behind;
        ties = (hit_bits[0] | (static_cast<unsigned>(hit_bits[1]) << 8)) & behind & ~sure;
    }
};

HWY_ATTR HWY_INLINE Pair* emit(Pair* out, unsigned hits, const std::uint32_t* candidates,
                               std::uint32_t row_object)
{
    using D = hn::CappedTag<std::uint32_t, 8>;
    const D d;
    constexpr std::uint32_t lanes = JOSTLE_KERNEL_LANES32;
    const auto row = hn::Set(d, row_object);
    const auto object = hn::Set(d, object_mask);
    const auto index = hn::Set(d, index_mask);
    for (std::uint32_t k = 0; k < block_size; k += lanes) {
        const unsigned part = (hits >> k) & ((1u << lanes) - 1);
        const unsigned count = static_cast<unsigned>(std::popcount(part));
        const auto order =
            hn::PromoteTo(d, hn::LoadU(hn::Rebind<std::uint8_t, D>(), compress_order.of8[part]));
        const auto others =
            hn::And(hn::TableLookupLanes(hn::LoadU(d, candidates + k), hn::IndicesFromVec(d, order)), object);
        const auto a = hn::And(hn::Min(others, row), index);
        const auto b = hn::And(hn::Max(others, row), index);
        const auto low = hn::InterleaveLower(d, a, b), high = hn::InterleaveUpper(d, a, b);
        auto* words = reinterpret_cast<std::uint32_t*>(out);
#if JOSTLE_KERNEL_LANES32 == 8
        hn::StoreU(hn::ConcatLowerLower(d, high, low), d, words);
        if (count > 4) hn::StoreU(hn::ConcatUpperUpper(d, high, low), d, words + 8);
#else
        hn::StoreU(low, d, words);
        hn::StoreU(high, d, words + 4);
#endif
        out += count;
    }
    return out;
}

#endif

template <int Dim>
HWY_ATTR std::uint64_t sweep(const SortedBrick& brick, std::uint32_t first, std::uint32_t last,
                             PairOutput& out)
{
    const Columns column(brick);
    std::uint64_t blocks = 0;
    for (std::uint32_t i = first; i < last; i += 2) {
        const Row<Dim> row0(column, i), row1(column, i + 1);
        const std::uint32_t object0 = column.object[i] & object_mask,
                            object1 = column.object[i + 1] & object_mask;
        std::uint32_t j = (i + 1) & ~3u;
        unsigned behind0 = (0xffffu << (i + 1 - j)) & 0xffffu;
        unsigned behind1 = (0xffffu << (i + 2 - j)) & 0xffffu;
        const std::uint32_t end = std::max(brick.window_end[i], brick.window_end[i + 1]);

        while (j < end) {
            if (out.end - out.next < sweep_room || out.tie_count > tie_capacity - sweep_room) {
                if (!out.make_room(out)) return blocks;
            }
            const std::uint32_t stop = std::min(end, j + sweep_segment * block_size);
            blocks += (stop - j + block_size - 1) / block_size;
            Pair* next = out.next;
            for (; j < stop; j += block_size) {
                unsigned sure0, sure1, ties0, ties1;
                row0.test(column, j, behind0, sure0, ties0);
                row1.test(column, j, behind1, sure1, ties1);
                behind0 = behind1 = 0xffff;
                if ((sure0 | sure1) != 0) { // about every other time: one branch to guess, not two
                    next = emit(next, sure0, column.object + j, object0);
                    next = emit(next, sure1, column.object + j, object1);
                }
                if (__builtin_expect((ties0 | ties1) != 0, 0)) {
                    defer_ties(out, ties0, column.object + j, object0);
                    defer_ties(out, ties1, column.object + j, object1);
                }
            }
            out.next = next;
        }
    }
    return blocks;
}

#endif

inline const Kernels& kernels()
{
    static constexpr Kernels table = {JOSTLE_KERNEL_SET,
                                      quantise<2, float>,
                                      quantise<2, double>,
                                      quantise<3, float>,
                                      quantise<3, double>,
                                      arrange,
                                      sweep<2>,
                                      sweep<3>};
    return table;
}
