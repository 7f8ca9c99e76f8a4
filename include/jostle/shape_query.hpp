// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory_resource>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/cast.hpp"
#include "jostle/contact.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/process.hpp"
#include "jostle/query.hpp"
#include "jostle/shape_hits.hpp"
#include "jostle/shapes.hpp"
#include "jostle/version.hpp"
#include "jostle/world.hpp"

/// Rays, moving shapes and distances against the shapes of all objects of a World or a BoxIndex:
///
///     if (const auto hit = first_hit(world, {shapes, poses}, Ray3f{eye, direction}))
///         use(hit->id, hit->point, hit->normal);
///
/// The boxes along the way are visited nearest first, and the shapes in them asked (ray_cast, shape_cast,
/// distance), until no box is left that begins before the best hit.
///
/// Answers   are those of a loop over all shapes whose boxes the question meets. Of several that are equally
///           near, the one with the lowest id counts. Each shape must lie in its object's box, as it does in
///           the box that bounds() gives. Rounding may let a ray miss a box that it only grazes; give boxes a
///           margin where that matters.
/// Filters   are those of the World or BoxIndex. Batches take one for all questions or one for each.
/// Threads   as for the questions of a World or BoxIndex. Batches run on `executor`, not on the World's, with
///           the same answers for any number of threads. All of them read `objects`.
/// Errors    `Error` for an invalid question, which it names; for an object that a question meets and that
///           has no shape or pose, or an invalid one; size_mismatch where arrays differ in number. After an
///           error some of `out` may have been set.
/// Cost      that of finding the boxes that are nearer than the answer, and of a ray_cast, shape_cast or
///           distance() for each of them.
/// Memory    only results are allocated, unless hundreds of boxes are about equally near.

JOSTLE_NAMESPACE_BEGIN

