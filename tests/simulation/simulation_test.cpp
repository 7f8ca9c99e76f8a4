// SPDX-License-Identifier: MIT
// What must hold for falling bodies, whatever the numbers are: energy, momentum, rest, and the same bits from
// every number of threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "jostle/contact.hpp"
#include "tests/process/executors.hpp"
#include "tool/simulation/scenes.hpp"
#include "tool/simulation/simulation.hpp"
#include "tool/simulation/solve.hpp"

namespace {

using jostle_simulation::Options;
using jostle_simulation::Simulation;

Options options_for(std::string_view scene, std::uint32_t bodies, jostle::Executor& executor)
{
    Options options;
    options.scene = scene;
    options.bodies = bodies;
    options.executor = &executor;
    return options;
}

double fastest(const Simulation& simulation)
{
    double most = 0;
    for (std::uint32_t i = 0; i < simulation.bodies(); ++i)
        for (const float v : simulation.velocity(i))
            most = std::max(most, std::abs(double{v}));
    return most;
}

TEST(Simulation, TheSameBitsOnAnyThreadsAndInstructionSet)
{
    for (const auto& info : jostle_simulation::scene_list()) {
        std::uint64_t first = 0;
        const auto hash = [&](jostle::Executor& executor, jostle::InstructionSet set) {
            Options options = options_for(info.name, 300, executor);
            options.instruction_set = set;
            Simulation simulation(options);
            for (int frame = 0; frame < 70; ++frame)
                simulation.step();
            EXPECT_GT(simulation.contacts(), 100u) << info.name;
            return simulation.hash();
        };
        for (const auto& [name, executor] : process_test::all_executors()) {
            const std::uint64_t found = hash(*executor, jostle::supported_instruction_sets().front());
            if (first == 0) first = found;
            EXPECT_EQ(found, first) << info.name << ", " << name;
        }
        for (const jostle::InstructionSet set : jostle::supported_instruction_sets())
            EXPECT_EQ(hash(jostle::serial_executor(), set), first) << info.name << ", " << jostle::name(set);
    }
}

TEST(Simulation, EnergyNeverGrows)
{
    const auto executor = jostle::make_thread_executor(2);
    for (const auto& info : jostle_simulation::scene_list()) {
        Simulation simulation(options_for(info.name, 250, *executor));
        const double first = simulation.energy();
        ASSERT_GT(first, 0);
        double before = first;
        for (int frame = 1; frame <= 250; ++frame) {
            simulation.step();
            const double now = simulation.energy();
            ASSERT_LE(now, before + 1e-8 * first)
                << info.name << ", frame " << frame; // rounding of positions
            before = now;
        }
        EXPECT_LT(before, 0.9 * first) << info.name; // something has happened
    }
}

TEST(Simulation, FreeFallIsFreeFall)
{
    Simulation simulation(options_for("spheres", 1, jostle::serial_executor()));
    const auto start = simulation.position(0);
    double height = start[1], speed = 0;
    int frame = 0;
    for (; simulation.contacts() == 0 && frame < 100; ++frame) {
        EXPECT_NEAR(simulation.position(0)[1], height, 1e-4);
        EXPECT_EQ(simulation.position(0)[0], start[0]);
        speed -= 9.81 / 60;
        height += speed / 60;
        simulation.step();
    }
    EXPECT_GT(frame, 3);
    for (; frame < 150; ++frame)
        simulation.step();
    EXPECT_LT(fastest(simulation), 1e-5); // lies on the floor
    const float radius = (simulation.boxes()[0].hi[1] - simulation.boxes()[0].lo[1]) / 2;
    EXPECT_NEAR(simulation.position(0)[1], radius, 0.006);
}

TEST(Simulation, APileComesToRestAndStaysThere)
{
    const auto executor = jostle::make_thread_executor(2);
    for (const std::string_view scene : {"spheres", "boxes"}) {
        Simulation simulation(options_for(scene, 60, *executor));
        for (int frame = 0; frame < 1000; ++frame)
            simulation.step();
        std::vector<jostle::Vec3f> at;
        for (std::uint32_t i = 0; i < simulation.bodies(); ++i) {
            at.push_back(simulation.position(i));
            EXPECT_GT(at.back()[1], 0.2f); // on the floor, not in it
        }
        for (int frame = 0; frame < 200; ++frame) {
            simulation.step();
            ASSERT_LT(fastest(simulation), 0.01) << scene << ", frame " << frame;
        }
        for (std::uint32_t i = 0; i < simulation.bodies(); ++i)
            for (std::size_t d = 0; d < 3; ++d)
                ASSERT_NEAR(simulation.position(i)[d], at[i][d], 0.002) << scene << ", body " << i;
    }
}

// Fewer would do for all else that is promised here: bodies would only go into each other. With at most 4
// iterations they do so by 0.119 m while they fall; with one at rest, by 0.031 m in the end.
TEST(Simulation, IterationsAreAsManyAsItTakes)
{
    Simulation simulation(options_for("spheres", 300, jostle::serial_executor()));
    for (int frame = 0; frame < 300; ++frame) {
        simulation.step();
        EXPECT_LT(simulation.deepest(), frame < 250 ? 0.06 : 0.026) << frame;
        EXPECT_GE(simulation.iterations(), 4) << frame;
    }
    EXPECT_EQ(simulation.iterations(), 4); // at rest
}

// Where a fifth of the overlap is undone in a frame rather than four, cubes sink into each other by 0.38 m;
// where two whose faces nearly look at each other touch in one point, by 0.43 m.
TEST(Simulation, CubesDontSinkFarIntoEachOther)
{
    Simulation simulation(options_for("boxes", 300, jostle::serial_executor()));
    for (int frame = 0; frame < 600; ++frame) {
        simulation.step();
        ASSERT_LT(simulation.deepest(), 0.25) << frame;
    }
}

// Bodies that overlap are pushed apart, upwards as well as sideways. Where they aren't, these lie in each
// other by 0.10 and 0.15 m; where they are pushed along x alone, by 0.12 and 0.15.
TEST(Simulation, WhatHasSunkIsPushedOut)
{
    for (const auto& [scene, most] : {std::pair{"boxes", 0.06}, std::pair{"mixed", 0.1}}) {
        Simulation simulation(options_for(scene, 250, jostle::serial_executor()));
        double sum = 0;
        for (int frame = 0; frame < 500; ++frame) {
            simulation.step();
            if (frame >= 400) sum += simulation.deepest();
        }
        EXPECT_LT(sum / 100, most) << scene;
    }
}

// Bodies push each other out until 5 mm of overlap are left, and not only from more than that on: the deepest
// of piles at rest are 6.0 mm in each other on average. Where what is left alone is twice as much, for all,
// for those of a block or for a point, it is 9.5 to 10.1 mm.
TEST(Simulation, WhatRestsIsPushedOutAsFarAsPromised)
{
    double sum = 0;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        Options options = options_for("spheres", 30, jostle::serial_executor());
        options.seed = seed;
        Simulation simulation(options);
        for (int frame = 0; frame < 500; ++frame)
            simulation.step();
        sum += simulation.deepest();
    }
    EXPECT_LT(sum / 6, 0.0078);
}

