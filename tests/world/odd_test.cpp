// SPDX-License-Identifier: MIT
// Boxes that are none, in a world that takes them: they touch nothing, and are whole again with a good one.
#include <cstring>
#include <functional>
#include <thread>

#include "events.hpp"
#include "questions.hpp"

namespace world_tests {
namespace {

using jostle::World3f;
using Box = Aabb<3, float>;

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float endless = std::numeric_limits<float>::infinity();
constexpr float greatest = std::numeric_limits<float>::max();

const Box odd_boxes[] = {
    {{not_a_number, 0, 0}, {1, 1, 1}},
    {{0, 0, 0}, {1, not_a_number, 1}},
    {{0, 0, 1}, {1, 1, 0}},
    {{greatest, greatest, greatest}, {-greatest, -greatest, -greatest}},
    {{endless, 0, 0}, {-endless, 1, 1}},
};

template <int Dim, class T>
void churn(std::uint64_t seed, double extent, std::size_t objects, bool callback, double margin,
           jostle::Executor& executor, bool many_voices)
{
    Churn<Dim, T> churn(seed, extent, callback,
                        {.executor = &executor, .margin = margin, .ignore_odd_boxes = true});
    std::uint64_t odd = 0;
    if (many_voices) // each object is spoken of by one of two threads, so that there are several queues
        churn.dispatch = [](ObjectId id, std::function<void()> call) {
            if (id.index % 2 == 0)
                std::thread(call).join();
            else
                call();
        };
    for (int update = 0; update < 100; ++update) {
        const std::uint32_t commands = update == 0         ? static_cast<std::uint32_t>(2 * objects)
                                       : update % 25 == 24 ? static_cast<std::uint32_t>(objects)
                                       : update % 40 < 25  ? churn.random.below(20)
                                                           : 0;
        if (callback && update % 16 == 15) churn.twin.salt = churn.random.next();
        for (std::uint32_t k = 0; k < commands; ++k) {
            churn.operate(objects);
            if (k % 8 == 7 && update % 3 == 0) churn.world->apply();
        }
        if (update % 7 == 3) churn.world->apply();
        ASSERT_TRUE(churn.update(update % 4 == 0)) << "seed " << seed << ", update " << update;
        odd += churn.world->stats().odd;
        if (update % 8 == 0) {
            Questions<Dim, T> questions(churn, static_cast<std::uint64_t>(update));
            ASSERT_TRUE(questions.agree()) << "seed " << seed << ", update " << update;
        }
        if (update % 10 == 5) { // and as a world that was restored
            const std::vector<std::byte> saved = churn.world->save();
            auto other = std::make_unique<jostle::World<Dim, T>>(churn.options);
            other->restore(saved);
            ASSERT_EQ(other->save(), saved);
            ASSERT_EQ(other->stats().odd, churn.world->stats().odd);
            ASSERT_EQ(other->stats().disabled, churn.world->stats().disabled);
            churn.world = std::move(other);
        }
    }
    EXPECT_GT(odd, objects);
    EXPECT_GT(churn.began, objects);
    EXPECT_GT(churn.ended[static_cast<int>(EndReason::disabled)], 0u);
}

TEST(OddBoxes, AgreeWithTheTwin)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        jostle::Executor& executor = seed == 3 ? *threads : jostle::serial_executor();
        churn<3, float>(seed, 6, 200, seed % 2 == 0, 0, executor, false);
        churn<2, double>(seed, 12, 150, seed % 2 == 1, 0.125, executor, seed == 2);
        churn<2, float>(seed, 5, 40, false, 0, executor, seed == 1);
    }
}

TEST(OddBoxes, AsQuestionsFindNothing)
{
    World3f world({.ignore_odd_boxes = true}), strict;
    const ObjectId id = world.add(cube(0));
    strict.add(cube(0));
    world.update();
    strict.update();
    for (const Box& odd : odd_boxes) {
        std::vector<ObjectId> found;
        std::vector<Hit<float, ObjectId>> hits;
        EXPECT_FALSE(world.all(odd, found));
        EXPECT_TRUE(found.empty());
        EXPECT_FALSE(world.any(odd));
        EXPECT_EQ(world.count(jostle::Sweep3f{odd, {1, 0, 0}}), 0u);
        EXPECT_FALSE(world.first(jostle::Sweep3f{odd, {0, 0, 0}}));
        world.nearest(jostle::NearestToBox3f{odd}, hits);
        EXPECT_TRUE(hits.empty());
        std::pmr::vector<jostle::Pair> pairs;
        const std::vector<Box> boxes{odd, cube(0), odd};
        world.join(boxes, pairs);
        EXPECT_EQ(pairs, (std::pmr::vector<jostle::Pair>{{1, id.index}}));
        const auto nobody = [](std::uint32_t, ObjectId) { return true; };
        EXPECT_TRUE(world.join(boxes, nobody));
        EXPECT_THROW((void)strict.any(odd), jostle::Error);
        EXPECT_THROW(strict.join(boxes, pairs), jostle::Error);
        EXPECT_THROW(strict.join(boxes, nobody), jostle::Error);
    }
}