namespace detail {

/// What is asked: a BoxIndex or a World.
template <class Asked>
struct AskedTypes;
template <int D, Coordinate C>
struct AskedTypes<BoxIndex<D, C>>
{
    static constexpr int dim = D;
    using T = C;
    using Id = std::uint32_t;
    using Filter = QueryFilter;
    static constexpr Id none = Hit<C>::none;
    static std::uint32_t number(Id id) noexcept { return id; }
};
template <int D, Coordinate C>
struct AskedTypes<World<D, C>>
{
    static constexpr int dim = D;
    using T = C;
    using Id = ObjectId;
    using Filter = ObjectQueryFilter;
    static constexpr Id none = {};
    static std::uint32_t number(Id id) noexcept { return id.index; }
};

template <class Asked>
using NumberOf = typename AskedTypes<Asked>::T;
template <class Asked>
using FilterOf = typename AskedTypes<Asked>::Filter;
template <class Asked>
using ShapesOf = PosedShapes<AskedTypes<Asked>::dim, NumberOf<Asked>>;
template <class Asked>
using HitOf = ShapeHit<AskedTypes<Asked>::dim, NumberOf<Asked>, typename AskedTypes<Asked>::Id>;
template <class Asked>
using DistanceOf = ShapeDistance<AskedTypes<Asked>::dim, NumberOf<Asked>, typename AskedTypes<Asked>::Id>;
template <class Asked>
using NearestOf = NearestShape<AskedTypes<Asked>::dim, NumberOf<Asked>>;
/// A Ray or ShapeSweep in the dimensions and numbers of what is asked.
template <class Question, class Asked>
concept CastFor = std::same_as<Question, Ray<AskedTypes<Asked>::dim, NumberOf<Asked>>> ||
                  std::same_as<Question, ShapeSweep<AskedTypes<Asked>::dim, NumberOf<Asked>>>;
template <class Many>
using ElementOf = std::remove_cvref_t<decltype(*std::data(std::declval<const Many&>()))>;

/// Refuses an invalid question by its number, whatever it would meet.
template <int Dim, Coordinate T>
JOSTLE_API void check_question(const Ray<Dim, T>& ray, std::uint64_t number);
template <int Dim, Coordinate T>
JOSTLE_API void check_question(const ShapeSweep<Dim, T>& sweep, std::uint64_t number);
template <int Dim, Coordinate T>
JOSTLE_API void check_question(const NearestShape<Dim, T>& nearest, std::uint64_t number);
/// The answers about one object. Its pose is checked, the question isn't.
template <int Dim, Coordinate T>
JOSTLE_API CastHit<Dim, T> cast_at(const Ray<Dim, T>& ray, const Shape<Dim>& shape, const Pose<Dim, T>& pose,
                                   std::uint32_t object);
template <int Dim, Coordinate T>
JOSTLE_API CastHit<Dim, T> cast_at(const ShapeSweep<Dim, T>& sweep, const Shape<Dim>& shape,
                                   const Pose<Dim, T>& pose, std::uint32_t object);
template <int Dim, Coordinate T>
JOSTLE_API Distance<Dim, T> distance_at(const NearestShape<Dim, T>& nearest, const Shape<Dim>& shape,
                                        const Pose<Dim, T>& pose, T max_distance, std::uint32_t object);
/// Where the boxes are looked for: in what a moving box sweeps, or near a box. Where `lies_in` is true, in a
/// region and in no order: for motions too short for a sweep, and for shapes without end.
template <int Dim, Coordinate T>
struct BoxQuestion
{
    Sweep<Dim, T> sweep;
    NearestToBox<Dim, T> nearest;
    Aabb<Dim, T> region;
    bool lies_in;
};
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API BoxQuestion<Dim, T> boxes_for(const ShapeSweep<Dim, T>& sweep);
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API BoxQuestion<Dim, T> boxes_for(const NearestShape<Dim, T>& nearest);

/// How great the rounded fraction or squared distance of a box can be if its shape is at `at`.
template <Coordinate T>
[[nodiscard]] constexpr T no_less(T at) noexcept
{
    return at + (at * (16 * std::numeric_limits<T>::epsilon()) + std::numeric_limits<T>::min());
}

// Calls inside(id, bound, at) for each object whose box the question meets, nearest first where there is an
// order, at `at`; 0 where there is none. It may lower `bound`, and returns whether to go on.
template <class Asked, int Dim, Coordinate T, class F>
void visit_boxes(const Asked& asked, const Ray<Dim, T>& ray, const FilterOf<Asked>& filter, F&& inside)
{
    Ray<Dim, T> longer = ray;
    longer.max_fraction = no_less(ray.max_fraction);
    asked.visit(longer, [&](const auto& hit, T& bound) { return inside(hit.id, bound, hit.at); }, filter);
}
template <class Asked, class F>
void visit_region(const Asked& asked, const Aabb<AskedTypes<Asked>::dim, NumberOf<Asked>>& region,
                  const FilterOf<Asked>& filter, F&& inside)
{
    using T = NumberOf<Asked>;
    T bound = std::numeric_limits<T>::infinity();
    asked.visit(region, [&](const auto& id) { return inside(id, bound, T(0)); }, filter);
}
template <class Asked, int Dim, Coordinate T, class F>
void visit_boxes(const Asked& asked, const ShapeSweep<Dim, T>& sweep, const FilterOf<Asked>& filter,
                 F&& inside)
{
    const BoxQuestion<Dim, T> boxes = boxes_for(sweep);
    if (boxes.lies_in) return visit_region(asked, boxes.region, filter, inside);
    asked.visit(
        boxes.sweep, [&](const auto& hit, T& bound) { return inside(hit.id, bound, hit.at); }, filter);
}
template <class Asked, int Dim, Coordinate T, class F>
void visit_boxes(const Asked& asked, const NearestShape<Dim, T>& nearest, const FilterOf<Asked>& filter,
                 F&& inside)
{
    const BoxQuestion<Dim, T> boxes = boxes_for(nearest);
    if (boxes.lies_in) return visit_region(asked, boxes.region, filter, inside);
    asked.visit(
        boxes.nearest, [&](const auto& hit, T& bound) { return inside(hit.id, bound, hit.at); }, filter);
}

/// How far away an answer is, as its order goes.
template <int Dim, Coordinate T, class Id>
[[nodiscard]] constexpr T at_of(const ShapeHit<Dim, T, Id>& hit) noexcept
{
    return hit.fraction;
}
template <int Dim, Coordinate T, class Id>
[[nodiscard]] constexpr T at_of(const ShapeDistance<Dim, T, Id>& distance) noexcept
{
    return distance.distance;
}

/// The order of answers: the nearest first, then by id.
struct AnswerOrder
{
    template <class Answer>
    bool operator()(const Answer& a, const Answer& b) const noexcept
    {
        return at_of(a) < at_of(b) || (at_of(a) == at_of(b) && a.id < b.id);
    }
};
template <class Hit, class At>
Hit with_id(const At& at, const decltype(Hit::id)& id)
{
    Hit hit;
    static_cast<At&>(hit) = at;
    hit.id = id;
    return hit;
}

template <class Asked, class Question>
HitOf<Asked> first_of(const Asked& asked, const ShapesOf<Asked>& objects, const Question& question,
                      std::uint64_t number, const FilterOf<Asked>& filter)
{
    using T = NumberOf<Asked>;
    check_question(question, number);
    HitOf<Asked> best{};
    best.fraction = std::numeric_limits<T>::infinity();
    best.id = AskedTypes<Asked>::none;
    bool any = false;
    visit_boxes(asked, question, filter, [&](const auto& id, T& bound, T) {
        const std::uint32_t object = AskedTypes<Asked>::number(id);
        objects.with(object, [&](const auto& shape, const auto& pose) {
            const auto found = with_id<HitOf<Asked>>(cast_at(question, shape, pose, object), id);
            if (found.fraction == std::numeric_limits<T>::infinity()) return;
            if (any && !AnswerOrder{}(found, best)) return;
            best = found;
            any = true;
            if (const T most = no_less(best.fraction); most < bound) bound = most;
        });
        return true;
    });
    return best;
}

/// Appends the hits to `out`, as all_hits does for one question.
template <class Asked, class Question, class Hits>
bool append_all_of(const Asked& asked, const ShapesOf<Asked>& objects, const Question& question,
                   std::uint64_t number, Hits& out, const FilterOf<Asked>& filter, std::uint64_t max_results)
{
    using T = NumberOf<Asked>;
    check_question(question, number);
    const std::size_t before = out.size();
    const auto begin = [&] { return out.begin() + static_cast<std::ptrdiff_t>(before); };
    // One more than wanted says whether there are more. Then they are a heap, the last of all on top.
    const bool limited = max_results < (std::numeric_limits<std::uint64_t>::max() >> 1U);
    bool full = false;
    visit_boxes(asked, question, filter, [&](const auto& id, T& bound, T) {
        const std::uint32_t object = AskedTypes<Asked>::number(id);
        objects.with(object, [&](const auto& shape, const auto& pose) {
            const auto found = with_id<HitOf<Asked>>(cast_at(question, shape, pose, object), id);
            if (found.fraction == std::numeric_limits<T>::infinity()) return;
            if (full) {
                if (!AnswerOrder{}(found, out[before])) return;
                std::pop_heap(begin(), out.end(), AnswerOrder{});
                out.back() = found;
                std::push_heap(begin(), out.end(), AnswerOrder{});
            } else {
                out.push_back(found);
                full = limited && out.size() - before > max_results;
                if (full) std::make_heap(begin(), out.end(), AnswerOrder{});
            }
            if (full)
                if (const T most = no_less(out[before].fraction); most < bound) bound = most;
        });
        return true;
    });
    std::sort(begin(), out.end(), AnswerOrder{});
    if (full) out.pop_back();
    return full;
}

template <class Asked>
DistanceOf<Asked> nearest_of(const Asked& asked, const ShapesOf<Asked>& objects,
                             const NearestOf<Asked>& question, std::uint64_t number,
                             const FilterOf<Asked>& filter)
{
    using T = NumberOf<Asked>;
    check_question(question, number);
    DistanceOf<Asked> best{};
    best.distance = std::numeric_limits<T>::infinity();
    best.id = AskedTypes<Asked>::none;
    bool any = false;
    visit_boxes(asked, question, filter, [&](const auto& id, T& bound, T) {
        const std::uint32_t object = AskedTypes<Asked>::number(id);
        objects.with(object, [&](const auto& shape, const auto& pose) {
            // The best distance may have been rounded down, and what is as far may have the lower id.
            const T most = any ? std::min(no_less(std::max(best.distance, T(0))), question.max_distance)
                               : question.max_distance;
            const auto found =
                with_id<DistanceOf<Asked>>(distance_at(question, shape, pose, most, object), id);
            if (found.distance == std::numeric_limits<T>::infinity()) return;
            if (any && !AnswerOrder{}(found, best)) return;
            best = found;
            any = true;
            const T apart = std::max(best.distance, T(0));
            if (const T square = no_less(apart * apart); square < bound) bound = square;
        });
        return true;
    });
    return best;
}

/// Answers that are known before it is their turn: a box in front of their shape's may hold a nearer one. The
/// nearest of them is on top of a heap.
template <class Asked, class Answer>
class AnswersInOrder
{
  public:
    using T = NumberOf<Asked>;
    using Visitor = FunctionRef<bool(const Answer& answer, T& bound)>;

