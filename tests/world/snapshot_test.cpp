// SPDX-License-Identifier: MIT
// Snapshots: exact, and refused when anything is wrong with them.
#include <cstring>

#include "snapshots.hpp"

namespace world_tests {
namespace {

template <int Dim, class T>
void go_on_after_restore(std::uint64_t seed, bool callback)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    Churn<Dim, T> churn(seed, 8, callback);
    for (int k = 0; k < 600; ++k)
        churn.operate(250);
    for (int update = 0; update < 30; ++update) {
        ASSERT_TRUE(churn.update(false));
        for (std::uint32_t k = churn.random.below(30); k > 0; --k)
            churn.operate(250);
    }
    ASSERT_TRUE(churn.update());
    const Bytes saved = churn.world->save();
    ASSERT_EQ(saved, churn.world->save());

    // Three that go on in the same way: the first, one restored, one forked from it; other threads.
    Churn<Dim, T> restored(seed, 8, callback, {.executor = threads.get()});
    (void)restored.world->add(random_box<Dim, T>(restored.random, 8)); // to be forgotten
    restored.world->restore(saved);
    EXPECT_EQ(restored.world->save(), saved);
    EXPECT_TRUE(restored.world->began().empty() && restored.world->persisted().empty());
    Churn<Dim, T> forked(seed, 8, callback);
    *forked.world = restored.world->fork();
    restored.twin = forked.twin = churn.twin;
    restored.random = forked.random = churn.random;
    if (callback) // the fork has the function of the world that it comes from
        *forked.world = [&] {
            jostle::World<Dim, T> own(forked.options);
            own.restore(saved);
            return own;
        }();
    for (int update = 0; update < 30; ++update) {
        const std::uint32_t commands = churn.random.below(update % 10 < 5 ? 30 : 2);
        (void)restored.random.below(2), (void)forked.random.below(2);
        for (std::uint32_t k = 0; k < commands; ++k)
            churn.operate(250), restored.operate(250), forked.operate(250);
        ASSERT_TRUE(churn.update(false));
        ASSERT_TRUE(restored.update(false)) << "restored, update " << update;
        ASSERT_TRUE(forked.update(false)) << "forked, update " << update;
        ASSERT_TRUE(same_results(*churn.world, *restored.world)) << update;
        ASSERT_TRUE(same_results(*churn.world, *forked.world)) << update;
    }
    EXPECT_TRUE((Questions<Dim, T>(restored, 1).agree()));
}

TEST(Snapshot, EveryLaterResultIsTheSameByteForByte)
{
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        go_on_after_restore<3, float>(seed, seed == 2);
        go_on_after_restore<2, float>(seed, seed == 2);
        go_on_after_restore<3, double>(seed, seed == 1);
        go_on_after_restore<2, double>(seed, seed == 1);
    }
}

// What a world remembers to be fast, such as which filters it has met, must not show.
TEST(Snapshot, TheOrderDoesNotDependOnFiltersOfThePast)
{
    jostle::World3f world;
    std::vector<jostle::ObjectId> resting, movers;
    const auto filter = [](std::uint32_t n) {
        jostle::ObjectFilter own;
        own.owner = n;
        return own;
    };
    for (std::uint32_t i = 0; i < 400; ++i) {
        const float x = static_cast<float>(i);
        // Every second object has a filter of its own, more of them than a world tells apart at a glance.
        resting.push_back(
            world.add({{x, 0, 0}, {x + 1, 1, 1}}, {.filter = i % 2 == 0 ? filter(i) : filter(7)}));
    }
    for (std::uint32_t i = 0; i < 40; ++i) {
        const float x = static_cast<float>(10 * i);
        movers.push_back(world.add({{x, 0.5F, 0}, {x + 4.5F, 2, 1}}));
    }
    for (int update = 0; update < 10; ++update)
        world.update();
    for (std::uint32_t i = 0; i < 400; ++i) // those of the first half are met again, under other numbers
        world.set_filter(resting[i], i % 2 == 0 ? filter(i + 1000) : filter(7));
    for (int update = 0; update < 10; ++update)
        world.update();
    ASSERT_GT(world.stats().resting, 390u);
    jostle::World3f fork = world.fork();
    for (int update = 1; update < 6; ++update) {
        for (jostle::World3f* each : {&world, &fork}) {
            for (std::uint32_t i = 0; i < movers.size(); ++i) {
                const float x = static_cast<float>(10 * i) + 0.01F * static_cast<float>(update);
                each->move(movers[i], {{x, 0.5F, 0}, {x + 4.5F, 2, 1}});
            }
            each->update();
        }
        EXPECT_GT(world.persisted().size(), 150u);
        ASSERT_TRUE(same_results(world, fork)) << update;
    }
}

