// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace jostle_tool {

/// A command while it is said what it takes: its options, its parts, and what it does. What options set must
/// live as long as the command.
///
/// It hides the library that reads arguments, which takes longer to compile than most commands: only
/// options.cpp, command_line.cpp and manual.cpp include that.
class Command
{
  public:
    explicit Command(CLI::App& app) : app_(&app) {}

    /// A command below this one; `footer` is what its help ends with.
    [[nodiscard]] Command add(const std::string& name, const std::string& summary,
                              const std::string& footer) const;
    /// What it does, once all of its arguments are understood.
    void on_run(std::function<void()> work) const;

    // Options, or positions if the name has no hyphen. `word` is what help calls the value.

    void text(const std::string& name, std::string& value, const std::string& word,
              const std::string& help) const;
    void text(const std::string& name, std::optional<std::string>& value, const std::string& word,
              const std::string& help) const;
    void text(const std::string& name, std::filesystem::path& value, const std::string& word,
              const std::string& help) const;
    void required(const std::string& name, std::string& value, const std::string& word,
                  const std::string& help) const;
    /// Any number of positions.
    void texts(const std::string& name, std::vector<std::string>& values, const std::string& help) const;
    /// One or more.
    void required(const std::string& name, std::vector<std::string>& values, const std::string& word,
                  const std::string& help) const;

    void flag(const std::string& name, bool& value, const std::string& help) const;
    /// `name{TEXT}`: the value is TEXT if none is given.
    void flag(const std::string& name, std::string& value, const std::string& help) const;

    /// `choose` takes the value, or calls refuse().
    void choice(const std::string& name, std::function<void(const std::string&)> choose,
                const std::string& word, const std::string& help) const;

    /// A whole number, written as read_whole() reads it; `value` stays as it is if it isn't given.
    template <class Number>
    void number(const std::string& name, Number& value, std::uint64_t least, std::uint64_t most,
                const std::string& word, const std::string& help) const
    {
        whole_number(
            name, [&value](std::uint64_t number) { value = static_cast<Number>(number); }, least, most, word,
            help);
    }
    void whole_number(const std::string& name, std::function<void(std::uint64_t)> set, std::uint64_t least,
                      std::uint64_t most, const std::string& word, const std::string& help) const;
    /// Any number from one to another.
    void number_between(const std::string& name, double& value, double least, double most,
                        const std::string& word, const std::string& help) const;

    /// Several whole numbers, with commas between them.
    template <class Number>
    void numbers(const std::string& name, std::vector<Number>& values, std::uint64_t least,
                 std::uint64_t most, const std::string& word, const std::string& help) const
    {
        whole_numbers(name, assign_to(values), least, most, false, word, help);
    }
    /// The same, or with spaces between them: for commands without positions.
    template <class Number>
    void spaced_numbers(const std::string& name, std::vector<Number>& values, std::uint64_t least,
                        std::uint64_t most, const std::string& word, const std::string& help) const
    {
        whole_numbers(name, assign_to(values), least, most, true, word, help);
    }
    void spaced_numbers(const std::string& name, std::vector<float>& values, const std::string& word,
                        const std::string& help) const;

    /// --seed.
    void seed(std::uint64_t& seed, const std::string& help) const;
    /// --threads, the same in all commands. `threads` stays 0 if it isn't given.
    void threads(std::uint32_t& threads) const;

    /// It has parts, of which one at most is chosen, each with options of its own: of this command's those
    /// are refused that stand before a part's name, and would be lost. After all of both were added.
    void refuse_options_before_parts() const;
    [[nodiscard]] bool part_is_chosen() const;
    [[nodiscard]] std::vector<std::string> part_names() const;

  private:
    template <class Number>
    static auto assign_to(std::vector<Number>& values)
    {
        return [&values](std::span<const std::uint64_t> numbers) {
            values.clear();
            for (const std::uint64_t number : numbers)
                values.push_back(static_cast<Number>(number));
        };
    }
    void whole_numbers(const std::string& name, std::function<void(std::span<const std::uint64_t>)> set,
                       std::uint64_t least, std::uint64_t most, bool spaced, const std::string& word,
                       const std::string& help) const;

    CLI::App* app_;
};

/// What there is to choose from, each with a name and a summary, as help lists it: a summary stands so far
/// from where its name begins.
template <class Entries>
std::string listed(const std::string& title, const Entries& entries, std::size_t width)
{
    std::string text = title + ":\n";
    for (const auto& entry : entries) {
        std::string name(entry.name);
        name.resize(width, ' ');
        text += "  " + name + std::string(entry.summary) + "\n";
    }
    return text;
}

/// Refuses what was given for an option; the message ends with where help is.
[[noreturn]] void refuse(const std::string& option, const std::string& why);

} // namespace jostle_tool
