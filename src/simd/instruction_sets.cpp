// SPDX-License-Identifier: MIT
// Which instruction sets this build has code for and this machine can run.
#include <cstddef>
#include <span>

#include "jostle/find_pairs.hpp"
#include "simd/highway.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

/// The best one first.
struct Supported
{
    InstructionSet sets[4]; // of one processor's family
    std::size_t count = 0;

    Supported()
    {
#ifdef JOSTLE_WITH_SIMD
#if HWY_ARCH_X86
        const auto runnable = HWY_TARGETS & hwy::SupportedTargets();
#else
        const auto runnable = HWY_TARGETS;
#endif
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
