// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "clock.hpp"
#include "numbers.hpp"

namespace jostle_tool {

/// The times of some runs, in ms, ascending, after others that don't count; what `prepare` does before each
/// isn't timed.
template <class Prepare, class Work>
std::vector<double> sorted_times(std::uint32_t uncounted, std::uint32_t runs, const Prepare& prepare,
                                 const Work& work)
{
    std::vector<double> ms;
    for (std::uint32_t run = 0; run < uncounted + runs; ++run) {
        prepare(run);
        const Clock::time_point before = Clock::now();
        work();
        const Clock::time_point after = Clock::now();
        if (run >= uncounted) ms.push_back(ms_between(before, after));
    }
    std::sort(ms.begin(), ms.end());
    return ms;
}

/// Takes turns, so that whatever else the machine does falls on all alike; each one's median, after a first
/// turn that doesn't count.
inline std::vector<double> medians(std::uint32_t frames, const std::vector<std::function<void()>>& systems)
{
    std::vector<std::vector<double>> ms(systems.size());
    for (std::uint32_t frame = 0; frame <= frames; ++frame)
        for (std::size_t k = 0; k < systems.size(); ++k) {
            const auto before = Clock::now();
            systems[k]();
            const auto after = Clock::now();
            if (frame > 0) ms[k].push_back(ms_between(before, after));
        }
    std::vector<double> result;
    for (std::vector<double>& of_one : ms)
        result.push_back(median(std::move(of_one)));
    return result;
}

} // namespace jostle_tool
