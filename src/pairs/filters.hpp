// SPDX-License-Identifier: MIT
#pragma once

#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Throws unless every array that is given has one element per object.
void check_filter(const Filter& filter, std::size_t size);
void check_filter(const SceneFilter& filter, std::size_t size);
void check_filter(const CrossFilter& filter, std::size_t size_a, std::size_t size_b);

/// The definition of the filters, without `accept`. Between two sets `b` belongs to the second.
bool passes(const Filter& filter, std::size_t a, std::size_t b) noexcept;
bool passes(const SceneFilter& filter, std::size_t a, std::size_t b) noexcept; // positions among all boxes
bool passes(const CrossFilter& filter, std::size_t a, std::size_t b) noexcept;

JOSTLE_NAMESPACE_END
