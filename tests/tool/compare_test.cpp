// SPDX-License-Identifier: MIT
// jostle compare: what every system takes on the user's own boxes.
#include <nlohmann/json.hpp>

#include "jostle/recorder.hpp"
#include "jostle/world.hpp"
#include "run_tool.hpp"

namespace {

using nlohmann::json;

class Compare : public tool_test::ToolTest
{
  protected:
    /// Boxes in rows, each touching the next; frame k has `sizes[k]` of them and moves the first `moving`.
    void record(const std::vector<std::size_t>& sizes, std::size_t moving) const
    {
        jostle::Recorder<3, float> recorder((folder / "mine.jrec").string(), 60, "boxes in rows");
        float by = 0;
        for (const std::size_t size : sizes) {
            std::vector<jostle::Aabb3f> boxes;
            for (std::size_t i = 0; i < size; ++i) {
                const auto x = static_cast<float>(i % 50), y = static_cast<float>(i / 50) * 2;
                const float up = i < moving ? by : 0;
                boxes.push_back({{x, y, up}, {x + 1, y + 1, up + 1}});
            }
            recorder.frame(boxes);
            by += 1.5f; // further than a box is high: what moves leaves what doesn't
        }
    }
    json rows() const { return json::parse(read("rows.json")); }
};

TEST_F(Compare, AllSystemsAgreeOnARecordingAndSayWhatTheyTake)
{
    record(std::vector<std::size_t>(12, 1500), 1500);
    const auto result = run({"compare", "mine.jrec", "--threads", "1,2", "--json", "rows.json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("up to 1,500 boxes, 3D float, 12 frames"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("boxes in rows"), std::string::npos);
    EXPECT_NE(result.out.find("100 % of the boxes change"), std::string::npos);
    EXPECT_NE(
        result.out.find(
            "All find the same pairs in every frame, and in the first and the last so does brute force"),
        std::string::npos);
    const json all = rows();
    ASSERT_EQ(all.size(), 4u);
    for (std::size_t i = 0; i < all.size(); ++i) {
        EXPECT_EQ(all[i]["system"], i % 2 == 0 ? "jostle" : "world");
        EXPECT_EQ(all[i]["threads"], i / 2 + 1);
        EXPECT_EQ(all[i]["n"], 1500);
        EXPECT_EQ(all[i]["pairs"], 30 * 49); // in each row all but the last touch the next
        EXPECT_EQ(all[i]["checksum"], all[0]["checksum"]);
        EXPECT_EQ(all[i]["frames"], 9); // after 3 that aren't counted
        EXPECT_GT(all[i]["bytes"], 1500 * 24);
        EXPECT_FALSE(all[i]["stages"].empty());
    }
}

TEST_F(Compare, SaysWhatBruteForceHasLookedAt)
{
    for (const std::vector<std::size_t>& sizes : {std::vector<std::size_t>{50, 50, 20'001}, {20'001, 50}}) {
        record(sizes, 0);
        const auto result = run({"compare", "mine.jrec", "--threads", "1"});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        EXPECT_NE(result.out.find("All find the same pairs in every frame.\n"), std::string::npos)
            << result.out;
    }
}

TEST_F(Compare, NamesThatArentUtf8AreToldSoThatTheyCanBeRead)
{
    write("caf\xe9.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n");
    const auto result = run({"compare", "caf\xe9.csv", "--threads", "1", "--json", "rows.json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    const json all = rows();
    ASSERT_FALSE(all.empty());
    for (const json& row : all)
        EXPECT_EQ(row["file"], "caf\\xe9.csv");
}

TEST_F(Compare, BoxesMayComeAndGo)
{
    record({100, 40, 0, 160, 160, 10, 90, 90}, 30);
    const auto result = run({"compare", "mine.jrec", "--threads", "1"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("up to 160 boxes"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("All find the same pairs"), std::string::npos);
    EXPECT_EQ(run({"compare", "mine.jrec", "--frames", "2"}).exit_code, 0);
}

TEST_F(Compare, FilesOfBoxesAreFrames)
{
    write("a.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n0.5,0.5,2,2\n5,5,6,6\n");
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1.5,0.5,2,2\n1,0,6,6\n");
    const auto one = run({"compare", "a.csv", "--threads", "1", "--json", "rows.json"});
    ASSERT_EQ(one.exit_code, 0) << one.err;
    EXPECT_NE(one.out.find("3 boxes, 2D double, one frame, asked for again and again"), std::string::npos)
        << one.out;
    EXPECT_EQ(rows()[0]["pairs"], 1);
    const auto two = run({"compare", "a.csv", "b.csv", "--threads", "1", "--json", "rows.json"});
    ASSERT_EQ(two.exit_code, 0) << two.err;
    EXPECT_NE(two.out.find("2 frames"), std::string::npos);
    EXPECT_NE(two.out.find("67 % of the boxes change"), std::string::npos) << two.out;
    EXPECT_EQ(rows()[0]["pairs"], 2);
}

TEST_F(Compare, AChangeOfOneBoundIsOne)
{
    write("a.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n2,0,3,1\n4,0,5,1\n9,0,9.5,1\n");
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,2,1\n2,0,3,1\n3,0,5,1\n"); // the first and the third have grown
    const auto result = run({"compare", "a.csv", "b.csv", "--threads", "1", "--json", "rows.json"});
    ASSERT_EQ(result.exit_code, 0) << result.err << result.out; // else the world missed it
    EXPECT_EQ(rows()[0]["pairs"], 2);
    EXPECT_EQ(rows()[1]["pairs"], 2);
    EXPECT_NE(result.out.find("67 % of the boxes change"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("up to 4 boxes"), std::string::npos) << result.out; // the last frame has three
    EXPECT_EQ(rows()[0]["n"], 4);
}

// The answers and times of all frames are the command's, and not the system's.
TEST_F(Compare, CountsTheMemoryOfASystemAlone)
{
    const auto bytes = [&](std::size_t frames) {
        record(std::vector<std::size_t>(frames, 20), 20);
        const auto result = run({"compare", "mine.jrec", "--threads", "1", "--json", "rows.json"});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return rows()[0]["bytes"].get<std::int64_t>();
    };
    EXPECT_LT(std::abs(bytes(1000) - bytes(10)), 20'000);
}

TEST_F(Compare, TakesAsManyFramesAsAreAskedFor)
{
    record({100, 40, 160, 160, 10}, 30);
    const auto few = run({"compare", "mine.jrec", "--frames", "2"});
    EXPECT_NE(few.out.find("up to 100 boxes, 3D float, 2 frames"), std::string::npos) << few.out;
    const auto more = run({"compare", "mine.jrec", "--frames", "99"});
    EXPECT_NE(more.out.find("up to 160 boxes, 3D float, 5 frames"), std::string::npos) << more.out;
}

TEST_F(Compare, RecommendsWhatItsOwnTableHasAsTheFaster)
{
    record(std::vector<std::size_t>(8, 900), 900);
    const auto moving = run({"compare", "mine.jrec", "--threads", "1", "--json", "rows.json"});
    const json moving_rows = rows();
    record(std::vector<std::size_t>(8, 900), 1);
    const auto resting = run({"compare", "mine.jrec", "--threads", "1", "--json", "rows.json"});
    const json resting_rows = rows();
    for (const auto& [result, all] : {std::pair{&moving, &moving_rows}, std::pair{&resting, &resting_rows}}) {
        ASSERT_EQ(result->exit_code, 0) << result->err;
        const bool world = (*all)[1]["median_ms"].get<double>() < (*all)[0]["median_ms"].get<double>();
        EXPECT_EQ(result->out.find("Keep the boxes in a World") != std::string::npos, world) << result->out;
        EXPECT_EQ(result->out.find("A PairFinder is the faster") != std::string::npos, !world) << result->out;
    }
}

TEST_F(Compare, WhatCantBeComparedIsSaidInOneLine)
{
    const auto expect_refused = [&](const std::vector<std::string>& arguments, const std::string& message) {
        const auto result = run(arguments);
        EXPECT_EQ(result.exit_code, 2) << message;
        EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    };
    expect_refused({"compare"}, "FILE is required");
    expect_refused({"compare", "none.jrec"}, "none.jrec: can't be read");
    record({}, 0);
    expect_refused({"compare", "mine.jrec"}, "mine.jrec: has no frames");
    write("flat.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n");
    write("deep.csv", "lo_x,lo_y,lo_z,hi_x,hi_y,hi_z\n0,0,0,1,1,1\n");
    expect_refused({"compare", "flat.csv", "deep.csv"}, "deep.csv: its boxes are of another dimension");
    expect_refused({"compare", "mine.jrec", "mine.jrec"}, "one recording at a time");
    {
        jostle::Recorder<3, float> recorder((folder / "bad.jrec").string());
        recorder.frame(std::vector<jostle::Aabb3f>{{{0, 0, 0}, {1, 1, 1}}});
        recorder.frame(std::vector<jostle::Aabb3f>{{{0, 0, 0}, {1, -1, 1}}});
    }
    expect_refused({"compare", "bad.jrec"}, "bad.jrec: frame 1: box 0: ");
    write("good.npy", tool_test::npy<float>({0, 0, 1, 1}, "<f4", false, "(1, 4)"));
    write("bad.npy", tool_test::npy<float>({0, 0, 1, 1, 2, 0, 1, 1}, "<f4", false, "(2, 4)"));
    expect_refused({"compare", "good.npy", "bad.npy"}, "bad.npy: box 1: lo.x = 2 ");
    expect_refused({"compare", "flat.csv", "--json", "-"}, "--json");
    const std::string flat = read("flat.csv");
    expect_refused({"compare", "flat.csv", "--json", "./flat.csv"}, "./flat.csv: is the input itself");
    EXPECT_EQ(read("flat.csv"), flat);
    expect_refused({"compare", "flat.csv", "--report", "no/such.html"}, "no is no folder");
    expect_refused({"compare", "flat.csv", "--report", "-"}, "--report: give a file");
}

} // namespace
