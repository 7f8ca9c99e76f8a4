// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "jostle/version.hpp"

// Sorting by counting. A counting sort has three steps: count how many values there are of each kind, turn
// the counts into where each kind begins, and write each value to the next place of its kind. Rooms that have
// the values in chunks or in several threads' hands do the first and the last step themselves.

JOSTLE_NAMESPACE_BEGIN

/// Turns how many there are of each kind into where each kind begins, if the first begins at `sum`. Returns
/// where the last one ends.
template <class Count>
Count exclusive_sum(Count* counts, std::size_t kinds, Count sum = 0) noexcept
{
    for (std::size_t kind = 0; kind < kinds; ++kind)
        sum += std::exchange(counts[kind], sum);
    return sum;
}

/// The same for values that come in parts; `counts` holds a row of kinds for each part. Values of one kind
/// will be in the order of the parts.
template <class Count>
Count exclusive_sum_of_parts(Count* counts, std::size_t parts, std::size_t kinds, Count sum = 0) noexcept
{
    for (std::size_t kind = 0; kind < kinds; ++kind)
        for (std::size_t part = 0; part < parts; ++part)
            sum += std::exchange(counts[part * kinds + kind], sum);
    return sum;
}

/// Sorts by the unsigned number key(value), ascending; values with equal keys keep their order. One pass for
/// each digit of `digit_bits` bits or fewer, least significant first. `differing` has the bits in which keys
/// differ, and may have more. Bits that aren't set in it cost nothing.
///
/// `spare` has room for as many values. Returns where the result is: in `values` or in `spare`.
/// `together` is the number of passes that are counted before the first value moves, two in each reading.
/// More help if the values are in the cache; each takes counters on the stack.
template <int digit_bits, int together = 1, class Value, class Key, class Number, class Count>
Value* radix_sort(Value* values, Value* spare, Count count, const Key& key, Number differing,
                  int digit = digit_bits)
{
    const Number mask = (Number{1} << digit) - 1;
    while (differing != 0) {
        Count next[together][std::size_t{1} << digit_bits];
        int shift[together], passes = 0;
        for (; passes < together && differing != 0; ++passes) {
            shift[passes] = std::countr_zero(differing);
            differing &= static_cast<Number>(~(mask << shift[passes]));
            std::fill_n(next[passes], mask + 1, Count{0});
        }
        int pass = 0;
        for (; pass + 1 < passes; pass += 2) { // two digits in one reading
            Count* const first = next[pass];
            Count* const second = next[pass + 1];
            const int from = shift[pass], after = shift[pass + 1];
            for (Count k = 0; k < count; ++k) {
                const Number number = key(values[k]);
                ++first[(number >> from) & mask];
                ++second[(number >> after) & mask];
            }
        }
        if (pass < passes)
            for (Count k = 0; k < count; ++k)
                ++next[pass][(key(values[k]) >> shift[pass]) & mask];
        for (pass = 0; pass < passes; ++pass) {
            Count* const place = next[pass];
            const int from = shift[pass];
            exclusive_sum(place, static_cast<std::size_t>(mask) + 1);
            for (Count k = 0; k < count; ++k)
                spare[place[(key(values[k]) >> from) & mask]++] = values[k];
            std::swap(values, spare);
        }
    }
    return values;
}

JOSTLE_NAMESPACE_END
