// SPDX-License-Identifier: MIT
// Convex hulls: exact ones first; then what is flat or straight but for its points' rounding is made so.
// Source: Barber, Dobkin, Huhdanpaa, The Quickhull Algorithm for Convex Hulls, ACM TOMS 22(4), 1996, with
// exact predicates; in the plane Andrew's monotone chain (1979); Douglas, Peucker, Cartographica 10(2), 1973.
#include <algorithm>
#include <cassert>
#include <limits>
#include <string>
#include <utility>

#include "base/exact_floats.hpp"
#include "narrow/orientation.hpp"
#include "narrow/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

using Index = std::uint32_t;
constexpr Index none = ~Index{0};

/// The points as they are computed with: scaled by a power of two to an extent of 1 to 2, which loses
/// nothing, whatever their size; then what is smaller than 2^-201 is cut off, so that predicates are exact.
/// In the plane z is 0.
struct PointSet
{
    std::vector<Vec3> points;
    Vec3 extent;
    int longest_axis = 0;
    /// How far points may be from where one face, edge or corner stands for them: what their own type rounds.
    /// Far from the origin that would be the whole hull, so it is never more than a small part of that.
    double slack = 0;

    template <class Given>
    PointSet(const std::vector<Given>& given, double epsilon) : points(given.size())
    {
        constexpr int dim = std::is_same_v<Given, Vec3> ? 3 : 2;
        for (int d = 0; d < dim; ++d) {
            double lo = given[0][d], hi = lo;
            for (const Given& p : given)
                lo = std::min(lo, p[d]), hi = std::max(hi, p[d]);
            extent[d] = hi - lo;
            if (extent[d] > extent[longest_axis]) longest_axis = d;
        }
        if (!(extent[longest_axis] > 0)) return; // all in one place
        const int scale = -std::ilogb(extent[longest_axis]);
        double size = 0;
        for (int d = 0; d < dim; ++d) {
            if (extent[d] == 0) continue; // all 0, whatever they were
            extent[d] = std::ldexp(extent[d], scale);
            for (std::size_t i = 0; i < given.size(); ++i) {
                double x = std::ldexp(given[i][d], scale);
                if (std::abs(x) < 0x1p-149) x = (x + 0x1p-148) - 0x1p-148;
                points[i][d] = x;
                size = std::max(size, std::abs(x));
            }
        }
        slack = std::min(8 * epsilon * size, 0x1p-13 * extent[longest_axis]);
    }
    const Vec3& operator[](Index i) const { return points[i]; }
    [[nodiscard]] Index size() const { return static_cast<Index>(points.size()); }
    template <class Measure>
    [[nodiscard]] Index furthest(Measure&& measure) const
    {
        Index best = 0;
        double most = -HUGE_VAL;
        for (Index i = 0; i < size(); ++i)
            if (const double m = measure(points[i]); m > most) most = m, best = i;
        return best;
    }
};

/// The sizes of the products that the coordinates of a cross product are differences of.
Vec3 products_of(const Vec3& u, const Vec3& v)
{
    return {std::abs(u.y * v.z) + std::abs(u.z * v.y), std::abs(u.z * v.x) + std::abs(u.x * v.z),
            std::abs(u.x * v.y) + std::abs(u.y * v.x)};
}

