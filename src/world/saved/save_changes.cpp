// SPDX-License-Identifier: MIT
// Saves what has changed since a base (a whole snapshot), and restores it from any other state with that
// base, at a cost proportional to what differs and without visiting resting objects.
//
// After the header: the end of the indices; objects that differ, ascending, as index and record; how many of
// the base's free indices are left, from the first on, and the free indices after them; active objects; pairs
// that are refused (1) or no longer refused (0). Each list begins with its length.
#include <algorithm>
#include <limits>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "world/implementation.hpp"
#include "world/saved/snapshot_bytes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

template <int Dim, class T>
Journal<Dim, T>& base_of(typename World<Dim, T>::Implementation& me)
{
    if (!me.journal)
        throw Error(ErrorCode::invalid_argument,
                    "this World has no base from which to tell what changed; call save_base() first, and "
                    "again after restore(), clear() or for a fork");
    return *me.journal;
}

/// Lists the objects whose records may differ from the base: ascending, each once.
template <int Dim, class T>
void list_suspects(typename World<Dim, T>::Implementation& me, std::pmr::vector<std::uint32_t>& indices)
{
    indices.clear();
    for (const auto& each : me.journal->objects())
        indices.push_back(raw(each.index));
    me.user_data.list_noted(indices);
    std::sort(indices.begin(), indices.end());
    indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
}

/// The state of an object now, and in the base.
template <int Dim, class T>
struct ThenAndNow
{
    ThenAndNow(const typename World<Dim, T>::Implementation& me, Index index)
    {
        if (me.state.was_there(raw(index))) now = record_of(me.state, me.applied, index);
        const Record<Dim, T>* const noted = me.journal->find(index);
        then = noted != nullptr ? *noted : now;
        if (now.generation != 0) now.data = me.user_data.of(raw(index));
        if (then.generation != 0) then.data = me.user_data.then(raw(index));
    }
    Record<Dim, T> then, now;
};

template <int Dim, class T>
void write_changes(SnapshotWriter& out, typename World<Dim, T>::Implementation& me)
{
    const State<Dim, T>& state = me.state;
    auto& journal = *me.journal;
    auto& work = journal.work;
    list_suspects<Dim, T>(me, work.indices);

    std::size_t kept = 0;
    out.put(std::uint64_t{state.ids.compare(
        journal.free, journal.end, work.indices, [&](std::uint32_t index) { return state.was_there(index); },
        kept, work.free)});
    const std::size_t count_at = out.bytes.size();
    std::uint64_t count = 0;
    out.put(count);
    for (const std::uint32_t index : work.indices) {
        const ThenAndNow<Dim, T> record(me, Index{index});
        if (same_record(record.then, record.now)) continue;
        out.put(index);
        write_record(out, record.now);
        ++count;
    }
    out.set(count_at, count);
    out.put(std::uint64_t{kept});
    out.put(std::uint64_t{work.free.size()});
    for (const IdTable::Free& each : work.free) {
        out.put(each.index);
        out.put(each.generation);
    }
    write_active(out, state, work.active);
    work.keys.clear();
    journal.each_refused([&](Key key, bool was_refused) {
        if (state.refused.contains(key) != was_refused) work.keys.push_back(key);
    });
    std::sort(work.keys.begin(), work.keys.end());
    out.put(std::uint64_t{work.keys.size()});
    for (const Key key : work.keys) {
        out.put(key);
        out.put(std::uint32_t{state.refused.contains(key)});
    }
}

/// Restores the saved changes. First it reads and checks everything and allocates all memory; a failure then
/// leaves the world unchanged. Only then does it change the world.
template <int Dim, class T>
class Return
{
  public:
    Return(typename World<Dim, T>::Implementation& me, SnapshotReader& in)
        : me_(me), state_(me.state), journal_(*me.journal), work_(me.journal->work), in_(in)
    {
    }

    void read()
    {
        end_ = in_.get<std::uint64_t>();
        read_objects();
        read_free();
        read_lists();
        read_refused();
        in_.demand_end();
    }
    void make_room();
    void commit() noexcept;

  private:
    using Target = typename Journal<Dim, T>::Target;