// By points all over the shape that weigh alike.
TEST(Bodies, WeighAndTurnAsTheirShapesSay)
{
    const jostle_simulation::World world = jostle_simulation::make_world("mixed", 9, 1);
    for (std::uint32_t i = 0; i < 9; ++i) {
        constexpr int steps = 40;
        constexpr double reach = 0.9, step = 2 * reach / steps; // the greatest is a cube of half an edge 0.5
        double mass = 0, inertia = 0;
        const auto at = [](int k) { return (k + 0.5) * step - reach; };
        for (int x = 0; x < steps; ++x)
            for (int y = 0; y < steps; ++y)
                for (int z = 0; z < steps; ++z) {
                    jostle::Pose3d place;
                    place.position = {at(x), at(y), at(z)};
                    if (!jostle::touching(world.shapes[i], jostle::Pose3d(), jostle::Shape3(), place))
                        continue;
                    const double weight = 1000 * step * step * step; // water's
                    mass += weight;
                    inertia += weight * (at(x) * at(x) + at(z) * at(z));
                }
        EXPECT_NEAR(1 / world.bodies[i].inverse_mass, mass, 0.15 * mass) << i;
        EXPECT_NEAR(world.bodies[i].inverse_mass / world.bodies[i].inverse_inertia, inertia / mass,
                    0.1 * inertia / mass)
            << i;
    }
}

