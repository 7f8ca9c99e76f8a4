// SPDX-License-Identifier: MIT
// The simulation of falling bodies.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "extras/js/module.hpp"
#include "tool/simulation/simulation.hpp"

namespace {

using jostle::c_api::guarded;
using jostle_js::Info;

struct RunningSimulation
{
    std::shared_ptr<jostle::Executor> executor;
    std::unique_ptr<jostle_simulation::Simulation> simulation;
    std::vector<jostle_block> contact_table;
    jostle_blocks contacts{};
};

struct SimulationNumbers
{
    double bodies, pairs, contact_points, iterations, energy, deepest;
    double ms[jostle_simulation::StageTimes::count];
    std::uint64_t hash;
};

} // namespace

JOSTLE_JS std::uint32_t jostle_js_simulation_info(std::uint32_t i, Info* info)
{
    const auto scenes = jostle_simulation::scene_list();
    if (i < scenes.size()) *info = jostle_js::info_of(scenes[i].name, scenes[i].summary);
    return static_cast<std::uint32_t>(scenes.size());
}
JOSTLE_JS jostle_status jostle_js_simulation_new(const char* name, std::uint32_t name_size,
                                                 std::uint32_t bodies, std::uint64_t seed,
                                                 const jostle_executor* executor, RunningSimulation** out,
                                                 jostle_error* error)
{
    return jostle_js::guarded_scene(error, [&] {
        auto made = std::make_unique<RunningSimulation>();
        made->executor = jostle::c_api::keep_executor(executor);
        jostle_simulation::Options options;
        options.scene = std::string_view(name, name_size);
        options.bodies = bodies;
        options.seed = seed;
        options.executor = made->executor.get();
        made->simulation = std::make_unique<jostle_simulation::Simulation>(options);
        *out = made.release();
    });
}
JOSTLE_JS void jostle_js_simulation_free(RunningSimulation* running)
{
    delete running;
}
JOSTLE_JS jostle_status jostle_js_simulation_step(RunningSimulation* running, jostle_error* error)
{
    return guarded(error, [&] { running->simulation->step(); });
}
JOSTLE_JS void jostle_js_simulation_read(const RunningSimulation* running, SimulationNumbers* numbers)
{
    const jostle_simulation::Simulation& simulation = *running->simulation;
    *numbers = {double(simulation.bodies()),
                double(simulation.pairs()),
                double(simulation.contacts()),
                double(simulation.iterations()),
                simulation.energy(),
                simulation.deepest(),
                {},
                simulation.hash()};
    std::copy(simulation.times().ms.begin(), simulation.times().ms.end(), numbers->ms);
}
JOSTLE_JS jostle_status jostle_js_simulation_boxes(RunningSimulation* running, const void** boxes,
                                                   jostle_error* error)
{
    return guarded(error, [&] { *boxes = running->simulation->boxes().data(); });
}
JOSTLE_JS const void* jostle_js_simulation_poses(const RunningSimulation* running)
{
    static_assert(sizeof(jostle::Pose3f) == 7 * sizeof(float));
    return running->simulation->poses().data();
}
/// Linear and angular velocity: 6 numbers a body.
JOSTLE_JS void jostle_js_simulation_velocities(const RunningSimulation* running, float* out)
{
    const jostle_simulation::Simulation& simulation = *running->simulation;
    for (std::uint32_t body = 0; body < simulation.bodies(); ++body) {
        for (const float number : simulation.velocity(body))
            *out++ = number;
        for (const float number : simulation.angular_velocity(body))
            *out++ = number;
    }
}
/// Of each body its shape's type, and how far the shape reaches along its axes.
JOSTLE_JS void jostle_js_simulation_shapes(const RunningSimulation* running, std::uint8_t* types,
                                           float* sizes)
{
    const jostle_simulation::Simulation& simulation = *running->simulation;
    for (std::uint32_t body = 0; body < simulation.bodies(); ++body) {
        const jostle::Shape3& shape = simulation.shapes()[body];
        *types++ = static_cast<std::uint8_t>(shape.type());
        *sizes++ = shape.type() == jostle::ShapeTypes::sphere ? static_cast<float>(shape.radius())
                   : shape.type() == jostle::ShapeTypes::box
                       ? static_cast<float>(shape.size()[0])
                       : static_cast<float>(jostle::bounds(shape, jostle::Pose3d{}).hi[0]);
    }
}
/// The contacts of the last step, as blocks that are valid until the next.
JOSTLE_JS jostle_status jostle_js_simulation_contacts(RunningSimulation* running, jostle_blocks* out,
                                                      jostle_error* error)
{
    return guarded(error, [&] {
        const auto* const list = running->simulation->contact_list();
        running->contact_table.clear();
        if (list != nullptr)
            running->contacts = jostle::c_api::list_blocks<jostle::Contact<3, float>>(
                list->blocks(), list->size(), running->contact_table);
        *out = running->contacts;
    });
}
