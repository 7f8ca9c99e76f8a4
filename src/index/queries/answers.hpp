// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include "base/box.hpp"
#include "base/radix.hpp"
#include "index/kernels/kernels.hpp"
#include "index/tree/tree.hpp"
#include "jostle/process.hpp"
#include "jostle/query.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Sorts ids below 2^digits ascending. `spare` has room for as many.
inline void sort_by_digits(std::uint32_t* ids, std::size_t count, int digits, std::uint32_t* spare) noexcept
{
    constexpr int most_passes = 4, most_at_once = 11;
    constexpr std::size_t many = 512; // for fewer, that many counters don't pay
    const int at_once = count < many ? 8 : most_at_once;
    const int passes = (digits + at_once - 1) / at_once, step = (digits + passes - 1) / passes;
    const std::uint32_t* const sorted = radix_sort<most_at_once, most_passes>(
        ids, spare, static_cast<std::uint32_t>(count), [](std::uint32_t id) { return id; },
        ~std::uint32_t{0} >> (32 - digits), step);
    if (sorted != ids) std::copy_n(sorted, count, ids);
}

/// Sorts ids below `id_end`, no two the same. `spare` has room for as many.
template <int Dim, class T>
void sort_ids(const Kernels<Dim, T>& kernels, std::uint32_t* ids, std::size_t count, std::uint64_t id_end,
              std::uint32_t* spare) noexcept
{
    if (count <= most_sorted / 2)
        kernels.sort_few(ids, static_cast<std::uint32_t>(count));
    else
        sort_by_digits(ids, count, static_cast<int>(std::bit_width(id_end - 1)), spare);
}

template <class Query>
struct ItemOf
{
    using Item = std::uint32_t;
};
template <int Dim, class T>
struct ItemOf<Ray<Dim, T>>
{
    using Item = Hit<T>;
};
template <int Dim, class T>
struct ItemOf<Sweep<Dim, T>>
{
    using Item = Hit<T>;
};

// Both queries for the nearest as one: a point is a box.
template <int Dim, class T>
Aabb<Dim, T> from_of(const Nearest<Dim, T>& query) noexcept
{
    return {query.point, query.point};
}
template <int Dim, class T>
const Aabb<Dim, T>& from_of(const NearestToBox<Dim, T>& query) noexcept
{
    return query.box;
}

/// Takes over the bound that a visitor has set for this object, if it is lower.
template <class T>
void shrink(T& bound, T wish, std::uint32_t id)
{
    if (wish < bound)
        bound = wish;
    else if (wish != wish)
        detail::throw_bad_bound(id);
}

/// Results to be appended to a vector.
template <class Items>
struct IntoVector : Found<typename Items::value_type>
{
    using Item = typename Items::value_type;
    Items& out;
    explicit IntoVector(Items& to) : out(to) { this->full = flush; }
    static void flush(Found<Item>& self)
    {
        Items& out = static_cast<IntoVector&>(self).out;
        out.insert(out.end(), self.items, self.next);
        self.next = self.items;
    }
};

/// Counts results without storing them.
template <class Item>
struct IntoCount : Found<Item>
{
    std::uint64_t count = 0;
    IntoCount() { this->full = flush; }
    static void flush(Found<Item>& self)
    {
        static_cast<IntoCount&>(self).count += static_cast<std::uint64_t>(self.next - self.items);
        self.next = self.items;
    }
};

/// The filter of a search for the nearest objects of a tree. If it rejects nearly all objects, the search
/// visits all of them, scattered over memory. So after many were rejected the filter is called for all
/// objects in the order of their ids, which costs about a plain loop. If it accepts few, the search ends, and
/// these are the candidates. This is done only while any object may be a result: nothing is too far, and
/// fewer were found than are wanted.
template <int Dim, class T>
class OfFew
{
  public:
    OfFew(const Tree<Dim, T>& tree, Wanted wanted, Best<T>& best)
        : tree_(tree), wanted_(wanted), best_(best), most_refused_(256 + tree.size() / 16)
    {
    }
    bool operator()(std::uint32_t id)
    {
        if (knows_all_) return false;
        if (wanted_(id)) return true;
        if (++refused_ == most_refused_ && best_.limit == infinity) look_for_all();
        return false;
    }
    /// Called after the search: finds what is missing.
    void finish(const Aabb<Dim, T>& from)
    {
        if (!knows_all_) return;
        best_.limit = infinity;
        for (std::size_t k = 0; k < count_; ++k) {
            const Hit<T> hit{ids_[k], squared_distance(from, tree_.box(ids_[k]))};
            const Hit<T>* const end = best_.heap + best_.size;
            if (std::find(best_.heap, best_.heap + best_.size, hit) == end) take(hit);
        }
    }

