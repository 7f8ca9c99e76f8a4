// SPDX-License-Identifier: MIT
// Commands from many threads at a time: what comes out depends on what was queued alone.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "churn.hpp"

namespace world_tests {
namespace {

constexpr std::uint32_t thread_count = 7;

/// Everything that can be read of a world.
struct Picture
{
    std::vector<ObjectPair> began;
    std::vector<EndedPair> ended;
    std::vector<Pair> persisted, pairs; // in the world's own order
    std::vector<jostle::Aabb3f> boxes;
    std::vector<ObjectFilter> filters;
    friend bool operator==(const Picture& x, const Picture& y)
    {
        const auto same_box = [](const jostle::Aabb3f& a, const jostle::Aabb3f& b) {
            return a.lo == b.lo && a.hi == b.hi;
        };
        return x.began == y.began && x.ended == y.ended && x.persisted == y.persisted && x.pairs == y.pairs &&
               x.filters == y.filters &&
               std::equal(x.boxes.begin(), x.boxes.end(), y.boxes.begin(), y.boxes.end(), same_box);
    }
};

Picture picture_of(const jostle::World3f& world)
{
    Picture picture;
    picture.began.assign(world.began().begin(), world.began().end());
    picture.ended.assign(world.ended().begin(), world.ended().end());
    picture.persisted = world.persisted().to_vector();
    picture.pairs = world.pairs().to_vector();
    for (std::uint32_t i = 0; i < world.index_end(); ++i)
        if (const ObjectId id = world.id(i); world.contains(id)) {
            picture.boxes.push_back(world.bounds(id));
            picture.filters.push_back(world.filter(id));
        }
    return picture;
}

/// What thread `t` has to say in round `round`: about its own objects, and about some that others speak of as
/// well.
void speak(jostle::World3f& world, const std::vector<ObjectId>& ids, std::uint64_t round, std::uint32_t t)
{
    Random random(round, t, 1);
    for (int k = 0; k < 40; ++k) {
        const bool shared = random.below(4) == 0;
        const std::uint32_t i =
            shared ? random.below(20)
                   : 20 + t +
                         thread_count *
                             random.below(static_cast<std::uint32_t>(ids.size() - 20) / thread_count - 1);
        const std::uint32_t sequence = random.below(3) == 0 ? random.below(3) : 0;
        if (!world.contains(ids[i])) continue;
        switch (random.below(9)) {
        case 0:
            world.set_filter(ids[i], random_filter(random), sequence);
            break;
        case 1:
            world.set_enabled(ids[i], random.below(3) != 0, sequence);
            break;
        case 2: {
            const float size[3] = {1, 2, static_cast<float>(random.uniform(0, 2))};
            world.resize(ids[i], size, sequence);
            break;
        }
        case 3:
            world.set_margin(ids[i], static_cast<float>(random.below(3)) / 4, sequence);
            break;
        case 4: {
            const float by[3] = {1, 0, -0.5f};
            world.move(ids[i], random_box<3, float>(random, 6), by, sequence);
            break;
        }
        case 5:
            if (random.below(8) == 0) world.remove(ids[i]);
            break;
        default:
            world.move(ids[i], random_box<3, float>(random, 6), sequence);
        }
    }
}

TEST(Threads, TheOutcomeDoesntDependOnWhoWasFirst)
{
    std::vector<Picture> pictures[2];
    for (int run = 0; run < 2; ++run) {
        jostle::World3f world;
        Random random(5);
        std::vector<ObjectId> ids(200);
        std::vector<jostle::Aabb3f> boxes;
        for (int i = 0; i < 200; ++i)
            boxes.push_back(random_box<3, float>(random, 6));
        world.add(boxes, ids);
        world.update();
        for (std::uint64_t round = 0; round < 30; ++round) {
            // One after the other, the last first; then all at once. In both, all live at the same time:
            // threads are told apart by std::this_thread::get_id().
            std::atomic<std::uint32_t> turn{thread_count}, done{0};
            std::vector<std::thread> threads;
            for (std::uint32_t t = 0; t < thread_count; ++t)
                threads.emplace_back([&, t] {
                    while (run == 0 && turn != t + 1)
                        std::this_thread::yield();
                    speak(world, ids, round, t);
                    --turn;
                    ++done;
                    while (done != thread_count)
                        std::this_thread::yield();
                });
            for (std::thread& thread : threads)
                thread.join();
            world.update();
            pictures[run].push_back(picture_of(world));
        }
        EXPECT_GT(world.size(), 50u);
    }
    for (std::size_t round = 0; round < pictures[0].size(); ++round)
        ASSERT_TRUE(pictures[0][round] == pictures[1][round]) << round;
}

/// Waits for as long as a seed says, often not at all: threads meet in another order with each seed.
class Pauses
{
  public:
    explicit Pauses(std::uint64_t seed) : random_(seed) {}
    void pause()
    {
        const std::uint32_t what = random_.below(16);
        if (what < 4) std::this_thread::yield();
        if (what == 4) std::this_thread::sleep_for(std::chrono::microseconds(random_.below(100)));
    }

