// SPDX-License-Identifier: MIT
#include "engine/apart.hpp"

#include <algorithm>
#include <bit>

JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {

/// The cost of visiting a row, in candidates that could be tested in the same time.
constexpr std::uint64_t candidates_per_row = 64;

} // namespace

bool Apart::make(const Record* records, const std::uint32_t* window_end, std::uint32_t count,
                 const Kernels& kernels, Slot& slot)
{
    std::uint32_t* const before = slot.before.reserve(std::size_t{count} + 1);
    std::uint32_t of_b = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        before[i] = of_b;
        of_b += records[i].object >> 31; // side_b
    }
    before[count] = of_b;
    std::uint64_t together = 0, apart = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t end = std::max(window_end[i], i + 1), window = end - (i + 1);
        const std::uint32_t window_b = before[end] - before[i + 1];
        together += window;
        apart += before[i] == before[i + 1] ? window_b : window - window_b;
    }
    if (2 * (apart + candidates_per_row * count) > together) return false;

    count_ = count;
    candidates_ = apart;
    window_end_ = window_end;
    records_ = records;
    before_ = before;
    begin_b_ = padded(count - of_b);
    columns_.count = begin_b_ + of_b;
    columns_.window_end = nullptr;
    const std::uint32_t size = padded(columns_.count);
    Record* const sorted = slot.apart.reserve(size);
    std::uint32_t* const place = slot.apart_place.reserve(size);
    std::fill(sorted + (count - of_b), sorted + begin_b_, padding_record);
    std::fill(sorted + columns_.count, sorted + size, padding_record);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t to = before[i] == before[i + 1] ? i - before[i] : begin_b_ + before[i];
        sorted[to] = records[i];
        place[to] = i;
    }
    place_ = place;
    columns_.columns = slot.columns.reserve(std::size_t{size} * columns_per_record);
    kernels.arrange(sorted, columns_);
    return true;
}

template <int Dim>
std::uint64_t Apart::sweep(const Kernels& kernels, std::uint32_t first, std::uint32_t last, Slot& mine,
                           PairOutput& out) const
{
    const auto test = kernels.template test<Dim>();
    std::uint64_t steps = 0; // of one row
    for (std::uint32_t i = first; i < last; i += 2) {
        const std::uint32_t end = std::max(window_end_[i], window_end_[i + 1]);
        std::uint32_t found[3] = {0, 0, 0}; // where the hits of each row of the couple begin, and the end
        for (std::uint32_t row = 0; row < 2; ++row) {
            found[row + 1] = found[row];
            const std::uint32_t own = i + row;
            if (own + 1 >= end) continue; // also the padding that makes rows even
            const bool in_b = before_[own] != before_[own + 1];
            // The other set's records after the row, up to the end of the window.
            const std::uint32_t begin = in_b ? own + 1 - before_[own + 1] : begin_b_ + before_[own + 1];
            const std::uint32_t stop = in_b ? end - before_[end] : begin_b_ + before_[end];
            if (begin == stop) continue;
            const std::uint32_t aligned = begin & ~3u, here = (stop - aligned + step_size - 1) / step_size;
            steps += here;
            Outcome* const outcomes = mine.outcomes.reserve(here);
            test(columns_, in_b ? begin_b_ + before_[own] : own - before_[own], aligned, stop, outcomes);
            ApartHit* const hits =
                mine.hits.grow(std::size_t{found[row]} + std::size_t{here} * step_size, found[row]);
            std::uint32_t next = found[row];
            unsigned behind = 0xffffu << (begin - aligned) & 0xffff;
            for (std::uint32_t k = 0; k < here; ++k, behind = 0xffff) {
                const std::uint32_t base = aligned + k * step_size;
                for (unsigned left = (outcomes[k].sure | outcomes[k].ties) & behind; left != 0;
                     left &= left - 1) {
                    const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
                    const std::uint32_t place = place_[base + lane];
                    hits[next++] = {place, records_[place].object & object_mask,
                                    (outcomes[k].ties >> lane & 1) != 0};
                }
            }
            found[row + 1] = next;
        }
        if (found[2] == 0) continue;

        // Both rows' hits, step by step of the records.
        const ApartHit* const hits = mine.hits.data();
        const std::uint32_t object[2] = {records_[i].object & object_mask,
                                         i + 1 < count_ ? records_[i + 1].object & object_mask : 0};
        const std::uint32_t from = (i + 1) & ~3u;
        const auto step_of = [&](std::uint32_t hit) { return (hits[hit].place - from) / step_size; };
        std::uint32_t at[2] = {found[0], found[1]}, segment = ~0u;
        while (at[0] < found[1] || at[1] < found[2]) {
            const std::uint32_t row =
                at[0] < found[1] && (at[1] == found[2] || step_of(at[0]) <= step_of(at[1])) ? 0 : 1;
            const ApartHit& hit = hits[at[row]];
            if (const std::uint32_t now = step_of(at[row]++) / sweep_segment; now != segment) {
                segment = now;
                if ((static_cast<std::size_t>(out.end - out.next) < sweep_room ||
                     out.tie_count > tie_capacity - sweep_room) &&
                    !out.make_room(out))
                    return steps / 2;
            }
            if (hit.tie)
                out.ties[out.tie_count++] = {object[row], hit.object};
            else
                *out.next++ = {std::min(object[row], hit.object) & index_mask,
                               std::max(object[row], hit.object) & index_mask};
        }
    }
    return steps / 2;
}

template std::uint64_t Apart::sweep<2>(const Kernels&, std::uint32_t, std::uint32_t, Slot&,
                                       PairOutput&) const;
template std::uint64_t Apart::sweep<3>(const Kernels&, std::uint32_t, std::uint32_t, Slot&,
                                       PairOutput&) const;

} // namespace engine
JOSTLE_NAMESPACE_END
