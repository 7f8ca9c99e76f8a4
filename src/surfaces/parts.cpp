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

using narrow::cross;
using narrow::dot;
using narrow::length;
using narrow::length2;

/// What a corner's place along a unit vector may be wrong by, as a part of the greatest coordinate, rounding
/// of the differences included: seven roundings of 2^-53, and as much to spare.
constexpr double rounding = 0x1p-49;
/// More than what three roundings can change a quotient by.
constexpr double down = 1 - 0x1p-51, up = 1 + 0x1p-51;
/// Steps in which almost all impacts are found to the last bits. Most take 3 to 10; where parts nearly touch
/// at first, each step may only double their gap.
constexpr int exact_steps = 1000;

/// A triangle, or a parallelogram, whose corners go around it.
template <int corners>
struct Polygon
{
    Vec3 corner[corners];

    [[nodiscard]] Vec3 side(int k) const { return corner[k + 1 == corners ? 0 : k + 1] - corner[k]; }
    /// The sides that begin at the first corner, which span it.
    [[nodiscard]] Vec3 across() const { return corner[1] - corner[0]; }
    [[nodiscard]] Vec3 along() const { return corner[corners - 1] - corner[0]; }
};

/// What a pair is as a polygon. For edges p q and r s the corners are r - p, r - q, s - q, s - p.
template <int corners>
Polygon<corners> polygon_of(const Four& at)
{
    if constexpr (corners == 3)
        return {{at[1] - at[0], at[2] - at[0], at[3] - at[0]}};
    else
        return {{at[2] - at[0], at[2] - at[1], at[3] - at[1], at[3] - at[0]}};
}

template <int corners>
double greatest(const Polygon<corners>& polygon)
{
    double most = 0;
    for (int k = 0; k < corners; ++k)
        for (int d = 0; d < 3; ++d)
            most = std::max(most, std::abs(polygon.corner[k][d]));
    return most;
}

/// Times 2^power: exact.
double scaled(double number, int power)
{
    return power == 0 ? number : std::ldexp(number, power); // most of the time it is 0
}
template <int corners>
Polygon<corners> scaled(Polygon<corners> polygon, int power)
{
    for (Vec3& corner : polygon.corner)
        corner = {scaled(corner.x, power), scaled(corner.y, power), scaled(corner.z, power)};
    return polygon;
}
/// The power that makes numbers up to `greatest` so large that their fourth powers don't vanish; up to 1e60
/// these stay finite.
int power_for(double greatest)
{
    return greatest >= 0x1p-200 || greatest == 0 ? 0 : -std::ilogb(greatest);
}

/// The point of a polygon that is nearest to the origin.
struct Nearest
{
    Vec3 point;
    double distance2 = std::numeric_limits<double>::infinity();
    int side = -1;                ///< on which it lies, or -1 inside
    double part = 0;              ///< of that side; 0 or 1 at a corner
    double across = 0, along = 0; ///< inside: how much of the sides that span the polygon
};

template <int corners>
Nearest nearest_inside(const Polygon<corners>& polygon)
{
    const Vec3 u = polygon.across(), v = polygon.along(), normal = cross(u, v), c = polygon.corner[0];
    const double size = length2(normal);
    Nearest found;
    found.across = -dot(cross(c, v), normal) / size;
    found.along = -dot(cross(u, c), normal) / size;
    const double rest =
        corners == 3 ? 1 - found.across - found.along : 1 - std::max(found.across, found.along);
    if (!(size > 0 && found.across > 0 && found.along > 0 && rest > 0)) return found;
    found.point = c + u * found.across + v * found.along;
    found.distance2 = length2(found.point);
    return found;
}

