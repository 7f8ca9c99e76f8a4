// SPDX-License-Identifier: MIT
#include "demo.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "clock.hpp"
#include "commands.hpp"
#include "installed.hpp"
#include "jostle/find_pairs.hpp"
#include "numbers.hpp"
#include "progress.hpp"
#include "text.hpp"
#include "threads.hpp"
#include "tool/scenes/random.hpp"
#include "tool/scenes/recording.hpp"
#include "tool/scenes/scenes.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb;
using jostle::BoxView;
using jostle::Pair;

/// The times of some frames.
class Times
{
  public:
    void add(double ms, const jostle::Stats& stats)
    {
        total_.push_back(ms);
        tune_.push_back(stats.ms_tune);
        scatter_.push_back(stats.ms_scatter);
        sweep_.push_back(stats.ms_sweep);
        finish_.push_back(stats.ms_finish);
    }
    /// One row of the table; `name` is a frame or says what the row holds.
    void print(const std::string& name, std::uint64_t pairs) const
    {
        std::printf("  %10s %10s %9.3f   %7.3f %8.3f %7.3f %7.3f\n", name.c_str(), grouped(pairs).c_str(),
                    median(total_), median(tune_), median(scatter_), median(sweep_), median(finish_));
    }
    static void print_head()
    {
        std::printf("  %10s %10s %9s   %7s %8s %7s %7s\n", "frame", "pairs", "ms", "tune", "scatter", "sweep",
                    "finish");
    }
    [[nodiscard]] double ms() const { return median(total_); }

  private:
    std::vector<double> total_, tune_, scatter_, sweep_, finish_;
};

template <int Dim, class T>
const jostle::PairBuffer& timed_find(jostle::PairFinder& finder, std::span<const Aabb<Dim, T>> boxes,
                                     Times& frame, Times& all, bool count)
{
    const Clock::time_point before = Clock::now();
    const jostle::PairBuffer& pairs = finder.find(BoxView(boxes));
    const double ms = ms_since(before);
    frame.add(ms, finder.stats());
    if (count) all.add(ms, finder.stats());
    return pairs;
}

[[noreturn]] void fail_check(const std::string& where, std::size_t found, std::size_t expected)
{
    throw std::runtime_error(where + ": the engine and brute force disagree (" + grouped(found) + " and " +
                             grouped(expected) + " pairs); please report it");
}

/// All pairs of these boxes must be those of the definition.
template <int Dim, class T>
void check_all(const std::string& where, std::span<const Aabb<Dim, T>> boxes, const jostle::PairBuffer& pairs)
{
    std::vector<Pair> found = pairs.to_vector();
    std::sort(found.begin(), found.end());
    const std::vector<Pair> expected = jostle::find_pairs_brute_force(BoxView(boxes));
    if (found != expected) fail_check(where, found.size(), expected.size());
}

/// The same for the pairs of some boxes with all others.
template <int Dim, class T>
std::size_t check_some(const std::string& where, std::span<const Aabb<Dim, T>> boxes,
                       const jostle::PairBuffer& pairs)
{
    constexpr std::size_t most = 200;
    std::vector<std::uint32_t> picked;
    jostle_scenes::Random random(boxes.size());
    for (std::size_t k = 0; k < std::min(most, boxes.size()); ++k)
        picked.push_back(random.below(static_cast<std::uint32_t>(boxes.size())));
    std::sort(picked.begin(), picked.end());
    picked.erase(std::unique(picked.begin(), picked.end()), picked.end());
    const auto is_picked = [&](std::uint32_t i) {
        return std::binary_search(picked.begin(), picked.end(), i);
    };
    std::vector<Pair> found;
    for (const Pair& pair : pairs)
        if (is_picked(pair.a) || is_picked(pair.b)) found.push_back(pair);
    std::sort(found.begin(), found.end());

    std::vector<Aabb<Dim, T>> picked_boxes;
    for (const std::uint32_t i : picked)
        picked_boxes.push_back(boxes[i]);
    std::vector<Pair> expected;
    for (const Pair& pair : jostle::find_pairs_brute_force(BoxView<Dim, T>(picked_boxes), BoxView(boxes))) {
        const std::uint32_t a = picked[pair.a], b = pair.b;
        if (a != b && !(is_picked(b) && b < a)) // both picked: once
            expected.push_back({std::min(a, b), std::max(a, b)});
    }
    std::sort(expected.begin(), expected.end());
    if (found != expected) fail_check(where, found.size(), expected.size());
    return picked.size();
}

