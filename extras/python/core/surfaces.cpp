// SPDX-License-Identifier: MIT
// Surfaces that bend.
#include <string>
#include <vector>

#include "core/arrays.hpp"
#include "core/interrupts.hpp"
#include "core/module.hpp"
#include "core/users.hpp"

namespace jostle_python {

namespace {

using SurfaceHandle = Owned<jostle_surface>;
using SurfaceFinderHandle = Owned<jostle_surface_finder>;

class Surface
{
  public:
    Surface(const U32& triangles, const U32& edges, const U32& points, std::uint64_t vertices)
    {
        jostle_surface_parts given{};
        given.triangle_count = count_of(triangles, 3, "triangles");
        given.triangles = triangles.data();
        given.edge_count = count_of(edges, 2, "edges");
        given.edges = edges.data();
        given.point_count = length_of(points, "points");
        given.points = points.data();
        given.vertices = vertices;
        handle = make<SurfaceHandle>(
            [&](auto** out, auto* error) { return jostle_surface_new(&given, out, error); });
        call([&](jostle_error* error) { return jostle_surface_parts_read(handle.get(), &parts, error); });
    }
    SurfaceHandle handle;
    jostle_surface_parts parts{}; // as long as the handle

  private:
    static std::uint64_t count_of(const U32& array, py::ssize_t width, const char* name)
    {
        if (array.ndim() != 2 || array.shape(1) != width)
            refuse(std::string(name) + " has the shape " + shape_text(array) + ": it must be (n, " +
                   std::to_string(width) + ")");
        return static_cast<std::uint64_t>(array.shape(0));
    }
};

/// Some of a surface's numbers, where they lie: `self` keeps them.
py::array parts_array(const py::object& self, const std::uint32_t* from, std::vector<py::ssize_t> shape)
{
    py::array array(py::dtype::of<std::uint32_t>(), std::move(shape), {}, from, self);
    array.attr("flags").attr("writeable") = false;
    return array;
}

/// What the options of a search read, one for each vertex.
struct SurfaceGiven
{
    SurfaceGiven(jostle_space space, const Surface& surface, const Maybe& thickness, const Maybe& rest,
                 const std::optional<U32>& bodies, double tolerance)
    {
        const std::uint64_t count = surface.parts.vertices;
        options.struct_size = sizeof options;
        options.tolerance = tolerance;
        if (thickness) {
            want_number(*thickness, space, "thickness");
            if (thickness->ndim() != 1 || static_cast<std::uint64_t>(thickness->shape(0)) != count ||
                (thickness->flags() & Array::c_style) == 0)
                refuse("thickness has the shape " + shape_text(*thickness) + ": it must be (" +
                       std::to_string(count) + ",), one for each vertex");
            options.thickness = thickness->data();
        }
        if (rest) {
            want_rows(*rest, space, 3, count, "rest");
            options.rest = rest->data();
        }
        if (bodies) {
            if (length_of(*bodies, "bodies") != count)
                refuse("bodies has the shape " + shape_text(*bodies) + ": it must be (" +
                       std::to_string(count) + ",), one for each vertex");
            options.bodies = bodies->data();
        }
    }
    jostle_surface_options options{};
};

/// Keeps its memory from one search to the next of positions of the same type.
class SurfaceFinder
{
  public:
    explicit SurfaceFinder(std::uint32_t threads) : threads_(threads) {}

    py::tuple near(const Surface& surface, const Array& positions, double distance, const Maybe& thickness,
                   const Maybe& rest, const std::optional<U32>& bodies, const py::dtype& type)
    {
        const Users::Changing now(users_); // until what is found is copied
        const std::uint64_t count = prepare(positions);
        const SurfaceGiven given(space_, surface, thickness, rest, bodies, 0);
        jostle_near_surface found{};
        memory_.call([&](jostle_error* error) {
            return jostle_surface_finder_near(finder_.get(), surface.handle.get(), positions.data(), count,
                                              distance, &given.options, &found, error);
        });
        return py::make_tuple(items(found.vertex_triangle, type), items(found.edge_edge, type));
    }
    py::tuple moving(const Surface& surface, const Array& start, const Array& end, double distance,
                     const Maybe& thickness, const Maybe& rest, const std::optional<U32>& bodies,
                     double tolerance, const py::dtype& type)
    {
        const Users::Changing now(users_);
        const std::uint64_t count = prepare(start);
        want_rows(end, space_, 3, count, "end");
        const SurfaceGiven given(space_, surface, thickness, rest, bodies, tolerance);
        jostle_moving_surface found{};
        memory_.call([&](jostle_error* error) {
            return jostle_surface_finder_moving(finder_.get(), surface.handle.get(), start.data(), end.data(),
                                                count, distance, &given.options, &found, error);
        });
        return py::make_tuple(items(found.vertex_triangle, type), items(found.edge_edge, type),
                              found.safe_step);
    }
    py::array crossings(const Surface& surface, const Array& positions, const std::optional<U32>& bodies)
    {
        const Users::Changing now(users_);
        const std::uint64_t count = prepare(positions);
        const SurfaceGiven given(space_, surface, std::nullopt, std::nullopt, bodies, 0);
        jostle_blocks found{};
        memory_.call([&](jostle_error* error) {
            return jostle_surface_finder_crossings(finder_.get(), surface.handle.get(), positions.data(),
                                                   count, &given.options, &found, error);
        });
        return copy_pairs(found); // a crossing is two numbers as well
    }
    void release_memory()
    {
        const Users::Changing now(users_);
        if (finder_ != nullptr)
            call([&](jostle_error* error) { return jostle_release_memory(finder_.get(), error); });
    }

