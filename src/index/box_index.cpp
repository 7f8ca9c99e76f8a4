// SPDX-License-Identifier: MIT
// The edge of the index: arguments checked, filters, batches, the order of results.
#include "jostle/box_index.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "base/checks.hpp"
#include "base/instantiate.hpp"
#include "base/per_thread.hpp"
#include "index/box_index_access.hpp"
#include "index/kernels/kernels.hpp"
#include "index/queries/answers.hpp"
#include "index/queries/check.hpp"
#include "index/queries/join.hpp"
#include "index/queries/pair_answers.hpp"
#include "index/tree/odd_boxes.hpp"
#include "index/tree/tree.hpp"

JOSTLE_NAMESPACE_BEGIN

using index::Wanted;

namespace {

/// A question that calls the user's code, on this thread. As long as it lasts, nothing that this code calls
/// may change the index, or the search would go on reading memory that has been reused.
class Answering
{
  public:
    /// Null: it calls none.
    explicit Answering(const void* index) noexcept : index_(index), outer_(PerThread<const Answering>::get())
    {
        if (index_ != nullptr) PerThread<const Answering>::set(this);
    }
    Answering(const Answering&) = delete;
    Answering& operator=(const Answering&) = delete;
    ~Answering()
    {
        if (index_ != nullptr) PerThread<const Answering>::set(outer_);
    }
    static void check_none(const void* index)
    {
        for (const Answering* each = PerThread<const Answering>::get(); each != nullptr; each = each->outer_)
            if (each->index_ == index)
                throw Error(ErrorCode::invalid_argument,
                            "this BoxIndex is answering a question, which runs this callback; change it "
                            "afterwards");
    }

  private:
    const void* const index_;
    const Answering* const outer_;
};

/// A filter applied to the objects of one question.
class Asked
{
  public:
    explicit Asked(const QueryFilter& filter, std::uint32_t question = 0)
        : filter_(filter), question_(question)
    {
    }
    bool operator()(std::uint32_t id) const
    {
        if (id == filter_.exclude) return false;
        if (!filter_.mask.empty() && ((filter_.category[id] & filter_.asker_mask) == 0 ||
                                      (filter_.asker_category & filter_.mask[id]) == 0))
            return false;
        if (!filter_.owner.empty() && filter_.asker_owner != Filter::no_owner &&
            filter_.owner[id] == filter_.asker_owner)
            return false;
        return !filter_.accept || filter_.accept(question_, id);
    }
    /// Null if everything passes.
    static bool trivial(const QueryFilter& filter)
    {
        return filter.exclude == ~std::uint32_t{0} && filter.mask.empty() && filter.owner.empty() &&
               !filter.accept;
    }

  private:
    const QueryFilter& filter_;
    std::uint32_t question_;
};

} // namespace

template <int Dim, Coordinate T>
struct BoxIndex<Dim, T>::Implementation
{
    explicit Implementation(const IndexOptions& given)
        : options(given),
          executor(given.executor != nullptr ? given.executor : &default_executor()),
          kernels(index::kernels_for<Dim, T>(checked(given.instruction_set))),
          tree(given),
          odd(given.memory),
          joins(given)
    {
    }

    /// Throws if what changes the index is called by the code that a question calls.
    void check_change() const { Answering::check_none(this); }