  private:
    void look_for_all()
    {
        const auto end = static_cast<std::uint32_t>(tree_.id_end());
        for (std::uint32_t id = 0; id < end; ++id) {
            if (!tree_.contains(id) || !wanted_(id)) continue;
            if (count_ == most) return; // the search goes on
            ids_[count_++] = id;
        }
        knows_all_ = true;
        best_.limit = T(-1); // nothing is near enough
    }
    void take(const Hit<T>& hit)
    {
        if (!(hit.at <= best_.limit)) return; // nor is NaN
        if (best_.size == best_.wanted) {
            if (!(hit < best_.heap[0])) return;
            std::pop_heap(best_.heap, best_.heap + best_.size--);
        }
        best_.heap[best_.size++] = hit;
        std::push_heap(best_.heap, best_.heap + best_.size);
        if (best_.size == best_.wanted) best_.limit = best_.heap[0].at;
    }

    static constexpr T infinity = std::numeric_limits<T>::infinity();
    static constexpr std::size_t most = 64;
    const Tree<Dim, T>& tree_;
    const Wanted wanted_;
    Best<T>& best_;
    const std::size_t most_refused_;
    std::size_t refused_ = 0, count_ = 0;
    bool knows_all_ = false;
    std::uint32_t ids_[most];
};

/// Answers checked queries about the objects of one tree, or of two as if they were one.
template <int Dim, class T>
class Answers
{
  public:
    /// The box of an object that is no longer where the first tree has it, and is found in the other tree
    /// instead, or in none if the box is NaN. Null for an object that hasn't moved.
    using Elsewhere = FunctionRef<const Aabb<Dim, T>*(std::uint32_t id)>;

    /// `other` and `elsewhere` may be null.
    Answers(const Kernels<Dim, T>& kernels, const Tree<Dim, T>& tree, const Tree<Dim, T>* other = nullptr,
            Elsewhere elsewhere = {})
        : kernels_(kernels),
          queues_(tree.queues()),
          elsewhere_(elsewhere),
          size_(tree.size()),
          id_end_(tree.id_end())
    {
        has_first_ = static_cast<bool>(tree.root());
        if (tree.root()) trees_[count_] = &tree, roots_[count_++] = tree.root();
        if (other == nullptr) return;
        if (other->root()) trees_[count_] = other, roots_[count_++] = other->root();
        size_ += other->size();
        id_end_ = std::max(id_end_, other->id_end());
    }

