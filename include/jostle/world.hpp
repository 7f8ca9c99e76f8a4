// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
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

/// Names an object of a World while it exists. `index` is small and dense, good for indexing your own arrays;
/// it is reused after the object is removed, with another `generation`, which is less than 2^21. Ids of two
/// worlds may be equal and can't be told apart: keep ids with their world.
struct ObjectId
{
    std::uint32_t index = ~std::uint32_t{0};
    std::uint32_t generation = 0; ///< 0 names nothing
    friend constexpr bool operator==(const ObjectId&, const ObjectId&) = default;
    friend constexpr auto operator<=>(const ObjectId&, const ObjectId&) = default;
};

/// Says which objects an object pairs with, as `Filter` does.
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
    std::uint64_t user_data = 0; ///< free for the user: see World::set_user_data
};

struct ObjectPair
{
    ObjectId a, b; ///< a.index < b.index
    friend constexpr bool operator==(const ObjectPair&, const ObjectPair&) = default;
};

enum class EndReason : std::uint8_t
{
    moved_apart, ///< the boxes don't touch any more
    removed,     ///< one of the objects was removed
    disabled,    ///< one of the objects was disabled
    filtered,    ///< the boxes touch, but a filter or `accept` now rejects the pair
};

struct EndedPair
{
    ObjectId a, b; ///< a.index < b.index; the id of a removed object is stale
    EndReason reason;
    friend constexpr bool operator==(const EndedPair&, const EndedPair&) = default;
};

/// Says which objects a query is about. A part left at its default filters nothing; category and mask are one
/// part.
struct ObjectQueryFilter
{
    /// Those of the asker. If both are all ones (the default), they filter nothing, and even objects with
    /// mask 0 are found. Otherwise both `mask & object.category` and `object.mask & category` must be
    /// nonzero.
    std::uint32_t category = ~std::uint32_t{0};
    std::uint32_t mask = ~std::uint32_t{0};
    std::uint32_t owner = Filter::no_owner; ///< objects with this owner don't count
    ObjectId exclude = {};                  ///< nor does this one
    /// Called last, with the number of the query (0 for a single one); see QueryFilter::accept.
    StoredFunctionRef<bool(std::uint32_t query, ObjectId id)> accept = {};
};

/// A category and mask used by queries, as in ObjectQueryFilter.
struct QueryLayer
{
    std::uint32_t category = ~std::uint32_t{0};
    std::uint32_t mask = ~std::uint32_t{0};
};

struct WorldOptions
{
    /// Null means default_executor(). It must outlive the world.
    Executor* executor = nullptr;
    /// Provides the memory. It is used from several threads at a time, so it must be synchronised.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    /// For tests and measurements. The constructor throws `Error` if it is not one of
    /// supported_instruction_sets().
    InstructionSet instruction_set = supported_instruction_sets().front();
    /// Added to every side of every box, in the boxes' units: pairs begin before boxes touch.
    double margin = 0;
    /// Up to 8 layers, for queries about a few of many objects, such as players among props: a query with the
    /// category and mask of a layer uses an index of only the objects that count. A layer costs the memory of
    /// that index and, in the first query after an update, a pass over the active objects and those that have
    /// come to rest or woken up. It changes no answer. `visit` of a region doesn't use layers.
    std::vector<QueryLayer> layers = {};
    /// Called once for each pair that would begin, and again for the pairs of an object whose filter is set;
    /// its answer holds until the pair ends. It is called inside update(), on the calling thread, in
    /// ascending order of the pairs. It may queue commands and read the world, but not update or restore it.
    /// If it throws, the update ends and the world is unchanged.
    std::function<bool(ObjectId a, ObjectId b)> accept = {};
};

/// What the last update did, and the present state. Counts don't depend on threads or instruction set, except
/// for `dropped` and `contested` if one thread removes objects that others command. Times do.
struct WorldStats
{
    std::uint64_t objects = 0;  ///< in the world
    std::uint64_t resting = 0;  ///< of these: at rest in the index, which costs nothing
    std::uint64_t active = 0;   ///< of these: changed recently, and not at rest yet
    std::uint64_t disabled = 0; ///< of these
    std::uint64_t refused = 0;  ///< pairs that `accept` has refused and that still touch

