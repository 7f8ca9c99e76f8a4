// SPDX-License-Identifier: MIT
// A collective update: what this rank's objects have to say goes to the regions that they touch, each region
// is searched, and pairs go to the ranks that are told. Nothing that users see changes before all have
// agreed.
#include <span>

#include "agreement.hpp"
#include "clock.hpp"
#include "implementation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::update()
{
    Clock total, clock;
    WorldStats next;
    next.partitions = stats.partitions;
    Agreement agreement(handle);
    agreement.attempt([&] {
        if (noted) std::rethrow_exception(std::exchange(noted, nullptr));
        region.recover(partition);
    });
    next.us_stage = clock.lap();
    const bool divides = rebalancing.agree(agreement, !partition, owned.size(), region.ghosts());
    next.us_wait = clock.lap();
    Partition now;
    if (divides) {
        WeightedPoints points(options.memory);
        agreement.attempt([&] { collect(points); });
        agreement.settle();
        agreement.attempt([&] { now = Partition(handle, Dim, points); });
        ++next.partitions;
        next.us_partition = clock.lap();
    }
    const Partition& current = divides ? now : partition;
    try {
        agreement.attempt([&] {
            stage(current, divides);
            exchange.seal();
        });
        exchange.start(agreement);
        next.messages = exchange.messages_sent();
        next.bytes = next.bytes_of_boxes = exchange.bytes_sent();
        agreement.attempt([&] { hear(exchange.to_myself()); });
        next.us_stage += clock.lap();
        exchange.finish(agreement);
        next.us_wait += clock.lap();
        agreement.attempt([&] {
            for (const Exchange::Message& message : exchange.received())
                hear(message.bytes);
        });
        next.us_stage += clock.lap();
        agreement.attempt([&] { region.search(); });
        next.us_search = clock.lap();
        exchange.clear();
        agreement.attempt([&] {
            region.tell(partition, current, *this, coming);
            exchange.seal();
        });
        exchange.start(agreement);
        agreement.attempt([&] { region.put_in_order(coming); });
        next.messages += exchange.messages_sent();
        next.bytes_of_pairs = exchange.bytes_sent();
        next.bytes += next.bytes_of_pairs;
        next.us_pairs = clock.lap();
        exchange.finish(agreement);
        next.us_wait += clock.lap();
        agreement.attempt([&] {
            for (const Exchange::Message& message : exchange.received())
                hear_pairs(message.bytes);
            region.add_told(coming);
            coming.sort();
        });
        next.us_pairs += clock.lap();
        agreement.settle();
        next.us_wait += clock.lap();
    } catch (...) {
        owned.undo();
        region.undo(partition);
        directory.undo();
        exchange.clear();
        coming.clear();
        throw;
    }
    owned.keep(coming.departed);
    region.keep(current, divides);
    directory.keep();
    exchange.clear();
    if (divides) partition = std::move(now);
    std::swap(lists, coming);
    coming.clear();
    next.objects = owned.entries().size();
    next.members = region.size();
    next.ghosts = region.ghosts();
    next.began = lists.began.places.size();
    next.persisted = lists.persisted.places.size();
    next.ended = lists.ended.size();
    next.arrived = lists.arrived.size();
    next.departed = lists.departed.size();
    next.us_total = total.lap();
    stats = next;
    rebalancing.learn(options.rebalance == Rebalance::automatic,
                      stats.us_stage + stats.us_partition + stats.us_search + stats.us_pairs, divides);
}

/// The middles of this rank's objects, and what each costs to search: this rank's time, shared among them.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::collect(WeightedPoints& points) const
{
    const float weight = rebalancing.weight(region.size());
    points.points.reserve(owned.entries().size() * Dim);
    points.weights.reserve(owned.entries().size());
    for (const Entry& each : owned.entries()) {
        const Object<Dim, T> object = owned.next(each);
        if (!each.exists || !object.details.enabled) continue;
        const auto middle = Partition::middle(object.bounds(margin));
        points.points.insert(points.points.end(), middle.begin(), middle.begin() + Dim);
        points.weights.push_back(weight);
    }
}

