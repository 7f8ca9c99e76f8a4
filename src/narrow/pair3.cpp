// SPDX-License-Identifier: MIT
#include <utility>

#include "narrow/motion.hpp"
#include "narrow/pair.hpp"
#include "narrow/simple3.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

enum class Surface : std::uint8_t
{
    none,  ///< a solid
    sheet, ///< a triangle of a mesh: two sides, goes on beyond its sides
    ground ///< a triangle of a height field: solid below
};

/// One convex piece of a shape, seen from a's position.
struct Part
{
    /// A convex shape or a half-space.
    Part(const Shape<3>& shape, const Frame<3>& frame, const Kernels& kernels)
        : core(shape, frame, kernels), half_space(shape.type() == ShapeTypes::half_space)
    {
        if (!half_space) return;
        normal = frame.r * load(ShapeAccess::size(shape));
        offset = shape.offset() + dot(normal, frame.p);
    }
    /// A triangle of a surface, or where it has no area the segment or point that it is.
    template <class Data>
    Part(const Data& data, const Mesh<3>::Element& corners, const Frame<3>& frame, const Kernels& kernels)
        : core(data.vertex(corners[0]), data.vertex(corners[1]), data.vertex(corners[2]), frame, kernels),
          number(corners)
    {
        if (core.polytope.faces == 0) return;
        normal = frame.r * core.polytope.normal(0);
        of(data);
    }

    Core3 core;
    bool half_space = false;
    Vec3 normal; ///< of a half-space; of a triangle's front
    double offset = 0;
    Surface surface = Surface::none;
    Mesh<3>::Element number{}; ///< of a triangle's corners
    const MeshData<3>* mesh = nullptr;
    const HeightData* field = nullptr;

  private:
    void of(const MeshData<3>& data) { mesh = &data, surface = Surface::sheet; }
    void of(const HeightData& data) { field = &data, surface = Surface::ground; }
};

/// Where `part` is, and the ground below it, in the local axes of `frame`.
Region<3> region_of(const Part& part, const Frame<3>& frame)
{
    if (part.half_space) return everywhere<3>();
    Region<3> region;
    const Core3& core = part.core;
    const Vec3 axes[3] = {frame.r.x, frame.r.y, frame.r.z};
    for (int d = 0; d < 3; ++d) {
        const double shift = dot(axes[d], frame.p),
                     rounding = 1e-14 * (core.reach + core.radius + length(frame.p));
        region.lo[d] = dot(axes[d], furthest(core, -axes[d])) - shift - core.radius - rounding;
        region.hi[d] = dot(axes[d], furthest(core, axes[d])) - shift + core.radius + rounding;
        if (part.surface != Surface::ground) continue;
        for (std::uint32_t i = 0; i < 3; ++i) {
            const Vec3 top = core.polytope.vertex(i);
            const double at = dot(axes[d], core.frame * Vec3{top.x, part.field->floor, top.z}) - shift;
            region.lo[d] = std::min(region.lo[d], at - rounding);
            region.hi[d] = std::max(region.hi[d], at + rounding);
        }
    }
    return region;
}

/// Where any shape is: the box of its ball.
Region<3> region_of(const Shape<3>& shape, const Vec3& at, const Frame<3>& frame)
{
    const double reach = ShapeAccess::reach(shape) * (1 + 1e-14);
    const Vec3 p = frame.r.back(at - frame.p);
    return {{p.x - reach, p.y - reach, p.z - reach}, {p.x + reach, p.y + reach, p.z + reach}};
}

template <class Visit>
void for_each_triangle(const MeshData<3>& mesh, const Kernels& kernels, const Frame<3>& frame,
                       const Region<3>& region, const Range<3>& range, Visit&& visit)
{
    for (std::uint32_t k = 0; k < mesh.nodes.size();) {
        const TreeNode& node = mesh.nodes[k];
        if (!region.meets(node.lo, node.hi, range)) {
            k = node.skip;
            continue;
        }
        for (std::uint32_t i = 0; i < node.count; ++i) {
            const std::uint32_t e = mesh.order[node.first + i];
            const auto& corner = mesh.elements[e];
            const Vec3 &p = mesh.vertices[corner[0]], &q = mesh.vertices[corner[1]],
                       &r = mesh.vertices[corner[2]];
            double lo[3], hi[3];
            for (int d = 0; d < 3; ++d) {
                lo[d] = std::min(p[d], std::min(q[d], r[d]));
                hi[d] = std::max(p[d], std::max(q[d], r[d]));
            }
            if (!region.meets(lo, hi, range)) continue;
            visit(e, Part(mesh, corner, frame, kernels));
        }
        ++k;
    }
}

