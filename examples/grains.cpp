// SPDX-License-Identifier: MIT
// Grains of sizes 1 to 20 that fly about, fall, collide and rub, in space that repeats itself along x and y.
// Pairs are searched now and then only: a Verlet list. Usage: grains [GRAINS] [STEPS]
#include <jostle/jostle.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace {

using jostle::Vec3f;
constexpr float stiffness = 1e5f, friction = 0.5f, skin = 0.3f, dt = 1e-3f, largest = 20, gravity = 10;

struct Grain
{
    Vec3f velocity{}, spin{};
    float radius = 0, mass = 0;
};

struct Load
{
    Vec3f force{}, torque{};
    Load& operator+=(const Load& other)
    {
        force += other.force, torque += other.torque;
        return *this;
    }
};

/// Two grains of the list, and how far the second one's image is away from it.
struct Neighbours
{
    std::uint32_t a, b;
    Vec3f shift;
};

/// The force on a (spring, dashpot and friction), and the torque on a or b divided by its radius.
Load push(const Grain& a, const Grain& b, const Vec3f& to_b)
{
    const float reach = a.radius + b.radius, squared = jostle::dot(to_b, to_b);
    if (squared >= reach * reach || squared == 0) return {};
    const float distance = std::sqrt(squared), mass = a.mass * b.mass / (a.mass + b.mass);
    const Vec3f normal = to_b * (1 / distance), turning = a.spin * a.radius + b.spin * b.radius;
    const Vec3f slip = b.velocity - a.velocity - jostle::cross(turning, normal);
    const float approach = -jostle::dot(slip, normal), damping = 0.4f * std::sqrt(stiffness * mass);
    const float pressure = std::max(0.0f, stiffness * (reach - distance) + damping * approach);
    const Vec3f along = slip + normal * approach;
    const Vec3f drag = along * std::min(damping, friction * pressure / (jostle::length(along) + 1e-9f));
    return {drag - normal * pressure, jostle::cross(normal, drag)};
}

} // namespace

int main(int argc, char** argv)
{
    const std::size_t count = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 50'000;
    const std::size_t steps = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 500;
    std::mt19937 random(1);
    const auto uniform = [&] { return static_cast<float>(random()) / 4294967296.0f; };
    std::vector<Grain> grains(count);
    float volume = 0;
    for (Grain& grain : grains) { // each size fills as much space as any other
        grain.radius = 1 / std::sqrt(1 - uniform() * (1 - 1 / (largest * largest)));
        grain.mass = 4.19f * grain.radius * grain.radius * grain.radius;
        grain.velocity = {uniform() * 20 - 10, uniform() * 20 - 10, uniform() * 20 - 10};
        volume += grain.mass;
    }
    std::sort(grains.begin(), grains.end(), [](auto& a, auto& b) { return a.radius > b.radius; });
    const float side = std::max(5 * largest, std::cbrt(4 * volume));
    std::vector<jostle::Shape3> shapes;
    std::vector<jostle::Pose3f> poses(count);
    jostle::BoxIndex3f placed; // grain after grain, where nothing is yet
    for (std::uint32_t i = 0; i < count; ++i) {
        shapes.push_back(jostle::Shape3::sphere(double{grains[i].radius}));
        const float room = side - 2 * grains[i].radius;
        float top = room; // higher after many tries
        do
            poses[i].position = Vec3f{uniform() * room, uniform() * room, uniform() * (top *= 1.001f)} +
                                Vec3f{1, 1, 1} * grains[i].radius;
        while (placed.any(jostle::bounds(shapes[i], poses[i])));
        const jostle::Aabb3f box = jostle::bounds(shapes[i], poses[i]);
        placed.insert(i, box);
    }
    jostle::PeriodicImages3f images;
    jostle::PairFinder finder;
    std::vector<jostle::Aabb3f> boxes(count);
    std::vector<Vec3f> at_search(count);
    std::vector<Neighbours> list;
    const auto to_b = [&](const auto& n) { return poses[n.b].position + n.shift - poses[n.a].position; };
    const auto search = [&] {
        for (std::size_t i = 0; i < count; at_search[i] = poses[i].position, ++i)
            for (int d = 0; d < 2; ++d) // back into the first period
                poses[i].position[d] -= side * std::floor(poses[i].position[d] / side);
        jostle::bounds({shapes, poses}, boxes, skin / 2); // good until something has moved as far as that
        images.build(boxes, {side, side, 0});
        list.clear();
        for (const jostle::Pair pair : finder.find(images.boxes(), images.filter())) {
            const Neighbours n{pair.a, images.origin()[pair.b], images.shift()[pair.b]};
            const float near = grains[n.a].radius + grains[n.b].radius + skin;
            if (jostle::dot(to_b(n), to_b(n)) <= near * near) list.push_back(n); // not only their boxes
        }
    };
    jostle::Responses<Load> loads;
    std::size_t searches = 0;
    float furthest = skin * skin; // squared distance moved since the search; at first enough for one
    for (std::size_t step = 0; step < steps; ++step) {
        if (furthest >= 0.25f * skin * skin) search(), ++searches;
        loads.start(static_cast<std::uint32_t>(count), jostle::plan_work(list.size()));
        jostle::process_items(list.size(), [&](std::uint64_t begin, std::uint64_t end, jostle::Work work) {
            for (std::uint64_t i = begin; i < end; ++i) {
                const Neighbours& n = list[i];
                const Load load = push(grains[n.a], grains[n.b], to_b(n));
                if (load.force == Vec3f{}) continue;
                loads.add(work, n.a, {load.force, load.torque * grains[n.a].radius}); // no lock: merged below
                loads.add(work, n.b, {-load.force, load.torque * grains[n.b].radius});
            }
        });
        const std::span<const Load> sums = loads.merge(); // the same bits on any number of threads
        furthest = 0;
        for (std::size_t i = 0; i < count; ++i) {
            Grain& grain = grains[i];
            const float depth = std::max(0.0f, grain.radius - poses[i].position[2]); // in the floor
            const float up = depth == 0 ? 0 : stiffness * depth - 9 * grain.mass * grain.velocity[2];
            grain.velocity +=
                (sums[i].force + Vec3f{0, 0, up}) * (dt / grain.mass) - Vec3f{0, 0, gravity * dt};
            grain.spin += sums[i].torque * (dt / (0.4f * grain.mass * grain.radius * grain.radius));
            poses[i].position += grain.velocity * dt;
            const Vec3f moved = poses[i].position - at_search[i];
            furthest = std::max(furthest, jostle::dot(moved, moved));
        }
    }

    // The list still has every contact: a new search finds the same, except for rounding.
    const auto contacts = [&](float part) {
        return std::count_if(list.begin(), list.end(), [&](const Neighbours& n) {
            return jostle::length(to_b(n)) < part * (grains[n.a].radius + grains[n.b].radius);
        });
    };
    const auto known = contacts(1), known_well = contacts(0.999f);
    search();
    std::printf("%zu grains, %zu steps, %zu searches: %td contacts, %td found anew\n", count, steps, searches,
                known, contacts(1));
    const bool complete = known >= contacts(0.999f) && contacts(1) >= known_well;
    return complete && 2 * searches < steps && known > 0 ? 0 : 1;
}