    void read_objects();
    void read_free();
    void read_lists();
    void read_refused();
    void list_targets();
    [[nodiscard]] const Target* find(std::uint32_t index) const noexcept
    {
        const auto at = std::partition_point(work_.targets.begin(), work_.targets.end(),
                                             [index](const Target& each) { return raw(each.index) < index; });
        return at != work_.targets.end() && raw(at->index) == index ? &*at : nullptr;
    }
    /// The states that objects will have.
    [[nodiscard]] Place place(std::uint32_t index) const noexcept
    {
        if (index >= end_) return Place::none;
        if (const Target* const target = find(index)) return target->record.place();
        return state_.was_there(index) ? recorded(state_.objects[Index{index}].place()) : Place::none;
    }
    /// Whether both objects of a pair in the base still exist. The pair stays unless the changes say
    /// otherwise.
    [[nodiscard]] bool is_left(Key key) const noexcept
    {
        const Pair pair = pair_of(key);
        return !work_.is_free[pair.a] && !work_.is_free[pair.b];
    }
    [[nodiscard]] bool is_pair(Key key) const noexcept
    {
        const Pair pair = pair_of(key);
        return pair.a < pair.b && place(pair.a) != Place::none && place(pair.b) != Place::none;
    }

    typename World<Dim, T>::Implementation& me_;
    State<Dim, T>& state_;
    Journal<Dim, T>& journal_;
    typename Journal<Dim, T>::Work& work_;
    SnapshotReader& in_;
    std::uint64_t end_ = 0;
    std::size_t kept_ = 0;
    bool any_gone_ = false; // of the objects of the base
    Census census_;
};

template <int Dim, class T>
void Return<Dim, T>::read_objects()
{
    auto& read = work_.read;
    read.clear();
    const std::uint64_t count = in_.get_count(8);
    in_.demand(journal_.end <= end_ && end_ <= std::numeric_limits<std::uint32_t>::max(),
               "the number of indices fits neither the base nor what follows");
    std::uint64_t least = 0;
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto index = in_.get<std::uint32_t>();
        in_.demand(least <= index && index < end_, "the objects don't ascend, or end too late");
        least = std::uint64_t{index} + 1;
        read.push_back({Index{index}, read_record<Dim, T>(in_)});
        any_gone_ |= read.back().record.generation == 0;
    }
    // An object that is neither among them nor differs from the base now stays unchanged.
    list_suspects<Dim, T>(me_, work_.indices);
    census_ = {state_.alive, state_.disabled, state_.resting.size()};
    auto& targets = work_.targets;
    targets.clear();
    std::size_t next = 0;
    const auto add = [&](Index index, const Record<Dim, T>* to) {
        const ThenAndNow<Dim, T> record(me_, index);
        targets.push_back({index, to != nullptr ? *to : record.then});
        census_.remove(record.now);
        census_.add(targets.back().record);
    };
    for (const std::uint32_t index : work_.indices) {
        for (; next < read.size() && raw(read[next].index) < index; ++next)
            add(read[next].index, &read[next].record);
        const bool is_read = next < read.size() && raw(read[next].index) == index;
        add(Index{index}, is_read ? &read[next++].record : nullptr);
    }
    for (; next < read.size(); ++next)
        add(read[next].index, &read[next].record);
}

template <int Dim, class T>
void Return<Dim, T>::read_free()
{
    kept_ = static_cast<std::size_t>(in_.get<std::uint64_t>());
    in_.demand(kept_ <= journal_.free.size(), "there are more free indices left than the base has");
    const std::uint64_t count = in_.get_count(8);
    // New indices belong to objects or are free: otherwise a few bytes could request any amount of memory.
    in_.demand(end_ - journal_.end <= work_.read.size() + count,
               "the number of indices fits neither the base nor what follows");
    work_.is_free.assign(static_cast<std::size_t>(end_), false);
    for (std::size_t k = 0; k < kept_; ++k)
        work_.is_free[journal_.free[k].index] = true;
    work_.free.clear();
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto index = in_.get<std::uint32_t>(), generation = in_.get<std::uint32_t>();
        in_.demand(index < end_ && is_generation(generation) && !work_.is_free[index] &&
                       place(index) == Place::none,
                   "an index is listed as free that isn't, or twice");
        work_.is_free[index] = true;
        work_.free.push_back({index, generation});
    }
    for (const Target& each : work_.targets)
        in_.demand(each.record.generation == 0 || !work_.is_free[raw(each.index)],
                   "an index is listed as free that isn't, or twice");
    for (const Target& each : work_.read) // also those that won't be handed out any more
        if (each.record.generation == 0) work_.is_free[raw(each.index)] = true;
}

