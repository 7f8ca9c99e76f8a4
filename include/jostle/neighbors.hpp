// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "jostle/box.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/vec.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Space that repeats itself along some of these vectors: a box, or any parallelepiped, left-handed ones
/// included. What stands for an axis that doesn't repeat isn't read. PeriodicCell{} is open space.
template <int Dim, Coordinate T>
struct PeriodicCell
{
    Vec<Dim, T> vectors[detail::axes<Dim>] = {};
    bool repeats[detail::axes<Dim>] = {};

    friend constexpr bool operator==(const PeriodicCell&, const PeriodicCell&) = default;
};

/// How near two points must be to be neighbours: within one distance, or within one of their own. Two points
/// whose cutoff is 0 are none, wherever they are.
///
///     finder.find(points, 6.0f);
///     jostle::NeighborCutoff<float> touching;
///     touching.radii = radii;
///     finder.find(points, touching);
template <Coordinate T>
struct NeighborCutoff
{
    /// The same for all pairs.
    T value = 0;
    /// One for each point: a pair's cutoff is the sum of its two. `radii_b` is for the second of two sets.
    std::span<const T> radii = {}, radii_b = {};
    /// A pair's cutoff is the greater of its two radii instead, so that who sees is seen.
    bool greater = false;
    /// The type of each point, below k, and k * k cutoffs: that of types s and t is table[s * k + t], and of
    /// t and s the same. `types_b` is for the second of two sets.
    std::span<const std::uint32_t> types = {}, types_b = {};
    std::span<const T> table = {};

    NeighborCutoff() = default;
    NeighborCutoff(T all) noexcept : value(all) {}
};

struct NeighborOptions
{
    /// Lists each pair once, in the row of its lower point, and of the two images of a point that lie
    /// opposite each other the one whose first number other than 0 in its shift is above 0. Not for two sets.
    bool half = false;
    bool shifts = true;     ///< fills NeighborList::shifts
    bool vectors = false;   ///< fills NeighborList::vectors
    bool distances = false; ///< fills NeighborList::distances
    /// If above 0, the search also looks this much further than the cutoff and keeps what it finds. Later
    /// calls choose from that, and don't search, while no point has moved half as far and nothing else has
    /// changed. The list is the same as without.
    double skin = 0;
};

/// The neighbours of point i are neighbors[k], for k from offsets[i] to offsets[i + 1] - 1. The arrays are
/// the finder's, and valid until its next call.
template <int Dim, Coordinate T>
struct NeighborList
{
    std::span<const std::uint64_t> offsets; ///< one more than points
    std::span<const std::uint32_t> neighbors;
    /// By how many periods along each axis the neighbour's image is shifted; 0 where an axis doesn't repeat.
    /// Empty where not wanted.
    std::span<const std::array<std::int32_t, detail::axes<Dim>>> shifts;
    std::span<const Vec<Dim, T>> vectors; ///< from the point to its neighbour's image, where asked for
    std::span<const T> distances;         ///< the lengths of these, where asked for
    bool searched = false;                ///< false if a list that a skin had kept was enough
};

