// SPDX-License-Identifier: MIT
#include "bench/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <tuple>

#include "tool/system/system.hpp"
#include "tool/system/unfinished_file.hpp"

namespace jostle_bench {
namespace {

constexpr std::string_view ours_name = "jostle";
constexpr std::string_view floor_name = "floor";

// ------------------------------------------------------------------------------------------ text

std::string html(std::string_view text)
{
    std::string out;
    for (const char c : text)
        switch (c) {
        case '&':
            out += "&amp;";
            break;
        case '<':
            out += "&lt;";
            break;
        case '>':
            out += "&gt;";
            break;
        case '"':
            out += "&quot;";
            break;
        default:
            out += c;
        }
    return out;
}

/// Inside gnuplot's double quotes; an underscore would lower the next letter, so enhanced text stays off.
std::string quoted(std::string_view text)
{
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        if (c != '\n') out += c;
    }
    return out + '"';
}

std::string number(double value, const char* format = "%.3g")
{
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return text.data();
}

std::string milliseconds(double ms)
{
    return number(ms, ms < 1 ? "%.3f" : ms < 100 ? "%.2f" : "%.0f");
}

std::string count(std::uint64_t n)
{
    if (n >= 1'000'000 && n % 100'000 == 0) return number(static_cast<double>(n) / 1e6) + "M";
    if (n >= 1'000 && n % 100 == 0) return number(static_cast<double>(n) / 1e3, "%.4g") + "k";
    return std::to_string(n);
}

// ------------------------------------------------------------------------------------------ rows

/// The values of one column in the order of their first row.
template <class Key>
auto distinct(std::span<const ReportRow> rows, Key key)
{
    std::vector<std::decay_t<decltype(std::invoke(key, rows.front()))>> values;
    for (const ReportRow& row : rows)
        if (std::find(values.begin(), values.end(), std::invoke(key, row)) == values.end())
            values.push_back(std::invoke(key, row));
    return values;
}

template <class Key>
auto ascending(std::span<const ReportRow> rows, Key key)
{
    auto values = distinct(rows, key);
    std::sort(values.begin(), values.end());
    return values;
}

std::vector<ReportRow> select(std::span<const ReportRow> rows,
                              const std::function<bool(const ReportRow&)>& wanted)
{
    std::vector<ReportRow> out;
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(out), wanted);
    return out;
}

const ReportRow* find(std::span<const ReportRow> rows, std::string_view system, std::string_view scene,
                      std::uint64_t n, std::uint32_t threads)
{
    for (const ReportRow& row : rows)
        if (row.system == system && row.scene == scene && row.n == n && row.threads == threads) return &row;
    return nullptr;
}

// ----------------------------------------------------------------------------------------- plots

/// One colour a system in all plots (Okabe and Ito's palette, safe for the colour-blind, and two more).
std::string colour(std::string_view system)
{
    static const std::map<std::string_view, const char*> colours = {
        {"jostle", "#d55e00"},       {"embree", "#0072b2"},      {"bullet", "#009e73"},
        {"bullet-sap", "#8fbc8f"},   {"fcl", "#cc79a7"},         {"cgal", "#e69f00"},
        {"ode", "#56b4e9"},          {"boost", "#b8a800"},       {"box2d", "#7f5f3f"},
        {"floor", "#000000"},        {"jostle avx2", "#f4a582"}, {"jostle sse4", "#a6761d"},
        {"jostle scalar", "#7f2704"}};
    const auto found = colours.find(system);
    return found == colours.end() ? "#999999" : found->second;
}

struct Series
{
    std::string title;
    std::string system;
    bool dashed = false;
    std::vector<std::pair<double, double>> points;
};

struct Plot
{
    std::string caption; ///< below the plot and read aloud in its place
    std::string script;
};

std::string line_plot(const std::string& title, const std::string& x_label, const std::string& y_label,
                      const std::string& setup, const std::vector<Series>& series)
{
    std::ostringstream out;
    out.precision(9);
    out << "set title " << quoted(title) << "\nset xlabel " << quoted(x_label) << "\nset ylabel "
        << quoted(y_label) << '\n'
        << setup;
    for (std::size_t s = 0; s < series.size(); ++s) {
        out << "$data" << s << " << END_OF_DATA\n";
        for (const auto& [x, y] : series[s].points)
            out << x << ' ' << y << '\n';
        out << "END_OF_DATA\n";
    }
    out << "plot ";
    for (std::size_t s = 0; s < series.size(); ++s) {
        const bool ours = series[s].system == ours_name;
        out << (s == 0 ? "" : ", ") << "$data" << s << " using 1:2 with linespoints title "
            << quoted(series[s].title) << " lc rgb " << quoted(colour(series[s].system)) << " lw "
            << (ours ? 3 : 1.5) << " pt 7 ps " << (ours ? 0.6 : 0.4) << " dt "
            << (series[s].system == floor_name ? 3
                : series[s].dashed             ? 2
                                               : 1);
    }
    out << '\n';
    return out.str();
}

/// A line for each system and thread count, of those rows that have x.
std::vector<Series> lines(std::span<const ReportRow> rows,
                          const std::function<double(const ReportRow&)>& x_of,
                          const std::function<double(const ReportRow&)>& y_of)
{
    const std::vector<std::uint32_t> threads = ascending(rows, &ReportRow::threads);
    std::vector<Series> out;
    for (const std::string& system : distinct(rows, &ReportRow::system))
        for (const std::uint32_t t : threads) {
            Series series{system + (threads.size() > 1
                                        ? ", " + std::to_string(t) + (t == 1 ? " thread" : " threads")
                                        : ""),
                          system,
                          t != threads.front(),
                          {}};
            for (const ReportRow& row : rows)
                if (row.system == system && row.threads == t && row.median_ms > 0)
                    series.points.emplace_back(x_of(row), y_of(row));
            std::sort(series.points.begin(), series.points.end());
            if (!series.points.empty()) out.push_back(std::move(series));
        }
    return out;
}

double nanoseconds_per_object(const ReportRow& row)
{
    return row.median_ms * 1e6 / static_cast<double>(row.n);
}

void plots_against_n(std::span<const ReportRow> rows, std::vector<Plot>& plots)
{
    for (const std::string& scene : distinct(rows, &ReportRow::scene)) {
        const std::vector<std::uint32_t> threads = ascending(rows, &ReportRow::threads);
        const auto of_scene = select(rows, [&](const ReportRow& row) {
            return row.scene == scene && (row.threads == threads.front() || row.threads == threads.back());
        });
        if (ascending(of_scene, &ReportRow::n).size() < 2) continue;
        plots.push_back(
            {"Time per object against the number of objects, scene " + scene + ": lower is better.",
             line_plot(scene, "objects", "ns per object and frame",
                       "set logscale xy\nset format x '%.0s%c'\n",
                       lines(
                           of_scene, [](const ReportRow& row) { return static_cast<double>(row.n); },
                           nanoseconds_per_object))});
    }
}

/// Only scenes that differ in nothing but sizes can share a line: of those with about as many pairs per
/// object as the first scene, one of each ratio.
void plots_against_size_ratio(std::span<const ReportRow> rows, std::vector<Plot>& plots)
{
    const auto pairs_per_object = [](const ReportRow& row) {
        return static_cast<double>(row.pairs) / static_cast<double>(row.n);
    };
    const std::uint32_t threads = ascending(rows, &ReportRow::threads).front();
    for (const std::uint64_t n : ascending(rows, &ReportRow::n)) {
        const auto of_n = select(rows, [&](const ReportRow& row) {
            return row.n == n && row.size_ratio > 0 && row.threads == threads;
        });
        std::vector<const ReportRow*> chosen; // a row of each scene that takes part
        for (const ReportRow& row : of_n) {
            const bool alike =
                chosen.empty() || std::abs(pairs_per_object(row) / pairs_per_object(*chosen[0]) - 1) < 0.25;
            const bool known = std::any_of(chosen.begin(), chosen.end(), [&](const ReportRow* other) {
                return other->scene == row.scene || std::abs(other->size_ratio / row.size_ratio - 1) < 0.2;
            });
            if (alike && !known) chosen.push_back(&row);
        }
        if (chosen.size() < 2) continue;
        const auto comparable = select(of_n, [&](const ReportRow& row) {
            return std::any_of(chosen.begin(), chosen.end(),
                               [&](const ReportRow* one) { return one->scene == row.scene; });
        });
        std::string names;
        for (const ReportRow* one : chosen)
            names += (names.empty() ? "" : ", ") + one->scene;
        plots.push_back({"Time per object against the ratio of the biggest to the smallest box, " + count(n) +
                             " objects, scenes " + names + ": a flat line doesn't care about sizes.",
                         line_plot(count(n) + " objects", "biggest box / smallest box",
                                   "ns per object and frame", "set logscale xy\nset format x '%g'\n",
                                   lines(comparable, &ReportRow::size_ratio, nanoseconds_per_object))});
    }
}

void plots_against_threads(std::span<const ReportRow> rows, std::vector<Plot>& plots)
{
    for (const std::string& scene : distinct(rows, &ReportRow::scene)) {
        auto of_scene = select(rows, [&](const ReportRow& row) { return row.scene == scene; });
        if (of_scene.empty()) continue;
        const std::uint64_t n = ascending(of_scene, &ReportRow::n).back();
        of_scene = select(of_scene, [&](const ReportRow& row) { return row.n == n; });
        std::vector<Series> series;
        for (const std::string& system : distinct(of_scene, &ReportRow::system)) {
            Series line{system, system, false, {}};
            const ReportRow* one = find(of_scene, system, scene, n, 1);
            for (const ReportRow& row : of_scene)
                if (one != nullptr && row.system == system && row.median_ms > 0)
                    line.points.emplace_back(row.threads, one->median_ms / row.median_ms);
            std::sort(line.points.begin(), line.points.end());
            if (line.points.size() > 1) series.push_back(std::move(line));
        }
        if (series.empty()) continue;
        plots.push_back(
            {"Speed against one thread, scene " + scene + ", " + count(n) + " objects: higher is better.",
             line_plot(scene + ", " + count(n) + " objects", "threads", "times as fast as one thread",
                       "set yrange [0:*]\nset xtics 1\n", series)});
    }
}

void plots_of_stages(std::span<const ReportRow> rows, std::vector<Plot>& plots)
{
    for (const std::uint32_t threads : ascending(rows, &ReportRow::threads)) {
        const auto staged = select(rows, [&](const ReportRow& row) {
            return row.system == ours_name && row.threads == threads && !row.stages.empty();
        });
        if (staged.empty()) continue;
        const std::uint64_t n = ascending(staged, &ReportRow::n).back();
        std::vector<std::string> names;
        for (const ReportRow& row : staged)
            for (const auto& [name, ms] : row.stages)
                if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
        names.emplace_back(floor_name);

        std::ostringstream out;
        out.precision(9);
        out << "$data << END_OF_DATA\n";
        for (const ReportRow& row : staged) {
            if (row.n != n) continue;
            out << quoted(row.scene);
            for (const std::string& name : names) {
                const auto stage = std::find_if(row.stages.begin(), row.stages.end(),
                                                [&](const auto& s) { return s.first == name; });
                out << ' ' << (stage == row.stages.end() ? 0.0 : stage->second);
            }
            out << '\n';
            if (const ReportRow* floor = find(rows, floor_name, row.scene, n, threads)) {
                out << quoted("floor");
                for (std::size_t i = 0; i + 1 < names.size(); ++i)
                    out << " 0";
                out << ' ' << floor->median_ms << '\n';
            }
        }
        out << "END_OF_DATA\n";
        static constexpr std::array<const char*, 6> shades = {"#fdd0a2", "#fdae6b", "#d55e00",
                                                              "#8c2d04", "#6baed6", "#2171b5"};
        out << "set title " << quoted(count(n) + " objects, threads: " + std::to_string(threads))
            << "\nset ylabel 'ms per frame'\nset style data histograms\nset style histogram rowstacked\n"
               "set style fill solid 1 noborder\nset boxwidth 0.8\nset yrange [0:*]\nset xtics rotate by "
               "-35\nplot ";
        for (std::size_t i = 0; i < names.size(); ++i)
            out << (i == 0 ? "" : ", ") << "$data using " << i + 2 << (i == 0 ? ":xtic(1)" : "") << " title "
                << quoted(names[i]) << " lc rgb "
                << quoted(names[i] == floor_name ? "#999999" : shades[i % shades.size()]);
        out << '\n';
        plots.push_back(
            {"Jostle's stages, each scene beside the floor where it was measured: reading the boxes "
             "once, sorting n 32-bit keys with payloads, writing the pairs.",
             out.str()});
    }
}

/// Bars side by side, a group for each label, on a logarithmic axis: times differ by powers of ten.
void plots_of_bars(const ReportTable& table, std::vector<Plot>& plots)
{
    const auto known = [](std::vector<std::string>& names, const std::string& name) {
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    };
    std::vector<std::string> titles;
    for (const ReportTable::Bar& bar : table.bars)
        known(titles, bar.plot);
    for (const std::string& title : titles) {
        std::vector<std::string> labels, systems;
        double least = 0;
        for (const ReportTable::Bar& bar : table.bars)
            if (bar.plot == title) {
                known(labels, bar.label);
                known(systems, bar.system);
                least = least == 0 ? bar.value : std::min(least, bar.value);
            }
        if (labels.size() * systems.size() < 2) continue;
        std::ostringstream out;
        out.precision(9);
        out << "$data << END_OF_DATA\n";
        for (const std::string& label : labels) {
            out << quoted(label);
            for (const std::string& system : systems) {
                const auto bar =
                    std::find_if(table.bars.begin(), table.bars.end(), [&](const ReportTable::Bar& one) {
                        return one.plot == title && one.label == label && one.system == system;
                    });
                if (bar == table.bars.end())
                    out << " ?";
                else
                    out << ' ' << bar->value;
            }
            out << '\n';
        }
        out << "END_OF_DATA\nset datafile missing '?'\nset title " << quoted(title) << "\nset ylabel "
            << quoted(table.unit)
            << "\nset style data histograms\nset style histogram clustered gap 1\nset style fill solid 1 "
               "noborder\nset logscale y\nset yrange ["
            << least / 2
            << ":*]\nset format y '%g'\nunset grid\nset "
               "grid ytics lc rgb '#dddddd'\nset xtics rotate by -35\nplot ";
        for (std::size_t i = 0; i < systems.size(); ++i)
            out << (i == 0 ? "" : ", ") << "$data using " << i + 2 << (i == 0 ? ":xtic(1)" : "") << " title "
                << quoted(systems[i]) << " lc rgb " << quoted(colour(systems[i]));
        out << '\n';
        plots.push_back({table.title + ", " + title + ": lower is better.", out.str()});
    }
}

/// All plots, drawn by one gnuplot, as SVG.
std::vector<std::string> draw(const std::vector<Plot>& plots)
{
    check_gnuplot();
    std::string script; // read from stdin, and plots come on stdout: nothing stays behind, whatever ends this
    for (const Plot& plot : plots)
        script += "reset session\nset terminal svg size 620,400 noenhanced font 'sans-serif,12' background "
                  "'white'\nset output\nset key outside right top Left reverse samplen 2\n"
                  "set grid lc rgb '#dddddd'\n" +
                  plot.script + "unset terminal\n";
    const auto drawn = jostle_system::run_program({"gnuplot"}, jostle_system::Errors::shown, script);
    if (!drawn || !drawn->well) throw std::runtime_error("gnuplot failed");
    std::vector<std::string> images;
    constexpr std::string_view end_of_image = "</svg>";
    for (std::size_t begin = 0; images.size() < plots.size();) {
        begin = drawn->output.find_first_not_of('\n', begin); // which XML may not begin with: browsers mind
        const std::size_t end = drawn->output.find(end_of_image, begin);
        if (end == std::string::npos) throw std::runtime_error("gnuplot left a plot unfinished");
        images.push_back(drawn->output.substr(begin, end + end_of_image.size() - begin));
        begin = end + end_of_image.size();
    }
    return images;
}

/// As images by address rather than inline: gnuplot gives the parts of every SVG the same names.
std::string data_address(std::string_view svg)
{
    std::string out = "data:image/svg+xml,";
    for (const char c : svg) {
        const auto byte = static_cast<unsigned char>(c);
        const bool plain =
            byte >= 32 && byte <= 126 && std::string_view("%#\"<>&'").find(c) == std::string_view::npos;
        std::array<char, 4> escaped{};
        std::snprintf(escaped.data(), escaped.size(), "%%%02X", byte);
        out += plain ? std::string(1, c) : escaped.data();
    }
    return out;
}

// ---------------------------------------------------------------------------------------- tables

void write_table(std::span<const ReportRow> rows, std::uint32_t threads, std::ostream& out)
{
    const auto of_threads = select(rows, [&](const ReportRow& row) { return row.threads == threads; });
    const auto systems = distinct(of_threads, &ReportRow::system);
    out << "<h2>" << threads << (threads == 1 ? " thread" : " threads")
        << "</h2>\n<table>\n<tr><th>scene</th><th>objects</th><th>pairs</th>";
    for (const std::string& system : systems)
        out << "<th>" << html(system) << "</th>";
    out << "</tr>\n";
    for (const std::string& scene : distinct(of_threads, &ReportRow::scene))
        for (const std::uint64_t n : ascending(of_threads, &ReportRow::n)) {
            const auto cell = [&](std::string_view system) {
                return find(of_threads, system, scene, n, threads);
            };
            const ReportRow* ours = cell(ours_name);
            const ReportRow* any = ours;
            for (const std::string& system : systems)
                if (any == nullptr) any = cell(system);
            if (any == nullptr) continue;
            out << "<tr><td>" << html(scene) << "</td><td>" << count(n) << "</td><td>" << any->pairs
                << "</td>";
            for (const std::string& system : systems) {
                const ReportRow* row = cell(system);
                if (row == nullptr) {
                    out << "<td class=none>-</td>";
                    continue;
                }
                const bool differs = ours != nullptr && system != floor_name &&
                                     (row->pairs != ours->pairs || row->checksum != ours->checksum);
                out << "<td"
                    << (differs               ? " class=wrong"
                        : system == ours_name ? " class=ours"
                                              : "")
                    << " title=\"" << milliseconds(row->min_ms) << " to " << milliseconds(row->max_ms)
                    << " ms\">" << milliseconds(row->median_ms);
                if (ours != nullptr && row != ours && ours->median_ms > 0)
                    out << " <small>" << number(row->median_ms / ours->median_ms, "%.3g") << "x</small>";
                if (differs) out << "<br>other pairs: " << row->pairs;
                out << "</td>";
            }
            out << "</tr>\n";
        }
    out << "</table>\n";
}

/// All members of all rows. Figures are right-aligned.
void write_table(const ReportTable& table, std::ostream& out)
{
    out << "<table>\n<tr>";
    for (const std::string& column : table.columns)
        out << "<th>" << html(column) << "</th>";
    out << "</tr>\n";
    for (const std::vector<std::string>& row : table.rows) {
        out << "<tr>";
        for (const std::string& cell : row) {
            char* end = nullptr;
            std::strtod(cell.c_str(), &end);
            const bool figure = !cell.empty() && *end == '\0';
            out << (figure ? "<td>" : "<td class=word>") << html(cell) << "</td>";
        }
        out << "</tr>\n";
    }
    out << "</table>\n";
}

void write_plots(std::span<const Plot> plots, std::span<const std::string> images, std::ostream& out)
{
    out << "<div class=plots>\n";
    for (std::size_t i = 0; i < plots.size(); ++i)
        out << "<figure><img alt=\"" << html(plots[i].caption) << "\" src=\"" << data_address(images[i])
            << "\"><figcaption>" << html(plots[i].caption) << "</figcaption></figure>\n";
    out << "</div>\n";
}

constexpr const char* style_sheet = R"(<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<style>
:root { --paper: #fff; --ink: #222; --quiet: #555; --line: #ddd; --wrong: #fdd }
@media (prefers-color-scheme: dark) {
  :root { --paper: #14171c; --ink: #e6e8ec; --quiet: #a8afba; --line: #39404a; --wrong: #6b2323 }
  figure img { filter: invert(.92) hue-rotate(180deg) } /* plots are drawn on white */
}
body { font: 15px/1.45 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 1320px; margin: 2em auto; padding: 0 1em }
table { border-collapse: collapse; margin: 1em 0; display: block; overflow-x: auto; font-variant-numeric: tabular-nums }
th, td { padding: .2em .7em; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap }
th:first-child, td:first-child, td.word { text-align: left }
td.ours { font-weight: bold } td.wrong { background: var(--wrong) } td.none, small { color: var(--quiet) }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 480px), 1fr)); gap: 1.2em }
figure { margin: 0; max-width: 640px } figure img { width: 100% } figcaption { font-size: 13px; color: var(--quiet) }
pre { font-size: 13px; color: var(--quiet); white-space: pre-wrap }
</style>
)";

} // namespace

