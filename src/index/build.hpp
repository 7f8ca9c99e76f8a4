// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "index/key_order.hpp"
#include "index/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Fills a tree that is empty, whose `page_of` has room for the ids (without ids, for the boxes' positions):
/// all objects are sorted by the leading digits of their keys, on all threads, and the sequence is cut into
/// pages. If it throws, the parts are to be cleared.
template <int Dim, class T>
void build(Parts<Dim, T>& parts, std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes,
           KeyMemory& memory);

} // namespace index
JOSTLE_NAMESPACE_END
