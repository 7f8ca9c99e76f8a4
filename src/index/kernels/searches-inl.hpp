// SPDX-License-Identifier: MIT
// The searches, written once and compiled once per instruction set: see kernels.cpp. No include guard, on
// purpose.
//
// Every test is monotone in the bounds, rounding included: what holds for a box holds for every box around
// it. So the bounds of a node are tested with the very arithmetic that defines the answer for an object, and
// nothing is missed for lack of a tolerance.

/// The place of a number is how many are smaller: no branch depends on their order.
HWY_ATTR inline void sort_few(std::uint32_t* numbers, std::uint32_t count)
{
#if JOSTLE_SIMD_PLAIN
    std::sort(numbers, numbers + count);
#else
    // The lowest int for 0: some sets compare signed numbers only.
    using Numbers = Vec<std::int32_t>;
    constexpr std::uint32_t at_once = 2 * Numbers::size;
    alignas(64) std::int32_t unsorted[few + at_once];
    alignas(64) std::int32_t place[at_once];
    const std::uint32_t end = (count + at_once - 1) / at_once * at_once;
    for (std::uint32_t k = 0; k < count; ++k)
        unsorted[k] = static_cast<std::int32_t>(numbers[k] ^ 0x80000000u);
    std::fill(unsorted + count, unsorted + end, std::numeric_limits<std::int32_t>::max());
    for (std::uint32_t k = 0; k < count; k += at_once) {
        const Numbers own0 = Numbers::load(unsorted + k), own1 = Numbers::load(unsorted + k + Numbers::size);
        Numbers below0 = Numbers(0), below1 = Numbers(0);
        const Numbers one = Numbers(1);
        for (std::uint32_t other = 0; other < count; ++other) {
            const Numbers each = Numbers(unsorted[other]);
            below0 = choose(each < own0, below0 + one, below0);
            below1 = choose(each < own1, below1 + one, below1);
        }
        below0.store(place);
        below1.store(place + Numbers::size);
        const std::uint32_t here = std::min(at_once, count - k);
        for (std::uint32_t lane = 0; lane < here; ++lane)
            numbers[place[lane]] = static_cast<std::uint32_t>(unsorted[k + lane]) ^ 0x80000000u;
    }
#endif
}

// --- Regions ---

/// Lanes that touch a box.
template <int Dim, class T>
HWY_ATTR HWY_INLINE unsigned touching(const Bounds<Dim, T>& bounds, const Aabb<Dim, T>& box)
{
    unsigned bits = 0;
    for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
        auto mask = (Vec<T>::load(bounds.lo[0] + k) <= Vec<T>(box.hi[0])) &
                    (Vec<T>(box.lo[0]) <= Vec<T>::load(bounds.hi[0] + k));
        for (int d = 1; d < Dim; ++d) {
            mask = mask & (Vec<T>::load(bounds.lo[d] + k) <= Vec<T>(box.hi[d]));
            mask = mask & (Vec<T>(box.lo[d]) <= Vec<T>::load(bounds.hi[d] + k));
        }
        bits |= mask_bits(mask) << k;
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
            auto mask = (Vec<T>(box.lo[0]) <= Vec<T>::load(bounds.lo[0] + k)) &
                        (Vec<T>::load(bounds.hi[0] + k) <= Vec<T>(box.hi[0]));
            for (int d = 1; d < Dim; ++d) {
                mask = mask & (Vec<T>(box.lo[d]) <= Vec<T>::load(bounds.lo[d] + k));
                mask = mask & (Vec<T>::load(bounds.hi[d] + k) <= Vec<T>(box.hi[d]));
            }
            bits |= mask_bits(mask) << k;
        }
        return bits;
    }
};

