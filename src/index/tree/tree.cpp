// SPDX-License-Identifier: MIT
#include "index/tree/tree.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <utility>

#include "base/box.hpp"
#include "base/prefetch.hpp"
#include "index/tree/page.hpp"
#include "index/tree/trie.hpp"
#include "index/tree/validate.hpp"
#include "index/tree/wide.hpp"
#include "jostle/process.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

namespace {

/// A page is sorted again when this many objects were added or removed.
constexpr std::uint32_t tolerated_disorder(std::uint32_t count)
{
    return 2 + count / 32;
}

/// ... or, if all move a little in every frame, when its leaves' edges are that much longer.
constexpr double tolerated_spread = 1.125;

/// Whether a page must be sorted. If most objects that leave come back to about where they were, its leaves
/// stay about as good as they are.
template <int Dim, class T>
bool is_disordered(const Parts<Dim, T>& parts, const Page<Dim, T>& page) noexcept
{
    if (page.disorder <= tolerated_disorder(page.count)) return false;
    if (!parts.most_come_back) return true;
    return page.disorder > 4 * page.count || page.leaves > (page.count + lanes - 1) / lanes + 2 ||
           static_cast<double>(spread_of(page)) > tolerated_spread * static_cast<double>(page.spread);
}

/// An object that is moved alone costs up to this many times as much as one in a rebuild of all.
constexpr std::size_t builds_of_a_move = 10;

template <int Dim, class T>
void finish_page(Parts<Dim, T>& parts, std::uint32_t number) noexcept
{
    Page<Dim, T>& page = parts.pages[number];
    if (page.count == 0) {
        remove_page(parts, number);
        return;
    }
    // Objects arrive before others leave, so pages that were split for that may fit into one page again.
    const bool was_split = std::exchange(page.was_split, false);
    if (page.count < merge_below || was_split) {
        if (merge(parts, number, was_split ? page_capacity : merge_below)) {
            Page<Dim, T>& merged = parts.pages[number];
            refit(parts, merged.wide, merged.lane, Child<Dim, T>(&merged.node), merged.hull);
            if (merged.parent == none) show_root(parts);
            return;
        }
    }
    for (unsigned changed = page.changed; changed != 0; changed &= changed - 1) {
        const auto b = static_cast<std::uint32_t>(std::countr_zero(changed));
        page.node.bounds.set(b, parts.leaves[page.leaf[b]].bounds.hull());
    }
    if (is_disordered(parts, page)) {
        Gathered<Dim, T> objects;
        gather(parts, number, objects);
        arrange(parts, number, objects);
        ++parts.sorts;
    } else {
        for (std::uint32_t b = page.leaves; b-- > 0;) {
            if (page.live[b] != 0) continue;
            parts.leaves.give(page.leaf[b]);
            const std::uint32_t last = --page.leaves;
            page.leaf[b] = page.leaf[last];
            page.live[b] = page.live[last];
            page.node.child[b] = page.node.child[last];
            page.node.bounds.set(b, page.node.bounds.get(last));
            page.live[last] = 0;
            page.node.child[last] = {};
            page.node.bounds.clear(last);
        }
        page.changed = 0;
        page.hull = page.node.bounds.hull();
    }
    if (page.wide != none)
        refit(parts, page.wide, page.lane, Child<Dim, T>(&page.node), page.hull);
    else
        show_root(parts);
}

template <int Dim, class T>
void finish(Parts<Dim, T>& parts) noexcept
{
    for (const std::uint32_t number : parts.listed) {
        Page<Dim, T>& page = parts.pages[number];
        if (!page.listed) continue; // given back meanwhile
        page.listed = false;
        if (page.used) finish_page(parts, number);
    }
    parts.listed.clear();
}

template <int Dim, class T>
void list_below(Parts<Dim, T>& parts, Ref ref) noexcept
{
    if (ref & page_bit) {
        list(parts, ref & ~page_bit);
        return;
    }
    list_below(parts, parts.forks[ref].child[0]);
    list_below(parts, parts.forks[ref].child[1]);
}

/// Sets the boxes of a page's objects and finds its leaves' bounds. Objects that leave are marked, and stay
/// in their old places with their new boxes.
template <int Dim, class T>
void follow_page(Parts<Dim, T>& parts, Page<Dim, T>& page, const typename Tree<Dim, T>::Where& where) noexcept
{
    std::uint32_t ids[page_capacity], count = 0;
    Aabb<Dim, T> boxes[page_capacity];
    for (std::uint32_t b = 0; b < page.leaves; ++b)
        prefetch(parts.leaves[page.leaf[b]].id);
    for (std::uint32_t b = 0; b < page.leaves; ++b)
        for (unsigned live = page.live[b]; live != 0; live &= live - 1)
            ids[count++] = parts.leaves[page.leaf[b]].id[std::countr_zero(live)];
    where({ids, count}, boxes);
    const int level = page.parent == none ? -1 : parts.forks[page.parent].level;
    const Cell<Dim> cell(parts.frame, page.key, level + 1);
    count = 0;
    for (std::uint32_t b = 0; b < page.leaves; ++b) {
        Leaf<Dim, T>& leaf = parts.leaves[page.leaf[b]];
        Bounds<Dim, T> hull; // only lane 0 is used
        hull.clear(0);
        unsigned leaving = 0;
        for (unsigned live = page.live[b]; live != 0; live &= live - 1, ++count) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(live));
            const Aabb<Dim, T>& box = boxes[count];
            leaf.bounds.set(lane, box);
            if (!cell.holds(box) &&
                (box.lo[0] != box.lo[0] ||
                 first_difference(key_of(parts.frame, box, ids[count]), page.key) <= level)) {
                leaving |= 1u << lane;
                continue;
            }
            for (int d = 0; d < Dim; ++d) {
                hull.lo[d][0] = std::min(hull.lo[d][0], box.lo[d]);
                hull.hi[d][0] = std::max(hull.hi[d][0], box.hi[d]);
            }
        }
        page.node.bounds.set(b, hull.get(0));
        page.live[b] = static_cast<std::uint16_t>(page.live[b] & ~leaving);
        page.leaving[b] = static_cast<std::uint16_t>(leaving);
    }
    page.changed = 0;
    page.drifted = static_cast<double>(spread_of(page)) > tolerated_spread * static_cast<double>(page.spread);
}

