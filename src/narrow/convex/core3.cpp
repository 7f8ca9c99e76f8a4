// SPDX-License-Identifier: MIT
#include "narrow/convex/core3.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

// Bit d of i is set if coordinate d of vertex i of a box is positive.
constexpr std::uint32_t box_loop_begin[] = {0, 4, 8, 12, 16, 20, 24};
constexpr std::uint32_t box_loop[] = {0, 4, 6, 2, /**/ 1, 3, 7, 5, /**/ 0, 1, 5, 4, /**/
                                      2, 6, 7, 3, /**/ 0, 2, 3, 1, /**/ 4, 5, 7, 6};
constexpr Edge box_edge[] = {{{0, 1}, {2, 4}}, {{2, 3}, {4, 3}}, {{4, 5}, {5, 2}}, {{6, 7}, {3, 5}},
                             {{0, 2}, {4, 0}}, {{1, 3}, {1, 4}}, {{4, 6}, {0, 5}}, {{5, 7}, {5, 1}},
                             {{0, 4}, {0, 2}}, {{1, 5}, {2, 1}}, {{2, 6}, {3, 0}}, {{3, 7}, {1, 3}}};
constexpr double box_normals[] = {-1, 1, 0, 0, 0,      0, -1, -1, /**/ 0, 0, -1, 1,
                                  0,  0, 0, 0, /**/ 0, 0, 0,  0,  -1,     1, 0,  0};
const Vec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr std::uint32_t rectangle_loop_begin[] = {0, 4, 8};
constexpr std::uint32_t rectangle_loop[] = {0, 1, 3, 2, 0, 2, 3, 1};
constexpr Edge rectangle_edge[] = {{{0, 1}, {0, 1}}, {{2, 3}, {1, 0}}, {{0, 2}, {1, 0}}, {{1, 3}, {0, 1}}};
constexpr std::uint32_t triangle_loop_begin[] = {0, 3, 6};
constexpr std::uint32_t triangle_loop[] = {0, 1, 2, 0, 2, 1};
constexpr Edge triangle_edge[] = {{{0, 1}, {0, 1}}, {{1, 2}, {0, 1}}, {{2, 0}, {0, 1}}};

void put(double* coordinates, std::uint32_t i, const Vec3& v)
{
    coordinates[i] = v.x;
    coordinates[lanes + i] = v.y;
    coordinates[2 * lanes + i] = v.z;
}

// Balls inside cores, in local axes: p is on the surface, and d points outwards.
Ball ball_in_box(const Vec3& half, const Vec3& p, const Vec3& d)
{
    const Vec3 size{std::abs(d.x), std::abs(d.y), std::abs(d.z)};
    const int out = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    Ball ball{p, half[out]};
    for (int k = 0; k < 3; ++k)
        if (k != out) ball.radius = std::min(ball.radius, half[k] - std::abs(p[k]));
    ball.radius = std::max(ball.radius, 0.0);
    ball.middle[out] = std::copysign(half[out] - ball.radius, d[out]);
    return ball;
}
Ball ball_in_hull(const Polytope& hull, const Vec3& p, const Vec3& d)
{
    std::uint32_t face = 0;
    for (std::uint32_t f = 1; f < hull.faces; ++f)
        if (dot(hull.normal(f), d) > dot(hull.normal(face), d)) face = f;
    const Vec3 n = hull.normal(face);
    double radius = HUGE_VAL;
    for (std::uint32_t f = 0; f < hull.faces; ++f) {
        const Vec3 other = hull.normal(f);
        const double room = hull.offset[f] - dot(other, p), lean = 1 - dot(other, n);
        if (f != face && room < radius * lean) radius = room > 0 ? room / lean : 0;
    }
    return {p - n * radius, radius};
}
Ball ball_in_cylinder(const Vec3& size, const Vec3& p, const Vec3& d)
{
    const double radius = size.x, half = size.y;
    if (d.y * d.y > 0.5) { // on a disc
        const double ball = std::max(0.0, std::min(radius - std::sqrt(p.x * p.x + p.z * p.z), half));
        return {{p.x, std::copysign(half - ball, d.y), p.z}, ball};
    }
    const double ball = std::max(0.0, std::min(radius, half - std::abs(p.y)));
    const Vec3 out = across_axis(d);
    return {{out.x * (radius - ball), p.y, out.z * (radius - ball)}, ball};
}
Ball ball_in_cone(const Vec3& size, const Vec3& p, const Vec3& d)
{
    const double radius = size.x, half = size.y, side = std::sqrt(radius * radius + 4 * half * half);
    const double out = 2 * half / side, up = radius / side; // the normal of the side
    const Vec3 across = across_axis(d);
    if (out * (d.x * across.x + d.z * across.z) + up * d.y < -d.y) { // on the disc
        const double room = radius - std::sqrt(p.x * p.x + p.z * p.z);
        const double ball = std::max(0.0, room * out / (1 + up));
        return {{p.x, ball - half, p.z}, ball};
    }
    const double from_tip = std::max(0.0, half - p.y), from_disc = std::max(0.0, half + p.y);
    const double on_side = from_tip * radius / (2 * half);
    const double ball = std::min(on_side / out, from_disc / (1 + up));
    const double aside = on_side - ball * out;
    return {{across.x * aside, p.y - ball * up, across.z * aside}, ball};
}
/// Every point of the surface of an ellipsoid is on a ball inside it with the least radius of curvature.
/// Source: Blaschke, Kreis und Kugel (1916), sec. 24.
Ball ball_in_ellipsoid(const Core3& core, const Vec3& d)
{
    const Vec3& size = core.lengths;
    const double least = std::min({size.x, size.y, size.z});
    const double ball = least * (least / std::max({size.x, size.y, size.z}));
    return {smooth_point(core, 0, d) - d * ball, ball};
}

} // namespace

