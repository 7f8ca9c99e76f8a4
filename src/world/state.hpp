// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory_resource>
#include <mutex>
#include <unordered_set>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/world.hpp"
#include "pair_finder_access.hpp"
#include "world/chunked_array.hpp"
#include "world/commands.hpp"
#include "world/filter_classes.hpp"
#include "world/ids.hpp"
#include "world/neighbourhoods.hpp"
#include "world/objects.hpp"

JOSTLE_NAMESPACE_BEGIN

/// docs/guide/world.md tells how it works. An update first works out everything that could fail, then takes
/// it over by steps that can't.
template <int Dim, Coordinate T>
struct World<Dim, T>::Implementation
{
    using Object = world::Object<Dim, T>;
    using Shape = world::Shape<Dim, T>;
    using Command = world::Command<Dim, T>;
    using Addition = world::Addition<Dim, T>;
    using Lane = world::Lane<Dim, T>;

    explicit Implementation(const WorldOptions& world_options);

    void queue(const Command& command);

    // --- An update, stage by stage ---
    void update(std::span<const ObjectId> ids, const Boxes& boxes);
    void apply(std::span<const ObjectId> ids, const Boxes& boxes);
    void search();
    void settle_events();
    void plan_rest();
    void commit() noexcept;
    void undo() noexcept;

    // Applying commands:
    void add_object(const Addition& addition);
    void apply_command(const Command& command);
    /// The object, made ready to be changed; null if the id is stale.
    Object* touch(ObjectId id);
    void set_box(Object& object, std::uint32_t index, const Box& box);
    void resize_box(Object& object, std::uint32_t index, const Box& size);
    void set_filter(Object& object, std::uint32_t index, const ObjectFilter& filter);
    Shape& shape_of(Object& object, std::uint32_t index);
    void reset(Object& object, std::uint32_t index) noexcept;
    std::size_t sorted_old_filters = 0, sorted_old_shapes = 0; // how many of them reset finds quickly
    void contest(Object& object, std::uint32_t index);
    void settle_contests(std::span<const ObjectId> ids, const Boxes& boxes, std::uint32_t own_lane);
    void drop_unchanged();

    // Searching:
    struct Side;
    Pair* classify(Pair* first, Pair* last, const Side& a, const Side& b);
    void join_resting(const Side& side, std::pmr::vector<Pair>& persisting);
    void begin_in_neighbourhoods();
    void invalidate_neighbourhoods();
    template <class Body>
    void in_runs(std::size_t count, const Body& body);
    void prefetch(std::uint32_t index) const noexcept;
    [[nodiscard]] ObjectFilter old_filter(const Object& object, std::uint32_t index) const noexcept;
    [[nodiscard]] ObjectId id_of(std::uint32_t index) const noexcept
    {
        return {index, ids.generation(index)};
    }
    [[nodiscard]] const Object& checked(ObjectId id) const;
    [[nodiscard]] std::uint64_t bytes() const;

    WorldOptions options;
    Executor* executor;
    T margin;
    world::IdTable ids;
    world::Queues<Dim, T> queues;
    PairFinder finder;

    // --- What the world is ---
    world::ChunkedArray<Object> objects;
    world::ChunkedArray<Shape> shapes; // of objects that have one
    world::FilterClasses filter_classes;
    std::pmr::vector<std::uint8_t> class_of; // objects, by index; `look` during the update that wakes it
    struct Active
    {
        std::uint32_t index;
        std::uint32_t idle; // updates since it changed
    };
    std::pmr::vector<Active> active;                // ascending
    BoxIndex<Dim, T> resting;                       // the others that are there; ids are indices
    std::pmr::unordered_set<std::uint64_t> refused; // pairs that touch and that `accept` is against
    std::uint64_t recent_work = 0;                  // bounds how many objects may settle in one update
    std::size_t alive = 0, disabled = 0;