    void build(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
    {
        if (all_valid(ids, boxes))
            tree.build(ids, boxes);
        else
            odd.build(tree, ids, boxes);
    }

    [[nodiscard]] bool contains(std::uint32_t id) const noexcept
    {
        return tree.contains(id) || odd.contains(id);
    }
    /// Whether a call with these boxes is one of the tree alone: there is no odd box in it, nor in the index.
    /// Throws for an odd box unless they are to be ignored.
    [[nodiscard]] bool all_valid(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes) const
    {
        check_pointers(boxes);
        if (options.ignore_odd_boxes) return odd.size() == 0 && count_odd(boxes) == 0;
        validate_boxes_of(boxes, "", ids);
        return true;
    }

    /// Throws if an id occurs twice, or, where it is to be there (true) or not (false), if it isn't or is.
    void check_ids(std::span<const std::uint32_t> ids, std::optional<bool> wanted_here) const
    {
        for (std::size_t i = 0; i < ids.size(); ++i) {
            if (ids[i] == Hit<T>::none)
                throw Error(ErrorCode::invalid_argument,
                            "entry " + std::to_string(i) + ": 4294967295 is no id; choose a smaller one", i);
            if (wanted_here && contains(ids[i]) != *wanted_here)
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

    [[nodiscard]] index::Answers<Dim, T> answers() const { return {kernels, tree}; }

    /// Calls body(wanted) with the filter of one question.
    template <class Body>
    auto filtered(const QueryFilter& filter, std::uint32_t question, const Body& body) const
    {
        if (Asked::trivial(filter)) return body(Wanted());
        const Answering answering(filter.accept ? this : nullptr);
        const Asked asked(filter, question);
        return body(Wanted(asked));
    }

    template <class Question>
    void check(const Question& question, const QueryFilter& filter) const
    {
        index::check(question, Error::no_index, options.ignore_odd_boxes);
        index::check(filter, tree.id_end());
    }
    template <class Question>
    void check_all(std::span<const Question> questions, const QuestionFilters& filters) const
    {
        index::check_all(questions, options.ignore_odd_boxes);
        check_filters(filters, questions.size());
    }
    void check_filters(const QuestionFilters& filters, std::size_t questions) const
    {
        if (!filters.one_each()) return index::check(filters[0], tree.id_end());
        filters.check(questions);
        for (std::size_t i = 0; i < questions; ++i)
            index::check(filters[i], tree.id_end(), i);
    }

    // Single questions.

    template <class Line>
    std::optional<Hit<T>> first(const Line& line, const QueryFilter& filter) const
    {
        check(line, filter);
        const Hit<T> hit = filtered(filter, 0, [&](Wanted wanted) { return answers().first(line, wanted); });
        return hit.id == Hit<T>::none ? std::nullopt : std::optional<Hit<T>>(hit);
    }
    template <class Question, class Item>
    bool all(const Question& question, std::vector<Item>& out, const QueryFilter& filter,
             std::uint64_t max_results) const
    {
        out.clear();
        check(question, filter);
        return filtered(filter, 0,
                        [&](Wanted wanted) { return answers().all(question, wanted, max_results, out); });
    }
    template <class Question>
    void nearest(const Question& question, std::vector<Hit<T>>& out, const QueryFilter& filter) const
    {
        out.clear();
        check(question, filter);
        filtered(filter, 0, [&](Wanted wanted) { answers().nearest(question, wanted, out); });
    }

    // Batches.

    /// Calls body(i, wanted) for each question.
    template <class Body>
    void each(std::size_t count, const QuestionFilters& filters, const Body& body) const
    {
        index::each_question(*executor, count, [&](std::size_t i) {
            filtered(filters[i], static_cast<std::uint32_t>(i), [&](Wanted wanted) { body(i, wanted); });
        });
    }
    /// find(i, wanted, items) appends the results of question i and returns whether there are more.
    template <class Item, class Find>
    void lists(std::size_t count, ResultLists<Item>& out, const QuestionFilters& filters,
               const Find& find) const
    {
        out.fill(count, index::of_batch(*executor), [&](std::size_t i, auto& items) {
            return filtered(filters[i], static_cast<std::uint32_t>(i),
                            [&](Wanted wanted) { return find(i, wanted, items); });
        });
    }

    /// Of boxes and a tree's objects, in the working memory of this index.
    void join(const index::Tree<Dim, T>& with, const BoxView<Dim, T>& boxes, std::pmr::vector<Pair>& pairs)
    {
        index::check_joined(boxes, options.ignore_odd_boxes);
        if (options.ignore_odd_boxes && count_odd(boxes) != 0) {
            index::ValidBoxes<Dim, T> valid(options.memory, boxes);
            joins.run(with, *executor, BoxView<Dim, T>(valid.boxes), pairs);
            for (Pair& pair : pairs)
                pair.a = valid.ids[pair.a];
        } else {
            joins.run(with, *executor, boxes, pairs);
        }
    }
    void join(const BoxView<Dim, T>& boxes, std::pmr::vector<Pair>& out, const QuestionFilters& filters)
    {
        std::pmr::vector<Pair> pairs(std::move(out)); // if anything below throws, the result is empty
        out.clear();
        check_filters(filters, boxes.size());
        join(tree, boxes, pairs);
        if (filters.one_each() || !Asked::trivial(filters[0])) {
            const Answering answering(this);
            std::erase_if(pairs, [&](const Pair& pair) { return !Asked(filters[pair.a], pair.a)(pair.b); });
        }
        out = std::move(pairs);
    }
    bool join(const BoxView<Dim, T>& boxes, PairVisitor visitor, const QuestionFilters& filters) const
    {
        index::check_joined(boxes, options.ignore_odd_boxes);
        check_filters(filters, boxes.size());
        const Answering answering(this);
        const index::Answers<Dim, T> given = answers();
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            const auto a = static_cast<std::uint32_t>(i);
            const bool goes_on = filtered(filters[i], a, [&](Wanted wanted) {
                return given.visit(boxes[i], wanted, [&](std::uint32_t b) { return visitor(a, b); });
            });
            if (!goes_on) return false;
        }
        return true;
    }
    [[nodiscard]] index::Roots<Dim, T> roots_with(const Implementation& other) const noexcept
    {
        return {tree.root(), other.tree.root(), this == &other, {}};
    }
    bool pairs(const Implementation& other, PairVisitor visitor) const
    {
        const Answering answering(this), other_answering(&other);
        const index::Roots<Dim, T> roots = roots_with(other);
        return kernels.pairs({&roots, 1}, visitor);
    }
    bool closest_pairs(const Implementation& other, PairHitVisitor<T> visitor, T max_distance) const
    {
        index::check_max_distance(max_distance);
        const Answering answering(this), other_answering(&other);
        const index::Roots<Dim, T> roots = roots_with(other);
        return index::visit_closest<Dim, T>(kernels, {&roots, 1}, max_distance * max_distance, visitor,
                                            tree.closest_work());
    }

    IndexOptions options;
    Executor* executor;
    const index::Kernels<Dim, T>& kernels;
    index::Tree<Dim, T> tree;
    index::OddBoxes<Dim, T> odd;
    index::Join<Dim, T> joins;
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
    implementation_->check_change();
    implementation_->build({}, boxes);
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::build(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    implementation_->check_change();
    check_one_id_each(ids.size(), boxes.size());
    implementation_->check_ids(ids, std::nullopt);
    implementation_->build(ids, boxes);
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::insert(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    Implementation& all = *implementation_;
    all.check_change();
    check_one_id_each(ids.size(), boxes.size());
    all.check_ids(ids, false);
    all.all_valid(ids, boxes) ? all.tree.insert(ids, boxes) : all.odd.insert(all.tree, ids, boxes);
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::erase(std::span<const std::uint32_t> ids)
{
    Implementation& all = *implementation_;
    all.check_change();
    all.check_ids(ids, true);
    all.odd.size() == 0 ? all.tree.erase(ids) : all.odd.erase(all.tree, ids);
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::move(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    Implementation& all = *implementation_;
    all.check_change();
    check_one_id_each(ids.size(), boxes.size());
    all.check_ids(ids, true);
    all.all_valid(ids, boxes) ? all.tree.move(ids, boxes) : all.odd.move(all.tree, ids, boxes);
}

template <int Dim, Coordinate T>
void BoxIndexAccess::join(BoxIndex<Dim, T>& index, const index::Tree<Dim, T>& tree,
                          const Boxes<Dim, T>& boxes, std::pmr::vector<Pair>& out)
{
    index.implementation_->join(tree, boxes, out);
}

template <int Dim, Coordinate T>
void BoxIndexAccess::look_around(BoxIndex<Dim, T>& index, const Boxes<Dim, T>& boxes)
{
    auto& inside = *index.implementation_;
    inside.joins.look_around(inside.tree, *inside.executor, boxes);
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
    implementation_->check_change();
    implementation_->tree.clear();
    implementation_->odd.clear();
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::release_memory()
{
    implementation_->check_change();
    implementation_->tree.release_memory();
    implementation_->joins.release_memory();
}

template <int Dim, Coordinate T>
std::size_t BoxIndex<Dim, T>::size() const noexcept
{
    return implementation_->tree.size() + implementation_->odd.size();
}

template <int Dim, Coordinate T>
bool BoxIndex<Dim, T>::contains(std::uint32_t id) const noexcept
{
    return implementation_->contains(id);
}

template <int Dim, Coordinate T>
Aabb<Dim, T> BoxIndex<Dim, T>::box(std::uint32_t id) const
{
    if (!contains(id))
        throw Error(ErrorCode::invalid_argument, "id " + std::to_string(id) + " is not in the index", id);
    return implementation_->odd.contains(id) ? implementation_->odd.box(id) : implementation_->tree.box(id);
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
    stats.odd = implementation_->odd.size();
    stats.objects += stats.odd;
    stats.bytes += implementation_->joins.bytes() + implementation_->odd.bytes();
    return stats;
}

template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::join(const BoxView<Dim, T>& boxes, std::pmr::vector<Pair>& out,
                            const QueryFilter& filter)
{
    implementation_->join(boxes, out, filter);
}
template <int Dim, Coordinate T>
void BoxIndex<Dim, T>::join(const BoxView<Dim, T>& boxes, std::pmr::vector<Pair>& out,
                            FilterOfEach<QueryFilter> filters)
{
    implementation_->join(boxes, out, filters);
}
template <int Dim, Coordinate T>
bool BoxIndex<Dim, T>::join(const BoxView<Dim, T>& boxes, PairVisitor visitor,
                            const QueryFilter& filter) const
{
    return implementation_->join(boxes, visitor, filter);
}
template <int Dim, Coordinate T>
bool BoxIndex<Dim, T>::join(const BoxView<Dim, T>& boxes, PairVisitor visitor,
                            FilterOfEach<QueryFilter> filters) const
{
    return implementation_->join(boxes, visitor, filters);
}

// --- Single questions ---

#define JOSTLE_FIRST(Line)                                                                                   \
    template <int Dim, Coordinate T>                                                                         \
    std::optional<Hit<T>> BoxIndex<Dim, T>::first(const Line<Dim, T>& line, const QueryFilter& filter) const \
    {                                                                                                        \
        return implementation_->first(line, filter);                                                         \
    }
JOSTLE_FIRST(Ray)
JOSTLE_FIRST(Sweep)
#undef JOSTLE_FIRST

#define JOSTLE_ALL(Question, Item)                                                                           \
    template <int Dim, Coordinate T>                                                                         \
    bool BoxIndex<Dim, T>::all(const Question<Dim, T>& question, std::vector<Item>& out,                     \
                               const QueryFilter& filter, std::uint64_t max_results) const                   \
    {                                                                                                        \
        return implementation_->all(question, out, filter, max_results);                                     \
    }
JOSTLE_ALL(Ray, Hit<T>)
JOSTLE_ALL(Sweep, Hit<T>)
JOSTLE_ALL(Aabb, std::uint32_t)
JOSTLE_ALL(Sphere, std::uint32_t)
JOSTLE_ALL(Frustum, std::uint32_t)
#undef JOSTLE_ALL

#define JOSTLE_NEAREST(Question)                                                                             \
    template <int Dim, Coordinate T>                                                                         \
    void BoxIndex<Dim, T>::nearest(const Question<Dim, T>& question, std::vector<Hit<T>>& out,               \
                                   const QueryFilter& filter) const                                          \
    {                                                                                                        \
        implementation_->nearest(question, out, filter);                                                     \
    }
JOSTLE_NEAREST(Nearest)
JOSTLE_NEAREST(NearestToBox)
#undef JOSTLE_NEAREST

#define JOSTLE_VISIT(Question, Visitor, in_which_order)                                                      \
    template <int Dim, Coordinate T>                                                                         \
    bool BoxIndex<Dim, T>::visit(const Question<Dim, T>& question, Visitor visitor,                          \
                                 const QueryFilter& filter) const                                            \
    {                                                                                                        \
        implementation_->check(question, filter);                                                            \
        const Answering answering(implementation_.get());                                                    \
        return implementation_->filtered(filter, 0, [&](Wanted wanted) {                                     \
            return implementation_->answers().in_which_order(question, wanted, visitor);                     \
        });                                                                                                  \
    }
JOSTLE_VISIT(Ray, HitVisitor<T>, visit_in_order)
JOSTLE_VISIT(Sweep, HitVisitor<T>, visit_in_order)
JOSTLE_VISIT(Nearest, HitVisitor<T>, visit_in_order)
JOSTLE_VISIT(NearestToBox, HitVisitor<T>, visit_in_order)
JOSTLE_VISIT(Aabb, IdVisitor, visit)
JOSTLE_VISIT(Sphere, IdVisitor, visit)
JOSTLE_VISIT(Frustum, IdVisitor, visit)
#undef JOSTLE_VISIT

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
bool BoxIndex<Dim, T>::closest_pairs(PairHitVisitor<T> visitor, T max_distance) const
{
    return implementation_->closest_pairs(*implementation_, visitor, max_distance);
}
template <int Dim, Coordinate T>
bool BoxIndex<Dim, T>::closest_pairs(const BoxIndex& other, PairHitVisitor<T> visitor, T max_distance) const
{
    return implementation_->closest_pairs(*other.implementation_, visitor, max_distance);
}
template <int Dim, Coordinate T>
std::optional<PairHit<T>> BoxIndex<Dim, T>::closest_pair(T max_distance) const
{
    return closest_pair(*this, max_distance);
}
template <int Dim, Coordinate T>
std::optional<PairHit<T>> BoxIndex<Dim, T>::closest_pair(const BoxIndex& other, T max_distance) const
{
    std::optional<PairHit<T>> closest;
    const auto keep_first = [&](const PairHit<T>& hit, T&) { return closest = hit, false; };
    closest_pairs(other, keep_first, max_distance);
    return closest;
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
bool BoxIndex<Dim, T>::any(const Question& question, const QueryFilter& filter) const
{
    implementation_->check(question, filter);
    return implementation_->filtered(
        filter, 0, [&](Wanted wanted) { return implementation_->answers().any(question, wanted); });
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
std::uint64_t BoxIndex<Dim, T>::count(const Question& question, const QueryFilter& filter) const
{
    implementation_->check(question, filter);
    return implementation_->filtered(
        filter, 0, [&](Wanted wanted) { return implementation_->answers().count(question, wanted); });
}

// --- Batches ---

template <int Dim, Coordinate T>
template <LineOf<Dim, T> Line>
void BoxIndex<Dim, T>::first_of_each(std::span<const Line> lines, std::span<Hit<T>> out,
                                     const QuestionFilters& filters) const
{
    index::check_room(lines.size(), out.size());
    implementation_->check_all(lines, filters);
    const index::Answers<Dim, T> answers = implementation_->answers();
    implementation_->each(lines.size(), filters,
                          [&](std::size_t i, Wanted wanted) { out[i] = answers.first(lines[i], wanted); });
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
void BoxIndex<Dim, T>::all_of_each(std::span<const Question> questions, ResultLists<AnswerTo<Question>>& out,
                                   const QuestionFilters& filters, std::uint64_t max_results) const
{
    implementation_->check_all(questions, filters);
    const index::Answers<Dim, T> answers = implementation_->answers();
    implementation_->lists(questions.size(), out, filters, [&](std::size_t i, Wanted wanted, auto& items) {
        return answers.all(questions[i], wanted, max_results, items);
    });
}

template <int Dim, Coordinate T>
template <NearestOf<Dim, T> Question>
void BoxIndex<Dim, T>::nearest_of_each(std::span<const Question> questions, ResultLists<Hit<T>>& out,
                                       const QuestionFilters& filters) const
{
    implementation_->check_all(questions, filters);
    const index::Answers<Dim, T> answers = implementation_->answers();
    implementation_->lists(questions.size(), out, filters, [&](std::size_t i, Wanted wanted, auto& items) {
        answers.nearest(questions[i], wanted, items);
        return false;
    });
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
void BoxIndex<Dim, T>::any_of_each(std::span<const Question> questions, BoolSpan out,
                                   const QuestionFilters& filters) const
{
    index::check_room(questions.size(), out.size());
    implementation_->check_all(questions, filters);
    const index::Answers<Dim, T> answers = implementation_->answers();
    implementation_->each(questions.size(), filters,
                          [&](std::size_t i, Wanted wanted) { out[i] = answers.any(questions[i], wanted); });
}

template <int Dim, Coordinate T>
template <LineOrRegionOf<Dim, T> Question>
void BoxIndex<Dim, T>::count_of_each(std::span<const Question> questions, std::span<std::uint64_t> out,
                                     const QuestionFilters& filters) const
{
    index::check_room(questions.size(), out.size());
    implementation_->check_all(questions, filters);
    const index::Answers<Dim, T> answers = implementation_->answers();
    implementation_->each(questions.size(), filters, [&](std::size_t i, Wanted wanted) {
        out[i] = answers.count(questions[i], wanted);
    });
}

#define JOSTLE_INSTANTIATE_QUESTION(Dim, T, Question)                                                        \
    template JOSTLE_API bool BoxIndex<Dim, T>::any(const Question<Dim, T>&, const QueryFilter&) const;       \
    template JOSTLE_API std::uint64_t BoxIndex<Dim, T>::count(const Question<Dim, T>&, const QueryFilter&)   \
        const;                                                                                               \
    template JOSTLE_API void BoxIndex<Dim, T>::all_of_each(std::span<const Question<Dim, T>>,                \
                                                           ResultLists<AnswerTo<Question<Dim, T>>>&,         \
                                                           const QuestionFilters&, std::uint64_t) const;     \
    template JOSTLE_API void BoxIndex<Dim, T>::any_of_each(std::span<const Question<Dim, T>>, BoolSpan,      \
                                                           const QuestionFilters&) const;                    \
    template JOSTLE_API void BoxIndex<Dim, T>::count_of_each(                                                \
        std::span<const Question<Dim, T>>, std::span<std::uint64_t>, const QuestionFilters&) const;
#define JOSTLE_INSTANTIATE_LINE(Dim, T, Line)                                                                \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Line)                                                                \
    template JOSTLE_API void BoxIndex<Dim, T>::first_of_each(                                                \
        std::span<const Line<Dim, T>>, std::span<Hit<T>>, const QuestionFilters&) const;
#define JOSTLE_INSTANTIATE_NEAREST(Dim, T, Nearest)                                                          \
    template JOSTLE_API void BoxIndex<Dim, T>::nearest_of_each(                                              \
        std::span<const Nearest<Dim, T>>, ResultLists<Hit<T>>&, const QuestionFilters&) const;
#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template class JOSTLE_API BoxIndex<Dim, T>;                                                              \
    template index::Tree<Dim, T>& BoxIndexAccess::tree(BoxIndex<Dim, T>&) noexcept;                          \
    template const index::Tree<Dim, T>& BoxIndexAccess::tree(const BoxIndex<Dim, T>&) noexcept;              \
    template void BoxIndexAccess::join(BoxIndex<Dim, T>&, const index::Tree<Dim, T>&,                        \
                                       const BoxView<Dim, T>&, std::pmr::vector<Pair>&);                     \
    template void BoxIndexAccess::look_around(BoxIndex<Dim, T>&, const BoxView<Dim, T>&);                    \
    template std::span<const index::Seen<Dim, T>> BoxIndexAccess::around(const BoxIndex<Dim, T>&,            \
                                                                         std::size_t) noexcept;              \
    JOSTLE_INSTANTIATE_LINE(Dim, T, Ray)                                                                     \
    JOSTLE_INSTANTIATE_LINE(Dim, T, Sweep)                                                                   \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Aabb)                                                                \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Sphere)                                                              \
    JOSTLE_INSTANTIATE_QUESTION(Dim, T, Frustum)                                                             \
    JOSTLE_INSTANTIATE_NEAREST(Dim, T, Nearest)                                                              \
    JOSTLE_INSTANTIATE_NEAREST(Dim, T, NearestToBox)
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE_QUESTION
#undef JOSTLE_INSTANTIATE_LINE
#undef JOSTLE_INSTANTIATE_NEAREST
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
