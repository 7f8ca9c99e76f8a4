// SPDX-License-Identifier: MIT
// A game loop: crates fall to the floor one after the other; a trigger reports those in the doorway.
#include <jostle/jostle.hpp>

#include <cstdio>
#include <vector>

int main()
{
    jostle::World3f world;
    jostle::ObjectOptionsf fixed;
    fixed.filter.is_static = true;
    const jostle::ObjectId floor = world.add({{-50, -1, -50}, {50, 0, 50}}, fixed);
    const jostle::ObjectId door = world.add({{8, 0, -1}, {10, 3, 1}}, fixed); // pairs are all it needs

    struct Crate
    {
        jostle::ObjectId id;
        float x, y, falling = 0, sliding = 0;
    };
    const auto box_of = [](const Crate& crate) -> jostle::Aabb3f {
        return {{crate.x, crate.y, -0.5f}, {crate.x + 1, crate.y + 1, 0.5f}};
    };
    std::vector<Crate> crates;
    for (int k = 0; k < 5; ++k) {
        Crate crate{{}, 1.5f * static_cast<float>(k), 2 + static_cast<float>(k)};
        crate.id = world.add(box_of(crate));
        crates.push_back(crate);
    }

    int landed = 0, entered = 0, left = 0;
    for (int frame = 0; frame < 240; ++frame) {
        for (Crate& crate : crates)
            if (crate.falling != 0 || crate.sliding != 0 || crate.y > 1) {
                crate.falling += crate.sliding == 0 ? 0.01f : 0;
                crate.y -= crate.falling;
                crate.x += crate.sliding;
                world.move(crate.id, box_of(crate)); // those at rest cost nothing
            }
        world.update();
        for (const jostle::ObjectPair& pair : world.began()) {
            if (pair.a == floor)
                for (Crate& crate : crates)
                    if (crate.id == pair.b) {
                        std::printf("frame %d: crate %u lands\n", frame, crate.id.index);
                        crate.falling = 0;
                        crate.sliding = 0.1f; // and slides towards the door
                        ++landed;
                    }
            entered += pair.a == door;
        }
        for (const jostle::EndedPair& pair : world.ended())
            left += pair.a == door && pair.reason == jostle::EndReason::moved_apart;
    }
    std::printf("%d landed, %d went through the door, %d came out\n%s", landed, entered, left,
                world.explain().c_str());
    return landed == 5 && entered == 5 && left >= 4 ? 0 : 1;
}
