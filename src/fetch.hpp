// SPDX-License-Identifier: MIT
#pragma once

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Has the cache get what will be read soon.
inline void fetch(const void* address) noexcept
{
#ifdef __GNUC__
    __builtin_prefetch(address);
#else
    (void)address;
#endif
}

JOSTLE_NAMESPACE_END
