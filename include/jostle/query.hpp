// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <optional>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/process.hpp"
#include "jostle/version.hpp"

// The questions that can be asked of boxes, and what their answers mean. Each is defined here by one function
// in the user's own numbers, evaluated exactly as written (no fused operations), whatever the index does to
// be fast.

JOSTLE_NAMESPACE_BEGIN

/// The points origin + f * direction for 0 <= f <= max_fraction.
///
/// Units     fractions count in lengths of `direction`. A fraction that is too great for T is infinite.
/// Valid     origin and direction are finite. 1 / component is finite for at least one component of the
///           direction (3e-39 is large enough in float, 6e-309 in double). max_fraction is at least 0 and may
///           be infinite.
template <int Dim, Coordinate T>
struct Ray
{
    Vec<Dim, T> origin;
    Vec<Dim, T> direction;
    T max_fraction = std::numeric_limits<T>::infinity();
};

/// A box that moves from where it is by f * motion for 0 <= f <= max_fraction, without turning.
///
/// Valid     the box is valid and finite, `motion` is as the direction of a ray, max_fraction is at least 0.
///           For a box that doesn't move, ask what overlaps the box instead.
template <int Dim, Coordinate T>
struct Sweep
{
    Aabb<Dim, T> box;
    Vec<Dim, T> motion;
    T max_fraction = 1;
};

/// The points that are no further than `radius` from `center`. Distances are compared by their squares in T:
/// see squared_distance.
///
/// Valid     the center is finite. The radius is 0, or infinite, or its square is a normal number: 1.1e-19 to
///           1.8e19 in float, 1.5e-154 to 1.3e154 in double.
template <int Dim, Coordinate T>
struct Sphere
{
    Vec<Dim, T> center;
    T radius;
};

/// The points p with dot(normal, p) + offset >= 0.
///
/// Valid     all numbers are finite. The normal may have any length but zero.
template <int Dim, Coordinate T>
struct Plane
{
    Vec<Dim, T> normal;
    T offset;
};

/// The space inside any number of planes: a camera's view, a shadow volume, a slab. Without planes it is all
/// space.
///
/// Meaning   a box counts as inside unless it lies wholly outside one of the planes. Near the edges of the
///           volume a box may therefore count although it touches no point of the volume. View culling
///           usually does this.
/// Lifetime  it refers to the planes, which must outlive it.
template <int Dim, Coordinate T>
struct Frustum
{
    std::span<const Plane<Dim, T>> planes;
};

/// Asks for the `count` boxes that are nearest to a point, and no further away than `max_distance`. A box
/// that contains the point is at distance 0.
///
/// Valid     the point is finite, max_distance is as the radius of a sphere.
template <int Dim, Coordinate T>
struct Nearest
{
    Vec<Dim, T> point;
    std::uint32_t count = 1;
    T max_distance = std::numeric_limits<T>::infinity();
};

/// Asks for the `count` boxes that are nearest to a box, and no further away than `max_distance`. A box that
/// touches it is at distance 0.
///
/// Valid     the box is valid and finite, max_distance is as the radius of a sphere.
template <int Dim, Coordinate T>
struct NearestToBox
{
    Aabb<Dim, T> box;
    std::uint32_t count = 1;
    T max_distance = std::numeric_limits<T>::infinity();
};

using Ray2f = Ray<2, float>;
using Ray3f = Ray<3, float>;
using Ray2d = Ray<2, double>;
using Ray3d = Ray<3, double>;
using Sweep2f = Sweep<2, float>;
using Sweep3f = Sweep<3, float>;
using Sweep2d = Sweep<2, double>;
using Sweep3d = Sweep<3, double>;
using Sphere2f = Sphere<2, float>;
using Sphere3f = Sphere<3, float>;
using Sphere2d = Sphere<2, double>;
using Sphere3d = Sphere<3, double>;
using Plane2f = Plane<2, float>;
using Plane3f = Plane<3, float>;
using Plane2d = Plane<2, double>;
using Plane3d = Plane<3, double>;
using Frustum2f = Frustum<2, float>;
using Frustum3f = Frustum<3, float>;
using Frustum2d = Frustum<2, double>;
using Frustum3d = Frustum<3, double>;
using Nearest2f = Nearest<2, float>;
using Nearest3f = Nearest<3, float>;
using Nearest2d = Nearest<2, double>;
using Nearest3d = Nearest<3, double>;
using NearestToBox2f = NearestToBox<2, float>;
using NearestToBox3f = NearestToBox<3, float>;
using NearestToBox2d = NearestToBox<2, double>;
using NearestToBox3d = NearestToBox<3, double>;

