// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
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
#include "jostle/query.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Names an object of a World for as long as it lives. `index` is small and dense, good for indexing the
/// user's own arrays; it is used again for another object after this one's removal, `generation` isn't. Ids
/// of two worlds may be equal and are not told apart: keep ids with their world.
struct ObjectId
{
    std::uint32_t index = ~std::uint32_t{0};
    std::uint32_t generation = 0; ///< 0 names nothing
    friend constexpr bool operator==(const ObjectId&, const ObjectId&) = default;
    friend constexpr auto operator<=>(const ObjectId&, const ObjectId&) = default;
};

/// Whom an object pairs with; as in `Filter`.
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
    bool enabled = true; ///< disabled objects keep their id and their box, and touch nothing
    T margin = 0;        ///< added to `WorldOptions::margin`
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

/// An object found along a ray or sweep or near a point.
template <Coordinate T>
struct ObjectHit
{
    ObjectId id; ///< `ObjectId{}` where there is no object
    T at = 0;    ///< as in `Hit`
    friend constexpr bool operator==(const ObjectHit&, const ObjectHit&) = default;
};

/// Which objects a question is about. What is left as it is doesn't filter.
struct ObjectQueryFilter
{
    /// The asker's own, if given: as between two objects, both masks must meet the other's category.
    std::uint32_t category = ~std::uint32_t{0};
    std::uint32_t mask = ~std::uint32_t{0};
    std::uint32_t owner = Filter::no_owner; ///< objects of this owner don't count
    ObjectId exclude = {};                  ///< nor does this one
    /// Asked last, with the number of the question (0 for a single one); see QueryFilter::accept.
    StoredFunctionRef<bool(std::uint32_t question, ObjectId id)> accept = {};
};

struct WorldOptions
{
    /// Null means default_executor(). It must outlive the world.
    Executor* executor = nullptr;
    /// Where memory comes from. Used from several threads at a time: give a synchronised resource.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    /// One of supported_instruction_sets(), or the constructor refuses it; for tests and measurements.
    InstructionSet instruction_set = supported_instruction_sets().front();
    /// Every box is this much bigger on every side: pairs begin before their boxes touch. Units of the boxes.
    double margin = 0;
    /// Asked once about each pair that would begin, and again about the pairs of an object whose filter is
    /// set; its answer holds until the pair ends. It is called inside update(), on its thread, in ascending
    /// order of the pairs. It may queue commands and read the world, not update or restore it. What it throws
    /// ends the update and leaves the world as it was.
    std::function<bool(ObjectId a, ObjectId b)> accept = {};
};

/// What the last update did, and what there is. Counts depend on neither threads nor instruction set; times
/// do.
struct WorldStats
{
    std::uint64_t objects = 0;  ///< in the world
    std::uint64_t resting = 0;  ///< of these: kept in the index, cost nothing
    std::uint64_t active = 0;   ///< of these: moved in one of the last updates
    std::uint64_t disabled = 0; ///< of these
    std::uint64_t refused = 0;  ///< pairs that `accept` has refused and that still touch

    std::uint64_t commands = 0;        ///< applied by the last update
    std::uint64_t dropped = 0;         ///< of these: for objects removed before the command's turn came
    std::uint64_t changed = 0;         ///< objects that differ from the update before
    std::uint64_t woken = 0;           ///< resting objects that became active
    std::uint64_t settled = 0;         ///< active objects that came to rest
    std::uint64_t candidates = 0;      ///< pairs of touching boxes that were found, one of which changed
    std::uint64_t false_positives = 0; ///< of these: kept apart by filters
    std::uint64_t listed = 0;          ///< objects for which what rests along their way was listed anew
    std::uint64_t began = 0, persisted = 0, ended = 0;

    std::uint64_t bytes_reserved = 0; ///< all memory that the world holds

    /// Wall-clock microseconds of the last update and its stages: applying commands, finding pairs among
    /// active objects, finding those between active and resting ones, comparing them with those of the update
    /// before, and bringing the index up to date.
    double us_total = 0, us_apply = 0, us_active = 0, us_resting = 0, us_events = 0, us_index = 0;
};

