// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>

namespace jostle_tool {

class Command;

/// The user's fault: a bad file, number or option. main() prints `jostle: message` as one line and exits
/// with 2. Say where (FILE:ROW:COLUMN, as far as there are rows), what, and what to do.
class UsageError : public std::runtime_error
{
  public:
    using std::runtime_error::runtime_error;
};

// Each adds one subcommand, whose callback does the work and throws what goes wrong.
void add_pairs_command(const Command& app);
void add_bench_command(const Command& app);
void add_chapter_command(const Command& app);
void add_compare_command(const Command& app);
void add_surface_command(const Command& app);
void add_demo_command(const Command& app);
void add_simulate_command(const Command& app);
void add_replay_command(const Command& app);
void add_report_command(const Command& app);
void add_distribute_command(const Command& app);

void add_bench_world_command(const Command& bench);     // jostle bench world
void add_bench_queries_command(const Command& bench);   // jostle bench queries
void add_bench_responses_command(const Command& bench); // jostle bench responses
void add_bench_programs_command(const Command& bench);  // jostle bench programs

void add_bench_scenes_command(const Command& bench);    // jostle bench scenes
void add_bench_contacts_command(const Command& bench);  // jostle bench contacts
void add_bench_distances_command(const Command& bench); // jostle bench distances
void add_bench_plane_command(const Command& bench);     // jostle bench plane
void add_bench_neighbors_command(const Command& bench); // jostle bench neighbors
void add_bench_surfaces_command(const Command& bench);  // jostle bench surfaces

} // namespace jostle_tool
