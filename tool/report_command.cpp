// SPDX-License-Identifier: MIT
// jostle report: measurements that were saved as JSON, as one HTML page with tables and plots.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "bench/report.hpp"
#include "commands.hpp"
#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "options.hpp"
#include "text.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

using Json = nlohmann::ordered_json;

struct Options
{
    std::vector<std::string> files;
    std::string out = "report.html";
};

/// The rows of a file: one object, or an array of them.
std::vector<Json> read_rows(const std::string& name)
{
    InputFile file(name);
    std::string text;
    char bytes[1 << 16];
    for (std::size_t got; (got = file.read(bytes, sizeof bytes)) > 0;)
        text.append(bytes, got);
    // Rows have members, and those no more than members: what is nested deeper can't be shown.
    bool deep = false;
    Json all = Json::parse(
        text, [&](int depth, Json::parse_event_t, Json&) { return !(deep = deep || depth > 10); }, false);
    if (deep) all = nullptr;
    if (all.is_object()) all = Json::array({all});
    const bool rows = all.is_array() && !all.empty() &&
                      std::all_of(all.begin(), all.end(), [](const Json& row) { return row.is_object(); });
    if (!rows)
        throw UsageError(name +
                         ": holds no measurements; give what a command of jostle wrote for its --json");
    return {all.begin(), all.end()};
}

std::string text_of(const Json& value)
{
    if (value.is_null()) return "";
    return value.is_string() ? value.get<std::string>() : value.dump();
}

/// What `jostle bench` writes: whole frames of scenes. Other kinds lack some of these.
std::optional<jostle_bench::ReportRow> frame_row(const Json& row)
{
    const auto has = [&](const char* name, bool (Json::*is)() const noexcept) {
        return row.contains(name) && (row[name].*is)();
    };
    for (const char* name : {"system", "scene", "checksum"})
        if (!has(name, &Json::is_string)) return {};
    for (const char* name : {"n", "threads", "pairs"})
        if (!has(name, &Json::is_number_unsigned)) return {};
    for (const char* name : {"median_ms", "min_ms", "max_ms", "size_ratio"})
        if (!has(name, &Json::is_number)) return {};
    if (!has("stages", &Json::is_object) || row["n"] == 0) return {};
    jostle_bench::ReportRow out{
        row["system"],    row["scene"],  row["n"],     row["threads"],  row["median_ms"],
        row["min_ms"],    row["max_ms"], row["pairs"], row["checksum"], {},
        row["size_ratio"]};
    for (const auto& [name, ms] : row["stages"].items())
        if (ms.is_number()) out.stages.emplace_back(name, ms);
    // Other boxes, although the scene has the same name.
    if (row.contains("dim") && row["dim"] == 2) out.scene += ", 2D";
    if (row.contains("type") && row["type"] == "double") out.scene += ", double";
    return out;
}

/// The frames of all files. Instruction sets after the first count as further systems; of rows that measured
/// the same, the first counts.
class Frames
{
  public:
    void add(jostle_bench::ReportRow frame, const Json& row)
    {
        if (row.contains("isa") && row["isa"].is_string()) {
            const std::string isa = row["isa"];
            if (usual_.try_emplace(frame.system, isa).first->second != isa) frame.system += " " + isa;
        }
        if (known_.emplace(frame.system, frame.scene, frame.n, frame.threads).second)
            rows_.push_back(std::move(frame));
    }
    [[nodiscard]] const std::vector<jostle_bench::ReportRow>& rows() const noexcept { return rows_; }

  private:
    std::vector<jostle_bench::ReportRow> rows_;
    std::map<std::string, std::string> usual_; // instruction set, by system
    std::set<std::tuple<std::string, std::string, std::uint64_t, std::uint32_t>> known_;
};

/// The member that says how long it took, and its unit.
std::optional<std::pair<std::string, std::string>> time_of(const std::vector<Json>& rows)
{
    for (const auto& [name, unit] : {std::pair{"median_ms", "ms"},
                                     {"median_us", "µs"},
                                     {"median_ns", "ns"},
                                     {"us_each", "µs"},
                                     {"ns_each", "ns"},
                                     {"ms", "ms"}})
        if (std::any_of(rows.begin(), rows.end(), [&member = name](const Json& row) {
                return row.contains(member) && row[member].is_number();
            }))
            return std::pair{name, unit};
    return {};
}

