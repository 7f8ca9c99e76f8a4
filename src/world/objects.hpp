// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory_resource>

#include "fetch.hpp"
#include "jostle/world.hpp"
#include "world/chunked_array.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Objects are all over the place: loops ask for those to come.
inline constexpr std::size_t fetch_ahead = 16;

/// Where an object was after the last update.
enum class Place : std::uint32_t
{
    none, // not in the world
    disabled,
    active,
    resting
};

namespace flag {
constexpr std::uint16_t place = 3; // the two bits of `Place`
constexpr std::uint16_t alive = 1u << 2, enabled = 1u << 3, is_static = 1u << 4;
constexpr std::uint16_t has_shape = 1u << 5; // its bounds are not just the box that was given
constexpr std::uint16_t second = 1u << 6;    // which of its two boxes is the present one
// In the update under way:
constexpr std::uint16_t touched = 1u << 8;      // the other box is that of the last update
constexpr std::uint16_t refiltered = 1u << 9;   // so is what `old_filters` has
constexpr std::uint16_t shape_saved = 1u << 10; // and `old_shapes`
constexpr std::uint16_t contested = 1u << 11;   // commands about it must be put in order
constexpr std::uint16_t asked = 1u << 12;       // its filter was set: `accept` is asked again
constexpr std::uint16_t transient = touched | refiltered | shape_saved | contested | asked;
} // namespace flag

/// Many objects, each property apart: what an update reads of all that moves is little more than boxes.
template <int Dim, class T>
struct ObjectChunk
{
    static constexpr std::uint32_t bits = 12, size = 1u << bits;
    Aabb<Dim, T> box[2][size];
    struct FilterNumbers
    {
        std::uint32_t category, mask, owner;
    } filter[size];
    std::uint16_t state[size];
};

/// One object, where it lies. `Chunk` is an ObjectChunk, or a const one.
template <class Chunk>
class ObjectIn
{
  public:
    ObjectIn(Chunk& chunk, std::uint32_t at) noexcept : chunk_(&chunk), at_(at) {}

    [[nodiscard]] auto& now() const noexcept { return chunk_->box[state() / flag::second % 2][at_]; }
    /// Its box after the last update, while `touched`.
    [[nodiscard]] auto& before() const noexcept { return chunk_->box[1 - state() / flag::second % 2][at_]; }
    [[nodiscard]] auto& numbers() const noexcept { return chunk_->filter[at_]; }

    [[nodiscard]] std::uint16_t state() const noexcept { return chunk_->state[at_]; }
    void set_state(std::uint32_t bits) const noexcept
    {
        chunk_->state[at_] = static_cast<std::uint16_t>(bits);
    }
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
    /// Has pairs, perhaps, after this update.
    [[nodiscard]] bool is_there() const noexcept
    {
        return (state() & (flag::alive | flag::enabled)) == (flag::alive | flag::enabled);
    }
    /// From now on `before` is what `now` is.
    void keep_box() const noexcept
    {
        before() = now();
        exchange_boxes();
    }
    /// What is in the other box is the present one from now on.
    void exchange_boxes() const noexcept { set_state((state() | flag::touched) ^ flag::second); }

    [[nodiscard]] ObjectFilter filter() const noexcept
    {
        return {numbers().category, numbers().mask, numbers().owner, has(flag::is_static)};
    }
    void set_filter(const ObjectFilter& filter) const noexcept
    {
        numbers() = {filter.category, filter.mask, filter.owner};
        set(flag::is_static, filter.is_static);
    }
    void prefetch_state() const noexcept { fetch(&chunk_->state[at_]); }
    void prefetch_boxes() const noexcept
    {
        fetch(&chunk_->box[0][at_]);
        fetch(&chunk_->box[1][at_]);
    }

  private:
    Chunk* chunk_;
    std::uint32_t at_;
};

/// All objects, by index.
template <int Dim, class T>
class Objects
{
    using Chunk = ObjectChunk<Dim, T>;

  public:
    explicit Objects(std::pmr::memory_resource* memory) : chunks_(memory) {}
    /// Room for `count` at least; new ones are nowhere.
    void grow(std::size_t count) { chunks_.grow((count + Chunk::size - 1) / Chunk::size); }
    [[nodiscard]] std::size_t capacity() const noexcept { return chunks_.capacity() * Chunk::size; }
    [[nodiscard]] ObjectIn<Chunk> operator[](std::uint32_t index) noexcept
    {
        return {chunks_[index / Chunk::size], index % Chunk::size};
    }
    [[nodiscard]] ObjectIn<const Chunk> operator[](std::uint32_t index) const noexcept
    {
        return {chunks_[index / Chunk::size], index % Chunk::size};
    }
    [[nodiscard]] std::uint64_t bytes() const noexcept { return chunks_.bytes(); }

  private:
    ChunkedArray<Chunk, 0> chunks_;
};

[[nodiscard]] inline bool passes(const ObjectFilter& a, const ObjectFilter& b) noexcept
{
    return ((a.category & b.mask) != 0) & ((b.category & a.mask) != 0) &
           ((a.owner != b.owner) | (a.owner == Filter::no_owner)) & !(a.is_static & b.is_static);
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
