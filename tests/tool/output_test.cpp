// SPDX-License-Identifier: MIT
// Files appear complete or not at all, whatever ends the command.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

#include "run_tool.hpp"

namespace tool_test {
namespace {

class Output : public ToolTest
{
  protected:
    /// Starts a command that takes minutes and waits for the files that it writes to.
    Running start_and_wait_for_parts(const std::vector<std::string>& arguments, std::size_t parts)
    {
        const Running running = start(arguments);
        for (int i = 0; i < 20'000 && count_parts() < parts; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        EXPECT_EQ(count_parts(), parts);
        return running;
    }
    [[nodiscard]] std::size_t count_parts() const
    {
        const std::vector<std::string> names = files();
        return static_cast<std::size_t>(std::count_if(
            names.begin(), names.end(), [](const std::string& name) { return name.ends_with(".part"); }));
    }

    const std::vector<std::string> bench{"bench", "uniform",  "-n",     "2000",   "--threads",
                                         "1",     "--frames", "100000", "--json", "rows.json"};
};

TEST_F(Output, NoSignalLeavesAnUnfinishedFile)
{
    write("rows.json", "precious");
    for (const int signal :
         {SIGHUP, SIGINT, SIGQUIT, SIGILL, SIGABRT, SIGBUS, SIGFPE, SIGUSR1, SIGSEGV, SIGUSR2, SIGPIPE,
          SIGALRM, SIGTERM, SIGXCPU, SIGVTALRM, SIGPROF, SIGIO, SIGRTMIN, SIGRTMAX}) {
        SCOPED_TRACE(strsignal(signal));
        const Running running = start_and_wait_for_parts(bench, 1);
        kill(running.pid, signal);
        EXPECT_EQ(wait(running).exit_code, 1000 + signal); // and it ends as without a handler
        EXPECT_EQ(files(), std::vector<std::string>{"rows.json"});
        EXPECT_EQ(read("rows.json"), "precious");
    }
}

TEST_F(Output, SeveralUnfinishedFilesAreRemovedTogether)
{
    const Running running = start_and_wait_for_parts(
        {"simulate", "-n", "100", "--frames", "1000000", "--record", "r.jrec", "--json", "s.json"}, 2);
    kill(running.pid, SIGTERM);
    EXPECT_EQ(wait(running).exit_code, 1000 + SIGTERM);
    EXPECT_EQ(files(), std::vector<std::string>{});
}

TEST_F(Output, SignalsThatTheCallerIgnoresStayIgnored)
{
    std::signal(SIGHUP, SIG_IGN); // as nohup does
    const Running running = start_and_wait_for_parts(bench, 1);
    std::signal(SIGHUP, SIG_DFL);
    kill(running.pid, SIGHUP);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_EQ(count_parts(), 1u);
    kill(running.pid, SIGTERM);
    EXPECT_EQ(wait(running).exit_code, 1000 + SIGTERM);
}

TEST_F(Output, AnUnfinishedFileHasANameThatNobodyCanGuess)
{
    std::vector<std::string> names;
    for (int i = 0; i < 2; ++i) {
        const Running running = start_and_wait_for_parts(bench, 1);
        const std::vector<std::string> seen = files();
        ASSERT_EQ(seen.size(), 1u);
        EXPECT_TRUE(seen[0].starts_with("rows.json.")) << seen[0];
        EXPECT_EQ(seen[0].find(std::to_string(running.pid)), std::string::npos);
        EXPECT_GE(seen[0].size(), std::string("rows.json.").size() + 10 + std::string(".part").size());
        names.push_back(seen[0]);
        kill(running.pid, SIGTERM);
        wait(running);
    }
    EXPECT_NE(names[0], names[1]);
}

TEST_F(Output, FilesHavePermissionsAsFromAnyProgram)
{
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n");
    for (const auto& [mask, permissions] :
         {std::pair{"022", 0644}, {"027", 0640}, {"077", 0600}, {"000", 0666}}) {
        const Result result =
            shell(std::string("rm -f out.csv; umask ") + mask + "; jostle pairs b.csv -o out.csv");
        EXPECT_EQ(result.err, "");
        EXPECT_EQ(std::filesystem::status(folder / "out.csv").permissions(),
                  std::filesystem::perms(permissions))
            << mask;
    }
    // What replaces a private file is private from the beginning.
    write("rows.json", "");
    std::filesystem::permissions(folder / "rows.json", std::filesystem::perms(0600));
    const Running running = start_and_wait_for_parts(bench, 1);
    for (const std::string& name : files())
        if (name.ends_with(".part")) {
            EXPECT_EQ(std::filesystem::status(folder / name).permissions(), std::filesystem::perms(0600));
        }
    kill(running.pid, SIGTERM);
    wait(running);
}

TEST_F(Output, ALinkIsFollowedAndAPipeIsWrittenAsItIs)
{
    write("b.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,1,2,2\n");
    EXPECT_EQ(shell("mkfifo p.csv; cat p.csv & jostle pairs b.csv -o p.csv; wait").out, "a,b\n0,1\n");
    EXPECT_TRUE(std::filesystem::is_fifo(folder / "p.csv"));
    std::filesystem::create_symlink("p.csv", folder / "link.csv");
    EXPECT_EQ(shell("cat p.csv & jostle pairs b.csv -o link.csv; wait").out, "a,b\n0,1\n");
    // A recording goes back to its start at the end, which no pipe does.
    const Result record = shell("mkfifo r.jrec; jostle simulate -n 5 --frames 1 --record r.jrec");
    EXPECT_EQ(record.exit_code, 2);
    EXPECT_EQ(record.err, "jostle: --record: r.jrec: can't be written: Illegal seek\n");
    EXPECT_TRUE(std::filesystem::is_fifo(folder / "r.jrec"));
}

} // namespace
} // namespace tool_test