    AnswersInOrder(Visitor visitor, T bound) : visitor_(visitor), bound_(bound) {}

    /// What the visitor wants no answer beyond.
    [[nodiscard]] T bound() const noexcept { return bound_; }
    /// Whether the visitor never said that it has enough.
    [[nodiscard]] bool goes_on() const noexcept { return goes_on_; }
    void add(const Answer& answer)
    {
        waiting_.push_back(answer);
        std::push_heap(waiting_.begin(), waiting_.end(), is_later);
    }
    /// Hands over all answers at(answer) < `nearest`, how near a box may be that is still to come.
    template <class At>
    void hand_over(T nearest, const At& at)
    {
        while (goes_on_ && !waiting_.empty() && at(waiting_.front()) < nearest) {
            std::pop_heap(waiting_.begin(), waiting_.end(), is_later);
            const Answer next = waiting_.back();
            waiting_.pop_back();
            if (at_of(next) > bound_) { // so are all others
                waiting_.clear();
                return;
            }
            T wish = bound_;
            goes_on_ = visitor_(next, wish);
            if (wish != wish) throw_bad_bound(AskedTypes<Asked>::number(next.id));
            bound_ = std::min(bound_, wish);
        }
    }

  private:
    static bool is_later(const Answer& a, const Answer& b) noexcept { return AnswerOrder{}(b, a); }

