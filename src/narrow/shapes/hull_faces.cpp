// SPDX-License-Identifier: MIT
#include "narrow/shapes/hull_faces.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "narrow/shapes/orientation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

namespace {

/// A merged face is convex except for dents in its border from the points' rounding: see cut_in_two().
class Cutter
{
  public:
    Cutter(const PointSet& points, std::vector<Face>& faces) : points_(points), faces_(faces) {}

    /// Cuts a face in two where its border turns clockwise. Returns false if it turns so nowhere.
    bool cut_in_two(Index face)
    {
        std::vector<Side>& loop = faces_[face].loop;
        const std::size_t count = loop.size();
        flatten(face);
        for (std::size_t from = 0; from < count; ++from) {
            if (!is_reflex(at(from + count - 1), at(from), at(from + 1))) continue;
            const std::size_t to = best_end(from);
            if (to == from) continue;
            std::rotate(loop.begin(), loop.begin() + static_cast<std::ptrdiff_t>(from), loop.end());
            split(face, (to + count - from) % count);
            return true;
        }
        return false;
    }

    /// Removes the corners where the border of a flat hull's two faces turns clockwise.
    void drop_reflex()
    {
        std::vector<Side>& loop = faces_[0].loop;
        flatten(0);
        for (std::size_t i = 0; i < loop.size();)
            if (is_reflex(at(i + loop.size() - 1), at(i), at(i + 1))) {
                loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(i));
                flat_.erase(flat_.begin() + static_cast<std::ptrdiff_t>(i));
                i = i > 1 ? i - 2 : 0;
            } else {
                ++i;
            }
        faces_[1].loop.clear();
        for (const Side& side : loop)
            faces_[1].loop.insert(faces_[1].loop.begin(), {side.v, 0});
    }

  private:
    [[nodiscard]] const Vec2& at(std::size_t i) const { return flat_[i % flat_.size()]; }
    void flatten(Index face)
    {
        Vec3 u, v;
        basis(faces_[face].normal, u, v);
        flat_.clear();
        for (const Side& side : faces_[face].loop)
            flat_.push_back({dot(points_[side.v], u), dot(points_[side.v], v)});
    }
    /// By more than the rounding of these coordinates.
    static bool is_reflex(const Vec2& a, const Vec2& b, const Vec2& c)
    {
        return cross(b - a, c - b) < -1e-15 * (length(b - a) + length(c - b));
    }
    /// The other end of the cut: the nearest that leaves no reflex corner at `from`, or the nearest of all.
    [[nodiscard]] std::size_t best_end(std::size_t from) const
    {
        const std::size_t count = flat_.size();
        const Vec2 &p = at(from), &before = at(from + count - 1), &after = at(from + 1);
        std::size_t best = from;
        double least = HUGE_VAL;
        bool heals = false;
        for (std::size_t k = 2; k + 1 < count; ++k) {
            const Vec2& q = at(from + k);
            const bool left_of_both = !is_reflex(before, p, q) && !is_reflex(q, p, after);
            const bool outside = cross(before - p, q - p) >= 0 && cross(q - p, after - p) >= 0;
            const double size = length2(q - p);
            if (outside || (heals && !left_of_both) || (heals == left_of_both && !(size < least))) continue;
            if (!sees(from, from + k)) continue;
            best = (from + k) % count;
            least = size;
            heals = left_of_both;
        }
        return best;
    }
    /// Whether the line between two corners meets no other side of the border.
    [[nodiscard]] bool sees(std::size_t from, std::size_t to) const
    {
        const std::size_t count = flat_.size();
        const Vec2 &p = at(from), &q = at(to);
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t next = (k + 1) % count;
            if (k == from || next == from || k == to % count || next == to % count) continue;
            const Vec2 &a = at(k), &b = at(next);
            if (cross(q - p, a - p) * cross(q - p, b - p) <= 0 &&
                cross(b - a, p - a) * cross(b - a, q - a) <= 0)
                return false;
        }
        return true;
    }
    /// Cuts from the first corner of a face to another: the part right of the line becomes a new face.
    void split(Index face, std::size_t to)
    {
        const Index added = static_cast<Index>(faces_.size());
        faces_.push_back({faces_[face].normal, {}});
        std::vector<Side>&loop = faces_[face].loop, &other = faces_[added].loop;
        const auto end = loop.begin() + static_cast<std::ptrdiff_t>(to);
        other.assign(loop.begin(), end);
        other.push_back({end->v, face});
        loop.erase(loop.begin() + 1, end);
        loop[0].beyond = added;
        for (std::size_t k = 0; k < to; ++k) {
            std::vector<Side>& beyond = faces_[other[k].beyond].loop;
            for (std::size_t i = 0; i < beyond.size(); ++i)
                if (beyond[i].v == other[k + 1].v && beyond[i].beyond == face &&
                    beyond[i + 1 == beyond.size() ? 0 : i + 1].v == other[k].v)
                    beyond[i].beyond = added;
        }
    }

    const PointSet& points_;
    std::vector<Face>& faces_;
    std::vector<Vec2> flat_; ///< the corners of the face being cut
};

/// The triangles of a hull, merged into faces.
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
        Cutter cutter(points_, result);
        if (result.size() == 2) {
            result[1].normal = -result[0].normal;
            cutter.drop_reflex();
        }
        for (Index f = 0; f < result.size(); ++f)
            while (cutter.cut_in_two(f)) {
            }
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
    /// A face is everything within the slack below a triangle's plane, the largest first, as long as it stays
    /// a disc. All points are below that plane, since the hull is exact.
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
                normal = exact_cross(a, b, c); // otherwise right except for its last bits
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
    /// Whether a patch with this triangle still has a single border that doesn't meet itself.
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
        // A sliver between two faces is at least a triangle.
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
