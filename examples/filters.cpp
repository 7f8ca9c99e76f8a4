// SPDX-License-Identifier: MIT
// A robot with three parts in a factory: which pairs are worth a closer look?
#include <jostle/jostle.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

int main()
{
    enum Category : std::uint32_t
    {
        robot = 1,
        person = 2,
        wall = 4
    };
    // Everything here touches everything else: only the filters tell pairs apart.
    const std::vector<jostle::Aabb2d> boxes(6, {{0, 0}, {1, 1}});
    const std::vector<std::uint32_t> category = {robot, robot, robot, person, wall, wall};
    // Which kinds each may meet: walls don't meet walls.
    const std::uint32_t all = robot | person | wall, movers = robot | person;
    const std::vector<std::uint32_t> mask = {all, all, all, all, movers, movers};
    // The robot's parts belong together; the others have no owner.
    const std::uint32_t nobody = jostle::Filter::no_owner;
    const std::vector<std::uint32_t> owner = {7, 7, 7, nobody, nobody, nobody};

    jostle::Filter filter;
    filter.category = std::span(category);
    filter.mask = std::span(mask);
    filter.owner = std::span(owner);
    // The robot's foot, part 0, stands bolted to wall 4. This is called from several threads at a time.
    const auto accept = [](std::uint32_t a, std::uint32_t b) { return !(a == 0 && b == 4); };
    filter.accept = accept;

    const auto pairs = jostle::find_pairs(boxes, filter, jostle::Order::sorted).to_vector();
    for (jostle::Pair pair : pairs)
        std::printf("%u touches %u\n", pair.a, pair.b);
    const std::vector<jostle::Pair> expected = {{0, 3}, {0, 5}, {1, 3}, {1, 4}, {1, 5},
                                                {2, 3}, {2, 4}, {2, 5}, {3, 4}, {3, 5}};
    return pairs == expected ? 0 : 1;
}
