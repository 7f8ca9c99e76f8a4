// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>

#include "jostle/world.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Where an object was after the last update.
enum class Place : std::uint32_t
{
    none, // not in the world
    disabled,
    active,
    resting
};

namespace flag {
constexpr std::uint32_t place = 3; // the two bits of `Place`
constexpr std::uint32_t alive = 1u << 2, enabled = 1u << 3, is_static = 1u << 4;
constexpr std::uint32_t has_shape = 1u << 5; // its bounds are not just the box that was given
// In the update under way:
constexpr std::uint32_t touched = 1u << 8;      // `before` holds the bounds of the last update
constexpr std::uint32_t refiltered = 1u << 9;   // so does `old_filters`
constexpr std::uint32_t shape_saved = 1u << 10; // and `old_shapes`
constexpr std::uint32_t contested = 1u << 11;   // commands about it must be put in order
constexpr std::uint32_t leap = 1u << 12;
constexpr std::uint32_t asked = 1u << 13; // its filter was set: `accept` is asked again
constexpr std::uint32_t transient = touched | refiltered | shape_saved | contested | leap | asked;
} // namespace flag

/// One object: in 3D with floats exactly a cache line, which is what a candidate pair costs twice.
template <int Dim, class T>
struct alignas(64) Object
{
    Aabb<Dim, T> now;
    Aabb<Dim, T> before; // while `touched`
    std::uint32_t category;
    std::uint32_t mask;
    std::uint32_t owner;
    std::uint32_t state;

    [[nodiscard]] Place place() const noexcept { return static_cast<Place>(state & flag::place); }
    void set_place(Place p) noexcept { state = (state & ~flag::place) | static_cast<std::uint32_t>(p); }
    [[nodiscard]] bool has(std::uint32_t bits) const noexcept { return (state & bits) != 0; }
    void set(std::uint32_t bits, bool on) noexcept { state = on ? state | bits : state & ~bits; }
    /// Could have pairs after the last update; has them, perhaps, after this one.
    [[nodiscard]] bool was_there() const noexcept { return (state & 2u) != 0; }
    [[nodiscard]] bool is_there() const noexcept
    {
        return (state & (flag::alive | flag::enabled)) == (flag::alive | flag::enabled);
    }
    [[nodiscard]] const Aabb<Dim, T>& old() const noexcept { return has(flag::touched) ? before : now; }
    [[nodiscard]] ObjectFilter filter() const noexcept
    {
        return {category, mask, owner, has(flag::is_static)};
    }
    void set_filter(const ObjectFilter& filter) noexcept
    {
        category = filter.category;
        mask = filter.mask;
        owner = filter.owner;
        set(flag::is_static, filter.is_static);
    }
};

static_assert(static_cast<int>(Place::disabled) == 1 && static_cast<int>(Place::active) == 2 &&
              static_cast<int>(Place::resting) == 3); // was_there looks at the upper bit

template <class A>
[[nodiscard]] bool agree(const A& a, const A& b) noexcept
{
    return ((a.category & b.mask) != 0) & ((b.category & a.mask) != 0) &
           ((a.owner != b.owner) | (a.owner == Filter::no_owner));
}
[[nodiscard]] inline bool passes(const ObjectFilter& a, const ObjectFilter& b) noexcept
{
    return agree(a, b) && !(a.is_static && b.is_static);
}
template <int Dim, class T>
[[nodiscard]] bool passes(const Object<Dim, T>& a, const Object<Dim, T>& b) noexcept
{
    return agree(a, b) & ((a.state & b.state & flag::is_static) == 0);
}

/// How an object's bounds come from what was given.
template <int Dim, class T>
struct Shape
{
    Aabb<Dim, T> box;
    T displacement[Dim];
    T margin;

    [[nodiscard]] Aabb<Dim, T> bounds() const noexcept
    {
        Aabb<Dim, T> all = box;
        for (int d = 0; d < Dim; ++d) {
            all.lo[d] = std::min(box.lo[d], box.lo[d] + displacement[d]) - margin;
            all.hi[d] = std::max(box.hi[d], box.hi[d] + displacement[d]) + margin;
        }
        return all;
    }
};

template <int Dim, class T>
[[nodiscard]] bool same(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    bool all = true;
    for (int d = 0; d < Dim; ++d)
        all &= (a.lo[d] == b.lo[d]) & (a.hi[d] == b.hi[d]);
    return all;
}

template <int Dim, class T>
[[nodiscard]] Aabb<Dim, T> hull(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    Aabb<Dim, T> all;
    for (int d = 0; d < Dim; ++d) {
        all.lo[d] = std::min(a.lo[d], b.lo[d]);
        all.hi[d] = std::max(a.hi[d], b.hi[d]);
    }
    return all;
}

template <int Dim, class T>
[[nodiscard]] T volume(const Aabb<Dim, T>& box) noexcept
{
    T product = 1;
    for (int d = 0; d < Dim; ++d)
        product *= box.hi[d] - box.lo[d];
    return product;
}

/// A move so far that searching the two places costs less than searching the box around both. Points leap
/// whenever they move on all axes.
template <int Dim, class T>
[[nodiscard]] bool is_leap(const Aabb<Dim, T>& from, const Aabb<Dim, T>& to,
                           const Aabb<Dim, T>& around) noexcept
{
    return volume(around) > 4 * (volume(from) + volume(to));
}

/// Closed and branchless, where `overlaps` leaves the choice to the compiler.
template <int Dim, class T>
[[nodiscard]] bool touch(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    bool all = true;
    for (int d = 0; d < Dim; ++d)
        all &= (a.lo[d] <= b.hi[d]) & (b.lo[d] <= a.hi[d]);
    return all;
}

[[nodiscard]] constexpr std::uint64_t pair_key(std::uint32_t x, std::uint32_t y) noexcept
{
    return x < y ? (std::uint64_t{x} << 32 | y) : (std::uint64_t{y} << 32 | x);
}

} // namespace world
JOSTLE_NAMESPACE_END
