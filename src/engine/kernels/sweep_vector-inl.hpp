// SPDX-License-Identifier: MIT
// The sweep with vectors of 128 or 256 bits, through Highway: 16-bit columns, so that a register holds twice
// as many candidates as with 32 bits. kernels.hpp says what all forms of the sweep do. No include guard:
// kernels.cpp includes it once per set.
//
// Tests produce a 16-bit number per row and candidate, the gap: the least overlap over the axes, negative if
// the two are apart. Masks of 16-bit lanes and compressing are slow here, so the results of both rows are
// packed to bits of one word, a table gives the order of the hits, and a queue collects them until they fill
// whole registers.

/// As many 16-bit numbers as a register holds: one for each candidate of a step, or of half a step.
using Words = hn::CappedTag<std::int16_t, step_size>;
constexpr std::uint32_t lanes16 = static_cast<std::uint32_t>(hn::MaxLanes(Words()));
constexpr std::uint32_t parts = step_size / lanes16; // of a step
/// As many 32-bit numbers as a register holds: objects.
using Objects = hn::CappedTag<std::uint32_t, 8>;
constexpr std::uint32_t lanes32 = static_cast<std::uint32_t>(hn::MaxLanes(Objects()));

/// Columns of 16-bit numbers: hi and negated lo of each axis, and the flags.
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

/// Which candidates of a step touch two rows, as bit masks: those of the first row in the low half.
struct Hits
{
    unsigned sure, ties;
};

/// The candidates of a step by their gaps to two rows, part by part: a gap above zero is a hit, one of zero a
/// tie.
#if HWY_TARGET == HWY_AVX2
HWY_ATTR HWY_INLINE Hits outcomes(const hn::Vec<Words> (&gap0)[parts], const hn::Vec<Words> (&gap1)[parts])
{
    // Saturation keeps signs and zeros, so both rows' gaps fit one register of bytes. Highway's StoreMaskBits
    // packs each mask by itself, and on SSE4 the sweep takes 6 to 11 % longer with it.
    const __m256i bytes = _mm256_permute4x64_epi64(_mm256_packs_epi16(gap0[0].raw, gap1[0].raw), 0xd8);
    const auto negative = static_cast<unsigned>(_mm256_movemask_epi8(bytes));
    const auto zero =
        static_cast<unsigned>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(bytes, _mm256_setzero_si256())));
    return {~(negative | zero), zero};
}
#elif HWY_TARGET == HWY_SSE4
HWY_ATTR HWY_INLINE Hits outcomes(const hn::Vec<Words> (&gap0)[parts], const hn::Vec<Words> (&gap1)[parts])
{
    const __m128i bytes0 = _mm_packs_epi16(gap0[0].raw, gap0[1].raw);
    const __m128i bytes1 = _mm_packs_epi16(gap1[0].raw, gap1[1].raw);
    const __m128i none = _mm_setzero_si128();
    const auto mask = [](__m128i low, __m128i high) {
        return static_cast<unsigned>(_mm_movemask_epi8(low)) |
               (static_cast<unsigned>(_mm_movemask_epi8(high)) << 16);
    };
    const unsigned zero = mask(_mm_cmpeq_epi8(bytes0, none), _mm_cmpeq_epi8(bytes1, none));
    return {~(mask(bytes0, bytes1) | zero), zero};
}
#elif HWY_TARGET == HWY_WASM
HWY_ATTR HWY_INLINE Hits outcomes(const hn::Vec<Words> (&gap0)[parts], const hn::Vec<Words> (&gap1)[parts])
{
    // As for SSE4.
    const v128_t bytes0 = wasm_i8x16_narrow_i16x8(gap0[0].raw, gap0[1].raw);
    const v128_t bytes1 = wasm_i8x16_narrow_i16x8(gap1[0].raw, gap1[1].raw);
    const v128_t none = wasm_i8x16_splat(0);
    const auto mask = [](v128_t low, v128_t high) {
        return static_cast<unsigned>(wasm_i8x16_bitmask(low)) |
               (static_cast<unsigned>(wasm_i8x16_bitmask(high)) << 16);
    };
    const unsigned zero = mask(wasm_i8x16_eq(bytes0, none), wasm_i8x16_eq(bytes1, none));
    return {~(mask(bytes0, bytes1) | zero), zero};
}
#else
HWY_ATTR HWY_INLINE Hits outcomes(const hn::Vec<Words> (&gap0)[parts], const hn::Vec<Words> (&gap1)[parts])
{
    static_assert(parts == 2);
    const Words d;
    const auto zero = hn::Zero(d);
    std::uint8_t sure[12], ties[12]; // each mask is one byte, and some targets write eight
    hn::StoreMaskBits(d, hn::Gt(gap0[0], zero), sure);
    hn::StoreMaskBits(d, hn::Gt(gap0[1], zero), sure + 1);
    hn::StoreMaskBits(d, hn::Gt(gap1[0], zero), sure + 2);
    hn::StoreMaskBits(d, hn::Gt(gap1[1], zero), sure + 3);
    hn::StoreMaskBits(d, hn::Eq(gap0[0], zero), ties);
    hn::StoreMaskBits(d, hn::Eq(gap0[1], zero), ties + 1);
    hn::StoreMaskBits(d, hn::Eq(gap1[0], zero), ties + 2);
    hn::StoreMaskBits(d, hn::Eq(gap1[1], zero), ties + 3);
    const auto bits = [](const std::uint8_t* bytes) {
        return bytes[0] | (static_cast<unsigned>(bytes[1]) << 8) | (static_cast<unsigned>(bytes[2]) << 16) |
               (static_cast<unsigned>(bytes[3]) << 24);
    };
    return {bits(sure), bits(ties)};
}
#endif

