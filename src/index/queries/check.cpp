// SPDX-License-Identifier: MIT
#include "index/queries/check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/box.hpp"
#include "base/checks.hpp"
#include "base/instantiate.hpp"
#include "base/number_text.hpp"
#include "jostle/error.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {
namespace {

constexpr const char* axis_name[] = {".x", ".y", ".z"};

/// The start of a message: "ray 7: " in a batch, otherwise "ray: ".
class Report
{
  public:
    Report(const char* what, std::uint64_t number) : text_(what), number_(number)
    {
        if (number != Error::no_index) text_ += ' ' + std::to_string(number);
        text_ += ": ";
    }
    Report& operator<<(const char* text) { return text_ += text, *this; }
    Report& operator<<(std::uint64_t number) { return text_ += std::to_string(number), *this; }
    Report& operator<<(float number) { return text_ += number_text(number), *this; }
    Report& operator<<(double number) { return text_ += number_text(number), *this; }
    [[noreturn]] void raise(ErrorCode code) const { throw Error(code, text_, number_); }

  private:
    std::string text_;
    std::uint64_t number_;
};

// A ray takes 200 ns, so the tests of every query are inlined and have no branch that depends on signs; the
// code that throws is separate.

template <class T>
bool finite(T value)
{
    return std::abs(value) <= std::numeric_limits<T>::max();
}

template <class T>
[[noreturn]] void raise_not_finite(T value, const char* what, std::uint64_t number, const char* name,
                                   int axis)
{
    Report report(what, number);
    report << name << axis_name[axis] << " is " << value << "; it must be a finite number";
    report.raise(value != value ? ErrorCode::nan_coordinate : ErrorCode::invalid_argument);
}
template <class T>
void check_finite(T value, const char* what, std::uint64_t number, const char* name, int axis)
{
    if (!finite(value)) raise_not_finite(value, what, number, name, axis);
}

template <class T>
[[noreturn]] void raise_negative(T value, const char* what, std::uint64_t number, const char* name)
{
    Report report(what, number);
    report << name << " is " << value << "; it must be 0 or more";
    report.raise(value != value ? ErrorCode::nan_coordinate : ErrorCode::invalid_argument);
}
template <class T>
void check_not_negative(T value, const char* what, std::uint64_t number, const char* name)
{
    if (!(value >= 0)) raise_negative(value, what, number, name);
}

/// A distance is compared by its square, which mustn't overflow or underflow.
template <class T>
void check_distance(T value, const char* what, std::uint64_t number, const char* name)
{
    check_not_negative(value, what, number, name);
    const T square = value * value;
    if (value == 0 || !finite(value) || (finite(square) && square >= std::numeric_limits<T>::min())) return;
    Report report(what, number);
    report << name << " is " << value << ", which can't be squared in this type; give "
           << (value < 1 ? "0 or more than " : "infinity or less than ")
           << (sizeof(T) == 4 ? (value < 1 ? "1.1e-19" : "1.8e19") : (value < 1 ? "1.5e-154" : "1.3e154"));
    report.raise(ErrorCode::invalid_argument);
}

[[noreturn]] void raise_zero(const char* what, std::uint64_t number, const char* name, const char* instead)
{
    Report report(what, number);
    report << name << " is zero on every axis; " << instead;
    report.raise(ErrorCode::invalid_argument);
}
/// Returns the length of the longest component.
template <int Dim, class T>
T check_direction(const Vec<Dim, T>& direction, const char* what, std::uint64_t number, const char* name,
                  const char* instead)
{
    T longest = 0;
    for (int d = 0; d < Dim; ++d) {
        check_finite(direction[d], what, number, name, d);
        longest = std::max(longest, std::abs(direction[d]));
    }
    if (!(longest > 0)) raise_zero(what, number, name, instead);
    return longest;
}

template <class T>
[[noreturn]] void raise_too_short(T longest, const char* what, std::uint64_t number, const char* name)
{
    Report report(what, number);
    report << name << " is too short: its longest component is " << longest
           << ", and 1 divided by that is not finite; scale it up";
    report.raise(ErrorCode::invalid_argument);
}
/// A line has no motion on an axis where 1 / motion isn't finite; this one has some motion.
template <int Dim, class T>
void check_motion(const Vec<Dim, T>& motion, const char* what, std::uint64_t number, const char* name,
                  const char* instead)
{
    const T longest = check_direction(motion, what, number, name, instead);
    if (!finite(T(1) / longest)) raise_too_short(longest, what, number, name);
}

template <int Dim, class T>
void check_box(const Aabb<Dim, T>& box, const char* what, std::uint64_t number)
{
    if (valid(box)) return;
    for (int d = 0; d < Dim; ++d) {
        if (box.lo[d] <= box.hi[d]) continue;
        Report report(what, number);
        if (box.lo[d] != box.lo[d] || box.hi[d] != box.hi[d]) {
            report << (box.lo[d] != box.lo[d] ? "lo" : "hi") << axis_name[d]
                   << " is NaN; it must be a number";
            report.raise(ErrorCode::nan_coordinate);
        }
        report << "lo" << axis_name[d] << " = " << box.lo[d] << " is greater than hi" << axis_name[d] << " = "
               << box.hi[d] << "; swap them or drop the query";
        report.raise(ErrorCode::inverted_box);
    }
}

template <int Dim, class T>
void check_finite_box(const Aabb<Dim, T>& box, const char* what, std::uint64_t number)
{
    check_box(box, what, number);
    for (int d = 0; d < Dim; ++d) {
        check_finite(box.lo[d], what, number, "box.lo", d);
        check_finite(box.hi[d], what, number, "box.hi", d);
    }
}

void check_ids(const StridedView<std::uint32_t>& column, std::uint64_t ids, const char* name,
               std::uint64_t number)
{
    if (column.empty() || column.size() >= ids) return;
    Report report("query filter", number);
    report << name << " has " << std::uint64_t{column.size()} << " entries, but the index has held ids up to "
           << ids - 1 << "; give one for every id, or none";
    report.raise(ErrorCode::size_mismatch);
}

} // namespace

