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

/// Says which of the touching pairs are wanted. A pair is reported if every part that is given agrees to it.
/// A part that is left empty filters nothing.
struct Filter
{
    /// The owner of objects that belong to nobody. They pair with each other like any two objects.
    static constexpr std::uint32_t no_owner = ~std::uint32_t{0};

    /// Bit sets, one per object: a and b pair only if category[a] & mask[b] and category[b] & mask[a] are
    /// both non-zero. Give both or neither.
    StridedView<std::uint32_t> category = {};
    StridedView<std::uint32_t> mask = {};
    /// Objects of one owner never pair with each other: the parts of a robot, the colliders of a body.
    StridedView<std::uint32_t> owner = {};
    /// Called last, for the pairs that the other parts let through, with a and b as they would be reported.
    /// It is called from several threads at a time. An exception that it throws ends the search and leaves
    /// the call.
    StoredFunctionRef<bool(std::uint32_t a, std::uint32_t b)> accept = {};
    /// Set by PeriodicImages::filter(): each pair of periodic space counts once. Null in all other searches.
    const ImageRule* images = nullptr;
    /// The last so many objects are ghosts: they meet the others, and not each other. For those whose pairs
    /// another process finds. Such pairs cost nothing but the sweep past them.
    std::size_t ghosts = 0;
    /// Up to three numbers an object, no_owner where it has fewer. Objects with one in common never pair:
    /// triangles of a cloth that share a vertex, links of a chain that share a joint.
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
    /// Pairs are grouped by their place in space. The order depends on the boxes alone, and not on threads,
    /// executor, instruction set, compiler or earlier calls. This is the fastest.
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

/// Receives pairs as they are found. It returns false to stop the search. Chunks of different blocks arrive
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

/// The sets that were compiled in and that this machine can run, fastest first; never empty. `scalar` is the
/// last of them, unless all machines that the build is for have more: NEON on 64-bit ARM, for one.
[[nodiscard]] JOSTLE_API std::span<const InstructionSet> supported_instruction_sets() noexcept;
[[nodiscard]] JOSTLE_API const char* name(InstructionSet set) noexcept;

struct FinderOptions
{
    /// Null means default_executor(). It must outlive the finder.
    Executor* executor = nullptr;
    /// Where working memory comes from. It is used from several threads at a time and must be synchronised.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    /// For tests and measurements. The constructor throws `Error` if it is not one of
    /// supported_instruction_sets().
    InstructionSet instruction_set = supported_instruction_sets().front();
};

/// The broad phase: finds all pairs of touching boxes, anew in each call.
///
///     jostle::PairFinder finder;
///     for (jostle::Pair pair : finder.find(boxes)) ...            // within one set
///     for (jostle::Pair pair : finder.find(bullets, targets)) ... // between two sets
///
/// It keeps nothing between calls but working memory, so a steady scene allocates nothing. The answer depends
/// on the boxes of the call alone. There is nothing to configure: no capacity, no world bounds, no cell size.
/// One scene may mix boxes of any size, at any place, infinite ones included.
///
/// Touching  closed boxes, compared in the user's own numbers: no tolerance, no missed and no invented pair.
/// Numbers   every bit of a bound counts, also in denormal numbers. If the host flushes those to zero, the
///           finder suspends that inside a call, callbacks included.
/// Cost      expected linear in boxes + pairs, whether boxes move or not, in worlds from about 1e-33 across
///           to the end of the range (double: from 1e-300 to 1e300). Smaller and larger worlds are exact too,
///           but may take quadratic time. A box costs time and 16 bytes of memory for each cell that it
///           reaches into. A box that is much longer than the distance between its neighbours can reach into
///           many: sticks across the whole world have taken 60 to 80 cells each.
/// Memory    stays as large as the largest call needed, until release_memory().
/// Threads   one call at a time per finder. A second one, also from inside a callback, is an `Error`. Use one
///           finder per thread, or one finder with an executor of many threads.
/// Errors    `Error` that names the lowest box that is NaN or inverted, `std::bad_alloc`, or what a callback
///           threw. If several callbacks throw, one of the exceptions leaves the call, the same for any
///           number of threads. The finder can be used afterwards, and its result buffer is empty.
/// Source    hierarchical grids: Mirtich (1996); store-in-every-cell with an owner rule in place of a set
///           of seen pairs: docs/inside/engine.md.
class JOSTLE_API PairFinder
{
  public:
    explicit PairFinder(const FinderOptions& options = {});
    PairFinder(PairFinder&&) noexcept;
    PairFinder& operator=(PairFinder&&) noexcept;
    ~PairFinder();

    /// Returns all pairs among `boxes`. The result lies in the finder and is valid until its next call.
    template <int Dim, Coordinate T>
    const PairBuffer& find(const BoxView<Dim, T>& boxes, const Filter& filter = {},
                           Order order = Order::canonical) &;
    /// Returns all pairs of one box of `a` and one box of `b`. Pairs within `a` or within `b` are not
    /// reported. (`View` is the type of `b`. It is a template parameter so that find(boxes, {}) means "no
    /// filter".)
    template <int Dim, Coordinate T, std::same_as<BoxView<Dim, T>> View>
    const PairBuffer& find(const BoxView<Dim, T>& a, const View& b, const CrossFilter& filter = {},
                           Order order = Order::canonical) &;
    /// Not for a finder without a name, which takes its result with it: name it, or let take() return a copy.
    template <class... Arguments>
    void find(Arguments&&... result_would_be_gone) && = delete;

