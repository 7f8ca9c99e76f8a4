// SPDX-License-Identifier: MIT
#pragma once

// MPI's C++ bindings were removed from the standard in 2012; some mpi.h still bring them.
#ifndef OMPI_SKIP_MPICXX
#define OMPI_SKIP_MPICXX
#endif
#ifndef MPICH_SKIP_MPICXX
#define MPICH_SKIP_MPICXX
#endif
#include <mpi.h>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/queries.hpp"
#include "jostle/version.hpp"
#include "jostle/world.hpp"

JOSTLE_NAMESPACE_BEGIN

/// One scene over many machines, or many processes of one: target `jostle::mpi`, docs/guide/distributed.md.
namespace mpi {

enum class FailureCause : std::uint8_t
{
    data,     ///< a rank was given bad data: code() and index() say more
    memory,   ///< a rank has no memory left
    callback, ///< something else was thrown, such as by the user's `pack`
};

/// What every rank throws where one of them failed: the failure of the lowest such rank, in the same words on
/// all of them, "rank 2: object 17: lo.y is NaN; ...".
class JOSTLE_API Failure : public Error
{
  public:
    Failure(int rank, FailureCause cause, ErrorCode code, const std::string& message, std::uint64_t index);
    ~Failure() override;
    [[nodiscard]] int rank() const noexcept { return rank_; }
    [[nodiscard]] FailureCause cause() const noexcept { return cause_; }

  private:
    int rank_;
    FailureCause cause_;
};

/// Two touching objects of the scene, a < b, and the bounds that were compared: margins and displacements
/// included.
template <int Dim, Coordinate T>
struct Pair
{
    std::uint64_t a, b;
    Aabb<Dim, T> bounds_a, bounds_b;
    int rank_of_b; ///< whose b is; a is this rank's
};

/// A list of pairs. Each is put together when it is read, from what its rank keeps of the two objects: most
/// programs read some of it, and writing all of it would cost as much as finding the pairs.
template <int Dim, Coordinate T>
class PairList
{
  public:
    using value_type = Pair<Dim, T>;
    /// What a rank keeps of an object that it searches.
    struct Object
    {
        std::uint64_t id;
        Aabb<Dim, T> bounds;
        int rank;
    };
    /// In place of the second object of a pair that lies among those that other ranks have told.
    static constexpr std::uint32_t told = ~std::uint32_t{0};

    class Iterator
    {
      public:
        using value_type = Pair<Dim, T>;
        using difference_type = std::ptrdiff_t;
        using reference = value_type;
        using pointer = void;
        using iterator_category = std::input_iterator_tag;

        Iterator() = default;
        Iterator(const PairList& list, std::size_t at) noexcept : list_(list), at_(at) {}
        [[nodiscard]] value_type operator*() const noexcept { return list_[at_]; }
        Iterator& operator++() noexcept
        {
            ++at_;
            return *this;
        }
        Iterator operator++(int) noexcept
        {
            Iterator before = *this;
            ++at_;
            return before;
        }
        friend bool operator==(const Iterator& a, const Iterator& b) noexcept { return a.at_ == b.at_; }

      private:
        PairList list_;
        std::size_t at_ = 0;
    };

    PairList() = default;
    /// For the library: where the objects of each pair lie.
    PairList(std::span<const jostle::Pair> places, const Object* objects,
             const value_type* told_pairs) noexcept
        : places_(places), objects_(objects), told_(told_pairs)
    {
    }

    [[nodiscard]] std::size_t size() const noexcept { return places_.size(); }
    [[nodiscard]] bool empty() const noexcept { return places_.empty(); }
    /// No check of the number.
    [[nodiscard]] value_type operator[](std::size_t i) const noexcept
    {
        const jostle::Pair place = places_[i];
        if (place.b == told) return told_[place.a];
        const Object &a = objects_[place.a], &b = objects_[place.b];
        return {a.id, b.id, a.bounds, b.bounds, b.rank};
    }
    [[nodiscard]] Iterator begin() const noexcept { return {*this, 0}; }
    [[nodiscard]] Iterator end() const noexcept { return {*this, size()}; }
    /// All of them as they are, which outlive the next update.
    [[nodiscard]] std::vector<value_type> to_vector() const
    {
        std::vector<value_type> all;
        all.reserve(size());
        for (std::size_t i = 0; i < size(); ++i)
            all.push_back((*this)[i]);
        return all;
    }