TEST(OddBoxes, TouchNothingAndAreWholeAgain)
{
    for (const Box& odd : odd_boxes)
        for (const int updates_at_rest : {0, 8}) {
            World3f world({.ignore_odd_boxes = true});
            const ObjectId a = world.add(cube(0)), b = world.add(cube(0.5f)), c = world.add(odd);
            world.update();
            EXPECT_EQ(world.began().size(), 1u);
            EXPECT_EQ(world.stats().odd, 1u);
            EXPECT_TRUE(world.contains(c));
            for (int k = 0; k < updates_at_rest; ++k)
                world.update();
            world.move(a, odd);
            world.update();
            ASSERT_EQ(world.ended().size(), 1u);
            EXPECT_EQ(world.ended()[0], (EndedPair{a, b, EndReason::moved_apart}));
            EXPECT_EQ(world.stats().odd, 2u);
            EXPECT_EQ(world.stats().disabled, 0u);
            EXPECT_TRUE(world.enabled(a));
            const Box kept = world.box(a), bounds = world.bounds(a);
            EXPECT_EQ(std::memcmp(&kept, &odd, sizeof odd), 0) << "it isn't the box that was given";
            EXPECT_NE(bounds.lo[0], bounds.lo[0]);
            std::vector<ObjectId> found;
            world.touching(a, found);
            EXPECT_TRUE(found.empty());
            world.all(Box{{-endless, -endless, -endless}, {endless, endless, endless}}, found);
            EXPECT_EQ(found, std::vector<ObjectId>{b});
            EXPECT_EQ(world.bounds()->hi[0], 1.5f);
            std::size_t drawn = 0;
            world.draw([&](const Box&, jostle::DrawKind) { ++drawn; },
                       [&](const auto&, const auto&, jostle::DrawKind) { ++drawn; });
            EXPECT_EQ(drawn, 1u);
            EXPECT_NE(world.explain().find("2 with odd boxes"), std::string::npos) << world.explain();

            world.set_enabled(a, false); // disabled, and with an odd box
            world.update();
            EXPECT_EQ(world.stats().odd, 1u);
            EXPECT_EQ(world.stats().disabled, 1u);
            EXPECT_TRUE(world.ended().empty());
            world.resize(a, {1, 1, 1});
            world.set_enabled(a, true);
            world.update();
            EXPECT_EQ(world.stats().odd, 2u) << "resize has made a box of it";

            world.move(a, cube(0));
            world.move(c, cube(0.75f));
            world.update();
            EXPECT_EQ(world.began().size(), 3u);
            EXPECT_EQ(world.stats().odd, 0u);
        }
}

/// In one call, as hosts hand over many.
TEST(OddBoxes, AmongMovesInPlace)
{
    World3f world({.ignore_odd_boxes = true}), plain;
    std::vector<ObjectId> ids(40), same(40);
    std::vector<Box> boxes;
    for (int k = 0; k < 40; ++k)
        boxes.push_back(cube(0.75f * static_cast<float>(k)));
    world.add(std::span<const Box>(boxes), ids);
    plain.add(std::span<const Box>(boxes), same);
    world.update();
    plain.update();
    EXPECT_EQ(world.began().size(), 39u);
    boxes[7] = odd_boxes[0];
    boxes[20] = odd_boxes[3];
    world.update(ids, std::span<const Box>(boxes));
    EXPECT_EQ(world.ended().size(), 4u);
    EXPECT_EQ(world.stats().odd, 2u);
    EXPECT_THROW(plain.update(same, std::span<const Box>(boxes)), jostle::Error);
    EXPECT_EQ(plain.stats().odd, 0u);
    boxes[7] = cube(0.75f * 7);
    world.update(ids, std::span<const Box>(boxes));
    EXPECT_EQ(world.began().size(), 2u);
    EXPECT_EQ(world.stats().odd, 1u);
    plain.update(std::span(same).first(20),
                 std::span<const Box>(boxes).first(20)); // after the Error, it is as it was
    EXPECT_EQ(plain.began().size() + plain.ended().size(), 0u);
}

TEST(OddBoxes, AnErrorUnlessAskedFor)
{
    World3f world;
    const ObjectId a = world.add(cube(0));
    world.update();
    for (const Box& odd : odd_boxes) {
        EXPECT_THROW((void)world.add(odd), jostle::Error);
        EXPECT_THROW(world.move(a, odd), jostle::Error);
        EXPECT_THROW(world.move(a, cube(0), {not_a_number, 0, 0}), jostle::Error);
    }
    EXPECT_THROW((void)world.any(jostle::Sweep3f{cube(0), {0, 0, 0}}), jostle::Error);
}

/// What was odd in a world that takes odd boxes stays odd in one that doesn't, until it is given a good one.
TEST(OddBoxes, GoWithTheSnapshot)
{
    World3f world({.margin = 0.25, .ignore_odd_boxes = true});
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0.5f)), c = world.add(cube(3));
    world.update();
    world.move(a, odd_boxes[2]); // with the margin it would be a box
    world.move(c, cube(3), {endless, -endless, not_a_number});
    world.set_enabled(c, false);
    world.update();
    EXPECT_EQ(world.stats().odd, 1u);
    EXPECT_EQ(world.ended().size(), 1u);
    World3f strict;
    strict.restore(world.save());
    EXPECT_EQ(strict.save(), world.save());
    EXPECT_EQ(strict.stats().odd, 1u);
    strict.set_enabled(c, true);
    strict.update();
    EXPECT_EQ(strict.stats().odd, 2u);
    EXPECT_THROW(strict.move(a, odd_boxes[0]), jostle::Error);
    strict.move(a, cube(1));
    strict.move(c, cube(1));
    strict.update();
    EXPECT_EQ(strict.began().size(), 3u);
    EXPECT_EQ(strict.stats().odd, 0u);
    EXPECT_EQ(strict.id(b.index), b);
    // Without odd boxes there is nothing of them in a snapshot.
    World3f plain;
    (void)plain.add(cube(0));
    plain.update();
    EXPECT_EQ(plain.save()[8], std::byte{1});
    EXPECT_EQ(world.save()[8], std::byte{3});
}

} // namespace
} // namespace world_tests
