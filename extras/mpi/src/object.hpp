// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory_resource>
#include <unordered_map>

#include "bytes.hpp"
#include "jostle/mpi.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// splitmix64's finish (Steele, Lea, Flood, 2014): ids may ascend one by one, or differ in high bits alone.
[[nodiscard]] inline std::uint64_t mixed(std::uint64_t id) noexcept
{
    id = (id ^ (id >> 30)) * 0xbf58476d1ce4e5b9u;
    id = (id ^ (id >> 27)) * 0x94d049bb133111ebu;
    return id ^ (id >> 31);
}
struct MixedHash
{
    std::size_t operator()(std::uint64_t id) const noexcept { return static_cast<std::size_t>(mixed(id)); }
};
/// Where something with an id lies. Nothing depends on the order of its elements.
using Places = std::pmr::unordered_map<std::uint64_t, std::uint32_t, MixedHash>;

enum class Presence : std::uint8_t
{
    absent, ///< not added yet, or removed
    disabled,
    enabled,
};

/// All that pairs depend on, at one time: whether two objects touch follows from the states of both.
template <int Dim, class T>
struct State
{
    Aabb<Dim, T> bounds{};
    ObjectFilter filter;
    Presence presence = Presence::absent;
};

[[nodiscard]] inline bool may_pair(const ObjectFilter& a, const ObjectFilter& b) noexcept
{
    return (a.category & b.mask) != 0 && (b.category & a.mask) != 0 && !(a.is_static && b.is_static) &&
           (a.owner != b.owner || a.owner == Filter::no_owner);
}

template <int Dim, class T>
[[nodiscard]] bool touch(const State<Dim, T>& a, const State<Dim, T>& b) noexcept
{
    return a.presence == Presence::enabled && b.presence == Presence::enabled &&
           overlaps(a.bounds, b.bounds) && may_pair(a.filter, b.filter);
}

/// Why two objects that touched don't any more.
template <int Dim, class T>
[[nodiscard]] EndReason why_ended(const State<Dim, T>& a, const State<Dim, T>& b) noexcept
{
    const Presence least = std::min(a.presence, b.presence);
    return least == Presence::absent       ? EndReason::removed
           : least == Presence::disabled   ? EndReason::disabled
           : !overlaps(a.bounds, b.bounds) ? EndReason::moved_apart
                                           : EndReason::filtered;
}

template <int Dim, class T>
[[nodiscard]] bool differ(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b) noexcept
{
    for (int d = 0; d < Dim; ++d)
        if (a.lo[d] != b.lo[d] || a.hi[d] != b.hi[d]) return true;
    return false;
}

/// What there is to an object besides its box. Most have nothing that differs from this.
template <int Dim, Coordinate T>
struct Details
{
    Vec<Dim, T> displacement{};
    T margin = 0; ///< its own alone
    ObjectFilter filter;
    bool enabled = true;
    friend bool operator==(const Details&, const Details&) = default;

    [[nodiscard]] Aabb<Dim, T> bounds(const Aabb<Dim, T>& box, T margin_of_world) const noexcept
    {
        const T all = margin_of_world + margin;
        Aabb<Dim, T> result = box;
        for (int d = 0; d < Dim; ++d) {
            result.lo[d] = std::min(box.lo[d], box.lo[d] + displacement[d]) - all;
            result.hi[d] = std::max(box.hi[d], box.hi[d] + displacement[d]) + all;
        }
        return result;
    }
};

/// What its rank knows of an object.
template <int Dim, Coordinate T>
struct Object
{
    Aabb<Dim, T> box{};
    Details<Dim, T> details{};

    [[nodiscard]] Aabb<Dim, T> bounds(T margin_of_world) const noexcept
    {
        return details.bounds(box, margin_of_world);
    }
    [[nodiscard]] State<Dim, T> state(T margin_of_world) const noexcept
    {
        return {bounds(margin_of_world), details.filter,
                details.enabled ? Presence::enabled : Presence::disabled};
    }

    template <class Bytes>
    void write(Bytes& bytes) const
    {
        put(bytes, box);
        for (int d = 0; d < Dim; ++d)
            put(bytes, details.displacement[d]);
        put(bytes, details.margin);
        put(bytes, details.filter);
        put(bytes, std::uint8_t{details.enabled});
    }
    [[nodiscard]] static Object read(Reader& from) noexcept
    {
        Object object;
        object.box = from.box<Dim, T>();
        for (int d = 0; d < Dim; ++d)
            object.details.displacement[d] = from.take<T>();
        object.details.margin = from.take<T>();
        object.details.filter = from.filter();
        object.details.enabled = from.take<std::uint8_t>() != 0;
        return object;
    }
};

/// Makes room for one more, so that push_back won't fail.
template <class Vector>
void make_room(Vector& vector)
{
    if (vector.size() == vector.capacity()) vector.reserve(2 * vector.size() + 16);
}

} // namespace mpi
JOSTLE_NAMESPACE_END
