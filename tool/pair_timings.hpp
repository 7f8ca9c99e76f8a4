// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "bench_run.hpp"
#include "numbers.hpp"
#include "turns.hpp"

/// How `jostle bench distances` and `jostle bench plane` time queries about pairs, and show the times.

namespace jostle_tool {

/// A part about queries, and the options of such; the last three are of help.
inline void add_pair_queries(const Command& bench, const std::string& name, const std::string& summary,
                             const std::string& footer, void (*run)(const BenchOptions&),
                             const std::string& pairs, const std::string& seed, const std::string& peers)
{
    const auto [command, options] =
        add_bench_part(bench, name, summary, footer, run, {.count = 10'000, .frames = 7});
    command.texts("PAIR", options.names, "Which pairs of shapes; all if none is given");
    command.number("-n", options.count, 1, 10'000'000, "N", pairs);
    command.number("--repetitions", options.frames, 1, 100'000, "R", "How often each is asked (7)");
    command.seed(options.seed, seed);
    command.flag("--peers", options.peers, peers);
    add_rows_file_option(command, options.json);
}

/// Rows of a table on the screen, where it is shown, and of a file.
class PairTimings : public BenchTable
{
  public:
    explicit PairTimings(const BenchOptions& options) : BenchTable(options), repetitions_(options.frames)
    {
        if (shown())
            std::printf("%-19s %-11s %6s  %-8s %11s %11s %11s %14s\n", "pair", "query", "pairs", "system",
                        "ns/pair", "min", "max", "mean answer");
    }
    /// So many pairs, of which the next rows are.
    void start(const char* pair, std::uint64_t count)
    {
        pair_ = pair;
        answers_.assign(count, 0);
    }
    /// A row of answers that ask(i) gives one by one. Returns the median ns, to be others' reference.
    template <class Ask>
    double one_by_one(const char* system, const char* query, double reference_ns, const Ask& ask)
    {
        return together(
            system, query, reference_ns,
            [&] {
                for (std::size_t i = 0; i < answers_.size(); ++i)
                    answers_[i] = static_cast<double>(ask(i));
            },
            [](std::vector<double>&) {});
    }
    /// The same of all that ask() gives at once, and `tell` says afterwards.
    template <class Ask, class Tell>
    double together(const char* system, const char* query, double reference_ns, const Ask& ask,
                    const Tell& tell)
    {
        std::vector<double> ns = sorted_times(1, repetitions_, [](std::uint32_t) {}, ask);
        for (double& time : ns)
            time *= 1e6 / static_cast<double>(answers_.size());
        tell(answers_);
        double sum = 0;
        for (const double answer : answers_)
            sum += answer;
        add_row(system, query, ns, sum / static_cast<double>(answers_.size()), reference_ns);
        return median(ns);
    }

  private:
    void add_row(const char* system, const char* query, const std::vector<double>& ns, double mean,
                 double reference_ns)
    {
        add({{"system", system},
             {"pair", pair_},
             {"query", query},
             {"pairs", answers_.size()},
             {"median_ns", std::round(median(ns) * 10) / 10},
             {"min_ns", std::round(ns.front() * 10) / 10},
             {"max_ns", std::round(ns.back() * 10) / 10},
             {"mean", rounded(mean)}});
        if (!shown()) return;
        std::printf("%-19s %-11s %6zu  %-8s %11.1f %11.1f %11.1f %14.6f", pair_, query, answers_.size(),
                    system, median(ns), ns.front(), ns.back(), mean);
        if (reference_ns > 0) std::printf("   %.1fx", median(ns) / reference_ns);
        std::printf("\n");
        std::fflush(stdout);
    }

    std::uint32_t repetitions_;
    const char* pair_ = nullptr;
    std::vector<double> answers_;
};

} // namespace jostle_tool
