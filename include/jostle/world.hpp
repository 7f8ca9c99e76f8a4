// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <limits>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/queries.hpp"
#include "jostle/query.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Names an object of a World for as long as it lives. `index` is small and dense, good for indexing the
/// user's own arrays; it is used again for another object after this one's removal, `generation` isn't, which
/// is less than 2^21. Ids of two worlds may be equal and are not told apart: keep ids with their world.
struct ObjectId
{
    std::uint32_t index = ~std::uint32_t{0};
    std::uint32_t generation = 0; ///< 0 names nothing
    friend constexpr bool operator==(const ObjectId&, const ObjectId&) = default;
    friend constexpr auto operator<=>(const ObjectId&, const ObjectId&) = default;
};

/// Says whom an object pairs with, as `Filter` does.
struct ObjectFilter
{
    std::uint32_t category = 1;
    std::uint32_t mask = ~std::uint32_t{0};
    std::uint32_t owner = Filter::no_owner; ///< objects of one owner never pair with each other
    bool is_static = false;                 ///< static objects never pair with static ones
    friend constexpr bool operator==(const ObjectFilter&, const ObjectFilter&) = default;
};

template <class T>
struct ObjectOptions
{
    ObjectFilter filter = {};
    bool enabled = true;         ///< disabled objects keep their id and their box, and touch nothing
    T margin = 0;                ///< added to `WorldOptions::margin`
    std::uint64_t user_data = 0; ///< the user's own: see World::set_user_data
};

struct ObjectPair
{
    ObjectId a, b; ///< a.index < b.index
    friend constexpr bool operator==(const ObjectPair&, const ObjectPair&) = default;
};

enum class EndReason : std::uint8_t
{
    moved_apart, ///< the boxes touch no more
    removed,     ///< one of the objects is gone
    disabled,    ///< one of the objects was disabled
    filtered,    ///< the boxes touch, but a filter or `accept` is against it now
};

struct EndedPair
{
    ObjectId a, b; ///< a.index < b.index; a removed object's id names nothing any more
    EndReason reason;
    friend constexpr bool operator==(const EndedPair&, const EndedPair&) = default;
};

/// Says which objects a query is about. A part that is left as it is filters nothing; category and mask
/// are one part.
struct ObjectQueryFilter
{
    /// The asker's own. Left at all ones they filter nothing: even an object whose mask is 0 is found. With
    /// another value in either, both `mask & object.category` and `object.mask & category` must be other than
    /// zero.
    std::uint32_t category = ~std::uint32_t{0};
    std::uint32_t mask = ~std::uint32_t{0};
    std::uint32_t owner = Filter::no_owner; ///< objects of this owner don't count
    ObjectId exclude = {};                  ///< nor does this one
    /// It is called last, with the number of the query (0 for a single one); see QueryFilter::accept.
    StoredFunctionRef<bool(std::uint32_t query, ObjectId id)> accept = {};
};

/// A category and mask that queries have, as in ObjectQueryFilter.
struct QueryLayer
{
    std::uint32_t category = ~std::uint32_t{0};
    std::uint32_t mask = ~std::uint32_t{0};
};

struct WorldOptions
{
    /// Null means default_executor(). It must outlive the world.
    Executor* executor = nullptr;
    /// Where memory comes from. Used from several threads at a time: give a synchronised resource.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    /// One of supported_instruction_sets(), or the constructor refuses it; for tests and measurements.
    InstructionSet instruction_set = supported_instruction_sets().front();
    /// Added to every side of every box, in the boxes' units: pairs begin before boxes touch.
    double margin = 0;
    /// For queries about a few of many objects, such as players among props: queries with one of these
    /// categories and masks go by indexes of the objects that count alone. Up to 8. Each costs the memory of
    /// one and, in the first query after an update, a look at what is active and what has come to rest or
    /// woken up. No answer depends on it. `visit` of a region doesn't use them.
    std::vector<QueryLayer> layers = {};
    /// Asked once about each pair that would begin, and again about the pairs of an object whose filter is
    /// set; its answer holds until the pair ends. It is called inside update(), on its thread, in ascending
    /// order of the pairs. It may queue commands and read the world, not update or restore it. What it throws
    /// ends the update and leaves the world as it was.
    std::function<bool(ObjectId a, ObjectId b)> accept = {};
};

/// Tells what the last update did, and what there is. Counts depend on neither threads nor instruction set,
/// but for `dropped` and `contested` where one thread removes what others command; times do.
struct WorldStats
{
    std::uint64_t objects = 0;  ///< in the world
    std::uint64_t resting = 0;  ///< of these: kept in the index, cost nothing
    std::uint64_t active = 0;   ///< of these: changed of late, and aren't at rest yet
    std::uint64_t disabled = 0; ///< of these
    std::uint64_t refused = 0;  ///< pairs that `accept` has refused and that still touch

