// SPDX-License-Identifier: MIT
#include "index/build.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <numeric>
#include <vector>

#include "base/buffer.hpp"
#include "base/prefetch.hpp"
#include "base/radix.hpp"
#include "index/page.hpp"
#include "index/wide.hpp"
#include "jostle/process.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

namespace {

/// A frame for a tree that begins with these boxes.
template <int Dim, class T>
Frame<Dim> choose_frame(const BoxView<Dim, T>& boxes)
{
    constexpr double furthest = 1e300;
    const std::size_t samples = std::min<std::size_t>(boxes.size(), 2048);
    std::vector<double> center(samples), size(samples, 0.0);
    Frame<Dim> frame;
    double world = 0;
    for (int d = 0; d < Dim; ++d) {
        for (std::size_t k = 0; k < samples; ++k) {
            // Somewhere in the k-th part of all: regular patterns of the user's mustn't show.
            const std::size_t begin = boxes.size() * k / samples, end = boxes.size() * (k + 1) / samples;
            const std::size_t i =
                begin + static_cast<std::size_t>(((k + 1) * 0x9e3779b97f4a7c15u) >> 32) % (end - begin);
            const double lo = std::max(-furthest, std::min(static_cast<double>(boxes.lo(d, i)), furthest));
            const double hi = std::max(-furthest, std::min(static_cast<double>(boxes.hi(d, i)), furthest));
            center[k] = 0.5 * lo + 0.5 * hi;
            size[k] = std::max(size[k], hi - lo);
        }
        const auto at = [&](std::size_t rank) {
            std::nth_element(center.begin(), center.begin() + static_cast<std::ptrdiff_t>(rank),
                             center.end());
            return center[rank];
        };
        const double low = at(samples / 64), high = at(samples - 1 - samples / 64);
        frame.origin[d] = 0.5 * low + 0.5 * high;
        world = std::max(world, high - low);
    }
    std::nth_element(size.begin(), size.begin() + static_cast<std::ptrdiff_t>(samples / 2), size.end());
    const double common = size[samples / 2];
    if (!(world > 0)) world = common; // all in one place
    if (!(world > 0)) world = 1;
    world = std::max(world, 1e-280);
    frame.scale = Frame<Dim>::world_quanta / world;
    for (double& origin : frame.origin)
        origin -= world;
    // Sixteen to a page's edge if most have no size.
    frame.common_size = std::max(8 * common, world * 1e-4);
    return frame;
}

/// The objects of a tree on their way into pages, sorted by the digits of their keys as far as is needed.
template <int Dim, class T>
struct Building
{
    struct Entry
    {
        std::uint64_t digits; // of its key, from the first on in which those around it differ
        std::uint32_t box;
    };
    struct Plan
    {
        std::uint32_t page;
        std::size_t begin; // of its entries
    };
    const Frame<Dim>& frame;
    std::span<const std::uint32_t> ids;
    const BoxView<Dim, T>& boxes;
    Executor* executor;
    Buffer<Entry> memory, memory_to;
    std::pmr::vector<Plan> pages;
    std::span<Entry> entries, sorted; // what is sorted, and room for as many

    Building(const Parts<Dim, T>& parts, std::span<const std::uint32_t> all, const BoxView<Dim, T>& given)
        : frame(parts.frame),
          ids(all),
          boxes(given),
          executor(parts.executor),
          memory(parts.memory),
          memory_to(parts.memory),
          pages(parts.memory),
          entries(memory.reserve_exactly(all.size()), all.size()),
          sorted(memory_to.reserve_exactly(all.size()), all.size())
    {
    }

    [[nodiscard]] Key<Dim> key(const Entry& entry) const noexcept
    {
        return key_of(frame, boxes[entry.box], ids[entry.box]);
    }