/// What a world draws of itself.
enum class DrawKind : std::uint8_t
{
    active,
    resting,
    disabled, ///< boxes
    began,
    persisted,
    ended, ///< lines from centre to centre
};

/// Objects that live, move and rest, and the pairs between them: which began, persist and ended.
///
/// What callers do between updates is *queued* and takes effect, all at once, in the next update(). Between
/// two updates everything that can be read stays as it is.
///
/// Cost      an update is proportional to the objects that changed and their pairs. Resting objects cost
///           nothing, however many. There is nothing to configure: no capacity, bounds, cell size or order of
///           insertion.
/// Exact     closed boxes, compared in the user's own numbers; nothing is dropped or capped.
/// Threads   commands: from any number of threads, at any time, also during update() and inside callbacks.
///           Everything that reads: from any number of threads, not during update(), restore or moves.
///           update(), restore(), clear() and join(), one at a time, or an `Error`; not inside `accept`
///           either. Nor update(), restore() and clear() inside the `accept` of a question or a function
///           given to draw() or pairs().
/// Order     the result depends on what was queued, not on which thread was first. Commands of one thread (as
///           std::this_thread::get_id() tells them apart) take effect in its order. If several threads set
///           the same property (box, filter, margin, enabled) of the same object for the same update, the
///           greatest `sequence` wins, and of equals a fixed choice by the values. A removal beats
///           everything. Which ids add() hands out does depend on who asks first: where that matters, add
///           from one thread at a time.
/// Numbers   unlike a PairFinder, leaves the threads' floating-point mode alone: where the host flushes
///           denormal numbers to zero, bounds a denormal apart may touch.
/// Errors    `Error` that names the object and the value, from the call that was given it: stale ids, NaN
///           or inverted boxes. `std::bad_alloc`. Either leaves the world as it was before the call.
template <int Dim, Coordinate T>
class JOSTLE_API World
{
  public:
    using Box = Aabb<Dim, T>;
    using Boxes = BoxView<Dim, T>;
    using Options = ObjectOptions<T>;
    using Vector = Vec<Dim, T>;

    explicit World(const WorldOptions& options = {});
    /// A moved-from World may only be assigned to or destroyed.
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    // --- Commands: queued, from any thread at any time ---

    /// A new object. The id is good at once; the object is there from the next update on.
    ObjectId add(const Box& box, const Options& options = {});
    /// As many as there are boxes; ids[i] becomes that of boxes[i].
    void add(const Boxes& boxes, std::span<ObjectId> ids, const Options& options = {});
    void remove(ObjectId id);
    void remove(std::span<const ObjectId> ids);

    /// The object's box is now this one, of whatever size.
    void move(ObjectId id, const Box& box, std::uint32_t sequence = 0);
    void move(std::span<const ObjectId> ids, const Boxes& boxes, std::uint32_t sequence = 0);
    /// The object's box is now this one, and during the coming step moves by `displacement`: it touches what
    /// lies on its way, until it is moved again.
    void move(ObjectId id, const Box& box, const Vector& displacement, std::uint32_t sequence = 0);
    /// The same as move; says that the places needn't be near each other.
    void teleport(ObjectId id, const Box& box, std::uint32_t sequence = 0);
    /// New edge lengths, the same centre: of the box as it is when the command takes effect. A side with an
    /// infinite bound stays as it is. So does a displacement.
    void resize(ObjectId id, const Vector& size, std::uint32_t sequence = 0);
    /// With `accept`, this has it asked again about the object's pairs, also where the filter is the same.
    void set_filter(ObjectId id, const ObjectFilter& filter, std::uint32_t sequence = 0);
    /// The object's own, which comes on top of the world's.
    void set_margin(ObjectId id, T margin, std::uint32_t sequence = 0);
    void set_enabled(ObjectId id, bool enabled, std::uint32_t sequence = 0);
    /// For hosts that have changed their mind about what a pair is to them: in the next update, the pairs of
    /// this object, or this pair, that touch now and then are in began(), as if they were new, and in no
    /// other list; `accept` is asked about them again. One that it is against now is in ended().
    void report_again(ObjectId id);
    void report_again(ObjectId a, ObjectId b);

