// SPDX-License-Identifier: MIT
#include "narrow/convex3.hpp"

#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

// ---- Topology of the simple cores

// Vertex i of a box has sign bit d of i set where coordinate d is positive.
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

} // namespace

Core3::Core3(const Shape<3>& shape, const Frame<3>& where, const Kernels& with)
    : frame(where),
      radius(ShapeAccess::radius(shape)),
      reach(ShapeAccess::reach(shape) - radius),
      kernels(&with)
{
    const Vec<3, double>& size = ShapeAccess::size(shape);
    polytope.x = coordinates_;
    polytope.stride = lanes;
    switch (shape.type()) {
    case ShapeTypes::sphere:
        polytope.vertices = 1;
        for (double& c : coordinates_)
            c = 0;
        break;
    case ShapeTypes::capsule:
        polytope.vertices = 2;
        for (std::uint32_t i = 0; i < lanes; ++i)
            put(coordinates_, i, {0, i == 1 ? size[1] : -size[1], 0});
        polytope.edge = box_edge; // 0 to 1
        polytope.edges = 1;
        polytope.direction = axes + 1;
        polytope.directions = 1;
        break;
    case ShapeTypes::box:
        set_box(size);
        break;
    case ShapeTypes::convex:
        polytope = ShapeAccess::data<HullData<3>>(shape).polytope;
        break;
    default:
        custom = shape.custom();
        break;
    }
}

/// A box without extent along some axes is a rectangle, a segment or a point: a face without area would have
/// sides that cut nothing off.
void Core3::set_box(const Vec<3, double>& half)
{
    int wide[3], count = 0;
    for (int d = 0; d < 3; ++d)
        if (half[static_cast<std::size_t>(d)] > 0) wide[count++] = d;
    const std::uint32_t corners = 1u << count;
    polytope.vertices = corners;
    for (std::uint32_t i = 0; i < lanes; ++i) {
        Vec3 p;
        const std::uint32_t corner = i < corners ? i : 0;
        for (int k = 0; k < count; ++k) {
            const double h = half[static_cast<std::size_t>(wide[k])];
            p[wide[k]] = (corner >> k & 1) != 0 ? h : -h;
        }
        put(coordinates_, i, p);
    }
    polytope.edge = box_edge;
    polytope.edges = count == 3 ? 12 : count == 2 ? 4 : static_cast<std::uint32_t>(count);
    for (int k = 0; k < count; ++k)
        directions_[k] = axes[wide[k]];
    polytope.direction = directions_;
    polytope.directions = static_cast<std::uint32_t>(count);
    is_box = count == 3;
    if (count == 3) {
        polytope.faces = 6;
        polytope.nx = box_normals;
        polytope.face_stride = lanes;
        for (std::uint32_t f = 0; f < lanes; ++f)
            offsets_[f] = half[f < 6 ? f / 2 : 0];
        polytope.offset = offsets_;
        polytope.loop_begin = box_loop_begin;
        polytope.loop = box_loop;
    } else if (count == 2) {
        // Corner 0 to 1 runs along the first axis, 0 to 2 along the second.
        const Vec3 n = cross(axes[wide[0]], axes[wide[1]]);
        for (int d = 0; d < 3; ++d)
            normals_[2 * d] = n[d], normals_[2 * d + 1] = -n[d];
        polytope.faces = 2;
        polytope.nx = normals_;
        polytope.face_stride = 2;
        polytope.loop_begin = rectangle_loop_begin;
        polytope.loop = rectangle_loop;
        polytope.edge = rectangle_edge;
    }
}

Core3::Core3(const Vec3& a, const Vec3& b, const Vec3& c, const Frame<3>& where, const Kernels& with)
    : frame(where), reach(std::sqrt(std::max({length2(a), length2(b), length2(c)}))), kernels(&with)
{
    polytope.x = coordinates_;
    polytope.stride = lanes;
    polytope.vertices = 3;
    put(coordinates_, 1, b);
    put(coordinates_, 2, c);
    for (const std::uint32_t i : {0u, 3u, 4u, 5u, 6u, 7u})
        put(coordinates_, i, a);
    polytope.edge = triangle_edge;
    polytope.edges = 3;
    polytope.direction = directions_;
    const Vec3 corner[] = {a, b, c};
    for (std::uint32_t i = 0; i < 3; ++i) // of any length: only who tries edges asks for their directions
        directions_[i] = corner[(i + 1) % 3] - corner[i];
    polytope.directions = 3;
    const Vec3 n = cross(b - a, c - a);
    const double size = length(n);
    // Thinner than this and the normal is noise: then it is a segment.
    const double widest = std::max({length2(b - a), length2(c - b), length2(a - c)});
    if (size > 1e-13 * widest) {
        const Vec3 unit = n * (1 / size);
        for (int d = 0; d < 3; ++d) {
            normals_[2 * d] = unit[d];
            normals_[2 * d + 1] = -unit[d];
        }
        polytope.faces = 2;
        polytope.nx = normals_;
        polytope.face_stride = 2;
        polytope.loop_begin = triangle_loop_begin;
        polytope.loop = triangle_loop;
    }
}

