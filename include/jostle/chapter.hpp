// SPDX-License-Identifier: MIT
#pragma once

/// The thesis chapter that Jostle grew out of, as a small library for study and comparison: a hierarchical
/// grid in a hash table (chapter 4.1) and all-pairs loops over the cores (chapter 4.2). Each piece names its
/// algorithm. Errors in the printed algorithms are fixed here, marked "Fixed", and listed in
/// docs/inside/chapter.md. For speed use find_pairs.hpp, which needs no cell sizes and no insertion.
///
/// A "processor" here is one task of an Executor: there are executor.concurrency() of them, and "wait until
/// all threads finish" is the return of Executor::run.
///
/// Source   "thesis, ch. 4" means "Parallel Techniques for Collision Detection", algorithms 6 to 16.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace chapter {

// ---- Cells and buckets ---------------------------------------------------------------------------------

/// A cell's position in the grid of one level, one number per axis.
template <int Dim>
using Cell = std::array<std::int64_t, detail::axes<Dim>>;

/// The cell that holds a position on one axis.
///
/// Fixed    floor instead of truncation, which folds cells -1 and 0 into one. Clamped to +-2^62, so that far
///          away and infinite positions have a cell too. It is still monotonic, which is all that exactness
///          needs.
/// Source   thesis, ch. 4, eq. 1-2.
template <Coordinate T>
[[nodiscard]] JOSTLE_API std::int64_t cell_index(T position, T cell_size) noexcept;

enum class Hash
{
    as_printed, ///< Alg. 7: every cell of an anti-diagonal in one bucket, and x + y + level folded onto its
                ///< negative
    mixing,     ///< each coordinate stirred into all bits
};

/// The bucket of a cell, in [0, buckets). Collisions cost time, never pairs.
/// Source   thesis, ch. 4, Alg. 7 (ComputeHashBucketIndex); in 3D z is added likewise.
template <int Dim>
[[nodiscard]] JOSTLE_API std::uint32_t bucket_index(const Cell<Dim>& cell, std::uint32_t level,
                                                    std::uint32_t buckets, Hash hash) noexcept;

// ---- The grid ------------------------------------------------------------------------------------------

template <Coordinate T>
struct GridOptions
{
    /// The edge length of each level's cells, ascending, finite and above 0. Objects larger than the last are
    /// kept in one list that every object is tested against: correct for any number, fast for few.
    std::vector<T> cell_sizes;
    /// The chapter's MAX_BUCKETS, at least 1. It doesn't limit the objects; about as many buckets as objects
    /// is fast.
    std::uint32_t buckets = 1u << 16;
    Hash hash = Hash::mixing;
};

/// What the last detect_proximity did, independent of the number of processors.
struct GridStats
{
    std::uint64_t cells = 0;   ///< cells probed
    std::uint64_t visited = 0; ///< objects met in the buckets of those cells
    std::uint64_t tests = 0;   ///< calls of IsClose: those visited that were in the cell itself
    std::uint64_t bytes = 0;   ///< the grid's memory, without the pairs
};

/// The objects [begin, end) that one processor handles.
struct Interval
{
    std::uint32_t begin;
    std::uint32_t end;
    friend constexpr bool operator==(const Interval&, const Interval&) = default;
};

/// An equal share of `objects`; the last processor also gets the remainder.
///
/// Fixed    with one processor the printed code reads intervals[-1].
/// Source   thesis, ch. 4, Alg. 9, lines 1-10.
[[nodiscard]] JOSTLE_API Interval work_interval(std::uint32_t processor, std::uint32_t processors,
                                                std::uint32_t objects) noexcept;

enum class Batching
{
    critical_section, ///< Alg. 11 as printed: a lock around taking the next pairs
    atomic_cursor,    ///< the same batches claimed by one atomic addition
};

/// Runs `test` for every pair, giving `batch` pairs at a time to whichever processor is free.
///
/// Threads  `test` is called from several threads at a time, once per pair; `processor` is below
///          executor.concurrency() and belongs to one thread at a time.
/// Errors   what `test` throws leaves the call after the other processors have finished their batch, with
///          some pairs untested. `Error` if batch is 0.
/// Source   thesis, ch. 4, Alg. 11 (TestCollisionThread).
JOSTLE_API void test_collisions(std::span<const Pair> close_pairs, Executor& executor,
                                FunctionRef<void(std::uint32_t processor, const Pair& pair)> test,
                                Batching batching = Batching::atomic_cursor, std::uint32_t batch = 64);

