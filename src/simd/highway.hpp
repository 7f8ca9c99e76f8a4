// SPDX-License-Identifier: MIT
#pragma once

// Which of Highway's targets are compiled: the same in every file.
#ifdef JOSTLE_WITH_SIMD
// SSSE3 has no unsigned 32-bit minimum, and no machines are left that need it. SVE's vectors have no length
// at compile time, and machines with SVE have NEON. AVX3_DL, the baseline if the compiler is told that every
// machine is like an Ice Lake or a Zen 4, adds nothing that Jostle uses, so AVX3 is used there.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
// Highway's own assertions call a function of its compiled library, which Jostle doesn't link, and abort.
#ifndef HWY_IS_DEBUG_BUILD
#define HWY_IS_DEBUG_BUILD 0
#endif
#include <hwy/targets.h>
#endif
