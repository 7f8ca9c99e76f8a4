// SPDX-License-Identifier: MIT
// What a World tells of its work.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "jostle/world.hpp"
#include "tests/contract/counting_memory.hpp"
#include "tests/world/events.hpp"
#include "tool/scenes/scenes.hpp"

namespace world_tests {
namespace {

using jostle::ObjectFilter;
using jostle::ObjectId;
using jostle::World3f;

TEST(World, CountsThePairsThatItLookedAt)
{
    World3f world;
    std::vector<ObjectId> ids(100);
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 100; ++i)
        boxes.push_back(cube(static_cast<float>(i))); // each touches the next one
    world.add(boxes, ids);
    for (int update = 0; update < 2; ++update) { // new ones, then moved ones
        world.update();
        EXPECT_EQ(world.stats().candidates, 99u) << update;
        EXPECT_EQ(world.stats().false_positives, 0u) << update;
        for (std::size_t i = 0; i < ids.size(); ++i)
            world.move(ids[i], {{boxes[i].lo[0], 0.5f, 0}, {boxes[i].hi[0], 1.5f, 1}});
    }
    ObjectFilter apart;
    apart.mask = 0;
    world.set_filter(ids[50], apart);
    world.update();
    EXPECT_EQ(world.stats().candidates, 2u);
    EXPECT_EQ(world.stats().false_positives, 2u);
}

TEST(World, CountsWhatItWasTold)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(5));
    world.set_margin(a, 1);
    world.update();
    EXPECT_EQ(world.stats().commands, 3u);
    EXPECT_EQ(world.stats().dropped, 0u);
    world.remove(a);
    world.move(a, cube(3)); // too late
    const std::vector<ObjectId> ids{b};
    const std::vector<jostle::Aabb3f> boxes{cube(6)};
    world.update(ids, boxes);
    EXPECT_EQ(world.stats().commands, 3u);
    EXPECT_EQ(world.stats().dropped, 1u);
    world.update(ids, boxes);
    EXPECT_EQ(world.stats().commands, 1u);
    EXPECT_EQ(world.stats().changed, 0u) << "it was there";
    world.update();
    EXPECT_EQ(world.stats().commands, 0u);
}

TEST(World, CountsObjectsThatSeveralThreadsCommand)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(5)), c = world.add(cube(10));
    world.update();
    EXPECT_EQ(world.stats().contested, 0u);
    world.move(a, cube(1), 2);
    world.move(a, cube(2), 1); // overruled by its own thread
    world.move(c, cube(11));
    std::thread([&] { world.move(b, cube(6)); }).join();
    world.update();
    EXPECT_EQ(world.stats().contested, 0u) << "each object had one thread";
    EXPECT_EQ(world.box(a).lo[0], 1);

    std::thread other([&] {
        world.move(a, cube(20));
        world.move(b, cube(20));
    });
    other.join();
    world.move(a, cube(3), 1); // the greater sequence wins, also against one that came first
    const std::vector<ObjectId> ids{b, c};
    const std::vector<jostle::Aabb3f> boxes{cube(7), cube(12)};
    world.update(ids, boxes);
    EXPECT_EQ(world.stats().contested, 2u);
    EXPECT_NE(world.explain().find("2 objects had commands from several threads"), std::string::npos);
    EXPECT_EQ(world.box(a).lo[0], 3);
    EXPECT_TRUE(world.box(b).lo[0] == 7 || world.box(b).lo[0] == 20);
    EXPECT_EQ(world.box(c).lo[0], 12);
    world.update();
    EXPECT_EQ(world.stats().contested, 0u);
}

