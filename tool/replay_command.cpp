// SPDX-License-Identifier: MIT
// jostle replay: a recording, or any other file of boxes, shown in the browser.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <variant>

#include "commands.hpp"
#include "interrupt.hpp"
#include "io/boxes.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "page_server.hpp"
#include "text.hpp"
#include "tool/scenes/recording.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

struct Options
{
    std::string file;
    PageOptions page;
};

/// Refuses what the page couldn't show, with the words of `jostle pairs`; returns what there is to see.
std::string described(const std::string& file)
{
    const std::string extension = extension_of(file);
    constexpr std::array known = {".jrec", ".csv", ".npy", ".obj", ".glb"};
    if (std::find(known.begin(), known.end(), extension) == known.end())
        throw UsageError(printable(file) + ": " +
                         (extension.empty() ? "the name has no extension"
                                            : "the page can't show " + extension + " files") +
                         "; give .jrec, .csv, .npy, .obj or .glb");
    const std::filesystem::path place = jostle_system::path_of(file);
    std::error_code unknown;
    if (std::filesystem::exists(place, unknown) && !std::filesystem::is_regular_file(place, unknown))
        throw UsageError(file +
                         " is no plain file; the page reads it whenever it is opened, so save it first");
    const BoxSet set = read_boxes(file, {});
    const std::size_t boxes = std::visit([](const auto& all) { return all.size(); }, set.boxes);
    std::string text = printable(file) + ": " + grouped(boxes) + " boxes";
    if (extension == ".jrec")
        text += ", " + grouped(jostle_scenes::RecordingReader(place).info().frames) + " frames";
    return text;
}

void run(const Options& options)
{
    const Interrupt interrupt;
    const std::string what = described(options.file);
    PageServer server(options.page);
    const std::string address = server.show(jostle_system::path_of(options.file));
    server.start();
    std::printf("%s\nSee it at %s\nCtrl-C ends this.\n", what.c_str(), address.c_str());
    std::fflush(stdout);
    interrupt.wait();
}

constexpr const char* help =
    R"(Serves the web demo with this file opened: moving boxes, lit where they touch, with the pairs and the time of each
frame. Open the address that is printed. Only this machine can reach it, and nothing leaves it. Ctrl-C ends it with
exit status 0.

Examples:
  jostle replay mine.jrec            recorded by jostle::Recorder in your program, or by jostle simulate --record
  jostle replay boxes.csv --port 8000)";

} // namespace

void add_replay_command(const Command& app)
{
    const Command command = app.add("replay", "Shows a file of boxes in your browser", help);
    const auto options = std::make_shared<Options>();
    command.required("FILE", options->file, "TEXT",
                     "A recording (.jrec), boxes (.csv, .npy) or a mesh (.obj, .glb)");
    add_page_options(command, options->page);
    command.on_run([options] { run(*options); });
}

} // namespace jostle_tool