/// Corners of points in the plane of the axes u and v, counterclockwise; one or two where all lie in a place
/// or a line.
std::vector<Index> planar_hull(const PointSet& points, int u, int v)
{
    const auto at = [&](Index i) { return Vec2{points[i][u], points[i][v]}; };
    std::vector<Index> order(points.size());
    for (Index i = 0; i < order.size(); ++i)
        order[i] = i;
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

/// The same of points in the plane with that normal, counterclockwise seen from where it points: in the plane
/// of two axes, where they all have other places, too.
std::vector<Index> plane_hull(const PointSet& points, const Vec3& normal)
{
    int along = 0;
    for (int d = 1; d < 3; ++d)
        if (std::abs(normal[d]) > std::abs(normal[along])) along = d;
    const int u = (along + 1) % 3, v = (along + 2) % 3;
    return normal[along] > 0 ? planar_hull(points, u, v) : planar_hull(points, v, u);
}

/// Of a line of points from chain[first] to chain[last], both kept: keeps what is further than the slack from
/// the line that is left.
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
/// The same of a closed loop. Two corners are sure: what is furthest from any point, and what is furthest
/// from that.
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

struct Triangle
{
    Index v[3];         ///< counterclockwise seen from outside
    Index neighbour[3]; ///< across the side from v[i] to v[i + 1]
    Vec3 normal;        ///< of any length, and as far as rounding lets it
    double doubt;       ///< a height times that length which is no more may be on either side
    Index outside;      ///< the first of the points above it that it answers for
    Index mark;
    bool alive;
};

/// The exact hull, in triangles. A point is added only if it is outside of what there is, by exact
/// predicates: so each is added once at most, what it sees is one patch with a simple border, and no triangle
/// is without area.
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
        Triangle t{}; // all of it: sanitizer builds of g++ 12 see a part that would be left open
        t.v[0] = a, t.v[1] = b, t.v[2] = c;
        const Vec3 u = points_[b] - points_[a], v = points_[c] - points_[a];
        t.normal = cross(u, v);
        t.doubt = determinant_rounding * dot(products_of(u, v), points_.extent);
        t.outside = none;
        t.alive = true;
        triangles.push_back(t);
    }
    /// A point outside of the hull is above one of the triangles that took the place of those it was above.
    void give(Index p, Index first)
    {
        for (Index f = first; f < count(); ++f)
            if (above(triangles[f], p)) {
                next_[p] = triangles[f].outside;
                triangles[f].outside = p;
                return;
            }
    }
    void grow(Index from)
    {
        Index apex = none;
        double most = -HUGE_VAL;
        for (Index p = triangles[from].outside; p != none; p = next_[p]) {
            const double height = dot(triangles[from].normal, points_[p] - points_[triangles[from].v[0]]);
            if (height > most) most = height, apex = p;
        }
        // What sees the apex, found from neighbour to neighbour.
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

/// Of a border, and of what is beyond it. Face by face they make a closed surface: each side of a face is one
/// of its neighbour's.
struct Side
{
    Index v;      ///< the point where it begins
    Index beyond; ///< the face across it
};
struct Face
{
    Vec3 normal;
    std::vector<Side> loop;
};

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
    /// Empty where all points are in a line, within the slack. What is flat has a front and a back.
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
    /// The points that are left as corners.
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

void add_direction(std::vector<Vec3>& directions, const Vec3& d)
{
    const double size = length(d);
    if (!(size > 0)) return;
    const Vec3 unit = d * (1 / size);
    for (const Vec3& known : directions)
        if (length2(cross(known, unit)) < 1e-20) return;
    directions.push_back(unit);
}

/// Corners in the order given; of points in a line or a place, which have no faces, those that are `kept`.
void finish(HullData<3>& data, const std::vector<Vec3>& given, const PointSet& points,
            const std::vector<Face>& faces, const std::vector<Index>& kept)
{
    std::vector<Index> number(given.size(), none);
    for (const Face& face : faces)
        for (const Side& side : face.loop)
            number[side.v] = 0;
    for (const Index v : kept)
        number[v] = 0;
    for (Index i = 0; i < given.size(); ++i)
        if (number[i] == 0) {
            number[i] = static_cast<Index>(data.corners.size());
            data.corners.push_back({given[i].x, given[i].y, given[i].z});
            data.reach = std::max(data.reach, length(given[i]));
        }
    const Index count = static_cast<Index>(data.corners.size()), stride = padded(count);
    data.coordinates.resize(std::size_t{3} * stride);
    for (Index i = 0; i < stride; ++i)
        for (Index d = 0; d < 3; ++d)
            data.coordinates[std::size_t{d} * stride + i] = data.corners[i < count ? i : 0][d];
    const Index face_count = static_cast<Index>(faces.size()), face_stride = padded(face_count);
    data.normals.assign(std::size_t{3} * face_stride, 0);
    data.loop_begin.push_back(0);
    for (Index f = 0; f < face_stride && face_count > 0; ++f)
        for (Index d = 0; d < 3; ++d)
            data.normals[std::size_t{d} * face_stride + f] =
                faces[f < face_count ? f : 0].normal[static_cast<int>(d)];
    for (Index f = 0; f < face_count; ++f) {
        const std::vector<Side>& loop = faces[f].loop;
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const Index v = loop[k].v, w = loop[k + 1 == loop.size() ? 0 : k + 1].v, beyond = loop[k].beyond;
            data.loop.push_back(number[v]);
            if (beyond < f) continue; // it has the edge
            data.edge.push_back({{number[v], number[w]}, {f, beyond}});
            add_direction(data.direction, points[w] - points[v]);
        }
        data.loop_begin.push_back(static_cast<Index>(data.loop.size()));
    }
    for (Index f = 0; f < face_stride && face_count > 2; ++f) {
        const Vec3 n = faces[f < face_count ? f : 0].normal;
        double offset = -HUGE_VAL;
        for (const auto& corner : data.corners)
            offset = std::max(offset, dot(n, load(corner)));
        data.offsets.push_back(offset);
    }
    if (faces.empty() && count == 2) {
        data.edge.push_back({{0, 1}, {0, 0}});
        add_direction(data.direction, points[kept[1]] - points[kept[0]]);
    }
    Polytope& p = data.polytope;
    p.vertices = count;
    p.faces = face_count;
    p.edges = static_cast<Index>(data.edge.size());
    p.directions = static_cast<Index>(data.direction.size());
    p.x = data.coordinates.data();
    p.stride = stride;
    p.nx = data.normals.data();
    p.face_stride = face_stride;
    p.offset = data.offsets.empty() ? nullptr : data.offsets.data();
    p.loop_begin = data.loop_begin.data();
    p.loop = data.loop.data();
    p.edge = data.edge.data();
    p.direction = data.direction.data();
}

