// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory_resource>

#include "base/box.hpp"
#include "base/prefetch.hpp"
#include "jostle/world.hpp"
#include "world/objects/chunked_array.hpp"
#include "world/objects/numbers.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Consecutive objects of a list are anywhere in memory, so loops prefetch the object this many places ahead.
inline constexpr std::size_t fetch_ahead = 16;

/// Where an object was after the last update.
enum class Place : std::uint32_t
{
    none, // not in the world
    disabled,
    active, // it changes, or has changed recently
    resting,
    parked // it waits to come to rest
};

/// As in records and snapshots. The order in which objects come to rest is in a separate list.
constexpr Place recorded(Place place) noexcept
{
    return place == Place::parked ? Place::active : place;
}

/// The bits of an object's state.
namespace flag {
constexpr std::uint32_t place = 7; // the three bits of `Place`
constexpr std::uint32_t alive = 1u << 3, enabled = 1u << 4, is_static = 1u << 5;
constexpr std::uint32_t has_reach = 1u << 6; // its bounds are more than the given box
constexpr std::uint32_t second = 1u << 7;    // which of its two boxes is the present one
constexpr std::uint32_t shifted = 1u << 8;   // it rests, and has moved there recently
// In the current update:
constexpr std::uint32_t written = 1u << 9;     // the other box is that of the last update
constexpr std::uint32_t refiltered = 1u << 10; // Changes has the filter of the last update
constexpr std::uint32_t reach_kept = 1u << 11; // Changes has the reach of the last update
constexpr std::uint32_t contested = 1u << 12;  // its commands must be put in order
constexpr std::uint32_t again = 1u << 13;      // Changes has pairs of it to be reported as new
constexpr std::uint32_t noted = 1u << 14;      // the current call of apply() has it in its list
constexpr std::uint32_t transient = written | refiltered | reach_kept | contested | again | noted;
} // namespace flag

/// Many objects, with an array for each property, so that an update of moving objects reads little more than
/// boxes.
template <int Dim, class T>
struct ObjectChunk
{
    static constexpr std::uint32_t size = 256; // not more: a world of a few objects takes a whole chunk
    ObjectChunk() noexcept
    {
        std::fill_n(state, size, 0u); // other members are written before they are read
    }
    Aabb<Dim, T> box[2][size];
    struct FilterNumbers
    {
        std::uint32_t category, mask, owner;
    } filter[size];
    std::uint32_t state[size];
};

/// A reference to one object. `Chunk` is an ObjectChunk, or a const one.
template <class Chunk>
class ObjectIn
{
  public:
    ObjectIn(Chunk& chunk, std::uint32_t at) noexcept : chunk_(&chunk), at_(at) {}

    [[nodiscard]] auto& now() const noexcept { return chunk_->box[state() / flag::second % 2][at_]; }
    /// Its box after the last update, while `written`.
    [[nodiscard]] auto& before() const noexcept { return chunk_->box[1 - state() / flag::second % 2][at_]; }
    /// The same, whether or not an update is in progress.
    [[nodiscard]] const auto& last() const noexcept { return has(flag::written) ? before() : now(); }
    [[nodiscard]] auto& numbers() const noexcept { return chunk_->filter[at_]; }

    [[nodiscard]] std::uint32_t state() const noexcept { return chunk_->state[at_]; }
    void set_state(std::uint32_t bits) const noexcept { chunk_->state[at_] = bits; }
    [[nodiscard]] bool has(std::uint32_t bits) const noexcept { return (state() & bits) != 0; }
    void set(std::uint32_t bits, bool on = true) const noexcept
    {
        set_state(on ? state() | bits : state() & ~bits);
    }
    [[nodiscard]] Place place() const noexcept { return static_cast<Place>(state() & flag::place); }
    void set_place(Place p) const noexcept
    {
        set_state((state() & ~std::uint32_t{flag::place}) | static_cast<std::uint32_t>(p));
    }
    /// Whether it can have pairs after this update.
    [[nodiscard]] bool is_there() const noexcept
    {
        return (state() & (flag::alive | flag::enabled)) == (flag::alive | flag::enabled);
    }
    /// Whether it was enabled after the last update.
    [[nodiscard]] bool was_enabled() const noexcept { return place() != Place::disabled; }
    /// Makes `before` what `now` is.
    void keep_box() const noexcept
    {
        before() = now();
        exchange_boxes();
    }
    /// Makes the other box the present one.
    void exchange_boxes() const noexcept { set_state((state() | flag::written) ^ flag::second); }

