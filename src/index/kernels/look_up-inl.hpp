// SPDX-License-Identifier: MIT
// Finds which of the resting neighbours listed for a moving object it touches now. Compiled once per
// instruction set, see kernels.cpp; listing.hpp describes listings.

/// Which objects of a lookup's listing are touched, or, if measures are equal, perhaps touched.
struct Touched
{
    unsigned perhaps, surely;
};
template <int Dim>
HWY_ATTR HWY_INLINE Touched touched_of(const Listing<Dim>& listing, const Lookup<Dim>& lookup)
{
    using Measures = Vec<std::int16_t>;
    unsigned beside = 0, surely = 0;
    for (std::uint32_t k = 0; k < lanes; k += Measures::size) {
        auto apart = Measures(lookup.hi[0]) < Measures::load(listing.lo[0] + k);
        auto across = Measures::load(listing.lo[0] + k) < Measures(lookup.hi[0]);
        for (int d = 0; d < Dim; ++d) {
            const Measures from = Measures::load(listing.lo[d] + k), to = Measures::load(listing.hi[d] + k);
            const Measures own_from = Measures(lookup.lo[d]), own_to = Measures(lookup.hi[d]);
            apart = apart | ((own_to < from) | (to < own_from));
            across = across & ((from < own_to) & (own_from < to));
        }
        beside |= mask_bits(apart) << k;
        surely |= mask_bits(across) << k;
    }
    return {~beside & 0xffffu, surely};
}

template <int Dim>
HWY_ATTR std::size_t look_up(const Lookup<Dim>* lookups, std::size_t count,
                             FunctionRef<bool(std::uint32_t asker, std::uint32_t id)> decide, Pair* out)
{
    constexpr std::size_t ahead = 8;
    Pair* next = out;
    for (std::size_t i = 0; i < count; ++i) {
        const Lookup<Dim>& coming = lookups[std::min(i + ahead, count - 1)];
        for (std::uint32_t k = 0; k < coming.count; ++k)
            prefetch_item(coming.listings + k);
        const Lookup<Dim>& lookup = lookups[i];
        for (std::uint32_t k = 0; k < lookup.count; ++k) {
            const Listing<Dim>& listing = lookup.listings[k];
            const Touched touched = touched_of(listing, lookup);
            unsigned hits = touched.perhaps;
            for (unsigned doubts = hits & ~touched.surely; doubts != 0; doubts &= doubts - 1) {
                const int lane = std::countr_zero(doubts);
                if (!decide(lookup.asker, listing.id[lane])) hits &= ~(1u << lane);
            }
#if !JOSTLE_SIMD_PLAIN && HWY_TARGET == HWY_AVX3
            store_pairs(next, lookup.asker, listing.id, hits);
#else
            each_lane(hits, [&](unsigned n, unsigned lane) { next[n] = {lookup.asker, listing.id[lane]}; });
#endif
            next += std::popcount(hits);
        }
    }
    return static_cast<std::size_t>(next - out);
}
