// SPDX-License-Identifier: MIT
// The command `jostle`: options and errors. Each subcommand lives in its own file.
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "jostle/error.hpp"
#include "jostle/version.hpp"
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

#define JOSTLE_TEXT_OF(x) #x
#define JOSTLE_TEXT(x) JOSTLE_TEXT_OF(x)
constexpr const char* version = "jostle " JOSTLE_TEXT(JOSTLE_VERSION_MAJOR) "." JOSTLE_TEXT(
    JOSTLE_VERSION_MINOR) "." JOSTLE_TEXT(JOSTLE_VERSION_PATCH);

std::string name_of_chosen(const CLI::App& app)
{
    std::string name = "jostle";
    for (const CLI::App* chosen = &app; !chosen->get_subcommands().empty();) {
        chosen = chosen->get_subcommands().front();
        name += " " + chosen->get_name();
    }
    return name;
}

} // namespace

int main(int argc, char** argv)
{
    fill_standard_streams();
    CLI::App app("Which boxes touch: finds all pairs of touching axis-aligned boxes, exactly, on all cores.",
                 "jostle");
    app.set_version_flag("--version", version, "Print the version and exit");
    app.require_subcommand(1);
    app.failure_message([](const CLI::App*, const CLI::Error&) { return std::string(); });
    jostle_tool::add_pairs_command(app);
    jostle_tool::add_bench_command(app);
    jostle_tool::add_chapter_command(app);
    jostle_tool::add_compare_command(app);
    jostle_tool::add_demo_command(app);
    jostle_tool::add_simulate_command(app);
    jostle_tool::add_replay_command(app);
    jostle_tool::add_distribute_command(app);
    app.footer(R"(Examples:
  jostle pairs boxes.csv            the touching pairs of a file of boxes
  jostle bench uniform -n 1000000   how long a million boxes take
  jostle chapter                    the chapter's figures on this machine
  jostle demo                       recorded moving boxes, frame by frame
  jostle compare mine.jrec          what every system takes on your own boxes
  jostle simulate                   bodies that fall, collide and come to rest
  jostle replay mine.jrec           recorded boxes in your browser
  jostle distribute --ranks 4       one scene over several ranks of MPI
Exit status: 0 done, 2 bad input (one line on stderr says what to do), 1 our fault.)");

    // An empty name is most likely that of a shell's variable that isn't set.
    for (int i = 1; i < argc; ++i)
        if (const std::string argument = argv[i];
            argument.empty() || (argument.starts_with("--") && argument.ends_with('=')))
            return fail(exit_usage, "argument " + std::to_string(i) + " (" + argument +
                                        ") is empty; give it a value, or leave it out");
    // What went to stdout may still find the disk full.
    const auto all_written = [] {
        if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
        return fail(exit_usage, "stdout: can't be written; make room, or write elsewhere");
    };
    try {
        app.parse(argc, argv);
        return all_written();
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) { // --help, --version
            app.exit(error);
            return all_written();
        }
        if (app.get_subcommands().empty()) {
            std::string what = argc < 2 ? "say what to do" : std::string(argv[1]) + " is not a command";
            const char* before = "; choose ";
            for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
                what += before + command->get_name();
                before = ", ";
            }
            return fail(exit_usage, what + "; see jostle --help");
        }
        return fail(exit_usage, std::string(error.what()) + "; see " + name_of_chosen(app) + " --help");
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