    std::uint64_t commands = 0; ///< applied by the last update
    std::uint64_t dropped = 0;  ///< of these: for objects removed before the command's turn came
    /// Objects that had commands from several threads. Where these set the same property, only one of them
    /// counts, and it needn't be the last: see Order at World.
    std::uint64_t contested = 0;
    std::uint64_t changed = 0;         ///< objects that differ from the update before
    std::uint64_t woken = 0;           ///< resting objects that became active
    std::uint64_t settled = 0;         ///< active objects that came to rest
    std::uint64_t candidates = 0;      ///< pairs of touching boxes that were found, one of which changed
    std::uint64_t false_positives = 0; ///< of these: kept apart by filters
    std::uint64_t listed = 0;          ///< objects whose list of resting objects on their way was made anew
    std::uint64_t began = 0, persisted = 0, ended = 0;

    std::uint64_t bytes_reserved = 0; ///< all memory that the world held after the last update

    /// Wall-clock microseconds of the last update and its stages: applying commands, finding pairs among
    /// active objects, finding those between active and resting ones, comparing them with those of the update
    /// before, and bringing the index up to date.
    double us_total = 0, us_apply = 0, us_active = 0, us_resting = 0, us_events = 0, us_index = 0;
};

/// What a world draws, see World::draw: boxes of objects, and lines for pairs, from centre to centre.
enum class DrawKind : std::uint8_t
{
    active,    ///< a box
    resting,   ///< a box
    disabled,  ///< a box
    began,     ///< a line
    persisted, ///< a line
    ended,     ///< a line
};

/// Objects that live, move and rest, and the pairs between them: which began, persist and ended.
///
/// What callers do between updates is *queued* and takes effect, all at once, in the next update(). Between
/// two updates everything that can be read stays as it is, but where apply() shows what is queued.
///
/// Cost      an update is proportional to the commands, the objects that changed in it or in the two updates
///           before, and their pairs. A command takes 17 to 55 ns. Resting objects cost nothing, however
///           many. Threads that queue are never held back: several commands for one object and update are
///           waste. There is nothing to configure: no capacity, bounds, cell size or order of insertion.
/// Exact     closed boxes, compared in the user's own numbers; nothing is dropped or capped.
/// Threads   commands: from any number of threads, at any time, also during update() and inside callbacks.
///           Changes, which are update(), apply(), restore(), restore_changes(), clear() and follow(): one at
///           a time; inside functions given to queries and to draw() they are an `Error`. Calls that work
///           in the World's memory, which are join() into a vector, save_base() and save_changes(): one at a
///           time as well. A second one of either kind at the same time is an `Error`, and so is any of them
///           inside WorldOptions::accept. Everything that reads: from any number of threads, but not during
///           a change, nor while the World is moved from or assigned to.
/// Order     the result depends on what was queued, not on which thread was first. Commands of one thread (as
///           std::this_thread::get_id() tells them apart) take effect in its order. If several threads set
///           the same property (box, filter, margin, enabled) of the same object for the same update, the
///           greatest `sequence` wins, and of equals a fixed choice by the values: not the later call, even
///           where the other thread has ended before it. So let one thread command an object in a tick, or
///           give what corrects others a greater `sequence`. WorldStats::contested counts such objects. A
///           removal beats everything. Which ids add() hands out does depend on who asks first: where that
///           matters, add from one thread at a time.
/// Numbers   unlike a PairFinder, leaves the threads' floating-point mode alone: where the host flushes
///           denormal numbers to zero, bounds a denormal apart may touch.
/// Errors    `Error` that names the object and the value, from the call that was given it: stale ids, NaN
///           or inverted boxes. `std::bad_alloc`. Either leaves the world as it was.
template <int Dim, Coordinate T>
class JOSTLE_API World : public Queries<World<Dim, T>, Dim, T, ObjectId, ObjectQueryFilter>
{
  public:
    using Box = Aabb<Dim, T>;
    using Boxes = BoxView<Dim, T>;
    using Options = ObjectOptions<T>;
    using Vector = Vec<Dim, T>;

    /// Making a world, adding eight objects, updating it and dropping it costs some two microseconds.
    explicit World(const WorldOptions& options = {});
    /// A moved-from World may only be assigned to or destroyed.
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    // --- Commands: queued, from any thread at any time ---