template <class Visit>
void for_each_triangle(const HeightData& field, const Kernels& kernels, const Frame<3>& frame,
                       const Region<3>& region, const Range<3>& range, Visit&& visit)
{
    const Region<3> all = region.swept(range.time);
    if (all.lo[1] > field.highest + range.reach) return;
    // Cells under the region; numbers that no grid has are cut off before they become integers.
    const auto cell = [](double x, double spacing, std::uint32_t count) {
        const double c = std::floor(x / spacing);
        return static_cast<std::uint32_t>(std::clamp(c, 0.0, static_cast<double>(count)));
    };
    const double width = (field.columns - 1) * field.spacing_x, depth = (field.rows - 1) * field.spacing_z;
    if (all.hi[0] + range.reach < 0 || all.lo[0] - range.reach > width || all.hi[2] + range.reach < 0 ||
        all.lo[2] - range.reach > depth)
        return;
    const std::uint32_t z0 = cell(all.lo[2] - range.reach, field.spacing_z, field.rows - 2);
    const std::uint32_t z1 = cell(all.hi[2] + range.reach, field.spacing_z, field.rows - 2);
    for (std::uint32_t z = z0; z <= z1; ++z) {
        double lo = region.lo[0], hi = region.hi[0];
        if (range.time > 0) { // where the region is while it passes this row
            double enter = 0, leave = range.time;
            region.clip(2, z * field.spacing_z, (z + 1) * field.spacing_z, range.reach, enter, leave);
            if (enter > leave + 1e-12 * range.time) continue;
            lo += std::min(region.way.x * enter, region.way.x * leave) - 1e-12 * (all.hi[0] - all.lo[0]);
            hi += std::max(region.way.x * enter, region.way.x * leave) + 1e-12 * (all.hi[0] - all.lo[0]);
        }
        const std::uint32_t x0 = cell(lo - range.reach, field.spacing_x, field.columns - 2);
        const std::uint32_t x1 = cell(hi + range.reach, field.spacing_x, field.columns - 2);
        for (std::uint32_t x = x0; x <= x1; ++x) {
            const std::uint32_t number = 2 * (z * (field.columns - 1) + x);
            for (const bool second : {false, true}) {
                const auto corners = field.triangle(x, z, second);
                double high = -HUGE_VAL;
                for (const std::uint32_t v : corners)
                    high = std::max(high, field.heights[v]);
                const Vec3 low{x * field.spacing_x, field.floor, z * field.spacing_z};
                if (range.time > 0
                        ? region.meets(low, Vec3{low.x + field.spacing_x, high, low.z + field.spacing_z},
                                       range)
                        : region.lo[1] <= high + range.reach)
                    visit(number + (second ? 1 : 0), Part(field, corners, frame, kernels));
            }
        }
    }
}

/// Calls visit(number, part) for each part that may be within range of the region. The range may shrink
/// meanwhile.
template <class Visit>
void for_each_part(const Shape<3>& shape, const Kernels& kernels, const Frame<3>& frame,
                   const Region<3>& region, const Range<3>& range, Visit&& visit)
{
    switch (shape.type()) {
    case ShapeTypes::mesh:
        for_each_triangle(ShapeAccess::data<MeshData<3>>(shape), kernels, frame, region, range, visit);
        return;
    case ShapeTypes::height_field:
        for_each_triangle(ShapeAccess::data<HeightData>(shape), kernels, frame, region, range, visit);
        return;
    case ShapeTypes::compound: {
        std::uint32_t number = 0;
        for (const auto& child : ShapeAccess::data<CompoundData<3>>(shape).children) {
            const double ball = ShapeAccess::reach(child.shape) * (1 + 1e-14);
            double lo[3], hi[3];
            for (int d = 0; d < 3; ++d)
                lo[d] = child.frame.p[d] - ball, hi[d] = child.frame.p[d] + ball;
            const bool has_part = child.shape.custom() == nullptr || child.shape.custom()->has_support();
            const Frame<3> there{frame.r * child.frame.r, frame * child.frame.p};
            if (has_part && region.meets(lo, hi, range)) visit(number, Part(child.shape, there, kernels));
            ++number;
        }
        return;
    }
    default:
        if (shape.custom() != nullptr && !shape.custom()->has_support()) return;
        visit(0u, Part(shape, frame, kernels));
    }
}