  private:
    std::span<const jostle::Pair> places_;
    const Object* objects_ = nullptr;
    const value_type* told_ = nullptr;
};

struct EndedPair
{
    std::uint64_t a, b; ///< a < b
    EndReason reason;
    friend constexpr bool operator==(const EndedPair&, const EndedPair&) = default;
};

/// An object that has come to this rank from another one.
struct Arrival
{
    std::uint64_t id;
    std::span<const std::byte> payload; ///< what `pack` wrote there
};

/// Says which objects a query is about, as ObjectQueryFilter does. A part that is left as it is filters
/// nothing.
struct QueryFilter
{
    /// The asker's own, if given: both masks must meet the other's category.
    std::uint32_t category = ~std::uint32_t{0};
    std::uint32_t mask = ~std::uint32_t{0};
    std::uint32_t owner = Filter::no_owner;    ///< objects of this owner don't count
    std::optional<std::uint64_t> exclude = {}; ///< nor does this one
};

/// The filters of a batch: one for all queries, or an array, vector or span with one for each. A view.
using Filters = detail::QueryFilters<QueryFilter>;

/// An object that a query has found.
struct Found
{
    std::uint64_t id = 0;
    int rank = -1; ///< whose it is
    friend constexpr bool operator==(const Found&, const Found&) = default;
};

/// An object found along a ray or sweep or near a point.
template <Coordinate T>
struct ObjectHit
{
    std::uint64_t id = 0;
    int rank = -1; ///< whose it is; -1 where there is no object
    T at = 0;      ///< as in `Hit`
    friend constexpr bool operator==(const ObjectHit&, const ObjectHit&) = default;
};

/// What was found for each of many queries: list i belongs to query i.
template <class Item>
class Answers
{
  public:
    [[nodiscard]] std::size_t size() const noexcept { return ends_.size(); }
    [[nodiscard]] std::span<const Item> operator[](std::size_t i) const noexcept
    {
        const std::size_t first = i == 0 ? 0 : ends_[i - 1];
        return std::span<const Item>(items_).subspan(first, ends_[i] - first);
    }
    /// Whether query i has more results than `max_results`, which list i was cut to.
    [[nodiscard]] bool more(std::size_t i) const noexcept { return more_[i] != 0; }
    /// All lists, one behind the other.
    [[nodiscard]] std::span<const Item> items() const noexcept { return items_; }

  private:
    template <int Dim, Coordinate T>
    friend class World;
    void clear() noexcept
    {
        items_.clear();
        ends_.clear();
        more_.clear();
    }
    std::vector<Item> items_;
    std::vector<std::size_t> ends_;
    std::vector<std::uint8_t> more_;
};

/// When space is repartitioned among the ranks.
enum class Rebalance : std::uint8_t
{
    automatic,  ///< when imbalance has cost more time than the last repartitioning
    on_request, ///< in the first update with objects, and after request_rebalance()
};

struct WorldOptions
{
    /// Null means default_executor(). Ranks may have different ones. It must outlive the world.
    Executor* executor = nullptr;
    /// Where memory comes from, but for MPI's own and Zoltan's. Used from several threads at a time.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    /// As jostle::WorldOptions::margin. The same on all ranks.
    double margin = 0;
    /// The same on all ranks.
    Rebalance rebalance = Rebalance::automatic;
    /// Objects go to the rank that searches their place, whenever space is repartitioned, and when they touch
    /// their rank's region no longer. Otherwise an object stays with the rank that added it; nothing else
    /// depends on it. The same on all ranks.
    bool migrate = true;
    /// As jostle::WorldOptions::layers.
    std::vector<QueryLayer> layers = {};
    /// Appends to `payload` what the user keeps with the object, which is about to go to another rank. It may
    /// be called for an update that then fails, and the object stays.
    std::function<void(std::uint64_t id, std::vector<std::byte>& payload)> pack = {};
};

/// Tells what the last update of this rank did. Counts depend on boxes, ranks and, with automatic
/// rebalancing, on time; times are wall-clock microseconds.
struct WorldStats
{
    std::uint64_t objects = 0; ///< this rank's
    std::uint64_t members = 0; ///< objects that touch the region that this rank searches
    std::uint64_t ghosts = 0;  ///< of these: other ranks'
    std::uint64_t began = 0, persisted = 0, ended = 0; ///< pairs delivered to this rank

