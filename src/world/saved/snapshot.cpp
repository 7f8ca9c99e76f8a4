// SPDX-License-Identifier: MIT
// Snapshots: the contents of a world, without its data structures. The index is rebuilt, which affects no
// answer.
//
// After the header: the margin; a record for each index; free indices with the generations that their next
// objects get; active objects; refused pairs. Each list begins with its length.
#include <algorithm>
#include <limits>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "world/implementation.hpp"
#include "world/saved/snapshot_bytes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

/// Returns the generations of all indices.
template <int Dim, class T>
std::vector<std::uint32_t> read_objects(SnapshotReader& in, State<Dim, T>& state, UserData& user_data)
{
    const std::uint64_t end = in.get_count(4);
    in.demand(end <= std::numeric_limits<std::uint32_t>::max(), "there are too many objects");
    state.make_room(end);
    std::vector<std::uint32_t> generations(end), resting;
    std::vector<Aabb<Dim, T>> resting_boxes;
    Census census;
    for (std::uint32_t i = 0; i < end; ++i) {
        const Record<Dim, T> record = read_record<Dim, T>(in);
        generations[i] = record.generation;
        if (record.generation == 0) continue;
        if (record.has(flag::has_reach)) state.objects.make_room_for_reach(Index{i});
        put_record(state, Index{i}, record);
        if (record.data != 0) user_data.set(i, record.data);
        census.add(record);
        if (record.place() != Place::resting) continue;
        resting.push_back(i);
        resting_boxes.push_back(record.box);
    }
    state.alive = census.alive;
    state.disabled = census.disabled;
    BoxIndexAccess::rebuild(state.resting, resting, resting_boxes);
    return generations;
}

std::vector<IdTable::Free> read_free_ids(SnapshotReader& in, std::span<const std::uint32_t> generations)
{
    std::vector<IdTable::Free> free(in.get_count(8));
    std::vector<bool> is_free(generations.size());
    for (IdTable::Free& each : free) {
        each.index = in.get<std::uint32_t>();
        each.generation = in.get<std::uint32_t>();
        in.demand(each.index < generations.size() && generations[each.index] == 0 &&
                      is_generation(each.generation) && !is_free[each.index],
                  "an index is listed as free that isn't, or twice");
        is_free[each.index] = true;
    }
    return free;
}

template <int Dim, class T>
void read_lists(SnapshotReader& in, State<Dim, T>& state, std::size_t end)
{
    std::vector<typename State<Dim, T>::Active> active, parked, shifted;
    const auto place_of = [&](std::uint32_t index) {
        return index < end ? state.objects[Index{index}].place() : Place::none;
    };
    read_active(in, place_of, state.alive - state.disabled - state.resting.size(), active, parked, shifted);
    put_active(state, active, parked, shifted);
}

template <int Dim, class T>
void read_refused(SnapshotReader& in, State<Dim, T>& state, std::span<const std::uint32_t> generations)
{
    const std::uint64_t count = in.get_count(8);
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto key = in.get<std::uint64_t>();
        const std::uint64_t a = key >> 32, b = key & 0xffffffffu;
        in.demand(a < b && b < generations.size() && generations[a] != 0 && generations[b] != 0,
                  "a refused pair names an object that isn't there");
        state.refused.insert(key);
    }
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
std::vector<std::byte> World<Dim, T>::Implementation::save(const world::IdTable::Picture& ids) const
{
    world::SnapshotWriter out;
    const std::size_t per_object = 5 * 4 + sizeof(Aabb<Dim, T>);
    out.bytes.reserve(world::snapshot_header + 128 + (per_object + 24) * state.alive);
    out.begin(world::whole_snapshot, world::saved_space<Dim, T>, 0);
    out.put(state.margin);
    out.put(std::uint64_t{ids.generations.size()});
    for (std::uint32_t i = 0; i < ids.generations.size(); ++i) {
        world::Record<Dim, T> record;
        if (ids.generations[i] != 0) {
            record = record_of(state, applied, world::Index{i});
            record.generation = ids.generations[i];
            record.data = user_data.of(i);
        }
        world::write_record(out, record);
    }
    out.put(std::uint64_t{ids.free.size()});
    for (const world::IdTable::Free& each : ids.free) {
        out.put(each.index);
        out.put(each.generation);
    }
    std::vector<typename world::State<Dim, T>::Active> active;
    world::write_active(out, state, active);
    std::vector<world::Key> refused;
    state.refused.each([&](world::Key key) { refused.push_back(key); });
    std::sort(refused.begin(), refused.end());
    out.put(std::uint64_t{refused.size()});
    for (const world::Key key : refused)
        out.put(key);
    out.end();
    return std::move(out.bytes);
}

template <int Dim, Coordinate T>
std::vector<std::byte> World<Dim, T>::save() const
{
    implementation_->check_own();
    return implementation_->save(implementation_->state.picture_ids());
}

template <int Dim, Coordinate T>
void World<Dim, T>::restore(std::span<const std::byte> snapshot)
{
    std::unique_ptr<Implementation> fresh; // in the end the old one, which must outlive its `call`
    const InUse call = implementation_->users.change();
    world::SnapshotReader in(world::whole_snapshot, snapshot);
    if (in.read_header(world::saved_space<Dim, T>) != 0)
        in.refuse("its checksum is wrong, so it was altered");

    // From here on the checksum is right, but the contents may still be forged, so everything is checked.
    WorldOptions options = implementation_->state.options;
    options.margin = double{world::read_margin<T>(in)};
    fresh = std::make_unique<Implementation>(options);
    world::State<Dim, T>& state = fresh->state;
    const std::vector<std::uint32_t> generations = world::read_objects(in, state, fresh->user_data);
    state.ids.restore(generations, world::read_free_ids(in, generations));
    world::read_lists(in, state, generations.size());
    world::read_refused(in, state, generations);
    in.demand_end();
    fresh->recall_pairs();
    implementation_.swap(fresh);
}

template <int Dim, Coordinate T>
World<Dim, T> World<Dim, T>::fork() const
{
    World copy(implementation_->state.options);
    copy.restore(save());
    return copy;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template std::vector<std::byte> World<Dim, T>::Implementation::save(const world::IdTable::Picture&)      \
        const;                                                                                               \
    template JOSTLE_API std::vector<std::byte> World<Dim, T>::save() const;                                  \
    template JOSTLE_API void World<Dim, T>::restore(std::span<const std::byte>);                             \
    template JOSTLE_API World<Dim, T> World<Dim, T>::fork() const;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
