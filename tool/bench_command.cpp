// SPDX-License-Identifier: MIT
// jostle bench: how long a frame of moving boxes takes, ours and other systems'.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/report.hpp"
#include "bench_options.hpp"
#include "bench_systems.hpp"
#include "clock.hpp"
#include "commands.hpp"
#include "engines.hpp"
#include "jostle/chapter.hpp"
#include "jostle/find_pairs.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "rows.hpp"
#include "threads.hpp"
#include "tool/scenes/scenes.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb;
using jostle::BoxView;
using jostle::InstructionSet;
using jostle_scenes::Scene;

struct Options
{
    std::vector<std::string> scenes, parts; // parts are commands of their own
    std::vector<std::uint64_t> sizes{100'000};
    std::vector<std::uint32_t> threads{0};
    std::uint32_t frames = 20;
    std::uint64_t seed = 1;
    Engine engine = Engine::fast;
    InstructionSet instruction_set = jostle::supported_instruction_sets().front();
    int dim = 3;
    bool with_double = false;
    std::string peers;        // `all`, or names with commas; empty: none
    std::string json, report; // empty: not wanted
};

/// Frames that aren't counted: memory grows, caches and the scheduler settle.
constexpr std::uint32_t warm_up = 3;
/// A system that takes longer than this for a scene stops early, with at least `fewest` frames.
constexpr double patience_ms = 60'000;
constexpr std::uint32_t fewest = 5;

/// Those that give a vector of pairs.
template <int Dim, class T>
class Slow final : public System<Dim, T>
{
  public:
    Slow(jostle::Executor& executor, Engine engine) : executor_(executor), engine_(engine) {}
    void frame(std::span<const Aabb<Dim, T>> boxes, std::span<const std::uint32_t>) override
    {
        pairs_.clear();
        if (engine_ == Engine::brute)
            pairs_ = find_pairs_brute(BoxView(boxes), executor_);
        else
            pairs_ = jostle::chapter::find_pairs(BoxView(boxes), executor_);
    }
    Answer answer() override { return {pairs_.size(), jostle::pair_checksum(pairs_)}; }

  private:
    jostle::Executor& executor_;
    Engine engine_;
    std::vector<jostle::Pair> pairs_;
};

struct Sample
{
    double ms, cpu_ms;
    bool preempted;
    Stages stages;
};

/// One system on one scene.
struct Measurement
{
    std::vector<Answer> answers; ///< of every frame from the first warm-up frame on
    std::vector<Sample> samples;
};

/// Frames in which the scheduler took a core away say how busy the machine is: further frames take their
/// place, but no more than were asked for.
template <int Dim, class T>
Measurement measure(System<Dim, T>& system, Scene<Dim, T> scene, std::uint32_t frames, Progress* progress)
{
    Measurement result;
    std::vector<Sample> clean, preempted;
    system.start(scene.boxes());
    const Clock::time_point begin = Clock::now();
    for (std::uint32_t frame = 0; frame < warm_up + 2 * frames && clean.size() < frames; ++frame) {
        if (frame > 0) scene.step();
        system.before(scene.boxes(), {});
        const std::uint64_t preemptions_before = jostle_system::preemptions();
        const double cpu_before = jostle_system::processor_ms();
        const Clock::time_point before = Clock::now();
        system.frame(scene.boxes(), {});
        const Clock::time_point after = Clock::now();
        const double cpu_after = jostle_system::processor_ms();
        const bool was_preempted = jostle_system::preemptions() != preemptions_before;
        result.answers.push_back(system.answer());
        if (frame < warm_up) continue;
        (was_preempted ? preempted : clean)
            .push_back({ms_between(before, after), cpu_after - cpu_before, was_preempted, system.stages()});
        if (progress != nullptr && clean.size() + preempted.size() <= frames) progress->step();
        if (clean.size() + preempted.size() >= std::min(fewest, frames) &&
            ms_between(begin, after) > patience_ms)
            break;
    }
    system.stop();
    result.samples = std::move(clean);
    for (std::size_t i = 0; i < preempted.size() && result.samples.size() < frames; ++i)
        result.samples.push_back(std::move(preempted[i]));
    return result;
}

template <class Value>
auto of_all(const std::vector<Sample>& samples, Value value)
{
    std::vector<decltype(value(samples.front()))> values;
    for (const Sample& sample : samples)
        values.push_back(value(sample));
    return values;
}

/// The biggest box's longest edge over the smallest one's; 0 if that has no size.
template <int Dim, class T>
double size_ratio(std::span<const Aabb<Dim, T>> boxes)
{
    double smallest = 0, biggest = 0;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        double edge = 0;
        for (int d = 0; d < Dim; ++d)
            edge = std::max(edge, double{boxes[i].hi[d]} - double{boxes[i].lo[d]});
        smallest = i == 0 ? edge : std::min(smallest, edge);
        biggest = std::max(biggest, edge);
    }
    return smallest > 0 ? biggest / smallest : 0;
}

