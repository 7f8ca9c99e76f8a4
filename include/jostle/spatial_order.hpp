// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <memory_resource>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include "jostle/box.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/process.hpp"
#include "jostle/version.hpp"

/// Sorts arrays so that neighbours in space are neighbours in memory. Loops over boxes, pairs and bodies then
/// run faster, because what belongs together is fetched together.
///
///     std::vector<std::uint32_t> order(boxes.size());
///     jostle::spatial_order(boxes, order);                      // now and then, such as every 100 frames
///     jostle::apply_order(order, boxes, positions, velocities); // all arrays numbered like the boxes

JOSTLE_NAMESPACE_BEGIN

namespace detail {
template <int Dim, Coordinate T>
JOSTLE_API void write_spatial_order(const BoxView<Dim, T>& boxes, std::span<std::uint32_t> order,
                                    const FinderOptions& options);
}

/// Writes a spatial order of the boxes: order[k] is the position of the k-th box.
///
/// Order     boxes near each other in space are near each other in the order, along a Z-curve through their
///           centres. Boxes much larger than most come last. Boxes in about the same place keep their order,
///           so sorted boxes that have moved a little stay almost sorted. The order depends only on the
///           boxes, not on threads, instruction set, or whether the host flushes denormals.
/// Cost      linear: up to 1.5 times one search of the boxes. 32 bytes of memory a box.
/// Errors    `Error` for the lowest box that is NaN or inverted; size_mismatch unless `order` has one element
///           per box; too_many_objects for more than 2^32 - 1 boxes. Nothing is written then.
/// Threads   several threads may call it at a time.
/// Source    Morton, A computer oriented geodetic data base and a new technique in file sequencing (1966).
template <AnyBoxes Boxes>
void spatial_order(const Boxes& boxes, std::span<std::uint32_t> order, const FinderOptions& options = {})
{
    detail::write_spatial_order(box_view(boxes), order, options);
}

namespace detail {
/// The `Error` for an order and an array of different lengths.
[[noreturn]] JOSTLE_API void throw_not_ordered(std::size_t order, std::size_t size, std::size_t array);
/// Throws an `Error` unless each number below order.size() occurs once.
JOSTLE_API void check_order(std::span<const std::uint32_t> order);

/// The element type of a contiguous array: a vector, a span, a C array.
template <class Array>
using ValueIn = std::remove_reference_t<decltype(*std::data(std::declval<Array&>()))>;

template <class Array>
void apply_order_to(Executor* executor, std::span<const std::uint32_t> order, Array& array)
{
    using Value = ValueIn<Array>;
    struct Free
    {
        void operator()(Value* memory) const { std::allocator<Value>().deallocate(memory, size); }
        std::size_t size;
    };
    const std::size_t count = order.size();
    if (count == 0) return;
    const std::unique_ptr<Value, Free> sorted(std::allocator<Value>().allocate(count), Free{count});
    Value* const from = std::data(array);
    Value* const to = sorted.get();
    const ProcessOptions blocks{executor, 4096};
    process_items(
        count,
        [&](std::uint64_t begin, std::uint64_t end, Work) {
            for (std::uint64_t k = begin; k < end; ++k)
                std::construct_at(to + k, std::move(from[order[k]]));
        },
        blocks);
    process_items(
        count,
        [&](std::uint64_t begin, std::uint64_t end, Work) {
            for (std::uint64_t k = begin; k < end; ++k) {
                from[k] = std::move(to[k]);
                std::destroy_at(to + k);
            }
        },
        blocks);
}

template <class... Arrays>
void apply_order_on(Executor* executor, std::span<const std::uint32_t> order, Arrays&... arrays)
{
    std::size_t number = 0;
    const auto check = [&](std::size_t size) {
        if (size != order.size()) throw_not_ordered(order.size(), size, number);
        ++number;
    };
    (check(std::size(arrays)), ...);
    check_order(order);
    (apply_order_to(executor, order, arrays), ...);
}
} // namespace detail

/// Reorders the elements of arrays: the k-th becomes the one that was at order[k].
///
///     jostle::apply_order(order, boxes, velocities, names);
///
/// The arrays are vectors, spans or C arrays, each as long as `order`; moving an element mustn't throw.
/// Results of searches name positions, so everything that is numbered like the boxes must be reordered too. A
/// `World` is not affected, since it goes by ids.
///
/// Errors    `Error`, before anything is moved: size_mismatch for an array of another length;
///           invalid_argument for an order that doesn't have every position once. `std::bad_alloc`, after
///           which some arrays may be reordered and others not.
/// Threads   runs on default_executor(), or on the executor given first; one call at a time for the same
///           arrays.
template <class... Arrays>
    requires(std::is_nothrow_move_constructible_v<detail::ValueIn<Arrays>> && ...)
void apply_order(std::span<const std::uint32_t> order, Arrays&&... arrays)
{
    detail::apply_order_on(nullptr, order, arrays...);
}
template <class... Arrays>
    requires(std::is_nothrow_move_constructible_v<detail::ValueIn<Arrays>> && ...)
void apply_order(Executor& executor, std::span<const std::uint32_t> order, Arrays&&... arrays)
{
    detail::apply_order_on(&executor, order, arrays...);
}

JOSTLE_NAMESPACE_END
