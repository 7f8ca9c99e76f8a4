// SPDX-License-Identifier: MIT
#include "text.hpp"

#include <algorithm>
#include <cstdint>

namespace jostle_tool {

namespace {

/// How many bytes the character has that the text begins with; 0 if it is to be escaped.
std::size_t shown_bytes(std::string_view text)
{
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    if (byte(0) < 0x80) return byte(0) >= 0x20 && byte(0) != 0x7f ? 1 : 0;
    const std::size_t size = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
    if (byte(0) < 0xc0 || byte(0) > 0xf4 || size > text.size()) return 0;
    std::uint32_t character = byte(0) & (0xffu >> (size + 1));
    for (std::size_t i = 1; i < size; ++i) {
        if ((byte(i) & 0xc0) != 0x80) return 0;
        character = character << 6 | (byte(i) & 0x3f);
    }
    // Those from 0x80 to 0x9f are control characters, too. None takes more bytes than it needs.
    const std::uint32_t least = size == 2 ? 0xa0 : size == 3 ? 0x800 : 0x10000;
    const bool surrogate = character >= 0xd800 && character < 0xe000;
    return character >= least && character <= 0x10ffff && !surrogate ? size : 0;
}

/// How many letters have to be put in, left out, replaced, or exchanged with the next one, to get from one
/// word to another.
std::size_t slips(std::string_view a, std::string_view b)
{
    std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j)
        last[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        now[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = std::min(now[j], before[j - 2] + 1);
        }
        before.swap(last);
        last.swap(now);
    }
    return last[b.size()];
}

} // namespace

std::string printable(std::string_view text)
{
    std::string result;
    while (!text.empty()) {
        const std::size_t shown = shown_bytes(text);
        if (shown != 0) {
            result += text.substr(0, shown);
        } else {
            constexpr char digits[] = "0123456789abcdef";
            const auto byte = static_cast<unsigned char>(text[0]);
            result += {'\\', 'x', digits[byte >> 4], digits[byte & 15]};
        }
        text.remove_prefix(shown != 0 ? shown : 1);
    }
    return result;
}

std::string shortened(std::string_view text, std::size_t longest)
{
    if (text.size() <= longest) return printable(text);
    std::size_t size = longest;
    while (size > longest - 3 && (static_cast<unsigned char>(text[size]) & 0xc0) == 0x80)
        --size; // not in the midst of a character
    return printable(text.substr(0, size)) + "...";
}

std::string quote(std::string_view text)
{
    return '"' + shortened(text) + '"';
}

std::string suggestion(std::string_view word, const std::vector<std::string>& names)
{
    const std::string* best = nullptr;
    std::string all;
    std::size_t fewest = word.size() <= 4 ? 2 : 3; // as many are another word
    for (const std::string& name : names) {
        all += (all.empty() ? "" : ", ") + name;
        // A word that is cut off is like the whole one.
        const bool cut = word.size() > 2 && name.starts_with(word);
        const std::size_t count = cut ? 1 : word.size() > 40 ? fewest : slips(word, name);
        if (count < fewest) {
            fewest = count;
            best = &name;
        }
    }
    return best != nullptr ? "; did you mean " + *best + "?" : "; choose from " + all;
}

} // namespace jostle_tool
