// SPDX-License-Identifier: MIT
#include "c_api/shapes.hpp"

#include <algorithm>
#include <cstring>

namespace jostle::c_api {
namespace {

template <class F>
void in_dimensions(std::int32_t dim, F&& inside)
{
    if (dim == 2)
        inside(std::integral_constant<int, 2>{});
    else if (dim == 3)
        inside(std::integral_constant<int, 3>{});
    else
        refuse("dim is " + std::to_string(dim) + ": it must be 2 or 3");
}

template <int Dim>
Vec<Dim, double> vector_of(const double* numbers, const char* name)
{
    wanted_array(numbers, Dim, name);
    Vec<Dim, double> vector;
    for (int d = 0; d < Dim; ++d)
        vector[d] = numbers[d];
    return vector;
}

template <int Dim>
void hand_out_shape(jostle_shape** out, Shape<Dim> shape, std::shared_ptr<const Owned<Dim>> owned = nullptr)
{
    auto content = std::make_unique<ShapeContent>();
    content->shape = OneShape<Dim>{shape, std::move(owned)};
    hand_out(out, std::move(content));
}

/// Makes room for `count` more shapes, of which `owning`, counted from the first, may point to something.
template <int Dim>
void make_room(ManyShapes<Dim>& many, std::uint64_t count, std::uint64_t owning)
{
    const std::size_t before = many.shapes.size();
    if (count > UINT32_MAX || before + count > UINT32_MAX)
        refuse("more than 2^32 - 1 shapes", JOSTLE_TOO_MANY_OBJECTS);
    // By half at least: to add shapes one by one mustn't copy all of them each time.
    const auto reserve_more = [](auto& list, std::size_t wanted) {
        if (wanted > list.capacity()) list.reserve(std::max(wanted, list.capacity() + list.capacity() / 2));
    };
    reserve_more(many.shapes, before + static_cast<std::size_t>(count));
    if (owning == 0) return;
    reserve_more(many.owned, before + static_cast<std::size_t>(owning));
    many.owned.resize(before);
}

/// Appends what make(i) makes for each i, or nothing: then the error says which. They point to nothing.
template <int Dim, class F>
void append_shapes(ManyShapes<Dim>& many, std::uint64_t count, F&& make)
{
    make_room(many, count, 0);
    const std::size_t before = many.shapes.size();
    try {
        for_each_object(static_cast<std::size_t>(count),
                        [&](std::size_t i) { many.shapes.push_back(make(i)); });
    } catch (const Failure&) {
        many.shapes.resize(before);
        throw;
    }
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_shape_sphere(int32_t dim, double radius, jostle_shape** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_dimensions(dim, [&](auto in) { hand_out_shape<in()>(out, Shape<in()>::sphere(radius)); });
    });
}
jostle_status jostle_shape_capsule(int32_t dim, double half_length, double radius, jostle_shape** out,
                                   jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_dimensions(dim,
                      [&](auto in) { hand_out_shape<in()>(out, Shape<in()>::capsule(half_length, radius)); });
    });
}
jostle_status jostle_shape_box(int32_t dim, const double* half, double radius, jostle_shape** out,
                               jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_dimensions(dim, [&](auto in) {
            const auto edges = vector_of<in()>(half, "half");
            hand_out_shape<in()>(out, radius == 0 ? Shape<in()>::box(edges)
                                                  : Shape<in()>::rounded_box(edges, radius));
        });
    });
}
jostle_status jostle_shape_cylinder(double half_length, double radius, jostle_shape** out,
                                    jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out_shape<3>(out, Shape<3>::cylinder(half_length, radius));
    });
}
jostle_status jostle_shape_cone(double half_length, double radius, jostle_shape** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out_shape<3>(out, Shape<3>::cone(half_length, radius));
    });
}
jostle_status jostle_shape_ellipsoid(int32_t dim, const double* half, jostle_shape** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_dimensions(dim, [&](auto in) {
            hand_out_shape<in()>(out, Shape<in()>::ellipsoid(vector_of<in()>(half, "half")));
        });
    });
}
jostle_status jostle_shape_half_space(int32_t dim, const double* normal, double offset, jostle_shape** out,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_dimensions(dim, [&](auto in) {
            hand_out_shape<in()>(out, Shape<in()>::half_space(vector_of<in()>(normal, "normal"), offset));
        });
    });
}
jostle_status jostle_shape_hull(jostle_space space, const void* points, uint64_t count, double radius,
                                jostle_shape** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_space(space, [&](auto in) {
            constexpr int dim = decltype(in)::dim;
            using Point = Vec<dim, typename decltype(in)::T>;
            auto owned = std::make_shared<Owned<dim>>();
            const ConvexHull<dim>& hull = owned->hull.emplace(
                std::span(wanted_array_of<Point>(points, count, "points"), static_cast<std::size_t>(count)));
            const Shape<dim> shape = radius == 0 ? Shape<dim>(hull) : Shape<dim>::rounded_hull(hull, radius);
            hand_out_shape<dim>(out, shape, std::move(owned));
        });
    });
}
jostle_status jostle_shape_mesh(jostle_space space, const void* vertices, uint64_t vertex_count,
                                const uint32_t* elements, uint64_t element_count, double weld,
                                jostle_shape** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_space(space, [&](auto in) {
            constexpr int dim = decltype(in)::dim;
            using Point = Vec<dim, typename decltype(in)::T>;
            using Element = typename Mesh<dim>::Element;
            auto owned = std::make_shared<Owned<dim>>();
            owned->mesh.emplace(std::span(wanted_array_of<Point>(vertices, vertex_count, "vertices"),
                                          static_cast<std::size_t>(vertex_count)),
                                std::span(wanted_array_of<Element>(static_cast<const void*>(elements),
                                                                   element_count, "elements"),
                                          static_cast<std::size_t>(element_count)),
                                weld);
            const Shape<dim> shape(*owned->mesh);
            hand_out_shape<dim>(out, shape, std::move(owned));
        });
    });
}
jostle_status jostle_shape_height_field(jostle_space space, const void* heights, uint32_t columns,
                                        uint32_t rows, double spacing_x, double spacing_z, double thickness,
                                        jostle_shape** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_space(space, [&](auto in) {
            using T = typename decltype(in)::T;
            if constexpr (decltype(in)::dim == 3) {
                const std::uint64_t count = static_cast<std::uint64_t>(columns) * rows;
                auto owned = std::make_shared<Owned<3>>();
                owned->field.emplace(HeightGrid<T>{
                    std::span(wanted_array_of<T>(heights, count, "heights"), static_cast<std::size_t>(count)),
                    columns, rows, static_cast<T>(spacing_x), static_cast<T>(spacing_z),
                    static_cast<T>(thickness)});
                const Shape<3> shape(*owned->field);
                hand_out_shape<3>(out, shape, std::move(owned));
            } else {
                refuse("a height field is in 3D: the space must be JOSTLE_3F or JOSTLE_3D");
            }
        });
    });
}
jostle_status jostle_shape_compound(int32_t dim, const jostle_shape* const* children, const double* poses,
                                    uint64_t count, jostle_shape** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_dimensions(dim, [&](auto in) {
            constexpr int d = in();
            wanted_array(children, count, "children");
            const auto* const placed =
                wanted_array_of<Pose<d, double>>(static_cast<const void*>(poses), count, "poses");
            auto owned = std::make_shared<Owned<d>>();
            std::vector<typename Compound<d>::Child> parts;
            for (std::uint64_t i = 0; i < count; ++i) {
                const OneShape<d>& child = shape_of<d>(children[i], "a child");
                parts.push_back({child.shape, placed[i]});
                if (child.owned != nullptr) owned->children.push_back(child.owned);
            }
            owned->compound.emplace(std::span<const typename Compound<d>::Child>(parts));
            const Shape<d> shape(*owned->compound);
            hand_out_shape<d>(out, shape, std::move(owned));
        });
    });
}
jostle_status jostle_shape_custom(int32_t dim, jostle_shape_type type, double radius,
                                  jostle_support_function support, void* context, jostle_shape** out,
                                  jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        if (type < JOSTLE_SHAPE_FIRST_CUSTOM || type > UINT16_MAX)
            refuse("the type is " + std::to_string(type) + ": a user's own are from 16 to 65535");
        in_dimensions(dim, [&](auto in) {
            constexpr int d = in();
            auto owned = std::make_shared<Owned<d>>();
            owned->custom.emplace(radius, support, context);
            const Shape<d> shape(*owned->custom, static_cast<ShapeType>(type));
            hand_out_shape<d>(out, shape, std::move(owned));
        });
    });
}
jostle_status jostle_shape_info_read(const jostle_shape* shape, jostle_shape_info* info, jostle_error* error)
{
    return guarded(error, [&] {
        const ShapeContent& content = open(shape);
        wanted(info, "info");
        std::visit([&](const auto& one) { *info = info_of(one.shape); }, content.shape);
    });
}
jostle_status jostle_shape_vertices(const jostle_shape* shape, const double** vertices, uint64_t* count,
                                    jostle_error* error)
{
    return guarded(error, [&] {
        const ShapeContent& content = open(shape);
        wanted(vertices, "vertices");
        wanted(count, "count");
        std::visit(
            [&](const auto& one) {
                using Corners = std::span<const std::remove_cvref_t<decltype(one.owned->corners.front())>>;
                Corners corners;
                if (one.owned != nullptr && one.owned->hull) {
                    corners = one.owned->hull->vertices();
                } else if (one.owned != nullptr && one.owned->mesh) {
                    std::call_once(one.owned->copied,
                                   [&] { one.owned->corners = one.owned->mesh->vertices(); });
                    corners = one.owned->corners;
                } else {
                    refuse("the shape is neither a hull nor a mesh");
                }
                *vertices = corners.empty() ? nullptr : corners.front().data();
                *count = corners.size();
            },
            content.shape);
    });
}
jostle_status jostle_shape_face_count(const jostle_shape* shape, uint64_t* count, jostle_error* error)
{
    return guarded(error, [&] {
        const ShapeContent& content = open(shape);
        wanted(count, "count");
        std::visit(
            [&](const auto& one) {
                if (one.owned != nullptr && one.owned->hull)
                    *count = one.owned->hull->face_count();
                else if (one.owned != nullptr && one.owned->mesh)
                    *count = one.owned->mesh->size();
                else
                    refuse("the shape is neither a hull nor a mesh");
            },
            content.shape);
    });
}
jostle_status jostle_shape_face(const jostle_shape* shape, uint64_t face, const uint32_t** corners,
                                uint64_t* count, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(corners, "corners");
        wanted(count, "count");
        std::visit(
            [&]<int Dim>(const OneShape<Dim>& one) {
                const auto number = [&](std::size_t faces, const char* of) {
                    if (face >= faces)
                        refuse("the " + std::string(of) + " has " + std::to_string(faces) +
                               " faces, and none of number " + std::to_string(face));
                    return static_cast<std::size_t>(face);
                };
                const bool is_mesh = one.owned != nullptr && one.owned->mesh;
                const bool is_hull = Dim == 3 && one.owned != nullptr && one.owned->hull;
                if (!is_mesh && !is_hull) refuse("the shape is neither a hull in 3D nor a mesh");
                std::span<const std::uint32_t> found;
                if (is_mesh) found = one.owned->mesh->elements()[number(one.owned->mesh->size(), "mesh")];
                if constexpr (Dim == 3)
                    if (is_hull) found = one.owned->hull->face(number(one.owned->hull->face_count(), "hull"));
                *corners = found.data();
                *count = found.size();
            },
            open(shape).shape);
    });
}

