// SPDX-License-Identifier: MIT
// Boxes that lie in a program's own structs are read in place: nothing is copied or converted.
#include <jostle/jostle.hpp>

#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

struct Vec3
{
    double x, y, z;
};

struct Body
{
    std::string name;
    Vec3 min, max; // three coordinates one after another, as `strided` asks for
    std::uint32_t layer, collides_with;
};

int main()
{
    const std::vector<Body> bodies = {{"floor", {-9, -9, -1}, {9, 9, 0}, 1, 2},
                                      {"crate", {0, 0, 0}, {1, 1, 1}, 2, 3},
                                      {"lamp", {5, 5, 4}, {6, 6, 5}, 2, 3},
                                      {"barrel", {1, 0, 0}, {2, 1, 1}, 2, 3}};
    const auto boxes =
        jostle::BoxView<3, double>::strided(&bodies[0].min.x, &bodies[0].max.x, bodies.size(), sizeof(Body));
    jostle::Filter filter;
    filter.category = {std::span(bodies), &Body::layer};
    filter.mask = {std::span(bodies), &Body::collides_with};

    jostle::PairFinder finder; // kept from frame to frame, so that a steady scene allocates nothing
    const auto& pairs = finder.find(boxes, filter, jostle::Order::sorted);
    for (jostle::Pair pair : pairs)
        std::printf("%s touches %s\n", bodies[pair.a].name.c_str(), bodies[pair.b].name.c_str());
    const std::vector<jostle::Pair> expected = {{0, 1}, {0, 3}, {1, 3}};
    return pairs.to_vector() == expected ? 0 : 1;
}
