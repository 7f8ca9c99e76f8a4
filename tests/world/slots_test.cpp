// SPDX-License-Identifier: MIT
// What users keep with objects and pairs: 64 bits for each object, and a slot for each pair.
#include <atomic>
#include <limits>
#include <thread>

#include "slot_twin.hpp"
#include "snapshots.hpp"

namespace world_tests {
namespace {

using jostle::PairSlots;

template <int Dim, class T>
void follow_slots(std::uint64_t seed, double extent, std::size_t objects)
{
    const bool callback = seed % 2 == 0;
    Churn<Dim, T> churn(seed, extent, callback, {.executor = &jostle::serial_executor()});
    SlotTwin twin;
    PairSlots slots, restored;
    std::uint32_t most = 0;
    for (int update = 0; update < 60; ++update) {
        const std::uint32_t burst = update % 30 == 0   ? static_cast<std::uint32_t>(2 * objects)
                                    : update % 40 < 25 ? churn.random.below(30)
                                                       : 0;
        for (std::uint32_t k = 0; k < burst; ++k)
            churn.operate(objects);
        ASSERT_TRUE(churn.update(false)) << "seed " << seed << ", update " << update;
        twin.update(churn.twin);
        for (PairSlots* const each : {&slots, &restored}) {
            each->update(churn.world->began(), churn.world->ended());
            ASSERT_TRUE(agree(*each, twin, true)) << "seed " << seed << ", update " << update;
        }
        ASSERT_EQ(twin.of.size(), churn.world->pairs().size());
        most = std::max(most, slots.end());
        if (update % 20 != 19) continue;
        PairSlots fresh;
        fresh.restore(slots.save());
        ASSERT_TRUE(agree(fresh, twin, false));
        ASSERT_EQ(fresh.end(), slots.end());
        ASSERT_EQ(fresh.save(), slots.save());
        EXPECT_TRUE(fresh.began_slots().empty() && fresh.ended_slots().empty());
        restored = std::move(fresh);
    }
    EXPECT_GT(most, objects / 2);
    EXPECT_LT(most, churn.began) << "slots are used again";
}

TEST(Slots, AgreeWithTheDefinition)
{
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        follow_slots<3, float>(seed, 5, 200);
        follow_slots<2, double>(seed, 8, 100);
    }
}

TEST(Slots, AreForWhatFollowsTheEndOfAPair)
{
    jostle::World2f world;
    PairSlots slots;
    const auto box = [](float x) { return jostle::Aabb2f{{x, 0}, {x + 1, 1}}; };
    const ObjectId a = world.add(box(0)), b = world.add(box(0.5f)), c = world.add(box(10)),
                   d = world.add(box(20));
    const auto update = [&] {
        world.update();
        slots.update(world.began(), world.ended());
    };
    EXPECT_EQ(slots.slot_of(a.index, b.index), PairSlots::no_slot);
    EXPECT_EQ(slots.end(), 0u);
    update();
    EXPECT_EQ(slots.slot_of(b.index, a.index), 0u);
    world.move(b, box(30));
    world.move(d, box(10.5f));
    update();
    EXPECT_EQ(slots.ended_slots()[0], 0u);
    EXPECT_EQ(slots.began_slots()[0], 1u) << "not what another has left in the same update";
    EXPECT_EQ(slots.slot_of(a.index, b.index), PairSlots::no_slot);
    world.move(b, box(0.25f));
    world.report_again(c, d);
    update();
    ASSERT_EQ(world.began().size(), 2u);
    EXPECT_EQ(slots.began_slots()[0], 0u);
    EXPECT_EQ(slots.began_slots()[1], 1u) << "told again: the same";
    EXPECT_EQ(slots.end(), 2u);
}

constexpr ObjectPair pair_of_ids(std::uint32_t a, std::uint32_t b, std::uint32_t generation = 1)
{
    return {{a, generation}, {b, generation}};
}
constexpr EndedPair end_of(const ObjectPair& pair)
{
    return {pair.a, pair.b, EndReason::removed};
}

TEST(Slots, RefuseListsThatDontFitByTheNameOfAPair)
{
    PairSlots slots;
    const std::vector<ObjectPair> first{pair_of_ids(1, 2), pair_of_ids(1, 7)};
    slots.update(first, {});
    const Bytes before = slots.save();
    const auto refused = [&](const std::string& words, std::vector<ObjectPair> began,
                             const std::vector<ObjectPair>& gone, std::uint64_t at) {
        std::vector<EndedPair> ended;
        for (const ObjectPair& pair : gone)
            ended.push_back(end_of(pair));
        try {
            slots.update(began, ended);
            ADD_FAILURE() << words;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
            EXPECT_EQ(error.index(), at);
            EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
        }
        EXPECT_EQ(slots.save(), before);
        EXPECT_EQ(slots.began_slots().size(), 2u) << "nor are the lists others";
    };
    refused("pair of objects 2 (generation 1) and 3 (generation 1) is in its list twice",
            {pair_of_ids(2, 3), pair_of_ids(2, 3)}, {}, 1);
    refused("3 (generation 1) is in its list twice, or doesn't ascend",
            {pair_of_ids(2, 4), pair_of_ids(2, 3)}, {}, 1);
    refused("isn't one of two objects, the lesser index first", {pair_of_ids(4, 3)}, {}, 0);
    refused("isn't one of two objects", {pair_of_ids(3, 3)}, {}, 0);
    refused("isn't one of two objects", {pair_of_ids(3, 4, 0)}, {}, 0);
    refused("1 (generation 2) and 7 (generation 2) began, and another one with these indices hasn't ended",
            {pair_of_ids(1, 3), pair_of_ids(1, 7, 2)}, {}, 1);
    refused("3 (generation 1) ended, and never began", {pair_of_ids(2, 9)},
            {pair_of_ids(1, 2), pair_of_ids(1, 3)}, 1);
    refused("7 (generation 2) ended, and never began", {}, {pair_of_ids(1, 7, 2)}, 0);
    refused("twice", {}, {pair_of_ids(1, 2), pair_of_ids(1, 2)}, 1);
    refused("began and ended in one update", first, {pair_of_ids(1, 7)}, 0);
    slots.update({}, std::vector{end_of(first[1])});
    slots.update(std::vector{pair_of_ids(1, 7, 2)}, {});
    EXPECT_EQ(slots.slot_of(7, 1), 1u);
    EXPECT_THROW(PairSlots(nullptr), Error);
}

TEST(Slots, RefuseBytesThatArentTheirs)
{
    PairSlots slots;
    const std::vector<ObjectPair> first{pair_of_ids(1, 2), pair_of_ids(1, 7), pair_of_ids(4, 5)};
    slots.update(first, {});
    slots.update({}, std::vector{end_of(first[1])});
    const Bytes good = slots.save();
    ASSERT_EQ(good.size(), 48u + 8 + 3 * 16);
    PairSlots other;
    other.update(std::vector{pair_of_ids(8, 9)}, {});
    const Bytes own = other.save();
    const auto error_of_slots = [&](const Bytes& bytes) {
        return code_of("slots of pairs: ", [&] { other.restore(bytes); });
    };
    expect_refused_when_altered(good, error_of_slots);
    const auto expect_forgery_refused = [&](const char* words, std::size_t at, std::uint32_t number) {
        Bytes forged = good;
        write(forged, at, number);
        seal(forged);
        EXPECT_EQ(code_of(words, [&] { other.restore(forged); }), ErrorCode::bad_snapshot);
    };
    constexpr std::size_t pairs = 48 + 8, pair = 16;
    expect_forgery_refused("a slot is of no pair of objects", pairs, 2);
    expect_forgery_refused("a slot is of no pair of objects", pairs + 4, 0);
    expect_forgery_refused("a slot is of no pair of objects", pairs + pair, 1);
    expect_forgery_refused("a list is longer", 48, 4);
    expect_forgery_refused("more bytes follow", 48, 2);
    Bytes twice = good;
    std::copy_n(twice.begin() + pairs, pair, twice.begin() + pairs + 2 * pair);
    seal(twice);
    EXPECT_EQ(code_of("a pair has two slots", [&] { other.restore(twice); }), ErrorCode::bad_snapshot);
    EXPECT_EQ(code_of("this is a whole snapshot", [&] { other.restore(jostle::World3f().save()); }),
              ErrorCode::bad_snapshot);
    jostle::World3f world;
    EXPECT_EQ(code_of("these are slots of pairs", [&] { world.restore(good); }), ErrorCode::bad_snapshot);
    EXPECT_EQ(other.save(), own) << "what is refused changes nothing";
    other.restore(good);
    EXPECT_EQ(other.save(), good);
    other.update(std::vector{pair_of_ids(0, 3), pair_of_ids(0, 4)}, {});
    EXPECT_EQ(other.began_slots()[0], 1u) << "what was free";
    EXPECT_EQ(other.began_slots()[1], 3u);
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
