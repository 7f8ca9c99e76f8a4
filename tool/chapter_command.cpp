// SPDX-License-Identifier: MIT
// jostle chapter: the thesis chapter's figures on this machine, beside its own.
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench_options.hpp"
#include "chapter_ladder.hpp"
#include "clock.hpp"
#include "commands.hpp"
#include "io/output_file.hpp"
#include "jostle/chapter.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/responses.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "pinned_threads.hpp"
#include "progress.hpp"
#include "rows.hpp"
#include "threads.hpp"
#include "tool/scenes/scenes.hpp"

namespace jostle_tool {

namespace {

namespace chapter = jostle::chapter;

constexpr std::uint32_t chapter_objects = 9993; // the text says 10,000; its counts of tests say 9,993

struct Options
{
    std::vector<std::uint32_t> objects;
    std::uint32_t threads = 0;
    std::string json; // empty: not given
    bool ladder = false;
    std::string scene = "uniform";
    std::vector<float> cells;
    std::vector<std::uint32_t> buckets;
};

// ---- What is measured ----------------------------------------------------------------------------------

/// A counter that is read from and written to memory each time, wherever in a cache line it lies.
struct __attribute__((packed)) Counter
{
    volatile std::uint64_t tests;
    void increment() { tests = tests + 1; } // the compiler may not keep a volatile in a register
    [[nodiscard]] std::uint64_t value() const { return tests; }
};

/// How the counters of the processors lie in memory.
struct Layout
{
    std::size_t first; ///< the first counter's bytes from the start of a cache line
    std::size_t step;  ///< from one counter to the next
};
constexpr std::size_t line = chapter::cache_line;
constexpr Layout shared{0, sizeof(Counter)};
constexpr Layout padded{line - sizeof(Counter) / 2, line}; // half of each counter on the next one's line
constexpr Layout padded_as_drawn{8, line};                 // fig. 4.11: the first counter at byte 8
constexpr Layout aligned{0, line};

class Counters
{
  public:
    Counters(Layout layout, std::uint32_t count)
        : layout_(layout),
          count_(count),
          bytes_(static_cast<std::byte*>(::operator new(size(), std::align_val_t{line})))
    {
        std::fill_n(bytes_, size(), std::byte{});
    }
    ~Counters() { ::operator delete(bytes_, std::align_val_t{line}); }
    Counters(const Counters&) = delete;
    Counters& operator=(const Counters&) = delete;

    Counter& operator[](std::uint32_t i) const
    {
        return *reinterpret_cast<Counter*>(bytes_ + layout_.first + i * layout_.step);
    }
    [[nodiscard]] std::uint64_t total() const
    {
        std::uint64_t sum = 0;
        for (std::uint32_t i = 0; i < count_; ++i)
            sum += (*this)[i].value();
        return sum;
    }

  private:
    [[nodiscard]] std::size_t size() const { return layout_.first + (count_ + 1) * layout_.step + line; }

    Layout layout_;
    std::uint32_t count_;
    std::byte* bytes_;
};

/// What a collision does to an object: a push out of the other box.
struct Push
{
    float x = 0, y = 0, z = 0;
    std::uint32_t collisions = 0;
    Push& operator+=(const Push& other)
    {
        x += other.x;
        y += other.y;
        z += other.z;
        collisions += other.collisions;
        return *this;
    }
};

using Boxes = std::span<const jostle::Aabb3f>;

Push respond(const jostle::Aabb3f& object, const jostle::Aabb3f& other)
{
    float away[3];
    for (int d = 0; d < 3; ++d) {
        const float depth = std::min(object.hi[d], other.hi[d]) - std::max(object.lo[d], other.lo[d]);
        away[d] = object.lo[d] + object.hi[d] < other.lo[d] + other.hi[d] ? -depth / 2 : depth / 2;
    }
    return {away[0], away[1], away[2], 1};
}

struct Measured
{
    std::uint64_t tests; ///< on all processors together
    double ms;           ///< median of the runs
    bool disturbed;      ///< something else took a core away in every run
};

/// Only counting, in zig-zag (fig. 4.9, 4.10, 4.12).
std::uint64_t count_tests(jostle::Executor& executor, std::uint32_t objects, Layout layout)
{
    const Counters counters(layout, executor.concurrency());
    chapter::on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t processors) {
        Counter& counter = counters[processor];
        chapter::process_collision_zigzag(
            processor, processors, objects,
            [&counter](std::uint32_t, std::uint32_t) {
                counter.increment();
                return false;
            },
            [](std::uint32_t, std::uint32_t) {});
    });
    return counters.total();
}

