// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "jostle/vec.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// A closed axis-aligned bounding box: the points p with lo[d] <= p[d] <= hi[d] on every axis d.
///
/// Units    any one length unit, the same for all boxes of a call.
/// Valid    lo[d] <= hi[d] on every axis. Zero-size boxes (points, rectangles) and infinite bounds are
///          valid. NaN and lo > hi are not: functions that read boxes report them as an `Error`.
template <int Dim, Coordinate T>
struct Aabb
{
    Vec<Dim, T> lo;
    Vec<Dim, T> hi;
};

using Aabb2f = Aabb<2, float>;
using Aabb3f = Aabb<3, float>;
using Aabb2d = Aabb<2, double>;
using Aabb3d = Aabb<3, double>;

/// True when the closed boxes share at least one point: touching counts as overlapping.
///
/// Every engine reports exactly the pairs for which this is true.
/// Source   Ericson, Real-Time Collision Detection (2005), sec. 4.2.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool overlaps(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    for (int d = 0; d < Dim; ++d)
        if (!(a.lo[d] <= b.hi[d] && b.lo[d] <= a.hi[d])) return false;
    return true;
}

/// Whether a point lies in the closed box; false for NaN.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool contains(const Aabb<Dim, T>& box, const Vec<Dim, T>& point) noexcept
{
    for (int d = 0; d < Dim; ++d)
        if (!(box.lo[d] <= point[d] && point[d] <= box.hi[d])) return false;
    return true;
}
/// Whether no point of `inner` lies outside the box; false with any NaN.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr bool contains(const Aabb<Dim, T>& box, const Aabb<Dim, T>& inner) noexcept
{
    for (int d = 0; d < Dim; ++d)
        if (!(box.lo[d] <= inner.lo[d] && inner.hi[d] <= box.hi[d])) return false;
    return true;
}

/// The smallest box around both. Where one bound is NaN, the result has a's.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr Aabb<Dim, T> merged(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    return {min(a.lo, b.lo), max(a.hi, b.hi)};
}
/// The box with all sides moved outwards by `by`, or inwards if `by` is negative, which may invert it.
/// Rounded to nearest.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr Aabb<Dim, T> grown(Aabb<Dim, T> box, std::type_identity_t<T> by) noexcept
{
    for (int d = 0; d < Dim; ++d) {
        box.lo[d] -= by;
        box.hi[d] += by;
    }
    return box;
}
/// The smallest box around the box and its position after moving by `displacement`. Rounded to nearest.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr Aabb<Dim, T> swept(const Aabb<Dim, T>& box, const Vec<Dim, T>& displacement) noexcept
{
    return merged(box, {box.lo + displacement, box.hi + displacement});
}
/// The centre of a box. NaN on an axis where it is infinite both ways.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr Vec<Dim, T> center(const Aabb<Dim, T>& box) noexcept
{
    return box.lo * T(0.5) + box.hi * T(0.5); // no sum that is beyond T's range
}
/// The length of a box on each axis.
template <int Dim, Coordinate T>
[[nodiscard]] constexpr Vec<Dim, T> size(const Aabb<Dim, T>& box) noexcept
{
    return box.hi - box.lo;
}

/// The smallest box with coordinates of type To that contains the box, such as rounded_outward<float>(box) of
/// doubles. A bound beyond To's range becomes To's greatest number where it is rounded inwards, and infinity
/// where it is rounded outwards. Infinities and NaN stay.
template <Coordinate To, int Dim, Coordinate T>
[[nodiscard]] Aabb<Dim, To> rounded_outward(const Aabb<Dim, T>& box) noexcept
{
    // The greatest number of To that isn't above x.
    const auto down = [](T x) {
        if constexpr (sizeof(To) < sizeof(T)) {
            constexpr To infinity = std::numeric_limits<To>::infinity(),
                         most = std::numeric_limits<To>::max();
            if (x < -T{most}) return -infinity;
            if (x > T{most}) return x == T{infinity} ? infinity : most;
            const To near = static_cast<To>(x);
            return T{near} > x ? std::nextafter(near, -infinity) : near;
        } else {
            return To{x};
        }
    };
    Aabb<Dim, To> out;
    for (int d = 0; d < Dim; ++d) {
        out.lo[d] = down(box.lo[d]);
        out.hi[d] = -down(-box.hi[d]);
    }
    return out;
}

