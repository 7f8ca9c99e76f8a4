// SPDX-License-Identifier: MIT
// Queries: each searches the resting and the active objects as if they were in one index.
#include <algorithm>
#include <cstddef>
#include <memory_resource>
#include <utility>
#include <vector>

#include "base/checks.hpp"
#include "base/instantiate.hpp"
#include "base/items_on_stack.hpp"
#include "base/result_lists.hpp"
#include "index/box_index_access.hpp"
#include "index/queries/answers.hpp"
#include "index/queries/verbs.hpp"
#include "world/implementation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

using index::Visits;

/// Runs queries on the resting and the active objects as if they were in one index, and decides which of the
/// objects count.
template <int Dim, class T>
class Asking
{
  public:
    using Implementation = typename World<Dim, T>::Implementation;

    /// Which indexes to search, and whether the masks must still be tested for what is found there.
    struct Sources
    {
        const index::Tree<Dim, T>* resting;
        const index::Tree<Dim, T>* active; // null: no objects
        bool masks;
    };
    /// Brings what it returns up to date. For the indexes' own order it uses no layer, so that no order
    /// depends on layers.
    static Sources sources(const Implementation& world, const ObjectQueryFilter& filter, Visits visits)
    {
        const State<Dim, T>& state = world.state;
        const auto tree_of = [](const BoxIndex<Dim, T>* index) {
            return index != nullptr ? &BoxIndexAccess::tree(*index) : nullptr;
        };
        const bool is_masked = filter.category != ~0u || filter.mask != ~0u;
        const bool is_free = visits == Visits::in_join || !world.users.are_at_work();
        if (is_masked && visits != Visits::in_own_order && is_free)
            for (const auto& layer : world.layers)
                if (layer->asker.category == filter.category && layer->asker.mask == filter.mask)
                    return {tree_of(&resting_of(*layer, state, world.applied)),
                            tree_of(active_of(layer->active, state, &layer->asker)),
                            state.shown != nullptr}; // it uses the filters from before apply()
        return {tree_of(&state.resting), tree_of(active_of(world.active_index, state)), is_masked};
    }

    Asking(const Implementation& world, const ObjectQueryFilter& filter, Visits visits = Visits::no)
        : state_(world.state),
          answering_(filter.accept || visits != Visits::no ? &world.users : nullptr),
          filter_(filter),
          exclude_(state_.ids.is_good(filter.exclude) ? filter.exclude.index : Hit<T>::none),
          sources_(sources(world, filter, visits)),
          answers_(index::kernels_for<Dim, T>(state_.options.instruction_set), resting(), active(),
                   state_.shown != nullptr ? Elsewhere(elsewhere_) : Elsewhere())
    {
    }

    [[nodiscard]] const index::Answers<Dim, T>& answers() const noexcept { return answers_; }
    /// At least what the masks select: of resting and of active objects, null if there are none.
    [[nodiscard]] const index::Tree<Dim, T>& resting() const noexcept { return *sources_.resting; }
    [[nodiscard]] const index::Tree<Dim, T>* active() const noexcept { return sources_.active; }
    [[nodiscard]] bool takes_all() const noexcept
    {
        return exclude_ == Hit<T>::none && !sources_.masks && filter_.owner == Filter::no_owner &&
               !filter_.accept;
    }
    [[nodiscard]] bool takes(std::uint32_t query, std::uint32_t index) const
    {
        if (index == exclude_) return false;
        if (sources_.masks || filter_.owner != Filter::no_owner) {
            const ObjectFilter object = state_.objects[Index{index}].filter();
            if (sources_.masks && !counts(object, {filter_.category, filter_.mask})) return false;
            if (object.owner == filter_.owner && filter_.owner != Filter::no_owner) return false;
        }
        return !filter_.accept || filter_.accept(query, state_.id_of(Index{index}));
    }
    /// Calls body with the filter of one query.
    template <class Body>
    decltype(auto) with(std::size_t query, const Body& body) const
    {
        const auto wanted = [&](std::uint32_t index) {
            return takes(static_cast<std::uint32_t>(query), index);
        };
        return body(takes_all() ? index::Wanted() : index::Wanted(wanted));
    }