/// Detection, response, barrier, merge (fig. 4.13). Returns the collisions.
std::uint64_t detect_and_respond(jostle::Executor& executor, Boxes boxes)
{
    const auto objects = static_cast<std::uint32_t>(boxes.size());
    chapter::DenseResponses<Push> responses(objects, executor.concurrency());
    const auto merged = chapter::process_collision_responses(
        executor, objects,
        [&](std::uint32_t i, std::uint32_t j) { return jostle::overlaps(boxes[i], boxes[j]); },
        [&](std::uint32_t i, std::uint32_t j) { return respond(boxes[i], boxes[j]); }, responses);
    std::uint64_t collisions = 0;
    for (const Push& push : merged)
        collisions += push.collisions;
    return collisions / 2;
}

/// The same with today's parts. `today` finds pairs first, instead of testing all.
class Pipeline
{
  public:
    Pipeline(Boxes boxes, std::uint32_t threads, bool today)
        : boxes_(boxes),
          today_(today),
          executor_(jostle::make_thread_executor(threads)),
          finder_([this] {
              jostle::FinderOptions options;
              options.executor = executor_.get();
              return options;
          }()),
          responses_([this] {
              jostle::ResponsesOptions options;
              options.executor = executor_.get();
              return options;
          }())
    {
    }

    /// Returns the collisions.
    std::uint64_t frame()
    {
        const auto objects = static_cast<std::uint32_t>(boxes_.size());
        jostle::ProcessOptions process;
        process.executor = executor_.get();
        // Out of line: rare, and the loop over all pairs is twice as fast without it.
        const auto respond_both = [&](const jostle::Pair& pair, jostle::Work work) __attribute__((noinline)) {
            responses_.add(work, pair.a, respond(boxes_[pair.a], boxes_[pair.b]));
            responses_.add(work, pair.b, respond(boxes_[pair.b], boxes_[pair.a]));
        };
        if (today_) {
            const jostle::PairBuffer& pairs = finder_.find(boxes_);
            responses_.start(objects, jostle::plan_work(pairs.size(), process));
            jostle::process_pairs(pairs, respond_both, process);
            tests_ = finder_.stats().candidates;
        } else {
            process.block_items = 1; // an object, and all with a higher number
            responses_.start(objects, jostle::plan_work(objects, process));
            jostle::process_items(
                objects,
                [&, boxes = boxes_](std::uint64_t object, std::uint64_t, jostle::Work work) {
                    const auto a = static_cast<std::uint32_t>(object), end = objects;
                    for (std::uint32_t b = a + 1; b < end; ++b)
                        if (jostle::overlaps(boxes[a], boxes[b])) respond_both({a, b}, work);
                },
                process);
            tests_ = objects == 0 ? 0 : std::uint64_t{objects} * (objects - 1) / 2;
        }
        std::uint64_t collisions = 0;
        for (const Push& push : responses_.merge())
            collisions += push.collisions;
        return collisions / 2;
    }
    [[nodiscard]] std::uint64_t tests() const { return tests_; }

  private:
    Boxes boxes_;
    bool today_;
    std::unique_ptr<jostle::Executor> executor_;
    jostle::PairFinder finder_;
    jostle::Responses<Push> responses_;
    std::uint64_t tests_ = 0;
};