    /// Returns the pairs of many scenes that have nothing to do with each other, as thousands of small worlds
    /// have that run side by side. Scene k is boxes[offsets[k]] to boxes[offsets[k + 1] - 1]: there is one
    /// offset more than scenes, from 0 to boxes.size(). No pair crosses scenes. A scene's pairs are those
    /// that find() returns for it, in the same order, and numbered within it: box offsets[k] is its number 0.
    /// The result lies in the finder and is valid until its next call of find_scenes.
    /// Threads   scenes are shared out over them, and a large one among many small is searched by all.
    /// Errors    `Error` for offsets that don't begin with 0, descend, or don't end with boxes.size(), which
    ///           names the offset; for a bad box, which names it by its position in `boxes`. If `accept`
    ///           throws, the exception of the lowest scene leaves the call.
    /// Cost      on one thread 0.4 to 1.1 times a loop over find(), least where scenes are smallest.
    template <int Dim, Coordinate T>
    const ScenePairs& find_scenes(const BoxView<Dim, T>& boxes, std::span<const std::uint64_t> offsets,
                                  const SceneFilter& filter = {}) &;
    template <BoxContainer Boxes>
    const ScenePairs& find_scenes(const Boxes& boxes, std::span<const std::uint64_t> offsets,
                                  const SceneFilter& filter = {}) &
    {
        return find_scenes(box_view(boxes), offsets, filter);
    }
    template <class... Arguments>
    void find_scenes(Arguments&&... result_would_be_gone) && = delete;

    /// Hands each pair to `sink` instead of storing it, so that memory stays bounded however many pairs there
    /// are. Returns false if the sink stopped the search. Chunks that other threads are working on may still
    /// arrive after that. An exception that the sink throws ends the search and leaves the call.
    template <int Dim, Coordinate T>
    bool stream(const BoxView<Dim, T>& boxes, PairSink sink, const Filter& filter = {});
    template <int Dim, Coordinate T>
    bool stream(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, PairSink sink,
                const CrossFilter& filter = {});

    /// The same four functions for containers of boxes.
    template <BoxContainer Boxes>
    const PairBuffer& find(const Boxes& boxes, const Filter& filter = {}, Order order = Order::canonical) &
    {
        return find(box_view(boxes), filter, order);
    }
    template <BoxContainer A, BoxContainer B>
    const PairBuffer& find(const A& a, const B& b, const CrossFilter& filter = {},
                           Order order = Order::canonical) &
    {
        return find(box_view(a), box_view(b), filter, order);
    }
    template <BoxContainer Boxes>
    bool stream(const Boxes& boxes, PairSink sink, const Filter& filter = {})
    {
        return stream(box_view(boxes), sink, filter);
    }
    template <BoxContainer A, BoxContainer B>
    bool stream(const A& a, const B& b, PairSink sink, const CrossFilter& filter = {})
    {
        return stream(box_view(a), box_view(b), sink, filter);
    }

    /// Like find, but the caller owns the result, and the finder's next call begins a new one.
    template <AnyBoxes Boxes>
    [[nodiscard]] PairBuffer take(const Boxes& boxes, const Filter& filter = {},
                                  Order order = Order::canonical)
    {
        return taken(find(box_view(boxes), filter, order));
    }
    template <AnyBoxes A, BoxesLike<A> B>
    [[nodiscard]] PairBuffer take(const A& a, const B& b, const CrossFilter& filter = {},
                                  Order order = Order::canonical)
    {
        return taken(find(box_view(a), box_view(b), filter, order));
    }

    /// Tells about the last call.
    [[nodiscard]] const Stats& stats() const noexcept;
    /// Gives working memory back, the result's included: all but some hundred bytes that the destructor
    /// frees.
    void release_memory() noexcept;

  private:
    friend class PairFinderAccess;
    /// What a search returned, which is this finder's own.
    static PairBuffer taken(const PairBuffer& found) { return std::move(const_cast<PairBuffer&>(found)); }
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// Returns the touching pairs among `boxes`, with no finder to keep. For frame after frame use a PairFinder.
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

/// Throws the `Error` that every search throws for these boxes, or does nothing if all are valid.
/// Cost: one pass over the boxes, on the calling thread.
template <int Dim, Coordinate T>
JOSTLE_API void check_boxes(const BoxView<Dim, T>& boxes);
template <BoxContainer Boxes>
void check_boxes(const Boxes& boxes)
{
    check_boxes(box_view(boxes));
}

/// The definition, written to be obviously right rather than fast: every box against every other, ascending
/// by (a, b). O(n^2) on the calling thread. For checking results, ours and others'.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::vector<Pair> find_pairs_brute_force(const BoxView<Dim, T>& boxes,
                                                                  const Filter& filter = {});
template <int Dim, Coordinate T, std::same_as<BoxView<Dim, T>> View>
[[nodiscard]] JOSTLE_API std::vector<Pair> find_pairs_brute_force(const BoxView<Dim, T>& a, const View& b,
                                                                  const CrossFilter& filter = {});
template <BoxContainer Boxes>
[[nodiscard]] std::vector<Pair> find_pairs_brute_force(const Boxes& boxes, const Filter& filter = {})
{
    return find_pairs_brute_force(box_view(boxes), filter);
}
template <BoxContainer A, BoxContainer B>
[[nodiscard]] std::vector<Pair> find_pairs_brute_force(const A& a, const B& b, const CrossFilter& filter = {})
{
    return find_pairs_brute_force(box_view(a), box_view(b), filter);
}

JOSTLE_NAMESPACE_END