    // --- What the last update said; the other one is being written ---
    struct Results
    {
        explicit Results(std::pmr::memory_resource* memory)
            : among_active(memory),
              with_idle(memory),
              others(memory),
              persisted(memory),
              began(memory),
              ended(memory)
        {
        }
        PairBuffer among_active, with_idle;
        std::pmr::vector<Pair> others;
        PairBuffer persisted; // all three, in this order
        std::pmr::vector<ObjectPair> began;
        std::pmr::vector<EndedPair> ended;
    };
    Results results[2];
    std::uint32_t shown = 0;
    WorldStats stats;

    // --- The update under way ---
    WorldStats next_stats;
    std::pmr::vector<std::uint32_t> changed; // ascending once commands are applied
    struct OldFilter
    {
        std::uint32_t index;
        ObjectFilter filter;
    };
    std::pmr::vector<OldFilter> old_filters, old_filter_scratch;
    struct OldShape
    {
        std::uint32_t index;
        bool had_shape;
        Shape shape;
    };
    std::pmr::vector<OldShape> old_shapes;
    std::pmr::vector<std::uint32_t> contested;
    std::pmr::vector<std::uint32_t> writer; // the lane that touched an object, where there are several
    std::uint32_t current_lane = 0;
    bool one_lane = true;

    /// What an entry of a search stands for: of an object that was and is there both or one of its places.
    enum class Entry : std::uint8_t
    {
        both,
        old_only,
        new_only
    };
    std::pmr::vector<Box> entry_boxes;
    std::pmr::vector<std::uint32_t> entry_index;
    std::pmr::vector<Entry> entry_kind;
    std::size_t changed_entries = 0; // the first ones; the rest are idle objects
    // Of the changed entries, for the join with the resting objects: both boxes, and the filter's class. NaN and
    // `look` where there is more to know.
    std::pmr::vector<Box> entry_before, entry_now;
    std::pmr::vector<std::uint8_t> entry_class;
    std::pmr::vector<std::uint8_t> entry_moves_on; // was active already
    std::pmr::vector<Pair> joined, joined_rest, joined_late;

    // Lists of what rests near objects that keep moving. Results don't depend on them.
    world::Neighbourhoods<Dim, T> hoods;
    std::uint32_t update_number = 1;
    std::pmr::vector<std::uint32_t> rested_at;     // the first update that can find it resting, by index
    bool calm = true;                              // few objects came to rest in the last update
    std::pmr::vector<index::Start<Dim, T>> starts; // of changed entries: where to search
    std::pmr::vector<std::uint32_t> entry_created; // and of when that is
    std::pmr::vector<std::uint32_t> newcomers;     // entries that need a new list
    std::pmr::vector<Box> ways, hood_bounds;
    std::pmr::vector<Pair> way_pairs;
    std::pmr::vector<std::uint32_t> hood_numbers;
    PairBuffer scratch_pairs;
    std::pmr::vector<std::uint32_t> kept_of_run;

    std::mutex found_mutex; // guards the five that follow, while tasks run
    std::pmr::vector<std::uint64_t> found_began, found_asked;
    struct Ended
    {
        std::uint64_t key;
        EndReason reason;
    };
    std::pmr::vector<Ended> found_ended, ended_scratch;
    std::uint64_t candidates = 0, false_positives = 0;
    std::pmr::vector<std::uint64_t> key_scratch;
    std::pmr::vector<std::uint32_t> index_scratch;

    std::pmr::vector<std::uint64_t> newly_refused, no_longer_refused;
    std::uint64_t recent_work_next = 0;
    std::pmr::vector<Active> next_active;
    std::pmr::vector<std::uint32_t> waking, settling;
    std::pmr::vector<Box> settling_boxes;

    // --- For questions: the active objects, indexed when the first question is asked ---
    const BoxIndex<Dim, T>* index_of_active() const; // null if there are none
    mutable std::mutex active_index_mutex;           // held while it is made
    mutable std::atomic<bool> active_index_is_fresh{false};
    mutable BoxIndex<Dim, T> active_index;
    /// Calls body with the filter in the index's terms.
    template <class Body>
    decltype(auto) filtered(const ObjectQueryFilter& filter, const Body& body) const;
};

JOSTLE_NAMESPACE_END
