// SPDX-License-Identifier: MIT
// jostle bench surfaces: a cloth in folds, pressed and shaken in one step.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "bench_run.hpp"
#include "bench_systems.hpp"
#include "commands.hpp"
#include "jostle/surface.hpp"
#include "numbers.hpp"
#include "threads.hpp"
#include "tool/scenes/random.hpp"
#include "turns.hpp"
#ifdef JOSTLE_WITH_PEERS
#include "bench/surface_peers.hpp"
#endif

namespace jostle_tool {

namespace {

using jostle::Aabb3f;
using jostle::Surface;
using jostle::Vec3d;

struct Case
{
    const char* name;
};
constexpr Case all_cases[] = {{"candidates"}, {"near"}, {"moving"}, {"crossings"}, {"impacts"}};

constexpr double edge_length = 0.01, gap = 0.002;
constexpr std::uint32_t folds = 8;

/// A square of cells, two triangles each, in folds one above the other, and where it is shaken to.
struct Cloth
{
    std::vector<Surface::Triangle> triangles;
    std::vector<Vec3d> from, to;
};
Cloth make_cloth(std::uint64_t n, std::uint64_t seed)
{
    const auto in_fold =
        static_cast<std::uint32_t>(std::max(1.0, std::round(std::sqrt(static_cast<double>(n) / 2) / folds)));
    const std::uint32_t side = folds * in_fold + 1;
    jostle_scenes::Random random(seed);
    const auto aside = [&](double most) { return most * (2 * random.uniform() - 1); };
    Cloth cloth;
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x) {
            const std::uint32_t layer = x / in_fold, in = x % in_fold;
            const std::uint32_t along = layer % 2 == 0 ? in : in_fold - in;
            cloth.from.push_back({along * edge_length + aside(edge_length / 10),
                                  y * edge_length + aside(edge_length / 10), layer * gap + aside(0.3 * gap)});
            if (x + 1 < side && y + 1 < side) {
                const std::uint32_t k = y * side + x;
                cloth.triangles.push_back({k, k + 1, k + side});
                cloth.triangles.push_back({k + 1, k + side + 1, k + side});
            }
        }
    cloth.to = cloth.from;
    for (Vec3d& at : cloth.to)
        at = at + Vec3d{aside(edge_length / 5), aside(edge_length / 5), aside(gap)};
    return cloth;
}

/// Boxes around the edges' ways, as floats, which round outwards.
std::vector<Aabb3f> boxes_of_edges(const Surface& surface, const Cloth& cloth)
{
    std::vector<Aabb3f> boxes;
    for (const auto& [a, b] : surface.edges()) {
        const Vec3d lo = min(min(cloth.from[a], cloth.from[b]), min(cloth.to[a], cloth.to[b]));
        const Vec3d hi = max(max(cloth.from[a], cloth.from[b]), max(cloth.to[a], cloth.to[b]));
        Aabb3f box;
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = std::nextafter(static_cast<float>(lo[d]), -INFINITY);
            box.hi[d] = std::nextafter(static_cast<float>(hi[d]), INFINITY);
        }
        boxes.push_back(box);
    }
    return boxes;
}

/// Pairs of edges that share no vertex and whose boxes touch: what an impact is asked about.
struct Queries
{
    std::vector<std::array<Vec3d, 4>> from, to;
};
Queries make_queries(const Surface& surface, const Cloth& cloth, const std::vector<Aabb3f>& boxes)
{
    jostle::PairFinder finder;
    Queries queries;
    for (const jostle::Pair pair : finder.find(jostle::box_view(boxes))) {
        const auto &a = surface.edges()[pair.a], &b = surface.edges()[pair.b];
        if (a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1]) continue;
        queries.from.push_back({cloth.from[a[0]], cloth.from[a[1]], cloth.from[b[0]], cloth.from[b[1]]});
        queries.to.push_back({cloth.to[a[0]], cloth.to[a[1]], cloth.to[b[0]], cloth.to[b[1]]});
    }
    return queries;
}

