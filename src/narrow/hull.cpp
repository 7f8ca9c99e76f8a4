// SPDX-License-Identifier: MIT
// Convex hulls. Source: Barber, Dobkin, Huhdanpaa, The Quickhull Algorithm for Convex Hulls, ACM TOMS 22(4),
// 1996; in the plane Andrew's monotone chain (1979).
#include <algorithm>
#include <limits>
#include <string>

#include "narrow/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

using Index = std::uint32_t;
constexpr Index none = ~Index{0};

/// Counterclockwise corners of points in the plane; what is within `slack` of a straight side is no corner.
std::vector<Index> planar_hull(const std::vector<Vec2>& points, double slack)
{
    std::vector<Index> order(points.size());
    for (Index i = 0; i < order.size(); ++i)
        order[i] = i;
    std::sort(order.begin(), order.end(), [&](Index i, Index j) {
        const Vec2 &p = points[i], &q = points[j];
        return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : i < j;
    });
    const auto chain = [&](std::vector<Index> path) {
        std::vector<Index> hull;
        for (const Index i : path) {
            if (!hull.empty() && length2(points[i] - points[hull.back()]) == 0) continue;
            while (hull.size() >= 2) {
                const Vec2 p = points[hull[hull.size() - 2]], q = points[hull.back()], side = points[i] - p;
                // q is left out where it isn't right of the line from p to i by more than the slack.
                if (-cross(side, q - p) > slack * length(side)) break;
                hull.pop_back();
            }
            hull.push_back(i);
        }
        return hull;
    };
    std::vector<Index> lower = chain(order);
    std::reverse(order.begin(), order.end());
    const std::vector<Index> upper = chain(order);
    if (lower.size() > 1) lower.pop_back();
    for (std::size_t k = 0; k + 1 < upper.size(); ++k)
        lower.push_back(upper[k]);
    // Both chains of points in one place, or of a line, may end in the same one.
    std::vector<Index> hull;
    for (const Index i : lower)
        if (hull.empty() ||
            (length2(points[i] - points[hull.back()]) > 0 && length2(points[i] - points[hull.front()]) > 0))
            hull.push_back(i);
    return hull;
}

struct Triangle
{
    Index v[3];
    Index neighbour[3]; ///< across the side from v[i] to v[i + 1]
    Vec3 normal;
    double offset;
    std::vector<Index> outside;
    bool alive = true;
    Index mark = none;
};

class Quickhull
{
  public:
    Quickhull(const std::vector<Vec3>& points, const Index (&start)[4], double slack)
        : points_(points), slack_(slack)
    {
        Index s[4] = {start[0], start[1], start[2], start[3]};
        if (dot(cross(points[s[1]] - points[s[0]], points[s[2]] - points[s[0]]),
                points[s[3]] - points[s[0]]) > 0)
            std::swap(s[1], s[2]); // now s[3] is below the triangle s[0] s[1] s[2]
        add(s[0], s[1], s[2]);
        add(s[0], s[3], s[1]);
        add(s[1], s[3], s[2]);
        add(s[2], s[3], s[0]);
        for (Index i = 0; i < 4; ++i)
            for (Index j = 0; j < 4; ++j)
                if (i != j) join(i, j);
        std::vector<Index> all;
        for (Index i = 0; i < points.size(); ++i)
            if (i != s[0] && i != s[1] && i != s[2] && i != s[3]) all.push_back(i);
        share_out(all, 0);
        for (Index f = 0; f < triangles.size(); ++f)
            while (triangles[f].alive && !triangles[f].outside.empty())
                grow(f);
    }
    std::vector<Triangle> triangles;

  private:
    [[nodiscard]] double above(const Triangle& t, Index p) const
    {
        return dot(t.normal, points_[p]) - t.offset;
    }

