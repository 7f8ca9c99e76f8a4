// SPDX-License-Identifier: MIT
// What users keep with objects and pairs: 64 bits for each object, and a slot for each pair.
#include <atomic>
#include <limits>
#include <thread>

#include "slot_twin.hpp"

namespace world_tests {
namespace {

constexpr std::uint32_t no_slot = jostle::World3f::no_slot;

template <int Dim, class T>
void follow_slots(std::uint64_t seed, double extent, std::size_t objects, jostle::Executor& executor)
{
    const bool callback = seed % 2 == 0;
    Churn<Dim, T> churn(seed, extent, callback, {.executor = &executor, .pair_slots = true});
    jostle::WorldOptions serial = churn.options;
    serial.executor = &jostle::serial_executor();
    SlotTwin twin;
    std::uint32_t most = 0;
    for (int update = 0; update < 60; ++update) {
        const std::uint32_t burst = update % 30 == 0   ? static_cast<std::uint32_t>(2 * objects)
                                    : update % 40 < 25 ? churn.random.below(30)
                                                       : 0;
        for (std::uint32_t k = 0; k < burst; ++k)
            churn.operate(objects);
        if (churn.random.below(4) == 0) churn.world->apply();
        if (callback && update % 10 == 9) {
            churn.questions_until_refusal = churn.random.below(3);
            try {
                churn.world->update();
                churn.questions_until_refusal = Churn<Dim, T>::never;
            } catch (const Refusal&) {
                churn.questions_until_refusal = Churn<Dim, T>::never;
                churn.asked = 0;
                churn.world->update();
            }
            churn.asked = 0;
            (void)churn.follow(false); // but for how often it was asked
            ASSERT_TRUE(world_tests::agree(*churn.world, churn.twin, false));
        } else {
            ASSERT_TRUE(churn.update(false)) << "seed " << seed << ", update " << update;
        }
        twin.update(churn.twin);
        ASSERT_TRUE(agree(*churn.world, twin, true)) << "seed " << seed << ", update " << update;
        most = std::max(most, churn.world->pair_slots_end());
        for (const auto& other : churn.beside) {
            other->update();
            ASSERT_TRUE(agree(*other, twin, true)) << "restored; seed " << seed << ", update " << update;
            ASSERT_EQ(other->save(), churn.world->save());
        }
        if (update % 20 == 19 && !callback) {
            churn.beside.clear();
            churn.beside.push_back(std::make_unique<jostle::World<Dim, T>>(serial));
            churn.beside[0]->restore(churn.world->save());
            ASSERT_TRUE(agree(*churn.beside[0], twin, false));
            churn.beside.push_back(std::make_unique<jostle::World<Dim, T>>(churn.world->fork()));
        }
    }
    EXPECT_GT(most, objects / 2);
    EXPECT_LT(most, churn.began) << "slots are used again";
}

TEST(Slots, AgreeWithTheDefinition)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        follow_slots<3, float>(seed, 5, 200, seed == 1 ? *threads : jostle::serial_executor());
        follow_slots<2, double>(seed, 8, 100, seed == 2 ? *threads : jostle::serial_executor());
    }
}

TEST(Slots, OfAWorldThatHasNone)
{
    jostle::World3f world;
    const ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}}), b = world.add({{0, 0, 0}, {1, 1, 1}});
    world.update();
    ASSERT_EQ(world.began().size(), 1u);
    EXPECT_TRUE(world.began_slots().empty() && world.ended_slots().empty() && world.changed_slots().empty());
    EXPECT_EQ(world.pair_slot(a.index, b.index), no_slot);
    EXPECT_EQ(world.pair_slots_end(), 0u);
    const std::vector<std::byte> saved = world.save();
    EXPECT_EQ(saved[8], std::byte{1}) << "a snapshot that older libraries read";

    jostle::World3f with({.pair_slots = true});
    with.restore(saved); // they get them
    EXPECT_EQ(with.pair_slot(a.index, b.index), 0u);
    EXPECT_EQ(with.pair_slots_end(), 1u);
    world.restore(with.save()); // and lose them
    EXPECT_EQ(world.pair_slot(a.index, b.index), no_slot);
    EXPECT_EQ(world.save(), saved);
}

TEST(Slots, AreForWhatFollowsTheEndOfAPair)
{
    jostle::World2f world({.pair_slots = true});
    const auto box = [](float x) { return jostle::Aabb2f{{x, 0}, {x + 1, 1}}; };
    const ObjectId a = world.add(box(0)), b = world.add(box(0.5f)), c = world.add(box(10)),
                   d = world.add(box(20));
    world.update();
    EXPECT_EQ(world.pair_slot(a.index, b.index), 0u);
    world.move(b, box(30));
    world.move(d, box(10.5f));
    world.update();
    EXPECT_EQ(world.ended_slots()[0], 0u);
    EXPECT_EQ(world.began_slots()[0], 1u) << "not what another has left in the same update";
    world.move(b, box(0.25f));
    world.report_again(c, d);
    world.update();
    ASSERT_EQ(world.began().size(), 2u);
    EXPECT_EQ(world.began_slots()[0], 0u);
    EXPECT_EQ(world.began_slots()[1], 1u) << "told again: the same";
    EXPECT_EQ(world.pair_slots_end(), 2u);
    world.clear();
    EXPECT_EQ(world.pair_slots_end(), 0u);
    EXPECT_EQ(world.pair_slot(a.index, b.index), no_slot);
}

