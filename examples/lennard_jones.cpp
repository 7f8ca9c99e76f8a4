// SPDX-License-Identifier: MIT
// Lennard-Jones atoms in a triclinic cell: a crystal melts, and its energy is conserved. A skin saves most
// searches. Usage: lennard_jones [EDGE] [STEPS]
#include <jostle/jostle.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace {

using jostle::Vec3d;
constexpr double cutoff = 2.5, dt = 0.002;

/// How two atoms act on each other at a distance.
struct Bond
{
    double force, energy;
};
Bond plain(double distance)
{
    const double s = std::pow(distance, -6);
    return {24 * (2 * s * s - s) / distance, 4 * (s * s - s)};
}
/// Both end at the cutoff without a step, or energy would leak there.
Bond shifted(double distance)
{
    static const Bond last = plain(cutoff);
    const Bond here = plain(distance);
    return {here.force - last.force, here.energy - last.energy + (distance - cutoff) * last.force};
}

} // namespace

int main(int argc, char** argv)
{
    const int edge = argc > 1 ? std::atoi(argv[1]) : 8; // in unit cells of one atom
    const int steps = argc > 2 ? std::atoi(argv[2]) : 10'000;
    const double half = 0.5 * std::cbrt(4 / 0.8442); // of a face-centred cube at this density
    const Vec3d unit[3] = {{0, half, half}, {half, 0, half}, {half, half, 0}};
    jostle::PeriodicCell<3, double> cell;
    for (int k = 0; k < 3; ++k)
        cell.vectors[k] = unit[k] * double(edge), cell.repeats[k] = true;
    std::mt19937 random(1);
    const auto speed = [&] { return static_cast<double>(random()) / 1073741824.0 - 2; };
    std::vector<Vec3d> at, velocity;
    for (int i = 0; i < edge * edge * edge; ++i) {
        at.push_back(unit[0] * double(i / edge / edge) + unit[1] * double(i / edge % edge) +
                     unit[2] * double(i % edge));
        velocity.push_back({speed(), speed(), speed()});
    }

    jostle::NeighborFinder<3, double> finder; // keep it: it keeps its memory, and what the skin keeps
    std::vector<Vec3d> force(at.size());
    std::vector<double> energy(at.size());
    int searches = 0;
    const auto find_forces = [&] {
        const auto& list =
            finder.find(at, cutoff, cell, {.shifts = false, .vectors = true, .distances = true, .skin = 0.4});
        searches += list.searched;
        // Each atom has a row of its own, so threads need neither locks nor merging.
        jostle::process_items(at.size(), [&](std::uint64_t begin, std::uint64_t end, jostle::Work) {
            for (auto i = static_cast<std::size_t>(begin); i < end; ++i) {
                force[i] = {}, energy[i] = 0;
                for (std::uint64_t k = list.offsets[i]; k < list.offsets[i + 1]; ++k) {
                    const Bond bond = shifted(list.distances[k]);
                    force[i] -= list.vectors[k] * (bond.force / list.distances[k]);
                    energy[i] += bond.energy / 2; // the other half is in the other's row
                }
            }
        });
    };
    const auto kinetic = [&] {
        double sum = 0;
        for (const Vec3d& v : velocity)
            sum += jostle::dot(v, v) / 2;
        return sum;
    };
    const auto total = [&] {
        double sum = kinetic();
        for (const double each : energy)
            sum += each;
        return sum;
    };
    find_forces();
    const double before = total(), motion = kinetic();
    double most = 0;
    for (int step = 0; step < steps; ++step) { // velocity Verlet
        for (std::size_t i = 0; i < at.size(); ++i) {
            velocity[i] += force[i] * (dt / 2);
            at[i] += velocity[i] * dt; // also out of the cell: nothing has to be wrapped
        }
        find_forces();
        for (std::size_t i = 0; i < at.size(); ++i)
            velocity[i] += force[i] * (dt / 2);
        most = std::max(most, std::abs(total() - before));
    }
    std::printf("%zu atoms, %d steps, %d searches: energy %.4f an atom, which changed by %.6f at most\n",
                at.size(), steps, searches, before / static_cast<double>(at.size()),
                most / static_cast<double>(at.size()));
    return most < 1e-3 * motion && 5 * searches < steps && kinetic() < 0.9 * motion ? 0 : 1;
}
