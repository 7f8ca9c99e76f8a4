// SPDX-License-Identifier: MIT
// The overlap of two polyhedra of a few dozen corners, by separating axes, most of which needn't be tested.
#include <cstring>

#include "narrow/convex/axes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

constexpr std::uint32_t most_pairs = 12'000; // of edges; for more, the expanding polytope is faster

/// One of two polyhedra: points and normals in a's local axes for edges; planes and the other's points in its
/// own axes for faces.
struct Polyhedron
{
    const Polytope* hull;
    const Kernels* kernels;
    const double *x, *nx;  ///< in a's axes; strides are the hull's
    const double* other_x; ///< the other's, in this one's
    std::uint32_t other_stride;
    PlaneRows planes;
    EdgeRows edges;
    double height[PlaneRows::most];

    [[nodiscard]] Vec3 corner(std::uint32_t i) const
    {
        return {x[i], x[hull->stride + i], x[2 * hull->stride + i]};
    }
    [[nodiscard]] Vec3 normal(std::uint32_t f) const
    {
        return {nx[f], nx[hull->face_stride + f], nx[2 * hull->face_stride + f]};
    }
    /// Its extent along n.
    [[nodiscard]] double top(const Vec3& n) const
    {
        return dot(n, corner(kernels->furthest(x, hull->stride, n.x, n.y, n.z)));
    }
    /// How deep the other one is below a face.
    [[nodiscard]] double depth(std::uint32_t f) const
    {
        const Vec3 n = hull->normal(f);
        const std::uint32_t i = kernels->furthest(other_x, other_stride, -n.x, -n.y, -n.z);
        return hull->offset[f] -
               dot(n, {other_x[i], other_x[other_stride + i], other_x[2 * other_stride + i]});
    }

    /// The heights of the other's corners along n, in its own axes; returns the least.
    double look_along(const Vec3& n)
    {
        return kernels->heights(other_x, other_stride, n.x, n.y, n.z, height);
    }
    /// Tests all faces against the other's corners no higher than `limit`. Returns the face with the least
    /// lower bound of the depth.
    std::uint32_t look_at_faces(std::uint32_t corners, double limit, double enough)
    {
        const double *const px = other_x, *const py = px + other_stride, *const pz = py + other_stride;
        std::uint32_t count = 0;
        for (std::uint32_t i = 0; i < corners && count < PlaneRows::most_points; ++i) {
            planes.point[0][count] = px[i];
            planes.point[1][count] = py[i];
            planes.point[2][count] = pz[i];
            count += height[i] <= limit ? 1 : 0;
        }
        planes.count = count;
        return kernels->planes(hull->nx, hull->offset, hull->face_stride, enough, planes);
    }

    /// Takes the edges that may separate the two better than `enough`: not those with a corner of the other
    /// deeper than that below both their faces, since it is as deep below any plane between these.
    void take_edges()
    {
        const auto put = [](double(&rows)[3][EdgeRows::most], std::uint32_t i, const Vec3& v) {
            rows[0][i] = v.x;
            rows[1][i] = v.y;
            rows[2][i] = v.z;
        };
        const auto deeper = [this](std::uint32_t face) {
            std::uint64_t bits;
            std::memcpy(&bits, &planes.deeper[face], sizeof bits);
            return bits << 12; // without exponent
        };
        // Which ones is hard to predict, so they are found without branches.
        std::uint32_t found[EdgeRows::most], count = 0;
        for (std::uint32_t e = 0; e < hull->edges; ++e) {
            found[count] = e;
            count += (deeper(hull->edge[e].face[0]) & deeper(hull->edge[e].face[1])) == 0 ? 1 : 0;
        }
        for (std::uint32_t i = 0; i < count; ++i) {
            const Edge& edge = hull->edge[found[i]];
            const Vec3 begin = corner(edge.v[0]);
            put(edges.begin, i, begin);
            put(edges.along, i, corner(edge.v[1]) - begin);
            put(edges.normal_0, i, normal(edge.face[0]));
            put(edges.normal_1, i, normal(edge.face[1]));
        }
        edges.count = count;
        for (; count % lanes != 0; ++count)
            for (auto* row : {&edges.begin, &edges.along, &edges.normal_0, &edges.normal_1})
                put(*row, count, {});
    }
};

bool is_small(const Core3& core)
{
    return !core.is_smooth() && core.polytope.offset != nullptr && core.polytope.edges <= EdgeRows::most;
}

} // namespace

