// SPDX-License-Identifier: MIT
#pragma once

// Questions: each is put to the resting objects and to the active ones, as if they were one index's.
#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "index/answers.hpp"
#include "index/box_index_access.hpp"
#include "index/check.hpp"
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

namespace world {

/// Puts questions to the resting and the active objects as if they were one index's, and says which of the
/// objects count.
template <int Dim, class T>
class Asking
{
  public:
    using State = typename World<Dim, T>::Implementation;

    Asking(const State& state, const ObjectQueryFilter& filter)
        : state_(state),
          filter_(filter),
          exclude_(state.ids.is_good(filter.exclude) ? filter.exclude.index : Hit<T>::none),
          numbers_(filter.category != ~0u || filter.mask != ~0u || filter.owner != Filter::no_owner),
          answers_(index::kernels_for<Dim, T>(state.options.instruction_set),
                   BoxIndexAccess::tree(state.resting), tree_of_active(state))
    {
    }

    [[nodiscard]] const index::Answers<Dim, T>& answers() const noexcept { return answers_; }
    [[nodiscard]] bool takes_all() const noexcept
    {
        return exclude_ == Hit<T>::none && !numbers_ && !filter_.accept;
    }
    [[nodiscard]] bool takes(std::uint32_t question, std::uint32_t index) const
    {
        if (index == exclude_) return false;
        if (numbers_) {
            const ObjectFilter object = state_.objects[index].filter();
            if ((object.category & filter_.mask) == 0 || (filter_.category & object.mask) == 0) return false;
            if (object.owner == filter_.owner && filter_.owner != Filter::no_owner) return false;
        }
        return !filter_.accept || filter_.accept(question, state_.id_of(index));
    }
    /// Calls body with the filter of one question.
    template <class Body>
    decltype(auto) with(std::size_t question, const Body& body) const
    {
        const auto wanted = [&](std::uint32_t index) {
            return takes(static_cast<std::uint32_t>(question), index);
        };
        return body(takes_all() ? index::Wanted() : index::Wanted(wanted));
    }

    [[nodiscard]] ObjectHit<T> given(const Hit<T>& hit) const
    {
        return hit.id == Hit<T>::none ? ObjectHit<T>{} : ObjectHit<T>{state_.id_of(hit.id), hit.at};
    }
    [[nodiscard]] ObjectId given(std::uint32_t index) const { return state_.id_of(index); }

    /// A single question: find(wanted, items) is one of the answers.
    template <class Item, class Out, class Find>
    bool list(std::vector<Out>& out, const Find& find) const
    {
        out.clear();
        std::vector<Item> items;
        const bool more = with(0, [&](index::Wanted wanted) { return find(wanted, items); });
        for (const Item& item : items)
            out.push_back(given(item));
        return more;
    }
    /// A batch: find(i, wanted, items).
    template <class Item, class Out, class Find>
    void lists(std::size_t count, std::pmr::vector<std::size_t>& first, std::pmr::vector<Out>& items,
               std::pmr::vector<std::uint8_t>& more, std::pmr::vector<std::pmr::vector<Out>>& found,
               const Find& find) const
    {
        index::Batch(*state_.executor, count)
            .lists(first, items, more, found,
                   [&, some = std::vector<Item>()](std::size_t i, std::pmr::vector<Out>& out) mutable {
                       some.clear();
                       const bool cut = with(i, [&](index::Wanted wanted) { return find(i, wanted, some); });
                       for (const Item& item : some)
                           out.push_back(given(item));
                       return cut;
                   });
    }
    template <class Body>
    void each(std::size_t count, const Body& body) const
    {
        index::Batch(*state_.executor, count).each([&](std::size_t i) {
            with(i, [&](index::Wanted wanted) { body(i, wanted); });
        });
    }

  private:
    static const index::Tree<Dim, T>* tree_of_active(const State& state)
    {
        const BoxIndex<Dim, T>* active = state.index_of_active();
        return active != nullptr ? &BoxIndexAccess::tree(*active) : nullptr;
    }

    const State& state_;
    const ObjectQueryFilter& filter_;
    std::uint32_t exclude_;
    bool numbers_; // objects are asked for their filters
    index::Answers<Dim, T> answers_;
};

} // namespace world

template <int Dim, Coordinate T>
template <class Line>
std::optional<ObjectHit<T>> World<Dim, T>::first(const Line& line, const ObjectQueryFilter& filter) const
{
    index::check(line, Error::no_index);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    const Hit<T> hit =
        asking.with(0, [&](index::Wanted wanted) { return asking.answers().first(line, wanted); });
    return hit.id == Hit<T>::none ? std::nullopt : std::optional(asking.given(hit));
}

