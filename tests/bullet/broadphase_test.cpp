// SPDX-License-Identifier: MIT
// The broad phase alone: what is seen at once, odd input, callbacks that change things, other pair caches.
#include "jostle/bullet.hpp"

#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "brute_force.hpp"
#include "tool/scenes/random.hpp"

namespace {

using jostle::bullet::Broadphase;
using jostle_bullet::BruteForce;
using jostle_scenes::Random;
using Pairs = std::set<std::pair<int, int>>;

constexpr btScalar infinity = std::numeric_limits<btScalar>::infinity();
constexpr btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();

/// All pairs of a cache, by age.
Pairs pairs_of(btOverlappingPairCache& cache)
{
    Pairs pairs;
    const btBroadphasePairArray& array = cache.getOverlappingPairArray();
    for (int i = 0; i < array.size(); ++i) {
        const int a = array[i].m_pProxy0->m_uniqueId, b = array[i].m_pProxy1->m_uniqueId;
        EXPECT_TRUE(pairs.insert({std::min(a, b), std::max(a, b)}).second) << "twice: " << a << ", " << b;
    }
    return pairs;
}
Pairs pairs_of(btBroadphaseInterface& broadphase)
{
    return pairs_of(*broadphase.getOverlappingPairCache());
}

btBroadphaseProxy* add(btBroadphaseInterface& broadphase, const btVector3& center, btScalar half = 1,
                       void* user = nullptr, btDispatcher* dispatcher = nullptr)
{
    const btVector3 extent(half, half, half);
    return broadphase.createProxy(center - extent, center + extent, BOX_SHAPE_PROXYTYPE, user, 1, -1,
                                  dispatcher);
}
void move(btBroadphaseInterface& broadphase, btBroadphaseProxy* proxy, const btVector3& center,
          btScalar half = 1, btDispatcher* dispatcher = nullptr)
{
    const btVector3 extent(half, half, half);
    broadphase.setAabb(proxy, center - extent, center + extent, dispatcher);
}

struct Collect final : btBroadphaseRayCallback
{
    std::vector<int> ids;
    std::function<void(const btBroadphaseProxy*)> also;
    bool result = false;
    Collect(const btVector3& from = btVector3(0, 0, 0), const btVector3& to = btVector3(1, 0, 0))
    {
        btVector3 direction = to - from;
        m_lambda_max = direction.length();
        if (m_lambda_max > 0) direction /= m_lambda_max;
        for (int d = 0; d < 3; ++d) {
            m_rayDirectionInverse[d] = direction[d] == 0 ? btScalar(BT_LARGE_FLOAT) : 1 / direction[d];
            m_signs[d] = m_rayDirectionInverse[d] < 0;
        }
    }
    bool process(const btBroadphaseProxy* proxy) override
    {
        ids.push_back(proxy->m_uniqueId);
        if (also) also(proxy);
        return result;
    }
};
std::vector<int> in_box(btBroadphaseInterface& broadphase, const btVector3& center, btScalar half)
{
    Collect found;
    const btVector3 extent(half, half, half);
    broadphase.aabbTest(center - extent, center + extent, found);
    return found.ids;
}
std::vector<int> on_ray(btBroadphaseInterface& broadphase, const btVector3& from, const btVector3& to,
                        btScalar half = 0)
{
    Collect found(from, to);
    const btVector3 extent(half, half, half);
    broadphase.rayTest(from, to, found, -extent, extent);
    return found.ids;
}

TEST(AtOnce, QuestionsAndPairsKnowWhatWasCreatedMovedAndDestroyed)
{
    Broadphase broadphase;
    btBroadphaseProxy* const a = add(broadphase, btVector3(0, 0, 0));
    btBroadphaseProxy* const b = add(broadphase, btVector3(1, 0, 0));
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 9), (std::vector{1, 2}));
    EXPECT_EQ(on_ray(broadphase, btVector3(-9, 0, 0), btVector3(9, 0, 0)), (std::vector{1, 2}));
    EXPECT_EQ(on_ray(broadphase, btVector3(9, 0, 0), btVector3(-9, 0, 0)), (std::vector{2, 1}));
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 2}}));

    move(broadphase, b, btVector3(50, 0, 0));
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 9), (std::vector{1}));
    EXPECT_EQ(in_box(broadphase, btVector3(50, 0, 0), 9), (std::vector{2}));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), Pairs{});
    move(broadphase, b, btVector3(1, 0, 0));
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 2}}));

    btOverlappingPairCache* const cache = broadphase.getOverlappingPairCache();
    broadphase.destroyProxy(a, nullptr);
    EXPECT_EQ(cache->getNumOverlappingPairs(), 0);
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 9), (std::vector{2}));
    add(broadphase, btVector3(0, 0, 0)); // in the same memory, and later with the same index
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 9), (std::vector{2, 3}));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{2, 3}}));
    broadphase.destroyProxy(b, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), Pairs{});
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 9), (std::vector{3}));
}

