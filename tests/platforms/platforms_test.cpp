// SPDX-License-Identifier: MIT
// The same answers on every platform: pairs, events, contacts and motion of seeded scenes hash to what
// golden/table.txt says, on any number of threads and any instruction set.
#include <memory>
#include <sstream>

#include "golden.hpp"
#include "jostle/jostle.hpp"
#include "jostle/recorder.hpp"
#include "tool/simulation/simulation.hpp"

namespace platforms_test {
namespace {

/// FNV-1a over numbers, their lowest byte first.
class Hash
{
  public:
    template <class... Numbers>
    void add(Numbers... numbers)
    {
        (add_one(static_cast<std::uint64_t>(numbers)), ...);
    }
    [[nodiscard]] std::uint64_t value() const { return value_; }

  private:
    void add_one(std::uint64_t number)
    {
        for (int byte = 0; byte < 8; ++byte)
            value_ = (value_ ^ (number >> 8 * byte & 0xff)) * 0x100000001b3u;
    }
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// Twelve frames of a world in which a third of a scene's objects moves, comes and goes; `after` is called
/// after each update.
template <class After>
void play(jostle::World3f& world, jostle_scenes::Scene<3, float>& scene, const After& after)
{
    std::vector<jostle::ObjectId> ids(scene.boxes().size());
    for (std::uint32_t frame = 0; frame < 12; ++frame) {
        const std::span<const jostle::Aabb3f> boxes = scene.boxes();
        for (std::uint32_t i = 0; i < ids.size(); ++i) {
            if (frame == 0 || (i % 7 == 0 && i % 5 == frame % 5 && !world.contains(ids[i])))
                ids[i] = world.add(boxes[i], {{1u << i % 3, i % 4 == 0 ? 3u : 7u, i / 2}});
            else if (i % 7 == 0 && i % 11 == frame && world.contains(ids[i]))
                world.remove(ids[i]);
            else if (i % 3 == 0 && world.contains(ids[i]))
                world.move(ids[i], boxes[i]);
        }
        world.update();
        after();
        scene.step();
    }
}

using Table = std::vector<std::pair<std::string, std::uint64_t>>;

/// Beside the calling thread alone; where threads can't be had there is no more.
std::vector<std::uint32_t> thread_counts()
{
#if defined(__EMSCRIPTEN__) && !defined(__EMSCRIPTEN_PTHREADS__)
    return {};
#else
    return {2, 3, 8};
#endif
}

template <int Dim, class T>
std::uint64_t hash_of_pairs(std::string_view scene_name, jostle::PairFinder& finder)
{
    Hash hash;
    jostle_scenes::Scene<Dim, T> scene(scene_name, 1'000);
    for (int frame = 0; frame < 2; ++frame, scene.step()) {
        const jostle::PairBuffer& pairs = finder.find(scene.boxes());
        hash.add(pairs.size());
        for (const jostle::Pair& pair : pairs)
            hash.add(pair.a, pair.b);
    }
    return hash.value();
}

std::uint64_t hash_of_events(std::string_view scene_name, const jostle::WorldOptions& options)
{
    Hash hash;
    jostle::World3f world(options);
    jostle_scenes::Scene<3, float> scene(scene_name, 300);
    play(world, scene, [&] {
        hash.add(world.began().size(), world.ended().size(), world.persisted().size());
        for (const jostle::ObjectPair& pair : world.began())
            hash.add(pair.a.index, pair.a.generation, pair.b.index, pair.b.generation);
        for (const jostle::EndedPair& pair : world.ended())
            hash.add(pair.a.index, pair.b.index, pair.reason);
        for (const jostle::Pair& pair : world.persisted())
            hash.add(pair.a, pair.b);
    });
    for (const std::byte byte : world.save())
        hash.add(byte);
    return hash.value();
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
        const std::string name(scene.name);
        table.emplace_back("pairs_3f_" + name, hash_of_pairs<3, float>(name, finder));
        table.emplace_back("pairs_2d_" + name, hash_of_pairs<2, double>(name, finder));
        if (!scene.hostile) table.emplace_back("events_" + name, hash_of_events(name, of_world));
    }
    for (const jostle_simulation::SceneInfo& scene : jostle_simulation::scene_list()) {
        jostle_simulation::Options options;
        options.scene = scene.name;
        options.bodies = 60;
        options.executor = &executor;
        options.instruction_set = set;
        jostle_simulation::Simulation simulation(options);
        std::uint64_t contacts = 0;
        for (int frame = 0; frame < 60; ++frame) {
            simulation.step();
            contacts += simulation.contacts();
        }
        EXPECT_GT(contacts, 300u) << scene.name;
        table.emplace_back("bodies_" + std::string(scene.name), simulation.hash());
    }
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
