// SPDX-License-Identifier: MIT
// jostle simulate: bodies that fall, collide and come to rest, by the library from boxes to motion.
#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "engines.hpp"
#include "interrupt.hpp"
#include "io/output_file.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "page_server.hpp"
#include "progress.hpp"
#include "rows.hpp"
#include "threads.hpp"
#include "tool/scenes/recording.hpp"
#include "tool/simulation/simulation.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

using jostle_simulation::Simulation;
using jostle_simulation::StageTimes;

constexpr std::uint32_t most_frames = 1'000'000;

struct Options
{
    std::string scene = "spheres";
    std::uint32_t bodies = 10'000, frames = 300, threads = 0;
    std::uint64_t seed = 1;
    jostle::InstructionSet instruction_set = jostle::supported_instruction_sets().front();
    std::string record, json; // empty: not wanted
    bool watch = false, frames_given = false;
    PageOptions page;
};

/// The simulation in a browser: it begins when somebody looks, goes no faster than the bodies would fall, and
/// ends with Ctrl-C.
class Watched
{
  public:
    Watched(const std::string& title, const PageOptions& page) : frames_(title), server_(page) {}

    /// Tells the address; waits until somebody looks. False if it was interrupted.
    [[nodiscard]] bool begin(Simulation& simulation)
    {
        frames_.show(0, simulation.boxes());
        const std::string address = server_.show(frames_);
        server_.start();
        std::fprintf(stderr, "See it at %s\nIt begins when the page is open. Ctrl-C ends it.\n",
                     address.c_str());
        while (!frames_.watched())
            if (interrupt_.wait_for(std::chrono::milliseconds(50))) return false;
        next_ = Clock::now();
        return true;
    }
    /// Shows a frame when its time has come. False if it was interrupted.
    [[nodiscard]] bool show(std::uint64_t frame, Simulation& simulation)
    {
        if (interrupt_.wait_for(next_ - Clock::now())) return false;
        next_ = std::max(next_ + std::chrono::nanoseconds(1'000'000'000 / 60), Clock::now());
        frames_.show(frame, simulation.boxes());
        return true;
    }
    /// The last frame stays to be seen until Ctrl-C.
    void end()
    {
        frames_.end();
        std::fprintf(stderr, "That was the last frame. It can be seen until Ctrl-C.\n");
        interrupt_.wait();
    }

  private:
    using Clock = std::chrono::steady_clock;
    Interrupt interrupt_;
    LiveFrames frames_;
    PageServer server_;
    Clock::time_point next_;
};

/// Milliseconds of all frames.
struct Times
{
    std::array<std::vector<double>, StageTimes::count> stage;
    std::vector<double> total;

    void add(const StageTimes& times)
    {
        double sum = 0;
        for (std::size_t k = 0; k < StageTimes::count; ++k) {
            stage[k].push_back(times.ms[k]);
            sum += times.ms[k];
        }
        total.push_back(sum);
    }
};

void print_head()
{
    std::printf("%8s %10s %10s %12s %9s", "frame", "pairs", "contacts", "energy", "ms");
    for (const char* name : StageTimes::names)
        std::printf(" %9s", name);
    std::printf("\n");
}

void print_row(const std::string& frame, const Simulation& simulation, double of_first,
               const StageTimes& times)
{
    double total = 0;
    for (const double ms : times.ms)
        total += ms;
    std::printf("%8s %10" PRIu64 " %10" PRIu64 " %10.4f %% %9.3f", frame.c_str(), simulation.pairs(),
                simulation.contacts(), 100 * of_first, total);
    for (const double ms : times.ms)
        std::printf(" %9.3f", ms);
    std::printf("\n");
    std::fflush(stdout);
}

void run(const Options& options)
{
    if (!options.record.empty() && jostle_system::path_of(options.record).extension() != ".jrec")
        throw UsageError("--record: " + options.record + ": give a name that ends in .jrec");
    std::error_code unknown; // opening it will say
    if (std::filesystem::is_directory(jostle_system::path_of(options.record), unknown))
        throw UsageError("--record: " + options.record + " is a directory; give another name");
    if (!options.json.empty() && options.record == options.json)
        throw UsageError("--record and --json name one file; give two");
    std::optional<OutputFile> json; // opened first: a bad name is said before any work is done
    if (!options.json.empty()) json.emplace(options.json);
    const bool table = options.json != "-";

    const std::string command = "jostle simulate --scene " + options.scene + " -n " +
                                std::to_string(options.bodies) + " --seed " + std::to_string(options.seed);
    std::optional<Watched> watched;
    if (options.watch) watched.emplace(command, options.page);
    const bool endless = options.watch && !options.frames_given;
    const std::uint32_t most = endless ? most_frames : options.frames;
    const Threads threads(options.threads);
    jostle_simulation::Options given;
    given.scene = options.scene;
    given.bodies = options.bodies;
    given.seed = options.seed;
    given.executor = &threads.executor();
    given.instruction_set = options.instruction_set;
    Simulation simulation(given);
    std::unique_ptr<jostle_scenes::RecordingWriter<3, float>> recording;
    const auto record = [&] {
        try {
            if (!recording)
                recording = std::make_unique<jostle_scenes::RecordingWriter<3, float>>(
                    jostle_system::path_of(options.record), options.bodies, 60, command);
            recording->add_frame(simulation.boxes());
        } catch (const std::runtime_error& error) {
            throw UsageError(std::string("--record: ") + error.what());
        }
    };
    const bool recorded = !options.record.empty();
    if (recorded) record();

    const double energy_first = simulation.energy();
    const auto of_first = [&](double energy) { return energy_first == 0 ? 0 : energy / energy_first; };
    if (table) {
        const std::string frames = endless ? "frames" : std::to_string(options.frames) + " frames";
        std::printf("%s: %u bodies, %s of 1/60 s, on %u %s, %s\n\n", options.scene.c_str(), options.bodies,
                    frames.c_str(), threads.count(), threads.count() == 1 ? "thread" : "threads",
                    jostle::name(options.instruction_set));
        print_head();
        std::fflush(stdout);
    }
    Times all;
    std::uint32_t frames = 0; // that were simulated
    bool interrupted = watched && !watched->begin(simulation);
    {
        Progress progress("simulating", endless ? 0 : options.frames);
        const std::uint32_t row_every = endless ? 60 : std::max(1u, (options.frames + 9) / 10);
        while (!interrupted && frames < most) {
            simulation.step();
            ++frames;
            all.add(simulation.times());
            if (recorded) record();
            if (table && (frames % row_every == 0 || frames == most))
                print_row(std::to_string(frames), simulation, of_first(simulation.energy()),
                          simulation.times());
            interrupted = watched && !watched->show(frames, simulation);
            progress.step();
        }
    }
    const double energy_last = simulation.energy();
    if (recorded) {
        try {
            recording->finish();
        } catch (const std::runtime_error& error) {
            throw UsageError(std::string("--record: ") + error.what());
        }
    }

    StageTimes typical;
    for (std::size_t k = 0; k < StageTimes::count; ++k)
        typical.ms[k] = median(all.stage[k]);
    const std::string hash = hex(simulation.hash());
    if (table) {
        print_row("median", simulation, of_first(energy_last), typical);
        std::printf(
            "\nA frame takes %.3f ms (median); real time leaves it 16.7. The last frame's hash is %s.\n",
            median(all.total), hash.c_str());
        std::fflush(stdout);
    }
    if (json) {
        JsonRow ms;
        for (std::size_t k = 0; k < StageTimes::count; ++k)
            ms.set(StageTimes::names[k], rounded(typical.ms[k]));
        ms.set("frame", rounded(median(all.total)));
        const JsonRow line = {{"hash", hash},
                              {"frames", frames},
                              {"bodies", options.bodies},
                              {"pairs", simulation.pairs()},
                              {"contacts", simulation.contacts()},
                              {"energy_first", energy_first},
                              {"energy_last", energy_last},
                              {"ms", ms}};
        json->write(line.text() + "\n");
        json->commit();
    }
    if (watched && !interrupted) watched->end();
}

std::string help()
{
    return listed("Scenes", jostle_simulation::scene_list(), 10) + R"(
The frame after the last has the same hash on any number of threads and any instruction set. Energy, in
percent of the first frame's, never grows. Floor and walls aren't recorded.

Examples:
  jostle simulate                                    10,000 spheres for five seconds
  jostle simulate --scene mixed -n 2000 --frames 600
  jostle simulate --scene boxes --record boxes.jrec  then: jostle demo --recording boxes.jrec
  jostle simulate -n 100000 --threads 1 --isa scalar --json -
  jostle simulate --scene mixed --watch              in your browser, until Ctrl-C)";
}

} // namespace

