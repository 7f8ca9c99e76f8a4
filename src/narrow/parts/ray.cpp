// SPDX-License-Identifier: MIT
#include "narrow/parts/ray.hpp"

#include "narrow/parts/each_part.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// A line in a shape's local axes, and its first hit so far.
template <int Dim>
class Caster
{
  public:
    Caster(const Line<Dim>& line, const Kernels& kernels) : line_(line), kernels_(kernels) {}

    Strike<Dim> best; ///< in local axes
    /// Tests a shape, as part `part`.
    void meet(const Shape<Dim>& shape, std::uint32_t part);

  private:
    [[nodiscard]] V<Dim> at(double t) const { return line_.origin + line_.way * t; }
    /// The distance up to which hits count: that of the nearest one so far.
    [[nodiscard]] double limit() const { return std::min(line_.most, best.at); }
    /// The error of heights over a shape's planes, all along the way to it.
    [[nodiscard]] double rounding_at(const Shape<Dim>& shape) const
    {
        return 4e-15 * (length(line_.origin) + ShapeAccess::reach(shape));
    }
    void hit(double t, const V<Dim>& normal, std::uint32_t part)
    {
        if (t <= line_.most && t < best.at) best = {t, normal, part};
    }
    void hit_inside(std::uint32_t part) { hit(0, -line_.way, part); }

    void meet_ball(const V<Dim>& centre, double radius, std::uint32_t part);
    void meet_capsule(double half_length, double radius, std::uint32_t part);
    void meet_box(const V<Dim>& half, std::uint32_t part);
    void meet_cylinder(double half_length, double radius, std::uint32_t part);
    void meet_ellipsoid(const Shape<Dim>& shape, std::uint32_t part);
    void meet_half_space(const V<Dim>& normal, double offset, std::uint32_t part);
    void meet_hull(const Shape<Dim>& shape, std::uint32_t part);
    template <class Hull>
    void meet_sides(const Hull& hull, const Shape<Dim>& shape, std::uint32_t part);
    void meet_by_distance(const Shape<Dim>& shape, std::uint32_t part);
    template <class Visit>
    void for_each_leaf_on_line(const std::vector<TreeNode>& nodes, double grow, const Visit& visit) const;
    void meet_mesh(const MeshData<Dim>& mesh);
    void meet_heights(const HeightData& field);
    void meet_compound(const CompoundData<Dim>& compound);

    Line<Dim> line_;
    const Kernels& kernels_;
};

/// The intersection of half-spaces: when the line is inside all of them.
struct Inside
{
    double enter = 0, leave = HUGE_VAL;
    int through = -1; ///< the one through which it enters; none if it begins inside

    /// The side is where `height` + t * `rise` <= 0. Returns false once nothing is left.
    bool cut(int side, double height, double rise)
    {
        if (rise == 0) return height <= 0;
        const double t = -height / rise;
        if (rise < 0) {
            if (t <= enter) return true;
            enter = t;
            through = side;
        } else {
            if (t >= leave) return true;
            leave = t;
        }
        return any();
    }
    /// The side is where the line is from `first` to `last`.
    void between(int side, double first, double last)
    {
        if (first > enter) {
            enter = first;
            through = side;
        }
        leave = std::min(leave, last);
    }
    [[nodiscard]] bool any() const { return enter <= leave && leave >= 0; }
};

template <int Dim>
void Caster<Dim>::meet_ball(const V<Dim>& centre, double radius, std::uint32_t part)
{
    const V<Dim> from = line_.origin - centre;
    const double nearest = -dot(from, line_.way);
    if (length2(from) <= radius * radius) return hit_inside(part);
    if (nearest < 0) return;
    const double room = radius * radius - length2(from + line_.way * nearest);
    if (!(room >= 0)) return;
    const double t = std::max(0.0, nearest - std::sqrt(room));
    const V<Dim> out = from + line_.way * t;
    const double size = length(out);
    hit(t, radius > 0 && size > 0 ? out * (1 / size) : -line_.way, part);
}

