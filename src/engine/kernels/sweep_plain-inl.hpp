// SPDX-License-Identifier: MIT
// The sweep in plain C++, for machines and builds without vectors: four 16-bit lanes in a 64-bit word.
// kernels.hpp describes what all forms of the sweep do. No include guard: kernels.cpp includes it once.
//
// Bounds have 15 bits, so bit 15 of a lane is free to catch the borrow of a subtraction, the guard:
//
//       1 hi_j  | 1 hi_j+1  | ...     candidates' upper bounds, the guard set
//     - 0 lo_i  | 0 lo_i    | ...     the row's lower bound in every lane
//     = g ....  | g ....    | ...     g stays 1 where hi_j >= lo_i, and no borrow leaves a lane
//
// A pair whose guards all stay 1 touches or is a tie; such pairs are few, and are tested one by one.

/// Columns of lanes: bounds of each axis, and the flags.
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
                // The lo of padding becomes 0x7fff, above every hi, which is enough to keep it from
                // overlapping.
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

/// The tests of one row against the 16 candidates of a step.
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
    /// Which of the 16 candidates from j on touch or tie, as a bit mask.
    unsigned hits(const Columns& column, std::uint32_t j) const
    {
        unsigned mask = 0;
        for (std::uint32_t k = 0; k < 4; ++k) {
            const std::uint32_t word = j / 4 + k;
            // The bit stays if no flag is shared.
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
    std::uint64_t steps = 0;
    for (std::uint32_t i = first; i < last; i += 2) {
        const Row<Dim> row0(column, i), row1(column, i + 1);
        std::uint32_t j = (i + 1) & ~3u;
        unsigned behind0 = 0xffffu << (i + 1 - j);
        unsigned behind1 = 0xffffu << (i + 2 - j);
        const std::uint32_t end = std::max(brick.window_end[i], brick.window_end[i + 1]);
        while (j < end) {
            if (static_cast<std::size_t>(out.end - out.next) < sweep_room ||
                out.tie_count > tie_capacity - sweep_room) {
                if (!out.make_room(out)) return steps;
            }
            const std::uint32_t stop = std::min(end, j + sweep_segment * step_size);
            steps += (stop - j + step_size - 1) / step_size;
            Pair* next = out.next;
            for (; j < stop; j += step_size) {
                next = row0.emit(next, row0.hits(column, j) & behind0, column, j, out);
                next = row1.emit(next, row1.hits(column, j) & behind1, column, j, out);
                behind0 = behind1 = 0xffff;
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
    const Row<Dim> own(column, row);
    for (std::uint32_t j = first; j < last; j += step_size, ++outcomes) {
        const unsigned hits = own.hits(column, j);
        unsigned ties = 0;
        for (unsigned left = hits; left != 0; left &= left - 1)
            if (own.is_tie(column, j + static_cast<std::uint32_t>(std::countr_zero(left))))
                ties |= left & (0u - left);
        *outcomes = {static_cast<std::uint16_t>(hits ^ ties), static_cast<std::uint16_t>(ties)};
    }
}
