// SPDX-License-Identifier: MIT
#include "world/rest.hpp"

#include <algorithm>

#include "index/box_index_access.hpp"
#include "world/instantiate.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

// Updates an object must stay as it is before it comes to rest. New objects need one only.
constexpr std::uint32_t idle_updates = 3;
// This many may come to rest in an update that has nothing else to do.
constexpr std::uint64_t least_settling = 512;

/// For how many updates a changed object counts as idle.
template <class Object>
std::uint32_t idle_of_changed(const Object& object) noexcept
{
    if (object.place() != Place::none) return 0;
    return object.has(flag::is_static) ? idle_updates : idle_updates - 1;
}

/// Goes through active and changed objects, of which both lists ascend. At most `most` come to rest. None of
/// them is in the index: what changed, and so may have been, stays active.
template <int Dim, class T>
void choose(const State<Dim, T>& state, std::span<const Index> changed, std::uint64_t most,
            Rest<Dim, T>& rest)
{
    const auto place = [&](Index index, std::uint32_t idle) {
        if (idle >= idle_updates && rest.settling.size() < most)
            rest.settling.push_back(raw(index));
        else
            rest.active.push_back({index, idle});
    };
    rest.active.reserve(state.active.size() + changed.size());
    auto active = state.active.begin();
    auto next = changed.begin();
    while (active != state.active.end() || next != changed.end()) {
        if (next == changed.end() || (active != state.active.end() && active->index < *next)) {
            place(active->index, std::min(active->idle + 1, idle_updates));
            ++active;
            continue;
        }
        const Index index = *next++;
        if (active != state.active.end() && active->index == index) ++active;
        const auto object = state.objects[index];
        if (object.is_there()) place(index, idle_of_changed(object));
    }
}

} // namespace

template <int Dim, class T>
Rest<Dim, T> plan_rest(State<Dim, T>& state, const Changes<Dim, T>& changes, const Entries<Dim, T>& entries,
                       NeighbourLists<Dim, T>& neighbour_lists, PairFinder& finder, Arena& arena)
{
    Rest<Dim, T> rest = {
        entries.all_of_active, arena.list<typename State<Dim, T>::Active>("objects that will be active"),
        arena.list<std::uint32_t>("objects that come to rest"),
        std::max<std::uint64_t>(changes.objects().size(), state.recent_work - state.recent_work / 4)};
    // No more come to rest at a time than there was work anyhow of late, so that no update takes much longer
    // than those before it.
    if (!rest.same_active) choose(state, changes.objects(), std::max(least_settling, rest.recent_work), rest);
    auto& boxes = arena.list<Aabb<Dim, T>>("boxes of objects that come to rest");
    for (const std::uint32_t index : rest.settling)
        boxes.push_back(state.objects[Index{index}].now());
    neighbour_lists.invalidate(boxes, changes.objects().size(), finder, arena);
    if (!rest.settling.empty())
        BoxIndexAccess::insert(state.resting, rest.settling,
                               BoxView<Dim, T>(std::span<const Aabb<Dim, T>>(boxes)));
    return rest;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template Rest<Dim, T> plan_rest(State<Dim, T>&, const Changes<Dim, T>&, const Entries<Dim, T>&,          \
                                    NeighbourLists<Dim, T>&, PairFinder&, Arena&);
JOSTLE_FOR_EACH_WORLD(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
