// SPDX-License-Identifier: MIT
// jostle compare: what every system here takes on the user's own boxes.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "bench/report.hpp"
#include "bench_options.hpp"
#include "bench_systems.hpp"
#include "clock.hpp"
#include "commands.hpp"
#include "io/boxes.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/spatial_order.hpp"
#include "jostle/world.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "rows.hpp"
#include "text.hpp"
#include "threads.hpp"
#include "tool/scenes/recording.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb;
using jostle::BoxView;

struct Options
{
    std::vector<std::string> files;
    std::vector<std::uint32_t> threads{0};
    std::uint64_t frames = 0; // 0: all there are
    std::string peers;        // `all`, or names with commas; empty: none
    std::string json, report; // empty: not wanted
};

/// Frames that aren't counted: memory grows, caches and the scheduler settle.
constexpr std::size_t warm_up = 3;
/// How often the boxes of a file without motion are asked for.
constexpr std::size_t still_frames = 20;
/// Up to so many boxes every box is tried against every other, in the first frame and the last.
constexpr std::size_t most_for_brute_force = 20'000;

/// What is compared on: frames of boxes.
template <int Dim, class T>
struct Motion
{
    std::vector<std::vector<Aabb<Dim, T>>> frames; ///< at least one
    std::size_t most = 0;                          ///< boxes in a frame

    /// Throws a UsageError for a box that no search takes; `where` says where the boxes are from.
    void add(std::vector<Aabb<Dim, T>> boxes, const std::string& where)
    {
        try {
            jostle::check_boxes(jostle::box_view(boxes));
        } catch (const jostle::Error& error) {
            throw UsageError(where + ": " + error.what());
        }
        most = std::max(most, boxes.size());
        frames.push_back(std::move(boxes));
    }
    [[nodiscard]] bool moves() const { return frames.size() > 1; }
    [[nodiscard]] std::size_t size() const { return moves() ? frames.size() : warm_up + still_frames; }
    [[nodiscard]] std::span<const Aabb<Dim, T>> operator[](std::size_t frame) const
    {
        return frames[moves() ? frame : 0];
    }
    /// Where the boxes of a frame are others than in the one before, ascending; empty in the first.
    void changed_in(std::size_t frame, std::vector<std::uint32_t>& changed) const
    {
        changed.clear();
        if (frame == 0) return;
        const auto before = (*this)[frame - 1], now = (*this)[frame];
        for (std::size_t i = 0; i < std::min(before.size(), now.size()); ++i)
            if (before[i].lo != now[i].lo || before[i].hi != now[i].hi)
                changed.push_back(static_cast<std::uint32_t>(i));
    }
};

/// Objects in a world, which is told what moved, came and went.
template <int Dim, class T>
class WorldOfBoxes final : public System<Dim, T>
{
  public:
    using typename System<Dim, T>::Boxes, typename System<Dim, T>::Positions;

    explicit WorldOfBoxes(jostle::Executor& executor) : world_({.executor = &executor}) {}
    void frame(Boxes boxes, Positions changed) override
    {
        const std::size_t known = std::min(ids_.size(), boxes.size());
        moved_ids_.clear();
        moved_boxes_.clear();
        for (const std::uint32_t i : changed) {
            if (i >= known) break;
            moved_ids_.push_back(ids_[i]);
            moved_boxes_.push_back(boxes[i]);
        }
        while (ids_.size() > boxes.size()) {
            world_.remove(ids_.back());
            ids_.pop_back();
        }
        if (boxes.size() > known) {
            ids_.resize(boxes.size());
            world_.add(boxes.subspan(known), std::span(ids_).subspan(known));
        }
        world_.update(moved_ids_, moved_boxes_);
    }
    Answer answer() override { return pairs_of(world_, ids_); }
    Stages stages() const override { return stages_of(world_.stats()); }

  private:
    jostle::World<Dim, T> world_;
    std::vector<jostle::ObjectId> ids_, moved_ids_;
    std::vector<Aabb<Dim, T>> moved_boxes_;
};

#ifdef JOSTLE_WITH_PEERS
/// Another system, made again, untimed, in a frame with another number of boxes.
template <int Dim>
class PeerOfBoxes final : public System<Dim, float>
{
  public:
    using typename System<Dim, float>::Boxes, typename System<Dim, float>::Positions;