/// Measurements of any other kind.
jostle_bench::ReportTable table_of(const std::string& title, const std::vector<Json>& rows)
{
    jostle_bench::ReportTable table;
    table.title = title;
    for (const Json& row : rows)
        for (const auto& [name, value] : row.items())
            if (std::find(table.columns.begin(), table.columns.end(), name) == table.columns.end())
                table.columns.push_back(name);
    const auto time = time_of(rows);
    if (time) table.unit = time->second;
    for (const Json& row : rows) {
        std::vector<std::string>& cells = table.rows.emplace_back();
        for (const std::string& name : table.columns)
            cells.push_back(row.contains(name) ? text_of(row[name]) : "");
        if (!time || !row.contains(time->first) || !row[time->first].is_number()) continue;
        const double value = row[time->first];
        if (!(value > 0) || !std::isfinite(value)) continue;
        // What was asked stands below the bar, what it was asked of above the plot.
        jostle_bench::ReportTable::Bar bar{"", "", "", value};
        for (const char* name : {"query", "pair", "part", "program", "what", "scene"})
            if (row.contains(name) && row[name].is_string()) {
                if (bar.label.empty())
                    bar.label = row[name];
                else
                    bar.plot += (bar.plot.empty() ? "" : ", ") + row[name].get<std::string>();
            }
        for (const char* name : {"n", "threads"})
            if (row.contains(name) && row[name].is_number())
                bar.plot += (bar.plot.empty() ? "" : ", ") + std::string(name) + " = " + row[name].dump();
        bar.system = row.contains("system") ? text_of(row["system"]) : "jostle";
        if (!bar.label.empty()) table.bars.push_back(std::move(bar));
    }
    return table;
}

/// Where the measurements come from: the files, and what lies beside them about the machine.
std::string about(const std::vector<std::string>& files)
{
    std::string text;
    std::vector<std::filesystem::path> machines;
    for (const std::string& file : files) {
        text += (text.empty() ? "" : "\n") + printable(file);
        const auto machine = jostle_system::path_of(file).parent_path() / "machine.txt";
        std::error_code unknown;
        if (std::filesystem::exists(machine, unknown) &&
            std::find(machines.begin(), machines.end(), machine) == machines.end())
            machines.push_back(machine);
    }
    for (const auto& machine : machines) {
        std::ifstream file(machine);
        text += "\n\n" + std::string(std::istreambuf_iterator<char>(file), {});
    }
    return text;
}

void run(const Options& options)
{
    const auto folder = std::filesystem::absolute(jostle_system::path_of(options.out)).parent_path();
    std::error_code unknown;
    if (!std::filesystem::is_directory(folder, unknown))
        throw UsageError("-o: " + jostle_system::text_of(folder) + " is no folder; make it first");
    for (const std::string& file : options.files)
        keep_input(file, options.out);
    Frames frames;
    std::vector<jostle_bench::ReportTable> tables;
    for (const std::string& file : options.files) {
        std::vector<Json> others;
        for (const Json& row : read_rows(file))
            if (auto frame = frame_row(row))
                frames.add(*std::move(frame), row);
            else
                others.push_back(row);
        if (!others.empty())
            tables.push_back(
                table_of(jostle_system::text_of(jostle_system::path_of(file).filename()), others));
    }
    try {
        jostle_bench::write_report(frames.rows(), about(options.files), jostle_system::path_of(options.out),
                                   tables);
    } catch (const std::runtime_error& error) {
        throw UsageError(std::string("-o: ") + error.what());
    }
    std::printf("%s\n", printable(options.out).c_str());
}

constexpr const char* help =
    R"(Reads files that other commands wrote with --json, and writes one self-contained HTML page: tables, and plots of
time against the number of objects, sizes and threads, of Jostle's stages, and of all systems. Instruction sets
after the first count as further systems. If two rows measured the same, the first is used. A file machine.txt
beside a result is quoted. Plots need gnuplot.

Examples:
  jostle report result.json
  jostle report bench/results/epyc-zen5-2-cores/*.json -o all.html)";

} // namespace

void add_report_command(const Command& app)
{
    const Command command = app.add("report", "Writes saved measurements as an HTML page with plots", help);
    const auto options = std::make_shared<Options>();
    command.required("FILE", options->files, "TEXT", "Measurements (.json)");
    command.text("-o", options->out, "FILE", "The page (report.html)");
    command.on_run([options] { run(*options); });
}

} // namespace jostle_tool
