// SPDX-License-Identifier: MIT
#pragma once

#include "hash_of_pairs.hpp"
#include "tool/simulation/simulation.hpp"

namespace platforms_test {

/// The motion of every scene with bodies. Returns the fewest contacts that a scene had.
inline std::uint64_t add_bodies(Table& table, jostle::Executor& executor, jostle::InstructionSet set)
{
    std::uint64_t fewest = ~std::uint64_t{0};
    for (const jostle_simulation::SceneInfo& scene : jostle_simulation::scene_list()) {
        jostle_simulation::Options options;
        options.scene = scene.name;
        options.bodies = 60;
        options.executor = &executor;
        options.instruction_set = set;
        jostle_simulation::Simulation simulation(options);
        std::uint64_t contacts = 0;
        for (int frame = 0; frame < 60; ++frame) {
            simulation.step();
            contacts += simulation.contacts();
        }
        fewest = contacts < fewest ? contacts : fewest;
        table.emplace_back("bodies_" + std::string(scene.name), simulation.hash());
    }
    return fewest;
}

} // namespace platforms_test
