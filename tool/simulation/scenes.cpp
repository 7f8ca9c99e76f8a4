// SPDX-License-Identifier: MIT
#include "tool/simulation/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "tool/scenes/random.hpp"
#include "tool/simulation/simulation.hpp"

namespace jostle_simulation {

namespace {

using jostle::Shape3;
using jostle_scenes::Random;

constexpr SceneInfo scenes[] = {
    {"spheres", "spheres falling into a basin"},
    {"boxes", "cubes falling into a basin"},
    {"mixed", "spheres, cubes and octahedra falling into a basin"},
    {"closed", "spheres and cubes that fly into each other, without gravity, floor or walls"},
};

enum class Kind
{
    sphere,
    cube,
    octahedron
};

Kind kind_of(std::string_view scene, std::uint32_t i)
{
    if (scene == "spheres") return Kind::sphere;
    if (scene == "boxes") return Kind::cube;
    if (scene == "closed") return i % 2 == 0 ? Kind::sphere : Kind::cube;
    return static_cast<Kind>(i % 3);
}

constexpr double density = 1000; // water's

/// All three have the same moment of inertia about every axis through the centre.
Body body_of(Kind kind, double size)
{
    double mass = 0, inertia = 0;
    switch (kind) {
    case Kind::sphere: // radius
        mass = density * 4 / 3 * 3.14159265358979 * size * size * size;
        inertia = 0.4 * mass * size * size;
        break;
    case Kind::cube: // half an edge
        mass = density * 8 * size * size * size;
        inertia = mass * 4 * size * size / 6;
        break;
    case Kind::octahedron: // from the centre to a corner
        mass = density * 4 / 3 * size * size * size;
        inertia = mass * 0.2 * size * size;
        break;
    }
    return {{}, static_cast<float>(1 / mass), {}, static_cast<float>(1 / inertia)};
}

std::array<float, 4> random_rotation(Random& random)
{
    // A point in the unit ball of four dimensions, by rejection.
    for (;;) {
        double q[4], length = 0;
        for (double& c : q) {
            c = random.uniform(-1, 1);
            length += c * c;
        }
        if (length > 1 || length < 0.01) continue;
        length = std::sqrt(length);
        return {static_cast<float>(q[0] / length), static_cast<float>(q[1] / length),
                static_cast<float>(q[2] / length), static_cast<float>(q[3] / length)};
    }
}

void add_wall(World& world, double x, double y, double z, double half_x, double half_y, double half_z)
{
    world.shapes.push_back(Shape3::box({half_x, half_y, half_z}));
    jostle::Pose3f pose;
    pose.position = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
    world.poses.push_back(pose);
    world.bodies.push_back({{}, 0, {}, 0});
}

} // namespace

std::span<const SceneInfo> scene_list() noexcept
{
    return scenes;
}

World make_world(std::string_view scene, std::uint32_t bodies, std::uint64_t seed)
{
    if (std::none_of(std::begin(scenes), std::end(scenes),
                     [&](const SceneInfo& s) { return s.name == scene; })) {
        std::string message = std::string(scene) + " is not a scene; choose ";
        for (const SceneInfo& info : scenes)
            message += (&info == scenes ? "" : ", ") + std::string(info.name);
        throw std::invalid_argument(message);
    }
    const bool closed = scene == "closed";
    World world;
    world.moving = bodies;
    world.most_points = scene == "spheres" ? 1 : 4;
    world.gravity = closed ? Vec3{} : Vec3{0, -9.81f, 0};

    // On a lattice wide enough that they don't touch however they are turned, numbered column by column: what
    // is near in space is near in memory. Falling, they are at most `layers` deep.
    constexpr double least = 0.3, most = 0.5;
    const std::uint32_t layers = closed ? 0 : scene == "spheres" ? 8 : 4;
    const double spacing = (scene == "spheres" ? 2 * most : 2 * most * 1.7321) + 0.05;
    std::uint32_t side = 1;
    while (closed ? std::uint64_t{side} * side * side < bodies : std::uint64_t{side} * side * layers < bodies)
        ++side;
    world.hulls.reserve(8); // shapes point into it
    for (int k = 0; k < 8; ++k) {
        const double size = least + (most - least) * k / 7;
        std::vector<jostle::Vec<3, double>> corners;
        for (int d = 0; d < 6; ++d) {
            corners.push_back({0, 0, 0});
            corners.back()[static_cast<std::size_t>(d / 2)] = d % 2 == 0 ? size : -size;
        }
        world.hulls.emplace_back(corners);
    }
    for (std::uint32_t i = 0; i < bodies; ++i) {
        Random random(seed, i, 0);
        const Kind kind = kind_of(scene, i);
        const std::uint32_t eighth = random.below(8);
        const double size = least + (most - least) * eighth / 7;
        world.shapes.push_back(kind == Kind::sphere ? Shape3::sphere(size)
                               : kind == Kind::cube ? Shape3::box({size, size, size})
                                                    : Shape3(world.hulls[eighth]));
        world.bodies.push_back(body_of(kind, size));
        const std::uint32_t high = closed ? side : layers;
        const double at[3] = {double(i / high % side), double(i % high), double(i / high / side)};
        jostle::Pose3f pose;
        for (std::size_t d = 0; d < 3; ++d) {
            const double middle = d == 1 && !closed ? 0 : 0.5 * (side - 1);
            pose.position[d] = static_cast<float>((at[d] - middle) * spacing + random.uniform(-0.02, 0.02));
        }
        if (!closed) pose.position[1] += static_cast<float>(0.5 * spacing + 0.1);
        if (kind != Kind::sphere) pose.rotation = random_rotation(random);
        Body& body = world.bodies.back();
        if (closed) { // towards the middle, and some of it by chance
            body.linear = -0.3f * Vec3{pose.position[0], pose.position[1], pose.position[2]};
            body.linear.x += static_cast<float>(random.normal());
            body.linear.y += static_cast<float>(random.normal());
            body.linear.z += static_cast<float>(random.normal());
            const double spin = kind == Kind::sphere ? 0 : 1;
            body.angular = {static_cast<float>(spin * random.normal()),
                            static_cast<float>(spin * random.normal()),
                            static_cast<float>(spin * random.normal())};
        }
        world.poses.push_back(pose);
    }
    if (!closed) {
        const double half = 0.5 * side * spacing + 0.5, height = (layers + 2) * spacing + 10, thick = 5;
        add_wall(world, 0, -thick, 0, half + 2 * thick, thick, half + 2 * thick);
        for (const double sign : {-1.0, 1.0}) {
            add_wall(world, sign * (half + thick), height, 0, thick, height, half + 2 * thick);
            add_wall(world, 0, height, sign * (half + thick), half, height, thick);
        }
    }
    return world;
}

} // namespace jostle_simulation