#ifdef JOSTLE_WITH_PEERS
/// How many pairs of triangles cross: an edge that does belongs to one or two of them.
std::uint64_t crossing_triangles(const Surface& surface,
                                 const jostle::BlockBuffer<jostle::Crossing>& crossings)
{
    std::vector<std::vector<std::uint32_t>> of_edge(surface.edges().size());
    for (std::uint32_t t = 0; t < surface.triangles().size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto& corner = surface.triangles()[t];
            const auto [low, high] = std::minmax(corner[k], corner[(k + 1) % 3]);
            const auto found =
                std::lower_bound(surface.edges().begin(), surface.edges().end(), Surface::Edge{low, high});
            of_edge[static_cast<std::size_t>(found - surface.edges().begin())].push_back(t);
        }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (const jostle::Crossing& crossing : crossings)
        for (const std::uint32_t t : of_edge[crossing.edge])
            pairs.push_back(std::minmax(t, crossing.triangle));
    std::sort(pairs.begin(), pairs.end());
    return static_cast<std::uint64_t>(std::unique(pairs.begin(), pairs.end()) - pairs.begin());
}
#endif

class SurfaceTable : public BenchTable
{
  public:
    SurfaceTable(const BenchOptions& options, std::uint64_t triangles)
        : BenchTable(options), triangles_(triangles)
    {
        if (shown())
            std::printf("%-10s %9s %7s  %-7s %10s %10s %10s %12s\n", "case", "triangles", "threads", "system",
                        "ms", "min", "max", "found");
    }
    void row(const std::string& system, const char* of, std::uint32_t threads, const std::vector<double>& ms,
             std::uint64_t found, std::uint64_t queries = 0)
    {
        JsonRow json{{"system", system},
                     {"scene", of},
                     {"n", triangles_},
                     {"threads", threads},
                     {"median_ms", rounded(median(ms))},
                     {"min_ms", rounded(ms.front())},
                     {"max_ms", rounded(ms.back())},
                     {"found", found}};
        if (queries != 0) json.set("queries", queries);
        add(json);
        if (!shown()) return;
        std::printf("%-10s %9llu %7u  %-7s %10.3f %10.3f %10.3f %12llu", of,
                    static_cast<unsigned long long>(triangles_), threads, system.c_str(), median(ms),
                    ms.front(), ms.back(), static_cast<unsigned long long>(found));
        if (queries != 0)
            std::printf("  %.0f ns each of %s", 1e6 * median(ms) / static_cast<double>(queries),
                        grouped(queries).c_str());
        std::printf("\n");
        std::fflush(stdout);
    }

  private:
    std::uint64_t triangles_;
};