bool has_parts(const Shape<3>& shape)
{
    return shape.type() >= ShapeTypes::mesh && shape.type() <= ShapeTypes::compound;
}

void flip(Manifold<3>& manifold)
{
    manifold.normal = -manifold.normal;
    for (std::uint32_t i = 0; i < manifold.count; ++i)
        std::swap(manifold.point[i].feature_a, manifold.point[i].feature_b);
}
void flip(Gap<3>& gap)
{
    gap.normal = -gap.normal;
    std::swap(gap.on_a, gap.on_b);
}

/// Everything that meets the triangle's highest side or corner is asked, so that of a surface which touches a
/// body the part that is nearest always has the contact, however gently it bends, and no other has.
template <class Data>
Beyond beyond(const Data& surface, const Part& triangle, const Vec3& n, double side)
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
    const double top = std::max(height[0], std::max(height[1], height[2])) - 1e-6 * std::sqrt(size);
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
    // Where the body pushes within 30 degrees of the face no higher triangle is steep.
    const bool facing = dot(up, front) > 0.87;
    surface.find_at(number[at], [&](const Mesh<3>::Element& other) {
        unsigned shared = 0, own = 0; // bits of the triangle's corners, and of the other's that are the same
        for (unsigned i = 0; i < 3; ++i)
            for (unsigned k = 0; k < 3; ++k)
                if (other[k] == number[i]) shared |= 1u << i, own |= 1u << k;
        if ((shared & highest) != highest) return false;
        bool is_higher = false, falls = false;
        for (unsigned k = 0; k < 3; ++k) {
            if ((own >> k & 1) != 0) continue;
            const Vec3 away = surface.vertex(other[k]) - corner[at];
            if (leads_along(away, up)) is_higher = true, falls = falls || dot(away, front) < 0;
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
        steep = along * along < 0.75 * length2(normal);
        return steep;
    });
    if (steep) return Beyond::steeply;
    return higher || (rising & sides) == sides ? Beyond::onwards : Beyond::nothing;
}
Beyond beyond(const Part& triangle, const Vec3& n, double side)
{
    return triangle.mesh != nullptr ? beyond(*triangle.mesh, triangle, n, side)
                                    : beyond(*triangle.field, triangle, n, side);
}

/// Over or under the triangle as the height field's y runs.
bool in_column(const Part& triangle, const Vec3& p)
{
    const Core3& core = triangle.core;
    const Vec3 local = core.frame.r.back(p - core.frame.p);
    const Polytope& t = core.polytope;
    double least = 0, most = 0;
    for (std::uint32_t i = 0; i < 3; ++i) {
        const Vec3 a = t.vertex(i), b = t.vertex((i + 1) % 3);
        const double side = (b.x - a.x) * (local.z - a.z) - (b.z - a.z) * (local.x - a.x);
        least = std::min(least, side);
        most = std::max(most, side);
    }
    return least == 0 || most == 0;
}

Vec3 centre_of(const Core3& core)
{
    Vec3 sum;
    if (core.custom != nullptr) { // which needn't hold its own origin
        for (const Vec3& axis : {core.frame.r.x, core.frame.r.y, core.frame.r.z})
            sum += furthest(core, axis) + furthest(core, -axis);
        return sum * (1.0 / 6);
    }
    for (std::uint32_t i = 0; i < core.polytope.vertices; ++i)
        sum += core.polytope.vertex(i);
    return core.frame * (sum * (1.0 / core.polytope.vertices));
}