void check_gnuplot()
{
    if (!jostle_system::run_program({"gnuplot", "--version"}, jostle_system::Errors::taken))
        throw std::runtime_error("the report's plots need gnuplot, which isn't here: apt-get install "
                                 "gnuplot-nox");
}

void write_report(std::span<const ReportRow> rows, const std::string& about,
                  const std::filesystem::path& path, std::span<const ReportTable> tables)
{
    std::vector<std::pair<std::string, std::vector<Plot>>> chapters = {
        {"Time against the number of objects", {}},
        {"Time against sizes", {}},
        {"Threads", {}},
        {"Where Jostle's time goes", {}}};
    const std::size_t of_rows = chapters.size();
    if (!rows.empty()) {
        plots_against_n(rows, chapters[0].second);
        plots_against_size_ratio(rows, chapters[1].second);
        plots_against_threads(rows, chapters[2].second);
        plots_of_stages(rows, chapters[3].second);
    }
    for (const ReportTable& table : tables) {
        chapters.emplace_back(table.title, std::vector<Plot>{});
        plots_of_bars(table, chapters.back().second);
    }
    std::vector<Plot> plots;
    for (const auto& chapter : chapters)
        plots.insert(plots.end(), chapter.second.begin(), chapter.second.end());
    const std::vector<std::string> images = plots.empty() ? std::vector<std::string>{} : draw(plots);

    std::ostringstream out;
    out << "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>Jostle: "
           "measurements</title>\n"
        << style_sheet << "<h1>Jostle: measurements</h1>\n<pre>" << html(about) << "</pre>\n";
    if (!rows.empty()) {
        out << "<p>Median milliseconds per frame; point at a figure to see the fastest and the slowest "
               "frame. "
               "Small: "
               "how many times Jostle's time. Red: the system found other pairs than Jostle.</p>\n";
        for (const std::uint32_t threads : ascending(rows, &ReportRow::threads))
            write_table(rows, threads, out);
    }
    std::span<const std::string> left = images;
    for (std::size_t c = 0; c < chapters.size(); ++c) {
        const auto& [title, of_chapter] = chapters[c];
        if (c < of_rows && of_chapter.empty()) continue;
        out << "<h2>" << html(title) << "</h2>\n";
        write_plots(of_chapter, left.first(of_chapter.size()), out);
        left = left.subspan(of_chapter.size());
        if (c >= of_rows) write_table(tables[c - of_rows], out);
    }
    out << "</html>\n";

    try {
        jostle_system::UnfinishedFile file(path);
        file.write(out.str());
        file.commit();
    } catch (const std::system_error& error) {
        throw std::runtime_error("cannot write " + jostle_system::text_of(path) + ": " +
                                 error.code().message());
    }
}

} // namespace jostle_bench
