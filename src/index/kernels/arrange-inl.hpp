// SPDX-License-Identifier: MIT
// Puts a page's objects into small leaves. Plain loops, which compilers vectorise. Except in the first step
// all numbers are integers, so that every instruction set finds the same order. No include guard: kernels.cpp
// includes it once per set.

/// The objects of a page, to be put into leaves.
template <int Dim>
struct Ordering
{
    /// On each axis 0 to 2^30 over the page; the last column has the number of the object.
    alignas(64) std::int32_t column[Dim + 1][page_capacity];

    /// Returns a number that exactly `wanted` of the keys are below, more than none and fewer than all. Keys
    /// are distinct, not negative, and below `end`, except those that pad the last vector.
    static HWY_ATTR std::int32_t bound_above(const std::int32_t* __restrict keys, std::uint32_t count,
                                             std::uint32_t wanted, std::int64_t end)
    {
        // Its place if the keys between the bounds found so far were evenly spread; since they may not be,
        // every other time the middle.
        std::int64_t from = 0, to = end;
        std::uint32_t below_from = 0, below_to = count;
        for (bool halve = false;; halve = !halve) {
            const std::int64_t step =
                halve ? (to - from) / 2 : (to - from) * (wanted - below_from) / (below_to - below_from);
            const auto at =
                static_cast<std::int32_t>(from + std::max(std::int64_t{1}, std::min(step, to - from - 1)));
            const Vec<std::int32_t> bound(at);
            std::uint32_t below = 0;
            for (std::uint32_t k = 0; k < count; k += Vec<std::int32_t>::size)
                below += static_cast<std::uint32_t>(
                    std::popcount(mask_bits(Vec<std::int32_t>::load(keys + k) < bound)));
            if (below == wanted) return at;
            (below < wanted ? from : to) = at;
            (below < wanted ? below_from : below_to) = below;
        }
    }

    /// Moves the objects with keys below `bound` to the front. Both parts keep their order.
    HWY_ATTR void part(std::uint32_t begin, std::uint32_t count, const std::int32_t* keys, std::int32_t bound)
    {
        using Numbers = Vec<std::int32_t>;
        constexpr std::uint32_t size = Numbers::size;
        std::uint16_t lower[page_capacity / size], upper[page_capacity / size];
        for (std::uint32_t k = 0; k < count; k += size) {
            const unsigned here = count - k < size ? (1u << (count - k)) - 1 : (1u << size) - 1;
            const unsigned below = mask_bits(Numbers::load(keys + k) < Numbers(bound)) & here;
            lower[k / size] = static_cast<std::uint16_t>(below);
            upper[k / size] = static_cast<std::uint16_t>(here & ~below);
        }
        for (auto& each : column) {
            // Excess writes go to places that have been read, or will be overwritten.
            std::int32_t* front = each + begin;
            alignas(64) std::int32_t others[page_capacity + size];
            std::int32_t* back = others;
            for (std::uint32_t k = 0; k < count; k += size) {
                const Numbers objects = Numbers::load(each + begin + k);
                compress(objects, lower[k / size]).storeu(front);
                compress(objects, upper[k / size]).storeu(back);
                front += std::popcount(lower[k / size]);
                back += std::popcount(upper[k / size]);
            }
            std::copy(others, back, front);
        }
    }

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
        // 22 bits of the place, and the number of the object, so that keys are distinct.
        const int shift =
            std::max(0, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(widest))) - 22);
        alignas(64) std::int32_t keys[page_capacity];
        const std::int32_t* __restrict along = column[axis] + begin;
        for (std::uint32_t k = 0; k < count; ++k)
            keys[k] = ((along[k] - low_there) >> shift) << 8 | static_cast<std::int32_t>(k);
        const std::uint32_t leaves = (count + lanes - 1) / lanes;
        std::fill(keys + count, keys + leaves * lanes, std::numeric_limits<std::int32_t>::max());
        const std::uint32_t below = leaves / 2 * lanes;
        const std::int64_t above_all = (std::int64_t{widest >> shift} + 1) << 8;
        part(begin, count, keys, bound_above(keys, count, below, above_all));
        run(begin, begin + below);
        run(begin + below, end);
    }
};

template <int Dim, class T>
HWY_ATTR void arrange(const Gathered<Dim, T>& objects, Leaf<Dim, T>* const* leaves, Bounds<Dim, T>& hulls)
{
    Ordering<Dim> ordering;
    const std::uint32_t count = objects.count;
    // Far from the greatest and the least float, so that sums, differences and the scale stay finite.
    constexpr T furthest = T(1e37), least = T(1e-30);
    alignas(64) T center[Dim][page_capacity];
    T low[Dim], extent = 0;
    for (int d = 0; d < Dim; ++d) {
        for (std::uint32_t k = 0; k < count; ++k) {
            const T lo = objects.lo[d][k], hi = objects.hi[d][k];
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

    hulls.clear();
    for (std::uint32_t b = 0; b * lanes < count; ++b) {
        Leaf<Dim, T>& leaf = *leaves[b];
        const std::int32_t* const from = ordering.column[Dim] + b * lanes;
        const std::uint32_t here = std::min(lanes, count - b * lanes);
        for (std::uint32_t k = here; k < lanes; ++k) {
            leaf.bounds.clear(k);
            leaf.id[k] = no_id;
        }
        for (std::uint32_t k = 0; k < here; ++k) {
            for (int d = 0; d < Dim; ++d) {
                leaf.bounds.lo[d][k] = objects.lo[d][from[k]];
                leaf.bounds.hi[d][k] = objects.hi[d][from[k]];
            }
            leaf.id[k] = objects.id[from[k]];
        }
    }
    // Not earlier: numbers written one by one can't be read as a vector until they have reached the cache.
    for (std::uint32_t b = 0; b * lanes < count; ++b) {
        const Leaf<Dim, T>& leaf = *leaves[b];
        for (int d = 0; d < Dim; ++d) {
            Vec<T> lo = Vec<T>::load(leaf.bounds.lo[d]), hi = Vec<T>::load(leaf.bounds.hi[d]);
            for (std::uint32_t k = Vec<T>::size; k < lanes; k += Vec<T>::size) {
                lo = min(lo, Vec<T>::load(leaf.bounds.lo[d] + k));
                hi = max(hi, Vec<T>::load(leaf.bounds.hi[d] + k));
            }
            // Zeros may have either sign; this makes it the same on every instruction set.
            hulls.lo[d][b] = min_lane(lo) + T(0);
            hulls.hi[d][b] = max_lane(hi) + T(0);
        }
    }
}
