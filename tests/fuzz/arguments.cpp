// SPDX-License-Identifier: MIT
// Command lines, which are understood and not run: any words, one a line, and those of `jostle pairs` in
// all ways to write them, of which it is known whether they are good.
#include <algorithm>
#include <iostream>
#include <optional>

#include <CLI/CLI.hpp>

#include "target.hpp"
#include "tool/command_line.hpp"
#include "tool/commands.hpp"

namespace {

using Words = std::vector<std::string>;

/// Thrown once all arguments are understood, before anything is run.
struct Understood
{
};

/// What is wrong with the arguments, if anything.
std::optional<std::string> complaint(const Words& words)
{
    static CLI::App* const app = [] {
        auto* const made = new CLI::App;
        jostle_tool::add_commands(*made);
        made->parse_complete_callback([] { throw Understood{}; });
        return made;
    }();
    std::vector<const char*> arguments{"jostle"};
    for (const std::string& word : words)
        arguments.push_back(word.c_str());
    std::optional<std::string> what;
    std::streambuf* const out = std::cout.rdbuf(nullptr); // --help is no news
    try {
        jostle_tool::run(*app, static_cast<int>(arguments.size()), arguments.data());
    } catch (const jostle_tool::UsageError& error) {
        what = error.what();
    } catch (const Understood&) {
    }
    std::cout.rdbuf(out);
    return what;
}

/// Arguments of `jostle pairs`, and whether they are good.
struct Made
{
    Words words;
    bool good = true;

    explicit Made(fuzz::Input& in)
    {
        words.push_back("pairs");
        bool has_file = false, has_output = false, has[5] = {};
        for (std::uint32_t k = in.below(8); k > 0; --k)
            switch (in.below(6)) {
            case 0:
                good &= !has_file;
                has_file = true;
                words.push_back("boxes.csv");
                break;
            case 1:
                once(has[0]);
                option(in, "--frame", number(in, 0, 0xffffffffu));
                break;
            case 2:
                once(has[1]);
                option(in, "--threads", number(in, 1, 1024));
                break;
            case 3: {
                once(has[2]);
                static const char* const engines[] = {"default", "chapter", "brute", "fast", "Brute", "brut"};
                const std::uint32_t which = in.below(6);
                good &= which < 3;
                option(in, "--engine", engines[which]);
                break;
            }
            case 4:
                words.push_back(in.below(2) == 0 ? "--stats" : "--parts"); // as often as one likes
                break;
            default:
                once(has_output);
                if (in.below(2) == 0)
                    option(in, "--output", "pairs.csv");
                else
                    words.insert(words.end(), {"-o", "pairs.csv"});
            }
        good &= has_file;
    }

  private:
    void once(bool& has)
    {
        good &= !has;
        has = true;
    }
    void option(fuzz::Input& in, const std::string& name, const std::string& value)
    {
        if (in.below(2) == 0)
            words.push_back(name + "=" + value);
        else
            words.insert(words.end(), {name, value});
    }
    std::string number(fuzz::Input& in, std::int64_t least, std::int64_t most)
    {
        const std::int64_t value = (in.below(2) == 0 ? least : most) + std::int64_t{in.below(5)} - 2;
        good &= least <= value && value <= most;
        std::string text = std::to_string(value);
        switch (in.below(16)) {
        case 13:
            text.insert(text[0] == '-' ? 1 : 0, "0");
            break;
        case 14:
            text += in.below(2) == 0 ? ".0" : "x";
            good = false;
            break;
        case 15:
            text = "+" + text;
            good = false;
            break;
        default:
            break;
        }
        return text;
    }
};

} // namespace

JOSTLE_FUZZ_TARGET(arguments)
{
    Words words;
    std::optional<bool> good;
    if (in.below(2) == 0) {
        Made made(in);
        words = made.words;
        good = made.good;
    } else {
        words.emplace_back();
        for (const std::uint8_t byte : in.rest())
            if (byte == '\n')
                words.emplace_back();
            else if (byte != 0)
                words.back() += static_cast<char>(byte);
    }
    if (fuzz::telling())
        for (const std::string& word : words)
            fuzz::tell(word);
    const auto first = complaint(words);
    fuzz::demand(!first || !first->empty(), "a refusal without words");
    if (good) fuzz::demand(*good == !first, *good ? "good arguments are refused" : "bad arguments are taken");
    fuzz::demand(complaint(words) == first, "another answer the second time");
}
