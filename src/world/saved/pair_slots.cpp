// SPDX-License-Identifier: MIT
// After the header of its bytes come the number of slots, and the two ids of each, 0 for a free slot.
#include "jostle/pair_slots.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "base/checks.hpp"
#include "world/objects/key_set.hpp"
#include "world/saved/snapshot_bytes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

constexpr std::size_t least_slot_places = 64;

template <class AnyPair>
Key key_by_index(const AnyPair& pair) noexcept
{
    return key_of({pair.a.index, pair.b.index});
}

template <class AnyPair>
[[noreturn]] void refuse_pair(const AnyPair& pair, std::size_t k, const char* what)
{
    const auto text = [](ObjectId id) {
        return std::to_string(id.index) + " (generation " + std::to_string(id.generation) + ")";
    };
    throw Error(ErrorCode::invalid_argument,
                "pair of objects " + text(pair.a) + " and " + text(pair.b) + ' ' + what, k);
}

template <class AnyPair>
void check_order(std::span<const AnyPair> pairs)
{
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        if (pairs[k].a.index >= pairs[k].b.index || pairs[k].a.generation == 0 || pairs[k].b.generation == 0)
            refuse_pair(pairs[k], k, "isn't one of two objects, the lesser index first");
        if (k != 0 && key_by_index(pairs[k - 1]) >= key_by_index(pairs[k]))
            refuse_pair(pairs[k], k, "is in its list twice, or doesn't ascend by index");
    }
}

} // namespace
} // namespace world

struct PairSlots::Implementation
{
    static constexpr ObjectPair nobody{};

    explicit Implementation(std::pmr::memory_resource* memory)
        : pairs(memory),
          free(memory),
          table(memory),
          began(memory),
          ended(memory),
          next_began(memory),
          next_ended(memory)
    {
    }

    [[nodiscard]] std::uint32_t end() const noexcept { return static_cast<std::uint32_t>(pairs.size()); }
    [[nodiscard]] std::uint32_t of(world::Key key) const noexcept
    {
        return table.empty() ? no_slot : table[place_of(key)];
    }
    /// Where the key is, or would be.
    [[nodiscard]] std::size_t place_of(world::Key key) const noexcept
    {
        std::size_t place = world::home_of(key, table.size());
        while (table[place] != no_slot && world::key_by_index(pairs[table[place]]) != key)
            place = (place + 1) & (table.size() - 1);
        return place;
    }
    void look_up(std::span<const ObjectPair> begin, std::span<const EndedPair> finish);
    void make_room(std::size_t more);
    [[nodiscard]] std::uint32_t add(const ObjectPair& pair) noexcept;
    void remove(std::uint32_t slot) noexcept;

    std::pmr::vector<ObjectPair> pairs;   // by slot; `nobody` for free ones
    std::pmr::vector<std::uint32_t> free; // a heap, the least in front; there is room for all
    // Open addressing: slots at the places of their keys or after them; no_slot for empty places. The size is
    // a power of two, at most half of it in use.
    std::pmr::vector<std::uint32_t> table;
    std::pmr::vector<std::uint32_t> began, ended, next_began, next_ended;
};

/// Puts the slots of these pairs into the next lists. Throws unless all pairs are valid.
void PairSlots::Implementation::look_up(std::span<const ObjectPair> begin, std::span<const EndedPair> finish)
{
    world::check_order(begin);
    world::check_order(finish);
    next_began.resize(begin.size());
    next_ended.resize(finish.size());
    for (std::size_t k = 0; k < begin.size(); ++k) {
        const std::uint32_t slot = next_began[k] = of(world::key_by_index(begin[k]));
        if (slot != no_slot && pairs[slot] != begin[k])
            world::refuse_pair(begin[k], k,
                               "began, and another one with these indices hasn't ended; tell of all updates");
    }
    std::size_t next = 0;
    for (std::size_t k = 0; k < finish.size(); ++k) {
        const world::Key key = world::key_by_index(finish[k]);
        const std::uint32_t slot = next_ended[k] = of(key);
        if (slot == no_slot || pairs[slot] != ObjectPair{finish[k].a, finish[k].b})
            world::refuse_pair(finish[k], k,
                               "ended, and never began; tell of all updates, from the first on");
        while (next < begin.size() && world::key_by_index(begin[next]) < key)
            ++next;
        if (next < begin.size() && world::key_by_index(begin[next]) == key)
            world::refuse_pair(finish[k], k, "began and ended in one update");
    }
}

void PairSlots::Implementation::make_room(std::size_t more)
{
    const std::size_t wanted = pairs.size() + (more > free.size() ? more - free.size() : 0);
    if (wanted > pairs.capacity()) pairs.reserve(std::max(wanted, pairs.capacity() + pairs.capacity() / 2));
    if (free.capacity() < pairs.capacity()) free.reserve(pairs.capacity());
    std::size_t places = std::max(world::least_slot_places, table.size());
    while (places < 2 * (pairs.size() - free.size() + more))
        places *= 2;
    if (places == table.size()) return;
    std::pmr::vector<std::uint32_t>(places, no_slot, table.get_allocator()).swap(table);
    for (std::uint32_t slot = 0; slot < pairs.size(); ++slot)
        if (pairs[slot] != nobody) table[place_of(world::key_by_index(pairs[slot]))] = slot;
}

