// SPDX-License-Identifier: MIT
#include "narrow/parts/surface.hpp"

#include "narrow/convex/convex3.hpp"
#include "narrow/convex/manifold3.hpp"
#include "narrow/parts/ground.hpp"
#include "narrow/parts/triangle_gap.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// Higher by less than this fraction of an element's size counts as level.
constexpr double level = 1e-6;
/// A bend of more than 30 degrees is steep. `cosine_of_30` errs towards asking all elements.
constexpr double cosine_of_30 = 0.87, cosine2_of_30 = 0.75, sine2_of_30 = 0.25;
/// A normal less than 30 degrees from an element's plane meets it edgewise: this is the cosine to its normal.
constexpr double edgewise = 0.5;

/// A point off a line or plane by less than this fraction of a triangle's longest side is on it: floats have
/// no more precision some hundred sides away from the origin.
constexpr double straight = 1e-5;
/// The sine of the angle between planes that count as one.
constexpr double same_plane = 1e-3;

/// Whether `d` leads along unit vector `n` by more than rounding.
template <class Vector>
bool leads_along(const Vector& d, const Vector& n)
{
    const double along = dot(d, n);
    return along > 0 && along * along > 1e-12 * length2(d);
}

/// What a surface does beyond the highest side or corner of its element along some direction.
enum class Beyond : std::uint8_t
{
    nothing, ///< it ends there or falls: nothing of it is higher, and a contact there is the surface's own
    onwards, ///< it continues higher, or rises like the floor at the foot of a wall
    steeply  ///< it continues higher, but not along this element: around an edge of more than 30 degrees
};

/// For an end of a segment, as for a side or corner of a triangle below.
Beyond beyond(const Part<2>& segment, const Vec2& n, double side)
{
    const Core2& core = segment.core;
    const Vec2 along = core.corner[1] - core.corner[0];
    if (std::abs(dot(n, along)) <= level * length(along)) return Beyond::nothing; // all of it: the side
    const std::size_t at = dot(n, along) > 0 ? 1 : 0;
    const Vec2 front = segment.normal * side;
    bool higher = false, rising = false, steep = false;
    segment.mesh->find_at(segment.number[at], [&](const Mesh<2>::Element& other) {
        const std::uint32_t v = other[other[0] == segment.number[at] ? 1 : 0];
        if (v == segment.number[1 - at]) return false;
        const Vec2 away = core.frame * segment.mesh->vertices[v] - core.corner[at];
        rising = rising || leads_along(away, front);
        if (!leads_along(away, n)) return false;
        higher = true;
        const double down = -dot(away, front);
        steep = down > 0 && down * down > sine2_of_30 * length2(away);
        return steep;
    });
    if (steep) return Beyond::steeply;
    return higher || rising ? Beyond::onwards : Beyond::nothing;
}

/// All triangles at the triangle's highest side or corner are tested, so that of a surface that touches a
/// body always the nearest part has the contact, however gently it bends, and no other.
template <class Data>
Beyond beyond(const Data& surface, const Part<3>& triangle, const Vec3& n, double side)
{
    const Core3& core = triangle.core;
    const Vec3 up = core.frame.r.back(n), front = core.polytope.normal(0) * side;
    const auto& number = triangle.number;
    Vec3 corner[3];
    double height[3], size = 0;
    for (unsigned i = 0; i < 3; ++i) {
        corner[i] = core.polytope.vertex(i);
        height[i] = dot(up, corner[i]);
        size = std::max(size, length2(corner[i] - corner[0]));
    }
    const double top = std::max(height[0], std::max(height[1], height[2])) - level * std::sqrt(size);
    unsigned highest = 0, sides = 0; // bits of corners, and of the sides that end in one or are between two
    for (unsigned i = 0; i < 3; ++i)
        if (height[i] >= top) highest |= 1u << i;
    if (highest == 7) return Beyond::nothing; // all of it: the face
    const bool one = (highest & (highest - 1)) == 0;
    const auto ends = [](unsigned i) { return 1u << i | 1u << (i + 1) % 3; };
    for (unsigned i = 0; i < 3; ++i)
        if (one ? (ends(i) & highest) != 0 : ends(i) == highest) sides |= 1u << i;
    const unsigned at = (highest & 1u) != 0 ? 0 : (highest & 2u) != 0 ? 1 : 2;

    unsigned rising = 0;
    bool higher = false, steep = false;
    // If the body pushes within 30 degrees of the face, no higher triangle is steep.
    const bool facing = dot(up, front) > cosine_of_30;
    surface.find_at(number[at], [&](const Mesh<3>::Element& other) {
        unsigned shared = 0, own = 0; // bits of the triangle's shared corners, and of the other's
        for (unsigned i = 0; i < 3; ++i)
            for (unsigned k = 0; k < 3; ++k)
                if (other[k] == number[i]) {
                    shared |= 1u << i;
                    own |= 1u << k;
                }
        if ((shared & highest) != highest) return false;
        bool is_higher = false, falls = false;
        for (unsigned k = 0; k < 3; ++k) {
            if ((own >> k & 1) != 0) continue;
            const Vec3 away = surface.vertex(other[k]) - corner[at];
            if (leads_along(away, up)) {
                is_higher = true;
                falls = falls || dot(away, front) < 0;
            }
            if (!higher && leads_along(away, front))
                for (unsigned i = 0; i < 3; ++i)
                    if ((shared & ends(i)) == ends(i)) rising |= 1u << i;
        }
        if (!is_higher) return false;
        higher = true;
        if (facing || !falls) return facing;
        const Vec3 p = surface.vertex(other[0]);
        const Vec3 normal = cross(surface.vertex(other[1]) - p, surface.vertex(other[2]) - p);
        const double along = dot(normal, front);
        if (length2(normal) <= straight * straight * size * size) return false; // too thin for a plane
        steep = along * along < cosine2_of_30 * length2(normal);
        return steep;
    });
    if (steep) return Beyond::steeply;
    return higher || (rising & sides) == sides ? Beyond::onwards : Beyond::nothing;
}
Beyond beyond(const Part<3>& triangle, const Vec3& n, double side)
{
    return triangle.mesh != nullptr ? beyond(*triangle.mesh, triangle, n, side)
                                    : beyond(*triangle.field, triangle, n, side);
}

