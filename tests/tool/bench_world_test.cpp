// SPDX-License-Identifier: MIT
#include <cstdio>
#include <map>
#include <set>

#include <nlohmann/json.hpp>

#include "jostle/box_index.hpp"
#include "jostle/find_pairs.hpp"
#include "run_tool.hpp"
#include "tool/asker.hpp"
#include "tool/scenes/scenes.hpp"

namespace tool_test {
namespace {

TEST_F(ToolTest, BenchWorldMeasuresWhatItFinds)
{
    const Result result = run({"bench", "world", "resting", "moving", "churn", "-n", "700", "--threads",
                               "1,2", "--frames", "6", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const nlohmann::json rows = nlohmann::json::parse(result.out);
    std::map<std::string, std::set<std::string>> checksums;
    for (const auto& row : rows) {
        EXPECT_EQ(row["n"], 700);
        EXPECT_EQ(row["frames"], 6);
        EXPECT_LE(row["min_ms"], row["median_ms"]);
        EXPECT_LE(row["median_ms"], row["p99_ms"]);
        EXPECT_LE(row["p99_ms"], row["max_ms"]);
        EXPECT_GT(row["pairs"], 500);
        checksums[row["scene"]].insert(row["checksum"]);
    }
    EXPECT_EQ(rows.size(), 8u) << "moving has a second system, the stateless engine";
    ASSERT_EQ(checksums.size(), 3u);
    for (const auto& [scene, sums] : checksums)
        EXPECT_EQ(sums.size(), 1u) << scene << ": all systems have the same pairs";
    // Those of the scene itself, after as many steps.
    jostle_scenes::Scene<3, float> scene("resting", 700, 1);
    for (int step = 0; step < 8; ++step)
        scene.step();
    char sum[17];
    std::snprintf(sum, sizeof sum, "%016llx",
                  static_cast<unsigned long long>(jostle::pair_checksum(jostle::find_pairs(scene.boxes()))));
    EXPECT_EQ(checksums["resting"], std::set<std::string>{sum});
}

TEST_F(ToolTest, BenchWorldAsksAboutWhereTheBoxesAreNow)
{
    const Result result = run({"bench", "world", "rays", "overlaps", "nearest", "-n", "700", "--threads",
                               "1,2", "--frames", "3", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    // A BoxIndex of the scene's boxes after as many steps, asked the same.
    jostle_scenes::Scene<3, float> scene("resting", 700, 1);
    jostle_tool::Asker asker(scene.boxes(), 1);
    const jostle_bench::Queries queries = asker.make({jostle_bench::QueryKind::first, 4000});
    for (int step = 0; step < 8; ++step)
        scene.step();
    jostle::BoxIndex3f index;
    index.build(scene.boxes());
    std::vector<jostle::Hit<float>> hits(4000);
    index.first(std::span<const jostle::Ray3f>(queries.rays), std::span(hits));
    jostle_bench::Answers expected;
    for (std::size_t i = 0; i < hits.size(); ++i)
        if (hits[i].id != hits[i].none) expected.add_object(i, hits[i].id);
    char sum[17];
    std::snprintf(sum, sizeof sum, "%016llx", static_cast<unsigned long long>(expected.checksum));
    std::map<std::string, std::set<std::string>> checksums;
    const nlohmann::json rows = nlohmann::json::parse(result.out);
    EXPECT_EQ(rows.size(), 6u);
    for (const auto& row : rows) {
        EXPECT_EQ(row["queries"], 4000);
        EXPECT_GT(row["results"], 1000) << row;
        EXPECT_LE(row["median_ms"], row["p99_ms"]);
        EXPECT_GT(row["stages"]["update"], 0) << row;
        checksums[row["scene"]].insert(row["checksum"]);
    }
    ASSERT_EQ(checksums.size(), 3u);
    EXPECT_EQ(checksums["rays"], std::set<std::string>{sum});
    EXPECT_EQ(checksums["overlaps"].size(), 1u);
    EXPECT_EQ(checksums["nearest"].size(), 1u);
}

TEST_F(ToolTest, BenchesHaveOneMedian)
{
    // Of two frames: their mean.
    for (const std::string part : {"", "world", "contacts"}) {
        std::vector<std::string> arguments{"bench",    "-n", "300",    "--threads", "1",
                                           "--frames", "2",  "--json", "-"};
        if (!part.empty()) arguments.insert(arguments.begin() + 1, part);
        arguments.push_back(part == "world" ? "moving" : part == "contacts" ? "box-box" : "uniform");
        const std::string unit = part == "contacts" ? "_ns" : "_ms";
        const Result result = run(arguments);
        ASSERT_EQ(result.exit_code, 0) << result.err;
        for (const auto& row : nlohmann::json::parse(result.out))
            EXPECT_NEAR(row["median" + unit].get<double>(),
                        (row["min" + unit].get<double>() + row["max" + unit].get<double>()) / 2,
                        unit == "_ns" ? 0.11 : 0.00011)
                << row;
    }
}

TEST_F(ToolTest, BenchWorldNamesWhatItDoesntKnow)
{
    const Result result = run({"bench", "world", "nowhere"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("nowhere is no scene of bench world; choose from resting"), std::string::npos)
        << result.err;
}

TEST_F(ToolTest, BenchWorldMakesSmallWorldsAndMasksQueries)
{
    const Result result = run({"bench", "world", "small", "others", "same", "few", "overlaps", "masked",
                               "counted", "-n", "3000", "--threads", "1,2", "--frames", "3", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const nlohmann::json rows = nlohmann::json::parse(result.out);
    EXPECT_EQ(rows.size(), 18u) << "masked and counted have rows of an index of their own";
    std::map<std::string, std::set<std::string>> checksums;
    std::map<std::string, std::uint64_t> results;
    std::map<std::string, std::set<std::string>> systems;
    for (const auto& row : rows) {
        checksums[row["scene"]].insert(row["checksum"]);
        const std::uint64_t found = row.contains("pairs") ? row["pairs"] : row["results"];
        EXPECT_EQ(results.try_emplace(row["scene"], found).first->second, found) << row;
        if (row["scene"] == "same") {
            EXPECT_EQ(row["moved"], 1000);
        }
        systems[row["scene"]].insert(row["system"]);
    }
    for (const auto& [scene, sums] : checksums)
        EXPECT_EQ(sums.size(), 1u) << scene;
    EXPECT_GT(results["small"], 0u);
    EXPECT_GT(results["others"], 20'000u);
    EXPECT_LT(results["masked"], results["overlaps"] / 8) << "one box in eleven";
    EXPECT_GT(results["masked"], results["overlaps"] / 14);
    EXPECT_EQ(results["counted"], results["masked"]);
    for (const std::string scene : {"masked", "counted"})
        EXPECT_EQ(systems[scene], (std::set<std::string>{"jostle", "own index"})) << scene;
}

} // namespace
} // namespace tool_test