    /// Works on the parts of some entries, which depend on their number alone: body(part, first, last).
    template <class Body>
    void in_parts(std::size_t count, const Body& body) const
    {
        constexpr std::size_t least_part = 8192;
        process_items(count,
                      [&](std::uint64_t from, std::uint64_t to, Work work) { body(work.block, from, to); },
                      {executor, std::max(least_part, (count + most_parts - 1) / most_parts)});
    }
    static constexpr std::size_t most_parts = 8;
    static constexpr int per_axis = 60 / Dim; // digits of an axis in an entry
    static constexpr int class_shift = 60;

    /// Makes the entries, with the digits that they differ in if all boxes lie about where they were
    /// expected, within twice `Frame::world_quanta`; else without digits, so that `look_closer` is asked
    /// next.
    void make_entries()
    {
        constexpr int expected = 43; // digits of an axis
        static_assert(std::uint64_t{1} << (expected - 1) ==
                      static_cast<std::uint64_t>(Frame<Dim>::world_quanta));
        constexpr double end = 2 * Frame<Dim>::world_quanta;
        constexpr double to_cell = 1 / static_cast<double>(std::uint64_t{1} << (expected - per_axis));
        bool beyond[most_parts] = {};
        in_parts(ids.size(), [&](std::uint32_t part, std::size_t first, std::size_t last) {
            constexpr std::size_t at_once = 128;
            double size[at_once], place[at_once];
            std::int32_t cell[Dim][at_once];
            bool outside = false;
            for (std::size_t begin = first; begin < last; begin += at_once) {
                const std::size_t count = std::min(at_once, last - begin);
                std::fill_n(size, count, 0.0);
                for (int d = 0; d < Dim; ++d) {
                    // As in key_of. What it cuts off is beyond anyway, or as wide as the greatest class.
                    for (std::size_t k = 0; k < count; ++k) {
                        const auto lo = static_cast<double>(boxes.lo(d, begin + k));
                        const auto hi = static_cast<double>(boxes.hi(d, begin + k));
                        size[k] = size[k] > hi - lo ? size[k] : hi - lo;
                        place[k] = place_of(frame, d, lo, hi);
                    }
                    int inside = 1;
                    for (std::size_t k = 0; k < count; ++k)
                        inside &= static_cast<int>(place[k] >= 0) & static_cast<int>(place[k] < end);
                    outside |= inside == 0;
                    if (outside) break;
                    for (std::size_t k = 0; k < count; ++k)
                        cell[d][k] = static_cast<std::int32_t>(place[k] * to_cell);
                }
                if (outside) break;
                for (std::size_t k = 0; k < count; ++k) {
                    std::uint64_t digits = 0;
                    for (int d = 0; d < Dim; ++d)
                        digits |= spread<Dim>(static_cast<std::uint64_t>(cell[d][k])) << (Dim - 1 - d);
                    entries[begin + k] = {digits, static_cast<std::uint32_t>(begin + k)};
                }
                for (std::size_t k = 0; k < count; ++k)
                    if (size[k] > frame.common_size)
                        entries[begin + k].digits |= std::uint64_t{class_of(frame, size[k])} << class_shift;
            }
            beyond[part] = outside;
        });
        if (std::find(beyond, beyond + most_parts, true) == beyond + most_parts) return;
        in_parts(ids.size(), [&](std::uint32_t, std::size_t first, std::size_t last) {
            for (std::size_t k = first; k < last; ++k)
                entries[k] = {0, static_cast<std::uint32_t>(k)};
        });
    }

