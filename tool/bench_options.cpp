// SPDX-License-Identifier: MIT
#include "bench_options.hpp"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "options.hpp"
#include "threads.hpp"
#include "tool/scenes/scenes.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

void add_sizes_option(const Command& command, std::vector<std::uint64_t>& sizes, const std::string& preset)
{
    command.numbers("-n", sizes, 1, 10'000'000, "N",
                    "How many boxes, 1 to 10,000,000; several with commas (" + preset + ")");
}

void add_thread_counts_option(const Command& command, std::vector<std::uint32_t>& threads)
{
    command.numbers("--threads", threads, 1, Threads::most, "T",
                    "How many threads, several with commas; one per core if not given");
}

void add_rows_file_option(const Command& command, std::string& file)
{
    command.text("--json", file, "FILE", "Write the rows as JSON; - is stdout, then without the table");
}

void check_scenes(const std::vector<std::string>& names, const std::vector<std::string>& others)
{
    std::vector<std::string> known;
    for (const auto& info : jostle_scenes::scene_list())
        known.emplace_back(info.name);
    for (const std::string& name : names)
        if (std::find(known.begin(), known.end(), name) == known.end()) {
            known.insert(known.end(), others.begin(), others.end());
            throw UsageError("there is no scene '" + name + "'" + suggestion(name, known));
        }
}

void check_report(const std::string& report, const std::string& json)
{
    if (report.empty()) return;
    if (report == "-") throw UsageError("--report: give a file, such as report.html");
    const auto folder = std::filesystem::absolute(jostle_system::path_of(report)).parent_path();
    std::error_code unknown;
    if (!std::filesystem::is_directory(folder, unknown))
        throw UsageError("--report: " + jostle_system::text_of(folder) + " is no folder; make it first");
    if (report == json) throw UsageError("--report and --json name one file; give two");
    try {
        jostle_bench::check_gnuplot();
    } catch (const std::runtime_error& error) {
        throw UsageError(std::string("--report: ") + error.what());
    }
}

void write_page(std::span<const jostle_bench::ReportRow> rows, const std::string& about,
                const std::string& report)
{
    try {
        jostle_bench::write_report(rows, about, jostle_system::path_of(report));
    } catch (const std::runtime_error& error) {
        throw UsageError(std::string("--report: ") + error.what());
    }
}

void check_for_peers([[maybe_unused]] bool wanted)
{
#ifndef JOSTLE_WITH_PEERS
    if (wanted)
        throw UsageError(
            "--peers: this build has no peers; install the packages of bench/packages, configure "
            "with cmake -DJOSTLE_BENCH=ON and build again");
#endif
}

} // namespace jostle_tool
