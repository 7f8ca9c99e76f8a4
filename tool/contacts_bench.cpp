// SPDX-License-Identifier: MIT
// jostle bench contacts: how long the detailed test of a pair takes, ours and other systems'.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "bench/contact_peers.hpp"
#include "bench_bodies.hpp"
#include "bench_run.hpp"
#include "commands.hpp"
#include "jostle/contact.hpp"
#include "numbers.hpp"
#include "threads.hpp"
#include "turns.hpp"

namespace jostle_tool {

namespace {

using jostle::Pair;
using jostle::Pose3f;
using jostle::Shape3;
using jostle_bench::BodyKind;
using jostle_bench::BodyShape;
using jostle_bench::ContactCounts;

struct Combination
{
    const char* name;
    BodyKind a, b;
    std::uint64_t pairs_divisor; ///< of --pairs: what is slow gets fewer
};
constexpr Combination all_combinations[] = {
    {"sphere-sphere", BodyKind::sphere, BodyKind::sphere, 1},
    {"capsule-capsule", BodyKind::capsule, BodyKind::capsule, 1},
    {"sphere-capsule", BodyKind::sphere, BodyKind::capsule, 1},
    {"box-box", BodyKind::box, BodyKind::box, 1},
    {"sphere-box", BodyKind::sphere, BodyKind::box, 1},
    {"capsule-box", BodyKind::capsule, BodyKind::box, 1},
    {"cylinder-cylinder", BodyKind::cylinder, BodyKind::cylinder, 2},
    {"cone-cone", BodyKind::cone, BodyKind::cone, 2},
    {"ellipsoid-ellipsoid", BodyKind::ellipsoid, BodyKind::ellipsoid, 2},
    {"sphere-cylinder", BodyKind::sphere, BodyKind::cylinder, 2},
    {"cylinder-box", BodyKind::cylinder, BodyKind::box, 2},
    {"cone-box", BodyKind::cone, BodyKind::box, 2},
    {"ellipsoid-box", BodyKind::ellipsoid, BodyKind::box, 2},
    {"hull-hull", BodyKind::hull, BodyKind::hull, 2},
    {"box-hull", BodyKind::box, BodyKind::hull, 2},
    {"sphere-mesh", BodyKind::sphere, BodyKind::mesh, 4},
    {"capsule-mesh", BodyKind::capsule, BodyKind::mesh, 4},
    {"box-mesh", BodyKind::box, BodyKind::mesh, 4},
    {"hull-mesh", BodyKind::hull, BodyKind::mesh, 4},
};

constexpr std::uint32_t warm_up = 2;
constexpr std::size_t pose_sets = 4;

/// Pairs of bodies of about 1 m whose gaps are spread from -0.1 to 0.1 m: half of them touch. Between frames
/// every body of a pair moves and turns a little.
struct PairScene
{
    std::vector<BodyShape> bodies;
    std::vector<Shape3> shapes;
    std::vector<std::vector<Pose3f>> poses; ///< one set per frame, in turn
    std::vector<Pair> pairs;