    std::uint64_t messages = 0;       ///< sent to other ranks
    std::uint64_t bytes = 0;          ///< in them
    std::uint64_t bytes_of_boxes = 0; ///< of these: what has changed, for those who search
    std::uint64_t bytes_of_pairs = 0; ///< of these: pairs that another rank found than the one that gets them
    std::uint64_t departed = 0, arrived = 0;
    std::uint64_t partitions = 0; ///< how often space was divided since the world was made

    double us_total = 0;
    double us_stage = 0;     ///< commands, and who is told of them
    double us_partition = 0; ///< dividing space
    double us_search = 0;    ///< the update of this rank's part of the scene
    double us_pairs = 0;     ///< which pair is reported by whom, and sorting them
    double us_wait = 0;      ///< for messages and for other ranks
};

/// Tells what the last collective query of this rank did; times are wall-clock microseconds.
struct QueryStats
{
    std::uint64_t asked = 0;    ///< queries that this rank brought
    std::uint64_t answered = 0; ///< queries that it searched its part of the scene for, its own included
    std::uint64_t messages = 0; ///< sent to other ranks
    std::uint64_t bytes = 0;    ///< in them
    double us_total = 0;
    double us_wait = 0; ///< for messages and for other ranks
};

/// World over the ranks of a communicator: objects that live, move and rest, and the pairs between them.
///
/// Each object has an id of the user's choice, which no other object of the scene has, and belongs to one
/// rank: at first to the one that adds it. Space is divided into one region for each rank, by Zoltan. A
/// rank finds the pairs in its region, among all objects that touch it, also other ranks'; each pair is
/// reported once, to the owner of the object with the lower id.
///
/// Exact     the lists of all ranks, merged, are those of one jostle::World whose indices ascend as the ids
///           do: for any number of ranks and threads, wherever objects are, however often space is divided
///           anew.
/// Cost      an update costs what changed: an object that moved is sent to those other ranks whose regions
///           it touches. Objects at rest cost nothing. There are two exchanges with neighbours and two
///           reductions of some numbers in each update.
/// Giants    objects that touch many regions are kept by all of those ranks, and sent when they move.
/// Threads   MPI is called by the thread that calls; give MPI_THREAD_FUNNELED or more to MPI_Init_thread. One
///           call at a time.
/// Collective calls are those of which the comment says so: every rank makes them, in the same order.
/// Errors    commands throw nothing: one that is wrong, or finds no memory, has no effect, and the next
///           update() tells the first of these on every rank. What fails on one rank in a collective call
///           is a Failure on all, which leaves the world as it was; commands that were good stay queued. A
///           rank that hasn't even the memory for its text throws std::bad_alloc in its place. MPI's own
///           errors, and ranks that are lost, end the job.
template <int Dim, Coordinate T>
class JOSTLE_API World
{
  public:
    using Box = Aabb<Dim, T>;
    using Boxes = BoxView<Dim, T>;
    using Options = ObjectOptions<T>;
    using Vector = Vec<Dim, T>;