namespace {

struct Support
{
    std::uint32_t vertex;
    Vec3 p; ///< as seen from a's position
};

Support support(const Core3& core, const Vec3& direction)
{
    const Vec3 d = core.frame.r.back(direction);
    if (core.custom != nullptr) return {0, core.frame * load(core.custom->support({d.x, d.y, d.z}))};
    const Polytope& hull = core.polytope;
    std::uint32_t best = 0;
    if (hull.vertices > 3) {
        best = core.kernels->furthest(hull.x, hull.stride, d.x, d.y, d.z);
    } else {
        double most = -HUGE_VAL;
        for (std::uint32_t i = 0; i < hull.vertices; ++i) {
            const double h = dot(d, hull.vertex(i));
            if (h > most) most = h, best = i;
        }
    }
    return {best, core.frame * hull.vertex(best)};
}

// ---- GJK

struct SimplexPoint
{
    Vec3 w, a, b; ///< w = a - b
    std::uint32_t ia, ib;
};
struct Simplex
{
    SimplexPoint point[4];
    double weight[4];
    int count = 0;
};

void keep(Simplex& s, std::initializer_list<int> which, std::initializer_list<double> weights)
{
    SimplexPoint kept[4];
    int n = 0;
    for (const int i : which)
        kept[n++] = s.point[i];
    for (int i = 0; i < n; ++i)
        s.point[i] = kept[i];
    n = 0;
    for (const double w : weights)
        s.weight[n++] = w;
    s.count = n;
}

void closest_on_segment(Simplex& s)
{
    const Vec3 a = s.point[0].w, ab = s.point[1].w - a;
    const double t = -dot(a, ab), size = length2(ab);
    if (t <= 0 || size == 0)
        keep(s, {0}, {1});
    else if (t >= size)
        keep(s, {1}, {1});
    else
        s.weight[1] = t / size, s.weight[0] = 1 - s.weight[1];
}

/// Ericson sec. 5.1.5, for the origin.
void closest_on_triangle(Simplex& s)
{
    const Vec3 a = s.point[0].w, b = s.point[1].w, c = s.point[2].w;
    const Vec3 ab = b - a, ac = c - a;
    const double d1 = -dot(ab, a), d2 = -dot(ac, a);
    if (d1 <= 0 && d2 <= 0) return keep(s, {0}, {1});
    const double d3 = -dot(ab, b), d4 = -dot(ac, b);
    if (d3 >= 0 && d4 <= d3) return keep(s, {1}, {1});
    const double d5 = -dot(ab, c), d6 = -dot(ac, c);
    if (d6 >= 0 && d5 <= d6) return keep(s, {2}, {1});
    const Vec3 n = cross(ab, ac);
    // The signed areas as the origin sees them; as triple products, which lose less than d1 * d4 - d3 * d2.
    const double vc = dot(n, cross(a, b)), va = dot(n, cross(b, c)), vb = dot(n, cross(c, a));
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        const double t = d1 / (d1 - d3);
        return keep(s, {0, 1}, {1 - t, t});
    }
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        const double t = d2 / (d2 - d6);
        return keep(s, {0, 2}, {1 - t, t});
    }
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return keep(s, {1, 2}, {1 - t, t});
    }
    const double sum = va + vb + vc;
    if (!(sum > 0)) { // no area
        s.count = 2;
        return closest_on_segment(s);
    }
    s.weight[0] = va / sum, s.weight[1] = vb / sum, s.weight[2] = vc / sum;
}

Vec3 position(const Simplex& s)
{
    Vec3 v;
    for (int i = 0; i < s.count; ++i)
        v += s.point[i].w * s.weight[i];
    return v;
}

/// Returns true if the origin is inside, unless the caller knows that it isn't.
bool closest_on_tetrahedron(Simplex& s, bool surely_outside = false)
{
    static constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}};
    Simplex best;
    double least = HUGE_VAL;
    bool outside = false;
    for (const auto& face : faces) {
        const Vec3 a = s.point[face[0]].w;
        const Vec3 n = cross(s.point[face[1]].w - a, s.point[face[2]].w - a);
        const double origin = -dot(a, n), other = dot(s.point[face[3]].w - a, n);
        // On the inner side; but a flat tetrahedron has no inside, whatever rounding says.
        if (!surely_outside && origin * other > 0 &&
            other * other > 1e-24 * length2(n) * length2(s.point[face[3]].w - a))
            continue;
        outside = true;
        Simplex candidate;
        candidate.count = 3;
        for (int i = 0; i < 3; ++i)
            candidate.point[i] = s.point[face[i]];
        closest_on_triangle(candidate);
        const double distance = length2(position(candidate));
        if (distance < least) least = distance, best = candidate;
    }
    if (outside) s = best;
    return !outside;
}

enum class Verdict
{
    apart,   ///< the gap is complete, or infinite where it is more than enough
    overlap, ///< or they touch, as well as doubles can tell
    unclear  ///< the steps allowed weren't enough
};
constexpr int all_steps = 100; ///< then rounding is all that is left

/// b is looked at moved by `shift`; the gap's points are where they are without. Where they aren't apart
/// gap.normal is the direction in which they overlap least of those tried.
Verdict gjk(const Core3& a, const Core3& b, const Vec3& shift, double enough, int most_steps, Simplex& s,
            Gap<3>& gap)
{
    Vec3 v = a.frame.p - b.frame.p - shift;
    if (length2(v) == 0) v = {1, 0, 0};
    double least = HUGE_VAL, extent = 0;
    Vec3 on_a, on_b;
    s.count = 0;
    double widest = -HUGE_VAL;
    for (int step = 0; step < all_steps; ++step) {
        if (step == most_steps) return Verdict::unclear;
        const Support pa = support(a, -v), pb = support(b, v);
        const SimplexPoint w{pa.p - (pb.p + shift), pa.p, pb.p, pa.vertex, pb.vertex};
        extent = std::max(extent, length2(w.w));
        const double along = dot(v, w.w), size = length2(v);
        if (along > 0 && along * along > enough * enough * size) {
            gap.distance = HUGE_VAL;
            return Verdict::apart;
        }
        const double inverse = 1 / std::sqrt(size);
        if (along * inverse > widest) {
            widest = along * inverse;
            gap.normal = v * -inverse;
        }
        if (step > 0) {
            // v . w / |v| is a lower bound of the distance, |v| an upper one.
            bool done = size - along <= 1e-14 * size;
            for (int i = 0; i < s.count; ++i)
                done = done || (a.custom == nullptr && b.custom == nullptr && s.point[i].ia == w.ia &&
                                s.point[i].ib == w.ib);
            if (done) break;
        }
        s.point[s.count] = w;
        s.weight[s.count] = 1;
        ++s.count;
        if (s.count == 2)
            closest_on_segment(s);
        else if (s.count == 3)
            closest_on_triangle(s);
        else if (s.count == 4 && closest_on_tetrahedron(s)) {
            // A smooth shape's points lie so close that rounding can say so of shapes that a plane parts.
            if (!(widest > 0 && widest * widest > 1e-24 * extent)) return Verdict::overlap;
            closest_on_tetrahedron(s, true);
        }
        const Vec3 next = position(s);
        const double next_size = length2(next);
        if (next_size <= 1e-26 * extent) return Verdict::overlap;
        if (!(next_size < least)) break; // rounding: the last one was the best
        least = next_size;
        v = next;
        on_a = on_b = {};
        for (int i = 0; i < s.count; ++i) {
            on_a += s.point[i].a * s.weight[i];
            on_b += s.point[i].b * s.weight[i];
        }
    }
    const double distance = length(v);
    // A gap this small has a direction of few digits: the overlap's is better.
    if (distance <= 1e-9 * std::sqrt(extent)) return Verdict::overlap;
    gap.distance = distance;
    gap.normal = v * (-1 / distance);
    gap.on_a = on_a;
    gap.on_b = on_b;
    return Verdict::apart;
}

