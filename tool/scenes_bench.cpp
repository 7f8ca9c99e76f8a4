// SPDX-License-Identifier: MIT
// jostle bench scenes: many small scenes in one call, beside a call for each and the work alone.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench_run.hpp"
#include "clock.hpp"
#include "commands.hpp"
#include "jostle/find_pairs.hpp"
#include "numbers.hpp"
#include "threads.hpp"
#include "tool/scenes/scenes.hpp"
#include "turns.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb3f;

struct Row
{
    std::uint64_t n, scenes, pairs;
    std::uint32_t threads;
    double together, one_by_one, parts; // ms of all scenes, median
};

Row measure(const BenchOptions& options, std::uint64_t n, jostle::Executor& executor, std::uint32_t threads)
{
    const std::uint64_t scenes = std::max<std::uint64_t>(1, options.count / n);
    std::vector<Aabb3f> boxes;
    std::vector<std::uint64_t> offsets{0};
    // A hundred different ones, again and again: making a scene takes longer than searching it.
    std::vector<std::vector<Aabb3f>> different;
    for (std::uint64_t k = 0; k < scenes; ++k) {
        if (k < 100) {
            const jostle_scenes::Scene<3, float> scene("uniform", n, k + 1);
            different.emplace_back(scene.boxes().begin(), scene.boxes().end());
        }
        const std::vector<Aabb3f>& scene = different[k % different.size()];
        boxes.insert(boxes.end(), scene.begin(), scene.end());
        offsets.push_back(boxes.size());
    }
    const jostle::BoxView<3, float> all(boxes);
    jostle::PairFinder together(jostle::FinderOptions{.executor = &executor});
    jostle::PairFinder alone(jostle::FinderOptions{.executor = &jostle::serial_executor()});
    std::uint64_t pairs = 0, pairs_alone = 0;
    double least = 0; // of each different scene, searched again and again: what the work alone takes
    for (const std::vector<Aabb3f>& scene : different) {
        double best = std::numeric_limits<double>::infinity();
        for (std::uint32_t turn = 0; turn < 5 + 2'000 / n; ++turn) {
            const auto before = Clock::now();
            (void)alone.find(scene);
            const auto after = Clock::now();
            best = std::min(best, ms_between(before, after));
        }
        least += best;
    }
    const std::vector<double> ms =
        medians(options.frames, {[&] { pairs = together.find_scenes(all, offsets).size(); },
                                 [&] {
                                     pairs_alone = 0;
                                     for (std::uint64_t k = 0; k < scenes; ++k)
                                         pairs_alone += alone.find(all.subview(offsets[k], n)).size();
                                 }});
    if (pairs != pairs_alone)
        throw std::runtime_error("scenes of " + std::to_string(n) + " boxes: " + std::to_string(pairs) +
                                 " pairs in one call, " + std::to_string(pairs_alone) +
                                 " in a call for each");
    return {n,
            scenes,
            pairs,
            threads,
            ms[0],
            ms[1],
            least / static_cast<double>(different.size()) * static_cast<double>(scenes)};
}

void run(const BenchOptions& options)
{
    BenchTable table(options);
    const Threads threads(options.threads.front());
    if (table.shown())
        std::printf("%7s %9s %8s %11s %11s %11s %13s\n", "n", "scenes", "threads", "find_scenes", "find each",
                    "parts", "a scene");
    for (const std::uint64_t n : options.sizes) {
        const Row row = measure(options, n, threads.executor(), threads.count());
        if (table.shown()) {
            std::printf("%7llu %9llu %8u %8.3f ms %8.3f ms %8.3f ms %10.3f us\n",
                        static_cast<unsigned long long>(row.n), static_cast<unsigned long long>(row.scenes),
                        row.threads, row.together, row.one_by_one, row.parts,
                        row.together * 1e3 / static_cast<double>(row.scenes));
            std::fflush(stdout);
        }
        table.add({{"n", row.n},
                   {"scenes", row.scenes},
                   {"threads", row.threads},
                   {"pairs", row.pairs},
                   {"median_ms", rounded(row.together)},
                   {"one_by_one_ms", rounded(row.one_by_one)},
                   {"parts_ms", rounded(row.parts)}});
    }
    table.finish();
}

constexpr const char* help =
    R"(Scenes of n boxes each, 262,144 boxes in all: find_scenes on all threads, find for each scene on one thread,
and the parts: the least time of one scene that is searched repeatedly, times the number of scenes. If the numbers
of pairs differ, the exit status is 1.

Examples:
  jostle bench scenes
  jostle bench scenes -n 64 --threads 1 --json -)";

} // namespace

void add_bench_scenes_command(const Command& bench)
{
    const auto [command, options] =
        add_bench_part(bench, "scenes", "Times many small scenes in one call", help, run,
                       {.sizes = {2, 16, 64, 128, 256, 1'000}, .count = 262'144, .frames = 15});
    add_sizes_option(command, options.sizes, "2,16,64,128,256,1000");
    command.number("--boxes", options.count, 1, 10'000'000, "N", "How many boxes in all (262144)");
    command.number("--frames", options.frames, 1, 10'000, "F", "How many frames are counted (15)");
    command.threads(options.threads.front());
    add_rows_file_option(command, options.json);
}

} // namespace jostle_tool