    /// Collective. Throws a Failure if versions, numbers or options differ between ranks.
    explicit World(MPI_Comm comm, const WorldOptions& options = {});
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    /// Collective, as MPI_Comm_free is. After MPI_Finalize it frees memory alone.
    ~World();

    // --- Commands about this rank's objects: queued until the next update. Of those that set the same
    // property of an object the last one counts ---

    /// An id that was removed can be added again after the next update. Of the options, user_data isn't kept.
    void add(std::uint64_t id, const Box& box, const Options& options = {}) noexcept;
    void add(std::span<const std::uint64_t> ids, const Boxes& boxes, const Options& options = {}) noexcept;
    void remove(std::uint64_t id) noexcept;
    void move(std::uint64_t id, const Box& box) noexcept;
    void move(std::span<const std::uint64_t> ids, const Boxes& boxes) noexcept;
    /// As jostle::World::move: until its next move() the object touches everything on its way.
    void move(std::uint64_t id, const Box& box, const Vector& displacement) noexcept;
    void set_filter(std::uint64_t id, const ObjectFilter& filter) noexcept;
    void set_margin(std::uint64_t id, T margin) noexcept;
    void set_enabled(std::uint64_t id, bool enabled) noexcept;
    /// At least one rank has to ask for a repartitioning in the next update.
    void request_rebalance() noexcept;

    // --- Update ---

    /// Collective. Applies what was queued on all ranks and finds out what that did to the pairs.
    void update();

    // --- The pairs of this rank, as of the last update. All lists ascend by (a, b), valid until the next ---

    [[nodiscard]] PairList<Dim, T> began() const noexcept;
    [[nodiscard]] std::span<const EndedPair> ended() const noexcept;
    /// Pairs that touched before and still do, and of which at least one object changed.
    [[nodiscard]] PairList<Dim, T> persisted() const noexcept;
    /// began() and persisted() as one list. The first call after an update merges them.
    [[nodiscard]] PairList<Dim, T> changed_pairs() const;
    /// The objects that the last update brought here and took away, ascending by id. What it told about their
    /// pairs it told to the rank that has them now.
    [[nodiscard]] std::span<const Arrival> arrived() const noexcept;
    [[nodiscard]] std::span<const std::uint64_t> departed() const noexcept;

    // --- This rank's objects, as of the last update ---

    [[nodiscard]] std::size_t size() const noexcept;
    /// Refills `out` with their ids, ascending.
    void ids(std::vector<std::uint64_t>& out) const;
    /// Whether commands about it may be given here: this sees what is queued.
    [[nodiscard]] bool contains(std::uint64_t id) const noexcept;
    /// As it was given, and as it is compared. `Error` for an object that isn't this rank's.
    [[nodiscard]] Box box(std::uint64_t id) const;
    [[nodiscard]] Box bounds(std::uint64_t id) const;
    [[nodiscard]] ObjectFilter filter(std::uint64_t id) const;
    [[nodiscard]] bool enabled(std::uint64_t id) const;

    // --- Queries about the whole scene, as of the last update: collective ---
    // They are those of jostle::World, with the same answers, where ids stand for indices; the same for any
    // number of ranks. Each rank brings as many queries as it likes, or none, and gets the answers to its
    // own. Queries go to the ranks whose regions they may reach, a frustum to all of them; answers come
    // back: two exchanges and two reductions, for `nearest` four exchanges, and no other cost for ranks that
    // aren't reached. Each rank answers on its executor's threads. One filter serves all queries of a
    // rank, or there is one for each. Ranks that ask for different things at a time, bad queries, or too
    // few places for answers are a Failure on all ranks; what there is for answers is empty or cut short.

    static constexpr std::uint64_t no_limit = ~std::uint64_t{0};