/// A read-only view of one value per object, `stride` bytes apart: a member of the user's own structs, or
/// a plain array. Element i belongs to object i.
///
/// Lifetime  a view: the memory must outlive it.
template <class T>
class StridedView
{
  public:
    StridedView() = default;
    StridedView(const T* first, std::size_t size, std::ptrdiff_t stride_bytes = sizeof(T)) noexcept
        : first_(reinterpret_cast<const std::byte*>(first)), stride_(stride_bytes), own_(size), size_(size)
    {
    }
    /// An array, vector or span.
    template <class Container>
        requires std::convertible_to<const Container&, std::span<const T>>
    StridedView(const Container& values) noexcept
        : StridedView(std::span<const T>(values).data(), std::span<const T>(values).size())
    {
    }
    /// The member `field` of each struct of an array, read in place.
    template <class Item, std::size_t Extent, class Struct>
        requires std::same_as<std::remove_const_t<Item>, Struct>
    StridedView(std::span<Item, Extent> structs, T Struct::* field) noexcept
        : StridedView(structs.empty() ? nullptr : &(structs.front().*field), structs.size(), sizeof(Struct))
    {
    }

    /// Returns a view of `size` elements that repeats this one: element i is this view's element i % size().
    /// So one set of shapes for a robot's links serves any number of configurations. Repeating a view that
    /// already repeats keeps its period. An empty view stays empty.
    [[nodiscard]] StridedView repeated(std::size_t size) const noexcept
    {
        StridedView view = *this;
        view.own_ = own_ < size_ ? own_ : size_;
        view.size_ = view.own_ == 0 ? 0 : size;
        return view;
    }

    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    [[nodiscard]] const T& operator[](std::size_t i) const noexcept
    {
        if (i >= own_) i %= own_;
        return *reinterpret_cast<const T*>(first_ + static_cast<std::ptrdiff_t>(i) * stride_);
    }

  private:
    const std::byte* first_ = nullptr;
    std::ptrdiff_t stride_ = sizeof(T);
    std::size_t own_ = 0; ///< elements in memory, at least 1 unless size_ is 0
    std::size_t size_ = 0;
};

/// Boxes in the user's own memory, read in place, never copied or written.
///
///     struct Enemy { int id; float min[3], max[3]; };
///     std::vector<Enemy> enemies = ...;
///     finder.find(jostle::BoxView<3, float>::strided(enemies[0].min, enemies[0].max, enemies.size(),
///                                                    sizeof(Enemy)));
///
/// Shape     one pointer per coordinate to the first box's value and one stride in bytes for all. That
///           covers arrays of boxes, boxes inside bigger structs, one array per coordinate, and NumPy views.
/// Order     box i of the view is object i of every result.
/// Lifetime  a view: the memory must outlive it, and must not change during a call that reads it.
template <int Dim, Coordinate T>
class BoxView
{
  public:
    BoxView() = default;

    /// An array (or vector, or span) of `Aabb`.
    template <std::size_t Extent>
    BoxView(std::span<const Aabb<Dim, T>, Extent> boxes) noexcept
        : BoxView(strided(boxes.empty() ? nullptr : boxes.front().lo.data(),
                          boxes.empty() ? nullptr : boxes.front().hi.data(), boxes.size(),
                          sizeof(Aabb<Dim, T>)))
    {
    }
    template <class Container>
        requires std::convertible_to<const Container&, std::span<const Aabb<Dim, T>>>
    BoxView(const Container& boxes) noexcept : BoxView(std::span<const Aabb<Dim, T>>(boxes))
    {
    }

    /// Boxes inside structs: `lo` and `hi` point to the Dim consecutive coordinates of the first box, the
    /// next box's are `stride_bytes` further on. Any stride that keeps T aligned is allowed, also a negative
    /// one.
    [[nodiscard]] static BoxView strided(const T* lo, const T* hi, std::size_t size,
                                         std::ptrdiff_t stride_bytes) noexcept
    {
        BoxView view;
        for (int d = 0; d < Dim; ++d) {
            view.lo_[d] = lo == nullptr ? nullptr : lo + d;
            view.hi_[d] = hi == nullptr ? nullptr : hi + d;
        }
        view.stride_ = stride_bytes;
        view.size_ = size;
        return view;
    }