/// Where the ground ends below a corner of its triangle.
Vec3 foot(const Part& ground, std::uint32_t corner)
{
    const Vec3 top = ground.core.polytope.vertex(corner);
    return ground.core.frame * Vec3{top.x, ground.field->floor, top.z};
}
/// A triangle of a height field with the ground below it, seen from a's position.
class Solid final : public CustomShape<3>
{
  public:
    explicit Solid(const Part& ground)
    {
        for (std::uint32_t i = 0; i < 3; ++i) {
            corner_[i] = ground.core.frame * ground.core.polytope.vertex(i);
            corner_[3 + i] = foot(ground, i);
        }
        for (const Vec3& p : corner_)
            radius_ = std::max(radius_, length(p));
    }
    [[nodiscard]] double radius() const noexcept override { return radius_; }
    [[nodiscard]] Vec<3, double> support(const Vec<3, double>& direction) const noexcept override
    {
        const Vec3 d = load(direction), *best = corner_;
        for (const Vec3& p : corner_)
            if (dot(d, p) > dot(d, *best)) best = &p;
        return {best->x, best->y, best->z};
    }

  private:
    Vec3 corner_[6];
    double radius_ = 0;
};

/// Under a height field's triangle: its centre is below the triangle, and nothing else says where up is. The
/// ground ends at its floor.
bool is_below(const Part& ground, const Core3& core)
{
    const Frame<3>& frame = ground.core.frame;
    if (dot(frame.r.y, furthest(core, frame.r.y) - frame.p) + core.radius < ground.field->floor) return false;
    const Vec3 centre = centre_of(core);
    if (!(dot(ground.normal, centre - ground.core.frame * ground.core.polytope.vertex(0)) < 0 &&
          in_column(ground, centre)))
        return false;
    if (dot(frame.r.y, centre - frame.p) >= ground.field->floor) return true;
    // What rises from further down may reach up beside the column.
    const Solid solid(ground);
    return convex_touch(Core3(Shape<3>(solid, ShapeTypes::first_custom), {}, *ground.core.kernels), core);
}
/// How high a core's lowest point is over a triangle's plane.
double height_over(const Part& ground, const Core3& core, Vec3& lowest)
{
    lowest = furthest(core, -ground.normal) - ground.normal * core.radius;
    return dot(ground.normal, lowest - ground.core.frame * ground.core.polytope.vertex(0));
}

/// A direction away from the ground that a body above it can have. Sides of steep triangles look downwards,
/// too.
bool comes_from_above(const Part& ground, const Vec3& n)
{
    return dot(n, ground.normal) > 0 && dot(n, ground.core.frame.r.y) > 0;
}

/// Where the core reaches furthest through the triangle's plane, wherever the triangle ends.
bool plane_contact(const Core3& a, const Part& b, double side, double margin, Manifold<3>& manifold)
{
    const Vec3 normal = b.normal * side;
    const Vec3 lowest = furthest(a, -normal) - normal * a.radius;
    const double height = dot(normal, lowest - b.core.frame * b.core.polytope.vertex(0));
    if (height > margin) return false;
    manifold.normal = -normal;
    manifold.count = 1;
    manifold.point[0] = {lowest - normal * (0.5 * height), -height, feature_id(vertex_feature, 0),
                         feature_id(face_feature, side > 0 ? 0 : 1)};
    return true;
}

/// The side of its plane to which a triangle's surface pushes a body: `side` unless the body met it nearly
/// edgewise, where the shorter way out says more.
double out_of(const Core3& a, const Part& b, const Vec3& normal, double side)
{
    if (b.surface == Surface::ground || std::abs(dot(normal, b.normal)) >= 0.5) return side;
    const double plane = dot(b.normal, b.core.frame * b.core.polytope.vertex(0));
    const double above = dot(b.normal, furthest(a, b.normal)) - plane;
    const double below = plane - dot(b.normal, furthest(a, -b.normal));
    return above >= below ? 1 : -1;
}

/// Of cores within reach of each other: the contact that the triangle has as a piece of its surface.
Answer piece_contact(const Core3& a, const Part& b, const Gap<3>& cores, double side, double margin,
                     Manifold<3>& manifold)
{
    const Beyond goes = beyond(b, -cores.normal, side);
    if (goes == Beyond::onwards) {
        side = out_of(a, b, cores.normal, side);
        if (face_contact(a, b.core, side, margin, manifold)) return Answer::contact;
        if (!plane_contact(a, b, side, margin, manifold)) return Answer::none;
        return cores.distance > 0 ? Answer::last : Answer::spare;
    }
    make_manifold(a, b.core, cores, margin, manifold);
    return goes == Beyond::nothing ? Answer::contact : Answer::last;
}

