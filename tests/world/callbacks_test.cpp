// SPDX-License-Identifier: MIT
// What the filter callback of a World may do, and what may be done to a World that is in use.
#include <gtest/gtest.h>

#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "jostle/world.hpp"
#include "tests/contract/error_of.hpp"
#include "tests/world/events.hpp"

namespace world_tests {
namespace {

using contract::error_of;
using jostle::EndReason;
using jostle::Error;
using jostle::ErrorCode;
using jostle::ObjectId;
using jostle::Pair;
using jostle::World3f;

TEST(World, TheCallbackDecidesOnce)
{
    int asked = 0;
    bool answer = false;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        ++asked;
        return answer;
    };
    World3f world(options);
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    EXPECT_EQ(asked, 1);
    EXPECT_TRUE(began(world).empty());
    EXPECT_EQ(world.stats().refused, 1u);
    world.move(a, cube(0.25f));
    world.update();
    EXPECT_EQ(asked, 1);
    EXPECT_TRUE(world.persisted().empty());
    answer = true;
    world.set_filter(a, world.filter(a));
    world.update();
    EXPECT_EQ(asked, 2);
    EXPECT_EQ(began(world), (Began{{a, b}}));
    answer = false;
    world.set_filter(b, world.filter(b));
    world.update();
    EXPECT_EQ(ended(world), (Ended{{a, b, EndReason::filtered}}));
    world.move(b, cube(5));
    world.update();
    EXPECT_TRUE(ended(world).empty());
    EXPECT_EQ(world.stats().refused, 0u);
}

TEST(World, ACallbackThatThrowsLeavesTheWorldAsItWas)
{
    bool angry = true;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        if (angry) throw std::runtime_error("no");
        return true;
    };
    World3f world(options);
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    EXPECT_THROW(world.update(), std::runtime_error);
    EXPECT_EQ(world.size(), 0u);
    angry = false;
    world.update();
    EXPECT_EQ(began(world), (Began{{a, b}})) << "what was queued is not lost";
}

TEST(World, NoUpdateOrRestoreInsideTheCallback)
{
    World3f* inside = nullptr;
    std::vector<Error> errors;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        const std::vector<std::byte> snapshot = inside->save();
        errors.push_back(error_of([&] { inside->update(); }));
        errors.push_back(error_of([&] { inside->restore(snapshot); }));
        return true;
    };
    World3f world(options);
    inside = &world;
    world.add(cube(0));
    world.add(cube(0.5f));
    world.update();
    ASSERT_EQ(errors.size(), 2u);
    for (const Error& error : errors) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
        EXPECT_NE(std::string(error.what()).find("this World is in use by another call"), std::string::npos);
    }
    EXPECT_EQ(world.began().size(), 1u);
    world.restore(world.save());
    world.update();
    EXPECT_EQ(world.pairs().size(), 1u) << "after the call it can be used as before";
}

TEST(World, NoUpdateOrRestoreInsideAQuestionOrADrawing)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0.5f));
    world.update();
    const std::vector<std::byte> snapshot = world.save();
    std::vector<Error> errors;
    ObjectId fresh;
    const auto misuse = [&] {
        errors.push_back(error_of([&] { world.update(); }));
        errors.push_back(
            error_of([&] { world.update(std::span(&a, 1), std::span<const jostle::Aabb3f>()); }));
        errors.push_back(error_of([&] { world.restore(snapshot); }));
        if (fresh == ObjectId{}) fresh = world.add(cube(9)); // commands are welcome
        EXPECT_EQ(world.count(cube(0)), 2u) << "and so are questions";
        return false;
    };
    auto accept = [&](std::uint32_t, ObjectId) { return misuse(); };
    jostle::ObjectQueryFilter filter;
    filter.accept = accept;
    const jostle::Ray3f ray{{-1, 0.5f, 0.5f}, {1, 0, 0}};
    std::vector<ObjectId> ids;
    std::vector<jostle::Hit<float, jostle::ObjectId>> hits;
    jostle::ResultLists<ObjectId> lists;
    const std::vector<jostle::Aabb3f> boxes(3, cube(0));
    (void)world.first(ray, filter);
    (void)world.any(cube(0), filter);
    (void)world.count(cube(0), filter);
    world.all(cube(0), ids, filter);
    world.nearest({{0, 0, 0}, 1}, hits, filter);
    world.all(std::span(boxes), lists, filter);
    EXPECT_EQ(errors.size(), 8u * 2 * 3) << "8 questions, 2 objects, 3 errors each time";
    const std::size_t drawn_from = errors.size();
    world.draw([&](const jostle::Aabb3f&, jostle::DrawKind) { misuse(); },
               [&](const jostle::Vec3f&, const jostle::Vec3f&, jostle::DrawKind) { misuse(); });
    EXPECT_EQ(errors.size(), drawn_from + 3 * 3) << "two boxes and a line";
    const std::size_t visited_from = errors.size();
    const auto on_hit = [&](std::uint32_t, ObjectId) { return misuse(); };
    EXPECT_FALSE(world.join(boxes, on_hit));
    EXPECT_FALSE(world.join(boxes, on_hit, std::vector<jostle::ObjectQueryFilter>(3)));
    EXPECT_FALSE(world.touching(a, [&](ObjectId) { return misuse(); }));
    EXPECT_EQ(errors.size(), visited_from + 3 * 3) << "one object each, as each visitor stops";
    for (const Error& error : errors) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
        EXPECT_NE(std::string(error.what()).find("is answering a query"), std::string::npos);
    }
    auto throwing = [](std::uint32_t, ObjectId) -> bool { throw std::runtime_error("no"); };
    filter.accept = throwing;
    EXPECT_THROW((void)world.any(cube(0), filter), std::runtime_error);
    std::pmr::vector<jostle::Pair> joined(3);
    EXPECT_THROW(world.join(boxes, joined, filter), std::runtime_error);
    EXPECT_TRUE(joined.empty());
    joined.resize(3);
    EXPECT_THROW(world.join(boxes, joined, std::vector(3, filter)), std::runtime_error);
    EXPECT_TRUE(joined.empty());
    world.move(b, cube(0.25f));
    world.update(); // after the question it can be used as before
    EXPECT_EQ(world.size(), 3u);
    EXPECT_EQ(world.persisted().to_vector(), (std::vector<Pair>{{a.index, b.index}}));
}

