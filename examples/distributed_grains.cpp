// SPDX-License-Identifier: MIT
// Two clouds of grains fly into each other, over all ranks: mpiexec -n 4 example_distributed_grains
// A rank pushes the grains of its pairs apart, and sends the pushes of another rank's grains to that rank.
#include <jostle/mpi.hpp>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>

struct Grain
{
    jostle::Vec3f at, speed, push;
};
struct Push
{
    std::uint64_t id;
    jostle::Vec3f by;
};
constexpr float radius = 0.5f, stiffness = 60, step = 0.02f;

jostle::Aabb3f box_of(const Grain& grain)
{
    const jostle::Vec3f& at = grain.at;
    return {{at[0] - radius, at[1] - radius, at[2] - radius},
            {at[0] + radius, at[1] + radius, at[2] + radius}};
}

int main(int count, char** arguments)
{
    int provided = 0, rank = 0, ranks = 1;
    MPI_Init_thread(&count, &arguments, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    int lost = 0;
    {                                          // the world goes before MPI does
        std::map<std::uint64_t, Grain> grains; // of this rank
        jostle::mpi::WorldOptions options;
        options.pack = [&](std::uint64_t id, std::vector<std::byte>& bytes) {
            bytes.resize(sizeof(Grain));
            std::memcpy(bytes.data(), &grains.at(id), sizeof(Grain));
        };
        jostle::mpi::World3f world(MPI_COMM_WORLD, options);
        const int all = 4000;
        for (int i = rank; i < all; i += ranks) { // anywhere: they migrate to the rank that searches there
            const float side = i % 2 == 0 ? -1.f : 1.f, x = side * (6.f + float(i / 200));
            const auto id = static_cast<std::uint64_t>(i);
            grains[id] = {{x, float(i % 20), float(i / 20 % 10)}, {side * -2, 0, 0}, {}};
            world.add(id, box_of(grains[id]));
        }
        for (int frame = 0; frame < 200; ++frame) {
            world.update();
            for (const std::uint64_t id : world.departed())
                grains.erase(id);
            for (const jostle::mpi::Arrival& arrival : world.arrived())
                std::memcpy(&grains[arrival.id], arrival.payload.data(), sizeof(Grain));
            std::vector<std::vector<Push>> to(static_cast<std::size_t>(ranks));
            for (const auto& pair : world.changed_pairs()) {
                jostle::Vec3f way, push{};
                for (int d = 0; d < 3; ++d)
                    way[d] = pair.bounds_b.lo[d] - pair.bounds_a.lo[d];
                const float distance = std::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
                if (distance >= 2 * radius || distance == 0) continue; // their boxes touch, they don't
                for (int d = 0; d < 3; ++d)
                    push[d] = way[d] / distance * stiffness * (2 * radius - distance);
                to[static_cast<std::size_t>(pair.rank_of_b)].push_back({pair.b, push});
                for (int d = 0; d < 3; ++d)
                    grains.at(pair.a).push[d] -= push[d];
            }
            for (int other = 0; other < ranks; ++other) { // a shift at a time; neighbours alone would do
                const auto& mine = to[static_cast<std::size_t>((rank + other) % ranks)];
                int from_there = 0, here = static_cast<int>(mine.size() * sizeof(Push));
                const int target = (rank + other) % ranks, source = (rank - other + ranks) % ranks;
                MPI_Sendrecv(&here, 1, MPI_INT, target, 0, &from_there, 1, MPI_INT, source, 0, MPI_COMM_WORLD,
                             MPI_STATUS_IGNORE);
                std::vector<Push> theirs(static_cast<std::size_t>(from_there) / sizeof(Push));
                MPI_Sendrecv(mine.data(), here, MPI_BYTE, target, 1, theirs.data(), from_there, MPI_BYTE,
                             source, 1, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
                for (const Push& push : theirs)
                    for (int d = 0; d < 3; ++d)
                        grains.at(push.id).push[d] += push.by[d];
            }
            for (auto& [id, grain] : grains) {
                for (int d = 0; d < 3; ++d) {
                    grain.speed[d] += step * grain.push[d];
                    grain.at[d] += step * grain.speed[d];
                }
                grain.push = {};
                world.move(id, box_of(grain));
            }
        }
        double sums[4] = {double(grains.size()), 0, 0, 0}; // how many, and their momentum, which was 0
        for (const auto& [id, grain] : grains)
            for (int d = 0; d < 3; ++d)
                sums[d + 1] += grain.speed[d];
        MPI_Allreduce(MPI_IN_PLACE, sums, 4, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
        lost = sums[0] != all || std::abs(sums[1]) + std::abs(sums[2]) + std::abs(sums[3]) > 1;
        std::printf("rank %d has %zu of %.0f grains, space was divided %llu times, momentum %.3f\n", rank,
                    grains.size(), sums[0], static_cast<unsigned long long>(world.stats().partitions),
                    sums[1]);
    }
    MPI_Finalize();
    return lost;
}
