// SPDX-License-Identifier: MIT
// The first stage of an update: writes the queued commands into the objects, whose old state is kept.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "base/instantiate.hpp"
#include "jostle/process.hpp"
#include "world/update/writer.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

template <int Dim, class T>
Writer<Dim, T>::Writer(State<Dim, T>& state, Changes<Dim, T>& changes, Arena& arena)
    : state_(state),
      changes_(changes),
      queue_of_(arena.take<Table<Index, std::uint32_t>>("queue that wrote to an object"))
{
}

template <int Dim, class T>
void Writer<Dim, T>::begin(std::pmr::vector<Noted>* noted) noexcept
{
    noted_ = noted;
    any_contested_ = false;
}

template <int Dim, class T>
void Writer<Dim, T>::set_queue(std::uint32_t queue)
{
    queue_of_.grow(state_.ids.end());
    queue_ = queue;
}

/// Prepares the object for writing; returns false if it is gone.
template <int Dim, class T>
bool Writer<Dim, T>::open(ObjectId id)
{
    const Index index{id.index};
    if (!state_.ids.is_good(id) || !state_.objects[index].has(flag::alive)) {
        ++changes_.dropped;
        return false;
    }
    const Object object = state_.objects[index];
    touch(index);
    if (!object.has(flag::written)) {
        changes_.list().push_back(index);
        object.keep_box();
        queue_of_[index] = queue_;
    } else if (queue_of_[index] == nobody) {
        queue_of_[index] = queue_;
    } else if (queue_of_[index] != queue_) {
        contest(object);
    } else if (object.has(flag::contested)) {
        any_contested_ = true; // since before
    }
    return true;
}

template <int Dim, class T>
void Writer<Dim, T>::touch(Index index)
{
    if (noted_ == nullptr) return;
    const Object object = state_.objects[index];
    if (object.has(flag::noted)) return;
    reserve_more(changes_.list(), 1); // once it is recorded, listing it as changed can't fail
    noted_->push_back({index, object.has(flag::alive)});
    object.set(flag::noted);
}

template <int Dim, class T>
void Writer<Dim, T>::contest(Object object) noexcept
{
    object.set(flag::contested);
    any_contested_ = true;
}

template <int Dim, class T>
void Writer<Dim, T>::add(const Addition<Dim, T>& addition)
{
    const Index index{addition.id.index};
    const Object object = state_.objects[index];
    touch(index);
    if (!object.has(flag::written)) {
        changes_.list().push_back(index);
        queue_of_[index] = nobody;
    }
    object.set_state(static_cast<std::uint32_t>(Place::none) | flag::alive |
                     (object.state() & flag::transient) | flag::written);
    object.set(flag::enabled, addition.options.enabled);
    object.now() = object.before() = addition.box;
    object.set_filter(addition.options.filter);
    if (const T margin = state_.margin + addition.options.margin; margin != 0) set_margin(index, margin);
}

template <int Dim, class T>
void Writer<Dim, T>::apply(const Command<Dim, T>& command)
{
    const Index index{command.id.index};
    if (!open(command.id)) return;
    const Object object = state_.objects[index];
    if (command.sequence != 0) contest(object);
    switch (command.kind) {
    case CommandKind::remove:
        object.set(flag::alive, false);
        any_removed_ = true;
        break;
    case CommandKind::move:
        set_box(index, command.box);
        break;
    case CommandKind::sweep:
        set_displacement(index, command.box.lo.data());
        break;
    case CommandKind::resize:
        resize(index, command.box);
        break;
    case CommandKind::filter:
        set_filter(index, command.filter);
        break;
    case CommandKind::margin:
        set_margin(index, state_.margin + command.box.lo[0]);
        break;
    case CommandKind::enable:
    case CommandKind::disable:
        object.set(flag::enabled, command.kind == CommandKind::enable);
        break;
    case CommandKind::report:
        changes_.report_again(index, changes_.everyone);
        break;
    case CommandKind::report_pair:
        changes_.report_again(index, Index{command.other.index});
        break;
    }
}

template <int Dim, class T>
void Writer<Dim, T>::move(ObjectId id, const Box& box)
{
    if (open(id)) set_box(Index{id.index}, box);
}

template <int Dim, class T>
Reach<Dim, T>& Writer<Dim, T>::reach_of(Index index)
{
    const Object object = state_.objects[index];
    state_.objects.make_room_for_reach(index);
    Reach<Dim, T>& reach = state_.objects.reach(index);
    const bool had = object.has(flag::has_reach);
    if (!object.has(flag::reach_kept)) {
        changes_.keep_reach({index, had, reach});
        object.set(flag::reach_kept);
    }
    if (!had) {
        reach = {object.now(), {}, 0};
        object.set(flag::has_reach);
    }
    return reach;
}

