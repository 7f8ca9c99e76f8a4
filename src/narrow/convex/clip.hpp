// SPDX-License-Identifier: MIT
// The common points of two opposing features: seen along the contact's normal, each is clipped to the other.
// Source: Sutherland and Hodgman, Reentrant Polygon Clipping, CACM 17(1), 1974; Gregorius, Robust Contact
// Creation for Physics Simulations, GDC 2015.
#pragma once

#include "narrow/convex/core3.hpp"
#include "narrow/convex/manifold.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The feature of a core that faces a direction: a face, an edge or a vertex.
struct Feature
{
    SmallVector<Vec3, 16> point;
    SmallVector<std::uint32_t, 16> vertex;
    Vec3 normal;    ///< of a face
    double top = 0; ///< of a face: the offset of its plane along the normal
    std::uint32_t id = 0;
    std::uint16_t kind = vertex_feature;
};

/// Finds the opposing features of a and b along n, which leads from a to b.
void take_features(const Core3& a, const Core3& b, const Vec3& n, Feature& fa, Feature& fb);
/// Face f of a core.
void take_face(const Core3& core, std::uint32_t f, Feature& feature);
/// Finds the feature of a core that meets the other's face along n: a face at up to 60 degrees, otherwise an
/// edge or a vertex.
void take_against_face(const Core3& core, const Vec3& n, Feature& feature);

/// The feature_id() of the feature of a core that meets a vertex along n; its points aren't needed.
[[nodiscard]] std::uint16_t feature_against_vertex(const Core3& core, const Vec3& n);

/// The plane at right angles to the normal.
struct Lateral
{
    Vec3 n, u, v;
    explicit Lateral(const Vec3& normal) : n(normal) { basis(n, u, v); }
    [[nodiscard]] Vec2 flat(const Vec3& p) const { return {dot(p, u), dot(p, v)}; }
};

/// A contact under construction.
struct Clip
{
    /// Along `normal`, unit, from a to b.
    Clip(const Core3& a, const Core3& b, const Vec3& normal, double contact_margin)
        : Clip(a.radius, b.radius, a.reach + b.reach, normal, contact_margin)
    {
    }
    Clip(double a_radius, double b_radius, double reaches, const Vec3& normal, double contact_margin)
        : lateral(normal),
          radius_a(a_radius),
          radius_b(b_radius),
          margin(contact_margin),
          cores(reaches),
          size(reaches + a_radius + b_radius)
    {
    }
    /// Adds a point over lateral place `at`, where the cores' surfaces are at these heights along the normal.
    /// It is kept if it is deep enough.
    void add(const Vec2& at, double height_a, double height_b, std::uint16_t feature_a,
             std::uint16_t feature_b)
    {
        const double top = height_a + radius_a, bottom = height_b - radius_b;
        double depth = top - bottom;
        if (!keeps(depth, margin, size)) return;
        const Vec3 p = lateral.u * at.x + lateral.v * at.y + lateral.n * (0.5 * (top + bottom));
        found.push_back({p, depth, feature_a, feature_b});
    }
    /// The shapes overlap by `depth`, at `deepest()`. Adds that point if none found is as deep: for a vertex
    /// against anything (a user's shape has only vertices), and because of rounding. No point may be deeper:
    /// the plane of a merged hull face is slightly above some of its corners.
    template <class Deepest>
    void complete(double depth, const Deepest& deepest)
    {
        double most = -HUGE_VAL;
        for (std::size_t i = 0; i < found.size(); ++i)
            most = std::max(most, found[i].depth);
        const double slack = 1e-7 * (cores + std::abs(depth));
        if (most > depth + 0x1p-9 * cores + slack) found.clear();
        for (std::size_t i = 0; most > depth + slack && i < found.size(); ++i)
            found[i].depth = std::min(found[i].depth, depth);
        if (!(most >= depth - slack) || found.empty()) found.push_back(deepest());
    }

    Lateral lateral;
    double radius_a, radius_b, margin;
    double cores; ///< their extent
    double size;  ///< of both, with their radii
    SmallVector<ManifoldPoint<3>, 24> found;
};

/// Adds the points of two faces, a face and an edge, or two edges. A vertex has none with anything.
void clip_features(Clip& clip, const Feature& a, const Feature& b);
/// Adds the point of a vertex of a over a face of b, if it is over the face.
void clip_point(Clip& clip, const Feature& a, const Feature& b);

} // namespace narrow
JOSTLE_NAMESPACE_END
