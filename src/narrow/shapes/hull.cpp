// SPDX-License-Identifier: MIT
// Convex hulls: first the exact hull; then parts that are flat or straight up to the points' rounding are
// made so. See decision 010.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>

#include "base/exact_floats.hpp"
#include "narrow/shapes/hull_faces.hpp"
#include "narrow/shapes/hull_points.hpp"
#include "narrow/shapes/orientation.hpp"
#include "narrow/shapes/quickhull.hpp"
#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow::hull {

namespace {

/// The directions of edges, each once in either sense: an edge is skipped if it is within 1e-10 of an earlier
/// one.
class Directions
{
  public:
    explicit Directions(std::vector<Vec3>& found) : found_(found) {}

    void add(const Vec3& d)
    {
        const double size = length(d);
        if (!(size > 0)) return;
        const Vec3 unit = d * (1 / size);
        if (found_.size() < compared_with_all ? is_known(unit) : is_known_nearby(unit)) return;
        found_.push_back(unit);
        if (found_.size() == compared_with_all)
            for (std::uint32_t k = 0; k < compared_with_all; ++k)
                by_place_.emplace(place_of(cell_of(found_[k])), k);
        else if (found_.size() > compared_with_all)
            by_place_.emplace(place_of(cell_of(unit)), static_cast<std::uint32_t>(found_.size() - 1));
    }

  private:
    // Hulls mostly have a few dozen directions; with 20,000 corners, comparing each with all would take
    // seconds.
    static constexpr std::size_t compared_with_all = 256;
    static constexpr std::int64_t cells = 1024; // per unit of length, each far wider than 1e-10
    struct Cell
    {
        std::int64_t at[3];
    };

    static bool same(const Vec3& a, const Vec3& b) { return length2(cross(a, b)) < 1e-20; }
    [[nodiscard]] bool is_known(const Vec3& unit) const
    {
        return std::any_of(found_.begin(), found_.end(),
                           [&](const Vec3& known) { return same(known, unit); });
    }
    static Cell cell_of(const Vec3& unit)
    {
        Cell cell{};
        for (int d = 0; d < 3; ++d)
            cell.at[d] = static_cast<std::int64_t>(std::floor(unit[d] * static_cast<double>(cells)));
        return cell;
    }
    static std::uint64_t place_of(const Cell& cell)
    {
        std::uint64_t place = 0; // 21 bits each
        for (const std::int64_t at : cell.at)
            place = place << 21 | static_cast<std::uint64_t>(at + 2 * cells);
        return place;
    }
    /// Searches the cells around it, and around its opposite.
    [[nodiscard]] bool is_known_nearby(const Vec3& unit) const
    {
        for (const double way : {1.0, -1.0}) {
            const Cell cell = cell_of(unit * way);
            for (int k = 0; k < 27; ++k) {
                const auto [first, last] = by_place_.equal_range(
                    place_of({{cell.at[0] + k % 3 - 1, cell.at[1] + k / 3 % 3 - 1, cell.at[2] + k / 9 - 1}}));
                for (auto each = first; each != last; ++each)
                    if (same(found_[each->second], unit)) return true;
            }
        }
        return false;
    }

    std::vector<Vec3>& found_;
    std::unordered_multimap<std::uint64_t, std::uint32_t> by_place_;
};

/// No given point is further outside than this times the slack: the inner points of a patch may be a slack
/// away from what its border spans, and that from the straightened border; plus rounding in each step.
constexpr double slacks_outside = 5;

/// The corners next to each, across its edges.
class Neighbours
{
  public:
    Neighbours(const std::vector<Edge>& edges, std::size_t corners) : begin_(corners + 1, 0)
    {
        for (const Edge& edge : edges)
            for (const Index v : edge.v)
                ++begin_[v];
        for (std::size_t v = 1; v <= corners; ++v)
            begin_[v] += begin_[v - 1];
        at_.resize(2 * edges.size());
        for (const Edge& edge : edges)
            for (const int i : {0, 1})
                at_[--begin_[edge.v[i]]] = edge.v[1 - i];
    }
    [[nodiscard]] std::span<const Index> of(Index v) const
    {
        return {at_.data() + begin_[v], at_.data() + begin_[v + 1]};
    }

