// SPDX-License-Identifier: MIT
// The searches, written once and compiled once per instruction set: see kernels.cpp. No include guard, on
// purpose.
//
// Every test is monotone in the bounds, rounding included: what holds for a box holds for every box around
// it. So the bounds of a node are tested with the very arithmetic that defines the answer for an object, and
// nothing is missed for lack of a tolerance.

/// ---- Regions -------------------------------------------------------------------------------------------

/// Lanes that touch a box.
template <int Dim, class T>
HWY_ATTR HWY_INLINE unsigned touching(const Bounds<Dim, T>& bounds, const Aabb<Dim, T>& box)
{
    unsigned bits = 0;
    for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
        auto mask = both(Vec<T>::load(bounds.lo[0] + k) <= Vec<T>::set(box.hi[0]),
                         Vec<T>::set(box.lo[0]) <= Vec<T>::load(bounds.hi[0] + k));
        for (int d = 1; d < Dim; ++d) {
            mask = both(mask, Vec<T>::load(bounds.lo[d] + k) <= Vec<T>::set(box.hi[d]));
            mask = both(mask, Vec<T>::set(box.lo[d]) <= Vec<T>::load(bounds.hi[d] + k));
        }
        bits |= Vec<T>::bits(mask) << k;
    }
    return bits;
}

template <int Dim, class T>
struct BoxRegion
{
    const Aabb<Dim, T>& box;
    HWY_ATTR HWY_INLINE unsigned touch(const Bounds<Dim, T>& bounds) const { return touching(bounds, box); }
    /// Lanes all of whose objects touch the region.
    HWY_ATTR HWY_INLINE unsigned contain(const Bounds<Dim, T>& bounds) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            auto mask = both(Vec<T>::set(box.lo[0]) <= Vec<T>::load(bounds.lo[0] + k),
                             Vec<T>::load(bounds.hi[0] + k) <= Vec<T>::set(box.hi[0]));
            for (int d = 1; d < Dim; ++d) {
                mask = both(mask, Vec<T>::set(box.lo[d]) <= Vec<T>::load(bounds.lo[d] + k));
                mask = both(mask, Vec<T>::load(bounds.hi[d] + k) <= Vec<T>::set(box.hi[d]));
            }
            bits |= Vec<T>::bits(mask) << k;
        }
        return bits;
    }
};

/// The squared distances of `Vec::size` lanes from a point.
template <int Dim, class T>
HWY_ATTR HWY_INLINE Vec<T> distances(const Bounds<Dim, T>& bounds, const T* point, std::uint32_t k)
{
    Vec<T> sum = Vec<T>::set(0);
    for (int d = 0; d < Dim; ++d) {
        const Vec<T> p = Vec<T>::set(point[d]);
        const Vec<T> gap = greatest(
            greatest(Vec<T>::load(bounds.lo[d] + k) - p, p - Vec<T>::load(bounds.hi[d] + k)), Vec<T>::set(0));
        sum = sum + gap * gap;
    }
    return sum;
}

template <int Dim, class T>
struct SphereRegion
{
    const T* center;
    T limit; // radius squared
    HWY_ATTR HWY_INLINE unsigned touch(const Bounds<Dim, T>& bounds) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size)
            bits |= Vec<T>::bits(distances<Dim, T>(bounds, center, k) <= Vec<T>::set(limit)) << k;
        return bits;
    }
    HWY_ATTR HWY_INLINE unsigned contain(const Bounds<Dim, T>& bounds) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            Vec<T> sum = Vec<T>::set(0);
            for (int d = 0; d < Dim; ++d) {
                const Vec<T> p = Vec<T>::set(center[d]);
                const Vec<T> gap =
                    greatest(p - Vec<T>::load(bounds.lo[d] + k), Vec<T>::load(bounds.hi[d] + k) - p);
                sum = sum + gap * gap;
            }
            bits |= Vec<T>::bits(sum <= Vec<T>::set(limit)) << k;
        }
        return bits;
    }
};