    PeerOfBoxes(jostle_bench::Peer<Dim>& peer, std::uint32_t threads) : peer_(peer), threads_(threads) {}
    void before(Boxes boxes, Positions) override
    {
        if (boxes.size() == size_) return;
        stop();
        if (!boxes.empty()) peer_.start(boxes, threads_);
        size_ = boxes.size();
    }
    void frame(Boxes boxes, Positions changed) override
    {
        if (size_ != 0) peer_.frame(boxes, changed);
    }
    Answer answer() override
    {
        if (size_ == 0) return {};
        const jostle_bench::PeerResult result = peer_.result();
        return {result.pairs, result.checksum};
    }
    void stop() override
    {
        if (size_ != 0) peer_.stop();
        size_ = 0;
    }

  private:
    jostle_bench::Peer<Dim>& peer_;
    std::uint32_t threads_;
    std::size_t size_ = 0;
};
#endif

struct Measured
{
    std::string system;
    std::uint32_t threads;
    std::vector<double> ms; ///< of the frames that count
    std::vector<Answer> answers;
    std::vector<Stages> stages;
    std::uint64_t bytes; ///< that it holds after the last frame
    bool has_answer;

    [[nodiscard]] double median_ms() const { return median(ms); }
};

template <int Dim, class T>
Measured measure(const std::string& name, std::uint32_t threads, const Motion<Dim, T>& motion,
                 bool has_answer, const std::function<std::unique_ptr<System<Dim, T>>()>& make)
{
    Measured result{name, threads, {}, {}, {}, 0, has_answer};
    std::vector<std::uint32_t> changed;
    Progress progress(name + ", " + std::to_string(threads) + (threads == 1 ? " thread" : " threads"),
                      motion.size());
    std::unique_ptr<System<Dim, T>> system = make();
    // A short recording has few frames to spare.
    const std::size_t uncounted = motion.size() > 2 * warm_up ? warm_up : 1;
    for (std::size_t frame = 0; frame < motion.size(); ++frame, progress.step()) {
        motion.changed_in(frame, changed);
        system->before(motion[frame], changed);
        const Clock::time_point before = Clock::now();
        system->frame(motion[frame], changed);
        const Clock::time_point after = Clock::now();
        result.answers.push_back(system->answer());
        if (frame < uncounted && frame + 1 < motion.size()) continue;
        result.ms.push_back(ms_between(before, after));
        result.stages.push_back(system->stages());
    }
    // What it gives back: the answers and times that are kept here aren't its own.
    const std::uint64_t with_it = jostle_system::allocated_bytes();
    system->stop();
    system.reset();
    const std::uint64_t without = jostle_system::allocated_bytes();
    result.bytes = with_it > without ? with_it - without : 0;
    return result;
}

template <int Dim, class T>
Measured measure_finder(const std::string& name, const Threads& threads, const Motion<Dim, T>& motion)
{
    return measure<Dim, T>(name, threads.count(), motion, true, [&] {
        return std::make_unique<FinderSystem<Dim, T>>(jostle::FinderOptions{.executor = &threads.executor()});
    });
}

/// The boxes in the order in which they lie along space in the first frame.
template <int Dim, class T>
Motion<Dim, T> by_place(const Motion<Dim, T>& motion)
{
    Motion<Dim, T> result;
    result.most = motion.most;
    std::vector<std::uint32_t> order;
    for (const auto& boxes : motion.frames) {
        if (order.size() != boxes.size()) {
            order.resize(boxes.size());
            jostle::spatial_order(jostle::box_view(boxes), order);
        }
        auto& sorted = result.frames.emplace_back();
        for (const std::uint32_t i : order)
            sorted.push_back(boxes[i]);
    }
    return result;
}

/// The first frame and the last against the definition. Whether both are small enough for that.
template <int Dim, class T>
bool check(const Motion<Dim, T>& motion, const Measured& measured)
{
    bool both = true;
    for (const std::size_t frame : {std::size_t{0}, motion.size() - 1}) {
        if (motion[frame].size() > most_for_brute_force) {
            both = false;
            continue;
        }
        const auto pairs = jostle::find_pairs_brute_force(BoxView(motion[frame]));
        if (measured.answers[frame] != Answer{pairs.size(), jostle::pair_checksum(pairs)})
            throw std::runtime_error("frame " + std::to_string(frame) +
                                     ": the engine and brute force disagree; please report it");
    }
    return both;
}

