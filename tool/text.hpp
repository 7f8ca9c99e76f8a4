// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Text from files and arguments, as messages can show it.

namespace jostle_tool {

/// Valid UTF-8 stays as it is, but control characters and all other bytes become \x1b: nothing that a file
/// says can command a terminal.
[[nodiscard]] std::string printable(std::string_view text);

/// The beginning of a text, printable.
[[nodiscard]] std::string shortened(std::string_view text, std::size_t longest = 40);

/// The same in quotes.
[[nodiscard]] std::string quote(std::string_view text);

/// `; did you mean X?`, where X is the name most like a word that is none of them; if none is much like it,
/// `; choose from` all of them.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string>& names);

} // namespace jostle_tool
