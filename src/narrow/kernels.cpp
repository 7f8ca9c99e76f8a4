// SPDX-License-Identifier: MIT
// Compiled once per instruction set, as src/engine/kernels/kernels.cpp is: see there and decision 5.
#ifdef JOSTLE_WITH_SIMD
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "narrow/kernels.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
#else
#define HWY_BEFORE_NAMESPACE() static_assert(true, "")
#define HWY_AFTER_NAMESPACE() static_assert(true, "")
#define HWY_ATTR
#define HWY_NAMESPACE plain
#define HWY_ONCE 1
#endif

#ifndef JOSTLE_NARROW_KERNELS_ONCE
#define JOSTLE_NARROW_KERNELS_ONCE
#include <cmath>

#include "narrow/kernels.hpp"

// One pair at a time, in plain numbers: what a single pair is answered with, and the only form where there is
// no SIMD.
JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {
namespace one_pair {

using Real = double;
using RealMask = bool;
constexpr std::uint32_t reals = 1;
inline Real real(double x)
{
    return x;
}
inline Real from(const double* p)
{
    return *p;
}
inline void to(Real x, double* p)
{
    *p = x;
}
inline RealMask is_less(Real a, Real b)
{
    return a < b;
}
inline RealMask not_less(Real a, Real b)
{
    return a >= b;
}
inline RealMask both(RealMask a, RealMask b)
{
    return a && b;
}
inline bool any(RealMask a)
{
    return a;
}
inline Real choose(RealMask m, Real a, Real b)
{
    return m ? a : b;
}
inline Real size_of(Real a)
{
    return std::abs(a);
}
inline Real root(Real a)
{
    return std::sqrt(a);
}
inline double greatest(Real a)
{
    return a;
}
inline double least(Real a)
{
    return a;
}
inline Real lane_numbers()
{
    return 0;
}
#pragma push_macro("HWY_ATTR")
#undef HWY_ATTR
#define HWY_ATTR
#include "narrow/kernels-inl.hpp"
#pragma pop_macro("HWY_ATTR")

} // namespace one_pair
} // namespace
} // namespace narrow
JOSTLE_NAMESPACE_END
#endif

