// SPDX-License-Identifier: MIT
// Questions: each is put to the resting objects and to the active ones, as if they were one index's.
#include <algorithm>
#include <limits>
#include <utility>

#include "index/answers.hpp"
#include "index/box_index_access.hpp"
#include "index/check.hpp"
#include "world/implementation.hpp"
#include "world/instantiate.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

template <int Dim, class T>
BoxIndex<Dim, T>* ActiveIndex<Dim, T>::of(const State<Dim, T>& state)
{
    if (state.active.empty()) return nullptr;
    if (!is_fresh_.load(std::memory_order_acquire)) {
        const std::lock_guard lock(mutex_);
        if (!is_fresh_.load(std::memory_order_relaxed)) {
            follow(state);
            is_fresh_.store(true, std::memory_order_release);
        }
    }
    return &index_;
}

/// Brings the index to where the objects are, from where they were when somebody asked last.
template <int Dim, class T>
void ActiveIndex<Dim, T>::follow(const State<Dim, T>& state)
{
    using Box = Aabb<Dim, T>;
    constexpr T nan = std::numeric_limits<T>::quiet_NaN();
    Box gone;
    std::fill_n(gone.lo.begin(), Dim, nan);
    std::fill_n(gone.hi.begin(), Dim, nan);
    // `accept` may ask in the middle of an update: the answer is still that of the last one.
    const auto box_of = [&](Index index) -> const Box& {
        const auto object = state.objects[index];
        return object.has(flag::written) ? object.before() : object.now();
    };
    const auto where = [&](std::span<const std::uint32_t> indices, Box* boxes) {
        const Box* now[index::page_capacity];
        for (std::size_t k = 0; k < indices.size(); ++k) {
            const Index index{indices[k]};
            now[k] = state.objects[index].place() == Place::active ? &box_of(index) : &gone;
            jostle::prefetch(now[k]);
            jostle::prefetch(&now[k]->hi[Dim - 1]);
        }
        for (std::size_t k = 0; k < indices.size(); ++k)
            boxes[k] = *now[k];
    };
    const bool followed = BoxIndexAccess::follow<Dim, T>(index_, where);
    if (followed && index_.size() == state.active.size()) return;
    std::pmr::vector<std::uint32_t> indices(state.options.memory);
    std::pmr::vector<Box> boxes(state.options.memory);
    const auto collect = [&](bool all) {
        for (const auto& each : state.active) {
            if (!all && index_.contains(raw(each.index))) continue;
            indices.push_back(raw(each.index));
            boxes.push_back(box_of(each.index));
        }
    };
    if (followed && state.active.size() <= index_.size() + index_.size() / 3) {
        collect(false);
        BoxIndexAccess::insert(index_, std::span<const std::uint32_t>(indices),
                               BoxView<Dim, T>(std::span<const Box>(boxes)));
    } else {
        indices.reserve(state.active.size());
        boxes.reserve(state.active.size());
        collect(true);
        BoxIndexAccess::rebuild(index_, std::span<const std::uint32_t>(indices),
                                BoxView<Dim, T>(std::span<const Box>(boxes)));
    }
}

/// Puts questions to the resting and the active objects as if they were one index's, and says which of the
/// objects count.
template <int Dim, class T>
class Asking
{
  public:
    using Implementation = typename World<Dim, T>::Implementation;

