// SPDX-License-Identifier: MIT
#include "narrow/convex/manifold3.hpp"

#include "narrow/convex/clip.hpp"
#include "narrow/convex/gjk.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

std::uint16_t id_of(const Feature& f)
{
    return feature_id(f.kind, f.id);
}

/// Without branches on the coordinates, which are often equal for points of a face.
bool same(const Vec3& p, const Vec3& q)
{
    return ((p.x == q.x) & (p.y == q.y) & (p.z == q.z)) != 0;
}

/// Calls visit(p, number), in local axes, for the points that can be deepest below a plane across d: four of
/// each disc, one of which is the deepest of all, and a tip.
template <class Visit>
void for_each_corner(const Core3& core, const Vec3& d, const Visit& visit)
{
    bool has_tip = false;
    switch (core.smooth) {
    case Smooth::cylinder:
        break;
    case Smooth::cone:
        has_tip = true;
        break;
    case Smooth::ellipsoid:
    case Smooth::custom:
    case Smooth::none:
        return visit(smooth_support(core, d), 0);
    }
    const Vec3 rim = across_axis(d) * core.lengths.x;
    const Vec3 spokes[] = {rim, {rim.z, 0, -rim.x}, -rim, {-rim.z, 0, rim.x}};
    std::uint32_t number = 0;
    for (const Vec3& spoke : spokes) {
        visit({spoke.x, -core.lengths.y, spoke.z}, number++);
        if (!has_tip) visit({spoke.x, core.lengths.y, spoke.z}, number++);
    }
    if (has_tip) visit({0, core.lengths.y, 0}, number);
}

/// Of candidates[first] to the last, the one with the greatest `measure` if that is more than `most`, else
/// `otherwise`.
template <class Measure>
std::uint32_t greatest(const ManifoldPoint<3>* candidates, std::uint32_t first, std::uint32_t count,
                       double most, std::uint32_t otherwise, const Measure& measure)
{
    std::uint32_t best = otherwise;
    for (std::uint32_t i = first; i < count; ++i) {
        const double here = measure(candidates[i]);
        if (here > most) {
            most = here;
            best = i;
        }
    }
    return best;
}

} // namespace

void nearest_when_parted(const Core3& a, const Core3& b, const Gap<3>& cores, Vec3& on_a, Vec3& on_b)
{
    const Vec3& n = cores.normal;
    Simplex simplex;
    Gap<3> moved;
    const double clear = 1e-3 * (a.reach + b.reach);
    if (gjk(a, b, n * (clear - cores.distance), HUGE_VAL, {}, simplex, moved) == Verdict::apart) {
        on_a = moved.on_a;
        on_b = moved.on_b;
    } else {
        on_a = support(a, n).p;
        on_b = on_a + n * cores.distance;
    }
}

void reduce(const Vec3& normal, ManifoldPoint<3>* candidates, std::uint32_t count, Manifold<3>& manifold)
{
    const auto depth = [](const ManifoldPoint<3>& point) { return point.depth; };
    if (count > 0)
        std::swap(candidates[0], candidates[greatest(candidates, 1, count, candidates[0].depth, 0, depth)]);
    if (count > 4) {
        const Vec3 first = candidates[0].p;
        const auto distance = [&](const ManifoldPoint<3>& point) { return length2(point.p - first); };
        std::swap(candidates[1], candidates[greatest(candidates, 1, count, -1, 0, distance)]);
        const Vec3 across = cross(normal, candidates[1].p - first);
        const auto aside = [&](const ManifoldPoint<3>& point) {
            return std::abs(dot(across, point.p - first));
        };
        std::swap(candidates[2], candidates[greatest(candidates, 2, count, -1, 0, aside)]);
        // The triangle's sides with the triangle on their left; the last point is the furthest outside.
        const bool left = dot(across, candidates[2].p - first) >= 0;
        const Vec3 corner[3] = {first, candidates[left ? 1 : 2].p, candidates[left ? 2 : 1].p};
        const auto outside = [&](const ManifoldPoint<3>& point) {
            double most = 0;
            for (int side = 0; side < 3; ++side) {
                const Vec3 edge = corner[(side + 1) % 3] - corner[side];
                most = std::max(most, -dot(cross(normal, edge), point.p - corner[side]));
            }
            return most;
        };
        const std::uint32_t last = greatest(candidates, 3, count, 0, 0, outside);
        if (last != 0) std::swap(candidates[3], candidates[last]);
        count = last != 0 ? 4 : 3;
    }
    manifold.normal = normal;
    manifold.count = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        // Shapes of zero width have coinciding corners, which a solver would count twice.
        bool twice = false;
        for (std::uint32_t k = 0; k < manifold.count; ++k)
            twice |= same(candidates[i].p, manifold.point[k].p);
        if (!twice) manifold.point[manifold.count++] = candidates[i];
    }
}

