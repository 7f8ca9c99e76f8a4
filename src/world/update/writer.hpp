// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "base/checks.hpp"
#include "world/update/changes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// An object that apply() has written to, and whether it was in the world before.
struct Noted
{
    Index index;
    bool was_alive;
};

/// Writes commands into objects, and makes Changes keep their old state.
template <int Dim, class T>
class Writer
{
  public:
    using Box = Aabb<Dim, T>;

    Writer(State<Dim, T>& state, Changes<Dim, T>& changes, Arena& arena);

    /// If `noted` isn't null, it gets the objects that are written to from now on, and whether they existed.
    void begin(std::pmr::vector<Noted>* noted) noexcept;
    /// Sets the queue whose commands come next, numbered from 1.
    void set_queue(std::uint32_t queue);
    void add(const Addition<Dim, T>& addition);
    void apply(const Command<Dim, T>& command);
    void move(ObjectId id, const Box& box);

    /// Objects with commands in several queues, or whose commands have a sequence.
    [[nodiscard]] bool any_contested() const noexcept { return any_contested_; }

    /// Whether a command has removed an object.
    [[nodiscard]] bool any_removed() const noexcept { return any_removed_; }

    /// Records the object as written to, before it is.
    void touch(Index index);

    // One property of an object that can be written:
    void set_box(Index index, const Box& box);
    void set_displacement(Index index, const T* displacement);
    /// The sum of the object's and the world's margin.
    void set_margin(Index index, T margin);
    void set_filter(Index index, const ObjectFilter& filter);

  private:
    using Object = typename Objects<Dim, T>::Object;

    [[nodiscard]] bool open(ObjectId id);
    void contest(Object object) noexcept;
    void resize(Index index, const Box& size);
    void set_bounds(Index index);
    Reach<Dim, T>& reach_of(Index index);

    State<Dim, T>& state_;
    Changes<Dim, T>& changes_;
    bool any_contested_ = false;
    bool any_removed_ = false;
    static constexpr std::uint32_t nobody = 0; // instead of a queue's number
    std::uint32_t queue_ = nobody;
    std::pmr::vector<Noted>* noted_ = nullptr;
    Table<Index, std::uint32_t>& queue_of_; // that wrote to an object in this update; `nobody` for new ones
};

/// Applies the commands for contested objects again: for each property the greatest sequence wins; among
/// equal ones of one queue the last, and of several queues a choice by the values.
template <int Dim, class T>
void settle_contests(State<Dim, T>& state, Changes<Dim, T>& changes, Writer<Dim, T>& writer,
                     const Queues<Dim, T>& queues, const Moves<Dim, T>& moves, std::uint32_t own_queue,
                     Arena& arena);

/// What commands have changed since the last update, and the writer that continues it.
template <int Dim, class T>
struct Applied
{
    Applied(State<Dim, T>& state, Arena& arena) : changes(state, arena), writer(state, changes, arena) {}

    Changes<Dim, T> changes;
    Writer<Dim, T> writer;
    std::size_t added = 0, removed = 0; // objects, as far as apply() shows them
};

/// The stage `apply` of an update: applies what was taken from the queues, and `moves`, to the objects.
template <int Dim, class T>
void apply(State<Dim, T>& state, Queues<Dim, T>& queues, const Moves<Dim, T>& moves, Applied<Dim, T>& applied,
           Arena& arena);
/// A part of it, ahead of the update and for queries: applies what was taken. `noted` becomes the objects
/// that this call has written to.
template <int Dim, class T>
void apply_ahead(State<Dim, T>& state, Queues<Dim, T>& queues, Applied<Dim, T>& applied,
                 std::pmr::vector<Noted>& noted, Arena& arena);

template <int Dim, class T>
void check_box(const Aabb<Dim, T>& box, ObjectId id)
{
    jostle::check_box(box, id.index, "of object ");
}

} // namespace world
JOSTLE_NAMESPACE_END
