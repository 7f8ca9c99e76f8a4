// SPDX-License-Identifier: MIT
// Snapshots in parts, restored on other numbers of ranks than saved them.
#include "scene.hpp"

namespace mpi_tests {
namespace {

using Bytes = std::vector<std::byte>;
const jostle::mpi::WorldOptions serial{.executor = &jostle::serial_executor()};

/// All parts, in the order of the ranks that wrote them.
std::vector<Bytes> all_parts(const Bytes& mine)
{
    const auto sizes = gathered(std::span<const std::uint64_t>(std::vector<std::uint64_t>{mine.size()}));
    const Bytes bytes = gathered(std::span<const std::byte>(mine));
    std::vector<Bytes> parts;
    std::size_t at = 0;
    for (const std::uint64_t size : sizes) {
        if (size != 0)
            parts.emplace_back(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                               bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
        at += size;
    }
    return parts;
}

template <int Dim, class T, class Owner>
void save_and_go_on(jostle::mpi::WorldOptions options, const Owner& owner)
{
    Scene<Dim, T> scene(11, 8, options);
    for (int update = 0; update < 4; ++update) {
        for (int k = 0; k < 150; ++k)
            scene.operate(200);
        ASSERT_TRUE(scene.update());
    }
    const std::vector<Bytes> parts = all_parts(scene.world->save());
    ASSERT_EQ(parts.size(), static_cast<std::size_t>(ranks()));
    std::vector<Bytes> mine;
    for (std::size_t i = 0; i < parts.size(); ++i)
        if (owner(i) == rank()) mine.push_back(parts[i]);
    auto other = options;
    other.margin = 3; // gives way to the one that was saved
    scene.world = std::make_unique<jostle::mpi::World<Dim, T>>(MPI_COMM_WORLD, other);
    if (rank() == 0) scene.world->add(3, typename Scene<Dim, T>::Box{}); // is forgotten
    scene.world->update();
    scene.world->restore(mine);
    EXPECT_TRUE(scene.world->began().empty() && scene.world->arrived().empty());
    scene.one.update(); // nothing
    for (int update = 0; update < 4; ++update) {
        ASSERT_TRUE(scene.update()) << update;
        for (int k = 0; k < 150; ++k)
            scene.operate(200);
    }
}
TEST(Snapshot, GoesOnAsIfNothingHadHappened)
{
    save_and_go_on<3, float>(serial, [](std::size_t i) { return static_cast<int>(i); });
    save_and_go_on<2, double>({.executor = &jostle::serial_executor(), .margin = 0.25, .migrate = false},
                              [](std::size_t i) { return ranks() - 1 - static_cast<int>(i); });
}
TEST(Snapshot, AllPartsOnOneRank)
{
    save_and_go_on<3, double>(serial, [](std::size_t) { return ranks() / 2; });
}

/// Objects in worlds of one rank and of all but the last, restored on all.
TEST(Snapshot, OnMoreRanksThanBefore)
{
    for (const int savers : {1, std::max(1, ranks() - 1)}) {
        Scene<3, float> scene(12, 8, serial);
        MPI_Comm some;
        MPI_Comm_split(MPI_COMM_WORLD, rank() < savers ? 0 : MPI_UNDEFINED, rank(), &some);
        std::unique_ptr<jostle::mpi::World3f> fewer;
        if (some != MPI_COMM_NULL) fewer = std::make_unique<jostle::mpi::World3f>(some, serial);
        for (int i = 0; i < 300; ++i) {
            const auto box = world_tests::random_box<3, float>(scene.random, 8);
            const std::uint64_t id = scene.add(box, ranks()); // nobody's yet
            if (i % savers == rank()) fewer->add(id, box);
        }
        Bytes mine;
        if (fewer) {
            fewer->update();
            mine = fewer->save();
        }
        const std::vector<Bytes> parts = all_parts(mine);
        ASSERT_EQ(parts.size(), static_cast<std::size_t>(savers));
        scene.world->restore(rank() == ranks() - 1 ? parts : std::vector<Bytes>{});
        scene.one.update();
        for (int update = 0; update < 3; ++update) {
            for (int k = 0; k < 100; ++k)
                scene.operate(300);
            ASSERT_TRUE(scene.update());
        }
        fewer.reset();
        if (some != MPI_COMM_NULL) MPI_Comm_free(&some);
    }
}

TEST(Snapshot, WhatIsWrongIsSaidAndChangesNothing)
{
    Scene<3, float> scene(13, 8, serial);
    for (int k = 0; k < 300; ++k)
        scene.operate(100);
    ASSERT_TRUE(scene.update());
    const std::vector<Bytes> parts = all_parts(scene.world->save());
    for (int k = 0; k < 100; ++k)
        scene.operate(100);
    ASSERT_TRUE(scene.update());
    const std::vector<Bytes> others = all_parts(scene.world->save());
    const auto tell = [&](const std::vector<Bytes>& given) {
        return failure_of([&] { scene.world->restore(given); });
    };
    const auto says = [](const std::string& text, const char* part) {
        return text.find(part) != std::string::npos;
    };
    const bool last = rank() == ranks() - 1;
    const std::vector<Bytes> none;
    EXPECT_TRUE(says(tell(none), "no rank was given any"));
    std::vector<Bytes> given = parts;
    given.push_back(parts.front());
    EXPECT_TRUE(says(tell(last ? given : none), "number 0 of"));
    if (ranks() > 1) {
        given = parts;
        given.pop_back();
        EXPECT_TRUE(says(tell(last ? given : none), "is missing"));
        given.push_back(others.back());
        EXPECT_TRUE(says(tell(last ? given : none), "parts of different snapshots"));
    }
    for (std::size_t length = 0; length < parts.back().size(); length += 1 + length / 3) {
        given = parts;
        given.back().resize(length);
        EXPECT_TRUE(says(tell(last ? given : none), "part of a snapshot: it is ")) << length;
    }
    for (std::size_t at = 0; at < parts.back().size(); at += 1 + at / 3) {
        given = parts;
        given.back()[at] ^= std::byte{1};
        EXPECT_TRUE(says(tell(last ? given : none), "part of a snapshot: it ")) << at;
    }
    jostle::mpi::World2d other(MPI_COMM_WORLD, serial);
    EXPECT_TRUE(says(failure_of([&] { other.restore(last ? parts : none); }),
                     "of a world of 3 dimensions and coordinates of 4 bytes, and this one has 2 and 8"));
    for (int k = 0; k < 100; ++k)
        scene.operate(100);
    ASSERT_TRUE(scene.update());
}

} // namespace
} // namespace mpi_tests