Answer ground_contact(const Core3& a, const Part& b, double margin, Manifold<3>& manifold, double& gap)
{
    const bool below = is_below(b, a);
    Gap<3> cores;
    core_gap(a, b.core, below ? HUGE_VAL : a.radius + margin, cores);
    gap = cores.distance - a.radius;
    if (!below && !(cores.distance <= a.radius + margin)) return Answer::none;
    if (cores.distance > 0 && !below) {
        if (!comes_from_above(b, -cores.normal)) return Answer::none; // the column it is in pushes it up
        return piece_contact(a, b, cores, 1, margin, manifold);
    }
    return answer_if(face_contact(a, b.core, 1, margin, manifold) ||
                     plane_contact(a, b, 1, margin, manifold));
}

Answer surface_contact(const Core3& a, const Part& b, double margin, Manifold<3>& manifold, double& gap)
{
    if (b.surface == Surface::ground) return ground_contact(a, b, margin, manifold, gap);
    Gap<3> cores;
    cores.distance = HUGE_VAL;
    if (a.is_box && b.core.polytope.faces != 0) {
        const Vec3 half{a.polytope.x[7], a.polytope.x[lanes + 7],
                        a.polytope.x[2 * lanes + 7]}; // the last corner
        Vec3 corner[3];
        for (std::uint32_t i = 0; i < 3; ++i)
            corner[i] = a.frame.r.back(b.core.frame * b.core.polytope.vertex(i) - a.frame.p);
        const double separation = box_triangle(half, corner, margin, cores.normal);
        if (separation > margin) return Answer::none;
        cores.normal = a.frame.r * cores.normal;
        if (separation <= 0) cores.distance = separation;
    }
    if (cores.distance == HUGE_VAL) core_gap(a, b.core, a.radius + margin, cores);
    if (!(cores.distance <= a.radius + margin)) return Answer::none;
    gap = cores.distance - a.radius;
    const double side =
        dot(cores.normal, b.normal) <= 0 ? 1 : -1; // the front where the normal comes down on it
    return piece_contact(a, b, cores, side, margin, manifold);
}

/// `gap` is set where the answer isn't sure: how far apart the parts are.
Answer part_contact(const Part& a, const Part& b, double margin, Manifold<3>& manifold, double& gap)
{
    if (a.half_space && b.half_space) return Answer::none;
    if (b.half_space) return answer_if(half_space_contact(a.core, b.normal, b.offset, margin, manifold));
    Answer answer;
    if (a.half_space)
        answer = answer_if(half_space_contact(b.core, a.normal, a.offset, margin, manifold));
    else if (a.surface == b.surface)
        return answer_if(convex_contact(a.core, b.core, margin, manifold));
    else if (b.surface > a.surface)
        return surface_contact(a.core, b, margin, manifold, gap);
    else
        answer = surface_contact(b.core, a, margin, manifold, gap);
    if (answer != Answer::none) flip(manifold);
    return answer;
}

void part_gap(const Part& a, const Part& b, double enough, Gap<3>& gap)
{
    gap.distance = HUGE_VAL;
    if (a.half_space && b.half_space) return;
    if (b.half_space) return half_space_gap(a.core, b.normal, b.offset, gap);
    if (a.half_space) {
        half_space_gap(b.core, a.normal, a.offset, gap);
        return flip(gap);
    }
    const bool ground_a = a.surface == Surface::ground && b.surface != Surface::ground;
    const bool ground_b = b.surface == Surface::ground && a.surface != Surface::ground;
    convex_gap(a.core, b.core, ground_a || ground_b ? HUGE_VAL : enough, gap);
    if (!ground_a && !ground_b) return;
    const Part& ground = ground_a ? a : b;
    const Core3& other = ground_a ? b.core : a.core;
    if (is_below(ground, other)) {
        Vec3 lowest;
        gap.distance = height_over(ground, other, lowest);
        gap.normal = ground.normal;
        gap.on_b = lowest;
        gap.on_a = lowest - ground.normal * gap.distance;
        if (ground_b) flip(gap);
    } else if (gap.distance > -other.radius &&
               !comes_from_above(ground, ground_a ? gap.normal : -gap.normal)) {
        gap.distance = HUGE_VAL; // the column it is in pushes it up
    }
}

