// SPDX-License-Identifier: MIT
// The command `jostle`: its streams, and what becomes of errors. Each subcommand lives in its own file.
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include <CLI/CLI.hpp>

#include "command_line.hpp"
#include "commands.hpp"
#include "jostle/error.hpp"
#include "text.hpp"

namespace {

constexpr int exit_internal = 1;
constexpr int exit_usage = 2;

/// One line of bearable length, whatever the message quotes.
int fail(int code, std::string message)
{
    constexpr std::size_t start = 2000, end = 500;
    if (message.size() > start + end) message.replace(start, message.size() - start - end, " ... ");
    std::fprintf(stderr, "jostle: %s\n", jostle_tool::printable(message).c_str());
    return code;
}

/// A program that was started without stdin, stdout or stderr would get their numbers for the first files
/// that it opens, and then print into them. These take their place and can't be used: a read or write fails.
void fill_standard_streams()
{
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
            (void)open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY); // the lowest free number
}

} // namespace

int main(int argc, char** argv)
{
    fill_standard_streams();
    try {
        CLI::App app;
        jostle_tool::add_commands(app);
        jostle_tool::run(app, argc, argv);
        // What went to stdout may still find the disk full.
        if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
        return fail(exit_usage, "stdout: can't be written; make room, or write elsewhere");
    } catch (const jostle_tool::UsageError& error) {
        return fail(exit_usage, error.what());
    } catch (const jostle::Error& error) {
        return fail(exit_usage, error.what());
    } catch (const std::bad_alloc&) {
        return fail(exit_usage,
                    "out of memory; use fewer boxes at a time, or what doesn't store pairs (--stats)");
    } catch (const std::exception& error) {
        return fail(exit_internal, std::string("internal error: ") + error.what());
    }
}