/// Removes the objects that leave the listed pages. Those that still exist are listed in `leaving`.
template <int Dim, class T>
void take_out_leaving(Parts<Dim, T>& parts, std::pmr::vector<Record<Dim, T>>& leaving)
{
    leaving.clear();
    for (const std::uint32_t number : parts.listed) {
        Page<Dim, T>& page = parts.pages[number];
        for (std::uint32_t b = 0; b < page.leaves; ++b) {
            Leaf<Dim, T>& leaf = parts.leaves[page.leaf[b]];
            for (unsigned left = page.leaving[b]; left != 0; left &= left - 1) {
                const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
                const Record<Dim, T> record{leaf.bounds.get(lane), leaf.id[lane]};
                if (record.box.lo[0] == record.box.lo[0]) leaving.push_back(record);
                leaf.bounds.clear(lane);
                leaf.id[lane] = no_id;
                parts.page_of[record.id] = none;
                --page.count;
                --parts.size;
            }
        }
    }
}

/// Appends the objects of a piece of the trie that aren't marked as moved.
template <int Dim, class T>
void stay_below(const Parts<Dim, T>& parts, Ref ref, const std::pmr::vector<std::uint32_t>& moved,
                std::pmr::vector<std::uint32_t>& ids, std::pmr::vector<Aabb<Dim, T>>& boxes)
{
    if (!(ref & page_bit)) {
        stay_below(parts, parts.forks[ref].child[0], moved, ids, boxes);
        stay_below(parts, parts.forks[ref].child[1], moved, ids, boxes);
        return;
    }
    Gathered<Dim, T> objects;
    gather(parts, ref & ~page_bit, objects);
    for (std::uint32_t k = 0; k < objects.count; ++k) {
        if (moved[objects.id[k]] != none) continue;
        ids.push_back(objects.id[k]);
        boxes.push_back(objects.box(k));
    }
}

/// The number of wide nodes on the longest path down from here.
template <int Dim, class T>
std::uint64_t depth_of(const Parts<Dim, T>& parts, Ref ref) noexcept
{
    if (ref & page_bit) return 0;
    const Fork<Dim>& fork = parts.forks[ref];
    return (fork.wide != none) + std::max(depth_of(parts, fork.child[0]), depth_of(parts, fork.child[1]));
}