template <int Dim, class T>
void check(const Ray<Dim, T>& ray, std::uint64_t number)
{
    for (int d = 0; d < Dim; ++d)
        check_finite(ray.origin[d], "ray", number, "origin", d);
    check_motion(ray.direction, "ray", number, "direction", "for a point ask for the overlaps of a box");
    check_not_negative(ray.max_fraction, "ray", number, "max_fraction");
}

template <int Dim, class T>
void check(const Sweep<Dim, T>& sweep, std::uint64_t number)
{
    check_finite_box(sweep.box, "sweep", number);
    check_motion(sweep.motion, "sweep", number, "motion", "ask for the overlaps of the box");
    check_not_negative(sweep.max_fraction, "sweep", number, "max_fraction");
}

template <int Dim, class T>
void check(const Aabb<Dim, T>& region, std::uint64_t number)
{
    check_box(region, "region", number);
}

template <int Dim, class T>
void check(const Sphere<Dim, T>& sphere, std::uint64_t number)
{
    for (int d = 0; d < Dim; ++d)
        check_finite(sphere.center[d], "sphere", number, "center", d);
    check_distance(sphere.radius, "sphere", number, "radius");
}

template <int Dim, class T>
void check(const Frustum<Dim, T>& frustum, std::uint64_t number)
{
    for (const Plane<Dim, T>& plane : frustum.planes) {
        check_direction(plane.normal, "frustum", number, "normal of a plane", "drop the plane");
        if (finite(plane.offset)) continue;
        Report report("frustum", number);
        report << "offset of a plane is " << plane.offset << "; it must be a finite number";
        report.raise(plane.offset != plane.offset ? ErrorCode::nan_coordinate : ErrorCode::invalid_argument);
    }
}

template <int Dim, class T>
void check(const Nearest<Dim, T>& nearest, std::uint64_t number)
{
    for (int d = 0; d < Dim; ++d)
        check_finite(nearest.point[d], "nearest", number, "point", d);
    check_distance(nearest.max_distance, "nearest", number, "max_distance");
}

template <int Dim, class T>
void check(const NearestToBox<Dim, T>& nearest, std::uint64_t number)
{
    check_finite_box(nearest.box, "nearest", number);
    check_distance(nearest.max_distance, "nearest", number, "max_distance");
}

template <class T>
void check_max_distance(T max_distance)
{
    check_distance(max_distance, "closest pairs", Error::no_index, "max_distance");
}
template void check_max_distance(float);
template void check_max_distance(double);

template <int Dim, class T>
void check_joined(const BoxView<Dim, T>& boxes)
{
    if (boxes.size() >= Hit<T>::none)
        throw Error(ErrorCode::too_many_objects,
                    std::to_string(boxes.size()) + " boxes in one call; give at most 4294967294");
    check_boxes_of(boxes, "to be joined ");
}

void check(const QueryFilter& filter, std::uint64_t ids, std::uint64_t number)
{
    check_ids(filter.category, ids, "category", number);
    check_ids(filter.mask, ids, "mask", number);
    check_ids(filter.owner, ids, "owner", number);
    if (ids == 0 || filter.category.empty() == filter.mask.empty()) return;
    Report report("query filter", number);
    report << (filter.category.empty() ? "mask is given without category" : "category is given without mask")
           << "; give both or neither";
    report.raise(ErrorCode::size_mismatch);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void check<Dim, T>(const Ray<Dim, T>&, std::uint64_t);                                          \
    template void check<Dim, T>(const Sweep<Dim, T>&, std::uint64_t);                                        \
    template void check<Dim, T>(const Aabb<Dim, T>&, std::uint64_t);                                         \
    template void check<Dim, T>(const Sphere<Dim, T>&, std::uint64_t);                                       \
    template void check<Dim, T>(const Frustum<Dim, T>&, std::uint64_t);                                      \
    template void check<Dim, T>(const Nearest<Dim, T>&, std::uint64_t);                                      \
    template void check<Dim, T>(const NearestToBox<Dim, T>&, std::uint64_t);                                 \
    template void check_joined(const BoxView<Dim, T>&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

void check_room(std::size_t queries, std::size_t results)
{
    if (queries != results) detail::throw_not_one_each(queries, results, "places for answers");
}
} // namespace index

void detail::throw_not_one_each(std::size_t queries, std::size_t count, const char* things)
{
    throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(queries) + " queries and " +
                                              std::to_string(count) + " " + things + "; give one for each");
}

void detail::throw_bad_bound(std::uint32_t object)
{
    throw Error(ErrorCode::nan_coordinate,
                "the visitor of object " + std::to_string(object) +
                    " has made the bound NaN; it must be a number",
                object);
}

JOSTLE_NAMESPACE_END
