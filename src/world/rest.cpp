// SPDX-License-Identifier: MIT
#include "world/rest.hpp"

#include <algorithm>

#include "index/box_index_access.hpp"
#include "world/instantiate.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

// So many may come to rest in any update ...
constexpr std::size_t least_settling = 128;
// ... and one of so many that are parked: that bounds how long they wait, and so for how long who changes is
// compared with them.
constexpr std::size_t turns = 256;

/// For how many updates a changed object counts as idle.
template <class Object>
std::uint32_t idle_of_changed(const Object& object) noexcept
{
    if (object.place() != Place::none) return 0;
    return object.has(flag::is_static) ? idle_updates : idle_updates - 1;
}

/// Goes through changed objects, and unless these are being parked, active ones; both lists ascend. At most
/// `most` come to rest, the others are parked. None of them is in the index: what changed, and so may have
/// been, stays active.
template <int Dim, class T>
void choose(State<Dim, T>& state, std::span<const Index> changed, bool parks, std::size_t most,
            Rest<Dim, T>& rest)
{
    const auto place = [&](Index index, std::uint32_t idle) {
        if (idle < idle_updates)
            rest.active.push_back({index, idle});
        else if (rest.settling.size() < most)
            rest.settling.push_back(raw(index));
        else if (parks)
            rest.active.push_back({index, idle});
        else
            state.parked.stage(index, state.objects[index].now());
    };
    const auto end = state.active.end();
    auto active = parks ? end : state.active.begin();
    auto next = changed.begin();
    rest.active.reserve(static_cast<std::size_t>(end - active) + changed.size());
    while (active != end || next != changed.end()) {
        if (next == changed.end() || (active != end && active->index < *next)) {
            place(active->index, std::min(active->idle + 1, idle_updates));
            ++active;
            continue;
        }
        const Index index = *next++;
        if (active != end && active->index == index) ++active;
        const auto object = state.objects[index];
        if (object.is_there()) place(index, idle_of_changed(object));
    }
}

} // namespace

template <int Dim, class T>
Rest<Dim, T> plan_rest(State<Dim, T>& state, const Changes<Dim, T>& changes, const Entries<Dim, T>& entries,
                       NeighbourLists<Dim, T>& neighbour_lists, PairFinder& finder, Arena& arena)
{
    Rest<Dim, T> rest = {entries.all_of_active,
                         arena.list<typename State<Dim, T>::Active>("objects that will be active"),
                         arena.list<std::uint32_t>("objects that come to rest"),
                         arena.list<Aabb<Dim, T>>("boxes of objects that come to rest")};
    // About as many as have changed come to rest, so that no update takes much longer than what it is asked
    // to do; who has waited longest comes first.
    const std::size_t most =
        std::max({least_settling, changes.objects().size(), state.parked.size() / turns});
    state.parked.each([&](Index index) {
        if (!state.objects[index].has(flag::written)) rest.settling.push_back(raw(index));
        return rest.settling.size() < most;
    });
    if (!rest.same_active) choose(state, changes.objects(), entries.parks, most, rest);
    rest.parking = entries.parks ? entries.parking : state.parked.staged().size();
    for (const std::uint32_t index : rest.settling)
        rest.boxes.push_back(state.objects[Index{index}].now());
    neighbour_lists.invalidate(rest.boxes, changes.objects().size(), finder, arena);
    return rest;
}

template <int Dim, class T>
void settle(State<Dim, T>& state, const Rest<Dim, T>& rest)
{
    if (!rest.settling.empty())
        BoxIndexAccess::insert(state.resting, rest.settling,
                               BoxView<Dim, T>(std::span<const Aabb<Dim, T>>(rest.boxes)));
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void settle(State<Dim, T>&, const Rest<Dim, T>&);                                               \
    template Rest<Dim, T> plan_rest(State<Dim, T>&, const Changes<Dim, T>&, const Entries<Dim, T>&,          \
                                    NeighbourLists<Dim, T>&, PairFinder&, Arena&);
JOSTLE_FOR_EACH_WORLD(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