    std::uint64_t commands = 0; ///< applied by the last update
    std::uint64_t dropped = 0;  ///< of these: for objects removed before the command was applied
    /// Objects with commands from several threads. If these set the same property, only one of them counts,
    /// not necessarily the last: see Order at World.
    std::uint64_t contested = 0;
    std::uint64_t changed = 0;         ///< objects that changed since the update before
    std::uint64_t woken = 0;           ///< resting objects that became active
    std::uint64_t settled = 0;         ///< active objects that came to rest
    std::uint64_t candidates = 0;      ///< touching pairs found of which at least one box changed
    std::uint64_t false_positives = 0; ///< of these: rejected by filters
    std::uint64_t listed = 0;          ///< objects whose neighbour list was rebuilt
    std::uint64_t began = 0, persisted = 0, ended = 0;

    std::uint64_t bytes_reserved = 0; ///< all memory held after the last update

    /// Wall-clock microseconds of the last update and its stages: applying commands, finding pairs among
    /// active objects, finding pairs of active and resting objects, comparing them with those of the update
    /// before, and updating the index.
    double us_total = 0, us_apply = 0, us_active = 0, us_resting = 0, us_events = 0, us_index = 0;
};

/// What World::draw draws: boxes of objects, and lines for pairs, from centre to centre.
enum class DrawKind : std::uint8_t
{
    active,    ///< a box
    resting,   ///< a box
    disabled,  ///< a box
    began,     ///< a line
    persisted, ///< a line
    ended,     ///< a line
};

/// Keeps objects that move and rest, and the pairs between them: which began, persist and ended.
///
/// Commands between updates are *queued*, and take effect all at once in the next update(). Between two
/// updates everything that can be read stays the same, unless apply() shows what is queued.
///
/// Cost      an update is proportional to the commands, the objects that changed in it or in the two updates
///           before, and their pairs. A command takes 17 to 55 ns. Resting objects cost nothing, however
///           many. Threads that queue are never held back, so give an object only one command per update:
///           others are wasted. There is nothing to configure: no capacity, bounds, cell size or order of
///           insertion.
/// Exact     closed boxes, compared in their own coordinates; nothing is dropped or capped.
/// Threads   commands: from any number of threads, at any time, also during update() and inside callbacks.
///           Changes (update(), apply(), restore(), restore_changes(), clear() and follow()): one at a time;
///           inside callbacks of queries and of draw() they are an `Error`. Calls that use the World's
///           working memory (join() into a vector, save_base() and save_changes()): one at a time as well. A
///           second call of either kind at the same time is an `Error`, and so is any of them inside
///           WorldOptions::accept. Reading: from any number of threads, but not during a change, nor while
///           the World is moved from or assigned to.
/// Order     the result depends on what was queued, not on which thread was first. Commands of one thread (by
///           std::this_thread::get_id()) take effect in its order. If several threads set the same property
///           (box, filter, margin, enabled) of the same object for the same update, the greatest `sequence`
///           wins. Among equal sequences the values decide, not the time of the calls, even if the other
///           thread has ended before. So let one thread command an object in a tick, or give corrections a
///           greater `sequence`. WorldStats::contested counts such objects. A removal beats everything. The
///           ids that add() returns do depend on which thread calls first: if that matters, add from one
///           thread at a time.
/// Numbers   does not change the threads' floating-point mode (a PairFinder does). If the host flushes
///           denormals to zero, bounds a denormal apart may touch.
/// Errors    `Error` for stale ids and NaN or inverted boxes, naming the object and the value, from the call
///           that was given them. `std::bad_alloc`. Either leaves the world unchanged.
template <int Dim, Coordinate T>
class JOSTLE_API World : public Queries<World<Dim, T>, Dim, T, ObjectId, ObjectQueryFilter>
{
  public:
    using Box = Aabb<Dim, T>;
    using Boxes = BoxView<Dim, T>;
    using Options = ObjectOptions<T>;
    using Vector = Vec<Dim, T>;

    /// Creating a world, adding eight objects, updating it and destroying it takes some two microseconds.
    explicit World(const WorldOptions& options = {});
    /// A moved-from World may only be assigned to or destroyed.
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    // --- Commands: queued, from any thread at any time ---