/// Wall-clock time of a frame, with threads that wait between frames; the first frames don't count.
Measured measure_pipeline(Boxes boxes, std::uint32_t threads, bool today, std::uint64_t collisions)
{
    Pipeline pipeline(boxes, threads, today);
    std::vector<double> times;
    for (int frame = 0; frame < 12; ++frame) {
        const auto before = Clock::now();
        if (pipeline.frame() != collisions)
            throw std::logic_error("the pipeline and the all-pairs loop differ");
        const auto after = Clock::now();
        times.push_back(ms_between(before, after));
        if (frame == 4 && times.back() > 500) break;
    }
    times.erase(times.begin(), times.begin() + 3);
    std::sort(times.begin(), times.end());
    return {pipeline.tests(), std::round(times[times.size() / 2] * 1000) / 1000, false};
}

/// Tests per processor for Alg. 13 or 14.
std::vector<std::uint64_t> shares(jostle::Executor& executor, std::uint32_t objects, bool zigzag)
{
    const Counters counters(aligned, executor.concurrency());
    chapter::on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t processors) {
        const auto test = [&](std::uint32_t, std::uint32_t) {
            counters[processor].increment();
            return false;
        };
        const auto nothing = [](std::uint32_t, std::uint32_t) {};
        if (zigzag)
            chapter::process_collision_zigzag(processor, processors, objects, test, nothing);
        else
            chapter::process_collision_blocks(processor, processors, objects, test, nothing);
    });
    std::vector<std::uint64_t> tests;
    for (std::uint32_t processor = 0; processor < executor.concurrency(); ++processor)
        tests.push_back(counters[processor].value());
    return tests;
}

/// Runs `work` five times, less often if it is slow, and takes the median time. Runs in which something else
/// took a core away are made again, up to three times as many in all. `work` must return the same each time.
template <class Work>
Measured measure(PinnedThreads& threads, Work work)
{
    std::vector<double> undisturbed, disturbed;
    std::optional<std::uint64_t> tests;
    for (std::size_t wanted = 1; undisturbed.size() < wanted && disturbed.size() < 2 * wanted;) {
        threads.reset();
        const std::uint64_t found = work();
        if (tests && found != *tests) throw std::logic_error("two runs gave different counts");
        if (!tests) wanted = threads.ms() < 500 ? 5 : threads.ms() < 5000 ? 3 : 1;
        tests = found;
        (threads.preemptions() == 0 ? undisturbed : disturbed).push_back(threads.ms());
    }
    const double ms = median(undisturbed.empty() ? disturbed : undisturbed);
    return {*tests, std::round(ms * 1000) / 1000, undisturbed.empty()};
}

// ---- What is shown -------------------------------------------------------------------------------------

struct Row
{
    const char* figure;
    const char* variant;
    const char* what;
    std::optional<double> chapter_one, chapter_four; // milliseconds in the chapter
    Measured one{}, all{};
};

struct Results
{
    std::uint32_t objects, threads, cores;
    std::uint64_t tests; // n (n-1) / 2
    std::vector<Row> figures;
    std::vector<std::uint64_t> blocks, zigzag;
    std::vector<Row> pieces; // Alg. 7 and 11: not in the chapter's figures
};