/// No given point is further outside than this times the slack: the inner points of a patch may be as far as
/// it from what its border spans, and those from what is left of that; and rounding has its part in each.
constexpr double slacks_outside = 5;

[[maybe_unused]] bool holds_all(const PointSet& points, const std::vector<Face>& faces)
{
    bool all = true;
    for (const Face& face : faces) {
        const Vec3 from = points[face.loop[0].v];
        double top = 0;
        for (const Side& side : face.loop)
            top = std::max(top, dot(face.normal, points[side.v] - from));
        for (const Vec3& p : points.points)
            all = all && dot(face.normal, p - from) <= top + slacks_outside * points.slack;
    }
    return all;
}

void build(HullData<3>& data, const std::vector<Vec3>& given, double epsilon)
{
    const PointSet points(given, epsilon);
    // The lowest and the highest, what is furthest from their line, and from the plane of all three. Rounding
    // may take a point for one of those that isn't: then any other will do.
    const int axis = points.longest_axis;
    Index start[4];
    start[0] = points.furthest([&](const Vec3& p) { return -p[axis]; });
    start[1] = points.furthest([&](const Vec3& p) { return p[axis]; });
    const Vec3 a = points[start[0]], b = points[start[1]];
    if (a[axis] == b[axis]) return finish(data, given, points, {}, {start[0]});

    const auto off_line = [&](Index i) { return length2(exact_cross(a, b, points[i])) > 0; };
    start[2] = points.furthest([&](const Vec3& p) { return length2(cross(b - a, p - a)); });
    for (Index i = 0; i < points.size() && !off_line(start[2]); ++i)
        start[2] = i;
    if (!off_line(start[2])) return finish(data, given, points, {}, {start[0], start[1]});

    const Vec3 c = points[start[2]], n = exact_cross(a, b, c);
    const auto off_plane = [&](Index i) { return side_of_plane(a, b, c, points[i]) != 0; };
    start[3] = points.furthest([&](const Vec3& p) { return std::abs(dot(p - a, n)); });
    for (Index i = 0; i < points.size() && !off_plane(start[3]); ++i)
        start[3] = i;
    std::vector<Face> faces;
    std::vector<Index> corners;
    if (!off_plane(start[3])) {
        std::vector<char> kept(given.size(), 0);
        const std::vector<Index> loop = plane_hull(points, n);
        keep_corners(points, loop, kept);
        faces = {{n * (1 / length(n)), {}}, {n * (-1 / length(n)), {}}};
        for (const Index v : loop) {
            if (kept[v] == 0) continue;
            corners.push_back(v);
            faces[0].loop.push_back({v, 1});
            faces[1].loop.insert(faces[1].loop.begin(), {v, 0});
        }
        if (corners.size() < 3) faces.clear();
    } else {
        const Faces merged(points, std::move(Quickhull(points, start).triangles));
        faces = merged.faces();
        corners = merged.corners();
    }
    assert(holds_all(points, faces));
    finish(data, given, points, faces, corners);
}