#undef JOSTLE_NARROW_SET
#if !defined(JOSTLE_WITH_SIMD) || HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
#define JOSTLE_NARROW_SET InstructionSet::scalar
#elif HWY_TARGET == HWY_AVX3
#define JOSTLE_NARROW_SET InstructionSet::avx512
#elif HWY_TARGET == HWY_AVX2
#define JOSTLE_NARROW_SET InstructionSet::avx2
#elif HWY_TARGET == HWY_SSE4
#define JOSTLE_NARROW_SET InstructionSet::sse4
#elif HWY_TARGET == HWY_NEON
#define JOSTLE_NARROW_SET InstructionSet::neon
#elif HWY_TARGET == HWY_WASM
#define JOSTLE_NARROW_SET InstructionSet::wasm_simd
#else
#error "Jostle has no kernels for this Highway target; add it to HWY_DISABLED_TARGETS or name it here"
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {
namespace HWY_NAMESPACE {

#if defined(JOSTLE_WITH_SIMD) && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::CappedTag<double, batch>;
constexpr std::uint32_t reals = static_cast<std::uint32_t>(hn::MaxLanes(Lanes()));
struct Real
{
    hn::Vec<Lanes> v;
};
struct RealMask
{
    hn::Mask<Lanes> m;
};
HWY_ATTR inline Real real(double x)
{
    return {hn::Set(Lanes(), x)};
}
HWY_ATTR inline Real from(const double* p)
{
    return {hn::LoadU(Lanes(), p)};
}
HWY_ATTR inline void to(const Real& x, double* p)
{
    hn::StoreU(x.v, Lanes(), p);
}
HWY_ATTR inline Real operator+(const Real& a, const Real& b)
{
    return {hn::Add(a.v, b.v)};
}
HWY_ATTR inline Real operator-(const Real& a, const Real& b)
{
    return {hn::Sub(a.v, b.v)};
}
HWY_ATTR inline Real operator*(const Real& a, const Real& b)
{
    return {hn::Mul(a.v, b.v)};
}
HWY_ATTR inline Real operator/(const Real& a, const Real& b)
{
    return {hn::Div(a.v, b.v)};
}
HWY_ATTR inline RealMask is_less(const Real& a, const Real& b)
{
    return {hn::Lt(a.v, b.v)};
}
HWY_ATTR inline RealMask not_less(const Real& a, const Real& b)
{
    return {hn::Ge(a.v, b.v)};
}
HWY_ATTR inline RealMask both(const RealMask& a, const RealMask& b)
{
    return {hn::And(a.m, b.m)};
}
HWY_ATTR inline bool any(const RealMask& a)
{
    return !hn::AllFalse(Lanes(), a.m);
}
HWY_ATTR inline Real choose(const RealMask& m, const Real& a, const Real& b)
{
    return {hn::IfThenElse(m.m, a.v, b.v)};
}
HWY_ATTR inline Real size_of(const Real& a)
{
    return {hn::Abs(a.v)};
}
HWY_ATTR inline Real root(const Real& a)
{
    return {hn::Sqrt(a.v)};
}
HWY_ATTR inline double greatest(const Real& a)
{
    return hn::GetLane(hn::MaxOfLanes(Lanes(), a.v));
}
HWY_ATTR inline double least(const Real& a)
{
    return hn::GetLane(hn::MinOfLanes(Lanes(), a.v));
}
HWY_ATTR inline Real lane_numbers()
{
    return {hn::Iota(Lanes(), 0.0)};
}
#include "narrow/kernels-inl.hpp"
#else
using one_pair::boxes;
using one_pair::capsule_box;
using one_pair::edges;
using one_pair::furthest;
using one_pair::heights;
using one_pair::move;
using one_pair::planes;
#endif

[[maybe_unused]] const Kernels& kernels()
{
    static constexpr Kernels table{JOSTLE_NARROW_SET, boxes, capsule_box, furthest,
                                   heights,           move,  planes,      edges};
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

const Kernels& kernels_for(InstructionSet set) noexcept
{
    // The caller asks for one of supported_instruction_sets(), which knows what the machine can run.
    switch (set) {
#ifdef JOSTLE_WITH_SIMD
#if HWY_TARGETS & HWY_AVX3
    case InstructionSet::avx512:
        return N_AVX3::kernels();
#endif
#if HWY_TARGETS & HWY_AVX2
    case InstructionSet::avx2:
        return N_AVX2::kernels();
#endif
#if HWY_TARGETS & HWY_SSE4
    case InstructionSet::sse4:
        return N_SSE4::kernels();
#endif
#if HWY_TARGETS & HWY_NEON
    case InstructionSet::neon:
        return N_NEON::kernels();
#endif
#if HWY_TARGETS & HWY_WASM
    case InstructionSet::wasm_simd:
        return N_WASM::kernels();
#endif
#endif
    default:
        break;
    }
    static constexpr Kernels plain{InstructionSet::scalar, one_pair::boxes,   one_pair::capsule_box,
                                   one_pair::furthest,     one_pair::heights, one_pair::move,
                                   one_pair::planes,       one_pair::edges};
    return plain;
}

const Kernels& best_kernels() noexcept
{
    static const Kernels& best = kernels_for(supported_instruction_sets().front());
    return best;
}

namespace {

one_pair::Real3 as_plain(const Vec3& v)
{
    return {v.x, v.y, v.z};
}
one_pair::RealMat as_plain(const Mat3& m)
{
    return {as_plain(m.x), as_plain(m.y), as_plain(m.z)};
}
Vec3 from_plain(const one_pair::Real3& v)
{
    return {v.x, v.y, v.z};
}

} // namespace

BoxAxis box_axis(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b, const Vec3& d)
{
    const one_pair::RealAxis best =
        one_pair::best_box_axis(as_plain(a), as_plain(half_a), as_plain(b), as_plain(half_b), as_plain(d));
    return {best.separation, from_plain(best.normal), static_cast<int>(best.axis)};
}

CapsuleBoxGap capsule_box_gap(const Vec3& axis, double half_length, const Mat3& b, const Vec3& half,
                              const Vec3& d)
{
    const one_pair::RealGap gap =
        one_pair::segment_box(as_plain(axis), half_length, as_plain(b), as_plain(half), as_plain(d));
    return {gap.distance, from_plain(gap.normal), from_plain(gap.on_a), from_plain(gap.on_b)};
}

} // namespace narrow
JOSTLE_NAMESPACE_END
#endif