Ball ball_inside(const Core3& core, const Vec3& p, const Vec3& normal)
{
    const Vec3 local = core.frame.r.back(p - core.frame.p), d = core.frame.r.back(normal);
    Ball ball{local, 0};
    if (core.is_box)
        ball = ball_in_box(core.polytope.vertex(7), local, d);
    else if (core.smooth == Smooth::cylinder)
        ball = ball_in_cylinder(core.lengths, local, d);
    else if (core.smooth == Smooth::cone)
        ball = ball_in_cone(core.lengths, local, d);
    else if (core.smooth == Smooth::ellipsoid)
        ball = ball_in_ellipsoid(core, d);
    else if (core.smooth == Smooth::none && core.polytope.offset != nullptr)
        ball = ball_in_hull(core.polytope, local, d);
    return {core.frame * ball.middle, ball.radius};
}

Core3::Core3(const Shape<3>& shape, const Frame<3>& where, const Kernels& with)
    : frame(where),
      radius(ShapeAccess::radius(shape)),
      reach(ShapeAccess::reach(shape) - radius),
      kernels(&with)
{
    const Vec<3, double>& given = ShapeAccess::size(shape);
    polytope.x = coordinates_;
    polytope.stride = lanes;
    switch (kind_of(shape)) {
    case Kind::sphere:
        polytope.vertices = 1;
        for (double& c : coordinates_)
            c = 0;
        break;
    case Kind::capsule:
        polytope.vertices = 2;
        for (std::uint32_t i = 0; i < lanes; ++i)
            put(coordinates_, i, {0, i == 1 ? given[1] : -given[1], 0});
        polytope.edge = box_edge; // 0 to 1
        polytope.edges = 1;
        polytope.direction = axes + 1;
        polytope.directions = 1;
        break;
    case Kind::box:
    case Kind::rounded_box:
        set_box(given);
        break;
    case Kind::cylinder:
        set_smooth(Smooth::cylinder, given);
        break;
    case Kind::cone:
        set_smooth(Smooth::cone, given);
        break;
    case Kind::ellipsoid:
        set_smooth(Smooth::ellipsoid, given);
        break;
    case Kind::convex:
    case Kind::rounded_hull:
        polytope = ShapeAccess::data<HullData<3>>(shape).polytope;
        break;
    case Kind::custom:
        smooth = Smooth::custom;
        custom = shape.custom();
        break;
    case Kind::half_space: // a plane and no polytope
    case Kind::mesh:       // not convex, but their parts are
    case Kind::height_field:
    case Kind::compound:
        break;
    }
}

void Core3::set_smooth(Smooth what, const Vec<3, double>& size)
{
    smooth = what;
    lengths = load(size);
}

