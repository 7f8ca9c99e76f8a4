// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Numbers as arguments give them, and as tables and JSON show them.

namespace jostle_tool {

/// A whole number in any of the ways to write one: 250000, 250,000, 250k, 0.25M, 2.5e5. Nothing if it is
/// none, or has more than 64 bits.
[[nodiscard]] std::optional<std::uint64_t> read_whole(std::string_view text);

/// The entries of a list with commas. Where a group of three digits begins with 0, as in 1,000,000, and all
/// are such groups, it is one number; 100,200 are two.
[[nodiscard]] std::vector<std::string> read_list(std::string_view text);

/// A time in a unit that leaves digits to see: us below a tenth of a ms, s from a thousand on.
[[nodiscard]] std::string time_text(double ms);

/// How long what is left of a work takes if it goes on like this, `, about 12 s left`; `part` of it took so
/// long. Nothing of a work that has hardly begun.
[[nodiscard]] std::string time_left(double part, double seconds);

/// With commas: 1,000,000.
inline std::string grouped(std::uint64_t number)
{
    std::string text = std::to_string(number);
    for (std::size_t i = text.size(); i > 3;)
        text.insert(i -= 3, ",");
    return text;
}

/// A checksum: 16 digits.
inline std::string hex(std::uint64_t number)
{
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(number));
    return text;
}

/// A time, to four decimal places: no clock says more, and JSON would print all 17 digits.
inline double rounded(double time)
{
    return std::round(time * 1e4) / 1e4;
}

/// Of an even number of values the mean of the two in the middle; 0 of none.
inline double median(std::vector<double> values)
{
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

} // namespace jostle_tool
