// SPDX-License-Identifier: MIT
// jostle bench and jostle demo, run as their users run them.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>

#include "jostle/find_pairs.hpp"
#include "tool/scenes/recording.hpp"
#include "tool/scenes/scenes.hpp"

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

struct Result
{
    int exit_code;
    std::string out, err;
};

class Commands : public testing::Test
{
  protected:
    Commands()
    {
        std::string name = (fs::temp_directory_path() / "jostle-commands-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
        folder = name;
    }
    ~Commands() override { fs::remove_all(folder); }

    /// `arguments` as a shell takes them.
    Result run(const std::string& arguments, const std::string& program = JOSTLE_TOOL_PATH) const
    {
        const std::string command = "cd '" + folder.string() + "' && '" + program + "' " + arguments +
                                    " >out.txt 2>err.txt </dev/null";
        const int status = std::system(command.c_str());
        Result result{WIFEXITED(status) ? WEXITSTATUS(status) : -1, text("out.txt"), text("err.txt")};
        fs::remove(folder / "out.txt");
        fs::remove(folder / "err.txt");
        return result;
    }
    std::string text(const std::string& name) const
    {
        std::ifstream file(folder / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    void record(const std::string& name, std::uint64_t frames) const
    {
        jostle_scenes::Scene<2, double> scene("uniform", 300);
        jostle_scenes::RecordingWriter<2, double> writer(folder / name, 300, 60, "three hundred squares");
        for (std::uint64_t frame = 0; frame < frames; ++frame, scene.step())
            writer.add_frame(scene.boxes());
        writer.finish();
    }
    static void expect_usage_error(const Result& result, const std::string& part)
    {
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(result.out, "");
        EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }

    fs::path folder;
};

/// Pairs and checksum of a scene's fourth frame, the first that bench counts.
template <int Dim, class T>
std::pair<std::uint64_t, std::string> expected_answer(const std::string& name, std::size_t n)
{
    jostle_scenes::Scene<Dim, T> scene(name, n);
    for (int frame = 0; frame < 3; ++frame)
        scene.step();
    const auto pairs = jostle::find_pairs_brute_force(jostle::BoxView(scene.boxes()));
    char hex[17];
    std::snprintf(hex, sizeof hex, "%016llx", static_cast<unsigned long long>(jostle::pair_checksum(pairs)));
    return {pairs.size(), hex};
}

} // namespace

TEST_F(Commands, BenchMeasuresTheSevenScenesWithEveryEngine)
{
    for (const std::string engine : {"default", "chapter", "brute"}) {
        SCOPED_TRACE(engine);
        const Result result = run("bench -n 1000,300 --threads 2,1 --frames 3 --json - --engine " + engine);
        ASSERT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(result.err, ""); // no progress where nobody watches
        const json rows = json::parse(result.out);
        ASSERT_EQ(rows.size(), 7u * 2 * 2);
        std::set<std::string> scenes;
        for (const json& row : rows) {
            scenes.insert(row["scene"].get<std::string>());
            EXPECT_EQ(row["system"], engine == "default" ? "jostle" : engine);
            const auto [pairs, checksum] = expected_answer<3, float>(row["scene"], row["n"]);
            EXPECT_EQ(row["pairs"], pairs);
            EXPECT_EQ(row["checksum"], checksum);
            EXPECT_GT(row["min_ms"], 0.0);
            EXPECT_LE(row["min_ms"], row["median_ms"]);
            EXPECT_LE(row["median_ms"], row["max_ms"]);
            EXPECT_EQ(row["frames"], 3);
            EXPECT_EQ(row["stages"].empty(), engine != "default");
        }
        EXPECT_EQ(scenes, (std::set<std::string>{"uniform", "dense", "powerlaw", "mixed", "clustered", "flat",
                                                 "resting"}));
    }
}

TEST_F(Commands, BenchTakesOtherDimensionsTypesAndInstructionSets)
{
    for (const jostle::InstructionSet set : jostle::supported_instruction_sets())
        for (const int dim : {2, 3})
            for (const bool with_double : {false, true}) {
                const Result result = run(
                    "bench lattice giant points -n 500 --frames 1 --json rows.json --dim " +
                    std::to_string(dim) + (with_double ? " --double" : "") + " --isa " + jostle::name(set));
                ASSERT_EQ(result.exit_code, 0) << result.err;
                EXPECT_NE(result.out.find("lattice"), std::string::npos); // the table
                const json rows = json::parse(text("rows.json"));
                ASSERT_EQ(rows.size(), 3u);
                for (const json& row : rows) {
                    const std::string scene = row["scene"];
                    const auto [pairs, checksum] =
                        dim == 2 ? (with_double ? expected_answer<2, double>(scene, 500)
                                                : expected_answer<2, float>(scene, 500))
                                 : (with_double ? expected_answer<3, double>(scene, 500)
                                                : expected_answer<3, float>(scene, 500));
                    EXPECT_EQ(row["pairs"], pairs) << row;
                    EXPECT_EQ(row["checksum"], checksum) << row;
                    EXPECT_EQ(row["isa"], jostle::name(set));
                    EXPECT_EQ(row["dim"], dim);
                    EXPECT_EQ(row["type"], with_double ? "double" : "float");
                }
            }
}

TEST_F(Commands, BenchSaysWhatIsWrongInOneLine)
{
    expect_usage_error(run("bench unifrom"), "there is no scene 'unifrom'; did you mean uniform?");
    expect_usage_error(run("bench -n 0"), "-n");
    expect_usage_error(run("bench -n 1000,many"), "-n");
    expect_usage_error(run("bench --threads 0"), "--threads");
    expect_usage_error(run("bench --dim 4"), "--dim");
    expect_usage_error(run("bench --engine fast"), "choose default, chapter or brute");
    expect_usage_error(run("bench --isa mmx"),
                       "choose from " +
                           std::string(jostle::name(jostle::supported_instruction_sets().front())));
    expect_usage_error(run("bench identical -n 1000000"), "499999500000 pairs; give -n at most 20000");
    expect_usage_error(run("bench uniform -n 100 --json no/such.json"), "no/such.json");
    expect_usage_error(run("bench uniform -n 100 --report no/such.html"), "no is no folder");
    expect_usage_error(run("bench --peers --double"), "--peers");
    expect_usage_error(run("bench --dim 2.0"), "--dim: 2.0 is not a whole number from 2 to 3");
    expect_usage_error(run("bench --frames 0"), "--frames: 0 is not a whole number from 1 to 100000");
    expect_usage_error(run("bench uniform -n 100 --json x --report x"), "--report and --json name one file");
    const char* const path = std::getenv("PATH");
    ASSERT_NE(path, nullptr);
    const std::string usual = path;
    ASSERT_EQ(setenv("PATH", "/nowhere", 1), 0);
    const Result no_gnuplot = run("bench uniform -n 100 --report r.html");
    ASSERT_EQ(setenv("PATH", usual.c_str(), 1), 0);
    expect_usage_error(no_gnuplot, "apt-get install gnuplot-nox"); // and nothing was measured
    EXPECT_TRUE(fs::is_empty(folder));
}

TEST_F(Commands, BenchMeasuresPeersWhereTheBuildHasThem)
{
    const Result result = run("bench uniform resting -n 1000 --threads 2,1 --frames 2 --peers --json -");
#ifdef JOSTLE_WITH_PEERS
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::map<std::tuple<std::string, std::string, int>, int> seen;
    for (const json& row : json::parse(result.out)) {
        EXPECT_EQ((++seen[{row["system"], row["scene"], row["threads"]}]), 1) << row;
        if (row["system"] == "floor") continue;
        const auto [pairs, checksum] = expected_answer<3, float>(row["scene"], 1000);
        EXPECT_EQ(row["pairs"], pairs) << row;
        EXPECT_EQ(row["checksum"], checksum) << row;
    }
    for (const char* system : {"jostle", "embree", "floor"})
        for (const int threads : {1, 2})
            EXPECT_EQ((seen.count({system, "resting", threads})), 1u) << system;
    EXPECT_EQ((seen.count({"fcl", "uniform", 1})), 1u); // one-threaded: once
    EXPECT_EQ((seen.count({"fcl", "uniform", 2})), 0u);
#else
    expect_usage_error(result, "JOSTLE_BENCH=ON");
#endif
}

TEST_F(Commands, DemoPlaysTheRecordingOfTheRepository)
{
    const Result result = run("demo -n 3000 --frames 2 --threads 2");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    for (const char* part : {"tumble.jrec: 1,500 boxes, 220 frames", "on 2 threads", "typical",
                             "23 frames checked against brute force", "3,000 boxes, all moving",
                             "boxes checked against brute force", "Next:\n"})
        EXPECT_NE(result.out.find(part), std::string::npos) << part << "\n" << result.out;
    EXPECT_LT(std::count(result.out.begin(), result.out.end(), '\n'), 40);
}

TEST_F(Commands, DemoIsAProgramOfItsOwnAsWell)
{
    const Result result = run("", JOSTLE_DEMO_PATH);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const char* part :
         {"tumble.jrec: 1,500 boxes, 220 frames", "1,000,000 boxes, all moving", "Next:\n"})
        EXPECT_NE(result.out.find(part), std::string::npos) << part << "\n" << result.out;
    expect_usage_error(run("-n 100", JOSTLE_DEMO_PATH), "jostle_demo takes no arguments; jostle demo does");
}

TEST_F(Commands, DemoPlaysOtherRecordingsAndSaysWhatIsWrongWithThem)
{
    record("squares.jrec", 25);
    const Result result = run("demo --recording squares.jrec -n 100 --frames 1 --threads 1");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("squares.jrec: 300 boxes, 25 frames\n  three hundred squares\n  on 1 thread,"),
              std::string::npos)
        << result.out;
    EXPECT_NE(result.out.find("4 frames checked"), std::string::npos) << result.out;

    expect_usage_error(run("demo --recording none.jrec"), "none.jrec: can't be read: No such file");
    std::ofstream(folder / "text.jrec") << std::string(100, 'x');
    expect_usage_error(run("demo --recording text.jrec"), "text.jrec: is no recording");
    fs::resize_file(folder / "squares.jrec", fs::file_size(folder / "squares.jrec") - 1);
    const Result cut = run("demo --recording squares.jrec");
    EXPECT_EQ(cut.exit_code, 2);
    EXPECT_NE(cut.err.find("squares.jrec: is truncated: it ends inside frame 25 of 25"), std::string::npos)
        << cut.err;
    record("empty.jrec", 0);
    EXPECT_EQ(run("demo --recording empty.jrec").exit_code, 2);
}
