// SPDX-License-Identifier: MIT
// The arithmetic of an iteration, in loops that compilers vectorise (see CMakeLists.txt for their options).
#include "simulation/solve.hpp"

#include <cmath>

namespace jostle_simulation {

namespace {

constexpr float friction = 0.5f;

// Of the loops here no two rounds write or read the same number.
#if defined(__clang__)
#define JOSTLE_INDEPENDENT_ROUNDS _Pragma("clang loop vectorize(assume_safety)")
#else
#define JOSTLE_INDEPENDENT_ROUNDS _Pragma("GCC ivdep")
#endif
/// Inlined into a function for each instruction set.
#define JOSTLE_ALWAYS_INLINE inline __attribute__((always_inline))

struct Vec3
{
    float x, y, z;
};
JOSTLE_ALWAYS_INLINE Vec3 cross(Vec3 a, Vec3 b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
JOSTLE_ALWAYS_INLINE float dot(Vec3 a, Vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
JOSTLE_ALWAYS_INLINE float larger(float a, float b)
{
    return a > b ? a : b;
}

JOSTLE_ALWAYS_INLINE void resist_all(const Points& p, const StripMobility& m, std::size_t count)
{
    float* __restrict const along = p.mass_along;
    float* __restrict const across = p.mass_across;
    JOSTLE_INDEPENDENT_ROUNDS
    for (std::size_t k = 0; k < count; ++k) {
        const Vec3 normal{p.normal.x[k], p.normal.y[k], p.normal.z[k]};
        const Vec3 from_a{p.from_a.x[k], p.from_a.y[k], p.from_a.z[k]};
        const Vec3 from_b{p.from_b.x[k], p.from_b.y[k], p.from_b.z[k]};
        const Vec3 lever_a = cross(from_a, normal), lever_b = cross(from_b, normal);
        along[k] = 1 / (m.linear_a[k] + m.angular_a[k] * dot(lever_a, lever_a) + m.linear_b[k] +
                        m.angular_b[k] * dot(lever_b, lever_b));
        // At most this, whatever the direction: no iteration overshoots.
        across[k] = 1 / (m.linear_a[k] + m.angular_a[k] * dot(from_a, from_a) + m.linear_b[k] +
                         m.angular_b[k] * dot(from_b, from_b));
    }
}

JOSTLE_ALWAYS_INLINE void solve_all(const Points& p, const StripBodies& bodies, std::size_t count,
                                    StripImpulses& __restrict out)
{
    float* __restrict const carried = p.along;
    float* __restrict const carried_x = p.across.x;
    float* __restrict const carried_y = p.across.y;
    float* __restrict const carried_z = p.across.z;
    JOSTLE_INDEPENDENT_ROUNDS
    for (std::size_t k = 0; k < count; ++k) {
        const Vec3 normal{p.normal.x[k], p.normal.y[k], p.normal.z[k]};
        const Vec3 from_a{p.from_a.x[k], p.from_a.y[k], p.from_a.z[k]};
        const Vec3 from_b{p.from_b.x[k], p.from_b.y[k], p.from_b.z[k]};
        const Vec3 turning_a =
            cross({bodies.angular_a.x[k], bodies.angular_a.y[k], bodies.angular_a.z[k]}, from_a);
        const Vec3 turning_b =
            cross({bodies.angular_b.x[k], bodies.angular_b.y[k], bodies.angular_b.z[k]}, from_b);
        const Vec3 velocity{(bodies.linear_b.x[k] + turning_b.x) - (bodies.linear_a.x[k] + turning_a.x),
                            (bodies.linear_b.y[k] + turning_b.y) - (bodies.linear_a.y[k] + turning_a.y),
                            (bodies.linear_b.z[k] + turning_b.z) - (bodies.linear_a.z[k] + turning_a.z)};
        const float apart = dot(normal, velocity);
        // Surfaces may close their gap within the frame, and no more.
        const float beyond = apart + larger(p.gap[k], 0) * (1 / frame_time);
        const float closing = larger(-beyond, 0);
        out.wrong[k] = closing * closing;
        const float along = larger(carried[k] - p.mass_along[k] * beyond, 0);
        const float rub = p.mass_across[k];
        Vec3 across{carried_x[k] - rub * (velocity.x - apart * normal.x),
                    carried_y[k] - rub * (velocity.y - apart * normal.y),
                    carried_z[k] - rub * (velocity.z - apart * normal.z)};
        const float most = friction * along, size = std::sqrt(dot(across, across));
        const float kept = size > most ? most / size : 1;
        across = {kept * across.x, kept * across.y, kept * across.z};
        const float more = along - carried[k];
        const Vec3 impulse{more * normal.x + (across.x - carried_x[k]),
                           more * normal.y + (across.y - carried_y[k]),
                           more * normal.z + (across.z - carried_z[k])};
        carried[k] = along;
        carried_x[k] = across.x;
        carried_y[k] = across.y;
        carried_z[k] = across.z;
        const Vec3 turn_a = cross(from_a, impulse), turn_b = cross(from_b, impulse);
        out.impulse.x[k] = impulse.x;
        out.impulse.y[k] = impulse.y;
        out.impulse.z[k] = impulse.z;
        out.turn_a.x[k] = turn_a.x;
        out.turn_a.y[k] = turn_a.y;
        out.turn_a.z[k] = turn_a.z;
        out.turn_b.x[k] = turn_b.x;
        out.turn_b.y[k] = turn_b.y;
        out.turn_b.z[k] = turn_b.z;
    }
}

#define JOSTLE_SOLVER(name, target)                                                                          \
    target void resist_##name(const Points& points, const StripMobility& mobility, std::size_t count)        \
    {                                                                                                        \
        resist_all(points, mobility, count);                                                                 \
    }                                                                                                        \
    target void solve_##name(const Points& points, const StripBodies& bodies, std::size_t count,             \
                             StripImpulses& out)                                                             \
    {                                                                                                        \
        solve_all(points, bodies, count, out);                                                               \
    }                                                                                                        \
    constexpr Solver solver_##name = {resist_##name, solve_##name};

JOSTLE_SOLVER(plain, )
#if defined(__x86_64__)
JOSTLE_SOLVER(avx2, __attribute__((target("avx2"))))
JOSTLE_SOLVER(avx512, __attribute__((target("avx512f,avx512vl"))))
#endif

} // namespace

Solver solver_for([[maybe_unused]] jostle::InstructionSet set) noexcept
{
#if defined(__x86_64__)
    if (set == jostle::InstructionSet::avx512) return solver_avx512;
    if (set == jostle::InstructionSet::avx2) return solver_avx2;
#endif
    return solver_plain;
}

} // namespace jostle_simulation
