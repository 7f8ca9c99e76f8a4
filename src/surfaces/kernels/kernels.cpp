// SPDX-License-Identifier: MIT
// Compiled once per instruction set: see simd/targets.hpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "surfaces/kernels/kernels.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_SURFACE_KERNELS_ONCE
#define JOSTLE_SURFACE_KERNELS_ONCE
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "surfaces/kernels/kernels.hpp"

// One pair at a time, in plain numbers: what a single pair is answered with, and the only form where there is
// no SIMD.
JOSTLE_NAMESPACE_BEGIN
namespace surfaces {
namespace {
namespace one_pair {

#pragma push_macro("HWY_ATTR")
#undef HWY_ATTR
#define HWY_ATTR
#include "simd/plain-inl.hpp"
//
#include "surfaces/kernels/polygons-inl.hpp"
//
#include "surfaces/kernels/apart-inl.hpp"
//
#include "surfaces/kernels/uncrossed-inl.hpp"
//
#include "surfaces/kernels/exact-inl.hpp"
#pragma pop_macro("HWY_ATTR")

} // namespace one_pair
} // namespace
} // namespace surfaces
JOSTLE_NAMESPACE_END
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace surfaces {
namespace {
namespace HWY_NAMESPACE {

#if !JOSTLE_SIMD_PLAIN
#include "simd/vec-inl.hpp"
//
#include "surfaces/kernels/polygons-inl.hpp"
//
#include "surfaces/kernels/apart-inl.hpp"
//
#include "surfaces/kernels/uncrossed-inl.hpp"
//
#include "surfaces/kernels/exact-inl.hpp"
#else
using one_pair::apart;
using one_pair::distances;
using one_pair::impacts;
using one_pair::uncrossed;
#endif

const PartKernels& kernels()
{
    static constexpr PartKernels table = {
        {apart<3, false>, apart<3, true>, distances<3>, impacts<3>},
        {apart<4, false>, apart<4, true>, distances<4>, impacts<4>},
        uncrossed,
    };
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

// The caller asks for one of supported_instruction_sets(), which knows what the machine can run.
const PartKernels& kernels_for([[maybe_unused]] InstructionSet set) noexcept
{
    JOSTLE_SIMD_RETURN(set, kernels());
}

namespace {
void put_first(const Four& positions, double (&columns)[12][PlaceBatch::size])
{
    for (int i = 0; i < 12; ++i)
        columns[i][0] = positions[static_cast<std::size_t>(i / 3)][i % 3];
}
} // namespace

PartDistance distance_of(Kind kind, const Four& positions) noexcept
{
    PlaceBatch pair;
    put_first(positions, pair.from);
    PartDistances found;
    (kind == Kind::vertex_triangle ? one_pair::distances<3> : one_pair::distances<4>)(pair, 1, found);
    return found.of(0);
}
std::optional<double> impact_of(Kind kind, const Four& from, const Four& to, double distance,
                                double tolerance) noexcept
{
    PlaceBatch pair;
    put_first(from, pair.from);
    put_first(to, pair.to);
    pair.reach[0] = distance;
    double times[PlaceBatch::size];
    (kind == Kind::vertex_triangle ? one_pair::impacts<3> : one_pair::impacts<4>)(pair, 1, tolerance, times);
    if (times[0] > 1) return std::nullopt;
    return times[0];
}

} // namespace surfaces
JOSTLE_NAMESPACE_END
#endif
