// SPDX-License-Identifier: MIT
#include "index/tree/build.hpp"

#include <algorithm>
#include <bit>
#include <vector>

#include "base/instantiate.hpp"
#include "base/prefetch.hpp"
#include "index/tree/key_order.hpp"
#include "index/tree/page.hpp"
#include "index/tree/wide.hpp"
#include "jostle/process.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

namespace {

/// The objects of a tree, to be put into pages.
template <int Dim, class T>
struct Building
{
    KeyOrder<Dim, T> order;
    std::pmr::vector<BuildMemory::Plan>& pages;

    Building(const Parts<Dim, T>& parts, std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes,
             BuildMemory& memory)
        : order(parts.kernels, parts.frame, ids, boxes, parts.executor, memory.keys), pages(memory.pages)
    {
        pages.clear();
    }
};

/// Makes the forks and pages of some entries, which are sorted except for the last digits; the pages are
/// filled later.
template <int Dim, class T>
Ref divide(Parts<Dim, T>& parts, Building<Dim, T>& building, std::size_t begin, std::size_t end,
           std::uint32_t parent, int unsorted)
{
    KeyOrder<Dim, T>& order = building.order;
    const auto& entries = order.entries;
    const std::size_t count = end - begin;
    if (count <= page_capacity) {
        parts.leaves.reserve((count + lanes - 1) / lanes);
        reserve_page(parts);
        const std::uint32_t number = new_page(parts, order.key(entries[begin]));
        Page<Dim, T>& page = parts.pages[number];
        page.parent = parent;
        page.count = static_cast<std::uint32_t>(count);
        while (page.leaves * lanes < page.count)
            page.leaf[page.leaves++] = parts.leaves.take();
        building.pages.push_back({number, begin});
        return number | page_bit;
    }
    if (order.same_place(entries[begin], entries[end - 1], unsorted))
        unsorted = order.sort(begin, end, page_capacity / 4);
    parts.forks.reserve(1);
    const std::uint32_t number = parts.forks.take();
    parts.forks[number].key = order.key(entries[begin]);
    parts.forks[number].level = first_difference(parts.forks[number].key, order.key(entries[end - 1]));
    parts.forks[number].parent = parent;
    parts.forks[number].wide = none;
    const auto first = entries.begin() + static_cast<std::ptrdiff_t>(begin);
    const std::uint32_t mark = std::bit_floor(entries[begin].digits ^ entries[end - 1].digits);
    const auto middle = std::partition_point(first, first + static_cast<std::ptrdiff_t>(count),
                                             [&](const auto& entry) { return (entry.digits & mark) == 0; });
    const auto split = begin + static_cast<std::size_t>(middle - first);
    const Ref left = divide(parts, building, begin, split, number, unsorted);
    const Ref right = divide(parts, building, split, end, number, unsorted);
    parts.forks[number].child[0] = left;
    parts.forks[number].child[1] = right;
    return number;
}

/// Fills a page with its objects.
template <int Dim, class T>
void fill(Parts<Dim, T>& parts, const Building<Dim, T>& building, std::size_t which)
{
    const KeyOrder<Dim, T>& order = building.order;
    const auto [number, first] = building.pages[which];
    const Page<Dim, T>& page = parts.pages[number];
    for (std::uint32_t b = 0; b < page.leaves; ++b)
        for (std::size_t line = 0; line < sizeof(Leaf<Dim, T>); line += cache_line)
            prefetch_to_write(reinterpret_cast<std::byte*>(&parts.leaves[page.leaf[b]]) + line);
    constexpr std::size_t ahead = 24; // boxes being fetched from memory, and as many ids beyond
    const std::size_t last = order.entries.size() - 1;
    Gathered<Dim, T> objects;
    for (std::size_t at = first; at < first + page.count; ++at) {
        const KeyEntry& next = order.entries[std::min(at + ahead, last)];
        if (!order.ids.empty()) prefetch(&order.ids[order.entries[std::min(at + 2 * ahead, last)].box]);
        prefetch(order.boxes.lo_pointer(0, next.box));
        prefetch(order.boxes.hi_pointer(Dim - 1, next.box));
        prefetch_to_write(&parts.page_of[order.id(next)]);
        const std::uint32_t id = order.id(order.entries[at]);
        objects.add(order.boxes[order.entries[at].box], id);
        parts.page_of[id] = number;
    }
    arrange(parts, number, objects);
}

/// Makes the wide nodes below a fork and decides where the trie is cut.
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
void build(Parts<Dim, T>& parts, std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes,
           BuildMemory& memory)
{
    parts.frame = choose_frame(boxes);
    Building<Dim, T> building(parts, ids, boxes, memory);
    const KeyOrder<Dim, T>& order = building.order;
    building.order.make_entries();
    parts.root = divide(parts, building, 0, boxes.size(), none, order.all_digits);
    process_items(building.pages.size(),
                  [&](std::uint64_t begin, std::uint64_t end, Work) {
                      for (std::size_t b = begin; b < end; ++b)
                          fill(parts, building, b);
                  },
                  {parts.executor, 16});
    parts.sorts += building.pages.size();
    if (!(parts.root & page_bit)) {
        cut_below(parts, parts.root);
        parts.wides.reserve(1);
        set_piece(parts, parts.root, true);
    }
    parts.size = boxes.size();
    show_root(parts);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void build(Parts<Dim, T>&, std::span<const std::uint32_t>, const BoxView<Dim, T>&, BuildMemory&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace index
JOSTLE_NAMESPACE_END
