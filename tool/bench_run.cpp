// SPDX-License-Identifier: MIT
#include "bench_run.hpp"

#include <memory>
#include <stdexcept>

namespace jostle_tool {

BenchPart add_bench_part(const Command& bench, const std::string& name, const std::string& summary,
                         const std::string& footer, void (*run)(const BenchOptions&),
                         const BenchOptions& usual)
{
    const auto options = std::make_shared<BenchOptions>(usual);
    const Command command = bench.add(name, summary, footer);
    command.on_run([options, run] { run(*options); });
    return {command, *options};
}

BenchTable::BenchTable(const BenchOptions& options)
    : file_((check_for_peers(options.peers), options.json)) // before the file is touched
{
}

void BenchTable::finish()
{
    file_.write();
    if (!difference_.empty()) throw std::runtime_error(difference_);
}

} // namespace jostle_tool
