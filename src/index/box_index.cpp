// SPDX-License-Identifier: MIT
// The interface of the index: checks arguments, and handles filters, batches and the order of results.
#include "jostle/box_index.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "base/checks.hpp"
#include "base/instantiate.hpp"
#include "base/result_lists.hpp"
#include "base/users.hpp"
#include "index/box_index_access.hpp"
#include "index/kernels/kernels.hpp"
#include "index/queries/answers.hpp"
#include "index/queries/check.hpp"
#include "index/queries/join.hpp"
#include "index/queries/pair_answers.hpp"
#include "index/queries/verbs.hpp"
#include "index/tree/tree.hpp"

JOSTLE_NAMESPACE_BEGIN

using index::PairVisitor;
using index::Visits;
using index::Wanted;

namespace {

/// Whether an object passes a filter.
bool takes(const QueryFilter& filter, std::uint32_t query, std::uint32_t id)
{
    if (id == filter.exclude) return false;
    if (!filter.mask.empty() &&
        ((filter.category[id] & filter.asker_mask) == 0 || (filter.asker_category & filter.mask[id]) == 0))
        return false;
    if (!filter.owner.empty() && filter.asker_owner != Filter::no_owner &&
        filter.owner[id] == filter.asker_owner)
        return false;
    return !filter.accept || filter.accept(query, id);
}
bool takes_all(const QueryFilter& filter) noexcept
{
    return filter.exclude == ~std::uint32_t{0} && filter.mask.empty() && filter.owner.empty() &&
           !filter.accept;
}

} // namespace

template <int Dim, Coordinate T>
struct BoxIndex<Dim, T>::Implementation
{
    class Asking;
    class AskingMany;
    using Filters = detail::QueryFilters<QueryFilter>;

    explicit Implementation(const IndexOptions& given)
        : options(given),
          tasks(given.executor != nullptr ? given.executor : &default_executor()),
          kernels(index::kernels_for<Dim, T>(checked(given.instruction_set))),
          tree(given),
          joins(given)
    {
    }