/// A hierarchy of uniform grids in one hash table. An object is stored once, in the cell of its min corner on
/// the first level whose cells hold it, and searches its own level and the coarser ones.
///
/// Touching  closed boxes, exactly, as in `overlaps`. Each pair is found once: on its own level an object
///           reports only what is ahead of it, on coarser levels only the finer object searches, and a cell
///           takes only its own objects from a bucket. So no set of seen pairs is needed.
/// Objects   are named by the number that add() returns. The number of a removed object is reused.
/// Cost      add, remove and move O(1). Detection O(objects x occupied levels + candidates); O(n^2) when all
///           objects share a cell.
/// Threads   const members from any number of threads, others one at a time.
/// Errors    `Error` for NaN, inverted and unknown objects and bad options. Nothing is changed then.
/// Source    thesis, ch. 4.1; hierarchical grids: Mirtich (1996); in a hash table: Ericson (2005), sec. 7.2.
template <int Dim, Coordinate T>
class JOSTLE_API Grid
{
  public:
    explicit Grid(GridOptions<T> options);

    /// Alg. 6 (AddObject). Returns the object's number: the lowest never used, or the last one removed.
    /// Fixed: an object larger than the largest cell, for which the printed search ends on a level that
    /// doesn't exist. An object that extends over three cells by rounding goes one level up.
    std::uint32_t add(const Aabb<Dim, T>& box);
    /// Alg. 8 (RemoveObject). Fixed: a bucket whose first object is removed gets a new first object.
    void remove(std::uint32_t object);
    /// Gives an object a new box: Alg. 8 and 6 if it enters another cell; nearly free if it doesn't.
    void move(std::uint32_t object, const Aabb<Dim, T>& box);

    [[nodiscard]] std::size_t size() const noexcept { return objects_.size(); }
    [[nodiscard]] bool contains(std::uint32_t object) const noexcept;
    [[nodiscard]] const Aabb<Dim, T>& box(std::uint32_t object) const;
    /// Returns the index of the object's cell size, or cell_sizes.size() if it is larger than all of them.
    [[nodiscard]] std::uint32_t level(std::uint32_t object) const;

    /// Returns all touching pairs: the first half of Alg. 9, with Alg. 10 (DetectProximityThread) on every
    /// processor.
    ///
    /// Order     a < b in each pair. The order of pairs depends on the history of add, remove and move, not
    ///           on processors or threads.
    /// Lifetime  the result is valid until the next detection.
    std::span<const Pair> detect_proximity(Executor& executor);
    /// The chapter's closePairs: the result of the last detection.
    [[nodiscard]] std::span<const Pair> close_pairs() const noexcept { return close_pairs_; }
    [[nodiscard]] const GridStats& stats() const noexcept { return stats_; }

    /// Alg. 9 (ProcessCollisionDetection): detect_proximity, then test_collisions on what it found.
    void process_collision_detection(Executor& executor,
                                     FunctionRef<void(std::uint32_t processor, const Pair& pair)> test,
                                     Batching batching = Batching::atomic_cursor, std::uint32_t batch = 64);

    /// Checks every link, level and cell. False means a bug in the grid. O(objects + buckets). For tests.
    [[nodiscard]] bool validate() const;

  private:
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    /// Where an object belongs.
    struct Place
    {
        std::uint32_t level;
        std::uint32_t bucket;
        Cell<Dim> cell;
    };
    struct Object
    {
        Aabb<Dim, T> box;
        Place place; // bucket == none: removed; then next is the one removed before it
        std::uint32_t previous, next;
        std::uint32_t position; // in objects_
    };
    struct ProcessorResult;

    std::uint32_t oversize_level() const noexcept
    {
        return static_cast<std::uint32_t>(options_.cell_sizes.size());
    }
    Place place_of(const Aabb<Dim, T>& box) const noexcept;
    void link(std::uint32_t object) noexcept;
    void unlink(std::uint32_t object) noexcept;
    void check_known(std::uint32_t object) const;
    void detect_proximity_thread(Interval interval, ProcessorResult& result) const;

    GridOptions<T> options_;
    std::vector<std::uint32_t> grid_;       // each bucket's first object; the last is the oversize list
    std::vector<std::uint32_t> level_size_; // objects per level
    std::vector<Object> records_;           // by the objects' numbers
    std::vector<std::uint32_t> objects_;    // the numbers of the existing ones
    std::uint32_t first_removed_ = none;
    std::vector<Pair> close_pairs_;
    GridStats stats_;
};

/// Returns cell sizes that suit the boxes: the powers of two that some box needs, so that a box fills at
/// least half of a cell's edge. Never empty. Boxes much smaller than the scene share the smallest size.
/// Cost     one pass and a sort of a sample. Boxes must be valid.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::vector<T> choose_cell_sizes(const BoxView<Dim, T>& boxes);

