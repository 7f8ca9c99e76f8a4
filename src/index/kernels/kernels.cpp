// SPDX-License-Identifier: MIT
// Compiled once per instruction set by Highway's foreach_target, as the engine's kernels are.
#ifdef JOSTLE_WITH_SIMD
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "index/kernels/kernels.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
#else
#define HWY_BEFORE_NAMESPACE() static_assert(true, "")
#define HWY_AFTER_NAMESPACE() static_assert(true, "")
#define HWY_ATTR
#define HWY_INLINE inline
#define HWY_NAMESPACE plain
#define HWY_ONCE 1
#endif

#ifndef JOSTLE_INDEX_KERNELS_ONCE
#define JOSTLE_INDEX_KERNELS_ONCE
#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "index/kernels/kernels.hpp"
#include "index/key.hpp"
#endif

#undef JOSTLE_INDEX_SCALAR
#if !defined(JOSTLE_WITH_SIMD) || HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
#define JOSTLE_INDEX_SCALAR 1
#else
#define JOSTLE_INDEX_SCALAR 0
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace index {
namespace {
namespace HWY_NAMESPACE {
#if !JOSTLE_INDEX_SCALAR
namespace hn = hwy::HWY_NAMESPACE;
#endif
#include "index/kernels/simd-inl.hpp"
//
#include "index/kernels/searches-inl.hpp"
} // namespace HWY_NAMESPACE
} // namespace
} // namespace index
JOSTLE_NAMESPACE_END
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
JOSTLE_NAMESPACE_BEGIN
namespace index {

template <int Dim, class T>
const Kernels<Dim, T>& kernels_for([[maybe_unused]] InstructionSet set) noexcept
{
#ifdef JOSTLE_WITH_SIMD
#if HWY_TARGETS & HWY_AVX3
    if (set == InstructionSet::avx512) return *N_AVX3::kernels<Dim, T>();
#endif
#if HWY_TARGETS & HWY_AVX2
    if (set == InstructionSet::avx2) return *N_AVX2::kernels<Dim, T>();
#endif
#if HWY_TARGETS & HWY_SSE4
    if (set == InstructionSet::sse4) return *N_SSE4::kernels<Dim, T>();
#endif
#if HWY_TARGETS & HWY_NEON
    if (set == InstructionSet::neon) return *N_NEON::kernels<Dim, T>();
#endif
#if HWY_TARGETS & HWY_WASM
    if (set == InstructionSet::wasm_simd) return *N_WASM::kernels<Dim, T>();
#endif
#if HWY_TARGETS & HWY_SCALAR
    return *N_SCALAR::kernels<Dim, T>();
#else
    return *N_EMU128::kernels<Dim, T>();
#endif
#else
    return *plain::kernels<Dim, T>();
#endif
}

template const Kernels<2, float>& kernels_for<2, float>(InstructionSet) noexcept;
template const Kernels<2, double>& kernels_for<2, double>(InstructionSet) noexcept;
template const Kernels<3, float>& kernels_for<3, float>(InstructionSet) noexcept;
template const Kernels<3, double>& kernels_for<3, double>(InstructionSet) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
#endif
