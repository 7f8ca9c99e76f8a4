// SPDX-License-Identifier: MIT
#include "index/build.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <numeric>
#include <vector>

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
    std::pmr::vector<Entry> entries, sorted;
    std::pmr::vector<std::uint32_t> places; // by part and digits: how many, then where to
    std::pmr::vector<Plan> pages;

    [[nodiscard]] Key<Dim> key(const Entry& entry) const noexcept
    {
        return key_of(frame, boxes[entry.box], ids[entry.box]);
    }

    /// Works on the parts of [begin, end), which depend on the number of entries alone.
    template <class Body>
    void in_parts(std::size_t begin, std::size_t end, const Body& body)
    {
        constexpr std::size_t least_part = 8192;
        const std::size_t count = end - begin;
        process_items(count,
                      [&](std::uint64_t from, std::uint64_t to, Work work) {
                          body(work.block, std::span<Entry>(entries).subspan(begin + from, to - from));
                      },
                      {executor, std::max(least_part, (count + most_parts - 1) / most_parts)});
    }
    static constexpr std::size_t most_parts = 8;

    /// Gives entries that don't differ in their digits some in which they do.
    void look_closer(std::size_t begin, std::size_t end)
    {
        constexpr int per_axis = 60 / Dim;
        const Key<Dim> first = key(entries[begin]);
        std::uint64_t centers[most_parts] = {};
        std::uint32_t classes[most_parts] = {};
        in_parts(begin, end, [&](std::uint32_t part, std::span<Entry> some) {
            std::uint64_t differing = 0;
            for (const Entry& entry : some) {
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
        in_parts(begin, end, [&](std::uint32_t, std::span<Entry> some) {
            for (Entry& entry : some) {
                const Key<Dim> here = key(entry);
                std::uint64_t digits = here.size_class;
                digits <<= 60;
                for (int d = 0; d < Dim; ++d)
                    digits |= spread<Dim>((here.center[d] >> shift) & ((1u << per_axis) - 1))
                              << (Dim - 1 - d);
                entry.digits = by_id ? here.id : digits;
            }
        });
    }

    /// Sorts entries by a few digits, mostly enough to tell the pages apart. Returns how many low digits it
    /// didn't look at.
    int sort(std::size_t begin, std::size_t end)
    {
        constexpr std::uint32_t to_a_cell = 64;
        constexpr int most_digits = 15;
        std::uint64_t differing = 0;
        for (int look = 0; differing == 0; ++look) {
            if (look != 0) look_closer(begin, end);
            for (std::size_t k = begin; k < end; ++k)
                differing |= entries[k].digits ^ entries[begin].digits;
        }
        const int wanted = std::min(static_cast<int>(std::bit_width((end - begin) / to_a_cell)), most_digits);
        const int shift = std::max(0, static_cast<int>(std::bit_width(differing)) - wanted);
        const std::size_t cells = std::size_t{1} << wanted;
        const auto cell_of = [&](const Entry& entry) {
            return static_cast<std::size_t>(entry.digits >> shift) & (cells - 1);
        };
        places.assign(most_parts * cells, 0);
        in_parts(begin, end, [&](std::uint32_t part, std::span<Entry> some) {
            for (const Entry& entry : some)
                ++places[part * cells + cell_of(entry)];
        });
        exclusive_sum_of_parts(places.data(), most_parts, cells, static_cast<std::uint32_t>(begin));
        in_parts(begin, end, [&](std::uint32_t part, std::span<Entry> some) {
            for (const Entry& entry : some)
                sorted[places[part * cells + cell_of(entry)]++] = entry;
        });
        if (end - begin == entries.size())
            entries.swap(sorted);
        else
            std::copy(sorted.data() + begin, sorted.data() + end, entries.data() + begin);
        return shift;
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
    using Entries = std::pmr::vector<typename Building<Dim, T>::Entry>;
    Building<Dim, T> building{parts.frame,
                              ids,
                              boxes,
                              parts.executor,
                              Entries(ids.size(), parts.memory),
                              Entries(ids.size(), parts.memory),
                              std::pmr::vector<std::uint32_t>(parts.memory),
                              std::pmr::vector<typename Building<Dim, T>::Plan>(parts.memory)};
    for (std::size_t i = 0; i < ids.size(); ++i)
        building.entries[i] = {0, static_cast<std::uint32_t>(i)};
    parts.root = divide(parts, building, 0, ids.size(), none, 63);
    process_items(building.pages.size(),
                  [&](std::uint64_t begin, std::uint64_t end, Work) {
                      Record<Dim, T> records[page_capacity];
                      for (std::size_t b = begin; b < end; ++b) {
                          const auto [number, first] = building.pages[b];
                          const std::uint32_t count = parts.pages[number].count;
                          for (std::uint32_t k = 0; k < count; ++k) {
                              const std::uint32_t box = building.entries[first + k].box;
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
