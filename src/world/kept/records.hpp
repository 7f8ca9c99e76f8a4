// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include "world/objects/state.hpp"
#include "world/update/changes.hpp"
#include "world/update/writer.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// The whole state of an object after an update, as in snapshots.
template <int Dim, class T>
struct Record
{
    std::uint32_t generation = 0; // 0: there is no object, and all other members are 0
    std::uint32_t state = 0;      // place, alive, enabled, is_static, has_reach
    typename ObjectChunk<Dim, T>::FilterNumbers numbers{};
    Aabb<Dim, T> box{};    // the bounds
    Reach<Dim, T> reach{}; // if it has one
    std::uint64_t data = 0;

    [[nodiscard]] bool has(std::uint32_t bits) const noexcept { return (state & bits) != 0; }
    [[nodiscard]] Place place() const noexcept { return static_cast<Place>(state & flag::place); }

    /// Compares bits: boxes may have 0 of either sign.
    friend bool same_record(const Record& a, const Record& b) noexcept
    {
        static_assert(sizeof(Aabb<Dim, T>) == 2 * Dim * sizeof(T));
        static_assert(sizeof(Reach<Dim, T>) == (3 * Dim + 1) * sizeof(T));
        return a.generation == b.generation && a.state == b.state && a.data == b.data &&
               std::memcmp(&a.numbers, &b.numbers, sizeof a.numbers) == 0 &&
               std::memcmp(&a.box, &b.box, sizeof a.box) == 0 &&
               std::memcmp(&a.reach, &b.reach, sizeof a.reach) == 0;
    }
};

/// The record of an object as of the last update, even if apply() or the current update has changed it since;
/// without its user data, which no update changes.
template <int Dim, class T>
[[nodiscard]] Record<Dim, T> record_of(const State<Dim, T>& state,
                                       const std::optional<Applied<Dim, T>>& applied, Index index) noexcept
{
    const auto object = state.objects[index];
    ObjectFilter filter = object.filter();
    const Reach<Dim, T>* reach = object.has(flag::has_reach) ? &state.objects.reach(index) : nullptr;
    if (object.has(flag::refiltered)) filter = applied->changes.old_filter(index);
    if (object.has(flag::reach_kept)) reach = applied->changes.old_reach(index);
    Record<Dim, T> record;
    record.generation = state.ids.generation(raw(index));
    record.numbers = {filter.category, filter.mask, filter.owner};
    record.box = object.last();
    record.state = static_cast<std::uint32_t>(recorded(object.place())) | flag::alive |
                   (object.was_enabled() ? flag::enabled : 0u) | (filter.is_static ? flag::is_static : 0u) |
                   (reach != nullptr ? flag::has_reach : 0u);
    if (reach != nullptr) record.reach = *reach;
    return record;
}

/// Gives an object the state in the record. There is room for it.
template <int Dim, class T>
void put_record(State<Dim, T>& state, Index index, const Record<Dim, T>& record) noexcept
{
    const auto object = state.objects[index];
    object.set_state(record.state);
    if (record.generation == 0) return;
    object.numbers() = record.numbers;
    object.now() = object.before() = record.box; // neighbour lists predict its path from both
    state.classes[index] = state.classes.of(object.filter());
    if (record.has(flag::has_reach)) state.objects.reach(index) = record.reach;
}

/// The number of objects of each kind.
struct Census
{
    std::size_t alive = 0, disabled = 0, resting = 0;

    template <int Dim, class T>
    void add(const Record<Dim, T>& record) noexcept
    {
        alive += record.generation != 0;
        disabled += record.place() == Place::disabled;
        resting += record.place() == Place::resting;
    }
    template <int Dim, class T>
    void remove(const Record<Dim, T>& record) noexcept
    {
        alive -= record.generation != 0;
        disabled -= record.place() == Place::disabled;
        resting -= record.place() == Place::resting;
    }
    [[nodiscard]] std::size_t active() const noexcept { return alive - disabled - resting; }
};

} // namespace world
JOSTLE_NAMESPACE_END
