// SPDX-License-Identifier: MIT
// jostle bench distances: how long the distance of a pair takes, whether it touches, and when it will.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "bench/distance_peers.hpp"
#include "bench_bodies.hpp"
#include "commands.hpp"
#include "jostle/contact.hpp"
#include "numbers.hpp"
#include "pair_timings.hpp"

namespace jostle_tool {

namespace {

using jostle::Pair;
using jostle::Pose3d;
using jostle::Shape3;
using jostle_bench::BodyKind;
using jostle_bench::BodyShape;

struct Combination
{
    const char* name;
    BodyKind a, b;
    std::uint32_t rings;         ///< of the meshes: 4 x rings x rings triangles
    std::uint64_t pairs_divisor; ///< of --pairs: what is slow gets fewer
};
constexpr Combination all_combinations[] = {
    {"sphere-sphere", BodyKind::sphere, BodyKind::sphere, 0, 1},
    {"sphere-box", BodyKind::sphere, BodyKind::box, 0, 1},
    {"capsule-capsule", BodyKind::capsule, BodyKind::capsule, 0, 1},
    {"capsule-box", BodyKind::capsule, BodyKind::box, 0, 1},
    {"box-box", BodyKind::box, BodyKind::box, 0, 1},
    {"cylinder-cylinder", BodyKind::cylinder, BodyKind::cylinder, 0, 4},
    {"cone-cone", BodyKind::cone, BodyKind::cone, 0, 4},
    {"ellipsoid-ellipsoid", BodyKind::ellipsoid, BodyKind::ellipsoid, 0, 4},
    {"cylinder-box", BodyKind::cylinder, BodyKind::box, 0, 4},
    {"cone-box", BodyKind::cone, BodyKind::box, 0, 4},
    {"ellipsoid-box", BodyKind::ellipsoid, BodyKind::box, 0, 4},
    {"box-hull", BodyKind::box, BodyKind::hull, 0, 4},
    {"hull-hull", BodyKind::hull, BodyKind::hull, 0, 4},
    {"sphere-mesh", BodyKind::sphere, BodyKind::mesh, 112, 200},
    {"capsule-mesh", BodyKind::capsule, BodyKind::mesh, 112, 200},
    {"link-link", BodyKind::mesh, BodyKind::mesh, 22, 500},
    {"mesh-mesh", BodyKind::mesh, BodyKind::mesh, 112, 1000},
};

/// Two bodies of about 1 m, and pairs of them in many places. Gaps are spread from 0.02 to 0.5 m. For their
/// depth, b is moved along the gap until they overlap by 0.01 to 0.1 m.
struct Scene
{
    std::vector<std::vector<jostle::Vec<3, double>>> points;
    std::vector<std::vector<std::array<std::uint32_t, 3>>> triangles;
    std::vector<std::unique_ptr<jostle::ConvexHull<3>>> hulls;
    std::vector<std::unique_ptr<jostle::Mesh<3>>> meshes;
    BodyShape body[2];
    Shape3 shape[2];

