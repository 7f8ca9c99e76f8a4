// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <utility>

#include "core/arrays.hpp"

namespace jostle_python {

class Shape
{
  public:
    Shape(int given_dim, ShapeHandle given) : dim(given_dim), handle(std::move(given)) {}
    int dim;
    ShapeHandle handle;
};

class Shapes
{
  public:
    explicit Shapes(int given) : dim(given)
    {
        handle =
            make<ShapesHandle>([&](auto** out, auto* error) { return jostle_shapes_new(dim, out, error); });
    }
    [[nodiscard]] std::uint64_t size() const
    {
        std::uint64_t count = 0;
        call([&](jostle_error* error) { return jostle_shapes_size(handle.get(), &count, error); });
        return count;
    }
    int dim;
    ShapesHandle handle;
};

/// Shapes and poses, or motions.
struct Objects
{
    Objects(const Shapes& shapes, const py::array& rows, jostle_space space, bool moving, const char* name)
        : kept(rows)
    {
        const bool flat = dim_of(space) == 2;
        const py::ssize_t width = moving ? (flat ? 7 : 13) : (flat ? 4 : 7);
        want_number(rows, space, name);
        if (rows.ndim() != 2 || rows.shape(1) != width || rows.strides(1) != rows.itemsize())
            refuse(std::string(name) + " has the shape " + shape_text(rows) + ": it must be (n, " +
                   std::to_string(width) + ") with packed rows");
        view.shapes = shapes.handle.get();
        view.poses = {rows.data(), static_cast<std::uint64_t>(rows.shape(0)), rows.strides(0)};
    }
    py::array kept;
    jostle_objects view{};
};

} // namespace jostle_python