void make_ball_manifold(double radius, const Core3& b, const Gap<3>& cores, Manifold<3>& manifold)
{
    const Vec3& n = cores.normal;
    manifold.normal = n;
    manifold.count = 1;
    manifold.point[0] = {(cores.on_a + n * radius + cores.on_b - n * b.radius) * 0.5,
                         radius + b.radius - cores.distance, feature_id(vertex_feature, 0),
                         feature_against_vertex(b, -n)};
}

void make_manifold(const Core3& a, const Core3& b, const Gap<3>& given, double margin, Manifold<3>& manifold)
{
    const Vec3& n = given.normal;
    const double depth = a.radius + b.radius - given.distance;
    Gap<3> cores = given;
    const auto locate = [&] {
        if (cores.distance <= 0 && !cores.located) nearest_when_parted(a, b, given, cores.on_a, cores.on_b);
    };
    if (!a.is_smooth() && a.polytope.vertices == 1) {
        locate();
        return make_ball_manifold(a.radius, b, cores, manifold);
    }
    const auto deepest = [&](std::uint16_t feature_a, std::uint16_t feature_b) -> ManifoldPoint<3> {
        locate();
        return {(cores.on_a + n * a.radius + cores.on_b - n * b.radius) * 0.5, depth, feature_a, feature_b};
    };
    Clip clip(a, b, n, margin);
    Feature fa, fb;
    take_features(a, b, n, fa, fb);
    clip_features(clip, fa, fb);
    clip.complete(depth, [&] { return deepest(id_of(fa), id_of(fb)); });
    reduce(n, clip.found.data(), static_cast<std::uint32_t>(clip.found.size()), manifold);
}

bool face_contact(const Core3& a, const Core3& triangle, double side, double margin, Manifold<3>& manifold)
{
    if (triangle.polytope.faces == 0) return false;
    const std::uint32_t face = side > 0 ? 0 : 1;
    const Vec3 n = -(triangle.frame.r * triangle.polytope.normal(face));
    Clip clip(a, triangle, n, margin);
    Feature fa, fb;
    take_face(triangle, face, fb);
    take_against_face(a, n, fa);
    if (fa.kind == vertex_feature)
        clip_point(clip, fa, fb);
    else
        clip_features(clip, fa, fb);
    if (clip.found.empty()) return false;
    reduce(n, clip.found.data(), static_cast<std::uint32_t>(clip.found.size()), manifold);
    return true;
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
    if (a.is_smooth())
        for_each_corner(a, a.frame.r.back(-normal),
                        [&](const Vec3& p, std::uint32_t number) { add(a.frame * p, number); });
    else
        for (std::uint32_t i = 0; i < a.polytope.vertices; ++i)
            add(a.frame * a.polytope.vertex(i), i);
    if (!touch) return false;
    reduce(-normal, found.data(), static_cast<std::uint32_t>(found.size()), manifold);
    return true;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
