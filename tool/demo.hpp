// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace jostle_tool {

struct DemoOptions
{
    std::optional<std::string> recording; // none: our own
    std::size_t boxes = 1'000'000;
    std::uint32_t frames = 10;
    std::uint32_t threads = 0;
};

/// Shows the touching pairs of recorded bodies, frame by frame, then of a million boxes; timed and checked.
/// Throws a UsageError for a recording that can't be played, and a std::runtime_error if pairs are wrong.
void run_demo(const DemoOptions& options);

} // namespace jostle_tool
