// SPDX-License-Identifier: MIT
#include "core/shapes.hpp"

#include <cstring>
#include <vector>

#include "core/interrupts.hpp"
#include "core/module.hpp"

namespace jostle_python {

namespace {

template <class F>
Shape make_shape(int dim, F&& f)
{
    return {dim, make<ShapeHandle>(f)};
}
/// The same of what takes long where it has many points; f has all that it reads.
template <class F>
Shape make_shape_of(std::uint64_t points, int dim, F f)
{
    constexpr std::uint64_t few = 1000; // a millisecond or so
    return points <= few ? make_shape(dim, std::move(f)) : Shape(dim, make_apart<ShapeHandle>(std::move(f)));
}
std::vector<char> copy_of(const py::array& array)
{
    const auto* const bytes = static_cast<const char*>(array.data());
    return {bytes, bytes + array.nbytes()};
}

} // namespace

void define_shapes(py::module_& m)
{
    define_class<Shape>(
        m, "Shape",
        "One collision shape, immutable: made by sphere, capsule, box, cylinder, cone,\n"
        "ellipsoid, half_space, hull, mesh, height_field, compound, rounded_box and rounded_hull.")
        .def_readonly("dim", &Shape::dim)
        .def("info",
             [](const Shape& self) {
                 jostle_shape_info info{};
                 call([&](jostle_error* error) {
                     return jostle_shape_info_read(self.handle.get(), &info, error);
                 });
                 return py::make_tuple(info.type, info.radius,
                                       std::vector<double>(info.size, info.size + info.dim), info.offset);
             })
        .def("vertices",
             [](const Shape& self) {
                 const double* vertices = nullptr;
                 std::uint64_t count = 0;
                 call([&](jostle_error* error) {
                     return jostle_shape_vertices(self.handle.get(), &vertices, &count, error);
                 });
                 F64 out({static_cast<py::ssize_t>(count), py::ssize_t(self.dim)});
                 if (count != 0)
                     std::memcpy(out.mutable_data(), vertices, static_cast<std::size_t>(out.nbytes()));
                 return out;
             })
        .def("faces", [](const Shape& self) {
            std::uint64_t count = 0;
            call([&](jostle_error* error) {
                return jostle_shape_face_count(self.handle.get(), &count, error);
            });
            py::list faces;
            for (std::uint64_t i = 0; i < count; ++i) {
                const std::uint32_t* corners = nullptr;
                std::uint64_t n = 0;
                call([&](jostle_error* error) {
                    return jostle_shape_face(self.handle.get(), i, &corners, &n, error);
                });
                faces.append(copy_array(corners, n));
            }
            return faces;
        });
    m.def("sphere", [](int dim, double radius) {
        return make_shape(
            dim, [&](auto** out, auto* error) { return jostle_shape_sphere(dim, radius, out, error); });
    });
    m.def("capsule", [](int dim, double half, double radius) {
        return make_shape(dim, [&](auto** out, auto* error) {
            return jostle_shape_capsule(dim, half, radius, out, error);
        });
    });
    m.def("box", [](const F64& half, double radius) {
        const int dim = static_cast<int>(length_of(half, "half"));
        const double* const data = half.data();
        return make_shape(
            dim, [&](auto** out, auto* error) { return jostle_shape_box(dim, data, radius, out, error); });
    });
    m.def("cylinder", [](double half, double radius) {
        return make_shape(
            3, [&](auto** out, auto* error) { return jostle_shape_cylinder(half, radius, out, error); });
    });
    m.def("cone", [](double half, double radius) {
        return make_shape(
            3, [&](auto** out, auto* error) { return jostle_shape_cone(half, radius, out, error); });
    });
    m.def("ellipsoid", [](const F64& half) {
        const int dim = static_cast<int>(length_of(half, "half"));
        const double* const data = half.data();
        return make_shape(
            dim, [&](auto** out, auto* error) { return jostle_shape_ellipsoid(dim, data, out, error); });
    });
    m.def("half_space", [](const F64& normal, double offset) {
        const int dim = static_cast<int>(length_of(normal, "normal"));
        const double* const data = normal.data();
        return make_shape(dim, [&](auto** out, auto* error) {
            return jostle_shape_half_space(dim, data, offset, out, error);
        });
    });
    m.def("hull", [](jostle_space space, const Array& points, double radius) {
        const auto count = static_cast<std::uint64_t>(points.ndim() == 2 ? points.shape(0) : 0);
        want_rows(points, space, dim_of(space), count, "points");
        return make_shape_of(count, dim_of(space), [=, data = copy_of(points)](auto** out, auto* error) {
            return jostle_shape_hull(space, data.data(), count, radius, out, error);
        });
    });
    m.def("mesh", [](jostle_space space, const Array& vertices, const U32& elements, double weld) {
        const auto count = static_cast<std::uint64_t>(vertices.ndim() == 2 ? vertices.shape(0) : 0);
        want_rows(vertices, space, dim_of(space), count, "vertices");
        if (elements.ndim() != 2 || elements.shape(1) != dim_of(space))
            refuse("elements has the shape " + shape_text(elements) + ": it must be (m, " +
                   std::to_string(dim_of(space)) + ")");
        std::vector<std::uint32_t> indices(elements.data(), elements.data() + elements.size());
        const auto element_count = static_cast<std::uint64_t>(elements.shape(0));
        return make_shape_of(
            element_count, dim_of(space),
            [=, data = copy_of(vertices), indices = std::move(indices)](auto** out, auto* error) {
                return jostle_shape_mesh(space, data.data(), count, indices.data(), element_count, weld, out,
                                         error);
            });
    });
    m.def("height_field", [](const F64& heights, double spacing_x, double spacing_z, double thickness) {
        if (heights.ndim() != 2)
            refuse("heights has the shape " + shape_text(heights) + ": it must be (rows, columns)");
        if (heights.shape(0) > UINT32_MAX || heights.shape(1) > UINT32_MAX) refuse("heights are too many");
        const void* const data = heights.data();
        const auto rows = static_cast<std::uint32_t>(heights.shape(0));
        const auto columns = static_cast<std::uint32_t>(heights.shape(1));
        return make_shape(3, [&](auto** out, auto* error) {
            return jostle_shape_height_field(JOSTLE_3D, data, columns, rows, spacing_x, spacing_z, thickness,
                                             out, error);
        });
    });
    m.def("compound", [](int dim, const std::vector<const Shape*>& children, const F64& poses) {
        std::vector<const jostle_shape*> handles;
        for (const Shape* child : children) {
            if (child == nullptr) refuse("a child is None");
            handles.push_back(child->handle.get());
        }
        want_rows(poses, dim == 2 ? JOSTLE_2D : JOSTLE_3D, dim == 2 ? 4 : 7, handles.size(), "poses");
        const double* const data = poses.data();
        return make_shape(dim, [&](auto** out, auto* error) {
            return jostle_shape_compound(dim, handles.data(), data, handles.size(), out, error);
        });
    });
    define_class<Shapes>(m, "Shapes")
        .def(py::init<int>())
        .def_readonly("dim", &Shapes::dim)
        .def_property(
            "repeats", [](const Shapes& self) { return self.repeats; }, &Shapes::set_repeats)
        .def("size", &Shapes::size)
        .def("clear", [](Shapes& self) { self.change(jostle_clear); })
        .def("add",
             [](Shapes& self, const Shape& shape, std::uint64_t count) {
                 self.change([&](auto* shapes, auto* error) {
                     return jostle_shapes_add(shapes, shape.handle.get(), count, error);
                 });
             })
        .def("add_from",
             [](Shapes& self, const Shapes& from) {
                 const std::uint64_t count = from.size();
                 std::optional<Users::Reading> now;
                 if (&from != &self) now.emplace(from.users);
                 self.change([&](auto* shapes, auto* error) {
                     return jostle_shapes_add_from(shapes, from.handle.get(), 0, count, error);
                 });
             })
        .def("set",
             [](Shapes& self, std::uint64_t object, const Shape& shape) {
                 self.change([&](auto* shapes, auto* error) {
                     return jostle_shapes_set(shapes, object, shape.handle.get(), error);
                 });
             })
        .def("add_spheres",
             [](Shapes& self, const F64& radii) {
                 const std::uint64_t count = length_of(radii, "radii");
                 const double* const data = radii.data();
                 self.change([&](auto* shapes, auto* error) {
                     return jostle_shapes_add_spheres(shapes, data, count, error);
                 });
             })
        .def("add_capsules",
             [](Shapes& self, const F64& half_lengths, const F64& radii) {
                 const std::uint64_t count = length_of(radii, "radii");
                 want_length(half_lengths, count, "half_lengths");
                 const double *const halves = half_lengths.data(), *const data = radii.data();
                 self.change([&](auto* shapes, auto* error) {
                     return jostle_shapes_add_capsules(shapes, halves, data, count, error);
                 });
             })
        .def("add_boxes", [](Shapes& self, const F64& halves) {
            if (halves.ndim() != 2 || halves.shape(1) != self.dim)
                refuse("halves has the shape " + shape_text(halves) + ": it must be (n, " +
                       std::to_string(self.dim) + ")");
            const double* const data = halves.data();
            const auto count = static_cast<std::uint64_t>(halves.shape(0));
            self.change([&](auto* shapes, auto* error) {
                return jostle_shapes_add_boxes(shapes, data, count, error);
            });
        });
    m.def("bounds", [](jostle_space space, const Shapes& shapes, const Array& poses, double margin) {
        Objects objects(shapes, poses, space, false, "poses");
        objects.want_pose_each("poses");
        Array out(number_of(space), {static_cast<py::ssize_t>(objects.view.poses.count), py::ssize_t(2),
                                     py::ssize_t(dim_of(space))});
        auto* const data = static_cast<char*>(out.mutable_data());
        const auto size = static_cast<std::uint64_t>(out.strides(0));
        const Executor executor =
            make<Executor>([](auto** made, auto* error) { return jostle_executor_default(0, made, error); });
        call_in_parts(objects.view.poses.count, nullptr, [&](auto first, auto count, jostle_error* error) {
            jostle_objects some;
            const jostle_status status = objects.part_of(first, count, some, error);
            if (status != JOSTLE_OK) return status;
            return jostle_bounds(space, &some, margin, executor.get(), data + first * size, error);
        });
        return out;
    });
}

} // namespace jostle_python
