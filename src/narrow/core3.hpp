// SPDX-License-Identifier: MIT
// A convex shape in 3D as all tests see it: a core polytope with a radius around it. A sphere is a point, a
// capsule a segment, the others have radius 0.
#pragma once

#include "narrow/kernels.hpp"
#include "narrow/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

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

/// A point of a core furthest along some direction.
struct Support
{
    std::uint32_t vertex;
    Vec3 p; ///< as seen from a's position
};

inline Support support(const Core3& core, const Vec3& direction)
{
    const Vec3 d = core.frame.r.back(direction);
    if (core.custom != nullptr) return {0, core.frame * load(core.custom->support({d.x, d.y, d.z}))};
    const Polytope& hull = core.polytope;
    std::uint32_t best = 0;
    if (core.is_box) { // bit i of a corner's number is set where coordinate i is positive
        best = (d.x > 0 ? 1u : 0u) | (d.y > 0 ? 2u : 0u) | (d.z > 0 ? 4u : 0u);
    } else if (hull.vertices > 3) {
        best = core.kernels->furthest(hull.x, hull.stride, d.x, d.y, d.z);
    } else {
        double most = -HUGE_VAL;
        for (std::uint32_t i = 0; i < hull.vertices; ++i) {
            const double h = dot(d, hull.vertex(i));
            if (h > most) {
                most = h;
                best = i;
            }
        }
    }
    return {best, core.frame * hull.vertex(best)};
}

/// The point of a core furthest along `direction`, without its radius.
inline Vec3 furthest(const Core3& core, const Vec3& direction)
{
    return support(core, direction).p;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
