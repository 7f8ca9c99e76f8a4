// SPDX-License-Identifier: MIT
#pragma once

// Which of Highway's targets are compiled: the same in every file.
#ifdef JOSTLE_WITH_SIMD
// SSSE3 has no unsigned 32-bit minimum, and no machines are left that need it. SVE's vectors have no length
// at compile time, and machines with SVE have NEON. AVX3_DL, the baseline if the compiler is told that every
// machine is like an Ice Lake or a Zen 4, adds nothing that Jostle uses, so AVX3 is used there.
#define JOSTLE_UNUSED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#if defined(JOSTLE_AMALGAMATED) && defined(__MINGW32__) && !defined(__clang__) &&                            \
    !defined(JOSTLE_UNALIGNED_VECTOR_MOVES)
// Windows keeps stacks aligned to 16 bytes only, and g++ moves vectors of 32 as if it were more (GCC bug
// 54412), unless the assembler is told to move them otherwise, as CMake tells it.
#define HWY_DISABLED_TARGETS (JOSTLE_UNUSED_TARGETS | HWY_AVX2 | HWY_AVX3)
#else
#define HWY_DISABLED_TARGETS JOSTLE_UNUSED_TARGETS
#endif
// Highway's own assertions call a function of its compiled library, which Jostle doesn't link, and abort.
#ifndef HWY_IS_DEBUG_BUILD
#define HWY_IS_DEBUG_BUILD 0
#endif
#include <hwy/targets.h>
#endif