template <int Dim, class T>
void Return<Dim, T>::read_lists()
{
    work_.active.clear();
    work_.parked.clear();
    work_.shifted.clear();
    const auto place_of = [this](std::uint32_t index) { return place(index); };
    read_active(in_, place_of, census_.active(), work_.active, work_.parked, work_.shifted);
}

template <int Dim, class T>
void Return<Dim, T>::read_refused()
{
    auto& refused = work_.refused;
    refused.clear();
    constexpr const char* gone = "a refused pair names an object that isn't there";
    const std::uint64_t count = in_.get_count(12);
    for (std::uint64_t k = 0; k < count; ++k) {
        const auto key = in_.get<Key>();
        const auto is_refused = in_.get<std::uint32_t>();
        in_.demand(refused.empty() || refused.back().first < key, "the refused pairs don't ascend");
        in_.demand(is_refused <= 1 && (is_refused == 0 ? key != no_key : is_pair(key)), gone);
        refused.push_back({key, is_refused == 1});
    }
    // And those that return to their state in the base.
    const auto by_key = [](const auto& a, const auto& b) { return a.first < b.first; };
    const auto read_end = static_cast<std::ptrdiff_t>(refused.size());
    const auto is_read = [&](Key key) {
        return std::binary_search(refused.begin(), refused.begin() + read_end, std::pair(key, false), by_key);
    };
    journal_.each_refused([&](Key key, bool was_refused) {
        if (is_read(key)) return;
        in_.demand(!was_refused || is_left(key), gone);
        refused.push_back({key, was_refused});
    });
    if (any_gone_)
        state_.refused.each(
            [&](Key key) { in_.demand(journal_.was_allowed(key) || is_left(key) || is_read(key), gone); });
}

template <int Dim, class T>
void Return<Dim, T>::make_room()
{
    const auto end = static_cast<std::uint32_t>(end_);
    // Objects that are only queued may have user data: their indices are beyond the end.
    state_.make_room(work_.targets.empty() ? end : std::max(end, raw(work_.targets.back().index) + 1));
    state_.ids.make_room(end);
    me_.neighbour_lists.make_room(state_.objects.capacity());
    state_.active.reserve(work_.active.size());
    state_.parked.reserve(work_.parked.size());
    state_.shifted.reserve(work_.shifted.size());
    list_targets();
    state_.refused.reserve(work_.refused.size());
    // The last step that can fail; if it does, nothing has changed.
    BoxIndexAccess::tree(state_.resting).put(work_.come, work_.come_boxes);
}

/// Makes the journal record the present state of objects, and lists those that come to rest, wake up or move
/// at rest.
template <int Dim, class T>
void Return<Dim, T>::list_targets()
{
    work_.come.clear(), work_.gone.clear(), work_.changed.clear();
    work_.come_boxes.clear(), work_.indices.clear();
    for (const Target& each : work_.targets) {
        const std::uint32_t index = raw(each.index);
        const auto object = state_.objects[each.index];
        if (journal_.find(each.index) == nullptr)
            journal_.note(each.index, state_.was_there(index) ? record_of(state_, me_.applied, each.index)
                                                              : Record<Dim, T>());
        if (each.record.has(flag::has_reach)) state_.objects.make_room_for_reach(each.index);
        if (each.record.generation != 0) me_.user_data.expect(index, each.record.data);
        work_.changed.push_back(each.index);
        work_.indices.push_back(index);
        const bool rested = object.place() == Place::resting;
        const bool will_rest = each.record.place() == Place::resting;
        if (rested && !will_rest) work_.gone.push_back(index);
        if (will_rest && !(rested && same(object.now(), each.record.box))) {
            work_.come.push_back(index);
            work_.come_boxes.push_back(each.record.box);
        }
    }
    for (const auto& [key, is_refused] : work_.refused) {
        const bool is_now = state_.refused.contains(key);
        const Key one[] = {key};
        journal_.note_refused(std::span(one).first(is_now ? 0 : 1), std::span(one).first(is_now ? 1 : 0));
    }
}