/// Lowers `least` to the least lower bound on an axis, or the least negated upper bound, of the objects below
/// that count.
template <int Dim, class T>
void find_least(Child<Dim, T> group, int axis, bool upper, FunctionRef<bool(std::uint32_t)> counts, T& least)
{
    const Bounds<Dim, T>& bounds = group.is_leaf() ? group.leaf()->bounds : group.node()->bounds;
    T at[lanes];
    for (std::uint32_t lane = 0; lane < lanes; ++lane)
        at[lane] = upper ? -bounds.hi[axis][lane] : bounds.lo[axis][lane];
    for (;;) {
        T* const nearest = std::min_element(at, at + lanes);
        if (!(*nearest < least)) return; // nor is any other, or an empty lane
        const auto lane = static_cast<std::size_t>(nearest - at);
        if (!group.is_leaf())
            find_least(group.node()->child[lane], axis, upper, counts, least);
        else if (counts(group.leaf()->id[lane]))
            least = *nearest + T(0); // no negative zero
        *nearest = std::numeric_limits<T>::infinity();
    }
}

/// Gives an object another box, with which it stays in its page.
template <int Dim, class T>
void replace_box(Parts<Dim, T>& parts, std::uint32_t id, const Aabb<Dim, T>& box) noexcept
{
    const std::uint32_t number = parts.page_of[id];
    Page<Dim, T>& page = parts.pages[number];
    const Place place = find(parts, number, id);
    parts.leaves[page.leaf[place.leaf]].bounds.set(place.lane, box);
    page.changed = static_cast<std::uint16_t>(page.changed | (1u << place.leaf));
    if (!inside(box, page.node.bounds.get(place.leaf))) ++page.disorder;
    list(parts, number);
}

/// Removes all objects, and keeps the memory.
template <int Dim, class T>
void empty(Parts<Dim, T>& parts) noexcept
{
    parts.page_of.clear();
    parts.listed.clear();
    parts.leaves.clear();
    parts.pages.clear();
    parts.forks.clear();
    parts.wides.clear();
    parts.root = none;
    parts.size = 0;
    parts.sorts = parts.splits = 0;
    show_root(parts);
}

/// Frees the memory of empty parts, except `page_of`.
template <int Dim, class T>
void release(Parts<Dim, T>& parts) noexcept
{
    parts.listed.shrink_to_fit();
    parts.leaves.release();
    parts.pages.release();
    parts.forks.release();
    parts.wides.release();
}

} // namespace

template <int Dim, class T>
Tree<Dim, T>::Tree(const IndexOptions& options)
    : parts_(options),
      replaced_(options),
      build_memory_(options.memory),
      leaving_(options.memory),
      arriving_(options.memory),
      staying_(options.memory),
      queues_(options.memory),
      closest_work_(options.memory)
{
    show_root(parts_);
}

template <int Dim, class T>
void Tree<Dim, T>::build(std::span<const std::uint32_t> ids, const View& boxes)
{
    std::size_t end = ids.empty() ? boxes.size() : 0;
    if (!ids.empty()) end = std::size_t{*std::max_element(ids.begin(), ids.end())} + 1;
    // A caller that builds a second time will do so again, so the memory is kept.
    const bool again = parts_.pages.bytes() != 0;
    empty(replaced_);
    replaced_.page_of.assign(end, none);
    if (!boxes.empty()) index::build(replaced_, ids, boxes, build_memory_);
    parts_.swap(replaced_);
    if (!again) build_memory_.release();
}

template <int Dim, class T>
void Tree<Dim, T>::put(std::span<const std::uint32_t> ids, const View& boxes)
{
    if (ids.empty()) return;
    if (parts_.size == 0) return build_first(ids, boxes);
    const std::size_t end_before = parts_.page_of.size();
    make_room_for(*std::max_element(ids.begin(), ids.end()));
    if (ids.size() > page_capacity && ids.size() * builds_of_a_move >= parts_.size &&
        std::all_of(ids.begin(), ids.end(), [this](std::uint32_t id) { return contains(id); })) {
        build_moved(ids, boxes);
        return;
    }
    arriving_.clear();
    try {
        plan(ids, boxes);
    } catch (...) {
        for (const std::uint32_t i : arriving_)
            remove_one(parts_, descend(parts_, key_of(parts_.frame, boxes[i], ids[i])), ids[i]);
        finish(parts_);
        parts_.page_of.resize(end_before, none);
        throw;
    }
    // Nothing can fail from here on.
    for (const std::uint32_t i : arriving_) {
        std::uint32_t& page = parts_.page_of[ids[i]];
        if (page != none) remove_one(parts_, page, ids[i]);
        page = descend(parts_, key_of(parts_.frame, boxes[i], ids[i]));
    }
    constexpr std::size_t ahead = 4; // how early the ids of a page are fetched, to look up an object
    for (std::size_t k = 0; k < staying_.size(); ++k) {
        if (k + ahead < staying_.size()) {
            const Page<Dim, T>& page = parts_.pages[parts_.page_of[ids[staying_[k + ahead]]]];
            for (std::uint32_t b = 0; b < page.leaves; ++b)
                prefetch(parts_.leaves[page.leaf[b]].id);
        }
        replace_box(parts_, ids[staying_[k]], boxes[staying_[k]]);
    }
    finish(parts_);
}

