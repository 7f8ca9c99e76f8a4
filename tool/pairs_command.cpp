// SPDX-License-Identifier: MIT
// jostle pairs: boxes from a file, touching pairs to a file.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <memory>

#include "clock.hpp"
#include "commands.hpp"
#include "engines.hpp"
#include "io/boxes.hpp"
#include "io/output_file.hpp"
#include "io/write_pairs.hpp"
#include "jostle/chapter.hpp"
#include "jostle/find_pairs.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "rows.hpp"
#include "threads.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

using jostle::Pair;

struct Options
{
    std::string in;
    std::string out; // empty: not given
    bool stats = false;
    Engine engine = Engine::fast;
    std::uint32_t threads = 0;
    ReadOptions read;
};

class Stopwatch
{
  public:
    /// Milliseconds since construction or the last lap.
    double lap()
    {
        const auto now = Clock::now();
        const double ms = ms_between(start_, now);
        start_ = now;
        return rounded(ms);
    }

  private:
    Clock::time_point start_ = Clock::now();
};

/// What a search found: count and checksum always, the pairs themselves if they were to be kept.
struct Found
{
    std::uint64_t count = 0;
    std::uint64_t checksum = 0;
    std::vector<std::span<const Pair>> blocks; // ascending by (a, b); they lie in one of the two below
    std::vector<Pair> pairs;
    std::unique_ptr<jostle::PairFinder> finder;
};

template <int Dim, class T>
Found find(const std::vector<jostle::Aabb<Dim, T>>& boxes, const Options& options, jostle::Executor& executor,
           bool keep)
{
    const jostle::BoxView<Dim, T> view(boxes);
    Found found;
    if (options.engine == Engine::fast) {
        const Progress progress("finding pairs", 0);
        found.finder = std::make_unique<jostle::PairFinder>(jostle::FinderOptions{.executor = &executor});
        if (!keep) { // nothing to store, so that any number of pairs fits into memory
            std::atomic<std::uint64_t> count{0}, checksum{0};
            found.finder->stream(view, [&](const jostle::PairChunk& chunk) {
                count += chunk.pairs.size();
                checksum += jostle::pair_checksum(chunk.pairs);
                return true;
            });
            found.count = count;
            found.checksum = checksum;
            return found;
        }
        const jostle::PairBuffer& pairs = found.finder->find(view, {}, jostle::Order::sorted);
        found.blocks.assign(pairs.blocks().begin(), pairs.blocks().end());
    } else {
        if (options.engine == Engine::brute) {
            found.pairs = find_pairs_brute(view, executor); // comes sorted
        } else {
            const Progress progress("finding pairs", 0);
            found.pairs = jostle::chapter::find_pairs(view, executor);
            std::sort(found.pairs.begin(), found.pairs.end());
        }
        found.blocks.push_back(found.pairs);
    }
    for (const auto block : found.blocks) {
        found.count += block.size();
        found.checksum += jostle::pair_checksum(block);
    }
    return found;
}

/// The search's own words, with the file and the place in it before them. Only files whose rows the reader
/// doesn't check come here: arrays, where row and column are the indices of the box and of its number, and
/// recordings.
template <int Dim, class T>
[[noreturn]] void rethrow_with_place(const jostle::Error& error, const std::string& path,
                                     const std::vector<jostle::Aabb<Dim, T>>& boxes)
{
    std::string place = path;
    if (error.index() < boxes.size()) {
        const auto& box = boxes[error.index()];
        int column = 0;
        while (column < 2 * Dim && box.lo[column % Dim] <= box.hi[column % Dim])
            ++column;
        const int axis = column % Dim;
        if (std::isnan(box.hi[axis]) && !std::isnan(box.lo[axis])) column += Dim;
        place += ":" + std::to_string(error.index()) + ":" + std::to_string(column);
    }
    throw UsageError(place + ": " + error.what());
}

void run(const Options& options)
{
    // What can be wrong with the output is said before any work is done.
    const bool write = !options.out.empty() || !options.stats;
    const std::string out = options.out.empty() ? "-" : options.out;
    const PairFormat format = pair_format(out);
    if (options.out == "-" && options.stats)
        throw UsageError(
            "--stats and -o - would both write to stdout; give -o a file, or leave one of them out");
    if (write && out != "-") keep_input(options.in, out);

    Stopwatch watch;
    const BoxSet set = read_boxes(options.in, options.read);
    if (write) check_ids(out, format, set.ids);
    const double ms_read = watch.lap();

    const Threads threads(options.threads);
    watch.lap();
    std::size_t objects = 0;
    const Found found = std::visit(
        [&](const auto& boxes) {
            objects = boxes.size();
            try {
                return find(boxes, options, threads.executor(), write);
            } catch (const jostle::Error& error) {
                rethrow_with_place(error, options.in, boxes);
            }
        },
        set.boxes);
    const double ms_find = watch.lap();

    if (write) write_pairs(out, format, found.blocks, set.ids);
    const double ms_write = watch.lap();
    if (!options.stats) return;

    const JsonRow ms{{"read", ms_read}, {"find", ms_find}, {"write", write ? ms_write : 0.0}};
    const JsonRow report{{"objects", objects},
                         {"pairs", found.count},
                         {"checksum", hex(found.checksum)},
                         {"threads", threads.count()},
                         {"ms", ms}};
    OutputFile stdout_file("-");
    stdout_file.write(report.text() + "\n");
    stdout_file.commit();
}

constexpr const char* help =
    R"(Reads   boxes.csv     columns lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z] and maybe id, in any order;
                      xmin, minx, ... and x,y,w,h as well; without names lo_x,lo_y,hi_x,hi_y
        boxes.npy     float32 or float64, shape (n, 2, d) or (n, 2 * d), lo before hi
        mesh.obj      .stl, .ply, .glb, .dae, ...: one box per triangle; --parts: one per part
        record.jrec   moving boxes recorded from a physics engine; --frame picks a frame
        -             CSV from stdin
Writes  pairs a,b with a before b, ascending: the boxes' positions in the file, from 0, or their ids.

Examples:
  jostle pairs boxes.csv                      pairs as CSV to stdout
  jostle pairs boxes.npy -o pairs.npy         uint32, shape (m, 2)
  jostle pairs boxes.csv -o pairs.jsonl       one {"a":0,"b":1} per line
  jostle pairs model.glb --parts --stats      counts, checksum and times as JSON
  jostle pairs boxes.npy --stats --engine brute --threads 2
  awk -f make_boxes.awk | jostle pairs - > pairs.csv)";

} // namespace

void add_pairs_command(const Command& app)
{
    const Command command = app.add("pairs", "Finds all touching pairs among the boxes of a file", help);
    const auto options = std::make_shared<Options>();
    command.required("FILE", options->in, "", "The boxes");
    command.text("-o,--output", options->out, "OUT", "Where the pairs go: .csv, .npy or .jsonl; - is stdout");
    command.flag("--stats", options->stats,
                 "Print one JSON object: objects, pairs, checksum, threads, ms. Without -o the pairs are "
                 "only counted");
    add_engine_option(command, options->engine);
    command.threads(options->threads);
    command.flag("--parts", options->read.parts, "Meshes: one box per part as the scene places it");
    command.number("--frame", options->read.frame, 0, ~0u, "K",
                   "Recordings: the frame, from 0; the first if not given");
    command.on_run([options] { run(*options); });
}

} // namespace jostle_tool
