// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <string>
#include <unordered_set>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/world.hpp"
#include "world/filter_classes.hpp"
#include "world/ids.hpp"
#include "world/numbers.hpp"
#include "world/objects.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// Pairs are looked at, and boxes set, in runs of this many.
constexpr std::size_t run_length = 4096;

/// What a world is. The stages of an update read it and say what is to change; `commit_objects` and
/// `commit_rest` in update.cpp change it.
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
        std::uint32_t idle; // updates since it changed
    };
    std::pmr::vector<Active> active;                // ascending
    BoxIndex<Dim, T> resting;                       // the others that are there; ids are indices
    std::pmr::unordered_set<std::uint64_t> refused; // keys of pairs that touch and that `accept` is against
    std::uint64_t recent_work = 0;                  // bounds how many objects may settle in one update
    std::size_t alive = 0, disabled = 0;

    [[nodiscard]] ObjectId id_of(Index index) const noexcept
    {
        return {raw(index), ids.generation(raw(index))};
    }
    /// With fewer than two runs a thread, waking one takes longer than it helps.
    [[nodiscard]] Executor* executor_for(std::size_t items) const noexcept
    {
        return items < 4 * run_length ? &serial_executor() : executor;
    }
    void make_room(std::size_t count)
    {
        objects.grow(count);
        classes.make_room(objects.capacity());
    }
};

} // namespace world
JOSTLE_NAMESPACE_END