    [[nodiscard]] Hit<T, ObjectId> given(const Hit<T>& hit) const
    {
        return hit.id == Hit<T>::none ? Hit<T, ObjectId>{}
                                      : Hit<T, ObjectId>{state_.id_of(Index{hit.id}), hit.at};
    }
    [[nodiscard]] ObjectId given(std::uint32_t index) const { return state_.id_of(Index{index}); }

    /// Not one by one: each lookup is a cache miss, and so these overlap.
    template <class Item, class Out>
    void append_given(const std::pmr::vector<Item>& items, Out& out) const
    {
        const std::size_t before = out.size();
        out.resize(before + items.size());
        std::transform(items.begin(), items.end(), out.begin() + static_cast<std::ptrdiff_t>(before),
                       [this](const Item& item) { return given(item); });
    }

    template <class Item, class Out, class Find>
    bool list(std::vector<Out>& out, const Find& find) const
    {
        out.clear();
        ItemsOnStack<Item> items;
        const bool more = with(0, [&](index::Wanted wanted) { return find(wanted, items.found); });
        append_given(items.found, out);
        return more;
    }

  private:
    const State<Dim, T>& state_;
    Users::Answering answering_;
    const ObjectQueryFilter& filter_;
    std::uint32_t exclude_;
    const Sources sources_;
    using Elsewhere = typename index::Answers<Dim, T>::Elsewhere;
    struct Written
    {
        const State<Dim, T>& state;
        Aabb<Dim, T> nowhere = nowhere_box<Dim, T>();
        const Aabb<Dim, T>* operator()(std::uint32_t i) const noexcept
        {
            const auto object = state.objects[Index{i}];
            if (!object.has(flag::written)) return nullptr;
            return object.is_there() ? &object.now() : &nowhere;
        }
    } elsewhere_{state_}; // than in the index of resting objects: where apply() has put it
    index::Answers<Dim, T> answers_;
};

/// A batch of queries.
template <int Dim, class T>
class AskingMany
{
  public:
    using Implementation = typename World<Dim, T>::Implementation;
    using Filters = detail::QueryFilters<ObjectQueryFilter>;

    AskingMany(const Implementation& world, const Filters& filters, std::size_t queries,
               Visits visits = Visits::no)
        : world_(world), count_(queries), filters_(filters), visits_(visits)
    {
        filters.check(queries);
        if (!filters.one_each()) {
            for_all_.emplace(world, filters[0], visits);
            return;
        }
        // Executors don't nest, so queries inside tasks can't refresh an index.
        for (std::size_t i = 0; i < count_; ++i)
            (void)Asking<Dim, T>::sources(world, filters[i], visits);
    }

    /// Calls body(asking, i, wanted) for one query.
    template <class Body>
    auto with(std::size_t i, const Body& body) const
    {
        const auto ask = [&](const Asking<Dim, T>& asking) {
            return asking.with(i, [&](index::Wanted wanted) { return body(asking, i, wanted); });
        };
        return for_all_ ? ask(*for_all_) : ask(Asking<Dim, T>(world_, filters_[i], visits_));
    }
    /// Calls body(asking, i, wanted) for each query.
    template <class Body>
    void each(const Body& body) const
    {
        index::each_query(*world_.state.executor, count_, [&](std::size_t i) { with(i, body); });
    }
    /// find(asking, i, wanted, items) finds the items of query i, and returns whether there are more.
    template <class Item, class Out, class Find>
    void lists(ResultLists<Out>& out, const Find& find) const
    {
        ResultListsAccess::fill(
            out, count_, index::of_batch(*world_.state.executor),
            [&](std::size_t i, std::pmr::vector<Out>& items) {
                ItemsOnStack<Item> some(items.get_allocator().resource());
                return with(i, [&](const Asking<Dim, T>& asking, std::size_t, index::Wanted wanted) {
                    const bool more = find(asking, i, wanted, some.found);
                    asking.append_given(some.found, items);
                    return more;
                });
            });
    }