TEST(Snapshot, WhatWasRefusedStaysRefused)
{
    bool answer = false;
    int asked = 0;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        ++asked;
        return answer;
    };
    jostle::World3f world(options), restored(options);
    const ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}}), b = world.add({{0, 0, 0}, {1, 1, 1}});
    world.update();
    restored.restore(world.save());
    EXPECT_EQ(restored.stats().refused, 1u);
    jostle::World3f forked = world.fork();
    answer = true; // too late
    for (jostle::World3f* each : {&world, &restored, &forked}) {
        asked = 0;
        each->move(a, {{0.5f, 0, 0}, {1, 1, 1}});
        each->update();
        EXPECT_EQ(asked, 0);
        EXPECT_TRUE(each->began().empty() && each->persisted().empty() && each->changed_pairs().empty() &&
                    each->began_pairs().empty());
        EXPECT_TRUE(each->pairs().empty());
        EXPECT_EQ(each->stats().refused, 1u);
        each->set_filter(b, {});
        each->update();
        EXPECT_EQ(asked, 1);
        EXPECT_EQ(each->began().size(), 1u);
        EXPECT_EQ(each->stats().refused, 0u);
    }
}

// What a world remembers of the neighbours of those that move is rebuilt when it is restored; one of them
// wakes up in the very next update.
TEST(Snapshot, ANeighbourThatWakesUpAtOnceIsFoundOnce)
{
    const auto cube = [](float x, float y) { return jostle::Aabb3f{{x, y, 0}, {x + 1, y + 1, 1}}; };
    jostle::World3f world;
    const ObjectId mover = world.add(cube(0, 0)), neighbour = world.add(cube(0.5f, 0));
    for (int k = 0; k < 200; ++k)
        (void)world.add(cube(static_cast<float>(2 * k), 50));
    for (int update = 0; update < 6; ++update)
        world.update();
    float x = 0;
    const auto move_on = [&](jostle::World3f& each) {
        each.move(mover, cube(x, 0));
        each.update();
    };
    for (int update = 0; update < 4; ++update) {
        x += 0.01f;
        move_on(world);
    }
    jostle::World3f restored;
    restored.restore(world.save());
    for (jostle::World3f* each : {&world, &restored}) {
        x = 0.05f;
        for (int update = 0; update < 4; ++update) {
            x += 0.01f;
            each->move(neighbour, cube(0.5f, 0.1f * static_cast<float>(update)));
            move_on(*each);
            EXPECT_TRUE(each->began().empty()) << update;
            EXPECT_EQ(each->persisted().to_vector(), (std::vector<Pair>{{mover.index, neighbour.index}}));
        }
    }
}

TEST(Snapshot, TheMarginIsThatOfTheWorldItIsOf)
{
    jostle::WorldOptions wide, none;
    wide.margin = 0.5;
    jostle::World3f world(wide), restored(none);
    const ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}});
    world.update();
    restored.restore(world.save());
    jostle::World3f forked = restored.fork();
    for (jostle::World3f* each : {&world, &restored, &forked}) {
        const ObjectId b = each->add({{2, 0, 0}, {3, 1, 1}});
        each->set_margin(a, 0.25f);
        each->update();
        EXPECT_EQ(each->margin(b), 0.5f);
        EXPECT_EQ(each->margin(a), 0.75f);
        EXPECT_EQ(each->began().size(), 1u) << "1 + 0.75 and 2 - 0.5";
    }
    EXPECT_EQ(restored.save(), world.save());
    EXPECT_EQ(forked.save(), world.save());
}

