// SPDX-License-Identifier: MIT
#include "world/kept/pair_slots.hpp"

#include <algorithm>
#include <functional>

#include "world/objects/key_set.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

constexpr std::size_t least_places = 64;

} // namespace

/// Where the key is, or would be.
std::size_t PairSlots::place_of(Key key) const noexcept
{
    std::size_t place = home_of(key, table_.size());
    while (table_[place] != none && keys_[table_[place]] != key)
        place = (place + 1) & (table_.size() - 1);
    return place;
}

std::uint32_t PairSlots::of(Key key) const noexcept
{
    return table_.empty() ? none : table_[place_of(key)];
}

void PairSlots::put(Key key, std::uint32_t slot) noexcept
{
    std::size_t place = home_of(key, table_.size());
    while (table_[place] != none)
        place = (place + 1) & (table_.size() - 1);
    table_[place] = slot;
    ++used_;
}

std::uint32_t PairSlots::add(Key key) noexcept
{
    std::uint32_t slot = end();
    if (free_.empty()) {
        keys_.push_back(no_key);
    } else {
        std::pop_heap(free_.begin(), free_.end(), std::greater<>());
        slot = free_.back();
        free_.pop_back();
    }
    note(slot);
    keys_[slot] = key;
    put(key, slot);
    return slot;
}

/// Those behind it move up, so that no search stops short of them.
void PairSlots::remove(Key key, std::uint32_t slot) noexcept
{
    const std::size_t mask = table_.size() - 1;
    std::size_t hole = place_of(key);
    for (std::size_t next = (hole + 1) & mask; table_[next] != none; next = (next + 1) & mask) {
        const std::size_t home = home_of(keys_[table_[next]], table_.size());
        if (((next - home) & mask) < ((next - hole) & mask)) continue; // it is in its own place by now
        table_[hole] = table_[next];
        hole = next;
    }
    table_[hole] = none;
    --used_;
    note(slot);
    keys_[slot] = no_key;
    free_.push_back(slot);
    std::push_heap(free_.begin(), free_.end(), std::greater<>());
}

void PairSlots::make_room(std::size_t began, std::size_t end)
{
    if (end > keys_.capacity()) keys_.reserve(end);
    const std::size_t fresh = keys_.size() + (began > free_.size() ? began - free_.size() : 0);
    if (fresh > keys_.capacity()) keys_.reserve(std::max(fresh, keys_.capacity() + keys_.capacity() / 2));
    if (free_.capacity() < keys_.capacity()) free_.reserve(keys_.capacity());
    if (takes_notes_) make_room_for_notes(keys_.capacity());
    std::size_t places = std::max(least_places, table_.size());
    while (places < 2 * (used_ + began))
        places *= 2;
    if (places == table_.size()) return;
    std::pmr::vector<std::uint32_t> larger(places, none, table_.get_allocator());
    table_.swap(larger);
    used_ = 0;
    for (std::uint32_t slot = 0; slot < keys_.size(); ++slot)
        if (keys_[slot] != no_key) put(keys_[slot], slot);
}

void PairSlots::change(Lists& lists) noexcept
{
    for (std::size_t k = 0; k < lists.began.size(); ++k) {
        const Key key = key_of({lists.began[k].a.index, lists.began[k].b.index});
        const std::uint32_t slot = of(key);
        lists.began_slots[k] = slot != none ? slot : add(key);
    }
    for (std::size_t k = 0; k < lists.ended.size(); ++k) {
        const Key key = key_of({lists.ended[k].a.index, lists.ended[k].b.index});
        lists.ended_slots[k] = of(key);
        if (lists.ended_slots[k] != none) remove(key, lists.ended_slots[k]);
    }
}

bool PairSlots::restore(std::span<const Key> keys)
{
    make_room(keys.size());
    keys_.assign(keys.begin(), keys.end());
    for (std::uint32_t slot = 0; slot < keys.size(); ++slot) {
        if (keys[slot] == no_key) {
            free_.push_back(slot); // ascending, which is a heap
        } else {
            if (of(keys[slot]) != none) return false;
            put(keys[slot], slot);
        }
    }
    return true;
}

void PairSlots::make_room_for_notes(std::size_t slots)
{
    slots = std::max(slots, keys_.capacity());
    if (noted_.capacity() < slots) noted_.reserve(slots);
    if (is_noted_.size() < slots) is_noted_.resize(slots, 0);
}

void PairSlots::begin_notes() noexcept
{
    for (const Note& note : noted_)
        is_noted_[note.slot] = 0;
    noted_.clear();
    takes_notes_ = true;
    end_then_ = end();
}

void PairSlots::go_back(std::span<const Note> keys, std::uint32_t end) noexcept
{
    while (keys_.size() < end) {
        free_.push_back(static_cast<std::uint32_t>(keys_.size()));
        keys_.push_back(no_key);
    }
    for (const Note& each : keys) {
        if (each.slot >= keys_.size()) continue;
        if (keys_[each.slot] != no_key)
            remove(keys_[each.slot], each.slot);
        else
            note(each.slot);
    }
    for (const Note& each : keys) {
        if (each.slot >= end || each.key == no_key) continue;
        keys_[each.slot] = each.key;
        put(each.key, each.slot);
    }
    keys_.resize(end);
    const auto is_taken = [&](std::uint32_t slot) { return slot >= end || keys_[slot] != no_key; };
    free_.erase(std::remove_if(free_.begin(), free_.end(), is_taken), free_.end());
    std::make_heap(free_.begin(), free_.end(), std::greater<>());
}

void PairSlots::assign(const PairBuffer& pairs)
{
    make_room(static_cast<std::size_t>(pairs.size()));
    for (const Pair& pair : pairs)
        (void)add(key_of(pair));
}

} // namespace world
JOSTLE_NAMESPACE_END