  private:
    Random random_;
};

/// Tasks on threads of their own, each of which begins late.
class LateThreads final : public jostle::Executor
{
  public:
    explicit LateThreads(std::uint64_t seed) : seed_(seed) {}
    [[nodiscard]] std::uint32_t concurrency() const noexcept override { return 3; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        std::atomic<std::uint32_t> next{0};
        std::vector<std::thread> threads;
        for (std::uint32_t t = 0; t < std::min(count, 3u); ++t)
            threads.emplace_back([&, seed = ++seed_] {
                Pauses pauses(seed);
                for (std::uint32_t i; pauses.pause(), (i = next++) < count;)
                    task(i);
            });
        for (std::thread& thread : threads)
            thread.join();
    }

  private:
    std::uint64_t seed_;
};

/// Four threads give so many commands each while updates run. With a seed other than 0 all pause at random:
/// before commands, and in the middle of updates, in which `accept` is asked.
void command_while_updates_run(jostle::Executor& executor, int commands, std::uint64_t seed)
{
    // With a seed so many objects that an update has several tasks.
    const std::size_t objects_each = seed == 0 ? 100 : 1500;
    const int edge = seed == 0 ? 12 : 30;
    jostle::WorldOptions options;
    options.executor = &executor;
    std::atomic<std::uint64_t> asked{0};
    const auto slow_accept = [&](ObjectId, ObjectId) {
        Pauses(seed * 1000 + ++asked).pause();
        return true;
    };
    if (seed != 0) options.accept = slow_accept;
    jostle::World3f world(options);
    std::atomic<bool> stop{false};
    std::atomic<std::uint32_t> speaking{0};
    std::vector<std::thread> threads;
    std::vector<std::vector<ObjectId>> left(4);
    for (std::uint32_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            Random random(seed * 4 + t + 1);
            Pauses pauses(seed * 4 + t);
            std::vector<ObjectId>& mine = left[t];
            ++speaking;
            for (int k = 0; k < commands; ++k) {
                if (seed != 0) pauses.pause();
                if (mine.size() < objects_each || random.below(8) == 0) {
                    mine.push_back(world.add(random_box<3, float>(random, edge)));
                } else if (random.below(8) == 0) {
                    const std::size_t i = random.below(static_cast<std::uint32_t>(mine.size()));
                    world.remove(mine[i]);
                    mine[i] = mine.back();
                    mine.pop_back();
                } else {
                    world.move(mine[random.below(static_cast<std::uint32_t>(mine.size()))],
                               random_box<3, float>(random, edge));
                }
            }
            if (--speaking == 0) stop = true;
        });
    std::set<std::pair<ObjectId, ObjectId>> touching;
    const auto follow = [&] {
        world.update();
        for (const EndedPair& pair : world.ended())
            ASSERT_EQ(touching.erase({pair.a, pair.b}), 1u) << "ended, but never began";
        for (const ObjectPair& pair : world.began())
            ASSERT_TRUE(touching.insert({pair.a, pair.b}).second) << "began twice";
    };
    while (!stop)
        follow();
    for (std::thread& thread : threads)
        thread.join();
    follow();
    EXPECT_EQ(world.stats().dropped, 0u);
    std::size_t objects = 0;
    for (const auto& mine : left) {
        objects += mine.size();
        for (const ObjectId id : mine)
            EXPECT_TRUE(world.contains(id));
    }
    EXPECT_EQ(world.size(), objects);
    std::vector<Pair> pairs;
    for (const auto& [a, b] : touching)
        pairs.push_back({a.index, b.index});
    std::sort(pairs.begin(), pairs.end());
    EXPECT_EQ(world.pairs().to_vector(), pairs);
    EXPECT_GT(pairs.size(), 100u);
}

TEST(Threads, CommandsWhileUpdatesRun)
{
    const std::unique_ptr<jostle::Executor> executor = jostle::make_thread_executor(2);
    command_while_updates_run(*executor, 1500, 0);
}

TEST(Threads, CommandsWhileUpdatesRunOnManySchedules)
{
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        SCOPED_TRACE(seed);
        LateThreads executor(seed * 100'000);
        command_while_updates_run(executor, 2500, seed);
    }
}

TEST(Threads, TheFirstWhoAsksForTheChangedPairsMakesTheList)
{
    jostle::World3f world;
    Random random(5);
    for (int update = 0; update < 30; ++update) {
        for (int k = 0; k < 40; ++k)
            (void)world.add(random_box<3, float>(random, 12));
        world.update();
        const std::uint64_t expected = world.began().size() + world.persisted().size();
        std::vector<std::thread> threads;
        for (int t = 0; t < 4; ++t)
            threads.emplace_back([&] {
                std::uint64_t count = 0;
                for (const Pair& pair : world.changed_pairs())
                    count += pair.a < pair.b ? 1 : 0;
                EXPECT_EQ(count, expected);
            });
        for (std::thread& thread : threads)
            thread.join();
    }
    EXPECT_GT(world.began().size(), 10u);
}

TEST(Threads, QueuesOfThreadsThatHaveNothingMoreToSayServeOthers)
{
    jostle::World3f world;
    const ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}});
    world.update();
    // All are there at the same time, so that no two of them can be taken for one.
    constexpr int count = 40;
    std::atomic<int> turn{-1}, done{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < count; ++t)
        threads.emplace_back([&, t] {
            while (turn != t)
                std::this_thread::yield();
            world.move(a, {{0, 0, 0}, {1, 1, static_cast<float>(t)}});
            ++done;
            while (done <= count)
                std::this_thread::yield();
        });
    std::uint64_t bytes = 0;
    for (int t = 0; t < count; ++t) {
        turn = t;
        while (done != t + 1)
            std::this_thread::yield();
        for (int update = 0; update < 3; ++update)
            world.update();
        if (t == 10) bytes = world.stats().bytes_reserved;
    }
    ++done;
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(world.box(a).hi[2], count - 1);
    EXPECT_EQ(world.stats().bytes_reserved, bytes);
}

TEST(Threads, QueuesOfThreadsThatAreGoneServeOthers)
{
    jostle::World3f world;
    const ObjectId a = world.add({{0, 0, 0}, {1, 1, 1}});
    world.update();
    const auto round = [&](int k) {
        std::vector<std::thread> threads;
        for (int t = 0; t < 3; ++t)
            threads.emplace_back([&] { world.move(a, {{0, 0, 0}, {1, 1, static_cast<float>(k)}}); });
        for (std::thread& thread : threads)
            thread.join();
        world.update();
        world.update();
        world.update();
        EXPECT_EQ(world.box(a).hi[2], static_cast<float>(k));
    };
    for (int k = 1; k < 10; ++k)
        round(k);
    const std::uint64_t bytes = world.stats().bytes_reserved;
    EXPECT_GT(bytes, 0u);
    for (int k = 10; k < 200; ++k)
        round(k);
    EXPECT_LE(world.stats().bytes_reserved, bytes + 4096);
}

} // namespace
} // namespace world_tests