    std::vector<std::vector<jostle::Vec<3, double>>> points;
    std::vector<std::vector<std::array<std::uint32_t, 3>>> triangles;
    std::vector<std::unique_ptr<jostle::ConvexHull<3>>> hulls;
    std::unique_ptr<jostle::Mesh<3>> mesh;
};

constexpr std::size_t hull_models = 64;

void add_hull_models(PairScene& scene, RandomBodies& numbers)
{
    for (std::size_t k = 0; k < hull_models; ++k) {
        std::vector<jostle::Vec<3, double>> points(32);
        for (auto& p : points) { // on a sphere: all are corners
            p = numbers.in_ball();
            const double size = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
            for (double& x : p)
                x *= 0.6 / size;
        }
        scene.hulls.push_back(std::make_unique<jostle::ConvexHull<3>>(points));
        const auto corners = scene.hulls.back()->vertices();
        scene.points.emplace_back(corners.begin(), corners.end());
        scene.triangles.push_back(triangles_of(*scene.hulls.back()));
    }
}

/// Hills of 1 m over 100 x 100 cells of 0.5 m.
void add_terrain(PairScene& scene)
{
    constexpr std::uint32_t cells = 100;
    auto& points = scene.points.emplace_back();
    auto& triangles = scene.triangles.emplace_back();
    for (std::uint32_t z = 0; z <= cells; ++z)
        for (std::uint32_t x = 0; x <= cells; ++x)
            points.push_back({x * 0.5, std::sin(x * 0.31) * std::cos(z * 0.23), z * 0.5});
    for (std::uint32_t z = 0; z < cells; ++z)
        for (std::uint32_t x = 0; x < cells; ++x) {
            const std::uint32_t at = z * (cells + 1) + x;
            triangles.push_back({at, at + cells + 2, at + 1});
            triangles.push_back({at, at + cells + 1, at + cells + 2});
        }
    scene.mesh = std::make_unique<jostle::Mesh<3>>(points, triangles);
}

void add_body(PairScene& scene, BodyKind kind, RandomBodies& numbers)
{
    BodyShape body{kind};
    switch (kind) {
    case BodyKind::sphere:
        body.radius = numbers.uniform(0.3, 0.6);
        break;
    case BodyKind::capsule:
        body.radius = numbers.uniform(0.15, 0.3);
        body.half_length = numbers.uniform(0.2, 0.5);
        break;
    case BodyKind::cylinder:
    case BodyKind::cone:
        body.radius = numbers.uniform(0.25, 0.5);
        body.half_length = numbers.uniform(0.25, 0.6);
        break;
    case BodyKind::box:
    case BodyKind::ellipsoid:
        for (double& h : body.half)
            h = numbers.uniform(0.25, 0.6);
        break;
    case BodyKind::hull:
    case BodyKind::mesh: {
        const bool is_hull = kind == BodyKind::hull;
        const std::size_t model = is_hull ? static_cast<std::size_t>(numbers.uniform(0, hull_models - 0.001))
                                          : scene.points.size() - 1;
        body.points = scene.points[model];
        body.triangles = scene.triangles[model];
        scene.shapes.push_back(is_hull ? Shape3(*scene.hulls[model]) : Shape3(*scene.mesh));
        scene.bodies.push_back(body);
        return;
    }
    }
    scene.shapes.push_back(shape_of(body));
    scene.bodies.push_back(body);
}

std::unique_ptr<PairScene> make_scene(const Combination& combination, std::uint64_t count, std::uint64_t seed)
{
    auto made = std::make_unique<PairScene>();
    PairScene& scene = *made;
    RandomBodies numbers(seed);
    if (combination.a == BodyKind::hull || combination.b == BodyKind::hull) add_hull_models(scene, numbers);
    const bool with_mesh = combination.b == BodyKind::mesh;
    std::vector<Pose3f> base;
    if (with_mesh) {
        add_terrain(scene);
        add_body(scene, BodyKind::mesh, numbers);
        base.emplace_back();
    }
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint32_t a = static_cast<std::uint32_t>(scene.shapes.size());
        add_body(scene, combination.a, numbers);
        if (with_mesh) {
            Pose3f pose{
                {static_cast<float>(numbers.uniform(2, 48)), 3, static_cast<float>(numbers.uniform(2, 48))},
                numbers.rotation<float>()};
            const double gap = numbers.uniform(-0.1, 0.1);
            for (int step = 0; step < 3; ++step)
                if (const auto d = jostle::distance(scene.shapes[a], pose, scene.shapes[0], Pose3f{}, 1e9f))
                    pose.position[1] -= static_cast<float>(d->distance - gap);
            base.push_back(pose);
            scene.pairs.push_back({a, 0});
            continue;
        }
        add_body(scene, combination.b, numbers);
        Pose3f pose_a{{}, numbers.rotation<float>()}, pose_b{{}, numbers.rotation<float>()};
        const auto away = numbers.in_ball();
        const double size = std::sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]);
        for (std::size_t d = 0; d < 3; ++d) {
            pose_a.position[d] = static_cast<float>(numbers.uniform(-100, 100));
            pose_b.position[d] = pose_a.position[d] + static_cast<float>(away[d] * 3 / size);
        }
        const double gap = numbers.uniform(-0.1, 0.1);
        for (int step = 0; step < 3; ++step)
            if (const auto d = jostle::distance(scene.shapes[a], pose_a, scene.shapes[a + 1], pose_b, 1e9f))
                for (std::size_t k = 0; k < 3; ++k)
                    pose_b.position[k] -= d->normal[k] * static_cast<float>(d->distance - gap);
        base.push_back(pose_a);
        base.push_back(pose_b);
        scene.pairs.push_back({a, a + 1});
    }
    for (std::size_t set = 0; set < pose_sets; ++set) {
        auto& poses = scene.poses.emplace_back(base);
        for (std::size_t i = with_mesh ? 1 : 0; i < poses.size(); ++i) {
            const auto nudge = numbers.in_ball();
            for (std::size_t k = 0; k < 3; ++k) {
                poses[i].position[k] += static_cast<float>(0.01 * nudge[k]);
                poses[i].rotation[k] += static_cast<float>(0.01 * nudge[2 - k]);
            }
        }
    }
    return made;
}