    /// Adds an object. Its id is good at once; the object is there from the next update on. One that is on
    /// its way already takes a second command: move(id, box, displacement).
    ObjectId add(const Box& box, const Options& options = {});
    /// Adds an object for each box; ids[i] becomes the id of the one for boxes[i]. `options`: one for all, or
    /// a vector, array or span with one for each.
    void add(const Boxes& boxes, std::span<ObjectId> ids, const Options& options = {});
    template <class Many>
        requires std::convertible_to<const Many&, std::span<const ObjectOptions<T>>>
    void add(const Boxes& boxes, std::span<ObjectId> ids, const Many& options_of_each)
    {
        add_each(boxes, ids, options_of_each);
    }
    void remove(ObjectId id);
    void remove(std::span<const ObjectId> ids);

    /// Gives the object this box, of whatever size.
    void move(ObjectId id, const Box& box, std::uint32_t sequence = 0);
    void move(std::span<const ObjectId> ids, const Boxes& boxes, std::uint32_t sequence = 0);
    /// Gives the object this box, and says that it is about to move by `displacement`. Until its next move()
    /// the object touches everything that the box meets on its way there.
    void move(ObjectId id, const Box& box, const Vector& displacement, std::uint32_t sequence = 0);
    /// Gives the object's box, as it is when the command takes effect, new edge lengths about the same
    /// centre. A side with an infinite bound stays as it is. So does a displacement.
    void resize(ObjectId id, const Vector& size, std::uint32_t sequence = 0);
    /// If there is an `accept`, it is asked again about the object's pairs, even if the filter is the same.
    void set_filter(ObjectId id, const ObjectFilter& filter, std::uint32_t sequence = 0);
    /// Sets the object's own margin, which comes on top of the world's.
    void set_margin(ObjectId id, T margin, std::uint32_t sequence = 0);
    void set_enabled(ObjectId id, bool enabled, std::uint32_t sequence = 0);
    /// For hosts that treat a pair in another way from now on: if this object's pairs, or this pair, still
    /// touch in the next update, they are in began(), as if they were new, and in no other list. `accept`
    /// is asked about them again, also about those that it refused; pairs that it is against now are in
    /// ended(), unless it was so before.
    void report_again(ObjectId id);
    void report_again(ObjectId a, ObjectId b);

    // --- The user's own 64 bits for each object ---

    /// Takes effect at once; any number of threads may set and read, at any time. The bits take
    /// no room, in memory or snapshots, until some other than 0 are set.
    void set_user_data(ObjectId id, std::uint64_t data);
    /// Returns what was set, also for an object that the last update has removed, whose id is in ended().
    /// Costs a lookup by index; for one that was removed, a search among those.
    [[nodiscard]] std::uint64_t user_data(ObjectId id) const;
    /// out[i] becomes what was set for ids[i]; both have the same length.
    void user_data(std::span<const ObjectId> ids, std::span<std::uint64_t> out) const;

    // --- Update ---

    /// Applies what was queued before the call and finds out what that did to the pairs.
    void update();
    /// move(ids, boxes) by this thread, with sequence 0, then update(); the boxes are read in place. After
    /// apply() the moves are queued, and stay so if this fails.
    void update(std::span<const ObjectId> ids, const Boxes& boxes);
    /// Shows what was queued before the call, ahead of the next update: queries, touching(), pairs() and
    /// all that can be asked about an object see it as it will be. The lists of the last update stay, and so
    /// does what the next one will give, the same as without this call: a pair that begins and ends between
    /// two updates is in no list of theirs. `accept` isn't asked: pairs that it is still to be asked about
    /// count as touching. save() and fork() go by the last update.
    /// Costs as much as applying the commands since the last call; where several threads, or commands with a
    /// sequence, name one object, as applying all since the update. The first query after it costs about
    /// as much as moving their objects in a BoxIndex. Queries skip objects that rested and have moved, one
    /// by one; where these are more than an eighth, each closest_pairs() makes an index without them.
    /// If this or an update fails, all that was shown is taken back: the world is then as the last update
    /// left it, and everything is still queued.
    void apply();

    // --- The pairs, as of the last update ---