TEST(Snapshot, WhatIsQueuedIsntInIt)
{
    jostle::World3f world;
    const ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}});
    world.update();
    const Bytes before = world.save();
    world.move(a, {{5, 5, 5}, {6, 6, 6}});
    const ObjectId b = world.add({{0, 0, 0}, {1, 1, 1}});
    jostle::World3f other;
    other.restore(world.save());
    EXPECT_EQ(other.box(a).lo[0], 0);
    EXPECT_FALSE(other.contains(b));
    EXPECT_EQ(other.add({{0, 0, 0}, {1, 1, 1}}), b) << "not handed out yet, as far as this world knows";
    world.restore(before);
    world.update();
    EXPECT_EQ(world.size(), 1u);
    EXPECT_EQ(world.box(a).lo[0], 0);
}

/// A world with something of everything.
Bytes small_snapshot()
{
    jostle::WorldOptions options;
    options.accept = [](ObjectId, ObjectId b) { return b.index != 2; };
    jostle::World3f world(options);
    std::vector<ObjectId> ids(6);
    world.add(std::vector<jostle::Aabb3f>(6, jostle::Aabb3f{{0, 0, 0}, {1, 1, 1}}), ids);
    world.set_margin(ids[1], 0.5f);
    world.set_enabled(ids[3], false);
    world.update();
    world.remove(ids[4]);
    for (int k = 0; k < 5; ++k)
        world.update();
    world.move(ids[0], {{0, 0, 0}, {1, 1, 2}});
    world.update();
    EXPECT_GT(world.stats().refused, 0u);
    EXPECT_GT(world.stats().active, 0u);
    EXPECT_GT(world.stats().resting, 0u);
    return world.save();
}

ErrorCode error_of_restoring(jostle::World3f& world, const Bytes& bytes)
{
    return code_of("snapshot: ", [&] { world.restore(bytes); });
}

TEST(Snapshot, EveryAlteredByteAndEveryCutIsRefused)
{
    const Bytes good = small_snapshot();
    jostle::World3f world;
    const ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}});
    world.update();
    const Bytes own = world.save();
    expect_refused_when_altered(good, [&](const Bytes& bad) { return error_of_restoring(world, bad); });
    EXPECT_EQ(world.save(), own) << "a refused snapshot changes nothing";
    EXPECT_TRUE(world.contains(a));
    jostle::World2f flat;
    EXPECT_THROW(flat.restore(good), Error);
    world.restore(good);
    EXPECT_EQ(world.save(), good);
}

TEST(Snapshot, WhatHasSomethingBehindItsEndIsRefusedWhateverItsSizeSays)
{
    Bytes longer = small_snapshot();
    for (int k = 0; k < 8; ++k)
        longer.push_back({});
    seal_with_size(longer);
    jostle::World3f world;
    EXPECT_EQ(error_of_restoring(world, longer), ErrorCode::bad_snapshot);
}

// Without objects nothing else tells worlds apart.
TEST(Snapshot, OfAnotherKindOfWorldIsRefusedEvenIfItIsEmpty)
{
    const Bytes of_3f = jostle::World3f().save();
    jostle::World3f same_kind;
    EXPECT_NO_THROW(same_kind.restore(of_3f));
    jostle::World3d of_doubles;
    EXPECT_THROW(of_doubles.restore(of_3f), Error);
    jostle::World2f flat;
    EXPECT_THROW(flat.restore(of_3f), Error);
    EXPECT_THROW(same_kind.restore(jostle::World3d().save()), Error);
}

