// SPDX-License-Identifier: MIT
#include "program.hpp"

#include <cstdio>
#include <exception>
#include <new>

#include "commands.hpp"
#include "jostle/error.hpp"
#include "text.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

constexpr int exit_internal = 1;
constexpr int exit_usage = 2;

/// One line of bearable length, whatever the message quotes.
int fail(int code, std::string message)
{
    constexpr std::size_t start = 2000, end = 500;
    if (message.size() > start + end) message.replace(start, message.size() - start - end, " ... ");
    std::fprintf(stderr, "jostle: %s\n", printable(message).c_str());
    return code;
}

} // namespace

int run_program(int argc, char** argv, const std::function<void(const std::vector<std::string>&)>& work)
{
    const std::vector<std::string> arguments = jostle_system::start(argc, argv);
    try {
        work(arguments);
        // What went to stdout may still find the disk full.
        if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
        return fail(exit_usage, "stdout: can't be written; make room, or write elsewhere");
    } catch (const UsageError& error) {
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

} // namespace jostle_tool