TEST(Solver, SurfacesDontPullAndFrictionHoldsHalfOfWhatPresses)
{
    using namespace jostle_simulation;
    for (const jostle::InstructionSet set : jostle::supported_instruction_sets()) {
        SCOPED_TRACE(jostle::name(set));
        std::vector<float> numbers(16 * strip, 0.0f);
        float* column = numbers.data();
        const auto next = [&] { return std::exchange(column, column + strip); };
        const auto next3 = [&]() -> Columns3 {
            float *const x = next(), *const y = next(), *const z = next();
            return {x, y, z};
        };
        Points points{};
        points.normal = next3();
        points.from_a = next3();
        points.from_b = next3();
        points.across = next3();
        points.gap = next();
        points.along = next();
        points.mass_along = next();
        points.mass_across = next();
        const auto bodies = std::make_unique<StripBodies>();
        const auto out = std::make_unique<StripImpulses>();
        // b comes down on a: fast sideways, slowly sideways, and in the third point it leaves.
        const Vec3 velocity[3] = {{3, -1, 4}, {0.125f, -1, 0}, {1, 1, 0}};
        for (std::size_t k = 0; k < 3; ++k) {
            put(points.normal, k, {0, 1, 0});
            put(bodies->linear_b, k, velocity[k]);
            points.mass_along[k] = points.mass_across[k] = 2;
        }
        solver_for(set).solve(points, *bodies, 3, *out);
        const float along[3] = {2, 2, 0};
        const Vec3 across[3] = {{-0.6f, 0, -0.8f}, {-0.25f, 0, 0}, {}};
        for (std::size_t k = 0; k < 3; ++k) {
            SCOPED_TRACE(k);
            EXPECT_EQ(points.along[k], along[k]);
            EXPECT_NEAR(get(points.across, k).x, across[k].x, 1e-6);
            EXPECT_NEAR(get(points.across, k).y, across[k].y, 1e-6);
            EXPECT_NEAR(get(points.across, k).z, across[k].z, 1e-6);
            EXPECT_EQ(get(out->impulse, k).y, along[k]);
            EXPECT_EQ(out->wrong[k], k == 2 ? 0.0f : 1.0f);
        }
    }
}

TEST(Simulation, MomentumIsKeptInAClosedSystem)
{
    Simulation simulation(options_for("closed", 400, jostle::serial_executor()));
    const auto first = simulation.momentum();
    double scale = 0; // of the momenta that cancel each other out
    for (const double p : first)
        scale = std::max(scale, std::abs(p));
    ASSERT_GT(scale, 1000);
    std::uint64_t contacts = 0;
    for (int frame = 0; frame < 300; ++frame) {
        simulation.step();
        contacts += simulation.contacts();
        for (std::size_t d = 0; d < 3; ++d)
            ASSERT_NEAR(simulation.momentum()[d], first[d], 1e-4 * scale) << frame;
    }
    EXPECT_GT(contacts, 10'000u);
}

TEST(Simulation, BoxesAreTight)
{
    Simulation simulation(options_for("spheres", 100, jostle::serial_executor()));
    for (int frame = 0; frame < 5; ++frame)
        simulation.step();
    const auto boxes = simulation.boxes();
    ASSERT_EQ(boxes.size(), 100u);
    for (std::uint32_t i = 0; i < 100; ++i)
        for (std::size_t d = 0; d < 3; ++d) {
            const double middle = (double{boxes[i].lo[d]} + boxes[i].hi[d]) / 2,
                         size = boxes[i].hi[d] - boxes[i].lo[d];
            EXPECT_NEAR(middle, simulation.position(i)[d], 1e-5);
            EXPECT_GT(size, 0.599);
            EXPECT_LT(size, 1.001);
        }
}

TEST(Simulation, AnUnknownSceneIsSaid)
{
    Options options;
    options.scene = "cheese";
    try {
        const Simulation simulation(options);
        FAIL();
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("cheese"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find("spheres, boxes, mixed, closed"), std::string::npos);
    }
}

} // namespace
