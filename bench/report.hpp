// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace jostle_bench {

/// One measurement, as in the results' JSON.
struct ReportRow
{
    std::string system; ///< "jostle", "embree", ..., "floor"
    std::string scene;
    std::uint64_t n = 0; ///< objects
    std::uint32_t threads = 1;
    double median_ms = 0, min_ms = 0, max_ms = 0; ///< wall clock of a frame
    std::uint64_t pairs = 0;
    std::string checksum;
    std::vector<std::pair<std::string, double>> stages; ///< name and ms, in the order of work; may be empty
    /// The biggest box's longest edge over the smallest one's; 0 where it isn't known.
    double size_ratio = 0;
};

/// Measurements of any other kind: a table as it is, and bars of one time for each row.
struct ReportTable
{
    std::string title;
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows; ///< a text for each column
    std::string unit;                           ///< of the bars
    struct Bar
    {
        std::string plot;   ///< bars of one plot have the same text here; it is the plot's title
        std::string label;  ///< what was measured
        std::string system; ///< of what: a colour each
        double value;       ///< more than 0
    };
    std::vector<Bar> bars; ///< none where there is nothing to compare
};

/// Throws the std::runtime_error of write_report where gnuplot is missing.
void check_gnuplot();

/// Writes one self-contained HTML file: tables of all rows against the system "jostle", and gnuplot's plots
/// of time against n, size ratio and threads, and of Jostle's stages beside the floor. A plot whose rows
/// aren't there (one n only, one thread count only) is left out.
///
/// `about` is the line below the title: machine, date, command.
/// Errors  std::runtime_error where gnuplot is missing or fails, or the file can't be written; then no file
///         is left or changed.
void write_report(std::span<const ReportRow> rows, const std::string& about,
                  const std::filesystem::path& path, std::span<const ReportTable> tables = {});

} // namespace jostle_bench
