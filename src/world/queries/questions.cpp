// SPDX-License-Identifier: MIT
// Questions: each is put to the resting objects and to the active ones, as if they were one index's.
#include <algorithm>
#include <array>
#include <cstddef>
#include <memory_resource>
#include <utility>
#include <vector>

#include "base/checks.hpp"
#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "index/queries/answers.hpp"
#include "index/queries/check.hpp"
#include "world/implementation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Whether a question hands its answers to a visitor. In the indexes' own order it uses no index for a mask:
/// whether there is one depends on what other threads have asked, and the order must not.
enum class Visits
{
    none,
    in_order,
    in_own_order,
    in_join // no, but the world is in use by the question itself
};

/// Throws for a question that can't be answered.
template <int Dim, class T, class Question>
void check(const State<Dim, T>& state, const Question& question)
{
    index::check(question, Error::no_index, state.options.ignore_odd_boxes);
}
template <int Dim, class T, class Question>
void check_all(const State<Dim, T>& state, std::span<const Question> questions)
{
    index::check_all(questions, state.options.ignore_odd_boxes);
}

/// Found items on their way to what the asker gets: some hundred on the stack, more from `more`.
template <class Item>
class Items
{
    static constexpr std::size_t size = 2048;
    alignas(Item) std::byte room_[size];
    std::pmr::monotonic_buffer_resource memory_;

  public:
    explicit Items(std::pmr::memory_resource* more = std::pmr::new_delete_resource())
        : memory_(room_, size, more)
    {
        found.reserve(size / sizeof(Item));
    }

    std::pmr::vector<Item> found{&memory_};
};

/// Puts questions to the resting and the active objects as if they were one index's, and says which of the
/// objects count.
template <int Dim, class T>
class Asking
{
  public:
    using Implementation = typename World<Dim, T>::Implementation;

    /// `questions`: how many will be asked; so many may make an index for a mask pay. 0: none is made.
    Asking(const Implementation& world, const ObjectQueryFilter& filter, std::uint64_t questions = 1,
           Visits visits = Visits::none)
        : state_(world.state),
          reader_(filter.accept || visits != Visits::none ? &world.readers : nullptr),
          filter_(filter),
          exclude_(state_.ids.is_good(filter.exclude) ? filter.exclude.index : Hit<T>::none),
          sources_(sources(world, filter, questions, visits)),
          answers_(index::kernels_for<Dim, T>(state_.options.instruction_set), resting(), active(),
                   state_.shown != nullptr ? Elsewhere(elsewhere_) : Elsewhere(),
                   sources_.masks_of_active ? index::Wanted(of_active_) : index::Wanted())
    {
    }

    Asking(const Implementation& world, const ObjectQueryFilter& filter, Visits visits)
        : Asking(world, filter, 1, visits)
    {
    }

