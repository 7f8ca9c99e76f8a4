// SPDX-License-Identifier: MIT
#pragma once

// Which changed objects are searched for in a list of their neighbours instead of the index.
#include "index/box_index_access.hpp"
#include "pair_finder_access.hpp"
#include "world/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// With fewer resting objects the index is as quick as a list.
constexpr std::size_t worth_listing = 64;

} // namespace world

/// Divides the changed entries into those for which a list of neighbours will do, in `lookups`, and those that
/// the index is asked about, in `unlisted`. Makes new lists for those that have none and look as if they moved on.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::look_for_neighbourhoods()
{
    lookups.clear();
    unlisted.clear();
    newcomers.clear();
    ways.clear();
    entry_created.assign(changed_entries, update_number);
    const bool worth = resting.size() >= world::worth_listing;
    // They last for some sixteen updates. All at once would make some updates much longer than others.
    const std::size_t most_new = calm && worth ? changed_entries / 8 + 16 : 0;
    const auto begin_in = [&](std::uint32_t entry, const auto& hood) {
        if (hood.count == 0) {
            unlisted.push_back(entry);
            return;
        }
        entry_created[entry] = hood.created;
        const index::Ruler<Dim, T> ruler(hood.bounds);
        index::Lookup<Dim>& lookup = lookups.emplace_back();
        lookup = {hood.listings, hood.count, entry, {}, {}};
        for (int d = 0; d < Dim; ++d) {
            lookup.lo[d] = ruler.measure(d, entry_boxes[entry].lo[d]);
            lookup.hi[d] = ruler.measure(d, entry_boxes[entry].hi[d]);
        }
    };
    for (std::uint32_t entry = 0; entry < changed_entries; ++entry) {
        if (entry + 2 * world::fetch_ahead < changed_entries) {
            hoods.prefetch_number(entry_index[entry + 2 * world::fetch_ahead]);
            hoods.prefetch(entry_index[entry + world::fetch_ahead]);
        }
        const auto* const hood = worth && entry_moves_on[entry] ? hoods.find(entry_index[entry]) : nullptr;
        if (hood != nullptr && hood->valid && world::holds(hood->bounds, entry_boxes[entry])) {
            begin_in(entry, *hood);
        } else if (entry_moves_on[entry] && newcomers.size() < most_new) {
            newcomers.push_back(entry);
            ways.push_back(world::way_of(objects[entry_index[entry]].before(), entry_boxes[entry]));
        } else {
            unlisted.push_back(entry);
        }
    }
    next_stats.listed = newcomers.size();
    if (newcomers.empty()) return;
    const bool any_waking = !waking.empty();
    BoxIndexAccess::look_around(resting, Boxes(std::span<const Box>(ways)));
    for (std::uint32_t k = 0; k < newcomers.size(); ++k) {
        if (k + 2 < newcomers.size()) hoods.prefetch_listings(entry_index[newcomers[k + 2]]);
        if (k + 4 < newcomers.size()) hoods.prefetch(entry_index[newcomers[k + 4]]);
        if (k + 8 < newcomers.size()) hoods.prefetch_number(entry_index[newcomers[k + 8]]);
        const auto around = BoxIndexAccess::around(resting, k);
        auto& hood = hoods.make(entry_index[newcomers[k]], ways[k], update_number, around.size());
        const index::Ruler<Dim, T> ruler(ways[k]);
        std::uint32_t lane = 0;
        if (hood.count != 0)
            for (const index::Seen<Dim, T>& seen : around) {
                if (any_waking && class_of[seen.id] == world::FilterClasses::look &&
                    objects[seen.id].has(world::flag::touched))
                    continue; // wakes up
                hood.listings[lane / index::lanes].set(lane % index::lanes, ruler, seen.box, seen.id);
                ++lane;
            }
        for (; lane < hood.count * index::lanes; ++lane)
            hood.listings[lane / index::lanes].clear(lane % index::lanes);
        begin_in(newcomers[k], hood);
    }
}

/// Lists that the objects about to settle belong into are of no more use.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::invalidate_neighbourhoods()
{
    calm = 8 * settling.size() <= changed.size();
    if (settling.empty() || hoods.size() == 0) return;
    if (!calm && settling.size() > 64) {
        hoods.invalidate_all();
        return;
    }
    hood_bounds.clear();
    hood_numbers.clear();
    auto& all = hoods.all();
    for (std::uint32_t h = 0; h < all.size(); ++h)
        if (all[h].valid) {
            hood_bounds.push_back(all[h].bounds);
            hood_numbers.push_back(h);
        }
    if (hood_bounds.size() * settling.size() <= 4096) {
        for (const Box& box : settling_boxes)
            for (std::size_t h = 0; h < hood_bounds.size(); ++h)
                if (world::touch(box, hood_bounds[h])) all[hood_numbers[h]].valid = false;
        return;
    }
    const auto select = [&](Pair* first, Pair* last) {
        const std::lock_guard lock(hood_mutex);
        for (const Pair* pair = first; pair != last; ++pair)
            all[hood_numbers[pair->b]].valid = false;
        return first;
    };
    PairFinderAccess::find(finder, Boxes(std::span<const Box>(settling_boxes)),
                           Boxes(std::span<const Box>(hood_bounds)), select, scratch_pairs);
}

JOSTLE_NAMESPACE_END
