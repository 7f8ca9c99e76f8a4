// SPDX-License-Identifier: MIT
#include "index/tree/page.hpp"
#include "base/instantiate.hpp"

#include <algorithm>
#include <bit>
#include <limits>

JOSTLE_NAMESPACE_BEGIN
namespace index {
template <int Dim, class T>
std::uint32_t new_page(Parts<Dim, T>& parts, const Key<Dim>& key) noexcept
{
    const std::uint32_t number = parts.pages.take();
    Page<Dim, T>& page = parts.pages[number];
    page.leaves = page.count = page.disorder = 0;
    page.changed = 0;
    page.listed = page.drifted = page.was_split = false;
    page.used = true;
    page.spread = 0;
    page.parent = page.wide = none;
    page.key = key;
    page.node.bounds.clear();
    std::fill_n(page.node.child, lanes, Child<Dim, T>());
    std::fill_n(page.live, lanes, std::uint16_t{0});
    page.hull = page.node.bounds.hull();
    return number;
}

template <int Dim, class T>
void give_page(Parts<Dim, T>& parts, std::uint32_t number) noexcept
{
    Page<Dim, T>& page = parts.pages[number];
    while (page.leaves > 0)
        parts.leaves.give(page.leaf[--page.leaves]);
    page.used = false;
    parts.pages.give(number);
}

template <int Dim, class T>
Place find(const Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id) noexcept
{
    const Page<Dim, T>& page = parts.pages[number];
    for (std::uint32_t b = 0;; ++b) {
        const Leaf<Dim, T>& leaf = parts.leaves[page.leaf[b]];
        unsigned found = 0;
        for (std::uint32_t lane = 0; lane < lanes; ++lane)
            found |= static_cast<unsigned>(leaf.id[lane] == id) << lane;
        if (found != 0) return {b, static_cast<std::uint32_t>(std::countr_zero(found))};
    }
}

template <int Dim, class T>
void list(Parts<Dim, T>& parts, std::uint32_t number) noexcept
{
    Page<Dim, T>& page = parts.pages[number];
    if (page.listed) return;
    page.listed = true;
    parts.listed.push_back(number);
}

template <int Dim, class T>
void put(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id, const Aabb<Dim, T>& box) noexcept
{
    Page<Dim, T>& page = parts.pages[number];
    // Into the leaf whose bounds it enlarges least.
    std::uint32_t best = lanes;
    T least = std::numeric_limits<T>::infinity();
    for (std::uint32_t b = 0; b < page.leaves; ++b) {
        if (page.live[b] == 0xffff) continue;
        T growth = 0;
        for (int d = 0; d < Dim; ++d)
            growth += std::max(T(0), page.node.bounds.lo[d][b] - box.lo[d]) +
                      std::max(T(0), box.hi[d] - page.node.bounds.hi[d][b]);
        if (best == lanes || growth < least) {
            least = growth;
            best = b;
        }
    }
    if (best == lanes) {
        best = page.leaves++;
        page.leaf[best] = parts.leaves.take();
        Leaf<Dim, T>& fresh = parts.leaves[page.leaf[best]];
        fresh.bounds.clear();
        std::fill_n(fresh.id, lanes, no_id);
        page.live[best] = 0;
        page.node.child[best] = &fresh;
    }
    Leaf<Dim, T>& leaf = parts.leaves[page.leaf[best]];
    const auto lane = static_cast<std::uint32_t>(std::countr_one(page.live[best]));
    leaf.bounds.set(lane, box);
    leaf.id[lane] = id;
    page.live[best] = static_cast<std::uint16_t>(page.live[best] | (1u << lane));
    page.changed = static_cast<std::uint16_t>(page.changed | (1u << best));
    // So that the next object of this batch sees it.
    for (int d = 0; d < Dim; ++d) {
        page.node.bounds.lo[d][best] = std::min(page.node.bounds.lo[d][best], box.lo[d]);
        page.node.bounds.hi[d][best] = std::max(page.node.bounds.hi[d][best], box.hi[d]);
    }
    ++page.count;
    ++page.disorder;
    ++parts.size;
    list(parts, number);
}

template <int Dim, class T>
void remove_one(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id) noexcept
{
    Page<Dim, T>& page = parts.pages[number];
    const Place place = find(parts, number, id);
    Leaf<Dim, T>& leaf = parts.leaves[page.leaf[place.leaf]];
    leaf.bounds.clear(place.lane);
    leaf.id[place.lane] = no_id;
    page.live[place.leaf] = static_cast<std::uint16_t>(page.live[place.leaf] & ~(1u << place.lane));
    page.changed = static_cast<std::uint16_t>(page.changed | (1u << place.leaf));
    --page.count;
    ++page.disorder;
    --parts.size;
    list(parts, number);
}

template <int Dim, class T>
void gather(const Parts<Dim, T>& parts, std::uint32_t number, Gathered<Dim, T>& objects) noexcept
{
    const Page<Dim, T>& page = parts.pages[number];
    for (std::uint32_t b = 0; b < page.leaves; ++b) {
        const Leaf<Dim, T>& leaf = parts.leaves[page.leaf[b]];
        for (unsigned live = page.live[b]; live != 0; live &= live - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(live));
            objects.add(leaf.bounds.get(lane), leaf.id[lane]);
        }
    }
}