Results measure_all(std::uint32_t objects, std::uint32_t thread_count)
{
    Results r{};
    r.objects = objects;
    r.cores = PinnedThreads::core_count();
    r.threads = thread_count == 0 ? r.cores : thread_count;
    r.tests = std::uint64_t{r.objects} * (r.objects - 1) / 2;
    PinnedThreads one(1), all(r.threads);
    // The scene's pairs per object are the same for any n, so that responses stay rare beside tests.
    const jostle_scenes::Scene<3, float> scene("uniform", r.objects);
    const Boxes boxes = scene.boxes();

    r.figures = {
        {"4.9", "shared", "counters side by side", 1188, 4906},
        {"4.10", "padded", "padded, not aligned", 1188, 1797},
        {"4.11", "padded", "padded as the figure draws it", {}, {}},
        {"4.12", "aligned", "aligned to 64 bytes", 1188, 312},
        {"4.13", "response", "detection + response, aligned", 4968, 1391},
        {"4.13", "all_pairs", "  process_items, Responses", {}, {}},
        {"4.13", "pipeline", "  find_pairs, Responses", {}, {}},
    };
    r.pieces = {
        {"Alg. 7", "as_printed", "grid, printed hash", {}, {}},
        {"Alg. 7", "mixing", "grid, mixing hash", {}, {}},
        {"Alg. 11", "critical_section", "batches in a critical section", {}, {}},
        {"Alg. 11", "atomic_cursor", "batches by an atomic cursor", {}, {}},
    };
    Progress progress("measuring", 2 * (r.figures.size() + r.pieces.size()) + 2);

    const auto measure_row = [&](Row& row, auto work) {
        row.one = measure(one, [&] { return work(one); });
        progress.step();
        row.all = r.threads == 1 ? row.one : measure(all, [&] { return work(all); });
        progress.step();
        if (row.one.tests != row.all.tests) throw std::logic_error("one core and all cores differ");
    };
    const Layout layouts[] = {shared, padded, padded_as_drawn, aligned};
    for (std::size_t i = 0; i < 4; ++i) {
        measure_row(r.figures[i],
                    [&](PinnedThreads& threads) { return count_tests(threads, r.objects, layouts[i]); });
        if (r.figures[i].one.tests != r.tests) throw std::logic_error("not every pair was tested once");
    }
    measure_row(r.figures[4], [&](PinnedThreads& threads) { return detect_and_respond(threads, boxes); });
    const std::uint64_t collisions = r.figures[4].one.tests;
    r.figures[4].one.tests = r.figures[4].all.tests = r.tests;
    for (std::size_t i = 5; i < 7; ++i) {
        Row& row = r.figures[i];
        row.one = measure_pipeline(boxes, 1, i == 6, collisions);
        progress.step();
        row.all = r.threads == 1 ? row.one : measure_pipeline(boxes, r.threads, i == 6, collisions);
        progress.step();
    }

    r.blocks = shares(all, r.objects, false);
    progress.step();
    r.zigzag = shares(all, r.objects, true);
    progress.step();

    for (std::size_t i = 0; i < 2; ++i) {
        chapter::GridOptions<float> grid_options;
        grid_options.cell_sizes = chapter::choose_cell_sizes(jostle::BoxView<3, float>(boxes));
        grid_options.buckets = std::max(16u, r.objects);
        grid_options.hash = i == 0 ? chapter::Hash::as_printed : chapter::Hash::mixing;
        chapter::Grid<3, float> grid(grid_options);
        for (const jostle::Aabb3f& box : boxes)
            grid.add(box);
        measure_row(r.pieces[i], [&](PinnedThreads& threads) {
            if (grid.detect_proximity(threads).size() != collisions)
                throw std::logic_error("the grid and the all-pairs loop differ");
            return grid.stats().visited;
        });
        if (i == 0) continue;
        for (std::size_t k = 0; k < 2; ++k)
            measure_row(r.pieces[2 + k], [&](PinnedThreads& threads) {
                const Counters tested(aligned, threads.concurrency());
                chapter::test_collisions(
                    grid.close_pairs(), threads,
                    [&](std::uint32_t processor, const jostle::Pair& pair) {
                        if (respond(boxes[pair.a], boxes[pair.b]).collisions == 1)
                            tested[processor].increment();
                    },
                    k == 0 ? chapter::Batching::critical_section : chapter::Batching::atomic_cursor, 8);
                return tested.total();
            });
    }
    return r;
}

