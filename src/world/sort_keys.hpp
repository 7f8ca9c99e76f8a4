// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "jostle/pair_buffer.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// By digits of the key, least significant first, but for those that are the same in all values.
template <int digit_bits, class Value, class Key, class Number>
void sort_by_digits(std::pmr::vector<Value>& values, std::pmr::vector<Value>& scratch, const Key& key,
                    Number differing)
{
    constexpr std::size_t radix = std::size_t{1} << digit_bits;
    scratch.resize(values.size());
    for (int shift = 0; shift < 8 * static_cast<int>(sizeof(Number)); shift += digit_bits) {
        if (((differing >> shift) & (radix - 1)) == 0) continue;
        std::array<std::size_t, radix> next{};
        for (const Value& value : values)
            ++next[(key(value) >> shift) & (radix - 1)];
        std::size_t sum = 0;
        for (std::size_t& each : next) {
            const std::size_t here = each;
            each = sum;
            sum += here;
        }
        for (const Value& value : values)
            scratch[next[(key(value) >> shift) & (radix - 1)]++] = value;
        values.swap(scratch);
    }
}

/// Sorts by key(value), an unsigned number, ascending; equal keys stay as they are ordered if there are many.
template <class Value, class Key>
void sort_by_key(std::pmr::vector<Value>& values, std::pmr::vector<Value>& scratch, const Key& key)
{
    using Number = decltype(key(values.front()));
    constexpr std::size_t few = 64, many = 8192; // fewer are better compared; more are worth longer digits
    Number differing = 0;
    bool sorted = true;
    for (std::size_t i = 1; i < values.size(); ++i) {
        const Number before = key(values[i - 1]), here = key(values[i]);
        differing |= before ^ here;
        sorted &= before <= here;
    }
    if (sorted) return;
    if (values.size() < few)
        std::sort(values.begin(), values.end(),
                  [&](const Value& x, const Value& y) { return key(x) < key(y); });
    else if (values.size() < many)
        sort_by_digits<8>(values, scratch, key, differing);
    else
        sort_by_digits<11>(values, scratch, key, differing);
}

/// Ascending by (a, b). By a first, as by a key half as long; the few with the same a, by b.
inline void sort_pairs(std::pmr::vector<Pair>& pairs, std::pmr::vector<Pair>& scratch)
{
    sort_by_key(pairs, scratch, [](const Pair& pair) { return pair.a; });
    constexpr std::ptrdiff_t few = 16;
    const auto less = [](const Pair& x, const Pair& y) { return x.b < y.b; };
    for (auto first = pairs.begin(), last = first; first != pairs.end(); first = last) {
        while (last != pairs.end() && last->a == first->a)
            ++last;
        if (last - first > few) {
            std::sort(first, last, less);
            continue;
        }
        for (auto each = first + 1; each < last; ++each)
            for (auto to = each; to != first && less(*to, *(to - 1)); --to)
                std::swap(*to, *(to - 1));
    }
}

} // namespace world
JOSTLE_NAMESPACE_END
