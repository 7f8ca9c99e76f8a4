// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/error.hpp"
#include "jostle/pose.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace narrow {
template <int Dim>
struct HullData;
template <int Dim>
struct MeshData;
template <int Dim>
struct CompoundData;
struct HeightData;
struct ShapeAccess;
} // namespace narrow

namespace detail {

template <class Range>
using ItemOf = std::remove_cvref_t<decltype(std::declval<const Range&>()[std::size_t{}])>;

/// Coordinate `axis` of item i of a range of vectors, or of a flat range of their numbers.
template <int Dim, class Range>
constexpr auto number_of(const Range& range, std::size_t i, int axis)
{
    if constexpr (std::is_arithmetic_v<ItemOf<Range>>)
        return range[i * axes<Dim> + static_cast<std::size_t>(axis)];
    else
        return VectorTraits<ItemOf<Range>>::get(range[i], axis);
}
template <int Dim, class Range>
using NumberIn = decltype(number_of<Dim>(std::declval<const Range&>(), 0, 0));

/// Containers and views of vectors of any type, or of a flat range of their numbers.
template <class Range, int Dim>
concept PointRange = requires(const Range& range) {
    std::size(range);
    requires VectorLike<ItemOf<Range>, Dim> || std::is_arithmetic_v<ItemOf<Range>>;
};
template <class Range, int Dim>
concept ElementRange = PointRange<Range, Dim> && std::integral<NumberIn<Dim, Range>>;
template <int Dim, class Range>
using PointIn = Vec<Dim, std::conditional_t<std::same_as<NumberIn<Dim, Range>, float>, float, double>>;

[[noreturn]] JOSTLE_API void throw_not_whole(std::size_t numbers, std::size_t of_each);

/// The input as items of Dim numbers each: in place if possible, else a copy. An index below 0 or of more
/// than 32 bits becomes the greatest number, which is out of range.
template <int Dim, class Item, class Range>
auto items_of(const Range& range)
{
    if constexpr (std::convertible_to<const Range&, std::span<const Item>>) {
        return std::span<const Item>(range);
    } else {
        constexpr std::size_t each = std::is_arithmetic_v<ItemOf<Range>> ? axes<Dim> : 1;
        if (std::size(range) % each != 0) throw_not_whole(std::size(range), each);
        std::vector<Item> items(std::size(range) / each);
        for (std::size_t i = 0; i < items.size(); ++i)
            for (int axis = 0; axis < Dim; ++axis) {
                auto& to = items[i][static_cast<std::size_t>(axis)];
                using To = std::remove_reference_t<decltype(to)>;
                const auto from = number_of<Dim>(range, i, axis);
                to = static_cast<To>(from);
                if constexpr (std::integral<To>)
                    if (!std::in_range<To>(from)) to = ~To{0};
            }
        return items;
    }
}

} // namespace detail

/// The convex hull of points: in 3D a polyhedron, in 2D a polygon.
///
/// Points   any array, vector, span or StridedView of vectors, such as Vec3f, Eigen's, or your own (see
///          VectorTraits), or of numbers: Dim for each point, one after another.
/// Valid    at least one point, coordinates within 1e60. Flat, straight and one-point hulls are valid, of any
///          size.
/// Exact    which side of a face a point is on is decided exactly. Then faces are merged that are coplanar up
///          to 8 roundings (of std::numeric_limits<T>::epsilon() times the largest coordinate). So are
///          collinear edges, and hulls as nearly flat or straight become so. No given point ends up outside
///          the hull by more than 40 such roundings, nor by more than 1/1600 of the hull's extent.
/// Order    vertices() are the given points that are corners, in the given order. Features of contacts number
///          vertices, edges and faces modulo 16384: from about 5000 corners on (three edges each) two
///          features of a hull can have the same number.
/// Value    copies its input. Copies of the object share the same read-only memory.
/// Threads  const members from any number of threads.
/// Cost     O(n * faces) to build. A contact with a hull costs one pass over its vertices for each step of
///          the search. If there are more than a few hundred vertices, simplify the points first.
/// Errors   `Error` naming the lowest point that is not finite; `std::bad_alloc`.
template <int Dim>
class JOSTLE_API ConvexHull
{
  public:
    template <detail::PointRange<Dim> Points>
    explicit ConvexHull(const Points& points)
    {
        using Point = detail::PointIn<Dim, Points>;
        build(std::span<const Point>(detail::items_of<Dim, Point>(points)));
    }
    [[nodiscard]] std::span<const Vec<Dim, double>> vertices() const noexcept;
    /// Returns the number of faces in 3D, of edges in 2D. Coplanar faces count as one.
    [[nodiscard]] std::size_t face_count() const noexcept;
    /// Returns the corners of one face as positions in vertices(), counterclockwise seen from outside.
    [[nodiscard]] std::span<const std::uint32_t> face(std::size_t i) const noexcept
        requires(Dim == 3);

