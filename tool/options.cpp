// SPDX-License-Identifier: MIT
#include "options.hpp"

#include <utility>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "numbers.hpp"
#include "threads.hpp"

namespace jostle_tool {

namespace {

/// Where every whole number of an option is read.
std::uint64_t whole(const std::string& name, const std::string& text, std::uint64_t least, std::uint64_t most)
{
    const auto number = read_whole(text);
    if (!number || *number < least || *number > most)
        refuse(name,
               text + " is not a whole number from " + std::to_string(least) + " to " + std::to_string(most));
    return *number;
}

} // namespace

Command Command::add(const std::string& name, const std::string& summary, const std::string& footer) const
{
    CLI::App* const added = app_->add_subcommand(name, summary);
    added->footer(footer);
    return Command(*added);
}

void Command::on_run(std::function<void()> work) const
{
    app_->callback(std::move(work));
}

void Command::text(const std::string& name, std::string& value, const std::string& word,
                   const std::string& help) const
{
    app_->add_option(name, value, help)->type_name(word);
}

void Command::text(const std::string& name, std::optional<std::string>& value, const std::string& word,
                   const std::string& help) const
{
    app_->add_option(name, value, help)->type_name(word);
}

void Command::text(const std::string& name, std::filesystem::path& value, const std::string& word,
                   const std::string& help) const
{
    app_->add_option(name, value, help)->type_name(word);
}

void Command::required(const std::string& name, std::string& value, const std::string& word,
                       const std::string& help) const
{
    app_->add_option(name, value, help)->required()->type_name(word);
}

void Command::texts(const std::string& name, std::vector<std::string>& values, const std::string& help) const
{
    app_->add_option(name, values, help)->type_name("");
}

void Command::required(const std::string& name, std::vector<std::string>& values, const std::string& word,
                       const std::string& help) const
{
    app_->add_option(name, values, help)->required()->type_name(word);
}

void Command::flag(const std::string& name, bool& value, const std::string& help) const
{
    app_->add_flag(name, value, help);
}

void Command::flag(const std::string& name, std::string& value, const std::string& help) const
{
    app_->add_flag(name, value, help);
}

void Command::choice(const std::string& name, std::function<void(const std::string&)> choose,
                     const std::string& word, const std::string& help) const
{
    app_->add_option_function<std::string>(name, choose, help)->type_name(word);
}

void Command::whole_number(const std::string& name, std::function<void(std::uint64_t)> set,
                           std::uint64_t least, std::uint64_t most, const std::string& word,
                           const std::string& help) const
{
    choice(
        name,
        [set = std::move(set), name, least, most](const std::string& text) {
            set(whole(name, text, least, most));
        },
        word, help);
}

void Command::number_between(const std::string& name, double& value, double least, double most,
                             const std::string& word, const std::string& help) const
{
    // An empty description keeps the range out of help: it is in the text.
    app_->add_option(name, value, help)->check(CLI::Range(least, most).description(""))->type_name(word);
}

void Command::whole_numbers(const std::string& name, std::function<void(std::span<const std::uint64_t>)> set,
                            std::uint64_t least, std::uint64_t most, bool spaced, const std::string& word,
                            const std::string& help) const
{
    app_->add_option_function<std::vector<std::string>>(
            name,
            [set = std::move(set), name, least, most](const std::vector<std::string>& texts) {
                std::vector<std::uint64_t> numbers;
                for (const std::string& text : texts)
                    for (const std::string& entry : read_list(text))
                        numbers.push_back(whole(name, entry, least, most));
                set(numbers);
            },
            help)
        ->allow_extra_args(spaced)
        ->type_name(word);
}

void Command::spaced_numbers(const std::string& name, std::vector<float>& values, const std::string& word,
                             const std::string& help) const
{
    app_->add_option(name, values, help)->delimiter(',')->type_name(word);
}

void Command::seed(std::uint64_t& seed, const std::string& help) const
{
    number("--seed", seed, 0, ~std::uint64_t{0}, "S", help);
}

void Command::threads(std::uint32_t& threads) const
{
    number("--threads", threads, 1, Threads::most, "T", "How many threads; one per core if not given");
}

void Command::refuse_options_before_parts() const
{
    app_->require_subcommand(0, 1);
    for (CLI::App* part : app_->get_subcommands([](const CLI::App*) { return true; }))
        part->preparse_callback([command = app_, part](std::size_t) {
            for (const CLI::Option* option : command->get_options())
                if (option->count() > 0 && option != command->get_help_ptr())
                    throw UsageError(
                        (option->get_positional() ? option->results().front() : option->get_name()) +
                        " has no effect before " + part->get_name() +
                        "; what that takes stands after it: see jostle " + command->get_name() + " " +
                        part->get_name() + " --help");
        });
}

bool Command::part_is_chosen() const
{
    return !app_->get_subcommands().empty();
}

std::vector<std::string> Command::part_names() const
{
    std::vector<std::string> names;
    for (const CLI::App* part : app_->get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(part->get_name());
    return names;
}

void refuse(const std::string& option, const std::string& why)
{
    throw CLI::ValidationError(option, why);
}

} // namespace jostle_tool
