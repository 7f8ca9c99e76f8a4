// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "engine/record.hpp"
#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// Boxes are turned into records `unit_size` at a time, so that a unit's working arrays stay in the L1 cache.
/// Records are stored unit by unit, so that their order doesn't depend on how units are distributed.
inline constexpr std::uint32_t unit_size = 256;

/// One unit between boxes and records, with one array per column. Arrays over axes are in the user's order of
/// axes before quantising, and in the grid's order, the sweep axis first, after it.
template <class T>
struct Unit
{
    std::uint32_t count;
    alignas(64) T lo[3][unit_size];
    T hi[3][unit_size];
    std::uint32_t object[unit_size]; // with the side and, in a nested grid, the copy flags it came with

    // Filled by Kernels::quantise.
    std::int32_t quantum_lo[3][unit_size], quantum_hi[3][unit_size];
    bool bad; // some box is NaN or inverted
    std::uint32_t records;
    std::uint32_t wide;                 // boxes that extend further than the copies in `record`
    Record record[4 * unit_size];       // every box in its first brick, then copies
    std::uint32_t brick[4 * unit_size]; // of each record
    std::uint16_t wide_box[unit_size];  // their numbers in the unit
};

// ---- The sweep ----
//
// Records are sorted by where they begin on the sweep axis. Each in turn is a *row*: it is tested against the
// following records that may begin before it ends, its *window*. This loop has three forms, for three kinds
// of instruction sets: sweep_wide-inl.hpp, sweep_vector-inl.hpp and sweep_plain-inl.hpp. They produce the
// same bytes, since all of them do this:
//
//     records     0 1 2 3 4 5 6 . . . . . . . 14 15  16 17 18 . . .
//     row 2       - - - c c c c c c c c c c c c  c    c  c |           - masked, c candidate, | the window's
//     row 3           - - - - c c c c c c c c c c c  c    c  c  c  c |
//                |<-------- a step of 16 --------->|<----- a step ...
//
// - Rows come in couples, i even, which share each step: candidates are loaded once for both. The couple's
//   window ends where the longer of the two does.
// - The first step begins at the multiple of 4 at or before i + 1. Candidates before the row's successor are
//   masked in that step (-), and only in it.
// - Nothing is masked after a window's end. Those records begin after the row's end, so they fail the test on
//   the sweep axis by themselves; so does the padding at the end. So a step may extend past the end of the
//   records, but not past that of the padding.
// - Two records that share a flag make neither a pair nor a tie: the pair is another brick's, or both are of
//   one set (record.hpp explains why, and docs/inside/engine.md why each pair is some brick's).
// - Pairs are written step by step: first those of row i with the step's candidates in their order, then
//   those of row i + 1. Ties go to a separate list, in the same order.
// - Room for pairs and ties is tested once in `sweep_segment` steps. If it may not be enough, `make_room` is
//   called, after all pairs found so far were written.

inline constexpr std::uint32_t step_size = 16;      // candidates tested at once
inline constexpr std::uint32_t sweep_segment = 128; // steps between two tests of the room left
/// The most pairs or ties of a segment, plus what stores of whole registers write after them.
inline constexpr std::uint32_t sweep_room = sweep_segment * 2 * step_size + 16;
inline constexpr std::uint32_t tie_capacity = 2 * sweep_room;

/// Where the sweep writes pairs.
struct PairOutput
{
    Pair* next; // is written next
    Pair* end;
    Pair* ties; // objects, with sides, whose quantised bounds couldn't decide
    std::uint32_t tie_count;
    /// Makes room for `sweep_room` pairs and ties. Returns false to end the sweep.
    bool (*make_room)(PairOutput& self);
};

/// The records of one brick, sorted by the bucket of their lower bound on the sweep axis.
struct SortedBrick
{
    std::uint32_t count;
    std::uint32_t* columns;          // in the layout of the form of the sweep: made by Kernels::arrange
    const std::uint32_t* window_end; // of each record: where the bucket of its upper bound ends
};
inline constexpr std::uint32_t columns_per_record = 5; // words of `columns` for each record and padding
/// The number of records with padding: whole steps, and one more for a step that begins between two.
inline constexpr std::uint32_t padded(std::uint32_t count)
{
    return (count / step_size + 2) * step_size;
}

/// What a row touches among the 16 candidates of a step: certainly, and perhaps.
struct Outcome
{
    std::uint16_t sure, ties;
};

/// How many numbers Kernels::sort_few takes.
inline constexpr std::uint32_t most_sorted = 128;

/// The hot loops of one instruction set. All sets produce the same bytes.
struct Kernels
{
    InstructionSet set;
    /// Loads the boxes [begin, begin + unit.count) into the unit's columns.
    void (*load_2f)(const BoxView<2, float>&, std::size_t begin, Unit<float>&);
    void (*load_2d)(const BoxView<2, double>&, std::size_t begin, Unit<double>&);
    void (*load_3f)(const BoxView<3, float>&, std::size_t begin, Unit<float>&);
    void (*load_3d)(const BoxView<3, double>&, std::size_t begin, Unit<double>&);
    void (*quantise_2f)(const Grid<float>&, Unit<float>&);
    void (*quantise_2d)(const Grid<double>&, Unit<double>&);
    void (*quantise_3f)(const Grid<float>&, Unit<float>&);
    void (*quantise_3d)(const Grid<double>&, Unit<double>&);
    /// Arranges sorted records (padded with padding_record) as columns.
    void (*arrange)(const Record* records, SortedBrick& brick);
    /// Sweeps the rows first <= i < last; see above. `first` is even; so is `last` unless it is the brick's
    /// count. Returns the number of steps, each of which tested two rows.
    std::uint64_t (*sweep_2)(const SortedBrick& brick, std::uint32_t first, std::uint32_t last,
                             PairOutput& out);
    std::uint64_t (*sweep_3)(const SortedBrick& brick, std::uint32_t first, std::uint32_t last,
                             PairOutput& out);
    /// Tests one row against any candidates: one outcome for each step that begins in [first, last), where
    /// `first` is a multiple of 4. For rows whose candidates don't follow them: see apart.hpp.
    void (*test_2)(const SortedBrick& brick, std::uint32_t row, std::uint32_t first, std::uint32_t last,
                   Outcome* outcomes);
    void (*test_3)(const SortedBrick& brick, std::uint32_t row, std::uint32_t first, std::uint32_t last,
                   Outcome* outcomes);
    /// Sorts at most `most_sorted` numbers, no two the same, ascending.
    void (*sort_few)(std::uint32_t* numbers, std::uint32_t count);

    template <int Dim, class T>
    auto load() const noexcept
    {
        if constexpr (Dim == 2 && sizeof(T) == 4)
            return load_2f;
        else if constexpr (Dim == 2)
            return load_2d;
        else if constexpr (sizeof(T) == 4)
            return load_3f;
        else
            return load_3d;
    }
    template <int Dim, class T>
    auto quantise() const noexcept
    {
        if constexpr (Dim == 2 && sizeof(T) == 4)
            return quantise_2f;
        else if constexpr (Dim == 2)
            return quantise_2d;
        else if constexpr (sizeof(T) == 4)
            return quantise_3f;
        else
            return quantise_3d;
    }
    template <int Dim>
    auto sweep() const noexcept
    {
        return Dim == 2 ? sweep_2 : sweep_3;
    }
    template <int Dim>
    auto test() const noexcept
    {
        return Dim == 2 ? test_2 : test_3;
    }
};

/// For one of supported_instruction_sets().
const Kernels& kernels_for(InstructionSet set) noexcept;

} // namespace engine
JOSTLE_NAMESPACE_END
