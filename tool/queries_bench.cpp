// SPDX-License-Identifier: MIT
// jostle bench queries: rays, sweeps, regions and nearest objects among boxes that lie still, ours and
// other systems'.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <memory_resource>
#include <numeric>
#include <string>
#include <vector>

#include "asker.hpp"
#include "bench/query_peers.hpp"
#include "bench_run.hpp"
#include "clock.hpp"
#include "commands.hpp"
#include "jostle/box_index.hpp"
#include "numbers.hpp"
#include "progress.hpp"
#include "threads.hpp"
#include "tool/scenes/scenes.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb3f;
using jostle::BoxIndex3f;
using jostle_bench::Answers;
using jostle_bench::Queries;
using jostle_bench::QueryKind;

struct Row
{
    const char* name;
    const char* summary;
    QueryBatch batch;
};
// In the order in which they are made and asked.
constexpr Row rows[] = {
    {"first", "the first box along a ray of half the world's length", {QueryKind::first, 4000}},
    {"all", "all boxes along such a ray", {QueryKind::all, 4000}},
    {"sweep",
     "the first box touched by a unit box that moves by a tenth of the world",
     {QueryKind::sweep, 4000}},
    {"box-1", "all boxes that touch a box of edge 1", {QueryKind::box, 4000, 1}},
    {"box-10", "... of edge 10", {QueryKind::box, 2000, 10}},
    {"box-20%", "... of a fifth of the world's edge", {QueryKind::box, 200}},
    {"sphere", "all boxes that touch a sphere of radius 5", {QueryKind::sphere, 2000}},
    {"nearest-1", "the box nearest to a point", {QueryKind::nearest, 4000, 1}},
    {"nearest-8", "the 8 nearest", {QueryKind::nearest, 4000, 8}},
    {"frustum", "all boxes in a view of 30 degrees, half the world deep", {QueryKind::frustum, 200}},
    {"count-1", "how many boxes touch a box of edge 1", {QueryKind::box, 4000, 1, true}},
    {"count-10", "... of edge 10", {QueryKind::box, 2000, 10, true}},
    {"count-20%", "... of a fifth of the world's edge", {QueryKind::box, 200, 0, true}},
};

/// Some systems take milliseconds for one query: a batch that has taken this long isn't asked again.
constexpr double patience_ms = 1'000;

/// The median of some runs after one that isn't counted, in microseconds.
template <class Run>
double median_of(std::uint32_t repetitions, const Run& run)
{
    run();
    std::vector<double> times;
    const auto begin = Clock::now();
    do {
        const auto start = Clock::now();
        run();
        times.push_back(1e3 * ms_since(start));
    } while (times.size() < repetitions && ms_since(begin) < patience_ms);
    return median(std::move(times));
}

class Table : public BenchTable
{
  public:
    explicit Table(const BenchOptions& options) : BenchTable(options)
    {
        if (!shown()) return;
        std::printf("%-10s %10s %8s %-10s %-8s %12s %12s %8s\n", "scene", "n", "threads", "query", "system",
                    "us each", "results", "");
    }
    void add_row(const std::string& scene, std::uint64_t n, std::uint32_t threads, const Row& row,
                 const std::string& system, double us, const Answers& answers)
    {
        const double each = us / row.batch.queries;
        if (system == "jostle") {
            ours_ = each;
            expected_ = answers;
        } else if (!(answers == expected_)) {
            differ(system + " and jostle differ: " + scene + ", " + std::to_string(n) + ", " + row.name);
        }
        if (shown()) {
            const double share = static_cast<double>(answers.results) / row.batch.queries;
            std::printf("%-10s %10llu %8u %-10s %-8s %12.3f %12.1f", scene.c_str(),
                        static_cast<unsigned long long>(n), threads, row.name, system.c_str(), each, share);
            if (system != "jostle")
                std::printf(" %6.1fx%s", each / ours_, answers == expected_ ? "" : "  DIFFERENT");
            std::printf("\n");
            std::fflush(stdout);
        }
        add({{"system", system},
             {"scene", scene},
             {"n", n},
             {"threads", threads},
             {"query", row.name},
             {"queries", row.batch.queries},
             {"us_each", rounded(each)},
             {"results", answers.results},
             {"checksum", std::to_string(answers.checksum)}});
    }
    /// What is done once for all boxes.
    void add_whole(const std::string& scene, std::uint64_t n, std::uint32_t threads, const char* what,
                   double us)
    {
        const double ms = us / 1000;
        if (shown())
            std::printf("%-10s %10llu %8u %-10s %-8s %9.3f ms\n", scene.c_str(),
                        static_cast<unsigned long long>(n), threads, what, "jostle", ms);
        add({{"system", "jostle"},
             {"scene", scene},
             {"n", n},
             {"threads", threads},
             {"query", what},
             {"ms", rounded(ms)}});
    }

  private:
    double ours_ = 0;
    Answers expected_;
};

