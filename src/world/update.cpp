// SPDX-License-Identifier: MIT
// An update, stage by stage. Each stage computes a result and returns it. Until then the world changes only
// in ways that the destructors of Changes and Refusals undo. Finally all results are committed by steps that
// can't fail.
#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "world/implementation.hpp"
#include "world/update/candidates.hpp"
#include "world/update/events.hpp"
#include "world/update/rest.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

/// Commits an object that did more than move.
template <int Dim, class T>
void commit_object(State<Dim, T>& state, NeighbourLists<Dim, T>& neighbour_lists,
                   const Entries<Dim, T>& entries, Index index) noexcept
{
    const auto object = state.objects[index];
    const Place place = object.place();
    if (place == Place::resting) neighbour_lists.note_waking(index);
    if (shifts(state, entries, index)) { // its place stays
        object.set(flag::transient, false);
        return;
    }
    state.disabled -= place == Place::disabled;
    state.alive -= place != Place::none;
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
    state.disabled += !object.has(flag::enabled);
    object.set(flag::transient | flag::shifted, false);
}

template <int Dim, class T>
void commit_objects(State<Dim, T>& state, NeighbourLists<Dim, T>& neighbour_lists,
                    const Entries<Dim, T>& entries, std::span<const Index> changed) noexcept
{
    constexpr std::uint32_t usual = flag::alive | flag::enabled | static_cast<std::uint32_t>(Place::active);
    for (const Index index : changed) {
        const auto object = state.objects[index];
        if ((object.state() & (usual | flag::place | flag::refiltered)) == usual)
            object.set(flag::transient, false); // most only move
        else
            commit_object(state, neighbour_lists, entries, index);
    }
}

/// If the object was parked, it no longer is.
template <int Dim, class T>
void unpark(State<Dim, T>& state, Index index) noexcept
{
    if (state.objects[index].place() == Place::parked) state.parked.remove(index);
}

/// Some objects have moved at rest; those that did so before wait one update less, or have woken up.
template <int Dim, class T>
void commit_shifts(State<Dim, T>& state, NeighbourLists<Dim, T>& neighbour_lists,
                   std::span<const std::uint32_t> shifting) noexcept
{
    std::erase_if(state.shifted, [&](auto& each) {
        const auto object = state.objects[each.index];
        if (!object.has(flag::shifted)) return true;
        if (++each.idle < shifted_updates) return false;
        object.set(flag::shifted, false);
        return true;
    });
    for (const std::uint32_t index : shifting) {
        state.shifted.push_back({Index{index}, 0});
        state.objects[Index{index}].set(flag::shifted);
        neighbour_lists.note_settling(Index{index});
    }
}

template <int Dim, class T>
void commit_rest(State<Dim, T>& state, NeighbourLists<Dim, T>& neighbour_lists,
                 const Entries<Dim, T>& entries, const Rest<Dim, T>& rest) noexcept
{
    BoxIndexAccess::tree(state.resting).erase(entries.waking);
    for (const std::uint32_t index : rest.settling) {
        unpark(state, Index{index});
        state.objects[Index{index}].set_place(Place::resting);
        neighbour_lists.note_settling(Index{index});
    }
    for (const Index index : rest.parking) {
        state.parked.push(index, state.objects[index].now());
        state.objects[index].set_place(Place::parked);
    }
    state.parked.close_gaps();
    commit_shifts(state, neighbour_lists, rest.shifting);
    neighbour_lists.count_update();
    if (rest.same_active) {
        for (auto& each : state.active)
            each.idle = 0;
    } else {
        state.active.swap(rest.active);
    }
}

} // namespace

