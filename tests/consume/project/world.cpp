// SPDX-License-Identifier: MIT
// Linked with jostle::world alone.
#include <jostle/box_index.hpp>
#include <jostle/spatial_order.hpp>
#include <jostle/world.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

int main()
{
    jostle::World<3, float> world;
    const jostle::ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}});
    world.add({{2, 0, 0}, {3, 1, 1}});
    world.update();
    world.move(a, {{1.5f, 0, 0}, {2.5f, 1, 1}});
    world.update();
    const jostle::Ray<3, float> ray{{-5, 0.5f, 0.5f}, {10, 0, 0}};
    const auto hit = world.first(ray);
    if (world.began().size() != 1 || !hit || hit->id != a) {
        std::fprintf(stderr, "%zu pairs began; 1 expected\n", static_cast<std::size_t>(world.began().size()));
        return 1;
    }
    const std::vector<jostle::Aabb3f> boxes = {{{9, 0, 0}, {9, 1, 1}}, {{0, 0, 0}, {1, 1, 1}}};
    std::vector<std::uint32_t> order(boxes.size());
    jostle::spatial_order(boxes, order);
    return order[0] + order[1] == 1 ? 0 : 1;
}
