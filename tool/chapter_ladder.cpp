// SPDX-License-Identifier: MIT
// jostle chapter --ladder and --cells: what each step from the chapter to the engine brings, and what cell
// sizes cost.
#include "chapter_ladder.hpp"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <optional>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "bench/ladder/ladder.hpp"
#include "bench/ladder/responses.hpp"
#include "clock.hpp"
#include "jostle/chapter.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/process.hpp"
#include "numbers.hpp"
#include "progress.hpp"
#include "text.hpp"
#include "threads.hpp"
#include "tool/scenes/scenes.hpp"

namespace jostle_tool {
namespace {

namespace chapter = jostle::chapter;
namespace ladder = jostle_ladder;
using Json = nlohmann::ordered_json;

/// So many objects search on the first rung, which takes hours for a million boxes.
constexpr std::uint32_t most_searches = 20'000;
/// The objects of the all-pairs loops: n (n-1) / 2 tests, as in the chapter's figures.
constexpr std::uint32_t all_pairs_objects = 9993;

/// The median time of five runs, of fewer where they are slow; the first one counts only if it is the only
/// one.
template <class Work>
double median_ms(Work work)
{
    std::vector<double> times;
    for (std::size_t wanted = 1; times.size() < wanted;) {
        const auto begin = Clock::now();
        work();
        times.push_back(ms_since(begin));
        if (times.size() == 1) wanted = times[0] > 20'000 ? 1 : times[0] > 2'000 ? 2 : 6;
    }
    if (times.size() > 1) times.erase(times.begin());
    return median(times);
}

std::vector<jostle::Pair> sorted(std::vector<jostle::Pair> pairs)
{
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

std::vector<jostle::Pair> all_pairs(ladder::Boxes boxes)
{
    const jostle::PairBuffer pairs = jostle::find_pairs(boxes);
    return sorted({pairs.begin(), pairs.end()});
}

/// One rung on one scene: a row for each number of threads, checked against `truth`.
void measure_rung(const ladder::RungInfo& info, const LadderOptions& options, ladder::Boxes boxes,
                  const std::vector<jostle::Pair>& truth, Json& rows, Progress& progress)
{
    for (const std::uint32_t count : options.threads) {
        const Threads threads(count);
        const auto rung = info.make(most_searches);
        const double ms = median_ms([&] { rung->find(boxes, threads.executor()); });
        const ladder::Counts counts = rung->counts();
        const double scale = static_cast<double>(boxes.size()) / static_cast<double>(counts.searched);
        const std::vector<jostle::Pair> found = sorted(rung->pairs());
        const std::uint64_t true_pairs = found.size() - counts.selves;
        if (info.exact && found != truth)
            throw std::logic_error("the rung '" + std::string(info.name) + "' and the engine differ");
        Json row{{"what", "find"},        {"rung", info.name},          {"scene", options.scene},
                 {"n", boxes.size()},     {"threads", count},           {"ms", rounded(ms * scale)},
                 {"pairs", truth.size()}, {"searched", counts.searched}};
        if (scale == 1) {
            row["missed"] = truth.size() - true_pairs;
            row["selves"] = counts.selves;
        }
        const auto searched = static_cast<double>(counts.searched);
        row["again_per_pair"] =
            rounded(static_cast<double>(counts.again) / static_cast<double>(found.size()));
        row["probes_per_box"] = rounded(static_cast<double>(counts.probes) / searched);
        row["candidates_per_box"] = rounded(static_cast<double>(counts.candidates) / searched);
        row["bytes_per_box"] = rounded(static_cast<double>(counts.bytes) / static_cast<double>(boxes.size()));
        rows.push_back(row);
        progress.step();
    }
}

void measure_responses(const LadderOptions& options, std::uint32_t objects,
                       const std::vector<jostle::Pair>& pairs, Json& rows, Progress& progress)
{
    std::optional<std::vector<ladder::Push>> expected;
    for (const ladder::ResponseInfo& info : ladder::response_ways()) {
        for (const std::uint32_t count : options.threads) {
            const Threads threads(count);
            const auto way = info.make(objects);
            std::vector<ladder::Push> sums;
            const double ms = median_ms([&] { sums = way->sum(pairs, threads.executor()); });
            if (expected && sums != *expected) throw std::logic_error("two ways to add up responses differ");
            expected = sums;
            rows.push_back({{"what", "responses"},
                            {"way", info.name},
                            {"scene", options.scene},
                            {"n", objects},
                            {"threads", count},
                            {"ms", rounded(ms)},
                            {"pairs", pairs.size()}});
            progress.step();
        }
    }
}

/// Row i of the all-pairs loop.
std::uint64_t test_row(ladder::Boxes boxes, std::uint32_t i)
{
    std::uint64_t found = 0;
    for (std::uint32_t j = i + 1; j < boxes.size(); ++j)
        found += jostle::overlaps(boxes[i], boxes[j]) ? 1 : 0;
    return found;
}

using Tally = std::vector<std::uint64_t>; // found by each processor; written once by each

void equal_blocks(ladder::Boxes boxes, jostle::Executor& executor, Tally& tally)
{
    const auto objects = static_cast<std::uint32_t>(boxes.size());
    chapter::on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t processors) {
        const chapter::Interval rows = chapter::work_interval(processor, processors, objects);
        for (std::uint32_t i = rows.begin; i < rows.end; ++i)
            tally[processor] += test_row(boxes, i);
    });
}
void zigzag(ladder::Boxes boxes, jostle::Executor& executor, Tally& tally)
{
    const auto objects = static_cast<std::uint32_t>(boxes.size());
    chapter::on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t processors) {
        const std::uint64_t delta = std::uint64_t{processors} * 2 - 1;
        for (std::uint64_t i = processor; i < objects; i += delta - 2 * (i % processors))
            tally[processor] += test_row(boxes, static_cast<std::uint32_t>(i));
    });
}
void behind_a_lock(ladder::Boxes boxes, jostle::Executor& executor, Tally& tally)
{
    std::mutex mutex;
    std::uint32_t next = 0;
    chapter::on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t) {
        for (;;) {
            std::uint32_t begin;
            {
                const std::scoped_lock lock(mutex);
                begin = next;
                next += 16;
            }
            if (begin >= boxes.size()) return;
            for (std::uint32_t i = begin; i < std::min<std::size_t>(begin + 16, boxes.size()); ++i)
                tally[processor] += test_row(boxes, i);
        }
    });
}
void by_an_atomic(ladder::Boxes boxes, jostle::Executor& executor, Tally& tally)
{
    std::atomic<std::uint64_t> found{0};
    jostle::process_items(boxes.size(),
                          [&](std::uint64_t a, std::uint64_t, jostle::Work) {
                              found.fetch_add(test_row(boxes, static_cast<std::uint32_t>(a)),
                                              std::memory_order_relaxed);
                          },
                          {.executor = &executor, .block_items = 1});
    tally[0] = found;
}

