// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>

#include "hash_of_pairs.hpp"
#include "jostle/world.hpp"

namespace platforms_test {

/// Twelve frames of a world in which a third of a scene's objects moves, comes and goes; `after` is called
/// after each update.
template <class After>
void play(jostle::World3f& world, jostle_scenes::Scene<3, float>& scene, const After& after)
{
    std::vector<jostle::ObjectId> ids(scene.boxes().size());
    for (std::uint32_t frame = 0; frame < 12; ++frame) {
        const std::span<const jostle::Aabb3f> boxes = scene.boxes();
        for (std::uint32_t i = 0; i < ids.size(); ++i) {
            if (frame == 0 || (i % 7 == 0 && i % 5 == frame % 5 && !world.contains(ids[i])))
                ids[i] = world.add(boxes[i], {{1u << i % 3, i % 4 == 0 ? 3u : 7u, i / 2}});
            else if (i % 7 == 0 && i % 11 == frame && world.contains(ids[i]))
                world.remove(ids[i]);
            else if (i % 3 == 0 && world.contains(ids[i]))
                world.move(ids[i], boxes[i]);
        }
        world.update();
        after();
        scene.step();
    }
}

inline std::uint64_t hash_of_events(std::string_view scene_name, const jostle::WorldOptions& options)
{
    Hash hash;
    jostle::World3f world(options);
    jostle_scenes::Scene<3, float> scene(scene_name, 300);
    play(world, scene, [&] {
        hash.add(world.began().size(), world.ended().size(), world.persisted().size());
        for (const jostle::ObjectPair& pair : world.began())
            hash.add(pair.a.index, pair.a.generation, pair.b.index, pair.b.generation);
        for (const jostle::EndedPair& pair : world.ended())
            hash.add(pair.a.index, pair.b.index, pair.reason);
        for (const jostle::Pair& pair : world.persisted())
            hash.add(pair.a, pair.b);
    });
    for (const std::byte byte : world.save())
        hash.add(byte);
    return hash.value();
}

inline void add_events(Table& table, std::string_view scene, const jostle::WorldOptions& options)
{
    table.emplace_back("events_" + std::string(scene), hash_of_events(scene, options));
}

} // namespace platforms_test