    // --- Update ---

    /// Applies what was queued before the call and finds out what that did to the pairs.
    void update();
    /// move(ids, boxes) by this thread, with sequence 0, then update(); the boxes are read in place.
    void update(std::span<const ObjectId> ids, const Boxes& boxes);

    // --- The pairs, as of the last update ---

    /// The pairs that touch now and didn't before, and the pairs that touched before and don't now. Both
    /// lists ascend by (a.index, b.index). Every pair that began ends at some time, with a reason. Valid
    /// until the next update.
    [[nodiscard]] std::span<const ObjectPair> began() const noexcept;
    [[nodiscard]] std::span<const EndedPair> ended() const noexcept;
    /// The pairs that touched before and still do, and of which at least one object changed. They are given
    /// by index, a < b, and ascend by (a, b). Valid until the next update.
    [[nodiscard]] const PairBuffer& persisted() const noexcept;
    /// began() and persisted() as one list, ascending by index: all pairs that touch and of which at least
    /// one object changed. This is the list for `ContactFinder::find`. The first call after an update copies
    /// it together, unless no pair began. Valid until the next update.
    [[nodiscard]] const PairBuffer& changed_pairs() const;
    /// All pairs that touch, changed or not, given by index and ascending by (a, b). The call searches for
    /// them, which costs as much as a `PairFinder` takes for all objects.
    [[nodiscard]] PairBuffer pairs() const;
    /// Hands the same pairs to `visit` one by one, in the same order, until it returns false; says whether it
    /// never did. Costs about a question for each object that it comes by, and no memory for the pairs.
    /// `visit` may queue commands and read the world, not update or restore it.
    bool pairs(FunctionRef<bool(ObjectId a, ObjectId b)> visit) const;
    /// Refills `out` with who this object touches: the others of its pairs in pairs(), ascending by index.
    /// Costs a question about its bounds.
    void touching(ObjectId id, std::vector<ObjectId>& out) const;

    // --- Questions, about the bounds (margins and displacements included) of the objects as of the last
    // update; disabled ones don't count ---
    // As those of `BoxIndex`, with the same answers in the same order, an id's index standing for the id. The
    // first question after an update that moved objects brings the index of active objects up to date.

    static constexpr std::uint64_t no_limit = ~std::uint64_t{0};

