// SPDX-License-Identifier: MIT
// The sweep with vectors of 128 or 256 bits, through Highway: 16-bit columns, so that a register holds twice
// as many candidates as with 32 bits. kernels.hpp describes what all forms of the sweep do. No include guard:
// kernels.cpp includes it once per set.
//
// Tests produce a 16-bit number per row and candidate, the gap: the least overlap over the axes, negative if
// the two are apart. Masks of 16-bit lanes and compressing are slow here, so the results of both rows are
// packed into bits of one word. Words with hits are queued until many of them are turned into pairs, in an
// order of hits given by a table.

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

/// Eight records at a time: their halves of 16 bits, transposed.
HWY_ATTR inline void arrange(const Record* records, SortedBrick& brick)
{
    const Columns to(brick);
    const hn::Full128<std::int16_t> d;
    const hn::Full128<std::uint32_t> d2;
    const hn::Full128<std::uint64_t> d4;
    const auto flag_bits = hn::Set(d, static_cast<std::int16_t>(~index_mask >> 17));
    const std::uint32_t size = padded(brick.count);
    for (std::uint32_t i = 0; i < size; i += 8) {
        // For each four records both bounds on an axis, and finally both halves of the object.
        hn::Vec<decltype(d4)> of_four[2][4];
        for (const std::uint32_t half : {0u, 1u}) {
            const auto load = [&](std::uint32_t k) HWY_ATTR {
                const auto* words = reinterpret_cast<const std::uint32_t*>(records + i + 4 * half + k);
                return hn::BitCast(d, hn::LoadU(d2, words));
            };
            const auto r0 = load(0), r1 = load(1), r2 = load(2), r3 = load(3);
            const auto low01 = hn::BitCast(d2, hn::InterleaveLower(d, r0, r1));
            const auto low23 = hn::BitCast(d2, hn::InterleaveLower(d, r2, r3));
            const auto high01 = hn::BitCast(d2, hn::InterleaveUpper(d, r0, r1));
            const auto high23 = hn::BitCast(d2, hn::InterleaveUpper(d, r2, r3));
            of_four[half][0] = hn::BitCast(d4, hn::InterleaveLower(d2, low01, low23));
            of_four[half][1] = hn::BitCast(d4, hn::InterleaveUpper(d2, low01, low23));
            of_four[half][2] = hn::BitCast(d4, hn::InterleaveLower(d2, high01, high23));
            of_four[half][3] = hn::BitCast(d4, hn::InterleaveUpper(d2, high01, high23));
        }
        const auto low_half = [&](int k) HWY_ATTR {
            return hn::BitCast(d, hn::InterleaveLower(d4, of_four[0][k], of_four[1][k]));
        };
        const auto high_half = [&](int k) HWY_ATTR {
            return hn::BitCast(d, hn::InterleaveUpper(d4, of_four[0][k], of_four[1][k]));
        };
        for (int p = 0; p < 3; ++p) {
            hn::StoreU(low_half(p), d, to.hi[p] + i);
            hn::StoreU(high_half(p), d, to.lo[p] + i);
        }
        const auto low = low_half(3), high = high_half(3);
        hn::StoreU(hn::BitCast(d2, hn::InterleaveLower(d, low, high)), d2, to.object + i);
        hn::StoreU(hn::BitCast(d2, hn::InterleaveUpper(d, low, high)), d2, to.object + i + 4);
        hn::StoreU(hn::And(hn::ShiftRight<1>(high), flag_bits), d, to.flags + i);
    }
}

/// Which candidates of a step touch two rows, a bit each, in the order in which registers pack them: the
/// first eight candidates with the first row, then with the second, then likewise the other eight.
struct Hits
{
    unsigned sure, ties;
};
/// Those of one row, in the order of the candidates.
inline unsigned of_row(unsigned hits, std::uint32_t row)
{
    hits >>= 8 * row;
    return (hits & 0xff) | ((hits >> 8) & 0xff00);
}

