// SPDX-License-Identifier: MIT
// Whole simulations by Bullet: the same bits with the adapter as with its slow twin, on any number of
// threads.
#include "extras/bullet/scenes.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolverMt.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "brute_force.hpp"
#include "jostle/bullet.hpp"

namespace {

using jostle_bullet::BruteForce;
using jostle_bullet::Scene;

struct State
{
    std::uint64_t bits;
    std::vector<std::pair<int, int>> pairs; ///< in the cache's order
    friend bool operator==(const State&, const State&) = default;
};

State state(Scene& scene)
{
    State now{scene.bits(), {}};
    const btBroadphasePairArray& pairs =
        scene.broadphase().getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
        now.pairs.emplace_back(pairs[i].m_pProxy0->m_uniqueId, pairs[i].m_pProxy1->m_uniqueId);
    return now;
}

std::vector<State> run(btBroadphaseInterface& broadphase, const jostle_bullet::NamedScene& named, double size,
                       int steps)
{
    Scene scene(broadphase);
    named.make(scene, size);
    std::vector<State> states;
    for (int i = 0; i < steps; ++i) {
        scene.step();
        states.push_back(state(scene));
    }
    return states;
}

void expect_same(const std::vector<State>& a, const std::vector<State>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_EQ(a[i].pairs, b[i].pairs) << "step " << i;
        ASSERT_EQ(a[i].bits, b[i].bits) << "step " << i;
    }
}

class EveryScene : public testing::TestWithParam<jostle_bullet::NamedScene>
{
};

TEST_P(EveryScene, SameBitsAsBruteForceAfterEveryStep)
{
    const double size = std::string(GetParam().name) == "statics" ? 0.005 : 0.03;
    BruteForce twin;
    const auto expected = run(twin, GetParam(), size, 120);
    jostle::bullet::Broadphase ours;
    expect_same(run(ours, GetParam(), size, 120), expected);
    EXPECT_TRUE(
        std::any_of(expected.begin(), expected.end(), [](const State& at) { return !at.pairs.empty(); }));
}

TEST_P(EveryScene, SameBitsOnAnyNumberOfThreads)
{
    jostle::bullet::Broadphase serial({.executor = &jostle::serial_executor()});
    const auto expected = run(serial, GetParam(), 0.1, 25);
    for (const std::uint32_t threads : {2u, 7u}) {
        jostle::bullet::Broadphase ours({.executor = &jostle::default_executor(threads)});
        expect_same(run(ours, GetParam(), 0.1, 25), expected);
    }
}

INSTANTIATE_TEST_SUITE_P(Bullet, EveryScene, testing::ValuesIn(jostle_bullet::scenes),
                         [](const auto& chosen) { return chosen.param.name; });

TEST(Scenes, SecondRunAfterResetPoolIsTheSame)
{
    jostle::bullet::Broadphase ours;
    const auto& churn = *std::find_if(std::begin(jostle_bullet::scenes), std::end(jostle_bullet::scenes),
                                      [](const auto& scene) { return std::string(scene.name) == "churn"; });
    const auto first = run(ours, churn, 0.05, 60);
    ours.resetPool(nullptr);
    expect_same(run(ours, churn, 0.05, 60), first);
}

// Bullet's own tree has bounds of another history, so its pairs are other ones where bodies move. Where they
// stay, questions find the same.
TEST(Scenes, QuestionsFindWhatBulletsTreeFinds)
{
    const auto ask = [](btBroadphaseInterface& broadphase) {
        Scene scene(broadphase, 5);
        jostle_bullet::mixed(scene, 400, 30);
        std::vector<float> hits;
        for (int i = 0; i < 500; ++i) {
            const btTransform from = scene.anywhere(15, 0, 30), to = scene.anywhere(15, -2, 20);
            btCollisionWorld::ClosestRayResultCallback ray(from.getOrigin(), to.getOrigin());
            scene.world().rayTest(from.getOrigin(), to.getOrigin(), ray);
            hits.push_back(static_cast<float>(ray.m_closestHitFraction));
            btSphereShape ball(btScalar(0.4));
            btCollisionWorld::ClosestConvexResultCallback sweep(from.getOrigin(), to.getOrigin());
            scene.world().convexSweepTest(&ball, from, to, sweep);
            hits.push_back(static_cast<float>(sweep.m_closestHitFraction));
        }
        return hits;
    };
    btDbvtBroadphase tree;
    const auto expected = ask(tree);
    jostle::bullet::Broadphase ours;
    EXPECT_EQ(ask(ours), expected);
    EXPECT_GT(std::count_if(expected.begin(), expected.end(), [](float at) { return at < 1; }), 300);
}

// Bullet's form for several threads: its dispatcher and its solvers work on islands at the same time where
// Bullet was built for it (BT_THREADSAFE), and one after another in Debian's packages.
TEST(Scenes, WorldMtRuns)
{
    const auto simulate = [](btBroadphaseInterface& broadphase) {
        btDefaultCollisionConfiguration configuration;
        btCollisionDispatcherMt dispatcher(&configuration);
        btConstraintSolverPoolMt pool(2);
        btSequentialImpulseConstraintSolverMt solver;
        btDiscreteDynamicsWorldMt world(&dispatcher, &broadphase, &pool, &solver, &configuration);
        btBoxShape ground(btVector3(50, 1, 50)), box(btVector3(1, 1, 1));
        std::vector<std::unique_ptr<btRigidBody>> bodies;
        const auto add = [&](btCollisionShape& shape, btScalar mass, const btTransform& place) {
            btVector3 inertia(0, 0, 0);
            if (mass > 0) shape.calculateLocalInertia(mass, inertia);
            btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
            info.m_startWorldTransform = place;
            bodies.push_back(std::make_unique<btRigidBody>(info));
            bodies.back()->setCcdMotionThreshold(btScalar(0.1)); // sweeps along what it moves
            bodies.back()->setCcdSweptSphereRadius(btScalar(0.5));
            world.addRigidBody(bodies.back().get());
        };
        add(ground, 0, jostle_bullet::at(0, -1, 0));
        for (int i = 0; i < 60; ++i)
            add(box, 1,
                jostle_bullet::at(btScalar(i % 4) * btScalar(1.9), 2 + btScalar(i / 4) * btScalar(2.1),
                                  btScalar(i % 3)));
        for (int i = 0; i < 120; ++i)
            world.stepSimulation(btScalar(1. / 60), 0, btScalar(1. / 60));
        std::vector<btScalar> places;
        for (const auto& body : bodies)
            for (int d = 0; d < 3; ++d)
                places.push_back(body->getWorldTransform().getOrigin()[d]);
        for (const auto& body : bodies)
            world.removeRigidBody(body.get());
        return places;
    };
    btSetTaskScheduler(btGetSequentialTaskScheduler());
    BruteForce twin;
    jostle::bullet::Broadphase ours;
    EXPECT_EQ(simulate(ours), simulate(twin));
}

} // namespace