double ask_ours(const BoxIndex3f& index, const Row& row, const Queries& queries, std::uint32_t repetitions,
                Answers& answers)
{
    double time = 0;
    std::vector<jostle::Hit<float>> firsts(row.batch.queries);
    jostle::ResultLists<jostle::Hit<float>> hits;
    jostle::ResultLists<std::uint32_t> ids;
    const auto sum_firsts = [&] {
        for (std::size_t i = 0; i < firsts.size(); ++i)
            if (firsts[i].id != firsts[i].none) answers.add_object(i, firsts[i].id);
    };
    const auto sum_ids = [&] {
        for (std::size_t i = 0; i < ids.size(); ++i)
            for (const std::uint32_t id : ids[i])
                answers.add_object(i, id);
    };
    switch (row.batch.kind) {
    case QueryKind::first:
        time = median_of(repetitions, [&] {
            index.first(std::span<const jostle::Ray3f>(queries.rays), std::span(firsts));
        });
        sum_firsts();
        break;
    case QueryKind::sweep:
        time = median_of(repetitions, [&] {
            index.first(std::span<const jostle::Sweep3f>(queries.sweeps), std::span(firsts));
        });
        sum_firsts();
        break;
    case QueryKind::all:
        time = median_of(repetitions, [&] { index.all(std::span<const jostle::Ray3f>(queries.rays), hits); });
        for (std::size_t i = 0; i < hits.size(); ++i)
            for (const auto& hit : hits[i])
                answers.add_object(i, hit.id);
        break;
    case QueryKind::box:
        if (row.batch.only_count) {
            std::vector<std::uint64_t> counts(row.batch.queries);
            time = median_of(repetitions,
                             [&] { index.count(std::span<const Aabb3f>(queries.boxes), std::span(counts)); });
            answers.results = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
            break;
        }
        time = median_of(repetitions, [&] { index.all(std::span<const Aabb3f>(queries.boxes), ids); });
        sum_ids();
        break;
    case QueryKind::sphere:
        time = median_of(repetitions,
                         [&] { index.all(std::span<const jostle::Sphere3f>(queries.spheres), ids); });
        sum_ids();
        break;
    case QueryKind::nearest:
        time = median_of(repetitions,
                         [&] { index.nearest(std::span<const jostle::Nearest3f>(queries.nearest), hits); });
        for (std::size_t i = 0; i < hits.size(); ++i)
            for (const auto& hit : hits[i])
                answers.add_distance(i, hit.at);
        break;
    case QueryKind::frustum: {
        std::vector<jostle::Frustum3f> frustums;
        for (const auto& planes : queries.frustums)
            frustums.push_back({planes});
        time = median_of(repetitions, [&] { index.all(std::span<const jostle::Frustum3f>(frustums), ids); });
        sum_ids();
        break;
    }
    }
    return time;
}

void measure(const BenchOptions& options, const std::string& scene_name, std::uint64_t n, Table& table)
{
    const jostle_scenes::Scene<3, float> scene(scene_name, n, options.seed);
    const std::span<const Aabb3f> boxes = scene.boxes();
#ifdef JOSTLE_WITH_PEERS
    std::vector<std::unique_ptr<jostle_bench::QueryPeer>> peers;
    if (options.peers) peers = jostle_bench::make_query_peers();
    for (const auto& peer : peers) {
        Progress progress(scene_name + ", " + std::to_string(n) + " boxes, building " + peer->name(), 0);
        peer->build(boxes);
    }
#endif
    for (const std::uint32_t count : options.threads) {
        const Threads threads(count);
        BoxIndex3f index({.executor = &threads.executor()});
        const std::uint32_t few = std::min(options.frames, 3u);
        table.add_whole(scene_name, n, threads.count(), "build", median_of(few, [&] { index.build(boxes); }));
        std::pmr::vector<jostle::Pair> joined;
        table.add_whole(scene_name, n, threads.count(), "join",
                        median_of(few, [&] { index.join(jostle::BoxView<3, float>(boxes), joined); }));
        Asker asker(boxes, options.seed);
        for (const Row& row : rows) {
            const Queries queries = asker.make(row.batch);
            Answers answers;
            const double time = ask_ours(index, row, queries, options.frames, answers);
            table.add_row(scene_name, n, threads.count(), row, "jostle", time, answers);
#ifdef JOSTLE_WITH_PEERS
            for (const auto& peer : peers) {
                if (!peer->answers(row.batch.kind)) continue;
                AskedPeer asked(*peer, row.batch, queries, threads.count());
                const double peer_time = median_of(options.frames, [&] { asked.ask(); });
                const Answers theirs = asked.answers();
                table.add_row(scene_name, n, threads.count(), row, peer->name(), peer_time, theirs);
            }
#endif
        }
    }
}

void run(const BenchOptions& options)
{
    check_for_peers(options.peers);
    check_scenes(options.names);
    Table table(options);
    for (const std::string& scene : options.names)
        for (const std::uint64_t n : options.sizes)
            measure(options, scene, n, table);
    table.finish();
}

} // namespace

void add_bench_queries_command(const Command& bench)
{
    const auto [command, options] = add_bench_part(
        bench, "queries", "Times rays, regions and nearest objects", listed("Queries", rows, 11) + R"(
  build      the index, once
  join       which of the boxes touch each of them, once for all

The boxes lie still; places and directions are random, near some box. Jostle answers in batches, on all threads, with
sorted lists; the others' lists have any order. If systems find different boxes, the exit status is 1.

Examples:
  jostle bench queries                              uniform boxes, 10,000 to 1,000,000
  jostle bench queries powerlaw -n 100000 --threads 1,2
  jostle bench queries --peers --json -)",
        run, {.names = {"uniform"}, .sizes = {10'000, 100'000, 1'000'000}, .frames = 5});
    command.texts("SCENE", options.names, "Which scenes, as in jostle bench (uniform)");
    add_sizes_option(command, options.sizes, "10000,100000,1000000");
    add_thread_counts_option(command, options.threads);
    command.number("--repetitions", options.frames, 1, 100'000, "R",
                   "How often each batch is asked; the median counts (5). None again after a second");
    command.seed(options.seed, "Other boxes and queries of the same kind (1)");
    add_rows_file_option(command, options.json);
    command.flag("--peers", options.peers, "Other systems as well, where the build has them");
}

} // namespace jostle_tool