TEST(World, QuestionsInsideTheCallbackAreAboutTheLastUpdate)
{
    World3f* me = nullptr;
    bool angry = true;
    std::vector<std::uint64_t> counts;
    const auto count = [&](float at) { counts.push_back(me->count(cube(at))); };
    jostle::WorldOptions options;
    options.accept = [&](ObjectId a, ObjectId b) {
        count(0);
        count(5);
        EXPECT_EQ(me->bounds(a).lo[0], 5) << "what can be read of objects is new";
        EXPECT_EQ(me->bounds(b).lo[0], 5);
        if (angry) throw std::runtime_error("no");
        return true;
    };
    World3f world(options);
    me = &world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(5)), c = world.add(cube(10));
    for (const bool rests : {true, false}) {
        for (int k = 0; k < 8; ++k)
            world.update();
        for (const float at : {0.25f, 0.0f}) {
            if (!rests) world.move(a, cube(at));
            world.move(c, cube(10 + at)); // somebody is always active
            world.update();
        }
        EXPECT_EQ(world.stats().resting, rests ? 2u : 1u);
        for (const bool asked_before : {false, true}) {
            angry = true;
            counts.clear();
            world.move(a, cube(5));
            if (asked_before) count(0);
            EXPECT_THROW(world.update(), std::runtime_error);
            count(0); // and after it has failed
            count(5);
            world.move(a, cube(0));
            world.update();
            for (const std::uint64_t each : counts)
                EXPECT_EQ(each, 1u) << "rests " << rests << ", asked before " << asked_before;
        }
    }
    angry = false;
    counts.clear();
    world.move(a, cube(5));
    world.update();
    count(0);
    count(5);
    EXPECT_EQ(counts, (std::vector<std::uint64_t>{1, 1, 0, 2}));
    EXPECT_EQ(began(world), (Began{{a, b}}));
}

/// Asked so often by a mask that the few which it leaves get an index of their own, in the middle of the
/// update.
TEST(World, QuestionsByMasksInsideTheCallbackAreAboutTheLastUpdate)
{
    World3f* me = nullptr;
    bool angry = true;
    int asked = 0;
    const jostle::ObjectQueryFilter few{.mask = 2};
    const auto ask = [&](std::uint64_t at_0, std::uint64_t at_5) {
        for (int i = 0; i < 50; ++i) {
            EXPECT_EQ(me->count(cube(0), few), at_0) << i;
            EXPECT_EQ(me->count(cube(5), few), at_5) << i;
            ++asked;
        }
    };
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        ask(1, 1);
        if (angry) throw std::runtime_error("no");
        return true;
    };
    World3f world(options);
    me = &world;
    for (int i = 0; i < 2000; ++i)
        world.add(cube(10 + 2 * static_cast<float>(i)));
    const ObjectId a = world.add(cube(0)), b = world.add(cube(5));
    jostle::ObjectFilter rare;
    rare.category = 2;
    world.set_filter(a, rare);
    world.set_filter(b, rare);
    while (world.stats().resting < 2002)
        world.update();
    for (int round = 0; round < 2; ++round) {
        world.move(a, cube(5));
        EXPECT_THROW(world.update(), std::runtime_error);
        ask(1, 1); // and after it has failed
        world.move(a, cube(0));
        world.update();
        ask(1, 1);
    }
    angry = false;
    world.move(a, cube(5));
    world.update();
    ask(0, 2);
    EXPECT_EQ(asked, 8 * 50);
}

TEST(World, CommandsInsideTheCallbackAreForTheNextUpdate)
{
    World3f* me = nullptr;
    jostle::WorldOptions options;
    ObjectId fresh;
    options.accept = [&](ObjectId a, ObjectId b) {
        EXPECT_TRUE(me->contains(a));
        if (fresh == ObjectId{}) {
            me->remove(b);
            fresh = me->add(cube(0));
        }
        return true;
    };
    World3f world(options);
    me = &world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    EXPECT_EQ(began(world), (Began{{a, b}}));
    world.update();
    EXPECT_EQ(ended(world), (Ended{{a, b, EndReason::removed}}));
    EXPECT_EQ(began(world), (Began{{a, fresh}}));
}

} // namespace
} // namespace world_tests
