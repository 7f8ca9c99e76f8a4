// SPDX-License-Identifier: MIT
#include "world/update/entries.hpp"

#include <algorithm>
#include <atomic>

#include "base/instantiate.hpp"
#include "jostle/process.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

template <int Dim, class T>
void resize(Entries<Dim, T>& entries, std::size_t count)
{
    entries.box.resize(count);
    entries.index.resize(count);
    entries.filter.resize(count);
    entries.moves_on.resize(count);
}

template <int Dim, class T>
void set(Entries<Dim, T>& entries, Entry entry, const State<Dim, T>& state, Index index)
{
    const auto object = state.objects[index];
    entries.box[entry] = object.now();
    entries.index[entry] = index;
    entries.filter[entry] = state.classes[index];
    entries.moves_on[entry] = object.place() == Place::active;
}

/// Whether few enough change for moving them within the index. Those that are parked count as well: whoever
/// has waited longest comes to rest first, and where objects move in turns, moves next.
template <int Dim, class T>
bool any_may_shift(const State<Dim, T>& state, std::span<const Index> changed) noexcept
{
    std::size_t count = 0;
    for (const Index index : changed)
        count += state.objects[index].place() == Place::resting ? 1 : 0;
    return count * resting_per_changed <= state.resting.size() + state.parked.size();
}

/// Whether a resting object that has changed stays in the index.
template <int Dim, class T>
bool shifts(const State<Dim, T>& state, Index index) noexcept
{
    const auto object = state.objects[index];
    return object.is_there() && !object.has(flag::shifted | flag::refiltered);
}

// Where so many are active, so few of them have changed, and most would come to rest, the others are parked.
constexpr std::size_t worth_parking = 1024, active_per_changed = 16;

/// Whether most of the active objects have waited for so long that they would come to rest. One update in
/// which few change, or none, says little: in many programs all move in every other one.
template <int Dim, class T>
bool most_are_due(const State<Dim, T>& state) noexcept
{
    const auto count = std::count_if(state.active.begin(), state.active.end(),
                                     [](const auto& each) { return each.idle + 1 >= idle_updates; });
    return static_cast<std::size_t>(count) * 2 > state.active.size();
}

/// As if each changed object only moved. Says whether it did.
template <int Dim, class T>
bool enter_all(Entries<Dim, T>& entries, const State<Dim, T>& state, std::span<const Index> changed)
{
    resize(entries, changed.size());
    if (changed.empty()) return true;
    std::atomic<bool> only_moves{true};
    const auto enter_some = [&](std::uint64_t begin, std::uint64_t end, Work) {
        constexpr std::uint32_t usual =
            flag::alive | flag::enabled | static_cast<std::uint32_t>(Place::active);
        bool all = true;
        for (std::uint64_t i = begin; i < end; ++i) {
            const Index index = changed[i];
            if (i + fetch_ahead < changed.size()) state.objects[changed[i + fetch_ahead]].prefetch_boxes();
            all &= (state.objects[index].state() & (usual | flag::place | flag::refiltered | flag::parked)) ==
                   usual;
            set(entries, Entry{static_cast<std::uint32_t>(i)}, state, index);
        }
        if (!all) only_moves.store(false, std::memory_order_relaxed);
    };
    process_items(changed.size(), enter_some, {state.executor_for(changed.size()), object_run});
    return only_moves;
}

/// Changed objects of all kinds: those that are there, and lists of those that wake up and that stir.
template <int Dim, class T>
std::uint32_t enter_each(Entries<Dim, T>& entries, State<Dim, T>& state, std::span<const Index> changed)
{
    std::uint32_t count = 0;
    const bool any_shifts = any_may_shift(state, changed);
    for (const Index index : changed) {
        const auto object = state.objects[index];
        const Place place = object.place();
        if (place == Place::resting) {
            const bool shifting = any_shifts && shifts(state, index);
            object.set(flag::shifting, shifting);
            entries.rested.push_back(raw(index));
            (shifting ? entries.shifting : entries.waking).push_back(raw(index));
        }
        if (place == Place::resting || object.has(flag::parked) ||
            (entries.parks && place == Place::active)) {
            entries.stirring.push_back(index);
            entries.boxes_before.push_back(object.before());
        }
        if (!object.is_there()) continue;
        const Entry entry{count++};
        set(entries, entry, state, index);
        if (place == Place::none || object.has(flag::refiltered))
            entries.filter[entry] = state.classes.of(object.filter());
    }
    return count;
}

/// Stages what is active and hasn't changed, then for this update what has: with the box that it had.
template <int Dim, class T>
void park_idle(Entries<Dim, T>& entries, State<Dim, T>& state, std::span<const Index> changed)
{
    for (const auto& each : state.active) {
        const auto object = state.objects[each.index];
        if (!object.has(flag::written)) state.parked.stage(each.index, object.now());
    }
    entries.parking = state.parked.staged().size();
    for (const Index index : changed) {
        const auto object = state.objects[index];
        if (object.place() == Place::active && !object.has(flag::parked))
            state.parked.stage(index, object.before());
    }
}

} // namespace

template <int Dim, class T>
Entries<Dim, T> enter(State<Dim, T>& state, std::span<const Index> changed, Arena& arena)
{
    Entries<Dim, T> entries(arena);
    state.parked.unstage();
    entries.parks = state.active.size() >= worth_parking &&
                    state.active.size() > active_per_changed * changed.size() && most_are_due(state);
    entries.only_moves = !entries.parks;
    if (entries.parks)
        resize(entries, changed.size());
    else
        entries.only_moves = enter_all(entries, state, changed);
    entries.all_of_active = entries.only_moves && changed.size() == state.active.size();
    auto count = static_cast<std::uint32_t>(changed.size());
    if (!entries.only_moves) count = enter_each(entries, state, changed);
    entries.changed = count;
    if (entries.parks) park_idle(entries, state, changed);
    entries.any_idle = !entries.parks && !entries.all_of_active && !state.active.empty();
    if (count == 0 || !entries.any_idle) {
        resize(entries, count);
        return entries;
    }
    resize(entries, count + state.active.size());
    for (const auto& each : state.active)
        if (!state.objects[each.index].has(flag::written)) set(entries, Entry{count++}, state, each.index);
    resize(entries, count);
    entries.any_idle = count != entries.changed;
    return entries;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template Entries<Dim, T> enter(State<Dim, T>&, std::span<const Index>, Arena&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
