// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/stats.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Which of the touching pairs are wanted. Everything given must agree; what is left empty doesn't filter.
struct Filter
{
    /// The owner value of objects that belong to nobody: they pair with each other like any two objects.
    static constexpr std::uint32_t no_owner = ~std::uint32_t{0};

    /// Bit sets, one per object: a and b pair only if category[a] & mask[b] and category[b] & mask[a] are
    /// both non-zero. Give both or neither.
    StridedView<std::uint32_t> category = {};
    StridedView<std::uint32_t> mask = {};
    /// Objects of one owner never pair with each other: the parts of a robot, the colliders of a body.
    StridedView<std::uint32_t> owner = {};
    /// Asked last, for the pairs that are left, with a and b as they would be reported. It is called from
    /// several threads at a time. What it throws ends the search and leaves the call as it is.
    FunctionRef<bool(std::uint32_t a, std::uint32_t b)> accept = {};
};

/// The same for pairs between two sets: `a` filters objects of the first set, `b` those of the second.
struct CrossFilter
{
    StridedView<std::uint32_t> category_a = {}, mask_a = {}, owner_a = {};
    StridedView<std::uint32_t> category_b = {}, mask_b = {}, owner_b = {};
    FunctionRef<bool(std::uint32_t a, std::uint32_t b)> accept = {};
};

enum class Order
{
    /// Grouped by place in space, in an order that depends on the boxes alone: not on threads, executor,
    /// instruction set, compiler, or anything found before. The fastest.
    canonical,
    /// Ascending by (a, b). Costs a sort of the result, on all threads: about as much as the search.
    sorted,
};

/// A run of pairs on its way to a sink.
struct PairChunk
{
    std::span<const Pair> pairs; ///< never empty; valid during the call only
    /// Chunks ordered by (block, part) are the canonical order. Both depend on the boxes alone.
    std::uint64_t block;
    std::uint64_t part;
};

/// Takes pairs as they are found; returns false to stop the search. Chunks of different blocks arrive from
/// several threads at a time and in no particular order, those of one block in ascending part.
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

/// Those compiled in that this machine can run, the best one first; `scalar` is always there.
[[nodiscard]] JOSTLE_API std::span<const InstructionSet> supported_instruction_sets() noexcept;
[[nodiscard]] JOSTLE_API const char* name(InstructionSet set) noexcept;

struct FinderOptions
{
    /// Null means default_executor(). It must outlive the finder.
    Executor* executor = nullptr;
    /// Where working memory comes from. Used from several threads at a time: give a synchronised resource.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    /// One of supported_instruction_sets(), or the constructor refuses it; for tests and measurements.
    InstructionSet instruction_set = supported_instruction_sets().front();
};

/// Finds all pairs of touching boxes, exactly, in every frame anew.
///
/// It keeps nothing between calls but working memory, so that a steady scene allocates nothing; the answer
/// depends on the boxes of the call alone. There is nothing to configure: no capacity, no world bounds, no
/// cell size. Boxes may be of any sizes in one scene, anywhere, infinite too.
///
/// Touching  closed boxes, compared in the user's own numbers: no tolerance, no missed and no invented pair.
/// Numbers   every bit of a bound counts, denormals too: where the host flushes those to zero, that is
///           suspended inside a call, in the callbacks as well.
/// Cost      expected linear in boxes + pairs, for worlds of any size from about 1e-33 to the end of the
///           range (double: from 1e-300 to 1e300); beyond, exact but up to quadratic. Every box moving costs no
///           more than none moving. A box costs memory and time for each cell it reaches into, which for
///           boxes much longer than their neighbours are far apart can be many: sticks across the whole
///           world have taken 60 to 80 of 16 bytes each.
/// Memory    stays as large as the largest call needed, until release_memory().
/// Threads   one call at a time per finder, or an `Error`, also out of its own callbacks; use one finder per
///           thread, or one with an executor of many.
/// Errors    `Error` naming the lowest bad box, `std::bad_alloc`, or what a callback threw (of several throws
///           one, the same for any number of threads). The finder can
///           be used afterwards; a result buffer is empty then.
/// Source    hierarchical grids: Mirtich (1996); store-in-every-cell with an owner rule in place of a set
///           of seen pairs: docs/guide/engine.md.
class JOSTLE_API PairFinder
{
  public:
    explicit PairFinder(const FinderOptions& options = {});
    PairFinder(PairFinder&&) noexcept;
    PairFinder& operator=(PairFinder&&) noexcept;
    ~PairFinder();

    /// All pairs among `boxes`. The result lies in the finder and is valid until its next call.
    template <int Dim, Coordinate T>
    const PairBuffer& find(const BoxView<Dim, T>& boxes, const Filter& filter = {},
                           Order order = Order::canonical);
    /// All pairs of one box of `a` and one of `b`, which is a View so that find(boxes, {}) means no filter.
    template <int Dim, Coordinate T, std::same_as<BoxView<Dim, T>> View>
    const PairBuffer& find(const BoxView<Dim, T>& a, const View& b, const CrossFilter& filter = {},
                           Order order = Order::canonical);