// Boxes that aren't flat are handled separately because they are the usual ones, and need no branches.
void Core3::set_box(const Vec<3, double>& half)
{
    const Vec3 size = load(half);
    is_box = size.x > 0 && size.y > 0 && size.z > 0;
    if (!is_box) return set_flat_box(size);
    polytope.vertices = 8;
    for (std::uint32_t i = 0; i < 8; ++i)
        put(coordinates_, i,
            {(i & 1) != 0 ? size.x : -size.x, (i & 2) != 0 ? size.y : -size.y,
             (i & 4) != 0 ? size.z : -size.z});
    polytope.edge = box_edge;
    polytope.edges = 12;
    polytope.direction = axes;
    polytope.directions = 3;
    polytope.faces = 6;
    polytope.nx = box_normals;
    polytope.face_stride = lanes;
    for (std::uint32_t f = 0; f < lanes; ++f)
        offsets_[f] = size[f < 6 ? static_cast<int>(f / 2) : 0];
    polytope.offset = offsets_;
    polytope.outline_begin = box_loop_begin;
    polytope.outline = box_loop;
}

/// A box of zero size along some axes is a rectangle, a segment or a point: a face without area would have
/// sides that cut nothing off.
void Core3::set_flat_box(const Vec3& half)
{
    int wide[3], count = 0;
    for (int d = 0; d < 3; ++d)
        if (half[d] > 0) wide[count++] = d;
    const std::uint32_t corners = 1u << count;
    polytope.vertices = corners;
    for (std::uint32_t i = 0; i < lanes; ++i) {
        Vec3 p;
        const std::uint32_t corner = i < corners ? i : 0;
        for (int k = 0; k < count; ++k)
            p[wide[k]] = (corner >> k & 1) != 0 ? half[wide[k]] : -half[wide[k]];
        put(coordinates_, i, p);
    }
    polytope.edge = box_edge;
    polytope.edges = count == 2 ? 4 : static_cast<std::uint32_t>(count);
    for (int k = 0; k < count; ++k)
        directions_[k] = axes[wide[k]];
    polytope.direction = directions_;
    polytope.directions = static_cast<std::uint32_t>(count);
    if (count < 2) return;
    // Corner 0 to 1 runs along the first axis, 0 to 2 along the second.
    const Vec3 n = cross(axes[wide[0]], axes[wide[1]]);
    for (int d = 0; d < 3; ++d) {
        normals_[2 * d] = n[d];
        normals_[2 * d + 1] = -n[d];
    }
    polytope.faces = 2;
    polytope.nx = normals_;
    polytope.face_stride = 2;
    polytope.outline_begin = rectangle_loop_begin;
    polytope.outline = rectangle_loop;
    polytope.edge = rectangle_edge;
}

Core3::Core3(const Vec3& a, const Vec3& b, const Vec3& c, const Frame<3>& where, const Kernels& with)
    : frame(where), reach(std::sqrt(std::max({length2(a), length2(b), length2(c)}))), kernels(&with)
{
    polytope.x = coordinates_;
    polytope.stride = lanes;
    polytope.vertices = 3;
    polytope.middle = (a + b + c) * (1.0 / 3);
    std::fill_n(coordinates_, lanes, a.x);
    std::fill_n(coordinates_ + lanes, lanes, a.y);
    std::fill_n(coordinates_ + std::size_t{2} * lanes, lanes, a.z);
    put(coordinates_, 1, b);
    put(coordinates_, 2, c);
    polytope.edge = triangle_edge;
    polytope.edges = 3;
    polytope.direction = directions_;
    const Vec3 ab = b - a, bc = c - b, ca = a - c;
    directions_[0] = ab; // of any length: only tests of edges use their directions
    directions_[1] = bc;
    directions_[2] = ca;
    polytope.directions = 3;
    const Vec3 n = cross(ab, -ca);
    const double size = length(n);
    // If it is thinner than this, the normal is noise, and it counts as a segment.
    const double widest = std::max({length2(ab), length2(bc), length2(ca)});
    if (size > 1e-13 * widest) {
        const Vec3 unit = n * (1 / size);
        for (int d = 0; d < 3; ++d) {
            normals_[2 * d] = unit[d];
            normals_[2 * d + 1] = -unit[d];
        }
        polytope.faces = 2;
        polytope.nx = normals_;
        polytope.face_stride = 2;
        polytope.outline_begin = triangle_loop_begin;
        polytope.outline = triangle_loop;
    }
}

} // namespace narrow
JOSTLE_NAMESPACE_END
