// SPDX-License-Identifier: MIT
// jostle distribute: one scene over many ranks of MPI, on this machine.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench_options.hpp"
#include "commands.hpp"
#include "numbers.hpp"
#include "tool/scenes/scenes.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

struct Options
{
    std::string scene = "uniform";
    std::uint64_t objects = 100'000, seed = 1;
    std::uint32_t ranks = 2, threads = 1, frames = 20;
    std::vector<std::uint32_t> predict;
    std::string json;
};

/// The program that mpiexec starts lies beside this one, in a build with MPI.
std::filesystem::path program_for_ranks()
{
    std::error_code unknown;
    const std::filesystem::path here = jostle_system::this_program().parent_path();
    for (const char* const place : {"jostle_distribute", "../extras/mpi/jostle_distribute"})
        if (std::filesystem::exists(here / place, unknown)) return (here / place).lexically_normal();
    throw UsageError("distribute: this build has no MPI; install libopenmpi-dev, openmpi-bin and "
                     "libtrilinos-zoltan-dev, configure and build again");
}

/// Runs a program and returns what it printed. What it says on stderr goes there.
std::string output_of(const std::vector<std::string>& command)
{
    const std::optional<jostle_system::Finished> finished =
        jostle_system::run_program(command, jostle_system::Errors::shown);
    if (!finished) throw UsageError("distribute: " + command[0] + " can't be started; install openmpi-bin");
    if (!finished->well) throw UsageError("distribute: a rank failed; what it said is above");
    return finished->output;
}

void print(const nlohmann::ordered_json& row)
{
    std::printf("%-20s %-12s %11s %5u ranks ", row["system"].get<std::string>().c_str(),
                row["scene"].get<std::string>().c_str(), grouped(row["n"].get<std::uint64_t>()).c_str(),
                row["ranks"].get<std::uint32_t>());
    if (row.contains("median_ms"))
        std::printf("%10.3f ms  %s pairs", row["median_ms"].get<double>(),
                    grouped(row["pairs"].get<std::uint64_t>()).c_str());
    if (row.contains("ghosts"))
        std::printf("  %s ghosts", grouped(row["ghosts"].get<std::uint64_t>()).c_str());
    if (row.contains("bytes")) std::printf("  %s bytes", grouped(row["bytes"].get<std::uint64_t>()).c_str());
    if (row.contains("imbalance")) std::printf("  imbalance %.2f", row["imbalance"].get<double>());
    if (row.contains("most_neighbours"))
        std::printf("  at most %llu neighbours", row["most_neighbours"].get<unsigned long long>());
    std::printf("\n");
}

void distribute(const Options& options)
{
    try {
        (void)jostle_scenes::scene_info(options.scene);
    } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
    }
    RowsFile file(options.json);
    // As root, and with more ranks than cores: it is one machine, for trying out.
    for (const char* const name :
         {"OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_rmaps_base_oversubscribe"})
        jostle_system::set_default_variable(name, "1");
    jostle_system::set_default_variable("OMPI_MCA_hwloc_base_binding_policy", "none");
    const std::string objects = std::to_string(options.objects), seed = std::to_string(options.seed);
    std::vector<std::string> command = {"mpiexec", "-n",
                                        std::to_string(options.predict.empty() ? options.ranks : 1),
                                        jostle_system::text_of(program_for_ranks())};
    if (options.predict.empty())
        command.insert(command.end(), {"run", options.scene, objects, std::to_string(options.threads),
                                       std::to_string(options.frames), seed});
    else
        command.insert(command.end(), {"predict", options.scene, objects, seed});
    for (const std::uint32_t ranks : options.predict)
        command.push_back(std::to_string(ranks));
    std::istringstream text(output_of(command));
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (std::string line; std::getline(text, line);) {
        rows.push_back(nlohmann::ordered_json::parse(line));
        if (options.json != "-") print(rows.back());
    }
    file.write(rows);
}

} // namespace

void add_distribute_command(CLI::App& app)
{
    auto options = std::make_shared<Options>();
    CLI::App* const command = app.add_subcommand(
        "distribute", "One scene over many ranks of MPI, on this machine, beside an all-gather of its boxes");
    command->add_option("scene", options->scene, "The scene (uniform)")->type_name("SCENE");
    command->add_option("-n", options->objects, "How many boxes, 1 to 10,000,000 (100,000)")
        ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{10'000'000}).description(""))
        ->type_name("N");
    command->add_option("--ranks", options->ranks, "How many ranks, 1 to 256 (2)")
        ->check(CLI::Range(1u, 256u).description(""))
        ->type_name("R");
    command->add_option("--threads", options->threads, "How many threads in each rank (1)")
        ->check(CLI::Range(1u, 1024u).description(""))
        ->type_name("T");
    command->add_option("--frames", options->frames, "How many frames are timed (20)")
        ->check(CLI::Range(1u, 100'000u).description(""))
        ->type_name("F");
    command->add_option("--seed", options->seed, "Of the scene (1)")->type_name("SEED");
    command
        ->add_option("--predict", options->predict,
                     "Times nothing: counts what so many ranks would search and send, several with commas")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(1u, 4096u).description(""))
        ->type_name("R");
    add_rows_file_option(*command, options->json);
    command->footer(R"(Examples:
  jostle distribute uniform -n 1000000 --ranks 2
  jostle distribute clustered -n 1000000 --predict 64,256,1000)");
    command->callback([options] { distribute(*options); });
}

} // namespace jostle_tool
