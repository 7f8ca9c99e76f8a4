// SPDX-License-Identifier: MIT
#include "progress.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>

#include "numbers.hpp"
#include "text.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

Progress::Progress(const std::string& label, std::uint64_t total) : label_(printable(label)), total_(total)
{
    if (jostle_system::stderr_is_terminal())
        drawer_ = std::jthread([this](std::stop_token stop) { draw_until(stop); });
}

Progress::~Progress() = default; // jthread stops and joins

void Progress::draw_until(std::stop_token stop)
{
    using namespace std::chrono_literals;
    const auto start = std::chrono::steady_clock::now();
    std::mutex mutex;
    std::condition_variable_any wake;
    std::unique_lock lock(mutex);
    bool drawn = false;
    for (auto wait = 1000ms;; wait = 250ms) {
        wake.wait_for(lock, stop, wait, [] { return false; });
        if (stop.stop_requested()) break;
        const auto seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (total_ == 0) {
            std::fprintf(stderr, "\r%s  %.0f s\x1b[K", label_.c_str(), seconds);
        } else {
            constexpr int width = 32;
            const double part = std::min(1.0, static_cast<double>(done_.load(std::memory_order_relaxed)) /
                                                  static_cast<double>(total_));
            const int full = static_cast<int>(part * width);
            std::fprintf(stderr, "\r%s  [%.*s%.*s] %3.0f%%  %.0f s%s\x1b[K", label_.c_str(), full,
                         "################################", width - full, "................................",
                         100 * part, seconds, time_left(part, seconds).c_str());
        }
        std::fflush(stderr);
        drawn = true;
    }
    if (drawn) {
        std::fputs("\r\x1b[K", stderr);
        std::fflush(stderr);
    }
}

} // namespace jostle_tool
