// SPDX-License-Identifier: MIT
#pragma once

// Finding the pairs of an update, and what became of them since the last one.
//
// Two lists are merged. One has the pairs that touch now, found anew: changed objects with all others. The other
// has those that touched before, kept from the last update: pairs of two active objects or of an active and a
// resting one. What woke up has old pairs with other resting objects as well; these are searched for. Then a
// pair in both lists persists, one in the first only began, and one in the second only ended, or is of two
// objects that didn't change.
#include <algorithm>
#include <atomic>

#include "index/box_index_access.hpp"
#include "jostle/process.hpp"
#include "pair_arena.hpp"
#include "world/sort_keys.hpp"
#include "world/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// How many pairs are merged before looking whether a list has come to its end.
constexpr std::uint64_t merge_steps = 128;
// Below this many boxes all pairs are tried: a grid takes longer to choose.
constexpr std::size_t few = 24;

} // namespace world

template <int Dim, Coordinate T>
ObjectFilter World<Dim, T>::Implementation::old_filter(std::uint32_t index) const noexcept
{
    const auto object = objects[index];
    if (!object.has(world::flag::refiltered)) return object.filter();
    return std::lower_bound(old_filters.begin(), old_filters.end(), index,
                            [](const OldFilter& old, std::uint32_t wanted) { return old.index < wanted; })
        ->filter;
}

