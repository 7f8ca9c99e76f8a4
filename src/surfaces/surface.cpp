// SPDX-License-Identifier: MIT
#include <algorithm>
#include <string>

#include "jostle/error.hpp"
#include "jostle/surface.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

/// Throws unless the vertices are below `count`, and no two the same.
template <std::size_t N>
void check_part(const char* part, std::uint64_t number, const std::array<std::uint32_t, N>& vertices,
                std::size_t count)
{
    for (std::size_t k = 0; k < N; ++k) {
        if (vertices[k] >= count)
            throw Error(ErrorCode::invalid_argument,
                        std::string(part) + " " + std::to_string(number) + " has vertex " +
                            std::to_string(vertices[k]) + " of " + std::to_string(count),
                        number);
        if (std::find(vertices.begin(), vertices.begin() + k, vertices[k]) != vertices.begin() + k)
            throw Error(ErrorCode::invalid_argument,
                        std::string(part) + " " + std::to_string(number) + " has vertex " +
                            std::to_string(vertices[k]) + " twice; leave it out",
                        number);
    }
}

template <class Item>
void keep_once(std::vector<Item>& items)
{
    std::sort(items.begin(), items.end());
    items.erase(std::unique(items.begin(), items.end()), items.end());
    items.shrink_to_fit();
}

} // namespace

Surface::Surface(std::span<const Triangle> triangles, std::span<const Edge> edges,
                 std::span<const std::uint32_t> points, std::size_t vertices)
    : vertices_(vertices),
      triangles_(triangles.begin(), triangles.end()),
      points_(points.begin(), points.end())
{
    for (const Triangle& triangle : triangles) {
        points_.insert(points_.end(), triangle.begin(), triangle.end());
        for (std::size_t k = 0; k < 3; ++k)
            edges_.push_back({triangle[k], triangle[(k + 1) % 3]});
    }
    for (const Edge& edge : edges) {
        points_.insert(points_.end(), edge.begin(), edge.end());
        edges_.push_back(edge);
    }
    for (Edge& edge : edges_)
        std::sort(edge.begin(), edge.end());
    keep_once(edges_);
    keep_once(points_);
    if (vertices_ == 0 && !points_.empty()) vertices_ = std::size_t{points_.back()} + 1;

    for (std::size_t k = 0; k < triangles.size(); ++k)
        check_part("triangle", k, triangles[k], vertices_);
    for (std::size_t k = 0; k < edges.size(); ++k)
        check_part("edge", k, edges[k], vertices_);
    for (std::size_t k = 0; k < points.size(); ++k)
        check_part<1>("point", k, {points[k]}, vertices_);
}

JOSTLE_NAMESPACE_END
