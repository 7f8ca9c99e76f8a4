// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/stats.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

struct ImageRule;

/// Says which of the touching pairs are wanted. A pair is reported if every given part accepts it. An empty
/// part filters nothing.
struct Filter
{
    /// The owner of objects that have none. They pair with each other like any two objects.
    static constexpr std::uint32_t no_owner = ~std::uint32_t{0};

    /// Bit sets, one per object: a and b pair only if category[a] & mask[b] and category[b] & mask[a] are
    /// both non-zero. Give both or neither.
    StridedView<std::uint32_t> category = {};
    StridedView<std::uint32_t> mask = {};
    /// Objects of one owner never pair with each other: the parts of a robot, the colliders of a body.
    StridedView<std::uint32_t> owner = {};
    /// Called last, for the pairs that the other parts accept, with a and b as reported. It is called from
    /// several threads at a time. An exception that it throws ends the search and leaves the call.
    StoredFunctionRef<bool(std::uint32_t a, std::uint32_t b)> accept = {};
    /// Set by PeriodicImages::filter(), so that each pair in periodic space is found once. Null in all other
    /// searches.
    const ImageRule* images = nullptr;
    /// How many objects at the end are ghosts: they pair with other objects, but not with each other, since
    /// another process finds those pairs. Pairs of ghosts cost only the sweep past them.
    std::size_t ghosts = 0;
    /// Up to three numbers per object, no_owner for each missing one. Objects that share a number never pair:
    /// triangles of a cloth with a common vertex, links of a chain with a common joint.
    StridedView<std::array<std::uint32_t, 3>> vertices = {};
};

/// The same for pairs between two sets. Members that end in `_a` describe objects of the first set, those
/// that end in `_b` objects of the second.
struct CrossFilter
{
    StridedView<std::uint32_t> category_a = {}, mask_a = {}, owner_a = {};
    StridedView<std::uint32_t> category_b = {}, mask_b = {}, owner_b = {};
    StoredFunctionRef<bool(std::uint32_t a, std::uint32_t b)> accept = {};
};

/// The same for many scenes. The columns have one value for each box of all scenes.
struct SceneFilter
{
    StridedView<std::uint32_t> category = {};
    StridedView<std::uint32_t> mask = {};
    StridedView<std::uint32_t> owner = {};
    /// `a` and `b` are numbers of boxes within the scene.
    StoredFunctionRef<bool(std::size_t scene, std::uint32_t a, std::uint32_t b)> accept = {};
};

enum class Order
{
    /// Pairs are grouped by place. The order depends only on the boxes, not on threads, executor, instruction
    /// set, compiler or earlier calls. This is the fastest.
    canonical,
    /// Pairs ascend by (a, b). The result is sorted on all threads, which takes about as long as the search.
    sorted,
};

/// A piece of the result, as a PairSink gets it.
struct PairChunk
{
    std::span<const Pair> pairs; ///< never empty; valid only during the call of the sink
    /// The chunks in ascending order of (block, part) give the canonical order. Both numbers depend on the
    /// boxes alone.
    std::uint64_t block;
    std::uint64_t part;
};

/// Receives pairs as they are found, and returns false to stop the search. Chunks of different blocks arrive
/// from several threads at a time, in no particular order. The chunks of one block arrive in ascending order
/// of `part`.
using PairSink = FunctionRef<bool(const PairChunk&)>;

/// The instruction sets Jostle has kernels for. Results are the same on all of them.
enum class InstructionSet
{
    scalar,
    sse4,
    avx2,
    avx512,
    neon,
    wasm_simd
};

/// The instruction sets that were compiled in and that this machine can run, fastest first; never empty.
/// `scalar` is last, unless every target CPU has SIMD (such as NEON on 64-bit ARM).
[[nodiscard]] JOSTLE_API std::span<const InstructionSet> supported_instruction_sets() noexcept;
[[nodiscard]] JOSTLE_API const char* name(InstructionSet set) noexcept;

struct FinderOptions
{
    /// Null means default_executor(). It must outlive the finder.
    Executor* executor = nullptr;
    /// Provides working memory. It is used from several threads at a time and must be synchronised.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    /// For tests and measurements. The constructor throws `Error` if it is not one of
    /// supported_instruction_sets().
    InstructionSet instruction_set = supported_instruction_sets().front();
};

