// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <new>
#ifdef _WIN32
#include <malloc.h>
#endif

/// Replaces the global operator new by one that counts and can be told to fail. One file of a program
/// includes it. The thread sanitizer brings its own and refuses a second one: JOSTLE_OWN_NEW is 0 there.

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define JOSTLE_OWN_NEW 0
#endif
#endif
#ifndef JOSTLE_OWN_NEW
#define JOSTLE_OWN_NEW 1
#endif

namespace global_new {

constexpr std::uint64_t never = std::numeric_limits<std::uint64_t>::max();
inline std::atomic<std::uint64_t> calls{0};
inline std::atomic<std::uint64_t> fail_at{never};    ///< from this call on, all fail
inline std::atomic<std::uint64_t> fail_until{never}; ///< up to this one, which doesn't
inline std::atomic<std::int64_t> blocks{0};          ///< that are out
inline bool fails() noexcept
{
    const std::uint64_t call = calls++;
    return call >= fail_at && call < fail_until;
}

// Windows has no std::aligned_alloc, and what its own function gives must be returned to its twin.
#ifdef _WIN32
inline void* aligned(std::size_t size, std::size_t alignment)
{
    return _aligned_malloc(size, alignment);
}
inline void free_aligned(void* memory)
{
    _aligned_free(memory);
}
#else
inline void* aligned(std::size_t size, std::size_t alignment)
{
    return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}
inline void free_aligned(void* memory)
{
    std::free(memory);
}
#endif

} // namespace global_new

#if JOSTLE_OWN_NEW
// Not inlined, or the compiler takes malloc and delete for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size)
{
    if (global_new::fails()) throw std::bad_alloc();
    void* const memory = std::malloc(size == 0 ? 1 : size);
    if (memory == nullptr) throw std::bad_alloc();
    ++global_new::blocks;
    return memory;
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment)
{
    if (global_new::fails()) throw std::bad_alloc();
    void* const memory = global_new::aligned(size, static_cast<std::size_t>(alignment));
    if (memory == nullptr) throw std::bad_alloc();
    ++global_new::blocks;
    return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    if (memory != nullptr) --global_new::blocks;
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    if (memory != nullptr) --global_new::blocks;
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept
{
    if (memory != nullptr) --global_new::blocks;
    global_new::free_aligned(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
    if (memory != nullptr) --global_new::blocks;
    global_new::free_aligned(memory);
}
#endif