/// What the measurements say about what to use.
std::vector<std::string> advice(const std::vector<Measured>& all, double by_place_ms)
{
    std::vector<std::string> advice;
    const auto find = [&](const char* system, auto better) {
        const Measured* best = nullptr;
        for (const Measured& m : all)
            if (m.system == system && (best == nullptr || better(m, *best))) best = &m;
        return best;
    };
    const auto faster = [](const Measured& a, const Measured& b) { return a.median_ms() < b.median_ms(); };
    const Measured& finder = *find("jostle", faster);
    const Measured& world = *find("world", faster);
    char text[256];
    const double ratio = world.median_ms() / finder.median_ms();
    if (ratio < 1)
        std::snprintf(
            text, sizeof text,
            "Keep the boxes in a World: it takes %.2g of a PairFinder's time here, since it looks only at "
            "what changed. It also tells what began and ended.",
            ratio);
    else
        std::snprintf(
            text, sizeof text,
            "A PairFinder is the faster of Jostle's two here. A World takes %.2g times as long, and tells "
            "what began and ended.",
            ratio);
    advice.emplace_back(text);

    const Measured& first =
        *find("jostle", [](const Measured& a, const Measured& b) { return a.threads < b.threads; });
    const Measured& last =
        *find("jostle", [](const Measured& a, const Measured& b) { return a.threads > b.threads; });
    if (last.threads > first.threads) {
        const double gain = first.median_ms() / last.median_ms();
        if (gain > 1.1)
            std::snprintf(text, sizeof text, "%u threads are %.2g times as fast as %u.", last.threads, gain,
                          first.threads);
        else
            std::snprintf(text, sizeof text,
                          "%u threads gain nothing over %u with so few boxes: give the finder fewer.",
                          last.threads, first.threads);
        advice.emplace_back(text);
    }
    if (by_place_ms > 0) {
        const double gain = first.median_ms() / by_place_ms;
        if (gain > 1.1) {
            std::snprintf(
                text, sizeof text,
                "If the boxes lay in memory by their place in space, the search would be %.2g times as fast: "
                "sort your objects now and then (jostle::spatial_order).",
                gain);
            advice.emplace_back(text);
        }
    }
    return advice;
}

template <int Dim, class T>
double moving_share(const Motion<Dim, T>& motion)
{
    std::uint64_t changed = 0, all = 0;
    std::vector<std::uint32_t> list;
    for (std::size_t frame = 1; motion.moves() && frame < motion.size(); ++frame) {
        motion.changed_in(frame, list);
        changed += list.size();
        all += motion[frame].size();
    }
    return all == 0 ? 0 : static_cast<double>(changed) / static_cast<double>(all);
}

void print(const std::vector<Measured>& all)
{
    std::printf("  %-12s %7s %10s %10s %10s %10s %12s  %s\n", "system", "threads", "frame", "min", "max",
                "MB", "pairs", "");
    for (const Measured& m : all) {
        std::string remark;
        if (m.system == "jostle" || m.system == "world") remark = text_of(typical(m.stages));
        for (const Measured& ours : all)
            if (remark.empty() && ours.system == "jostle" && ours.threads == m.threads &&
                ours.median_ms() > 0) {
                char text[64];
                std::snprintf(text, sizeof text, "%.1f x jostle", m.median_ms() / ours.median_ms());
                remark = text;
            }
        std::printf("  %-12s %7u %10s %10s %10s %10.1f %12s  %s\n", m.system.c_str(), m.threads,
                    time_text(m.median_ms()).c_str(),
                    time_text(*std::min_element(m.ms.begin(), m.ms.end())).c_str(),
                    time_text(*std::max_element(m.ms.begin(), m.ms.end())).c_str(),
                    static_cast<double>(m.bytes) / 1e6,
                    m.has_answer ? grouped(m.answers.back().found).c_str() : "", remark.c_str());
    }
}

jostle_bench::ReportRow report_row(const Measured& m, const std::string& file, std::uint64_t n)
{
    return report_row(m.system, file, n, m.threads, m.ms, m.answers.back(), m.stages);
}