double longest_side2(const Vec3& a, const Vec3& b, const Vec3& c)
{
    return std::max(length2(b - a), std::max(length2(c - b), length2(a - c)));
}

/// An element and its corners.
template <int Dim>
struct Facet;
template <>
struct Facet<3>
{
    Vec3 corner[3], across;
    double size2;
    Facet(const MeshData<3>& mesh, const Mesh<3>::Element& e)
        : corner{mesh.vertex(e[0]), mesh.vertex(e[1]), mesh.vertex(e[2])},
          across(cross(corner[1] - corner[0], corner[2] - corner[0])),
          size2(longest_side2(corner[0], corner[1], corner[2]))
    {
    }
    /// So thin that its plane is noise.
    [[nodiscard]] bool is_needle() const { return length2(across) <= straight * straight * size2 * size2; }
    [[nodiscard]] bool has(const Vec3& p, double slack) const
    {
        const double area = length(across);
        if (std::abs(dot(across, p - corner[0])) > slack * area) return false;
        for (int i = 0; i < 3; ++i) {
            const Vec3 side = corner[(i + 1) % 3] - corner[i];
            if (dot(cross(across, side), p - corner[i]) < -slack * area * length(side)) return false;
        }
        return true;
    }
    [[nodiscard]] bool is_level_with(const Facet& other) const
    {
        return length2(cross(across, other.across)) <=
               same_plane * same_plane * length2(across) * length2(other.across);
    }
};
template <>
struct Facet<2>
{
    Vec2 corner[2];
    double size2;
    Facet(const MeshData<2>& mesh, const Mesh<2>::Element& e)
        : corner{mesh.vertex(e[0]), mesh.vertex(e[1])}, size2(length2(corner[1] - corner[0]))
    {
    }
    [[nodiscard]] bool is_needle() const { return !(size2 > 0); }
    [[nodiscard]] bool has(const Vec2& p, double slack) const
    {
        const Vec2 along = corner[1] - corner[0];
        const double size = std::sqrt(size2), at = dot(along, p - corner[0]);
        return std::abs(cross(along, p - corner[0])) <= slack * size && at >= -slack * size &&
               at <= size2 + slack * size;
    }
    [[nodiscard]] bool is_level_with(const Facet& other) const
    {
        const double turn = cross(corner[1] - corner[0], other.corner[1] - other.corner[0]);
        return turn * turn <= same_plane * same_plane * size2 * other.size2;
    }
};

/// Whether an element with width, other than `own`, contains p and satisfies `wanted`. Those with the vertex
/// `but` don't count.
template <int Dim, class Wanted>
bool another_has(const MeshData<Dim>& mesh, const typename Mesh<Dim>::Element& own, std::uint32_t but,
                 const V<Dim>& p, double slack, const Wanted& wanted)
{
    bool found = false;
    mesh.find_around(p, slack, [&](const typename Mesh<Dim>::Element& e) {
        if (e == own || std::find(e.begin(), e.end(), but) != e.end()) return false;
        const Facet<Dim> facet(mesh, e);
        found = !facet.is_needle() && facet.has(p, slack) && wanted(facet);
        return found;
    });
    return found;
}
constexpr std::uint32_t no_vertex = ~0u;

