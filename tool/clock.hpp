// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>

namespace jostle_tool {

using Clock = std::chrono::steady_clock;

[[nodiscard]] inline double ms_between(Clock::time_point begin, Clock::time_point end)
{
    return std::chrono::duration<double, std::milli>(end - begin).count();
}
[[nodiscard]] inline double ms_since(Clock::time_point begin)
{
    return ms_between(begin, Clock::now());
}

} // namespace jostle_tool