    /// The pairs that touch now and didn't before, and the pairs that touched before and don't now. Both
    /// lists ascend by (a.index, b.index). Every pair that began ends at some time, with a reason. Valid
    /// until the next update.
    [[nodiscard]] std::span<const ObjectPair> began() const noexcept;
    [[nodiscard]] std::span<const EndedPair> ended() const noexcept;
    /// The pairs that touched before and still do, and of which at least one object changed. They are given
    /// by index, a < b, and ascend by (a, b). Valid until the next update.
    [[nodiscard]] const PairBuffer& persisted() const noexcept;
    /// began() by index, as work on pairs takes them: `ContactFinder::find`, `process_pairs`. The first call
    /// after an update copies them. Valid until the next update.
    [[nodiscard]] const PairBuffer& began_pairs() const;
    /// began() and persisted() as one list, ascending by index: all pairs that touch and of which at least
    /// one object changed. This is the list for `ContactFinder::find`. The first call after an update copies
    /// both into one buffer, unless no pair began. Valid until the next update.
    [[nodiscard]] const PairBuffer& changed_pairs() const;
    /// All pairs that touch, changed or not, given by index and ascending by (a, b). The call searches for
    /// them, which costs as much as a `PairFinder` takes for all objects.
    [[nodiscard]] PairBuffer pairs() const;
    /// Hands the same pairs to `visit` one by one, in the same order, until it returns false. Returns false
    /// then, else true. Costs about a query for each object that it comes by, and no memory for the pairs.
    /// `visit` may queue commands and read the world, not update or restore it.
    bool pairs(FunctionRef<bool(ObjectId a, ObjectId b)> visit) const;
    /// Refills `out` with who this object touches: the others of its pairs in pairs(), ascending by index.
    /// Costs a query about its bounds.
    void touching(ObjectId id, std::vector<ObjectId>& out) const;
    /// Hands them to `visitor`, in the order of visit(), until it returns false. Returns false then, else
    /// true.
    bool touching(ObjectId id, FunctionRef<bool(ObjectId id)> visitor) const;

    // --- Queries: those of Queries, about the bounds (margins and displacements included) of the objects as
    // of the last update or apply(); disabled ones don't count ---
    // Answers and orders are those of a BoxIndex, where an id's index stands for the id; the order of visits
    // of regions, and of closest pairs at distance 0, may be another one after a restore(). Visitors may
    // queue commands and read the world, not update or restore it.
    // The closest pairs of this world's own objects are of those whose filters let them pair; pairs that
    // touch and that `accept` refused are left out. About pairs apart it hasn't been asked, so they are
    // there, also those that it would refuse. Between two worlds filters say nothing.
    // The first query after an update that moved objects brings the index of active objects up to date, on
    // the executor: with one whose tasks can't run others, ask it outside of tasks. Where a twentieth of
    // 100,000 objects moves, a query then costs about 1.5 times what it costs in a BoxIndex of all that are
    // asked for; of a million, some 2 times. Queries about a few of many objects, by category and mask, cost
    // less in a world that has a layer for them: see WorldOptions::layers.

    // --- The objects, as of the last update or apply() ---

    [[nodiscard]] std::size_t size() const noexcept;
    /// Returns a number that every index is less than.
    [[nodiscard]] std::uint32_t index_end() const noexcept;
    [[nodiscard]] bool contains(ObjectId id) const noexcept;
    /// Returns the id of the object with this index; `ObjectId{}` if there is none.
    [[nodiscard]] ObjectId id(std::uint32_t index) const noexcept;
    /// The least box around the bounds of all objects that aren't disabled; none if there is no such object.
    /// Costs as little as a query that finds nothing.
    [[nodiscard]] std::optional<Box> bounds() const;
    /// Returns the object's box as it was given, without margin and displacement.
    [[nodiscard]] Box box(ObjectId id) const;
    /// Returns the object's bounds, as they are compared with others: margin and displacement included.
    [[nodiscard]] Box bounds(ObjectId id) const;
    [[nodiscard]] ObjectFilter filter(ObjectId id) const;
    [[nodiscard]] bool enabled(ObjectId id) const;
    /// Returns the world's margin and the object's own together.
    [[nodiscard]] T margin(ObjectId id) const;

    // --- Snapshots, of the world as of the last update ---

    /// What the world is: objects, ids, filters, who rests, what `accept` refused, user data. Not what is
    /// queued, nor the lists of the last update. The same bytes on every machine; their layout: the source's
    /// src/world/saved/snapshot.cpp, and snapshot_bytes.hpp for what it has in common with that of changes.
    /// About 44 bytes and 60 ns an object.
    [[nodiscard]] std::vector<std::byte> save() const;
    /// Becomes the world that was saved, with its margin; executor, memory and `accept` stay as they are
    /// here. Every later result is, byte for byte, what that world would have given. What was queued is
    /// forgotten, and ids of objects whose addition was still queued are given out again (by a fork, too): no
    /// command may be given during the call. A snapshot that is cut short, altered or of another kind of
    /// world or version is an `Error` that says so. Costs as much as adding all objects at once.
    void restore(std::span<const std::byte> snapshot);
    // Changes since such a snapshot, for those who go back many times a second. They cost what differs from
    // it, and the active objects; what rests costs nothing, however much it is.