/// An object found along a ray or sweep or near a point.
template <Coordinate T>
struct Hit
{
    /// The id where there is no object.
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    std::uint32_t id = none;
    /// Rays and sweeps: the least fraction at which the box is touched, 0 if it is from the beginning.
    /// Nearest: the squared distance.
    T at = 0;

    friend constexpr bool operator==(const Hit&, const Hit&) = default;
    /// The order of all results: by `at`, then id.
    friend constexpr bool operator<(const Hit& a, const Hit& b) noexcept
    {
        return a.at < b.at || (a.at == b.at && a.id < b.id);
    }
};

using Hitf = Hit<float>;
using Hitd = Hit<double>;

/// Two objects and the squared distance between their boxes: squared_distance(box of a, box of b).
template <Coordinate T>
struct PairHit
{
    std::uint32_t a = Hit<T>::none, b = Hit<T>::none;
    T at = 0;

    friend constexpr bool operator==(const PairHit&, const PairHit&) = default;
    /// By `at`, then a, then b.
    friend constexpr bool operator<(const PairHit& x, const PairHit& y) noexcept
    {
        if (x.at != y.at) return x.at < y.at;
        return x.a != y.a ? x.a < y.a : x.b < y.b;
    }
};

using PairHitf = PairHit<float>;
using PairHitd = PairHit<double>;

// --- Visitors: who is handed each object that a question finds ---
// A visitor returns whether to go on. It may ask the same index or world again, even the same question, but
// it may change nothing in it: that is an `Error` of the call that would.

/// For questions without an order.
using IdVisitor = FunctionRef<bool(std::uint32_t id)>;
/// For rays, sweeps and the nearest. Nothing further than `bound`, in the units of `hit.at`, is handed over
/// from then on: a visitor that needs no more than that lowers it. It begins with the greatest fraction or
/// the square of the greatest distance. To raise it has no effect; NaN is an `Error`.
template <Coordinate T>
using HitVisitor = FunctionRef<bool(const Hit<T>& hit, T& bound)>;
/// For pairs without an order, and for the closest.
using PairVisitor = FunctionRef<bool(std::uint32_t a, std::uint32_t b)>;
template <Coordinate T>
using PairHitVisitor = FunctionRef<bool(const PairHit<T>& hit, T& bound)>;

/// Says which objects a question is about. An object counts if every part that is given agrees. A part that
/// is left empty filters nothing.
struct QueryFilter
{
    /// Bit sets of the objects, by id up to the greatest that the index has held, and those of the asker: an
    /// object counts only if category[id] & this->asker_mask and asker_category & mask[id] are both non-zero.
    /// Give both views or neither.
    StridedView<std::uint32_t> category = {};
    StridedView<std::uint32_t> mask = {};
    std::uint32_t asker_category = ~std::uint32_t{0};
    std::uint32_t asker_mask = ~std::uint32_t{0};
    /// Objects of this owner don't count: the asker's own parts. By id; Filter::no_owner belongs to nobody.
    StridedView<std::uint32_t> owner = {};
    std::uint32_t asker_owner = ~std::uint32_t{0};
    /// This object doesn't count: the asker itself.
    std::uint32_t exclude = ~std::uint32_t{0};
    /// Called last, with the number of the question (0 if there is only one) and an object that is a result,
    /// or may become one. How often and in which order it is called depends on the index. A batch calls it
    /// from several threads at a time. An exception that it throws ends the call.
    StoredFunctionRef<bool(std::uint32_t question, std::uint32_t id)> accept = {};
};