static_assert(JOSTLE_SHAPE_COMPOUND == ShapeTypes::compound &&
              JOSTLE_SHAPE_ROUNDED_BOX == ShapeTypes::rounded_box &&
              JOSTLE_SHAPE_ROUNDED_HULL == ShapeTypes::rounded_hull &&
              JOSTLE_SHAPE_CYLINDER == ShapeTypes::cylinder && JOSTLE_SHAPE_CONE == ShapeTypes::cone &&
              JOSTLE_SHAPE_ELLIPSOID == ShapeTypes::ellipsoid &&
              JOSTLE_SHAPE_ELLIPSOID + 1 == ShapeTypes::end);

// --- One per object ---

jostle_status jostle_shapes_new(int32_t dim, jostle_shapes** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        in_dimensions(dim, [&](auto in) {
            auto content = std::make_unique<ShapesContent>();
            content->shapes.template emplace<ManyShapes<in()>>();
            hand_out(out, std::move(content));
        });
    });
}
jostle_status jostle_shapes_add(jostle_shapes* shapes, const jostle_shape* shape, uint64_t count,
                                jostle_error* error)
{
    return guarded(error, [&] {
        std::visit(
            [&]<int Dim>(ManyShapes<Dim>& many) {
                const OneShape<Dim>& one = shape_of<Dim>(shape, "shape");
                make_room(many, count, one.owned == nullptr ? 0 : count);
                many.shapes.insert(many.shapes.end(), static_cast<std::size_t>(count), one.shape);
                if (one.owned != nullptr)
                    many.owned.insert(many.owned.end(), static_cast<std::size_t>(count), one.owned);
            },
            open(shapes).shapes);
    });
}
jostle_status jostle_shapes_add_spheres(jostle_shapes* shapes, const double* radii, uint64_t count,
                                        jostle_error* error)
{
    return guarded(error, [&] {
        std::visit(
            [&]<int Dim>(ManyShapes<Dim>& many) {
                wanted_array(radii, count, "radii");
                append_shapes(many, count, [&](std::uint64_t i) { return Shape<Dim>::sphere(radii[i]); });
            },
            open(shapes).shapes);
    });
}
jostle_status jostle_shapes_add_capsules(jostle_shapes* shapes, const double* half_lengths,
                                         const double* radii, uint64_t count, jostle_error* error)
{
    return guarded(error, [&] {
        std::visit(
            [&]<int Dim>(ManyShapes<Dim>& many) {
                wanted_array(half_lengths, count, "half_lengths");
                wanted_array(radii, count, "radii");
                append_shapes(many, count, [&](std::uint64_t i) {
                    return Shape<Dim>::capsule(half_lengths[i], radii[i]);
                });
            },
            open(shapes).shapes);
    });
}
jostle_status jostle_shapes_add_boxes(jostle_shapes* shapes, const double* halves, uint64_t count,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        std::visit(
            [&]<int Dim>(ManyShapes<Dim>& many) {
                const auto* const all =
                    wanted_array_of<Vec<Dim, double>>(static_cast<const void*>(halves), count, "halves");
                append_shapes(many, count, [&](std::uint64_t i) { return Shape<Dim>::box(all[i]); });
            },
            open(shapes).shapes);
    });
}
jostle_status jostle_shapes_add_from(jostle_shapes* shapes, const jostle_shapes* from, uint64_t first,
                                     uint64_t count, jostle_error* error)
{
    return guarded(error, [&] {
        std::visit(
            [&]<int Dim>(ManyShapes<Dim>& many) {
                const auto* const given = std::get_if<ManyShapes<Dim>>(&open(from).shapes);
                if (given == nullptr) refuse("from isn't a list of shapes in " + std::to_string(Dim) + "D");
                const std::uint64_t size = given->shapes.size();
                if (first > size || count > size - first)
                    refuse("first is " + std::to_string(first) + " and count " + std::to_string(count) +
                           ", and from has " + std::to_string(size) + " shapes");
                const std::uint64_t owning_end = std::min<std::uint64_t>(first + count, given->owned.size());
                make_room(many, count, owning_end > first ? owning_end - first : 0);
                // By number: both may be the same list.
                for (auto i = static_cast<std::size_t>(first); i < first + count; ++i)
                    many.shapes.push_back(given->shapes[i]);
                for (auto i = static_cast<std::size_t>(first); i < owning_end; ++i)
                    many.owned.push_back(given->owned[i]);
            },
            open(shapes).shapes);
    });
}
jostle_status jostle_shapes_set(jostle_shapes* shapes, uint64_t object, const jostle_shape* shape,
                                jostle_error* error)
{
    return guarded(error, [&] {
        std::visit(
            [&]<int Dim>(ManyShapes<Dim>& many) {
                const OneShape<Dim>& one = shape_of<Dim>(shape, "shape");
                if (object >= many.shapes.size())
                    refuse("there are " + std::to_string(many.shapes.size()) +
                               " shapes, and none of number " + std::to_string(object),
                           JOSTLE_INVALID_ARGUMENT, object);
                const auto place = static_cast<std::size_t>(object);
                if (one.owned != nullptr && many.owned.size() <= place) many.owned.resize(place + 1);
                if (place < many.owned.size()) many.owned[place] = one.owned;
                many.shapes[place] = one.shape;
            },
            open(shapes).shapes);
    });
}
jostle_status jostle_shapes_set_repeats(jostle_shapes* shapes, int32_t repeats, jostle_error* error)
{
    return guarded(error, [&] { open(shapes).repeats = repeats != 0; });
}

jostle_status jostle_bounds(jostle_space space, const jostle_objects* objects, double margin,
                            jostle_executor* executor, void* boxes, jostle_error* error)
{
    return guarded(error, [&] {
        const auto kept = executor == nullptr ? nullptr : keep_executor(executor);
        in_space(space, [&](auto in) {
            constexpr int dim = decltype(in)::dim;
            using T = typename decltype(in)::T;
            const auto given = objects_of<Objects, dim, T>(objects, "objects");
            const std::size_t count = given.shapes.size();
            auto* const out = wanted_array_of<Aabb<dim, T>>(boxes, count, "boxes");
            bounds(given, std::span(out, count), static_cast<T>(margin),
                   kept == nullptr ? serial_executor() : *kept);
        });
    });
}

} // extern "C"
