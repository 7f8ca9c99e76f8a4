// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench_options.hpp"
#include "options.hpp"
#include "rows.hpp"

/// What the parts of `jostle bench` have in common: what they are asked for, and what they give.

namespace jostle_tool {

/// What a part may be asked for. Each takes some of these.
struct BenchOptions
{
    std::vector<std::string> names = {}; ///< of what is measured; all of it if there are none
    std::vector<std::uint64_t> sizes = {};
    std::uint64_t count = 0;
    double scale = 1;
    std::vector<std::uint32_t> threads = {0}; ///< 0: one per core
    std::uint32_t frames = 0;                 ///< or repetitions
    std::uint64_t seed = 1;
    bool peers = false;
    std::string json = {}; ///< empty: not wanted
};

/// A part while it is said what it takes.
struct BenchPart
{
    Command command;
    BenchOptions& options; ///< what it is run with; at first what counts if nothing is given
};
[[nodiscard]] BenchPart add_bench_part(const Command& bench, const std::string& name,
                                       const std::string& summary, const std::string& footer,
                                       void (*run)(const BenchOptions&), const BenchOptions& usual);

/// What a part gives: rows as JSON, and a table beside them unless they go to stdout.
class BenchTable
{
  public:
    /// Throws a UsageError for peers that the build lacks, or a file that can't be written.
    explicit BenchTable(const BenchOptions& options);

    /// Whether there is a table.
    [[nodiscard]] bool shown() const { return file_.beside_table(); }
    void add(const JsonRow& row) { file_.add(row); }
    /// Two systems that should agree don't.
    void differ(const std::string& how) { difference_ = how; }
    /// After the last row. Throws a std::runtime_error if systems differed.
    void finish();

  private:
    RowsFile file_;
    std::string difference_;
};

} // namespace jostle_tool
