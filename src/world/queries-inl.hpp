// SPDX-License-Identifier: MIT
#pragma once

// Questions: each is put to the resting objects and to the active ones, and the two answers are merged.
#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

#include "index/box_index_access.hpp"
#include "world/state.hpp"

JOSTLE_NAMESPACE_BEGIN

template <int Dim, Coordinate T>
const BoxIndex<Dim, T>* World<Dim, T>::Implementation::index_of_active() const
{
    if (active.empty()) return nullptr;
    if (!active_index_is_fresh.load(std::memory_order_acquire)) {
        const std::lock_guard lock(active_index_mutex);
        if (!active_index_is_fresh.load(std::memory_order_relaxed)) {
            follow_active();
            active_index_is_fresh.store(true, std::memory_order_release);
        }
    }
    return &active_index;
}

/// Brings the index of active objects to where they are, from where they were when somebody asked last.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::follow_active() const
{
    constexpr T nan = std::numeric_limits<T>::quiet_NaN();
    Box gone;
    std::fill_n(gone.lo, Dim, nan);
    std::fill_n(gone.hi, Dim, nan);
    const bool followed =
        BoxIndexAccess::follow<Dim, T>(active_index, [&](std::span<const std::uint32_t> indices, Box* boxes) {
            const Box* now[index::brick_capacity];
            for (std::size_t k = 0; k < indices.size(); ++k) {
                const auto object = objects[indices[k]];
                now[k] = object.place() == world::Place::active ? &object.now() : &gone;
                fetch(now[k]);
                fetch(&now[k]->hi[Dim - 1]);
            }
            for (std::size_t k = 0; k < indices.size(); ++k)
                boxes[k] = *now[k];
        });
    if (followed && active_index.size() == active.size()) return;
    std::pmr::vector<std::uint32_t> indices(options.memory);
    std::pmr::vector<Box> boxes(options.memory);
    const auto collect = [&](bool all) {
        for (const Active& each : active) {
            if (!all && active_index.contains(each.index)) continue;
            indices.push_back(each.index);
            boxes.push_back(objects[each.index].now());
        }
    };
    if (followed && active.size() <= active_index.size() + active_index.size() / 3) {
        collect(false);
        BoxIndexAccess::insert(active_index, std::span<const std::uint32_t>(indices),
                               Boxes(std::span<const Box>(boxes)));
    } else {
        indices.reserve(active.size());
        boxes.reserve(active.size());
        collect(true);
        BoxIndexAccess::rebuild(active_index, std::span<const std::uint32_t>(indices),
                                Boxes(std::span<const Box>(boxes)));
    }
}

template <int Dim, Coordinate T>
template <class Body>
decltype(auto) World<Dim, T>::Implementation::filtered(const ObjectQueryFilter& filter,
                                                       const Body& body) const
{
    const auto accept = [&](std::uint32_t question, std::uint32_t index) {
        const ObjectFilter object = objects[index].filter();
        if ((object.category & filter.mask) == 0 || (filter.category & object.mask) == 0) return false;
        if (object.owner == filter.owner && filter.owner != Filter::no_owner) return false;
        return !filter.accept || filter.accept(question, id_of(index));
    };
    QueryFilter inner;
    if (ids.is_good(filter.exclude)) inner.exclude = filter.exclude.index;
    if (filter.category != ~0u || filter.mask != ~0u || filter.owner != Filter::no_owner || filter.accept)
        inner.accept = accept;
    return body(inner);
}

namespace world {

/// Two ascending lists as one, cut to `most`; returns whether any was left out.
template <class Item, class Add>
bool merge(std::span<const Item> x, std::span<const Item> y, std::uint64_t most, const Add& add)
{
    auto a = x.begin(), b = y.begin();
    for (std::uint64_t k = 0; k < most; ++k) {
        if (a == x.end() && b == y.end()) return false;
        add(b == y.end() || (a != x.end() && *a < *b) ? *a++ : *b++);
    }
    return a != x.end() || b != y.end();
}

template <class T, class World>
ObjectHit<T> public_item(const World& world, const Hit<T>& hit)
{
    return {world.id_of(hit.id), hit.at};
}
template <class T, class World>
ObjectId public_item(const World& world, std::uint32_t index)
{
    return world.id_of(index);
}

/// ask(index, list) of both, merged into `out`.
template <class T, class Item, class World, class Out, class Ask>
bool ask_both(const World& world, std::vector<Out>& out, std::uint64_t max_results, const Ask& ask)
{
    std::vector<Item> resting, active;
    bool more = ask(world.resting, resting);
    if (const auto* index = world.index_of_active()) more |= ask(*index, active);
    out.clear();
    more |= merge<Item>(resting, active, max_results,
                        [&](const Item& item) { out.push_back(public_item<T>(world, item)); });
    return more;
}
template <class T, class Item, class World, class Question, class Out>
bool ask_all(const World& world, const Question& question, std::vector<Out>& out,
             const ObjectQueryFilter& filter, std::uint64_t max_results)
{
    return world.filtered(filter, [&](const QueryFilter& inner) {
        return ask_both<T, Item>(world, out, max_results, [&](const auto& index, auto& list) {
            return index.all(question, list, inner, max_results);
        });
    });
}

} // namespace world

