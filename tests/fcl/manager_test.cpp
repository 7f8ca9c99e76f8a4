// SPDX-License-Identifier: MIT
// The manager beside FCL's: the same pairs, the same least distances, on random scenes and random calls.
#include "jostle/fcl.hpp"

#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "tool/scenes/random.hpp"

namespace {

using jostle_scenes::Random;
template <class S>
using Object = fcl::CollisionObject<S>;
template <class S>
using Pairs = std::set<std::pair<Object<S>*, Object<S>*>>;

/// A geometry that is any box, odd ones too.
template <class S>
class BoxGeometry final : public fcl::CollisionGeometry<S>
{
  public:
    void set(const fcl::AABB<S>& box) { this->aabb_local = box; }
    void computeLocalAABB() override {}
};

template <class S>
struct Calls
{
    Pairs<S> pairs;
    std::size_t count = 0, stop_after = ~std::size_t{0};
    bool ordered = false; ///< whether the first of two is always the asker
    S least = std::numeric_limits<S>::max();
    static bool collide(Object<S>* a, Object<S>* b, void* data)
    {
        auto& calls = *static_cast<Calls*>(data);
        ++calls.count;
        const bool fresh =
            calls.pairs.insert(calls.ordered || a < b ? std::pair(a, b) : std::pair(b, a)).second;
        EXPECT_TRUE(fresh) << "twice";
        return calls.count >= calls.stop_after;
    }
    /// With the distance of the boxes for that of what is in them.
    static bool distance(Object<S>* a, Object<S>* b, void* data, S& least)
    {
        auto& calls = *static_cast<Calls*>(data);
        ++calls.count;
        calls.pairs.insert(std::minmax(a, b));
        const S found = a->getAABB().distance(b->getAABB());
        if (found < calls.least) calls.least = found;
        least = calls.least;
        return calls.count >= calls.stop_after;
    }
};

template <class S>
class Scene
{
  public:
    Scene(std::uint64_t first, S width) : random(first), width_(width) {}
    Object<S>* add()
    {
        geometries_.push_back(std::make_shared<BoxGeometry<S>>());
        objects.push_back(std::make_unique<Object<S>>(geometries_.back()));
        move(objects.size() - 1);
        return objects.back().get();
    }
    void move(std::size_t i)
    {
        fcl::AABB<S> box;
        const S size = random.below(30) == 0 ? width_ / 2 : S(random.uniform(0, 1));
        for (int d = 0; d < 3; ++d) {
            box.min_[d] = S(random.uniform(0, static_cast<double>(width_)));
            box.max_[d] = box.min_[d] + size;
        }
        set(i, box);
    }
    void set(std::size_t i, const fcl::AABB<S>& box)
    {
        geometries_[i]->set(box);
        objects[i]->computeAABB();
    }
    /// Something unusual: no box at all, upside down, all of space, or a point.
    void odd(std::size_t i)
    {
        constexpr S most = std::numeric_limits<S>::max(), nan = std::numeric_limits<S>::quiet_NaN();
        fcl::AABB<S> box;
        const S lo[] = {most, nan, -most, 1, 2, -std::numeric_limits<S>::infinity()};
        const S hi[] = {-most, nan, most, 1, S(1.5), std::numeric_limits<S>::infinity()};
        const std::uint32_t kind = random.below(6);
        box.min_.setConstant(lo[kind]);
        box.max_.setConstant(hi[kind]);
        set(i, box);
    }
    std::vector<Object<S>*> pointers() const
    {
        std::vector<Object<S>*> all;
        for (const auto& object : objects)
            all.push_back(object.get());
        return all;
    }
    Random random;
    std::vector<std::unique_ptr<Object<S>>> objects;

