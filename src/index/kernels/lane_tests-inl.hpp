// SPDX-License-Identifier: MIT
// Tests of 16 boxes at once: which of them touch a region, are inside it, are near, or are hit by a line. The
// result has a bit for each lane. Compiled once per instruction set, see kernels.cpp; intentionally without
// an include guard.
//
// Every test is monotonic in the bounds, rounding included: what holds for a box holds for every box around
// it. So the bounds of a node are tested with the same arithmetic that defines the answer for an object, and
// no tolerance is needed.

/// Lanes that touch a box.
template <int Dim, class T>
HWY_ATTR HWY_INLINE unsigned touching(const Bounds<Dim, T>& bounds, const Aabb<Dim, T>& box)
{
    unsigned bits = 0;
    for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
        auto mask = (Vec<T>::load(bounds.lo[0] + k) <= Vec<T>(box.hi[0])) &
                    (Vec<T>(box.lo[0]) <= Vec<T>::load(bounds.hi[0] + k));
        for (int d = 1; d < Dim; ++d) {
            mask = mask & (Vec<T>::load(bounds.lo[d] + k) <= Vec<T>(box.hi[d]));
            mask = mask & (Vec<T>(box.lo[d]) <= Vec<T>::load(bounds.hi[d] + k));
        }
        bits |= mask_bits(mask) << k;
    }
    return bits;
}

template <int Dim, class T>
struct BoxRegion
{
    const Aabb<Dim, T>& box;
    HWY_ATTR HWY_INLINE unsigned touch(const Bounds<Dim, T>& bounds) const { return touching(bounds, box); }
    /// Lanes whose objects all touch the region.
    HWY_ATTR HWY_INLINE unsigned contain(const Bounds<Dim, T>& bounds) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            auto mask = (Vec<T>(box.lo[0]) <= Vec<T>::load(bounds.lo[0] + k)) &
                        (Vec<T>::load(bounds.hi[0] + k) <= Vec<T>(box.hi[0]));
            for (int d = 1; d < Dim; ++d) {
                mask = mask & (Vec<T>(box.lo[d]) <= Vec<T>::load(bounds.lo[d] + k));
                mask = mask & (Vec<T>::load(bounds.hi[d] + k) <= Vec<T>(box.hi[d]));
            }
            bits |= mask_bits(mask) << k;
        }
        return bits;
    }
};

/// The squared distances of `Vec::size` lanes from a box, or from a point as a box.
template <int Dim, class T>
HWY_ATTR HWY_INLINE Vec<T> distances(const Bounds<Dim, T>& bounds, const T* lo, const T* hi, std::uint32_t k)
{
    Vec<T> sum = Vec<T>(0);
    for (int d = 0; d < Dim; ++d) {
        const Vec<T> gap = max(max(Vec<T>::load(bounds.lo[d] + k) - Vec<T>(hi[d]),
                                   Vec<T>(lo[d]) - Vec<T>::load(bounds.hi[d] + k)),
                               Vec<T>(0));
        sum = sum + gap * gap;
    }
    return sum;
}

/// Lanes no further from a box than the root of `limit`; stores their squared distances, infinity for the
/// others.
template <int Dim, class T>
HWY_ATTR HWY_INLINE unsigned within(const Bounds<Dim, T>& bounds, const Aabb<Dim, T>& from, T limit, T* far)
{
    unsigned bits = 0;
    for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
        const Vec<T> each = distances<Dim, T>(bounds, from.lo.data(), from.hi.data(), k);
        const auto reached = each <= Vec<T>(limit);
        choose(reached, each, Vec<T>(std::numeric_limits<T>::infinity())).store(far + k);
        bits |= mask_bits(reached) << k;
    }
    return bits;
}

template <int Dim, class T>
struct SphereRegion
{
    const T* center;
    T limit; // radius squared
    HWY_ATTR HWY_INLINE unsigned touch(const Bounds<Dim, T>& bounds) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size)
            bits |= mask_bits(distances<Dim, T>(bounds, center, center, k) <= Vec<T>(limit)) << k;
        return bits;
    }
    HWY_ATTR HWY_INLINE unsigned contain(const Bounds<Dim, T>& bounds) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            Vec<T> sum = Vec<T>(0);
            for (int d = 0; d < Dim; ++d) {
                const Vec<T> p = Vec<T>(center[d]);
                const Vec<T> gap =
                    max(p - Vec<T>::load(bounds.lo[d] + k), Vec<T>::load(bounds.hi[d] + k) - p);
                sum = sum + gap * gap;
            }
            bits |= mask_bits(sum <= Vec<T>(limit)) << k;
        }
        return bits;
    }
};

