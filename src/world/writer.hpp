// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "base/checks.hpp"
#include "world/changes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Writes what commands say into objects, and has Changes keep what they were.
template <int Dim, class T>
class Writer
{
  public:
    using Box = Aabb<Dim, T>;

    /// `several_queues`: of more than one queue there are commands, which may be about the same objects.
    Writer(State<Dim, T>& state, Changes<Dim, T>& changes, bool several_queues, Arena& arena);

    /// Whose commands come now: numbered from 1.
    void set_queue(std::uint32_t queue) noexcept { queue_ = queue; }
    void add(const Addition<Dim, T>& addition);
    void apply(const Command<Dim, T>& command);
    void move(ObjectId id, const Box& box);

    /// Objects about which several queues had something to say, or that were given a sequence.
    [[nodiscard]] bool any_contested() const noexcept { return any_contested_; }

    // One property of an object that can be written:
    void set_box(Index index, const Box& box);
    void set_displacement(Index index, const T* displacement);
    /// The object's and the world's together.
    void set_margin(Index index, T margin);
    void set_filter(Index index, const ObjectFilter& filter);

  private:
    using Object = typename Objects<Dim, T>::Object;

    [[nodiscard]] bool open(ObjectId id);
    void note_queue(Index index) noexcept;
    void contest(Object object) noexcept;
    void resize(Index index, const Box& size);
    Reach<Dim, T>& reach_of(Index index);

    State<Dim, T>& state_;
    Changes<Dim, T>& changes_;
    bool several_queues_;
    bool any_contested_ = false;
    std::uint32_t queue_ = 0;
    Table<Index, std::uint32_t>& queue_of_; // that wrote to an object of this update; 0: it is new
};

/// Does over what was done to contested objects: for each property the greatest sequence wins, among equal
/// ones of one queue the last, and of several queues a choice by the values.
template <int Dim, class T>
void settle_contests(State<Dim, T>& state, Changes<Dim, T>& changes, Writer<Dim, T>& writer,
                     const Queues<Dim, T>& queues, const Moves<Dim, T>& moves, std::uint32_t own_queue,
                     Arena& arena);

template <int Dim, class T>
void check_box(const Aabb<Dim, T>& box, ObjectId id)
{
    jostle::check_box(box, id.index, "of object ");
}

} // namespace world
JOSTLE_NAMESPACE_END
