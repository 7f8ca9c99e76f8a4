// SPDX-License-Identifier: MIT
// A query about the shapes of a structure's objects: visits boxes, nearest first, and tests the shapes in
// them, until no remaining box can contain a nearer answer.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <string>
#include <type_traits>
#include <vector>

#include "base/items_on_stack.hpp"
#include "jostle/error.hpp"
#include "jostle/shape_query.hpp"
#include "narrow/interface/answers.hpp"
#include "narrow/interface/input_checks.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Errors of check() name the query, if it has a number.
template <class F>
void checked_as(std::uint64_t number, const F& check)
{
    if (number == Error::no_index) return check();
    try {
        check();
    } catch (const Error& error) {
        throw Error(error.code(), "query " + std::to_string(number) + ": " + error.what(), number);
    }
}
template <int Dim, class T>
void check_pose(const Pose<Dim, T>& pose, std::uint64_t object)
{
    if (!valid(pose)) refuse_pose(pose, object);
}

// Each throws for an invalid query, whatever it would meet.
template <int Dim, class T>
void check_query(const Ray<Dim, T>& ray)
{
    check_ray(ray, Error::no_index);
}
template <int Dim, class T>
void check_query(const ShapeSweep<Dim, T>& sweep)
{
    check_pose(sweep.pose, Error::no_index);
    check_displacement(sweep.displacement, Error::no_index);
}
template <int Dim, class T>
void check_query(const NearestToShape<Dim, T>& nearest)
{
    check_pose(nearest.pose, Error::no_index);
    check_max_distance(nearest.max_distance);
}
template <int Dim, class T>
void check_query(const PosedShape<Dim, T>& shape)
{
    check_pose(shape.pose, Error::no_index);
}

// Each answers for one object; if there is no answer, the fraction or distance is infinite. Distances beyond
// `most` are no answers.
template <int Dim, class T>
CastHit<Dim, T> answer_to(const Ray<Dim, T>& ray, const Shape<Dim>& shape, const Pose<Dim, T>& pose, T)
{
    return ray_hit_of(shape, pose, ray, best_kernels());
}
template <int Dim, class T>
CastHit<Dim, T> answer_to(const ShapeSweep<Dim, T>& sweep, const Shape<Dim>& shape, const Pose<Dim, T>& pose,
                          T)
{
    return shape_hit_of(sweep.shape, sweep.pose, sweep.displacement, shape, pose, best_kernels());
}
template <int Dim, class T>
Distance<Dim, T> answer_to(const NearestToShape<Dim, T>& nearest, const Shape<Dim>& shape,
                           const Pose<Dim, T>& pose, T most)
{
    return distance_of(nearest.shape, nearest.pose, shape, pose, most, best_kernels());
}

/// The fraction or distance by which an answer is ordered.
template <int Dim, class T, class Id>
T at_of(const ShapeHit<Dim, T, Id>& hit) noexcept
{
    return hit.fraction;
}
template <int Dim, class T, class Id>
T at_of(const ShapeDistance<Dim, T, Id>& distance) noexcept
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

/// How great the rounded fraction or squared distance of a box can be if its shape is at `at`.
template <class T>
T no_less(T at) noexcept
{
    return at + (at * (16 * std::numeric_limits<T>::epsilon()) + std::numeric_limits<T>::min());
}
/// The fraction or squared distance up to which a box may contain an answer at `at`.
template <class Query, class T>
T box_bound(const Query&, T at) noexcept
{
    if constexpr (requires(const Query& query) { query.max_distance; }) {
        const T apart = std::max(at, T(0));
        return no_less(apart * apart);
    } else {
        return no_less(at);
    }
}

// --- Finding the boxes ---

template <int Dim, class T>
bool finite(const Aabb<Dim, T>& box)
{
    bool good = true;
    for (int d = 0; d < Dim; ++d)
        good = good && std::abs(box.lo[d]) <= std::numeric_limits<T>::max() &&
               std::abs(box.hi[d]) <= std::numeric_limits<T>::max();
    return good;
}

