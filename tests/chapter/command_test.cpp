// SPDX-License-Identifier: MIT
// The command `jostle chapter`, as a user meets it.
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include <nlohmann/json.hpp>

namespace {

struct Outcome
{
    int status;
    std::string out, err;
};

class ChapterCommand : public testing::Test
{
  protected:
    void SetUp() override
    {
        folder_ = std::filesystem::path(testing::TempDir()) /
                  ("jostle_chapter_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
                   "_" + testing::UnitTest::GetInstance()->current_test_info()->name());
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
    [[nodiscard]] static std::string text_of(const std::string& path)
    {
        std::ostringstream text;
        text << std::ifstream(path).rdbuf();
        return text.str();
    }
    [[nodiscard]] Outcome jostle_chapter(const std::string& arguments) const
    {
        const std::string command = "'" JOSTLE_TOOL_PATH "' chapter " + arguments + " > '" + path("out") +
                                    "' 2> '" + path("err") + "'";
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(path("out")), text_of(path("err"))};
    }

    std::filesystem::path folder_;
};

TEST_F(ChapterCommand, JsonHasEveryFigureForOneThreadAndForAll)
{
    constexpr std::uint64_t n = 301, threads = 3, tests = n * (n - 1) / 2;
    const Outcome outcome = jostle_chapter("-n 301 --threads 3 --json -");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    const auto rows = nlohmann::json::parse(outcome.out);

    const std::map<std::string, std::string> variants = {
        {"4.9", "shared"}, {"4.10", "padded"}, {"4.11", "padded"}, {"4.12", "aligned"}, {"4.13", "response"}};
    std::map<std::pair<std::string, std::uint64_t>, int> timed; // figure and threads
    std::map<std::string, std::vector<std::uint64_t>> shares;
    int today = 0;
    for (const auto& row : rows) {
        const std::string figure = row.at("figure"), variant = row.at("variant");
        if (variant == "blocks" || variant == "zigzag") {
            EXPECT_EQ(figure, variant == "blocks" ? "4.6" : "4.7");
            EXPECT_EQ(row.at("threads"), threads);
            EXPECT_EQ(row.at("processor"), shares[variant].size());
            shares[variant].push_back(row.at("tests"));
        } else if (variant == "all_pairs" || variant == "pipeline") {
            EXPECT_EQ(figure, "4.13");
            EXPECT_GT(row.at("tests"), 0u);
            EXPECT_LE(row.at("tests"), tests);
            EXPECT_GT(row.at("ms"), 0.0);
            ++today;
        } else if (variants.count(figure) != 0) {
            EXPECT_EQ(variant, variants.at(figure));
            EXPECT_EQ(row.at("tests"), tests);
            EXPECT_GT(row.at("ms"), 0.0);
            ++timed[{figure, row.at("threads")}];
        } else {
            EXPECT_TRUE(figure == "Alg. 7" || figure == "Alg. 11") << figure;
            EXPECT_GT(row.at("tests"), 0u);
        }
    }
    for (const auto& [figure, variant] : variants)
        for (const std::uint64_t t : {std::uint64_t{1}, threads})
            EXPECT_EQ((timed[{figure, t}]), 1) << figure << " " << t;
    EXPECT_EQ(today, 2 * 2);
    // 100 objects with 300 .. 201 tests, 100 with 200 .. 101, the last 101 with 100 .. 0.
    EXPECT_EQ(shares["blocks"], (std::vector<std::uint64_t>{25050, 15050, 5050}));
    ASSERT_EQ(shares["zigzag"].size(), threads);
    EXPECT_EQ(shares["zigzag"][0] + shares["zigzag"][1] + shares["zigzag"][2], tests);
    for (const std::uint64_t share : shares["zigzag"])
        EXPECT_NEAR(static_cast<double>(share), static_cast<double>(tests) / threads, n);
}

TEST_F(ChapterCommand, TableStandsBesideTheChaptersFigures)
{
    const std::string json = path("rows.json");
    const Outcome outcome = jostle_chapter("-n 100 --threads 2 --json '" + json + "'");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    for (const char* part :
         {"1188, 4906 ms: 4.13x slower", "1188, 1797 ms: 1.51x slower", "1188, 312 ms: 3.81x faster",
          "4968, 1391 ms: 3.57x faster", "4950", "Store forwarding", "2 threads"})
        EXPECT_NE(outcome.out.find(part), std::string::npos) << part << "\n" << outcome.out;
    EXPECT_EQ(nlohmann::json::parse(text_of(json)).size(), 2u * 7 + 2 * 2 + 2 * 4);
}

TEST_F(ChapterCommand, OneThreadIsEnough)
{
    const Outcome outcome = jostle_chapter("-n 2 --threads 1");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("One thread: nothing is shared"), std::string::npos);
}

