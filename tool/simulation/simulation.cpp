// SPDX-License-Identifier: MIT
#include "tool/simulation/simulation.hpp"

#include <chrono>
#include <cstring>
#include <memory>

#include "tool/simulation/implementation.hpp"

namespace jostle_simulation {

namespace {

constexpr int fewest_iterations = 4, most_iterations = 24;
constexpr double settled = 0.02; ///< metres a second; see iterate

} // namespace

void Simulation::Implementation::find_contacts()
{
    contacts = &contact_finder.find({world.shapes, world.poses}, *pairs, reach);
}

void Simulation::Implementation::step()
{
    using Clock = std::chrono::steady_clock;
    Clock::time_point before = Clock::now();
    const auto timed = [&](std::size_t stage, auto&& work) {
        work();
        const Clock::time_point now = Clock::now();
        times.ms[stage] = std::chrono::duration<double, std::milli>(now - before).count();
        before = now;
    };
    timed(0, [&] { make_boxes(); });
    timed(1, [&] { pairs = &finder.find(boxes, {}, jostle::Order::sorted); });
    timed(2, [&] { find_contacts(); });
    timed(3, [&] {
        prepare_points();
        iterations = 0;
        for (bool more = true; more; ++iterations) {
            const double wrong = iterate(iterations == 0);
            more =
                iterations + 1 < fewest_iterations || (wrong > settled && iterations + 1 < most_iterations);
        }
        carry_over();
    });
    timed(4, [&] { move(); });
}

Simulation::Simulation(const Options& options) : implementation_(std::make_unique<Implementation>(options)) {}

Simulation::~Simulation() = default;

void Simulation::step()
{
    implementation_->step();
}

std::uint32_t Simulation::bodies() const noexcept
{
    return implementation_->world.moving;
}

std::uint64_t Simulation::pairs() const noexcept
{
    return implementation_->pairs == nullptr ? 0 : implementation_->pairs->size();
}

std::uint64_t Simulation::contacts() const noexcept
{
    return implementation_->points;
}

const StageTimes& Simulation::times() const noexcept
{
    return implementation_->times;
}

int Simulation::iterations() const noexcept
{
    return implementation_->iterations;
}

double Simulation::deepest() const noexcept
{
    return implementation_->deepest;
}

double Simulation::energy() const
{
    const World& world = implementation_->world;
    double sum = 0;
    for (std::uint32_t i = 0; i < world.moving; ++i) {
        const Body& body = world.bodies[i];
        sum += motion_of(body) - double{world.gravity.y} * world.poses[i].position[1] / body.inverse_mass;
    }
    return sum;
}

jostle::Vec3d Simulation::momentum() const
{
    const World& world = implementation_->world;
    jostle::Vec3d sum = {};
    for (std::uint32_t i = 0; i < world.moving; ++i) {
        const Body& body = world.bodies[i];
        sum[0] += double{body.linear.x} / body.inverse_mass;
        sum[1] += double{body.linear.y} / body.inverse_mass;
        sum[2] += double{body.linear.z} / body.inverse_mass;
    }
    return sum;
}

jostle::Vec3f Simulation::position(std::uint32_t body) const noexcept
{
    return implementation_->world.poses[body].position;
}

jostle::Vec3f Simulation::velocity(std::uint32_t body) const noexcept
{
    const Vec3 v = implementation_->world.bodies[body].linear;
    return {v.x, v.y, v.z};
}

jostle::Vec3f Simulation::angular_velocity(std::uint32_t body) const noexcept
{
    const Vec3 v = implementation_->world.bodies[body].angular;
    return {v.x, v.y, v.z};
}

std::span<const jostle::Shape3> Simulation::shapes() const noexcept
{
    return implementation_->world.shapes;
}

std::span<const jostle::Pose3f> Simulation::poses() const noexcept
{
    return implementation_->world.poses;
}

const jostle::ContactBuffer<3, float>* Simulation::contact_list() const noexcept
{
    return implementation_->contacts;
}

std::uint64_t Simulation::hash() const
{
    // FNV-1a: Fowler, Noll, Vo; over 32 bits at a time.
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto add = [&hash](float value) {
        std::uint32_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        hash = (hash ^ bits) * 0x100000001b3u;
    };
    const World& world = implementation_->world;
    for (std::uint32_t i = 0; i < world.moving; ++i) {
        for (const float value : world.poses[i].position)
            add(value);
        for (const float value : world.poses[i].rotation)
            add(value);
        for (const Vec3& v : {world.bodies[i].linear, world.bodies[i].angular}) {
            add(v.x);
            add(v.y);
            add(v.z);
        }
    }
    return hash;
}

std::span<const jostle::Aabb3f> Simulation::boxes()
{
    Implementation& all = *implementation_;
    jostle::bounds({all.world.shapes, all.world.poses}, all.boxes, 0, all.executor);
    return std::span(all.boxes).first(all.world.moving);
}

} // namespace jostle_simulation
