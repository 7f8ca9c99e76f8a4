// SPDX-License-Identifier: MIT
// Slow answers to compare with: the definition of distance and penetration depth for hulls of a few points.
#pragma once

#include <cstdint>
#include <vector>

#include "narrow/math.hpp"

namespace oracle {

using jostle::narrow::Vec3;

/// Distance from the origin to a triangle, whatever its shape: inside by its plane, else by its sides. Of one
/// so thin that rounding of its corners decides where its plane lies, only the sides count.
inline double to_segment(const Vec3& p, const Vec3& q)
{
    const Vec3 d = q - p;
    const double size = dot(d, d);
    double t = size > 0 ? -dot(p, d) / size : 0;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return length(p + d * t);
}
inline double to_triangle(const Vec3& p, const Vec3& q, const Vec3& r)
{
    double least = std::min(to_segment(p, q), std::min(to_segment(q, r), to_segment(r, p)));
    const Vec3 n = cross(q - p, r - p);
    const double size = length(n);
    const double edges = length(q - p) + length(r - p), away = length(p) + edges;
    if (size > 1e-10 * edges * away) {
        const bool in = dot(n, cross(p, q)) >= 0 && dot(n, cross(q, r)) >= 0 && dot(n, cross(r, p)) >= 0;
        if (in) least = std::min(least, std::abs(dot(n, p)) / size);
    }
    return least;
}

/// Signed distance of the hulls of two point sets. The hull of all differences a - b holds the origin where
/// they overlap; then the depth is the least distance of a plane through three differences with all others
/// on one side, or 0 where the differences have no volume.
inline double signed_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b)
{
    std::vector<Vec3> difference;
    double extent = 0;
    for (const Vec3& p : a)
        for (const Vec3& q : b) {
            difference.push_back(p - q);
            extent = std::max(extent, length(p - q));
        }
    const std::size_t n = difference.size();
    const double slack = 1e-11 * extent;
    double outside = 1e300, depth = 1e300;
    bool is_outside = false, is_flat = true;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = i; j < n; ++j)
            for (std::size_t k = j; k < n; ++k) {
                const Vec3 &p = difference[i], &q = difference[j], &r = difference[k];
                const Vec3 normal = cross(q - p, r - p);
                const double size = length(normal);
                if (size < 1e-9 * extent * extent) continue;
                const Vec3 unit = normal * (1 / size);
                double lo = 0, hi = 0;
                for (const Vec3& s : difference) {
                    const double h = dot(unit, s - p);
                    lo = std::min(lo, h), hi = std::max(hi, h);
                    if (lo < -slack && hi > slack) break;
                }
                if (lo < -slack && hi > slack) continue;
                if (lo >= -slack && hi <= slack) { // all in one plane
                    is_outside = is_outside || std::abs(dot(unit, p)) > slack;
                    continue;
                }
                is_flat = false;
                const double offset = hi <= slack ? dot(unit, p) : -dot(unit, p);
                if (offset < 0) is_outside = true;
                depth = std::min(depth, offset);
            }
    if (!is_outside && !is_flat) return -depth;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = i; j < n; ++j)
            for (std::size_t k = j; k < n; ++k)
                outside = std::min(outside, to_triangle(difference[i], difference[j], difference[k]));
    return outside <= slack ? 0 : outside;
}

/// The same in the plane: sides through two differences.
inline double signed_distance(const std::vector<jostle::narrow::Vec2>& a,
                              const std::vector<jostle::narrow::Vec2>& b)
{
    using jostle::narrow::Vec2;
    std::vector<Vec2> difference;
    double extent = 0;
    for (const Vec2& p : a)
        for (const Vec2& q : b) {
            difference.push_back(p - q);
            extent = std::max(extent, length(p - q));
        }
    const double slack = 1e-11 * extent;
    double depth = 1e300, outside = 1e300;
    bool is_outside = false, is_flat = true;
    for (const Vec2& p : difference)
        for (const Vec2& q : difference) {
            const Vec3 flat_p{p.x, p.y, 0}, flat_q{q.x, q.y, 0};
            outside = std::min(outside, to_segment(flat_p, flat_q));
            const double size = length(q - p);
            if (size < 1e-9 * extent) continue;
            const Vec2 unit = right(q - p) * (1 / size);
            double lo = 0, hi = 0;
            for (const Vec2& s : difference) {
                lo = std::min(lo, dot(unit, s - p));
                hi = std::max(hi, dot(unit, s - p));
            }
            if (hi > slack) continue;
            if (lo >= -slack) { // all on one line
                is_outside = is_outside || std::abs(dot(unit, p)) > slack;
                continue;
            }
            is_flat = false;
            if (dot(unit, p) < 0) is_outside = true;
            depth = std::min(depth, dot(unit, p));
        }
    if (!is_outside && !is_flat) return -depth;
    return outside <= slack ? 0 : outside;
}

} // namespace oracle
