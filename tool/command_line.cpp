// SPDX-License-Identifier: MIT
#include "command_line.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "jostle/version.hpp"
#include "manual.hpp"
#include "options.hpp"
#include "text.hpp"

namespace jostle_tool {

namespace {

#define JOSTLE_TEXT_OF(x) #x
#define JOSTLE_TEXT(x) JOSTLE_TEXT_OF(x)
constexpr const char* version = "jostle " JOSTLE_TEXT(JOSTLE_VERSION_MAJOR) "." JOSTLE_TEXT(
    JOSTLE_VERSION_MINOR) "." JOSTLE_TEXT(JOSTLE_VERSION_PATCH);

/// The command that the arguments got to, and all that is said before what they say to it.
struct Chosen
{
    CLI::App* app;
    std::string name = "jostle";
};

Chosen chosen_of(CLI::App& app)
{
    Chosen chosen{&app};
    while (!chosen.app->get_subcommands().empty()) {
        chosen.app = chosen.app->get_subcommands().front();
        chosen.name += " " + chosen.app->get_name();
    }
    return chosen;
}

/// If it wasn't understood because of an option that there isn't: what may be meant.
std::string meant_option(const CLI::App& app)
{
    for (const std::string& word : app.remaining()) {
        if (!word.starts_with("--")) continue;
        std::vector<std::string> names;
        for (const CLI::Option* option : app.get_options())
            for (const std::string& name : option->get_lnames())
                names.push_back("--" + name);
        return suggestion(word.substr(0, word.find('=')), names);
    }
    return "";
}

/// What went wrong, and where help is.
[[noreturn]] void refuse_arguments(const std::string& what, const std::string& command)
{
    throw UsageError(what + (what.ends_with('?') ? " See " : "; see ") + command + " --help");
}

} // namespace

void add_commands(CLI::App& app)
{
    app.description("Finds all pairs of axis-aligned boxes that touch, exactly, on all cores.");
    app.name("jostle");
    app.set_version_flag("--version", version, "Print the version and exit");
    app.require_subcommand(1);
    app.failure_message([](const CLI::App*, const CLI::Error&) { return std::string(); });
    const Command command(app);
    add_pairs_command(command);
    add_bench_command(command);
    add_chapter_command(command);
    add_compare_command(command);
    add_surface_command(command);
    add_demo_command(command);
    add_simulate_command(command);
    add_replay_command(command);
    add_report_command(command);
    add_distribute_command(command);
    add_manual_command(app);
    app.footer(R"(Examples:
  jostle pairs boxes.csv            the touching pairs of a file of boxes
  jostle bench uniform -n 1000000   time a million boxes
  jostle chapter                    the thesis chapter's figures on this machine
  jostle demo                       recorded moving boxes, frame by frame
  jostle compare mine.jrec          time every system on your own boxes
  jostle surface cloth.obj          where a mesh is near itself, or crosses itself
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
    std::vector<const char*> arguments(argv, argv + argc);
    if (argc > 1 && std::string(argv[1]) == "help") { // help bench world: bench world --help
        arguments.erase(arguments.begin() + 1);
        arguments.push_back("--help");
    }
    const std::string word = arguments.size() < 2 ? "" : arguments[1];
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(command->get_name());
    if (!word.starts_with('-') && std::find(names.begin(), names.end(), word) == names.end())
        refuse_arguments((word.empty() ? "say what to do" : word + " is not a command") +
                             suggestion(word, names),
                         "jostle");
    try {
        app.parse(static_cast<int>(arguments.size()), arguments.data());
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) { // --help, --version
            app.exit(error);
            return;
        }
        const Chosen chosen = chosen_of(app);
        if (chosen.app == &app)
            refuse_arguments(word + " is not a command" + suggestion(word, {"--help", "--version"}),
                             chosen.name);
        refuse_arguments(error.what() + meant_option(*chosen.app), chosen.name);
    }
}

void run(int argc, const char* const* argv)
{
    CLI::App app;
    add_commands(app);
    run(app, argc, argv);
}

} // namespace jostle_tool
