// SPDX-License-Identifier: MIT
// Objects that keep moving remember what rests near their way. Whatever happens near it, no pair is lost.
#include <gtest/gtest.h>

#include <stdexcept>

#include "twin.hpp"

namespace world_tests {
namespace {

/// A world and its twin, with so many objects at rest that it is worth remembering them.
template <int Dim, class T>
struct Street
{
    using Box = Aabb<Dim, T>;
    bool angry = false; // accept throws
    jostle::World<Dim, T> world{jostle::WorldOptions{.accept = [this](ObjectId, ObjectId) {
        if (angry) throw std::runtime_error("no");
        return true;
    }}};
    Twin<Dim, T> twin;

    Street()
    {
        for (int i = 0; i < 100; ++i)
            add(cube(static_cast<T>(-100 - 2 * i), T(1)));
    }
    /// Its lower corner is at (at, at, ...).
    static Box cube(T at, T edge)
    {
        Box box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = at;
            box.hi[d] = at + edge;
        }
        return box;
    }
    static Box shifted(Box box, int axis, T by)
    {
        box.lo[axis] += by;
        box.hi[axis] += by;
        return box;
    }
    ObjectId add(const Box& box)
    {
        typename Twin<Dim, T>::Thing thing;
        thing.id = world.add(box);
        thing.box = box;
        twin.things[thing.id.index] = thing;
        return thing.id;
    }
    void move(ObjectId id, const Box& box)
    {
        world.move(id, box);
        twin.things.at(id.index).box = box;
    }
    testing::AssertionResult update()
    {
        world.update();
        twin.update();
        return agree(world, twin);
    }
};

template <int Dim, class T>
void pass_along(int axis, T step)
{
    using Scene = Street<Dim, T>;
    Scene street;
    const T start = step > 0 ? T(0) : T(12);
    const ObjectId mover = street.add(Scene::shifted(Scene::cube(0, 1), axis, start));
    // At rest beside the way, each touching it with a corner.
    for (int k = 0; k < 12; ++k)
        street.add(Scene::shifted(Scene::cube(T(0.75), T(0.5)), axis, static_cast<T>(k)));
    std::uint64_t met = 0, listed = 0;
    for (int update = 0; update < 200; ++update) {
        if (update > 4)
            street.move(mover, Scene::shifted(street.twin.things.at(mover.index).box, axis, step));
        ASSERT_TRUE(street.update()) << Dim << " dimensions, along axis " << axis << ", update " << update;
        if (update > 4) met += street.world.began().size();
        listed += street.world.stats().listed;
    }
    EXPECT_GE(met, 9u);
    EXPECT_GE(listed, 5u) << "each list serves for some of the way";
    EXPECT_LE(listed, 40u) << "the way wasn't remembered at all";
}

TEST(Neighbours, WhoeverMovesOnMeetsWhatRestsAlongTheWayOnAnyAxis)
{
    for (int axis = 0; axis < 2; ++axis)
        for (const double step : {0.05, -0.05}) {
            pass_along<2, float>(axis, static_cast<float>(step));
            pass_along<2, double>(axis, step);
        }
    for (int axis = 0; axis < 3; ++axis)
        for (const double step : {0.05, -0.05}) {
            pass_along<3, float>(axis, static_cast<float>(step));
            pass_along<3, double>(axis, step);
        }
}

TEST(Neighbours, WhatComesToRestAheadIsMet)
{
    using Scene = Street<3, float>;
    for (const int together : {1, 2, 70}) { // how many come to rest in one update
        Scene street;
        const ObjectId mover = street.add(Scene::cube(0, 1));
        std::uint64_t met = 0, settled = 0;
        const int updates = together < 10 ? 300 : 80;
        for (int update = 0; update < updates; ++update) {
            const auto& box = street.twin.things.at(mover.index).box;
            if (update > 4) street.move(mover, Scene::shifted(box, 0, 0.05f));
            if (update % 8 == 7) { // new objects rest one update later
                for (int k = 0; k < together; ++k)
                    street.add(Scene::shifted(Scene::cube(0.5f, 0.25f), 0, box.lo[0] + 0.75f));
            }
            ASSERT_TRUE(street.update()) << together << " at a time, update " << update;
            met += street.world.began().size();
            settled += street.world.stats().settled == static_cast<std::uint64_t>(together);
        }
        EXPECT_GE(met, static_cast<std::uint64_t>(together * (updates / 8 - 4)));
        EXPECT_GE(settled, static_cast<std::uint64_t>(updates / 8 - 2));
    }
}

TEST(Neighbours, WhatAFailedUpdateSawIsForgotten)
{
    using Scene = Street<3, float>;
    for (int moved_before = 0; moved_before < 6; ++moved_before) {
        Scene street;
        const ObjectId mover = street.add(Scene::cube(0, 1)), ahead = street.add(Scene::cube(1.25f, 0.5f)),
                       trouble = street.add(Scene::cube(50, 1)), other = street.add(Scene::cube(60, 1));
        for (int update = 0; update < 6; ++update)
            ASSERT_TRUE(street.update());
        ASSERT_EQ(street.world.stats().active, 0u);
        jostle::Aabb3f box = Scene::cube(0, 1);
        const auto move_on = [&] {
            box = Scene::shifted(Scene::shifted(Scene::shifted(box, 0, 0.05f), 1, 0.05f), 2, 0.05f);
        };
        for (int update = 0; update < moved_before; ++update) {
            move_on();
            street.move(mover, box);
            ASSERT_TRUE(street.update());
        }
        // An update in which the one ahead goes away; another one's new pair makes it fail.
        move_on();
        const std::vector<ObjectId> ids{mover, ahead, trouble};
        const std::vector<jostle::Aabb3f> boxes{box, Scene::cube(90, 0.5f), Scene::cube(60.5f, 1)};
        street.angry = true;
        EXPECT_THROW(street.world.update(ids, boxes), std::runtime_error);
        street.angry = false;
        ASSERT_EQ(street.world.box(ahead).lo[0], 1.25f);
        std::uint64_t met = 0;
        for (int update = 0; update < 12; ++update) {
            street.move(mover, box);
            ASSERT_TRUE(street.update()) << moved_before << " moves before the failure, then " << update;
            met += street.world.began().size();
            move_on();
        }
        EXPECT_EQ(met, 1u);
        EXPECT_TRUE(street.world.contains(other));
    }
}

} // namespace
} // namespace world_tests
