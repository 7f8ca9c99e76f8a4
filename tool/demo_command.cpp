// SPDX-License-Identifier: MIT
// jostle demo.
#include <memory>

#include "commands.hpp"
#include "demo.hpp"
#include "options.hpp"

namespace jostle_tool {

namespace {

constexpr const char* help =
    R"(Plays recorded boxes and then a million moving ones, and checks a sample of the pairs against the
definition; exit status 1 if they differ.

Examples:
  jostle demo
  jostle demo --threads 1
  jostle demo --recording mine.jrec -n 100000)";

} // namespace

void add_demo_command(const Command& app)
{
    const Command command = app.add("demo", "Plays recorded boxes, then a million: timed and checked", help);
    const auto options = std::make_shared<DemoOptions>();
    command.text("--recording", options->recording, "FILE", "Play this recording (.jrec)");
    command.number("-n", options->boxes, 1, 10'000'000, "N", "How many boxes in the second part (1,000,000)");
    command.number("--frames", options->frames, 1, 100'000, "F", "How many of its frames are counted (10)");
    command.threads(options->threads);
    command.on_run([options] { run_demo(*options); });
}

} // namespace jostle_tool