TEST_F(ChapterCommand, LadderHasARowForEachRungSizeAndNumberOfThreads)
{
    const Outcome outcome = jostle_chapter("--ladder -n 300,1000 --threads 2 --scene powerlaw --json -");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    std::map<std::string, int> rows;
    for (const auto& row : nlohmann::json::parse(outcome.out)) {
        EXPECT_GT(row.at("ms"), 0.0) << row;
        EXPECT_GT(row.at("pairs"), 0u) << row;
        const std::string what = row.at("what");
        ++rows[what];
        if (what != "find") continue;
        const std::string rung = row.at("rung");
        EXPECT_EQ(row.at("missed") != 0u, rung == "printed" || rung == "mixing hash") << row;
        const std::uint64_t n = row.at("n"), selves = row.at("selves");
        EXPECT_EQ(selves > n / 2, rung == "printed") << row;
        if (rung != "printed" && rung != "mixing hash") {
            EXPECT_EQ(selves, 0u) << row;
        }
    }
    EXPECT_EQ(rows, (std::map<std::string, int>{
                        {"find", 8 * 2 * 2}, {"responses", 4 * 2 * 2}, {"sharing", 4 * 2}}));
}

TEST_F(ChapterCommand, CellsOfAllSizesFindTheSame)
{
    const Outcome outcome = jostle_chapter("--cells 0.5,2,64 --buckets 1,1000 -n 1000 --threads 1");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    for (const char* part : {"1,000 boxes (uniform)", "       0.5", "        64", "too large"})
        EXPECT_NE(outcome.out.find(part), std::string::npos) << part << "\n" << outcome.out;
}

TEST_F(ChapterCommand, WrongOptionsAreSaidInOneLine)
{
    const std::string nowhere = path("no/such/folder/rows.json");
    for (const std::string& arguments :
         {std::string("-n 1"), std::string("-n many"), std::string("-n -5"), std::string("--threads 0"),
          std::string("--colour"), std::string("stray"), std::string("--cells 0"), std::string("--cells 2,1"),
          std::string("--cells nan"), std::string("--cells inf"), std::string("--cells x"),
          std::string("--cells"), std::string("--cells 1 --buckets 0"), std::string("--buckets 4"),
          std::string("--ladder --cells 1"), std::string("-n 10,20"), std::string("--ladder --scene nowhere"),
          std::string("--scene powerlaw"), "--json '" + nowhere + "'"}) {
        const Outcome outcome = jostle_chapter(arguments);
        EXPECT_EQ(outcome.status, 2) << arguments;
        EXPECT_EQ(outcome.out, "") << arguments;
        EXPECT_EQ(outcome.err.rfind("jostle: ", 0), 0u) << outcome.err;
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    }
}

TEST_F(ChapterCommand, HelpHasExamples)
{
    const Outcome outcome = jostle_chapter("--help");
    EXPECT_EQ(outcome.status, 0);
    EXPECT_NE(outcome.out.find("jostle chapter -n 30000 --threads 4"), std::string::npos);
}

} // namespace