    Visitor visitor_;
    T bound_;
    bool goes_on_ = true;
    std::vector<Answer> waiting_;
};

template <class Asked, class Question>
bool visit_hits_of(const Asked& asked, const ShapesOf<Asked>& objects, const Question& question,
                   FunctionRef<bool(const HitOf<Asked>&, NumberOf<Asked>&)> visitor,
                   const FilterOf<Asked>& filter)
{
    using T = NumberOf<Asked>;
    constexpr T infinity = std::numeric_limits<T>::infinity();
    check_question(question, Error::no_index);
    AnswersInOrder<Asked, HitOf<Asked>> answers(visitor, infinity);
    const auto of_box = [](const auto& hit) { return no_less(hit.fraction); };
    visit_boxes(asked, question, filter, [&](const auto& id, T& bound, T at) {
        answers.hand_over(at, of_box);
        if (!answers.goes_on()) return false;
        const std::uint32_t object = AskedTypes<Asked>::number(id);
        objects.with(object, [&](const auto& shape, const auto& pose) {
            const auto found = with_id<HitOf<Asked>>(cast_at(question, shape, pose, object), id);
            if (found.fraction != infinity && found.fraction <= answers.bound()) answers.add(found);
        });
        if (const T most = no_less(answers.bound()); most < bound) bound = most;
        return true;
    });
    answers.hand_over(infinity, of_box);
    return answers.goes_on();
}

template <class Asked>
bool visit_nearest_of(const Asked& asked, const ShapesOf<Asked>& objects, const NearestOf<Asked>& question,
                      FunctionRef<bool(const DistanceOf<Asked>&, NumberOf<Asked>&)> visitor,
                      const FilterOf<Asked>& filter)
{
    using T = NumberOf<Asked>;
    constexpr T infinity = std::numeric_limits<T>::infinity();
    check_question(question, Error::no_index);
    AnswersInOrder<Asked, DistanceOf<Asked>> answers(visitor, question.max_distance);
    const auto square = [](T distance) {
        const T apart = std::max(distance, T(0));
        return no_less(apart * apart);
    };
    const auto of_box = [&](const auto& found) { return square(found.distance); };
    visit_boxes(asked, question, filter, [&](const auto& id, T& bound, T at) {
        answers.hand_over(at, of_box);
        if (!answers.goes_on()) return false;
        const std::uint32_t object = AskedTypes<Asked>::number(id);
        objects.with(object, [&](const auto& shape, const auto& pose) {
            const T most = std::max(answers.bound(), T(0));
            const auto found =
                with_id<DistanceOf<Asked>>(distance_at(question, shape, pose, most, object), id);
            if (found.distance != infinity && found.distance <= answers.bound()) answers.add(found);
        });
        if (const T most = square(answers.bound()); most < bound) bound = most;
        return true;
    });
    answers.hand_over(infinity, of_box);
    return answers.goes_on();
}

/// inside(filter) with that of one question of a batch, whose `accept` is told the question's number.
template <class Filter, class F>
auto with_filter(const QuestionFilters<Filter>& filters, std::uint64_t question, F&& inside)
{
    Filter filter = filters[question];
    const auto accept = filter.accept;
    const auto numbered = [&accept, question](std::uint32_t, auto id) {
        return accept(static_cast<std::uint32_t>(question), id);
    };
    if (accept) filter.accept = numbered;
    return inside(std::as_const(filter));
}
/// Questions differ much in cost.
inline constexpr std::uint64_t question_block = 16;
/// out[i] = answer(i, filter) for each question.
template <class Filter, class Answer, class F>
void answer_each(std::size_t questions, std::span<Answer> out, const QuestionFilters<Filter>& filters,
                 Executor& executor, const F& answer)
{
    if (questions != out.size()) throw_not_one_each(questions, out.size(), "places for answers");
    filters.check(questions);
    const auto answer_block = [&](std::uint64_t begin, std::uint64_t end, Work) {
        for (std::uint64_t i = begin; i < end; ++i)
            out[i] = with_filter(filters, i, [&](const auto& filter) { return answer(i, filter); });
    };
    process_items(questions, answer_block, {&executor, question_block});
}

} // namespace detail