    /// The first hit on each line, of several at the same place the one with the lowest id. `Line` is
    /// Ray<Dim, T> or Sweep<Dim, T>.
    template <class Line>
    void first(std::span<const Line> lines, std::span<ObjectHit<T>> out, const Filters& filters = {}) const;
    /// All hits on each line, ascending by (at, id), or the first `max_results` of them.
    template <class Line>
    void all(std::span<const Line> lines, Answers<ObjectHit<T>>& out, const Filters& filters = {},
             std::uint64_t max_results = no_limit) const;
    /// What touches each region, ascending by id, or the first `max_results` of it. `Region` is Aabb, Sphere
    /// or Frustum.
    template <class Region>
    void all(std::span<const Region> regions, Answers<Found>& out, const Filters& filters = {},
             std::uint64_t max_results = no_limit) const;
    /// The nearest, ascending by (squared distance, id). `Near` is Nearest or NearestToBox.
    template <class Near>
    void nearest(std::span<const Near> queries, Answers<ObjectHit<T>>& out,
                 const Filters& filters = {}) const;
    /// How many there are. `Query` is Ray, Sweep, Aabb, Sphere or Frustum.
    template <class Query>
    void count(std::span<const Query> queries, std::span<std::uint64_t> out,
               const Filters& filters = {}) const;

    [[nodiscard]] const QueryStats& query_stats() const noexcept;

    // --- The same queries about this rank's objects alone, wherever they are: without other ranks ---
    // An `Error` names what is wrong with a query. The first one after an update in which one of this
    // rank's objects changed builds an index of them, which takes about 0.2 us an object.

    template <class Line>
    [[nodiscard]] std::optional<ObjectHit<T>> first_owned(const Line& line,
                                                          const QueryFilter& filter = {}) const;
    template <class Line>
    bool all_owned(const Line& line, std::vector<ObjectHit<T>>& out, const QueryFilter& filter = {},
                   std::uint64_t max_results = no_limit) const;
    template <class Region>
    bool all_owned(const Region& region, std::vector<Found>& out, const QueryFilter& filter = {},
                   std::uint64_t max_results = no_limit) const;
    template <class Near>
    void nearest_owned(const Near& query, std::vector<ObjectHit<T>>& out,
                       const QueryFilter& filter = {}) const;
    template <class Query>
    [[nodiscard]] std::uint64_t count_owned(const Query& query, const QueryFilter& filter = {}) const;

    // --- Snapshots, of the world as of the last update ---

    /// Collective. Returns this rank's part of a snapshot: its objects, without what is queued and what
    /// `pack` would write. All parts together are the snapshot. The same bytes on every machine.
    [[nodiscard]] std::vector<std::byte> save() const;
    /// Collective. Becomes the world that was saved, with its margin: whatever number of ranks saved it,
    /// each of its parts is given to some rank, none to two; a rank may be given several or none. Objects
    /// belong to the rank that was given their part, and migrate in the next update. What was queued is
    /// forgotten; the lists are empty, and the next update tells what differs from the saved state. Parts
    /// that are cut short, altered, missing, given twice or of different snapshots are a Failure that says
    /// so.
    void restore(std::span<const std::vector<std::byte>> parts);

    [[nodiscard]] const WorldStats& stats() const noexcept;

    struct Implementation;

  private:
    bool sizes_agree(std::size_t ids, std::size_t boxes) noexcept;
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

/// Collective. Returns the touching pairs among the boxes of all ranks, those of which this rank gave the box
/// with the lower id, ascending by (a, b). ids[i] is that of boxes[i]; no other box of any rank has it.
/// Errors   as World::update().
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::vector<Pair<Dim, T>> find_pairs(MPI_Comm comm, const BoxView<Dim, T>& boxes,
                                                              std::span<const std::uint64_t> ids,
                                                              const WorldOptions& options = {});
template <BoxContainer Boxes>
[[nodiscard]] auto find_pairs(MPI_Comm comm, const Boxes& boxes, std::span<const std::uint64_t> ids,
                              const WorldOptions& options = {})
{
    return find_pairs(comm, box_view(boxes), ids, options);
}

} // namespace mpi
JOSTLE_NAMESPACE_END