    Index add(Index a, Index b, Index c)
    {
        Triangle t{}; // all of it: sanitizer builds of g++ 12 see a part that would be left open
        t.v[0] = a, t.v[1] = b, t.v[2] = c;
        const Vec3 n = cross(points_[b] - points_[a], points_[c] - points_[a]);
        const double size = length(n);
        t.normal = size > 0 ? n * (1 / size) : n;
        t.offset = dot(t.normal, (points_[a] + points_[b] + points_[c]) * (1.0 / 3));
        triangles.push_back(std::move(t));
        return static_cast<Index>(triangles.size() - 1);
    }
    void join(Index f, Index g)
    {
        for (Index i = 0; i < 3; ++i)
            for (Index j = 0; j < 3; ++j)
                if (triangles[f].v[i] == triangles[g].v[(j + 1) % 3] &&
                    triangles[f].v[(i + 1) % 3] == triangles[g].v[j]) {
                    triangles[f].neighbour[i] = g;
                    triangles[g].neighbour[j] = f;
                }
    }
    void share_out(const std::vector<Index>& points, std::size_t first)
    {
        for (const Index p : points) {
            double most = slack_;
            Index best = none;
            for (std::size_t f = first; f < triangles.size(); ++f)
                if (const double h = above(triangles[f], p); triangles[f].alive && h > most)
                    most = h, best = static_cast<Index>(f);
            if (best != none) triangles[best].outside.push_back(p);
        }
    }
    void grow(Index from)
    {
        const Triangle& base = triangles[from];
        Index apex = base.outside[0];
        for (const Index p : base.outside)
            if (above(base, p) > above(base, apex)) apex = p;
        // What sees the apex, found from neighbour to neighbour so that it is one patch.
        struct Side
        {
            Index a, b, beyond;
        };
        std::vector<Index> patch{from};
        std::vector<Side> horizon;
        const Index round = ++round_;
        triangles[from].mark = round;
        for (std::size_t k = 0; k < patch.size(); ++k)
            for (Index i = 0; i < 3; ++i) {
                const Index g = triangles[patch[k]].neighbour[i];
                if (triangles[g].mark == round) continue;
                if (above(triangles[g], apex) > slack_) {
                    triangles[g].mark = round;
                    patch.push_back(g);
                }
            }
        std::vector<Index> orphans;
        for (const Index f : patch) {
            Triangle& t = triangles[f];
            for (Index i = 0; i < 3; ++i)
                if (triangles[t.neighbour[i]].mark != round)
                    horizon.push_back({t.v[i], t.v[(i + 1) % 3], t.neighbour[i]});
            for (const Index p : t.outside)
                if (p != apex) orphans.push_back(p);
            t.outside.clear();
            t.alive = false;
        }
        const std::size_t first = triangles.size();
        for (const Side& side : horizon) {
            const Index f = add(side.a, side.b, apex);
            triangles[f].neighbour[0] = side.beyond;
            for (Index i = 0; i < 3; ++i)
                if (triangles[side.beyond].v[i] == side.b && triangles[side.beyond].v[(i + 1) % 3] == side.a)
                    triangles[side.beyond].neighbour[i] = f;
        }
        for (std::size_t f = first; f < triangles.size(); ++f)
            for (std::size_t g = first; g < triangles.size(); ++g)
                if (triangles[f].v[1] == triangles[g].v[0]) {
                    triangles[f].neighbour[1] = static_cast<Index>(g);
                    triangles[g].neighbour[2] = static_cast<Index>(f);
                }
        share_out(orphans, first);
    }

    const std::vector<Vec3>& points_;
    double slack_;
    Index round_ = 0;
};

struct Face
{
    Vec3 normal;
    std::vector<Index> loop; // of points
};