// ---- The expanding polytope

class Expansion
{
  public:
    Expansion(const Core3& a, const Core3& b) : a_(a), b_(b) {}

    /// Returns false where the difference of the two cores has no volume.
    bool start(const Simplex& simplex)
    {
        for (int i = 0; i < simplex.count; ++i) {
            extent_ = std::max(extent_, length(simplex.point[i].w));
            points_.push_back(simplex.point[i]);
        }
        static const Vec3 tries[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
        const std::size_t known = points_.size();
        for (const Vec3& direction : tries)
            extent_ = std::max(extent_, length(ask(direction).w));
        // From the first point: the simplex again, as far as it has full size, and what is missing.
        const SmallVector<SimplexPoint, 64> given(points_);
        points_.clear();
        const auto take = [&](auto&& measure, auto&& directions) {
            const double least = 1e-10 * extent_;
            for (std::size_t i = 0; i < known; ++i)
                if (measure(given[i].w) > least) return points_.push_back(given[i]), true;
            SimplexPoint best{};
            double most = least;
            for (const Vec3& direction : directions) {
                const SimplexPoint w = ask(direction);
                if (const double m = measure(w.w); m > most) most = m, best = w;
            }
            if (most > least) points_.push_back(best);
            return most > least;
        };
        points_.push_back(given[0]);
        const Vec3 p0 = given[0].w;
        if (!take([&](const Vec3& w) { return length(w - p0); }, tries)) return flat({0, 1, 0});
        Vec3 line = points_[1].w - p0;
        line = line * (1 / length(line));
        Vec3 u, v;
        basis(line, u, v);
        const Vec3 around[] = {u, v, -u, -v, u + v, -u - v, u - v, v - u};
        if (!take([&](const Vec3& w) { return length(cross(w - p0, line)); }, around)) return flat(u);
        Vec3 n = cross(line, points_[2].w - p0);
        n = n * (1 / length(n));
        const Vec3 across[] = {n, -n};
        if (!take([&](const Vec3& w) { return std::abs(dot(w - p0, n)); }, across)) return flat(n);
        std::uint32_t s[4] = {0, 1, 2, 3};
        if (dot(n, points_[3].w - p0) > 0) std::swap(s[1], s[2]);
        add(s[0], s[1], s[2]);
        add(s[0], s[3], s[1]);
        add(s[1], s[3], s[2]);
        add(s[2], s[3], s[0]);
        static constexpr std::uint32_t beside[4][3] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
        for (std::uint32_t f = 0; f < 4; ++f)
            for (int i = 0; i < 3; ++i)
                faces_[f].beside[i] = beside[f][i];
        return true;
    }

    void run()
    {
        const bool smooth = a_.custom != nullptr || b_.custom != nullptr;
        const double enough = (smooth ? 1e-8 : 1e-12) * extent_;
        const int most_steps = smooth ? 64 : 1000;
        // How far the cores reach into each other along a face's normal is never less than the depth; the
        // nearest face's offset is never more.
        depth = HUGE_VAL;
        for (int step = 0; step < most_steps; ++step) {
            std::uint32_t nearest = 0;
            double least = HUGE_VAL;
            for (std::uint32_t f = 0; f < offsets_.size(); ++f)
                if (offsets_[f] < least) least = offsets_[f], nearest = f;
            if (least == HUGE_VAL) break;
            const Vec3 n = faces_[nearest].normal;
            const SimplexPoint w = ask(n);
            const double reach = dot(n, w.w);
            if (reach < depth) depth = reach, normal = n;
            if (depth - least <= enough || reach - least <= enough || !grow(nearest, w)) break;
        }
        if (depth == HUGE_VAL) depth = 0;
    }
    Vec3 normal{0, 1, 0};
    double depth = 0;

  private:
    struct Face
    {
        std::uint32_t v[3], beside[3]; // beside[i] across the side from v[i] to v[i + 1]
        std::uint32_t round;
        Vec3 normal;
    };
    struct Side
    {
        std::uint32_t a, b, beyond;
    };

    [[nodiscard]] SimplexPoint ask(const Vec3& direction) const
    {
        const Support pa = support(a_, direction), pb = support(b_, -direction);
        return {pa.p - pb.p, pa.p, pb.p, pa.vertex, pb.vertex};
    }
    bool flat(const Vec3& n)
    {
        normal = n;
        return false;
    }
    std::uint32_t add(std::uint32_t i, std::uint32_t j, std::uint32_t k)
    {
        std::uint32_t f = static_cast<std::uint32_t>(faces_.size());
        if (free_ < patch_.size()) {
            f = patch_[free_++]; // in the place of one that went
        } else {
            faces_.push_back({});
            offsets_.push_back(HUGE_VAL);
        }
        Face& face = faces_[f];
        face.v[0] = i, face.v[1] = j, face.v[2] = k;
        face.round = 0;
        const Vec3 p = points_[i].w, n = cross(points_[j].w - p, points_[k].w - p);
        const double size = length(n);
        if (size > 1e-16 * extent_ * extent_) {
            face.normal = n * (1 / size);
            offsets_[f] = dot(face.normal, p);
        } else { // a sliver is never the nearest; its neighbours say the same
            face.normal = {};
            offsets_[f] = HUGE_VAL;
        }
        return f;
    }
    /// Returns false where rounding has left no closed surface.
    bool grow(std::uint32_t from, const SimplexPoint& w)
    {
        points_.push_back(w);
        const std::uint32_t apex = static_cast<std::uint32_t>(points_.size() - 1);
        patch_.clear();
        horizon_.clear();
        made_.clear();
        patch_.push_back(from);
        faces_[from].round = ++round_;
        for (std::size_t k = 0; k < patch_.size(); ++k) {
            const Face& face = faces_[patch_[k]];
            for (int i = 0; i < 3; ++i) {
                const std::uint32_t f = face.beside[i];
                Face& next = faces_[f];
                if (next.round == round_) continue;
                if (offsets_[f] == HUGE_VAL || dot(next.normal, w.w) - offsets_[f] > 1e-14 * extent_) {
                    next.round = round_;
                    patch_.push_back(f);
                }
            }
        }
        for (std::size_t k = 0; k < patch_.size(); ++k) {
            const Face& face = faces_[patch_[k]];
            offsets_[patch_[k]] = HUGE_VAL;
            for (int i = 0; i < 3; ++i)
                if (faces_[face.beside[i]].round != round_)
                    horizon_.push_back({face.v[i], face.v[(i + 1) % 3], face.beside[i]});
        }
        free_ = 0;
        for (std::size_t k = 0; k < horizon_.size(); ++k) {
            const Side side = horizon_[k];
            const std::uint32_t f = add(side.a, side.b, apex);
            faces_[f].beside[0] = side.beyond;
            made_.push_back(f);
            Face& beyond = faces_[side.beyond];
            for (int i = 0; i < 3; ++i)
                if (beyond.v[i] == side.b && beyond.v[(i + 1) % 3] == side.a) beyond.beside[i] = f;
        }
        free_ = patch_.size();
        std::size_t joined = 0;
        for (std::size_t k = 0; k < made_.size(); ++k)
            for (std::size_t l = 0; l < made_.size(); ++l)
                if (horizon_[k].b == horizon_[l].a) {
                    faces_[made_[k]].beside[1] = made_[l];
                    faces_[made_[l]].beside[2] = made_[k];
                    ++joined;
                }
        return joined == made_.size() && joined >= 3;
    }

    const Core3& a_;
    const Core3& b_;
    double extent_ = 0;
    SmallVector<SimplexPoint, 64> points_;
    SmallVector<Face, 128> faces_;
    SmallVector<double, 128> offsets_; ///< of each face's plane; infinite where a place is empty
    SmallVector<std::uint32_t, 64> patch_, made_;
    std::size_t free_ = 0; ///< of patch_, how many places have new faces
    SmallVector<Side, 64> horizon_;
    std::uint32_t round_ = 0;
};

// ---- Separating axes

struct Range
{
    double lo, hi;
};
Range range(const Core3& core, const Vec3& axis)
{
    const Vec3 d = core.frame.r.back(axis);
    const Polytope& hull = core.polytope;
    Range r{HUGE_VAL, -HUGE_VAL};
    for (std::uint32_t i = 0; i < hull.vertices; ++i) {
        const double h = d.x * hull.x[i] + d.y * hull.x[hull.stride + i] + d.z * hull.x[2 * hull.stride + i];
        r.lo = std::min(r.lo, h);
        r.hi = std::max(r.hi, h);
    }
    const double shift = dot(axis, core.frame.p);
    return {r.lo + shift, r.hi + shift};
}

struct Axis
{
    Vec3 normal;
    double separation = -HUGE_VAL;
};
void consider(Axis& best, const Core3& a, const Core3& b, const Vec3& n, bool both, double advantage)
{
    const Range ra = range(a, n), rb = range(b, n);
    const double forth = rb.lo - ra.hi, back = ra.lo - rb.hi;
    if (forth > best.separation + advantage) best = {n, forth};
    if (both && back > best.separation + advantage) best = {-n, back};
}

Axis best_axis(const Core3& a, const Core3& b)
{
    Axis best;
    for (std::uint32_t f = 0; f < a.polytope.faces; ++f)
        consider(best, a, b, a.frame.r * a.polytope.normal(f), false, 0);
    for (std::uint32_t f = 0; f < b.polytope.faces; ++f)
        consider(best, a, b, -(b.frame.r * b.polytope.normal(f)), false, 0);
    // Edges have to be better by more than rounding, or parallel faces would meet along noise.
    const double advantage = 1e-10 * (a.reach + b.reach);
    for (std::uint32_t i = 0; i < a.polytope.directions; ++i) {
        const Vec3 da = a.frame.r * a.polytope.direction[i];
        for (std::uint32_t j = 0; j < b.polytope.directions; ++j) {
            const Vec3 db = b.frame.r * b.polytope.direction[j], n = cross(da, db);
            const double size = length(n);
            // Parallel: a face's normal or another edge says it better.
            if (!(size * size > 1e-14 * length2(da) * length2(db))) continue;
            consider(best, a, b, n * (1 / size), true, advantage);
        }
    }
    if (best.separation == -HUGE_VAL) {
        // Points and parallel segments, in one place: any direction across.
        Vec3 n{0, 1, 0}, other, along;
        for (const Core3* core : {&a, &b})
            for (std::uint32_t i = 0; i < core->polytope.directions; ++i)
                if (const Vec3 d = core->frame.r * core->polytope.direction[i]; length2(d) > length2(along))
                    along = d;
        if (length2(along) > 0) basis(along * (1 / length(along)), n, other);
        consider(best, a, b, n, true, 0);
    }
    return best;
}

// ---- Features and clipping

/// What of a core faces a direction: a face, an edge or a vertex.
struct Feature
{
    SmallVector<Vec3, 16> point;
    SmallVector<std::uint32_t, 16> vertex;
    Vec3 normal; ///< of a face
    std::uint32_t id = 0;
    std::uint16_t kind = vertex_feature;
};

/// The face that looks most into `direction`, in local axes.
std::uint32_t best_face(const Polytope& hull, const Kernels& kernels, const Vec3& d, double& alignment)
{
    alignment = -HUGE_VAL;
    std::uint32_t best = 0;
    if (hull.faces > 2) {
        best = kernels.furthest(hull.nx, hull.face_stride, d.x, d.y, d.z);
        alignment = dot(d, hull.normal(best));
    } else {
        for (std::uint32_t f = 0; f < hull.faces; ++f)
            if (const double along = dot(d, hull.normal(f)); along > alignment) alignment = along, best = f;
    }
    return best;
}

// No contact appears or vanishes by these: they choose which features give its points, and the depth of each
// point is exact along the normal. What the choice must bear is a solver's restlessness: a body that settles
// tilts by a few tenths of a degree from step to step.
// A face's own normal, and those that GJK finds for a gap of a thousandth of the face's size: about 1 degree.
constexpr double exactly_face = 0.9998;
constexpr double nearly_level = 0.087; // `nearly_face` as a sine
// What meets a face squarely may itself be a face at up to 60 degrees: beyond it an edge or vertex meets it.
constexpr double other_face = 0.5;
// Two edges cross in a point, but in one that runs off along them as they get parallel: at 1 degree it moves by
// 50 times what they do. Below that they are side by side and have two.
constexpr double side_by_side = 0.02;

void take_face(const Core3& core, std::uint32_t f, Feature& feature)
{
    const Polytope& hull = core.polytope;
    feature.kind = face_feature;
    feature.id = f;
    feature.normal = core.frame.r * hull.normal(f);
    for (std::uint32_t k = hull.loop_begin[f]; k < hull.loop_begin[f + 1]; ++k) {
        feature.vertex.push_back(hull.loop[k]);
        feature.point.push_back(core.frame * hull.vertex(hull.loop[k]));
    }
}

/// An edge if one is level within `slope`, or lies highest of all at any slope where that is 1.
void take_edge_or_vertex(const Core3& core, const Vec3& d, double slope, Feature& feature)
{
    const Polytope& hull = core.polytope;
    SmallVector<double, 128> depth;
    depth.resize(hull.stride);
    const double near =
        core.kernels->heights(hull.x, hull.stride, -d.x, -d.y, -d.z, depth.data()) + 1e-9 * core.reach;
    // It must carry a highest vertex, or it is the edge of another region. Which ones do is hard to predict:
    // found without branches.
    SmallVector<std::uint32_t, 192> carrying;
    carrying.resize(hull.edges + std::size_t{1});
    std::size_t count = 0;
    for (std::uint32_t e = 0; e < hull.edges; ++e) {
        carrying[count] = e;
        count += std::min(depth[hull.edge[e].v[0]], depth[hull.edge[e].v[1]]) <= near ? 1 : 0;
    }
    // Of these the one whose other end is highest.
    double least = HUGE_VAL;
    std::uint32_t best = 0;
    for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t* const v = hull.edge[carrying[k]].v;
        const double p = depth[v[0]], q = depth[v[1]], low = std::max(p, q);
        if (low < least &&
            (p - q) * (p - q) <= slope * slope * length2(hull.vertex(v[1]) - hull.vertex(v[0])))
            least = low, best = carrying[k];
    }
    if (least != HUGE_VAL) {
        feature.kind = edge_feature;
        feature.id = best;
        for (const std::uint32_t v : hull.edge[best].v) {
            feature.vertex.push_back(v);
            feature.point.push_back(core.frame * hull.vertex(v));
        }
        return;
    }
    const Support top = support(core, core.frame.r * d);
    feature.kind = vertex_feature;
    feature.id = top.vertex;
    feature.vertex.push_back(top.vertex);
    feature.point.push_back(top.p);
}

