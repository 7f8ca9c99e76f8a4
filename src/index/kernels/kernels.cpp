// SPDX-License-Identifier: MIT
// Compiled once per instruction set: see simd/targets.hpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "index/kernels/kernels.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_INDEX_KERNELS_ONCE
#define JOSTLE_INDEX_KERNELS_ONCE
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/radix.hpp"
#include "index/kernels/kernels.hpp"
#include "index/nodes/key.hpp"
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace index {
namespace {
namespace HWY_NAMESPACE {
#include "simd/vec-inl.hpp"
//
#include "index/kernels/lane_tests-inl.hpp"
//
#include "index/kernels/lanes-inl.hpp"
//
#include "simd/sort_few-inl.hpp"
//
#include "index/kernels/depth_first-inl.hpp"
//
#include "index/kernels/nearest_first-inl.hpp"
//
#include "index/kernels/join-inl.hpp"
//
#include "index/kernels/look_up-inl.hpp"
//
#include "index/kernels/visits-inl.hpp"
//
#include "index/kernels/pairs-inl.hpp"
//
#include "index/kernels/arrange-inl.hpp"
//
#include "index/kernels/keys-inl.hpp"

template <int Dim, class T>
const Kernels<Dim, T>& kernels()
{
    static constexpr Kernels<Dim, T> table = {search_box<Dim, T>,           search_sphere<Dim, T>,
                                              search_frustum<Dim, T>,       search_join<Dim, T>,
                                              search_around<Dim, T>,        look_up<Dim>,
                                              search_first<Dim, T>,         search_all<Dim, T>,
                                              search_nearest<Dim, T>,       visit_line<Dim, T>,
                                              visit_near<Dim, T>,           visit_touching<false, Dim, T>,
                                              visit_touching<true, Dim, T>, find_closest<Dim, T>,
                                              sort_few<most_sorted>,        arrange<Dim, T>,
                                              make_entries<Dim, T>};
    return table;
}
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
    JOSTLE_SIMD_RETURN(set, kernels<Dim, T>());
}

template const Kernels<2, float>& kernels_for<2, float>(InstructionSet) noexcept;
template const Kernels<2, double>& kernels_for<2, double>(InstructionSet) noexcept;
template const Kernels<3, float>& kernels_for<3, float>(InstructionSet) noexcept;
template const Kernels<3, double>& kernels_for<3, double>(InstructionSet) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
#endif
