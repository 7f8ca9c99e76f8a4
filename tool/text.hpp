// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

/// Text from files and arguments, as messages can show it.

namespace jostle_tool {

/// Valid UTF-8 stays as it is, but control characters and all other bytes become \x1b: nothing that a file
/// says can command a terminal.
[[nodiscard]] std::string printable(std::string_view text);

/// The beginning of a text, printable.
[[nodiscard]] std::string shortened(std::string_view text, std::size_t longest = 40);

/// The same in quotes.
[[nodiscard]] std::string quote(std::string_view text);

} // namespace jostle_tool