    void build(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
    {
        check_boxes_of(boxes, "", ids);
        tree.build(ids, boxes);
    }

    /// Throws if an id occurs twice, or if it isn't in the index though it must be (true), or is though it
    /// mustn't (false).
    void check_ids(std::span<const std::uint32_t> ids, std::optional<bool> wanted_here) const
    {
        for (std::size_t i = 0; i < ids.size(); ++i) {
            if (ids[i] == Hit<T>::none)
                throw Error(ErrorCode::invalid_argument,
                            "entry " + std::to_string(i) + ": 4294967295 is no id; choose a smaller one", i);
            if (wanted_here && tree.contains(ids[i]) != *wanted_here)
                throw Error(ErrorCode::invalid_argument,
                            "entry " + std::to_string(i) + ": id " + std::to_string(ids[i]) +
                                (*wanted_here ? " is not in the index"
                                              : " is in the index already; move it or erase it"),
                            i);
        }
        if (std::adjacent_find(ids.begin(), ids.end(), std::greater_equal<>()) == ids.end()) return;
        std::vector<std::uint32_t> sorted(ids.begin(), ids.end());
        std::sort(sorted.begin(), sorted.end());
        const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
        if (twice == sorted.end()) return;
        const auto second = std::find(std::find(ids.begin(), ids.end(), *twice) + 1, ids.end(), *twice);
        throw Error(ErrorCode::invalid_argument,
                    "entry " + std::to_string(second - ids.begin()) + ": id " + std::to_string(*twice) +
                        " comes twice in one call",
                    static_cast<std::uint64_t>(second - ids.begin()));
    }

    /// Calls body(wanted) with a predicate for the filter of one query.
    template <class Body>
    auto filtered(const QueryFilter& filter, std::size_t query, const Body& body) const
    {
        if (takes_all(filter)) return body(Wanted());
        const auto wanted = [&](std::uint32_t id) {
            return takes(filter, static_cast<std::uint32_t>(query), id);
        };
        return body(Wanted(wanted));
    }
    void check_filters(const Filters& filters, std::size_t queries) const
    {
        if (!filters.one_each()) return index::check(filters[0], tree.id_end());
        filters.check(queries);
        for (std::size_t i = 0; i < queries; ++i)
            index::check(filters[i], tree.id_end(), i);
    }

    /// Pairs of boxes and a tree's objects, in the working memory of this index.
    template <class Allocator>
    void join(const index::Tree<Dim, T>& with, const BoxView<Dim, T>& boxes,
              std::vector<Pair, Allocator>& pairs)
    {
        index::check_joined(boxes);
        joins.run(with, *tasks, boxes, [&](std::size_t size) {
            pairs.resize(size); // existing elements needn't be cleared
            return pairs.data();
        });
    }
    template <class Allocator>
    void join(const BoxView<Dim, T>& boxes, std::vector<Pair, Allocator>& out, const Filters& filters)
    {
        std::vector<Pair, Allocator> pairs(std::move(out)); // if anything below throws, the result is empty
        out.clear();
        check_filters(filters, boxes.size());
        join(tree, boxes, pairs);
        const Users::Answering answering(&users);
        if (filters.one_each() || !takes_all(filters[0]))
            std::erase_if(pairs, [&](const Pair& pair) { return !takes(filters[pair.a], pair.a, pair.b); });
        out = std::move(pairs);
    }
    bool visit_joined(const BoxView<Dim, T>& boxes, PairVisitor visitor, const Filters& filters) const
    {
        index::check_joined(boxes);
        const AskingMany asking(*this, filters, boxes.size(), Visits::in_own_order);
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            const auto a = static_cast<std::uint32_t>(i);
            const auto visit_all = [&](const auto& one, std::size_t, Wanted wanted) {
                return one.answers().visit(boxes[i], wanted, [&](std::uint32_t b) { return visitor(a, b); });
            };
            if (!asking.with(i, visit_all)) return false;
        }
        return true;
    }
    [[nodiscard]] index::Roots<Dim, T> roots_with(const Implementation& other) const noexcept
    {
        return {tree.root(), other.tree.root(), this == &other, {}};
    }
    bool pairs(const Implementation& other, PairVisitor visitor) const
    {
        const Users::Answering answering(&users), other_answering(&other.users);
        const index::Roots<Dim, T> roots = roots_with(other);
        return kernels.pairs({&roots, 1}, visitor);
    }
    bool closest_pairs(const Implementation& other, index::PairHitVisitor<T> visitor, T max_distance) const
    {
        index::check_max_distance(max_distance);
        const Users::Answering answering(&users), other_answering(&other.users);
        const index::Roots<Dim, T> roots = roots_with(other);
        return index::visit_closest<Dim, T>(kernels, {&roots, 1}, max_distance * max_distance, visitor,
                                            tree.closest_work());
    }

    [[nodiscard]] Executor& executor() const noexcept { return *tasks; }

    mutable Users users{"BoxIndex", "change it afterwards"};
    IndexOptions options;
    Executor* tasks; // the executor for batches
    const index::Kernels<Dim, T>& kernels;
    index::Tree<Dim, T> tree;
    index::Join<Dim, T> joins;
};

/// One query: what answers it, and which objects pass its filter.
template <int Dim, Coordinate T>
class BoxIndex<Dim, T>::Implementation::Asking
{
  public:
    Asking(const Implementation& index, const QueryFilter& filter, Visits visits = Visits::no)
        : index_(index),
          filter_(filter),
          answering_(filter.accept || visits != Visits::no ? &index.users : nullptr)
    {
        index::check(filter, index.tree.id_end());
    }
    [[nodiscard]] index::Answers<Dim, T> answers() const { return {index_.kernels, index_.tree}; }
    template <class Body>
    auto with(std::size_t query, const Body& body) const
    {
        return index_.filtered(filter_, query, body);
    }
    template <class Found>
    [[nodiscard]] const Found& given(const Found& found) const noexcept
    {
        return found;
    }
    template <class Item, class Find>
    bool list(std::vector<Item>& out, const Find& find) const
    {
        return with(0, [&](Wanted wanted) { return find(wanted, out); });
    }