  private:
    /// Sees to a finder of their type; how many there are.
    std::uint64_t prepare(const Array& positions)
    {
        const jostle_space space = space_of(3, positions.dtype().equal(py::dtype::of<float>()));
        const auto count = static_cast<std::uint64_t>(positions.ndim() == 2 ? positions.shape(0) : 0);
        want_rows(positions, space, 3, count, "positions");
        if (finder_ != nullptr && space_ == space) return count;
        const Executor executor = executor_of(threads_);
        const jostle_options options = options_of(executor, memory_.allocator());
        finder_ = make<SurfaceFinderHandle>(
            [&](auto** out, auto* error) { return jostle_surface_finder_new(space, &options, out, error); });
        space_ = space;
        return count;
    }
    /// A copy, since the finder's memory is used again.
    static py::array items(const jostle_blocks& found, const py::dtype& type)
    {
        if (found.item_size != static_cast<std::uint64_t>(type.itemsize()))
            refuse("the dtype isn't that of what is found");
        py::array out(type, std::vector<py::ssize_t>{static_cast<py::ssize_t>(found.count)});
        void* const data = out.mutable_data();
        call([&](jostle_error* error) { return jostle_blocks_copy(&found, found.count, data, error); });
        return out;
    }

    std::uint32_t threads_;
    Users users_{"surface finder"};
    Interruptible memory_;
    SurfaceFinderHandle finder_;
    jostle_space space_ = JOSTLE_3D;
};

/// Of pairs with four vertices each, 12 numbers.
std::uint64_t pairs_given(const F64& positions, const char* name)
{
    const auto count = static_cast<std::uint64_t>(positions.ndim() == 2 ? positions.shape(0) : 0);
    want_rows(positions, JOSTLE_3D, 12, count, name);
    return count;
}

F64 part_impacts(jostle_part_kind kind, const F64& start, const F64& end, double distance, double tolerance)
{
    const std::uint64_t count = pairs_given(start, "start");
    want_rows(end, JOSTLE_3D, 12, count, "end");
    F64 out(static_cast<py::ssize_t>(count));
    double* const times = out.mutable_data();
    const double *const from = start.data(), *const to = end.data();
    call_in_parts(count, nullptr, [&](std::uint64_t first, std::uint64_t some, jostle_error* error) {
        return jostle_part_impacts(kind, from + 12 * first, to + 12 * first, some, distance, tolerance,
                                   times + first, error);
    });
    return out;
}

F64 part_distances(jostle_part_kind kind, const F64& positions)
{
    const std::uint64_t count = pairs_given(positions, "positions");
    F64 out({static_cast<py::ssize_t>(count), py::ssize_t(8)});
    double* const distances = out.mutable_data();
    const double* const from = positions.data();
    call_in_parts(count, nullptr, [&](std::uint64_t first, std::uint64_t some, jostle_error* error) {
        return jostle_part_distances(kind, from + 12 * first, some, distances + 8 * first, error);
    });
    return out;
}

} // namespace

void define_surfaces(py::module_& m)
{
    define_class<Surface>(m, "Surface")
        .def(py::init<const U32&, const U32&, const U32&, std::uint64_t>())
        .def("vertices", [](const Surface& self) { return self.parts.vertices; })
        .def("triangles",
             [](const py::object& self) {
                 const jostle_surface_parts& of = self.cast<const Surface&>().parts;
                 return parts_array(self, of.triangles, {static_cast<py::ssize_t>(of.triangle_count), 3});
             })
        .def("edges",
             [](const py::object& self) {
                 const jostle_surface_parts& of = self.cast<const Surface&>().parts;
                 return parts_array(self, of.edges, {static_cast<py::ssize_t>(of.edge_count), 2});
             })
        .def("points", [](const py::object& self) {
            const jostle_surface_parts& of = self.cast<const Surface&>().parts;
            return parts_array(self, of.points, {static_cast<py::ssize_t>(of.point_count)});
        });
    define_class<SurfaceFinder>(m, "SurfaceFinder")
        .def(py::init<std::uint32_t>())
        .def("near", &SurfaceFinder::near)
        .def("moving", &SurfaceFinder::moving)
        .def("crossings", &SurfaceFinder::crossings)
        .def("release_memory", &SurfaceFinder::release_memory);
    m.def("part_impacts", &part_impacts);
    m.def("part_distances", &part_distances);
}

} // namespace jostle_python