void take_features(const Core3& a, const Core3& b, const Vec3& n, Feature& fa, Feature& fb)
{
    const Vec3 da = a.frame.r.back(n), db = b.frame.r.back(-n);
    double along_a = -1, along_b = -1;
    const std::uint32_t face_a = best_face(a.polytope, *a.kernels, da, along_a);
    const std::uint32_t face_b = best_face(b.polytope, *b.kernels, db, along_b);
    const bool exact_a = along_a > exactly_face, exact_b = along_b > exactly_face;
    // Against a face the other shape shows all it has, and what is too high falls away by its depth:
    // points come and go continuously. Where no face is hit squarely only what is nearly level counts.
    const double threshold_a = exact_b ? other_face : nearly_face;
    const double threshold_b = exact_a ? other_face : nearly_face;
    if (along_a > threshold_a)
        take_face(a, face_a, fa);
    else
        take_edge_or_vertex(a, da, exact_b ? 1 : nearly_level, fa);
    if (along_b > threshold_b)
        take_face(b, face_b, fb);
    else
        take_edge_or_vertex(b, db, exact_a ? 1 : nearly_level, fb);
}

/// The plane at right angles to the normal.
struct Lateral
{
    Vec3 n, u, v;
    [[nodiscard]] Vec2 flat(const Vec3& p) const { return {dot(p, u), dot(p, v)}; }
};