bool are_small_polyhedra(const Core3& a, const Core3& b)
{
    return is_small(a) && is_small(b);
}

bool polyhedra_gap(const Core3& a, const Core3& b, double enough_apart, Gap<3>& gap)
{
    const Polytope &hull_a = a.polytope, &hull_b = b.polytope;
    const Kernels& kernels = *a.kernels;
    const Mat3 turn{a.frame.r.back(b.frame.r.x), a.frame.r.back(b.frame.r.y), a.frame.r.back(b.frame.r.z)};
    const Mat3 back{
        {turn.x.x, turn.y.x, turn.z.x}, {turn.x.y, turn.y.y, turn.z.y}, {turn.x.z, turn.y.z, turn.z.z}};
    const Vec3 shift = a.frame.r.back(b.frame.p - a.frame.p);
    double b_corners[3 * PlaneRows::most], a_corners[3 * PlaneRows::most], b_normals[3 * PlaneRows::most];
    kernels.move(hull_b.x, hull_b.stride, turn, shift, b_corners);
    kernels.move(hull_a.x, hull_a.stride, back, -(back * shift), a_corners);
    kernels.move(hull_b.nx, hull_b.face_stride, turn, {}, b_normals);
    Polyhedron side_a, side_b;
    side_a.hull = &hull_a;
    side_a.kernels = &kernels;
    side_a.x = hull_a.x;
    side_a.nx = hull_a.nx;
    side_a.other_x = b_corners;
    side_a.other_stride = hull_b.stride;
    side_b.hull = &hull_b;
    side_b.kernels = &kernels;
    side_b.x = b_corners;
    side_b.nx = b_normals;
    side_b.other_x = a_corners;
    side_b.other_stride = hull_a.stride;

    const Vec3 guess = a.frame.r.back(gap.normal);
    const double size = a.reach + b.reach, rounding = 1e-9 * size;
    const double low_b = side_a.look_along(guess), low_a = side_b.look_along(-(back * guess));
    // Heights of a's corners are measured from b's position, and downwards.
    const double enough = std::max(0.0, dot(guess, shift) - low_a - low_b) + rounding;
    const double band = 2 * enough + 0.1 * std::min(a.reach, b.reach);
    const std::uint32_t first_a = side_a.look_at_faces(hull_b.vertices, low_b + band, enough);
    const std::uint32_t first_b = side_b.look_at_faces(hull_a.vertices, low_a + band, enough);

    // Faces: the most promising one, then those that may be better.
    double depth = side_a.depth(first_a);
    Vec3 n = hull_a.normal(first_a);
    for (std::uint32_t f = 0; f < hull_a.faces; ++f)
        if (side_a.planes.depth[f] < depth && f != first_a)
            if (const double d = side_a.depth(f); d < depth) {
                depth = d;
                n = hull_a.normal(f);
            }
    if (side_b.planes.depth[first_b] < depth)
        if (const double d = side_b.depth(first_b); d < depth) {
            depth = d;
            n = -side_b.normal(first_b);
        }
    for (std::uint32_t f = 0; f < hull_b.faces; ++f)
        if (side_b.planes.depth[f] < depth && f != first_b)
            if (const double d = side_b.depth(f); d < depth) {
                depth = d;
                n = -side_b.normal(f);
            }

    gap.normal = a.frame.r * n;
    gap.distance = -depth;
    if (gap.distance > enough_apart) return true;

    side_a.take_edges();
    side_b.take_edges();
    if (side_a.edges.count * side_b.edges.count > most_pairs) return false;
    const EdgePair edges = kernels.edges(side_a.edges, side_b.edges);
    // Edges have to be better by more than rounding, or parallel faces would meet along noise.
    if (-edges.separation < depth - 1e-10 * size) {
        const auto row = [](const double(&rows)[3][EdgeRows::most], std::uint32_t i) {
            return Vec3{rows[0][i], rows[1][i], rows[2][i]};
        };
        const Vec3 along_b = row(side_b.edges.along, edges.b);
        n = cross(row(side_a.edges.along, edges.a), along_b);
        const bool outwards = dot(row(side_a.edges.normal_0, edges.a), along_b) > 0;
        n = n * ((outwards ? 1 : -1) / length(n));
        depth = side_a.top(n) + side_b.top(-n);
        if (depth > -edges.separation + rounding) return false; // arcs that cross only by rounding
        gap.normal = a.frame.r * n;
        gap.distance = -depth;
    }
    gap.on_a = gap.on_b = {};
    return true;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
