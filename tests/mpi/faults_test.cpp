// SPDX-License-Identifier: MIT
// What goes wrong on one rank is told on all, in the same words, and changes nothing.
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory_resource>

#include "exchange.hpp"
#include "scene.hpp"

namespace mpi_tests {
namespace {

using jostle::Aabb3f;
using jostle::mpi::Rebalance;

const jostle::mpi::WorldOptions serial{.executor = &jostle::serial_executor()};

bool says(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}
int last()
{
    return ranks() - 1;
}

Scene<3, float> some_scene(jostle::mpi::WorldOptions options = serial, std::size_t objects = 150)
{
    Scene<3, float> scene(5, 6, options);
    for (std::size_t i = 0; i < 3 * objects; ++i)
        scene.operate(objects);
    return scene;
}

TEST(Faults, WrongCommands)
{
    auto scene = some_scene();
    ASSERT_TRUE(scene.update());
    auto& world = *scene.world;
    const std::uint64_t nobodys = 3;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::vector<std::uint64_t> mine;
    world.ids(mine);
    ASSERT_TRUE(everywhere(!mine.empty()));
    const std::uint64_t id = mine.front();
    const Aabb3f good{{0, 0, 0}, {1, 1, 1}};
    const auto told = [&](const auto& command, const std::string& text) {
        for (int k = 0; k < 40; ++k)
            scene.operate(150); // good ones, which stay queued
        if (rank() == last()) command();
        const std::string failure = failure_of([&] { world.update(); });
        EXPECT_TRUE(says(failure, "rank " + std::to_string(last()) + ": ")) << failure;
        if (rank() == last()) {
            EXPECT_TRUE(says(failure, text)) << failure;
        }
        ASSERT_TRUE(scene.update()) << text;
    };
    const std::string name = "object " + std::to_string(id);
    told([&] { world.move(id, Aabb3f{{0, nan, 0}, {1, 1, 1}}); }, name + ": lo.y is NaN");
    told([&] { world.move(id, Aabb3f{{0, 0, 2}, {1, 1, 1}}); }, name + ": lo.z = 2 is greater than hi.z = 1");
    told([&] { world.move(id, good, {nan, 0, 0}); }, "displacement of " + name);
    told([&] { world.move(nobodys, good); },
         "object 3 isn't this rank's: give commands about it on the rank");
    told([&] { world.remove(nobodys); }, "object 3 isn't this rank's");
    told([&] { world.set_filter(nobodys, {}); }, "object 3 isn't this rank's");
    told([&] { world.set_enabled(nobodys, true); }, "object 3 isn't this rank's");
    told([&] { world.set_margin(id, -1); }, "margin -1 of " + name);
    told([&] { world.set_margin(id, nan); }, "margin nan of " + name);
    told([&] { world.add(nobodys, good, {.margin = -2}); }, "margin -2 of object 3");
    told([&] { world.add(id, good); }, name + " is added, and this rank has it already");
    told([&] { world.add(std::vector<std::uint64_t>{1}, std::vector<Aabb3f>{good, good}); },
         "1 ids for 2 boxes");
    EXPECT_THROW((void)world.box(nobodys), jostle::Error);
    EXPECT_THROW((void)world.bounds(nobodys), jostle::Error);
}

TEST(Faults, AnIdThatWasRemovedWaitsForTheUpdate)
{
    Scene<3, float> scene(1, 5, serial);
    auto& world = *scene.world;
    const Aabb3f box{{0, 0, 0}, {1, 1, 1}};
    if (rank() == 0) world.add(1, box), world.remove(1), world.add(1, box);
    world.update();
    EXPECT_EQ(sum(world.size()), 1u);
    const bool here = world.contains(1);
    if (here) world.remove(1), world.add(1, box);
    EXPECT_TRUE(says(failure_of([&] { world.update(); }), "until the update that removes it"));
    world.update();
    EXPECT_EQ(sum(world.size()), 0u);
    if (rank() == last()) world.add(1, box);
    world.update();
    EXPECT_EQ(sum(world.size()), 1u);
    if (rank() == last()) world.add(2, box), world.remove(2);
    world.update();
    EXPECT_EQ(sum(world.size()), 1u);
}

TEST(Faults, TwoRanksAddTheSame)
{
    if (ranks() == 1) return;
    auto scene = some_scene();
    ASSERT_TRUE(scene.update());
    for (int k = 0; k < 60; ++k)
        scene.operate(150);
    const auto there = std::find_if(scene.things.begin(), scene.things.end(),
                                    [&](const auto& each) { return scene.one.contains(each.second.id); });
    for (const std::uint64_t id : {there->first, std::uint64_t{3}}) {
        const bool adds = id == 3 ? rank() <= 1 : !scene.world->contains(id) && rank() <= 1;
        if (adds) scene.world->add(id, Aabb3f{{0, 0, 0}, {1, 1, 1}});
        for (int twice = 0; twice < 2; ++twice) // it stays queued until it is taken back
            EXPECT_TRUE(says(failure_of([&] { scene.world->update(); }),
                             "object " + std::to_string(id) + " is added, and the scene has it already"));
        if (adds) scene.world->remove(id);
        ASSERT_TRUE(scene.update());
    }
}

/// Freed memory is overwritten, so that reads after it are noticed.
class WipingMemory final : public std::pmr::memory_resource
{
    void* do_allocate(std::size_t bytes, std::size_t alignment) override
    {
        return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* place, std::size_t bytes, std::size_t alignment) override
    {
        std::memset(place, 0xA5, bytes);
        std::pmr::new_delete_resource()->deallocate(place, bytes, alignment);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};
TEST(Faults, ListsTakenAfterAFailureOutliveTheQueriesBeforeTheNextUpdate)
{
    if (ranks() == 1) return;
    WipingMemory memory;
    auto options = serial;
    options.memory = &memory;
    options.rebalance = Rebalance::on_request;
    auto scene = some_scene(options);
    for (int update = 0; update < 2; ++update) {
        ASSERT_TRUE(scene.update());
        for (int k = 0; k < 60; ++k)
            scene.operate(150);
    }
    ASSERT_TRUE(scene.update());
    auto& world = *scene.world;
    for (int failure = 0; failure < 2; ++failure) {
        // Of two ranks, and in the regions of all.
        if (rank() <= 1) world.add(3, Aabb3f{{-99, -99, -99}, {99, 99, 99}});
        EXPECT_FALSE(failure_of([&] { world.update(); }).empty());
        const auto began = world.began(), persisted = world.persisted(), changed = world.changed_pairs();
        const auto all = [&] {
            std::vector<std::array<std::uint64_t, 3>> pairs;
            for (const auto& list : {began, persisted, changed})
                for (const auto& pair : list)
                    pairs.push_back({pair.a, pair.b, static_cast<std::uint64_t>(pair.rank_of_b)});
            return pairs;
        };
        const auto before = all();
        EXPECT_GT(sum(before.size()), 0u);
        const std::vector<Aabb3f> everywhere = {{{-99, -99, -99}, {99, 99, 99}}};
        for (int query = 0; query < 2; ++query) {
            std::vector<std::uint64_t> count(1);
            world.count(std::span(everywhere), std::span(count));
            EXPECT_EQ(all(), before);
        }
        if (rank() <= 1) world.remove(3);
        if (failure == 0) {
            for (int k = 0; k < 60; ++k)
                scene.operate(150);
            ASSERT_TRUE(scene.update());
        }
    }
    ASSERT_TRUE(scene.update());
}

TEST(Faults, DifferentTermsAreRefused)
{
    const auto made = [](const jostle::mpi::WorldOptions& options) {
        return failure_of([&] { jostle::mpi::World3f world(MPI_COMM_WORLD, options); });
    };
    auto other = serial;
    other.margin = -1;
    EXPECT_TRUE(says(made(other), "rank 0: margin -1 of the world"));
    other.margin = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(says(made(other), "rank 0: margin nan of the world"));
    other = serial;
    other.memory = nullptr;
    EXPECT_TRUE(says(made(other), "rank 0: WorldOptions::memory is null"));
    if (ranks() == 1) return;
    const bool odd = rank() == last();
    other = serial;
    if (odd) other.margin = 0.5;
    EXPECT_TRUE(says(made(other), "WorldOptions::margin is 0.5, and 0 on rank 0"));
    other = serial;
    if (odd) other.migrate = false;
    EXPECT_TRUE(says(made(other), "WorldOptions::migrate is 0, and 1 on rank 0"));
    other = serial;
    if (odd) other.rebalance = Rebalance::on_request;
    EXPECT_TRUE(says(made(other), "WorldOptions::rebalance (0 automatic, 1 on request) is 1"));
    const std::string failure = failure_of([&] {
        if (odd)
            jostle::mpi::World2f world(MPI_COMM_WORLD, serial);
        else
            jostle::mpi::World3f world(MPI_COMM_WORLD, serial);
    });
    EXPECT_TRUE(says(failure, "the number of dimensions is 2, and 3 on rank 0")) << failure;
    EXPECT_TRUE(says(failure_of([&] {
                         if (odd)
                             jostle::mpi::World3d world(MPI_COMM_WORLD, serial);
                         else
                             jostle::mpi::World3f world(MPI_COMM_WORLD, serial);
                     }),
                     "the number of bytes in a coordinate is 8, and 4 on rank 0"));
}

/// What rank 0 would say first in the constructor of a World of another version.
TEST(Faults, AnotherVersionIsRefused)
{
    if (ranks() == 1) return;
    struct Terms
    {
        double margin;
        std::uint32_t version[3], dimensions, coordinate_bytes, rebalance, migrate;
    };
    for (const int part : {0, 1, 2}) {
        const std::string failure = failure_of([&] {
            if (rank() != 0) jostle::mpi::World3f world(MPI_COMM_WORLD, serial);
            MPI_Comm comm = MPI_COMM_NULL;
            MPI_Comm_dup(MPI_COMM_WORLD, &comm);
            Terms terms{0, {JOSTLE_VERSION_MAJOR, JOSTLE_VERSION_MINOR, JOSTLE_VERSION_PATCH}, 3, 4, 0, 1};
            terms.version[part] += 7;
            MPI_Bcast(&terms, sizeof terms, MPI_BYTE, 0, comm);
            try {
                jostle::mpi::Agreement(comm).settle();
            } catch (...) {
                MPI_Comm_free(&comm);
                throw;
            }
        });
        const std::uint32_t mine[] = {JOSTLE_VERSION_MAJOR, JOSTLE_VERSION_MINOR, JOSTLE_VERSION_PATCH};
        EXPECT_TRUE(says(failure, std::string("rank 1: Jostle's ") +
                                      std::array{"major", "minor", "patch"}[static_cast<std::size_t>(part)] +
                                      " version is " + std::to_string(mine[part]) + ", and " +
                                      std::to_string(mine[part] + 7) + " on rank 0"))
            << failure;
    }
}

/// One by one on the calling thread, until it is to throw.
class ThrowingExecutor final : public jostle::Executor
{
  public:
    bool throws = false;
    std::uint32_t concurrency() const noexcept override { return 2; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        if (throws) throw std::runtime_error("no thread can be started");
        for (std::uint32_t i = 0; i < count; ++i)
            task(i);
    }
};
TEST(Faults, ExecutorThatThrows)
{
    ThrowingExecutor executor;
    const double extent = 24 * std::cbrt(ranks());
    Scene<3, float> scene(8, extent, {.executor = &executor});
    for (int i = 0; i < 2500 * ranks(); ++i) // so many on each that it is asked for threads
        scene.add(world_tests::random_box<3, float>(scene.random, extent));
    ASSERT_TRUE(scene.update());
    for (const bool divides : {false, true}) {
        for (const auto& [id, thing] : std::map(scene.things))
            scene.move(id, world_tests::random_box<3, float>(scene.random, extent));
        if (divides) scene.world->request_rebalance();
        executor.throws = rank() == last();
        for (int twice = 0; twice < 2; ++twice) {
            const std::string failure = failure_of([&] { scene.world->update(); });
            EXPECT_TRUE(says(failure, "rank " + std::to_string(last()) + ": no thread can be started"))
                << failure;
        }
        executor.throws = false;
        ASSERT_TRUE(scene.update());
    }
}

TEST(Faults, PackThatThrows)
{
    if (ranks() == 1) return;
    bool throws = false;
    auto options = serial;
    options.pack = [&](std::uint64_t id, std::vector<std::byte>& payload) {
        if (throws) throw std::runtime_error("no payload of " + std::to_string(id));
        payload.assign(id % 13, std::byte(id % 251));
    };
    auto scene = some_scene(options);
    ASSERT_TRUE(scene.update());
    throws = true;
    for (int attempt = 0; attempt < 2; ++attempt) {
        for (int k = 0; k < 400; ++k)
            scene.operate(150);
        scene.world->request_rebalance();
        EXPECT_TRUE(says(failure_of([&] { scene.world->update(); }), ": no payload of "));
    }
    throws = false;
    const std::uint64_t migrated = scene.migrated;
    ASSERT_TRUE(scene.update());
    EXPECT_GT(scene.migrated, migrated);
    bool good = true;
    for (const auto& arrival : scene.world->arrived()) {
        good = good && arrival.payload.size() == arrival.id % 13 && scene.world->contains(arrival.id);
        for (const std::byte each : arrival.payload)
            good = good && each == std::byte(arrival.id % 251);
    }
    for (const std::uint64_t id : scene.world->departed())
        good = good && !scene.world->contains(id);
    EXPECT_TRUE(good);
}

/// Which rank has no memory, and how.
struct Lack
{
    Shortage shortage;
    int rank;
};
std::vector<Lack> lacks()
{
    if (!can_be_made(Shortage::of_one)) return {{Shortage::of_resource, last()}};
    return {{Shortage::of_one, last()}, {Shortage::of_all, 0}};
}

/// What can be asked of a world on this rank.
class Seen
{
  public:
    explicit Seen(const jostle::mpi::World3f& world)
        : began_(world.began().to_vector()),
          persisted_(world.persisted().begin(), world.persisted().end()), // as it is iterated
          changed_(world.changed_pairs().to_vector()),
          ended_(world.ended().begin(), world.ended().end()),
          departed_(world.departed().begin(), world.departed().end())
    {
        for (const auto& each : world.arrived())
            arrived_.emplace_back(each.id, std::vector(each.payload.begin(), each.payload.end()));
        world.ids(ids_);
        for (const std::uint64_t id : ids_) {
            boxes_.push_back(world.box(id));
            bounds_.push_back(world.bounds(id));
            kept_.emplace_back(world.filter(id), world.enabled(id));
        }
        counts_ = {world.size(), world.stats().ghosts, world.stats().members, world.stats().partitions};
    }
    friend bool operator==(const Seen& a, const Seen& b)
    {
        return are_same(a.began_, b.began_) && are_same(a.persisted_, b.persisted_) &&
               are_same(a.changed_, b.changed_) && a.ended_ == b.ended_ && a.departed_ == b.departed_ &&
               a.arrived_ == b.arrived_ && a.ids_ == b.ids_ &&
               std::equal(a.boxes_.begin(), a.boxes_.end(), b.boxes_.begin(), b.boxes_.end(),
                          same<3, float>) &&
               std::equal(a.bounds_.begin(), a.bounds_.end(), b.bounds_.begin(), b.bounds_.end(),
                          same<3, float>) &&
               a.kept_ == b.kept_ && a.counts_ == b.counts_;
    }

