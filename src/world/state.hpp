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

#include "engine/buffer.hpp"
#include "in_use.hpp"
#include "index/kernels/kernels.hpp"
#include "jostle/box_index.hpp"
#include "jostle/world.hpp"
#include "pair_finder_access.hpp"
#include "sort_pairs.hpp"
#include "world/chunked_array.hpp"
#include "world/commands.hpp"
#include "world/filter_classes.hpp"
#include "world/ids.hpp"
#include "world/merge.hpp"
#include "world/neighbourhoods.hpp"
#include "world/objects.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// Pairs are looked at, and boxes set, in runs of this many.
constexpr std::size_t run_length = 4096;

using Clock = std::chrono::steady_clock;
inline double microseconds(Clock::time_point from, Clock::time_point to)
{
    return std::chrono::duration<double, std::micro>(to - from).count();
}

} // namespace world

/// docs/guide/world.md tells how it works. An update first works out everything that could fail, then takes
/// it over by steps that can't.
template <int Dim, Coordinate T>
struct World<Dim, T>::Implementation
{
    using Object = world::ObjectIn<world::ObjectChunk<Dim, T>>;
    using ConstObject = world::ObjectIn<const world::ObjectChunk<Dim, T>>;
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
    /// Makes the object ready to be changed; false if the id is stale.
    bool touch(ObjectId id);
    void set_box(Object object, std::uint32_t index, const Box& box);
    void resize_box(Object object, std::uint32_t index, const Box& size);
    void set_filter(Object object, std::uint32_t index, const ObjectFilter& filter);
    Shape& shape_of(Object object, std::uint32_t index);
    void reset(Object object, std::uint32_t index) noexcept;
    std::size_t sorted_old_filters = 0, sorted_old_shapes = 0; // how many of them reset finds quickly
    void contest(Object object, std::uint32_t index);
    void settle_contests(std::span<const ObjectId> ids, const Boxes& boxes, std::uint32_t own_lane);
    void drop_unchanged();
    bool move_in_place(std::span<const ObjectId> ids, const Boxes& boxes);
    void move_one_by_one(std::span<const ObjectId> ids, const Boxes& boxes);

    // Searching:
    struct Results;
    void enter(std::uint32_t entry, std::uint32_t index);
    void enter_all();
    [[nodiscard]] bool objects_pass(std::uint32_t a, std::uint32_t b) const noexcept;
    [[nodiscard]] bool entries_pass(std::uint32_t a, std::uint32_t b) const noexcept;
    void find_among_active();
    void find_among_resting();
    void find_old_of_woken();
    std::span<Pair> find_pairs(PairBuffer& to);
    void merge(std::span<Pair> now, Results& result);
    void take_back(Results& result);
    void recall_pairs();
    [[nodiscard]] bool either_has(const Pair& pair, std::uint32_t bits) const noexcept;
    [[nodiscard]] EndReason reason_of(const Pair& pair) const noexcept;
    void look_for_neighbourhoods();
    void invalidate_neighbourhoods();
    void prefetch(std::uint32_t index) const noexcept;
    [[nodiscard]] ObjectFilter old_filter(std::uint32_t index) const noexcept;
    [[nodiscard]] ObjectId id_of(std::uint32_t index) const noexcept
    {
        return {index, ids.generation(index)};
    }
    [[nodiscard]] ConstObject checked(ObjectId id) const;
    /// With fewer than two runs a thread, waking one takes longer than it helps.
    [[nodiscard]] Executor* executor_for(std::size_t items) const noexcept
    {
        return items < 4 * world::run_length ? &serial_executor() : executor;
    }
    [[nodiscard]] std::uint64_t bytes() const;

    std::atomic<bool> in_use{false}; // by update or restore
    WorldOptions options;
    Executor* executor;
    T margin;
    world::IdTable ids;
    world::Queues<Dim, T> queues;
    PairFinder finder;

