// SPDX-License-Identifier: MIT
// What shapes point to.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/contact.hpp"
#include "narrow/math.hpp"
#include "narrow/shapes/mesh_tree.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Formats a number for a message, short also if it is tiny or huge.
std::string text(double number);

/// Coordinates are stored per axis and padded to whole groups of this many by repeating the first vertex,
/// so that a pass over them needs no tail.
inline constexpr std::uint32_t lanes = 8;
inline constexpr std::uint32_t padded(std::uint32_t n)
{
    return (n + lanes - 1) / lanes * lanes;
}

/// Face 0 has the edge from v[0] to v[1], face 1 the other way. A lone edge has no faces.
struct Edge
{
    std::uint32_t v[2], face[2];
};

/// A polytope: vertices, outward face planes, and each face's outline counterclockwise seen from outside: the
/// convex polygon of all vertices in the face's plane up to rounding. A flat one has two faces, a straight
/// one no face and one edge, a point neither. It doesn't own the memory.
struct Polytope
{
    std::uint32_t vertices = 0, faces = 0, edges = 0, directions = 0;
    const double* x = nullptr; ///< y and z follow, `stride` apart
    std::uint32_t stride = 0;
    const double* nx = nullptr; ///< face normals, same way, `face_stride` apart
    std::uint32_t face_stride = 0;
    const double* offset = nullptr; ///< of face planes, padded like nx; only if every edge has two faces
    const std::uint32_t* outline_begin = nullptr; ///< faces + 1 positions in `outline`
    const std::uint32_t* outline = nullptr;
    const Edge* edge = nullptr;
    const Vec3* direction = nullptr; ///< of edges, unit, parallel ones once
    Vec3 middle;                     ///< of the vertices; 0 of smooth cores

    [[nodiscard]] Vec3 vertex(std::uint32_t i) const { return {x[i], x[stride + i], x[2 * stride + i]}; }
    [[nodiscard]] Vec3 normal(std::uint32_t f) const
    {
        return {nx[f], nx[face_stride + f], nx[2 * face_stride + f]};
    }
};

template <>
struct HullData<3> : std::enable_shared_from_this<HullData<3>>
{
    std::vector<Vec<3, double>> corners;
    std::vector<double> coordinates, normals, offsets;
    std::vector<std::uint32_t> loop_begin, loop; ///< each face's corners; each edge belongs to two faces
    std::vector<std::uint32_t> outline_begin, outline;
    std::vector<Edge> edge;
    std::vector<Vec3> direction;
    double reach = 0;
    bool sharp = false; ///< two faces that share an edge are back to back within 8 degrees
    Polytope polytope;
};

template <>
struct HullData<2> : std::enable_shared_from_this<HullData<2>>
{
    std::vector<Vec<2, double>> corners; ///< as given in order
    std::vector<Vec2> loop;              ///< counterclockwise
    std::vector<Vec2> normal;            ///< of the side from loop[i] to the next, unit, outwards
    std::vector<std::uint32_t> corner;   ///< of loop[i], its position in `corners`
    double reach = 0;
};

/// A box tree over a mesh's elements or a compound's children, in preorder: a node's first child follows it.
struct TreeNode
{
    double lo[3], hi[3];
    std::uint32_t skip;  ///< the node after this subtree
    std::uint32_t first; ///< of a leaf, its first position in `order`
    std::uint32_t count; ///< 0 for inner nodes
};

template <int Dim>
struct MeshData : std::enable_shared_from_this<MeshData<Dim>>
{
    std::vector<V<Dim>> vertices;
    /// Elements name the first of the vertices at the same place, or welded.
    std::vector<typename Mesh<Dim>::Element> elements;
    std::vector<TreeNode> nodes;
    std::vector<std::uint32_t> order; ///< elements, leaf by leaf
    /// at[first_at[v]] to at[first_at[v + 1]]: the elements that have vertex v.
    std::vector<std::uint32_t> first_at, at;
    MeshTree tree; ///< empty in the plane
    double reach = 0;