/// Triangles in one plane, as near as the points' own type can say, become one face.
std::vector<Face> merged(const std::vector<Triangle>& triangles, const std::vector<Vec3>& points,
                         double slack)
{
    std::vector<Index> order;
    std::vector<double> area(triangles.size(), 0);
    for (Index f = 0; f < triangles.size(); ++f) {
        if (!triangles[f].alive) continue;
        order.push_back(f);
        const Index* v = triangles[f].v;
        area[f] = length2(cross(points[v[1]] - points[v[0]], points[v[2]] - points[v[0]]));
    }
    std::sort(order.begin(), order.end(),
              [&](Index f, Index g) { return area[f] != area[g] ? area[f] > area[g] : f < g; });
    std::vector<Index> group(triangles.size(), none);
    Index groups = 0;
    for (const Index seed : order) {
        if (group[seed] != none) continue;
        const Triangle& base = triangles[seed];
        std::vector<Index> patch{seed};
        group[seed] = groups;
        for (std::size_t k = 0; k < patch.size(); ++k)
            for (const Index g : triangles[patch[k]].neighbour) {
                if (group[g] != none) continue;
                bool flat = dot(triangles[g].normal, base.normal) > 0 || area[g] == 0;
                for (const Index v : triangles[g].v)
                    flat = flat && std::abs(dot(base.normal, points[v]) - base.offset) <= slack;
                if (!flat) continue;
                group[g] = groups;
                patch.push_back(g);
            }
        ++groups;
    }
    // Corners are where three faces or more meet.
    std::vector<std::vector<Index>> around(points.size());
    for (const Index f : order)
        for (const Index v : triangles[f].v)
            if (std::find(around[v].begin(), around[v].end(), group[f]) == around[v].end())
                around[v].push_back(group[f]);
    std::vector<Face> faces(groups);
    for (const Index f : order) {
        Face& face = faces[group[f]];
        if (!face.loop.empty() || group[f] == none) continue;
        // Walk along the border of the patch.
        for (Index i = 0; i < 3 && face.loop.empty(); ++i) {
            if (group[triangles[f].neighbour[i]] == group[f]) continue;
            Index t = f, side = i;
            const Index begin = triangles[f].v[i];
            std::size_t steps = 0;
            do {
                const Index v = triangles[t].v[side];
                if (around[v].size() >= 3) face.loop.push_back(v);
                const Index corner = triangles[t].v[(side + 1) % 3];
                side = (side + 1) % 3;
                while (group[triangles[t].neighbour[side]] == group[f]) {
                    const Index next = triangles[t].neighbour[side];
                    for (Index k = 0; k < 3; ++k)
                        if (triangles[next].v[k] == corner) side = k;
                    t = next;
                }
            } while (triangles[t].v[side] != begin && ++steps < 3 * triangles.size());
        }
        Vec3 newell;
        for (std::size_t k = 0; k < face.loop.size(); ++k)
            newell += cross(points[face.loop[k]] - points[face.loop[0]],
                            points[face.loop[(k + 1) % face.loop.size()]] - points[face.loop[0]]);
        const double size = length(newell);
        if (size > 0) face.normal = newell * (1 / size);
    }
    faces.erase(
        std::remove_if(faces.begin(), faces.end(),
                       [](const Face& face) { return face.loop.size() < 3 || length2(face.normal) == 0; }),
        faces.end());
    return faces;
}

void add_direction(std::vector<Vec3>& directions, const Vec3& d)
{
    const double size = length(d);
    if (!(size > 0)) return;
    const Vec3 unit = d * (1 / size);
    for (const Vec3& known : directions)
        if (length2(cross(known, unit)) < 1e-20) return;
    directions.push_back(unit);
}

