// SPDX-License-Identifier: MIT
#include "index/tree/wide.hpp"

#include <algorithm>
#include <limits>

#include "base/box.hpp"
#include "base/instantiate.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {
namespace {

/// A piece of the trie this small may continue upwards if its bigger neighbour is cut off.
constexpr std::uint32_t straggler = 3;

template <int Dim, class T>
std::uint32_t width_of(const Parts<Dim, T>& parts, Ref ref) noexcept
{
    return ref & page_bit ? 1 : parts.forks[ref].width;
}

/// Rebuilds the wide node of the piece that begins at a fork.
template <int Dim, class T>
void fill(Parts<Dim, T>& parts, std::uint32_t number) noexcept
{
    const std::uint32_t own = parts.forks[number].wide;
    Wide<Dim, T>& wide = parts.wides[own];
    wide.fork = number;
    wide.node.bounds.clear();
    std::fill_n(wide.node.child, lanes, Child<Dim, T>());
    wide.count = 0;
    Ref way[2 * lanes]; // a piece has fewer than 16 forks
    std::uint32_t depth = 0;
    way[depth++] = parts.forks[number].child[1];
    way[depth++] = parts.forks[number].child[0];
    while (depth > 0) {
        const Ref ref = way[--depth];
        const std::uint32_t lane = wide.count;
        if (ref & page_bit) {
            Page<Dim, T>& page = parts.pages[ref & ~page_bit];
            page.wide = own;
            page.lane = lane;
            wide.node.bounds.set(lane, page.hull);
            wide.node.child[lane] = Child<Dim, T>(&page.node);
            ++wide.count;
        } else if (parts.forks[ref].wide != none) {
            Wide<Dim, T>& below = parts.wides[parts.forks[ref].wide];
            below.wide = own;
            below.lane = lane;
            wide.node.bounds.set(lane, below.hull);
            wide.node.child[lane] = &below.node;
            ++wide.count;
        } else {
            way[depth++] = parts.forks[ref].child[1];
            way[depth++] = parts.forks[ref].child[0];
        }
    }
    wide.hull = wide.node.bounds.hull();
}

} // namespace

template <int Dim, class T>
void set_piece(Parts<Dim, T>& parts, Ref ref, bool begins) noexcept
{
    if (ref & page_bit) return;
    Fork<Dim>& fork = parts.forks[ref];
    if (begins == (fork.wide != none)) return;
    if (begins) {
        fork.wide = parts.wides.take();
        parts.wides[fork.wide].wide = none;
        fill(parts, ref);
    } else {
        parts.wides.give(fork.wide);
        fork.wide = none;
    }
}

template <int Dim, class T>
void cut(Parts<Dim, T>& parts, std::uint32_t number) noexcept
{
    Fork<Dim>& fork = parts.forks[number];
    std::uint32_t left = width_of(parts, fork.child[0]), right = width_of(parts, fork.child[1]);
    bool begins[2] = {false, false};
    if (left + right > lanes) {
        begins[0] = left >= right || left > straggler;
        begins[1] = !begins[0] || right >= left || right > straggler;
        left = begins[0] ? 1 : left;
        right = begins[1] ? 1 : right;
    }
    fork.width = left + right;
    set_piece(parts, fork.child[0], begins[0]);
    set_piece(parts, fork.child[1], begins[1]);
}

template <int Dim, class T>
void repack(Parts<Dim, T>& parts, std::uint32_t fork) noexcept
{
    std::uint32_t below = none;
    for (; fork != none; fork = parts.forks[fork].parent) {
        const bool stood = below != none && parts.forks[below].wide != none;
        cut(parts, fork);
        if (stood && parts.forks[below].wide != none) fill(parts, below);
        below = fork;
    }
    if (below != none && parts.forks[below].wide != none) fill(parts, below);
    if (parts.root != none && !(parts.root & page_bit)) set_piece(parts, parts.root, true);
    show_root(parts);
}

template <int Dim, class T>
void refit(Parts<Dim, T>& parts, std::uint32_t wide_number, std::uint32_t lane, Child<Dim, T> child,
           const Aabb<Dim, T>& hull) noexcept
{
    Aabb<Dim, T> box = hull;
    while (wide_number != none) {
        Wide<Dim, T>& wide = parts.wides[wide_number];
        wide.node.child[lane] = child;
        wide.node.bounds.set(lane, box);
        const Aabb<Dim, T> whole = wide.node.bounds.hull();
        if (same(whole, wide.hull)) return;
        wide.hull = box = whole;
        child = &wide.node;
        lane = wide.lane;
        wide_number = wide.wide;
    }
    show_root(parts);
}

template <int Dim, class T>
void show_root(Parts<Dim, T>& parts) noexcept
{
    if (parts.root == none) {
        parts.root_child = {};
        std::fill_n(parts.hull.lo.begin(), Dim, std::numeric_limits<T>::infinity());
        std::fill_n(parts.hull.hi.begin(), Dim, -std::numeric_limits<T>::infinity());
    } else if (parts.root & page_bit) {
        Page<Dim, T>& page = parts.pages[parts.root & ~page_bit];
        page.wide = none;
        parts.root_child = Child<Dim, T>(&page.node);
        parts.hull = page.hull;
    } else {
        Wide<Dim, T>& wide = parts.wides[parts.forks[parts.root].wide];
        wide.wide = none;
        parts.root_child = &wide.node;
        parts.hull = wide.hull;
    }
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void set_piece(Parts<Dim, T>&, Ref, bool) noexcept;                                             \
    template void cut(Parts<Dim, T>&, std::uint32_t) noexcept;                                               \
    template void repack(Parts<Dim, T>&, std::uint32_t) noexcept;                                            \
    template void refit(Parts<Dim, T>&, std::uint32_t, std::uint32_t, Child<Dim, T>,                         \
                        const Aabb<Dim, T>&) noexcept;                                                       \
    template void show_root(Parts<Dim, T>&) noexcept;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace index
JOSTLE_NAMESPACE_END