template <int Dim>
void Caster<Dim>::meet_capsule(double half_length, double radius, std::uint32_t part)
{
    if constexpr (Dim == 2) {
        Inside inside;
        if (!inside.cut(0, line_.origin.x - radius, line_.way.x) ||
            !inside.cut(1, -line_.origin.x - radius, -line_.way.x))
            return;
        if (std::abs(line_.origin.y + line_.way.y * inside.enter) <= half_length)
            return inside.through < 0 ? hit_inside(part)
                                      : hit(inside.enter, {inside.through == 0 ? 1.0 : -1.0, 0}, part);
    }
    // Across the axis; y is along it.
    V<Dim> from = line_.origin, way = line_.way;
    from[1] = way[1] = 0;
    const double along = line_.origin[1], speed = length2(way);
    V<Dim> end;
    end[1] = half_length;
    V<Dim> off = from;
    off[1] = along - std::clamp(along, -half_length, half_length);
    if (length2(off) <= radius * radius) return hit_inside(part);
    if (speed > 0) {
        const double nearest = -dot(from, way) / speed;
        const double room = (radius * radius - length2(from + way * nearest)) / speed;
        if (!(room >= 0)) return; // the line misses the side, and the ends as well
        const double t = nearest - std::sqrt(room);
        if (t >= 0 && std::abs(along + line_.way[1] * t) <= half_length) {
            const V<Dim> out = from + way * t;
            const double size = length(out);
            return hit(t, radius > 0 && size > 0 ? out * (1 / size) : -line_.way, part);
        }
    }
    meet_ball(end, radius, part);
    meet_ball(-end, radius, part);
}

template <int Dim>
void Caster<Dim>::meet_cylinder(double half_length, double radius, std::uint32_t part)
{
    constexpr int side = 2;
    Inside inside;
    if (!inside.cut(0, line_.origin[1] - half_length, line_.way[1]) ||
        !inside.cut(1, -line_.origin[1] - half_length, -line_.way[1]))
        return;
    V<Dim> from = line_.origin, way = line_.way;
    from[1] = way[1] = 0;
    const double speed = length2(way);
    const bool within = length2(from) <= radius * radius;
    if (speed > 0) {
        const double nearest = -dot(from, way) / speed;
        const double room = (radius * radius - length2(from + way * nearest)) / speed;
        if (!(room >= 0) && !within) return;
        const double half = std::sqrt(std::max(0.0, room));
        // A point that is inside by its distance is inside, whatever the root.
        inside.between(side, within ? -HUGE_VAL : nearest - half,
                       within ? std::max(0.0, nearest + half) : nearest + half);
        if (!inside.any()) return;
    } else if (!within) {
        return;
    }
    if (inside.through < 0) return hit_inside(part);
    V<Dim> normal;
    if (inside.through == side) {
        const V<Dim> out = from + way * inside.enter;
        const double size = length(out);
        normal = size > 0 ? out * (1 / size) : -line_.way;
    } else {
        normal[1] = inside.through == 0 ? 1 : -1;
    }
    hit(inside.enter, normal, part);
}

/// In axes in which it is a unit ball.
template <int Dim>
void Caster<Dim>::meet_ellipsoid(const Shape<Dim>& shape, std::uint32_t part)
{
    const V<Dim> half = load(ShapeAccess::size(shape));
    V<Dim> from, way;
    for (int d = 0; d < Dim; ++d) {
        if (!(half[d] > 1e-9 * ShapeAccess::reach(shape))) return meet_by_distance(shape, part); // flat
        from[d] = line_.origin[d] / half[d];
        way[d] = line_.way[d] / half[d];
    }
    if (length2(from) <= 1) return hit_inside(part);
    const double speed = length2(way), nearest = -dot(from, way) / speed;
    if (nearest < 0) return;
    const double room = (1 - length2(from + way * nearest)) / speed;
    if (!(room >= 0)) return;
    const double t = std::max(0.0, nearest - std::sqrt(room));
    V<Dim> normal = from + way * t;
    for (int d = 0; d < Dim; ++d)
        normal[d] /= half[d];
    hit(t, normal * (1 / length(normal)), part);
}