    /// Adds an object. Its id is valid at once; the object exists from the next update on. To give it a
    /// displacement from the start, also call move(id, box, displacement).
    ObjectId add(const Box& box, const Options& options = {});
    /// Adds an object for each box; ids[i] becomes the id of the object with boxes[i]. `options`: one for
    /// all, or a vector, array or span with one for each.
    template <class Given = Options>
        requires std::same_as<Given, Options> || std::convertible_to<const Given&, std::span<const Options>>
    void add(const Boxes& boxes, std::span<ObjectId> ids, const Given& options = {})
    {
        if constexpr (std::same_as<Given, Options>)
            add_many(boxes, ids, {&options, 1}, false);
        else
            add_many(boxes, ids, options, true);
    }
    void remove(ObjectId id);
    void remove(std::span<const ObjectId> ids);

    /// Gives the object this box, which may have another size.
    void move(ObjectId id, const Box& box, std::uint32_t sequence = 0);
    void move(std::span<const ObjectId> ids, const Boxes& boxes, std::uint32_t sequence = 0);
    /// Gives the object this box, and announces that it will move by `displacement`. Until its next move()
    /// the object touches everything that the box meets on that path.
    void move(ObjectId id, const Box& box, const Vector& displacement, std::uint32_t sequence = 0);
    /// Gives the object's box, as it is when the command takes effect, new edge lengths about the same
    /// centre. Axes with an infinite bound don't change, nor does a displacement.
    void resize(ObjectId id, const Vector& size, std::uint32_t sequence = 0);
    /// If there is an `accept`, it is called again for the object's pairs, even if the filter is the same.
    void set_filter(ObjectId id, const ObjectFilter& filter, std::uint32_t sequence = 0);
    /// Sets the object's own margin, which is added to the world's.
    void set_margin(ObjectId id, T margin, std::uint32_t sequence = 0);
    void set_enabled(ObjectId id, bool enabled, std::uint32_t sequence = 0);
    /// For hosts that will treat a pair differently from now on: if this object's pairs, or this pair, still
    /// touch in the next update, they are in began() as if new, and in no other list. `accept` is called
    /// again for them, also for those that it refused; pairs that it refuses now are in ended(), unless it
    /// refused them before.
    void report_again(ObjectId id);
    void report_again(ObjectId a, ObjectId b);

    // --- User data: 64 bits for each object ---

    /// Takes effect at once. Any number of threads may set and read it at any time. It takes no space, in
    /// memory or snapshots, until a value other than 0 is set.
    void set_user_data(ObjectId id, std::uint64_t data);
    /// Returns what was set, also for an object that the last update removed, whose id is in ended(). Costs a
    /// lookup by index, or for a removed object a search among the removed ones.
    [[nodiscard]] std::uint64_t user_data(ObjectId id) const;
    /// Sets out[i] to what was set for ids[i]; both have the same length.
    void user_data(std::span<const ObjectId> ids, std::span<std::uint64_t> out) const;

    // --- Update ---

    /// Applies what was queued before the call, and updates the lists of pairs.
    void update();
    /// Does move(ids, boxes) on this thread, with sequence 0, then update(). The boxes are read in place, but
    /// after apply() the moves are queued, and stay queued if the update fails.
    void update(std::span<const ObjectId> ids, const Boxes& boxes);
    /// Shows what was queued before the call, ahead of the next update: queries, touching(), pairs() and
    /// everything that reads an object see the new state. The lists of the last update stay, and the next
    /// update's are the same as without this call: a pair that begins and ends between two updates is in
    /// neither. `accept` isn't called: pairs that it hasn't seen yet count as touching. save() and fork() go
    /// by the last update.
    /// Costs as much as applying the commands since the last call, or, if several threads or commands with a
    /// sequence name one object, all commands since the update. The first query after it costs about as much
    /// as moving these objects in a BoxIndex. Queries skip resting objects that have moved, one by one; if
    /// these are more than an eighth, each closest_pairs() makes an index without them. If this or an update
    /// fails, the world is as the last update left it, and everything is still queued.
    void apply();

    // --- The pairs, as of the last update ---

