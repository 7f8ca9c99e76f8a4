// SPDX-License-Identifier: MIT
#include "index/tree/validate.hpp"

#include <bit>
#include <vector>

#include "base/box.hpp"
#include "base/instantiate.hpp"
#include "index/tree/trie.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {
template <int Dim, class T>
const char* validate(const Parts<Dim, T>& parts)
{
    std::size_t objects = 0;
    std::uint64_t pages = 0, wides = 0, leaves = 0, forks = 0;
    std::vector<Ref> way;
    if (parts.root != none) way.push_back(parts.root);
    while (!way.empty()) {
        const Ref ref = way.back();
        way.pop_back();
        if (!(ref & page_bit)) {
            const Fork<Dim>& fork = parts.forks[ref];
            ++forks;
            if (fork.width < 2 || fork.width > lanes) return "a piece has too many leaves or too few";
            for (const Ref child : fork.child) {
                const std::uint32_t parent =
                    child & page_bit ? parts.pages[child & ~page_bit].parent : parts.forks[child].parent;
                if (parent != ref) return "a child names another parent";
                if (!(child & page_bit) && parts.forks[child].level <= fork.level)
                    return "a fork is above a higher digit";
                way.push_back(child);
            }
            if (fork.wide == none) continue;
            ++wides;
            const Wide<Dim, T>& wide = parts.wides[fork.wide];
            if (wide.fork != ref || wide.count != fork.width) return "a wide node doesn't know its fork";
            if (!same(wide.hull, wide.node.bounds.hull())) return "a wide node's bounds are stale";
            if (wide.wide == none) {
                if (ref != parts.root) return "a wide node hangs nowhere";
                continue;
            }
            const Wide<Dim, T>& above = parts.wides[wide.wide];
            if (!(above.node.child[wide.lane] == Child<Dim, T>(&wide.node)))
                return "a wide node isn't where it says";
            if (!same(above.node.bounds.get(wide.lane), wide.hull))
                return "the bounds above a wide node are stale";
            continue;
        }
        const std::uint32_t number = ref & ~page_bit;
        const Page<Dim, T>& page = parts.pages[number];
        ++pages;
        if (!page.used || page.listed) return "a page is unfinished";
        if (page.count == 0 || page.count > page_capacity) return "a page is empty or overfull";
        if (page.wide != none) {
            const Wide<Dim, T>& above = parts.wides[page.wide];
            if (!(above.node.child[page.lane] == Child<Dim, T>(&page.node)))
                return "a page isn't where it says";
            if (!same(above.node.bounds.get(page.lane), page.hull))
                return "the bounds above a page are stale";
        }
        std::uint32_t count = 0;
        for (std::uint32_t b = 0; b < page.leaves; ++b) {
            const Leaf<Dim, T>& leaf = parts.leaves[page.leaf[b]];
            ++leaves;
            if (leaf.live() != page.live[b] || page.live[b] == 0) return "a leaf's objects are miscounted";
            if (!(page.node.child[b] == Child<Dim, T>(&leaf))) return "a page's node names another leaf";
            if (!same(page.node.bounds.get(b), leaf.bounds.hull())) return "the bounds of a leaf are stale";
            for (unsigned live = page.live[b]; live != 0; live &= live - 1) {
                const auto lane = static_cast<std::uint32_t>(std::countr_zero(live));
                if (parts.page_of[leaf.id[lane]] != number) return "an object is noted in another page";
                if (!inside(leaf.bounds.get(lane), parts.hull)) return "an object lies outside of everything";
                if (descend(parts, key_of(parts.frame, leaf.bounds.get(lane), leaf.id[lane])) != number)
                    return "an object belongs into another page";
                ++count;
            }
        }
        if (count != page.count) return "a page's objects are miscounted";
        objects += count;
    }
    if (objects != parts.size) return "objects are lost";
    if (pages != parts.pages.in_use() || leaves != parts.leaves.in_use() || wides != parts.wides.in_use() ||
        forks != parts.forks.in_use())
        return "something is in use that nothing refers to";
    return nullptr;
}

#define JOSTLE_INSTANTIATE(Dim, T) template const char* validate(const Parts<Dim, T>& parts);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace index
JOSTLE_NAMESPACE_END
