// SPDX-License-Identifier: MIT
// Points of contact: chosen, laid out for the solver, and remembered for the next frame.
#include <algorithm>
#include <cstdint>

#include "tool/simulation/implementation.hpp"

namespace jostle_simulation {

namespace {

constexpr float near_enough = 0.01f; ///< a gap that will be this small is kept in mind

/// How many contacts a block has, in whole strips. With more of them, fewer bodies have points in several
/// blocks; with fewer, more threads find something to do. What a block needs fits the second-level cache.
std::uint64_t contacts_per_block_of(std::uint64_t contacts)
{
    return std::clamp<std::uint64_t>(contacts / 64, 2 * strip, 32 * strip) / strip * strip;
}

Vec3 vec(const jostle::Vec<3, float>& v)
{
    return {v[0], v[1], v[2]};
}

Vec3 velocity_at(const Body& body, Vec3 from_centre)
{
    return body.linear + cross(body.angular, from_centre);
}

} // namespace

/// The points that will matter, with what they carried in the frame before.
void Simulation::Implementation::prepare_points()
{
    const jostle::ProcessOptions in_blocks = by(contacts_per_block_of(contacts->size()));
    plan = jostle::plan_work(contacts->size(), in_blocks);
    blocks.assign(plan.blocks, {});
    if (body_a.size() < first_point(plan.blocks)) {
        const std::size_t room = first_point(plan.blocks) + first_point(plan.blocks) / 4;
        columns.resize(room * columns_count);
        body_a.resize(room);
        body_b.resize(room);
        feature.resize(room);
        block_bodies.resize(2 * room);
    }
    if (scratches.size() < plan.slots) scratches.resize(plan.slots);
    for (Scratch& scratch : scratches) {
        scratch.number_of.resize(world.shapes.size());
        scratch.bodies.resize(std::max<std::size_t>(scratch.bodies.size(), 2 * plan.block_items));
        scratch.sums.resize(scratch.bodies.size());
    }
    first_impulses.start(world.moving, plan);
    jostle::process_contacts(
        *contacts,
        [&](const jostle::Batch<Contact>& batch) {
            prepare_batch(batch);
            if (batch.first + batch.items.size() ==
                std::min(plan.items, (batch.work.block + 1) * plan.block_items))
                add_to_bodies(batch.work, [&](std::uint32_t body, const Sum& sum) {
                    first_impulses.add(batch.work, body, {{sum.linear, sum.angular}, sum.points});
                });
        },
        in_blocks);
    first_impulses.merge([&](std::uint32_t first, std::span<const FirstImpulse> of) {
        for (std::size_t i = 0; i < of.size(); ++i) {
            apply(first + i, of[i].impulse);
            points_of[first + i] = std::max(1.0f, of[i].points);
        }
    });
    points = 0;
    deepest = 0;
    last_a = 0;
    for (std::uint32_t b = 0; b < plan.blocks; ++b) {
        Block& block = blocks[b];
        block.points_before = points;
        block.last_a_before = last_a;
        points += block.points;
        deepest = std::max(deepest, block.deepest);
        if (block.points != 0) last_a = bodies_of(b)[body_a[first_point(b) + block.points - 1]] + 1;
    }
    pushing = deepest > slop;
}

void Simulation::Implementation::prepare_batch(const jostle::Batch<Contact>& batch)
{
    Block& block = blocks[batch.work.block];
    Scratch& scratch = scratches[batch.work.slot];
    std::uint32_t* const bodies = bodies_of(batch.work.block);
    const auto number = [&](std::uint32_t body) {
        // Numbers of other blocks may be left over: only what the block's list confirms is one.
        std::uint32_t& known = scratch.number_of[body];
        if (known >= block.bodies || bodies[known] != body) {
            known = block.bodies++;
            bodies[known] = body;
            scratch.sums[known] = {};
        }
        return known;
    };
    const std::size_t first = first_point(batch.work.block);
    Points p = strip_of(batch.work.block, block.points / strip);
    std::uint32_t last_seen = world.moving;
    const Carried *carried_now = nullptr, *carried_end = nullptr; // what a has from b on
    for (const Contact& contact : batch.items) {
        const std::uint32_t a = contact.pair.a, b = contact.pair.b;
        if (!moves(a)) continue; // nor does b: what moves comes first
        if (a != last_seen) {
            last_seen = a;
            carried_now = carried.data() + carried_of[a];
            carried_end = carried.data() + carried_of[a + 1];
        }
        while (carried_now != carried_end && carried_now->b < b)
            ++carried_now;
        const Vec3 normal = vec(contact.normal);
        for (std::uint32_t i = 0; i < contact.count; ++i) {
            const auto& point = contact.point[i];
            const Vec3 from_a = vec(point.from_a), from_b = vec(point.from_b);
            Load load;
            for (const Carried* c = carried_now; c != carried_end && c->b == b; ++c)
                if (c->feature == point.feature) {
                    load = c->load;
                    load.across = load.across - dot(load.across, normal) * normal;
                    break;
                }
            const float closing =
                dot(normal, velocity_at(world.bodies[b], from_b) - velocity_at(world.bodies[a], from_a));
            if (load.along == 0 && frame_time * closing - point.depth > near_enough) continue;
            block.deepest = std::max(block.deepest, point.depth);
            const std::size_t k = block.points % strip;
            if (k == 0) p = strip_of(batch.work.block, block.points / strip);
            put(p.normal, k, normal);
            put(p.from_a, k, from_a);
            put(p.from_b, k, from_b);
            put(p.across, k, load.across);
            p.gap[k] = -point.depth;
            p.along[k] = load.along;
            const std::uint32_t number_a = number(a), number_b = number(b);
            body_a[first + block.points] = static_cast<std::uint16_t>(number_a);
            body_b[first + block.points] = static_cast<std::uint16_t>(number_b);
            feature[first + block.points] = point.feature;
            ++block.points;
            Sum &on_a = scratch.sums[number_a], &on_b = scratch.sums[number_b];
            const Vec3 impulse = load.along * normal + load.across;
            on_a.add(-1.0f * impulse, cross(from_a, -1.0f * impulse));
            on_b.add(impulse, cross(from_b, impulse));
            ++on_a.points;
            ++on_b.points;
        }
    }
}

/// Keeps what points carry, by body, for the next frame.
void Simulation::Implementation::carry_over()
{
    if (carried.size() < points) carried.resize(points + points / 4);
    each_block([&](Work work) {
        const Block& block = blocks[work.block];
        const std::uint32_t* const bodies = bodies_of(work.block);
        const std::size_t first = first_point(work.block);
        std::uint64_t at = block.points_before;
        std::uint32_t next_a = block.last_a_before; // the lowest without a first point so far
        for (std::size_t i = 0; i < block.points; ++i, ++at) {
            for (; next_a <= bodies[body_a[first + i]]; ++next_a)
                carried_of[next_a] = at;
            const Points p = strip_of(work.block, i / strip);
            carried[at] = {bodies[body_b[first + i]],
                           feature[first + i],
                           {p.along[i % strip], get(p.across, i % strip)}};
        }
    });
    std::fill(carried_of.begin() + last_a, carried_of.end(), points);
}

} // namespace jostle_simulation
