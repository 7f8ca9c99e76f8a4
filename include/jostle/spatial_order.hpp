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

/// Neighbours in space made neighbours in memory. What works through boxes, pairs and bodies is faster then,
/// because whatever belongs together is fetched together.
///
///     std::vector<std::uint32_t> order(boxes.size());
///     jostle::spatial_order(boxes, order);                      // now and then, such as every 100 frames
///     jostle::apply_order(order, boxes, positions, velocities); // all that is numbered like the boxes

JOSTLE_NAMESPACE_BEGIN

/// Writes an order of the boxes along space: order[k] is the position of the box that comes k-th.
///
/// Order     boxes that lie near each other come near each other, along a Z-curve through their centres.
///           Boxes much larger than most come behind all others. A few boxes that lie in about the same place
///           keep their order, so that sorted boxes which have moved a bit stay almost as they are. The order
///           depends on the boxes alone, not on threads, instruction set, or a host that flushes denormals.
/// Cost      linear, and up to one and a half times that of searching them once. 32 bytes a box of memory.
/// Errors    `Error` for the lowest box that is NaN or inverted; size_mismatch unless `order` has one element
///           per box; too_many_objects for more than 2^32 - 1 boxes. Nothing is written then.
/// Threads   may be called by several threads at a time.
/// Source    Morton, A computer oriented geodetic data base and a new technique in file sequencing (1966).
template <int Dim, Coordinate T>
void spatial_order(const BoxView<Dim, T>& boxes, std::span<std::uint32_t> order,
                   const FinderOptions& options = {});
template <BoxContainer Boxes>
void spatial_order(const Boxes& boxes, std::span<std::uint32_t> order, const FinderOptions& options = {})
{
    spatial_order(box_view(boxes), order, options);
}

namespace detail {
/// The `Error` for an order of this length and an array that has `size` elements.
[[noreturn]] JOSTLE_API void throw_not_ordered(std::size_t order, std::size_t size, std::size_t array);
/// The `Error` unless each number below order.size() is in there once.
JOSTLE_API void check_order(std::span<const std::uint32_t> order);

/// What lies one after another in an array: a vector, a span, a C array.
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

/// Puts the elements of arrays into an order: the k-th becomes the one that was at order[k].
///
///     jostle::apply_order(order, boxes, velocities, names);
///
/// The arrays are vectors, spans or C arrays, with one element each for every one of `order`; moving an
/// element mustn't throw. Results of searches name positions: everything that is numbered like the
/// boxes has to be put in order, too. A `World` needs nothing, for it goes by ids.
///
/// Errors    `Error`, before anything is moved: size_mismatch for an array that is longer or shorter;
///           invalid_argument for an order that doesn't have every position once. `std::bad_alloc`, after
///           which some arrays may be in order and others not.
/// Threads   works on default_executor(), or on the one that comes first; one call at a time for the same
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
