// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "index/kernels/kernels.hpp"
#include "index/nodes/listing.hpp"
#include "jostle/find_pairs.hpp"
#include "world/objects/state.hpp"
#include "world/update/arena.hpp"
#include "world/update/entries.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Lists for objects that keep moving: each has the resting objects near the object's predicted path, with
/// quantised boxes. While the object stays on that path, it can touch only objects in the list, and searching
/// one or two listings of 16 is many times faster than searching the index. Only a cache: the results don't
/// depend on it.
template <int Dim, class T>
class NeighbourLists
{
  public:
    using Box = Aabb<Dim, T>;

    explicit NeighbourLists(std::pmr::memory_resource* memory)
        : list_of_(memory), lists_(memory), free_(memory), listings_(memory), rested_at_(memory)
    {
    }
    NeighbourLists(const NeighbourLists&) = delete;
    NeighbourLists& operator=(const NeighbourLists&) = delete;

    void make_room(std::size_t objects)
    {
        list_of_.grow(objects, none);
        rested_at_.grow(objects);
    }

    /// Which entries search their lists, and which the index.
    struct Division
    {
        // One for each changed entry, without listings if its list isn't usable; empty if no list is.
        std::span<const index::Lookup<Dim>> lookups;
        std::span<const Entry> unlisted;            // the others, which search the index
        const Table<Entry, std::uint32_t>& created; // of changed entries: the update that made the list
        std::size_t listed;                         // how many new lists were made
    };
    /// Divides the changed entries. Makes lists for some that have none and seem to keep moving, without
    /// changed objects that rested.
    [[nodiscard]] Division divide(State<Dim, T>& state, const Entries<Dim, T>& entries,
                                  const Marked& has_rested, Arena& arena);
    /// Whether an object has left its place in the index since the making of a list that may still have it.
    [[nodiscard]] bool has_left(Index object, std::uint32_t created) const noexcept
    {
        return created < last_waking_ && rested_at_[object] > created;
    }

    /// Invalidates lists that should have objects which are about to come to rest or to move at rest.
    /// `changed`: the number of changed objects.
    void invalidate(std::span<const Box> settling, std::size_t changed, PairFinder& finder, Arena& arena);
    void invalidate_all() noexcept;

    // When an update is committed:
    void note_waking(Index object) noexcept
    {
        rested_at_[object] = not_resting;
        last_waking_ = update_;
    }
    void note_settling(Index object) noexcept
    {
        rested_at_[object] = update_ + 1;
        drop(object);
    }
    void drop(Index object) noexcept;
    void count_update() noexcept;

  private:
    using Listing = index::Listing<Dim>;
    static constexpr std::uint32_t none = ~std::uint32_t{0}, not_resting = ~std::uint32_t{0};
    /// Objects with more neighbours search the index.
    static constexpr std::uint32_t most_listings = 2;

    struct List
    {
        Box bounds;
        std::uint32_t created; // the update; objects that came to rest later aren't in it
        std::uint32_t count;   // of listings; 0: there were too many neighbours
        bool valid;
    };
    struct Listings
    {
        Listing of_list[most_listings];
    };

    [[nodiscard]] const List* find(Index object) const noexcept
    {
        const std::uint32_t number = list_of_[object];
        return number == none ? nullptr : &lists_[number];
    }
    void begin_update() noexcept;
    /// What each changed entry needs, decided by several threads.
    enum class Need : std::uint8_t
    {
        list,   // it has no usable one
        lookup, // in its list
        search  // it has too many neighbours for a list
    };
    struct Needs;
    index::Lookup<Dim> lookup_in(const List& list, Entry entry, const Box& box) const noexcept;
    void look_at(const Entries<Dim, T>& entries, Entry entry, const List& list, Needs& needs) const noexcept;
    void find_needs(const State<Dim, T>& state, const Entries<Dim, T>& entries, Needs& needs) const;
    void fill(const List& list, std::span<const index::Seen<Dim, T>> around,
              const Marked& has_rested) noexcept;
    void make_lists(State<Dim, T>& state, const Entries<Dim, T>& entries, std::span<const Entry> newcomers,
                    std::span<const Box> ways, const Marked& has_rested, Needs& needs);
    void make(Index object, const Box& bounds, std::size_t neighbours);
    [[nodiscard]] Listing* listings_of(const List& list) noexcept
    {
        return listings_[static_cast<std::uint32_t>(&list - lists_.data())].of_list;
    }
    [[nodiscard]] const Listing* listings_of(const List& list) const noexcept
    {
        return listings_[static_cast<std::uint32_t>(&list - lists_.data())].of_list;
    }
    void prefetch_number(Index object) const noexcept { jostle::prefetch(&list_of_[object]); }
    void prefetch(Index object) const noexcept
    {
        if (list_of_[object] != none) jostle::prefetch(&lists_[list_of_[object]]);
    }
    void prefetch_listings(Index object) const noexcept;

    Table<Index, std::uint32_t> list_of_;
    std::pmr::vector<List> lists_;
    std::pmr::vector<std::uint32_t> free_; // of these; there is room for all
    ChunkedArray<Listings, 6> listings_;   // of each list

    std::uint32_t update_ = 1;
    std::uint32_t last_waking_ = 0;         // the last update in which any woke up
    bool is_updating_ = false;              // from the search until the commit
    bool calm_ = true;                      // few objects came to rest in the last update
    Table<Index, std::uint32_t> rested_at_; // the first update that can find it resting
};

} // namespace world
JOSTLE_NAMESPACE_END