  private:
    S width_;
    std::vector<std::shared_ptr<BoxGeometry<S>>> geometries_;
};

/// The pairs of a set, or between two, by AABB::overlap.
template <class S>
Pairs<S> brute_force(const std::vector<Object<S>*>& a, const std::vector<Object<S>*>& b)
{
    Pairs<S> pairs;
    for (Object<S>* x : a)
        for (Object<S>* y : b)
            if (x != y && x->getAABB().overlap(y->getAABB())) pairs.insert(std::minmax(x, y));
    return pairs;
}
template <class S>
S least_distance(const std::vector<Object<S>*>& a, const std::vector<Object<S>*>& b)
{
    S least = std::numeric_limits<S>::max();
    for (Object<S>* x : a)
        for (Object<S>* y : b)
            if (x != y) {
                const S distance = x->getAABB().distance(y->getAABB());
                if (distance < least) least = distance;
            }
    return least;
}

template <class S>
void expect_right(const jostle::fcl::Manager<S>& manager, const std::vector<Object<S>*>& registered,
                  Scene<S>& asker)
{
    Calls<S> all;
    manager.collide(&all, Calls<S>::collide);
    EXPECT_EQ(all.pairs, brute_force(registered, registered));
    Calls<S> again; // from what is kept
    manager.collide(&again, Calls<S>::collide);
    EXPECT_EQ(again.pairs, all.pairs);
    Calls<S> nearest;
    manager.distance(&nearest, Calls<S>::distance);
    EXPECT_EQ(nearest.least, least_distance(registered, registered));
    for (int i = 0; i < 3; ++i) {
        asker.move(0);
        Object<S>* const one = asker.objects[0].get();
        Calls<S> calls;
        calls.ordered = true;
        manager.collide(one, &calls, Calls<S>::collide);
        Pairs<S> expected;
        for (Object<S>* other : registered)
            if (one->getAABB().overlap(other->getAABB())) expected.insert({one, other});
        EXPECT_EQ(calls.pairs, expected);
        Calls<S> near;
        manager.distance(one, &near, Calls<S>::distance);
        EXPECT_EQ(near.least, least_distance<S>({one}, registered));
    }
}

template <class S>
class Managers : public testing::Test
{
};
using Numbers = testing::Types<double, float>;
TYPED_TEST_SUITE(Managers, Numbers);

TYPED_TEST(Managers, AnswerAsBruteForceOfAnySizeAfterAnyCalls)
{
    using S = TypeParam;
    for (const bool odd : {false, true})
        for (const std::uint32_t count : {0u, 1u, 2u, 9u, 40u, 49u, 60u, 400u}) {
            SCOPED_TRACE(testing::Message() << count << (odd ? " odd" : ""));
            Scene<S> scene(count, S(std::cbrt(count) * 2)), asker(7, S(std::cbrt(count) * 2)),
                strangers(8, 5);
            asker.add();
            strangers.add();
            jostle::fcl::Manager<S> manager;
            for (std::uint32_t i = 0; i < count; ++i)
                scene.add();
            std::vector<Object<S>*> registered = scene.pointers();
            manager.registerObjects(registered);
            manager.setup();
            for (int turn = 0; turn < 25; ++turn) {
                expect_right(manager, registered, asker);
                if (testing::Test::HasFailure()) return;
                const std::uint32_t what = scene.random.below(6);
                const std::vector<Object<S>*> all = scene.pointers();
                const auto any = [&] { return scene.random.below(static_cast<std::uint32_t>(all.size())); };
                if (what == 0) {
                    for (std::size_t i = 0; i < all.size(); ++i)
                        scene.move(i);
                    manager.update();
                } else if (what == 1 &&
                           count > 0) { // those that are registered, those that aren't, some twice
                    std::vector<Object<S>*> list = {strangers.objects[0].get()};
                    for (int k = 0; k < 6; ++k) {
                        const std::uint32_t i = any();
                        odd&& k == 0 ? scene.odd(i) : scene.move(i);
                        list.push_back(all[i]);
                        list.push_back(all[i]);
                    }
                    manager.update(list);
                } else if (what == 2 && count > 0) {
                    const std::uint32_t i = any();
                    scene.move(i);
                    manager.update(all[i]);
                } else if (what == 3 && count > 0) {
                    Object<S>* const object = all[any()];
                    manager.unregisterObject(object);
                    manager.unregisterObject(object);
                    manager.unregisterObject(strangers.objects[0].get());
                    std::erase(registered, object);
                } else if (what == 4) {
                    Object<S>* const object = scene.add();
                    if (odd && turn % 2 == 0) scene.odd(scene.objects.size() - 1);
                    manager.registerObject(object);
                    manager.registerObject(object); // counts once
                    registered.push_back(object);
                } else if (turn > 20) {
                    manager.clear();
                    registered.clear();
                }
                EXPECT_EQ(manager.size(), registered.size());
                EXPECT_EQ(manager.empty(), registered.empty());
                std::vector<Object<S>*> held(3);
                manager.getObjects(held);
                EXPECT_EQ((std::set<Object<S>*>(held.begin(), held.end())),
                          (std::set<Object<S>*>(registered.begin(), registered.end())));
                EXPECT_EQ(held.size(), registered.size());
            }
        }
}

TYPED_TEST(Managers, TwoOfThem)
{
    using S = TypeParam;
    for (const std::uint32_t mine : {0u, 5u, 70u, 300u})
        for (const std::uint32_t theirs : {0u, 5u, 70u, 300u}) {
            SCOPED_TRACE(testing::Message() << mine << ", " << theirs);
            Scene<S> a(1 + mine, 12), b(2 + theirs, 12);
            for (std::uint32_t i = 0; i < mine; ++i)
                a.add();
            for (std::uint32_t i = 0; i < theirs; ++i)
                b.add();
            jostle::fcl::Manager<S> ours, others;
            fcl::NaiveCollisionManager<S> foreign;
            ours.registerObjects(a.pointers());
            others.registerObjects(b.pointers());
            foreign.registerObjects(b.pointers());
            for (fcl::BroadPhaseCollisionManager<S>* other :
                 {static_cast<fcl::BroadPhaseCollisionManager<S>*>(&others),
                  static_cast<fcl::BroadPhaseCollisionManager<S>*>(&foreign)}) {
                Calls<S> calls;
                ours.collide(other, &calls, Calls<S>::collide);
                EXPECT_EQ(calls.pairs, brute_force(a.pointers(), b.pointers()));
                Calls<S> near;
                ours.distance(other, &near, Calls<S>::distance);
                EXPECT_EQ(near.least, least_distance(a.pointers(), b.pointers()));
                Calls<S> once;
                once.stop_after = 1;
                ours.collide(other, &once, Calls<S>::collide);
                EXPECT_EQ(once.count, std::min<std::size_t>(1, calls.count));
            }
            Calls<S> self, expected;
            ours.collide(&ours, &self, Calls<S>::collide);
            EXPECT_EQ(self.pairs, brute_force(a.pointers(), a.pointers()));
            Calls<S> near;
            ours.distance(&ours, &near, Calls<S>::distance);
            EXPECT_EQ(near.least, least_distance(a.pointers(), a.pointers()));
        }
}

TYPED_TEST(Managers, DistanceOfThoseApartOutliersAndCrowds)
{
    using S = TypeParam;
    const auto check = [](Scene<S>& scene) {
        jostle::fcl::Manager<S> manager;
        manager.registerObjects(scene.pointers());
        Calls<S> near;
        manager.distance(&near, Calls<S>::distance);
        EXPECT_EQ(near.least, least_distance(scene.pointers(), scene.pointers()));
        return near.count;
    };
    const auto point = [](S x, S y, S z) {
        fcl::AABB<S> box;
        box.min_ = box.max_ = fcl::Vector3<S>(x, y, z);
        return box;
    };
    Scene<S> apart(1, 1);
    for (std::uint32_t i = 0; i < 1000; ++i) {
        apart.add();
        apart.set(i, point(S(i % 10) * 10 + S(apart.random.uniform()), S(i / 10 % 10) * 10, S(i / 100) * 10));
    }
    EXPECT_LT(check(apart), 20u); // nearest first
    Scene<S> crowd(2, 1);         // what is asked first is far from all others
    for (std::uint32_t i = 0; i < 600; ++i) {
        crowd.add();
        crowd.set(i, i % 199 == 0 ? point(S(i) * 1000, 0, 0)
                                  : point(S(crowd.random.uniform()) + 5, S(crowd.random.uniform()),
                                          S(crowd.random.uniform())));
    }
    check(crowd);
    Scene<S> one_place(3, 1);
    for (std::uint32_t i = 0; i < 300; ++i) {
        one_place.add();
        one_place.set(i, point(1, 2, 3));
    }
    EXPECT_LT(check(one_place), 3u);
}

// Of two cubes beside 0, a little more than 1 apart, the computed distance is 1.
TYPED_TEST(Managers, DistanceOfAPairWhoseGapIsRoundedDownToTheBound)
{
    using S = TypeParam;
    Scene<S> scene(1, 1);
    const auto add = [&](S x, S y) {
        fcl::AABB<S> box;
        const fcl::Vector3<S> half = fcl::Vector3<S>::Constant(S(0.25));
        box.min_ = fcl::Vector3<S>(x, y, 0) - half;
        box.max_ = fcl::Vector3<S>(x, y, 0) + half;
        scene.add();
        scene.set(scene.objects.size() - 1, box);
    };
    add(1000, 1000); // 1 apart, their objects 1.5
    add(S(1001.5), 1000);
    for (int i = 2; i < 60; ++i)
        add(S(5000 + 100 * i), -5000);
    add(-3000, 0); // 0.875 apart, their objects 2
    add(S(-3000 + 1.375), 0);
    add(S(-0.75), 0);
    add(S(0.75), 0);
    fcl::AABB<S> beside = scene.objects.back()->getAABB();
    beside.min_[0] += std::numeric_limits<S>::epsilon() / 2;
    scene.set(scene.objects.size() - 1, beside);
    for (int i = 0; i < 6; ++i)
        add(S(-5000 - 100 * i), 5000);
    ASSERT_EQ(scene.objects[62]->getAABB().distance(scene.objects[63]->getAABB()), 1);
    struct Asked
    {
        Scene<S>* scene;
        S least;
    } asked{&scene, 0};
    const auto distance = [](Object<S>* a, Object<S>* b, void* data, S& least) {
        auto& now = *static_cast<Asked*>(data);
        const auto are = [&](std::size_t i) {
            return std::minmax(a, b) ==
                   std::minmax(now.scene->objects[i].get(), now.scene->objects[i + 1].get());
        };
        const S found = are(0) ? S(1.5) : are(60) ? S(2) : a->getAABB().distance(b->getAABB());
        now.least = least = std::min(least, found);
        return false;
    };
    jostle::fcl::Manager<S> manager;
    manager.registerObjects(scene.pointers());
    manager.distance(&asked, distance);
    EXPECT_EQ(asked.least, 1);
}

// An empty mesh, then as well a box that is upside down.
TYPED_TEST(Managers, DistanceWithSomeOddOnes)
{
    using S = TypeParam;
    Scene<S> scene(4, 100);
    for (std::uint32_t i = 0; i < 4000; ++i) {
        scene.add();
        fcl::AABB<S> box;
        box.min_ = box.max_ = fcl::Vector3<S>(S(i % 16), S(i / 16 % 16), S(i / 256)) * S(5);
        box.max_.array() += S(scene.random.uniform());
        scene.set(i, box);
    }
    jostle::fcl::Manager<S> manager;
    manager.registerObjects(scene.pointers());
    for (const bool empty : {true, false}) {
        constexpr S most = std::numeric_limits<S>::max();
        fcl::AABB<S> odd;
        odd.min_.setConstant(empty ? most : 50);
        odd.max_.setConstant(empty ? -most : S(49.5));
        scene.set(empty ? 7 : 2000, odd);
        manager.update();
        Calls<S> near;
        manager.distance(&near, Calls<S>::distance);
        EXPECT_EQ(near.least, least_distance(scene.pointers(), scene.pointers()));
    }
}

TYPED_TEST(Managers, DistanceWithManyOddOnesOfOneAndOfTwo)
{
    using S = TypeParam;
    for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        const S width = seed % 2 == 0 ? 200 : 20;
        Scene<S> a(seed, width), b(100 + seed, width);
        for (std::uint32_t i = 0; i < 130; ++i) {
            a.add();
            b.add();
        }
        const auto make_some_odd = [](Scene<S>& scene, std::uint32_t some) {
            for (std::uint32_t k = 0; k < some; ++k) {
                const std::size_t i = scene.random.below(130);
                fcl::AABB<S> box = scene.objects[i]->getAABB();
                if (k % 4 == 0)
                    scene.odd(i);
                else { // in one direction, and by less than it is away from others
                    std::swap(box.min_[0], box.max_[0]);
                    scene.set(i, box);
                }
            }
        };
        if (seed % 3 != 0) make_some_odd(a, seed % 5 == 0 ? 200 : 6);
        if (seed % 3 != 1) make_some_odd(b, 6);
        jostle::fcl::Manager<S> ours, others;
        ours.registerObjects(a.pointers());
        others.registerObjects(b.pointers());
        for (int i = 0; i < 3; ++i) { // without a tree, and with one
            Calls<S> within, between;
            ours.distance(&within, Calls<S>::distance);
            EXPECT_EQ(within.least, least_distance(a.pointers(), a.pointers()));
            ours.distance(&others, &between, Calls<S>::distance);
            EXPECT_EQ(between.least, least_distance(a.pointers(), b.pointers()));
        }
        // A callback that sets no distance is called for each pair once, unless there is none.
        const auto tell_nothing = [](Object<S>* x, Object<S>* y, void* data, S&) {
            EXPECT_TRUE(static_cast<Pairs<S>*>(data)->insert(std::minmax(x, y)).second);
            return false;
        };
        const auto all_pairs = [](const std::vector<Object<S>*>& some, const std::vector<Object<S>*>& rest) {
            Pairs<S> pairs;
            for (Object<S>* x : some)
                for (Object<S>* y : rest)
                    if (x != y && x->getAABB().distance(y->getAABB()) < std::numeric_limits<S>::max())
                        pairs.insert(std::minmax(x, y));
            return pairs;
        };
        Pairs<S> within, between;
        ours.distance(&within, tell_nothing);
        EXPECT_EQ(within, all_pairs(a.pointers(), a.pointers()));
        ours.distance(&others, &between, tell_nothing);
        EXPECT_EQ(between, all_pairs(a.pointers(), b.pointers()));
        if (testing::Test::HasFailure()) return;
    }
}

