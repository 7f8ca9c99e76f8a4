// SPDX-License-Identifier: MIT
#pragma once

// An update, stage by stage, and the last stages: who comes to rest, and taking it all over.
#include <algorithm>

#include "index/box_index_access.hpp"
#include "world/apply-inl.hpp"
#include "world/neighbours-inl.hpp"
#include "world/pairs-inl.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// Updates an object must stay as it is before it comes to rest. New objects need one only.
constexpr std::uint32_t idle_updates = 3;
// This many may come to rest in an update that has nothing else to do.
constexpr std::uint64_t least_settling = 512;

} // namespace world

/// Who will be active, and who comes to rest: no more at a time than there was work anyhow of late, so that
/// no update takes much longer than those before it.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::plan_rest()
{
    next_active.clear();
    settling.clear();
    recent_work_next = std::max<std::uint64_t>(changed.size(), recent_work - recent_work / 4);
    const std::uint64_t budget = std::max(world::least_settling, recent_work_next);
    const auto keep = [&](std::uint32_t index, std::uint32_t idle) {
        if (idle >= world::idle_updates && settling.size() < budget)
            settling.push_back(index);
        else
            next_active.push_back({index, idle});
    };
    auto one = active.begin();
    auto other = changed.begin();
    if (same_active) one = active.end(), other = changed.end(); // see commit
    while (one != active.end() || other != changed.end()) {
        if (other == changed.end() || (one != active.end() && one->index < *other)) {
            keep(one->index, std::min(one->idle + 1, world::idle_updates));
            ++one;
            continue;
        }
        const std::uint32_t index = *other++;
        if (one != active.end() && one->index == index) ++one;
        const Object object = objects[index];
        if (!object.is_there()) continue;
        const bool is_new = object.place() == world::Place::none;
        keep(index, !is_new                              ? 0
                    : object.has(world::flag::is_static) ? world::idle_updates
                                                         : world::idle_updates - 1);
    }
    next_stats.woken = waking.size();
    next_stats.settled = settling.size();

    settling_boxes.clear();
    for (const std::uint32_t index : settling)
        settling_boxes.push_back(objects[index].now());
    next_active.reserve(next_active.size() + settling.size()); // see commit
    invalidate_neighbourhoods();
    BoxIndexAccess::erase(resting, waking);
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::commit() noexcept
{
    constexpr std::uint32_t there =
        world::flag::alive | world::flag::enabled | static_cast<std::uint32_t>(world::Place::active);
    for (const std::uint32_t index : changed) {
        const Object object = objects[index];
        const world::Place place = object.place();
        if ((object.state() & (there | world::flag::place | world::flag::refiltered)) == there) {
            object.set(world::flag::transient, false); // most are, and stay what they are
            continue;
        }
        disabled -= place == world::Place::disabled;
        alive -= place != world::Place::none;
        if (place == world::Place::resting) {
            rested_at[index] = ~std::uint32_t{0};
            last_waking = update_number;
        }
        if (!object.is_there()) hoods.drop(index);
        if (!object.has(world::flag::alive)) {
            ids.release(id_of(index));
            object.set_state(0);
            continue;
        }
        if (place == world::Place::none || place == world::Place::resting ||
            object.has(world::flag::refiltered))
            class_of[index] = filter_classes.of(object.filter());
        object.set_place(object.is_there() ? world::Place::active : world::Place::disabled);
        ++alive;
        disabled += !object.is_there();
        object.set(world::flag::transient, false);
    }
    try {
        if (!settling.empty())
            BoxIndexAccess::insert(resting, settling, Boxes(std::span<const Box>(settling_boxes)));
        for (const std::uint32_t index : settling) {
            objects[index].set_place(world::Place::resting);
            rested_at[index] = update_number + 1;
            hoods.drop(index);
        }
    } catch (...) { // no memory: they may stay active as long as it takes
        next_stats.settled = 0;
        for (const std::uint32_t index : settling)
            next_active.push_back({index, world::idle_updates});
        std::sort(next_active.begin(), next_active.end(),
                  [](const Active& x, const Active& y) { return x.index < y.index; });
    }
    if (!changed.empty() || next_stats.settled != 0)
        active_index_is_fresh.store(false, std::memory_order_relaxed);
    if (same_active) {
        for (Active& each : active)
            each.idle = 0;
    } else {
        active.swap(next_active);
    }
    recent_work = recent_work_next;
    for (const std::uint64_t key : no_longer_refused)
        refused.erase(key);
    if (++update_number == ~std::uint32_t{0} - 1) { // numbers begin again
        hoods.invalidate_all();
        for (std::uint32_t& at : rested_at)
            at = at == ~std::uint32_t{0} ? at : 0;
        update_number = 1;
        last_waking = 0;
    }
    queues.forget();
    shown = 1 - shown;
    changed_pairs_are_fresh.store(false, std::memory_order_relaxed);
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::undo() noexcept
{
    for (const std::uint32_t index : changed) {
        const Object object = objects[index];
        if (object.place() == world::Place::none) {
            object.set_state(0);
            continue;
        }
        object.now() = object.before();
        object.set(world::flag::alive, true);
        object.set(world::flag::enabled, object.place() != world::Place::disabled);
    }
    for (const OldFilter& old : old_filters)
        if (objects[old.index].state() != 0) objects[old.index].set_filter(old.filter);
    for (const OldShape& old : old_shapes) {
        shapes[old.index] = old.shape;
        if (objects[old.index].state() != 0) objects[old.index].set(world::flag::has_shape, old.had_shape);
    }
    for (const std::uint32_t index : changed) {
        objects[index].set(world::flag::transient, false);
        if (objects[index].place() == world::Place::resting)
            class_of[index] = filter_classes.of(objects[index].filter());
    }
    for (const std::uint64_t key : newly_refused)
        refused.erase(key);
    hoods.invalidate_all(); // new ones left out what woke up
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::update(std::span<const ObjectId> move_ids, const Boxes& boxes)
{
    const auto t0 = world::Clock::now();
    next_stats = {};
    changed.clear();
    old_filters.clear();
    old_shapes.clear();
    contested.clear();
    newly_refused.clear();
    no_longer_refused.clear();
    queues.take();
    try {
        apply(move_ids, boxes);
        const auto t1 = world::Clock::now();
        next_stats.us_apply = world::microseconds(t0, t1);
        search();
        settle_events();
        const auto t3 = world::Clock::now();
        next_stats.us_events = world::microseconds(t1, t3) - next_stats.us_active - next_stats.us_resting;
        plan_rest();
        commit();
        const auto t4 = world::Clock::now();
        next_stats.us_index = world::microseconds(t3, t4);
        next_stats.us_total = world::microseconds(t0, t4);
    } catch (...) {
        undo();
        throw;
    }
    next_stats.objects = alive;
    next_stats.resting = resting.size();
    next_stats.active = active.size();
    next_stats.disabled = disabled;
    next_stats.refused = refused.size();
    next_stats.bytes_reserved = bytes();
    stats = next_stats;
}

JOSTLE_NAMESPACE_END
