// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "bench_options.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "rows.hpp"

/// How `jostle bench distances` and `jostle bench plane` time questions about pairs, and show the times.

namespace jostle_tool {

struct PairOptions
{
    std::vector<std::string> combinations;
    std::uint64_t pairs = 10'000;
    std::uint32_t repetitions = 7;
    std::uint64_t seed = 1;
    bool peers = false;
    std::string json;
};
inline void add_pair_options(const Command& command, PairOptions& options, const std::string& pairs,
                             const std::string& seed, const std::string& peers)
{
    command.texts("PAIR", options.combinations, "Which pairs of shapes; all if none is given");
    command.number("-n", options.pairs, 1, 10'000'000, "N", pairs);
    command.number("--repetitions", options.repetitions, 1, 100'000, "R", "How often each is asked (7)");
    command.seed(options.seed, seed);
    command.flag("--peers", options.peers, peers);
    add_rows_file_option(command, options.json);
}

/// The times of some repetitions, ns a pair, in ascending order.
template <class Ask>
std::vector<double> measure(std::size_t pairs, std::uint32_t repetitions, const Ask& ask)
{
    using Clock = std::chrono::steady_clock;
    std::vector<double> ns;
    for (std::uint32_t r = 0; r <= repetitions; ++r) {
        const Clock::time_point before = Clock::now();
        ask();
        const double time = std::chrono::duration<double, std::nano>(Clock::now() - before).count();
        if (r > 0) ns.push_back(time / static_cast<double>(pairs));
    }
    std::sort(ns.begin(), ns.end());
    return ns;
}

/// Rows of a table on the screen, where it is shown, and of a file.
class PairTimings
{
  public:
    explicit PairTimings(RowsFile& file) : file_(file), shown_(file.beside_table())
    {
        if (shown_)
            std::printf("%-19s %-11s %6s  %-8s %11s %11s %11s %14s\n", "pair", "question", "pairs", "system",
                        "ns/pair", "min", "max", "mean answer");
    }
    void add(const char* system, const char* pair, const char* question, std::size_t pairs,
             const std::vector<double>& ns, double mean, double reference_ns)
    {
        JsonRow json;
        json.set("system", system);
        json.set("pair", pair);
        json.set("question", question);
        json.set("pairs", pairs);
        json.set("median_ns", std::round(median(ns) * 10) / 10);
        json.set("min_ns", std::round(ns.front() * 10) / 10);
        json.set("max_ns", std::round(ns.back() * 10) / 10);
        json.set("mean", rounded(mean));
        file_.add(json);
        if (!shown_) return;
        std::printf("%-19s %-11s %6zu  %-8s %11.1f %11.1f %11.1f %14.6f", pair, question, pairs, system,
                    median(ns), ns.front(), ns.back(), mean);
        if (reference_ns > 0) std::printf("   %.1fx", median(ns) / reference_ns);
        std::printf("\n");
        std::fflush(stdout);
    }

  private:
    RowsFile& file_;
    bool shown_;
};

} // namespace jostle_tool
