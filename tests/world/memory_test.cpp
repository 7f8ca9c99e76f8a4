// SPDX-License-Identifier: MIT
// No memory in steady updates; and when there is none at all, the world stays as it was.
#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

#include "churn.hpp"
#include "scenes/scenes.hpp"

// The thread sanitizer brings its own operator new, and refuses a second one.
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define JOSTLE_OWN_NEW 0
#endif
#endif
#ifndef JOSTLE_OWN_NEW
#define JOSTLE_OWN_NEW 1
#endif

#if JOSTLE_OWN_NEW
namespace {
constexpr std::uint64_t never = std::numeric_limits<std::uint64_t>::max();
std::atomic<std::uint64_t> news{0};        // calls of the global operator new
std::atomic<std::uint64_t> fail_at{never}; // from this one on, all fail

void count_or_fail()
{
    if (news++ >= fail_at) throw std::bad_alloc();
}
} // namespace

// Not inlined, or the compiler takes malloc and delete for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size)
{
    count_or_fail();
    if (void* const memory = std::malloc(size == 0 ? 1 : size)) return memory;
    throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment)
{
    count_or_fail();
    const std::size_t step = static_cast<std::size_t>(alignment);
    if (void* const memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept
{
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
    std::free(memory);
}

namespace world_tests {
namespace {

/// Calls `call` with less and less memory, then with enough. After each failure calls `check`.
template <class Call, class Check>
std::uint64_t starve(const Call& call, const Check& check)
{
    for (std::uint64_t k = 0;; ++k) {
        bool failed = false;
        fail_at = news + k;
        try {
            call();
        } catch (const std::bad_alloc&) {
            failed = true;
        }
        fail_at = never;
        if (!failed) return k;
        check(k);
        if (testing::Test::HasFatalFailure() || k > 20'000) return never;
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
    std::vector<jostle::ObjectHit<float>> hits;
    EXPECT_GT(starve([&] { (void)churn.world->all(ray, hits); }, unchanged), 0u);
    EXPECT_FALSE(hits.empty());
    EXPECT_GT(starve([&] { (void)churn.world->pairs(); }, unchanged), 0u);
    EXPECT_GT(starve([&] { (void)churn.world->save(); }, unchanged), 0u);
    EXPECT_GT(starve([&] { churn.world->restore(saved); }, unchanged), 0u);
    EXPECT_GT(starve([&] { (void)churn.world->fork(); }, unchanged), 0u);
    churn.operate(300);
    EXPECT_TRUE(churn.update());
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
            std::uint64_t allocated = 0, persisted = 0;
            for (int frame = 0; frame < 84; ++frame) {
                const int phase = frame % 14;
                const auto& boxes = frames[static_cast<std::size_t>(phase < 8 ? phase : 14 - phase)];
                const std::uint64_t before = news;
                world.move(ids, boxes);
                world.update();
                if (frame < 56) continue;
                allocated += news - before;
                persisted += world.persisted().size();
            }
            EXPECT_EQ(allocated, 0u) << name << ", " << executor->concurrency() << " threads";
            EXPECT_GT(persisted, 1000u);
        }
}

} // namespace
} // namespace world_tests
#endif
