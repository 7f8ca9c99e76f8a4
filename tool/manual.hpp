// SPDX-License-Identifier: MIT
#pragma once

namespace CLI {
class App;
}

namespace jostle_tool {

/// Adds `jostle manual`, which prints all that `app` understands: as a manual page, or as completion for
/// bash. Packages have what it prints. `app` must live as long as its commands.
void add_manual_command(CLI::App& app);

} // namespace jostle_tool
