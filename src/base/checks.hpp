// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <string>

#include "base/box.hpp"
#include "jostle/box.hpp"
#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

/// The `Error` for box `index`, which the caller found to be NaN or inverted. `set` names the argument where
/// there are several that it could be in ("a ", "b ", "to be joined "), else "". `name` is what else the box
/// is known by (" (id 7)").
template <int Dim, Coordinate T>
[[noreturn]] void throw_bad_box(const Aabb<Dim, T>& box, std::uint64_t index, const char* set,
                                const std::string& name = {});

/// Throws that error unless the box is valid.
template <int Dim, Coordinate T>
void check_box(const Aabb<Dim, T>& box, std::uint64_t index, const char* set)
{
    if (!valid(box)) throw_bad_box(box, index, set);
}

/// Throws for a view of some boxes with a null pointer. `set` as in throw_bad_box.
template <int Dim, Coordinate T>
void check_pointers(const BoxView<Dim, T>& boxes, const char* set = "");

/// check_boxes for one of several sets, named as in throw_bad_box, and for boxes with ids, where there are
/// any.
template <int Dim, Coordinate T>
void check_boxes_of(const BoxView<Dim, T>& boxes, const char* set, std::span<const std::uint32_t> ids = {});

/// Throws an `Error` unless there is an id for each box.
void check_one_id_each(std::size_t ids, std::size_t boxes);

/// Throws an `Error` unless part k of `count` items is [offsets[k], offsets[k + 1]): a "scene" of "box" 0 and
/// further "boxes".
void check_offsets(std::span<const std::uint64_t> offsets, const char* part, const char* item,
                   std::uint64_t count, const char* items);

void check_memory(const std::pmr::memory_resource* memory);

/// `set`, or the `Error` that this machine can't run it.
InstructionSet checked(InstructionSet set);

JOSTLE_NAMESPACE_END
