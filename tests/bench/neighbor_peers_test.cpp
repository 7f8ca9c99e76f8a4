// SPDX-License-Identifier: MIT
#include "bench/neighbor_peers.hpp"

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/neighbors.hpp"
#include "tool/scenes/random.hpp"

namespace {

/// On a lattice many lie exactly at the cutoff.
TEST(NeighborPeers, FindAsManyAsJostleInOpenSpace)
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
            peer->start(points, cutoff, 0);
            peer->find();
            EXPECT_EQ(peer->found(), ours) << cutoff;
            EXPECT_EQ(ours == 0, lattice && cutoff < 1);
        }
}

/// Twice, since LAMMPS keeps what it had. In double precision no distance is nearly the cutoff here.
TEST(NeighborPeers, FindAsManyAsJostleInPeriodicSpace)
{
    const auto peer = jostle_bench::make_lammps();
    jostle::NeighborFinder<3, float> finder;
    jostle_scenes::Random random(2);
    const jostle::PeriodicCell<3, float> cell{{{10, 0, 0}, {0, 10, 0}, {0, 0, 10}}, {true, true, true}};
    for (const float cutoff : {1.0f, 3.0f}) {
        std::vector<jostle::Vec3f> points(1000);
        for (jostle::Vec3f& point : points)
            for (float& x : point)
                x = static_cast<float>(random.uniform() * 12 - 1);
        const std::size_t ours = finder.find(points, cutoff, cell, {.half = true}).neighbors.size();
        peer->start(points, cutoff, 10);
        peer->find();
        EXPECT_EQ(peer->found(), ours) << cutoff;
        EXPECT_GT(ours, 1000u);
    }
}

} // namespace