template <int Dim>
void Caster<Dim>::meet_box(const V<Dim>& half, std::uint32_t part)
{
    Inside inside;
    for (int d = 0; d < Dim; ++d)
        if (!inside.cut(2 * d, line_.origin[d] - half[d], line_.way[d]) ||
            !inside.cut(2 * d + 1, -line_.origin[d] - half[d], -line_.way[d]))
            return;
    if (inside.through < 0) return hit_inside(part);
    V<Dim> normal;
    normal[inside.through / 2] = inside.through % 2 == 0 ? 1 : -1;
    hit(inside.enter, normal, part);
}

template <int Dim>
void Caster<Dim>::meet_half_space(const V<Dim>& normal, double offset, std::uint32_t part)
{
    Inside inside;
    if (!inside.cut(0, dot(normal, line_.origin) - offset, dot(normal, line_.way))) return;
    if (inside.through < 0) return hit_inside(part);
    hit(inside.enter, normal, part);
}

/// Finds the first touch of a point that moves along the line with a convex shape, as in cast.cpp.
template <int Dim>
void Caster<Dim>::meet_by_distance(const Shape<Dim>& shape, std::uint32_t part)
{
    const Part<Dim> b(shape, {}, kernels_);
    V<Dim> normal;
    double t = 0;
    for (int step = 0;; ++step) {
        const Part<Dim> point(Shape<Dim>(), {{}, at(t)}, kernels_);
        Gap<Dim> gap;
        part_gap(point, b, HUGE_VAL, gap);
        double next = t;
        if (gap.distance > 0) {
            const double closing = dot(gap.normal, line_.way);
            if (!(closing > 0)) {
                // Shapes as thin as rounding errors are passed through, and on their rim the normal is noise:
                // the side that led here is hit.
                if (step > 0 && gap.distance <= rounding_at(shape)) hit(t, normal, part);
                return;
            }
            normal = -gap.normal;
            next = t + gap.distance / closing;
            if (!(next <= limit())) return;
        } else if (step == 0) {
            return hit_inside(part);
        }
        if (next > t && step < 100)
            t = next;
        else
            return hit(t, normal, part);
    }
}

/// The faces of a polyhedron, and whether a point in the plane of one is inside its border or within `near`
/// of it.
struct HullFaces
{
    const HullData<3>& data;
    const Polytope& hull = data.polytope;
    [[nodiscard]] bool sharp() const { return data.sharp; }
    [[nodiscard]] std::uint32_t count() const { return hull.faces; }
    [[nodiscard]] Vec3 normal(std::uint32_t f) const { return hull.normal(f); }
    [[nodiscard]] double height(std::uint32_t f, const Vec3& p) const
    {
        return dot(hull.normal(f), p) - hull.offset[f];
    }
    [[nodiscard]] bool holds(std::uint32_t f, const Vec3& p, double near) const
    {
        const Vec3 n = hull.normal(f); // projected along the axis nearest to it
        int along = std::abs(n.x) > std::abs(n.y) ? 0 : 1;
        if (std::abs(n.z) > std::abs(n[along])) along = 2;
        const int u = n[along] > 0 ? (along + 1) % 3 : (along + 2) % 3, v = 3 - along - u;
        const double *const x = hull.x + static_cast<std::size_t>(u) * hull.stride,
                            *const y = hull.x + static_cast<std::size_t>(v) * hull.stride;
        const std::uint32_t begin = data.loop_begin[f], end = data.loop_begin[f + 1];
        const std::uint32_t last = data.loop[end - 1];
        const Vec2 at{p[u], p[v]};
        Vec2 from{x[last], y[last]}, lo = from, hi = from;
        bool all = true;
        for (std::uint32_t k = begin; k < end; ++k) {
            const Vec2 to{x[data.loop[k]], y[data.loop[k]]}, side = to - from;
            all &= cross(side, at - to) >= -near * (std::abs(side.x) + std::abs(side.y));
            lo = {std::min(lo.x, to.x), std::min(lo.y, to.y)};
            hi = {std::max(hi.x, to.x), std::max(hi.y, to.y)};
            from = to;
        }
        // Past the tip of a face this thin, no side excludes the point.
        return all && at.x >= lo.x - near && at.y >= lo.y - near && at.x <= hi.x + near &&
               at.y <= hi.y + near;
    }
};
/// The sides of a polygon, the same way.
struct PolygonSides
{
    const HullData<2>& hull;
    [[nodiscard]] static bool sharp() { return true; } // holds() is cheap here
    [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(hull.loop.size()); }
    [[nodiscard]] Vec2 normal(std::uint32_t i) const { return hull.normal[i]; }
    [[nodiscard]] double height(std::uint32_t i, const Vec2& p) const
    {
        return dot(hull.normal[i], p - hull.loop[i]);
    }
    [[nodiscard]] bool holds(std::uint32_t i, const Vec2& p, double near) const
    {
        const Vec2 along = left(hull.normal[i]), to = hull.loop[i + 1 == count() ? 0 : i + 1];
        return dot(along, p - hull.loop[i]) >= -near && dot(along, p - to) <= near;
    }
};