TEST(AtOnce, GhostsKnowTheirPairsWithoutAStep)
{
    Broadphase broadphase;
    btGhostPairCallback callback;
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btPairCachingGhostObject ghost;
    btCollisionObject near, far, late, last;
    btBroadphaseProxy* const n = add(broadphase, btVector3(0, 0, 0), 1, &near, &dispatcher);
    btBroadphaseProxy* const f = add(broadphase, btVector3(20, 0, 0), 1, &far, &dispatcher);
    ghost.setBroadphaseHandle(add(broadphase, btVector3(1, 0, 0), 1, &ghost, &dispatcher));
    near.setBroadphaseHandle(n);
    far.setBroadphaseHandle(f);
    ASSERT_EQ(ghost.getNumOverlappingObjects(), 1);
    EXPECT_EQ(ghost.getOverlappingObject(0), &near);

    move(broadphase, ghost.getBroadphaseHandle(), btVector3(19, 0, 0), 1, &dispatcher);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 2); // it leaves with the next step, as with Bullet's own
    move(broadphase, ghost.getBroadphaseHandle(), btVector3(40, 0, 0), 1, &dispatcher);
    broadphase.calculateOverlappingPairs(&dispatcher);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 0);
    EXPECT_EQ(pairs_of(broadphase), Pairs{});
    EXPECT_EQ(ghost.getOverlappingPairCache()->getNumOverlappingPairs(), 0);

    // Others that come to the ghost.
    move(broadphase, n, btVector3(41, 0, 0), 1, &dispatcher);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 1);
    late.setBroadphaseHandle(add(broadphase, btVector3(39, 0, 0), 1, &late, &dispatcher));
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 2);
    broadphase.calculateOverlappingPairs(&dispatcher);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 2);
    broadphase.destroyProxy(n, &dispatcher);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 1);
    broadphase.destroyProxy(ghost.getBroadphaseHandle(), &dispatcher);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 0);
    ghost.setBroadphaseHandle(nullptr);
    add(broadphase, btVector3(40, 0, 0), 1, &last, &dispatcher);
    broadphase.calculateOverlappingPairs(&dispatcher);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 0);
}

TEST(AtOnce, WhatIsNoCollisionObjectIsLeftAlone)
{
    Broadphase broadphase({.collision_objects = false});
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    add(broadphase, btVector3(0, 0, 0), 1, reinterpret_cast<void*>(std::uintptr_t{0x123}), &dispatcher);
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 1), (std::vector{1}));
}

TEST(PairsAgain, AfterAMaskChangesAndAfterTheyWereTakenOut)
{
    Broadphase broadphase;
    btBroadphaseProxy* const a = add(broadphase, btVector3(0, 0, 0));
    btBroadphaseProxy* const b = add(broadphase, btVector3(1, 0, 0));
    a->m_collisionFilterMask = 0;
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), Pairs{});
    a->m_collisionFilterMask = -1;
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), Pairs{}); // nothing moved
    move(broadphase, b, btVector3(btScalar(1.1), 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 2}}));

    broadphase.getOverlappingPairCache()->removeOverlappingPair(a, b, nullptr);
    for (int i = 0; i < 3; ++i)
        broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), Pairs{});
    move(broadphase, a, btVector3(btScalar(0.1), 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 2}}));
}

