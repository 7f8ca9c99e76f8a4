// SPDX-License-Identifier: MIT
// An update, stage by stage. Each works out something and says it; the world stays what it was but for what
// Changes and Refusals take back when they go. Then all is taken over by steps that can't fail.
#include "index/box_index_access.hpp"
#include "world/candidates.hpp"
#include "world/events.hpp"
#include "world/implementation.hpp"
#include "world/instantiate.hpp"
#include "world/rest.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

/// An object that didn't only move.
template <int Dim, class T>
void commit_object(State<Dim, T>& state, NeighbourLists<Dim, T>& neighbour_lists, Index index) noexcept
{
    const auto object = state.objects[index];
    const Place place = object.place();
    state.disabled -= place == Place::disabled;
    state.alive -= place != Place::none;
    if (place == Place::resting) neighbour_lists.note_waking(index);
    if (!object.is_there()) neighbour_lists.drop(index);
    if (!object.has(flag::alive)) {
        state.ids.release(state.id_of(index));
        object.set_state(0);
        return;
    }
    if (place == Place::none || place == Place::resting || object.has(flag::refiltered))
        state.classes[index] = state.classes.of(object.filter());
    object.set_place(object.is_there() ? Place::active : Place::disabled);
    ++state.alive;
    state.disabled += !object.is_there();
    object.set(flag::transient, false);
}

template <int Dim, class T>
void commit_objects(State<Dim, T>& state, NeighbourLists<Dim, T>& neighbour_lists,
                    std::span<const Index> changed) noexcept
{
    constexpr std::uint32_t usual = flag::alive | flag::enabled | static_cast<std::uint32_t>(Place::active);
    for (const Index index : changed) {
        const auto object = state.objects[index];
        if ((object.state() & (usual | flag::place | flag::refiltered)) == usual)
            object.set(flag::transient, false); // most only move
        else
            commit_object(state, neighbour_lists, index);
    }
}

template <int Dim, class T>
void commit_rest(State<Dim, T>& state, NeighbourLists<Dim, T>& neighbour_lists,
                 const Entries<Dim, T>& entries, const Rest<Dim, T>& rest) noexcept
{
    BoxIndexAccess::erase(state.resting, entries.waking);
    for (const std::uint32_t index : rest.settling) {
        state.objects[Index{index}].set_place(Place::resting);
        neighbour_lists.note_settling(Index{index});
    }
    neighbour_lists.count_update();
    if (rest.same_active) {
        for (auto& each : state.active)
            each.idle = 0;
    } else {
        state.active.swap(rest.active);
    }
    state.recent_work = rest.recent_work;
}

template <int Dim, class T>
WorldStats describe(const State<Dim, T>& state, const Lists& lists)
{
    WorldStats stats;
    stats.objects = state.alive;
    stats.resting = state.resting.size();
    stats.active = state.active.size();
    stats.disabled = state.disabled;
    stats.refused = state.refused.size();
    stats.began = lists.began.size();
    stats.persisted = lists.persisted.size();
    stats.ended = lists.ended.size();
    return stats;
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::update(const world::Moves<Dim, T>& moves)
{
    const auto t0 = world::Clock::now();
    arena.begin();
    queues.take();
    world::Changes<Dim, T> changes = world::apply(state, queues, moves, arena);
    neighbour_lists.make_room(state.objects.capacity());

    const auto t1 = world::Clock::now();
    world::Lists &next = lists[1 - shown], &last = lists[shown];
    const world::Entries<Dim, T> entries = world::enter(state, changes.objects(), arena);
    const world::Candidates candidates =
        world::find(state, entries, finder, neighbour_lists, next.persisted, arena);
    const std::span<const Pair> old_pairs = world::find_old_pairs(state, changes, entries, arena);
    world::Refusals refusals =
        world::judge(state, changes, entries, candidates.touching, old_pairs, last, next, arena);

    const auto t2 = world::Clock::now();
    const world::Rest<Dim, T> rest =
        world::plan_rest(state, changes, entries, neighbour_lists, finder, arena);

    // Nothing fails from here on.
    const std::uint64_t changed = changes.objects().size(), commands = changes.commands,
                        dropped = changes.dropped;
    world::commit_objects(state, neighbour_lists, changes.objects());
    changes.keep();
    refusals.keep();
    world::commit_rest(state, neighbour_lists, entries, rest);
    queues.forget();
    next.all_active = rest.settling.empty();
    shown = 1 - shown;
    if (changed != 0 || !rest.settling.empty()) {
        active_index.forget();
        masked_indexes.note(entries.waking, rest.settling);
    }
    changed_pairs.forget();

    const auto t3 = world::Clock::now();
    stats = world::describe(state, next);
    stats.commands = commands;
    stats.dropped = dropped;
    stats.changed = changed;
    stats.woken = entries.waking.size();
    stats.settled = rest.settling.size();
    stats.candidates = candidates.looked_at;
    stats.false_positives = candidates.rejected;
    stats.listed = candidates.listed;
    stats.us_apply = world::microseconds(t0, t1);
    stats.us_active = candidates.us_active;
    stats.us_resting = candidates.us_resting;
    stats.us_events = world::microseconds(t1, t2) - stats.us_active - stats.us_resting;
    stats.us_index = world::microseconds(t2, t3);
    stats.us_total = world::microseconds(t0, t3);
    stats.bytes_reserved = bytes();
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::recall_pairs()
{
    arena.begin();
    neighbour_lists.make_room(state.objects.capacity());
    auto& changed = arena.list<world::Index>("active objects, as if they had changed");
    for (const auto& each : state.active)
        changed.push_back(each.index);
    const world::Entries<Dim, T> entries = world::enter(state, std::span<const world::Index>(changed), arena);
    world::Lists& last = lists[shown];
    const std::span<const Pair> pairs =
        world::find(state, entries, finder, neighbour_lists, last.persisted, arena).touching;
    last.others.assign(pairs.begin(), pairs.end());
    last.persisted.clear();
    neighbour_lists.count_update(); // lists made here are older than whatever the next update wakes up
    stats = world::describe(state, last);
    stats.bytes_reserved = bytes();
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void World<Dim, T>::Implementation::update(const world::Moves<Dim, T>&);                        \
    template void World<Dim, T>::Implementation::recall_pairs();
JOSTLE_FOR_EACH_WORLD(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
