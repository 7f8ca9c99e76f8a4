// SPDX-License-Identifier: MIT
// jostle manual: the manual page has what --help has, and bash completes it.
#include <sstream>

#include "run_tool.hpp"

namespace tool_test {
namespace {

class Manual : public ToolTest
{
};

/// A manual page as it is read: without requests, fonts and escapes.
std::string without_roff(std::string page)
{
    for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
             {"\\-", "-"}, {"\\fB", ""}, {"\\fI", ""}, {"\\fR", ""}, {"\\&", ""}, {"\\e", "\\"}})
        for (std::size_t at = 0; (at = page.find(from, at)) != page.npos; at += to.size())
            page.replace(at, from.size(), to);
    return page;
}

TEST_F(Manual, HasEveryOptionAndExampleThatHelpHas)
{
    const Result manual = run({"manual"});
    ASSERT_EQ(manual.exit_code, 0) << manual.err;
    const std::string page = without_roff(manual.out);
    EXPECT_TRUE(page.starts_with(".TH JOSTLE 1 ")) << page.substr(0, 100);
    int options = 0, examples = 0;
    for (const std::vector<std::string>& command :
         std::vector<std::vector<std::string>>{{}, {"pairs"}, {"bench"}, {"bench", "world"}, {"manual"}}) {
        std::vector<std::string> arguments = command;
        arguments.push_back("--help");
        const std::string help = run(arguments).out;
        std::istringstream lines(help);
        for (std::string line; std::getline(lines, line);) {
            const std::size_t option = line.find("--");
            if (line.starts_with("  -") && option != line.npos) {
                ++options;
                const std::string name = line.substr(option, line.find_first_of(" ,{[", option) - option);
                EXPECT_NE(page.find(name), page.npos) << name;
            } else if (line.starts_with("  jostle ")) {
                ++examples;
                EXPECT_NE(page.find(line), page.npos) << line;
            }
        }
    }
    EXPECT_GT(options, 25);
    EXPECT_GT(examples, 20);
    // No line of the text is taken for a request.
    std::istringstream lines(manual.out);
    for (std::string line; std::getline(lines, line);)
        if (line.starts_with('.') || line.starts_with('\'')) {
            EXPECT_NE(std::string(" TH SH PP TP nf fi ").find(" " + line.substr(1, 2) + " "),
                      std::string::npos)
                << line;
        }
}

TEST_F(Manual, BashCompletesCommandsAndOptions)
{
    const auto completed = [&](const std::string& words, int at) {
        const Result result =
            shell("source <(jostle manual --bash)\nCOMP_WORDS=(" + words +
                  ")\nCOMP_CWORD=" + std::to_string(at) + "\n_jostle\necho \"${COMPREPLY[*]}\"");
        EXPECT_EQ(result.err, "");
        return result.out;
    };
    EXPECT_EQ(completed("jostle be", 1), "bench\n");
    EXPECT_EQ(completed("jostle bench w", 2), "world\n");
    EXPECT_EQ(completed("jostle pairs boxes.csv --st", 3), "--stats\n");
    EXPECT_EQ(completed("jostle bench world --fr", 3), "--frames\n");
    EXPECT_EQ(completed("jostle pairs bo", 2), "\n"); // then bash completes names of files
    EXPECT_EQ(completed("jostle --v", 1), "--version\n");
}

} // namespace
} // namespace tool_test