template <int Dim, class T>
void Tree<Dim, T>::build_first(std::span<const std::uint32_t> ids, const View& boxes)
{
    const bool again = parts_.pages.bytes() != 0;
    const std::size_t end_before = parts_.page_of.size();
    try {
        make_room_for(*std::max_element(ids.begin(), ids.end()));
        index::build(parts_, ids, boxes, build_memory_);
    } catch (...) {
        clear();
        parts_.page_of.resize(end_before, none);
        throw;
    }
    if (!again) build_memory_.release();
}

template <int Dim, class T>
void Tree<Dim, T>::make_room_for(std::uint32_t id)
{
    // 1.5 times as many for ids that are added one by one, nothing extra for one far beyond.
    const std::size_t before = parts_.page_of.size(), end = std::max(before, std::size_t{id} + 1);
    if (parts_.page_of.capacity() < end) parts_.page_of.reserve(std::max(end, before + before / 2));
    parts_.page_of.resize(end, none);
}

template <int Dim, class T>
void Tree<Dim, T>::plan(std::span<const std::uint32_t> ids, const View& boxes)
{
    arriving_.reserve(ids.size());
    staying_.resize(ids.size());
    std::iota(staying_.begin(), staying_.end(), 0u);
    std::uint64_t splits;
    do {
        splits = parts_.splits;
        std::size_t stay = 0;
        for (std::size_t k = 0; k < staying_.size(); ++k) {
            constexpr std::size_t ahead = 8;
            if (k + ahead < staying_.size()) {
                const std::uint32_t page = parts_.page_of[ids[staying_[k + ahead]]];
                if (page != none) prefetch(&parts_.pages[page].parent);
            }
            const std::uint32_t i = staying_[k], from = parts_.page_of[ids[i]];
            const Aabb<Dim, T> box = boxes[i];
            const Key<Dim> key = key_of(parts_.frame, box, ids[i]);
            if (from != none && is_in(parts_, parts_.pages[from], key)) {
                staying_[stay++] = i;
                continue;
            }
            index::put(parts_, make_room(parts_, key), ids[i], box);
            arriving_.push_back(i);
        }
        staying_.resize(stay);
    } while (parts_.splits != splits && !staying_.empty()); // a page that is split covers less space
}

template <int Dim, class T>
void Tree<Dim, T>::erase(std::span<const std::uint32_t> ids) noexcept
{
    for (const std::uint32_t id : ids) {
        remove_one(parts_, parts_.page_of[id], id);
        parts_.page_of[id] = none;
    }
    finish(parts_);
}

template <int Dim, class T>
void Tree<Dim, T>::build_moved(std::span<const std::uint32_t> ids, const View& boxes)
{
    const std::uint64_t sorts = parts_.sorts, splits = parts_.splits;
    if (ids.size() == parts_.size) {
        build(ids, boxes);
    } else {
        std::pmr::vector<std::uint32_t> all_ids(parts_.memory);
        std::pmr::vector<Box> all_boxes(parts_.memory);
        all_ids.reserve(parts_.size);
        all_boxes.reserve(parts_.size);
        std::pmr::vector<std::uint32_t>& moved = replaced_.page_of;
        moved.assign(parts_.page_of.size(), none);
        for (const std::uint32_t id : ids)
            moved[id] = 0;
        stay_below(parts_, parts_.root, moved, all_ids, all_boxes);
        for (std::size_t i = 0; i < ids.size(); ++i) {
            all_ids.push_back(ids[i]);
            all_boxes.push_back(boxes[i]);
        }
        build(all_ids, View(all_boxes));
    }
    parts_.sorts += sorts;
    parts_.splits += splits;
}

