// SPDX-License-Identifier: MIT
#pragma once

// Which changed objects are searched for in a list of their neighbours instead of the index.
#include "pair_finder_access.hpp"
#include "world/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// With fewer resting objects the index is as quick as a list.
constexpr std::size_t worth_listing = 64;

} // namespace world

/// Finds out for which changed entries a list of neighbours will do instead of the index, and makes new lists
/// for those that have none and look as if they moved on.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::begin_in_neighbourhoods()
{
    starts.assign(changed_entries, {});
    entry_created.assign(changed_entries, ~std::uint32_t{0});
    newcomers.clear();
    ways.clear();
    if (resting.size() < world::worth_listing) return;
    // They last for some sixteen updates. All at once would make some updates much longer than others.
    const std::size_t most_new = changed_entries / 8 + 16;
    const auto begin_at = [&](std::uint32_t entry, const auto& hood) {
        if (hood.blocks == 0) return;
        starts[entry] = {hood.block, hood.blocks};
        entry_created[entry] = hood.created;
    };
    for (std::uint32_t entry = 0; entry < changed_entries; ++entry) {
        if (!entry_moves_on[entry]) continue;
        const auto* const hood = hoods.find(entry_index[entry]);
        if (hood != nullptr && hood->valid && world::holds(hood->bounds, entry_boxes[entry])) {
            begin_at(entry, *hood);
        } else if (calm && newcomers.size() < most_new) {
            newcomers.push_back(entry);
            ways.push_back(world::way_of(objects[entry_index[entry]].before(), entry_boxes[entry]));
        }
    }
    next_stats.listed = newcomers.size();
    if (newcomers.empty()) return;
    resting.join(Boxes(std::span<const Box>(ways)), way_pairs);
    auto pair = way_pairs.begin();
    for (std::uint32_t k = 0; k < newcomers.size(); ++k) {
        const auto first = pair;
        while (pair != way_pairs.end() && pair->a == k) {
            if (way_pairs.end() - pair > static_cast<std::ptrdiff_t>(world::fetch_ahead))
                prefetch(pair[world::fetch_ahead].b);
            ++pair;
        }
        auto& hood = hoods.make(entry_index[newcomers[k]], ways[k], update_number,
                                static_cast<std::size_t>(pair - first));
        std::uint32_t lane = 0;
        if (hood.blocks != 0)
            for (auto each = first; each != pair; ++each)
                if (const Object object = objects[each->b]; !object.has(world::flag::touched)) {
                    auto& block = hood.block[lane / index::lanes];
                    block.bounds.set(lane % index::lanes, object.now());
                    block.id[lane % index::lanes] = each->b;
                    ++lane;
                }
        for (; lane < hood.blocks * index::lanes; ++lane) {
            hood.block[lane / index::lanes].bounds.clear(lane % index::lanes);
            hood.block[lane / index::lanes].id[lane % index::lanes] = index::no_id;
        }
        begin_at(newcomers[k], hood);
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
