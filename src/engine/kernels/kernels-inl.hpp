// SPDX-License-Identifier: MIT
// The hot loops, written once and compiled once per instruction set: kernels.cpp includes this file inside a
// namespace and target region of each. The plain loops are for the compiler to vectorise; the rest is written in
// Highway, with a form in plain C++ for builds without it. Where intrinsics stand instead, it says what that
// brings (docs/decisions/005). The sweep comes in three forms, by what the instruction set is good at. No include
// guard, on purpose.

// --- From boxes to records ---

#if !JOSTLE_KERNEL_SCALAR

/// Four boxes of floats that lie one behind the other, as columns: lo of each axis, then hi.
template <int Dim>
HWY_ATTR inline void transpose(const float* boxes, float* const (&columns)[2 * Dim])
{
    const hn::CappedTag<float, 4> d;
    const hn::Repartition<double, decltype(d)> d2;
    // Each box's first four numbers and its last four, which share two of them in 3D.
    for (const int at : {0, 2 * Dim - 4}) {
        const auto r0 = hn::LoadU(d, boxes + at), r1 = hn::LoadU(d, boxes + at + 2 * Dim);
        const auto r2 = hn::LoadU(d, boxes + at + 4 * Dim), r3 = hn::LoadU(d, boxes + at + 6 * Dim);
        const auto low01 = hn::BitCast(d2, hn::InterleaveLower(d, r0, r1));
        const auto low23 = hn::BitCast(d2, hn::InterleaveLower(d, r2, r3));
        const auto high01 = hn::BitCast(d2, hn::InterleaveUpper(d, r0, r1));
        const auto high23 = hn::BitCast(d2, hn::InterleaveUpper(d, r2, r3));
        hn::StoreU(hn::BitCast(d, hn::InterleaveLower(d2, low01, low23)), d, columns[at]);
        hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(d2, low01, low23)), d, columns[at + 1]);
        hn::StoreU(hn::BitCast(d, hn::InterleaveLower(d2, high01, high23)), d, columns[at + 2]);
        hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(d2, high01, high23)), d, columns[at + 3]);
        if (2 * Dim == 4) break;
    }
}

#endif

/// Boxes [begin, begin + unit.count) into the unit's columns. Fetches those of the next unit meanwhile: past
/// the last box that is only a hint.
template <int Dim, class T>
void load(const BoxView<Dim, T>& boxes, std::size_t begin, Unit<T>& unit)
{
    const std::ptrdiff_t stride = boxes.stride_bytes();
    const char *lo[Dim], *hi[Dim];
    for (int d = 0; d < Dim; ++d) {
        lo[d] = reinterpret_cast<const char*>(boxes.lo_pointer(d, begin));
        hi[d] = reinterpret_cast<const char*>(boxes.hi_pointer(d, begin));
    }
    std::uint32_t i = 0;
#if !JOSTLE_KERNEL_SCALAR
    bool packed = stride == 2 * Dim * sizeof(T);
    for (int d = 0; d < Dim; ++d)
        packed &= lo[d] == lo[0] + static_cast<std::size_t>(d) * sizeof(T) &&
                  hi[d] == lo[0] + static_cast<std::size_t>(Dim + d) * sizeof(T);
    if constexpr (sizeof(T) == 4)
        if (packed) {
            const T* from = reinterpret_cast<const T*>(lo[0]);
            for (; i + 4 <= unit.count; i += 4) {
                T* columns[2 * Dim];
                for (int d = 0; d < Dim; ++d) {
                    columns[d] = unit.lo[d] + i;
                    columns[Dim + d] = unit.hi[d] + i;
                }
                for (std::uint32_t offset = 0; offset < 8 * Dim; offset += 64 / sizeof(T))
                    __builtin_prefetch(from + 2 * Dim * (i + unit_size) + offset);
                transpose<Dim>(from + 2 * Dim * i, columns);
            }
        }
#endif
    for (; i < unit.count; ++i) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) * stride;
        __builtin_prefetch(lo[0] + at + static_cast<std::ptrdiff_t>(unit_size) * stride);
        for (int d = 0; d < Dim; ++d) {
            unit.lo[d][i] = *reinterpret_cast<const T*>(lo[d] + at);
            unit.hi[d][i] = *reinterpret_cast<const T*>(hi[d] + at);
        }
    }
}

