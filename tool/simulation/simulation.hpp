// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "jostle/box.hpp"
#include "jostle/contact.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/shapes.hpp"

/// Bodies that fall, collide and come to rest: the whole pipeline of the library in one place, to show how
/// its parts go together and to measure them at work. Not a physics engine: no joints, no sleeping, no
/// bouncing.
namespace jostle_simulation {

struct SceneInfo
{
    std::string_view name;
    std::string_view summary;
};
[[nodiscard]] std::span<const SceneInfo> scene_list() noexcept;

struct Options
{
    std::string_view scene = "spheres";
    std::uint32_t bodies = 1000;
    std::uint64_t seed = 1;
    /// Null means jostle::default_executor().
    jostle::Executor* executor = nullptr;
    jostle::InstructionSet instruction_set = jostle::supported_instruction_sets().front();
};

/// Milliseconds of a frame's stages, in their order.
struct StageTimes
{
    static constexpr std::size_t count = 5;
    static constexpr std::array<const char*, count> names = {"boxes", "pairs", "contacts", "responses",
                                                             "motion"};
    std::array<double, count> ms = {};
};

/// Units    metres, kilograms, seconds; 60 frames a second; gravity 9.81 along -y.
/// Bodies   spheres, cubes and octahedra of 0.3 to 0.5 m: shapes that turn about every axis alike.
/// Exact    the same bits for any number of threads, executor, instruction set and compiler.
/// Method   docs/guide/simulate.md.
/// Errors   std::invalid_argument for an unknown scene, naming those there are.
class Simulation
{
  public:
    explicit Simulation(const Options& options);
    ~Simulation();

    void step();

    [[nodiscard]] std::uint32_t bodies() const noexcept;
    /// Of the last step: pairs of boxes, and points of contact that pushed or rubbed.
    [[nodiscard]] std::uint64_t pairs() const noexcept;
    [[nodiscard]] std::uint64_t contacts() const noexcept;
    /// Of the last step: how often the impulses were gone over.
    [[nodiscard]] int iterations() const noexcept;
    [[nodiscard]] const StageTimes& times() const noexcept;

    /// Of all bodies: motion, rotation and height above the floor, in joule.
    [[nodiscard]] double energy() const;
    [[nodiscard]] jostle::Vec3d momentum() const;
    /// Of the body: position and velocity.
    [[nodiscard]] jostle::Vec3f position(std::uint32_t body) const noexcept;
    [[nodiscard]] jostle::Vec3f velocity(std::uint32_t body) const noexcept;
    /// In radians a second, about each axis of the world.
    [[nodiscard]] jostle::Vec3f angular_velocity(std::uint32_t body) const noexcept;
    /// Of the bodies and, after them, of floor and walls. They stay where they are for the simulation's life.
    [[nodiscard]] std::span<const jostle::Shape3> shapes() const noexcept;
    [[nodiscard]] std::span<const jostle::Pose3f> poses() const noexcept;
    /// Where they touch, or may before the step ends: valid until the next step, null before the first.
    [[nodiscard]] const jostle::ContactBuffer<3, float>* contact_list() const noexcept;
    /// The deepest contact of the last step, in metres.
    [[nodiscard]] double deepest() const noexcept;
    /// Of the poses and velocities of all bodies, bit by bit.
    [[nodiscard]] std::uint64_t hash() const;
    /// The tight boxes of the bodies as they are now, valid until the next step. Floor and walls have none.
    [[nodiscard]] std::span<const jostle::Aabb3f> boxes();

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

} // namespace jostle_simulation
