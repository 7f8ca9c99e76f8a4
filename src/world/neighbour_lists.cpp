// SPDX-License-Identifier: MIT
#include "world/neighbour_lists.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "pairs/pair_finder_access.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

// With fewer resting objects the index is as quick as a list.
constexpr std::size_t worth_listing = 64;

/// Around the way that an object takes: as far on as it would come in some updates, and a bit back.
template <int Dim, class T>
Aabb<Dim, T> way_of(const Aabb<Dim, T>& before, const Aabb<Dim, T>& now) noexcept
{
    constexpr T updates = 16;
    Aabb<Dim, T> way = now;
    for (int d = 0; d < Dim; ++d) {
        const T step = now.lo[d] - before.lo[d], size = now.hi[d] - now.lo[d];
        const T length = step < 0 ? -step : step;
        // Not so far that there would be much more around it than at it.
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
NeighbourLists<Dim, T>::~NeighbourLists()
{
    for (Listing* chunk : chunks_)
        memory_->deallocate(chunk, listings_per_chunk * sizeof(Listing), alignof(Listing));
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::prefetch_listings(Index object) const noexcept
{
    const List* const list = find(object);
    if (list == nullptr) return;
    for (std::size_t at = 0; at < list->count * sizeof(Listing); at += 64)
        jostle::prefetch(reinterpret_cast<const char*>(list->listings) + at);
}

/// Makes a list of what has been seen around the object's way, but for what leaves its place.
template <int Dim, class T>
template <class Leaves>
auto NeighbourLists<Dim, T>::fill(Index object, const Box& way, std::span<const index::Seen<Dim, T>> around,
                                  const Leaves& leaves) -> const List&
{
    List& list = make(object, way, around.size());
    if (list.count == 0) return list;
    const index::Ruler<Dim, T> ruler(way);
    std::uint32_t lane = 0;
    for (const index::Seen<Dim, T>& seen : around) {
        if (leaves(Index{seen.id})) continue;
        list.listings[lane / index::lanes].set(lane % index::lanes, ruler, seen.box, seen.id);
        ++lane;
    }
    for (; lane < list.count * index::lanes; ++lane)
        list.listings[lane / index::lanes].clear(lane % index::lanes);
    return list;
}

template <int Dim, class T>
index::Lookup<Dim> NeighbourLists<Dim, T>::lookup_in(const List& list, Entry entry, const Box& box) noexcept
{
    const index::Ruler<Dim, T> ruler(list.bounds);
    index::Lookup<Dim> lookup = {list.listings, list.count, raw(entry), {}, {}};
    for (int d = 0; d < Dim; ++d) {
        lookup.lo[d] = ruler.measure(d, box.lo[d]);
        lookup.hi[d] = ruler.measure(d, box.hi[d]);
    }
    return lookup;
}

/// Lists of an update that failed leave out what was to move or to wake up.
template <int Dim, class T>
void NeighbourLists<Dim, T>::begin_update() noexcept
{
    if (std::exchange(is_updating_, true)) invalidate_all();
}

template <int Dim, class T>
auto NeighbourLists<Dim, T>::divide(State<Dim, T>& state, const Entries<Dim, T>& entries, Arena& arena)
    -> Division
{
    begin_update();
    auto& lookups = arena.list<index::Lookup<Dim>>("entries with a list of neighbours");
    auto& unlisted = arena.list<Entry>("entries without a list of neighbours");
    auto& newcomers = arena.list<Entry>("entries that get a list of neighbours");
    auto& ways = arena.list<Box>("ways of entries that get a list of neighbours");
    auto& created = arena.take<Table<Entry, std::uint32_t>>("updates that made lists of neighbours");
    created.assign(entries.changed, update_);
    const bool worth = state.resting.size() >= worth_listing;
    // They last for some sixteen updates. All at once would make some updates much longer than others.
    const std::size_t most_new = calm_ && worth ? entries.changed / 8 + 16 : 0;
    const auto begin_in = [&](Entry entry, const List& list) {
        if (list.count == 0) {
            unlisted.push_back(entry);
            return;
        }
        created[entry] = list.created;
        lookups.push_back(lookup_in(list, entry, entries.box[entry]));
    };
    const auto ahead = [&](std::size_t e) { return entries.index[Entry{static_cast<std::uint32_t>(e)}]; };
    for (std::uint32_t e = 0; e < entries.changed; ++e) {
        if (e + 2 * fetch_ahead < entries.changed) {
            prefetch_number(ahead(e + 2 * fetch_ahead));
            prefetch(ahead(e + fetch_ahead));
        }
        const Entry entry{e};
        const Index object = entries.index[entry];
        const List* const list = worth && entries.moves_on[entry] ? find(object) : nullptr;
        if (list != nullptr && list->valid && inside(entries.box[entry], list->bounds)) {
            begin_in(entry, *list);
        } else if (entries.moves_on[entry] && newcomers.size() < most_new) {
            newcomers.push_back(entry);
            ways.push_back(way_of(state.objects[object].before(), entries.box[entry]));
        } else {
            unlisted.push_back(entry);
        }
    }
    if (newcomers.empty()) return {lookups, unlisted, created, 0};

    const bool any_rested = !entries.rested.empty();
    const auto leaves = [&](Index other) {
        return any_rested && state.classes[other] == FilterClass::look &&
               state.objects[other].has(flag::written);
    };
    BoxIndexAccess::look_around(state.resting, ways);
    for (std::size_t k = 0; k < newcomers.size(); ++k) {
        if (k + 2 < newcomers.size()) prefetch_listings(entries.index[newcomers[k + 2]]);
        if (k + 4 < newcomers.size()) prefetch(entries.index[newcomers[k + 4]]);
        if (k + 8 < newcomers.size()) prefetch_number(entries.index[newcomers[k + 8]]);
        const Index object = entries.index[newcomers[k]];
        begin_in(newcomers[k], fill(object, ways[k], BoxIndexAccess::around(state.resting, k), leaves));
    }
    return {lookups, unlisted, created, newcomers.size()};
}

/// Room for so many neighbours, in place of the list that the object had.
template <int Dim, class T>
auto NeighbourLists<Dim, T>::make(Index object, const Box& bounds, std::size_t neighbours) -> List&
{
    std::uint32_t number = list_of_[object];
    if (number == none) {
        if (free_.empty()) {
            lists_.push_back({});
            free_.reserve(lists_.capacity());
            free_.push_back(static_cast<std::uint32_t>(lists_.size() - 1));
        }
        number = free_.back();
        lists_[number] = {bounds, 0, 0, false, nullptr};
    }
    List& list = lists_[number];
    list.valid = false;
    const auto wanted = static_cast<std::uint32_t>((neighbours + index::lanes - 1) / index::lanes);
    const std::uint32_t count = wanted > most_listings ? 0 : std::max(1u, wanted);
    if (count != list.count) {
        Listing* const fresh = count != 0 ? take(count) : nullptr;
        give(list.listings, list.count);
        list.listings = fresh;
        list.count = count;
    }
    if (list_of_[object] == none) {
        free_.pop_back();
        list_of_[object] = number;
    }
    list.bounds = bounds;
    list.created = update_;
    list.valid = true;
    return list;
}

template <int Dim, class T>
auto NeighbourLists<Dim, T>::take(std::uint32_t count) -> Listing*
{
    Listing*& first = unused_[count];
    if (first != nullptr) {
        Listing* const taken = first;
        first = *reinterpret_cast<Listing**>(taken);
        return taken;
    }
    if (left_ < count) {
        chunks_.push_back(nullptr);
        try {
            chunks_.back() = static_cast<Listing*>(
                memory_->allocate(listings_per_chunk * sizeof(Listing), alignof(Listing)));
        } catch (...) {
            chunks_.pop_back();
            throw;
        }
        while (left_ > 0) { // a remnant of the last chunk
            give(fresh_, 1);
            ++fresh_;
            --left_;
        }
        fresh_ = chunks_.back();
        left_ = listings_per_chunk;
    }
    Listing* const taken = fresh_;
    fresh_ += count;
    left_ -= count;
    return taken;
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::give(Listing* listings, std::uint32_t count) noexcept
{
    if (listings == nullptr) return;
    new (listings) Listing*(unused_[count]);
    unused_[count] = listings;
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::drop(Index object) noexcept
{
    if (raw(object) >= list_of_.size() || list_of_[object] == none) return;
    List& list = lists_[list_of_[object]];
    give(list.listings, list.count);
    list = {list.bounds, 0, 0, false, nullptr};
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
    if (bounds.size() * settling.size() <= 4096) {
        for (const Box& box : settling)
            for (std::size_t number = 0; number < bounds.size(); ++number)
                if (overlaps_branchless(box, bounds[number])) lists_[numbers[number]].valid = false;
        return;
    }
    std::mutex mutex;
    const auto select = [&](Pair* first, Pair* last) {
        const std::lock_guard lock(mutex);
        for (const Pair* pair = first; pair != last; ++pair)
            lists_[numbers[pair->b]].valid = false;
        return first;
    };
    PairFinderAccess::find(finder, BoxView<Dim, T>(settling), BoxView<Dim, T>(std::span<const Box>(bounds)),
                           select, arena.take<PairBuffer>("pairs of settling objects and lists"));
}

template <int Dim, class T>
void NeighbourLists<Dim, T>::count_update() noexcept
{
    is_updating_ = false;
    if (++update_ != ~std::uint32_t{0} - 1) return;
    invalidate_all(); // numbers begin again
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