template <int corners>
Nearest nearest_of(const Polygon<corners>& polygon)
{
    Nearest best = nearest_inside(polygon);
    for (int k = 0; k < corners; ++k) {
        const Vec3 side = polygon.side(k);
        const double size = length2(side), toward = -dot(polygon.corner[k], side);
        const double part = size > 0 ? std::clamp(toward / size, 0.0, 1.0) : 0.0;
        const Vec3 point = part == 1 ? polygon.corner[k] + side : polygon.corner[k] + side * part;
        const double distance2 = length2(point);
        if (distance2 < best.distance2) best = {point, distance2, k, part, 0, 0};
    }
    return best;
}

/// `v` without what of it goes along `side`; twice, since the first time leaves its own rounding.
Vec3 without(const Vec3& v, const Vec3& side)
{
    const double size = length2(side);
    if (!(size > 0)) return v;
    const Vec3 once = v - side * (dot(v, side) / size);
    return once - side * (dot(once, side) / size);
}
/// Zero for zero.
Vec3 unit(const Vec3& v)
{
    const double size = length(v);
    if (size > 1e-140) return v * (1 / size); // squares beyond 1e-280 have all their digits
    const double most = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(most > 0)) return {};
    const int power = -std::ilogb(most);
    const Vec3 bigger{std::ldexp(v.x, power), std::ldexp(v.y, power), std::ldexp(v.z, power)};
    return bigger * (1 / length(bigger));
}
/// Along the polygon's normal, towards the polygon.
template <int corners>
Vec3 toward_face(const Polygon<corners>& polygon)
{
    const Vec3 normal = unit(cross(polygon.across(), polygon.along()));
    return dot(normal, polygon.corner[0]) < 0 ? -normal : normal;
}
/// From the origin to the nearest point. Near the polygon the difference has lost most of its digits; what
/// counts is that it is at right angles to the side.
template <int corners>
Vec3 toward(const Polygon<corners>& polygon, const Nearest& nearest)
{
    if (nearest.side < 0) return toward_face(polygon);
    const bool at_corner = nearest.part == 0 || nearest.part == 1;
    return unit(at_corner ? nearest.point : without(nearest.point, polygon.side(nearest.side)));
}

/// A polygon whose corners move straight from one place to another.
template <int corners>
struct MovingPolygon
{
    Polygon<corners> from, to;

    [[nodiscard]] Polygon<corners> at(double time) const
    {
        Polygon<corners> polygon = from;
        for (int k = 0; k < corners; ++k)
            polygon.corner[k] = from.corner[k] * (1 - time) + to.corner[k] * time;
        return polygon;
    }
    /// Until when, from `time` on, all corners are beyond `apart` along a unit vector: at least. Above 1 if
    /// they are to the end; `time` if some corner may not be even now. Along a direction the corners move
    /// evenly, so that this is exact but for the rounding that `apart` allows for.
    [[nodiscard]] double clear_until(const Vec3& direction, double time, double apart) const
    {
        double until = 2;
        for (int k = 0; k < corners; ++k) {
            const double first = dot(direction, from.corner[k]), last = dot(direction, to.corner[k]);
            if (first > apart && last > apart) continue;
            if (first <= apart && last <= apart) return time;
            const double when = (first - apart) / (first - last);
            if (first > apart)
                until = std::min(until, when * down);
            else if (when * up > time)
                return time;
        }
        return std::max(until, time);
    }
};

/// The latest of clear_until() for all directions that could be the right one.
template <int corners>
double clear_by_any(const MovingPolygon<corners>& moving, const Polygon<corners>& polygon, double time,
                    double apart)
{
    double until = moving.clear_until(toward_face(polygon), time, apart);
    for (int k = 0; k < corners; ++k) {
        const Vec3 side = polygon.side(k);
        for (const Vec3& direction : {without(polygon.corner[k], side), polygon.corner[k]})
            until = std::max(until, moving.clear_until(unit(direction), time, apart));
    }
    return until;
}

/// The greater of the longest side and of how far a corner moves.
template <int corners>
double extent_of(const MovingPolygon<corners>& moving)
{
    double most = 0;
    for (int k = 0; k < corners; ++k)
        most = std::max(
            {most, length(moving.from.side(k)), length(moving.to.corner[k] - moving.from.corner[k])});
    return most;
}