/// The squared distances of `Vec::size` lanes from a point.
template <int Dim, class T>
HWY_ATTR HWY_INLINE Vec<T> distances(const Bounds<Dim, T>& bounds, const T* point, std::uint32_t k)
{
    Vec<T> sum = Vec<T>(0);
    for (int d = 0; d < Dim; ++d) {
        const Vec<T> p = Vec<T>(point[d]);
        const Vec<T> gap =
            max(max(Vec<T>::load(bounds.lo[d] + k) - p, p - Vec<T>::load(bounds.hi[d] + k)), Vec<T>(0));
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
            bits |= mask_bits(distances<Dim, T>(bounds, center, k) <= Vec<T>(limit)) << k;
        return bits;
    }
    HWY_ATTR HWY_INLINE unsigned contain(const Bounds<Dim, T>& bounds) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            Vec<T> sum = Vec<T>(0);
            for (int d = 0; d < Dim; ++d) {
                const Vec<T> p = Vec<T>(center[d]);
                const Vec<T> gap =
                    max(p - Vec<T>::load(bounds.lo[d] + k), Vec<T>::load(bounds.hi[d] + k) - p);
                sum = sum + gap * gap;
            }
            bits |= mask_bits(sum <= Vec<T>(limit)) << k;
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
                Vec<T> sum = Vec<T>(0);
                for (int d = 0; d < Dim; ++d) {
                    const T n = plane.normal[d];
                    if (n == 0) continue;
                    const T* corner = (n > 0) == nearest ? bounds.lo[d] : bounds.hi[d];
                    sum = sum + Vec<T>(n) * Vec<T>::load(corner + k);
                }
                bits |= mask_bits(Vec<T>(0) <= sum + Vec<T>(plane.offset)) << k;
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
HWY_ATTR inline bool emit(const Leaf<Dim, T>& leaf, unsigned hits, Wanted wanted, Found<std::uint32_t>& out)
{
    if (!out.has_room()) out.full(out);
    std::uint32_t* next = out.next;
    if (!wanted) {
#if !JOSTLE_SIMD_PLAIN && HWY_TARGET == HWY_AVX3
        const __m512i ids = _mm512_load_si512(leaf.id);
        const __mmask16 taken =
            _mm512_mask_cmpneq_epi32_mask(static_cast<__mmask16>(hits), ids, _mm512_set1_epi32(-1));
        _mm512_storeu_si512(next, _mm512_maskz_compress_epi32(taken, ids));
        next += std::popcount(static_cast<unsigned>(taken));
#else
        for (; hits != 0; hits &= hits - 1) {
            const std::uint32_t id = leaf.id[std::countr_zero(hits)];
            *next = id;
            next += id != no_id;
        }
#endif
    } else {
        for (; hits != 0; hits &= hits - 1) {
            const std::uint32_t id = leaf.id[std::countr_zero(hits)];
            if (id != no_id && wanted(id)) *next++ = id;
        }
    }
    const bool found = next != out.next;
    out.next = next;
    return !(found && out.one_will_do);
}

/// Has the leaves or nodes in the given lanes of a node on their way from memory: what waits for one, waits
/// for all.
template <int Dim, class T>
HWY_INLINE void prefetch_children(const Node<Dim, T>& node, unsigned hits)
{
    if (node.child[0].is_leaf()) {
        for (; hits != 0; hits &= hits - 1)
            if (const Child<Dim, T> child = node.child[std::countr_zero(hits)])
                prefetch(child.leaf(), sizeof(Leaf<Dim, T>));
    } else {
        for (; hits != 0; hits &= hits - 1)
            if (const Child<Dim, T> child = node.child[std::countr_zero(hits)])
                prefetch(child.node(), sizeof(Node<Dim, T>));
    }
}

template <int Dim, class T, class Region>
HWY_ATTR void search_region(Child<Dim, T> root, const Region& region, Wanted wanted,
                            Found<std::uint32_t>& out)
{
    if (!root) return;
    Way<Dim, T> way[key_digits<Dim> + 2];
    int depth = -1;
    const auto enter = [&](const Node<Dim, T>* node, bool inside) HWY_ATTR {
        Way<Dim, T>& here = way[++depth];
        here.node = node;
        if (inside) {
            here.left = here.inside = 0xffff;
            for (const Child<Dim, T> child : node->child)
                if (child && child.is_leaf()) prefetch(child.leaf()->id);
            return;
        }
        here.left = region.touch(node->bounds);
        here.inside = std::popcount(here.left) >= 4 ? region.contain(node->bounds) & here.left : 0;
        prefetch_children(*node, here.left);
    };
    const auto visit = [&](Way<Dim, T> page) HWY_ATTR {
        for (; page.left != 0; page.left &= page.left - 1) {
            const auto lane = static_cast<unsigned>(std::countr_zero(page.left));
            const Child<Dim, T> child = page.node->child[lane];
            if (!child) break; // empty lanes, let through by infinite bounds, come last
            const unsigned hits =
                ((page.inside >> lane) & 1) != 0 ? 0xffffu : region.touch(child.leaf()->bounds);
            if (hits != 0 && !emit(*child.leaf(), hits, wanted, out)) return false;
        }
        return true;
    };
    // A page's leaves are visited when those of the next one are on their way.
    Way<Dim, T> last{};
    enter(root.node(), false);
    while (depth >= 0) {
        Way<Dim, T>& here = way[depth];
        if (here.left == 0) {
            --depth;
            continue;
        }
        if (here.node->child[0].is_leaf()) {
            if (!visit(std::exchange(last, here))) return;
            --depth;
            continue;
        }
        const auto lane = static_cast<unsigned>(std::countr_zero(here.left));
        here.left &= here.left - 1;
        const Child<Dim, T> child = here.node->child[lane];
        if (child) enter(child.node(), ((here.inside >> lane) & 1) != 0);
    }
    visit(last);
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
    search_region<Dim, T>(root, SphereRegion<Dim, T>{region.center.data(), region.radius * region.radius},
                          wanted, out);
}
template <int Dim, class T>
HWY_ATTR void search_frustum(Child<Dim, T> root, const Frustum<Dim, T>& region, Wanted wanted,
                             Found<std::uint32_t>& out)
{
    search_region<Dim, T>(root, FrustumRegion<Dim, T>{region.planes.data(), region.planes.size()}, wanted,
                          out);
}

// --- Many boxes at once ---
// All askers take a step down before any takes the next. What is to be visited stands in a list, so it can be
// fetched ahead, and no branch depends on what was found: with a few askers to a leaf, mispredicted branches
// and waiting for memory are what a search one by one spends its time on.

/// Calls write(k, lane) for the k-th of the set lanes; for up to 4 without a branch, the rest of which write
/// something meaningless.
template <class Write>
HWY_INLINE void each_lane(unsigned hits, const Write& write)
{
    unsigned rest = hits;
    for (unsigned k = 0; k < 4; ++k) {
        write(k, static_cast<unsigned>(std::countr_zero(rest | (1u << (lanes - 1)))));
        rest &= rest - 1;
    }
    for (unsigned k = 4; rest != 0; rest &= rest - 1)
        write(k++, static_cast<unsigned>(std::countr_zero(rest)));
}

#if !JOSTLE_SIMD_PLAIN && HWY_TARGET == HWY_AVX3
/// Writes (asker, id) for the ids in the set lanes; room for 8 or 16.
HWY_ATTR HWY_INLINE void store_pairs(void* to, std::uint32_t asker, const std::uint32_t* ids, unsigned hits)
{
    const __m512i packed = _mm512_maskz_compress_epi32(static_cast<__mmask16>(hits), _mm512_load_si512(ids));
    const __m512i askers = _mm512_set1_epi64(asker);
    const auto pairs_of = [askers](__m256i half) HWY_ATTR {
        return _mm512_or_si512(_mm512_slli_epi64(_mm512_cvtepu32_epi64(half), 32), askers);
    };
    _mm512_storeu_si512(to, pairs_of(_mm512_castsi512_si256(packed)));
    if (std::popcount(hits) > 8)
        _mm512_storeu_si512(static_cast<std::uint64_t*>(to) + 8,
                            pairs_of(_mm512_extracti64x4_epi64(packed, 1)));
}
#endif

/// Collects touch_of(asker, leaf, lane) of all that the askers touch in `touches`, and returns how many.
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
            prefetch(nodes[std::min(i + ahead, node_count - 1)].child.node(), sizeof(Node<Dim, T>));
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
        prefetch(leaves[std::min(i + ahead, leaf_count - 1)].child.leaf(), sizeof(Leaf<Dim, T>));
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

/// Where the results of each asker begin.
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
    // By asker, and ascending: a short list's ids go where the number of smaller ones says.
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
        if (size > few / 2) {
            std::uint32_t differing = 0;
            for (std::uint32_t k = 1; k < size; ++k)
                differing |= first[k] ^ first[0];
            // For fewer, that many counters don't pay.
            const int digit = size < 512 ? 8 : 11;
            const std::uint32_t* const sorted = radix_sort<11>(
                first, work.ids.data() + touched + lanes, size, [](std::uint32_t id) { return id; },
                differing, digit);
            if (sorted != first) std::copy_n(sorted, size, first);
        } else if (size > 1) {
            sort_few(first, size);
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

/// What of a lookup's listing is touched; where measures are equal, perhaps.
struct Touched
{
    unsigned perhaps, surely;
};
template <int Dim>
HWY_ATTR HWY_INLINE Touched touched_of(const Listing<Dim>& listing, const Lookup<Dim>& lookup)
{
    using Measures = Vec<std::int16_t>;
    unsigned beside = 0, surely = 0;
    for (std::uint32_t k = 0; k < lanes; k += Measures::size) {
        auto apart = Measures(lookup.hi[0]) < Measures::load(listing.lo[0] + k);
        auto across = Measures::load(listing.lo[0] + k) < Measures(lookup.hi[0]);
        for (int d = 0; d < Dim; ++d) {
            const Measures from = Measures::load(listing.lo[d] + k), to = Measures::load(listing.hi[d] + k);
            const Measures own_from = Measures(lookup.lo[d]), own_to = Measures(lookup.hi[d]);
            apart = apart | ((own_to < from) | (to < own_from));
            across = across & ((from < own_to) & (own_from < to));
        }
        beside |= mask_bits(apart) << k;
        surely |= mask_bits(across) << k;
    }
    return {~beside & 0xffffu, surely};
}

template <int Dim>
HWY_ATTR std::size_t look_up(const Lookup<Dim>* lookups, std::size_t count,
                             FunctionRef<bool(std::uint32_t asker, std::uint32_t id)> decide, Pair* out)
{
    constexpr std::size_t ahead = 8;
    Pair* next = out;
    for (std::size_t i = 0; i < count; ++i) {
        const Lookup<Dim>& coming = lookups[std::min(i + ahead, count - 1)];
        for (std::uint32_t k = 0; k < coming.count; ++k)
            prefetch(coming.listings + k, sizeof(Listing<Dim>));
        const Lookup<Dim>& lookup = lookups[i];
        for (std::uint32_t k = 0; k < lookup.count; ++k) {
            const Listing<Dim>& listing = lookup.listings[k];
            const Touched touched = touched_of(listing, lookup);
            unsigned hits = touched.perhaps;
            for (unsigned doubts = hits & ~touched.surely; doubts != 0; doubts &= doubts - 1) {
                const int lane = std::countr_zero(doubts);
                if (!decide(lookup.asker, listing.id[lane])) hits &= ~(1u << lane);
            }
#if !JOSTLE_SIMD_PLAIN && HWY_TARGET == HWY_AVX3
            store_pairs(next, lookup.asker, listing.id, hits);
#else
            each_lane(hits, [&](unsigned n, unsigned lane) { next[n] = {lookup.asker, listing.id[lane]}; });
#endif
            next += std::popcount(hits);
        }
    }
    return static_cast<std::size_t>(next - out);
}

// --- Lines ---

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
    /// Lanes met no later than at `last`; stores when, infinity for the others.
    HWY_ATTR HWY_INLINE unsigned meet(const Bounds<Dim, T>& bounds, T last, T* at) const
    {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            Vec<T> enter = Vec<T>(0), leave = Vec<T>(last);
            Vec<T> beside = Vec<T>(0); // never above 0 where an axis without motion lets pass
            for (int d = 0; d < Dim; ++d) {
                const Vec<T> to_lo = Vec<T>::load(bounds.lo[d] + k), to_hi = Vec<T>::load(bounds.hi[d] + k);
                const Vec<T> own_lo = Vec<T>(lo[d]), own_hi = Vec<T>(hi[d]);
                if (inverse[d] > 0) {
                    enter = max((to_lo - own_hi) * Vec<T>(inverse[d]), enter);
                    leave = min((to_hi - own_lo) * Vec<T>(inverse[d]), leave);
                } else if (inverse[d] < 0) {
                    enter = max((to_hi - own_lo) * Vec<T>(inverse[d]), enter);
                    leave = min((to_lo - own_hi) * Vec<T>(inverse[d]), leave);
                } else {
                    // Differences of finite numbers are 0 only for equal ones: no rounding decides.
                    beside = max(beside, max(to_lo - own_hi, own_lo - to_hi));
                }
            }
            const auto met = (enter <= leave) & (beside <= Vec<T>(0));
            choose(met, enter, Vec<T>(std::numeric_limits<T>::infinity())).store(at + k);
            bits |= mask_bits(met) << k;
        }
        return bits;
    }
};

