// SPDX-License-Identifier: MIT
// What goes wrong on one rank is told on all, in the same words, and changes nothing.
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
    told([&] { world.move(nobodys, good); }, "object 3 isn't this rank's");
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

TEST(Faults, DifferentTermsAreRefused)
{
    const auto made = [](const jostle::mpi::WorldOptions& options) {
        return failure_of([&] { jostle::mpi::World3f world(MPI_COMM_WORLD, options); });
    };
    auto other = serial;
    other.margin = -1;
    EXPECT_TRUE(says(made(other), "rank 0: margin -1 of the world"));
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

/// Fails at each allocation of an update in turn, on one rank.
void fail_everywhere(bool divides, int failing)
{
    FailingMemory memory;
    auto options = serial;
    options.memory = &memory;
    options.rebalance = Rebalance::on_request;
    auto scene = some_scene(options, 60);
    ASSERT_TRUE(scene.update());
    std::uint64_t failures = 0;
    for (int round = 0; round < 2; ++round) {
        for (int k = 0; k < 120; ++k)
            scene.operate(60);
        if (divides) scene.world->request_rebalance();
        for (std::int64_t given = 0;; given += 1 + given / 8) {
            if (rank() == failing) memory.left = given;
            const std::string failure = failure_of([&] { scene.world->update(); });
            memory.left = std::numeric_limits<std::int64_t>::max();
            if (failure.empty()) break;
            ASSERT_TRUE(says(failure, "rank " + std::to_string(failing) + ": no memory left")) << failure;
            ++failures;
            // What can be asked is what it was.
            std::uint64_t objects = 0, found = 0;
            for (const auto& [id, thing] : scene.things)
                if (scene.one.contains(thing.id)) {
                    ++objects;
                    if (!scene.world->contains(id)) continue;
                    ++found;
                    ASSERT_TRUE(same(scene.world->box(id), scene.one.box(thing.id)));
                }
            ASSERT_EQ(sum(found), objects);
        }
        ASSERT_TRUE(scene.update_after_world());
    }
    EXPECT_GT(failures, 10u);
}
TEST(Faults, NoMemoryInAnUpdate)
{
    fail_everywhere(false, last());
    fail_everywhere(false, 0);
}
TEST(Faults, NoMemoryWhileSpaceIsDivided)
{
    fail_everywhere(true, last());
    fail_everywhere(true, 0);
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
