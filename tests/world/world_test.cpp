// SPDX-License-Identifier: MIT
#include "twin.hpp"
namespace world_tests {
TEST(World, Empty)
{
    jostle::World3f world;
    world.update();
    EXPECT_EQ(world.size(), 0u);
}
} // namespace world_tests