/// Makes an object one of those that are searched for.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::enter(std::uint32_t entry, std::uint32_t index)
{
    const Object object = objects[index];
    entry_boxes[entry] = object.now();
    entry_index[entry] = index;
    entry_class[entry] = class_of[index];
    entry_moves_on[entry] = object.place() == world::Place::active;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::enter_all()
{
    woken_boxes.clear();
    waking.clear();
    const auto make_room = [&](std::size_t count) {
        entry_boxes.resize(count);
        entry_index.resize(count);
        entry_class.resize(count);
        entry_moves_on.resize(count);
    };
    make_room(changed.size());
    std::atomic<bool> all_plain{true};
    const auto enter_some = [&](std::uint64_t begin, std::uint64_t end, Work) {
        constexpr std::uint32_t usual =
            world::flag::alive | world::flag::enabled | static_cast<std::uint32_t>(world::Place::active);
        bool all = true;
        for (std::uint64_t i = begin; i < end; ++i) {
            const std::uint32_t index = changed[i];
            if (i + world::fetch_ahead < end) objects[changed[i + world::fetch_ahead]].prefetch_boxes();
            all &= (objects[index].state() & (usual | world::flag::place | world::flag::refiltered)) == usual;
            enter(static_cast<std::uint32_t>(i), index);
        }
        if (!all) all_plain.store(false, std::memory_order_relaxed);
    };
    process_items(changed.size(), enter_some, {executor_for(changed.size()), world::run_length});
    auto count = static_cast<std::uint32_t>(changed.size());
    plain = all_plain;
    same_active = plain && changed.size() == active.size();
    if (!plain) {
        count = 0;
        for (const std::uint32_t index : changed) {
            const Object object = objects[index];
            if (object.place() == world::Place::resting) {
                waking.push_back(index);
                woken_boxes.push_back(object.before());
            }
            if (object.is_there()) {
                enter(count, index);
                if (object.place() == world::Place::none || object.has(world::flag::refiltered))
                    entry_class[count] = filter_classes.of(object.filter());
                ++count;
            }
            // What wakes up is still in the index, and found there; a second look sees that it is a changed one.
            if (object.place() == world::Place::resting) class_of[index] = world::FilterClasses::look;
        }
        make_room(count);
    }
    changed_entries = count;
    // Idle objects: active, but not changed this time.
    any_idle = !same_active && !active.empty();
    if (changed_entries == 0 || !any_idle) return;
    make_room(changed_entries + active.size());
    for (const Active& each : active)
        if (!objects[each.index].has(world::flag::touched)) enter(count++, each.index);
    make_room(count);
    any_idle = count != changed_entries;
}

template <int Dim, Coordinate T>
bool World<Dim, T>::Implementation::objects_pass(std::uint32_t a, std::uint32_t b) const noexcept
{
    return world::passes(objects[a].filter(), objects[b].filter());
}

template <int Dim, Coordinate T>
bool World<Dim, T>::Implementation::entries_pass(std::uint32_t a, std::uint32_t b) const noexcept
{
    const std::uint8_t class_a = entry_class[a], class_b = entry_class[b];
    if (class_a == world::FilterClasses::look || class_b == world::FilterClasses::look)
        return objects_pass(entry_index[a], entry_index[b]);
    return filter_classes.pass(class_a, class_b);
}

/// Pairs of changed objects with each other and with idle ones.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::find_among_active()
{
    std::atomic<std::uint64_t> looked_at{0}, rejected{0};
    const bool all_pass = filter_classes.all_pass();
    const auto select_from = [&](std::uint32_t first_b) {
        return [&, first_b](Pair* first, Pair* last) {
            Pair* kept = first;
            for (Pair* pair = first; pair != last; ++pair) {
                const std::uint32_t entry_b = pair->b + first_b;
                if (!all_pass && !entries_pass(pair->a, entry_b)) continue;
                const std::uint32_t a = entry_index[pair->a], b = entry_index[entry_b];
                *kept++ = {std::min(a, b), std::max(a, b)};
            }
            looked_at.fetch_add(static_cast<std::uint64_t>(last - first), std::memory_order_relaxed);
            rejected.fetch_add(static_cast<std::uint64_t>(last - kept), std::memory_order_relaxed);
            return kept;
        };
    };
    // Idle objects among themselves are known; many of them are better kept apart.
    const std::size_t idle = entry_boxes.size() - changed_entries;
    const bool together = idle <= changed_entries;
    const std::span<const Box> all(entry_boxes), moved = all.first(changed_entries);
    const std::span<const Box> first_search = together ? all : moved;
    PairBufferAccess found_pairs(found);
    const auto select = select_from(0);
    // All there are, from the first on: numbered as they are searched for.
    const bool own_numbers = all_pass && idle == 0 && entry_index.back() == entry_index.size() - 1;
    if (first_search.size() <= world::few) {
        Pair* const tried = PairBufferAccess(among_active).chunk(0, world::few * world::few / 2).data();
        Pair* end = tried;
        for (std::uint32_t i = 0; i < first_search.size(); ++i)
            for (std::uint32_t j = i + 1; j < first_search.size(); ++j)
                if (world::touch(first_search[i], first_search[j])) *end++ = {i, j};
        found_pairs.append({tried, select(tried, end)});
    } else {
        PairFinderAccess::Selection wanted;
        if (!own_numbers) wanted = select;
        PairFinderAccess::find(finder, Boxes(first_search), wanted, among_active);
        if (own_numbers) looked_at += among_active.size();
        for (const std::span<const Pair> block : among_active.blocks())
            found_pairs.append(block);
    }
    if (!together) {
        const auto select_idle = select_from(static_cast<std::uint32_t>(changed_entries));
        PairFinderAccess::find(finder, Boxes(moved), Boxes(all.subspan(changed_entries)), select_idle,
                               with_idle);
        for (const std::span<const Pair> block : with_idle.blocks())
            found_pairs.append(block);
    }
    next_stats.candidates += looked_at;
    next_stats.false_positives += rejected;
}

/// Pairs of changed and resting objects.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::find_among_resting()
{
    look_for_neighbourhoods();
    std::atomic<std::uint64_t> looked_at{0}, rejected{0};
    const bool all_pass = filter_classes.all_pass(), any_waking = !waking.empty();
    // Keeps those of the pairs of an entry and a resting object that are to be found.
    const auto select = [&](Pair* const first, const Pair* last, const auto& entry_of) {
        Pair* kept = first;
        std::uint64_t candidates = 0;
        for (const Pair* each = first; each != last; ++each) {
            const Pair pair = *each;
            const std::uint32_t entry = entry_of(pair.a), index = entry_index[entry];
            // What a list holds and has woken up since is found elsewhere, if anywhere; what wakes up in this
            // update, as a changed one.
            if (entry_created[entry] < last_waking && rested_at[pair.b] > entry_created[entry]) continue;
            bool pass = true;
            if (any_waking || !all_pass) {
                const std::uint8_t class_a = entry_class[entry], class_b = class_of[pair.b];
                if (class_b == world::FilterClasses::look) {
                    if (objects[pair.b].has(world::flag::touched)) continue;
                    pass = objects_pass(index, pair.b);
                } else if (!all_pass) {
                    pass = class_a == world::FilterClasses::look ? objects_pass(index, pair.b)
                                                                 : filter_classes.pass(class_a, class_b);
                }
            }
            ++candidates;
            if (pass) *kept++ = {std::min(index, pair.b), std::max(index, pair.b)};
        }
        const auto count = static_cast<std::uint64_t>(kept - first);
        looked_at.fetch_add(candidates, std::memory_order_relaxed);
        rejected.fetch_add(candidates - count, std::memory_order_relaxed);
        return static_cast<std::uint32_t>(count);
    };
    PairBufferAccess found_pairs(found);

    if (!lookups.empty()) {
        constexpr std::size_t per_run = 1024;
        const std::size_t runs = (lookups.size() + per_run - 1) / per_run;
        kept_of_run.resize(runs);
        key_scratch.resize(runs); // where there is room for what a run finds
        std::uint64_t room = 0;
        for (std::size_t k = 0; k < lookups.size(); ++k) {
            if (k % per_run == 0) key_scratch[k / per_run] = room;
            room += lookups[k].count * index::lanes;
        }
        Pair* const near = near_pairs.reserve(static_cast<std::size_t>(room));
        const auto touch = [&](std::uint32_t entry, std::uint32_t index) {
            return world::touch(entry_boxes[entry], objects[index].now());
        };
        process_items(lookups.size(),
                      [&](std::uint64_t begin, std::uint64_t end, Work work) {
                          Pair* const to = near + key_scratch[work.block];
                          const std::size_t count = kernels.look_up(&lookups[begin], end - begin, touch, to);
                          kept_of_run[work.block] =
                              select(to, to + count, [](std::uint32_t entry) { return entry; });
                      },
                      {executor_for(lookups.size()), per_run});
        for (std::size_t run = 0; run < runs; ++run)
            found_pairs.append({near + key_scratch[run], kept_of_run[run]});
    }

    if (!unlisted.empty()) {
        std::span<const Box> boxes = std::span<const Box>(entry_boxes).first(changed_entries);
        if (!lookups.empty() || !newcomers.empty()) { // else it is all, in order
            ways.clear();
            for (const std::uint32_t entry : unlisted)
                ways.push_back(entry_boxes[entry]);
            boxes = ways;
        }
        resting.join(Boxes(boxes), joined);
        kept_of_run.resize((joined.size() + world::run_length - 1) / world::run_length);
        process_items(joined.size(),
                      [&](std::uint64_t begin, std::uint64_t end, Work work) {
                          kept_of_run[work.block] =
                              select(joined.data() + begin, joined.data() + end,
                                     [&](std::uint32_t number) { return unlisted[number]; });
                      },
                      {executor_for(joined.size()), world::run_length});
        for (std::size_t run = 0; run < kept_of_run.size(); ++run)
            found_pairs.append({joined.data() + run * world::run_length, kept_of_run[run]});
    }
    next_stats.candidates += looked_at;
    next_stats.false_positives += rejected;
}

/// The old pairs of what woke up with what rested.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::find_old_of_woken()
{
    old_of_woken.clear();
    if (waking.empty()) return;
    resting.join(Boxes(std::span<const Box>(woken_boxes)), way_pairs);
    for (std::size_t k = 0; k < way_pairs.size(); ++k) {
        if (k + world::fetch_ahead < way_pairs.size()) prefetch(way_pairs[k + world::fetch_ahead].b);
        const std::uint32_t a = waking[way_pairs[k].a], b = way_pairs[k].b;
        if (a == b || (objects[b].has(world::flag::touched) && b < a))
            continue; // found from the other side too
        if (world::passes(old_filter(a), old_filter(b)))
            old_of_woken.push_back(world::pair_of(world::pair_key(a, b)));
    }
    world::sort_pairs(old_of_woken, pair_scratch);
}

/// The pairs that touch now, ascending, in memory of `to`.
template <int Dim, Coordinate T>
std::span<Pair> World<Dim, T>::Implementation::find_pairs(PairBuffer& to)
{
    found.clear();
    if (changed_entries != 0) {
        const auto t0 = world::Clock::now();
        find_among_active();
        const auto t1 = world::Clock::now();
        if (resting.size() != 0) find_among_resting();
        next_stats.us_active = world::microseconds(t0, t1);
        next_stats.us_resting = world::microseconds(t1, world::Clock::now());
    }
    // The counting sort goes through all objects, if in parallel; the other through the pairs several times.
    const std::uint64_t count = found.size();
    if (count >= ids.end() ||
        (count >= ids.end() / 8 && count >= 16 * world::run_length && executor->concurrency() > 1)) {
        sorter.sort(found, ids.end(), *executor, to);
        return PairBufferAccess(to).chunk(0, 0).first(to.size());
    }
    pair_sorting.clear();
    for (const std::span<const Pair> block : found.blocks())
        pair_sorting.insert(pair_sorting.end(), block.begin(), block.end());
    world::sort_pairs(pair_sorting, pair_scratch);
    const std::span<Pair> sorted = PairBufferAccess(to).chunk(0, pair_sorting.size());
    std::copy(pair_sorting.begin(), pair_sorting.end(), sorted.begin());
    return sorted.first(pair_sorting.size());
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::search()
{
    enter_all();
    Results& result = results[1 - shown];
    const std::span<Pair> now = find_pairs(result.persisted);
    find_old_of_woken();
    merge(now, result);
}

/// Compares what touches now with what did. In `result`, the pairs of `now` that persist move to the front of
/// each run; the rest of what touches now goes to `others`.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::merge(std::span<Pair> now, Results& result)
{
    const Results& last = results[shown];
    const std::span<const Pair> others(last.others), woken(old_of_woken);
    const auto blocks = [](const std::span<const Pair>& pairs) {
        return std::span<const std::span<const Pair>>(&pairs, pairs.empty() ? 0 : 1);
    };
    const bool any_refused = !refused.empty(), ask_again = options.accept != nullptr;
    const bool all_steady = !any_idle && !any_refused && !ask_again;
    // One of the two was active; if none is idle, it changed.
    const bool all_changed = !any_idle && stats.settled == 0;
    const bool nothing_else = all_steady && all_changed && plain && woken.empty();
    found_began.clear();
    found_asked.clear();
    found_ended.clear();
    found_others.clear();
    const std::size_t runs =
        std::max<std::size_t>(1, (now.size() + world::run_length - 1) / world::run_length);
    kept_of_run.resize(runs);
    // Where runs begin, looked up before any of them moves its pairs.
    key_scratch.assign(runs + 1, world::no_key);
    for (std::size_t run = 0; run < runs; ++run)
        key_scratch[run] = run == 0 ? 0 : world::key_of(now[run * world::run_length]);
    const auto merge_run = [&](std::uint64_t run, std::uint64_t, Work) {
        const std::size_t begin = run * world::run_length,
                          end = std::min(now.size(), begin + world::run_length);
        const Pair* next = now.data() + begin;
        const Pair* const stop = now.data() + end;
        Pair* kept = now.data() + begin;
        const std::uint64_t from = key_scratch[run], limit = key_scratch[run + 1];
        world::PairCursor steady(last.persisted.blocks(), from), other(blocks(others), from),
            woke(blocks(woken), from);
        const auto number = static_cast<std::uint32_t>(run);
        typename world::InRuns<std::uint64_t>::Run began(found_began, number), asked(found_asked, number);
        typename world::InRuns<Ended>::Run ended(found_ended, number);
        typename world::InRuns<Pair>::Run rest(found_others, number);
        // Where all change, nothing has to be known of a pair but which lists it is in: a loop without
        // branches, as those between what began, persists and ended can't be predicted.
        while (nothing_else && next != stop) {
            std::uint64_t steps = std::min(steady.left(), other.left());
            steps = std::min({steps, static_cast<std::uint64_t>(stop - next), world::merge_steps});
            std::uint64_t* const began_to = began.make_room(steps);
            Ended* const ended_to = ended.make_room(steps);
            Pair* const rest_to = rest.make_room(steps);
            std::size_t begin_count = 0, end_count = 0;
            const Pair *steady_at = steady.at(), *other_at = other.at();
            for (; steps != 0; --steps) {
                const Pair pair = *next;
                const std::uint64_t steady_key = world::key_of(*steady_at),
                                    other_key = world::key_of(*other_at);
                const std::uint64_t new_key = world::key_of(pair), old_key = std::min(steady_key, other_key);
                const bool is = new_key <= old_key, was = old_key <= new_key;
                *kept = pair;
                kept += is & was;
                began_to[begin_count] = new_key;
                rest_to[begin_count] = pair;
                begin_count += is & !was;
                ended_to[end_count] = {old_key, EndReason::moved_apart};
                end_count += was & !is;
                next += is;
                steady_at += was & (steady_key == old_key);
                other_at += was & (other_key == old_key);
            }
            began.take(begin_count);
            rest.take(begin_count);
            ended.take(end_count);
            steady.skip_to(steady_at);
            other.skip_to(other_at);
        }
        for (;;) {
            const std::uint64_t other_key = std::min(other.key, woke.key);
            if (all_steady) // most pairs are as they were
                for (; next != stop && world::key_of(*next) == steady.key && steady.key < other_key;
                     steady.next())
                    *kept++ = *next++;
            const std::uint64_t new_key = next != stop ? world::key_of(*next) : world::no_key;
            const std::uint64_t old_key = std::min(steady.key, other_key);
            const std::uint64_t key = std::min(new_key, old_key);
            if (key >= limit) break;
            const bool is = new_key == key, was = old_key == key;
            if (was) {
                if (steady.key == key) steady.next();
                if (other.key == key) other.next();
                if (woke.key == key) woke.next();
            }
            next += is;
            const Pair pair = world::pair_of(key);
            if (is && was) {
                if (any_idle && !either_has(pair, world::flag::touched)) {
                    rest.push(pair);
                    continue;
                }
                if (ask_again && either_has(pair, world::flag::asked)) asked.push(key);
                if (any_refused && refused.find(key) != refused.end())
                    rest.push(pair);
                else
                    *kept++ = pair;
            } else if (is) {
                began.push(key);
                rest.push(pair); // until the next update compares
            } else if (all_changed || either_has(pair, world::flag::touched)) {
                ended.push({key, plain ? EndReason::moved_apart : reason_of(pair)});
            } else if (objects[pair.a].place() == world::Place::active ||
                       objects[pair.b].place() == world::Place::active) {
                rest.push(pair);
            }
        }
        kept_of_run[run] = static_cast<std::uint32_t>(kept - (now.data() + begin));
        began.flush();
        asked.flush();
        ended.flush();
        rest.flush();
    };
    process_items(runs, merge_run, {executor_for(now.size()), 1});

    result.persisted.clear();
    PairBufferAccess persisted(result.persisted);
    persisted.reserve_blocks(runs);
    for (std::size_t run = 0; run < runs; ++run)
        persisted.append({now.data() + run * world::run_length, kept_of_run[run]});
    found_others.copy_to(result.others);
}

template <int Dim, Coordinate T>
bool World<Dim, T>::Implementation::either_has(const Pair& pair, std::uint32_t bits) const noexcept
{
    return ((objects[pair.a].state() | objects[pair.b].state()) & bits) != 0;
}

/// Of a pair that is no more.
template <int Dim, Coordinate T>
EndReason World<Dim, T>::Implementation::reason_of(const Pair& pair) const noexcept
{
    const auto a = objects[pair.a], b = objects[pair.b];
    if (!a.has(world::flag::alive) || !b.has(world::flag::alive)) return EndReason::removed;
    if (!a.has(world::flag::enabled) || !b.has(world::flag::enabled)) return EndReason::disabled;
    // With filters as they were, they would be found if they touched.
    if (!a.has(world::flag::refiltered) && !b.has(world::flag::refiltered)) return EndReason::moved_apart;
    return world::touch(a.now(), b.now()) ? EndReason::filtered : EndReason::moved_apart;
}

/// Lists the events, and asks `accept`.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::settle_events()
{
    Results& result = results[1 - shown];
    found_began.copy_to(began_keys);
    found_ended.copy_to(ended_keys);
    const auto ids_of = [&](std::uint64_t key) {
        const Pair pair = world::pair_of(key);
        return ObjectPair{id_of(pair.a), id_of(pair.b)};
    };
    const auto in_runs = [&](std::size_t count, const auto& key_at, const auto& set) {
        const auto set_some = [&](std::uint64_t begin, std::uint64_t end, Work) {
            for (std::uint64_t k = begin; k < end; ++k) {
                if (k + world::fetch_ahead < end)
                    ids.prefetch(world::pair_of(key_at(k + world::fetch_ahead)).b);
                set(k);
            }
        };
        process_items(count, set_some, {executor_for(count), world::run_length});
    };
    result.began.clear();
    if (!refused.empty()) { // the ends of refused pairs are nobody's business
        const auto is_refused = [&](const Ended& ended) {
            if (refused.find(ended.key) == refused.end()) return false;
            no_longer_refused.push_back(ended.key);
            return true;
        };
        ended_keys.erase(std::remove_if(ended_keys.begin(), ended_keys.end(), is_refused), ended_keys.end());
    }
    if (!options.accept) {
        result.began.resize(began_keys.size());
        in_runs(
            began_keys.size(), [&](std::uint64_t k) { return began_keys[k]; },
            [&](std::uint64_t k) { result.began[k] = ids_of(began_keys[k]); });
    } else {
        result.began.reserve(began_keys.size());
        found_asked.copy_to(asked_keys);
        key_scratch.clear(); // pairs that are taken back
        auto new_one = began_keys.begin();
        auto old_one = asked_keys.begin();
        while (new_one != began_keys.end() || old_one != asked_keys.end()) {
            const bool is_new =
                old_one == asked_keys.end() || (new_one != began_keys.end() && *new_one < *old_one);
            const std::uint64_t key = is_new ? *new_one++ : *old_one++;
            const ObjectPair pair = ids_of(key);
            const bool was_refused = !is_new && refused.find(key) != refused.end();
            if (options.accept(pair.a, pair.b)) {
                if (is_new || was_refused) result.began.push_back(pair);
                if (was_refused) no_longer_refused.push_back(key);
            } else if (!was_refused) {
                newly_refused.push_back(key);
                if (!refused.insert(key).second) newly_refused.pop_back();
                if (!is_new) key_scratch.push_back(key);
            }
        }
        if (!key_scratch.empty()) take_back(result);
    }
    result.ended.resize(ended_keys.size());
    in_runs(
        ended_keys.size(), [&](std::uint64_t k) { return ended_keys[k].key; },
        [&](std::uint64_t k) {
            const ObjectPair pair = ids_of(ended_keys[k].key);
            result.ended[k] = {pair.a, pair.b, ended_keys[k].reason};
        });
    next_stats.began = result.began.size();
    next_stats.ended = result.ended.size();
    next_stats.persisted = result.persisted.size();
}

/// The pairs in `key_scratch`, which seemed to persist, end because `accept` is against them now.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::take_back(Results& result)
{
    for (const std::uint64_t key : key_scratch) {
        ended_keys.push_back({key, EndReason::filtered});
        result.others.push_back(world::pair_of(key));
    }
    world::sort_by_key(ended_keys, ended_scratch, [](const Ended& ended) { return ended.key; });
    world::sort_pairs(result.others, pair_scratch);
    pair_sorting.clear();
    for (const Pair& pair : result.persisted)
        if (!std::binary_search(key_scratch.begin(), key_scratch.end(), world::key_of(pair)))
            pair_sorting.push_back(pair);
    result.persisted.clear();
    PairBufferAccess persisted(result.persisted);
    const std::span<Pair> left = persisted.chunk(0, pair_sorting.size()).first(pair_sorting.size());
    std::copy(pair_sorting.begin(), pair_sorting.end(), left.begin());
    persisted.append(left);
}

/// After a restore: the pairs that the last update would have left.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::recall_pairs()
{
    changed.clear();
    for (const Active& each : active)
        changed.push_back(each.index);
    enter_all();
    Results& result = results[shown];
    const std::span<const Pair> pairs = find_pairs(result.persisted);
    result.others.assign(pairs.begin(), pairs.end());
    result.persisted.clear();
    next_stats = {};
}

JOSTLE_NAMESPACE_END