std::uint32_t PairSlots::Implementation::add(const ObjectPair& pair) noexcept
{
    std::uint32_t slot = end();
    if (free.empty()) {
        pairs.push_back(pair);
    } else {
        std::pop_heap(free.begin(), free.end(), std::greater<>());
        slot = free.back();
        free.pop_back();
        pairs[slot] = pair;
    }
    table[place_of(world::key_by_index(pair))] = slot;
    return slot;
}

/// The following keys in the table move up, so that no search stops before it reaches them.
void PairSlots::Implementation::remove(std::uint32_t slot) noexcept
{
    const std::size_t mask = table.size() - 1;
    std::size_t hole = place_of(world::key_by_index(pairs[slot]));
    for (std::size_t next = (hole + 1) & mask; table[next] != no_slot; next = (next + 1) & mask) {
        const std::size_t home = world::home_of(world::key_by_index(pairs[table[next]]), table.size());
        if (((next - home) & mask) < ((next - hole) & mask)) continue; // already in its own place
        table[hole] = table[next];
        hole = next;
    }
    table[hole] = no_slot;
    pairs[slot] = nobody;
    free.push_back(slot);
    std::push_heap(free.begin(), free.end(), std::greater<>());
}

PairSlots::PairSlots(std::pmr::memory_resource* memory)
{
    check_memory(memory);
    implementation_ = std::make_unique<Implementation>(memory);
}
PairSlots::PairSlots(PairSlots&&) noexcept = default;
PairSlots& PairSlots::operator=(PairSlots&&) noexcept = default;
PairSlots::~PairSlots() = default;

void PairSlots::update(std::span<const ObjectPair> began, std::span<const EndedPair> ended)
{
    Implementation& me = *implementation_;
    me.look_up(began, ended);
    me.make_room(began.size());
    // Nothing can fail from here on. First the pairs that begin, so that none gets a slot that another has
    // just left.
    for (std::size_t k = 0; k < began.size(); ++k)
        if (me.next_began[k] == no_slot) me.next_began[k] = me.add(began[k]);
    for (const std::uint32_t slot : me.next_ended)
        me.remove(slot);
    me.began.swap(me.next_began);
    me.ended.swap(me.next_ended);
}

std::span<const std::uint32_t> PairSlots::began_slots() const noexcept
{
    return implementation_->began;
}
std::span<const std::uint32_t> PairSlots::ended_slots() const noexcept
{
    return implementation_->ended;
}

std::uint32_t PairSlots::slot_of(std::uint32_t a, std::uint32_t b) const noexcept
{
    return implementation_->of(world::key_of({std::min(a, b), std::max(a, b)}));
}

std::uint32_t PairSlots::end() const noexcept
{
    return implementation_->end();
}

std::vector<std::byte> PairSlots::save() const
{
    world::SnapshotWriter out;
    out.begin(world::slots_of_pairs, {}, 0);
    out.put(std::uint64_t{end()});
    for (const ObjectPair& pair : implementation_->pairs) {
        const bool is_there = pair != Implementation::nobody;
        for (const ObjectId id : {pair.a, pair.b}) {
            out.put(is_there ? id.index : 0);
            out.put(id.generation);
        }
    }
    out.end();
    return std::move(out.bytes);
}

void PairSlots::restore(std::span<const std::byte> bytes)
{
    world::SnapshotReader in(world::slots_of_pairs, bytes);
    (void)in.read_header({});
    auto fresh = std::make_unique<Implementation>(implementation_->pairs.get_allocator().resource());
    const std::uint64_t count = in.get_count(16);
    in.demand(count < no_slot, "there are too many slots");
    fresh->make_room(static_cast<std::size_t>(count));
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        ObjectPair pair;
        for (ObjectId* const id : {&pair.a, &pair.b}) {
            id->index = in.get<std::uint32_t>();
            id->generation = in.get<std::uint32_t>();
        }
        if (pair == ObjectPair{{0, 0}, {0, 0}}) {
            fresh->pairs.push_back(Implementation::nobody);
            fresh->free.push_back(slot); // ascending, which is a heap
            continue;
        }
        in.demand(pair.a.index < pair.b.index && pair.a.generation != 0 && pair.b.generation != 0,
                  "a slot is of no pair of objects");
        in.demand(fresh->of(world::key_by_index(pair)) == no_slot, "a pair has two slots");
        fresh->pairs.push_back(pair);
        fresh->table[fresh->place_of(world::key_by_index(pair))] = slot;
    }
    in.demand_end();
    implementation_ = std::move(fresh);
}

JOSTLE_NAMESPACE_END
