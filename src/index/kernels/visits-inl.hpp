// SPDX-License-Identifier: MIT
// Visits hits one by one, in order. Compiled once per instruction set, see kernels.cpp.

/// The order of opened nodes; among equally near objects, the least id comes first.
struct NextLane
{
    std::uint32_t rank, lane;
};
template <int Dim, class T>
HWY_ATTR HWY_INLINE NextLane next_lane(const Opened<Dim, T>& opened, T nearest)
{
    unsigned near = lanes_at(opened.at, nearest, opened.left);
    if (!opened.group.is_leaf()) return {0, static_cast<std::uint32_t>(std::countr_zero(near))};
    const std::uint32_t* const id = opened.group.leaf()->id;
    auto lane = static_cast<std::uint32_t>(std::countr_zero(near));
    for (near &= near - 1; near != 0; near &= near - 1) {
        const auto other = static_cast<std::uint32_t>(std::countr_zero(near));
        if (id[other] < id[lane]) lane = other;
    }
    return {id[lane] + 1, lane};
}

/// Visits what passes enter(bounds, limit, at), ascending by (at, id). `enter` returns the lanes no further
/// than the limit and stores their distances, infinity for the others. Opened nodes wait in a priority queue,
/// so no node further than the last answer is opened.
template <int Dim, class T, class Enter>
HWY_ATTR HWY_INLINE bool visit_in_order(std::span<const Child<Dim, T>> roots, T limit, Wanted wanted,
                                        HitVisitor<T> visit, QueueShelf<Dim, T>& shelf, const Enter& enter)
{
    Queue<Dim, T> queue(shelf);
    const auto open = [&](Child<Dim, T> group) HWY_ATTR {
        Opened<Dim, T>& opened = queue.room();
        opened.group = group;
        if (group.is_leaf())
            opened.left = enter(group.leaf()->bounds, limit, opened.at) & group.leaf()->live();
        else
            opened.left = enter(group.node()->bounds, limit, opened.at);
        if (opened.left == 0) return;
        const T nearest = nearest_of(opened.at);
        queue.add(nearest, next_lane(opened, nearest).rank);
    };
    for (const Child<Dim, T> root : roots)
        open(root);
    while (!queue.empty()) {
        const T at = queue.first().at;
        if (at > limit) break;
        Opened<Dim, T>& opened = queue.opened();
        const std::uint32_t lane = next_lane(opened, at).lane;
        const Child<Dim, T> group = opened.group;
        opened.left &= ~(1u << lane);
        opened.at[lane] = std::numeric_limits<T>::infinity();
        if (opened.left == 0) {
            queue.remove();
        } else {
            const T nearest = nearest_of(opened.at);
            queue.put_off(nearest, next_lane(opened, nearest).rank);
        }
        if (!group.is_leaf()) {
            // Infinite bounds may let empty lanes pass.
            if (const Child<Dim, T> child = group.node()->child[lane]) open(child);
            continue;
        }
        const Hit<T> hit{group.leaf()->id[lane], at + T(0)}; // no negative zero
        if (wanted && !wanted(hit.id)) continue;
        if (!visit(hit, limit)) return false;
    }
    return true;
}

template <int Dim, class T>
HWY_ATTR bool visit_line(std::span<const Child<Dim, T>> roots, const Line<Dim, T>& line, Wanted wanted,
                         HitVisitor<T> visit, QueueShelf<Dim, T>& shelf)
{
    const LineTest<Dim, T> test(line);
    return visit_in_order<Dim, T>(roots, line.max_fraction, wanted, visit, shelf,
                                  [&](const Bounds<Dim, T>& bounds, T last, T* at)
                                      HWY_ATTR { return test.meet(bounds, last, at); });
}

template <int Dim, class T>
HWY_ATTR bool visit_near(std::span<const Child<Dim, T>> roots, const Aabb<Dim, T>& from, T limit,
                         Wanted wanted, HitVisitor<T> visit, QueueShelf<Dim, T>& shelf)
{
    return visit_in_order<Dim, T>(roots, limit, wanted, visit, shelf,
                                  [&](const Bounds<Dim, T>& bounds, T last, T* at)
                                      HWY_ATTR { return within<Dim, T>(bounds, from, last, at); });
}