template <int Dim, class T>
void play(jostle_scenes::RecordingReader& recording, jostle::PairFinder& finder)
{
    const std::uint64_t frames = recording.info().frames;
    const std::uint64_t row_every = std::max<std::uint64_t>(1, (frames + 7) / 8);
    Times all;
    std::uint64_t checked = 0, pairs_of_all = 0;
    Times::print_head();
    std::vector<Aabb<Dim, T>> boxes;
    const auto next = [&] {
        try {
            return recording.next(boxes);
        } catch (const std::runtime_error& error) {
            throw UsageError(error.what());
        }
    };
    {
        Progress progress("playing", frames);
        for (std::uint64_t frame = 0; next(); ++frame, progress.step()) {
            Times times;
            const std::span<const Aabb<Dim, T>> view = boxes;
            // The first frames pay for memory that all later ones use again.
            const jostle::PairBuffer& pairs = timed_find(finder, view, times, all, frame >= 3 || frames <= 3);
            pairs_of_all += pairs.size();
            if (frame % row_every == 0 || frame + 1 == frames)
                times.print(std::to_string(frame), pairs.size());
            if (frame % 10 == 0 || frame + 1 == frames) {
                check_all("frame " + std::to_string(frame), view, pairs);
                ++checked;
            }
        }
    }
    if (frames == 0) throw UsageError("the recording has no frames; give another with --recording");
    all.print("typical", pairs_of_all / frames);
    std::printf("  %s frames checked against brute force, every box against every other: same pairs.\n\n",
                grouped(checked).c_str());
}

void play_scene(const DemoOptions& options, jostle::PairFinder& finder)
{
    constexpr std::uint32_t warm_up = 3;
    std::unique_ptr<jostle_scenes::Scene<3, float>> scene;
    {
        const Progress progress("making boxes", 0);
        scene = std::make_unique<jostle_scenes::Scene<3, float>>("uniform", options.boxes);
    }
    Times all;
    std::size_t checked = 0;
    std::uint64_t pairs_of_last = 0;
    {
        Progress progress("finding pairs", options.frames + warm_up);
        for (std::uint32_t frame = 0; frame < warm_up + options.frames; ++frame, progress.step()) {
            if (frame > 0) scene->step();
            Times times;
            const jostle::PairBuffer& pairs =
                timed_find(finder, scene->boxes(), times, all, frame >= warm_up);
            pairs_of_last = pairs.size();
            if (frame + 1 == warm_up + options.frames)
                checked =
                    check_some("a scene of " + grouped(options.boxes) + " boxes", scene->boxes(), pairs);
        }
    }
    Times::print_head();
    all.print("median", pairs_of_last);
    std::printf("  %s boxes checked against brute force, each against all others: same pairs.\n",
                grouped(checked).c_str());
    if (all.ms() > 0)
        std::printf("  That is %.0f million boxes a second, every one of them moving.\n\n",
                    static_cast<double>(options.boxes) / all.ms() / 1e3);
}

} // namespace

void run_demo(const DemoOptions& options)
{
    const std::filesystem::path beside = installed("tumble.jrec");
    const std::filesystem::path own =
        beside.empty() ? jostle_system::path_of(JOSTLE_DATA_DIR "/tumble.jrec") : beside;
    const std::filesystem::path file = options.recording ? jostle_system::path_of(*options.recording) : own;
    std::unique_ptr<jostle_scenes::RecordingReader> recording;
    try {
        recording = std::make_unique<jostle_scenes::RecordingReader>(file);
    } catch (const std::runtime_error& error) {
        throw UsageError(std::string(error.what()) + " (--recording FILE plays another)");
    }
    const Threads threads(options.threads);
    const jostle::FinderOptions finder_options{.executor = &threads.executor()};
    jostle::PairFinder finder(finder_options);

    const jostle_scenes::RecordingInfo& info = recording->info();
    // Our own is shown from here if that is shorter.
    std::error_code unknown;
    const std::filesystem::path near = std::filesystem::proximate(file, unknown);
    const bool shorter = !unknown && near.native().size() < file.native().size();
    std::printf("%s: %s boxes, %s frames\n  %s\n",
                printable(jostle_system::text_of(shorter ? near : file)).c_str(),
                grouped(info.objects).c_str(), grouped(info.frames).c_str(),
                shortened(info.description, 500).c_str());
    std::printf("  on %u %s, %s; ms a frame and its stages\n\n", threads.count(),
                threads.count() == 1 ? "thread" : "threads", jostle::name(finder_options.instruction_set));
    if (info.dim == 2 && info.coordinate_bytes == 8)
        play<2, double>(*recording, finder);
    else if (info.dim == 2)
        play<2, float>(*recording, finder);
    else if (info.coordinate_bytes == 8)
        play<3, double>(*recording, finder);
    else
        play<3, float>(*recording, finder);

    std::printf("%s boxes, all moving: scene uniform, %u frames\n\n", grouped(options.boxes).c_str(),
                options.frames);
    std::fflush(stdout);
    play_scene(options, finder);

    const char* const command = beside.empty() ? "./run" : "jostle"; // the one calls the other
    std::printf("Next:\n"
                "  %s pairs FILE.csv -o pairs.csv    your own boxes: CSV, NPY, a mesh, a recording\n"
                "  %s bench                          seven kinds of scenes; --help says what else\n"
                "  %s --help                         every command\n",
                command, command, command);
}

} // namespace jostle_tool