// A callback that never says how near anything is gets all pairs.
TYPED_TEST(Managers, DistanceWithoutABound)
{
    using S = TypeParam;
    for (const std::uint32_t count : {20u, 200u}) {
        Scene<S> scene(5, 10);
        for (std::uint32_t i = 0; i < count; ++i)
            scene.add();
        jostle::fcl::Manager<S> manager;
        manager.registerObjects(scene.pointers());
        const auto tell_nothing = [](Object<S>* a, Object<S>* b, void* data, S&) {
            EXPECT_TRUE(static_cast<Pairs<S>*>(data)->insert(std::minmax(a, b)).second);
            return false;
        };
        Pairs<S> all, from_first;
        manager.distance(&all, tell_nothing);
        EXPECT_EQ(all.size(), count * (count - 1) / 2);
        scene.random = Random(99);
        Object<S>* const asker = scene.add();
        manager.distance(asker, &from_first, tell_nothing);
        EXPECT_EQ(from_first.size(), count);
    }
}

TYPED_TEST(Managers, CallbacksStopAndAskAgain)
{
    using S = TypeParam;
    Scene<S> scene(6, 10);
    for (std::uint32_t i = 0; i < 300; ++i)
        scene.add();
    jostle::fcl::Manager<S> manager;
    manager.registerObjects(scene.pointers());
    for (const std::size_t stop : {1u, 2u, 7u}) {
        Calls<S> calls, near;
        calls.stop_after = near.stop_after = stop;
        manager.collide(&calls, Calls<S>::collide);
        EXPECT_EQ(calls.count, stop);
        manager.distance(scene.objects[0].get(), &near, Calls<S>::distance);
        EXPECT_LE(near.count, stop);
    }
    struct Nested
    {
        jostle::fcl::Manager<S>* manager;
        Scene<S>* scene;
        std::size_t inner = 0, outer = 0;
    } nested{&manager, &scene};
    const auto inside = [](Object<S>* a, Object<S>*, void* data) {
        auto& n = *static_cast<Nested*>(data);
        Calls<S> whole, one;
        n.manager->collide(&whole, Calls<S>::collide);
        n.inner = whole.count;
        if (n.outer == 10) { // something moves, and is asked about at once
            n.scene->move(3);
            n.manager->update(n.scene->objects[3].get());
        }
        n.manager->collide(a, &one, Calls<S>::collide);
        EXPECT_EQ(one.pairs.size(), brute_force<S>({a}, n.scene->pointers()).size() + 1);
        ++n.outer;
        return n.outer % 40 == 0;
    };
    manager.collide(&nested, inside);
    EXPECT_EQ(nested.outer, 40u);
    EXPECT_EQ(nested.inner, brute_force(scene.pointers(), scene.pointers()).size());
    for (int i = 0; i < 60; ++i)
        manager.collide(scene.objects[0].get(), &nested, inside); // from the index
    EXPECT_GT(nested.outer, 60u);
}