/// Clips the line to the half-spaces of a hull's sides. These extend past a nearly flat hull: two of them
/// meet at a rim at an angle so small that rounding, or merged faces, determine where. So if the hull has a
/// sharp rim, the line must enter through a side itself, and also leave through one if it begins inside. If
/// it doesn't, distances decide.
template <int Dim>
template <class Hull>
void Caster<Dim>::meet_sides(const Hull& hull, const Shape<Dim>& shape, std::uint32_t part)
{
    // A line that meets the hull meets all half-spaces enlarged by rounding.
    const double rounding = rounding_at(shape);
    Inside inside;
    inside.enter = -HUGE_VAL;
    for (std::uint32_t i = 0; i < hull.count(); ++i)
        if (!inside.cut(static_cast<int>(i), hull.height(i, line_.origin) - rounding,
                        dot(hull.normal(i), line_.way)))
            return;
    const std::uint32_t side = static_cast<std::uint32_t>(inside.through);
    const auto passes = [&](std::uint32_t through, double t) {
        return !hull.sharp() || hull.holds(through, at(t), 256 * rounding);
    };
    if (inside.enter > 0) {
        const V<Dim> n = hull.normal(side);
        const double t = std::max(0.0, -hull.height(side, line_.origin) / dot(n, line_.way));
        if (passes(side, t)) return hit(t, n, part);
    } else if (!hull.sharp()) {
        return hit_inside(part);
    } else if (inside.through >= 0 && passes(side, inside.enter)) {
        for (std::uint32_t i = 0; i < hull.count(); ++i) {
            const double rise = dot(hull.normal(i), line_.way);
            if (rise > 0 && -(hull.height(i, line_.origin) - rounding) / rise == inside.leave &&
                passes(i, inside.leave))
                return hit_inside(part);
        }
    }
    meet_by_distance(shape, part);
}

template <int Dim>
void Caster<Dim>::meet_hull(const Shape<Dim>& shape, std::uint32_t part)
{
    const HullData<Dim>& data = ShapeAccess::data<HullData<Dim>>(shape);
    if constexpr (Dim == 3) { // flat or straight hulls and points have no half-spaces
        data.polytope.offset == nullptr ? meet_by_distance(shape, part)
                                        : meet_sides(HullFaces{data}, shape, part);
    } else {
        data.loop.size() < 3 ? meet_by_distance(shape, part) : meet_sides(PolygonSides{data}, shape, part);
    }
}

