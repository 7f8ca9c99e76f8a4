// SPDX-License-Identifier: MIT
// Distances of many points at once, and the numbers of those that are near, side by side, without a branch
// that depends on them. No include guard: neighbors.cpp includes it once per set.

/// Points are looked at as many at once as a register holds of their numbers in 32 bits: one vector of
/// coordinates, or two where these have 64 bits.
using NeighborNumbers = Vec<std::uint32_t>;
template <class T>
inline constexpr std::uint32_t vectors_at_once = NeighborNumbers::size / Vec<T>::size;
static_assert(NeighborNumbers::size <= neighbor_padding);

/// The numbers from `first` on.
HWY_ATTR inline NeighborNumbers numbers_from(std::size_t first)
{
    return NeighborNumbers(static_cast<std::uint32_t>(first)) + NeighborNumbers::lane_numbers();
}

template <int Dim, class T>
HWY_ATTR std::size_t select(const T* const (&axes)[3], std::size_t begin, std::size_t end,
                            const jostle::Vec<Dim, T>& by, const Extent<Dim, T>& box, T near,
                            std::uint32_t* selected)
{
    const Vec<T> zero = Vec<T>(T(0)), most = Vec<T>(near);
    std::size_t count = 0;
    for (std::size_t k = begin; k < end; k += NeighborNumbers::size) {
        unsigned close = 0;
        for (std::uint32_t part = 0; part < vectors_at_once<T>; ++part) {
            Vec<T> square = zero;
            for (int d = 0; d < Dim; ++d) {
                const Vec<T> at = Vec<T>::loadu(axes[d] + k + part * Vec<T>::size) + Vec<T>(by[d]);
                const Vec<T> below = Vec<T>(box.lo[d]) - at, above = at - Vec<T>(box.hi[d]);
                const Vec<T> gap = max(max(below, above), zero);
                square = d == 0 ? gap * gap : square + gap * gap;
            }
            close |= mask_bits(square <= most) << (part * Vec<T>::size);
        }
        if (end - k < NeighborNumbers::size) close &= (1u << (end - k)) - 1;
        compress(numbers_from(k), close).storeu(selected + count);
        count += static_cast<std::size_t>(std::popcount(close));
    }
    return count;
}

template <bool with_images, bool with_radii, int Dim, class T>
HWY_ATTR void find_in_columns(const NearbyColumns<T>& columns, std::size_t first,
                              const jostle::Vec<Dim, T>& here, const RowCutoff<T>& cutoff, RowFound& row)
{
    constexpr T some = 16 * std::numeric_limits<T>::epsilon();
    const Vec<T> radius = Vec<T>(cutoff.radius), slack = Vec<T>(cutoff.slack), more = Vec<T>(cutoff.more);
    Vec<T> most = Vec<T>(cutoff.near), surely = Vec<T>(cutoff.sure);
    std::size_t count = 0;
    for (std::size_t k = first; k < columns.count; k += NeighborNumbers::size) {
        unsigned close = 0, decided = 0;
        for (std::uint32_t part = 0; part < vectors_at_once<T>; ++part) {
            Vec<T> square;
            for (int d = 0; d < Dim; ++d) {
                const Vec<T> apart = Vec<T>::loadu(columns.at[d] + k + part * Vec<T>::size) - Vec<T>(here[d]);
                square = d == 0 ? apart * apart : square + apart * apart;
            }
            if constexpr (with_radii) {
                const Vec<T> other = Vec<T>::loadu(columns.radius + k + part * Vec<T>::size);
                const Vec<T> within = (cutoff.greater ? max(radius, other) : radius + other) + more;
                const Vec<T> outer = (within + slack) * Vec<T>(1 + some),
                             inner = (within - slack) * Vec<T>(1 - some);
                most = outer * outer;
                surely = inner * abs(inner); // nothing is below 0
            }
            close |= mask_bits(square <= most) << (part * Vec<T>::size);
            decided |= mask_bits(square <= surely) << (part * Vec<T>::size);
        }
        if constexpr (with_radii) decided = cutoff.any_sure ? decided : 0;
        compress(NeighborNumbers::loadu(columns.index + k), close).storeu(row.index + count);
        if constexpr (with_images)
            compress(NeighborNumbers::loadu(columns.image + k), close).storeu(row.image + count);
        for (unsigned unsure = close & ~decided; unsure != 0; unsure &= unsure - 1) { // hardly ever
            const auto before = static_cast<unsigned>(std::popcount(close & ((unsure & (~unsure + 1)) - 1)));
            row.unsure[row.unsure_count++] = {static_cast<std::uint32_t>(count) + before,
                                              static_cast<std::uint32_t>(k) +
                                                  static_cast<unsigned>(std::countr_zero(unsure))};
        }
        count += static_cast<std::size_t>(std::popcount(close));
    }
    row.count = count;
}

template <int Dim, class T>
HWY_ATTR void find_row(const NearbyColumns<T>& columns, std::size_t first, const jostle::Vec<Dim, T>& here,
                       const RowCutoff<T>& cutoff, RowFound& row)
{
    row.unsure_count = 0;
    const bool images = columns.image != nullptr, radii = columns.radius != nullptr;
    (images  ? radii ? find_in_columns<true, true, Dim, T> : find_in_columns<true, false, Dim, T>
      : radii ? find_in_columns<false, true, Dim, T>
             : find_in_columns<false, false, Dim, T>)(columns, first, here, cutoff, row);
}

template <class T>
HWY_ATTR std::size_t tell_apart(const T* distances, std::size_t count, T sure, T near, std::uint32_t* chosen,
                                std::uint32_t* unsure)
{
    std::fill_n(chosen, count / 32 + 1, 0u);
    std::size_t unsure_count = 0;
    for (std::size_t k = 0; k < count; k += NeighborNumbers::size) {
        unsigned close = 0, decided = 0;
        for (std::uint32_t part = 0; part < vectors_at_once<T>; ++part) {
            const Vec<T> distance = Vec<T>::loadu(distances + k + part * Vec<T>::size);
            close |= mask_bits(distance <= Vec<T>(near)) << (part * Vec<T>::size);
            decided |= mask_bits(distance <= Vec<T>(sure)) << (part * Vec<T>::size);
        }
        if (count - k < NeighborNumbers::size) close &= (1u << (count - k)) - 1;
        chosen[k / 32] |= close << k % 32;
        compress(numbers_from(k), close & ~decided).storeu(unsure + unsure_count);
        unsure_count += static_cast<std::size_t>(std::popcount(close & ~decided));
    }
    return unsure_count;
}

HWY_ATTR inline std::size_t take_chosen(const std::uint32_t* neighbors, std::size_t count,
                                        const std::uint32_t* chosen, std::uint32_t* index,
                                        std::uint32_t* places)
{
    std::size_t taken = 0;
    for (std::size_t k = 0; k < count; k += NeighborNumbers::size) {
        const unsigned bits = chosen[k / 32] >> k % 32 & ((1u << NeighborNumbers::size) - 1);
        compress(NeighborNumbers::loadu(neighbors + k), bits).storeu(index + taken);
        if (places != nullptr) compress(numbers_from(k), bits).storeu(places + taken);
        taken += static_cast<std::size_t>(std::popcount(bits));
    }
    return taken;
}