/// The height along n of a face's plane over a lateral point.
struct Slope
{
    double base, du, dv;
    Slope(const Lateral& lateral, const Feature& face)
    {
        const double up = 1 / dot(face.normal, lateral.n);
        base = dot(face.normal, face.point[0]) * up;
        du = -dot(face.normal, lateral.u) * up;
        dv = -dot(face.normal, lateral.v) * up;
    }
    [[nodiscard]] double at(const Vec2& p) const { return base + du * p.x + dv * p.y; }
};

struct Clip
{
    Lateral lateral;
    double radius_a, radius_b, margin, size;
    SmallVector<ManifoldPoint<3>, 24> found;

    void add(const Vec2& at, double height_a, double height_b, std::uint16_t feature_a,
             std::uint16_t feature_b)
    {
        const double top = height_a + radius_a, bottom = height_b - radius_b;
        double depth = top - bottom;
        if (!keeps(depth, margin, size)) return;
        const Vec3 p = lateral.u * at.x + lateral.v * at.y + lateral.n * (0.5 * (top + bottom));
        found.push_back({p, depth, feature_a, feature_b});
    }
};

std::uint16_t edge_of(const Feature& face, std::uint32_t i)
{
    return feature_id(edge_feature, face.vertex[i]);
}

/// Sutherland and Hodgman (1974): b's polygon cut by a's sides, both seen along the normal. Each corner knows
/// the features it comes from, whichever of the two polygons is cut.
void clip_faces(Clip& clip, const Feature& a, const Feature& b)
{
    struct Corner
    {
        Vec2 p;
        std::uint16_t feature_a, feature_b;
        std::uint32_t side; // that leads to the next corner: of b, or of a with the top bit set
    };
    constexpr std::uint32_t of_a = 0x80000000u;
    SmallVector<Corner, 24> room[2];
    SmallVector<Corner, 24>* now = &room[0];
    SmallVector<Corner, 24>* later = &room[1];
    const std::uint16_t face_a = feature_id(face_feature, a.id), face_b = feature_id(face_feature, b.id);
    // b's loop runs clockwise as a sees it: backwards, side i - 1 leads from corner i.
    const std::size_t sides_a = a.point.size(), sides_b = b.point.size();
    for (std::size_t k = sides_b; k-- > 0;)
        now->push_back({clip.lateral.flat(b.point[k]), face_a, feature_id(vertex_feature, b.vertex[k]),
                        static_cast<std::uint32_t>((k + sides_b - 1) % sides_b)});
    Vec2 from = clip.lateral.flat(a.point[0]);
    for (std::size_t i = 0; i < sides_a && !now->empty(); ++i) {
        const SmallVector<Corner, 24>& polygon = *now;
        SmallVector<Corner, 24>& next = *later;
        const std::size_t after = i + 1 == sides_a ? 0 : i + 1;
        const Vec2 to = clip.lateral.flat(a.point[after]);
        const Vec2 side = to - from;
        next.clear();
        const std::size_t size = polygon.size();
        double here = cross(side, polygon[0].p - from);
        for (std::size_t k = 0; k < size; ++k) {
            const Corner& corner = polygon[k];
            const Corner& other = polygon[k + 1 == size ? 0 : k + 1];
            const double there = cross(side, other.p - from);
            if (here >= 0) next.push_back(corner);
            if ((here >= 0) != (there >= 0)) {
                const double t = here / (here - there);
                Corner made;
                made.p = corner.p + (other.p - corner.p) * t;
                if ((corner.side & of_a) != 0) {
                    const bool previous = (corner.side & ~of_a) == i - 1;
                    made.feature_a = feature_id(vertex_feature, a.vertex[previous ? i : after]);
                    made.feature_b = face_b;
                } else {
                    made.feature_a = edge_of(a, static_cast<std::uint32_t>(i));
                    made.feature_b = edge_of(b, corner.side);
                }
                // Going out, what follows lies on a's side; coming in, on the polygon's own.
                made.side = here >= 0 ? static_cast<std::uint32_t>(i) | of_a : corner.side;
                next.push_back(made);
            }
            here = there;
        }
        std::swap(now, later);
        from = to;
    }
    const SmallVector<Corner, 24>& polygon = *now;
    const Slope height_a(clip.lateral, a), height_b(clip.lateral, b);
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Corner& corner = polygon[k];
        clip.add(corner.p, height_a.at(corner.p), height_b.at(corner.p), corner.feature_a, corner.feature_b);
    }
}

