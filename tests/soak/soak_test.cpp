// SPDX-License-Identifier: MIT
// A world under everything at once for as long as one likes: commands of several threads while it is updated,
// questions to a view of it meanwhile, snapshots that are restored elsewhere. Memory stays level, all that is
// compared agrees, and it is told how long updates took.
//   JOSTLE_SOAK_SECONDS  how long; a few seconds if not given
//   JOSTLE_SOAK_THREADS  how many the world is updated on, 2 if not given. With 1 it is also told how long
//                        that thread worked, whoever else had the cores
//   JOSTLE_SOAK_SERIES   a file (.csv) for what each part of the time was like; docs/images/soak.py draws it
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <memory_resource>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "jostle/find_pairs.hpp"
#include "jostle/world.hpp"
#include "tool/scenes/random.hpp"
#include "tool/system/system.hpp"

namespace {

using jostle::ObjectId;
using jostle_scenes::Random;
using Box = jostle::Aabb3f;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t commanders = 2, objects_each = 4000;
constexpr float edge = 24; // of the space: some two pairs an object
constexpr std::size_t parts = 60;
constexpr std::uint64_t warm_up = 128; // updates; after them nothing is bigger than anything before

/// Knows how many bytes are out.
class Meter : public std::pmr::memory_resource
{
  public:
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