/// From the gaps of a step's candidates, part by part: a gap above zero is a hit, one of zero a tie.
#if HWY_TARGET == HWY_AVX2
HWY_ATTR HWY_INLINE Hits outcomes(const hn::Vec<Words> (&gap0)[parts], const hn::Vec<Words> (&gap1)[parts])
{
    // Saturation keeps signs and zeros, so both rows' gaps fit one register of bytes. Highway's StoreMaskBits
    // packs each mask by itself, and makes the sweep 6 to 11 % slower on SSE4.
    const __m256i bytes = _mm256_packs_epi16(gap0[0].raw, gap1[0].raw);
    const auto negative = static_cast<unsigned>(_mm256_movemask_epi8(bytes));
    const auto zero =
        static_cast<unsigned>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(bytes, _mm256_setzero_si256())));
    return {~(negative | zero), zero};
}
#elif HWY_TARGET == HWY_SSE4
HWY_ATTR HWY_INLINE Hits outcomes(const hn::Vec<Words> (&gap0)[parts], const hn::Vec<Words> (&gap1)[parts])
{
    const __m128i first = _mm_packs_epi16(gap0[0].raw, gap1[0].raw);
    const __m128i other = _mm_packs_epi16(gap0[1].raw, gap1[1].raw);
    const __m128i none = _mm_setzero_si128();
    const auto mask = [](__m128i low, __m128i high) {
        return static_cast<unsigned>(_mm_movemask_epi8(low)) |
               (static_cast<unsigned>(_mm_movemask_epi8(high)) << 16);
    };
    const unsigned zero = mask(_mm_cmpeq_epi8(first, none), _mm_cmpeq_epi8(other, none));
    return {~(mask(first, other) | zero), zero};
}
#elif HWY_TARGET == HWY_WASM
HWY_ATTR HWY_INLINE Hits outcomes(const hn::Vec<Words> (&gap0)[parts], const hn::Vec<Words> (&gap1)[parts])
{
    // As for SSE4.
    const v128_t first = wasm_i8x16_narrow_i16x8(gap0[0].raw, gap1[0].raw);
    const v128_t other = wasm_i8x16_narrow_i16x8(gap0[1].raw, gap1[1].raw);
    const v128_t none = wasm_i8x16_splat(0);
    const auto mask = [](v128_t low, v128_t high) {
        return static_cast<unsigned>(wasm_i8x16_bitmask(low)) |
               (static_cast<unsigned>(wasm_i8x16_bitmask(high)) << 16);
    };
    const unsigned zero = mask(wasm_i8x16_eq(first, none), wasm_i8x16_eq(other, none));
    return {~(mask(first, other) | zero), zero};
}
#else
HWY_ATTR HWY_INLINE Hits outcomes(const hn::Vec<Words> (&gap0)[parts], const hn::Vec<Words> (&gap1)[parts])
{
    static_assert(parts == 2);
    const Words d;
    const auto zero = hn::Zero(d);
    std::uint8_t sure[12], ties[12]; // each mask is one byte, and some targets write eight
    hn::StoreMaskBits(d, hn::Gt(gap0[0], zero), sure);
    hn::StoreMaskBits(d, hn::Gt(gap1[0], zero), sure + 1);
    hn::StoreMaskBits(d, hn::Gt(gap0[1], zero), sure + 2);
    hn::StoreMaskBits(d, hn::Gt(gap1[1], zero), sure + 3);
    hn::StoreMaskBits(d, hn::Eq(gap0[0], zero), ties);
    hn::StoreMaskBits(d, hn::Eq(gap1[0], zero), ties + 1);
    hn::StoreMaskBits(d, hn::Eq(gap0[1], zero), ties + 2);
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
        for (int p = 0; p < Dim; ++p) { // both rows axis by axis: there are few registers
            const V hi = hn::LoadU(d, column.hi[p] + j), lo = hn::LoadU(d, column.lo[p] + j);
            const V here0 = hn::Min(hn::Add(hi, lo0[p]), hn::Add(lo, hi0[p]));
            const V here1 = hn::Min(hn::Add(hi, lo1[p]), hn::Add(lo, hi1[p]));
            least0 = p == 0 ? here0 : hn::Min(least0, here0);
            least1 = p == 0 ? here1 : hn::Min(least1, here1);
        }
        gap0 = hn::Or(gap0, least0);
        gap1 = hn::Or(gap1, least1);
    }
    /// Called in each step: there are too few registers for the values of both rows, and g++ would otherwise
    /// spill the candidates that it has just loaded.
    HWY_ATTR HWY_INLINE void stay_in_memory()
    {
#if HWY_ARCH_X86
        asm volatile("" : "+m"(*this));
#endif
    }
    HWY_ATTR HWY_INLINE Hits test(const Columns& column, std::uint32_t j) const
    {
        V gap0[parts], gap1[parts];
        for (std::uint32_t part = 0; part < parts; ++part)
            gaps(column, j + part * lanes16, gap0[part], gap1[part]);
        return outcomes(gap0, gap1);
    }
};

/// A queue of steps with hits, until there are enough to be turned into pairs one after another. So later
/// steps don't wait for their results, and steps without hits take no time.
///
/// The caller keeps their number: a member would be stored and loaded in each step.
class HitQueue
{
  public:
    static constexpr std::uint32_t capacity = 128; // so that they make no more pairs than a segment may