    /// Gives entries that don't differ in their digits some in which they do.
    void look_closer(std::size_t begin, std::size_t end)
    {
        const Key<Dim> first = key(entries[begin]);
        std::uint64_t centers[most_parts] = {};
        std::uint32_t classes[most_parts] = {};
        in_parts(end - begin, [&](std::uint32_t part, std::size_t from, std::size_t to) {
            std::uint64_t differing = 0;
            for (const Entry& entry : entries.subspan(begin + from, to - from)) {
                const Key<Dim> here = key(entry);
                for (int d = 0; d < Dim; ++d)
                    differing |= here.center[d] ^ first.center[d];
                classes[part] |= here.size_class ^ first.size_class;
            }
            centers[part] = differing;
        });
        const std::uint64_t differing =
            std::accumulate(centers, centers + most_parts, std::uint64_t{0}, std::bit_or<>());
        const bool by_id =
            differing == 0 && std::accumulate(classes, classes + most_parts, 0u, std::bit_or<>()) == 0;
        const int shift = std::max(0, static_cast<int>(std::bit_width(differing)) - per_axis);
        in_parts(end - begin, [&](std::uint32_t, std::size_t from, std::size_t to) {
            for (Entry& entry : entries.subspan(begin + from, to - from)) {
                const Key<Dim> here = key(entry);
                std::uint64_t digits = here.size_class;
                digits <<= class_shift;
                for (int d = 0; d < Dim; ++d)
                    digits |= spread<Dim>((here.center[d] >> shift) & ((1u << per_axis) - 1))
                              << (Dim - 1 - d);
                entry.digits = by_id ? here.id : digits;
            }
        });
    }

    /// In which digits entries differ.
    [[nodiscard]] std::uint64_t differing(std::size_t begin, std::size_t end) const
    {
        std::uint64_t parts[most_parts] = {};
        const std::uint64_t one = entries[begin].digits;
        in_parts(end - begin, [&](std::uint32_t part, std::size_t from, std::size_t to) {
            std::uint64_t differing = 0;
            for (const Entry& entry : entries.subspan(begin + from, to - from))
                differing |= entry.digits ^ one;
            parts[part] = differing;
        });
        return std::accumulate(parts, parts + most_parts, std::uint64_t{0}, std::bit_or<>());
    }

