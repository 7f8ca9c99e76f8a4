// SPDX-License-Identifier: MIT
// The distance of two cores: the point nearest to the origin of all differences a - b, approached by
// simplices. Source: Gilbert, Johnson, Keerthi, IEEE J. Robotics and Automation 4(2), 1988; van den Bergen,
// Collision Detection in Interactive 3D Environments (2003), ch. 4.
#pragma once

#include "narrow/convex/core3.hpp"
#include "narrow/convex/manifold.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A difference of two supports, and the two.
struct SimplexPoint
{
    Vec3 w, a, b; ///< w = a - b
    std::uint32_t ia, ib;
};
struct Simplex
{
    SimplexPoint point[4];
    int count = 0;
    double parted = -HUGE_VAL; ///< how far some plane parts the two cores; below 0: none does that was tried
};

inline constexpr int all_steps = 100; ///< then rounding is all that is left
/// After how many steps to leave it to another test, after how many once a plane is found that parts the two,
/// and after how many if none is.
struct MostSteps
{
    int steps = all_steps, parted = all_steps, unparted = all_steps;
};

/// The gap between two cores, without their radii, b moved by `shift`; the gap's points are where they are
/// without. Says apart where there is a gap: its distance is infinite once it is known to be more than
/// `enough`. Else gap.normal is the direction in which they overlap least of those tried, and `s` the last
/// simplex: they touch, as well as doubles can tell, or `most` steps weren't enough to be clear.
/// Of smooth cores, whose points lie so close that simplices get flat, the distance may be too great: it is
/// no less than s.parted.
Verdict gjk(const Core3& a, const Core3& b, const Vec3& shift, double enough, MostSteps most, Simplex& s,
            Gap<3>& gap);

/// The gap between a point and a core, which needs no steps if that is a triangle, a cylinder or a cone: then
/// it says apart, as gjk() does. Unclear where the core is another one, or they touch.
Verdict point_gap(const Vec3& p, const Core3& b, double enough, Gap<3>& gap);
/// How deep a point is inside a cylinder or cone, and where it would come out. It may be outside by as little
/// as makes point_gap() unclear.
void point_depth(const Vec3& p, const Core3& b, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
