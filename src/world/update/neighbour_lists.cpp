// SPDX-License-Identifier: MIT
#include "world/update/neighbour_lists.hpp"

#include <algorithm>
#include <utility>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "jostle/process.hpp"
#include "pairs/pair_finder_access.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

// With fewer resting objects the index is as fast as a list.
constexpr std::size_t worth_listing = 64;

/// A box around the path of an object: as far ahead as it would move in some updates, and a bit back.
template <int Dim, class T>
Aabb<Dim, T> way_of(const Aabb<Dim, T>& before, const Aabb<Dim, T>& now) noexcept
{
    constexpr T updates = 16;
    Aabb<Dim, T> way = now;
    for (int d = 0; d < Dim; ++d) {
        const T step = now.lo[d] - before.lo[d], size = now.hi[d] - now.lo[d];
        const T length = step < 0 ? -step : step;
        // Not so far that there would be much more around the path than at the object.
        const T ahead = std::min(updates * length, size), back = std::min(length, size);
        way.lo[d] -= step < 0 ? ahead : back;
        way.hi[d] += step < 0 ? back : ahead;
        if (!(way.lo[d] <= now.lo[d] && way.hi[d] >= now.hi[d])) { // infinite sizes
            way.lo[d] = now.lo[d];
            way.hi[d] = now.hi[d];
        }
    }
    return way;
}

} // namespace

template <int Dim, class T>
void NeighbourLists<Dim, T>::prefetch_listings(Index object) const noexcept
{
    const List* const list = find(object);
    if (list == nullptr) return;
    for (std::size_t at = 0; at < list->count * sizeof(Listing); at += 64)
        jostle::prefetch(reinterpret_cast<const char*>(listings_of(*list)) + at);
}

template <int Dim, class T>
struct NeighbourLists<Dim, T>::Needs
{
    Table<Entry, Need>& of;
    std::pmr::vector<index::Lookup<Dim>>& lookups; // by entry
    Table<Entry, std::uint32_t>& created;
};

/// Of the objects seen around the path, all that don't change.
template <int Dim, class T>
void NeighbourLists<Dim, T>::fill(const List& list, std::span<const index::Seen<Dim, T>> around,
                                  const Marked& has_rested) noexcept
{
    const index::Ruler<Dim, T> ruler(list.bounds);
    Listing* const listings = listings_of(list);
    std::uint32_t lane = 0;
    for (const index::Seen<Dim, T>& seen : around) {
        if (has_rested(Index{seen.id})) continue;
        listings[lane / index::lanes].set(lane % index::lanes, ruler, seen.box, seen.id);
        ++lane;
    }
    for (; lane < list.count * index::lanes; ++lane)
        listings[lane / index::lanes].clear(lane % index::lanes);
}

template <int Dim, class T>
index::Lookup<Dim> NeighbourLists<Dim, T>::lookup_in(const List& list, Entry entry,
                                                     const Box& box) const noexcept
{
    const index::Ruler<Dim, T> ruler(list.bounds);
    index::Lookup<Dim> lookup = {listings_of(list), list.count, raw(entry), {}, {}};
    for (int d = 0; d < Dim; ++d) {
        lookup.lo[d] = ruler.measure(d, box.lo[d]);
        lookup.hi[d] = ruler.measure(d, box.hi[d]);
    }
    return lookup;
}

/// Lists of a failed update lack the objects that were to move or wake up.
template <int Dim, class T>
void NeighbourLists<Dim, T>::begin_update() noexcept
{
    if (std::exchange(is_updating_, true)) invalidate_all();
}

