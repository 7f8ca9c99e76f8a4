// SPDX-License-Identifier: MIT
#include "index/tree/trie.hpp"

#include <algorithm>

#include "base/instantiate.hpp"
#include "index/tree/page.hpp"
#include "index/tree/wide.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {
namespace {

template <int Dim, class T>
void set_parent(Parts<Dim, T>& parts, Ref ref, std::uint32_t parent) noexcept
{
    if (ref & page_bit)
        parts.pages[ref & ~page_bit].parent = parent;
    else
        parts.forks[ref].parent = parent;
}

template <int Dim, class T>
void replace(Parts<Dim, T>& parts, std::uint32_t parent, Ref before, Ref after) noexcept
{
    if (parent == none) {
        parts.root = after;
    } else {
        Fork<Dim>& fork = parts.forks[parent];
        fork.child[fork.child[0] == before ? 0 : 1] = after;
    }
    if (after != none) set_parent(parts, after, parent);
}

/// Puts a fork where `before` is, with the page `fresh` on the given side and `before` on the other.
template <int Dim, class T>
void add_fork(Parts<Dim, T>& parts, std::uint32_t parent, Ref before, int level, unsigned side,
              std::uint32_t fresh, const Key<Dim>& key) noexcept
{
    const std::uint32_t number = parts.forks.take();
    Fork<Dim>& fork = parts.forks[number];
    fork.level = level;
    fork.wide = none;
    fork.key = key;
    replace(parts, parent, before, number);
    fork.child[side] = fresh | page_bit;
    fork.child[1 - side] = before;
    set_parent(parts, fork.child[0], number);
    set_parent(parts, fork.child[1], number);
    repack(parts, number);
}

template <int Dim, class T>
void split(Parts<Dim, T>& parts, std::uint32_t number) noexcept
{
    Gathered<Dim, T> all, stay, go;
    gather(parts, number, all);
    Key<Dim> keys[page_capacity];
    keys[0] = key_of(parts.frame, all.box(0), all.id[0]);
    int level = key_digits<Dim>;
    for (std::uint32_t k = 1; k < all.count; ++k) {
        keys[k] = key_of(parts.frame, all.box(k), all.id[k]);
        level = std::min(level, first_difference(keys[k], keys[0]));
    }
    Key<Dim> key_stay = keys[0], key_go = keys[0];
    for (std::uint32_t k = 0; k < all.count; ++k) {
        const bool stays = digit_of(keys[k], level) == 0;
        (stays ? key_stay : key_go) = keys[k];
        (stays ? stay : go).add(all.box(k), all.id[k]);
    }
    const std::uint32_t fresh = new_page(parts, key_go);
    parts.pages[number].key = key_stay;
    arrange(parts, number, stay);
    arrange(parts, fresh, go);
    parts.sorts += 2;
    for (std::uint32_t k = 0; k < go.count; ++k)
        if (parts.page_of[go.id[k]] == number) parts.page_of[go.id[k]] = fresh; // else it only arrives here
    for (const std::uint32_t half : {number, fresh}) {
        parts.pages[half].was_split = true;
        list(parts, half);
    }
    ++parts.splits;
    add_fork(parts, parts.pages[number].parent, number | page_bit, level, 1, fresh, keys[0]);
}

} // namespace

template <int Dim, class T>
std::uint32_t descend(const Parts<Dim, T>& parts, const Key<Dim>& key) noexcept
{
    Ref ref = parts.root;
    while (!(ref & page_bit)) {
        const Fork<Dim>& fork = parts.forks[ref];
        ref = fork.child[digit_of(key, fork.level)];
    }
    return ref & ~page_bit;
}

template <int Dim, class T>
std::uint32_t make_room(Parts<Dim, T>& parts, const Key<Dim>& key)
{
    for (;;) {
        std::size_t way = 0;
        const std::uint32_t number = parts.root == none ? none : descend(parts, key);
        if (number != none)
            for (std::uint32_t fork = parts.pages[number].parent; fork != none;
                 fork = parts.forks[fork].parent)
                ++way;
        // Nothing below can fail.
        parts.leaves.reserve(2 * lanes + 2);
        parts.forks.reserve(1);
        parts.wides.reserve(2 * way + 4);
        reserve_page(parts);

        if (number == none) {
            const std::uint32_t fresh = new_page(parts, key);
            parts.root = fresh | page_bit;
            return fresh;
        }
        Page<Dim, T>& page = parts.pages[number];
        if (is_in(parts, page, key)) {
            if (page.count < page_capacity) return number;
            split(parts, number);
            continue;
        }
        const int level = first_difference(key, page.key);
        // It is outside the page's space: it becomes a new side of some fork above.
        std::uint32_t below = page.parent;
        while (parts.forks[below].parent != none && parts.forks[parts.forks[below].parent].level > level)
            below = parts.forks[below].parent;
        const std::uint32_t fresh = new_page(parts, key);
        add_fork(parts, parts.forks[below].parent, below, level, digit_of(key, level), fresh, key);
        return fresh;
    }
}

template <int Dim, class T>
void remove_page(Parts<Dim, T>& parts, std::uint32_t number) noexcept
{
    const std::uint32_t parent = parts.pages[number].parent;
    give_page(parts, number);
    if (parent == none) {
        parts.root = none;
        show_root(parts);
        return;
    }
    const Fork<Dim>& fork = parts.forks[parent];
    const Ref sibling = fork.child[fork.child[0] == (number | page_bit) ? 1 : 0];
    const std::uint32_t above = fork.parent;
    if (fork.wide != none) parts.wides.give(fork.wide);
    replace(parts, above, parent, sibling);
    parts.forks.give(parent);
    repack(parts, above);
}

template <int Dim, class T>
bool merge(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t most) noexcept
{
    const std::uint32_t parent = parts.pages[number].parent;
    if (parent == none) return false;
    const Fork<Dim>& fork = parts.forks[parent];
    const Ref sibling = fork.child[fork.child[0] == (number | page_bit) ? 1 : 0];
    if (!(sibling & page_bit)) return false;
    const std::uint32_t other = sibling & ~page_bit;
    if (parts.pages[number].count + parts.pages[other].count > most) return false;
    Gathered<Dim, T> objects;
    gather(parts, number, objects);
    const std::uint32_t own = objects.count;
    gather(parts, other, objects);
    // There are enough leaves: those of the other are given back first.
    Page<Dim, T>& gone = parts.pages[other];
    while (gone.leaves > 0)
        parts.leaves.give(gone.leaf[--gone.leaves]);
    gone.count = 0;
    arrange(parts, number, objects);
    ++parts.sorts;
    for (std::uint32_t k = own; k < objects.count; ++k)
        parts.page_of[objects.id[k]] = number;
    remove_page(parts, other);
    return true;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template std::uint32_t descend(const Parts<Dim, T>& parts, const Key<Dim>& key) noexcept;                \
    template std::uint32_t make_room(Parts<Dim, T>& parts, const Key<Dim>& key);                             \
    template void remove_page(Parts<Dim, T>& parts, std::uint32_t number) noexcept;                          \
    template bool merge(Parts<Dim, T>& parts, std::uint32_t number, std::uint32_t most) noexcept;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace index
JOSTLE_NAMESPACE_END
