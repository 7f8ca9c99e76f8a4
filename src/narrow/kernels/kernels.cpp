// SPDX-License-Identifier: MIT
// Compiled once per instruction set: see simd/targets.hpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "narrow/kernels/kernels.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_NARROW_KERNELS_ONCE
#define JOSTLE_NARROW_KERNELS_ONCE
#include <algorithm>
#include <bit>
#include <cmath>

#include "narrow/kernels/kernels.hpp"

// One pair at a time, in plain numbers: used for single pairs, and for all if there is no SIMD.
JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {
namespace one_pair {

#pragma push_macro("HWY_ATTR")
#undef HWY_ATTR
#define HWY_ATTR
#include "simd/plain-inl.hpp"
//
#include "narrow/kernels/reals-inl.hpp"
//
#include "narrow/kernels/pairs-inl.hpp"
//
#include "narrow/kernels/distances-inl.hpp"
//
#include "narrow/kernels/polyhedra-inl.hpp"
//
#include "narrow/kernels/trees-inl.hpp"
#pragma pop_macro("HWY_ATTR")

} // namespace one_pair
} // namespace
} // namespace narrow
JOSTLE_NAMESPACE_END
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {
namespace HWY_NAMESPACE {

#if !JOSTLE_SIMD_PLAIN
#include "simd/vec-inl.hpp"
//
#include "narrow/kernels/reals-inl.hpp"
//
#include "narrow/kernels/pairs-inl.hpp"
//
#include "narrow/kernels/distances-inl.hpp"
//
#include "narrow/kernels/polyhedra-inl.hpp"
//
#include "narrow/kernels/trees-inl.hpp"
#else
using one_pair::approaches;
using one_pair::bounds;
using one_pair::boxes;
using one_pair::capsule_box;
using one_pair::capsule_box_distances;
using one_pair::edges;
using one_pair::furthest;
using one_pair::heights;
using one_pair::move;
using one_pair::planes;
using one_pair::round_distances;
using one_pair::rounds;
using one_pair::sphere_box_distances;
#endif

const Kernels& kernels()
{
    static constexpr Kernels table{boxes,
                                   capsule_box,
                                   rounds,
                                   round_distances,
                                   sphere_box_distances,
                                   capsule_box_distances,
                                   furthest,
                                   heights,
                                   move,
                                   planes,
                                   edges,
                                   bounds,
                                   approaches};
    return table;
}

} // namespace HWY_NAMESPACE
} // namespace
} // namespace narrow
JOSTLE_NAMESPACE_END
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
JOSTLE_NAMESPACE_BEGIN
namespace narrow {

// The caller requests one of supported_instruction_sets(), which knows what the machine can run.
const Kernels& kernels_for([[maybe_unused]] InstructionSet set) noexcept
{
    JOSTLE_SIMD_RETURN(set, kernels());
}

const Kernels& best_kernels() noexcept
{
    static const Kernels& best = kernels_for(supported_instruction_sets().front());
    return best;
}

namespace {

one_pair::Real3 as_plain(const Vec3& v)
{
    return {one_pair::Real(v.x), one_pair::Real(v.y), one_pair::Real(v.z)};
}
one_pair::RealMat as_plain(const Mat3& m)
{
    return {as_plain(m.x), as_plain(m.y), as_plain(m.z)};
}
Vec3 from_plain(const one_pair::Real3& v)
{
    return {v.x.raw, v.y.raw, v.z.raw};
}

} // namespace

BoxAxis box_axis(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b, const Vec3& d)
{
    const one_pair::RealAxis best =
        one_pair::best_box_axis(as_plain(a), as_plain(half_a), as_plain(b), as_plain(half_b), as_plain(d));
    return {best.separation.raw, from_plain(best.normal), static_cast<int>(best.axis.raw)};
}

CapsuleBoxGap capsule_box_gap(const Vec3& axis, double half_length, const Mat3& b, const Vec3& half,
                              const Vec3& d)
{
    const one_pair::RealGap gap = one_pair::segment_box(as_plain(axis), one_pair::Real(half_length),
                                                        as_plain(b), as_plain(half), as_plain(d));
    return {gap.distance.raw, from_plain(gap.normal), from_plain(gap.on_a), from_plain(gap.on_b)};
}

} // namespace narrow
JOSTLE_NAMESPACE_END
#endif