/// Triangles seen along a line: sheared so that it runs along an axis. Two triangles compute the same for a
/// shared edge, so no line slips through between them. Source: Woop, Benthin, Wald 2013.
class Sheared
{
  public:
    explicit Sheared(const Line<3>& line) : line_(line)
    {
        for (int d = 1; d < 3; ++d)
            if (std::abs(line.way[d]) > std::abs(line.way[z_])) z_ = d;
        x_ = (z_ + 1) % 3;
        y_ = (z_ + 2) % 3;
        shear_x_ = line.way[x_] / line.way[z_];
        shear_y_ = line.way[y_] / line.way[z_];
        scale_ = 1 / line.way[z_];
    }
    /// Returns where the infinite line meets a triangle; NaN if nowhere.
    [[nodiscard]] double meet(const Vec3& a, const Vec3& b, const Vec3& c) const
    {
        const Vec3 p = seen(a), q = seen(b), r = seen(c);
        const double u = r.x * q.y - r.y * q.x, v = p.x * r.y - p.y * r.x, w = q.x * p.y - q.y * p.x;
        if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return NAN;
        const double sum = u + v + w;
        if (sum == 0) return NAN; // edge-on
        return (u * p.z + v * q.z + w * r.z) / sum;
    }

  private:
    [[nodiscard]] Vec3 seen(const Vec3& p) const
    {
        const Vec3 from = p - line_.origin;
        return {from[x_] - shear_x_ * from[z_], from[y_] - shear_y_ * from[z_], scale_ * from[z_]};
    }
    const Line<3>& line_;
    int x_, y_, z_ = 0;
    double shear_x_, shear_y_, scale_;
};

struct Chain
{
    explicit Chain(const Line<2>& line) : line_(line) {}
    /// Where the infinite line meets a segment, the last place if it runs along it; NaN if nowhere.
    [[nodiscard]] double meet(const Vec2& a, const Vec2& b) const
    {
        const Vec2 p = a - line_.origin, q = b - line_.origin;
        const double side_p = cross(line_.way, p), side_q = cross(line_.way, q);
        const double along_p = dot(line_.way, p), along_q = dot(line_.way, q);
        if ((side_p < 0 && side_q < 0) || (side_p > 0 && side_q > 0)) return NAN;
        if (side_p == side_q) { // both are 0
            const double first = std::min(along_p, along_q), last = std::max(along_p, along_q);
            return last < 0 ? last : std::max(0.0, first);
        }
        return (along_p * side_q - along_q * side_p) / (side_q - side_p);
    }

  private:
    const Line<2>& line_;
};

/// Visits the leaves, enlarged by `grow`, that the line meets no later than its nearest hit, nearest first.
template <int Dim>
template <class Visit>
void Caster<Dim>::for_each_leaf_on_line(const std::vector<TreeNode>& nodes, double grow,
                                        const Visit& visit) const
{
    double inverse[Dim];
    for (int d = 0; d < Dim; ++d)
        inverse[d] = line_.way[d] == 0 ? 0 : 1 / line_.way[d];
    /// When the line enters a box; NaN if it doesn't, or too late.
    const auto enters = [&](const TreeNode& node) {
        double enter = 0, leave = limit();
        for (int d = 0; d < Dim; ++d) {
            const double lo = node.lo[d] - grow - line_.origin[d], hi = node.hi[d] + grow - line_.origin[d];
            if (inverse[d] == 0) {
                if (lo > 0 || hi < 0) return double{NAN};
                continue;
            }
            const double one = lo * inverse[d], other = hi * inverse[d];
            enter = std::max(enter, std::min(one, other));
            leave = std::min(leave, std::max(one, other));
        }
        return enter <= leave * (1 + 1e-15) ? enter : double{NAN};
    };
    for_each_leaf_by(enters, [this] { return limit(); }, nodes, visit);
}