struct Sharing
{
    const char* name;
    void (*run)(ladder::Boxes, jostle::Executor&, Tally&);
};
constexpr Sharing sharings[] = {{"equal blocks (Alg. 13)", equal_blocks},
                                {"zig-zag (Alg. 14)", zigzag},
                                {"batches behind a lock (as Alg. 11)", behind_a_lock},
                                {"rows by an atomic counter", by_an_atomic}};

void measure_sharing(const LadderOptions& options, Json& rows, Progress& progress)
{
    const jostle_scenes::Scene<3, float> scene(options.scene, all_pairs_objects);
    std::optional<std::uint64_t> expected;
    for (const Sharing& sharing : sharings)
        for (const std::uint32_t count : options.threads) {
            const Threads threads(count);
            Tally tally;
            const double ms = median_ms([&] {
                tally.assign(count, 0);
                sharing.run(scene.boxes(), threads.executor(), tally);
            });
            std::uint64_t found = 0;
            for (const std::uint64_t part : tally)
                found += part;
            if (expected && found != *expected) throw std::logic_error("two ways to share work out differ");
            expected = found;
            rows.push_back({{"what", "sharing"},
                            {"way", sharing.name},
                            {"scene", options.scene},
                            {"n", all_pairs_objects},
                            {"threads", count},
                            {"ms", rounded(ms)},
                            {"pairs", found}});
            progress.step();
        }
}

std::string padded(std::string text, std::size_t width, bool left = false)
{
    const std::string space(width > text.size() ? width - text.size() : 0, ' ');
    return left ? text + space : space + text;
}
std::string of_ms(double ms)
{
    char text[32];
    if (ms >= 10'000)
        std::snprintf(text, sizeof text, "%.0f s", ms / 1000);
    else
        std::snprintf(text, sizeof text, "%.*f ms", ms < 10 ? 3 : ms < 1000 ? 1 : 0, ms);
    return text;
}
std::string short_number(double number)
{
    char text[32];
    std::snprintf(text, sizeof text, number < 100 ? "%.1f" : "%.0f", number);
    return text;
}

/// The rows of `what`, one line for each thing and size: times by threads, then the counts that there are.
std::string table(const Json& rows, const std::string& what, const std::string& key, std::size_t threads)
{
    std::string text;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Json& row = rows[i];
        if (row["what"] != what) continue;
        text += padded(row[key].get<std::string>(), 36, true) +
                padded(grouped(row["n"].get<std::uint64_t>()), 10);
        for (std::size_t t = 0; t < threads; ++t)
            text += padded(of_ms(rows[i + t]["ms"].get<double>()), 12);
        if (row.contains("probes_per_box")) {
            for (const char* count : {"probes_per_box", "candidates_per_box", "bytes_per_box"})
                text += padded(short_number(row[count].get<double>()), 10);
            if (row.contains("missed")) {
                const auto missed = row["missed"].get<std::uint64_t>(),
                           all = row["pairs"].get<std::uint64_t>();
                text += padded(missed == 0 ? "all"
                                           : short_number(100 - 100 * static_cast<double>(missed) /
                                                                    static_cast<double>(all)) +
                                                 " %",
                               10);
                text += padded(grouped(row["selves"].get<std::uint64_t>()), 9);
            } else {
                text += padded("(" + grouped(row["searched"].get<std::uint64_t>()) + " searched)", 20);
            }
        }
        text += '\n';
        i += threads - 1;
    }
    return text;
}
std::string thread_heads(const LadderOptions& options)
{
    std::string text;
    for (const std::uint32_t count : options.threads)
        text += padded(std::to_string(count) + (count == 1 ? " thread" : " threads"), 12);
    return text;
}

} // namespace

