// SPDX-License-Identifier: MIT
// Turns boxes into records, one unit of them at a time. Plain loops over columns, for the compiler to
// vectorise. No include guard: kernels.cpp includes it once per set, after scatter_vector-inl.hpp or
// scatter_plain-inl.hpp.

/// Loads the boxes [begin, begin + unit.count) into the unit's columns, and prefetches those of the next
/// unit, which past the last box is harmless.
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
    if constexpr (sizeof(T) == 4) {
        bool packed = stride == 2 * Dim * sizeof(T);
        for (int d = 0; d < Dim; ++d)
            packed &= lo[d] == lo[0] + static_cast<std::size_t>(d) * sizeof(T) &&
                      hi[d] == lo[0] + static_cast<std::size_t>(Dim + d) * sizeof(T);
        if (packed) i = load_packed<Dim>(reinterpret_cast<const T*>(lo[0]), unit);
    }
    for (; i < unit.count; ++i) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) * stride;
        prefetch(lo[0] + at + static_cast<std::ptrdiff_t>(unit_size) * stride);
        for (int d = 0; d < Dim; ++d) {
            unit.lo[d][i] = *reinterpret_cast<const T*>(lo[d] + at);
            unit.hi[d][i] = *reinterpret_cast<const T*>(hi[d] + at);
        }
    }
}

/// What a unit's boxes come to on a grid, on its axes.
struct Quantised
{
    std::int32_t cell[3][unit_size]; // the brick in which a box begins
    std::int32_t span[3][unit_size]; // how many bricks further it reaches
    std::uint32_t word[3][unit_size];
    std::uint32_t flags[unit_size];
    // Bits 0 and 1 mean a copy in the next brick on the second and third axis; 4 means more than that.
    std::uint16_t kind[unit_size];
};

/// Quantises both ends of the boxes on the grid's axis p. Returns whether a box is NaN or inverted there.
template <class T>
bool quantise_axis(const Grid<T>& grid, int p, Unit<T>& unit, Quantised& quantised)
{
    const int axis = grid.axis[p];
    const T origin = grid.origin[p], scale = grid.scale[p], last = grid.last[p];
    const T* __restrict lo = unit.lo[axis];
    const T* __restrict hi = unit.hi[axis];
    const std::uint32_t* __restrict object = unit.object;
    const std::uint32_t copy = copy_flag(axis), count = unit.count;
    std::int32_t* __restrict quantum_lo = unit.quantum_lo[p];
    std::int32_t* __restrict quantum_hi = unit.quantum_hi[p];
    std::int32_t* __restrict cell = quantised.cell[p];
    std::int32_t* __restrict span = quantised.span[p];
    std::uint32_t* __restrict word = quantised.word[p];
    std::uint32_t bad = 0;
    // What follows from the quanta of both ends.
    const auto pack = [&](std::uint32_t i, std::int32_t q, std::int32_t h, bool copied) {
        const std::int32_t c = q >> quanta_bits;
        const std::int32_t local_hi = h - (c << quanta_bits);
        quantum_lo[i] = q;
        quantum_hi[i] = h;
        cell[i] = c;
        span[i] = (h >> quanta_bits) - c;
        word[i] =
            pack_axis(copied ? 0 : -((q & (quanta - 1)) + 1), (local_hi < quanta ? local_hi : quanta) + 1);
    };
    if (grid.flat[p]) {
        // At the origin an end is certainly after a beginning; for 0 and 0, 2 and 2 the coordinates decide.
        for (std::uint32_t i = 0; i < count; ++i) {
            bad |= static_cast<std::uint32_t>(!(lo[i] <= hi[i]));
            const bool copied = (object[i] & copy) != 0;
            pack(i, !copied && lo[i] > origin ? 2 : 0, hi[i] > origin ? 2 : (hi[i] == origin ? 1 : 0),
                 copied);
        }
        return bad != 0;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
        bad |= static_cast<std::uint32_t>(!(lo[i] <= hi[i]));
        T a = (lo[i] - origin) * scale;
        T b = (hi[i] - origin) * scale;
        a = a > 0 ? a : T(0); // also if it is NaN
        b = b > 0 ? b : T(0);
        a = a < last ? a : last;
        b = b < last ? b : last;
        const bool copied = (object[i] & copy) != 0;
        pack(i, copied ? 0 : static_cast<std::int32_t>(a), static_cast<std::int32_t>(b), copied);
    }
    return bad != 0;
}

