// SPDX-License-Identifier: MIT
// Sources: in the plane Andrew's monotone chain (1979); Douglas, Peucker, Cartographica 10(2), 1973.
#include "narrow/shapes/hull_points.hpp"

#include <cmath>
#include <utility>

#include "narrow/shapes/orientation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

Vec3 products_of(const Vec3& u, const Vec3& v)
{
    return {std::abs(u.y * v.z) + std::abs(u.z * v.y), std::abs(u.z * v.x) + std::abs(u.x * v.z),
            std::abs(u.x * v.y) + std::abs(u.y * v.x)};
}

std::vector<Index> planar_hull(const PointSet& points, int u, int v, std::vector<Index> order)
{
    const auto at = [&](Index i) { return Vec2{points[i][u], points[i][v]}; };
    std::sort(order.begin(), order.end(), [&](Index i, Index j) {
        const Vec2 p = at(i), q = at(j);
        return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : i < j;
    });
    order.erase(std::unique(order.begin(), order.end(),
                            [&](Index i, Index j) {
                                const Vec2 p = at(i), q = at(j);
                                return p.x == q.x && p.y == q.y;
                            }),
                order.end());
    std::vector<Index> hull;
    const auto chain = [&] { // turns left at each of its corners
        const std::size_t first = hull.size();
        for (const Index i : order) {
            while (hull.size() >= first + 2 &&
                   side_of_line(at(hull[hull.size() - 2]), at(hull.back()), at(i)) <= 0)
                hull.pop_back();
            hull.push_back(i);
        }
        if (order.size() > 1) hull.pop_back(); // the other chain begins with it
    };
    chain();
    if (order.size() == 1) return hull;
    std::reverse(order.begin(), order.end());
    chain();
    return hull;
}

std::vector<Index> plane_hull(const PointSet& points, const Vec3& normal, std::vector<Index> of)
{
    int along = 0;
    for (int d = 1; d < 3; ++d)
        if (std::abs(normal[d]) > std::abs(normal[along])) along = d;
    const int u = (along + 1) % 3, v = (along + 2) % 3;
    const bool up = normal[along] > 0;
    return planar_hull(points, up ? u : v, up ? v : u, std::move(of));
}

void keep_corners(const PointSet& points, const std::vector<Index>& chain, std::size_t first,
                  std::size_t last, std::vector<char>& kept)
{
    std::vector<std::pair<std::size_t, std::size_t>> open{{first, last}};
    while (!open.empty()) {
        const auto [begin, end] = open.back();
        open.pop_back();
        const Vec3 from = points[chain[begin]], along = points[chain[end]] - from;
        const double size = length2(along);
        double most = points.slack;
        std::size_t best = begin;
        for (std::size_t k = begin + 1; k < end; ++k) {
            const Vec3 p = points[chain[k]] - from;
            const double t = size > 0 ? std::clamp(dot(p, along) / size, 0.0, 1.0) : 0;
            if (const double far = length(p - along * t); far > most) most = far, best = k;
        }
        if (best == begin) continue;
        kept[chain[best]] = 1;
        open.push_back({begin, best});
        open.push_back({best, end});
    }
}
void keep_corners(const PointSet& points, std::vector<Index> loop, std::vector<char>& kept)
{
    const auto furthest_from = [&](std::size_t from) {
        std::size_t best = from;
        double most = 0;
        for (std::size_t k = 0; k < loop.size(); ++k)
            if (const double far = length2(points[loop[k]] - points[loop[from]]); far > most)
                most = far, best = k;
        return best;
    };
    std::rotate(loop.begin(), loop.begin() + static_cast<std::ptrdiff_t>(furthest_from(0)), loop.end());
    const std::size_t other = furthest_from(0);
    kept[loop[0]] = kept[loop[other]] = 1;
    loop.push_back(loop[0]);
    keep_corners(points, loop, 0, other, kept);
    keep_corners(points, loop, other, loop.size() - 1, kept);
}

} // namespace narrow::hull
JOSTLE_NAMESPACE_END