    /// `none` if there is none.
    template <class Query>
    Hit<T> first(const Query& query, Wanted wanted) const
    {
        Hit<T> best;
        Line<Dim, T> line(query);
        each_root(wanted, [&](Child<Dim, T> root, Wanted here) {
            const Hit<T> hit = kernels_.first(root, line, here);
            if (hit.id == Hit<T>::none || (best.id != Hit<T>::none && !(hit < best))) return true;
            best = hit;
            line.max_fraction = hit.at; // an equally far object with a lesser id counts
            return true;
        });
        return best;
    }
    /// Appends the first max_results, in order. Returns whether there are more.
    template <class Query, class Items>
    bool all(const Query& query, Wanted wanted, std::uint64_t max_results, Items& out) const
    {
        const std::size_t begin = out.size();
        IntoVector<Items> found(out);
        each_root(wanted, [&](Child<Dim, T> root, Wanted here) {
            search(root, query, here, found);
            return true;
        });
        found.flush(found);
        const bool more = out.size() - begin > max_results;
        if (more) {
            const auto first = out.begin() + static_cast<std::ptrdiff_t>(begin);
            const auto last = first + static_cast<std::ptrdiff_t>(max_results);
            if (last != first) std::nth_element(first, last, out.end());
            out.erase(last, out.end());
        }
        sort(out, begin);
        return more;
    }
    template <class Query>
    std::uint64_t count(const Query& query, Wanted wanted) const
    {
        return count_up(query, wanted, false);
    }
    template <class Query>
    bool any(const Query& query, Wanted wanted) const
    {
        return count_up(query, wanted, true) != 0;
    }
    /// Appends the nearest, in order. For Nearest and NearestToBox.
    template <class Query, class Items>
    void nearest(const Query& query, Wanted wanted, Items& out) const
    {
        const std::size_t before = out.size();
        const auto most = static_cast<std::uint32_t>(std::min<std::size_t>(query.count, size_));
        out.resize(before + most);
        Hit<T>* const found = out.data() + before;
        const std::uint32_t count = find_nearest(query, wanted, most, found);
        std::sort_heap(found, found + count);
        out.resize(before + count);
    }
    /// The nearest object; `none` if there is none.
    template <class Query>
    Hit<T> nearest(const Query& query, Wanted wanted) const
    {
        Hit<T> found;
        if (query.count != 0) (void)find_nearest(query, wanted, 1, &found);
        return found;
    }
    /// Visits all answers in order until the visitor returns false. Returns false if it did.
    template <class Query>
    bool visit_in_order(const Query& query, Wanted wanted, HitVisitor<T> visit) const
    {
        const std::span<const Child<Dim, T>> roots(roots_, static_cast<std::size_t>(count_));
        std::uint64_t left = ~std::uint64_t{0};
        if constexpr (requires { query.count; }) left = query.count;
        if (left == 0) return true;
        bool goes_on = true;
        Hit<T> last;
        const auto checked = [&](const Hit<T>& hit, T& bound) {
            if (elsewhere_) { // an object in both trees comes twice, in succession if equally far
                const Aabb<Dim, T>* const box = elsewhere_(hit.id);
                if (box != nullptr && (hit == last || !is_at(query, *box, hit.at))) return true;
                last = hit;
                if (wanted && !wanted(hit.id)) return true;
            }
            T wish = bound;
            goes_on = visit(hit, wish);
            shrink(bound, wish, hit.id);
            return goes_on && --left != 0;
        };
        if constexpr (requires { query.count; })
            kernels_.visit_near(roots, from_of(query), query.max_distance * query.max_distance,
                                elsewhere_ ? Wanted() : wanted, checked, queues_);
        else
            kernels_.visit_line(roots, Line<Dim, T>(query), elsewhere_ ? Wanted() : wanted, checked, queues_);
        return goes_on;
    }
    /// The same without an order, for regions.
    template <class Region>
    bool visit(const Region& region, Wanted wanted, IdVisitor visit) const
    {
        // A search for any one object continues while each is rejected, here after the visitor got it.
        bool goes_on = true;
        const auto refuse_all = [&](std::uint32_t id) {
            if (goes_on && (!wanted || wanted(id))) goes_on = visit(id);
            return !goes_on;
        };
        (void)any(region, refuse_all);
        return goes_on;
    }

