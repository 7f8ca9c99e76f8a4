// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <memory>
#include <mutex>
#include <optional>
#include <type_traits>
#include <variant>
#include <vector>

#include "c_api/handles.hpp"
#include "jostle/contact.hpp"
#include "jostle/objects.hpp"
#include "jostle/shapes.hpp"

namespace jostle::c_api {

/// A user's own shape by its C function.
template <int Dim>
class CallbackShape final : public CustomShape<Dim>
{
  public:
    CallbackShape(double radius, jostle_support_function function, void* given)
        : context(given), radius_(radius), support_(function)
    {
    }
    [[nodiscard]] double radius() const noexcept override { return radius_; }
    [[nodiscard]] Vec<Dim, double> support(const Vec<Dim, double>& direction) const noexcept override
    {
        Vec<Dim, double> point{};
        if (support_ != nullptr) support_(context, direction.data(), point.data());
        return point;
    }
    [[nodiscard]] bool has_support() const noexcept override { return support_ != nullptr; }

    void* const context;

  private:
    double radius_;
    jostle_support_function support_;
};

/// What a shape points to.
template <int Dim>
struct Owned
{
    std::optional<ConvexHull<Dim>> hull;
    std::optional<Mesh<Dim>> mesh;
    std::optional<HeightField> field;
    std::optional<Compound<Dim>> compound;
    std::optional<CallbackShape<Dim>> custom;
    std::vector<std::shared_ptr<const Owned>> children;
    mutable std::once_flag copied;
    mutable std::vector<Vec<Dim, double>> corners; ///< of a mesh, once they have been asked for
};

template <int Dim>
struct OneShape
{
    Shape<Dim> shape;
    std::shared_ptr<const Owned<Dim>> owned; // null: nothing
};

class ShapeContent final : public Content
{
  public:
    std::variant<OneShape<2>, OneShape<3>> shape;
};

/// One shape per object. owned[i] is what shapes[i] points to; those beyond its end point to nothing, so that
/// a list of spheres needs no memory for it.
template <int Dim>
struct ManyShapes
{
    std::vector<Shape<Dim>> shapes;
    std::vector<std::shared_ptr<const Owned<Dim>>> owned;
};

class ShapesContent final : public Content
{
  public:
    bool clear() override
    {
        std::visit(
            [](auto& many) {
                many.shapes.clear();
                many.owned.clear();
            },
            shapes);
        return true;
    }
    [[nodiscard]] std::optional<std::uint64_t> size() const override
    {
        return std::visit([](const auto& many) { return std::uint64_t{many.shapes.size()}; }, shapes);
    }

    std::variant<ManyShapes<2>, ManyShapes<3>> shapes;
    bool repeats = false;
};

template <>
struct Behind<jostle_shape> : Kind<ShapeContent, 0x06>
{
    static constexpr const char* name = "jostle_shape";
};
template <>
struct Behind<jostle_shapes> : Kind<ShapesContent, 0x07>
{
    static constexpr const char* name = "jostle_shapes";
};

/// The shape of a handle, if it is one of `Dim` dimensions.
template <int Dim>
const OneShape<Dim>& shape_of(const jostle_shape* shape, const char* name)
{
    if (shape == nullptr) refuse(std::string(name) + " is NULL");
    const auto* const found = std::get_if<OneShape<Dim>>(&open(shape).shape);
    if (found == nullptr) refuse(std::string(name) + " isn't a shape in " + std::to_string(Dim) + "D");
    return *found;
}

/// Shapes and poses, or motions; `Set` is Objects or MovingObjects.
template <template <int, Coordinate> class Set, int Dim, Coordinate T>
Set<Dim, T> objects_of(const jostle_objects* objects, const char* name)
{
    constexpr bool moves = std::same_as<Set<Dim, T>, MovingObjects<Dim, T>>;
    using Placed = std::conditional_t<moves, Motion<Dim, T>, Pose<Dim, T>>;
    const jostle_objects& given = wanted(objects, name);
    const ShapesContent& content = open(given.shapes);
    const auto* const many = std::get_if<ManyShapes<Dim>>(&content.shapes);
    if (many == nullptr) refuse(std::string(name) + "'s shapes aren't in " + std::to_string(Dim) + "D");
    const StridedView<Shape<Dim>> shapes(many->shapes);
    check_rows(given.poses, sizeof(Placed), "poses", true);
    const StridedView<Placed> placed = view<Placed>(given.poses, "poses");
    const bool fits = !shapes.empty() && placed.size() % shapes.size() == 0;
    return {content.repeats && fits ? shapes.repeated(placed.size()) : shapes, placed};
}

/// What a shape is, for C.
template <int Dim>
jostle_shape_info info_of(const Shape<Dim>& shape) noexcept
{
    jostle_shape_info info{};
    info.dim = Dim;
    info.type = shape.type();
    info.radius = shape.radius();
    for (int d = 0; d < Dim; ++d)
        info.size[d] = shape.size()[d];
    info.offset = shape.offset();
    // Every custom shape that comes through this interface is one of ours.
    if (shape.custom() != nullptr)
        info.context = static_cast<const CallbackShape<Dim>*>(shape.custom())->context;
    return info;
}

template <int Dim, Coordinate T>
constexpr bool poses_as_documented = sizeof(Pose<Dim, T>) == (Dim == 3 ? 7 : 4) * sizeof(T) &&
                                     sizeof(Motion<Dim, T>) == (Dim == 3 ? 13 : 7) * sizeof(T) &&
                                     sizeof(Distance<Dim, T>) == (3 * Dim + 1) * sizeof(T) &&
                                     sizeof(Impact<Dim, T>) == (3 * Dim + 1) * sizeof(T);
static_assert(poses_as_documented<2, float> && poses_as_documented<3, float> &&
              poses_as_documented<2, double> && poses_as_documented<3, double>);

} // namespace jostle::c_api
