// SPDX-License-Identifier: MIT
// Which instruction sets this build has code for and this machine can run.
#include <cstddef>
#include <cstdint>
#include <span>

#include "jostle/find_pairs.hpp"
#include "simd/highway.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

#ifdef JOSTLE_WITH_SIMD
/// Highway's targets that this processor and its operating system can run. Highway has this too, but in its
/// compiled library: with the compiler's own answer, its headers are all that is needed, also for another
/// system's program. What the compilers can't be asked about (F16C) every processor with FMA has.
std::int64_t runnable_targets() noexcept
{
#if HWY_ARCH_X86 && defined(__GNUC__)
    const auto sse4 = [] {
        return __builtin_cpu_supports("sse4.1") && __builtin_cpu_supports("sse4.2") &&
               __builtin_cpu_supports("aes") && __builtin_cpu_supports("pclmul");
    };
    const auto avx2 = [] {
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
               __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    };
    const auto avx512 = [] {
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512cd");
    };
    __builtin_cpu_init(); // this may run before the program's own constructors
    std::int64_t runnable = HWY_SCALAR | HWY_EMU128;
    if (sse4()) {
        runnable |= HWY_SSE4;
        if (avx2()) {
            runnable |= HWY_AVX2;
            if (avx512()) runnable |= HWY_AVX3;
        }
    }
    // What the compiler was told to rely on is there, or not even main() could run.
    return runnable | HWY_ENABLED_BASELINE;
#elif HWY_ARCH_X86
    return hwy::SupportedTargets();
#else
    return HWY_TARGETS; // the compiler's baseline
#endif
}
#endif

/// The best one first.
struct Supported
{
    InstructionSet sets[4]; // of one processor's family
    std::size_t count = 0;

    Supported()
    {
#ifdef JOSTLE_WITH_SIMD
        const std::int64_t runnable = HWY_TARGETS & runnable_targets();
        if ((runnable & HWY_AVX3) != 0) sets[count++] = InstructionSet::avx512;
        if ((runnable & HWY_AVX2) != 0) sets[count++] = InstructionSet::avx2;
        if ((runnable & HWY_SSE4) != 0) sets[count++] = InstructionSet::sse4;
        if ((runnable & HWY_NEON) != 0) sets[count++] = InstructionSet::neon;
        if ((runnable & HWY_WASM) != 0) sets[count++] = InstructionSet::wasm_simd;
        // Missing where the compiler is told that every machine has more.
        if ((runnable & (HWY_SCALAR | HWY_EMU128)) != 0) sets[count++] = InstructionSet::scalar;
#else
        sets[count++] = InstructionSet::scalar;
#endif
    }
};

} // namespace

std::span<const InstructionSet> supported_instruction_sets() noexcept
{
    static const Supported all;
    return {all.sets, all.count};
}

const char* name(InstructionSet set) noexcept
{
    switch (set) {
    case InstructionSet::scalar:
        return "scalar";
    case InstructionSet::sse4:
        return "sse4";
    case InstructionSet::avx2:
        return "avx2";
    case InstructionSet::avx512:
        return "avx512";
    case InstructionSet::neon:
        return "neon";
    case InstructionSet::wasm_simd:
        return "wasm_simd";
    }
    return "unknown";
}

JOSTLE_NAMESPACE_END