  private:
    using Pairs = std::vector<jostle::mpi::Pair<3, float>>;
    static bool are_same(const Pairs& a, const Pairs& b)
    {
        return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
            return x.a == y.a && x.b == y.b && x.rank_of_b == y.rank_of_b && same(x.bounds_a, y.bounds_a) &&
                   same(x.bounds_b, y.bounds_b);
        });
    }
    Pairs began_, persisted_, changed_;
    std::vector<jostle::mpi::EndedPair> ended_;
    std::vector<std::uint64_t> departed_, ids_;
    std::vector<std::pair<std::uint64_t, std::vector<std::byte>>> arrived_;
    std::vector<Aabb3f> boxes_, bounds_;
    std::vector<std::pair<jostle::ObjectFilter, bool>> kept_;
    std::array<std::uint64_t, 4> counts_{};
};

/// Fails at each allocation of an update in turn, on one rank.
void fail_everywhere(bool divides)
{
    for (const auto& [shortage, failing] : lacks()) {
        FailingMemory memory;
        auto options = serial;
        options.memory = &memory;
        options.rebalance = Rebalance::on_request;
        options.pack = [](std::uint64_t id, std::vector<std::byte>& payload) { payload.resize(id % 40); };
        auto scene = some_scene(options, 40);
        for (int update = 0; update < 2; ++update) { // the second one has pairs that go on, in another order
            ASSERT_TRUE(scene.update());
            for (int k = 0; k < 100; ++k)
                scene.operate(40);
        }
        if (divides) scene.world->request_rebalance();
        const Seen before(*scene.world);
        EXPECT_GT(fail_at_each_allocation([&] { scene.world->update(); }, shortage, memory, failing,
                                          [&] { return Seen(*scene.world) == before; }),
                  30u);
        ASSERT_TRUE(scene.update_after_world());
        for (int k = 0; k < 100; ++k)
            scene.operate(40);
        ASSERT_TRUE(scene.update());
    }
}
TEST(Faults, NoMemoryInAnUpdate)
{
    fail_everywhere(false);
}
TEST(Faults, NoMemoryWhileSpaceIsDivided)
{
    fail_everywhere(true);
}
TEST(Faults, NoMemoryToMakeSaveOrRestoreAWorld)
{
    for (const auto& [shortage, failing] : lacks()) {
        FailingMemory memory;
        auto options = serial;
        options.memory = &memory;
        const auto nothing = [] { return true; };
        (void)fail_at_each_allocation([&] { jostle::mpi::World3f world(MPI_COMM_WORLD, options); }, shortage,
                                      memory, failing, nothing);
        auto scene = some_scene(options, 40);
        ASSERT_TRUE(scene.update());
        const Seen before(*scene.world);
        const auto as_before = [&] { return Seen(*scene.world) == before; };
        std::vector<std::vector<std::byte>> parts(1);
        const std::uint64_t failures = fail_at_each_allocation([&] { parts[0] = scene.world->save(); },
                                                               shortage, memory, failing, as_before);
        EXPECT_TRUE(failures > 1 || shortage == Shortage::of_resource); // which has none of a snapshot's
        EXPECT_GT(fail_at_each_allocation([&] { scene.world->restore(parts); }, shortage, memory, failing,
                                          as_before),
                  20u);
        for (int k = 0; k < 60; ++k)
            scene.operate(40);
        ASSERT_TRUE(scene.update());
    }
}
TEST(Faults, NoMemoryToFindPairs)
{
    std::vector<std::uint64_t> ids;
    std::vector<Aabb3f> boxes;
    Random random(static_cast<std::uint64_t>(rank()));
    for (std::uint64_t i = 0; i < 40; ++i) {
        ids.push_back(i * static_cast<std::uint64_t>(ranks()) + static_cast<std::uint64_t>(rank()));
        boxes.push_back(world_tests::random_box<3, float>(random, 6));
    }
    const auto expected = jostle::mpi::find_pairs(MPI_COMM_WORLD, boxes, ids, serial);
    for (const auto& [shortage, failing] : lacks()) {
        FailingMemory memory;
        auto options = serial;
        options.memory = &memory;
        std::vector<jostle::mpi::Pair<3, float>> found;
        EXPECT_GT(fail_at_each_allocation(
                      [&] { found = jostle::mpi::find_pairs(MPI_COMM_WORLD, boxes, ids, options); }, shortage,
                      memory, failing, [&] { return found.empty(); }),
                  30u);
        EXPECT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), expected.end(),
                               [](const auto& a, const auto& b) { return a.a == b.a && a.b == b.b; }));
    }
}
TEST(Faults, NoMemoryForACommandOrAWorld)
{
    FailingMemory memory;
    auto options = serial;
    options.memory = &memory;
    Scene<3, float> scene(5, 6, options);
    if (rank() == last()) {
        memory.left = 0;
        scene.world->add(3, Aabb3f{{0, 0, 0}, {1, 1, 1}});
        memory.left = std::numeric_limits<std::int64_t>::max();
        EXPECT_FALSE(scene.world->contains(3));
    }
    EXPECT_TRUE(says(failure_of([&] { scene.world->update(); }), "no memory left"));
    ASSERT_TRUE(scene.update());
    if (rank() == last()) memory.left = 0;
    EXPECT_TRUE(
        says(failure_of([&] { jostle::mpi::World3f world(MPI_COMM_WORLD, options); }), "no memory left"));
    memory.left = std::numeric_limits<std::int64_t>::max();
}

