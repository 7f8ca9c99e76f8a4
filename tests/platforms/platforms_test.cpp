// SPDX-License-Identifier: MIT
// The same answers on every platform: pairs, events, contacts and motion of seeded scenes hash to what
// golden/table.txt says, on any number of threads and any instruction set.
#include <memory>
#include <sstream>

#include "golden.hpp"
#include "hash_of_bodies.hpp"
#include "hash_of_events.hpp"
#include "hash_of_pairs.hpp"
#include "jostle/jostle.hpp"
#include "jostle/recorder.hpp"

namespace platforms_test {
namespace {

/// Beside the calling thread alone; where threads can't be had there is no more.
std::vector<std::uint32_t> thread_counts()
{
#if defined(__EMSCRIPTEN__) && !defined(__EMSCRIPTEN_PTHREADS__)
    return {};
#else
    return {2, 3, 8};
#endif
}

Table compute(jostle::Executor& executor, jostle::InstructionSet set)
{
    Table table;
    jostle::FinderOptions finding;
    finding.executor = &executor;
    finding.instruction_set = set;
    jostle::PairFinder finder(finding);
    jostle::WorldOptions of_world;
    of_world.executor = &executor;
    of_world.instruction_set = set;
    for (const jostle_scenes::SceneInfo& scene : jostle_scenes::scene_list()) {
        add_pairs(table, scene.name, finder);
        if (!scene.hostile) add_events(table, scene.name, of_world);
    }
    EXPECT_GT(add_bodies(table, executor, set), 300u);
    return table;
}

std::string text(const Table& table)
{
    std::ostringstream lines;
    for (const auto& [what, hash] : table)
        lines << what << " " << std::hex << hash << "\n";
    return lines.str();
}

TEST(Platforms, OneTable)
{
    const auto sets = jostle::supported_instruction_sets();
    const std::string first = text(compute(jostle::serial_executor(), sets.front()));
    expect_golden("table.txt", first);
    const std::string expected = read_file(golden("table.txt"));
    for (const jostle::InstructionSet set : sets)
        EXPECT_EQ(text(compute(jostle::default_executor(), set)), expected) << jostle::name(set);
    for (const std::uint32_t threads : thread_counts())
        EXPECT_EQ(text(compute(*jostle::make_thread_executor(threads), sets.front())), expected)
            << threads << " threads";
}

TEST(Platforms, ASnapshotIsTheSameBytesAndIsReadEverywhere)
{
    jostle::World3f world;
    auto scene = small_scene();
    play(world, scene, [] {});
    const auto text_of = [](const std::vector<std::byte>& bytes) {
        return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    };
    ASSERT_GT(world.size(), 40u);
    expect_golden("world.snapshot", text_of(world.save()));

    const std::string file = read_file(golden("world.snapshot"));
    jostle::World3f read;
    read.restore(std::as_bytes(std::span<const char>(file)));
    EXPECT_EQ(read.size(), world.size());
    for (std::uint32_t i = 0; i < world.index_end(); ++i) {
        const jostle::ObjectId id = world.id(i);
        ASSERT_EQ(read.id(i), id);
        if (id == jostle::ObjectId{}) continue;
        EXPECT_TRUE(same(read.box(id), world.box(id)));
        EXPECT_EQ(read.filter(id), world.filter(id));
    }
    EXPECT_TRUE(read.save() == world.save());
}

TEST(Platforms, ARecorderWritesTheSameBytes)
{
    const std::string path = testing::TempDir() + "jostle_platforms_test.jrec";
    {
        jostle::Recorder<3, float> recorder(path, 60, "for every platform");
        auto scene = small_scene();
        for (int frame = 0; frame < 3; ++frame, scene.step())
            ASSERT_TRUE(recorder.frame(scene.boxes())) << recorder.problem();
        ASSERT_TRUE(recorder.close()) << recorder.problem();
    }
    expect_golden("recorder.jrec", read_file(path));
    std::remove(path.c_str());
}

} // namespace
} // namespace platforms_test
