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

/// The whole state of an object after an update, as snapshots have it.
template <int Dim, class T>
struct Record
{
    std::uint32_t generation = 0; // 0: there is no object, and all else is 0
    std::uint32_t state = 0;      // place, alive, enabled, is_static, has_reach
    typename ObjectChunk<Dim, T>::FilterNumbers numbers{};
    Aabb<Dim, T> box{};    // the bounds
    Reach<Dim, T> reach{}; // if it has one
    std::uint64_t data = 0;

    [[nodiscard]] bool has(std::uint32_t bits) const noexcept { return (state & bits) != 0; }
    [[nodiscard]] Place place() const noexcept { return static_cast<Place>(state & flag::place); }

    /// To the bit: boxes may have 0 of either sign.
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

/// The state of objects after the last update, even if apply() or an update under way has changed them since.
/// To be called for objects in ascending order.
template <int Dim, class T>
class Past
{
  public:
    Past(const State<Dim, T>& state, const std::optional<Applied<Dim, T>>& applied) : state_(state)
    {
        if (!applied) return;
        const auto by_index = [](const auto& x, const auto& y) { return x.index < y.index; };
        filters_.assign(applied->changes.old_filters().begin(), applied->changes.old_filters().end());
        reaches_.assign(applied->changes.old_reaches().begin(), applied->changes.old_reaches().end());
        std::sort(filters_.begin(), filters_.end(), by_index);
        std::sort(reaches_.begin(), reaches_.end(), by_index);
    }
    [[nodiscard]] const Aabb<Dim, T>& box(Index index) const noexcept { return state_.objects[index].last(); }
    [[nodiscard]] ObjectFilter filter(Index index) noexcept
    {
        if (!state_.objects[index].has(flag::refiltered)) return state_.objects[index].filter();
        return find(filters_, next_filter_, index).filter;
    }
    /// Null if it has none.
    [[nodiscard]] const Reach<Dim, T>* reach(Index index) noexcept
    {
        if (state_.objects[index].has(flag::reach_kept)) {
            const auto& old = find(reaches_, next_reach_, index);
            return old.had_reach ? &old.reach : nullptr;
        }
        return state_.objects[index].has(flag::has_reach) ? &state_.objects.reach(index) : nullptr;
    }
    /// For an object that existed; without its user data, which no update changes.
    [[nodiscard]] Record<Dim, T> record(Index index) noexcept
    {
        const auto object = state_.objects[index];
        const ObjectFilter filter = this->filter(index);
        const Reach<Dim, T>* const reach = this->reach(index);
        Record<Dim, T> record;
        record.generation = state_.ids.generation(raw(index));
        record.numbers = {filter.category, filter.mask, filter.owner};
        record.box = box(index);
        record.state = static_cast<std::uint32_t>(object.place()) | flag::alive |
                       (object.was_enabled() ? flag::enabled : 0u) |
                       (filter.is_static ? flag::is_static : 0u) | (reach != nullptr ? flag::has_reach : 0u);
        if (reach != nullptr) record.reach = *reach;
        return record;
    }

  private:
    template <class Kept>
    static const Kept& find(const std::vector<Kept>& kept, std::size_t& next, Index index) noexcept
    {
        while (kept[next].index < index)
            ++next;
        return kept[next];
    }
    const State<Dim, T>& state_;
    std::vector<typename Changes<Dim, T>::OldFilter> filters_; // ascending
    std::vector<typename Changes<Dim, T>::OldReach> reaches_;
    std::size_t next_filter_ = 0, next_reach_ = 0;
};

/// Makes an object what the record says; there is room for it.
template <int Dim, class T>
void put_record(State<Dim, T>& state, Index index, const Record<Dim, T>& record) noexcept
{
    const auto object = state.objects[index];
    object.set_state(record.state);
    if (record.generation == 0) return;
    object.numbers() = record.numbers;
    object.now() = object.before() = record.box; // from both, neighbour lists guess where it is going
    state.classes[index] = state.classes.of(object.filter());
    if (record.has(flag::has_reach)) state.objects.reach(index) = record.reach;
}

/// How many objects there are of each kind.
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