std::string to_json(const Results& r)
{
    std::vector<JsonRow> rows;
    const auto add_rows = [&](const std::vector<Row>& from) {
        for (const Row& row : from) {
            const auto add = [&](std::uint32_t threads, const Measured& measured) {
                rows.push_back({{"figure", row.figure},
                                {"variant", row.variant},
                                {"threads", threads},
                                {"tests", measured.tests},
                                {"ms", measured.ms}});
            };
            add(1, row.one);
            if (r.threads != 1) add(r.threads, row.all);
        }
    };
    add_rows(r.figures);
    for (std::uint32_t processor = 0; processor < r.threads; ++processor) {
        rows.push_back({{"figure", "4.6"},
                        {"variant", "blocks"},
                        {"processor", processor},
                        {"threads", r.threads},
                        {"tests", r.blocks[processor]}});
        rows.push_back({{"figure", "4.7"},
                        {"variant", "zigzag"},
                        {"processor", processor},
                        {"threads", r.threads},
                        {"tests", r.zigzag[processor]}});
    }
    add_rows(r.pieces);
    return indented(rows);
}

/// printf into a string.
__attribute__((format(printf, 2, 3))) void print(std::string& out, const char* format, ...)
{
    char buffer[512];
    va_list arguments;
    va_start(arguments, format);
    const int length = std::vsnprintf(buffer, sizeof buffer, format, arguments);
    va_end(arguments);
    if (length > 0) out.append(buffer, std::min(static_cast<std::size_t>(length), sizeof buffer - 1));
}

/// "3.81x faster", of a second time against a first.
std::string ratio(double first, double second)
{
    if (!(first > 0 && second > 0)) return "-";
    std::string text;
    if (second > first)
        print(text, "%.2fx slower", second / first);
    else
        print(text, "%.2fx faster", first / second);
    return text;
}

/// Three digits or more, whatever the size.
std::string milliseconds(double ms)
{
    std::string text;
    print(text, "%.*f ms", ms < 1 ? 3 : ms < 10 ? 2 : 1, ms);
    return text;
}

void print_table(std::string& out, const Results& r, const std::vector<Row>& rows, const char* count)
{
    const bool parallel = r.threads != 1, with_chapter = rows.front().chapter_one.has_value();
    const std::string all = parallel ? std::to_string(r.threads) + " threads" : "";
    print(out, "%-7s %-30s %13s %12s %12s%s\n", "", "", count, "1 thread", all.c_str(),
          with_chapter ? "                  chapter: 1 core, 4 cores" : "");
    for (const Row& row : rows) {
        print(out, "%-7s %-30s %13" PRIu64 " %12s %12s %14s", row.figure, row.what, row.all.tests,
              milliseconds(row.one.ms).c_str(), parallel ? milliseconds(row.all.ms).c_str() : "",
              parallel ? ratio(row.one.ms, row.all.ms).c_str() : "");
        if (row.chapter_one)
            print(out, "   %.0f, %.0f ms: %s", *row.chapter_one, *row.chapter_four,
                  ratio(*row.chapter_one, *row.chapter_four).c_str());
        out += '\n';
    }
}

