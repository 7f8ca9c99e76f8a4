// SPDX-License-Identifier: MIT
// No memory in steady updates; and when there is none at all, the world stays unchanged.
#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory_resource>
#include <thread>

#include "churn.hpp"
#include "jostle/contact.hpp"
#include "jostle/pair_slots.hpp"
#include "tests/global_new.hpp"
#include "tool/scenes/scenes.hpp"
#include "world/update/arena.hpp"

#if JOSTLE_OWN_NEW
namespace world_tests {
namespace {

/// Calls `call` with less and less memory, then with enough. After each failure calls `check`.
template <class Call, class Check>
std::uint64_t starve(const Call& call, const Check& check)
{
    for (std::uint64_t k = 0;; ++k) {
        bool failed = false;
        global_new::fail_at = global_new::calls + k;
        try {
            call();
        } catch (const std::bad_alloc&) {
            failed = true;
        }
        global_new::fail_at = global_new::never;
        if (!failed) return k;
        check(k);
        if (testing::Test::HasFatalFailure() || k > 20'000) return global_new::never;
    }
}

struct Lists
{
    std::vector<ObjectPair> began;
    std::vector<EndedPair> ended;
    std::vector<Pair> persisted;
    std::vector<std::byte> saved;
    template <int Dim, class T>
    explicit Lists(const jostle::World<Dim, T>& world)
        : began(world.began().begin(), world.began().end()),
          ended(world.ended().begin(), world.ended().end()),
          persisted(world.persisted().to_vector()),
          saved(world.save())
    {
    }
    friend bool operator==(const Lists&, const Lists&) = default;
};

template <int Dim, class T>
void starve_updates(jostle::Executor& executor, bool callback)
{
    Churn<Dim, T> churn(3, 9, callback, {.executor = &executor});
    std::uint64_t failures = 0;
    for (int update = 0; update < 24; ++update) {
        for (int k = update == 0 ? 500 : update % 6 * 4; k > 0; --k)
            churn.operate(300);
        const Lists before(*churn.world);
        failures += starve([&] { churn.world->update(); },
                           [&](std::uint64_t k) {
                               ASSERT_TRUE(Lists(*churn.world) == before) << "update " << update << ", " << k;
                           });
        churn.twin.update();
        ASSERT_TRUE(agree(*churn.world, churn.twin)) << update;
    }
    EXPECT_GT(failures, 30u);
}

TEST(Memory, AFailedUpdateLeavesTheWorldAsItWas)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    starve_updates<3, float>(jostle::serial_executor(), false);
    starve_updates<2, double>(jostle::serial_executor(), true);
    starve_updates<3, float>(*threads, true);
}

TEST(Memory, AFailedUpdateOfWhatIsKeptWithObjects)
{
    jostle::World3f world({.executor = &jostle::serial_executor()});
    const auto box = [](float x) { return jostle::Aabb3f{{x, 0, 0}, {x + 1, 1, 1}}; };
    std::vector<ObjectId> loners;
    for (int k = 0; k < 100; ++k) {
        loners.push_back(world.add(box(static_cast<float>(3 * k))));
        world.set_user_data(loners.back(), 7);
    }
    world.update();
    // The loners come to rest in the update that makes room for what was kept with the removed.
    for (int k = 0; k < 200; ++k)
        for (int twice = 0; twice < 2; ++twice)
            world.add(box(static_cast<float>(1000 + 3 * k)));
    for (int k = 0; k < 40; ++k)
        world.remove(loners[static_cast<std::size_t>(k)]);
    const Lists before(world);
    const std::uint64_t failed =
        starve([&] { world.update(); }, [&](std::uint64_t k) { ASSERT_TRUE(Lists(world) == before) << k; });
    EXPECT_GT(failed, 5u);
    EXPECT_EQ(world.stats().settled, 60u);
    EXPECT_EQ(world.began().size(), 200u);
    std::vector<ObjectId> found;
    EXPECT_FALSE(world.all(jostle::Aabb3f{{-1, -1, -1}, {5000, 5, 5}}, found));
    EXPECT_EQ(found.size(), 460u) << "nobody is found twice";
    world.update();
    EXPECT_EQ(world.pairs().size(), 200u);
    EXPECT_EQ(world.user_data(loners[99]), 7u);
}

// Up to some hundred answers are found on the stack; more in memory of the lists, if these have some of their
// own.
TEST(Memory, ListsOfAnswersTakeNoneBesideTheirOwn)
{
    const auto run_one_by_one = [](void*, std::uint32_t count, void (*task)(void*, std::uint32_t),
                                   void* context) {
        for (std::uint32_t i = 0; i < count; ++i)
            task(context, i);
    };
    jostle::CallbackExecutor four(4, nullptr, run_one_by_one);
    jostle::World3f world({.executor = &jostle::serial_executor()}), by_four({.executor = &four});
    std::vector<jostle::Aabb3f> row;
    for (int i = 0; i < 2000; ++i)
        row.push_back({{static_cast<float>(i), 0, 0}, {static_cast<float>(i) + 1, 1, 1}});
    std::vector<ObjectId> ids(row.size());
    for (jostle::World3f* each : {&world, &by_four}) {
        each->add(row, ids);
        each->update();
        each->update();
    }
    const auto first = [](float count) { return jostle::Aabb3f{{0, 0, 0}, {count - 0.5f, 1, 1}}; };
    std::vector<jostle::Aabb3f> regions;
    for (int i = 0; i < 200; ++i)
        regions.push_back(first(static_cast<float>(i + 50)));
    const std::vector<jostle::Nearest3f> near(100, {{1000, 0, 0}, 250});
    std::vector<std::byte> bytes(std::size_t{1} << 26);
    std::pmr::monotonic_buffer_resource own(bytes.data(), bytes.size(), std::pmr::null_memory_resource());
    jostle::ResultLists<ObjectId> found, found_by_four(&own);
    jostle::ResultLists<jostle::Hit<float, jostle::ObjectId>> nearest, nearest_by_four(&own);
    std::vector<ObjectId> one(256), others(8);
    std::vector<jostle::Hit<float, jostle::ObjectId>> hits(250);
    const auto ask = [&] {
        world.all(first(256), one);
        world.nearest(near[0], hits);
        world.touching(ids[5], others);
        world.all(regions, found);
        world.nearest(near, nearest);
        by_four.all(regions, found_by_four);
        by_four.nearest(near, nearest_by_four);
    };
    ask();
    const std::uint64_t before = global_new::calls;
    ask();
    ask();
    EXPECT_EQ(global_new::calls, before);
    EXPECT_EQ(one.size(), 256u);
    EXPECT_EQ(others, (std::vector<ObjectId>{ids[4], ids[6]}));
    for (std::size_t i = 0; i < regions.size(); ++i) {
        EXPECT_TRUE(std::ranges::equal(found[i], std::span(ids).first(i + 50)));
        EXPECT_TRUE(std::ranges::equal(found_by_four[i], found[i]));
    }
    for (std::size_t i = 0; i < near.size(); ++i) {
        EXPECT_TRUE(std::ranges::equal(nearest[i], hits));
        EXPECT_TRUE(std::ranges::equal(nearest_by_four[i], hits));
    }
    // More than the stack has room for: from the lists' own memory.
    const std::vector<jostle::Aabb3f> long_ones(100, first(2000));
    by_four.all(long_ones, found_by_four);
    const std::uint64_t before_long_ones = global_new::calls;
    by_four.all(long_ones, found_by_four);
    EXPECT_EQ(global_new::calls, before_long_ones);
    EXPECT_TRUE(std::ranges::equal(found_by_four[99], ids));
    world.all(first(2000), one);
    EXPECT_EQ(one, ids);
}

// Both the view and the world that it follows, while others move in turn, with pairs that `accept` refuses.
TEST(Memory, SteadyFollowingAllocatesNothing)
{
    jostle::WorldOptions options;
    options.executor = &jostle::serial_executor();
    options.accept = [](ObjectId a, ObjectId) { return a.index % 2 == 0; };
    jostle::World3f world(options), view(options);
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 2000; ++i) {
        const float x = static_cast<float>(i % 50) * 1.5f, y = static_cast<float>(i / 50) * 0.9f;
        boxes.push_back({{x, y, 0}, {x + 1, y + 1, 1}});
    }
    std::vector<ObjectId> ids(boxes.size());
    world.add(boxes, ids);
    std::uint64_t calls = 0;
    for (std::size_t frame = 0; frame < 1200; ++frame) {
        if (frame == 800) calls = global_new::calls;
        const std::size_t first = frame / 2 % 20 * 100; // there and back
        const float by = frame % 2 == 0 ? 0.1f : -0.1f;
        for (std::size_t i = first; i < first + 100; ++i) {
            boxes[i].lo[0] += by;
            boxes[i].hi[0] += by;
        }
        world.update(std::span(ids).subspan(first, 100),
                     std::span<const jostle::Aabb3f>(boxes).subspan(first, 100));
        view.follow(world);
    }
    EXPECT_EQ(global_new::calls - calls, 0u);
    EXPECT_EQ(view.size(), 2000u);
    EXPECT_GT(world.stats().refused, 100u);
    EXPECT_EQ(view.stats().refused, world.stats().refused);
}

// A new one is a world as before; one that has followed before is empty.
TEST(Memory, AFailedFollowIsTriedAgain)
{
    Churn<3, float> churn(6, 9, true);
    for (int update = 0; update < 8; ++update) {
        for (int k = update == 0 ? 700 : 30; k > 0; --k)
            churn.operate(400);
        ASSERT_TRUE(churn.update(false));
    }
    jostle::World3f view;
    const ObjectId own = view.add({{0, 0, 0}, {1, 1, 1}});
    view.update();
    std::uint64_t failed = starve([&] { view.follow(*churn.world); },
                                  [&](std::uint64_t k) { ASSERT_TRUE(view.contains(own)) << k; });
    for (int round = 0; round < 4; ++round) {
        for (int k = round % 2 == 0 ? 500 : 20; k > 0; --k)
            churn.operate(600);
        ASSERT_TRUE(churn.update(false));
        failed += starve([&] { view.follow(*churn.world); },
                         [&](std::uint64_t k) {
                             ASSERT_EQ(view.size(), 0u) << k;
                             ASSERT_FALSE(view.bounds()) << k;
                             ASSERT_TRUE(view.pairs().empty()) << k;
                         });
        ASSERT_EQ(view.size(), churn.world->size());
        ASSERT_EQ(view.pairs().to_vector(), churn.world->pairs().to_vector()) << round;
        ASSERT_EQ(view.bounds()->lo, churn.world->bounds()->lo);
    }
    EXPECT_GT(failed, 20u);
}

TEST(Memory, AFailedCommandQueuesNothing)
{
    jostle::World3f world;
    std::vector<ObjectId> ids(300);
    const std::vector<jostle::Aabb3f> boxes(300, {{0, 0, 0}, {1, 1, 1}});
    starve([&] { world.add(boxes, ids); }, [&](std::uint64_t) { world.update(); });
    EXPECT_EQ(world.size(), 0u);
    world.update();
    EXPECT_EQ(world.size(), 300u);
    EXPECT_EQ(ids[299].index, 299u) << "no id was lost";
    const std::vector<jostle::Aabb3f> there(300, {{5, 5, 5}, {6, 6, 6}});
    std::uint64_t failed = starve([&] { world.move(ids, there); },
                                  [&](std::uint64_t) {
                                      world.update();
                                      ASSERT_EQ(world.stats().commands, 0u);
                                  });
    failed += starve([&] { world.remove(ids); }, [&](std::uint64_t) {});
    EXPECT_GT(failed, 0u);
    world.update();
    EXPECT_EQ(world.stats().commands, 600u);
    EXPECT_EQ(world.size(), 0u);
}

TEST(Memory, AFailedQuestionOrSnapshotChangesNothing)
{
    Churn<3, float> churn(4, 9, false);
    for (int k = 0; k < 500; ++k)
        churn.operate(300);
    ASSERT_TRUE(churn.update());
    const std::vector<std::byte> saved = churn.world->save();
    const auto unchanged = [&](std::uint64_t) { ASSERT_EQ(churn.world->save(), saved); };
    const jostle::Ray<3, float> ray{{0, 0, 0}, {1, 1, 1}};
    std::vector<jostle::Hit<float, jostle::ObjectId>> hits;
    EXPECT_GT(starve([&] { (void)churn.world->all(ray, hits); }, unchanged), 0u);
    EXPECT_FALSE(hits.empty());
    EXPECT_GT(starve([&] { (void)churn.world->pairs(); }, unchanged), 0u);
    jostle::World3f pair; // whose list nobody has asked for yet
    pair.add({{0, 0, 0}, {1, 1, 1}}), pair.add({{0, 0, 0}, {1, 1, 1}});
    for (int k = 1; k < 1000; ++k) // more than have room in what a world has of itself
        pair.add({{static_cast<float>(2 * k), 0, 0}, {static_cast<float>(2 * k + 1), 1, 1}});
    pair.update();
    EXPECT_GT(starve([&] { (void)pair.began_pairs(); }, unchanged), 0u);
    EXPECT_EQ(pair.began_pairs().to_vector(), (std::vector<Pair>{{0, 1}}));
    EXPECT_GT(starve([&] { (void)pair.changed_pairs(); }, unchanged), 0u);
    EXPECT_EQ(pair.changed_pairs().to_vector(), (std::vector<Pair>{{0, 1}}));
    EXPECT_GT(starve([&] { (void)churn.world->save(); }, unchanged), 0u);
    EXPECT_GT(starve([&] { churn.world->restore(saved); }, unchanged), 0u);
    EXPECT_GT(starve([&] { (void)churn.world->fork(); }, unchanged), 0u);
    churn.operate(300);
    EXPECT_TRUE(churn.update());
}

// They are told of pairs that come and go, up to 200 at a time; then of the same again and again.
TEST(Memory, SlotsOfPairsTakeNoneOnceTheyHadAll)
{
    std::vector<ObjectPair> began;
    std::vector<EndedPair> ended;
    for (std::uint32_t k = 0; k < 200; ++k) {
        began.push_back({{k, 1}, {k + 1, 1}});
        ended.push_back({{k, 1}, {k + 1, 1}, jostle::EndReason::moved_apart});
    }
    jostle::PairSlots slots;
    std::uint64_t failed = 0;
    std::vector<std::byte> saved = slots.save();
    for (int round = 0; round < 4; ++round)
        for (const bool begins : {true, false}) {
            const std::uint64_t calls = global_new::calls;
            const std::uint64_t failures =
                starve([&] { begins ? slots.update(began, {}) : slots.update({}, ended); },
                       [&](std::uint64_t) { ASSERT_EQ(slots.save(), saved); });
            failed += failures;
            if (round != 0) {
                EXPECT_EQ(global_new::calls, calls) << round;
            }
            saved = slots.save();
        }
    EXPECT_GT(failed, 3u);
    EXPECT_EQ(slots.end(), 200u);
    EXPECT_GT(starve([&] { slots.restore(saved); }, [&](std::uint64_t) { ASSERT_EQ(slots.save(), saved); }),
              0u);
}

TEST(Memory, FailedChangesChangeNothing)
{
    Churn<3, float> churn(5, 9, true);
    for (int k = 0; k < 500; ++k)
        churn.operate(300);
    ASSERT_TRUE(churn.update());
    const std::vector<std::byte> here = churn.world->save();
    EXPECT_GT(starve([&] { (void)churn.world->save_base(); },
                     [&](std::uint64_t) { ASSERT_EQ(churn.world->save(), here); }),
              0u);
    std::vector<std::vector<std::byte>> wholes, changes;
    for (int update = 0; update < 12; ++update) {
        for (int k = 0; k < 30; ++k)
            churn.operate(300);
        starve([&] { churn.world->update(); }, [](std::uint64_t) {}); // also while it keeps what it changes
        churn.twin.update();
        ASSERT_TRUE(agree(*churn.world, churn.twin)) << update;
        wholes.push_back(churn.world->save());
        changes.emplace_back();
        starve([&] { churn.world->save_changes(changes.back()); },
               [&](std::uint64_t) { ASSERT_EQ(churn.world->save(), wholes.back()); });
    }
    std::size_t at = changes.size() - 1;
    for (const std::size_t to : {std::size_t{2}, std::size_t{9}, std::size_t{0}, std::size_t{11}}) {
        churn.world->set_user_data(churn.world->id(churn.world->index_end() - 1), 0);
        starve([&] { churn.world->restore_changes(changes[to]); },
               [&](std::uint64_t) { ASSERT_EQ(churn.world->save(), wholes[at]); });
        at = to;
        ASSERT_EQ(churn.world->save(), wholes[at]);
        // The next update searches for the pairs that there were.
        jostle::World3f whole(churn.options);
        whole.restore(wholes[at]);
        const ObjectId first = [&] {
            for (std::uint32_t i = 0;; ++i)
                if (whole.contains(whole.id(i))) return whole.id(i);
        }();
        for (jostle::World3f* each : {churn.world.get(), &whole}) {
            each->move(first, {{1, 1, 1}, {5, 5, 5}});
            const Lists before(*each);
            starve([&] { each->update(); },
                   [&](std::uint64_t k) { ASSERT_TRUE(Lists(*each) == before) << k; });
        }
        EXPECT_TRUE(Lists(*churn.world) == Lists(whole));
        churn.world->restore_changes(changes[to]);
    }
}

// Frames that are saved, and now and then taken back.
TEST(Memory, SteadyRollbackAllocatesNothing)
{
    jostle::World3f world({.executor = &jostle::serial_executor()});
    std::vector<jostle::Aabb3f> boxes;
    for (int i = 0; i < 2000; ++i) {
        const float x = static_cast<float>(i % 50) * 1.5f, y = static_cast<float>(i / 50) * 0.9f;
        boxes.push_back({{x, y, 0}, {x + 1, y + 1, 1}});
    }
    std::vector<ObjectId> ids(boxes.size());
    world.add(boxes, ids);
    while (world.update(), world.stats().active != 0) {
    }
    (void)world.save_base();
    std::vector<std::vector<std::byte>> ring(4);
    std::uint64_t calls = 0;
    for (std::size_t frame = 0; frame < 200; ++frame) {
        if (frame == 100) calls = global_new::calls;
        const float by = frame % 2 == 0 ? 0.1f : -0.1f;
        for (std::size_t i = 0; i < 100; ++i) {
            boxes[i].lo[0] += by;
            boxes[i].hi[0] += by;
        }
        world.update(std::span(ids).first(100), std::span<const jostle::Aabb3f>(boxes).first(100));
        world.save_changes(ring[frame % ring.size()]);
        if (frame % 5 == 4) {
            world.restore_changes(ring[(frame - 2) % ring.size()]);
            world.restore_changes(ring[frame % ring.size()]);
        }
    }
    EXPECT_EQ(global_new::calls - calls, 0u);
}

// A base without pairs, changes with many: the update that follows needs memory for them. Each time in a new
// world, since one that failed has some of it already.
TEST(Memory, AFailedUpdateAfterChangesLeavesNoPairs)
{
    const auto box = [](int x) {
        return jostle::Aabb3f{{static_cast<float>(x), 0, 0}, {static_cast<float>(x) + 3, 1, 1}};
    };
    jostle::World3f world;
    std::vector<ObjectId> ids;
    for (int i = 0; i < 1000; ++i)
        ids.push_back(world.add(box(9 * i)));
    world.update();
    const std::vector<std::byte> base = world.save_base();
    for (int i = 0; i < 1000; ++i)
        world.move(ids[static_cast<std::size_t>(i)], box(i));
    world.update();
    std::vector<std::byte> changes;
    world.save_changes(changes);
    world.update();
    bool failed = true;
    for (std::uint64_t k = 0; failed && k < 1000; ++k) {
        jostle::World3f copy({.executor = &jostle::serial_executor()});
        copy.restore(base);
        (void)copy.save_base();
        copy.restore_changes(changes);
        const Lists before(copy);
        failed = false;
        global_new::fail_at = global_new::calls + k;
        try {
            copy.update();
        } catch (const std::bad_alloc&) {
            failed = true;
        }
        global_new::fail_at = global_new::never;
        if (failed) {
            ASSERT_TRUE(Lists(copy) == before) << k;
        } else {
            EXPECT_GT(k, 5u);
            EXPECT_TRUE(Lists(copy) == Lists(world));
        }
    }
    EXPECT_FALSE(failed);
}

TEST(Memory, ASmallWorldTakesLittle)
{
    const std::vector<jostle::Aabb3f> boxes(8, {{0, 0, 0}, {1, 1, 1}});
    std::vector<ObjectId> ids(8);
    std::uint64_t before = global_new::calls;
    jostle::World3f world({.executor = &jostle::serial_executor()});
    EXPECT_LE(global_new::calls - before, 5u) << "only what a world itself is";
    before = global_new::calls;
    world.add(boxes, ids);
    world.update();
    EXPECT_EQ(world.began().size(), 28u);
    // 28 pairs are a little more than the block holds.
    const bool has_block = jostle::world::CountedMemory::block_size > 1;
    EXPECT_LE(global_new::calls - before, has_block ? 4u : 48u);
    EXPECT_LE(world.stats().bytes_reserved, 64u * 1024);
}

TEST(Memory, AFailedAddLosesNoIndex)
{
    jostle::World3f world;
    for (int k = 0; k < 3000; ++k)
        world.add({{static_cast<float>(2 * k), 0, 0}, {static_cast<float>(2 * k + 1), 1, 1}});
    world.update();
    ObjectId late;
    const std::uint64_t failed = starve([&] { late = world.add({{-9, 0, 0}, {-8, 1, 1}}, {.user_data = 7}); },
                                        [&](std::uint64_t) { ASSERT_EQ(world.size(), 3000u); });
    EXPECT_GT(failed, 0u);
    EXPECT_EQ(late.index, 3000u);
    world.update();
    EXPECT_EQ(world.user_data(late), 7u);
}

/// Some of 200 objects are gone: their ids are free in an order of their own, with generations of their own.
void remove_some(jostle::World3f& world, Random random)
{
    std::vector<ObjectId> ids(200);
    for (int life = 0; life < 3; ++life) {
        for (ObjectId& id : ids)
            if (!world.contains(id)) id = world.add({{0, 0, 0}, {1, 1, 1}}, {.enabled = false});
        world.update();
        for (const ObjectId id : ids)
            if (random.below(3) == 0) world.remove(id);
        world.update();
    }
}

// Memory for what users keep is taken by segments, the first of 64 and each further one as large as all
// before.
TEST(Memory, AFailedAddOfUserDataTakesNoId)
{
    constexpr std::size_t counts[] = {1, 2, 63, 64, 65, 127, 128, 129, 255, 256, 257, 1000};
    std::uint64_t failed = 0;
    for (std::uint64_t seed = 0; seed < 4 * std::size(counts); ++seed) {
        jostle::World3f world({.executor = &jostle::serial_executor()}), other(jostle::WorldOptions{});
        for (jostle::World3f* each : {&world, &other}) {
            remove_some(*each, Random(seed));
            if (seed % 2 != 0) (void)each->save_base();
            if (seed % 3 == 0) each->set_user_data(each->add({{0, 0, 0}, {1, 1, 1}}), 5);
        }
        const std::vector<jostle::Aabb3f> boxes(counts[seed % std::size(counts)], {{0, 0, 0}, {1, 1, 1}});
        std::vector<ObjectId> ids(boxes.size()), of_other(boxes.size());
        const Lists before(world);
        failed += starve([&] { world.add(boxes, ids, {.enabled = false, .user_data = 9}); },
                         [&](std::uint64_t k) { ASSERT_TRUE(Lists(world) == before) << seed << ' ' << k; });
        other.add(boxes, of_other, {.enabled = false, .user_data = 9});
        ASSERT_EQ(ids, of_other) << seed;
        world.update(), other.update();
        ASSERT_EQ(world.save(), other.save()) << seed;
    }
    EXPECT_GT(failed, 150u);
}

// The pieces that several threads take at once are apart and aligned, in the block and behind it. What was
// allocated is given back.
TEST(Memory, PiecesAreApart)
{
    struct Piece
    {
        std::byte* at;
        std::size_t bytes, alignment;
    };
    struct Source final : std::pmr::memory_resource
    {
        std::atomic<std::uint64_t> held{0}, allocations{0};
        void* do_allocate(std::size_t bytes, std::size_t alignment) override
        {
            void* const memory = std::pmr::new_delete_resource()->allocate(bytes, alignment);
            held += bytes;
            ++allocations;
            return memory;
        }
        void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override
        {
            held -= bytes;
            std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
        }
        [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override
        {
            return this == &other;
        }
    } source;
    constexpr std::size_t threads = 4, each = 100;
    const auto memory = std::make_unique<jostle::world::CountedMemory>(&source);
    std::vector<std::vector<Piece>> taken(threads);
    std::vector<std::thread> takers;
    for (std::size_t t = 0; t < threads; ++t)
        takers.emplace_back([&, t] {
            for (std::size_t k = 0; k < each; ++k) {
                const std::size_t bytes = 1 + (k * 37 + t) % 200, alignment = std::size_t{1} << (k + t) % 8;
                taken[t].push_back(
                    {static_cast<std::byte*>(memory->allocate(bytes, alignment)), bytes, alignment});
            }
        });
    for (std::thread& taker : takers)
        taker.join();
    std::vector<Piece> all;
    for (const std::vector<Piece>& some : taken)
        all.insert(all.end(), some.begin(), some.end());
    std::sort(all.begin(), all.end(),
              [](const Piece& a, const Piece& b) { return std::less<>{}(a.at, b.at); });
    for (std::size_t k = 0; k < all.size(); ++k) {
        std::memset(all[k].at, static_cast<int>(k), all[k].bytes);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(all[k].at) % all[k].alignment, 0u);
        if (k != 0) {
            EXPECT_LE(all[k - 1].at + all[k - 1].bytes, all[k].at) << k;
        }
    }
    EXPECT_EQ(memory->bytes(), source.held);
    EXPECT_GT(source.allocations, 0u) << "more than the block holds";
    if (jostle::world::CountedMemory::block_size > 1) {
        EXPECT_LT(source.allocations, threads * each / 2);
        const volatile std::size_t too_many = ~std::size_t{0} - 64;
        EXPECT_THROW((void)memory->allocate(too_many, 1), std::bad_alloc);
    }
    for (const Piece& piece : all)
        memory->deallocate(piece.at, piece.bytes, piece.alignment);
    EXPECT_EQ(memory->bytes(), 0u);
    EXPECT_EQ(source.held, 0u);
}

TEST(Memory, SteadyUpdatesAllocateNothing)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (jostle::Executor* executor : {&jostle::serial_executor(), threads.get()})
        for (const char* name : {"resting", "uniform"}) {
            jostle_scenes::Scene<3, float> scene(name, 10'000, 1);
            jostle::World3f world({.executor = executor});
            std::vector<ObjectId> ids(scene.boxes().size());
            world.add(scene.boxes(), ids);
            // To and fro, so that after one period everything has been seen.
            std::vector<std::vector<jostle::Aabb3f>> frames;
            for (int frame = 0; frame < 8; ++frame) {
                frames.emplace_back(scene.boxes().begin(), scene.boxes().end());
                scene.step();
            }
            std::uint64_t allocated = 0, persisted = 0, began = 0;
            for (int frame = 0; frame < 84; ++frame) {
                const int phase = frame % 14;
                const auto& boxes = frames[static_cast<std::size_t>(phase < 8 ? phase : 14 - phase)];
                const std::uint64_t before = global_new::calls;
                world.move(ids, boxes);
                world.update();
                EXPECT_EQ(world.changed_pairs().size(), world.began().size() + world.persisted().size());
                EXPECT_EQ(world.began_pairs().size(), world.began().size());
                if (frame < 56) continue;
                allocated += global_new::calls - before;
                persisted += world.persisted().size();
                began += world.began().size();
            }
            EXPECT_EQ(allocated, 0u) << name << ", " << executor->concurrency() << " threads";
            EXPECT_GT(persisted, 1000u);
            EXPECT_GT(began, 10u);
        }
}

// Pairs that are refused come and go.
void allocate_nothing_with_refused_pairs(bool has_base)
{
    jostle::World3f world({.executor = &jostle::serial_executor(),
                           .accept = [](ObjectId a, ObjectId b) { return (a.index + b.index) % 3 != 0; }});
    jostle_scenes::Scene<3, float> scene("uniform", 3000, 1);
    std::vector<ObjectId> ids(scene.boxes().size());
    world.add(scene.boxes(), ids);
    if (has_base) (void)world.save_base();
    std::uint64_t calls = 0, least = ~std::uint64_t{0}, most = 0;
    for (std::size_t frame = 0; frame < 72; ++frame) {
        if (frame == 48) calls = global_new::calls;
        for (std::size_t i = frame % 2; i < ids.size(); i += 2)
            world.set_enabled(ids[i], frame % 12 < 6);
        world.update();
        least = std::min(least, world.stats().refused);
        most = std::max(most, world.stats().refused);
    }
    EXPECT_EQ(global_new::calls - calls, 0u);
    EXPECT_GT(most, least + 100);
}

TEST(Memory, SteadyUpdatesWithRefusedPairsAllocateNothing)
{
    allocate_nothing_with_refused_pairs(false);
}

TEST(Memory, SteadyUpdatesWithRefusedPairsAndABaseAllocateNothing)
{
    allocate_nothing_with_refused_pairs(true);
}

// Of up to 128 corners: more don't lie on the stack.
TEST(Memory, ContactsOfPolygonsTakeNone)
{
    std::vector<jostle::Vec2d> points;
    for (int i = 0; i < 128; ++i)
        points.push_back({std::cos(i * 0.04908738521234052), std::sin(i * 0.04908738521234052)});
    const jostle::ConvexHull2 hull(points);
    ASSERT_EQ(hull.vertices().size(), 128u);
    const std::vector<jostle::Shape2> shapes(20, hull);
    std::vector<jostle::Pose2d> poses;
    std::vector<jostle::Pair> pairs;
    for (std::uint32_t i = 0; i < 20; ++i) {
        poses.push_back({{0.9 * i, 0.1 * i}, {1, 0}});
        for (std::uint32_t k = 0; k < i; ++k)
            pairs.push_back({k, i});
    }
    std::vector<jostle::Distance<2, double>> distances(pairs.size());
    std::vector<std::uint8_t> touch(pairs.size());
    jostle::ContactFinder2d finder({.executor = &jostle::serial_executor()});
    std::uint64_t before = 0;
    for (int frame = 0; frame < 6; ++frame) {
        if (frame == 3) before = global_new::calls;
        EXPECT_GT(finder.find({shapes, poses}, pairs).size(), 19u);
        finder.distances({shapes, poses}, pairs, 100, std::span(distances));
        finder.touching({shapes, poses}, pairs, touch);
    }
    EXPECT_EQ(global_new::calls, before);
}

} // namespace
} // namespace world_tests
#endif