  private:
    std::vector<Index> begin_, at_;
};

/// Faces whose normals differ by less than this can't be told apart when searching for the one that faces a
/// direction.
constexpr double alike = 1e-7;

/// Finds the offset of each face along its normal, and its outline: the convex hull of all corners in its
/// plane, within the tolerance of faces, and of those of similar faces.
void find_outlines(HullData<3>& data, const PointSet& points, const std::vector<Index>& given_as)
{
    const Neighbours neighbours(data.edge, data.corners.size());
    std::vector<Index> seen(data.corners.size(), none), number(points.size(), none), corners;
    for (Index v = 0; v < given_as.size(); ++v)
        number[given_as[v]] = v;
    data.outline_begin.push_back(0);
    for (Index f = 0; f + 1 < data.loop_begin.size(); ++f) {
        corners.assign(data.loop.begin() + data.loop_begin[f], data.loop.begin() + data.loop_begin[f + 1]);
        const Vec3 n = data.polytope.normal(f), on = points[given_as[corners[0]]];
        const auto height = [&](Index v) { return dot(n, points[given_as[v]] - on); };
        double top = 0;
        for (const Index v : corners) {
            seen[v] = f;
            top = std::max(top, height(v));
        }
        const auto is_level = [&](Index v) {
            const Vec3 away = points[given_as[v]] - on;
            const double down = top - height(v) - slacks_outside * points.slack;
            return down <= 0 || down * down <= alike * alike * length2(away);
        };
        // On a polyhedron edges lead up from each corner to a highest one, so all equally high ones are
        // found.
        const std::size_t own = corners.size();
        for (std::size_t k = 0; k < corners.size(); ++k)
            for (const Index v : neighbours.of(corners[k]))
                if (seen[v] != f && is_level(v)) {
                    seen[v] = f;
                    corners.push_back(v);
                }
        double most = -HUGE_VAL;
        for (const Index v : corners)
            most = std::max(most, dot(n, data.polytope.vertex(v)));
        data.offsets.push_back(most);
        if (corners.size() > own) {
            for (Index& v : corners)
                v = given_as[v];
            corners = plane_hull(points, n, std::move(corners));
            for (Index& v : corners)
                v = number[v];
        }
        data.outline.insert(data.outline.end(), corners.begin(), corners.end());
        data.outline_begin.push_back(static_cast<Index>(data.outline.size()));
    }
}

/// Corners in the order given; of points in a line or at one place, which have no faces, those that are
/// `kept`.
void finish(HullData<3>& data, const std::vector<Vec3>& given, const PointSet& points,
            const std::vector<Face>& faces, const std::vector<Index>& kept)
{
    std::vector<Index> number(given.size(), none);
    for (const Face& face : faces)
        for (const Side& side : face.loop)
            number[side.v] = 0;
    if (faces.empty())
        for (const Index v : kept)
            number[v] = 0;
    std::vector<Index> given_as;
    for (Index i = 0; i < given.size(); ++i)
        if (number[i] == 0) {
            number[i] = static_cast<Index>(data.corners.size());
            given_as.push_back(i);
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
    Directions directions(data.direction);
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
            directions.add(points[w] - points[v]);
        }
        data.loop_begin.push_back(static_cast<Index>(data.loop.size()));
    }
    if (faces.empty() && count == 2) {
        data.edge.push_back({{0, 1}, {0, 0}});
        directions.add(points[kept[1]] - points[kept[0]]);
    }
    Polytope& p = data.polytope;
    p.vertices = count;
    p.faces = face_count;
    p.edges = static_cast<Index>(data.edge.size());
    p.directions = static_cast<Index>(data.direction.size());
    p.x = data.coordinates.data();
    p.stride = stride;
    for (Index i = 0; i < count; ++i)
        p.middle += p.vertex(i);
    p.middle = p.middle * (1.0 / count);
    p.nx = data.normals.data();
    p.face_stride = face_stride;
    p.edge = data.edge.data();
    p.direction = data.direction.data();
    for (const Edge& edge : data.edge)
        data.sharp =
            data.sharp || (face_count > 0 && dot(p.normal(edge.face[0]), p.normal(edge.face[1])) < -0.99);
    find_outlines(data, points, given_as);
    data.offsets.resize(face_count > 0 ? face_stride : 0, face_count > 0 ? data.offsets[0] : 0);
    p.offset = face_count > 2 ? data.offsets.data() : nullptr;
    p.outline_begin = data.outline_begin.data();
    p.outline = data.outline.data();
}

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
    // The lowest and the highest, the point furthest from their line, and the one furthest from the plane of
    // all three. Rounding may choose another point, which is good enough.
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
    // Within the slack a hull counts as flat or straight: otherwise its sides would be noise, and some would
    // count as faces.
    const auto off_plane = [&](Index i) {
        return std::abs(dot(points[i] - a, n)) > points.slack * length(n) &&
               side_of_plane(a, b, c, points[i]) != 0;
    };
    start[3] = points.furthest([&](const Vec3& p) { return std::abs(dot(p - a, n)); });
    for (Index i = 0; i < points.size() && !off_plane(start[3]); ++i)
        start[3] = i;
    std::vector<Face> faces;
    std::vector<Index> corners;
    if (!off_plane(start[3])) {
        std::vector<char> kept(given.size(), 0);
        const std::vector<Index> loop = plane_hull(points, n, points.all());
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
        Merged merged = merge_triangles(points, quickhull(points, start));
        faces = std::move(merged.faces);
        corners = std::move(merged.corners);
    }
    assert(holds_all(points, faces));
    finish(data, given, points, faces, corners);
}

