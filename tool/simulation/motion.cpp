// SPDX-License-Identifier: MIT
// How bodies move: what they can reach within a frame, where they are at its end, and out of each other.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tool/simulation/implementation.hpp"

namespace jostle_simulation {

namespace {

constexpr float pushed_out = 0.8f; ///< of the rest, per frame, by all points of a body together

} // namespace

/// Gravity, and boxes that hold all that a body can reach within the frame.
void Simulation::Implementation::make_boxes()
{
    motion_before =
        sum_over_bodies([&](Sums& sum, std::uint32_t i) { sum.motion += motion_of(world.bodies[i]); }).motion;
    fastest_of.assign(world.moving / bodies_per_block + 1, 0);
    jostle::bounds({world.shapes, world.poses}, boxes, slop, executor);
    jostle::process_items(
        world.moving,
        [&](std::uint64_t begin, std::uint64_t end, Work work) {
            float fastest = 0;
            for (std::uint64_t i = begin; i < end; ++i) {
                Body& body = world.bodies[i];
                body.linear = body.linear + frame_time * world.gravity;
                jostle::Aabb3f& box = boxes[i];
                // A surface turns about the centre, no further away than half the box's diagonal.
                const Vec3 half =
                    0.5f * Vec3{box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]};
                const float turning = std::sqrt(dot(body.angular, body.angular) * dot(half, half));
                const float way[3] = {frame_time * body.linear.x, frame_time * body.linear.y,
                                      frame_time * body.linear.z};
                const float turned = world.shapes[i].type() == jostle::ShapeTypes::sphere
                                         ? 0
                                         : std::min(frame_time * turning, 0.2f);
                for (int d = 0; d < 3; ++d) {
                    box.lo[d] += std::min(way[d], 0.0f) - turned;
                    box.hi[d] += std::max(way[d], 0.0f) + turned;
                }
                fastest = std::max(fastest, std::sqrt(dot(body.linear, body.linear)) * frame_time + turned);
            }
            fastest_of[work.block] = fastest;
        },
        by(bodies_per_block));
    reach = 2 * (slop + *std::max_element(fastest_of.begin(), fastest_of.end()));
}

/// Undoes overlap in positions rather than by velocities, which would keep it as energy. Lifting bodies takes
/// some, too: no more than the frame has lost.
void Simulation::Implementation::push_out(double lost)
{
    pushes.start(world.moving, plan);
    each_block([&](Work work) {
        const Block& block = blocks[work.block];
        if (block.deepest <= slop) return;
        const std::uint32_t* const bodies = bodies_of(work.block);
        std::vector<Sum>& on = scratches[work.slot].sums;
        std::fill_n(on.begin(), block.bodies, Sum{});
        const std::size_t first = first_point(work.block);
        for (std::size_t i = 0; i < block.points; ++i) {
            const Points p = strip_of(work.block, i / strip);
            const std::size_t k = i % strip;
            const float overlap = -p.gap[k] - slop;
            if (overlap <= 0) continue;
            const std::uint32_t number_a = body_a[first + i], number_b = body_b[first + i];
            const std::uint32_t a = bodies[number_a], b = bodies[number_b];
            const float ease_a = world.bodies[a].inverse_mass, ease_b = world.bodies[b].inverse_mass;
            const float size = pushed_out * overlap / (ease_a * points_of[a] + ease_b * points_of[b]);
            on[number_a].add(-size * ease_a * get(p.normal, k), {});
            on[number_b].add(size * ease_b * get(p.normal, k), {});
        }
        add_to_bodies(work,
                      [&](std::uint32_t body, const Sum& sum) { pushes.add(work, body, {sum.linear}); });
    });
    const auto merged = pushes.merge();
    const double lifting = -sum_over_bodies([&](Sums& sum, std::uint32_t i) {
                                sum.fall += dot(world.gravity, merged[i].way) / world.bodies[i].inverse_mass;
                            }).fall;
    const auto part = static_cast<float>(lifting > lost ? lost / lifting : 1);
    each_body([&](std::uint32_t i) {
        jostle::Vec<3, float>& position = world.poses[i].position;
        position[0] += part * merged[i].way.x;
        position[1] += part * merged[i].way.y;
        position[2] += part * merged[i].way.z;
    });
}

void Simulation::Implementation::move()
{
    // What iterations haven't settled can push too much. Then everything is slowed down until the frame gains
    // no energy: the larger root of slowed^2 motion - slowed fall - motion_before = 0. Without gravity there
    // is nothing to settle, and momentum to keep.
    const Sums sum = sum_over_bodies([&](Sums& s, std::uint32_t i) {
        const Body& body = world.bodies[i];
        s.motion += motion_of(body);
        s.fall += frame_time * dot(world.gravity, body.linear) / body.inverse_mass;
    });
    double slowed = 1, lost = motion_before + sum.fall - sum.motion;
    if (lost < 0 && dot(world.gravity, world.gravity) > 0) {
        slowed =
            (sum.fall + std::sqrt(sum.fall * sum.fall + 4 * sum.motion * motion_before)) / (2 * sum.motion);
        lost = 0;
    }
    if (pushing && lost > 0) push_out(lost);
    each_body([&](std::uint32_t i) {
        Body& body = world.bodies[i];
        body.linear = static_cast<float>(slowed) * body.linear;
        body.angular = static_cast<float>(slowed) * body.angular;
        jostle::Pose3f& pose = world.poses[i];
        pose.position[0] += frame_time * body.linear.x;
        pose.position[1] += frame_time * body.linear.y;
        pose.position[2] += frame_time * body.linear.z;
        // Half the product of the angular velocity, as a quaternion, and the rotation.
        const Vec3 w = (0.5f * frame_time) * body.angular;
        const auto [x, y, z, s] = pose.rotation;
        const float turned[4] = {x + w.x * s + w.y * z - w.z * y, y + w.y * s + w.z * x - w.x * z,
                                 z + w.z * s + w.x * y - w.y * x, s - w.x * x - w.y * y - w.z * z};
        const float length = std::sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] +
                                       turned[3] * turned[3]);
        for (std::size_t k = 0; k < 4; ++k)
            pose.rotation[k] = turned[k] / length;
    });
}

} // namespace jostle_simulation