/// The highest place of a facet, and its vertex there.
template <int Dim>
struct Highest
{
    V<Dim> p;
    std::uint32_t vertex;
};
/// The corner of a facet that is highest along `up`, or the point of its highest side next to p.
Highest<3> highest_point(const Part<3>& part, const Facet<3>& facet, const Vec3& up, const Vec3& p)
{
    std::size_t order[3] = {0, 1, 2};
    std::sort(order, order + 3, [&](std::size_t i, std::size_t k) {
        return dot(up, facet.corner[i]) > dot(up, facet.corner[k]);
    });
    const Vec3 from = facet.corner[order[0]], side = facet.corner[order[1]] - from;
    if (-dot(up, side) > level * std::sqrt(facet.size2)) return {from, part.number[order[0]]};
    return {from + side * std::max(0.0, std::min(1.0, dot(side, p - from) / length2(side))), no_vertex};
}
Highest<2> highest_point(const Part<2>& part, const Facet<2>& facet, const Vec2& up, const Vec2&)
{
    const std::size_t end = dot(up, facet.corner[1] - facet.corner[0]) > 0 ? 1 : 0;
    return {facet.corner[end], part.number[end]};
}

/// Whether another coplanar element continues where this one ends, without a shared corner or side: at a
/// point of the contact, from there towards the body.
template <int Dim>
bool goes_on_unjoined(const Part<Dim>& part, const V<Dim>& n, const Manifold<Dim>& manifold)
{
    if (part.surface != Surface::sheet || std::abs(dot(n, part.normal)) > 1 - level * level) return false;
    const MeshData<Dim>& mesh = *part.mesh;
    const Facet<Dim> own(mesh, part.number);
    const auto& frame = part.core.frame;
    const V<Dim> up = frame.r.back(-n);
    const Highest<Dim> top = highest_point(part, own, up, frame.r.back(manifold.point[0].p - frame.p));
    const V<Dim>& p = top.p;
    // Those that share the corner have been tested by beyond().
    return another_has(mesh, part.number, top.vertex, p, straight * std::sqrt(own.size2),
                       [&](const Facet<Dim>& other) {
                           bool higher = false;
                           for (const V<Dim>& corner : other.corner)
                               higher = higher || dot(up, corner - p) > level * std::sqrt(other.size2);
                           return higher && other.is_level_with(own);
                       });
}

/// The part of a core over the element on that side of it.
bool contact_over(const Core2& a, const Part<2>& b, double side, double margin, Manifold<2>& manifold)
{
    return face_contact(a, b.core, b.normal * -side, margin, manifold);
}
bool contact_over(const Core3& a, const Part<3>& b, double side, double margin, Manifold<3>& manifold)
{
    return face_contact(a, b.core, side, margin, manifold);
}
bool plane_contact(const Core2& a, const Part<2>& b, double side, double margin, Manifold<2>& manifold)
{
    return line_contact(a, b.core, b.normal * -side, margin, manifold);
}

/// 1 if a normal, from a body to an element, meets its front; -1 for its back.
template <int Dim>
double side_of(const Part<Dim>& b, const V<Dim>& normal)
{
    return dot(normal, b.normal) <= 0 ? 1 : -1;
}

/// The side of its plane on which most of a body is: the shorter way out.
template <int Dim, class Core>
double side_of_most(const Core& a, const Part<Dim>& b)
{
    const double plane = dot(b.normal, b.first_corner());
    const double above = dot(b.normal, furthest(a, b.normal)) - plane;
    const double below = plane - dot(b.normal, furthest(a, -b.normal));
    return above >= below ? 1 : -1;
}

/// The part over an element on that side of it, or else the place where the body has passed through its
/// plane.
template <int Dim, class Core>
Answer contact_along_normal(const Core& a, const Part<Dim>& b, double side, double margin,
                            Manifold<Dim>& manifold)
{
    if (contact_over(a, b, side, margin, manifold)) return Answer::over;
    return plane_contact(a, b, side, margin, manifold) ? Answer::spare : Answer::none;
}

