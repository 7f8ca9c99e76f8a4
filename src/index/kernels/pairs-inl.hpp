// SPDX-License-Identifier: MIT
// Pairs of objects of one or two trees, found by descending both at once. Compiled once per instruction set,
// see kernels.cpp.

/// The non-empty lanes of a leaf or node.
template <int Dim, class T>
HWY_ATTR HWY_INLINE unsigned lanes_in_use(Child<Dim, T> group)
{
    if (group.is_leaf()) return group.leaf()->live();
    unsigned bits = 0;
    for (std::uint32_t lane = 0; lane < lanes; ++lane)
        bits |= static_cast<unsigned>(static_cast<bool>(group.node()->child[lane])) << lane;
    return bits;
}
template <int Dim, class T>
HWY_INLINE const Bounds<Dim, T>& bounds_of(Child<Dim, T> group)
{
    return group.is_leaf() ? group.leaf()->bounds : group.node()->bounds;
}
template <int Dim, class T>
HWY_INLINE Side<Dim, T> side_below(const Side<Dim, T>& side, std::uint32_t lane)
{
    return {side.group.node()->child[lane], side.group.node(), lane};
}
template <int Dim, class T>
HWY_INLINE Aabb<Dim, T> hull_of(const Side<Dim, T>& side)
{
    return side.above != nullptr ? side.above->bounds.get(side.lane) : bounds_of(side.group).hull();
}
/// The lanes from this one on, to find each pair of a group with itself once.
HWY_INLINE unsigned from_lane(std::uint32_t lane)
{
    return ~0u << lane;
}

/// Like `within`, but this box may be infinite, like those of the lanes: infinity minus infinity is no gap.
template <int Dim, class T>
HWY_ATTR HWY_INLINE unsigned apart(const Bounds<Dim, T>& bounds, const Aabb<Dim, T>& from, T limit, T* far)
{
    unsigned bits = 0;
    const Vec<T> zero = Vec<T>(0);
    for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
        Vec<T> sum = zero;
        for (int d = 0; d < Dim; ++d) {
            const Vec<T> below = Vec<T>::load(bounds.lo[d] + k) - Vec<T>(from.hi[d]);
            const Vec<T> above = Vec<T>(from.lo[d]) - Vec<T>::load(bounds.hi[d] + k);
            const Vec<T> gap = choose(zero < below, below, choose(zero < above, above, zero));
            sum = sum + gap * gap;
        }
        sum.store(far + k);
        bits |= mask_bits(sum <= Vec<T>(limit)) << k;
    }
    return bits;
}

/// Lanes that touch a box, or whose squared distance from it is 0, which may be an underflow.
template <bool by_distance, int Dim, class T>
HWY_ATTR HWY_INLINE unsigned beside(const Bounds<Dim, T>& bounds, const Aabb<Dim, T>& box)
{
    if constexpr (!by_distance) return touching(bounds, box);
    alignas(64) T far[lanes];
    return apart<Dim, T>(bounds, box, 0, far);
}

/// The state of a search for pairs in the lanes of two groups, row by row. A row is a lane of a. If only one
/// of the two is opened (a leaf isn't, beside a node), the other counts as one lane.
template <int Dim, class T>
struct PairWay
{
    Side<Dim, T> a, b;
    unsigned rows, hits; // of a: yet to begin; of b: yet to visit in the current row
    std::uint32_t row;
};

/// Visits all pairs that touch, or those at distance 0. Returns false if the visitor stopped it.
template <bool by_distance, int Dim, class T>
HWY_ATTR bool visit_touching(std::span<const Roots<Dim, T>> roots, PairVisitor visit)
{
    PairWay<Dim, T> way[2 * key_digits<Dim> + 4];
    int depth = -1;
    const auto enter = [&](const Side<Dim, T>& a, const Side<Dim, T>& b) HWY_ATTR {
        PairWay<Dim, T>& here = way[++depth];
        here.a = a;
        here.b = b;
        here.hits = 0;
        here.row = 0;
        if (!a.group.is_leaf() || b.group.is_leaf())
            here.rows = a.group == b.group
                            ? lanes_in_use(a.group)
                            : beside<by_distance>(bounds_of(a.group), hull_of(b)) & lanes_in_use(a.group);
        else
            here.rows = 1; // a leaf beside a node: the leaf waits
    };
    for (const Roots<Dim, T>& root : roots) {
        if (!root.a || !root.b) continue;
        enter({root.a, nullptr, 0}, {root.b, nullptr, 0});
        while (depth >= 0) {
            PairWay<Dim, T>& here = way[depth];
            const bool a_is_leaf = here.a.group.is_leaf(), b_is_leaf = here.b.group.is_leaf();
            if (here.hits == 0) {
                if (here.rows == 0) {
                    --depth;
                    continue;
                }
                here.row = static_cast<std::uint32_t>(std::countr_zero(here.rows));
                here.rows &= here.rows - 1;
                if (a_is_leaf == b_is_leaf) {
                    here.hits =
                        beside<by_distance>(bounds_of(here.b.group), bounds_of(here.a.group).get(here.row)) &
                        lanes_in_use(here.b.group);
                    if (here.a.group == here.b.group) here.hits &= from_lane(here.row + (a_is_leaf ? 1 : 0));
                } else if (a_is_leaf) {
                    here.hits = beside<by_distance>(here.b.group.node()->bounds, hull_of(here.a)) &
                                lanes_in_use(here.b.group);
                } else {
                    here.hits = 1; // a row touches the whole leaf
                }
                continue;
            }
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(here.hits));
            here.hits &= here.hits - 1;
            if (!a_is_leaf || !b_is_leaf) {
                enter(a_is_leaf ? here.a : side_below(here.a, here.row),
                      b_is_leaf ? here.b : side_below(here.b, lane));
                continue;
            }
            std::uint32_t a = here.a.group.leaf()->id[here.row], b = here.b.group.leaf()->id[lane];
            if (root.wanted && !root.wanted(a, b)) continue;
            if (root.same_set && b < a) std::swap(a, b);
            if (!visit(a, b)) return false;
        }
    }
    return true;
}

