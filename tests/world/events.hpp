// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "jostle/world.hpp"

namespace world_tests {

inline jostle::Aabb3f cube(float at, float edge = 1)
{
    return {{at, 0, 0}, {at + edge, edge, edge}};
}
inline jostle::Aabb3f cube_at(float x, float y)
{
    return {{x, y, 0}, {x + 1, y + 1, 1}};
}
using Began = std::vector<jostle::ObjectPair>;
using Ended = std::vector<jostle::EndedPair>;
inline Began began(const jostle::World3f& world)
{
    return {world.began().begin(), world.began().end()};
}
inline Ended ended(const jostle::World3f& world)
{
    return {world.ended().begin(), world.ended().end()};
}

} // namespace world_tests
