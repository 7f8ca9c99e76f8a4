// SPDX-License-Identifier: MIT
// jostle manual: all commands and options, as they were added, as a manual page or as completion for bash.
#include "manual.hpp"

#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "io/output_file.hpp"
#include "options.hpp"

namespace jostle_tool {

namespace {

/// The commands below one, in the order in which they were added.
std::vector<const CLI::App*> parts_of(const CLI::App& app)
{
    return app.get_subcommands([](const CLI::App*) { return true; });
}

/// Text as a manual page takes it: no line is a request, and hyphens stay what is typed.
std::string roff(const std::string& text)
{
    std::string result;
    for (const char c : text) {
        if ((c == '.' || c == '\'') && (result.empty() || result.back() == '\n')) result += "\\&";
        if (c == '\\')
            result += "\\e";
        else if (c == '-')
            result += "\\-";
        else
            result += c;
    }
    return result;
}

/// Lines that stay as they are.
std::string verbatim(const std::string& text)
{
    return text.empty() ? "" : ".PP\n.nf\n" + roff(text) + "\n.fi\n";
}

std::string options_of(const CLI::App& app)
{
    std::string text;
    for (const CLI::Option* option : app.get_options()) {
        const bool position = option->get_positional();
        std::string name = option->get_name(position, true);
        if (const std::size_t comma = name.find(','); comma != name.npos) name.insert(comma + 1, " ");
        text += ".TP\n\\fB" + roff(name) + "\\fR";
        if (!position && !option->get_type_name().empty())
            text += " \\fI" + roff(option->get_type_name()) + "\\fR";
        text += "\n" + roff(option->get_description()) + "\n";
    }
    return text;
}

void add_sections(const CLI::App& app, const std::string& name, std::string& text)
{
    for (const CLI::App* part : parts_of(app)) {
        const std::string called = name + " " + part->get_name();
        text += ".SH \"" + roff(called) + "\"\n" + roff(part->get_description()) + ".\n" + options_of(*part) +
                verbatim(part->get_footer());
        add_sections(*part, called, text);
    }
}

std::string manual_page(const CLI::App& app)
{
    std::string text = ".TH JOSTLE 1 \"\" \"" + roff(app.version()) + "\" \"User Commands\"\n.SH NAME\n" +
                       "jostle \\- finds all pairs of touching boxes\n.SH SYNOPSIS\n\\fBjostle\\fR "
                       "\\fICOMMAND\\fR [\\fIOPTION\\fR]...\n.SH DESCRIPTION\n" +
                       roff(app.get_description()) + "\n" + options_of(app) + verbatim(app.get_footer());
    add_sections(app, "jostle", text);
    return text;
}

/// What may come next after each command's name, as branches of `case`; and their names.
void add_branches(const CLI::App& app, const std::string& name, std::string& names, std::string& branches)
{
    std::string words;
    for (const CLI::App* part : parts_of(app))
        words += part->get_name() + " ";
    for (const CLI::Option* option : app.get_options())
        for (const std::string& word : option->get_lnames())
            words += "--" + word + " ";
    words.pop_back(); // there is --help
    branches += "    '" + name + "') words='" + words + "' ;;\n";
    for (const CLI::App* part : parts_of(app)) {
        const std::string called = name + " " + part->get_name();
        names += (names.empty() ? "'" : " | '") + called + "'";
        add_branches(*part, called, names, branches);
    }
}

std::string completion(const CLI::App& app)
{
    std::string names, branches;
    add_branches(app, "jostle", names, branches);
    return R"(# Completion for bash of the command jostle: its commands and options, and files elsewhere.
_jostle() {
    local called=jostle words='' i
    for ((i = 1; i < COMP_CWORD; ++i)); do
        case "$called ${COMP_WORDS[i]}" in
        )" +
           names + R"() called+=" ${COMP_WORDS[i]}" ;;
        esac
    done
    case $called in
)" + branches +
           R"(    esac
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "${COMP_WORDS[COMP_CWORD]}")
}
complete -o default -F _jostle jostle
)";
}

constexpr const char* help =
    R"-(Examples:
  jostle manual >jostle.1; man ./jostle.1
  eval "$(jostle manual --bash)"    bash completes commands and options from now on)-";

} // namespace

void add_manual_command(CLI::App& app)
{
    const Command command =
        Command(app).add("manual", "Prints all help as a manual page, or completion for bash", help);
    const auto bash = std::make_shared<bool>(false);
    command.flag("--bash", *bash, "Completion for bash instead of the manual page");
    command.on_run([&app, bash] {
        OutputFile out("-");
        out.write(*bash ? completion(app) : manual_page(app));
        out.commit();
    });
}

} // namespace jostle_tool