    /// The pairs that touch now and didn't before, and the pairs that touched before and don't now. Both
    /// lists ascend by (a.index, b.index). Every pair that begins is in ended() later, with a reason. Valid
    /// until the next update.
    [[nodiscard]] std::span<const ObjectPair> began() const noexcept;
    [[nodiscard]] std::span<const EndedPair> ended() const noexcept;
    /// The pairs that touched before and still do, and of which at least one object changed. They are given
    /// by index, a < b, and ascend by (a, b). Valid until the next update.
    [[nodiscard]] const PairBuffer& persisted() const noexcept;
    /// began() by index, for `ContactFinder::find` or `process_pairs`. The first call after an update copies
    /// the pairs. Valid until the next update.
    [[nodiscard]] const PairBuffer& began_pairs() const;
    /// began() and persisted() as one list, ascending by index: all touching pairs of which at least one
    /// object changed. This is the list for `ContactFinder::find`. The first call after an update copies both
    /// into one buffer, unless no pair began. Valid until the next update.
    [[nodiscard]] const PairBuffer& changed_pairs() const;
    /// Returns all touching pairs, changed or not, by index and ascending by (a, b). It searches for them,
    /// which costs as much as a `PairFinder` on all objects.
    [[nodiscard]] PairBuffer pairs() const;
    /// Calls `visit` for the same pairs, in the same order, until it returns false. Returns false if it
    /// stopped early. Costs about one query for each object visited, and no memory for the pairs. `visit` may
    /// queue commands and read the world, but not update or restore it.
    bool pairs(FunctionRef<bool(ObjectId a, ObjectId b)> visit) const;
    /// Refills `out` with the objects that this object touches, by its pairs in pairs(), ascending by index.
    /// Costs a query about its bounds.
    void touching(ObjectId id, std::vector<ObjectId>& out) const;
    /// Calls `visitor` for them, in the order of visit(), until it returns false. Returns false if it stopped
    /// early.
    bool touching(ObjectId id, FunctionRef<bool(ObjectId id)> visitor) const;

    // --- Queries: those of Queries, about the bounds (margins and displacements included) of the objects as
    // of the last update or apply(); disabled ones don't count ---
    // Answers and orders are those of a BoxIndex whose ids are the indices of the objects' ids; the order of
    // visits of regions, and of closest pairs at distance 0, may change after a restore(). Visitors may queue
    // commands and read the world, but not update or restore it.
    // The closest pairs of this world's own objects are those that their filters allow. Touching pairs that
    // `accept` refused are left out. It isn't called for pairs that don't touch, so those that it would
    // refuse are included. Between two worlds filters don't apply.
    // The first query after an update that moved objects refreshes the index of active objects, on the
    // executor. If your executor can't nest, make that query outside of its tasks. If a twentieth of 100,000
    // objects moves, a query then costs about 1.5 times as much as in a BoxIndex of all objects; if a
    // twentieth of a million moves, some 2 times. For queries about a few of many objects, by category and
    // mask, use WorldOptions::layers.

    // --- The objects, as of the last update or apply() ---

    [[nodiscard]] std::size_t size() const noexcept;
    /// Returns a number greater than every index.
    [[nodiscard]] std::uint32_t index_end() const noexcept;
    [[nodiscard]] bool contains(ObjectId id) const noexcept;
    /// Returns the id of the object with this index; `ObjectId{}` if there is none.
    [[nodiscard]] ObjectId id(std::uint32_t index) const noexcept;
    /// Returns the smallest box around the bounds of all enabled objects, or nothing if there are none. Costs
    /// as little as a query that finds nothing.
    [[nodiscard]] std::optional<Box> bounds() const;
    /// Returns the object's box as given, without margin and displacement.
    [[nodiscard]] Box box(ObjectId id) const;
    /// Returns the bounds that are compared with those of others: margin and displacement included.
    [[nodiscard]] Box bounds(ObjectId id) const;
    [[nodiscard]] ObjectFilter filter(ObjectId id) const;
    [[nodiscard]] bool enabled(ObjectId id) const;
    /// Returns the sum of the world's margin and the object's own.
    [[nodiscard]] T margin(ObjectId id) const;

    // --- Snapshots, of the world as of the last update ---

    /// Saves the world: objects, ids, filters, which objects rest, what `accept` refused, and user data, but
    /// neither what is queued nor the lists of the last update. The bytes are the same on every machine;
    /// src/world/saved/snapshot.cpp describes their layout, and snapshot_bytes.hpp what it shares with that
    /// of changes. About 44 bytes and 60 ns an object.
    [[nodiscard]] std::vector<std::byte> save() const;
    /// Restores the saved world, with its margin; executor, memory and `accept` stay. Every later result is,
    /// byte for byte, what the saved world would have given. Queued commands are discarded, and ids of
    /// objects whose addition was still queued are given out again (by a fork, too). No command may be given
    /// during the call. A snapshot that is truncated, altered or of another kind of world or version is an
    /// `Error` that says so. Costs as much as adding all objects at once.
    void restore(std::span<const std::byte> snapshot);
    // Changes since such a snapshot, for programs that go back many times a second. Their cost is
    // proportional to what differs from it and to the active objects. Resting objects cost nothing.