/// The broad phase: finds all pairs of touching boxes, from scratch in each call.
///
///     jostle::PairFinder finder;
///     for (jostle::Pair pair : finder.find(boxes)) ...            // within one set
///     for (jostle::Pair pair : finder.find(bullets, targets)) ... // between two sets
///
/// It keeps only working memory between calls, so a steady scene allocates nothing, and the result depends
/// only on the boxes of the call. There is nothing to configure: no capacity, no world bounds, no cell size.
/// A scene may mix boxes of any size and place, infinite ones included.
///
/// Touching  closed boxes, compared in their own coordinates: no tolerance, no missed and no invented pair.
/// Numbers   every bit of a bound counts, also of denormals. If the host flushes denormals to zero, the
///           finder suspends that during a call, callbacks included.
/// Cost      expected linear in boxes + pairs, whether boxes move or not, in worlds at least about 1e-33
///           across (double: from 1e-300 to 1e300). Smaller and larger worlds are exact too, but may take
///           quadratic time. A box costs time and 16 bytes of memory for each cell that it overlaps. Boxes
///           much longer than the distance to their neighbours can overlap many: sticks across the whole
///           world took 60 to 80 cells each.
/// Memory    stays as large as the largest call needed, until release_memory().
/// Threads   one call at a time per finder. A second one, also from inside a callback, is an `Error`. Use a
///           finder for each thread, or one finder whose executor has many threads.
/// Errors    `Error` that names the lowest box that is NaN or inverted, `std::bad_alloc`, or what a callback
///           threw. If several callbacks throw, one of the exceptions leaves the call, the same one for any
///           number of threads. Afterwards the finder can be used again, and its result buffer is empty.
/// Source    hierarchical grids: Mirtich (1996); store-in-every-cell with an owner rule instead of a set of
///           seen pairs: docs/inside/engine.md.
class JOSTLE_API PairFinder
{
  public:
    explicit PairFinder(const FinderOptions& options = {});
    PairFinder(PairFinder&&) noexcept;
    PairFinder& operator=(PairFinder&&) noexcept;
    ~PairFinder();

    /// Returns all pairs among `boxes`, a container or a view. The finder owns the result, which is valid
    /// until its next call.
    template <AnyBoxes Boxes>
    const PairBuffer& find(const Boxes& boxes, const Filter& filter = {}, Order order = Order::canonical) &
    {
        return found(box_view(boxes), filter, order);
    }
    /// Returns all pairs of a box of `a` and a box of `b`, but none within `a` or within `b`.
    template <AnyBoxes A, BoxesLike<A> B>
    const PairBuffer& find(const A& a, const B& b, const CrossFilter& filter = {},
                           Order order = Order::canonical) &
    {
        return found(box_view(a), box_view(b), filter, order);
    }
    /// Deleted for temporary finders, since the result would be destroyed with them: name the finder, or use
    /// take().
    template <class... Arguments>
    void find(Arguments&&... result_would_be_gone) && = delete;

    /// Returns the pairs of many independent scenes, such as thousands of small worlds that run side by side.
    /// Scene k is boxes[offsets[k]] to boxes[offsets[k + 1] - 1]: there is one more offset than scenes, from
    /// 0 to boxes.size(). No pair crosses scenes. A scene's pairs are those that find() returns for it, in
    /// the same order, with boxes numbered within the scene: box offsets[k] is its number 0. The finder owns
    /// the result, which is valid until its next call of find_scenes.
    /// Threads   scenes are distributed over them, and a large scene among many small ones is searched by
    ///           all.
    /// Errors    `Error` for offsets that don't begin with 0, descend, or don't end with boxes.size(), naming
    ///           the offset; for a bad box, naming its position in `boxes`. If `accept` throws, the exception
    ///           of the lowest scene leaves the call.
    /// Cost      on one thread 0.4 to 1.1 times that of a loop over find(); the smaller the scenes, the less.
    template <AnyBoxes Boxes>
    const ScenePairs& find_scenes(const Boxes& boxes, std::span<const std::uint64_t> offsets,
                                  const SceneFilter& filter = {}) &
    {
        return scenes_found(box_view(boxes), offsets, filter);
    }
    template <class... Arguments>
    void find_scenes(Arguments&&... result_would_be_gone) && = delete;

