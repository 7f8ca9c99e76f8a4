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

#include <nlohmann/json.hpp>

#include "bench_options.hpp"
#include "commands.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "rows.hpp"
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
    if (!finished->well) throw UsageError("distribute: a rank failed; its message is above");
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
    for (std::string line; std::getline(text, line);) {
        const auto row = nlohmann::ordered_json::parse(line);
        file.add_text(row.dump());
        if (file.beside_table()) print(row);
    }
    file.write();
}

} // namespace

void add_distribute_command(const Command& app)
{
    const auto options = std::make_shared<Options>();
    const Command command = app.add(
        "distribute", "Times a scene over several MPI ranks on this machine, and an all-gather of its boxes",
        R"(Examples:
  jostle distribute uniform -n 1000000 --ranks 2
  jostle distribute clustered -n 1000000 --predict 64,256,1000)");
    command.text("scene", options->scene, "SCENE", "The scene (uniform)");
    command.number("-n", options->objects, 1, 10'000'000, "N", "How many boxes, 1 to 10,000,000 (100,000)");
    command.number("--ranks", options->ranks, 1, 256, "R", "How many ranks, 1 to 256 (2)");
    command.number("--threads", options->threads, 1, 1024, "T", "How many threads in each rank (1)");
    command.number("--frames", options->frames, 1, 100'000, "F", "How many frames are timed (20)");
    command.number("--seed", options->seed, 0, ~std::uint64_t{0}, "SEED", "Of the scene (1)");
    command.numbers("--predict", options->predict, 1u, 4096u, "R",
                    "Count what that many ranks would search and send, without timing; several with commas");
    add_rows_file_option(command, options->json);
    command.on_run([options] { distribute(*options); });
}

} // namespace jostle_tool
