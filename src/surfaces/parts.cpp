// SPDX-License-Identifier: MIT
#include "surfaces/parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "narrow/interface/input_checks.hpp"
#include "narrow/shapes/orientation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace surfaces {
namespace {

struct Plane
{
    int x, y; ///< the axes that are kept of a projection
};
/// A point's two coordinates.
narrow::Vec2 seen(const Vec3& p, Plane plane)
{
    return {p[plane.x], p[plane.y]};
}
bool zero(const Vec3& v)
{
    return v.x == 0 && v.y == 0 && v.z == 0;
}
bool between(double a, double x, double b)
{
    return (a <= x && x <= b) || (b <= x && x <= a);
}

/// Whether the edges p q and r s, in one plane that is seen without being flat, have a point in common.
bool edges_meet(const narrow::Vec2& p, const narrow::Vec2& q, const narrow::Vec2& r, const narrow::Vec2& s)
{
    const int of_r = narrow::side_of_line(p, q, r), of_s = narrow::side_of_line(p, q, s);
    const int of_p = narrow::side_of_line(r, s, p), of_q = narrow::side_of_line(r, s, q);
    if (of_r * of_s < 0 && of_p * of_q < 0) return true;
    const auto on = [](int side, const narrow::Vec2& a, const narrow::Vec2& b, const narrow::Vec2& x) {
        return side == 0 && between(a.x, x.x, b.x) && between(a.y, x.y, b.y);
    };
    return on(of_r, p, q, r) || on(of_s, p, q, s) || on(of_p, r, s, p) || on(of_q, r, s, q);
}

/// `crosses` for five points of one plane.
bool crosses_in_plane(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& triangle)
{
    const auto& [a, b, c] = triangle;
    Vec3 normal = narrow::exact_cross(a, b, c);
    for (const Vec3& corner : triangle)
        if (zero(normal)) normal = narrow::exact_cross(p, q, corner);
    for (const Vec3& end : {p, q})
        for (const auto& [r, s] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
            if (zero(normal)) normal = narrow::exact_cross(r, s, end);
    if (zero(normal)) { // all in one line: along each axis the ends' intervals meet
        for (int d = 0; d < 3; ++d)
            if (std::max(p[d], q[d]) < std::min({a[d], b[d], c[d]}) ||
                std::max({a[d], b[d], c[d]}) < std::min(p[d], q[d]))
                return false;
        return true;
    }
    const Plane plane = normal.x != 0 ? Plane{1, 2} : normal.y != 0 ? Plane{2, 0} : Plane{0, 1};
    const narrow::Vec2 seen_p = seen(p, plane), seen_q = seen(q, plane);
    const narrow::Vec2 corner[3] = {seen(a, plane), seen(b, plane), seen(c, plane)};
    int left = 0, right = 0;
    for (int k = 0; k < 3; ++k) {
        const narrow::Vec2 &r = corner[k], &s = corner[(k + 1) % 3];
        if (edges_meet(seen_p, seen_q, r, s)) return true;
        const int side = narrow::side_of_line(r, s, seen_p);
        left += side > 0 ? 1 : 0;
        right += side < 0 ? 1 : 0;
    }
    return left == 3 || right == 3; // p, and with it the whole edge, is inside
}

} // namespace

bool crosses(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& triangle) noexcept
{
    const auto& [a, b, c] = triangle;
    const int of_p = narrow::side_of_plane(a, b, c, p), of_q = narrow::side_of_plane(a, b, c, q);
    if (of_p * of_q > 0) return false;
    const int ab = narrow::side_of_plane(p, q, a, b), bc = narrow::side_of_plane(p, q, b, c),
              ca = narrow::side_of_plane(p, q, c, a);
    if (of_p == 0 &&
        of_q == 0) // a triangle without area has no plane: then its line need not meet the edge's
        return ab == 0 && bc == 0 && ca == 0 && crosses_in_plane(p, q, triangle);
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

} // namespace surfaces

namespace {

surfaces::Four checked_four(const std::array<Vec3d, 4>& given, const char* which)
{
    surfaces::Four four;
    for (std::size_t k = 0; k < 4; ++k) {
        for (const double x : given[k])
            if (!(std::abs(x) <= narrow::longest))
                throw Error(ErrorCode::invalid_argument,
                            std::string("vertex ") + std::to_string(k) + which + " is at" +
                                narrow::listed(given[k]) + "; give finite coordinates within 1e60",
                            k);
        four[k] = {given[k][0], given[k][1], given[k][2]};
    }
    return four;
}

std::optional<double> checked_impact(surfaces::Kind kind, const std::array<Vec3d, 4>& from,
                                     const std::array<Vec3d, 4>& to, double distance, double tolerance)
{
    narrow::check_length("distance", distance, true);
    narrow::check_length("tolerance", tolerance, false);
    return surfaces::impact_of(kind, checked_four(from, " in `from`"), checked_four(to, " in `to`"), distance,
                               tolerance);
}

surfaces::Four four_of(const std::array<Vec3d, 4>& given)
{
    return {{{given[0][0], given[0][1], given[0][2]},
             {given[1][0], given[1][1], given[1][2]},
             {given[2][0], given[2][1], given[2][2]},
             {given[3][0], given[3][1], given[3][2]}}};
}

} // namespace

PartDistance vertex_triangle_distance(const std::array<Vec3d, 4>& positions) noexcept
{
    return surfaces::distance_of(surfaces::Kind::vertex_triangle, four_of(positions));
}
PartDistance edge_edge_distance(const std::array<Vec3d, 4>& positions) noexcept
{
    return surfaces::distance_of(surfaces::Kind::edge_edge, four_of(positions));
}
std::optional<double> vertex_triangle_impact(const std::array<Vec3d, 4>& from, const std::array<Vec3d, 4>& to,
                                             double distance, double tolerance)
{
    return checked_impact(surfaces::Kind::vertex_triangle, from, to, distance, tolerance);
}
std::optional<double> edge_edge_impact(const std::array<Vec3d, 4>& from, const std::array<Vec3d, 4>& to,
                                       double distance, double tolerance)
{
    return checked_impact(surfaces::Kind::edge_edge, from, to, distance, tolerance);
}

JOSTLE_NAMESPACE_END