    /// One array per coordinate: lo[d][i] and hi[d][i] belong to box i.
    [[nodiscard]] static BoxView arrays(const std::array<const T*, detail::axes<Dim>>& lo,
                                        const std::array<const T*, detail::axes<Dim>>& hi, std::size_t size,
                                        std::ptrdiff_t stride_bytes = sizeof(T)) noexcept
    {
        BoxView view;
        for (std::size_t d = 0; d < Dim; ++d) {
            view.lo_[d] = lo[d];
            view.hi_[d] = hi[d];
        }
        view.stride_ = stride_bytes;
        view.size_ = size;
        return view;
    }

    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    [[nodiscard]] T lo(int axis, std::size_t i) const noexcept { return at(lo_[axis], i); }
    [[nodiscard]] T hi(int axis, std::size_t i) const noexcept { return at(hi_[axis], i); }
    [[nodiscard]] Aabb<Dim, T> operator[](std::size_t i) const noexcept
    {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = lo(d, i);
            box.hi[d] = hi(d, i);
        }
        return box;
    }

    /// A view of the boxes [first, first + count).
    [[nodiscard]] BoxView subview(std::size_t first, std::size_t count) const noexcept
    {
        BoxView view = *this;
        for (int d = 0; d < Dim; ++d) {
            view.lo_[d] = lo_pointer(d, first);
            view.hi_[d] = hi_pointer(d, first);
        }
        view.size_ = count;
        return view;
    }

    [[nodiscard]] std::ptrdiff_t stride_bytes() const noexcept { return stride_; }
    [[nodiscard]] const T* lo_pointer(int axis, std::size_t i = 0) const noexcept
    {
        return address(lo_[axis], i);
    }
    [[nodiscard]] const T* hi_pointer(int axis, std::size_t i = 0) const noexcept
    {
        return address(hi_[axis], i);
    }

  private:
    const T* address(const T* first, std::size_t i) const noexcept
    {
        return reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(first) +
                                          static_cast<std::ptrdiff_t>(i) * stride_);
    }
    T at(const T* first, std::size_t i) const noexcept { return *address(first, i); }

    const T* lo_[detail::axes<Dim>] = {};
    const T* hi_[detail::axes<Dim>] = {};
    std::ptrdiff_t stride_ = sizeof(Aabb<Dim, T>);
    std::size_t size_ = 0;
};

template <int Dim, Coordinate T, std::size_t Extent>
BoxView(std::span<const Aabb<Dim, T>, Extent>) -> BoxView<Dim, T>;
template <int Dim, Coordinate T, std::size_t Extent>
BoxView(std::span<Aabb<Dim, T>, Extent>) -> BoxView<Dim, T>;

namespace detail {
template <int Dim, class T>
BoxView<Dim, T> view_of(std::span<const Aabb<Dim, T>>);
template <class Given>
inline constexpr bool is_box_view = false;
template <int Dim, class T>
inline constexpr bool is_box_view<BoxView<Dim, T>> = true;
} // namespace detail

/// A contiguous container of boxes: std::vector<Aabb3f>, std::array, std::span, a plain array. Functions that
/// take a BoxView take these as well. For boxes of other types use BoxView::strided.
template <class Container>
concept BoxContainer = requires(const Container& boxes) {
    std::span(boxes);
    detail::view_of(std::span<const typename decltype(std::span(boxes))::value_type>(boxes));
};

/// A BoxContainer, or a BoxView.
template <class Given>
concept AnyBoxes = BoxContainer<Given> || detail::is_box_view<Given>;

/// The view of all boxes of a container; of a view itself.
template <AnyBoxes Boxes>
[[nodiscard]] auto box_view(const Boxes& boxes) noexcept
{
    if constexpr (detail::is_box_view<Boxes>) {
        return boxes;
    } else {
        const std::span<const typename decltype(std::span(boxes))::value_type> all(boxes);
        return decltype(detail::view_of(all))(all);
    }
}

/// The same sort of boxes as in `Other`.
template <class Given, class Other>
concept BoxesLike = AnyBoxes<Given> && AnyBoxes<Other> &&
                    std::same_as<decltype(box_view(std::declval<const Given&>())),
                                 decltype(box_view(std::declval<const Other&>()))>;

JOSTLE_NAMESPACE_END