/// Returns all touching pairs by the chapter's grid, with nothing to configure.
///
/// Order    a < b in each pair. The order depends only on the boxes, not on the executor.
/// Cost     builds a grid on the calling thread, then detects on all processors.
/// Errors   as jostle::find_pairs.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::vector<Pair> find_pairs(const BoxView<Dim, T>& boxes,
                                                      Executor& executor = default_executor());

// ---- All pairs over the cores --------------------------------------------------------------------------

/// Runs `work` once for each processor and waits for all of them. If some throw, the exception of the lowest
/// processor leaves the call after the last has finished; executors never see an exception.
JOSTLE_API void on_all_processors(Executor& executor,
                                  FunctionRef<void(std::uint32_t processor, std::uint32_t processors)> work);

/// Tests every object against every later one on one processor: n (n-1) / 2 tests.
///
/// test_collision(i, j) says whether i and j, with i < j, collide. If so, on_collision(i, j) and
/// on_collision(j, i) are called: the first object's response to the second.
/// Source   thesis, ch. 4, Alg. 12.
template <class TestCollision, class OnCollision>
void process_collision_serial(std::uint32_t objects, TestCollision&& test_collision,
                              OnCollision&& on_collision)
{
    for (std::uint32_t i = 0; i + 1 < objects; ++i)
        for (std::uint32_t j = i + 1; j < objects; ++j)
            if (test_collision(i, j)) {
                on_collision(i, j);
                on_collision(j, i);
            }
}

/// One processor's share if the objects are cut into equal blocks: the first gets by far the most tests.
/// Source   thesis, ch. 4, Alg. 13.
template <class TestCollision, class OnCollision>
void process_collision_blocks(std::uint32_t processor, std::uint32_t processors, std::uint32_t objects,
                              TestCollision&& test_collision, OnCollision&& on_collision)
{
    const std::uint32_t block = objects / processors;
    const std::uint32_t start = processor * block;
    const std::uint32_t end = processor == processors - 1 ? objects : start + block;
    for (std::uint32_t i = start; i < end; ++i)
        for (std::uint32_t j = i + 1; j < objects; ++j)
            if (test_collision(i, j)) {
                on_collision(i, j);
                on_collision(j, i);
            }
}

/// One processor's share in zig-zag: the processor that took the most expensive object of one round takes the
/// cheapest of the next. All shares are nearly equal.
/// Source   thesis, ch. 4, Alg. 14.
template <class TestCollision, class OnCollision>
void process_collision_zigzag(std::uint32_t processor, std::uint32_t processors, std::uint32_t objects,
                              TestCollision&& test_collision, OnCollision&& on_collision)
{
    // 64 bits, so that the last step can't wrap around.
    const std::uint64_t delta = std::uint64_t{processors} * 2 - 1;
    for (std::uint64_t i = processor; i + 1 < objects; i += delta - 2 * (i % processors))
        for (auto j = static_cast<std::uint32_t>(i + 1); j < objects; ++j)
            if (test_collision(static_cast<std::uint32_t>(i), j)) {
                on_collision(static_cast<std::uint32_t>(i), j);
                on_collision(j, static_cast<std::uint32_t>(i));
            }
}

/// The size of a cache line: 64 on x86 and most ARM. If it is actually larger, that only costs time.
inline constexpr std::size_t cache_line = 64;

/// One response per object and processor, added up after a barrier: no lock, and no cache line that two
/// processors write.
///
/// Response  default-constructs to zero and adds with +=. An object's responses of one processor are added as
///           they come, and the processors' sums in ascending order. So with a floating-point Response the
///           last bits depend on the number of processors; with integers, or SparseResponses, they don't.
/// Memory    objects x processors responses, however few collide.
/// Threads   add() for different processors at the same time; merge() when they are done.
/// Fixed     Alg. 16 assigns instead of adding, so only the last of several collisions in one processor's
///           share counts.
/// Source    thesis, ch. 4, Alg. 15-16, fig. 4.8; here with rows by processor, where the figure has them by
///           object: then all values on a cache line belong to one processor, as sec. 4.2 d demands.
template <class Response>
class DenseResponses
{
  public:
    DenseResponses(std::uint32_t objects, std::uint32_t processors)
        : rows_(processors, Row(objects)), merged_(objects)
    {
    }
    void add(std::uint32_t processor, std::uint32_t object, std::uint32_t /*other*/, const Response& response)
    {
        rows_[processor][object] += response;
    }
    /// The sum per object, by its number; what was added is used up. Valid until the next merge.
    std::span<const Response> merge(Executor& executor)
    {
        on_all_processors(executor, [this](std::uint32_t processor, std::uint32_t processors) {
            const Interval mine =
                work_interval(processor, processors, static_cast<std::uint32_t>(merged_.size()));
            for (std::uint32_t object = mine.begin; object < mine.end; ++object) {
                Response sum{};
                for (Row& row : rows_)
                    sum += std::exchange(row[object], Response{});
                merged_[object] = std::move(sum);
            }
        });
        return merged_;
    }

