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
    double parted = -HUGE_VAL; ///< the separation by the best plane tried; negative: none separates them
};

inline constexpr int all_steps = 100; ///< after that only rounding is left
/// After how many steps another test takes over: in general, once a plane separates the two, and if none
/// does.
struct MostSteps
{
    int steps = all_steps, parted = all_steps, unparted = all_steps;
};

/// The gap between two cores, without their radii, with b moved by `shift`; the gap's points are those
/// without the shift. Returns apart if there is a gap, whose distance is infinite once it is known to be more
/// than `enough`. Otherwise gap.normal is the direction with the least overlap of those tried, and `s` the
/// last simplex: they touch, as far as doubles can tell, or `most` steps weren't enough to decide.
/// For smooth cores, whose points are so close that simplices get flat, the distance may be too great; it is
/// at least s.parted.
Verdict gjk(const Core3& a, const Core3& b, const Vec3& shift, double enough, MostSteps most, Simplex& s,
            Gap<3>& gap);

/// The gap between a point and a triangle, cylinder or cone, which needs no steps: returns apart, as gjk()
/// does. Unclear for other cores, or if they touch.
Verdict point_gap(const Vec3& p, const Core3& b, double enough, Gap<3>& gap);
/// The depth of a point inside a cylinder or cone, and where it would come out. It may be outside by so
/// little that point_gap() is unclear.
void point_depth(const Vec3& p, const Core3& b, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