template <int corners>
double distance_between(const Four& positions)
{
    const Polygon<corners> polygon = polygon_of<corners>(positions);
    const int power = power_for(greatest(polygon));
    return scaled(std::sqrt(nearest_of(scaled(polygon, power)).distance2), -power);
}

template <int corners>
PartDistance distance_of(const Four& positions)
{
    const Polygon<corners> as_given = polygon_of<corners>(positions);
    const int power = power_for(greatest(as_given));
    const Polygon<corners> polygon = scaled(as_given, power);
    const Nearest nearest = nearest_of(polygon);
    PartDistance result{};
    result.distance = scaled(std::sqrt(nearest.distance2), -power);
    const Vec3 direction = nearest.distance2 > 0 ? toward(polygon, nearest) : toward_face(polygon);
    result.normal = {direction.x, direction.y, direction.z};
    double* const weight = result.weights.data();
    const int next = nearest.side + 1 == corners ? 0 : nearest.side + 1;
    if constexpr (corners == 3) {
        weight[0] = 1;
        if (nearest.side < 0) {
            weight[1] = 1 - nearest.across - nearest.along;
            weight[2] = nearest.across;
            weight[3] = nearest.along;
        } else {
            weight[1 + nearest.side] = 1 - nearest.part;
            weight[1 + next] = nearest.part;
        }
        return result;
    }
    // How far along the first edge p q and the second r s each corner of the parallelogram is.
    constexpr double on_first[4] = {0, 1, 1, 0}, on_second[4] = {0, 0, 1, 1};
    double first = nearest.across, second = nearest.along;
    if (nearest.side >= 0) {
        const auto between = [&](const double(&on)[4]) {
            return on[nearest.side] + (on[next] - on[nearest.side]) * nearest.part;
        };
        first = between(on_first);
        second = between(on_second);
    }
    result.weights = {1 - first, first, 1 - second, second};
    return result;
}

template <int corners>
std::optional<double> impact_of(const Four& from, const Four& to, double distance, double tolerance)
{
    MovingPolygon<corners> moving{polygon_of<corners>(from), polygon_of<corners>(to)};
    const double size = std::max(greatest(moving.from), greatest(moving.to));
    const int power = power_for(size);
    moving = {scaled(moving.from, power), scaled(moving.to, power)};
    const double wanted = scaled(distance, power);
    const double apart = wanted * (1 + 0x1p-50) + scaled(size, power) * rounding;

    double time = 0;
    for (int step = 0;; ++step) {
        const Polygon<corners> polygon = moving.at(time);
        const Nearest nearest = nearest_of(polygon);
        double until = time;
        if (nearest.distance2 > 0) {
            until = moving.clear_until(toward(polygon, nearest), time, apart);
            // Of parts that nearly touch, the nearest points may lie anywhere on a side or inside.
            if (nearest.side >= 0 && until <= 1)
                until = std::max(until, moving.clear_until(toward_face(polygon), time, apart));
            if (until <= time) until = clear_by_any(moving, polygon, time, apart);
        }
        if (until > 1) return std::nullopt;
        if (until <= time) return time;
        if (step >= exact_steps && std::sqrt(nearest.distance2) - wanted <= tolerance * extent_of(moving))
            return time;
        time = until;
    }
}

} // namespace

double distance_between(Kind kind, const Four& positions) noexcept
{
    return kind == Kind::vertex_triangle ? distance_between<3>(positions) : distance_between<4>(positions);
}
PartDistance distance_of(Kind kind, const Four& positions) noexcept
{
    return kind == Kind::vertex_triangle ? distance_of<3>(positions) : distance_of<4>(positions);
}
std::optional<double> impact_of(Kind kind, const Four& from, const Four& to, double distance,
                                double tolerance) noexcept
{
    return kind == Kind::vertex_triangle ? impact_of<3>(from, to, distance, tolerance)
                                         : impact_of<4>(from, to, distance, tolerance);
}

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