template <int Dim, class T>
WorldStats describe(const State<Dim, T>& state, const Lists& lists)
{
    WorldStats stats;
    stats.objects = state.alive;
    stats.resting = state.resting.size();
    stats.active = state.active_count();
    stats.disabled = state.disabled;
    stats.refused = state.refused.size();
    stats.began = lists.began.size();
    stats.persisted = lists.persisted.size();
    stats.ended = lists.ended.size();
    return stats;
}

} // namespace world

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::update(const world::Moves<Dim, T>& moves)
{
    const auto t0 = world::Clock::now();
    // If anything fails, this is undone; what is kept isn't.
    struct Undo
    {
        Implementation& me;
        ~Undo() { me.take_back(); }
    } const undo{*this};
    recall_if_due();
    begin_changes();
    queues.take();
    world::apply(state, queues, moves, *applied, arena);
    const world::Changes<Dim, T>& changes = applied->changes;
    neighbour_lists.make_room(state.objects.capacity());

    const auto t1 = world::Clock::now();
    world::Lists& next = lists[1 - last];
    const world::Entries<Dim, T> entries =
        world::enter(state, std::span<const world::Index>(changes.objects()), arena);
    const world::Candidates candidates =
        world::find(state, entries, finder, neighbour_lists, next.persisted, arena);
    const std::span<const Pair> old_pairs = world::find_old_pairs(state, changes, entries, finder, arena);
    world::Refusals refusals =
        world::judge(state, changes, entries, candidates.touching, old_pairs, last_lists(), next, arena);
    note_removals();

    const auto t2 = world::Clock::now();
    const world::Rest<Dim, T> rest =
        world::plan_rest(state, changes, entries, neighbour_lists, finder, arena);
    if (journal) {
        journal->note(state, applied, changes.objects(), rest.settling);
        journal->note_refused(refusals.added(), refusals.removed());
    }
    // The last step that can fail; if it does, the index is unchanged.
    BoxIndexAccess::tree(state.resting).put(rest.indices, rest.boxes);
    commit(entries, rest, refusals, next);

    const auto t3 = world::Clock::now();
    stats = world::describe(state, next);
    stats.commands = changes.commands;
    stats.dropped = changes.dropped;
    stats.contested = changes.contested;
    stats.changed = changes.objects().size();
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

/// Begins an update's changes, with those that apply() has made, or with none.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::begin_changes()
{
    if (!applied) {
        arena.begin();
        applied.emplace(state, arena);
        return;
    }
    arena.begin_again();
    note(applied->changes.objects(), {});
    state.shown = nullptr;
}

/// Announces to the user data which objects the update removes.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::note_removals()
{
    user_data.begin_removal();
    if (!applied->writer.any_removed()) return;
    for (const world::Index index : applied->changes.objects())
        if (const auto object = state.objects[index];
            !object.has(world::flag::alive) && object.place() != world::Place::none)
            user_data.note_removal(state.id_of(index));
}

/// Commits the update's changes.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::commit(const world::Entries<Dim, T>& entries,
                                           const world::Rest<Dim, T>& rest, world::Refusals& refusals,
                                           world::Lists& next) noexcept
{
    world::Changes<Dim, T>& changes = applied->changes;
    for (const world::Index index : entries.stirring)
        world::unpark(state, index);
    world::commit_objects(state, neighbour_lists, entries, std::span<const world::Index>(changes.objects()));
    changes.keep();
    refusals.commit();
    if (journal) {
        journal->forget_refused(refusals.added(), state.refused);
        journal->forget_refused(refusals.removed(), state.refused);
    }
    world::commit_rest(state, neighbour_lists, entries, rest);
    queues.forget();
    next.all_active = rest.settling.empty() && rest.shifting.empty() && rest.parking.empty();
    last = 1 - last;
    change_log.count_update();
    for (const auto& old : changes.old_reaches()) // their boxes may have changed, though their bounds haven't
        change_log.note(std::span(&old.index, 1), state.alive);
    if (!changes.objects().empty() || !rest.settling.empty()) {
        note(changes.objects(), rest.settling);
        note_resting(entries.rested, rest.settling);
    }
    began_pairs.forget();
    changed_pairs.forget();
    user_data.end_removal();
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::apply_ahead()
{
    recall_if_due();
    if (applied)
        arena.begin_again();
    else
        arena.begin();
    queues.take();
    if (!queues.any_to_apply()) return;
    try {
        if (!applied) {
            applied.emplace(state, arena);
            arena.keep();
        }
        auto& noted = arena.list<world::Noted>("objects that apply() writes to");
        world::apply_ahead(state, queues, *applied, noted, arena);
        auto& indices = arena.list<world::Index>("indices of these");
        for (const world::Noted& each : noted)
            indices.push_back(each.index);
        note(indices, {});
    } catch (...) {
        take_back();
        throw;
    }
    state.shown = &applied->changes;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::note(std::span<const world::Index> changed,
                                         std::span<const std::uint32_t> settling) noexcept
{
    const auto note_in = [&](world::FollowingIndex<Dim, T>& active) {
        active.note(changed);
        active.note(settling);
    };
    note_in(active_index);
    for (const auto& layer : layers)
        note_in(layer->active);
    change_log.note(changed, state.alive);
    change_log.note(settling, state.alive);
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::note_resting(std::span<const std::uint32_t> rested,
                                                 std::span<const std::uint32_t> settling) noexcept
{
    for (const auto& layer : layers) {
        layer->resting.note(rested);
        layer->resting.note(settling);
    }
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::take_back() noexcept
{
    if (state.shown != nullptr) note(state.shown->objects(), {});
    state.shown = nullptr;
    applied.reset();
    queues.forget_applied();
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
    world::Lists& recalled = last_lists();
    {
        // The search uses this memory, and leaves nothing there, also if something fails.
        struct Cleared
        {
            PairBuffer& pairs;
            ~Cleared() { pairs.clear(); }
        } const cleared{recalled.persisted};
        const std::span<const Pair> pairs =
            world::find<Dim, T>(state, entries, finder, neighbour_lists, cleared.pairs, arena).touching;
        recalled.others.assign(pairs.begin(), pairs.end());
    }
    neighbour_lists.count_update(); // lists made here are older than anything that the next update wakes up
    stats = world::describe(state, recalled);
    stats.bytes_reserved = bytes();
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::recall_if_due()
{
    if (!recall_is_due) return;
    recall_pairs();
    recall_is_due = false;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template WorldStats world::describe(const State<Dim, T>&, const Lists&);                                 \
    template void World<Dim, T>::Implementation::update(const world::Moves<Dim, T>&);                        \
    template void World<Dim, T>::Implementation::apply_ahead();                                              \
    template void World<Dim, T>::Implementation::note(std::span<const world::Index>,                         \
                                                      std::span<const std::uint32_t>) noexcept;              \
    template void World<Dim, T>::Implementation::note_resting(std::span<const std::uint32_t>,                \
                                                              std::span<const std::uint32_t>) noexcept;      \
    template void World<Dim, T>::Implementation::take_back() noexcept;                                       \
    template void World<Dim, T>::Implementation::recall_pairs();                                             \
    template void World<Dim, T>::Implementation::recall_if_due();
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