    [[nodiscard]] const index::Answers<Dim, T>& answers() const noexcept { return answers_; }
    /// What the masks are about, or more: of what rests, and of what is active, null if that is nothing.
    [[nodiscard]] const index::Tree<Dim, T>& resting() const noexcept { return *sources_.resting; }
    [[nodiscard]] const index::Tree<Dim, T>* active() const noexcept { return sources_.active; }
    [[nodiscard]] bool takes_all() const noexcept
    {
        return exclude_ == Hit<T>::none && !sources_.masks && filter_.owner == Filter::no_owner &&
               !filter_.accept;
    }
    [[nodiscard]] bool takes(std::uint32_t question, std::uint32_t index) const
    {
        if (index == exclude_) return false;
        if (sources_.masks || filter_.owner != Filter::no_owner) {
            const ObjectFilter object = state_.objects[Index{index}].filter();
            if (sources_.masks && !counts(object, filter_.category, filter_.mask)) return false;
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

    /// Not one by one: each is looked up elsewhere in memory, and so they are looked up side by side.
    template <class Item, class Out>
    void append_given(const std::pmr::vector<Item>& items, Out& out) const
    {
        const std::size_t before = out.size();
        out.resize(before + items.size());
        std::transform(items.begin(), items.end(), out.begin() + static_cast<std::ptrdiff_t>(before),
                       [this](const Item& item) { return given(item); });
    }

    /// A single question: find(wanted, items) is one of the answers.
    template <class Item, class Out, class Find>
    bool list(std::vector<Out>& out, const Find& find) const
    {
        out.clear();
        Items<Item> items;
        const bool more = with(0, [&](index::Wanted wanted) { return find(wanted, items.found); });
        append_given(items.found, out);
        return more;
    }

  private:
    /// Where to look, and which of those who are found there the masks still have to be held against.
    struct Sources
    {
        const index::Tree<Dim, T>* resting;
        const index::Tree<Dim, T>* active; // null: nobody
        bool masks;                        // all of them
        bool masks_of_active;              // those who are active
    };
    static Sources sources(const Implementation& world, const ObjectQueryFilter& filter,
                           std::uint64_t questions, Visits visits)
    {
        const State<Dim, T>& state = world.state;
        const bool is_masked = filter.category != ~0u || filter.mask != ~0u;
        Sources sources{&BoxIndexAccess::tree(state.resting), nullptr, is_masked, false};
        const typename MaskedIndexes<Dim, T>::Masked* masked = nullptr; // it wouldn't be worth it
        const bool is_free = visits == Visits::in_join || !world.in_use.load(std::memory_order_relaxed);
        if (is_masked && visits != Visits::in_own_order && is_free)
            masked = world.masked_indexes.of(state, filter.category, filter.mask, questions);
        const bool rest_apart = masked != nullptr && masked->index() != nullptr;
        if (rest_apart) sources.resting = &BoxIndexAccess::tree(*masked->index());
        // Of who is active, and of filters, it knows what the last update left, not what apply() shows.
        const BoxIndex<Dim, T>* active = nullptr;
        if (masked != nullptr && state.shown == nullptr) {
            active = masked->index_of_active();
            sources.masks = !rest_apart;
            sources.masks_of_active = rest_apart && active == nullptr && !masked->all_active();
            if (masked->no_active()) return sources;
        }
        if (active == nullptr) active = world.active_index.of(state);
        if (active != nullptr) sources.active = &BoxIndexAccess::tree(*active);
        return sources;
    }

    const State<Dim, T>& state_;
    Reader reader_;
    const ObjectQueryFilter& filter_;
    std::uint32_t exclude_;
    const Sources sources_;
    struct OfActive
    {
        const State<Dim, T>& state;
        const ObjectQueryFilter& filter;
        bool operator()(std::uint32_t index) const noexcept
        {
            return counts(state.objects[Index{index}].filter(), filter.category, filter.mask);
        }
    } of_active_{state_, filter_}; // which of these the masks are about
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
    } elsewhere_{state_}; // than in the index of what rests: where apply() has put it
    index::Answers<Dim, T> answers_;
};

/// A batch of questions.
template <int Dim, class T>
class AskingMany
{
  public:
    using Implementation = typename World<Dim, T>::Implementation;
    using Filters = detail::QuestionFilters<ObjectQueryFilter>;

    AskingMany(const Implementation& world, const Filters& filters, std::size_t questions,
               Visits visits = Visits::none)
        : world_(world), count_(questions), filters_(filters), visits_(visits)
    {
        filters.check(questions);
        if (filters.one_each())
            prepare();
        else
            for_all_.emplace(world, filters[0], questions, visits);
    }

    /// Calls body(asking, i, wanted) for one question.
    template <class Body>
    auto with(std::size_t i, const Body& body) const
    {
        const auto ask = [&](const Asking<Dim, T>& asking) {
            return asking.with(i, [&](index::Wanted wanted) { return body(asking, i, wanted); });
        };
        return for_all_ ? ask(*for_all_) : ask(Asking<Dim, T>(world_, filters_[i], 0, visits_));
    }
    /// Calls body(asking, i, wanted) for each question.
    template <class Body>
    void each(const Body& body) const
    {
        index::each_question(*world_.state.executor, count_, [&](std::size_t i) { with(i, body); });
    }
    /// find(asking, i, wanted, items) finds the items of question i, and returns whether there are more.
    template <class Item, class Out, class Find>
    void lists(ResultLists<Out>& out, const Find& find) const
    {
        out.fill(count_, index::of_batch(*world_.state.executor),
                 [&](std::size_t i, std::pmr::vector<Out>& items) {
                     Items<Item> some(items.get_allocator().resource());
                     return with(i, [&](const Asking<Dim, T>& asking, std::size_t, index::Wanted wanted) {
                         const bool more = find(asking, i, wanted, some.found);
                         asking.append_given(some.found, items);
                         return more;
                     });
                 });
    }

