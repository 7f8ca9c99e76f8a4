// SPDX-License-Identifier: MIT
// Puts a page's objects in an order in which leaves are small. Plain loops, which compilers vectorise. Except
// in the first step all numbers are integers, so that every instruction set finds the same order. No include
// guard: kernels.cpp includes it once per set, behind sort_few-inl.hpp.

/// The objects of a page on their way into leaves.
template <int Dim>
struct Ordering
{
    /// 0 to 2^30 over the page, and at last which object it is.
    alignas(64) std::int32_t column[Dim + 1][page_capacity];

    /// Splits [begin, end) so that neighbours come together in whole leaves.
    HWY_ATTR void run(std::uint32_t begin, std::uint32_t end)
    {
        const std::uint32_t count = end - begin;
        if (count <= lanes) return;
        int axis = 0;
        std::int32_t low_there = 0, widest = -1;
        for (int d = 0; d < Dim; ++d) {
            const std::int32_t* __restrict center = column[d] + begin;
            std::int32_t low = center[0], high = low;
            for (std::uint32_t k = 0; k < count; ++k) {
                low = center[k] < low ? center[k] : low;
                high = center[k] > high ? center[k] : high;
            }
            if (high - low <= widest) continue;
            widest = high - low;
            low_there = low;
            axis = d;
        }
        // 24 bits of the place, and where to find the object.
        const int shift =
            std::max(0, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(widest))) - 24);
        alignas(64) std::uint32_t keys[page_capacity];
        alignas(64) std::int32_t sorted[page_capacity];
        const std::int32_t* __restrict along = column[axis] + begin;
        for (std::uint32_t k = 0; k < count; ++k)
            keys[k] = static_cast<std::uint32_t>((along[k] - low_there) >> shift) << 8 | k;
        sort_few<few>(keys, count);
        for (std::uint32_t k = 0; k < count; ++k)
            keys[k] &= 0xff;
        for (auto& each : column) {
            std::int32_t* __restrict here = each + begin;
            for (std::uint32_t k = 0; k < count; ++k)
                sorted[k] = here[keys[k]];
            for (std::uint32_t k = 0; k < count; ++k)
                here[k] = sorted[k];
        }
        const std::uint32_t leaves = (count + lanes - 1) / lanes;
        const std::uint32_t middle = begin + leaves / 2 * lanes;
        run(begin, middle);
        run(middle, end);
    }
};

template <int Dim, class T>
HWY_ATTR void order_objects(const Record<Dim, T>* records, std::uint32_t count, std::uint8_t* order)
{
    Ordering<Dim> ordering;
    // Far from the greatest and the least float, so that sums, differences and the scale stay finite.
    constexpr T furthest = T(1e37), least = T(1e-30);
    alignas(64) T center[Dim][page_capacity];
    T low[Dim], extent = 0;
    for (int d = 0; d < Dim; ++d) {
        for (std::uint32_t k = 0; k < count; ++k) {
            const T lo = records[k].box.lo[d], hi = records[k].box.hi[d];
            center[d][k] = (lo < -furthest  ? -furthest
                            : lo > furthest ? furthest
                                            : lo) +
                           (hi < -furthest  ? -furthest
                            : hi > furthest ? furthest
                                            : hi);
        }
        const std::uint32_t end = (count + lanes - 1) / lanes * lanes;
        std::fill(center[d] + count, center[d] + end, center[d][0]);
        Vec<T> first = Vec<T>::load(center[d]), last = first;
        for (std::uint32_t k = Vec<T>::size; k < end; k += Vec<T>::size) {
            first = min(first, Vec<T>::load(center[d] + k));
            last = max(last, Vec<T>::load(center[d] + k));
        }
        low[d] = min_lane(first);
        extent = std::max(extent, max_lane(last) - low[d]);
    }
    const T scale = extent > least ? T(1 << 30) / extent : T(0);
    for (int d = 0; d < Dim; ++d)
        for (std::uint32_t k = 0; k < count; ++k)
            ordering.column[d][k] = static_cast<std::int32_t>((center[d][k] - low[d]) * scale);
    for (std::uint32_t k = 0; k < count; ++k)
        ordering.column[Dim][k] = static_cast<std::int32_t>(k);
    ordering.run(0, count);
    for (std::uint32_t k = 0; k < count; ++k)
        order[k] = static_cast<std::uint8_t>(ordering.column[Dim][k]);
}
