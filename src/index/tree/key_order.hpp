// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory_resource>
#include <numeric>
#include <span>

#include "base/buffer.hpp"
#include "base/radix.hpp"
#include "index/kernels/kernels.hpp"
#include "index/nodes/key.hpp"
#include "jostle/process.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// A frame for these boxes, and for others about where they are.
template <int Dim, class T>
Frame<Dim> choose_frame(const BoxView<Dim, T>& boxes)
{
    constexpr double furthest = 1e300;
    constexpr std::size_t most_samples = 2048;
    const std::size_t samples = std::min(boxes.size(), most_samples);
    double center[most_samples], size[most_samples];
    std::fill_n(size, samples, 0.0);
    Frame<Dim> frame;
    double world = 0;
    for (int d = 0; d < Dim; ++d) {
        for (std::size_t k = 0; k < samples; ++k) {
            // A pseudo-random place in the k-th part of all, so that regular patterns in the user's data
            // don't matter.
            const std::size_t begin = boxes.size() * k / samples, end = boxes.size() * (k + 1) / samples;
            const std::size_t i =
                begin + static_cast<std::size_t>(((k + 1) * 0x9e3779b97f4a7c15u) >> 32) % (end - begin);
            const double lo = std::max(-furthest, std::min(static_cast<double>(boxes.lo(d, i)), furthest));
            const double hi = std::max(-furthest, std::min(static_cast<double>(boxes.hi(d, i)), furthest));
            center[k] = 0.5 * lo + 0.5 * hi;
            size[k] = std::max(size[k], hi - lo);
        }
        const auto at = [&](std::size_t rank) {
            std::nth_element(center, center + rank, center + samples);
            return center[rank];
        };
        const double low = at(samples / 64), high = at(samples - 1 - samples / 64);
        frame.origin[d] = 0.5 * low + 0.5 * high;
        world = std::max(world, high - low);
    }
    std::nth_element(size, size + samples / 2, size + samples);
    const double common = size[samples / 2];
    if (!(world > 0)) world = common; // all in one place
    if (!(world > 0)) world = 1;
    world = std::max(world, 1e-280);
    frame.scale = Frame<Dim>::world_quanta / world;
    for (double& origin : frame.origin)
        origin -= world;
    // Sixteen to a page's edge if most have zero size.
    frame.common_size = std::max(8 * common, world * 1e-4);
    return frame;
}

/// Working memory of a KeyOrder.
struct KeyMemory
{
    Buffer<KeyEntry> entries, sorted;

    explicit KeyMemory(std::pmr::memory_resource* memory) : entries(memory), sorted(memory) {}
    [[nodiscard]] std::size_t bytes() const noexcept { return entries.bytes() + sorted.bytes(); }
    void release() noexcept
    {
        entries.release();
        sorted.release();
    }
};

/// Boxes to be sorted along space, by the digits of their keys as far as needed.
template <int Dim, class T>
struct KeyOrder
{
    using Entry = KeyEntry;
    const Kernels<Dim, T>& kernels;
    const Frame<Dim>& frame;
    std::span<const std::uint32_t> ids; // of the boxes; empty: their positions
    const BoxView<Dim, T>& boxes;
    Executor* executor;
    std::span<Entry> entries, sorted; // what is sorted, and room for as many

    KeyOrder(const Kernels<Dim, T>& given_kernels, const Frame<Dim>& given_frame,
             std::span<const std::uint32_t> given_ids, const BoxView<Dim, T>& given, Executor* given_executor,
             KeyMemory& memory)
        : kernels(given_kernels),
          frame(given_frame),
          ids(given_ids),
          boxes(given),
          executor(given_executor),
          entries(memory.entries.reserve_exactly(given.size()), given.size()),
          sorted(memory.sorted.reserve_exactly(given.size()), given.size())
    {
    }

    [[nodiscard]] std::uint32_t id(const Entry& entry) const noexcept
    {
        return ids.empty() ? entry.box : ids[entry.box];
    }
    [[nodiscard]] Key<Dim> key(const Entry& entry) const noexcept
    {
        return key_of(frame, boxes[entry.box], id(entry));
    }

    /// Calls body(part, first, last) for the parts of some entries, which depend only on their number.
    template <class Body>
    void in_parts(std::size_t count, const Body& body) const
    {
        constexpr std::size_t least_part = 8192;
        process_items(count,
                      [&](std::uint64_t from, std::uint64_t to, Work work) { body(work.block, from, to); },
                      {executor, std::max(least_part, (count + most_parts - 1) / most_parts)});
    }
    static constexpr std::size_t most_parts = 8;
    static constexpr int per_axis = entry_digits<Dim>;

    /// Makes the entries, with the digits in which they differ if all boxes are about where they were
    /// expected, within twice `Frame::world_quanta`; otherwise without digits, so that `look_closer` is
    /// called next.
    void make_entries()
    {
        bool beyond[most_parts] = {};
        in_parts(boxes.size(), [&](std::uint32_t part, std::size_t first, std::size_t last) {
            beyond[part] = !kernels.make_entries(frame, boxes, first, last, entries.data());
        });
        if (std::find(beyond, beyond + most_parts, true) == beyond + most_parts) return;
        in_parts(boxes.size(), [&](std::uint32_t, std::size_t first, std::size_t last) {
            for (std::size_t k = first; k < last; ++k)
                entries[k] = {0, static_cast<std::uint32_t>(k)};
        });
    }