  private:
    const Implementation& world_;
    std::size_t count_;
    Filters filters_;
    Visits visits_;
    std::optional<Asking<Dim, T>> for_all_;
};

} // namespace world

namespace world {
namespace {

/// A category and a mask that select everything that any of the filters selects.
inline ObjectQueryFilter masks_together(const detail::QueryFilters<ObjectQueryFilter>& filters,
                                        std::size_t queries)
{
    ObjectQueryFilter all;
    all.category = all.mask = 0;
    const std::size_t count = filters.one_each() ? queries : 1;
    for (std::size_t i = 0; i < count; ++i) {
        all.category |= filters[i].category;
        all.mask |= filters[i].mask;
    }
    return all;
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
template <class Allocator>
void World<Dim, T>::Implementation::join(const BoxView<Dim, T>& boxes, std::vector<Pair, Allocator>& out,
                                         const Filters& filters)
{
    using world::Index;
    filters.check(boxes.size());
    const InUse call = users.work();
    std::vector<Pair, Allocator> all(std::move(out)); // if anything below throws, the list is empty
    out.clear();
    const ObjectQueryFilter masks = world::masks_together(filters, boxes.size());
    const Asking where(*this, masks, index::Visits::in_join);
    BoxIndexAccess::join(state.resting, where.resting(), boxes, all);
    if (state.shown != nullptr)
        std::erase_if(all, [&](const Pair& pair) { return !state.is_shown_resting(Index{pair.b}); });
    if (where.active() != nullptr) {
        if (applied)
            arena.begin_again();
        else
            arena.begin();
        auto& more = arena.template list<Pair>("pairs of active objects");
        BoxIndexAccess::join(state.resting, *where.active(), boxes, more);
        std::size_t a = more.size(), r = all.size();
        all.resize(r + a);
        while (a > 0) // from the end, so that nothing is overwritten
            if (r > 0 && more[a - 1] < all[r - 1])
                --r, all[r + a] = all[r];
            else
                --a, all[r + a] = more[a];
    }
    // These use the world directly, without layers, and test everything with their own filters.
    std::optional<Asking> asking;
    std::size_t asker = boxes.size();
    const auto is_refused = [&](const Pair& pair) {
        if (filters.one_each() && pair.a != asker) asking.emplace(*this, filters[asker = pair.a]);
        return !asking->takes(pair.a, pair.b);
    };
    if (!filters.one_each()) asking.emplace(*this, filters[0]);
    if (filters.one_each() || !asking->takes_all()) std::erase_if(all, is_refused);
    out.swap(all);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::Implementation::visit_joined(const BoxView<Dim, T>& boxes, JoinVisitor visitor,
                                                 const Filters& filters) const
{
    index::check_joined(boxes);
    const AskingMany asking(*this, filters, boxes.size(), index::Visits::in_own_order);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const auto visit_all = [&](const Asking& one, std::size_t, index::Wanted wanted) {
            return one.answers().visit(boxes[i], wanted, [&](std::uint32_t index) {
                return visitor(static_cast<std::uint32_t>(i), one.given(index));
            });
        };
        if (!asking.with(i, visit_all)) return false;
    }
    return true;
}

// --- Touching objects, and bounds -------------------------------------------------------------------------

namespace world {
namespace {

/// Calls body(answers' query, wanted) for the objects not less than `from` that an object touches and whose
/// filters agree.
template <int Dim, class T, class Body>
auto ask_touching(const State<Dim, T>& state, Index index, std::uint32_t from, const Body& body)
{
    const ObjectFilter filter = state.objects[index].filter();
    const auto agrees = [&](std::uint32_t other) {
        return other >= from && other != raw(index) && passes(filter, state.objects[Index{other}].filter()) &&
               !is_shown_refused(state, pair_of(index, Index{other}));
    };
    return body(state.shown_box(index), index::Wanted(agrees));
}

/// Lists them, ascending.
template <int Dim, class T>
void list_touching(const State<Dim, T>& state, const index::Answers<Dim, T>& answers, Index index,
                   std::uint32_t from, std::pmr::vector<std::uint32_t>& out)
{
    out.clear();
    if (!state.is_shown(index)) return;
    ask_touching(state, index, from, [&](const auto& box, index::Wanted wanted) {
        return answers.all(box, wanted, World<Dim, T>::no_limit, out);
    });
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
void World<Dim, T>::touching(ObjectId id, std::vector<ObjectId>& out) const
{
    (void)implementation_->checked(id);
    const ObjectQueryFilter all;
    const world::Asking<Dim, T> asking(*implementation_, all);
    ItemsOnStack<std::uint32_t> others;
    world::list_touching(implementation_->state, asking.answers(), world::Index{id.index}, 0, others.found);
    out.clear();
    asking.append_given(others.found, out);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::touching(ObjectId id, FunctionRef<bool(ObjectId)> visitor) const
{
    (void)implementation_->checked(id);
    const world::Index index{id.index};
    if (!implementation_->state.is_shown(index)) return true;
    const ObjectQueryFilter all;
    const world::Asking<Dim, T> asking(*implementation_, all, world::Visits::in_own_order);
    return world::ask_touching(implementation_->state, index, 0, [&](const auto& box, index::Wanted wanted) {
        return asking.answers().visit(box, wanted,
                                      [&](std::uint32_t other) { return visitor(asking.given(other)); });
    });
}

template <int Dim, Coordinate T>
bool World<Dim, T>::pairs(FunctionRef<bool(ObjectId a, ObjectId b)> visit) const
{
    const Users::Answering answering(&implementation_->users);
    const ObjectQueryFilter all;
    const world::Asking<Dim, T> asking(*implementation_, all);
    ItemsOnStack<std::uint32_t> others;
    const std::uint32_t end = index_end();
    for (std::uint32_t a = 0; a < end; ++a) {
        world::list_touching(implementation_->state, asking.answers(), world::Index{a}, a + 1, others.found);
        for (const std::uint32_t b : others.found)
            if (!visit(asking.given(a), asking.given(b))) return false;
    }
    return true;
}

template <int Dim, Coordinate T>
auto World<Dim, T>::bounds() const -> std::optional<Box>
{
    const world::State<Dim, T>& state = implementation_->state;
    std::optional<Box> all;
    const auto include = [&](const Box& box) {
        if (!(box.lo[0] <= box.hi[0])) return; // of nothing
        if (!all) all = box;
        for (int d = 0; d < Dim; ++d) {
            all->lo[d] = std::min(all->lo[d], box.lo[d]);
            all->hi[d] = std::max(all->hi[d], box.hi[d]);
        }
    };
    // What apply() has written to isn't where the index of resting objects has it.
    const auto is_there = [&](std::uint32_t i) { return state.is_shown_resting(world::Index{i}); };
    const index::Tree<Dim, T>& resting = BoxIndexAccess::tree(state.resting);
    include(state.shown == nullptr ? resting.hull() : resting.hull_of(is_there));
    if (const BoxIndex<Dim, T>* const active = world::active_of(implementation_->active_index, state))
        include(BoxIndexAccess::tree(*active).hull());
    return all;
}

template <int Dim, Coordinate T>
using WorldQueries = Queries<World<Dim, T>, Dim, T, ObjectId, ObjectQueryFilter>;

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    JOSTLE_COMPILE_QUERIES(WorldQueries, ObjectQueryFilter, Dim, T)                                          \
    template JOSTLE_API void World<Dim, T>::touching(ObjectId, std::vector<ObjectId>&) const;                \
    template JOSTLE_API bool World<Dim, T>::pairs(FunctionRef<bool(ObjectId, ObjectId)>) const;              \
    template JOSTLE_API std::optional<Aabb<Dim, T>> World<Dim, T>::bounds() const;                           \
    template JOSTLE_API bool World<Dim, T>::touching(ObjectId, FunctionRef<bool(ObjectId)>) const;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