void finish(HullData<3>& data, const std::vector<Vec3>& points, const std::vector<Face>& faces,
            std::vector<Index> lone)
{
    // Corners in the order given.
    std::vector<Index> number(points.size(), none);
    for (const Face& face : faces)
        for (const Index v : face.loop)
            number[v] = 0;
    for (const Index v : lone)
        number[v] = 0;
    for (Index i = 0; i < points.size(); ++i)
        if (number[i] == 0) {
            number[i] = static_cast<Index>(data.corners.size());
            data.corners.push_back({points[i].x, points[i].y, points[i].z});
            data.reach = std::max(data.reach, length(points[i]));
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
    bool closed = face_count > 2;
    std::size_t joined = 0; // edges that have their other face
    for (Index f = 0; f < face_count; ++f) {
        const Face& face = faces[f];
        for (std::size_t k = 0; k < face.loop.size(); ++k) {
            const Index v = number[face.loop[k]], w = number[face.loop[(k + 1) % face.loop.size()]];
            data.loop.push_back(v);
            const auto known = std::find_if(data.edge.begin(), data.edge.end(), [&](const Edge& e) {
                return (e.v[0] == v && e.v[1] == w) || (e.v[0] == w && e.v[1] == v);
            });
            if (known == data.edge.end()) {
                data.edge.push_back({{v, w}, {f, f}});
                add_direction(data.direction,
                              points[face.loop[(k + 1) % face.loop.size()]] - points[face.loop[k]]);
            } else {
                closed = closed && known->v[0] == w && known->face[1] == known->face[0];
                known->face[1] = f;
                ++joined;
            }
        }
        data.loop_begin.push_back(static_cast<Index>(data.loop.size()));
    }
    if (closed && joined == data.edge.size())
        for (Index f = 0; f < face_stride; ++f) {
            const Vec3 n = faces[f < face_count ? f : 0].normal;
            double offset = -HUGE_VAL;
            for (const auto& corner : data.corners)
                offset = std::max(offset, dot(n, load(corner)));
            data.offsets.push_back(offset);
        }
    if (faces.empty() && count == 2) {
        data.edge.push_back({{0, 1}, {0, 0}});
        add_direction(data.direction, load(data.corners[1]) - load(data.corners[0]));
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

void build(HullData<3>& data, const std::vector<Vec3>& points, double epsilon)
{
    // The farthest in turn: from each other, from their line, from their plane.
    Vec3 lo = points[0], hi = points[0];
    double size = 0;
    for (const Vec3& p : points)
        for (int d = 0; d < 3; ++d) {
            lo[d] = std::min(lo[d], p[d]);
            hi[d] = std::max(hi[d], p[d]);
            size = std::max(size, std::abs(p[d]));
        }
    const double slack = 8 * epsilon * size;
    const auto furthest = [&](auto&& measure) {
        Index best = 0;
        double most = -1;
        for (Index i = 0; i < points.size(); ++i)
            if (const double m = measure(points[i]); m > most) most = m, best = i;
        return best;
    };
    const Vec3 span = hi - lo;
    const int axis = span.x >= span.y ? (span.x >= span.z ? 0 : 2) : (span.y >= span.z ? 1 : 2);
    Index start[4];
    start[0] = furthest([&](const Vec3& p) { return hi[axis] - p[axis]; });
    const Vec3 p0 = points[start[0]];
    start[1] = furthest([&](const Vec3& p) { return length(p - p0); });
    const double long_side = length(points[start[1]] - p0);
    if (long_side <= slack) return finish(data, points, {}, {start[0]});
    const Vec3 line = (points[start[1]] - p0) * (1 / long_side);
    const auto off_line = [&](const Vec3& p) { return length(cross(p - p0, line)); };
    start[2] = furthest(off_line);
    if (off_line(points[start[2]]) <= slack) {
        // The other end is the farthest along the line, which needn't be the farthest found first.
        const Index low = furthest([&](const Vec3& p) { return -dot(p - p0, line) + long_side; });
        return finish(data, points, {}, {low, start[1]});
    }
    Vec3 n = cross(line, points[start[2]] - p0);
    n = n * (1 / length(n));
    start[3] = furthest([&](const Vec3& p) { return std::abs(dot(p - p0, n)); });
    if (std::abs(dot(points[start[3]] - p0, n)) <= slack) {
        const Vec3 across = cross(n, line);
        std::vector<Vec2> flat;
        for (const Vec3& p : points)
            flat.push_back({dot(p - p0, line), dot(p - p0, across)});
        Face front{n, planar_hull(flat, slack)}, back{-n, {}};
        back.loop.assign(front.loop.rbegin(), front.loop.rend());
        return finish(data, points, {front, back}, {});
    }
    const Quickhull hull(points, start, 64 * std::numeric_limits<double>::epsilon() * size);
    finish(data, points, merged(hull.triangles, points, slack), {});
}

void build(HullData<2>& data, const std::vector<Vec2>& points, double epsilon)
{
    double size = 0;
    for (const Vec2& p : points)
        size = std::max(size, std::max(std::abs(p.x), std::abs(p.y)));
    const std::vector<Index> loop = planar_hull(points, 8 * epsilon * size);
    std::vector<Index> number(points.size(), none);
    for (const Index i : loop)
        number[i] = 0;
    for (Index i = 0; i < points.size(); ++i)
        if (number[i] == 0) {
            number[i] = static_cast<Index>(data.corners.size());
            data.corners.push_back({points[i].x, points[i].y});
            data.reach = std::max(data.reach, length(points[i]));
        }
    for (const Index i : loop) {
        data.loop.push_back(points[i]);
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