/// One filter for each question of a batch, in place of one for all: an array, vector or span of QueryFilter
/// or ObjectQueryFilter. So each asker can leave out itself.
///
/// Lifetime  a view: the filters must outlive the call.
template <class Filter>
class FilterOfEach
{
  public:
    template <class Many>
        requires std::convertible_to<const Many&, std::span<const Filter>>
    FilterOfEach(const Many& filters) noexcept : filters_(filters)
    {
    }
    [[nodiscard]] std::size_t size() const noexcept { return filters_.size(); }
    [[nodiscard]] const Filter& operator[](std::size_t question) const noexcept { return filters_[question]; }
    /// All of them.
    operator std::span<const Filter>() const noexcept { return filters_; }

  private:
    std::span<const Filter> filters_;
};

namespace detail {
/// The `Error` where there are more or fewer `things` than questions.
[[noreturn]] JOSTLE_API void throw_not_one_each(std::size_t questions, std::size_t count, const char* things);

/// Those of a batch: none, one for all questions, or one for each. A view, too.
template <class Filter>
class QuestionFilters
{
  public:
    QuestionFilters() noexcept : QuestionFilters(none) {}
    QuestionFilters(const Filter& for_all) noexcept : filters_(&for_all, 1) {}
    template <class Many>
        requires std::convertible_to<const Many&, std::span<const Filter>>
    QuestionFilters(const Many& for_each) noexcept : filters_(for_each), one_each_(true)
    {
    }
    [[nodiscard]] bool one_each() const noexcept { return one_each_; }
    void check(std::size_t questions) const
    {
        if (one_each_ && filters_.size() != questions)
            throw_not_one_each(questions, filters_.size(), "filters");
    }
    [[nodiscard]] const Filter& operator[](std::size_t question) const noexcept
    {
        return filters_[one_each_ ? question : 0];
    }

  private:
    static inline const Filter none = {};
    std::span<const Filter> filters_;
    bool one_each_ = false;
};
} // namespace detail

/// What is asked along a line, about a region, or as either, in so many dimensions and these numbers.
template <class Question, int Dim, class T>
concept LineOf = std::same_as<Question, Ray<Dim, T>> || std::same_as<Question, Sweep<Dim, T>>;
template <class Question, int Dim, class T>
concept RegionOf = std::same_as<Question, Aabb<Dim, T>> || std::same_as<Question, Sphere<Dim, T>> ||
                   std::same_as<Question, Frustum<Dim, T>>;
template <class Question, int Dim, class T>
concept LineOrRegionOf = LineOf<Question, Dim, T> || RegionOf<Question, Dim, T>;
template <class Question, int Dim, class T>
concept NearestOf = std::same_as<Question, Nearest<Dim, T>> || std::same_as<Question, NearestToBox<Dim, T>>;

/// Whether questions lie in one piece in it: a vector, array or span of them.
template <class Many>
concept QuestionRange = std::ranges::contiguous_range<const Many> && std::ranges::sized_range<const Many>;

/// Where answers of yes or no go: bools, or bytes that become 0 or 1, in an array, vector or span. (The bits
/// of a std::vector<bool> are neither; a std::vector<std::uint8_t> takes its place.)
///
/// Lifetime  a view: what it is made of must outlive the call.
class BoolSpan
{
  public:
    template <class Bools>
        requires std::convertible_to<Bools&, std::span<bool>>
    BoolSpan(Bools&& bools) noexcept : bools_(bools)
    {
    }
    template <class Bytes>
        requires std::convertible_to<Bytes&, std::span<std::uint8_t>>
    BoolSpan(Bytes&& bytes) noexcept
    {
        static_assert(sizeof(bool) == 1);
        const std::span<std::uint8_t> all(bytes);
        bools_ = {reinterpret_cast<bool*>(all.data()), all.size()};
    }
    [[nodiscard]] std::size_t size() const noexcept { return bools_.size(); }
    [[nodiscard]] bool& operator[](std::size_t question) const noexcept { return bools_[question]; }

