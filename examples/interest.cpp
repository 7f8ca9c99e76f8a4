// SPDX-License-Identifier: MIT
// Interest management for a server: which entities enter and leave each observer's view.
// Usage: interest [ENTITIES] [OBSERVERS]
#include <jostle/jostle.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

int main(int argc, char** argv)
{
    const std::size_t entities = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 200'000;
    const std::size_t observers = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 64;
    const auto side = static_cast<float>(10 * std::sqrt(static_cast<double>(entities)));
    std::mt19937 random(1);
    const auto place = [&] { return static_cast<float>(random()) / 4294967296.0f * side; };
    constexpr std::uint32_t entity = 1, observer = 2;
    jostle::World2f world;
    // Entities are points that meet observers; observers are views, far bigger, that don't meet each other.
    jostle::ObjectOptionsf as_entity, as_observer;
    as_entity.filter = {.category = entity, .mask = observer};
    as_observer.filter = {.category = observer, .mask = entity};
    std::vector<jostle::Aabb2f> points(entities), views(observers);
    for (jostle::Aabb2f& box : points)
        box.lo[0] = box.hi[0] = place(), box.lo[1] = box.hi[1] = place();
    for (jostle::Aabb2f& box : views)
        for (int d = 0; d < 2; ++d)
            box.lo[d] = place(), box.hi[d] = box.lo[d] + 500;
    std::vector<jostle::ObjectId> ids(entities), view_ids(observers);
    world.add(points, ids, as_entity);
    world.add(views, view_ids, as_observer);
    world.update();
    std::size_t known = world.began().size();
    std::printf("%zu entities, %zu observers: %zu to be told of at first\n", entities, observers, known);

    double worst = 0;
    for (int tick = 0; tick < 50; ++tick) {
        for (std::size_t i = 0; i < entities; i += 50) // one in fifty takes a step
            for (int d = 0; d < 2; ++d)
                points[i].lo[d] = points[i].hi[d] = points[i].lo[d] + static_cast<float>(random() % 5) - 2;
        for (jostle::Aabb2f& box : views)
            for (int d = 0; d < 2; ++d)
                box.lo[d] += 3, box.hi[d] += 3;
        const auto before = std::chrono::steady_clock::now();
        for (std::size_t i = 0; i < entities; i += 50)
            world.move(ids[i], points[i]);
        world.move(view_ids, views);
        world.update();
        const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - before;
        worst = took.count() > worst ? took.count() : worst;
        known += world.began().size(); // "you see": tell the observer
        known -= world.ended().size(); // "gone"
    }
    std::printf("50 ticks, the worst took %.3f ms; %zu known in the end\n", worst, known);
    return known == world.pairs().size() ? 0 : 1;
}
