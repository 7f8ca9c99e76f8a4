// SPDX-License-Identifier: MIT
#include "bench/report.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <gtest/gtest.h>

namespace {

using jostle_bench::ReportRow;
using jostle_bench::write_report;
namespace fs = std::filesystem;

ReportRow row(const char* system, const char* scene, std::uint64_t n, std::uint32_t threads, double ms)
{
    ReportRow out;
    out.system = system;
    out.scene = scene;
    out.n = n;
    out.threads = threads;
    out.median_ms = ms;
    out.min_ms = ms * 0.75;
    out.max_ms = ms * 2;
    out.pairs = n * 2;
    out.checksum = "0123456789abcdef";
    out.size_ratio = std::string(scene) == "mixed" ? 60 : 1.5;
    return out;
}

std::vector<ReportRow> full_run()
{
    std::vector<ReportRow> rows;
    for (const char* scene : {"uniform", "mixed"})
        for (const std::uint64_t n : {1000u, 10000u})
            for (const std::uint32_t threads : {1u, 2u}) {
                const double ms = static_cast<double>(n) / 40000.0 / threads;
                rows.push_back(row("jostle", scene, n, threads, ms));
                rows.back().stages = {{"scatter", ms / 2}, {"sweep", ms / 2}};
                rows.push_back(row("embree", scene, n, threads, ms * 16));
                rows.push_back(row("floor", scene, n, threads, ms / 2));
            }
    return rows;
}

std::size_t count(const std::string& text, const std::string& part)
{
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
        ++found;
    return found;
}

class Report : public testing::Test
{
  protected:
    fs::path path = fs::temp_directory_path() /
                    ("jostle-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) +
                     std::to_string(std::hash<std::string>()(fs::current_path().string())) + ".html");
    void SetUp() override { fs::remove(path); }
    void TearDown() override { fs::remove(path); }
    std::string text() const
    {
        std::ifstream in(path);
        return {std::istreambuf_iterator<char>(in), {}};
    }
};

TEST_F(Report, HoldsTablesAndAllPlots)
{
    write_report(full_run(), "a machine <of 2 cores>", path);
    const std::string html = text();
    EXPECT_EQ(count(html, "<table>"), 2u); // one a thread count
    // Two scenes against n, two n against sizes, two scenes against threads, two thread counts of stages.
    EXPECT_EQ(count(html, "<img alt="), 8u);
    EXPECT_EQ(count(html, "%3C/svg%3E"), 8u);
    EXPECT_NE(html.find("16x</small>"), std::string::npos);
    EXPECT_NE(html.find("a machine &lt;of 2 cores&gt;"), std::string::npos);
    EXPECT_EQ(count(html, "class=wrong"), 0u);
    EXPECT_EQ(count(html, "http"),
              count(html, "http://www.w3.org")); // self-contained: no address but XML's names
}

TEST_F(Report, MarksAnswersThatDifferButNotTheFloor)
{
    std::vector<ReportRow> rows = full_run();
    for (ReportRow& r : rows)
        if (r.system == "floor" || (r.system == "embree" && r.scene == "mixed" && r.n == 1000))
            r.checksum = "0";
    write_report(rows, "", path);
    EXPECT_EQ(count(text(), "class=wrong"), 2u); // one and two threads
}

TEST_F(Report, LeavesOutPlotsWithoutRows)
{
    write_report(std::vector{row("jostle", "uniform", 1000, 1, 0.1)}, "", path);
    EXPECT_EQ(count(text(), "<img"), 0u);
    EXPECT_EQ(count(text(), "<td class=ours"), 1u);
    write_report({}, "nothing", path);
    EXPECT_EQ(count(text(), "<table>"), 0u);
}

TEST_F(Report, SaysThatGnuplotIsMissingAndKeepsTheOldFile)
{
    std::ofstream(path) << "old";
    const std::string search_path = std::getenv("PATH");
    setenv("PATH", "/nowhere", 1);
    try {
        write_report(full_run(), "", path);
        ADD_FAILURE() << "no error without gnuplot";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("apt-get install gnuplot-nox"), std::string::npos)
            << error.what();
    }
    setenv("PATH", search_path.c_str(), 1);
    EXPECT_EQ(text(), "old");
}

TEST_F(Report, SaysWhichFileCannotBeWritten)
{
    try {
        write_report({}, "", "/nowhere/report.html");
        ADD_FAILURE() << "no error";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("/nowhere/report.html"), std::string::npos) << error.what();
    }
}

} // namespace
