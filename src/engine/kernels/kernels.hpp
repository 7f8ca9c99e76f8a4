// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "engine/record.hpp"
#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// Boxes are turned into records `unit_size` at a time: all of a unit's working arrays stay in the L1 cache.
/// Records are stored unit by unit, so that their order doesn't depend on how units are shared out.
inline constexpr std::uint32_t unit_size = 256;

/// One unit on its way from boxes to records, one array per column.
template <class T>
struct Unit
{
    std::uint32_t count;
    T lo[3][unit_size], hi[3][unit_size];
    std::uint32_t object[unit_size]; // with the side and, in a nested grid, the copy flags it came with

    // Filled by Kernels::quantise.
    std::int32_t quantum_lo[3][unit_size], quantum_hi[3][unit_size];
    bool bad; // some box is NaN or inverted
    std::uint32_t records;
    std::uint32_t wide; // boxes over more bricks than two across the sweep axis, listed in `wide_box`
    Record record[4 * unit_size];
    std::uint32_t brick[4 * unit_size];
    std::uint16_t wide_box[unit_size];
};

/// Where the sweep leaves pairs. The kernel writes at `next` and calls `make_room` when fewer than
/// `sweep_room` pairs or ties fit; that returns false to end the sweep.
struct PairOutput
{
    Pair* next;
    Pair* end;
    Pair* ties; // objects, with sides, whose quantised bounds couldn't decide
    std::uint32_t tie_count;
    bool (*make_room)(PairOutput& self);
};
inline constexpr std::uint32_t sweep_segment =
    128; // blocks of 16 candidates between two looks at the room left
inline constexpr std::uint32_t sweep_room = sweep_segment * 2 * 16 + 16;
inline constexpr std::uint32_t tie_capacity = 2 * sweep_room;

/// The records of one brick, sorted by the bucket of their lower bound on the sweep axis, padded to whole
/// blocks of 16 and one more. `columns` is the kernel's own layout; `window_end[i]` is where the bucket of
/// record i's upper bound ends.
struct SortedBrick
{
    std::uint32_t count;
    std::uint32_t* columns; // room for columns_per_record words per record and padding
    const std::uint32_t* window_end;
};
inline constexpr std::uint32_t columns_per_record = 5;
inline constexpr std::uint32_t block_size = 16;
inline constexpr std::uint32_t padded(std::uint32_t count)
{
    return (count / block_size + 2) * block_size;
}

/// The hot loops of one instruction set. All sets leave the same bytes.
struct Kernels
{
    InstructionSet set;
    /// Boxes [begin, begin + unit.count) into the unit's columns.
    void (*load_2f)(const BoxView<2, float>&, std::size_t begin, Unit<float>&);
    void (*load_2d)(const BoxView<2, double>&, std::size_t begin, Unit<double>&);
    void (*load_3f)(const BoxView<3, float>&, std::size_t begin, Unit<float>&);
    void (*load_3d)(const BoxView<3, double>&, std::size_t begin, Unit<double>&);
    void (*quantise_2f)(const Grid<float>&, Unit<float>&);
    void (*quantise_2d)(const Grid<double>&, Unit<double>&);
    void (*quantise_3f)(const Grid<float>&, Unit<float>&);
    void (*quantise_3d)(const Grid<double>&, Unit<double>&);
    /// From sorted records (padded with padding_record) to columns.
    void (*arrange)(const Record* records, SortedBrick& brick);
    /// All pairs (i, j) with first <= i < last and i < j, in order of i's couple (two neighbouring rows, from
    /// an even one on), j's block of 16, i, j. `first` is even; so is `last` unless it is the brick's count.
    /// Returns the number of blocks visited.
    std::uint64_t (*sweep_2)(const SortedBrick& brick, std::uint32_t first, std::uint32_t last,
                             PairOutput& out);
    std::uint64_t (*sweep_3)(const SortedBrick& brick, std::uint32_t first, std::uint32_t last,
                             PairOutput& out);

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
};

/// For one of supported_instruction_sets(); any other gets the best supported one.
const Kernels& kernels_for(InstructionSet set) noexcept;

} // namespace engine
JOSTLE_NAMESPACE_END
