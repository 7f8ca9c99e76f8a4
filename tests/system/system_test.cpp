// SPDX-License-Identifier: MIT
#include "tool/system/system.hpp"

#include <gtest/gtest.h>
#ifdef __linux__
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#endif

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "temporary_folder.hpp"

using namespace jostle_system;
namespace fs = std::filesystem;

namespace {

/// What a program's argument can be, and what quoting gets wrong.
const std::vector<std::string>& hard_words()
{
    static const std::vector<std::string> words = {
        "plain",          "two words",     "",    "\"quoted\"", "back\\slash", "ends in\\", "\\\"both\\\\\"",
        "$HOME %PATH% *", "K\xc3\xa4sten", "a\tb"};
    return words;
}

} // namespace

TEST(System, ProgramsRunAndSayWhatTheyWrite)
{
    set_default_variable("JOSTLE_SYSTEM_TEST", "set before");
    set_default_variable("JOSTLE_SYSTEM_TEST", "set again");
    const auto well = run_program({this_program().string(), "--variable"}, Errors::taken);
    ASSERT_TRUE(well.has_value());
    EXPECT_TRUE(well->well);
    EXPECT_EQ(well->output, "set before");
    const auto badly = run_program({this_program().string(), "--fail"}, Errors::taken);
    ASSERT_TRUE(badly.has_value());
    EXPECT_FALSE(badly->well);
    EXPECT_EQ(badly->output, "out err");
    EXPECT_EQ(run_program({this_program().string(), "--fail"}, Errors::shown)->output, "out ");
    EXPECT_FALSE(run_program({"jostle-no-such-program"}, Errors::taken).has_value());
    EXPECT_FALSE(run_program({"/no/such/program"}, Errors::shown).has_value());
}

#ifdef __linux__
TEST(System, ProgramsEndWithTheOneThatRunsThem)
{
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDERR_FILENO);
        close(ends[0]);
        close(ends[1]);
        (void)run_program({"/bin/sh", "-c", "echo here >&2; exec sleep 100"}, Errors::shown);
        _exit(0);
    }
    close(ends[1]);
    char said[5] = {};
    EXPECT_EQ(read(ends[0], said, 5), 5); // it runs
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    pollfd others{ends[0], POLLIN, 0}; // whoever still runs has the other end open
    EXPECT_EQ(poll(&others, 1, 20'000), 1) << "it goes on alone";
    close(ends[0]);
}
#endif

TEST(System, ProgramsGetTheirWordsAsTheyAre)
{
    std::vector<std::string> command = {this_program().string(), "--words"};
    command.insert(command.end(), hard_words().begin(), hard_words().end());
    const auto told = run_program(command, Errors::shown);
    ASSERT_TRUE(told.has_value());
    std::string expected;
    for (const std::string& word : hard_words())
        expected += word + "\n";
    EXPECT_EQ(told->output, expected);
}

#ifdef __linux__
TEST(System, ProgramsForWhichThereAreTooFewDescriptorsLeaveNoneOpen)
{
    const auto open_files = [] {
        const fs::directory_iterator all("/proc/self/fd");
        return std::distance(begin(all), end(all));
    };
    const auto before = open_files();
    rlimit usual{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &usual), 0);
    const int lowest = dup(STDIN_FILENO); // those below are open
    close(lowest);
    for (const std::string input : {"", "some"})
        for (int more = 0; more < 5; ++more) {
            rlimit few = usual;
            few.rlim_cur = static_cast<rlim_t>(lowest + more);
            ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
            bool ran = false;
            try {
                ran = run_program({"true"}, Errors::shown, input).has_value();
            } catch (const std::system_error& error) {
                EXPECT_EQ(error.code(), std::errc::too_many_files_open);
            }
            ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &usual), 0);
            EXPECT_EQ(ran, more == 4 && input.empty());
            EXPECT_EQ(open_files(), before) << more << input;
        }
}
#endif

TEST(System, ProgramsReadTheirInput)
{
    std::string input = "line\nline\r\n";
    while (input.size() < 300'000) // more than a pipe holds
        input += input + '\0';
    const auto told = run_program({this_program().string(), "--copy"}, Errors::shown, input);
    ASSERT_TRUE(told && told->well);
    EXPECT_EQ(told->output, input);
    EXPECT_FALSE(run_program({"jostle-no-such-program"}, Errors::taken, input).has_value());
}

TEST(System, FilesAreBytes)
{
    const TemporaryFolder folder;
    const fs::path name = folder.path() / path_of("\xc3\xb6"
                                                  "ffne mich");
    std::string bytes = "line\r\nline\n\x1a"
                        " end\n";
    while (bytes.size() < 200'000) // more than one piece
        bytes += bytes;
    std::ofstream(name, std::ios::binary) << "replaced, from here on kept";
    const int out = open_to_write(name);
    write_all(out, bytes);
    close_file(out);
    const int in = open_to_read(name);
    EXPECT_EQ(size_of(in), bytes.size());
    std::string read(bytes.size() + 10, '\0');
    std::size_t got = 0;
    while (const std::size_t more = read_some(in, read.data() + got, read.size() - got))
        got += more;
    EXPECT_EQ(read.substr(0, got), bytes);
    close_file(in);
    for (const auto open : {open_to_read, open_to_write})
        try {
            close_file(open(folder.path() / "none"));
            ADD_FAILURE();
        } catch (const std::system_error& error) {
            EXPECT_EQ(error.code(), std::errc::no_such_file_or_directory);
        }
    EXPECT_FALSE(is_stream(name));
    EXPECT_FALSE(is_stream(folder.path()));
    EXPECT_FALSE(is_stream(folder.path() / "none"));
    EXPECT_TRUE(is_stream(fs::exists("/dev/null") ? "/dev/null" : "NUL"));
    const int nothing = open_to_read(fs::exists("/dev/null") ? "/dev/null" : "NUL");
    char one;
    EXPECT_EQ(read_some(nothing, &one, 1), 0u);
    close_file(nothing);
}

TEST(System, KnowsItself)
{
    EXPECT_TRUE(fs::is_regular_file(this_program()));
    EXPECT_FALSE(processor_name().empty());
    const double before = processor_ms();
    double x = 1;
    while (processor_ms() < before + 20)
        x = x * 1.000001 + 1e-9;
    EXPECT_GT(x, 1);
    const std::uint64_t bytes = allocated_bytes();
    std::vector<char> memory(100'000'000, 'x');
    volatile const char* const kept = memory.data(); // a compiler may leave out memory that nobody reads
    EXPECT_GE(allocated_bytes(), bytes + memory.size());
    EXPECT_EQ(kept[memory.size() / 2], 'x');
    (void)preemptions();
}

/// What the tests above run is this program, which says what it was given, one word a line, or fails.
int main(int argc, char** argv)
{
    const std::vector<std::string> arguments = start(argc, argv);
    const std::string does = arguments.size() > 1 ? arguments[1] : "";
    if (does == "--words")
        for (std::size_t i = 2; i < arguments.size(); ++i)
            write_all(1, arguments[i] + "\n");
    else if (does == "--copy")
        for (std::array<char, 4096> piece;
             const std::size_t count = read_some(0, piece.data(), piece.size());)
            write_all(1, std::string_view(piece.data(), count));
    else if (does == "--variable")
        write_all(1, std::getenv("JOSTLE_SYSTEM_TEST"));
    else if (does == "--fail")
        return write_all(1, "out "), write_all(2, "err"), 3;
    else {
        testing::InitGoogleTest(&argc, argv);
        return RUN_ALL_TESTS();
    }
    return 0;
}
