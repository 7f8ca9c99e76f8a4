// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

namespace jostle_tool {

/// Ctrl-C, and the signal by which programs are asked to end, for commands that go on until one comes. While
/// an object lives they don't end the program but are seen here; one object at a time.
class Interrupt
{
  public:
    Interrupt()
    {
        came_ = 0;
        for (std::size_t k = 0; k < 2; ++k)
            before_[k] = std::signal(signals[k], [](int) { came_ = 1; });
    }
    ~Interrupt()
    {
        for (std::size_t k = 0; k < 2; ++k)
            std::signal(signals[k], before_[k]);
    }
    Interrupt(const Interrupt&) = delete;
    Interrupt& operator=(const Interrupt&) = delete;

    /// Waits for so long, or until it comes; whether it has come.
    [[nodiscard]] bool wait_for(std::chrono::nanoseconds time) const
    {
        using Clock = std::chrono::steady_clock;
        // Of what a handler may do, nothing wakes another thread.
        constexpr std::chrono::nanoseconds look_every = std::chrono::milliseconds(20);
        for (const auto end = Clock::now() + time; came_ == 0 && Clock::now() < end;)
            std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(end - Clock::now(), look_every));
        return came_ != 0;
    }
    void wait() const
    {
        while (!wait_for(std::chrono::hours(1)))
            ;
    }

  private:
    static constexpr int signals[2] = {SIGINT, SIGTERM};
    static inline volatile std::sig_atomic_t came_ = 0;
    void (*before_[2])(int);
};

} // namespace jostle_tool