/// All pairs of parts within range of each other.
template <class Visit>
void for_each_part_pair(const Placed<3>& pair, const Range<3>& range, Visit&& visit)
{
    const Frame<3> frame_a{pair.ra, {}}, frame_b{pair.rb, pair.d};
    const bool many_a = has_parts(*pair.a), many_b = has_parts(*pair.b);
    Region<3> around = many_a ? region_of(*pair.b, pair.d, frame_a) : everywhere<3>();
    if (many_a) around.way = frame_a.r.back(range.linear);
    for_each_part(*pair.a, *pair.kernels, frame_a, around, range, [&](std::uint32_t number_a, const Part& a) {
        Region<3> region = many_b ? region_of(a, frame_b) : everywhere<3>();
        if (many_b) region.way = frame_b.r.back(-range.linear);
        for_each_part(*pair.b, *pair.kernels, frame_b, region, range,
                      [&](std::uint32_t number_b, const Part& b) { visit(number_a, a, number_b, b); });
    });
}

/// The short ways, for the shapes that have one.
Outcome simple_contact(const Placed<3>& pair, double margin, Manifold<3>& manifold)
{
    const Shape<3>&a = *pair.a, &b = *pair.b;
    if (b.type() == ShapeTypes::sphere) return spheres(a.radius(), b.radius(), pair.d, margin, manifold);
    if (b.type() != ShapeTypes::box || a.type() > ShapeTypes::box) return Outcome::unclear;
    const Vec3 half = load(b.size());
    if (a.type() == ShapeTypes::box) {
        const Vec3 half_a = load(a.size());
        return boxes(pair.ra, half_a, pair.rb, half, pair.d, box_axis(pair.ra, half_a, pair.rb, half, pair.d),
                     margin, manifold);
    }
    const double half_length = a.size()[1];
    return capsule_box(pair.ra.y, half_length, a.radius(), pair.rb, half, pair.d,
                       capsule_box_gap(pair.ra.y, half_length, pair.rb, half, pair.d), margin, manifold);
}

/// Whether a part meets the other as the ground that it is, not as a bare triangle.
bool is_ground(const Part& part, const Part& other)
{
    return part.surface == Surface::ground && other.surface != Surface::ground && !other.half_space;
}

Spread<3> spread_of(const Part& part, bool ground, const Turning<3>& turning, const Vec3& n)
{
    Spread<3> spread(turning, n);
    const Core3& core = part.core;
    const auto top = [&] { return dot(n, furthest(core, n)) + core.radius; };
    if (part.half_space) { // n is its normal
        spread.add_height(part.offset);
    } else if (core.custom != nullptr) {
        spread.add_somewhere(top(), core.frame.p, core.reach);
    } else if (turning.speed == 0) {
        spread.add_height(top());
    } else {
        for (std::uint32_t i = 0; i < core.polytope.vertices; ++i)
            spread.add(core.frame * core.polytope.vertex(i), core.radius);
    }
    for (std::uint32_t i = 0; i < 3 && ground; ++i)
        spread.add(foot(part, i));
    return spread;
}

/// How far parts are from each other, whichever side they come from: the ground has sides and an underside.
void moving_gap(const Part& a, const Part& b, double enough, Gap<3>& gap)
{
    const bool ground_a = is_ground(a, b);
    if (!ground_a && !is_ground(b, a)) return part_gap(a, b, enough, gap);
    const Part& ground = ground_a ? a : b;
    const Core3& other = ground_a ? b.core : a.core;
    if (is_below(ground, other)) return part_gap(a, b, enough, gap);
    convex_gap(other, ground.core, HUGE_VAL, gap);
    // From above the triangle is nearest, else one of the sides below it may be.
    if (gap.distance > 0 && dot(gap.normal, ground.core.frame.r.y) > 0) {
        const Solid solid(ground);
        const Core3 core(Shape<3>(solid, ShapeTypes::first_custom), {}, *ground.core.kernels);
        convex_gap(other, core, enough, gap);
    }
    if (ground_a) flip(gap);
}