    /// `questions`: how many will be asked.
    Asking(const Implementation& world, const ObjectQueryFilter& filter, std::uint64_t questions = 1)
        : state_(world.state),
          reader_(filter.accept ? &world.readers : nullptr),
          filter_(filter),
          exclude_(state_.ids.is_good(filter.exclude) ? filter.exclude.index : Hit<T>::none),
          masked_(is_masked(filter) && !world.in_use.load(std::memory_order_relaxed)
                      ? world.masked_indexes.of(state_, filter.category, filter.mask, questions)
                      : nullptr),
          numbers_(filter.owner != Filter::no_owner || (is_masked(filter) && !are_all_counted())),
          answers_(index::kernels_for<Dim, T>(state_.options.instruction_set), tree_of_resting(),
                   tree_of_active(world))
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
            const ObjectFilter object = state_.objects[Index{index}].filter();
            if ((object.category & filter_.mask) == 0 || (filter_.category & object.mask) == 0) return false;
            if (object.owner == filter_.owner && filter_.owner != Filter::no_owner) return false;
        }
        return !filter_.accept || filter_.accept(question, state_.id_of(Index{index}));
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
        return hit.id == Hit<T>::none ? ObjectHit<T>{} : ObjectHit<T>{state_.id_of(Index{hit.id}), hit.at};
    }
    [[nodiscard]] ObjectId given(std::uint32_t index) const { return state_.id_of(Index{index}); }

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
    [[nodiscard]] static bool is_masked(const ObjectQueryFilter& filter) noexcept
    {
        return filter.category != ~0u || filter.mask != ~0u;
    }
    /// Whether nothing lies in the indexes but what the masks are about.
    [[nodiscard]] bool are_all_counted() const noexcept
    {
        return masked_ != nullptr && masked_->index() != nullptr &&
               (masked_->all_active() || masked_->no_active());
    }
    [[nodiscard]] const index::Tree<Dim, T>& tree_of_resting() const noexcept
    {
        return BoxIndexAccess::tree(masked_ != nullptr && masked_->index() != nullptr ? *masked_->index()
                                                                                      : state_.resting);
    }
    [[nodiscard]] const index::Tree<Dim, T>* tree_of_active(const Implementation& world) const
    {
        if (masked_ != nullptr && masked_->no_active()) return nullptr;
        const BoxIndex<Dim, T>* active = world.active_index.of(world.state);
        return active != nullptr ? &BoxIndexAccess::tree(*active) : nullptr;
    }

    const State<Dim, T>& state_;
    Reader reader_;
    const ObjectQueryFilter& filter_;
    std::uint32_t exclude_;
    const typename MaskedIndexes<Dim, T>::Masked* masked_; // null: it wouldn't be worth it
    bool numbers_;                                         // objects are asked for their filters
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
    const world::Asking<Dim, T> asking(*implementation_, filter, lines.size());
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
    const world::Asking<Dim, T> asking(*implementation_, filter, lines.size());
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
    const world::Asking<Dim, T> asking(*implementation_, filter, regions.size());
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
    const world::Asking<Dim, T> asking(*implementation_, filter, questions.size());
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
    const world::Asking<Dim, T> asking(*implementation_, filter, questions.size());
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
    const world::Asking<Dim, T> asking(*implementation_, filter, questions.size());
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
    me.state.resting.join(boxes, all);
    if (BoxIndex<Dim, T>* const active = me.active_index.of(me.state)) {
        me.arena.begin();
        auto& more = me.arena.template list<Pair>("pairs of active objects");
        active->join(boxes, more);
        std::size_t a = more.size(), r = all.size();
        all.resize(r + a);
        while (a > 0) // from the end, so that nothing is written over
            if (r > 0 && more[a - 1] < all[r - 1])
                --r, all[r + a] = all[r];
            else
                --a, all[r + a] = more[a];
    }
    // In use as the world is, this doesn't go by an index for a mask, which the search above hasn't either.
    const world::Asking<Dim, T> asking(me, filter);
    if (!asking.takes_all())
        all.erase(std::remove_if(all.begin(), all.end(),
                                 [&](const Pair& pair) { return !asking.takes(pair.a, pair.b); }),
                  all.end());
    out.swap(all);
}

// --- Who touches whom, and where all is -------------------------------------------------------------------