std::string to_text(const Results& r)
{
    std::string out;
    print(out,
          "The chapter's figures on this machine: %" PRIu32 " objects, %" PRIu64
          " tests = n (n-1) / 2, %" PRIu32 " thread%s on %" PRIu32 " core%s.\n\n",
          r.objects, r.tests, r.threads, r.threads == 1 ? "" : "s", r.cores, r.cores == 1 ? "" : "s");
    print_table(out, r, r.figures, "tests in all");

    print(out, "\nTests per processor, Alg. 13 (equal blocks, fig. 4.6) and Alg. 14 (zig-zag, fig. 4.7):\n");
    const double mean = static_cast<double>(r.tests) / r.threads;
    const auto of_mean = [&](std::uint64_t tests) {
        return mean > 0 ? 100 * static_cast<double>(tests) / mean : 100.0;
    };
    constexpr std::uint32_t shown = 16;
    print(out, "  processor         blocks    of mean        zig-zag    of mean\n");
    for (std::uint32_t p = 0; p < std::min(r.threads, shown); ++p)
        print(out, "  %9" PRIu32 " %14" PRIu64 " %8.1f %% %14" PRIu64 " %8.1f %%\n", p, r.blocks[p],
              of_mean(r.blocks[p]), r.zigzag[p], of_mean(r.zigzag[p]));
    if (r.threads > shown) print(out, "  ... and %" PRIu32 " more; --json has them all\n", r.threads - shown);
    out += "  The chapter's example, 9 objects on 3 processors: 21, 12, 3 against 13, 12, 11.\n";

    print(out, "\nPieces of the grid, not timed in the chapter (objects visited; pairs tested):\n");
    print_table(out, r, r.pieces, "count");

    out += R"(
What differs from the chapter, and why
- Machine: the chapter ran on an Intel Core 2 Extreme Q6850 of 2007, four cores at 3.00 GHz in two pairs; a
  cache line that changed owner between the pairs crossed the front-side bus. Today's cores hand it over
  inside the chip, from one cache to another.
- Store forwarding: a core reads back its own newest count from its store buffer, and these are longer now.
  It goes on counting while it waits for the line and writes many counts when it has it, so sharing a line
  costs less than it did, and differently on each processor.
- Counters: 8 bytes, as the chapter's int overflows from 65,537 objects on; read from and written to memory
  at every test. Eight of them share a line, so with more than 8 threads fig. 4.9 has several shared lines.
- Padding: as fig. 4.11 draws it, each counter has a line to itself although the padded elements straddle
  lines; the row 4.11 shows what that costs. For fig. 4.10 the counters themselves are laid across two
  lines, so that neighbours share one: the case in which padding without alignment isn't enough.
- Fig. 4.13 again: the two rows below it do the same with today's parts. process_items makes the same tests
  and claims rows as it goes; find_pairs makes only those tests that the bricks of its grid leave over.
- Tests: the chapter's 49,925,028 are those of 9,993 objects, not of 10,000. Its second lines give the tests
  per core, a quarter of that; here all processors' tests are added up.
)";
    if (r.threads == 1)
        out += "- One thread: nothing is shared, so there is nothing to compare. Try --threads 2.\n";
    else if (r.threads > r.cores)
        print(out,
              "- More threads than cores (%" PRIu32 " on %" PRIu32 "): they take turns, so times can't fall "
              "%" PRIu32 "-fold.\n",
              r.threads, r.cores, r.threads);
    else if (r.threads != 4)
        print(out,
              "- %" PRIu32 " cores here, 4 in the chapter: compare a ratio with its best, %" PRIu32
              " and 4.\n",
              r.threads, r.threads);
    const auto disturbed = [](const Row& row) { return row.one.disturbed || row.all.disturbed; };
    const auto count = std::count_if(r.figures.begin(), r.figures.end(), disturbed) +
                       std::count_if(r.pieces.begin(), r.pieces.end(), disturbed);
    if (count != 0 && r.threads <= r.cores)
        print(out,
              "- Other work: in %d of the %d rows something else took a core away in every run. Stop it and "
              "try "
              "again.\n",
              static_cast<int>(count), static_cast<int>(r.figures.size() + r.pieces.size()));
    out += "Times are medians of several runs. docs/inside/chapter.md says what each algorithm does.\n";
    return out;
}