/// Boxes of a unit that have to be copied into the next brick on the second axis, the third, or both, and
/// those that take more than that.
struct CopyLists
{
    std::uint16_t y[unit_size], z[unit_size], yz[unit_size];
    std::uint32_t ys = 0, zs = 0, yzs = 0, wides = 0;
};

/// `kind`: bits 0 and 1 for the second and third axis, or 4 for wide; room for whole registers behind
/// `count`.
HWY_ATTR inline void list_copies(const std::uint16_t* kind, std::uint32_t count, CopyLists& lists,
                                 std::uint16_t* wide)
{
#if !JOSTLE_KERNEL_SCALAR
    const hn::CappedTag<std::uint16_t, 8> d;
    const hn::Rebind<std::uint8_t, decltype(d)> bytes;
    const auto list = [d, bytes](std::uint16_t* to, std::uint32_t& size, unsigned listed,
                                 std::uint32_t first) HWY_ATTR {
        const auto numbers = hn::PromoteTo(d, hn::LoadU(bytes, compress_order.of8[listed]));
        hn::StoreU(hn::Add(numbers, hn::Set(d, static_cast<std::uint16_t>(first))), d, to + size);
        size += static_cast<std::uint32_t>(std::popcount(listed));
    };
    for (std::uint32_t i = 0; i < count; i += 8) {
        const unsigned valid = count - i >= 8 ? 0xff : (1u << (count - i)) - 1;
        const auto kinds = hn::LoadU(d, kind + i);
        const auto of = [d, kinds, valid](std::uint16_t bit) HWY_ATTR {
            std::uint8_t mask[8];
            hn::StoreMaskBits(d, hn::TestBit(kinds, hn::Set(d, bit)), mask);
            return mask[0] & valid;
        };
        const unsigned y = of(1), z = of(2), more = of(4);
        list(lists.y, lists.ys, y, i);
        list(lists.z, lists.zs, z, i);
        list(lists.yz, lists.yzs, y & z, i);
        if (more != 0) list(wide, lists.wides, more, i);
    }
#else
    for (std::uint32_t i = 0; i < count; ++i) { // about one in three is listed, at random: no branches
        const std::uint16_t box = static_cast<std::uint16_t>(i);
        lists.y[lists.ys] = box;
        lists.ys += kind[i] & 1u;
        lists.z[lists.zs] = box;
        lists.zs += (kind[i] >> 1) & 1u;
        lists.yz[lists.yzs] = box;
        lists.yzs += (kind[i] & (kind[i] >> 1)) & 1u;
        wide[lists.wides] = box;
        lists.wides += static_cast<std::uint32_t>(kind[i] >> 2);
    }
#endif
}