void build(HullData<2>& data, const std::vector<Vec2>& given, double epsilon)
{
    const PointSet points(given, epsilon);
    std::vector<char> kept(given.size(), 0);
    const std::vector<Index> loop = planar_hull(points, 0, 1, points.all());
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
    for (std::size_t i = 0; i < data.loop.size() && data.loop.size() > 1; ++i)
        data.normal.push_back(unit(right(data.loop[i + 1 == data.loop.size() ? 0 : i + 1] - data.loop[i])));
}

} // namespace
} // namespace narrow::hull

template <int Dim>
template <Coordinate T>
void ConvexHull<Dim>::build(std::span<const Vec<Dim, T>> points)
{
    if (points.empty())
        throw Error(ErrorCode::invalid_argument, "a convex hull without points; give at least one");
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
    narrow::hull::build(*data, all, double{std::numeric_limits<T>::epsilon()});
    data_ = std::move(data);
}

template <int Dim>
std::span<const Vec<Dim, double>> ConvexHull<Dim>::vertices() const noexcept
{
    return data_->corners;
}
template <int Dim>
std::size_t ConvexHull<Dim>::face_count() const noexcept
{
    if constexpr (Dim == 3)
        return data_->polytope.faces;
    else
        return data_->loop.size() > 1 ? data_->loop.size() : 0;
}

template <int Dim>
std::span<const std::uint32_t> ConvexHull<Dim>::face(std::size_t i) const noexcept
    requires(Dim == 3)
{
    if constexpr (Dim == 3) { // clang 14 compiles it for the others, too
        return {data_->loop.data() + data_->loop_begin[i], data_->loop.data() + data_->loop_begin[i + 1]};
    } else {
        return {};
    }
}

template <int Dim>
Shape<Dim>::Shape(const ConvexHull<Dim>& hull) noexcept
{
    const auto& data = narrow::ShapeAccess::data_of(hull);
    narrow::ShapeAccess::fill(*this, ShapeTypes::convex, data.reach, &data);
}
template <int Dim>
std::optional<ConvexHull<Dim>> Shape<Dim>::hull() const
{
    return narrow::ShapeAccess::value_of<ConvexHull<Dim>>(*this,
                                                          {ShapeTypes::convex, ShapeTypes::rounded_hull});
}

template class ConvexHull<2>;
template class ConvexHull<3>;
template JOSTLE_API void ConvexHull<2>::build(std::span<const Vec<2, float>>);
template JOSTLE_API void ConvexHull<2>::build(std::span<const Vec<2, double>>);
template JOSTLE_API void ConvexHull<3>::build(std::span<const Vec<3, float>>);
template JOSTLE_API void ConvexHull<3>::build(std::span<const Vec<3, double>>);
template JOSTLE_API Shape<2>::Shape(const ConvexHull<2>&) noexcept;
template JOSTLE_API Shape<3>::Shape(const ConvexHull<3>&) noexcept;
template JOSTLE_API std::optional<ConvexHull<2>> Shape<2>::hull() const;
template JOSTLE_API std::optional<ConvexHull<3>> Shape<3>::hull() const;

JOSTLE_NAMESPACE_END
