// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "core/arrays.hpp"
#include "core/users.hpp"

namespace jostle_python {

class Shape
{
  public:
    Shape(int given_dim, ShapeHandle given) : dim(given_dim), handle(std::move(given)) {}
    int dim;
    std::shared_ptr<jostle_shape> handle; // shared with what is being made of it
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
        const Users::Reading now(users);
        std::uint64_t count = 0;
        call([&](jostle_error* error) { return jostle_size(handle.get(), &count, error); });
        return count;
    }
    /// Calls f(shapes, error), which changes them.
    template <class F>
    void change(F&& f)
    {
        const Users::Changing now(users);
        call([&](jostle_error* error) { return f(handle.get(), error); });
    }
    void set_repeats(bool wish)
    {
        change([&](auto* shapes, auto* error) {
            return jostle_shapes_set_repeats(shapes, wish ? 1 : 0, error);
        });
        repeats = wish;
    }
    int dim;
    mutable Users users{"list of shapes"};
    ShapesHandle handle;
    bool repeats = false;
};

/// Shapes and poses, or motions.
struct Objects
{
    Objects(const Shapes& shapes, const py::array& rows, jostle_space space, bool moving, const char* name)
        : kept(rows), now_(shapes.users), dim_(dim_of(space)), repeats_(shapes.repeats)
    {
        if (shapes.dim != dim_)
            refuse("the shapes are in " + std::to_string(shapes.dim) + "D, and they must be in " +
                   std::to_string(dim_) + "D");
        const bool flat = dim_ == 2;
        const py::ssize_t width = moving ? (flat ? 7 : 13) : (flat ? 4 : 7);
        want_number(rows, space, name);
        const auto packed = [&] { // NumPy's strides are 0 of nothing
            return rows.size() == 0 || rows.strides(1) == rows.itemsize();
        };
        if (rows.ndim() != 2 || rows.shape(1) != width || !packed())
            refuse(std::string(name) + " has the shape " + shape_text(rows) + ": it must be (n, " +
                   std::to_string(width) + ") with packed rows");
        view.shapes = shapes.handle.get();
        view.poses = {rows.data(), static_cast<std::uint64_t>(rows.shape(0)), rows.strides(0)};
    }
    Objects(const Objects&) = delete;

    /// Makes `part` some of the objects, of which there are as many shapes as poses, until the next call.
    jostle_status part_of(std::uint64_t first, std::uint64_t count, jostle_objects& part, jostle_error* error)
    {
        part = view;
        if (count == view.poses.count) return JOSTLE_OK;
        jostle_shapes* some = some_.get();
        jostle_status status = JOSTLE_OK;
        if (some == nullptr) {
            status = jostle_shapes_new(dim_, &some, error);
            if (status == JOSTLE_OK) some_.reset(some);
        } else {
            status = jostle_clear(some, error);
        }
        if (status == JOSTLE_OK) status = add_shapes(some, first, count, error);
        part.shapes = some;
        part.poses.count = count;
        part.poses.data =
            static_cast<const char*>(view.poses.data) + static_cast<std::int64_t>(first) * view.poses.stride;
        return status;
    }
    /// Refuses another number of shapes than of poses, unless the shapes repeat.
    void want_pose_each(const char* name) const
    {
        std::uint64_t count = 0;
        call([&](jostle_error* error) { return jostle_size(view.shapes, &count, error); });
        const bool fits = repeats_ && count != 0 && view.poses.count % count == 0;
        if (count != view.poses.count && !fits)
            raise_error("size_mismatch",
                        std::string(name) + " has " + std::to_string(view.poses.count) +
                            " rows, and there are " + std::to_string(count) + " shapes",
                        py::none());
    }
    py::array kept;
    jostle_objects view{};

  private:
    /// Adds the shapes of some of the objects.
    jostle_status add_shapes(jostle_shapes* some, std::uint64_t first, std::uint64_t count,
                             jostle_error* error) const
    {
        if (!repeats_) return jostle_shapes_add_from(some, view.shapes, first, count, error);
        std::uint64_t size = 0;
        jostle_status status = jostle_size(view.shapes, &size, error);
        while (status == JOSTLE_OK && count != 0) {
            const std::uint64_t from = first % size, run = std::min(count, size - from);
            status = jostle_shapes_add_from(some, view.shapes, from, run, error);
            first += run;
            count -= run;
        }
        return status;
    }

    Users::Reading now_;
    int dim_;
    bool repeats_;
    ShapesHandle some_;
};

} // namespace jostle_python
