// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "narrow/math.hpp"

// The points of a hull, and hulls of coplanar points.

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

using Index = std::uint32_t;
inline constexpr Index none = ~Index{0};

/// The points with which a hull is computed. They are scaled by a power of two to an extent of 1 to 2, which
/// loses nothing for any size; then digits below 2^-201 are rounded off, so that predicates are exact. In 2D
/// z is 0.
struct PointSet
{
    std::vector<Vec3> points;
    Vec3 extent;
    int longest_axis = 0;
    /// A face, edge or corner may represent points no further from it than this: the rounding to their own
    /// type. Far from the origin that could be as much as the width of the hull, so it is limited to a small
    /// fraction of that.
    double slack = 0;

    template <class Given>
    PointSet(const std::vector<Given>& given, double epsilon) : points(given.size())
    {
        constexpr int dim = std::is_same_v<Given, Vec3> ? 3 : 2;
        for (int d = 0; d < dim; ++d) {
            double lo = given[0][d], hi = lo;
            for (const Given& p : given)
                lo = std::min(lo, p[d]), hi = std::max(hi, p[d]);
            extent[d] = hi - lo;
            if (extent[d] > extent[longest_axis]) longest_axis = d;
        }
        if (!(extent[longest_axis] > 0)) return; // all in one place
        const int scale = -std::ilogb(extent[longest_axis]);
        double size = 0;
        for (int d = 0; d < dim; ++d) {
            if (extent[d] == 0) continue; // a common coordinate of all counts as 0
            extent[d] = std::ldexp(extent[d], scale);
            for (std::size_t i = 0; i < given.size(); ++i) {
                double x = std::ldexp(given[i][d], scale);
                if (std::abs(x) < 0x1p-149) x = (x + 0x1p-148) - 0x1p-148; // to multiples of 2^-201
                points[i][d] = x;
                size = std::max(size, std::abs(x));
            }
        }
        slack = std::min(8 * epsilon * size, 0x1p-13 * extent[longest_axis]);
    }
    const Vec3& operator[](Index i) const { return points[i]; }
    [[nodiscard]] Index size() const { return static_cast<Index>(points.size()); }
    [[nodiscard]] std::vector<Index> all() const
    {
        std::vector<Index> result(points.size());
        for (Index i = 0; i < size(); ++i)
            result[i] = i;
        return result;
    }
    template <class Measure>
    [[nodiscard]] Index furthest(Measure&& measure) const
    {
        Index best = 0;
        double most = -HUGE_VAL;
        for (Index i = 0; i < size(); ++i)
            if (const double m = measure(points[i]); m > most) most = m, best = i;
        return best;
    }
};

/// Each coordinate of a cross product is a difference of two products; this has the sums of their sizes
/// instead.
Vec3 products_of(const Vec3& u, const Vec3& v);

/// The corners of the hull of some points in the plane of the axes u and v, counterclockwise; one or two if
/// all are at one place or on one line.
std::vector<Index> planar_hull(const PointSet& points, int u, int v, std::vector<Index> of);

/// The same for points in the plane with that normal, counterclockwise seen from its tip. It is found in the
/// plane of two axes, chosen so that no two of the points coincide there.
std::vector<Index> plane_hull(const PointSet& points, const Vec3& normal, std::vector<Index> of);

// A hull of rounded points has spurious corners on its sides. `kept` marks those that stay.

/// For a chain of points from chain[first] to chain[last], which both stay: keeps those further than the
/// slack from the remaining line.
void keep_corners(const PointSet& points, const std::vector<Index>& chain, std::size_t first,
                  std::size_t last, std::vector<char>& kept);
/// The same for a closed loop. Two corners are certain: the one furthest from any point, and the one furthest
/// from that.
void keep_corners(const PointSet& points, std::vector<Index> loop, std::vector<char>& kept);

} // namespace narrow::hull
JOSTLE_NAMESPACE_END
