// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bench/report.hpp"
#include "commands.hpp"
#include "text.hpp"

/// What `jostle bench` and its subcommands have in common.

namespace jostle_tool {

/// -n: how many boxes, one or several.
void add_sizes_option(const Command& command, std::vector<std::uint64_t>& sizes, const std::string& preset);

/// --threads: one number or several. 0, one per core, stays if it isn't given.
void add_thread_counts_option(const Command& command, std::vector<std::uint32_t>& threads);

/// --json: where a RowsFile goes.
void add_rows_file_option(const Command& command, std::string& file);

/// Throws a UsageError for the name of a scene that there isn't; `others` might be meant as well.
void check_scenes(const std::vector<std::string>& names, const std::vector<std::string>& others = {});

/// Before minutes of work: throws a UsageError where the page of --report can't be written after it, or is
/// the file of --json. Empty: not wanted.
void check_report(const std::string& report, const std::string& json);

/// Writes the page of --report.
void write_page(std::span<const jostle_bench::ReportRow> rows, const std::string& about,
                const std::string& report);

/// Throws a UsageError if --peers was given to a build that has none.
void check_for_peers(bool wanted);

/// The entries that are named, in the order of the names; all of them if no name is given. Throws a
/// UsageError for a name that no entry has; `what` says what an entry is.
template <class Entry, std::size_t Count>
std::vector<const Entry*> choose(const std::vector<std::string>& names, const Entry (&entries)[Count],
                                 const std::string& what)
{
    std::vector<const Entry*> chosen;
    std::vector<std::string> known;
    for (const Entry& entry : entries) {
        known.emplace_back(entry.name);
        if (names.empty()) chosen.push_back(&entry);
    }
    for (const std::string& name : names) {
        const std::size_t before = chosen.size();
        for (const Entry& entry : entries)
            if (name == entry.name) chosen.push_back(&entry);
        if (chosen.size() == before) throw UsageError(name + " is no " + what + suggestion(name, known));
    }
    return chosen;
}

} // namespace jostle_tool