    std::vector<Shape3> shapes; ///< by object: pair i is of objects i and count + i
    std::vector<Pose3d> poses;
    std::vector<Pose3d> overlapping; ///< other poses of the same objects
    std::vector<BodyShape> bodies;
    std::vector<Pair> pairs;
};

/// A closed surface with bumps.
void add_mesh(Scene& scene, std::uint32_t rings, RandomBodies& numbers)
{
    auto& points = scene.points.emplace_back();
    auto& triangles = scene.triangles.emplace_back();
    const double shift = numbers.uniform(0, 6);
    const auto place = [&](std::uint32_t i, std::uint32_t j) -> jostle::Vec<3, double> {
        const double t = std::numbers::pi * i / rings, p = std::numbers::pi * j / rings;
        const double r = 0.5 + 0.04 * std::sin(5 * t + shift) * std::cos(7 * p);
        return {r * std::sin(t) * std::cos(p), r * std::cos(t), r * std::sin(t) * std::sin(p)};
    };
    close_surface(rings, place, points, triangles);
    scene.meshes.push_back(std::make_unique<jostle::Mesh<3>>(points, triangles));
}

/// 24 points on a ball: all are corners.
void add_hull(Scene& scene, RandomBodies& numbers)
{
    std::vector<jostle::Vec<3, double>> points(24);
    for (auto& p : points) {
        p = numbers.direction();
        for (double& x : p)
            x *= 0.5;
    }
    scene.hulls.push_back(std::make_unique<jostle::ConvexHull<3>>(points));
    const auto corners = scene.hulls.back()->vertices();
    scene.points.emplace_back(corners.begin(), corners.end());
    scene.triangles.push_back(triangles_of(*scene.hulls.back()));
}

void make_body(Scene& scene, std::size_t which, BodyKind kind, std::uint32_t rings, RandomBodies& numbers)
{
    BodyShape body{kind};
    switch (kind) {
    case BodyKind::sphere:
        body.radius = 0.5;
        break;
    case BodyKind::capsule:
        body.radius = 0.2;
        body.half_length = 0.4;
        break;
    case BodyKind::cylinder:
        body.radius = 0.3;
        body.half_length = 0.45;
        break;
    case BodyKind::cone:
        body.radius = 0.4;
        body.half_length = 0.5;
        break;
    case BodyKind::box:
        body.half = {0.3, 0.4, 0.5};
        break;
    case BodyKind::ellipsoid:
        body.half = {0.3, 0.5, 0.4};
        break;
    case BodyKind::hull:
        add_hull(scene, numbers);
        break;
    case BodyKind::mesh:
        add_mesh(scene, rings, numbers);
        break;
    }
    scene.shape[which] = kind == BodyKind::hull   ? Shape3(*scene.hulls.back())
                         : kind == BodyKind::mesh ? Shape3(*scene.meshes.back())
                                                  : shape_of(body);
    scene.body[which] = body;
}

std::unique_ptr<Scene> make_scene(const Combination& combination, std::uint64_t count, std::uint64_t seed)
{
    auto made = std::make_unique<Scene>();
    Scene& scene = *made;
    scene.points.reserve(2); // bodies have views of them
    scene.triangles.reserve(2);
    RandomBodies numbers(seed);
    make_body(scene, 0, combination.a, combination.rings, numbers);
    make_body(scene, 1, combination.b, combination.rings, numbers);
    std::size_t next = 0;
    for (BodyShape& body : scene.body)
        if (body.kind == BodyKind::hull || body.kind == BodyKind::mesh) {
            body.points = scene.points[next];
            body.triangles = scene.triangles[next++];
        }
    for (const std::size_t which : {std::size_t{0}, std::size_t{1}})
        for (std::uint64_t i = 0; i < count; ++i) {
            scene.shapes.push_back(scene.shape[which]);
            scene.bodies.push_back(scene.body[which]);
            scene.poses.push_back({{}, numbers.rotation<double>()});
        }
    for (std::uint32_t i = 0; i < count; ++i) {
        const Pair pair{i, static_cast<std::uint32_t>(count) + i};
        Pose3d &a = scene.poses[pair.a], &b = scene.poses[pair.b];
        const auto away = numbers.direction();
        for (std::size_t d = 0; d < 3; ++d) {
            a.position[d] = numbers.uniform(-10, 10);
            b.position[d] = a.position[d] + 3 * away[d];
        }
        const double gap = numbers.uniform(0.02, 0.5);
        for (int step = 0; step < 3; ++step)
            if (const auto d = jostle::distance(scene.shape[0], a, scene.shape[1], b, 1e9))
                for (std::size_t k = 0; k < 3; ++k)
                    b.position[k] -= d->normal[k] * (d->distance - gap);
        scene.pairs.push_back(pair);
    }
    RandomBodies depths(seed + 1);
    scene.overlapping = scene.poses;
    for (const Pair& pair : scene.pairs) {
        const Pose3d& a = scene.poses[pair.a];
        Pose3d& b = scene.overlapping[pair.b];
        const double depth = depths.uniform(0.01, 0.1);
        for (int step = 0; step < 20; ++step) { // more than one only past a tip or a rim
            const auto d = jostle::distance(scene.shape[0], a, scene.shape[1], b, 1e9);
            if (!d || d->distance < 0) break;
            for (std::size_t k = 0; k < 3; ++k)
                b.position[k] -= d->normal[k] * (d->distance + depth);
        }
    }
    return made;
}

void run(const BenchOptions& options)
{
    const std::vector<const Combination*> wanted =
        choose(options.names, all_combinations, "pair of shapes that is measured");
    PairTimings table(options);
    for (const Combination* combination : wanted) {
        const std::uint64_t count = std::max<std::uint64_t>(1, options.count / combination->pairs_divisor);
        const std::unique_ptr<Scene> scene = make_scene(*combination, count, options.seed);
        table.start(combination->name, count);
        const auto& [shape_a, shape_b] = scene->shape;
        const std::vector<Pose3d>&poses = scene->poses, &deep = scene->overlapping;
        const std::vector<Pair>& pairs = scene->pairs;
        const double distance = table.one_by_one("jostle", "distance", 0, [&](std::size_t i) {
            return jostle::distance(shape_a, poses[pairs[i].a], shape_b, poses[pairs[i].b], 1e9)->distance;
        });
        jostle::ContactFinder3d finder({.executor = &jostle::serial_executor()});
        std::vector<jostle::Distance<3, double>> distances(count);
        table.together(
            "jostle", "distances", distance,
            [&] { finder.distances({scene->shapes, poses}, pairs, 1e9, std::span(distances)); },
            [&](std::vector<double>& answers) {
                for (std::size_t i = 0; i < count; ++i)
                    answers[i] = distances[i].distance;
            });
        const double touching = table.one_by_one("jostle", "touching", 0, [&](std::size_t i) {
            return jostle::touching(shape_a, poses[pairs[i].a], shape_b, poses[pairs[i].b]);
        });
        const double overlap = table.one_by_one("jostle", "overlap", 0, [&](std::size_t i) {
            return jostle::touching(shape_a, deep[pairs[i].a], shape_b, deep[pairs[i].b]);
        });
        const double depth = table.one_by_one("jostle", "depth", 0, [&](std::size_t i) {
            return -jostle::distance(shape_a, deep[pairs[i].a], shape_b, deep[pairs[i].b], 0)->distance;
        });
        // Each turns by 1 radian while b comes towards a.
        table.one_by_one("jostle", "impact", 0, [&](std::size_t i) {
            const Pose3d &pose_a = poses[pairs[i].a], &pose_b = poses[pairs[i].b];
            jostle::Motion<3, double> moving_a{pose_a, {}, {0.6, 0.64, -0.48}},
                moving_b{pose_b, {}, {0, -0.6, 0.8}};
            for (std::size_t d = 0; d < 3; ++d)
                moving_b.linear[d] = pose_a.position[d] - pose_b.position[d];
            const auto hit = jostle::time_of_impact(shape_a, moving_a, shape_b, moving_b, 1e-3);
            return hit ? hit->time : 1;
        });
#ifdef JOSTLE_WITH_PEERS
        if (!options.peers) continue;
        const auto [kind_a, kind_b] = std::pair(combination->a, combination->b);
        for (const auto& make : {jostle_bench::make_bullet_distances, jostle_bench::make_fcl_distances}) {
            const auto peer = make();
            if (!peer->has_touching(kind_a, kind_b)) continue;
            peer->start(scene->bodies, pairs, poses);
            if (peer->has_distance(kind_a, kind_b, peer->open))
                table.one_by_one(peer->name(), "distance", distance,
                                 [&](std::size_t i) { return peer->distance(i, peer->open); });
            table.one_by_one(peer->name(), "touching", touching,
                             [&](std::size_t i) { return peer->touching(i); });
            const auto overlapping = make();
            overlapping->start(scene->bodies, pairs, deep);
            table.one_by_one(peer->name(), "overlap", overlap,
                             [&](std::size_t i) { return overlapping->touching(i); });
            if (!peer->has_depth(kind_a, kind_b)) continue;
            table.one_by_one(peer->name(), "depth", depth,
                             [&](std::size_t i) { return overlapping->depth(i); });
            if (!peer->has_least_depth(kind_a, kind_b)) continue;
            table.one_by_one(peer->name(), "least depth", depth,
                             [&](std::size_t i) { return overlapping->least_depth(i); });
        }
#else
        (void)touching, (void)overlap, (void)depth;
#endif
    }
    table.finish();
}

} // namespace

void add_bench_distances_command(const Command& bench)
{
    add_pair_queries(
        bench, "distances", "Times distances, touching tests and impacts of shapes",
        R"(Pairs: of spheres, capsules, boxes, cylinders, cones, ellipsoids, hulls of 24 corners, and closed
meshes of 1936 (link) and 50,176 triangles (mesh). Bodies are about 1 m, in double; gaps are spread from 0.02 to
0.5 m, and the greatest distance asked for is open. One thread.

Queries: distance, touching, overlap, depth and impact (both turn by 1 radian, b comes towards a) one pair at a
time; distances all at once. For overlap (touching, with the answer yes) and depth, b is moved along the gap until
both overlap by 0.01 to 0.1 m; the depth of meshes is that of the two triangles that overlap deepest, as each
system defines it. Jostle's depth is the least one, which FCL computes in another call: least depth. Compare the
mean answers to see that systems agree: a distance or depth in m, the share that touches, or a time.
Bullet, in float, has no ellipsoids, no distance to a mesh without a limit, and no exact test of two meshes.

Examples:
  jostle bench distances
  jostle bench distances capsule-capsule mesh-mesh
  jostle bench distances --peers --json -)",
        run,
        "How many pairs (10000); of hulls, cylinders, cones and ellipsoids a quarter, of "
        "meshes 1 to 5 of 1000 as many",
        "Other bodies of the same kind (1)", "Bullet and FCL as well, where the build has them");
}

} // namespace jostle_tool
