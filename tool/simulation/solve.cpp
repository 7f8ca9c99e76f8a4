// SPDX-License-Identifier: MIT
// The arithmetic of an iteration. Compiled once per instruction set: see simd/targets.hpp. The same bits come
// out of each: every point's numbers go through the same operations, however many points a vector holds.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tool/simulation/solve.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_SIMULATION_SOLVE_ONCE
#define JOSTLE_SIMULATION_SOLVE_ONCE
#include <cmath>
#include <cstdint>

#include "tool/simulation/solve.hpp"

namespace jostle_simulation {
namespace {
constexpr float friction = 0.5f;
} // namespace
using jostle::InstructionSet;
} // namespace jostle_simulation
#endif

HWY_BEFORE_NAMESPACE();
namespace jostle_simulation {
namespace {
namespace HWY_NAMESPACE {
#include "simd/vec-inl.hpp"

using Floats = Vec<float>;
// The last vector of a strip may reach beyond `count`, into numbers that aren't read.
static_assert(strip % Floats::size == 0);

/// The vectors of as many points as there are in a Floats.
struct Floats3
{
    Floats x, y, z;
};

HWY_ATTR HWY_INLINE Floats3 load(const Columns3& columns, std::size_t k)
{
    return {Floats::loadu(columns.x + k), Floats::loadu(columns.y + k), Floats::loadu(columns.z + k)};
}
HWY_ATTR HWY_INLINE Floats3 load(const Lanes3& lanes, std::size_t k)
{
    return {Floats::loadu(lanes.x + k), Floats::loadu(lanes.y + k), Floats::loadu(lanes.z + k)};
}
HWY_ATTR HWY_INLINE void store(const Columns3& columns, std::size_t k, const Floats3& v)
{
    v.x.storeu(columns.x + k);
    v.y.storeu(columns.y + k);
    v.z.storeu(columns.z + k);
}
HWY_ATTR HWY_INLINE void store(Lanes3& lanes, std::size_t k, const Floats3& v)
{
    v.x.storeu(lanes.x + k);
    v.y.storeu(lanes.y + k);
    v.z.storeu(lanes.z + k);
}
HWY_ATTR HWY_INLINE Floats3 operator+(const Floats3& a, const Floats3& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
HWY_ATTR HWY_INLINE Floats3 operator-(const Floats3& a, const Floats3& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
HWY_ATTR HWY_INLINE Floats3 operator*(Floats s, const Floats3& a)
{
    return {s * a.x, s * a.y, s * a.z};
}
HWY_ATTR HWY_INLINE Floats3 cross(const Floats3& a, const Floats3& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
HWY_ATTR HWY_INLINE Floats dot(const Floats3& a, const Floats3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
HWY_ATTR HWY_INLINE Floats positive_part(Floats a)
{
    const Floats zero(0.0f);
    return choose(a > zero, a, zero);
}

HWY_ATTR void resist(const Points& p, const StripMobility& m, std::size_t count)
{
    const Floats one(1.0f);
    for (std::size_t k = 0; k < count; k += Floats::size) {
        const Floats3 normal = load(p.normal, k), from_a = load(p.from_a, k), from_b = load(p.from_b, k);
        const Floats3 lever_a = cross(from_a, normal), lever_b = cross(from_b, normal);
        const Floats linear_a = Floats::loadu(m.linear_a + k), angular_a = Floats::loadu(m.angular_a + k),
                     linear_b = Floats::loadu(m.linear_b + k), angular_b = Floats::loadu(m.angular_b + k);
        const Floats along =
            linear_a + angular_a * dot(lever_a, lever_a) + linear_b + angular_b * dot(lever_b, lever_b);
        // At most this, whatever the direction: no iteration overshoots.
        const Floats across =
            linear_a + angular_a * dot(from_a, from_a) + linear_b + angular_b * dot(from_b, from_b);
        (one / along).storeu(p.mass_along + k);
        (one / across).storeu(p.mass_across + k);
    }
}

/// Four records of a vector and a number more, which is left out, as three columns.
template <class Record>
HWY_ATTR HWY_INLINE void load_columns(Record&& record, Lanes3& lanes, std::size_t k)
{
    Four rows[4] = {Four::loadu(record(0)), Four::loadu(record(1)), Four::loadu(record(2)),
                    Four::loadu(record(3))};
    transpose(rows);
    rows[0].storeu(lanes.x + k);
    rows[1].storeu(lanes.y + k);
    rows[2].storeu(lanes.z + k);
}

HWY_ATTR void gather(const Body* bodies, const std::uint16_t* number, std::size_t count, Lanes3& linear,
                     Lanes3& angular)
{
    std::size_t k = 0;
    for (; k + 4 <= count; k += 4) {
        load_columns([&](std::size_t i) { return &bodies[number[k + i]].linear.x; }, linear, k);
        load_columns([&](std::size_t i) { return &bodies[number[k + i]].angular.x; }, angular, k);
    }
    for (; k < count; ++k) {
        put(linear, k, bodies[number[k]].linear);
        put(angular, k, bodies[number[k]].angular);
    }
}

HWY_ATTR void solve(const Points& p, const StripBodies& bodies, std::size_t count, StripImpulses& out)
{
    const Floats one(1.0f);
    for (std::size_t k = 0; k < count; k += Floats::size) {
        const Floats3 normal = load(p.normal, k), from_a = load(p.from_a, k), from_b = load(p.from_b, k);
        const Floats3 velocity = (load(bodies.linear_b, k) + cross(load(bodies.angular_b, k), from_b)) -
                                 (load(bodies.linear_a, k) + cross(load(bodies.angular_a, k), from_a));
        const Floats apart = dot(normal, velocity);
        // Surfaces may close their gap within the frame, and no more.
        const Floats beyond = apart + positive_part(Floats::loadu(p.gap + k)) * Floats(1 / frame_time);
        const Floats closing = positive_part(Floats(0.0f) - beyond);
        (closing * closing).storeu(out.wrong + k);

        const Floats carried = Floats::loadu(p.along + k);
        const Floats3 carried_across = load(p.across, k);
        const Floats along = positive_part(carried - Floats::loadu(p.mass_along + k) * beyond);
        Floats3 across = carried_across - Floats::loadu(p.mass_across + k) * (velocity - apart * normal);
        const Floats most = Floats(friction) * along, size = sqrt(dot(across, across));
        across = choose(size > most, most / size, one) * across;

        const Floats3 impulse = (along - carried) * normal + (across - carried_across);
        along.storeu(p.along + k);
        store(p.across, k, across);
        store(out.impulse, k, impulse);
        store(out.turn_a, k, cross(from_a, impulse));
        store(out.turn_b, k, cross(from_b, impulse));
    }
}

HWY_ATTR HWY_INLINE void load_rows(const Lanes3& lanes, std::size_t k, Four (&rows)[4])
{
    rows[0] = Four::loadu(lanes.x + k);
    rows[1] = Four::loadu(lanes.y + k);
    rows[2] = Four::loadu(lanes.z + k);
    static constexpr float zeros[4] = {};
    rows[3] = Four::loadu(zeros);
    transpose(rows);
}

HWY_ATTR void scatter(const StripImpulses& out, const std::uint16_t* a, const std::uint16_t* b,
                      std::size_t count, Sum* sums)
{
    std::size_t k = 0;
    for (; k + 4 <= count; k += 4) {
        Four impulse[4], turn_a[4], turn_b[4];
        load_rows(out.impulse, k, impulse);
        load_rows(out.turn_a, k, turn_a);
        load_rows(out.turn_b, k, turn_b);
        for (std::size_t i = 0; i < 4; ++i) {
            Sum &on_a = sums[a[k + i]], &on_b = sums[b[k + i]];
            (Four::loadu(&on_a.linear.x) - impulse[i]).storeu(&on_a.linear.x);
            (Four::loadu(&on_a.angular.x) - turn_a[i]).storeu(&on_a.angular.x);
            (Four::loadu(&on_b.linear.x) + impulse[i]).storeu(&on_b.linear.x);
            (Four::loadu(&on_b.angular.x) + turn_b[i]).storeu(&on_b.angular.x);
        }
    }
    for (; k < count; ++k) {
        sums[a[k]].add(-1.0f * get(out.impulse, k), -1.0f * get(out.turn_a, k));
        sums[b[k]].add(get(out.impulse, k), get(out.turn_b, k));
    }
}

const Solver& solver()
{
    static constexpr Solver table{resist, gather, solve, scatter};
    return table;
}

} // namespace HWY_NAMESPACE
} // namespace
} // namespace jostle_simulation
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace jostle_simulation {

const Solver& solver_for([[maybe_unused]] InstructionSet set) noexcept
{
    JOSTLE_SIMD_RETURN(set, solver());
}

} // namespace jostle_simulation
#endif
