// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

/// Numbers as tables and JSON show them.

namespace jostle_tool {

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