struct Measured
{
    std::vector<double> ms;
    ContactCounts counts;
};

template <class Move, class Frame>
Measured measure(const PairScene& scene, std::uint32_t frames, const Move& move, const Frame& frame)
{
    return {
        sorted_times(warm_up, frames, [&](std::uint32_t f) { move(scene.poses[f % pose_sets]); }, frame), {}};
}

/// What `find` finds, with `points(contact)` points in each contact.
template <class Find, class Points>
Measured measure_ours(const PairScene& scene, std::uint32_t frames, const Find& find, const Points& points)
{
    const std::vector<Pose3f>* poses = nullptr;
    decltype(find(*poses)) found = nullptr;
    Measured result = measure(
        scene, frames, [&](const std::vector<Pose3f>& given) { poses = &given; },
        [&] { found = find(*poses); });
    Pair last{~0u, ~0u};
    for (const auto& contact : *found) {
        result.counts.points += points(contact);
        if (!(contact.pair == last)) ++result.counts.touching;
        last = contact.pair;
    }
    return result;
}

Measured measure_jostle(const PairScene& scene, std::uint32_t frames, jostle::Executor& executor)
{
    jostle::ContactFinder3f finder({.executor = &executor});
    return measure_ours(
        scene, frames,
        [&](const std::vector<Pose3f>& poses) { return &finder.find({scene.shapes, poses}, scene.pairs); },
        [](const auto& contact) { return contact.count; });
}

/// find_points: of each contact the deepest point alone.
Measured measure_points(const PairScene& scene, std::uint32_t frames, jostle::Executor& executor)
{
    jostle::ContactFinder3f finder({.executor = &executor});
    return measure_ours(
        scene, frames,
        [&](const std::vector<Pose3f>& poses) {
            return &finder.find_points({scene.shapes, poses}, scene.pairs);
        },
        [](const auto&) { return 1u; });
}