template <int Dim, class T>
void quantise(const Grid<T>& grid, Unit<T>& unit)
{
    std::int32_t cell[3][unit_size], span[3][unit_size];
    std::uint32_t word[3][unit_size], flags[unit_size];
    std::uint16_t kind[unit_size];
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
        // What follows from the quanta of both ends.
        const auto pack = [&](std::uint32_t i, std::int32_t q, std::int32_t h, bool copied) {
            const std::int32_t c = q >> quanta_bits;
            const std::int32_t local_hi = h - (c << quanta_bits);
            quantum_lo[i] = q;
            quantum_hi[i] = h;
            cell_p[i] = c;
            span_p[i] = (h >> quanta_bits) - c;
            word_p[i] = pack_axis(copied ? 0 : -((q & (quanta - 1)) + 1),
                                  (local_hi < quanta ? local_hi : quanta) + 1);
        };
        if (grid.flat[p]) {
            // At the origin an end is certainly behind a beginning; 0 and 0, 2 and 2 are told by the numbers.
            for (std::uint32_t i = 0; i < count; ++i) {
                bad |= static_cast<std::uint32_t>(!(lo[i] <= hi[i]));
                const bool copied = (object[i] & copy) != 0;
                pack(i, !copied && lo[i] > origin ? 2 : 0, hi[i] > origin ? 2 : (hi[i] == origin ? 1 : 0),
                     copied);
            }
            continue;
        }
        for (std::uint32_t i = 0; i < count; ++i) {
            bad |= static_cast<std::uint32_t>(!(lo[i] <= hi[i]));
            T a = (lo[i] - origin) * scale;
            T b = (hi[i] - origin) * scale;
            a = a > 0 ? a : T(0); // also where it is NaN
            b = b > 0 ? b : T(0);
            a = a < last ? a : last;
            b = b < last ? b : last;
            const bool copied = (object[i] & copy) != 0;
            pack(i, copied ? 0 : static_cast<std::int32_t>(a), static_cast<std::int32_t>(b), copied);
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
        kind[i] = static_cast<std::uint16_t>(wide ? 4 : next);
        flags[i] = unit.object[i];
    }
    for (std::uint32_t i = 0; i < count; ++i)
        unit.record[i] = {{word[0][i], word[1][i], word[2][i]}, flags[i]};

    CopyLists lists;
    list_copies(kind, count, lists, unit.wide_box);
    unit.wide = lists.wides;

    std::uint32_t records = count;
    const auto next_word = [&](int p, std::uint32_t i) {
        const std::int32_t local_hi = unit.quantum_hi[p][i] - ((cell[p][i] + 1) << quanta_bits);
        return pack_axis(0, local_hi + 1); // ends in the next brick: local_hi < quanta
    };
    const std::uint32_t step_y = static_cast<std::uint32_t>(cells_x);
    const std::uint32_t step_z = static_cast<std::uint32_t>(cells_x * cells_y);
    for (std::uint32_t k = 0; k < lists.ys; ++k, ++records) {
        const std::uint32_t i = lists.y[k];
        unit.record[records] = {{word[0][i], next_word(1, i), word[2][i]},
                                flags[i] | copy_flag(grid.axis[1])};
        unit.brick[records] = unit.brick[i] + step_y;
    }
    for (std::uint32_t k = 0; k < lists.zs; ++k, ++records) {
        const std::uint32_t i = lists.z[k];
        unit.record[records] = {{word[0][i], word[1][i], next_word(2, i)},
                                flags[i] | copy_flag(grid.axis[2])};
        unit.brick[records] = unit.brick[i] + step_z;
    }
    for (std::uint32_t k = 0; k < lists.yzs; ++k, ++records) {
        const std::uint32_t i = lists.yz[k];
        unit.record[records] = {{word[0][i], next_word(1, i), next_word(2, i)},
                                flags[i] | copy_flag(grid.axis[1]) | copy_flag(grid.axis[2])};
        unit.brick[records] = unit.brick[i] + step_y + step_z;
    }
    unit.records = records;
}

// --- The sweep ---
// A record's window holds every record behind it that may begin before it ends. Two rows share each block of
// candidates. Before the first row's successor a block is masked; behind a window's end no mask is needed,
// since those records begin later and fail the test on the sweep axis by themselves.

inline void defer_ties(PairOutput& out, unsigned ties, const std::uint32_t* candidates, std::uint32_t row)
{
    for (; ties != 0; ties &= ties - 1)
        out.ties[out.tie_count++] = {row, candidates[std::countr_zero(ties)] & object_mask};
}

#if JOSTLE_KERNEL_WIDE

// AVX-512: one 32-bit word per axis, both differences of a candidate in one lane; compress in registers. In
// intrinsics, since Highway's types would ask for a cast at every step. The form in Highway below, compiled for
// AVX-512, takes 1.35 to 1.55 times as long.

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