template <int Dim, class T>
void Writer<Dim, T>::set_box(Index index, const Box& box)
{
    const Object object = state_.objects[index];
    if (!object.has(flag::has_reach)) {
        object.now() = box;
        return;
    }
    Reach<Dim, T>& reach = reach_of(index);
    reach.box = box;
    for (T& each : reach.displacement)
        each = 0;
    set_bounds(index);
}

/// Sets the bounds that follow from its reach.
template <int Dim, class T>
void Writer<Dim, T>::set_bounds(Index index)
{
    state_.objects[index].now() = state_.objects.reach(index).bounds();
}

template <int Dim, class T>
void Writer<Dim, T>::resize(Index index, const Box& size)
{
    const Object object = state_.objects[index];
    Box box = state_.objects.box(index);
    for (int d = 0; d < Dim; ++d) {
        const T lo = box.lo[d], hi = box.hi[d], length = hi - lo, half = size.lo[d] / 2;
        if (!std::isfinite(lo) || !std::isfinite(hi)) continue; // no centre: this axis stays
        const T centre = std::isfinite(length) ? lo + length / 2 : lo / 2 + hi / 2;
        box.lo[d] = centre - half;
        box.hi[d] = centre + half;
    }
    if (!object.has(flag::has_reach)) {
        object.now() = box;
        return;
    }
    Reach<Dim, T>& reach = reach_of(index);
    reach.box = box;
    set_bounds(index);
}

template <int Dim, class T>
void Writer<Dim, T>::set_displacement(Index index, const T* displacement)
{
    Reach<Dim, T>& reach = reach_of(index);
    std::copy_n(displacement, Dim, reach.displacement);
    set_bounds(index);
}

template <int Dim, class T>
void Writer<Dim, T>::set_margin(Index index, T margin)
{
    Reach<Dim, T>& reach = reach_of(index);
    reach.margin = margin;
    set_bounds(index);
}

template <int Dim, class T>
void Writer<Dim, T>::set_filter(Index index, const ObjectFilter& filter)
{
    const Object object = state_.objects[index];
    const bool asks = state_.options.accept != nullptr;
    if (object.place() != Place::none && !object.has(flag::refiltered)) {
        if (object.filter() == filter && !asks) return;
        changes_.keep_filter(index, object.filter());
        object.set(flag::refiltered);
    }
    object.set_filter(filter);
}

namespace {

/// Commands to be applied. Moves given to update() count as the last of the calling thread's queue.
struct QueueCounts
{
    std::uint32_t own;
    std::uint64_t commands;
};

template <int Dim, class T>
QueueCounts count_queues(const Queues<Dim, T>& queues, std::size_t moves)
{
    const std::thread::id me = std::this_thread::get_id();
    QueueCounts counts{queues.first() == nullptr ? 1 : queues.first()->number + 1, moves};
    for (const Queue<Dim, T>* queue = queues.first(); queue != nullptr; queue = queue->next) {
        if (queue->owner.load(std::memory_order_relaxed) == me) counts.own = queue->number;
        counts.commands += queue->taken_commands.size() - queue->applied_commands +
                           queue->taken_additions.size() - queue->applied_additions;
    }
    return counts;
}

template <int Dim, class T>
void apply_queued(const State<Dim, T>& state, Queues<Dim, T>& queues, Writer<Dim, T>& writer)
{
    for (Queue<Dim, T>* queue = queues.first(); queue != nullptr; queue = queue->next) {
        writer.set_queue(queue->number);
        const auto& additions = queue->taken_additions;
        for (std::size_t i = queue->applied_additions; i < additions.size(); ++i)
            writer.add(additions[i]);
        queue->applied_additions = additions.size();
    }
    for (Queue<Dim, T>* queue = queues.first(); queue != nullptr; queue = queue->next) {
        writer.set_queue(queue->number);
        const auto& commands = queue->taken_commands;
        for (std::size_t i = std::exchange(queue->applied_commands, commands.size()); i < commands.size();
             ++i) {
            if (i + fetch_ahead < commands.size())
                state.objects.prefetch(Index{commands[i + fetch_ahead].id.index});
            writer.apply(commands[i]);
        }
    }
}

template <int Dim, class T>
void move_one_by_one(const State<Dim, T>& state, const Moves<Dim, T>& moves, Writer<Dim, T>& writer)
{
    for (std::size_t i = 0; i < moves.ids.size(); ++i) {
        const ObjectId id = moves.ids[i];
        if (i + fetch_ahead < moves.ids.size())
            state.objects.prefetch(Index{moves.ids[i + fetch_ahead].index});
        state.ids.check(id);
        const Aabb<Dim, T> box = moves.boxes[i];
        check_box(box, id);
        writer.move(id, box);
    }
}

/// Whether objects can be moved independently: ids ascend, and bounds are the given boxes.
template <int Dim, class T>
bool are_plain(const State<Dim, T>& state, const Moves<Dim, T>& moves)
{
    std::atomic<bool> plain{true};
    const auto look = [&](std::uint64_t begin, std::uint64_t end, Work) {
        bool all = true;
        for (std::uint64_t i = begin; i < end; ++i) {
            const ObjectId id = moves.ids[i];
            if (i + fetch_ahead < moves.ids.size())
                state.objects.prefetch(Index{moves.ids[i + fetch_ahead].index});
            all &= state.ids.is_good(id) && (i == 0 || moves.ids[i - 1].index < id.index) &&
                   (state.objects[Index{id.index}].state() & (flag::alive | flag::has_reach)) == flag::alive;
        }
        if (!all) plain.store(false, std::memory_order_relaxed);
    };
    process_items(moves.ids.size(), look, {state.executor_for(moves.ids.size()), object_run});
    return plain;
}

/// Moves objects without other commands in parallel. The moves are plain.
template <int Dim, class T>
void move_in_place(State<Dim, T>& state, const Moves<Dim, T>& moves, Changes<Dim, T>& changes, Arena& arena)
{
    auto& moved_of_run = arena.list<std::uint32_t>("objects that a run has moved");
    moved_of_run.resize((moves.ids.size() + object_run - 1) / object_run);
    std::pmr::vector<Index>& changed = changes.list();
    changed.resize(moves.ids.size());
    std::atomic<bool> good{true};
    const auto move = [&](std::uint64_t begin, std::uint64_t end, Work work) {
        Index* const first = changed.data() + begin;
        Index* to = first;
        bool all = true;
        for (std::uint64_t i = begin; i < end; ++i) {
            const Index index{moves.ids[i].index};
            if (i + fetch_ahead < moves.ids.size())
                state.objects.prefetch(Index{moves.ids[i + fetch_ahead].index});
            const auto object = state.objects[index];
            const Aabb<Dim, T> box = moves.boxes[i];
            all &= valid(box);
            if (same(object.now(), box)) continue;
            object.before() = box;
            object.exchange_boxes();
            *to++ = index;
        }
        if (!all) good.store(false, std::memory_order_relaxed);
        moved_of_run[work.block] = static_cast<std::uint32_t>(to - first);
    };
    process_items(moves.ids.size(), move, {state.executor_for(moves.ids.size()), object_run});
    std::size_t kept = 0;
    for (std::size_t run = 0; run < moved_of_run.size(); ++run) {
        const Index* const first = changed.data() + run * object_run;
        if (kept != run * object_run) std::copy_n(first, moved_of_run[run], changed.data() + kept);
        kept += moved_of_run[run];
    }
    changed.resize(kept);
    if (good) return;
    for (std::size_t i = 0; i < moves.ids.size(); ++i)
        check_box(moves.boxes[i], moves.ids[i]);
}

} // namespace

