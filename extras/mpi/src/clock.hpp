// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

class Clock
{
  public:
    /// Microseconds since the last call.
    double lap() noexcept
    {
        const auto now = std::chrono::steady_clock::now();
        const double us = std::chrono::duration<double, std::micro>(now - last_).count();
        last_ = now;
        return us;
    }

  private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

} // namespace mpi
JOSTLE_NAMESPACE_END
