// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>

#include "base/box.hpp"
#include "jostle/box.hpp"
#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

/// The `Error` for box `index`, which the caller found to be NaN or inverted. `set` names the argument where
/// there are two ("a ", "b "), else "".
template <int Dim, Coordinate T>
[[noreturn]] void throw_bad_box(const Aabb<Dim, T>& box, std::uint64_t index, const char* set);

/// Throws that error unless the box is valid.
template <int Dim, Coordinate T>
void check_box(const Aabb<Dim, T>& box, std::uint64_t index, const char* set)
{
    if (!valid(box)) throw_bad_box(box, index, set);
}

/// validate_boxes for one of two sets, named as in throw_bad_box.
template <int Dim, Coordinate T>
void validate_boxes_of(const BoxView<Dim, T>& boxes, const char* set);

/// Throws an `Error` unless part k of `count` items is [offsets[k], offsets[k + 1]): a "scene" of "box" 0 and
/// further "boxes".
void check_offsets(std::span<const std::uint64_t> offsets, const char* part, const char* item,
                   std::uint64_t count, const char* items);

void check_memory(const std::pmr::memory_resource* memory);

/// `set`, or the `Error` that this machine can't run it.
InstructionSet checked(InstructionSet set);

JOSTLE_NAMESPACE_END
