// SPDX-License-Identifier: MIT
// Scenes that no division of space suits.
#include <set>

#include "rebalancing.hpp"
#include "scene.hpp"

namespace mpi_tests {
namespace {

using jostle::Aabb3f;
using jostle::mpi::Rebalance;

const jostle::mpi::WorldOptions serial{.executor = &jostle::serial_executor()};

Aabb3f cube(float x, float y, float z, float edge = 1)
{
    return {{x, y, z}, {x + edge, y + edge, z + edge}};
}
Aabb3f random_cube(Random& random, double extent)
{
    const auto at = [&] { return static_cast<float>(random.uniform(0, extent)); };
    const float x = at(), y = at();
    return cube(x, y, at());
}

TEST(Hostile, NothingAtAll)
{
    Scene<3, float> scene(1, 5, serial);
    for (int k = 0; k < 3; ++k)
        ASSERT_TRUE(scene.update());
    EXPECT_EQ(scene.world->stats().partitions, 0u);
    scene.add(cube(0, 0, 0), ranks() - 1);
    scene.add(cube(1, 0, 0), 0);
    ASSERT_TRUE(scene.update());
    EXPECT_EQ(scene.began, 1u);
    while (!scene.things.empty())
        scene.remove(scene.things.begin()->first);
    ASSERT_TRUE(scene.update());
    ASSERT_TRUE(scene.update());
    EXPECT_EQ(sum(scene.world->stats().members), 0u);
}

TEST(Hostile, AllBeginOnOneRank)
{
    Scene<3, float> scene(2, 12, serial);
    for (int i = 0; i < 400; ++i)
        scene.add(random_cube(scene.random, 12), ranks() / 2);
    for (int k = 0; k < 4; ++k) {
        ASSERT_TRUE(scene.update());
        for (const auto& [id, thing] : std::map(scene.things))
            scene.move(id, random_cube(scene.random, 12));
    }
    EXPECT_EQ(scene.migrated == 0, ranks() == 1);
}

TEST(Hostile, AllStayOnOneRank)
{
    auto options = serial;
    options.migrate = false;
    Scene<3, float> scene(9, 12, options);
    for (int i = 0; i < 300; ++i)
        scene.add(random_cube(scene.random, 12), ranks() - 1);
    for (int k = 0; k < 4; ++k) {
        ASSERT_TRUE(scene.update());
        EXPECT_EQ(scene.world->size(), rank() == ranks() - 1 ? 300u : 0u);
        for (const auto& [id, thing] : std::map(scene.things))
            scene.move(id, random_cube(scene.random, 12));
    }
    EXPECT_GT(scene.persisted, 0u);
}

TEST(Hostile, EverythingCrossesTheScene)
{
    auto options = serial;
    options.rebalance = Rebalance::on_request; // nobody helps
    Scene<3, float> scene(3, 20, options);
    for (int i = 0; i < 500; ++i)
        scene.add(cube(static_cast<float>(i % 20), static_cast<float>(i / 20 % 5),
                       static_cast<float>(i / 100), 1.1f));
    ASSERT_TRUE(scene.update());
    for (int k = 0; k < 4; ++k) { // mirrored, then back: all pairs persist
        const std::uint64_t began = scene.began;
        for (const auto& [id, thing] : std::map(scene.things)) {
            Aabb3f box = thing.box;
            box.lo[0] = 20 - thing.box.hi[0];
            box.hi[0] = 20 - thing.box.lo[0];
            scene.move(id, box);
        }
        ASSERT_TRUE(scene.update());
        EXPECT_LT(scene.began - began, 300u);
    }
    EXPECT_GT(scene.persisted, 4000u);
}

TEST(Hostile, OneRankGrowsTenfold)
{
    Scene<3, float> scene(4, 10, serial);
    for (int i = 0; i < 100; ++i)
        scene.add(random_cube(scene.random, 10));
    ASSERT_TRUE(scene.update());
    for (int k = 0; k < 5; ++k) {
        for (int i = 0; i < 200; ++i)
            scene.add(cube(static_cast<float>(scene.random.uniform(0, 2)), 0, static_cast<float>(i) / 40),
                      ranks() - 1);
        if (k == 3) scene.world->request_rebalance();
        ASSERT_TRUE(scene.update());
        if (k == 3 && ranks() > 1) { // divided by what objects cost
            EXPECT_LT(scene.world->stats().objects, 800u);
        }
    }
}

TEST(Hostile, GiantsAmongThousands)
{
    constexpr float infinity = std::numeric_limits<float>::infinity();
    Scene<3, float> scene(5, 40, serial);
    std::vector<std::uint64_t> giants;
    for (int i = 0; i < 600; ++i) {
        if (i % 100 == 50) giants.push_back(scene.add({{-5000, -5000, -5000}, {5000, 5000, 5000}}));
        scene.add(random_cube(scene.random, 40));
    }
    giants.push_back(scene.add({{-infinity, -1, -infinity}, {infinity, 0.5f, infinity}}));
    ASSERT_TRUE(scene.update());
    EXPECT_GT(scene.began, 3600u);
    // At rest they cost nothing.
    ASSERT_TRUE(scene.update());
    ASSERT_TRUE(scene.update());
    EXPECT_EQ(scene.world->stats().bytes, 0u);
    EXPECT_EQ(scene.world->stats().persisted, 0u);
    for (int k = 0; k < 3; ++k) {
        for (const std::uint64_t giant : giants) {
            Aabb3f box = scene.things.at(giant).box;
            box.lo[1] += 1;
            box.hi[1] += 1;
            scene.move(giant, k == 1 ? cube(static_cast<float>(k), 3, 3) : box);
        }
        ASSERT_TRUE(scene.update());
    }
}

TEST(Hostile, RestingPairsStayInNoListWhenSpaceIsDividedAnew)
{
    auto options = serial;
    options.rebalance = Rebalance::on_request;
    Scene<3, float> scene(6, 12, options);
    for (int i = 0; i < 500; ++i)
        scene.add(random_cube(scene.random, 12));
    ASSERT_TRUE(scene.update());
    const std::uint64_t migrated = scene.migrated;
    for (int k = 0; k < 4; ++k) {
        for (int i = 0; i < 20; ++i) // draws the cuts elsewhere
            scene.add(cube(static_cast<float>(100 * k + 3 * i), 50, 50));
        scene.world->request_rebalance();
        ASSERT_TRUE(scene.update());
        EXPECT_EQ(sum(scene.world->changed_pairs().size()), 0u);
    }
    EXPECT_EQ(scene.migrated > migrated, ranks() > 1);
    EXPECT_EQ(scene.world->stats().partitions, 5u);
}

TEST(Hostile, WhatHasLeftItsRegionMigratesAtOnce)
{
    auto options = serial;
    options.rebalance = Rebalance::on_request;
    Scene<3, float> scene(7, 12, options);
    for (int i = 0; i < 200; ++i)
        scene.add(random_cube(scene.random, 12));
    const std::uint64_t wanderer = scene.add(cube(0, 0, 0));
    ASSERT_TRUE(scene.update());
    std::set<int> owners;
    for (float at = 0; at < 12; at += 0.5f) {
        scene.move(wanderer, cube(at, at, at));
        ASSERT_TRUE(scene.update());
        owners.insert(scene.owner(wanderer));
    }
    EXPECT_EQ(owners.size() > 1, ranks() > 1);
    EXPECT_EQ(scene.world->stats().partitions, 1u);
}

/// How many updates go by before space is repartitioned, where rank 0 works `slowest` us in each, the others
/// 1, and dividing takes `price`; each rank then has one ghost more in each update, of 1000 objects.
int updates_until_division(double slowest, double price, bool drift, bool automatic = true)
{
    jostle::mpi::Rebalancing rebalancing;
    const double work = rank() == 0 ? slowest : 1;
    std::uint64_t ghosts = 5;
    const auto divides = [&](bool undivided) {
        jostle::mpi::Agreement agreement(MPI_COMM_WORLD);
        return rebalancing.agree(agreement, undivided, 1000, ghosts);
    };
    EXPECT_TRUE(divides(true));
    rebalancing.learn(automatic, price, true);
    for (int updates = 0; updates < 100; ++updates, ghosts += drift) {
        if (divides(false)) return updates;
        rebalancing.learn(automatic, work, false);
    }
    return -1;
}
TEST(Hostile, SpaceIsDividedAnewOnceThatPays)
{
    EXPECT_EQ(updates_until_division(1, 10, false), -1); // as even as can be
    EXPECT_EQ(updates_until_division(1, 0.5, true), 32); // 1 + 2 + ... + 32 thousandths
    EXPECT_EQ(updates_until_division(1, 0.5, true, false), -1);
    if (ranks() == 1) return;
    const double waste = 8 - (8.0 + ranks() - 1) / ranks();
    EXPECT_EQ(updates_until_division(8, 10.5 * waste, false), 11);
    EXPECT_EQ(updates_until_division(8, 10.5 * waste, false, false), -1);
    jostle::mpi::Rebalancing asked;
    asked.learn(false, 1, true);
    if (rank() == ranks() - 1) asked.request();
    jostle::mpi::Agreement agreement(MPI_COMM_WORLD);
    EXPECT_TRUE(asked.agree(agreement, false, 1, 0));
    EXPECT_FALSE(asked.agree(agreement, true, 0, 0)) << "there are no objects";
}

} // namespace
} // namespace mpi_tests
