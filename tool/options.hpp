// SPDX-License-Identifier: MIT
#pragma once

#include <charconv>
#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>

namespace jostle_tool {

/// An option that takes a whole number from `least` to `most`; `value` stays as it is if it isn't given.
template <class Number, class Value>
CLI::Option* add_number_option(CLI::App& command, const std::string& name, Value& value, Number least,
                               Number most, const std::string& help)
{
    const auto set = [&value, name, least, most](const std::string& text) {
        Number number{};
        const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
        if (result.ec != std::errc() || result.ptr != text.data() + text.size() || number < least ||
            number > most)
            throw CLI::ValidationError(name, text + " is not a whole number from " + std::to_string(least) +
                                                 " to " + std::to_string(most));
        value = number;
    };
    return command.add_option_function<std::string>(name, set, help);
}

/// --seed.
inline void add_seed_option(CLI::App& command, std::uint64_t& seed, const std::string& help)
{
    add_number_option(command, "--seed", seed, std::uint64_t{0}, ~std::uint64_t{0}, help)->type_name("S");
}

} // namespace jostle_tool