  private:
    friend struct narrow::ShapeAccess;
    explicit ConvexHull(std::shared_ptr<const narrow::HullData<Dim>> data) noexcept : data_(std::move(data))
    {
    }
    template <Coordinate T>
    void build(std::span<const Vec<Dim, T>> points);
    std::shared_ptr<const narrow::HullData<Dim>> data_;
};

/// A rigid surface: triangles in 3D; in 2D a chain or any set of segments. It has no inside: objects are
/// pushed out the shortest way.
///
/// Joints   elements are joined where their corners are at the same place, even with different indices, and
///          where sides of coplanar triangles lie on each other (in 2D, ends on segments of one line). A body
///          that moves over a joint doesn't catch on it. Degenerate triangles and segments that lie on sides
///          of others have no contacts of their own.
/// Valid    finite vertices, at least one element, indices below the number of vertices. Triangles without
///          area are valid: they are segments or points.
/// Vertices any array, vector, span or StridedView of vectors or of numbers, as for a ConvexHull. Elements
///          likewise: of arrays or vectors of indices, or of indices, Dim for each, one after another.
/// Order    part numbers in contacts are positions in `elements`.
/// Value    copies its input. Copies of the object share the same read-only memory.
/// Cost     O(n log n) to build, about 2 us an element; 200 bytes an element (350 in 3D).
/// Errors   `Error` that names the first vertex that isn't finite, or the first element with an index out of
///          range; also if there are no elements, or more than (2^32 - 1) / Dim, or if `weld` is negative or
///          not finite.
template <int Dim>
class JOSTLE_API Mesh
{
  public:
    using Element = std::array<std::uint32_t, static_cast<std::size_t>(Dim)>; ///< indices of vertices

    /// Vertices within the distance `weld` of an earlier one are moved to it, unless that one was moved
    /// itself. This closes cracks between pieces whose coordinates differ by rounding.
    template <detail::PointRange<Dim> Points, detail::ElementRange<Dim> Elements = std::vector<Element>>
    Mesh(const Points& vertices, const Elements& elements, double weld = 0)
    {
        using Point = detail::PointIn<Dim, Points>;
        build(std::span<const Point>(detail::items_of<Dim, Point>(vertices)),
              std::span<const Element>(detail::items_of<Dim, Element>(elements)), weld);
    }
    [[nodiscard]] std::size_t size() const noexcept; ///< elements
    /// Returns a copy of the vertices, in the order given.
    [[nodiscard]] std::vector<Vec<Dim, double>> vertices() const;
    /// Returns the elements in the order given. Where vertices coincide or are welded, they name the first.
    [[nodiscard]] std::span<const Element> elements() const noexcept;

  private:
    friend struct narrow::ShapeAccess;
    explicit Mesh(std::shared_ptr<const narrow::MeshData<Dim>> data) noexcept : data_(std::move(data)) {}
    template <Coordinate T>
    void build(std::span<const Vec<Dim, T>> vertices, std::span<const Element> elements, double weld);
    std::shared_ptr<const narrow::MeshData<Dim>> data_;
};

/// Terrain: heights (local y) over a regular grid in the local x-z plane, solid below.
///
/// Shape    columns x rows heights, row by row; height [row * columns + column] is at x = column * spacing_x,
///          z = row * spacing_z. Each cell is two triangles that share the diagonal from its corner of lowest
///          x and z to its opposite.
/// Valid    at least 2 x 2 finite heights, fewer than 2^32 triangles, spacings above 0.
/// Ground   extends from the surface down to `thickness` (at least a cell's width) below the lowest height,
///          and pushes bodies in it up. There is none beside the rim or further down. time_of_impact() and
///          shape_cast() handle its sides and its underside. For contacts() and distance(), a body whose
///          centre is beside the rim meets only the surface, and its distance is to the part of the surface
///          below it. If such a body is level with the rim or lower and doesn't meet the surface, there is no
///          distance.
/// Contacts one for each direction, see Contact. A body that rolls over the edge between two triangles
///          doesn't catch on it; on a ridge the contact is that of the nearest triangle.
/// Order    part 2 * (row * (columns - 1) + column) is the cell's triangle towards x, and the next part the
///          one towards z.
template <Coordinate T>
struct HeightGrid
{
    std::span<const T> heights;
    std::uint32_t columns, rows;
    T spacing_x, spacing_z;
    T thickness = 0; ///< of the ground below the lowest height
};
class JOSTLE_API HeightField
{
  public:
    explicit HeightField(const HeightGrid<float>& grid);
    explicit HeightField(const HeightGrid<double>& grid);
    /// Returns the grid it was made from. The heights are valid as long as the field or a copy of it exists.
    [[nodiscard]] HeightGrid<double> grid() const noexcept;

