// SPDX-License-Identifier: MIT
// Sorts a few numbers without a branch that depends on them: mispredicted branches are what a short sort
// spends its time on. Included by kernels that are compiled once per instruction set, behind vec-inl.hpp.

/// Sorts at most `most` numbers, no two the same, ascending. The place of a number is how many are smaller;
/// they are counted for two vectors of numbers at once. Beyond some 128 numbers, sorting by digits is faster.
template <std::uint32_t most>
HWY_ATTR void sort_few(std::uint32_t* numbers, std::uint32_t count)
{
#if JOSTLE_SIMD_PLAIN
    std::sort(numbers, numbers + count);
#else
    // The lowest int for 0: some sets compare signed numbers only.
    using Numbers = Vec<std::int32_t>;
    constexpr std::uint32_t at_once = 2 * Numbers::size;
    alignas(64) std::int32_t unsorted[most + at_once];
    alignas(64) std::int32_t place[at_once];
    const std::uint32_t end = (count + at_once - 1) / at_once * at_once;
    for (std::uint32_t k = 0; k < count; ++k)
        unsorted[k] = static_cast<std::int32_t>(numbers[k] ^ 0x80000000u);
    std::fill(unsorted + count, unsorted + end, std::numeric_limits<std::int32_t>::max());
    for (std::uint32_t k = 0; k < count; k += at_once) {
        const Numbers own0 = Numbers::load(unsorted + k), own1 = Numbers::load(unsorted + k + Numbers::size);
        Numbers below0 = Numbers(0), below1 = Numbers(0);
        const Numbers one = Numbers(1);
        for (std::uint32_t other = 0; other < count; ++other) {
            const Numbers each = Numbers(unsorted[other]);
            below0 = choose(each < own0, below0 + one, below0);
            below1 = choose(each < own1, below1 + one, below1);
        }
        below0.store(place);
        below1.store(place + Numbers::size);
        const std::uint32_t here = std::min(at_once, count - k);
        for (std::uint32_t lane = 0; lane < here; ++lane)
            numbers[place[lane]] = static_cast<std::uint32_t>(unsorted[k + lane]) ^ 0x80000000u;
    }
#endif
}