/// Collects rows, prints them as they come, and compares the answers of all systems.
class Results
{
  public:
    Results(const Options& options, RowsFile& file)
        : options_(options), file_(file), table_(file.beside_table())
    {
        if (table_)
            std::printf("%-14s %10s %7s  %-10s %10s %10s %10s %11s  %s\n", "scene", "n", "threads", "system",
                        "frame", "min", "max", "pairs", "");
    }

    template <int Dim, class T>
    void add(const std::string& system, const std::string& scene, std::span<const Aabb<Dim, T>> boxes,
             std::uint32_t threads, const Measurement& measurement, bool has_answer)
    {
        const bool differs = has_answer && !agrees(system, scene, boxes.size(), measurement.answers);
        const std::vector<Sample>& samples = measurement.samples;
        const std::vector<double> ms = of_all(samples, [](const Sample& sample) { return sample.ms; });
        // The answer is of a frame that every system has got to, however early it stopped.
        jostle_bench::ReportRow row =
            report_row(system, scene, boxes.size(), threads, ms, measurement.answers[warm_up],
                       of_all(samples, [](const Sample& sample) { return sample.stages; }));
        row.size_ratio = rounded(size_ratio(boxes));

        JsonRow json = json_row(row, "scene");
        json.set("pairs", row.pairs);
        json.set("checksum", row.checksum);
        json.set("stages", row_of(row.stages));
        json.set("dim", Dim);
        json.set("type", sizeof(T) == sizeof(float) ? "float" : "double");
        if (system == "jostle") json.set("isa", jostle::name(options_.instruction_set));
        json.set("seed", options_.seed);
        json.set("frames", samples.size());
        json.set("preempted", std::count_if(samples.begin(), samples.end(),
                                            [](const Sample& sample) { return sample.preempted; }));
        // Under threads x median_ms on a busy machine: then the cores weren't there.
        json.set("cpu_ms",
                 rounded(median(of_all(samples, [](const Sample& sample) { return sample.cpu_ms; }))));
        json.set("size_ratio", row.size_ratio);
        if (differs) json.set("differs", true);
        file_.add(json);

        if (table_) print(row, differs, has_answer);
        rows_.push_back(std::move(row));
    }

    void note(const std::string& text) const
    {
        if (table_) std::printf("%-14s %s\n", "", text.c_str());
    }
    /// After the last system of one scene and size.
    void next_scene() { answers_.clear(); }

    [[nodiscard]] std::span<const jostle_bench::ReportRow> rows() const { return rows_; }
    [[nodiscard]] const std::string& difference() const { return difference_; }

  private:
    bool agrees(const std::string& system, const std::string& scene, std::size_t n,
                const std::vector<Answer>& answers)
    {
        if (answers_.empty()) {
            answers_ = answers;
            first_system_ = system;
            return true;
        }
        for (std::size_t frame = 0; frame < std::min(answers.size(), answers_.size()); ++frame)
            if (answers[frame] != answers_[frame]) {
                if (difference_.empty())
                    difference_ = "scene " + scene + ", n = " + std::to_string(n) + ", seed " +
                                  std::to_string(options_.seed) + ", frame " + std::to_string(frame) + ": " +
                                  first_system_ + " finds " + std::to_string(answers_[frame].found) +
                                  " pairs (checksum " + hex(answers_[frame].checksum) + "), " + system + " " +
                                  std::to_string(answers[frame].found) + " (checksum " +
                                  hex(answers[frame].checksum) + ")";
                return false;
            }
        return true;
    }

    void print(const jostle_bench::ReportRow& row, bool differs, bool has_answer) const
    {
        std::string remark = text_of(row.stages);
        if (row.system != "jostle") // beside ours of the same scene, size and threads
            for (const jostle_bench::ReportRow& other : rows_)
                if (other.system == "jostle" && other.scene == row.scene && other.n == row.n &&
                    other.threads == row.threads && other.median_ms > 0) {
                    char text[64];
                    std::snprintf(text, sizeof text, "%.1f x jostle", row.median_ms / other.median_ms);
                    remark = text;
                }
        if (differs) remark += "  DIFFERENT PAIRS";
        std::printf("%-14s %10s %7u  %-10s %10s %10s %10s %11s  %s\n", row.scene.c_str(),
                    grouped(row.n).c_str(), row.threads, row.system.c_str(), time_text(row.median_ms).c_str(),
                    time_text(row.min_ms).c_str(), time_text(row.max_ms).c_str(),
                    has_answer ? grouped(row.pairs).c_str() : "", remark.c_str());
        std::fflush(stdout);
    }