    /// Adds a step: which of its candidates, from `candidate` on, the rows `row` and row + 1 hit. Returns the
    /// new number of steps.
    HWY_ATTR HWY_INLINE std::uint32_t add(std::uint32_t steps, unsigned hits, std::uint32_t candidate,
                                          std::uint32_t row)
    {
        hits_[steps] = hits;
        candidate_[steps] = candidate;
        row_[steps] = row;
        return steps + (hits != 0 ? 1 : 0);
    }
    /// Writes the pairs; there must be room for them and one more register. Returns the number of steps left:
    /// none.
    HWY_ATTR std::uint32_t flush(std::uint32_t steps, const std::uint32_t* object, PairOutput& out)
    {
        std::uint32_t paired = 0;
        for (std::uint32_t step = 0; step < steps; ++step) {
            if (paired > most_paired - 2 * step_size) paired = write(paired, out);
            const std::uint32_t* const candidates = object + candidate_[step];
            for (const std::uint32_t row : {0u, 1u})
                paired = pair_up(paired, hits_[step] >> (8 * row), candidates, object[row_[step] + row]);
        }
        return write(paired, out);
    }

  private:
    static constexpr std::uint32_t most_paired = 512;

    /// Takes and returns the number of pairs yet to be written. A row's hits begin at bit 0.
    HWY_ATTR HWY_INLINE std::uint32_t pair_up(std::uint32_t paired, unsigned hits,
                                              const std::uint32_t* candidates, std::uint32_t row)
    {
        const Objects d;
        const auto rows = hn::Set(d, row & object_mask);
        for (std::uint32_t k = 0; k < step_size; k += lanes32) {
            const std::uint32_t at = k < 8 ? k : k + 8; // the other row's are between its halves
            const unsigned part = (hits >> at) & ((1u << lanes32) - 1);
            compress(Vec<std::uint32_t>::loadu(candidates + k), part).storeu(other_of_pair_ + paired);
            hn::StoreU(rows, d, row_of_pair_ + paired);
            paired += static_cast<std::uint32_t>(std::popcount(part));
        }
        return paired;
    }
    /// Returns the number left: none.
    HWY_ATTR std::uint32_t write(std::uint32_t paired, PairOutput& out) const
    {
        const Objects d;
        const auto object = hn::Set(d, object_mask);
        const auto index = hn::Set(d, index_mask);
        auto* pair_words = reinterpret_cast<std::uint32_t*>(out.next);
        for (std::uint32_t k = 0; k < paired; k += lanes32, pair_words += 2 * lanes32) {
            const auto others = hn::And(hn::LoadU(d, other_of_pair_ + k), object),
                       rows = hn::LoadU(d, row_of_pair_ + k);
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
        out.next += paired;
        return 0;
    }

    std::uint32_t hits_[capacity], candidate_[capacity], row_[capacity]; // of steps
    alignas(64) std::uint32_t row_of_pair_[most_paired + 8];
    alignas(64) std::uint32_t other_of_pair_[most_paired + 8]; // with flags
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
        Rows<Dim> rows(column, i);
        std::uint32_t j = (i + 1) & ~3u;
        // The rows' successors are among the first four candidates; those before them are masked.
        unsigned behind =
            0xffff0000u | ((0xff00u << (i + 2 - j)) & 0xff00u) | ((0xffu << (i + 1 - j)) & 0xffu);
        const std::uint32_t end = std::max(brick.window_end[i], brick.window_end[i + 1]);

        while (j < end) {
            const std::size_t room = sweep_room + std::size_t{2 * step_size} * queued;
            if (static_cast<std::size_t>(out.end - out.next) < room ||
                out.tie_count > tie_capacity - sweep_room) {
                queued = queue.flush(queued, column.object, out); // make_room wants all pairs written
                if (!out.make_room(out)) return steps;
            }
            const std::uint32_t stop = std::min(end, j + sweep_segment * step_size);
            steps += (stop - j + step_size - 1) / step_size;
            for (; j < stop; j += step_size) {
                rows.stay_in_memory();
                const Hits hits = rows.test(column, j);
                const unsigned sure = hits.sure & behind, ties = hits.ties & behind;
                behind = ~0u;
                queued = queue.add(queued, sure, j, i);
                if (__builtin_expect(queued == HitQueue::capacity, 0))
                    queued = queue.flush(queued, column.object, out);
                if (__builtin_expect(ties != 0, 0))
                    for (const std::uint32_t row : {0u, 1u})
                        defer_ties(out, of_row(ties, row), column.object + j,
                                   column.object[i + row] & object_mask);
            }
        }
    }
    queue.flush(queued, column.object, out);
    return steps;
}

template <int Dim>
HWY_ATTR void test(const SortedBrick& brick, std::uint32_t row, std::uint32_t first, std::uint32_t last,
                   Outcome* outcomes_of_steps)
{
    const Columns column(brick);
    const Rows<Dim> rows(column, row); // the second one isn't used
    for (std::uint32_t j = first; j < last; j += step_size, ++outcomes_of_steps) {
        hn::Vec<Words> gap[parts], unwanted;
        for (std::uint32_t part = 0; part < parts; ++part)
            rows.gaps(column, j + part * lanes16, gap[part], unwanted);
        const Hits hits = outcomes(gap, gap);
        *outcomes_of_steps = {static_cast<std::uint16_t>(of_row(hits.sure, 0)),
                              static_cast<std::uint16_t>(of_row(hits.ties, 0))};
    }
}