template <int Dim, class T>
bool Tree<Dim, T>::follow(const Where& where)
{
    if (parts_.root == none) return false;
    try {
        list_below(parts_, parts_.root);
        const ProcessOptions few_pages{parts_.executor, 8};
        const auto each_page = [&](const auto& body) {
            process_items(
                parts_.listed.size(),
                [&](std::uint64_t begin, std::uint64_t end, Work) {
                    for (std::size_t k = begin; k < end; ++k)
                        body(parts_.listed[k], parts_.pages[parts_.listed[k]]);
                },
                few_pages);
        };
        each_page([&](std::uint32_t, Page<Dim, T>& page) { follow_page(parts_, page, where); });

        const std::size_t size_before = parts_.size;
        take_out_leaving(parts_, leaving_);
        // An object that changes its page costs three times as much as one in a rebuild.
        if ((size_before - parts_.size) * 3 > size_before) {
            clear();
            return false;
        }
        // A page that needs fewer leaves gives some back, which several threads must not do.
        each_page([&](std::uint32_t number, Page<Dim, T>& page) {
            if (!page.drifted || page.leaves != (page.count + lanes - 1) / lanes) return;
            Gathered<Dim, T> objects;
            gather(parts_, number, objects);
            arrange(parts_, number, objects);
        });
        for (const Record<Dim, T>& record : leaving_) {
            const std::uint32_t page = make_room(parts_, key_of(parts_.frame, record.box, record.id));
            index::put(parts_, page, record.id, record.box);
            parts_.page_of[record.id] = page;
        }
        for (const std::uint32_t number : parts_.listed) {
            // New objects were put where they enlarge the leaves least; the next call tests whether that is
            // good enough.
            Page<Dim, T>& page = parts_.pages[number];
            page.disorder = page.drifted ? page_capacity : 0;
        }
        finish(parts_);
    } catch (...) {
        clear();
        throw;
    }
    return true;
}

template <int Dim, class T>
void Tree<Dim, T>::clear() noexcept
{
    const std::uint64_t sorts = parts_.sorts, splits = parts_.splits;
    empty(parts_);
    parts_.sorts = sorts;
    parts_.splits = splits;
}

template <int Dim, class T>
void Tree<Dim, T>::release_memory() noexcept
{
    queues_.release_memory();
    closest_work_.release_memory();
    build_memory_.release();
    empty(replaced_);
    release(replaced_);
    replaced_.page_of.shrink_to_fit();
    while (!parts_.page_of.empty() && parts_.page_of.back() == none)
        parts_.page_of.pop_back();
    parts_.page_of.shrink_to_fit();
    if (parts_.size != 0) return;
    release(parts_);
    leaving_.clear();
    leaving_.shrink_to_fit();
    arriving_.clear();
    arriving_.shrink_to_fit();
    staying_.clear();
    staying_.shrink_to_fit();
}

template <int Dim, class T>
auto Tree<Dim, T>::box(std::uint32_t id) const noexcept -> Box
{
    const std::uint32_t number = parts_.page_of[id];
    const Place place = find(parts_, number, id);
    return parts_.leaves[parts_.pages[number].leaf[place.leaf]].bounds.get(place.lane);
}

template <int Dim, class T>
auto Tree<Dim, T>::hull_of(FunctionRef<bool(std::uint32_t id)> counts) const -> Box
{
    Box all;
    for (int d = 0; d < Dim; ++d) {
        all.lo[d] = all.hi[d] = std::numeric_limits<T>::infinity();
        if (root()) find_least(root(), d, false, counts, all.lo[d]);
        if (root()) find_least(root(), d, true, counts, all.hi[d]);
        all.hi[d] = -all.hi[d];
    }
    return all;
}

template <int Dim, class T>
IndexStats Tree<Dim, T>::stats() const noexcept
{
    IndexStats stats;
    stats.objects = parts_.size;
    stats.pages = parts_.pages.in_use();
    stats.leaves = parts_.leaves.in_use();
    stats.nodes = parts_.wides.in_use();
    stats.depth = parts_.root == none ? 0 : depth_of(parts_, parts_.root);
    stats.sorts = parts_.sorts;
    stats.splits = parts_.splits;
    stats.bytes = parts_.bytes() + replaced_.bytes() + build_memory_.bytes() +
                  leaving_.capacity() * sizeof(Record<Dim, T>) +
                  arriving_.capacity() * sizeof(std::uint32_t) + staying_.capacity() * sizeof(std::uint32_t) +
                  queues_.bytes() + closest_work_.bytes();
    return stats;
}

template <int Dim, class T>
const char* Tree<Dim, T>::validate() const
{
    return index::validate(parts_);
}

template class Tree<2, float>;
template class Tree<2, double>;
template class Tree<3, float>;
template class Tree<3, double>;

} // namespace index
JOSTLE_NAMESPACE_END