/// Neighbour lists: for each point all points within a cutoff, with all of their images where space repeats
/// itself, in cells of any shape and size.
///
///     jostle::NeighborFinder<3, double> finder;
///     const auto& list = finder.find(atoms, 6.0, {{{20, 0, 0}, {9, 17, 0}, {0, 0, 9}}, {true, true, true}});
///     for (std::size_t i = 0; i < atoms.size(); ++i)
///         for (std::uint64_t k = list.offsets[i]; k < list.offsets[i + 1]; ++k)
///             meet(i, list.neighbors[k], list.shifts[k]);
///
/// Exact     j with shift S is a neighbour of i if d.d <= c * c, computed in T, each operation rounded by
///           itself. d = (x_j - x_i) + ((S_0 * v_0 + S_1 * v_1) + S_2 * v_2), axis by axis, where x are the
///           points as given, v the cell's vectors, and only axes that repeat are summed. d.d = (d_x * d_x +
///           d_y * d_y) + d_z * d_z, and c is the cutoff, or the sum r_i + r_j, or the greater of the two. A
///           distance is the root of d.d. No other number has a say, so that any program can find the same
///           list. As d of (j, i, -S) is exactly -d, j is in i's row whenever i is in j's.
/// Itself    a point isn't its own neighbour, but its images may be; of two sets, each point of the second is
///           looked at for each of the first.
/// Order     rows ascend by neighbour, then by shift, the first axis first, for any number of threads.
/// Places    the points may lie anywhere, also outside of the cell: shifts are between points as given. Along
///           an axis that repeats, they must lie within 2^30 periods of each other (2^15 in float).
/// Units     those of the points; cutoffs, vectors, distances and the skin have the same.
/// Cost      expected linear in points + neighbours, with radii of any sizes. Open space with empty gaps of
///           thousands of cutoffs takes longer, and so do types whose cutoffs differ much.
/// Memory    stays as large as the largest call needed: a steady scene allocates nothing. About 100 bytes a
///           point, 8 bytes a pair, and the list.
/// Threads   one call at a time per finder; it uses those of options.executor. instruction_set changes
///           nothing.
/// Errors    `Error` that names the point and its value, or the axis: coordinates that are NaN, or above an
///           eighth of T's range; a cutoff that is negative, or 0 for all pairs, or whose square is beyond
///           T's range; a repeating axis whose vector is zero or infinite, or nearly in one plane with the
///           others; a cutoff that reaches over more than 500 periods; arrays of a wrong length; a skin that
///           is negative or infinite. The last list stays as it was. After `std::bad_alloc`, or the `Error`
///           of an executor that leaves tasks out, the list is empty.
/// Source    cells of a grid: Allen and Tildesley, Computer Simulation of Liquids (1987), sec. 5.3.2; the
///           skin: Verlet (1967).
template <int Dim, Coordinate T>
class JOSTLE_API NeighborFinder
{
  public:
    using Points = std::span<const Vec<Dim, T>>;
    using Cell = PeriodicCell<Dim, T>;
    /// Receives rows of a list in turn: those of the points from `first` on, row k of `rows` that of point
    /// first + k. It returns false to stop. The rows are valid only during the call.
    using Sink = FunctionRef<bool(std::size_t first, const NeighborList<Dim, T>& rows)>;

    explicit NeighborFinder(const FinderOptions& options = {});
    NeighborFinder(NeighborFinder&&) noexcept;
    NeighborFinder& operator=(NeighborFinder&&) noexcept;
    ~NeighborFinder();

    /// Returns each point's neighbours among the points. The result is valid until the next call.
    const NeighborList<Dim, T>& find(Points points, const NeighborCutoff<T>& cutoff, const Cell& cell = {},
                                     const NeighborOptions& options = {}) &;
    /// Returns, for each point, its neighbours among `others`.
    const NeighborList<Dim, T>& find(Points points, Points others, const NeighborCutoff<T>& cutoff,
                                     const Cell& cell = {}, const NeighborOptions& options = {}) &;
    /// Not for a finder without a name, which takes its list with it.
    template <class... Arguments>
    void find(Arguments&&... result_would_be_gone) && = delete;

    /// Returns the neighbours within each of many independent systems, such as a batch of molecules: system k
    /// has the points from offsets[k] to offsets[k + 1] - 1, with a cell for each, one for all, or none. All
    /// points are numbered in a row, in the list as well. Radii and types are those of all points. A system's
    /// rows are those that it has alone. A skin is an error; an error of a system names it.
    const NeighborList<Dim, T>& find_systems(Points points, std::span<const std::uint64_t> offsets,
                                             const NeighborCutoff<T>& cutoff,
                                             std::span<const Cell> cells = {},
                                             const NeighborOptions& options = {}) &;
    template <class... Arguments>
    void find_systems(Arguments&&... result_would_be_gone) && = delete;

    /// Hands the list to `sink` in blocks of so many rows instead of storing all of it: what `find` lists, in
    /// the same order, one block at a time, on the calling thread. Memory is that of the points and the
    /// largest block. Returns false if the sink stopped it; an exception that the sink throws leaves the
    /// call. Blocks of fewer than a tenth of the points take longer unless neighbours in space have numbers
    /// near to each other, as after `spatial_order`. A skin is an error. The last list is gone,
    /// but not what a skin keeps.
    bool stream(Points points, const NeighborCutoff<T>& cutoff, std::size_t rows, Sink sink,
                const Cell& cell = {}, const NeighborOptions& options = {});
    bool stream(Points points, Points others, const NeighborCutoff<T>& cutoff, std::size_t rows, Sink sink,
                const Cell& cell = {}, const NeighborOptions& options = {});

    /// Gives working memory back, the list and what a skin keeps included.
    void release_memory() noexcept;

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

JOSTLE_NAMESPACE_END