/// If the surface continues towards a, the element's end can't be hit from the side: then only what is over
/// the element counts, along its normal.
template <int Dim, class Core>
Answer contact_as_piece(const Core& a, const Part<Dim>& b, const Gap<Dim>& cores, double side, double margin,
                        Manifold<Dim>& manifold)
{
    const Beyond goes = beyond(b, -cores.normal, side);
    if (goes != Beyond::onwards) {
        make_manifold(a, b.core, cores, margin, manifold);
        if (goes == Beyond::steeply) return Answer::last;
        if (!goes_on_unjoined(b, cores.normal, manifold)) return Answer::contact;
    }
    const bool sheet = b.surface == Surface::sheet;
    if (sheet && std::abs(dot(cores.normal, b.normal)) < edgewise) side = side_of_most(a, b);
    const Answer answer = contact_along_normal(a, b, side, margin, manifold);
    if (answer == Answer::over && !sheet) return Answer::contact; // the ground has one side
    return answer == Answer::spare && cores.distance > 0 ? Answer::last : answer;
}

template <int Dim, class Core>
Answer contact_on_other_side(const Core& a, const Part<Dim>& b, bool known, double margin,
                             Manifold<Dim>& manifold, Answer answer)
{
    const double side = side_of(b, manifold.normal);
    if (b.surface != Surface::sheet || (!known && side_of_most(a, b) == side)) return answer;
    if (!known) return contact_along_normal(a, b, -side, margin, manifold);
    return contact_over(a, b, -side, margin, manifold) ? Answer::over : Answer::none;
}

} // namespace

bool plane_contact(const Core3& a, const Part<3>& b, double side, double margin, Manifold<3>& manifold)
{
    const Vec3 normal = b.normal * side;
    const Vec3 lowest = furthest(a, -normal) - normal * a.radius;
    const double height = dot(normal, lowest - b.core.frame * b.core.polytope.vertex(0));
    if (height > margin + uncertain(a, b.core)) return false; // otherwise GJK decides
    manifold.normal = -normal;
    manifold.count = 1;
    manifold.point[0] = {lowest - normal * (0.5 * height), -std::min(height, margin),
                         feature_id(vertex_feature, 0), feature_id(face_feature, side > 0 ? 0 : 1)};
    return true;
}

Answer piece_contact(const Core3& a, const Part<3>& b, const Gap<3>& cores, double side, double margin,
                     Manifold<3>& manifold)
{
    return contact_as_piece(a, b, cores, side, margin, manifold);
}

template <int Dim>
bool is_covered(const Part<Dim>& part)
{
    if (part.mesh == nullptr) return false;
    const Facet<Dim> own(*part.mesh, part.number);
    if (!own.is_needle()) return false;
    const double slack = straight * std::sqrt(own.size2);
    return another_has(*part.mesh, part.number, no_vertex, own.corner[0], slack,
                       [&](const Facet<Dim>& other) {
                           return std::all_of(std::begin(own.corner), std::end(own.corner),
                                              [&](const V<Dim>& corner) { return other.has(corner, slack); });
                       });
}
template bool is_covered(const Part<2>&);
template bool is_covered(const Part<3>&);

Answer contact_behind(const Core2& a, const Part<2>& b, bool known, double margin, Manifold<2>& manifold,
                      Answer answer)
{
    return contact_on_other_side(a, b, known, margin, manifold, answer);
}
Answer contact_behind(const Core3& a, const Part<3>& b, bool known, double margin, Manifold<3>& manifold,
                      Answer answer)
{
    return contact_on_other_side(a, b, known, margin, manifold, answer);
}

Answer surface_contact(const Core2& a, const Part<2>& b, double margin, Manifold<2>& manifold, double& gap)
{
    Gap<2> cores;
    core_gap(a, b.core, a.radius + margin, cores);
    if (!(cores.distance <= a.radius + margin)) return Answer::none;
    gap = cores.distance - a.radius;
    const double side = side_of(b, cores.normal);
    return contact_as_piece(a, b, cores, side, margin, manifold);
}
Answer surface_contact(const Core3& a, const Part<3>& b, double margin, Manifold<3>& manifold, double& gap)
{
    if (b.surface == Surface::ground) return ground_contact(b, a, margin, manifold, gap);
    // Even a negligible gap counts as one for a search that ends beyond `enough`.
    const double enough = a.radius + margin + uncertain(a, b.core);
    Gap<3> cores;
    triangle_gap(a, b.core, enough, cores);
    if (!(cores.distance <= a.radius + margin)) return Answer::none;
    gap = cores.distance - a.radius;
    const double side = side_of(b, cores.normal);
    return contact_as_piece(a, b, cores, side, margin, manifold);
}

} // namespace narrow
JOSTLE_NAMESPACE_END