  private:
    const Implementation& index_;
    const QueryFilter& filter_;
    const Users::Answering answering_;
};

/// A batch of queries.
template <int Dim, Coordinate T>
class BoxIndex<Dim, T>::Implementation::AskingMany
{
  public:
    AskingMany(const Implementation& index, const Filters& filters, std::size_t queries, Visits = Visits::no)
        : index_(index),
          count_(queries),
          filters_(filters),
          one_{{index.kernels, index.tree}},
          answering_(&index.users)
    {
        index.check_filters(filters, queries);
    }
    /// Calls body(asking, i, wanted) for one query.
    template <class Body>
    auto with(std::size_t i, const Body& body) const
    {
        return index_.filtered(filters_[i], i, [&](Wanted wanted) { return body(one_, i, wanted); });
    }
    template <class Body>
    void each(const Body& body) const
    {
        index::each_query(index_.executor(), count_, [&](std::size_t i) { with(i, body); });
    }
    template <class Item, class Find>
    void lists(ResultLists<Item>& out, const Find& find) const
    {
        ResultListsAccess::fill(out, count_, index::of_batch(index_.executor()),
                                [&](std::size_t i, auto& items) {
                                    return with(i, [&](const One& one, std::size_t, Wanted wanted) {
                                        return find(one, i, wanted, items);
                                    });
                                });
    }

  private:
    /// What is shared by all queries.
    struct One
    {
        index::Answers<Dim, T> same;
        [[nodiscard]] const index::Answers<Dim, T>& answers() const noexcept { return same; }
        template <class Found>
        [[nodiscard]] const Found& given(const Found& found) const noexcept
        {
            return found;
        }
    };
    const Implementation& index_;
    std::size_t count_;
    Filters filters_;
    One one_;
    const Users::Answering answering_;
};

