// SPDX-License-Identifier: MIT
#include "command_line.hpp"

#include <string>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "jostle/version.hpp"
#include "options.hpp"

namespace jostle_tool {

namespace {

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

void add_commands(CLI::App& app)
{
    app.description(
        "Which boxes touch: finds all pairs of touching axis-aligned boxes, exactly, on all cores.");
    app.name("jostle");
    app.set_version_flag("--version", version, "Print the version and exit");
    app.require_subcommand(1);
    app.failure_message([](const CLI::App*, const CLI::Error&) { return std::string(); });
    const Command command(app);
    add_pairs_command(command);
    add_bench_command(command);
    add_chapter_command(command);
    add_compare_command(command);
    add_demo_command(command);
    add_simulate_command(command);
    add_replay_command(command);
    add_report_command(command);
    add_distribute_command(command);
    app.footer(R"(Examples:
  jostle pairs boxes.csv            the touching pairs of a file of boxes
  jostle bench uniform -n 1000000   how long a million boxes take
  jostle chapter                    the chapter's figures on this machine
  jostle demo                       recorded moving boxes, frame by frame
  jostle compare mine.jrec          what every system takes on your own boxes
  jostle report result.json         saved measurements as a page with plots
  jostle simulate                   bodies that fall, collide and come to rest
  jostle replay mine.jrec           recorded boxes in your browser
  jostle distribute --ranks 4       one scene over several ranks of MPI
Exit status: 0 done, 2 bad input (one line on stderr says what to do), 1 our fault.)");
}

void run(CLI::App& app, int argc, const char* const* argv)
{
    // An empty name is most likely that of a shell's variable that isn't set.
    for (int i = 1; i < argc; ++i)
        if (const std::string argument = argv[i];
            argument.empty() || (argument.starts_with("--") && argument.ends_with('=')))
            throw UsageError("argument " + std::to_string(i) + " (" + argument +
                             ") is empty; give it a value, or leave it out");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) { // --help, --version
            app.exit(error);
            return;
        }
        if (app.get_subcommands().empty()) {
            std::string what = argc < 2 ? "say what to do" : std::string(argv[1]) + " is not a command";
            const char* before = "; choose ";
            for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
                what += before + command->get_name();
                before = ", ";
            }
            throw UsageError(what + "; see jostle --help");
        }
        throw UsageError(std::string(error.what()) + "; see " + name_of_chosen(app) + " --help");
    }
}

void run(int argc, const char* const* argv)
{
    CLI::App app;
    add_commands(app);
    run(app, argc, argv);
}

} // namespace jostle_tool
