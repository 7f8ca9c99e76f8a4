// SPDX-License-Identifier: MIT
// Compiled once per instruction set: see simd/targets.hpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "surfaces/kernels/kernels.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_SURFACE_KERNELS_ONCE
#define JOSTLE_SURFACE_KERNELS_ONCE
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "surfaces/kernels/kernels.hpp"
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace surfaces {
namespace {
namespace HWY_NAMESPACE {
#include "simd/vec-inl.hpp"
//
#include "surfaces/kernels/apart-inl.hpp"

const PartKernels& kernels()
{
    static constexpr PartKernels table = {apart<3, false>, apart<4, false>, apart<3, true>, apart<4, true>};
    return table;
}
} // namespace HWY_NAMESPACE
} // namespace
} // namespace surfaces
JOSTLE_NAMESPACE_END
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
JOSTLE_NAMESPACE_BEGIN
namespace surfaces {

const PartKernels& kernels_for([[maybe_unused]] InstructionSet set) noexcept
{
    JOSTLE_SIMD_RETURN(set, kernels());
}

} // namespace surfaces
JOSTLE_NAMESPACE_END
#endif
