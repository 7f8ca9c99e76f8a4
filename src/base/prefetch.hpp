// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Bytes that come from memory together.
inline constexpr std::size_t cache_line = 64;

/// Has the cache get what will be read soon. It is only a hint: the address may be anywhere, also null.
inline void prefetch([[maybe_unused]] const void* address) noexcept
{
#if defined(__GNUC__)
    __builtin_prefetch(address);
#endif
}

/// The same for something longer than a cache line.
inline void prefetch(const void* first, std::size_t bytes) noexcept
{
    for (std::size_t at = 0; at < bytes; at += cache_line)
        prefetch(static_cast<const std::byte*>(first) + at);
}

/// Has the cache get what will be written soon.
inline void prefetch_to_write([[maybe_unused]] void* address) noexcept
{
#if defined(__GNUC__)
    __builtin_prefetch(address, 1);
#endif
}

JOSTLE_NAMESPACE_END