    /// The same without storing: memory stays bounded however many pairs there are.
    /// Returns false if the sink stopped the search; chunks that other threads hold may still arrive after it
    /// did. What the sink throws ends the search and is thrown on.
    template <int Dim, Coordinate T>
    bool stream(const BoxView<Dim, T>& boxes, PairSink sink, const Filter& filter = {});
    template <int Dim, Coordinate T>
    bool stream(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, PairSink sink,
                const CrossFilter& filter = {});

    /// The four with containers of boxes.
    template <BoxContainer Boxes>
    const PairBuffer& find(const Boxes& boxes, const Filter& filter = {}, Order order = Order::canonical)
    {
        return find(box_view(boxes), filter, order);
    }
    template <BoxContainer A, BoxContainer B>
    const PairBuffer& find(const A& a, const B& b, const CrossFilter& filter = {},
                           Order order = Order::canonical)
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

    /// Like find, but the result is the caller's and the finder starts a new one.
    template <int Dim, Coordinate T>
    [[nodiscard]] PairBuffer take(const BoxView<Dim, T>& boxes, const Filter& filter = {},
                                  Order order = Order::canonical);
    template <int Dim, Coordinate T, std::same_as<BoxView<Dim, T>> View>
    [[nodiscard]] PairBuffer take(const BoxView<Dim, T>& a, const View& b, const CrossFilter& filter = {},
                                  Order order = Order::canonical);
    template <BoxContainer Boxes>
    [[nodiscard]] PairBuffer take(const Boxes& boxes, const Filter& filter = {},
                                  Order order = Order::canonical)
    {
        return take(box_view(boxes), filter, order);
    }
    template <BoxContainer A, BoxContainer B>
    [[nodiscard]] PairBuffer take(const A& a, const B& b, const CrossFilter& filter = {},
                                  Order order = Order::canonical)
    {
        return take(box_view(a), box_view(b), filter, order);
    }

    /// Of the last call.
    [[nodiscard]] const Stats& stats() const noexcept;
    /// Gives working memory back, the result's included: all but some hundred bytes that the destructor
    /// frees.
    void release_memory() noexcept;

  private:
    friend class PairFinderAccess;
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// The touching pairs among `boxes`, once, without keeping a finder. For frame after frame use a PairFinder.
template <int Dim, Coordinate T>
[[nodiscard]] PairBuffer find_pairs(const BoxView<Dim, T>& boxes, const Filter& filter = {},
                                    Order order = Order::canonical, const FinderOptions& options = {})
{
    return PairFinder(options).take(boxes, filter, order);
}
template <BoxContainer Boxes>
[[nodiscard]] PairBuffer find_pairs(const Boxes& boxes, const Filter& filter = {},
                                    Order order = Order::canonical, const FinderOptions& options = {})
{
    return find_pairs(box_view(boxes), filter, order, options);
}

/// The touching pairs of one box of `a` and one of `b`.
template <int Dim, Coordinate T, std::same_as<BoxView<Dim, T>> View>
[[nodiscard]] PairBuffer find_pairs(const BoxView<Dim, T>& a, const View& b, const CrossFilter& filter = {},
                                    Order order = Order::canonical, const FinderOptions& options = {})
{
    return PairFinder(options).take(a, b, filter, order);
}
template <BoxContainer A, BoxContainer B>
[[nodiscard]] PairBuffer find_pairs(const A& a, const B& b, const CrossFilter& filter = {},
                                    Order order = Order::canonical, const FinderOptions& options = {})
{
    return find_pairs(box_view(a), box_view(b), filter, order, options);
}

/// The streaming forms of the above.
template <int Dim, Coordinate T>
bool stream_pairs(const BoxView<Dim, T>& boxes, PairSink sink, const Filter& filter = {},
                  const FinderOptions& options = {})
{
    return PairFinder(options).stream(boxes, sink, filter);
}
template <BoxContainer Boxes>
bool stream_pairs(const Boxes& boxes, PairSink sink, const Filter& filter = {},
                  const FinderOptions& options = {})
{
    return stream_pairs(box_view(boxes), sink, filter, options);
}
template <int Dim, Coordinate T>
bool stream_pairs(const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, PairSink sink,
                  const CrossFilter& filter = {}, const FinderOptions& options = {})
{
    return PairFinder(options).stream(a, b, sink, filter);
}
template <BoxContainer A, BoxContainer B>
bool stream_pairs(const A& a, const B& b, PairSink sink, const CrossFilter& filter = {},
                  const FinderOptions& options = {})
{
    return stream_pairs(box_view(a), box_view(b), sink, filter, options);
}

/// Throws the `Error` that every search throws for these boxes, or does nothing if all are valid.
/// Cost: one pass over the boxes, on the calling thread.
template <int Dim, Coordinate T>
JOSTLE_API void validate_boxes(const BoxView<Dim, T>& boxes);

/// The definition, written to be obviously right rather than fast: every box against every other, ascending
/// by (a, b). O(n^2) on the calling thread. For checking results, ours and others'.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::vector<Pair> find_pairs_brute_force(const BoxView<Dim, T>& boxes,
                                                                  const Filter& filter = {});
template <int Dim, Coordinate T, std::same_as<BoxView<Dim, T>> View>
[[nodiscard]] JOSTLE_API std::vector<Pair> find_pairs_brute_force(const BoxView<Dim, T>& a, const View& b,
                                                                  const CrossFilter& filter = {});

JOSTLE_NAMESPACE_END
