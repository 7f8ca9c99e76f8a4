// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "jostle/find_pairs.hpp"
#include "tool/simulation/scenes.hpp"

namespace jostle_simulation {

/// Points are worked on so many at a time: what lies between stays in the nearest cache.
inline constexpr std::size_t strip = 128;

/// One component each of up to `strip` vectors.
struct Lanes3
{
    float x[strip], y[strip], z[strip];
};
/// The same in longer arrays.
struct Columns3
{
    float *x, *y, *z;
};

/// Points of contact, a column for each number: what an iteration reads, and what it changes.
struct Points
{
    Columns3 normal; ///< from a to b
    Columns3 from_a, from_b;
    float* gap;                      ///< between the surfaces; below 0 they overlap
    float *mass_along, *mass_across; ///< what resists an impulse along the normal and across it
    float* along;                    ///< what is carried so far: the impulse on b, along the normal
    Columns3 across;                 ///< and across it
};

/// What is known of a strip's bodies.
struct StripBodies
{
    Lanes3 linear_a, angular_a, linear_b, angular_b;
};
/// How easily they move, times the number of points that share them.
struct StripMobility
{
    float linear_a[strip], angular_a[strip], linear_b[strip], angular_b[strip];
};
/// The impulses to be added to them; those on a are the opposite, except for the rotation.
struct StripImpulses
{
    Lanes3 impulse, turn_a, turn_b;
    float wrong[strip]; ///< the square of the velocity at which the surfaces would go into each other
};

inline void put(const Columns3& columns, std::size_t k, Vec3 v)
{
    columns.x[k] = v.x;
    columns.y[k] = v.y;
    columns.z[k] = v.z;
}
inline Vec3 get(const Columns3& columns, std::size_t k)
{
    return {columns.x[k], columns.y[k], columns.z[k]};
}
inline void put(Lanes3& lanes, std::size_t k, Vec3 v)
{
    lanes.x[k] = v.x;
    lanes.y[k] = v.y;
    lanes.z[k] = v.z;
}
inline Vec3 get(const Lanes3& lanes, std::size_t k)
{
    return {lanes.x[k], lanes.y[k], lanes.z[k]};
}

/// What one body gets from the points of a block.
struct alignas(32) Sum
{
    Vec3 linear;
    float points = 0;
    Vec3 angular;
    float unused = 0;

    void add(Vec3 impulse, Vec3 turn)
    {
        linear = linear + impulse;
        angular = angular + turn;
    }
};
/// An iteration's steps for one instruction set: the same bits from each.
struct Solver
{
    /// Fills in mass_along and mass_across of `count` points.
    void (*resist)(const Points& points, const StripMobility& mobility, std::size_t count);
    /// The velocities of the bodies with these numbers.
    void (*gather)(const Body* bodies, const std::uint16_t* number, std::size_t count, Lanes3& linear,
                   Lanes3& angular);
    /// One iteration of `count` points: changes what they carry, and says by what impulses.
    void (*solve)(const Points& points, const StripBodies& bodies, std::size_t count, StripImpulses& out);
    /// Adds the impulses of `count` points to the sums of their bodies, point after point.
    void (*scatter)(const StripImpulses& out, const std::uint16_t* a, const std::uint16_t* b,
                    std::size_t count, Sum* sums);
};
[[nodiscard]] const Solver& solver_for(jostle::InstructionSet set) noexcept;

inline constexpr float frame_time = 1.0f / 60;

} // namespace jostle_simulation
