// SPDX-License-Identifier: MIT
// Inside and outside of closed meshes: the winding number by exact signed crossings of a ray.
#include "jostle/closed_mesh.hpp"

#include <algorithm>
#include <cmath>

#include "jostle/process.hpp"
#include "narrow/interface/answers.hpp"
#include "narrow/interface/input_checks.hpp"
#include "narrow/shapes/orientation.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace narrow {
namespace {

using Index = std::uint32_t;

/// A side of a triangle in its direction, and against it.
struct MeshEdge
{
    Index low, high, triangle;
    bool up; ///< from low to high
};

void check_closed(const MeshData<3>& mesh)
{
    std::vector<MeshEdge> sides;
    sides.reserve(3 * mesh.elements.size());
    for (Index e = 0; e < mesh.elements.size(); ++e)
        for (std::size_t i = 0; i < 3; ++i) {
            const Index from = mesh.elements[e][i], to = mesh.elements[e][(i + 1) % 3];
            if (from != to) sides.push_back({std::min(from, to), std::max(from, to), e, from < to});
        }
    std::sort(sides.begin(), sides.end(), [](const MeshEdge& a, const MeshEdge& b) {
        if (a.low != b.low) return a.low < b.low;
        return a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
    });
    const MeshEdge* open = nullptr;
    for (std::size_t k = 0, end = 0; k < sides.size(); k = end) {
        std::int64_t up = 0;
        for (end = k;
             end < sides.size() && sides[end].low == sides[k].low && sides[end].high == sides[k].high; ++end)
            up += sides[end].up ? 1 : -1;
        if (up != 0 && (open == nullptr || sides[k].triangle < open->triangle)) open = &sides[k];
    }
    if (open == nullptr) return;
    throw Error(ErrorCode::invalid_argument,
                "a mesh that isn't closed: the side of triangle " + std::to_string(open->triangle) +
                    " between the vertices " + std::to_string(open->low) + " and " +
                    std::to_string(open->high) +
                    " has no triangle beyond it that runs along it the other way; fill the hole, or turn "
                    "triangles so that all run the same way round",
                open->triangle);
}

template <class T>
void check_point(const Vec<3, T>& point, std::uint64_t number)
{
    for (const T x : point)
        if (!(std::abs(double{x}) <= longest))
            throw Error(ErrorCode::invalid_argument,
                        named("point", number) + " is" + listed(point) + "; give numbers within 1e60",
                        number);
}

/// The side of p with respect to the line from u to v in the plane of y and z, with p shifted by an
/// infinitesimal y and a far smaller z: 0 only if u and v coincide there.
int shifted_side(const Vec3& u, const Vec3& v, const Vec3& p)
{
    if (const int side = side_of_line({u.y, u.z}, {v.y, v.z}, {p.y, p.z}); side != 0) return side;
    if (v.z != u.z) return v.z < u.z ? 1 : -1;
    return v.y == u.y ? 0 : v.y > u.y ? 1 : -1;
}

} // namespace
} // namespace narrow

struct ClosedMesh::Data
{
    Mesh<3> mesh;                       // shares the memory of the given one
    std::vector<narrow::Vec3> vertices; // in the form for exact predicates
    int exponent = 0;                   // they were scaled by this power of two
    double grain = 0;                   // they are multiples of this, unscaled

    [[nodiscard]] const narrow::MeshData<3>& of() const { return narrow::ShapeAccess::data_of(mesh); }
    /// Below 2^59, multiples of 2^-201: parts far smaller than the mesh are rounded, for all points alike.
    [[nodiscard]] narrow::Vec3 scaled(const narrow::Vec3& p) const
    {
        constexpr double shift = 0x1.8p-149; // the last bit of numbers near it is 2^-201
        narrow::Vec3 q;
        for (int d = 0; d < 3; ++d) {
            const double x = std::ldexp(p[d], exponent);
            q[d] = std::abs(x) < 0x1p-150 ? (x + shift) - shift : x;
        }
        return q;
    }
    [[nodiscard]] int winding_number(const narrow::Vec3& point) const;
    template <class T>
    [[nodiscard]] narrow::Vec3 local(const Pose<3, T>& pose, const Vec<3, T>& point) const
    {
        return narrow::rotation(pose).back(narrow::load(point) - narrow::load(pose.position));
    }
    template <class T>
    [[nodiscard]] SignedDistance<T> signed_distance(const Pose<3, T>& pose, const Vec<3, T>& point) const
    {
        Pose<3, T> at;
        at.position = point;
        const Distance<3, T> found = narrow::distance_of(
            Shape<3>(), at, Shape<3>(mesh), pose, std::numeric_limits<T>::infinity(), narrow::best_kernels());
        const T distance = std::max(found.distance, T(0));
        const bool inside = distance > 0 && winding_number(local(pose, point)) != 0;
        return {inside ? -distance : distance, found.normal * (inside ? T(1) : T(-1)), found.from_b};
    }
    template <class T>
    [[nodiscard]] bool contains(const Pose<3, T>& pose, const Vec<3, T>& point) const
    {
        if (winding_number(local(pose, point)) != 0) return true;
        Pose<3, T> at; // on the surface
        at.position = point;
        return narrow::distance_of(Shape<3>(), at, Shape<3>(mesh), pose, T(0), narrow::best_kernels())
                   .distance <= 0;
    }
};