/// Writes the pairs of two rows with the candidates of one block, the first row's first.
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
    } else { // both rows' in one register: what is stored behind `count` will be overwritten
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
    std::uint64_t blocks = 0;

    for (std::uint32_t i = first; i < last; i += 2) {
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
            const __m512i x0 = broadcast(column.x[i]), x1 = broadcast(column.x[i + 1]);
            const __m512i y0 = broadcast(column.y[i]), y1 = broadcast(column.y[i + 1]);
            const __m512i z0 = broadcast(column.z[i]), z1 = broadcast(column.z[i + 1]);
            const std::uint32_t object0 = column.object[i], object1 = column.object[i + 1];
            const __m512i row0 = broadcast(object0 & object_mask), row1 = broadcast(object1 & object_mask);
            const __m512i flags0 = _mm512_and_si512(broadcast(object0), all_flags);
            const __m512i flags1 = _mm512_and_si512(broadcast(object1), all_flags);
            Pair* next = out.next;
            __builtin_prefetch(next + 64, 1);
            for (; j < stop; j += block_size) {
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
                __mmask16 hits0 = _mm512_mask_testn_epi32_mask(behind0, gap0, signs);
                __mmask16 hits1 = _mm512_mask_testn_epi32_mask(behind1, gap1, signs);
                hits0 = _mm512_mask_testn_epi32_mask(hits0, objects, flags0);
                hits1 = _mm512_mask_testn_epi32_mask(hits1, objects, flags1);
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
    return blocks;
}

#else
#if JOSTLE_KERNEL_SCALAR

// Plain C++, for builds without Highway: four 16-bit lanes in a 64-bit word. With bit 15 of each lane of the
// minuend set, no borrow leaves a lane, and the bit survives where the minuend's lane is not the smaller one.

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

/// The tests of one row against a block of 16. What they let pass is certain or a tie, and one in sixteen:
/// which, is told candidate by candidate.
template <int Dim>
struct Row
{
    std::uint64_t hi_guarded[3], lo[3], flags;
    std::uint32_t object;
    Row(const Columns& column, std::uint32_t i)
        : flags(all_lanes(lane(column.flags, i))), object(column.object[i] & object_mask)
    {
        for (int p = 0; p < Dim; ++p) {
            hi_guarded[p] = all_lanes(lane(column.hi[p], i)) | Columns::guard;
            lo[p] = all_lanes(lane(column.lo[p], i));
        }
    }
    /// The candidates of block j that may touch, as a bit mask.
    unsigned hits(const Columns& column, std::uint32_t j) const
    {
        unsigned mask = 0;
        for (std::uint32_t k = 0; k < 4; ++k) {
            const std::uint32_t word = j / 4 + k;
            // The bit stays where no flag is shared.
            std::uint64_t reach = Columns::guard - (column.flags[word] & flags);
            for (int p = 0; p < Dim; ++p)
                reach &=
                    ((column.hi[p][word] | Columns::guard) - lo[p]) & (hi_guarded[p] - column.lo[p][word]);
            mask |= lane_bits(reach) << (4 * k);
        }
        return mask;
    }
    bool is_tie(const Columns& column, std::uint32_t j) const
    {
        bool tie = false;
        for (int p = 0; p < Dim; ++p)
            tie |= lane(column.hi[p], j) == (lo[p] & 0xffff) ||
                   lane(column.lo[p], j) == (hi_guarded[p] & 0x7fff);
        return tie;
    }
    Pair* emit(Pair* to, unsigned hits, const Columns& column, std::uint32_t j, PairOutput& out) const
    {
        for (; hits != 0; hits &= hits - 1) {
            const std::uint32_t candidate = j + static_cast<std::uint32_t>(std::countr_zero(hits));
            const std::uint32_t other = column.object[candidate] & object_mask;
            if (is_tie(column, candidate))
                out.ties[out.tie_count++] = {object, other};
            else
                *to++ = {std::min(object, other) & index_mask, std::max(object, other) & index_mask};
        }
        return to;
    }
};

template <int Dim>
std::uint64_t sweep(const SortedBrick& brick, std::uint32_t first, std::uint32_t last, PairOutput& out)
{
    const Columns column(brick);
    std::uint64_t blocks = 0;
    for (std::uint32_t i = first; i < last; i += 2) {
        const Row<Dim> row0(column, i), row1(column, i + 1);
        std::uint32_t j = (i + 1) & ~3u;
        unsigned behind0 = 0xffffu << (i + 1 - j);
        unsigned behind1 = 0xffffu << (i + 2 - j);
        const std::uint32_t end = std::max(brick.window_end[i], brick.window_end[i + 1]);
        while (j < end) {
            if (out.end - out.next < sweep_room || out.tie_count > tie_capacity - sweep_room) {
                if (!out.make_room(out)) return blocks;
            }
            const std::uint32_t stop = std::min(end, j + sweep_segment * block_size);
            blocks += (stop - j + block_size - 1) / block_size;
            Pair* next = out.next;
            for (; j < stop; j += block_size) {
                next = row0.emit(next, row0.hits(column, j) & behind0, column, j, out);
                next = row1.emit(next, row1.hits(column, j) & behind1, column, j, out);
                behind0 = behind1 = 0xffff;
            }
            out.next = next;
        }
    }
    return blocks;
}

#else

// 16-bit columns: hi and negated lo of each axis, and the flags. Twice the candidates per register; masks
// cost more.

struct Columns
{
    std::int16_t* hi[3];
    std::int16_t* lo[3];
    std::int16_t* flags; // shifted to be positive
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
        flags = narrow;
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
        to.flags[i] = static_cast<std::int16_t>((records[i].object & ~index_mask) >> 17);
    }
}

/// What of a block touches two rows, as bit masks: the first row's in the low half.
struct Hits
{
    unsigned sure, ties;
};

/// Two neighbouring rows, against blocks of 16.
template <int Dim>
struct Rows
{
    using D = hn::CappedTag<std::int16_t, block_size>;
    using V = hn::Vec<D>;
    V hi0[3], lo0[3], hi1[3], lo1[3], flags0, flags1;

    HWY_ATTR Rows(const Columns& column, std::uint32_t i)
    {
        const D d;
        for (int p = 0; p < Dim; ++p) {
            hi0[p] = hn::Set(d, column.hi[p][i]);
            lo0[p] = hn::Set(d, column.lo[p][i]);
            hi1[p] = hn::Set(d, column.hi[p][i + 1]);
            lo1[p] = hn::Set(d, column.lo[p][i + 1]);
        }
        flags0 = hn::Set(d, column.flags[i]);
        flags1 = hn::Set(d, column.flags[i + 1]);
    }
    /// How far the nearest of two facing sides of row and candidate reach into each other: negative where the
    /// pair isn't touching or not this brick's, zero for a tie. Sums of bounds fit 16 bits, and flags 15.
    HWY_ATTR HWY_INLINE void gaps(const Columns& column, std::uint32_t j, V& gap0, V& gap1) const
    {
        const D d;
        const V flags = hn::LoadU(d, column.flags + j);
        gap0 = hn::Neg(hn::And(flags, flags0));
        gap1 = hn::Neg(hn::And(flags, flags1));
        V least0, least1;
        for (int p = 0; p < Dim; ++p) { // both rows axis by axis: few registers
            const V hi = hn::LoadU(d, column.hi[p] + j), lo = hn::LoadU(d, column.lo[p] + j);
            const V here0 = hn::Min(hn::Add(hi, lo0[p]), hn::Add(lo, hi0[p]));
            const V here1 = hn::Min(hn::Add(hi, lo1[p]), hn::Add(lo, hi1[p]));
            least0 = p == 0 ? here0 : hn::Min(least0, here0);
            least1 = p == 0 ? here1 : hn::Min(least1, here1);
        }
        gap0 = hn::Or(gap0, least0);
        gap1 = hn::Or(gap1, least1);
    }
    HWY_ATTR HWY_INLINE Hits test(const Columns& column, std::uint32_t j) const
    {
        V gap0, gap1;
        gaps(column, j, gap0, gap1);
#if HWY_TARGET == HWY_AVX2
        // Saturation keeps signs and zeros, so both rows' gaps fit one register of bytes. Highway's
        // StoreMaskBits packs each mask by itself, and on SSE4 the sweep takes 6 to 11 % longer with it.
        const __m256i bytes = _mm256_permute4x64_epi64(_mm256_packs_epi16(gap0.raw, gap1.raw), 0xd8);
        const auto negative = static_cast<unsigned>(_mm256_movemask_epi8(bytes));
        const auto zero =
            static_cast<unsigned>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(bytes, _mm256_setzero_si256())));
        return {~(negative | zero), zero};
#else
        V next0, next1;
        gaps(column, j + JOSTLE_KERNEL_LANES16, next0, next1);
        static_assert(2 * JOSTLE_KERNEL_LANES16 == block_size);
#if HWY_TARGET == HWY_SSE4
        const __m128i bytes0 = _mm_packs_epi16(gap0.raw, next0.raw);
        const __m128i bytes1 = _mm_packs_epi16(gap1.raw, next1.raw);
        const __m128i none = _mm_setzero_si128();
        const auto mask = [](__m128i low, __m128i high) {
            return static_cast<unsigned>(_mm_movemask_epi8(low)) |
                   (static_cast<unsigned>(_mm_movemask_epi8(high)) << 16);
        };
        const unsigned zero = mask(_mm_cmpeq_epi8(bytes0, none), _mm_cmpeq_epi8(bytes1, none));
        return {~(mask(bytes0, bytes1) | zero), zero};
#else
        const D d;
        const auto zero = hn::Zero(d);
        std::uint8_t sure[12], ties[12]; // each mask is one byte, and some targets write eight
        hn::StoreMaskBits(d, hn::Gt(gap0, zero), sure);
        hn::StoreMaskBits(d, hn::Gt(next0, zero), sure + 1);
        hn::StoreMaskBits(d, hn::Gt(gap1, zero), sure + 2);
        hn::StoreMaskBits(d, hn::Gt(next1, zero), sure + 3);
        hn::StoreMaskBits(d, hn::Eq(gap0, zero), ties);
        hn::StoreMaskBits(d, hn::Eq(next0, zero), ties + 1);
        hn::StoreMaskBits(d, hn::Eq(gap1, zero), ties + 2);
        hn::StoreMaskBits(d, hn::Eq(next1, zero), ties + 3);
        const auto bits = [](const std::uint8_t* bytes) {
            return bytes[0] | (static_cast<unsigned>(bytes[1]) << 8) |
                   (static_cast<unsigned>(bytes[2]) << 16) | (static_cast<unsigned>(bytes[3]) << 24);
        };
        return {bits(sure), bits(ties)};
#endif
#endif
    }
};