/// The part of `edge` over the polygon of `face`. `swapped`: the face is a's.
void clip_edge(Clip& clip, const Feature& edge, const Feature& face, bool swapped)
{
    const Vec2 e0 = clip.lateral.flat(edge.point[0]), e1 = clip.lateral.flat(edge.point[1]);
    const double h0 = dot(clip.lateral.n, edge.point[0]), h1 = dot(clip.lateral.n, edge.point[1]);
    const std::uint16_t whole_face = feature_id(face_feature, face.id);
    double begin = 0, end = 1;
    std::uint16_t edge_begin = feature_id(vertex_feature, edge.vertex[0]),
                  edge_end = feature_id(vertex_feature, edge.vertex[1]);
    std::uint16_t face_begin = whole_face, face_end = whole_face;
    const std::size_t sides = face.point.size();
    const double turn = swapped ? 1 : -1; // b's loop runs clockwise
    Vec2 from = clip.lateral.flat(face.point[0]);
    for (std::size_t i = 0; i < sides; ++i) {
        const Vec2 to = clip.lateral.flat(face.point[i + 1 == sides ? 0 : i + 1]);
        const double d0 = turn * cross(to - from, e0 - from), d1 = turn * cross(to - from, e1 - from);
        // An edge that lies along the side is all in, whatever rounding says of its ends.
        const double slack = -1e-9 * clip.size * (std::abs(to.x - from.x) + std::abs(to.y - from.y));
        from = to;
        if (d0 >= slack && d1 >= slack) continue;
        if (d0 < 0 && d1 < 0) return;
        const double t = d0 / (d0 - d1);
        if (d0 < 0) {
            if (t > begin) {
                begin = t;
                edge_begin = feature_id(edge_feature, edge.id);
                face_begin = edge_of(face, static_cast<std::uint32_t>(i));
            }
        } else if (t < end) {
            end = t;
            edge_end = feature_id(edge_feature, edge.id);
            face_end = edge_of(face, static_cast<std::uint32_t>(i));
        }
    }
    if (begin > end) return;
    const Slope slope(clip.lateral, face);
    const auto add = [&](double t, std::uint16_t on_edge, std::uint16_t on_face) {
        const Vec2 p = e0 + (e1 - e0) * t;
        const double height_edge = h0 + (h1 - h0) * t, height_face = slope.at(p);
        if (swapped)
            clip.add(p, height_face, height_edge, on_face, on_edge);
        else
            clip.add(p, height_edge, height_face, on_edge, on_face);
    };
    add(begin, edge_begin, face_begin);
    if (end > begin) add(end, edge_end, face_end);
}

void clip_edges(Clip& clip, const Feature& a, const Feature& b)
{
    const Vec2 a0 = clip.lateral.flat(a.point[0]), a1 = clip.lateral.flat(a.point[1]);
    const Vec2 b0 = clip.lateral.flat(b.point[0]), b1 = clip.lateral.flat(b.point[1]);
    const Vec2 da = a1 - a0, db = b1 - b0;
    const double size_a = length2(da), size_b = length2(db);
    const double turn = cross(da, db);
    const auto height = [&](const Feature& f, double t) {
        return dot(clip.lateral.n, f.point[0] + (f.point[1] - f.point[0]) * t);
    };
    const std::uint16_t edge_a = feature_id(edge_feature, a.id), edge_b = feature_id(edge_feature, b.id);
    if (size_a > 0 && size_b > 0 && turn * turn < side_by_side * side_by_side * size_a * size_b) {
        // Side by side: the ends of what they share along a.
        double t0 = dot(b0 - a0, da) / size_a, t1 = dot(b1 - a0, da) / size_a;
        const bool backwards = t0 > t1;
        if (backwards) std::swap(t0, t1);
        const double begin = std::max(0.0, t0), end = std::min(1.0, t1);
        if (begin <= end) {
            const auto add = [&](double t, bool of_a, std::uint32_t end_a, std::uint32_t end_b) {
                const Vec2 p = a0 + da * t;
                const double s = std::clamp(dot(p - b0, db) / size_b, 0.0, 1.0);
                const Vec2 q = b0 + db * s;
                // A gap is as wide as the points are apart, also sideways.
                const double height_a = height(a, t), rise = height(b, s) - height_a;
                const double aside = length2(q - p);
                const double gap = rise > 0 ? std::sqrt(rise * rise + aside) : rise + std::sqrt(aside);
                clip.add((p + q) * 0.5, height_a, height_a + gap,
                         of_a ? feature_id(vertex_feature, a.vertex[end_a]) : edge_a,
                         of_a ? edge_b : feature_id(vertex_feature, b.vertex[end_b]));
            };
            add(begin, t0 <= 0, 0, backwards ? 1 : 0);
            if (end > begin) add(end, t1 >= 1, 1, backwards ? 0 : 1);
        }
        return;
    }
    if (turn == 0) return;
    const double t = std::clamp(cross(b0 - a0, db) / turn, 0.0, 1.0);
    const double s = std::clamp(cross(b0 - a0, da) / turn, 0.0, 1.0);
    clip.add((a0 + da * t + b0 + db * s) * 0.5, height(a, t), height(b, s), edge_a, edge_b);
}

