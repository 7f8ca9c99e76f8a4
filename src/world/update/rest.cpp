// SPDX-License-Identifier: MIT
#include "world/update/rest.hpp"

#include <algorithm>

#include "base/instantiate.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

// At least this many may come to rest in any update, in addition to new ones ...
constexpr std::size_t least_settling = 32;
// ... and one in this many parked ones, which takes as long as comparing an object with all of them.
constexpr std::size_t compared_per_settling = 1024;

/// How many may come to rest in addition to new ones: about as many as have changed, so that no update takes
/// much longer than its changes require.
std::size_t most_settling(std::size_t changed, std::size_t parked) noexcept
{
    return std::max({least_settling, changed, parked / compared_per_settling});
}

/// Whether different objects change in each update, too many to move within the index. An object that came to
/// rest would soon wake up again, which takes longer than staying active.
template <int Dim, class T>
bool is_restless(const State<Dim, T>& state, std::size_t waking) noexcept
{
    std::size_t waiting = 0, stirring = waking;
    for (const auto& each : state.active) {
        if (each.idle + 1 != idle_updates) continue;
        ++waiting;
        stirring += state.objects[each.index].has(flag::written) ? 1 : 0;
    }
    return stirring > least_settling && stirring * resting_per_changed > state.resting.size() + waiting;
}

/// Goes through changed and active objects, and lists those that stay active and those that have been idle
/// for long enough, both ascending. Changed objects stay active, or move at rest. Returns how many of those
/// idle for long enough are new.
template <int Dim, class T>
std::size_t choose(const State<Dim, T>& state, const Entries<Dim, T>& entries, std::span<const Index> changed,
                   std::pmr::vector<typename State<Dim, T>::Active>& stay, std::pmr::vector<Index>& waited)
{
    const bool restless = is_restless(state, entries.waking.size());
    std::size_t fresh = 0;
    const auto place_changed = [&](Index index) {
        const auto object = state.objects[index];
        if (!object.is_there() || shifts(state, entries, index)) return;
        if (object.place() != Place::none)
            stay.push_back({index, 0});
        else if (object.has(flag::is_static))
            waited.push_back(index);
        else
            stay.push_back({index, due});
    };
    const auto place_idle = [&](const typename State<Dim, T>::Active& each) {
        if (each.idle + 1 < idle_updates) {
            stay.push_back({each.index, each.idle + 1});
        } else if (restless && each.idle != due) {
            stay.push_back(each);
        } else {
            waited.push_back(each.index);
            fresh += each.idle == due;
        }
    };
    const auto end = state.active.end();
    auto active = state.active.begin();
    auto next = changed.begin();
    stay.reserve(state.active.size() + changed.size());
    while (active != end || next != changed.end()) {
        if (next == changed.end() || (active != end && active->index < *next)) {
            place_idle(*active++);
            continue;
        }
        if (active != end && active->index == *next) ++active;
        place_changed(*next++);
    }
    return fresh;
}

} // namespace

template <int Dim, class T>
Rest<Dim, T> plan_rest(State<Dim, T>& state, const Changes<Dim, T>& changes, const Entries<Dim, T>& entries,
                       NeighbourLists<Dim, T>& neighbour_lists, PairFinder& finder, Arena& arena)
{
    const std::span<const Index> changed(changes.objects());
    Rest<Dim, T> rest = {entries.all_of_active,
                         arena.list<typename State<Dim, T>::Active>("objects that will be active"),
                         {},
                         arena.list<std::uint32_t>("objects that come to rest or shift"),
                         arena.list<Aabb<Dim, T>>("boxes of objects that come to rest or shift"),
                         {},
                         {}};
    auto& waited = arena.list<Index>("objects that have been idle for long enough");
    std::size_t most = most_settling(changed.size(), state.parked.size());
    // New objects come in addition: not many more than were added in the update before, which took longer.
    if (!rest.same_active) most += choose(state, entries, changed, rest.active, waited);
    // The object that has waited longest comes to rest first.
    auto& put = rest.indices;
    state.parked.each([&](Index index) {
        if (!state.objects[index].has(flag::written)) put.push_back(raw(index));
        return put.size() < most;
    });
    const std::size_t at_once = std::min(waited.size(), most - std::min(most, put.size()));
    for (std::size_t k = 0; k < at_once; ++k)
        put.push_back(raw(waited[k]));
    rest.parking = std::span<const Index>(waited).subspan(at_once);
    state.parked.reserve(rest.parking.size());
    const std::size_t settling = put.size();
    put.insert(put.end(), entries.shifting.begin(), entries.shifting.end());
    rest.settling = std::span<const std::uint32_t>(put).first(settling);
    rest.shifting = std::span<const std::uint32_t>(put).subspan(settling);
    for (const std::uint32_t index : put)
        rest.boxes.push_back(state.objects[Index{index}].now());
    reserve_more(state.shifted, rest.shifting.size());
    neighbour_lists.invalidate(rest.boxes, changed.size(), finder, arena);
    return rest;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template Rest<Dim, T> plan_rest(State<Dim, T>&, const Changes<Dim, T>&, const Entries<Dim, T>&,          \
                                    NeighbourLists<Dim, T>&, PairFinder&, Arena&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