TEST(PairsAgain, AfterSoManyQuestionsThatTheseToldTheWorldOfWhatMoved)
{
    Broadphase broadphase;
    btBroadphaseProxy* const a = add(broadphase, btVector3(0, 0, 0));
    btBroadphaseProxy* const b = add(broadphase, btVector3(1, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    btOverlappingPairCache* const cache = broadphase.getOverlappingPairCache();
    for (const bool by_box : {true, false}) {
        cache->removeOverlappingPair(a, b, nullptr);
        move(broadphase, a, btVector3(btScalar(by_box ? 0.3 : 0.6), 0, 0));
        for (int i = 0; i < 20'000; ++i) {
            const btVector3 from(50, 0, 0), to(60, 0, 0);
            EXPECT_TRUE((by_box ? in_box(broadphase, from, 1) : on_ray(broadphase, from, to)).empty());
        }
        broadphase.calculateOverlappingPairs(nullptr);
        EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 2}}));
    }
}

struct Refuse final : btOverlapFilterCallback
{
    int refused = 0;
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        return a->m_uniqueId != refused && b->m_uniqueId != refused;
    }
};

TEST(PairsAgain, AreOfferedToTheFilterOfThePairCacheWhichOverrulesMasks)
{
    Broadphase broadphase;
    Refuse filter;
    filter.refused = 2;
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    btBroadphaseProxy* const a = add(broadphase, btVector3(0, 0, 0));
    a->m_collisionFilterMask = 0;
    add(broadphase, btVector3(1, 0, 0));
    add(broadphase, btVector3(0, 1, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 3}}));
    filter.refused = 0;
    move(broadphase, a, btVector3(btScalar(0.2), 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 2}, {1, 3}}));
}

TEST(Slack, BoundsStayWhileTheBoxIsInsideAndNearlyAsBig)
{
    Broadphase broadphase({.slack = btScalar(0.5)});
    btBroadphaseProxy* const a = add(broadphase, btVector3(0, 0, 0));
    const auto low = [&] { return Broadphase::bounds(a).lo[0]; };
    EXPECT_EQ(low(), -1); // as it was created
    move(broadphase, a, btVector3(btScalar(0.25), 0, 0));
    EXPECT_EQ(low(), btScalar(-1.25)); // its box, with the slack
    move(broadphase, a, btVector3(btScalar(0.5), 0, 0));
    EXPECT_EQ(low(), btScalar(-1.25)); // inside
    move(broadphase, a, btVector3(btScalar(0.5), 0, 0), btScalar(0.25));
    EXPECT_EQ(low(), btScalar(-1.25)); // smaller by 1.5 = 3 slacks
    btVector3 lo, hi;
    broadphase.getAabb(a, lo, hi);
    EXPECT_EQ(lo[0], btScalar(0.25)); // what was set
    move(broadphase, a, btVector3(btScalar(0.9), 0, 0), btScalar(0.1));
    EXPECT_EQ(low(), btScalar(0.9) - btScalar(0.1) - btScalar(0.5)); // smaller by more than four

    Broadphase exact({.slack = 0});
    btBroadphaseProxy* const b = add(exact, btVector3(0, 0, 0));
    move(exact, b, btVector3(0, 0, 0), btScalar(0.5));
    EXPECT_EQ(Broadphase::bounds(b).lo[0], btScalar(-0.5));
}

TEST(OddInput, BoxesThatTouchNothing)
{
    Broadphase broadphase;
    add(broadphase, btVector3(0, 0, 0));
    btBroadphaseProxy* const odd =
        broadphase.createProxy(btVector3(nan, 0, 0), btVector3(1, 1, 1), 0, nullptr, 1, -1, nullptr);
    const btScalar most = std::numeric_limits<btScalar>::max();
    btBroadphaseProxy* const empty = broadphase.createProxy(
        btVector3(most, most, most), btVector3(-most, -most, -most), 0, nullptr, 1, -1, nullptr);
    btBroadphaseProxy* const all = broadphase.createProxy(
        btVector3(-most, -infinity, -most), btVector3(most, infinity, most), 0, nullptr, 1, -1, nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 4}}));
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 5), (std::vector{1, 4}));
    for (int i = 0; i < 3; ++i)
        broadphase.setAabb(odd, btVector3(nan, nan, nan), btVector3(nan, nan, nan), nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    move(broadphase, odd, btVector3(0, 0, 0));
    move(broadphase, empty, btVector3(0, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase).size(), 6u);
    broadphase.setAabb(odd, btVector3(0, 0, 0), btVector3(1, nan, 1), nullptr);
    broadphase.setAabb(empty, btVector3(0, 1, 0), btVector3(1, 0, 1), nullptr);
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 5), (std::vector{1, 4}));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 4}}));
    broadphase.destroyProxy(odd, nullptr);
    broadphase.destroyProxy(all, nullptr);
    broadphase.destroyProxy(empty, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), Pairs{});
}

