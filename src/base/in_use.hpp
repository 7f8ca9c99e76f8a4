// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <string>

#include "jostle/error.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Marks an object that allows one call at a time as in use while a call lasts. Another call, from a callback
/// or from another thread, is then an error rather than a wrong answer.
class InUse
{
  public:
    InUse(std::atomic<bool>& in_use, const char* name) : in_use_(in_use)
    {
        if (in_use_.exchange(true, std::memory_order_acquire))
            throw Error(ErrorCode::invalid_argument,
                        std::string("this ") + name +
                            " is in use by another call, from another thread or from the call that runs this "
                            "callback; it allows one call at a time");
    }
    InUse(const InUse&) = delete;
    InUse& operator=(const InUse&) = delete;
    ~InUse() { in_use_.store(false, std::memory_order_release); }

  private:
    std::atomic<bool>& in_use_;
};

JOSTLE_NAMESPACE_END