    const Options& options_;
    RowsFile& file_;
    bool table_;
    std::vector<jostle_bench::ReportRow> rows_;
    std::vector<Answer> answers_; // of the first system on the present scene
    std::string first_system_;
    std::string difference_;
};

/// Scenes in which every pair of many touches would fill the memory before anybody saw why.
void check_pairs(const std::string& scene, std::uint64_t n)
{
    const std::uint64_t crowd = scene == "identical" ? n : scene == "half-identical" ? n / 2 : 0;
    const std::uint64_t pairs = crowd == 0 ? 0 : crowd * (crowd - 1) / 2;
    constexpr std::uint64_t most = 200'000'000;
    if (pairs > most)
        throw UsageError("scene " + scene + " with -n " + std::to_string(n) + " has " +
                         std::to_string(pairs) + " pairs; give -n at most " +
                         (scene == "identical" ? "20000" : "40000"));
}

template <int Dim, class T>
void measure_scene(const Options& options, const std::string& name, std::uint64_t n, const std::string& place,
                   Results& results)
{
    const Scene<Dim, T> initial(name, n, options.seed);
    const std::string system_name = options.engine == Engine::fast      ? "jostle"
                                    : options.engine == Engine::chapter ? "chapter"
                                                                        : "brute";
#ifdef JOSTLE_WITH_PEERS
    std::vector<std::string> one_threaded_done;
#endif
    for (const std::uint32_t count : options.threads) {
        const auto label = [&](const std::string& system, std::uint32_t threads) {
            return place + name + ", " + grouped(n) + " boxes, " + std::to_string(threads) +
                   (threads == 1 ? " thread, " : " threads, ") + system;
        };
        const Threads threads(count);
        std::unique_ptr<System<Dim, T>> ours;
        if (options.engine == Engine::fast)
            ours = std::make_unique<FinderSystem<Dim, T>>(jostle::FinderOptions{
                .executor = &threads.executor(), .instruction_set = options.instruction_set});
        else
            ours = std::make_unique<Slow<Dim, T>>(threads.executor(), options.engine);
        {
            // The search by brute force has a progress bar of its own for every frame.
            std::unique_ptr<Progress> progress;
            if (options.engine != Engine::brute)
                progress = std::make_unique<Progress>(label(system_name, threads.count()), options.frames);
            const Measurement measurement = measure(*ours, initial, options.frames, progress.get());
            progress.reset();
            results.add(system_name, name, initial.boxes(), threads.count(), measurement, true);
        }
        ours.reset();
#ifdef JOSTLE_WITH_PEERS
        if constexpr (std::is_same_v<T, float>) {
            for (const auto& peer : peers_named<Dim>(options.peers)) {
                const jostle_bench::PeerInfo& info = peer->info();
                const std::uint32_t used = info.uses_threads ? threads.count() : 1;
                if (!info.uses_threads) {
                    if (std::count(one_threaded_done.begin(), one_threaded_done.end(), info.name) > 0)
                        continue;
                    one_threaded_done.push_back(info.name);
                }
                if (n > info.max_objects) {
                    results.note(std::string(info.name) +
                                 " left out: it takes minutes a frame with more than " +
                                 grouped(info.max_objects) + " boxes");
                    continue;
                }
                PeerSystem<Dim> system(*peer, used);
                Measurement measurement;
                {
                    Progress progress(label(info.name, used), options.frames);
                    measurement = measure(system, initial, options.frames, &progress);
                }
                results.add(info.name, name, initial.boxes(), used, measurement, info.finds_pairs);
            }
        }
#endif
    }
    results.next_scene();
}

std::string about(const Options& options)
{
    char date[64];
    const std::time_t now = std::time(nullptr);
    std::strftime(date, sizeof date, "%Y-%m-%d %H:%M", std::localtime(&now));
    const std::string processor = jostle_system::processor_name();
    return (processor.empty() ? "" : processor + ", ") + date + ", " + std::to_string(options.dim) + "D " +
           (options.with_double ? "double" : "float") + ", " + std::to_string(options.frames) +
           " frames after " + std::to_string(warm_up) + ", " + jostle::name(options.instruction_set);
}