void build(HullData<2>& data, const std::vector<Vec2>& given, double epsilon)
{
    const PointSet points(given, epsilon);
    std::vector<char> kept(given.size(), 0);
    const std::vector<Index> loop = planar_hull(points, 0, 1);
    keep_corners(points, loop, kept);
    std::vector<Index> number(given.size(), none);
    for (Index i = 0; i < given.size(); ++i)
        if (kept[i] != 0) {
            number[i] = static_cast<Index>(data.corners.size());
            data.corners.push_back({given[i].x, given[i].y});
            data.reach = std::max(data.reach, length(given[i]));
        }
    for (const Index i : loop)
        if (kept[i] != 0) {
            data.loop.push_back(given[i]);
            data.corner.push_back(number[i]);
        }
}

} // namespace
} // namespace narrow

template <int Dim>
template <Coordinate T>
ConvexHull<Dim>::ConvexHull(std::span<const Vec<Dim, T>> points)
{
    if (points.empty())
        throw Error(ErrorCode::invalid_argument, "a convex hull of no points; give at least one");
    const ExactFloats exact;
    std::vector<narrow::V<Dim>> all;
    all.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (const T x : points[i])
            if (!(std::abs(double{x}) <= narrow::longest))
                throw Error(ErrorCode::nan_coordinate,
                            "point " + std::to_string(i) + " of a convex hull has the coordinate " +
                                narrow::text(double{x}) + "; give ones within 1e60",
                            i);
        all.push_back(narrow::load(points[i]));
    }
    auto data = std::make_shared<narrow::HullData<Dim>>();
    narrow::build(*data, all, double{std::numeric_limits<T>::epsilon()});
    data_ = std::move(data);
}

template <int Dim>
std::span<const Vec<Dim, double>> ConvexHull<Dim>::vertices() const noexcept
{
    return data_->corners;
}
template <>
std::size_t ConvexHull<3>::face_count() const noexcept
{
    return data_->polytope.faces;
}
template <>
std::size_t ConvexHull<2>::face_count() const noexcept
{
    return data_->loop.size() > 1 ? data_->loop.size() : 0;
}

template <int Dim>
std::span<const std::uint32_t> ConvexHull<Dim>::face(std::size_t i) const noexcept
    requires(Dim == 3)
{
    const narrow::Polytope& hull = data_->polytope;
    return {hull.loop + hull.loop_begin[i], hull.loop + hull.loop_begin[i + 1]};
}

template <int Dim>
Shape<Dim>::Shape(const ConvexHull<Dim>& hull) noexcept
{
    const auto& data = narrow::ShapeAccess::data_of(hull);
    narrow::ShapeAccess::fill(*this, ShapeTypes::convex, data.reach, &data);
}

template class ConvexHull<2>;
template class ConvexHull<3>;
template JOSTLE_API ConvexHull<2>::ConvexHull(std::span<const Vec<2, float>>);
template JOSTLE_API ConvexHull<2>::ConvexHull(std::span<const Vec<2, double>>);
template JOSTLE_API ConvexHull<3>::ConvexHull(std::span<const Vec<3, float>>);
template JOSTLE_API ConvexHull<3>::ConvexHull(std::span<const Vec<3, double>>);
template JOSTLE_API Shape<2>::Shape(const ConvexHull<2>&) noexcept;
template JOSTLE_API Shape<3>::Shape(const ConvexHull<3>&) noexcept;

JOSTLE_NAMESPACE_END
