// SPDX-License-Identifier: MIT
// SIGINT and SIGTERM at any moment of each command that takes long: it ends of the signal, or had ended
// before; each file is as it was or whole, and no other file and no process stays.
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <map>
#include <thread>

#include <nlohmann/json.hpp>

#include "run_tool.hpp"
#include "tool/scenes/random.hpp"

namespace tool_test {
namespace {

using Clock = std::chrono::steady_clock;

struct Command
{
    std::vector<std::string> arguments, outputs;
};

/// So small that each takes some tenths of a second.
std::vector<Command> commands()
{
    const std::string recording = JOSTLE_DATA_DIR "/tumble.jrec";
    return {
        {{"pairs", "b.csv", "-o", "out.csv"}, {"out.csv"}},
        {{"pairs", "b.csv", "-o", "out.npy"}, {"out.npy"}},
        {{"pairs", "b.csv", "-o", "out.jsonl", "--engine", "brute"}, {"out.jsonl"}},
        {{"pairs", "mesh.obj", "-o", "out.csv"}, {"out.csv"}}, // read by a process of its own
        {{"compare", recording, "--frames", "20", "--json", "c.json"}, {"c.json"}},
        {{"chapter", "-n", "200", "--json", "c.json"}, {"c.json"}},
        {{"demo", "--recording", recording, "-n", "5000", "--frames", "2"}, {}},
        {{"simulate", "-n", "200", "--frames", "150", "--record", "s.jrec", "--json", "s.json"},
         {"s.jrec", "s.json"}},
        {{"bench", "uniform", "-n", "5000", "--json", "b.json"}, {"b.json"}},
        {{"bench", "world", "moving", "-n", "2000", "--json", "b.json"}, {"b.json"}},
        {{"bench", "programs", "server", "--size", "0.05", "--json", "b.json"}, {"b.json"}},
        {{"report", "rows.json"}, {"report.html"}}, // drawn by a process of its own
    };
}

class Interrupts : public ToolTest
{
  protected:
    Interrupts()
    {
        std::string boxes = "lo_x,lo_y,hi_x,hi_y\n", mesh;
        for (int i = 0; i < 700; ++i)
            boxes += "0,0,1,1\n";
        write("b.csv", boxes);
        for (int i = 0; i < 3000; ++i) {
            const std::string x = std::to_string(i % 50), y = std::to_string(i / 50);
            mesh +=
                "v " + x + " " + y + " 0\nv " + x + ".9 " + y + " 0\nv " + x + " " + y + ".9 1\nf -3 -2 -1\n";
        }
        write("mesh.obj", mesh);
        const Result rows =
            run({"bench", "uniform", "-n", "500,1000", "--frames", "2", "--json", "rows.json"});
        if (rows.exit_code != 0) throw std::runtime_error("bench failed: " + rows.err);
        std::filesystem::create_directory(folder / "tmp");
        setenv("TMPDIR", (folder / "tmp").c_str(), 1);
    }
    ~Interrupts() override { unsetenv("TMPDIR"); }

    /// As far as it can be told: what is measured differs from run to run.
    [[nodiscard]] static bool is_whole(const std::string& name, const std::string& bytes,
                                       const std::string& reference)
    {
        if (name.ends_with(".html")) return bytes.ends_with("</html>\n");
        if (!name.ends_with(".json")) return bytes == reference;
        return nlohmann::json::accept(bytes) && std::count(bytes.begin(), bytes.end(), '\n') ==
                                                    std::count(reference.begin(), reference.end(), '\n');
    }

    /// Starts it and interrupts it after so long. Waits for it, and for all processes that it started.
    Result interrupt(const Command& command, std::chrono::microseconds after, int signal)
    {
        int ends[2];
        if (pipe(ends) != 0) throw std::runtime_error("pipe failed");
        const Running running = start(command.arguments);
        close(ends[1]);
        std::this_thread::sleep_for(after);
        kill(running.pid, signal); // not waited for yet, so that the number is its own
        const Result result = wait(running);
        pollfd others{ends[0], POLLIN, 0}; // which have the other end open as long as they run
        EXPECT_EQ(poll(&others, 1, 10'000), 1) << "a process that it started goes on";
        close(ends[0]);
        return result;
    }
};

TEST_F(Interrupts, AtAnyMomentLeaveEachFileAsItWasOrWhole)
{
    jostle_scenes::Random random(19);
    int interrupted = 0, runs = 0;
    for (const Command& command : commands()) {
        std::string line = "jostle";
        for (const std::string& argument : command.arguments)
            line += " " + argument;
        SCOPED_TRACE(line);
        const Clock::time_point begin = Clock::now();
        const Result sound = run(command.arguments);
        const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - begin);
        ASSERT_EQ(sound.exit_code, 0) << sound.err;
        std::map<std::string, std::string> whole;
        for (const std::string& output : command.outputs)
            whole[output] = read(output);
        const std::vector<std::string> names = files();
        for (int k = 0; k < 6; ++k) {
            for (const auto& [output, bytes] : whole)
                write(output, "before");
            const int signal = k % 2 == 0 ? SIGINT : SIGTERM;
            const std::chrono::microseconds after(
                random.below(static_cast<std::uint32_t>(took.count() * 11 / 10 + 1)));
            SCOPED_TRACE(std::string(strsignal(signal)) + " after " + std::to_string(after.count()) +
                         " us of " + std::to_string(took.count()));
            const Result result = interrupt(command, after, signal);
            ++runs;
            interrupted += result.exit_code != 0;
            if (result.exit_code != 0) {
                EXPECT_EQ(result.exit_code, 1000 + signal) << result.err;
            }
            EXPECT_EQ(files(), names);
            EXPECT_TRUE(std::filesystem::is_empty(folder / "tmp"));
            for (const auto& [output, bytes] : whole) {
                const std::string now = read(output);
                if (result.exit_code != 0 && now == "before") continue;
                EXPECT_TRUE(is_whole(output, now, bytes)) << output << ": " << now.size() << " bytes";
            }
        }
        for (const std::string& output : command.outputs)
            std::filesystem::remove(folder / output);
    }
    EXPECT_GT(interrupted, runs / 2);
}

} // namespace
} // namespace tool_test