template <int Dim>
void Caster<Dim>::meet_mesh(const MeshData<Dim>& mesh)
{
    const std::conditional_t<Dim == 3, Sheared, Chain> seen(line_);
    // A tolerance for the rounding of a triangle's test: boxes count as slightly larger.
    double size = 0;
    for (int d = 0; d < Dim; ++d)
        size = std::max(size, std::max(std::abs(line_.origin[d]), std::max(std::abs(mesh.nodes[0].lo[d]),
                                                                           std::abs(mesh.nodes[0].hi[d]))));
    const double grow = 8e-16 * size;
    for_each_leaf_on_line(mesh.nodes, grow, [&](const TreeNode& node) {
        for (std::uint32_t i = 0; i < node.count; ++i) {
            const std::uint32_t e = mesh.order[node.first + i];
            const auto& corner = mesh.elements[e];
            const V<Dim>&p = mesh.vertices[corner[0]], &q = mesh.vertices[corner[1]];
            double t;
            V<Dim> n;
            if constexpr (Dim == 3) {
                const Vec3& r = mesh.vertices[corner[2]];
                t = seen.meet(p, q, r);
                n = cross(q - p, r - p);
            } else {
                t = seen.meet(p, q);
                n = right(q - p);
            }
            if (!(t >= 0 && t <= limit())) continue;
            if (t == best.at && e > best.part) continue; // of equals the lowest number counts
            const double breadth = length(n), facing = dot(n, line_.way);
            best = {t, breadth > 0 && facing != 0 ? n * ((facing < 0 ? 1 : -1) / breadth) : -line_.way, e};
        }
    });
}

/// The ground below each triangle is a prism. Sides shared by two prisms are no surface: a line that seems to
/// enter through one has passed the edge above it.
template <int Dim>
void Caster<Dim>::meet_heights(const HeightData& field)
{
    if constexpr (Dim == 3) {
        const Vec3& from = line_.origin;
        Region<3> region{{from.x, from.y, from.z}, {from.x, from.y, from.z}, line_.way};
        Range<3> range{1e-14 * (field.reach + length(from)), {}, line_.most};
        const double last_x = (field.columns - 1) * field.spacing_x,
                     last_z = (field.rows - 1) * field.spacing_z;
        for_each_triangle(field, region, range, [&](std::uint32_t number, const Mesh<3>::Element& corners) {
            Vec3 corner[3];
            for (std::size_t i = 0; i < 3; ++i)
                corner[i] = field.vertex(corners[i]);
            Vec3 up = cross(corner[1] - corner[0], corner[2] - corner[0]);
            const double turn = up.y > 0 ? 1 : -1;
            up = up * (turn / length(up));
            constexpr int top = 3, bottom = 4;
            Inside inside;
            if (!inside.cut(top, dot(up, from - corner[0]), dot(up, line_.way)) ||
                !inside.cut(bottom, field.floor - from.y, -line_.way.y))
                return;
            Vec3 out[3];
            for (std::size_t i = 0; i < 3; ++i) {
                const std::size_t after = i == 2 ? 0 : i + 1;
                // A side's two corners come in one order, for either triangle.
                const bool ordered = corners[i] < corners[after];
                const Vec3 &p = corner[ordered ? i : after], &q = corner[ordered ? after : i];
                const double sign = ordered ? turn : -turn;
                out[i] = Vec3{q.z - p.z, 0, p.x - q.x} * -sign;
                const Vec3 away = from - p;
                if (!inside.cut(static_cast<int>(i), out[i].x * away.x + out[i].z * away.z,
                                out[i].x * line_.way.x + out[i].z * line_.way.z))
                    return;
            }
            if (inside.through < 0) {
                hit_inside(number);
            } else if (inside.through == bottom) {
                hit(inside.enter, {0, -1, 0}, number);
            } else if (inside.through == top) {
                hit(inside.enter, up, number);
            } else {
                const std::size_t i = static_cast<std::size_t>(inside.through), after = i == 2 ? 0 : i + 1;
                const Vec3 &p = corner[i], &q = corner[after];
                const bool rim = (p.x == q.x && (p.x == 0 || p.x == last_x)) ||
                                 (p.z == q.z && (p.z == 0 || p.z == last_z));
                hit(inside.enter, rim ? out[i] * (1 / length(out[i])) : up, number);
            }
            if (best.at < range.time) range.time = best.at;
        });
    }
}