// Whose memory belonged to one that touched nothing when it went.
TEST(OddInput, WhoTakesTheirMemory)
{
    Broadphase broadphase;
    add(broadphase, btVector3(0, 0, 0));
    btBroadphaseProxy* const odd = add(broadphase, btVector3(1, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    broadphase.setAabb(odd, btVector3(nan, 0, 0), btVector3(1, 1, 1), nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    broadphase.destroyProxy(odd, nullptr);
    btBroadphaseProxy* const next = add(broadphase, btVector3(1, 0, 0));
    ASSERT_EQ(next, odd);
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 3}}));
    broadphase.setAabb(next, btVector3(nan, 0, 0), btVector3(1, 1, 1), nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), Pairs{});
    move(broadphase, next, btVector3(1, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 3}}));
}

TEST(OddInput, Questions)
{
    Broadphase broadphase;
    add(broadphase, btVector3(0, 0, 0));
    for (int step = 0; step < 2; ++step) {
        const btVector3 inside(btScalar(0.5), 0, 0), outside(3, 0, 0);
        EXPECT_EQ(on_ray(broadphase, inside, inside), (std::vector{1})); // of length zero
        EXPECT_EQ(on_ray(broadphase, outside, outside), std::vector<int>{});
        EXPECT_EQ(on_ray(broadphase, outside, outside, 2), (std::vector{1}));
        EXPECT_EQ(on_ray(broadphase, outside, btVector3(nan, 0, 0)), std::vector<int>{});
        EXPECT_EQ(on_ray(broadphase, btVector3(-infinity, 0, 0), outside), std::vector<int>{});
        EXPECT_EQ(on_ray(broadphase, inside, outside, -1), std::vector<int>{});
        EXPECT_EQ(in_box(broadphase, btVector3(nan, 0, 0), 1), std::vector<int>{});
        EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), -1), std::vector<int>{});
        EXPECT_EQ(in_box(broadphase, btVector3(1, 1, 1), 0), (std::vector{1}));
        EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), infinity), (std::vector{1}));
        broadphase.calculateOverlappingPairs(nullptr);
    }
}