  private:
    std::span<bool> bools_;
};

/// The answers of a batch. List i belongs to question i. The next call refills the lists and uses their
/// memory again.
template <class Item>
class ResultLists
{
  public:
    explicit ResultLists(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
        : first_(memory), items_(memory), more_(memory), found_(memory)
    {
    }

    [[nodiscard]] std::size_t size() const noexcept { return more_.size(); }
    [[nodiscard]] std::span<const Item> operator[](std::size_t i) const noexcept
    {
        return std::span<const Item>(items_).subspan(first_[i], first_[i + 1] - first_[i]);
    }
    /// Whether question i has more results than `max_results`, which list i was cut to.
    [[nodiscard]] bool more(std::size_t i) const noexcept { return more_[i] != 0; }
    /// All lists, one behind the other.
    [[nodiscard]] std::span<const Item> items() const noexcept { return items_; }

    /// Refills the lists: append(i, items) appends the results of question i, in order, and returns whether
    /// there are more. Each block of questions has a copy of it, which may keep working memory. If anything
    /// throws, there are no lists.
    template <class F>
    void fill(std::size_t questions, const ProcessOptions& options, const F& append)
    {
        std::pmr::vector<Item> all(std::move(items_)); // if anything below throws, the lists are empty
        items_.clear();
        std::pmr::vector<std::uint8_t> cut(std::move(more_));
        more_.clear();
        first_.assign(questions + 1, 0);
        cut.assign(questions, 0);
        const WorkPlan plan = plan_work(questions, options);
        struct Part
        {
            std::uint32_t slot;
            std::size_t begin;
        };
        std::pmr::vector<Part> parts(plan.slots == 1 ? 0 : plan.blocks, found_.get_allocator());
        if (found_.size() < plan.slots) found_.resize(plan.slots);
        if (plan.slots == 1) found_[0].swap(all); // there is nothing to put together
        for (auto& each : found_)
            each.clear();
        process_items(
            questions,
            [&](std::uint64_t begin, std::uint64_t end, Work work) {
                std::pmr::vector<Item> mine(std::move(found_[work.slot])); // others write nearby
                if (!parts.empty()) parts[begin / plan.block_items] = {work.slot, mine.size()};
                F own = append;
                for (auto i = static_cast<std::size_t>(begin); i < end; ++i) {
                    const std::size_t before = mine.size();
                    cut[i] = own(i, mine);
                    first_[i + 1] = mine.size() - before;
                }
                found_[work.slot] = std::move(mine);
            },
            options);
        for (std::size_t i = 0; i < questions; ++i)
            first_[i + 1] += first_[i];
        if (plan.slots == 1) {
            found_[0].swap(all);
        } else {
            all.resize(first_[questions]);
            process_items(
                plan.blocks,
                [&](std::uint64_t begin, std::uint64_t end, Work) {
                    for (std::size_t block = begin; block < end; ++block) {
                        const std::size_t from = first_[block * plan.block_items];
                        const std::size_t to =
                            first_[std::min<std::size_t>(questions, (block + 1) * plan.block_items)];
                        std::copy_n(found_[parts[block].slot].data() + parts[block].begin, to - from,
                                    all.data() + from);
                    }
                },
                {options.executor, 4});
        }
        items_ = std::move(all);
        more_ = std::move(cut);
    }

  private:
    std::pmr::vector<std::size_t> first_;
    std::pmr::vector<Item> items_;
    std::pmr::vector<std::uint8_t> more_;
    std::pmr::vector<std::pmr::vector<Item>> found_; // working memory, by slot
};

// --- What the answers are ---

/// The least fraction at which the moving box touches `target`, if it does at all.
///
/// On an axis with motion m, and with 1 / m finite, the two are in touch from `enter` to `leave`, both
/// (difference of bounds) * (1 / m); on any other axis they touch all the time or never, by their bounds. The
/// result is the greatest of 0 and all `enter`, if that is at most max_fraction and every `leave`.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr std::optional<T> hit_fraction(const Sweep<Dim, T>& sweep,
                                                      const Aabb<Dim, T>& target) noexcept
{
    T first = 0, last = sweep.max_fraction;
    for (int d = 0; d < Dim; ++d) {
        const T inverse = T(1) / sweep.motion[d];
        if (!(inverse >= -std::numeric_limits<T>::max() && inverse <= std::numeric_limits<T>::max())) {
            if (!(target.lo[d] <= sweep.box.hi[d] && sweep.box.lo[d] <= target.hi[d])) return std::nullopt;
            continue;
        }
        const T to_lo = (target.lo[d] - sweep.box.hi[d]) * inverse;
        const T to_hi = (target.hi[d] - sweep.box.lo[d]) * inverse;
        const T enter = inverse > 0 ? to_lo : to_hi;
        const T leave = inverse > 0 ? to_hi : to_lo;
        if (enter > first) first = enter;
        if (leave < last) last = leave;
    }
    if (first <= last) return first;
    return std::nullopt;
}