template <int Dim>
void Caster<Dim>::meet_compound(const CompoundData<Dim>& compound)
{
    // Some shapes are hit from a billionth of their size.
    const double grow = 4e-9 * (compound.extent + length(line_.origin));
    for_each_leaf_on_line(compound.nodes, grow, [&](const TreeNode& node) {
        for (std::uint32_t i = 0; i < node.count; ++i) {
            const std::uint32_t number = compound.order[node.first + i];
            const auto& child = compound.children[number];
            const Line<Dim> seen{child.frame.r.back(line_.origin - child.frame.p),
                                 child.frame.r.back(line_.way), limit()};
            Caster caster(seen, kernels_);
            caster.meet(child.shape, number);
            const Strike<Dim>& strike = caster.best;
            if (!(strike.at < best.at || (strike.at == best.at && number < best.part))) continue;
            best = {strike.at, child.frame.r * strike.normal, number};
        }
    });
}

template <int Dim>
void Caster<Dim>::meet(const Shape<Dim>& shape, std::uint32_t part)
{
    const V<Dim> size = load(ShapeAccess::size(shape));
    const double radius = ShapeAccess::radius(shape);
    switch (kind_of(shape)) {
    case Kind::sphere:
        return meet_ball({}, radius, part);
    case Kind::capsule:
        return meet_capsule(size[1], radius, part);
    case Kind::box:
        return meet_box(size, part);
    case Kind::convex:
        return meet_hull(shape, part);
    case Kind::half_space:
        return meet_half_space(size, shape.offset(), part);
    case Kind::mesh:
        return meet_mesh(ShapeAccess::data<MeshData<Dim>>(shape));
    case Kind::height_field:
        if constexpr (Dim == 3) meet_heights(ShapeAccess::data<HeightData>(shape));
        return;
    case Kind::compound:
        return meet_compound(ShapeAccess::data<CompoundData<Dim>>(shape));
    case Kind::cylinder:
        if constexpr (Dim == 3) meet_cylinder(size[1], size[0], part);
        return;
    case Kind::ellipsoid:
        return meet_ellipsoid(shape, part);
    case Kind::rounded_box:
    case Kind::rounded_hull:
    case Kind::cone:
        return meet_by_distance(shape, part);
    case Kind::custom:
        if (has_part(shape)) meet_by_distance(shape, part);
    }
}

} // namespace

template <int Dim>
Strike<Dim> find_strike(const Shape<Dim>& shape, const M<Dim>& turn, const Line<Dim>& line,
                        const Kernels& kernels)
{
    // Only the part of the line in the shape's ball is tested, so no length is infinite. From far away the
    // line begins there, so that squares lose no digits.
    Line<Dim> near = line;
    double skipped = 0;
    if (const double reach = ShapeAccess::reach(shape); reach < HUGE_VAL) {
        const double nearest = -dot(line.origin, line.way), size = length(line.origin);
        const double ball = reach * (1 + 1e-12) + 1e-14 * size;
        const double room = ball * ball - length2(line.origin + line.way * nearest);
        if (!(room >= 0)) return {};
        const double half = std::sqrt(room) * (1 + 1e-12);
        if (!(nearest + half >= 0)) return {};
        if (nearest - half > 8 * reach) skipped = std::min(nearest - half, line.most);
        near.origin = line.origin + line.way * skipped;
        near.most = std::min(line.most, nearest + half) - skipped;
        if (!(near.most >= 0)) return {};
    }
    near.origin = turn.back(near.origin);
    near.way = turn.back(near.way);
    Caster<Dim> caster(near, kernels);
    caster.meet(shape, 0);
    Strike<Dim> strike = caster.best;
    if (strike.at == HUGE_VAL) return strike;
    strike.at += skipped;
    strike.normal = turn * strike.normal;
    return strike;
}
template Strike<2> find_strike(const Shape<2>&, const Mat2&, const Line<2>&, const Kernels&);
template Strike<3> find_strike(const Shape<3>&, const Mat3&, const Line<3>&, const Kernels&);

} // namespace narrow
JOSTLE_NAMESPACE_END
