// SPDX-License-Identifier: MIT
// Compiled once per instruction set: see simd/targets.hpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "neighbors/kernels/neighbors.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_NEIGHBOR_KERNELS_ONCE
#define JOSTLE_NEIGHBOR_KERNELS_ONCE
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "neighbors/kernels/neighbors.hpp"
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace neighbors {
namespace {
namespace HWY_NAMESPACE {
#include "simd/vec-inl.hpp"
//
#include "neighbors/kernels/neighbors-inl.hpp"

template <int Dim, class T>
const NeighborKernels<Dim, T>& kernels()
{
    static constexpr NeighborKernels<Dim, T> table = {select<Dim, T>, find_row<Dim, T>, tell_apart<T>,
                                                      take_chosen};
    return table;
}
} // namespace HWY_NAMESPACE
} // namespace
} // namespace neighbors
JOSTLE_NAMESPACE_END
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

template <int Dim, class T>
const NeighborKernels<Dim, T>& kernels_for([[maybe_unused]] InstructionSet set) noexcept
{
    JOSTLE_SIMD_RETURN(set, kernels<Dim, T>());
}

template const NeighborKernels<2, float>& kernels_for<2, float>(InstructionSet) noexcept;
template const NeighborKernels<2, double>& kernels_for<2, double>(InstructionSet) noexcept;
template const NeighborKernels<3, float>& kernels_for<3, float>(InstructionSet) noexcept;
template const NeighborKernels<3, double>& kernels_for<3, double>(InstructionSet) noexcept;

} // namespace neighbors
JOSTLE_NAMESPACE_END
#endif