/// b is a face, a a vertex.
void clip_point(Clip& clip, const Feature& a, const Feature& b)
{
    const Vec2 p = clip.lateral.flat(a.point[0]);
    const std::size_t sides = b.point.size();
    for (std::size_t i = 0; i < sides; ++i) {
        const Vec2 from = clip.lateral.flat(b.point[i]),
                   to = clip.lateral.flat(b.point[i + 1 == sides ? 0 : i + 1]);
        if (cross(to - from, p - from) > 0) return; // b's loop runs clockwise
    }
    const Slope slope(clip.lateral, b);
    clip.add(p, dot(clip.lateral.n, a.point[0]), slope.at(p), feature_id(vertex_feature, a.vertex[0]),
             feature_id(face_feature, b.id));
}

std::uint16_t id_of(const Feature& f)
{
    return feature_id(f.kind, f.id);
}

/// Without branches on the coordinates, some of which the points of many a face share.
bool same(const Vec3& p, const Vec3& q)
{
    return ((p.x == q.x) & (p.y == q.y) & (p.z == q.z)) != 0;
}

} // namespace

void reduce(const Vec3& normal, ManifoldPoint<3>* candidates, std::uint32_t count, Manifold<3>& manifold)
{
    const auto swap_to = [&](std::uint32_t place, std::uint32_t from) {
        std::swap(candidates[place], candidates[from]);
    };
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < count; ++i)
        if (candidates[i].depth > candidates[best].depth) best = i;
    if (count > 0) swap_to(0, best);
    if (count > 4) {
        double most = -1;
        for (std::uint32_t i = 1; i < count; ++i) {
            const double far = length2(candidates[i].p - candidates[0].p);
            if (far > most) most = far, best = i;
        }
        swap_to(1, best);
        const Vec3 across = cross(normal, candidates[1].p - candidates[0].p);
        most = -1;
        for (std::uint32_t i = 2; i < count; ++i) {
            const double far = std::abs(dot(across, candidates[i].p - candidates[0].p));
            if (far > most) most = far, best = i;
        }
        swap_to(2, best);
        // The triangle's sides with the triangle on their left; the last point is the furthest outside.
        const bool left = dot(across, candidates[2].p - candidates[0].p) >= 0;
        const Vec3 corner[3] = {candidates[0].p, candidates[left ? 1 : 2].p, candidates[left ? 2 : 1].p};
        most = 0;
        best = 0;
        for (std::uint32_t i = 3; i < count; ++i)
            for (int side = 0; side < 3; ++side) {
                const Vec3 edge = corner[(side + 1) % 3] - corner[side];
                const double outside = -dot(cross(normal, edge), candidates[i].p - corner[side]);
                if (outside > most) most = outside, best = i;
            }
        count = 3;
        if (best != 0) swap_to(3, best), count = 4;
    }
    manifold.normal = normal;
    manifold.count = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        // Shapes without breadth have corners that are one point, which a solver would count twice.
        bool twice = false;
        for (std::uint32_t k = 0; k < manifold.count; ++k)
            twice |= same(candidates[i].p, manifold.point[k].p);
        if (!twice) manifold.point[manifold.count++] = candidates[i];
    }
}

void make_manifold(const Core3& a, const Core3& b, const Gap<3>& cores, double margin, Manifold<3>& manifold)
{
    const Vec3& n = cores.normal;
    Clip clip;
    clip.lateral.n = n;
    basis(n, clip.lateral.u, clip.lateral.v);
    clip.radius_a = a.radius;
    clip.radius_b = b.radius;
    clip.margin = margin;
    clip.size = a.reach + b.reach + a.radius + b.radius;
    const double depth = a.radius + b.radius - cores.distance;
    Feature fa, fb;
    if (a.custom == nullptr && b.custom == nullptr) {
        take_features(a, b, n, fa, fb);
        if (fa.kind == face_feature && fb.kind == face_feature)
            clip_faces(clip, fa, fb);
        else if (fa.kind == edge_feature && fb.kind == face_feature)
            clip_edge(clip, fa, fb, false);
        else if (fa.kind == face_feature && fb.kind == edge_feature)
            clip_edge(clip, fb, fa, true);
        else if (fa.kind == edge_feature && fb.kind == edge_feature)
            clip_edges(clip, fa, fb);
    }
    double deepest = -HUGE_VAL;
    for (std::size_t i = 0; i < clip.found.size(); ++i)
        deepest = std::max(deepest, clip.found[i].depth);
    // What is left: a vertex against anything, custom shapes, and rounding.
    const double slack = 1e-7 * (a.reach + b.reach + std::abs(depth));
    if (deepest > depth + slack) clip.found.clear();
    if (!(deepest >= depth - slack) || clip.found.empty()) {
        Vec3 on_a = cores.on_a, on_b = cores.on_b;
        if (cores.distance <= 0) {
            // Moved apart along the normal they are nearest where they would part.
            Simplex simplex;
            Gap<3> moved;
            const double clear = 1e-3 * (a.reach + b.reach);
            if (gjk(a, b, n * (clear - cores.distance), HUGE_VAL, all_steps, simplex, moved) ==
                Verdict::apart)
                on_a = moved.on_a, on_b = moved.on_b;
            else
                on_a = support(a, n).p, on_b = on_a + n * cores.distance;
        }
        const Vec3 middle = (on_a + n * a.radius + on_b - n * b.radius) * 0.5;
        clip.found.push_back({middle, depth, id_of(fa), id_of(fb)});
    }
    reduce(n, clip.found.data(), static_cast<std::uint32_t>(clip.found.size()), manifold);
}

