// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Objects are all over the place: loops ask for those to come.
constexpr std::size_t fetch_ahead = 16;
inline void fetch(const void* address) noexcept
{
#ifdef __GNUC__
    __builtin_prefetch(address);
#else
    (void)address;
#endif
}

} // namespace world
JOSTLE_NAMESPACE_END
