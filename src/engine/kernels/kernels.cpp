// SPDX-License-Identifier: MIT
// Compiled once per instruction set: see simd/targets.hpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/kernels.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_KERNELS_ONCE
#define JOSTLE_KERNELS_ONCE
#include <algorithm>
#include <bit>
#include <cstdint>

#include "base/prefetch.hpp"
#include "engine/kernels/kernels.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {

/// Boxes of a unit that have to be copied into the next brick on the second axis, the third, or both.
struct CopyLists
{
    std::uint16_t y[unit_size], z[unit_size], yz[unit_size];
    std::uint32_t ys = 0, zs = 0, yzs = 0, wides = 0; // wide ones are listed in Unit::wide_box
};

/// Stores the ties of a row with the candidates whose bits are set, in their order.
[[maybe_unused]] inline void defer_ties(PairOutput& out, unsigned ties, const std::uint32_t* candidates,
                                        std::uint32_t row)
{
    for (; ties != 0; ties &= ties - 1)
        out.ties[out.tie_count++] = {row, candidates[std::countr_zero(ties)] & object_mask};
}

} // namespace
} // namespace engine
JOSTLE_NAMESPACE_END
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {
namespace HWY_NAMESPACE {
#include "simd/vec-inl.hpp"
//
#include "simd/sort_few-inl.hpp"
#if JOSTLE_SIMD_PLAIN
#include "engine/kernels/scatter_plain-inl.hpp"
//
#include "engine/kernels/scatter-inl.hpp"
#include "engine/kernels/sweep_plain-inl.hpp"
#else
#include "engine/kernels/scatter_vector-inl.hpp"
//
#include "engine/kernels/scatter-inl.hpp"
#if HWY_TARGET == HWY_AVX3
#include "engine/kernels/sweep_wide-inl.hpp"
#else
#include "engine/kernels/sweep_vector-inl.hpp"
#endif
#endif

inline const Kernels& kernels()
{
    static constexpr Kernels table = {JOSTLE_SIMD_SET,
                                      load<2, float>,
                                      load<2, double>,
                                      load<3, float>,
                                      load<3, double>,
                                      quantise<2, float>,
                                      quantise<2, double>,
                                      quantise<3, float>,
                                      quantise<3, double>,
                                      arrange,
                                      sweep<2>,
                                      sweep<3>,
                                      test<2>,
                                      test<3>,
                                      sort_few<most_sorted>};
    return table;
}
} // namespace HWY_NAMESPACE
} // namespace
} // namespace engine
JOSTLE_NAMESPACE_END
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
JOSTLE_NAMESPACE_BEGIN
namespace engine {

const Kernels& kernels_for([[maybe_unused]] InstructionSet set) noexcept
{
    JOSTLE_SIMD_RETURN(set, kernels());
}

} // namespace engine
JOSTLE_NAMESPACE_END
#endif
