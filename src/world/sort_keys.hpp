// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Sorts by key(value), an unsigned number, ascending; equal keys stay as they are ordered if there are many.
/// Few values by comparison, many by digits of 11 bits, least significant first, but for those digits that
/// are the same in all.
template <class Value, class Key>
void sort_by_key(std::pmr::vector<Value>& values, std::pmr::vector<Value>& scratch, const Key& key)
{
    const auto less = [&](const Value& x, const Value& y) { return key(x) < key(y); };
    if (std::is_sorted(values.begin(), values.end(), less)) return;
    if (values.size() < 1024) {
        std::sort(values.begin(), values.end(), less);
        return;
    }
    using Number = decltype(key(values.front()));
    constexpr int digit_bits = 11,
                  digits = (8 * static_cast<int>(sizeof(Number)) + digit_bits - 1) / digit_bits;
    constexpr std::size_t radix = std::size_t{1} << digit_bits;
    std::array<std::array<std::size_t, radix>, digits> count{};
    for (const Value& value : values)
        for (int d = 0; d < digits; ++d)
            ++count[static_cast<std::size_t>(d)][(key(value) >> (d * digit_bits)) & (radix - 1)];
    scratch.resize(values.size());
    for (int d = 0; d < digits; ++d) {
        std::array<std::size_t, radix>& next = count[static_cast<std::size_t>(d)];
        const std::size_t sample = (key(values.front()) >> (d * digit_bits)) & (radix - 1);
        if (next[sample] == values.size()) continue;
        std::size_t sum = 0;
        for (std::size_t& each : next) {
            const std::size_t here = each;
            each = sum;
            sum += here;
        }
        for (const Value& value : values)
            scratch[next[(key(value) >> (d * digit_bits)) & (radix - 1)]++] = value;
        values.swap(scratch);
    }
}

} // namespace world
JOSTLE_NAMESPACE_END