    [[nodiscard]] const V<Dim>& vertex(std::uint32_t v) const { return vertices[v]; }
    /// Visits the elements that have vertex v until visit() returns true.
    template <class Visit>
    void find_at(std::uint32_t v, Visit&& visit) const
    {
        for (std::uint32_t k = first_at[v]; k < first_at[v + 1]; ++k)
            if (visit(elements[at[k]])) return;
    }
    /// Visits the elements whose boxes are within `slack` of a point until visit() returns true.
    template <class Visit>
    void find_around(const V<Dim>& p, double slack, Visit&& visit) const
    {
        double lo[Dim], hi[Dim];
        for (int d = 0; d < Dim; ++d)
            lo[d] = p[d] - slack, hi[d] = p[d] + slack;
        for (std::uint32_t n = 0; n < nodes.size();) {
            const TreeNode& node = nodes[n];
            int apart = 0; // which is hard to predict: no branches
            for (int d = 0; d < Dim; ++d)
                apart |= int{hi[d] < node.lo[d]} | int{lo[d] > node.hi[d]};
            for (std::uint32_t k = 0; apart == 0 && k < node.count; ++k)
                if (visit(elements[order[node.first + k]])) return;
            n = apart != 0 ? node.skip : n + 1;
        }
    }
};

struct HeightData : std::enable_shared_from_this<HeightData>
{
    std::vector<double> heights;
    std::uint32_t columns = 0, rows = 0;
    double spacing_x = 1, spacing_z = 1;
    double thickness = 0; ///< as given
    double floor = 0;     ///< where the ground ends below
    double highest = 0;
    double reach = 0;

    /// Vertices are numbered row by row.
    [[nodiscard]] Vec3 vertex(std::uint32_t v) const
    {
        return {v % columns * spacing_x, heights[v], v / columns * spacing_z};
    }
    /// One of a cell's two triangles.
    [[nodiscard]] Mesh<3>::Element triangle(std::uint32_t x, std::uint32_t z, bool second) const
    {
        const std::uint32_t v = z * columns + x, w = v + columns + 1;
        return {v, second ? v + columns : w, second ? w : v + 1};
    }
    /// The triangle that contacts know by this number.
    [[nodiscard]] Mesh<3>::Element triangle(std::uint32_t number) const
    {
        const std::uint32_t cell = number / 2;
        return triangle(cell % (columns - 1), cell / (columns - 1), number % 2 != 0);
    }
    /// Visits the triangles that have vertex v until visit() returns true.
    template <class Visit>
    void find_at(std::uint32_t v, Visit&& visit) const
    {
        const std::uint32_t x = v % columns, z = v / columns;
        const bool left = x > 0, right = x + 1 < columns, above = z > 0, below = z + 1 < rows;
        (void)((left && above &&
                (visit(triangle(x - 1, z - 1, false)) || visit(triangle(x - 1, z - 1, true)))) ||
               (right && above && visit(triangle(x, z - 1, true))) ||
               (left && below && visit(triangle(x - 1, z, false))) ||
               (right && below && (visit(triangle(x, z, false)) || visit(triangle(x, z, true)))));
    }
};

template <int Dim>
struct CompoundData : std::enable_shared_from_this<CompoundData<Dim>>
{
    struct Child
    {
        Shape<Dim> shape;
        Frame<Dim> frame;
    };
    std::vector<Child> children;
    std::vector<typename Compound<Dim>::Child> given;
    std::vector<TreeNode> nodes;      ///< over boxes that contain the children, infinite ones too
    std::vector<std::uint32_t> order; ///< children, leaf by leaf
    double reach = 0;
    double extent = 0; ///< the same for the finite ones
};