/// Every kind of command, out of memory at each of its allocations in turn: no effect, until it has all.
TEST(Faults, NoMemoryForAnyCommand)
{
    const Aabb3f box{{1, 1, 1}, {2, 2, 2}};
    const jostle::ObjectFilter filter{.category = 6, .mask = 3, .owner = 4};
    const std::function<void(jostle::mpi::World3f&, std::uint64_t)> commands[] = {
        [&](auto& world, auto id) { world.move(id, box, {1, 0, 2}); },
        [&](auto& world, auto id) { world.set_filter(id, filter); },
        [](auto& world, auto id) { world.set_margin(id, 0.5f); },
        [](auto& world, auto id) { world.set_enabled(id, false); },
        [](auto& world, auto id) { world.remove(id); },
        [&](auto& world, auto) { world.add(3, box, {.filter = filter}); }};
    std::int64_t failures = 0;
    for (const auto& command : commands) {
        FailingMemory memory;
        auto options = serial;
        options.memory = &memory;
        options.migrate = false;
        std::int64_t allocations = -1;
        bool failed = true;
        while (failed) {
            Scene<3, float> scene(5, 6, options);
            std::uint64_t id = 0;
            for (float x = 0; x < 4; ++x)
                id = scene.add({{x, 0, 0}, {x + 1.5f, 1, 1}}, last());
            ASSERT_TRUE(scene.update());
            const Seen before(*scene.world);
            ++allocations;
            if (rank() == last()) {
                memory.left = allocations;
                command(*scene.world, id);
                memory.left = std::numeric_limits<std::int64_t>::max();
            }
            const std::string failure = failure_of([&] { scene.world->update(); });
            failed = !failure.empty();
            if (!failed) break;
            EXPECT_TRUE(says(failure, "rank " + std::to_string(last()) + ": no memory left")) << failure;
            ASSERT_TRUE(everywhere(Seen(*scene.world) == before));
            ASSERT_TRUE(scene.update());
        }
        failures += allocations;
    }
    EXPECT_GT(failures, 5);
}