template <int Dim, Coordinate T>
template <class Line>
std::optional<ObjectHit<T>> World<Dim, T>::first(const Line& line, const ObjectQueryFilter& filter) const
{
    const Implementation& me = *implementation_;
    return me.filtered(filter, [&](const QueryFilter& inner) -> std::optional<ObjectHit<T>> {
        std::optional<Hit<T>> best = me.resting.first(line, inner);
        if (const auto* active = me.index_of_active()) {
            Line rest = line;
            if (best) rest.max_fraction = std::min(rest.max_fraction, best->at);
            const std::optional<Hit<T>> other = active->first(rest, inner);
            if (other && (!best || *other < *best)) best = other;
        }
        if (!best) return std::nullopt;
        return world::public_item<T>(me, *best);
    });
}

template <int Dim, Coordinate T>
bool World<Dim, T>::all(const Ray<Dim, T>& ray, std::vector<ObjectHit<T>>& out,
                        const ObjectQueryFilter& filter, std::uint64_t max_results) const
{
    return world::ask_all<T, Hit<T>>(*implementation_, ray, out, filter, max_results);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::all(const Sweep<Dim, T>& sweep, std::vector<ObjectHit<T>>& out,
                        const ObjectQueryFilter& filter, std::uint64_t max_results) const
{
    return world::ask_all<T, Hit<T>>(*implementation_, sweep, out, filter, max_results);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::all(const Box& region, std::vector<ObjectId>& out, const ObjectQueryFilter& filter,
                        std::uint64_t max_results) const
{
    return world::ask_all<T, std::uint32_t>(*implementation_, region, out, filter, max_results);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::all(const Sphere<Dim, T>& region, std::vector<ObjectId>& out,
                        const ObjectQueryFilter& filter, std::uint64_t max_results) const
{
    return world::ask_all<T, std::uint32_t>(*implementation_, region, out, filter, max_results);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::all(const Frustum<Dim, T>& region, std::vector<ObjectId>& out,
                        const ObjectQueryFilter& filter, std::uint64_t max_results) const
{
    return world::ask_all<T, std::uint32_t>(*implementation_, region, out, filter, max_results);
}

template <int Dim, Coordinate T>
void World<Dim, T>::nearest(const Nearest<Dim, T>& question, std::vector<ObjectHit<T>>& out,
                            const ObjectQueryFilter& filter) const
{
    const Implementation& me = *implementation_;
    me.filtered(filter, [&](const QueryFilter& inner) {
        return world::ask_both<T, Hit<T>>(me, out, question.count, [&](const auto& index, auto& list) {
            index.nearest(question, list, inner);
            return false;
        });
    });
}

template <int Dim, Coordinate T>
template <class Question>
bool World<Dim, T>::any(const Question& question, const ObjectQueryFilter& filter) const
{
    const Implementation& me = *implementation_;
    return me.filtered(filter, [&](const QueryFilter& inner) {
        if (me.resting.any(question, inner)) return true;
        const auto* active = me.index_of_active();
        return active != nullptr && active->any(question, inner);
    });
}

template <int Dim, Coordinate T>
template <class Question>
std::uint64_t World<Dim, T>::count(const Question& question, const ObjectQueryFilter& filter) const
{
    const Implementation& me = *implementation_;
    return me.filtered(filter, [&](const QueryFilter& inner) {
        std::uint64_t sum = me.resting.count(question, inner);
        if (const auto* active = me.index_of_active()) sum += active->count(question, inner);
        return sum;
    });
}

// --- Many at once ----------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
template <class Line>
void World<Dim, T>::first(std::span<const Line> lines, std::span<ObjectHit<T>> out,
                          const ObjectQueryFilter& filter) const
{
    const Implementation& me = *implementation_;
    if (lines.size() != out.size())
        throw Error(ErrorCode::size_mismatch, "room for " + std::to_string(out.size()) + " results of " +
                                                  std::to_string(lines.size()) +
                                                  " questions; give one for each");
    me.filtered(filter, [&](const QueryFilter& inner) {
        std::vector<Hit<T>> best(lines.size());
        me.resting.first(lines, std::span<Hit<T>>(best), inner);
        if (const auto* active = me.index_of_active()) {
            std::vector<Line> rest(lines.begin(), lines.end());
            std::vector<Hit<T>> other(lines.size());
            for (std::size_t i = 0; i < best.size(); ++i)
                if (best[i].id != Hit<T>::none)
                    rest[i].max_fraction = std::min(rest[i].max_fraction, best[i].at);
            active->first(std::span<const Line>(rest), std::span<Hit<T>>(other), inner);
            for (std::size_t i = 0; i < best.size(); ++i)
                if (other[i].id != Hit<T>::none && (best[i].id == Hit<T>::none || other[i] < best[i]))
                    best[i] = other[i];
        }
        for (std::size_t i = 0; i < best.size(); ++i)
            out[i] = best[i].id == Hit<T>::none ? ObjectHit<T>{} : world::public_item<T>(me, best[i]);
    });
}

namespace world {

/// ask(index, lists) of both, merged list by list into the parts of `out`.
template <class T, class Item, class World, class Out, class Ask, class Most>
void ask_both_lists(const World& world, std::pmr::vector<std::size_t>& first, std::pmr::vector<Out>& items,
                    std::pmr::vector<std::uint8_t>& more, const Ask& ask, const Most& most)
{
    ResultLists<Item> resting, active;
    ask(world.resting, resting);
    if (const auto* index = world.index_of_active()) ask(*index, active);
    more.clear();
    items.clear();
    first.assign(1, 0);
    for (std::size_t i = 0; i < resting.size(); ++i) {
        const bool both = active.size() != 0;
        const bool cut = merge<Item>(resting[i], both ? active[i] : std::span<const Item>(), most(i),
                                     [&](const Item& item) { items.push_back(public_item<T>(world, item)); });
        first.push_back(items.size());
        more.push_back(cut || resting.more(i) || (both && active.more(i)));
    }
}

} // namespace world

template <int Dim, Coordinate T>
template <class Line>
void World<Dim, T>::all(std::span<const Line> lines, ResultLists<ObjectHit<T>>& out,
                        const ObjectQueryFilter& filter, std::uint64_t max_results) const
{
    const Implementation& me = *implementation_;
    me.filtered(filter, [&](const QueryFilter& inner) {
        world::ask_both_lists<T, Hit<T>>(
            me, out.first_, out.items_, out.more_,
            [&](const auto& index, auto& lists) { index.all(lines, lists, inner, max_results); },
            [&](std::size_t) { return max_results; });
    });
}

template <int Dim, Coordinate T>
template <class Region>
void World<Dim, T>::all(std::span<const Region> regions, ResultLists<ObjectId>& out,
                        const ObjectQueryFilter& filter, std::uint64_t max_results) const
{
    const Implementation& me = *implementation_;
    me.filtered(filter, [&](const QueryFilter& inner) {
        world::ask_both_lists<T, std::uint32_t>(
            me, out.first_, out.items_, out.more_,
            [&](const auto& index, auto& lists) { index.all(regions, lists, inner, max_results); },
            [&](std::size_t) { return max_results; });
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::nearest(std::span<const Nearest<Dim, T>> questions, ResultLists<ObjectHit<T>>& out,
                            const ObjectQueryFilter& filter) const
{
    const Implementation& me = *implementation_;
    me.filtered(filter, [&](const QueryFilter& inner) {
        world::ask_both_lists<T, Hit<T>>(
            me, out.first_, out.items_, out.more_,
            [&](const auto& index, auto& lists) { index.nearest(questions, lists, inner); },
            [&](std::size_t i) { return std::uint64_t{questions[i].count}; });
    });
}

template <int Dim, Coordinate T>
template <class Question>
void World<Dim, T>::any(std::span<const Question> questions, std::span<bool> out,
                        const ObjectQueryFilter& filter) const
{
    const Implementation& me = *implementation_;
    me.filtered(filter, [&](const QueryFilter& inner) {
        me.resting.any(questions, out, inner);
        const auto* active = me.index_of_active();
        if (active == nullptr) return;
        const auto others = std::make_unique<bool[]>(out.size());
        active->any(questions, std::span<bool>(others.get(), out.size()), inner);
        for (std::size_t i = 0; i < out.size(); ++i)
            out[i] = out[i] || others[i];
    });
}

template <int Dim, Coordinate T>
template <class Question>
void World<Dim, T>::count(std::span<const Question> questions, std::span<std::uint64_t> out,
                          const ObjectQueryFilter& filter) const
{
    const Implementation& me = *implementation_;
    me.filtered(filter, [&](const QueryFilter& inner) {
        me.resting.count(questions, out, inner);
        const auto* active = me.index_of_active();
        if (active == nullptr) return;
        std::vector<std::uint64_t> others(out.size());
        active->count(questions, std::span<std::uint64_t>(others), inner);
        for (std::size_t i = 0; i < out.size(); ++i)
            out[i] += others[i];
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::join(const Boxes& boxes, std::pmr::vector<Pair>& out, const ObjectQueryFilter& filter)
{
    Implementation& me = *implementation_;
    const InUse call(me.in_use, "World");
    std::pmr::vector<Pair> all(std::move(out)); // if anything below throws, the list is empty
    out.clear();
    me.resting.join(boxes, all);
    if (me.index_of_active() != nullptr) {
        me.active_index.join(boxes, me.joined);
        std::size_t a = me.joined.size(), r = all.size();
        all.resize(r + a);
        while (a > 0) // from the end, so that nothing is written over
            if (r > 0 && me.joined[a - 1] < all[r - 1])
                --r, all[r + a] = all[r];
            else
                --a, all[r + a] = me.joined[a];
    }
    me.filtered(filter, [&](const QueryFilter& inner) {
        if (inner.exclude == Hit<T>::none && !inner.accept) return;
        const auto refused = [&](const Pair& pair) {
            return pair.b == inner.exclude || (inner.accept && !inner.accept(pair.a, pair.b));
        };
        all.erase(std::remove_if(all.begin(), all.end(), refused), all.end());
    });
    out.swap(all);
}

#define JOSTLE_INSTANTIATE_QUESTION(Dim, T, Question)                                                        \
    template JOSTLE_API bool World<Dim, T>::any(const Question<Dim, T>&, const ObjectQueryFilter&) const;    \
    template JOSTLE_API std::uint64_t World<Dim, T>::count(const Question<Dim, T>&,                          \
                                                           const ObjectQueryFilter&) const;                  \
    template JOSTLE_API void World<Dim, T>::any(std::span<const Question<Dim, T>>, std::span<bool>,          \
                                                const ObjectQueryFilter&) const;                             \
    template JOSTLE_API void World<Dim, T>::count(std::span<const Question<Dim, T>>,                         \
                                                  std::span<std::uint64_t>, const ObjectQueryFilter&) const;
#define JOSTLE_INSTANTIATE_LINE(Dim, T, Line)                                                                \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Line)                                                                \
    template JOSTLE_API std::optional<ObjectHit<T>> World<Dim, T>::first(const Line<Dim, T>&,                \
                                                                         const ObjectQueryFilter&) const;    \
    template JOSTLE_API void World<Dim, T>::first(std::span<const Line<Dim, T>>, std::span<ObjectHit<T>>,    \
                                                  const ObjectQueryFilter&) const;                           \
    template JOSTLE_API void World<Dim, T>::all(std::span<const Line<Dim, T>>, ResultLists<ObjectHit<T>>&,   \
                                                const ObjectQueryFilter&, std::uint64_t) const;
#define JOSTLE_INSTANTIATE_REGION(Dim, T, Region)                                                            \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Region)                                                              \
    template JOSTLE_API void World<Dim, T>::all(std::span<const Region<Dim, T>>, ResultLists<ObjectId>&,     \
                                                const ObjectQueryFilter&, std::uint64_t) const;
#define JOSTLE_INSTANTIATE_WORLD(Dim, T)                                                                     \
    template class World<Dim, T>;                                                                            \
    JOSTLE_INSTANTIATE_LINE(Dim, T, Ray)                                                                     \
    JOSTLE_INSTANTIATE_LINE(Dim, T, Sweep)                                                                   \
    JOSTLE_INSTANTIATE_REGION(Dim, T, Aabb)                                                                  \
    JOSTLE_INSTANTIATE_REGION(Dim, T, Sphere)                                                                \
    JOSTLE_INSTANTIATE_REGION(Dim, T, Frustum)

JOSTLE_NAMESPACE_END