    /// Returns save(), which from now on is the base: what differs from it is recorded, in some 150 bytes for
    /// each object that has changed since, until the next save_base(), restore() or clear(). A second world
    /// with the same base is made by restore() of it and save_base(). No user data may be set during the
    /// call. Works in memory that the world keeps: it and the two below, one call at a time, or an `Error`.
    [[nodiscard]] std::vector<std::byte> save_base();
    /// Refills `out` with how this world, as of the last update, differs from its base: about 50 bytes and
    /// 0.1 us for each object that does, and 8 bytes for each that is active. The same bytes for the same
    /// base and world. Without a base, an `Error`.
    void save_changes(std::vector<std::byte>& out);
    /// Becomes the world that save_changes() was called for, as restore() does and with the same results
    /// afterwards, byte for byte; both worlds must have the same base, which this one keeps. Costs what
    /// differs between the base, that world and this one, and the free indices of the base, 1 ns each (where
    /// objects of the base are gone, also its pairs that are refused); the next update searches for the pairs
    /// of all active objects. Changes that are cut short, altered or of another base are an `Error` that says
    /// so; like every failure, it leaves the world as it was. (Without memory it may be as before apply(),
    /// whose commands stay queued.)
    void restore_changes(std::span<const std::byte> changes);
    /// Returns another world that is like this one, without a base.
    [[nodiscard]] World fork() const;
    /// Becomes a view of `other`, to be asked while `other` is updated: every query, box(), bounds(),
    /// filter(), pairs(), touching() and draw() answers as that of `other` does now, with the same ids,
    /// whatever becomes of `other`. What was in this world is forgotten, and ids of its own mean nothing here
    /// any more. To be called while `other` is neither updated nor restored, nor in a join() into a vector, a
    /// save_base() or a save_changes(): that is an `Error`. Several views may follow at a time.
    ///
    /// The first time it costs 0.2 us an object. Called again, it costs what has changed since the last call
    /// (0.05 to 0.2 us an object, about what the updates took), 2 ns for each active object, and 50 ns for
    /// each pair that `accept` refuses; if more than a quarter of all objects has changed, or after 64
    /// updates, all objects are looked at, which is 50 ns each at most. A view takes as much memory as a
    /// world; a world that is followed keeps 4 bytes for each change since, others pay nothing.
    /// A view has no lists of began and ended pairs, no user data; commands, update() and save() are an
    /// `Error` until clear() or restore() makes it a world again. Without memory, a view that has followed
    /// before is empty afterwards, else the world is as it was.
    void follow(const World& other);
    /// Becomes a world without objects, as it was when it was made, but for a margin that came with a
    /// snapshot: nothing is queued, no list has a pair, and ids are handed out from the first one on. So ids
    /// from before name other objects, or nothing. No command may be given during the call.
    void clear();

    // --- Seeing inside ---

    [[nodiscard]] const WorldStats& stats() const noexcept;
    /// What the world looks like and what the last update spent its time on, in words.
    [[nodiscard]] std::string explain() const;
    /// Calls `box` for every object, in the order of indices, and `line`, from middle to middle, for every
    /// pair of began(), persisted() and ended(), in that order. The middle of an axis on which a box is
    /// infinite both ways is 0.
    void draw(FunctionRef<void(const Box& box, DrawKind kind)> box,
              FunctionRef<void(const Vector& from, const Vector& to, DrawKind kind)> line = {}) const;

    struct Implementation;

  private:
    friend class Queries<World, Dim, T, ObjectId, ObjectQueryFilter>;
    void add_each(const Boxes& boxes, std::span<ObjectId> ids, std::span<const Options> options);
    std::unique_ptr<Implementation> implementation_;
};

extern template class World<2, float>;
extern template class World<2, double>;
extern template class World<3, float>;
extern template class World<3, double>;

using World2f = World<2, float>;
using World2d = World<2, double>;
using World3f = World<3, float>;
using World3d = World<3, double>;
using ObjectOptionsf = ObjectOptions<float>;

JOSTLE_NAMESPACE_END

namespace std {
/// So that ids can be keys of std::unordered_map and std::unordered_set.
template <>
struct hash<jostle::ObjectId>
{
    [[nodiscard]] size_t operator()(const jostle::ObjectId& id) const noexcept
    {
        return hash<uint64_t>()(uint64_t{id.generation} << 32 | id.index);
    }
};
} // namespace std