Report measure_ladder(const LadderOptions& options)
{
    Report report;
    Json rows = Json::array();
    const std::span<const ladder::RungInfo> rungs = ladder::ladder();
    const std::size_t ways = rungs.size() + ladder::response_ways().size();
    Progress progress("measuring", (ways * options.objects.size() + 4) * options.threads.size());
    for (const std::uint32_t n : options.objects) {
        const jostle_scenes::Scene<3, float> scene(options.scene, n);
        const std::vector<jostle::Pair> truth = all_pairs(scene.boxes());
        for (const ladder::RungInfo& info : rungs)
            measure_rung(info, options, scene.boxes(), truth, rows, progress);
        measure_responses(options, n, truth, rows, progress);
    }
    measure_sharing(options, rows, progress);

    const std::size_t threads = options.threads.size();
    const std::string first = padded("From the chapter to the engine", 36, true) + padded("boxes", 10);
    report.text =
        first + thread_heads(options) + "     cells  compared     bytes     found   itself\n" +
        table(rows, "find", "rung", threads) + "\n" +
        padded("All pairs, shared out over the threads", 46, true) + thread_heads(options) + "\n" +
        table(rows, "sharing", "way", threads) + "\n" + padded("Responses of all pairs, added up", 46, true) +
        thread_heads(options) + "\n" + table(rows, "responses", "way", threads) +
        "\nEach frame is built from the boxes. Per box: 'cells' looked into, boxes 'compared', 'bytes' of\n"
        "memory. 'itself': boxes that were found to touch themselves. Where not all objects searched, the "
        "time is\n"
        "that of those which did, scaled. docs/inside/chapter.md says what each rung changes.\n";
    report.rows = rows.dump(1);
    return report;
}

Report measure_cells(const LadderOptions& options)
{
    Report report;
    Json rows = Json::array();
    const std::uint32_t n = options.objects.front();
    const jostle_scenes::Scene<3, float> scene(options.scene, n);
    const std::vector<jostle::Pair> truth = all_pairs(scene.boxes());
    const std::vector<std::uint32_t> buckets =
        options.buckets.empty() ? std::vector<std::uint32_t>{n} : options.buckets;
    Progress progress("measuring", options.cells.size() * buckets.size());
    report.text = grouped(n) + " boxes (" + options.scene + "), one level of cells, " +
                  std::to_string(options.threads.back()) +
                  (options.threads.back() == 1 ? " thread\n" : " threads\n") + padded("cell", 10) +
                  padded("buckets", 12) + padded("time", 12) + padded("cells", 10) + padded("visited", 12) +
                  padded("compared", 12) + padded("too large", 11) + "\n";
    const Threads threads(options.threads.back());
    for (const float cell : options.cells)
        for (const std::uint32_t bucket_count : buckets) {
            chapter::GridStats stats;
            std::uint64_t larger = 0;
            const double ms = median_ms([&] {
                chapter::Grid<3, float> grid({{cell}, bucket_count});
                for (const jostle::Aabb3f& box : scene.boxes())
                    grid.add(box);
                const auto pairs = grid.detect_proximity(threads.executor());
                stats = grid.stats();
                if (pairs.size() != truth.size()) throw std::logic_error("the grid and the engine differ");
                larger = 0;
                for (std::uint32_t i = 0; i < n; ++i)
                    larger += grid.level(i) == 1 ? 1 : 0;
            });
            const auto a_box = [n](std::uint64_t count) { return static_cast<double>(count) / n; };
            rows.push_back({{"what", "cells"},
                            {"scene", options.scene},
                            {"n", n},
                            {"threads", threads.count()},
                            {"cell", cell},
                            {"buckets", bucket_count},
                            {"ms", rounded(ms)},
                            {"probes_per_box", rounded(a_box(stats.cells))},
                            {"visited_per_box", rounded(a_box(stats.visited))},
                            {"candidates_per_box", rounded(a_box(stats.tests))},
                            {"too_large", larger}});
            char size[32];
            std::snprintf(size, sizeof size, "%g", static_cast<double>(cell));
            report.text += padded(size, 10) + padded(grouped(bucket_count), 12) + padded(of_ms(ms), 12) +
                           padded(short_number(a_box(stats.cells)), 10) +
                           padded(short_number(a_box(stats.visited)), 12) +
                           padded(short_number(a_box(stats.tests)), 12) + padded(grouped(larger), 11) + "\n";
            progress.step();
        }
    report.text +=
        "\nAn object that is larger than the cells is kept in one list, which every object is compared "
        "with.\n"
        "'cells', 'visited' and 'compared' are means of a box: cells probed, objects met in their buckets,\n"
        "boxes compared.\n";
    report.rows = rows.dump(1);
    return report;
}

} // namespace jostle_tool