    /// `Line` is Ray<Dim, T> or Sweep<Dim, T>.
    template <class Line>
    [[nodiscard]] std::optional<ObjectHit<T>> first(const Line& line,
                                                    const ObjectQueryFilter& filter = {}) const;
    bool all(const Ray<Dim, T>& ray, std::vector<ObjectHit<T>>& out, const ObjectQueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;
    bool all(const Sweep<Dim, T>& sweep, std::vector<ObjectHit<T>>& out, const ObjectQueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;
    bool all(const Box& region, std::vector<ObjectId>& out, const ObjectQueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;
    bool all(const Sphere<Dim, T>& region, std::vector<ObjectId>& out, const ObjectQueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;
    bool all(const Frustum<Dim, T>& region, std::vector<ObjectId>& out, const ObjectQueryFilter& filter = {},
             std::uint64_t max_results = no_limit) const;
    void nearest(const Nearest<Dim, T>& question, std::vector<ObjectHit<T>>& out,
                 const ObjectQueryFilter& filter = {}) const;
    /// `Question` is Ray, Sweep, Aabb, Sphere or Frustum.
    template <class Question>
    [[nodiscard]] bool any(const Question& question, const ObjectQueryFilter& filter = {}) const;
    template <class Question>
    [[nodiscard]] std::uint64_t count(const Question& question, const ObjectQueryFilter& filter = {}) const;

    /// Many at once, on the executor's threads.
    template <class Line>
    void first(std::span<const Line> lines, std::span<ObjectHit<T>> out,
               const ObjectQueryFilter& filter = {}) const;
    template <class Line>
    void all(std::span<const Line> lines, ResultLists<ObjectHit<T>>& out,
             const ObjectQueryFilter& filter = {}, std::uint64_t max_results = no_limit) const;
    template <class Region>
    void all(std::span<const Region> regions, ResultLists<ObjectId>& out,
             const ObjectQueryFilter& filter = {}, std::uint64_t max_results = no_limit) const;
    void nearest(std::span<const Nearest<Dim, T>> questions, ResultLists<ObjectHit<T>>& out,
                 const ObjectQueryFilter& filter = {}) const;
    template <class Question>
    void any(std::span<const Question> questions, std::span<bool> out,
             const ObjectQueryFilter& filter = {}) const;
    template <class Question>
    void count(std::span<const Question> questions, std::span<std::uint64_t> out,
               const ObjectQueryFilter& filter = {}) const;
    /// All pairs of one of `boxes` and an object whose bounds it touches, ascending by (a, b): a is the
    /// position in `boxes`, b the object's index. Refills `out`. Works in memory that the world keeps: like
    /// update(), one call at a time, or an `Error`.
    void join(const Boxes& boxes, std::pmr::vector<Pair>& out, const ObjectQueryFilter& filter = {});

    // --- The objects, as of the last update ---

    [[nodiscard]] std::size_t size() const noexcept;
    /// Every index is less than this.
    [[nodiscard]] std::uint32_t index_end() const noexcept;
    [[nodiscard]] bool contains(ObjectId id) const noexcept;
    /// Of the object with this index; `ObjectId{}` if there is none.
    [[nodiscard]] ObjectId id(std::uint32_t index) const noexcept;
    /// The least box around the bounds of all objects that aren't disabled; none if there is no such object.
    /// Costs as little as a question that finds nothing.
    [[nodiscard]] std::optional<Box> bounds() const;
    /// As it was given, without margin and displacement.
    [[nodiscard]] Box box(ObjectId id) const;
    /// As it is compared with others, margin and displacement included.
    [[nodiscard]] Box bounds(ObjectId id) const;
    [[nodiscard]] ObjectFilter filter(ObjectId id) const;
    [[nodiscard]] bool enabled(ObjectId id) const;
    /// The world's and the object's own together.
    [[nodiscard]] T margin(ObjectId id) const;

    // --- Snapshots, of the world as of the last update ---

    /// What the world is: objects, ids, filters, who rests, and what `accept` refused. Not what is queued,
    /// nor the lists of the last update. Version, checksum and layout: the source's src/world/snapshot.cpp;
    /// the same bytes on every machine. About 44 bytes and 60 ns an object.
    [[nodiscard]] std::vector<std::byte> save() const;
    /// Becomes the world that was saved, with its margin; executor, memory and `accept` stay as they are
    /// here. Every later result is, byte for byte, what that world would have given. What was queued is
    /// forgotten, and ids of objects whose addition was still queued are given out again (by a fork, too): no
    /// command may be given during the call. A snapshot that is cut short, altered or of
    /// another kind of world is an `Error` that says so. Costs as much as adding all objects at once.
    void restore(std::span<const std::byte> snapshot);
    /// Another world like this one.
    [[nodiscard]] World fork() const;
    /// Becomes a world without objects, as it was when it was made, but for a margin that came with a
    /// snapshot: nothing is queued, no list has a pair, and ids are handed out from the first one on. So ids
    /// from before name other objects, or nothing. No command may be given during the call.
    void clear();

    // --- Seeing inside ---

    [[nodiscard]] const WorldStats& stats() const noexcept;
    /// What the world looks like and what the last update spent its time on, in words.
    [[nodiscard]] std::string explain() const;
    /// Calls `box` for every object and `line` for every pair of the last update's lists.
    void draw(FunctionRef<void(const Box& box, DrawKind kind)> box,
              FunctionRef<void(const Vector& from, const Vector& to, DrawKind kind)> line = {}) const;

    struct Implementation;

  private:
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

JOSTLE_NAMESPACE_END
