// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

namespace jostle_tool {

/// A progress bar on stderr, for as long as the object lives. It shows up only if stderr is a terminal, and
/// only after a second, so that quick work and scripts see nothing of it; the destructor wipes it away.
///
/// Threads  step() may be called from any thread and costs one atomic addition: a thread of its own draws.
class Progress
{
  public:
    /// `total` in any unit, that of step(); 0 if it isn't known: then the time that has passed is shown.
    Progress(const std::string& label, std::uint64_t total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void step(std::uint64_t n = 1) noexcept { done_.fetch_add(n, std::memory_order_relaxed); }

  private:
    void draw_until(std::stop_token stop);

    std::string label_;
    std::uint64_t total_;
    std::atomic<std::uint64_t> done_{0};
    std::jthread drawer_; // last: it reads the others
};

} // namespace jostle_tool