/// Every system, with each number of threads. The first is Jostle's finder.
template <int Dim, class T>
std::vector<Measured> measure_all(const Options& options, const Motion<Dim, T>& motion)
{
    std::vector<Measured> all;
#ifdef JOSTLE_WITH_PEERS
    std::vector<std::unique_ptr<jostle_bench::Peer<Dim>>> peers;
    if constexpr (std::is_same_v<T, float>) peers = peers_named<Dim>(options.peers);
#endif
    for (const std::uint32_t count : options.threads) {
        const Threads threads(count);
        all.push_back(measure_finder("jostle", threads, motion));
        all.push_back(measure<Dim, T>("world", threads.count(), motion, true, [&] {
            return std::make_unique<WorldOfBoxes<Dim, T>>(threads.executor());
        }));
#ifdef JOSTLE_WITH_PEERS
        if constexpr (std::is_same_v<T, float>) {
            for (const auto& peer : peers) {
                const jostle_bench::PeerInfo& info = peer->info();
                if (!info.uses_threads && count != options.threads.front()) continue;
                if (motion.most > info.max_objects) {
                    std::printf("  %s left out: it takes minutes a frame with more than %s boxes\n",
                                info.name, grouped(info.max_objects).c_str());
                    continue;
                }
                const std::uint32_t used = info.uses_threads ? threads.count() : 1;
                all.push_back(measure<Dim, T>(info.name, used, motion, info.finds_pairs, [&] {
                    return std::make_unique<PeerOfBoxes<Dim>>(*peer, used);
                }));
            }
        }
#endif
    }
    return all;
}

/// Where the first system that finds other pairs than Jostle's finder does so; empty where none does.
std::string disagreement(const std::vector<Measured>& all)
{
    const std::vector<Answer>& ours = all.front().answers;
    for (const Measured& m : all)
        for (std::size_t frame = 0; m.has_answer && frame < m.answers.size(); ++frame)
            if (m.answers[frame] != ours[frame])
                return "frame " + std::to_string(frame) + ": jostle finds " +
                       std::to_string(ours[frame].found) + " pairs, " + m.system + " " +
                       std::to_string(m.answers[frame].found);
    return "";
}

void write_rows(RowsFile& file, const std::string& name, const std::vector<Measured>& all, std::uint64_t n)
{
    for (const Measured& m : all) {
        // JSON is UTF-8, and names needn't be.
        const jostle_bench::ReportRow row = report_row(m, printable(name), n);
        JsonRow json = json_row(row, "file");
        json.set("bytes", m.bytes);
        if (m.has_answer) {
            json.set("pairs", row.pairs);
            json.set("checksum", row.checksum);
        }
        json.set("stages", row_of(row.stages));
        json.set("frames", m.ms.size());
        file.add(json);
    }
    file.write();
}

void write_report_of(const std::string& name, const std::vector<Measured>& all, std::uint64_t n,
                     const std::vector<std::string>& hints, const std::string& report)
{
    const std::string scene = printable(jostle_system::text_of(jostle_system::path_of(name).filename()));
    std::vector<jostle_bench::ReportRow> rows;
    for (const Measured& m : all)
        rows.push_back(report_row(m, scene, n));
    std::string about = name + ", " + std::to_string(all.front().answers.size()) + " frames";
    for (const std::string& hint : hints)
        about += ". " + hint;
    write_page(rows, about, report);
}

template <int Dim, class T>
void compare(const Options& options, const std::string& name, const Motion<Dim, T>& motion,
             const std::string& about)
{
    std::printf("%s: up to %s boxes, %dD %s, %s\n", printable(name).c_str(), grouped(motion.most).c_str(),
                Dim, sizeof(T) == 4 ? "float" : "double",
                motion.moves() ? (grouped(motion.frames.size()) + " frames").c_str()
                               : "one frame, asked for again and again");
    if (!about.empty()) std::printf("  %s\n", shortened(about, 500).c_str());
    if (motion.moves())
        std::printf("  %.0f %% of the boxes change from one frame to the next\n", 100 * moving_share(motion));
    std::printf("\n");
    std::fflush(stdout);

    RowsFile file(options.json);
    const std::vector<Measured> all = measure_all(options, motion);
    const bool checked = check(motion, all.front());
    double by_place_ms = 0;
    if (motion.most >= 1000)
        by_place_ms = measure_finder("jostle, boxes in order of place", Threads(options.threads.front()),
                                     by_place(motion))
                          .median_ms();

    print(all);
    const std::string difference = disagreement(all);
    if (difference.empty())
        std::printf("\n  All find the same pairs in every frame%s.\n",
                    checked ? ", and in the first and the last so does brute force" : "");
    const std::vector<std::string> hints = advice(all, by_place_ms);
    for (const std::string& hint : hints)
        std::printf("  %s\n", hint.c_str());

    write_rows(file, name, all, motion.most);
    if (!options.report.empty()) write_report_of(name, all, motion.most, hints, options.report);
    if (!difference.empty()) throw std::runtime_error(difference);
}