template <int Dim, class T>
T spread_of(const Page<Dim, T>& page) noexcept
{
    T sum = 0;
    for (std::uint32_t b = 0; b < page.leaves; ++b)
        if (page.live[b] != 0)
            for (int d = 0; d < Dim; ++d)
                sum += page.node.bounds.hi[d][b] - page.node.bounds.lo[d][b];
    return sum;
}

template <int Dim, class T>
void arrange(Parts<Dim, T>& parts, std::uint32_t number, const Gathered<Dim, T>& objects) noexcept
{
    Page<Dim, T>& page = parts.pages[number];
    const std::uint32_t leaves = (objects.count + lanes - 1) / lanes;
    while (page.leaves > leaves)
        parts.leaves.give(page.leaf[--page.leaves]);
    while (page.leaves < leaves)
        page.leaf[page.leaves++] = parts.leaves.take();
    Leaf<Dim, T>* leaf[lanes];
    for (std::uint32_t b = 0; b < leaves; ++b)
        leaf[b] = &parts.leaves[page.leaf[b]];
    parts.kernels.arrange(objects, leaf, page.node.bounds);
    for (std::uint32_t b = 0; b < lanes; ++b) {
        page.node.child[b] = b < leaves ? Child<Dim, T>(leaf[b]) : Child<Dim, T>();
        const std::uint32_t here = std::min(lanes, objects.count - std::min(objects.count, b * lanes));
        page.live[b] = static_cast<std::uint16_t>((1u << here) - 1);
    }
    page.count = objects.count;
    page.disorder = 0;
    page.changed = 0;
    page.hull = page.node.bounds.hull();
    page.drifted = false;
    page.spread = spread_of(page);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template std::uint32_t new_page(Parts<Dim, T>& parts, const Key<Dim>& key) noexcept;                     \
    template void give_page(Parts<Dim, T>& parts, std::uint32_t number) noexcept;                            \
    template Place find(const Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id) noexcept;        \
    template void list(Parts<Dim, T>& parts, std::uint32_t number) noexcept;                                 \
    template void put(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id,                          \
                      const Aabb<Dim, T>& box) noexcept;                                                     \
    template void remove_one(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t id) noexcept;         \
    template void gather(const Parts<Dim, T>& parts, std::uint32_t number,                                   \
                         Gathered<Dim, T>& objects) noexcept;                                                \
    template T spread_of(const Page<Dim, T>& page) noexcept;                                                 \
    template void arrange(Parts<Dim, T>& parts, std::uint32_t number,                                        \
                          const Gathered<Dim, T>& objects) noexcept;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace index
JOSTLE_NAMESPACE_END
