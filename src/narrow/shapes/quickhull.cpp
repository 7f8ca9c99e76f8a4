// SPDX-License-Identifier: MIT
// Source: Barber, Dobkin, Huhdanpaa, The Quickhull Algorithm for Convex Hulls, ACM TOMS 22(4), 1996, with
// exact predicates.
#include "narrow/shapes/quickhull.hpp"

#include <cassert>
#include <cmath>
#include <utility>

#include "narrow/shapes/orientation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

namespace {

/// A hull that grows by one point at a time. A point is added only if it is outside the present hull, by
/// exact predicates, so each is added at most once, sees one patch with a simple border, and no triangle has
/// zero area.
class Quickhull
{
  public:
    Quickhull(const PointSet& points, const Index (&start)[4])
        : points_(points), next_(points.size(), none), begins_at_(points.size(), none)
    {
        Index s[4] = {start[0], start[1], start[2], start[3]};
        if (side_of_plane(points[s[0]], points[s[1]], points[s[2]], points[s[3]]) > 0)
            std::swap(s[1], s[2]); // now s[3] is below the triangle s[0] s[1] s[2]
        add(s[0], s[1], s[2]);
        add(s[0], s[3], s[1]);
        add(s[1], s[3], s[2]);
        add(s[2], s[3], s[0]);
        constexpr Index beside[4][3] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
        for (Index f = 0; f < 4; ++f)
            for (Index i = 0; i < 3; ++i)
                triangles[f].neighbour[i] = beside[f][i];
        for (Index i = 0; i < points.size(); ++i)
            if (i != s[0] && i != s[1] && i != s[2] && i != s[3]) give(i, 0);
        for (Index f = 0; f < triangles.size(); ++f)
            if (triangles[f].alive && triangles[f].outside != none) grow(f);
    }
    std::vector<Triangle> triangles; ///< in any order, some no longer alive

  private:
    struct Side
    {
        Index a, b, beyond;
    };

    [[nodiscard]] bool above(const Triangle& t, Index p) const
    {
        const double height = dot(t.normal, points_[p] - points_[t.v[0]]);
        if (std::abs(height) > t.doubt) return height > 0;
        return side_of_plane(points_[t.v[0]], points_[t.v[1]], points_[t.v[2]], points_[p]) > 0;
    }
    [[nodiscard]] Index count() const { return static_cast<Index>(triangles.size()); }

    void add(Index a, Index b, Index c)
    {
        Triangle t{}; // initialised, since sanitizer builds of g++ 12 warn of an uninitialised part
        t.v[0] = a, t.v[1] = b, t.v[2] = c;
        const Vec3 u = points_[b] - points_[a], v = points_[c] - points_[a];
        t.normal = cross(u, v);
        t.doubt = determinant_rounding * dot(products_of(u, v), points_.extent);
        t.outside = none;
        t.alive = true;
        triangles.push_back(t);
    }
    /// Assigns the point to the first of the triangles from `first` on that it is above. A point still
    /// outside the hull is above one of the triangles that replaced those it was above.
    void give(Index p, Index first)
    {
        for (Index f = first; f < count(); ++f)
            if (above(triangles[f], p)) {
                next_[p] = triangles[f].outside;
                triangles[f].outside = p;
                return;
            }
    }
    /// Adds the highest of a triangle's points. The triangles that see it form one patch, which is replaced
    /// by a fan from its border, the horizon, to the new point.
    void grow(Index from)
    {
        Index apex = none;
        double most = -HUGE_VAL;
        for (Index p = triangles[from].outside; p != none; p = next_[p]) {
            const double height = dot(triangles[from].normal, points_[p] - points_[triangles[from].v[0]]);
            if (height > most) most = height, apex = p;
        }
        // The triangles that see the apex, found from neighbour to neighbour.
        patch_.assign(1, from);
        triangles[from].mark = ++round_;
        for (std::size_t k = 0; k < patch_.size(); ++k)
            for (const Index g : triangles[patch_[k]].neighbour)
                if (triangles[g].mark != round_ && above(triangles[g], apex)) {
                    triangles[g].mark = round_;
                    patch_.push_back(g);
                }
        horizon_.clear();
        orphans_.clear();
        for (const Index f : patch_) {
            Triangle& t = triangles[f];
            t.alive = false;
            for (Index i = 0; i < 3; ++i)
                if (triangles[t.neighbour[i]].mark != round_)
                    horizon_.push_back({t.v[i], t.v[(i + 1) % 3], t.neighbour[i]});
            for (Index p = t.outside; p != none; p = next_[p])
                if (p != apex) orphans_.push_back(p);
        }
        assert(round_ <= points_.size());
        const Index first = count();
        for (const Side& side : horizon_) {
            const Index f = count();
            begins_at_[side.a] = f;
            add(side.a, side.b, apex);
            triangles[f].neighbour[0] = side.beyond;
            for (Index i = 0; i < 3; ++i)
                if (triangles[side.beyond].v[i] == side.b) triangles[side.beyond].neighbour[i] = f;
        }
        for (Index f = first; f < count(); ++f) {
            const Index g = begins_at_[triangles[f].v[1]];
            triangles[f].neighbour[1] = g;
            triangles[g].neighbour[2] = f;
        }
        for (const Index p : orphans_)
            give(p, first);
    }

    const PointSet& points_;
    std::vector<Index> next_;      ///< of each point, the next one above the same triangle
    std::vector<Index> begins_at_; ///< of a point of the horizon, the new triangle whose first corner it is
    std::vector<Index> patch_, orphans_;
    std::vector<Side> horizon_;
    Index round_ = 0;
};

} // namespace

std::vector<Triangle> quickhull(const PointSet& points, const Index (&start)[4])
{
    return std::move(Quickhull(points, start).triangles);
}

} // namespace narrow::hull
JOSTLE_NAMESPACE_END