template <int Dim, class T>
void Return<Dim, T>::commit() noexcept
{
    me_.queues.discard();
    if (!work_.gone.empty()) BoxIndexAccess::tree(state_.resting).erase(work_.gone);
    state_.parked.each([&](Index index) {
        state_.objects[index].set_place(Place::active);
        return true;
    });
    for (const auto& each : state_.shifted)
        state_.objects[each.index].set(flag::shifted, false);
    for (const Target& each : work_.targets) {
        if (state_.objects[each.index].place() == Place::resting) me_.neighbour_lists.note_waking(each.index);
        put_record(state_, each.index, each.record);
        if (each.record.place() == Place::resting)
            me_.neighbour_lists.note_settling(each.index);
        else
            me_.neighbour_lists.drop(each.index);
        state_.ids.set(raw(each.index), each.record.generation);
        if (each.record.generation != 0) me_.user_data.put(raw(each.index), each.record.data);
    }
    state_.ids.go_back(journal_.free, journal_.end, kept_, work_.free, static_cast<std::uint32_t>(end_),
                       [&](std::uint32_t index) { return state_.was_there(index); });
    state_.alive = census_.alive;
    state_.disabled = census_.disabled;
    state_.parked.clear();
    put_active(state_, work_.active, work_.parked, work_.shifted);
    for (const auto& [key, is_refused] : work_.refused) {
        if (is_refused)
            state_.refused.insert(key); // there is room
        else
            state_.refused.erase(key);
        const Key one[] = {key};
        journal_.forget_refused(one, state_.refused);
    }

    // Caches, and the lists of the last update.
    me_.neighbour_lists.invalidate_all();
    me_.neighbour_lists.count_update();
    me_.note(work_.changed, {});
    me_.note_resting(work_.indices, {});
    Lists& lists = me_.last_lists();
    lists.persisted.clear();
    lists.others.clear();
    lists.began.clear();
    lists.ended.clear();
    lists.all_active = true;
    me_.began_pairs.forget();
    me_.changed_pairs.forget();
    me_.user_data.forget_removed();
    me_.recall_is_due = true;
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
std::vector<std::byte> World<Dim, T>::save_base()
{
    Implementation& me = *implementation_;
    const InUse call = me.users.work();
    me.check_own();
    const world::IdTable::Picture ids = me.state.picture_ids();
    std::vector<std::byte> bytes = me.save(ids);
    const bool is_first = !me.journal;
    if (is_first) me.journal.emplace(&me.memory);
    try {
        me.journal->begin(world::checksum(bytes), static_cast<std::uint32_t>(ids.generations.size()),
                          ids.free);
    } catch (...) {
        if (is_first) me.journal.reset();
        throw;
    }
    me.user_data.begin_notes();
    return bytes;
}

template <int Dim, Coordinate T>
void World<Dim, T>::save_changes(std::vector<std::byte>& out)
{
    Implementation& me = *implementation_;
    const InUse call = me.users.work();
    const auto& journal = world::base_of<Dim, T>(me);
    world::SnapshotWriter writer;
    writer.bytes.swap(out); // in its memory
    writer.bytes.clear();
    writer.begin(world::changes_since, world::saved_space<Dim, T>, journal.base);
    world::write_changes<Dim, T>(writer, me);
    writer.end();
    writer.bytes.swap(out);
}

template <int Dim, Coordinate T>
void World<Dim, T>::restore_changes(std::span<const std::byte> changes)
{
    Implementation& me = *implementation_;
    const InUse call = me.users.change();
    const auto& journal = world::base_of<Dim, T>(me);
    world::SnapshotReader in(world::changes_since, changes);
    const std::uint64_t base = in.read_header(world::saved_space<Dim, T>);
    if (base != journal.base)
        in.refuse("they are since another base, whose checksum is " + std::to_string(base) +
                  "; that of this world's is " + std::to_string(journal.base));

    // From here on the checksums are right, but the contents may still be forged, so everything is checked.
    world::Return<Dim, T> back(me, in);
    back.read();
    me.take_back(); // what apply() has shown
    back.make_room();
    back.commit();
    me.stats = world::describe(me.state, me.last_lists());
    me.stats.bytes_reserved = me.bytes();
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template JOSTLE_API std::vector<std::byte> World<Dim, T>::save_base();                                   \
    template JOSTLE_API void World<Dim, T>::save_changes(std::vector<std::byte>&);                           \
    template JOSTLE_API void World<Dim, T>::restore_changes(std::span<const std::byte>);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