/// Two neighbouring rows.
template <int Dim>
struct Rows
{
    using V = hn::Vec<Words>;
    V hi0[3], lo0[3], hi1[3], lo1[3], flags0, flags1;

    HWY_ATTR Rows(const Columns& column, std::uint32_t i)
    {
        const Words d;
        for (int p = 0; p < Dim; ++p) {
            hi0[p] = hn::Set(d, column.hi[p][i]);
            lo0[p] = hn::Set(d, column.lo[p][i]);
            hi1[p] = hn::Set(d, column.hi[p][i + 1]);
            lo1[p] = hn::Set(d, column.lo[p][i + 1]);
        }
        flags0 = hn::Set(d, column.flags[i]);
        flags1 = hn::Set(d, column.flags[i + 1]);
    }
    /// The gaps to the candidates from j on: negative where a pair is apart or another brick's, zero for a
    /// tie. Sums of bounds fit 16 bits, and flags 15.
    HWY_ATTR HWY_INLINE void gaps(const Columns& column, std::uint32_t j, V& gap0, V& gap1) const
    {
        const Words d;
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
        V gap0[parts], gap1[parts];
        for (std::uint32_t part = 0; part < parts; ++part)
            gaps(column, j + part * lanes16, gap0[part], gap1[part]);
        return outcomes(gap0, gap1);
    }
};

/// The objects whose bits are set, in their order, at the front of a register.
HWY_ATTR HWY_INLINE hn::Vec<Objects> to_front(hn::Vec<Objects> all, unsigned bits)
{
    const Objects d;
    if constexpr (lanes32 == 8) {
        const auto order =
            hn::PromoteTo(d, hn::LoadU(hn::Rebind<std::uint8_t, Objects>(), compress_order.of8[bits]));
        return hn::TableLookupLanes(all, hn::IndicesFromVec(d, order));
    } else {
#if HWY_TARGET == HWY_WASM
        // Highway looks bytes up one by one here, which made the sweep slower than one without vectors.
        return hn::Vec<Objects>{wasm_i8x16_swizzle(all.raw, wasm_v128_load(compress_order.of4[bits]))};
#else
        const hn::Repartition<std::uint8_t, Objects> bytes;
        return hn::BitCast(
            d, hn::TableLookupBytes(hn::BitCast(bytes, all), hn::Load(bytes, compress_order.of4[bits])));
#endif
    }
}

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
        const Objects d;
        const auto rows = hn::Set(d, row_object);
        for (std::uint32_t k = 0; k < step_size; k += lanes32) {
            const unsigned part = (hits >> k) & ((1u << lanes32) - 1);
            const auto some = hn::LoadU(d, candidates + k);
            hn::StoreU(to_front(some, part), d, other + size);
            hn::StoreU(rows, d, row + size);
            size += static_cast<std::uint32_t>(std::popcount(part));
        }
        return size;
    }
    /// Writes the pairs; there must be room for `size` and a register's worth.
    HWY_ATTR void flush(std::uint32_t size, PairOutput& out) const
    {
        const Objects d;
        const auto object = hn::Set(d, object_mask);
        const auto index = hn::Set(d, index_mask);
        auto* pair_words = reinterpret_cast<std::uint32_t*>(out.next);
        for (std::uint32_t k = 0; k < size; k += lanes32, pair_words += 2 * lanes32) {
            const auto others = hn::And(hn::LoadU(d, other + k), object), rows = hn::LoadU(d, row + k);
            const auto a = hn::And(hn::Min(others, rows), index);
            const auto b = hn::And(hn::Max(others, rows), index);
            const auto low = hn::InterleaveLower(d, a, b), high = hn::InterleaveUpper(d, a, b);
            if constexpr (lanes32 == 8) { // interleaving stays within halves of 128 bits
                hn::StoreU(hn::ConcatLowerLower(d, high, low), d, pair_words);
                hn::StoreU(hn::ConcatUpperUpper(d, high, low), d, pair_words + 8);
            } else {
                hn::StoreU(low, d, pair_words);
                hn::StoreU(high, d, pair_words + 4);
            }
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
    std::uint64_t steps = 0;
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
                    return steps;
            }
            const std::uint32_t stop = std::min(end, j + sweep_segment * step_size);
            steps += (stop - j + step_size - 1) / step_size;
            for (; j < stop; j += step_size) {
                const Hits hits = rows.test(column, j);
                const unsigned sure = hits.sure & behind, ties = hits.ties & behind;
                behind = ~0u;
                if (__builtin_expect(queued > HitQueue::capacity - 2 * step_size, 0)) {
                    queue.flush(queued, out);
                    queued = 0;
                }
                // With wide registers a look whether there are any, often guessed wrong, costs more than it
                // saves.
                if (lanes32 == 8 || sure != 0) {
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
    return steps;
}

template <int Dim>
HWY_ATTR void test(const SortedBrick& brick, std::uint32_t row, std::uint32_t first, std::uint32_t last,
                   Outcome* outcomes_of_steps)
{
    const Columns column(brick);
    const Rows<Dim> rows(column, row); // the second one isn't wanted
    for (std::uint32_t j = first; j < last; j += step_size, ++outcomes_of_steps) {
        hn::Vec<Words> gap[parts], unwanted;
        for (std::uint32_t part = 0; part < parts; ++part)
            rows.gaps(column, j + part * lanes16, gap[part], unwanted);
        const Hits hits = outcomes(gap, gap);
        *outcomes_of_steps = {static_cast<std::uint16_t>(hits.sure), static_cast<std::uint16_t>(hits.ties)};
    }
}
