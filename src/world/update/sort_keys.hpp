// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "base/radix.hpp"
#include "jostle/pair_buffer.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Sorts by key(value), an unsigned number, ascending; stable if there are many values.
template <class Value, class Key>
void sort_by_key(std::pmr::vector<Value>& values, std::pmr::vector<Value>& scratch, const Key& key)
{
    using Number = decltype(key(values.front()));
    constexpr std::size_t few = 64, many = 8192; // fewer: sort by comparison; more: use longer digits
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
    else {
        scratch.resize(values.size());
        const Value* const result =
            values.size() < many
                ? radix_sort<8>(values.data(), scratch.data(), values.size(), key, differing)
                : radix_sort<11>(values.data(), scratch.data(), values.size(), key, differing);
        if (result == scratch.data()) values.swap(scratch);
    }
}

/// Sorts pairs that are sorted by a, with few of each a, by b as well.
inline void sort_partners(Pair* const begin, const Pair* end)
{
    constexpr std::ptrdiff_t few = 16;
    const auto less = [](const Pair& x, const Pair& y) { return x.b < y.b; };
    for (Pair *first = begin, *last = first; first != end; first = last) {
        while (last != end && last->a == first->a)
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

/// Sorts by (a, b). By a first, as a key of half the length.
inline void sort_pairs(std::pmr::vector<Pair>& pairs, std::pmr::vector<Pair>& scratch)
{
    sort_by_key(pairs, scratch, [](const Pair& pair) { return pair.a; });
    sort_partners(pairs.data(), pairs.data() + pairs.size());
}

} // namespace world
JOSTLE_NAMESPACE_END
