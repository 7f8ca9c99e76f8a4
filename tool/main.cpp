// SPDX-License-Identifier: MIT
// The command `jostle`: its streams, and what becomes of errors. Each subcommand lives in its own file.
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "commands.hpp"
#include "jostle/error.hpp"
#include "text.hpp"
#include "tool/system/system.hpp"

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

} // namespace

int main(int argc, char** argv)
{
    const std::vector<std::string> arguments = jostle_system::start(argc, argv);
    try {
        std::vector<const char*> words;
        for (const std::string& argument : arguments)
            words.push_back(argument.c_str());
        jostle_tool::run(static_cast<int>(words.size()), words.data());
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