    // --- What the world is ---
    world::Objects<Dim, T> objects;
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
            : persisted(memory), others(memory), began(memory), ended(memory)
        {
        }
        // Ascending all. The first two together have all pairs that touch and agree and of which one is active.
        PairBuffer persisted;
        std::pmr::vector<Pair> others; // began, refused, or neither of the two changed
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

    // What is searched for: changed objects that are there, then idle ones.
    std::pmr::vector<Box> entry_boxes;
    std::pmr::vector<std::uint32_t> entry_index;
    std::pmr::vector<std::uint8_t> entry_class;    // of its filter
    std::pmr::vector<std::uint8_t> entry_moves_on; // was active already; of changed ones
    std::size_t changed_entries = 0;
    bool any_idle = false;
    bool plain = true;        // all that changed are active, and were, and have the filter they had
    bool same_active = false; // those that are active, and no others, changed
    PairBuffer among_active, with_idle;
    std::pmr::vector<Pair> joined;
    std::pmr::vector<std::uint32_t> kept_of_run;
    PairBuffer found; // all of these, in their memory
    PairSorter sorter;
    std::pmr::vector<Pair> pair_sorting, pair_scratch;
    std::pmr::vector<Box> woken_boxes;   // what those in `waking` were
    std::pmr::vector<Pair> old_of_woken; // ascending

    // Lists of what rests near objects that keep moving. Results don't depend on them.
    world::Neighbourhoods<Dim, T> hoods;
    std::uint32_t update_number = 1;
    std::pmr::vector<std::uint32_t> rested_at;     // the first update that can find it resting, by index
    bool calm = true;                              // few objects came to rest in the last update
    std::uint32_t last_waking = 0;                 // the last update in which any woke up
    std::pmr::vector<index::Lookup<Dim>> lookups;  // of changed entries that have a list
    std::pmr::vector<std::uint32_t> unlisted;      // the others
    std::pmr::vector<std::uint32_t> entry_created; // of changed entries: when the list was made
    engine::Buffer<Pair> near_pairs;               // what is found in the lists
    const index::Kernels<Dim, T>& kernels;
    std::pmr::vector<std::uint32_t> newcomers; // entries that need a new list
    std::pmr::vector<Box> ways, hood_bounds;
    std::pmr::vector<Pair> way_pairs;
    std::pmr::vector<std::uint32_t> hood_numbers;
    PairBuffer scratch_pairs;
    std::mutex hood_mutex;

    struct Ended
    {
        std::uint64_t key;
        EndReason reason;
    };
    world::InRuns<std::uint64_t> found_began, found_asked;
    world::InRuns<Ended> found_ended;
    world::InRuns<Pair> found_others;
    std::pmr::vector<std::uint64_t> began_keys, asked_keys, key_scratch;
    std::pmr::vector<Ended> ended_keys, ended_scratch;
    std::pmr::vector<std::uint32_t> index_scratch;

    std::pmr::vector<std::uint64_t> newly_refused, no_longer_refused;
    std::uint64_t recent_work_next = 0;
    std::pmr::vector<Active> next_active;
    std::pmr::vector<std::uint32_t> waking, settling;
    std::pmr::vector<Box> settling_boxes;

    // --- Began and persisted together, once somebody asks ---
    const PairBuffer& changed_pairs() const;
    mutable std::mutex changed_pairs_mutex;
    mutable std::atomic<bool> changed_pairs_are_fresh{false};
    mutable PairBuffer changed_pairs_list;

    // --- For questions: the active objects, indexed when the first question is asked ---
    const BoxIndex<Dim, T>* index_of_active() const; // null if there are none
    void follow_active() const;
    mutable std::mutex active_index_mutex; // held while it is made
    mutable std::atomic<bool> active_index_is_fresh{false};
    mutable BoxIndex<Dim, T> active_index;
};

JOSTLE_NAMESPACE_END