  private:
    /// Calls body(root, wanted) with a predicate for that tree, until it returns false.
    template <class Body>
    void each_root(Wanted wanted, const Body& body) const
    {
        const auto is_here = [&](std::uint32_t id) {
            return elsewhere_(id) == nullptr && (!wanted || wanted(id));
        };
        for (int k = 0; k < count_; ++k) {
            const Wanted here = elsewhere_ && k == 0 && has_first_ ? Wanted(is_here) : wanted;
            if (!body(roots_[k], here)) break;
        }
    }
    /// A heap of the nearest, at most `most`. Returns their number.
    template <class Query>
    std::uint32_t find_nearest(const Query& query, Wanted wanted, std::uint32_t most, Hit<T>* heap) const
    {
        Best<T> best;
        best.wanted = most;
        best.size = 0;
        best.limit = query.max_distance * query.max_distance;
        best.heap = heap;
        each_root(wanted, [&](Child<Dim, T> root, Wanted here) {
            OfFew<Dim, T> of_few(root == roots_[0] ? *trees_[0] : *trees_[1], here, best);
            kernels_.nearest(root, from_of(query), here ? Wanted(of_few) : here, best);
            of_few.finish(from_of(query));
            return true;
        });
        return best.size;
    }
    /// Whether the query finds the box at this value. A box of NaN is never found.
    template <class Query>
    static bool is_at(const Query& query, const Aabb<Dim, T>& box, T at) noexcept
    {
        if (box.lo[0] != box.lo[0]) return false;
        if constexpr (requires { query.count; })
            return squared_distance(from_of(query), box) == at;
        else
            return hit_fraction(query, box) == at;
    }
    // The searches, under one name for all queries.
    void search(Child<Dim, T> root, const Ray<Dim, T>& ray, Wanted wanted, Found<Hit<T>>& out) const
    {
        kernels_.all(root, Line<Dim, T>(ray), wanted, out);
    }
    void search(Child<Dim, T> root, const Sweep<Dim, T>& sweep, Wanted wanted, Found<Hit<T>>& out) const
    {
        kernels_.all(root, Line<Dim, T>(sweep), wanted, out);
    }
    void search(Child<Dim, T> root, const Aabb<Dim, T>& region, Wanted wanted,
                Found<std::uint32_t>& out) const
    {
        kernels_.box(root, region, wanted, out);
    }
    void search(Child<Dim, T> root, const Sphere<Dim, T>& region, Wanted wanted,
                Found<std::uint32_t>& out) const
    {
        kernels_.sphere(root, region, wanted, out);
    }
    void search(Child<Dim, T> root, const Frustum<Dim, T>& region, Wanted wanted,
                Found<std::uint32_t>& out) const
    {
        kernels_.frustum(root, region, wanted, out);
    }
    template <class Query>
    std::uint64_t count_up(const Query& query, Wanted wanted, bool one_will_do) const
    {
        IntoCount<typename ItemOf<Query>::Item> found;
        found.one_will_do = one_will_do;
        each_root(wanted, [&](Child<Dim, T> root, Wanted here) {
            search(root, query, here, found);
            found.flush(found);
            return !one_will_do || found.count == 0;
        });
        return found.count;
    }
    /// Sorts what was appended from `begin` on.
    template <class Items>
    void sort(Items& items, std::size_t begin) const
    {
        const std::size_t count = items.size() - begin;
        if constexpr (std::is_same_v<typename Items::value_type, Hit<T>>) {
            std::sort(items.begin() + static_cast<std::ptrdiff_t>(begin), items.end());
        } else {
            if (count > most_sorted / 2) items.resize(begin + 2 * count); // room to sort them
            std::uint32_t* const first = items.data() + begin;
            sort_ids(kernels_, first, count, id_end_, first + count);
            items.resize(begin + count);
        }
    }

    const Kernels<Dim, T>& kernels_;
    QueueShelf<Dim, T>& queues_;
    const Elsewhere elsewhere_;
    bool has_first_ = false; // the first tree has a root
    const Tree<Dim, T>* trees_[2];
    Child<Dim, T> roots_[2];
    int count_ = 0;
    std::size_t size_;
    std::uint64_t id_end_;
};

/// Whether a query calls a visitor, and in which order.
enum class Visits
{
    no,
    in_order,
    in_own_order,
    in_join // no visitor, but the query itself uses the structure
};

/// How the queries of a batch are distributed.
inline ProcessOptions of_batch(Executor& executor) noexcept
{
    return {&executor, 32};
}

/// Calls body(i) for each query of a batch, on the executor's threads.
template <class Body>
void each_query(Executor& executor, std::size_t queries, const Body& body)
{
    process_items(
        queries,
        [&](std::uint64_t begin, std::uint64_t end, Work) {
            for (std::size_t i = begin; i < end; ++i)
                body(i);
        },
        of_batch(executor));
}

} // namespace index
JOSTLE_NAMESPACE_END