template <int Dim, class T>
struct FrustumRegion
{
    const Plane<Dim, T>* planes;
    std::size_t count;
    /// Lanes with the corner furthest along (or, for `nearest`, against) each normal inside its plane.
    template <bool nearest>
    HWY_ATTR HWY_INLINE unsigned corners(const Bounds<Dim, T>& bounds) const
    {
        unsigned all = 0xffff;
        for (std::size_t i = 0; i < count && all != 0; ++i) {
            const Plane<Dim, T>& plane = planes[i];
            unsigned bits = 0;
            for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
                Vec<T> sum = Vec<T>::set(0);
                for (int d = 0; d < Dim; ++d) {
                    const T n = plane.normal[d];
                    if (n == 0) continue;
                    const T* corner = (n > 0) == nearest ? bounds.lo[d] : bounds.hi[d];
                    sum = sum + Vec<T>::set(n) * Vec<T>::load(corner + k);
                }
                bits |= Vec<T>::bits(Vec<T>::set(0) <= sum + Vec<T>::set(plane.offset)) << k;
            }
            all &= bits;
        }
        return all;
    }
    HWY_ATTR HWY_INLINE unsigned touch(const Bounds<Dim, T>& bounds) const { return corners<false>(bounds); }
    HWY_ATTR HWY_INLINE unsigned contain(const Bounds<Dim, T>& bounds) const { return corners<true>(bounds); }
};

/// Nodes with children yet to visit, one entry per level: halving space, no more than key_digits levels.
template <int Dim, class T>
struct Way
{
    const Node<Dim, T>* node;
    unsigned left;   // lanes to visit
    unsigned inside; // those of them that need no test
};

template <int Dim, class T>
inline bool emit(const Block<Dim, T>& block, unsigned hits, Wanted wanted, Found<std::uint32_t>& out)
{
    if (!out.has_room()) out.full(out);
    std::uint32_t* next = out.next;
    if (!wanted) {
        for (; hits != 0; hits &= hits - 1) {
            const std::uint32_t id = block.id[std::countr_zero(hits)];
            *next = id;
            next += id != no_id;
        }
    } else {
        for (; hits != 0; hits &= hits - 1) {
            const std::uint32_t id = block.id[std::countr_zero(hits)];
            if (id != no_id && wanted(id)) *next++ = id;
        }
    }
    const bool found = next != out.next;
    out.next = next;
    return !(found && out.one_will_do);
}

/// Has the blocks in the given lanes of a node on their way from memory.
template <int Dim, class T>
HWY_INLINE void fetch(const Node<Dim, T>& node, unsigned hits)
{
    for (; hits != 0; hits &= hits - 1) {
        const Child<Dim, T> child = node.child[std::countr_zero(hits)];
        if (!child || !child.is_block()) continue;
        const auto* const lines = reinterpret_cast<const char*>(child.block());
        for (std::size_t offset = 0; offset < sizeof(Block<Dim, T>); offset += 64)
            __builtin_prefetch(lines + offset);
    }
}

template <int Dim, class T, class Region>
HWY_ATTR void search_region(Child<Dim, T> root, const Region& region, Wanted wanted,
                            Found<std::uint32_t>& out)
{
    if (!root) return;
    if (root.is_block()) {
        emit(*root.block(), region.touch(root.block()->bounds), wanted, out);
        return;
    }
    Way<Dim, T> way[key_digits<Dim> + 2];
    int depth = 0;
    way[0] = {root.node(), region.touch(root.node()->bounds), 0};
    if (way[0].left != 0) way[0].inside = region.contain(root.node()->bounds);
    while (depth >= 0) {
        Way<Dim, T>& here = way[depth];
        if (here.left == 0) {
            --depth;
            continue;
        }
        const auto lane = static_cast<unsigned>(std::countr_zero(here.left));
        here.left &= here.left - 1;
        const bool inside = ((here.inside >> lane) & 1) != 0;
        const Child<Dim, T> child = here.node->child[lane];
        if (!child) continue; // an empty lane, let through by infinite bounds
        if (child.is_block()) {
            const Block<Dim, T>& block = *child.block();
            const unsigned hits = inside ? 0xffffu : region.touch(block.bounds);
            if (hits != 0 && !emit(block, hits, wanted, out)) return;
        } else {
            const Node<Dim, T>* const node = child.node();
            Way<Dim, T>& below = way[++depth];
            below.node = node;
            if (inside) {
                below.left = below.inside = 0xffff;
                continue;
            }
            below.left = region.touch(node->bounds);
            below.inside = 0;
            if (std::popcount(below.left) >= 4) below.inside = region.contain(node->bounds) & below.left;
        }
    }
}