/// Hits wait here until there are enough of them to make pairs with whole registers.
struct HitQueue
{
    static constexpr std::uint32_t capacity = 512;
    alignas(64) std::uint32_t row[capacity + 8];
    alignas(64) std::uint32_t other[capacity + 8]; // with flags

    /// Takes and returns how many there are: in a register, for a member would be stored and loaded each
    /// time.
    HWY_ATTR HWY_INLINE std::uint32_t add(std::uint32_t size, unsigned hits, const std::uint32_t* candidates,
                                          std::uint32_t row_object)
    {
        using D = hn::CappedTag<std::uint32_t, 8>;
        const D d;
        const auto rows = hn::Set(d, row_object);
        for (std::uint32_t k = 0; k < block_size; k += JOSTLE_KERNEL_LANES32) {
            const unsigned part = (hits >> k) & ((1u << JOSTLE_KERNEL_LANES32) - 1);
            const auto some = hn::LoadU(d, candidates + k);
#if JOSTLE_KERNEL_LANES32 == 8
            const auto order =
                hn::PromoteTo(d, hn::LoadU(hn::Rebind<std::uint8_t, D>(), compress_order.of8[part]));
            const auto hit = hn::TableLookupLanes(some, hn::IndicesFromVec(d, order));
#else
            const hn::Repartition<std::uint8_t, D> bytes;
            const auto hit = hn::BitCast(
                d, hn::TableLookupBytes(hn::BitCast(bytes, some), hn::Load(bytes, compress_order.of4[part])));
#endif
            hn::StoreU(hit, d, other + size);
            hn::StoreU(rows, d, row + size);
            size += static_cast<std::uint32_t>(std::popcount(part));
        }
        return size;
    }
    /// Writes the pairs; there must be room for `size` and a register's worth.
    HWY_ATTR void flush(std::uint32_t size, PairOutput& out) const
    {
        using D = hn::CappedTag<std::uint32_t, 8>;
        const D d;
        constexpr std::uint32_t lanes = JOSTLE_KERNEL_LANES32;
        const auto object = hn::Set(d, object_mask);
        const auto index = hn::Set(d, index_mask);
        auto* words = reinterpret_cast<std::uint32_t*>(out.next);
        for (std::uint32_t k = 0; k < size; k += lanes, words += 2 * lanes) {
            const auto others = hn::And(hn::LoadU(d, other + k), object), rows = hn::LoadU(d, row + k);
            const auto a = hn::And(hn::Min(others, rows), index);
            const auto b = hn::And(hn::Max(others, rows), index);
            const auto low = hn::InterleaveLower(d, a, b), high = hn::InterleaveUpper(d, a, b);
#if JOSTLE_KERNEL_LANES32 == 8
            hn::StoreU(hn::ConcatLowerLower(d, high, low), d, words);
            hn::StoreU(hn::ConcatUpperUpper(d, high, low), d, words + 8);
#else
            hn::StoreU(low, d, words);
            hn::StoreU(high, d, words + 4);
#endif
        }
        out.next += size;
    }
};

