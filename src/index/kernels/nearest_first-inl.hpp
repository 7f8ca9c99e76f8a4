// SPDX-License-Identifier: MIT
// The first hit of a line, and the nearest objects. The nearest node is opened first, so most of the tree is
// never examined. Compiled once per instruction set, see kernels.cpp.

/// A search for what is nearest: for each node on the path, the lanes yet to visit and their distances. The
/// nearest is chosen only when it is needed; by then most of the others are too far.
template <int Dim, class T>
struct Nearing
{
    const Node<Dim, T>* node;
    unsigned left;
    alignas(64) T at[lanes]; // infinite for lanes not left, while any are left

    /// Removes and returns the nearest lane left, if it is no further than `last`.
    HWY_ATTR HWY_INLINE Child<Dim, T> next(T last)
    {
        if ((left & (left - 1)) == 0) { // the only one, in about half of the cases
            const int lane = std::countr_zero(left);
            left = 0;
            return at[lane] <= last ? node->child[lane] : Child<Dim, T>();
        }
        const T nearest = nearest_of(at);
        if (nearest > last) {
            left = 0;
            return {};
        }
        // Of several equally near lanes the last: the keys begin with the size class, and big boxes end a
        // search.
        const int lane = static_cast<int>(std::bit_width(lanes_at(at, nearest, left))) - 1;
        left &= ~(1u << lane);
        at[lane] = std::numeric_limits<T>::infinity();
        return node->child[lane];
    }
};

/// Visits leaves in the order of their nodes' distance. enter(node's bounds, at) returns the lanes in reach
/// and stores their distances, infinity for the others; nothing beyond `last` is wanted.
template <int Dim, class T, class Enter, class Visit>
HWY_ATTR HWY_INLINE void search_nearing(Child<Dim, T> root, const T& last, const Enter& enter,
                                        const Visit& visit)
{
    if (!root) return;
    Nearing<Dim, T> way[key_digits<Dim> + 2];
    int depth = 0;
    way[0].node = root.node();
    way[0].left = enter(root.node()->bounds, way[0].at);
    while (depth >= 0) {
        Nearing<Dim, T>& here = way[depth];
        if (here.left == 0) {
            --depth;
            continue;
        }
        const Child<Dim, T> child = here.next(last);
        if (!child) continue;
        if (child.is_leaf()) {
            visit(*child.leaf());
        } else {
            Nearing<Dim, T>& below = way[++depth];
            below.node = child.node();
            below.left = enter(below.node->bounds, below.at);
        }
    }
}

template <int Dim, class T>
HWY_ATTR Hit<T> search_first(Child<Dim, T> root, const Line<Dim, T>& line, Wanted wanted)
{
    const LineTest<Dim, T> test(line);
    Hit<T> best;
    T last = line.max_fraction;
    alignas(64) T at[lanes];
    const auto visit = [&](const Leaf<Dim, T>& leaf) HWY_ATTR {
        for (unsigned hits = test.meet(leaf.bounds, last, at); hits != 0; hits &= hits - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(hits));
            const Hit<T> hit{leaf.id[lane], at[lane] + T(0)}; // no negative zero
            if (hit.id == no_id || !(best.id == no_id || hit < best)) continue;
            if (wanted && !wanted(hit.id)) continue;
            best = hit;
            last = hit.at;
        }
    };
    search_nearing<Dim, T>(
        root, last,
        [&](const Bounds<Dim, T>& bounds, T* when) HWY_ATTR { return test.meet(bounds, last, when); }, visit);
    return best;
}

template <int Dim, class T>
HWY_ATTR void search_nearest(Child<Dim, T> root, const Aabb<Dim, T>& from, Wanted wanted, Best<T>& best)
{
    alignas(64) T at[lanes];
    const auto reach = [&](const Bounds<Dim, T>& bounds, T* far)
                           HWY_ATTR { return within<Dim, T>(bounds, from, best.limit, far); };
    const auto visit = [&](const Leaf<Dim, T>& leaf) HWY_ATTR {
        for (unsigned hits = reach(leaf.bounds, at); hits != 0; hits &= hits - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(hits));
            const Hit<T> hit{leaf.id[lane], at[lane]};
            if (hit.id == no_id) continue;
            if (best.size == best.wanted && !(hit < best.heap[0])) continue;
            if (wanted && !wanted(hit.id)) continue;
            if (best.size == best.wanted) {
                std::pop_heap(best.heap, best.heap + best.size);
                best.heap[best.size - 1] = hit;
            } else {
                best.heap[best.size++] = hit;
            }
            std::push_heap(best.heap, best.heap + best.size);
            if (best.size == best.wanted) best.limit = best.heap[0].at;
        }
    };
    if (best.wanted != 0) search_nearing<Dim, T>(root, best.limit, reach, visit);
}