TEST(UserData, StaysWithTheObjectUntilTheUpdateAfterItsRemoval)
{
    jostle::World3f world;
    const jostle::Aabb3f box{{0, 0, 0}, {1, 1, 1}};
    std::vector<ObjectId> ids(300);
    world.add(std::vector<jostle::Aabb3f>(300, box), ids, {.filter = {.owner = 1}});
    const ObjectId other = world.add(box, {.user_data = 77});
    EXPECT_EQ(world.user_data(other), 77u) << "at once";
    EXPECT_EQ(world.user_data(ids[5]), 0u);
    for (std::size_t i = 0; i < ids.size(); ++i)
        world.set_user_data(ids[i], std::numeric_limits<std::uint64_t>::max() - i);
    world.update();
    ASSERT_EQ(world.began().size(), 300u);
    for (const ObjectPair& pair : world.began())
        EXPECT_EQ(world.user_data(pair.a), std::numeric_limits<std::uint64_t>::max() - pair.a.index);
    world.remove(ids[7]);
    world.remove(ids[9]);
    world.apply();
    EXPECT_EQ(world.user_data(ids[7]), std::numeric_limits<std::uint64_t>::max() - 7);
    world.update();
    const ObjectId fresh = world.add(box, {.user_data = 5}); // in the place of one of them
    EXPECT_TRUE(fresh.index == ids[7].index || fresh.index == ids[9].index);
    ASSERT_EQ(world.ended().size(), 2u);
    for (const EndedPair& pair : world.ended())
        EXPECT_EQ(world.user_data(pair.a), std::numeric_limits<std::uint64_t>::max() - pair.a.index);
    EXPECT_EQ(world.user_data(fresh), 5u);
    EXPECT_THROW((void)world.user_data(ids[7].index == 7 ? ObjectId{7, 9} : ids[7]), jostle::Error);
    const ObjectId plain = world.add(box);
    EXPECT_EQ(world.user_data(plain), 0u) << "not that of who was there before";
    world.update();
    EXPECT_THROW((void)world.user_data(ids[7]), jostle::Error);
    EXPECT_THROW(world.set_user_data(ids[7], 1), jostle::Error);
    std::vector<std::uint64_t> all(ids.size());
    const std::vector<ObjectId> two = {other, fresh};
    world.user_data(two, std::span<std::uint64_t>(all.data(), 2));
    EXPECT_EQ(all[0], 77u);
    EXPECT_EQ(all[1], 5u);
    EXPECT_THROW(world.user_data(two, std::span<std::uint64_t>(all.data(), 3)), jostle::Error);
}

// Nobody has others than 0 here, which is what was set all the same.
TEST(UserData, IsZeroOfAnObjectThatIsRemovedAsOfOneThatIsThere)
{
    jostle::World3f world;
    const jostle::Aabb3f box{{0, 0, 0}, {1, 1, 1}};
    const ObjectId a = world.add(box), b = world.add(box);
    world.update();
    world.set_user_data(a, 0);
    world.remove(a);
    world.apply();
    world.update();
    ASSERT_EQ(world.ended().size(), 1u);
    EXPECT_EQ(world.user_data(world.ended()[0].a), 0u);
    EXPECT_EQ(world.user_data(b), 0u);
    world.update();
    EXPECT_THROW((void)world.user_data(a), jostle::Error);
}

TEST(UserData, IsInSnapshotsAndForks)
{
    Churn<3, double> churn(3, 6, false);
    for (int k = 0; k < 400; ++k)
        churn.operate(200);
    ASSERT_TRUE(churn.update());
    const std::vector<std::byte> none = churn.world->save();
    EXPECT_EQ(none[8], std::byte{1});
    std::map<std::uint32_t, std::uint64_t> data;
    for (const auto& [index, thing] : churn.twin.things)
        if (index % 3 != 0) churn.world->set_user_data(thing.id, data[index] = churn.random.next());
    const std::vector<std::byte> saved = churn.world->save();
    jostle::World3d other;
    other.restore(saved);
    EXPECT_EQ(other.save(), saved);
    const jostle::World3d fork = other.fork();
    for (const auto& [index, thing] : churn.twin.things) {
        EXPECT_EQ(other.user_data(thing.id), data[index]);
        EXPECT_EQ(fork.user_data(thing.id), data[index]);
        churn.world->set_user_data(thing.id, 0);
    }
    EXPECT_EQ(churn.world->save(), none) << "as if it had never been set";
    for (std::size_t cut = 0; cut < saved.size(); cut += 7)
        EXPECT_THROW(other.restore(std::span(saved).first(cut)), jostle::Error);
}

TEST(UserData, IsSetByManyThreadsAtATime)
{
    jostle::World3f world;
    std::vector<ObjectId> ids(20'000);
    world.add(std::vector<jostle::Aabb3f>(ids.size(), {{0, 0, 0}, {1, 1, 1}}), ids, {.enabled = false});
    std::vector<std::thread> threads;
    std::atomic<bool> updates{true};
    std::thread updating([&] {
        while (updates)
            world.update();
    });
    for (std::size_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (std::size_t i = t; i < ids.size(); i += 4)
                world.set_user_data(ids[i], i + 1);
        });
    for (std::thread& thread : threads)
        thread.join();
    updates = false;
    updating.join();
    for (std::size_t i = 0; i < ids.size(); ++i)
        ASSERT_EQ(world.user_data(ids[i]), i + 1);
}

} // namespace
} // namespace world_tests