namespace world {
namespace {

/// The objects of an index not less than `from` that an object touches and agrees with, ascending.
template <int Dim, class T>
void list_touching(const State<Dim, T>& state, const index::Answers<Dim, T>& answers, Index index,
                   std::uint32_t from, std::vector<std::uint32_t>& out)
{
    out.clear();
    const auto object = state.objects[index];
    if (object.place() != Place::active && object.place() != Place::resting) return;
    const ObjectFilter filter = object.filter();
    const auto agrees = [&](std::uint32_t other) {
        return other >= from && other != raw(index) && passes(filter, state.objects[Index{other}].filter()) &&
               (state.refused.empty() ||
                state.refused.find(key_of(pair_of(index, Index{other}))) == state.refused.end());
    };
    answers.all(object.has(flag::written) ? object.before() : object.now(), index::Wanted(agrees),
                World<Dim, T>::no_limit, out);
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
void World<Dim, T>::touching(ObjectId id, std::vector<ObjectId>& out) const
{
    (void)implementation_->checked(id);
    const ObjectQueryFilter all;
    const world::Asking<Dim, T> asking(*implementation_, all);
    std::vector<std::uint32_t> found;
    world::list_touching(implementation_->state, asking.answers(), world::Index{id.index}, 0, found);
    out.clear();
    for (const std::uint32_t index : found)
        out.push_back(asking.given(index));
}

template <int Dim, Coordinate T>
bool World<Dim, T>::pairs(FunctionRef<bool(ObjectId a, ObjectId b)> visit) const
{
    const world::Reader reader(&implementation_->readers);
    const ObjectQueryFilter all;
    const world::Asking<Dim, T> asking(*implementation_, all);
    std::vector<std::uint32_t> found;
    const std::uint32_t end = index_end();
    for (std::uint32_t a = 0; a < end; ++a) {
        world::list_touching(implementation_->state, asking.answers(), world::Index{a}, a + 1, found);
        for (const std::uint32_t b : found)
            if (!visit(asking.given(a), asking.given(b))) return false;
    }
    return true;
}

template <int Dim, Coordinate T>
auto World<Dim, T>::bounds() const -> std::optional<Box>
{
    const world::State<Dim, T>& state = implementation_->state;
    std::optional<Box> all;
    const auto include = [&](const BoxIndex<Dim, T>& index) {
        if (index.size() == 0) return;
        const Box hull = BoxIndexAccess::tree(index).hull();
        if (!all) all = hull;
        for (int d = 0; d < Dim; ++d) {
            all->lo[d] = std::min(all->lo[d], hull.lo[d]);
            all->hi[d] = std::max(all->hi[d], hull.hi[d]);
        }
    };
    include(state.resting);
    if (const BoxIndex<Dim, T>* const active = implementation_->active_index.of(state)) include(*active);
    return all;
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
    template JOSTLE_API bool World<Dim, T>::all(const Line<Dim, T>&, std::vector<ObjectHit<T>>&,             \
                                                const ObjectQueryFilter&, std::uint64_t) const;              \
    template JOSTLE_API std::optional<ObjectHit<T>> World<Dim, T>::first(const Line<Dim, T>&,                \
                                                                         const ObjectQueryFilter&) const;    \
    template JOSTLE_API void World<Dim, T>::first(std::span<const Line<Dim, T>>, std::span<ObjectHit<T>>,    \
                                                  const ObjectQueryFilter&) const;                           \
    template JOSTLE_API void World<Dim, T>::all(std::span<const Line<Dim, T>>, ResultLists<ObjectHit<T>>&,   \
                                                const ObjectQueryFilter&, std::uint64_t) const;
#define JOSTLE_INSTANTIATE_REGION(Dim, T, Region)                                                            \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Region)                                                              \
    template JOSTLE_API bool World<Dim, T>::all(const Region<Dim, T>&, std::vector<ObjectId>&,               \
                                                const ObjectQueryFilter&, std::uint64_t) const;              \
    template JOSTLE_API void World<Dim, T>::all(std::span<const Region<Dim, T>>, ResultLists<ObjectId>&,     \
                                                const ObjectQueryFilter&, std::uint64_t) const;
#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template class world::ActiveIndex<Dim, T>;                                                               \
    JOSTLE_INSTANTIATE_LINE(Dim, T, Ray)                                                                     \
    JOSTLE_INSTANTIATE_LINE(Dim, T, Sweep)                                                                   \
    JOSTLE_INSTANTIATE_REGION(Dim, T, Aabb)                                                                  \
    JOSTLE_INSTANTIATE_REGION(Dim, T, Sphere)                                                                \
    JOSTLE_INSTANTIATE_REGION(Dim, T, Frustum)                                                               \
    template JOSTLE_API void World<Dim, T>::nearest(const Nearest<Dim, T>&, std::vector<ObjectHit<T>>&,      \
                                                    const ObjectQueryFilter&) const;                         \
    template JOSTLE_API void World<Dim, T>::nearest(                                                         \
        std::span<const Nearest<Dim, T>>, ResultLists<ObjectHit<T>>&, const ObjectQueryFilter&) const;       \
    template JOSTLE_API void World<Dim, T>::touching(ObjectId, std::vector<ObjectId>&) const;                \
    template JOSTLE_API bool World<Dim, T>::pairs(FunctionRef<bool(ObjectId, ObjectId)>) const;              \
    template JOSTLE_API std::optional<Aabb<Dim, T>> World<Dim, T>::bounds() const;                           \
    template JOSTLE_API void World<Dim, T>::join(const BoxView<Dim, T>&, std::pmr::vector<Pair>&,            \
                                                 const ObjectQueryFilter&);
JOSTLE_FOR_EACH_WORLD(JOSTLE_INSTANTIATE)

JOSTLE_NAMESPACE_END
