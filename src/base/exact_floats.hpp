// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#if defined(__SSE2__) || defined(_M_X64)
#include <xmmintrin.h>
#endif

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// While it lives, denormal numbers aren't flushed to zero on this thread. Hosts that flush them (some do it
/// for speed, and linking with -ffast-math does it) do so thread by thread, so boxes that are a denormal
/// apart would touch on some threads only. Changes nothing if denormals aren't flushed.
class ExactFloats
{
  public:
    ExactFloats() noexcept : before_(read())
    {
        if ((before_ & flushing) != 0) write(before_ & ~flushing);
    }
    ~ExactFloats()
    {
        if ((before_ & flushing) != 0) write(before_);
    }
    ExactFloats(const ExactFloats&) = delete;
    ExactFloats& operator=(const ExactFloats&) = delete;

  private:
#if defined(__SSE2__) || defined(_M_X64)
    static constexpr std::uint64_t flushing = 0x8040; // FTZ and DAZ of MXCSR
    static std::uint64_t read() noexcept { return _mm_getcsr(); }
    static void write(std::uint64_t mode) noexcept { _mm_setcsr(static_cast<unsigned>(mode)); }
#elif defined(__aarch64__) && defined(__GNUC__)
    static constexpr std::uint64_t flushing = std::uint64_t{1} << 24; // FZ of FPCR
    static std::uint64_t read() noexcept
    {
        std::uint64_t mode;
        __asm__ volatile("mrs %0, fpcr" : "=r"(mode));
        return mode;
    }
    static void write(std::uint64_t mode) noexcept { __asm__ volatile("msr fpcr, %0" : : "r"(mode)); }
#else
    static constexpr std::uint64_t flushing = 0;
    static std::uint64_t read() noexcept { return 0; }
    static void write(std::uint64_t) noexcept {}
#endif
    std::uint64_t before_;
};

JOSTLE_NAMESPACE_END