/// In what a moving box sweeps, or near a box. If `lies_in` is true, in a region and unordered: for motions
/// too short for a sweep, and for infinite shapes.
template <int Dim, class T>
struct Boxes
{
    Sweep<Dim, T> sweep;
    NearestToBox<Dim, T> nearest;
    Aabb<Dim, T> region;
    bool lies_in;
};
template <int Dim, class T>
Boxes<Dim, T> boxes_for(const ShapeSweep<Dim, T>& sweep)
{
    constexpr T most = std::numeric_limits<T>::max();
    Boxes<Dim, T> boxes{};
    const Aabb<Dim, T> box = bounds(sweep.shape, sweep.pose);
    boxes.sweep = {box, sweep.displacement, no_less(T(1))};
    bool moves = false;
    for (const T x : sweep.displacement)
        moves = moves || std::abs(T(1) / x) <= most;
    boxes.lies_in = !moves || !finite(box);
    boxes.region = box;
    for (int d = 0; d < Dim; ++d) {
        const T lo = box.lo[d] + sweep.displacement[d], hi = box.hi[d] + sweep.displacement[d];
        boxes.region.lo[d] = std::min(box.lo[d], std::nextafter(lo, -std::numeric_limits<T>::infinity()));
        boxes.region.hi[d] = std::max(box.hi[d], std::nextafter(hi, std::numeric_limits<T>::infinity()));
    }
    return boxes;
}
template <int Dim, class T>
Boxes<Dim, T> boxes_for(const NearestToShape<Dim, T>& nearest)
{
    constexpr T infinity = std::numeric_limits<T>::infinity();
    // Distances between boxes are compared by their squares, which must be normal numbers.
    constexpr T shortest = sizeof(T) == 4 ? T(2e-19) : T(2e-154);
    Boxes<Dim, T> boxes{};
    const Aabb<Dim, T> box = bounds(nearest.shape, nearest.pose);
    T furthest = std::max(no_less(nearest.max_distance), shortest);
    if (furthest * furthest == infinity) furthest = infinity;
    boxes.nearest = {box, ~std::uint32_t{0}, furthest};
    boxes.lies_in = !finite(box);
    for (int d = 0; d < Dim; ++d) {
        boxes.region.lo[d] = -infinity;
        boxes.region.hi[d] = infinity;
    }
    return boxes;
}

// Each calls inside(id, bound, at) for the objects whose boxes the query meets, nearest first if there is an
// order, at `at` (0 without an order). It may lower `bound`, and returns whether to continue.
template <class Structure, int Dim, class T, class Filter, class F>
void visit_boxes(const Structure& structure, const Aabb<Dim, T>& region, const Filter& filter, F&& inside)
{
    T bound = std::numeric_limits<T>::infinity();
    structure.visit(region, [&](const auto& id) { return inside(id, bound, T(0)); }, filter);
}
template <class Structure, class Query, class Filter, class F>
void visit_ordered(const Structure& structure, const Query& query, const Filter& filter, F&& inside)
{
    structure.visit(
        query, [&](const auto& hit, auto& bound) { return inside(hit.id, bound, hit.at); }, filter);
}
template <class Structure, int Dim, class T, class Filter, class F>
void visit_boxes(const Structure& structure, const Ray<Dim, T>& ray, const Filter& filter, F&& inside)
{
    Ray<Dim, T> longer = ray;
    longer.max_fraction = no_less(ray.max_fraction);
    visit_ordered(structure, longer, filter, inside);
}
template <class Structure, int Dim, class T, class Filter, class F>
void visit_boxes(const Structure& structure, const ShapeSweep<Dim, T>& sweep, const Filter& filter,
                 F&& inside)
{
    const Boxes<Dim, T> boxes = boxes_for(sweep);
    if (boxes.lies_in) return visit_boxes(structure, boxes.region, filter, inside);
    visit_ordered(structure, boxes.sweep, filter, inside);
}
template <class Structure, int Dim, class T, class Filter, class F>
void visit_boxes(const Structure& structure, const NearestToShape<Dim, T>& nearest, const Filter& filter,
                 F&& inside)
{
    const Boxes<Dim, T> boxes = boxes_for(nearest);
    if (boxes.lies_in) return visit_boxes(structure, boxes.region, filter, inside);
    visit_ordered(structure, boxes.nearest, filter, inside);
}

