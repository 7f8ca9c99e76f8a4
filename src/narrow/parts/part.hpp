// SPDX-License-Identifier: MIT
// Shapes consist of parts: a convex shape or half-space is one part, a mesh consists of its triangles, a
// compound of its children. Contacts, gaps and impacts of shapes are combined from those of their parts.
#pragma once

#include "narrow/convex/convex2.hpp"
#include "narrow/convex/core3.hpp"
#include "narrow/parts/motion.hpp"
#include "narrow/parts/pair.hpp"
#include "narrow/parts/region.hpp"
#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

enum class Surface : std::uint8_t
{
    none,  ///< a solid
    sheet, ///< an element of a mesh: two sides, continues beyond its ends
    ground ///< a triangle of a height field: solid below
};

/// One convex piece of a shape, relative to a's position.
template <int Dim>
struct Part;

template <>
struct Part<3>
{
    /// A convex shape or a half-space.
    Part(const Shape<3>& shape, const Frame<3>& frame, const Kernels& kernels)
        : core(shape, frame, kernels), half_space(shape.type() == ShapeTypes::half_space)
    {
        if (!half_space) return;
        normal = frame.r * load(ShapeAccess::size(shape));
        offset = shape.offset() + dot(normal, frame.p);
    }
    /// A triangle of a surface, or a segment or point if it has no area.
    template <class Data>
    Part(const Data& data, const Mesh<3>::Element& corners, const Frame<3>& frame, const Kernels& kernels)
        : core(data.vertex(corners[0]), data.vertex(corners[1]), data.vertex(corners[2]), frame, kernels),
          number(corners)
    {
        of(data);
        if (core.polytope.faces == 0)
            surface = Surface::none;
        else
            normal = frame.r * core.polytope.normal(0);
    }
    /// Of a triangle.
    [[nodiscard]] Vec3 first_corner() const { return core.frame * core.polytope.vertex(0); }

    Core3 core;
    bool half_space = false;
    Vec3 normal; ///< of a half-space; of a triangle's front
    double offset = 0;
    Surface surface = Surface::none;
    Mesh<3>::Element number{}; ///< of a triangle's corners
    const MeshData<3>* mesh = nullptr;
    const HeightData* field = nullptr;

  private:
    void of(const MeshData<3>& data)
    {
        mesh = &data;
        surface = Surface::sheet;
    }
    void of(const HeightData& data)
    {
        field = &data;
        surface = Surface::ground;
    }
};

template <>
struct Part<2>
{
    /// A convex shape or a half-space.
    Part(const Shape<2>& shape, const Frame<2>& where, const Kernels&)
        : core(shape, where), half_space(shape.type() == ShapeTypes::half_space)
    {
        if (!half_space) return;
        normal = where.r * load(ShapeAccess::size(shape));
        offset = shape.offset() + dot(normal, where.p);
    }
    /// A segment of a chain, or a point if it has no length.
    Part(const MeshData<2>& data, const Mesh<2>::Element& ends, const Frame<2>& where, const Kernels&)
        : core(0, 0, where), mesh(&data), number(ends)
    {
        const Vec2 p = data.vertices[ends[0]], q = data.vertices[ends[1]];
        core.reach = std::sqrt(std::max(length2(p), length2(q)));
        core.add(where * p, 0);
        const double size = length(q - p);
        if (!(size > 0)) return;
        core.add(where * q, 1);
        surface = Surface::sheet;
        const Vec2 across = right(q - p) * (1 / size);
        normal = where.r * across;
        core.add_normals(across);
    }
    /// Of a segment.
    [[nodiscard]] Vec2 first_corner() const { return core.corner[0]; }

    Core2 core;
    bool half_space = false;
    Vec2 normal; ///< of a half-space; of a segment's front: its right side
    double offset = 0;
    Surface surface = Surface::none;
    const MeshData<2>* mesh = nullptr;
    Mesh<2>::Element number{}; ///< of a segment's ends
};

/// The contact of two parts. If the answer isn't certain, `gap` is set to the distance of the parts.
template <int Dim>
Answer part_contact(const Part<Dim>& a, const Part<Dim>& b, double margin, Manifold<Dim>& manifold,
                    double& gap);
/// For a contact along the normal of an element whose surface continues, or a spare one: the same on its
/// other side if the body is `known` to be there, or else if most of the body is there.
template <int Dim>
Answer part_contact_behind(const Part<Dim>& a, const Part<Dim>& b, bool known, double margin,
                           Manifold<Dim>& manifold, Answer answer);
/// Their signed distance; infinite if it is more than `enough`, or if the two can't touch.
template <int Dim>
void part_gap(const Part<Dim>& a, const Part<Dim>& b, double enough, Gap<Dim>& gap);
template <>
void part_gap(const Part<2>& a, const Part<2>& b, double enough, Gap<2>& gap);
template <>
void part_gap(const Part<3>& a, const Part<3>& b, double enough, Gap<3>& gap);
/// Whether that is 0 or less.
template <int Dim>
bool part_touch(const Part<Dim>& a, const Part<Dim>& b);
template <>
bool part_touch(const Part<2>& a, const Part<2>& b);
template <>
bool part_touch(const Part<3>& a, const Part<3>& b);
/// The distance of parts from any side: the ground has sides and an underside.
template <int Dim>
void moving_gap(const Part<Dim>& a, const Part<Dim>& b, double enough, Gap<Dim>& gap);
/// The extent along n of a turning part while it meets `other`.
template <int Dim>
Spread<Dim> spread_of(const Part<Dim>& part, const Part<Dim>& other, const Turning<Dim>& turning,
                      const V<Dim>& n, double horizon);
/// The box of `part`, and of the ground below it, in the local axes of `frame`.
Region<2> region_of(const Part<2>& part, const Frame<2>& frame);
Region<3> region_of(const Part<3>& part, const Frame<3>& frame);

} // namespace narrow
JOSTLE_NAMESPACE_END