TEST(Snapshot, ListsThatLieAreRefused)
{
    jostle::World3f world;
    std::vector<ObjectId> ids(6);
    world.add(std::vector<jostle::Aabb3f>(6, jostle::Aabb3f{{11, 0, 0}, {12, 1, 1}}), ids);
    world.update();
    world.remove(ids[4]);
    world.remove(ids[5]);
    for (std::size_t i = 0; i < 4; ++i)
        world.move(ids[i], {{11, 0, 0}, {13, 1, 1}});
    world.update();
    const Bytes good = world.save();
    ASSERT_EQ(world.stats().active, 4u);
    // At the end: two free indices, four active objects, no refused pair; each list with its length in front.
    const std::size_t refused = good.size() - 8, active = refused - 4 * 8, free = active - 8 - 2 * 8;
    const auto expect_refused = [&](const char* what, const auto& change) {
        Bytes bad = good;
        change(bad);
        ASSERT_NE(bad, good) << what;
        seal(bad);
        jostle::World3f other;
        EXPECT_EQ(error_of_restoring(other, bad), ErrorCode::bad_snapshot) << what;
    };
    expect_refused("an active object that is there twice",
                   [&](Bytes& bad) { std::copy_n(&good[active], 4, &bad[active + 8]); });
    expect_refused("active objects in another order", [&](Bytes& bad) {
        std::swap_ranges(&bad[active], &bad[active + 8], &bad[active + 8]);
        bad[active + 4] = std::byte{1}; // however long they have been idle
    });
    expect_refused("a free index that is there twice",
                   [&](Bytes& bad) { std::copy_n(&good[free], 4, &bad[free + 8]); });
    expect_refused("a free index with an object", [&](Bytes& bad) { write(bad, free, std::uint32_t{0}); });
    for (const std::size_t length : {free - 8, active - 8, refused})
        for (const std::uint64_t claimed :
             {std::uint64_t{1} << 40, std::uint64_t{1} << 62, ~std::uint64_t{0}})
            expect_refused("a length", [&](Bytes& bad) { write(bad, length, claimed); });
    expect_refused("a box that is inside out", [&](Bytes& bad) {
        const std::uint32_t thirteen = 0x41500000, ten = 0x41200000;
        for (std::size_t at = 0; at + 4 <= bad.size(); ++at)
            if (std::memcmp(&bad[at], &thirteen, 4) == 0) return write(bad, at, ten);
    });
}

TEST(Snapshot, AnIndexIsRetiredWhereItsIdsWouldHave54Bits)
{
    constexpr jostle::Aabb3f box{{0, 0, 0}, {1, 1, 1}};
    constexpr std::uint32_t last = (1u << 21) - 1;
    jostle::World3f world;
    const ObjectId a = world.add(box);
    world.update();
    world.remove(a);
    world.update();
    Bytes bytes = world.save();
    const std::size_t free = bytes.size() - 8 - 8 - 8; // one, and neither an active object nor a refused pair
    const auto with_generation = [&](Bytes of, std::size_t at, std::uint32_t generation) {
        write(of, at, generation);
        seal(of);
        return of;
    };
    world.restore(with_generation(bytes, free + 4, last));
    const ObjectId oldest = world.add(box);
    EXPECT_EQ(oldest, (ObjectId{0, last}));
    world.update();
    const Bytes with_oldest = world.save();
    world.remove(oldest);
    world.update();
    EXPECT_EQ(world.add(box), (ObjectId{1, 1}));
    world.update();
    const Bytes retired = world.save();
    world.restore(retired);
    EXPECT_EQ(world.add(box), (ObjectId{2, 1}));

    EXPECT_EQ(error_of_restoring(world, with_generation(bytes, free + 4, last + 1)), ErrorCode::bad_snapshot);
    // Behind the header, the margin and the number of indices.
    const std::size_t record = 48 + 4 + 8;
    EXPECT_EQ(with_generation(with_oldest, record, last), with_oldest);
    EXPECT_EQ(error_of_restoring(world, with_generation(with_oldest, record, last + 1)),
              ErrorCode::bad_snapshot);
}

TEST(Snapshot, WhoeverKnowsTheChecksumDoesNoHarmEither)
{
    const Bytes good = small_snapshot();
    Bytes resealed = good;
    seal(resealed);
    ASSERT_EQ(resealed, good);
    Random random(3);
    int refused = 0, taken = 0;
    for (int k = 0; k < 6000; ++k) {
        Bytes bad = good;
        for (std::uint32_t n = 1 + random.below(2); n > 0; --n)
            bad[random.below(static_cast<std::uint32_t>(bad.size()))] =
                static_cast<std::byte>(random.below(256));
        seal(bad);
        jostle::World3f world;
        try {
            world.restore(bad);
        } catch (const Error&) {
            ++refused;
            continue;
        }
        ++taken; // another filter, or another box: whatever it says is possible
        for (std::uint32_t i = 0; i < world.index_end(); ++i)
            if (world.contains(world.id(i))) world.move(world.id(i), {{0, 0, 0}, {2, 2, 2}});
        (void)world.add({{0, 0, 0}, {1, 1, 1}});
        world.update();
        (void)world.pairs();
    }
    EXPECT_GT(refused, 1000);
    EXPECT_GT(taken, 1000);
}

} // namespace
} // namespace world_tests