TEST(Exchange, EveryMessageArrivesOnceFromItsSource)
{
    MPI_Comm comm;
    MPI_Comm_dup(MPI_COMM_WORLD, &comm);
    jostle::mpi::Exchange exchange(comm, std::pmr::get_default_resource());
    for (std::uint64_t round = 0; round < 200; ++round) {
        const auto bytes_for = [&](int from, int to) { // 0: no message
            const std::uint64_t drawn =
                Random(round, static_cast<unsigned>(from), static_cast<unsigned>(to)).next();
            return drawn % 3 == 0 ? drawn % (round % 20 == 0 ? 300'000 : 100) : 0;
        };
        jostle::mpi::Agreement agreement(comm);
        std::uint64_t sent = 0;
        for (int to = 0; to < ranks(); ++to)
            if (const std::uint64_t count = bytes_for(rank(), to); count != 0) {
                exchange.to(to).assign(count, std::byte(1 + (rank() * 31 + to) % 200));
                sent += to != rank();
            }
        exchange.seal();
        exchange.start(agreement);
        exchange.finish(agreement);
        bool good = exchange.messages_sent() == sent;
        auto message = exchange.received().begin();
        for (int from = 0; from < ranks(); ++from) {
            const std::uint64_t count = bytes_for(from, rank());
            if (count == 0 || from == rank()) continue;
            good = good && message != exchange.received().end() && message->source == from &&
                   message->bytes.size() == (count + 7) / 8 * 8;
            for (std::size_t i = 0; good && i < message->bytes.size(); ++i)
                good = message->bytes[i] ==
                       (i < count ? std::byte(1 + (from * 31 + rank()) % 200) : std::byte{});
            ++message;
        }
        good = good && message == exchange.received().end();
        exchange.clear();
        ASSERT_TRUE(everywhere(good)) << "round " << round;
    }
    MPI_Comm_free(&comm);
}

} // namespace
} // namespace mpi_tests