    [[nodiscard]] ObjectFilter filter() const noexcept
    {
        return {numbers().category, numbers().mask, numbers().owner, has(flag::is_static)};
    }
    void set_filter(const ObjectFilter& filter) const noexcept
    {
        numbers() = {filter.category, filter.mask, filter.owner};
        set(flag::is_static, filter.is_static);
    }
    void prefetch_state() const noexcept { prefetch(&chunk_->state[at_]); }
    void prefetch_boxes() const noexcept
    {
        prefetch(&chunk_->box[0][at_]);
        prefetch(&chunk_->box[1][at_]);
    }

  private:
    Chunk* chunk_;
    std::uint32_t at_;
};

/// The box of no object: it touches no box.
template <int Dim, class T>
[[nodiscard]] Aabb<Dim, T> nowhere_box() noexcept
{
    Aabb<Dim, T> box;
    std::fill_n(box.lo.begin(), Dim, std::numeric_limits<T>::quiet_NaN());
    box.hi = box.lo;
    return box;
}

/// What extends a box to the bounds, for objects whose bounds are more than the box.
template <int Dim, class T>
struct Reach
{
    Aabb<Dim, T> box;
    T displacement[Dim];
    T margin;

    /// Valid if the box is: where an infinite displacement would turn an infinite bound into NaN, that bound
    /// stays.
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

/// All objects, by index.
template <int Dim, class T>
class Objects
{
    using Chunk = ObjectChunk<Dim, T>;

  public:
    using Object = ObjectIn<Chunk>;
    using ConstObject = ObjectIn<const Chunk>;

    explicit Objects(std::pmr::memory_resource* memory) : chunks_(memory), reaches_(memory) {}
    /// Makes room for at least `count`; new objects are in no place.
    void grow(std::size_t count) { chunks_.grow((count + Chunk::size - 1) / Chunk::size); }
    [[nodiscard]] std::size_t capacity() const noexcept { return chunks_.capacity() * Chunk::size; }
    [[nodiscard]] Object operator[](Index index) noexcept
    {
        return {chunks_[raw(index) / Chunk::size], raw(index) % Chunk::size};
    }
    [[nodiscard]] ConstObject operator[](Index index) const noexcept
    {
        return {chunks_[raw(index) / Chunk::size], raw(index) % Chunk::size};
    }
    void prefetch(Index index) const noexcept
    {
        if (raw(index) >= capacity()) return;
        (*this)[index].prefetch_state();
        (*this)[index].prefetch_boxes();
    }

    /// For an object with `has_reach`, or for which there is room.
    [[nodiscard]] Reach<Dim, T>& reach(Index index) noexcept { return reaches_[raw(index)]; }
    [[nodiscard]] const Reach<Dim, T>& reach(Index index) const noexcept { return reaches_[raw(index)]; }
    void make_room_for_reach(Index index) { reaches_.grow(std::size_t{raw(index)} + 1); }
    /// The box as given, without margin and displacement.
    [[nodiscard]] const Aabb<Dim, T>& box(Index index) const noexcept
    {
        const ConstObject object = (*this)[index];
        return object.has(flag::has_reach) ? reach(index).box : object.now();
    }

  private:
    ChunkedArray<Chunk, 0> chunks_;
    ChunkedArray<Reach<Dim, T>, 8> reaches_;
};

[[nodiscard]] inline bool passes(const ObjectFilter& a, const ObjectFilter& b) noexcept
{
    return ((a.category & b.mask) != 0) & ((b.category & a.mask) != 0) &
           ((a.owner != b.owner) | (a.owner == Filter::no_owner)) & !(a.is_static & b.is_static);
}

} // namespace world
JOSTLE_NAMESPACE_END
