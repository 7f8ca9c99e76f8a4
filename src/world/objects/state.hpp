// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory_resource>
#include <string>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/world.hpp"
#include "world/objects/filter_classes.hpp"
#include "world/objects/ids.hpp"
#include "world/objects/key_set.hpp"
#include "world/objects/numbers.hpp"
#include "world/objects/objects.hpp"
#include "world/objects/parked.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// Pairs are processed in runs of this many, and objects, each of which takes as long as several pairs.
constexpr std::size_t run_length = 4096, object_run = 512;

// How many updates an object must stay unchanged before it comes to rest, or is parked.
constexpr std::uint32_t idle_updates = 3;
// New objects need only one, and aren't parked: objects that have never moved seldom do, and an index that is
// filled at once answers faster than one that grows bit by bit.
constexpr std::uint32_t due = idle_updates;
// How many updates a resting object that has moved must stay unchanged before it may move again without
// waking up: an object that moves in every other update had better be active.
constexpr std::uint32_t shifted_updates = 2;

template <int Dim, class T>
class Changes;

/// The state of a world. The stages of an update plan what is to change, and `commit_objects` and
/// `commit_rest` in update.cpp change it. Before that only `apply` writes to objects, which is undone unless
/// the update is kept, and the index takes the objects that come to rest: the last step that can fail.
template <int Dim, class T>
struct State
{
    State(const WorldOptions& world_options, std::pmr::memory_resource* memory)
        : options(world_options),
          executor(options.executor != nullptr ? options.executor : &default_executor()),
          margin(static_cast<T>(options.margin)),
          ids(memory),
          objects(memory),
          classes(memory),
          active(memory),
          parked(memory),
          shifted(memory),
          resting({options.executor, memory, options.instruction_set}),
          refused(memory)
    {
    }

    const WorldOptions options;
    Executor* const executor;
    const T margin;

    IdTable ids;
    Objects<Dim, T> objects;
    FilterClasses classes;
    struct Active
    {
        Index index;
        std::uint32_t idle; // updates since it changed, or `due`
    };
    std::pmr::vector<Active> active; // ascending; without parked ones
    Parked<Dim, T> parked;           // active ones that are about to rest
    // Resting objects that have moved in one of the last updates without waking up. `idle`: as above.
    std::pmr::vector<Active> shifted;
    BoxIndex<Dim, T> resting; // the other existing objects; ids are indices
    KeySet refused;           // touching pairs that `accept` refused
    std::size_t alive = 0, disabled = 0;
    /// The objects that apply() has written to, which queries see. Null: they see the state of the last
    /// update.
    const Changes<Dim, T>* shown = nullptr;

    [[nodiscard]] ObjectId id_of(Index index) const noexcept
    {
        return {raw(index), ids.generation(raw(index))};
    }
    /// One more than the greatest index of an object ever written; objects beyond are still queued.
    [[nodiscard]] std::uint32_t index_end() const noexcept
    {
        return static_cast<std::uint32_t>(std::min<std::size_t>(ids.end(), objects.capacity()));
    }
    /// Whether an object was in the world after the last update, and whether it is now, including what
    /// apply() shows.
    [[nodiscard]] bool was_there(std::uint32_t index) const noexcept
    {
        return index < objects.capacity() && objects[Index{index}].place() != Place::none;
    }
    [[nodiscard]] bool is_alive(std::uint32_t index) const noexcept
    {
        return index < objects.capacity() && objects[Index{index}].has(flag::alive);
    }
    /// The ids after the last update, for snapshots.
    [[nodiscard]] IdTable::Picture picture_ids() const
    {
        return ids.picture([this](std::uint32_t index) { return was_there(index); });
    }
    /// Active objects, parked ones included.
    [[nodiscard]] std::size_t active_count() const noexcept { return active.size() + parked.size(); }
    template <class Body>
    void each_active(const Body& body) const
    {
        for (const auto& each : active)
            body(each.index);
        parked.each([&](Index index) {
            body(index);
            return true;
        });
    }
    /// Whether queries see an object, and where: `accept` may query in the middle of an update.
    [[nodiscard]] bool is_shown(Index index) const noexcept
    {
        const auto object = objects[index];
        if (shown != nullptr && object.has(flag::written)) return object.is_there();
        return object.place() >= Place::active;
    }
    [[nodiscard]] const Aabb<Dim, T>& shown_box(Index index) const noexcept
    {
        const auto object = objects[index];
        return object.has(flag::written) && shown == nullptr ? object.before() : object.now();
    }
    /// Whether the index of resting objects has an object as queries see it.
    [[nodiscard]] bool is_shown_resting(Index index) const noexcept
    {
        const auto object = objects[index];
        return object.place() == Place::resting && (shown == nullptr || !object.has(flag::written));
    }
    /// With fewer objects or pairs, waking another thread takes longer than it helps.
    [[nodiscard]] Executor* executor_for(std::size_t items) const noexcept
    {
        return items < 2048 ? &serial_executor() : executor;
    }
    void make_room(std::size_t count)
    {
        objects.grow(count);
        classes.make_room(objects.capacity());
        parked.make_room(objects.capacity());
    }
};

} // namespace world
JOSTLE_NAMESPACE_END
