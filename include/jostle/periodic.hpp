// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>

#include "jostle/box.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

struct PeriodicOptions
{
    /// Null means default_executor(). It must outlive the images.
    Executor* executor = nullptr;
    /// Where memory comes from.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
};

/// Space that repeats itself: what leaves on one side comes in on the other. Boxes near an end of a periodic
/// axis get images, shifted by periods, so that a search finds the pairs across the border as well.
///
///     jostle::PeriodicImages3f images;
///     images.build(boxes, {10, 10, 0}); // periodic along x and y
///     for (jostle::Pair pair : finder.find(images.boxes(), images.filter()))
///         meet(images.origin()[pair.a], images.origin()[pair.b], images.shift()[pair.b]);
///
/// Pairs     each pair of objects is found once: as no box reaches half a period, two touch by one shift at
///           the most. Of two that meet across a border the one with the greater coordinate has the image,
///           shifted down by a period: the first component of a shift that isn't 0 is negative.
/// Order     boxes() has the originals in their order, then the images by ascending origin, for any number of
///           threads. In a pair of this search a < b: `a` is an original, and `b` an original or an image.
/// Places    the boxes may lie anywhere, as long as they lie within less than two periods: with all centres
///           in one period, wherever that begins, they do.
/// Walls     a box that is infinite both ways along a periodic axis is its own image there. A pair with it
///           has no shift along that axis.
/// Exact     an image's bounds are the shifted ones, rounded outwards: no pair is lost by rounding.
/// Cost      two passes over the boxes and a copy of them: 10 ns a box. Images are made where they can touch
///           something: of what is no further from an end of the period than the largest box reaches.
/// Memory    is kept: a steady scene allocates nothing.
/// Threads   one call at a time; const members from any number of threads.
/// Errors    `Error` from build(), which leaves the images as they were: a box that is NaN or inverted, or
///           that is half a period long or longer; the lowest such box is named. A box whose upper bound is
///           two periods or more above the lowest bound of all boxes. A period that is negative, infinite or
///           NaN. More than 2^32 - 1 boxes and images. `std::bad_alloc`, which may leave no boxes.
/// Source    Allen and Tildesley, Computer Simulation of Liquids (1987), sec. 1.5.2.
template <int Dim, Coordinate T>
class JOSTLE_API PeriodicImages
{
  public:
    using Box = Aabb<Dim, T>;
    using Vector = Vec<Dim, T>;

    explicit PeriodicImages(const PeriodicOptions& options = {});
    PeriodicImages(PeriodicImages&&) noexcept;
    PeriodicImages& operator=(PeriodicImages&&) noexcept;
    ~PeriodicImages();

    /// Copies the boxes and adds the images. `period`: its length along each axis, 0 where space doesn't
    /// repeat itself.
    void build(const BoxView<Dim, T>& boxes, const Vector& period);

    /// How many boxes are originals: the first of boxes().
    [[nodiscard]] std::size_t originals() const noexcept;
    // The following are valid until the next build().

    /// Originals and images.
    [[nodiscard]] std::span<const Box> boxes() const noexcept;
    /// origin()[i] says whose image boxes()[i] is; an original is its own.
    [[nodiscard]] std::span<const std::uint32_t> origin() const noexcept;
    /// shift()[i] says how far boxes()[i] is from its origin: 0 for originals; for images 0 or a period along
    /// each axis. For contacts, an image's pose is that of its origin with this added to the position.
    [[nodiscard]] std::span<const Vector> shift() const noexcept;

    /// Returns the filter with which a search among boxes() finds each pair once: images don't meet images.
    /// The search sees to that by itself, whatever else is set on the filter, as long as its `images` stays.
    ///
    /// `originals` is the filter for the objects themselves: its arrays have one value per original, and its
    /// `accept` is called with two originals, in any order. It must outlive the search. The result is valid
    /// until the next build() or filter().
    ///
    /// A callback that has to know the shift is set on the result: it is called with numbers of boxes(), of
    /// which the first is an original's and the second is greater.
    ///
    ///     jostle::Filter filter = images.filter();
    ///     const auto accept = [&](std::uint32_t a, std::uint32_t b) {
    ///         return near(a, images.origin()[b], images.shift()[b]);
    ///     };
    ///     filter.accept = accept;
    ///
    /// Cost      one pass over each array that is given. The search costs as much as one for pairs among the
    ///           originals and one for pairs of an original and an image.
    /// Errors    `Error` for arrays that don't have one value per original.
    [[nodiscard]] Filter filter(const Filter& originals = {});

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

using PeriodicImages3f = PeriodicImages<3, float>;

JOSTLE_NAMESPACE_END