/// The record of the brick in which each box begins, and the kind of its copies.
template <int Dim, class T>
void write_first_records(const Grid<T>& grid, Unit<T>& unit, Quantised& quantised)
{
    auto& [cell, span, word, flags, kind] = quantised;
    const std::int32_t cells_x = grid.cells[0], cells_y = grid.cells[1];
    const std::uint32_t count = unit.count;
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
}

/// Behind the first records, the copies in the next brick on the second axis, on the third, and on both.
template <class T>
void write_copies(const Grid<T>& grid, const CopyLists& lists, const Quantised& quantised, Unit<T>& unit)
{
    const auto& [cell, span, word, flags, kind] = quantised;
    const auto next_word = [&, &cells = cell](int p, std::uint32_t i) {
        const std::int32_t local_hi = unit.quantum_hi[p][i] - ((cells[p][i] + 1) << quanta_bits);
        return pack_axis(0, local_hi + 1); // ends in the next brick: local_hi < quanta
    };
    const std::uint32_t step_y = static_cast<std::uint32_t>(grid.cells[0]);
    const std::uint32_t step_z = static_cast<std::uint32_t>(grid.cells[0] * grid.cells[1]);
    const std::uint32_t copy_y = copy_flag(grid.axis[1]), copy_z = copy_flag(grid.axis[2]);
    std::uint32_t records = unit.count;
    for (std::uint32_t k = 0; k < lists.ys; ++k, ++records) {
        const std::uint32_t i = lists.y[k];
        unit.record[records] = {{word[0][i], next_word(1, i), word[2][i]}, flags[i] | copy_y};
        unit.brick[records] = unit.brick[i] + step_y;
    }
    for (std::uint32_t k = 0; k < lists.zs; ++k, ++records) {
        const std::uint32_t i = lists.z[k];
        unit.record[records] = {{word[0][i], word[1][i], next_word(2, i)}, flags[i] | copy_z};
        unit.brick[records] = unit.brick[i] + step_z;
    }
    for (std::uint32_t k = 0; k < lists.yzs; ++k, ++records) {
        const std::uint32_t i = lists.yz[k];
        unit.record[records] = {{word[0][i], next_word(1, i), next_word(2, i)}, flags[i] | copy_y | copy_z};
        unit.brick[records] = unit.brick[i] + step_y + step_z;
    }
    unit.records = records;
}

/// Turns a unit of boxes into records, and lists what has to be stored where.
///
/// A coordinate v becomes the quantum (v - origin) * scale, clamped to the grid and rounded down. Each of
/// these steps is monotonic, rounding included: if v <= w, the quantum of v isn't greater than that of w. So
/// if quanta differ, the coordinates differ in the same direction. That is enough for exactness: if quanta
/// are equal, the sweep reports a tie. -ffp-contract=off keeps compilers from rounding elsewhere.
///
///     quantum     0 ...... 2^14 ...... 2 * 2^14 ...     brick = quantum >> 14
///     a box             |--------|                      begins in brick 0, reaches into brick 1: span 1
///
/// First come the records of the first brick of each box in turn. Then come the copies of boxes that extend
/// one brick further on the second axis, on the third, and on both: most copies are of this kind, and they
/// are made without a branch. Boxes that extend further, or into the next brick on the sweep axis, are listed
/// in `wide_box` for append_wide.
template <int Dim, class T>
void quantise(const Grid<T>& grid, Unit<T>& unit)
{
    Quantised quantised;
    unit.bad = false;
    for (int p = 0; p < Dim; ++p)
        unit.bad |= quantise_axis(grid, p, unit, quantised);
    write_first_records<Dim>(grid, unit, quantised);
    CopyLists lists;
    list_copies(quantised.kind, unit.count, lists, unit.wide_box);
    unit.wide = lists.wides;
    write_copies(grid, lists, quantised, unit);
}
