// SPDX-License-Identifier: MIT
// The first digits of many boxes' keys. Plain loops, which compilers vectorise. No include guard: kernels.cpp
// includes it once per set.

template <int Dim, class T>
HWY_ATTR bool make_entries(const Frame<Dim>& frame, const BoxView<Dim, T>& boxes, std::size_t first,
                           std::size_t last, KeyEntry* entries)
{
    constexpr int expected = 43; // digits of an axis
    static_assert(std::uint64_t{1} << (expected - 1) == static_cast<std::uint64_t>(Frame<Dim>::world_quanta));
    constexpr double end = 2 * Frame<Dim>::world_quanta;
    constexpr double to_cell = 1 / static_cast<double>(std::uint64_t{1} << (expected - entry_digits<Dim>));
    constexpr std::size_t at_once = 128;
    alignas(64) T lower[at_once], upper[at_once];
    alignas(64) double size[at_once], place[at_once];
    alignas(64) std::uint32_t digits[at_once];
    for (std::size_t begin = first; begin < last; begin += at_once) {
        const std::size_t count = std::min(at_once, last - begin);
        std::fill_n(size, count, 0.0);
        std::fill_n(digits, count, 0u);
        for (int d = 0; d < Dim; ++d) {
            for (std::size_t k = 0; k < count; ++k) {
                lower[k] = boxes.lo(d, begin + k);
                upper[k] = boxes.hi(d, begin + k);
            }
            // As in key_of. What it clamps is out of range anyway, or as wide as the greatest class.
            for (std::size_t k = 0; k < count; ++k) {
                const auto lo = static_cast<double>(lower[k]), hi = static_cast<double>(upper[k]);
                size[k] = size[k] > hi - lo ? size[k] : hi - lo;
                place[k] = place_of(frame, d, lo, hi);
            }
            int inside = 1;
            for (std::size_t k = 0; k < count; ++k)
                inside &= static_cast<int>(place[k] >= 0) & static_cast<int>(place[k] < end);
            if (inside == 0) return false;
            for (std::size_t k = 0; k < count; ++k) {
                const auto cell = static_cast<std::int32_t>(place[k] * to_cell);
                digits[k] |= spread<Dim>(static_cast<std::uint32_t>(cell)) << (Dim - 1 - d);
            }
        }
        for (std::size_t k = 0; k < count; ++k)
            entries[begin + k] = {digits[k], static_cast<std::uint32_t>(begin + k)};
        for (std::size_t k = 0; k < count; ++k)
            if (size[k] > frame.common_size)
                entries[begin + k].digits |= class_of(frame, size[k]) << entry_class_shift;
    }
    return true;
}
