// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "world/kept/records.hpp"
#include "world/objects/ids.hpp"
#include "world/objects/key_set.hpp"
#include "world/objects/pair_lists.hpp"
#include "world/update/commands.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// The state in the base (a whole snapshot) of all objects and refused pairs that an update has changed since
/// then. So the differences from the base are known without searching the whole world. The journal has at
/// least everything that differs; more does no harm. User data have their own records.
template <int Dim, class T>
class Journal
{
  public:
    struct Target
    {
        Index index;
        Record<Dim, T> record;
    };

    explicit Journal(std::pmr::memory_resource* memory)
        : free(memory),
          work(memory),
          objects_(memory),
          place_of_(memory),
          refused_then_(memory),
          allowed_then_(memory)
    {
    }

    // Of the base:
    std::uint64_t base = 0; // its checksum
    std::uint32_t end = 0;  // of the ids
    std::pmr::vector<IdTable::Free> free;

    /// Working memory for one call at a time.
    struct Work
    {
        explicit Work(std::pmr::memory_resource* memory)
            : fresh(memory),
              indices(memory),
              free(memory),
              active(memory),
              parked(memory),
              shifted(memory),
              keys(memory),
              read(memory),
              targets(memory),
              is_free(memory),
              refused(memory),
              come(memory),
              gone(memory),
              changed(memory),
              come_boxes(memory)
        {
        }
        std::pmr::vector<std::uint32_t> fresh, indices;
        std::pmr::vector<IdTable::Free> free;
        std::pmr::vector<typename State<Dim, T>::Active> active, parked, shifted;
        std::pmr::vector<Key> keys;
        std::pmr::vector<Target> read, targets;
        std::pmr::vector<bool> is_free;
        std::pmr::vector<std::pair<Key, bool>> refused;
        std::pmr::vector<std::uint32_t> come, gone;
        std::pmr::vector<Index> changed;
        std::pmr::vector<Aabb<Dim, T>> come_boxes;
    } work;

    /// Starts a new base, from which nothing differs.
    void begin(std::uint64_t checksum, std::uint32_t ids_end, std::span<const IdTable::Free> ids_free)
    {
        free.reserve(ids_free.size());
        base = checksum;
        end = ids_end;
        free.assign(ids_free.begin(), ids_free.end());
        for (const Target& each : objects_)
            place_of_[each.index] = 0;
        objects_.clear();
        refused_then_.clear();
        allowed_then_.clear();
    }

    /// Records what an update is about to change: objects, ascending, and those that come to rest.
    void note(const State<Dim, T>& state, std::optional<Applied<Dim, T>>& applied,
              std::span<const Index> changed, std::span<const std::uint32_t> settling)
    {
        place_of_.grow(state.objects.capacity());
        auto& fresh = work.fresh;
        fresh.clear();
        for (const Index index : changed)
            if (place_of_[index] == 0) fresh.push_back(raw(index));
        for (const std::uint32_t index : settling)
            if (place_of_[Index{index}] == 0) fresh.push_back(index);
        std::sort(fresh.begin(), fresh.end());
        fresh.erase(std::unique(fresh.begin(), fresh.end()), fresh.end());
        const auto& old_reaches = applied->changes.old_reaches();
        const auto is_new = [&](const auto& old) { return place_of_[old.index] == 0; };
        if (fresh.empty() && std::none_of(old_reaches.begin(), old_reaches.end(), is_new)) return;
        applied->changes.sort_reaches();
        // First objects whose bounds stay the same but are made up differently: these aren't changed, but may
        // be among those that come to rest.
        for (const auto& old : old_reaches) {
            if (!is_new(old) || !state.was_there(raw(old.index))) continue;
            if (state.objects[old.index].has(flag::reach_kept)) continue; // changed, and recorded below
            Record<Dim, T> record = record_of(state, applied, old.index);
            record.reach = old.had_reach ? old.reach : Reach<Dim, T>();
            record.state &= ~flag::has_reach;
            if (old.had_reach) record.state |= flag::has_reach;
            note(old.index, record);
        }
        for (const std::uint32_t index : fresh)
            if (place_of_[Index{index}] == 0)
                note(Index{index},
                     state.was_there(index) ? record_of(state, applied, Index{index}) : Record<Dim, T>());
    }
    void note(Index index, const Record<Dim, T>& record)
    {
        place_of_.grow(std::size_t{raw(index)} + 1);
        objects_.push_back({index, record});
        place_of_[index] = static_cast<std::uint32_t>(objects_.size());
    }
    void note_refused(std::span<const Key> added, std::span<const Key> removed)
    {
        for (const Key key : added)
            if (!refused_then_.contains(key)) allowed_then_.insert(key);
        for (const Key key : removed)
            if (!allowed_then_.contains(key)) refused_then_.insert(key);
    }
    /// Records pairs whose refusal an update has changed; pairs that are again as in the base are forgotten.
    void forget_refused(std::span<const Key> keys, const KeySet& refused) noexcept
    {
        for (const Key key : keys)
            (refused.contains(key) ? refused_then_ : allowed_then_).erase(key);
    }

    [[nodiscard]] std::span<const Target> objects() const noexcept { return objects_; }
    /// Null for an object that is as in the base.
    [[nodiscard]] const Record<Dim, T>* find(Index index) const noexcept
    {
        const bool is_noted = raw(index) < place_of_.size() && place_of_[index] != 0;
        return is_noted ? &objects_[place_of_[index] - 1].record : nullptr;
    }
    /// Whether a refused pair wasn't refused in the base.
    [[nodiscard]] bool was_allowed(Key key) const noexcept { return allowed_then_.contains(key); }
    /// Calls body(key, whether it was refused in the base) for all pairs whose refusal may differ from the
    /// base, in an unspecified order.
    template <class Body>
    void each_refused(const Body& body) const
    {
        refused_then_.each([&](Key key) { body(key, true); });
        allowed_then_.each([&](Key key) { body(key, false); });
    }

  private:
    std::pmr::vector<Target> objects_;
    Table<Index, std::uint32_t> place_of_; // one more than its position among them; 0: not there
    // Recorded pairs, by their state in the base. Each is in at most one of the two.
    KeySet refused_then_, allowed_then_;
};

} // namespace world
JOSTLE_NAMESPACE_END