void run(Options options)
{
    if (options.scenes.empty())
        for (const auto& info : jostle_scenes::scene_list())
            if (!info.hostile) options.scenes.emplace_back(info.name);
    check_scenes(options.scenes, options.parts);
    for (const std::string& name : options.scenes)
        for (const std::uint64_t n : options.sizes)
            check_pairs(name, n);
    check_for_peers(!options.peers.empty());
#ifdef JOSTLE_WITH_PEERS
    if (options.dim == 2) // before any work
        (void)peers_named<2>(options.peers);
    else
        (void)peers_named<3>(options.peers);
#endif
    if (!options.peers.empty() && options.with_double)
        throw UsageError("--peers: the other systems work on float; leave --double out");
    check_report(options.report, options.json);
    RowsFile file(options.json);
    Results results(options, file);
    std::size_t done = 0;
    for (const std::string& name : options.scenes)
        for (const std::uint64_t n : options.sizes) {
            const std::string place = std::to_string(++done) + " of " +
                                      std::to_string(options.scenes.size() * options.sizes.size()) + ": ";
            if (options.dim == 2 && options.with_double)
                measure_scene<2, double>(options, name, n, place, results);
            else if (options.dim == 2)
                measure_scene<2, float>(options, name, n, place, results);
            else if (options.with_double)
                measure_scene<3, double>(options, name, n, place, results);
            else
                measure_scene<3, float>(options, name, n, place, results);
        }
    file.write();
    if (!options.report.empty()) write_page(results.rows(), about(options), options.report);
    if (!results.difference().empty()) throw std::runtime_error(results.difference());
}

std::string help()
{
    std::string text = "Scenes:\n";
    for (const auto& info : jostle_scenes::scene_list()) {
        char line[160];
        std::snprintf(line, sizeof line, "  %-15s %s%s\n", std::string(info.name).c_str(),
                      std::string(info.summary).c_str(), info.hostile ? " (hostile)" : "");
        text += line;
    }
    return text + R"(
Each row is a median, after 3 frames of warm-up. Frames in which the operating system took a core away are
repeated, up to as many again. If systems find different pairs in any frame, the exit status is 1.

Examples:
  jostle bench                                    the seven usual scenes, 100,000 boxes
  jostle bench uniform dense -n 1000000 --threads 1,2
  jostle bench lattice --dim 2 --double --json -  rows as JSON on stdout
  jostle bench uniform -n 1000,10000 --engine chapter
  jostle bench --peers --report report.html       beside other systems, with plots
  jostle bench world                              objects that move and rest, and events
  jostle bench queries                            rays, regions, nearest objects
  jostle bench contacts                           contacts of shapes, pair by pair
  jostle bench distances                          distances of shapes, and times of impact
  jostle bench plane                              distances and contacts of shapes in 2D
  jostle bench neighbors                          neighbour lists of atoms
  jostle bench responses                          work on pairs, with results added up per object
  jostle bench scenes                             many small scenes in one call
  jostle bench programs                           a game server, grains and a planner, part by part)";
}

} // namespace

void add_bench_command(const Command& app)
{
    const Command command = app.add("bench", "Times searches of moving boxes", help());
    const auto options = std::make_shared<Options>();
    command.texts("SCENE", options->scenes, "Which scenes; the seven usual ones if none is given");
    add_sizes_option(command, options->sizes, "100000");
    add_thread_counts_option(command, options->threads);
    command.number("--frames", options->frames, 1, 100'000, "F", "How many frames are counted (20)");
    add_engine_option(command, options->engine);
    command.number("--dim", options->dim, 2, 3, "D", "2 or 3 dimensions (3)");
    command.flag("--double", options->with_double, "Coordinates in double rather than float");
    command.seed(options->seed, "Other boxes of the same kind (1)");
    add_isa_option(command, options->instruction_set,
                   "Instruction set of the default engine; the best there is if not given");
    add_rows_file_option(command, options->json);
    command.flag("--peers{all}", options->peers,
                 "Other systems as well, where the build has them; --peers=embree,floor: only these");
    command.text("--report", options->report, "FILE",
                 "Write tables and plots as one HTML page; wants gnuplot");
    add_bench_world_command(command);
    add_bench_queries_command(command);
    add_bench_contacts_command(command);
    add_bench_distances_command(command);
    add_bench_plane_command(command);
    add_bench_neighbors_command(command);
    add_bench_surfaces_command(command);
    add_bench_responses_command(command);
    add_bench_scenes_command(command);
    add_bench_programs_command(command);
    command.refuse_options_before_parts();
    options->parts = command.part_names();
    command.on_run([command, options] {
        if (!command.part_is_chosen()) run(*options); // else that one was asked for
    });
}

} // namespace jostle_tool