template <int Dim, Coordinate T>
BoxIndex<Dim, T>::BoxIndex(const IndexOptions& options)
    : implementation_((check_memory(options.memory), std::make_unique<Implementation>(options)))
{
}
template <int Dim, Coordinate T>
BoxIndex<Dim, T>::BoxIndex(BoxIndex&&) noexcept = default;
template <int Dim, Coordinate T>
BoxIndex<Dim, T>& BoxIndex<Dim, T>::operator=(BoxIndex&&) noexcept = default;
template <int Dim, Coordinate T>
BoxIndex<Dim, T>::~BoxIndex() = default;

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::build(const BoxView<Dim, T>& boxes)
{
    if (boxes.size() >= Hit<T>::none)
        throw Error(ErrorCode::too_many_objects,
                    std::to_string(boxes.size()) + " boxes; ids have 32 bits, give at most 4294967294");
    const InUse call = implementation_->users.change();
    implementation_->build({}, boxes);
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::build(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    const InUse call = implementation_->users.change();
    check_one_id_each(ids.size(), boxes.size());
    implementation_->check_ids(ids, std::nullopt);
    implementation_->build(ids, boxes);
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::insert(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    Implementation& all = *implementation_;
    const InUse call = all.users.change();
    check_one_id_each(ids.size(), boxes.size());
    all.check_ids(ids, false);
    check_boxes_of(boxes, "", ids);
    all.tree.put(ids, boxes);
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::erase(std::span<const std::uint32_t> ids)
{
    Implementation& all = *implementation_;
    const InUse call = all.users.change();
    all.check_ids(ids, true);
    all.tree.erase(ids);
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::move(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    Implementation& all = *implementation_;
    const InUse call = all.users.change();
    check_one_id_each(ids.size(), boxes.size());
    all.check_ids(ids, true);
    check_boxes_of(boxes, "", ids);
    all.tree.put(ids, boxes);
}

template <int Dim, Coordinate T, class Allocator>
void BoxIndexAccess::join(BoxIndex<Dim, T>& index, const index::Tree<Dim, T>& tree,
                          const Boxes<Dim, T>& boxes, std::vector<Pair, Allocator>& out)
{
    index.implementation_->join(tree, boxes, out);
}

template <int Dim, Coordinate T>
void BoxIndexAccess::look_around(BoxIndex<Dim, T>& index, const Boxes<Dim, T>& boxes)
{
    auto& inside = *index.implementation_;
    inside.joins.look_around(inside.tree, *inside.tasks, boxes);
}

template <int Dim, Coordinate T>
std::span<const index::Seen<Dim, T>> BoxIndexAccess::around(const BoxIndex<Dim, T>& index,
                                                            std::size_t k) noexcept
{
    return index.implementation_->joins.around(k);
}

template <int Dim, Coordinate T>
index::Tree<Dim, T>& BoxIndexAccess::tree(BoxIndex<Dim, T>& index) noexcept
{
    return index.implementation_->tree;
}

template <int Dim, Coordinate T>
const index::Tree<Dim, T>& BoxIndexAccess::tree(const BoxIndex<Dim, T>& index) noexcept
{
    return index.implementation_->tree;
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::clear()
{
    const InUse call = implementation_->users.change();
    implementation_->tree.clear();
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::release_memory()
{
    const InUse call = implementation_->users.change();
    implementation_->tree.release_memory();
    implementation_->joins.release_memory();
}

template <int Dim, Coordinate T>
std::size_t BoxIndex<Dim, T>::size() const noexcept
{
    return implementation_->tree.size();
}

template <int Dim, Coordinate T>
bool BoxIndex<Dim, T>::contains(std::uint32_t id) const noexcept
{
    return implementation_->tree.contains(id);
}

template <int Dim, Coordinate T>
Aabb<Dim, T> BoxIndex<Dim, T>::box(std::uint32_t id) const
{
    if (!contains(id))
        throw Error(ErrorCode::invalid_argument, "id " + std::to_string(id) + " is not in the index", id);
    return implementation_->tree.box(id);
}

template <int Dim, Coordinate T>
std::optional<Aabb<Dim, T>> BoxIndex<Dim, T>::bounds() const noexcept
{
    const auto& tree = implementation_->tree;
    return tree.size() == 0 ? std::nullopt : std::optional(tree.hull());
}

template <int Dim, Coordinate T>
IndexStats BoxIndex<Dim, T>::stats() const noexcept
{
    IndexStats stats = implementation_->tree.stats();
    stats.bytes += implementation_->joins.bytes();
    return stats;
}

// --- Pairs of objects ---

template <int Dim, Coordinate T>
bool BoxIndex<Dim, T>::pairs(PairVisitor visitor) const
{
    return implementation_->pairs(*implementation_, visitor);
}
template <int Dim, Coordinate T>
bool BoxIndex<Dim, T>::pairs(const BoxIndex& other, PairVisitor visitor) const
{
    return implementation_->pairs(*other.implementation_, visitor);
}
template <int Dim, Coordinate T>
using IndexQueries = Queries<BoxIndex<Dim, T>, Dim, T, std::uint32_t, QueryFilter>;

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template class BoxIndex<Dim, T>;                                                                         \
    template index::Tree<Dim, T>& BoxIndexAccess::tree(BoxIndex<Dim, T>&) noexcept;                          \
    template const index::Tree<Dim, T>& BoxIndexAccess::tree(const BoxIndex<Dim, T>&) noexcept;              \
    template void BoxIndexAccess::join(BoxIndex<Dim, T>&, const index::Tree<Dim, T>&,                        \
                                       const BoxView<Dim, T>&, std::vector<Pair>&);                          \
    template void BoxIndexAccess::join(BoxIndex<Dim, T>&, const index::Tree<Dim, T>&,                        \
                                       const BoxView<Dim, T>&, std::pmr::vector<Pair>&);                     \
    template void BoxIndexAccess::look_around(BoxIndex<Dim, T>&, const BoxView<Dim, T>&);                    \
    template std::span<const index::Seen<Dim, T>> BoxIndexAccess::around(const BoxIndex<Dim, T>&,            \
                                                                         std::size_t) noexcept;              \
    JOSTLE_COMPILE_QUERIES(IndexQueries, QueryFilter, Dim, T)
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
