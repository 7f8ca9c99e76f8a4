// SPDX-License-Identifier: MIT
// killed save FOLDER: a scene over all ranks, saved, until the last rank is killed in the middle.
// killed resume FOLDER PARTS: goes on from there, on however many ranks.
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

#include "jostle/mpi.hpp"
#include "tool/scenes/scenes.hpp"

int main(int count, char** arguments)
{
    int provided = 0, rank = 0, ranks = 1;
    MPI_Init_thread(&count, &arguments, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (count < 3) return 2;
    const bool resumes = std::string(arguments[1]) == "resume";
    const auto file = [&](int part) { return std::string(arguments[2]) + "/part" + std::to_string(part); };
    jostle_scenes::Scene<3, float> scene("uniform", 3000);
    bool good = true;
    {
        jostle::mpi::World3f world(MPI_COMM_WORLD, {.executor = &jostle::serial_executor()});
        const auto move_all = [&] {
            scene.step();
            for (std::size_t i = 0; i < scene.boxes().size(); ++i)
                if (world.contains(i)) world.move(i, scene.boxes()[i]);
            world.update();
        };
        if (resumes) {
            std::vector<std::vector<std::byte>> parts;
            for (int part = rank; part < std::stoi(arguments[3]); part += ranks) {
                std::ifstream in(file(part), std::ios::binary);
                const std::string text{std::istreambuf_iterator<char>(in), {}};
                const auto* const first = reinterpret_cast<const std::byte*>(text.data());
                parts.emplace_back(first, first + text.size());
            }
            world.restore(parts);
            scene.step(); // to the frame that was saved
            move_all();
            std::uint64_t pairs = world.changed_pairs().size();
            MPI_Allreduce(MPI_IN_PLACE, &pairs, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
            good = pairs == jostle::find_pairs(scene.boxes()).size() && pairs > 0;
            std::printf("resumed with %zu objects on rank %d, %llu pairs in all\n", world.size(), rank,
                        static_cast<unsigned long long>(pairs));
        } else {
            for (std::size_t i = static_cast<std::size_t>(rank); i < scene.boxes().size();
                 i += static_cast<std::size_t>(ranks))
                world.add(i, scene.boxes()[i]);
            world.update();
            move_all();
            const std::vector<std::byte> bytes = world.save();
            std::ofstream out(file(rank), std::ios::binary);
            out.write(reinterpret_cast<const char*>(bytes.data()),
                      static_cast<std::streamsize>(bytes.size()));
            out.close();
            MPI_Barrier(MPI_COMM_WORLD); // all parts are written
            for (int frame = 0;; ++frame) {
                if (frame == 3 && rank == ranks - 1) std::raise(SIGKILL);
                move_all();
            }
        }
    }
    MPI_Finalize();
    return good ? 0 : 1;
}