// In what follows `asked` is a World or a BoxIndex, `question` a Ray or a ShapeSweep of its numbers, and
// `filter` an ObjectQueryFilter or a QueryFilter.

/// What a ray or a moving shape meets first; nothing if it meets nothing.
template <class Asked, class Question>
    requires detail::CastFor<Question, Asked>
[[nodiscard]] std::optional<detail::HitOf<Asked>>
first_hit(const Asked& asked, const detail::ShapesOf<Asked>& objects, const Question& question,
          const detail::FilterOf<Asked>& filter = {})
{
    const auto hit = detail::first_of(asked, objects, question, Error::no_index, filter);
    if (hit.fraction == std::numeric_limits<detail::NumberOf<Asked>>::infinity()) return {};
    return hit;
}

/// Finds all shapes that it meets: refills `out`, ascending by (fraction, id), with the first `max_results`
/// hits, one for each object. Returns whether there are more.
template <class Asked, class Question>
    requires detail::CastFor<Question, Asked>
bool all_hits(const Asked& asked, const detail::ShapesOf<Asked>& objects, const Question& question,
              std::vector<detail::HitOf<Asked>>& out, const detail::FilterOf<Asked>& filter = {},
              std::uint64_t max_results = ~std::uint64_t{0})
{
    out.clear();
    return detail::append_all_of(asked, objects, question, Error::no_index, out, filter, max_results);
}

/// The shape that is nearest by distance(), or deepest where several overlap the one asked about; nothing
/// where all are further than max_distance.
template <class Asked>
[[nodiscard]] std::optional<detail::DistanceOf<Asked>>
nearest_shape(const Asked& asked, const detail::ShapesOf<Asked>& objects,
              const detail::NearestOf<Asked>& question, const detail::FilterOf<Asked>& filter = {})
{
    const auto found = detail::nearest_of(asked, objects, question, Error::no_index, filter);
    if (found.distance == std::numeric_limits<detail::NumberOf<Asked>>::infinity()) return {};
    return found;
}

