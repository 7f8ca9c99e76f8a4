// SPDX-License-Identifier: MIT
#include "surfaces/parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "narrow/interface/input_checks.hpp"
#include "narrow/shapes/orientation.hpp"
#include "surfaces/kernels/kernels.hpp"

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

using Corners = std::array<Vec3d, 4>;

surfaces::Four four_of(const Corners& given)
{
    return {{{given[0][0], given[0][1], given[0][2]},
             {given[1][0], given[1][1], given[1][2]},
             {given[2][0], given[2][1], given[2][2]},
             {given[3][0], given[3][1], given[3][2]}}};
}

bool all_within(const Corners& given, double most)
{
    bool all = true;
    for (const Vec3d& corner : given)
        for (const double x : corner)
            all &= std::abs(x) <= most;
    return all;
}
/// `index` is of the pair, or no_index for the vertex's own.
void check_corners(const Corners& given, const char* which, std::uint64_t index)
{
    for (std::size_t k = 0; k < 4; ++k)
        for (const double x : given[k])
            if (!(std::abs(x) <= narrow::longest))
                throw Error(ErrorCode::invalid_argument,
                            (index == Error::no_index ? "" : "pair " + std::to_string(index) + ": ") +
                                "vertex " + std::to_string(k) + which + " is at" + narrow::listed(given[k]) +
                                "; give finite coordinates within 1e60",
                            index == Error::no_index ? k : index);
}
void check_motion(const Corners& from, const Corners& to, std::uint64_t index = Error::no_index)
{
    check_corners(from, " in `from`", index);
    check_corners(to, " in `to`", index);
}
void check_lengths(double distance, double tolerance)
{
    narrow::check_length("distance", distance, true);
    narrow::check_length("tolerance", tolerance, false);
}

std::optional<double> checked_impact(surfaces::Kind kind, const Corners& from, const Corners& to,
                                     double distance, double tolerance)
{
    check_lengths(distance, tolerance);
    check_motion(from, to);
    return surfaces::impact_of(kind, four_of(from), four_of(to), distance, tolerance);
}

void check_sizes(const char* what, std::size_t given, std::size_t pairs)
{
    if (given != pairs)
        throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(given) + " " + what + " and " +
                                                  std::to_string(pairs) + " pairs; give one for each");
}

const surfaces::PartKernels::OfKind& best_kernels(surfaces::Kind kind)
{
    static const surfaces::PartKernels& best = surfaces::kernels_for(supported_instruction_sets().front());
    return best.of(kind);
}

/// Up to this a difference is a float; of other pairs the kernels that take floats are told this, of which
/// they say nothing.
constexpr double most_of_floats = 1e30;

void distances_of(surfaces::Kind kind, std::span<const Corners> positions, std::span<PartDistance> found)
{
    check_sizes("places for results", found.size(), positions.size());
    surfaces::PlaceBatch batch{};
    surfaces::PartDistances some;
    for (std::size_t first = 0; first < positions.size(); first += batch.size) {
        const std::size_t count = std::min<std::size_t>(batch.size, positions.size() - first);
        for (std::size_t k = 0; k < count; ++k)
            surfaces::put_places(batch.from, k,
                                 [&](std::size_t i) -> auto& { return positions[first + k][i]; });
        best_kernels(kind).distances(batch, static_cast<std::uint32_t>(count), some);
        for (std::size_t k = 0; k < count; ++k)
            found[first + k] = some.of(static_cast<std::uint32_t>(k));
    }
}

/// Floats first, and doubles for those that they can't tell apart, as many at once as a batch takes.
void impacts_of(surfaces::Kind kind, std::span<const Corners> from, std::span<const Corners> to,
                std::span<double> times, double distance, double tolerance)
{
    check_lengths(distance, tolerance);
    check_sizes("pairs in `to`", to.size(), from.size());
    check_sizes("places for times", times.size(), from.size());
    const surfaces::PartKernels::OfKind& kernels = best_kernels(kind);
    surfaces::PartBatch legs{};
    surfaces::PlaceBatch places{};
    std::fill_n(legs.reach, legs.size, static_cast<float>(std::min(distance, most_of_floats)));
    std::fill_n(places.reach, places.size, distance);
    std::size_t pending[surfaces::PlaceBatch::size];
    std::uint32_t pendings = 0;
    const auto settle = [&] {
        double found[surfaces::PlaceBatch::size];
        kernels.impacts(places, pendings, tolerance, found);
        for (std::uint32_t k = 0; k < pendings; ++k)
            times[pending[k]] = found[k] <= 1 ? found[k] : std::numeric_limits<double>::infinity();
        pendings = 0;
    };
    std::size_t first = 0;
    bool good = true;
    while (good && first < from.size()) {
        std::uint32_t count = 0;
        for (; count < legs.size && first + count < from.size(); ++count) {
            const std::size_t pair = first + count;
            if (all_within(from[pair], most_of_floats) && all_within(to[pair], most_of_floats)) {
                surfaces::put_legs(legs.from, count, [&](std::size_t i) -> auto& { return from[pair][i]; });
                surfaces::put_legs(legs.to, count, [&](std::size_t i) -> auto& { return to[pair][i]; });
                continue;
            }
            good = all_within(from[pair], narrow::longest) && all_within(to[pair], narrow::longest);
            if (!good) break;
            for (auto& rows : legs.from)
                for (float& number : rows[count])
                    number = static_cast<float>(most_of_floats);
        }
        const std::uint64_t apart = kernels.moving_apart(legs, count);
        for (std::uint32_t k = 0; k < count; ++k) {
            const std::size_t pair = first + k;
            times[pair] = std::numeric_limits<double>::infinity();
            if ((apart >> k & 1) != 0) continue;
            surfaces::put_places(places.from, pendings,
                                 [&](std::size_t i) -> auto& { return from[pair][i]; });
            surfaces::put_places(places.to, pendings, [&](std::size_t i) -> auto& { return to[pair][i]; });
            pending[pendings++] = pair;
            if (pendings == places.size) settle();
        }
        first += count;
    }
    settle();
    if (!good) check_motion(from[first], to[first], first);
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
void vertex_triangle_distances(std::span<const std::array<Vec3d, 4>> positions, std::span<PartDistance> found)
{
    distances_of(surfaces::Kind::vertex_triangle, positions, found);
}
void edge_edge_distances(std::span<const std::array<Vec3d, 4>> positions, std::span<PartDistance> found)
{
    distances_of(surfaces::Kind::edge_edge, positions, found);
}
void vertex_triangle_impacts(std::span<const std::array<Vec3d, 4>> from,
                             std::span<const std::array<Vec3d, 4>> to, std::span<double> times,
                             double distance, double tolerance)
{
    impacts_of(surfaces::Kind::vertex_triangle, from, to, times, distance, tolerance);
}
void edge_edge_impacts(std::span<const std::array<Vec3d, 4>> from, std::span<const std::array<Vec3d, 4>> to,
                       std::span<double> times, double distance, double tolerance)
{
    impacts_of(surfaces::Kind::edge_edge, from, to, times, distance, tolerance);
}

JOSTLE_NAMESPACE_END