    /// Passes each pair to `sink` instead of storing it, so memory stays bounded however many pairs there
    /// are. Returns false if the sink stopped the search; chunks from other threads may still arrive after
    /// the sink has returned false. An exception that it throws ends the search and leaves the call.
    template <AnyBoxes Boxes>
    bool stream(const Boxes& boxes, PairSink sink, const Filter& filter = {})
    {
        return streamed(box_view(boxes), sink, filter);
    }
    template <AnyBoxes A, BoxesLike<A> B>
    bool stream(const A& a, const B& b, PairSink sink, const CrossFilter& filter = {})
    {
        return streamed(box_view(a), box_view(b), sink, filter);
    }

    /// Like find, but the caller owns the result.
    template <AnyBoxes Boxes>
    [[nodiscard]] PairBuffer take(const Boxes& boxes, const Filter& filter = {},
                                  Order order = Order::canonical)
    {
        return taken(find(boxes, filter, order));
    }
    template <AnyBoxes A, BoxesLike<A> B>
    [[nodiscard]] PairBuffer take(const A& a, const B& b, const CrossFilter& filter = {},
                                  Order order = Order::canonical)
    {
        return taken(find(a, b, filter, order));
    }

    /// Returns what the last call did.
    [[nodiscard]] const Stats& stats() const noexcept;
    /// Frees the working memory and the result's: all but a few hundred bytes, which the destructor frees.
    void release_memory() noexcept;

  private:
    friend class PairFinderAccess;
    template <int Dim, Coordinate T>
    const PairBuffer& found(const BoxView<Dim, T>& boxes, const Filter& filter, Order order);
    template <int Dim, Coordinate T>
    const PairBuffer& found(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, const CrossFilter& filter,
                            Order order);
    template <int Dim, Coordinate T>
    const ScenePairs& scenes_found(const BoxView<Dim, T>& boxes, std::span<const std::uint64_t> offsets,
                                   const SceneFilter& filter);
    template <int Dim, Coordinate T>
    bool streamed(const BoxView<Dim, T>& boxes, PairSink sink, const Filter& filter);
    template <int Dim, Coordinate T>
    bool streamed(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, PairSink sink,
                  const CrossFilter& filter);
    /// Moves a result that this finder owns.
    static PairBuffer taken(const PairBuffer& found) { return std::move(const_cast<PairBuffer&>(found)); }
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// Returns the touching pairs among `boxes`. To search in every frame, keep a PairFinder.
template <AnyBoxes Boxes>
[[nodiscard]] PairBuffer find_pairs(const Boxes& boxes, const Filter& filter = {},
                                    Order order = Order::canonical, const FinderOptions& options = {})
{
    return PairFinder(options).take(boxes, filter, order);
}

/// Returns the touching pairs of one box of `a` and one of `b`.
template <AnyBoxes A, BoxesLike<A> B>
[[nodiscard]] PairBuffer find_pairs(const A& a, const B& b, const CrossFilter& filter = {},
                                    Order order = Order::canonical, const FinderOptions& options = {})
{
    return PairFinder(options).take(a, b, filter, order);
}

namespace detail {
template <int Dim, Coordinate T>
JOSTLE_API void check_boxes(const BoxView<Dim, T>& boxes);
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::vector<Pair> brute_force(const BoxView<Dim, T>& boxes, const Filter& filter);
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::vector<Pair> brute_force(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b,
                                                       const CrossFilter& filter);
} // namespace detail

/// Throws the `Error` that a search throws for these boxes, or does nothing if all are valid. Cost: one pass
/// over the boxes, on the calling thread.
template <AnyBoxes Boxes>
void check_boxes(const Boxes& boxes)
{
    detail::check_boxes(box_view(boxes));
}

/// The reference implementation, obviously right rather than fast: tests every box against every other. Pairs
/// ascend by (a, b). O(n^2) on the calling thread. For checking results.
template <AnyBoxes Boxes>
[[nodiscard]] std::vector<Pair> find_pairs_brute_force(const Boxes& boxes, const Filter& filter = {})
{
    return detail::brute_force(box_view(boxes), filter);
}
template <AnyBoxes A, BoxesLike<A> B>
[[nodiscard]] std::vector<Pair> find_pairs_brute_force(const A& a, const B& b, const CrossFilter& filter = {})
{
    return detail::brute_force(box_view(a), box_view(b), filter);
}

JOSTLE_NAMESPACE_END