template <int Dim, class T>
HWY_ATTR void search_box(Child<Dim, T> root, const Aabb<Dim, T>& region, Wanted wanted,
                         Found<std::uint32_t>& out)
{
    search_region<Dim, T>(root, BoxRegion<Dim, T>{region}, wanted, out);
}
template <int Dim, class T>
HWY_ATTR void search_sphere(Child<Dim, T> root, const Sphere<Dim, T>& region, Wanted wanted,
                            Found<std::uint32_t>& out)
{
    search_region<Dim, T>(root, SphereRegion<Dim, T>{region.center, region.radius * region.radius}, wanted,
                          out);
}
template <int Dim, class T>
HWY_ATTR void search_frustum(Child<Dim, T> root, const Frustum<Dim, T>& region, Wanted wanted,
                             Found<std::uint32_t>& out)
{
    search_region<Dim, T>(root, FrustumRegion<Dim, T>{region.planes.data(), region.planes.size()}, wanted,
                          out);
}

/// ---- Many boxes at once ----------------------------------------------------------------------------------

/// Askers that lie together go down together: at each child it is seen in one step which of them touch it.
/// Where few are left, each goes on alone.
template <int Dim, class T>
HWY_ATTR void search_join(Child<Dim, T> root, const Askers<Dim, T>& askers, Found<Touch>& out)
{
    constexpr int few = 3;
    struct Level
    {
        const Node<Dim, T>* node;
        unsigned left;
        unsigned askers;
    };
    if (!root) return;
    Level way[key_digits<Dim> + 2];
    int depth = -1;
    Aabb<Dim, T> each[lanes];
    for (std::uint32_t a = 0; a < askers.count; ++a)
        each[a] = askers.bounds.get(a);

    const auto ask_block = [&](const Block<Dim, T>& block, std::uint32_t a) HWY_ATTR {
        unsigned hits = touching(block.bounds, each[a]);
        if (hits == 0) return;
        if (!out.has_room()) out.full(out);
        Touch* next = out.next;
        for (; hits != 0; hits &= hits - 1) {
            const std::uint32_t id = block.id[std::countr_zero(hits)];
            *next = {a, id};
            next += id != no_id;
        }
        out.next = next;
    };
    const auto ask_alone = [&](const Node<Dim, T>* first, std::uint32_t a) HWY_ATTR {
        const int bottom = depth;
        way[++depth] = {first, touching(first->bounds, each[a]), 0};
        fetch(*first, way[depth].left);
        while (depth > bottom) {
            Level& here = way[depth];
            if (here.left == 0) {
                --depth;
                continue;
            }
            const auto lane = static_cast<unsigned>(std::countr_zero(here.left));
            here.left &= here.left - 1;
            const Child<Dim, T> child = here.node->child[lane];
            if (!child) continue;
            if (child.is_block()) {
                ask_block(*child.block(), a);
            } else {
                const Node<Dim, T>* const node = child.node();
                way[++depth] = {node, touching(node->bounds, each[a]), 0};
                fetch(*node, way[depth].left);
            }
        }
    };
    const auto go_down = [&](Child<Dim, T> child, unsigned asking) HWY_ATTR {
        if (child.is_block()) {
            for (; asking != 0; asking &= asking - 1)
                ask_block(*child.block(), static_cast<std::uint32_t>(std::countr_zero(asking)));
        } else if (std::popcount(asking) <= few) {
            for (; asking != 0; asking &= asking - 1)
                ask_alone(child.node(), static_cast<std::uint32_t>(std::countr_zero(asking)));
        } else {
            const Node<Dim, T>* const node = child.node();
            Aabb<Dim, T> hull = each[std::countr_zero(asking)];
            for (unsigned rest = asking & (asking - 1); rest != 0; rest &= rest - 1) {
                const Aabb<Dim, T>& box = each[std::countr_zero(rest)];
                for (int d = 0; d < Dim; ++d) {
                    hull.lo[d] = std::min(hull.lo[d], box.lo[d]);
                    hull.hi[d] = std::max(hull.hi[d], box.hi[d]);
                }
            }
            way[++depth] = {node, touching(node->bounds, hull), asking};
            fetch(*node, way[depth].left);
        }
    };
    go_down(root, (1u << askers.count) - 1);
    while (depth >= 0) {
        Level& here = way[depth];
        if (here.left == 0) {
            --depth;
            continue;
        }
        const auto lane = static_cast<unsigned>(std::countr_zero(here.left));
        here.left &= here.left - 1;
        const Child<Dim, T> child = here.node->child[lane];
        if (!child) continue;
        const unsigned asking = touching(askers.bounds, here.node->bounds.get(lane)) & here.askers;
        if (asking != 0) go_down(child, asking);
    }
}