template <int Dim, class T>
struct FrustumRegion
{
    const Plane<Dim, T>* planes;
    std::size_t count;
    /// Lanes with the corner furthest along (or, for `nearest`, against) each normal inside its plane.
    template <bool nearest>
    HWY_ATTR HWY_INLINE unsigned corners(const Bounds<Dim, T>& bounds) const
    {
        unsigned all = 0xffff;
        for (std::size_t i = 0; i < count && all != 0; ++i) {
            const Plane<Dim, T>& plane = planes[i];
            unsigned bits = 0;
            for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
                Vec<T> sum = Vec<T>(0);
                for (int d = 0; d < Dim; ++d) {
                    const T n = plane.normal[d];
                    if (n == 0) continue;
                    const T* corner = (n > 0) == nearest ? bounds.lo[d] : bounds.hi[d];
                    sum = sum + Vec<T>(n) * Vec<T>::load(corner + k);
                }
                bits |= mask_bits(Vec<T>(0) <= sum + Vec<T>(plane.offset)) << k;
            }
            all &= bits;
        }
        return all;
    }
    HWY_ATTR HWY_INLINE unsigned touch(const Bounds<Dim, T>& bounds) const { return corners<false>(bounds); }
    HWY_ATTR HWY_INLINE unsigned contain(const Bounds<Dim, T>& bounds) const { return corners<true>(bounds); }
};

/// Which bounds a line meets first on each axis, and which last.
template <int Dim, class T>
struct LineTest
{
    std::size_t first[Dim], last[Dim]; // where in Bounds they are, in bytes
    T own_first[Dim], own_last[Dim];   // the bounds of the line's box that meet and leave those
    T inverse[Dim];
    T max_fraction;

    HWY_ATTR HWY_INLINE explicit LineTest(const Line<Dim, T>& line) : max_fraction(line.max_fraction)
    {
        using Lanes = Bounds<Dim, T>;
        for (std::size_t d = 0; d < Dim; ++d) {
            const bool back = line.inverse[d] < 0;
            const std::size_t lo = offsetof(Lanes, lo) + d * sizeof(Lanes::lo[0]);
            const std::size_t hi = offsetof(Lanes, hi) + d * sizeof(Lanes::hi[0]);
            own_first[d] = back ? line.lo[d] : line.hi[d];
            own_last[d] = back ? line.hi[d] : line.lo[d];
            first[d] = back ? hi : lo;
            last[d] = back ? lo : hi;
            inverse[d] = line.inverse[d];
        }
    }
    /// Lanes met no later than `end`; stores the fractions, infinity for the others.
    HWY_ATTR HWY_INLINE unsigned meet(const Bounds<Dim, T>& bounds, T end, T* at) const
    {
        const auto load = [&](std::size_t place, std::uint32_t k) HWY_ATTR {
            const std::byte* const from = reinterpret_cast<const std::byte*>(&bounds) + place;
            return Vec<T>::load(reinterpret_cast<const T*>(from) + k);
        };
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            Vec<T> enter = Vec<T>(0), leave = Vec<T>(end);
            Vec<T> beside = Vec<T>(0); // never above 0 if an axis without motion overlaps
            for (int d = 0; d < Dim; ++d) {
                const Vec<T> to_first = load(first[d], k) - Vec<T>(own_first[d]);
                const Vec<T> to_last = load(last[d], k) - Vec<T>(own_last[d]);
                if (inverse[d] != 0) [[likely]] {
                    enter = max(to_first * Vec<T>(inverse[d]), enter);
                    leave = min(to_last * Vec<T>(inverse[d]), leave);
                } else {
                    // Differences of finite numbers are 0 only for equal ones: no rounding decides.
                    beside = max(beside, max(to_first, Vec<T>(0) - to_last));
                }
            }
            const auto met = (enter <= leave) & (beside <= Vec<T>(0));
            choose(met, enter, Vec<T>(std::numeric_limits<T>::infinity())).store(at + k);
            bits |= mask_bits(met) << k;
        }
        return bits;
    }
};
