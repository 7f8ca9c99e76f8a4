// SPDX-License-Identifier: MIT
#pragma once

namespace CLI {
class App;
}

namespace jostle_tool {

/// Adds all that `jostle` understands: its commands and options.
void add_commands(CLI::App& app);

/// Does what the arguments say. Throws a UsageError where they can't be understood, and what a command
/// throws.
void run(CLI::App& app, int argc, const char* const* argv);

/// The same with all of add_commands().
void run(int argc, const char* const* argv);

} // namespace jostle_tool
