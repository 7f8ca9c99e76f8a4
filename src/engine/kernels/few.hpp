// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/kernels/kernels.hpp"
#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

// For few boxes a grid costs more than it saves. Then every box is tested against every other, in the user's
// coordinates, without quantising and without ties.

/// Up to this many boxes, both sets together, count as few. It is the same on every instruction set, since
/// the order of the pairs depends on it. docs/decisions/037 has the measurements.
inline constexpr std::uint32_t few_boxes = 128;
/// The greatest number of pairs among them, plus what stores of whole registers write after them.
inline constexpr std::uint32_t few_room = few_boxes * (few_boxes - 1) / 2 + 8;
static_assert(few_boxes <= unit_size - 16, "padding follows the last box");

// Up to this many boxes of one set against many of another are also tested directly: with a grid, all of the
// many would be sorted for the few.
inline constexpr std::size_t few_rows = 16;
/// ... as long as that takes at most this many tests, since one thread does them. All threads search a grid.
inline constexpr std::uint64_t most_tests = 1u << 20;

/// Whether no grid is made.
template <int Dim, class T>
[[nodiscard]] bool are_few(const Boxes<Dim, T>& boxes) noexcept
{
    return boxes.size() <= few_boxes ||
           (boxes.cross && boxes.a.size() <= few_rows && boxes.a.size() * boxes.b.size() <= most_tests);
}

/// Writes the pairs of `rows` with the boxes in the unit's columns, ascending by (a, b), and returns their
/// end. Within one set (`cross` false) the columns hold the rows themselves, and each is tested against those
/// after it. Overwrites the columns after the last box. Null if a box is NaN or inverted.
template <int Dim, class T>
using FindAmongFew = Pair* (*)(const BoxView<Dim, T>& rows, Unit<T>& unit, bool cross, Pair* out);

/// For one of supported_instruction_sets(). All sets produce the same pairs.
template <int Dim, class T>
FindAmongFew<Dim, T> find_among_few_with(InstructionSet set) noexcept;

/// The pairs of few boxes, or null: see above.
template <int Dim, class T>
Pair* find_among_few(InstructionSet set, const Boxes<Dim, T>& boxes, Unit<T>& unit, Pair* out)
{
    const BoxView<Dim, T>& columns = boxes.cross ? boxes.b : boxes.a;
    unit.count = static_cast<std::uint32_t>(columns.size());
    if (unit.count != 0) kernels_for(set).template load<Dim, T>()(columns, 0, unit);
    const BoxView<Dim, T> rows = boxes.a.subview(0, std::min(boxes.a.size(), boxes.loners));
    return find_among_few_with<Dim, T>(set)(rows, unit, boxes.cross, out);
}

} // namespace engine
JOSTLE_NAMESPACE_END