/// Prepares a lookup in the entry's list, which is usable.
template <int Dim, class T>
void NeighbourLists<Dim, T>::look_at(const Entries<Dim, T>& entries, Entry entry, const List& list,
                                     Needs& needs) const noexcept
{
    if (list.count == 0) {
        needs.of[entry] = Need::search;
        return;
    }
    needs.of[entry] = Need::lookup;
    needs.created[entry] = list.created;
    needs.lookups[raw(entry)] = lookup_in(list, entry, entries.box[entry]);
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::find_needs(const State<Dim, T>& state, const Entries<Dim, T>& entries,
                                        Needs& needs) const
{
    const auto look = [&](std::uint64_t begin, std::uint64_t end, Work) {
        const std::uint64_t last = entries.changed - 1;
        const auto ahead = [&](std::uint64_t e) {
            return entries.index[Entry{static_cast<std::uint32_t>(std::min(e, last))}];
        };
        for (std::uint64_t e = begin; e < end; ++e) {
            prefetch_number(ahead(e + 2 * fetch_ahead));
            prefetch(ahead(e + fetch_ahead));
            const Entry entry{static_cast<std::uint32_t>(e)};
            const List* const list = find(entries.index[entry]);
            needs.of[entry] = Need::list;
            needs.lookups[e].count = 0;
            if (list != nullptr && list->valid && inside(entries.box[entry], list->bounds))
                look_at(entries, entry, *list, needs);
        }
    };
    process_items(entries.changed, look, {state.executor_for(entries.changed), object_run});
}

template <int Dim, class T>
auto NeighbourLists<Dim, T>::divide(State<Dim, T>& state, const Entries<Dim, T>& entries,
                                    const Marked& has_rested, Arena& arena) -> Division
{
    begin_update();
    auto& unlisted = arena.list<Entry>("entries without a list of neighbours");
    auto& newcomers = arena.list<Entry>("entries that get a list of neighbours");
    auto& ways = arena.list<Box>("ways of entries that get a list of neighbours");
    Needs needs{arena.take<Table<Entry, Need>>("what entries need"),
                arena.take<std::pmr::vector<index::Lookup<Dim>>>("lookups of entries"),
                arena.take<Table<Entry, std::uint32_t>>("updates that made lists of neighbours")};
    needs.created.assign(entries.changed, update_);
    if (state.resting.size() < worth_listing) {
        for (std::uint32_t e = 0; e < entries.changed; ++e)
            unlisted.push_back(Entry{e});
        return {{}, unlisted, needs.created, 0};
    }
    needs.of.resize(entries.changed);
    needs.lookups.resize(entries.changed);
    find_needs(state, entries, needs);

    // Lists last for some sixteen updates. If all were renewed at once, some updates would take much longer
    // than others.
    const std::size_t most_new = calm_ ? entries.changed / 8 + 16 : 0;
    std::size_t listed = 0;
    for (std::uint32_t e = 0; e < entries.changed; ++e) {
        const Entry entry{e};
        if (needs.of[entry] == Need::lookup) {
            ++listed;
        } else if (needs.of[entry] == Need::list && newcomers.size() < most_new &&
                   state.objects[entries.index[entry]].place() == Place::active) {
            newcomers.push_back(entry);
            ways.push_back(way_of(state.objects[entries.index[entry]].before(), entries.box[entry]));
        } else {
            unlisted.push_back(entry);
        }
    }
    make_lists(state, entries, newcomers, ways, has_rested, needs);
    for (const Entry entry : newcomers)
        if (needs.of[entry] == Need::search) unlisted.push_back(entry);
    if (listed + newcomers.size() == 0) return {{}, unlisted, needs.created, 0};
    return {needs.lookups, unlisted, needs.created, newcomers.size()};
}

/// Makes lists of what is around these paths, for these entries.
template <int Dim, class T>
void NeighbourLists<Dim, T>::make_lists(State<Dim, T>& state, const Entries<Dim, T>& entries,
                                        std::span<const Entry> newcomers, std::span<const Box> ways,
                                        const Marked& has_rested, Needs& needs)
{
    if (newcomers.empty()) return;
    BoxIndexAccess::look_around(state.resting, ways);
    for (std::size_t k = 0; k < newcomers.size(); ++k)
        make(entries.index[newcomers[k]], ways[k], BoxIndexAccess::around(state.resting, k).size());
    const auto fill_some = [&](std::uint64_t begin, std::uint64_t end, Work) {
        for (std::uint64_t k = begin; k < end; ++k) {
            if (k + 2 < end) prefetch_listings(entries.index[newcomers[k + 2]]);
            const List& list = *find(entries.index[newcomers[k]]);
            if (list.count != 0) fill(list, BoxIndexAccess::around(state.resting, k), has_rested);
            look_at(entries, newcomers[k], list, needs);
        }
    };
    constexpr std::size_t per_run = 32; // each takes as long as many objects
    process_items(newcomers.size(), fill_some,
                  {state.executor_for(newcomers.size() * object_run / per_run), per_run});
}

/// Makes room for this many neighbours, replacing the object's old list.
template <int Dim, class T>
void NeighbourLists<Dim, T>::make(Index object, const Box& bounds, std::size_t neighbours)
{
    std::uint32_t& number = list_of_[object];
    if (number == none) {
        if (free_.empty()) {
            listings_.grow(lists_.size() + 1);
            lists_.push_back({});
            free_.reserve(lists_.capacity());
            free_.push_back(static_cast<std::uint32_t>(lists_.size() - 1));
        }
        number = free_.back();
        free_.pop_back();
    }
    const auto wanted = static_cast<std::uint32_t>((neighbours + index::lanes - 1) / index::lanes);
    lists_[number] = {bounds, update_, wanted > most_listings ? 0 : std::max(1u, wanted), true};
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::drop(Index object) noexcept
{
    if (raw(object) >= list_of_.size() || list_of_[object] == none) return;
    lists_[list_of_[object]].valid = false;
    free_.push_back(list_of_[object]);
    list_of_[object] = none;
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::invalidate_all() noexcept
{
    for (List& list : lists_)
        list.valid = false;
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::invalidate(std::span<const Box> settling, std::size_t changed,
                                        PairFinder& finder, Arena& arena)
{
    calm_ = 8 * settling.size() <= changed;
    if (settling.empty() || lists_.size() == free_.size()) return;
    if (!calm_ && settling.size() > 64) {
        invalidate_all();
        return;
    }
    auto& bounds = arena.list<Box>("bounds of lists of neighbours");
    auto& numbers = arena.list<std::uint32_t>("numbers of lists of neighbours");
    for (std::uint32_t number = 0; number < lists_.size(); ++number)
        if (lists_[number].valid) {
            bounds.push_back(lists_[number].bounds);
            numbers.push_back(number);
        }
    auto& pairs = arena.take<PairBuffer>("pairs of settling objects and lists");
    PairFinderAccess::find(finder, BoxView<Dim, T>(settling), BoxView<Dim, T>(std::span<const Box>(bounds)),
                           {}, pairs);
    for (const Pair& pair : pairs)
        lists_[numbers[pair.b]].valid = false;
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::count_update() noexcept
{
    is_updating_ = false;
    if (++update_ != ~std::uint32_t{0} - 1) return;
    invalidate_all(); // the numbers start again
    for (std::uint32_t& at : rested_at_.values())
        at = at == not_resting ? not_resting : 0;
    update_ = 1;
    last_waking_ = 0;
}

#define JOSTLE_INSTANTIATE(Dim, T) template class NeighbourLists<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
