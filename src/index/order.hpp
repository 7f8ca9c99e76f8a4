// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "index/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// The order in which a page's objects go into leaves of 16, by their positions in `records`: neighbours
/// come together, so that the leaves are full and small.
///
/// Cost      count * log2(count / 16) steps of sorting a few numbers, which `sort_few` does.
template <int Dim, class T>
void order_objects(const Record<Dim, T>* records, std::uint32_t count,
                   void (*sort_few)(std::uint32_t* numbers, std::uint32_t count),
                   std::uint8_t* order) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