void add_simulate_command(const Command& app)
{
    const Command command =
        app.add("simulate", "Simulates bodies that fall, collide and come to rest", help());
    const auto options = std::make_shared<Options>();
    std::string known;
    for (const auto& info : jostle_simulation::scene_list())
        known += (known.empty() ? "" : ", ") + std::string(info.name);
    command.choice(
        "--scene",
        [options, known](const std::string& name) {
            for (const auto& info : jostle_simulation::scene_list())
                if (name == info.name) {
                    options->scene = name;
                    return;
                }
            refuse("--scene", name + " is not known; choose " + known);
        },
        "NAME", "Which bodies: " + known + " (spheres)");
    command.number("-n", options->bodies, 1, 10'000'000, "N", "How many bodies (10000)");
    command.whole_number(
        "--frames",
        [options](std::uint64_t frames) {
            options->frames = static_cast<std::uint32_t>(frames);
            options->frames_given = true;
        },
        1, most_frames, "F", "How many frames (300)");
    command.seed(options->seed, "Other bodies of the same kind (1)");
    command.threads(options->threads);
    add_isa_option(command, options->instruction_set, "Instruction set; the best there is if not given");
    command.text("--record", options->record, "FILE",
                 "Record the boxes of the bodies, frame by frame (.jrec)");
    command.text("--json", options->json, "FILE",
                 "Write the result as a line of JSON; - is stdout, then without the table");
    command.flag(
        "--watch", options->watch,
        "Show it in your browser, at the pace of real time; without --frames until Ctrl-C, which ends it "
        "after a whole frame");
    add_page_options(command, options->page);
    command.on_run([options] {
        if (!options->watch && (options->page.port != 0 || !options->page.page.empty()))
            throw UsageError("--port and --page are for --watch; add that, or leave them out");
        run(*options);
    });
}

} // namespace jostle_tool