TYPED_TEST(Managers, WhatACallbackMovesIsNoLessFoundByItsOwnQuestion)
{
    using S = TypeParam;
    Scene<S> scene(6, 10), asker(7, 10);
    for (std::uint32_t i = 0; i < 200; ++i)
        scene.add();
    fcl::AABB<S> box;
    box.min_.setConstant(-100);
    box.max_.setConstant(100);
    asker.add();
    asker.set(0, box);
    jostle::fcl::Manager<S> manager;
    manager.registerObjects(scene.pointers());
    for (int i = 0; i < 20; ++i) { // then there is a tree
        Calls<S> all;
        manager.collide(asker.objects[0].get(), &all, Calls<S>::collide);
        EXPECT_EQ(all.count, 200u);
    }
    struct Moving
    {
        jostle::fcl::Manager<S>* manager;
        Scene<S>* scene;
        std::size_t found = 0;
    } moving{&manager, &scene};
    const auto move_all = [](Object<S>* a, Object<S>*, void* data) {
        auto& m = *static_cast<Moving*>(data);
        if (m.found++ > 0) return false;
        fcl::AABB<S> far;
        far.min_.setConstant(1000);
        far.max_.setConstant(1001);
        for (std::size_t i = 0; i < m.scene->objects.size(); ++i)
            m.scene->set(i, far);
        m.manager->update();
        for (int i = 0; i < 20; ++i) {
            Calls<S> none;
            m.manager->collide(a, &none, Calls<S>::collide);
            EXPECT_EQ(none.count, 0u);
        }
        return false;
    };
    manager.collide(asker.objects[0].get(), &moving, move_all);
    EXPECT_EQ(moving.found, 200u);
}