/// Finds the closest pairs. Depth first, the nearest first; what is further than the worst of as many pairs
/// as are wanted isn't visited.
template <int Dim, class T>
HWY_ATTR void find_closest(std::span<const Roots<Dim, T>> roots, ClosestAsked<T> asked,
                           ClosestWork<Dim, T>& work)
{
    // No two compared elements have both lanes in common.
    const auto later = [](const Two<Dim, T>& x, const Two<Dim, T>& y) {
        if (x.at != y.at) return x.at > y.at;
        return x.a.lane != y.a.lane ? x.a.lane > y.a.lane : x.b.lane > y.b.lane;
    };
    constexpr std::size_t most_at_once = std::size_t{lanes} * lanes;
    PairHit<T>* const best = work.best.reserve(asked.wanted);
    std::size_t found = 0, size = 0;
    T limit = asked.limit;
    alignas(64) T at[lanes];
    const auto push = [&](T far, const Side<Dim, T>& a, const Side<Dim, T>& b)
                          HWY_ATTR { work.twos.data()[size++] = {far, a, b}; };
    const auto take = [&](const Roots<Dim, T>& root, std::uint32_t a, std::uint32_t b, T far) {
        const bool turned = root.same_set && b < a;
        const PairHit<T> hit{turned ? b : a, turned ? a : b, far};
        if (!(asked.after < hit) || (found == asked.wanted && !(hit < best[0]))) return;
        if (root.wanted && !root.wanted(a, b)) return;
        if (found == asked.wanted) std::pop_heap(best, best + found--);
        best[found++] = hit;
        std::push_heap(best, best + found);
        if (found == asked.wanted) limit = best[0].at;
    };
    for (const Roots<Dim, T>& root : roots) {
        if (!root.a || !root.b) continue;
        work.twos.grow(size + 1, size);
        push(0, {root.a, nullptr, 0}, {root.b, nullptr, 0});
        while (size != 0) {
            const Two<Dim, T> two = work.twos.data()[--size];
            if (two.at > limit) continue;
            const Child<Dim, T> a = two.a.group, b = two.b.group;
            if (a.is_leaf() && b.is_leaf()) {
                unsigned rows = a.leaf()->live();
                if (a != b) rows &= apart<Dim, T>(a.leaf()->bounds, hull_of(two.b), limit, at);
                const unsigned live = b.leaf()->live();
                for (; rows != 0; rows &= rows - 1) {
                    const auto row = static_cast<std::uint32_t>(std::countr_zero(rows));
                    unsigned near =
                        apart<Dim, T>(b.leaf()->bounds, a.leaf()->bounds.get(row), limit, at) & live;
                    if (a == b) near &= from_lane(row + 1);
                    for (; near != 0; near &= near - 1) {
                        const auto lane = static_cast<std::uint32_t>(std::countr_zero(near));
                        if (!(at[lane] > 0)) continue; // those were visited first
                        take(root, a.leaf()->id[row], b.leaf()->id[lane], at[lane]);
                    }
                }
                continue;
            }
            work.twos.grow(size + most_at_once, size);
            const std::size_t before = size;
            if (a.is_leaf() || b.is_leaf()) {
                const Side<Dim, T>& node = a.is_leaf() ? two.b : two.a;
                unsigned near = apart<Dim, T>(node.group.node()->bounds, hull_of(a.is_leaf() ? two.a : two.b),
                                              limit, at) &
                                lanes_in_use(node.group);
                for (; near != 0; near &= near - 1) {
                    const auto lane = static_cast<std::uint32_t>(std::countr_zero(near));
                    if (a.is_leaf())
                        push(at[lane], two.a, side_below(two.b, lane));
                    else
                        push(at[lane], side_below(two.a, lane), two.b);
                }
            } else {
                unsigned rows = lanes_in_use(a);
                if (a != b) rows &= apart<Dim, T>(a.node()->bounds, hull_of(two.b), limit, at);
                const unsigned in_use = lanes_in_use(b);
                for (; rows != 0; rows &= rows - 1) {
                    const auto row = static_cast<std::uint32_t>(std::countr_zero(rows));
                    unsigned near =
                        apart<Dim, T>(b.node()->bounds, a.node()->bounds.get(row), limit, at) & in_use;
                    if (a == b) near &= from_lane(row);
                    for (; near != 0; near &= near - 1) {
                        const auto lane = static_cast<std::uint32_t>(std::countr_zero(near));
                        push(at[lane], side_below(two.a, row), side_below(two.b, lane));
                    }
                }
            }
            std::sort(work.twos.data() + before, work.twos.data() + size, later);
        }
    }
    std::sort_heap(best, best + found);
    work.found = found;
}
