// SPDX-License-Identifier: MIT
#include "index/order.hpp"

#include <algorithm>
#include <bit>

JOSTLE_NAMESPACE_BEGIN
namespace index {

namespace {

/// The objects of a page on their way into leaves.
template <int Dim>
struct Ordering
{
    std::int32_t center[Dim][page_capacity]; // 0 to 2^30 over the page
    std::uint8_t order[page_capacity];
    void (*sort_few)(std::uint32_t* numbers, std::uint32_t count);

    /// Splits [begin, end) so that neighbours come together in whole leaves.
    void run(std::uint32_t begin, std::uint32_t end) noexcept
    {
        const std::uint32_t count = end - begin;
        if (count <= lanes) return;
        int axis = 0;
        std::int32_t low_there = 0, widest = -1;
        for (int d = 0; d < Dim; ++d) {
            std::int32_t low = center[d][begin], high = low;
            for (std::uint32_t k = begin; k < end; ++k) {
                low = std::min(low, center[d][k]);
                high = std::max(high, center[d][k]);
            }
            if (high - low <= widest) continue;
            widest = high - low;
            low_there = low;
            axis = d;
        }
        // 24 bits of the place, and where to find the object.
        const int shift =
            std::max(0, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(widest))) - 24);
        std::uint32_t keys[page_capacity];
        for (std::uint32_t k = 0; k < count; ++k)
            keys[k] = static_cast<std::uint32_t>((center[axis][begin + k] - low_there) >> shift) << 8 | k;
        sort_few(keys, count);
        std::int32_t sorted[page_capacity];
        for (int d = 0; d < Dim; ++d) {
            for (std::uint32_t k = 0; k < count; ++k)
                sorted[k] = center[d][begin + (keys[k] & 0xff)];
            std::copy_n(sorted, count, center[d] + begin);
        }
        for (std::uint32_t k = 0; k < count; ++k)
            sorted[k] = order[begin + (keys[k] & 0xff)];
        for (std::uint32_t k = 0; k < count; ++k)
            order[begin + k] = static_cast<std::uint8_t>(sorted[k]);
        const std::uint32_t leaves = (count + lanes - 1) / lanes;
        const std::uint32_t middle = begin + leaves / 2 * lanes;
        run(begin, middle);
        run(middle, end);
    }
};

} // namespace

template <int Dim, class T>
void order_objects(const Record<Dim, T>* records, std::uint32_t count,
                   void (*sort_few)(std::uint32_t* numbers, std::uint32_t count),
                   std::uint8_t* order) noexcept
{
    Ordering<Dim> ordering;
    ordering.sort_few = sort_few;
    // Far from the greatest and the least float, so that sums, differences and the scale stay finite.
    constexpr T furthest = T(1e37), least = T(1e-30);
    T center[Dim][page_capacity], low[Dim], extent = 0;
    for (int d = 0; d < Dim; ++d) {
        for (std::uint32_t k = 0; k < count; ++k)
            center[d][k] = std::max(-furthest, std::min(records[k].box.lo[d], furthest)) +
                           std::max(-furthest, std::min(records[k].box.hi[d], furthest));
        const auto [first, last] = std::minmax_element(center[d], center[d] + count);
        low[d] = *first;
        extent = std::max(extent, *last - *first);
    }
    const T scale = extent > least ? T(1 << 30) / extent : T(0);
    for (std::uint32_t k = 0; k < count; ++k) {
        ordering.order[k] = static_cast<std::uint8_t>(k);
        for (int d = 0; d < Dim; ++d)
            ordering.center[d][k] = static_cast<std::int32_t>((center[d][k] - low[d]) * scale);
    }
    ordering.run(0, count);
    std::copy_n(ordering.order, count, order);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void order_objects(const Record<Dim, T>*, std::uint32_t,                                        \
                                void (*)(std::uint32_t*, std::uint32_t), std::uint8_t*) noexcept;
JOSTLE_INSTANTIATE(2, float)
JOSTLE_INSTANTIATE(2, double)
JOSTLE_INSTANTIATE(3, float)
JOSTLE_INSTANTIATE(3, double)
#undef JOSTLE_INSTANTIATE

} // namespace index
JOSTLE_NAMESPACE_END