TYPED_TEST(Managers, QuestionsFromManyThreadsBeforeAnythingIsBuilt)
{
    using S = TypeParam;
    Scene<S> scene(6, 14), askers(7, 14);
    for (std::uint32_t i = 0; i < 500; ++i)
        scene.add();
    for (std::uint32_t i = 0; i < 100; ++i)
        askers.add();
    jostle::fcl::Manager<S> manager;
    manager.registerObjects(scene.pointers());
    for (int round = 0; round < 4; ++round) {
        for (std::size_t i = 0; i < 500; i += 1 + 3 * static_cast<std::size_t>(round))
            scene.move(i);
        manager.update();
        const Pairs<S> expected = brute_force(askers.pointers(), scene.pointers());
        const Pairs<S> within = brute_force(scene.pointers(), scene.pointers());
        std::vector<std::thread> threads;
        std::vector<Pairs<S>> found(3), selves(3);
        for (std::size_t t = 0; t < 3; ++t)
            threads.emplace_back([&, t] {
                for (const auto& asker : askers.objects) {
                    Calls<S> calls;
                    manager.collide(asker.get(), &calls, Calls<S>::collide);
                    found[t].insert(calls.pairs.begin(), calls.pairs.end());
                }
                Calls<S> self;
                manager.collide(&self, Calls<S>::collide);
                selves[t] = self.pairs;
            });
        for (std::thread& thread : threads)
            thread.join();
        for (std::size_t t = 0; t < 3; ++t) {
            EXPECT_EQ(found[t], expected);
            EXPECT_EQ(selves[t], within);
        }
    }
}