TEST(Callbacks, MayAskCreateMoveAndDestroy)
{
    Broadphase broadphase;
    std::map<int, btBroadphaseProxy*> proxies;
    const auto create = [&](const btVector3& center) {
        btBroadphaseProxy* const made = add(broadphase, center);
        proxies[made->m_uniqueId] = made;
    };
    for (int i = 0; i < 40; ++i)
        create(btVector3(btScalar(i), 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    Collect found(btVector3(-5, 0, 0), btVector3(100, 0, 0));
    int nested = 0;
    found.also = [&](const btBroadphaseProxy* proxy) {
        const int id = proxy->m_uniqueId;
        nested += static_cast<int>(on_ray(broadphase, btVector3(-5, 0, 0), btVector3(100, 0, 0)).size());
        if (id % 4 == 1) { // its follower goes, and another takes its memory
            broadphase.destroyProxy(proxies[id + 1], nullptr);
            proxies.erase(id + 1);
            create(btVector3(btScalar(id), 0, 0));
        }
        if (id % 4 == 3) {
            move(broadphase, proxies[id + 1], btVector3(0, 500, 0));
            broadphase.calculateOverlappingPairs(nullptr);
        }
    };
    broadphase.rayTest(btVector3(-5, 0, 0), btVector3(100, 0, 0), found);
    // Those that were there and still are, each once.
    std::vector<int> expected;
    for (int id = 1; id <= 40; ++id)
        if (id % 4 != 2) expected.push_back(id);
    EXPECT_EQ(found.ids, expected);
    EXPECT_GT(nested, 900);
    broadphase.calculateOverlappingPairs(nullptr);
    Pairs brute;
    for (const auto& [a, pa] : proxies)
        for (const auto& [b, pb] : proxies)
            if (a < b && jostle::overlaps(Broadphase::bounds(pa), Broadphase::bounds(pb)))
                brute.insert({a, b});
    EXPECT_EQ(pairs_of(broadphase), brute);
}

TEST(PairCaches, OfTheUserSortedAndNone)
{
    btSortedOverlappingPairCache sorted;
    Broadphase broadphase(&sorted);
    EXPECT_EQ(broadphase.getOverlappingPairCache(), &sorted);
    EXPECT_EQ(std::as_const(broadphase).getOverlappingPairCache(), &sorted);
    BruteForce twin;
    Random random(4);
    std::vector<btBroadphaseProxy*> ours, theirs;
    for (int step = 0; step < 60; ++step) {
        const auto place = [&] {
            return btVector3(btScalar(random.uniform(0, 9)), btScalar(random.uniform(0, 9)), 0);
        };
        for (int i = 0; i < 3; ++i) {
            const btVector3 center = place();
            ours.push_back(add(broadphase, center));
            theirs.push_back(add(twin, center));
            const std::size_t k = random.below(static_cast<std::uint32_t>(ours.size()));
            const btVector3 goal = place();
            move(broadphase, ours[k], goal);
            move(twin, theirs[k], goal);
        }
        if (step % 2 == 1) {
            const std::size_t k = random.below(static_cast<std::uint32_t>(ours.size()));
            broadphase.destroyProxy(ours[k], nullptr);
            twin.destroyProxy(theirs[k], nullptr);
            ours.erase(ours.begin() + static_cast<std::ptrdiff_t>(k));
            theirs.erase(theirs.begin() + static_cast<std::ptrdiff_t>(k));
        }
        broadphase.calculateOverlappingPairs(nullptr);
        twin.calculateOverlappingPairs(nullptr);
        ASSERT_EQ(pairs_of(broadphase), pairs_of(twin)) << step;
    }

    btNullPairCache none;
    Broadphase lonely(&none);
    add(lonely, btVector3(0, 0, 0));
    add(lonely, btVector3(0, 0, 0));
    lonely.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(in_box(lonely, btVector3(0, 0, 0), 1), (std::vector{1, 2}));
}

// Everything at random, hostile boxes among it, beside the twin.
class RandomCalls : public testing::TestWithParam<int>
{
};

TEST_P(RandomCalls, SameAsBruteForce)
{
    Random random(static_cast<std::uint64_t>(GetParam()));
    const btScalar slack = GetParam() % 4 == 0 ? btScalar(0) : btScalar(0.05);
    Broadphase broadphase({.slack = slack});
    BruteForce twin(slack);
    btGhostPairCallback callback, twins_callback;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    std::vector<std::unique_ptr<btCollisionObject>> users, twins_users;
    const bool ghosts = GetParam() % 2 == 1;
    const bool odd = GetParam() >= 16; // many boxes that touch nothing, and many that go
    const btScalar world = GetParam() % 3 == 0 ? 4 : 12;
    struct Both
    {
        btBroadphaseProxy *ours, *theirs;
        btVector3 lo, hi;
    };
    std::vector<Both> proxies;
    const auto coordinate = [&] {
        const btScalar special[] = {0,
                                    -0.,
                                    infinity,
                                    -infinity,
                                    nan,
                                    std::numeric_limits<btScalar>::max(),
                                    std::numeric_limits<btScalar>::lowest(),
                                    std::numeric_limits<btScalar>::denorm_min(),
                                    btScalar(1e9)};
        return random.below(60) == 0 ? special[random.below(9)] : btScalar(random.uniform(-world, world));
    };
    const auto box = [&] {
        btVector3 lo(coordinate(), coordinate(), coordinate());
        const auto size = btScalar(random.below(20) == 0   ? 10
                                   : random.below(10) == 0 ? 0
                                                           : random.uniform(0, 2));
        btVector3 hi = lo + btVector3(size, size * btScalar(0.5), size);
        if (random.below(odd ? 3 : 80) == 0) std::swap(lo, hi);
        return std::pair{lo, hi};
    };
    const auto make_user = [](bool ghost) -> std::unique_ptr<btCollisionObject> {
        if (ghost) return std::make_unique<btPairCachingGhostObject>();
        return std::make_unique<btCollisionObject>();
    };
    if (ghosts) {
        broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
        twin.getOverlappingPairCache()->setInternalGhostPairCallback(&twins_callback);
    }
    for (int turn = 0; turn < 1500; ++turn) {
        const std::uint32_t what = random.below(100);
        if (what < 15 || proxies.size() < 3) {
            const auto [lo, hi] = box();
            const int group = 1 << random.below(3), mask = random.below(4) == 0 ? 3 : -1;
            const bool ghost = ghosts && random.below(8) == 0;
            users.push_back(make_user(ghost));
            twins_users.push_back(make_user(ghost));
            Both both{broadphase.createProxy(lo, hi, 0, users.back().get(), group, mask, &dispatcher),
                      twin.createProxy(lo, hi, 0, twins_users.back().get(), group, mask, &dispatcher), lo,
                      hi};
            users.back()->setBroadphaseHandle(both.ours);
            twins_users.back()->setBroadphaseHandle(both.theirs);
            proxies.push_back(both);
        } else if (what < 70) {
            Both& both = proxies[random.below(static_cast<std::uint32_t>(proxies.size()))];
            if (random.below(3) == 0) {
                std::tie(both.lo, both.hi) = box();
            } else {
                const btVector3 by(btScalar(random.uniform(-0.06, 0.06)), 0,
                                   btScalar(random.uniform(-0.06, 0.06)));
                both.lo += by;
                both.hi += by;
            }
            broadphase.setAabb(both.ours, both.lo, both.hi, &dispatcher);
            twin.setAabb(both.theirs, both.lo, both.hi, &dispatcher);
        } else if (what < (odd ? 79u : 76u)) {
            const std::size_t k = random.below(static_cast<std::uint32_t>(proxies.size()));
            broadphase.destroyProxy(proxies[k].ours, &dispatcher);
            twin.destroyProxy(proxies[k].theirs, &dispatcher);
            proxies.erase(proxies.begin() + static_cast<std::ptrdiff_t>(k));
        } else if (what < (odd ? 80u : 79u)) {
            Both& both = proxies[random.below(static_cast<std::uint32_t>(proxies.size()))];
            both.ours->m_collisionFilterMask = both.theirs->m_collisionFilterMask =
                random.below(2) == 0 ? -1 : 5;
        } else if (what < 86) {
            const auto [lo, hi] = box();
            Collect ours, theirs;
            broadphase.aabbTest(lo, hi, ours);
            twin.aabbTest(lo, hi, theirs);
            ASSERT_EQ(ours.ids, theirs.ids) << turn;
        } else if (what < 93) {
            const btVector3 from = box().first, to = random.below(10) == 0 ? from : box().first;
            const btScalar half = random.below(2) == 0 ? btScalar(0) : btScalar(0.5);
            ASSERT_EQ(on_ray(broadphase, from, to, half), on_ray(twin, from, to, half)) << turn;
        } else {
            broadphase.calculateOverlappingPairs(&dispatcher);
            twin.calculateOverlappingPairs(&dispatcher);
            ASSERT_EQ(pairs_of(broadphase), pairs_of(twin)) << turn;
            btVector3 lo, hi, twins_lo, twins_hi;
            broadphase.getBroadphaseAabb(lo, hi);
            twin.getBroadphaseAabb(twins_lo, twins_hi);
            for (int d = 0; d < 3; ++d) {
                ASSERT_EQ(lo[d], twins_lo[d]);
                ASSERT_EQ(hi[d], twins_hi[d]);
            }
            for (std::size_t i = 0; i < users.size(); ++i)
                if (const btGhostObject* const ghost = btGhostObject::upcast(users[i].get())) {
                    const btGhostObject* const twins = btGhostObject::upcast(twins_users[i].get());
                    ASSERT_EQ(ghost->getNumOverlappingObjects(), twins->getNumOverlappingObjects()) << turn;
                }
        }
        for (std::size_t i = 0; turn % 50 == 0 && i < proxies.size(); ++i)
            for (int d = 0; d < 3; ++d)
                ASSERT_EQ(Broadphase::bounds(proxies[i].ours).lo[d],
                          BruteForce::bounds(proxies[i].theirs).lo[d])
                    << turn;
    }
}
INSTANTIATE_TEST_SUITE_P(Seeds, RandomCalls, testing::Range(0, 24));

TEST(Threads, QuestionsFromManyWhileMuchIsUnseen)
{
    Broadphase broadphase;
    Random random(9);
    std::vector<btBroadphaseProxy*> proxies;
    const auto somewhere = [&] {
        return btVector3(btScalar(random.uniform(0, 40)), btScalar(random.uniform(0, 40)), 0);
    };
    for (int i = 0; i < 500; ++i)
        proxies.push_back(add(broadphase, somewhere()));
    broadphase.calculateOverlappingPairs(nullptr);
    for (int round = 0; round < 5; ++round) {
        for (int i = 0; i < 200; ++i) {
            proxies.push_back(add(broadphase, somewhere()));
            move(broadphase, proxies[static_cast<std::size_t>(i)], somewhere());
        }
        std::vector<std::pair<btVector3, btVector3>> lines;
        std::vector<std::vector<int>> expected;
        for (int i = 0; i < 400; ++i) {
            lines.emplace_back(somewhere(), somewhere());
            std::vector<std::pair<btScalar, int>> hits;
            for (const btBroadphaseProxy* proxy : proxies) {
                jostle::Ray<3, btScalar> ray{};
                for (int d = 0; d < 3; ++d) {
                    ray.origin[d] = lines.back().first[d];
                    ray.direction[d] = lines.back().second[d] - lines.back().first[d];
                }
                ray.max_fraction = 1;
                if (const auto at = jostle::hit_fraction(ray, Broadphase::bounds(proxy)))
                    hits.emplace_back(*at, proxy->m_uniqueId);
            }
            std::sort(hits.begin(), hits.end());
            expected.emplace_back();
            for (const auto& hit : hits)
                expected.back().push_back(hit.second);
        }
        std::vector<std::thread> threads;
        std::vector<std::vector<std::vector<int>>> answers(4);
        for (auto& mine : answers)
            threads.emplace_back([&] {
                for (const auto& [from, to] : lines)
                    mine.push_back(on_ray(broadphase, from, to));
            });
        for (std::thread& thread : threads)
            thread.join();
        for (const auto& mine : answers)
            EXPECT_EQ(mine, expected);
    }
}

TEST(ResetPool, StartsTheNumbersAgainOnceNothingIsThere)
{
    Broadphase broadphase;
    btBroadphaseProxy* const a = add(broadphase, btVector3(0, 0, 0));
    add(broadphase, btVector3(1, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    broadphase.resetPool(nullptr); // does nothing
    EXPECT_EQ(pairs_of(broadphase), (Pairs{{1, 2}}));
    broadphase.destroyProxy(a, nullptr);
    Collect found;
    found.also = [&](const btBroadphaseProxy* proxy) {
        broadphase.destroyProxy(const_cast<btBroadphaseProxy*>(proxy), nullptr);
    };
    broadphase.aabbTest(btVector3(-9, -9, -9), btVector3(9, 9, 9), found);
    EXPECT_EQ(found.ids, (std::vector{2}));
    broadphase.resetPool(nullptr);
    EXPECT_EQ(add(broadphase, btVector3(0, 0, 0)), a);
    EXPECT_EQ(a->m_uniqueId, 1);
    EXPECT_EQ(in_box(broadphase, btVector3(0, 0, 0), 1), (std::vector{1}));
    btVector3 lo, hi;
    broadphase.getBroadphaseAabb(lo, hi);
    EXPECT_EQ(hi[1], 1);
    broadphase.printStats();
    EXPECT_FALSE(broadphase.world().explain().empty());
}

} // namespace