/// A shape's type as an enumeration: a switch over it without a default doesn't compile if a kind is missing.
/// docs/inside/contacts.md describes how to add one.
enum class Kind : ShapeType
{
    sphere = ShapeTypes::sphere,
    capsule = ShapeTypes::capsule,
    box = ShapeTypes::box,
    convex = ShapeTypes::convex,
    half_space = ShapeTypes::half_space,
    mesh = ShapeTypes::mesh,
    height_field = ShapeTypes::height_field,
    compound = ShapeTypes::compound,
    rounded_box = ShapeTypes::rounded_box,
    rounded_hull = ShapeTypes::rounded_hull,
    cylinder = ShapeTypes::cylinder,
    cone = ShapeTypes::cone,
    ellipsoid = ShapeTypes::ellipsoid,
    custom = ShapeTypes::first_custom ///< and all above
};
template <int Dim>
Kind kind_of(const Shape<Dim>& shape)
{
    return shape.type() >= ShapeTypes::first_custom ? Kind::custom : Kind{shape.type()};
}
/// Whether shapes of a type have special cases: kernels, simple3.hpp, gaps3.hpp. These are the first three
/// types, so that tables have a row for each.
constexpr bool is_simple(ShapeType type) noexcept
{
    return type <= ShapeTypes::box;
}
static_assert(ShapeTypes::sphere == 0 && ShapeTypes::capsule == 1 && ShapeTypes::box == 2);

/// Whether shapes of a kind consist of parts, which are then found one by one.
constexpr bool consists_of_parts(Kind kind) noexcept
{
    switch (kind) {
    case Kind::mesh:
    case Kind::height_field:
    case Kind::compound:
        return true;
    case Kind::sphere:
    case Kind::capsule:
    case Kind::box:
    case Kind::convex:
    case Kind::half_space:
    case Kind::rounded_box:
    case Kind::rounded_hull:
    case Kind::cylinder:
    case Kind::cone:
    case Kind::ellipsoid:
    case Kind::custom:
        break;
    }
    return false;
}
/// Whether a shape's parts are elements of a surface that continues beyond their ends.
template <int Dim>
bool is_surface(const Shape<Dim>& shape)
{
    return shape.type() == ShapeTypes::mesh || shape.type() == ShapeTypes::height_field;
}
/// A shape that isn't convex but consists of convex parts.
template <int Dim>
bool has_parts(const Shape<Dim>& shape)
{
    return is_surface(shape) || shape.type() == ShapeTypes::compound;
}

struct ShapeAccess
{
    template <int Dim>
    static const Vec<Dim, double>& size(const Shape<Dim>& shape)
    {
        return shape.size_;
    }
    template <int Dim>
    static double radius(const Shape<Dim>& shape)
    {
        return shape.radius_;
    }
    /// The radius of a ball around the local origin that contains the shape; infinite for half-spaces.
    template <int Dim>
    static double reach(const Shape<Dim>& shape)
    {
        return shape.type_ == ShapeTypes::half_space ? HUGE_VAL : shape.reach_;
    }
    /// A cylinder or a cone along y, no point of which is further from the centre than its rims.
    static Shape<3> with_rims(ShapeType type, double half_length, double radius)
    {
        Shape<3> shape;
        shape.type_ = type;
        shape.size_ = {radius, half_length, radius};
        shape.reach_ = length(Vec3{radius, half_length, 0});
        return shape;
    }
    template <class Data, int Dim>
    static const Data& data(const Shape<Dim>& shape)
    {
        return *static_cast<const Data*>(shape.data_);
    }
    template <class Value>
    static const auto& data_of(const Value& value)
    {
        return *value.data_;
    }
    /// The hull, mesh and so on that a shape points to, if it is of one of these types.
    template <class Value, int Dim>
    static std::optional<Value> value_of(const Shape<Dim>& shape, std::initializer_list<ShapeType> types)
    {
        using Data = std::remove_cvref_t<decltype(*std::declval<Value&>().data_)>;
        if (std::find(types.begin(), types.end(), shape.type_) == types.end()) return {};
        return Value(data<Data>(shape).shared_from_this());
    }
    template <class Value, class Data>
    static void set(Value& value, std::shared_ptr<const Data> data)
    {
        value.data_ = std::move(data);
    }
    template <int Dim>
    static void fill(Shape<Dim>& shape, ShapeType type, double reach, const void* data)
    {
        shape.type_ = type;
        shape.reach_ = reach;
        shape.data_ = data;
    }
};

} // namespace narrow
JOSTLE_NAMESPACE_END