void run(const BenchOptions& options)
{
    const std::vector<const Case*> wanted = choose(options.names, all_cases, "case that is measured");
    const Cloth cloth = make_cloth(options.count, options.seed);
    const Surface surface(cloth.triangles);
    const std::vector<Aabb3f> boxes = boxes_of_edges(surface, cloth);
    SurfaceTable table(options, surface.triangles().size());
    const auto nothing = [](std::uint32_t) {};
    const auto timed = [&](const auto& work) { return sorted_times(1, options.frames, nothing, work); };
    for (const Case* each : wanted) {
        const std::string name = each->name;
        std::uint64_t found = 0;
        for (const std::uint32_t count : options.threads) {
            const Threads threads(count);
            const jostle::FinderOptions with{.executor = &threads.executor()};
            if (name == "candidates") {
                jostle::PairFinder finder(with);
                const auto ms = timed([&] { found = finder.find(jostle::box_view(boxes)).size(); });
                table.row("jostle", each->name, threads.count(), ms, found);
                continue;
            }
            if (name == "impacts") continue; // on one thread
            jostle::SurfaceFinder3d finder(with);
            const auto ms = timed([&] {
                if (name == "near") {
                    const auto& near = finder.near(surface, cloth.from, gap);
                    found = near.vertex_triangle.size() + near.edge_edge.size();
                } else if (name == "moving") {
                    const auto& moving = finder.moving(surface, cloth.from, cloth.to);
                    found = moving.vertex_triangle.size() + moving.edge_edge.size();
                } else {
                    found = finder.crossings(surface, cloth.to).size();
                }
            });
            table.row("jostle", each->name, threads.count(), ms, found);
        }
        if (name == "impacts") {
            const Queries queries = make_queries(surface, cloth, boxes);
            const auto singly = timed([&] {
                found = 0;
                for (std::size_t k = 0; k < queries.from.size(); ++k)
                    found += jostle::edge_edge_impact(queries.from[k], queries.to[k]) ? 1 : 0;
            });
            table.row("singly", each->name, 1, singly, found, queries.from.size());
            std::vector<double> times(queries.from.size());
            const auto ms = timed([&] { jostle::edge_edge_impacts(queries.from, queries.to, times); });
            const auto meet = std::count_if(times.begin(), times.end(), [](double t) { return t <= 1; });
            table.row("jostle", each->name, 1, ms, static_cast<std::uint64_t>(meet), queries.from.size());
            if (static_cast<std::uint64_t>(meet) != found)
                table.differ("impacts: " + std::to_string(found) + " singly, and " + std::to_string(meet) +
                             " in a call");
            jostle::SurfaceFinder3d finder;
            const std::uint64_t moving = finder.moving(surface, cloth.from, cloth.to).edge_edge.size();
            if (moving != found)
                table.differ("impacts: " + std::to_string(found) + ", and moving finds " +
                             std::to_string(moving));
        }
#ifdef JOSTLE_WITH_PEERS
        if (name == "crossings" && options.peers) {
            const auto peer = jostle_bench::make_cgal_crossings();
            peer->start(cloth.triangles, cloth.to);
            std::uint64_t theirs = 0;
            const auto ms = timed([&] { theirs = peer->find(); });
            table.row(peer->name(), each->name, 1, ms, theirs);
            jostle::SurfaceFinder3d finder;
            const std::uint64_t ours = crossing_triangles(surface, finder.crossings(surface, cloth.to));
            if (theirs != ours)
                table.differ("crossings: " + std::to_string(ours) + " pairs of triangles, and " +
                             peer->name() + " finds " + std::to_string(theirs));
        }
        if (name != "candidates" || !options.peers) continue;
        for (const auto& peer : peers_named<3>("embree,cgal")) {
            peer->start(boxes, 1);
            const auto ms = timed([&] { peer->frame(boxes, {}); });
            const std::uint64_t theirs = peer->result().pairs;
            peer->stop();
            table.row(peer->info().name, each->name, 1, ms, theirs);
            if (theirs != found)
                table.differ("candidates: " + std::to_string(found) + ", and " + peer->info().name +
                             " finds " + std::to_string(theirs));
        }
#endif
    }
    table.finish();
}

constexpr const char* help =
    R"(A cloth in 8 folds: edges of 10 mm, 2 mm between the layers, shaken in one step. Cases: candidates, the
pairs of edges whose boxes touch during the step, neighbours included; near, all pairs within 2 mm, with distances
and features; moving, all impacts of the step; crossings, edges that pass through triangles at its end;
impacts, those of all candidates that share no vertex, by edge_edge_impacts and one by one, on one thread.
--peers: Embree and CGAL find the same candidates, on one thread, and must find the same number. CGAL also
finds which triangles cross: as many as have the edges and triangles that cross.

Examples:
  jostle bench surfaces --threads 1
  jostle bench surfaces near moving -n 1000000 --threads 1,2
  jostle bench surfaces candidates --peers --json -)";

} // namespace

void add_bench_surfaces_command(const Command& bench)
{
    const auto [command, options] = add_bench_part(bench, "surfaces", "Times self-collisions of a cloth",
                                                   help, run, {.count = 100'352, .frames = 5});
    command.texts("CASE", options.names, "Which cases; all if none is given");
    command.number("-n", options.count, 128, 100'000'000, "N", "How many triangles, about (100352)");
    command.number("--repetitions", options.frames, 1, 100'000, "R", "How often each is measured (5)");
    add_thread_counts_option(command, options.threads);
    command.seed(options.seed, "Other places of the same kind (1)");
    command.flag("--peers", options.peers, "Embree and CGAL as well, where the build has them");
    add_rows_file_option(command, options.json);
}

} // namespace jostle_tool
