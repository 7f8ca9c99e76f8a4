// SPDX-License-Identifier: MIT
#pragma once

#include <memory_resource>

#include "jostle/box.hpp"
#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

/// The `Error` for box `index`, which the caller found to be NaN or inverted. `set` names the argument where
/// there are two ("a ", "b "), else "".
template <int Dim, Coordinate T>
[[noreturn]] void throw_bad_box(const Aabb<Dim, T>& box, std::uint64_t index, const char* set);

/// validate_boxes for one of two sets, named as in throw_bad_box.
template <int Dim, Coordinate T>
void validate_boxes_of(const BoxView<Dim, T>& boxes, const char* set);

/// Throws unless every array that is given has one element per object.
void check_filter(const Filter& filter, std::size_t size);
void check_filter(const CrossFilter& filter, std::size_t size_a, std::size_t size_b);

/// `set`, or the `Error` that this machine can't run it.
InstructionSet checked(InstructionSet set);

void check_memory(const std::pmr::memory_resource* memory);

/// The definition of the filters, but for `accept`. Between two sets `b` belongs to the second.
bool passes(const Filter& filter, std::uint32_t a, std::uint32_t b) noexcept;
bool passes(const CrossFilter& filter, std::uint32_t a, std::uint32_t b) noexcept;

JOSTLE_NAMESPACE_END
