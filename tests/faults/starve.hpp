// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>

namespace faults {

/// Sets which call of the global operator new fails from now on, counted from the next; and those after it.
void fail_after(std::uint64_t allocations);
/// False where the thread sanitizer brings an operator new of its own, which never fails.
bool can_fail();
constexpr std::uint64_t never = std::numeric_limits<std::uint64_t>::max();

/// Calls `call`, which says whether memory ran out, with less and less memory, then with enough. After each
/// failure calls `check`. Returns how often it failed.
template <class Call, class Check>
std::uint64_t starve(const Call& call, const Check& check)
{
    for (std::uint64_t k = 0;; ++k) {
        fail_after(k);
        const bool failed = call();
        fail_after(never);
        if (!failed) return k;
        check(k);
    }
}

} // namespace faults