// --- One query ---

inline std::uint32_t number_of(std::uint32_t id) noexcept
{
    return id;
}
inline std::uint32_t number_of(ObjectId id) noexcept
{
    return id.index;
}

/// A query about the shapes of a structure's objects.
template <class Structure, class Query, class Filter>
class ShapeSearch
{
  public:
    static constexpr int dim = Structure::dim;
    using T = typename Structure::Number;
    using Shapes = PosedShapes<dim, T>;
    using Answer = typename Structure::template ShapeAnswer<Query>;
    static constexpr T infinity = std::numeric_limits<T>::infinity();

    ShapeSearch(const Structure& structure, const Query& query, const Shapes& objects, const Filter& filter,
                std::uint64_t number)
        : structure_(structure), query_(query), objects_(objects), filter_(filter)
    {
        checked_as(number, [&] { check_query(query); });
    }

    /// Calls touch(id) for each object that touches a shape at rest, until it returns false.
    template <class Touch>
    void each_touching(const Touch& touch) const
    {
        visit_boxes(structure_, bounds(query_.shape, query_.pose), filter_, [&](const auto& id, T&, T) {
            bool touches = false;
            with(id, [&](const auto& shape, const auto& pose) {
                touches = touching_of(query_.shape, query_.pose, shape, pose, best_kernels());
            });
            return !touches || touch(id);
        });
    }
    /// Calls take(answer, bound) for each answer, in the order of boxes, until it returns false. `most()` is
    /// the greatest distance allowed; `before(at)` is called before a box that begins at `at`, and returns
    /// whether to continue.
    template <class Most, class Before, class Take>
    void each_answer(const Most& most, const Before& before, const Take& take) const
    {
        visit_boxes(structure_, query_, filter_, [&](const auto& id, T& bound, T at) {
            if (!before(at)) return false;
            bool goes_on = true;
            with(id, [&](const auto& shape, const auto& pose) {
                Answer answer;
                static_cast<std::remove_cvref_t<decltype(answer_to(query_, shape, pose, T()))>&>(answer) =
                    answer_to(query_, shape, pose, most());
                answer.id = id;
                if (at_of(answer) != infinity) goes_on = take(answer, bound);
            });
            return goes_on;
        });
    }

