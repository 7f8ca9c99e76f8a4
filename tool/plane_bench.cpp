// SPDX-License-Identifier: MIT
// jostle bench plane: how long the distance of two shapes in the plane takes, whether they touch, and their
// contact.
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "bench/plane_peers.hpp"
#include "bench_bodies.hpp"
#include "commands.hpp"
#include "jostle/contact.hpp"
#include "pair_timings.hpp"

namespace jostle_tool {

namespace {

using jostle::Pair;
using jostle::Pose2d;
using jostle::Shape2;
using jostle_bench::PlaneShape;
using Kind = PlaneShape::Kind;

struct Combination
{
    const char* name;
    Kind kind;
    std::uint32_t corners; ///< of a polygon
};
constexpr Combination all_combinations[] = {
    {"circles", Kind::circle, 0},         {"capsules", Kind::capsule, 0}, {"boxes", Kind::polygon, 4},
    {"triangles", Kind::polygon, 3},      {"octagons", Kind::polygon, 8}, {"polygons-24", Kind::polygon, 24},
    {"polygons-100", Kind::polygon, 100}, {"ellipses", Kind::ellipse, 0},
};

/// Many pairs of one shape of about 1 m. Gaps are spread from 0.02 to 0.5 m; `overlapping` are other poses of
/// b, in which the two overlap by 0.01 to 0.1 m.
struct Scene
{
    std::vector<jostle::Vec<2, double>> corners;
    std::unique_ptr<jostle::ConvexHull2> hull;
    PlaneShape given;
    Shape2 shape;
    std::vector<Pose2d> a, b, overlapping;
};

void make_shape(Scene& scene, const Combination& combination)
{
    scene.given.kind = combination.kind;
    switch (combination.kind) {
    case Kind::circle:
        scene.given.radius = 0.5;
        scene.shape = Shape2::sphere(0.5);
        return;
    case Kind::capsule:
        scene.given.radius = 0.2;
        scene.given.half_length = 0.4;
        scene.shape = Shape2::capsule(0.4, 0.2);
        return;
    case Kind::ellipse:
        scene.shape = Shape2::ellipsoid({0.3, 0.5});
        return;
    case Kind::polygon:
        break;
    }
    if (combination.corners == 4) {
        scene.corners = {{-0.4, -0.5}, {0.4, -0.5}, {0.4, 0.5}, {-0.4, 0.5}};
        scene.shape = Shape2::box({0.4, 0.5});
    } else {
        for (std::uint32_t i = 0; i < combination.corners; ++i) {
            const double angle = 2 * std::numbers::pi * i / combination.corners;
            scene.corners.push_back({0.6 * std::cos(angle), 0.5 * std::sin(angle)});
        }
        scene.hull = std::make_unique<jostle::ConvexHull2>(scene.corners);
        scene.shape = *scene.hull;
    }
    scene.given.corners = scene.corners;
}

std::unique_ptr<Scene> make_scene(const Combination& combination, std::uint64_t count, std::uint64_t seed)
{
    auto made = std::make_unique<Scene>();
    Scene& scene = *made;
    make_shape(scene, combination);
    RandomBodies numbers(seed);
    const auto turned = [&] {
        const double angle = numbers.uniform(0, 2 * std::numbers::pi);
        return std::array<double, 2>{std::cos(angle), std::sin(angle)};
    };
    for (std::uint64_t i = 0; i < count; ++i) {
        const Pose2d a{{numbers.uniform(-10, 10), numbers.uniform(-10, 10)}, turned()};
        const auto away = turned();
        Pose2d b{{a.position[0] + 3 * away[0], a.position[1] + 3 * away[1]}, turned()};
        const auto signed_distance = [&] { return jostle::distance(scene.shape, a, scene.shape, b, 1e9); };
        const auto move_to = [&](double wanted) {
            const auto now = signed_distance();
            for (std::size_t d = 0; d < 2; ++d)
                b.position[d] -= now->normal[d] * (now->distance - wanted);
        };
        const double gap = numbers.uniform(0.02, 0.5), depth = numbers.uniform(0.01, 0.1);
        for (int step = 0; step < 3; ++step)
            move_to(gap);
        scene.a.push_back(a);
        scene.b.push_back(b);
        for (int step = 0; step < 20 && signed_distance()->distance >= 0; ++step) // more than one past a tip
            move_to(-depth);
        scene.overlapping.push_back(b);
    }
    return made;
}

void run(const BenchOptions& options)
{
    const std::vector<const Combination*> wanted =
        choose(options.names, all_combinations, "pair of shapes that is measured");
    PairTimings table(options);
    for (const Combination* combination : wanted) {
        const std::uint64_t count = options.count;
        const std::unique_ptr<Scene> made = make_scene(*combination, count, options.seed);
        const Scene& scene = *made;
        const Shape2& shape = scene.shape;
        table.start(combination->name, count);
        const double distance = table.one_by_one("jostle", "distance", 0, [&](std::size_t i) {
            return jostle::distance(shape, scene.a[i], shape, scene.b[i], 1e9)->distance;
        });
        const double touching = table.one_by_one("jostle", "touching", 0, [&](std::size_t i) {
            return jostle::touching(shape, scene.a[i], shape, scene.b[i]);
        });
        const double overlap = table.one_by_one("jostle", "overlap", 0, [&](std::size_t i) {
            return jostle::touching(shape, scene.a[i], shape, scene.overlapping[i]);
        });
        table.one_by_one("jostle", "depth", 0, [&](std::size_t i) {
            return -jostle::distance(shape, scene.a[i], shape, scene.overlapping[i], 0)->distance;
        });
        std::vector<Shape2> shapes(2 * count, shape);
        std::vector<Pose2d> poses = scene.a;
        poses.insert(poses.end(), scene.overlapping.begin(), scene.overlapping.end());
        std::vector<Pair> pairs;
        for (std::uint32_t i = 0; i < count; ++i)
            pairs.push_back({i, static_cast<std::uint32_t>(count) + i});
        jostle::ContactFinder2d finder({.executor = &jostle::serial_executor()});
        const double batch = table.together(
            "jostle", "contacts", 0, [&] { (void)finder.find({shapes, poses}, pairs); },
            [&](std::vector<double>& answers) {
                std::size_t next = 0;
                for (const jostle::Contact<2, double>& contact : finder.find({shapes, poses}, pairs))
                    answers[next++] = contact.count;
            });
#ifdef JOSTLE_WITH_PEERS
        if (!options.peers) continue;
        const auto peer = jostle_bench::make_box2d_shapes();
        if (!peer->has_distance(scene.given, scene.given)) continue;
        peer->start(scene.given, scene.given, scene.a, scene.b);
        table.one_by_one(peer->name(), "distance", distance,
                         [&](std::size_t i) { return peer->distance(i); });
        table.one_by_one(peer->name(), "touching", touching,
                         [&](std::size_t i) { return peer->touching(i); });
        peer->start(scene.given, scene.given, scene.a, scene.overlapping);
        table.one_by_one(peer->name(), "overlap", overlap, [&](std::size_t i) { return peer->touching(i); });
        if (peer->has_contacts(scene.given, scene.given))
            table.one_by_one(peer->name(), "contacts", batch,
                             [&](std::size_t i) { return peer->contact_points(i); });
#else
        (void)distance, (void)touching, (void)overlap, (void)batch;
#endif
    }
    table.finish();
}

} // namespace

void add_bench_plane_command(const Command& bench)
{
    add_pair_queries(
        bench, "plane", "Times distances, touching tests and contacts of shapes in 2D",
        R"(Pairs: two circles, capsules, boxes, triangles, octagons, polygons of 24 or 100 corners, or ellipses.
Bodies are about 1 m, in double; gaps are spread from 0.02 to 0.5 m, and the greatest distance asked for is
open. One thread.

Queries: distance, touching, overlap and depth one pair at a time; contacts all at once. For overlap (touching,
with the answer yes), depth and contacts, b is moved until both overlap by 0.01 to 0.1 m. Compare the mean
answers to see that systems agree: a distance or depth in m, the share that touches, or points a contact.
Box2D, in float, has no ellipses, no depth, no contact of two capsules, and polygons of up to 8 corners.

Examples:
  jostle bench plane
  jostle bench plane boxes octagons
  jostle bench plane --peers --json -)",
        run, "How many pairs (10000)", "Other poses of the same kind (1)",
        "Box2D as well, where the build has it");
}

} // namespace jostle_tool