// FCL's shapes and FCL's answers about them; half-spaces and planes have boxes without end.
TEST(Shapes, ContactsAndDistancesAsWithFclsOwnManagers)
{
    Random random(11);
    std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects;
    std::vector<fcl::CollisionObjectd*> pointers;
    for (int i = 0; i < 300; ++i) {
        std::shared_ptr<fcl::CollisionGeometryd> geometry;
        if (i == 0)
            geometry = std::make_shared<fcl::Halfspaced>(fcl::Vector3d(0, 1, 0.2).normalized(), 1);
        else if (i == 1)
            geometry = std::make_shared<fcl::Planed>(fcl::Vector3d(1, 0, 0), 12);
        else if (i % 2)
            geometry = std::make_shared<fcl::Boxd>(random.uniform(0.2, 2), 1, 1);
        else
            geometry = std::make_shared<fcl::Sphered>(random.uniform(0.2, 1));
        fcl::Transform3d place = fcl::Transform3d::Identity();
        if (i > 1)
            place.translation() =
                fcl::Vector3d(random.uniform(0, 20), random.uniform(0, 20), random.uniform(0, 20));
        objects.push_back(std::make_unique<fcl::CollisionObjectd>(geometry, place));
        objects.back()->computeAABB();
        pointers.push_back(objects.back().get());
    }
    struct Contacts
    {
        std::set<std::pair<const void*, const void*>> hits;
        double least = std::numeric_limits<double>::max();
    };
    const auto collide = [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
        fcl::CollisionResultd result;
        if (fcl::collide(a, b, fcl::CollisionRequestd(), result) > 0)
            static_cast<Contacts*>(data)->hits.insert(std::minmax<const void*>(a, b));
        return false;
    };
    const auto distance = [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data, double& least) {
        fcl::DistanceResultd result;
        auto& contacts = *static_cast<Contacts*>(data);
        contacts.least = std::min(contacts.least, fcl::distance(a, b, fcl::DistanceRequestd(), result));
        least = contacts.least;
        return least <= 0;
    };
    fcl::NaiveCollisionManagerd naive; // FCL 0.7's trees crash on boxes without end
    jostle::fcl::Manager<double> ours;
    naive.registerObjects(pointers);
    ours.registerObjects(pointers);
    Contacts expected, found;
    naive.collide(&expected, collide);
    ours.collide(&found, collide);
    EXPECT_EQ(found.hits, expected.hits);
    EXPECT_GT(found.hits.size(), 20u);
    std::vector<fcl::CollisionObjectd*> apart;
    for (std::size_t i = 2; i < 300; ++i)
        if (std::none_of(apart.begin(), apart.end(), [&](fcl::CollisionObjectd* other) {
                return other->getAABB().overlap(pointers[i]->getAABB());
            }))
            apart.push_back(pointers[i]);
    fcl::DynamicAABBTreeCollisionManagerd spread_tree;
    jostle::fcl::Manager<double> spread;
    spread_tree.registerObjects(apart);
    spread_tree.setup();
    spread.registerObjects(apart);
    Contacts far, ours_far;
    spread_tree.distance(&far, distance);
    spread.distance(&ours_far, distance);
    EXPECT_EQ(ours_far.least, far.least);
    EXPECT_GT(far.least, 0);
    for (int i = 0; i < 20; ++i) {
        Contacts theirs, mine;
        spread_tree.distance(pointers[static_cast<std::size_t>(i) * 7 + 2], &theirs, distance);
        spread.distance(pointers[static_cast<std::size_t>(i) * 7 + 2], &mine, distance);
        EXPECT_EQ(mine.least, theirs.least);
    }
}

} // namespace
