// SPDX-License-Identifier: MIT
// Boids: each bird flies as its neighbours do. Its box is how far it sees, so its pairs are its neighbours.
// Usage: boids [BIRDS]
#include <jostle/jostle.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

int main(int argc, char** argv)
{
    const std::size_t count = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 2000;
    const float side = std::sqrt(static_cast<float>(count)) * 2, sight = 4;
    struct Bird
    {
        float at[2], speed[2], sum[2];
    };
    std::mt19937 random(7);
    const auto uniform = [&] { return static_cast<float>(random()) / 4294967296.0f; };
    std::vector<Bird> birds(count);
    for (Bird& bird : birds)
        bird = {{uniform() * side, uniform() * side}, {uniform() - 0.5f, uniform() - 0.5f}, {}};
    std::vector<jostle::Aabb2f> boxes(count);
    std::vector<jostle::ObjectId> ids(count);
    const auto fly = [&] {
        float order[2] = {};
        for (std::size_t i = 0; i < count; ++i) {
            Bird& bird = birds[i];
            const float length = std::hypot(bird.speed[0] + bird.sum[0], bird.speed[1] + bird.sum[1]);
            for (int d = 0; d < 2; ++d) {
                bird.speed[d] = (bird.speed[d] + bird.sum[d]) / (length + 1e-6f);
                bird.sum[d] = 0;
                bird.at[d] = std::fmod(bird.at[d] + 0.25f * bird.speed[d] + side, side); // round the edges
                order[d] += bird.speed[d];
            }
            boxes[i] = jostle::grown(jostle::Aabb2f{bird.at, bird.at}, sight / 2);
        }
        return std::hypot(order[0], order[1]) / static_cast<float>(count); // 1: all fly the same way
    };
    jostle::World2f world;
    const float before = fly();
    world.add(boxes, ids); // indices 0, 1, 2, ...: those of the birds
    float after = before;
    for (int step = 0; step < 300; ++step) {
        world.update(ids, boxes);
        for (const jostle::Pair pair : world.pairs())
            for (int d = 0; d < 2; ++d) {
                birds[pair.a].sum[d] += 0.1f * birds[pair.b].speed[d];
                birds[pair.b].sum[d] += 0.1f * birds[pair.a].speed[d];
            }
        after = fly();
    }
    std::printf("%zu birds: order %.2f before, %.2f after 300 steps\n", count, before, after);
    return after > 2 * before ? 0 : 1;
}