/// ---- Lines -----------------------------------------------------------------------------------------------

/// Which bounds a line meets first on each axis, and which last.
template <int Dim, class T>
struct LineTest
{
    T lo[Dim], hi[Dim], inverse[Dim];
    T max_fraction;

    HWY_ATTR HWY_INLINE explicit LineTest(const Line<Dim, T>& line) : max_fraction(line.max_fraction)
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d] = line.lo[d];
            hi[d] = line.hi[d];
            inverse[d] = line.inverse[d];
        }
    }
    /// Lanes met no later than at `last`; stores when.
    HWY_ATTR HWY_INLINE unsigned meet(const Bounds<Dim, T>& bounds, T last, T* at) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            Vec<T> enter = Vec<T>::set(0), leave = Vec<T>::set(last);
            Vec<T> beside = Vec<T>::set(0); // never above 0 where an axis without motion lets pass
            for (int d = 0; d < Dim; ++d) {
                const Vec<T> to_lo = Vec<T>::load(bounds.lo[d] + k), to_hi = Vec<T>::load(bounds.hi[d] + k);
                const Vec<T> own_lo = Vec<T>::set(lo[d]), own_hi = Vec<T>::set(hi[d]);
                if (inverse[d] > 0) {
                    enter = greatest((to_lo - own_hi) * Vec<T>::set(inverse[d]), enter);
                    leave = least((to_hi - own_lo) * Vec<T>::set(inverse[d]), leave);
                } else if (inverse[d] < 0) {
                    enter = greatest((to_hi - own_lo) * Vec<T>::set(inverse[d]), enter);
                    leave = least((to_lo - own_hi) * Vec<T>::set(inverse[d]), leave);
                } else {
                    // Differences of finite numbers are 0 only for equal ones: no rounding decides.
                    beside = greatest(beside, greatest(to_lo - own_hi, own_lo - to_hi));
                }
            }
            enter.store(at + k);
            bits |= Vec<T>::bits(both(enter <= leave, beside <= Vec<T>::set(0))) << k;
        }
        return bits;
    }
};

/// What is yet to visit, the nearest on top. Deep enough for all real trees; grows for others.
template <int Dim, class T>
class Stack
{
  public:
    struct Entry
    {
        Child<Dim, T> child;
        T at;
    };
    [[nodiscard]] bool empty() const { return size_ == 0; }
    Entry pop() { return entries_[--size_]; }
    /// Pushes the given lanes of a node, the furthest first.
    HWY_INLINE void push(const Node<Dim, T>& node, unsigned hits, const T* at)
    {
        if (size_ + lanes > capacity_) grow();
        const std::uint32_t base = size_;
        for (; hits != 0; hits &= hits - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(hits));
            const Child<Dim, T> child = node.child[lane];
            if (!child) continue;
            std::uint32_t to = size_++;
            for (; to > base && entries_[to - 1].at < at[lane]; --to)
                entries_[to] = entries_[to - 1];
            entries_[to] = {child, at[lane]};
        }
    }

  private:
    void grow()
    {
        std::vector<Entry> bigger(2 * std::size_t{capacity_});
        std::copy_n(entries_, size_, bigger.data());
        more_ = std::move(bigger);
        entries_ = more_.data();
        capacity_ *= 2;
    }
    Entry few_[160];
    std::vector<Entry> more_;
    Entry* entries_ = few_;
    std::uint32_t size_ = 0, capacity_ = 160;
};

