// SPDX-License-Identifier: MIT
#include "numbers.hpp"

#include <charconv>
#include <limits>
#include <system_error>

namespace jostle_tool {

namespace {

bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/// Whether commas stand where grouped() puts them, behind a first group that isn't 0.
bool is_grouped(std::string_view text)
{
    const std::size_t first = text.find(',');
    if (first == 0 || first > 3 || text[0] == '0') return false;
    for (std::size_t i = 0; i < text.size(); ++i)
        if (i >= first && (i - first) % 4 == 0 ? text[i] != ',' : !is_digit(text[i])) return false;
    return (text.size() - first) % 4 == 0;
}

std::string without_commas(std::string_view text)
{
    std::string digits(text);
    std::erase(digits, ',');
    return digits;
}

} // namespace

std::optional<std::uint64_t> read_whole(std::string_view text)
{
    std::string digits =
        text.find(',') == text.npos || !is_grouped(text) ? std::string(text) : without_commas(text);
    // 2.5e6 is 25 with 5 zeros behind it.
    int zeros = 0;
    if (const std::size_t e = digits.find_first_of("kKMeE"); e != digits.npos) {
        const char* const end = digits.data() + digits.size();
        if (digits[e] != 'e' && digits[e] != 'E') {
            if (e + 1 != digits.size()) return {};
            zeros = digits[e] == 'M' ? 6 : 3;
        } else {
            const char* const first = digits.data() + e + 1 + (digits.substr(e + 1).starts_with('+') ? 1 : 0);
            const auto result = std::from_chars(first, end, zeros);
            if (first == end || !is_digit(*first) || result.ec != std::errc() || result.ptr != end) return {};
        }
        digits.resize(e);
        if (const std::size_t point = digits.find('.'); point != digits.npos) {
            zeros -= static_cast<int>(digits.size() - point - 1);
            digits.erase(point, 1);
            if (point == 0 || point == digits.size()) return {};
        }
    }
    std::uint64_t number = 0;
    const char* const end = digits.data() + digits.size();
    const auto result = std::from_chars(digits.data(), end, number);
    if (result.ec != std::errc() || result.ptr != end) return {};
    for (; zeros < 0; ++zeros) {
        if (number % 10 != 0) return {};
        number /= 10;
    }
    for (; zeros > 0 && number != 0; --zeros) {
        if (number > std::numeric_limits<std::uint64_t>::max() / 10) return {};
        number *= 10;
    }
    return number;
}

std::vector<std::string> read_list(std::string_view text)
{
    // No number of a list begins with 0, but 0 itself.
    if (is_grouped(text) && text.find(",0") != text.npos) return {without_commas(text)};
    std::vector<std::string> entries;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        entries.emplace_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return entries;
}

std::string time_text(double ms)
{
    char text[40];
    if (ms < 0.1)
        std::snprintf(text, sizeof text, "%.1f us", ms * 1000);
    else if (ms < 1000)
        std::snprintf(text, sizeof text, "%.3f ms", ms);
    else
        std::snprintf(text, sizeof text, "%.2f s", ms / 1000);
    return text;
}

std::string time_left(double part, double seconds)
{
    if (part < 0.02 || part >= 1) return "";
    const double left = seconds * (1 - part) / part;
    char text[60];
    if (left < 120)
        std::snprintf(text, sizeof text, ", about %.0f s left", left);
    else
        std::snprintf(text, sizeof text, ", about %.0f min left", left / 60);
    return text;
}

} // namespace jostle_tool