/// A search for what is nearest: at each node on the way down, the lanes yet to visit and how far they are.
/// The nearest is chosen only when it is its turn; most of the others turn out to be too far then.
template <int Dim, class T>
struct Nearing
{
    const Node<Dim, T>* node;
    unsigned left;
    alignas(64) T at[lanes]; // infinite for lanes not left

    /// Takes out the nearest lane left, if it is no further than `last`.
    HWY_ATTR HWY_INLINE Child<Dim, T> next(T last)
    {
        Vec<T> each = Vec<T>::load(at);
        for (std::uint32_t k = Vec<T>::size; k < lanes; k += Vec<T>::size)
            each = min(each, Vec<T>::load(at + k));
        const T nearest = min_lane(each);
        if (nearest > last) {
            left = 0;
            return {};
        }
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size)
            bits |= mask_bits(Vec<T>::load(at + k) <= Vec<T>(nearest)) << k;
        // Of several equally near the last: the keys begin with the class of size, and big boxes end a
        // search.
        const int lane = static_cast<int>(std::bit_width(bits & left)) - 1;
        left &= ~(1u << lane);
        at[lane] = std::numeric_limits<T>::infinity();
        return node->child[lane];
    }
};

/// Visits leaves in the order of their nodes' distance. enter(node's bounds, at) returns the lanes in reach
/// and stores how far they are, infinity for the others; `last` is as far as there is something to find.
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
HWY_ATTR void search_all(Child<Dim, T> root, const Line<Dim, T>& line, Wanted wanted, Found<Hit<T>>& out)
{
    const LineTest<Dim, T> test(line);
    alignas(64) T at[lanes];
    const auto visit = [&](const Leaf<Dim, T>& leaf) HWY_ATTR {
        unsigned hits = test.meet(leaf.bounds, line.max_fraction, at);
        if (hits == 0) return true;
        if (!out.has_room()) out.full(out);
        const auto* const before = out.next;
        for (; hits != 0; hits &= hits - 1) {
            const auto lane = static_cast<std::uint32_t>(std::countr_zero(hits));
            const std::uint32_t id = leaf.id[lane];
            if (id == no_id || (wanted && !wanted(id))) continue;
            *out.next++ = {id, at[lane] + T(0)};
        }
        return !(out.one_will_do && out.next != before);
    };
    const auto visit_all = [&](Way<Dim, T> page) HWY_ATTR {
        for (; page.left != 0; page.left &= page.left - 1) {
            const Child<Dim, T> child = page.node->child[std::countr_zero(page.left)];
            if (!child) break;
            if (!visit(*child.leaf())) return false;
        }
        return true;
    };
    Way<Dim, T> last{}; // as in search_region
    if (!root) return;
    Way<Dim, T> way[key_digits<Dim> + 2];
    int depth = -1;
    const auto enter = [&](const Node<Dim, T>* node) HWY_ATTR {
        way[++depth] = {node, test.meet(node->bounds, line.max_fraction, at), 0};
        prefetch_children(*node, way[depth].left);
    };
    enter(root.node());
    while (depth >= 0) {
        Way<Dim, T>& here = way[depth];
        if (here.left == 0) {
            --depth;
            continue;
        }
        if (here.node->child[0].is_leaf()) {
            if (!visit_all(std::exchange(last, here))) return;
            --depth;
            continue;
        }
        const auto lane = static_cast<unsigned>(std::countr_zero(here.left));
        here.left &= here.left - 1;
        const Child<Dim, T> child = here.node->child[lane];
        if (child) enter(child.node());
    }
    visit_all(last);
}

// --- Near a point ---

template <int Dim, class T>
HWY_ATTR void search_nearest(Child<Dim, T> root, const T* point, Wanted wanted, Best<T>& best)
{
    alignas(64) T at[lanes];
    const auto within = [&](const Bounds<Dim, T>& bounds, T* far) HWY_ATTR {
        unsigned bits = 0;
        for (std::uint32_t k = 0; k < lanes; k += Vec<T>::size) {
            const Vec<T> each = distances<Dim, T>(bounds, point, k);
            const auto reached = each <= Vec<T>(best.limit);
            choose(reached, each, Vec<T>(std::numeric_limits<T>::infinity())).store(far + k);
            bits |= mask_bits(reached) << k;
        }
        return bits;
    };
    const auto visit = [&](const Leaf<Dim, T>& leaf) HWY_ATTR {
        for (unsigned hits = within(leaf.bounds, at); hits != 0; hits &= hits - 1) {
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
    if (best.wanted != 0) search_nearing<Dim, T>(root, best.limit, within, visit);
}