double safe_time(const Flight<3>& flight, const Part& a, const Part& b, const Gap<3>& gap)
{
    const bool ground_a = is_ground(a, b), ground_b = is_ground(b, a);
    const auto along = [&](const Vec3& n) {
        return flight.safe_time(spread_of(a, ground_a, flight.a, n), spread_of(b, ground_b, flight.b, -n), n);
    };
    double time = along(gap.normal);
    // What slides along a triangle may come nearer to its side, but not to its plane.
    for (const Part* part : {&a, &b})
        if (part->surface != Surface::none && !a.half_space && !b.half_space && time < 1)
            time = std::max(time, along(part->normal * (dot(part->normal, gap.normal) > 0 ? 1.0 : -1.0)));
    return time;
}

} // namespace

template <>
void find_contacts(const Placed<3>& pair, double margin, FoundList<3>& found)
{
    if (!within_reach(pair, margin)) return;
    if (pair.b->type() <= ShapeTypes::box) {
        Found<3> one;
        const Outcome outcome = simple_contact(pair, margin, one.manifold);
        if (outcome == Outcome::touch) found.push_back(one);
        if (outcome != Outcome::unclear) return;
    }
    find_contacts_generally(pair, margin, found);
}

void find_contacts_generally(const Placed<3>& pair, double margin, FoundList<3>& found)
{
    Collector<3> collector(pair, found);
    for_each_part_pair(pair, Range<3>{margin},
                       [&](std::uint32_t number_a, const Part& a, std::uint32_t number_b, const Part& b) {
                           Found<3> one;
                           double gap = 0;
                           const Answer answer = part_contact(a, b, margin, one.manifold, gap);
                           one.part_a = number_a;
                           one.part_b = number_b;
                           collector.add(answer, one, gap);
                       });
    collector.finish();
}

template <>
bool find_touch(const Placed<3>& pair)
{
    if (!within_reach(pair, 0)) return false;
    if (pair.b->type() <= ShapeTypes::box) {
        Manifold<3> manifold;
        const Outcome outcome = simple_contact(pair, 0, manifold);
        if (outcome != Outcome::unclear) return outcome == Outcome::touch;
    }
    bool touch = false;
    // Below this nothing is within reach: the search ends.
    Range<3> range{0};
    for_each_part_pair(pair, range, [&](std::uint32_t, const Part& a, std::uint32_t, const Part& b) {
        if (touch) return;
        Gap<3> gap;
        if (a.surface == Surface::none && b.surface == Surface::none && !a.half_space && !b.half_space)
            touch = convex_touch(a.core, b.core);
        else {
            part_gap(a, b, 0, gap);
            touch = gap.distance <= 0;
        }
        if (touch) range.reach = -HUGE_VAL;
    });
    return touch;
}

template <>
void find_gap(const Placed<3>& pair, double enough, Gap<3>& best)
{
    best.distance = HUGE_VAL;
    for (int d = 0; d < 3; ++d)
        if (!(std::abs(pair.d[d]) <= 1e61)) return; // nothing is that big
    Range<3> range{enough};
    for_each_part_pair(pair, range, [&](std::uint32_t, const Part& a, std::uint32_t, const Part& b) {
        Gap<3> gap;
        part_gap(a, b, range.reach, gap);
        if (!(gap.distance <= range.reach) || !(gap.distance < best.distance)) return;
        best = gap;
        range.reach = std::max(0.0, std::min(range.reach, gap.distance));
    });
}

template <>
Outlook<3> look_ahead(const Moving<3>& pair, const Placed<3>& now, double tolerance, double time)
{
    const Flight<3> flight(pair, now, tolerance);
    return look_at_parts(
        flight, now, time,
        [](const Placed<3>& placed, const Range<3>& range, const auto& visit) {
            for_each_part_pair(placed, range, visit);
        },
        moving_gap,
        [&](const Part& a, const Part& b, const Gap<3>& gap) { return safe_time(flight, a, b, gap); });
}

} // namespace narrow
JOSTLE_NAMESPACE_END