    /// Sorts entries by a few digits, mostly enough to tell the pages apart. Returns how many low digits it
    /// didn't look at.
    int sort(std::size_t begin, std::size_t end)
    {
        constexpr std::uint32_t to_a_cell = 64;
        constexpr int most_digits = 16;
        std::uint64_t differ = differing(begin, end);
        while (differ == 0) {
            look_closer(begin, end);
            differ = differing(begin, end);
        }
        const int wanted = std::min(static_cast<int>(std::bit_width((end - begin) / to_a_cell)), most_digits);
        const int shift = std::max(0, static_cast<int>(std::bit_width(differ)) - wanted);
        // In two passes: what is written to hundreds of places at a time stays in the cache.
        const int low = (wanted + 1) / 2;
        pass(entries.subspan(begin, end - begin), sorted.subspan(begin, end - begin), shift, low);
        pass(sorted.subspan(begin, end - begin), entries.subspan(begin, end - begin), shift + low, low);
        return shift;
    }
    /// Sorts by `digits` of the digits from `shift` on; what has the same ones keeps its order.
    void pass(std::span<Entry> from, std::span<Entry> to, int shift, int digits) const
    {
        constexpr std::size_t most_cells = 256;
        std::uint32_t places[most_parts * most_cells] = {}; // by part and digits: how many, then where to
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

/// Makes the forks and pages of some entries, which are sorted but for the last digits; what is in the pages
/// comes later.
template <int Dim, class T>
Ref divide(Parts<Dim, T>& parts, Building<Dim, T>& building, std::size_t begin, std::size_t end,
           std::uint32_t parent, int unsorted)
{
    const auto& entries = building.entries;
    const std::size_t count = end - begin;
    if (count <= page_capacity) {
        parts.leaves.reserve(lanes);
        parts.pages.reserve(1);
        if (parts.listed.capacity() < parts.pages.in_use() + 1)
            parts.listed.reserve(2 * parts.pages.in_use() + 64);
        const std::uint32_t number = new_page(parts, building.key(entries[begin]));
        Page<Dim, T>& page = parts.pages[number];
        page.parent = parent;
        page.count = static_cast<std::uint32_t>(count);
        while (page.leaves * lanes < page.count)
            page.leaf[page.leaves++] = parts.leaves.take();
        building.pages.push_back({number, begin});
        return number | page_bit;
    }
    if ((entries[begin].digits ^ entries[end - 1].digits) >> unsorted == 0)
        unsorted = building.sort(begin, end);
    parts.forks.reserve(1);
    const std::uint32_t number = parts.forks.take();
    parts.forks[number].key = building.key(entries[begin]);
    parts.forks[number].level = first_difference(parts.forks[number].key, building.key(entries[end - 1]));
    parts.forks[number].parent = parent;
    parts.forks[number].wide = none;
    const auto first = entries.begin() + static_cast<std::ptrdiff_t>(begin);
    const std::uint64_t mark = std::bit_floor(entries[begin].digits ^ entries[end - 1].digits);
    const auto middle = std::partition_point(first, first + static_cast<std::ptrdiff_t>(count),
                                             [&](const auto& entry) { return (entry.digits & mark) == 0; });
    const auto split = begin + static_cast<std::size_t>(middle - first);
    const Ref left = divide(parts, building, begin, split, number, unsorted);
    const Ref right = divide(parts, building, split, end, number, unsorted);
    parts.forks[number].child[0] = left;
    parts.forks[number].child[1] = right;
    return number;
}

/// Makes the wide nodes below a fork and decides where it is cut.
template <int Dim, class T>
void cut_below(Parts<Dim, T>& parts, Ref ref)
{
    if (ref & page_bit) return;
    cut_below(parts, parts.forks[ref].child[0]);
    cut_below(parts, parts.forks[ref].child[1]);
    parts.wides.reserve(2);
    cut(parts, ref);
}

} // namespace

template <int Dim, class T>
void build(Parts<Dim, T>& parts, std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    parts.frame = choose_frame(boxes);
    Building<Dim, T> building(parts, ids, boxes);
    building.make_entries();
    parts.root = divide(parts, building, 0, ids.size(), none, 63);
    constexpr std::size_t ahead = 24; // boxes on their way from memory, and as many ids more
    process_items(building.pages.size(),
                  [&](std::uint64_t begin, std::uint64_t end, Work) {
                      Record<Dim, T> records[page_capacity];
                      for (std::size_t b = begin; b < end; ++b) {
                          const auto [number, first] = building.pages[b];
                          const std::uint32_t count = parts.pages[number].count;
                          for (std::uint32_t k = 0; k < count; ++k) {
                              const std::uint32_t box = building.entries[first + k].box;
                              const std::size_t at = first + k, last = ids.size() - 1;
                              const std::uint32_t next = building.entries[std::min(at + ahead, last)].box;
                              prefetch(&ids[building.entries[std::min(at + 2 * ahead, last)].box]);
                              prefetch(boxes.lo_pointer(0, next));
                              prefetch(boxes.hi_pointer(Dim - 1, next));
                              prefetch_to_write(&parts.page_of[ids[next]]);
                              records[k] = {boxes[box], ids[box]};
                              parts.page_of[ids[box]] = number;
                          }
                          arrange(parts, number, records, count);
                      }
                  },
                  {parts.executor, 16});
    parts.sorts += building.pages.size();
    parts.wides.reserve(1);
    cut_below(parts, parts.root);
    if (!(parts.root & page_bit)) set_piece(parts, parts.root, true);
    parts.size = ids.size();
    show_root(parts);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void build(Parts<Dim, T>&, std::span<const std::uint32_t>, const BoxView<Dim, T>&);
JOSTLE_INSTANTIATE(2, float)
JOSTLE_INSTANTIATE(2, double)
JOSTLE_INSTANTIATE(3, float)
JOSTLE_INSTANTIATE(3, double)
#undef JOSTLE_INSTANTIATE

} // namespace index
JOSTLE_NAMESPACE_END