TEST(World, RestingObjectsCostNothingAndStillMeet)
{
    World3f world;
    std::vector<ObjectId> ids(1000);
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 1000; ++i)
        boxes.push_back(cube(static_cast<float>(2 * i)));
    world.add(boxes, ids);
    for (int i = 0; i < 10; ++i)
        world.update();
    EXPECT_EQ(world.stats().resting, 1000u);
    EXPECT_EQ(world.stats().candidates, 0u);
    world.move(ids[0], cube(2 * 500 + 1.0f));
    world.update();
    EXPECT_EQ(world.stats().changed, 1u);
    EXPECT_EQ(world.stats().woken, 0u);
    EXPECT_EQ(began(world), (Began{{ids[0], ids[500]}, {ids[0], ids[501]}}));
    EXPECT_LE(world.stats().candidates, 4u);
    world.move(ids[0], cube(2 * 600 + 1.0f));
    world.update();
    EXPECT_EQ(world.stats().woken, 1u);
    EXPECT_EQ(began(world), (Began{{ids[0], ids[600]}, {ids[0], ids[601]}}));
    EXPECT_EQ(world.stats().ended, 2u);
    EXPECT_LE(world.stats().candidates, 4u);
    EXPECT_EQ(world.stats().active, 1u);
}

TEST(World, NoUpdateWorksMuchMoreThanUsual)
{
    jostle_scenes::Scene<3, float> scene("uniform", 20'000, 1);
    World3f world;
    std::vector<ObjectId> ids(scene.boxes().size());
    world.add(scene.boxes(), ids);
    for (int i = 0; i < 200; ++i)
        world.update();
    ASSERT_EQ(world.stats().active, 0u);
    std::vector<ObjectId> movers;
    std::vector<jostle::Aabb3f> boxes;
    for (std::size_t i = 0; i < ids.size(); i += 50) {
        movers.push_back(ids[i]);
        boxes.push_back(scene.boxes()[i]);
    }
    std::vector<std::uint64_t> work;
    std::uint64_t listed = 0;
    for (int update = 0; update < 100; ++update) {
        for (std::size_t k = 0; k < boxes.size(); ++k) {
            const float by = 0.03f * static_cast<float>(k % 5) - 0.05f;
            boxes[k].lo[k % 3] += by;
            boxes[k].hi[k % 3] += by;
        }
        world.update(movers, boxes);
        if (update == 0) continue; // all wake up
        const jostle::WorldStats& s = world.stats();
        listed += s.listed;
        work.push_back(s.changed + s.candidates + s.settled +
                       32 * s.listed); // a list has about so many boxes
    }
    EXPECT_GT(listed, movers.size());
    std::sort(work.begin(), work.end());
    EXPECT_LE(work.back(), 3 * work[work.size() / 2]);
}

TEST(World, CountsTheIndexThatQuestionsMake)
{
    jostle_scenes::Scene<3, float> scene("uniform", 5'000, 1);
    World3f world;
    std::vector<ObjectId> ids(scene.boxes().size());
    world.add(scene.boxes(), ids);
    for (int step = 0; step < 4; ++step) {
        scene.step();
        world.update(ids, scene.boxes());
    }
    const std::uint64_t before = world.stats().bytes_reserved;
    EXPECT_GT(world.count(cube(0, 100)), 0u);
    world.update();
    EXPECT_GE(world.stats().bytes_reserved, before + 5'000 * sizeof(jostle::Aabb3f));
}

TEST(World, CountsAllThatItTookFromItsMemory)
{
    contract::CountingMemory memory;
    {
        jostle::WorldOptions options;
        options.executor = &jostle::serial_executor();
        options.memory = &memory;
        World3f world(options);
        world.update();
        const std::uint64_t own = world.stats().bytes_reserved - memory.bytes; // of the world object
        EXPECT_LT(own, 64u * 1024);
        std::vector<ObjectId> ids;
        for (int k = 0; k < 2000; ++k)
            ids.push_back(world.add(cube(static_cast<float>(k % 500) / 2)));
        for (int update = 0; update < 8; ++update) {
            world.move(ids[static_cast<std::size_t>(update)], cube(3));
            world.update();
            EXPECT_EQ(world.stats().bytes_reserved - memory.bytes, own);
            EXPECT_GT(world.count(cube(3)), 0u);
        }
        EXPECT_GT(memory.bytes, 2000 * sizeof(jostle::Aabb3f));
    }
    EXPECT_EQ(memory.bytes, 0u) << "all is given back";
}

TEST(World, ExplainsWhatMakesItSlow)
{
    jostle::WorldOptions options;
    bool is_against = true;
    options.accept = [&](ObjectId, ObjectId) { return !is_against; };
    World3f world(options);
    const auto says = [&](const char* words) { return world.explain().find(words) != std::string::npos; };
    std::vector<ObjectId> pile;
    for (int i = 0; i < 100; ++i)
        pile.push_back(world.add(cube(0)));
    world.update();
    EXPECT_TRUE(says("4950 touching pairs are refused by accept")) << world.explain();
    EXPECT_FALSE(says("Slow because"));
    EXPECT_FALSE(says("For a while"));
    EXPECT_FALSE(says("removed before their turn"));
    is_against = false;
    for (const ObjectId id : pile)
        world.report_again(id);
    world.update();
    world.move(pile[0], cube(0.25f));
    world.update();
    EXPECT_TRUE(says("objects that moved touch 99 others on average")) << world.explain();
    world.remove(pile[1]);
    world.update();
    // Another thread may remove an object while this one moves it.
    world.remove(pile[2]);
    world.move(pile[2], cube(0.5f));
    world.update();
    EXPECT_TRUE(says("1 commands were about objects that had been removed before their turn"))
        << world.explain();

    World3f many;
    std::vector<ObjectId> ids;
    for (int i = 0; i < 3000; ++i)
        ids.push_back(many.add(cube(static_cast<float>(3 * i))));
    for (const float by : {0.0f, 0.1f, 0.2f}) {
        for (std::size_t i = 0; i < ids.size(); ++i)
            many.move(ids[i], cube(static_cast<float>(3 * i) + by));
        many.update();
    }
    many.move(ids[0], cube(-3));
    many.update();
    EXPECT_NE(many.explain().find("objects stopped moving lately and come to rest bit by bit"),
              std::string::npos)
        << many.explain();
}

TEST(World, ExplainsAndDrawsItself)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0.5f)), c = world.add(cube(7));
    world.update();
    world.set_enabled(c, false);
    world.move(a, cube(0.25f));
    world.update();
    EXPECT_NE(world.explain().find("3 objects: "), std::string::npos) << world.explain();
    EXPECT_NE(world.explain().find("2 objects changed"), std::string::npos) << world.explain();
    int boxes = 0, off = 0, lines = 0;
    world.draw(
        [&](const jostle::Aabb3f&, jostle::DrawKind kind) {
            ++boxes;
            off += kind == jostle::DrawKind::disabled;
        },
        [&](const jostle::Vec3f& from, const jostle::Vec3f& to, jostle::DrawKind kind) {
            EXPECT_EQ(kind, jostle::DrawKind::persisted);
            EXPECT_EQ(from[0], 0.75f);
            EXPECT_EQ(to[0], 1.0f);
            ++lines;
        });
    EXPECT_EQ(boxes, 3);
    EXPECT_EQ(off, 1);
    EXPECT_EQ(lines, 1);
    EXPECT_TRUE(world.contains(b));

    // What is infinite both ways has no middle, and still there is one to draw to.
    constexpr float infinite = std::numeric_limits<float>::infinity();
    world.move(b, {{-infinite, 0, 0}, {infinite, 1, 1}});
    world.update();
    lines = 0;
    world.draw({}, [&](const jostle::Vec3f&, const jostle::Vec3f& to, jostle::DrawKind) {
        EXPECT_EQ(to[0], 0);
        ++lines;
    });
    EXPECT_EQ(lines, 1);
}

} // namespace
} // namespace world_tests
