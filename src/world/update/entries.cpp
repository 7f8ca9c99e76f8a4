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
}

template <int Dim, class T>
void set(Entries<Dim, T>& entries, Entry entry, const State<Dim, T>& state, Index index)
{
    entries.box[entry] = state.objects[index].now();
    entries.index[entry] = index;
    entries.filter[entry] = state.classes[index];
}

/// Whether so few objects change that moving them within the index pays. Parked objects count as well: the
/// one that has waited longest comes to rest first, and if objects move in turns, moves next.
template <int Dim, class T>
bool any_may_shift(const State<Dim, T>& state, std::span<const Index> changed) noexcept
{
    std::size_t count = 0;
    for (const Index index : changed)
        count += state.objects[index].place() == Place::resting ? 1 : 0;
    return count * resting_per_changed <= state.resting.size() + state.parked.size();
}

/// Assumes that each changed object only moved. Returns whether that is so.
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
            all &= (state.objects[index].state() & (usual | flag::place | flag::refiltered)) == usual;
            set(entries, Entry{static_cast<std::uint32_t>(i)}, state, index);
        }
        if (!all) only_moves.store(false, std::memory_order_relaxed);
    };
    process_items(changed.size(), enter_some, {state.executor_for(changed.size()), object_run});
    return only_moves;
}

/// Enters changed objects of all kinds: the existing ones, and lists of those that wake up and that stir.
template <int Dim, class T>
std::uint32_t enter_each(Entries<Dim, T>& entries, State<Dim, T>& state, std::span<const Index> changed)
{
    std::uint32_t count = 0;
    entries.any_shifts = any_may_shift(state, changed);
    for (const Index index : changed) {
        const auto object = state.objects[index];
        const Place place = object.place();
        if (place == Place::resting) {
            entries.rested.push_back(raw(index));
            (shifts(state, entries, index) ? entries.shifting : entries.waking).push_back(raw(index));
        }
        if (place == Place::resting || place == Place::parked) {
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

} // namespace

template <int Dim, class T>
Entries<Dim, T> enter(State<Dim, T>& state, std::span<const Index> changed, Arena& arena)
{
    Entries<Dim, T> entries(arena);
    entries.only_moves = enter_all(entries, state, changed);
    entries.all_of_active = entries.only_moves && changed.size() == state.active.size();
    entries.any_idle = !entries.all_of_active && !state.active.empty();
    auto count = static_cast<std::uint32_t>(changed.size());
    if (!entries.only_moves) count = enter_each(entries, state, changed);
    entries.changed = count;
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
