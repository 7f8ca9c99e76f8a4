// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>

#include "jostle/executor.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Calls body(slot, begin, end) for runs of `per_claim` that make up [0, count), on at most `slots` threads.
/// The first exception leaves the call after all have ended.
template <class Body>
void share_out(Executor& executor, std::uint32_t slots, std::size_t count, std::size_t per_claim,
               const Body& body)
{
    const std::size_t claims = (count + per_claim - 1) / per_claim;
    slots = static_cast<std::uint32_t>(std::min<std::size_t>(slots, claims));
    if (slots <= 1) {
        for (std::size_t begin = 0; begin < count; begin += per_claim)
            body(std::uint32_t{0}, begin, std::min(count, begin + per_claim));
        return;
    }
    std::atomic<std::size_t> next{0};
    std::atomic<bool> failed{false};
    std::exception_ptr failure;
    executor.run(slots, [&](std::uint32_t slot) {
        try {
            for (std::size_t claim; (claim = next.fetch_add(1, std::memory_order_relaxed)) < claims;) {
                if (failed.load(std::memory_order_relaxed)) return;
                body(slot, claim * per_claim, std::min(count, (claim + 1) * per_claim));
            }
        } catch (...) {
            if (!failed.exchange(true)) failure = std::current_exception();
        }
    });
    if (failure) std::rethrow_exception(failure);
}

} // namespace index
JOSTLE_NAMESPACE_END