/// A ray is the sweep of a point: it touches faces that it runs along, and boxes it begins in at 0.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr std::optional<T> hit_fraction(const Ray<Dim, T>& ray,
                                                      const Aabb<Dim, T>& target) noexcept
{
    Sweep<Dim, T> sweep{};
    for (int d = 0; d < Dim; ++d) {
        sweep.box.lo[d] = sweep.box.hi[d] = ray.origin[d];
        sweep.motion[d] = ray.direction[d];
    }
    sweep.max_fraction = ray.max_fraction;
    return hit_fraction(sweep, target);
}

/// The squared distance from a point to a box, summed from the first axis to the last in T. A distance whose
/// square overflows is infinite, and one whose square underflows is 0: such distances cannot be told apart.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr T squared_distance(const std::type_identity_t<Vec<Dim, T>>& point,
                                           const Aabb<Dim, T>& box) noexcept
{
    T sum = 0;
    for (int d = 0; d < Dim; ++d) {
        const T below = box.lo[d] - point[d], above = point[d] - box.hi[d];
        const T gap = below > 0 ? below : (above > 0 ? above : T(0));
        sum += gap * gap;
    }
    return sum;
}

/// The squared distance between two boxes: the same sum over the gaps between them.
template <int Dim, Coordinate T, std::same_as<Aabb<Dim, T>> From>
[[nodiscard]] constexpr T squared_distance(const From& from, const Aabb<Dim, T>& box) noexcept
{
    T sum = 0;
    for (int d = 0; d < Dim; ++d) {
        const T below = box.lo[d] - from.hi[d], above = from.lo[d] - box.hi[d];
        const T gap = below > 0 ? below : (above > 0 ? above : T(0));
        sum += gap * gap;
    }
    return sum;
}

template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool overlaps(const Sphere<Dim, T>& sphere, const Aabb<Dim, T>& box) noexcept
{
    return squared_distance(sphere.center, box) <= sphere.radius * sphere.radius;
}

/// Whether for every plane the box's corner furthest along the normal has normal * corner, summed from the
/// first axis to the last, plus offset, >= 0. An axis on which the normal is 0 isn't summed.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool overlaps(const Frustum<Dim, T>& frustum, const Aabb<Dim, T>& box) noexcept
{
    for (const Plane<Dim, T>& plane : frustum.planes) {
        T sum = 0;
        for (int d = 0; d < Dim; ++d) {
            if (plane.normal[d] > 0) sum += plane.normal[d] * box.hi[d];
            if (plane.normal[d] < 0) sum += plane.normal[d] * box.lo[d];
        }
        if (!(sum + plane.offset >= 0)) return false;
    }
    return true;
}

namespace detail {
/// The `Error` where the visitor of an object has made the bound NaN.
[[noreturn]] JOSTLE_API void throw_bad_bound(std::uint32_t object);
} // namespace detail

JOSTLE_NAMESPACE_END
