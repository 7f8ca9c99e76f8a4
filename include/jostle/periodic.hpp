// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "jostle/box.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Periodic space: what leaves on one side enters on the other. Boxes near an end of a periodic axis get
/// images, shifted by a period, so that a search also finds the pairs across the border.
///
///     jostle::PeriodicImages3f images;
///     images.build(boxes, {10, 10, 0}); // periodic along x and y
///     for (jostle::Pair pair : finder.find(images.boxes(), images.filter()))
///         meet(images.origin()[pair.a], images.origin()[pair.b], images.shift()[pair.b]);
///
/// Pairs     each pair of objects is found once: as every box is shorter than half a period, two boxes touch
///           by at most one shift. If two meet across a border, the one with the greater coordinate has the
///           image, shifted down by a period: the first nonzero component of a shift is negative.
/// Order     boxes() has the originals in their order, then the images by ascending origin, for any number of
///           threads. In a pair of this search a < b, `a` is an original, and `b` an original or an image.
/// Places    the boxes may be anywhere if together they extend over less than two periods. They do if all
///           centres are in one period, wherever that begins.
/// Walls     a box that is infinite both ways along a periodic axis is its own image there. Its pairs have no
///           shift along that axis.
/// Exact     an image's bounds are rounded outwards, so no pair is lost by rounding.
/// Cost      two passes over the boxes and a copy of them: 10 ns a box. Only boxes that are at most the
///           largest box's length from an end of the period get images, since only these can touch something.
/// Memory    is kept, so a steady scene allocates nothing.
/// Threads   one call at a time; const members from any number of threads. instruction_set changes nothing.
/// Errors    `Error` from build(), which leaves the images unchanged: for a box that is NaN, inverted or at
///           least half a period long, naming the lowest one; for a box whose upper bound is two periods or
///           more above the lowest bound of all boxes; for a period that is negative, infinite or NaN; for
///           more than 2^32 - 1 boxes and images. `std::bad_alloc`, which may leave no boxes.
/// Source    Allen and Tildesley, Computer Simulation of Liquids (1987), sec. 1.5.2.
template <int Dim, Coordinate T>
class JOSTLE_API PeriodicImages
{
  public:
    using Box = Aabb<Dim, T>;
    using Vector = Vec<Dim, T>;

    explicit PeriodicImages(const FinderOptions& options = {});
    PeriodicImages(PeriodicImages&&) noexcept;
    PeriodicImages& operator=(PeriodicImages&&) noexcept;
    ~PeriodicImages();

    /// Copies the boxes and adds the images. `period` is the period's length along each axis, 0 where space
    /// isn't periodic.
    void build(const BoxView<Dim, T>& boxes, const Vector& period);

    /// The number of originals, which come first in boxes().
    [[nodiscard]] std::size_t originals() const noexcept;
    // The following are valid until the next build().

    /// Originals and images.
    [[nodiscard]] std::span<const Box> boxes() const noexcept;
    /// boxes()[i] is an image of the original origin()[i]; the origin of an original is itself.
    [[nodiscard]] std::span<const std::uint32_t> origin() const noexcept;
    /// shift()[i] is how far boxes()[i] is shifted from its origin: 0 for originals; for images 0 or a period
    /// along each axis. For contacts, add it to the position of the origin's pose.
    [[nodiscard]] std::span<const Vector> shift() const noexcept;

    /// Returns the filter with which a search among boxes() finds each pair once, without pairs of two
    /// images. Other members of the filter may be changed, as long as `images` stays.
    ///
    /// `originals` is the filter for the objects themselves: its arrays have one value per original, and its
    /// `accept` is called with two originals, in either order. It must outlive the search. The result is
    /// valid until the next build() or filter().
    ///
    /// If a callback needs the shift, set it on the result instead: it is called with numbers of boxes(), the
    /// first of which is an original and the second greater.
    ///
    ///     jostle::Filter filter = images.filter();
    ///     const auto accept = [&](std::uint32_t a, std::uint32_t b) {
    ///         return near(a, images.origin()[b], images.shift()[b]);
    ///     };
    ///     filter.accept = accept;
    ///
    /// Cost      one pass over each given array. The search costs as much as one among the originals plus one
    ///           between originals and images.
    /// Errors    `Error` for arrays that don't have one value per original.
    [[nodiscard]] Filter filter(const Filter& originals = {});

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

using PeriodicImages3f = PeriodicImages<3, float>;

JOSTLE_NAMESPACE_END
