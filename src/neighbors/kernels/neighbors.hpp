// SPDX-License-Identifier: MIT
// The hot loops of neighbour lists.
#pragma once

#include <cstddef>
#include <cstdint>

#include "jostle/find_pairs.hpp"
#include "jostle/vec.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

/// So many numbers are read beyond the end of columns, and written beyond the end of results.
inline constexpr std::size_t neighbor_padding = 16;

/// A box of wrapped points.
template <int Dim, class T>
struct Extent
{
    Vec<Dim, T> lo, hi;
};

/// Points that some rows may have as neighbours, in the order in which rows list them.
template <class T>
struct NearbyColumns
{
    T* at[3];             ///< by axis; the padding is NaN, which is near nothing
    std::uint32_t* index; ///< of the point
    std::uint32_t* image; ///< which image of it; null if not wanted
    const T* radius;      ///< null unless cutoffs are of radii
    std::size_t count;
};

/// The distances within which a row has neighbours.
template <class T>
struct RowCutoff
{
    T sure, near; ///< squares: a neighbour up to `sure`, none beyond `near`
    // Of radii each column has a cutoff of its own: with `radius` their sum, or the greater one, and `more`.
    // A neighbour if nearer than that by `slack`, none if further by as much.
    T radius, more, slack;
    bool greater;
    bool any_sure; ///< else none is sure
};

/// A candidate that the test of wrapped points can't decide.
struct UnsureNeighbor
{
    std::uint32_t found;  ///< which of what the row found
    std::uint32_t nearby; ///< its place in the columns
};

/// What a row found.
struct RowFound
{
    std::uint32_t* index;
    std::uint32_t* image; ///< not written if the columns have none
    UnsureNeighbor* unsure;
    std::size_t count, unsure_count;
};

/// All instruction sets leave the same bytes.
template <int Dim, class T>
struct NeighborKernels
{
    /// Writes which of the points from `begin` to `end` - 1, all moved by `by`, are so near to the box that
    /// the square of the distance is at most `near`. Returns how many. A point that select_row finds near to
    /// one in the box is among them: the same operations, and each of them is monotonic.
    std::size_t (*select)(const T* const (&axes)[3], std::size_t begin, std::size_t end,
                          const Vec<Dim, T>& by, const Extent<Dim, T>& box, T near, std::uint32_t* selected);
    /// Writes which points of the columns, from `first` on, may be near, and lists those that aren't surely
    /// so as unsure as well.
    void (*find_row)(const NearbyColumns<T>& columns, std::size_t first, const Vec<Dim, T>& here,
                     const RowCutoff<T>& cutoff, RowFound& row);
    /// Of neighbours at these distances, as long as they were kept, sets the bits of those that are at most
    /// `near`, 32 a word, and clears all others. Of these it writes which are above `sure`, and returns how
    /// many.
    std::size_t (*tell_apart)(const T* distances, std::size_t count, T sure, T near, std::uint32_t* chosen,
                              std::uint32_t* unsure);
    /// Writes the neighbours whose bit is set, and their places if wanted. Returns how many.
    std::size_t (*take_chosen)(const std::uint32_t* neighbors, std::size_t count, const std::uint32_t* chosen,
                               std::uint32_t* index, std::uint32_t* places);
};

/// For one of supported_instruction_sets().
template <int Dim, class T>
const NeighborKernels<Dim, T>& kernels_for(InstructionSet set) noexcept;

} // namespace neighbors
JOSTLE_NAMESPACE_END