template <int Dim, class T>
HWY_ATTR Hit<T> search_first(Child<Dim, T> root, const Line<Dim, T>& line, Wanted wanted)
{
    const LineTest<Dim, T> test(line);
    Hit<T> best;
    T last = line.max_fraction;
    alignas(64) T at[lanes];
    const auto visit = [&](const Block<Dim, T>& block) HWY_ATTR {
        for (unsigned hits = test.meet(block.bounds, last, at); hits != 0; hits &= hits - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(hits));
            const Hit<T> hit{block.id[lane], at[lane] + T(0)}; // no negative zero
            if (hit.id == no_id || !(best.id == no_id || hit < best)) continue;
            if (wanted && !wanted(hit.id)) continue;
            best = hit;
            last = hit.at;
        }
    };
    if (!root) return best;
    if (root.is_block()) {
        visit(*root.block());
        return best;
    }
    Stack<Dim, T> stack;
    unsigned hits = test.meet(root.node()->bounds, last, at);
    stack.push(*root.node(), hits, at);
    while (!stack.empty()) {
        const auto next = stack.pop();
        if (next.at > last) continue;
        if (next.child.is_block()) {
            visit(*next.child.block());
        } else {
            const Node<Dim, T>& node = *next.child.node();
            hits = test.meet(node.bounds, last, at);
            stack.push(node, hits, at);
        }
    }
    return best;
}

template <int Dim, class T>
HWY_ATTR void search_all(Child<Dim, T> root, const Line<Dim, T>& line, Wanted wanted, Found<Hit<T>>& out)
{
    const LineTest<Dim, T> test(line);
    alignas(64) T at[lanes];
    const auto visit = [&](const Block<Dim, T>& block) HWY_ATTR {
        unsigned hits = test.meet(block.bounds, line.max_fraction, at);
        if (hits == 0) return true;
        if (!out.has_room()) out.full(out);
        const auto* const before = out.next;
        for (; hits != 0; hits &= hits - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(hits));
            const std::uint32_t id = block.id[lane];
            if (id == no_id || (wanted && !wanted(id))) continue;
            *out.next++ = {id, at[lane] + T(0)};
        }
        return !(out.one_will_do && out.next != before);
    };
    if (!root) return;
    if (root.is_block()) {
        visit(*root.block());
        return;
    }
    Way<Dim, T> way[key_digits<Dim> + 2];
    int depth = 0;
    way[0] = {root.node(), test.meet(root.node()->bounds, line.max_fraction, at), 0};
    while (depth >= 0) {
        Way<Dim, T>& here = way[depth];
        if (here.left == 0) {
            --depth;
            continue;
        }
        const auto lane = static_cast<unsigned>(std::countr_zero(here.left));
        here.left &= here.left - 1;
        const Child<Dim, T> child = here.node->child[lane];
        if (!child) continue;
        if (child.is_block()) {
            if (!visit(*child.block())) return;
        } else {
            const Node<Dim, T>* const node = child.node();
            const unsigned left = test.meet(node->bounds, line.max_fraction, at);
            way[++depth] = {node, left, 0};
        }
    }
}

/// ---- Near a point
/// ------------------------------------------------------------------------------------------

template <int Dim, class T>
HWY_ATTR void search_nearest(Child<Dim, T> root, const T* point, Wanted wanted, Best<T>& best)
{
    alignas(64) T at[lanes];
    const auto within = [&](const Bounds<Dim, T>& bounds) HWY_ATTR {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            const Vec<T> each = distances<Dim, T>(bounds, point, k);
            each.store(at + k);
            bits |= Vec<T>::bits(each <= Vec<T>::set(best.limit)) << k;
        }
        return bits;
    };
    const auto visit = [&](const Block<Dim, T>& block) HWY_ATTR {
        for (unsigned hits = within(block.bounds); hits != 0; hits &= hits - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(hits));
            const Hit<T> hit{block.id[lane], at[lane]};
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
    if (!root || best.wanted == 0) return;
    if (root.is_block()) {
        visit(*root.block());
        return;
    }
    Stack<Dim, T> stack;
    unsigned hits = within(root.node()->bounds);
    stack.push(*root.node(), hits, at);
    while (!stack.empty()) {
        const auto next = stack.pop();
        if (next.at > best.limit) continue;
        if (next.child.is_block()) {
            visit(*next.child.block());
        } else {
            const Node<Dim, T>& node = *next.child.node();
            hits = within(node.bounds);
            stack.push(node, hits, at);
        }
    }
}

template <int Dim, class T>
const Kernels<Dim, T>* kernels()
{
    static constexpr Kernels<Dim, T> table = {
        search_box<Dim, T>,   search_sphere<Dim, T>, search_frustum<Dim, T>, search_join<Dim, T>,
        search_first<Dim, T>, search_all<Dim, T>,    search_nearest<Dim, T>};
    return &table;
}
