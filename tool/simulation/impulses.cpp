// SPDX-License-Identifier: MIT
// Impulses at points of contact, until surfaces no longer move into each other.
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/prefetch.hpp"
#include "tool/simulation/implementation.hpp"

namespace jostle_simulation {

void Simulation::Implementation::apply(std::size_t to, const Impulse& impulse)
{
    Body& body = world.bodies[to];
    body.linear = body.linear + body.inverse_mass * impulse.linear;
    body.angular = body.angular + body.inverse_inertia * impulse.angular;
}

/// One Jacobi iteration: every point as if it had its share of both bodies to itself. Returns the root mean
/// square of the velocities at which surfaces would have gone into each other before.
double Simulation::Implementation::iterate(bool first)
{
    impulses.start(world.moving, plan);
    each_block([&](Work work) {
        Block& block = blocks[work.block];
        Scratch& scratch = scratches[work.slot];
        const std::uint32_t* const bodies = bodies_of(work.block);
        for (std::uint32_t i = 0; i < block.bodies; ++i) {
            scratch.bodies[i] = world.bodies[bodies[i]];
            scratch.sums[i] = {};
        }
        block.wrong = 0;
        for (std::size_t begin = 0; begin < block.points; begin += strip) {
            const std::size_t count = std::min<std::size_t>(strip, block.points - begin);
            const std::size_t at = first_point(work.block) + begin;
            const std::uint16_t *const a = body_a.data() + at, *const b = body_b.data() + at;
            const Points p = strip_of(work.block, begin / strip);
            if (begin + strip < block.points)
                jostle::prefetch(strip_of(work.block, begin / strip + 1).normal.x,
                                 strip * columns_count * sizeof(float));
            if (first) {
                StripMobility mobility;
                for (std::size_t k = 0; k < count; ++k) {
                    const Body &on_a = scratch.bodies[a[k]], &on_b = scratch.bodies[b[k]];
                    const float share_a = points_of[bodies[a[k]]], share_b = points_of[bodies[b[k]]];
                    mobility.linear_a[k] = share_a * on_a.inverse_mass;
                    mobility.angular_a[k] = share_a * on_a.inverse_inertia;
                    mobility.linear_b[k] = share_b * on_b.inverse_mass;
                    mobility.angular_b[k] = share_b * on_b.inverse_inertia;
                }
                solver.resist(p, mobility, count);
            }
            StripBodies strip_bodies;
            solver.gather(scratch.bodies.data(), a, count, strip_bodies.linear_a, strip_bodies.angular_a);
            solver.gather(scratch.bodies.data(), b, count, strip_bodies.linear_b, strip_bodies.angular_b);
            StripImpulses out;
            solver.solve(p, strip_bodies, count, out);
            solver.scatter(out, a, b, count, scratch.sums.data());
            for (std::size_t k = 0; k < count; ++k)
                block.wrong += out.wrong[k];
        }
        add_to_bodies(work, [&](std::uint32_t body, const Sum& sum) {
            impulses.add(work, body, {sum.linear, sum.angular});
        });
    });
    impulses.merge([&](std::uint32_t first_body, std::span<const Impulse> of) {
        for (std::size_t i = 0; i < of.size(); ++i)
            apply(first_body + i, of[i]);
    });
    double wrong = 0;
    for (const Block& block : blocks)
        wrong += block.wrong;
    return points == 0 ? 0 : std::sqrt(wrong / static_cast<double>(points));
}

} // namespace jostle_simulation