template <int Dim, class T>
void compare_recording(const Options& options, const std::string& path,
                       jostle_scenes::RecordingReader& recording)
{
    Motion<Dim, T> motion;
    const std::uint64_t frames =
        options.frames == 0 ? recording.info().frames : std::min(options.frames, recording.info().frames);
    {
        Progress progress("reading", frames);
        std::vector<Aabb<Dim, T>> boxes;
        for (std::uint64_t frame = 0; frame < frames && recording.next(boxes); ++frame, progress.step()) {
            motion.add(boxes, path + ": frame " + std::to_string(frame));
        }
    }
    if (motion.frames.empty()) throw UsageError(path + ": has no frames; record it again");
    compare(options, path, motion, recording.info().description);
}

/// Files of boxes, each of them a frame.
template <int Dim, class T>
void compare_files(const Options& options, BoxSet first)
{
    Motion<Dim, T> motion;
    for (std::size_t k = 0; k < options.files.size(); ++k) {
        BoxSet set = k == 0 ? std::move(first) : read_boxes(options.files[k], {});
        auto* const boxes = std::get_if<std::vector<Aabb<Dim, T>>>(&set.boxes);
        if (boxes == nullptr)
            throw UsageError(options.files[k] +
                             ": its boxes are of another dimension or type than those of " +
                             options.files.front());
        motion.add(std::move(*boxes), options.files[k]);
    }
    compare(options, options.files.front(), motion, "");
}

void run(const Options& options)
{
    check_for_peers(!options.peers.empty());
    check_report(options.report, options.json);
    if (options.json == "-") throw UsageError("--json: stdout has the table; give a file");
    for (const std::string& file : options.files)
        for (const std::string& out : {options.json, options.report})
            keep_input(file, out);
    const std::string& path = options.files.front();
    if (extension_of(path) == ".jrec") {
        if (options.files.size() > 1) throw UsageError(options.files[1] + ": one recording at a time");
        try {
            jostle_scenes::RecordingReader recording(jostle_system::path_of(path));
            const jostle_scenes::RecordingInfo& info = recording.info();
            const bool floats = info.coordinate_bytes == 4;
            if (info.dim == 2)
                floats ? compare_recording<2, float>(options, path, recording)
                       : compare_recording<2, double>(options, path, recording);
            else
                floats ? compare_recording<3, float>(options, path, recording)
                       : compare_recording<3, double>(options, path, recording);
        } catch (const UsageError&) {
            throw;
        } catch (const std::runtime_error& error) {
            if (std::string(error.what()).starts_with(path)) throw UsageError(error.what()); // the reader's
            throw;
        }
        return;
    }
    BoxSet first = read_boxes(path, {});
    std::visit([&]<int Dim, class T>(
                   const std::vector<Aabb<Dim, T>>&) { compare_files<Dim, T>(options, std::move(first)); },
               BoxSet(first).boxes);
}

constexpr const char* help =
    R"(FILE is a recording of your program's boxes, which jostle::Recorder writes (three lines in your program; see
docs/guide/compare.md), or a CSV file, array or mesh; several of these are frames, in the order given.

Times each frame with a PairFinder, with a World that is told what moved, and with each other system that the build
has (--peers). Prints whether all find the same pairs, the memory of each, where the time goes, and what would make
it faster. The exit status is 1 if they disagree.

Examples:
  jostle compare mine.jrec
  jostle compare mine.jrec --peers --report mine.html
  jostle compare boxes.csv --threads 1,2,4
  jostle compare frame0.npy frame1.npy frame2.npy --json rows.json)";

} // namespace

void add_compare_command(const Command& app)
{
    const Command command = app.add("compare", "Times every system on your own boxes", help);
    const auto options = std::make_shared<Options>();
    command.required("FILE", options->files, "", "A recording, or files of boxes, one a frame");
    add_thread_counts_option(command, options->threads);
    command.number("--frames", options->frames, 1, ~std::uint64_t{0}, "F",
                   "No more frames of the recording than this");
    add_rows_file_option(command, options->json);
    command.flag("--peers{all}", options->peers,
                 "Other systems as well, where the build has them; --peers=embree,bullet: only these");
    command.text("--report", options->report, "FILE",
                 "Write tables and plots as one HTML page; wants gnuplot");
    command.on_run([options] { run(*options); });
}

} // namespace jostle_tool
