// SPDX-License-Identifier: MIT
// Any two convex shapes in 3D. A shape is a core polytope with a radius around it: a sphere is a point, a
// capsule a segment, the others have radius 0.
#pragma once

#include "narrow/kernels.hpp"
#include "narrow/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A feature's number: 14 bits of index below 2 bits of kind.
inline constexpr std::uint16_t vertex_feature = 0, edge_feature = 0x4000, face_feature = 0x8000;
inline std::uint16_t feature_id(std::uint16_t kind, std::uint32_t index)
{
    return static_cast<std::uint16_t>(kind | (index & 0x3fff));
}

template <int Dim>
struct ManifoldPoint
{
    V<Dim> p; ///< from a's position
    double depth;
    std::uint16_t feature_a, feature_b;
};
/// A contact seen from a's position, in world axes.
template <int Dim>
struct Manifold
{
    V<Dim> normal;
    std::uint32_t count = 0;
    ManifoldPoint<Dim> point[Contact<Dim, double>::max_points];
};

/// Signed distance and the points on the surfaces, both seen from a's position.
template <int Dim>
struct Gap
{
    double distance;
    V<Dim> normal, on_a, on_b;
};

/// Two faces, or a face and an edge, that will lie flat in a step or two share points already: the cosine of about 5
/// degrees, at which a face of length 1 stands off by 0.09.
inline constexpr double nearly_face = 0.996;

/// A core with its place. It is made once and stays what it is: nothing is left of another shape.
/// `polytope` points into the object itself for small shapes: it doesn't move.
struct Core3
{
    Core3(const Shape<3>& convex, const Frame<3>& where, const Kernels& kernels = best_kernels());
    Core3(const Vec3& a, const Vec3& b, const Vec3& c, const Frame<3>& where, const Kernels& kernels);
    Core3(const Core3&) = delete;
    Core3& operator=(const Core3&) = delete;

    Polytope polytope;
    Frame<3> frame;
    double radius = 0;
    bool is_box = false; ///< with extent along all axes
    double reach = 0;    ///< radius of a ball around frame.p that holds the core
    const CustomShape<3>* custom = nullptr;
    const Kernels* kernels;

  private:
    void set_box(const Vec<3, double>& half);
    double coordinates_[3 * lanes];
    double normals_[6];
    double offsets_[lanes];
    Vec3 directions_[3];
};

/// The distance between cores (not their radii), or how much they overlap.
///
/// Ends early with `distance` infinite once they are known to be further apart than `enough`.
/// Source   Gilbert, Johnson, Keerthi, IEEE J. Robotics and Automation 4(2), 1988; van den Bergen, Collision
///          Detection in Interactive 3D Environments (2003), ch. 4; penetration by separating axes
///          (Gottschalk 1996; Ericson sec. 5.2.1) where edges are few, else by the expanding polytope
///          algorithm (van den Bergen, GDC 2001).
void core_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

/// Whether two solid polyhedra have so few edges that polyhedra_gap is the fast way.
bool are_small_polyhedra(const Core3& a, const Core3& b);
/// How far the best plane between two small polyhedra parts them, below 0 how deep they overlap: the distance
/// where that is 0 or less. Ends early with any plane that parts them by more than `enough`. gap.normal, any direction beforehand, saves most when it overlaps little. Returns
/// false where another way would be faster or safer.
bool polyhedra_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

/// The same with penetration always by separating axes: every pair of edges. The slow twin.
void core_gap_by_axes(const Core3& a, const Core3& b, Gap<3>& gap);

/// With radii.
void convex_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap);

/// From a gap between cores no wider than the radii and `margin` to the points of the contact.
void make_manifold(const Core3& a, const Core3& b, const Gap<3>& cores, double margin, Manifold<3>& manifold);

/// The contact of a convex core with the front (side 1) or back (-1) of a triangle, along the triangle's
/// normal whatever is nearest: for surfaces that go on beyond its sides. Returns whether there is one: only
/// points over or under the triangle count.
bool face_contact(const Core3& a, const Core3& triangle, double side, double margin, Manifold<3>& manifold);

/// The point of a core furthest along `direction`, without its radius.
Vec3 furthest(const Core3& core, const Vec3& direction);

/// Returns whether there is one.
bool convex_contact(const Core3& a, const Core3& b, double margin, Manifold<3>& manifold);

/// Whether the distance is 0 or less.
bool convex_touch(const Core3& a, const Core3& b);

/// Of a convex core and the half-space normal . p <= offset (from a's position, in world axes).
bool half_space_contact(const Core3& a, const Vec3& normal, double offset, double margin,
                        Manifold<3>& manifold);
void half_space_gap(const Core3& a, const Vec3& normal, double offset, Gap<3>& gap);

/// Keeps the deepest of `candidates`, the one furthest from it, and the two that add most area.
void reduce(const Vec3& normal, ManifoldPoint<3>* candidates, std::uint32_t count, Manifold<3>& manifold);

} // namespace narrow
JOSTLE_NAMESPACE_END