// The same, handed over one by one: to visitor(answer, bound), nearest first, until it returns false. Nothing
// further than `bound`, a fraction or a distance, is handed over from then on; a visitor that needs no more
// than that lowers it, as in BoxIndex::visit. What can be no nearer than that isn't even looked at. The calls
// return whether the visitor never returned false. It may read what is asked, and change nothing in it.
// Answers wait in a vector until no box is left that may hold a nearer one.

/// Hands over what a ray or a moving shape meets: the hits of all_hits, in the same order.
template <class Asked, class Question>
    requires detail::CastFor<Question, Asked>
bool visit_hits(
    const Asked& asked, const detail::ShapesOf<Asked>& objects, const Question& question,
    std::type_identity_t<FunctionRef<bool(const detail::HitOf<Asked>& hit, detail::NumberOf<Asked>& bound)>>
        visitor,
    const detail::FilterOf<Asked>& filter = {})
{
    return detail::visit_hits_of(asked, objects, question, visitor, filter);
}

/// Hands over all shapes no further than max_distance, ascending by (distance, id): the nearest ones, for who
/// stops after some. What overlaps the one asked about has a distance below 0.
template <class Asked>
bool visit_nearest_shapes(
    const Asked& asked, const detail::ShapesOf<Asked>& objects, const detail::NearestOf<Asked>& question,
    std::type_identity_t<
        FunctionRef<bool(const detail::DistanceOf<Asked>& found, detail::NumberOf<Asked>& bound)>>
        visitor,
    const detail::FilterOf<Asked>& filter = {})
{
    return detail::visit_nearest_of(asked, objects, question, visitor, filter);
}

// The same for many questions at once: any contiguous range of them. `filters` are none, one for all of them,
// or one for each.

/// out[i] is the first hit of questions[i]; where there is none its fraction is infinite.
template <class Asked, class Questions>
    requires detail::CastFor<detail::ElementOf<Questions>, Asked>
void first_hits(const Asked& asked, const detail::ShapesOf<Asked>& objects, const Questions& questions,
                std::type_identity_t<std::span<detail::HitOf<Asked>>> out,
                const detail::QuestionFilters<detail::FilterOf<Asked>>& filters = {},
                Executor& executor = default_executor())
{
    const auto* const given = std::data(questions);
    detail::answer_each(std::size(questions), out, filters, executor, [&](auto i, const auto& filter) {
        return detail::first_of(asked, objects, given[i], i, filter);
    });
}

/// List i has the hits of questions[i], as all_hits gives them.
template <class Asked, class Questions>
    requires detail::CastFor<detail::ElementOf<Questions>, Asked>
void all_hits(const Asked& asked, const detail::ShapesOf<Asked>& objects, const Questions& questions,
              ResultLists<detail::HitOf<Asked>>& out,
              const detail::QuestionFilters<detail::FilterOf<Asked>>& filters = {},
              std::uint64_t max_results = ~std::uint64_t{0}, Executor& executor = default_executor())
{
    filters.check(std::size(questions));
    const auto* const given = std::data(questions);
    const auto append = [&](std::uint64_t i, auto& hits) {
        return detail::with_filter(filters, i, [&](const auto& filter) {
            return detail::append_all_of(asked, objects, given[i], i, hits, filter, max_results);
        });
    };
    out.fill(std::size(questions), {&executor, detail::question_block}, append);
}

/// out[i] is the nearest shape of questions[i]; where there is none its distance is infinite.
template <class Asked, class Questions>
    requires std::same_as<detail::ElementOf<Questions>, detail::NearestOf<Asked>>
void nearest_shapes(const Asked& asked, const detail::ShapesOf<Asked>& objects, const Questions& questions,
                    std::type_identity_t<std::span<detail::DistanceOf<Asked>>> out,
                    const detail::QuestionFilters<detail::FilterOf<Asked>>& filters = {},
                    Executor& executor = default_executor())
{
    const auto* const given = std::data(questions);
    detail::answer_each(std::size(questions), out, filters, executor, [&](auto i, const auto& filter) {
        return detail::nearest_of(asked, objects, given[i], i, filter);
    });
}

JOSTLE_NAMESPACE_END