Report measure(const Options& options)
{
    const bool figures = !options.ladder && options.cells.empty();
    if (figures) {
        const Results results =
            measure_all(options.objects.empty() ? chapter_objects : options.objects.front(), options.threads);
        return {to_json(results), to_text(results)};
    }
    const std::uint32_t all = options.threads == 0 ? PinnedThreads::core_count() : options.threads;
    LadderOptions ladder{options.scene, options.objects, {1}, options.cells, options.buckets};
    if (all > 1) ladder.threads.push_back(all);
    if (options.ladder) {
        if (ladder.objects.empty()) ladder.objects = {10'000, 100'000};
        return measure_ladder(ladder);
    }
    if (ladder.objects.empty()) ladder.objects = {100'000};
    return measure_cells(ladder);
}

/// What goes together, and in which order.
void check(const Options& options)
{
    if (options.ladder && !options.cells.empty())
        refuse("--cells", "goes without --ladder: give one of the two");
    if (!options.ladder && options.objects.size() > 1)
        refuse("-n", "takes several numbers only with --ladder");
    if (options.cells.empty() && !options.buckets.empty()) refuse("--buckets", "goes with --cells");
    if (!options.ladder && options.cells.empty() && options.scene != "uniform")
        refuse("--scene", "goes with --ladder or --cells");
    check_scenes({options.scene});
    for (std::size_t i = 0; i < options.cells.size(); ++i)
        if (!(options.cells[i] > (i == 0 ? 0 : options.cells[i - 1])) || std::isinf(options.cells[i]))
            refuse("--cells", "number " + std::to_string(i + 1) + " isn't finite and above " +
                                  (i == 0 ? "0" : "the one before") +
                                  "; give ascending sizes, such as 0.5,1,2,4");
}

void run(const Options& options)
{
    check(options);
    std::optional<OutputFile> json; // opened first: a bad name is said before any work is done
    if (!options.json.empty()) json.emplace(options.json);
    const Report report = measure(options);
    if (json) {
        json->write(report.rows + "\n");
        json->commit();
    }
    if (options.json != "-") {
        json.reset();
        OutputFile text("-");
        text.write(report.text);
        text.commit();
    }
}

constexpr const char* help =
    R"(Measures figures 4.9, 4.10, 4.12 and 4.13 (cache lines shared between cores, or not), the shares of
Alg. 13 and 14, the hash of Alg. 7 and the batches of Alg. 11, and compares them with the chapter's numbers.
The work grows with n * n: 100,000 objects take a hundred times as long as the default.
--ladder measures eight steps from the printed broad phase to today's engine on the same boxes, each checked against
the engine, and ways to divide work and to add up responses. --cells measures the grid with each cell size.

JSON rows: {"figure","variant","threads","tests","ms"} for one thread and for all, tests on all threads
together; {"figure","variant","processor","threads","tests"} for the shares of Alg. 13 and 14. With --ladder and
--cells {"what","rung" or "way","scene","n","threads","ms",...} with counts a box.

Examples:
  jostle chapter                        as in the chapter, on all cores
  jostle chapter -n 30000 --threads 4   more objects, four threads
  jostle chapter --ladder -n 10000,100000,1000000   from the chapter to the engine
  jostle chapter --cells 0.5,1,2,4,8,16 --buckets 1000,100000   cells too small, right, too big
  jostle chapter --json -               JSON only, to stdout
  jostle chapter --json chapter.json    the table to stdout, JSON to the file)";

} // namespace

void add_chapter_command(const Command& app)
{
    const Command command = app.add("chapter", "The thesis chapter's figures on this machine", help);
    const auto options = std::make_shared<Options>();
    command.spaced_numbers(
        "-n", options->objects, 2u, 4'000'000'000u, "N",
        "How many objects: 9993, as in the chapter; with --ladder several numbers (10000,100000), with "
        "--cells 100000");
    command.flag("--ladder", options->ladder, "Step by step from the printed broad phase to today's engine");
    command.spaced_numbers("--cells", options->cells, "SIZE",
                           "The grid with each of these cell sizes, of 100,000 objects");
    command.spaced_numbers("--buckets", options->buckets, 1u, 1'000'000'000u, "N",
                           "With --cells: each of these numbers of buckets; as many as objects");
    command.text("--scene", options->scene, "NAME", "With --ladder or --cells: one of jostle bench's scenes");
    command.threads(options->threads);
    command.text("--json", options->json, "FILE",
                 "Also write rows of JSON to this file; - is stdout, JSON only");
    command.on_run([options] { run(*options); });
}

} // namespace jostle_tool
