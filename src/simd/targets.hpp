// SPDX-License-Identifier: MIT
// Compiles a file once per instruction set. Such a file begins with
//
//     #undef HWY_TARGET_INCLUDE
//     #define HWY_TARGET_INCLUDE "room/kernels.cpp" // the file itself
//     #include "simd/targets.hpp"
//
// Highway's foreach_target then includes it again for each set, and what stands between HWY_BEFORE_NAMESPACE
// and HWY_AFTER_NAMESPACE becomes that set's code, in a namespace HWY_NAMESPACE of its own. What stands under
// `#if HWY_ONCE` is compiled at the end, once: there JOSTLE_SIMD_RETURN chooses a set at run time.
//
// In every pass, JOSTLE_SIMD_SET is the InstructionSet being compiled, and JOSTLE_SIMD_PLAIN is 1 where that
// is plain C++: as the last resort of a build with SIMD, or as all there is of a build without. For vectors
// of numbers include "simd/vec-inl.hpp" inside the namespace.
//
// No include guard, on purpose: the last part differs from pass to pass.

#include "simd/highway.hpp"

#ifdef JOSTLE_WITH_SIMD
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
//
#include "simd/compress_order.hpp"
#elif !defined(HWY_ONCE)
#define HWY_BEFORE_NAMESPACE() static_assert(true, "")
#define HWY_AFTER_NAMESPACE() static_assert(true, "")
#define HWY_ATTR
#define HWY_INLINE inline
#define HWY_NAMESPACE N_PLAIN
#define HWY_ONCE 1
#endif

#undef JOSTLE_SIMD_PLAIN
#undef JOSTLE_SIMD_SET
#define JOSTLE_SIMD_PLAIN 0
#if !defined(JOSTLE_WITH_SIMD) || HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
#undef JOSTLE_SIMD_PLAIN
#define JOSTLE_SIMD_PLAIN 1
#define JOSTLE_SIMD_SET InstructionSet::scalar
#elif HWY_TARGET == HWY_AVX3
#define JOSTLE_SIMD_SET InstructionSet::avx512
#elif HWY_TARGET == HWY_AVX2
#define JOSTLE_SIMD_SET InstructionSet::avx2
#elif HWY_TARGET == HWY_SSE4
#define JOSTLE_SIMD_SET InstructionSet::sse4
#elif HWY_TARGET == HWY_NEON
#define JOSTLE_SIMD_SET InstructionSet::neon
#elif HWY_TARGET == HWY_WASM
#define JOSTLE_SIMD_SET InstructionSet::wasm_simd
#else
#error "Jostle has no kernels for this Highway target; add it to HWY_DISABLED_TARGETS or name it here"
#endif

#ifndef JOSTLE_SIMD_RETURN
// Returns what stands behind `set`, in the namespace of that instruction set; for one that this build has no
// code for, in that of the baseline, which every machine can run.
#define JOSTLE_SIMD_RETURN(set, ...)                                                                         \
    JOSTLE_SIMD_IF_AVX512(set, __VA_ARGS__)                                                                  \
    JOSTLE_SIMD_IF_AVX2(set, __VA_ARGS__)                                                                    \
    JOSTLE_SIMD_IF_SSE4(set, __VA_ARGS__)                                                                    \
    JOSTLE_SIMD_IF_NEON(set, __VA_ARGS__)                                                                    \
    JOSTLE_SIMD_IF_WASM(set, __VA_ARGS__)                                                                    \
    return HWY_NAMESPACE::__VA_ARGS__
#define JOSTLE_SIMD_IF(set, name, ...)                                                                       \
    if ((set) == InstructionSet::name) return __VA_ARGS__;
#if defined(JOSTLE_WITH_SIMD) && (HWY_TARGETS & HWY_AVX3)
#define JOSTLE_SIMD_IF_AVX512(set, ...) JOSTLE_SIMD_IF(set, avx512, N_AVX3::__VA_ARGS__)
#else
#define JOSTLE_SIMD_IF_AVX512(set, ...)
#endif
#if defined(JOSTLE_WITH_SIMD) && (HWY_TARGETS & HWY_AVX2)
#define JOSTLE_SIMD_IF_AVX2(set, ...) JOSTLE_SIMD_IF(set, avx2, N_AVX2::__VA_ARGS__)
#else
#define JOSTLE_SIMD_IF_AVX2(set, ...)
#endif
#if defined(JOSTLE_WITH_SIMD) && (HWY_TARGETS & HWY_SSE4)
#define JOSTLE_SIMD_IF_SSE4(set, ...) JOSTLE_SIMD_IF(set, sse4, N_SSE4::__VA_ARGS__)
#else
#define JOSTLE_SIMD_IF_SSE4(set, ...)
#endif
#if defined(JOSTLE_WITH_SIMD) && (HWY_TARGETS & HWY_NEON)
#define JOSTLE_SIMD_IF_NEON(set, ...) JOSTLE_SIMD_IF(set, neon, N_NEON::__VA_ARGS__)
#else
#define JOSTLE_SIMD_IF_NEON(set, ...)
#endif
#if defined(JOSTLE_WITH_SIMD) && (HWY_TARGETS & HWY_WASM)
#define JOSTLE_SIMD_IF_WASM(set, ...) JOSTLE_SIMD_IF(set, wasm_simd, N_WASM::__VA_ARGS__)
#else
#define JOSTLE_SIMD_IF_WASM(set, ...)
#endif
#endif