bool face_contact(const Core3& a, const Core3& triangle, double side, double margin, Manifold<3>& manifold)
{
    if (triangle.polytope.faces == 0) return false;
    const std::uint32_t face = side > 0 ? 0 : 1;
    Clip clip;
    const Vec3 n = -(triangle.frame.r * triangle.polytope.normal(face));
    clip.lateral.n = n;
    basis(n, clip.lateral.u, clip.lateral.v);
    clip.radius_a = a.radius;
    clip.radius_b = triangle.radius;
    clip.margin = margin;
    clip.size = a.reach + triangle.reach + a.radius + triangle.radius;
    Feature fa, fb;
    take_face(triangle, face, fb);
    double along = -1;
    const Vec3 da = a.frame.r.back(n);
    const std::uint32_t face_a = best_face(a.polytope, *a.kernels, da, along);
    if (along > other_face)
        take_face(a, face_a, fa);
    else if (a.custom == nullptr)
        take_edge_or_vertex(a, da, 1, fa);
    else {
        fa.point.push_back(support(a, n).p);
        fa.vertex.push_back(0);
    }
    if (fa.kind == face_feature)
        clip_faces(clip, fa, fb);
    else if (fa.kind == edge_feature)
        clip_edge(clip, fa, fb, false);
    else
        clip_point(clip, fa, fb);
    if (clip.found.empty()) return false;
    reduce(n, clip.found.data(), static_cast<std::uint32_t>(clip.found.size()), manifold);
    return true;
}

Vec3 furthest(const Core3& core, const Vec3& direction)
{
    return support(core, direction).p;
}

void core_gap_by_axes(const Core3& a, const Core3& b, Gap<3>& gap)
{
    const Axis axis = best_axis(a, b);
    gap.normal = axis.normal;
    gap.distance = std::min(0.0, axis.separation);
    gap.on_a = gap.on_b = {};
}

void core_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap)
{
    Simplex simplex;
    if (are_small_polyhedra(a, b)) {
        // A few steps tell most of those apart that are; what is left mostly overlaps.
        const Verdict verdict = gjk(a, b, {}, enough, 2, simplex, gap);
        if (verdict == Verdict::apart) return;
        if (polyhedra_gap(a, b, enough, gap)) {
            if (verdict == Verdict::overlap) gap.distance = std::min(0.0, gap.distance);
            if (gap.distance > enough) gap.distance = HUGE_VAL;
            if (gap.distance <= 0 || gap.distance == HUGE_VAL) return;
        }
    }
    if (gjk(a, b, {}, enough, all_steps, simplex, gap) == Verdict::apart) return;
    const double axes_cost = static_cast<double>(a.polytope.directions) * b.polytope.directions *
                             (a.polytope.vertices + b.polytope.vertices);
    if (a.custom == nullptr && b.custom == nullptr && axes_cost < 1500) {
        core_gap_by_axes(a, b, gap);
        return;
    }
    Expansion expansion(a, b);
    if (expansion.start(simplex)) expansion.run();
    gap.normal = expansion.normal;
    gap.distance = -std::max(0.0, expansion.depth);
    gap.on_a = gap.on_b = {};
}

void convex_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap)
{
    Gap<3> cores;
    core_gap(a, b, enough + a.radius + b.radius, cores);
    gap.distance = cores.distance - a.radius - b.radius;
    gap.normal = cores.normal;
    if (cores.distance == HUGE_VAL) return;
    if (cores.distance > 0) {
        gap.on_a = cores.on_a + cores.normal * a.radius;
        gap.on_b = cores.on_b - cores.normal * b.radius;
        return;
    }
    Manifold<3> manifold;
    make_manifold(a, b, cores, 0, manifold);
    const Vec3 half = gap.normal * (0.5 * gap.distance);
    gap.on_a = manifold.point[0].p - half;
    gap.on_b = manifold.point[0].p + half;
}

bool convex_contact(const Core3& a, const Core3& b, double margin, Manifold<3>& manifold)
{
    Gap<3> cores;
    const double enough = a.radius + b.radius + margin;
    core_gap(a, b, enough, cores);
    if (!(cores.distance <= enough)) return false;
    make_manifold(a, b, cores, margin, manifold);
    return true;
}

bool convex_touch(const Core3& a, const Core3& b)
{
    Simplex simplex;
    Gap<3> gap;
    const double enough = a.radius + b.radius;
    return gjk(a, b, {}, enough, all_steps, simplex, gap) == Verdict::overlap || gap.distance <= enough;
}

void half_space_gap(const Core3& a, const Vec3& normal, double offset, Gap<3>& gap)
{
    const Support lowest = support(a, -normal);
    gap.distance = dot(normal, lowest.p) - offset - a.radius;
    gap.normal = -normal;
    gap.on_a = lowest.p - normal * a.radius;
    gap.on_b = gap.on_a - normal * gap.distance;
}

bool half_space_contact(const Core3& a, const Vec3& normal, double offset, double margin,
                        Manifold<3>& manifold)
{
    SmallVector<ManifoldPoint<3>, 24> found;
    bool touch = false;
    const auto add = [&](const Vec3& p, std::uint32_t vertex) {
        double depth = offset + a.radius - dot(normal, p);
        touch = touch || depth >= -margin;
        if (keeps(depth, margin, std::abs(offset) + a.radius + a.reach))
            found.push_back({p + normal * (0.5 * depth - a.radius), depth, feature_id(vertex_feature, vertex),
                             feature_id(face_feature, 0)});
    };
    if (a.custom != nullptr)
        add(support(a, -normal).p, 0);
    else
        for (std::uint32_t i = 0; i < a.polytope.vertices; ++i)
            add(a.frame * a.polytope.vertex(i), i);
    if (!touch) return false;
    reduce(-normal, found.data(), static_cast<std::uint32_t>(found.size()), manifold);
    return true;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