#define JOSTLE_ALL(Question, Item, Given)                                                                    \
    template <int Dim, Coordinate T>                                                                         \
    bool World<Dim, T>::all(const Question<Dim, T>& question, std::vector<Given>& out,                       \
                            const ObjectQueryFilter& filter, std::uint64_t max_results) const                \
    {                                                                                                        \
        index::check(question, Error::no_index);                                                             \
        const world::Asking<Dim, T> asking(*implementation_, filter);                                        \
        return asking.template list<Item>(out, [&](index::Wanted wanted, auto& items) {                      \
            return asking.answers().all(question, wanted, max_results, items);                               \
        });                                                                                                  \
    }
JOSTLE_ALL(Ray, Hit<T>, ObjectHit<T>)
JOSTLE_ALL(Sweep, Hit<T>, ObjectHit<T>)
JOSTLE_ALL(Aabb, std::uint32_t, ObjectId)
JOSTLE_ALL(Sphere, std::uint32_t, ObjectId)
JOSTLE_ALL(Frustum, std::uint32_t, ObjectId)
#undef JOSTLE_ALL

template <int Dim, Coordinate T>
void World<Dim, T>::nearest(const Nearest<Dim, T>& question, std::vector<ObjectHit<T>>& out,
                            const ObjectQueryFilter& filter) const
{
    index::check(question, Error::no_index);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    asking.template list<Hit<T>>(out, [&](index::Wanted wanted, auto& items) {
        asking.answers().nearest(question, wanted, items);
        return false;
    });
}

template <int Dim, Coordinate T>
template <class Question>
bool World<Dim, T>::any(const Question& question, const ObjectQueryFilter& filter) const
{
    index::check(question, Error::no_index);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    return asking.with(0, [&](index::Wanted wanted) { return asking.answers().any(question, wanted); });
}

template <int Dim, Coordinate T>
template <class Question>
std::uint64_t World<Dim, T>::count(const Question& question, const ObjectQueryFilter& filter) const
{
    index::check(question, Error::no_index);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    return asking.with(0, [&](index::Wanted wanted) { return asking.answers().count(question, wanted); });
}

// --- Many at once ----------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
template <class Line>
void World<Dim, T>::first(std::span<const Line> lines, std::span<ObjectHit<T>> out,
                          const ObjectQueryFilter& filter) const
{
    index::check_room(lines.size(), out.size());
    index::check_all(lines);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    asking.each(lines.size(), [&](std::size_t i, index::Wanted wanted) {
        out[i] = asking.given(asking.answers().first(lines[i], wanted));
    });
}

template <int Dim, Coordinate T>
template <class Line>
void World<Dim, T>::all(std::span<const Line> lines, ResultLists<ObjectHit<T>>& out,
                        const ObjectQueryFilter& filter, std::uint64_t max_results) const
{
    index::check_all(lines);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    asking.template lists<Hit<T>>(lines.size(), out.first_, out.items_, out.more_, out.found_,
                                  [&](std::size_t i, index::Wanted wanted, auto& items) {
                                      return asking.answers().all(lines[i], wanted, max_results, items);
                                  });
}

template <int Dim, Coordinate T>
template <class Region>
void World<Dim, T>::all(std::span<const Region> regions, ResultLists<ObjectId>& out,
                        const ObjectQueryFilter& filter, std::uint64_t max_results) const
{
    index::check_all(regions);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    asking.template lists<std::uint32_t>(regions.size(), out.first_, out.items_, out.more_, out.found_,
                                         [&](std::size_t i, index::Wanted wanted, auto& items) {
                                             return asking.answers().all(regions[i], wanted, max_results,
                                                                         items);
                                         });
}

template <int Dim, Coordinate T>
void World<Dim, T>::nearest(std::span<const Nearest<Dim, T>> questions, ResultLists<ObjectHit<T>>& out,
                            const ObjectQueryFilter& filter) const
{
    index::check_all(questions);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    asking.template lists<Hit<T>>(questions.size(), out.first_, out.items_, out.more_, out.found_,
                                  [&](std::size_t i, index::Wanted wanted, auto& items) {
                                      asking.answers().nearest(questions[i], wanted, items);
                                      return false;
                                  });
}

template <int Dim, Coordinate T>
template <class Question>
void World<Dim, T>::any(std::span<const Question> questions, std::span<bool> out,
                        const ObjectQueryFilter& filter) const
{
    index::check_room(questions.size(), out.size());
    index::check_all(questions);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    asking.each(questions.size(), [&](std::size_t i, index::Wanted wanted) {
        out[i] = asking.answers().any(questions[i], wanted);
    });
}

template <int Dim, Coordinate T>
template <class Question>
void World<Dim, T>::count(std::span<const Question> questions, std::span<std::uint64_t> out,
                          const ObjectQueryFilter& filter) const
{
    index::check_room(questions.size(), out.size());
    index::check_all(questions);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    asking.each(questions.size(), [&](std::size_t i, index::Wanted wanted) {
        out[i] = asking.answers().count(questions[i], wanted);
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
    const world::Asking<Dim, T> asking(me, filter);
    if (!asking.takes_all())
        all.erase(std::remove_if(all.begin(), all.end(),
                                 [&](const Pair& pair) { return !asking.takes(pair.a, pair.b); }),
                  all.end());
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