  private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override
    {
        void* const memory = std::pmr::new_delete_resource()->allocate(bytes, alignment);
        bytes_ += bytes;
        return memory;
    }
    void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override
    {
        bytes_ -= bytes;
        std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

    std::atomic<std::uint64_t> bytes_{0};
};

/// What the process has of the machine's memory, in bytes; 0 where the system doesn't say.
std::uint64_t resident()
{
    std::ifstream file("/proc/self/statm");
    std::uint64_t all = 0, pages = 0;
    file >> all >> pages;
    return pages * 4096;
}

/// How long this thread has worked; 0 where the system doesn't say.
double thread_ms()
{
#ifdef CLOCK_THREAD_CPUTIME_ID
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) / 1e6;
#else
    return 0;
#endif
}

double ms_since(Clock::time_point start)
{
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

Box box_at(const jostle::Vec3f& at, float size)
{
    return {at, {at[0] + size, at[1] + size, at[2] + size}};
}
Box any_box(Random& random)
{
    jostle::Vec3f at;
    for (float& x : at)
        x = static_cast<float>(random.uniform(0, edge));
    return box_at(at, static_cast<float>(random.uniform(0.5, 1.5)));
}
jostle::ObjectFilter any_filter(Random& random)
{
    jostle::ObjectFilter filter;
    filter.category = 1u << random.below(3);
    filter.mask = random.below(4) == 0 ? 3 : ~0u;
    filter.owner = random.below(8) == 0 ? random.below(3) : jostle::Filter::no_owner;
    filter.is_static = random.below(32) == 0;
    return filter;
}

/// A thread's own objects, and what it has to say about them before each update.
class Commander
{
  public:
    Commander(jostle::World3f& world, std::uint32_t number) : world_(world), random_(number + 1)
    {
        while (ids_.size() < objects_each)
            add();
    }

    void speak()
    {
        for (int k = 0; k < 16; ++k)
            ids_.size() < objects_each + random_.below(200) ? add() : remove();
        // A part of them goes on for a while, and then another one: objects come to rest and wake up.
        if (random_.below(64) == 0) first_ = random_.below(objects_each / 2);
        for (std::uint32_t k = 0; k < 300; ++k) {
            const std::size_t i = (first_ + k) % ids_.size();
            for (std::size_t d = 0; d < 3; ++d) {
                const float by = static_cast<float>(random_.uniform(-0.1, 0.1));
                boxes_[i].lo[d] += by, boxes_[i].hi[d] += by;
            }
            if (k % 16 == 0) {
                const float by[3] = {0.25f, 0, -0.25f};
                world_.move(ids_[i], boxes_[i], by);
            } else {
                world_.move(ids_[i], boxes_[i]);
            }
        }
        for (int k = 0; k < 8; ++k) {
            const std::size_t i = random_.below(static_cast<std::uint32_t>(ids_.size()));
            switch (random_.below(6)) {
            case 0:
                world_.set_filter(ids_[i], any_filter(random_));
                break;
            case 1:
                world_.set_enabled(ids_[i], random_.below(4) != 0);
                break;
            case 2:
                world_.set_user_data(ids_[i], random_.below(3));
                break;
            case 3:
                world_.report_again(ids_[i]);
                break;
            case 4:
                world_.set_margin(ids_[i], static_cast<float>(random_.below(2)) / 8);
                break;
            default:
                boxes_[i] = any_box(random_);
                world_.move(ids_[i], boxes_[i]);
            }
        }
    }

  private:
    void add()
    {
        boxes_.push_back(any_box(random_));
        jostle::ObjectOptions<float> options;
        options.filter = any_filter(random_);
        ids_.push_back(world_.add(boxes_.back(), options));
    }
    void remove()
    {
        const std::size_t i = random_.below(static_cast<std::uint32_t>(ids_.size()));
        world_.remove(ids_[i]);
        ids_[i] = ids_.back(), boxes_[i] = boxes_.back();
        ids_.pop_back(), boxes_.pop_back();
    }

    jostle::World3f& world_;
    Random random_;
    std::vector<ObjectId> ids_;
    std::vector<Box> boxes_;
    std::uint32_t first_ = 0;
};

/// The world's pairs as a search among its objects' bounds finds them.
std::vector<jostle::Pair> pairs_anew(const jostle::World3f& world)
{
    std::vector<Box> boxes;
    std::vector<std::uint32_t> indices, category, mask, owner;
    std::vector<char> is_static;
    for (std::uint32_t i = 0; i < world.index_end(); ++i) {
        const ObjectId id = world.id(i);
        if (id == ObjectId{} || !world.enabled(id)) continue;
        const jostle::ObjectFilter filter = world.filter(id);
        boxes.push_back(world.bounds(id));
        indices.push_back(i);
        category.push_back(filter.category);
        mask.push_back(filter.mask);
        owner.push_back(filter.owner);
        is_static.push_back(filter.is_static);
    }
    jostle::Filter filter{std::span<const std::uint32_t>(category),
                          std::span<const std::uint32_t>(mask),
                          std::span<const std::uint32_t>(owner),
                          {}};
    const auto accept = [&](std::uint32_t a, std::uint32_t b) { return !(is_static[a] && is_static[b]); };
    filter.accept = accept;
    std::vector<jostle::Pair> pairs;
    for (const jostle::Pair pair :
         jostle::find_pairs(boxes, filter, jostle::Order::sorted, {.executor = &jostle::serial_executor()}))
        pairs.push_back({indices[pair.a], indices[pair.b]});
    return pairs;
}

/// Asks a view for as long as it is let.
class Asker
{
  public:
    explicit Asker(const jostle::WorldOptions& options) : view_(options), thread_([this] { ask(); }) {}
    ~Asker()
    {
        stop_ = true;
        thread_.join();
    }
    void follow(const jostle::World3f& world)
    {
        const std::lock_guard lock(mutex_);
        view_.follow(world);
    }
    [[nodiscard]] std::uint64_t questions() const { return questions_; }
    [[nodiscard]] std::uint64_t wrong() const { return wrong_; }

  private:
    void ask()
    {
        Random random(99);
        std::vector<ObjectId> touched;
        for (; !stop_; std::this_thread::yield()) {
            const std::lock_guard lock(mutex_);
            if (view_.size() == 0) continue;
            for (int k = 0; k < 20; ++k) {
                const Box region = any_box(random);
                view_.all(region, touched);
                std::uint64_t counted = 0;
                for (const ObjectId id : touched) {
                    const Box box = view_.bounds(id);
                    bool touches = true;
                    for (std::size_t d = 0; d < 3; ++d)
                        touches = touches && box.lo[d] <= region.hi[d] && region.lo[d] <= box.hi[d];
                    counted += touches;
                }
                wrong_ += counted != touched.size() || view_.count(region) != counted;
                const auto hit = view_.first(jostle::Ray3f{region.lo, {1, 0.5f, 0.25f}});
                wrong_ += hit && !(hit->at >= 0);
                questions_ += 3;
            }
        }
    }

    jostle::World3f view_;
    std::mutex mutex_;
    std::atomic<std::uint64_t> questions_{0}, wrong_{0};
    std::atomic<bool> stop_{false};
    std::thread thread_; // last: it uses the others
};

/// A part of the time.
struct Part
{
    double seconds = 0; ///< until its end
    std::uint64_t bytes = 0, resident = 0, pairs = 0;
    std::vector<float> ms;    ///< each update's
    std::vector<float> whole; ///< of those during which the system took no core away
    std::vector<float> work;  ///< what the thread that updates worked for each
};

float quantile(std::vector<float> all, double q)
{
    const auto at = all.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(all.size() - 1));
    std::nth_element(all.begin(), at, all.end());
    return *at;
}

void tell(const char* words, const std::vector<float>& ms)
{
    if (ms.empty()) return;
    const float median = quantile(ms, 0.5), rare = quantile(ms, 0.999);
    std::printf("%s, %zu: median %.3f ms, 99 %% %.3f ms, 99.9 %% %.3f ms (%.1f medians), worst %.3f ms\n",
                words, ms.size(), median, quantile(ms, 0.99), rare, rare / median, quantile(ms, 1));
}

TEST(Soak, MemoryStaysLevelAndEverythingAgrees)
{
    const char* const given = std::getenv("JOSTLE_SOAK_SECONDS");
    const double seconds = given == nullptr ? 4 : std::atof(given);
    const char* const threads_given = std::getenv("JOSTLE_SOAK_THREADS");
    const auto update_threads =
        static_cast<std::uint32_t>(threads_given == nullptr ? 2 : std::max(1, std::atoi(threads_given)));
    Meter memory;
    const auto executor = jostle::make_thread_executor(update_threads);
    jostle::WorldOptions options;
    options.executor = executor.get();
    options.memory = &memory;
    jostle::World3f world(options);
    options.executor = &jostle::serial_executor();
    jostle::World3f copy(options);
    Asker asker(options);

    // Each commander speaks once for each update, while that goes on.
    std::atomic<std::uint64_t> turn{0};
    std::array<std::atomic<std::uint64_t>, commanders> said{};
    std::vector<std::thread> threads;
    std::atomic<bool> stop{false};
    std::vector<Commander> all_commanders;
    for (std::uint32_t k = 0; k < commanders; ++k)
        all_commanders.emplace_back(world, k);
    for (std::uint32_t k = 0; k < commanders; ++k)
        threads.emplace_back([&, k] {
            for (std::uint64_t spoken = 0;; ++spoken) {
                turn.wait(spoken);
                if (stop) return;
                all_commanders[k].speak();
                said[k] = spoken + 1;
                said[k].notify_one();
            }
        });

    std::vector<Part> series;
    Part part;
    std::uint64_t updates = 0, restored = 0;
    std::array<float, 2> worst{}; // of all, and of those during which the system took no core away
    std::array<std::string, 2> explained;
    auto start = Clock::now();
    for (bool ended = false; !ended && !HasFailure();) {
        ++turn;
        turn.notify_all();
        const std::uint64_t preempted = jostle_system::preemptions();
        const auto update_start = Clock::now();
        const double worked = thread_ms();
        world.update();
        part.work.push_back(static_cast<float>(thread_ms() - worked));
        const auto ms = static_cast<float>(ms_since(update_start));
        const std::uint64_t taken = jostle_system::preemptions() - preempted;
        part.ms.push_back(ms);
        if (taken == 0) part.whole.push_back(ms);
        for (std::size_t k = 0; k <= (taken == 0 ? 1u : 0u); ++k)
            if (ms > worst[k] && updates >= warm_up) {
                worst[k] = ms;
                explained[k] = world.explain() + "\nThe system took a core away " + std::to_string(taken) +
                               " times meanwhile.";
            }
        for (std::uint32_t k = 0; k < commanders; ++k)
            for (std::uint64_t now = said[k]; now != turn; now = said[k])
                said[k].wait(now);
        const double passed = ms_since(start) / 1000;
        ended = passed >= seconds && updates >= 3 * warm_up; // slow machines take longer
        if (++updates % 4 == 0) asker.follow(world);
        if (updates % 128 == 8) {
            const std::vector<std::byte> saved = world.save();
            copy.restore(saved);
            EXPECT_EQ(copy.save(), saved);
            EXPECT_EQ(copy.pairs().to_vector(), pairs_anew(world));
            ++restored;
        }
        if (updates == warm_up) {
            start = Clock::now();
            part = {};
        }
        if (updates <= warm_up ||
            (!ended && passed < seconds * static_cast<double>(series.size() + 1) / parts))
            continue;
        part.seconds = passed;
        part.bytes = memory.bytes();
        part.resident = resident();
        part.pairs = world.stats().persisted + world.stats().began;
        series.push_back(std::move(part));
        part = {};
    }
    stop = true;
    ++turn;
    turn.notify_all();
    for (std::thread& thread : threads)
        thread.join();

    EXPECT_EQ(asker.wrong(), 0u);
    EXPECT_GT(asker.questions(), 0u);
    EXPECT_GT(restored, 0u);
    // Ids are given out again, and memory is level: the last third needs what the second one did.
    EXPECT_LT(world.index_end(), 2 * commanders * objects_each);
    std::array<std::uint64_t, 3> bytes{};
    std::vector<float> ms, whole, work;
    for (std::size_t k = 0; k < series.size(); ++k) {
        const std::size_t third = 3 * k / series.size();
        bytes[third] = std::max(bytes[third], series[k].bytes);
        ms.insert(ms.end(), series[k].ms.begin(), series[k].ms.end());
        whole.insert(whole.end(), series[k].whole.begin(), series[k].whole.end());
        work.insert(work.end(), series[k].work.begin(), series[k].work.end());
    }
    EXPECT_LE(static_cast<double>(bytes[2]), 1.15 * static_cast<double>(bytes[1]));

    std::printf("%.0f s: %llu updates of %zu objects, %llu questions, %llu snapshots restored\n",
                series.back().seconds, static_cast<unsigned long long>(updates), world.size(),
                static_cast<unsigned long long>(asker.questions()),
                static_cast<unsigned long long>(restored));
    tell("all updates", ms);
    tell("those during which no core was taken away", whole);
    if (update_threads == 1) tell("what the thread worked for them", work);
    std::printf("memory: at most %.1f MB in the second third, %.1f in the last\n"
                "the worst update:\n%s\nthe worst from which no core was taken away:\n%s\n",
                static_cast<double>(bytes[1]) / 1e6, static_cast<double>(bytes[2]) / 1e6,
                explained[0].c_str(), explained[1].c_str());
    if (const char* const file = std::getenv("JOSTLE_SOAK_SERIES")) {
        std::ofstream out(file);
        out << "seconds,updates,median_ms,rare_ms,worst_ms,undisturbed,undisturbed_rare_ms,"
               "world_mb,process_mb,pairs\n";
        for (const Part& each : series)
            if (!each.whole.empty())
                out << each.seconds << ',' << each.ms.size() << ',' << quantile(each.ms, 0.5) << ','
                    << quantile(each.ms, 0.999) << ',' << quantile(each.ms, 1) << ',' << each.whole.size()
                    << ',' << quantile(each.whole, 0.999) << ',' << static_cast<double>(each.bytes) / 1e6
                    << ',' << static_cast<double>(each.resident) / 1e6 << ',' << each.pairs << '\n';
        EXPECT_TRUE(out.flush()) << file;
    }
}

} // namespace