template <int Dim>
HWY_ATTR std::uint64_t sweep(const SortedBrick& brick, std::uint32_t first, std::uint32_t last,
                             PairOutput& out)
{
    const Columns column(brick);
    HitQueue queue;
    std::uint32_t queued = 0;
    std::uint64_t blocks = 0;
    for (std::uint32_t i = first; i < last; i += 2) {
        const Rows<Dim> rows(column, i);
        const std::uint32_t row0 = column.object[i] & object_mask, row1 = column.object[i + 1] & object_mask;
        std::uint32_t j = (i + 1) & ~3u;
        unsigned behind = ((0xffffu << (i + 1 - j)) & 0xffffu) | (0xffffu << (i + 2 - j) << 16);
        const std::uint32_t end = std::max(brick.window_end[i], brick.window_end[i + 1]);

        while (j < end) {
            // In the queue there are never so many that a segment's pairs wouldn't fit behind them.
            if (out.end - out.next < sweep_room + HitQueue::capacity ||
                out.tie_count > tie_capacity - sweep_room) {
                queue.flush(queued, out); // ties come behind the pairs that were found before them
                queued = 0;
                if ((out.end - out.next < sweep_room + HitQueue::capacity ||
                     out.tie_count > tie_capacity - sweep_room) &&
                    !out.make_room(out))
                    return blocks;
            }
            const std::uint32_t stop = std::min(end, j + sweep_segment * block_size);
            blocks += (stop - j + block_size - 1) / block_size;
            for (; j < stop; j += block_size) {
                const Hits hits = rows.test(column, j);
                const unsigned sure = hits.sure & behind, ties = hits.ties & behind;
                behind = ~0u;
                if (__builtin_expect(queued > HitQueue::capacity - 2 * block_size, 0)) {
                    queue.flush(queued, out);
                    queued = 0;
                }
                // With wide registers a look whether there are any, often guessed wrong, costs more than it
                // saves.
                if (JOSTLE_KERNEL_LANES32 == 8 || sure != 0) {
                    queued = queue.add(queued, sure & 0xffff, column.object + j, row0);
                    queued = queue.add(queued, sure >> 16, column.object + j, row1);
                }
                if (__builtin_expect(ties != 0, 0)) {
                    defer_ties(out, ties & 0xffff, column.object + j, row0);
                    defer_ties(out, ties >> 16, column.object + j, row1);
                }
            }
        }
    }
    queue.flush(queued, out);
    return blocks;
}

#endif // JOSTLE_KERNEL_SCALAR
#endif // JOSTLE_KERNEL_WIDE

inline const Kernels& kernels()
{
    static constexpr Kernels table = {JOSTLE_KERNEL_SET,
                                      load<2, float>,
                                      load<2, double>,
                                      load<3, float>,
                                      load<3, double>,
                                      quantise<2, float>,
                                      quantise<2, double>,
                                      quantise<3, float>,
                                      quantise<3, double>,
                                      arrange,
                                      sweep<2>,
                                      sweep<3>};
    return table;
}