template <int Dim, class T>
void apply(State<Dim, T>& state, Queues<Dim, T>& queues, const Moves<Dim, T>& moves, Applied<Dim, T>& applied,
           Arena& arena)
{
    state.make_room(state.ids.end());
    const QueueCounts counts = count_queues(queues, moves.ids.size());
    auto& [changes, writer, added, removed] = applied;
    changes.commands += counts.commands;
    writer.begin(nullptr);
    reserve_more(changes.list(), counts.commands);
    apply_queued(state, queues, writer);
    if (changes.objects().empty()) { // no command was for an existing object
        if (moves.ids.empty()) return;
        if (are_plain(state, moves)) {
            move_in_place(state, moves, changes, arena);
            return;
        }
    }
    writer.set_queue(counts.own);
    move_one_by_one(state, moves, writer);
    if (writer.any_contested()) settle_contests(state, changes, writer, queues, moves, counts.own, arena);
    changes.close(arena);
}

template <int Dim, class T>
void apply_ahead(State<Dim, T>& state, Queues<Dim, T>& queues, Applied<Dim, T>& applied,
                 std::pmr::vector<Noted>& noted, Arena& arena)
{
    state.make_room(state.ids.end());
    const QueueCounts counts = count_queues(queues, 0);
    auto& [changes, writer, added, removed] = applied;
    changes.commands += counts.commands;
    writer.begin(&noted);
    apply_queued(state, queues, writer);
    if (writer.any_contested()) settle_contests(state, changes, writer, queues, {}, counts.own, arena);
    // Queries by layers and snapshots read the old state of objects.
    changes.sort_filters();
    changes.sort_reaches();
    changes.sort_again();
    for (const Noted& each : noted) {
        const auto object = state.objects[each.index];
        object.set(flag::noted, false);
        added += object.has(flag::alive) && !each.was_alive;
        removed += each.was_alive && !object.has(flag::alive);
    }
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template class Writer<Dim, T>;                                                                           \
    template void apply(State<Dim, T>&, Queues<Dim, T>&, const Moves<Dim, T>&, Applied<Dim, T>&, Arena&);    \
    template void apply_ahead(State<Dim, T>&, Queues<Dim, T>&, Applied<Dim, T>&, std::pmr::vector<Noted>&,   \
                              Arena&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