class Table : public BenchTable
{
  public:
    explicit Table(const BenchOptions& options) : BenchTable(options)
    {
        if (shown())
            std::printf("%-19s %8s %7s  %-8s %10s %9s %9s %9s %9s\n", "pair", "pairs", "threads", "system",
                        "ns/pair", "min", "max", "touching", "points");
    }
    void add_row(const char* system, const Combination& combination, const PairScene& scene,
                 std::uint32_t threads, const Measured& measured, double reference_ns)
    {
        const double to_ns = 1e6 / static_cast<double>(scene.pairs.size());
        const double median_ns = median(measured.ms) * to_ns;
        add({{"system", system},
             {"pair", combination.name},
             {"pairs", scene.pairs.size()},
             {"threads", threads},
             {"median_ns", std::round(median_ns * 10) / 10},
             {"min_ns", std::round(measured.ms.front() * to_ns * 10) / 10},
             {"max_ns", std::round(measured.ms.back() * to_ns * 10) / 10},
             {"touching", measured.counts.touching},
             {"points", measured.counts.points}});
        if (!shown()) return;
        std::printf("%-19s %8zu %7u  %-8s %10.1f %9.1f %9.1f %9llu %9llu", combination.name,
                    scene.pairs.size(), threads, system, median_ns, measured.ms.front() * to_ns,
                    measured.ms.back() * to_ns, static_cast<unsigned long long>(measured.counts.touching),
                    static_cast<unsigned long long>(measured.counts.points));
        if (reference_ns > 0) std::printf("   %.1fx", median_ns / reference_ns);
        std::printf("\n");
        std::fflush(stdout);
    }
};

void run(const BenchOptions& options)
{
    const std::vector<const Combination*> wanted =
        choose(options.names, all_combinations, "pair of shapes that is measured");
    Table table(options);
    for (const Combination* combination : wanted) {
        const std::uint64_t count = std::max<std::uint64_t>(1, options.count / combination->pairs_divisor);
        const std::unique_ptr<PairScene> scene = make_scene(*combination, count, options.seed);
        for (const std::uint32_t asked : options.threads) {
            const Threads threads(asked);
            const Measured own = measure_jostle(*scene, options.frames, threads.executor());
            table.add_row("jostle", *combination, *scene, threads.count(), own, 0);
            const double own_ns = median(own.ms) * 1e6 / static_cast<double>(scene->pairs.size());
            table.add_row("points", *combination, *scene, threads.count(),
                          measure_points(*scene, options.frames, threads.executor()), own_ns);
#ifdef JOSTLE_WITH_PEERS
            if (!options.peers) continue;
            for (const auto& make : {jostle_bench::make_bullet_contacts, jostle_bench::make_fcl_contacts}) {
                const auto peer = make();
                if (!peer->has(combination->a) || !peer->has(combination->b)) continue;
                peer->start(scene->bodies, scene->pairs, threads.executor());
                Measured theirs = measure(
                    *scene, options.frames, [&](const std::vector<Pose3f>& poses) { peer->move(poses); },
                    [&] { peer->frame(); });
                theirs.counts = peer->counts();
                table.add_row(peer->name(), *combination, *scene, threads.count(), theirs, own_ns);
            }
#endif
        }
    }
    table.finish();
}

} // namespace

void add_bench_contacts_command(const Command& bench)
{
    const auto [command, options] = add_bench_part(
        bench, "contacts", "Times contacts of shapes",
        R"(Pairs: of spheres, boxes, capsules, cylinders, cones, ellipsoids, hulls (32 corners each), and a mesh (20,000
triangles). Bodies are about 1 m; gaps are spread from -0.1 to 0.1 m, so that half of the pairs touch. Times go from
poses to contact points; in the rows `points`, to the deepest point of each contact (find_points). Other systems
have margins and depths of their own, so their numbers of touching pairs differ. Bullet has no ellipsoids.

Examples:
  jostle bench contacts
  jostle bench contacts box-box hull-hull --threads 1,2
  jostle bench contacts --peers --json -)",
        run, {.count = 20'000, .frames = 15});
    command.texts("PAIR", options.names, "Which pairs of shapes; all if none is given");
    command.number("-n", options.count, 1, 10'000'000, "N",
                   "How many pairs (20000); of hulls, cylinders, cones and ellipsoids half, of meshes a "
                   "quarter as many");
    add_thread_counts_option(command, options.threads);
    command.number("--frames", options.frames, 1, 100'000, "F", "How many frames are counted (15)");
    command.seed(options.seed, "Other bodies of the same kind (1)");
    command.flag("--peers", options.peers, "Bullet and FCL as well, where the build has them");
    add_rows_file_option(command, options.json);
}

} // namespace jostle_tool