/// Writes what this rank's objects have to say to others and to this one. Those that stay inside, the most,
/// tell its region at once: it is one walk through memory less than to do it while messages are on their way.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::stage(const Partition& now, bool divided)
{
    // It would go on being a ghost there, with pairs that are told to this rank.
    const auto has_left = [&](const State<Dim, T>& after) {
        if (after.presence != Presence::enabled) return false;
        now.touched(after.bounds, is);
        return !std::binary_search(is.begin(), is.end(), rank);
    };
    const auto stage_one = [&](const Entry& each) {
        const bool existed = owned.exists(each);
        if (existed != each.exists)
            begin(Directory::rank_of(each.id, ranks), each.exists ? Kind::added : Kind::removed, each.id);
        const Object<Dim, T> object = owned.next(each);
        State<Dim, T> before, after;
        if (existed) before = owned.now(each).state(margin);
        if (each.exists) after = object.state(margin);
        const bool moves = options.migrate && each.exists && (divided || has_left(after));
        const int home = moves ? now.at_middle_of(after.bounds) : rank;
        route(each.id, before, after, home, now, divided);
        if (home != rank) send_away(each.id, object, home);
    };
    if (divided) {
        for (const Entry& each : owned.entries())
            stage_one(each);
        return;
    }
    for (const auto& pending : owned.pending()) {
        const Entry& each = owned.entries()[pending.entry];
        const Aabb<Dim, T> bounds = owned.bounds(each, margin);
        if (!owned.only_moves(pending, each) || !partition.is_inside(bounds) ||
            !region.move_inside(each.id, each.member, bounds))
            stage_one(each);
    }
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::route(std::uint64_t id, const State<Dim, T>& before,
                                          const State<Dim, T>& after, int home, const Partition& now,
                                          bool divided)
{
    const bool was_there = before.presence == Presence::enabled;
    const bool is_there = after.presence == Presence::enabled;
    was.clear();
    is.clear();
    if (was_there) partition.touched(before.bounds, was);
    if (is_there) {
        if (was_there && !divided && !differ(before.bounds, after.bounds))
            is = was;
        else
            now.touched(after.bounds, is);
    }
    Notice<Dim, T> notice{id, home, home != rank, false, false, before, after};
    const bool changed = notice.changed();
    auto old_rank = was.begin(), new_rank = is.begin();
    while (old_rank != was.end() || new_rank != is.end()) {
        notice.enters = old_rank == was.end() || (new_rank != is.end() && *new_rank < *old_rank);
        notice.leaves = new_rank == is.end() || (old_rank != was.end() && *old_rank < *new_rank);
        const int to = notice.enters ? *new_rank : *old_rank;
        if (!notice.enters) ++old_rank;
        if (!notice.leaves) ++new_rank;
        if (changed || notice.enters || notice.leaves || notice.is_told)
            notice.write(begin(to, Kind::notice, id));
    }
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::send_away(std::uint64_t id, const Object<Dim, T>& object, int home)
{
    payload.clear();
    if (options.pack) options.pack(id, payload);
    Exchange::Bytes& bytes = begin(home, Kind::migrating, id);
    object.write(bytes);
    put_short(bytes, payload.size());
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    coming.departed.push_back(id);
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::hear(std::span<const std::byte> message)
{
    Reader from(message);
    while (!from.empty()) {
        const auto kind = static_cast<Kind>(from.take<std::uint8_t>());
        if (kind == Kind::end) return;
        const std::uint64_t id = from.take_id();
        switch (kind) {
        case Kind::notice:
            region.hear(id, from);
            break;
        case Kind::added:
            directory.add(id);
            break;
        case Kind::removed:
            directory.remove(id);
            break;
        default: { // migrating
            owned.receive(id, Object<Dim, T>::read(from));
            const std::span<const std::byte> bytes = from.bytes(static_cast<std::size_t>(from.take_short()));
            const auto& kept = coming.payloads.emplace_back(bytes.begin(), bytes.end());
            coming.arrived.push_back({id, kept});
        }
        }
    }
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::hear_pairs(std::span<const std::byte> message)
{
    Reader from(message);
    while (!from.empty()) {
        const auto kind = static_cast<Kind>(from.take<std::uint8_t>());
        if (kind == Kind::end) return;
        const std::uint64_t a = from.take_id(), b = a + from.take_short();
        if (kind == Kind::ended) {
            coming.ended_out_of_order.push_back({a, b, static_cast<EndReason>(from.take<std::uint8_t>())});
            continue;
        }
        auto& list = (kind == Kind::began ? coming.began : coming.persisted).told;
        const Aabb<Dim, T> bounds_a = owned.bounds(*owned.find(a), margin);
        const Aabb<Dim, T> bounds_b = from.box_near(bounds_a);
        list.push_back({a, b, bounds_a, bounds_b, static_cast<int>(from.take_short())});
    }
}

template void World<2, float>::Implementation::update();
template void World<2, double>::Implementation::update();
template void World<3, float>::Implementation::update();
template void World<3, double>::Implementation::update();

} // namespace mpi
JOSTLE_NAMESPACE_END
