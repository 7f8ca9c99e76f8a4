// SPDX-License-Identifier: MIT
// Distances, impacts and crossings by their definitions: in long double, and in rational numbers.
#pragma once

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "jostle/surface.hpp"

namespace oracle {

using Real = long double;
using Point = std::array<Real, 3>;

inline Point operator-(const Point& a, const Point& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point mix(const Point& a, const Point& b, Real t)
{
    return {a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
}
inline Real dot(const Point& a, const Point& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point cross(const Point& a, const Point& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Point point(const jostle::Vec3d& v)
{
    return {v[0], v[1], v[2]};
}

/// The vector from a point to the nearest one of a segment.
inline Point to_segment(const Point& p, const Point& a, const Point& b)
{
    const Point ab = b - a;
    const Real size = dot(ab, ab),
               t = size > 0 ? std::clamp(dot(p - a, ab) / size, Real(0), Real(1)) : Real(0);
    return mix(a, b, t) - p;
}
/// The shortest of the vectors from a point of the first part to one of the second, of all pairs of features.
inline Point shortest(bool edges, const std::array<Point, 4>& x)
{
    std::vector<Point> all;
    if (edges) {
        all = {to_segment(x[0], x[2], x[3]), to_segment(x[1], x[2], x[3])};
        for (const std::size_t k : {2u, 3u}) {
            const Point back = to_segment(x[k], x[0], x[1]);
            all.push_back(Point{} - back);
        }
        const Point u = x[1] - x[0], v = x[3] - x[2], n = cross(u, v), w = x[2] - x[0];
        const Real size = dot(n, n);
        if (size > 0) {
            const Real s = dot(cross(w, v), n) / size, t = dot(cross(w, u), n) / size;
            if (s >= 0 && s <= 1 && t >= 0 && t <= 1) all.push_back(mix(x[2], x[3], t) - mix(x[0], x[1], s));
        }
    } else {
        all = {to_segment(x[0], x[1], x[2]), to_segment(x[0], x[2], x[3]), to_segment(x[0], x[3], x[1])};
        const Point n = cross(x[2] - x[1], x[3] - x[1]);
        const Real size = dot(n, n);
        if (size > 0) {
            const Real height = dot(x[1] - x[0], n) / size;
            const Point foot{x[0][0] + n[0] * height, x[0][1] + n[1] * height, x[0][2] + n[2] * height};
            bool inside = true;
            for (std::size_t k = 0; k < 3; ++k)
                inside = inside && dot(cross(x[1 + (k + 1) % 3] - x[1 + k], foot - x[1 + k]), n) >= 0;
            if (inside) all.push_back(foot - x[0]);
        }
    }
    return *std::min_element(all.begin(), all.end(),
                             [](const Point& a, const Point& b) { return dot(a, a) < dot(b, b); });
}
inline Real distance(bool edges, const std::array<jostle::Vec3d, 4>& at)
{
    const Point origin = point(at[0]);
    const Point least =
        shortest(edges, {Point{}, point(at[1]) - origin, point(at[2]) - origin, point(at[3]) - origin});
    return std::sqrt(dot(least, least));
}
/// As seen from the first vertex.
inline std::array<Point, 4> places(const std::array<jostle::Vec3d, 4>& from,
                                   const std::array<jostle::Vec3d, 4>& to, Real time)
{
    std::array<Point, 4> at;
    for (std::size_t k = 0; k < 4; ++k)
        at[k] = mix(point(from[k]) - point(from[0]), point(to[k]) - point(to[0]), time);
    return at;
}

using Rational = mpq_class;
using Exact = std::array<Rational, 3>;

/// A pair that moves, in rational numbers: the corners of the polygon that the origin is apart from.
class Moving
{
  public:
    Moving(bool edges, const std::array<jostle::Vec3d, 4>& from, const std::array<jostle::Vec3d, 4>& to)
        : edges_(edges), from_(from), to_(to)
    {
        const auto add = [&](std::size_t a, std::size_t b) {
            Exact first, last;
            for (std::size_t d = 0; d < 3; ++d) {
                first[d] = Rational(from[b][d]) - Rational(from[a][d]);
                last[d] = Rational(to[b][d]) - Rational(to[a][d]);
            }
            corners_.push_back({first, last});
        };
        if (edges)
            add(0, 2), add(0, 3), add(1, 2), add(1, 3);
        else
            add(0, 1), add(0, 2), add(0, 3);
    }
    /// Proves that the parts are further apart than `distance` from one time to another, by directions along
    /// which they are; false if none was found in `depth` halvings.
    [[nodiscard]] bool apart(const Rational& begin, const Rational& end, double distance,
                             int depth = 60) const
    {
        const Rational middle = (begin + end) / 2;
        for (const Rational& time : {middle, end, begin})
            for (const Point& direction : directions(static_cast<Real>(time.get_d())))
                if (separates(direction, begin, end, distance)) return true;
        return depth > 0 && apart(begin, middle, distance, depth - 1) &&
               apart(middle, end, distance, depth - 1);
    }

  private:
    [[nodiscard]] std::vector<Point> directions(Real time) const
    {
        const std::array<Point, 4> at = places(from_, to_, time);
        const Point n = edges_ ? cross(at[1] - at[0], at[3] - at[2]) : cross(at[2] - at[1], at[3] - at[1]);
        const Point way = shortest(edges_, at);
        std::vector<Point> all{way, n, Point{} - n};
        // Where they nearly touch, the way has lost its digits, but it can be at right angles to an edge.
        for (const auto& [a, b] : {std::pair(0, 1), {2, 3}, {1, 2}, {1, 3}}) {
            const Point edge = at[std::size_t(b)] - at[std::size_t(a)];
            const Real size = dot(edge, edge);
            Point across = way;
            for (int again = 0; again < 2 && size > 0; ++again) {
                const Real along = dot(across, edge) / size;
                across = across - Point{edge[0] * along, edge[1] * along, edge[2] * along};
            }
            all.push_back(across);
        }
        return all;
    }
    [[nodiscard]] bool separates(const Point& direction, const Rational& begin, const Rational& end,
                                 double distance) const
    {
        for (const auto& [first, last] : corners_)
            for (const Rational& time : {begin, end}) // between them it lies between
                if (!surely_beyond(direction, first, last, time, distance) &&
                    !beyond(direction, first, last, time, distance))
                    return false;
        return true;
    }
    /// Whether a corner is further along than the distance: by long doubles, with more to spare than they
    /// can be wrong by.
    [[nodiscard]] static bool surely_beyond(const Point& direction, const Exact& first, const Exact& last,
                                            const Rational& time, double distance)
    {
        const Real t = static_cast<Real>(time.get_d()); // rounded to 2^-53
        Real along = 0, sizes = 0;
        for (std::size_t d = 0; d < 3; ++d) {
            const Real a = static_cast<Real>(first[d].get_d()), b = static_cast<Real>(last[d].get_d()),
                       n = static_cast<Real>(static_cast<double>(direction[d]));
            along += n * (a + (b - a) * t);
            sizes += std::abs(n) * (std::abs(a) + std::abs(b));
        }
        const Real length = std::sqrt(dot(direction, direction));
        return along > static_cast<Real>(distance) * length * (1 + 1e-14L) + sizes * 1e-14L;
    }
    /// The same exactly.
    [[nodiscard]] static bool beyond(const Point& direction, const Exact& first, const Exact& last,
                                     const Rational& time, double distance)
    {
        Rational along = 0, size = 0;
        for (std::size_t d = 0; d < 3; ++d) {
            const Rational n(static_cast<double>(direction[d]));
            size += n * n;
            along += n * (first[d] + (last[d] - first[d]) * time);
        }
        return along > 0 && along * along > Rational(distance) * Rational(distance) * size;
    }

    bool edges_;
    std::array<jostle::Vec3d, 4> from_, to_;
    std::vector<std::pair<Exact, Exact>> corners_;
};

/// Whether a segment and a triangle have a point in common: some point of the segment, and weights of the
/// corners, from the inequalities alone. Coordinates are whole numbers.
/// By clipping the segment, in its parameter, with the triangle's plane and its three sides.
inline bool crosses(const std::array<jostle::Vec3d, 2>& segment, const std::array<jostle::Vec3d, 3>& triangle)
{
    const auto exact = [](const jostle::Vec3d& v) {
        return Exact{Rational(v[0]), Rational(v[1]), Rational(v[2])};
    };
    const auto minus = [](const Exact& a, const Exact& b) {
        return Exact{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    };
    const auto times = [](const Exact& a, const Exact& b) -> Rational {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const auto product = [](const Exact& a, const Exact& b) {
        return Exact{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const auto is_zero = [](const Exact& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; };
    const Exact p = exact(segment[0]), q = exact(segment[1]), way = minus(q, p);
    const Exact corner[3] = {exact(triangle[0]), exact(triangle[1]), exact(triangle[2])};
    const Exact normal = product(minus(corner[1], corner[0]), minus(corner[2], corner[0]));
    if (is_zero(normal)) { // no area: do two segments meet? The triangle is the longest of its sides
        for (std::size_t k = 0; k < 3; ++k) {
            const Exact &a = corner[k], side = minus(corner[(k + 1) % 3], a), between = minus(a, p);
            const Exact both = product(way, side);
            const Rational size = times(both, both);
            if (size != 0) {
                if (times(between, both) != 0) continue;
                const Rational s = times(product(between, side), both) / size,
                               t = times(product(between, way), both) / size;
                if (s >= 0 && s <= 1 && t >= 0 && t <= 1) return true;
                continue;
            }
            // Parallel, or one is a point: an end of one lies on the other.
            const auto on = [&](const Exact& x, const Exact& from, const Exact& along) {
                const Exact to_x = minus(x, from);
                const Rational length = times(along, along), part = times(to_x, along);
                return length == 0 ? is_zero(to_x)
                                   : is_zero(product(to_x, along)) && part >= 0 && part <= length;
            };
            if (on(a, p, way) || on(corner[(k + 1) % 3], p, way) || on(p, a, side) || on(q, a, side))
                return true;
        }
        return false;
    }
    Rational low = 0, high = 1;                                         // of the segment, what is left
    const auto clip = [&](const Rational& at_p, const Rational& at_q) { // keeps what is >= 0
        if (at_p < 0 && at_q < 0) low = 2;
        if (at_p < 0 && at_q >= 0) low = std::max(low, Rational(at_p / (at_p - at_q)));
        if (at_p >= 0 && at_q < 0) high = std::min(high, Rational(at_p / (at_p - at_q)));
    };
    const Rational above_p = times(normal, minus(p, corner[0])), above_q = times(normal, minus(q, corner[0]));
    clip(above_p, above_q);
    clip(-above_p, -above_q);
    for (std::size_t k = 0; k < 3; ++k) {
        const Exact inward = product(normal, minus(corner[(k + 1) % 3], corner[k]));
        clip(times(inward, minus(p, corner[k])), times(inward, minus(q, corner[k])));
    }
    return low <= high;
}

} // namespace oracle
