// SPDX-License-Identifier: MIT
#pragma once

#include "index/tree/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Returns null if the structure is valid, otherwise what isn't. For tests.
template <int Dim, class T>
const char* validate(const Parts<Dim, T>& parts);

} // namespace index
JOSTLE_NAMESPACE_END