  private:
    /// Brings the indexes up to date that questions with these filters go by: executors don't nest, and their
    /// tasks can't make any.
    void prepare() const
    {
        struct Kind
        {
            const ObjectQueryFilter* filter;
            std::uint64_t questions;
        };
        // By masks. A world keeps indexes of their own for four: of eight, some go by those of all objects,
        // as any further ones do.
        std::array<Kind, 8> kinds;
        std::size_t known = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            const ObjectQueryFilter& filter = filters_[i];
            std::size_t k = 0;
            while (k < known &&
                   (kinds[k].filter->category != filter.category || kinds[k].filter->mask != filter.mask))
                ++k;
            if (k == kinds.size()) continue;
            if (k == known) kinds[known++] = {&filter, 0};
            ++kinds[k].questions;
        }
        for (std::size_t k = 0; k < known; ++k)
            (void)Asking<Dim, T>(world_, *kinds[k].filter, kinds[k].questions, visits_);
    }

    const Implementation& world_;
    std::size_t count_;
    Filters filters_;
    Visits visits_;
    std::optional<Asking<Dim, T>> for_all_;
};

} // namespace world

template <int Dim, Coordinate T>
template <LineOf<Dim, T> Line>
std::optional<ObjectHit<T>> World<Dim, T>::first(const Line& line, const ObjectQueryFilter& filter) const
{
    world::check(implementation_->state, line);
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
        world::check(implementation_->state, question);                                                      \
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

#define JOSTLE_ASK_NEAREST(Question)                                                                         \
    template <int Dim, Coordinate T>                                                                         \
    void World<Dim, T>::nearest(const Question<Dim, T>& question, std::vector<ObjectHit<T>>& out,            \
                                const ObjectQueryFilter& filter) const                                       \
    {                                                                                                        \
        world::check(implementation_->state, question);                                                      \
        const world::Asking<Dim, T> asking(*implementation_, filter);                                        \
        asking.template list<Hit<T>>(out, [&](index::Wanted wanted, auto& items) {                           \
            asking.answers().nearest(question, wanted, items);                                               \
            return false;                                                                                    \
        });                                                                                                  \
    }
JOSTLE_ASK_NEAREST(Nearest)
JOSTLE_ASK_NEAREST(NearestToBox)
#undef JOSTLE_ASK_NEAREST

// --- Handed over as they are found ---

#define JOSTLE_VISIT(Question)                                                                               \
    template <int Dim, Coordinate T>                                                                         \
    bool World<Dim, T>::visit(const Question<Dim, T>& question, ObjectHitVisitor<T> visitor,                 \
                              const ObjectQueryFilter& filter) const                                         \
    {                                                                                                        \
        world::check(implementation_->state, question);                                                      \
        const world::Asking<Dim, T> asking(*implementation_, filter, world::Visits::in_order);               \
        const auto visit = [&](const Hit<T>& hit, T& bound) { return visitor(asking.given(hit), bound); };   \
        return asking.with(0, [&](index::Wanted wanted) {                                                    \
            return asking.answers().visit_in_order(question, wanted, visit);                                 \
        });                                                                                                  \
    }
JOSTLE_VISIT(Ray)
JOSTLE_VISIT(Sweep)
JOSTLE_VISIT(Nearest)
JOSTLE_VISIT(NearestToBox)
#undef JOSTLE_VISIT

#define JOSTLE_VISIT(Region)                                                                                 \
    template <int Dim, Coordinate T>                                                                         \
    bool World<Dim, T>::visit(const Region<Dim, T>& region, ObjectVisitor visitor,                           \
                              const ObjectQueryFilter& filter) const                                         \
    {                                                                                                        \
        world::check(implementation_->state, region);                                                        \
        const world::Asking<Dim, T> asking(*implementation_, filter, world::Visits::in_own_order);           \
        const auto visit = [&](std::uint32_t index) { return visitor(asking.given(index)); };                \
        return asking.with(                                                                                  \
            0, [&](index::Wanted wanted) { return asking.answers().visit(region, wanted, visit); });         \
    }
JOSTLE_VISIT(Aabb)
JOSTLE_VISIT(Sphere)
JOSTLE_VISIT(Frustum)
#undef JOSTLE_VISIT

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
bool World<Dim, T>::any(const Question& question, const ObjectQueryFilter& filter) const
{
    world::check(implementation_->state, question);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    return asking.with(0, [&](index::Wanted wanted) { return asking.answers().any(question, wanted); });
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
std::uint64_t World<Dim, T>::count(const Question& question, const ObjectQueryFilter& filter) const
{
    world::check(implementation_->state, question);
    const world::Asking<Dim, T> asking(*implementation_, filter);
    return asking.with(0, [&](index::Wanted wanted) { return asking.answers().count(question, wanted); });
}

// --- Many at once ----------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
template <LineOf<Dim, T> Line>
void World<Dim, T>::first_of_each(std::span<const Line> lines, std::span<ObjectHit<T>> out,
                                  const QuestionFilters& filters) const
{
    index::check_room(lines.size(), out.size());
    world::check_all(implementation_->state, lines);
    const world::AskingMany<Dim, T> many(*implementation_, filters, lines.size());
    many.each([&](const auto& asking, std::size_t i, index::Wanted wanted) {
        out[i] = asking.given(asking.answers().first(lines[i], wanted));
    });
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
void World<Dim, T>::all_of_each(std::span<const Question> questions, ResultLists<AnswerTo<Question>>& out,
                                const QuestionFilters& filters, std::uint64_t max_results) const
{
    world::check_all(implementation_->state, questions);
    const world::AskingMany<Dim, T> many(*implementation_, filters, questions.size());
    many.template lists<typename index::ItemOf<Question>::Item>(
        out, [&](const auto& asking, std::size_t i, index::Wanted wanted, auto& items) {
            return asking.answers().all(questions[i], wanted, max_results, items);
        });
}

template <int Dim, Coordinate T>
template <NearestOf<Dim, T> Question>
void World<Dim, T>::nearest_of_each(std::span<const Question> questions, ResultLists<ObjectHit<T>>& out,
                                    const QuestionFilters& filters) const
{
    world::check_all(implementation_->state, questions);
    const world::AskingMany<Dim, T> many(*implementation_, filters, questions.size());
    many.template lists<Hit<T>>(out,
                                [&](const auto& asking, std::size_t i, index::Wanted wanted, auto& items) {
                                    asking.answers().nearest(questions[i], wanted, items);
                                    return false;
                                });
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
void World<Dim, T>::any_of_each(std::span<const Question> questions, BoolSpan out,
                                const QuestionFilters& filters) const
{
    index::check_room(questions.size(), out.size());
    world::check_all(implementation_->state, questions);
    const world::AskingMany<Dim, T> many(*implementation_, filters, questions.size());
    many.each([&](const auto& asking, std::size_t i, index::Wanted wanted) {
        out[i] = asking.answers().any(questions[i], wanted);
    });
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
void World<Dim, T>::count_of_each(std::span<const Question> questions, std::span<std::uint64_t> out,
                                  const QuestionFilters& filters) const
{
    index::check_room(questions.size(), out.size());
    world::check_all(implementation_->state, questions);
    const world::AskingMany<Dim, T> many(*implementation_, filters, questions.size());
    many.each([&](const auto& asking, std::size_t i, index::Wanted wanted) {
        out[i] = asking.answers().count(questions[i], wanted);
    });
}

namespace world {
namespace {

/// A category and a mask that select whatever one of the filters selects.
inline ObjectQueryFilter masks_together(const detail::QuestionFilters<ObjectQueryFilter>& filters,
                                        std::size_t questions)
{
    ObjectQueryFilter all;
    all.category = all.mask = 0;
    const std::size_t count = filters.one_each() ? questions : 1;
    for (std::size_t i = 0; i < count; ++i) {
        all.category |= filters[i].category;
        all.mask |= filters[i].mask;
    }
    return all;
}

/// All pairs of one of the boxes and an object that pass the filters, ascending.
template <int Dim, class T>
void join(typename World<Dim, T>::Implementation& me, const BoxView<Dim, T>& boxes,
          std::pmr::vector<Pair>& out, const detail::QuestionFilters<ObjectQueryFilter>& filters)
{
    filters.check(boxes.size());
    const InUse call(me.in_use, "World");
    std::pmr::vector<Pair> all(std::move(out)); // if anything below throws, the list is empty
    out.clear();
    const ObjectQueryFilter masks = masks_together(filters, boxes.size());
    const Asking<Dim, T> where(me, masks, boxes.size(), Visits::in_join);
    BoxIndexAccess::join(me.state.resting, where.resting(), boxes, all);
    if (me.state.shown != nullptr)
        std::erase_if(all, [&](const Pair& pair) { return !me.state.is_shown_resting(Index{pair.b}); });
    if (where.active() != nullptr) {
        if (me.applied)
            me.arena.begin_again();
        else
            me.arena.begin();
        auto& more = me.arena.template list<Pair>("pairs of active objects");
        BoxIndexAccess::join(me.state.resting, *where.active(), boxes, more);
        std::size_t a = more.size(), r = all.size();
        all.resize(r + a);
        while (a > 0) // from the end, so that nothing is written over
            if (r > 0 && more[a - 1] < all[r - 1])
                --r, all[r + a] = all[r];
            else
                --a, all[r + a] = more[a];
    }
    // In use as the world is, these don't go by an index for a mask, and hold all against their own.
    std::optional<Asking<Dim, T>> asking;
    std::size_t asker = boxes.size();
    const auto is_refused = [&](const Pair& pair) {
        if (filters.one_each() && pair.a != asker) asking.emplace(me, filters[asker = pair.a]);
        return !asking->takes(pair.a, pair.b);
    };
    if (!filters.one_each()) asking.emplace(me, filters[0]);
    if (filters.one_each() || !asking->takes_all()) std::erase_if(all, is_refused);
    out.swap(all);
}

/// Hands the same pairs to the visitor, box by box.
template <int Dim, class T>
bool visit_joined(const typename World<Dim, T>::Implementation& me, const BoxView<Dim, T>& boxes,
                  ObjectJoinVisitor visitor, const detail::QuestionFilters<ObjectQueryFilter>& filters)
{
    index::check_joined(boxes, me.state.options.ignore_odd_boxes);
    const AskingMany<Dim, T> asking(me, filters, boxes.size(), Visits::in_own_order);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const auto visit_all = [&](const Asking<Dim, T>& one, std::size_t, index::Wanted wanted) {
            return one.answers().visit(boxes[i], wanted, [&](std::uint32_t index) {
                return visitor(static_cast<std::uint32_t>(i), one.given(index));
            });
        };
        if (!asking.with(i, visit_all)) return false;
    }
    return true;
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
void World<Dim, T>::join(const Boxes& boxes, std::pmr::vector<Pair>& out, const ObjectQueryFilter& filter)
{
    world::join<Dim, T>(*implementation_, boxes, out, filter);
}

template <int Dim, Coordinate T>
void World<Dim, T>::join(const Boxes& boxes, std::pmr::vector<Pair>& out,
                         FilterOfEach<ObjectQueryFilter> filters)
{
    world::join<Dim, T>(*implementation_, boxes, out, filters);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::join(const Boxes& boxes, ObjectJoinVisitor visitor, const ObjectQueryFilter& filter) const
{
    return world::visit_joined<Dim, T>(*implementation_, boxes, visitor, filter);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::join(const Boxes& boxes, ObjectJoinVisitor visitor,
                         FilterOfEach<ObjectQueryFilter> filters) const
{
    return world::visit_joined<Dim, T>(*implementation_, boxes, visitor, filters);
}

// --- Who touches whom, and where all is -------------------------------------------------------------------

namespace world {
namespace {

/// Calls body(answers' question, wanted) about the objects not less than `from` that an object touches and
/// agrees with.
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
    world::Items<std::uint32_t> others;
    world::list_touching(implementation_->state, asking.answers(), world::Index{id.index}, 0, others.found);
    out.clear();
    asking.append_given(others.found, out);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::touching(ObjectId id, ObjectVisitor visitor) const
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
    const world::Reader reader(&implementation_->readers);
    const ObjectQueryFilter all;
    const world::Asking<Dim, T> asking(*implementation_, all);
    world::Items<std::uint32_t> others;
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
    // What apply() has written to is not where the index of what rests has it.
    const auto is_there = [&](std::uint32_t i) { return state.is_shown_resting(world::Index{i}); };
    const index::Tree<Dim, T>& resting = BoxIndexAccess::tree(state.resting);
    include(state.shown == nullptr ? resting.hull() : resting.hull_of(is_there));
    if (const BoxIndex<Dim, T>* const active = implementation_->active_index.of(state))
        include(BoxIndexAccess::tree(*active).hull());
    return all;
}

#define JOSTLE_INSTANTIATE_QUESTION(Dim, T, Question, Visitor)                                               \
    template JOSTLE_API bool World<Dim, T>::all(const Question<Dim, T>&,                                     \
                                                std::vector<AnswerTo<Question<Dim, T>>>&,                    \
                                                const ObjectQueryFilter&, std::uint64_t) const;              \
    template JOSTLE_API bool World<Dim, T>::visit(const Question<Dim, T>&, Visitor,                          \
                                                  const ObjectQueryFilter&) const;                           \
    template JOSTLE_API bool World<Dim, T>::any(const Question<Dim, T>&, const ObjectQueryFilter&) const;    \
    template JOSTLE_API std::uint64_t World<Dim, T>::count(const Question<Dim, T>&,                          \
                                                           const ObjectQueryFilter&) const;                  \
    template JOSTLE_API void World<Dim, T>::all_of_each(std::span<const Question<Dim, T>>,                   \
                                                        ResultLists<AnswerTo<Question<Dim, T>>>&,            \
                                                        const QuestionFilters&, std::uint64_t) const;        \
    template JOSTLE_API void World<Dim, T>::any_of_each(std::span<const Question<Dim, T>>, BoolSpan,         \
                                                        const QuestionFilters&) const;                       \
    template JOSTLE_API void World<Dim, T>::count_of_each(                                                   \
        std::span<const Question<Dim, T>>, std::span<std::uint64_t>, const QuestionFilters&) const;
#define JOSTLE_INSTANTIATE_LINE(Dim, T, Line)                                                                \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Line, ObjectHitVisitor<T>)                                           \
    template JOSTLE_API std::optional<ObjectHit<T>> World<Dim, T>::first(const Line<Dim, T>&,                \
                                                                         const ObjectQueryFilter&) const;    \
    template JOSTLE_API void World<Dim, T>::first_of_each(                                                   \
        std::span<const Line<Dim, T>>, std::span<ObjectHit<T>>, const QuestionFilters&) const;
#define JOSTLE_INSTANTIATE_NEAREST(Dim, T, Nearest)                                                          \
    template JOSTLE_API bool World<Dim, T>::visit(const Nearest<Dim, T>&, ObjectHitVisitor<T>,               \
                                                  const ObjectQueryFilter&) const;                           \
    template JOSTLE_API void World<Dim, T>::nearest(const Nearest<Dim, T>&, std::vector<ObjectHit<T>>&,      \
                                                    const ObjectQueryFilter&) const;                         \
    template JOSTLE_API void World<Dim, T>::nearest_of_each(                                                 \
        std::span<const Nearest<Dim, T>>, ResultLists<ObjectHit<T>>&, const QuestionFilters&) const;
#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    JOSTLE_INSTANTIATE_LINE(Dim, T, Ray)                                                                     \
    JOSTLE_INSTANTIATE_LINE(Dim, T, Sweep)                                                                   \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Aabb, ObjectVisitor)                                                 \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Sphere, ObjectVisitor)                                               \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Frustum, ObjectVisitor)                                              \
    JOSTLE_INSTANTIATE_NEAREST(Dim, T, Nearest)                                                              \
    JOSTLE_INSTANTIATE_NEAREST(Dim, T, NearestToBox)                                                         \
    template JOSTLE_API void World<Dim, T>::touching(ObjectId, std::vector<ObjectId>&) const;                \
    template JOSTLE_API bool World<Dim, T>::pairs(FunctionRef<bool(ObjectId, ObjectId)>) const;              \
    template JOSTLE_API std::optional<Aabb<Dim, T>> World<Dim, T>::bounds() const;                           \
    template JOSTLE_API bool World<Dim, T>::touching(ObjectId, ObjectVisitor) const;                         \
    template JOSTLE_API void World<Dim, T>::join(const BoxView<Dim, T>&, std::pmr::vector<Pair>&,            \
                                                 const ObjectQueryFilter&);                                  \
    template JOSTLE_API void World<Dim, T>::join(const BoxView<Dim, T>&, std::pmr::vector<Pair>&,            \
                                                 FilterOfEach<ObjectQueryFilter>);                           \
    template JOSTLE_API bool World<Dim, T>::join(const BoxView<Dim, T>&, ObjectJoinVisitor,                  \
                                                 const ObjectQueryFilter&) const;                            \
    template JOSTLE_API bool World<Dim, T>::join(const BoxView<Dim, T>&, ObjectJoinVisitor,                  \
                                                 FilterOfEach<ObjectQueryFilter>) const;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE_QUESTION
#undef JOSTLE_INSTANTIATE_LINE
#undef JOSTLE_INSTANTIATE_NEAREST
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
