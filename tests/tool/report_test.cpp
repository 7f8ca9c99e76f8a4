// SPDX-License-Identifier: MIT
// jostle report: a page from whatever the command's benchmarks have written as JSON.
#include <nlohmann/json.hpp>

#include "run_tool.hpp"

namespace tool_test {
namespace {

class Report : public ToolTest
{
  protected:
    std::string page_of(const std::vector<std::string>& files)
    {
        std::vector<std::string> arguments = {"report"};
        arguments.insert(arguments.end(), files.begin(), files.end());
        const Result result = run(arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(result.out, "report.html\n");
        return exists("report.html") ? read("report.html") : "";
    }
    static std::size_t count(const std::string& text, const std::string& part)
    {
        std::size_t found = 0;
        for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
            ++found;
        return found;
    }
};

TEST_F(Report, ReadsWhatEveryBenchmarkWrites)
{
    const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
        {"frames.json", {"bench", "uniform", "mixed", "-n", "200,400", "--frames", "2"}},
        {"world.json", {"bench", "world", "resting", "-n", "200", "--frames", "2"}},
        {"queries.json", {"bench", "queries", "-n", "200", "--repetitions", "1"}},
        {"contacts.json", {"bench", "contacts", "-n", "50", "--frames", "1"}},
        {"falling.json", {"simulate", "-n", "50", "--frames", "3"}}};
    std::vector<std::string> files;
    for (auto [file, arguments] : commands) {
        arguments.insert(arguments.end(), {"--json", file});
        const Result made = run(arguments);
        ASSERT_EQ(made.exit_code, 0) << file << ": " << made.err;
        files.push_back(file);
    }
    write("machine.txt", "A machine <of mine>\n");
    const std::string page = page_of(files);
    // Frames have their own tables and plots, all others a table each with every member.
    EXPECT_NE(page.find("<h2>Time against the number of objects</h2>"), std::string::npos);
    EXPECT_NE(page.find("A machine &lt;of mine&gt;"), std::string::npos);
    for (const std::string& file : files) {
        const bool whole_frames = file == "frames.json";
        EXPECT_EQ(count(page, "<h2>" + file + "</h2>"), whole_frames ? 0u : 1u) << file;
        auto rows = nlohmann::json::parse(read(file));
        if (rows.is_object()) rows = nlohmann::json::array({rows});
        for (const auto& [name, value] : rows[0].items())
            if (!whole_frames) {
                EXPECT_NE(page.find("<th>" + name + "</th>"), std::string::npos) << file << ": " << name;
            }
    }
    EXPECT_GE(count(page, "<img alt=\""), 4u);
    // Nothing is asked of anybody.
    EXPECT_EQ(count(page, "src=\""), count(page, "src=\"data:image/svg+xml,"));
    EXPECT_EQ(count(page, "http"), count(page, "http://www.w3.org")); // XML's names
    // A browser shows a picture if its text begins with XML's declaration, and with nothing before that.
    EXPECT_EQ(count(page, "src=\""), count(page, "src=\"data:image/svg+xml,%3C?xml"));
    for (const char* asks : {"<script", "<link", "url(", "@import"})
        EXPECT_EQ(page.find(asks), std::string::npos) << asks;
    EXPECT_NE(page.find("prefers-color-scheme: dark"), std::string::npos);
}

TEST_F(Report, SystemsStandSideBySide)
{
    write("r.json", R"([{"system":"jostle","pair":"box-box","median_ns":120.5,"threads":1},
                        {"system":"fcl","pair":"box-box","median_ns":320,"threads":1},
                        {"system":"fcl","pair":"hull-hull <32>","median_ns":null,"threads":1}])");
    const std::string page = page_of({"r.json"});
    EXPECT_EQ(count(page, "<figure>"), 1u);
    EXPECT_NE(page.find("r.json, threads = 1: lower is better."), std::string::npos) << page;
    EXPECT_NE(page.find("<td class=word>hull-hull &lt;32&gt;</td><td class=word></td>"), std::string::npos);
    EXPECT_NE(page.find("<td>120.5</td>"), std::string::npos);
}

// What differs in its boxes or instruction set isn't one line of a plot, nor one cell of a table.
TEST_F(Report, KeepsApartWhatIsntTheSame)
{
    const auto row = [](const char* isa, const char* type, int dim, int n, double ms) {
        return nlohmann::json{{"system", "jostle"},
                              {"scene", "uniform"},
                              {"n", n},
                              {"threads", 1},
                              {"pairs", 5},
                              {"isa", isa},
                              {"type", type},
                              {"dim", dim},
                              {"median_ms", ms},
                              {"min_ms", ms},
                              {"max_ms", ms},
                              {"size_ratio", 1},
                              {"checksum", "c"},
                              {"stages", {{"sweep", ms}}}};
    };
    write("a.json", nlohmann::json{row("avx2", "float", 3, 100, 0.111), row("scalar", "float", 3, 100, 0.222),
                                   row("avx2", "float", 2, 100, 0.444), row("avx2", "double", 3, 100, 0.555),
                                   row("avx2", "float", 3, 200, 0.666)}
                        .dump());
    const std::string page = page_of({"a.json"});
    EXPECT_NE(page.find("<th>jostle</th><th>jostle scalar</th>"), std::string::npos) << page;
    for (const char* cell :
         {"uniform</td>", "uniform, 2D</td>", "uniform, double</td>", "0.111", "0.222", "0.444", "0.555"})
        EXPECT_NE(page.find(cell), std::string::npos) << cell;
    // What was measured twice is neither two cells nor two points.
    write("again.json", nlohmann::json{row("avx2", "float", 3, 100, 0.333)}.dump());
    const auto results = [](const std::string& text) { return text.substr(text.find("<h2>")); };
    EXPECT_EQ(results(page_of({"a.json", "again.json"})), results(page));
}

TEST_F(Report, RefusesWhatHoldsNoMeasurements)
{
    write("good.json", R"([{"system":"jostle","query":"rays","us_each":1}])");
    const std::string deep = "{\"a\":" + std::string(200'000, '[') + std::string(200'000, ']') + "}";
    for (const std::string& text : {std::string(), std::string("[]"), std::string("5"), std::string("[5]"),
                                    std::string("{\"a\":"), std::string("[[]]"), std::string("\xff"), deep}) {
        write("bad.json", text);
        const Result result = run({"report", "good.json", "bad.json"});
        EXPECT_EQ(result.exit_code, 2) << text.substr(0, 20);
        EXPECT_EQ(
            result.err,
            "jostle: bad.json: holds no measurements; give what a command of jostle wrote for its --json\n");
        EXPECT_FALSE(exists("report.html"));
    }
    EXPECT_NE(run({"report", "none.json"}).err.find("none.json"), std::string::npos);
    for (const char* same : {"good.json", "./good.json"})
        EXPECT_EQ(run({"report", "good.json", "-o", same}).exit_code, 2) << same;
    EXPECT_EQ(read("good.json").front(), '[');
    EXPECT_NE(run({"report", "good.json", "-o", "no/such.html"}).err.find("no is no folder"),
              std::string::npos);
    // Members of other types than a frame's are shown as they are.
    write("odd.json", R"({"system":5,"scene":null,"n":-1,"stages":[],"median_ms":"soon","size_ratio":{}})");
    EXPECT_NE(page_of({"odd.json"}).find("<td class=word>soon</td>"), std::string::npos);
}

} // namespace
} // namespace tool_test
