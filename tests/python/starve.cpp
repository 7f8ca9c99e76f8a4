// SPDX-License-Identifier: MIT
// Preloaded into Python, it puts an operator new in place of libstdc++'s that can be told to fail, on any
// thread. malloc isn't touched: Python, NumPy and the C++ runtime itself live on it, and what they do without
// memory is no matter of the package, whose own memory all comes from operator new.
#include "tests/global_new.hpp"

extern "C" {

/// From now on, allocation `first` (counted from 0) and those after it up to `end` fail.
[[gnu::visibility("default")]] void starve_begin(std::uint64_t first, std::uint64_t end)
{
    global_new::fail_at = global_new::never;
    global_new::calls = 0;
    global_new::fail_until = end;
    global_new::fail_at = first;
}
/// There is memory again. Returns how many allocations there were since the beginning.
[[gnu::visibility("default")]] std::uint64_t starve_end()
{
    global_new::fail_at = global_new::never;
    return global_new::calls;
}
/// How many blocks of memory haven't been given back.
[[gnu::visibility("default")]] std::int64_t starve_blocks()
{
    return global_new::blocks;
}
}
