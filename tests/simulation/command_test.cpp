// SPDX-License-Identifier: MIT
// The command `jostle simulate`, as a user meets it.
#include <algorithm>

#include "tests/tool/run_tool.hpp"

#include <nlohmann/json.hpp>

#include "tool/scenes/recording.hpp"

namespace {

using tool_test::Result;

class Simulate : public tool_test::ToolTest
{
  protected:
    [[nodiscard]] nlohmann::json simulate(std::vector<std::string> arguments) const
    {
        arguments.insert(arguments.begin(), "simulate");
        arguments.insert(arguments.end(), {"--json", "-"});
        const Result result = run(arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(result.err, "");
        EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1) << result.out;
        return nlohmann::json::parse(result.out);
    }
};

TEST_F(Simulate, JsonIsOneLineWithTheSameHashOnAnyThreads)
{
    const auto one = simulate({"--scene", "mixed", "-n", "200", "--frames", "60", "--threads", "1"});
    EXPECT_EQ(one.at("frames"), 60);
    EXPECT_EQ(one.at("bodies"), 200);
    EXPECT_GT(one.at("contacts"), 50);
    EXPECT_GT(one.at("pairs"), 50);
    EXPECT_GT(one.at("energy_first"), one.at("energy_last"));
    EXPECT_EQ(one.at("hash").get<std::string>().size(), 16u);
    for (const char* stage : {"boxes", "pairs", "contacts", "responses", "motion"})
        EXPECT_GE(one.at("ms").at(stage), 0.0) << stage;
    EXPECT_LT(one.at("ms").dump().size(), 100u) << "times are rounded: " << one.at("ms");
    for (const std::vector<std::string>& other :
         {std::vector<std::string>{"--threads", "2"}, {"--threads", "7"}, {"--isa", "scalar"}}) {
        std::vector<std::string> arguments = {"--scene", "mixed", "-n", "200", "--frames", "60"};
        arguments.insert(arguments.end(), other.begin(), other.end());
        EXPECT_EQ(simulate(arguments).at("hash"), one.at("hash")) << other[1];
    }
    EXPECT_NE(simulate({"--scene", "mixed", "-n", "200", "--frames", "60", "--seed", "2"}).at("hash"),
              one.at("hash"));
}

TEST_F(Simulate, TableHasARowForEachTenthAndTheMedian)
{
    const Result result = run({"simulate", "-n", "50", "--frames", "20", "--json", "line.json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const char* part : {"spheres: 50 bodies, 20 frames", "responses", "median", "hash"})
        EXPECT_NE(result.out.find(part), std::string::npos) << part << "\n" << result.out;
    EXPECT_EQ(nlohmann::json::parse(read("line.json")).at("frames"), 20);
}

TEST_F(Simulate, RecordsEveryFrame)
{
    const auto line = simulate({"--scene", "boxes", "-n", "40", "--frames", "30", "--record", "boxes.jrec"});
    EXPECT_EQ(line.at("hash"), simulate({"--scene", "boxes", "-n", "40", "--frames", "30"}).at("hash"));
    jostle_scenes::RecordingReader reader(folder / "boxes.jrec");
    EXPECT_EQ(reader.info().objects, 40u);
    EXPECT_EQ(reader.info().frames, 31u); // the first one before any motion
    EXPECT_EQ(reader.info().frames_per_second, 60);
    std::vector<jostle::Aabb3f> first, boxes, last;
    ASSERT_TRUE(reader.next(first));
    while (reader.next(boxes))
        last = boxes;
    for (std::size_t i = 0; i < 40; ++i) {
        EXPECT_LT(last[i].lo[1], first[i].lo[1]);
        EXPECT_GT(last[i].hi[1], 0.5f);
    }
}

TEST_F(Simulate, WrongOptionsAreSaidInOneLine)
{
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"--scene", "cheese"},
          {"-n", "0"},
          {"-n", "many"},
          {"--frames", "0"},
          {"--isa", "abacus"},
          {"--threads", "0"},
          {"--json", "no/such/folder/x.json"},
          {"-n", "5", "--frames", "2", "--record", "no/such/folder/x.jrec"},
          {"-n", "5", "--frames", "2", "--record", "boxes.csv"},
          {"-n", "5", "--frames", "2", "--record", "-"},
          {"-n", "5", "--frames", "2", "--record", "x.jrec", "--json", "x.jrec"},
          {"stray"}}) {
        std::vector<std::string> all = {"simulate"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        const Result result = run(all);
        EXPECT_EQ(result.exit_code, 2) << arguments.front();
        EXPECT_EQ(result.err.rfind("jostle: ", 0), 0u) << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
    EXPECT_TRUE(files().empty());
    std::filesystem::create_directory(folder / "d.jrec");
    const Result result = run({"simulate", "-n", "5", "--frames", "2", "--record", "d.jrec"});
    EXPECT_EQ(result.err, "jostle: --record: d.jrec is a directory; give another name\n");
    EXPECT_EQ(result.out, ""); // before any work
}

} // namespace
