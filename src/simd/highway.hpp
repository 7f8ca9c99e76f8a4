// SPDX-License-Identifier: MIT
#pragma once

// Which of Highway's targets are compiled: the same in every file.
#ifdef JOSTLE_WITH_SIMD
// SSSE3 has no unsigned 32-bit minimum and no machine of its own left to serve. SVE's vectors have no length
// at compile time, and machines with SVE have NEON.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include <hwy/targets.h>
#endif