  private:
    /// Allocates whole cache lines, so that two rows never share one.
    template <class U>
    struct WholeLines
    {
        using value_type = U;
        static constexpr std::align_val_t alignment{std::max(cache_line, alignof(U))};
        WholeLines() = default;
        template <class V>
        WholeLines(const WholeLines<V>&) noexcept
        {
        }
        U* allocate(std::size_t n)
        {
            // Can't overflow: a vector asks for no more than half of the address space.
            return static_cast<U*>(
                ::operator new((n * sizeof(U) + cache_line - 1) / cache_line * cache_line, alignment));
        }
        void deallocate(U* p, std::size_t) noexcept { ::operator delete(p, alignment); }
        friend bool operator==(const WholeLines&, const WholeLines&) { return true; }
    };
    using Row = std::vector<Response, WholeLines<Response>>;

    std::vector<Row> rows_;
    std::vector<Response> merged_;
};

/// The same for many objects on many cores: each processor keeps a list of the actual responses.
///
/// Response  as above. An object's responses are added in ascending order of the other object, which gives
///           the same bits for any number of processors, floating point too.
/// Memory    one entry per response.
/// Threads   add() for different processors at the same time; merge() when they are done.
/// Source    replaces the full table of fig. 4.8.
template <class Response>
class SparseResponses
{
  public:
    SparseResponses(std::uint32_t objects, std::uint32_t processors) : lists_(processors), merged_(objects) {}
    void add(std::uint32_t processor, std::uint32_t object, std::uint32_t other, const Response& response)
    {
        lists_[processor].entries.push_back({object, other, response});
    }
    /// The sum per object, by its number; what was added is used up. Valid until the next merge.
    std::span<const Response> merge(Executor& executor)
    {
        // A counting sort by object: `next` becomes each object's end in `all`.
        std::vector<std::size_t> next(merged_.size() + 1, 0);
        std::size_t total = 0;
        for (const List& list : lists_) {
            total += list.entries.size();
            for (const Entry& entry : list.entries)
                ++next[entry.object + 1];
        }
        for (std::size_t object = 0; object < merged_.size(); ++object)
            next[object + 1] += next[object];
        std::vector<const Entry*> all(total);
        for (const List& list : lists_)
            for (const Entry& entry : list.entries)
                all[next[entry.object]++] = &entry;
        on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t processors) {
            const Interval mine =
                work_interval(processor, processors, static_cast<std::uint32_t>(merged_.size()));
            for (std::uint32_t object = mine.begin; object < mine.end; ++object) {
                const auto begin = all.begin() + static_cast<std::ptrdiff_t>(object ? next[object - 1] : 0);
                const auto end = all.begin() + static_cast<std::ptrdiff_t>(next[object]);
                std::sort(begin, end, [](const Entry* x, const Entry* y) { return x->other < y->other; });
                Response sum{};
                for (auto entry = begin; entry != end; ++entry)
                    sum += (*entry)->response;
                merged_[object] = std::move(sum);
            }
        });
        for (List& list : lists_)
            list.entries.clear();
        return merged_;
    }

  private:
    struct Entry
    {
        std::uint32_t object, other;
        Response response;
    };
    struct alignas(cache_line) List // each processor's vector header on its own cache line
    {
        std::vector<Entry> entries;
    };
    std::vector<List> lists_;
    std::vector<Response> merged_;
};

/// Tests all pairs in zig-zag on all processors, keeps responses per processor, and merges them after the
/// barrier.
///
/// respond(i, j) is the response of object i to its collision with j. `responses` is a DenseResponses or
/// SparseResponses for `objects` objects and executor.concurrency() processors. Returns the sum per object.
/// Source   thesis, ch. 4, Alg. 15 (ProcessCollision) and 16 (OnCollision), fig. 4.8.
template <class TestCollision, class Respond, class Responses>
auto process_collision_responses(Executor& executor, std::uint32_t objects, TestCollision&& test_collision,
                                 Respond&& respond, Responses& responses)
{
    on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t processors) {
        process_collision_zigzag(processor, processors, objects, test_collision,
                                 [&](std::uint32_t object, std::uint32_t other) {
                                     responses.add(processor, object, other, respond(object, other));
                                 });
    });
    return responses.merge(executor);
}

} // namespace chapter
JOSTLE_NAMESPACE_END