    /// Gives entries that don't differ in their digits some in which they do.
    void look_closer(std::size_t begin, std::size_t end)
    {
        const auto [centers, fine, classes] = differing_keys(begin, end);
        const bool by_center = centers != 0 || classes != 0, by_id = !by_center && fine == 0;
        const int shift =
            std::max(0, static_cast<int>(std::bit_width(by_center ? centers : fine)) - per_axis);
        in_parts(end - begin, [&, by_center, by_id, shift](std::uint32_t, std::size_t from, std::size_t to) {
            for (Entry& entry : entries.subspan(begin + from, to - from)) {
                const Key<Dim> here = key(entry);
                std::uint32_t digits = here.size_class << entry_class_shift;
                for (int d = 0; d < Dim; ++d)
                    digits |= spread<Dim>(static_cast<std::uint32_t>(
                                              (by_center ? here.center[d] : here.fine[d]) >> shift) &
                                          ((1u << per_axis) - 1))
                              << (Dim - 1 - d);
                entry.digits = by_id ? here.id : digits;
            }
        });
    }
    /// In which digits the keys of entries differ: of their centres, on any axis, and classes.
    struct Differing
    {
        std::uint64_t centers = 0, fine = 0;
        std::uint32_t classes = 0;
    };
    [[nodiscard]] Differing differing_keys(std::size_t begin, std::size_t end) const
    {
        const Key<Dim> first = key(entries[begin]);
        Differing parts[most_parts];
        in_parts(end - begin, [&](std::uint32_t part, std::size_t from, std::size_t to) {
            Differing differing;
            for (const Entry& entry : entries.subspan(begin + from, to - from)) {
                const Key<Dim> here = key(entry);
                for (int d = 0; d < Dim; ++d) {
                    differing.centers |= here.center[d] ^ first.center[d];
                    differing.fine |= here.fine[d] ^ first.fine[d];
                }
                differing.classes |= here.size_class ^ first.size_class;
            }
            parts[part] = differing;
        });
        Differing all;
        for (const Differing& part : parts) {
            all.centers |= part.centers;
            all.fine |= part.fine;
            all.classes |= part.classes;
        }
        return all;
    }

    /// In which digits entries differ.
    [[nodiscard]] std::uint32_t differing(std::size_t begin, std::size_t end) const
    {
        std::uint32_t parts[most_parts] = {};
        const std::uint32_t one = entries[begin].digits;
        in_parts(end - begin, [&](std::uint32_t part, std::size_t from, std::size_t to) {
            std::uint32_t differing = 0;
            for (const Entry& entry : entries.subspan(begin + from, to - from))
                differing |= entry.digits ^ one;
            parts[part] = differing;
        });
        return std::accumulate(parts, parts + most_parts, 0u, std::bit_or<>());
    }

    /// Whether two entries have the same digits except for the last `unsorted`, of which there are at most
    /// 32.
    [[nodiscard]] static bool same_place(const Entry& a, const Entry& b, int unsorted) noexcept
    {
        return std::uint64_t{a.digits ^ b.digits} >> unsorted == 0;
    }
    static constexpr int all_digits = 32;

    /// Sorts entries by a few digits, mostly enough that not many more than `to_a_cell` have the same ones.
    /// Returns the number of low digits that it ignored.
    int sort(std::size_t begin, std::size_t end, std::size_t to_a_cell)
    {
        constexpr int most_digits = 16;
        std::uint32_t differ = differing(begin, end);
        while (differ == 0) {
            look_closer(begin, end);
            differ = differing(begin, end);
        }
        const int wanted = std::min(static_cast<int>(std::bit_width((end - begin) / to_a_cell)), most_digits);
        const int shift = std::max(0, static_cast<int>(std::bit_width(differ)) - wanted);
        // In two passes, so that writes to hundreds of places at a time stay in the cache.
        const int low = (wanted + 1) / 2;
        pass(entries.subspan(begin, end - begin), sorted.subspan(begin, end - begin), shift, low);
        pass(sorted.subspan(begin, end - begin), entries.subspan(begin, end - begin), shift + low, low);
        return shift;
    }
    /// Sorts by `digits` digits from `shift` on; stable.
    void pass(std::span<Entry> from, std::span<Entry> to, int shift, int digits) const
    {
        constexpr std::size_t most_cells = 256;
        std::uint32_t places[most_parts * most_cells] = {}; // by part and digits: counts, then destinations
        const std::size_t cells = std::size_t{1} << digits;
        const auto cell_of = [&](const Entry& entry) {
            return static_cast<std::size_t>(entry.digits >> shift) & (cells - 1);
        };
        in_parts(from.size(), [&](std::uint32_t part, std::size_t first, std::size_t last) {
            std::uint32_t* const count = places + part * cells;
            for (const Entry& entry : from.subspan(first, last - first))
                ++count[cell_of(entry)];
        });
        exclusive_sum_of_parts(places, most_parts, cells, std::uint32_t{0});
        in_parts(from.size(), [&](std::uint32_t part, std::size_t first, std::size_t last) {
            std::uint32_t next[most_cells]; // others count nearby
            std::copy_n(places + part * cells, cells, next);
            for (const Entry& entry : from.subspan(first, last - first))
                to[next[cell_of(entry)]++] = entry;
        });
    }
};

} // namespace index
JOSTLE_NAMESPACE_END