    /// The nearest answer, with an infinite fraction or distance if there is none.
    [[nodiscard]] Answer first() const
    {
        Answer best{};
        furthest(best);
        if constexpr (is_nearest)
            if (query_.count == 0) return best;
        bool any = false;
        const auto most = [&] {
            if constexpr (is_nearest)
                // The best distance may have been rounded down, and an equally far object may have the lower
                // id.
                return any ? std::min(no_less(std::max(best.distance, T(0))), query_.max_distance)
                           : query_.max_distance;
            else
                return infinity;
        };
        each_answer(most, goes_on_always, [&](const Answer& found, T& bound) {
            if (any && !AnswerOrder{}(found, best)) return true;
            best = found;
            any = true;
            lower(bound, box_bound(query_, at_of(best)));
            return true;
        });
        return best;
    }
    [[nodiscard]] std::uint64_t count(bool one_will_do) const
    {
        std::uint64_t found = 0;
        const auto add = [&](const auto&...) { return ++found, !one_will_do; };
        if constexpr (stays)
            each_touching(add);
        else
            each_answer(anywhere, goes_on_always, add);
        return found;
    }
    /// Appends the first `max_results` answers, in order. Returns whether there are more.
    template <class Answers>
    bool append_all(Answers& out, std::uint64_t max_results) const
    {
        const std::size_t before = out.size();
        const auto begin = [&] { return out.begin() + static_cast<std::ptrdiff_t>(before); };
        if constexpr (stays) {
            each_touching([&](const auto& id) { return out.push_back(id), true; });
            std::sort(begin(), out.end());
            const bool more = out.size() - before > max_results;
            if (more) out.resize(before + static_cast<std::size_t>(max_results));
            return more;
        } else {
            // One more than wanted tells whether there are more. Then they are a heap, with the last of all
            // on top.
            const bool limited = max_results < (std::numeric_limits<std::uint64_t>::max() >> 1U);
            bool full = false;
            each_answer(anywhere, goes_on_always, [&](const Answer& found, T& bound) {
                if (full) {
                    if (!AnswerOrder{}(found, out[before])) return true;
                    std::pop_heap(begin(), out.end(), AnswerOrder{});
                    out.back() = found;
                    std::push_heap(begin(), out.end(), AnswerOrder{});
                } else {
                    out.push_back(found);
                    full = limited && out.size() - before > max_results;
                    if (full) std::make_heap(begin(), out.end(), AnswerOrder{});
                }
                if (full) lower(bound, box_bound(query_, at_of(out[before])));
                return true;
            });
            std::sort(begin(), out.end(), AnswerOrder{});
            if (full) out.pop_back();
            return full;
        }
    }
    /// Visits the answers, in order, until the visitor returns false. Returns false if it did. Answers wait
    /// in a heap, the nearest on top, while a later box may contain a nearer one.
    bool visit(typename Structure::template Visitor<Answer> visitor) const
    {
        if constexpr (stays) {
            bool goes_on = true;
            each_touching([&](const auto& id) { return goes_on = visitor(id); });
            return goes_on;
        } else {
            T furthest = infinity; // the visitor's bound
            std::uint64_t left = ~std::uint64_t{0};
            if constexpr (is_nearest) {
                furthest = query_.max_distance;
                left = query_.count;
            }
            if (left == 0) return true;
            bool goes_on = true;
            ItemsOnStack<Answer, 4096> in_heap;
            std::pmr::vector<Answer>& waiting = in_heap.found;
            const auto is_later = [](const Answer& a, const Answer& b) { return AnswerOrder{}(b, a); };
            const auto hand_over = [&](T nearest_box) {
                while (goes_on && left != 0 && !waiting.empty() &&
                       box_bound(query_, at_of(waiting.front())) < nearest_box) {
                    std::pop_heap(waiting.begin(), waiting.end(), is_later);
                    const Answer next = waiting.back();
                    waiting.pop_back();
                    if (at_of(next) > furthest) { // so are all others
                        waiting.clear();
                        break;
                    }
                    T wish = furthest;
                    goes_on = visitor(next, wish);
                    if (wish != wish) detail::throw_bad_bound(number_of(next.id));
                    lower(furthest, wish);
                    --left;
                }
                return goes_on && left != 0;
            };
            const auto most = [&] { return std::max(furthest, T(0)); };
            each_answer(most, hand_over, [&](const Answer& found, T& bound) {
                if (at_of(found) <= furthest) {
                    waiting.push_back(found);
                    std::push_heap(waiting.begin(), waiting.end(), is_later);
                }
                lower(bound, box_bound(query_, furthest));
                return true;
            });
            hand_over(infinity);
            return goes_on;
        }
    }
    /// Appends the `count` nearest.
    template <class Answers>
    void append_nearest(Answers& out) const
    {
        visit([&](const Answer& found, T&) { return out.push_back(found), true; });
    }

  private:
    static constexpr bool stays = std::same_as<Query, PosedShape<dim, T>>;
    static constexpr bool is_nearest = std::same_as<Query, NearestToShape<dim, T>>;
    static constexpr auto anywhere = [] { return infinity; };
    static constexpr auto goes_on_always = [](T) { return true; };
    static void lower(T& bound, T to) noexcept
    {
        if (to < bound) bound = to;
    }
    static void furthest(Answer& answer) noexcept
    {
        if constexpr (is_nearest)
            answer.distance = infinity;
        else
            answer.fraction = infinity;
    }
    /// Calls use(shape, pose) for an object, after checking them.
    template <class Id, class Use>
    void with(const Id& id, const Use& use) const
    {
        const std::uint32_t object = number_of(id);
        objects_.with(object, [&](const auto& shape, const auto& pose) {
            check_pose(pose, object);
            use(shape, pose);
        });
    }

    const Structure& structure_;
    const Query& query_;
    const Shapes& objects_;
    const Filter& filter_;
};

} // namespace narrow
JOSTLE_NAMESPACE_END