  private:
    friend struct narrow::ShapeAccess;
    explicit HeightField(std::shared_ptr<const narrow::HeightData> data) noexcept : data_(std::move(data)) {}
    std::shared_ptr<const narrow::HeightData> data_;
};

template <int Dim>
class Shape;

/// Several shapes that move as one.
///
/// Valid    at least one child; children of any type except meshes, height fields and compounds.
/// Order    part numbers in contacts are positions in `children`.
/// Cost     children are found by a tree of boxes, which takes some 1.5 us a child to build. A ray or a body
///          that meets few children costs the logarithm of their number.
/// Value    copies share the same read-only memory. Hulls and custom shapes of the children must outlive it.
template <int Dim>
class JOSTLE_API Compound
{
  public:
    struct Child
    {
        Shape<Dim> shape;
        Pose<Dim, double> pose;
    };
    explicit Compound(std::span<const Child> children);
    [[nodiscard]] std::span<const Child> children() const noexcept; ///< as given

  private:
    friend struct narrow::ShapeAccess;
    explicit Compound(std::shared_ptr<const narrow::CompoundData<Dim>> data) noexcept : data_(std::move(data))
    {
    }
    std::shared_ptr<const narrow::CompoundData<Dim>> data_;
};

/// The type of a shape, which selects the contact tests. Custom shapes have types from `first_custom` on.
using ShapeType = std::uint16_t;

struct ShapeTypes
{
    static constexpr ShapeType sphere = 0; ///< in 2D a circle
    static constexpr ShapeType capsule = 1;
    static constexpr ShapeType box = 2;
    static constexpr ShapeType convex = 3; ///< hull or polygon
    static constexpr ShapeType half_space = 4;
    static constexpr ShapeType mesh = 5;
    static constexpr ShapeType height_field = 6;
    static constexpr ShapeType compound = 7;
    static constexpr ShapeType rounded_box = 8;
    static constexpr ShapeType rounded_hull = 9; ///< or polygon
    static constexpr ShapeType cylinder = 10;
    static constexpr ShapeType cone = 11;
    static constexpr ShapeType ellipsoid = 12; ///< in 2D an ellipse
    static constexpr ShapeType end = 13;       ///< the library's types are below
    static constexpr ShapeType first_custom = 16;
};

/// A user-defined shape. Override `support` for a convex shape that can touch every other one. Or make
/// has_support() return false, and add a test for each type that it can touch (PairTest in contact.hpp).
///
/// Threads  called from several threads at a time; must not throw.
template <int Dim>
class JOSTLE_API CustomShape
{
  public:
    virtual ~CustomShape();
    /// Returns the radius of a ball around the local origin that contains the shape.
    [[nodiscard]] virtual double radius() const noexcept = 0;
    /// Returns a point of the shape furthest in `direction` (not zero, of any length), in local axes.
    [[nodiscard]] virtual Vec<Dim, double> support(const Vec<Dim, double>& direction) const noexcept;
    /// Returns false for a shape without a support function, which touches only types for which it has a
    /// test.
    [[nodiscard]] virtual bool has_support() const noexcept { return true; }
};

/// One collision shape in its local frame. It has 56 bytes (48 in 2D): the numbers of a simple shape, or a
/// pointer to a big one. Angles and rotations belong to the pose.
///
/// Units     the same length unit as the poses.
/// Lifetime  a Shape points to its hull, mesh, height field, compound or custom shape, which must outlive it.
///           Temporaries don't compile.
/// Errors    an `Error` that names the number, for a length that is negative, NaN or above 1e60, or a zero
///           normal. Shapes of zero size are valid: a sphere of radius 0 is a point.
template <int Dim>
class JOSTLE_API Shape
{
  public:
    /// A point.
    Shape() = default;

