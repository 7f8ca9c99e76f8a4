// SPDX-License-Identifier: MIT
// Compiled once per instruction set: Highway's foreach_target includes this file again for each, and the part
// between HWY_BEFORE_NAMESPACE and HWY_AFTER_NAMESPACE becomes that set's kernels. HWY_ONCE marks the choice
// at run time.
#ifdef JOSTLE_WITH_SIMD
// SSSE3 has no unsigned 32-bit minimum and no machine of its own left to serve. SVE's vectors have no length
// at compile time, and machines with SVE have NEON.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/kernels.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
#else
#define HWY_BEFORE_NAMESPACE() static_assert(true, "")
#define HWY_AFTER_NAMESPACE() static_assert(true, "")
#define HWY_ATTR
#define HWY_NAMESPACE plain
#define HWY_ONCE 1
#endif

#ifndef JOSTLE_KERNELS_ONCE
#define JOSTLE_KERNELS_ONCE
#include <algorithm>
#include <bit>
#include <cstdint>

#include "engine/kernels/kernels.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {

/// For each mask of 8 lanes the numbers of its set lanes in ascending order. Our own table: the one inside
/// Highway 1.0.3 is copied to the stack at every use by g++ 12.
struct CompressOrder
{
    alignas(64) std::uint8_t of8[256][8];
    alignas(64) std::uint8_t of4[16][16]; // of lanes of four bytes, in bytes
    constexpr CompressOrder() : of8(), of4()
    {
        for (unsigned mask = 0; mask < 16; ++mask) {
            unsigned next = 0;
            for (unsigned lane = 0; lane < 4; ++lane)
                if ((mask >> lane) & 1)
                    for (unsigned byte = 0; byte < 4; ++byte)
                        of4[mask][next++] = static_cast<std::uint8_t>(4 * lane + byte);
        }
        for (unsigned mask = 0; mask < 256; ++mask) {
            unsigned next = 0;
            for (unsigned lane = 0; lane < 8; ++lane)
                if ((mask >> lane) & 1) of8[mask][next++] = static_cast<std::uint8_t>(lane);
        }
    }
};
[[maybe_unused]] constexpr CompressOrder compress_order;

} // namespace
} // namespace engine
JOSTLE_NAMESPACE_END
#endif

#undef JOSTLE_KERNEL_WIDE
#undef JOSTLE_KERNEL_SCALAR
#undef JOSTLE_KERNEL_SET
#undef JOSTLE_KERNEL_LANES16
#undef JOSTLE_KERNEL_LANES32
#if !defined(JOSTLE_WITH_SIMD) || HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
#define JOSTLE_KERNEL_WIDE 0
#define JOSTLE_KERNEL_SCALAR 1
#define JOSTLE_KERNEL_SET InstructionSet::scalar
#elif HWY_TARGET == HWY_AVX3
#define JOSTLE_KERNEL_WIDE 1
#define JOSTLE_KERNEL_SCALAR 0
#define JOSTLE_KERNEL_SET InstructionSet::avx512
#else
#define JOSTLE_KERNEL_WIDE 0
#define JOSTLE_KERNEL_SCALAR 0
#if HWY_TARGET == HWY_AVX2
#define JOSTLE_KERNEL_SET InstructionSet::avx2
#define JOSTLE_KERNEL_LANES16 16
#define JOSTLE_KERNEL_LANES32 8
#else
#define JOSTLE_KERNEL_LANES16 8
#define JOSTLE_KERNEL_LANES32 4
#if HWY_TARGET == HWY_SSE4
#define JOSTLE_KERNEL_SET InstructionSet::sse4
#elif HWY_TARGET == HWY_NEON
#define JOSTLE_KERNEL_SET InstructionSet::neon
#elif HWY_TARGET == HWY_WASM
#define JOSTLE_KERNEL_SET InstructionSet::wasm_simd
#else
#error "Jostle has no kernels for this Highway target; add it to HWY_DISABLED_TARGETS or name it here"
#endif
#endif
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {
namespace HWY_NAMESPACE {
#if !JOSTLE_KERNEL_SCALAR
namespace hn = hwy::HWY_NAMESPACE;
#endif
#include "engine/kernels/kernels-inl.hpp"
} // namespace HWY_NAMESPACE
} // namespace
} // namespace engine
JOSTLE_NAMESPACE_END
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
JOSTLE_NAMESPACE_BEGIN

namespace {

struct Supported
{
    InstructionSet sets[4];
    const engine::Kernels* kernels[4];
    std::size_t count = 0;
    void add(const engine::Kernels& table)
    {
        sets[count] = table.set;
        kernels[count++] = &table;
    }
    Supported()
    {
#ifdef JOSTLE_WITH_SIMD
#if HWY_ARCH_X86
        const auto runnable = hwy::SupportedTargets();
#endif
#if HWY_TARGETS & HWY_AVX3
        if (runnable & HWY_AVX3) add(engine::N_AVX3::kernels());
#endif
#if HWY_TARGETS & HWY_AVX2
        if (runnable & HWY_AVX2) add(engine::N_AVX2::kernels());
#endif
#if HWY_TARGETS & HWY_SSE4
        if (runnable & HWY_SSE4) add(engine::N_SSE4::kernels());
#endif
#if HWY_TARGETS & HWY_NEON
        add(engine::N_NEON::kernels());
#endif
#if HWY_TARGETS & HWY_WASM
        add(engine::N_WASM::kernels());
#endif
#if HWY_TARGETS & HWY_SCALAR
        add(engine::N_SCALAR::kernels());
#elif HWY_TARGETS & HWY_EMU128
        add(engine::N_EMU128::kernels());
#endif
#else
        add(engine::plain::kernels());
#endif
    }
};

const Supported& supported()
{
    static const Supported all;
    return all;
}

} // namespace

std::span<const InstructionSet> supported_instruction_sets() noexcept
{
    return {supported().sets, supported().count};
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

const engine::Kernels& engine::kernels_for(InstructionSet set) noexcept
{
    const Supported& all = supported();
    for (std::size_t i = 0; i < all.count; ++i)
        if (all.sets[i] == set) return *all.kernels[i];
    return *all.kernels[0];
}

JOSTLE_NAMESPACE_END
#endif
