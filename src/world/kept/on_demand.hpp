// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <mutex>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Makes a value when it is first requested, once until it is forgotten. Any number of threads may request it
/// at a time: one makes it, and the others wait.
class OnDemand
{
  public:
    template <class Make>
    void ensure(const Make& make)
    {
        if (is_made_.load(std::memory_order_acquire)) return;
        const std::lock_guard lock(mutex_);
        if (is_made_.load(std::memory_order_relaxed)) return;
        make();
        is_made_.store(true, std::memory_order_release);
    }
    /// Called by an update, during which there are no requests.
    void forget() noexcept { is_made_.store(false, std::memory_order_relaxed); }

  private:
    std::mutex mutex_; // held while the value is made
    std::atomic<bool> is_made_{false};
};

} // namespace world
JOSTLE_NAMESPACE_END