    /// In 2D a circle.
    [[nodiscard]] static Shape sphere(double radius);
    /// All points within `radius` of the segment from -half_length to +half_length on the local y axis.
    [[nodiscard]] static Shape capsule(double half_length, double radius);
    /// |x| <= half[0] and so on.
    [[nodiscard]] static Shape box(const Vec<Dim, double>& half);
    /// All points within `radius` of that box.
    [[nodiscard]] static Shape rounded_box(const Vec<Dim, double>& half, double radius);
    /// All points within `radius` of a hull.
    [[nodiscard]] static Shape rounded_hull(const ConvexHull<Dim>& hull, double radius);
    [[nodiscard]] static Shape rounded_hull(const ConvexHull<Dim>&& hull, double radius) = delete;
    /// All points within `radius` of the local y axis, from y = -half_length to +half_length.
    [[nodiscard]] static Shape cylinder(double half_length, double radius)
        requires(Dim == 3);
    /// A cone whose base is a disc of `radius` at y = -half_length, with its tip at y = +half_length.
    [[nodiscard]] static Shape cone(double half_length, double radius)
        requires(Dim == 3);
    /// An ellipsoid with semi-axes half[0], half[1] and half[2]; a ball if they are equal. In 2D an ellipse.
    [[nodiscard]] static Shape ellipsoid(const Vec<Dim, double>& half);
    /// The points p with normal . p <= offset * |normal|: everything below a plane. Two half-spaces have
    /// neither contacts nor a distance, and never count as touching.
    [[nodiscard]] static Shape half_space(const Vec<Dim, double>& normal, double offset);

    Shape(const ConvexHull<Dim>& hull) noexcept;
    Shape(const Mesh<Dim>& mesh) noexcept;
    Shape(const HeightField& field) noexcept
        requires(Dim == 3);
    Shape(const Compound<Dim>& compound) noexcept;
    /// `type` is at least ShapeTypes::first_custom.
    Shape(const CustomShape<Dim>& custom, ShapeType type);
    // A temporary would be destroyed before the shape is used: give it a name.
    Shape(const ConvexHull<Dim>&& hull) = delete;
    Shape(const Mesh<Dim>&& mesh) = delete;
    Shape(const HeightField&& field) = delete;
    Shape(const Compound<Dim>&& compound) = delete;
    Shape(const CustomShape<Dim>&& custom, ShapeType type) = delete;

    [[nodiscard]] ShapeType type() const noexcept { return type_; }
    /// Returns the radius of a sphere or capsule, or the rounding radius of a box or hull; else 0.
    [[nodiscard]] double radius() const noexcept { return radius_; }
    /// box: half edges; capsule: {0, half length, 0}; cylinder and cone: {radius, half length, radius};
    /// ellipsoid: its semi-axes; half-space: unit normal; else zeros.
    [[nodiscard]] const Vec<Dim, double>& size() const noexcept { return size_; }
    /// Returns the offset of a half-space; else 0.
    [[nodiscard]] double offset() const noexcept { return type_ == ShapeTypes::half_space ? reach_ : 0; }
    /// These return what the shape is made of, to draw or save it, or nothing for shapes of other types. The
    /// result shares the memory of what the shape points to.
    [[nodiscard]] std::optional<ConvexHull<Dim>> hull() const; ///< of rounded hulls as well
    [[nodiscard]] std::optional<Mesh<Dim>> mesh() const;
    [[nodiscard]] std::optional<HeightField> height_field() const
        requires(Dim == 3);
    [[nodiscard]] std::optional<Compound<Dim>> compound() const;
    [[nodiscard]] const CustomShape<Dim>* custom() const noexcept
    {
        return type_ >= ShapeTypes::first_custom ? static_cast<const CustomShape<Dim>*>(data_) : nullptr;
    }

  private:
    friend struct narrow::ShapeAccess;
    ShapeType type_ = ShapeTypes::sphere;
    double radius_ = 0;
    Vec<Dim, double> size_ = {};
    double reach_ = 0; // radius of a ball around the local origin that contains it; a half-space's offset
    const void* data_ = nullptr;
};

using Shape2 = Shape<2>;
using Shape3 = Shape<3>;
using ConvexHull2 = ConvexHull<2>;
using ConvexHull3 = ConvexHull<3>;
using Mesh2 = Mesh<2>;
using Mesh3 = Mesh<3>;

/// Returns the tightest box around a posed shape, rounded outwards, with `margin` (>= 0) added on every side,
/// for the broad phase. Shapes that touch have boxes that overlap. A half-space's box is infinite, except on
/// the side of its plane if that is perpendicular to an axis.
///
/// Errors   `Error` for a negative margin and for an invalid pose, which it names.
/// Source   Ericson, Real-Time Collision Detection (2005), sec. 4.2.6.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API Aabb<Dim, T> bounds(const Shape<Dim>& shape, const Pose<Dim, T>& pose,
                                             std::type_identity_t<T> margin = 0);

JOSTLE_NAMESPACE_END
