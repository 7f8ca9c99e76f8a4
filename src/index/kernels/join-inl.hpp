// SPDX-License-Identifier: MIT
// Finds what many boxes (askers) touch, all at once. Compiled once per instruction set, see kernels.cpp.
//
// All askers take a step down before any takes the next. The nodes to visit next are kept in a list, so they
// can be prefetched, and no branch depends on what was found. With a few askers per leaf, searching for them
// one by one would spend its time on mispredicted branches and on waiting for memory.

/// Collects touch_of(asker, leaf, lane) for everything that the askers touch in `touches`, and returns their
/// number.
template <int Dim, class T, class Item, class TouchOf>
HWY_ATTR HWY_INLINE std::size_t find_touches(Child<Dim, T> root, const Aabb<Dim, T>* askers,
                                             std::uint32_t count, JoinWork<Dim, T>& work,
                                             Buffer<Item>& touches, const TouchOf& touch_of)
{
    using Visit = typename JoinWork<Dim, T>::Visit;
    constexpr std::size_t ahead = 20, room = lanes + 4;
    std::fill_n(work.count, count, 0u);
    bool endless = false; // infinite bounds let empty lanes pass
    for (std::uint32_t a = 0; a < count; ++a)
        for (int d = 0; d < Dim; ++d)
            endless |= askers[a].lo[d] < -std::numeric_limits<T>::max() ||
                       askers[a].hi[d] > std::numeric_limits<T>::max();
    Buffer<Visit>* now = &work.nodes;
    Buffer<Visit>* then = &work.next;
    Visit* nodes = now->reserve(count + room);
    std::size_t node_count = 0, leaf_count = 0;
    for (std::uint32_t a = 0; a < count; ++a)
        nodes[node_count++] = {root, a};
    while (node_count != 0) {
        std::size_t next_count = 0;
        Visit* next = then->reserve(room);
        Visit* leaves = work.leaves.grow(leaf_count + room, leaf_count);
        for (std::size_t i = 0; i < node_count; ++i) {
            if (next_count + room > then->capacity()) next = then->grow(2 * (next_count + room), next_count);
            if (leaf_count + room > work.leaves.capacity())
                leaves = work.leaves.grow(2 * (leaf_count + room), leaf_count);
            prefetch_item(nodes[std::min(i + ahead, node_count - 1)].child.node());
            const Visit visit = nodes[i];
            const Node<Dim, T>& node = *visit.child.node();
            unsigned hits = touching(node.bounds, askers[visit.asker]);
            const bool to_leaves = node.child[0].is_leaf();
            Visit* const to = to_leaves ? leaves + leaf_count : next + next_count;
            each_lane(hits,
                      [&](unsigned k, unsigned lane) HWY_ATTR { to[k] = {node.child[lane], visit.asker}; });
            auto found = static_cast<std::size_t>(std::popcount(hits));
            if (endless) // empty lanes come last
                while (found > 0 && !to[found - 1].child)
                    --found;
            leaf_count += to_leaves ? found : 0;
            next_count += to_leaves ? 0 : found;
        }
        std::swap(now, then);
        nodes = now->data();
        node_count = next_count;
    }

    const Visit* const leaves = work.leaves.data();
    Item* items = touches.reserve(leaf_count + room);
    std::size_t touched = 0;
    for (std::size_t i = 0; i < leaf_count; ++i) {
        if (touched + room > touches.capacity()) items = touches.grow(2 * (touched + room), touched);
        prefetch_item(leaves[std::min(i + ahead, leaf_count - 1)].child.leaf());
        const Leaf<Dim, T>& leaf = *leaves[i].child.leaf();
        const std::uint32_t asker = leaves[i].asker;
        unsigned hits = touching(leaf.bounds, askers[asker]);
        if (endless) hits &= leaf.live();
        Item* const to = items + touched;
#if !JOSTLE_SIMD_PLAIN && HWY_TARGET == HWY_AVX3
        if constexpr (std::is_same_v<Item, Touch>)
            store_pairs(to, asker, leaf.id, hits);
        else
#endif
            each_lane(hits, [&](unsigned k, unsigned lane) HWY_ATTR { to[k] = touch_of(asker, leaf, lane); });
        const auto found = static_cast<std::uint32_t>(std::popcount(hits));
        touched += found;
        work.count[asker] += found;
    }
    work.touched = touched;
    return touched;
}

/// The start of the results of each asker.
HWY_INLINE void begins_of(const std::uint32_t* count_of, std::uint32_t count, std::size_t* begin)
{
    std::size_t sum = 0;
    for (std::uint32_t a = 0; a < count; ++a) {
        begin[a] = sum;
        sum += count_of[a];
    }
}

template <int Dim, class T>
HWY_ATTR void search_join(Child<Dim, T> root, const Aabb<Dim, T>* askers, std::uint32_t count,
                          JoinWork<Dim, T>& work)
{
    const std::size_t touched = find_touches(root, askers, count, work, work.touches,
                                             [](std::uint32_t asker, const Leaf<Dim, T>& leaf, unsigned lane)
                                                 HWY_ATTR { return Touch{asker, leaf.id[lane]}; });
    // By asker, and ascending: in a short list, the place of an id is the number of smaller ones.
    std::uint32_t* const ids = work.ids.reserve(2 * (touched + lanes)); // and room to sort them
    std::size_t begin[JoinWork<Dim, T>::most_askers];
    begins_of(work.count, count, begin);
    for (std::size_t k = 0; k < touched; ++k) {
        const Touch touch = work.touches.data()[k];
        ids[begin[touch.asker]++] = touch.id;
    }
    std::uint32_t* first = ids;
    for (std::uint32_t a = 0; a < count; ++a) {
        const std::uint32_t size = work.count[a];
        if (size > most_sorted / 2) {
            std::uint32_t differing = 0;
            for (std::uint32_t k = 1; k < size; ++k)
                differing |= first[k] ^ first[0];
            // For fewer ids, that many counters don't pay.
            const int digit = size < 512 ? 8 : 11;
            const std::uint32_t* const sorted = radix_sort<11>(
                first, work.ids.data() + touched + lanes, size, [](std::uint32_t id) { return id; },
                differing, digit);
            if (sorted != first) std::copy_n(sorted, size, first);
        } else if (size > 1) {
            sort_few<most_sorted>(first, size);
        }
        first += size;
    }
}

template <int Dim, class T>
HWY_ATTR void search_around(Child<Dim, T> root, const Aabb<Dim, T>* askers, std::uint32_t count,
                            JoinWork<Dim, T>& work)
{
    const std::size_t touched = find_touches(root, askers, count, work, work.touches_at,
                                             [](std::uint32_t asker, const Leaf<Dim, T>& leaf, unsigned lane)
                                                 HWY_ATTR { return TouchAt<Dim, T>{asker, lane, &leaf}; });
    Seen<Dim, T>* const seen = work.seen.reserve(touched);
    std::size_t begin[JoinWork<Dim, T>::most_askers];
    begins_of(work.count, count, begin);
    for (std::size_t k = 0; k < touched; ++k) {
        const TouchAt<Dim, T> touch = work.touches_at.data()[k];
        seen[begin[touch.asker]++] = {touch.leaf->bounds.get(touch.lane), touch.leaf->id[touch.lane]};
    }
}
