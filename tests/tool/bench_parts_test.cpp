// SPDX-License-Identifier: MIT
// jostle bench contacts, queries, responses, scenes and programs.
#include <map>
#include <regex>
#include <set>

#include <nlohmann/json.hpp>

#include "run_tool.hpp"

namespace tool_test {
namespace {

/// 0.0356, not 0.035563000000000004.
void expect_rounded(const std::string& json)
{
    std::smatch match;
    EXPECT_FALSE(std::regex_search(json, match, std::regex(R"([0-9]\.[0-9]{6,})"))) << match.str();
}

TEST_F(ToolTest, BenchContactsFindsTheSameOnAnyThreads)
{
    const Result result =
        run({"bench", "contacts", "-n", "80", "--threads", "1,2", "--frames", "2", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    expect_rounded(result.out);
    const nlohmann::json rows = nlohmann::json::parse(result.out);
    EXPECT_EQ(rows.size(), 76u)
        << "nineteen kinds of pairs on one thread and on two, all points and the deepest";
    std::map<std::string, std::set<std::pair<int, int>>> found;
    std::map<std::string, std::set<int>> touching_of;
    const std::set<std::string> whole{"sphere-sphere", "capsule-capsule", "sphere-capsule",
                                      "box-box",       "sphere-box",      "capsule-box"};
    for (const auto& row : rows) {
        const int pairs = row["pairs"], touching = row["touching"];
        const bool has_mesh = std::string(row["pair"]).ends_with("-mesh");
        EXPECT_EQ(pairs, has_mesh ? 20 : whole.count(row["pair"]) == 0 ? 40 : 80);
        EXPECT_GT(touching, pairs / 5) << row; // about half of them, by the making of the scene
        EXPECT_LT(touching, pairs - pairs / 5) << row;
        EXPECT_GE(row["points"], touching) << row;
        EXPECT_LE(row["min_ns"], row["median_ns"]);
        EXPECT_LE(row["median_ns"], row["max_ns"]);
        touching_of[row["pair"]].insert(touching);
        // A contact of a mesh has one deepest point for each triangle.
        if (row["system"] == "points" && !has_mesh) {
            EXPECT_EQ(row["points"], touching) << row;
        }
        found[std::string(row["system"]) + " " + std::string(row["pair"])].insert({touching, row["points"]});
    }
    EXPECT_EQ(found.size(), 38u);
    for (const auto& [pair, counts] : found)
        EXPECT_EQ(counts.size(), 1u) << pair;
    for (const auto& [pair, counts] : touching_of)
        EXPECT_EQ(counts.size(), 1u) << pair;
    EXPECT_LT(found["points box-box"].begin()->second, found["jostle box-box"].begin()->second);
}

/// The mean answer to each query about each pair, of a benchmark that moves shapes to gaps of 0.02 to 0.5
/// and depths of 0.01 to 0.1.
std::map<std::string, std::map<std::string, double>> means_of_pairs(const std::string& json)
{
    expect_rounded(json);
    std::map<std::string, std::map<std::string, double>> means;
    for (const auto& row : nlohmann::json::parse(json)) {
        EXPECT_GT(row["median_ns"], 0) << row;
        means[row["pair"]][row["query"]] = row["mean"];
    }
    for (auto& [pair, mean] : means) {
        EXPECT_EQ(mean["touching"], 0) << pair;
        EXPECT_EQ(mean["overlap"], 1) << pair;
        EXPECT_GT(mean["distance"], 0.01) << pair;
        EXPECT_LT(mean["distance"], 0.51) << pair;
        EXPECT_GT(mean["depth"], 0.001) << pair;
        EXPECT_LT(mean["depth"], 0.11) << pair;
    }
    return means;
}

TEST_F(ToolTest, BenchDistancesAsksSixQueriesOfEachPair)
{
    const Result result = run({"bench", "distances", "-n", "40", "--repetitions", "1", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    auto means = means_of_pairs(result.out);
    EXPECT_EQ(means.size(), 17u);
    for (auto& [pair, mean] : means) {
        EXPECT_EQ(mean.size(), 6u) << pair;
        EXPECT_EQ(mean["distance"], mean["distances"]) << pair;
        EXPECT_GT(mean["impact"], 0) << pair;
        EXPECT_LT(mean["impact"], 1) << pair;
    }
}

TEST_F(ToolTest, BenchPlaneAsksFiveQueriesOfEachPair)
{
    const Result result = run({"bench", "plane", "-n", "40", "--repetitions", "1", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    auto means = means_of_pairs(result.out);
    EXPECT_EQ(means.size(), 8u);
    for (auto& [pair, mean] : means) {
        EXPECT_EQ(mean.size(), 5u) << pair;
        EXPECT_GE(mean["contacts"], 1) << pair;
        EXPECT_LE(mean["contacts"], pair == "circles" ? 1 : 2) << pair;
    }
}

TEST_F(ToolTest, BenchNeighborsFindsAsManyAsPlainCells)
{
    const Result result =
        run({"bench", "neighbors", "-n", "4000", "--threads", "1,2", "--repetitions", "1", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::map<std::string, std::set<std::uint64_t>> found;
    for (const auto& row : nlohmann::json::parse(result.out))
        if (row["system"] == "jostle") found[row["scene"]].insert(std::uint64_t(row["neighbors"]));
    EXPECT_EQ(found.size(), 8u);
    for (const auto& [name, counts] : found)
        EXPECT_EQ(counts.size(), 1u) << name;
    EXPECT_GT(*found["open-6"].begin(), 200'000u);
}

TEST_F(ToolTest, BenchSurfacesFindsTheSameOnAnyThreads)
{
    const Result result =
        run({"bench", "surfaces", "-n", "2048", "--threads", "1,2", "--repetitions", "1", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::map<std::string, std::set<std::uint64_t>> found;
    std::uint64_t queries = 0;
    for (const auto& row : nlohmann::json::parse(result.out)) {
        EXPECT_EQ(row["n"], 2048);
        found[row["scene"]].insert(std::uint64_t(row["found"]));
        if (row["scene"] == "impacts") queries = row["queries"];
    }
    EXPECT_EQ(found.size(), 5u);
    for (const auto& [name, counts] : found) {
        EXPECT_EQ(counts.size(), 1u) << name;
        EXPECT_GT(*counts.begin(), 0u) << name;
    }
    EXPECT_LT(*found["impacts"].begin(), queries);
    EXPECT_LT(queries, *found["candidates"].begin());
#ifdef JOSTLE_TOOL_WITH_PEERS
    for (const char* compared : {"candidates", "crossings"})
        EXPECT_EQ(
            run({"bench", "surfaces", compared, "-n", "2048", "--repetitions", "1", "--peers"}).exit_code, 0);
#endif
}

TEST_F(ToolTest, BenchQueriesAnswersTheSameOnAnyThreads)
{
    const Result result =
        run({"bench", "queries", "-n", "500", "--threads", "1,2", "--repetitions", "1", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    expect_rounded(result.out);
    std::map<std::string, std::set<std::string>> answers;
    for (const auto& row : nlohmann::json::parse(result.out)) {
        if (row["query"] == "build" || row["query"] == "join") continue;
        EXPECT_GT(row["results"], 100) << row;
        answers[row["query"]].insert(std::string(row["checksum"]) + " of " + row["results"].dump());
    }
    EXPECT_EQ(answers.size(), 13u);
    for (const auto& [query, sums] : answers)
        EXPECT_EQ(sums.size(), 1u) << query;
}

TEST_F(ToolTest, BenchResponsesMeasuresBothParts)
{
    const Result result =
        run({"bench", "responses", "-n", "300", "--threads", "2", "--frames", "1", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    expect_rounded(result.out);
    std::set<std::string> systems;
    for (const auto& row : nlohmann::json::parse(result.out)) {
        EXPECT_GT(row["median_ms"], 0) << row;
        systems.insert(row["system"]);
        // What doesn't apply is null, not 0.
        EXPECT_EQ(row["bytes"].is_number(), row["part"] == "responses") << row;
        EXPECT_EQ(row["efficiency"].is_number(), row["part"] == "balance" && row["threads"] == 2) << row;
    }
    EXPECT_GE(systems.size(), 6u);
}

TEST_F(ToolTest, BenchScenesFindsTheSamePairsTogetherAndOneByOne)
{
    const Result result = run({"bench", "scenes", "-n", "2,64,300", "--boxes", "3000", "--threads", "2",
                               "--frames", "1", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    expect_rounded(result.out);
    const auto rows = nlohmann::json::parse(result.out);
    ASSERT_EQ(rows.size(), 3u);
    for (const auto& row : rows) {
        EXPECT_EQ(row["scenes"], 3000 / row["n"].get<int>()) << row;
        for (const std::string time : {"median_ms", "one_by_one_ms", "parts_ms"})
            EXPECT_GT(row[time], 0) << row;
    }
    EXPECT_GT(rows[2]["pairs"], 100) << rows[2];
}

TEST_F(ToolTest, BenchProgramsDoesTheSameOnAnyThreads)
{
    const Result result = run(
        {"bench", "programs", "--size", "0.01", "--threads", "1,2", "--repetitions", "30", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::map<std::string, std::set<std::string>> answers;
    std::map<std::string, int> programs;
    for (const auto& row : nlohmann::json::parse(result.out)) {
        const std::string program = row["program"], part = row["part"];
        EXPECT_LE(row["min_ms"], row["median_ms"]) << row;
        ++programs[program];
        if (part == "total") continue;
        answers[program + " " + part].insert(row["answer"].dump());
        const std::set<std::string> silent{"save", "restore", "build", "move all", "move a hundredth"};
        if (silent.count(part) == 0) {
            EXPECT_GT(row["answer"], 0) << row;
        }
    }
    EXPECT_EQ(programs,
              (std::map<std::string, int>{{"server", 12}, {"grains", 6}, {"planner", 18}, {"boxes", 18}}));
    for (const auto& [part, all] : answers)
        EXPECT_EQ(all.size(), 1u) << part;
}

#ifdef JOSTLE_TOOL_WITH_PEERS
TEST_F(ToolTest, BenchProgramsAndTheirPeersDoTheSame)
{
    const Result result = run({"bench", "programs", "server", "grains", "planner", "--size", "0.01",
                               "--threads", "1", "--repetitions", "3", "--peers", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err; // which says whose answer differs
    std::map<std::string, std::set<std::string>> parts;
    for (const auto& row : nlohmann::json::parse(result.out))
        parts[std::string(row["program"]) + " " + std::string(row["system"])].insert(row["part"]);
    const std::set<std::string> grains{"search", "forces", "total"};
    EXPECT_EQ(parts["server bullet"], (std::set<std::string>{"move", "sight", "shots", "total"}));
    EXPECT_EQ(parts["server fcl"], (std::set<std::string>{"move", "sight", "total"}));
    for (const std::string system : {"jostle", "cells", "bullet", "fcl"})
        EXPECT_EQ(parts["grains " + system], grains) << system;
    EXPECT_EQ(parts["planner fcl"].size(), 9u);
    EXPECT_EQ(parts["planner bullet"],
              (std::set<std::string>{"capsules: rock", "capsules: self", "capsules: first",
                                     "capsules: distances", "total"}))
        << "nothing of two meshes";
    EXPECT_EQ(parts.size(), 10u) << "and ours, of server and planner";
}

TEST_F(ToolTest, BenchDistancesOfPeersAreNearOurs)
{
    const Result result =
        run({"bench", "distances", "-n", "2000", "--repetitions", "1", "--peers", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::map<std::string, double> ours;
    std::map<std::string, int> rows;
    for (const auto& row : nlohmann::json::parse(result.out)) {
        const std::string pair = row["pair"], query = row["query"];
        ++rows[row["system"]];
        if (row["system"] == "jostle") {
            ours[pair + query] = row["mean"];
            continue;
        }
        if (query == "least depth") { // which Jostle's depth always is
            EXPECT_NEAR(row["mean"], ours[pair + "depth"], 1e-4) << row;
            continue;
        }
        // A depth of two triangles is what a system takes for one.
        if (query == "depth" && pair.find("mesh") + pair.find("link") != 2 * std::string::npos) {
            EXPECT_GT(row["mean"], 0) << row;
        } else {
            // Bullet and libccd, FCL's solver, come less near to curved surfaces, and to depths.
            EXPECT_NEAR(row["mean"], ours[pair + query], query == "depth" ? 0.012 : 2e-3) << row;
        }
    }
    EXPECT_EQ(rows, (std::map<std::string, int>{{"jostle", 102}, {"bullet", 48}, {"fcl", 81}}));
}
#endif

TEST_F(ToolTest, BenchPartsNameWhatTheyDontKnow)
{
    const Result wrong = run({"bench", "responses", "--sprames", "3"});
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_NE(wrong.err.find("See jostle bench responses --help"), std::string::npos) << wrong.err;
    const Result contacts = run({"bench", "contacts", "egg-egg"});
    EXPECT_EQ(contacts.exit_code, 2);
    EXPECT_NE(contacts.err.find("egg-egg is no pair of shapes that is measured; choose from sphere-sphere"),
              std::string::npos)
        << contacts.err;
    const Result queries = run({"bench", "queries", "nowhere"});
    EXPECT_EQ(queries.exit_code, 2);
    EXPECT_NE(queries.err.find("nowhere"), std::string::npos) << queries.err;
}

TEST_F(ToolTest, BenchPartsRefuseWhatStandsBeforeThem)
{
    for (const std::string part : {"world", "queries", "contacts", "distances", "plane", "neighbors",
                                   "responses", "scenes", "programs"})
        for (const std::vector<std::string>& before : {std::vector<std::string>{"-n", "100"},
                                                       {"uniform"},
                                                       {"--threads", "1"},
                                                       {"--double"},
                                                       {"--peers"}}) {
            std::vector<std::string> arguments = before;
            arguments.insert(arguments.begin(), "bench");
            arguments.push_back(part);
            const Result result = run(arguments);
            EXPECT_EQ(result.exit_code, 2) << before.front() << " " << part;
            EXPECT_EQ(result.out, "");
            EXPECT_EQ(result.err, "jostle: " + before.front() + " has no effect before " + part +
                                      "; what that takes stands after it: see jostle bench " + part +
                                      " --help\n");
        }
    EXPECT_EQ(run({"bench", "--help", "world"}).exit_code, 0);
}

} // namespace
} // namespace tool_test
