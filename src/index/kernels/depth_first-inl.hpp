// SPDX-License-Identifier: MIT
// Finds everything that touches a region or a line, depth first, in the order of the tree. Compiled once per
// instruction set, see kernels.cpp.

/// Which children of a node are in reach, and which of those are entirely inside the region, so that nothing
/// below them needs a test.
struct Reach
{
    unsigned lanes, inside;
};

/// A node on the path from the root, and the children yet to visit.
template <int Dim, class T>
struct Way
{
    const Node<Dim, T>* node;
    Reach left;
};

/// Appends the wanted objects in the set lanes of a leaf; returns false if one is enough and was found.
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

/// Prefetches the leaves or nodes in the given lanes: fetched together, they take hardly longer than one.
template <int Dim, class T>
HWY_ATTR HWY_INLINE void prefetch_children(const Node<Dim, T>& node, unsigned hits)
{
    if (node.child[0].is_leaf()) {
        for (; hits != 0; hits &= hits - 1)
            if (const Child<Dim, T> child = node.child[std::countr_zero(hits)]) prefetch_item(child.leaf());
    } else {
        for (; hits != 0; hits &= hits - 1)
            if (const Child<Dim, T> child = node.child[std::countr_zero(hits)]) prefetch_item(child.node());
    }
}

/// Calls visit(leaf, inside) for the leaves in reach, until it returns false; reach(bounds) tells which
/// children of a node are. A page's leaves are visited only after the next page was entered, so that there is
/// time to fetch them from memory.
template <int Dim, class T, class ReachOf, class Visit>
HWY_ATTR HWY_INLINE void search_depth_first(Child<Dim, T> root, const ReachOf& reach, const Visit& visit)
{
    if (!root) return;
    // Each node halves space at least once more than its parent.
    Way<Dim, T> way[key_digits<Dim> + 2];
    int depth = -1;
    const auto enter = [&](const Node<Dim, T>* node, bool inside) HWY_ATTR {
        Way<Dim, T>& here = way[++depth];
        here.node = node;
        if (inside) {
            here.left = {0xffff, 0xffff};
            for (const Child<Dim, T> child : node->child)
                if (child && child.is_leaf()) prefetch(child.leaf()->id);
            return;
        }
        here.left = reach(node->bounds);
        prefetch_children(*node, here.left.lanes);
    };
    const auto visit_page = [&](const Way<Dim, T>& page) HWY_ATTR {
        for (unsigned rest = page.left.lanes; rest != 0; rest &= rest - 1) {
            const auto lane = static_cast<unsigned>(std::countr_zero(rest));
            const Child<Dim, T> child = page.node->child[lane];
            if (!child) break; // empty lanes, let through by infinite bounds, come last
            if (!visit(*child.leaf(), ((page.left.inside >> lane) & 1) != 0)) return false;
        }
        return true;
    };
    Way<Dim, T> last{};
    enter(root.node(), false);
    while (depth >= 0) {
        Way<Dim, T>& here = way[depth];
        if (here.left.lanes == 0) {
            --depth;
            continue;
        }
        if (here.node->child[0].is_leaf()) {
            if (!visit_page(std::exchange(last, here))) return;
            --depth;
            continue;
        }
        const auto lane = static_cast<unsigned>(std::countr_zero(here.left.lanes));
        here.left.lanes &= here.left.lanes - 1;
        const Child<Dim, T> child = here.node->child[lane];
        if (child) enter(child.node(), ((here.left.inside >> lane) & 1) != 0);
    }
    visit_page(last);
}

template <int Dim, class T, class Region>
HWY_ATTR void search_region(Child<Dim, T> root, const Region& region, Wanted wanted,
                            Found<std::uint32_t>& out)
{
    search_depth_first<Dim, T>(
        root,
        [&](const Bounds<Dim, T>& bounds) HWY_ATTR {
            const unsigned touched = region.touch(bounds);
            // If few children are touched, hardly one is inside: that test would cost more than it saves.
            return Reach{touched, std::popcount(touched) >= 4 ? region.contain(bounds) & touched : 0};
        },
        [&](const Leaf<Dim, T>& leaf, bool inside) HWY_ATTR {
            const unsigned hits = inside ? 0xffffu : region.touch(leaf.bounds);
            return hits == 0 || emit(leaf, hits, wanted, out);
        });
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

template <int Dim, class T>
HWY_ATTR void search_all(Child<Dim, T> root, const Line<Dim, T>& line, Wanted wanted, Found<Hit<T>>& out)
{
    const LineTest<Dim, T> test(line);
    alignas(64) T at[lanes];
    search_depth_first<Dim, T>(
        root,
        [&](const Bounds<Dim, T>& bounds)
            HWY_ATTR { return Reach{test.meet(bounds, line.max_fraction, at), 0}; },
        [&](const Leaf<Dim, T>& leaf, bool) HWY_ATTR {
            unsigned hits = test.meet(leaf.bounds, line.max_fraction, at);
            if (hits == 0) return true;
            if (!out.has_room()) out.full(out);
            const auto* const before = out.next;
            for (; hits != 0; hits &= hits - 1) {
                const auto lane = static_cast<std::uint32_t>(std::countr_zero(hits));
                const std::uint32_t id = leaf.id[lane];
                if (id == no_id || (wanted && !wanted(id))) continue;
                *out.next++ = {id, at[lane] + T(0)}; // no negative zero
            }
            return !(out.one_will_do && out.next != before);
        });
}
