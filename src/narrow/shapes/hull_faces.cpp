// SPDX-License-Identifier: MIT
#include "narrow/shapes/hull_faces.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "narrow/shapes/orientation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

namespace {

/// The triangles of a hull, put together to faces.
class Faces
{
  public:
    Faces(const PointSet& points, std::vector<Triangle>&& triangles)
        : points_(points),
          triangles_(std::move(triangles)),
          face_of_(triangles_.size(), none),
          on_face_(points.size(), none),
          borders_at_(points.size(), 0),
          kept_(points.size(), 0)
    {
        find_patches();
        find_borders();
        for (Index face = 0; face < borders_.size(); ++face)
            keep_some(face);
    }
    [[nodiscard]] std::vector<Face> faces() const
    {
        std::vector<Face> result;
        for (Index f = 0; f < borders_.size(); ++f) {
            Face& face = result.emplace_back(Face{normals_[f], {}});
            for (const Side& side : borders_[f])
                if (kept_[side.v] != 0) face.loop.push_back(side);
            if (face.loop.size() < 3) return {};
        }
        if (result.size() == 2) result[1].normal = -result[0].normal;
        return result;
    }
    [[nodiscard]] std::vector<Index> corners() const
    {
        std::vector<Index> result;
        for (Index i = 0; i < points_.size(); ++i)
            if (kept_[i] != 0) result.push_back(i);
        return result;
    }

  private:
    /// Each face is what lies within the slack below a triangle's plane, the largest first, and stays a disc.
    /// All points are below that plane, since the hull is exact.
    void find_patches()
    {
        std::vector<Index> order;
        for (Index t = 0; t < triangles_.size(); ++t)
            if (triangles_[t].alive) order.push_back(t);
        for (const Index t : order) {
            const Vec3 &a = points_[triangles_[t].v[0]], &b = points_[triangles_[t].v[1]],
                       &c = points_[triangles_[t].v[2]];
            Vec3& normal = triangles_[t].normal;
            const Vec3 products = products_of(b - a, c - a);
            const double sum = products.x + products.y + products.z;
            if (sum * sum > 16 * length2(normal))
                normal = exact_cross(a, b, c); // else right but for its last bits
        }
        std::sort(order.begin(), order.end(), [&](Index t, Index u) {
            const double area_t = length2(triangles_[t].normal), area_u = length2(triangles_[u].normal);
            return area_t != area_u ? area_t > area_u : t < u;
        });
        std::vector<Index> patch;
        for (const Index seed : order) {
            if (face_of_[seed] != none) continue;
            const Index face = static_cast<Index>(normals_.size());
            const Triangle& base = triangles_[seed];
            const Vec3 n = base.normal * (1 / length(base.normal));
            normals_.push_back(n);
            face_of_[seed] = face;
            for (const Index v : base.v)
                on_face_[v] = face;
            patch.assign(1, seed);
            for (std::size_t k = 0; k < patch.size(); ++k)
                for (const Index t : triangles_[patch[k]].neighbour) {
                    if (face_of_[t] != none || !is_level(triangles_[t], n, points_[base.v[0]]) ||
                        !keeps_disc(triangles_[t], face))
                        continue;
                    face_of_[t] = face;
                    for (const Index v : triangles_[t].v)
                        on_face_[v] = face;
                    patch.push_back(t);
                }
        }
    }
    [[nodiscard]] bool is_level(const Triangle& t, const Vec3& n, const Vec3& at) const
    {
        bool level = dot(t.normal, n) > 0;
        for (const Index v : t.v)
            level = level && std::abs(dot(n, points_[v] - at)) <= points_.slack;
        return level;
    }
    /// Whether a patch with this triangle has still one border that meets itself nowhere.
    [[nodiscard]] bool keeps_disc(const Triangle& t, Index face) const
    {
        Index shared = 0, opposite = none;
        for (Index i = 0; i < 3; ++i)
            if (face_of_[t.neighbour[i]] == face) ++shared, opposite = t.v[(i + 2) % 3];
        return shared == 2 || (shared == 1 && on_face_[opposite] != face);
    }
    void find_borders()
    {
        borders_.resize(normals_.size());
        for (Index first = 0; first < triangles_.size(); ++first) {
            if (!triangles_[first].alive) continue;
            const Index face = face_of_[first];
            for (Index i = 0; i < 3; ++i) {
                if (face_of_[triangles_[first].neighbour[i]] == face) continue;
                ++borders_at_[triangles_[first].v[i]];
                if (borders_[face].empty()) borders_[face] = border_from(first, i);
            }
        }
        for (Index v = 0; v < points_.size(); ++v)
            kept_[v] = borders_at_[v] >= 3 ? 1 : 0; // where three faces meet or more
    }
    /// Counterclockwise seen from outside.
    [[nodiscard]] std::vector<Side> border_from(Index first, Index first_side) const
    {
        std::vector<Side> border;
        Index t = first, side = first_side;
        do {
            border.push_back({triangles_[t].v[side], face_of_[triangles_[t].neighbour[side]]});
            const Index corner = triangles_[t].v[(side + 1) % 3];
            side = (side + 1) % 3;
            while (face_of_[triangles_[t].neighbour[side]] == face_of_[first]) { // around the corner
                t = triangles_[t].neighbour[side];
                for (Index k = 0; k < 3; ++k)
                    if (triangles_[t].v[k] == corner) side = k;
            }
        } while (t != first || side != first_side);
        return border;
    }
    void keep_some(Index face)
    {
        std::vector<Side> border = borders_[face];
        const auto is_corner = [&](const Side& side) { return borders_at_[side.v] >= 3; };
        const auto corner = std::find_if(border.begin(), border.end(), is_corner);
        std::vector<Index> chain;
        if (corner == border.end()) { // two faces, one border
            for (const Side& side : border)
                chain.push_back(side.v);
            if (face == 0) keep_corners(points_, std::move(chain), kept_);
            return;
        }
        std::rotate(border.begin(), corner, border.end());
        border.push_back(border[0]);
        for (std::size_t k = 0; k + 1 < border.size(); ++k) {
            const Index beyond = border[k].beyond;
            chain.assign(1, border[k].v);
            do
                chain.push_back(border[++k].v);
            while (!is_corner(border[k]));
            --k;
            if (face < beyond) keep_corners(points_, chain, 0, chain.size() - 1, kept_);
        }
        // A sliver between two faces is a triangle at least.
        border.pop_back();
        std::vector<Index> ends;
        for (const Side& side : border)
            if (kept_[side.v] != 0) ends.push_back(side.v);
        if (ends.size() > 2) return;
        const Vec3 from = points_[ends[0]], along = points_[ends[1]] - from;
        double most = -1;
        Index best = none;
        for (const Side& side : border)
            if (const double far = length2(cross(along, points_[side.v] - from));
                kept_[side.v] == 0 && far > most)
                most = far, best = side.v;
        kept_[best] = 1;
    }

    const PointSet& points_;
    std::vector<Triangle> triangles_;
    std::vector<Vec3> normals_;              ///< of faces
    std::vector<std::vector<Side>> borders_; ///< of faces, with all points
    std::vector<Index> face_of_;             ///< of triangles
    std::vector<Index> on_face_, borders_at_;
    std::vector<char> kept_;
};

} // namespace

Merged merge_triangles(const PointSet& points, std::vector<Triangle>&& triangles)
{
    const Faces merged(points, std::move(triangles));
    return {merged.faces(), merged.corners()};
}

} // namespace narrow::hull
JOSTLE_NAMESPACE_END
