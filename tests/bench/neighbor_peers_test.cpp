// SPDX-License-Identifier: MIT
#include "bench/neighbor_peers.hpp"

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/neighbors.hpp"
#include "tool/scenes/random.hpp"

namespace {

/// On a lattice many lie exactly at the cutoff.
TEST(NeighborPeers, FindAsManyAsJostle)
{
    const auto peer = jostle_bench::make_nanoflann();
    jostle::NeighborFinder<3, float> finder;
    jostle_scenes::Random random(1);
    for (const bool lattice : {false, true})
        for (const float cutoff : {0.9f, 1.0f, 2.0f}) {
            std::vector<jostle::Vec3f> points;
            for (int i = 0; i < 1000; ++i) {
                jostle::Vec3f point{static_cast<float>(i % 10), static_cast<float>(i / 10 % 10),
                                    static_cast<float>(i / 100)};
                for (float& x : point)
                    if (!lattice) x += static_cast<float>(random.uniform());
                points.push_back(point);
            }
            const std::size_t ours = finder.find(points, cutoff).neighbors.size();
            EXPECT_EQ(peer->find(points, cutoff), ours) << cutoff;
            EXPECT_EQ(ours == 0, lattice && cutoff < 1);
        }
}

} // namespace