    /// Returns save(), which becomes the base: from now on differences from it are recorded, in some 150
    /// bytes for each object that has changed since, until the next save_base(), restore() or clear(). To
    /// make a second world with the same base, call restore() with it, then save_base(). No user data may be
    /// set during the call. This and the two functions below use memory that the world keeps: call one at a
    /// time, or get an `Error`.
    [[nodiscard]] std::vector<std::byte> save_base();
    /// Refills `out` with the differences of this world, as of the last update, from its base: about 50 bytes
    /// and 0.1 us for each object that differs, and 8 bytes for each active one. The same base and world give
    /// the same bytes. Without a base it is an `Error`.
    void save_changes(std::vector<std::byte>& out);
    /// Restores the world that save_changes() was called for, as restore() does and with the same results
    /// afterwards, byte for byte. Both worlds must have the same base, which this one keeps. The cost is
    /// proportional to what differs between the base, that world and this one, plus 1 ns for each free index
    /// of the base (if objects of the base are gone, also for its refused pairs); the next update searches
    /// for the pairs of all active objects. Changes that are truncated, altered or of another base are an
    /// `Error` that says so. Every failure leaves the world unchanged. (After std::bad_alloc it may be as
    /// before apply(), whose commands stay queued.)
    void restore_changes(std::span<const std::byte> changes);
    /// Returns a copy of this world, without a base.
    [[nodiscard]] World fork() const;
    /// Becomes a view of `other`, to be queried while `other` is updated: every query, box(), bounds(),
    /// filter(), pairs(), touching() and draw() answers as `other` does now, with the same ids, whatever
    /// happens to `other` later. This world's previous contents are discarded and its old ids become invalid.
    /// It is an `Error` to call this while `other` is updated or restored, or is in a join() into a vector, a
    /// save_base() or a save_changes(). Several views may follow at a time.
    ///
    /// The first call costs 0.2 us an object. Later calls cost 0.05 to 0.2 us for each object that has
    /// changed since the last one (about what the updates took), 2 ns for each active object, and 50 ns for
    /// each pair that `accept` refuses. If more than a quarter of all objects has changed, or after 64
    /// updates, all objects are visited, at up to 50 ns each. A view takes as much memory as a world. A
    /// followed world keeps 4 bytes for each change since; other worlds pay nothing.
    /// A view has no lists of began and ended pairs and no user data. Commands, update() and save() are an
    /// `Error` until clear() or restore() makes it a world again. After std::bad_alloc, a view that has
    /// followed before is empty; any other world is unchanged.
    void follow(const World& other);
    /// Resets the world to its initial empty state: nothing is queued, the lists are empty, and ids start
    /// from the beginning, so earlier ids name other objects or nothing. A margin restored from a snapshot is
    /// kept. No command may be given during the call.
    void clear();

    // --- Diagnostics ---

    [[nodiscard]] const WorldStats& stats() const noexcept;
    /// Describes the world, and what the last update spent its time on, as text.
    [[nodiscard]] std::string explain() const;
    /// Calls `box` for every object, in the order of indices, and `line`, from centre to centre, for every
    /// pair of began(), persisted() and ended(), in that order. On an axis on which a box is infinite both
    /// ways, its centre is 0.
    void draw(FunctionRef<void(const Box& box, DrawKind kind)> box,
              FunctionRef<void(const Vector& from, const Vector& to, DrawKind kind)> line = {}) const;

    struct Implementation;

  private:
    friend class Queries<World, Dim, T, ObjectId, ObjectQueryFilter>;
    void add_many(const Boxes& boxes, std::span<ObjectId> ids, std::span<const Options> options,
                  bool one_each);
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
/// Allows ids as keys of std::unordered_map and std::unordered_set.
template <>
struct hash<jostle::ObjectId>
{
    [[nodiscard]] size_t operator()(const jostle::ObjectId& id) const noexcept
    {
        return hash<uint64_t>()(uint64_t{id.generation} << 32 | id.index);
    }
};
} // namespace std
