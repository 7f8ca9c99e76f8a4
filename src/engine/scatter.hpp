// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/brick_store.hpp"
#include "engine/kernels/kernels.hpp"
#include "engine/record.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// Stores boxes as records in the bricks of a grid.
template <int Dim, class T>
class Scatter
{
  public:
    /// `unit` is working memory. The grid's bricks are those of the store from `first_brick` on.
    Scatter(const Kernels& kernels, const Boxes<Dim, T>& boxes, const Grid<T>& grid, Unit<T>& unit,
            BrickStore& store, std::uint32_t first_brick = 0)
        : kernels_(kernels), boxes_(boxes), grid_(grid), unit_(unit), store_(store), first_brick_(first_brick)
    {
    }

    /// The units of one set: those of the first are numbered first.
    static std::uint32_t units_of(std::size_t boxes)
    {
        return static_cast<std::uint32_t>((boxes + unit_size - 1) / unit_size);
    }
    static std::uint32_t units_of(const Boxes<Dim, T>& boxes)
    {
        return units_of(boxes.a.size()) + units_of(boxes.b.size());
    }
    /// Stores one unit of the call's boxes. Returns false, and stores none, if one of them is NaN or
    /// inverted.
    bool add_unit(std::uint32_t number);
    /// Stores the boxes of records, which keep their copy flags: a nested grid.
    void add_records(const Record* records, std::uint32_t count);

  private:
    void append_unit();
    void append_wide(std::uint32_t i);

    const Kernels& kernels_;
    const Boxes<Dim, T>& boxes_;
    const Grid<T>& grid_;
    Unit<T>& unit_;
    BrickStore& store_;
    const std::uint32_t first_brick_;
};

} // namespace engine
JOSTLE_NAMESPACE_END