int ClosedMesh::Data::winding_number(const narrow::Vec3& point) const
{
    const narrow::MeshData<3>& data = of();
    const auto passes_by = [&](const narrow::TreeNode& node) {
        return point.y + 2 * grain < node.lo[1] || point.y - 2 * grain > node.hi[1] ||
               point.z + 2 * grain < node.lo[2] || point.z - 2 * grain > node.hi[2] ||
               point.x - 2 * grain > node.hi[0];
    };
    if (passes_by(data.nodes.front()) || point.x < data.nodes.front().lo[0]) return 0;
    const narrow::Vec3 p = scaled(point);
    int number = 0;
    for (std::uint32_t n = 0; n < data.nodes.size();) {
        const narrow::TreeNode& node = data.nodes[n];
        if (passes_by(node)) {
            n = node.skip;
            continue;
        }
        for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
            const Mesh<3>::Element& corner = data.elements[data.order[k]];
            const narrow::Vec3 &a = vertices[corner[0]], &b = vertices[corner[1]], &c = vertices[corner[2]];
            const int turn = narrow::shifted_side(a, b, p);
            if (turn == 0 || narrow::shifted_side(b, c, p) != turn || narrow::shifted_side(c, a, p) != turn)
                continue;
            if (narrow::side_of_plane(a, b, c, p) == -turn) number += turn;
        }
        ++n;
    }
    return number;
}

ClosedMesh::ClosedMesh(const Mesh<3>& mesh)
{
    auto data = std::make_shared<Data>(Data{mesh, {}, 0, 0});
    const narrow::MeshData<3>& of = data->of();
    narrow::check_closed(of);
    double most = 0;
    for (const narrow::Vec3& v : of.vertices)
        for (int d = 0; d < 3; ++d)
            most = std::max(most, std::abs(v[d]));
    int exponent = 0;
    if (most > 0) std::frexp(most, &exponent); // most < 2^exponent
    data->exponent = 58 - exponent;
    data->grain = std::ldexp(1.0, -201 - data->exponent);
    data->vertices.reserve(of.vertices.size());
    for (const narrow::Vec3& v : of.vertices)
        data->vertices.push_back(data->scaled(v));
    data_ = std::move(data);
}

int ClosedMesh::winding_number(const Vec<3, double>& point) const
{
    narrow::check_point(point, Error::no_index);
    return data_->winding_number(narrow::load(point));
}
template <Coordinate T>
bool ClosedMesh::contains(const Pose<3, T>& pose, const std::type_identity_t<Vec<3, T>>& point) const
{
    if (!narrow::valid(pose)) narrow::refuse_pose(pose, Error::no_index);
    narrow::check_point(point, Error::no_index);
    return data_->contains(pose, point);
}
template <Coordinate T>
SignedDistance<T> ClosedMesh::signed_distance(const Pose<3, T>& pose,
                                              const std::type_identity_t<Vec<3, T>>& point) const
{
    if (!narrow::valid(pose)) narrow::refuse_pose(pose, Error::no_index);
    narrow::check_point(point, Error::no_index);
    return data_->signed_distance(pose, point);
}

namespace narrow {
namespace {
/// out[i] = answer(points[i]).
template <class T, class Out, class Answer>
void answer_points(const Pose<3, T>& pose, const StridedView<Vec<3, T>>& points, std::span<Out> out,
                   Executor& executor, const Answer& answer)
{
    if (!valid(pose)) refuse_pose(pose, Error::no_index);
    if (points.size() != out.size())
        throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(points.size()) +
                                                  " points and room for " + std::to_string(out.size()) +
                                                  " answers; give one for each");
    process_items(points.size(),
                  [&](std::uint64_t begin, std::uint64_t end, Work) {
                      for (std::uint64_t i = begin; i < end; ++i) {
                          check_point(points[i], i);
                          out[i] = answer(points[i]);
                      }
                  },
                  {&executor, 64});
}
} // namespace
} // namespace narrow

template <Coordinate T>
void ClosedMesh::contains(const Pose<3, T>& pose, std::type_identity_t<StridedView<Vec<3, T>>> points,
                          std::span<std::uint8_t> out, Executor& executor) const
{
    narrow::answer_points(pose, points, out, executor, [&](const Vec<3, T>& point) {
        return static_cast<std::uint8_t>(data_->contains(pose, point) ? 1 : 0);
    });
}
template <Coordinate T>
void ClosedMesh::signed_distances(const Pose<3, T>& pose, std::type_identity_t<StridedView<Vec<3, T>>> points,
                                  std::type_identity_t<std::span<SignedDistance<T>>> out,
                                  Executor& executor) const
{
    narrow::answer_points(pose, points, out, executor,
                          [&](const Vec<3, T>& point) { return data_->signed_distance(pose, point); });
}

#define JOSTLE_CLOSED_MESH(T)                                                                                \
    template JOSTLE_API bool ClosedMesh::contains(const Pose<3, T>&, const Vec<3, T>&) const;                \
    template JOSTLE_API SignedDistance<T> ClosedMesh::signed_distance(const Pose<3, T>&, const Vec<3, T>&)   \
        const;                                                                                               \
    template JOSTLE_API void ClosedMesh::contains(const Pose<3, T>&, StridedView<Vec<3, T>>,                 \
                                                  std::span<std::uint8_t>, Executor&) const;                 \
    template JOSTLE_API void ClosedMesh::signed_distances(const Pose<3, T>&, StridedView<Vec<3, T>>,         \
                                                          std::span<SignedDistance<T>>, Executor&) const
JOSTLE_CLOSED_MESH(float);
JOSTLE_CLOSED_MESH(double);

JOSTLE_NAMESPACE_END
